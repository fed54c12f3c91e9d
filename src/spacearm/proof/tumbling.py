"""How errors of the attitude of a tumbling base grow until the end of its motion.

An error phi (a rotation vector, inertial axes) obeys phi' = A phi + what is made on the way, with A = J^-1 [L x] dt/dxi and J
the inertia in inertial axes; and beside that, terms of second order. Of A only what is not the same about all axes makes phi
longer, so on a panel it grows by no more than e^grows. Over many panels that would be far too much: a stick that tumbles turns
its errors rather than making them longer. So A's flow X over each panel is computed, with a bound of its own error, and the
flows are multiplied. docs/certificate.md has the proof.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.ellipses import integrated, on_ellipses

Array = NDArray[np.float64]

_SECOND = 3.0  # of |phi|^2 times the tumble, at most, for |phi| below 1e-3 rad
_SMALL = 1e-3  # [rad]
_FIRST_ORDER = 1.01
_ROUNDING = 1e-12
_MOST_PANELS = 1500  # whose flows are multiplied; of more, the sum of what they grow by is taken
_STEEPEST = 300.0


class Flow(NamedTuple):
    """A's flow over panels p.

    Attributes:
        end: (p, 3, 3) X at each panel's end, 1 where it begins.
        slope: (p, r) of |dX/dxi| on the ellipses, at most; `inside` (p, r) of |X|.
    """

    end: Array
    slope: Array
    inside: Array


def flow_of(A: Array, reach: Array, weight: Array, to_chebyshev: Array) -> Flow:
    """Solve X' = A X on panels by a polynomial that fulfils it in the Gauss points.

    Args:
        A: (p, g, 3, 3) in the points.
        reach, weight, to_chebyshev: (g, g), (g,) and (g, g): integrals from -1 to the points and to 1; the map to coefficients.
    """
    count, points = A.shape[:2]
    system = -np.einsum("ij,pjcd->picjd", reach, A).reshape(count, 3 * points, 3 * points) + np.eye(3 * points)
    X = np.linalg.solve(system, np.tile(np.eye(3), (count, points, 1))).reshape(count, points, 3, 3)
    rates = A @ X
    slope = (to_chebyshev @ rates.reshape(count, points, 9)).reshape(count, points, 9)
    way = np.linalg.norm(integrated(slope), axis=2)
    inside = 1 + on_ellipses(np.concatenate([way.sum(axis=1)[:, None], way], axis=1))
    return Flow(np.eye(3) + np.einsum("g,pgcd->pcd", weight, rates), on_ellipses(np.linalg.norm(slope, axis=2)), inside)


def factors(grows: Array) -> Array:
    """Return by what factor an error made on each panel grows until the end, (p,), by what all that follow make longer."""
    return np.exp(np.minimum(np.cumsum(grows[::-1])[::-1], _STEEPEST))


def factors_of(flow: Flow, off: Array, grows: Array, made: Array, tumble: Array) -> Array:
    """Return the same by the flows (p,), where that is less.

    Args:
        flow: over the panels.
        off: (p,) by how much its end may be wrong.
        grows: (p,) logarithm of the factor of the panel itself.
        made: (p,) errors that are made [rad].
        tumble: (p,) how far the base turns by its momentum, at most [rad].
    """
    crude, count = factors(grows), len(grows)
    if count > _MOST_PANELS:
        return crude
    until, worst = np.zeros((count, 3, 3)), np.ones(count)
    for n, X in enumerate(flow.end):
        until[:n] = X @ until[:n]
        until[n] = np.eye(3)
        worst[: n + 1] = np.maximum(worst[: n + 1], np.linalg.norm(until[: n + 1], axis=(1, 2)))
    later = _FIRST_ORDER * worst * np.exp(grows + grows.max())
    whole = float((later * made).sum())
    small = float((later * (off + _ROUNDING)).sum()) + float((later * tumble).sum()) * _SECOND * 2 * whole
    if not (small <= 0.5 and 2 * whole <= _SMALL):
        return crude
    return np.minimum(crude, later / (1 - small))
