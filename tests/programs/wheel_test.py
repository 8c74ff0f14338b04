"""The wheel: pip installs it into an environment of its own, where the first force needs no path and no compiler."""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

from programs import BINARY, HAS_SANITIZERS, PATIENCE, SOURCE, cube_toml, palpate, run

PUSH = """
import palpate
palpate.bake("cube.toml", "cube.palpate.hdf")
with palpate.Session("cube.palpate.hdf", palpate.Tool(radius=0.1)) as session:
    for tick in range(300):
        felt = session.step((0.5, 0.5, max(1.05, 1.2 - 0.001 * tick)))
palpate.Body("cube.palpate.hdf").close()
print(palpate.__file__)
print(palpate.library.program("palpate-runtime"))
print(*[force.hex() for force in felt.force.tolist()])
"""


def wheel(folder):
    done = run(SOURCE / "scripts" / "wheel", "--build", BINARY, "--output", folder)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return next(folder.glob("palpate-*.whl"))


@unittest.skipIf(HAS_SANITIZERS, "Debian's Python cannot load a library with sanitizers")
class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.wheel = wheel(pathlib.Path(folder.name))

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def test_is_installed_and_felt(self):
        (self.folder / "cube.toml").write_text(cube_toml(4))
        (self.folder / "build" / "wheels").mkdir(parents=True)
        shutil.copy(self.wheel, self.folder / "build" / "wheels")
        recipe = re.search(r"```sh\nscripts/wheel\n(.*?)```", (SOURCE / "docs" / "python.md").read_text(), re.DOTALL)[1]
        bare = {"PATH": "/usr/bin:/bin", "HOME": str(self.folder)}
        subprocess.run(["bash", "-euc", recipe], cwd=self.folder, env={**bare, "PIP_NO_INDEX": "1"}, check=True, timeout=PATIENCE)
        python = self.folder / "venv" / "bin" / "python"
        done = subprocess.run([python, "-c", PUSH], cwd=self.folder, env=bare, capture_output=True, text=True, check=False, timeout=PATIENCE)
        self.assertEqual(done.returncode, 0, done.stderr)
        package, program, force = done.stdout.splitlines()
        self.assertIn(str(self.folder / "venv"), package)
        self.assertEqual(program, str(self.folder / "venv" / "bin" / "palpate-runtime"))
        built = {**bare, "PYTHONPATH": str(SOURCE / "runtime" / "python"), "PATH": f"{BINARY / 'precompute'}:{BINARY / 'runtime'}:/usr/bin:/bin"}
        again = subprocess.run([sys.executable, "-c", PUSH], cwd=self.folder, env=built, capture_output=True, text=True, check=True, timeout=PATIENCE)
        self.assertEqual(force, again.stdout.splitlines()[2])
        self.assertGreater(float.fromhex(force.split()[2]), 0)
        subprocess.run([python, "-m", "pip", "uninstall", "--quiet", "--yes", "palpate"], check=True, timeout=PATIENCE)
        left = [file for file in (self.folder / "venv").rglob("*palpate*")]
        self.assertEqual(left, [])

    def test_says_what_it_needs_and_repeats(self):
        self.assertEqual(wheel(self.folder).read_bytes(), self.wheel.read_bytes())
        with zipfile.ZipFile(self.wheel) as files:
            said = files.read(next(name for name in files.namelist() if name.endswith("METADATA"))).decode()
        needed = re.search(r"apt install (.*)", said)[1].split()
        self.assertIn("libhdf5-103-1", needed)
        self.assertIn("libopenblas0-pthread", needed)
        self.assertEqual(run("dpkg-query", "-W", *needed).returncode, 0)
        self.assertIn(f"Version: {palpate.__version__}\n", said)

    def test_a_folder_without_a_build_is_refused(self):
        done = run(SOURCE / "scripts" / "wheel", "--build", self.folder, "--output", self.folder)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^error: .*libpalpate\.so\.0 is not there\nhint: build ")


if __name__ == "__main__":
    unittest.main()
