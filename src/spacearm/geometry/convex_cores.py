"""A convex shape as a core with a radius: the shape is all points within the radius of the core.

The core of a sphere is a point, that of a capsule is a segment. A box, a cylinder and a polytope are their own cores, and
their rounding is the radius. The distance of two shapes is that of their cores, less both radii. A shape's support function is
that of its core, plus its radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import product
from spacearm.geometry.shapes import Box, Capsule, ConvexShape, Cylinder, Polytope, Sphere

Array = NDArray[np.float64]
AnyConvex = TypeVar("AnyConvex", bound=ConvexShape)

CoreKind = Literal["point", "segment", "box", "cylinder", "polytope"]

_SIDES = 8  # of the polygon around a cylinder's rim


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Core:
    """The core of a convex shape.

    Attributes:
        kind: what it is. The hull of one point is a "point", that of two is a "segment".
        T: (4, 4) its pose in the frame of the shape's coordinates [m].
        half: (3,) in its own axes [m]. A segment is half[2] long to both sides along z; a box has these half edges; a cylinder
            has the radius half[0] = half[1], and half[2] is half its length along z; of a point and a polytope all are 0.
        vertices: (k, 3) the points whose hull it is, in its own frame [m]; empty for other kinds.
        radius: of the shape around the core [m].
    """

    kind: CoreKind
    T: Array
    half: Array
    vertices: Array
    radius: float


def core_of(shape: ConvexShape) -> Core:
    """Return the core of a convex shape."""
    none = np.zeros((0, 3))
    if isinstance(shape, Sphere):
        return Core(kind="point", T=_at(shape.center), half=np.zeros(3), vertices=none, radius=shape.radius)
    if isinstance(shape, Capsule):
        return _segment(shape.a, shape.b, shape.radius)
    if isinstance(shape, Box):
        return Core(kind="box", T=shape.pose, half=shape.size / 2, vertices=none, radius=shape.rounding)
    if isinstance(shape, Cylinder):
        half = np.array([shape.radius, shape.radius, shape.length / 2])
        return Core(kind="cylinder", T=shape.pose, half=half, vertices=none, radius=shape.rounding)
    if len(shape.vertices) < 3:
        return _segment(shape.vertices[0], shape.vertices[-1], shape.rounding)
    center = (shape.vertices.min(axis=0) + shape.vertices.max(axis=0)) / 2
    return Core(kind="polytope", T=_at(center), half=np.zeros(3), vertices=shape.vertices - center, radius=shape.rounding)


def _segment(a: Array, b: Array, radius: float) -> Core:
    length = math.hypot(*(b - a))
    T = _at((a + b) / 2)
    T[:3, :3] = axes_along(b - a)
    return Core(
        kind="segment" if length > 0 else "point",
        T=T,
        half=np.array([0.0, 0.0, length / 2]),
        vertices=np.zeros((0, 3)),
        radius=radius,
    )


def _at(point: Array) -> Array:
    T = np.eye(4)
    T[:3, 3] = point
    return T


def axes_along(z: Array) -> Array:
    """Return a rotation (3, 3) whose z is along a vector (3,); the identity for the vector 0."""
    length = float(np.linalg.norm(z))
    if length == 0:
        return np.eye(3)
    z = z / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z]).astype(np.float64)


def bounding_points(shape: ConvexShape) -> tuple[Array, float]:
    """Return points (k, 3) and a radius [m]: the shape lies within the radius of the hull of the points.

    It is all of that for every shape but a cylinder, whose rims lie in polygons around them.
    """
    if isinstance(shape, Sphere):
        return shape.center[None], shape.radius
    if isinstance(shape, Capsule):
        return np.stack([shape.a, shape.b]), shape.radius
    if isinstance(shape, Polytope):
        return shape.vertices, shape.rounding
    if isinstance(shape, Box):
        corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * shape.size / 2
        return product(corners, shape.pose[:3, :3].T) + shape.pose[:3, 3], shape.rounding
    turns = 2 * math.pi * np.arange(_SIDES) / _SIDES
    out = shape.radius / math.cos(math.pi / _SIDES) * (1 + 1e-15)
    ring = np.stack([out * np.cos(turns), out * np.sin(turns), np.zeros(_SIDES)], axis=1)
    end = np.array([0.0, 0.0, shape.length / 2])
    return product(np.concatenate([ring - end, ring + end]), shape.pose[:3, :3].T) + shape.pose[:3, 3], shape.rounding


def support(shape: ConvexShape, n: Array) -> Array:
    """Return the support function: the greatest n . x over the shape's points x.

    Args:
        shape: the shape.
        n: (..., 3) directions, of any length, in the frame of the shape's coordinates.

    Returns:
        (...,) [m], times the lengths of n.
    """
    core = core_of(shape)
    own = n @ core.T[:3, :3]
    if core.kind == "polytope":
        reach = (own @ core.vertices.T).max(axis=-1)
    elif core.kind == "cylinder":
        reach = np.hypot(own[..., 0], own[..., 1]) * core.half[0] + np.abs(own[..., 2]) * core.half[2]
    else:
        reach = np.abs(own) @ core.half
    return n @ core.T[:3, 3] + reach + core.radius * np.linalg.norm(n, axis=-1)


def moved_shape(shape: AnyConvex, T: Array) -> AnyConvex:
    """Return a convex shape with every point p of it at T p; its name stays.

    Args:
        shape: the shape.
        T: (4, 4) a rigid transform [m].
    """

    def at(points: Array) -> Array:
        return product(points, T[:3, :3].T) + T[:3, 3]

    if isinstance(shape, Sphere):
        return replace(shape, center=at(shape.center))
    if isinstance(shape, Capsule):
        return replace(shape, a=at(shape.a), b=at(shape.b))
    if isinstance(shape, Polytope):
        return replace(shape, vertices=at(shape.vertices))
    return replace(shape, pose=product(T, shape.pose))
