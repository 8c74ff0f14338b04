"""Pages as notebooks: which cells they become, and that a cell which fails or prints something else is told."""

import os
import pathlib
import tempfile
import unittest

import run_notebooks
from run_notebooks import notebooks

BUILD = pathlib.Path(os.environ["PALPATE_BINARY_DIR"])

PAGE = """# Greeting

See [probe](../probe.md#forces) and [elsewhere](https://example.org).

<!-- file: greet.py -->
```python
print("hello")
```

```sh
python3 greet.py
echo and welcome
```

<!-- output -->
```text
hello
and welcome
```

<!-- file: twice.py -->
```python
import sys

print(int(sys.argv[1]) * 2)
```

<!-- file: in/numbers.csv -->
```text
1,2
```

```sh
python3 twice.py 4
cat in/numbers.csv
```

<!-- output -->
```text
8
...
```

<!-- not run: takes a year -->
```sh
sleep 31536000
```
"""


class Page(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(dir=BUILD)
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def page(self, text):
        (self.folder / "docs" / "tutorials").mkdir(parents=True, exist_ok=True)
        page = self.folder / "docs" / "tutorials" / "greeting.md"
        page.write_text(text)
        return page


class Cells(Page):
    def test_are_scripts_commands_and_text(self):
        made = notebooks.notebook(self.page(PAGE), self.folder / "docs" / "notebooks")
        cells = [(cell["cell_type"], "".join(cell["source"])) for cell in made["cells"]]
        kinds = [kind for kind, _ in cells]
        self.assertEqual(kinds, ["code", "markdown", "code", "code", "code", "code", "code", "code", "markdown"])
        sources = [source for _, source in cells]
        self.assertIn("[probe](../probe.md) and [elsewhere](https://example.org)", sources[1])
        self.assertEqual(sources[2], 'print("hello")', "a script that is run as it is is a cell")
        self.assertTrue(sources[3].startswith("%%bash\n") and sources[3].endswith("echo and welcome"))
        self.assertEqual(sources[4], "%mkdir -p in")
        self.assertTrue(sources[5].startswith("%%writefile in/numbers.csv\n1,2"))
        self.assertTrue(sources[6].startswith("%%writefile twice.py\n"), "one with arguments is a file")
        self.assertIn("python3 twice.py 4", sources[7])
        self.assertIn("sleep 31536000", sources[8])
        self.assertIn("takes a year", sources[8])
        self.assertFalse(any("<!--" in source for source in sources))


class Kernel(Page):
    def run_page(self, text):
        said = []
        return run_notebooks.run(self.page(text), BUILD, said.append), "\n".join(said)

    def test_prints_what_the_page_says(self):
        right, said = self.run_page(PAGE)
        self.assertTrue(right, said)
        self.assertIn("2 outputs compared", said)

    def test_something_else_is_told(self):
        for wrong in (PAGE.replace("hello\nand", "hallo\nand"), PAGE.replace("and welcome\n```\n\n<!-- file: twice", "welcome\n```\n\n<!-- file: twice")):
            right, said = self.run_page(wrong)
            self.assertFalse(right)
            self.assertIn("the page says", said)

    def test_a_cell_that_fails_is_told(self):
        for wrong in (PAGE.replace('print("hello")', "nobody()"), PAGE.replace("echo and welcome", "false")):
            right, said = self.run_page(wrong)
            self.assertFalse(right)
            self.assertIn("a cell failed", said)


if __name__ == "__main__":
    unittest.main()
