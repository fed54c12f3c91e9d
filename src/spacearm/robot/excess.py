"""How far capsules stand out of the shapes that they enclose, by points spread over each capsule."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.capsule_closer import surface_points
from spacearm.robot.capsule_fit import Segment
from spacearm.robot.segments import point_segment_distance

if TYPE_CHECKING:
    from spacearm.robot.envelope import Shape

Array = NDArray[np.float64]

_ON_SURFACE = 1500  # points on each capsule
_ON_MESH = 20_000  # points spread over a mesh, for distances that are about right


def greatest_excess(shapes: Sequence[Shape], capsules: Sequence[Segment]) -> float:
    """Return how far capsules stand out of the shapes that they enclose, at most [m], by points on each capsule."""
    return Excess(shapes)(capsules)


class Excess:
    """Measures capsules around shapes as `greatest_excess` does; what can be prepared is, once."""

    def __init__(self, shapes: Sequence[Shape]) -> None:
        """Take the shapes that are enclosed."""
        self._shapes, self._distances = shapes, [_distance_to(shape) for shape in shapes]
        self._quick = [_about(shape) or distance for shape, distance in zip(shapes, self._distances, strict=True)]

    def about(self, points: Array) -> Array:
        """Return about how far points (m, 3) are from the shapes, 0 inside, quickly; from a mesh: from its surface [m]."""
        return self._least(points, self._quick)

    def _least(self, points: Array, distances: Sequence[Callable[[Array], Array]]) -> Array:
        places = [_inside_of(shape.T_link_shape, points) for shape in self._shapes]
        return np.min([distance(at) for distance, at in zip(distances, places, strict=True)], axis=0)

    def __call__(self, capsules: Sequence[Segment]) -> float:
        """Return how far capsules stand out of the shapes, at most [m]."""
        points = np.concatenate([surface_points(capsule, _ON_SURFACE) for capsule in capsules])
        depth = np.array([point_segment_distance(points, capsule.a, capsule.b) - capsule.radius for capsule in capsules])
        outer = points[(depth > -1e-9).all(axis=0)]
        return float(max(self._least(outer, self._distances).max(), 0.0)) if len(outer) else 0.0


def _inside_of(T: Array, points: Array) -> Array:
    return (points - T[:3, 3]) @ T[:3, :3]


def _distance_to(shape: Shape) -> Callable[[Array], Array]:
    """Return a function that gives the distance of points (k, 3), in the shape's frame, from it; 0 inside."""
    if shape.kind == "sphere":
        return lambda points: np.maximum(np.linalg.norm(points, axis=1) - shape.size[0], 0.0)
    if shape.kind == "box":
        return lambda points: np.linalg.norm(np.maximum(np.abs(points) - np.array(shape.size) / 2, 0.0), axis=1)
    if shape.kind == "cylinder":
        radius, length = shape.size
        return lambda points: np.hypot(
            np.maximum(np.hypot(points[:, 0], points[:, 1]) - radius, 0.0), np.maximum(np.abs(points[:, 2]) - length / 2, 0.0)
        )
    assert shape.triangles is not None
    return _distance_to_mesh(shape.triangles)


def _about(shape: Shape) -> Callable[[Array], Array] | None:
    """Return a function for a mesh that measures the distance from points spread over its surface; None for other shapes."""
    from scipy.spatial import KDTree

    if shape.triangles is None:
        return None
    a, b, c = np.moveaxis(shape.triangles, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(0)
    which = rng.choice(len(area), _ON_MESH, p=area / area.sum()) if area.sum() > 0 else np.zeros(1, dtype=int)
    u, v = rng.random((2, len(which), 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    tree = KDTree(np.concatenate([a[which] + u * (b - a)[which] + v * (c - a)[which], shape.triangles.reshape(-1, 3)]))
    return lambda points: tree.query(points)[0]


def _distance_to_mesh(triangles: Array) -> Callable[[Array], Array]:
    import coal  # pyright: ignore[reportMissingImports]

    surface = coal.BVHModelOBBRSS()
    surface.beginModel(len(triangles), 3 * len(triangles))
    for a, b, c in triangles:
        surface.addTriangle(a, b, c)
    surface.endModel()

    def distance(points: Array) -> Array:
        out = np.empty(len(points))
        still, ball = coal.Transform3s.Identity(), coal.Sphere(0.0)
        for i, point in enumerate(points):
            at = coal.Transform3s(np.eye(3), point)
            out[i] = coal.distance(ball, at, surface, still, coal.DistanceRequest(), coal.DistanceResult())
        return np.maximum(out, 0.0)

    return distance
