"""A quick smooth law by sequential linear programming, for limits on jerk too, which toppra does not know.

The law is a cubic spline; the shares of the limits that it uses at samples are linearised in its control points, and a
linear programme asks for the points that shorten the whole within a trust region. It begins at s = x with few pieces and
halves them, level by level.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import power, product
from spacearm.motion.cubic_law import abscissae, cubic_basis, cubic_law, halved
from spacearm.motion.retimed import limit_shares, needed
from spacearm.motion.spline import Motion
from spacearm.motion.timelaw import TimeLaw

Array = NDArray[np.float64]

_COARSEST = 8
_STEPS = 10  # linear programmes on each level
_SAMPLES = 4  # of each piece of the law, and its knots
_NEAR = 0.7  # of a limit: what uses less cannot matter within the trust region
_LEAST_GAIN = 1e-4
_LEAST_TRUST = 1e-3
_LEAST_RATE = 1e-3  # of s, of what it is when uniform


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
        points = np.maximum.accumulate(points)  # what rounding may have let fall
        points[0], points[-1] = 0.0, 1.0


class _Level:
    """The linear programmes over one set of knots."""

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
            kept = (1 - quicker / duration) / promised
            if kept > 0:
                points, shares, duration = points + step, tried, quicker
            trust *= 2.0 if kept > 0.7 else 1.0 if kept > 0.3 else 0.5 if kept > 0 else 0.25
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
        from scipy.optimize import linprog

        count = len(points)
        rows, bounds = [], []
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
        return (None, 0.0) if found.x is None else (found.x[:-1], -float(found.x[-1]))

    def _slopes(self, points: Array) -> list[list[Array]]:
        """Return the derivatives of each order's shares with respect to s, its rate, and so on, each (samples, n)."""
        s, v, a, j = (product(basis, points) for basis in self._basis)
        q = [None, *(self._motion.sample(s, k) for k in range(1, 5))]
        v, a, j = v[:, None], a[:, None], j[:, None]
        slopes = [
            [q[2] * v, q[1]],
            [q[3] * (v * v) + q[2] * a, 2 * q[2] * v, q[1]],
            [q[4] * (v * v * v) + 3 * q[3] * v * a + q[2] * j, 3 * q[3] * (v * v) + 3 * q[2] * a, 3 * q[2] * v, q[1]],
        ]
        return [[slope / limit for slope in some] for some, limit in zip(slopes, self._limits, strict=False)]
