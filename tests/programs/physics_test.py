"""What the elements, loads and materials of a baked file must give, through both programs."""

import unittest

import h5py
import numpy as np

from programs import MODELS, PRECOMPUTE, ProgramTest, run


class Plate(ProgramTest):
    # theory.md section 4, the papers' Table 1: the reaction of the plate with 4 x 4 quads relative to 12 x 12.
    def reaction(self, cells):
        text = (MODELS / "plate" / "model.toml").read_text()
        self.assertIn("cells = [4, 4]", text)
        file = self.bake(text.replace("cells = [4, 4]", f"cells = [{cells}, {cells}]", 1), name=f"plate{cells}.toml")
        answer = self.probe(file, "--at", "0.5,1", "--displace", "0,-0.01")
        self.assertEqual(answer["nodes"][0]["position"][:2], [0.5, 1.0])
        return answer["nodes"][0]["force"][1]

    def test_ratio_of_the_reactions(self):
        self.assertAlmostEqual(self.reaction(4) / self.reaction(12), 1.3364, delta=5e-5)


def block(element, cells, poissons_ratio, more):
    return f"""name = "block"
[geometry]
box = {{origin = [-0.05, -0.05, 0], size = [0.1, 0.1, 0.1], cells = [{cells}, {cells}, {cells}]}}
[mesh]
element = "{element}"
[material]
youngs_modulus = 5000
poissons_ratio = {poissons_ratio}
[[fixed]]
lowest = {{axis = "z", percent = 0.1}}
[storage]
scope = "surface"
{more}
"""


PRESSED = """[[load]]
traction = [0, 0, -100]
half_space = {point = [0, 0, 0.1], normal = [0, 0, 1]}
"""


class Locking(ProgramTest):
    """A nearly incompressible block, clamped below and pressed on its top: tet4 locks, tet10 does not."""

    def sinking(self, element, cells):
        file = self.bake(block(element, cells, 0.4999, PRESSED), name=f"{element}_{cells}.toml")
        with h5py.File(file) as hdf:
            nodes, u0 = hdf["mesh/nodes"][:], hdf["rest/displacement"][:]
        return -u0[np.argmin(np.linalg.norm(nodes - [0, 0, 0.1], axis=1)), 2]

    def test_tet10_is_within_two_per_cent_where_tet4_is_far_too_stiff(self):
        truth = self.sinking("tet10", 8)
        self.assertAlmostEqual(self.sinking("tet10", 4) / truth, 1.0, delta=0.02)
        self.assertLess(self.sinking("tet4", 8) / truth, 0.85)  # as many nodes as tet10 with 4 cells


class Nodule(ProgramTest):
    """A stiff sphere in a soft block: more force over it than beside it, less so the deeper it lies."""

    def forces(self, height, stiffness=50000):
        file = self.bake(f"""name = "nodule"
[geometry]
box = {{origin = [-0.04, -0.03, 0], size = [0.08, 0.06, 0.04], cells = [16, 12, 8]}}
[mesh]
element = "hex8"
[[material]]
youngs_modulus = 5000
poissons_ratio = 0.45
[[material]]
youngs_modulus = {stiffness}
poissons_ratio = 0.45
sphere = {{center = [-0.02, 0, {height}], radius = 0.0075}}
[[fixed]]
lowest = {{axis = "z", percent = 1}}
[storage]
scope = "surface"
precision = "double"
""")
        return [self.probe(file, "--at", f"{x},0,0.04", "--displace", "0,0,-0.001")["total_force"][2] for x in (-0.02, 0.02)]

    def test_force_over_and_beside_the_nodule(self):
        over, beside = self.forces(0.03)
        over_deep, beside_deep = self.forces(0.02)
        self.assertGreater(over / beside, 1.05)
        self.assertGreater(over / beside, over_deep / beside_deep)
        self.assertGreater(over_deep / beside_deep, 1.0)

    def test_a_nodule_as_soft_as_the_rest_is_not_felt(self):
        over, beside = self.forces(0.03, stiffness=5000)
        self.assertAlmostEqual(over / beside, 1.0, delta=1e-9)


class RestState(ProgramTest):
    def test_gravity_is_stored_and_the_weight_is_right(self):
        file = self.bake(block("tet4", 4, 0.3, "[[load]]\ngravity = [0, 0, -9.81]\n"))
        with h5py.File(file) as hdf:
            self.assertAlmostEqual(hdf["rest/force"][:].sum(axis=0)[2], -1000 * 9.81 * 1e-3, delta=1e-12)
            self.assertLess(hdf["rest/displacement"][:, 2].min(), -1e-4)
        self.assertIn("moved by up to", run(PRECOMPUTE, "inspect", file).stdout)
        self.assertEqual(run(PRECOMPUTE, "verify", file).returncode, 0)

    def test_verify_finds_a_rest_state_that_is_not_one(self):
        # Written anew with another rest displacement, the file's checksums are wrong: that is told at load.
        file = self.bake(block("tet4", 4, 0.3, "[[load]]\ngravity = [0, 0, -9.81]\n"))
        with h5py.File(file, "r+") as hdf:
            hdf["rest/displacement"][:] *= 1.5
        self.assert_refused(run(PRECOMPUTE, "verify", file), "/rest/displacement")


if __name__ == "__main__":
    unittest.main()
