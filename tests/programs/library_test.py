"""libpalpate.so in somebody else's program: installed, found by CMake and by pkg-config, and felt."""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import h5py

from programs import BINARY, PRECOMPUTE, SOURCE, cube_toml, done, run

HEADER_FUNCTIONS = set(re.findall(r"\b(palpate_\w+)\(", (SOURCE / "runtime" / "library" / "palpate.h").read_text()))
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
LINE = re.compile(r"\s*(\d+) ms  at (\S+) (\S+) (\S+) m  force +(\S+) +(\S+) +(\S+) N"
                  r"  stiffness along z +(\S+) N/m((?:  \w+)*)$")
FIND_PACKAGE = f"""cmake_minimum_required(VERSION 3.16)
project(own_loop C)
set(CMAKE_C_STANDARD 11)
find_package(palpate 0.1 REQUIRED)
add_executable(own_loop own_loop.c)
target_compile_options(own_loop PRIVATE {" ".join(WARNINGS)})
target_link_libraries(own_loop PRIVATE palpate::palpate)
"""


def sanitizers():
    """What the library was built with, and so its users must be."""
    cache = (BINARY / "CMakeCache.txt").read_text()
    names = re.search(r"^PALPATE_SANITIZE:\w+=(.*)$", cache, re.MULTILINE).group(1)
    return [f"-fsanitize={names}"] if names else []


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        cls.prefix = cls.folder / "installed"
        done("cmake", "--install", BINARY, "--prefix", cls.prefix)
        shutil.copy(SOURCE / "runtime" / "library" / "example" / "own_loop.c", cls.folder)
        model = cls.folder / "cube4.toml"
        model.write_text(cube_toml(4))
        cls.cube = cls.folder / "cube4.palpate.hdf"
        done(PRECOMPUTE, model, "-o", cls.cube)

    def pkg_config(self, *arguments):
        pc = next(self.prefix.glob("lib*/**/palpate.pc"))
        return done("pkg-config", *arguments, "palpate",
                    env={**os.environ, "PKG_CONFIG_PATH": str(pc.parent)}).split()

    def build_by_pkg_config(self):
        program = self.folder / "own_loop"
        flags = self.pkg_config("--cflags", "--libs")
        libdir = next(flag[2:] for flag in flags if flag.startswith("-L"))
        done("cc", "-std=c11", *WARNINGS, *sanitizers(), self.folder / "own_loop.c", *flags,
             f"-Wl,-rpath,{libdir}", "-o", program)
        return program

    def compliance(self, x):
        """Along z, of the cube's top at (x, 0.5) on the edge from its middle, and of the coupling in series [m/N]."""
        with h5py.File(self.cube) as file:
            nodes = file["/mesh/nodes"][:].tolist()
            stored = file["/dofs/stored_nodes"][:].tolist()
            packed = file["/greens/packed"][:]

        def xi(*places):
            column, row = sorted(3 * stored.index(nodes.index([place, 0.5, 1.0])) + 2 for place in places)
            order = 3 * len(stored)
            return packed[column * order - column * (column - 1) // 2 + row - column]

        w = (x - 0.5) / 0.25
        return (1 - w) ** 2 * xi(0.5, 0.5) + 2 * w * (1 - w) * xi(0.5, 0.75) + w**2 * xi(0.75, 0.75) + 1 / 2000

    def check_feel(self, program):
        lines = done(program, self.cube).splitlines()
        matches = [LINE.match(line) for line in lines]
        self.assertNotIn(None, matches, lines)
        self.assertEqual([match.group(1) for match in matches], [str(200 * k) for k in range(1, 11)])
        self.assertEqual([match.group(9) for match in matches], [""] * 10, "no status bits")
        rows = [[float(number) for number in match.groups()[1:8]] for match in matches]
        for x, _, z, side, _, up, stiffness in rows:
            depth = 1.0 + 0.005 - z
            self.assertAlmostEqual(depth, 0.003, delta=1.1e-4)
            self.assertAlmostEqual(up * self.compliance(x) / depth, 1.0, delta=0.005)
            self.assertAlmostEqual(stiffness * self.compliance(x), 1.0, delta=0.01)
            self.assertLess(abs(side), 0.02 * up, "frictionless")
        self.assertGreater(max(row[0] for row in rows) - min(row[0] for row in rows), 0.001, "it is rubbed")
        self.assertLess(max(row[0] for row in rows), 0.5 + 0.0032)

    def test_found_by_cmake(self):
        project = self.folder / "project"
        project.mkdir()
        shutil.copy(self.folder / "own_loop.c", project)
        (project / "CMakeLists.txt").write_text(FIND_PACKAGE)
        done("cmake", "-G", "Ninja", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}",
             f"-DCMAKE_C_FLAGS={' '.join(sanitizers())}")
        done("cmake", "--build", project / "build")
        self.check_feel(project / "build" / "own_loop")

    def test_the_example_stays_on_what_is_round(self):
        ball = self.folder / "sphere.palpate.hdf"
        done(PRECOMPUTE, SOURCE / "meshes" / "models" / "sphere" / "model.toml", "-o", ball)
        forces = [float(LINE.match(line).group(7)) for line in done(self.build_by_pkg_config(), ball).splitlines()]
        self.assertEqual(len(forces), 10)
        self.assertGreater(min(forces), 0.5 * max(forces))

    def test_another_minor_version_is_not_found(self):
        project = self.folder / "other"
        project.mkdir()
        shutil.copy(self.folder / "own_loop.c", project)
        (project / "CMakeLists.txt").write_text(FIND_PACKAGE.replace("palpate 0.1", "palpate 0.2"))
        result = run("cmake", "-G", "Ninja", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("palpate", result.stderr)

    def test_found_by_pkg_config(self):
        self.check_feel(self.build_by_pkg_config())

    def test_says_why_a_file_cannot_be_felt(self):
        result = run(self.build_by_pkg_config(), "missing.palpate.hdf", cwd=self.folder)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^error: missing\.palpate\.hdf: .+\nhint: .+\n$")

    def test_licence_models_examples_and_plot_are_installed(self):
        share = self.prefix / "share"
        documents = share / "doc" / "palpate"
        self.assertEqual((documents / "LICENSE").read_text(), (SOURCE / "LICENSE").read_text())
        for page in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "runtime/devices/README.md"):
            for link in re.findall(r"\]\((?!http)([^)#]+)(?:#[^)]*)?\)", (documents / page).read_text()):
                self.assertTrue((documents / page).parent.joinpath(link).exists(), f"{page}: {link}")
        pictures = [picture.name for picture in documents.rglob("*") if picture.suffix in (".png", ".webp")]
        self.assertEqual(len(pictures), len(set(pictures)), "no picture is there twice")
        models = share / "palpate" / "models"
        self.assertEqual({model.parent.name for model in models.glob("*/model.toml")},
                         {model.parent.name for model in (SOURCE / "meshes" / "models").glob("*/model.toml")})
        self.assertEqual(list(models.glob("*/*.gz")), [], "the liver's image is not ours to give")
        done(next(self.prefix.glob("bin*/palpate-precompute")), models / "cube" / "model.toml", "-o", self.folder / "cube.palpate.hdf")
        examples = share / "palpate" / "examples"
        for example in ("own_loop.c", "bridge.c"):
            done("cc", "-std=c11", *WARNINGS, "-fsyntax-only", *self.pkg_config("--cflags"), examples / example)
        self.assertIn("plot force", done(share / "palpate" / "scripts" / "plot", "--help"))

    def test_header_is_c99_and_cpp(self):
        (self.folder / "header.c").write_text("#include <palpate.h>\n")
        header = [*WARNINGS, "-fsyntax-only", *self.pkg_config("--cflags"), self.folder / "header.c"]
        done("cc", "-std=c99", *header)
        done("c++", "-xc++", "-std=c++11", *header)

    def test_shows_the_functions_of_its_header_only(self):
        library = next(self.prefix.glob("lib*/**/libpalpate.so"))
        table = done("nm", "--dynamic", "--defined-only", "--format=posix", library)
        self.assertEqual({line.split()[0] for line in table.splitlines()}, HEADER_FUNCTIONS)
        self.assertRegex(done("readelf", "-d", library), r"\(SONAME\).*\[libpalpate\.so\.0\]")


if __name__ == "__main__":
    unittest.main()
