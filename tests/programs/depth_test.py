"""Bodies on two levels, which turn and bend far, through palpate-runtime play."""

import json
import math
import time
import unittest
from pathlib import Path

import numpy

from programs import MODELS, PATIENCE, RUNTIME, ProgramTest, palpate, run

LENGTH, HEIGHT, RADIUS = 0.08, 0.01, 0.003
TONGUE = """name = "tongue"
[geometry]
box = { size = [0.08, 0.01, 0.01], cells = [16, 2, 2] }
[mesh]
element = "hex8"
[material]
youngs_modulus = 5.0e3
poissons_ratio = 0.3
density = 1000.0
[[fixed]]
lowest = { axis = "x", percent = 1 }
[storage]
scope = "surface"
precision = "double"
"""
# Time [s] and place [mm] of a hand that presses deep, slides and comes back.
FAST = ((0, 159.6, -50, 124.4), (1.349, 159.6, 18.1, 124.4), (2.124, 135.2, 22.1, 131.9), (2.339, 152.5, 22.3, 149.8), (2.648, 152.5, 22.3, 149.8), (3.339, 152.5, -50, 149.8),
        (3.809, 123.3, -50, 99.7), (4.498, 123.3, 17.4, 99.7), (4.708, 126.8, 12, 85.3), (4.928, 106.4, 13.7, 69.1), (5.434, 135.5, 19.6, 86.5), (5.744, 135.5, 19.6, 86.5),
        (6.16, 135.5, -50, 86.5))


def bend(degrees, seconds):
    """A ball bends the tongue down to an arc, and waits for as long again."""
    rows = []
    for k in range(201):
        angle = math.radians(degrees) * max(k, 1e-3) / 200
        turned, out = 0.9 * angle, 0.5 * HEIGHT + RADIUS + (2e-4 if k == 0 else 0.0)  # it begins outside
        x = LENGTH / angle * math.sin(turned) + out * math.sin(turned)
        z = 0.5 * HEIGHT - LENGTH / angle * (1 - math.cos(turned)) + out * math.cos(turned)
        rows.append((seconds * k / 200, x, z))
    rows.append((2 * seconds, *rows[-1][1:]))
    return "t,x,y,z\n" + "".join(f"{t},{x},0.005,{z}\n" for t, x, z in rows)


class Depth(ProgramTest):
    def play(self, file, degrees, *arguments, seconds=1.0, radius=RADIUS):
        path = self.write("bend.csv", bend(degrees, seconds))
        result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", "--tool", f"sphere:{radius}", "--report", "-", "--record", "bend.mcap", "--force",
                     *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        recording = palpate.read(self.folder / "bend.mcap")
        return numpy.linalg.norm(recording["force"], axis=1), json.loads(result.stdout), result.stderr

    def test_it_feels_like_the_corotational_body_where_small_strain_does_not(self):
        file = self.bake(TONGUE)
        deep, report, said = self.play(file, 60, "--depth", "yes")
        live, _, _ = self.play(file, 60, "--solver", "corotational", "--mass-damping", "20")
        linear, of_linear, _ = self.play(file, 60, "--depth", "no")
        print(f"at the end: corotational {live[-1]:.5f} N, deep {deep[-1] / live[-1] - 1:+.2%}, linear {linear[-1] / live[-1] - 1:+.2%}")
        self.assertAlmostEqual(deep[-1] / live[-1], 1.0, delta=0.05)
        self.assertGreater(abs(linear[-1] / live[-1] - 1.0), 0.2)
        self.assertEqual(report["dynamics"], {"method": "none", "contact": "quasi-static", "steps": report["dynamics"]["steps"], "longest_step_s": report["dynamics"]["longest_step_s"]})
        self.assertGreater(report["depth"]["largest_rotation_deg"], 30)
        self.assertLess(report["depth"]["last_residual"], 1e-3)
        self.assertAlmostEqual(report["surface"]["studied_rotation_deg"], 90)
        self.assertAlmostEqual(of_linear["surface"]["studied_rotation_deg"], 19)
        self.assertGreater(of_linear["surface"]["last_rotation_deg"], 19)
        self.assertNotIn("depth", of_linear)
        self.assertIn("depth: the body turned", said)

    def test_a_grab_along_a_tongue_is_at_rest(self):
        """Beyond buckling given forces have no balance; warping, which went by them, felt 0.1 to 2.3 N here in turns."""
        file = self.bake(TONGUE.replace('box = { size = [0.08, 0.01, 0.01], cells = [16, 2, 2] }', 'rectangle = { size = [0.08, 0.01], cells = [32, 4] }')
                         .replace('name = "tongue"', 'name = "tongue"\nplane = "stress"').replace('"hex8"', '"quad4"'))
        path = self.write("grab.csv", "t,x,y,z,grab\n0,.08,.005,0,1\n.02,.08,.005,0,1\n1,.079,.001,0,1\n2,.079,.001,0,1\n")
        force = []
        for law in (("--depth", "yes"), ("--solver", "corotational", "--mass-damping", "40")):
            result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", "--reach", "0.002", "--record", "grab.mcap", "--force", *law, cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            force.append(palpate.read(self.folder / "grab.mcap")["force"])
        deep, live = force
        self.assertLess(abs(deep[-500:] - deep[-1]).max(), 1e-6)
        numpy.testing.assert_allclose(deep[-1], live[-1], atol=0.05 * numpy.linalg.norm(live[-1]))

    def test_compressed_bodies_are_felt_as_others(self):
        plain = self.bake(TONGUE)
        of_plain, _, _ = self.play(plain, 40, "--depth", "yes", seconds=0.3)
        plain.unlink()
        compressed = self.bake(TONGUE.replace('precision = "double"', 'compression = "h2"\ntolerance = 1e-3'))
        of_compressed, report, _ = self.play(compressed, 40, "--depth", "yes", seconds=0.3)
        self.assertLess(report["depth"]["last_residual"], 1e-3)
        self.assertGreater(of_plain[-1], 0)
        self.assertAlmostEqual(of_compressed[-1] / of_plain[-1], 1.0, delta=1e-4)

    def test_static_bodies_in_space_are_on_two_levels(self):
        def same(file, depth, *arguments):
            plain, _, _ = self.play(file, 20, *arguments, seconds=0.2)
            asked, _, _ = self.play(file, 20, "--depth", depth, *arguments, seconds=0.2)
            self.assertGreater(plain[-1], 0)
            numpy.testing.assert_array_equal(plain, asked)

        file = self.bake(TONGUE)
        same(file, "yes")
        file.unlink()
        file = self.bake(TONGUE.replace('scope = "surface"', 'scope = "layers"\nlayers = 1'))
        same(file, "no", "--overlay", "r=2,rings=1")
        file.unlink()
        same(self.bake(TONGUE + '[dynamics]\nmethod = "modal"\nmodes = 4\n'), "no")

    def test_runs_are_equal_and_replay(self):
        file = self.bake(TONGUE)
        one, _, _ = self.play(file, 40, "--depth", "yes", seconds=0.2)
        self.write("keep.mcap", "")
        (self.folder / "bend.mcap").rename(self.folder / "keep.mcap")
        other, _, _ = self.play(file, 40, "--depth", "yes", seconds=0.2)
        self.assertGreater(one[-1], 0)
        numpy.testing.assert_array_equal(one, other)
        result = run(RUNTIME, "play", file, "--device", "replay:keep.mcap", "--fast", "--report", "-", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(result.stdout)["replay"]["different_ticks"], 0)

    def test_an_own_loop_feels_it_and_replays(self):
        file = self.bake(TONGUE)
        deep, _, _ = self.play(file, 40, "--overlay", "no", seconds=0.3)
        recording = palpate.read(self.folder / "bend.mcap")
        path, told = recording["device_position"], recording["small_strain"][-1]
        with palpate.Session(file, palpate.Tool(radius=RADIUS), max_contacts=256, depth=True) as session:
            session.record(self.folder / "own.mcap")
            for place in path:
                felt = session.step(place)
                force = felt.force
                time.sleep(0.0005)  # its balance is found by another thread
            end = time.monotonic() + PATIENCE
            while (abs(numpy.linalg.norm(force) / deep[-1] - 1) > 1e-3 or abs(felt.small_strain / told - 1) > 0.02) and time.monotonic() < end:
                felt = session.step(path[-1])
                force = felt.force
                time.sleep(0.001)
            session.end_recording()
        self.assertAlmostEqual(numpy.linalg.norm(force) / deep[-1], 1, delta=1e-3)
        self.assertGreater(told, 0.1)
        self.assertAlmostEqual(felt.small_strain, told, delta=0.02 * told)
        result = run(RUNTIME, "play", file, "--device", "replay:own.mcap", "--fast", "--report", "-", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(result.stdout)["replay"]["different_ticks"], 0)
        with self.assertRaisesRegex(palpate.Error, "no inertia and no finer mesh"):
            palpate.Session(file, palpate.Tool(radius=RADIUS), depth=True, overlay=palpate.Overlay(refinement=2, rings=1))

    def test_what_does_not_go_with_it_is_refused(self):
        file = self.bake(TONGUE)
        path = self.write("bend.csv", bend(20, 0.1))
        for arguments, words in ((("--solver", "corotational"), "a live solver turns by itself"), (("--contact", "dynamic"), "has no inertia"),
                                 (("--overlay", "r=2,rings=1"), "patches are of the body at rest")):
            result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", "--depth", "yes", *arguments, cwd=self.folder)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(words, result.stderr)
            self.assertIn("--depth", result.stderr)

    def bake_liver(self, element="tet4a") -> Path:
        image = MODELS / "liver" / "liver.inr.gz"
        if not image.exists():
            self.skipTest("the liver's image is not there: scripts/demo gets it")
        text = (MODELS / "liver" / "model.toml").read_text().replace("edge_length = 0.0055", f'edge_length = 0.0085\nelement = "{element}"').replace('"layers"\nlayers = 2', '"surface"')
        return self.bake(text.replace('"liver.inr.gz"', f'"{image}"'), "--force")

    def test_a_fast_hand_deep_in_a_liver(self):
        """A ball of 20 mm is pressed in by some 18 mm and slid, at up to 300 mm/s. Where the border gives way, given forces turn the remainder so that the coarse body is
        almost free, and by that tangent the border would fold over the ball within 20 ms."""
        for element in ("tet4", "tet4a"):
            file = self.bake_liver(element)
            self.write("fast.csv", "t,x,y,z\n" + "".join(f"{t},{x / 1000},{y / 1000},{z / 1000}\n" for t, x, y, z in FAST))
            result = run(RUNTIME, "play", file, "--device", "script:fast.csv", "--fast", "--tool", "sphere:0.02", "--friction", "0", "--depth", "yes", "--report", "-",
                         cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertGreater(report["ticks_in_contact"], 3000)
            self.assertEqual([report["status_ticks"][status] for status in ("inside_body", "result_not_finite", "not_converged")], [0, 0, 0])
            self.assertLess(report["largest_jump_N"], 0.03 * report["largest_force_N"])

    def press_and_circle(self, file, radius, depth, seconds, *options):
        """A ball presses into the ridge, goes round a tilted circle there and comes out again: its ticks as a recording."""
        way = numpy.linspace(0, 1, 201)
        eased = way * way * (3 - 2 * way)
        middle, up = numpy.array([0.155, 0.0235, 0.117]), numpy.array([0.0, -1.0, 0.0])
        above = middle + (radius + 0.002) * up
        press = above - numpy.outer((depth + 0.002) * eased, up)
        angle = 2 * numpy.pi * eased[1:]
        circle = press[-1] + 0.015 * numpy.stack([numpy.cos(angle) - 1, 0 * angle, numpy.sin(angle)], 1) + 0.3 * depth * numpy.outer(numpy.sin(angle), up)
        places = numpy.concatenate([press, circle, press[-2::-1]])
        times = numpy.concatenate([way, 1 + 4 * way[1:], 5 + way[1:]]) * seconds / 6
        self.write("loop.csv", "t,x,y,z\n" + "".join(f"{t:.6f},{x:.9f},{y:.9f},{z:.9f}\n" for t, (x, y, z) in zip(times, places)))
        result = run(RUNTIME, "play", file, "--device", "script:loop.csv", "--fast", "--tool", f"sphere:{radius}", "--friction", "0", "--hand-over", "inf",
                     "--record", "loop.mcap", "--force", "--report", "loop.json", *options, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        ticks = palpate.read(self.folder / "loop.mcap")
        return ticks, json.loads((self.folder / "loop.json").read_text())

    def test_a_closed_loop_makes_no_energy(self):
        """What the hand gets back is what it gave, but for what the tick's linear body lags behind: .9 % were made when W was renewed after turns alone."""
        file = self.bake_liver()
        for options, seconds, most in (((), 6, 2e-3), (("--depth", "no"), 90, 1e-6)):  # sums over ticks are of second order in their length
            ticks, report = self.press_and_circle(file, 0.01, 0.004, seconds, *options)
            work = (0.5 * (ticks["force"][1:] + ticks["force"][:-1]) * numpy.diff(ticks["tool_position"], axis=0)).sum(1)
            with self.subTest(options=options):
                self.assertLess(abs(work.sum()), most * 0.5 * abs(work).sum())
                self.assertEqual(report["status_ticks"]["unbalanced"], 0)

    def test_tells_what_small_strain_would_have(self):
        """Against the same press by small strain, which touches nodes in other places: 5, 33 and 54 % more; told are 5, 46 and 71, on the demo's finer mesh 36 for 34 and 61 for 61."""
        file = self.bake_liver()
        for depth, least in ((0.004, 0.0), (0.015, 0.2), (0.025, 0.4)):
            self.write("press.csv", f"t,x,y,z\n0,0.155,0.0015,0.117\n1,0.155,{0.0035 + depth},0.117\n1.5,0.155,{0.0035 + depth},0.117\n")
            forces = {}
            for mode in ("yes", "no"):
                result = run(RUNTIME, "play", file, "--device", "script:press.csv", "--fast", "--tool", "sphere:0.02", "--friction", "0", "--depth", mode, "--report", "-", "--record", "press.mcap", "--force",
                             cwd=self.folder)
                self.assertEqual(result.returncode, 0, result.stderr)
                report = json.loads(result.stdout)
                forces[mode] = report["largest_force_N"]
                if mode == "yes":
                    told = report["depth"]["small_strain_at_largest_force"]
                    self.assertAlmostEqual(report["depth"]["last_small_strain"], told, delta=1e-6)
                    kept = palpate.read(self.folder / "press.mcap")["small_strain"]
                    self.assertAlmostEqual(kept[-1], told, delta=1e-6)
                    self.assertEqual(kept[0], 0)
                    self.assertIn(f"small strain has {100 * told:.3g} % more", result.stderr)
            right = forces["no"] / forces["yes"] - 1
            self.assertGreater(right, least)
            self.assertGreater(told, 0.9 * right)
            self.assertLess(told, 1.5 * right)

    def test_a_hand_too_fast_for_the_balance_is_told_by_how_much(self):
        """Against the same way in forty times the time, which nothing is told of."""
        file = self.bake_liver()
        slow, right = self.press_and_circle(file, 0.02, 0.01, 24)
        fast, report = self.press_and_circle(file, 0.02, 0.01, 0.6)
        told = numpy.array([int(status) for status in fast["status"]]) >> 14 & 1
        self.assertEqual((right["status_ticks"]["unbalanced"], report["status_ticks"]["unbalanced"]), (0, told.sum()))
        self.assertGreater(told.sum(), 100)
        error = numpy.linalg.norm(fast["force"] - slow["force"][::40], axis=1)
        largest = numpy.linalg.norm(slow["force"], axis=1).max()
        self.assertLess((error - fast["force_error"])[told == 1].max(), 0.02 * largest)
        self.assertLess(numpy.median((fast["force_error"] / error)[told == 1]), 6)
        self.assertLess(error[told == 0].max(), 0.06 * largest)
        numpy.testing.assert_array_equal(fast["force_error"][told == 0], 0)

    def test_a_rod_that_gives_way_does_not_lose_the_tool(self):
        """What a balance corrects moves the surface away from a tool at rest by more than the tool's own motion would. If the contact were not sought there, the rod
        would spring up to where it was at rest, and the tool be inside it. The mesh alone, whose edges are longer, looks that far anyway."""
        rod = TONGUE.replace("[0.08, 0.01, 0.01], cells = [16, 2, 2]", "[0.3, 0.006, 0.006], cells = [60, 2, 2]").replace("5.0e3", "1.0e6").replace("0.3\ndensity", "0.4\ndensity")
        file = self.bake(rod)
        self.write("press.csv", "t,x,y,z\n0,0.28,0.003,0.01\n0.27,0.28,0.003,0.004\n0.8,0.28,0.003,0.004\n")
        forces = []
        for overlay in ("auto", "no"):
            result = run(RUNTIME, "play", file, "--device", "script:press.csv", "--fast", "--tool", "sphere:0.003", "--friction", "0", "--overlay", overlay,
                         "--depth", "yes", "--report", "-", "--record", "press.mcap", "--force", cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(json.loads(result.stdout)["status_ticks"]["inside_body"], 0)
            forces.append(numpy.linalg.norm(palpate.read(self.folder / "press.mcap")["force"][-1]))
        self.assertAlmostEqual(forces[0], forces[1], delta=0.02 * forces[1])

    def test_a_small_ball_on_a_fine_liver(self):
        """Small strain is 9 to 16 % too stiff in this press by tet4 (docs/measurements/live.md#depth)."""
        file = self.bake_liver("tet4")
        reports = []
        for depth in ("yes", "no"):
            result = run(RUNTIME, "play", file, "--device", f"script:{MODELS / 'liver' / 'palpation.csv'}", "--fast", "--tool", "sphere:0.008", "--depth", depth,
                         "--report", "-", cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            reports.append(json.loads(result.stdout))
        deep, linear = reports
        self.assertEqual((deep["status_ticks"]["result_not_finite"], deep["status_ticks"]["not_converged"]), (0, 0))
        self.assertAlmostEqual(linear["largest_force_N"] / deep["largest_force_N"], 1.125, delta=0.035)


if __name__ == "__main__":
    unittest.main()
