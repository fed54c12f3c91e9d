"""Goals in space: swarms come near from everywhere, damped least squares brings them onto the goal, all is checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import product, sines
from spacearm.core.native import native
from spacearm.geometry import Scene
from spacearm.planner.clearance import clearance_of
from spacearm.planner.goal_reach import (
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
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, PositionGoal
from spacearm.planner.kernel_model import make_kernel_model
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem, nearest_turns
from spacearm.swarm import PSO, run_trials

# ---- -----------------------------------------------------------------------------------------------------------------
# The boxes in joint space that the swarms search: the limits, and where there are none a turn or half a turn.

Array = NDArray[np.float64]

_HALF_TURN, _TURN = np.pi, 2 * np.pi
FAR = 1e3
"""[rad or m] A limit so far from the start is as good as none: the box ends nearer."""


def search_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box that motions are sought in, (n,) each: the limits; for joints without, a turn about the start."""
    near, far = _limited(problem)
    lower = np.where(near, problem.robot.lower, problem.start - _TURN)
    upper = np.where(far, problem.robot.upper, problem.start + _TURN)
    if isinstance(problem.goal, (ConfigurationGoal, ConfigurationsGoal)):
        rows = np.atleast_2d(problem.goal.q)
        low, high = (rows - problem.goal.tolerance).min(axis=0), (rows + problem.goal.tolerance).max(axis=0)
        lower = np.maximum(np.minimum(lower, low), problem.robot.lower)
        upper = np.minimum(np.maximum(upper, high), problem.robot.upper)
    return lower, upper


def reaching_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box that goal configurations are sought in, (n,) each: the limits, or half a turn about the start."""
    robot = problem.robot
    near, far = _limited(problem)
    lower = np.where(near, robot.lower, np.minimum(problem.start, robot.upper) - _HALF_TURN)
    upper = np.where(far, robot.upper, np.maximum(problem.start, robot.lower) + _HALF_TURN)
    return lower, upper


def _limited(problem: Problem) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell which joints have a lower and which an upper limit that is one, (n,) each."""
    return problem.robot.lower >= problem.start - FAR, problem.robot.upper <= problem.start + FAR


# ---- What looks for configurations that reach a goal, and what is found: common to goals of every kind ---------------


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


# ---- -----------------------------------------------------------------------------------------------------------------
# The swarm in configuration space that looks for configurations which reach a goal: the seed's own formulation.


_ANYWHERE = 1e6  # [m]
_LEVER = 0.25  # [m] how far from the frame's origin its axes are watched


@dataclass(frozen=True, slots=True, kw_only=True)
class Slack:
    """How near to the goal a swarm must come, where that is more than the goal's own tolerance.

    Attributes:
        distance: [m].
        angle: [rad].
    """

    distance: float
    angle: float


def swarm_configurations(
    problem: Problem,
    goal: SpaceGoal | None,
    bounds: tuple[Array, Array],
    swarm: PSO,
    *,
    home: Array,
    margin: float,
    slack: Slack | None = None,
    seed: int,
    first: int,
    count: int,
    threads: int | None,
    nearest: bool = False,
    late: Callable[[], bool] = lambda: False,
) -> Array:
    """Run independent swarms, each of which ends with a configuration that is free and near the goal, or nearly so.

    Args:
        problem: robot and scene; its own goal is not looked at.
        goal: where the frame is to be; None: anywhere.
        bounds: (n,) lower and upper [rad or m].
        swarm: settings of each.
        home: (n,) the configuration to stay near [rad or m].
        margin: clearance asked for [m].
        slack: how near to the goal is near enough; None: its tolerance.
        seed: of all.
        first: number of the first swarm.
        count: how many.
        threads: None for one a core; the result does not depend on it.
        nearest: spend the whole budget to come near home, rather than end as soon as there is something.
        late: whether time is up; then only those swarms that have begun give something.

    Returns:
        (count, n), fewer if time was up: configurations within the bounds, one a swarm; which are free and near enough is
        not said.
    """
    points, targets, tolerances = _watched(problem, goal, slack or Slack(distance=0.0, angle=0.0))
    model = make_kernel_model(problem.robot, problem.scene, points=points)
    objective = native.ReachObjective32(
        scene=model.model32,
        points=np.array(model.points, dtype=np.int32),
        targets=np.array(targets, dtype=np.float64).reshape(-1, 3),
        tolerances=np.array(tolerances, dtype=np.float64),
        margin=margin,
        home=np.array(home, dtype=np.float64),
    )
    runs = run_trials(
        objective,
        *bounds,
        swarm,
        seed=seed,
        first_trial=first,
        trials=count,
        threads=threads,
        stop_when_feasible=not nearest,
        progress=lambda _: not late(),
    )
    x = np.array([run.x for run in runs]).reshape(-1, problem.robot.dof)
    return np.clip(x, *bounds)  # float32 may have rounded a bound outwards


def _watched(
    problem: Problem, goal: SpaceGoal | None, slack: Slack
) -> tuple[list[tuple[int, Array]], list[Array], list[float]]:
    """Return points of the goal's frame, where they are to be, and how near: a pose is three points, a direction two.

    Near a pose the distances of points with a lever say the same as its distance and angle. They leave out the corner of
    a wide tolerance where the origin is far off and the orientation exact.
    """
    frame = problem.robot.frame(problem.robot.tip if goal is None else goal.frame or problem.robot.tip)
    if goal is None:
        return [(frame.joint, frame.T_joint_frame[:3, 3])], [np.zeros(3)], [_ANYWHERE]
    if isinstance(goal, PositionGoal):
        return [(frame.joint, frame.T_joint_frame[:3, 3])], [goal.position], [max(goal.tolerance, slack.distance)]
    distance = max(goal.position_tolerance, slack.distance)
    angle = max(goal.orientation_tolerance, slack.angle)
    points = [(frame.joint, frame.T_joint_frame[:3, 3])]
    targets, tolerances = [goal.position], [distance]
    if angle < np.pi:
        axes = np.eye(3)[:2] if goal.free_axis is None else goal.free_axis[None]
        for axis in axes:
            local = np.append(_LEVER * axis, 1.0)
            points.append((frame.joint, product(frame.T_joint_frame, local)[:3]))
            targets.append(product(goal.pose, local)[:3])
            # A turn by the angle moves two ends across each other by the lever times its chord, over both together.
            tolerances.append(max(2 * _LEVER * float(sines(angle / 2)[0]) / np.sqrt(len(axes)), distance))
    return points, targets, tolerances


# ---- -----------------------------------------------------------------------------------------------------------------
# Goals in joint space: configurations taken as they are where they are free, else sought within their tolerance.

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


# ---- -----------------------------------------------------------------------------------------------------------------
# Goals in space: swarms come near from everywhere, damped least squares brings them onto the goal, all is checked.


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


# ---- -----------------------------------------------------------------------------------------------------------------
# Which configurations reach a goal: found by swarms in configuration space, brought onto the goal, and checked.


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
