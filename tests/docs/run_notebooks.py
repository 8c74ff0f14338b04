#!/usr/bin/python3
"""Runs tutorials of the book as notebooks (scripts/notebooks) in a kernel of Jupyter, and compares what cells print with what the page says.

  run_notebooks.py --build DIR PAGE...   exit status 1 when a cell failed or printed something else"""

import argparse
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import sys
import tempfile

import nbclient
import nbformat
import run_blocks

os.environ.setdefault("PYDEVD_DISABLE_FILE_VALIDATION", "1")  # or each kernel warns
SCRIPT = run_blocks.SOURCE / "scripts" / "notebooks"
notebooks = importlib.util.module_from_spec(importlib.util.spec_from_loader("notebooks", importlib.machinery.SourceFileLoader("notebooks", str(SCRIPT))))
notebooks.__loader__.exec_module(notebooks)


def printed(cells, room):
    """What code cells printed, without the folder that they ran in."""
    text = "".join(output.get("text", "") for cell in cells for output in cell.outputs if output.output_type == "stream")
    return text.replace(f"{room}/", "").replace(str(room), ".")


def run(page, build, say=print):
    """Whether every cell of the page's notebook ran, and printed what the page says."""
    with tempfile.TemporaryDirectory(prefix="notebook-", dir=build) as folder:  # within the repository, as a reader's
        folder = pathlib.Path(folder)
        notebook = nbformat.reads(json.dumps(notebooks.notebook(page, folder)), as_version=4)
        nbformat.validate(notebook)
        client = nbclient.NotebookClient(notebook, timeout=240, startup_timeout=600, kernel_name="python3", resources={"metadata": {"path": str(folder)}})
        try:
            client.execute()
        except nbclient.exceptions.CellExecutionError as failed:
            say(f"{page}: a cell failed\n{failed}")
            return False
        room = folder / page.stem
        code = [cell for cell in notebook.cells if cell.cell_type == "code"]
        compared, right = 0, True
        for k, cell in enumerate(code):
            wanted = cell.metadata.get("palpate", {}).get("output")
            if wanted is None:
                continue
            compared += 1
            have = printed(code[k + 1 - cell.metadata["palpate"]["cells"]:k + 1], room)
            if not run_blocks.same_output(wanted, have):
                right = False
                say(f"{page}:{cell.metadata['palpate']['line']}: the page says\n{run_blocks.indented(wanted)}  and the notebook printed\n{run_blocks.indented(have)}")
        say(f"{page}: {len(code)} cells run, {compared} outputs compared")
        return right


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="+", type=pathlib.Path, metavar="PAGE")
    parser.add_argument("--build", type=pathlib.Path, required=True, metavar="DIR", help="build folder with the programs")
    options = parser.parse_args()
    os.environ.update(PALPATE_BINARY_DIR=str(options.build.resolve()), MPLBACKEND="Agg", PYTHONDONTWRITEBYTECODE="1", COLUMNS="120")
    return 0 if all([run(page.resolve(), options.build.resolve()) for page in options.pages]) else 1


if __name__ == "__main__":
    sys.exit(main())
