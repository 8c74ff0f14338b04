"""Sphinx extension: makes the Furo that Debian 12 builds work from files and follow the system's dark theme, and its pages keep a
content security policy without 'unsafe-inline'.

Its script is a module, which a browser loads from no file; its style lacks the rules for a system that is dark, and takes a part
from a web server's root. A Furo without these faults is left as it is. Scripts and styles that stand in pages become files."""

import hashlib
import pathlib
import re

DARK = re.compile(r'body\[data-theme="dark"\] (\{[^}]+\})')
INLINE = re.compile(r"<(script|style)(?: type=\"[a-z/]+\")?>(.*?)</\1>", re.DOTALL)


def without_inline(page, site):
    """The text of a page, its inline scripts and styles as files of _static that it loads in the same place."""
    def as_file(found):
        kind, text = found.groups()
        name = f"{hashlib.sha256(text.encode()).hexdigest()[:16]}.{'js' if kind == 'script' else 'css'}"
        (site / "_static" / name).write_text(text)
        path = "../" * len(page.relative_to(site).parent.parts) + "_static/" + name
        return f'<script src="{path}"></script>' if kind == "script" else f'<link rel="stylesheet" href="{path}" type="text/css" />'

    return INLINE.sub(as_file, page.read_text()).replace('style="display: none;"', 'class="symbols"').replace('style="opacity: 50%"', 'opacity="50%"')


def mend(app, problem):
    static = pathlib.Path(app.outdir) / "_static"
    if problem is not None:
        return
    for page in pathlib.Path(app.outdir).rglob("*.html"):
        page.write_text(without_inline(page, static.parent))
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
