"""Shapes as triangles to be drawn. Corners of flat faces are not shared between faces, so that their edges look sharp.

A rounding is drawn by points around each vertex: up to 2 % of its radius is missing. Proofs have the shapes themselves.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

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

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

_SIDES = 48  # of a circle
_RINGS = 12  # from pole to pole, even
_COARSE_SIDES, _COARSE_RINGS = 16, 8  # of many balls
LINE = 0.004
"""[m] What has no thickness, as links that are lines, is drawn as a rod of this radius."""

_THIN = 1e-9  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """A mesh to be drawn.

    Attributes:
        points: (k, 3) [m].
        faces: (m, 3) indices of points, counter-clockwise seen from outside.
    """

    points: Array
    faces: Faces

    def moved(self, T: Array) -> Triangles:
        """Return it with every point p at T p, T (4, 4)."""
        return Triangles(self.points @ T[:3, :3].T + T[:3, 3], self.faces)


def joined(parts: Iterable[Triangles]) -> Triangles:
    """Return meshes as one."""
    points, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    for part in parts:
        points.append(part.points)
        faces.append(part.faces + count)
        count += len(part.points)
    return Triangles(np.concatenate(points), np.concatenate(faces))


def triangles_of(shape: ConvexShape, line: float = LINE) -> Triangles:
    """Return a convex shape's surface, in the frame of its numbers; `line` [m] is the radius of what has no thickness."""
    if isinstance(shape, Sphere):
        ball = unit_ball()
        return Triangles(shape.center + shape.radius * ball.points, ball.faces)
    if isinstance(shape, Capsule):
        return _rod(shape.a, shape.b, shape.radius)
    if isinstance(shape, Cylinder):
        drum = _drum(shape.radius, shape.length)
        return (hulled(drum.points, shape.rounding) if shape.rounding else drum).moved(shape.pose)
    if isinstance(shape, Box):
        corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * shape.size
        return hulled(corners, shape.rounding).moved(shape.pose)
    return _polytope(shape, line)


def triangles_of_obstacle(obstacle: Obstacle, *, extent: float) -> Triangles:
    """Return an obstacle's surface, in the frame of its numbers.

    Args:
        obstacle: of any kind; a set of balls is drawn coarsely.
        extent: half the edge of the square that a half-space's plane is drawn as [m].
    """
    if isinstance(obstacle, HalfSpace):
        u, v, _ = _plane(obstacle.normal)
        corners = np.array([obstacle.point + extent * (a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        return Triangles(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    if isinstance(obstacle, PolytopeSet):
        return joined(_polytope(piece) for piece in obstacle.pieces)
    if isinstance(obstacle, SphereSet):
        ball = unit_ball(_COARSE_SIDES, _COARSE_RINGS)
        balls = zip(obstacle.centers, obstacle.radii, strict=True)
        return joined(Triangles(center + radius * ball.points, ball.faces) for center, radius in balls)
    return triangles_of(obstacle)


def _plane(normal: Array) -> Array:
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(normal, u), normal], dtype=np.float64)


@cache
def unit_ball(sides: int = _SIDES, rings: int = _RINGS * 2) -> Triangles:
    """Return a ball of radius 1, its poles on z."""
    tilt = np.linspace(0, np.pi, rings + 1)
    return _revolved(np.column_stack([np.sin(tilt), np.cos(tilt)]), sides)


def _revolved(outline: Array, sides: int) -> Triangles:
    """Return the surface of an outline (k, 2) of radius and height, from top to bottom, turned about z."""
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    radius, height = outline[:, :1], np.repeat(outline[:, 1:], sides, axis=1)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=-1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(len(outline) - 1), np.arange(sides), indexing="ij")
    a = row * sides + column
    b = row * sides + (column + 1) % sides
    quads = np.stack([a, a + sides, b + sides, b], axis=-1).reshape(-1, 4)
    faces = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    corners = points[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Triangles(points, faces[area > 0])


def _rod(a: Array, b: Array, radius: float) -> Triangles:
    """Return a capsule."""
    along = b - a
    length = float(np.linalg.norm(along))
    tilt = np.linspace(0, np.pi / 2, _RINGS // 2 + 1)
    cap = np.column_stack([radius * np.sin(tilt), radius * np.cos(tilt)])
    outline = np.vstack([cap + np.array([0, length / 2]), (cap * [1, -1] - np.array([0, length / 2]))[::-1]])
    T = np.eye(4)
    if length > 0:
        T[:3, :3] = _plane(along / length).T
    T[:3, 3] = (a + b) / 2
    return _revolved(outline, _SIDES).moved(T)


def _drum(radius: float, length: float) -> Triangles:
    """Return a cylinder about its middle, along z, with sharp edges."""
    high, low = (radius, length / 2), (radius, -length / 2)
    return joined(
        [
            _revolved(np.array([(0.0, length / 2), high]), _SIDES),
            _revolved(np.array([high, low]), _SIDES),
            _revolved(np.array([low, (0.0, -length / 2)]), _SIDES),
        ]
    )


def _polytope(shape: Polytope, line: float = LINE) -> Triangles:
    vertices, rounding = shape.vertices, shape.rounding
    if len(np.unique(vertices, axis=0)) <= 2:  # a point or a segment
        return _rod(vertices[0], vertices[-1], max(rounding, line))
    return hulled(vertices, rounding)


def hulled(points: Array, rounding: float = 0.0) -> Triangles:
    """Return the hull of points (k, 3), with a rounding [m]; a flat one is a thin plate."""
    from scipy.spatial import ConvexHull, QhullError

    if rounding > _THIN:
        ball = unit_ball(12, 8)
        points = (points[:, None] + rounding * np.unique(ball.points, axis=0)).reshape(-1, 3)
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        size = float(np.ptp(points, axis=0).max()) or 1e-3
        corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 1e-4 * size
        hull = ConvexHull((points[:, None] + corners).reshape(-1, 3))
    corners = np.asarray(hull.points)[hull.simplices]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ki,ki->k", normal, hull.equations[:, :3]) < 0
    corners[inward] = corners[inward][:, ::-1]
    return Triangles(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
