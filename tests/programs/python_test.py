"""The Python package: the same forces as a C client and probe to the last bit, files as h5py sees them, a loop of its own."""

import ctypes
import os
import pathlib
import tempfile
import threading
import time
import tomllib
import typing
import unittest
import unittest.mock
import urllib.request

import h5py
import numpy
from numpy.typing import ArrayLike, NDArray

from programs import BINARY, HAS_SANITIZERS, PRECOMPUTE, RUNTIME, SOURCE, ProgramTest, cube_toml, palpate, run

from palpate import library  # by way of programs

STRUCTS = {"palpate_tool": library.CTool, "palpate_pose": library.CPose, "palpate_overlay": library.COverlay,
           "palpate_options": library.COptions, "palpate_result": library.CResult, "palpate_counts": library.CCounts,
           "palpate_record_options": library.CRecordOptions, "palpate_contact": library.CContact}


def compiled(folder, source):
    """A C program against palpate.h and the library of the build."""
    (folder / "client.c").write_text(source)
    runtime = BINARY / "runtime"
    result = run("cc", folder / "client.c", f"-I{SOURCE / 'runtime' / 'library'}", f"-L{runtime}", f"-Wl,-rpath,{runtime}", "-lpalpate",
                 "-o", folder / "client")
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    return folder / "client"


SMALL_STACK = r'''
#include <palpate.h>
#include <pthread.h>
#include <stdio.h>

static char** words;

static void* press(void* unused) {
  static char error[4096];
  palpate_tool tool = PALPATE_TOOL_INIT;
  palpate_pose pose = PALPATE_POSE_INIT;
  palpate_record_options options = PALPATE_RECORD_OPTIONS_INIT;
  tool.radius = 0.1;
  palpate_session* session = palpate_create(words[1], &tool, 1, 32, error, sizeof error);
  if (session == NULL || palpate_record(session, words[2], &options, error, sizeof error) != PALPATE_OK) return error;
  for (int k = 0; k < 200; ++k) {
    pose.position[0] = pose.position[1] = 0.5;
    pose.position[2] = 1.2 - 0.001 * k;
    palpate_step(session, &pose);
  }
  if (palpate_record_end(session, error, sizeof error) != PALPATE_OK) return error;
  palpate_destroy(session);
  return unused;
}

int main(int count, char** given) {
  pthread_attr_t small;
  pthread_t thread;
  void* failed = given;
  words = given;
  pthread_attr_init(&small);
  pthread_attr_setstacksize(&small, 64 * 1024);
  if (pthread_create(&thread, &small, press, NULL) != 0 || pthread_join(thread, &failed) != 0) return 2;
  if (failed != NULL) puts(failed);
  return failed != NULL;
}
'''


def rubbed():
    """Positions of a sphere of 0.1 that comes down on the cube, is pressed in and slides."""
    down = numpy.column_stack([numpy.full(150, 0.4), numpy.full(150, 0.5), numpy.linspace(1.15, 1.04, 150)])
    along = numpy.column_stack([numpy.linspace(0.4, 0.6, 200), numpy.full(200, 0.5), numpy.full(200, 1.04)])
    return numpy.concatenate([down, along])


class PythonTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        if HAS_SANITIZERS:
            raise unittest.SkipTest("Debian's Python cannot load a library with sanitizers")
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.shared = pathlib.Path(temporary.name)
        (cls.shared / "cube.toml").write_text(cube_toml(4))
        cls.lines = []
        cls.cube = cls.shared / "cube.palpate.hdf"
        palpate.bake(cls.shared / "cube.toml", cls.cube, progress=cls.lines.append)


class Structs(PythonTest):
    def test_members_lie_where_the_header_has_them(self):
        parts = [f'printf("{struct} %zu\\n", sizeof({struct}));' for struct in STRUCTS]
        parts += [f'printf("{struct}.{field[0]} %zu\\n", offsetof({struct}, {field[0]}));'
                  for struct, kind in STRUCTS.items() for field in kind._fields_]
        client = compiled(self.folder, "#include <palpate.h>\n#include <stdio.h>\nint main(void) {" + "\n".join(parts) + "return 0;}")
        said = dict(line.split() for line in run(client).stdout.splitlines())
        for struct, kind in STRUCTS.items():
            self.assertEqual(int(said[struct]), ctypes.sizeof(kind))
            for field in kind._fields_:
                self.assertEqual(int(said[f"{struct}.{field[0]}"]), getattr(kind, field[0]).offset, f"{struct}.{field[0]}")


class Forces(PythonTest):
    def test_are_the_same_after_a_reset(self):
        positions = rubbed()
        with palpate.Session(self.cube, palpate.Tool(radius=0.1, friction=0.3)) as session:
            forces = session.play(positions)
            self.assertGreater(forces[-1, 2], 0.001)  # it is pressed
            self.assertLess(forces[-1, 0], -1e-4)  # and rubs
            session.reset()
            self.assertTrue(numpy.array_equal(session.play(positions), forces))

    def test_follow_a_tool_that_is_changed(self):
        slippery, rough = palpate.Tool(radius=0.1, friction=0.0), palpate.Tool(radius=0.1, friction=0.3)
        with palpate.Session(self.cube, rough) as one, palpate.Session(self.cube, slippery) as other:
            other.set_tool(0, rough)
            self.assertEqual(other.tools, [rough])
            self.assertTrue(numpy.array_equal(one.play(rubbed()), other.play(rubbed())))
            with self.assertRaisesRegex(palpate.Error, "keep radius"):
                other.set_tool(0, palpate.Tool(radius=0.2))
            with self.assertRaises(IndexError):
                other.set_tool(1, rough)
            other.reset()
            self.assertEqual(other.tools, [slippery])
            self.assertFalse(numpy.array_equal(one.play(rubbed()), other.play(rubbed())))

    def test_press_on_the_surface(self):
        with palpate.Session(self.cube, palpate.Tool(radius=0.1), stress_ticks=1) as session:
            tick, von_mises, pressure = session.stress()
            self.assertEqual(tick, -1)
            self.assertTrue(numpy.isnan(von_mises).all() and numpy.isnan(pressure).all())
            positions = rubbed()
            session.play(positions)
            for _ in range(6000):
                tick, von_mises, pressure = session.stress()
                if tick == len(positions) - 1:
                    break
                time.sleep(0.01)
            self.assertEqual(tick, len(positions) - 1)
            pressed = session.rest[int(numpy.argmax(pressure))]
            self.assertLess(abs(pressed - [0.6, 0.5, 1]).max(), 0.2)
            self.assertGreater(numpy.nanmax(von_mises), 0)

    def test_probe_is_the_inverse_of_the_greens_block(self):
        with palpate.Body(self.cube) as body:
            nodes = [int(numpy.argmin(numpy.linalg.norm(body.nodes - point, axis=1))) for point in ([0.5, 0.5, 1], [1, 0.5, 1])]
            block = body.greens(nodes)
        self.assertTrue(numpy.array_equal(block, block.T))
        wanted = numpy.array([[0, 0, -0.01], [0.005, 0, 0]])
        forces = palpate.probe(self.cube, wanted, node=nodes)
        numpy.testing.assert_allclose(numpy.linalg.solve(block, wanted.ravel()), forces.ravel(), rtol=1e-12)
        here = palpate.probe(self.cube, wanted, at=[[0.5, 0.5, 1], [1, 0.5, 1]])
        self.assertTrue(numpy.array_equal(forces, here))

    def test_two_tools_an_overlay_and_a_grab(self):
        (self.folder / "deep.toml").write_text(cube_toml(4, scope="full"))
        palpate.bake(self.folder / "deep.toml", self.folder / "deep.palpate.hdf")
        tools = [palpate.Tool(radius=0.1), palpate.Tool(reach=0.1)]
        with palpate.Session(self.folder / "deep.palpate.hdf", tools, overlay=palpate.Overlay(2, 1)) as session:
            session.put(1, (0.5, 1.0, 0.5), grab=True)
            session.step((0.5, 0.5, 1.2))
            for pull in range(50):
                session.put(1, (0.5, 1.0 + 0.001 * pull, 0.5), grab=True)
                session.step((0.5, 0.5, 1.2 - 0.003 * pull))
            self.assertGreater(session.felt(0).force[2], 0)
            self.assertLess(session.felt(1).force[1], 0)
            self.assertEqual(session.felt(1).contacts, 1)
            u = session.displacement()
            self.assertEqual(u.shape, session.rest.shape)
            held = session.rest[:, 2] == 0
            self.assertEqual(abs(u[held]).max(), 0)
            self.assertGreater(abs(u).max(), 0.01)
            self.assertLess(session.simplices.max(), len(u))
            with self.assertRaises(IndexError):
                session.felt(2)


class Meshes(PythonTest):
    """Bodies of arrays: the cube of the shared file again, and others of a few elements."""

    soft = {"material": {"youngs_modulus": 1.0, "poissons_ratio": 0.3}, "fixed": [{"lowest": {"axis": "z", "percent": 1}}]}

    def bake(self, points, elements, **description):
        file = self.folder / "in memory.palpate.hdf"
        palpate.bake_mesh(points, elements, file, force=True, **description)
        return palpate.Body(file)

    def test_finite_elements_become_the_same_body(self):
        with palpate.Body(self.cube) as cube:
            nodes, elements = cube.nodes, cube.elements
            told = tomllib.loads((self.shared / "cube.toml").read_text())
            description = {key: told[key] for key in ("material", "fixed", "storage")}
            with self.bake(nodes, elements, **description) as body:
                numpy.testing.assert_allclose(body.greens(body.stored_nodes), cube.greens(cube.stored_nodes), rtol=1e-9, atol=1e-12)
            half = (nodes[elements].mean(axis=1)[:, 0] < 0.5).astype(int)
            materials = [{"youngs_modulus": numpy.float64(E), "poissons_ratio": 0.3, "regions": [k]} for k, E in enumerate((1.0, 4.0))]
            with self.bake(1000 * nodes, elements, regions=half, geometry={"scale": 1e-3}, material=materials, fixed=description["fixed"]) as body:
                numpy.testing.assert_allclose(body.nodes, nodes, atol=1e-12)
                self.assertEqual(body.file["material/isotropic"][:, 0].tolist(), [1.0, 4.0])
        self.assertEqual(run(PRECOMPUTE, "verify", self.folder / "in memory.palpate.hdf").returncode, 0, "its sources are beside it")

    def test_a_surface_is_filled(self):
        points = numpy.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
        squares = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        triangles = numpy.array([corners for a, b, c, d in squares for corners in ((a, b, c), (a, c, d))], numpy.int32)
        with self.bake(points, triangles, mesh={"element": "tet10", "edge_length": 0.5, "remesh": True}, **self.soft) as body:
            self.assertEqual(body.elements.shape[1], 10)
            numpy.testing.assert_allclose([body.nodes.min(axis=0), body.nodes.max(axis=0)], [[0] * 3, [1] * 3], atol=1e-9)
        with self.bake(points, numpy.array([[0, 1, 3, 2, 4, 5, 7, 6]]), **self.soft) as body:
            self.assertEqual(body.elements.shape, (1, 8))
        with self.bake(points[:4, :2], [[0, 1, 3, 2]], plane="stress", thickness=0.1, material=self.soft["material"],
                       fixed=[{"lowest": {"axis": "y", "percent": 1}}]) as body:
            self.assertEqual(len(body.nodes), 4)

    def test_what_is_wrong_is_told(self):
        square = numpy.eye(4, 3)
        for points, elements, options, words in (
                (square, [[0, 1, 2, 3]], {"fixed": self.soft["fixed"]}, "material"), (square, [[0, 1, 2, 3]], {"colour": "red", **self.soft}, "colour"),
                (square, [[0, 1, 2, 9]], self.soft, "a node number"), (square * numpy.nan, [[0, 1, 2, 3]], self.soft, "mesh.vtk"),
                (square, [[0, 1, 2]], self.soft, "open"), (square, [[0.0, 1, 2, 3]], self.soft, "elements are"), (square.ravel(), [[0, 1, 2, 3]], self.soft, "points are"),
                (square, [[0, 1]], self.soft, "2 nodes"), (square, [[0, 1, 2, 3]], {"regions": [1, 2], **self.soft}, "regions are"),
                (square, [[0, 1, 2, 3]], {**self.soft, "name": object()}, "no value")):
            with self.subTest(words), self.assertRaisesRegex(palpate.Error, words):
                self.bake(points, elements, **options)
        with self.assertRaises(palpate.Error) as failed:
            self.bake(square, [[0, 1, 2, 3]], material=self.soft["material"])
        self.assertIn("[[fixed]]", failed.exception.hint, "all lines of it")
        self.write("in memory.mesh/model.toml", "mine")
        with self.assertRaisesRegex(palpate.Error, "not written by bake_mesh"):
            self.bake(square, [[0, 1, 2, 3]], **self.soft)


class Files(PythonTest):
    def test_progress_is_told(self):
        self.assertIn("written", "\n".join(self.lines))

    def test_body_is_what_h5py_reads(self):
        with h5py.File(self.cube) as file:
            packed = file["/greens/packed"][:]
        with palpate.Body(self.cube) as body:
            self.assertEqual((body.name, body.dimension), ("cube", 3))
            self.assertEqual(body.elements.shape[1], 4)
            corners = body.nodes[body.elements]
            self.assertAlmostEqual(numpy.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6, 1, 12)
            self.assertTrue(numpy.array_equal(body.held[:, 2], body.nodes[:, 2] == 0))
            n = 3 * len(body.stored_nodes)
            whole = numpy.zeros((n, n))
            whole[numpy.triu_indices(n)] = packed  # column after column of the lower triangle
            whole = numpy.maximum(whole, whole.T) + numpy.minimum(whole, whole.T) - numpy.diag(numpy.diag(whole))
            some = [5, 0, 17]
            dofs = [3 * place + axis for place in some for axis in range(3)]
            self.assertTrue(numpy.array_equal(body.greens(body.stored_nodes[some]), whole[numpy.ix_(dofs, dofs)]))
            inner = [node for node in range(len(body.nodes)) if node not in set(body.stored_nodes)][:1]
            with self.assertRaises(palpate.Error):
                body.greens(inner)

    def test_recording_has_the_ticks_of_play(self):
        script = self.write("touch.csv", "t,x,y,z\n0,0.5,0.5,1.2\n0.1,0.5,0.5,1.05\n")
        done = run(RUNTIME, "play", self.cube, "--device", f"script:{script}", "--tool", "sphere:0.1", "--fast", "--record", "touch.mcap",
                   cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        recording = palpate.read(self.folder / "touch.mcap")
        self.assertEqual(len(recording), 101)
        self.assertIn("status", list(recording))
        self.assertLess(recording["force"][-1, 2], 0)  # on the body
        self.assertIn("tool", recording.options)
        loads = recording.messages("/contacts")[-1]
        numpy.testing.assert_allclose(loads["force"].reshape(-1, 3).sum(0), recording["force"][loads["tick"]], rtol=1e-5, atol=1e-9)
        with self.assertRaisesRegex(palpate.Error, "--hdf5"):
            recording.frames
        with self.assertRaisesRegex(KeyError, "force"):
            recording["forse"]
        data = recording.xarray()
        self.assertEqual(set(data.variables) - {"axis", "quaternion", "symmetric"}, set(recording))
        self.assertTrue(numpy.array_equal(data.force.sel(axis="z"), recording["force"][:, 2]))
        self.assertTrue(numpy.array_equal(data.tool_orientation.sel(quaternion="w"), recording["tool_orientation"][:, 0]))
        self.assertTrue(numpy.array_equal(data.stiffness.sel(symmetric="zz"), recording["stiffness"][:, 2]))
        self.assertEqual(float(data.force.sel(time=0.1, axis="z")), recording["force"][-1, 2])
        self.assertEqual(data.attrs["tool"], "sphere:0.1")

    def test_open_body_and_session_bear_each_other(self):
        with palpate.Body(self.cube) as body, palpate.Session(self.cube, palpate.Tool(radius=0.1)) as session:
            session.step((0.5, 0.5, 1.05))
            self.assertGreater(len(body.nodes), 0)

    def test_what_is_wrong_is_told_with_a_hint(self):
        cases = [lambda: palpate.Session(self.folder / "none.palpate.hdf", palpate.Tool()), lambda: palpate.Body(self.folder / "none.h5"),
                 lambda: palpate.read(self.cube), lambda: palpate.bake(self.folder / "none.toml", self.folder / "none.palpate.hdf"),
                 lambda: palpate.probe(self.cube, [[0, 0, 1]], node=[10**6]), lambda: palpate.Session(self.cube, palpate.Tool(radius=-1))]
        for case in cases:
            with self.assertRaises(palpate.Error) as caught:
                case()
            self.assertTrue(caught.exception.reason)
            self.assertTrue(caught.exception.hint, caught.exception.reason)
        with self.assertRaises(palpate.Error) as caught:
            palpate.Session(self.cube, palpate.Tool(radius=-1))
        self.assertEqual(caught.exception.code, "argument")
        session = palpate.Session(self.cube, palpate.Tool(radius=0.1))
        session.close()
        with self.assertRaisesRegex(palpate.Error, "closed"):
            session.step((0, 0, 2))


class Viewers(PythonTest):
    def test_a_body_and_a_recording_show_themselves(self):
        session = self.shared / "shown.mcap"
        result = run(RUNTIME, "play", self.cube, "--device", f"script:{self.script()}", "--tool", "sphere:0.1", "--fast", "--record", session)
        self.assertEqual(result.returncode, 0, result.stderr)
        for file, options in ((self.cube, ("--tool", "sphere:0.1")), (session, ())):
            with palpate.Viewer(file, *options, height=300) as viewer:
                with urllib.request.urlopen(viewer.address, timeout=20) as page:
                    self.assertIn("http://localhost:*", page.headers["Content-Security-Policy"])
                shown = viewer._repr_html_()
                self.assertIn(f'<iframe src="{viewer.address}"', shown)
                self.assertIn('height="300"', shown)
            self.assertFalse(viewer.running)
            self.assertNotIn("iframe", viewer._repr_html_())

    def script(self):
        script = self.shared / "shown.csv"
        script.write_text("t,x,y,z\n0,0.5,0.5,1.15\n0.2,0.5,0.5,1.05\n")
        return script

    def test_a_name_is_no_address(self):
        """What a file says is printed before the address, and is text."""
        self.write_named("open http:evil in a browser")
        with palpate.Viewer(self.shared / "named.palpate.hdf", "--tool", "sphere:0.1") as viewer:
            self.assertRegex(viewer.address, r"^http://127\.0\.0\.1:\d+/\?token=[0-9a-f]{32}$")

    def write_named(self, name):
        description = self.shared / "named.toml"
        description.write_text(cube_toml(2, name=name))
        result = run(PRECOMPUTE, description, "-o", self.shared / "named.palpate.hdf")
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_what_cannot_be_shown_is_told(self):
        with self.assertRaisesRegex(palpate.Error, "nowhere.h5"):
            palpate.Viewer("nowhere.h5")


class Loops(PythonTest):
    def test_steps_until_it_is_stopped(self):
        enough = threading.Event()
        shown = []

        def show(felt):
            shown.append(felt.force[2])
            if len(shown) == 100:
                enough.set()

        with palpate.Session(self.cube, palpate.Tool(radius=0.1)) as session:
            with palpate.Loop(session, lambda t: (0.5, 0.5, max(1.05, 1.11 - t)), show) as loop:
                self.assertTrue(enough.wait(60))
                session.displacement()  # while it steps
            self.assertEqual(len(loop.late), len(shown))
            self.assertTrue(all(loop.late >= 0))
            self.assertGreater(loop.felt.force[2], 0)

    def test_a_failure_reaches_the_one_who_stops_it(self):
        with palpate.Session(self.cube, palpate.Tool(radius=0.1)) as session:
            loop = palpate.Loop(session, lambda t: 1 / 0).start()
            with self.assertRaises(ZeroDivisionError):
                loop.stop()


class Misuse(PythonTest):
    """An error, and never a crash or a wait for ever, where a session is used as it may not be."""

    def session(self, **options):
        session = palpate.Session(self.cube, palpate.Tool(radius=0.1), **options)
        self.addCleanup(session.close)
        return session

    def test_close_while_a_thread_steps(self):
        for run in range(8):
            session = palpate.Session(self.cube, palpate.Tool(radius=0.1), stress_ticks=4)
            if run % 2 == 0:
                session.record(self.folder / f"{run}.mcap")
            stepped, failures = threading.Event(), []

            def step(session=session, stepped=stepped, failures=failures):
                try:
                    while True:
                        session.step((0.5, 0.5, 1.08))
                        stepped.set()
                except palpate.Error as error:
                    failures.append(error)

            threads = [threading.Thread(target=step)]
            threads[0].start()
            stepped.wait()
            session.displacement()
            closers = [threading.Thread(target=session.close) for _ in range(3)]
            for thread in closers:
                thread.start()
            for thread in threads + closers:
                thread.join()
            self.assertEqual([(error.reason, error.code) for error in failures], [("the session is closed", "state")])

    def test_close_while_a_loop_steps(self):
        session = self.session()
        stepped = threading.Event()
        loop = palpate.Loop(session, lambda t: (0.5, 0.5, 1.08), lambda felt: stepped.set()).start()
        stepped.wait()
        session.close()
        loop._thread.join()  # it ends by itself
        with self.assertRaisesRegex(palpate.Error, "the session is closed"):
            loop.stop()

    def test_two_threads_that_step(self):
        session = self.session()
        failures = []

        def step():
            try:
                while not failures:
                    session.step((0.5, 0.5, 1.05))
            except palpate.Error as error:
                failures.append(error)

        threads = [threading.Thread(target=step) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertIn("another thread", failures[0].reason)
        self.assertEqual(failures[0].code, "state")
        session.reset()
        positions = rubbed()
        self.assertTrue(numpy.array_equal(session.play(positions), self.session().play(positions)))

    def test_use_after_close(self):
        session = palpate.Session(self.cube, palpate.Tool())
        session.close()
        session.close()
        for use in (lambda: session.step((0, 0, 2)), lambda: session.felt(0), session.contacts, lambda: session.set_tool(0, palpate.Tool()), session.reset,
                    lambda: session.record(self.folder / "a.mcap"), session.end_recording, lambda: session.rest, lambda: session.simplices,
                    session.displacement, session.stress):
            with self.assertRaisesRegex(palpate.Error, "the session is closed"):
                use()

    def test_a_process_that_forks_leaves_the_session_alone(self):
        session = self.session(stress_ticks=1)
        child = os.fork()
        if child == 0:
            session.close()  # whose threads are those of the parent
            os._exit(0)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        session.step((0.5, 0.5, 1.2))

    def test_numbers_are_not_cut(self):
        for make in (lambda: self.session(max_contacts=2**32 + 5), lambda: self.session(stress_ticks=2**64 + 1), lambda: self.session(stress_ticks=-1),
                     lambda: self.session(overlay=palpate.Overlay(2**32 + 2, 1)), lambda: self.session(overlay=palpate.Overlay(2, 2**32 + 1)),
                     lambda: self.session(overlay=palpate.Overlay(2, 1, -1))):
            with self.assertRaises(palpate.Error) as failed:
                make()
            self.assertEqual(failed.exception.code, "argument")
        with self.assertRaises(TypeError):
            self.session(max_contacts=8.5)
        session = self.session()
        for number in (-1, 1, 2**32, 2**40, -2**32):
            for use in (lambda: session.felt(number), lambda: session.contacts(number), lambda: session.put(number, (0, 0, 2)), lambda: session.set_tool(number, session.tools[0])):
                with self.assertRaises(IndexError):
                    use()
            with self.assertRaises(palpate.Error):
                session.record(self.folder / "a.mcap", tool=number)
        with self.assertRaises(TypeError):
            palpate.probe(self.cube, [(0, 0, -0.01)], node=[1.5])
        self.assertFalse((self.folder / "a.mcap").exists())

    def test_poses_are_whole(self):
        session = self.session()
        for position in (0.05, (0.5,), (0.5, 0.5), (1, 2, 3, 4), [(0.5, 0.5, 1.2)]):
            with self.assertRaisesRegex(palpate.Error, "3 numbers"):
                session.step(position)
        with self.assertRaisesRegex(palpate.Error, "3 numbers"):
            session.step((0, 0, 2), 1.0)
        with self.assertRaisesRegex(palpate.Error, "3 numbers"):
            session.play(numpy.linspace(1.2, 1.05, 10))
        with self.assertRaisesRegex(palpate.Error, "2 or 3 numbers"):
            palpate.probe(self.cube, [0, 0, -0.01], at=[(0.5, 0.5, 1)])

    def test_in_the_plane_two_numbers_are_enough(self):
        plate = SOURCE / "tests" / "golden" / "plate2" / "plate2.palpate.hdf"
        with palpate.Session(plate, palpate.Tool(radius=0.1)) as session, palpate.Session(plate, palpate.Tool(radius=0.1)) as other:
            path = numpy.column_stack([numpy.full(200, 0.5), numpy.linspace(1.25, 1.05, 200)])
            forces = session.play(path)
            numpy.testing.assert_array_equal(forces, other.play(numpy.column_stack([path, numpy.zeros(200)])))
        self.assertGreater(forces[-1][1], 0)

    def test_an_installed_library_is_the_one_for_this_processor(self):
        asked = []
        def refuse(name):
            asked.append(name)
            raise OSError

        prefixes = [pathlib.Path("/usr"), pathlib.Path("/opt/palpate")]
        with unittest.mock.patch("palpate.library.prefixes", return_value=prefixes), \
                unittest.mock.patch("pathlib.Path.exists", return_value=True), unittest.mock.patch("ctypes.CDLL", refuse), \
                self.assertRaises(palpate.Error):
            palpate.library.load()
        self.assertEqual(asked[0], "libpalpate.so.0", "the loader knows variants (glibc-hwcaps), a path is one of them")
        self.assertIn("/opt/palpate/lib/libpalpate.so.0", asked)

    def test_types_are_those_of_arrays(self):
        self.assertEqual(typing.get_type_hints(palpate.Session.put)["position"], ArrayLike)
        self.assertEqual(typing.get_type_hints(palpate.Session.step)["position"], typing.Optional[ArrayLike])
        hints = typing.get_type_hints(palpate.Session.play)
        self.assertEqual((hints["positions"], hints["return"]), (ArrayLike, NDArray[numpy.float64]))
        self.assertEqual(typing.get_type_hints(palpate.Felt)["force"], NDArray[numpy.float64])
        self.assertEqual(typing.get_type_hints(palpate.probe)["return"], NDArray[numpy.float64])
        self.assertIn(palpate.__version__, run(RUNTIME, "--version").stdout)

    def test_a_small_stack_is_enough(self):
        client = compiled(self.folder, SMALL_STACK)
        result = run(client, self.cube, self.folder / "small.mcap")
        self.assertEqual((result.returncode, result.stdout), (0, ""))
        self.assertEqual(len(palpate.read(self.folder / "small.mcap")), 200)

    def test_errors_name_nothing_of_c(self):
        for tools in ([], palpate.Tool(radius=-1.0)):
            with self.assertRaises(palpate.Error) as failed:
                palpate.Session(self.cube, tools)
            self.assertNotRegex(failed.exception.reason, r"palpate_|State|1\.0000")

    def test_a_name_ends_at_its_end(self):
        session = self.session()
        for use in (lambda: palpate.Session(f"{self.cube}\0b", palpate.Tool()), lambda: session.record(f"{self.folder}/a.mcap\0b"),
                    lambda: palpate.Body(f"{self.cube}\0b"), lambda: palpate.bake(f"{self.shared}/cube.toml\0", self.folder / "b.hdf"),
                    lambda: palpate.probe(f"{self.cube}\0", [(0, 0, 1)], at=[(0, 0, 1)]), lambda: palpate.Viewer(f"{self.cube}\0")):
            with self.assertRaisesRegex(palpate.Error, "zero byte"):
                use()
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_name_that_begins_with_a_dash_is_a_name(self):
        before = os.getcwd()
        os.chdir(self.folder)
        self.addCleanup(os.chdir, before)
        for name in ("--help", "-o", "--version"):
            for use in (lambda: palpate.bake(name, "o.hdf"), lambda: palpate.probe(name, [(0, 0, 1)], at=[(0, 0, 1)]), lambda: palpate.Viewer(name)):
                with self.assertRaisesRegex(palpate.Error, name):
                    use()
        pathlib.Path("--help").write_text(cube_toml(2))
        palpate.bake("--help", "-o")
        self.assertEqual(len(palpate.probe("-o", [(0, 0, -0.01)], at=[(0.5, 0.5, 1)])), 1)


if __name__ == "__main__":
    unittest.main()
