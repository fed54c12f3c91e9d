"""Clearances of configurations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.planner.kernel_model import make_kernel_model
from spacearm.planner.problem import Problem
from spacearm.robot.kinematics import as_configurations

Array = NDArray[np.float64]


def clearances(problem: Problem, q: ArrayLike) -> Array:
    """Return the clearance of every link's capsule and every obstacle.

    Args:
        problem: the robot, with c capsules, and the scene, with k obstacles.
        q: (..., n) configurations [rad or m].

    Returns:
        (..., c, k) signed distances [m]; negative is penetration.

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    array = as_configurations(problem.robot, q)
    model = make_kernel_model(problem.robot, problem.scene)
    out = model.native.clearances(np.ascontiguousarray(array.reshape(-1, problem.robot.dof)))
    return out.reshape(*array.shape[:-1], *out.shape[1:])


def clearance(problem: Problem, q: ArrayLike) -> Array:
    """Return the least clearance of each configuration, over all links and obstacles.

    Args:
        problem: the robot and the scene.
        q: (..., n) configurations [rad or m].

    Returns:
        (...,) [m]; negative is penetration; infinite without obstacles.

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    return clearances(problem, q).min(axis=(-2, -1), initial=np.inf)
