"""A page that would load anything from a network is a warning, which fails the build."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

log = logging.getLogger(__name__)
LOADED = re.compile(r"<(?:script|img|iframe|video|source|link)\b[^>]*\b(?:src|href)=[\"']?((?:https?:)?//[^\"' >]+)")
LOADED_BY_STYLE = re.compile(r"(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\"')]+)")


def look(app: Sphinx, failed: Exception | None) -> None:
    """Look at all files that were written."""
    if failed is not None:
        return
    for path in Path(app.outdir).rglob("*"):
        pattern = {".html": LOADED, ".css": LOADED_BY_STYLE}.get(path.suffix)
        for address in pattern.findall(path.read_text(encoding="utf-8")) if pattern else []:
            log.warning("%s loads %s from a network", path.relative_to(app.outdir), address)


def setup(app: Sphinx) -> dict[str, Any]:
    """Look after the build."""
    app.connect("build-finished", look)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
