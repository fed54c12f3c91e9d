"""Convex hulls of points in any position: solid, flat, a segment or a point; and hulls of few of them with a rounding radius.

Qhull rounds, and gives no hull of flat sets. So no hull is trusted: `holding` looks how far any of the points is outside of it,
and all points within that distance of the hull, its `rounding`, hold every point.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FLAT = 1e-9  # of its longest extent: a set that is no thicker is flat, one that is no wider a segment
_AT_ONCE = 300_000  # pairs of a point and a triangle, for the memory's sake
_PER_ROUND = 6  # vertices that are added to the few before their hull is made again
_ENOUGH = 1e-6  # of the extent: a hull of few vertices that misses no point by more needs no further ones


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """The convex hull of points, and all points within `rounding` of it.

    Attributes:
        vertices: (k, 3) [m].
        triangles: (f, 3, 3) its surface; a flat hull's is there once, and that of a segment or a point is without area [m].
        planes: (f, 4) outward normals n and offsets d, n . p + d <= 0 inside; none if the hull is not solid.
        rounding: [m].
    """

    vertices: Array
    triangles: Array
    planes: Array
    rounding: float = 0.0

    def outside(self, points: Array) -> Array:
        """Return how far points (m, 3) are outside of the hull without its rounding, 0 inside, (m,) [m]."""
        if not len(self.planes):
            return distances(points, self.triangles)
        out = np.maximum(self._above(points), 0.0)
        far = np.flatnonzero(out > 0)
        out[far] = np.maximum(out[far], distances(points[far], self.triangles))
        return out

    def about_outside(self, points: Array) -> Array:
        """Return a lower bound of `outside`, quickly: by the planes alone, where there are any."""
        return np.maximum(self._above(points), 0.0) if len(self.planes) else distances(points, self.triangles)

    def _above(self, points: Array) -> Array:
        out = np.full(len(points), -np.inf)
        for part in blocks(len(points), len(self.planes)):
            out[part] = (points[part] @ self.planes[:, :3].T + self.planes[:, 3]).max(axis=1)
        return out


def hull_of(points: Array) -> Hull:
    """Return the convex hull of points (n, 3), at least one [m]; Qhull's rounding is not accounted for yet (`holding`)."""
    return _bare(np.unique(points, axis=0))


def holding(few: Hull, full: Hull, points: Array) -> Hull:
    """Return a hull with the rounding radius that holds points.

    No place of the full hull is farther from that of few vertices than one of its vertices is, because that distance is
    convex. So only points that are outside of the full hull, by its rounding, add to that.

    Args:
        few: the hull of some of the points.
        full: that of all of them, but for rounding.
        points: (n, 3) [m].
    """
    reach = 0.0 if few is full else float(few.outside(full.vertices).max())
    beyond = points[few.about_outside(points) > 0]
    own = np.isin(_rows(beyond), _rows(full.vertices))
    return replace(few, rounding=reach + float(full.outside(beyond[~own]).max(initial=0.0)))


def _rows(points: Array) -> NDArray[np.void]:
    """Return points (n, 3) as (n,) values that can be compared; -0.0 is not 0.0 there, which does no harm."""
    return np.ascontiguousarray(points).view(np.dtype((np.void, 24))).reshape(-1)


def few_vertices(hull: Hull, most: int) -> Hull:
    """Return the hull of some of a hull's vertices, such that the others are outside of it by little; its rounding is 0.

    Args:
        hull: what is to be replaced.
        most: how many vertices are allowed, at least 4.
    """
    if len(hull.vertices) <= most:
        return hull
    points = hull.vertices
    extent = float(np.ptp(points, axis=0).max())
    along = (points - points.mean(axis=0)) @ axes_of(points)[0]
    chosen = list(dict.fromkeys([*along.argmax(axis=0).tolist(), *along.argmin(axis=0).tolist()]))[:most]
    while True:
        few = _bare(points[chosen])
        out = few.about_outside(points)
        if len(chosen) >= most or out.max() <= _ENOUGH * extent:
            return few
        chosen += _farthest(points, out, min(_PER_ROUND, most - len(chosen)))


def _farthest(points: Array, out: Array, count: int) -> list[int]:
    """Choose points that are far outside, and not beside one another."""
    chosen: list[int] = []
    left = out.copy()
    for _ in range(count):
        i = int(left.argmax())
        if left[i] <= 0.3 * out.max():
            break
        chosen.append(i)
        # A vertex there raises the hull around it, by less the farther it is from there.
        away = np.linalg.norm(points - points[i], axis=1)
        reach = max(np.sqrt(out[i] * float(np.ptp(points, axis=0).max())), 1e-300)  # on a round body
        left = np.where(away < 2 * reach, left - out[i] * (1 - away / (2 * reach)), left)
        left[i] = 0.0
    return chosen


def _bare(points: Array) -> Hull:
    """Return a hull whose rounding is still to be found."""
    from scipy.spatial import ConvexHull, QhullError

    away = points - points.mean(axis=0)
    axes, extent = axes_of(points)
    rank = int((extent > _FLAT * extent[0]).sum()) if extent[0] > 0 else 0
    if rank == 3:
        try:
            found = ConvexHull(away)
        except QhullError:  # nearly flat
            rank = 2
        else:
            # Qhull's planes are those of the points about their middle.
            planes = found.equations.copy()
            planes[:, 3] -= planes[:, :3] @ points.mean(axis=0)
            return Hull(points[found.vertices], points[found.simplices], planes)
    if rank == 2:
        try:
            ring = ConvexHull(away @ axes[:, :2]).vertices
            fan = np.array([[ring[0], a, b] for a, b in itertools.pairwise(ring[1:])])
            return Hull(points[ring], points[fan], np.zeros((0, 4)))
        except QhullError:  # nearly straight
            rank = 1
    ends = [int((away @ axes[:, 0]).argmin()), int((away @ axes[:, 0]).argmax())] if rank else [0, 0]
    return Hull(points[np.unique(ends)], points[[[*ends, ends[1]]]], np.zeros((0, 4)))


def axes_of(points: Array) -> tuple[Array, Array]:
    """Return the principal axes of points, as columns (3, 3), and how far they extend along each, longest first, (3,) [m]."""
    away = points - points.mean(axis=0)
    axes = np.linalg.eigh(away.T @ away)[1]
    extent = np.ptp(away @ axes, axis=0)
    order = np.argsort(-extent)
    return axes[:, order], extent[order]


def distances(points: Array, triangles: Array) -> Array:
    """Return the distance of each point (m, 3) from the nearest of triangles (f, 3, 3), which may be flat, (m,) [m]."""
    out = np.empty(len(points))
    for part in blocks(len(points), len(triangles)):
        out[part] = distances_each(points[part, None], triangles[None]).min(axis=1)
    return out


def blocks(rows: int, columns: int) -> Iterator[slice]:
    """Yield slices of rows, each of which makes no too large table with the columns."""
    step = max(1, _AT_ONCE // max(1, columns))
    return (slice(i, i + step) for i in range(0, rows, step))


def distances_each(points: Array, triangles: Array) -> Array:
    """Return the distance between points (..., 3) and triangles (..., 3, 3), each with its own, (...) [m]."""
    sides = np.roll(triangles, -1, axis=-2) - triangles
    away = points[..., None, :] - triangles
    squared = np.einsum("...c,...c->...", sides, sides)
    share = np.einsum("...c,...c->...", away, sides) / np.where(squared > 0, squared, 1.0)
    beside = away - np.clip(share, 0.0, 1.0)[..., None] * sides
    least = np.einsum("...c,...c->...", beside, beside).min(axis=-1)
    normal = np.cross(sides[..., 0, :], sides[..., 1, :])
    area = np.einsum("...c,...c->...", normal, normal)
    left = np.einsum("...c,...kc->...k", normal, np.cross(sides, away))
    over = (left > 0).all(axis=-1) & (area > 0)
    height = np.einsum("...c,...c->...", away[..., 0, :], normal)
    above = np.square(height) / np.where(area > 0, area, 1.0)
    return np.sqrt(np.where(over, np.minimum(above, least), least))
