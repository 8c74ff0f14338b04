"""Golden Green's functions (tests/golden/README.md): precompute reproduces them, the runtime answers from them."""

import sys
import unittest

import numpy as np

from programs import PRECOMPUTE, SOURCE, ProgramTest, run

sys.path.insert(0, str(SOURCE / "tests" / "golden"))
from baked import read_greens, read_rows, stored_greens, stored_rest  # noqa: E402

CUBE, PLATE = (SOURCE / "tests" / "golden" / name for name in ("cube2", "plate2"))


class Golden(ProgramTest):
    def assert_close(self, found, expected, tolerance):
        """Difference relative to the largest entry."""
        self.assertEqual(found.shape, expected.shape)
        self.assertLess(np.abs(found - expected).max(), tolerance * np.abs(expected).max())

    def test_precompute_reproduces_the_cube(self):
        baked, nodes = stored_greens(self.bake((CUBE / "model.toml").read_text()))
        self.assertEqual(nodes.tolist(), list(range(9, 27)))
        self.assert_close(baked, read_greens(CUBE / "greens.txt"), 1e-12)

    def test_precompute_reproduces_the_plate_and_its_rest_state(self):
        file = self.bake((PLATE / "model.toml").read_text())
        baked, nodes = stored_greens(file)
        self.assertEqual(nodes.tolist(), list(range(6)))
        self.assert_close(baked, read_greens(PLATE / "greens.txt"), 1e-12)
        found, expected = stored_rest(file), np.array(read_rows(PLATE / "rest.txt"))
        self.assert_close(found[:, :3], expected[:, :3], 1e-12)
        self.assert_close(found[:, 3:], expected[:, 3:], 1e-12)

    def test_single_precision_rounds_it(self):
        text = (CUBE / "model.toml").read_text().replace('"double"', '"single"')
        baked, _ = stored_greens(self.bake(text))
        self.assert_close(baked, read_greens(CUBE / "greens.txt"), 2.0**-24)

    def test_earlier_files_still_verify(self):
        for folder in (CUBE, PLATE):
            result = run(PRECOMPUTE, "verify", folder / f"{folder.name}.palpate.hdf")
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def check_answer(self, folder, first_free, held):
        """f = C^-1 u and u = Xi E f by NumPy; `held` gives the displacement of each held node."""
        Xi = read_greens(folder / "greens.txt")
        d = len(next(iter(held.values())))
        dofs = np.concatenate([d * (node - first_free) + np.arange(d) for node in held])
        f = np.linalg.solve(Xi[np.ix_(dofs, dofs)], np.concatenate(list(held.values())))
        field = self.folder / "field.csv"
        arguments = [("--node", str(node), "--displace", ",".join(map(str, u))) for node, u in held.items()]
        answer = self.probe(folder / f"{folder.name}.palpate.hdf", *sum(arguments, ()), "--field", field)
        found = np.concatenate([node["force"][:d] for node in answer["nodes"]])
        np.testing.assert_allclose(found, f, rtol=1e-11)
        table = np.genfromtxt(field, delimiter=",", names=True)
        order = np.argsort(table["node"])
        displacement = np.column_stack([table[c][order] for c in ("ux", "uy", "uz")[:d]]).ravel()
        np.testing.assert_allclose(displacement, Xi[:, dofs] @ f, rtol=1e-11, atol=1e-15)

    def test_the_runtime_answers_from_the_cube(self):
        # centre of the top, centre of the cube
        self.check_answer(CUBE, 9, {22: [0.01, -0.02, -0.05], 13: [0.0, 0.03, 0.01]})

    def test_the_runtime_answers_from_the_plate(self):
        # middle of the lower edge, middle of the right edge
        self.check_answer(PLATE, 0, {1: [0.01, -0.02], 5: [0.03, 0.01]})


if __name__ == "__main__":
    unittest.main()
