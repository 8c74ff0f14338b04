"""scripts/measure: the pages of docs/measurements as they are, and what it finds on pages that lack something."""

import hashlib
import importlib.machinery
import importlib.util
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from programs import SOURCE

MEASURE = SOURCE / "scripts" / "measure"
PAGES = pathlib.Path("docs") / "measurements"
LOADER = importlib.machinery.SourceFileLoader("measure", str(MEASURE))
measure = importlib.util.module_from_spec(importlib.util.spec_from_loader("measure", LOADER))
LOADER.exec_module(measure)


def check(root):
    done = subprocess.run([MEASURE, "--check", "--root", root], text=True, capture_output=True, check=False)
    return done.returncode, done.stdout + done.stderr


class Pages(unittest.TestCase):
    def test_each_table_says_how_it_was_made(self):
        status, said = check(SOURCE)
        self.assertEqual(status, 0, said)


class Rules(unittest.TestCase):
    """A copy of the pages; each test breaks one rule."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        shutil.copytree(SOURCE / PAGES, self.root / PAGES)
        self.page = self.root / PAGES / "accuracy.md"

    def change(self, pattern, text):
        """Puts `text` in place of what `pattern` first finds on the page."""
        changed, count = re.subn(pattern, lambda found: found.expand(text), self.page.read_text(), count=1, flags=re.DOTALL)
        self.assertEqual(count, 1, pattern)
        self.page.write_text(changed)

    def measured(self, text="| depth |\n|---|\n| 2 mm |\n\n*Measured* · `{command}` · 2 cores of a processor, 8 GB, Debian 12, GCC 12.2.0 · 24 November 2026"):
        """Makes the table `nodule` a measured one."""
        command = re.search(r"`(scripts/studies/nodule[^`]*)`", self.page.read_text())[1]
        text = text.replace("{command}", command)
        self.change(r"<!-- table: nodule [^\n]*-->.*?<!-- end -->",
                    f"<!-- table: nodule measured, {hashlib.sha256(text.encode()).hexdigest()[:16]} -->\n\n{text}\n\n<!-- end -->")
        index = self.root / PAGES / "index.md"
        index.write_text(re.sub(r"(\| nodule \|) [^|]* (\|)", r"\1 measured \2", index.read_text()))

    def refused(self, *words):
        status, said = check(self.root)
        self.assertEqual(status, 1, said)
        for word in words:
            self.assertIn(word, said)

    def test_a_measured_table_is_kept(self):
        self.measured()
        status, said = check(self.root)
        self.assertEqual(status, 0, said)

    def test_a_figure_that_was_changed_by_hand(self):
        self.measured()
        self.change(r"\| 2 mm \|", "| 3 mm |")
        self.refused("nodule is not as it was measured")

    def test_no_machine(self):
        self.measured("| a |\n|---|\n| 2 |\n\n*Measured* · `{command}` · somewhere · 24 November 2026")
        self.refused("on which machine")

    def test_no_date(self):
        self.measured("| a |\n|---|\n| 2 |\n\n*Measured* · `{command}` · 2 cores, 8 GB · lately")
        self.refused("does not say when")

    def test_another_command(self):
        self.measured("| a |\n|---|\n| 2 |\n\n*Measured* · `scripts/other` · 2 cores, 8 GB · November 2026")
        self.refused("names another command")

    def test_no_caption(self):
        self.measured("| a |\n|---|\n| 2 |")
        self.refused("ends without a line")

    def test_a_table_outside_of_markers(self):
        self.page.write_text(self.page.read_text() + "\n| a |\n|---|\n| 2 |\n")
        self.refused("a table outside of")

    def test_a_table_that_is_not_in_the_script(self):
        self.change(r"<!-- table: nodule ", "<!-- table: lump ")
        self.refused("lump is not a table of accuracy", "0 tables nodule, of one")

    def test_a_marker_that_is_not_closed(self):
        self.change(r"(<!-- table: nodule .*?)<!-- end -->", r"\1")
        self.refused("nodule")

    def test_a_list_that_is_not_of_these_pages(self):
        index = self.root / PAGES / "index.md"
        index.write_text(index.read_text().replace("| nodule |", "| lump |"))
        self.refused("index.md: its list")


class Shapes(unittest.TestCase):
    """How the output of a study becomes a table."""

    def test_columns_of_tables_with_edges(self):
        output = "a: 9 nodes, edges of 5.62 mm\n\n| R | x | µs |\n|---|---|---|\n| 1 | 2 | 3 |\n\nb: 9 nodes, edges of 3.6 mm\n\n| R | x | µs |\n|---|---|---|\n| 4 | 5 | 6 |\n"
        shape = measure.pick({"R": "R [mm]", 2: "time"}, edges=True)
        self.assertEqual(shape(output), "| edges | R [mm] | time |\n|---|---|---|\n| 5.6 mm | 1 | 3 |\n| 3.6 mm | 4 | 6 |")

    def test_one_table_with_what_is_said_below(self):
        output = "first\n\n| a |\n|---|\n| 1 |\n\n| b |\n|---|\n| 2 |\n\nIt is two.\n\nAnd more.\n"
        self.assertEqual(measure.table(1, below=True)(output), "| b |\n|---|\n| 2 |\n\nIt is two.")
        self.assertEqual(measure.table(0)(output), "| a |\n|---|\n| 1 |")

    def test_minus_signs_and_units(self):
        self.assertEqual(measure.typeset("| -1.5 % | 2e-5 | (-3) | a-4 |"), "| −1.5\N{NO-BREAK SPACE}% | 2e-5 | (−3) | a-4 |")


if __name__ == "__main__":
    unittest.main()
