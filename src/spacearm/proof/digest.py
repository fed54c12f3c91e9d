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

_PROVENANCE = ("source", "notes", "apart", "unchecked", "collision", "solid", "unweighed")
"""What a robot tells of where it is from, and of what follows from the rest: it is no part of what a hash is about."""


def digest(values: Any) -> str:
    """Return the SHA-256 of plain values, in hexadecimal; the order of keys does not matter.

    Every hash in our files is this one. A number counts with all its digits, as JSON writes it.
    """
    return hashlib.sha256(json.dumps(values, sort_keys=True, allow_nan=False).encode()).hexdigest()


def canonical(robot: Robot, scene: Scene) -> dict[str, Any]:
    """Return a robot and a scene as the plain values that every hash is made of.

    Left out are notes, where the robot was read from, and how its file says that its base is held: the problem says that.
    """
    values = robot_as_dict(robot)
    for key in ("base", *_PROVENANCE):
        values.pop(key, None)
    return {"robot": values, "obstacles": scene_as_list(scene, notes=False)}


def problem_digest(robot: Robot, scene: Scene, setup: BaseSetup) -> str:
    """Return the SHA-256 of what a certificate is about: a robot, a scene and a base; start and goal do not matter.

    The hash of a whole problem, `planner.files.plans.problem_hash`, is of the same values and of start, goal and what is asked
    of the base. A base that is fixed at the origin adds nothing here, so that certificates from before bases could float keep
    their hashes.
    """
    held: dict[str, Any] = {}
    if setup.base != "fixed" or not setup.at_origin:
        held = {"base": setup.base, "base_start": setup.start.tolist()}
    if setup.drifting:
        held["momentum"] = [setup.linear.tolist(), setup.angular.tolist()]
    return digest({**canonical(robot, scene), **held})


def trajectory_digest(trajectory: AnyTrajectory) -> str:
    """Return the SHA-256 of a trajectory's path and time law."""
    values = trajectory_as_dict(trajectory)
    for provenance in ("notes", "joints"):
        values.pop(provenance, None)
    return digest(values)
