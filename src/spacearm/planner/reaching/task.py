"""What looks for configurations that reach a goal, and what is found: common to goals of every kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.problem import Problem
from spacearm.planner.settings import PlannerSettings
from spacearm.scene import Scene
from spacearm.swarm import PSO

Array = NDArray[np.float64]

LEAST_CLEARANCE = 1e-6
"""[m] What only just does not touch leaves no room to prove a motion."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GoalConfigurations:
    """The configurations that a motion may end in, and what was met on the way to them.

    Attributes:
        q: (g, n) distinct, free of collision, within the limits and the goal's tolerance, nearest to the start first.
        clearance: (g,) of each, to obstacles and between links [m].
        searches: how many swarms looked for them; 0 where the goal is a configuration that could be taken as it is.
        reached: how many configurations within the goal's tolerance were seen.
        in_collision: how many of those were in collision.
        closest: (n,) if there are none: the configuration that came nearest to the goal, of those that reach it the one
            least in collision; else None.
        distance: by how much `closest` misses the goal's position [m]; 0 for a goal in joint space.
        angle: by how much it misses the goal's orientation [rad].
    """

    q: Array
    clearance: Array
    searches: int = 0
    reached: int = 0
    in_collision: int = 0
    closest: Array | None = None
    distance: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalTask:
    """A problem and all that configurations are checked against.

    Attributes:
        problem: robot, scene, start and goal.
        bounds: (n,) lower and upper, the box that configurations are sought in [rad or m].
        clearance: of configurations (b, n), (b,) [m].
        settings: of the planner.
        seed: of all swarms.
        late: whether time is up.
    """

    problem: Problem
    bounds: tuple[Array, Array]
    clearance: Callable[[Array], Array]
    settings: PlannerSettings
    seed: int
    late: Callable[[], bool] = lambda: False


def goal_side(problem: Problem) -> Problem:
    """Return a problem with what counts at a goal configuration.

    Where the arm moves its base nobody knows yet where the base will be. Then only the links of the robot itself can be in
    its way; the scene is left out.
    """
    return replace(problem, scene=Scene([])) if problem.base_model.follows_arm else problem


def swarm_of(particles: int, iterations: int) -> PSO:
    """Return the settings of the swarms in configuration space."""
    return PSO(
        particles=particles,
        iterations=iterations,
        inertia=0.7298,
        cognitive=1.49618,
        social=1.49618,
        neighbours=3,
    )


def nearest_first(problem: Problem, q: Array, clear: Array, **counts: Any) -> GoalConfigurations:
    """Put together what was found, q (g, n) and its clearances (g,): nearest to the start first."""
    order = np.argsort(np.linalg.norm(q - problem.start, axis=1), kind="stable")
    return GoalConfigurations(q=q[order], clearance=clear[order], **counts)
