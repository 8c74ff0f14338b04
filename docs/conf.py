"""How Sphinx makes the book. scripts/docs calls it, on a copy of docs/ with the generated pages beside it."""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = (HERE.parent / "README.md").resolve().parent  # beside the copy are links to what stands beside docs/
sys.path.insert(0, str(HERE / "site"))

project = "Palpate"
version = release = re.search(r"project\(palpate VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
html_title = f"Palpate {version}"

extensions = ["myst_parser", "breathe", "mathml", "mend_furo"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 5
html_math_renderer = "mathml"
highlight_language = "text"
exclude_patterns = ["pictures", "site"]
breathe_projects = {"palpate": str(HERE.parent / "doxygen" / "xml")}
breathe_default_project = "palpate"
breathe_domain_by_file_pattern = {"*/palpate.h": "c"}

html_theme = "furo"
html_favicon = "site/icon.svg"
html_static_path = ["site/book.css", "/usr/share/fonts/truetype/dejavu/DejaVuMathTeXGyre.ttf"]
NORMALIZE = "/usr/share/javascript/normalize.css/normalize.css"  # newer Furos bring it themselves
html_static_path += [NORMALIZE] if pathlib.Path(NORMALIZE).exists() else []
html_css_files = ["book.css"]
html_use_index = False  # of the C interface alone, whose page lists it too
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_show_search_summary = False  # is fetched, which a browser refuses where pages are files
html_permalinks_icon = "#"

# Chapters in the order of the sidebar. A page that stands nowhere here is a warning of Sphinx, and so an error.
CHAPTERS = {
    "First steps": ["getting-started", "samples", "faq", "limits"],
    "Tutorials": [
        "tutorials/push-a-liver",
        "tutorials/your-own-stl",
        "tutorials/organ-from-ct",
        "tutorials/nodule-study",
        "tutorials/your-own-device",
        "tutorials/your-own-loop",
        "tutorials/read-in-python",
    ],
    "Guide": [
        "surfaces",
        "model-toml",
        "elements",
        "overlays",
        "dynamics",
        "live",
        "depth",
        "probe",
        "viewer",
        "slicer",
        "recordings",
        "devices",
        "safety",
        "embedding",
        "python",
        "cluster",
        "packages",
        "errors",
    ],
    "Reference": ["file-format", "recording-format", "reference/*"],
    "Background": [
        "how-it-works",
        "measurements/index",
        "theory",
        "theory-contact",
        "comparison",
        "architecture",
        "decisions",
        "decisions-contact",
        "glossary",
        "contributing",
    ],
}
MEASUREMENTS = ["precompute", "size", "accuracy", "overlays", "contact", "hands", "dynamics", "live", "devices", "viewer", "viewer-looks"]


def toctree(folder, pages, caption=""):
    """The part of the table of contents that lists those of `pages` that are there."""
    lines = ["```{toctree}", ":hidden:", *([f":caption: {caption}"] if caption else [])]
    for page in pages:
        lines += [str(file.relative_to(folder).with_suffix("")) for file in sorted(folder.glob(page + ".md"))]
    return "\n".join(["", *lines, "```", ""])


def add_contents(app, docname, source):
    """Pages that list others show plain lists on a forge; their table of contents is added here."""
    if docname == "index":
        source[0] += "".join(toctree(HERE, pages, caption) for caption, pages in CHAPTERS.items())
    elif docname == "measurements/index":
        source[0] += toctree(HERE / "measurements", MEASUREMENTS)


def name_files(app, docname, source):
    """A block that tests write to a file has the file's name above it."""
    source[0] = re.sub(r"^<!-- file: (\S+) -->\n```(\w+)\n", r"```{code-block} \2\n:caption: \1\n\n", source[0], flags=re.MULTILINE)


def outside(app, env, node, contnode):
    """A link to a folder or a Markdown file of the repository that is no page of the book: its text alone."""
    page = ROOT / "docs" / node.get("refdoc", "")
    target = (page.parent / node.get("reftarget", "").split("#")[0]).resolve()
    is_outside = target.exists() and ROOT / "docs" not in target.parents
    return contnode if is_outside else None


CODE = r"(?:<a [^>]*>)?<code (?:(?!</code>).)*</code>(?:</a>)?"


def fit_cell(cell):
    """A cell of a table: numbers such as 1e-6 stay whole, and words make a wide column."""
    keep = lambda part: part[0] if part[0].startswith("<") else f'<span class="kept">{part[0]}</span>'
    words = ' class="words"' if len(re.sub("<[^>]*>", "", cell[1])) > 40 else ""
    return f"<td{words}>" + re.sub(r"<[^>]*>|\b\d[\d.]*e-\d+", keep, cell[1])


def fit_phones(app, pagename, templatename, context, doctree):
    """What narrow columns and small screens need: long names that may break behind / and _, numbers and punctuation
    that stay whole, columns of words that can be told from columns of numbers, and pictures that open in full size."""
    if "body" not in context:
        return
    body = re.sub(r'<span class="pre">[^<]+', lambda name: re.sub(r"(?<=\w)([/_])(?=\w)", r"\1<wbr>", name[0]), context["body"])
    body = re.sub(rf"\({CODE}[,;.:)]*|{CODE}[,;.:)]+", r'<span class="kept">\g<0></span>', body, flags=re.DOTALL)
    body = re.sub(r"<td>((?:(?!</td>).)*)", fit_cell, body, flags=re.DOTALL)
    context["body"] = re.sub(r'<img [^>]*src="([^"]+)"[^>]*>', r'<a class="picture" href="\1">\g<0></a>', body)


def setup(app):
    app.connect("html-page-context", fit_phones)
    app.connect("source-read", add_contents)
    app.connect("source-read", name_files)
    app.connect("missing-reference", outside)
