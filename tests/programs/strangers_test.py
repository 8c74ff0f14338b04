"""Strangers at each port that the runtime listens at: what they send and hold open harms neither the program nor those it serves."""

import http.client
import os
import pathlib
import random
import re
import signal
import socket
import struct
import subprocess
import threading

from programs import OPENIGTLINK, PATIENCE, RUNTIME, SOURCE, ProgramTest

CUBE = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
MOST_MEMORY = 64 << 10  # [KiB] that strangers may cost
MOST_FILES = 150
UPGRADE = b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"


def something(dice):
    """What a stranger may say first: noise, half of a request, one that is too long or nonsense, another protocol."""
    noise = dice.randbytes(dice.choice((1, 57, 58, 59, 4000, 70_000)))
    path = dice.choice(("", "gallery", "items", "scene", "socket", "drop?name=a.stl", "open?name=a", "surface.vtu", "%00", "../" * 50, "?token=" + 32 * "0"))
    head = f"{dice.choice(('GET', 'POST', 'PUT', 'HEAD', 'X' * 5000))} /{path} HTTP/1.{dice.choice('012')}\r\nHost: 127.0.0.1\r\n".encode()
    return dice.choice((
        noise,
        b"",
        head[:dice.randrange(len(head))],
        head + b"\r\n",
        head + UPGRADE + noise,
        head + b"X: " + b"y" * dice.choice((8000, 300_000)),
        head + b"X: y\r\n" * 20_000,
        head + b"Content-Length: " + dice.choice((b"-1", b"9", b"99999999999999999999", b"9223372036854775807")) + b"\r\n\r\n" + noise,
        head + b"Transfer-Encoding: chunked\r\n\r\n" + dice.choice((b"FFFFFFFFFFFFFFFF\r\n", b"-1\r\n", b"5\r\nabc")) + noise,
        (head + b"\r\n") * 50,
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + noise,
        struct.pack(">H12s20sQQQ", dice.randrange(4), b"IMAGE", b"much", 0, 2**dice.randrange(64), 7) + noise,
    ))


class Crowd:
    """Connections of strangers, all of whom some are slow, some hang up, and none reads."""

    def __init__(self, ports, seed):
        self.ports, self.dice, self.held = ports, random.Random(seed), []
        self.connected = 0

    def act(self):
        """One deed of one of them."""
        if len(self.held) < 300 and (not self.held or self.dice.random() < 0.7):
            one = socket.create_connection(("127.0.0.1", self.dice.choice(self.ports)), PATIENCE, ("127.0.0.2", 0))
            one.setblocking(False)
            self.connected += 1
            self.say(one, something(self.dice))
            self.held.append(one)
            return
        one = self.held[self.dice.randrange(len(self.held))]
        if self.dice.random() < 0.5:
            self.say(one, self.dice.randbytes(1))
            return
        self.held.remove(one)
        if self.dice.random() < 0.5:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # with a reset
        one.close()

    @staticmethod
    def say(one, text):
        try:
            one.send(text)
        except OSError:
            pass  # it was cut, or what it said is not taken yet

    def leave(self):
        for one in self.held:
            one.close()
        self.held.clear()


class Watcher(threading.Thread):
    """A client of OpenIGTLink that reads all that it is sent, until that ends."""

    def __init__(self, port):
        super().__init__(daemon=True)
        with socket.create_connection(("127.0.0.1", port), PATIENCE) as connection:
            self.stream = connection.makefile("rb")
        self.messages = 0
        self.start()

    def run(self):
        with self.stream:
            while len(header := self.stream.read(58)) == 58:
                self.stream.read(struct.unpack(">Q", header[42:50])[0])
                self.messages += 1


def memory_of(process):
    """The most that it had [KiB]."""
    return int(re.search(r"VmHWM:\s+(\d+)", pathlib.Path(f"/proc/{process.pid}/status").read_text())[1])


class Strangers(ProgramTest):
    def start(self, pattern, program, *arguments):
        """The process and what it says of its port."""
        process = subprocess.Popen([program, *map(str, arguments)], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        told = b""
        while not (found := re.search(pattern, told)):
            line = process.stderr.readline()
            self.assertTrue(line, told)
            told += line
        return process, *(piece.decode() for piece in found.groups())

    def asked(self, port, path):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
        connection.request("GET", path)
        answer = connection.getresponse()
        text = answer.read()
        connection.close()
        self.assertEqual(answer.status, 200, text)
        return text

    def test_harm_nobody(self, deeds=1500, seed=1):
        self.write("touch.csv", "t,x,y,z\n0,0.5,0.5,1.3\n0.3,0.5,0.5,1.05\n80000,0.5,0.5,1.05\n")
        pattern = rb"open http://127\.0\.0\.1:(\d+)/(?:gallery)?\?token=(\w+) in a browser"
        play, page, page_token = self.start(pattern, RUNTIME, "play", CUBE, "--view", "--view-address", "0", "--device", "script:touch.csv",
                                            "--tool", "sphere:0.1")
        sends, igtl = self.start(rb"OpenIGTLink clients find the run at 127\.0\.0\.1, port (\d+)", OPENIGTLINK,
                                 f"http://127.0.0.1:{page}/?token={page_token}", "--listen", "0")
        folder = self.folder / "shown"
        folder.mkdir()
        (folder / "cube.palpate.hdf").write_bytes(CUBE.read_bytes())
        view, gallery, gallery_token = self.start(pattern, RUNTIME, "view", folder, "--view-address", "0")
        watcher = Watcher(igtl)
        self.asked(page, f"/?token={page_token}")
        self.asked(gallery, f"/scene?token={gallery_token}&name=cube.palpate.hdf")
        before = {one: memory_of(one) for one in (play, sends, view)}
        crowd = Crowd((page, gallery, igtl), seed)
        self.addCleanup(crowd.leave)
        for deed in range(deeds):
            crowd.act()
            if deed % 100 == 0:
                seen = watcher.messages
                self.wait_for(lambda seen=seen: watcher.messages > seen or not watcher.is_alive())
                self.assertTrue(watcher.is_alive(), "it was cut")
                self.asked(page, f"/?token={page_token}")
                self.assertIn(b"cube.palpate.hdf", self.asked(gallery, f"/items?token={gallery_token}"))
                with socket.create_connection(("127.0.0.1", igtl), PATIENCE) as late:
                    self.assertNotEqual(late.recv(1), b"", "there is room for one more")
        for process, memory in before.items():
            self.assertIsNone(process.poll(), f"seed {seed}")
            self.assertLess(memory_of(process) - memory, MOST_MEMORY)
            self.assertLess(len(os.listdir(f"/proc/{process.pid}/fd")), MOST_FILES)
        self.assertEqual(os.listdir(folder), ["cube.palpate.hdf"])
        for process in (play, view):
            process.send_signal(signal.SIGTERM)
        self.assertEqual([process.wait(PATIENCE) for process in (play, view, sends)], [130, 0, 0])
