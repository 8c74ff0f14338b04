"""The records of an MCAP file (mcap.dev) with chunks that are not compressed, proved: checksums, lengths and order."""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from dataclasses import dataclass, field

import numpy

from .library import Error

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)
MESSAGE_HEAD = 31  # bytes of a message's record before its data: opcode, length, channel, sequence, two times
_INDEX_ENTRY = numpy.dtype([("time", "<u8"), ("offset", "<u8")])


@dataclass
class Schema:
    name: str
    encoding: str
    text: str


@dataclass
class Channel:
    """`places`: where in the file the data of each message begins; `sizes`: its bytes; `times`: when it was logged [ns]."""

    topic: str
    encoding: str
    schema: Schema
    metadata: dict[str, str]
    places: numpy.ndarray = field(default_factory=lambda: numpy.zeros(0, numpy.int64))
    sizes: numpy.ndarray = field(default_factory=lambda: numpy.zeros(0, numpy.int64))
    times: numpy.ndarray = field(default_factory=lambda: numpy.zeros(0, numpy.int64))


class _Reader:
    """Takes numbers and texts from a part of a file, and never reads beyond it."""

    def __init__(self, file: str, data: memoryview, begin: int, end: int):
        self.file, self.data, self.at, self.end = file, data, begin, end

    def fail(self, what: str) -> Error:
        return Error(f"{self.file}, byte {self.at}: {what}", "copy the file again, or record again")

    def take(self, count: int) -> int:
        """Where the next `count` bytes begin, which are there."""
        if count > self.end - self.at:
            raise self.fail(f"{count} bytes are told where {self.end - self.at} are left")
        self.at += count
        return self.at - count

    def number(self, kind: str) -> int:
        return struct.unpack_from("<" + kind, self.data, self.take(struct.calcsize("<" + kind)))[0]

    def text(self) -> str:
        size = self.number("I")
        at = self.take(size)
        try:
            return bytes(self.data[at : at + size]).decode()
        except UnicodeDecodeError:
            raise self.fail("a text is not UTF-8") from None

    def texts(self) -> dict[str, str]:
        size = self.number("I")
        end = self.take(size) + size
        inner, found = _Reader(self.file, self.data, end - size, end), {}
        while inner.at < end:
            key = inner.text()
            if key in found:
                raise inner.fail(f'"{key}" is there twice')
            found[key] = inner.text()
        return found


class McapFile:
    """A file as it was when it was opened: `channels` by topic, `metadata` by name. `finished`: it has its end; else it was cut
    off, or is being written, and what is whole is there. Throws Error, with the place, where anything is damaged."""

    def __init__(self, path: str | os.PathLike[str]):
        self.path = os.fspath(path)
        try:
            with open(path, "rb") as file:
                self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except (OSError, ValueError) as reason:
            raise Error(f"{self.path} cannot be read: {reason}", "name a recording") from reason
        self.data = memoryview(self._map)
        self.bytes = numpy.frombuffer(self._map, numpy.uint8)
        if bytes(self.data[: len(MAGIC)]) != MAGIC:
            raise Error(f"{self.path} is no MCAP file", "name a recording of palpate-runtime play --record")
        self.finished = len(self.data) >= 2 * len(MAGIC) and bytes(self.data[-len(MAGIC) :]) == MAGIC
        self.channels: dict[str, Channel] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self._schemas: dict[int, Schema] = {}
        self._by_id: dict[int, Channel] = {}
        self._found: dict[int, list[tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray]]] = {}
        self._chunks: list[tuple[int, int]] = []
        self._read()
        for number, parts in self._found.items():
            channel = self._by_id[number]
            channel.places, channel.sizes, channel.times = (numpy.concatenate(columns) for columns in zip(*parts))

    def _reader(self, begin: int, end: int) -> _Reader:
        return _Reader(self.path, self.data, begin, end)

    def _read(self) -> None:
        """The records of the data section, one after another; then the summary, where the file has its end."""
        end = len(self.data) - (len(MAGIC) if self.finished else 0)
        records = self._reader(len(MAGIC), end)
        while records.at < end:
            begin = records.at
            if not self.finished and (end - begin < 9 or end - begin - 9 < struct.unpack_from("<Q", self.data, begin + 1)[0]):
                break  # cut off here
            kind, size = records.number("B"), records.number("Q")
            record = self._reader(records.take(size), records.at)
            if begin == len(MAGIC) and kind != HEADER:
                raise record.fail("the first record is not the header")
            if kind == CHUNK:
                self._take_chunk(record, records, begin)
            elif kind == DATA_END:
                crc = record.number("I")
                if crc and crc != zlib.crc32(self.data[:begin]):
                    raise record.fail("the checksum of the data is another one")
                if self.finished:
                    self._check_summary(records)
                    return
            elif kind == MESSAGE:
                self._add(record, record.number("H"), numpy.array([begin]))
            elif kind == METADATA:
                name = record.text()
                if name in self.metadata:
                    raise record.fail(f'metadata "{name}" is there twice')
                self.metadata[name] = record.texts()
            else:
                self._define(kind, record)
        if self.finished:
            raise records.fail("the data have no end")

    def _define(self, kind: int, record: _Reader) -> None:
        """A schema or a channel, which may be told again as it was."""
        if kind == SCHEMA:
            number, schema = record.number("H"), Schema(record.text(), record.text(), record.text())
            if number == 0 or self._schemas.setdefault(number, schema) != schema:
                raise record.fail(f"schema {number} is told in two ways")
        elif kind == CHANNEL:
            number, of = record.number("H"), record.number("H")
            if of not in self._schemas:
                raise record.fail(f"channel {number} has no schema")
            topic, encoding, metadata = record.text(), record.text(), record.texts()
            channel = Channel(topic, encoding, self._schemas[of], metadata)
            known = self._by_id.get(number)
            if known is None:
                if topic in self.channels:
                    raise record.fail(f'topic "{topic}" has two channels')
                self._by_id[number] = self.channels[topic] = channel
            elif (known.topic, known.encoding, known.schema) != (topic, encoding, channel.schema):
                raise record.fail(f"channel {number} is told in two ways")

    def _take_chunk(self, record: _Reader, records: _Reader, begin: int) -> None:
        record.take(16)  # its times
        size, crc, compression = record.number("Q"), record.number("I"), record.text()
        if compression:
            raise record.fail(f"a chunk is compressed by {compression[:20]!r}, and Palpate's are not compressed")
        inside = record.number("Q")
        at = record.take(inside)
        if inside != size or record.at != record.end:
            raise record.fail("a chunk's sizes do not agree")
        if crc and crc != zlib.crc32(self.data[at : at + size]):
            raise record.fail("the checksum of a chunk is another one")
        self._chunks.append((begin, record.end - begin))
        indexes = self._indexes(records, at, size)
        if not self._take_indexed(record, at, size, indexes):
            self._take_all(at, size)

    def _indexes(self, records: _Reader, at: int, size: int) -> dict[int, numpy.ndarray]:
        """The indexes of messages after a chunk: by channel where in the file each message's record begins."""
        found: dict[int, numpy.ndarray] = {}
        while records.end - records.at >= 9 and self.data[records.at] == MESSAGE_INDEX:
            length = struct.unpack_from("<Q", self.data, records.at + 1)[0]
            if not self.finished and length > records.end - records.at - 9:
                return {}  # cut off here
            records.take(9)
            index = self._reader(records.take(length), records.at)
            channel, listed = index.number("H"), index.number("I")
            entries = numpy.frombuffer(self.data, _INDEX_ENTRY, listed // 16, index.take(listed))
            if listed % 16 or channel in found or (entries["offset"] > max(size - MESSAGE_HEAD, 0)).any():
                raise index.fail("the index of a chunk cannot be")
            found[channel] = entries["offset"].astype(numpy.int64) + at
        return found

    def _take_indexed(self, record: _Reader, at: int, size: int, indexes: dict[int, numpy.ndarray]) -> bool:
        """Takes the messages of a chunk where the index tells them: it is proved that they fill the chunk."""
        if not indexes:
            return False
        places = numpy.concatenate(list(indexes.values()))
        order = numpy.argsort(places, kind="stable")
        places = places[order]
        lengths = self.gather(places + 1, "<u8").astype(numpy.int64)
        ends = numpy.append(places[1:], at + size)
        if not len(places) or places[0] != at or (self.bytes[places] != MESSAGE).any() or (places + 9 + lengths != ends).any():
            return False  # other records are among them, or the index is wrong: each record tells for itself
        for channel, begins in indexes.items():
            if (self.gather(begins + 9, "<u2") != channel).any():
                raise record.fail("the index of a chunk names another channel's messages")
            self._add(record, channel, begins)
        return True

    def _take_all(self, at: int, size: int) -> None:
        """Takes the messages of a chunk record by record."""
        records = self._reader(at, at + size)
        found: dict[int, list[int]] = {}
        while records.at < records.end:
            begin, kind, length = records.at, records.number("B"), records.number("Q")
            record = self._reader(records.take(length), records.at)
            if kind == MESSAGE:
                found.setdefault(record.number("H"), []).append(begin)
            else:
                self._define(kind, record)
        for channel, begins in found.items():
            self._add(records, channel, numpy.array(begins))

    def _add(self, near: _Reader, number: int, begins: numpy.ndarray) -> None:
        if number not in self._by_id:
            raise near.fail(f"a message is of channel {number}, which nothing has told")
        sizes = self.gather(begins + 1, "<u8").astype(numpy.int64) - (MESSAGE_HEAD - 9)
        if (sizes < 0).any():
            raise near.fail("a message is shorter than its head")
        times = self.gather(begins + 15, "<u8").astype(numpy.int64)
        self._found.setdefault(number, []).append((begins + MESSAGE_HEAD, sizes, times))

    def gather(self, places: numpy.ndarray, kind: str | numpy.dtype) -> numpy.ndarray:
        """Values of one kind at these bytes of the file, which are there."""
        kind = numpy.dtype(kind)
        if not len(places):
            return numpy.zeros((0, *kind.shape), kind.base)
        if places.min() < 0 or places.max() + kind.itemsize > len(self.bytes):
            raise Error(f"{self.path}: bytes are told that are not there", "copy the file again, or record again")
        raw = numpy.dtype((numpy.void, kind.itemsize))
        windows = numpy.ndarray((len(self.bytes) - kind.itemsize + 1,), raw, self._map, 0, (1,))
        return windows[places].view(kind.base).reshape(len(places), *kind.shape)

    def _check_summary(self, records: _Reader) -> None:
        """The records after the data, up to the footer: what they say is what the data hold."""
        begin = records.at
        chunks, counted = [], None
        while records.at < records.end:
            at, kind, size = records.at, records.number("B"), records.number("Q")
            record = self._reader(records.take(size), records.at)
            if kind == FOOTER:
                start, _, crc = (record.number(each) for each in "QQI")
                if records.at != records.end or start not in (0, begin):
                    raise record.fail("the footer does not end the file")
                if crc and crc != zlib.crc32(self.data[begin : at + 9 + 16]):
                    raise record.fail("the checksum of the summary is another one")
                if chunks and chunks != self._chunks:
                    raise record.fail("the index lists other chunks than there are")
                if counted is not None and counted != sum(len(part[0]) for parts in self._found.values() for part in parts):
                    raise record.fail("the statistics count other messages than there are")
                return
            if kind == CHUNK_INDEX:
                record.take(16)
                chunks.append((record.number("Q"), record.number("Q")))
            elif kind == STATISTICS:
                counted = record.number("Q")
            else:
                self._define(kind, record)
        raise records.fail("the footer is missing")
