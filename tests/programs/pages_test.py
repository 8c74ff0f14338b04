"""Manual pages and completions: made from the programs' own command lines, so each option of a help page is in them; and shells use them."""

import json
import os
import pty
import re
import shutil
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from programs import BINARY, OPENIGTLINK, PRECOMPUTE, RUNTIME, SOURCE, ProgramTest, done, run

PROGRAMS = (OPENIGTLINK, PRECOMPUTE, RUNTIME)
FILES = {"man": "{}.1", "bash": "{}", "zsh": "_{}", "fish": "{}.fish"}


def commands(program):
    """The commands that the help page of a program lists, and the program itself."""
    page = run(program, "--help").stdout
    listed = page.partition("\nCommands:")[2].partition("\nExamples:")[0]
    return ["", *re.findall(r"^  (\w+) ", listed, re.MULTILINE)]


def options(program, command):
    """What the help page of a command has: names of options."""
    page = run(program, *command.split(), "--help").stdout
    names = re.findall(r"^ {2,4}(-[\w-]+(?:,-[\w-]+)*)", page, re.MULTILINE)  # 4: of a group
    return {name for line in names for name in line.split(",")} | {"--help", "-h"}


def page(program, form):
    """What the build has made of it, which is installed."""
    return (BINARY / "pages" / FILES[form].format(program.name)).read_text()


def needs(shell):
    return unittest.skipUnless(shutil.which(shell), f"{shell} is not installed; it is too large to be needed for this")


class Manual(unittest.TestCase):
    def test_has_each_option_of_each_help_page(self):
        for program in PROGRAMS:
            text = page(program, "man").replace("\\-", "-")
            general, _, rest = text.partition("\n.SH COMMANDS\n")
            sections = dict(re.findall(r"^\.SS (\w+)\n(.*?)(?=^\.S[SH] |\Z)", rest, re.MULTILINE | re.DOTALL))
            self.assertEqual(set(sections), set(commands(program)) - {""})
            for command in commands(program):
                with self.subTest(program=program.name, command=command):
                    section = sections.get(command, general)
                    self.assertLessEqual({*options(program, command)}, set(re.findall(r"\\fB(-[\w-]+)\\fR", section)))

    def test_is_right_roff(self):
        for program in PROGRAMS:
            text = page(program, "man")
            self.assertTrue(text.isascii())
            shown = subprocess.run(["groff", "-man", "-Tascii", "-ww", "-P-cbou"], input=text, text=True, capture_output=True, check=True)
            self.assertEqual(shown.stderr, "")
            for heading in ("NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", *["COMMANDS"] * (program != OPENIGTLINK), "SEE ALSO"):
                self.assertRegex(shown.stdout, rf"(?m)^{heading}$")

    @needs("mandoc")
    def test_mandoc_has_no_complaint(self):
        for program in PROGRAMS:
            said = subprocess.run(["mandoc", "-T", "lint", "-W", "warning"], input=page(program, "man"), text=True, capture_output=True, check=False)
            # No date stands in it, so that equal sources make equal pages.
            problems = [line for line in said.stdout.splitlines() if "missing date" not in line]
            self.assertEqual(problems, [])

    def test_are_of_these_programs(self):
        for program in PROGRAMS:
            with tempfile.TemporaryDirectory() as folder:
                done(SOURCE / "scripts" / "reference", "--pages", program, folder)
                for form, name in FILES.items():
                    made = (Path(folder) / name.format(program.name)).read_text()
                    self.assertEqual(page(program, form), made, f"{form}: build the target {program.name}-pages")

    def test_json_has_all_commands(self):
        for program in PROGRAMS:
            data = json.loads(done(program, "--help=json"))
            self.assertEqual(["", *(command["name"] for command in data["commands"])], commands(program))
            self.assertEqual(f"{data['name']} {data['version']}\n", done(program, "--version"))


class Completion(ProgramTest):
    """Each shell in a folder with some files."""

    def setUp(self):
        super().setUp()
        for name in ("touch.csv", "notes.txt", "model.toml", "cube.palpate.hdf", "touch.mcap", "organ.stl", "deep/other.csv", "a file.csv"):
            file = self.folder / name
            file.parent.mkdir(exist_ok=True)
            file.touch()

    def script(self, program, form):
        return self.write(f"completion.{form}-{program.name}", page(program, form))

    def bash(self, program, line):
        """What bash would offer after `line`. It cuts words at = and : as readline does."""
        words = [word for word in re.split(r"(\s+|[=:])", line) if word and not word.isspace()]
        if line.endswith(" "):
            words.append("")
        function = "_" + program.name.replace("-", "_")
        asked = " ".join(f"'{word}'" for word in words)
        code = f"""source {self.script(program, "bash")}
[[ $(complete -p {program.name}) == 'complete -F {function} {program.name}' ]] || exit 1
COMP_LINE='{line}' COMP_POINT={len(line)} COMP_WORDS=({asked}) COMP_CWORD={len(words) - 1}
{function}
printf '%s\\n' "${{COMPREPLY[@]}}" """
        result = subprocess.run(["bash", "--norc", "-c", code], text=True, capture_output=True, check=False, cwd=self.folder)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return sorted(result.stdout.split("\n")[:-1]) if result.stdout != "\n" else []

    def test_bash_offers_each_option(self):
        for program in PROGRAMS:
            for command in commands(program):
                with self.subTest(program=program.name, command=command):
                    line = " ".join([program.name, *command.split(), "-"])
                    self.assertEqual(set(self.bash(program, line)), options(program, command))

    def test_bash_offers_commands_files_and_values(self):
        for line, wanted in (
                ("palpate-runtime pl", ["play"]), ("palpate-runtime ", ["devices", "export", "help", "play", "probe", "push", "samples", "session", "view"]),
                ("palpate-runtime help s", ["samples", "session"]), ("palpate-runtime play ", ["cube.palpate.hdf", "deep"]),
                ("palpate-precompute --element ", ["tet10", "tet4a"]),
                ("palpate-runtime play --contact ", ["dynamic", "quasi-static"]), ("palpate-runtime play --contact=d", ["dynamic"]),
                ("palpate-runtime play --tool ", ["capsule:", "disc:", "point", "sphere:"]), ("palpate-runtime play --tool=s", ["sphere:"]),
                ("palpate-runtime play --device s", ["script:"]), ("palpate-runtime play --device script:t", ["touch.csv"]),
                ("palpate-runtime play --device=script:t", ["touch.csv"]), ("palpate-runtime play --device replay:", ["deep", "touch.mcap"]),
                ("palpate-runtime play --device script:deep/", ["deep/other.csv"]), ("palpate-runtime play --device script:a", ["a file.csv"]),
                ("palpate-runtime play --rate ", []), ("palpate-runtime play cube.palpate.hdf --vi", ["--view", "--view-address", "--view-fd", "--view-framed"]),
                ("palpate-runtime export t", ["touch.mcap"]), ("palpate-runtime view ", ["deep", "touch.mcap"]), ("palpate-precompute m", ["model.toml"]), ("palpate-precompute o", ["organ.stl"]), ("palpate-runtime push ", ["cube.palpate.hdf", "deep", "model.toml", "organ.stl"]), ("palpate-precompute ver", ["verify"]),
                ("palpate-precompute verify c", ["cube.palpate.hdf"]), ("palpate-precompute compare cube.palpate.hdf c", ["cube.palpate.hdf"]),
                ("palpate-precompute model.toml -o n", ["notes.txt"])):
            with self.subTest(line=line):
                self.assertEqual(self.bash(PRECOMPUTE if "precompute" in line else RUNTIME, line), wanted)

    def fish(self, program, line):
        """What fish offers after `line`."""
        asked = f"source {self.script(program, 'fish')}; complete -C '{line}'"
        result = subprocess.run(["fish", "--no-config", "-c", asked], text=True, capture_output=True, check=False, cwd=self.folder,
                                env={**os.environ, "HOME": str(self.folder), "TERM": "dumb"})
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return {offer.split("\t")[0] for offer in result.stdout.splitlines()}

    @needs("fish")
    def test_fish(self):
        for program in PROGRAMS:
            for command in commands(program):
                with self.subTest(program=program.name, command=command):
                    begun = " ".join([program.name, *command.split()])
                    offers = self.fish(program, f"{begun} -") | self.fish(program, f"{begun} --")
                    self.assertLessEqual(options(program, command), offers)
        self.assertEqual(self.fish(RUNTIME, "palpate-runtime pl"), {"play"})
        self.assertEqual(self.fish(RUNTIME, "palpate-runtime play --contact "), {"quasi-static", "dynamic"})
        self.assertIn("cube.palpate.hdf", self.fish(RUNTIME, "palpate-runtime play c"))
        self.assertIn("touch.mcap", self.fish(RUNTIME, "palpate-runtime session t"))
        self.assertIn("model.toml", self.fish(PRECOMPUTE, "palpate-precompute m"))

    def zsh(self, line):
        """The line as zsh completes it."""
        said = self.folder / "line"
        said.unlink(missing_ok=True)
        pid, terminal = pty.fork()
        if pid == 0:
            os.chdir(self.folder)
            os.execve(shutil.which("zsh"), ["zsh", "-f", "-i"], {**os.environ, "TERM": "dumb", "ZDOTDIR": str(self.folder)})
        begin = (f"fpath=({self.folder}/functions $fpath); autoload -U compinit; compinit -u -D; PROMPT=; setopt no_beep no_auto_menu\n"
                 f"tell() {{ print -rn -- \"$BUFFER\" > {said}.part; mv {said}.part {said} }}; zle -N tell; bindkey '^O' tell\n")
        try:
            os.write(terminal, begin.encode())
            time.sleep(1.0)  # keys typed before the editor runs would be text
            os.write(terminal, (line + "\t\x0f").encode())
            self.wait_for(said.exists)
        finally:
            os.close(terminal)
            os.waitpid(pid, 0)
        return said.read_text()

    @needs("zsh")
    def test_zsh(self):
        functions = self.folder / "functions"
        functions.mkdir()
        for program in PROGRAMS:
            text = page(program, "zsh")
            script = functions / f"_{program.name}"
            script.write_text(text)
            subprocess.run(["zsh", "-f", "-n", script], check=True)
            for command in commands(program):
                place = re.search(rf"^_{program.name.replace('-', '_')}_{command or 'program'}\(\) {{\n(.*?)^}}", text, re.MULTILINE | re.DOTALL)
                names = set(re.findall(r"(?<=[)*])(-[\w-]+)(?=[=+]?\[)", place.group(1)))
                self.assertEqual(names, options(program, command), f"{program.name} {command}")
        for line, wanted in (("palpate-runtime pl", "palpate-runtime play "), ("palpate-runtime play --surf", "palpate-runtime play --surface="),
                             ("palpate-runtime play --contact d", "palpate-runtime play --contact dynamic "),
                             ("palpate-runtime play --device scr", "palpate-runtime play --device script:"),
                             ("palpate-runtime play --device script:to", "palpate-runtime play --device script:touch.csv "),
                             ("palpate-precompute verify c", "palpate-precompute verify cube.palpate.hdf "),
                             ("palpate-precompute mod", "palpate-precompute model.toml ")):
            with self.subTest(line=line):
                self.assertEqual(self.zsh(line), wanted)


if __name__ == "__main__":
    unittest.main()
