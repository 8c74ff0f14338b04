"""debian/: what its files say of the devices, and of files that the packages have."""

import re
import tomllib
import unittest

from programs import SOURCE

DEBIAN = SOURCE / "debian"


class Debian(unittest.TestCase):
    def test_builds_with_what_the_scripts_install(self):
        control = re.search(r"^Build-Depends:(.*?)^\S", (DEBIAN / "control").read_text(), re.M | re.S)[1]
        asked = set(re.findall(r"[a-z][\w+.-]+", re.sub(r"\(.*?\)", "", control))) - {"debhelper-compat", "dh-python"}
        parts = dict(re.findall(r"^\[(\w+)\]\n([^\[]*)", (SOURCE / "scripts/packages.txt").read_text(), re.M))
        installed = {name for part in ("build", "cluster") for name in parts[part].split()} - {"ccache", "g++", "git"}
        self.assertEqual(asked, installed | {"libcgal-demo"})

    def test_the_demo_installs_neither_plots_nor_ranks(self):
        demo = re.search("^install_packages (.*)$", (SOURCE / "scripts/demo").read_text(), re.M)[1]
        self.assertEqual(demo.split(), ["build", "demo"])
        everything = re.search("install_packages (.* tests .*)$", (SOURCE / "scripts/test").read_text(), re.M)[1]
        self.assertLessEqual({"build", "demo", "cluster", "plots"}, set(everything.split()))

    def test_udev_knows_the_vendors_of_the_built_in_profiles(self):
        rules = (DEBIAN / "palpate-runtime.udev").read_text()
        known = 0
        for file in (SOURCE / "runtime/devices/hid/profiles").glob("*.toml"):
            for match in tomllib.loads(file.read_text())["match"]:
                if "vendor" not in match:
                    continue
                line = next((line for line in rules.splitlines() if f'ATTRS{{idVendor}}=="{match["vendor"]:04x}"' in line), "")
                self.assertIn('TAG+="uaccess"', line, f"{file.name}: {match}")
                if "product" in match:
                    self.assertIn(f"{match['product']:04x}", line, f"{file.name}: {match}")
                known += 1
        self.assertGreater(known, 3)

    def test_no_rule_opens_all_devices_of_a_maker_of_keyboards(self):
        for line in (DEBIAN / "palpate-runtime.udev").read_text().splitlines():
            if '"046d"' in line:
                self.assertIn("idProduct", line)

    def test_the_menu_opens_what_is_installed(self):
        command = re.search("^Exec=(.*)$", (DEBIAN / "palpate-runtime.desktop").read_text(), re.M)[1].split()
        self.assertEqual(command[:2], ["palpate-runtime", "push"])
        folder, name = command[2].rsplit("/", 1)
        installed = next(line for line in (DEBIAN / "rules").read_text().splitlines() if name in line and "install -D" in line)
        self.assertIn(f"debian/tmp{folder} ", installed)


if __name__ == "__main__":
    unittest.main()
