"""The boxes in joint space that the swarms search: the limits, and where there are none a turn or half a turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.problem import Problem

Array = NDArray[np.float64]

_HALF_TURN, _TURN = np.pi, 2 * np.pi
FAR = 1e3
"""[rad or m] A limit so far from the start is as good as none: the box ends nearer."""


def search_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box that motions are sought in, (n,) each: the limits; for joints without, a turn about the start."""
    near, far = _limited(problem)
    lower = np.where(near, problem.robot.lower, problem.start - _TURN)
    upper = np.where(far, problem.robot.upper, problem.start + _TURN)
    if isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal)):
        rows = np.atleast_2d(problem.goal.q)
        low, high = (rows - problem.goal.tolerance).min(axis=0), (rows + problem.goal.tolerance).max(axis=0)
        lower = np.maximum(np.minimum(lower, low), problem.robot.lower)
        upper = np.minimum(np.maximum(upper, high), problem.robot.upper)
    return lower, upper


def reaching_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box that goal configurations are sought in, (n,) each: the limits, or half a turn about the start."""
    robot = problem.robot
    near, far = _limited(problem)
    lower = np.where(near, robot.lower, np.minimum(problem.start, robot.upper) - _HALF_TURN)
    upper = np.where(far, robot.upper, np.maximum(problem.start, robot.lower) + _HALF_TURN)
    return lower, upper


def _limited(problem: Problem) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell which joints have a lower and which an upper limit that is one, (n,) each."""
    return problem.robot.lower >= problem.start - FAR, problem.robot.upper <= problem.start + FAR
