"""Goals in space: swarms come near from everywhere, damped least squares brings them onto the goal, all is checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.problem import nearest_turns
from spacearm.planner.reaching.onto_goal import (
    LEVER,
    Reach,
    SpaceGoal,
    goal_errors,
    nearer,
    polished,
    reach_of,
    reaches,
    tolerances,
)
from spacearm.planner.reaching.swarm import Slack, swarm_configurations
from spacearm.planner.reaching.task import LEAST_CLEARANCE, GoalConfigurations, GoalTask, nearest_first, swarm_of

Array = NDArray[np.float64]

_DISTINCT = 0.2  # [rad or m] goal configurations closer than this, in every joint, count as one
_PULLS = 6  # steps towards the start
_CLOSER = 1e-3  # [rad or m] by which a step must at least bring it nearer
_NEAR = 0.01  # [m or rad] what is farther from the goal than that, after much was tried, will not get there


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


_STAGES = (
    _Stage(swarms=4, particles=16, iterations=30, slack=Slack(distance=0.05, angle=0.3), rounds=20),
    _Stage(swarms=8, particles=32, iterations=60, slack=Slack(distance=0.02, angle=0.15), rounds=40),
    _Stage(swarms=8, particles=64, iterations=120, slack=Slack(distance=0.01, angle=0.08), rounds=40),
    _Stage(swarms=4, particles=64, iterations=150, slack=Slack(distance=0.0, angle=0.0), rounds=40),
)
"""Each is gone through only if those before found nothing."""


def find_in_space(task: GoalTask, reach: Reach) -> GoalConfigurations:
    """Find distinct free configurations that reach a goal in space; see `find_goal_configurations`."""
    problem, settings = task.problem, task.settings
    frame, (near, _) = reach.goal.frame or problem.robot.tip, tolerances(reach.goal)
    beyond_reach = np.linalg.norm(reach.goal.position) > reach_of(problem.robot, frame) + near
    best = _Closest()
    counts = {"searches": 0, "reached": 0, "in_collision": 0}
    for stage in _STAGES:
        count = stage.swarms * settings.goal_candidates
        seen = _seen_by_swarms(task, reach.goal, stage, first=counts["searches"], count=count)
        onto = polished(reach, seen, *task.bounds, rounds=stage.rounds, late=task.late)
        as_seen = reaches(reach, seen)
        if as_seen[0]:
            onto[0] = seen[0]  # there already: nothing needs to move
        there = reaches(reach, onto)
        clear, clear_as_seen = task.clearance(onto), task.clearance(seen)
        free = (there & (clear > 0)) | (as_seen & (clear_as_seen > 0))
        counts["searches"] += count
        counts["reached"] += int((there | as_seen).sum())
        counts["in_collision"] += int(((there | as_seen) & ~free).sum())
        # What is at the goal's centre goes before what is only within its tolerance.
        for q, good, room, at_centre in ((onto, there, clear, True), (seen, as_seen, clear_as_seen, False)):
            kept = _with_room(good, room, settings.margin)
            if kept.any():
                q, room = q[kept], room[kept]
                # Where the arm moves the base the search moves the end too, if in longer ways.
                if not (problem.base_model.follows_arm and settings.stop_at_first):
                    q, room = _pulled(task, reach, q, room, at_centre=at_centre)
                kept = _distinct(q, problem.start, settings.goal_candidates)
                return nearest_first(problem, q[kept], room[kept], **counts)
        best.offer(reach, onto, clear)
        best.offer(reach, seen, clear_as_seen)
        if task.late() or beyond_reach or (stage is not _STAGES[0] and best.is_far(reach)):
            break
    none = np.zeros((0, problem.robot.dof))
    return GoalConfigurations(q=none, clearance=none[:, 0], closest=best.q, distance=best.distance, angle=best.angle, **counts)


def _seen_by_swarms(task: GoalTask, goal: SpaceGoal, stage: _Stage, *, first: int, count: int) -> Array:
    """Return the start and what the swarms of a stage end with, (1 + count, n)."""
    start = task.problem.start
    seen = swarm_configurations(
        task.problem,
        goal,
        task.bounds,
        swarm_of(stage.particles, stage.iterations),
        home=start,
        margin=task.settings.margin,
        slack=stage.slack,
        seed=task.seed,
        first=first,
        count=count,
        threads=task.settings.threads,
        late=task.late,
    )
    return nearest_turns(task.problem.robot, np.vstack([start, seen]), start)


def _with_room(good: NDArray[np.bool_], clear: Array, margin: float) -> NDArray[np.bool_]:
    """Choose, of what is good, what has the margin; if nothing has, what has some clearance at all."""
    roomy = good & (clear >= max(margin, LEAST_CLEARANCE))
    return roomy if roomy.any() else good & (clear > LEAST_CLEARANCE)


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
        merit = np.where(off, np.hypot(distance, LEVER * angle), -clear)
        best = np.lexsort((merit, off))[0]
        if (bool(off[best]), float(merit[best])) < self.merit:
            self.merit = bool(off[best]), float(merit[best])
            self.q, self.distance, self.angle = q[best], float(distance[best]), float(angle[best])

    def is_far(self, reach: Reach) -> bool:
        """Whether nothing came near the goal: it is brought onto without regard to obstacles, so none is in the way."""
        near, turned = tolerances(reach.goal)
        return self.merit[0] and (self.distance > 3 * near + _NEAR or self.angle > 3 * turned + _NEAR)


def _pulled(task: GoalTask, reach: Reach, q: Array, clear: Array, *, at_centre: bool) -> tuple[Array, Array]:
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
        if task.late():
            break
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
    apart = np.zeros((len(q), len(q)))
    for joint in q.T:
        np.maximum(apart, np.abs(joint[:, None] - joint), out=apart)
    radius = _DISTINCT
    while True:
        chosen: list[int] = []
        for i in order:
            if (apart[i, chosen] > radius).all():
                chosen.append(int(i))
        if len(chosen) <= most:
            return np.array(chosen, dtype=np.intp)
        radius *= 1.3
