"""The ends of a motion: is the start free, and which configurations reach the goal?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import ProblemError
from spacearm.planner.clearance import clearances
from spacearm.planner.goals import ConfigurationGoal, PositionGoal
from spacearm.planner.kernel_model import make_kernel_model, native_class
from spacearm.planner.problem import Problem
from spacearm.planner.settings import REACHING, PlannerSettings
from spacearm.robot import Robot
from spacearm.swarm import run_trials

Array = NDArray[np.float64]

_TURN = 2 * np.pi
_DISTINCT = 0.05  # [rad or m] goal configurations closer than this, in every joint, are one


def require_free(problem: Problem, q: Array, what: str) -> float:
    """Return the clearance [m] of the start or goal configuration.

    Raises:
        ProblemError: it is in collision; the pair and the depth are named.
    """
    found = clearances(problem, q)
    if not found.size:
        return float("inf")
    link, obstacle = np.unravel_index(int(np.argmin(found)), found.shape)
    depth = 0.0 - float(found[link, obstacle])  # not -0.0 where they touch
    if depth >= 0:
        raise ProblemError(
            f"the {what} is in collision: link '{problem.robot.capsules[link].name}' and obstacle {obstacle} penetrate by "
            f"{depth * 1e3:.4g} mm, expected clearance; change `{what}` or the scene"
        )
    return -depth


def require_within_reach(problem: Problem, goal: PositionGoal) -> None:
    """Refuse a goal position further from the base than the stretched arm.

    Raises:
        ProblemError: it is; the reach is named.
    """
    reach = _reach(problem.robot, goal.frame or problem.robot.tip)
    distance = float(np.linalg.norm(goal.position))
    if distance > reach + goal.tolerance:
        raise ProblemError(
            f"the goal position is {distance:.4g} m from the base, out of reach: frame '{goal.frame}' gets at most "
            f"{reach:.4g} m far; move the goal or the base"
        )


def search_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box the swarms search: the joint limits; for joints that turn without end, a turn about the start."""
    lower = np.where(np.isfinite(problem.robot.lower), problem.robot.lower, problem.start - _TURN)
    upper = np.where(np.isfinite(problem.robot.upper), problem.robot.upper, problem.start + _TURN)
    if isinstance(problem.goal, ConfigurationGoal):
        lower, upper = np.minimum(lower, problem.goal.q), np.maximum(upper, problem.goal.q)
    return lower, upper


def goal_configurations(problem: Problem, settings: PlannerSettings, seed: int) -> Array:
    """Return collision-free configurations (g, n) that reach the goal, nearest to the start first.

    For a position a swarm in configuration space, the seed's formulation, is run several times.

    Raises:
        ProblemError: the goal configuration is in collision, or the goal position is out of reach.
    """
    if isinstance(problem.goal, ConfigurationGoal):
        require_free(problem, problem.goal.q, "goal")
        return problem.goal.q[None].copy()
    goal = problem.goal
    require_within_reach(problem, goal)
    model = make_kernel_model(problem.robot, problem.scene, frame=goal.frame)
    # What counts is the tolerance that the user gave; the search leaves a little of it for rounding.
    objective = native_class("ReachObjective", 64)(
        model.native,
        model.tip,
        np.array(goal.position),
        0.999 * goal.tolerance,
        settings.margin,
        np.array(problem.start),
    )
    lower, upper = search_bounds(problem)
    runs = run_trials(objective, lower, upper, REACHING, seed=seed, trials=settings.goal_candidates, threads=settings.threads)
    reached = sorted((run for run in runs if run.success), key=lambda run: run.fitness)
    distinct: list[Array] = []
    for run in reached:
        if all(np.abs(run.x - other).max() > _DISTINCT for other in distinct):
            distinct.append(run.x)
    return np.array(distinct).reshape(-1, problem.robot.dof)


def _reach(robot: Robot, frame: str) -> float:
    """Return a bound [m] of how far from the base the frame's origin can get."""
    placed = robot.frame(frame)
    reach, at = float(np.linalg.norm(placed.T_joint_frame[:3, 3])), placed.joint
    while at >= 0:
        joint = robot.joints[at]
        reach += float(np.linalg.norm(joint.T_parent_joint[:3, 3]))
        if joint.kind == "prismatic":
            values = [joint.multiplier * limit + joint.offset for limit in (robot.lower[joint.dof], robot.upper[joint.dof])]
            reach += float(np.abs(values).max())
        at = joint.parent
    return reach
