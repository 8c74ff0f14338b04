"""Sphinx extension: each formula becomes MathML when the book is built, by KaTeX. A page needs no script to show it."""

import json
import pathlib
import subprocess

from docutils import nodes
from sphinx.util import logging

logger = logging.getLogger(__name__)
node_js = None


def mathml(node, display):
    """By one KaTeX process, which all formulas are sent to. A formula that KaTeX refuses is a warning, which scripts/docs makes an error."""
    global node_js
    if node_js is None:
        script = pathlib.Path(__file__).with_name("mathml.js")
        node_js = subprocess.Popen(["node", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    node_js.stdin.write(json.dumps({"tex": node.astext(), "display": display}) + "\n")
    node_js.stdin.flush()
    answer = json.loads(node_js.stdout.readline())
    if "problem" in answer:
        logger.warning("%s", answer["problem"], location=node)
    return answer.get("mathml", "")


def visit_inline(translator, node):
    translator.body.append(mathml(node, False))
    raise nodes.SkipNode


def visit_block(translator, node):
    translator.body.append(translator.starttag(node, "div", CLASS="math-block") + mathml(node, True) + "</div>\n")
    raise nodes.SkipNode


def end(app, problem):
    if node_js is not None:
        node_js.stdin.close()
        node_js.wait()


def setup(app):
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.connect("build-finished", end)
    return {"parallel_read_safe": True}
