"""A report as one self-contained HTML page: how its data are packed, its parts, and how it is written.

The page's program is in `web/`, bundled into `report/page`; `web/src/data.ts` describes the data, key by key. The functions
here make the parts that every report has: curves, tables, lists. `report_scene` makes robots and obstacles.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.errors import ProblemError
from spacearm.core.output import write_new

Packing = Literal["f32", "f64", "u8", "u16", "u32"]
Tone = Literal["good", "bad", "plain"]

VERSION = 1
"""Of the data, under the key "spacearm-report"."""

_TYPES: dict[str, str] = {"f32": "<f4", "f64": "<f8", "u8": "u1", "u16": "<u2", "u32": "<u4"}
_FOLDER = Path(__file__).parent / "page"


def packed(values: ArrayLike, kind: Packing = "f32") -> str:
    """Return numbers as the page reads them: their kind, and base64 of their bytes, row by row."""
    array = np.ascontiguousarray(values, dtype=_TYPES[kind])
    return f"{kind}:{base64.b64encode(array.tobytes()).decode('ascii')}"


def unpacked(text: str) -> NDArray[Any]:
    """Return the numbers of `packed`, one after another."""
    kind, _, content = text.partition(":")
    return np.frombuffer(base64.b64decode(content), dtype=_TYPES[kind])


def quantised(points: ArrayLike) -> tuple[str, list[float], list[float]]:
    """Return points (..., 3) [m] as shares of their box in 16 bits, and the corners of the box [m].

    A point is off by at most 1/131070 of the box's size in each coordinate.
    """
    array = np.asarray(points, dtype=np.float64)
    flat = array.reshape(-1, 3)
    low, high = (flat.min(axis=0), flat.max(axis=0)) if len(flat) else (np.zeros(3), np.zeros(3))
    size = np.where(high > low, high - low, 1.0)
    return packed(np.round((array - low) / size * 65535), "u16"), low.tolist(), high.tolist()


def unquantised(text: str, low: Sequence[float], high: Sequence[float]) -> NDArray[np.float64]:
    """Return the points (k, 3) [m] of `quantised`."""
    return np.array(low) + (np.array(high) - np.array(low)) * unpacked(text).reshape(-1, 3) / 65535


def transform(T: NDArray[np.float64]) -> list[float]:
    """Return a transform (4, 4) as the page reads it: 12 numbers, row by row."""
    return [float(value) for value in np.asarray(T, dtype=np.float64)[:3].ravel()]


def series(
    label: str, values: ArrayLike, tone: int = 0, *, dashed: bool = False, steps: bool = False, faint: bool = False
) -> dict[str, Any]:
    """Return a curve of a plot.

    Args:
        label: of the legend.
        values: (k,), over the plot's x; nan leaves a gap.
        tone: 0, 1, 2, ...: the page has the colours.
        dashed, steps, faint: how it is drawn; steps: a staircase; faint: one of many lines behind the others.
    """
    made: dict[str, Any] = {"label": label, "tone": int(tone), "values": packed(values)}
    return made | {key: True for key, is_so in (("dashed", dashed), ("steps", steps), ("faint", faint)) if is_so}


def plot(
    name: str,
    title: str,
    unit: str,
    x: ArrayLike,
    curves: Sequence[dict[str, Any]],
    *,
    x_label: str = "time [s]",
    clock: bool = True,
    log: bool = False,
    log_x: bool = False,
    floor: float | None = None,
    limits: Sequence[tuple[int, float | None, float | None]] = (),
    lines: Sequence[tuple[float, str]] = (),
    note: str = "",
) -> dict[str, Any]:
    """Return a plot.

    Args:
        name: unique in its view.
        title, unit: above it, and of y.
        x: (k,), ascending.
        curves: of `series`.
        x_label, clock: what x is, and whether it is the view's clock, so that the cursor follows the slider.
        log, log_x, floor: logarithmic axes; y below the floor is drawn there.
        limits: (index of a curve, lower, upper); None or infinite: none.
        lines: (value, label): across the plot.
        note: a sentence below it.
    """
    made: dict[str, Any] = {"id": name, "title": title, "unit": unit, "xLabel": x_label, "x": packed(x), "clock": clock}
    made["series"] = list(curves)
    made |= {key: True for key, is_so in (("log", log), ("logX", log_x)) if is_so}
    if floor is not None:
        made["floor"] = float(floor)
    if limits:
        made["limits"] = [{"series": i, "lower": _finite(low), "upper": _finite(high)} for i, low, high in limits]
    if lines:
        made["lines"] = [{"value": float(value), "label": label} for value, label in lines]
    return made | ({"note": note} if note else {})


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def section(
    title: str,
    *,
    rows: Sequence[tuple[str, str]] = (),
    notes: Sequence[str] = (),
    table: tuple[Sequence[str], Sequence[Sequence[str]]] | None = None,
    code: str = "",
    plots: Sequence[dict[str, Any]] = (),
    opened: bool = False,
) -> dict[str, Any]:
    """Return a part of a page below the picture: a list of names and texts, notes, a table, commands, plots."""
    made: dict[str, Any] = {"title": title, "open": opened}
    given = {"rows": [list(row) for row in rows], "notes": list(notes), "code": code, "plots": list(plots)}
    if table is not None:
        given["table"] = {"header": list(table[0]), "rows": [list(row) for row in table[1]]}
    return made | {key: value for key, value in given.items() if value}


def page_html(page: dict[str, Any]) -> str:
    """Return a report as HTML that needs nothing else: no network, no other file.

    Args:
        page: as `web/src/data.ts` describes it, without its version.

    Raises:
        ProblemError: a number in it is infinite or none.
    """
    without = "This report is drawn by a program in the page: allow JavaScript to see it."
    try:
        data = json.dumps({"spacearm-report": VERSION, **page}, allow_nan=False, separators=(",", ":")).encode()
    except ValueError:
        raise ProblemError(
            "the report holds a number that is infinite or none, expected finite ones; a measure of the robot, the scene or "
            "the motion is too large to be drawn: check the units"
        ) from None
    content = base64.b64encode(gzip.compress(data, 6, mtime=0)).decode("ascii")
    script, style, licences = (_part(name) for name in ("report.js", "report.css", "LICENCES.txt"))
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(_printable(str(page['title'])))}</title>\n<!--\n{licences}-->\n<style>{style}</style>\n</head>\n<body>\n"
        f'<noscript>{without}</noscript>\n<main id="app"></main>\n'
        f'<script id="data" type="application/gzip;base64">{content}</script>\n<script>{script}</script>\n</body>\n</html>\n'
    )


def _printable(text: str) -> str:
    """Return text that a file can hold: what is no character, as of a name that is not UTF-8, is replaced."""
    return text.encode(errors="replace").decode()


def write_report(page: dict[str, Any], path: str | os.PathLike[str]) -> None:
    """Write a report; an existing file is not overwritten.

    Raises:
        OutputError: the file exists, or cannot be written.
    """
    write_new(Path(path), page_html(page))


def _part(name: str) -> str:
    text = (_FOLDER / name).read_text(encoding="utf-8")
    return text.replace("</script", "<\\/script") if name.endswith(".js") else text
