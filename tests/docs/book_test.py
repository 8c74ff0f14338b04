"""The book: that the site is built without a warning, that every link leads somewhere, and that pages stay short. Each rule also broken."""

import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import book

sys.path.insert(0, str(book.SOURCE / "docs" / "site"))
import mend_furo

BINARY = pathlib.Path(os.environ["PALPATE_BINARY_DIR"])


class Site(unittest.TestCase):
    """All of the book, as scripts/docs makes it."""

    @classmethod
    def setUpClass(cls):
        cls.folder = BINARY / "tests" / "book"
        cls.built = subprocess.run([book.SOURCE / "scripts" / "docs", cls.folder], text=True, capture_output=True, check=False)

    def holds(self, broken):
        found = "\n".join(broken)
        self.assertFalse(found, found)

    def test_is_built_without_a_warning(self):
        self.assertEqual(self.built.returncode, 0, self.built.stdout + self.built.stderr)

    def test_links_and_parts_are_in_it(self):
        self.holds(book.broken_site(self.folder / "html"))

    def test_every_page_is_in_the_table_of_contents(self):
        self.holds(book.unlisted_pages(book.SOURCE, self.folder / "html"))

    def test_links_of_the_markdown_resolve(self):
        self.holds(book.broken_links(book.SOURCE))

    def test_pages_are_short(self):
        self.holds(book.long_pages(book.SOURCE))

    def test_questions_of_newcomers_are_two_clicks_away(self):
        self.holds(book.far_answers(book.SOURCE))

    def test_formulas_need_no_script(self):
        theory = (self.folder / "html" / "theory.html").read_text()
        self.assertIn("<math", theory)
        self.assertNotRegex(theory, "(?i)<script[^>]*(katex|mathjax)")


def printed(program, *command):
    return subprocess.run([BINARY / program, "help", *command], text=True, capture_output=True, check=True).stdout


def features():
    """What the programs take, by themselves: the words of options, endings of files, what recordings become; and elements by the reference of model.toml, which is
    written from the code."""
    play, export, push = (printed("runtime/palpate-runtime", command) for command in ("play", "export", "push"))
    has = {}
    for option in ("--solver", "--integrator", "--overlay-law", "--contact", "--tool", "--device"):
        values = re.search(rf"^ +{option} (\S+)", play, re.MULTILINE)[1]
        has[option] = set(re.findall(r"(?:^|\|)([a-z][a-z0-9-]*)", re.sub(r"\[.*?\]", "", values)))
    has["files"] = set(re.findall(r"[(, ](\.[a-z]+)\b", push[:push.index("Handed on")]))
    has["exports"] = set(re.findall(r"^ +(--\w+) OUT", export, re.MULTILINE))
    table = (book.SOURCE / "docs/reference/model-keys.md").read_text().split("| geometry | elements")[1].split("\n\n")[0]
    has["elements"] = {word for row in table.splitlines()[2:] for word in re.findall('"(\\w+)"', row.split("|")[2])}
    return has


class Features(unittest.TestCase):
    """Pages that list what the programs take lack nothing and have no more."""

    def test_lists_are_those_of_the_programs(self):
        self.assertEqual(list(book.stale_features(book.SOURCE, features())), [])

    def test_the_reference_of_the_c_interface_has_all_of_the_header(self):
        self.assertEqual(list(book.missing_names(book.SOURCE)), [])

    def test_what_is_new_or_gone_is_noticed(self):
        has = features()
        self.assertIn("midpoint", has["--integrator"])
        has["--integrator"] = has["--integrator"] - {"midpoint"} | {"rk8"}
        self.assertEqual(list(book.stale_features(book.SOURCE, has)),
                         [f"{page}: {first}: {what}" for page, first in (("docs/comparison.md", "their integrators"), ("docs/live.md", "`--integrator`"))
                          for what in ("midpoint is in no program", "rk8 is not told")])


class Rules(unittest.TestCase):
    """A book of three pages that keeps them all; each test breaks one."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("README.md", "# Palpate\n\n[the book](docs/index.md), [questions](docs/faq.md#questions)\n")
        self.write("docs/index.md", "# The book\n\n[press](press.md#how-deep-12) `[no](link.md)`\n\n```sh\necho '[no](link.md)'\n```\n")
        self.write("docs/press.md", "# Press\n\n## How deep (1/2)?\n\n![A push](pictures/push.png)\n")
        self.write("docs/pictures/push.png", "")
        rows = "".join(f"| Question {k}? | [press](press.md) |\n" for k in range(10))
        self.write("docs/faq.md", f"# FAQ\n\n## Questions\n\n| question | page |\n|---|---|\n{rows}")
        self.assertEqual([*book.broken_links(self.root), *book.long_pages(self.root), *book.far_answers(self.root)], [])

    def write(self, name, text):
        file = self.root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def test_pictures_are_of_todays_page(self):
        self.assertEqual(list(book.old_pictures(book.SOURCE)), [])

    def test_pictures_of_another_page(self):
        for name, text in (("scripts/pictures", "take"), ("runtime/web/index.html", "<p>"), ("runtime/web/src/a.ts", "a"), ("docs/pictures/page.sha256", "0")):
            self.write(name, text)
        self.assertIn("docs/pictures: push.webp and viewer*.png are of another page than runtime/web's: scripts/pictures makes them anew",
                      book.old_pictures(self.root))
        digest = hashlib.sha256(b"runtime/web/index.html\n<p>runtime/web/src/a.ts\nascripts/pictures\ntake").hexdigest()
        self.write("docs/pictures/page.sha256", f"{digest}\n")
        self.assertEqual(list(book.old_pictures(self.root)), [])

    def test_link_to_no_page(self):
        self.write("docs/press.md", "[up](../nowhere.md)\n")
        self.assertIn("docs/press.md: ../nowhere.md is not there", book.broken_links(self.root))

    def test_link_out_of_the_tree(self):
        self.write("README.md", f"[up](../{self.root.name}.md)\n")
        self.assertEqual(len(list(book.broken_links(self.root))), 1)

    def test_link_to_no_heading(self):
        self.write("docs/press.md", "# Press\n\n## How deep?\n")
        self.assertEqual(list(book.broken_links(self.root)), ["docs/index.md: press.md#how-deep-12: no such heading"])

    def test_missing_picture(self):
        (self.root / "docs/pictures/push.png").unlink()
        self.assertEqual(list(book.broken_links(self.root)), ["docs/press.md: pictures/push.png is not there"])

    def test_long_pages(self):
        self.write("docs/press.md", "x\n" * 401)
        self.write("README.md", "x\n" * 201)
        self.assertEqual(list(book.long_pages(self.root)), ["README.md: 201 lines, 200 are the most", "docs/press.md: 401 lines, 400 are the most"])

    def test_answer_that_is_far(self):
        self.write("docs/index.md", "# The book\n")
        self.assertEqual(len(list(book.far_answers(self.root))), 0, "the FAQ itself leads there")
        self.write("README.md", "[the book](docs/index.md)\n")
        self.assertEqual(len(list(book.far_answers(self.root))), 10)

    def test_too_few_questions(self):
        self.write("docs/faq.md", "| question | page |\n|---|---|\n| Why? | [press](press.md) |\n")
        self.assertEqual(list(book.far_answers(self.root)), ["docs/faq.md: 1 questions with a page, 10 are the least"])


    def test_scripts_and_styles_stand_in_files(self):
        self.write("html/a.html", '<script>x()</script><style>b {}</style><p style="color: red" onclick="x()"><script src="x.js"></script>')
        self.write("html/x.js", "")
        refused = [f"a.html: has {part} in it, which the viewer's policy refuses" for part in ("<script>", "<style>", "style", "onclick")]
        self.assertEqual(list(book.broken_site(self.root / "html")), refused)
        self.write("html/_static/x.css", "")
        page = self.root / "html" / "b" / "a.html"
        self.write("html/b/a.html", "<style>\nb {}\n</style><svg style=\"display: none;\"></svg><script>\nx();\n</script>")
        page.write_text(mend_furo.without_inline(page, self.root / "html"))
        (self.root / "html" / "a.html").unlink()
        self.assertEqual(list(book.broken_site(self.root / "html")), [])
        self.assertEqual({file.read_text() for file in (self.root / "html" / "_static").iterdir()}, {"", "\nb {}\n", "\nx();\n"})


class Planted(unittest.TestCase):
    """What Sphinx and the look at the site refuse, all in one small site."""

    def test_defects_are_named(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        root = pathlib.Path(folder.name)
        source, site = root / "source", root / "html"
        source.mkdir()
        shutil.copy(book.SOURCE / "docs" / "conf.py", source)
        shutil.copytree(book.SOURCE / "docs" / "site", source / "site")
        (root / "README.md").symlink_to(book.SOURCE / "README.md")
        (source / "index.md").write_text("# Book\n\n$\\frac{1}{$ and [away](missing.md) and [where](theory.md#nowhere)\n")
        (source / "theory.md").write_text("# Theory\n\n$x^2$\n\n<script src=\"https://example.org/x.js\"></script> <a href=\"gone.html\">gone</a>\n")
        (source / "alone.md").write_text("# Alone\n")
        result = subprocess.run(["sphinx-build", "-q", "-W", "--keep-going", source, site], text=True, capture_output=True, check=False)
        self.assertEqual(result.returncode, 1, result.stderr)
        for wanted in (r"index\.md:3: WARNING: KaTeX parse error", r"target not found: '?missing\.md",
                       r"(theory\.md#|'theory': ')nowhere", r"alone\.md: WARNING: document isn't included in any toctree"):
            self.assertRegex(result.stderr, wanted)
        in_theory = [found for found in book.broken_site(site) if found.startswith("theory.html")]  # newer MyST leave planted links in index.html
        self.assertEqual(in_theory, ["theory.html: loads https://example.org/x.js", "theory.html: gone.html is not there"])
        (root / "docs").symlink_to(source)
        self.assertEqual(list(book.unlisted_pages(root, site)), ["docs/alone.md: not in the table of contents"])
