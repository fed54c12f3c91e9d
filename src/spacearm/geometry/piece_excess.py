"""How far convex pieces stand out of a solid: an upper bound of the distance of their points from it.

The distance from the solid grows by no more than one goes, and the distance from one triangle is convex. So over a triangle of
a piece's surface it is no more than the greatest distance of its corners from one triangle of the solid's surface, and no more
than the distance of its middle and its radius together. The triangle with the greatest bound is halved until no bound is much
above the greatest distance found. What is hollow within a piece behind a narrow opening may be farther from the solid than the
piece's surface; cubes of a grid that is halved in the same way look for that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry.mesh_queries import Surface
from spacearm.geometry.mesh_topology import Solid
from spacearm.geometry.point_hulls import Hull, blocks, distances_each

Array = NDArray[np.float64]

_SAMPLES = 30_000  # points of the surface, about, by which the triangles near a point are found
_NEAR = 6  # of them that are looked at
_AT_ONCE = 400  # triangles or cubes that are halved in a round, at most
_MOST = 40_000  # in all; then the bound is what it is
_SIDES = 100  # flat sides, the largest ones, of which is seen that they are covered
_QUICK = 150  # triangles at least, whose middles are looked at where it has to be quick
_SEEN = 0.002  # of the solid's size: a hollow no farther than this beyond the hull's surface may be a matter of rounding
_COARSE = 0.03  # of the solid's size: how finely hollows are looked for
_CUBE = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])


class Excess:
    """Measures how far convex hulls stand out of a solid."""

    def __init__(self, solid: Solid, *, size: float, has_cavities: bool) -> None:
        """Take a solid whose surface is not empty, its size [m], and whether something within it may be free."""
        from scipy.spatial import KDTree

        self._triangles, self._inside, self._size = solid.triangles, solid.inside, size
        self.has_cavities = has_cavities
        self._surface = Surface(solid.triangles)
        self._samples, self._of, self._spacing = _spread(solid.triangles)
        self._tree = KDTree(self._samples)

    def bound(self, hull: Hull, surface: Array, *, share: float, length: float, enough: float = 0.0) -> float:
        """Return an upper bound of how far a hull's points, without its rounding, are from the solid [m].

        Args:
            hull: the piece.
            surface: (n, 3, 3) what of the solid's surface is in it [m].
            share: the bound is no more than this share of itself above the truth, or
            length: no more than this above it [m]. Of what is hollow within the hull, only what is farther from the solid
                than the hull's surface, by this and by 3 % of the solid's size, is sure to be seen.
            enough: only whether the hull stands out by more matters [m]; then a lower bound may be returned that is above it.
        """
        open_ = ~self._covered(hull, surface)
        out = self._on_surface(hull.triangles[open_], share, length, enough) if open_.any() else 0.0
        if not len(hull.planes) or (enough and out > enough) or (out <= length and not self.has_cavities):
            return out
        return max(out, self._hollow(hull, out, share, max(length, _COARSE * self._size), enough))

    def about(self, hull: Hull) -> float:
        """Return about how far a hull stands out, quickly: how far some points of it are from the solid [m]."""
        triangles = hull.triangles
        while len(triangles) < _QUICK:
            triangles = _halved(triangles)
        points = triangles.mean(axis=1)
        if len(points) > 2 * _QUICK:
            points = points[:: len(points) // _QUICK]
        points = np.concatenate([points, hull.vertices.mean(axis=0) + 0.5 * (points[::4] - hull.vertices.mean(axis=0))])
        away, _ = self._nearest(points)
        order = np.argsort(-away)
        for i in range(0, len(order), 64):
            some = order[i : i + 64]
            free = np.ones(len(some), dtype=bool) if self._inside is None else ~self._inside(points[some])
            if free.any():
                return float(away[some][free].max())
        return 0.0

    def _covered(self, hull: Hull, surface: Array) -> NDArray[np.bool_]:
        """Return which of a hull's triangles lie in a flat side that is covered by the solid's surface.

        The parts of a surface that lie in a flat side cover it if they have its area. Points of the side are looked at, too,
        since such parts may overlap.
        """
        out = np.zeros(len(hull.triangles), dtype=bool)
        if not len(hull.planes) or not len(surface):
            return out
        keys = np.round(hull.planes / np.array([1, 1, 1, self._size]), 9)
        _, first, side, count = np.unique(keys, axis=0, return_index=True, return_inverse=True, return_counts=True)
        side, several = side.reshape(-1), count > 1  # a side of one triangle needs no such help
        if not several.any():
            return out
        sizes = np.bincount(side, weights=_areas(hull.triangles))
        several &= sizes >= np.sort(sizes[several])[::-1][:_SIDES][-1]
        planes, number = hull.planes[first[several]], np.cumsum(several) - 1
        middle, near = surface.mean(axis=1), 1e-8 * self._size
        on = np.empty(len(middle), dtype=np.intp)
        for part in blocks(len(middle), len(planes)):
            on[part] = (middle[part] @ planes[:, :3].T + planes[:, 3]).argmax(axis=1)
        flat = (np.abs(np.einsum("nkc,nc->nk", surface, planes[on, :3]) + planes[on, 3, None]) <= near).all(axis=1)
        covered = np.bincount(on[flat], weights=_areas(surface[flat]), minlength=len(planes))
        area = np.bincount(number[side[several[side]]], weights=_areas(hull.triangles[several[side]]), minlength=len(planes))
        full = np.abs(covered - area) <= 1e-6 * area
        out[several[side]] = full[number[side[several[side]]]]
        if out.any():
            points = np.concatenate([hull.triangles[out].mean(axis=1), _halved(hull.triangles[out]).mean(axis=1)])
            if self._nearest(points)[0].max() > 1e-6 * self._size:
                return np.zeros(len(hull.triangles), dtype=bool)
        return out

    def _on_surface(self, triangles: Array, share: float, length: float, enough: float) -> float:
        done, least, looked = 0.0, 0.0, 0
        bounds, found = self._over(triangles, length)
        while True:
            least = max(least, float(found.max()))
            close = bounds <= max(least * (1 + share), least + length, enough)
            done = max(done, float(bounds[close].max(initial=0.0)))
            triangles, bounds = triangles[~close], bounds[~close]
            looked += min(len(triangles), _AT_ONCE)
            if least > enough > 0:
                return least
            if not len(triangles) or looked > _MOST:
                return max(done, float(bounds.max(initial=0.0)))
            order = np.argsort(-bounds)
            chosen, rest = order[:_AT_ONCE], order[_AT_ONCE:]
            new = _halved(triangles[chosen])
            more, found = self._over(new, length)
            triangles = np.concatenate([triangles[rest], new])
            bounds = np.concatenate([bounds[rest], np.minimum(more, np.tile(bounds[chosen], 2))])

    def _over(self, triangles: Array, length: float) -> tuple[Array, Array]:
        """Return upper bounds of the distance over triangles (m, 3, 3), and about that of their middles, (m,) each [m]."""
        middle = triangles.mean(axis=1)
        radius = np.linalg.norm(triangles - middle[:, None], axis=2).max(axis=1)
        away, nearest = self._nearest(middle)
        of_corners = distances_each(triangles, self._triangles[nearest][:, None]).max(axis=1)
        bound = np.minimum(of_corners, away + radius)
        if self._inside is not None:
            solid = np.flatnonzero(bound > length)
            solid = solid[self._inside(middle[solid])]
            bound[solid] = np.minimum(bound[solid], np.maximum(radius[solid] - self._depth(middle[solid], away[solid]), 0.0))
            away[solid] = 0.0
        return bound, away

    def _hollow(self, hull: Hull, least: float, share: float, length: float, enough: float) -> float:
        """Return an upper bound of the distance of what is hollow within a hull; `least` if nothing is far above that [m]."""
        low, high = hull.vertices.min(axis=0), hull.vertices.max(axis=0)
        edge = float((high - low).max()) / 4
        counts = np.maximum(np.ceil((high - low) / edge), 1).astype(int)
        grid = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 3)
        centers, out, looked = low + (grid + 0.5) * edge, least, 0
        while True:
            radius = edge * np.sqrt(3) / 2
            limit = max(out * (1 + share), least + length, enough)
            away, depth = self._far(hull, centers, radius, limit)
            out = max(out, self._greatest(centers, np.where(depth <= 0, away, 0.0), out))
            # No place is farther from the solid than a place of the hull's surface and the way from there.
            still = (away + radius > limit) & (depth <= radius) & (least - depth + radius > limit)
            centers, looked = centers[still], looked + len(centers)
            if not len(centers):
                return limit if out > max(least + _SEEN * self._size, enough) else out
            if out > enough > 0:
                return out
            if looked > _MOST:
                return max(limit, float((away + radius)[still].max()))
            centers, edge = (centers[:, None] + edge / 2 * _CUBE).reshape(-1, 3), edge / 2

    def _far(self, hull: Hull, centers: Array, radius: float, limit: float) -> tuple[Array, Array]:
        """Return about how far the middles of cubes (m, 3) are from the solid, and from within the hull (<= 0), (m,) each [m].

        Of cubes that are without interest, because not in the hull, or in the solid or near to it, the first is 0 or less.
        """
        depth = (centers @ hull.planes[:, :3].T + hull.planes[:, 3]).max(axis=1)
        away = np.full(len(centers), -np.inf)
        near = np.flatnonzero(depth <= radius)
        away[near] = self._nearest(centers[near])[0]
        close = away + radius <= limit
        away[close] = np.minimum(away[close], 0.0)
        if self._inside is not None:
            near = np.flatnonzero(~close & (depth <= radius))
            solid = near[self._inside(centers[near])]
            away[solid] = -away[solid]
        return away, depth

    def _greatest(self, points: Array, away: Array, least: float) -> float:
        """Return the greatest distance of points (m, 3) from the surface, of which upper bounds (m,) are given [m]."""
        order = np.argsort(-away)
        for i in range(0, len(order), 32):
            some = order[i : i + 32]
            if away[some[0]] <= least:
                break
            least = max(least, float(self._surface.nearest(points[some])[0].max()))
        return least

    def _nearest(self, points: Array) -> tuple[Array, NDArray[np.intp]]:
        """Return the distance (m,) of points (m, 3) from the nearest of a few triangles, and which it is, (m,)."""
        if not len(points):
            return np.zeros(0), np.zeros(0, dtype=np.intp)
        count = min(_NEAR, len(self._samples))
        near = self._of[self._tree.query(points, k=count)[1].reshape(len(points), count)]
        away = distances_each(points[:, None], self._triangles[near])
        best = away.argmin(axis=1)
        row = np.arange(len(points))
        return away[row, best], near[row, best]

    def _depth(self, points: Array, away: Array) -> Array:
        """Return the distance of points (m, 3) from the surface, or a lower bound; `away` is an upper bound, (m,) each [m]."""
        if not len(points):
            return away
        out = np.maximum(self._tree.query(points)[0] - self._spacing, 0.0)
        rough = np.flatnonzero(out < 0.9 * away)
        out[rough] = self._surface.nearest(points[rough])[0]
        return out


def _halved(triangles: Array) -> Array:
    """Cut every triangle (m, 3, 3) across its longest side, (2 m, 3, 3)."""
    sides = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
    order = (sides.argmax(axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(triangles, order[:, :, None], axis=1), 1, 0)
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _areas(triangles: Array) -> Array:
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2


def _spread(triangles: Array) -> tuple[Array, NDArray[np.intp], float]:
    """Return points of triangles (k, 3), which triangle each is of, and how far a place on them is from one at most [m]."""
    of = np.arange(len(triangles))
    pieces = triangles
    while True:
        sides = np.linalg.norm(np.roll(pieces, -1, axis=1) - pieces, axis=2).max(axis=1)
        longest = float(sides.max())
        long = sides > longest / np.sqrt(2)
        if longest == 0 or len(pieces) + long.sum() > max(_SAMPLES, 2 * len(triangles)):
            break
        pieces = np.concatenate([pieces[~long], _halved(pieces[long])])
        of = np.concatenate([of[~long], of[long], of[long]])
    middle = pieces.mean(axis=1)
    return middle, of, float(np.linalg.norm(pieces - middle[:, None], axis=2).max())
