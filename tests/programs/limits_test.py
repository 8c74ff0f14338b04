"""Small machines and large wishes: what does not fit is refused before it is begun, and nothing hangs for want of memory or threads."""

import gzip
import os
import re
import resource
import struct
import sys
import unittest
import zlib

from programs import HAS_SANITIZERS, PRECOMPUTE, RUNTIME, ProgramTest, cube_toml, run

BODY = '[material]\nyoungs_modulus = 5e3\npoissons_ratio = 0.4\n[[fixed]]\nlowest = {axis = "y", percent = 10}\n'
LITTLE = 200_000_000  # byte: far less than what is refused would take


def limited(kind, value):
    """What a child does before it becomes the program."""
    return lambda: resource.setrlimit(kind, (value, value))


def nifti(side, voxels):
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, side, side, side, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 2, 8)
    struct.pack_into("<8f", head, 76, 1, 1, 1, 1, 0, 0, 0, 0)
    struct.pack_into("<f", head, 108, 352)
    head[344:348] = b"n+1\0"
    return gzip.compress(bytes(head) + voxels, 1)


def nrrd(side, voxels):
    return f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {side} {side} {side}\nencoding: gzip\n\n".encode() + gzip.compress(voxels, 1)


def inr(side, voxels):
    head = (f"#INRIMAGE-4#{{\nXDIM={side}\nYDIM={side}\nZDIM={side}\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\nSCALE=2**0\nCPU=decm\n"
            "VX=1\nVY=1\nVZ=1\n").encode()
    return gzip.compress(head.ljust(252, b"\n") + b"##}\n" + voxels, 1)


def png(side, line):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    rows = zlib.compress((b"\0" + line) * side, 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", side, side, 1, 0, 0, 0, 0)) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


class Room(ProgramTest):
    """Refused before memory is taken: in little memory, and without work."""

    def plan(self, geometry, mesh="", head="", memory=None):
        """A dry run, and the most memory that it or a child of it had [byte]."""
        self.write("model.toml", f'name = "a"\n{head}[geometry]\n{geometry}\n{mesh}{BODY}')
        measure = ("import resource, subprocess, sys; r = subprocess.run(sys.argv[1:]); "
                   "u = resource.getrusage(resource.RUSAGE_CHILDREN); print(u.ru_maxrss * 1024, u.ru_utime + u.ru_stime); sys.exit(r.returncode)")
        result = run(sys.executable, "-c", measure, PRECOMPUTE, "model.toml", "--dry-run", "--jobs", "1", cwd=self.folder,
                     env={**os.environ, **({} if memory is None else {"SLURM_MEM_PER_NODE": str(memory)})})
        largest, processor = map(float, result.stdout.split()[-2:])
        return result, largest, processor

    def assert_refused_early(self, planned, *pieces):
        result, largest, processor = planned
        self.assert_refused(result, *pieces)
        if not HAS_SANITIZERS:
            self.assertLess(largest, LITTLE)
            self.assertLess(processor, 5.0)

    def test_generated_bodies(self):
        for geometry in ("box = {size = [1, 1, 1], cells = [700, 700, 700]}", "sphere = {radius = 1, cells_across = 700}",
                         "cylinder = {radius = 1, height = 1, cells_across = 700, cells_along = 700}"):
            self.assert_refused_early(self.plan(geometry, memory=10_000), "2e+09 elements", "GB are free", "fewer cells")
        for element, elements in (("tet10", "2e+09"), ("hex8", "3e+08")):
            self.assert_refused_early(self.plan("box = {size = [1, 1, 1], cells = [700, 700, 700]}", f'[mesh]\nelement = "{element}"\n', memory=10_000),
                                      elements + " elements", "GB are free")
        self.assert_refused_early(self.plan("rectangle = {size = [1, 1], cells = [18000, 18000]}", head='plane = "strain"\n', memory=10_000),
                                  "3e+08 elements", "GB are free")

    def test_drawings_that_would_be_meshed_in_vain(self):
        square = "polygon = {points = [[0, 0], [1, 0], [1, 1], [0, 1]]}"
        for edge in ("1e-3", "1e-5", "1e-9", "1e-300"):
            planned = self.plan(square + "\nscale = 1", f"[mesh]\nedge_length = {edge}\ngrading = 0\n", head='plane = "stress"\nthickness = 0.1\n', memory=300)
            if edge != "1e-3":
                self.assert_refused_early(planned, "more than 2 million nodes" if edge != "1e-5" else "more than 2 million", "larger edge_length")
            else:
                self.assert_refused_early(planned, "elements takes some", "GB are free")

    def test_images_that_are_blank(self):
        for name, pack in (("a.nii.gz", nifti), ("a.nrrd", nrrd), ("a.inr.gz", inr)):
            (self.folder / name).write_bytes(pack(400, bytes(400**3)))
            self.assert_refused_early(self.plan(f'image = "{name}"', "[mesh]\nedge_length = 10\n"), name, "all its voxels are 0")

    def test_images_for_which_there_is_no_memory(self):
        voxels = bytes(400 * 400) + bytes([1]) * (400 * 400) + bytes(398 * 400 * 400)
        for name, pack in (("a.nii.gz", nifti), ("a.nrrd", nrrd), ("a.inr.gz", inr)):
            (self.folder / name).write_bytes(pack(400, voxels))
            self.assert_refused_early(self.plan(f'image = "{name}"', "[mesh]\nedge_length = 10\n", memory=1000), name, "400", "1.34 GB of memory", "GB are free", "Crop")

    def test_pictures(self):
        head, mesh = 'plane = "stress"\nthickness = 0.01\n', "[mesh]\nedge_length = 100\n"
        (self.folder / "black.png").write_bytes(png(9000, bytes(1125)))
        self.assert_refused_early(self.plan('picture = "black.png"\nscale = 1', mesh, head), "the picture has no body")
        (self.folder / "half.png").write_bytes(png(9000, bytes(500) + bytes([255]) * 200 + bytes(425)))
        self.assert_refused_early(self.plan('picture = "half.png"\nscale = 1', mesh, head, memory=1000), "9000 x 9000 pixels", "1.3 GB", "Scale it down")


class Starved(ProgramTest):
    """Limits on address space and threads: a run ends well, or in one clear line."""

    LINES = re.compile(r"error: .*\nhint: .*")

    def assert_right_or_clear(self, result, right):
        if result.returncode == 0:
            self.assertTrue(right(), result.stderr)
            return True
        if "error while loading shared libraries" in result.stderr:  # the loader's, before the program begins
            return False
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertEqual([line.split(":")[0] for line in result.stderr.splitlines() if line.startswith(("error: ", "hint: "))], ["error", "hint"], result.stderr)
        self.assertNotIn("defect", result.stderr)
        return False

    @unittest.skipIf(HAS_SANITIZERS, "sanitizers take all address space")
    def test_precompute_in_little_address_space(self):
        model, output = self.write("model.toml", cube_toml(6)), self.folder / "model.palpate.hdf"
        done = []
        for megabytes in (50, 75, 100, 125, 150, 175, 200, 250, 300, 350, 400, 450, 500, 600, 700, 900, 1200, 2000, 4000):
            for jobs in ((), ("--jobs", "2")):
                output.unlink(missing_ok=True)
                result = run(PRECOMPUTE, model, "-o", output, *jobs, preexec_fn=limited(resource.RLIMIT_AS, megabytes << 20))
                with self.subTest(megabytes=megabytes, jobs=jobs):
                    done.append(self.assert_right_or_clear(result, output.exists))
        self.assertIn(True, done)
        self.assertIn(False, done)

    @unittest.skipIf(HAS_SANITIZERS, "sanitizers take all address space")
    def test_runtime_in_little_address_space(self):
        file, script = self.bake(cube_toml(4)), self.write("s.csv", "t,x,y,z\n0,0.5,0.5,1.1\n0.2,0.5,0.5,0.95\n")
        for body in ((), ("--solver", "corotational")):
            done = []
            for megabytes in (30, 40, *range(50, 100, 2), 100, 125, 150, 200, 300, 400, 600, 900, 2000):
                result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--fast", "--report", "-", *body,
                             preexec_fn=limited(resource.RLIMIT_AS, megabytes << 20))
                with self.subTest(megabytes=megabytes, body=body):
                    done.append(self.assert_right_or_clear(result, lambda said=result.stdout: '"ticks"' in said))
            self.assertIn(True, done)

    def test_stacks_of_openmp(self):
        model = self.write("model.toml", cube_toml(3))
        for size in ("16", "16B", "20k", " 17 K ", "1"):
            result = run(PRECOMPUTE, model, "--dry-run", env={**os.environ, "OMP_STACKSIZE": size})
            self.assert_refused(result, "OMP_STACKSIZE", "1M")
        for size in ("1M", "4096", "nonsense"):
            self.assertEqual(run(PRECOMPUTE, model, "--dry-run", env={**os.environ, "OMP_STACKSIZE": size}).returncode, 0)


if __name__ == "__main__":
    unittest.main()
