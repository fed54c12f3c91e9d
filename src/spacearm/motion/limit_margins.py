"""How far a trajectory stays inside the joints' limits for every t, and how fast a motion may be run within them.

All bounds are by hulls, so they hold between samples too. There are three kinds of trajectory: a motion run uniformly, a motion
run by a time law, and any path over time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import as_number, as_readonly, dimensions_of
from spacearm.core.errors import ProblemError
from spacearm.core.exact import power, root
from spacearm.motion.piecewise import PiecewisePath, extremes, greatest, widest
from spacearm.motion.spline import Motion, greatest_entries
from spacearm.motion.time_laws import TimeLaw, over_time
from spacearm.robot import Robot
from spacearm.robot.joint_limits import greatest_multipliers

Array = NDArray[np.float64]

ROUNDING = 1e-12  # relative, added to durations: Bezier points have rounding of about 1e-14 of the control points' size
_CLOSELY = 1e-9  # relative excess of bounds: a path that was read back may use its limits in full
_POSITION_TOLERANCE = 1e-10  # of the furthest position: a path may run along a limit
_SLIGHT = 1e-7  # of a derivative's bound: what smaller jumps add to it is left out
_LEAST_JERK = 1e-9  # [rad/s^3 or m/s^3] a smaller limit allows no motion
_AT_REST = 1e-13  # of a motion's greatest rate: slower is rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class LimitMargins(Brief):
    """How far a trajectory stays inside each joint's limits, for all t, by its hulls.

    Attributes:
        position: (n,) least distance to a position limit [rad or m]; negative where it may be broken.
        velocity: (n,) greatest |dq| as a share of the limit; at most 1 if kept.
        acceleration: (n,) greatest |ddq| as a share of the limit; infinite where dq jumps.
        jerk: (n,) greatest |dddq| as a share of the limit, infinite where ddq jumps; None without a jerk limit.
    """

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array | None = None

    @property
    def holds(self) -> bool:
        """Whether all limits are kept for all t."""
        rates = (self.velocity <= 1).all() and (self.acceleration <= 1).all()
        jerk = self.jerk is None or (self.jerk <= 1).all()
        return bool(rates and jerk and (self.position >= -ROUNDING).all())


def fastest_duration(robot: Robot, motion: Motion, *, jerk_limit: ArrayLike | None = None) -> float:
    """Return the least duration of a uniform time law q(t/T) that keeps velocity and acceleration limits [s].

    With s = t/T, dq/dt = q'/T, d2q/dt2 = q''/T^2 and d3q/dt3 = q'''/T^3, so T is the greatest of |q'|/limit,
    sqrt(|q''|/limit) and cbrt(|q'''|/limit), with bounds by their hulls: it holds between any samples too. 0 for a motion
    that does not move.

    Args:
        robot: whose limits.
        motion: the path.
        jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: none.

    Raises:
        ProblemError: a jerk limit that is no positive number.
    """
    return float(fastest_durations(robot, motion.control_points[None], jerk_limit=jerk_limit)[0])


def fastest_durations(robot: Robot, control_points: ArrayLike, *, jerk_limit: ArrayLike | None = None) -> Array:
    """Return `fastest_duration` of many motions at once, (m,) [s].

    Args:
        robot: whose limits.
        control_points: (m, K + 2, n) of the motions [rad or m].
        jerk_limit: as there.
    """
    points = np.asarray(control_points, dtype=np.float64)
    duration = np.zeros(len(points))
    limits = [robot.velocity, robot.acceleration]
    if jerk_limit is not None:
        limits.append(as_jerk_limit(robot, jerk_limit))
    for derivative, limit in enumerate(limits, start=1):
        duration = np.maximum(duration, root(greatest_entries(points / limit, derivative), derivative))
    return duration * (1 + ROUNDING)


def limit_margins(robot: Robot, motion: Motion, duration: float, *, jerk_limit: ArrayLike | None = None) -> LimitMargins:
    """Return how far a motion run uniformly in this time stays inside the limits, for all t."""
    time = duration if duration > 0 else np.inf
    return LimitMargins(
        position=position_margins(robot, motion),
        velocity=greatest(motion, 1) / time / robot.velocity,
        acceleration=greatest(motion, 2) / (time * time) / robot.acceleration,
        jerk=None if jerk_limit is None else greatest(motion, 3) / (time * time * time) / as_jerk_limit(robot, jerk_limit),
    )


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
    paths = [over_time(motion, law, 1.0, k) for k in range(1, 3 if jerk_limit is None else 4)]
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
    """Return what the law's corners that are taken for rounding add at most to accelerations and jerks, both (n,).

    As in `PiecewisePath.slips`, each counts as made within the shorter of the two pieces of the law that meet.
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
    slight = (law.path.jumps(2) == 0) | (np.abs(first) <= _AT_REST * greatest(motion, 1))  # real jumps are reported as infinite
    jerks = np.where(slight, np.abs((second * squares + first * a) / per), 0.0)
    return [np.abs(first * v / per).max(axis=0), jerks.max(axis=0)]


def path_margins(robot: Robot, path: PiecewisePath, *, jerk_limit: ArrayLike | None = None) -> LimitMargins:
    """Return how far a path over time [s] stays inside the limits, for all t, its corners included.

    Jumps that are rounding count by what they add to the next derivative. The path itself must have no jumps.
    """
    velocity_jumps, acceleration_jumps = (path.jumps(k).any(axis=0) for k in (1, 2))
    jerk = None
    if jerk_limit is not None:
        jerk = with_slips(greatest_size(path, 3, tolerance=_CLOSELY), path.slips(2)) / as_jerk_limit(robot, jerk_limit)
        jerk = np.where(velocity_jumps | acceleration_jumps, np.inf, jerk)
    low, high = extremes(path, 0, tolerance=_POSITION_TOLERANCE)
    return LimitMargins(
        position=np.minimum(low - robot.lower, robot.upper - high),
        velocity=greatest_size(path, 1, tolerance=_CLOSELY) / robot.velocity,
        acceleration=np.where(
            velocity_jumps,
            np.inf,
            with_slips(greatest_size(path, 2, tolerance=_CLOSELY), path.slips(1)) / robot.acceleration,
        ),
        jerk=jerk,
    )


def with_slips(bound: Array, slip: Array) -> Array:
    """Return a derivative's bounds (n,) plus what jumps of the one before may add; less than 1e-7 of a bound adds nothing."""
    return np.where(slip > _SLIGHT * bound, bound + slip, bound)


def greatest_size(path: PiecewisePath, derivative: int, *, tolerance: float = 1e-4) -> Array:
    """Return a close bound (n,) of a derivative's size for every t, too large by no more than this share as a rule."""
    low, high = extremes(path, derivative, tolerance=tolerance)
    return np.maximum(-low, high).clip(min=0.0)


def position_margins(robot: Robot, motion: Motion) -> Array:
    """Return a motion's least distance to each joint's position limits, (n,); negative where one may be broken."""
    _, low, high = motion.hulls(0)
    least, most = widest(low, high)
    return np.minimum(least - robot.lower, robot.upper - most)


def as_jerk_limit(robot: Robot, jerk_limit: ArrayLike) -> Array:
    """Check a jerk limit, one number or one for each entry of q, and return it as (n,).

    One number holds for every joint, also for those that mimic others: it is divided by the greatest multiplier of the joints
    that follow an entry of q.

    Raises:
        ProblemError: another number of them, or one that is not above 0.
    """
    given = jerk_limit
    if dimensions_of(jerk_limit) == 0:
        given = as_number("jerk_limit", jerk_limit, ProblemError, at_least=_LEAST_JERK) / greatest_multipliers(robot)
    limit = as_readonly("jerk_limit", given, (robot.dof,), ProblemError, advice="give one number, or one for each joint")
    if not (limit >= _LEAST_JERK).all():
        worst = int(np.argmin(limit))
        raise ProblemError(
            f"jerk_limit of joint '{robot.dof_names[worst]}' is {limit[worst]:g}, expected {_LEAST_JERK:g} or more"
        )
    return limit


def limit_shares(motion: Motion, limits: list[Array], rates: list[Array]) -> list[Array]:
    """Return what share of each limit a motion uses at samples of a law, signed, one array (m, n) for each limit.

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
