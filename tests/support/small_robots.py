"""Robots of a few joints, made by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from spacearm.robot import Frame, Joint, Robot


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
