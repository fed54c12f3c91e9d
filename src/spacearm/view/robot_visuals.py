"""How a robot's file draws it, as triangles by joint: what a report shows, unpacked. What is missing is said."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Box, Capsule, Cylinder, Sphere
from spacearm.report.page_motion import matrix
from spacearm.report.report_meshes import Meshes
from spacearm.report.report_page import unpacked, unquantised
from spacearm.report.report_visuals import visual_parts
from spacearm.robot import Robot
from spacearm.view.colors import BASE, LINKS, Color
from spacearm.view.shape_meshes import Triangles, triangles_of

Array = NDArray[np.float64]


class Visuals(NamedTuple):
    """What a robot's file draws.

    Attributes:
        parts: joint (-1: the base), triangles in its frame, and colour.
        notes: what is not drawn, or by fewer triangles, a sentence each.
    """

    parts: list[tuple[int, Triangles, Color]]
    notes: tuple[str, ...]


def visuals_of(robot: Robot) -> Visuals:
    """Return what a robot is drawn with; nothing for one whose file draws nothing."""
    if not robot.visuals:
        return Visuals([], ())
    meshes = Meshes()
    parts = [
        (part["joint"], _triangles(part["geometry"], meshes), _color(part.get("color"), part["joint"]))
        for part in visual_parts(robot, meshes)
    ]
    return Visuals(parts, tuple(meshes.said()))


def _triangles(geometry: dict[str, Any], meshes: Meshes) -> Triangles:
    kind = geometry["kind"]
    if kind == "sphere":
        return triangles_of(Sphere(geometry["center"], geometry["radius"]))
    if kind == "capsule":
        return triangles_of(Capsule(geometry["a"], geometry["b"], geometry["radius"]))
    T = matrix(geometry["T"])
    if kind == "box":
        return triangles_of(Box(geometry["size"])).moved(T)
    if kind == "cylinder":
        return triangles_of(Cylinder(geometry["radius"], geometry["length"])).moved(T)
    mesh = meshes.items[geometry["mesh"]]
    points = unquantised(mesh["positions"], mesh["low"], mesh["high"])
    faces = unpacked(mesh["indices"]).reshape(-1, 3).astype(np.int64)
    return sharp(points * np.array(geometry.get("scale", (1.0, 1.0, 1.0))), faces).moved(T)


def sharp(points: Array, faces: NDArray[np.int64]) -> Triangles:
    """Return a mesh whose faces share no corners, so that edges look sharp."""
    return Triangles(points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3))


def _color(css: str | None, joint: int) -> Color:
    if css is None or len(css) != 7 or css[0] != "#":
        return BASE if joint < 0 else LINKS[joint % 2]
    red, green, blue = (int(css[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue
