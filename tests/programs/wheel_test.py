"""The wheels: what scripts/wheel refuses. Small programs stand for ours; the wheels themselves are tried at night (scripts/wheel --try)."""

import ast
import pathlib
import re
import tempfile
import unittest
import zipfile

from programs import SOURCE, done, run

OLD = "int main(void) { return 0; }\n"
# A function of glibc 2.36, which Debian 12 and 13 have.
NEWER = "unsigned arc4random(void); int main(void) { return (int)arc4random(); }\n"
WITH_ZLIB = "const char* zlibVersion(void); int main(void) { return zlibVersion()[0]; }\n"


def newest_by_readelf(file):
    """The second route: objdump is the script's."""
    said = done("readelf", "--version-info", "--wide", file).partition("Version needs section")[2]
    return max(tuple(map(int, version)) for version in re.findall(r"Name: GLIBC_(\d+)\.(\d+)", said))


class Check(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def compiled(self, source, *options):
        program = self.folder / f"program{len(list(self.folder.iterdir()))}"
        done("cc", "-x", "c", "-", "-o", program, *options, input=source)
        return program

    def wheel(self, version, **files):
        """A wheel that claims a version of glibc, with programs by their path from the prefix."""
        wheel = self.folder / f"palpate-0.0.0-py3-none-manylinux_{version[0]}_{version[1]}_x86_64.whl"
        with zipfile.ZipFile(wheel, "w") as archive:
            archive.writestr("palpate/__init__.py", "")
            for name, program in files.items():
                archive.write(program, f"palpate-0.0.0.data/data/{name.replace('__', '/')}")
        return wheel

    def assert_refused(self, wheel, reason, hint):
        result = run(SOURCE / "scripts" / "wheel", "--check", wheel)
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertRegex(result.stderr, f"^error: .*{reason}.*\nhint: .*{hint}")

    def test_the_tag_is_the_oldest_glibc_that_all_files_run_with(self):
        old, newer = self.compiled(OLD), self.compiled(NEWER)
        self.assertGreaterEqual(newest_by_readelf(newer), (2, 36))
        for files in ({"bin__a": old}, {"bin__a": newer}, {"bin__a": old, "bin__b": newer}):
            major, minor = max(map(newest_by_readelf, files.values()))
            said = done(SOURCE / "scripts" / "wheel", "--check", self.wheel((major, minor), **files))
            self.assertIn(f"{len(files)} programs and libraries, from glibc {major}.{minor} on", said)
            self.assert_refused(self.wheel((major, minor - 1), **files), f"needs glibc {major}\\.{minor}", f"manylinux_{major}_{minor}_x86_64")
            self.assert_refused(self.wheel((major, minor + 1), **files), f"needs glibc {major}\\.{minor}", f"manylinux_{major}_{minor}_x86_64")

    def test_a_library_is_of_glibc_or_within(self):
        program = self.compiled(WITH_ZLIB, "-lz")
        needed = re.search(r"\[(libz\.so\.\d+)\]", done("readelf", "--dynamic", program))[1]
        library = re.search(rf"{re.escape(needed)} => (\S+)", done("ldd", program))[1]
        version = max(newest_by_readelf(program), newest_by_readelf(library))
        found = self.compiled(WITH_ZLIB, "-lz", "-Wl,-rpath,$ORIGIN/../lib/palpate")
        self.assert_refused(self.wheel(version, bin__a=program), re.escape(needed), "statically")
        self.assert_refused(self.wheel(version, bin__a=found), re.escape(needed), "statically")  # nothing is there
        self.assert_refused(self.wheel(version, **{"bin__a": program, f"lib__palpate__{needed}": library}), re.escape(needed), "statically")  # not looked for
        done(SOURCE / "scripts" / "wheel", "--check", self.wheel(version, **{"bin__a": found, f"lib__palpate__{needed}": library}))


class Made(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def test_a_folder_without_a_build_is_refused(self):
        result = run(SOURCE / "scripts" / "wheel", "--build", self.folder, "--output", self.folder)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^error: .*libpalpate\.so\.0 is not there\nhint: build ")

    def test_the_package_is_of_the_python_that_it_asks_for(self):
        """Syntax of CPython 3.9, and no module of numpy from 1.20 on; scripts/wheel --try runs it there."""
        for source in sorted((SOURCE / "runtime" / "python" / "palpate").glob("*.py")):
            with self.subTest(source.name):
                ast.parse(source.read_text(), feature_version=(3, 9))
                imports = re.findall(r"^from numpy\.typing", source.read_text(), re.MULTILINE)  # indented ones are for type checkers
                self.assertEqual(imports, [])


if __name__ == "__main__":
    unittest.main()
