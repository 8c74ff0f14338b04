"""palpate-runtime as a person meets it: probe, play, and what they refuse."""

import json
import pathlib
import re
import signal
import subprocess
import time
import unittest

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from programs import PATIENCE, PRECOMPUTE, RUNTIME, ProgramTest, cube_toml, palpate, recorded, run

TOUCH = "t,x,y,z,grab\n0,0.5,0.5,1.2,1\n0.1,0.5,0.5,1,1\n0.2,0.5,0.5,0.95,1\n0.3,0.5,0.5,1.0,0\n"
HANDING_OVER = 1 << 10  # runtime/core/tick/status.h
STRESS_COLUMNS = ("sxx", "syy", "szz", "sxy", "syz", "szx")
FIELD_COLUMNS = ("node", "x", "y", "z", "u0x", "u0y", "u0z", "ux", "uy", "uz", *STRESS_COLUMNS, "von_mises")


def square_toml(element="quad4", scope="full", name="square"):
    """The unit square of 4 x 4 cells in plane stress, clamped at y = 0, E = 1, nu = 0.3."""
    return f"""name = "{name}"
plane = "stress"
thickness = 1.0
[geometry]
rectangle = {{ size = [1, 1], cells = [4, 4] }}
[mesh]
element = "{element}"
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
[[fixed]]
lowest = {{ axis = "y", percent = 1 }}
[storage]
scope = "{scope}"
precision = "double"
"""


def rollers_toml(plane, stress, scope="surface", name="rollers"):
    """A unit square or cube of 4 cells an edge, each side at x, y (, z) = 0 held along its normal, the opposite of the last one pulled
    by `stress`: a patch test, u0 = stress / E (-nu x, -nu y, z), in the plane stress / E (-nu x, y)."""
    axes = "xy" if plane else "xyz"
    numbers = lambda axis, value: str([value if a == axis else 0 for a in axes])
    sides = "".join(f"""[[fixed]]
half_space = {{ point = {numbers("x", 0)}, normal = {numbers(axis, -1)} }}
axes = "{axis}"
""" for axis in axes)
    up = axes[-1]
    load = f"""[[load]]
traction = {numbers(up, stress)}
half_space = {{ point = {numbers(up, 1)}, normal = {numbers(up, 1)} }}
""" if stress else ""
    shape = "rectangle = { size = [1, 1], cells = [4, 4] }" if plane else "box = { size = [1, 1, 1], cells = [4, 4, 4] }\n[mesh]\nelement = \"tet4\""
    return f"""name = "{name}"
{'plane = "stress"' if plane else ""}
[geometry]
{shape}
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
{sides}{load}
[storage]
scope = "{scope}"
precision = "double"
"""


def patch_u0(plane, stress, x):
    """The closed form of rollers_toml."""
    strain = numpy.array([-0.3, 1.0, 0.0] if plane else [-0.3, -0.3, 1.0]) * stress
    return strain * x


def read_grid(file):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    return reader.GetOutput()


class Probe(ProgramTest):
    def test_text_and_json_say_the_same(self):
        file = self.bake(cube_toml(4))
        question = ("--at", "0.51,0.5,1.02", "--displace", "0.01,0,-0.1")
        answer = self.probe(file, *question)
        (node,) = answer["nodes"]
        self.assertEqual(node["position"], [0.5, 0.5, 1.0])
        self.assertEqual(node["node"], 2 + 5 * 2 + 25 * 4)  # x fastest
        self.assertAlmostEqual(node["distance"], 0.0005 ** 0.5)
        self.assertEqual(node["displacement"], [0.01, 0, -0.1])
        self.assertEqual(answer["total_force"], node["force"])
        text = run(RUNTIME, "probe", file, *question).stdout
        self.assertIn(f"node {node['node']} at (0.5, 0.5, 1) m", text)
        for force in node["force"]:
            self.assertIn(f"{force:.10g}", text)

    def test_warns_of_places_beside_the_body_and_of_displacements_beyond_small_strain(self):
        file = self.bake(cube_toml(4))  # edges of 0.25 and, along diagonals, 0.354 m; 1.73 m across

        def warnings(*question):
            result = run(RUNTIME, "probe", file, *question, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            answer = json.loads(result.stdout)
            told = [line.removeprefix("warning: ") for line in result.stderr.splitlines() if line.startswith("warning: ")]
            self.assertEqual(answer["warnings"], told)
            text = run(RUNTIME, "probe", file, *question)
            self.assertEqual(text.stderr, result.stderr)
            self.assertNotIn("warning", text.stdout)
            return told

        self.assertEqual(warnings("--at", "0.5,0.5,1.3", "--displace", "0,0,-0.1"), [])
        self.assertEqual(warnings("--node", "112", "--displace", "0,0,-0.17"), [])
        (far,) = warnings("--at", "0.5,0.5,1.4", "--displace", "0,0,-0.1")
        self.assertIn("0.4 m from node 112", far)
        self.assertIn("longest edge is 0.354 m", far)
        (held,) = warnings("--at", "0.5,0.5,-0.2", "--displace", "0,0,0.1")  # what is nearest is held
        self.assertIn("not held", held)
        (large,) = warnings("--node", "112", "--displace", "0,0,5")
        self.assertIn("5 m of node 112 is more than a tenth of the body's size, 1.73 m", large)
        both = warnings("--at", "9,9,9", "--displace", "0,0,5", "--node", "112", "--displace", "0,0,0.1")
        self.assertEqual(len(both), 2)

    def test_nodes_keep_the_order_in_which_they_were_given(self):
        file = self.bake(cube_toml(4))
        corner, middle = 124, 112
        answer = self.probe(file, "--node", corner, "--at", "0.5,0.5,1", "--displace", "-0.01,0,0", "--displace", "0,0,-0.1",
                            "--at", "0,0,1", "--displace", "0,0,0")
        self.assertEqual([node["node"] for node in answer["nodes"]], [corner, middle, 100])
        self.assertEqual([node["displacement"] for node in answer["nodes"]], [[-0.01, 0, 0], [0, 0, -0.1], [0, 0, 0]])
        total = numpy.sum([node["force"] for node in answer["nodes"]], axis=0)
        numpy.testing.assert_allclose(answer["total_force"], total)

    def test_fields(self):
        for scope, nodes, cells in (("surface", 98, 192), ("full", 125, 384)):
            file = self.bake(cube_toml(4, scope=scope), name=f"{scope}.toml")
            csv, vtu = self.folder / "out.csv", self.folder / "out.vtu"
            for field in (csv, vtu):
                self.probe(file, "--at", "0.5,0.5,1", "--displace", "0.01,0.02,-0.1", "--field", field)

            rows = numpy.genfromtxt(csv, delimiter=",", names=True)
            self.assertEqual(rows.dtype.names, FIELD_COLUMNS)
            self.assertEqual(len(rows), 73 if scope == "surface" else 100)
            held = rows[rows["node"] == 112][0]
            numpy.testing.assert_allclose([held["ux"], held["uy"], held["uz"]], [0.01, 0.02, -0.1], atol=1e-14)

            grid = read_grid(vtu)
            self.assertEqual((grid.GetNumberOfPoints(), grid.GetNumberOfCells()), (nodes, cells))
            u = grid.GetPointData().GetArray("displacement")
            by_position = {tuple(numpy.round([row["x"], row["y"], row["z"]], 6)): [row["ux"], row["uy"], row["uz"]] for row in rows}
            for point in range(nodes):
                expected = by_position.get(tuple(numpy.round(grid.GetPoint(point), 6)), [0, 0, 0])  # clamped
                numpy.testing.assert_allclose(u.GetTuple(point), expected, atol=1e-14)
                self.assertEqual(grid.GetPointData().GetArray("rest_displacement").GetTuple(point), (0, 0, 0))

    def test_places_that_cannot_be_asked(self):
        file = self.bake(cube_toml(4))
        move = ("--displace", "0,0,-0.1")
        self.assert_refused(run(RUNTIME, "probe", file, "--node", "0", *move), "node 0 is fixed", "fixed regions")
        inside = 2 + 5 * 2 + 25 * 2
        self.assert_refused(run(RUNTIME, "probe", file, "--node", inside, *move), f"node {inside}", "inside", "scope")
        self.assert_refused(run(RUNTIME, "probe", file, "--node", "125", *move), "node 125", "0 to 124")
        self.assert_refused(run(RUNTIME, "probe", file, "--node", "112", *move, "--at", "0.5,0.5,1", *move), "node 112", "twice")
        self.assert_refused(run(RUNTIME, "probe", file, "--node", "112", *move, "--field", self.folder / "out.png"), "out.png", ".vtu")
        self.assert_refused(run(RUNTIME, "probe", file, "--node", "112", *move, "--field", self.folder / "no" / "out.csv"), "out.csv")
        self.assert_refused(run(RUNTIME, "probe", self.folder / "none.palpate.hdf", "--node", "1", *move), "none.palpate.hdf")

    def test_model_that_is_not_the_one_asked_for(self):
        file = self.bake(cube_toml(3))
        question = ("probe", file, "--at", "0.5,0.5,1", "--displace", "0,0,-0.1", "--model")
        self.assertEqual(run(RUNTIME, *question, self.folder / "model.toml").returncode, 0)
        other = self.write("other.toml", cube_toml(3) + "\n")
        self.assert_refused(run(RUNTIME, *question, other), file.name, "other.toml", "Precompute it again")
        self.assert_refused(run(RUNTIME, *question, self.folder / "none.toml"), "none.toml")


class Plane(ProgramTest):
    MIDDLE = 2 + 5 * 4  # of the upper edge, nodes numbered x fastest

    def test_two_numbers_a_vector(self):
        for element in ("quad4", "tri3"):
            file = self.bake(square_toml(element), name=f"{element}.toml")
            answer = self.probe(file, "--at", "0.51,1.02", "--displace", "0.01,-0.1")
            (node,) = answer["nodes"]
            self.assertEqual((node["node"], node["position"]), (self.MIDDLE, [0.5, 1.0, 0.0]))
            self.assertAlmostEqual(node["distance"], 0.0005 ** 0.5)
            self.assertEqual(node["displacement"], [0.01, -0.1, 0.0])
            self.assertLess(node["force"][1], -0.01)
            self.assertEqual(node["force"][2], 0)
            # A third number is taken if it says nothing; two prescribed nodes change their forces in step (linear).
            self.assertEqual(self.probe(file, "--at", "0.51,1.02,0", "--displace", "0.01,-0.1,0"), answer)
            twice = self.probe(file, "--node", self.MIDDLE, "--displace", "0.02,-0.2")
            numpy.testing.assert_allclose(twice["total_force"], 2 * numpy.array(answer["total_force"]), rtol=1e-12)

    def test_vectors_that_are_not_of_the_body(self):
        square, cube = self.bake(square_toml(), name="square.toml"), self.bake(cube_toml(2), name="cube.toml")
        for file, at, displace, pieces in (
                (square, "0.5,1,0.25", "0,-0.1", ("--at 0.5,1,0.25", "plane", "two numbers")),
                (square, "0.5,1", "0,0,-0.1", ("--displace 0,0,-0.1", "plane", "two numbers")),
                (cube, "0.5,1", "0,0,-0.1", ("--at 0.5,1", "in space", "three numbers")),
                (cube, "0.5,0.5,1", "0,-0.1", ("--displace 0,-0.1", "in space", "three numbers"))):
            self.assert_refused(run(RUNTIME, "probe", file, "--at", at, "--displace", displace), file.name, *pieces)
        self.assert_refused(run(RUNTIME, "probe", square, "--node", "2", "--displace", "0,1"), "node 2 is fixed")

    def test_fields_are_the_square_or_its_boundary(self):
        for scope, kind, cells, points in (("full", vtk.VTK_QUAD, 16, 25), ("surface", vtk.VTK_LINE, 16, 16)):
            file = self.bake(square_toml(scope=scope), name=f"{scope}.toml")
            csv, vtu = self.folder / "out.csv", self.folder / "out.vtu"
            for field in (csv, vtu):
                self.probe(file, "--at", "0.5,1", "--displace", "0.02,-0.1", "--field", field)
            rows = numpy.genfromtxt(csv, delimiter=",", names=True)
            self.assertEqual(len(rows), 20 if scope == "full" else 11)
            held = rows[rows["node"] == self.MIDDLE][0]
            numpy.testing.assert_allclose([held[name] for name in ("x", "y", "z", "ux", "uy", "uz")], [0.5, 1, 0, 0.02, -0.1, 0], atol=1e-14)
            numpy.testing.assert_array_equal([rows["z"], rows["uz"], rows["u0y"]], numpy.zeros((3, len(rows))))

            grid = read_grid(vtu)
            self.assertEqual((grid.GetNumberOfPoints(), grid.GetNumberOfCells()), (points, cells))
            self.assertEqual({grid.GetCellType(c) for c in range(cells)}, {kind})
            u = grid.GetPointData().GetArray("displacement")
            top = grid.FindPoint(0.5, 1, 0)
            numpy.testing.assert_allclose(u.GetTuple(top), [0.02, -0.1, 0], atol=1e-14)
            self.assertEqual(u.GetTuple(grid.FindPoint(0.5, 0, 0)), (0, 0, 0))

    def test_play_ignores_z(self):
        file = self.bake(square_toml(scope="surface"))
        script = self.write("touch.csv", "t,x,y,z,grab\n0,0.5,1,0.5,1\n0.1,0.5,0.9,0.7,1\n")
        result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--fast", "--record", "out.mcap", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        recording = palpate.read(self.folder / "out.mcap")
        ticks = recording
        numpy.testing.assert_allclose(ticks["device_position"][-1], [0.5, 0.9, 0.7])
        numpy.testing.assert_array_equal(ticks["tool_position"][:, 2], 0)
        numpy.testing.assert_array_equal(ticks["force"][:, 2], 0)
        answer = self.probe(file, "--node", self.MIDDLE, "--displace", "0,-0.1")
        numpy.testing.assert_allclose(ticks["force"][-1], answer["total_force"], rtol=1e-7, atol=1e-9)


class Rest(ProgramTest):
    """Loads displace the body; what a tool does is relative to that."""

    STRESS = 0.2

    def check(self, plane):
        loaded = self.bake(rollers_toml(plane, self.STRESS), name="loaded.toml")
        unloaded = self.bake(rollers_toml(plane, 0), name="unloaded.toml")
        corner = 24 if plane else 124  # the last node, at (1, 1) or (1, 1, 1)
        x = numpy.array([1.0, 1.0, 0.0 if plane else 1.0])
        rest = x + patch_u0(plane, self.STRESS, x)
        vector = lambda v: ",".join(repr(float(c)) for c in v[:2 if plane else 3])
        push = numpy.array([0.01, -0.03, 0.0 if plane else -0.02])

        at_rest = self.probe(loaded, "--at", vector(rest), "--displace", vector(push))["nodes"][0]
        self.assertEqual(at_rest["node"], corner)
        numpy.testing.assert_allclose(at_rest["position"], rest, atol=1e-12)
        self.assertLess(at_rest["distance"], 1e-12)
        numpy.testing.assert_array_equal(at_rest["displacement"], push)
        without = self.probe(unloaded, "--node", corner, "--displace", vector(push))["nodes"][0]
        numpy.testing.assert_array_equal(without["position"], x)
        numpy.testing.assert_allclose(at_rest["force"], without["force"], rtol=1e-11, atol=1e-13)

        csv, vtu = self.folder / "out.csv", self.folder / "out.vtu"
        for field in (csv, vtu):
            self.probe(loaded, "--node", corner, "--displace", vector(push), "--field", field)
        rows = numpy.genfromtxt(csv, delimiter=",", names=True)
        columns = {name: numpy.column_stack([rows[c] for c in name.split()]) for name in ("x y z", "u0x u0y u0z", "ux uy uz")}
        numpy.testing.assert_allclose(columns["u0x u0y u0z"], patch_u0(plane, self.STRESS, columns["x y z"]), atol=1e-12)
        contact = {int(row["node"]): u for row, u in zip(rows, columns["ux uy uz"])}
        numpy.testing.assert_allclose(contact[corner], push, atol=1e-14)

        grid = read_grid(vtu)
        points = numpy.array([grid.GetPoint(p) for p in range(grid.GetNumberOfPoints())])
        u0 = patch_u0(plane, self.STRESS, points)
        arrays = {name: numpy.array([grid.GetPointData().GetArray(name).GetTuple(p) for p in range(len(points))])
                  for name in ("displacement", "rest_displacement")}
        numpy.testing.assert_allclose(arrays["rest_displacement"], u0, atol=1e-12)
        moved = arrays["displacement"] - u0
        node = numpy.rint(points @ [4, 20, 0 if plane else 100]).astype(int)  # x fastest
        self.assertEqual(len(points), 16 if plane else 98)
        numpy.testing.assert_allclose(moved, [contact.get(n, numpy.zeros(3)) for n in node], atol=1e-12)
        on_rollers = points[:, :2 if plane else 3] == 0  # along each axis
        numpy.testing.assert_array_equal(~numpy.isin(node, list(contact)), on_rollers.all(axis=1))
        for axis in range(2 if plane else 3):
            numpy.testing.assert_array_equal(arrays["displacement"][on_rollers[:, axis], axis], u0[on_rollers[:, axis], axis])
            rolling = on_rollers[:, axis] & (on_rollers.sum(axis=1) == 1)
            self.assertGreater(numpy.abs(moved[rolling]).max(), 1e-4)

    def test_stress_at_rest_is_the_traction(self):
        for plane in (True, False):
            loaded = self.bake(rollers_toml(plane, self.STRESS), name="loaded.toml")
            csv, vtu = self.folder / "out.csv", self.folder / "out.vtu"
            for field in (csv, vtu):
                self.probe(loaded, "--node", 24 if plane else 124, "--displace", "0,0" if plane else "0,0,0", "--field", field)
            expected = numpy.zeros(6)
            expected[1 if plane else 2] = self.STRESS
            rows = numpy.genfromtxt(csv, delimiter=",", names=True)
            stress = numpy.column_stack([rows[c] for c in STRESS_COLUMNS])
            known = ~numpy.isnan(rows["von_mises"])  # not inside, nor where nodes are held
            self.assertGreater(known.sum(), 8)
            numpy.testing.assert_allclose(stress[known], numpy.tile(expected, (known.sum(), 1)), atol=1e-12)
            numpy.testing.assert_allclose(rows["von_mises"][known], self.STRESS, atol=1e-12)
            array = read_grid(vtu).GetPointData().GetArray("stress")
            numpy.testing.assert_allclose(array.GetTuple(array.GetNumberOfTuples() - 1), expected, atol=1e-12)

    def test_in_the_plane(self):
        self.check(plane=True)

    def test_in_space(self):
        self.check(plane=False)

    def test_nodes_held_along_some_axes_say_which(self):
        square = self.bake(rollers_toml(True, self.STRESS), name="square.toml")
        cube = self.bake(rollers_toml(False, 0), name="cube.toml")
        for file, node, displace, pieces in ((square, 2, "0,1", ("node 2 is held along y", "every axis")),
                                             (square, 0, "0,1", ("node 0 is fixed",)),
                                             (cube, 1, "0,0,1", ("node 1 is held along y and z",)),
                                             (cube, 50, "0,0,1", ("node 50 is held along x and y",))):
            self.assert_refused(run(RUNTIME, "probe", file, "--node", node, "--displace", displace), *pieces)

    def test_the_tool_takes_hold_where_the_body_rests(self):
        file = self.bake(rollers_toml(True, 0.5))
        # Point (1, 1), node 24, rests at (0.85, 1.5).
        script = self.write("touch.csv", "t,x,y,z,grab\n0,0.85,1.5,0,1\n0.1,0.85,1.45,0,1\n")
        result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--fast", "--record", "out.mcap", "--reach", "0.001",
                     cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        recording = palpate.read(self.folder / "out.mcap")
        self.assertLess(numpy.linalg.norm(recording["force"][0]), 1e-12)
        answer = self.probe(file, "--node", 24, "--displace", "0,-0.05")
        numpy.testing.assert_allclose(recording["force"][-1], answer["total_force"], rtol=1e-7, atol=1e-9)


class Play(ProgramTest):
    def play(self, *arguments):
        return run(RUNTIME, "play", *arguments, cwd=self.folder)

    def test_fast_runs_are_equal_to_the_last_bit(self):
        file = self.bake(cube_toml(4))
        script = self.write("touch.csv", TOUCH)
        for name in ("one.mcap", "two.mcap"):
            result = self.play(file, "--device", f"script:{script}", "--fast", "--depth", "no", "--record", name, "--report", "-")
            self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual((self.folder / "one.mcap").read_bytes(), (self.folder / "two.mcap").read_bytes())

        report = json.loads(result.stdout)
        self.assertEqual(report["ticks"], 301)
        self.assertEqual(report["dropped_ticks"], 0)
        self.assertAlmostEqual(report["largest_force_time_s"], 0.2)
        recording = palpate.read(self.folder / "one.mcap")
        ticks = recording
        self.assertEqual(len(ticks["time"]), 301)
        force = numpy.linalg.norm(ticks["force"], axis=1)
        self.assertAlmostEqual(force.max(), report["largest_force_N"])
        jumps = numpy.linalg.norm(numpy.diff(ticks["force"], axis=0), axis=1)
        self.assertAlmostEqual(jumps.max(), report["largest_jump_N"])
        self.assertEqual(numpy.argmax(jumps) + 1, round(1000 * report["largest_jump_time_s"]))
        self.assertEqual(report["ticks_in_contact"], numpy.count_nonzero(ticks["contacts"]))
        self.assertEqual((report["most_contacts"], report["ticks_begun_inside"]), (1, 0))
        # The tool holds the node at the middle of the top, the nearest of the surface: the force is that of a probe.
        moved = ticks["device_position"][200] - ticks["device_position"][0]
        answer = self.probe(file, "--node", "112", "--displace", ",".join(map(repr, moved.tolist())))
        numpy.testing.assert_allclose(ticks["force"][200], answer["nodes"][0]["force"], rtol=1e-7, atol=1e-9)
        self.assertEqual(ticks["compute_ns"][:].max(), 0)

    def test_real_time_run_with_report_and_reach(self):
        file = self.bake(cube_toml(4))
        script = self.write("touch.csv", TOUCH)
        start = time.monotonic()
        result = self.play(file, "--device", f"script:{script}", "--report", "report.json", "--reach", "0.01", "--record", "out.mcap")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertGreaterEqual(time.monotonic() - start, 0.3)
        self.assertEqual(result.stdout, "")
        report = json.loads((self.folder / "report.json").read_text())
        self.assertEqual((report["ticks"], report["fast"], report["tool"]["reach_m"]), (301, False, 0.01))
        self.assertGreater(report["compute_ns"]["median"], 0)
        self.assertGreater(report["status_ticks"]["nothing_in_reach"], 50)
        for piece in ("301 ticks", "in contact", "deadline misses", "median", "99.9 %", "largest force", "largest jump",
                      "nothing_in_reach"):
            self.assertIn(piece, result.stderr)

    def test_tells_of_a_tool_that_presses_on_what_is_held(self):
        file = self.bake(cube_toml(4))
        script = self.write("below.csv", "t,x,y,z\n0,0.5,0.5,-0.2\n0.1,0.5,0.5,-0.09\n0.2,0.5,0.5,-0.09\n0.3,0.5,0.5,-0.2\n")
        play = ("--device", f"script:{script}", "--fast", "--tool", "sphere:0.1", "--overlay", "no", "--report", "-")
        rigid = self.play(file, *play, "--record", "rigid.mcap")
        coupled = self.play(file, *play, "--coupling", "0.5")
        limited = self.play(file, *play, "--max-force", "0.25")
        above = self.write("above.csv", "t,x,y,z\n0,0.5,0.5,1.2\n0.1,0.5,0.5,1.09\n0.2,0.5,0.5,1.09\n")
        free = self.play(file, "--device", f"script:{above}", "--fast", "--tool", "sphere:0.1", "--overlay", "no", "--report", "-")
        for result, words in ((rigid, "wall and not the body's"), (coupled, "its coupling alone"), (limited, "wall and not the body's")):
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            ticks = report["status_ticks"]["rigid_contact"]
            self.assertGreater(ticks, 100)
            (warning,) = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
            self.assertIn(f"in {ticks} ticks the tool pressed on what is held", warning)
            self.assertIn(words, warning)
        self.assertLess(json.loads(rigid.stdout)["largest_force_N"], 1000 * json.loads(free.stdout)["largest_force_N"])
        self.assertAlmostEqual(json.loads(coupled.stdout)["largest_force_N"], 0.5 * 0.01, delta=1e-6)
        self.assertEqual(json.loads(limited.stdout)["largest_force_N"], 0.25)
        self.assertEqual(json.loads(free.stdout)["status_ticks"]["rigid_contact"], 0)
        self.assertNotIn("warning", free.stderr)
        session = run(RUNTIME, "session", self.folder / "rigid.mcap")
        self.assertIn(f"rigid_contact in {json.loads(rigid.stdout)['status_ticks']['rigid_contact']} ticks", session.stdout)
        session = json.loads(run(RUNTIME, "session", self.folder / "rigid.mcap", "--json").stdout)
        self.assertEqual(session["status_ticks"], json.loads(rigid.stdout)["status_ticks"])

    def test_interrupt_finishes_the_recording(self):
        file = self.bake(cube_toml(4))
        script = self.write("long.csv", "t,x,y,z\n0,0.5,0.5,1\n600,0.5,0.5,0.9\n")
        for stop in (signal.SIGINT, signal.SIGTERM):
            (self.folder / "out.mcap").unlink(missing_ok=True)
            process = subprocess.Popen([RUNTIME, "play", file, "--device", f"script:{script}", "--record", "out.mcap", "--report", "-"],
                                       cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.wait_for(lambda: len(recorded(self.folder / "out.mcap", "time")) > 0, process)
            process.send_signal(stop)
            output, messages = process.communicate(timeout=PATIENCE)
            self.assertEqual(process.returncode, 130, messages)
            report = json.loads(output)
            self.assertTrue(report["interrupted"])
            recording = palpate.read(self.folder / "out.mcap")
            self.assertEqual(len(recording["time"]), report["ticks"])
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["long.csv", "model.palpate.hdf", "model.toml", "out.mcap"])

    def test_stale_model_is_told(self):
        file = self.bake(cube_toml(3))
        script = self.write("touch.csv", TOUCH)
        self.assertNotIn("warning", self.play(file, "--device", f"script:{script}", "--fast").stderr)
        self.write("model.toml", cube_toml(3).replace("youngs_modulus = 1.0", "youngs_modulus = 2.0"))
        result = self.play(file, "--device", f"script:{script}", "--fast")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(result.stderr, r"warning: .*model\.toml.*precompute")

    def test_bad_scripts_are_refused_before_anything_is_written(self):
        file = self.bake(cube_toml(3))
        script = self.write("bad.csv", "t,x,y,z\n0,0,0,zero\n")
        for device, piece in ((script, "bad.csv:2"), (self.folder / "none.csv", "none.csv")):
            self.assert_refused(self.play(file, "--device", f"script:{device}", "--record", "out.mcap"), piece)
        self.assertFalse((self.folder / "out.mcap").exists())

    def test_recording_that_cannot_be_written(self):
        file = self.bake(cube_toml(3))
        script = self.write("touch.csv", TOUCH)
        result = self.play(file, "--device", f"script:{script}", "--fast", "--record", "no/out.mcap")
        self.assert_refused(result, "out.mcap")

    def test_scripts_that_feel_nothing_are_told_why(self):
        file = self.bake(cube_toml(3))
        for rows, warning in (("0,9,9,9\n0.1,9,9,9\n", r"never touched .*metres.*\(0, 0, 0\) to \(1, 1, 1\) m"),
                              ("0,0.5,0.5,0.5\n0.1,0.5,0.5,0.4\n", "began inside the body and felt nothing at all: start outside"),
                              ("0,0.52,0.5,0.9515\n0.1,0.52,0.5,1.0515\n0.2,0.52,0.5,0.9\n",
                               "began inside the body and felt nothing until it was out at 0.049 s: start outside")):
            script = self.write("touch.csv", "t,x,y,z\n" + rows)
            result = self.play(file, "--device", f"script:{script}", "--fast", "--report", "-")
            self.assertEqual(result.returncode, 0)
            warnings = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
            self.assertEqual(len(warnings), 1, result.stderr)
            self.assertRegex(warnings[0], warning)
            self.assertEqual(json.loads(result.stdout)["ticks_in_contact"] > 0, "until" in warning)


class PlayOverlay(ProgramTest):
    SCRIPT = "t,x,y,z,grab\n0,0.4,0.5,1.25,0\n0.1,0.4,0.5,1.17,0\n0.2,0.8,0.5,1.17,0\n"

    def ticks(self, file, overlay):
        script = self.write("slide.csv", self.SCRIPT)
        result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--tool", "sphere:0.2", "--fast", "--overlay", overlay,
                     "--record", "out.mcap", "--force", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        recording = palpate.read(self.folder / "out.mcap")
        return {name: recording[name] for name in recording}

    def test_overlays_of_the_file_change_nothing_but_the_time(self):
        toml = cube_toml(4, scope="layers")
        self.assertIn('scope = "layers"', toml)
        stored = "[overlay]\nrefinement = 2\nrings = 1\n[[overlay.region]]\nhalf_space = { point = [0.2, 0, 1], normal = [0, 0, 1] }\n"
        without = self.bake(toml, name="without.toml")
        model = self.write("with.toml", toml + stored)
        planned = run(PRECOMPUTE, model, "--dry-run", cwd=self.folder)
        self.assertIn("overlays: 25 patches, 1 ring of elements each, cut into 2^3", planned.stderr)
        with_overlays = self.bake(toml + stored, name="with.toml")
        self.assertRegex(run(PRECOMPUTE, "inspect", with_overlays).stdout, r"overlays +25 patches, r = 2, 1 ring, \d+\.\d MB")
        self.assertEqual(run(PRECOMPUTE, "verify", with_overlays).returncode, 0)
        for overlay in ("r=2,rings=1", "r=3,rings=1"):
            expected, found = self.ticks(without, overlay), self.ticks(with_overlays, overlay)
            self.assertGreater(numpy.linalg.norm(expected["force"], axis=1).max(), 1e-3)
            for name, values in expected.items():
                numpy.testing.assert_array_equal(found[name], values, err_msg=f"{overlay}: {name}")

    def test_a_neo_hookean_overlay_is_told_replayed_and_refused(self):
        file = self.bake(cube_toml(4, scope="layers"))
        script = self.write("press.csv", "t,x,y,z\n0,0.4,0.5,1.25\n0.1,0.4,0.5,1.1\n0.2,0.4,0.5,1.1\n0.3,0.4,0.5,1.25\n")
        law = ("--overlay", "r=2,rings=1", "--overlay-law", "neo-hookean")
        press = ("play", file, "--tool", "sphere:0.2", "--fast", "--report", "report.json", "--device")
        result = run(RUNTIME, *press, f"script:{script}", *law, "--record", "out.mcap", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("overlay, neo-hookean: ", result.stderr)
        told = json.loads((self.folder / "report.json").read_text())["overlay"]["neo_hookean"]
        self.assertGreater(told["made"], 5)
        self.assertEqual((told["failed"], told["most_inverted"]), (0, 0))
        self.assertEqual(run(RUNTIME, *press, "replay:out.mcap", cwd=self.folder).returncode, 0)
        result = run(RUNTIME, *press, f"script:{script}", "--overlay", "r=2,rings=1", cwd=self.folder)
        self.assertNotIn("neo_hookean", json.loads((self.folder / "report.json").read_text())["overlay"])
        for options, named in (((*law[2:],), "--overlay-law"), ((*law, "--contact", "dynamic"), "--contact"), ((*law, "--depth", "yes"), "--overlay"),
                               (("--overlay", "r=2,rings=1", "--overlay-law", "rubber"), "--overlay-law")):
            result = run(RUNTIME, *press, f"script:{script}", *options, cwd=self.folder)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(named, result.stderr)

    def test_over_everything_it_is_the_finer_cube(self):
        coarse = self.bake(cube_toml(2, scope="full"), name="coarse.toml")
        fine = self.bake(cube_toml(4, scope="full"), name="fine.toml")
        script = self.write("press.csv", "t,x,y,z\n0,0.4,0.5,1.25\n0.1,0.4,0.5,1.17\n0.3,0.45,0.5,1.17\n")
        forces, surfaces = [], []
        for file, overlay in ((coarse, ("--overlay", "r=2,rings=4")), (fine, ("--overlay", "no", "--depth", "no"))):
            has_patches = file == coarse
            result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--tool", "sphere:0.2", "--fast", "--record", "out.mcap",
                         "--surface", "out.vtu", "--report", "report.json", "--force", *overlay, cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads((self.folder / "report.json").read_text())
            recording = palpate.read(self.folder / "out.mcap")
            forces.append(recording["force"])
            options = recording.info["options"].splitlines()
            self.assertEqual([line for line in options if line.startswith("overlay=")],
                             [f"overlay={overlay[1]}"])
            touched = recording["contacts"] > 0
            self.assertTrue(touched[-1])
            self.assertEqual((recording["patch"][touched] >= 0).all(), has_patches)
            if has_patches:
                self.assertEqual((report["overlay"]["refinement"], report["overlay"]["rings"]), (2, 4))
                self.assertEqual(report["overlay"]["older_ticks_in_contact"], 0)
                self.assertRegex(result.stderr, r"overlay: \d+ patches built")
            self.assertEqual("overlay" in report, has_patches)
            grid = read_grid(self.folder / "out.vtu")
            surfaces.append((vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(grid.GetPointData().GetArray("displacement"))))
        largest = numpy.abs(forces[1]).max()
        numpy.testing.assert_allclose(forces[0], forces[1], atol=1e-4 * largest)
        (nodes, u), (fine_nodes, fine_u) = surfaces
        self.assertEqual(len(nodes), len(fine_nodes))
        self.assertEqual(len(nodes), 98)  # 5^3 - 3^3 nodes on the surface
        order = [numpy.argmin(numpy.linalg.norm(fine_nodes - node, axis=1)) for node in nodes]
        numpy.testing.assert_allclose(fine_nodes[order], nodes, atol=1e-12)
        numpy.testing.assert_allclose(u, fine_u[order], atol=1e-4 * numpy.abs(fine_u).max())

    def test_deeper_than_what_is_stored(self):
        model = self.write("model.toml", cube_toml(4, scope="layers") + "[overlay]\n[[overlay.region]]\nnodes = [124]\n")
        self.assert_refused(run(PRECOMPUTE, model, cwd=self.folder), "[overlay] rings reaches 2 layers", "layers = 2", "model.toml")


class Tools(ProgramTest):
    """What the tool's options do, by what is recorded."""

    # A sphere or capsule comes down on the top, presses and is dragged.
    PRESS = "t,x,y,z\n0,0.4,0.45,1.4\n0.2,0.4,0.45,1.12\n0.4,0.5,0.5,1.12\n"

    def play(self, file, script, *arguments):
        script = self.write("script.csv", script)
        result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--fast", "--record", "out.mcap", "--contacts", "out.csv", "--report", "-",
                     "--force", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        recording = palpate.read(self.folder / "out.mcap")
        ticks = {name: recording[name] for name in recording}
        contacts = numpy.atleast_1d(numpy.genfromtxt(self.folder / "out.csv", delimiter=",", names=True))
        return json.loads(result.stdout), ticks, contacts

    @staticmethod
    def vectors(contacts, prefix):
        return numpy.column_stack([contacts[prefix + axis] for axis in "xyz"])

    def test_a_sphere_is_pushed_out_where_it_touches(self):
        file = self.bake(cube_toml(6))
        report, ticks, contacts = self.play(file, self.PRESS, "--tool", "sphere:0.2", "--depth", "no")
        self.assertEqual((report["tool"]["radius_m"], report["tool"]["length_m"]), (0.2, 0))
        self.assertGreater(report["most_contacts"], 1)
        room = report["room"]
        self.assertEqual(set(room), {"near_nodes", "contact_points", "unknowns", "simplices"})
        self.assertGreaterEqual(room["contact_points"]["most"], report["most_contacts"])
        for used in room.values():
            self.assertLess(0, used["most"])
            self.assertLessEqual(used["most"], used["room"])
        x, n, f = (self.vectors(contacts, prefix) for prefix in ("", "n", "f"))
        numpy.testing.assert_allclose(f.sum(axis=0), ticks["force"][-1], rtol=1e-12)
        closed = numpy.linalg.norm(f, axis=1) > 0
        self.assertEqual(closed.sum(), ticks["contacts"][-1])
        self.assertFalse(contacts["held"].any())
        # Without friction the body is pushed straight in, at places on the sphere; nothing else is in it, to second order of a tick's motion.
        numpy.testing.assert_allclose(f, (f * n).sum(axis=1)[:, None] * n, atol=1e-12)
        self.assertTrue(((f * n).sum(axis=1)[closed] < 0).all())
        distance = numpy.linalg.norm(x - ticks["tool_position"][-1], axis=1)
        numpy.testing.assert_allclose(distance[closed], 0.2, atol=1e-3)
        self.assertGreater(distance.min(), 0.199)
        numpy.testing.assert_allclose(contacts["gap"][closed], 0, atol=1e-9)
        self.assertTrue((contacts["gap"] > -1e-9).all())
        self.assertTrue((x[:, 2] < 1).all())
        # Forces through the centre of a sphere turn nothing.
        self.assertLess(numpy.linalg.norm(ticks["torque"][-1]), 1e-2 * 0.2 * numpy.linalg.norm(ticks["force"][-1]))

    def test_friction(self):
        text = cube_toml(6).replace("density = 1000", "friction = 0.1")
        for given, mu in (((), 0.1), (("--friction", "0.3"), 0.3), (("--friction", "0"), 0)):
            report, ticks, contacts = self.play(self.bake(text), self.PRESS, "--tool", "sphere:0.2", "--overlay", "no", "--depth", "no", *given)
            self.assertEqual(report["tool"]["friction"], mu if given else None)
            f, n = self.vectors(contacts, "f"), self.vectors(contacts, "n")
            normal = (f * n).sum(axis=1)
            tangential = numpy.linalg.norm(f - normal[:, None] * n, axis=1)
            rounding = 1e-6 * -normal.sum()  # the cone solver's tolerance
            self.assertTrue((tangential <= -mu * normal + rounding).all())
            # Dragged so far it slips somewhere.
            self.assertGreater((tangential + rounding >= -mu * normal)[normal < -100 * rounding].sum(), 0)
        self.assertEqual(report["status_ticks"]["pose_limited"], 0)

    def test_coupling_and_largest_force(self):
        file = self.bake(cube_toml(6))
        _, rigid, _ = self.play(file, self.PRESS, "--tool", "sphere:0.2")
        numpy.testing.assert_array_equal(rigid["tool_position"], rigid["device_position"])
        report, ticks, _ = self.play(file, self.PRESS, "--tool", "sphere:0.2", "--coupling", "0.5")
        self.assertEqual(report["tool"]["coupling_N_per_m"], 0.5)
        stretch = ticks["tool_position"] - ticks["device_position"]
        smoothed = ticks["status"] & HANDING_OVER > 0
        self.assertLess(smoothed.sum(), 100)
        numpy.testing.assert_allclose(0.5 * stretch[~smoothed], -ticks["force"][~smoothed], atol=1e-12)
        self.assertLess(numpy.abs(ticks["force"]).max(), numpy.abs(rigid["force"]).max())

        largest = numpy.linalg.norm(rigid["force"], axis=1).max()
        report, limited, _ = self.play(file, self.PRESS, "--tool", "sphere:0.2", "--max-force", repr(float(largest / 2)))
        self.assertAlmostEqual(numpy.linalg.norm(limited["force"], axis=1).max(), largest / 2)
        self.assertGreater(report["status_ticks"]["force_limited"], 50)

    def test_a_capsule_lies_along_its_own_z(self):
        file = self.bake(cube_toml(6))
        turn = f"{numpy.sqrt(0.5)},0,{numpy.sqrt(0.5)},0"  # z to x
        script = f"t,x,y,z,qw,qx,qy,qz\n0,0.3,0.5,1.4,{turn}\n0.2,0.3,0.5,1.05,{turn}\n"
        report, ticks, contacts = self.play(file, script, "--tool", "capsule:0.1,0.4", "--coupling-torsion", "1.0")
        self.assertEqual((report["tool"]["radius_m"], report["tool"]["length_m"]), (0.1, 0.4))
        self.assertEqual(report["tool"]["coupling_torsion_Nm_per_rad"], 1.0)
        self.assertGreater(ticks["contacts"][-1], 1)
        # The body feels the tool on both sides of its middle, 0.2 m along x from the origin: the torque there is small.
        force, torque = ticks["force"][-1], ticks["torque"][-1]
        middle = torque - numpy.cross([0.2, 0, 0], force)
        self.assertLess(force[2], 0)
        self.assertLess(numpy.linalg.norm(middle), 0.25 * numpy.linalg.norm(torque))
        # The spring gives way: the tool is turned by torque over stiffness.
        tool, device = ticks["tool_orientation"][-1], ticks["device_orientation"][-1]
        angle = 2 * numpy.arccos(min(1, abs(tool @ device)))
        self.assertAlmostEqual(angle, numpy.linalg.norm(torque) / 1.0, places=6)
        f, x = self.vectors(contacts, "f"), self.vectors(contacts, "")
        numpy.testing.assert_allclose(numpy.cross(x - ticks["tool_position"][-1], f).sum(axis=0), torque,
                                      atol=0.02 * numpy.linalg.norm(torque))

    def test_a_disc_is_normal_to_its_own_z(self):
        file = self.bake(cube_toml(6))
        script = "t,x,y,z\n0,0.5,0.5,1.2\n0.1,0.5,0.5,1.0\n0.2,0.5,0.5,1.0\n"
        report, flat, contacts = self.play(file, script, "--tool", "disc:0.3,0.02")
        self.assertEqual((report["tool"]["disc_radius_m"], report["tool"]["radius_m"], report["tool"]["length_m"]), (0.3, 0.02, 0))
        self.assertLess(flat["force"][-1][2], 0)  # on the body
        self.assertGreater(flat["contacts"][-1], 8)
        self.assertLess(numpy.hypot(contacts["x"] - 0.5, contacts["y"] - 0.5).max(), 0.31)
        turn = f"{numpy.sqrt(0.5)},0,{numpy.sqrt(0.5)},0"  # upright: it stands on its edge, as deep as the flat one was
        script = f"t,x,y,z,qw,qx,qy,qz\n0,0.5,0.5,1.5,{turn}\n0.1,0.5,0.5,1.28,{turn}\n0.2,0.5,0.5,1.28,{turn}\n"
        _, upright, _ = self.play(file, script, "--tool", "disc:0.3,0.02")
        self.assertLess(upright["force"][-1][2], 0)
        self.assertGreater(upright["force"][-1][2], 0.5 * flat["force"][-1][2])

    def test_grab_holds_what_is_touched_and_pulls(self):
        file = self.bake(cube_toml(6))
        script = "t,x,y,z,grab\n0,0.5,0.5,1.4,0\n0.2,0.5,0.5,1.15,1\n0.4,0.5,0.5,1.3,1\n"
        report, ticks, contacts = self.play(file, script, "--tool", "sphere:0.2", "--depth", "no")
        self.assertLess(ticks["force"][200][2], 0)
        self.assertGreater(ticks["force"][-1][2], 0)
        self.assertTrue((contacts["held"] == 1).all())
        self.assertEqual(len(contacts), ticks["contacts"][-1])
        numpy.testing.assert_allclose(self.vectors(contacts, "f").sum(axis=0), ticks["force"][-1], rtol=1e-12)
        numpy.testing.assert_array_equal(ticks["grab"], ticks["time"] >= 0.2)
        self.assertEqual(report["status_ticks"]["nothing_in_reach"], 0)

    def test_few_contacts(self):
        file = self.bake(cube_toml(6))
        report, ticks, contacts = self.play(file, self.PRESS, "--tool", "sphere:0.2", "--max-contacts", "2")
        self.assertLessEqual(report["most_contacts"], 2)
        self.assertLessEqual(len(contacts), 2)
        self.assertGreater(report["status_ticks"]["capacity_full"], 0)
        best = report["best_effort"]
        self.assertGreater(best["ticks"], 0)
        self.assertEqual(best["ticks"], best["left_out_ticks"])
        self.assertEqual(best["left_out_ticks"], (ticks["left_out"] > 0).sum())
        self.assertEqual(best["most_left_out"], ticks["left_out"].max())
        self.assertAlmostEqual(best["force_error_N"]["largest"] / ticks["force_error"].max(), 1, places=6)
        self.assertTrue(((ticks["force_error"] > 0) == (ticks["left_out"] > 0)).all())
        whole, ticks, _ = self.play(file, self.PRESS, "--tool", "sphere:0.2")
        self.assertEqual(whole["best_effort"]["ticks"], 0)
        self.assertEqual(ticks["force_error"].max(), 0)

    def test_a_best_effort_is_warned_of(self):
        file = self.bake(cube_toml(6))
        script = self.write("touch.csv", self.PRESS)
        play = (RUNTIME, "play", file, "--device", f"script:{script}", "--fast", "--tool", "sphere:0.2")
        few = run(*play, "--max-contacts", "2", "--record", "few.mcap", cwd=self.folder)
        words = r"in \d+ ticks \(\d+ %\) the force was a best effort, .* contact points found no room"
        self.assertRegex(few.stderr, "warning: " + words)
        self.assertNotIn("best effort", run(*play, cwd=self.folder).stderr)
        self.assertRegex(run(RUNTIME, "session", "few.mcap", cwd=self.folder).stdout, "best effort +" + words)


class Usage(ProgramTest):
    def test_a_file_without_a_command_is_told_what_it_is_for(self):
        for file, command in (("touch.mcap", "view"), ("liver.palpate.hdf", "play"), ("organ.stl", "push"), ("organ.nii", "push"), ("organ.nii.gz", "push"), ("organ.nrrd", "push")):
            told = run(RUNTIME, file)
            self.assertEqual(told.returncode, 2)
            self.assertIn(f"hint: palpate-runtime {command} {file}", told.stderr)

    def assert_usage(self, piece, *arguments):
        result = run(RUNTIME, *arguments)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertRegex(result.stderr, r"^error: .*\nhint: .*--help\n$")
        self.assertIn(piece, result.stderr)

    def test_help_and_version(self):
        for arguments in (("--help",), ("probe", "--help"), ("play", "--help"), ("view", "--help"), ("export", "--help"), ("devices", "--help")):
            result = run(RUNTIME, *arguments)
            self.assertEqual(result.returncode, 0)
            self.assertIn("palpate-runtime", result.stdout)
        self.assertRegex(run(RUNTIME, "--version").stdout, r"^palpate-runtime \d+\.\d+\.\d+\n$")

    def test_devices(self):
        listing = run(RUNTIME, "devices", "--json")
        self.assertEqual(listing.returncode, 0)
        self.assertIsInstance(json.loads(listing.stdout)["devices"], list)
        profiles = pathlib.Path(__file__).resolve().parent.parent.parent / "runtime" / "devices" / "hid" / "profiles"
        for file in profiles.glob("*.toml"):
            self.assertEqual(run(RUNTIME, "devices", "--print-profile", file.stem).stdout, file.read_text())
        wrong = run(RUNTIME, "devices", "--print-profile", "nonesuch")
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("spacemouse", wrong.stderr)

    def test_links_nothing_of_gpl_or_agpl(self):
        section = subprocess.run(["readelf", "--dynamic", RUNTIME], text=True, capture_output=True, check=True).stdout
        needed = set(re.findall(r"\(NEEDED\).*\[(?:lib)?([^.\]]+)", section))
        allowed = {"z", "xxhash", "fmt", "stdc++", "m", "gcc_s", "c", "ld-linux-x86-64",
                   "tomlplusplus", "hidapi-hidraw", "udev", "asan", "ubsan", "tsan"}
        self.assertEqual(needed - allowed, set())
        program = RUNTIME.read_bytes()
        for symbol in (b"cholmod_", b"tetgenio", b"N4CGAL"):
            self.assertNotIn(symbol, program)

    def test_wrong_arguments(self):
        place = ("--at", "0,0,1", "--displace", "0,0,1")
        self.assert_usage("play, view, probe, session, export, devices or samples is required")
        self.assert_usage("bogus", "bogus")
        self.assert_usage("FILE", "probe", *place)
        self.assert_usage("--bogus", "probe", "x.palpate.hdf", *place, "--bogus")
        self.assert_usage("--at or --node", "probe", "x.palpate.hdf", "--displace", "0,0,1")
        self.assert_usage("--displace", "probe", "x.palpate.hdf", "--at", "0,0,1")
        self.assert_usage("1 displacements are given for 2 places", "probe", "x.palpate.hdf", *place, "--node", "3")
        self.assert_usage("'0'", "probe", "x.palpate.hdf", "--at", "0", "--displace", "0,0,1")
        self.assert_usage("'0,0,0,1'", "probe", "x.palpate.hdf", "--at", "0,0,1", "--displace", "0,0,0,1")
        self.assert_usage("'0,0,nan'", "probe", "x.palpate.hdf", "--at", "0,0,1", "--displace", "0,0,nan")
        self.assert_usage("'-1'", "probe", "x.palpate.hdf", "--node", "-1", "--displace", "0,0,1")
        self.assert_usage("'mouse'", "play", "x.palpate.hdf", "--device", "mouse")

    def test_wrong_tools(self):
        for option, text, piece in (("--reach", "inf", "'inf'"), ("--reach", "-1", "'-1'"), ("--tool", "ball", "'ball'"),
                                    ("--tool", "sphere", "'sphere' is none of"), ("--tool", "sphere:0.1,0.2", "is none of"),
                                    ("--tool", "sphere:", "'' of 'sphere:'"), ("--tool", "sphere:5mm", "'5mm'"),
                                    ("--tool", "sphere:0", "'0' of 'sphere:0' is not a positive"), ("--tool", "sphere:-1", "'-1'"),
                                    ("--tool", "capsule:0.1", "is none of"), ("--tool", "capsule:0.1,nan", "'nan'"),
                                    ("--tool", "disc:0.1,0.2", "rounded by more than the radius"), ("--tool", "disc:0.1,x", "'x'"),
                                    ("--tool", "point:1", "is none of"), ("--friction", "-0.1", "'-0.1'"),
                                    ("--friction", "inf", "'inf'"), ("--friction", "", "an empty word"), ("--coupling", "0", "N/m"), ("--coupling-torsion", "x", "N m/rad"),
                                    ("--max-force", "-3", "greater than 0 [N]"), ("--max-contacts", "0", "from 1 to"),
                                    ("--max-contacts", "1.5", "'1.5'"), ("--max-contacts", "100000", "from 1 to 1000")):
            with self.subTest(option=option, text=text):
                self.assert_usage(piece, "play", "x.palpate.hdf", "--device", "script:a.csv", option, text)
                self.assert_usage(option, "play", "x.palpate.hdf", "--device", "script:a.csv", option, text)


if __name__ == "__main__":
    unittest.main()
