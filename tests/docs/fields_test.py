"""Holds docs/reference/file-fields.md against files that were written: fields_test.py SAMPLE_FOLDER"""

import pathlib
import re
import sys
import unittest

import h5py

SAMPLES = pathlib.Path(sys.argv.pop(1))
PAGE = (pathlib.Path(__file__).resolve().parent.parent.parent / "docs" / "reference" / "file-fields.md").read_text()
ROWS = {name: rest.split(" | ") for name, rest in re.findall(r"^\| `([^`]+)` \| (.*) \|$", PAGE, re.MULTILINE)}  # by the first cell


def datasets(file):
    found = {}
    file.visititems(lambda name, item: found.update({"/" + name: item}) if isinstance(item, h5py.Dataset) else None)
    return found


def known_sizes(file):
    """What the letters of the page are in a file: those that stand alone for an extent, by a dataset that has it, and those of the kind of element."""
    known = {"d": int(file.attrs["dimension"]), "k": int(file["mesh/offsets"][1])}
    for name, item in datasets(file).items():
        for size, words in zip(item.shape, ROWS[name][1].split(", ")):
            if re.fullmatch(r"\*[a-zA-Z]\*", words):
                known.setdefault(words.strip("*"), size)
    return known


def value(words, known):
    """An extent of the page in numbers; None for what may be any."""
    if words == "*length*":
        return None
    product = re.sub(r"(?<=[\w)]) (?=[\w(])", " * ", words.replace("*", "").removeprefix("sum of "))
    return eval(product, {}, known)


class Fields(unittest.TestCase):
    def check_sizes(self, file):
        known = known_sizes(file)
        if "S" in known:
            self.assertEqual(known.setdefault("n", known["d"] * known["S"]), known["d"] * known["S"])
        overlays = list(zip(file["overlay/nodes"][:], file["overlay/surface_nodes"][:])) if "overlay" in file else []
        for name, item in datasets(file).items():
            for size, words in zip(item.shape, ROWS[name][1].split(", ")):
                if words.startswith("*sum of "):
                    wanted = sum(value(words, {**known, "g": int(g), "q": int(q)}) for g, q in overlays)
                else:
                    wanted = value(words, known)
                self.assertIn(wanted, (None, size), f"{name}: {words} with {known}")

    def test_models(self):
        seen = set()
        for path in sorted(SAMPLES.glob("*.palpate.hdf")):
            with h5py.File(path) as file:
                seen |= set(file.attrs)
                self.assertIn("format version {}.{}".format(*file.attrs["version"]), PAGE)
                for dataset, item in datasets(file).items():
                    with self.subTest(path=path.name, dataset=dataset):
                        self.assertIn(dataset, ROWS, "it has no row")
                        kind, shape = ROWS[dataset][:2]
                        self.assertIn(str(item.dtype), kind.split(" or "))
                        self.assertEqual(item.ndim, shape.count(", ") + 1)
                    seen.add(dataset)
                with self.subTest(path=path.name):
                    self.check_sizes(file)
        self.assertEqual(set(ROWS), seen, "each row is of something that some file has")


if __name__ == "__main__":
    unittest.main()
