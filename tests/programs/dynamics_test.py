"""Bodies that swing, through the programs: let go, touched again, pushed fast; and in somebody else's loop."""

import ctypes
import json
import re
import time
import unittest

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from programs import BINARY, PRECOMPUTE, RUNTIME, ProgramTest, cube_toml, palpate, run

TIP = (0.3, 0.01, 0.015)


def beam_toml(dynamics, ratio=0.02, scope="full"):
    """A rubber cantilever, clamped at x = 0; double precision."""
    return f"""name = "beam"
[geometry]
box = {{size = [0.3, 0.02, 0.03], cells = [20, 2, 3]}}
[mesh]
element = "hex8"
[material]
youngs_modulus = 1.0e6
poissons_ratio = 0.3
density = 1100.0
[[fixed]]
half_space = {{point = [0.0, 0.0, 0.0], normal = [-1.0, 0.0, 0.0]}}
[storage]
scope = "{scope}"
precision = "double"
[dynamics]
damping = {{ratios = [{ratio}, {ratio}], frequencies = [1.0, 30.0]}}
{dynamics}
"""


PACKED = beam_toml('method = "packed"')
MODAL = beam_toml('method = "modal"\nmodes = 60')


def pull_and_let_go(seconds):
    """Takes the tip 10 mm along y in 0.2 s, holds it, lets go at 0.3 s and is away."""
    x, y, z = TIP
    rows = [(0, y, 0), (0.001, y, 1), (0.2, y + 0.01, 1), (0.299, y + 0.01, 1), (0.3, y + 0.01, 0), (0.301, y + 0.5, 0),
            (0.3 + seconds, y + 0.5, 0)]
    return "t,x,y,z,grab\n" + "".join(f"{t},{x + 0.001},{row_y},{z},{grab}\n" for t, row_y, grab in rows)


def read_grid(file):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    grid = reader.GetOutput()
    return vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(grid.GetPointData().GetArray("displacement"))


class Swing(ProgramTest):
    def play(self, file, script, *arguments):
        path = self.write("touch.csv", script)
        result = run(RUNTIME, "play", file, "--device", f"script:{path}", "--fast", "--reach", "0.02", "--report", "-", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout), result.stderr

    def tip(self, file, seconds):
        """Displacement of the tip so long after it was let go."""
        report, _ = self.play(file, pull_and_let_go(seconds), "--surface", "now.vtu")
        self.assertEqual(report["status_ticks"]["late_motion"], 0)
        points, u = read_grid(self.folder / "now.vtu")
        return u[numpy.argmin(numpy.linalg.norm(points - TIP, axis=1))]

    def test_both_ways_swing_at_the_first_frequency(self):
        packed, modal = self.bake(PACKED, name="packed.toml"), self.bake(MODAL, name="modal.toml")
        inspected = run(PRECOMPUTE, "inspect", modal).stdout
        frequency = float(re.search(r"60 modes of ([0-9.]+)", inspected).group(1))
        self.assertAlmostEqual(frequency, 1.08, delta=0.15)  # 0.162 h / L^2 sqrt(E / rho), and stiffer by hex8's shear
        for share in (0.25, 0.5, 1.0):
            at = [self.tip(file, share / frequency) for file in (packed, modal)]
            numpy.testing.assert_allclose(at[0], at[1], atol=2e-5)
            expected = 0.01 * numpy.exp(-0.02 * 2 * numpy.pi * share) * numpy.cos(2 * numpy.pi * share)
            self.assertAlmostEqual(at[0][1], expected, delta=6e-4)  # 3 % of the pull is in higher modes
        again = self.tip(packed, 0.5 / frequency)
        numpy.testing.assert_array_equal(again, self.tip(packed, 0.5 / frequency))

    def test_reports_and_wording(self):
        report, told = self.play(self.bake(PACKED), pull_and_let_go(0.1))
        self.assertEqual((report["dynamics"]["method"], report["dynamics"]["contact"]), ("packed", "quasi-static"))
        self.assertEqual(report["dynamics"]["steps"], 100)
        self.assertRegex(told, r"motion: 100 steps of 1 ms, longest [0-9.]+ ms")
        report, told = self.play(self.bake(MODAL), pull_and_let_go(0.1))
        self.assertEqual(report["dynamics"], {"method": "modal", "contact": "quasi-static"})
        self.assertNotIn("motion:", told)
        report, _ = self.play(self.bake(cube_toml(2)), pull_and_let_go(0.1))
        self.assertEqual(report["dynamics"]["method"], "none")

    def test_in_real_time_it_is_in_time(self):
        file = self.bake(PACKED)
        script = self.write("touch.csv", pull_and_let_go(0.5))
        result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--reach", "0.02", "--report", "-", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads(result.stdout)
        self.assertGreater(report["dynamics"]["steps"], 100)

    def test_pushed_fast_it_feels_heavy(self):
        x, y, z = TIP
        start = y + 0.0151
        push = f"t,x,y,z\n0,{x - 0.005},{start},{z}\n0.1,{x - 0.005},{start - 0.0002},{z}\n0.15,{x - 0.005},{start - 0.02},{z}\n3,{x - 0.005},{start - 0.02},{z}\n"
        for method in ('method = "packed"', 'method = "modal"\nmodes = 60'):
            file = self.bake(beam_toml(method, ratio=0.4))
            force = {}
            for contact in ("quasi-static", "dynamic"):
                report, _ = self.play(file, push, "--contact", contact, "--tool", "sphere:0.005", "--coupling", "300", "--record", "push.mcap", "--force")
                self.assertEqual(report["dynamics"]["contact"], contact)
                recording = palpate.read(self.folder / "push.mcap")
                force[contact] = -recording["force"][:, 1]  # on the body, downwards
            static = force["quasi-static"]
            self.assertGreater(static[-1], 0.05)
            self.assertAlmostEqual(static.max(), static[-1], delta=0.02 * static[-1])
            self.assertGreater(force["dynamic"][:160].max(), 2.0 * static.max())
            self.assertAlmostEqual(force["dynamic"][-1], static[-1], delta=0.05 * static[-1])

    def test_a_lifted_tool_leaves_the_body_its_own_return(self):
        """A soft beam of 0.34 Hz, pressed 5 mm down: its energy is that of the press, however fast the tool is gone."""
        x, y, z = TIP[0] - 0.01, TIP[1], 2 * TIP[2]
        for method in ('method = "packed"', 'method = "modal"\nmodes = 20'):
            file = self.bake(beam_toml(method).replace("1.0e6", "1.0e5"))
            highest = {}
            for speed, contact in ((0.02, "quasi-static"), (0.5, "quasi-static"), (0.5, "dynamic")):
                rows = ((0, z + 0.006), (0.5, z), (1.5, z), (1.5 + 0.1 / speed, z + 0.1), (8, z + 0.1))
                script = "t,x,y,z\n" + "".join(f"{t},{x},{y},{height}\n" for t, height in rows)
                self.play(file, script, "--contact", contact, "--tool", "sphere:0.005", "--record", "lift.mcap", "--record-frames", "100", "--force")
                recording = palpate.read(self.folder / "lift.mcap")
                node = numpy.argmin(numpy.linalg.norm(recording.surface["nodes"] - (x, y, z), axis=1))
                up = recording.frames["displacement"][:][:, node, 2]
                highest[speed, contact] = up.max()
            self.assertLess(max(highest.values()), 0.005)
            self.assertGreater(highest[0.5, "quasi-static"], 0.8 * highest[0.5, "dynamic"])

    def test_bad_input(self):
        def play(file, *arguments):
            script = self.write("touch.csv", pull_and_let_go(0.1))
            return run(RUNTIME, "play", file, "--device", f"script:{script}", "--fast", *arguments, cwd=self.folder)

        still = self.bake(cube_toml(2), name="still.toml")
        self.assert_refused(play(still, "--contact", "dynamic"), "no dynamics", "Add [dynamics]")
        slow = self.bake(beam_toml('method = "packed"\ntime_step = 0.016'), name="slow.toml")
        self.assertEqual(play(slow).returncode, 0)
        self.assert_refused(play(slow, "--contact", "dynamic"), "0.016 s", "one tick", "time_step = 0.001")
        odd = self.bake(beam_toml('method = "packed"\ntime_step = 0.0025'), name="odd.toml")
        self.assert_refused(play(odd), "0.0025 s", "whole number of ticks")
        wrong = play(still, "--contact", "elastic")
        self.assertNotEqual(wrong.returncode, 0)
        self.assertIn("neither quasi-static nor dynamic", wrong.stderr)


class Tool(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t)] + [(name, ctypes.c_double) for name in ("radius", "length", "coupling_stiffness",
                "coupling_torsion", "max_force", "friction", "reach", "hand_over")]


class Options(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("overlay", ctypes.c_void_p), ("dynamic_contact", ctypes.c_int), ("tick", ctypes.c_double)]


class Pose(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("position", ctypes.c_double * 3), ("orientation", ctypes.c_double * 4), ("grab", ctypes.c_int)]


class Counts(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t)] + [(name, ctypes.c_int32) for name in ("nodes", "simplices", "corners")]


class OwnLoop(ProgramTest):
    """The same in the C library."""

    def setUp(self):
        super().setUp()
        cache = (BINARY / "CMakeCache.txt").read_text()
        if re.search(r"^PALPATE_SANITIZE:\w+=(.+)$", cache, re.MULTILINE):
            self.skipTest("Python has no sanitizer")
        self.library = ctypes.CDLL(str(BINARY / "runtime" / "libpalpate.so"))
        self.library.palpate_create_with_options.restype = ctypes.c_void_p

    def create(self, file, **changed):
        unbounded = float("inf")
        tool = Tool(ctypes.sizeof(Tool), 0.0, 0.0, unbounded, unbounded, unbounded, -1.0, 0.02, 0.005)
        options = Options(ctypes.sizeof(Options), None, 0, 0.001)
        for name, value in changed.items():
            setattr(options, name, value)
        error = ctypes.create_string_buffer(400)
        session = self.library.palpate_create_with_options(str(file).encode(), ctypes.byref(tool), 1, 16, ctypes.byref(options),
                                                           error, ctypes.c_size_t(len(error)))
        return session, error.value.decode()

    def test_swings_and_is_set_back(self):
        for text in (PACKED, MODAL):
            session, error = self.create(self.bake(text))
            self.assertEqual(error, "")
            session = ctypes.c_void_p(session)
            counts = Counts(ctypes.sizeof(Counts))
            self.assertEqual(self.library.palpate_surface_counts(session, ctypes.byref(counts)), 0)
            u = numpy.zeros((counts.nodes, 3))

            def displacement():
                self.library.palpate_surface_displacement(session, u.ctypes.data_as(ctypes.c_void_p))
                return numpy.abs(u).max()

            def step(y, grab):
                pose = Pose(ctypes.sizeof(Pose), (TIP[0] + 0.001, y, TIP[2]), (1.0, 0.0, 0.0, 0.0), grab)
                self.library.palpate_step(session, ctypes.byref(pose))

            step(TIP[1], 0)
            for k in range(100):
                step(TIP[1] + 0.0001 * k, 1)
            held = displacement()
            self.assertGreater(held, 0.008)
            step(1.0, 0)
            self.assertAlmostEqual(displacement(), held, delta=1e-6)  # it is where it was
            # The free motion is computed beside these steps, which are much quicker than real ones.
            end = time.monotonic() + 60
            seen = [held]
            while min(seen) >= 0.5 * held:
                self.assertLess(time.monotonic(), end, "it does not swing")
                step(1.0, 0)
                seen.append(displacement())
            self.assertGreater(seen[-1], 0.0)
            self.library.palpate_reset(session)
            self.assertEqual(displacement(), 0.0)
            self.library.palpate_destroy(session)

    def test_options_are_checked(self):
        still = self.bake(cube_toml(2), name="still.toml")
        session, error = self.create(still, dynamic_contact=1)
        self.assertIsNone(session)
        self.assertIn("no dynamics", error)
        session, error = self.create(still, tick=0.0)
        self.assertIsNone(session)
        self.assertIn("a tick of", error)
        session, error = self.create(self.bake(PACKED), tick=0.0007)
        self.assertIsNone(session)
        self.assertIn("whole number of ticks", error)


if __name__ == "__main__":
    unittest.main()
