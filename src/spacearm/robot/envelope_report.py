"""How closely a robot's envelope follows its collision shapes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_whole
from spacearm.errors import RobotError
from spacearm.reading import located
from spacearm.robot.capsule_fit import Segment, across, union_volume
from spacearm.robot.envelope import Shape, enclosed, link_shapes
from spacearm.robot.segments import point_segment_distance
from spacearm.robot.urdf import CAPSULES_PER_SHAPE, parsed_urdf

Array = NDArray[np.float64]

_ON_SURFACE = 1500  # points on each capsule
_IN_VOLUME = 60_000  # points in the box around all of them


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkEnvelope:
    """The envelope of one link.

    Attributes:
        link: its name.
        shapes: the kinds of its collision shapes: "sphere", "cylinder", "box" or "mesh".
        capsules: how many capsules enclose them.
        excess: how far the envelope stands out of the shapes, at most [m].
        volume: of the envelope [m^3].
        ratio: of that volume to the sum of the shapes' own [-]; inf if they have none.
    """

    link: str
    shapes: tuple[str, ...]
    capsules: int
    excess: float
    volume: float
    ratio: float


def envelope_report(urdf: str | os.PathLike[str], *, capsules_per_shape: int = CAPSULES_PER_SHAPE) -> tuple[LinkEnvelope, ...]:
    """Measure the envelope that `load_robot` gives to the links of a URDF file.

    The excess is the greatest found among 1500 points on each capsule, and the volume is that of 60,000 points
    spread evenly: both are good to about two percent.

    Args:
        urdf: path of the file.
        capsules_per_shape: as in `load_robot`.

    Returns:
        One record for each link with collision shapes.

    Raises:
        FileFormatError: no such file, or no URDF.
        RobotError: a mesh that cannot be read, or `capsules_per_shape` below 1.
    """
    count = as_whole("capsules_per_shape", capsules_per_shape, RobotError, at_least=1)
    links = parsed_urdf(urdf).links
    with located(urdf):
        found = [(link.name, link_shapes(link, Path(urdf).parent)) for link in links]
    return tuple(_measured(name, shapes, enclosed(shapes, count)) for name, shapes in found if shapes)


def _measured(link: str, shapes: list[Shape], capsules: list[Segment]) -> LinkEnvelope:
    volume = union_volume(capsules, _IN_VOLUME)
    own = sum(_shape_volume(shape) for shape in shapes)
    return LinkEnvelope(
        link=link,
        shapes=tuple(shape.kind for shape in shapes),
        capsules=len(capsules),
        excess=greatest_excess(shapes, capsules),
        volume=volume,
        ratio=volume / own if own > 0 else math.inf,
    )


def greatest_excess(shapes: list[Shape], capsules: list[Segment]) -> float:
    """Return how far capsules stand out of the shapes that they enclose, at most [m], by points on each capsule."""
    points = np.concatenate([_surface(capsule) for capsule in capsules])
    depth = np.array([point_segment_distance(points, capsule.a, capsule.b) - capsule.radius for capsule in capsules])
    outer = points[(depth > -1e-9).all(axis=0)]
    if not len(outer):
        return 0.0
    distance = np.min([_distance_to(shape)(_inside_of(shape.T_link_shape, outer)) for shape in shapes], axis=0)
    return float(max(distance.max(), 0.0))


def _surface(capsule: Segment) -> Array:
    """Spread points evenly over a capsule's surface, (k, 3)."""
    axis = capsule.b - capsule.a
    length = float(np.linalg.norm(axis))
    z = axis / length if length > 0 else np.array([0.0, 0.0, 1.0])
    (x,), (y,) = across(z[None])
    k = np.arange(_ON_SURFACE)
    turn = k * math.pi * (3 - math.sqrt(5))
    height = (2 * k + 1) / _ON_SURFACE * (length / 2 + capsule.radius) - (length / 2 + capsule.radius)
    height[0], height[-1] = -length / 2 - capsule.radius, length / 2 + capsule.radius  # the poles stand out most
    past = np.maximum(np.abs(height) - length / 2, 0.0)
    radius = np.sqrt(np.maximum(capsule.radius**2 - past**2, 0.0))
    around = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    return (capsule.a + capsule.b) / 2 + height[:, None] * z + radius[:, None] * around


def _shape_volume(shape: Shape) -> float:
    if shape.kind == "sphere":
        return 4 / 3 * math.pi * shape.size[0] ** 3
    if shape.kind == "cylinder":
        return math.pi * shape.size[0] ** 2 * shape.size[1]
    if shape.kind == "box":
        return math.prod(shape.size)
    assert shape.triangles is not None
    a, b, c = np.moveaxis(shape.triangles - shape.triangles.mean(axis=(0, 1)), 1, 0)
    return abs(float(np.einsum("ki,ki->", a, np.cross(b, c)))) / 6


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
