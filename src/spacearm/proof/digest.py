"""Hashes that tell whether two problems, or two trajectories, are the same."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from spacearm.motion import AnyTrajectory
from spacearm.motion.plain import trajectory_as_dict
from spacearm.proof.stance import BaseSetup
from spacearm.robot import Robot
from spacearm.robot.plain import robot_as_dict
from spacearm.scene import Scene
from spacearm.scene.plain import scene_as_list

PROVENANCE = ("source", "notes", "apart", "unchecked", "collision", "solid", "unweighed")
"""What a robot tells of where it is from, and of what follows from the rest: it is no part of what a hash is about."""


def digest(values: Any) -> str:
    """Return the SHA-256 of plain values, in hexadecimal; the order of keys does not matter."""
    return hashlib.sha256(json.dumps(values, sort_keys=True, allow_nan=False).encode()).hexdigest()


def problem_digest(robot: Robot, scene: Scene, setup: BaseSetup) -> str:
    """Return the SHA-256 of a robot, a scene and a base; where they were read from and how does not matter.

    A base that is fixed at the origin adds nothing, so that plans written before bases could float keep their hashes.
    """
    values = robot_as_dict(robot)
    for key in ("base", *PROVENANCE):  # what the problem says of the base goes before what the robot does
        values.pop(key, None)
    held: dict[str, Any] = {}
    if setup.base != "fixed" or not setup.at_origin:
        held = {"base": setup.base, "base_start": setup.start.tolist()}
    if setup.drifting:
        held["momentum"] = [setup.linear.tolist(), setup.angular.tolist()]
    return digest({"robot": values, "obstacles": scene_as_list(scene, notes=False), **held})


def trajectory_digest(trajectory: AnyTrajectory) -> str:
    """Return the SHA-256 of a trajectory's path and time law."""
    values = trajectory_as_dict(trajectory)
    for provenance in ("notes", "joints"):
        values.pop(provenance, None)
    return digest(values)
