"""Obstacles from MoveIt's shapes, however they were written."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.errors import FileFormatError, SceneError
from spacearm.scene import Box, Cylinder, HalfSpace, Obstacle, Sphere

Array = NDArray[np.float64]

PRIMITIVES = {"box": ("x", "y", "z"), "sphere": ("radius",), "cylinder": ("height", "radius"), "cone": ("height", "radius")}
"""Kinds, and their dimensions in the order of ROS's messages."""

NUMBERED = {1: "box", 2: "sphere", 3: "cylinder", 4: "cone", 5: "prism"}
"""The kinds in ROS's `shape_msgs/SolidPrimitive`."""

MOST_OBSTACLES = 100_000

_ON_PLANE = 1e-9  # [m] nearer to a plane than this the base stands on it


@dataclass(frozen=True, slots=True)
class Made:
    """A shape whose name and pose are still to come; `make(T, name)` gives the obstacle."""

    make: Callable[[Array, str], Obstacle]


def primitive(kind: str, size: Array) -> Made:
    """Return a solid in the order of ROS: box x, y, z; sphere radius; cylinder and cone height, radius.

    A cone, which stands on its base about the middle of its height, becomes the cylinder that encloses it.
    """
    if kind == "box":
        return Made(lambda T, name: Box(size, T, name=name))
    if kind == "sphere":
        return Made(lambda T, name: Sphere(T[:3, 3], float(size[0]), name=name))
    return Made(lambda T, name: Cylinder(float(size[1]), float(size[0]), T, name=name))


def plane(coefficients: ArrayLike, base: ArrayLike = (0.0, 0.0, 0.0)) -> Made:
    """Return the half-space beyond a plane a x + b y + c z + d = 0.

    MoveIt's planes have two sides and no inside. The robot's base (3,) [m] does not get through one, so the side of the base
    frame's origin is the free one; where it is on the plane, the side that the normal (a, b, c) points to.
    """
    *normal, d = (float(value) for value in np.asarray(coefficients))

    def make(T: Array, name: str) -> Obstacle:
        length = math.hypot(*normal)
        if not 1e-150 < length < 1e150:
            raise SceneError(
                f"the plane's normal is {normal}, expected a direction; give a, b, c and d of ax + by + cz + d = 0"
            )
        n = T[:3, :3] @ (np.array(normal) / length)
        point = T[:3, 3] - n * (d / length)
        return HalfSpace(-n if n @ (point - np.asarray(base)) > _ON_PLANE else n, point, name=name)

    return Made(make)


def mesh(vertices: Array, triangles: NDArray[np.int64], *, excess: float | None) -> Made:
    """Return balls that enclose a mesh of vertices (v, 3) [m] and triangles (n, 3), which count vertices from 0."""

    def make(T: Array, name: str) -> Obstacle:
        from spacearm.scene.enclose import enclose_mesh

        if not len(triangles):
            raise SceneError("the mesh has no triangles, expected at least one")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            worst = int(triangles.min()) if triangles.min() < 0 else int(triangles.max())
            raise SceneError(f"a triangle has vertex {worst}, expected 0 to {len(vertices) - 1}")
        return enclose_mesh(vertices[triangles], pose=T, excess=excess, name=name)

    return Made(make)


def mesh_file(filename: str, directory: Path, scale: Array, *, excess: float | None) -> Made:
    """Return balls that enclose a mesh in a file.

    Args:
        filename: a path, relative to the directory unless it is absolute, or a URI, file:// or package://; the package is
            looked for in the directories above.
        directory: of the file that names it.
        scale: (3,) factors of its coordinates.
        excess: how far the balls may stand out of it [m].
    """

    def make(T: Array, name: str) -> Obstacle:
        from spacearm.robot.envelope import found_mesh
        from spacearm.scene.enclose import enclose_mesh

        path = found_mesh(filename, directory)
        if path is None:
            raise FileFormatError(
                f"the mesh '{filename}' is not there, expected it beside the file that names it, or for package:// in a folder "
                "above; put it there"
            )
        return enclose_mesh(path, pose=T, scale=scale, excess=excess, name=name)

    return Made(make)


def named(name: str, number: int, count: int) -> str:
    """Return an obstacle's name: its object's, with a number from 1 where the object has several shapes."""
    return name if count == 1 else f"{name} {number + 1}".strip()
