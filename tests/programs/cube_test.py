"""The reference figures of theory.md section 4, and fields of the overlay, through both programs."""

import csv
import sys
import unittest

import numpy as np
from vtk.util.numpy_support import vtk_to_numpy

from programs import RUNTIME, SOURCE, ProgramTest, cube_toml, run
from runtime_test import patch_u0, read_grid, rollers_toml

sys.path.insert(0, str(SOURCE / "tests" / "golden"))
from cube import kuhn_cube, stiffness  # noqa: E402


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


def kuhn_corners(places, cells):
    """Corners [n, 4] of the Kuhn tetrahedra that have the places [n, 3], and their weights; `cells` an edge, places in cells."""
    cell = np.minimum(places.astype(int), cells - 1)
    order = np.argsort(cell - places, axis=1, kind="stable")
    along = np.take_along_axis(places - cell, order, axis=1)
    stride = np.array([1, cells + 1, (cells + 1) ** 2])
    first = (cell @ stride)[:, None]
    return np.hstack([first, first + np.cumsum(stride[order], axis=1)]), -np.diff(along, axis=1, prepend=1, append=0)


def refined_patch(cells, refinement, rings):
    """The cube of theory.md section 4 without Palpate: fine nodes [n, 3] and their displacement, by the finer mesh's stiffness on what is linear in
    each element but those of the patch. And the force."""
    fine, tets = kuhn_cube(refinement * cells)
    places = np.round(fine * refinement * cells) / refinement
    coarse, elements = kuhn_cube(cells)
    contact = np.argmin(np.linalg.norm(coarse - [0.5, 0.5, 1], axis=1))
    reached = [contact]
    for _ in range(rings):
        patch = elements[np.isin(elements, reached).any(axis=1)]
        reached = np.unique(patch)
    parents, _ = kuhn_corners(places[tets].mean(axis=1), cells)
    within = {tuple(element) for element in patch}
    outside = np.array([tuple(parent) not in within for parent in parents])
    own = np.ones(len(fine), bool)  # nodes that move by themselves: inside the patch, and not the body's
    own[tets[outside]] = False
    corners, weights = kuhn_corners(places, cells)
    own &= (weights < 1 - 1e-9).all(axis=1) & (fine[:, 2] > 0)

    shape = np.zeros((len(fine), len(coarse) + own.sum()))
    np.put_along_axis(shape, corners, weights, axis=1)
    shape[own, len(coarse):] = np.eye(own.sum())
    free = np.append(np.flatnonzero(coarse[:, 2] > 0), np.arange(len(coarse), shape.shape[1]))
    P = np.kron(shape[:, free], np.eye(3))
    K = P.T @ stiffness(fine, tets, 1.0, 0.3) @ P
    held = 3 * np.flatnonzero(free == contact)[0] + np.arange(3)
    others = np.setdiff1d(np.arange(len(K)), held)
    q = np.zeros(len(K))
    q[held[2]] = 1
    q[others] = -np.linalg.solve(K[np.ix_(others, others)], K[others, held[2]])
    return fine, (P @ q).reshape(-1, 3), K[held[2]] @ q


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

    def field(self, file, *arguments):
        """Nodes, u0 and u of the table, which has each place once; nodes, cells' nodes and both displacements of the grid."""
        table, grid = self.folder / "field.csv", self.folder / "field.vtu"
        for field in (table, grid):
            self.probe(file, *self.TOUCH, *arguments, "--field", field)
        rows = np.genfromtxt(table, delimiter=",", skip_header=1)
        self.assertEqual(len(np.unique(np.round(rows[:, 1:4], 9), axis=0)), len(rows))
        read = read_grid(grid)
        points = read.GetPointData()
        cells = vtk_to_numpy(read.GetCells().GetConnectivityArray()).reshape(read.GetNumberOfCells(), -1)
        return (rows[:, 1:4], rows[:, 4:7], rows[:, 7:10]), (vtk_to_numpy(read.GetPoints().GetData()), cells, *(
            vtk_to_numpy(points.GetArray(name)) for name in ("rest_displacement", "displacement")))

    def assert_same_field(self, nodes, values, expected_nodes, expected, tolerance=1e-10):
        """Equal at the same places, whatever their order."""
        place = {tuple(np.round(x, 6) + 0.0): k for k, x in enumerate(expected_nodes)}
        self.assertEqual(len(place), len(expected_nodes))
        order = [place.get(tuple(np.round(x, 6) + 0.0)) for x in nodes]
        self.assertNotIn(None, order)
        self.assertEqual(len(set(order)), len(order))
        np.testing.assert_allclose(values, expected[order], atol=tolerance)

    def test_field_over_all_elements_is_that_of_the_finer_mesh(self):
        moved = 'normal = [0, 0, -1] }\ndisplacement = [0.1, 0.2, 0.3]'  # all rests there
        coarse, fine = (self.bake(cube_toml(cells, scope="full").replace("normal = [0, 0, -1] }", moved), name=f"{cells}.toml")
                        for cells in (2, 6))
        force = [self.probe(file, "--at", "0.6,0.7,1.3", "--displace", "0,0,1", *overlay)["nodes"][0]["force"][2]
                 for file, overlay in ((coarse, ("--overlay", "r=3,rings=4")), (fine, ()))]
        self.assertAlmostEqual(force[0], force[1], delta=1e-12)
        self.TOUCH = ("--at", "0.6,0.7,1.3", "--displace", "0,0,1")
        (x, u0, u), (points, cells, rest, seen) = self.field(coarse, "--overlay", "r=3,rings=4")
        _, (fine_points, fine_cells, fine_rest, fine_seen) = self.field(fine)
        self.assertEqual(points.shape, fine_points.shape)
        self.assertEqual(cells.shape, fine_cells.shape)
        self.assert_same_field(points, seen, fine_points, fine_seen)
        self.assert_same_field(points, rest, fine_points, fine_rest)
        self.assert_same_field(x, u, fine_points, fine_seen - fine_rest)
        self.assert_same_field(x, u0, fine_points, fine_rest)
        self.assertEqual(len(x), 7 ** 3 - 3 ** 2)  # the nodes of the bottom that the fine mesh alone has are there too

    def test_field_against_the_refined_patch_by_numpy(self):
        file = self.bake(cube_toml(4, scope="full"))
        for rings in (1, 2):
            nodes, expected, force = refined_patch(4, 2, rings)
            answer = self.probe(file, *self.TOUCH, "--overlay", f"r=2,rings={rings}")
            self.assertAlmostEqual(answer["nodes"][0]["force"][2], force, delta=1e-12)
            (x, _, u), (points, cells, rest, seen) = self.field(file, "--overlay", f"r=2,rings={rings}")
            self.assert_same_field(x, u, nodes, expected)
            self.assert_same_field(points, seen, nodes, expected)
            self.assertEqual(len(points), len(x) + 25)  # and the clamped nodes
            corners = points[cells]
            self.assertAlmostEqual(np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6, 1.0, delta=1e-12)
            self.assertFalse(rest.any())

    def test_field_on_the_surface(self):
        overlay = ("--overlay", "r=2,rings=2")
        (x, _, u), (points, cells, _, seen) = self.field(self.bake_cube(2), *overlay)
        within = 24  # triangles round the node
        self.assertEqual(len(cells), 6 * 2 * 6 ** 2 + (2 ** 2 - 1) * within)
        corners = points[cells]
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        np.testing.assert_allclose(area.sum(axis=0), 0, atol=1e-12)
        self.assertAlmostEqual(np.linalg.norm(area, axis=1).sum(), 6.0, delta=1e-12)
        free = points[:, 2] > 0
        self.assert_same_field(points[free], seen[free], x, u, 1e-14)
        self.assertFalse(seen[~free].any())

    def test_displacement_at_rest_is_that_of_the_bodys_elements(self):
        for plane in (False, True):
            self.TOUCH = ("--at", "0.5,1", "--displace", "0,0.1") if plane else Overlay.TOUCH
            file = self.bake(rollers_toml(plane, 1e-3, scope="full"))
            (x, u0, _), (points, _, rest, _) = self.field(file, "--overlay", "r=3,rings=4")
            np.testing.assert_allclose(u0, patch_u0(plane, 1e-3, x), atol=1e-15)
            np.testing.assert_allclose(rest, patch_u0(plane, 1e-3, points), atol=1e-15)

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
