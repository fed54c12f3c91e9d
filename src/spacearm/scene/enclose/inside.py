"""Whether points are inside a closed surface of triangles: by the triangles that a ray from them meets."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array, Indices


class Inside:
    """Tells which points are inside a closed surface.

    A point is inside where the surface winds around it: cavities are outside, and where closed parts overlap it is inside.
    """

    def __init__(self, vertices: Array, faces: NDArray[np.intp], *, oriented: bool) -> None:
        """Take vertices (k, 3) [m] and faces (n, 3) of a closed surface.

        Args:
            vertices: each place once.
            faces: indices of vertices.
            oriented: whether neighbouring faces agree on which side is out; else inside is where a ray meets the surface
                an odd number of times.
        """
        self._vertices, self._faces, self._oriented = vertices, faces, oriented
        self._views: list[_View] = []  # made when needed; mostly one is enough

    def __call__(self, points: Array) -> NDArray[np.bool_]:
        """Return whether each point (m, 3) is inside; of points on the surface either may be said."""
        out = np.zeros(len(points), dtype=bool)
        unsure = np.arange(len(points))
        for i, turn in enumerate(_TURNS):
            if i == len(self._views):
                self._views.append(_View(self._vertices @ turn.T, self._faces))
            above, total = self._views[i].crossings(points[unsure] @ turn.T, oriented=self._oriented)
            out[unsure] = above % 2 != 0 if not self._oriented else above != 0
            # A whole line meets a closed surface as often inwards as outwards; else it met an edge, and rounding decided.
            unsure = unsure[total % 2 != 0 if not self._oriented else total != 0]
            if not unsure.size:
                break
        return out


class _View:
    """The triangles seen along z, sorted into squares."""

    def __init__(self, vertices: Array, faces: NDArray[np.intp]) -> None:
        corners = vertices[faces]
        following = np.roll(faces, -1, axis=1)
        # Edges go from the lesser index to the greater, so that two faces with a common edge compute the very same number.
        self._swapped = faces > following
        self._from = vertices[np.minimum(faces, following)][:, :, :2]
        self._along = vertices[np.maximum(faces, following)][:, :, :2] - self._from
        self._heights = np.roll(corners[:, :, 2], 1, axis=1)  # of the corner that lies opposite to each edge
        low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
        self._low, self._high = low, high
        self._origin = low.min(axis=0)
        size = np.maximum(high.max(axis=0) - self._origin, 1e-300)
        side = max(1, min(1024, int(1.5 * np.sqrt(len(faces)))))
        while True:
            self._side, self._scale = side, side / size
            first, last = self._square(low), self._square(high)
            wide = last - first + 1
            if side == 1 or wide.prod(axis=1).sum() <= 16 * len(faces) + 1000:
                break
            side //= 2
        count = wide.prod(axis=1)
        face = np.repeat(np.arange(len(faces)), count)
        step = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
        column, row = step % wide[face, 0], step // wide[face, 0]
        square = (first[face, 0] + column) * self._side + first[face, 1] + row
        order = np.argsort(square, kind="stable")
        self._entries = face[order]
        self._start = np.searchsorted(square[order], np.arange(self._side**2 + 1))

    def _square(self, points: Array) -> Indices:
        return np.clip(((points - self._origin) * self._scale).astype(np.intp), 0, self._side - 1)

    def crossings(self, points: Array, *, oriented: bool) -> tuple[Indices, Indices]:
        """Return how often the ray upwards from each point, and the whole line through it, crosses the surface."""
        above, total = np.zeros(len(points), dtype=np.intp), np.zeros(len(points), dtype=np.intp)
        where = self._square(points[:, :2])
        square = where[:, 0] * self._side + where[:, 1]
        order = np.argsort(square, kind="stable")  # neighbours one after the other: their triangles are at hand
        counts = (self._start[square + 1] - self._start[square])[order]
        for block in _blocks(counts, 1_000_000):
            count = counts[block]
            point = np.repeat(order[block], count)
            step = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
            face = self._entries[self._start[square[point]] + step]
            at = points[point, :2]
            over = ((at >= self._low[face]) & (at <= self._high[face])).all(axis=1)
            point, face = point[over], face[over]
            hit, sign, height = self._hits(points[point, :2], face)
            point = point[hit]
            turn = sign if oriented else np.ones(len(point), dtype=np.intp)
            np.add.at(total, point, turn)
            over = height > points[point, 2]
            np.add.at(above, point[over], turn[over])
        return above, total

    def _hits(self, points: Array, face: Indices) -> tuple[NDArray[np.bool_], Indices, Array]:
        """Return which pairs of a point and a face meet, seen along z; for those the face's turn and height."""
        away, along, swapped = points[:, None] - self._from[face], self._along[face], self._swapped[face]
        area = along[:, :, 0] * away[:, :, 1] - along[:, :, 1] * away[:, :, 0]
        left = (area > 0) != swapped
        hit = (left[:, 0] == left[:, 1]) & (left[:, 1] == left[:, 2])
        weight = np.where(swapped[hit], -area[hit], area[hit])
        z, total = self._heights[face[hit]], weight.sum(axis=1)
        flat = total == 0
        height = np.where(flat, z.max(axis=1), (weight * z).sum(axis=1) / np.where(flat, 1.0, total))
        return hit, np.where(left[hit, 0], 1, -1), height


def _blocks(counts: Indices, most: int) -> list[slice]:
    """Cut a list into slices whose counts add up to no more than `most`, or that have one entry."""
    ends = np.searchsorted(np.cumsum(counts), np.arange(most, counts.sum() + most, most), side="right")
    cuts = np.unique(np.concatenate([[0], ends, [len(counts)]]))
    return [slice(int(a), int(b)) for a, b in itertools.pairwise(cuts)]


def _turned(*angles: float) -> Array:
    out = np.eye(3)
    for i, angle in enumerate(angles):
        turn = np.eye(3)
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[j, j] = turn[k, k] = np.cos(angle)
        turn[j, k], turn[k, j] = -np.sin(angle), np.sin(angle)
        out = turn @ out
    return out


# Views that no one's mesh is aligned with.
_TURNS = (_turned(0.6180, 1.2345, 0.4142), _turned(2.2361, 0.5772, 1.7321), _turned(1.0987, 2.7183, 0.3679))
