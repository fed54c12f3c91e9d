"""Shapes as a report's page draws them: what it knows by itself, and triangles for all else, each mesh stored once.

Boxes, cylinders, capsules, spheres, sets of spheres and half-spaces are themselves. Polytopes, pieces of meshes, and shapes
with a rounding become triangles. A polytope with many vertices is drawn by some of them, which is noted.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import (
    Box,
    Capsule,
    ConvexShape,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Sphere,
    SphereSet,
)
from spacearm.geometry.convex_cores import axes_along
from spacearm.report.report_page import packed, quantised, transform

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]

MOST_VERTICES = 250
"""Of a convex piece: of one that has more, those that are farthest in as many directions are drawn."""

MOST_TRIANGLES = 60_000
"""Of all convex pieces of a report together: the more pieces, the fewer vertices each is drawn by."""

MOST_BALLS = 20_000
"""Of a set of spheres: of one that has more, the largest are drawn."""

_FEWEST = 14  # vertices of a piece, however many pieces there are
_FEW = 20  # corners of a hull that are rounded as they are
_ROUND = 48  # corners of a circle
_QUARTER = 4  # steps of a quarter of a rounded edge
_LINE = 0.004  # times the size of the robot: lines and points without thickness are drawn so thick
_THIN = 1e-9  # [m] what is no thicker has no thickness


@dataclass(slots=True)
class Meshes:
    """The meshes of a report, each stored once, and what was left out of them.

    Attributes:
        items: as the page reads them.
        triangles: how many all of them have.
        vertices: the most that a convex piece is drawn by.
        notes: what was drawn by fewer, a sentence each.
    """

    items: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    triangles: int = 0
    vertices: int = MOST_VERTICES
    notes: list[str] = field(default_factory=list[str])
    _places: dict[tuple[bytes, bytes, bytes], int] = field(default_factory=dict[tuple[bytes, bytes, bytes], int])
    _fewer: dict[str, int] = field(default_factory=dict[str, int])

    def add(self, points: Array, triangles: Triangles, colors: NDArray[np.uint8] | None = None) -> int:
        """Store a mesh and return its place among the meshes.

        Args:
            points: (k, 3) [m].
            triangles: (m, 3) indices of points, counter-clockwise seen from outside.
            colors: (m, 3) red, green and blue of the triangles; None: the mesh has one colour.
        """
        points, triangles = np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
        key = points.tobytes(), triangles.tobytes(), b"" if colors is None else np.asarray(colors, np.uint8).tobytes()
        if key not in self._places:
            positions, low, high = quantised(points)
            kind = "u16" if len(points) <= 65536 else "u32"
            made: dict[str, Any] = {"low": low, "high": high, "positions": positions, "indices": packed(triangles, kind)}
            if colors is not None:
                made["colors"] = packed(colors, "u8")
            self._places[key] = len(self.items)
            self.items.append(made)
            self.triangles += len(triangles)
        return self._places[key]

    def expect(self, pieces: int) -> None:
        """Let convex pieces have so few vertices that this number of them has no more than `MOST_TRIANGLES` together."""
        self.vertices = max(_FEWEST, min(MOST_VERTICES, MOST_TRIANGLES // (2 * max(pieces, 1))))

    def drawn_by_fewer(self, owner: str, vertices: int) -> None:
        """Note down that a piece of an owner is drawn by some of its vertices."""
        self._fewer[owner] = max(self._fewer.get(owner, 0), vertices)

    def said(self) -> list[str]:
        """Return what is not drawn as it is, a sentence each."""
        fewer = [f"{owner} (up to {count:,} vertices)" for owner, count in self._fewer.items()]
        listed = ", ".join(fewer[:8]) + (f" and {len(fewer) - 8} more" if len(fewer) > 8 else "")
        note = f"drawn by at most {self.vertices} vertices a convex piece, to keep the page small: {listed}; the proof has all"
        return list(dict.fromkeys([*self.notes, *([note] if fewer else [])]))


def geometry_of(shape: ConvexShape, meshes: Meshes, *, owner: str, line: float) -> dict[str, Any] | None:
    """Return a convex shape as the page draws it, in the frame of its numbers.

    Args:
        shape: of a link or an obstacle.
        meshes: of the report.
        owner: whose shape it is, for notes.
        line: the radius by which lines and points are drawn [m].
    """
    if isinstance(shape, Sphere):
        return {"kind": "sphere", "radius": shape.radius, "center": shape.center.tolist()}
    if isinstance(shape, Capsule):
        return {"kind": "capsule", "radius": shape.radius, "a": shape.a.tolist(), "b": shape.b.tolist()}
    if isinstance(shape, Box) and not shape.rounding:
        return {"kind": "box", "size": shape.size.tolist(), "T": transform(shape.pose)}
    if isinstance(shape, Cylinder) and not shape.rounding:
        return {"kind": "cylinder", "radius": shape.radius, "length": shape.length, "T": transform(shape.pose)}
    ends = _ends(shape.vertices) if isinstance(shape, Polytope) else None
    if isinstance(shape, Polytope) and ends is not None:
        return _segment(*ends, max(shape.rounding, line))
    if isinstance(shape, Polytope):
        points = _fewer(shape.vertices, meshes, owner)
        if shape.rounding:
            points = _widened(points, shape.rounding, meshes, owner)
        mesh, T = hulled(points), np.eye(4)
    else:
        rim = _box_corners(shape) if isinstance(shape, Box) else _cylinder_rims(shape)
        mesh, T = hulled(rim), shape.pose
    return {"kind": "mesh", "mesh": meshes.add(*mesh), "T": transform(T)}


def geometries_of(obstacle: Obstacle, meshes: Meshes, *, owner: str, line: float) -> list[dict[str, Any]]:
    """Return an obstacle as the page draws it, in the inertial frame; arguments as for `geometry_of`."""
    if isinstance(obstacle, HalfSpace):
        normal = obstacle.normal
        return [{"kind": "halfspace", "normal": normal.tolist(), "offset": float(normal @ obstacle.point)}]
    if isinstance(obstacle, SphereSet):
        largest = np.argsort(-obstacle.radii, kind="stable")[:MOST_BALLS]
        if len(largest) < len(obstacle.radii):
            meshes.notes.append(f"{owner}: the largest {MOST_BALLS:,} of {len(obstacle.radii):,} spheres are drawn")
        centers, radii = obstacle.centers[np.sort(largest)], obstacle.radii[np.sort(largest)]
        return [{"kind": "spheres", "centers": packed(centers), "radii": packed(radii)}]
    if isinstance(obstacle, PolytopeSet):
        made = [geometry_of(piece, meshes, owner=owner, line=line) for piece in obstacle.pieces]
    else:
        made = [geometry_of(obstacle, meshes, owner=owner, line=line)]
    return [one for one in made if one is not None]


def _ends(vertices: Array) -> tuple[Array, Array] | None:
    """Return the ends of a hull that is a segment or a point; None for others."""
    a = vertices[int(np.argmax(np.linalg.norm(vertices - vertices[0], axis=1)))]
    b = vertices[int(np.argmax(np.linalg.norm(vertices - a, axis=1)))]
    along = b - a
    aside = np.linalg.norm(np.cross(vertices - a, along), axis=1).max()
    return (b, a) if aside <= _THIN * max(float(along @ along), _THIN) else None


def _segment(a: Array, b: Array, radius: float) -> dict[str, Any]:
    if np.linalg.norm(b - a) <= _THIN:
        return {"kind": "sphere", "radius": radius, "center": a.tolist()}
    return {"kind": "capsule", "radius": radius, "a": a.tolist(), "b": b.tolist()}


def _fewer(vertices: Array, meshes: Meshes, owner: str) -> Array:
    """Return the vertices that are farthest in some directions, if there are many; the hull of others would be too large."""
    if len(vertices) <= meshes.vertices:
        return vertices
    directions = sphere_points(meshes.vertices)
    farthest = np.zeros(len(directions), dtype=np.int64)
    most = np.full(len(directions), -np.inf)
    for begin in range(0, len(vertices), 4096):
        heights = vertices[begin : begin + 4096] @ directions.T
        best = heights.argmax(axis=0)
        value = np.take_along_axis(heights, best[None], axis=0)[0]
        better = value > most
        farthest[better], most[better] = best[better] + begin, value[better]
    kept = np.unique(farthest)
    meshes.drawn_by_fewer(owner, len(vertices))
    return vertices[kept]


def _widened(points: Array, radius: float, meshes: Meshes, owner: str) -> Array:
    """Return points whose hull is about all within a radius of a hull; they are on its surface."""
    corners = points if len(points) <= _FEW else hulled(points)[0]
    around = sphere_points(42 if len(corners) <= 60 else 12)
    return (corners[:, None] + radius * around).reshape(-1, 3)


def _box_corners(box: Box) -> Array:
    """Return points on a rounded box, in its own frame, whose hull it is up to the steps of its edges."""
    turn = np.linspace(0.0, np.pi / 2, _QUARTER + 1)
    arc = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    patch = np.array([[c * np.cos(b), c * np.sin(b), s] for c, s in arc for b in turn])
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    return (signs[:, None] * (box.size / 2 + box.rounding * patch)).reshape(-1, 3)


def _cylinder_rims(cylinder: Cylinder) -> Array:
    """Return points on a rounded cylinder, in its own frame, whose hull it is up to the steps of its edges."""
    turn = np.linspace(0.0, 2 * np.pi, _ROUND + 1)[:-1]
    tilt = np.linspace(0.0, np.pi / 2, _QUARTER + 1)
    radius, height = cylinder.radius + cylinder.rounding * np.cos(tilt), cylinder.length / 2 + cylinder.rounding * np.sin(tilt)
    rings = [
        np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(_ROUND, side * z)])
        for r, z in zip(radius.tolist(), height.tolist(), strict=True)
        for side in (-1.0, 1.0)
    ]
    return np.concatenate(rings)


@lru_cache(maxsize=16)
def sphere_points(count: int) -> Array:
    """Return unit vectors (count, 3), evenly spread (a Fibonacci spiral)."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    flat = np.sqrt(1 - z**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])


def hulled(points: Array) -> tuple[Array, Triangles]:
    """Return the convex hull of points (k, 3): vertices, and triangles counter-clockwise seen from outside.

    A flat hull has both sides.
    """
    from scipy.spatial import ConvexHull, QhullError  # pyright: ignore[reportMissingTypeStubs]

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return _flat(points)
    kept, place = hull.vertices, np.zeros(len(points), dtype=np.int64)
    place[kept] = np.arange(len(kept))
    corners = points[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normals * hull.equations[:, :3]).sum(axis=1) < 0
    triangles = hull.simplices.astype(np.int64)
    triangles[inward] = triangles[inward][:, ::-1]
    return points[kept], place[triangles]


def _flat(points: Array) -> tuple[Array, Triangles]:
    """Return the two sides of a flat hull."""
    from spacearm.show.outlines import hull

    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][-1]
    rim = points[hull((points - middle) @ axes_along(normal)[:, :2])]
    fan = np.array([[0, i, i + 1] for i in range(1, max(len(rim) - 1, 2))], dtype=np.int64) % len(rim)
    return rim, np.concatenate([fan, fan[:, ::-1]])
