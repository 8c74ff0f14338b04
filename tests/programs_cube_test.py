"""The reference figures of theory.md section 4 (plain meshes), through both programs."""

import unittest

from programs import ProgramTest, cube_toml


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


if __name__ == "__main__":
    unittest.main()
