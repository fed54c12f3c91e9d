"""The time-optimal law by toppra, made smooth.

toppra's law (Pham and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis, 2018) has
accelerations that jump, and keeps the limits at its grid points only. A cubic spline whose control points are the law's own
values averages it over neighbouring knots, so its acceleration is continuous and stays close to the limits; where samples
show that it breaks one, time is drawn out there.

Our motions leave and reach their ends with q' = q'' = 0, where a law in s could run infinitely fast. So toppra sees the path
over v = 10 s^3 - 15 s^4 + 6 s^5, in which it does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm._kernel.exact import power, product, sines
from spacearm.motion.bernstein import differences, weights
from spacearm.motion.cubic_law import abscissae, bezier_points, cubic_law
from spacearm.motion.retimed import limit_shares, needed
from spacearm.motion.spline import Motion
from spacearm.motion.timelaw import TimeLaw

Array = NDArray[np.float64]

_EXCESS = 0.01  # of toppra's own duration
_PASSES = 2  # a third gains nothing
_SAMPLES = 4  # of each piece of the law
_NEAR_END = 1e-4  # in s: closer, the path's derivatives over v are those here
_HALVINGS = 54


def toppra_law(
    motion: Motion, limits: list[Array], unit: float, *, gridpoints: int, pieces: int
) -> tuple[TimeLaw, float] | None:
    """Return a smooth law near toppra's, and how long toppra's own takes [s]; None where toppra finds none.

    Args:
        motion: the path.
        limits: (n,) each: of velocity, acceleration, and jerk if it is limited (only the smoothing heeds it).
        unit: a duration of the right size [s], by which the numbers toppra works with are scaled.
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
    original = t[-1] * _towards_ends(pieces)
    knots = original.copy()
    best: tuple[float, Array, Array] | None = None
    for turn in range(_PASSES + 1):
        x = knots / knots[-1]
        at = np.interp(abscissae(x) * knots[-1], knots, original)
        points = _s_of_v(_v_at(at, t, v, rate))
        points[0], points[-1] = 0.0, 1.0
        ratio = _ratios(motion, limits, x, points, knots[-1])
        duration = float(ratio.max() * knots[-1])
        if best is None or duration < best[0]:
            best = duration, x, points
        if turn < _PASSES:
            knots = np.concatenate([[0.0], np.cumsum(np.diff(knots) * _drawn_out(ratio))])
    assert best is not None
    return best[0], cubic_law(best[1], best[2])


class _PathOverV:
    """The motion as toppra asks for it: q(s(v)) and its derivatives with respect to v, each joint in a unit of its own."""

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
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint

    v = _towards_ends(gridpoints)
    constraints = [
        JointVelocityConstraint(limits[0] / limits[1]),
        JointAccelerationConstraint(np.ones(motion.dof), discretization_scheme=DiscretizationType.Interpolation),
    ]
    try:
        solver = TOPPRA(constraints, _PathOverV(motion, limits[1]), gridpoints=v, solver_wrapper="seidel")
        rate = solver.compute_parameterization(0.0, 0.0)[1]
    except Exception:  # whatever its solver makes of numbers it cannot handle; there are other laws
        return None
    if rate is None or not np.isfinite(rate).all() or (rate[1:] + rate[:-1] <= 0).any():
        return None
    return np.concatenate([[0.0], np.cumsum(2 * np.diff(v) / (rate[1:] + rate[:-1]))]), v, rate


def _towards_ends(count: int) -> Array:
    """Return 0 to 1 in so many steps, finer towards both ends: even in time under constant acceleration."""
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
    rates = []
    for k in range(len(limits) + 1):
        derivative = differences(law, k)[:, :, 0] / power(lengths, k)
        rates.append(product(derivative, weights(derivative.shape[1] - 1, share).T).ravel())
    needs = needed(limit_shares(motion, limits, rates)) / duration
    return needs.reshape(-1, _SAMPLES + 1).max(axis=1)


def _drawn_out(ratio: Array) -> Array:
    """Return the factor for each piece's time: what it and its neighbours need, without steps."""
    wide = np.pad(np.maximum(ratio, 1.0), 2, mode="edge")
    widest = np.maximum(np.maximum(wide[:-2], wide[2:]), wide[1:-1])
    return (widest[:-2] + 2 * widest[1:-1] + widest[2:]) / 4
