"""Recordings as a person meets them: told about, killed, drawn."""

import json
import random
import signal
import subprocess
import time

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from programs import PATIENCE, RUNTIME, SOURCE, ProgramTest, cube_toml, palpate, recorded, run, set_tick

TOUCH = "t,x,y,z,grab\n0,0.4,0.5,1.3,0\n0.1,0.4,0.5,1.15,0\n0.4,0.6,0.5,1.15,1\n0.5,0.6,0.5,1.3,1\n"


class Session(ProgramTest):
    def play(self, file, *arguments, script=TOUCH):
        self.write("touch.csv", script)
        result = run(RUNTIME, "play", file, "--device", "script:touch.csv", "--tool", "sphere:0.15", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def session(self, *arguments):
        result = run(RUNTIME, "session", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_says_what_is_in_it(self):
        file = self.bake(cube_toml(4, scope="full"))
        report = json.loads(self.play(file, "--fast", "--record", "out.mcap", "--overlay", "r=2,rings=1", "--report", "-").stdout)
        told = json.loads(self.session("out.mcap", "--json"))
        for name in ("ticks", "ticks_in_contact", "largest_force_N", "largest_force_time_s"):
            self.assertEqual(told[name], report[name], name)
        self.assertEqual((told["missing_ticks"], told["rate"], told["seconds"]), (0, 1000, 0.501))
        self.assertEqual((told["deadline_misses"], told["worst_lateness_ns"], told["faults"]), (0, 0, []))
        self.assertEqual((told["device"], told["was_killed"], told["pictures"]), ("script:touch.csv", False, 30))
        self.assertIn("\noverlay=r=2,rings=1\n", told["options"])
        lines = self.session("out.mcap").splitlines()
        self.assertLess(len(lines), 15)
        for piece in ("finished, by palpate", "501 at 1000 a second: 0.501 s, 0 missing", "script:touch.csv",
                      f"{report['largest_force_N']:.6g} N at {report['largest_force_time_s']:.3f} s", "faults           none",
                      "30 of 386 surface nodes, stored", "not timed"):
            self.assertIn(piece, "\n".join(lines))

    def test_frames_can_be_left_out(self):
        file = self.bake(cube_toml(3))
        self.play(file, "--fast", "--record", "out.mcap", "--record-frames", "0")
        self.assertIn("pictures         none", self.session("out.mcap"))
        result = run(RUNTIME, "play", file, "--device", "script:touch.csv", "--record-frames", "-1", cwd=self.folder)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--record-frames: '-1' is not a number from 0 on", result.stderr)

    def check_killed(self, path):
        """Rows are those from the first tick on, the same number in each field, and of ticks that were."""
        ticks = palpate.read(path)
        rows = len(ticks)
        numpy.testing.assert_array_equal(ticks["time"], numpy.arange(rows) / 1000)
        for name in ("device_orientation", "handle_orientation", "tool_orientation"):
            numpy.testing.assert_allclose(numpy.linalg.norm(ticks[name], axis=1), 1)
        numpy.testing.assert_allclose(ticks["handle_position"][:, 2], 1.3 - 0.0002 * ticks["time"], rtol=1e-12)
        looked_at = ticks.messages("/contacts")
        tick = numpy.array([message["tick"] for message in looked_at])
        numpy.testing.assert_array_equal([message["time"] for message in looked_at], tick / 1000)
        self.assertTrue((numpy.diff(tick) >= 17).all())
        return rows, len(looked_at)

    def test_killed_at_any_moment(self):
        file = self.bake(cube_toml(4))
        script = self.write("long.csv", "t,x,y,z\n0,0.5,0.5,1.3\n600,0.5,0.5,1.18\n")
        out = self.folder / "out.mcap"
        chance, most = random.Random(1), 0
        for _ in range(6):
            out.unlink(missing_ok=True)
            process = subprocess.Popen([RUNTIME, "play", file, "--device", f"script:{script}", "--record", "out.mcap"],
                                       cwd=self.folder, stderr=subprocess.PIPE)
            ticks = chance.randrange(2500)
            self.wait_for(lambda: len(recorded(out, "time")) >= ticks, process)
            process.send_signal(signal.SIGKILL)
            process.communicate()
            rows, frames = self.check_killed(out)
            most = max(most, rows)
            told = json.loads(self.session("out.mcap", "--json"))
            self.assertEqual((told["ticks"], told["pictures"]), (rows, frames))
            self.assertFalse(palpate.read(out).finished)
            self.session("out.mcap", "--finish")
            self.assertTrue(palpate.read(out).finished)
            self.assertEqual(self.check_killed(out), (rows, frames))
        self.assertGreater(most, 0)

    def test_while_it_is_recorded(self):
        file = self.bake(cube_toml(4))
        script = self.write("long.csv", "t,x,y,z\n0,0.5,0.5,1.3\n600,0.5,0.5,1.18\n")
        play = [RUNTIME, "play", file, "--device", f"script:{script}", "--record", "out.mcap", "--force", "--report", "-"]
        process = subprocess.Popen(play, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            for _ in range(600):
                time.sleep(0.1)
                if (self.folder / "out.mcap").exists() and json.loads(self.session("out.mcap", "--json"))["ticks"] > 0:
                    break
            told = json.loads(self.session("out.mcap", "--json"))
            self.assertTrue(told["going_on"] and told["ticks"] > 0)
            self.assert_refused(run(*play, cwd=self.folder), "out.mcap", "is being recorded by another program")
        finally:
            process.send_signal(signal.SIGTERM)
            output, _ = process.communicate(timeout=PATIENCE)
        self.assertFalse(json.loads(self.session("out.mcap", "--json"))["was_killed"])
        self.assertEqual(self.check_killed(self.folder / "out.mcap")[0], json.loads(output)["ticks"])

    def test_refuses_what_is_no_recording(self):
        file = self.bake(cube_toml(3))
        self.assert_refused(run(RUNTIME, "session", file, cwd=self.folder), "is a model, not a recording", "play")
        self.assert_refused(run(RUNTIME, "session", "none.mcap", cwd=self.folder), "none.mcap")

    def test_plots(self):
        file = self.bake(cube_toml(4))
        self.play(file, "--record", "out.mcap")
        for row in range(300, 501, 20):  # as if a device had failed, now and then
            set_tick(self.folder / "out.mcap", "fault", row, 1)
            set_tick(self.folder / "out.mcap", "phase", row, 3)
        for kind in ("session", "force"):
            result = run(SOURCE / "scripts" / "plot", kind, "out.mcap", f"{kind}.png", cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(result.stderr, "")
            reader = vtk.vtkPNGReader()
            reader.SetFileName(str(self.folder / f"{kind}.png"))
            reader.Update()
            pixels = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
            self.assertGreater(len(numpy.unique(pixels, axis=0)), 100, "an empty picture")
