"""The rows that a trajectory is written as, so that what is read between them is that trajectory again, within its limits.

The times of rows are whole ticks of the format's clock. Between rows of positions, rates and accelerations every reader takes
quintics. Where the trajectory is a polynomial of degree five or less they are the trajectory itself, if a row stands wherever
two of its pieces meet; elsewhere there are more rows. What remains is rounding mostly, and would pass a limit that the
trajectory uses to the full. So the motion is written slower by that much, by a billionth as a rule.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_number
from spacearm.core.errors import SettingsError
from spacearm.motion.limit_margins import LimitMargins, path_margins
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import AnyTrajectory, RecordedTrajectory

_INTERVALS = 200
_MOST = 1_000_000  # instants of a file


def instants(trajectory: AnyTrajectory, step: float | None, *, ticks: int) -> NDArray[np.int64]:
    """Return the instants (m,) in ticks: 0, each step after it, and the last tick that is not beyond the end.

    Args:
        trajectory: to be written.
        step: between them [s]; None: a 200th of the duration.
        ticks: of the clock in a second.

    Raises:
        SettingsError: a step that is none, shorter than a tick, or gives more than a million instants.
    """
    last = int(np.floor(trajectory.duration * ticks * (1 + 1e-15)))
    if step is None:
        return np.unique(np.linspace(0, last, _INTERVALS + 1).astype(np.int64))
    step = as_number("step", step, SettingsError, at_least=1 / ticks, unit="s")
    if last / ticks / step > _MOST:
        raise SettingsError(
            f"step is {step:.6g} s, and a trajectory of {trajectory.duration:.6g} s has more than {_MOST} of them, expected "
            "fewer; give a longer step"
        )
    at = np.round(np.arange(0.0, last / ticks, step) * ticks).astype(np.int64)
    return np.unique(np.append(at, last))


Array = NDArray[np.float64]

_SHORTEST = 1e-6  # [s]; in shorter pieces a path that is read back would have no digits
_SHORT = 1e-5  # of the duration: likewise
_REST = 1e-3  # [s] as which a trajectory is written that takes no time
_SILENT = 1e-8  # slower by this share is the last digits
_MOST_ROWS = 0.01  # slower by a larger share would be another motion
_POSITION = 1e-12  # [rad or m] beyond a limit is rounding, to the proof too
_AGAIN = 4  # times that the slowing is worked out, for it changes what is read
_GRIDS = ((1, 2), (2, 4), (0.5, 1), (4, 8), (0.1, 1))  # rows as a multiple of those asked for, and the least number a piece


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """What is written down.

    Attributes:
        trajectory: it, perhaps a little slower.
        t: (m,) from 0 [s].
        states: positions, rates and accelerations, each (m, n); without accelerations, or rates too, where they jump.
        notes: what differs from the trajectory, a sentence each.
    """

    trajectory: AnyTrajectory
    t: Array
    states: tuple[Array, ...]
    notes: tuple[str, ...] = ()


def rows_of(trajectory: AnyTrajectory, *, least: int, ticks: int | None = None, jerk_limit: ArrayLike | None = None) -> Rows:
    """Choose rows from which the trajectory can be read again, its limits kept.

    Args:
        trajectory: to be written.
        least: how many rows there should be at least, or nearly so.
        ticks: of a clock in a second, if the times are whole ticks of it.
        jerk_limit: to be kept too, of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: none.
    """
    if trajectory.duration == 0:
        q = trajectory.sample(np.zeros(2)).q
        rest = (f"the trajectory takes 0 s, and is written as {_REST:g} s of rest",)
        return Rows(trajectory=trajectory, t=np.array([0.0, _REST]), states=(q, 0 * q, 0 * q), notes=rest)
    path, best = trajectory.path, None
    kinds, said = _kinds(path)
    asked = trajectory.margins(jerk_limit=jerk_limit)
    for factor, parts in _GRIDS:
        rows = _slowed(trajectory, _grid(path, factor * (least - 1), parts), kinds, asked, ticks, jerk_limit)
        if best is None or rows[1] < best[1]:
            best = rows
        if best[1] <= 1 + _SILENT:
            break
    assert best is not None
    return replace(best[0], notes=(*said, *best[0].notes))


def rows_at(trajectory: AnyTrajectory, t: Array) -> Rows:
    """Take the rows at given times, and say if a limit is passed by what is read between them."""
    kinds, said = _kinds(trajectory.path) if trajectory.duration > 0 else (3, ())
    states = tuple(trajectory.sample(t))[:kinds]
    excess = 1.0 if len(t) < 2 else _excess(trajectory, _read(t, states), trajectory.margins(), None)
    return Rows(trajectory=trajectory, t=t, states=states, notes=(*said, *(_passed(excess) if excess > 1 else ())))


def _kinds(path: PiecewisePath) -> tuple[int, tuple[str, ...]]:
    """Return how many of positions, rates and accelerations have one value everywhere, and a note if not all have."""
    if path.jumps(1).any():
        return 1, ("the rates jump, so only positions are written; between rows they are lines",)
    if path.jumps(2).any():
        return 2, ("the accelerations jump, so only positions and rates are written; between rows they are cubics",)
    return 3, ()


def _grid(path: PiecewisePath, intervals: float, parts: int) -> Array:
    """Return times at the path's own breaks and equally spaced between them: steps of about the same length, in whole parts."""
    duration = path.domain[1]
    apart = max(_SHORTEST, _SHORT * duration)
    breaks = [0.0]
    for at in path.breaks[1:-1].tolist():
        if at - breaks[-1] >= apart and duration - at >= apart:
            breaks.append(at)
    breaks.append(duration)
    pieces = list(_cut(breaks, max(duration / max(intervals, 1.0), apart), parts, apart))
    return np.append(np.concatenate(pieces), duration)


def _cut(breaks: list[float], step: float, parts: int, apart: float) -> Iterator[Array]:
    for begin, end in pairwise(breaks):
        count = max(math.ceil((end - begin) / step * (1 - 1e-12)), min(parts, int((end - begin) / apart)), 1)
        yield begin + (end - begin) * np.arange(count) / count


def _slowed(
    trajectory: AnyTrajectory, t: Array, kinds: int, asked: LimitMargins, ticks: int | None, jerk_limit: ArrayLike | None
) -> tuple[Rows, float]:
    """Return the rows at these times, made slower until the limits are kept, and by which factor; infinite if they are not."""
    factor = 1.0
    for _ in range(_AGAIN):
        slower = trajectory if factor == 1 else _run_slower(trajectory, factor)
        at = t * factor
        at[-1] = slower.duration
        if ticks is not None:
            at = np.unique(np.floor(at * ticks * (1 + 1e-15))) / ticks
        states = tuple(slower.sample(at))[:kinds]
        excess = _excess(slower, _read(at, states), asked, jerk_limit)
        if excess <= 1:
            said = (
                f"it is written slower by {factor - 1:.2g} of its duration, so that what is read between rows keeps the limits"
            )
            notes = (said,) if factor > 1 + _SILENT else ()
            return Rows(trajectory=slower, t=at, states=states, notes=notes), factor
        factor *= 1 + 2 * (excess - 1) + 1e-14
        if factor > 1 + _MOST_ROWS:
            break
    rows = rows_at(trajectory, t if ticks is None else np.unique(np.floor(t * ticks * (1 + 1e-15))) / ticks)
    return rows, math.inf


def _run_slower(trajectory: AnyTrajectory, factor: float) -> AnyTrajectory:
    if isinstance(trajectory, RecordedTrajectory):
        path = PiecewisePath(trajectory.path.breaks * factor, trajectory.path.coefficients)
        return replace(trajectory, path=path)
    return replace(trajectory, duration=trajectory.duration * factor)


def _read(t: Array, states: tuple[Array, ...]) -> PiecewisePath:
    """Read rows back, as `load_trajectory` does."""
    make = (PiecewisePath.from_linear, PiecewisePath.from_cubic, PiecewisePath.from_quintic)[len(states) - 1]
    return make(t, *states)


def _excess(trajectory: AnyTrajectory, path: PiecewisePath, asked: LimitMargins, jerk_limit: ArrayLike | None) -> float:
    """Return by which factor a path that was read would have to be slower to keep what the trajectory keeps.

    1 or less: it keeps it. Infinite: being slower would not help.
    """
    read = path_margins(trajectory.robot, path, jerk_limit=jerk_limit)
    if (read.position < np.minimum(asked.position, 0.0) - _POSITION).any():
        return math.inf
    factor = 0.0
    pairs = ((read.velocity, asked.velocity), (read.acceleration, asked.acceleration), (read.jerk, asked.jerk))
    for order, (now, then) in enumerate(pairs, start=1):
        if now is not None and then is not None:
            share = now[np.isfinite(then)] / np.maximum(then[np.isfinite(then)], 1.0)
            factor = max(factor, float(share.max(initial=0.0)) ** (1 / order))
    return factor


def _passed(excess: float) -> tuple[str, ...]:
    by = f"by {excess - 1:.2g} of it" if math.isfinite(excess) else "of position"
    return (f"what is read between its rows may pass a limit that the trajectory keeps, {by}; give more rows",)
