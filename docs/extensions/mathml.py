"""Formulas as MathML, which browsers draw themselves: no script, no font, no network."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

log = logging.getLogger(__name__)


def mathml(latex: str, node: nodes.Element, display: str) -> str:
    """Return a formula as MathML; what cannot be read is a warning, which fails the build."""
    numbered = re.search(r"\\tag\{([^}]*)\}", latex)
    text = latex.replace(numbered[0], "") if numbered else latex
    try:
        found = convert(text.strip(), display=display)
    except Exception as error:  # of a parser: any
        log.warning("no MathML can be made of %r: %s", latex, error, location=node)
        return f"<code>{latex}</code>"
    return f'<span class="tagged">{found}<span class="tag">({numbered[1]})</span></span>' if numbered else found


def visit_inline(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in a line of text."""
    writer.body.append(mathml(node.astext(), node, "inline"))
    raise nodes.SkipNode


def visit_block(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula on its own line."""
    writer.body.append(f'<div class="formula">{mathml(node.astext(), node, "block")}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer under the name `mathml`."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
