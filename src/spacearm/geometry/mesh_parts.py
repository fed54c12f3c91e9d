"""A solid cut by planes into convex regions, and the convex hull of what of it is in each.

The hull of the part in a region is that of the corners of its surface there, and of the region's own corners that are inside
the solid. For an extreme point of what a region and a solid have in common is on the solid's surface, or it is a corner of the
region: about any other point there is a segment within both. So the hulls of all parts together hold the whole solid.

Neighbouring regions overlap by a hair, so that neither rounding nor a face within the plane of a cut leaves anything between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry.mesh_topology import Solid
from spacearm.geometry.point_hulls import Hull, hull_of

Array = NDArray[np.float64]

_OVERLAP = 1e-9  # of the solid's size: how far both sides of a cut go beyond it; rounding is about 1e-15
_BEYOND = 0.01  # of the solid's size: how far the first region goes beyond the solid on all sides
_CUBE = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)

Test = Callable[[Array], NDArray[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """What of a solid is in a convex region.

    Attributes:
        triangles: (n, 3, 3) its surface in the region; none where all of the region is inside [m].
        region: (k, 3, 3) the surface of the region [m].
        points: (p, 3) whose hull holds the part [m].
        hull: of these points.
    """

    triangles: Array
    region: Array
    points: Array
    hull: Hull = field(repr=False)


def whole(solid: Solid) -> Part:
    """Return all of a solid as one part."""
    corners = solid.triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    half = (high - low) / 2 + _BEYOND * float((high - low).max())
    box = hull_of((low + high) / 2 + half * _CUBE)
    return Part(solid.triangles, box.triangles, corners, hull_of(corners))


def halves(part: Part, normal: Array, offset: float, *, inside: Test | None, size: float) -> tuple[Part | None, Part | None]:
    """Cut a part by the plane normal . p = offset: what is below it and what is above, None where nothing is.

    Args:
        part: what is cut.
        normal: (3,) of length 1.
        offset: of the plane [m].
        inside: whether points are inside the solid; None if nothing is.
        size: of the solid [m].
    """
    slack = _OVERLAP * size
    return (
        _part(clipped(part.triangles, -normal, -offset - slack), clipped_region(part.region, -normal, -offset - slack), inside),
        _part(clipped(part.triangles, normal, offset - slack), clipped_region(part.region, normal, offset - slack), inside),
    )


def _part(triangles: Array, region: Array, inside: Test | None) -> Part | None:
    points = triangles.reshape(-1, 3)
    if inside is not None and len(region):
        corners = np.unique(region.reshape(-1, 3), axis=0)
        points = np.concatenate([points, corners[inside(corners)]])
    return Part(triangles, region, points, hull_of(points)) if len(points) else None


def clipped(triangles: Array, normal: Array, offset: float) -> Array:
    """Return what of triangles (n, 3, 3) has normal . p >= offset, as triangles."""
    return _clipped(triangles, triangles @ normal - offset)[0]


def clipped_region(region: Array, normal: Array, offset: float) -> Array:
    """Return the surface (k, 3, 3) of what of a convex region has normal . p >= offset; none if nothing has."""
    kept, corners = _clipped(region, region @ normal - offset)
    if not len(corners):
        return kept
    lid = hull_of(corners)
    return np.concatenate([kept, lid.triangles])


def _clipped(triangles: Array, signed: Array) -> tuple[Array, Array]:
    """Return what of triangles has a signed distance (n, 3) of 0 or more, and the points where the others are cut."""
    kept = signed >= 0
    count = kept.sum(axis=1)
    crossing = (count > 0) & (count < 3)
    if not crossing.any():
        return triangles[count == 3], triangles[:0, 0]
    T, d, single = triangles[crossing], signed[crossing], count[crossing] == 1
    # Turn each triangle so that the corner which is alone on its side comes first.
    lone = np.where(single, kept[crossing].argmax(axis=1), kept[crossing].argmin(axis=1))
    order = (lone[:, None] + np.arange(3)) % 3
    rows = np.arange(len(T))[:, None]
    T, d = T[rows, order], d[rows, order]
    p = T[:, 0] + (d[:, :1] / (d[:, :1] - d[:, 1:2])) * (T[:, 1] - T[:, 0])
    q = T[:, 0] + (d[:, :1] / (d[:, :1] - d[:, 2:3])) * (T[:, 2] - T[:, 0])
    tips = np.stack([T[single, 0], p[single], q[single]], axis=1)
    p2, q2, b, c = p[~single], q[~single], T[~single, 1], T[~single, 2]
    rest = np.concatenate([np.stack([p2, b, c], axis=1), np.stack([p2, c, q2], axis=1)])
    return np.concatenate([triangles[count == 3], tips, rest]), np.concatenate([p, q])
