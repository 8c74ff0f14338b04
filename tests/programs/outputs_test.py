"""Where the two programs may write, and what they say when they cannot."""

import json
import os
import pathlib
import resource
import shutil
import signal
import stat
import subprocess
import threading
import time
import unittest

from programs import PATIENCE, PRECOMPUTE, RUNTIME, SOURCE, ProgramTest, cube_toml, run

CUBE = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
TOUCH = "t,x,y,z\n0,0.5,0.5,1.3\n0.2,0.5,0.5,1.05\n"
LONG = "t,x,y,z\n0,0.5,0.5,1.3\n600,0.5,0.5,1.05\n"
NOBODY = 65534


class OutputTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.model = shutil.copy(CUBE, self.folder / "cube.palpate.hdf")
        shutil.copy(CUBE.with_name("model.toml"), self.folder / "model.toml")
        self.script = self.write("touch.csv", TOUCH)

    def as_nobody(self):
        """Options of a process that is not root's, which may write in the folder."""
        if os.geteuid() != 0:
            return {}
        self.folder.chmod(0o777)
        return {"user": NOBODY, "group": NOBODY, "extra_groups": []}

    def runtime(self, *arguments, **options):
        return run(RUNTIME, *arguments, cwd=self.folder, **options)

    def play(self, *arguments, device="script:touch.csv", **options):
        return self.runtime("play", "cube.palpate.hdf", "--device", device, "--tool", "sphere:0.1", "--fast", *arguments, **options)

    def probe_to(self, field, *arguments, **options):
        return self.runtime("probe", "cube.palpate.hdf", "--at", "0.5,0.5,1", "--displace", "0,0,-0.1", "--field", field, *arguments, **options)

    def assert_done(self, result):
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def assert_kept(self, files, result, *pieces):
        """Refused, and nothing in the folder has changed."""
        self.assert_refused(result, *pieces)
        self.assertEqual(self.contents(), files, result.stderr)
        self.assertNotIn("loaded in", result.stderr, "before the work begins")

    def contents(self):
        return {str(path.relative_to(self.folder)): path.read_bytes() if path.is_file() else b"" for path in self.folder.rglob("*")}


class Inputs(OutputTest):
    """Outputs never take the place of what the run reads."""

    def test_the_model(self):
        files = self.contents()
        for option in ("--record", "--report", "--surface", "--contacts"):
            for more in ((), ("--force",)):
                with self.subTest(option=option, more=more):
                    self.assert_kept(files, self.play(option, "cube.palpate.hdf", *more), "cube.palpate.hdf", "is the model", option)
        self.runtime("play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", "--report", "cube.palpate.hdf")
        self.assertEqual(self.contents(), files)

    def test_under_any_name(self):
        (self.folder / "soft.mcap").symlink_to("cube.palpate.hdf")
        (self.folder / "twice.mcap").symlink_to("soft.mcap")
        os.link(self.folder / "cube.palpate.hdf", self.folder / "hard.mcap")
        (self.folder / "sub").mkdir()
        files = self.contents()
        for name in ("soft.mcap", "twice.mcap", "hard.mcap", "sub/../cube.palpate.hdf", self.folder / "cube.palpate.hdf", "./cube.palpate.hdf"):
            for option in ("--record", "--report"):
                with self.subTest(name=name, option=option):
                    self.assert_kept(files, self.play(option, name, "--force"), "is the model")
        self.assert_kept(files, self.runtime("play", "soft.mcap", "--device", "script:touch.csv", "--record", "hard.mcap", "--force"), "is the model")

    def test_the_script(self):
        (self.folder / "link.csv").symlink_to("touch.csv")
        files = self.contents()
        for name in ("touch.csv", "link.csv"):
            self.assert_kept(files, self.play("--contacts", name, "--force"), "touch.csv", "is the script", "--contacts")
        self.assert_kept(files, self.play("--record", "touch.csv"), "is the script")

    def test_the_session_that_is_replayed(self):
        self.assert_done(self.play("--record", "t.mcap"))
        files = self.contents()
        for name in ("t.mcap", "./t.mcap"):
            self.assert_kept(files, self.play("--record", name, device="replay:t.mcap"), "is the session that is replayed")
            self.assert_kept(files, self.play("--report", name, "--force", device="replay:t.mcap"), "is the session that is replayed")

    def test_the_description(self):
        files = self.contents()
        for arguments in (("--model", "model.toml", "--report", "model.toml", "--force"), ("--model", "model.toml", "--record", "./model.toml")):
            self.assert_kept(files, self.play(*arguments), "model.toml", "the model's description")

    def test_what_the_model_was_made_from(self):
        made = self.bake(cube_toml(2), name="made")
        files = self.contents()
        result = self.runtime("play", made, "--device", "script:touch.csv", "--fast", "--report", "made", "--force")
        self.assert_refused(result, "made", "what the model was made from")
        self.assertEqual(self.contents(), files)

    def test_the_description_that_is_precomputed(self):
        self.write("m.toml", cube_toml(2))
        (self.folder / "link.palpate.hdf").symlink_to("m.toml")
        os.link(self.folder / "m.toml", self.folder / "hard.palpate.hdf")
        files = self.contents()
        for output in ("m.toml", "./m.toml", "link.palpate.hdf", "hard.palpate.hdf"):
            for more in ((), ("--force",)):
                with self.subTest(output=output, more=more):
                    result = run(PRECOMPUTE, "m.toml", "-o", output, *more, cwd=self.folder)
                    self.assert_kept(files, result, "is the description", "--output")
                    self.assertNotIn("elements", result.stderr)

    def test_the_geometry_that_is_precomputed(self):
        self.write("tet.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n"
                   "Tetrahedra\n2\n1 2 3 4 1\n2 3 4 5 1\nEnd\n")
        box = "box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }"
        self.write("m.toml", cube_toml(1).replace(box, 'volume = "tet.mesh"'))
        self.write("tet.node", "5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n")
        self.write("tet.ele", "2 4 0\n1 1 2 3 4\n2 2 3 4 5\n")
        self.write("n.toml", cube_toml(1).replace(box, 'volume = "tet.node"'))
        files = self.contents()
        for model, output in (("m.toml", "tet.mesh"), ("n.toml", "tet.node"), ("n.toml", "tet.ele")):
            self.assert_kept(files, run(PRECOMPUTE, model, "-o", output, "--force", cwd=self.folder), output, "is the geometry")

    def test_the_recording_that_is_exported(self):
        self.assert_done(self.play("--record", "t.mcap"))
        files = self.contents()
        for more in ((), ("--force",)):
            self.assert_kept(files, self.runtime("export", "t.mcap", "--html", "t.mcap", *more), "t.mcap", "is the recording")

    def test_the_model_that_is_probed(self):
        shutil.copy(CUBE, self.folder / "cube.csv")
        files = self.contents()
        result = self.runtime("probe", "cube.csv", "--at", "0.5,0.5,1", "--displace", "0,0,-0.1", "--field", "cube.csv", "--force")
        self.assert_kept(files, result, "cube.csv", "is the model")


class Twice(OutputTest):
    """No two outputs of a run are one file, or in each other's way."""

    def test_one_name(self):
        (self.folder / "link").symlink_to("real")
        self.write("real", "")
        files = self.contents()
        for arguments in (("--report", "a", "--contacts", "a"), ("--record", "a", "--report", "./a"), ("--surface", "a", "--contacts", "a"),
                          ("--report", "link", "--contacts", "real")):
            with self.subTest(arguments=arguments):
                self.assert_kept(files, self.play(*arguments, "--force"), "is both", arguments[0], arguments[2])

    def test_what_is_written_beside(self):
        files = self.contents()
        self.assert_kept(files, run(PRECOMPUTE, "model.toml", "-o", "a.hdf", "--report", "a.hdf.partial", cwd=self.folder), "ends in .partial")
        self.assert_done(self.play("--record", "t.mcap"))
        files = self.contents()
        result = self.runtime("export", "t.mcap", "--hdf5", "a.h5", "--csv", "a.xdmf")
        self.assert_kept(files, result, "ends in .xdmf")


class Existing(OutputTest):
    """An existing file is replaced where it is an earlier output of the same kind, else only by force."""

    NOTES = "what I wrote\n"

    def test_precompute(self):
        self.write("notes.txt", self.NOTES)
        self.write("m.toml", cube_toml(2))
        shutil.copy(SOURCE / "tests" / "golden" / "plate2" / "model.toml", self.folder / "other.toml")
        files = self.contents()
        for output in ("notes.txt", "touch.csv", "other.toml"):
            result = run(PRECOMPUTE, "m.toml", "-o", output, cwd=self.folder)
            self.assert_kept(files, result, output, "is not a model of Palpate's", "--force")
            self.assertNotIn("elements", result.stderr)
        self.assert_done(run(PRECOMPUTE, "m.toml", "-o", "cube.palpate.hdf", cwd=self.folder))
        self.write("notes.hdf", self.NOTES)
        self.assert_done(run(PRECOMPUTE, "m.toml", "-o", "notes.hdf", "--force", cwd=self.folder))
        self.assertEqual((self.folder / "notes.hdf").read_bytes(), (self.folder / "cube.palpate.hdf").read_bytes())
        self.write("empty", "")
        self.assert_done(run(PRECOMPUTE, "m.toml", "-o", "empty", cwd=self.folder))

    def test_recordings_are_no_models_and_models_no_recordings(self):
        self.assert_done(self.play("--record", "t.mcap"))
        shutil.copy(CUBE, self.folder / "other.palpate.hdf")
        self.write("m.toml", cube_toml(2))
        files = self.contents()
        self.assert_kept(files, run(PRECOMPUTE, "m.toml", "-o", "t.mcap", cwd=self.folder), "is not a model of Palpate's")
        self.assert_kept(files, self.play("--record", "other.palpate.hdf"), "is not a recording of Palpate's")

    def test_each_output_of_play(self):
        options = ("--record", "--report", "--surface", "--contacts")
        endings = {"--record": ".mcap", "--report": ".json", "--surface": ".vtu", "--contacts": ".csv"}
        foreign = {option: f"notes{option}{endings[option]}" for option in options}
        for name in foreign.values():
            self.write(name, self.NOTES)
        files = self.contents()
        for option in options:
            with self.subTest(option=option):
                self.assert_kept(files, self.play(option, foreign[option]), foreign[option], "--force")
        everything = [word for option in options for word in (option, f"own{option}")]
        self.assert_done(self.play(*everything))
        before = (self.folder / "own--record").read_bytes()
        self.assert_done(self.play(*everything[2:]))  # over themselves
        self.assert_kept(self.contents(), self.play(*everything), "own--record: is a recording already", "--force")
        self.assert_done(self.play(*everything, "--force"))
        self.assertEqual((self.folder / "own--record").read_bytes(), before)
        files = self.contents()
        for option in options:  # but not over one another
            for other in options:
                if other != option:
                    self.assert_kept(files, self.play(option, f"own{other}"), f"own{other}", "--force")
        self.assert_done(self.play("--force", *[word for option in options for word in (option, foreign[option])]))
        for option in options:
            if option not in ("--record", "--report"):
                self.assertEqual((self.folder / foreign[option]).read_bytes(), (self.folder / f"own{option}").read_bytes())
        self.assertEqual(json.loads((self.folder / foreign["--report"]).read_text())["ticks"], 201)

    def test_fields_of_probe(self):
        for name in ("notes.csv", "notes.vtu"):
            self.write(name, self.NOTES)
        files = self.contents()
        for name in ("notes.csv", "notes.vtu", "touch.csv"):
            self.assert_kept(files, self.probe_to(name), name, "--force")
        for extension in ("csv", "vtu"):
            self.assert_done(self.probe_to(f"own.{extension}"))
            self.assert_done(self.probe_to(f"own.{extension}"))
            self.assert_done(self.probe_to(f"notes.{extension}", "--force"))
            self.assertEqual((self.folder / f"notes.{extension}").read_bytes(), (self.folder / f"own.{extension}").read_bytes())
        self.assert_refused(self.play("--contacts", "own.csv"), "is not a table of contact points of Palpate's")

    def test_pages(self):
        self.assert_done(self.play("--record", "t.mcap"))
        self.write("notes.html", "<!doctype html>\n<title>Mine</title>\n")
        files = self.contents()
        self.assert_kept(files, self.runtime("export", "t.mcap", "--html", "notes.html"), "notes.html", "is not a page of Palpate's")
        for _ in range(2):
            self.assert_done(self.runtime("export", "t.mcap", "--html", "own.html"))
        self.assert_done(self.runtime("export", "t.mcap", "--html", "notes.html", "--force"))

    def test_folders(self):
        (self.folder / "a").mkdir()
        self.write("m.toml", cube_toml(2))
        files = self.contents()
        for option in ("--record", "--report", "--surface", "--contacts"):
            self.assert_kept(files, self.play(option, "a", "--force"), "a: is a folder")
        self.assert_kept(files, run(PRECOMPUTE, "m.toml", "-o", "a", "--force", cwd=self.folder), "a: is a folder")

    def test_links_keep_their_place(self):
        (self.folder / "elsewhere").mkdir()
        for name, target in (("r.mcap", "elsewhere/out.mcap"), ("r.json", "elsewhere/out.json"), ("m.hdf", "elsewhere/m.palpate.hdf")):
            (self.folder / target).write_text("")
            (self.folder / name).symlink_to(target)
        self.write("m.toml", cube_toml(2))
        for _ in range(2):
            self.assert_done(self.play("--record", "r.mcap", "--report", "r.json", "--force"))
            self.assert_done(run(PRECOMPUTE, "m.toml", "-o", "m.hdf", cwd=self.folder))
        self.assertEqual(sorted(p.name for p in (self.folder / "elsewhere").iterdir()), ["m.palpate.hdf", "out.json", "out.mcap"])
        for name in ("r.mcap", "r.json", "m.hdf"):
            self.assertTrue((self.folder / name).is_symlink(), name)
        self.assertEqual(json.loads(self.runtime("session", "r.mcap", "--json").stdout)["ticks"], 201)
        self.assertNotIn("STALE", self.assert_done(run(PRECOMPUTE, "verify", "m.hdf", cwd=self.folder)).stdout)
        (self.folder / "elsewhere" / "out.json").write_text(self.NOTES)
        self.assert_refused(self.play("--report", "r.json"), "elsewhere/out.json", "--force")

    def test_links_to_nothing(self):
        (self.folder / "gone.json").symlink_to("nowhere.json")
        files = self.contents()
        for more in ((), ("--force",)):
            self.assert_kept(files, self.play("--report", "gone.json", *more), "gone.json", "symbolic link to nothing")
            self.assert_kept(files, self.play("--record", "gone.json", *more), "gone.json", "symbolic link to nothing")


class Endings(OutputTest):
    """A name ends as its format does, whatever asks for the file."""

    RIGHT = {"--record": ".mcap", "--report": ".json", "--surface": ".vtu", "--contacts": ".csv", "--field": ".vtu", "--html": ".html", "--gltf": ".glb",
             "--vtu": ".pvd", "--csv": ".csv", "--hdf5": ".h5", "-o": ".hdf"}
    ALSO = {"--hdf5": (".hdf5", ".hdf"), "--html": (".htm",), "-o": (".h5", ".hdf5", ".vtkhdf"), "--field": (".csv",)}
    OTHERS = (".toml", ".txt", ".png", ".stl", ".obj", ".vtk", ".vtp", ".xdmf", ".gltf", ".off", ".gz", ".partial", ".xlsx", ".mcap2")

    def attempt(self, option, name):
        if option == "-o":
            return run(PRECOMPUTE, "model.toml", option, name, "--force", cwd=self.folder)
        if option == "--field":
            return self.probe_to(name, "--force")
        if option in ("--html", "--gltf", "--vtu", "--csv", "--hdf5"):
            return self.runtime("export", "t.mcap", option, name, "--force")
        return self.play(option, name, "--force")

    def test_of_another_format_are_refused(self):
        self.assert_done(self.play("--record", "t.mcap"))
        files = self.contents()
        for option, right in self.RIGHT.items():
            others = sorted({*self.RIGHT.values(), *self.OTHERS} - {right, *self.ALSO.get(option, ())})
            for name in (f"out{others[0].upper()}", *(f"out{ending}" for ending in others)):
                with self.subTest(option=option, name=name):
                    told = ("neither a .csv nor a .vtu",) if option == "--field" else (f"ends in {name[3:].lower()}", f"Name it out{right}")
                    self.assert_kept(files, self.attempt(option, name), name, *told)

    def test_of_the_format_are_taken(self):
        self.assert_done(self.play("--record", "t.mcap"))
        for option, right in self.RIGHT.items():
            names = [f"taken{right}", *(f"taken{also}" for also in self.ALSO.get(option, ()))]
            if option != "--field":
                names += [f"TAKEN{right.upper()}", "without", "of.2026-11-27", "part-1.of-2"]
            for name in names:
                with self.subTest(option=option, name=name):
                    self.assert_done(self.attempt(option, name))
                    self.assertTrue((self.folder / name).exists())

    def test_of_links(self):
        """Both names: that which is given, and that of the file which it leads to."""
        self.write("real.csv", "")
        self.write("real.json", "")
        (self.folder / "link.json").symlink_to("real.csv")
        (self.folder / "link.csv").symlink_to("real.json")
        files = self.contents()
        self.assert_kept(files, self.play("--report", "link.json"), "real.csv: ends in .csv")
        self.assert_kept(files, self.play("--report", "link.csv"), "link.csv: ends in .csv")

    def test_of_pipes_and_parts(self):
        os.mkfifo(self.folder / "pipe.txt")
        with open(os.open(self.folder / "pipe.txt", os.O_RDWR), "rb"):
            self.assert_done(self.play("--report", "pipe.txt"))
        files = self.contents()
        result = run(PRECOMPUTE, "model.toml", "-o", "out.csv", "--part", "1/2", cwd=self.folder)
        self.assert_kept(files, result, "out.csv: ends in .csv", "Name it out.hdf")


class Devices(OutputTest):
    """Pipes and devices are written to, or refused; never replaced."""

    TEXT = ("--report", "--contacts", "--surface")

    def node(self, name, kind, major, minor):
        node = self.folder / name
        os.mknod(node, kind | 0o666, os.makedev(major, minor))
        node.chmod(0o666)
        return node

    def test_null(self):
        """The system's own: not as root, who could break it."""
        program = shutil.copy(RUNTIME, self.folder / RUNTIME.name)
        command = (program, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast")
        for option in self.TEXT:
            with self.subTest(option=option):
                self.assert_done(run(*command, option, "/dev/null", cwd=self.folder, **self.as_nobody()))
        for more in ((), ("--force",)):
            result = run(*command, "--record", "/dev/null", *more, cwd=self.folder, **self.as_nobody())
            self.assert_refused(result, "/dev/null: is not a regular file", "--record")
        program = shutil.copy(PRECOMPUTE, self.folder / PRECOMPUTE.name)
        self.write("m.toml", cube_toml(2))
        result = run(program, "m.toml", "-o", "/dev/null", "--force", cwd=self.folder, **self.as_nobody())
        self.assert_refused(result, "/dev/null: is not a regular file")

    @unittest.skipUnless(os.geteuid() == 0, "device nodes are made by root")
    def test_nodes_stay(self):
        node = self.node("node", stat.S_IFCHR, 1, 3)
        self.assert_done(self.play("--record", "t.mcap"))
        for option in self.TEXT:
            self.assert_done(self.play(option, "node"))
        self.assert_done(self.runtime("export", "t.mcap", "--html", "node"))
        (self.folder / "link").symlink_to("node")
        self.assert_done(self.play("--report", "link"))
        for more in ((), ("--force",)):
            self.assert_refused(self.play("--record", "node", *more), "node: is not a regular file")
        self.assertTrue(stat.S_ISCHR(node.lstat().st_mode))
        block = self.node("block", stat.S_IFBLK, 7, 200)
        self.assert_refused(self.play("--report", "block", "--force"), "block: is a block device")
        self.write("m.toml", cube_toml(2))
        for output, piece in (("node", "is not a regular file"), ("link", "is not a regular file"), ("block", "is a block device")):
            self.assert_refused(run(PRECOMPUTE, "m.toml", "-o", output, "--force", cwd=self.folder), f"{output}: {piece}")
        self.assertTrue(stat.S_ISBLK(block.lstat().st_mode))

    def test_standard_output(self):
        program = shutil.copy(RUNTIME, self.folder / RUNTIME.name)
        nobody = self.as_nobody()

        def play_into(out, *arguments):
            result = subprocess.run([program, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", *arguments],
                                    cwd=self.folder, stdout=out, stderr=subprocess.PIPE, text=True, check=False, **nobody)
            result.stdout = result.stdout or ""
            return result

        piped = self.assert_done(play_into(subprocess.PIPE, "--report", "/dev/stdout"))
        self.assertEqual(json.loads(piped.stdout)["ticks"], 201)
        for name in ("out.json", "notes", "out.mcap"):
            (self.folder / name).touch(0o666)
            (self.folder / name).chmod(0o666)
        with (self.folder / "out.json").open("w") as out:
            self.assert_done(play_into(out, "--report", "/dev/stdout"))
        self.assertEqual(json.loads((self.folder / "out.json").read_text())["ticks"], 201)
        with (self.folder / "notes").open("a") as out:
            out.write("before\n")
            out.flush()
            self.assert_done(play_into(out, "--contacts", "/dev/stdout"))
        self.assertRegex((self.folder / "notes").read_text(), r"^before\nx,y,z,nx")
        with (self.folder / "out.mcap").open("w") as out:
            self.assert_refused(play_into(out, "--record", "/dev/stdout"), "/dev/stdout: is not a regular file")
        with open("/dev/full", "w") as full:
            self.assert_refused(play_into(full, "--report", "/dev/stdout"), "/dev/stdout: cannot be written: No space left")

    def test_process_substitution(self):
        command = f'"{RUNTIME}" play cube.palpate.hdf --device script:touch.csv --fast --report >(cat > copy.json; touch done)'
        process = subprocess.run(["bash", "-c", command], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(process.returncode, 0, process.stderr)
        while not (self.folder / "done").exists():
            time.sleep(0.01)
        self.assertEqual(json.loads((self.folder / "copy.json").read_text())["ticks"], 201)

    def test_pipes(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        files = {path.name for path in self.folder.iterdir()}
        self.assert_refused(self.play("--report", "pipe"), "pipe: is a pipe that no program reads")
        for option in ("--record",):
            self.assert_refused(self.play(option, "pipe", "--force"), "pipe: is not a regular file")
        told = []
        reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)  # there before the program
        os.set_blocking(reader, True)

        def read():
            with open(reader, "rb") as stream:
                told.append(stream.read())

        thread = threading.Thread(target=read)
        process = subprocess.Popen([RUNTIME, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", "--report", "pipe"],
                                   cwd=self.folder, stderr=subprocess.PIPE)
        writer = os.open(pipe, os.O_WRONLY)  # or the reader would see its end before the program has begun
        thread.start()
        process.communicate()
        os.close(writer)
        thread.join()
        self.assertEqual(process.returncode, 0)
        self.assertEqual(json.loads(told[0])["ticks"], 201)
        self.assertTrue(stat.S_ISFIFO(pipe.lstat().st_mode))
        self.assertEqual({path.name for path in self.folder.iterdir()}, files)

    def test_a_full_device_is_told_and_the_other_outputs_are_written(self):
        program = shutil.copy(RUNTIME, self.folder / RUNTIME.name)
        nobody = self.as_nobody()
        for option in self.TEXT:
            for name in ("s.vtu", "r.json"):
                (self.folder / name).unlink(missing_ok=True)
            others = [word for other in (("--surface", "s.vtu"), ("--report", "r.json")) if other[0] != option for word in other]
            result = run(program, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", option, "/dev/full", *others,
                         cwd=self.folder, **nobody)
            self.assert_refused(result, "/dev/full", "No space left")
            for name in others[1::2]:
                self.assertTrue((self.folder / name).exists(), name)
        (self.folder / "r.json").unlink()
        result = run(program, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", "--contacts", "/dev/full", "--report",
                     "r.json", cwd=self.folder, **nobody)
        self.assertEqual(json.loads((self.folder / "r.json").read_text())["ticks"], 201)


class Early(OutputTest):
    """What cannot be written is told before the work begins."""

    def test_missing_folders(self):
        self.write("m.toml", cube_toml(2))
        files = self.contents()
        for option in ("--record", "--report", "--surface", "--contacts"):
            self.assert_kept(files, self.play(option, "no/such"), "no/such: cannot be written: No such file or directory")
        self.assert_kept(files, self.probe_to("no/such.csv"), "no/such.csv: cannot be written")
        result = run(PRECOMPUTE, "m.toml", "-o", "no/such.palpate.hdf", cwd=self.folder)
        self.assert_kept(files, result, "no/such.palpate.hdf: cannot be written: No such file or directory")
        self.assertNotIn("elements", result.stderr)

    def test_folders_without_the_right_to_write(self):
        programs = [shutil.copy(program, self.folder / program.name) for program in (RUNTIME, PRECOMPUTE)]
        self.write("m.toml", cube_toml(2))
        locked = self.folder / "locked"
        locked.mkdir(mode=0o555)
        options = self.as_nobody()
        for option in ("--record", "--report", "--surface", "--contacts"):
            result = run(programs[0], "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", option, "locked/out",
                         cwd=self.folder, **options)
            self.assert_refused(result, "locked/out: cannot be written: Permission denied")
            self.assertNotIn("loaded in", result.stderr)
        result = run(programs[1], "m.toml", "-o", "locked/out", cwd=self.folder, **options)
        self.assert_refused(result, "locked/out: cannot be written: Permission denied")
        self.assertNotIn("elements", result.stderr)

    def test_write_protected_files(self):
        program = shutil.copy(RUNTIME, self.folder / RUNTIME.name)
        self.assert_done(self.play("--report", "r.json"))
        (self.folder / "r.json").chmod(0o444)
        options = self.as_nobody()
        command = (program, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", "--report", "r.json")
        self.assert_refused(run(*command, cwd=self.folder, **options), "r.json: is there and write-protected", "--force")
        self.assert_done(run(*command, "--force", cwd=self.folder, **options))


class Temporaries(OutputTest):
    """Names on the way to an output lead nowhere else."""

    def setUp(self):
        super().setUp()
        self.victim = self.write("victim", "precious\n")
        self.description = self.write("m.toml", cube_toml(2))

    def bake_cube(self):
        return run(PRECOMPUTE, "m.toml", "-o", "new.palpate.hdf", cwd=self.folder)

    def test_links_of_precompute(self):
        for suffix in (".partial", ".progress"):
            for target in ("victim", "nothing"):
                link = self.folder / f"new.palpate.hdf{suffix}"
                link.symlink_to(target)
                self.assert_refused(self.bake_cube(), f"new.palpate.hdf{suffix}", "is in the way")
                self.assertTrue(link.is_symlink())
                link.unlink()
        self.assertEqual(self.victim.read_text(), "precious\n")
        self.assertFalse((self.folder / "nothing").exists())
        self.assert_done(self.bake_cube())

    def test_strangers_of_precompute(self):
        for suffix in (".partial", ".progress"):
            stranger = self.write(f"new.palpate.hdf{suffix}", "precious\n")
            self.assert_refused(self.bake_cube(), f"new.palpate.hdf{suffix}", "is in the way")
            self.assertEqual(stranger.read_text(), "precious\n")
            stranger.unlink()
            stranger.mkdir()
            self.assert_refused(self.bake_cube(), f"new.palpate.hdf{suffix}", "is in the way")
            stranger.rmdir()

    def test_links_of_other_outputs_are_passed_by(self):
        for name in ("r.json", "c.csv", "s.vtu"):
            (self.folder / f"{name}.partial").symlink_to("victim")
        self.assert_done(self.play("--report", "r.json", "--contacts", "c.csv", "--surface", "s.vtu", "--record", "out.mcap"))
        for name in ("r.json", "c.csv", "s.vtu"):
            self.assertTrue((self.folder / f"{name}.partial").is_symlink())
            self.assertGreater((self.folder / name).stat().st_size, 30)
        self.assertEqual(self.victim.read_text(), "precious\n")
        self.assertEqual([path.name for path in self.folder.glob("*.partial?*")], [])


class FullDisk(OutputTest):
    """What was printed and has not arrived is told."""

    def assert_told(self, program, *arguments):
        with open("/dev/full", "w") as full:
            result = subprocess.run([str(program), *map(str, arguments)], cwd=self.folder, stdout=full, stderr=subprocess.PIPE, text=True,
                                    timeout=PATIENCE, check=False)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("error: standard output: cannot be written", result.stderr)
        self.assertNotIn("should not happen", result.stderr)
        self.assertNotIn("defect", result.stderr)

    def test_precompute(self):
        for arguments in (("--help",), ("--version",), ("inspect", "cube.palpate.hdf"), ("inspect", "--help"), ("verify", "cube.palpate.hdf"),
                          ("compare", "cube.palpate.hdf", "cube.palpate.hdf", "--touches", "2")):
            with self.subTest(arguments=arguments):
                self.assert_told(PRECOMPUTE, *arguments)

    def test_runtime(self):
        self.assert_done(self.play("--record", "t.mcap"))
        commands = [("--help",), ("--version",), ("session", "t.mcap"), ("session", "t.mcap", "--json"), ("devices",), ("devices", "--json"),
                    ("devices", "--print-profile", "spacemouse"),
                    ("play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", "--report", "-")]
        commands += [(command, "--help") for command in ("probe", "play", "view", "export", "session", "devices", "samples")]
        commands += [("probe", "cube.palpate.hdf", "--at", "0.5,0.5,1", "--displace", "0,0,-0.1", *json_flag) for json_flag in ((), ("--json",))]
        for arguments in commands:
            with self.subTest(arguments=arguments):
                self.assert_told(RUNTIME, *arguments)

    def test_closed(self):
        for program, argument in ((RUNTIME, "--version"), (PRECOMPUTE, "--version")):
            result = subprocess.run(["bash", "-c", f'"{program}" {argument} >&-'], capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn("standard output: cannot be written", result.stderr)

    def test_what_prints_nothing_is_done(self):
        self.write("m.toml", cube_toml(2))
        with open("/dev/full", "w") as full:
            for command in ((PRECOMPUTE, "m.toml"), (RUNTIME, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast")):
                subprocess.run(command, cwd=self.folder, stdout=full, stderr=subprocess.DEVNULL, check=True)

    def test_an_error_stream_that_is_full_stops_nothing(self):
        self.write("m.toml", cube_toml(2))
        with open("/dev/full", "w") as full:
            for command in ((PRECOMPUTE, "m.toml"), (RUNTIME, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--report", "r.json"),
                            (RUNTIME, "play", "cube.palpate.hdf", "--device", "script:touch.csv", "--fast", "--record", "t.mcap"),
                            (RUNTIME, "export", "t.mcap", "--html", "t.html")):
                with self.subTest(command=command):
                    subprocess.run(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=full, check=True)
        self.assertEqual(json.loads((self.folder / "r.json").read_text())["ticks"], 201)


class FailedRecording(OutputTest):
    """A recording that fails is told at once, and the loop goes on."""

    @staticmethod
    def small_disk():
        resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))

    def start(self, *arguments, preexec=None):
        self.write("long.csv", LONG)
        process = subprocess.Popen([RUNTIME, "play", "cube.palpate.hdf", "--device", "script:long.csv", "--tool", "sphere:0.1", "--record", "t.mcap",
                                    "--report", "r.json", *arguments], cwd=self.folder, stderr=subprocess.PIPE, text=True, preexec_fn=preexec)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def wait_for_warning(self, process, *pieces):
        for line in process.stderr:
            if "warning: the recording failed" in line:
                for piece in pieces:
                    self.assertIn(piece, line)
                return
        self.fail("it was not told")

    def end(self, process, *pieces):
        time.sleep(0.3)  # the loop goes on without it
        process.send_signal(signal.SIGINT)
        messages = process.stderr.read()
        self.assertEqual(process.wait(timeout=PATIENCE), 1, messages)
        report = json.loads((self.folder / "r.json").read_text())
        for piece in pieces:
            self.assertIn(piece, report["recording_failed"])
        self.assertGreater(report["dropped_ticks"], 0)
        return report

    def test_disk_that_is_full(self):
        process = self.start(preexec=self.small_disk)
        self.wait_for_warning(process, "t.mcap", "File too large")
        report = self.end(process, "File too large")
        told = json.loads(self.runtime("session", "t.mcap", "--json").stdout)
        self.assertEqual(report["dropped_ticks"], report["ticks"] - told["ticks"])

    def test_without_a_clock(self):
        self.write("long.csv", "t,x,y,z\n0,0.5,0.5,1.3\n20,0.5,0.5,1.05\n")
        result = self.play("--record", "t.mcap", "--report", "r.json", "--overlay", "no", device="script:long.csv", preexec_fn=self.small_disk)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("warning: the recording failed", result.stderr)
        report = json.loads((self.folder / "r.json").read_text())
        self.assertEqual(report["ticks"], 20001)
        self.assertIn("File too large", report["recording_failed"])
        kept = json.loads(self.runtime("session", "t.mcap", "--json").stdout)
        self.assertGreater(kept["ticks"], 0)
        self.assertEqual(report["dropped_ticks"], 20001 - kept["ticks"])
        self.assertIn(f"{report['dropped_ticks']} ticks", result.stderr)

    def test_one_that_does_not_fail(self):
        self.assert_done(self.play("--record", "t.mcap", "--report", "r.json"))
        report = json.loads((self.folder / "r.json").read_text())
        self.assertEqual((report["recording"], report["recording_failed"]), ("t.mcap", None))


class Report(OutputTest):
    def test_is_printed_where_it_is_asked_for(self):
        plain = self.assert_done(self.play())
        self.assertEqual(plain.stdout, "")
        for piece in ("201 ticks", "largest force", "step: median"):
            self.assertIn(piece, plain.stderr)
        self.assertLess(len(plain.stderr.splitlines()), 12)
        asked = self.assert_done(self.play("--report", "-"))
        self.assertEqual(json.loads(asked.stdout)["ticks"], 201)
        self.assertIn("201 ticks", asked.stderr)
        filed = self.assert_done(self.play("--report", "./-"))
        self.assertEqual(filed.stdout, "")
        self.assertEqual(json.loads(pathlib.Path(self.folder / "-").read_text())["ticks"], 201)


if __name__ == "__main__":
    unittest.main()
