"""A surface is enough: palpate-precompute organ.off, palpate-precompute new, palpate-runtime push."""

import math
import os
import re
import shutil
import signal
import subprocess
import unittest

import numpy as np
from programs import PATIENCE, PRECOMPUTE, RUNTIME, ProgramTest, run

# Box of 100 x 100 x 100; the lid is the last two triangles.
CORNERS = [(100 * (k & 1), 100 * (k >> 1 & 1), 100 * (k >> 2 & 1)) for k in range(8)]
TRIANGLES = [(0, 2, 1), (1, 2, 3), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5), (4, 5, 6), (5, 7, 6)]


def off(corners=CORNERS, triangles=TRIANGLES):
    lines = ["OFF", f"{len(corners)} {len(triangles)} 0"]
    lines += [" ".join(map(str, corner)) for corner in corners] + [f"3 {a} {b} {c}" for a, b, c in triangles]
    return "\n".join(lines) + "\n"


class Bodies(ProgramTest):
    def baked(self, name, *arguments):
        """What the program told; the file stands beside."""
        result = run(PRECOMPUTE, name, "--surface-nodes", "300", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr

    def test_open_box_has_the_force_of_a_closed_one(self):
        self.write("open.off", off(triangles=TRIANGLES[:10]))
        told = self.baked("open.off")
        for piece in ("a hole was filled", "unit: mm", "10 cm", "300 surface nodes", "E = 5000 Pa", "open.model.toml"):
            self.assertIn(piece, told)
        description = (self.folder / "open.model.toml").read_text()
        self.assertIn('surface = "open.repaired.off"', description)
        self.assertIn("scale = 0.001", description)
        # The second route: the box by its measures, of regular cells, with nothing read or repaired.
        self.bake("""name = "box"
[geometry]
box = {size = [0.1, 0.1, 0.1], cells = [8, 8, 8]}
[material]
youngs_modulus = 5000
poissons_ratio = 0.45
[[fixed]]
lowest = {axis = "z", percent = 10}
[storage]
scope = "surface"
""", name="box.toml")
        result = run(PRECOMPUTE, "compare", "open.palpate.hdf", "box.palpate.hdf", "--radius", "0.03", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        median = float(re.search(r"^force +differs by (\S+) % \(median\)", result.stdout, re.MULTILINE)[1])
        self.assertLess(median, 10.0, result.stdout)

    def test_force_follows_the_unit(self):
        # Displaced in proportion, a body s times as large takes s^2 times the force: stress is the same, area is not.
        self.write("box.off", off())
        forces = []
        for unit, scale in (("mm", 1e-3), ("cm", 1e-2)):
            self.baked("box.off", "--unit", unit, "--renew", "-o", unit + ".palpate.hdf")
            answer = self.probe(self.folder / (unit + ".palpate.hdf"), "--at", f"{50 * scale},{50 * scale},{100 * scale}", "--displace", f"0,0,{-5 * scale}")
            forces.append(answer["nodes"][0]["force"][2])
        self.assertLess(forces[0], 0.0)
        np.testing.assert_allclose(forces[1], 100.0 * forces[0], rtol=1e-3)  # three digits of edge_length

    def test_what_it_wrote_is_the_persons(self):
        self.write("box.off", off())
        self.baked("box.off")
        description = self.folder / "box.model.toml"
        description.write_text(description.read_text().replace("youngs_modulus = 5000", "youngs_modulus = 9000"))
        result = run(PRECOMPUTE, "box.off", cwd=self.folder)
        self.assertIn("box.model.toml is there and is used as it is", result.stderr)
        self.assertIn("E = 9000 Pa", run(PRECOMPUTE, "inspect", "box.palpate.hdf", cwd=self.folder).stdout)
        self.assert_refused(run(PRECOMPUTE, "box.off", "--unit", "mm", cwd=self.folder), "is there already", "--renew")

    def test_a_description_of_another_file_is_not_used_for_this_one(self):
        self.write("box.off", off())
        self.baked("box.off")
        before = (self.folder / "box.model.toml").read_bytes()
        self.write("box.obj", "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in TRIANGLES))
        self.assert_refused(run(PRECOMPUTE, "box.obj", cwd=self.folder), "box.model.toml", "was not made from box.obj", "--renew writes it anew from box.obj")
        pushed = run(RUNTIME, "push", "box.obj", cwd=self.folder)
        self.assertEqual(pushed.returncode, 1)
        self.assertIn("was not made from box.obj", pushed.stderr)
        self.assertEqual((self.folder / "box.model.toml").read_bytes(), before)
        self.baked("box.obj", "--renew")
        self.assertIn('surface = "box.obj"', (self.folder / "box.model.toml").read_text())
        # a surface that was repaired is the same one
        self.write("open.off", off(triangles=TRIANGLES[:10]))
        self.baked("open.off")
        self.assertEqual(run(PRECOMPUTE, "open.off", "--dry-run", cwd=self.folder).returncode, 0)

    def test_a_folder_that_may_only_be_read_has_its_description_beside_the_output(self):
        if os.geteuid() == 0 and not shutil.which("setpriv"):
            self.skipTest("setpriv is not installed")
        there, here = self.folder / "there", self.folder / "here"
        there.mkdir()
        here.mkdir()
        (there / "open.off").write_text(off(triangles=TRIANGLES[:10]))
        there.chmod(0o555)
        self.addCleanup(there.chmod, 0o755)
        for folder in (self.folder, here):
            folder.chmod(0o777)
        command = [PRECOMPUTE, "../there/open.off", "--surface-nodes", "300", "-o", "out.hdf"]
        if os.geteuid() == 0:
            command = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups", *command]
        result = run(*command, cwd=here)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual({file.name for file in here.iterdir()}, {"open.model.toml", "open.repaired.off", "out.hdf"})

    def test_elements_are_those_that_are_asked_for(self):
        self.write("box.off", off())
        counts = []
        for element in ("tet4a", "tet10"):
            told = self.baked("box.off", "--element", element, "--renew", "--dry-run")
            self.assertIn(f"elements ({element})", told)
            counts.append(int(re.search(r"(\d+) stored dofs", told)[1]))
        self.assertTrue(0.5 < counts[1] / counts[0] < 2.0, counts)  # not four times as many

    def test_done_is_not_done_again(self):
        self.write("box.off", off())
        self.baked("box.off")
        before = (self.folder / "box.palpate.hdf").stat().st_mtime_ns
        again = run(PRECOMPUTE, "box.off", "--unless-done", cwd=self.folder)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertIn("nothing that it was made from has changed", again.stderr)
        self.assertEqual((self.folder / "box.palpate.hdf").stat().st_mtime_ns, before)
        description = self.folder / "box.model.toml"
        description.write_text(description.read_text().replace("5000", "6000"))
        run(PRECOMPUTE, "box.off", "--unless-done", cwd=self.folder)
        self.assertNotEqual((self.folder / "box.palpate.hdf").stat().st_mtime_ns, before)

    def test_strict(self):
        self.write("open.off", off(triangles=TRIANGLES[:11]))
        self.assert_refused(run(PRECOMPUTE, "open.off", "--strict", cwd=self.folder), "is open", "1 hole(s)")
        self.assertEqual(os.listdir(self.folder), ["open.off"])

    def test_thin_walls_are_wrapped(self):
        # Half a pipe with a wall of 0.1 and a radius of 20: chords of the edge length, some 4, go through the other side of the wall.
        steps, corners, triangles = 64, [], []
        for step in range(steps + 1):
            turn = math.pi * step / steps
            for radius in (20.0, 20.1):
                corners += [(radius * math.cos(turn), radius * math.sin(turn), z) for z in (0, 40)]
        def side(a, b, c, d):
            triangles.extend([(a, b, c), (a, c, d)])
        for k in range(0, 4 * steps, 4):
            side(k, k + 1, k + 5, k + 4)          # inner
            side(k + 2, k + 6, k + 7, k + 3)      # outer
            side(k, k + 4, k + 6, k + 2)          # z = 0
            side(k + 1, k + 3, k + 7, k + 5)      # z = 40
        side(0, 2, 3, 1)
        side(4 * steps, 4 * steps + 1, 4 * steps + 3, 4 * steps + 2)
        self.write("pipe.off", off(corners, triangles))
        told = self.baked("pipe.off")
        self.assertNotIn("turned", told)
        self.assertIn("as with the edge length of the mesh it intersects itself, it was wrapped", told)
        self.assertIn("pipe.repaired.off", (self.folder / "pipe.model.toml").read_text())

    def test_options_are_for_surfaces(self):
        self.write("model.toml", "")
        result = run(PRECOMPUTE, "model.toml", "--strict", cwd=self.folder)
        self.assertEqual(result.returncode, 2)
        self.assertIn("they are for a surface, an image or a picture", result.stderr)
        self.write("box.off", off())
        result = run(PRECOMPUTE, "box.off", "--unit", "miles", cwd=self.folder)
        self.assertEqual(result.returncode, 2)
        self.assertIn("'miles' is none of m|cm|mm|um|in|METRES", result.stderr)

    def test_missing_and_damaged_files(self):
        self.assert_refused(run(PRECOMPUTE, "none.stl", cwd=self.folder), "none.stl", "No such file")
        self.write("bad.ply", "this is no surface\n")
        self.assert_refused(run(PRECOMPUTE, "bad.ply", cwd=self.folder), "bad.ply:1", "where ply should be")


class Questions(ProgramTest):
    def test_answers_from_a_pipe(self):
        self.write("box.off", off())
        answers = "box.off\nliver\n\n\n0.4\ny\n\n300\n"
        result = run(PRECOMPUTE, "new", cwd=self.folder, input=answers)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("next: palpate-precompute box.model.toml", result.stderr)
        result = run(PRECOMPUTE, "box.model.toml", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("nu = 0.4,", run(PRECOMPUTE, "inspect", "liver.palpate.hdf", cwd=self.folder).stdout)

    def test_too_few_answers(self):
        self.write("box.off", off())
        self.assert_refused(run(PRECOMPUTE, "new", "box.off", cwd=self.folder, input="liver\n"), "the answers ended before", "Unit of the file")


class Push(ProgramTest):
    def push(self, *arguments, path=None):
        environment = dict(os.environ) if path is None else dict(os.environ, PATH=path)
        return run(RUNTIME, "push", *arguments, "--view-address", "0", "--duration", "0.2", cwd=self.folder, env=environment)

    def test_surface_to_page_and_again(self):
        self.write("open.off", off(triangles=TRIANGLES[:10]))
        first = self.push("open.off", "--surface-nodes", "300")
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertIn("a hole was filled", first.stderr)
        self.assertRegex(first.stderr, r"open http://127\.0\.0\.1:\d+/\?token=\w+ in a browser")
        again = self.push("open.off")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertIn("nothing that it was made from has changed", again.stderr)
        self.assertIn("in a browser", again.stderr)
        described, baked = self.push("open.model.toml"), self.push("open.palpate.hdf")
        self.assertIn("in a browser", described.stderr)
        self.assertIn("in a browser", baked.stderr)
        self.assertNotIn("nothing that it was made from", baked.stderr)

    def test_errors_of_precompute_are_told_once(self):
        self.write("open.off", off(triangles=TRIANGLES[:10]))
        self.assert_refused(self.push("open.off", "--strict"), "is open")
        self.assert_refused(self.push("none.off"), "none.off", "No such file")

    def test_usage(self):
        result = self.push("box.palpate.hdf", "--unit", "mm")
        self.assertEqual(result.returncode, 2)
        self.assertIn("is for what is precomputed first", result.stderr)
        result = run(RUNTIME, "organ.stl")
        self.assertEqual(result.returncode, 2)
        self.assertIn("palpate-runtime push organ.stl", result.stderr)

    def test_without_precompute(self):
        alone = self.folder / "alone" / "palpate-runtime"
        alone.parent.mkdir()
        alone.write_bytes(RUNTIME.read_bytes())
        alone.chmod(0o755)
        self.write("box.off", off())
        result = run(alone, "push", "box.off", cwd=self.folder, env=dict(os.environ, PATH="/nowhere"))
        self.assert_refused(result, "palpate-precompute is neither beside this program nor on the PATH")

    def test_interrupted_while_it_is_precomputed(self):
        self.write("box.off", off())
        with subprocess.Popen([RUNTIME, "push", "box.off", "--surface-nodes", "20000"], cwd=self.folder, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
            told = ""
            while "reading the surface" not in told:
                line = process.stderr.readline()
                self.assertTrue(line, told)
                told += line
            os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does
            process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 130)


if __name__ == "__main__":
    unittest.main()
