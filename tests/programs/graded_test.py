"""play --overlay auto, the default, and graded: the force of a small tool on a coarse ball, against Hertz's contact, and replays."""

import csv
import json
import math
import unittest

import h5py
import numpy
from programs import RUNTIME, ProgramTest, done, palpate, run
from runtime_test import read_grid
from vtkmodules.util.numpy_support import vtk_to_numpy


def ball(levels, radius):
    """Points and triangles of an icosahedron whose triangles are cut into four, `levels` times, on a sphere."""
    golden = (1.0 + math.sqrt(5.0)) / 2.0
    points = [(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)]
    points += [(s, t * golden, 0) for s in (-1, 1) for t in (-1, 1)] + [(t * golden, 0, s) for s in (-1, 1) for t in (-1, 1)]
    near = [[j for j in range(12) if abs(math.dist(points[i], points[j]) - 2.0) < 1e-9] for i in range(12)]
    faces = [(i, j, k) for i in range(12) for j in near[i] for k in near[i] if i < j < k and k in near[j]]

    def turned(face):
        a, b, c = (points[i] for i in face)
        u, v = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        return face if sum(n * (x + y + z) for n, x, y, z in zip(normal, a, b, c)) > 0 else (face[0], face[2], face[1])

    faces = [turned(face) for face in faces]
    for _ in range(levels):
        middle = {}

        def between(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                middle[key] = len(points)
                points.append(tuple((x + y) / 2 for x, y in zip(points[a], points[b])))
            return middle[key]

        cut = []
        for a, b, c in faces:
            ab, bc, ca = between(a, b), between(b, c), between(c, a)
            cut += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = cut
        for i, p in enumerate(points):
            size = math.hypot(*p)
            points[i] = tuple(x / size for x in p)
    return [tuple(radius * x / math.hypot(*p) for x in p) for p in points], faces


class Ball(ProgramTest):
    """Radius 50 mm, edges of 15 mm, E 5 kPa, nu 0.45; a sphere of 10 mm slides over its top, 2 mm deep."""

    RADIUS, TOOL, DEPTH = 0.05, 0.01, 0.002

    def setUp(self):
        super().setUp()
        points, faces = ball(2, self.RADIUS)
        self.write("ball.off", f"OFF\n{len(points)} {len(faces)} 0\n" + "".join(f"{x:.9f} {y:.9f} {z:.9f}\n" for x, y, z in points)
                   + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces))
        self.files = {element: self.bake(
            f'name = "{element}"\n[geometry]\nsurface = "ball.off"\n[mesh]\nelement = "{element}"\n[material]\nyoungs_modulus = 5e3\n'
            'poissons_ratio = 0.45\n[[fixed]]\nlowest = {axis = "z", percent = 40}\n[storage]\nscope = "layers"\nlayers = 1\n',
            name=f"{element}.toml") for element in ("tet4", "tet10")}
        reach = self.RADIUS + self.TOOL - self.DEPTH
        places = [(0.3 + 0.02 * k, math.radians(20.0 * k / 60.0)) for k in range(61)]
        self.script = self.write("way.csv", f"t,x,y,z\n0,0,0,{reach + 0.004}\n" + "".join(
            f"{t:.3f},{reach * math.sin(angle):.9f},0,{reach * math.cos(angle):.9f}\n" for t, angle in places))
        stiffness = 5e3 / (1.0 - 0.45**2)
        self.hertz = 4.0 / 3.0 * stiffness * math.sqrt(1.0 / (1.0 / self.TOOL + 1.0 / self.RADIUS)) * self.DEPTH**1.5

    def play(self, element, script, *options):
        """The recording, and the size of the force by ticks."""
        recording = self.folder / "run.mcap"
        done(RUNTIME, "play", self.files[element], "--device", f"script:{script}", "--tool", f"sphere:{self.TOOL}", "--friction", "0",
                     "--fast", "--record", recording, "--report", self.folder / "report.json", "--force", *options)
        done(RUNTIME, "export", recording, "--csv", self.folder / "run.csv", "--force")
        with open(self.folder / "run.csv", newline="") as table:
            return recording, [(float(row["time"]), math.hypot(*(float(row["force_" + axis]) for axis in "xyz"))) for row in csv.DictReader(table)]

    def slide(self, element, *options):
        """The mean force of the slide over Hertz's, its ripple and largest change in a tick over the mean, and the report."""
        recording, force = self.play(element, self.script, *options)
        force = [f for t, f in force if t > 0.5]
        mean = sum(force) / len(force)
        ripple = math.sqrt(sum((f - mean)**2 for f in force) / len(force)) / mean
        done(RUNTIME, "play", self.files[element], "--device", f"replay:{recording}", "--fast")  # fails unless the same
        return mean / self.hertz, ripple, max(abs(b - a) for a, b in zip(force, force[1:])) / mean, json.loads((self.folder / "report.json").read_text())

    def test_the_force_is_the_bodys_whatever_the_mesh(self):
        for element, of_mesh in (("tet4", 2.5), ("tet10", 1.3)):
            mean, ripple, change, report = self.slide(element)
            self.assertLess(abs(mean / 0.98 - 1.0), 0.03)  # the whole ball gives way too
            self.assertLess(ripple, 0.015)  # and what the ball gives way less near what is held
            self.assertLess(change, 0.003)
            self.assertNotIn("overlay", report)
            self.assertLess(report["surface"]["last_strain"], 0.5)  # of the mesh's triangles, not of the dent's
            self.assertLess(report["surface"]["last_rotation_deg"], 45)
            self.assertGreater(self.slide(element, "--overlay", "no")[0], of_mesh)

    def test_an_own_loop_feels_the_same(self):
        path = [(0.0, 0.0, 0.062 - 0.0001 * k) for k in range(50)]
        script = self.write("loop.csv", "t,x,y,z\n" + "".join(f"{0.001 * k:.3f},{x},{y},{z:.6f}\n" for k, (x, y, z) in enumerate(path)))
        recording, _ = self.play("tet4", script, "--depth", "no")
        played = palpate.read(recording)
        with palpate.Session(self.files["tet4"], palpate.Tool(radius=self.TOOL, friction=0, reach=1.0), max_contacts=256,
                             overlay=palpate.Overlay(refinement=0)) as session:
            felt = numpy.array([session.step(place).force for place in path])
        numpy.testing.assert_allclose(-felt[-1], played["force"][len(path) - 1], rtol=1e-6, atol=1e-9)
        self.assertGreater(felt[-1][2], 0.01)

    def test_a_graded_mesh_has_the_same(self):
        mean, ripple, _, report = self.slide("tet10", "--overlay", "graded")
        self.assertLess(abs(mean / 0.98 - 1.0), 0.05)
        self.assertLess(ripple, 0.03)
        self.assertTrue(report["overlay"]["graded"])
        self.assertGreater(report["overlay"]["switches"], 3)
        self.assertEqual(report["overlay"]["failed"], 0)

    def test_it_is_not_lost_however_deep(self):
        script = self.write("deep.csv", "t,x,y,z\n0,0,0,0.061\n1.6,0,0,0.0405\n1.8,0,0,0.0405\n")  # 20 mm
        force = [f for t, f in self.play("tet4", script)[1] if t > 0.2]
        self.assertGreater(min(force), 0)
        self.assertGreater(force[-1], 5 * self.hertz)

    def test_pictures_show_the_dent(self):
        recording, _ = self.play("tet4", self.script)
        done(RUNTIME, "play", self.files["tet4"], "--device", f"script:{self.script}", "--tool", f"sphere:{self.TOOL}", "--friction", "0", "--fast",
                     "--surface", self.folder / "last.vtu")
        done(RUNTIME, "export", recording, "--hdf5", self.folder / "run.h5")
        with h5py.File(self.folder / "run.h5") as file:
            nodes, moved = file["/surface/nodes"][...], file["/frames/displacement"][-1]
        grid = read_grid(self.folder / "last.vtu")
        fine, of_fine = vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
        self.assertGreater(len(fine), 20 * len(nodes))
        deepest = numpy.linalg.norm(of_fine, axis=1).max()
        self.assertLess(abs(deepest / self.DEPTH - 1.0), 0.1)
        places = numpy.linalg.norm(fine[None, :, :] - nodes[:, None, :], axis=2).argmin(axis=1)
        numpy.testing.assert_allclose(fine[places], nodes, atol=1e-9)
        numpy.testing.assert_allclose(of_fine[places], moved, atol=0.03 * deepest)  # pictures are of the tick before

    def test_a_large_tool_needs_none(self):
        done(RUNTIME, "play", self.files["tet10"], "--device", f"script:{self.script}", "--tool", "sphere:0.06", "--fast", "--overlay", "graded",
                     "--report", self.folder / "report.json")
        self.assertNotIn("overlay", json.loads((self.folder / "report.json").read_text()))

    def test_what_it_cannot_go_with_is_refused(self):
        for options, word in ((("--overlay-law", "neo-hookean"), "linear"), (("--depth", "yes"), "--depth"), (("--solver", "corotational"), "--solver")):
            result = run(RUNTIME, "play", self.files["tet10"], "--device", f"script:{self.script}", "--fast", "--tool", "sphere:0.01", "--overlay", "graded",
                         *options)
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn(word, result.stderr)
        for name in ("auto", "graded"):
            result = run(RUNTIME, "probe", self.files["tet10"], "--at", "0,0,0.05", "--displace", "0,0,-0.001", "--overlay", name)
            self.assertEqual(result.returncode, 1)
            self.assertIn("radius", result.stderr)


if __name__ == "__main__":
    unittest.main()


class Edge(ProgramTest):
    """A block (60 x 60 x 30 mm, E 5 kPa, nu 0.45) with edges of 6 mm, pressed by a sphere of 5 mm, 1 mm deep, beside an edge and a corner of its top."""

    # Distance from the edge x = 60 mm, and y, in mm, and the force in mN of a mesh whose nodes are 0.5 mm apart there (scripts/studies/edges; with nodes 0.35 mm
    # apart it is 0.2 % less).
    PLACES = [(5.0, 31.3, 16.23), (2.5, 31.3, 13.56), (1.0, 31.3, 10.90), (0.5, 31.3, 9.80), (0.0, 31.3, 8.54), (2.5, 57.5, 9.75), (0.5, 59.5, 5.31), (28.7, 31.3, 19.29)]

    def block(self, element, cells):
        return self.bake(f'name = "block"\n[geometry]\nbox = {{size = [0.06, 0.06, 0.03], cells = [{cells}, {cells}, {cells // 2}]}}\n[mesh]\nelement = "{element}"\n'
                         '[material]\nyoungs_modulus = 5e3\npoissons_ratio = 0.45\n[[fixed]]\nhalf_space = {point = [0, 0, 0], normal = [0, 0, -1]}\n'
                         '[storage]\nscope = "surface"\n', name=f"{element}.toml")

    def press(self, element, cells):
        """Force over the fine mesh's at each place."""
        body = self.block(element, cells)
        rows, t, ends = ["t,x,y,z"], 0.0, []
        for distance, y, _ in self.PLACES:
            for z, pause in ((0.037, 0.01), (0.0352, 0.02), (0.034, 0.04), (0.034, 0.1), (0.037, 0.02)):
                t += pause
                rows.append(f"{t:.3f},{0.06 - 1e-3 * distance},{1e-3 * y},{z}")
            ends.append(t - 0.022)
        script = self.write("touch.csv", "\n".join(rows) + "\n")
        done(RUNTIME, "play", body, "--device", f"script:{script}", "--tool", "sphere:0.005", "--friction", "0", "--depth", "no", "--fast", "--max-contacts", "256",
                     "--record", self.folder / "run.mcap", "--force")
        ticks = palpate.read(self.folder / "run.mcap")
        return [-1e3 * numpy.interp(end, ticks["time"], ticks["force"][:, 2]) / force for end, (_, _, force) in zip(ends, self.PLACES)]

    def test_the_force_is_the_bodys_beside_edges_and_corners(self):
        for element, cells, error in (("tet4", 10, 0.07), ("tet10", 5, 0.04)):
            for place, ratio in zip(self.PLACES, self.press(element, cells)):
                self.assertLess(abs(ratio - 1.0), error, (element, place))  # 0.1 to 1.5 without images

    def test_a_capsule_feels_the_body(self):
        lying = "0.70710678,0,0.70710678,0"  # along x
        script = self.write("lie.csv", "t,x,y,z,qw,qx,qy,qz\n" + "".join(
            f"{t},0.0273,0.0313,{0.03 + z},{lying}\n" for t, z in ((0, 0.006), (0.02, 0.0042), (0.1, 0.003), (0.2, 0.003))))
        for element, cells in (("tet4", 10), ("tet10", 5)):
            done(RUNTIME, "play", self.block(element, cells), "--device", f"script:{script}", "--tool", "capsule:0.004,0.008", "--friction", "0", "--depth", "no", "--fast",
                         "--record", self.folder / "run.mcap", "--report", self.folder / "report.json", "--force")
            force = -1e3 * palpate.read(self.folder / "run.mcap")["force"][-1][2]
            self.assertLess(abs(force / 40.68 - 1.0), 0.03, element)  # a mesh with nodes every 0.4 mm (docs/measurements/overlays.md); its own mesh has 3.5 times that
            self.assertEqual(json.loads((self.folder / "report.json").read_text())["status_ticks"]["capacity_full"], 0)
