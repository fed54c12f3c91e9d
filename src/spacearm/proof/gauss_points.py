"""Gauss points on a panel: maps from values there to coefficients and integrals, the same for all panels."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from spacearm.motion.piecewise import weights
from spacearm.proof.polynomial_bounds import fall, integrated

Array = NDArray[np.float64]


class Gauss(NamedTuple):
    """g Gauss points on [-1, 1].

    Attributes:
        weight: (g,) of the points.
        to_legendre, to_chebyshev: (g, g) from values in the points to the coefficients of the polynomials of that name.
        to_integral: (g, g) from values in the points to the integral's Chebyshev coefficients 1 to g.
        integrals: (g, g) from values in the points to the integrals from -1 to each point.
        fall: (r,) the error of interpolation on each ellipse, over the greatest value there.
    """

    weight: Array
    to_legendre: Array
    to_chebyshev: Array
    to_integral: Array
    integrals: Array
    fall: Array


@lru_cache(maxsize=8)
def gauss(points: int) -> Gauss:
    """Return the Gauss points of a number, and what is computed with them."""
    xi, weight = _points(points)
    to_legendre: Array = np.linalg.inv(legendre.legvander(xi, points - 1)).astype(np.float64)
    to_chebyshev: Array = np.linalg.inv(chebyshev.chebvander(xi, points - 1)).astype(np.float64)
    to_integral, integrals = integrated(to_chebyshev[None])[0], _integrals(xi, points) @ to_legendre
    return Gauss(weight, to_legendre, to_chebyshev, to_integral, integrals, fall(points))


def _points(count: int) -> tuple[Array, Array]:
    """Return the Gauss points and their weights, (g,) each."""
    xi, weight = (np.asarray(column, dtype=np.float64) for column in legendre.leggauss(count))
    return xi, weight


@lru_cache(maxsize=64)
def in_points(degree: int, count: int) -> Array:
    """Return the Bernstein polynomials in the Gauss points, (g, d + 1)."""
    return weights(degree, (1 + _points(count)[0]) / 2)


def _integrals(xi: Array, count: int) -> Array:
    """Return the integrals of the Legendre polynomials 0 to count - 1 from -1 to xi (r,), (r, count)."""
    values = legendre.legvander(xi, count)
    out = np.empty((len(xi), count))
    out[:, 0] = xi + 1.0
    k = np.arange(1, count)
    out[:, 1:] = (values[:, 2:] - values[:, :-2]) / (2 * k + 1)
    return out
