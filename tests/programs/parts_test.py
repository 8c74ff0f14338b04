"""palpate-precompute in parts: the bytes of one run, whoever computed them, and what is told where parts do not fit."""

import json
import resource
import shutil
import signal
import subprocess
import unittest

import h5py
import numpy
from programs import PRECOMPUTE, ProgramTest, cube_toml, run

DYNAMICS = '[dynamics]\nmethod = "packed"\n'
COMPRESSED = 'compression = "h2"\n'


class PartsTest(ProgramTest):
    def part(self, model, number, parts, *arguments):
        result = run(PRECOMPUTE, model, "--part", f"{number}/{parts}", *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr

    def straight(self, text):
        """The model, and the bytes of one undisturbed run."""
        model = self.write("model.toml", text)
        output = self.folder / "cube.palpate.hdf"
        self.assertEqual(run(PRECOMPUTE, model, "--jobs", "1", cwd=self.folder).returncode, 0)
        data = output.read_bytes()
        output.unlink()
        return model, data

    def join(self, model, *arguments):
        result = run(PRECOMPUTE, "join", model, *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return (self.folder / "cube.palpate.hdf").read_bytes()


class Parts(PartsTest):
    def check(self, text, *numbers):
        model, data = self.straight(text)
        for parts in numbers:
            for number in range(parts, 0, -1):
                self.part(model, number, parts, "--jobs", str(1 + number % 2))
            self.assertEqual(self.join(model), data, f"{parts} parts")
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["cube.palpate.hdf", "model.toml"])
            (self.folder / "cube.palpate.hdf").unlink()

    def test_one_and_three_parts_of_both_precisions(self):
        self.check(cube_toml(7, precision="double"), 1, 3)
        self.check(cube_toml(7, precision="split"), 3)

    def test_dynamics(self):
        self.check(cube_toml(7, scope="full", precision="single") + DYNAMICS, 2, 5)

    def test_modes_and_overlays(self):
        self.check(cube_toml(6, scope="layers").replace("\"layers\"", "\"layers\"\nlayers = 2") + '[dynamics]\nmethod = "modal"\nmodes = 10\n'
                   "[overlay]\n[[overlay.region]]\nsphere = {center = [0.5, 0.5, 1], radius = 0.3}\n", 3)

    def test_compressed(self):
        text = cube_toml(12).replace('precision = "double"\n', COMPRESSED)
        self.check(text, 1, 4)

    def test_more_parts_than_blocks_of_columns(self):
        self.check(cube_toml(3), 4)  # 144 columns, one block

    def test_parts_divide_the_work(self):
        model = self.write("model.toml", cube_toml(12))
        self.part(model, 1, 3)
        self.part(model, 2, 3)
        one, two = (self.folder / f"cube.palpate.hdf.part-{k}-of-3" for k in (1, 2))
        columns = 3 * (13**3 - 11**3)  # 8 bytes each from the diagonal down
        whole = 8 * columns * (columns + 1) // 2
        for file in (one, two):
            self.assertLess(file.stat().st_size, 0.7 * whole)

    def test_parts_from_other_folders_are_kept_when_asked(self):
        model, data = self.straight(cube_toml(8))
        for number in (1, 2):
            self.part(model, number, 2)
            there = self.folder / f"node{number}"
            there.mkdir()
            for suffix in ("", ".progress"):
                name = f"cube.palpate.hdf.part-{number}-of-2{suffix}"
                shutil.move(self.folder / name, there / name)
        self.assertEqual(self.join(model, "node1", self.folder / "node2" / "cube.palpate.hdf.part-2-of-2", "--keep-parts"), data)
        self.assertEqual(len(list((self.folder / "node1").iterdir())), 2)

    def test_a_part_that_was_killed_goes_on(self):
        model, data = self.straight(cube_toml(14))
        journal = self.folder / "cube.palpate.hdf.part-1-of-2.progress"
        for stop, status in ((signal.SIGKILL, -signal.SIGKILL), (signal.SIGTERM, 130)):
            left = journal.read_text().count("\ncolumns") if journal.exists() else 0
            process = subprocess.Popen([PRECOMPUTE, model, "--part", "1/2", "--jobs", "1"], cwd=self.folder, stderr=subprocess.DEVNULL)
            self.wait_for(lambda: journal.exists() and journal.read_text().count("\ncolumns") > left, process)
            process.send_signal(stop)
            self.assertEqual(process.wait(), status)
        self.part(model, 2, 2)
        self.assert_refused(run(PRECOMPUTE, "join", model, cwd=self.folder),
                            "part 1 of 2 is not finished", "--part 1/2 again: it goes on")
        said = self.part(model, 1, 2)
        self.assertRegex(said, r"Green's functions: [1-9]\d* of \d+ columns were kept")
        self.assertEqual(self.join(model), data)

    def test_a_join_that_was_killed_goes_on(self):
        model, data = self.straight(cube_toml(14))
        for number in (1, 2):
            self.part(model, number, 2)
        whole = self.folder / "cube.palpate.hdf.progress"
        process = subprocess.Popen([PRECOMPUTE, "join", model], cwd=self.folder, stderr=subprocess.DEVNULL)
        self.wait_for(lambda: whole.exists() and "\ncolumns" in whole.read_text(), process)
        process.kill()
        process.wait()
        self.assertEqual(self.join(model), data)


class Guest(PartsTest):
    """Signals and reports, as batch systems want them."""

    def test_signals_before_the_columns_end_it_at_once(self):
        model = self.write("model.toml", cube_toml(24))
        for stop in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1):
            with subprocess.Popen([PRECOMPUTE, model], cwd=self.folder, stderr=subprocess.PIPE, text=True) as process:
                self.assertIn("generating", process.stderr.readline())
                process.send_signal(stop)
                said = process.stderr.read()
                self.assertEqual(process.wait(), 130)
            self.assertIn("interrupted: no columns were computed", said)
            self.assertEqual([p.name for p in self.folder.iterdir()], ["model.toml"])

    def test_sigusr1_keeps_the_columns_and_a_report_says_so(self):
        model, data = self.straight(cube_toml(14))
        journal, report = self.folder / "cube.palpate.hdf.progress", self.folder / "report.json"
        process = subprocess.Popen([PRECOMPUTE, model, "--jobs", "1", "--report", report], cwd=self.folder, stderr=subprocess.DEVNULL)
        self.wait_for(lambda: journal.exists() and "\ncolumns" in journal.read_text(), process)
        process.send_signal(signal.SIGUSR1)
        self.assertEqual(process.wait(), 130)
        stopped = json.loads(report.read_text())["models"][0]
        self.assertEqual(stopped["result"], "interrupted")
        self.assertEqual(run(PRECOMPUTE, model, "--report", report, cwd=self.folder).returncode, 0)
        self.assertEqual((self.folder / "cube.palpate.hdf").read_bytes(), data)
        done = json.loads(report.read_text())["models"][0]
        self.assertEqual(done["result"], "done")
        self.assertEqual(done["tiles_kept"], stopped["tiles_solved"])
        self.assertGreater(done["tiles_kept"], 0)

    def test_report_of_a_part_and_to_standard_output(self):
        model = self.write("model.toml", cube_toml(3))
        said = run(PRECOMPUTE, model, "--part", "1/2", "--report", "-", cwd=self.folder)
        report = json.loads(said.stdout)
        bake = report["models"][0]
        self.assertEqual((bake["result"], bake["part"]), ("part", [1, 2]))
        self.assertEqual((bake["nodes"], bake["elements"]), (64, 162))
        self.assertEqual(bake["stages"][-1]["name"], "Green's functions")
        self.assertEqual(report["ranks"], 1)
        self.assertGreater(report["peak_memory_bytes"], 1 << 20)

    def test_a_report_takes_the_place_of_nothing_else(self):
        model = self.write("model.toml", cube_toml(3))
        self.assert_refused(run(PRECOMPUTE, model, "--report", model, cwd=self.folder), "model.toml")
        self.assertEqual(model.read_text(), cube_toml(3))


class Misfits(PartsTest):
    def setUp(self):
        super().setUp()
        self.model = self.write("model.toml", cube_toml(3))

    def join_is_refused(self, *pieces, arguments=()):
        self.assert_refused(run(PRECOMPUTE, "join", self.model, *arguments, cwd=self.folder), *pieces)
        self.assertFalse((self.folder / "cube.palpate.hdf").exists())

    def test_no_parts_and_missing_ones(self):
        self.join_is_refused("there are no parts", "--part 1/N")
        self.part(self.model, 2, 4)
        self.join_is_refused("3 parts are missing: 1/4, 3/4, 4/4", "--part 1/4")
        for number in (1, 3):
            self.part(self.model, number, 4)
        self.join_is_refused("a part is missing: 4/4", "--part 4/4")

    def test_parts_of_two_sizes(self):
        self.part(self.model, 1, 2)
        self.part(self.model, 2, 3)
        self.join_is_refused("is one of 3 parts", "part-1-of-2 one of 2")

    def test_a_part_twice(self):
        self.part(self.model, 1, 2)
        self.part(self.model, 2, 2)
        shutil.copytree(self.folder, self.folder / "copy")
        self.join_is_refused("is part 1 of 2", "Name each part once", arguments=(".", "copy"))

    def test_parts_of_two_models(self):
        self.part(self.model, 1, 2)
        self.write("model.toml", cube_toml(3).replace("0.3", "0.31"))
        self.part(self.model, 2, 2)
        self.join_is_refused("part-2-of-2: is of another model or version than", "part-1-of-2")

    def test_a_model_that_changed_since(self):
        for number in (1, 2):
            self.part(self.model, number, 2)
        self.write("model.toml", cube_toml(3).replace("0.3", "0.31"))
        self.join_is_refused("is a part of another model", "the same model.toml")

    def test_another_version(self):
        for number in (1, 2):
            self.part(self.model, number, 2)
            part = self.folder / f"cube.palpate.hdf.part-{number}-of-2"
            with h5py.File(part, "r+") as file:
                file.attrs["generator"] = numpy.bytes_("palpate-precompute 7.1.0")
            self.assertEqual(run(PRECOMPUTE, "index", part).returncode, 0)
            journal = part.with_name(part.name + ".progress")
            lines = journal.read_text().split("\n")
            key = lines[1].split(" ")[1]
            journal.write_text(journal.read_text().replace(key, key[::-1]))  # the version is in the key
        self.join_is_refused("was made by palpate-precompute 7.1.0, and this is palpate-precompute 0.1.0")

    def test_a_damaged_part(self):
        for number in (1, 2):
            self.part(self.model, number, 2)
        part = max(self.folder.glob("*of-2"), key=lambda path: path.stat().st_size)
        data = bytearray(part.read_bytes())
        data[int(part.with_name(part.name + ".progress").read_text().split("\n")[1].split(" ")[4]) + 1000] ^= 1
        part.write_bytes(data)
        self.join_is_refused("has changed since it was made", "Copy it again")
        part.write_bytes(data[:2000])
        self.join_is_refused(part.name)
        part.with_name(part.name + ".progress").unlink()
        self.join_is_refused("Copy both files of a part")

    def test_a_part_that_another_process_writes(self):
        model = self.write("model.toml", cube_toml(16))
        journal = self.folder / "cube.palpate.hdf.part-1-of-2.progress"
        with subprocess.Popen([PRECOMPUTE, model, "--part", "1/2", "--jobs", "1"], cwd=self.folder, stderr=subprocess.DEVNULL) as first:
            self.wait_for(lambda: journal.exists() and "\nmodel" in journal.read_text(), first)
            first.send_signal(signal.SIGSTOP)
            second = run(PRECOMPUTE, model, "--part", "1/2", cwd=self.folder)
            first.send_signal(signal.SIGCONT)
            first.kill()
        self.assert_refused(second, "another palpate-precompute is writing this file")

    def test_no_room_for_a_part(self):
        model = self.write("model.toml", cube_toml(10))

        def limit_file_size():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))

        self.assert_refused(run(PRECOMPUTE, model, "--part", "1/2", cwd=self.folder, preexec_fn=limit_file_size), "part-1-of-2")
        self.assertEqual([p.name for p in self.folder.iterdir()], ["model.toml"])

    def test_usage(self):
        for part in ("0/3", "4/3", "1", "a/b", "1/", "1/200000"):
            result = run(PRECOMPUTE, self.model, "--part", part, cwd=self.folder)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn("is not K/N with 1 <= K <= N", result.stderr)
        self.assertEqual(run(PRECOMPUTE, "join", cwd=self.folder).returncode, 2)


if __name__ == "__main__":
    unittest.main()
