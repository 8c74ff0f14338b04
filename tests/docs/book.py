"""The book's rules, each as a function that yields a line for what breaks it."""

import hashlib
import html.parser
import itertools
import os
import pathlib
import re
import urllib.parse

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
MOST_LINES = 400
MOST_FRONT_LINES = 200
LEAST_QUESTIONS = 10
LINK = re.compile(r"\]\(<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\)|<(?:img|a)[^>]*\s(?:src|href)=\"([^\"]+)\"")
IS_REMOTE = re.compile(r"^(?:\w+:)?//|^mailto:|^data:")


def pages(root):
    """All Markdown that people read, the front door first."""
    front = [root / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "runtime/devices/README.md")]
    return [page for page in front if page.exists()] + sorted((root / "docs").rglob("*.md"))


def prose(text):
    """Without code, which has brackets of its own."""
    text = re.sub(r"^( *)(`{3,}|~{3,}).*?^\1\2`*$", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"(`+)(?!`).*?(?<!`)\1(?!`)", "``", text, flags=re.DOTALL)


def links(page):
    return [one or other for one, other in LINK.findall(prose(page.read_text()))]


def anchors(page):
    """What a forge calls the headings of a page, and the anchors that it sets itself."""
    text = re.sub(r"^( *)(`{3,}|~{3,}).*?^\1\2`*$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    names = re.findall(r"<a\s+(?:id|name)=\"([^\"]+)\"", text) + re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE)
    for title in re.findall(r"^#{1,6} +(.+?)[ #]*$", text, re.MULTILINE):
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title)
        name = re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")
        count = sum(re.fullmatch(rf"{re.escape(name)}(-\d+)?", other) is not None for other in names)
        names.append(f"{name}-{count}" if count else name)
    return set(names)


def broken_links(root):
    """Links to files or headings that are not there."""
    for page in pages(root):
        for link in links(page):
            if IS_REMOTE.match(link):
                continue
            path, _, anchor = urllib.parse.unquote(link).partition("#")
            target = pathlib.Path(os.path.normpath(page.parent / path)) if path else page
            if not target.exists() or root not in (target, *target.parents):
                yield f"{page.relative_to(root)}: {link} is not there"
            elif anchor and target.suffix == ".md" and anchor not in anchors(target):
                yield f"{page.relative_to(root)}: {link}: no such heading"


# Where a page lists what the programs take: page, first cell of the row (or of a table's header: its first column), and which of the programs' lists it is.
FEATURES = (
    ("docs/comparison.md", "elements", "elements"), ("docs/comparison.md", "live bodies by", "--solver"), ("docs/comparison.md", "their integrators", "--integrator"),
    ("docs/comparison.md", "finer mesh under the tool", "--overlay-law"), ("docs/comparison.md", "contact", "--contact"), ("docs/comparison.md", "tools", "--tool"),
    ("docs/comparison.md", "moved by", "--device"), ("docs/comparison.md", "a body from", "files"), ("docs/comparison.md", "recordings become", "exports"),
    ("docs/elements.md", "element", "elements"), ("docs/live.md", "`--solver`", "--solver"), ("docs/live.md", "`--integrator`", "--integrator"),
    ("docs/recordings.md", "option", "exports"))


def stale_features(root, has):
    """What such a list lacks of `has`, {list: names}, or has beyond it."""
    for page, first, name in FEATURES:
        lines = (root / page).read_text().splitlines()
        at = next((k for k, line in enumerate(lines) if line.startswith(f"| {first} |")), None)
        if at is None:
            yield f"{page}: no row or table begins with {first}"
            continue
        cells = [lines[at].split("|")[2]]
        if at + 1 < len(lines) and lines[at + 1].startswith("|---"):
            cells = [line.split("|")[1] for line in itertools.takewhile(lambda line: line.startswith("|"), lines[at + 2:])]
        told = {word.split()[0] for cell in cells for word in re.findall("`([^`]+)`", cell)}
        for word in sorted(told ^ set(has[name])):
            yield f"{page}: {first}: {word} is {'not told' if word in has[name] else 'in no program'}"


def missing_names(root):
    """What palpate.h has and docs/reference/api.md, which lists all of it, has not."""
    header, page = (root / "runtime/library/palpate.h").read_text(), (root / "docs/reference/api.md").read_text()
    names = re.findall(r"\b(palpate_\w+)\(|^\} (palpate_\w+);|^#define (PALPATE_\w+_INIT)", header, re.MULTILINE)
    told = set(re.findall(r":: (\w+)$", page, re.MULTILINE))
    yield from sorted({name for found in names for name in found if name} - told)


def old_pictures(root):
    """Pictures of the page that are not of today's, as scripts/pictures stamps them."""
    digest = hashlib.sha256()
    files = [root / "scripts/pictures", root / "runtime/web/index.html", *(root / "runtime/web/src").iterdir()]
    for name in sorted(file.relative_to(root).as_posix() for file in files):
        digest.update(f"{name}\n".encode() + (root / name).read_bytes())
    if (root / "docs/pictures/page.sha256").read_text().strip() != digest.hexdigest():
        yield "docs/pictures: push.webp and viewer*.png are of another page than runtime/web's: scripts/pictures makes them anew"


def long_pages(root):
    for page in pages(root):
        if page.name == "CHANGELOG.md":
            continue
        lines = len(page.read_text().splitlines())
        most = MOST_FRONT_LINES if page == root / "README.md" else MOST_LINES
        if lines > most:
            yield f"{page.relative_to(root)}: {lines} lines, {most} are the most"


def questions(root):
    """A newcomer's questions: each row of the first table of the FAQ that has one, and the page that its link leads to."""
    page = root / "docs" / "faq.md"
    for row in re.findall(r"^\|(.*\?.*)\|$", page.read_text(), re.MULTILINE):
        question, _, rest = row.partition("|")
        answers = [one or other for one, other in LINK.findall(rest or question)]
        yield question.strip(), answers and os.path.normpath(page.parent / answers[0].partition("#")[0])


def clicks(root):
    """Pages by how many links lead to them from the front door, as far as two."""
    front = str(root / "README.md")
    reached = {front: 0}
    for count in (1, 2):
        for page in [page for page, at in reached.items() if at == count - 1 and page.endswith(".md") and os.path.exists(page)]:
            for link in links(pathlib.Path(page)):
                if not IS_REMOTE.match(link):
                    reached.setdefault(os.path.normpath(os.path.join(os.path.dirname(page), link.partition("#")[0])), count)
    return reached


def far_answers(root):
    reached = clicks(root)
    asked = list(questions(root))
    if len(asked) < LEAST_QUESTIONS:
        yield f"docs/faq.md: {len(asked)} questions with a page, {LEAST_QUESTIONS} are the least"
    for question, answer in asked:
        if not answer or answer not in reached:
            yield f"docs/faq.md: {question}: {answer or 'no page'} is more than two clicks from README.md"


class Html(html.parser.HTMLParser):
    """Where a page of the site leads, what it loads, and where it can be led to."""

    def __init__(self, page):
        super().__init__()
        self.leads, self.loads, self.ids, self.inline = [], [], set(), []
        self.feed(page.read_text())

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if tag == "style" or tag == "script" and not given.get("src"):
            self.inline.append(f"<{tag}>")
        self.inline += [name for name, _ in attributes if name == "style" or name.startswith("on")]
        self.ids.update(value for name, value in attributes if name == "id" or name == "name" and tag == "a")
        if tag == "a" and given.get("href"):
            self.leads.append(given["href"])
        if tag in ("script", "img", "iframe", "source", "object") and given.get("src"):
            self.loads.append(given["src"])
        if tag == "link" and given.get("rel") not in ("index", "search", "next", "prev", "author"):
            self.loads.append(given["href"])


def broken_site(site):
    """What a page of the site loads from elsewhere or misses, and links inside the site that lead nowhere."""
    read = {page: Html(page) for page in sorted(site.rglob("*.html"))}
    for page, found in read.items():
        name = page.relative_to(site)
        yield from (f"{name}: has {inline} in it, which the viewer's policy refuses" for inline in found.inline)
        for link in found.loads + found.leads:
            if IS_REMOTE.match(link):
                if link in found.loads and not link.startswith("data:"):
                    yield f"{name}: loads {link}"
                continue
            url = urllib.parse.urlsplit(link)
            target = pathlib.Path(os.path.normpath(page.parent / urllib.parse.unquote(url.path))) if url.path else page
            anchor = urllib.parse.unquote(url.fragment)
            if not target.is_file() or site not in target.parents:
                yield f"{name}: {link} is not there"
            elif anchor and target in read and anchor not in read[target].ids:
                yield f"{name}: {link}: no such place"
    for style in sorted(site.rglob("*.css")):
        for link in re.findall(r"url\(['\"]?([^)'\"]+)", style.read_text()):
            if not link.startswith("data:") and not link.startswith("#") and not (style.parent / link).is_file():
                yield f"{style.relative_to(site)}: loads {link}"


def unlisted_pages(root, site):
    """Pages that the sidebar does not show."""
    listed = {link.partition("#")[0] for link in Html(site / "index.html").leads} | {"index.html"}
    for page in sorted((root / "docs").rglob("*.md")):
        name = page.relative_to(root / "docs").with_suffix(".html")
        if str(name) not in listed:
            yield f"docs/{page.relative_to(root / 'docs')}: not in the table of contents"
