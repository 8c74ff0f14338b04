"""The viewer in a notebook, or in a browser beside a script."""

from __future__ import annotations

import html
import json
import os
import signal
import subprocess
import threading
from typing import Union

from .library import Error, path_text, program

Path = Union[str, "os.PathLike[str]"]  # as CPython 3.9 takes it


class Viewer:
    """A body to push, or a recording (.mcap) to look at, in the viewer: `palpate-runtime play FILE --view` or `view FILE` in the background.
    In a notebook it shows itself where it is the last thing of a cell; elsewhere open `address` in a browser. Ends with `close()`,
    with its `with` block, or with Python. `options` are those of the command line: Viewer("liver.palpate.hdf", "--tool", "sphere:0.008").
    Throws Error with what palpate-runtime says."""

    def __init__(self, file: Path, *options: str, height: int = 560):
        name = path_text(file)
        command = ["view", name] if name.endswith(".mcap") else ["play", name, "--view"]
        chosen = any(option.split("=")[0] == "--view-address" for option in options)
        address = [] if chosen else ["--view-address", "0"]
        self.height = height
        told, tells = os.pipe()  # the address: what is printed has names from files in it
        with open(told, encoding="utf-8") as reader:
            try:
                self._process = subprocess.Popen(
                    [program("palpate-runtime"), *command, *address, "--view-framed", "--view-fd", str(tells), *options],
                    stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", pass_fds=(tells,))
            finally:
                os.close(tells)
            self._said: list[str] = []
            self._drain = threading.Thread(target=self._listen, daemon=True)
            self._drain.start()
            line = reader.readline()
        if not line:
            self._process.wait()
            self._drain.join()
            raise Error.of_text("".join(self._said))
        self.address: str = json.loads(line)["url"]

    def _listen(self) -> None:
        """To its end, or the program would wait for a reader."""
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                self._said = [*self._said[-99:], line]

    @property
    def running(self) -> bool:
        """Whether the viewer can still be looked at."""
        return self._process.poll() is None

    def close(self) -> None:
        """Ends the viewer as Ctrl-C does, so that a recording of it (`--record`) is whole."""
        if self.running:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()

    def __del__(self) -> None:
        if hasattr(self, "_process"):
            self.close()

    def _repr_html_(self) -> str:
        address = html.escape(self.address)
        if not self.running:
            return "<p>This viewer has ended.</p>"
        return (f'<iframe src="{address}" width="100%" height="{int(self.height)}" style="border:0"></iframe>'
                f'<p><a href="{address}" target="_blank">Open it in a page of its own</a></p>')
