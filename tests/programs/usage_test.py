"""The command line as a newcomer meets it: wrong words, wrong files, help pages, what comes next."""

import gzip
import re
import struct
import unittest
import zlib

from programs import PRECOMPUTE, RUNTIME, ProgramTest, cube_toml, run

# A cube of 10 in its own units, outwards.
OFF = """OFF
8 12 0
0 0 0
10 0 0
10 10 0
0 10 0
0 0 10
10 0 10
10 10 10
0 10 10
3 0 2 1
3 0 3 2
3 4 5 6
3 4 6 7
3 0 1 5
3 0 5 4
3 1 2 6
3 1 6 5
3 2 3 7
3 2 7 6
3 3 0 4
3 3 4 7
"""
MEDIT = """MeshVersionFormatted 2
Dimension 3
Vertices
5
0 0 0 0
10 0 0 0
0 10 0 0
0 0 10 0
10 10 10 0
Tetrahedra
2
1 2 3 4 1
2 3 4 5 1
End
"""


def png(width, height):
    """A white picture with a black rim."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    rim = b"\0" + b"\0" * width
    rows = rim + (b"\0" + b"\0" + b"\xff" * (width - 2) + b"\0") * (height - 2) + rim
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) + \
        chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def nii(size):
    """A ball as NIfTI; x and z run backwards."""
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, size, size, size, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 2, 8)
    struct.pack_into("<8f", header, 76, 1, 1, 1, 1, 0, 0, 0, 0)
    struct.pack_into("<f", header, 108, 352)
    header[123] = 2
    struct.pack_into("<h", header, 254, 1)
    struct.pack_into("<12f", header, 280, -1, 0, 0, size, 0, 1, 0, 0, 0, 0, -1, size)
    header[344:348] = b"n+1\0"
    return bytes(header) + inr(size)[256:]


def inr(size):
    """A ball of label 1."""
    head = f"#INRIMAGE-4#{{\nXDIM={size}\nYDIM={size}\nZDIM={size}\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\nCPU=decm\nVX=1\nVY=1\nVZ=1\n"
    head += "\n" * (256 - 4 - len(head)) + "##}\n"
    middle, radius = (size - 1) / 2, size / 2 - 2
    inside = bytes(int((x - middle) ** 2 + (y - middle) ** 2 + (z - middle) ** 2 < radius ** 2)
                   for z in range(size) for y in range(size) for x in range(size))
    return head.encode() + inside


class Usage(ProgramTest):
    def assert_usage(self, result, *pieces):
        """Exit status 2, and exactly `error:` and `hint:`."""
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertRegex(result.stderr, r"^error: [^\n]+\nhint: [^\n]+\n$")
        for piece in pieces:
            self.assertIn(piece, result.stderr)

    def test_precompute_says_what_is_wrong_and_what_helps(self):
        for arguments, pieces in (((), ("MODEL.toml", "--help")), (("--bogus",), ("--bogus", "palpate-precompute --help")),
                                  (("verify",), ("FILE", "palpate-precompute verify --help")),
                                  (("compare", "a.palpate.hdf"), ("B", "compare --help")),
                                  (("--jobs", "0", "x.toml"), ("--jobs", "--help")),
                                  (("verfy", "x.palpate.hdf"), ("palpate-precompute verify?",)),
                                  (("inspekt",), ("palpate-precompute inspect?",)), (("--out=x", "m.toml"), ("--out",)),
                                  (("--forse", "m.toml"), ("Did you mean --force?",)),
                                  (("help", "bogus"), ("there is no command 'bogus'",))):
            with self.subTest(arguments=arguments):
                self.assert_usage(run(PRECOMPUTE, *arguments, cwd=self.folder), *pieces)

    def test_runtime_names_the_command_that_is_meant(self):
        for word, piece in (("liver.palpate.hdf", "palpate-runtime play liver.palpate.hdf --view"),
                            ("touch.mcap", "palpate-runtime view touch.mcap"), ("model.toml", "palpate-precompute model.toml"),
                            ("pley", "palpate-runtime play?"), ("plya", "palpate-runtime play?"), ("sesion", "palpate-runtime session?"),
                            ("bogus", "play, view, probe, session, export, devices or samples")):
            with self.subTest(word=word):
                self.assert_usage(run(RUNTIME, word), f"'{word}'", piece)

    def test_runtime_names_the_option_that_is_meant(self):
        for arguments, option in ((("play", "b.palpate.hdf", "--devise", "mouse"), "--device"), (("export", "a.mcap", "--hmtl=a.html"), "--html")):
            self.assert_usage(run(RUNTIME, *arguments), f"Did you mean {option}? See palpate-runtime {arguments[0]} --help")

    def test_lines_of_help_are_short(self):
        for program in (PRECOMPUTE, RUNTIME):
            for command in re.findall(r"^  ([a-z]+) ", run(program, "--help").stdout, re.MULTILINE):
                for line in run(program, command, "--help").stdout.splitlines():
                    self.assertLessEqual(len(line), 110)

    def test_help_is_a_command_too(self):
        for program, commands in ((PRECOMPUTE, ("inspect", "verify", "compare", "index")),
                                  (RUNTIME, ("play", "view", "probe", "session", "export", "devices"))):
            whole = run(program, "help")
            self.assertEqual((whole.returncode, whole.stderr), (0, ""))
            self.assertEqual(whole.stdout, run(program, "--help").stdout)
            for command in commands:
                self.assertRegex(whole.stdout, rf"\n  {command} +\w")
                page = run(program, "help", command)
                self.assertEqual((page.returncode, page.stderr), (0, ""))
                self.assertEqual(page.stdout, run(program, command, "--help").stdout)

    def test_each_page_has_examples_of_its_own(self):
        for program, commands in ((PRECOMPUTE, ("inspect", "verify", "compare", "index")),
                                  (RUNTIME, ("play", "view", "probe", "session", "export", "devices"))):
            for command in commands:
                with self.subTest(command=command):
                    page = run(program, command, "--help").stdout
                    examples = page[page.index("Example"):].splitlines()[1:]
                    self.assertTrue(examples)
                    named = re.findall(rf"{program.name} (\w+)", "\n".join(examples))
                    self.assertEqual(set(named), {command})

    def test_pages_fit_a_terminal(self):
        for program, commands in ((PRECOMPUTE, ("", "inspect", "verify", "compare", "index")),
                                  (RUNTIME, ("", "play", "view", "probe", "session", "export", "devices"))):
            for command in commands:
                page = run(program, *[command][: len(command)], "--help").stdout
                self.assertEqual([line for line in page.splitlines() if len(line) > 110], [])

    def test_options_of_play_stand_in_groups_in_the_order_of_use(self):
        page = run(RUNTIME, "play", "--help").stdout
        headings = re.findall(r"^([A-Z][^\n]*):$", page, re.MULTILINE)
        self.assertEqual(headings, ["Arguments", "Input device", "Viewer", "The tool", "The body", "The live solver", "The loop", "Output files",
                                    "Workspace of the device", "Safety", "Examples"])
        groups = dict(re.findall(r"^([A-Z][^\n]*):\n(.*?)(?=^[A-Z][^\n]*:$|\Z)", page, re.MULTILINE | re.DOTALL))
        for option, heading in (("--device", "Input device"), ("--view", "Viewer"), ("--tool", "The tool"),
                                ("--overlay", "The body"), ("--rate", "The loop"), ("--record", "Output files"),
                                ("--origin", "Workspace of the device"), ("--safety", "Safety")):
            self.assertRegex(groups[heading], rf"(?m)^  {option} ")
        bounds = re.findall(r"^    (\w+) +([\d.e-]+) (.{6}) (\w.*)$", groups["Safety"], re.MULTILINE)
        self.assertEqual(len(bounds), 30)
        self.assertIn(("max_force", "3", "N     ", "largest force on the hand"), bounds)
        for name, _, unit, meaning in bounds:
            self.assertTrue(unit.strip() or name == "buzz_flips", name)
            self.assertGreater(len(meaning.split()), 2, name)


class EmptyWords(ProgramTest):
    """An empty word is no name, path or number: it is refused wherever a value is asked for."""

    def options(self, program, command):
        """Options of a command that take a value, by its help page."""
        page = run(program, *command, "--help").stdout
        return sorted(set(re.findall(r"(--[a-z-]+)(?: (?!Excludes|Needs)[A-Z\[]|=)", "\n".join(re.findall(r"(?m)^  (?:-\w, *)?--.*", page)))))

    def test_options(self):
        file = self.bake(cube_toml(2))
        tried = 0
        for program, command, given in ((PRECOMPUTE, (), (self.folder / "model.toml",)), (PRECOMPUTE, ("join",), (self.folder / "model.toml",)),
                                        (PRECOMPUTE, ("compare",), (file, file)), (RUNTIME, ("play",), (file,)), (RUNTIME, ("probe",), (file,)),
                                        (RUNTIME, ("push",), (file,)), (RUNTIME, ("export",), ("a.h5",)), (RUNTIME, ("view",), ()),
                                        (RUNTIME, ("devices",), ())):
            for option in self.options(program, command):
                with self.subTest(command=command, option=option):
                    result = run(program, *command, *given, option, "", cwd=self.folder)
                    self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                    self.assertIn(option, result.stderr)
                    tried += 1
        self.assertGreater(tried, 60)

    def test_positional_arguments(self):
        for program, *words in ((PRECOMPUTE, ""), (PRECOMPUTE, "join", ""), (PRECOMPUTE, "join", "model.toml", ""), (PRECOMPUTE, "inspect", ""),
                                (PRECOMPUTE, "verify", ""), (PRECOMPUTE, "compare", "", "a"), (PRECOMPUTE, "compare", "a", ""), (PRECOMPUTE, "new", ""),
                                (PRECOMPUTE, "help", ""), (RUNTIME, "play", "", "--view"), (RUNTIME, "probe", "", "--node", "1", "--displace", "0,0,0"),
                                (RUNTIME, "push", ""), (RUNTIME, "view", ""), (RUNTIME, "session", ""), (RUNTIME, "export", "", "--csv", "a.csv"), (RUNTIME, "help", "")):
            with self.subTest(words=words):
                result = run(program, *words, cwd=self.folder)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)

    def test_names_behind_a_word(self):
        file = self.bake(cube_toml(2))
        for device in ("script:", "replay:"):
            result = run(RUNTIME, "play", file, "--fast", "--device", device, "--tool", "sphere:0.1", cwd=self.folder)
            self.assertIn(result.returncode, (1, 2), result.stderr)
            self.assertIn("hint: ", result.stderr)


class NotADescription(ProgramTest):
    def starter(self, result, name, what):
        """The model.toml that the hint shows."""
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn(f"{name}: is {what}, not a model.toml", result.stderr)
        text = result.stderr[result.stderr.index("to begin with:\n") + len("to begin with:\n"):]
        return re.sub("(?m)^    ", "", text)

    def test_geometry_gets_a_model_toml_that_works(self):
        # A picture by itself becomes a body; whose parts are to be joined it is none.
        for command, name, content, what in (([], "Two Tets.mesh", MEDIT.encode(), "a volume mesh of Medit"), (["join"], "sheet.png", png(40, 20), "a picture")):
            with self.subTest(name=name):
                (self.folder / name).write_bytes(content)
                model = self.write("model.toml", self.starter(run(PRECOMPUTE, *command, name, cwd=self.folder), name, what))
                result = run(PRECOMPUTE, model, cwd=self.folder)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertTrue((self.folder / (name.split(".")[0] + ".palpate.hdf")).exists())

    def test_surfaces_and_images_get_one_by_themselves(self):
        for name, content in (("cube.off", OFF.encode()), ("ball.inr", inr(40)), ("ball2.inr.gz", gzip.compress(inr(40))),
                              ("ball3.nii", nii(40)), ("ball4.nii.gz", gzip.compress(nii(40))), ("sheet.png", png(40, 20))):
            with self.subTest(name=name):
                (self.folder / name).write_bytes(content)
                result = run(PRECOMPUTE, name, "--surface-nodes", "300", cwd=self.folder)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertTrue((self.folder / (name.split(".")[0] + ".model.toml")).exists())
                self.assertTrue((self.folder / (name.split(".")[0] + ".palpate.hdf")).exists())

    def test_kinds_that_are_not_read_are_named_with_what_converts_them(self):
        cases = (("m.mha", b"ObjectType = Image\nNDims = 3\n", "MetaImage", "m.nrrd"), ("a.nhdr", b"NRRD0004\ndata file: a.raw\n\n", "NRRD", "unu save"),
                 ("b.hdr", b"\x5c\x01\0\0" + bytes(400), "two files", "nibabel"), ("a.vtu", b'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid">', "VTK in XML", "meshio convert"),
                 ("a.vtp", b'<VTKFile type="PolyData">', "surface of VTK", "pyvista"), ("a.mgz", b"\x1f\x8b", "FreeSurfer", "mri_convert"), ("a.inp", b"*HEADING\n", "Abaqus", "meshio"),
                 ("a.glb", b"glTF\2\0\0\0", "glTF", "assimp"), ("a.gltf", b"{}", "glTF", "assimp"), ("a.step", b"ISO-10303-21;", "STEP", "gmsh"), ("a.iges", b"", "IGES", "gmsh"),
                 ("a.3mf", b"PK\3\4", "3MF", "assimp"), ("a.dcm", bytes(128) + b"DICM", "DICOM", "dcm2niix"), ("a.JPG", b"\xff\xd8\xff\xe0", "JPEG", "a.png"),
                 ("touch.csv", b"t,x,y,z\n", "a table", "script:"),
                 # by contents, whatever the name
                 ("body", b'<?xml version="1.0"?><VTKFile type="UnstructuredGrid">', "VTK in XML by its contents", "meshio"), ("scan.nii", bytes(128) + b"DICM" + bytes(400), "DICOM by its contents", "dcm2niix"),
                 ("organ.toml", b"ObjectType = Image\nNDims = 3\n", "MetaImage by its contents", "organ.nrrd"), ("tube.txt", b"solid tube\n facet normal 0 0 1\n", "STL by its contents", "tube.stl"),
                 ("tube.obj", b"ply\nformat ascii 1.0\n", "PLY by its contents", "tube.ply"), ("cube.stl", OFF.encode(), "OFF by its contents", "cube.off"))
        for name, content, what, helps in cases:
            with self.subTest(name=name):
                (self.folder / name).write_bytes(content)
                self.assert_refused(run(PRECOMPUTE, name, cwd=self.folder), name, what, helps)
        self.assert_refused(run(PRECOMPUTE, self.write("README.md", "# Mine\n"), cwd=self.folder), "README.md", "neither a description")
        for name, what in (("a.vtu", "VTK in XML"), ("README.md", "neither a description"), ("scan.nii", "DICOM")):
            pushed = run(RUNTIME, "push", name, cwd=self.folder)
            self.assertEqual(pushed.returncode, 1)
            self.assertIn(what, pushed.stderr)

    def test_a_file_under_another_key_is_told_its_own(self):
        for key, name, right in (("mesh", "x.vtk", "volume"), ("file", "y.stl", "surface"), ("img", "z.nii.gz", "image")):
            model = self.write("model.toml", f'name = "a"\n[geometry]\n{key} = "{name}"\n')
            self.assert_refused(run(PRECOMPUTE, model, cwd=self.folder), f"no key '{key}'", f'{right} = "{name}"')
        self.write("a.off", OFF)
        model = self.write("model.toml", cube_toml(2).replace("box = ", 'volume = "a.off" # '))
        self.assert_refused(run(PRECOMPUTE, model, cwd=self.folder), "a.off", "a surface in OFF", "rite surface =")

    def test_files_of_ours_and_folders(self):
        file = self.bake(cube_toml(2), name="cube.toml")
        self.assert_refused(run(PRECOMPUTE, file), "is a baked model already", f"palpate-runtime play {file} --view", "inspect")
        recording = self.write("touch.mcap", "")
        self.assert_refused(run(PRECOMPUTE, recording), "is a recording", f"palpate-runtime view {recording}")
        self.write("model.toml", cube_toml(2))
        self.assert_refused(run(PRECOMPUTE, self.folder), "is a folder", f"palpate-precompute {self.folder / 'model.toml'}")


class Next(ProgramTest):
    def test_the_next_command_is_named(self):
        model = self.write("model.toml", cube_toml(2))
        baked = run(PRECOMPUTE, model, cwd=self.folder)
        self.assertIn("next: palpate-precompute verify cube.palpate.hdf", baked.stderr)
        self.assertIn("palpate-runtime play cube.palpate.hdf --view", baked.stderr)
        verified = run(PRECOMPUTE, "verify", "cube.palpate.hdf", cwd=self.folder)
        self.assertIn("next: palpate-runtime play cube.palpate.hdf --view", verified.stderr)
        self.write("touch.csv", "t,x,y,z,grab\n0,0.5,0.5,1.2,0\n0.1,0.5,0.5,0.9,0\n")
        played = run(RUNTIME, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", "--tool", "sphere:0.1",
                     "--record", "touch.mcap", cwd=self.folder)
        self.assertEqual(played.returncode, 0, played.stderr)
        self.assertIn("next: palpate-runtime view touch.mcap", played.stderr)
        without = run(RUNTIME, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", cwd=self.folder)
        self.assertNotIn("next:", without.stderr)

    def test_it_can_be_typed_whatever_the_name(self):
        folder = self.folder / "it's mine"
        folder.mkdir()
        self.write("it's mine/model.toml", cube_toml(2))
        baked = run(PRECOMPUTE, "it's mine/model.toml", "-o", "it's mine/a body.palpate.hdf", cwd=self.folder)
        command = re.search("next: (palpate-precompute verify .*)", baked.stderr).group(1)
        self.assertEqual(command, "palpate-precompute verify 'it'\\''s mine/a body.palpate.hdf'")
        verified = run("sh", "-c", command.replace("palpate-precompute", str(PRECOMPUTE), 1), cwd=self.folder)
        self.assertEqual(verified.returncode, 0, verified.stderr)


class WrongKind(ProgramTest):
    def test_a_model_is_no_recording_and_the_reverse(self):
        file = self.bake(cube_toml(2), name="cube.toml")
        touch = self.write("touch.csv", "t,x,y,z,grab\n0,0.5,0.5,1.2,0\n0.1,0.5,0.5,0.9,0\n")
        recording = self.folder / "touch.mcap"
        self.assertEqual(run(RUNTIME, "play", file, "--device", f"script:{touch}", "--fast", "--record", recording).returncode, 0)
        for arguments in (("view", file), ("session", file), ("export", file, "--html", self.folder / "x.html")):
            with self.subTest(command=arguments[0]):
                self.assert_refused(run(RUNTIME, *arguments), "is a model, not a recording", f"palpate-runtime play {file} --view")
        for arguments in (("play", recording, "--device", f"script:{touch}"), ("probe", recording, "--node", "1", "--displace", "0,0,1")):
            with self.subTest(command=arguments[0]):
                self.assert_refused(run(RUNTIME, *arguments), "is a recording, not a model", f"palpate-runtime view {recording}")

    def test_a_broken_recording_gets_its_reason(self):
        file = self.bake(cube_toml(2), name="cube.toml")
        touch = self.write("touch.csv", "t,x,y,z,grab\n0,0.5,0.5,1.2,0\n0.1,0.5,0.5,0.9,0\n")
        recording = self.folder / "touch.mcap"
        self.assertEqual(run(RUNTIME, "play", file, "--device", f"script:{touch}", "--fast", "--record", recording).returncode, 0)
        whole = recording.read_bytes()
        for broken, reason in ((b"", "not a recording"), (b"hello", "not a recording"), (whole[:20], "is damaged: the record at byte 8"),
                               (whole[:40] + b"\xff" * 40 + whole[80:], "is damaged")):
            recording.write_bytes(broken)
            for command in ("session", "view"):
                result = run(RUNTIME, command, recording)
                self.assert_refused(result, "touch.mcap", reason)
                self.assertNotIn("no reason given", result.stderr)


if __name__ == "__main__":
    unittest.main()
