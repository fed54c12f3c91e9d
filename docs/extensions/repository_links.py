"""Links to files of the repository that are no pages: on the site they lead to the page that shows them."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

EXAMPLE = re.compile(r"\]\((?:\.\./)+examples(?:/[^)#]*)?\)")
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}


def rewritten(text: str, depth: int) -> str:
    """Return a page's text with its links into the repository led to pages; `depth`: folders between it and docs."""
    up = "../" * depth
    text = EXAMPLE.sub(f"]({up}examples.md)", text)
    for name, page in PAGES.items():
        text = text.replace(f"]({up}../{name})", f"]({up}{page})").replace(f"]({up}../{name}#", f"]({up}{page}#")
    return text


def read(app: Sphinx, page: str, source: list[str]) -> None:
    """Rewrite the links of a page before it is parsed."""
    source[0] = rewritten(source[0], page.count("/"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Rewrite each page as it is read."""
    app.connect("source-read", read)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
