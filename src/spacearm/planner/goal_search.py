"""Which configurations reach a goal: found by swarms in configuration space, brought onto the goal, and checked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.clearance import clearance
from spacearm.planner.goal_swarm import Slack, swarm_configurations
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.problem import Problem, nearest_turns
from spacearm.planner.reaching import LEVER, Reach, goal_errors, nearer, polished, reach_to, reaches
from spacearm.planner.settings import PlannerSettings
from spacearm.swarm import PSO

Array = NDArray[np.float64]
JointGoal: TypeAlias = ConfigurationGoal | ConfigurationsGoal

_HALF_TURN = np.pi
_DISTINCT = 0.2  # [rad or m] goal configurations closer than this, in every joint, count as one
_PULLS = 6  # steps towards the start
_LEAST = 1e-6  # [m] of clearance: what only just does not touch leaves no room to prove a motion


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stage:
    """How hard to look: so many swarms of such a size, and how near they must come before they are brought onto the goal."""

    swarms: int
    particles: int
    iterations: int
    slack: Slack

    @property
    def swarm(self) -> PSO:
        return PSO(
            particles=self.particles,
            iterations=self.iterations,
            inertia=0.7298,
            cognitive=1.49618,
            social=1.49618,
            neighbours=3,
        )


_STAGES = (
    _Stage(swarms=4, particles=32, iterations=60, slack=Slack(distance=0.02, angle=0.15)),
    _Stage(swarms=16, particles=64, iterations=120, slack=Slack(distance=0.01, angle=0.08)),
    _Stage(swarms=16, particles=100, iterations=300, slack=Slack(distance=0.0, angle=0.0)),
)
"""Each is gone through only if those before found nothing; its swarms are a number for each goal candidate asked for."""


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
    if isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal)):
        return _in_joint_space(problem, problem.goal, settings, seed)
    return _in_space(problem, reach_to(problem.robot, problem.goal), settings, seed)


def reaching_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box that goal configurations are sought in: the limits; for joints without, half a turn about the start."""
    robot = problem.robot
    lower = np.where(np.isfinite(robot.lower), robot.lower, np.minimum(problem.start, robot.upper) - _HALF_TURN)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.maximum(problem.start, robot.lower) + _HALF_TURN)
    return lower, upper


# ---- goals in joint space --------------------------------------------------------------------------------------------


def _in_joint_space(problem: Problem, goal: JointGoal, settings: PlannerSettings, seed: int) -> GoalConfigurations:
    rows = np.atleast_2d(goal.q)
    clear = clearance(problem, rows)
    free = clear > 0
    if free.any():
        return _found(problem, rows[free], clear[free], reached=len(rows), in_collision=int((~free).sum()))
    best = int(np.argmax(clear))
    none = GoalConfigurations(
        q=np.zeros((0, problem.robot.dof)),
        clearance=np.zeros(0),
        reached=len(rows),
        in_collision=len(rows),
        closest=rows[best],
    )
    if not np.any(goal.tolerance):
        return none
    return _within_tolerance(problem, goal, rows[np.argsort(-clear, kind="stable")], settings, seed, none)


def _within_tolerance(
    problem: Problem, goal: JointGoal, rows: Array, settings: PlannerSettings, seed: int, none: GoalConfigurations
) -> GoalConfigurations:
    """Look about configurations in collision for the nearest free ones within the tolerance."""
    stage, robot = _STAGES[1], problem.robot
    found, seen, collided = [], none.reached, none.in_collision
    rows = rows[: settings.goal_candidates]
    for i, row in enumerate(rows):
        box = np.maximum(row - goal.tolerance, robot.lower), np.minimum(row + goal.tolerance, robot.upper)
        x, _ = swarm_configurations(
            problem,
            None,
            box,
            stage.swarm,
            home=row,
            margin=settings.margin,
            slack=stage.slack,
            seed=seed,
            first=i * 4,
            count=4,
            threads=settings.threads,
            nearest=True,
        )
        clear = clearance(problem, x)
        seen, collided = seen + len(x), collided + int((clear <= 0).sum())
        free = np.flatnonzero(clear > _LEAST)
        if free.size:
            kept = free[np.argmin(np.abs(x[free] - row).max(axis=1))]
            found.append((x[kept], clear[kept]))
    if not found:
        return replace(none, searches=4 * len(rows), reached=seen, in_collision=collided)
    q, clear = np.array([q for q, _ in found]), np.array([c for _, c in found])
    return _found(problem, q, clear, searches=4 * len(rows), reached=seen, in_collision=collided)


# ---- goals in space --------------------------------------------------------------------------------------------------


def _in_space(problem: Problem, reach: Reach, settings: PlannerSettings, seed: int) -> GoalConfigurations:
    bounds = reaching_bounds(problem)
    best = _Closest()
    searches, reached, in_collision = 0, 0, 0
    for stage in _STAGES:
        count = stage.swarms * settings.goal_candidates
        seen, _ = swarm_configurations(
            problem,
            reach.goal,
            bounds,
            stage.swarm,
            home=problem.start,
            margin=settings.margin,
            slack=stage.slack,
            seed=seed,
            first=searches,
            count=count,
            threads=settings.threads,
        )
        searches += count
        seen = nearest_turns(problem.robot, np.vstack([problem.start, seen]), problem.start)
        onto = polished(reach, seen, *bounds)
        as_seen = reaches(reach, seen)
        if as_seen[0]:
            onto[0] = seen[0]  # there already: nothing needs to move
        there = reaches(reach, onto)
        clear, clear_as_seen = clearance(problem, onto), clearance(problem, seen)
        free = (there & (clear > 0)) | (as_seen & (clear_as_seen > 0))
        reached, in_collision = reached + int((there | as_seen).sum()), in_collision + int(((there | as_seen) & ~free).sum())
        # What is at the goal's centre goes before what is only within its tolerance.
        for q, good, room in ((onto, there, clear), (seen, as_seen, clear_as_seen)):
            kept = good & (room >= settings.margin) if (good & (room >= settings.margin)).any() else good & (room > _LEAST)
            if kept.any():
                q, room = _pulled(problem, reach, q[kept], room[kept], settings.margin, onto=q is onto)
                kept = _distinct(q, problem.start, settings.goal_candidates)
                return _found(problem, q[kept], room[kept], searches=searches, reached=reached, in_collision=in_collision)
        best.offer(reach, onto, clear)
        best.offer(reach, seen, clear_as_seen)
    return GoalConfigurations(
        q=np.zeros((0, problem.robot.dof)),
        clearance=np.zeros(0),
        searches=searches,
        reached=reached,
        in_collision=in_collision,
        closest=best.q,
        distance=best.distance,
        angle=best.angle,
    )


@dataclass(slots=True)
class _Closest:
    """The configuration nearest to the goal; of those that reach it, the one least in collision."""

    q: Array | None = None
    distance: float = np.inf
    angle: float = np.inf
    merit: tuple[bool, float] = (True, np.inf)

    def offer(self, reach: Reach, q: Array, clear: Array) -> None:
        distance, angle = goal_errors(reach, q)
        off = ~reaches(reach, q)
        merit = np.where(off, distance + LEVER * angle, -clear)
        best = np.lexsort((merit, off))[0]
        if (bool(off[best]), float(merit[best])) < self.merit:
            self.merit = bool(off[best]), float(merit[best])
            self.q, self.distance, self.angle = q[best], float(distance[best]), float(angle[best])


def _pulled(problem: Problem, reach: Reach, q: Array, clear: Array, margin: float, *, onto: bool) -> tuple[Array, Array]:
    """Add to configurations (b, n) what they become when pulled towards the start with the frame held in place.

    Args:
        problem: robot and scene.
        reach: the goal.
        q: free configurations that reach it.
        clear: (b,) their clearances [m]; what is pulled keeps the margin, or what there was if that was less.
        margin: [m].
        onto: whether to bring them back onto the goal's very centre.

    Returns:
        (2 b, n) and (2 b,).
    """
    bounds = reaching_bounds(problem)
    near, room = q.copy(), clear.copy()
    share = np.full(len(q), 0.5)
    for _ in range(_PULLS):
        tried = np.clip(nearer(reach, near, problem.start, share), *bounds)
        tried = polished(reach, tried, *bounds, rounds=4) if onto else tried
        new_room = clearance(problem, tried)
        closer = np.linalg.norm(tried - problem.start, axis=1) < np.linalg.norm(near - problem.start, axis=1) - 1e-3
        good = closer & reaches(reach, tried) & (new_room >= np.minimum(margin, clear))
        near[good], room[good] = tried[good], new_room[good]
        share = np.where(good, share, share * 0.4)
    return np.vstack([near, q]), np.concatenate([room, clear])


def _distinct(q: Array, start: Array, most: int) -> NDArray[np.intp]:
    """Choose configurations that differ: nearest to the start first, and none near one that was chosen.

    What counts as near is widened until no more than asked for are left.
    """
    order = np.argsort(np.linalg.norm(q - start, axis=1), kind="stable")
    apart = np.abs(q[:, None] - q[None]).max(axis=-1)
    radius = _DISTINCT
    while True:
        chosen: list[int] = []
        for i in order:
            if all(apart[i, j] > radius for j in chosen):
                chosen.append(int(i))
        if len(chosen) <= most:
            return np.array(chosen, dtype=np.intp)
        radius *= 1.3


def _found(problem: Problem, q: Array, clear: Array, **counts: Any) -> GoalConfigurations:
    order = np.argsort(np.linalg.norm(q - problem.start, axis=1), kind="stable")
    return GoalConfigurations(q=q[order], clearance=clear[order], **counts)
