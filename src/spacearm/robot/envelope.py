"""Capsules that enclose a URDF's collision shapes.

A sphere is exact. A cylinder's capsule has its axis, radius and length; it is larger by the two rounded ends.
A box's runs along its longest edge, with half the diagonal of the other two as its radius. A mesh's runs
along the longest side of the vertices' axis-aligned box.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown_error
from spacearm.errors import RobotError

if TYPE_CHECKING:
    import yourdfpy

Array = NDArray[np.float64]
Segment = tuple[Array, Array, float]
"""A capsule without a name: two ends, (3,) each, and a radius [m]."""

_OTHERWISE = 'or load with collision="none"'


def link_capsules(link: yourdfpy.Link, directory: Path) -> Iterator[tuple[str, Array, Array, float]]:
    """Enclose each collision shape of a link: (link, a, b, radius), points (3,) in the link's frame [m].

    Args:
        link: as yourdfpy read it.
        directory: of the URDF, where the search for meshes begins.

    Raises:
        RobotError: a mesh that is missing or cannot be read.
    """
    for collision in link.collisions:
        a, b, radius = _enclosed(collision.geometry, link.name, directory)
        T = np.eye(4) if collision.origin is None else collision.origin
        yield link.name, T[:3, :3] @ a + T[:3, 3], T[:3, :3] @ b + T[:3, 3], radius


def box_capsule(size: Array) -> Segment:
    """Enclose a box about the origin, edges along the axes, of edge lengths (3,) [m]."""
    along = int(np.argmax(size))
    end = np.zeros(3)
    end[along] = size[along] / 2
    return -end, end, float(np.linalg.norm(np.delete(size, along))) / 2


def points_capsule(points: Array) -> Segment:
    """Enclose points (k, 3) [m], and so their convex hull.

    The axis runs through the middle of their axis-aligned box, along its longest side. The radius is that of
    the point farthest from the axis, and the ends are pulled in as far as the points allow: a point at
    distance d from the axis and s along it is inside if the segment comes within sqrt(radius^2 - d^2) of s.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    along = int(np.argmax(high - low))
    middle = (low + high) / 2
    across = np.delete(points - middle, along, axis=1)  # (k, 2)
    distance = np.linalg.norm(across, axis=1)
    radius = float(distance.max())
    slack = np.sqrt((radius - distance) * (radius + distance))
    last, first = float((points[:, along] - slack).max()), float((points[:, along] + slack).min())
    if last < first:  # one ball holds them all, and may be put anywhere between
        first = last = (first + last) / 2
    a, b = middle.copy(), middle.copy()
    a[along], b[along] = first, last
    return a, b, radius


def _enclosed(geometry: Any, link: str, directory: Path) -> Segment:
    if geometry.sphere is not None:
        return np.zeros(3), np.zeros(3), geometry.sphere.radius
    if geometry.cylinder is not None:
        end = np.array([0.0, 0.0, geometry.cylinder.length / 2])
        return -end, end, geometry.cylinder.radius
    if geometry.box is not None:
        return box_capsule(geometry.box.size)
    scale = 1.0 if geometry.mesh.scale is None else geometry.mesh.scale
    return points_capsule(_mesh_vertices(geometry.mesh.filename, link, directory) * scale)


def _mesh_vertices(filename: str, link: str, directory: Path) -> Array:
    path = _found(filename, directory)
    if path is None:
        raise RobotError(
            f"link '{link}' has the collision mesh '{filename}', which is not there; put the file there, {_OTHERWISE}"
        )
    import trimesh

    try:
        vertices = np.asarray(trimesh.load_scene(path).to_mesh().vertices, dtype=np.float64)
        reason = "it has no vertices" if not vertices.size else "it has vertices that are not finite"
    except Exception as error:  # each of trimesh's loaders has exceptions of its own
        vertices, reason = np.empty((0, 3)), shown_error(error)
    if not vertices.size or not np.isfinite(vertices).all():
        raise RobotError(
            f"link '{link}' has the collision mesh '{filename}', which cannot be read ({reason}); repair the file, {_OTHERWISE}"
        )
    return vertices


def _found(filename: str, directory: Path) -> Path | None:
    """Look for a mesh: beside the URDF, and for package:// in the directories above it as well."""
    scheme, separator, rest = filename.partition("://")
    if not separator or scheme == "file":
        path = directory / (rest if separator else filename)
        return path if os.path.isfile(path) else None
    inside_package = Path(*Path(rest).parts[1:])
    for base in (directory, *directory.resolve().parents):
        for path in (base / rest, base / inside_package):
            if os.path.isfile(path):  # which, unlike Path.is_file, answers False to a name that is too long
                return path
    return None
