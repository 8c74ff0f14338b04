"""Kinds of scripts/fuzz-programs: model files whose index or HDF5 metadata is damaged, and recordings, with checksums that are right again, so that
what is behind them is met."""

import ctypes
import functools
import os
import pathlib
import signal
import struct
import subprocess
import tempfile
import time
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(os.environ.get("PALPATE_BINARY_DIR", ROOT / "build" / "release"))
PRECOMPUTE = BUILD / "precompute" / "palpate-precompute"
RUNTIME = BUILD / "runtime" / "palpate-runtime"

MODEL = """name = "cube"
[geometry]
box = {origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2]}
[mesh]
element = "tet4"
[material]
youngs_modulus = 1e3
poissons_ratio = 0.3
density = 1000
[[fixed]]
half_space = {point = [0, 0, 0], normal = [0, 0, -1]}
[storage]
scope = "full"
precision = "double"
[overlay]
refinement = 2
rings = 1
[[overlay.region]]
sphere = {center = [0.5, 0.5, 1], radius = 0.1}
[dynamics]
method = "modal"
time_step = 0.001
modes = 3
"""
SCRIPT = "t,x,y,z\n0,0.5,0.5,1.3\n%s,0.5,0.5,1.05\n"
TOOL = ["--tool", "sphere:0.2"]
NUMBERS = [0, 1, 2, 3, 4, 7, 8, 16, 127, 128, 255, 256, 512, 4096, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 32, 1 << 40,
           (1 << 63) - 1, 1 << 63, (1 << 64) - 1]


def lookup3(data):
    """Bob Jenkins' hash as HDF5 1.10 has it in each piece of metadata."""
    size = len(data)
    a = b = c = (0xDEADBEEF + size) & 0xFFFFFFFF
    if size == 0:
        return c
    padded = bytes(data) + bytes(-size % 12)
    words = struct.unpack(f"<{len(padded) // 4}I", padded)
    for i in range(0, len(words) - 3, 3):
        a, b, c = a + words[i] & 0xFFFFFFFF, b + words[i + 1] & 0xFFFFFFFF, c + words[i + 2] & 0xFFFFFFFF
        a = (a - c & 0xFFFFFFFF) ^ (c << 4 & 0xFFFFFFFF | c >> 28)
        c = c + b & 0xFFFFFFFF
        b = (b - a & 0xFFFFFFFF) ^ (a << 6 & 0xFFFFFFFF | a >> 26)
        a = a + c & 0xFFFFFFFF
        c = (c - b & 0xFFFFFFFF) ^ (b << 8 & 0xFFFFFFFF | b >> 24)
        b = b + a & 0xFFFFFFFF
        a = (a - c & 0xFFFFFFFF) ^ (c << 16 & 0xFFFFFFFF | c >> 16)
        c = c + b & 0xFFFFFFFF
        b = (b - a & 0xFFFFFFFF) ^ (a << 19 & 0xFFFFFFFF | a >> 13)
        a = a + c & 0xFFFFFFFF
        c = (c - b & 0xFFFFFFFF) ^ (b << 4 & 0xFFFFFFFF | b >> 28)
        b = b + a & 0xFFFFFFFF
    a, b, c = a + words[-3] & 0xFFFFFFFF, b + words[-2] & 0xFFFFFFFF, c + words[-1] & 0xFFFFFFFF

    def mixed(x, y, turn):
        return ((x ^ y) - (y << turn & 0xFFFFFFFF | y >> (32 - turn))) & 0xFFFFFFFF

    c = mixed(c, b, 14)
    a = mixed(a, c, 11)
    b = mixed(b, a, 25)
    c = mixed(c, b, 16)
    a = mixed(a, c, 4)
    b = mixed(b, a, 14)
    return mixed(c, b, 24)


class Piece:
    """Bytes [at, end) of metadata; the checksum of all of them, with zeros in its own place where that is among them, is at `sum_at`."""

    def __init__(self, at, end, sum_at, messages=()):
        self.at, self.end, self.sum_at, self.messages = at, end, sum_at, messages

    def checksum(self, data):
        piece = bytearray(data[self.at : self.end])
        if self.sum_at < self.end:
            piece[self.sum_at - self.at : self.sum_at - self.at + 4] = bytes(4)
        return lookup3(piece)

    def seal(self, data):
        struct.pack_into("<I", data, self.sum_at, self.checksum(data))


def is_sealed(data, piece):
    return piece.sum_at + 4 <= len(data) and struct.unpack_from("<I", data, piece.sum_at)[0] == piece.checksum(data)


def messages_of(data, at, end, ordered):
    """Where the messages of an object header of version 2 begin."""
    found = []
    head = 6 if ordered else 4
    while at + head <= end:
        found.append(at)
        at += head + struct.unpack_from("<H", data, at + 1)[0]
    return found


def pieces_of(data):
    """The pieces of metadata of a file as palpate writes them."""
    pieces = [Piece(0, 44, 44)]
    chunks = []  # continuations of object headers
    at = data.find(b"OHDR")
    while at >= 0:
        flags = data[at + 5]
        body = at + 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        end = body + width + int.from_bytes(data[body : body + width], "little")
        piece = Piece(at, end, end, messages_of(data, body + width, end, flags & 4))
        if is_sealed(data, piece):
            pieces.append(piece)
            chunks += [(message, flags & 4) for message in piece.messages if data[message] == 0x10]
        at = data.find(b"OHDR", at + 4)
    for message, ordered in chunks:
        begin, size = struct.unpack_from("<QQ", data, message + (6 if ordered else 4))
        pieces.append(Piece(begin, begin + size - 4, begin + size - 4, messages_of(data, begin + 4, begin + size - 4, ordered)))
    for signature in (b"FRHP", b"BTHD", b"BTLF", b"BTIN", b"FHIB", b"FSHD", b"FSSE", b"SMTB"):
        at = data.find(signature)
        while at >= 0:
            for end in range(at + 8, min(at + 600, len(data) - 4)):
                piece = Piece(at, end, end)
                if is_sealed(data, piece):
                    pieces.append(piece)
                    break
            at = data.find(signature, at + 4)
    at = data.find(b"FHDB")
    while at >= 0:
        for size in (512, 1024, 2048, 4096):
            for sum_at in range(at + 14, at + 22):
                piece = Piece(at, at + size, sum_at)
                if at + size <= len(data) and is_sealed(data, piece):
                    pieces.append(piece)
        at = data.find(b"FHDB", at + 4)
    assert all(is_sealed(data, piece) for piece in pieces)
    return pieces


@functools.lru_cache(maxsize=None)
def cached_pieces(data):
    return pieces_of(data)


INDEX = 32768  # bytes of a file before its HDF5


class Hash128(ctypes.Structure):
    _fields_ = [("low", ctypes.c_uint64), ("high", ctypes.c_uint64)]


def xxh3(data):
    function = ctypes.CDLL("libxxhash.so.0").XXH3_128bits
    function.restype, function.argtypes = Hash128, [ctypes.c_char_p, ctypes.c_size_t]
    found = function(data, len(data))
    return f"{found.high:016x}{found.low:016x}".encode()


def damage_index(rng, whole):
    """docs/file-format.md says what stands where."""
    data = bytearray(whole)
    length = struct.unpack_from("<Q", data, 16)[0]
    for _ in range(rng.choice([1, 1, 2, 3])):
        at = rng.randrange(56, length)
        if rng.randrange(3) == 0:
            data[at] ^= 1 << rng.randrange(8)
        else:
            at -= (at - 56) % rng.choice([1, 4, 8])
            number = rng.choice(NUMBERS) if rng.randrange(3) else int.from_bytes(data[at : at + 8], "little") + rng.choice([-1, 1, 8, -8, 64])
            data[at : at + 8] = (number % (1 << 64)).to_bytes(8, "little")
    if rng.randrange(20) == 0:
        struct.pack_into("<Q", data, 16, rng.choice(NUMBERS))
    length = min(struct.unpack_from("<Q", data, 16)[0], INDEX)
    data[24:56] = xxh3(bytes(data[56:length]))
    return bytes(data)


def damage_metadata(rng, whole):
    index, whole = whole[:INDEX], whole[INDEX:]
    pieces = cached_pieces(whole)
    data = bytearray(whole)
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        piece = rng.choice(pieces)
        begin = piece.at + (4 if rng.randrange(20) else 0)
        if piece.messages and rng.randrange(2):
            begin = rng.choice(piece.messages)
            at = begin + rng.choice([0, 1, 2, 3, *range(4, 24)])
        else:
            at = rng.randrange(begin, piece.end)
        at = min(at, piece.end - 1)
        choice = rng.randrange(5)
        if choice == 0:
            data[at] ^= 1 << rng.randrange(8)
        elif choice == 1:
            data[at] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
        elif choice == 2:
            other = rng.choice(pieces)
            source = rng.randrange(other.at, other.end)
            count = min(rng.choice([1, 2, 4, 8, 16, 32]), piece.end - at, other.end - source)
            data[at : at + count] = data[source : source + count]
        else:
            size = rng.choice([1, 2, 4, 8])
            number = rng.choice(NUMBERS) if rng.randrange(3) else int.from_bytes(data[at : at + size], "little") + rng.choice([-1, 1, 8, -8, 64])
            number %= 1 << 8 * size
            data[at : min(at + size, piece.end)] = number.to_bytes(size, "little")[: piece.end - at]
        if rng.randrange(20):
            piece.seal(data)
    return index + bytes(data)


def say(*command, cwd):
    subprocess.run([str(part) for part in command], cwd=cwd, check=True, capture_output=True)


@functools.lru_cache(maxsize=None)
def whole_files():
    """Bytes of a model, of a recording, and of one that was killed."""
    with tempfile.TemporaryDirectory(prefix="palpate-fuzz-") as scratch:
        folder = pathlib.Path(scratch)
        (folder / "model.toml").write_text(MODEL)
        (folder / "touch.csv").write_text(SCRIPT % "0.2")
        say(PRECOMPUTE, "model.toml", "-o", "cube.palpate.hdf", cwd=folder)
        touch = [RUNTIME, "play", "cube.palpate.hdf", *TOOL, "--device", "script:touch.csv"]
        say(*touch, "--overlay", "r=2,rings=1", "--fast", "--record", "touch.mcap", cwd=folder)
        (folder / "touch.csv").write_text(SCRIPT % "1000")
        process = subprocess.Popen([*touch, "--record", "killed.mcap"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        killed = folder / "killed.mcap"
        while process.poll() is None and (not killed.exists() or killed.stat().st_size < 1_000_000):
            time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
        process.wait()
        read = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    return read


class Kind:
    """Damages one of some files and runs one of some commands."""

    def seeds(self):
        return self.files()

    def damage(self, rng, seed):
        return seed, rng.choice([damage_index, damage_metadata])(rng, whole_files()[seed])

    def write(self, folder, rng, data):
        damaged, data = data
        for name, whole in whole_files().items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(data if name == damaged else whole)
        (folder / "touch.csv").write_text(SCRIPT % "0.02")
        (folder / "command").write_text(str(rng.randrange(1000)))

    def command(self, folder):
        commands = self.commands()
        return commands[int((folder / "command").read_text()) % len(commands)]


class Model(Kind):
    @staticmethod
    def files():
        return ["cube.palpate.hdf"]

    @staticmethod
    def commands():
        return [[PRECOMPUTE, "inspect", "cube.palpate.hdf"], [PRECOMPUTE, "verify", "cube.palpate.hdf"], [PRECOMPUTE, "index", "cube.palpate.hdf"],
                [RUNTIME, "probe", "cube.palpate.hdf", "--at", "0.5,0.5,1", "--displace", "0,0,-0.1"],
                [RUNTIME, "play", "cube.palpate.hdf", *TOOL, "--device", "script:touch.csv", "--fast", "--report", "report.json"]]


def seal_chunks(data):
    """Makes the CRC of each chunk of an MCAP file right again."""
    at = 8
    while at + 9 <= len(data):
        size = struct.unpack_from("<Q", data, at + 1)[0]
        if size > len(data) - at - 9:
            return
        if data[at] == 6 and size >= 40:
            struct.pack_into("<I", data, at + 9 + 24, zlib.crc32(data[at + 49:at + 9 + size]))
        at += 9 + size


class Recording(Kind):
    @staticmethod
    def files():
        return ["touch.mcap", "killed.mcap"]

    def damage(self, rng, seed):
        data = bytearray(whole_files()[seed])
        for _ in range(rng.randrange(1, 5)):
            at = rng.randrange(len(data) - 8)
            if rng.random() < 0.5:
                data[at] ^= 1 << rng.randrange(8)
            elif rng.random() < 0.7:
                size = rng.choice([1, 2, 4, 8])
                data[at:at + size] = (rng.choice(NUMBERS) % (1 << 8 * size)).to_bytes(size, "little")
            else:
                del data[at:at + rng.randrange(64)]
        if rng.random() < 0.7:
            seal_chunks(data)
        return seed, bytes(data)

    def write(self, folder, rng, data):
        super().write(folder, rng, data)
        (folder / "which").write_text(data[0])

    def command(self, folder):
        which = (folder / "which").read_text()
        return [part.replace("WHICH", which) if isinstance(part, str) else part for part in super().command(folder)]

    @staticmethod
    def commands():
        return [[RUNTIME, "session", "WHICH"], [RUNTIME, "session", "WHICH", "--json", "--finish"], [RUNTIME, "export", "WHICH", "--html", "page.html"],
                [RUNTIME, "play", "cube.palpate.hdf", "--device", "replay:WHICH", "--fast", "--report", "report.json"]]


KINDS = {"hdf5-model": Model(), "recording": Recording()}
