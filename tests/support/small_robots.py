"""Robots of a few joints, made by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from spacearm.geometry import Sphere
from spacearm.robot import Frame, Joint, LinkShape, Robot


def two_link(**changes: Any) -> Robot:
    """A planar arm with two links of 1 m."""
    along_x = np.eye(4)
    along_x[0, 3] = 1.0
    fields: dict[str, Any] = {
        "name": "two_link",
        "joints": (
            Joint(name="shoulder", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
            Joint(name="elbow", kind="revolute", parent=0, T_parent_joint=along_x),
        ),
        "frames": (
            Frame(name="base", joint=-1, T_joint_frame=np.eye(4)),
            Frame(name="hand", joint=1, T_joint_frame=along_x),
        ),
        "tip": "hand",
        "lower": (-1, -2),
        "upper": (1, 2),
        "velocity": (1, 1),
        "acceleration": (2, 2),
    }
    return Robot(**(fields | changes))


CARRIAGE_RADIUS = 0.1  # [m] of what slides


def slider(*shapes: LinkShape, pairs: tuple[tuple[str, str], ...] = ()) -> Robot:
    """A carriage that slides along x and z: its place is (q0, 0, q1)."""
    to_x, to_z = np.eye(4), np.eye(4)
    to_x[:3, :3] = np.column_stack([(0, 1, 0), (0, 0, 1), (1, 0, 0)])
    to_z[:3, :3] = to_x[:3, :3].T
    return Robot(
        name="slider",
        joints=(
            Joint(name="x", kind="prismatic", parent=-1, T_parent_joint=to_x),
            Joint(name="z", kind="prismatic", parent=0, T_parent_joint=to_z),
        ),
        shapes=shapes or (LinkShape(name="carriage", joint=1, shape=Sphere((0, 0, 0), CARRIAGE_RADIUS)),),
        self_pairs=pairs,
        frames=(Frame(name="tip", joint=1, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=(-3, -3),
        upper=(3, 3),
        velocity=(1, 1),
        acceleration=(1, 1),
    )
