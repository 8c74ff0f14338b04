"""scripts/house: each of its rules, kept and broken."""

import pathlib
import subprocess
import tempfile
import unittest

from programs import SOURCE

HOUSE = SOURCE / "scripts" / "house"
PICTURE = "<svg><title>meshes&#45;&gt;base</title></svg>"


class Rules(unittest.TestCase):
    """A tree of two folders that keeps them all; each test breaks one."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("base/error.h", "#pragma once\n")
        self.write("meshes/mesh.h", '#include "base/error.h"\n#include <vector>\n')
        self.write("meshes/mesh.cpp", '#include "meshes/mesh.h"\n// theory.md section 1\n')
        self.write("docs/theory.md", "# Theory\n\n## 1. Linear elastostatics\n")
        self.write("docs/pictures/house.svg", PICTURE)
        self.write("docs/architecture.md", "| folder | library |\n|---|---|\n| `base` | x |\n| `meshes`, `scripts` | y |\n")
        self.write(".clang-tidy", "HeaderFilterRegex: '(base|meshes)/[a-z0-9]+\\.h$'\n")

    def write(self, name, text):
        file = self.root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def check(self):
        done = subprocess.run([HOUSE, "--check", "--root", self.root], text=True, capture_output=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def refused(self, *words):
        status, said = self.check()
        self.assertEqual(status, 1, said)
        for word in words:
            self.assertIn(word, said)

    def test_a_house_in_order_passes(self):
        status, said = self.check()
        self.assertEqual(status, 0, said)
        self.assertIn("3 files, 5 lines, 0 rules broken", said)

    def test_an_include_upwards_is_refused(self):
        self.write("base/words.cpp", '#include "meshes/mesh.h"\n')
        self.refused("base/words.cpp:1: includes meshes/mesh.h, and base stands below meshes")

    def test_folders_that_include_each_other_are_refused(self):
        self.write("base/words.cpp", '\n#include "meshes/mesh.h"\n')
        self.refused("base/words.cpp:2: base and meshes include each other (meshes/mesh.h:1)")

    def test_rooms_in_a_circle_are_refused(self):
        self.write("base/list.h", '#include "base/item.h"\n')
        self.write("base/item.h", '#include "base/error.h"\n')
        self.assertEqual(self.check()[0], 0)
        self.write("base/item.cpp", '#include "base/item.h"\n#include "base/list.h"\n')
        self.refused("base/item.cpp:2: base/item, base/list include each other in a circle")

    def test_a_core_that_needs_a_library_is_refused(self):
        self.write("runtime/core/tick/step.h", '#include <Eigen/Core>\n#include "base/error.h"\n')
        self.write(".clang-tidy", "HeaderFilterRegex: '(base|meshes|runtime)/[a-z/]+\\.h$'\n")
        self.write("docs/architecture.md", "| folder | library |\n|---|---|\n| `base` | x |\n| `runtime/core/tick` | z |\n| `meshes`, `scripts` | y |\n")
        self.write("docs/pictures/house.svg", "<svg><title>meshes&#45;&gt;base</title><title>runtime/core/tick&#45;&gt;base</title></svg>")
        self.assertEqual(self.check()[0], 0, self.check()[1])
        self.write("base/error.cpp", "#include <string>\n#include <fmt/format.h>\n")
        self.refused("base/error.cpp:2: includes <fmt/format.h>: runtime/core stands on it")

    def test_a_folder_of_forty_files_is_the_largest(self):
        for k in range(39):
            self.write(f"base/part{k}.h", "")
        self.assertEqual(self.check()[0], 0)
        self.write("base/part39.cpp", "")
        self.refused("base: 41 product files, of at most 40")

    def test_two_types_of_one_name_are_refused(self):
        self.write("base/shapes.h", "namespace palpate {\nstruct Shape {\n};\n}\n")
        self.write("meshes/forms.h", "namespace palpate::forms {\nclass Shape {\n};\n}\n")
        self.assertEqual(self.check()[0], 0)
        self.write("meshes/bodies.h", "namespace palpate {\nclass Shape final : public Form {\n};\n}\n")
        self.refused("palpate::Shape is a type of", "base/shapes.h", "meshes/bodies.h")

    def test_two_headers_of_one_name_are_refused(self):
        self.write("base/mesh.h", "")
        self.refused("base/mesh.h and meshes/mesh.h: two headers of one name")

    def test_a_private_name_of_another_source_is_refused(self):
        self.write("base/ranges.cpp", "namespace palpate {\nnamespace {\nconstexpr int widest = 3;\n}  // namespace\n}\n")
        self.write("base/narrow.cpp", "bool narrow(int x) {\n  const int widest = 2;\n  return x > widest;\n}\n")
        self.assertEqual(self.check()[0], 0)
        self.write("base/words.cpp", "bool wide(int x) {\n  return x > widest;\n}\n")
        self.refused("base/words.cpp: uses widest, which base/ranges.cpp keeps to itself")

    def test_what_prints_without_say_is_refused(self):
        self.write("meshes/told.cpp", 'void tell(const std::string& name) {\n  fmt::print(stderr, "{}\\n", name);\n}\n')
        self.refused("meshes/told.cpp:2: prints without say")

    def test_a_folder_on_no_floor_is_refused(self):
        self.write("runtime/attic/old.cpp", "")
        self.refused("runtime/attic/old.cpp: its folder is on no floor")

    def test_a_header_that_shows_cgal_stays_in_its_folder(self):
        self.write("base/kernel.h", "#include <CGAL/Point_3.h>\n")
        self.write("base/error.h", '#include "base/kernel.h"\n')
        self.refused("meshes/mesh.h:1: includes base/error.h, which includes CGAL")
        self.assertNotIn("base/error.h:1", self.check()[1])
        self.write("meshes/mesh.h", '#include "base/words.h"\n')
        self.write("base/words.h", "")
        self.assertEqual(self.check()[0], 0, self.check()[1])
        self.write("tests/base/error_test.cpp", '\n#include "base/kernel.h"\n')
        self.refused("tests/base/error_test.cpp:2: includes base/kernel.h, which includes CGAL")

    def test_a_folder_that_clang_tidy_does_not_see_is_refused(self):
        self.write(".clang-tidy", "HeaderFilterRegex: '(base|mesh)/[a-z]+\\.h$'\n")
        self.refused(".clang-tidy: HeaderFilterRegex leaves out the headers of meshes")

    def test_a_folder_that_the_book_does_not_list_is_refused(self):
        self.write("docs/architecture.md", "| `base` | x |\n")
        self.refused("docs/architecture.md: its table of folders lacks meshes")
        self.write("docs/architecture.md", "| `meshes` | x |\n| `base` | y |\n")
        self.refused("docs/architecture.md: its table of folders is not in the order of FLOORS, from meshes on")

    def test_a_section_that_is_not_there_is_refused(self):
        self.write("meshes/mesh.cpp", "// theory.md section 2\n")
        self.refused("meshes/mesh.cpp:1: cites section 2 of docs/theory.md")

    def test_a_doc_comment_that_leans_on_another_is_refused(self):
        self.write("base/error.h", "/// An error.\nint a();\n/// Made up\n/// Of two lines.\nint b();\n")
        self.assertEqual(self.check()[0], 0)
        self.write("base/error.h", "/// An error.\nint a();\n/// The same with a hint.\nint b();\n")
        self.refused("base/error.h:3: a doc comment that begins with 'The same'")

    def test_a_doc_comment_that_begins_with_a_question_is_refused(self):
        self.write("base/error.h", "// Errors, and\n// what they say.\n/// An error, with\n/// what it says.\nint a();\nint b;  ///< number of errors\n        ///< and of hints\nint c;  // what follows\n")
        self.assertEqual(self.check()[0], 0, self.check()[1])
        for text, line in (("// What is wrong.\n", 1), ("\n/// How it ends.\nint a();\n", 2), ("int a;\nint b;  ///< that are open\n", 2), ("/// An error.\nint a;  ///< and its hint\n", 2)):
            self.write("base/error.h", text)
            self.refused(f"base/error.h:{line}: a doc comment that begins with '", "': say what the thing is")

    def test_a_word_that_the_field_has_another_for_is_refused(self):
        self.write("base/error.h", 'int patience;  ///< timeout, as `patience` is one of "nobody"\n// Nobody reads this.\n/// Two nodes of an element share a side; it is a tick.\n')
        self.assertEqual(self.check()[0], 0, self.check()[1])
        for text, word in (("/// Waits with patience.", "patience"), ("/// All but for one.", "but for"), ("int a;  ///< numbers a node", "numbers a node"), ("// Room for errors.", "Room"),
                           ("/// Ends the act.", "the act"), ("/// The share of all.", "The share"), ("/// Columns\n/// of what is near.", "of what")):
            self.write("base/error.h", text + "\n")
            self.refused(f": '{word}' in a doc comment: rather ")

    def test_a_hint_that_ends_in_a_full_stop_is_refused(self):
        self.write("base/error.h", 'f("a. b", "look at " + x);  // "a stop."\ng("one. "\n  "two", \'"\', path("."));\napp.footer("A page.");\nh("... and so on", "It" + (a ? "."\n + b : "c"));\n')
        self.assertEqual(self.check()[0], 0, self.check()[1])
        for text in ('"what", "Look."', '"what", a ? "Look." : b', '"Look "\n  "there."', '"The \\"x\\"."', '"hint: Look.\\n"', 'R"(Look.)"'):
            self.write("base/error.h", f"void f();\nfail({text});\n")
            self.refused("base/error.h:", ": a hint that ends in a full stop")

    def test_a_picture_of_other_sources_is_refused(self):
        self.write("docs/pictures/house.svg", PICTURE.replace("base", "formats"))
        self.refused("docs/pictures/house.svg: is not of these sources")


if __name__ == "__main__":
    unittest.main()
