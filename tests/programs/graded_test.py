"""play --overlay auto: the force of a small tool on a coarse ball, against Hertz's contact, and its replay."""

import csv
import json
import math
import unittest

from programs import RUNTIME, ProgramTest, done, run


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
        self.file = self.bake(
            'name = "model"\n[geometry]\nsurface = "ball.off"\n[mesh]\nelement = "tet10"\n[material]\nyoungs_modulus = 5e3\n'
            'poissons_ratio = 0.45\n[[fixed]]\nlowest = {axis = "z", percent = 40}\n[storage]\nscope = "layers"\nlayers = 1\n')
        reach = self.RADIUS + self.TOOL - self.DEPTH
        places = [(0.3 + 0.02 * k, math.radians(20.0 * k / 60.0)) for k in range(61)]
        self.script = self.write("way.csv", f"t,x,y,z\n0,0,0,{reach + 0.004}\n" + "".join(
            f"{t:.3f},{reach * math.sin(angle):.9f},0,{reach * math.cos(angle):.9f}\n" for t, angle in places))

    def slide(self, *options):
        recording = self.folder / "slide.mcap"
        done(RUNTIME, "play", self.file, "--device", f"script:{self.script}", "--tool", f"sphere:{self.TOOL}", "--friction", "0",
                     "--fast", "--record", recording, "--record-frames", "0", "--report", self.folder / "report.json", "--force", *options)
        done(RUNTIME, "export", recording, "--csv", self.folder / "slide.csv", "--force")
        with open(self.folder / "slide.csv", newline="") as table:
            rows = [row for row in csv.DictReader(table) if float(row["time"]) > 0.5]
        return recording, [math.hypot(*(float(row["force_" + axis]) for axis in "xyz")) for row in rows]

    def test_the_force_is_the_bodys(self):
        stiffness = 5e3 / (1.0 - 0.45**2)
        hertz = 4.0 / 3.0 * stiffness * math.sqrt(1.0 / (1.0 / self.TOOL + 1.0 / self.RADIUS)) * self.DEPTH**1.5
        mean = {}
        for option in ((), ("--overlay", "auto")):
            recording, force = self.slide(*option)
            mean[option] = sum(force) / len(force)
            ripple = math.sqrt(sum((f - mean[option])**2 for f in force) / len(force)) / mean[option]
            if option:
                self.assertLess(abs(mean[option] / hertz - 1.0), 0.08)  # the whole ball gives way too
                self.assertLess(ripple, 0.03)
                report = json.loads((self.folder / "report.json").read_text())
                self.assertTrue(report["overlay"]["auto"])
                self.assertGreater(report["overlay"]["switches"], 3)
                self.assertEqual(report["overlay"]["failed"], 0)
                done(RUNTIME, "play", self.file, "--device", f"replay:{recording}", "--fast")  # fails unless the same
            else:
                self.assertGreater(mean[option] / hertz, 1.3)  # that of the mesh

    def test_a_large_tool_needs_none(self):
        done(RUNTIME, "play", self.file, "--device", f"script:{self.script}", "--tool", "sphere:0.06", "--fast", "--overlay", "auto",
                     "--report", self.folder / "report.json")
        self.assertNotIn("overlay", json.loads((self.folder / "report.json").read_text()))

    def test_what_it_cannot_go_with_is_refused(self):
        for options, word in ((("--overlay-law", "neo-hookean"), "linear"), (("--warp", "yes"), "--warp"), (("--solver", "corotational"), "--solver")):
            result = run(RUNTIME, "play", self.file, "--device", f"script:{self.script}", "--fast", "--tool", "sphere:0.01", "--overlay", "auto", *options)
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn(word, result.stderr)
        result = run(RUNTIME, "probe", self.file, "--at", "0,0,0.05", "--displace", "0,0,-0.001", "--overlay", "auto")
        self.assertEqual(result.returncode, 1)
        self.assertIn("radius", result.stderr)


if __name__ == "__main__":
    unittest.main()
