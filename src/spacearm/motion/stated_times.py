"""The times that files have: in which unit they are, and whether that can be."""

from __future__ import annotations

import re
from datetime import datetime, timezone
from typing import Any, Literal

import numpy as np

from spacearm.checks import shown
from spacearm.errors import FileFormatError
from spacearm.motion.stated import Rows
from spacearm.robot import Robot

TimeUnit = Literal["s", "ms", "us", "ns"]

PER_SECOND: dict[str, float] = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}

_SUFFIXES = {"s": "s", "sec": "s", "secs": "s", "second": "s", "seconds": "s", "ms": "ms", "us": "us", "ns": "ns"}
_NAMES = ("t", "time", "time_from_start", "timestamp", "stamp", "elapsed", "%time", "__time")
_SLOW = 1e-3  # of a velocity limit: a motion that could be done a thousand times quicker
_DATE = 1e8  # [s] since 1970, which is 1973; no motion begins that late by its own clock
_LAST_DATE = 4e9  # the year 2096
_YEAR, _DAY, _HOUR = 365.25 * 86400.0, 86400.0, 3600.0


def checked_unit(unit: Any) -> None:
    """Refuse what is no unit.

    Raises:
        FileFormatError: such a one.
    """
    if unit is not None and (not isinstance(unit, str) or unit not in PER_SECOND):
        raise FileFormatError(f"time_unit is {shown(unit)}, expected one of {', '.join(map(repr, PER_SECOND))}, or None")


def time_column(names: tuple[str, ...]) -> tuple[str, str | None] | None:
    """Return which column is the time, and the unit that its name says; None if none is. The first of the known names goes."""
    plain = {re.sub(r"[\s\[\](){}]+", "_", name.strip().lower()).strip("_"): name for name in reversed(names)}
    for known in _NAMES:
        for suffix, unit in (("_s", "s"), ("", None), *((f"_{suffix}", unit) for suffix, unit in _SUFFIXES.items())):
            if f"{known}{suffix}" in plain:
                return plain[f"{known}{suffix}"], "ns" if known == "%time" else unit  # as `rostopic echo -p` writes it
    return None


def whole_and_rest(names: tuple[str, ...]) -> tuple[str, str] | None:
    """Return the columns of whole seconds and of nanoseconds, if there are such two."""
    by_end = {re.split(r"[._/]", name.strip().lower())[-1]: name for name in reversed(names)}
    for whole, rest in (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec")):
        if whole in by_end and rest in by_end:
            return by_end[whole], by_end[rest]
    return None


def note_beginning(rows: Rows, notes: list[str]) -> None:
    """Say that the file's times do not begin at 0."""
    begin = float(rows.t[0])
    if begin == 0:
        return
    date = ""
    if _DATE < begin < _LAST_DATE:
        date = f" ({datetime.fromtimestamp(begin, timezone.utc):%Y-%m-%d} if that is since 1970)"
    notes.append(f"time begins at {begin:.9g} s in the file{date}, at 0 here")


def doubts(robot: Robot, rows: Rows) -> list[str]:
    """Say if no joint comes near its velocity limit, and which unit would make a usual motion of it."""
    limited = np.isfinite(robot.velocity)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        speed = np.abs(np.diff(rows.states[0], axis=0)) / np.diff(rows.t)[:, None]
        share = float((speed / robot.velocity)[:, limited].max(initial=0.0))
    taken = float(rows.t[-1] - rows.t[0])
    if not 0 < share < _SLOW:
        return []
    unit = next((unit for unit, per in reversed(PER_SECOND.items()) if share * per <= 10), "ms")
    return [
        f"it takes {as_duration(taken)}, and no joint uses more than {share:.2g} of its velocity limit: are its times in "
        f"{unit}? Then give time_unit='{unit}' (--time-unit {unit})"
    ]


def as_duration(seconds: float) -> str:
    """Print a time, long ones also in hours, days or years."""
    text = f"{seconds:.3f} s" if 0.01 <= seconds < 1e5 else f"{seconds:.4g} s"
    for length, name in ((_YEAR, "years"), (_DAY, "days"), (_HOUR, "hours")):
        if seconds >= 2 * length:
            return f"{text} ({seconds / length:.3g} {name})"
    return text
