"""The bridge's example against a runtime in another language: the datagrams as Python's struct has them."""

import socket
import struct
import subprocess
import time
import unittest

from bridge_key import key_file, seal, write_key
from programs import BINARY, PATIENCE, ProgramTest

EXAMPLE = BINARY / "runtime" / "palpate-bridge-example"
STATE = struct.Struct("<4sHHQIIQ3d3d4f f 5f 8x")
COMMAND = struct.Struct("<4sHHQIIQIf3d3d3f6ffHHf24x")
NONCE = 0x1234567890ABCDEF
KEY = bytes(range(100, 116))
SPRING = 300.0  # of the example's hand [N/m]
MOST = 8.0  # that its device shows [N]


def command(sequence, nonce=NONCE, mode=0, force=(0, 0, 0), stiffness=(0,) * 6, max_force=0.0, key=KEY, version=2):
    """Valid for a second, then gone in a fifth; its point is 0, its radius 0.1 m."""
    return seal(key, COMMAND.pack(b"PLPC", version, 160, nonce, sequence, 0, time.monotonic_ns(), mode, 0.5, *force, 0, 0, 0,
                                  0, 0, 0, *stiffness, 0.1, 1000, 200, max_force))


class Bridge(unittest.TestCase):
    """A runtime that listens to the example at 1 kHz."""

    def setUp(self):
        self.assertEqual((STATE.size, COMMAND.size), (128, 160))
        self.runtime = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(self.runtime.close)
        self.runtime.bind(("127.0.0.1", 0))
        self.runtime.settimeout(20)
        self.port = self.runtime.getsockname()[1]
        self.key = KEY
        write_key(self.port, KEY)
        self.addCleanup(key_file(self.port).unlink)
        self.example = subprocess.Popen(
            [EXAMPLE, "--port", str(self.port), "--seconds", "100", "--from", "0,0,0.01", "--to", "0,0,0.01"],
            stdout=subprocess.PIPE, text=True)
        self.addCleanup(self.example.stdout.close)
        self.addCleanup(self.example.wait)
        self.addCleanup(self.example.kill)
        self.sequence = 0

    def hear(self):
        """Its next state: nonce, sequence, time, position, velocity and the rest."""
        datagram, self.bridge = self.runtime.recvfrom(256)
        self.assertEqual(len(datagram), STATE.size)
        self.assertEqual(datagram, seal(self.key, datagram))
        magic, version, size, nonce, sequence, flags, t, *rest = STATE.unpack(datagram)
        self.assertEqual((magic, version, size), (b"PLPS", 2, 128))
        self.assertEqual(flags, 1 << 16)
        self.assertEqual(rest[6:10], [1, 0, 0, 0])
        self.assertEqual(rest[10:], [0, MOST, 0, 2000, 20, struct.unpack("<f", struct.pack("<f", 0.15))[0]])
        return nonce, sequence, t, rest[:3], rest[3:6]

    def tell(self, **what):
        self.sequence += 1
        self.runtime.sendto(command(self.sequence, **what), self.bridge)

    def join(self):
        self.assertEqual(self.hear()[0], 0)
        self.tell()
        while (nonce := self.hear()[0]) == 0:
            pass
        self.assertEqual(nonce, NONCE)

    def rests_at(self, place, **what):
        """Waits until the hand does, told the same again and again."""
        end = time.monotonic() + 40
        while True:
            _, _, _, x, v = self.hear()
            if max(map(abs, (x[0] - place[0], x[1] - place[1], x[2] - place[2], *v))) < 1e-6:
                return
            self.assertLess(time.monotonic(), end, f"the hand is at {x}, not at {place}")
            if what:
                self.tell(**what)

    def test_numbers_and_times_go_on(self):
        self.join()
        _, sequence, t, *_ = self.hear()
        for k in range(1, 200):
            _, next_sequence, next_t, *_ = self.hear()
            self.assertEqual(next_sequence, sequence + k)
            self.assertGreater(next_t, t)
            t = next_t
        self.assertLess(abs(time.monotonic_ns() - t), 20e9)

    def test_pushed_by_a_force(self):
        self.join()
        force = (0.3, -0.6, 0.9)
        self.rests_at([f / SPRING + x for f, x in zip(force, (0, 0, 0.01))], mode=1, force=force)
        self.rests_at((0, 0, 0.01))  # nothing is said any more: the force ends by the bridge's own clock

    def test_stiffness(self):
        # 300 (0.01 - z) - 200 z = 0, x is moved along by K_zx = 50: 300 x + 50 z + 100 x = 0
        self.join()
        K = [[100, 0, 50], [0, 0, 0], [50, 0, 200]]
        a, b, d = SPRING + K[0][0], K[0][2], SPRING + K[2][2]
        x, z = -b * 3.0 / (a * d - b * b), a * 3.0 / (a * d - b * b)
        self.rests_at((x, 0, z), mode=2, stiffness=(100, 0, 200, 0, 0, 50))

    def test_no_more_than_may_be_shown(self):
        self.join()
        self.rests_at((0, 0, 0.01 + MOST / SPRING), mode=1, force=(0, 0, 100))
        self.rests_at((0, 0, 0.01 + 2 / SPRING), mode=1, force=(0, 0, 100), max_force=2)

    def test_what_it_does_not_believe(self):
        self.join()
        good = command(100, mode=1, force=(0, 0, 5))
        for bad in (good[:-1], good + b"0", b"PLPS" + good[4:], command(100, mode=1, force=(0, 0, 5), version=1), good[:-1] + bytes([good[-1] ^ 1]),
                    command(100, mode=1, force=(0, 0, 5), key=bytes(16)), command(100, nonce=NONCE + 1, key=bytes(16)),
                    command(100, nonce=NONCE + 1, mode=1, force=(0, 0, 5)), command(100, mode=3, force=(0, 0, 5)),
                    command(1, mode=1, force=(0, 0, 5)), command(2**32 - 1, mode=1, force=(0, 0, 5))):
            for _ in range(20):
                self.runtime.sendto(bad, self.bridge)
                _, _, _, x, _ = self.hear()
                self.assertLess(abs(x[2] - 0.01), 1e-9)

    def test_joins_a_runtime_that_begins_anew_with_another_key(self):
        self.join()
        self.key = bytes(range(16))
        write_key(self.port, self.key)
        while True:  # what is under way has the old one
            datagram, self.bridge = self.runtime.recvfrom(256)
            if datagram == seal(self.key, datagram):
                break
        self.tell(key=self.key, nonce=NONCE + 1)
        while self.hear()[0] != NONCE + 1:
            self.tell(key=self.key, nonce=NONCE + 1)

    def test_report(self):
        self.join()
        self.rests_at((0, 0, 0.02), mode=1, force=(0, 0, 3))
        self.example.terminate()
        last = self.example.stdout.read().splitlines()[-1]
        self.assertRegex(last, r"^rate \d+\.\d Hz, largest force 3\.000 N, late by \S+ us \(mean\), \S+ us \(most\)")
        self.assertEqual(self.example.wait(20), 0)


class Alone(ProgramTest):
    def test_says_that_no_runtime_answered(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as deaf:
            deaf.bind(("127.0.0.1", 0))
            port = deaf.getsockname()[1]
            done = subprocess.run([EXAMPLE, "--port", str(port), "--seconds", "0.5"], stdout=subprocess.PIPE, text=True, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 0)
        self.assertIn(f"no runtime answered: is one there (palpate-runtime play MODEL --device bridge), of the same user, on port {port}?",
                      done.stdout)


if __name__ == "__main__":
    unittest.main()
