"""Holds the pages of file fields against files that were written: fields_test.py SAMPLE_FOLDER PALPATE_DESCRIBE"""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import h5py

SAMPLES = pathlib.Path(sys.argv.pop(1))
DESCRIBE = sys.argv.pop(1)


def page(name):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([DESCRIBE, folder], check=True, capture_output=True)
        return (pathlib.Path(folder) / name).read_text()


def rows(text):
    """First cell without its marks: the other cells."""
    found = re.findall(r"^\| `([^`]+)` \| (.*) \|$", text, re.MULTILINE)
    return {name: rest.split(" | ") for name, rest in found}


def datasets(file):
    found = {}
    file.visititems(lambda name, item: found.update({"/" + name: item}) if isinstance(item, h5py.Dataset) else None)
    return found


class Fields(unittest.TestCase):
    def check(self, name, files):
        fields = rows(page(name))
        seen = set()
        for path in files:
            with h5py.File(path) as file:
                seen |= set(file.attrs)
                for dataset, item in datasets(file).items():
                    with self.subTest(path=path.name, dataset=dataset):
                        self.assertTrue(dataset in fields, "it has no row")
                        kind, shape = fields[dataset][:2]
                        self.assertIn(str(item.dtype), kind.split(" or "))
                        self.assertEqual(item.ndim, shape.count(", ") + 1)
                        for size, words in zip(item.shape, shape.split(", ")):
                            self.assertTrue(not words.isdigit() or int(words) == size, (shape, item.shape))
                    seen.add(dataset)
        self.assertEqual(set(fields), seen, "each row is of something that some file has")

    def test_models(self):
        self.check("file-fields.md", sorted(SAMPLES.glob("*.palpate.hdf")))


if __name__ == "__main__":
    unittest.main()
