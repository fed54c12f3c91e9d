"""The time-optimal law of a motion, with continuous acceleration and within the limits for all t.

Two methods look for a law, and the quicker result is taken. Both laws are cubic B-splines s(x) over x = t/T in [0, 1], so the
acceleration is continuous; control points that never fall make a law that never turns back (de Boor, A Practical Guide to
Splines, 2001).

- toppra's law (Pham and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis, 2018) has
  accelerations that jump, and keeps the limits at its grid points only. A spline whose control points are the law's own values
  averages it over neighbouring knots and stays close to the limits. Where samples show that it breaks one, it is given more
  time there. Our motions leave and reach their ends with q' = q'' = 0, where a law in s could run infinitely fast, so toppra
  is given the path over v = 10 s^3 - 15 s^4 + 6 s^5, in which it cannot.
- Sequential linear programming also keeps a limit of the jerk, which toppra does not know. The shares of the limits that the
  law uses at samples are linearised in its control points. A linear programme finds the points that shorten the whole within a
  trust region. It begins at s = x with few pieces, and halves them level by level.
"""

from __future__ import annotations

from functools import partial
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import require_kind
from spacearm.core.errors import ProblemError
from spacearm.core.exact import power, product, sines
from spacearm.core.extras import require_extra
from spacearm.core.records import whole
from spacearm.dynamics import Momentum
from spacearm.dynamics.base_models import Base
from spacearm.motion.limit_margins import as_jerk_limit, fastest_duration, fastest_duration_of_law, limit_shares, needed
from spacearm.motion.piecewise import differences, weights
from spacearm.motion.spline import Motion, cox_de_boor
from spacearm.motion.time_laws import TimeLaw
from spacearm.motion.trajectory import Trajectory
from spacearm.robot import Robot

Array = NDArray[np.float64]

_MOST = 1000  # grid points or pieces
_INSTANT = 1e-6  # [s] of a quicker motion no time can be saved
_SAMPLES = 4  # of each piece of a law, at which its limits are looked at
_HALVINGS = 54  # of a bisection in [0, 1], to the last bit of float64
_CUBIC = 3  # degree of the splines

# The smoothing of toppra's law
_EXCESS = 0.01  # of toppra's own duration: smoothing that costs more is tried with more pieces
_PASSES = 2  # in which time is given where a limit is broken; a third shortened no motion that was measured
_NEAR_END = 1e-4  # of s: nearer to an end, the path's derivatives over v are those here

# The linear programmes
_REFINED_PIECES = 32  # of their law
_REFINED_ALONE = 64  # where toppra finds no law
_COARSEST = 8  # pieces of the first level
_STEPS = 10  # linear programmes on each level, at most
_NEAR = 0.7  # of a limit: samples that use less are left out of a linear programme
_LEAST_GAIN = 1e-4  # of the duration: a linear programme that promises less ends the level
_LEAST_TRUST = 1e-3  # of the distance between control points: a smaller trust region ends the level
_LEAST_RATE = 1e-3  # least ds/dx at the control points, where the uniform law has 1


def time_optimal(
    robot: Robot,
    motion: Motion,
    *,
    jerk_limit: ArrayLike | None = None,
    gridpoints: int = 100,
    pieces: int = 64,
    base: Base | None = None,
    base_start: ArrayLike | None = None,
    momentum: Momentum | None = None,
) -> Trajectory:
    """Return the quickest trajectory along a motion, with continuous acceleration and within the limits for all t.

    toppra's law is made smooth, checked between samples by hulls, and slowed down by what is missing. With a jerk limit a
    sequence of linear programmes looks for a better law. The result is never slower than the uniform law.

    Args:
        robot: whose limits.
        motion: the path.
        jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: none, though accelerations are continuous.
        gridpoints: intervals of toppra's grid.
        pieces: of the smooth law, or up to four times as many where it needs them to come close to toppra's.
        base, base_start, momentum: of the trajectory; they change no joint's limits.

    Returns:
        The trajectory; its `notes` say how much time was saved, and lost by smoothing.

    Raises:
        ProblemError: the motion does not fit the robot, a jerk limit that is no positive number, or a base that cannot be.
        RobotError: a floating base of a robot whose masses cannot be.
        SettingsError: a number of grid points or pieces that is none; or toppra is not installed.
    """
    require_extra("toppra", "the time-optimal law")
    whole("gridpoints", gridpoints, at_least=8, at_most=_MOST)
    whole("pieces", pieces, at_least=8, at_most=_MOST)
    require_kind("motion", motion, Motion, ProblemError, advice="make one with Motion([start, ..., goal])")
    trajectory = partial(Trajectory, robot, motion, base=base, base_start=base_start, momentum=momentum)
    trajectory()  # refuses a motion that does not fit the robot
    slow = fastest_duration(robot, motion, jerk_limit=jerk_limit)
    if slow < _INSTANT:
        notes = ("the uniform time law: it takes no time worth saving",)
        return trajectory(duration=slow, notes=notes)
    limits = [robot.velocity, robot.acceleration]
    if jerk_limit is not None:
        limits.append(as_jerk_limit(robot, jerk_limit))
    laws: list[tuple[TimeLaw, str]] = []
    smoothed = toppra_law(motion, limits, slow, gridpoints=gridpoints, pieces=pieces)
    if smoothed is not None:
        laws.append((smoothed[0], "toppra's law made smooth"))
    if jerk_limit is not None or smoothed is None:
        most = _REFINED_PIECES if smoothed is not None else _REFINED_ALONE
        laws.append((refined_law(motion, limits, slow, pieces=most), "a smooth law by linear programmes"))
    timed = [(fastest_duration_of_law(robot, motion, law, jerk_limit=jerk_limit), law, what) for law, what in laws]
    duration, law, what = min(timed, key=lambda entry: entry[0])
    if duration >= slow:
        return trajectory(duration=slow, notes=("the uniform time law: no quicker one was found",))
    note = (
        f"{what}: {duration:.6g} s, within the limits for all t; "
        f"{(1 - duration / slow) * 100:.3g} % less than the uniform law's {slow:.6g} s"
    )
    if smoothed is not None and jerk_limit is None:
        excess = (duration / smoothed[1] - 1) * 100
        note += f", {abs(excess):.2g} % {'more' if excess > 0 else 'less'} than toppra's, which heeds them at grid points only"
    return trajectory(duration=duration, time_law=law, notes=(note,))


def toppra_law(
    motion: Motion, limits: list[Array], unit: float, *, gridpoints: int, pieces: int
) -> tuple[TimeLaw, float] | None:
    """Return a smooth law near toppra's, and how long toppra's own takes [s]; None where toppra finds none.

    Args:
        motion: the path.
        limits: (n,) each: of velocity, acceleration, and jerk if it is limited (only the smoothing heeds it).
        unit: a duration of the right size [s], by which toppra's numbers are scaled.
        gridpoints: intervals of toppra's grid.
        pieces: of the law at first; doubled up to twice while smoothing costs more than 1 %.
    """
    scaled = [limit * unit**k for k, limit in enumerate(limits, start=1)]
    found = _solved(motion, scaled, gridpoints)
    if found is None:
        return None
    optimum = float(found[0][-1])
    duration, law = _smoothed(motion, scaled, found, pieces)
    for doubled in (2 * pieces, 4 * pieces):
        if duration <= (1 + _EXCESS) * optimum:
            break
        again, finer = _smoothed(motion, scaled, found, doubled)
        if again >= duration:
            break
        duration, law = again, finer
    return law, optimum * unit


def _smoothed(motion: Motion, limits: list[Array], found: tuple[Array, Array, Array], pieces: int) -> tuple[float, TimeLaw]:
    """Return how long a smooth law near toppra's takes by its samples, and the law."""
    t, v, rate = found
    original = float(t[-1]) * _towards_ends(pieces)
    knots: Array = original.copy()
    best: tuple[float, Array, Array] | None = None
    for turn in range(_PASSES + 1):
        total = float(knots[-1])
        x = knots / total
        at = np.interp(abscissae(x) * total, knots, original)
        points = _s_of_v(_v_at(at, t, v, rate))
        points[0], points[-1] = 0.0, 1.0
        ratio = _ratios(motion, limits, x, points, total)
        duration = float(ratio.max() * total)
        if best is None or duration < best[0]:
            best = duration, x, points
        if turn < _PASSES:
            knots = np.concatenate([[0.0], np.cumsum(np.diff(knots) * _drawn_out(ratio))])
    assert best is not None
    return best[0], cubic_law(best[1], best[2])


class _PathOverV:
    """The motion as toppra takes it: q(s(v)) and its derivatives with respect to v, each joint in a unit of its own."""

    def __init__(self, motion: Motion, unit: Array) -> None:
        self._motion = Motion((motion.control_points - motion.control_points[0]) / unit)
        self.dof = motion.dof
        self.path_interval = np.array([0.0, 1.0])

    def __call__(self, v: ArrayLike, order: int = 0) -> Array:
        s = _s_of_v(np.asarray(v, dtype=np.float64))
        if order == 0:
            return self._motion.sample(s)
        s = np.clip(s, _NEAR_END, 1 - _NEAR_END)
        first, second = 30 * (s * (1 - s)) ** 2, 60 * s * (1 - s) * (1 - 2 * s)  # dv/ds and its derivative
        tangent = self._motion.sample(s, 1) / first[..., None]
        if order == 1:
            return tangent
        return (self._motion.sample(s, 2) - tangent * second[..., None]) / first[..., None] ** 2


def _solved(motion: Motion, limits: list[Array], gridpoints: int) -> tuple[Array, Array, Array] | None:
    """Return toppra's law: times, v at them, and dv/dt at them, each (gridpoints + 1,)."""
    from toppra.algorithm import TOPPRA  # pyright: ignore[reportMissingTypeStubs]
    from toppra.constraint import (  # pyright: ignore[reportMissingTypeStubs]
        DiscretizationType,
        JointAccelerationConstraint,
        JointVelocityConstraint,
    )

    v = _towards_ends(gridpoints)
    constraints = [
        JointVelocityConstraint(limits[0] / limits[1]),
        JointAccelerationConstraint(np.ones(motion.dof), discretization_scheme=DiscretizationType.Interpolation),
    ]
    try:
        solver = TOPPRA(constraints, _PathOverV(motion, limits[1]), gridpoints=v, solver_wrapper="seidel")
        rate = solver.compute_parameterization(0.0, 0.0)[1]
    except Exception:  # its solver may fail on extreme numbers; there are other laws
        return None
    if rate is None or not np.isfinite(rate).all() or (rate[1:] + rate[:-1] <= 0).any():
        return None
    return np.concatenate([[0.0], np.cumsum(2 * np.diff(v) / (rate[1:] + rate[:-1]))]), v, rate


def _towards_ends(count: int) -> Array:
    """Return `count` + 1 places from 0 to 1, finer towards both ends: equal times under constant acceleration."""
    return (1 - sines(np.pi * np.arange(count + 1) / count)[1]) / 2


def _v_at(time: Array, t: Array, v: Array, rate: Array) -> Array:
    """Return v at times; between grid points its second derivative is constant."""
    i = np.clip(np.searchsorted(t, time, side="right") - 1, 0, len(t) - 2)
    after = time - t[i]
    return np.clip(v[i] + rate[i] * after + (rate[i + 1] - rate[i]) / (t[i + 1] - t[i]) * after**2 / 2, 0.0, 1.0)


def _s_of_v(v: Array) -> Array:
    """Invert v = 10 s^3 - 15 s^4 + 6 s^5 by halving."""
    low, high = np.zeros_like(v), np.ones_like(v)
    for _ in range(_HALVINGS):
        s = (low + high) / 2
        above = s * s * s * (10 - 15 * s + 6 * s * s) >= v
        low, high = np.where(above, low, s), np.where(above, s, high)
    return high


def _ratios(motion: Motion, limits: list[Array], knots: Array, points: Array, duration: float) -> Array:
    """Return by what factor each piece of the law is too quick, (pieces,), by samples; below 1: it might be quicker."""
    share = np.arange(_SAMPLES + 1) / _SAMPLES
    law, lengths = bezier_points(knots, points)[:, :, None], np.diff(knots)[:, None]
    rates: list[Array] = []
    for k in range(len(limits) + 1):
        derivative = differences(law, k)[:, :, 0] / power(lengths, k)
        rates.append(product(derivative, weights(derivative.shape[1] - 1, share).T).ravel())
    needs = needed(limit_shares(motion, limits, rates)) / duration
    return needs.reshape(-1, _SAMPLES + 1).max(axis=1)


def _drawn_out(ratio: Array) -> Array:
    """Return the factor for the time of each piece: what it and its neighbours need, smoothed."""
    wide = np.pad(np.maximum(ratio, 1.0), 2, mode="edge")
    widest = np.maximum(np.maximum(wide[:-2], wide[2:]), wide[1:-1])
    return (widest[:-2] + 2 * widest[1:-1] + widest[2:]) / 4


def refined_law(motion: Motion, limits: list[Array], unit: float, *, pieces: int) -> TimeLaw:
    """Return a law near the quickest smooth one.

    Args:
        motion: the path; it must move.
        limits: (n,) each: of velocity, acceleration, and jerk if it is limited.
        unit: a duration of the right size [s], by which the numbers are scaled.
        pieces: of the law, about; 8 times a power of 2.
    """
    scaled = [limit * unit**k for k, limit in enumerate(limits, start=1)]
    knots = np.arange(_COARSEST + 1) / _COARSEST
    points = abscissae(knots)
    while True:
        points = _Level(motion, scaled, knots).improved(points)
        if 2 * (len(knots) - 1) > pieces:
            return cubic_law(knots, points)
        knots, points = halved(knots, points)
        points = np.maximum.accumulate(points)  # rounding may have let them fall
        points[0], points[-1] = 0.0, 1.0


class _Level:
    """The linear programmes over one set of knots, with fixed samples."""

    def __init__(self, motion: Motion, limits: list[Array], knots: Array) -> None:
        inside = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        x = np.sort(np.concatenate([knots, (knots[:-1, None] + np.diff(knots)[:, None] * inside).ravel()]))
        self._motion, self._limits = motion, limits
        self._basis = [cubic_basis(knots, x, k) for k in range(4)]
        self._least_steps = _LEAST_RATE * np.diff(abscissae(knots))

    def improved(self, points: Array) -> Array:
        """Return better control points, or the same."""
        trust = 0.5
        shares = self._shares(points)
        duration = float(needed(shares).max())
        for _ in range(_STEPS):
            step, promised = self._step(points, shares, duration, trust)
            if step is None or promised < _LEAST_GAIN:
                break
            tried = self._shares(points + step)
            quicker = float(needed(tried).max())
            gained = (1 - quicker / duration) / promised
            if gained > 0:
                points, shares, duration = points + step, tried, quicker
            trust *= 2.0 if gained > 0.7 else 1.0 if gained > 0.3 else 0.5 if gained > 0 else 0.25
            if trust < _LEAST_TRUST:
                break
            trust = min(trust, 1.0)
        return points

    def _shares(self, points: Array) -> list[Array]:
        return limit_shares(self._motion, self._limits, [product(basis, points) for basis in self._basis])

    def _step(self, points: Array, shares: list[Array], duration: float, trust: float) -> tuple[Array | None, float]:
        """Solve one linear programme.

        Returns:
            How to move the control points, and by what share that shortens the duration to first order.
        """
        from scipy.optimize import linprog  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

        count = len(points)
        rows: list[Array] = []
        bounds: list[Array] = []
        for order, (share, slopes) in enumerate(zip(shares, self._slopes(points), strict=True), start=1):
            unit = float(power(duration, order))
            scaled = share / unit
            sample, joint = np.nonzero(np.abs(scaled) > _NEAR)
            sign = np.sign(scaled[sample, joint])[:, None] / unit
            row = sum(slope[sample, joint, None] * self._basis[k][sample] for k, slope in enumerate(slopes))
            # |share| + d|share| <= (1 + e)^order, to first order; the last variable is e
            rows.append(np.hstack([sign * row, np.full((len(sample), 1), -float(order))]))
            bounds.append(1 - np.abs(scaled[sample, joint]))
        rising = np.zeros((count - 1, count + 1))
        rising[np.arange(count - 1), np.arange(count - 1)] = 1
        rising[np.arange(count - 1), np.arange(1, count)] = -1
        rows.append(rising)
        bounds.append(np.maximum(np.diff(points) - self._least_steps, 0.0))
        reach = trust * np.gradient(points)
        reach[[0, -1]] = 0.0
        found = linprog(
            np.eye(count + 1)[-1],
            A_ub=np.vstack(rows),
            b_ub=np.concatenate(bounds),
            bounds=[*((-r, r) for r in reach), (-1.0, 1.0)],
            method="highs-ds",
        )
        solution = cast("Array | None", found.x)  # pyright: ignore[reportUnknownMemberType]
        return (None, 0.0) if solution is None else (solution[:-1], -float(solution[-1]))

    def _slopes(self, points: Array) -> list[list[Array]]:
        """Return the derivatives of each order's shares with respect to s, its rate, and so on, each (samples, n)."""
        s, v, a, j = (product(basis, points) for basis in self._basis)
        q1, q2, q3, q4 = (self._motion.sample(s, k) for k in range(1, 5))
        v, a, j = v[:, None], a[:, None], j[:, None]
        slopes = [
            [q2 * v, q1],
            [q3 * (v * v) + q2 * a, 2 * q2 * v, q1],
            [q4 * (v * v * v) + 3 * q3 * v * a + q2 * j, 3 * q3 * (v * v) + 3 * q2 * a, 3 * q2 * v, q1],
        ]
        return [[slope / limit for slope in some] for some, limit in zip(slopes, self._limits, strict=False)]


def abscissae(knots: Array) -> Array:
    """Return the Greville abscissae, (m + 3,): with these as control points s = x.

    Args:
        knots: (m + 1,) increasing, each once.
    """
    all_knots = _repeated(knots, _CUBIC)
    return np.array([all_knots[i + 1 : i + _CUBIC + 1].mean() for i in range(len(knots) + _CUBIC - 1)])


def cubic_basis(knots: Array, x: Array, derivative: int = 0) -> Array:
    """Return the weight of each control point in s(x) or a derivative, (len(x), m + 3)."""
    columns = np.eye(len(knots) + _CUBIC - 1)
    all_knots = _repeated(knots, _CUBIC)
    for degree in range(_CUBIC, _CUBIC - derivative, -1):
        columns = degree * np.diff(columns, axis=0) / (all_knots[degree + 1 : -1] - all_knots[1 : -degree - 1])[:, None]
        all_knots = all_knots[1:-1]
    return product(cox_de_boor(x, all_knots, _CUBIC - derivative), columns)


def cubic_law(knots: Array, points: Array) -> TimeLaw:
    """Return the time law of knots (m + 1,) from 0 to 1 and control points (m + 3,) that rise from 0 to 1."""
    coefficients = bezier_points(knots, points)
    coefficients[1:, 0] = coefficients[:-1, -1]
    coefficients[0, 0], coefficients[-1, -1] = 0.0, 1.0
    return TimeLaw(knots, coefficients)


def bezier_points(knots: Array, points: Array) -> Array:
    """Return the Bernstein coefficients of each piece of a law, (m, 4)."""
    ends, piece = (knots[:-1], knots[1:]), np.arange(len(knots) - 1)
    return np.stack(
        [_polar_form(knots, points, piece, [ends[k < later] for k in range(_CUBIC)]) for later in range(_CUBIC + 1)], axis=1
    )


def _polar_form(knots: Array, points: Array, piece: NDArray[np.intp], arguments: list[Array]) -> Array:
    """Return the polar form of pieces (k,) at three arguments, each (k,), by de Boor's averages."""
    all_knots = _repeated(knots, _CUBIC)
    values = [points[piece + i] for i in range(_CUBIC + 1)]
    for turn, x in enumerate(arguments, start=1):
        for i in range(_CUBIC, turn - 1, -1):
            low, high = all_knots[piece + i], all_knots[piece + i + _CUBIC + 1 - turn]
            values[i] = ((high - x) * values[i - 1] + (x - low) * values[i]) / (high - low)
    return values[-1]


def halved(knots: Array, points: Array) -> tuple[Array, Array]:
    """Return the same law with one more knot in the middle of each piece."""
    finer = np.sort(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))
    # A control point is the polar form, at its three knots, of any piece that depends on it.
    piece = np.clip(np.searchsorted(knots, abscissae(finer), side="right") - 1, 0, len(knots) - 2)
    repeated = _repeated(finer, _CUBIC)
    return finer, _polar_form(knots, points, piece, [repeated[1 + i : 1 + i + len(piece)] for i in range(_CUBIC)])


def _repeated(knots: Array, degree: int) -> Array:
    return np.concatenate([np.repeat(knots[0], degree), knots, np.repeat(knots[-1], degree)])
