"""Distances of segments and points, in NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def segment_distance(a1: Array, b1: Array, a2: Array, b2: Array) -> Array:
    """Return the distance [m] of segments a1 b1 and a2 b2; points (..., 3) that broadcast against each other.

    The least of five: each end from the other segment, and the two lines where their feet lie inside. Each is
    the distance of two points that are there, so rounding never makes the result too small by more than a
    few units in the last place of the coordinates.
    """
    d1, d2, r = b1 - a1, b2 - a2, a1 - a2
    ends = [
        point_segment_distance(a1, a2, b2),
        point_segment_distance(b1, a2, b2),
        point_segment_distance(a2, a1, b1),
        point_segment_distance(b2, a1, b1),
    ]
    least = np.minimum.reduce(ends)
    d11, d22, d12, c, f = _dot(d1, d1), _dot(d2, d2), _dot(d1, d2), _dot(d1, r), _dot(d2, r)
    determinant = d11 * d22 - d12 * d12
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (d12 * f - c * d22) / determinant, (d11 * f - d12 * c) / determinant
    inside = (s > 0) & (s < 1) & (t > 0) & (t < 1)
    if not inside.any():
        return least
    s, t = np.where(inside, s, 0.0)[..., None], np.where(inside, t, 0.0)[..., None]
    return np.where(inside, np.minimum(least, np.linalg.norm(r + s * d1 - t * d2, axis=-1)), least)


def point_segment_distance(p: Array, a: Array, b: Array) -> Array:
    """Return the distance [m] of points p from segments a b; points (..., 3) that broadcast against each other."""
    d = b - a
    square = _dot(d, d)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(square > 0, _dot(p - a, d) / square, 0.0)
    return np.linalg.norm(p - a - np.clip(share, 0.0, 1.0)[..., None] * d, axis=-1)


def _dot(u: Array, v: Array) -> Array:
    return np.einsum("...i,...i->...", u, v)
