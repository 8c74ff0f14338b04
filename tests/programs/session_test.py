"""Recordings as a person meets them: killed, opened with h5py, described for ParaView, drawn."""

import json
import random
import signal
import subprocess
import time
import xml.etree.ElementTree

import h5py
import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from programs import RUNTIME, SOURCE, ProgramTest, cube_toml, recorded, run

TOUCH = "t,x,y,z,grab\n0,0.4,0.5,1.3,0\n0.1,0.4,0.5,1.15,0\n0.4,0.6,0.5,1.15,1\n0.5,0.6,0.5,1.3,1\n"
PLANE = "t,x,y,z\n0,0.5,1.3,0\n0.2,0.5,1.1,0\n"
SQUARE = """name = "square"
plane = "strain"
[geometry]
rectangle = { size = [1, 1], cells = [6, 6] }
[material]
youngs_modulus = 1
poissons_ratio = 0.3
[[fixed]]
half_space = { point = [0, 0], normal = [0, -1] }
"""


def evaluate(item, folder):
    """The numbers of an XDMF DataItem, by the format's description: HDF, HyperSlab and the Function that adds."""
    kind, own = item.get("ItemType", "Uniform"), item.findall("DataItem")
    if kind == "Function":
        assert item.get("Function") == "$0 + $1" and len(own) == 2, item.attrib
        values = evaluate(own[0], folder) + evaluate(own[1], folder)
    elif kind == "HyperSlab":
        start, stride, count = numpy.array(own[0].text.split(), int).reshape(3, -1)
        whole = evaluate(own[1], folder)
        values = whole[tuple(slice(s, s + n * by, by) for s, by, n in zip(start, stride, count))]
    else:
        file, dataset = item.text.strip().split(":")
        with h5py.File(folder / file) as hdf:
            values = hdf[dataset][:]
    return values.reshape([int(size) for size in item.get("Dimensions").split()])


class Session(ProgramTest):
    def play(self, file, *arguments, script=TOUCH):
        self.write("touch.csv", script)
        result = run(RUNTIME, "play", file, "--device", "script:touch.csv", "--tool", "sphere:0.15", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def session(self, *arguments):
        result = run(RUNTIME, "session", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_says_what_is_in_it(self):
        file = self.bake(cube_toml(4, scope="full"))
        report = json.loads(self.play(file, "--fast", "--record", "out.h5", "--overlay", "r=2,rings=1", "--report", "-").stdout)
        told = json.loads(self.session("out.h5", "--json"))
        for name in ("ticks", "ticks_in_contact", "largest_force_N", "largest_force_time_s"):
            self.assertEqual(told[name], report[name], name)
        self.assertEqual((told["missing_ticks"], told["rate"], told["seconds"]), (0, 1000, 0.501))
        self.assertEqual((told["deadline_misses"], told["worst_lateness_ns"], told["faults"]), (0, 0, []))
        self.assertEqual((told["device"], told["was_killed"], told["frames"]), ("script:touch.csv", False, 30))
        self.assertIn("\noverlay=r=2,rings=1\n", told["options"])
        lines = self.session("out.h5").splitlines()
        self.assertLess(len(lines), 15)
        for piece in ("finished, by palpate", "501 at 1000 a second: 0.501 s, 0 missing", "script:touch.csv",
                      f"{report['largest_force_N']:.6g} N at {report['largest_force_time_s']:.3f} s", "faults           none",
                      "30 of 386 surface nodes; for ParaView: out.xdmf"):
            self.assertIn(piece, "\n".join(lines))

    def test_frames_are_what_the_surface_file_shows(self):
        for toml, script, corners in ((cube_toml(4), TOUCH, 3), (SQUARE, PLANE, 2)):
            file = self.bake(toml)
            self.play(file, "--fast", "--record", "out.h5", "--record-frames", "1000", "--surface", "out.vtu", script=script)
            reader = vtk.vtkXMLUnstructuredGridReader()
            reader.SetFileName(str(self.folder / "out.vtu"))
            reader.Update()
            grid = reader.GetOutput()
            with h5py.File(self.folder / "out.h5") as recording:
                frames = recording["frames"]
                numpy.testing.assert_array_equal(frames["tick"], numpy.arange(len(recording["ticks/time"])))
                numpy.testing.assert_array_equal(frames["time"], recording["ticks/time"])
                numpy.testing.assert_array_equal(recording["surface/nodes"], vtk_to_numpy(grid.GetPoints().GetData()))
                self.assertEqual(recording["surface/simplices"].shape, (grid.GetNumberOfCells(), corners))
                u = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
                self.assertGreater(numpy.abs(u).max(), 0.001)
                numpy.testing.assert_allclose(frames["displacement"][-1], u, rtol=1e-6, atol=1e-9)
                for name in ("von_mises", "pressure"):
                    numpy.testing.assert_array_equal(frames[name][-1], vtk_to_numpy(grid.GetPointData().GetArray(name)))
                held = recording["surface/held"][:] == 2**corners - 1
                self.assertTrue(numpy.isnan(frames["von_mises"][-1][held]).any())
                self.assertGreater(numpy.nanmax(frames["von_mises"][-1]), 0)
                self.assertTrue((numpy.isfinite(frames["von_mises"][-1]) | held).all())

    def test_description_for_paraview(self):
        for toml, script, kind in ((cube_toml(3), TOUCH, "Triangle"), (SQUARE, PLANE, "Polyline")):
            file = self.bake(toml)
            name = "Länge & 'so' 50% <1>.h5"
            self.play(file, "--fast", "--record", name, script=script)
            path = (self.folder / name).with_suffix(".xdmf")
            grids = xml.etree.ElementTree.parse(path).getroot().find("Domain").find("Grid")
            self.assertEqual((grids.get("GridType"), grids.get("CollectionType")), ("Collection", "Temporal"))
            with h5py.File(self.folder / name) as recording:
                surface, frames = recording["surface"], recording["frames"]
                self.assertEqual(len(grids), len(frames["time"]))
                for k, grid in enumerate(grids):
                    self.assertEqual(float(grid.find("Time").get("Value")), frames["time"][k])
                    topology = grid.find("Topology")
                    self.assertEqual((topology.get("TopologyType"), int(topology.get("NumberOfElements"))),
                                     (kind, len(surface["simplices"])))
                    numpy.testing.assert_array_equal(evaluate(topology.find("DataItem"), self.folder), surface["simplices"])
                    attributes = {a.get("Name"): evaluate(a.find("DataItem"), self.folder) for a in grid.findall("Attribute")}
                    self.assertEqual(sorted(attributes), ["contact pressure", "displacement", "von Mises stress"])
                    for name, dataset in (("displacement", "displacement"), ("von Mises stress", "von_mises"), ("contact pressure", "pressure")):
                        numpy.testing.assert_array_equal(attributes[name], frames[dataset][k])
                    x = evaluate(grid.find("Geometry").find("DataItem"), self.folder)
                    numpy.testing.assert_array_equal(x, surface["nodes"][:] + frames["displacement"][k])
            size = path.stat().st_size / len(grids)
            self.assertLess(size, 1200, "bytes a frame")

    def test_frames_can_be_left_out(self):
        file = self.bake(cube_toml(3))
        self.play(file, "--fast", "--record", "out.h5", "--record-frames", "0")
        self.assertFalse((self.folder / "out.xdmf").exists())
        self.assertIn("frames           none", self.session("out.h5"))
        result = run(RUNTIME, "play", file, "--device", "script:touch.csv", "--record-frames", "-1", cwd=self.folder)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--record-frames: '-1' is not a number from 0 on", result.stderr)

    def check_killed(self, path):
        """Rows are those from the first tick on, the same number in each dataset, and of ticks that were."""
        with h5py.File(path) as recording:
            ticks = {name: data[:] for name, data in recording["ticks"].items()}
            rows = len(ticks["time"])
            numpy.testing.assert_array_equal(ticks["time"], numpy.arange(rows) / 1000)
            for name, values in ticks.items():
                self.assertEqual(len(values), rows, name)
            for name in ("device_orientation", "handle_orientation", "tool_orientation"):
                numpy.testing.assert_allclose(numpy.linalg.norm(ticks[name], axis=1), 1)
            numpy.testing.assert_allclose(ticks["handle_position"][:, 2], 1.3 - 0.0002 * ticks["time"], rtol=1e-12)
            frames = recording["frames"]
            numpy.testing.assert_array_equal(frames["time"][:], frames["tick"][:] / 1000)
            self.assertTrue((numpy.diff(frames["tick"]) >= 17).all())
            self.assertTrue(numpy.isfinite(frames["displacement"][:]).all())
            return rows, len(frames["time"])

    def test_killed_at_any_moment(self):
        file = self.bake(cube_toml(4))
        script = self.write("long.csv", "t,x,y,z\n0,0.5,0.5,1.3\n600,0.5,0.5,1.18\n")
        out = self.folder / "out.h5"
        chance, most = random.Random(1), 0
        for _ in range(6):
            out.unlink(missing_ok=True)
            process = subprocess.Popen([RUNTIME, "play", file, "--device", f"script:{script}", "--record", "out.h5"],
                                       cwd=self.folder, stderr=subprocess.PIPE)
            ticks = chance.randrange(2500)
            self.wait_for(lambda: out.exists() and len(recorded(out, "ticks/time")) >= ticks, process)
            time.sleep(chance.uniform(0.0, 0.6))  # a checkpoint each half second
            process.send_signal(signal.SIGKILL)
            process.communicate()
            rows, frames = self.check_killed(out)
            most = max(most, rows)
            told = json.loads(self.session("out.h5", "--json"))
            self.assertEqual((told["ticks"], told["frames"], told["was_killed"]), (rows, frames, True))
            self.assertEqual(self.check_killed(out), (rows, frames))
            self.assertFalse((self.folder / "out.h5.parts").exists())
            self.assertEqual((self.folder / "out.xdmf").exists(), frames > 0)
        self.assertGreater(most, 0)

    def test_while_it_is_recorded(self):
        file = self.bake(cube_toml(4))
        script = self.write("long.csv", "t,x,y,z\n0,0.5,0.5,1.3\n600,0.5,0.5,1.18\n")
        play = [RUNTIME, "play", file, "--device", f"script:{script}", "--record", "out.h5", "--report", "-"]
        process = subprocess.Popen(play, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            for _ in range(600):
                time.sleep(0.1)
                if (self.folder / "out.h5").exists() and json.loads(self.session("out.h5", "--json"))["ticks"] > 0:
                    break
            told = json.loads(self.session("out.h5", "--json"))
            self.assertTrue(told["going_on"] and told["ticks"] > 0)
            self.assert_refused(run(*play, cwd=self.folder), "out.h5", "is being recorded by another program")
        finally:
            process.send_signal(signal.SIGTERM)
            output, _ = process.communicate(timeout=60)
        self.assertFalse(json.loads(self.session("out.h5", "--json"))["was_killed"])
        self.assertEqual(self.check_killed(self.folder / "out.h5")[0], json.loads(output)["ticks"])

    def test_refuses_what_is_no_recording(self):
        file = self.bake(cube_toml(3))
        self.assert_refused(run(RUNTIME, "session", file, cwd=self.folder), "is a model, not a recording", "play")
        self.assert_refused(run(RUNTIME, "session", "none.h5", cwd=self.folder), "none.h5")

    def test_plots(self):
        file = self.bake(cube_toml(4))
        self.play(file, "--record", "out.h5")
        with h5py.File(self.folder / "out.h5", "r+") as recording:  # as if a device had failed
            recording["ticks/fault"][300:] = 1
            recording["ticks/phase"][300:] = 3
        for kind in ("session", "force"):
            result = run(SOURCE / "scripts" / "plot", kind, "out.h5", f"{kind}.png", cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(result.stderr, "")
            reader = vtk.vtkPNGReader()
            reader.SetFileName(str(self.folder / f"{kind}.png"))
            reader.Update()
            pixels = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
            self.assertGreater(len(numpy.unique(pixels, axis=0)), 100, "an empty picture")
