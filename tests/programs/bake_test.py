"""palpate-precompute as a person meets it: what it writes, what it refuses, what is left when it is stopped."""

import itertools
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import time
import tomllib
import unittest

from programs import HAS_SANITIZERS, MODELS, PRECOMPUTE, RUNTIME, ProgramTest, cube_toml, done, run


class Bake(ProgramTest):
    def test_same_input_gives_the_same_bytes_with_any_number_of_jobs(self):
        one = self.bake(cube_toml(6), "--jobs", "1", name="one.toml").read_bytes()
        (self.folder / "one.palpate.hdf").unlink()
        two = self.bake(cube_toml(6), "--jobs", "2", name="one.toml").read_bytes()
        self.assertEqual(one, two)

    def test_dry_run_says_the_numbers_and_writes_nothing(self):
        model = self.write("model.toml", cube_toml(6))
        result = run(PRECOMPUTE, model, "--dry-run", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        # 343 nodes, 49 clamped; 218 on the surface, 49 of them clamped; 507 * 508 / 2 * 8 bytes = 1.03 MB.
        for piece in ("343 nodes", "1296 elements", "882 free dofs", "507 stored dofs", "1.0 MB", "about 1 s with"):
            self.assertIn(piece, result.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["model.toml"])

    def test_inspect_and_verify(self):
        file = self.bake(cube_toml(6, scope="layers"))
        inspected = run(PRECOMPUTE, "inspect", file)
        self.assertEqual(inspected.returncode, 0)
        for piece in ("343 nodes (49 held)", "E = 1 Pa", "surface + 1 layer", "double precision", "dihedral", "model.toml"):
            self.assertIn(piece, inspected.stdout)
        verified = run(PRECOMPUTE, "verify", file)
        self.assertEqual(verified.returncode, 0, verified.stdout)
        for check in ("checksums", "probes", "energy", "columns", "rows", "touches", "residual", "rest state"):
            self.assertIn(check, verified.stdout)

    def test_inspect_shows_the_friction_of_each_material(self):
        upper = "[[material]]\nyoungs_modulus = 2\npoissons_ratio = 0.4\nfriction = 0.25\n" \
                "half_space = {point = [0, 0, 0.5], normal = [0, 0, 1]}\n"
        file = self.bake(cube_toml(2).replace("[material]", upper + "[[material]]"))
        inspected = run(PRECOMPUTE, "inspect", file).stdout
        self.assertRegex(inspected, "E = 2 Pa.* friction = 0.25, 24 elements")
        self.assertRegex(inspected, "E = 1 Pa.* friction = 0, 24 elements")

    def test_all_scopes_and_precisions_verify(self):
        for scope in ("surface", "layers", "full"):
            for precision in ("single", "double"):
                file = self.bake(cube_toml(5, scope, precision), name=f"{scope}-{precision}.toml")
                result = run(PRECOMPUTE, "verify", file)
                self.assertEqual(result.returncode, 0, result.stdout)

    def test_more_memory_than_there_is(self):
        model = self.write("model.toml", cube_toml(24))
        result = run(PRECOMPUTE, model, "--jobs", "1024", cwd=self.folder, env=os.environ | {"SLURM_MEM_PER_NODE": "2000"})  # [MB]
        self.assert_refused(result, "GB of memory are needed", "are free", "--jobs")
        self.assertEqual([p.name for p in self.folder.iterdir()], ["model.toml"])

    def test_full_disk(self):
        model = self.write("model.toml", cube_toml(10))

        def limit_file_size():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))

        result = run(PRECOMPUTE, model, cwd=self.folder, preexec_fn=limit_file_size)
        self.assert_refused(result, "palpate.hdf")
        self.assertEqual([p.name for p in self.folder.iterdir()], ["model.toml"])

    def test_usage(self):
        self.assertEqual(run(PRECOMPUTE, cwd=self.folder).returncode, 2)
        self.assertEqual(run(PRECOMPUTE, "--bogus", cwd=self.folder).returncode, 2)
        self.assertEqual(run(PRECOMPUTE, "--help", cwd=self.folder).returncode, 0)
        self.assertIn("palpate-precompute", run(PRECOMPUTE, "--version").stdout)

    def test_missing_model_and_output_folder(self):
        self.assert_refused(run(PRECOMPUTE, self.folder / "none.toml"), "none.toml")
        model = self.write("model.toml", cube_toml(2))
        self.assert_refused(run(PRECOMPUTE, model, "-o", self.folder / "no" / "x.palpate.hdf"), "x.palpate.hdf")


class Dynamics(ProgramTest):
    TABLE = "[dynamics]\ndamping = {ratios = [0.02, 0.02], frequencies = [0.001, 0.01]}\n"

    def test_packed(self):
        text = cube_toml(4, scope="full") + self.TABLE + 'method = "packed"\ntime_step = 0.5\nmass = "lumped"\n'
        file = self.bake(text)
        inspected = run(PRECOMPUTE, "inspect", file).stdout
        self.assertRegex(inspected, r"dynamics +packed: inverse of K_bar, 0\.4 MB; M and C_d of \d+ entries")  # 300 dofs
        self.assertRegex(inspected, r"Newmark +time step 0\.5 s, alpha = 0\.25, delta = 0\.5; lumped mass, damping 0\.000228")
        verified = run(PRECOMPUTE, "verify", file)
        self.assertEqual(verified.returncode, 0, verified.stdout)
        for check in ("mass", "damping", "inverse columns", "inverse rows", "inverse touches"):
            self.assertRegex(verified.stdout, rf"\n{check} +ok ")

    def test_modal(self):
        hex8 = cube_toml(4, scope="layers", element="hex8")
        file = self.bake(hex8 + self.TABLE + "modes = 20\n")
        inspected = run(PRECOMPUTE, "inspect", file).stdout
        # two bending modes of one frequency, sqrt(E / density) / 1 m = 0.032 rad/s
        first, second = re.search(r"dynamics +modal: 20 modes of ([0-9.]+), ([0-9.]+), ", inspected).groups()
        self.assertEqual(first, second)
        self.assertAlmostEqual(float(first), 0.0034, delta=0.0005)
        verified = run(PRECOMPUTE, "verify", file)
        self.assertEqual(verified.returncode, 0, verified.stdout)
        for check in ("modes", "modal mass", "mode count"):
            self.assertRegex(verified.stdout, rf"\n{check} +ok ")

    def test_all_scopes_verify(self):
        for scope in ("surface", "layers", "full"):
            file = self.bake(cube_toml(5, scope, "single") + '[dynamics]\nmethod = "modal"\nmodes = 30\n', name=f"{scope}.toml")
            result = run(PRECOMPUTE, "verify", file)
            self.assertEqual(result.returncode, 0, result.stdout)

    def test_same_input_gives_the_same_bytes_with_any_number_of_jobs(self):
        for method in ("packed", "modal"):
            text = cube_toml(6, scope="full") + f'[dynamics]\nmethod = "{method}"\n'
            one = self.bake(text, "--jobs", "1", name="one.toml").read_bytes()
            (self.folder / "one.palpate.hdf").unlink()
            two = self.bake(text, "--jobs", "2", name="one.toml").read_bytes()
            self.assertEqual(one, two)

    def plan(self, text):
        model = self.write("model.toml", text)
        result = run(PRECOMPUTE, model, "--dry-run", cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stderr

    def test_auto_says_what_it_takes_and_why(self):
        # 882 dofs: 3.1 MB in double, 3210 steps a second at 10 GB/s
        packed = self.plan(cube_toml(6, scope="full") + "[dynamics]\n")
        self.assertRegex(packed, r"dynamics: packed, 3\.1 MB, 0\.\d\d GB of memory \(a step reads the packed inverse of K_bar, 3\.1 MB: "
                         r"3210 steps a second at 10 GB/s, 1000 are asked for\)")
        modal = self.plan(cube_toml(6, scope="full") + "[dynamics]\ntime_step = 0.0003\n")
        self.assertRegex(modal, r"dynamics: modal, 100 modes, 0\.7 MB, .* \(a step reads the packed inverse of K_bar, 3\.1 MB: 3210")
        self.assertRegex(self.plan(cube_toml(6) + "[dynamics]\n"), r"dynamics: modal, 100 modes, 0\.4 MB, .* \(the scope is not full\)")
        self.assertIn("dynamics: modal, 54 modes", self.plan(cube_toml(2) + "[dynamics]\n"))  # all that there are

    def test_more_modes_than_dofs(self):
        model = self.write("model.toml", cube_toml(2) + "[dynamics]\nmodes = 55\n")
        self.assert_refused(run(PRECOMPUTE, model, cwd=self.folder), "model.toml:16:9", "modes is 55", "only 54 free dofs")
        model = self.write("model.toml", cube_toml(12) + "[dynamics]\nmodes = 3000\n")
        self.assert_refused(run(PRECOMPUTE, model, cwd=self.folder), "model.toml:16:9", "more than a third of 6084 free dofs")

    def test_all_modes(self):
        file = self.bake(cube_toml(2) + "[dynamics]\nmodes = 54\n")
        self.assertEqual(run(PRECOMPUTE, "verify", file).returncode, 0)

    def test_memory_for_modes_is_counted(self):
        model = self.write("model.toml", cube_toml(24) + "[dynamics]\nmodes = 3000\n")
        limited = run(PRECOMPUTE, model, "--jobs", "1024", cwd=self.folder, env=os.environ | {"SLURM_MEM_PER_NODE": "2000"})  # [MB]
        self.assert_refused(limited, "GB of memory are needed", "GB for dynamics", "fewer modes")


class Stopped(ProgramTest):
    def start_and_wait_for_columns(self, model, output, matrix=0):
        """A running bake that has written some columns of the matrix but not all, beyond those that an earlier run left."""
        journal = output.with_name(output.name + ".progress")
        left = journal.read_text() if journal.exists() else ""
        process = subprocess.Popen([PRECOMPUTE, model, "-o", output, "--jobs", "1"], stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 120
        while time.monotonic() < deadline and process.poll() is None:
            told = journal.read_text() if journal.exists() else ""
            if told != left and f"\ncolumns {matrix} " in told:
                return process
            time.sleep(0.002)
        self.fail("the run ended before it could be stopped")

    def test_killed_run_is_resumed_and_gives_the_same_file(self):
        model = self.write("model.toml", cube_toml(14))
        output = self.folder / "killed.palpate.hdf"
        process = self.start_and_wait_for_columns(model, output)
        process.kill()
        process.wait()
        self.assertFalse(output.exists())
        result = run(PRECOMPUTE, model, "-o", output)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"[1-9]\d* of \d+ columns were kept")
        straight = self.folder / "straight.palpate.hdf"
        self.assertEqual(run(PRECOMPUTE, model, "-o", straight).returncode, 0)
        self.assertEqual(output.read_bytes(), straight.read_bytes())
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()),
                         ["killed.palpate.hdf", "model.toml", "straight.palpate.hdf"])

    def test_compression_falls_back_and_a_killed_run_of_it_is_resumed(self):
        """A strip 250 times as long as high: pieces of it bend too easily for single precision."""
        model = self.write("model.toml", """name = "strip"
plane = "stress"
[geometry]
rectangle = { size = [0.25, 0.001], cells = [2600, 1] }
[mesh]
element = "quad4"
[material]
youngs_modulus = 1e5
poissons_ratio = 0.3
[[fixed]]
lowest = { axis = "x", percent = 0.1 }
""")
        output = self.folder / "strip.palpate.hdf"
        journal = self.folder / "strip.palpate.hdf.progress"
        with subprocess.Popen([PRECOMPUTE, model, "--jobs", "1"], cwd=self.folder, stderr=subprocess.PIPE, text=True) as process:
            self.assertTrue(any("] Green's functions, " in line for line in process.stderr))  # has fallen back
            self.wait_for(lambda: "\ncolumns 0 " in journal.read_text(), process)
            process.kill()
        resumed = run(PRECOMPUTE, model, cwd=self.folder)
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.assertIn("stores every entry of these Green's functions: as an earlier run has found", resumed.stderr)
        self.assertRegex(resumed.stderr, r"[1-9]\d* of \d+ columns were kept")
        kept = output.read_bytes()
        anew = run(PRECOMPUTE, model, "--force", "--report", "report.json", cwd=self.folder)
        report = json.loads((self.folder / "report.json").read_text())
        [strip] = report["models"]
        self.assertEqual(strip["compression"], "none")
        self.assertIn("not positive definite in single precision", strip["compression_out_of_reach"])
        self.assertIn(strip["compression_out_of_reach"], anew.stderr)
        if not HAS_SANITIZERS:
            self.assertGreater(strip["expected_memory_bytes"], 0.85 * report["peak_memory_bytes"])
        self.assertEqual(output.read_bytes(), kept)

    def test_run_killed_in_the_inverse_of_dynamics_is_resumed(self):
        model = self.write("model.toml", cube_toml(11, scope="full") + '[dynamics]\nmethod = "packed"\n')
        output = self.folder / "killed.palpate.hdf"
        process = self.start_and_wait_for_columns(model, output, matrix=1)
        process.kill()
        process.wait()
        self.assertFalse(output.exists())
        result = run(PRECOMPUTE, model, "-o", output)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("Green's functions: 4752 of 4752 columns were kept", result.stderr)
        self.assertRegex(result.stderr, r"inverse of K_bar: [1-9]\d* of 4752 columns were kept")
        straight = self.folder / "straight.palpate.hdf"
        self.assertEqual(run(PRECOMPUTE, model, "-o", straight).returncode, 0)
        self.assertEqual(output.read_bytes(), straight.read_bytes())

    def test_interrupt_in_the_inverse_of_dynamics_keeps_both_matrices(self):
        model = self.write("model.toml", cube_toml(11, scope="full") + '[dynamics]\nmethod = "packed"\n')
        output = self.folder / "x.palpate.hdf"
        process = self.start_and_wait_for_columns(model, output, matrix=1)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(), 130)
        self.assertFalse(output.exists())
        result = run(PRECOMPUTE, model, "-o", output)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("Green's functions: 4752 of 4752 columns were kept", result.stderr)
        self.assertRegex(result.stderr, r"inverse of K_bar: [1-9]\d* of 4752 columns were kept")

    def test_killed_at_any_moment_again_and_again(self):
        model = self.write("model.toml", cube_toml(12, scope="full"))
        straight, output = self.folder / "straight.palpate.hdf", self.folder / "killed.palpate.hdf"
        start = time.monotonic()
        self.assertEqual(run(PRECOMPUTE, model, "-o", straight).returncode, 0)
        whole = time.monotonic() - start
        for attempt in range(1, 13):
            process = subprocess.Popen([PRECOMPUTE, model, "-o", output], stderr=subprocess.DEVNULL)
            time.sleep(whole * attempt / 12)
            process.kill()
            ended = process.wait() == 0
            if output.exists():  # killed or not: once it has its name, it is whole
                self.assertEqual(output.read_bytes(), straight.read_bytes())
                break
            self.assertFalse(ended)
        self.assertEqual(run(PRECOMPUTE, model, "-o", output).returncode, 0)
        self.assertEqual(output.read_bytes(), straight.read_bytes())
        self.assertEqual(len(list(self.folder.iterdir())), 3)

    def test_interrupt_keeps_what_is_done_and_the_old_file_whole(self):
        old = self.bake(cube_toml(3))
        before = old.read_bytes()
        model = self.write("model.toml", cube_toml(14))
        for stop in (signal.SIGINT, signal.SIGTERM):
            process = self.start_and_wait_for_columns(model, old)
            process.send_signal(stop)
            self.assertEqual(process.wait(), 130)
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()),
                             ["model.palpate.hdf", "model.palpate.hdf.partial", "model.palpate.hdf.progress", "model.toml"])
            self.assertEqual(old.read_bytes(), before)
        straight = self.folder / "straight.palpate.hdf"
        self.assertEqual(run(PRECOMPUTE, model, "-o", straight).returncode, 0)
        result = run(PRECOMPUTE, model, "-o", old)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"[1-9]\d* of \d+ columns were kept")
        self.assertEqual(old.read_bytes(), straight.read_bytes())

    def test_a_second_run_is_refused_at_the_start_and_an_early_end_leaves_nothing(self):
        model = self.write("model.toml", cube_toml(16))
        output = self.folder / "x.palpate.hdf"
        journal = self.folder / "x.palpate.hdf.progress"
        for end in (signal.SIGINT, signal.SIGTERM):
            with subprocess.Popen([PRECOMPUTE, model, "-o", output, "--jobs", "1"], stderr=subprocess.PIPE) as first:
                self.assertIn(b"mesh", first.stderr.readline())  # so the output is claimed
                first.send_signal(signal.SIGSTOP)
                self.assertEqual(journal.read_bytes(), b"", "before the columns")
                if end == signal.SIGINT:
                    second = run(PRECOMPUTE, model, "-o", output)
                    self.assert_refused(second, "another palpate-precompute is writing this file")
                    self.assertNotIn("mesh", second.stderr)
                first.send_signal(end)
                first.send_signal(signal.SIGCONT)
                self.assertEqual(first.wait(), 130)
            self.assertEqual([path.name for path in self.folder.iterdir()], ["model.toml"])

    def test_interrupt_says_how_to_go_on_and_discard_begins_anew(self):
        model = self.write("model.toml", cube_toml(14))
        output = self.folder / "x.palpate.hdf"
        killed = self.start_and_wait_for_columns(model, output)
        killed.kill()
        killed.wait()
        process = subprocess.Popen([PRECOMPUTE, model, "-o", output, "--jobs", "1"], stderr=subprocess.PIPE, text=True)
        for line in process.stderr:
            if "were kept" in line:
                process.send_signal(signal.SIGINT)
                break
        said = process.stderr.read()
        process.stderr.close()
        self.assertEqual(process.wait(), 130, said)
        for piece in ("interrupted", "x.palpate.hdf.partial", "the same command goes on", "--discard"):
            self.assertIn(piece, said)
        result = run(PRECOMPUTE, model, "-o", output, "--discard")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("were kept", result.stderr)
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["model.toml", "x.palpate.hdf"])


class Waiting(ProgramTest):
    """What is seen meanwhile."""

    STAGES = ["generating the mesh", "checking the mesh", "assembling K", "ordering K", "factorising K", "overlays",
              "choosing the precision", "Green's functions", "writing the file"]
    OVERLAY = "[overlay]\n[[overlay.region]]\nsphere = {center = [0.5, 0.5, 1], radius = 0.3}\n"

    def check(self, said):
        # The plan's line of the overlays' figures is no stage.
        at = [re.search(rf"\] {stage}(?!: \d+ patches)", said).start() for stage in self.STAGES]
        self.assertEqual(at, sorted(at))
        # From the first number that follows from the mesh: of all that is to come, and that it is not measured yet.
        self.assertRegex(said, r"\] factorising K, about [1-9]\d* (s|min)")
        for stage in self.STAGES[5:]:
            self.assertRegex(said, rf"\] {stage}(: \d+ %)?, (about )?\d+ (s|min)[^\n]* left")
        self.assertIn("Green's functions: 100 %\n", said)

    def test_each_stage_says_what_is_left_of_the_whole(self):
        model = self.write("model.toml", cube_toml(8, scope="layers").replace('"layers"', '"layers"\nlayers = 2') + self.OVERLAY)
        result = run(PRECOMPUTE, model, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.check(result.stderr)
        self.assertNotIn("\r", result.stderr)

    def test_a_terminal_has_one_line_that_is_rewritten(self):
        model = self.write("model.toml", cube_toml(8, scope="layers").replace('"layers"', '"layers"\nlayers = 2') + self.OVERLAY)
        master, slave = os.openpty()
        with subprocess.Popen([PRECOMPUTE, model], cwd=self.folder, stderr=slave) as process:
            os.close(slave)
            said = b""
            while True:
                try:
                    piece = os.read(master, 1 << 16)
                except OSError:  # the other side is closed
                    break
                if not piece:
                    break
                said += piece
            os.close(master)
            self.assertEqual(process.wait(), 0)
        said = said.decode().replace("\r\n", "\n")
        self.check(said)
        for stage in self.STAGES:
            self.assertRegex(said, rf"\r\x1b\[K\[ *\d+\.\d s\] {stage}")
        # Each rewritten line is closed before another begins.
        self.assertNotRegex(re.sub(r"\r\x1b\[K\[[^\n\r]*", "", said), r"[^\n]\[ ")

    def test_an_error_begins_a_line_of_its_own(self):
        model = self.write("model.toml", cube_toml(8).replace("half_space = { point = [0, 0, 0], normal = [0, 0, -1] }", "nodes = [0]"))
        master, slave = os.openpty()
        with subprocess.Popen([PRECOMPUTE, model], cwd=self.folder, stderr=slave) as process:
            os.close(slave)
            said = b""
            while b"hint" not in said:
                said += os.read(master, 1 << 16)
            os.close(master)
            self.assertEqual(process.wait(), 1)
        self.assertIn(b"\nerror: ", said)


@unittest.skipIf(HAS_SANITIZERS, "they must be loaded first")
class Kernels(ProgramTest):
    """OpenBLAS that takes this processor for one of 2004, until it is told otherwise."""

    def setUp(self):
        super().setUp()
        source = self.write("old.c", '#include <stdlib.h>\nchar* openblas_get_corename(void) { char* asked = getenv("OPENBLAS_CORETYPE"); '
                                     'return asked ? asked : "Prescott"; }\n')
        done("cc", "-shared", "-fPIC", "-o", self.folder / "old.so", source)
        flags = pathlib.Path("/proc/cpuinfo").read_text().split("flags", 1)[1].split("\n", 1)[0].split()
        self.fast = {"avx2", "fma"} <= set(flags)
        self.right = "SkylakeX" if {"avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"} <= set(flags) else "Haswell"
        self.model = self.write("model.toml", cube_toml(3))

    def bake_with(self, asked=None):
        environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_CORETYPE"} | {"LD_PRELOAD": str(self.folder / "old.so")}
        if asked:
            environment["OPENBLAS_CORETYPE"] = asked
        result = run(PRECOMPUTE, self.model, "--report", self.folder / "report.json", cwd=self.folder, env=environment)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads((self.folder / "report.json").read_text()), result.stderr

    def test_the_program_starts_anew_with_the_right_ones(self):
        if not self.fast:
            self.skipTest("the processor is as old")
        report, said = self.bake_with()
        self.assertEqual(report["blas_kernels"], self.right)
        for text in (said, report["blas_note"]):
            self.assertIn("Prescott", text)
            self.assertIn("started anew with OPENBLAS_CORETYPE=" + self.right, text)
        self.assertEqual(said.count("started anew"), 1)

    def test_what_was_asked_for_stays(self):
        if not self.fast:
            self.skipTest("the processor is as old")
        report, said = self.bake_with("Nehalem")
        self.assertEqual(report["blas_kernels"], "Nehalem")
        self.assertIn("Nehalem, which OPENBLAS_CORETYPE asks for", said)
        report, said = self.bake_with("Zen")
        self.assertEqual(report["blas_kernels"], "Zen")
        self.assertNotIn("blas_note", report)
        self.assertNotIn("OPENBLAS", said)


class Stale(ProgramTest):
    def test_changed_model_is_noticed(self):
        file = self.bake(cube_toml(3))
        model = self.folder / "model.toml"
        model.write_text(model.read_text().replace("youngs_modulus = 1.0", "youngs_modulus = 2.0"))
        verified = run(PRECOMPUTE, "verify", file)
        self.assertEqual(verified.returncode, 3)
        self.assertIn("STALE", verified.stdout)
        touch = self.write("touch.csv", "t,x,y,z,grab\n0,0.5,0.5,1,1\n0.01,0.5,0.5,0.9,1\n")
        for arguments in (("probe", file, "--at", "0.5,0.5,1", "--displace", "0,0,1"),
                          ("play", file, "--device", f"script:{touch}", "--fast")):
            answer = run(RUNTIME, *arguments)
            self.assertEqual(answer.returncode, 0, answer.stderr)
            self.assertIn("model.toml", answer.stderr)
            self.assertIn("precompute", answer.stderr)

    def test_changed_mesh_is_noticed(self):
        self.write("tet.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n"
                   "Tetrahedra\n2\n1 2 3 4 1\n2 3 4 5 1\nEnd\n")
        text = cube_toml(1).replace("box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }", 'volume = "tet.mesh"')
        file = self.bake(text)
        self.assertEqual(run(PRECOMPUTE, "verify", file).returncode, 0)
        mesh = self.folder / "tet.mesh"
        mesh.write_text(mesh.read_text().replace("1 1 1 0", "1 1 1.5 0"))
        verified = run(PRECOMPUTE, "verify", file)
        self.assertEqual(verified.returncode, 3)
        self.assertIn("tet.mesh", verified.stdout)

    def test_altered_and_truncated_files_are_refused(self):
        file = self.bake(cube_toml(4))
        good = file.read_bytes()
        middle = bytearray(good)
        middle[len(good) // 2] ^= 0x10
        for bad, piece in ((bytes(middle), "altered"), (good[: len(good) // 2], ""), (b"", ""), (b"hello", "")):
            file.write_bytes(bad)
            self.assert_refused(run(PRECOMPUTE, "verify", file), file.name, piece)
            self.assert_refused(run(RUNTIME, "probe", file, "--node", "1", "--displace", "0,0,1"), file.name, piece)


class RestState(ProgramTest):
    def test_beyond_small_strain_is_told(self):
        """Young's modulus in kPa, where Pa are meant: a body of 1 m sinks by metres."""
        for youngs_modulus, told in (("5.0", True), ("5.0e6", False)):
            text = cube_toml(2).replace("youngs_modulus = 1.0", f"youngs_modulus = {youngs_modulus}") + "[[load]]\ngravity = [0, 0, -9.81]\n"
            model = self.write("weak.toml", text)
            baked = run(PRECOMPUTE, model, "-o", "weak.palpate.hdf", "--force", cwd=self.folder)
            touch = self.write("touch.csv", "t,x,y,z\n0,0.5,0.5,3\n")
            play = run(RUNTIME, "play", "weak.palpate.hdf", "--device", f"script:{touch}", "--fast", cwd=self.folder)
            words = (baked.stderr, play.stderr, *(run(PRECOMPUTE, command, "weak.palpate.hdf", cwd=self.folder).stdout for command in ("inspect", "verify")))
            for said in words:
                self.assertEqual("beyond small strain" in said, told, said)


class BadDescriptions(ProgramTest):
    def refuse(self, text, *pieces):
        model = self.write("model.toml", text)
        result = run(PRECOMPUTE, model, cwd=self.folder)
        self.assert_refused(result, *pieces)
        self.assertEqual(list(self.folder.glob("*.palpate.hdf*")), [])

    def test_unknown_key_names_the_nearest(self):
        self.refuse(cube_toml(2).replace("poissons_ratio", "poisons_ratio"), "poisons_ratio", "poissons_ratio", "model.toml")

    def test_material_out_of_range(self):
        self.refuse(cube_toml(2).replace("youngs_modulus = 1.0", "youngs_modulus = 0"), "youngs_modulus")
        self.refuse(cube_toml(2).replace("poissons_ratio = 0.3", "poissons_ratio = 0.5"), "poissons_ratio")
        self.refuse(cube_toml(2).replace("density = 1000", "density = nan"), "density")

    def test_nothing_fixed(self):
        text = cube_toml(2)
        self.refuse(text[: text.index("[[fixed]]")] + text[text.index("[storage]"):], "fixed")

    def test_empty_selection(self):
        self.refuse(cube_toml(2).replace("point = [0, 0, 0]", "point = [0, 0, -5]"), "fixed")

    def test_rigid_motion_left(self):
        self.refuse(cube_toml(2).replace("half_space = { point = [0, 0, 0], normal = [0, 0, -1] }", "nodes = [0, 1]"), "turn about the axis")

    def test_everything_fixed(self):
        self.refuse(cube_toml(2).replace("normal = [0, 0, -1]", "normal = [0, 0, 1]"), "fixed")

    def test_wrong_scale_is_a_warning_that_stands_out(self):
        model = self.write("model.toml", cube_toml(2).replace("size = [1, 1, 1]", "size = [100, 100, 100]"))
        result = run(PRECOMPUTE, model, cwd=self.folder)
        self.assertEqual(result.returncode, 0)
        # With the plan and as the last word of the run, on a line of its own each time.
        warning = "\n\nwarning: the body is 100 m long: if its numbers are millimetres, write scale = 0.001 under [geometry] (now 1), " \
                  "which makes it 0.1 m\n\n"
        self.assertEqual(result.stderr.count(warning), 2)
        self.assertGreater(result.stderr.rindex(warning), result.stderr.index("palpate.hdf written"))


class Models(ProgramTest):
    @unittest.skipIf(HAS_SANITIZERS, "sanitizers take memory of their own")
    def test_memory_is_as_foretold_with_any_number_of_jobs(self):
        ours = b"x" * 1_000_000_000  # is not the program's
        for form, jobs in itertools.product(("none", "h2"), ("1", "4", "16")):
            self.bake(cube_toml(15).replace('precision = "double"', f'compression = "{form}"'), "--jobs", jobs, "--force", "--report", "report.json")
            report = json.loads((self.folder / "report.json").read_text())
            self.assertAlmostEqual(report["models"][0]["expected_memory_bytes"] / report["peak_memory_bytes"], 1, delta=0.15, msg=f"{form}, {jobs} jobs")
        del ours

    def test_the_nodule_is_made_of_two_materials(self):
        planned = run(PRECOMPUTE, MODELS / "nodule" / "model.toml", "--dry-run", cwd=self.folder)
        self.assertEqual(planned.returncode, 0, planned.stderr)
        self.assertIn("12288 elements (hex8)", planned.stderr)

    def test_the_liver_for_overlays_takes_them(self):
        model = MODELS / "liver_overlay" / "model.toml"
        storage = tomllib.loads(model.read_text())["storage"]
        self.assertEqual((storage["scope"], storage["layers"]), ("layers", 2))  # as many as the overlay has rings
        image = MODELS / "liver" / "liver.inr.gz"
        if not image.exists():
            self.skipTest("scripts/demo fetches the liver's image")
        shutil.copy(image, self.folder)
        text = model.read_text().replace("../liver/liver.inr.gz", "liver.inr.gz")
        coarse = self.write("model.toml", re.sub("edge_length = [0-9.]+", "edge_length = 0.012", text))
        self.assertEqual(run(PRECOMPUTE, coarse, cwd=self.folder).returncode, 0)
        touch = self.write("touch.csv", "t,x,y,z,grab\n0,0.155,0.0,0.117,0\n0.2,0.155,0.03,0.117,0\n")
        played = run(RUNTIME, "play", self.folder / "liver_overlay.palpate.hdf", "--device", f"script:{touch}", "--fast", "--tool",
                     "sphere:0.008", "--overlay", "r=3,rings=2", "--report", self.folder / "report.json")
        self.assertEqual(played.returncode, 0, played.stderr)
        self.assertGreater(json.loads((self.folder / "report.json").read_text())["largest_force_N"], 0.0)

    def test_the_liver_keeps_its_labels(self):
        image = MODELS / "liver" / "liver.inr.gz"
        if not image.exists():
            self.skipTest("scripts/demo fetches the liver's image")
        planned = run(PRECOMPUTE, MODELS / "liver_inclusions" / "model.toml", "--dry-run", cwd=self.folder)
        self.assertEqual(planned.returncode, 0, planned.stderr)
        changes = {int(label): float(change) for label, change in
                   re.findall(r"label (\d+): volume .* \(([-+0-9.]+) %\)", planned.stderr)}
        self.assertEqual(set(changes), {85, 127, 255})
        self.assertLess(max(map(abs, changes.values())), 10.0)  # measured: -6.1 (85, the smallest), -1.1, -0.5
        self.assertIn("label 84", planned.stderr)


if __name__ == "__main__":
    unittest.main()
