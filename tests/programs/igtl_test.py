"""palpate-openigtlink: the protocol, unpacked here byte by byte, against the recording of the run that it watches."""

import contextlib
import json
import re
import signal
import socket
import struct
import subprocess
import time

import numpy

from programs import OPENIGTLINK, PATIENCE, RUNTIME, SOURCE, ProgramTest, palpate, pictures, run

CUBE = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
TOUCH = "t,x,y,z,qw,qx,qy,qz\n0,0.5,0.5,1.3,1,0,0,0\n1,0.52,0.47,1.05,0.8,0,0.6,0\n3,0.52,0.47,1.0,0.6,0,0.8,0\n"
PRESS = "t,x,y,z\n0,0.5,0.5,1.3\n0.3,0.5,0.5,1.05\n60,0.5,0.5,1.05\n"
HEADER = struct.Struct(">H12s20sQQQ")


def crc_table():
    """CRC-64 of ECMA-182, highest bit first, from zero."""
    table = []
    for byte in range(256):
        crc = byte << 56
        for _ in range(8):
            crc = (crc << 1 ^ (0x42F0E1EBA9EA3693 if crc >> 63 else 0)) & (1 << 64) - 1
        table.append(crc)
    return table


TABLE = crc_table()


def crc64(data):
    crc = 0
    for byte in data:
        crc = TABLE[(crc >> 56) ^ byte] ^ crc << 8 & (1 << 64) - 1
    return crc


class Message:
    def __init__(self, kind, name, time, body):
        self.kind, self.name, self.time, self.body = kind, name, time, body

    def surface(self):
        """Points, triangles and values by name, of POLYDATA."""
        counts = struct.unpack(">10I", self.body[:40])
        points, vertices, lines, polygons, bytes_of_polygons, strips, attributes = (counts[k] for k in (0, 1, 3, 5, 6, 7, 9))
        assert (vertices, lines, strips) == (0, 0, 0), counts
        at = 40 + 12 * points
        nodes = numpy.frombuffer(self.body[40:at], ">f4").reshape(-1, 3)
        assert bytes_of_polygons == 16 * polygons
        cells = numpy.frombuffer(self.body[at:at + bytes_of_polygons], ">u4").reshape(-1, 4)
        assert (cells[:, 0] == 3).all()
        at += bytes_of_polygons
        sizes = [struct.unpack(">BBI", self.body[at + 6 * k:at + 6 * k + 6]) for k in range(attributes)]
        at += 6 * attributes
        names = self.body[at:].split(b"\0")[:attributes]
        at += sum(len(name) + 1 for name in names)
        at += sum(len(name) + 1 for name in names) % 2  # they end at an even place
        values = {}
        for (kind, components, count), name in zip(sizes, names):
            assert (kind, components) == (0, 1)
            values[name.decode()] = numpy.frombuffer(self.body[at:at + 4 * count], ">f4")
            at += 4 * count
        assert at == len(self.body), (at, len(self.body))
        return nodes, cells[:, 1:], values

    def pose(self):
        """Rotation and position [mm], of TRANSFORM: its columns, one after the other."""
        columns = numpy.frombuffer(self.body, ">f4").reshape(4, 3)
        return columns[:3].T, columns[3]

    def text(self):
        encoding, length = struct.unpack(">HH", self.body[:4])
        assert (encoding, length) == (3, len(self.body) - 4)  # US-ASCII
        return self.body[4:].decode("ascii")


class Client:
    """Reads one message after the other, and takes none with a wrong checksum."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=120)
        self.file = self.socket.makefile("rb")

    def close(self):
        self.file.close()
        self.socket.close()

    def next(self):
        """None at the end."""
        head = self.file.read(HEADER.size)
        if not head:
            return None
        version, kind, name, stamp, size, crc = HEADER.unpack(head)
        assert version == 1, version
        body = self.file.read(size)
        assert len(body) == size and crc64(body) == crc, (kind, size)
        return Message(kind.rstrip(b"\0").decode(), name.rstrip(b"\0").decode(), stamp / 2**32, body)

    def surfaces(self, count):
        """The next ones."""
        found = []
        while len(found) < count:
            message = self.next()
            assert message is not None, "the connection ended"
            if message.kind == "POLYDATA":
                found.append(message)
        return found


class IgtlTest(ProgramTest):
    def start(self, *command):
        """A process whose error stream is read."""
        process = subprocess.Popen(list(map(str, command)), cwd=self.folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        return process

    def told(self, process, pattern):
        """What a line of its error stream has."""
        said = ""
        while not (found := re.search(pattern, said)):
            line = process.stderr.readline()
            self.assertTrue(line, said)
            said += line
        return found[1]

    @contextlib.contextmanager
    def playing(self, *arguments, script=PRESS):
        """The run, the program that watches it, and a maker of clients, which end with it."""
        self.write("touch.csv", script)
        play = self.start(RUNTIME, "play", CUBE, "--tool", "sphere:0.1", "--overlay", "no", "--view", "--view-address", "0", *arguments)
        page = self.told(play, r"open (http\S+) in a browser")
        program = self.start(OPENIGTLINK, page, "--listen", "127.0.0.1:0")
        port = int(self.told(program, r"OpenIGTLink clients find the run at 127\.0\.0\.1, port (\d+)"))
        clients = []

        def connect():
            clients.append(Client(port))
            return clients[-1]

        try:
            yield play, program, connect
        finally:
            for client in clients:
                client.close()

    def end(self, process, status):
        """Waits for it."""
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, status)


class Messages(IgtlTest):
    def test_are_what_the_run_recorded(self):
        with self.playing("--device", "script:touch.csv", "--friction", "0.3", "--depth", "no", "--record", "out.mcap", "--duration", "3",
                          script=TOUCH) as (play, program, connect):
            client = connect()
            messages = list(iter(client.next, None))
            self.end(play, 0)
            self.end(program, 0)
        self.assertEqual({(message.kind, message.name) for message in messages},
                         {("POLYDATA", "Palpate surface"), ("TRANSFORM", "Palpate tool"), ("STRING", "Palpate force")})
        session = palpate.read(self.folder / "out.mcap")
        times, force, torque = session["time"], session["force"], session["torque"]
        orientation, position_of = session["tool_orientation"], session["tool_position"]
        shown = pictures(self.folder / "out.mcap")
        frames, rest, triangles = (shown[name] for name in ("frames/time", "surface/nodes", "surface/simplices"))
        compared = {"POLYDATA": 0, "TRANSFORM": 0, "STRING": 0}
        pressed = 0.0
        for message in messages:
            tick = int(numpy.argmin(abs(times - message.time)))
            self.assertLess(abs(times[tick] - message.time), 1e-8)
            if message.kind == "POLYDATA":
                frame = int(numpy.argmin(abs(frames - message.time)))
                if abs(frames[frame] - message.time) > 1e-8:
                    continue  # dropped by one of both
                nodes, cells, values = message.surface()
                places = numpy.empty(len(nodes), int)  # of the surface's nodes, which pages have in an order of their own
                places[triangles] = cells
                displacement = shown["frames/displacement"][frame]
                rounding = 2e-4 + 0.1 * abs(displacement).max()  # 1/10 000 of it, in millimetres
                numpy.testing.assert_allclose(nodes[places], 1000 * (rest + displacement), rtol=0, atol=rounding)
                numpy.testing.assert_array_equal(numpy.sort(places), range(len(nodes)))
                numpy.testing.assert_allclose(values["displacement [mm]"][places], 1000 * numpy.linalg.norm(displacement, axis=1), rtol=0, atol=2 * rounding)
                # The recording's pictures are computed from its contact forces, which are in single precision.
                for name, field, digits in (("von Mises stress [Pa]", "von_mises", 1 / 8192), ("contact pressure [Pa]", "pressure", 2e-6)):
                    recorded_values = shown[f"frames/{field}"][frame]
                    largest = numpy.nanmax(abs(recorded_values), initial=0)
                    numpy.testing.assert_allclose(values[name][places], recorded_values, rtol=0, atol=digits * largest)
                pressed = max(pressed, values["contact pressure [Pa]"].max())
            elif message.kind == "TRANSFORM":
                rotation, position = message.pose()
                w, x, y, z = orientation[tick]
                numpy.testing.assert_allclose(position, 1000 * position_of[tick], rtol=0, atol=2e-4)
                numpy.testing.assert_allclose(rotation @ [0, 0, 1], [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], atol=1e-6)
                numpy.testing.assert_allclose(rotation @ rotation.T, numpy.eye(3), atol=1e-6)
            else:
                told = json.loads(message.text())
                numpy.testing.assert_array_equal(numpy.float32(told["force_N"]), -numpy.float32(force[tick]))  # which is on the body
                numpy.testing.assert_array_equal(numpy.float32(told["torque_Nm"]), -numpy.float32(torque[tick]))
            compared[message.kind] += 1
        self.assertGreater(min(compared.values()), 10)
        self.assertGreater(pressed, 0)

    def test_of_a_live_body(self):
        with self.playing("--solver", "corotational", "--device", "script:touch.csv") as (play, program, connect):
            client = connect()
            for message in client.surfaces(3):
                nodes, _, _ = message.surface()
                self.assertTrue(numpy.isfinite(nodes).all())
                self.assertLess(nodes.max(), 1500)
            play.send_signal(signal.SIGTERM)
            self.end(play, 130)
            self.assertIsNone([*iter(client.next, None), None][-1])
            self.end(program, 0)


class Clients(IgtlTest):
    def test_garbage_and_those_that_hang_up_harm_nobody(self):
        query = HEADER.pack(1, b"GET_POLYDATA", b"Palpate surface", 0, 0, 0)
        huge = HEADER.pack(1, b"IMAGE", b"much", 0, 2**63, 7)
        stop = HEADER.pack(2, b"STT_POLYDATA", b"", 0, 0, 0)
        with self.playing("--device", "script:touch.csv") as (play, program, connect):
            steady = connect()
            for said in (query, stop, huge, huge[:20], query[:57], bytes(range(256)) * 400, b"GET / HTTP/1.0\r\n\r\n"):
                other = connect()
                other.socket.sendall(said)
                other.surfaces(2)
                other.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # hangs up with a reset
                other.close()
                steady.surfaces(2)
            self.assertIsNone(program.poll())
            program.send_signal(signal.SIGINT)
            self.end(program, -signal.SIGINT)
            self.assertIsNone(play.poll(), "the run goes on without it")

    def test_one_that_reads_nothing_costs_the_others_nothing(self):
        with self.playing("--device", "script:touch.csv", "--duration", "3", "--report", "report.json") as (play, _, connect):
            stalled = connect()
            readers = [connect() for _ in range(4)]
            for reader in readers:
                reader.surfaces(30)
            self.assertIsNotNone(stalled)
            self.end(play, 0)
        self.assertEqual(json.loads((self.folder / "report.json").read_text())["ticks"], 3000)

    def test_what_stands_is_sent_when_the_script_is_over(self):
        with self.playing("--device", "script:touch.csv", script=TOUCH) as (_, _, connect):
            first = connect()
            while first.next().time < 2.9:
                pass
            time.sleep(1)
            late = connect()
            surface = late.surfaces(1)[0]
            tool = late.next()
            self.assertEqual(tool.kind, "TRANSFORM")
            self.assertEqual(surface.time, tool.time)
            self.assertGreater(surface.time, 2.98)


class Refusals(IgtlTest):
    PAGE = f"http://127.0.0.1:1/?token={'0' * 32}"

    def test_of_places_to_listen_at(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            self.assert_refused(run(OPENIGTLINK, self.PAGE, "--listen", port), f"127.0.0.1:{port}: cannot listen", "Choose another port")
        self.assert_refused(run(OPENIGTLINK, self.PAGE, "--listen", "elsewhere:0"), "--listen: 'elsewhere' is not an IP address", "127.0.0.1")
        self.assert_refused(run(OPENIGTLINK, self.PAGE, "--listen", "192.0.2.1:0"), "192.0.2.1:0: cannot listen")  # of no machine

    def test_of_pages_that_are_none(self):
        def refused(page, *pieces):
            self.assert_refused(run(OPENIGTLINK, page, "--listen", "0"), *pieces)
        refused(self.PAGE, "127.0.0.1:1: cannot connect", "palpate-runtime play FILE --view")
        for page in ("127.0.0.1:8017", "http://127.0.0.1:8017/", "http://127.0.0.1:8017?token=0", "https://127.0.0.1:8017/?token=0"):
            refused(page, f"{page}: is not the address of a page", "palpate-runtime prints it")
        self.write("touch.csv", PRESS)
        play = self.start(RUNTIME, "play", CUBE, "--device", "script:touch.csv", "--view", "--view-address", "0")
        page = self.told(play, r"open (http\S+) in a browser")
        refused(page[:-32] + "0" * 32, "does not let this program watch", "whole address")

    def test_of_arguments(self):
        for arguments, piece in ((["--listen=65536"], "'65536' is not [ADDRESS:]PORT"), (["--listen=:18944"], "is not [ADDRESS:]PORT"),
                                 (["--lisen=0"], "Did you mean --listen?")):
            result = run(OPENIGTLINK, self.PAGE, *arguments)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(piece, result.stderr)
        self.assertEqual(run(OPENIGTLINK).returncode, 2)
