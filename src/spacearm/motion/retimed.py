"""The limits of a motion run by a time law, for every instant."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm._kernel.exact import power, root
from spacearm.motion.curve import greatest
from spacearm.motion.margins import (
    ROUNDING,
    LimitMargins,
    as_jerk_limit,
    greatest_size,
    position_margins,
    with_slips,
)
from spacearm.motion.spline import Motion
from spacearm.motion.timelaw import TimeLaw, over_time
from spacearm.robot import Robot

Array = NDArray[np.float64]

_AT_REST = 1e-13  # of a motion's greatest rate: what is no more is rounding


def fastest_duration_of_law(robot: Robot, motion: Motion, law: TimeLaw, *, jerk_limit: ArrayLike | None = None) -> float:
    """Return the least duration in which a motion may be run by a time law within the limits [s]; 0: it does not move.

    Raises:
        ProblemError: a jerk limit that is no positive number, or for a law whose second derivative jumps on the way.
    """
    shares = law_margins(robot, motion, law, 1.0, jerk_limit=jerk_limit)
    velocity, acceleration = float(shares.velocity.max()), float(shares.acceleration.max())
    jerk = 0.0 if shares.jerk is None else float(shares.jerk.max())
    return max(velocity, float(root(acceleration, 2)), float(root(jerk, 3))) * (1 + ROUNDING)


def law_margins(
    robot: Robot, motion: Motion, law: TimeLaw, duration: float, *, jerk_limit: ArrayLike | None = None
) -> LimitMargins:
    """Return how far a motion run by a time law stays inside the limits, for all t."""
    time = duration if duration > 0 else np.inf
    paths: list[Any] = [over_time(motion, law, 1.0, k) for k in range(1, 3 if jerk_limit is None else 4)]
    slips = [np.zeros(motion.dof), *_slips(motion, law)]
    bounds = [
        with_slips(greatest_size(path, 0), slip) / power(time, k)
        for k, (path, slip) in enumerate(zip(paths, slips, strict=False), 1)
    ]
    jerk = None
    if jerk_limit is not None:
        at = law.coefficients[1:, 0][law.path.jumps(2)[:, 0] != 0]
        moving = np.abs(motion.sample(at, 1)).max(axis=0, initial=0.0) > _AT_REST * greatest(motion, 1)
        jerk = np.where(moving, np.inf, bounds[2] / as_jerk_limit(robot, jerk_limit))
    return LimitMargins(
        position=position_margins(robot, motion),
        velocity=bounds[0] / robot.velocity,
        acceleration=bounds[1] / robot.acceleration,
        jerk=jerk,
    )


def _slips(motion: Motion, law: TimeLaw) -> list[Array]:
    """Return what corners of the law that pass for rounding add at most to accelerations and jerks, both (n,).

    As `PiecewisePath.slips`: they count as made within the shorter of the law's pieces that meet.
    """
    if len(law.breaks) < 3:
        return [np.zeros(motion.dof)] * 2
    s, lengths = law.coefficients[1:, 0], np.diff(law.breaks)
    before, after = np.zeros((2, len(s), 2))  # ds/dx and d2s/dx2 on both sides of each break
    for k in range(2):
        points = law.path.derivative(k + 1).coefficients[:, :, 0]
        before[:, k], after[:, k] = points[:-1, -1], points[1:, 0]
    first, second = motion.sample(s, 1), motion.sample(s, 2)
    per = np.minimum(lengths[1:], lengths[:-1])[:, None]
    v, a = (after - before).T[:, :, None]
    squares = (after[:, :1] + before[:, :1]) * v  # of both rates, the difference
    slight = (law.path.jumps(2) == 0) | (np.abs(first) <= _AT_REST * greatest(motion, 1))  # what jumps is told otherwise
    jerks = np.where(slight, np.abs((second * squares + first * a) / per), 0.0)
    return [np.abs(first * v / per).max(axis=0), jerks.max(axis=0)]


def limit_shares(motion: Motion, limits: list[Array], rates: list[Array]) -> list[Array]:
    """Return what share of each limit a motion uses at samples of a law, one (m, n) for each limit, with its sign.

    Args:
        motion: the path.
        limits: (n,) each: of velocity, acceleration, and jerk if it is limited.
        rates: (m,) each: s, and its derivatives up to the order of the last limit.
    """
    s, *derivatives = rates
    v, a = (rate[:, None] for rate in derivatives[:2])
    first, second = motion.sample(s, 1), motion.sample(s, 2)
    shares = [first * v / limits[0], (second * (v * v) + first * a) / limits[1]]
    if len(limits) > 2:
        shares.append((motion.sample(s, 3) * (v * v * v) + 3 * second * v * a + first * derivatives[2][:, None]) / limits[2])
    return shares


def needed(shares: list[Array]) -> Array:
    """Return the factor of time at which each sample keeps all limits, (m,)."""
    return np.max([root(np.abs(share).max(axis=1), k) for k, share in enumerate(shares, start=1)], axis=0)
