"""Runs the two programs for the end-to-end tests."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

import h5py
import numpy

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
BINARY = pathlib.Path(os.environ["PALPATE_BINARY_DIR"])
PRECOMPUTE = BINARY / "precompute" / "palpate-precompute"
RUNTIME = BINARY / "runtime" / "palpate-runtime"
OPENIGTLINK = BINARY / "runtime" / "palpate-openigtlink"
MODELS = SOURCE / "meshes" / "models"
PATIENCE = 900  # [s] with what never comes; how long a thing takes is no test's
os.environ["PATH"] = os.pathsep.join([str(PRECOMPUTE.parent), str(RUNTIME.parent), os.environ["PATH"]])
sys.path.insert(0, str(SOURCE / "runtime" / "python"))

import palpate  # noqa: E402

# They must be in a process from its beginning, and neither Debian's Python nor mono has them.
HAS_SANITIZERS = "PALPATE_SANITIZE:STRING=\n" not in (BINARY / "CMakeCache.txt").read_text()


def run(program, *arguments, cwd=None, **options):
    """The finished process, with its output as text."""
    return subprocess.run([str(program), *map(str, arguments)], cwd=cwd, text=True, capture_output=True,
                          timeout=PATIENCE, check=False, **options)


def done(*command, **options):
    """The output of a command that must succeed."""
    result = run(*command, **options)
    if result.returncode != 0:
        raise AssertionError(f"{command} failed:\n{result.stdout}{result.stderr}")
    return result.stdout


def recorded(file, field):
    """A field of a recording that goes on, as far as it is; nothing where there is none yet."""
    try:
        return palpate.read(file)[field]
    except palpate.Error:
        return numpy.array([], dtype=int)  # it has not begun


def pictures(recording):
    """The surface and the pictures of a recording, "surface/nodes" and so on: those that are computed too."""
    with tempfile.TemporaryDirectory() as folder:
        done(RUNTIME, "export", recording, "--hdf5", pathlib.Path(folder) / "pictures.h5")
        with h5py.File(pathlib.Path(folder) / "pictures.h5") as hdf:
            return {f"{group}/{name}": values[:] for group in ("surface", "frames") for name, values in hdf[group].items()}


def records_of(data):
    """Where each record of an MCAP file begins, its kind, and where its content begins and ends."""
    at = 8
    while at + 9 <= len(data) - 8:
        size = int.from_bytes(data[at + 1 : at + 9], "little")
        yield at, data[at], at + 9, at + 9 + size
        at += 9 + size


def set_tick(recording, field, row, value):
    """Changes a number of a tick, and the checksum of its chunk with it."""
    read = palpate.read(recording)
    at, kind = read._columns[field]  # where the message has it
    place = int(read._ticks._channel.places[row]) + at
    data = bytearray(recording.read_bytes())
    number = numpy.array(value, kind.base).tobytes()
    data[place : place + len(number)] = number
    for _, kind, begin, end in records_of(data):
        if kind == 6 and begin < place < end:
            inside = begin + 40  # two times, size, checksum, no compression, size
            data[begin + 24 : begin + 28] = zlib.crc32(data[inside:end]).to_bytes(4, "little")
    recording.write_bytes(data)


def cube_toml(cells, scope="surface", precision="double", name="cube", element="tet4"):
    """The cube of theory.md section 4 with `cells` cells an edge."""
    return f"""name = "{name}"
[geometry]
box = {{ origin = [0, 0, 0], size = [1, 1, 1], cells = [{cells}, {cells}, {cells}] }}
[mesh]
element = "{element}"
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
density = 1000
[[fixed]]
half_space = {{ point = [0, 0, 0], normal = [0, 0, -1] }}
[storage]
scope = "{scope}"
precision = "{precision}"
"""


class ProgramTest(unittest.TestCase):
    """A test with an empty folder of its own."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def wait_for(self, condition, process=None):
        """Waits for what a process brings about. Its end without it is a failure."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if condition():
                return
            if process is not None:
                self.assertIsNone(process.poll(), "it has ended")
            time.sleep(0.02)
        self.fail("it has not come")

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def bake(self, toml_text, *arguments, name="model.toml"):
        """Bakes a description and returns the file's path; the run must succeed."""
        model = self.write(name, toml_text)
        output = self.folder / (model.stem + ".palpate.hdf")
        result = run(PRECOMPUTE, model, "-o", output, *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return output

    def probe(self, file, *arguments):
        """The JSON answer of `palpate-runtime probe`."""
        result = run(RUNTIME, "probe", file, *arguments, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def assert_refused(self, result, *pieces):
        """Exit status 1, one `error:` and one `hint:` line that say all the pieces, nothing like a stack trace."""
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        lines = [line for line in result.stderr.splitlines() if line.startswith(("error: ", "hint: "))]
        self.assertEqual([line.split(":")[0] for line in lines], ["error", "hint"], result.stderr)
        for piece in pieces:
            self.assertIn(piece, "\n".join(lines))
