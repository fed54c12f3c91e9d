"""What is to be enclosed, cut into cells: boxes along the axes, halved again and again.

Each cell holds corner points: those of the triangles' parts in it, and its own corners that are inside a solid. The convex
hull of these points holds everything of the surface and of the solid that is in the cell: an extreme point of what a cell
and a solid have in common is a corner of the cell or on the surface. So a ball that holds the corner points holds it too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array, Indices

Test: TypeAlias = Callable[[Array], NDArray[np.bool_]]
"""Tells whether each point (m, 3) is inside a solid; of points on its surface either may be said."""

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=bool)


@dataclass(frozen=True, slots=True)
class Polygons:
    """Convex polygons, sorted by the cell they are in.

    Attributes:
        corners: (m, v, 3); those beyond a polygon's count repeat its last [m].
        count: (m,) corners of each.
        cell: (m,) the cell it is in.
    """

    corners: Array
    count: Indices
    cell: Indices

    def take(self, which: NDArray[np.bool_] | Indices) -> Polygons:
        """Return some of them."""
        return Polygons(self.corners[which], self.count[which], self.cell[which])


@dataclass(frozen=True, slots=True)
class Cells:
    """Boxes and what is in them; every box has at least one corner point.

    Attributes:
        polygons: of the surface.
        points: (p, 3) corner points, cell by cell [m].
        start: (k + 1,) where each cell's begin.
        low, high: (k, 3) corners of the boxes, which are as tight as the corner points allow [m].
    """

    polygons: Polygons
    points: Array
    start: Indices
    low: Array
    high: Array

    def __len__(self) -> int:
        return len(self.low)

    def take(self, which: NDArray[np.bool_]) -> Cells:
        """Return some of the cells with what is in them."""
        count = np.diff(self.start)
        kept = self.polygons.take(which[self.polygons.cell])
        number = np.cumsum(which) - 1
        return Cells(
            Polygons(kept.corners, kept.count, number[kept.cell]),
            self.points[np.repeat(which, count)],
            np.concatenate([[0], np.cumsum(count[which])]),
            self.low[which],
            self.high[which],
        )

    def halved(self, inside: Test | None, *, unit: Array) -> Cells:
        """Cut every cell across its longest side; keep those halves that hold a part of the surface or are inside.

        A side longer than its unit (k,) [m] is cut so that in the end it is in as few equal parts as are no longer than it.
        """
        cell = np.arange(len(self))
        axis = np.argmax(self.high - self.low, axis=1)
        first, last = self.low[cell, axis], self.high[cell, axis]
        units = np.maximum(np.ceil((last - first) / unit), 2.0)
        at = first + (last - first) * (np.ceil(units / 2) / units)
        low, high = np.repeat(self.low, 2, axis=0), np.repeat(self.high, 2, axis=0)
        high[2 * cell, axis], low[2 * cell + 1, axis] = at, at
        polygons, above = _cut(self.polygons, axis[self.polygons.cell], at[self.polygons.cell])
        half = 2 * polygons.cell + above
        used = np.zeros(2 * len(self), dtype=bool)
        used[half] = True
        if inside is not None:
            empty = np.flatnonzero(~used)
            used[empty] = inside((low[empty] + high[empty]) / 2)
        number = np.cumsum(used) - 1
        order = np.argsort(half, kind="stable")
        sorted_polygons = Polygons(polygons.corners[order], polygons.count[order], number[half[order]])
        return cells_of(sorted_polygons, low[used], high[used], inside)


def cells_of(polygons: Polygons, low: Array, high: Array, inside: Test | None) -> Cells:
    """Make cells of boxes (k, 3) and the polygons in them; without polygons a box must be inside."""
    real = np.arange(polygons.corners.shape[1]) < polygons.count[:, None]
    points, cell = polygons.corners[real], np.repeat(polygons.cell, polygons.count)
    if inside is not None:
        own = np.where(_CORNERS, high[:, None], low[:, None]).reshape(-1, 3)
        kept = inside(own)
        filled = np.ones(len(low), dtype=bool)
        filled[polygons.cell] = False
        kept |= np.repeat(filled, 8)
        points = np.concatenate([points, own[kept]])
        cell = np.concatenate([cell, np.repeat(np.arange(len(low)), 8)[kept]])
    points, cell = _distinct(points, cell)
    start = np.searchsorted(cell, np.arange(len(low) + 1))
    low, high = np.minimum.reduceat(points, start[:-1]), np.maximum.reduceat(points, start[:-1])
    return Cells(polygons, points, start, low, high)


def joined_cells(parts: list[Cells]) -> Cells:
    """Return the cells of several lists in one."""
    first = np.cumsum([0, *(len(part) for part in parts)])
    width = max(part.polygons.corners.shape[1] for part in parts)
    polygons = Polygons(
        np.concatenate([_widened(part.polygons.corners, width) for part in parts]),
        np.concatenate([part.polygons.count for part in parts]),
        np.concatenate([part.polygons.cell + before for part, before in zip(parts, first, strict=False)]),
    )
    counts = np.concatenate([np.diff(part.start) for part in parts])
    return Cells(
        polygons,
        np.concatenate([part.points for part in parts]),
        np.concatenate([[0], np.cumsum(counts)]),
        np.concatenate([part.low for part in parts]),
        np.concatenate([part.high for part in parts]),
    )


def one_cell(triangles: Array, inside: Test | None) -> Cells:
    """Return one cell with all triangles (n, 3, 3) in it [m]."""
    count = np.full(len(triangles), 3, dtype=np.intp)
    polygons = Polygons(triangles, count, np.zeros(len(triangles), dtype=np.intp))
    low, high = triangles.min(axis=(0, 1))[None], triangles.max(axis=(0, 1))[None]
    return cells_of(polygons, low, high, inside)


def _distinct(points: Array, cell: Indices) -> tuple[Array, Indices]:
    """Leave out points that a cell has twice; sort them by cell."""
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0], cell))
    points, cell = points[order], cell[order]
    new = np.ones(len(cell), dtype=bool)
    new[1:] = (cell[1:] != cell[:-1]) | (points[1:] != points[:-1]).any(axis=1)
    return points[new], cell[new]


def _cut(polygons: Polygons, axis: Indices, at: Array) -> tuple[Polygons, Indices]:
    """Cut polygons by planes across an axis (m,) at a place (m,) [m].

    Returns:
        The parts, and whether each is above (1) or below (0) its plane. A polygon in the plane is below.
    """
    x = np.take_along_axis(polygons.corners, axis[:, None, None], axis=2)[:, :, 0]
    below = x.max(axis=1) <= at
    above = ~below & (x.min(axis=1) >= at)
    through = ~above & ~below
    parts = [polygons.take(below), polygons.take(above)]
    parts += [_clipped(polygons.take(through), x[through] - at[through, None], axis[through], at[through], s) for s in (1, -1)]
    width = max(part.corners.shape[1] for part in parts)
    joined = Polygons(
        np.concatenate([_widened(part.corners, width) for part in parts]),
        np.concatenate([part.count for part in parts]),
        np.concatenate([part.cell for part in parts]),
    )
    return joined, np.repeat([0, 1, 0, 1], [len(part.count) for part in parts])


def _clipped(polygons: Polygons, height: Array, axis: Indices, at: Array, sign: int) -> Polygons:
    """Return the parts of polygons where sign * height <= 0 (Sutherland and Hodgman).

    Every polygon must have such a part; `height` (m, v) is that of its corners above the plane [m].
    """
    rows, width = height.shape
    following = np.arange(1, width + 1) % polygons.count[:, None]
    here, there = polygons.corners, np.take_along_axis(polygons.corners, following[:, :, None], axis=1)
    u, v = sign * height, sign * np.take_along_axis(height, following, axis=1)
    real = np.arange(width) < polygons.count[:, None]
    crossing = real & (((u < 0) & (v > 0)) | ((u > 0) & (v < 0)))
    share = np.where(crossing, u / np.where(crossing, u - v, 1.0), 0.0)
    between = here + share[:, :, None] * (there - here)
    np.put_along_axis(between, np.broadcast_to(axis[:, None, None], (rows, width, 1)), at[:, None, None], axis=2)
    both = np.stack([here, between], axis=2).reshape(rows, 2 * width, 3)
    kept = np.stack([real & (u <= 0), crossing], axis=2).reshape(rows, 2 * width)
    count = kept.sum(axis=1)
    first = np.argsort(~kept, axis=1, kind="stable")[:, : int(count.max(initial=1))]
    column = np.minimum(np.arange(first.shape[1]), count[:, None] - 1)
    chosen = np.take_along_axis(first, column, axis=1)
    return Polygons(np.take_along_axis(both, chosen[:, :, None], axis=1), count, polygons.cell)


def _widened(corners: Array, width: int) -> Array:
    missing = width - corners.shape[1]
    return corners if not missing else np.concatenate([corners, np.repeat(corners[:, -1:], missing, axis=1)], axis=1)
