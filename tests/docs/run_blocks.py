#!/usr/bin/python3
"""Runs the code blocks of pages of the book, so that what a page tells people to type keeps working.

  run_blocks.py --build DIR PAGE...   run the blocks of each page; prints counts, and what failed
  run_blocks.py --runnable PAGE...    print the pages that have a block to run or a block of a shell's language, one a line

A page's blocks run in order, in one fresh folder with links to the repository's meshes, scripts, docs and runtime, and with the programs of
the build folder on PATH. A fenced block is treated by its language and by the comment directly above it:

  sh                        run by bash with `set -e`; working directory and exported variables carry over to the next block
  python                    run as a complete script
  <!-- not run: REASON -->  above a sh or python block: it is not run, and the reason is printed
  <!-- file: NAME -->       above a block of any language: it is written to the file NAME of the folder, and not run
  <!-- output -->           above a text block directly after a block that was run: what it must have printed, both streams together.
                            A line `...` stands for any lines; trailing blanks do not count

Blocks in other languages are for reading. A page fails when a command fails, when output differs, when a comment has no block or no reason, and when a
shell block has a language that is not `sh` (bash, console ...), as it would silently not be run. Exit status 1 when a page failed."""

import argparse
import collections
import dataclasses
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
LINKED = ("meshes", "scripts", "docs", "runtime")
RUN = ("sh", "python")
NOT_SH = ("bash", "shell", "console", "shell-session", "sh-session", "zsh", "fish", "py", "python3")
FENCE = re.compile(r"^(?P<indent>[ \t]*(?:>[ \t]?)*)(?P<fence>`{3,}|~{3,})(?P<info>[^`]*)$")
REMARK = re.compile(r"^[ \t]*<!--\s*(?P<kind>not run|file|output)\s*(?P<colon>:?)\s*(?P<value>.*?)\s*-->\s*$")
CARRY = "folder=$(pwd); export -p >{environment}; printf '%s' \"$folder\" >{folder}"


class Broken(Exception):
    """A page that cannot be run as it stands: what is wrong and where."""

    def __init__(self, line, message):
        super().__init__(message)
        self.line = line


@dataclasses.dataclass
class Block:
    line: int  # of the opening fence, from 1
    language: str
    text: str
    remark: str = ""  # not run, file, output
    value: str = ""  # reason, name
    follows: int = -1  # index of the block before, where nothing but blank lines and this block's remark is between


def language(info):
    """Language of a fence; `{code-block} sh` is MyST's way to say `sh`."""
    words = info.split()
    if words and words[0] in ("{code-block}", "{code}", "{sourcecode}"):
        words = words[1:]
    return words[0].lower() if words else ""


def blocks(text, first=1):
    """All fenced blocks of a page, in order; those within directives ({note} ...) too."""
    lines = text.splitlines()
    found, remark, previous = [], None, -1
    at = 0
    while at < len(lines):
        number = first + at
        fence = FENCE.match(lines[at])
        said = REMARK.match(lines[at])
        at += 1
        if said:
            if remark:
                raise Broken(remark[0], f"no block directly below <!-- {remark[1]} -->")
            remark = (number, said["kind"], said["value"] if said["colon"] else "")
            continue
        if not fence:
            if remark:
                raise Broken(remark[0], f"no block directly below <!-- {remark[1]} -->")
            if lines[at - 1].strip():
                previous = -1
            continue
        indent, body, closed = fence["indent"], [], False
        while at < len(lines) and not closed:
            line = lines[at]
            line = line[len(indent):] if line.startswith(indent) else line.lstrip() if len(line) - len(line.lstrip()) < len(indent) else line
            closing = re.match(rf"^ *({re.escape(fence['fence'][0])}{{{len(fence['fence'])},}})\s*$", line)
            closed = closing is not None
            if not closed:
                body.append(line)
            at += 1
        if not closed:
            raise Broken(number, "a block that is not closed")
        content = "".join(line + "\n" for line in body)
        kind = language(fence["info"])
        if kind.startswith("{"):  # a directive: text with blocks of its own
            if remark:
                raise Broken(remark[0], f"no block directly below <!-- {remark[1]} -->")
            found += [dataclasses.replace(inner, follows=inner.follows + len(found) if inner.follows >= 0 else -1) for inner in blocks(content, number + 1)]
            previous = -1
            continue
        block = Block(number, kind, content, follows=previous)
        if remark:
            block.remark, block.value, remark = remark[1], remark[2], None
        check(block)
        previous = len(found)
        found.append(block)
    if remark:
        raise Broken(remark[0], f"no block directly below <!-- {remark[1]} -->")
    return found


def check(block):
    """Whether it says clearly what is to be done with it."""
    if block.remark == "not run":
        if block.language not in RUN:
            raise Broken(block.line, "<!-- not run --> above a block that would not be run anyway")
        if not block.value:
            raise Broken(block.line, "a block that is not run, without a reason: <!-- not run: REASON -->")
    if block.remark == "file":
        path = pathlib.PurePosixPath(block.value)
        if not block.value or path.is_absolute() or ".." in path.parts or path.parts[0] in LINKED:
            raise Broken(block.line, f"'{block.value}' is no name for a file of the page's folder")
    if block.remark == "output" and block.language != "text":
        raise Broken(block.line, "<!-- output --> above a block that is not text")
    if block.language in NOT_SH and block.remark != "file":
        instead = "python" if block.language.startswith("py") else "sh"
        raise Broken(block.line, f"a block of '{block.language}' is neither run nor has it a reason: call it {instead}")


def same_output(expected, printed):
    """Whether the lines match, `...` standing for any number of them, and in a line for anything."""
    def matches(line, printed_line):
        return re.fullmatch(".*".join(map(re.escape, line.split("..."))), printed_line)

    want = [line.rstrip() for line in expected.strip("\n").splitlines()]
    have = [line.rstrip() for line in printed.strip("\n").splitlines()]
    reach = {0}  # how many lines of `have` what was looked at so far can stand for
    for line in want:
        if line.strip() == "...":
            reach = set(range(min(reach), len(have) + 1)) if reach else reach
        else:
            reach = {k + 1 for k in reach if k < len(have) and matches(line, have[k])}
    return len(have) in reach


class Runner:
    """Runs the blocks of one page in a folder of its own."""

    def __init__(self, build, limit):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="palpate-page-"))
        self.limit = limit
        self.groups = []
        self.room = self.folder / "room"
        self.room.mkdir()
        for name in LINKED:
            (self.room / name).symlink_to(SOURCE / name)
        self.cwd = self.room
        self.environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "Agg", "COLUMNS": "120"}

        def before(name, *paths):
            self.environment[name] = ":".join([*map(str, paths), *filter(None, [os.environ.get(name, "")])])

        # As if the programs and libpalpate were installed.
        before("PATH", build / "precompute", build / "runtime", "/usr/bin")
        before("PYTHONPATH", SOURCE / "runtime" / "python")
        before("CPATH", SOURCE / "runtime" / "library")
        before("LIBRARY_PATH", build / "runtime")
        before("LD_LIBRARY_PATH", build / "runtime")
        before("PKG_CONFIG_PATH", build / "runtime" / "library")

    def command(self, block):
        kept = [self.folder / "environment", self.folder / "cwd"]
        script = self.folder / ("block.py" if block.language == "python" else "block.sh")
        if block.language == "python":
            script.write_text(block.text)
            return ["/usr/bin/python3", script]
        start = f"test ! -e {kept[0]} || . {kept[0]}\n"
        script.write_text(f"{start}trap '{CARRY.format(environment=kept[0], folder=kept[1])}' EXIT\nset -e\n. {self.folder / 'typed.sh'}\n")
        (self.folder / "typed.sh").write_text(block.text)
        return ["bash", "--norc", "--noprofile", script]

    def run(self, block):
        """(exit status, what was printed); status None when it took too long."""
        log = self.folder / "log"
        with log.open("wb") as out:
            child = subprocess.Popen(self.command(block), cwd=self.cwd, env=self.environment, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT, start_new_session=True)
            self.groups.append(child.pid)
            try:
                status = child.wait(timeout=self.limit)
            except subprocess.TimeoutExpired:
                os.killpg(child.pid, signal.SIGKILL)
                child.wait()
                status = None
        if block.language == "sh" and (self.folder / "cwd").exists():
            self.cwd = pathlib.Path((self.folder / "cwd").read_text())
        printed = log.read_text(errors="replace").replace(f"{self.folder / 'typed.sh'}: ", "")
        return status, printed.replace(f"{self.room}/", "").replace(str(self.room), ".")

    def write(self, block):
        file = self.room / block.value
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(block.text)

    def close(self):
        for group in self.groups:  # what a block has left in the background
            try:
                os.killpg(group, signal.SIGKILL)
            except ProcessLookupError:
                pass
        shutil.rmtree(self.folder, ignore_errors=True)


def indented(text):
    return "".join(f"    {line}\n" for line in text.rstrip("\n").splitlines())


def run_page(page, build, limit, say=print):
    """Whether every block of the page did as the page says."""
    ran, written, compared, shown, seconds = 0, 0, 0, 0, 0.0
    reasons = collections.Counter()
    failed = None
    try:
        all_blocks = blocks(page.read_text())
    except Broken as wrong:
        say(f"{page}:{wrong.line}: {wrong}")
        return False
    runner = Runner(build, limit)
    results = {}
    try:
        for k, block in enumerate(all_blocks):
            where = f"{page}:{block.line}"
            if block.remark == "file":
                runner.write(block)
                written += 1
            elif block.remark == "not run":
                reasons[block.value] += 1
            elif block.remark == "output":
                before = all_blocks[block.follows] if block.follows >= 0 else None
                if before is None or before.language not in RUN or before.remark == "file":
                    failed = f"{where}: output of nothing: no sh or python block directly above"
                elif before.remark != "not run":
                    compared += 1
                    if not same_output(block.text, results[block.follows]):
                        failed = f"{where}: the output differs. The page says\n{indented(block.text)}  and the commands of line {before.line} printed\n{indented(results[block.follows])}"
            elif block.language in RUN:
                begun = time.monotonic()
                status, printed = runner.run(block)
                took = time.monotonic() - begun
                seconds += took
                results[k] = printed
                ran += 1
                if status is None:
                    failed = f"{where}: not done after {limit:g} s:\n{indented(block.text)}  It printed\n{indented(printed)}"
                elif status != 0:
                    failed = f"{where}: ended with status {status}:\n{indented(block.text)}  It printed\n{indented(printed)}"
                elif took > 5:
                    say(f"{where}: took {took:.1f} s")
            else:
                shown += 1
            if failed:
                say(failed)
                break
    finally:
        runner.close()
    say(f"{page}: {ran} run in {seconds:.1f} s, {written} written as files, {compared} outputs compared, {sum(reasons.values())} not run, {shown} for reading")
    for reason, count in sorted(reasons.items()):
        say(f"  not run ({count}): {reason}")
    return failed is None


def is_runnable(page):
    """Whether there is anything to test: a block to run or to write, or one that should have been."""
    try:
        return any(block.language in RUN or block.remark for block in blocks(page.read_text()))
    except Broken:
        return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="+", type=pathlib.Path, metavar="PAGE")
    parser.add_argument("--build", type=pathlib.Path, metavar="DIR", help="build folder with the programs")
    parser.add_argument("--runnable", action="store_true", help="only print which pages have something to run")
    parser.add_argument("--limit", type=float, default=240, metavar="S", help="longest a block may take (240)")
    options = parser.parse_args()
    if options.runnable:
        print(*filter(is_runnable, options.pages), sep="\n")
        return 0
    if options.build is None:
        parser.error("--build is required")
    results = [run_page(page, options.build.resolve(), options.limit) for page in options.pages]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
