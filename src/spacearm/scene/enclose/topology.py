"""Which parts of a mesh are closed, so that they have an inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array, Indices
from spacearm.scene.enclose.inside import Inside


def inside_of(triangles: Array) -> Inside | None:
    """Return what tells the inside of the closed parts of a mesh; None if no part is closed.

    Corners at the same place are one. A part, faces joined by edges, is closed if an even number of its faces meet in each
    of its edges.

    Args:
        triangles: (n, 3, 3) [m].
    """
    vertices, faces = _merged(triangles)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if not len(faces):
        return None
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = directed.min(axis=1), directed.max(axis=1)
    _, edge = np.unique(low * len(vertices) + high, return_inverse=True)
    edge = edge.reshape(-1)
    part = _parts(edge.reshape(-1, 3))
    count = np.bincount(edge)
    open_parts = part[np.flatnonzero(count[edge] % 2) // 3]
    closed = ~np.isin(part, open_parts)
    if not closed.any():
        return None
    turns = np.bincount(edge, weights=np.where(directed[:, 0] < directed[:, 1], 1.0, -1.0))
    oriented = not turns[edge.reshape(-1, 3)[closed]].any()
    return Inside(vertices, faces[closed], oriented=oriented)


def _merged(triangles: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the places (k, 3) that corners have [m], and for each triangle (n, 3) its corners among them."""
    corners = triangles.reshape(-1, 3)
    order = np.lexsort(corners.T)
    placed = corners[order]
    new = np.ones(len(placed), dtype=bool)
    new[1:] = (placed[1:] != placed[:-1]).any(axis=1)
    number = np.empty(len(corners), dtype=np.intp)
    number[order] = np.cumsum(new) - 1
    return placed[new], number.reshape(-1, 3)


def _parts(edges: Indices) -> Indices:
    """Return for each face (n, 3 edges) the number of its part: faces with a common edge are in one."""
    label = np.arange(len(edges))
    flat = edges.reshape(-1)
    while True:
        least = np.full(int(flat.max()) + 1, len(edges))
        np.minimum.at(least, flat, np.repeat(label, 3))
        following = least[edges].min(axis=1)
        np.minimum.at(following, label, following.copy())  # the part's own face learns it too
        following = following[following]
        if np.array_equal(following, label):
            return label
        label = following
