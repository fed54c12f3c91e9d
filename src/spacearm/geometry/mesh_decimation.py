"""Fewer triangles for a picture: corners within a cell of a grid become one, placed where the planes around it meet.

That is clustering with quadrics (Rossignac and Borrel 1993, Lindstrom 2000): edges and corners stay sharp, and no point moves
further than the diagonal of its cell. Several meshes share one size of cells, so that all are as fine as each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_WELD = 2**-20  # share of a mesh's size within which corners are one
_TOWARDS_MEAN = 1e-3  # weight of the mean of a cell's corners against the planes, where these leave the point open
_FEWEST = 10  # cells across the smallest mesh
_COARSER = 1.1
_ROUNDS = 40


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles that share corners.

    Attributes:
        points: (k, 3) [m].
        faces: (m, 3) indices of points.
        colors: (m, 4) of the faces, as `geometry.meshes.Mesh` has them; None if they have none.
    """

    points: Array
    faces: NDArray[np.intp]
    colors: Array | None = None


def welded(triangles: Array, colors: Array | None = None) -> Surface:
    """Return triangles (m, 3, 3) with corners that are one where they are at one place; flat ones are left out."""
    corners = triangles.reshape(-1, 3)
    low = corners.min(axis=0)
    size = float((corners.max(axis=0) - low).max()) or 1.0
    first, index = _grouped(corners, low, size * _WELD)
    return _kept(corners[first], index.reshape(-1, 3), colors)


def decimated(surfaces: Sequence[Surface], most: int) -> tuple[list[Surface], float]:
    """Return surfaces with fewer triangles.

    Args:
        surfaces: the surfaces.
        most: how many triangles they may have together; a few more where each would lose its form otherwise.

    Returns:
        The surfaces; and the edge of the cells within which corners became one [m], 0 if there are few enough as they are.
    """
    if sum(len(surface.faces) for surface in surfaces) <= most:
        return list(surfaces), 0.0
    area = sum(float(np.linalg.norm(_normals(surface), axis=1).sum()) / 2 for surface in surfaces)
    cell = 0.4 * float(np.sqrt(2 * area / most)) or 1e-6
    for _ in range(_ROUNDS):
        if sum(_count(surface, cell) for surface in surfaces) <= most:
            break
        cell *= _COARSER
    return [_clustered(surface, cell) for surface in surfaces], cell


def _grouped(points: Array, low: Array, cell: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first of the points in each cell of a grid, and the number of each point's cell."""
    at = np.floor((points - low) / cell + 0.5).astype(np.int64)
    width = at.max(axis=0) + 1
    _, first, index = np.unique((at[:, 0] * width[1] + at[:, 1]) * width[2] + at[:, 2], return_index=True, return_inverse=True)
    return first, index.reshape(-1)


def _kept(points: Array, faces: NDArray[np.intp], colors: Array | None) -> Surface:
    """Leave out faces without area, those that are there twice, and points that no face has."""
    apart = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    _, first = np.unique(np.sort(faces[apart], axis=1), axis=0, return_index=True) if apart.any() else (None, np.zeros(0, int))
    chosen = np.flatnonzero(apart)[np.sort(first)]
    used, index = np.unique(faces[chosen], return_inverse=True)
    return Surface(points[used], index.reshape(-1, 3), None if colors is None else colors[chosen])


def _normals(surface: Surface) -> Array:
    """Return the faces' normals (m, 3), as long as twice their area [m^2]."""
    a, b, c = (surface.points[surface.faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def _cell_of(surface: Surface, cell: float) -> float:
    size = float(np.ptp(surface.points, axis=0).max()) if len(surface.points) else 0.0
    return min(cell, size / _FEWEST) or cell


def _count(surface: Surface, cell: float) -> int:
    if not len(surface.faces):
        return 0
    _, index = _grouped(surface.points, surface.points.min(axis=0), _cell_of(surface, cell))
    faces = index[surface.faces]
    return int(((faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])).sum())


def _clustered(surface: Surface, cell: float) -> Surface:
    if not len(surface.faces):
        return surface
    low, edge = surface.points.min(axis=0), _cell_of(surface, cell)
    first, index = _grouped(surface.points, low, edge)
    count = len(first)
    members = np.bincount(index, minlength=count)
    mean = np.stack([np.bincount(index, surface.points[:, i], count) for i in range(3)], axis=1) / members[:, None]
    points = _where_planes_meet(surface, index, mean)
    middle = low + np.round((mean - low) / edge) * edge
    within = (np.abs(points - middle) <= edge / 2 * (1 + 1e-9)).all(axis=1) & (members > 1)
    points = np.where(within[:, None], points, np.where((members == 1)[:, None], surface.points[first], mean))
    return _kept(points, index[surface.faces], surface.colors)


def _where_planes_meet(surface: Surface, index: NDArray[np.intp], mean: Array) -> Array:
    """Return for each cell the point nearest to the planes of the faces with a corner in it, weighted by area, (cells, 3)."""
    normals, count = _normals(surface), len(mean)
    A, b = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for corner in range(3):
        cell = index[surface.faces[:, corner]]
        away = ((surface.points[surface.faces[:, 0]] - mean[cell]) * normals).sum(axis=1)  # from the cell's mean to the plane
        for i in range(3):
            b[:, i] += np.bincount(cell, away * normals[:, i], count)
            for j in range(i, 3):
                A[:, i, j] += np.bincount(cell, normals[:, i] * normals[:, j], count)
    A = A + np.transpose(np.triu(A, 1), (0, 2, 1))
    weight = _TOWARDS_MEAN * np.trace(A, axis1=1, axis2=2)
    weight = np.where(weight > 0, weight, 1.0)
    return mean + np.linalg.solve(A + weight[:, None, None] * np.eye(3), b[..., None])[..., 0]
