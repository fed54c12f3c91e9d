"""The ends of a motion: is the start free, and which configurations reach the goal?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import ProblemError
from spacearm.planner.clearance import clearances
from spacearm.planner.goal_search import find_goal_configurations
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal
from spacearm.planner.problem import Problem
from spacearm.planner.reaching import reach_of
from spacearm.planner.settings import PlannerSettings

Array = NDArray[np.float64]

_TURN = 2 * np.pi


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


def require_within_reach(problem: Problem, goal: PositionGoal | PoseGoal) -> None:
    """Refuse a goal in space further from the base than the stretched arm.

    Raises:
        ProblemError: it is; the reach is named.
    """
    frame = goal.frame or problem.robot.tip
    tolerance = goal.tolerance if isinstance(goal, PositionGoal) else goal.position_tolerance
    reach, distance = reach_of(problem.robot, frame), float(np.linalg.norm(goal.position))
    if distance > reach + tolerance:
        raise ProblemError(
            f"the goal position is {distance:.4g} m from the base, out of reach: frame '{frame}' gets at most "
            f"{reach:.4g} m far; move the goal or the base"
        )


def search_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box the swarms search: the joint limits; for joints that turn without end, a turn about the start."""
    lower = np.where(np.isfinite(problem.robot.lower), problem.robot.lower, problem.start - _TURN)
    upper = np.where(np.isfinite(problem.robot.upper), problem.robot.upper, problem.start + _TURN)
    if isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal)):
        rows = np.atleast_2d(problem.goal.q)
        low, high = (rows - problem.goal.tolerance).min(axis=0), (rows + problem.goal.tolerance).max(axis=0)
        lower = np.maximum(np.minimum(lower, low), problem.robot.lower)
        upper = np.minimum(np.maximum(upper, high), problem.robot.upper)
    return lower, upper


def goal_configurations(problem: Problem, settings: PlannerSettings, seed: int) -> Array:
    """Return collision-free configurations (g, n) that reach the goal, nearest to the start first.

    Raises:
        ProblemError: the goal configuration is in collision, or the goal position is out of reach.
    """
    if isinstance(problem.goal, ConfigurationGoal) and not np.any(problem.goal.tolerance):
        require_free(problem, problem.goal.q, "goal")
    if isinstance(problem.goal, (PositionGoal, PoseGoal)):
        require_within_reach(problem, problem.goal)
    return find_goal_configurations(problem, settings, seed).q
