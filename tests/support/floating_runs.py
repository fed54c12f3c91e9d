"""Motions of a floating base, and a front of plans, to be drawn."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from spacearm.dynamics import Momentum
from spacearm.motion import Motion, Trajectory
from spacearm.planner import ParetoFront
from spacearm.robot import load_robot

ROBOT = load_robot("srs7")
POINTS = np.array([[0, 0, 0, 0.4, 0, 0, 0], [0.5, 0.8, -0.3, 0.9, 0.2, -0.6, 0.4], [0.9, 0.3, 0.6, 1.5, -0.5, 0.4, 0.1]])


@cache
def floating(momentum: float = 0.0) -> Trajectory:
    """Return a motion of a small spacecraft's arm, the base turned and aside at the start."""
    start = np.eye(4)
    start[:3, :3] = Rotation.from_rotvec([0.3, -0.2, 1.1]).as_matrix()
    start[:3, 3] = 0.5, -1.0, 2.0
    given = {"momentum": Momentum(angular=(0, 0, momentum)), "duration": 8.0} if momentum else {}
    return Trajectory(ROBOT, Motion(POINTS), base="floating", base_start=start, **given)  # type: ignore[arg-type]


def front(durations: list[float], angles: list[float], best: list[bool]) -> ParetoFront:
    """Return a front of plans that are not looked at."""
    plans: Any = tuple(object() for _ in durations)
    found = {"durations": np.array(durations), "disturbances": np.radians(angles), "best": np.array(best)}
    return ParetoFront(measure="peak", plans=plans, failed=0, **found)  # type: ignore[arg-type]
