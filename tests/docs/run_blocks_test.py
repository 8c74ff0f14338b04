"""run_blocks.py: each way in which a page can be right or wrong, on pages of a few lines."""

import pathlib
import tempfile
import textwrap
import unittest

import run_blocks


class Pages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.page = pathlib.Path(folder.name) / "page.md"

    def run_page(self, text, limit=20):
        """(whether it passed, what was said)"""
        self.page.write_text(textwrap.dedent(text))
        said = []
        passed = run_blocks.run_page(self.page, pathlib.Path(self.page.parent), limit, said.append)
        return passed, "\n".join(said)

    def passes(self, text, *words):
        passed, said = self.run_page(text)
        self.assertTrue(passed, said)
        for word in words:
            self.assertIn(word, said)

    def fails(self, text, *words, limit=20):
        passed, said = self.run_page(text, limit)
        self.assertFalse(passed, said)
        for word in words:
            self.assertIn(word, said)


class Running(Pages):
    def test_counts_what_it_does(self):
        self.passes("""\
            # A page
            <!-- file: a/model.toml -->
            ```toml
            name = "x"
            ```
            ```sh
            cat a/model.toml
            ```
            <!-- output -->
            ```text
            name = "x"
            ```
            <!-- not run: needs a device -->
            ```sh
            false
            ```
            ```python
            print(open("a/model.toml").read())
            ```
            ```c
            int x;
            ```
            """, "2 run in ", "1 written as files, 1 outputs compared, 1 not run, 1 for reading", "not run (1): needs a device")

    def test_blocks_share_a_folder_a_shell_and_its_links(self):
        self.passes("""\
            ```sh
            export NUMBER=7; mkdir deep; cd deep; echo here > file
            ```
            Some words.
            ```sh
            test "$NUMBER" = 7 && cat file && cd .. && test -e meshes/models/cube/model.toml && test -d scripts && test -d docs && test -d runtime
            ```
            <!-- output -->
            ```text
            here
            ```
            """)

    def test_a_failing_command_is_shown_with_its_place_and_output(self):
        self.fails("""\
            # A page

            ```sh
            echo before
            ls /nowhere/at/all
            echo after
            ```
            """, f"{self.page}:3: ended with status 2", "    ls /nowhere/at/all\n", "    before\n", "cannot access '/nowhere/at/all'", "1 run in")

    def test_stops_at_the_first_command_that_fails(self):
        passed, said = self.run_page("```sh\nfalse\ntouch /tmp/never; echo after-it\n```\n```sh\necho next\n```\n")
        self.assertFalse(passed)
        self.assertEqual(said.count("after-it"), 1)  # the command, not its output
        self.assertIn("1 run in", said)

    def test_a_failing_script_is_told_too(self):
        self.fails("```python\nraise SystemExit(3)\n```\n", "page.md:1: ended with status 3")

    def test_a_block_that_never_ends_is_stopped(self):
        self.fails("```sh\necho begun\nsleep 60\n```\n", "page.md:1: not done after 0.5 s", "begun", limit=0.5)

    def test_what_is_left_in_the_background_is_stopped(self):
        self.passes("```sh\nsleep 60 &\necho $! > pid\n```\n```sh\nkill -0 $(cat pid)\n```\n")

    def test_the_folder_is_fresh(self):
        self.passes("```sh\ntest ! -e left; touch left\n```\n")
        self.passes("```sh\ntest ! -e left\n```\n")


class Outputs(Pages):
    def test_dots_stand_for_any_lines(self):
        for expected in ("...\n5", "1\n...\n5", "1\n2\n...", "...", "1\n2\n3\n4\n5", "1\n...\n3\n...\n5", "1\n...\n2\n3\n4\n5"):
            self.passes(f"```sh\nseq 5\n```\n<!-- output -->\n```text\n{expected}\n```\n", "1 outputs compared")

    def test_dots_in_a_line_stand_for_anything(self):
        for expected in ("8 no...", "... nodes, 1...1 faces", "8 nodes, 12.1 faces..."):
            self.passes(f"```sh\necho 8 nodes, 12.1 faces\n```\n<!-- output -->\n```text\n{expected}\n```\n", "1 outputs compared")

    def test_other_output_is_refused_and_shown(self):
        for expected in ("1\n2", "3...\n...", "...\n4", "2\n...", "1\n...\n6\n...", "5\n...\n1", ""):
            self.fails(f"```sh\nseq 5\n```\n<!-- output -->\n```text\n{expected}\n```\n", "page.md:5: the output differs", "commands of line 1 printed\n    1\n    2\n")

    def test_trailing_blanks_do_not_count(self):
        self.passes("```sh\nprintf 'a  \\nb\\n\\n'\n```\n\n<!-- output -->\n```text\na\nb\n```\n")

    def test_both_streams_count(self):
        self.passes("```sh\necho out; echo error >&2\n```\n<!-- output -->\n```text\nout\nerror\n```\n")

    def test_the_output_of_a_block_that_is_not_run_is_not_compared(self):
        self.passes("<!-- not run: no -->\n```sh\nseq 5\n```\n<!-- output -->\n```text\n9\n```\n", "0 outputs compared")

    def test_text_without_a_remark_is_for_reading(self):
        self.passes("```sh\nseq 5\n```\n```text\n9\n```\n", "0 outputs compared", "1 for reading")

    def test_output_of_nothing_is_refused(self):
        self.fails("<!-- output -->\n```text\n9\n```\n", "page.md:2: output of nothing")
        self.fails("```sh\nseq 5\n```\nThat prints:\n<!-- output -->\n```text\n1\n```\n", "output of nothing")

    def test_output_that_is_not_text_is_refused(self):
        self.fails("```sh\nseq 5\n```\n<!-- output -->\n```sh\n1\n```\n", "page.md:5: <!-- output --> above a block that is not text")


class Remarks(Pages):
    def test_a_block_that_is_not_run_needs_a_reason(self):
        for remark in ("<!-- not run -->", "<!-- not run: -->", "<!-- not run:   -->"):
            self.fails(f"{remark}\n```sh\ntrue\n```\n", "page.md:2: a block that is not run, without a reason")

    def test_a_remark_stands_directly_above_its_block(self):
        for between in ("\n", "Words.\n", ""):
            text = f"<!-- not run: no -->\n{between}" + ("```sh\ntrue\n```\n" if between else "")
            self.fails(text, "page.md:1: no block directly below <!-- not run -->")

    def test_a_shell_by_another_name_is_refused(self):
        for name in ("bash", "console", "shell", "python3"):
            self.fails(f"# A page\n```{name}\ntrue\n```\n", "page.md:2: a block of", "neither run nor has it a reason")

    def test_a_file_stays_in_the_folder(self):
        for name in ("/etc/x", "../x", "", "meshes/x"):
            self.fails(f"<!-- file: {name} -->\n```toml\n```\n", "is no name for a file of the page's folder")

    def test_a_block_of_sh_can_be_a_file(self):
        self.passes("<!-- file: go.sh -->\n```sh\nexit 3\n```\n```sh\nbash go.sh || echo $?\n```\n<!-- output -->\n```text\n3\n```\n", "1 written as files")

    def test_a_block_that_is_not_closed_is_refused(self):
        self.fails("```sh\ntrue\n", "page.md:1: a block that is not closed")


class Markdown(Pages):
    def test_blocks_in_lists_and_directives_are_run(self):
        self.passes("""\
            1. First

               ```sh
               cat <<END
                 deeper
               END
               ```
               <!-- output -->
               ```text
                 deeper
               ```

            ````{note}
            ```sh
            echo noted
            ```
            <!-- output -->
            ```text
            noted
            ```
            ````

            ```{code-block} sh
            true
            ```
            """, "3 run in", "2 outputs compared")

    def test_a_fence_of_four_holds_one_of_three(self):
        self.passes("````markdown\n```sh\nfalse\n```\n````\n", "0 run in", "1 for reading")

    def test_only_pages_with_something_to_run_have_a_test(self):
        for text, runnable in (("# Words\n", False), ("```toml\nx = 1\n```\n", False), ("```sh\ntrue\n```\n", True),
                               ("<!-- not run: no -->\n```sh\ntrue\n```\n", True), ("```bash\ntrue\n```\n", True)):
            self.page.write_text(text)
            self.assertEqual(run_blocks.is_runnable(self.page), runnable, text)


del Pages  # has no tests of its own

if __name__ == "__main__":
    unittest.main()
