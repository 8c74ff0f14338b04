"""Flags and packages that are for us alone: -march=native for our presets, -Werror for tests, GoogleTest for tests."""

import json
import pathlib
import subprocess
import tempfile
import unittest

from programs import SOURCE

OUTSIDE = f"""cmake_minimum_required(VERSION 3.25)
project(outside C CXX)
set(PALPATE_TESTS OFF)
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
        self.configured = subprocess.run(["cmake", *configure, "-G", "Ninja", "-B", build], cwd=SOURCE, capture_output=True, text=True)
        self.assertEqual(self.configured.returncode, 0, self.configured.stderr)
        commands = {pathlib.Path(entry["file"]).name: entry["command"].split()
                    for entry in json.loads((build / "compile_commands.json").read_text())}
        command = commands["c_interface.cpp"]
        self.assertIn("-Wconversion", command)
        return FLAGS & set(command)

    def test_a_project_that_adds_the_tree_gets_neither(self):
        (self.folder / "CMakeLists.txt").write_text(OUTSIDE)
        self.assertEqual(self.flags_of_c_interface("-S", self.folder), set())

    def test_presets_are_for_this_processor_and_those_of_tests_refuse_warnings(self):
        for preset, flags in (("release", {"-march=native"}), ("asan", FLAGS)):
            with self.subTest(preset):
                self.assertEqual(self.flags_of_c_interface("--preset", preset, "-DPALPATE_TESTS=OFF", "-DCMAKE_UNITY_BUILD=OFF"), flags)

    def test_programs_are_built_without_what_tests_need(self):
        self.flags_of_c_interface("--preset", "release", "-DCMAKE_UNITY_BUILD=OFF", "-DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON")
        self.assertIn("Without tests, as these are missing: GTest. scripts/test installs them.", self.configured.stdout)
        self.assertNotIn("step_test.cpp", (self.folder / "build" / "compile_commands.json").read_text())

    def test_what_the_demo_goes_without_is_built_once_it_is_there(self):
        for missing in ("ON", "OFF"):
            self.flags_of_c_interface("--preset", "release", "-DPALPATE_TESTS=OFF", "-DCMAKE_UNITY_BUILD=OFF", f"-DCMAKE_DISABLE_FIND_PACKAGE_MPI={missing}")
            self.assertEqual("rank_commands.cpp" in (self.folder / "build" / "compile_commands.json").read_text(), missing == "OFF")


if __name__ == "__main__":
    unittest.main()
