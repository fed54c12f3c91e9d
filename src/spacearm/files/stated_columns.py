"""What a trajectory's file states beside the joints' positions, compared with what the joints' path makes of it.

Whoever runs a file may believe any part of it: its rates, its base, its end effector, its unit of time. So where a part is not
what the path makes, that is found, and a certificate fails.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError
from spacearm.core.rotations import angle, conjugate, multiplied, rotated
from spacearm.files.base_columns import TIP_COLUMNS
from spacearm.motion.recorded import RecordedTrajectory
from spacearm.robot import Robot

Array = NDArray[np.float64]

KINDS = ("q", "dq", "ddq")
STILL = 1e-9
"""[rad or m] By no more than this may a joint move in a file that is not the robot's: that is not at all."""

_SAME = 1e-6  # [m, rad, per s] as the certificate has it for a base
_DECIMALS = range(4, 13)  # of numbers; with fewer they are taken as they are
_CURVED = 0.5  # of how rates bend from row to row: by a twelfth of that a mean of two misses
_WRONG = 0.02  # of the greatest rate: missed by more, the rates are of another motion
_FEW = 4  # rows are too few to tell
_BEGIN = 0.01  # [rad or m] as MoveIt allows between where an arm is and where its trajectory begins
_MOVING = 0.1  # of the greatest rate


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """Values (m, k) that a file gives at times t (m,) from the trajectory's beginning [s], and where they stand in it."""

    t: Array
    values: Array
    places: list[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """What a file holds.

    Attributes:
        places: (m,) where each row stands, as in "line 3".
        t: (m,) times, increasing [s].
        states: positions, and rates and accelerations as far as there are any, each (m, n).
        base: positions and quaternions wxyz of the base (k, 7), in the inertial frame.
        velocity: of the base's origin (k, 3) [m/s], in the inertial frame.
        turning: of the base (k, 3) [rad/s], in the inertial frame or in its own: files differ.
        tip: the end effector's position (k, 3) [m].
        robot: the robot's name, if the file has one.
        duration: [s], if the file states it.
        begin: joints and where the file says that they stand before the motion.
    """

    places: list[str]
    t: Array
    states: list[Array]
    base: Series | None = None
    velocity: Series | None = None
    turning: Series | None = None
    tip: Series | None = None
    robot: str | None = None
    duration: float | None = None
    begin: dict[str, float] = field(default_factory=dict)


def contradictions(read: RecordedTrajectory, rows: Rows, notes: list[str]) -> tuple[str, ...]:
    """Return what the file states that is not so, a sentence each; add notes on what is.

    Args:
        read: the trajectory as it was read.
        rows: the file.
        notes: to be added to.

    Raises:
        FileFormatError: the base moves in the file, and is fixed here: one of the two was not meant.
    """
    return (
        *_words(read.robot, rows),
        *_rates(read.robot, rows, notes),
        *_base(read, rows, notes),
        *_base_rates(read, rows),
        *_tip(read, rows),
    )


def _words(robot: Robot, rows: Rows) -> Iterator[str]:
    if rows.robot is not None and _plain(rows.robot) != _plain(robot.name):
        yield f"the file is of robot '{rows.robot}', and this is '{robot.name}'"
    taken = float(rows.t[-1] - rows.t[0])
    if rows.duration is not None and abs(rows.duration - taken) > _SAME * max(1.0, taken):
        yield f"the file states a duration of {rows.duration:.6g} s, and its rows take {taken:.6g} s"
    for i, name in enumerate(robot.dof_names):
        if name in rows.begin and abs(rows.begin[name] - rows.states[0][0, i]) > _BEGIN:
            yield (
                f"the file has joint '{name}' at {rows.begin[name]:.6g} before the motion, which begins at "
                f"{rows.states[0][0, i]:.6g}"
            )


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())


def _rates(robot: Robot, rows: Rows, notes: list[str]) -> Iterator[str]:
    """Compare rates with how the positions change from row to row, and accelerations with how the rates do."""
    words = ("positions", "rates", "accelerations")
    for order in range(1, len(rows.states)):
        values, rates = rows.states[order - 1], rows.states[order]
        if not rates.any():
            if len(rates) > 2 and values.any():
                notes.append(f"the {words[order]} are 0 in every row, and taken at their word")
            continue
        for joint in range(robot.dof):
            i = _missed(rows.t, values[:, joint], rates[:, joint])
            if i is not None:
                moved, step = values[i + 1, joint] - values[i, joint], rows.t[i + 1] - rows.t[i]
                told = step * (rates[i, joint] + rates[i + 1, joint]) / 2
                yield (
                    f"the file's {words[order]} are not those of its {words[order - 1]}: between {rows.places[i]} and "
                    f"{rows.places[i + 1]} '{KINDS[order - 1]}' of joint '{robot.dof_names[joint]}' changes by {moved:.4g}, "
                    f"and '{KINDS[order]}' makes it {told:.4g}"
                )
                break


def _missed(t: Array, values: Array, rates: Array) -> int | None:
    """Return the row after which rates fail most to be those of the values; None if by and large they are.

    The mean of two rates misses that between them by a twelfth of how much rates bend there. Rows that are too far apart to
    tell, as corners of a path with rest at each, bend a lot and are left alone.
    """
    if len(t) <= _FEW:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.diff(t)
        moved = np.diff(values) / step
        bends = np.pad(np.abs(np.diff(rates, 2)), 2)  # 0 beyond the ends; between rows i and i + 1, of the rows i - 1 to i + 2
        bend = np.max([bends[k : len(bends) - 3 + k] for k in range(4)], axis=0)
        most = max(float(np.abs(moved).max()), float(np.abs(rates).max()))
        miss = np.abs(moved - (rates[1:] + rates[:-1]) / 2)
        allowed = _CURVED * bend + _WRONG * most + 4 * _digits(values) / step + 2 * _digits(rates)
        moving = np.maximum(np.abs(moved), np.maximum(np.abs(rates[1:]), np.abs(rates[:-1]))) > _MOVING * most
        wrong = (miss > allowed) & moving
    if moving.sum() < _FEW or wrong.sum() <= moving.sum() / 2:
        return None
    return int(np.argmax(np.where(wrong, miss, -1.0)))


def _base(read: RecordedTrajectory, rows: Rows, notes: list[str]) -> Iterator[str]:
    if rows.base is None:
        return
    t, poses, places = rows.base.t, rows.base.values, rows.base.places
    position, attitude = read.base_pose(t)
    with np.errstate(over="ignore"):
        away = np.linalg.norm(poses[:, :3] - position, axis=1)
    turned = angle(multiplied(conjugate(poses[:, 3:]), attitude))
    off = np.maximum(away, turned)
    i = int(np.argmax(off))
    if off[i] > _allowed(poses) + 2 * _digits(rows.states[0]) * read.robot.dof:
        where = f"{places[i]}: the base is {away[i]:.4g} m and {turned[i]:.4g} rad from where"
        if not read.base_model.follows_arm:
            raise FileFormatError(f"{where} a {read.base} base stays; give base='floating', or leave the base's columns out")
        else:
            yield f"{where} momentum takes it: something else moves it, or holds it, or the masses are others"
    elif not read.base_model.follows_arm:
        notes.append("the base stays where the file has it")
    else:
        notes.append(
            "the base moves by conservation of momentum, from the file's first pose or the given one; the file's poses are "
            f"within {away.max():.3g} m and {turned.max():.3g} rad of that"
        )


def _base_rates(read: RecordedTrajectory, rows: Rows) -> Iterator[str]:
    for series, what, unit in ((rows.velocity, "moves", "m/s"), (rows.turning, "turns", "rad/s")):
        if series is None:
            continue
        velocity, omega = read.base_rate(series.t)
        if what == "moves":
            off = np.linalg.norm(series.values - velocity, axis=1)
        else:  # in base axes or in inertial ones
            turned = rotated(read.base_pose(series.t)[1], omega)
            off = np.minimum(*(np.linalg.norm(series.values - given, axis=1) for given in (omega, turned)))
        i = int(np.argmax(off))
        if off[i] > 10 * _allowed(series.values):  # rates have fewer digits than poses
            yield f"{series.places[i]}: the base {what} at {off[i]:.4g} {unit} more or less than the joints' motion makes it"


def _tip(read: RecordedTrajectory, rows: Rows) -> Iterator[str]:
    if rows.tip is None:
        return
    off = np.linalg.norm(read.tip(rows.tip.t)[:, :3, 3] - rows.tip.values, axis=1)
    i = int(np.argmax(off))
    if off[i] > _allowed(rows.tip.values) + 10 * _digits(rows.states[0]) * read.robot.dof:
        yield (
            f"{rows.tip.places[i]}: the end effector is {off[i]:.4g} m from where the joints put '{read.robot.tip}'; leave "
            f"{', '.join(TIP_COLUMNS)} out if they are of something else"
        )


def _allowed(values: Array) -> float:
    """Return by how much values in a file may miss the true ones: rounding, and their own last digit."""
    return _SAME + 4 * _digits(values)


def _digits(values: Array) -> float:
    """Return half a unit of the last decimal of numbers, at most 5e-5; 0 for whole numbers and for those with all digits."""
    if (values == np.rint(values)).all():
        return 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for decimals in _DECIMALS:
            scaled = values * 10.0**decimals
            if (np.abs(scaled - np.rint(scaled)) <= 1e-15 * np.abs(scaled) * 4).all():
                return 0.5 * 10.0**-decimals
    return 0.0


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
