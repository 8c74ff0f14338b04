"""palpate-precompute and palpate-runtime as functions."""

from __future__ import annotations

import json
import operator
import os
import pathlib
import subprocess
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Union

import numpy

from .arrays import Array, ArrayLike
from .library import Error, path_text, program

Path = Union[str, "os.PathLike[str]"]  # as CPython 3.9 takes it


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


# How a description of ours begins; and by dimension of the points and nodes of an element, its number in VTK; 3 nodes in space are triangles of a surface.
WRITTEN = "# Written by palpate.bake_mesh.\n"
CELLS = {(2, 3): 5, (2, 4): 9, (3, 4): 10, (3, 10): 24, (3, 8): 12}


def bake_mesh(points: ArrayLike, elements: ArrayLike, output: Path, *, regions: ArrayLike | None = None, jobs: int | None = None,
              force: bool = False, progress: Callable[[str], object] | None = None, **description: Any) -> None:
    """Makes `output` (NAME.palpate.hdf) of a mesh in memory. `points` [N, 3] (in the plane [N, 2]); `elements`: nodes of the triangles of
    a closed surface [F, 3], which is filled, or of finite elements in VTK's order: tet4 [E, 4], tet10 [E, 10], hex8 [E, 8], in the plane
    tri3 [E, 3], quad4 [E, 4]; `regions`: a number for each of these. All else is what model.toml says, by its own names: `material`,
    `fixed`, `mesh`, `storage` and so on: a dictionary for a table, a list of them for [[...]]; `geometry` may have `scale`, else points
    are metres. Mesh and description are kept beside the output, in the folder NAME.mesh: they are what the file was made from.
    Throws Error with what palpate-precompute says."""
    points, elements = numpy.asarray(points, float), numpy.asarray(elements)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise Error(f"points are an array of shape {points.shape}", "give a row of 3 numbers for each point, in the plane of 2", "argument")
    if elements.ndim != 2 or elements.dtype.kind not in "iu":
        raise Error(f"elements are an array of {elements.dtype}, of shape {elements.shape}", "give a row of whole numbers for each element: its points, from 0", "argument")
    is_surface = points.shape[1] == elements.shape[1] == 3
    cell = CELLS.get((points.shape[1], elements.shape[1]))
    if cell is None and not is_surface:
        raise Error(f"there are no elements of {elements.shape[1]} nodes for points of {points.shape[1]} numbers",
                    "give 3, 4, 8 or 10 nodes in space, 3 or 4 in the plane", "argument")
    if regions is not None and (is_surface or numpy.shape(regions) != (len(elements),)):
        raise Error(f"regions are an array of shape {numpy.shape(regions)}", f"give a number for each of the {len(elements)} finite elements", "argument")
    name = os.fsdecode(output).removesuffix(".palpate.hdf")
    folder = pathlib.Path(name + ".mesh")
    model = folder / "model.toml"
    if folder.exists() and not (model.exists() and model.read_text(errors="replace").startswith(WRITTEN)):
        raise Error(f"{folder} is there, and was not written by bake_mesh", "move it, or choose another output", "file")
    folder.mkdir(exist_ok=True)
    file = "mesh.off" if is_surface else "mesh.vtk"
    with open(folder / file, "w") as mesh:
        if is_surface:
            mesh.write(f"OFF\n{len(points)} {len(elements)} 0\n")
        else:
            mesh.write(f"# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {len(points)} double\n")
        numpy.savetxt(mesh, numpy.pad(points, ((0, 0), (0, 3 - points.shape[1]))), "%.17g")
        if not is_surface:
            mesh.write(f"CELLS {len(elements)} {elements.size + len(elements)}\n")
        numpy.savetxt(mesh, numpy.insert(elements, 0, elements.shape[1], axis=1), "%d")
        if not is_surface:
            mesh.write(f"CELL_TYPES {len(elements)}\n" + f"{cell}\n" * len(elements))
        if regions is not None:
            mesh.write(f"CELL_DATA {len(elements)}\nSCALARS region int 1\nLOOKUP_TABLE default\n")
            numpy.savetxt(mesh, numpy.asarray(regions), "%d")
    geometry = {"surface" if is_surface else "volume": file, **description.pop("geometry", {})}
    told = {"name": pathlib.Path(name).name, **description, "geometry": geometry}
    model.write_text(WRITTEN + "".join(f"{key} = {_toml(value)}\n" for key, value in told.items()), encoding="utf-8")
    bake(model, output, jobs=jobs, force=force, progress=progress)


def _toml(value: object) -> str:
    """A value of a description as TOML has it. Throws Error where there is no such value."""
    if isinstance(value, (numpy.ndarray, numpy.generic)):
        value = value.tolist()
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(str(key))} = {_toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(each) for each in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (bool, int, float)):
        return repr(value).lower()
    raise Error(f"{value!r} is no value of model.toml", "give numbers, text, lists and dictionaries", "argument")


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
