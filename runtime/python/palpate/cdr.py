"""Messages of ROS 2: what a `ros2msg` schema says, as types of numpy, and the CDR bytes (little-endian) that follow it."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Any

import numpy

HEAD = b"\x00\x01\x00\x00"  # little-endian CDR, before each message
_NUMBERS = {"bool": "?", "byte": "u1", "char": "u1", "float32": "<f4", "float64": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2",
            "uint16": "<u2", "int32": "<i4", "uint32": "<u4", "int64": "<i8", "uint64": "<u8"}
_FIELD = re.compile(r"(?P<type>[\w/]+)(?:<=\d+)?(?P<array>\[(?:<=)?\d*\])?\s+(?P<name>[A-Za-z]\w*)(?P<rest>.*)")
_CLOCKS = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}
_CLOCK = "int32 sec\nuint32 nanosec"
MOST_ARRAY = 1_000_000  # elements of an array whose length a schema says


class BadMessage(Exception):
    """What is wrong with a schema, or with the bytes of a message."""


@dataclass
class Field:
    """`count`: None for one, -1 for a sequence, else the length of an array."""

    name: str
    type: str
    count: int | None


class Layout:
    """The messages of a schema. `dtype`: of those of a fixed size, else None."""

    def __init__(self, name: str, text: str):
        main, *others = re.split(r"^=+ *\n", text, flags=re.MULTILINE)
        self._types = {"builtin_interfaces/Time": _fields(_CLOCK), "builtin_interfaces/Duration": _fields(_CLOCK)}
        self._root = _short(name)
        for other in others:
            head, _, body = other.partition("\n")
            if not head.startswith("MSG:"):
                raise BadMessage(f"a part of the schema {name} begins with {head[:40]!r}")
            self._types[_short(head.removeprefix("MSG:").strip())] = _fields(body)
        self._types[self._root] = _fields(main)
        for type_name in list(self._types):
            self._types[type_name] = [Field(f.name, self._resolved(f.type, type_name), f.count) for f in self._types[type_name]]
        self._known: dict[tuple[str, int], numpy.dtype | None] = {}
        self._refuse_cycles(self._root, (), set())
        self.dtype = self.placed(self._root, 0)

    def fields(self) -> list[Field]:
        return self._types[self._root]

    def _resolved(self, name: str, inside: str) -> str:
        if name in _NUMBERS or name in ("string", "wstring"):
            return name
        name = _CLOCKS.get(name, "std_msgs/Header" if name == "Header" else name)
        package = inside.rpartition("/")[0]
        for full in (_short(name), f"{package}/{name}"):
            if full in self._types:
                return full
        raise BadMessage(f"the schema does not say what {name} is")

    def _refuse_cycles(self, name: str, around: tuple[str, ...], seen: set[str]) -> None:
        if name in around or len(around) > 20:
            raise BadMessage(f"{name} holds itself")
        if name not in seen:
            for each in self._types.get(name, ()):
                self._refuse_cycles(each.type, (*around, name), seen)
        seen.add(name)

    def placed(self, name: str, start: int) -> numpy.dtype | None:
        """The type of a value that begins `start` bytes after a multiple of 8, or None where its size varies. Its fields lie
        where CDR has them: each number at a multiple of its size."""
        if name in _NUMBERS:
            return numpy.dtype(_NUMBERS[name])
        if name not in self._types:
            return None  # a text
        key = name, start % 8
        if key not in self._known:
            try:
                self._known[key] = self._placed_struct(*key)
            except ValueError:
                raise BadMessage(f"{name} is larger than a message can be") from None
        return self._known[key]

    def _placed_struct(self, name: str, start: int) -> numpy.dtype | None:
        names, kinds, offsets, at = [], [], [], start
        for each in self._types[name]:
            placed = None if each.count == -1 else self._placed_field(each, at)
            if placed is None:
                return None
            offset, kind = placed
            names.append(each.name)
            kinds.append(kind)
            offsets.append(offset - start)
            at = offset + kind.itemsize
        return numpy.dtype({"names": names, "formats": kinds, "offsets": offsets, "itemsize": at - start}) if names else None

    def _placed_field(self, each: Field, at: int) -> tuple[int, numpy.dtype] | None:
        if each.type in _NUMBERS:
            at += -at % numpy.dtype(_NUMBERS[each.type]).itemsize
        kind = self.placed(each.type, at)
        if kind is None:
            return None
        if each.count is None:
            return at, kind
        if each.count > 1 and self.placed(each.type, at + kind.itemsize) != kind:
            return None  # the elements lie in different ways
        return at, numpy.dtype((kind, (each.count,)))

    def read(self, data: memoryview) -> dict[str, Any]:
        """A message, with what names its fields have. Throws BadMessage where the bytes do not follow the schema."""
        if bytes(data[:4]) != HEAD:
            raise BadMessage("the message does not begin as little-endian CDR")
        reader = _Values(data[4:], self)
        values = reader.struct(self._root)
        if reader.at + 3 < len(reader.data):
            raise BadMessage(f"the message has {len(reader.data) - reader.at} bytes more than its schema")
        return values


class _Values:
    def __init__(self, data: memoryview, layout: Layout):
        self.data, self.layout, self.at = data, layout, 0

    def take(self, size: int, align: int) -> int:
        at = self.at + -self.at % align
        if size > len(self.data) - at:
            raise BadMessage(f"{size} bytes are told where {max(len(self.data) - at, 0)} are left")
        self.at = at + size
        return at

    def value(self, name: str) -> Any:
        if name in _NUMBERS:
            kind = numpy.dtype(_NUMBERS[name])
            return numpy.frombuffer(self.data, kind, 1, self.take(kind.itemsize, kind.itemsize))[0].item()
        if name == "string":
            size = self.take_count()
            at = self.take(size, 1)
            try:
                return bytes(self.data[at : at + size]).removesuffix(b"\0").decode()
            except UnicodeDecodeError:
                raise BadMessage("a text is not UTF-8") from None
        if name == "wstring":
            raise BadMessage("wide texts are not read")
        return self.struct(name)

    def take_count(self) -> int:
        return struct.unpack_from("<I", self.data, self.take(4, 4))[0]

    def struct(self, name: str) -> dict[str, Any]:
        return {each.name: self.field(each) for each in self.layout._types[name]}

    def field(self, each: Field) -> Any:
        if each.count is None:
            return self.value(each.type)
        count = self.take_count() if each.count == -1 else each.count
        if count > len(self.data):
            raise BadMessage(f"{count} elements are told where {len(self.data) - self.at} bytes are left")
        return self.elements(each.type, count)

    def elements(self, name: str, count: int) -> Any:
        """An array of numpy where the elements are of a fixed size and all lie alike, else a list."""
        at = self.at + (-self.at % numpy.dtype(_NUMBERS[name]).itemsize if name in _NUMBERS else 0)
        kind = self.layout.placed(name, at % 8)
        if count == 0:
            return numpy.zeros(0, kind) if kind is not None else []
        if kind is None or (count > 1 and self.layout.placed(name, (at + kind.itemsize) % 8) != kind):
            return [self.value(name) for _ in range(count)]
        self.at = at
        return numpy.frombuffer(self.data, kind, count, self.take(count * kind.itemsize, 1))


def _short(name: str) -> str:
    """"package/msg/Type" as "package/Type"."""
    return name.replace("/msg/", "/")


def _fields(text: str) -> list[Field]:
    fields: list[Field] = []
    for line in text.splitlines():
        line = line.split("#", 1)[0].strip() if '"' not in line and "'" not in line else line.strip()
        if not line or line.startswith("#"):
            continue
        match = _FIELD.fullmatch(line)
        if match is None:
            raise BadMessage(f"a line of the schema is {line[:60]!r}")
        if match["rest"].lstrip().startswith("="):
            continue  # a constant
        array = match["array"]
        count = None if array is None else -1 if array == "[]" or array.startswith("[<=") else int(array[1:-1])
        if count == 0 or (count or 0) > MOST_ARRAY or match["name"] in (each.name for each in fields):
            raise BadMessage(f"a line of the schema is {line[:60]!r}")
        fields.append(Field(match["name"], match["type"], count))
    return fields
