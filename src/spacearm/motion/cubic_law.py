"""Time laws with continuous acceleration: cubic B-splines s(x) over [0, 1], by their knots and control points.

Control points that never fall make a law that never turns back. De Boor, A Practical Guide to Splines, 2001.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import product
from spacearm.motion.spline import cox_de_boor
from spacearm.motion.timelaw import TimeLaw

Array = NDArray[np.float64]

_DEGREE = 3


def abscissae(knots: Array) -> Array:
    """Return where each control point has its say, (m + 3,): with these as control points s = x.

    Args:
        knots: (m + 1,) increasing, each once.
    """
    all_knots = _repeated(knots, _DEGREE)
    return np.array([all_knots[i + 1 : i + _DEGREE + 1].mean() for i in range(len(knots) + _DEGREE - 1)])


def cubic_basis(knots: Array, x: Array, derivative: int = 0) -> Array:
    """Return what each control point contributes to s(x) or a derivative, (len(x), m + 3)."""
    columns = np.eye(len(knots) + _DEGREE - 1)
    all_knots = _repeated(knots, _DEGREE)
    for degree in range(_DEGREE, _DEGREE - derivative, -1):
        columns = degree * np.diff(columns, axis=0) / (all_knots[degree + 1 : -1] - all_knots[1 : -degree - 1])[:, None]
        all_knots = all_knots[1:-1]
    return product(cox_de_boor(x, all_knots, _DEGREE - derivative), columns)


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
        [_blossom(knots, points, piece, [ends[k < later] for k in range(_DEGREE)]) for later in range(_DEGREE + 1)], axis=1
    )


def _blossom(knots: Array, points: Array, piece: NDArray[np.intp], arguments: list[Array]) -> Array:
    """Return the polar form of pieces (k,) at three arguments, each (k,), by de Boor's averages."""
    all_knots = _repeated(knots, _DEGREE)
    values = [points[piece + i] for i in range(_DEGREE + 1)]
    for turn, x in enumerate(arguments, start=1):
        for i in range(_DEGREE, turn - 1, -1):
            low, high = all_knots[piece + i], all_knots[piece + i + _DEGREE + 1 - turn]
            values[i] = ((high - x) * values[i - 1] + (x - low) * values[i]) / (high - low)
    return values[-1]


def halved(knots: Array, points: Array) -> tuple[Array, Array]:
    """Return the same law with a knot more in the middle of each piece."""
    finer = np.sort(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))
    # A control point is the polar form, at its three knots, of any piece that it has a say in.
    piece = np.clip(np.searchsorted(knots, abscissae(finer), side="right") - 1, 0, len(knots) - 2)
    repeated = _repeated(finer, _DEGREE)
    return finer, _blossom(knots, points, piece, [repeated[1 + i : 1 + i + len(piece)] for i in range(_DEGREE)])


def _repeated(knots: Array, degree: int) -> Array:
    return np.concatenate([np.repeat(knots[0], degree), knots, np.repeat(knots[-1], degree)])
