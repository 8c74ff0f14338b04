"""-Werror and -march=native are for our presets: a project that adds this source tree to its own gets neither."""

import json
import pathlib
import subprocess
import tempfile
import unittest

from programs import SOURCE

OUTSIDE = f"""cmake_minimum_required(VERSION 3.25)
project(outside C CXX)
set(PALPATE_TESTS OFF)
set(PALPATE_WEB OFF)
add_subdirectory("{SOURCE}" palpate)
"""
FLAGS = {"-Werror", "-march=native"}


class BuildFlags(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def flags_of_c_interface(self, *configure):
        """Those of FLAGS with which c_interface.cpp is compiled; configures only."""
        build = self.folder / "build"
        result = subprocess.run(["cmake", *configure, "-G", "Ninja", "-B", build], cwd=SOURCE, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        commands = {pathlib.Path(entry["file"]).name: entry["command"].split()
                    for entry in json.loads((build / "compile_commands.json").read_text())}
        command = commands["c_interface.cpp"]
        self.assertIn("-Wconversion", command)
        return FLAGS & set(command)

    def test_a_project_that_adds_the_tree_gets_neither(self):
        (self.folder / "CMakeLists.txt").write_text(OUTSIDE)
        self.assertEqual(self.flags_of_c_interface("-S", self.folder), set())

    def test_our_presets_have_both(self):
        for preset in ("release", "asan"):
            with self.subTest(preset):
                self.assertEqual(self.flags_of_c_interface("--preset", preset, "-DPALPATE_TESTS=OFF", "-DPALPATE_WEB=OFF", "-DCMAKE_UNITY_BUILD=OFF"), FLAGS)


if __name__ == "__main__":
    unittest.main()
