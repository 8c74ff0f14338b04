"""Recordings as other programs read them: glTF and grids by VTK's readers, the table by numpy, HDF5 by h5py."""

import json
import re
import struct
import unittest
import xml.etree.ElementTree

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOGeometry import vtkGLTFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from programs import RUNTIME, SOURCE, ProgramTest, palpate, pictures, run

SCRIPT = "t,x,y,z\n0,0.5,0.5,1.25\n0.2,0.5,0.5,1.05\n0.4,0.7,0.5,1.05\n"


class ExportTest(ProgramTest):
    def record(self, tool="sphere:0.1", body="cube2", script=SCRIPT, options=()):
        self.write("script.csv", script)
        file = SOURCE / "tests" / "golden" / body / f"{body}.palpate.hdf"
        done = run(RUNTIME, "play", file, "--device", "script:script.csv", "--tool", tool, "--fast", "--record", "touch.mcap", "--force",
                   *options, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        shown = pictures(self.folder / "touch.mcap")
        self.rest, self.simplices = shown["surface/nodes"], shown["surface/simplices"]
        self.frames = {name: shown[f"frames/{name}"] for name in ("time", "displacement", "von_mises", "pressure")}
        self.ticks = palpate.read(self.folder / "touch.mcap")

    def export(self, *arguments):
        return run(RUNTIME, "export", "touch.mcap", *arguments, cwd=self.folder)

    def exported(self, *arguments):
        done = self.export(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr

    def chosen(self, fps):
        """Numbers of the frames that are at least 1 / fps apart."""
        chosen = []
        for frame, time in enumerate(self.frames["time"]):
            if not chosen or time - self.frames["time"][chosen[-1]] >= (1 - 1e-6) / fps:
                chosen.append(frame)
        return chosen

    def places(self, frame):
        return self.rest + self.frames["displacement"][frame]


def y_up(places):
    return numpy.stack([places[:, 0], places[:, 2], -places[:, 1]], 1)


def leaves(block):
    """The meshes of VTK's tree."""
    if not block.IsA("vtkMultiBlockDataSet"):
        return [block]
    return [leaf for k in range(block.GetNumberOfBlocks()) if block.GetBlock(k) is not None for leaf in leaves(block.GetBlock(k))]


class Gltf(ExportTest):
    def document(self, name):
        """Its JSON part, after what the specification asks of the file's parts and of each accessor."""
        data = (self.folder / name).read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        self.assertEqual((magic, version, length), (b"glTF", 2, len(data)))
        size, kind = struct.unpack_from("<I4s", data, 12)
        self.assertEqual((kind, size % 4), (b"JSON", 0))
        document = json.loads(data[20:20 + size])
        binary_size, kind = struct.unpack_from("<I4s", data, 20 + size)
        self.assertEqual((kind, binary_size % 4, 28 + size + binary_size), (b"BIN\0", 0, len(data)))
        binary = data[28 + size:]
        self.assertEqual(len(document["buffers"]), 1)
        self.assertTrue(0 <= binary_size - document["buffers"][0]["byteLength"] < 4)
        self.numbers = []
        for accessor in document["accessors"]:
            view = document["bufferViews"][accessor["bufferView"]]
            width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
            self.assertEqual(view["byteLength"], 4 * width * accessor["count"])
            self.assertEqual(view["byteOffset"] % 4, 0)
            dtype = {5126: numpy.float32, 5125: numpy.uint32}[accessor["componentType"]]
            numbers = numpy.frombuffer(binary, dtype, width * accessor["count"], view["byteOffset"]).reshape(-1, width)
            if "min" in accessor:
                numpy.testing.assert_array_equal(numpy.array(accessor["min"], numpy.float32), numbers.min(0))
                numpy.testing.assert_array_equal(numpy.array(accessor["max"], numpy.float32), numbers.max(0))
            self.numbers.append(numbers)
        return document

    def read(self, name, time):
        """Points of surface and tool as VTK has them at a time of the animation."""
        reader = vtkGLTFReader()
        reader.SetFileName(str(self.folder / name))
        reader.SetApplyDeformationsToGeometry(True)
        reader.SetFrameRate(1000)
        reader.UpdateInformation()
        self.assertEqual(reader.GetNumberOfAnimations(), 1)
        reader.EnableAnimation(0)
        reader.UpdateInformation()
        reader.UpdateTimeStep(time)
        return [vtk_to_numpy(leaf.GetPoints().GetData()) for leaf in leaves(reader.GetOutput())]

    def test_moves_as_the_recording_does(self):
        self.record()
        self.assertRegex(self.exported("--gltf", "touch.glb"), r"^touch\.glb: \d+ pictures, 0\.4 s, ")
        document = self.document("touch.glb")
        mesh = document["meshes"][0]["primitives"][0]
        times = self.numbers[document["animations"][0]["samplers"][0]["input"]].ravel()
        self.assertEqual(len(times), len(mesh["targets"]))
        numpy.testing.assert_array_equal(self.numbers[mesh["indices"]].reshape(-1, 3), self.simplices)
        normals = self.numbers[mesh["attributes"]["NORMAL"]]
        numpy.testing.assert_allclose(numpy.linalg.norm(normals, axis=1), 1, atol=1e-6)
        self.assertGreater((normals * (self.rest - self.rest.mean(0))).sum(1).min(), 0, "outward")
        moved = 0
        for time in times[:: len(times) // 4]:
            frame = numpy.argmin(abs(self.frames["time"] - time))
            surface, tool = self.read("touch.glb", float(time))
            numpy.testing.assert_allclose(surface, y_up(self.places(frame)), atol=2e-6)
            tick = numpy.argmin(abs(self.ticks["time"] - self.frames["time"][frame]))
            middle = 0.5 * (tool.min(0) + tool.max(0))
            numpy.testing.assert_allclose(middle, y_up(self.ticks["tool_position"][tick : tick + 1])[0], atol=1e-5)
            numpy.testing.assert_allclose(tool.max(0) - tool.min(0), 0.2, atol=1e-5)
            moved = max(moved, abs(surface - y_up(self.rest)).max())
        self.assertGreater(moved, 0.01)
        between = 0.5 * (self.read("touch.glb", float(times[-2]))[0] + self.read("touch.glb", float(times[-1]))[0])
        numpy.testing.assert_allclose(self.read("touch.glb", float(0.5 * (times[-2] + times[-1])))[0], between, atol=2e-6)

    def test_tools_have_their_shape(self):
        for tool, size in (("capsule:0.1,0.3", (0.2, 0.2, 0.5)), ("disc:0.3,0.05", (0.6, 0.6, 0.1)), ("point", None)):
            with self.subTest(tool=tool):
                self.record(tool)
                self.exported("--gltf", "touch.glb", "--to", "0.1")
                document = self.document("touch.glb")
                primitive = document["meshes"][1]["primitives"][0]
                places = self.numbers[primitive["attributes"]["POSITION"]].astype(float)
                corners = places[self.numbers[primitive["indices"]].reshape(-1, 3)]
                volume = numpy.linalg.det(corners).sum() / 6
                self.assertGreater(volume, 0, "triangles face outwards")
                if size is None:
                    continue
                numpy.testing.assert_allclose(places.max(0) - places.min(0), size, atol=1e-6)
                expected = {"capsule:0.1,0.3": numpy.pi * 0.01 * 0.3 + 4 / 3 * numpy.pi * 0.001,
                            # a cylinder of 0.25 within a ring whose edge is a half circle of 0.05 (Pappus)
                            "disc:0.3,0.05": numpy.pi * 0.0625 * 0.1 + 2 * numpy.pi * (0.25 + 4 * 0.05 / (3 * numpy.pi)) * numpy.pi * 0.0025 / 2}[tool]
                self.assertAlmostEqual(volume / expected, 1, delta=0.02)

    def test_a_plane_body_is_lines(self):
        self.record("sphere:0.1", "plate2", "t,x,y,z\n0,0.5,1.25,0\n0.2,0.5,1.05,0\n")
        self.exported("--gltf", "touch.glb")
        primitive = self.document("touch.glb")["meshes"][0]["primitives"][0]
        self.assertEqual(primitive["mode"], 1)
        self.assertNotIn("NORMAL", primitive["attributes"])
        numpy.testing.assert_array_equal(self.numbers[primitive["indices"]].reshape(-1, 2), self.simplices)

    def test_too_many_pictures_are_refused(self):
        self.record(script="t,x,y,z\n0,0.5,0.5,1.25\n17,0.5,0.5,1.2\n")
        self.assert_refused(self.export("--gltf", "touch.glb", "--fps", "100"), "pictures were asked for as glTF", "1000 by a lower --fps")
        self.assertFalse((self.folder / "touch.glb").exists())


class Series(ExportTest):
    def read(self, name):
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(self.folder / name))
        reader.Update()
        return reader.GetOutput()

    def test_has_each_picture_at_its_time(self):
        self.record()
        self.exported("--vtu", "touch.pvd", "--fps", "10")
        listed = xml.etree.ElementTree.parse(self.folder / "touch.pvd").getroot().findall("./Collection/DataSet")
        self.assertEqual(len(listed), len(self.chosen(10)))
        self.assertGreater(len(listed), 3)
        for entry, frame in zip(listed, self.chosen(10)):
            self.assertEqual(float(entry.get("timestep")), self.frames["time"][frame])
            grid = self.read(entry.get("file"))
            numpy.testing.assert_allclose(vtk_to_numpy(grid.GetPoints().GetData()), self.places(frame), atol=1e-7)
            self.assertEqual(grid.GetNumberOfCells(), len(self.simplices))
            for name in ("displacement", "von_mises", "pressure"):
                numpy.testing.assert_array_equal(vtk_to_numpy(grid.GetPointData().GetArray(name)), self.frames[name][frame], name)
        self.assertGreater(self.frames["pressure"].max(), 0)

    def test_a_shorter_series_takes_the_place_of_a_longer_one_and_of_nothing_else(self):
        self.record()
        self.exported("--vtu", "touch.pvd", "--fps", "10")
        self.exported("--vtu", "touch.pvd", "--fps", "5")
        self.assertLess(len(self.chosen(5)), len(self.chosen(10)))
        self.assertEqual(sorted(file.name for file in (self.folder / "touch.frames").iterdir()),
                         [f"{k:05}.vtu" for k in range(len(self.chosen(5)))])
        self.write("touch.frames/mine.txt", "mine")
        self.assert_refused(self.export("--vtu", "touch.pvd"), "touch.frames: has files that are no pictures", "--force")
        self.write("taken.frames", "a file")
        self.assert_refused(self.export("--vtu", "taken.pvd", "--force"), "taken.frames: is a file", "another --vtu")
        self.exported("--vtu", "touch.pvd", "--force")
        self.assertEqual((self.folder / "touch.frames" / "mine.txt").read_text(), "mine")


class Table(ExportTest):
    def test_has_the_ticks_to_the_last_bit(self):
        self.record()
        self.assertEqual(self.exported("--csv", "touch.csv"), "touch.csv: 401 ticks\n")
        table = numpy.genfromtxt(self.folder / "touch.csv", delimiter=",", names=True)
        for name in ("time", "contacts", "status"):
            numpy.testing.assert_array_equal(table[name], self.ticks[name])
        for name, field in (("force", "force"), ("tool", "tool_position")):
            for k, axis in enumerate("xyz"):
                numpy.testing.assert_array_equal(table[f"{name}_{axis}"], self.ticks[field][:, k])
        self.assertGreater(abs(table["force_z"]).max(), 0)
        self.exported("--csv", "touch.csv", "--from", "0.1", "--to", "0.2")
        table = numpy.genfromtxt(self.folder / "touch.csv", delimiter=",", names=True)
        self.assertEqual((len(table), table["time"][0], table["time"][-1]), (101, 0.1, 0.2))

    def test_what_cannot_be(self):
        self.record()
        self.assert_refused(self.export("--csv", "touch.csv", "--from", "7"), "has no ticks in that time", "session")
        self.write("mine.csv", "a,b\n1,2\n")
        self.assert_refused(self.export("--csv", "mine.csv"), "mine.csv")
        self.assertEqual((self.folder / "mine.csv").read_text(), "a,b\n1,2\n")
        self.assert_refused(self.export("--gltf", "touch.mcap"), "touch.mcap")
        asked_for_nothing = self.export()
        self.assertEqual(asked_for_nothing.returncode, 2)
        self.assertIn("--gltf", asked_for_nothing.stderr)


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


class Hdf5(ExportTest):
    def test_has_each_tick_and_what_the_run_was(self):
        self.record()
        self.assertRegex(self.exported("--hdf5", "touch.h5"), r"^touch\.h5: 401 ticks, \d+ pictures\n$")
        with h5py.File(self.folder / "touch.h5") as hdf:
            self.assertEqual(set(hdf["ticks"]), set(self.ticks))
            for name, values in hdf["ticks"].items():
                numpy.testing.assert_array_equal(values, self.ticks[name], name)
                self.assertEqual(values.dtype, self.ticks[name].dtype, name)
            self.assertEqual(hdf.attrs["format"], b"palpate-recording")
            for name in ("generator", "model", "content_hash", "device", "options", "units"):
                self.assertEqual(hdf.attrs[name].decode(), self.ticks.info[name])
            self.assertEqual(hdf.attrs["rate"], 1000)
            for name, values in self.ticks.surface.items():
                numpy.testing.assert_array_equal(hdf["surface"][name], values, name)
            told = hdf["frames/tick"][:]
        looked_at = [message["tick"] for message in self.ticks.messages("/contacts")]
        numpy.testing.assert_array_equal(told, looked_at)
        self.assertEqual([file.name for file in self.folder.glob("*.partial*")], [])

    def test_is_what_the_reference_says(self):
        self.record()
        self.exported("--hdf5", "touch.h5")
        page = (SOURCE / "docs" / "reference" / "recording-fields.md").read_text()
        rows = {name: rest.split(" | ") for name, rest in re.findall(r"^\| `([^`]+)` \| (.*) \|$", page, re.MULTILINE)}
        with h5py.File(self.folder / "touch.h5") as hdf:
            found = {}
            hdf.visititems(lambda name, item: found.update({f"/{name}": item}) if isinstance(item, h5py.Dataset) else None)
            self.assertEqual(set(rows), set(found) | set(hdf.attrs))
            for name, item in found.items():
                kind, shape = rows[name][:2]
                self.assertEqual((str(item.dtype), item.ndim), (kind, shape.count(", ") + 1), name)
                for size, words in zip(item.shape, shape.split(", ")):
                    self.assertTrue(not words.isdigit() or int(words) == size, name)

    def test_pictures_are_what_the_surface_file_shows(self):
        """Those that are computed from contact forces, and those of a body that moves by itself, which are stored."""
        plane = "t,x,y,z\n0,0.5,1.25,0\n0.2,0.5,1.05,0\n"
        for body, script, options, topic, off in (("cube2", SCRIPT, ("--depth", "no"), "/contacts", 1), ("plate2", plane, (), "/contacts", 1),
                                                  ("cube2", SCRIPT, (), "/contacts", 3000),  # of second order in what moved since the last balance
                                                  ("cube2", SCRIPT, ("--solver", "corotational"), "/pictures", 1)):
            self.record(body=body, script=script, options=("--record-frames", "1000", "--surface", "last.vtu", *options))
            self.assertEqual(len(self.ticks.messages(topic)), len(self.ticks))
            reader = vtkXMLUnstructuredGridReader()
            reader.SetFileName(str(self.folder / "last.vtu"))
            reader.Update()
            data = reader.GetOutput().GetPointData()
            mesh = slice(self.frames["displacement"].shape[1])  # the file has the finer surface that tools meet, too
            u = vtk_to_numpy(data.GetArray("displacement"))[mesh]
            self.assertGreater(abs(u).max(), 0.001)
            numpy.testing.assert_allclose(self.frames["displacement"][-1], u, rtol=1e-5, atol=off * 1e-5 * abs(u).max())
            for name in ("von_mises", "pressure"):
                shown = vtk_to_numpy(data.GetArray(name))
                numpy.testing.assert_allclose(self.frames[name][-1], shown[mesh], rtol=1e-4, atol=off * 1e-5 * numpy.nanmax(abs(shown)), err_msg=name)
            held = self.ticks.surface["held"] == 2 ** self.simplices.shape[1] - 1
            self.assertTrue((numpy.isfinite(self.frames["von_mises"][-1]) | held).all())

    def test_part_of_it_and_fewer_pictures(self):
        self.record()
        self.exported("--hdf5", "part.h5", "--from", "0.1", "--to", "0.2", "--fps", "20")
        with h5py.File(self.folder / "part.h5") as hdf:
            numpy.testing.assert_array_equal(hdf["ticks/time"], self.ticks["time"][100:201])
            self.assertEqual(len(hdf["frames/time"]), 2)
        self.assert_refused(self.export("--hdf5", "none.h5", "--from", "7"), "has no ticks in that time")
        self.assertFalse((self.folder / "none.h5").exists())

    def test_without_pictures(self):
        self.write("script.csv", SCRIPT)
        file = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
        result = run(RUNTIME, "play", file, "--device", "script:script.csv", "--fast", "--record", "touch.mcap", "--record-frames", "0", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.exported("--hdf5", "touch.h5"), "touch.h5: 401 ticks, 0 pictures\n")
        self.assertFalse((self.folder / "touch.xdmf").exists())

    def test_description_for_paraview(self):
        for body, script, kind in (("cube2", SCRIPT, "Triangle"), ("plate2", "t,x,y,z\n0,0.5,1.25,0\n0.2,0.5,1.05,0\n", "Polyline")):
            self.record(body=body, script=script)
            name = "Länge & 'so' 50% <1>.h5"
            self.exported("--hdf5", name, "--force")
            path = (self.folder / name).with_suffix(".xdmf")
            grids = xml.etree.ElementTree.parse(path).getroot().find("Domain").find("Grid")
            self.assertEqual((grids.get("GridType"), grids.get("CollectionType")), ("Collection", "Temporal"))
            self.assertEqual(len(grids), len(self.frames["time"]))
            for k, grid in enumerate(grids):
                self.assertEqual(float(grid.find("Time").get("Value")), self.frames["time"][k])
                topology = grid.find("Topology")
                self.assertEqual((topology.get("TopologyType"), int(topology.get("NumberOfElements"))), (kind, len(self.simplices)))
                numpy.testing.assert_array_equal(evaluate(topology.find("DataItem"), self.folder), self.simplices)
                attributes = {a.get("Name"): evaluate(a.find("DataItem"), self.folder) for a in grid.findall("Attribute")}
                self.assertEqual(sorted(attributes), ["contact pressure", "displacement", "von Mises stress"])
                for shown, dataset in (("displacement", "displacement"), ("von Mises stress", "von_mises"), ("contact pressure", "pressure")):
                    numpy.testing.assert_array_equal(attributes[shown], self.frames[dataset][k])
                x = evaluate(grid.find("Geometry").find("DataItem"), self.folder)
                numpy.testing.assert_array_equal(x, self.rest + self.frames["displacement"][k])
            self.assertLess(path.stat().st_size / len(grids), 1200, "bytes a picture")

    def test_takes_the_place_of_an_earlier_one_and_of_nothing_else(self):
        self.record()
        for _ in range(2):
            self.exported("--hdf5", "touch.h5")
        model = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
        (self.folder / "cube.hdf").write_bytes(model.read_bytes())
        self.assert_refused(self.export("--hdf5", "cube.hdf"), "cube.hdf: is there already and is not a recording as HDF5")
        self.write("mine.xdmf", "mine")
        self.assert_refused(self.export("--hdf5", "mine.h5"), "mine.xdmf", "--force")
        self.assertEqual((self.folder / "mine.xdmf").read_text(), "mine")
        self.assertEqual((self.folder / "cube.hdf").read_bytes(), model.read_bytes())


if __name__ == "__main__":
    unittest.main()
