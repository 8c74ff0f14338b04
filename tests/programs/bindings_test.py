"""A client in each language plays the same poses on the same body: forces and torques are equal to the last bit."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy

from programs import HAS_SANITIZERS, PRECOMPUTE, RUNTIME, SOURCE, cube_toml, done, run

sys.path.insert(0, str(SOURCE / "runtime" / "python"))

import palpate  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent / "bindings"
LIBRARY = SOURCE / "runtime" / "library"
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]


def clients(folder):
    """Commands of a client in each language, compiled into a folder."""
    runtime = RUNTIME.parent
    linked = [f"-I{LIBRARY}", f"-L{runtime}", f"-Wl,-rpath,{runtime}", "-lpalpate"]
    done("cc", "-std=c11", *WARNINGS, HERE / "client.c", *linked, "-o", folder / "of_c")
    done("c++", "-std=c++17", *WARNINGS, HERE / "client.cpp", *linked, "-o", folder / "of_cpp")
    done("mcs", "-langversion:6", "-warnaserror", f"-out:{folder / 'of_csharp.exe'}", HERE / "Client.cs", LIBRARY / "Palpate.cs")
    return {"C": [folder / "of_c"], "C++": [folder / "of_cpp"], "C#": ["mono", folder / "of_csharp.exe"],
            "Python": [sys.executable, HERE / "client.py"]}


def environment():
    return {**os.environ, "LD_LIBRARY_PATH": str(RUNTIME.parent), "PYTHONPATH": str(SOURCE / "runtime" / "python"),
            "PATH": os.pathsep.join([str(PRECOMPUTE.parent), str(RUNTIME.parent), os.environ["PATH"]])}


def poses(slides=250):
    """A sphere of 0.1 comes down on a cube of 1, presses, slides while it turns, grabs and pulls; a pose a line."""
    down = [(0.4, 0.5, z, 0.0, 0) for z in numpy.linspace(1.15, 1.04, 150)]
    along = [(x, 0.5, 1.04, 0.3 * (x - 0.4), 0) for x in numpy.linspace(0.4, 0.6, slides)]
    pull = [(0.6, 0.5, z, 0.06, 1) for z in numpy.linspace(1.04, 1.1, 150)]
    return "".join(f"{x!r} {y!r} {z!r} 1 {t!r} {t!r} 0 {grab}\n" for x, y, z, t, grab in [tuple(map(float, row[:4])) + (row[4],) for row in down + along + pull])


class Clients(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if HAS_SANITIZERS:
            raise unittest.SkipTest("Python and mono cannot load a library with sanitizers")
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        (cls.folder / "cube.toml").write_text(cube_toml(4))
        cls.cube = cls.folder / "cube.palpate.hdf"
        done(PRECOMPUTE, cls.folder / "cube.toml", "-o", cls.cube)
        cls.clients = clients(cls.folder)

    def test_feel_the_same_to_the_last_bit(self):
        felt = {language: done(*client, self.cube, input=poses(), env=environment()).splitlines()[:-1]
                for language, client in self.clients.items()}
        self.assertEqual(len(felt["C"]), 550)
        for language, lines in felt.items():
            self.assertEqual(lines, felt["C"], language)
        numbers = numpy.array([[int(word, 16) for word in line.split()[1:]] for line in felt["C"]], numpy.uint64).view(numpy.float64)
        self.assertGreater(numbers[149, 2], 0.01, "it is pressed")
        self.assertLess(numbers[399, 0], -1e-3, "it rubs")
        self.assertLess(numbers[-1, 2], -1e-3, "it pulls")
        self.assertGreater(numbers[149, 8], 0.9, "a contact is on the top")
        self.assertGreater(numbers[149, 11], 0.9, "whose normal points up")

    def test_record_what_a_replay_repeats_to_the_last_bit(self):
        felt = []
        for k, (language, client) in enumerate(self.clients.items()):
            recording = self.folder / f"by_{k}.mcap"
            lines = done(*client, self.cube, recording, input=poses(), env=environment()).splitlines()[:-1]
            replay = run(RUNTIME, "play", self.cube, "--device", f"replay:{recording}", "--fast", cwd=self.folder)
            self.assertEqual(replay.returncode, 0, f"{language}: {replay.stderr}")
            self.assertIn("all forces of 550 ticks are those of the session, bit by bit", replay.stderr)
            read = palpate.read(recording)
            force = -read["force"]  # on the hand
            self.assertEqual([["%016x" % word for word in row] for row in numpy.ascontiguousarray(force).view(numpy.uint64)],
                             [line.split()[1:4] for line in lines], language)
            self.assertGreater(len(read.messages("/contacts")), 2)
            felt.append(force)
        self.assertEqual(len(felt), 4)

    def test_misuse_of_cpp_is_an_error(self):
        runtime = RUNTIME.parent
        done("c++", "-std=c++17", *WARNINGS, "-pthread", HERE / "misuse.cpp", f"-I{LIBRARY}", f"-L{runtime}", f"-Wl,-rpath,{runtime}", "-lpalpate",
             "-o", self.folder / "misuse")
        self.assertEqual(done(self.folder / "misuse", self.cube, env=environment(), cwd=self.folder), "ok\n")

    def test_misuse_of_csharp_is_an_exception(self):
        program = self.folder / "misuse.exe"
        done("mcs", "-langversion:6", "-warnaserror", f"-out:{program}", HERE / "Misuse.cs", LIBRARY / "Palpate.cs")
        said = done("mono", program, self.cube, self.folder / "misused", env=environment())
        self.assertEqual(said, "ok\n")

    def test_a_recording_that_cannot_be_made_is_told(self):
        told = {}
        for language, client in self.clients.items():
            result = run(*client, self.cube, self.folder / "no" / "such.mcap", input="", env=environment())
            self.assertNotEqual(result.returncode, 0, language)
            told[language] = result.stderr
            self.assertIn("no/such.mcap", result.stderr, language)

    def test_say_the_same_of_what_is_wrong(self):
        told = {}
        for language, client in self.clients.items():
            result = run(*client, "missing.palpate.hdf", input="", env=environment(), cwd=self.folder)
            self.assertEqual(result.returncode, 1, language)
            told[language] = result.stderr.strip().removesuffix("\n")
        self.assertRegex(told["C"], r"^error: missing\.palpate\.hdf: .+\nhint: .+$")
        self.assertEqual(set(told.values()), {told["C"]}, told)


if __name__ == "__main__":  # what a tick costs in each language: median and 99.9 % [us] of 20 000 that slide
    with tempfile.TemporaryDirectory() as name:
        body = pathlib.Path(name) / "cube.palpate.hdf"
        pathlib.Path(name, "cube.toml").write_text(cube_toml(4))
        done(PRECOMPUTE, pathlib.Path(name, "cube.toml"), "-o", body)
        print("| language | tick: median / 99.9 % |\n|---|---|")
        for language, client in clients(pathlib.Path(name)).items():
            last = subprocess.run([*client, body], input=poses(20000), env=environment(), text=True, capture_output=True, check=True).stdout.splitlines()[-1]
            median, slow = (float(word) / 1000 for word in last.split()[1:])
            print(f"| {language} | {median:.1f} / {slow:.1f} µs |")
