"""What the programs and libpalpate.so are linked with: nothing of GPL or AGPL in two of them (README, Licence), from nowhere but the system."""

import re
import subprocess
import unittest

from programs import BINARY, PRECOMPUTE, RUNTIME

LINKED = (RUNTIME, BINARY / "runtime" / "libpalpate.so")
# What they themselves ask the linker for, with the licence of each.
ALLOWED = {
    "libc.so": "LGPL-2.1", "libm.so": "LGPL-2.1", "libstdc++.so": "GPL-3 with runtime exception",
    "libgcc_s.so": "GPL-3 with runtime exception", "ld-linux-x86-64.so": "LGPL-2.1", "libpthread.so": "LGPL-2.1",
    "libxxhash.so": "BSD-2", "libfmt.so": "MIT", "libspdlog.so": "MIT",
    "libtomlplusplus.so": "MIT", "libhidapi-hidraw.so": "BSD-3 (of three licences)", "libudev.so": "LGPL-2.1",
    "libz.so": "zlib",
    "libasan.so": "GPL-3 with runtime exception", "libubsan.so": "GPL-3 with runtime exception",
    "libtsan.so": "GPL-3 with runtime exception",
}
# What must not come in by any road: what is in programs of its own, GPL of palpate-precompute, HDF5, which brings curl, Kerberos and LDAP, and OpenIGTLink.
FORBIDDEN = ("libOpenIGTLink", "libhdf5", "libtet", "libcholmod", "libCGAL", "libumfpack", "libspqr", "libreadline", "libgsl", "libfftw3")


def names(lines):
    return [re.sub(r"(\.so)[.\d]*.*", r"\1", name) for name in lines]


class Links(unittest.TestCase):
    def test_direct_libraries_are_known_and_free_of_gpl(self):
        for file in LINKED:
            listing = subprocess.run(["readelf", "-d", file], capture_output=True, text=True, check=True).stdout
            needed = names(re.findall(r"\(NEEDED\).*\[(.*)\]", listing))
            with self.subTest(file=file.name):
                self.assertEqual([name for name in needed if name not in ALLOWED], [])
                # Devices are the program's: the library is for other people's loops.
                self.assertEqual("libhidapi-hidraw.so" in needed, file == RUNTIME)

    def test_nothing_forbidden_is_loaded(self):
        for file in LINKED:
            listing = subprocess.run(["ldd", file], capture_output=True, text=True, check=True).stdout
            loaded = names(line.split()[0].split("/")[-1] for line in listing.splitlines())
            with self.subTest(file=file.name):
                self.assertIn("libc.so", loaded)
                self.assertEqual([name for name in loaded if name.startswith(FORBIDDEN)], [])

    def test_the_library_needs_the_system_alone(self):
        listing = subprocess.run(["ldd", LINKED[1]], capture_output=True, text=True, check=True).stdout
        loaded = {name for name in names(line.split()[0].split("/")[-1] for line in listing.splitlines()) if "san.so" not in name}
        self.assertEqual(loaded - {"linux-vdso.so", "ld-linux-x86-64.so"}, {"libc.so", "libgcc_s.so", "libm.so", "libstdc++.so"})

    def test_the_library_has_nothing_of_the_viewer(self):
        program, library = (file.read_bytes() for file in LINKED)
        for piece in (b"palpate-session", b"Sec-WebSocket-Version", b"frame-ancestors"):
            with self.subTest(piece=piece):
                self.assertIn(piece, program)
                self.assertNotIn(piece, library)


def built():
    """Every program and shared library of the build."""
    for folder in ("meshes", "formats", "precompute", "runtime", "tests"):
        for file in sorted((BINARY / folder).glob("*")):
            if file.is_file() and not file.is_symlink() and file.suffix in ("", ".so", ".0") and file.open("rb").read(4) == b"\x7fELF":
                yield file


def dynamic(file):
    return subprocess.run(["readelf", "-dW", file], capture_output=True, text=True, check=True).stdout


class Hardening(unittest.TestCase):
    def test_libraries_are_sought_in_absolute_folders_only(self):
        """An empty or relative part of a RUNPATH is the folder that the program is started in: anybody's library would run."""
        files = list(built())
        self.assertLess({RUNTIME, PRECOMPUTE}, set(files))
        for file in files:
            for path in re.findall(r"\((?:RUNPATH|RPATH)\).*\[(.*)\]", dynamic(file)):
                with self.subTest(file=file.name):
                    self.assertEqual([part for part in path.split(":") if not part.startswith("/")], [])

    def test_programs_lie_anywhere_and_what_the_loader_writes_is_locked(self):
        for file in built():
            with self.subTest(file=file.name):
                header = subprocess.run(["readelf", "-hlW", file], capture_output=True, text=True, check=True).stdout
                self.assertRegex(header, r"Type: +DYN")
                self.assertIn("GNU_RELRO", header)
                self.assertRegex(header, r"GNU_STACK .* RW +0x")
                self.assertRegex(dynamic(file), r"BIND_NOW|\(FLAGS_1\).*NOW")

    def test_stacks_and_known_sizes_are_watched(self):
        if re.search(r"^PALPATE_SANITIZE:\w+=.+$", (BINARY / "CMakeCache.txt").read_text(), re.MULTILINE):
            self.skipTest("the sanitizers do that")
        for file in (PRECOMPUTE, *LINKED):
            with self.subTest(file=file.name):
                symbols = subprocess.run(["nm", "-D", "--undefined-only", file], capture_output=True, text=True, check=True).stdout
                self.assertIn("__stack_chk_fail", symbols)
                self.assertRegex(symbols, r"__(mem\w+|str\w+|\w*printf|read|poll|fdelt|recv\w*)_chk")


if __name__ == "__main__":
    unittest.main()
