"""Robots as plain values, so that a file may hold one in full."""

from __future__ import annotations

import math
from typing import Any

from spacearm.errors import RobotError
from spacearm.records import record_as_dict, record_from_dict
from spacearm.robot.model import Robot


def robot_as_dict(robot: Robot) -> dict[str, Any]:
    """Return a robot as plain values: a key for each of its attributes; null is the limit of a joint that has none."""
    return record_as_dict(robot)


def robot_from_dict(values: Any) -> Robot:
    """Make a robot of plain values, the same bit for bit as the one that `robot_as_dict` was given.

    Raises:
        RobotError: values that are no robot; the place is named.
    """
    return record_from_dict(Robot, values, "robot", RobotError, infinite={"lower": -math.inf, "upper": math.inf})
