"""The reference figures of theory.md section 4 (plain meshes), through both programs."""

import csv
import unittest

from programs import RUNTIME, ProgramTest, cube_toml, run


class CubeFigures(ProgramTest):
    # Cube [0,1]^3, E = 1, nu = 0.3, bottom clamped, node (1/2, 1/2, 1) displaced by 1 in z with x and y held: reaction f_z.
    def check(self, cells, expected):
        answer = self.probe(self.bake(cube_toml(cells)), "--at", "0.5,0.5,1", "--displace", "0,0,1")
        force = answer["nodes"][0]["force"][2]
        self.assertAlmostEqual(force / expected, 1.0, delta=5e-9)  # the figures have ten digits; 8 are asked for

    def test_m6(self):
        self.check(6, 0.1839038973)

    def test_m12(self):
        self.check(12, 0.0914674267)

    def test_m18(self):
        self.check(18, 0.0608664565)

    def test_single_precision_is_as_good_as_its_rounding(self):
        file = self.bake(cube_toml(6, precision="single"))
        force = self.probe(file, "--at", "0.5,0.5,1", "--displace", "0,0,1")["nodes"][0]["force"][2]
        self.assertAlmostEqual(force / 0.1839038973, 1.0, delta=1e-6)
        self.assertNotAlmostEqual(force / 0.1839038973, 1.0, delta=1e-12)


class Overlay(ProgramTest):
    # The same with an overlay round the node: refinement, rings, f_z.
    FIGURES = ((2, 1, 0.0980064767), (2, 2, 0.0929944072), (3, 1, 0.0646587483), (3, 2, 0.0617094660))
    TOUCH = ("--at", "0.5,0.5,1", "--displace", "0,0,1")

    def bake_cube(self, layers):
        return self.bake(cube_toml(6, scope="layers").replace('scope = "layers"', f'scope = "layers"\nlayers = {layers}'))

    def test_figures(self):
        file = self.bake_cube(2)
        for refinement, rings, expected in self.FIGURES:
            answer = self.probe(file, *self.TOUCH, "--overlay", f"r={refinement},rings={rings}")
            self.assertAlmostEqual(answer["nodes"][0]["force"][2] / expected, 1.0, delta=5e-9)

    def test_field_has_the_displacement_that_was_prescribed(self):
        file, field = self.bake_cube(2), self.folder / "field.csv"
        answer = self.probe(file, *self.TOUCH, "--overlay", "r=3,rings=2", "--field", field)
        with open(field) as rows:
            found = [row for row in csv.DictReader(rows) if int(row["node"]) == answer["nodes"][0]["node"]]
        self.assertEqual(len(found), 1)
        for axis, expected in zip(("ux", "uy", "uz"), (0, 0, 1)):
            self.assertAlmostEqual(float(found[0][axis]), expected, delta=1e-12)

    def test_too_few_layers_and_nonsense_are_refused(self):
        result = run(RUNTIME, "probe", self.bake_cube(1), *self.TOUCH, "--overlay", "r=2,rings=2")
        self.assertEqual(result.returncode, 1)
        self.assertIn("layers", result.stderr)
        for nonsense in ("r=1", "rings=0", "r=3,", "3", "r=3,rings=two"):
            result = run(RUNTIME, "probe", self.folder / "model.palpate.hdf", *self.TOUCH, "--overlay", nonsense)
            self.assertEqual(result.returncode, 2, nonsense)
            self.assertIn("--overlay", result.stderr)


if __name__ == "__main__":
    unittest.main()
