"""Goals in joint space: configurations taken as they are where they are free, else sought within their tolerance."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.reaching.swarm import swarm_configurations
from spacearm.planner.reaching.task import LEAST_CLEARANCE, GoalConfigurations, GoalTask, nearest_first, swarm_of

Array = NDArray[np.float64]
JointGoal: TypeAlias = ConfigurationGoal | ConfigurationsGoal
"""A goal that says where the joints are to be."""

_SWARMS = 4  # about each configuration in collision
_SWARM = swarm_of(particles=64, iterations=120)


def find_in_joint_space(task: GoalTask, goal: JointGoal) -> GoalConfigurations:
    """Find the free ones of a goal's configurations; if none is, free ones beside them within the tolerance."""
    rows = np.atleast_2d(goal.q)
    clear = task.clearance(rows)
    free = clear > 0
    if free.any():
        return nearest_first(task.problem, rows[free], clear[free], reached=len(rows), in_collision=int((~free).sum()))
    order = np.argsort(-clear, kind="stable")
    none = GoalConfigurations(
        q=np.zeros((0, task.problem.robot.dof)),
        clearance=np.zeros(0),
        reached=len(rows),
        in_collision=len(rows),
        closest=rows[order[0]],
    )
    return _within_tolerance(task, goal, rows[order], none) if np.any(goal.tolerance) else none


def _within_tolerance(task: GoalTask, goal: JointGoal, rows: Array, none: GoalConfigurations) -> GoalConfigurations:
    """Look about configurations in collision for the nearest free ones within the tolerance."""
    robot, settings = task.problem.robot, task.settings
    found, seen, collided = [], none.reached, none.in_collision
    rows = rows[: settings.goal_candidates]
    for i, row in enumerate(rows):
        if i and task.late():
            break
        x = swarm_configurations(
            task.problem,
            None,
            (np.maximum(row - goal.tolerance, robot.lower), np.minimum(row + goal.tolerance, robot.upper)),
            _SWARM,
            home=row,
            margin=settings.margin,
            seed=task.seed,
            first=i * _SWARMS,
            count=_SWARMS,
            threads=settings.threads,
            nearest=True,
            late=task.late,
        )
        clear = task.clearance(x)
        seen, collided = seen + len(x), collided + int((clear <= 0).sum())
        free = np.flatnonzero(clear > LEAST_CLEARANCE)
        if free.size:
            kept = free[np.argmin(np.linalg.norm(x[free] - row, axis=1))]
            found.append((x[kept], clear[kept]))
    searches = _SWARMS * len(rows)
    if not found:
        return replace(none, searches=searches, reached=seen, in_collision=collided)
    q, clear = np.array([q for q, _ in found]), np.array([c for _, c in found])
    return nearest_first(task.problem, q, clear, searches=searches, reached=seen, in_collision=collided)
