"""Which configurations reach a goal: found by swarms in configuration space, brought onto the goal, and checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from spacearm.planner.clearance import clearance_of
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.problem import Problem
from spacearm.planner.reaching.bounds import reaching_bounds
from spacearm.planner.reaching.joint_goals import find_in_joint_space
from spacearm.planner.reaching.onto_goal import reach_to
from spacearm.planner.reaching.space_goals import find_in_space
from spacearm.planner.reaching.task import GoalConfigurations, GoalTask, goal_side
from spacearm.planner.settings import PlannerSettings


def find_goal_configurations(
    problem: Problem, settings: PlannerSettings, seed: int, *, late: Callable[[], bool] = lambda: False
) -> GoalConfigurations:
    """Find distinct collision-free configurations that reach a problem's goal.

    A configuration goal is taken as it is where it is free, else sought within its tolerance. For a goal in space, swarms
    in configuration space, the seed's formulation, come near it from everywhere; each result is brought onto the goal by
    damped least squares, moved towards the start as far as goal and clearance allow, and checked in float64.

    Where the base floats, a goal in space is sought with the base as it begins: the search for motions sets out from there.

    Args:
        problem: robot, scene, start and goal.
        settings: of the planner: `goal_candidates` is the most that are returned of a goal in space; `margin` is the
            clearance asked for, less of it only where none has so much.
        seed: the same one gives the same configurations, on any number of threads.
        late: whether time is up: what was found by then is returned; the first swarms are always run.

    Returns:
        What was found; `q` is empty if nothing was.
    """
    in_joint_space = isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal))
    seen = goal_side(problem) if in_joint_space else problem
    task = GoalTask(
        problem=seen,
        bounds=reaching_bounds(seen),
        clearance=clearance_of(seen),
        settings=settings,
        seed=seed,
        late=late,
    )
    if isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal)):
        return find_in_joint_space(task, problem.goal)
    found = find_in_space(task, reach_to(problem.robot, problem.goal))
    if len(found.q) or not problem.base_model.follows_arm:
        return found
    # Out of reach for the base as it begins, but it will move: the search begins at what comes nearest, and goes on from there.
    nearest = problem.start if found.closest is None else found.closest
    return replace(found, q=nearest[None].copy(), clearance=task.clearance(nearest[None]))
