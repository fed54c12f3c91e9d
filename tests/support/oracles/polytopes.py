"""Where points are against convex polytopes, by SciPy: the planes of its hulls, and its least squares for flat ones."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from spacearm.geometry import Polytope


def outside_polytopes(points: np.ndarray, polytopes: Iterable[Polytope]) -> np.ndarray:
    """Lower bounds of how far points (n, 3) are outside of the nearest polytope and its rounding, below 0 within, (n,) [m]."""
    out = np.full(len(points), np.inf)
    for polytope in polytopes:
        try:
            planes = ConvexHull(polytope.vertices).equations
            away = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1)
        except QhullError:  # flat
            size = float(np.ptp(points, axis=0).max())
            away = np.linalg.norm(points - nearest_in(polytope.vertices, points), axis=1) - 1e-6 * size
        out = np.minimum(out, away - polytope.rounding)
    return out


def nearest_in(vertices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The convex combinations of vertices (k, 3) that are nearest to points (n, 3), to about 1e-6 of their extent."""
    middle = vertices.mean(axis=0)
    size = float(np.ptp(np.concatenate([vertices, points]), axis=0).max()) or 1.0
    A = np.vstack([(vertices - middle).T / size, np.full(len(vertices), 1e3)])
    found = []
    for point in points:
        x = nnls(A, np.append((point - middle) / size, 1e3))[0]
        found.append(vertices.T @ (x / x.sum()))
    return np.array(found)
