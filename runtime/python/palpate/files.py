"""What Palpate's files hold, as arrays of numpy."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any

import numpy

from .library import Error


def text_of(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def as_library_opens(h5py: Any) -> Any:
    """File access like that of libpalpate: HDF5 refuses two ways of opening one file in a process."""
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
    access.set_file_locking(False, True)
    return access


class _File:
    """An HDF5 file of one kind, open for reading until it is closed."""

    _format = ""
    _kind = ""

    def __init__(self, path: str | os.PathLike[str]):
        import h5py  # sessions do without

        try:
            self.file = h5py.File(h5py.h5f.open(os.fsencode(path), h5py.h5f.ACC_RDONLY, as_library_opens(h5py)))
        except OSError as reason:
            raise Error(f"{os.fspath(path)} cannot be read: {reason}", f"name {self._kind}") from reason
        if text_of(self.file.attrs.get("format", "")) != self._format:
            self.file.close()
            raise Error(f"{os.fspath(path)} is not {self._kind}", f"name {self._kind}")

    def close(self) -> None:
        self.file.close()

    def __enter__(self) -> Any:
        return self

    def __exit__(self, kind: type[BaseException] | None, reason: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


class Body(_File):
    """A baked body, NAME.palpate.hdf. `file` is the open h5py.File, for what has no name here. Throws Error."""

    _format = "palpate"
    _kind = "a file of palpate-precompute, NAME.palpate.hdf"

    @property
    def name(self) -> str:
        return text_of(self.file.attrs["name"])

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.file.attrs["dimension"])

    @property
    def nodes(self) -> numpy.ndarray:
        """Positions [N, 3] [m]."""
        return self.file["/mesh/nodes"][:]

    @property
    def elements(self) -> numpy.ndarray:
        """Nodes of the elements [E, k], numbered as VTK does."""
        width = int(self.file["/mesh/offsets"][1])
        return self.file["/mesh/connectivity"][:].reshape(-1, width)

    @property
    def surface(self) -> numpy.ndarray:
        """Nodes of the surface's triangles, counter-clockwise seen from outside [F, 3]; in the plane of lines [F, 2]."""
        return self.file["/mesh/surface"][:]

    @property
    def held(self) -> numpy.ndarray:
        """Whether each node is held along each axis [N, 3]."""
        return (self.file["/dofs/fixed"][:][:, None] >> numpy.arange(3) & 1).astype(bool)

    @property
    def stored_nodes(self) -> numpy.ndarray:
        """Mesh node of each stored node [S]: those that Green's functions are there for."""
        return self.file["/dofs/stored_nodes"][:]

    def greens(self, nodes: Sequence[int]) -> numpy.ndarray:
        """Block of the Green's functions at mesh nodes, [d K, d K] [m/N]: column j is the displacement of these nodes under a
        unit force on dof j of them, where all else is free. Read from the file as far as it is asked for. Throws Error where
        a node is not stored, or the file is compressed."""
        if "/greens/packed" not in self.file:
            raise Error(f"the Green's functions of {self.name} are compressed", 'precompute it with [storage] compression = "none"')
        places = {int(node): k for k, node in enumerate(self.stored_nodes)}
        missing = [int(node) for node in nodes if int(node) not in places]
        if missing:
            raise Error(f"no Green's functions are stored for the nodes {missing}", "see stored_nodes")
        d = self.dimension
        n = d * len(places)
        dofs = numpy.array([d * places[int(node)] + axis for node in nodes for axis in range(d)])
        row = numpy.maximum.outer(dofs, dofs)
        column = numpy.minimum.outer(dofs, dofs)
        at, back = numpy.unique(column * n - column * (column - 1) // 2 + row - column, return_inverse=True)
        block = self.file["/greens/packed"][at].astype(float)[back].reshape(row.shape)
        if "/greens/smooth" in self.file:
            order = numpy.argsort(dofs)
            smooth = numpy.empty((len(dofs), self.file["/greens/smooth"].shape[1]))
            smooth[order] = self.file["/greens/smooth"][dofs[order]]
            block += smooth @ smooth.T
        return block


class Recording(_File):
    """What `palpate-runtime play --record` wrote. `recording["force"]` is a field of each tick, as the book's list of fields
    names them; `recording.frames["displacement"]` one of each frame. Throws Error."""

    _format = "palpate-recording"
    _kind = "a recording of palpate-runtime play --record"

    def __getitem__(self, field: str) -> numpy.ndarray:
        if f"/ticks/{field}" not in self.file:
            raise KeyError(f"{field}: the recording has {', '.join(self)}")
        return self.file[f"/ticks/{field}"][:]

    def __iter__(self) -> Iterator[str]:
        return iter(self.file["/ticks"])

    def __len__(self) -> int:
        """Number of ticks."""
        return len(self.file["/ticks/time"])

    @property
    def options(self) -> dict[str, str]:
        """What the run was given, such as tool and overlay."""
        lines = text_of(self.file.attrs["options"]).splitlines()
        return dict(line.split("=", 1) for line in lines if "=" in line)

    def xarray(self) -> Any:
        """All ticks as an xarray.Dataset: a variable for each field along `time` [s], those of several numbers also along `axis`,
        `quaternion` or `symmetric`. The run's options are its attributes."""
        import xarray

        widths = {3: ("axis", list("xyz")), 4: ("quaternion", list("wxyz")), 6: ("symmetric", ["xx", "yy", "zz", "xy", "yz", "zx"])}
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {"time": ("time", self["time"], {"units": "s"})}
        for name in self:
            if name == "time":
                continue
            values = self[name]
            along = [widths[width] for width in values.shape[1:]]
            coordinates.update(along)
            variables[name] = (["time", *(dimension for dimension, _ in along)], values)
        return xarray.Dataset(variables, coordinates, self.options)

    @property
    def frames(self) -> Any:
        """The group of the frames; a frame is read when it is asked for: frames["displacement"][7]."""
        return self.file["/frames"]
