"""A body and the tools that touch it, a tick at a time."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import operator
import os
from collections.abc import Sequence
from typing import Any

import numpy

from .arrays import Array, ArrayLike, NDArray, Numbers
from .library import (ERROR_STATE, NOT_STEPPED, CContact, CCounts, COptions, COverlay, CPose, CRecordOptions, CResult, CTool, Error,
                      load, path_bytes, whole)

DOUBLES = ctypes.POINTER(ctypes.c_double)
FLOATS = ctypes.POINTER(ctypes.c_float)
POSE = numpy.dtype(CPose)
CONTACT = numpy.dtype(CContact)


@dataclasses.dataclass
class Tool:
    """A rigid tool: all points within `radius` of a point, of a segment of `length` along its z axis, or of a disc normal to
    that axis that makes it as wide as `disc_radius`; lengths in m. By default it has no spring between it and the hand
    (`coupling_stiffness` [N/m], `coupling_torsion` [N m/rad]), no largest force [N], and the material's friction
    (negative). A grab that touches nothing holds the nearest surface within `reach` [m]. `hand_over`: share of the force
    that may change in a millisecond without the tool's motion explaining it."""

    radius: float = 0.0
    length: float = 0.0
    coupling_stiffness: float = math.inf
    coupling_torsion: float = math.inf
    max_force: float = math.inf
    friction: float = -1.0
    reach: float = 0.0
    hand_over: float = 0.005
    disc_radius: float = 0.0


@dataclasses.dataclass
class Overlay:
    """A finer mesh under the tools: elements within `rings` rings are cut into refinement^3 (in the plane refinement^2).

    Refinement 0 is no mesh, but the body's own compliance close to the tools, as `palpate-runtime play` has by default.
    """

    refinement: int = 3
    rings: int = 2
    memory: int = 512 << 20  # [bytes] at most, of all overlays


@dataclasses.dataclass
class Felt:
    """What a tool feels since the last tick; SI units, arrays of numpy."""

    force: Array  # [3] on the hand
    torque: Array  # [3] on the hand, about the tool's origin
    tool_position: Array  # [3] of the tool itself, which the surface keeps outside
    tool_orientation: Array  # [4] w, x, y, z
    contacts: int  # places where tool and surface press on each other
    local_stiffness: Array  # [3, 3] of the force between ticks: force - local_stiffness (x - local_point)
    local_point: Array  # [3]
    local_radius: float  # of local_point, within which that holds
    force_error: float  # how far the force may be off, about, where the tick was a best effort; else 0
    left_out: int  # contact points that the tool presses on and that found no room
    small_strain: float  # with depth: by which small strain has more force for the same places, as a fraction of it; else 0
    greens_error: float  # what the force may be off by at most as compressed Green's functions are not exact
    status: frozenset[str]  # of the tick, such as "not_converged"; empty where all is well


@dataclasses.dataclass
class Contacts:
    """Where a tool and the surface press on each other, a row for each place."""

    position: Array  # [K, 3] of the surface
    normal: Array  # [K, 3] of the surface, out of the body
    force: Array  # [K, 3] on the tool


def felt_of(result: CResult, status: frozenset[str]) -> Felt:
    members: dict[str, Any] = {}
    for name, kind in CResult._fields_[1:]:
        value = getattr(result, name)
        members[name] = numpy.array(value) if isinstance(value, ctypes.Array) else value
    members["local_stiffness"] = members["local_stiffness"].reshape(3, 3)
    return Felt(**members, status=status)


def c_tool(tool: Tool) -> CTool:
    return CTool(ctypes.sizeof(CTool), *dataclasses.astuple(tool))


def c_overlay(overlay: Overlay | None) -> Any:
    if overlay is None:
        return None
    return ctypes.pointer(COverlay(ctypes.sizeof(COverlay), whole(overlay.refinement, "refinement"), whole(overlay.rings, "rings"),
                                   whole(overlay.memory, "memory", 0, (1 << 63) - 1)))


class Session:
    """One body and the tools that touch it. One thread steps (`put`, `step`, `play`, `felt`, `contacts`, `set_tool`, `reset`, `record`,
    `end_recording`); others may draw at the same time (`rest`, `simplices`, `displacement`, `stress`) and close: what comes
    later, or from a second thread that steps, is an Error.

    `file`: NAME.palpate.hdf; `tools`: one or several; `max_contacts`: room for contact points of all tools, 1 to 256;
    `overlay`: a finer mesh under the tools; `dynamic_contact`: the tools meet the body's inertia too (the file needs
    dynamics with a time step of one tick); `tick`: time from one step to the next [s]; `stress_ticks`: a thread finds
    stress and pressure each so many ticks, for `stress`, 0 never; `depth`: the body turns and bends far, as by `play --depth
    yes`. Throws Error."""

    def __init__(self, file: str | os.PathLike[str], tools: Tool | Sequence[Tool], *, max_contacts: int = 32,
                 overlay: Overlay | None = None, dynamic_contact: bool = False, tick: float = 0.001,
                 stress_ticks: int = 0, depth: bool = False):
        self.tools = [tools] if isinstance(tools, Tool) else list(tools)
        self.tick = tick
        self._created = list(self.tools)
        self._library = load()
        self._session = None
        c_tools = (CTool * len(self.tools))(*[c_tool(tool) for tool in self.tools])
        options = COptions(ctypes.sizeof(COptions), c_overlay(overlay), bool(dynamic_contact), tick,
                           whole(stress_ticks, "stress_ticks", -(1 << 63), (1 << 63) - 1), bool(depth))
        error = ctypes.create_string_buffer(4096)
        self._session = self._library.palpate_create_with_options(
            path_bytes(file), c_tools, len(self.tools), whole(max_contacts, "max_contacts"), ctypes.byref(options), error, len(error))
        if self._session is None:
            raise self._failure(error, self._library.palpate_last_code())
        self._poses = (CPose * len(self.tools))()
        for pose in self._poses:
            pose.size, pose.orientation = ctypes.sizeof(CPose), (1.0, 0.0, 0.0, 0.0)
        self._view = numpy.frombuffer(self._poses, POSE)  # the same memory
        self._names: dict[int, frozenset[str]] = {0: frozenset()}
        self._status = 0

    def close(self) -> None:
        """Ends the session, after the step under way in another thread; what it gave stays."""
        session, self._session = self._session, None
        if session is not None:
            self._library.palpate_destroy(session)

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_session", None) is not None:
            self.close()

    def _open(self) -> int:
        if self._session is None:
            raise Error("the session is closed", "make another one", "state")
        return self._session

    def _refused(self) -> Error:
        """Why the library did nothing."""
        try:
            self._open()
        except Error as closed:
            return closed
        return Error("another thread steps the session, or it is recorded", "let one thread step, and end a recording before a reset", "state")

    def _call(self, function: str, *arguments: Any) -> int:
        """0, or what is wrong with an argument. Throws Error where the session is closed or used by another thread."""
        code = int(getattr(self._library, function)(self._open(), *arguments))
        if code == ERROR_STATE:
            raise self._refused()
        return code

    def _number(self, tool: int) -> int:
        """Throws IndexError where there is no such tool."""
        if not 0 <= operator.index(tool) < len(self.tools):
            raise IndexError(f"tool {tool} of {len(self.tools)}")
        return operator.index(tool)

    def put(self, tool: int, position: ArrayLike, orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
            grab: bool = False) -> None:
        """Sets where the device wants a tool in the next ticks: position [m], quaternion w, x, y, z, grab. Throws Error where these are
        not 3 (of a body in the plane also 2) and 4 numbers, and IndexError where there is no such tool."""
        pose = self._view[self._number(tool)]
        position = self._in_space(position)
        if numpy.shape(position) != (3,) or numpy.shape(orientation) != (4,):
            raise Error(f"a pose is 3 numbers and 4, not {position!r} and {orientation!r}", "give x, y, z and w, x, y, z", "argument")
        pose["position"], pose["orientation"], pose["grab"] = position, orientation, bool(grab)

    def _in_space(self, position: ArrayLike) -> ArrayLike:
        if numpy.shape(position) == (2,) and self._counts().corners == 2:
            return numpy.append(position, 0.0)
        return position

    def step(self, position: ArrayLike | None = None, orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
             grab: bool = False) -> Felt:
        """One tick, with the poses that `put` set; of the first tool, the one given here. What the first tool feels.
        Neither waits nor allocates in the library, and other threads of Python run meanwhile."""
        session = self._open()
        if position is not None:
            self.put(0, position, orientation, grab)
        status = self._library.palpate_step(session, self._poses)
        if status & NOT_STEPPED:
            raise self._refused()
        self._status = status
        return self.felt(0)

    def felt(self, tool: int) -> Felt:
        """What a tool feels since the last tick. Throws IndexError where there is no such tool."""
        result = CResult(ctypes.sizeof(CResult))
        self._call("palpate_get", self._number(tool), ctypes.byref(result))
        return felt_of(result, self.status)

    def contacts(self, tool: int = 0) -> Contacts:
        """The contacts of a tool in the last tick. Throws IndexError where there is no such tool."""
        number, count = self._number(tool), ctypes.c_int()
        self._call("palpate_get_contacts", number, None, 0, ctypes.byref(count))
        found = (CContact * count.value)()
        if found:
            found[0].size = ctypes.sizeof(CContact)
            self._call("palpate_get_contacts", number, found, len(found), ctypes.byref(count))
        rows = numpy.frombuffer(found, CONTACT) if found else numpy.empty(0, CONTACT)
        return Contacts(*(rows[name].copy() for name in ("position", "normal", "force")))

    def set_tool(self, number: int, tool: Tool) -> None:
        """What a tool is from the next tick on; its shape stays. Throws Error where the shape is another, or a value makes no
        sense, and IndexError where there is no such tool."""
        number = self._number(number)
        if self._call("palpate_set_tool", number, ctypes.byref(c_tool(tool))) != 0:
            raise Error(f"tool {number} cannot become {tool}",
                        "keep radius, length and disc_radius; springs, largest force and hand-over are positive")
        self.tools[number] = tool

    @property
    def status(self) -> frozenset[str]:
        """Names of the status bits of the last tick."""
        bits = self._status
        if bits not in self._names:
            names = (self._library.palpate_status_name(1 << k) for k in range(32) if bits >> k & 1)
            self._names[bits] = frozenset(name.decode() for name in names if name)
        return self._names[bits]

    def play(self, positions: ArrayLike) -> Array:
        """One tick for each row of `positions` [T, 3] (in the plane also [T, 2]) of the first tool [m]; the forces on the hand
        [T, 3] [N]."""
        return numpy.array([self.step(position).force for position in numpy.atleast_1d(positions)]).reshape(-1, 3)

    def reset(self) -> None:
        """Back to a body that nobody has touched, and to the tools that the session was made with. Throws Error while it is
        recorded."""
        self._call("palpate_reset")
        self.tools = list(self._created)
        self._status = 0

    def record(self, file: str | os.PathLike[str], *, pictures: float = 60.0, tool: int = 0) -> None:
        """Records each tick of a tool from now on, from the untouched body, with so many pictures of the surface a second. What
        stands at `file` is replaced only where it is empty or an earlier recording without a tick.
        `palpate.Recording` reads it, and `palpate-runtime play BODY --device replay:FILE` repeats it. Throws Error."""
        options = CRecordOptions(ctypes.sizeof(CRecordOptions), whole(tool, "tool"), pictures)
        error = ctypes.create_string_buffer(4096)
        code = self._library.palpate_record(self._open(), path_bytes(file), ctypes.byref(options), error, len(error))
        if code != 0:
            raise self._failure(error, code)

    def end_recording(self) -> None:
        """The recording is one plain file then. Throws Error."""
        error = ctypes.create_string_buffer(4096)
        code = self._library.palpate_record_end(self._open(), error, len(error))
        if code != 0:
            raise self._failure(error, code)

    def _failure(self, error: ctypes.Array[ctypes.c_char], code: int) -> Error:
        return Error.of_text(error.value.decode(errors="replace"), self._library.palpate_code_name(code).decode())

    @property
    def rest(self) -> Array:
        """Positions of the surface nodes on the body at rest [S, 3] [m]."""
        rest = numpy.empty((self._counts().nodes, 3))
        self._call("palpate_surface_rest", rest.ctypes.data_as(DOUBLES))
        return rest

    @property
    def simplices(self) -> Numbers:
        """Surface nodes of the triangles, counter-clockwise seen from outside [F, 3]; in the plane of lines [F, 2]."""
        counts = self._counts()
        corners = numpy.empty((counts.simplices, counts.corners), numpy.int32)
        self._call("palpate_surface_simplices", corners.ctypes.data_as(ctypes.POINTER(ctypes.c_int32)))
        return corners

    def displacement(self) -> Array:
        """Displacement of the surface nodes from rest in the last tick [S, 3] [m]; another thread may ask while one steps."""
        u = numpy.empty((self._counts().nodes, 3))
        self._call("palpate_surface_displacement", u.ctypes.data_as(DOUBLES))
        return u

    def stress(self) -> tuple[int, NDArray[numpy.float32], NDArray[numpy.float32]]:
        """Tick, von Mises stress and contact pressure of the surface nodes [S] [Pa] as they were found last; the tick is -1,
        and all is NaN, where there are none yet. Stress is NaN where it is not known."""
        found = [numpy.full(self._counts().nodes, numpy.nan, numpy.float32) for _ in range(2)]
        tick = self._library.palpate_surface_stress(self._open(), *[values.ctypes.data_as(FLOATS) for values in found])
        return tick, found[0], found[1]

    def _counts(self) -> CCounts:
        counts = CCounts(ctypes.sizeof(CCounts))
        self._call("palpate_surface_counts", ctypes.byref(counts))
        return counts
