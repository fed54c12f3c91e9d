"""Problems that others have published: the servicer's, and the seed's scene, here on a base that floats."""

from __future__ import annotations

import math

import numpy as np

from spacearm.bench.space.robots import scaled_srs7
from spacearm.momentum import base_at_mass_center
from spacearm.planner import AttitudeGoal, PoseGoal, PositionGoal, Problem
from spacearm.robot import load_robot
from spacearm.robot.rotations import rotation_from_rpy
from spacearm.scene import Scene, Sphere

PUBLISHED_ROTATION = math.radians(0.74)
"""By how much the base is turned after the best published motion of the servicer's problem [rad]."""

SEED_CENTERS = ((0.5, 0.5, 0.0), (0.4, 0.7, 0.0), (0.2, 0.8, 0.0))
SEED_RADIUS, SEED_GOAL = 0.1, (0.7, 0.3, 0.0)
"""The seed's obstacles, and where the end effector is to go [m]."""

_SERVICER_GOAL = (1.5, -1.4, 2.2)  # of the end effector [m]
_SERVICER_RPY = (-30.0, -50.0, 45.0)  # roll, pitch, yaw of it [deg]


def servicer_problem(*, restore: bool = True) -> Problem:
    """Return the planning problem of the trajectory_planning project of lirun-sat, of the servicer with two panels.

    The end effector goes to its goal pose within 1 mm and 0.1 deg; links 5 to 7 keep clear of base, panels and links 1 and 2.

    Args:
        restore: the base is to end as it began, within 0.05 deg; otherwise as it likes.
    """
    robot = load_robot("servicer7")
    start = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
    pose = np.eye(4)
    pose[:3, :3] = rotation_from_rpy(np.radians(_SERVICER_RPY))
    pose[:3, 3] = _SERVICER_GOAL
    return Problem(
        robot,
        [],
        start=start,
        goal=PoseGoal(pose, position_tolerance=1e-3, orientation_tolerance=math.radians(0.1)),
        base="floating",
        base_start=base_at_mass_center(robot, start),
        base_goal=AttitudeGoal((1, 0, 0, 0), math.radians(0.05)) if restore else None,
    )


def seed_problem() -> Problem:
    """Return the seed's scene for "srs7" at the seed's length on a floating base of 100 kg.

    The arm stands on the inertial origin and points along y, as the seed's does at its start; there its elbow is at its least
    angle, 0.1 rad, for it cannot be stretched out. The end effector is to come within 1 mm of the seed's goal.
    """
    robot = scaled_srs7()
    T = np.eye(4)
    T[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # the arm's z is the scene's y
    return Problem(
        robot,
        Scene([Sphere(center, SEED_RADIUS) for center in SEED_CENTERS]),
        start=np.clip(np.zeros(robot.dof), robot.lower, robot.upper),
        goal=PositionGoal(SEED_GOAL),
        base="floating",
        base_start=T,
    )
