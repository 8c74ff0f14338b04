"""Every sample is run as it is written, and a number of each is held against a formula, another way to it, or what the sample says itself."""

import html
import math
import os
import re
import shutil
import sys
import tomllib
import unittest

import h5py
import numpy

from programs import BINARY, HAS_SANITIZERS, PRECOMPUTE, RUNTIME, SOURCE, ProgramTest, done, palpate, pictures, run

from palpate import samples

SAMPLES = SOURCE / "samples"
CHAPTERS = tomllib.loads((SAMPLES / "samples.toml").read_text())["chapters"]
NAMES = [name for names in CHAPTERS.values() for name in names]
G = 9.81


def described(name):
    return tomllib.loads((SAMPLES / name / "sample.toml").read_text())


def layer_force(radius, depth, thickness, modulus, ratio):
    """Force of a sphere on a layer that sticks to its ground, by Dimitriadis et al. (Biophys. J. 82, 2002), eq. 12; Hertz's for a thick one."""
    a = -(1.2876 - 1.4678 * ratio + 1.3442 * ratio**2) / (1 - ratio)
    b = (0.6387 - 1.0277 * ratio + 1.5164 * ratio**2) / (1 - ratio)
    x = math.sqrt(radius * depth) / thickness
    p = math.pi
    thin = 1 - 2 * a / p * x + 4 * a**2 / p**2 * x**2 - 8 / p**3 * (a**3 + 4 * p**2 / 15 * b) * x**3 + 16 * a / p**4 * (a**3 + 3 * p**2 / 5 * b) * x**4
    return 4 / 3 * modulus / (1 - ratio**2) * math.sqrt(radius) * depth**1.5 * thin


class Sample(ProgramTest):
    def sample(self, name, links_library=False):
        """Runs a sample in a folder of its own, which is returned with what it printed."""
        if links_library and HAS_SANITIZERS:
            self.skipTest("Python, mono and plain programs cannot load a library with sanitizers")
        missing = [program for program in described(name).get("needs", []) if shutil.which(program) is None]
        if missing:
            self.skipTest(f"{name} needs {' and '.join(missing)}")
        folder = self.folder / name
        samples.copy(name, folder)
        result = samples.run(folder, samples.environment(), capture_output=True)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return folder, result.stdout + result.stderr

    def at(self, recording, time, field="force"):
        read = palpate.read(recording)
        return read[field][int(numpy.argmin(abs(read["time"] - time)))]

    def volume(self, body):
        """Volume of a body of tetrahedra, by material."""
        with palpate.Body(body) as baked:
            corners = baked.nodes[baked.elements[:, :4]]
            material = baked.file["/material/of_element"][:]
        sizes = numpy.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
        return [sizes[material == k].sum() for k in range(material.max() + 1)]


class Touch(Sample):
    def test_press(self):
        """The force grows faster than the depth, and the loop of the same touch in Python has it too, by small strain."""
        folder, _ = self.sample("press")
        force = [-self.at(folder / "press.mcap", t)[2] for t in (0.6, 0.4 - 0.4 / 3, 0)]
        self.assertGreater(force[0], 2 * 1.1 * force[1])  # 4 mm and 2 mm
        self.assertLess(force[0], 2**1.5 * 1.1 * force[1])
        self.assertEqual(force[2], 0)
        if not HAS_SANITIZERS:
            with palpate.Session(folder / "block.palpate.hdf", palpate.Tool(radius=0.01), max_contacts=256,
                                 overlay=palpate.Overlay(refinement=0)) as session:
                again = session.play(palpate.read(folder / "press.mcap")["device_position"])
            result = run(RUNTIME, "play", "block.palpate.hdf", "--device", "script:press.csv", "--tool", "sphere:0.01", "--fast", "--depth", "no", "--record", "small.mcap", cwd=folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            numpy.testing.assert_array_equal(again, -palpate.read(folder / "small.mcap")["force"])

    def test_friction(self):
        """At the end each contact slides at Coulomb's coefficient, the way that the ball goes."""
        folder, _ = self.sample("friction")
        table = numpy.genfromtxt(folder / "rough.csv", delimiter=",", names=True)
        force = numpy.column_stack([table[name] for name in ("fx", "fy", "fz")])
        normal = numpy.column_stack([table[name] for name in ("nx", "ny", "nz")])
        presses = (force != 0).any(axis=1)
        force, normal = force[presses], normal[presses]
        across = (force * normal).sum(axis=1)
        along = force - across[:, None] * normal
        self.assertGreater(presses.sum(), 2)
        numpy.testing.assert_allclose(numpy.linalg.norm(along, axis=1) / -across, 0.3, rtol=0.02)
        self.assertGreater(along[:, 0].min(), 0)

    def test_grab(self):
        folder, said = self.sample("grab")
        told = re.search(r"total force on the body \((.*?)\) N", said)[1]
        probed = numpy.array([float(word) for word in told.split(",")])
        numpy.testing.assert_allclose(self.at(folder / "pull.mcap", 1.05), probed, atol=1e-6)
        self.assertGreater(probed[2], 0.1)

    def test_tools(self):
        """By what power of the depth the force grows: 1 for a punch, more for what rounds off, towards 1.5 for a ball."""
        folder, _ = self.sample("tools")
        edge = {"disc": 0.1, "capsule": 0, "sphere": 0}  # [mm] from a punch's middle to its face
        power = {name: math.log(self.at(folder / f"{name}.mcap", 1.1)[2] / self.at(folder / f"{name}.mcap", 0.6)[2]) / math.log((4 + more) / (2 + more))
                 for name, more in edge.items()}
        self.assertAlmostEqual(power["disc"], 1.0, delta=0.1)
        self.assertGreater(power["capsule"], power["disc"])
        self.assertGreater(power["sphere"], power["capsule"])
        self.assertLess(power["sphere"], 1.6)

    def test_coupling(self):
        """The spring is stretched by the force, and the tool feels what a rigid one feels at its depth."""
        folder, _ = self.sample("coupling")
        rigid, soft = (palpate.read(folder / f"{name}.mcap") for name in ("rigid", "soft"))
        force = -soft["force"][-1, 2]
        self.assertAlmostEqual(force, 100 * (soft["tool_position"][-1, 2] - soft["device_position"][-1, 2]), delta=1e-6)
        goes = slice(100, None)
        alike = numpy.interp(-soft["tool_position"][-1, 2], -rigid["tool_position"][goes, 2], -rigid["force"][goes, 2])
        self.assertAlmostEqual(force, alike, delta=0.01 * force)

    def test_palm(self):
        """Forces of the contacts add up to that of the tool, and each presses."""
        folder, _ = self.sample("palm")
        table = numpy.genfromtxt(folder / "contacts.csv", delimiter=",", names=True)
        contact = numpy.column_stack([table[name] for name in ("fx", "fy", "fz")])
        normal = numpy.column_stack([table[name] for name in ("nx", "ny", "nz")])
        self.assertGreater(len(table), 60)
        numpy.testing.assert_allclose(contact.sum(axis=0), palpate.read(folder / "palm.mcap")["force"][-1], atol=1e-4)
        self.assertLess((contact * normal).sum(axis=1).max(), 1e-9)

    def test_overlay(self):
        folder, _ = self.sample("overlay")
        expected = layer_force(0.005, 0.0015, 0.03, 5e3, 0.45)
        self.assertAlmostEqual(-self.at(folder / "fine.mcap", 0.8)[2] / expected, 1, delta=0.08)
        self.assertGreater(-self.at(folder / "coarse.mcap", 0.8)[2] / expected, 1.4)


class Bodies(Sample):
    def test_nodule(self):
        """Beside the nodule a finger feels what it feels where there is none."""
        folder, _ = self.sample("nodule")
        over, beside = (-palpate.read(folder / f"{name}.mcap")["force"][-1, 2] for name in ("over", "beside"))
        self.assertGreater(over, 1.3 * beside)
        text = (folder / "model.toml").read_text()
        (folder / "plain.toml").write_text(text.replace("youngs_modulus = 1e5", "youngs_modulus = 5e3").replace('name = "nodule"', 'name = "plain"'))
        done(PRECOMPUTE, "plain.toml", cwd=folder)
        done(RUNTIME, "play", "plain.palpate.hdf", "--device", "script:beside.csv", "--tool", "sphere:0.008", "--overlay", "no", "--fast", "--record", "plain.mcap", cwd=folder)
        self.assertAlmostEqual(-palpate.read(folder / "plain.mcap")["force"][-1, 2] / beside, 1, delta=0.03)

    def test_elements(self):
        folder, _ = self.sample("elements")
        expected = layer_force(0.015, 0.004, 0.03, 5e3, 0.49)
        off = {name: -palpate.read(folder / f"{name}.mcap")["force"][-1, 2] / expected - 1 for name in ("tet4", "tet4a", "tet10")}
        self.assertLess(abs(off["tet10"]), 0.2)
        self.assertLess(abs(off["tet4a"]), 0.2)
        self.assertGreater(off["tet4"], 1.0)

    def test_gravity(self):
        folder, _ = self.sample("gravity")
        for share in ("0", "0.5", "1"):
            seen = pictures(folder / f"share-{share}.mcap")
            top = (seen["surface/nodes"] + seen["frames/displacement"][0])[:, 2].max()
            self.assertAlmostEqual(top, 0.12 - float(share) * 1000 * G * 0.12**2 / (2 * 5e3), delta=2e-4, msg=share)

    def test_plane(self):
        """Beam theory for a force where the ball touches."""
        folder, _ = self.sample("plane")
        moment = 0.01 * 0.01**3 / 12
        self.assertAlmostEqual(-palpate.read(folder / "bend.mcap")["force"][-1, 1] / (3 * 1e6 * moment * 0.004 / 0.095**3), 1, delta=0.03)

    def test_surface(self):
        folder, said = self.sample("surface")
        self.assertAlmostEqual(self.volume(folder / "bowl.palpate.hdf")[0] / (2 / 3 * math.pi * 0.03**3), 1, delta=0.05)
        self.assertIn("hole", said)
        self.assertIn("mm", (folder / "bowl.model.toml").read_text())

    def test_image(self):
        """Each material has the volume of its voxels, but for what smoothing takes and gives."""
        folder, _ = self.sample("image")
        data = (folder / "organ.nrrd").read_bytes()
        labels = numpy.frombuffer(data[data.index(b"\n\n") + 2 :], numpy.uint8)
        organ, lesion = self.volume(folder / "organ.palpate.hdf")
        self.assertAlmostEqual((organ + lesion) / ((labels > 0).sum() * 27e-9), 1, delta=0.1)  # facets of 7 mm are chords of what is round
        self.assertAlmostEqual(lesion / ((labels == 2).sum() * 27e-9), 1, delta=0.5)

    def test_arrays(self):
        folder, said = self.sample("arrays", links_library=True)
        area = 12 * math.sin(2 * math.pi / 12) / 2 * 0.012**2  # of a twelve-sided polygon
        self.assertAlmostEqual(self.volume(folder / "ring.palpate.hdf")[0] / (2 * math.pi * 0.03 * area), 1, delta=0.03)
        told = float(re.search(r"press with (\S+) N", said)[1])
        self.assertAlmostEqual(told, -palpate.read(folder / "ring.mcap")["force"][-1, 2], delta=1e-4)


class Motion(Sample):
    def test_swing(self):
        """The first frequency of a beam by Euler and Bernoulli."""
        folder, _ = self.sample("swing")
        seen = pictures(folder / "swing.mcap")
        tip = numpy.argmin(numpy.linalg.norm(seen["surface/nodes"] - [0.3, 0.01, 0.015], axis=1))
        y, time = seen["frames/displacement"][:, tip, 1], seen["frames/time"]
        crossings = [time[k] + (time[k + 1] - time[k]) * y[k] / (y[k] - y[k + 1]) for k in range(len(y) - 1) if time[k] > 0.62 and y[k] * y[k + 1] < 0]
        frequency = 0.5 * (len(crossings) - 1) / (crossings[-1] - crossings[0])
        self.assertAlmostEqual(frequency / (1.8751**2 / (2 * math.pi) * math.sqrt(1e6 * 0.02**2 / 12 / 1100) / 0.3**2), 1, delta=0.02)

    def test_inertia(self):
        folder, _ = self.sample("inertia")
        heavy, light = (-palpate.read(folder / f"{name}.mcap")["force"][:, 1] for name in ("heavy", "light"))
        self.assertGreater(heavy.max(), 10 * light.max())
        self.assertAlmostEqual(heavy[-1] / light[-1], 1, delta=0.01)

    def test_fall(self):
        """It falls by g t (t + h) / 2, as implicit Euler does, comes to rest on the floor, and keeps a dent."""
        folder, _ = self.sample("fall")
        seen = pictures(folder / "fall.mcap")
        u, time, nodes = seen["frames/displacement"], seen["frames/time"], seen["surface/nodes"]
        self.assertAlmostEqual(u[4, :, 2].mean(), -0.5 * G * time[4] * (time[4] + 0.005), delta=1e-3)
        self.assertAlmostEqual((nodes + u[-1])[:, 2].min(), -0.05, delta=1e-3)
        top = nodes[:, 2] > 0.0299
        middle = top & (numpy.linalg.norm(nodes[:, :2] - 0.02, axis=1) < 0.001)
        rim = top & ((abs(nodes[:, 0] - 0.02) > 0.0199) | (abs(nodes[:, 1] - 0.02) > 0.0199))
        dent = lambda frame: (nodes + u[frame])[rim, 2].mean() - (nodes + u[frame])[middle, 2].mean()
        before = int(numpy.argmin(abs(time - 0.8)))
        self.assertGreater(dent(-1), dent(before) + 1e-3)

    def test_drawing(self):
        folder, _ = self.sample("drawing")
        seen = pictures(folder / "drawing.mcap")
        u, time = seen["frames/displacement"], seen["frames/time"]
        self.assertAlmostEqual(u[3, :, 1].mean(), -0.5 * G * time[3] * (time[3] + 0.005), delta=1e-3)
        self.assertAlmostEqual((seen["surface/nodes"] + u[-1])[:, 1].min(), -0.03, delta=2e-3)

    def test_deep(self):
        """All laws agree while the press is light, and none does at a third of the thickness."""
        folder, _ = self.sample("deep")
        curves = {name: -palpate.read(folder / f"{name}.mcap")["force"][:, 2] for name in ("small", "corotational", "neo")}
        for name, force in curves.items():
            self.assertAlmostEqual(force[60] / curves["small"][60], 1, delta=0.15, msg=name)  # 0.6 mm
        self.assertLess(curves["corotational"][-1], 0.9 * curves["small"][-1])
        self.assertGreater(curves["neo"][-1], 1.1 * curves["small"][-1])

    def test_depth(self):
        folder, _ = self.sample("depth")
        force = {name: numpy.linalg.norm(palpate.read(folder / f"{name}.mcap")["force"][-1]) for name in ("small", "depth", "live")}
        self.assertAlmostEqual(force["depth"] / force["live"], 1, delta=0.06)
        self.assertGreater(abs(force["small"] / force["live"] - 1), 0.2)


class Programs(Sample):
    """Loops of one's own: all touch the same body as `press` does, and end as deep."""

    def test_c_and_cpp_feel_the_same(self):
        felt = []
        for name in ("loop_c", "loop_cpp"):
            folder, said = self.sample(name, links_library=True)
            felt.append(palpate.read(folder / "loop.mcap")["force"])
            self.assertIn(f"420 ms: {-felt[-1][-1, 2]:.6f} N", said)
        numpy.testing.assert_array_equal(*felt)
        self.assertEqual(len(felt[0]), 421)
        with palpate.Session(folder / "block.palpate.hdf", palpate.Tool(radius=0.01)) as session:
            again = session.play([(0.03, 0.03, 0.0402 - 0.00001 * tick) for tick in range(421)])
        numpy.testing.assert_array_equal(again, -felt[0])

    def test_csharp_feels_what_python_feels(self):
        folder, _ = self.sample("loop_csharp", links_library=True)
        with palpate.Session(folder / "block.palpate.hdf", palpate.Tool(radius=0.01)) as session:
            again = session.play([(0.03, 0.03, 0.0402 - 0.00001 * tick) for tick in range(421)])
        numpy.testing.assert_array_equal(again, -palpate.read(folder / "loop.mcap")["force"])

    def test_thread(self):
        """However the clock runs, the force at the end is that of `press`."""
        folder, said = self.sample("loop_thread", links_library=True)
        press, _ = self.sample("press")
        self.assertAlmostEqual(float(re.search(r"^(\S+) N; half", said, re.MULTILINE)[1]), -self.at(press / "press.mcap", 0.7)[2], delta=1e-3)
        self.assertGreater(len(palpate.read(folder / "loop.mcap")), 50)

    def test_two_tools(self):
        """By symmetry both fingertips feel the same, from two sides."""
        folder, _ = self.sample("two_tools", links_library=True)
        _, left, right = numpy.loadtxt(folder / "pinch.csv", delimiter=",", skiprows=1)[-1]
        self.assertLess(left, -0.1)
        self.assertAlmostEqual(left / right, -1, delta=1e-3)

    def test_batch(self):
        """The hardest place is over the nodule, and a place by itself is what the map has there."""
        folder, said = self.sample("batch", links_library=True)
        force = numpy.loadtxt(folder / "map.csv", delimiter=",")
        self.assertIn("the hardest place is at -17.1, 0.0 mm", said)
        self.assertGreater(force.max(), 1.4 * numpy.median(force))
        x, y = numpy.linspace(-0.03, 0.03, 15)[10], numpy.linspace(-0.018, 0.018, 9)[2]
        with palpate.Session(folder / "nodule.palpate.hdf", palpate.Tool(radius=0.005)) as session:
            alone = session.play(numpy.linspace([x, y, 0.0351], [x, y, 0.033], 20))[-1, 2]
        self.assertEqual(force[2, 10], float(f"{alone:.18e}"))


class Keeping(Sample):
    def test_probe(self):
        _, said = self.sample("probe")
        self.assertIn("verified", said)
        self.assertAlmostEqual(float(re.search(r"total force on the body \(.*, (\S+)\) N", said)[1]), 0.01839, delta=5e-6)  # what the sample says

    def test_replay(self):
        folder, said = self.sample("replay")
        self.assertIn("all forces of 901 ticks are those of the session, bit by bit", said)
        force = numpy.linalg.norm(palpate.read(folder / "touch.mcap")["force"], axis=1)
        self.assertIn(f"901 ticks, the largest force is {force.max():.4f} N", said)

    def test_export(self):
        folder, _ = self.sample("export")
        force = palpate.read(folder / "touch.mcap")["force"]
        table = numpy.genfromtxt(folder / "ticks.csv", delimiter=",", names=True)
        numpy.testing.assert_allclose(table["force_z"], force[:, 2], rtol=1e-6, atol=1e-12)
        with h5py.File(folder / "touch.h5") as hdf:
            numpy.testing.assert_array_equal(hdf["ticks/force"][:], force)
        self.assertEqual((folder / "touch.glb").read_bytes()[:4], b"glTF")
        self.assertIn("<html", (folder / "touch.html").read_text()[:1000])
        self.assertEqual(len(list((folder / "touch.frames").iterdir())), (folder / "touch.pvd").read_text().count("<DataSet"))

    def test_compress(self):
        folder, _ = self.sample("compress")
        every, small = (palpate.read(folder / f"{name}.mcap")["force"] for name in ("every", "small"))
        self.assertLess(abs(small - every).max(), 0.005 * abs(every).max())  # the tolerance of forces
        self.assertLess((folder / "small.palpate.hdf").stat().st_size, 0.4 * (folder / "block.palpate.hdf").stat().st_size)

    def test_device(self):
        folder, said = self.sample("device")
        ticks = palpate.read(folder / "hand.mcap")
        shown, force = (numpy.linalg.norm(ticks[name], axis=1) for name in ("shown_force", "force"))
        self.assertIn("too_fast", said)
        self.assertAlmostEqual(shown.max(), 0.1, delta=1e-9)
        self.assertGreater(force.max(), 0.3)
        first = int(numpy.argmax(ticks["fault"] > 0))
        self.assertAlmostEqual(ticks["time"][first], 1.8, delta=0.02)
        self.assertEqual(shown[first + 20 :].max(), 0)


# What README says that Palpate does, and the samples that show it.
FEATURES = {
    "Contact without penalty springs.": ["press", "friction", "grab", "tools", "coupling", "palm", "two_tools"],
    "Elements that do not lock.": ["elements", "nodule", "gravity", "plane"],
    "A fingertip feels the body, not its mesh.": ["overlay"],
    "Dynamics.": ["swing", "inertia"],
    "Deep presses": ["depth"],
    "Live bodies": ["fall", "drawing", "deep"],
    "Devices.": ["device"],
    "Recordings": ["replay", "export"],
    "A C library": ["loop_c", "loop_cpp", "loop_csharp", "loop_thread"],
}
# Of other parts of README and the book: from a file to a body, what Python does, what the files are.
OTHERS = ["surface", "image", "arrays", "batch", "probe", "compress"]


class Page(ProgramTest):
    def test_every_feature_has_a_sample(self):
        readme = (SOURCE / "README.md").read_text().split("\n## What it does\n")[1].split("\n## ")[0]
        self.assertEqual(re.findall(r"^- \*\*(.+?)\*\*", readme, re.MULTILINE), list(FEATURES))
        self.assertEqual(sorted(sum(FEATURES.values(), OTHERS)), sorted(NAMES))

    def test_every_sample_is_whole_and_in_its_chapter_and_the_book(self):
        self.assertEqual(sorted(NAMES), sorted(file.parent.name for file in SAMPLES.glob("*/sample.toml")))
        book = (SOURCE / "docs" / "samples.md").read_text()
        for name in NAMES:
            sample = described(name)
            self.assertEqual({*sample["files"], "sample.toml", "picture.webp"}, {file.name for file in (SAMPLES / name).iterdir()}, name)
            self.assertTrue((SOURCE / "docs" / sample["page"]).exists(), name)
            self.assertEqual(samples.commands(SAMPLES / name), sample["commands"], name)
            lines = sum(len((SAMPLES / name / file).read_text().splitlines()) for file in sample["files"] if not file.endswith(".pbm"))
            self.assertLessEqual(lines, 60, name)
            self.assertIn(f"`{name}`", book)

    def test_pictures_are_small(self):
        sizes = [(SAMPLES / name / "picture.webp").stat().st_size for name in NAMES] + [(SOURCE / "docs" / "pictures" / "samples.webp").stat().st_size]
        self.assertLess(max(sizes[:-1]), 40e3)
        self.assertLess(sum(sizes), 1e6)

    def test_it_is_made_of_the_samples_as_they_are(self):
        built = BINARY / "share" / "palpate" / "samples.html"
        done(SOURCE / "scripts" / "samples", "page", self.folder / "page.html")
        self.assertEqual(built.read_bytes(), (self.folder / "page.html").read_bytes(), "build the target samples_page")
        page = built.read_text()
        self.assertEqual(re.findall('<article id="(.*?)">', page), NAMES)
        self.assertNotRegex(page, r'(?:src|href)="(?!data:|#)', "it needs nothing else")
        text = html.unescape(re.sub("</?span[^>]*>", "", page))
        for name in NAMES:
            sample = described(name)
            for part in (sample["commands"].strip(), *[(SAMPLES / name / file).read_text().rstrip() for file in sample["files"]]):
                self.assertIn(part, text, name)

    def test_the_command_tells_where_it_is(self):
        without_screen = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        result = run(RUNTIME, "samples", env=without_screen)
        self.assertEqual((result.returncode, result.stdout), (0, f"file://{BINARY.resolve()}/share/palpate/samples.html\n"), result.stderr)

    def test_where_there_is_a_screen_it_is_opened(self):
        opener = self.write("xdg-open", '#!/bin/sh\necho "$1" >opened\n')
        opener.chmod(0o755)
        environment = {**os.environ, "DISPLAY": ":9", "PATH": os.pathsep.join([str(self.folder), os.environ["PATH"]])}
        self.assertEqual(run(RUNTIME, "samples", env=environment, cwd=self.folder).returncode, 0)
        self.assertEqual((self.folder / "opened").read_text(), f"{BINARY.resolve()}/share/palpate/samples.html\n")

    def test_a_page_that_is_not_there_is_told(self):
        alone = self.folder / "bin" / "palpate-runtime"
        alone.parent.mkdir()
        shutil.copy(RUNTIME, alone)
        self.assert_refused(run(alone, "samples"), str(self.folder / "share/palpate/samples.html"), "Install Palpate whole")

    def test_python_copies_and_runs_one(self):
        def of_python(*words):
            return run(sys.executable, "-m", "palpate.samples", *words, cwd=self.folder, env={**os.environ, "PYTHONPATH": str(SOURCE / "runtime" / "python")})

        ran = of_python("probe")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertTrue((self.folder / "probe" / "cube.palpate.hdf").exists())
        self.assertFalse((self.folder / "probe" / "picture.webp").exists())
        for word, told in (("probe", "probe is there already"), ("prob", "there is no sample 'prob'"), ("../samples", "there is no sample")):
            refused = of_python(word)
            self.assertEqual(refused.returncode, 1)
            self.assertIn(told, refused.stderr)
        self.assertIn("samples.html", of_python().stdout)


if __name__ == "__main__":
    unittest.main()
