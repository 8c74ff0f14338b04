"""The bridge's example against a runtime in another language: the messages as Python's struct has them."""

import pathlib
import socket
import struct
import subprocess
import tempfile
import time
import unittest

from programs import BINARY, PATIENCE, ProgramTest

EXAMPLE = BINARY / "runtime" / "palpate-bridge-example"
STATE = struct.Struct("<4sIIIQ3d3d4ff5f")
COMMAND = struct.Struct("<4sIIIQ3d3d3f6ffffHHI")
SPRING = 300.0  # of the example's hand [N/m]
MOST = 8.0  # that its device shows [N]


def command(mode=0, force=(0, 0, 0), stiffness=(0,) * 6, max_force=0.0, version=3):
    """Valid for a second, then gone in a fifth; its point is 0, its radius 0.1 m."""
    return COMMAND.pack(b"PLPC", version, 0, mode, time.monotonic_ns(), *force, 0, 0, 0, 0, 0, 0, *stiffness, 0.5, 0.1, max_force, 1000, 200, 0)


class Bridge(unittest.TestCase):
    """A runtime that listens to the example at 1 kHz."""

    def setUp(self):
        self.assertEqual((STATE.size, COMMAND.size), (112, 128))
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.name = pathlib.Path(folder.name) / "bridge.socket"
        self.listen()
        self.example = subprocess.Popen(
            [EXAMPLE, "--socket", self.name, "--seconds", "100", "--from", "0,0,0.01", "--to", "0,0,0.01"],
            stdout=subprocess.PIPE, text=True)
        self.addCleanup(self.example.stdout.close)
        self.addCleanup(self.example.wait)
        self.addCleanup(self.example.kill)
        self.accept()

    def listen(self):
        self.runtime = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.addCleanup(self.runtime.close)
        self.runtime.settimeout(PATIENCE)
        self.runtime.bind(str(self.name))
        self.runtime.listen(1)

    def accept(self):
        self.bridge, _ = self.runtime.accept()
        self.addCleanup(self.bridge.close)
        self.bridge.settimeout(PATIENCE)

    def hear(self):
        """Its next state: sequence, time, position, velocity."""
        message = self.bridge.recv(256)
        self.assertEqual(len(message), STATE.size)
        magic, version, sequence, flags, t, *rest = STATE.unpack(message)
        self.assertEqual((magic, version), (b"PLPS", 3))
        self.assertEqual(flags, 1 << 16)
        self.assertEqual(rest[6:10], [1, 0, 0, 0])
        self.assertEqual(rest[10:], [0, MOST, 0, 2000, 20, struct.unpack("<f", struct.pack("<f", 0.15))[0]])
        return sequence, t, rest[:3], rest[3:6]

    def tell(self, **what):
        self.bridge.send(command(**what))

    def rests_at(self, place, **what):
        """Waits until the hand does, told the same again and again."""
        end = time.monotonic() + 40
        while True:
            _, _, x, v = self.hear()
            if max(map(abs, (x[0] - place[0], x[1] - place[1], x[2] - place[2], *v))) < 1e-6:
                return
            self.assertLess(time.monotonic(), end, f"the hand is at {x}, not at {place}")
            if what:
                self.tell(**what)

    def test_numbers_and_times_go_on(self):
        sequence, t, *_ = self.hear()
        for k in range(1, 200):
            next_sequence, next_t, *_ = self.hear()
            self.assertGreater(next_sequence, sequence)  # what we are too slow for is left out
            self.assertGreater(next_t, t)
            sequence, t = next_sequence, next_t
        self.assertLess(abs(time.monotonic_ns() - t), PATIENCE * 1e9)

    def test_pushed_by_a_force(self):
        force = (0.3, -0.6, 0.9)
        self.rests_at([f / SPRING + x for f, x in zip(force, (0, 0, 0.01))], mode=1, force=force)
        self.rests_at((0, 0, 0.01))  # nothing is said any more: the force ends by the bridge's own clock

    def test_stiffness(self):
        # 300 (0.01 - z) - 200 z = 0, x is moved along by K_zx = 50: 300 x + 50 z + 100 x = 0
        K = [[100, 0, 50], [0, 0, 0], [50, 0, 200]]
        a, b, d = SPRING + K[0][0], K[0][2], SPRING + K[2][2]
        x, z = -b * 3.0 / (a * d - b * b), a * 3.0 / (a * d - b * b)
        self.rests_at((x, 0, z), mode=2, stiffness=(100, 0, 200, 0, 0, 50))

    def test_no_more_than_may_be_shown(self):
        self.rests_at((0, 0, 0.01 + MOST / SPRING), mode=1, force=(0, 0, 100))
        self.rests_at((0, 0, 0.01 + 2 / SPRING), mode=1, force=(0, 0, 100), max_force=2)

    def test_what_it_does_not_believe(self):
        good = command(mode=1, force=(0, 0, 5))
        for bad in (good[:-1], good + b"0", b"PLPS" + good[4:], command(mode=1, force=(0, 0, 5), version=2), command(mode=3, force=(0, 0, 5))):
            for _ in range(20):
                self.bridge.send(bad)
                _, _, x, _ = self.hear()
                self.assertLess(abs(x[2] - 0.01), 1e-9)

    def test_joins_a_runtime_that_begins_anew(self):
        self.rests_at((0, 0, 0.02), mode=1, force=(0, 0, 3))
        self.bridge.close()
        self.runtime.close()
        self.name.unlink()
        self.listen()
        self.accept()
        self.rests_at((0, 0, 0.01))  # the last force of the one that went has ended
        self.rests_at((0, 0, 0.02), mode=1, force=(0, 0, 3))

    def test_report(self):
        self.rests_at((0, 0, 0.02), mode=1, force=(0, 0, 3))
        self.example.terminate()
        last = self.example.stdout.read().splitlines()[-1]
        self.assertRegex(last, r"^rate \d+\.\d Hz, largest force 3\.000 N, late by \S+ us \(mean\), \S+ us \(most\)")
        self.assertEqual(self.example.wait(20), 0)


class Alone(ProgramTest):
    def test_says_that_no_runtime_answered(self):
        name = self.folder / "bridge.socket"
        done = subprocess.run([EXAMPLE, "--socket", name, "--seconds", "0.5"], stdout=subprocess.PIPE, text=True, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 0)
        self.assertIn(f"no runtime answered: is one there (palpate-runtime play MODEL --device bridge), of the same user, at {name}?", done.stdout)

    def test_a_name_that_is_too_long(self):
        done = subprocess.run([EXAMPLE, "--socket", "x" * 108], stderr=subprocess.PIPE, text=True, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("too long", done.stderr)


if __name__ == "__main__":
    unittest.main()
