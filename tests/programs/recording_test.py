"""Recordings by a second route: other people's packages (@mcap/core, @foxglove) read what play wrote, by the index and record by
record, and each number is what palpate.read and `session --json` say. And what palpate.read makes of files that are damaged."""

import json
import math
import os
import random
import signal
import subprocess
import unittest
import zlib

import numpy

from programs import BINARY, RUNTIME, SOURCE, ProgramTest, palpate, records_of, run

from palpate.cdr import BadMessage, Layout  # by way of programs
from palpate.files import Messages
from palpate.mcap import McapFile

MODULES = BINARY / "tests" / "recordings"
NODE = os.environ.get("PALPATE_NODE", "node")
BODIES = SOURCE / "tests" / "golden"
TOUCH = "t,x,y,z,grab\n0,0.4,0.5,1.3,0\n0.1,0.4,0.5,1.05,0\n0.4,0.6,0.5,1.05,1\n0.5,0.6,0.5,1.3,1\n"


def told_by_others(file, *mode):
    """What reading.mjs finds: the first lines about the file, metadata by name, and messages by topic."""
    result = run(NODE, MODULES / "reading.mjs", file, *mode)
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    about, metadata, messages = {}, {}, {}
    for line in result.stdout.splitlines():
        record = json.loads(line)
        if "topic" in record:
            messages.setdefault(record["topic"], []).append(record)
        elif "metadata" in record:
            metadata[record["metadata"]] = record["values"]
        else:
            about.update(record)
    return about, metadata, messages


def is_same(ours, theirs):
    """Whether two readers found one message; numbers to the last bit, and JSON has texts in the place of what is not finite."""
    if isinstance(ours, numpy.void):
        ours = {name: ours[name] for name in ours.dtype.names}
    if isinstance(ours, dict):
        return isinstance(theirs, dict) and set(ours) == set(theirs) and all(is_same(ours[name], theirs[name]) for name in ours)
    if isinstance(ours, (list, numpy.ndarray)):
        return len(ours) == len(theirs) and all(map(is_same, ours, theirs))
    if isinstance(theirs, str) and not isinstance(ours, str):
        return math.isnan(ours) if theirs == "NaN" else float(ours) == float(theirs.replace("Infinity", "inf"))
    return ours == theirs


class SecondRoute(ProgramTest):
    def record(self, body, *arguments, name="touch.mcap"):
        self.write("touch.csv", TOUCH)
        result = run(RUNTIME, "play", BODIES / body / f"{body}.palpate.hdf", "--device", "script:touch.csv", "--tool", "sphere:0.15", "--fast",
                     "--record", name, "--force", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.folder / name

    def compare(self, file, messages):
        """Each message by both readers, and the columns of the ticks; returns the ticks as others have them."""
        recording = palpate.read(file)
        self.assertEqual(set(messages), {topic for topic in recording.topics if len(recording.messages(topic))})
        for topic, theirs in messages.items():
            ours = recording.messages(topic)
            self.assertEqual(len(ours), len(theirs), topic)
            numpy.testing.assert_array_equal(numpy.rint(ours.times * 1e9), [record["time"] for record in theirs])
            for k, record in enumerate(theirs):
                self.assertTrue(is_same(ours[k], record["message"]), (topic, k))
                self.assertEqual((record["sequence"], record["published"]), (k, record["time"]), topic)
        ticks = [record["message"] for record in messages.get("/tool/0/tick", [])]
        for name in recording:
            values = recording[name]
            self.assertEqual(len(values), len(ticks), name)
            for k, tick in enumerate(ticks):
                self.assertTrue(is_same(values[k], self.by_name(tick, name)), (name, k))
        return recording, ticks

    @staticmethod
    def by_name(tick, name):
        """A number of a message by the name of a dataset."""
        if name in tick and not isinstance(tick[name], dict):
            return tick[name]
        if name in ("force", "torque"):
            name = "wrench_" + name
        part = tick.get(name)
        if part is None:
            outer, inner = name.split("_", 1)
            part = tick[outer][inner]
        return [part[axis] for axis in ("wxyz" if "w" in part else "xyz")]

    def test_by_the_index(self):
        for body, options, shows in (("cube2", (), "/contacts"), ("cube2", ("--overlay", "r=2,rings=1"), "/pictures"),
                                     ("plate2", (), "/contacts")):
            file = self.record(body, *options) if body == "cube2" else self.record_plane()
            about, metadata, messages = told_by_others(file)
            recording, ticks = self.compare(file, messages)
            self.assertEqual(about["profile"], "ros2")
            self.assertRegex(about["library"], "^palpate ")
            self.assertEqual(metadata["palpate"], recording.info)
            counted = about["statistics"]
            self.assertEqual(counted["messageCount"], sum(map(len, messages.values())))
            self.assertEqual((counted["messageStartTime"], counted["chunkCount"]), (0, about["chunks"]))
            self.assertEqual(sorted(counted["channelMessageCounts"].values()), sorted(map(len, messages.values())))
            self.assertGreater(len(messages[shows]), 10)
            self.assertTrue(recording.finished)
            self.check_session(file, ticks)
            as_it_is, _, again = told_by_others(file, "--as-it-is")
            self.assertTrue(as_it_is["done"])
            for topic, records in messages.items():
                self.assertEqual(again[topic], records)

    def record_plane(self):
        self.write("plane.csv", "t,x,y,z\n0,0.5,1.3,0\n0.2,0.5,1.05,0\n")
        result = run(RUNTIME, "play", BODIES / "plate2" / "plate2.palpate.hdf", "--device", "script:plane.csv", "--tool", "sphere:0.1", "--fast",
                     "--record", "plane.mcap", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.folder / "plane.mcap"

    def check_session(self, file, ticks):
        """What `session` says follows from the ticks as others read them."""
        told = json.loads(run(RUNTIME, "session", file, "--json").stdout)
        forces = [math.hypot(*(tick["wrench"]["force"][axis] for axis in "xyz")) for tick in ticks]
        self.assertEqual(told["ticks"], len(ticks))
        self.assertEqual(told["ticks_in_contact"], sum(tick["contacts"] > 0 for tick in ticks))
        self.assertAlmostEqual(told["largest_force_N"], max(forces), delta=1e-12 * max(forces))
        self.assertEqual(told["largest_force_time_s"], ticks[int(numpy.argmax(forces))]["time"])
        return told

    def test_killed_ones_record_by_record(self):
        self.write("long.csv", "t,x,y,z\n0,0.5,0.5,1.3\n600,0.5,0.5,1.0\n")
        file = self.folder / "killed.mcap"
        process = subprocess.Popen([RUNTIME, "play", BODIES / "cube2" / "cube2.palpate.hdf", "--device", "script:long.csv", "--record", file,
                                    "--tool", "sphere:0.15"], cwd=self.folder, stderr=subprocess.DEVNULL)
        self.wait_for(lambda: file.exists() and file.stat().st_size > 400_000, process)
        process.send_signal(signal.SIGKILL)
        process.wait()
        whole = file.read_bytes()
        chance = random.Random(2)
        for cut in (len(whole), *(chance.randrange(len(whole) - 230_000, len(whole)) for _ in range(5))):
            file.write_bytes(whole[:cut])
            as_it_is, _, messages = told_by_others(file, "--as-it-is")
            self.assertFalse(as_it_is["done"])
            recording, ticks = self.compare(file, messages)
            self.assertFalse(recording.finished)
            self.check_session(file, ticks)
        result = run(RUNTIME, "session", file, "--finish")
        self.assertEqual(result.returncode, 0, result.stderr)
        _, _, finished = told_by_others(file)
        self.assertEqual(finished["/tool/0/tick"], messages["/tool/0/tick"])
        self.assertTrue(palpate.read(file).finished)


class Reader(ProgramTest):
    """palpate.read by itself."""

    def foreign(self, *options):
        file = self.folder / "foreign.mcap"
        result = run(NODE, MODULES / "writing.mjs", file, *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return file

    def test_schemas_of_others(self):
        for options in ((), ("--no-indexes",), ("--no-chunks",)):
            file = self.foreign(*options)
            _, _, messages = told_by_others(file, "--as-it-is")
            read = McapFile(file)
            self.assertEqual(read.metadata, {"palpate": {"a": "b", "c": "ä"}})
            for topic, theirs in messages.items():
                ours = Messages(read, topic)
                self.assertEqual(len(ours), len(theirs))
                for one, record in zip(ours, theirs):
                    self.assertTrue(is_same(one, record["message"]), (options, topic))
            fixed = Messages(read, "/test_msgs/msg/Fixed")
            for name, (at, kind) in fixed.columns().items():
                theirs = [record["message"][name] for record in messages[fixed.topic]]
                if name == "place":
                    theirs = [[place[axis] for axis in "xyz"] for place in theirs]
                self.assertTrue(is_same(fixed.column(at, kind), theirs), name)
            with self.assertRaisesRegex(palpate.Error, "vary in size"):
                Messages(read, "/test_msgs/msg/Varying").columns()
        with self.assertRaisesRegex(palpate.Error, "not of Palpate"):
            palpate.read(file)

    def read_all(self, file):
        read = McapFile(file)
        for topic in read.channels:
            for _ in Messages(read, topic):
                pass

    def test_each_changed_byte_is_told_or_harmless(self):
        """A checksum covers each message: where a change is not told, all messages are as before, or the end is missing."""
        whole = self.foreign().read_bytes()
        read = McapFile(self.folder / "foreign.mcap")
        before = {topic: [repr(one) for one in Messages(read, topic)] for topic in read.channels}
        chance = random.Random(3)
        file = self.folder / "damaged.mcap"
        told = 0
        for _ in range(500):
            data = bytearray(whole)
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
            file.write_bytes(data)
            try:
                read = McapFile(file)
                after = {topic: [repr(one) for one in Messages(read, topic)] for topic in read.channels}
            except palpate.Error as reason:
                self.assertIn("damaged.mcap", str(reason))
                told += 1
                continue
            for topic, messages in after.items():
                if topic in before and read.finished:
                    self.assertEqual(messages, before[topic])
        self.assertGreater(told, 350)

    def test_each_cut_opens_with_what_is_whole(self):
        whole = self.foreign().read_bytes()
        read = McapFile(self.folder / "foreign.mcap")
        before = {topic: [repr(one) for one in Messages(read, topic)] for topic in read.channels}
        file = self.folder / "cut.mcap"
        counts = set()
        for cut in range(len(whole) - 1, 8, -97):
            file.write_bytes(whole[:cut])
            read = McapFile(file)
            self.assertFalse(read.finished)
            for topic in read.channels:
                messages = [repr(one) for one in Messages(read, topic)]
                self.assertEqual(messages, before[topic][: len(messages)])
                counts.add(len(messages))
        self.assertGreater(len(counts), 10)

    def test_lengths_that_lie(self):
        """Each length of each record as something huge: an error, quickly, and without taking memory."""
        whole = self.foreign().read_bytes()
        file = self.folder / "lying.mcap"
        for at, kind, begin, end in list(records_of(whole)):
            places = [(at + 1, 8)] + [(begin + k, 4) for k in range(0, min(end - begin - 4, 44), 4)]
            for place, width in places:
                for number in (2**31 - 1, 2**64 - 1):
                    data = bytearray(whole)
                    data[place : place + width] = (number & (2 ** (8 * width) - 1)).to_bytes(width, "little")
                    file.write_bytes(data)
                    try:
                        self.read_all(file)
                    except palpate.Error:
                        pass

    def test_messages_that_lie(self):
        """Lengths within messages, under checksums that are right."""
        whole = self.foreign().read_bytes()
        file = self.folder / "lying.mcap"
        chance = random.Random(5)
        told = 0
        chunks = [(begin, end) for _, kind, begin, end in records_of(whole) if kind == 6]
        for _ in range(250):
            data = bytearray(whole)
            begin, end = chance.choice(chunks)
            place = chance.randrange(begin + 40, end - 4)
            data[place : place + 4] = chance.choice((2**32 - 1, 2**31, 2**16, 9)).to_bytes(4, "little")
            data[begin + 24 : begin + 28] = zlib.crc32(data[begin + 40 : end]).to_bytes(4, "little")
            file.write_bytes(data)
            try:
                self.read_all(file)
            except palpate.Error:
                told += 1
        self.assertGreater(told, 40)

    def test_no_recordings(self):
        for name, content in (("empty.mcap", b""), ("text.mcap", b"notes\n"), ("old.h5", b"\x89HDF\r\n\x1a\n" + bytes(100)),
                              ("magic.mcap", b"\x89MCAP0\r\n"), ("both.mcap", b"\x89MCAP0\r\n" * 2)):
            (self.folder / name).write_bytes(content)
            with self.assertRaisesRegex(palpate.Error, name) as told:
                palpate.read(self.folder / name)
            self.assertTrue(told.exception.hint)
        with self.assertRaisesRegex(palpate.Error, "none.mcap"):
            palpate.read(self.folder / "none.mcap")

    def test_schemas_that_lie(self):
        """A schema that holds itself, one that grows without end, and one of a line that is none."""
        line = "=" * 80 + "\n"
        many = "".join(f"{line}MSG: t/T{k}\nT{k + 1} a\nT{k + 1} b\n" for k in range(18)) + f"{line}MSG: t/T18\nuint8 x\n"
        Layout("t/msg/M", "T0 a\n" + many)  # 2^18 bytes
        for text in ("M again\n", "T a\n" + line + "MSG: t/T\nM a\n", "Unknown a\n", "float64[1000000000000] a\n", "float64[0] a\n", "float64\n",
                     "uint8 a\nuint8 a\n", "T0[1000000] a\n" + many.replace("uint8 x", "uint8[1000000] x"), "uint8 a\n" + line + "MGS: t/T\n"):
            with self.assertRaises(BadMessage, msg=text[:40]):
                Layout("t/msg/M", text)


if __name__ == "__main__":
    unittest.main()
