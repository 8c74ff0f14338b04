"""Runs the two programs for the end-to-end tests."""

import json
import os
import pathlib
import subprocess
import tempfile
import time
import unittest

import h5py
import numpy

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
BINARY = pathlib.Path(os.environ["PALPATE_BINARY_DIR"])
PRECOMPUTE = BINARY / "precompute" / "palpate-precompute"
RUNTIME = BINARY / "runtime" / "palpate-runtime"
MODELS = SOURCE / "meshes" / "models"
# They must be in a process from its beginning, and neither Debian's Python nor mono has them.
HAS_SANITIZERS = "PALPATE_SANITIZE:STRING=\n" not in (BINARY / "CMakeCache.txt").read_text()


def run(program, *arguments, cwd=None, **options):
    """The finished process, with its output as text."""
    return subprocess.run([str(program), *map(str, arguments)], cwd=cwd, text=True, capture_output=True,
                          timeout=240, check=False, **options)


def done(*command, **options):
    """The output of a command that must succeed."""
    result = run(*command, **options)
    if result.returncode != 0:
        raise AssertionError(f"{command} failed:\n{result.stdout}{result.stderr}")
    return result.stdout


def recorded(file, field):
    """A field of a recording that goes on, as far as it is; nothing where there is none yet."""
    for _ in range(100):  # it may just be replaced
        try:
            with h5py.File(file) as session:
                return session[field][:]
        except FileNotFoundError:
            break
        except (OSError, KeyError):
            time.sleep(0.02)
    return numpy.array([], dtype=int)


def cube_toml(cells, scope="surface", precision="double", name="cube"):
    """The cube of theory.md section 4 with `cells` cells an edge."""
    return f"""name = "{name}"
[geometry]
box = {{ origin = [0, 0, 0], size = [1, 1, 1], cells = [{cells}, {cells}, {cells}] }}
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
        """Waits for what a process brings about. Two minutes without it, or the process's end, are a failure."""
        for _ in range(6000):
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
