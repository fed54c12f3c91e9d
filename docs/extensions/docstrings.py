"""Docstrings as the house writes them: |x| is an absolute value and `name` is code, linked where it is a public name."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx


def escaped(app: Sphinx, kind: str, name: str, of: object, options: object, lines: list[str]) -> None:
    """Escape what reStructuredText would take for markup, outside of code."""
    lines[:] = [re.sub(r"(`[^`]*`)|\|", lambda found: found[1] or r"\|", line) for line in lines]


def setup(app: Sphinx) -> dict[str, Any]:
    """Escape each docstring before it is parsed."""
    app.connect("autodoc-process-docstring", escaped)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
