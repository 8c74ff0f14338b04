"""Outputs that grow with time, of a run of a million ticks: all of it arrives, in little memory."""

import json
import os
import subprocess
import unittest

import h5py
import numpy

from programs import RUNTIME, SOURCE, ProgramTest, palpate

CUBE = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
ROWS = 1_000_001


class LongTest(ProgramTest):
    def run_in(self, most_memory, *command):
        """What a command printed, whose process took at most so many MB."""
        with open(self.folder / "printed", "w+") as printed:
            process = subprocess.Popen(list(map(str, command)), cwd=self.folder, stdout=printed, stderr=subprocess.STDOUT)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            printed.seek(0)
            text = printed.read()
        self.assertEqual(process.returncode, 0, text)
        self.assertLess(usage.ru_maxrss / 1024, most_memory, command)
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

        told = json.loads(self.run_in(200, RUNTIME, "session", "touch.mcap", "--json"))
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
        self.run_in(600, RUNTIME, "play", CUBE, "--device", "replay:touch.mcap", "--fast")


if __name__ == "__main__":
    unittest.main()
