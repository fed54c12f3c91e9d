"""Tables of results: as markdown for files, their cells as text, and values as JSON takes them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple


class Table(NamedTuple):
    """A table of text; the first column is set to the left, the others to the right.

    Attributes:
        title: above it.
        header: the names of the columns.
        rows: a text for each column.
    """

    title: str
    header: tuple[str, ...]
    rows: list[tuple[str, ...]]


def markdown(tables: Iterable[Table], notes: Iterable[str]) -> str:
    """Return tables and notes as markdown."""
    parts = []
    for title, header, rows in tables:
        lines = [header, ("---", *("---:" for _ in header[1:])), *rows]
        parts.append(f"**{title}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n")
    return "\n".join([*parts, *(f"- {line}" for line in notes)]) + "\n"


def number(value: float, digits: int) -> str:
    """Return a number as text with `digits` decimals; - for NaN."""
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def milliseconds(seconds: float, digits: int = 0) -> str:
    """Return a time in milliseconds; - for NaN."""
    return number(1e3 * seconds, digits)


def degrees(angle: float) -> str:
    """Return an angle in degrees; - for NaN."""
    return number(math.degrees(angle), 1)


def percent(share: float) -> str:
    """Return a share in per cent; - for NaN. Nearly all is never rounded to all."""
    if math.isnan(share):
        return "-"
    return f"{100 * share:.1f} %" if 0.99 < share < 1 else f"{100 * share:.0f} %"


def listed(names: Sequence[str], most: int) -> str:
    """Return the first names, and how many more there are in report.json."""
    more = f" and {len(names) - most} more, all in report.json" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def plain(value: Any) -> Any:
    """Return plain values without NaN, which JSON has not, and to seven digits, which say enough."""
    if isinstance(value, float):
        return float(f"{value:.7g}") if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value
