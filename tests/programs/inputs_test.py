"""Files that people give to palpate-precompute: what is no file, surfaces that remeshing spoils, sizes that nobody wants."""

import os
import pathlib
import re
import tarfile
import unittest

from programs import PRECOMPUTE, SOURCE, ProgramTest, run

BODY = '[material]\nyoungs_modulus = 5e3\npoissons_ratio = 0.4\n[[fixed]]\nlowest = {axis = "y", percent = 10}\n'
CGAL_DATA = pathlib.Path("/usr/share/doc/libcgal-dev/data.tar.gz")  # of Debian's libcgal-demo


class Irregular(ProgramTest):
    """FIFOs, devices and folders where a file should be: refused at once with what they are."""

    def refuse(self, model, *pieces):
        self.assert_refused(run(PRECOMPUTE, model, cwd=self.folder), *pieces)

    def test_a_fifo_as_description(self):
        os.mkfifo(self.folder / "model.toml")
        self.refuse("model.toml", "model.toml", "FIFO")

    def test_a_device_or_folder_as_description(self):
        self.refuse("/dev/zero", "/dev/zero", "a device")
        self.refuse(".", "a folder")

    def test_a_fifo_as_geometry(self):
        for kind, name in (("surface", "a.off"), ("surface", "a.ply"), ("image", "a.inr"), ("image", "a.inr.gz"), ("image", "a.nii"), ("image", "a.nrrd"), ("volume", "a.msh"), ("volume", "a.vtk"),
                           ("volume", "a.node"), ("picture", "a.png")):
            os.mkfifo(self.folder / name)
            mesh = "[mesh]\nedge_length = 1\n" if kind in ("image", "picture") else ""
            plane = 'plane = "stress"\n' if kind == "picture" else ""
            self.write("model.toml", f'name = "a"\n{plane}[geometry]\n{kind} = "{name}"\n{mesh}{BODY}')
            self.refuse("model.toml", name, "FIFO")
            (self.folder / name).unlink()


class Surfaces(ProgramTest):
    OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 0\n"

    def plan(self, name, text, mesh, scale="1", head=""):
        self.write("model.toml", f'name = "a"\n[geometry]\nsurface = "{name}"\nscale = {scale}\n[mesh]\n{mesh}{BODY}{head}')
        if text is not None:
            self.write(name, text)
        return run(PRECOMPUTE, "model.toml", "--dry-run", "--jobs", "1", cwd=self.folder)

    def test_a_corner_that_is_no_point_is_refused(self):
        self.assert_refused(self.plan("a.obj", self.OBJ, ""), "a.obj:8", "the corner 0", "4 points")

    def test_remeshing_that_spoils_the_surface_falls_back_to_cgal(self):
        if not CGAL_DATA.exists():
            self.skipTest("Debian's libcgal-demo is not installed")
        with tarfile.open(CGAL_DATA) as archive:
            (self.folder / "elephant.off").write_bytes(archive.extractfile("data/meshes/elephant.off").read())
        mesh = "edge_length = 0.08\nremesh = true\n"
        planned = self.plan("elephant.off", None, mesh)
        self.assertEqual(planned.returncode, 0, planned.stderr)
        self.assertRegex(planned.stderr, r"note: remeshed to edge_length, the surface intersects itself: \d+ pair\(s\)")
        self.assertIn('mesher = "cgal"', planned.stderr)
        by_cgal = self.plan("elephant.off", None, 'edge_length = 0.08\nmesher = "cgal"\n')
        nodes = r"(\d+) nodes, (\d+) elements"
        self.assertEqual(re.search(nodes, planned.stderr).groups(), re.search(nodes, by_cgal.stderr).groups())
        # who names TetGen is not given another mesher
        self.assert_refused(self.plan("elephant.off", None, mesh + 'mesher = "tetgen"\n'), "intersects itself", 'mesher = "cgal"')

    def test_edge_length_without_remesh_is_told_to_leave_the_boundary(self):
        cube = "OFF\n8 6 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n0 0 2\n2 0 2\n2 2 2\n0 2 2\n" \
               "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n"
        note = "note: the boundary keeps the file's triangles"
        self.assertIn(note, self.plan("a.off", cube, "edge_length = 0.5\n").stderr)
        remeshed = self.plan("a.off", cube, "edge_length = 0.5\nremesh = true\n")
        self.assertEqual(remeshed.returncode, 0, remeshed.stderr)
        self.assertNotIn(note, remeshed.stderr)

    def test_a_huge_file_comes_with_advice(self):
        self.write("model.toml", 'name = "a"\n[geometry]\nbox = {size = [1, 1, 1], cells = [50, 50, 50]}\n' + BODY + '[storage]\nscope = "layers"\ncompression = "none"\n')
        planned = run(PRECOMPUTE, "model.toml", "--dry-run", "--jobs", "1", cwd=self.folder)
        self.assertRegex(planned.stderr, r"note: Green's functions of \d+\.\d GB")
        self.assertIn("leave out precision and compression in [storage], or use a coarser mesh, or scope = \"surface\" in [storage]", planned.stderr)

    def test_elements_that_lock_are_told(self):
        def plan(element, nu):
            self.write("model.toml", 'name = "a"\n[geometry]\nbox = {size = [1, 1, 1], cells = [2, 2, 2]}\n'
                                     f'[mesh]\nelement = "{element}"\n{BODY.replace("ratio = 0.4", f"ratio = {nu}")}')
            planned = run(PRECOMPUTE, "model.toml", "--dry-run", "--jobs", "1", cwd=self.folder)
            self.assertEqual(planned.returncode, 0, planned.stderr)
            return planned.stderr
        self.assertIn("note: tet4 at Poisson's ratio 0.45 is too stiff to a touch, by up to 38 % at 0.45", plan("tet4", 0.45))
        for element, nu in (("tet4", 0.4), ("tet10", 0.45), ("hex8", 0.45)):
            self.assertNotIn("too stiff", plan(element, nu))

    def test_many_nodes_are_compressed(self):
        self.write("model.toml", 'name = "a"\n[geometry]\nbox = {size = [1, 1, 1], cells = [36, 36, 36]}\n' + BODY + '[storage]\nscope = "surface"\n')
        planned = run(PRECOMPUTE, "model.toml", "--dry-run", "--jobs", "1", cwd=self.folder)
        self.assertEqual(planned.returncode, 0, planned.stderr)
        self.assertRegex(planned.stderr, r"about \d+\.\d MB compressed, \d+\.\d MB if they were not; tolerance 0.005")


class Fuzzed(ProgramTest):
    """The first of the files of scripts/fuzz-programs: the same ones every time."""

    def test_surfaces_images_and_descriptions(self):
        result = run(SOURCE / "scripts" / "fuzz-programs", "--kinds", "obj,ply,off,stl,inr,nii,nrrd,toml", "--runs", "60", "--no-memory-limit")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    unittest.main()
