"""Golden Green's functions (tests/golden/README.md): precompute reproduces them, the runtime answers from them."""

import sys
import unittest

import numpy as np

from programs import PRECOMPUTE, SOURCE, ProgramTest, run

sys.path.insert(0, str(SOURCE / "tests" / "golden"))
from cube import stored_greens  # noqa: E402

GOLDEN = SOURCE / "tests" / "golden" / "cube2"


def golden():
    """The stored figures as a full matrix."""
    rows = [np.array(line.split(), dtype=float) for line in (GOLDEN / "greens.txt").read_text().splitlines()]
    Xi = np.zeros((len(rows),) * 2)
    for i, row in enumerate(rows):
        Xi[i, : i + 1] = Xi[: i + 1, i] = row
    return Xi


class Golden(ProgramTest):
    def test_precompute_reproduces_it(self):
        baked, nodes = stored_greens(self.bake((GOLDEN / "model.toml").read_text()))
        self.assertEqual(nodes.tolist(), list(range(9, 27)))
        self.assertLess(np.abs(baked - golden()).max(), 1e-12 * np.abs(golden()).max())

    def test_single_precision_rounds_it(self):
        text = (GOLDEN / "model.toml").read_text().replace('"double"', '"single"')
        baked, _ = stored_greens(self.bake(text))
        self.assertLess(np.abs(baked - golden()).max(), 2.0**-24 * np.abs(golden()).max())

    def test_an_earlier_file_still_verifies(self):
        result = run(PRECOMPUTE, "verify", GOLDEN / "cube2.palpate.hdf")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_the_runtime_answers_from_it(self):
        # f = C^-1 u and u = Xi E f by NumPy for nodes 22 (centre of the top) and 13 (centre of the cube).
        Xi, held = golden(), [22, 13]
        dofs = np.concatenate([3 * (node - 9) + np.arange(3) for node in held])
        u = np.array([0.01, -0.02, -0.05, 0.0, 0.03, 0.01])
        f = np.linalg.solve(Xi[np.ix_(dofs, dofs)], u)
        field = self.folder / "field.csv"
        answer = self.probe(GOLDEN / "cube2.palpate.hdf", "--node", "22", "--displace", "0.01,-0.02,-0.05",
                            "--node", "13", "--displace", "0,0.03,0.01", "--field", field)
        found = np.concatenate([node["force"] for node in answer["nodes"]])
        np.testing.assert_allclose(found, f, rtol=1e-11)
        table = np.genfromtxt(field, delimiter=",", names=True)
        order = np.argsort(table["node"])
        displacement = np.column_stack([table[c][order] for c in ("ux", "uy", "uz")]).ravel()
        np.testing.assert_allclose(displacement, Xi[:, dofs] @ f, rtol=1e-11, atol=1e-15)


if __name__ == "__main__":
    unittest.main()
