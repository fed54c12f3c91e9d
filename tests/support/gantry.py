"""A hand that goes where (x, y) says: clearances of its motions are known by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from spacearm.geometry import Box, Sphere, pose
from spacearm.motion import AnyTrajectory, PiecewisePath, RecordedTrajectory
from spacearm.robot import Frame, Joint, LinkShape, Robot


def along(axis: str) -> np.ndarray:
    """The pose of a joint whose z is x or y of the frame before it."""
    T = np.eye(4)
    T[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]] if axis == "x" else [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    return T


def gantry(**options: Any) -> Robot:
    """A hand, a ball of 0.1 m, that goes where (x, y) says, and a box bolted to the base 3 m below."""
    across = along("x").T @ along("y")
    given: dict[str, Any] = {
        "name": "gantry",
        "joints": (
            Joint(name="x", kind="prismatic", parent=-1, T_parent_joint=along("x")),
            Joint(name="y", kind="prismatic", parent=0, T_parent_joint=across),
        ),
        "shapes": (
            LinkShape(name="hand", joint=1, shape=Sphere((0, 0, 0), 0.1)),
            LinkShape(name="bus", joint=-1, shape=Box((9, 1, 1), pose((0, -3.5, 0)))),
        ),
        "frames": (Frame(name="hand", joint=1, T_joint_frame=np.eye(4)),),
        "tip": "hand",
        "lower": (-9, -9),
        "upper": (9, 9),
        "velocity": (9, 9),
        "acceleration": (99, 99),
        "self_pairs": (("bus", "hand"),),
    }
    return Robot(**{**given, **options})


GANTRY = gantry()
FLOOR = Box((9, 1, 1), pose((0, -0.5, 0)), name="floor")  # the hand is y - 0.1 above it
POST = Box((0.2, 1, 1), pose((2.1, 0, 0)), name="post")  # and 1.9 - x from it


def hand_path(*points: tuple[float, float], smooth: bool = True) -> AnyTrajectory:
    """Through points of the hand, one second each."""
    q, t = np.array(points), np.arange(len(points), dtype=float)
    if smooth:
        return RecordedTrajectory(GANTRY, PiecewisePath.from_cubic(t, q, np.zeros_like(q)))
    return RecordedTrajectory(GANTRY, PiecewisePath.from_linear(t, q))
