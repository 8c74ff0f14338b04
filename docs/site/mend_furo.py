"""Sphinx extension: makes the Furo that Debian 12 builds work from files and follow the system's dark theme.

Its script is a module, which a browser loads from no file; its style lacks the rules for a system that is dark, and takes a part
from a web server's root. A Furo without these faults is left as it is."""

import pathlib
import re

DARK = re.compile(r'body\[data-theme="dark"\] (\{[^}]+\})')


def mend(app, problem):
    static = pathlib.Path(app.outdir) / "_static"
    if problem is not None:
        return
    script = static / "scripts" / "furo.js"
    text = script.read_text()
    if text.startswith("import Gumshoe"):
        script.write_text((static / "scripts" / "gumshoe-patched.js").read_text() + text.partition("\n")[2])
    style = static / "styles" / "furo.css"
    text = style.read_text().replace("/javascript/normalize.css/normalize.css", "../normalize.css")
    if "prefers-color-scheme" not in text:
        text += f'\n@media screen and (prefers-color-scheme: dark) {{\n  body:not([data-theme="light"]) {DARK.search(text).group(1)}\n}}\n'
    style.write_text(text)


def setup(app):
    app.connect("build-finished", mend)
    return {"parallel_read_safe": True}
