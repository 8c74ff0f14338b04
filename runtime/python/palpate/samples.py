"""The samples: a page of all, and each by its name.

    python3 -m palpate.samples          shows the page of samples, as `palpate-runtime samples` does
    python3 -m palpate.samples NAME     copies a sample into the folder NAME, and runs it there"""

from __future__ import annotations

import os
import pathlib
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping

from .library import Error, prefixes, program


def folder() -> pathlib.Path:
    """The folder of the samples. Throws Error where they are not installed."""
    for prefix in prefixes():
        if (prefix / "share" / "palpate" / "samples").is_dir():
            return prefix / "share" / "palpate" / "samples"
    raise Error("the samples are not found", "install Palpate, or put the folder of its programs on PATH", "file")


def names() -> list[str]:
    """The names of all samples."""
    return sorted(file.parent.name for file in folder().glob("*/sample.toml"))


def commands(sample: pathlib.Path) -> str:
    """The commands of a sample in its folder, as a shell takes them: of its sample.toml, without a reader of TOML, which Python has since 3.11."""
    found = re.search(r"^commands = '''\n(.*?)'''$", (sample / "sample.toml").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def environment() -> dict[str, str]:
    """The environment in which samples find programs, library, headers and this package."""
    prefix = folder().parents[2]
    libraries = [path.parent for pattern in ("lib", "lib64", "lib/*", "runtime") for path in prefix.glob(f"{pattern}/libpalpate.so*")]
    added = {"PATH": [pathlib.Path(name).parent for name in (sys.executable, program("palpate-precompute"), program("palpate-runtime"))],
             "PYTHONPATH": [pathlib.Path(__file__).resolve().parents[1]], "CPATH": [prefix / "include"],
             "LIBRARY_PATH": libraries[:1], "LD_LIBRARY_PATH": libraries[:1]}
    found = {**os.environ, "PALPATE": os.environ.get("PALPATE", str(prefix / "share" / "palpate"))}
    for name, paths in added.items():
        found[name] = os.pathsep.join([*map(str, paths), *filter(None, [found.get(name)])])
    return found


def copy(name: str, to: pathlib.Path) -> None:
    """Copies a sample into a folder that is not there yet. Throws Error."""
    source = folder() / name
    if name not in names():
        raise Error(f"there is no sample {name!r}", "samples are " + ", ".join(names()), "argument")
    if to.exists():
        raise Error(f"{to} is there already", "move it, or go to another folder", "file")
    shutil.copytree(source, to, ignore=shutil.ignore_patterns("*.webp"))


def run(sample: pathlib.Path, environment: Mapping[str, str], **options: object) -> subprocess.CompletedProcess[str]:
    """Runs the commands of a sample in its folder, by a shell that stops at the first that fails and tells each."""
    return subprocess.run(["bash", "-exc", commands(sample)], cwd=sample, env=environment, text=True, check=False, **options)  # type: ignore[call-overload, no-any-return]


def main(words: list[str]) -> int:
    if len(words) > 1 or words[:1] in (["-h"], ["--help"]):
        print(__doc__)
        return 0 if words[:1] in (["-h"], ["--help"]) else 2
    try:
        if not words:
            return subprocess.run([program("palpate-runtime"), "samples"], check=False).returncode
        copy(words[0], pathlib.Path(words[0]))
        return run(pathlib.Path(words[0]), environment()).returncode
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
