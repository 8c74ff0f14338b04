"""Bodies that turn far on the fast path, through palpate-runtime play --warp yes."""

import json
import math
import signal
import subprocess
import unittest

import h5py
import numpy

from programs import MODELS, PRECOMPUTE, RUNTIME, ProgramTest, palpate, run

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


class Warp(ProgramTest):
    def play(self, file, degrees, *arguments, seconds=1.0, radius=RADIUS):
        path = self.write("bend.csv", bend(degrees, seconds))
        result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", "--tool", f"sphere:{radius}", "--report", "-", "--record", "bend.mcap", "--force",
                     *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        recording = palpate.read(self.folder / "bend.mcap")
        return numpy.linalg.norm(recording["force"], axis=1), json.loads(result.stdout), result.stderr

    def test_it_feels_like_the_corotational_body_where_small_strain_does_not(self):
        file = self.bake(TONGUE)
        warped, report, said = self.play(file, 60, "--warp", "yes")
        live, _, _ = self.play(file, 60, "--solver", "corotational", "--mass-damping", "20")
        linear, of_linear, _ = self.play(file, 60)
        print(f"at the end: corotational {live[-1]:.5f} N, warped {warped[-1] / live[-1] - 1:+.2%}, linear {linear[-1] / live[-1] - 1:+.2%}")
        self.assertAlmostEqual(warped[-1] / live[-1], 1.0, delta=0.05)
        self.assertGreater(abs(linear[-1] / live[-1] - 1.0), 0.2)
        self.assertEqual(report["dynamics"], {"method": "none", "contact": "quasi-static", "steps": report["dynamics"]["steps"], "longest_step_s": report["dynamics"]["longest_step_s"]})
        self.assertGreater(report["warp"]["largest_rotation_deg"], 30)
        self.assertLess(report["warp"]["last_residual"], 1e-3)
        self.assertAlmostEqual(report["surface"]["studied_rotation_deg"], 90)
        self.assertAlmostEqual(of_linear["surface"]["studied_rotation_deg"], 19)
        self.assertGreater(of_linear["surface"]["last_rotation_deg"], 19)
        self.assertNotIn("warp", of_linear)
        self.assertIn("warp: the surface turned", said)

    def test_the_range_is_that_of_the_body_where_it_was_bent(self):
        file = self.bake(TONGUE + "[warp]\nlevels = 6\nangle = 80\n")
        inspected = run(PRECOMPUTE, "inspect", file)
        self.assertRegex(inspected.stdout, r"warping +forces within 5 % up to \d\d degrees by small strain, 80 warped \(studied to 80\)")
        with h5py.File(file) as model:
            rotation, linear = model["/warp/rotation"][:], model["/warp/linear"][:, 0]
            self.assertLess(abs(model["/warp/warped"][:, 0]).max(), 0.05)
            last = int((abs(linear) > 0.05).argmax())  # the first level beyond
            before = (rotation[last - 1], abs(linear[last - 1])) if last else (0.0, 0.0)
        expected = before[0] + (0.05 - before[1]) / (abs(linear[last]) - before[1]) * (rotation[last] - before[0])
        _, of_linear, _ = self.play(file, 10, seconds=0.1)
        _, of_warped, _ = self.play(file, 10, "--warp", "yes", seconds=0.1)
        self.assertAlmostEqual(of_linear["surface"]["studied_rotation_deg"], math.degrees(expected), places=3)
        self.assertNotAlmostEqual(of_linear["surface"]["studied_rotation_deg"], 19.0, places=3)  # what holds without
        self.assertAlmostEqual(of_warped["surface"]["studied_rotation_deg"], math.degrees(rotation[-1]), places=3)
        verified = run(PRECOMPUTE, "verify", file)
        self.assertEqual(verified.returncode, 0, verified.stdout + verified.stderr)
        self.assertRegex(verified.stdout, r"warping +ok")

    def test_a_study_that_is_interrupted_writes_nothing(self):
        model = self.write("model.toml", TONGUE.replace("[16, 2, 2]", "[32, 4, 4]") + "[warp]\nlevels = 200\n")
        with subprocess.Popen([PRECOMPUTE, model, "-o", "x.palpate.hdf"], cwd=self.folder, stderr=subprocess.PIPE, text=True) as process:
            said = ""
            while "bending the body" not in said:
                line = process.stderr.readline()
                self.assertNotEqual(line, "", said)
                said += line
            process.send_signal(signal.SIGINT)
            said += process.stderr.read()
        self.assertNotEqual(process.returncode, 0)
        self.assertIn("interrupted: nothing was written", said)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["model.toml"])

    def test_a_table_of_mistakes_is_refused_by_key(self):
        for lines, words in (("angle = 170", "at most 150"), ("angel = 20", "angle"), ("levels = 0", "levels"), ("direction = [0, 0, 0]", "zero vector"),
                             ('lowest = { axis = "x", percent = 1 }', "no node of the surface that is free")):
            model = self.write("model.toml", TONGUE + f"[warp]\n{lines}\n")
            result = run(PRECOMPUTE, model, cwd=self.folder)
            self.assertNotEqual(result.returncode, 0, lines)
            self.assertIn(words, result.stderr)
            self.assertIn("model.toml", result.stderr)

    def test_compressed_bodies_are_warped_too(self):
        plain = self.bake(TONGUE)
        of_plain, _, _ = self.play(plain, 40, "--warp", "yes", seconds=0.3)
        plain.unlink()
        compressed = self.bake(TONGUE.replace('precision = "double"', 'compression = "h2"\ntolerance = 1e-3'))
        of_compressed, report, _ = self.play(compressed, 40, "--warp", "yes", seconds=0.3)
        self.assertLess(report["warp"]["last_residual"], 1e-3)
        self.assertGreater(of_plain[-1], 0)
        self.assertAlmostEqual(of_compressed[-1] / of_plain[-1], 1.0, delta=1e-4)
        deep = self.bake(TONGUE.replace('scope = "surface"\nprecision = "double"', 'scope = "layers"\ncompression = "h2"'))
        refused = run(RUNTIME, "play", deep, "--device", f"script:{self.folder / 'bend.csv'}", "--fast", "--warp", "yes", cwd=self.folder)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("nodes below the surface", refused.stderr)
        self.assertIn('scope = "surface"', refused.stderr)

    def test_without_it_nothing_is_another(self):
        file = self.bake(TONGUE)
        plain, _, _ = self.play(file, 20, seconds=0.2)
        off, _, _ = self.play(file, 20, "--warp", "no", seconds=0.2)
        self.assertGreater(plain[-1], 0)
        numpy.testing.assert_array_equal(plain, off)

    def test_runs_are_equal_and_replay(self):
        file = self.bake(TONGUE)
        one, _, _ = self.play(file, 40, "--warp", "yes", seconds=0.2)
        self.write("keep.mcap", "")
        (self.folder / "bend.mcap").rename(self.folder / "keep.mcap")
        other, _, _ = self.play(file, 40, "--warp", "yes", seconds=0.2)
        self.assertGreater(one[-1], 0)
        numpy.testing.assert_array_equal(one, other)
        result = run(RUNTIME, "play", file, "--device", "replay:keep.mcap", "--fast", "--report", "-", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(result.stdout)["replay"]["different_ticks"], 0)

    def test_what_does_not_go_with_it_is_refused(self):
        file = self.bake(TONGUE)
        path = self.write("bend.csv", bend(20, 0.1))
        for arguments, words in ((("--solver", "corotational"), "a live solver turns by itself"), (("--contact", "dynamic"), "has no inertia"),
                                 (("--overlay", "r=2,rings=1"), "overlays are of the body at rest")):
            result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", "--warp", "yes", *arguments, cwd=self.folder)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(words, result.stderr)
            self.assertIn("--warp", result.stderr)

    def test_a_small_ball_on_a_fine_liver(self):
        """A dent turns the surface under it alone: with a compliance that is not positive the tick met forces of 1e25 here."""
        image = MODELS / "liver" / "liver.inr.gz"
        if not image.exists():
            self.skipTest("the liver's image is not there: scripts/demo gets it")
        text = (MODELS / "liver" / "model.toml").read_text().replace("edge_length = 0.0055", "edge_length = 0.0085").replace('"layers"\nlayers = 2', '"surface"')
        file = self.bake(text.replace('"liver.inr.gz"', f'"{image}"'))
        reports = []
        for warp in ("yes", "no"):
            result = run(RUNTIME, "play", file, "--device", f"script:{MODELS / 'liver' / 'palpation.csv'}", "--fast", "--tool", "sphere:0.008", "--warp", warp,
                         "--report", "-", cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            reports.append(json.loads(result.stdout))
        warped, linear = reports
        self.assertEqual((warped["status_ticks"]["result_not_finite"], warped["status_ticks"]["not_converged"]), (0, 0))
        self.assertAlmostEqual(warped["largest_force_N"] / linear["largest_force_N"], 1.0, delta=0.1)


if __name__ == "__main__":
    unittest.main()
