"""Problems of the planar arm, and of arms among clutter."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from kernel import objectives
from spacearm.geometry import Scene, Sphere
from spacearm.planner import PlannerSettings, Problem
from support.dense_samples import planar

SMALL = PlannerSettings(evaluations=300, goal_candidates=2)
BALL = Sphere((1.2, 1.2, 0.0), 0.3, name="ball")


def turn(*, scene: Any = (BALL,), start: Any = (0.0, 0.0), goal: Any = (math.pi / 2, 0.0), robot: Any = None) -> Problem:
    """The planar arm, stretched, from x to y; a ball stands where the stretched arm would pass."""
    return Problem(robot or planar(), Scene(scene), start=start, goal=goal)


def turntable() -> Any:
    limits = dict.fromkeys(("velocity", "acceleration"), (1.0,)) | {"lower": (-np.inf,), "upper": (np.inf,)}
    capsule = planar().capsules[0]
    return planar(joints=planar().joints[:1], capsules=(capsule,), frames=planar().frames[:1], tip="base", **limits)


PROBLEM = turn()


def edited(path: Path, change: Any) -> Path:
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    return path


CLUTTERED = Problem(objectives.thick_arm(), Scene(objectives.CLUTTER), start=objectives.AROUND[0], goal=objectives.AROUND[1])


def walled() -> Problem:
    """A ball that closes the plane, so that a stretched arm on one side never gets to the other."""
    robot = planar(lower=(-1.7, -0.1), upper=(1.7, 0.1))
    return turn(robot=robot, scene=[Sphere((1.2, 0.0, 0.0), 0.4, name="boulder")], start=(-1.5, 0.0), goal=(1.5, 0.0))
