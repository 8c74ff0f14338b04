"""palpate-precompute compare: the same finger tip on two files."""

import re
import unittest

import h5py
import numpy as np

from programs import PRECOMPUTE, ProgramTest, cube_toml, run


class Compare(ProgramTest):
    def table(self, *arguments):
        """Rows of x y z A B force displacement, and the printed summary's largest force difference, in per cent."""
        result = run(PRECOMPUTE, "compare", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = [line.replace("%", "").split() for line in result.stdout.splitlines() if line.endswith("%") and not line.startswith(("force", "displ"))]
        largest = re.search(r"^force +differs by \S+ % \(median\), (\S+) % at most$", result.stdout, re.MULTILINE)
        return np.array(rows, dtype=float), float(largest[1])

    def test_a_file_equals_itself(self):
        file = self.bake(cube_toml(4))
        rows, largest = self.table(file, file, "--touches", "7")
        self.assertEqual(len(rows), 7)
        self.assertEqual(largest, 0.0)
        self.assertTrue((rows[:, 5:] < 1e-11).all())  # but for rounding

    def test_precision_differs_by_its_rounding(self):
        double, single = self.bake(cube_toml(4), name="double.toml"), self.bake(cube_toml(4, precision="single"), name="single.toml")
        _, largest = self.table(double, single)
        self.assertGreater(largest, 0.0)
        self.assertLess(largest, 1e-4)

    def test_stiffness_of_a_single_node_is_that_of_the_stored_column(self):
        # Radius 0: the force along the normal over the displacement along it is 1 / Xi_jj where the normal is an axis.
        file = self.bake(cube_toml(4))
        rows, _ = self.table(file, file, "--radius", "0", "--touches", "1000")
        with h5py.File(file) as hdf:
            nodes, stored = hdf["mesh/nodes"][:], hdf["dofs/stored_nodes"][:]
            packed = hdf["greens/packed"][:]
        n = 3 * len(stored)
        middle = np.flatnonzero(np.isclose(rows[:, :3], [0.5, 0.5, 1.0]).all(axis=1))
        self.assertEqual(len(middle), 1)
        node = np.flatnonzero(np.isclose(nodes, [0.5, 0.5, 1.0]).all(axis=1))[0]
        j = 3 * np.flatnonzero(stored == node)[0] + 2
        diagonal = packed[j * n - j * (j - 1) // 2]
        self.assertAlmostEqual(rows[middle[0], 3] * diagonal, 1.0, delta=1e-5)

    def test_a_finer_mesh_is_softer_and_a_finger_tip_hides_less_of_it_than_a_node(self):
        coarse, fine = self.bake(cube_toml(4), name="coarse.toml"), self.bake(cube_toml(8), name="fine.toml")
        of_tip, _ = self.table(coarse, fine, "--radius", "0.4")
        of_node, _ = self.table(coarse, fine, "--radius", "0")
        self.assertLess(np.median(of_tip[:, 5]), 0.0)
        self.assertLess(np.median(of_node[:, 5]), np.median(of_tip[:, 5]))

    def test_other_bodies_are_refused(self):
        cube = self.bake(cube_toml(3))
        larger = self.bake(cube_toml(3).replace("[1, 1, 1]", "[1, 1, 1.5]"), name="larger.toml")
        self.assert_refused(run(PRECOMPUTE, "compare", cube, larger), "not the same")
        plane = self.bake("""name = "plane"
plane = "stress"
thickness = 1.0
[geometry]
rectangle = {size = [1, 1], cells = [3, 3]}
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
[[fixed]]
lowest = {axis = "y", percent = 1}
""", name="plane.toml")
        self.assert_refused(run(PRECOMPUTE, "compare", cube, plane), "2", "3")
        _, largest = self.table(plane, plane)
        self.assertEqual(largest, 0.0)


if __name__ == "__main__":
    unittest.main()
