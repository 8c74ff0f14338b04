"""Models, recordings, scripts and profiles that are damaged, crafted, or no files at all."""

import json
import os
import re
import resource
import signal
import struct
import subprocess
import time

import h5py
import numpy

from programs import BINARY, PRECOMPUTE, RUNTIME, SOURCE, ProgramTest, cube_toml, palpate, records_of, run, set_tick

TOUCH = "t,x,y,z\n0,0.4,0.5,1.3\n0.1,0.4,0.5,1.1\n0.2,0.4,0.5,1.3\n"
TOOL = ("--tool", "sphere:0.15")


class FilesTest(ProgramTest):
    def record(self, *arguments):
        """A baked cube and a recording of a touch."""
        self.write("touch.csv", TOUCH)
        file = self.bake(cube_toml(3, scope="full"))
        self.play(file, "--device", "script:touch.csv", *TOOL, "--record", "touch.mcap", *arguments)
        return file, self.folder / "touch.mcap"

    def play(self, file, *arguments):
        result = run(RUNTIME, "play", file, "--fast", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def expect_refused(self, words, *command, status=1):
        """One error line with these words and one hint line, fit for a terminal."""
        result = run(*command, cwd=self.folder)
        self.assertEqual(result.returncode, status, (command, result.stderr))
        self.assertRegex(result.stderr, r"\Aerror: [^\n]+\n(  [^\n]*\n)*hint: [^\n]+\n\Z")
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertFalse([c for c in result.stderr if ord(c) < 32 and c != "\n"])


def readers(model, recording):
    """All that read a recording."""
    return ((RUNTIME, "session", recording), (RUNTIME, "export", recording, "--html", "page.html"), (RUNTIME, "view", recording, "--view-address", "0"),
            (RUNTIME, "play", model, "--device", f"replay:{recording}", "--fast"))


class Recordings(FilesTest):
    def test_a_flipped_bit_is_told_by_all_that_read_it(self):
        model, recording = self.record("--overlay", "r=2,rings=1")
        whole = recording.read_bytes()
        chunks = [(at, begin, end) for at, kind, begin, end in records_of(whole) if kind == 6]
        pictures = [chunk for chunk in chunks if chunk[2] - chunk[1] > 20_000 and b"\x03\0" == whole[chunk[1] + 49 : chunk[1] + 51]]
        self.assertTrue(0 < len(pictures) < len(chunks))
        for at, begin, end in (chunks[0], pictures[-1]):
            damaged = bytearray(whole)
            damaged[(begin + end) // 2] ^= 0x40
            recording.write_bytes(damaged)
            readers_of_all = readers(model, recording) if (at, begin, end) == chunks[0] else readers(model, recording)[1:2]  # pictures are read when they are looked at
            for command in readers_of_all:
                self.expect_refused([f"byte {at} was altered", "touch.mcap"], *command)
            with self.assertRaisesRegex(palpate.Error, "checksum"):
                palpate.read(recording)

    def test_a_node_that_the_body_does_not_have_is_refused(self):
        model, recording = self.record("--overlay", "r=2,rings=1")
        for node in (1_000_000_000, 64, 21):  # 21 is inside, with one of 3 x 3 x 3 cells around
            set_tick(recording, "patch", 30, node)
            # The body is loaded before, which is told.
            self.assert_refused(run(RUNTIME, "play", model, "--device", f"replay:{recording}", "--fast", cwd=self.folder),
                                "row 30", f"patch is {node}", str(model))

    def test_numbers_that_mean_nothing_are_refused(self):
        model, recording = self.record()
        whole = recording.read_bytes()
        for name, value in (("phase", 5), ("fault", 9), ("event", 64), ("status", 1 << 31), ("grab", 2), ("contacts", -1), ("time", -1.0)):
            recording.write_bytes(whole)
            set_tick(recording, name, 30, value)
            for command in readers(model, recording):
                self.expect_refused([name, "row 30"], *command)

    def test_of_hdf5_are_refused_in_one_sentence(self):
        model, recording = self.record()
        old = self.folder / "touch.h5"  # an export says the same of itself
        self.assertEqual(run(RUNTIME, "export", recording, "--hdf5", old).returncode, 0)
        for command in readers(model, old):
            self.expect_refused(["touch.h5", "is HDF5, which palpate-runtime export --hdf5 makes of a recording", "Give the recording that it was made of"], *command)


class NoFiles(FilesTest):
    def test_are_refused_at_once(self):
        self.write("touch.csv", TOUCH)
        file = self.bake(cube_toml(2))
        os.mkfifo(self.folder / "fifo")
        (self.folder / "folder").mkdir()
        for name in ("fifo", "folder", "/dev/zero", "/dev/null", "none"):
            for command in ((RUNTIME, "probe", name, "--node", "20", "--displace", "0,0,0"),
                            (RUNTIME, "probe", file, "--model", name, "--node", "20", "--displace", "0,0,0"),
                            (RUNTIME, "play", file, "--fast", "--device", f"script:{name}", *TOOL),
                            (RUNTIME, "play", file, "--fast", "--device", f"replay:{name}"),
                            (RUNTIME, "session", name), (RUNTIME, "view", name), (RUNTIME, "export", name, "--html", "page.html"),
                            (RUNTIME, "devices", "--profile", name),
                            (PRECOMPUTE, "inspect", name), (PRECOMPUTE, "verify", name), (PRECOMPUTE, "compare", name, file)):
                if command == (RUNTIME, "view", "folder"):
                    continue  # all that is in it is shown
                with self.subTest(command=command):
                    self.expect_refused([name], *command)


class Index(FilesTest):
    def test_that_is_not_there_is_named_and_added(self):
        file = self.bake(cube_toml(2))
        whole = file.read_bytes()
        file.write_bytes(whole[32768:])  # as h5repack leaves it
        for command in ((RUNTIME, "probe", file, "--node", "20", "--displace", "0,0,0"), (PRECOMPUTE, "verify", file)):
            self.expect_refused(["not a Palpate file with an index", f"palpate-precompute index {file}"], *command)
        self.assertEqual(run(PRECOMPUTE, "index", file).returncode, 0)
        self.assertEqual(file.read_bytes(), whole)

    def test_is_renewed_where_another_program_changed_the_file(self):
        file = self.bake(cube_toml(2))
        with h5py.File(file, "r+", libver=("v110", "v110")) as model:
            model.attrs["remark"] = numpy.bytes_("mine")
        result = run(PRECOMPUTE, "verify", file)
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertIn(f"palpate-precompute index {file}", result.stdout)
        self.assertEqual(run(PRECOMPUTE, "index", file).returncode, 0)
        self.assertEqual(run(PRECOMPUTE, "verify", file).returncode, 0)

    def test_is_not_added_to_what_is_no_model(self):
        self.write("notes.hdf", "none")
        self.expect_refused(["notes.hdf", "is not an HDF5 file"], PRECOMPUTE, "index", "notes.hdf")
        self.assertEqual((self.folder / "notes.hdf").read_text(), "none")


class CleanText(FilesTest):
    ESCAPE = "\x1b]0;owned\x07\x1b[2J\u202e"
    SHOWN = "\\x1b]0;owned\\x07\\x1b[2J\\u202e"

    @staticmethod
    def write_info(recording, info):
        """Changes what the file says of the run. Its end, which says where things lie, is left out."""
        def text(value):
            return struct.pack("<I", len(value.encode())) + value.encode()

        whole = recording.read_bytes()
        pairs = b"".join(text(name) + text(value) for name, value in info.items())
        content = text("palpate") + struct.pack("<I", len(pairs)) + pairs
        data = whole[:8]
        for at, kind, _, end in records_of(whole):
            if kind == 15:
                break
            data += struct.pack("<BQ", 12, len(content)) + content if kind == 12 else whole[at:end]
        recording.write_bytes(data)

    def test_of_a_recordings_attributes(self):
        model, recording = self.record()
        info = palpate.read(recording).info
        info.update({name: name + self.ESCAPE for name in ("generator", "model", "content_hash", "device")})
        self.write_info(recording, info)
        result = run(RUNTIME, "session", recording)
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in ("generator", "model", "content_hash", "device"):
            self.assertIn(name + self.SHOWN, result.stdout)
        self.assertNotIn("\x1b", result.stdout)
        replay = self.play(model, "--device", f"replay:{recording}")
        self.assertIn("model" + self.SHOWN, replay.stderr)  # in the warning that it is another
        self.assertNotIn("\x1b", replay.stderr)

    def test_of_a_model_s_name(self):
        """A description cannot have such a name; a file may. Of a newer minor version, as its hash is not known then."""
        file = self.bake(cube_toml(2))
        with h5py.File(file, "r+", libver=("v110", "v110")) as model:
            minor = model.attrs["version"][1]
            for name, value in (("name", "cube\x1b[2J".encode()), ("version", [4, minor + 1])):
                del model.attrs[name]
                model.attrs[name] = numpy.array(value, dtype="S80" if name == "name" else "int64")
        self.assertEqual(run(PRECOMPUTE, "index", file).returncode, 0)
        for command in ((PRECOMPUTE, "inspect", file), (RUNTIME, "probe", file, "--node", "20", "--displace", "0,0,0")):
            result = run(*command)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertNotIn("\x1b", result.stdout + result.stderr)
        self.assertIn("cube\\x1b[2J, written by", run(PRECOMPUTE, "inspect", file).stdout)

    def test_of_a_script(self):
        file = self.bake(cube_toml(2))
        self.write("touch.csv", "t,x,y,z\n0,0,0," + self.ESCAPE + 70_000 * "1x" + "\n")
        self.expect_refused(["'" + self.SHOWN + "1x", "…"], RUNTIME, "play", file, "--fast", "--device", "script:touch.csv", *TOOL)


class CleanNames(FilesTest):
    """A file's name does nothing to a terminal, whatever a program says of it."""

    NAME = "a\x1b[2J open b in a browser; c\u202e"
    SHOWN = "a\\x1b[2J open b in a browser; c\\u202e"

    def said(self, *command, status=0, **options):
        result = run(*command, cwd=self.folder, **options)
        self.assertEqual(result.returncode, status, result.stderr)
        self.assertNotRegex(result.stdout + result.stderr, "[\x1b\u202e]", command)
        return result.stderr + result.stdout

    def test_of_what_is_written_and_read(self):
        body, recording, toml, script = (f"{self.NAME}.{end}" for end in ("palpate.hdf", "mcap", "toml", "csv"))
        self.write(toml, cube_toml(2))
        self.write(script, TOUCH)
        self.assertIn(self.SHOWN, self.said(PRECOMPUTE, toml, "-o", body))
        self.assertIn(self.SHOWN, self.said(PRECOMPUTE, toml, "-o", body, "--unless-done"))
        for command in ("verify", "inspect"):
            self.said(PRECOMPUTE, command, body)
        self.said(PRECOMPUTE, "compare", body, body)
        play = (RUNTIME, "play", body, "--fast", "--device", f"script:{script}", *TOOL)
        self.assertIn(self.SHOWN, self.said(*play, "--record", recording, "--report", f"{self.NAME}.json"))
        self.said(*play, "--contacts", f"{self.NAME}.contacts.csv", "--surface", f"{self.NAME}.vtu")
        self.assertIn(self.SHOWN, self.said(RUNTIME, "session", recording))
        for option, end in (("--html", "html"), ("--gltf", "glb"), ("--csv", "ticks.csv"), ("--vtu", "pvd")):
            self.assertIn(self.SHOWN, self.said(RUNTIME, "export", recording, option, f"{self.NAME}.{end}"), option)
        self.write(toml, cube_toml(2) + "# another\n")
        self.said(RUNTIME, "probe", body, "--node", "20", "--displace", "0,0,0")  # warns that it is stale
        for command in (("play", "no" + self.NAME, "--view"), ("push", "no" + self.NAME), ("session", body), ("view", body),
                        ("devices", "--profile", "no" + self.NAME)):
            self.assertIn(self.SHOWN, self.said(RUNTIME, *command, status=1), command)
        self.assertIn(self.SHOWN, self.said(RUNTIME, self.NAME + ".mcap", status=2))

    def test_that_begin_with_a_dash(self):
        self.write("-cut.off", "OFF\n8 12 0\n0 0 0\n")
        self.assertIn("-cut.off:2", self.said(RUNTIME, "push", "--", "-cut.off", status=1))

    def test_that_are_not_utf_8(self):
        model = self.write("m.toml", cube_toml(2))
        body = b"\xff.palpate.hdf"
        self.write("touch.csv", TOUCH)
        self.said(PRECOMPUTE, model, "-o", os.fsdecode(body))
        self.said(RUNTIME, "play", os.fsdecode(body), "--fast", "--device", "script:touch.csv", *TOOL, "--record", "r.mcap", "--report", "r.json")
        for option, end in (("--html", "html"), ("--gltf", "glb"), ("--csv", "csv"), ("--vtu", "pvd")):
            self.said(RUNTIME, "export", "r.mcap", option, f"r.{end}")
        glb = (self.folder / "r.glb").read_bytes()
        json.loads(glb[20:20 + int.from_bytes(glb[12:16], "little")].decode())
        json.loads((self.folder / "r.json").read_text())
        json.loads(run(RUNTIME, "session", "r.mcap", "--json", cwd=self.folder).stdout)

    def test_of_a_link_to_itself(self):
        (self.folder / "loop").symlink_to("loop")
        (self.folder / "loop.toml").symlink_to("loop.toml")
        body = self.bake(cube_toml(2))
        for command in ((PRECOMPUTE, "loop"), (PRECOMPUTE, "loop.toml"), (PRECOMPUTE, "join", "loop"), (PRECOMPUTE, "loop.toml", "--unless-done"),
                        (PRECOMPUTE, "join", "model.toml", "loop"), (PRECOMPUTE, "verify", "loop"), (PRECOMPUTE, "new", "loop.stl"),
                        (PRECOMPUTE, "model.toml", "-o", "loop"), (PRECOMPUTE, "model.toml", "-o", "loop/x"), (PRECOMPUTE, "model.toml", "--unless-done", "-o", "loop"),
                        (RUNTIME, "play", "loop", "--view"), (RUNTIME, "push", "loop"), (RUNTIME, "view", "loop"), (RUNTIME, "session", "loop"),
                        (RUNTIME, "export", "loop", "--html", "a.html"), (RUNTIME, "probe", body, "--node", "20", "--displace", "0,0,0", "--field", "loop/x.csv"),
                        (RUNTIME, "play", body, "--fast", "--device", "script:loop", *TOOL), (RUNTIME, "play", body, "--fast", "--device", "replay:loop"),
                        (RUNTIME, "devices", "--profile", "loop")):
            with self.subTest(command=command):
                result = run(*command, cwd=self.folder)
                self.assert_refused(result)
                self.assertNotIn("defect", result.stderr)


class Truncated(FilesTest):
    def test_while_it_is_in_use_does_nothing(self):
        self.write("touch.csv", TOUCH.replace("0.2,", "30,"))
        file = self.bake(cube_toml(3))
        process = subprocess.Popen([RUNTIME, "play", file, "--device", "script:touch.csv", *TOOL], cwd=self.folder, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        while "loaded in" not in process.stderr.readline():
            self.assertIsNone(process.poll())
        os.truncate(file, 0)
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(), 130, process.stderr.read())
        process.communicate()

    def test_while_it_is_mapped_ends_the_run_with_the_reason(self):
        """A matrix that does not fit into memory is mapped: here 90 MB of it, where a process may have 80."""
        if re.search(r"^PALPATE_SANITIZE:\w+=.+$", (BINARY / "CMakeCache.txt").read_text(), re.MULTILINE):
            self.skipTest("a sanitizer takes more memory than that")

        def little_memory():
            resource.setrlimit(resource.RLIMIT_DATA, (80_000_000, 80_000_000))
            resource.setrlimit(resource.RLIMIT_STACK, (1_000_000, 1_000_000))

        self.write("touch.csv", "t,x,y,z\n0,0.5,0.5,1.3\n0.1,0.5,0.5,1.05\n80000,0.51,0.5,1.05\n")
        file = self.bake(cube_toml(18))
        process = subprocess.Popen([RUNTIME, "play", file.name, "--device", "script:touch.csv", *TOOL, "--max-contacts", "4", "--depth", "no", "--fast"], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=little_memory, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
        self.addCleanup(process.kill)
        while "used packed" not in process.stderr.readline():
            self.assertIsNone(process.poll())
        os.truncate(file, 0)
        _, messages = process.communicate()
        self.assertEqual(process.returncode, 1, messages)
        self.assertRegex(messages, r"error: model\.palpate\.hdf: was cut off while it was in use, or its disk failed \(bus error\)\nhint: [^\n]+\n\Z")

    def test_during_the_load_is_an_error(self):
        file = self.bake(cube_toml(3))
        whole = file.read_bytes()
        for size in range(0, len(whole), len(whole) // 40):
            file.write_bytes(whole[:size])
            self.expect_refused(["model.palpate.hdf"], RUNTIME, "probe", file, "--node", "20", "--displace", "0,0,0")


class Fuzzed(ProgramTest):
    """The first of the files of scripts/fuzz-programs: the same ones every time."""

    def test_metadata(self):
        result = run(SOURCE / "scripts" / "fuzz-programs", "--kinds", "hdf5-model,recording", "--runs", "40", "--seed", "3",
                     "--no-memory-limit")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
