"""debian/: what its files say of the devices, and of files that the packages have."""

import re
import tomllib
import unittest

from programs import SOURCE

DEBIAN = SOURCE / "debian"


class Debian(unittest.TestCase):
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
