"""What a report's page holds, for tests: its data taken out of the HTML, and packed numbers unpacked."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_TYPES = {"f32": "<f4", "f64": "<f8", "u8": "u1", "u16": "<u2", "u32": "<u4"}


def page_in(path: Path) -> dict[str, Any]:
    """Return the data of a report."""
    found = re.search(r'<script id="data" [^>]*>([^<]*)</script>', path.read_text(encoding="utf-8"))
    assert found
    return json.loads(gzip.decompress(base64.b64decode(found[1])))


def unpacked(text: str) -> NDArray[Any]:
    """Return the numbers of a packed array, in a row."""
    kind, _, content = text.partition(":")
    return np.frombuffer(base64.b64decode(content), dtype=_TYPES[kind])


def values_of(plot: dict[str, Any], label: str) -> NDArray[Any]:
    """Return the curve of a plot whose label begins so."""
    (found,) = [one for one in plot["series"] if one["label"].startswith(label)]
    return unpacked(found["values"])


def texts_in(value: Any) -> list[str]:
    """Return all texts in plain values."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, dict):
        return [text for inner in value.values() for text in texts_in(inner)]
    return [text for inner in value for text in texts_in(inner)] if isinstance(value, list) else []
