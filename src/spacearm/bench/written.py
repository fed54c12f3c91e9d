"""How the benchmarks' results are written down: tables as markdown, values as JSON takes them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any


def markdown(tables: Iterable[tuple[str, Sequence[str], Sequence[Sequence[str]]]], notes: Iterable[str]) -> str:
    """Return tables (title, header, rows) and notes as markdown."""
    parts = []
    for title, header, rows in tables:
        lines = [header, ("---", *("---:" for _ in header[1:])), *rows]
        parts.append(f"**{title}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n")
    return "\n".join([*parts, *(f"- {line}" for line in notes)]) + "\n"


def plain(value: Any) -> Any:
    """Return plain values without nan, which JSON has not, and to seven digits, which say enough."""
    if isinstance(value, float):
        return float(f"{value:.7g}") if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value
