"""palpate-precompute-mpi with one to four ranks on this machine: the bytes of palpate-precompute, whatever happens to ranks, and its numbers where they
share a factor."""

import json
import os
import pathlib
import random
import signal
import subprocess
import time
import unittest

import h5py
import numpy

from programs import BINARY, MODELS, PATIENCE, PRECOMPUTE, ProgramTest, cube_toml, run

RANKS = BINARY / "precompute" / "cluster" / "palpate-precompute-mpi"
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1"]
KILLS = int(os.environ.get("PALPATE_RANK_KILLS", "4"))  # of a rank and of a whole job
HAS_MUMPS = "dmumps" in run("ldd", RANKS).stdout


def compressed_toml(cells):
    return cube_toml(cells).replace('precision = "double"\n', 'compression = "h2"\n')


def overlays_toml(cells, radius):
    """The cube with patches around all nodes of its top that are less than `radius` from the middle."""
    return (cube_toml(cells, scope="layers").replace('"layers"', '"layers"\nlayers = 2')
            + f"[overlay]\n[[overlay.region]]\nsphere = {{center = [0.5, 0.5, 1], radius = {radius}}}\n")


class RanksTest(ProgramTest):
    def command(self, ranks, *arguments):
        return [*MPIRUN, "-n", str(ranks), str(RANKS), *map(str, arguments)]

    def ranks(self, ranks, *arguments):
        return run(*self.command(ranks, *arguments), cwd=self.folder)

    def own_factors(self, ranks, *arguments):
        """A run of ranks that don't share a factor, whatever the memory; it must succeed."""
        result = self.ranks(ranks, *arguments, "--factor", "rank", "--jobs", "1")
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr

    def straight(self, model):
        output = self.folder / "straight.palpate.hdf"
        result = run(PRECOMPUTE, model, "-o", output, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return output.read_bytes()

    def start(self, ranks, model, output, may_end=False, **options):
        """A running job that has written some columns, beyond those that an earlier one left; or that has ended, where it may."""
        journal = output.with_name(output.name + ".progress")
        left = journal.read_text() if journal.exists() else ""
        process = subprocess.Popen(self.command(ranks, model, "-o", output, "--factor", "rank", "--jobs", "1"), cwd=self.folder,
                                   stderr=subprocess.PIPE, text=True, **options)
        self.addCleanup(process.stderr.close)

        def has_written():
            try:
                text = journal.read_text()
            except FileNotFoundError:
                return False
            return text != left and "\ncolumns" in text
        self.wait_for(lambda: has_written() or (may_end and process.poll() is not None), None if may_end else process)
        return process

    def pids(self, mpirun):
        """The processes of a job's ranks."""
        found = []
        for entry in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                words = (entry / "cmdline").read_bytes().split(b"\0")
                parent = int((entry / "stat").read_text().rsplit(") ")[1].split()[1])
            except (OSError, IndexError):
                continue
            if words[0] == os.fsencode(RANKS) and parent == mpirun.pid:
                found.append(int(entry.name))
        return sorted(found)


class Bytes(RanksTest):
    def check(self, model, *counts):
        data = self.straight(model)
        output = self.folder / "ranks.palpate.hdf"
        for ranks in counts:
            self.own_factors(ranks, model, "-o", output)
            self.assertEqual(output.read_bytes(), data, f"{ranks} ranks")
            output.unlink()
        self.assertEqual(sorted(p.name for p in self.folder.glob("ranks*")), [])

    def test_cube(self):
        self.check(self.write("model.toml", cube_toml(8, precision="split")), 1, 2, 3, 4, 8)

    def test_plate(self):
        self.check(MODELS / "plate" / "model.toml", 2, 3)

    def test_cantilever_with_the_inverse_of_dynamics(self):
        self.check(MODELS / "cantilever" / "model.toml", 1, 2, 3, 4)

    def test_liver(self):
        text = (MODELS / "liver" / "model.toml").read_text()
        image = MODELS / "liver" / "liver.inr.gz"
        if not image.exists():
            self.skipTest("the liver's image is not there: scripts/demo gets it")
        text = text.replace("edge_length = 0.0055", "edge_length = 0.022").replace('"layers"\nlayers = 2', '"surface"').replace('"liver.inr.gz"', f'"{image}"')
        self.check(self.write("model.toml", text), 1, 2, 4)

    def test_compressed(self):
        self.check(self.write("model.toml", compressed_toml(11)), 1, 2, 4)

    def test_modes_and_overlays(self):
        self.check(self.write("model.toml", overlays_toml(6, 0.3) + '[dynamics]\nmethod = "modal"\nmodes = 10\n'), 1, 2, 4)

    def test_many_modes(self):
        self.check(self.write("model.toml", cube_toml(11) + '[dynamics]\nmethod = "modal"\nmodes = 30\n'), 1, 2, 3, 8)

    def test_ranks_draw_blocks_of_columns(self):
        model = self.write("model.toml", cube_toml(8))
        data = self.straight(model)
        report = self.folder / "report.json"
        result = self.ranks(3, model, "--report", report)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual((self.folder / "cube.palpate.hdf").read_bytes(), data)
        numbers = json.loads(report.read_text())
        self.assertEqual(numbers["ranks"], 3)
        self.assertEqual(len(numbers["rank_memory_bytes"]), 3)
        self.assertEqual(numbers["models"][0]["tiles_solved"], -(-numbers["models"][0]["stored_dofs"] // numbers["models"][0]["block_columns"]))
        self.assertNotIn("factor_over_ranks", numbers["models"][0])  # each has one where the memory is there

    def test_one_machine_goes_on_with_what_ranks_left_and_the_reverse(self):
        model = self.write("model.toml", cube_toml(16))
        data = self.straight(model)
        output = self.folder / "x.palpate.hdf"
        job = self.start(2, model, output)
        job.send_signal(signal.SIGUSR1)
        job.wait()
        self.assertFalse(output.exists())
        journal = output.with_name(output.name + ".progress")
        process = subprocess.Popen([PRECOMPUTE, model, "-o", output, "--jobs", "1"], cwd=self.folder, stderr=subprocess.DEVNULL)
        left = journal.read_text().count("\ncolumns")
        self.wait_for(lambda: journal.read_text().count("\ncolumns") > left, process)
        process.terminate()
        self.assertEqual(process.wait(), 130)
        self.assertRegex(self.own_factors(3, model, "-o", output), r"[1-9]\d* of \d+ columns were kept")
        self.assertEqual(output.read_bytes(), data)


class Distributed(RanksTest):
    """One factor over all ranks, by MUMPS: the numbers of palpate-precompute, whose own factor is CHOLMOD's."""

    def setUp(self):
        super().setUp()
        if not HAS_MUMPS:
            self.skipTest("this build has no MUMPS")

    def bake(self, ranks, model, *arguments):
        output = self.folder / "spread.palpate.hdf"
        result = self.ranks(ranks, model, "-o", output, "--factor", "distributed", "--jobs", "1", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return output

    def check(self, model, *counts, matrices=("greens/packed",)):
        self.straight(model)
        for ranks in counts:
            output = self.bake(ranks, model)
            with h5py.File(self.folder / "straight.palpate.hdf") as one, h5py.File(output) as spread:
                for name in matrices:
                    entries = one[name][:]
                    error = numpy.abs(spread[name][:] - entries).max() / numpy.abs(entries).max()
                    self.assertLess(error, 1e-12, f"{name}, {ranks} ranks")
                one_probes, probes = one["probes/displacements"][:], spread["probes/displacements"][:]
                self.assertLess(numpy.abs(probes - one_probes).max() / numpy.abs(one_probes).max(), 1e-12)
            output.unlink()
            self.assertEqual(sorted(p.name for p in self.folder.glob("spread*")), [])

    def test_cube(self):
        self.check(self.write("model.toml", cube_toml(5)), 1, 2, 4)

    def test_plate(self):
        self.check(MODELS / "plate" / "model.toml", 2, 4)

    def test_held_axes_have_no_columns(self):
        text = cube_toml(3).replace("[storage]", '[[fixed]]\nhalf_space = {point = [1, 0, 0], normal = [1, 0, 0]}\naxes = "xy"\n[storage]')
        self.check(self.write("model.toml", text), 3)

    def test_the_inverse_of_dynamics(self):
        text = cube_toml(3, scope="full") + '[dynamics]\nmethod = "packed"\n'
        self.check(self.write("model.toml", text), 2, matrices=("greens/packed", "dynamics/inverse"))

    def test_modes(self):
        model = self.write("model.toml", cube_toml(4) + '[dynamics]\nmethod = "modal"\nmodes = 30\n')
        self.check(model, 2, matrices=("greens/packed", "dynamics/modes/omega"))
        result = run(PRECOMPUTE, "verify", self.bake(3, model))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_compressed_is_verified(self):
        model = self.write("model.toml", cube_toml(4).replace('precision = "double"\n', 'compression = "h2"\n'))
        result = run(PRECOMPUTE, "verify", self.bake(2, model))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_goes_on_after_a_signal_and_the_reverse(self):
        model = self.write("model.toml", cube_toml(9))
        output = self.folder / "spread.palpate.hdf"
        journal = output.with_name(output.name + ".progress")
        job = subprocess.Popen(self.command(2, model, "-o", output, "--factor", "distributed", "--jobs", "1"), cwd=self.folder,
                               stderr=subprocess.PIPE, text=True)
        self.addCleanup(job.stderr.close)
        for _ in range(4000):  # where the machine has other work, each message of MUMPS waits for a processor
            if job.poll() is not None or (journal.exists() and "\ncolumns" in journal.read_text()):
                break
            time.sleep(0.1)
        self.assertIsNone(job.poll(), "it has ended")
        os.kill(self.pids(job)[-1], signal.SIGTERM)
        self.assertEqual(job.wait(timeout=PATIENCE), 130)
        self.assertIn("interrupted: the columns that are done are kept", job.stderr.read())
        again = run(PRECOMPUTE, model, "-o", output, cwd=self.folder)
        self.assertRegex(again.stderr, r"[1-9]\d* of \d+ columns were kept")
        result = run(PRECOMPUTE, "verify", output)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_memory_of_ranks_is_planned_and_reported(self):
        model = self.write("model.toml", cube_toml(5))
        report = self.folder / "report.json"
        self.bake(2, model, "--report", report)
        numbers = json.loads(report.read_text())
        self.assertEqual(len(numbers["rank_memory_bytes"]), 2)
        factor = numbers["models"][0]["factor_over_ranks"]
        self.assertLessEqual(factor["used_bytes"], factor["expected_bytes"])
        self.assertGreater(factor["used_bytes_of_all"], factor["used_bytes"])
        result = run(RANKS, model, "--dry-run", "--ranks", "4", "--factor", "distributed", cwd=self.folder)
        self.assertRegex(result.stderr, r"factor over 4 ranks by MUMPS: about 0\.\d\d GB of memory in the rank with most, 0\.\d\d GB in all")

    def test_a_body_that_is_not_held(self):
        model = self.write("model.toml", cube_toml(3).replace("[[fixed]]\nhalf_space = { point = [0, 0, 0], normal = [0, 0, -1] }\n",
                                                             "[[fixed]]\nnodes = [0]\n"))
        result = self.ranks(2, model, "--factor", "distributed")
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(result.stderr.count("error: "), 1, result.stderr)


@unittest.skipIf(HAS_MUMPS, "this build has MUMPS")
class WithoutMumps(RanksTest):
    def test_it_says_so(self):
        result = self.ranks(2, self.write("model.toml", cube_toml(2)), "--factor", "distributed")
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertRegex(result.stderr, "error: --factor distributed: this build .* has no MUMPS")
        self.assertEqual(result.stderr.count("error: "), 1, result.stderr)


class Dying(RanksTest):
    def test_a_rank_that_is_killed_costs_its_tiles(self):
        model = self.write("model.toml", cube_toml(16))
        data = self.straight(model)
        output = self.folder / "x.palpate.hdf"
        choose = random.Random(21)
        for attempt in range(KILLS):
            job = self.start(3, model, output, may_end=True)
            time.sleep(choose.uniform(0.0, 0.2))
            victims = self.pids(job)
            if victims:
                os.kill(choose.choice(victims), signal.SIGKILL)
            if job.wait(timeout=PATIENCE) != 0:
                self.assertRegex(job.stderr.read(), "exited on signal 9")
            if output.exists():  # it was at its end
                self.assertEqual(output.read_bytes(), data)
                output.unlink()
        self.own_factors(2, model, "-o", output)
        self.assertEqual(output.read_bytes(), data)
        self.assertEqual(list(self.folder.glob("x.palpate.hdf.*")), [])

    def check_killed_in(self, stage, model):
        """The bytes after a rank was killed as soon as the job told that it is at this stage."""
        data = self.straight(model)
        output = self.folder / "x.palpate.hdf"
        for victim in (0, 1):
            job = subprocess.Popen(self.command(2, model, "-o", output, "--factor", "rank", "--jobs", "1"), cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.addCleanup(job.stderr.close)
            line = ""
            while stage not in line:
                line = job.stderr.readline()
                self.assertNotEqual(line, "", f"it has ended before it told of {stage}")
            os.kill(self.pids(job)[victim], signal.SIGKILL)
            rest = job.stderr.read()
            self.assertNotEqual(job.wait(timeout=PATIENCE), 0, rest)
            self.assertFalse(output.exists())
        self.own_factors(2, model, "-o", output)
        self.assertEqual(output.read_bytes(), data)
        self.assertEqual(list(self.folder.glob("x.palpate.hdf.*")), [])

    def test_a_rank_that_is_killed_among_far_pairs(self):
        self.check_killed_in("far pairs, ", self.write("model.toml", compressed_toml(12)))

    def test_a_rank_that_is_killed_among_overlays(self):
        self.check_killed_in("overlays, ", self.write("model.toml", overlays_toml(8, 0.4)))

    def test_a_job_that_is_killed_at_any_moment(self):
        model = self.write("model.toml", cube_toml(14))
        data = self.straight(model)
        output = self.folder / "x.palpate.hdf"
        for attempt in range(KILLS + 1):
            job = subprocess.Popen(self.command(2, model, "-o", output, "--factor", "rank", "--jobs", "1"), cwd=self.folder,
                                   stderr=subprocess.DEVNULL, start_new_session=True)
            try:
                job.wait(timeout=0.4 + 1.8 * attempt / KILLS)
            except subprocess.TimeoutExpired:
                for pid in self.pids(job):
                    os.kill(pid, signal.SIGKILL)
                job.kill()
                job.wait()
        self.own_factors(2, model, "-o", output)
        self.assertEqual(output.read_bytes(), data)

    def test_a_node_that_cannot_write(self):
        """One rank's file system takes no more: a limit of file size stands for it."""
        model = self.write("model.toml", cube_toml(14))
        data = self.straight(model)
        output = self.folder / "x.palpate.hdf"
        arguments = [RANKS, model, "-o", output, "--factor", "rank", "--jobs", "1"]
        limited = ["sh", "-c", 'trap "" XFSZ; ulimit -f 1; exec "$0" "$@"', *arguments]
        for _ in range(5):
            result = run(*MPIRUN, "-n", "1", *arguments, ":", "-n", "1", *limited, cwd=self.folder)
            if result.returncode != 0:
                break
            self.assertEqual(output.read_bytes(), data)  # on a busy machine all tiles may fall to the other rank, which can write
            output.unlink()
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(result.stderr.count("error: "), 1, result.stderr)
        self.assertRegex(result.stderr, r"error: rank 1 on \S+: .*File too large")
        self.own_factors(2, model, "-o", output)
        self.assertEqual(output.read_bytes(), data)

    def test_a_full_disk(self):
        model = self.write("model.toml", cube_toml(8))
        disk = self.folder / "disk"
        disk.mkdir()
        script = f"mount -t tmpfs -o size=4m none {disk} && exec \"$@\""
        if subprocess.run(["unshare", "-rm", "sh", "-c", f"mount -t tmpfs none {disk}"], check=False, capture_output=True).returncode != 0:
            self.skipTest("no file system can be mounted here")
        result = run("unshare", "-rm", "sh", "-c", script, "sh", *self.command(2, model, "-o", disk / "x.palpate.hdf", "--factor", "rank"),
                     cwd=self.folder)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(result.stderr.count("error: "), 1, result.stderr)
        self.assertRegex(result.stderr, "error: .*(GB|MB|bytes).*free")

    def test_signals_keep_the_columns(self):
        model = self.write("model.toml", cube_toml(16))
        data = self.straight(model)
        output = self.folder / "x.palpate.hdf"
        for stop in (signal.SIGUSR1, signal.SIGTERM):
            job = self.start(2, model, output)
            for pid in self.pids(job):  # as srun does, to every rank
                os.kill(pid, stop)
            self.assertEqual(job.wait(timeout=PATIENCE), 130)
            self.assertIn("interrupted: the columns that are done are kept", job.stderr.read())
        self.assertRegex(self.own_factors(2, model, "-o", output), r"[1-9]\d* of \d+ columns were kept")
        self.assertEqual(output.read_bytes(), data)

    def test_a_signal_to_one_rank_stops_all(self):
        model = self.write("model.toml", cube_toml(16))
        output = self.folder / "x.palpate.hdf"
        job = self.start(3, model, output)
        os.kill(self.pids(job)[-1], signal.SIGTERM)
        self.assertEqual(job.wait(timeout=PATIENCE), 130)
        self.assertTrue(output.with_name("x.palpate.hdf.partial").exists())


class Misfits(RanksTest):
    def refused(self, result, *pieces):
        """One error with its hint, among mpirun's own words, which do not keep to lines."""
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual([result.stderr.count(word) for word in ("error: ", "hint: ")], [1, 1], result.stderr)
        told = result.stderr[result.stderr.index("error: "):]
        for piece in pieces:
            self.assertIn(piece, told)

    def test_what_all_ranks_find_is_told_once(self):
        self.refused(self.ranks(3, self.folder / "none.toml", "--factor", "rank"), "none.toml")
        model = self.write("model.toml", cube_toml(2).replace("0.3", "0.7"))
        self.refused(self.ranks(2, model, "--factor", "rank"), "model.toml")

    def test_another_job_writes_the_same_output(self):
        model = self.write("model.toml", cube_toml(16))
        output = self.folder / "x.palpate.hdf"
        job = self.start(2, model, output)
        pids = self.pids(job)
        for pid in pids:
            os.kill(pid, signal.SIGSTOP)
        self.refused(self.ranks(2, model, "-o", output, "--factor", "rank"), "another palpate-precompute is writing this file")
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
        self.assertEqual(job.wait(), 0)

    def test_a_folder_that_ranks_do_not_share(self):
        model = self.write("model.toml", cube_toml(3))
        for name in ("a", "b"):
            (self.folder / name).mkdir()
        arguments = [RANKS, model, "-o", "x.palpate.hdf", "--factor", "rank"]
        two = [*MPIRUN, "-n", "1", "--wdir", self.folder / "a", *arguments, ":", "-n", "1", "--wdir", self.folder / "b", *arguments]
        self.refused(run(*two, cwd=self.folder), "rank 1 on", "the nodes do not share this folder", "--part K/N")
        (self.folder / "b" / "x.palpate.hdf.partial").write_bytes((self.folder / "a" / "x.palpate.hdf.partial").read_bytes()[:-1])
        self.refused(run(*two, cwd=self.folder), "rank 1 on", "is not the file that another rank has found", "--part K/N")
        (self.folder / "a" / "x.palpate.hdf.progress").unlink()
        self.refused(run(*two, cwd=self.folder), "is not the file that another rank has made")

    def test_ranks_with_different_models(self):
        one, other = self.write("model.toml", cube_toml(3)), self.folder / "other"
        other.mkdir()
        (other / "model.toml").write_text(cube_toml(3).replace("0.3", "0.31"))
        output = self.folder / "x.palpate.hdf"
        rest = ["-o", output, "--factor", "rank"]
        result = run(*MPIRUN, "-n", "1", RANKS, one, *rest, ":", "-n", "1", RANKS, other / "model.toml", *rest, cwd=self.folder)
        self.refused(result, "rank 1 on", "another rank has computed another model")

    def test_usage_is_told_once(self):
        model = self.write("model.toml", cube_toml(2))
        for arguments, piece in (((model, "--ranks", "3"), "--ranks goes with --dry-run"), ((), "MODEL.toml is required"),
                                 ((model, model, "-o", "x"), "there are several"), ((model, "--factor", "some"), "--factor"),
                                 ((model, model, "--factor", "distributed"), "--factor distributed is of one model")):
            result = self.ranks(2, *arguments)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertEqual(result.stderr.count("error: "), 1, result.stderr)
            self.assertIn(piece, result.stderr)

    def test_help_needs_no_ranks(self):
        self.assertIn("--factor auto|rank|distributed", run(RANKS, "--help").stdout)
        self.assertIn("palpate-precompute-mpi 0", run(RANKS, "--version").stdout)


class Plans(RanksTest):
    def test_dry_run_says_what_all_ranks_take(self):
        model = self.write("model.toml", cube_toml(6))
        result = run(RANKS, model, "--dry-run", "--ranks", "16", "--jobs", "4", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"16 ranks of 4 jobs: 0\.\d\d GB of memory each, .* in all; about .* hours of a processor; "
                         r"3 blocks of columns for 64 threads: fewer ranks would do")  # 507 of 192 each
        self.assertEqual([p.name for p in self.folder.iterdir()], ["model.toml"])

    def test_blocks_of_columns_depend_on_the_model_alone(self):
        for cells, columns in ((6, 192), (30, 84)):  # the larger one has work for more threads than blocks of 192
            model = self.write("model.toml", cube_toml(cells))
            for ranks in (1, 64):
                report = self.folder / "report.json"
                result = run(RANKS, model, "--dry-run", "--ranks", ranks, "--jobs", ranks, "--report", report, cwd=self.folder)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(json.loads(report.read_text())["models"][0]["block_columns"], columns)

    def test_many_models(self):
        models = []
        for cells in (2, 9, 3, 4):
            models.append(self.write(f"c{cells}.toml", cube_toml(cells, name=f"c{cells}")))
        straight = {}
        for model in models:
            self.assertEqual(run(PRECOMPUTE, model, cwd=self.folder).returncode, 0)
            file = self.folder / f"{model.stem}.palpate.hdf"
            straight[model.stem] = file.read_bytes()
            file.unlink()
        report = self.folder / "night.json"
        result = self.ranks(2, *models, "--factor", "rank", "--report", report)
        self.assertEqual(result.returncode, 0, result.stderr)
        for name, data in straight.items():
            self.assertEqual((self.folder / f"{name}.palpate.hdf").read_bytes(), data, name)
        bakes = json.loads(report.read_text())["models"]
        self.assertEqual(sorted(pathlib.Path(bake["model"]).stem for bake in bakes), ["c2", "c3", "c4", "c9"])
        self.assertTrue(all(bake["result"] == "done" for bake in bakes))

    def test_a_model_that_fails_does_not_keep_the_others(self):
        good, bad = self.write("good.toml", cube_toml(3, name="good")), self.write("bad.toml", cube_toml(3, name="bad"))
        (self.folder / "bad.palpate.hdf").write_text("somebody's")
        result = self.ranks(2, good, bad, "--factor", "rank")
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("is there already and is not a model of Palpate's", result.stderr)
        self.assertTrue((self.folder / "good.palpate.hdf").exists())


if __name__ == "__main__":
    unittest.main()
