"""scripts/reference: the tables of docs/reference have all that the code has, and the pages are as it writes them."""

import importlib.machinery
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
BINARY = pathlib.Path(os.environ["PALPATE_BINARY_DIR"])
SCRIPT = SOURCE / "scripts" / "reference"
loader = importlib.machinery.SourceFileLoader("reference", str(SCRIPT))
reference = importlib.util.module_from_spec(importlib.util.spec_from_loader("reference", loader))
loader.exec_module(reference)


def page(name):
    return (SOURCE / "docs" / "reference" / f"{name}.md").read_text()


def rows(text):
    """The cells of each row of all tables, without their titles."""
    tables = re.findall(r"^\|(?:---\|)+\n((?:\|.*\n)*)", text, re.MULTILINE)
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for table in tables for line in table.splitlines()]


class Pages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.tables = reference.Tables()

    def test_are_what_the_code_says(self):
        done = subprocess.run([SCRIPT, "--check"], text=True, capture_output=True, check=False)
        self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))

    def test_a_change_is_taken_back_and_a_table_that_is_not_there_is_named(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name) / "reference"
            shutil.copytree(reference.PAGES, folder)
            changed = folder / "exit-statuses.md"
            changed.write_text(changed.read_text().replace("| done |", "| well done |").replace("Both programs", "The programs"))
            self.assertEqual(reference.written_pages(self.tables, folder)[changed], page("exit-statuses").replace("Both programs", "The programs"))
            changed.unlink()
            with self.assertRaisesRegex(SystemExit, "docs/reference lacks exit-statuses\nhint"):
                reference.written_pages(self.tables, folder)

    def test_each_key_of_a_model_has_a_row(self):
        text, found = page("model-keys"), [row[0].strip("`") for row in rows(page("model-keys"))]
        keys = [key for table in self.tables.model["tables"] if not table["title"].startswith("selection ") for key in table["keys"]]
        keys += self.tables.model["material"]
        self.assertTrue(all(key["meaning"] for key in keys))
        kinds = [each["kind"] for each in self.tables.model["geometries"]]
        self.assertEqual(sorted(found), sorted([key["key"] for key in keys] + kinds))
        for row in ("| `element` | all |", "| `remesh` | `surface` by tetgen |", "| `facet_distance` | `surface` by cgal, `image` |"):
            self.assertIn(row, text)

    def test_a_key_that_precompute_knows_is_in_its_table(self):
        """It names them all where it refuses another."""
        with tempfile.TemporaryDirectory() as folder:
            file, box = pathlib.Path(folder) / "model.toml", "[geometry]\nbox = {size = [1, 1, 1], cells = [1, 1, 1]}\n"
            for title, before in (("", ""), ("[geometry]", ""), ("[mesh]", box), ("[storage]", box)):
                file.write_text(f"{before}{title}\nno_such_key = 1\n")
                said = subprocess.run([BINARY / "precompute/palpate-precompute", file], text=True, capture_output=True, check=False).stderr
                self.assertRegex(said, f"of {', '.join(key['key'] for key in self.tables.keys_by_title[title])}\n")

    def test_each_option_of_play_has_a_row(self):
        shown = subprocess.run([BINARY / "runtime/palpate-runtime", "play", "--help"], text=True, capture_output=True, check=True).stdout
        text = page("play-options")
        for option in set(re.findall(r"^  (--[\w-]+)", shown, re.MULTILINE)) - {"--help"}:
            self.assertEqual(len(re.findall(rf"^\| `{option}[ `]", text, re.MULTILINE)), 1, option)
        self.assertEqual(len(rows(text)), len(re.findall(r"^  --", shown, re.MULTILINE)))
        self.assertIn("| `--live-step S` | s | 0.005 | time step of the solver, a whole number of ticks |", text)

    def test_each_bound_has_a_row(self):
        has = {row[0].strip("`"): row[1] for row in rows(page("safety-bounds"))}
        header = (SOURCE / "runtime/safety/safety_options.h").read_text()
        self.assertEqual(list(has), re.findall(r'visit\(F\{"(\w+)"', header))
        self.assertEqual((has["max_force"], has["late"], has["most_late"]), ("3", "0.0005", "10"))

    def test_each_status_fault_and_phase_has_a_row(self):
        named = []
        for header in ("runtime/core/tick/status.h", "runtime/safety/fault.h"):
            named += re.findall(r'^    \{\w+::(\w+), "\1"\}', (SOURCE / header).read_text(), re.MULTILINE)
        has = rows(page("status-bits"))
        self.assertEqual([row[-2].strip("`") for row in has], named)
        self.assertIn(["8", "256", "`not_converged`", "the contact forces did not reach their tolerance within the budget"], has)
        self.assertIn(["8", "`stopped`", "emergency stop"], has)

    def test_each_tuned_number_has_a_row(self):
        header = (SOURCE / "runtime/core/solve/tick_tuning.h").read_text()
        members = re.findall(r"^  [^/\n]* = [^\n]*;|^  [^/\n]* =\n", header, re.MULTILINE)
        self.assertGreater(len(members), 90)
        self.assertEqual(len(rows(page("tuning"))), len(members))
        self.assertIn("| `same_place` | 1e-4 | edge | contact points closer than this are one |", page("tuning"))

    def test_each_exit_status_has_a_row(self):
        self.assertEqual([row[0] for row in rows(page("exit-statuses"))], ["0", "1", "2", "3", "130"])


HEADER = """// A header.
namespace palpate {

/// An interval. It may
/// be empty.
struct Interval {
  double low = 0.0;  ///< [m] its beginning,
                     ///< which is in it
  // Not of the next.
  double high =
      1.0;  ///< [m] its end
  /// both ways
  std::array<double, 2> shares = {0.5, 0.25};

  /// [m] its length
  [[nodiscard]] double length() const { return high - low; }
                                     ///< of nothing
  std::int64_t numbers[3] = {};
};

enum class Side : std::uint8_t {
  left = 0,   ///< towards x
  right = 1U << 3,
};
}
"""


class Headers(unittest.TestCase):
    def test_members_are_read_as_they_are_declared(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "interval.h").write_text(HEADER)
            found = reference.declarations("interval.h", pathlib.Path(folder))
        self.assertEqual(found["Interval"], ("An interval. It may be empty.", [
            ("double", "low", "0.0", "[m] its beginning, which is in it"), ("double", "high", "1.0", "[m] its end"),
            ("std::array<double, 2>", "shares", "{0.5, 0.25}", "both ways"), ("std::int64_t[3]", "numbers", "{}", "")]))
        self.assertEqual(found["Side"], ("", [("", "left", "0", "towards x"), ("", "right", "1U << 3", "")]))

    def test_a_member_without_a_comment_is_named(self):
        with self.assertRaisesRegex(SystemExit, "Side::right has no doc comment\nhint"):
            reference.said("Side", reference.Member("", "right", "1", ""))


class Tables(unittest.TestCase):
    def test_bars_are_escaped_and_empty_columns_left_out(self):
        self.assertEqual(reference.table(["a", "b", "c"], [["1|2", "", "3\n4"], ["5", "", ""]]), "| a | c |\n|---|---|\n| 1\\|2 | 3 4 |\n| 5 | |")

    def test_options_are_code(self):
        self.assertEqual(reference.with_options_as_code("--fast or (--view), a -- b, x--y"), "`--fast` or (`--view`), a -- b, x--y")


if __name__ == "__main__":
    unittest.main()
