"""palpate-precompute and palpate-runtime as functions."""

from __future__ import annotations

import json
import operator
import os
import subprocess
from collections.abc import Callable, Iterable

import numpy
from numpy.typing import ArrayLike

from .library import Array, Error, path_text, program

Path = str | os.PathLike[str]


def bake(model: Path, output: Path, *, jobs: int | None = None, force: bool = False,
         progress: Callable[[str], object] | None = None) -> None:
    """Makes `output` (NAME.palpate.hdf) of a model.toml by palpate-precompute. `progress` takes each line that it prints.
    Goes on with what an interrupted run has finished. Throws Error with what the program says."""
    command = [program("palpate-precompute"), path_text(model), "-o", path_text(output)]
    command += ["--jobs", str(jobs)] if jobs is not None else []
    command += ["--force"] if force else []
    lines = []
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace") as process:
        assert process.stderr is not None
        for line in process.stderr:
            lines.append(line)
            if progress is not None:
                progress(line.rstrip())
    if process.returncode != 0:
        raise Error.of_text("".join(lines))


def _vectors(option: str, rows: ArrayLike) -> list[str]:
    """An option for each of the rows [K, d]."""
    words = []
    for row in numpy.atleast_1d(rows):
        if numpy.shape(row) not in ((2,), (3,)):
            raise Error(f"a vector is 2 or 3 numbers, not {row}", "give an array of a row for each node", "argument")
        words += [option, ",".join(repr(float(x)) for x in row)]
    return words


def probe(file: Path, displace: ArrayLike, *, at: ArrayLike = (), node: Iterable[int] = (),
          overlay: tuple[int, int] | None = None) -> Array:
    """Forces on the body [N] that displace nodes by `displace` [K, d] [m], all other nodes being free: of the free surface
    nodes nearest to the points `at` [m], or of the mesh nodes `node`. `overlay`: refinement and rings of a finer mesh.
    Throws Error with what palpate-runtime says."""
    command = [program("palpate-runtime"), "probe", path_text(file), "--json"]
    command += _vectors("--at", at)
    for number in node:
        command += ["--node", str(operator.index(number))]
    command += _vectors("--displace", displace)
    if overlay is not None:
        command += ["--overlay", f"r={overlay[0]},rings={overlay[1]}"]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode != 0:
        raise Error.of_text(done.stderr)
    return numpy.array([node["force"] for node in json.loads(done.stdout)["nodes"]])
