"""How a robot's file draws it, as triangles by joint: what a report shows, unpacked. What is missing is said."""

from __future__ import annotations

import base64
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Box, Capsule, Cylinder, Sphere
from spacearm.report.report_meshes import Meshes
from spacearm.report.report_visuals import visual_parts
from spacearm.robot import Robot
from spacearm.view.colors import BASE, LINKS, Color
from spacearm.view.shape_meshes import Triangles, triangles_of

Array = NDArray[np.float64]

_TYPES = {"u8": "u1", "u16": "<u2", "u32": "<u4", "f32": "<f4", "f64": "<f8"}


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
    T = np.vstack([np.reshape(geometry["T"], (3, 4)), [0.0, 0.0, 0.0, 1.0]])
    if kind == "box":
        return triangles_of(Box(geometry["size"])).moved(T)
    if kind == "cylinder":
        return triangles_of(Cylinder(geometry["radius"], geometry["length"])).moved(T)
    mesh = meshes.items[geometry["mesh"]]
    low, high = np.array(mesh["low"]), np.array(mesh["high"])
    points = low + (high - low) * _unpacked(mesh["positions"]).reshape(-1, 3) / 65535
    faces = _unpacked(mesh["indices"]).reshape(-1, 3).astype(np.int64)
    return sharp(points * np.array(geometry.get("scale", (1.0, 1.0, 1.0))), faces).moved(T)


def sharp(points: Array, faces: NDArray[np.int64]) -> Triangles:
    """Return a mesh whose faces share no corners, so that edges look sharp."""
    return Triangles(points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3))


def _unpacked(packed: str) -> Array:
    kind, _, text = packed.partition(":")
    return np.frombuffer(base64.b64decode(text), dtype=_TYPES[kind]).astype(np.float64)


def _color(css: str | None, joint: int) -> Color:
    if css is None or len(css) != 7 or css[0] != "#":
        return BASE if joint < 0 else LINKS[joint % 2]
    red, green, blue = (int(css[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue
