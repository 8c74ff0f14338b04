"""What Palpate's files hold, as arrays of numpy."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any

import numpy

from .arrays import Array, NDArray
from .cdr import HEAD, BadMessage, Layout
from .library import Error, path_bytes
from .mcap import McapFile

_BODY = "a file of palpate-precompute, NAME.palpate.hdf"
_RECORDING = "name a recording of palpate-runtime play --record"


def text_of(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def as_library_opens(h5py: Any) -> Any:
    """File access like that of libpalpate: HDF5 refuses two ways of opening one file in a process."""
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
    access.set_file_locking(False, True)
    return access


class Body:
    """A baked body, NAME.palpate.hdf, open until it is closed. `file` is the open h5py.File, for what has no name here. Throws
    Error."""

    def __init__(self, path: str | os.PathLike[str]):
        import h5py  # sessions and recordings do without

        try:
            self.file = h5py.File(h5py.h5f.open(path_bytes(path), h5py.h5f.ACC_RDONLY, as_library_opens(h5py)))
        except OSError as reason:
            raise Error(f"{os.fspath(path)} cannot be read: {reason}", f"name {_BODY}") from reason
        if text_of(self.file.attrs.get("format", "")) != "palpate":
            self.file.close()
            raise Error(f"{os.fspath(path)} is not {_BODY}", f"name {_BODY}")

    def close(self) -> None:
        self.file.close()

    def __enter__(self) -> Body:
        return self

    def __exit__(self, kind: type[BaseException] | None, reason: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    @property
    def name(self) -> str:
        return text_of(self.file.attrs["name"])

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.file.attrs["dimension"])

    @property
    def nodes(self) -> Array:
        """Positions [N, 3] [m]."""
        return self.file["/mesh/nodes"][:]

    @property
    def elements(self) -> NDArray[Any]:
        """Nodes of the elements [E, k], numbered as VTK does."""
        width = int(self.file["/mesh/offsets"][1])
        return self.file["/mesh/connectivity"][:].reshape(-1, width)

    @property
    def surface(self) -> NDArray[Any]:
        """Nodes of the surface's triangles, counter-clockwise seen from outside [F, 3]; in the plane of lines [F, 2]."""
        return self.file["/mesh/surface"][:]

    @property
    def held(self) -> NDArray[Any]:
        """Whether each node is held along each axis [N, 3]."""
        return (self.file["/dofs/fixed"][:][:, None] >> numpy.arange(3) & 1).astype(bool)

    @property
    def stored_nodes(self) -> NDArray[Any]:
        """Mesh node of each stored node [S]: those that Green's functions are there for."""
        return self.file["/dofs/stored_nodes"][:]

    def greens(self, nodes: Sequence[int]) -> Array:
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


class Messages(Sequence):
    """The messages of a channel in the order of the file, each as a dictionary of its fields. `times`: when each was logged,
    since the start of the run [s]. Throws Error where one is damaged."""

    def __init__(self, file: McapFile, topic: str):
        self._file, self.topic = file, topic
        self._channel = file.channels[topic]
        if (self._channel.encoding, self._channel.schema.encoding) != ("cdr", "ros2msg"):
            raise self.error(f"messages are {self._channel.encoding} by a schema in {self._channel.schema.encoding}, not CDR by ros2msg")
        try:
            self.layout = Layout(self._channel.schema.name, self._channel.schema.text)
        except BadMessage as reason:
            raise self.error(str(reason)) from None

    def error(self, what: str) -> Error:
        return Error(f"{self._file.path}, {self.topic}: {what}", "copy the file again, or record again")

    @property
    def times(self) -> NDArray[Any]:
        return self._channel.times * 1e-9

    def __len__(self) -> int:
        return len(self._channel.places)

    def __getitem__(self, number: Any) -> Any:
        if isinstance(number, slice):
            return [self[k] for k in range(*number.indices(len(self)))]
        at, size = int(self._channel.places[number]), int(self._channel.sizes[number])
        try:
            return self.layout.read(self._file.data[at : at + size])
        except BadMessage as reason:
            raise self.error(f"message {number}: {reason}") from None

    def columns(self) -> dict[str, tuple[int, numpy.dtype]]:
        """Of messages of a fixed size: by name of each field where it lies and its type. Poses, vectors and quaternions are
        told by their parts: "tool" as "tool_position" [3] and "tool_orientation" [4]."""
        kind = self.layout.dtype
        if kind is None:
            raise self.error("its messages vary in size")
        size = len(HEAD) + kind.itemsize
        if ((self._channel.sizes < size) | (self._channel.sizes > size + 3)).any():
            raise self.error(f"a message is not of {size} bytes")
        if (self._file.gather(self._channel.places, f"V{len(HEAD)}") != numpy.void(HEAD)).any():
            raise self.error("a message does not begin as little-endian CDR")
        return _columns("", kind, len(HEAD))

    def column(self, at: int, kind: numpy.dtype) -> NDArray[Any]:
        return self._file.gather(self._channel.places + at, kind)


def _columns(name: str, kind: numpy.dtype, at: int) -> dict[str, tuple[int, numpy.dtype]]:
    if kind.names is None:
        return {name: (at, kind)}
    places = [kind.fields[part][1] for part in kind.names]
    if kind.names in (tuple("xyz"), tuple("xyzw")) and all(kind[part] == numpy.dtype("<f8") for part in kind.names):
        return {name: (at + places[0], numpy.dtype(("<f8", (len(places),))))}  # one after another, as CDR has them
    found = {}
    for part, place in zip(kind.names, places):
        found.update(_columns(f"{name}_{part}" if name else part, kind[part], at + place))
    return found


class Frames:
    """The pictures of a body that moves by itself. `frames["displacement"]` is a field of them: `[7]` reads one, `[:]` all."""

    def __init__(self, messages: Messages):
        self._messages = messages

    def __len__(self) -> int:
        return len(self._messages)

    def __getitem__(self, field: str) -> FrameField:
        names = [each.name for each in self._messages.layout.fields()]
        if field not in names:
            raise KeyError(f"{field}: frames have {', '.join(names)}")
        return FrameField(self._messages, field)


class FrameField(Sequence):
    def __init__(self, messages: Messages, field: str):
        self._messages, self._field = messages, field

    def __len__(self) -> int:
        return len(self._messages)

    def __getitem__(self, number: Any) -> Any:
        if isinstance(number, slice):
            return numpy.array([self[k] for k in range(*number.indices(len(self)))])
        value = self._messages[number][self._field]
        return value.reshape(-1, 3) if self._field == "displacement" else value

    def __array__(self, dtype: Any = None, copy: Any = None) -> NDArray[Any]:
        return numpy.asarray(self[:], dtype)


def read(path: str | os.PathLike[str]) -> Recording:
    """What `palpate-runtime play --record` wrote, also while it goes on or after it was killed: what was whole then."""
    return Recording(path)


class Recording:
    """A recording; palpate.read opens it. `recording["force"]` is a field of each tick, as the book's list of fields names
    them. `finished` is False where the program that wrote it was killed, or still writes. Needs numpy alone. Throws Error,
    with the place, where the file is damaged."""

    def __init__(self, path: str | os.PathLike[str]):
        file = McapFile(path)
        self._file = file
        self.info = file.metadata.get("palpate", {})
        if self.info.get("format") != "palpate-recording":
            raise Error(f"{file.path} is an MCAP file, and not of Palpate", _RECORDING)
        if self.info.get("version", "").partition(".")[0] != "7":
            raise Error(f"{file.path} has version {self.info.get('version')!r}, and this package reads 7", "record it again")
        self.finished = file.finished
        tools = sorted(topic for topic in file.channels if topic.startswith("/tool/") and topic.endswith("/tick"))
        if not tools:
            raise Error(f"{file.path} has no channel of ticks", _RECORDING)
        self._ticks = Messages(file, tools[0])
        self._columns = {name.removeprefix("wrench_"): place for name, place in self._ticks.columns().items()}

    def __getitem__(self, field: str) -> NDArray[Any]:
        if field not in self._columns:
            raise KeyError(f"{field}: the recording has {', '.join(self)}")
        values = self._ticks.column(*self._columns[field])
        return numpy.roll(values, 1, axis=1) if field.endswith("_orientation") else values  # w, x, y, z as everywhere in Palpate

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """Number of ticks."""
        return len(self._ticks)

    @property
    def rate(self) -> int:
        """Ticks a second."""
        return int(self.info["rate"])

    @property
    def options(self) -> dict[str, str]:
        """What the run was given, such as tool and overlay."""
        return dict(line.split("=", 1) for line in self.info.get("options", "").splitlines() if "=" in line)

    @property
    def topics(self) -> list[str]:
        return list(self._file.channels)

    def messages(self, topic: str) -> Messages:
        """All messages of a channel, as "/contacts" and "/events"."""
        if topic not in self._file.channels:
            raise KeyError(f"{topic}: the recording has {', '.join(self.topics)}")
        return Messages(self._file, topic)

    @property
    def surface(self) -> dict[str, NDArray[Any]]:
        """`nodes` [S, 3] without loads [m], `simplices` [F, d], `held` [S]: bit 0, 1, 2 where held along x, y, z."""
        surface = self._surface()
        return surface | {"nodes": surface["nodes"][: len(surface["held"])]}

    @property
    def pressed_nodes(self) -> NDArray[Any]:
        """[N, 3] nodes that /contacts names, without loads [m]: those of the surface, and where tools meet a finer one its own behind them."""
        return self._surface()["nodes"]

    def _surface(self) -> dict[str, NDArray[Any]]:
        told = self.messages("/surface")
        if not len(told):
            raise Error(f"{self._file.path} has no surface", "record again without --record-frames 0")
        surface = told[0]
        try:
            return {"nodes": surface["nodes"].reshape(-1, 3), "simplices": surface["simplices"].reshape(-1, surface["corners"]),
                    "held": surface["held"]}
        except ValueError:
            raise told.error("the surface's sizes do not agree") from None

    @property
    def frames(self) -> Frames:
        """The pictures that are in the file. Throws Error where they follow from /contacts and the model."""
        if "/pictures" not in self.topics or len(self.messages("/contacts")):
            raise Error(f"{self._file.path} has contact forces in the place of pictures",
                        "palpate-runtime export FILE --hdf5 OUT.h5 computes the pictures")
        return Frames(self.messages("/pictures"))

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
