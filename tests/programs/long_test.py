"""Outputs that grow with time, of a run of a million ticks: all of it arrives, in little memory."""

import json
import sys
import unittest

import h5py
import numpy

from programs import BINARY, RUNTIME, SOURCE, ProgramTest, done, palpate

CUBE = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
ROWS = 1_000_001
# By a small process of its own: to Linux the most memory of a process is at first that of the one that begins it, and this one holds a million
# ticks.
MEASURE = """
import json, resource, subprocess, sys
finished = subprocess.run(sys.argv[1:], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
print(json.dumps([finished.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, finished.stdout]))
"""
# All ticks by the C library: time is the first member behind the size.
READ = """
import ctypes, struct, sys
library = ctypes.CDLL(sys.argv[1])
library.palpate_recording_open.restype = ctypes.c_void_p
recording = ctypes.c_void_p(library.palpate_recording_open(sys.argv[2].encode(), None, ctypes.c_size_t(0)))
tick = ctypes.create_string_buffer(struct.pack("Qd", 16, 0.0), 16)
number = 0
while library.palpate_recording_tick(recording, ctypes.c_int64(number), tick) == 0:
    assert struct.unpack("Qd", tick)[1] == number / 1000, number
    number += 1
print(number)
"""


class LongTest(ProgramTest):
    def run_in(self, most_memory, *command):
        """What a command printed, whose process took at most so many MB."""
        code, kilobytes, text = json.loads(done(sys.executable, "-S", "-c", MEASURE, *command, cwd=self.folder))
        self.assertEqual(code, 0, text)
        self.assertLess(kilobytes / 1024, most_memory, command)
        return text

    def script(self):
        """A row a millisecond: the tool rises and falls every two seconds, and touches each time."""
        t = numpy.arange(ROWS) / 1000
        z = 1.08 - 0.06 * numpy.cos(numpy.pi * t)
        (self.folder / "long.csv").write_text("t,x,y,z\n" + "".join(f"{time},0.5,0.5,{height:.17g}\n" for time, height in zip(t.tolist(), z.tolist())))
        return z


class Script(LongTest):
    def test_of_a_million_rows_is_read(self):
        z = self.script()
        self.run_in(400, RUNTIME, "play", CUBE, "--device", "script:long.csv", "--tool", "sphere:0.05", "--fast", "--duration", "0.5", "--record", "touch.mcap")
        ticks = palpate.read(self.folder / "touch.mcap")
        numpy.testing.assert_array_equal(ticks["device_position"][:, 2], z[:len(ticks)])
        self.assertGreaterEqual(len(ticks), 500)


class Outputs(LongTest):
    def test_of_a_million_ticks(self):
        z = self.script()
        self.run_in(600, RUNTIME, "play", CUBE, "--device", "script:long.csv", "--tool", "sphere:0.05", "--fast", "--record", "touch.mcap", "--report",
                    "report.json", "--contacts", "contacts.csv", "--surface", "surface.vtu")
        report = json.loads((self.folder / "report.json").read_text())
        self.assertEqual((report["ticks"], report["recording_failed"]), (ROWS, None))
        self.assertLess((self.folder / "report.json").stat().st_size, 100_000)
        ticks = palpate.read(self.folder / "touch.mcap")
        self.assertEqual(len(ticks), ROWS)
        numpy.testing.assert_array_equal(ticks["device_position"][:, 2], z)
        size = numpy.linalg.norm(ticks["force"], axis=1)
        self.assertEqual(numpy.count_nonzero(ticks["contacts"]), report["ticks_in_contact"])

        told = json.loads(self.run_in(100, RUNTIME, "session", "touch.mcap", "--json"))
        self.assertEqual((told["ticks"], told["pictures"]), (ROWS, len(ticks.messages("/contacts"))))
        self.assertAlmostEqual(told["largest_force_N"], size.max(), delta=1e-12 * size.max())

        self.run_in(200, RUNTIME, "export", "touch.mcap", "--csv", "ticks.csv")
        table = numpy.loadtxt(self.folder / "ticks.csv", delimiter=",", skiprows=1, usecols=(0, 15, 16, 17))
        numpy.testing.assert_array_equal(table[:, 0], ticks["time"])
        numpy.testing.assert_array_equal(table[:, 1:], ticks["force"])

        self.run_in(250, RUNTIME, "export", "touch.mcap", "--hdf5", "touch.h5")
        with h5py.File(self.folder / "touch.h5") as hdf:
            for name in ticks:
                numpy.testing.assert_array_equal(hdf["ticks"][name], ticks[name], name)
            self.assertEqual(len(hdf["frames/time"]), told["pictures"])
            self.assertGreater(numpy.abs(hdf["frames/displacement"][-200:]).max(), 0.005)

        self.run_in(250, RUNTIME, "export", "touch.mcap", "--vtu", "touch.pvd", "--fps", "2")
        self.assertEqual(len(list((self.folder / "touch.frames").iterdir())), (self.folder / "touch.pvd").read_text().count("<DataSet"))
        self.run_in(250, RUNTIME, "export", "touch.mcap", "--gltf", "touch.glb", "--fps", "1", "--to", "999")
        self.run_in(700, RUNTIME, "export", "touch.mcap", "--html", "touch.html")
        self.run_in(200, RUNTIME, "play", CUBE, "--device", "replay:touch.mcap", "--fast")  # 130 of them are the fine surface
        self.assertEqual(self.run_in(100, sys.executable, "-S", "-c", READ, BINARY / "runtime" / "libpalpate.so", "touch.mcap").strip(), str(ROWS))


if __name__ == "__main__":
    unittest.main()
