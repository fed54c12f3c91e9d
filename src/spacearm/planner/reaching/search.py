"""Which configurations reach a goal: found by swarms in configuration space, brought onto the goal, and checked."""

from __future__ import annotations

from spacearm.planner.clearance import clearance_of
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.problem import Problem
from spacearm.planner.reaching.bounds import reaching_bounds
from spacearm.planner.reaching.joint_goals import find_in_joint_space
from spacearm.planner.reaching.onto_goal import reach_to
from spacearm.planner.reaching.space_goals import find_in_space
from spacearm.planner.reaching.task import GoalConfigurations, GoalTask
from spacearm.planner.settings import PlannerSettings


def find_goal_configurations(problem: Problem, settings: PlannerSettings, seed: int) -> GoalConfigurations:
    """Find distinct collision-free configurations that reach a problem's goal.

    A configuration goal is taken as it is where it is free, else sought within its tolerance. For a goal in space, swarms
    in configuration space, the seed's formulation, come near it from everywhere; each result is brought onto the goal by
    damped least squares, moved towards the start as far as goal and clearance allow, and checked in float64.

    Args:
        problem: robot, scene, start and goal.
        settings: of the planner: `goal_candidates` is the most that are returned of a goal in space; `margin` is the
            clearance asked for, less of it only where none has so much.
        seed: the same one gives the same configurations, on any number of threads.

    Returns:
        What was found; `q` is empty if nothing was.
    """
    task = GoalTask(
        problem=problem,
        bounds=reaching_bounds(problem),
        clearance=clearance_of(problem),
        settings=settings,
        seed=seed,
    )
    if isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal)):
        return find_in_joint_space(task, problem.goal)
    return find_in_space(task, reach_to(problem.robot, problem.goal))
