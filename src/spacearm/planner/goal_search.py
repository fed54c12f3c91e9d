"""Which configurations reach a goal: found by swarms in configuration space, brought onto the goal, and checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.clearance import clearance_of
from spacearm.planner.goal_swarm import Slack, swarm_configurations
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.problem import Problem, nearest_turns
from spacearm.planner.reaching import (
    LEVER,
    Reach,
    SpaceGoal,
    goal_errors,
    nearer,
    polished,
    reach_of,
    reach_to,
    reaches,
    tolerances,
)
from spacearm.planner.settings import PlannerSettings
from spacearm.swarm import PSO

Array = NDArray[np.float64]
JointGoal: TypeAlias = ConfigurationGoal | ConfigurationsGoal

_HALF_TURN = np.pi
_DISTINCT = 0.2  # [rad or m] goal configurations closer than this, in every joint, count as one
_PULLS = 6  # steps towards the start
_CLOSER = 1e-3  # [rad or m] by which a step must at least bring it nearer
_NEAR = 0.01  # [m or rad] what is farther from the goal than that, after much was tried, will not get there
_LEAST = 1e-6  # [m] of clearance: what only just does not touch leaves no room to prove a motion


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stage:
    """How hard to look: so many swarms for each goal candidate asked for, their size, and how near the goal they must come.

    Small swarms that come only near it do: what counts is that they come near it from everywhere, free of collision.
    """

    swarms: int
    particles: int
    iterations: int
    slack: Slack
    rounds: int  # of damped least squares

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
    _Stage(swarms=4, particles=16, iterations=30, slack=Slack(distance=0.05, angle=0.3), rounds=20),
    _Stage(swarms=8, particles=32, iterations=60, slack=Slack(distance=0.02, angle=0.15), rounds=40),
    _Stage(swarms=8, particles=64, iterations=120, slack=Slack(distance=0.01, angle=0.08), rounds=40),
    _Stage(swarms=4, particles=64, iterations=150, slack=Slack(distance=0.0, angle=0.0), rounds=40),
)
"""Each is gone through only if those before found nothing."""

_NEARBY = _Stage(swarms=4, particles=64, iterations=120, slack=_STAGES[0].slack, rounds=0)
"""For a free configuration beside one in collision; of so many swarms in all."""


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
class _Task:
    """A problem and all that configurations are checked against."""

    problem: Problem
    bounds: tuple[Array, Array]
    clearance: Callable[[Array], Array]
    settings: PlannerSettings
    seed: int


def find_goal_configurations(
    problem: Problem, settings: PlannerSettings, seed: int, clearance: Callable[[Array], Array] | None = None
) -> GoalConfigurations:
    """Find distinct collision-free configurations that reach a problem's goal.

    A configuration goal is taken as it is where it is free, else sought within its tolerance. For a goal in space, swarms
    in configuration space, the seed's formulation, come near it from everywhere; each result is brought onto the goal by
    damped least squares, moved towards the start as far as goal and clearance allow, and checked in float64.

    Args:
        problem: robot, scene, start and goal.
        settings: of the planner: `goal_candidates` is the most that are returned of a goal in space; `margin` is the
            clearance asked for, less of it only where none has so much.
        seed: the same one gives the same configurations, on any number of threads.
        clearance: what `clearance_of(problem)` gave, if that was asked for already.

    Returns:
        What was found; `q` is empty if nothing was.
    """
    task = _Task(
        problem=problem,
        bounds=reaching_bounds(problem),
        clearance=clearance_of(problem) if clearance is None else clearance,
        settings=settings,
        seed=seed,
    )
    if isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal)):
        return _in_joint_space(task, problem.goal)
    return _in_space(task, reach_to(problem.robot, problem.goal))


def reaching_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box that goal configurations are sought in: the limits; for joints without, half a turn about the start."""
    robot = problem.robot
    lower = np.where(np.isfinite(robot.lower), robot.lower, np.minimum(problem.start, robot.upper) - _HALF_TURN)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.maximum(problem.start, robot.lower) + _HALF_TURN)
    return lower, upper


# ---- goals in joint space --------------------------------------------------------------------------------------------


def _in_joint_space(task: _Task, goal: JointGoal) -> GoalConfigurations:
    rows = np.atleast_2d(goal.q)
    clear = task.clearance(rows)
    free = clear > 0
    if free.any():
        return _found(task.problem, rows[free], clear[free], reached=len(rows), in_collision=int((~free).sum()))
    order = np.argsort(-clear, kind="stable")
    none = GoalConfigurations(
        q=np.zeros((0, task.problem.robot.dof)),
        clearance=np.zeros(0),
        reached=len(rows),
        in_collision=len(rows),
        closest=rows[order[0]],
    )
    return _within_tolerance(task, goal, rows[order], none) if np.any(goal.tolerance) else none


def _within_tolerance(task: _Task, goal: JointGoal, rows: Array, none: GoalConfigurations) -> GoalConfigurations:
    """Look about configurations in collision for the nearest free ones within the tolerance."""
    robot, settings = task.problem.robot, task.settings
    found, seen, collided = [], none.reached, none.in_collision
    rows = rows[: settings.goal_candidates]
    for i, row in enumerate(rows):
        x = swarm_configurations(
            task.problem,
            None,
            (np.maximum(row - goal.tolerance, robot.lower), np.minimum(row + goal.tolerance, robot.upper)),
            _NEARBY.swarm,
            home=row,
            margin=settings.margin,
            slack=_NEARBY.slack,
            seed=task.seed,
            first=i * _NEARBY.swarms,
            count=_NEARBY.swarms,
            threads=settings.threads,
            nearest=True,
        )
        clear = task.clearance(x)
        seen, collided = seen + len(x), collided + int((clear <= 0).sum())
        free = np.flatnonzero(clear > _LEAST)
        if free.size:
            kept = free[np.argmin(np.linalg.norm(x[free] - row, axis=1))]
            found.append((x[kept], clear[kept]))
    searches = _NEARBY.swarms * len(rows)
    if not found:
        return replace(none, searches=searches, reached=seen, in_collision=collided)
    q, clear = np.array([q for q, _ in found]), np.array([c for _, c in found])
    return _found(task.problem, q, clear, searches=searches, reached=seen, in_collision=collided)


# ---- goals in space --------------------------------------------------------------------------------------------------


def _in_space(task: _Task, reach: Reach) -> GoalConfigurations:
    problem, settings = task.problem, task.settings
    frame, (near, _) = reach.goal.frame or problem.robot.tip, tolerances(reach.goal)
    beyond_reach = np.linalg.norm(reach.goal.position) > reach_of(problem.robot, frame) + near
    best = _Closest()
    searches, reached, in_collision = 0, 0, 0
    for stage in _STAGES:
        count = stage.swarms * settings.goal_candidates
        seen = _seen_by_swarms(task, reach.goal, stage, first=searches, count=count)
        searches += count
        onto = polished(reach, seen, *task.bounds, rounds=stage.rounds)
        as_seen = reaches(reach, seen)
        if as_seen[0]:
            onto[0] = seen[0]  # there already: nothing needs to move
        there = reaches(reach, onto)
        clear, clear_as_seen = task.clearance(onto), task.clearance(seen)
        free = (there & (clear > 0)) | (as_seen & (clear_as_seen > 0))
        reached += int((there | as_seen).sum())
        in_collision += int(((there | as_seen) & ~free).sum())
        # What is at the goal's centre goes before what is only within its tolerance.
        for q, good, room, at_centre in ((onto, there, clear, True), (seen, as_seen, clear_as_seen, False)):
            kept = _with_room(good, room, settings.margin)
            if kept.any():
                q, room = _pulled(task, reach, q[kept], room[kept], at_centre=at_centre)
                kept = _distinct(q, problem.start, settings.goal_candidates)
                return _found(problem, q[kept], room[kept], searches=searches, reached=reached, in_collision=in_collision)
        best.offer(reach, onto, clear)
        best.offer(reach, seen, clear_as_seen)
        if beyond_reach or (stage is not _STAGES[0] and best.is_far(reach)):
            break
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


def _seen_by_swarms(task: _Task, goal: SpaceGoal, stage: _Stage, *, first: int, count: int) -> Array:
    """Return the start and what the swarms of a stage end with, (1 + count, n)."""
    start = task.problem.start
    seen = swarm_configurations(
        task.problem,
        goal,
        task.bounds,
        stage.swarm,
        home=start,
        margin=task.settings.margin,
        slack=stage.slack,
        seed=task.seed,
        first=first,
        count=count,
        threads=task.settings.threads,
    )
    return nearest_turns(task.problem.robot, np.vstack([start, seen]), start)


def _with_room(good: NDArray[np.bool_], clear: Array, margin: float) -> NDArray[np.bool_]:
    """Choose, of what is good, what has the margin; if nothing has, what has some clearance at all."""
    roomy = good & (clear >= max(margin, _LEAST))
    return roomy if roomy.any() else good & (clear > _LEAST)


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

    def is_far(self, reach: Reach) -> bool:
        """Whether nothing came near the goal: it is brought onto without regard to obstacles, so none is in the way."""
        near, turned = tolerances(reach.goal)
        return self.merit[0] and (self.distance > 3 * near + _NEAR or self.angle > 3 * turned + _NEAR)


def _pulled(task: _Task, reach: Reach, q: Array, clear: Array, *, at_centre: bool) -> tuple[Array, Array]:
    """Add to configurations (b, n) what they become when pulled towards the start with the frame held in place.

    Args:
        task: what to keep clear of.
        reach: the goal.
        q: free configurations that reach it.
        clear: (b,) their clearances [m]; what is pulled keeps the margin, or what there was if that was less.
        at_centre: whether they are at the goal's very centre, and are to stay there.

    Returns:
        (2 b, n) and (2 b,).
    """
    start, least = task.problem.start, np.minimum(task.settings.margin, clear)
    near, room = q.copy(), clear.copy()
    away = np.linalg.norm(near - start, axis=1)
    share = np.full(len(q), 0.5)
    for _ in range(_PULLS):
        tried = np.clip(nearer(reach, near, start, share), *task.bounds)
        if at_centre:
            tried = polished(reach, tried, *task.bounds, rounds=4)
        new_room, new_away = task.clearance(tried), np.linalg.norm(tried - start, axis=1)
        good = (new_away < away - _CLOSER) & reaches(reach, tried) & (new_room >= least)
        near[good], room[good], away[good] = tried[good], new_room[good], new_away[good]
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
