"""Bodies that are solved while they are touched, through palpate-runtime play --solver."""

import json
import unittest

import h5py
import numpy

from programs import PRECOMPUTE, RUNTIME, ProgramTest, cube_toml, palpate, run

BLOCK = """name = "block"
[geometry]
box = { size = [0.04, 0.04, 0.03], cells = [4, 4, 3] }
[mesh]
element = "tet4"
[material]
youngs_modulus = 5.0e3
poissons_ratio = 0.3
density = 1000.0
[[fixed]]
half_space = { point = [0, 0, 0], normal = [0, 0, -1] }
[storage]
precision = "double"
"""


def press(depth, seconds=1.0):
    """A ball of 6 mm goes down on the middle of the top, and waits."""
    top = 0.03 + 0.006
    rows = [(0, top + 0.001), (seconds / 2, top - depth), (seconds, top - depth)]
    return "t,x,y,z\n" + "".join(f"{t},0.02,0.02,{z}\n" for t, z in rows)


class Live(ProgramTest):
    def play(self, file, script, *arguments):
        path = self.write("touch.csv", script)
        result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", "--tool", "sphere:0.006", "--report", "-", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout), result.stderr

    def force(self, file, depth, *arguments, seconds=1.0):
        report, _ = self.play(file, press(depth, seconds), "--record", "touch.mcap", *arguments)
        recording = palpate.read(self.folder / "touch.mcap")
        force = -recording["force"][:, 2]
        (self.folder / "touch.mcap").unlink()
        return force[-1], report

    def test_a_light_press_is_that_of_the_greens_functions(self):
        file = self.bake(BLOCK)
        greens, _ = self.force(file, 0.0005, "--overlay", "no", "--depth", "no")
        for solver in ("linear", "corotational", "neo-hookean"):
            live, report = self.force(file, 0.0005, "--solver", solver)
            self.assertAlmostEqual(live / greens, 1.0, delta=1e-4 if solver == "linear" else 0.03, msg=solver)
            self.assertEqual(report["dynamics"]["method"], "live")
            self.assertEqual(report["live"]["solver"], solver)
            self.assertEqual(report["live"]["steps"], 200)
            self.assertEqual(report["live"]["steps_stopped"], 0)

    def test_a_deep_press_is_another_by_each_law_and_its_error_is_told(self):
        file = self.bake(BLOCK)
        linear, of_linear = self.force(file, 0.009, "--solver", "linear")
        corotational, _ = self.force(file, 0.009, "--solver", "corotational")
        stiffer, of_stiffer = self.force(file, 0.009, "--solver", "neo-hookean")
        self.assertGreater(abs(corotational / linear - 1), 0.02)
        self.assertGreater(abs(stiffer / linear - 1), 0.02)
        self.assertLess(of_linear["live"]["largest_force_error_N"], 1e-6 * linear)  # W is right all the time
        self.assertGreater(of_stiffer["live"]["largest_force_error_N"], 0)
        self.assertLess(of_stiffer["live"]["last_force_error_N"], 1e-3 * stiffer)  # at rest the solver has it
        self.assertGreater(of_linear["live"]["compliance_age_s"], 0.9)
        self.assertEqual(of_linear["live"]["compliance_renewals"], 0)
        self.assertLess(of_stiffer["live"]["compliance_age_s"], 0.9)
        self.assertGreater(of_stiffer["live"]["compliance_renewals"], 0)

    def test_explicit_steps_and_conjugate_gradients_press_alike(self):
        file = self.bake(BLOCK)
        options = ("--solver", "corotational", "--live-step", "0.001", "--mass-damping", "20")
        reference, _ = self.force(file, 0.004, *options, seconds=0.6)
        for way in (("--step-solver", "cg"), ("--integrator", "semi-implicit-euler")):
            force, report = self.force(file, 0.004, *options, "--stiffness-damping", "0", *way, seconds=0.6)
            self.assertAlmostEqual(force / reference, 1, delta=0.01, msg=way)
            self.assertEqual(report["live"]["steps_stopped"], 0)

    def test_equal_runs_are_equal_and_replay_to_the_bit(self):
        file = self.bake(BLOCK)
        options = ("--solver", "corotational", "--yield", "0.05", "--creep", "20", "--gravity", "0,0,-9.81")
        report, _ = self.play(file, press(0.006, 0.5), "--record", "a.mcap", *options)
        self.assertGreater(report["live"]["compliance_renewals"], 0)
        self.play(file, press(0.006, 0.5), "--record", "b.mcap", *options)
        a = palpate.read(self.folder / "a.mcap")
        b = palpate.read(self.folder / "b.mcap")
        numpy.testing.assert_array_equal(a["force"], b["force"])
        frames = a.frames["displacement"][:]
        self.assertGreater(numpy.abs(frames).max(), 0.004)
        result = run(RUNTIME, "play", file, "--device", "replay:a.mcap", "--fast", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("bit by bit", result.stderr)

    def test_a_free_body_falls_on_the_floor_and_stays_there(self):
        file = self.bake(BLOCK)
        away = "t,x,y,z\n0,0.02,0.02,0.5\n1.5,0.02,0.02,0.5\n"
        self.play(file, away, "--record", "fall.mcap", "--solver", "corotational", "--free", "yes", "--gravity", "0,0,-9.81", "--floor", "-0.05")
        recording = palpate.read(self.folder / "fall.mcap")
        u, nodes, time = recording.frames["displacement"][:], recording.surface["nodes"], recording.frames["time"][:]
        self.assertLess(numpy.abs(u[1]).max(), 3e-3)
        heights = (nodes + u)[..., 2].min(axis=1)
        self.assertAlmostEqual(heights[-1], -0.05, delta=1e-3)
        self.assertGreater(heights.min(), -0.0505)
        self.assertLess(time[5], 0.09)
        self.assertAlmostEqual(u[5, :, 2].mean(), -0.5 * 9.81 * (time[5] + 0.0025) ** 2, delta=0.001)  # implicit Euler is half a step ahead

    def test_a_block_is_pushed_over_a_floor_and_stays(self):
        """A ball pushes it at 10 mm/s for 12 mm and goes back: the block is never ahead of the ball, and rests where it was left."""
        block = BLOCK.replace("5.0e3", "5.0e4").replace("tet4", "hex8")
        file = self.bake(block.replace('precision = "double"', 'scope = "none"'))
        push = "t,x,y,z\n0,-0.02,0.02,0.008\n0.2,-0.0065,0.02,0.008\n1.4,0.0055,0.02,0.008\n1.5,-0.02,0.02,0.008\n2.2,-0.02,0.02,0.008\n"
        for options in ((), ("--live-step", "0.01"), ("--integrator", "midpoint")):
            self.play(file, push, "--record", "push.mcap", "--solver", "corotational", "--free", "yes", "--floor", "0", "--gravity", "0,0,-9.81",
                      "--wall-friction", "0.5", *options)
            frames = palpate.read(self.folder / "push.mcap").frames
            moved, time = frames["displacement"][:][..., 0].mean(axis=1), frames["time"][:]
            (self.folder / "push.mcap").unlink()
            front = numpy.interp(time, [0.25, 1.4], [0.0, 0.0115])  # of the ball, from where it touches on
            self.assertGreater(moved[-1], 0.009, options)
            self.assertLess((moved - front).max(), 1e-4, options)
            late = time > 1.8
            self.assertLess(numpy.ptp(moved[late]), 1e-5 * numpy.ptp(time[late]), options)

    def test_a_free_body_falls_as_gravity_says(self):
        file = self.bake(BLOCK)
        away = "t,x,y,z\n0,0.02,0.02,0.5\n1,0.02,0.02,0.5\n"
        for integrator, late in (("implicit-euler", 0.005), ("midpoint", 0.0)):
            self.play(file, away, "--record", "fall.mcap", "--solver", "corotational", "--free", "yes", "--gravity", "0,0,-9.81", "--integrator", integrator)
            frames = palpate.read(self.folder / "fall.mcap").frames
            u, time = frames["displacement"][:][..., 2].mean(axis=1), frames["time"][:]
            (self.folder / "fall.mcap").unlink()
            fallen = 0.5 * 9.81 * time * (time + late)
            self.assertGreater(time[-1], 0.9)
            # Pictures are between steps of 5 ms.
            self.assertLess(numpy.abs(-u - fallen).max(), 9.81 * 0.0051, integrator)
            self.assertAlmostEqual(-u[-1] / fallen[-1], 1.0, delta=0.011, msg=integrator)

    def test_a_file_without_greens_functions_is_enough(self):
        whole = self.bake(BLOCK)
        file = self.bake(BLOCK.replace('precision = "double"', 'scope = "none"').replace('"block"', '"bare"'))
        with h5py.File(self.folder / file) as stored:
            self.assertNotIn("greens", stored)
            self.assertEqual(stored["dofs/stored_nodes"].shape, (0,))
        for solver in ("corotational", "neo-hookean"):
            bare, other = (self.force(body, 0.003, "--solver", solver, seconds=0.2)[0] for body in (file, whole))
            self.assertGreater(bare, 0)
            self.assertEqual(bare, other, solver)
        for program, command in ((PRECOMPUTE, "inspect"), (PRECOMPUTE, "verify")):
            result = run(program, command, file, cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
        path = self.write("touch.csv", press(0.001))
        result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", cwd=self.folder)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("no Green's functions", result.stderr)
        self.assertIn("--solver corotational", result.stderr)

    def test_a_body_that_nothing_holds_needs_no_fixed_region(self):
        free = "\n".join(line for line in BLOCK.splitlines() if "fixed" not in line and "half_space" not in line)
        file = self.bake(free.replace('precision = "double"', 'scope = "none"'))
        away = "t,x,y,z\n0,0.02,0.02,0.5\n1,0.02,0.02,0.5\n"
        self.play(file, away, "--record", "fall.mcap", "--solver", "corotational", "--gravity", "2,0,-9.81", "--room", "-0.1,-0.1,-0.05,0.15,0.15,0.2",
                  "--obstacle", "0.06,-0.1,-0.06,0.1,0.15,0.0", "--wall-friction", "0")
        recording = palpate.read(self.folder / "fall.mcap")
        last = recording.surface["nodes"] + recording.frames["displacement"][-1]
        self.assertAlmostEqual(last[:, 2].min(), -0.05, delta=1e-3)
        self.assertGreater(last[:, 0].min(), 0.01)  # it has slid
        self.assertLess(last[:, 0].max(), 0.061)    # against the obstacle

    def test_plasticity_keeps_a_dent(self):
        file = self.bake(BLOCK)
        script = "t,x,y,z\n0,0.02,0.02,0.037\n0.4,0.02,0.02,0.031\n0.8,0.02,0.02,0.031\n1.2,0.02,0.02,0.05\n2.4,0.02,0.02,0.05\n"
        for options, least, most in (((), 0, 1e-2), (("--yield", "0.05", "--creep", "20"), 0.5, 0.95)):
            report, _ = self.play(file, script, "--record", "dent.mcap", "--solver", "corotational", *options)
            recording = palpate.read(self.folder / "dent.mcap")
            down = -recording.frames["displacement"][:][..., 2].min(axis=1)
            (self.folder / "dent.mcap").unlink()
            self.assertGreater(down.max(), 5e-3)
            self.assertTrue(least <= down[-1] / down.max() <= most, (options, down[-1], down.max()))
            self.assertEqual(report["live"]["plastic_work_J"] > 0, bool(options))

    def test_a_body_that_is_solved_too_slowly_is_told(self):
        """2 197 nodes: a step takes some hundred milliseconds on any machine of today, and a body of 64 nodes some tenth of one."""
        slow = self.bake(BLOCK.replace("cells = [4, 4, 3]", "cells = [12, 12, 12]"), name="slow.toml")
        path = self.write("touch.csv", press(0.003))
        result = run(RUNTIME, "play", slow, "--device", f"script:{path}", "--tool", "sphere:0.006", "--solver", "corotational", "--record", "slow.mcap",
                     "--report", "slow.json", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"warning: a step of 5 ms takes \d+ ms here: the body moves [0-9.e+]+ times slower than real time")
        self.assertIn("--step-solver cg", result.stderr)
        report = json.loads((self.folder / "slow.json").read_text())
        self.assertIn("the body stood still in", result.stderr)
        self.assertGreater(report["best_effort"]["late_ticks"], 100)
        right, _ = self.force(slow, 0.003, "--solver", "corotational")
        told = report["live"]["largest_force_error_N"]
        self.assertGreaterEqual(told, 0.5 * (report["largest_force_N"] - right))
        self.assertEqual(told, report["best_effort"]["force_error_N"]["largest"])
        session = run(RUNTIME, "session", "slow.mcap", cwd=self.folder)
        self.assertIn("the body stood still in", session.stdout)

    def test_what_does_not_fit_is_refused(self):
        file = self.bake(BLOCK)
        path = self.write("touch.csv", press(0.001))
        for arguments, words in ((("--solver", "corotational", "--live-step", "0.0015"), "whole number of ticks"),
                                 (("--solver", "corotational", "--overlay", "r=2,rings=1"), "--overlay"),
                                 (("--solver", "corotational", "--contact", "dynamic"), "--contact"),
                                 (("--solver", "neo-hookean", "--yield", "0.1"), "does not flow"),
                                 (("--solver", "rubber"), "none of linear, corotational"),
                                 (("--gravity", "0,0,-9.81"), "--solver, which is not given"),
                                 (("--solver", "linear", "--room", "0,0,0"), "not two corners"),
                                 (("--solver", "linear", "--obstacle", "1,1,1,0,2,2"), "no size"),
                                 (("--solver", "linear", "--obstacle", "-0.01,-0.01,0.015,0.015,0.015,0.1"), "begins in the obstacle"),
                                 (("--solver", "linear", "--floor", "0.015"), "begins in a wall"),
                                 (("--solver", "linear", "--gravity", "0,0,-1e6"), "at most 1000"),
                                 (("--solver", "linear", "--live-step", "1"), "at most 0.1"),
                                 (("--solver", "linear", "--integrator", "explicit-euler"), "none of implicit-euler"),
                                 (("--solver", "linear", "--integrator", "semi-implicit-euler", "--live-step", "0.05"), "the longest stable one is"),
                                 (("--solver", "mass-spring"), "none of linear, corotational"),
                                 (("--solver", "linear", "--creep", "-1"), "not a number that is"),
                                 (("--solver", "linear", "--poissons-ratio", "0.5"), "between -1 and 1/2"),
                                 (("--poissons-ratio", "0.4"), "--solver, which is not given"),
                                 (("--solver", "linear", "--live-step", "0"), "not a number that is")):
            result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", *arguments, cwd=self.folder)
            self.assertNotEqual(result.returncode, 0, arguments)
            self.assertIn(words, result.stderr, arguments)


if __name__ == "__main__":
    unittest.main()
