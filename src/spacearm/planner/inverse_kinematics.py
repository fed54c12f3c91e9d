"""Inverse kinematics: the collision-free configurations that reach a goal.

A configuration is taken as it is where it is free of collision; else swarms look around it within its tolerance. For a goal in
space the kernel runs damped least squares from many guesses side by side. If none of what they find is free, swarms come near
the goal from everywhere (`goal_swarms`), and damped least squares brings these onto it. Of the results that are free, some that
differ are pulled towards the start. The nearest to the start come first.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import keep
from spacearm.core.exact import length, product
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.native import native
from spacearm.core.rotations import rotation_vectors, turns_between
from spacearm.geometry import bounding_points
from spacearm.planner.clearance import ClearanceModel, KernelClearance, Room
from spacearm.planner.goal_choice import LEAST_CLEARANCE, with_room
from spacearm.planner.goal_swarms import GoalSwarms, Slack
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, JointGoal, PositionGoal, SpaceGoal
from spacearm.planner.kernel_model import kernel_model, make_kernel_model
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem, nearest_turns, whole_turns
from spacearm.planner.searched_clearance import SearchedClearance, clearance_of_goals, usual_clearance
from spacearm.planner.tracking_room import TrackingRoom, tracking_room, within_tube
from spacearm.robot.kinematics import tree_model
from spacearm.robot.model import Frame, Robot

Array = NDArray[np.float64]

FAR = 1e3
"""[rad or m] A joint limit so far from the start is as good as none: the box of a search ends nearer."""
LEVER = 0.2
"""[m] An error of 1 rad weighs as much as an error of this length."""
_WORTH_MOVING = 1e-3  # [rad or m] a tolerance of a goal configuration within which it may gain clearance
_SWARMS = 4  # around each goal configuration that is in collision
_NEAR = 0.01  # [m or rad] what is farther from the goal than that and three times the tolerance is out of reach
_GUESSES = 16  # for each goal candidate asked for, at first: most poses among obstacles then have as many that differ
_MOST_GUESSES = 128  # likewise, where none is free; or where there are fewer than asked for, as long as doubling finds more
_NEAREST_MISSES, _ROUNDS_OF_MISSES = 64, 100  # of damped least squares to where the goal is missed least
_LEAST_LACKING = 4  # configurations for each goal candidate that are looked at more closely where none has the room wanted


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class GoalConfigurations(Brief):
    """The configurations that a motion may end in, and what was met on the way to them.

    Attributes:
        q: (g, n) distinct, free of collision, within the limits and the goal's tolerance, nearest to the start first.
        clearance: (g,) of each, to obstacles and between links [m].
        searches: how many guesses and swarms looked for them; 0 where the goal is a configuration that could be taken as it is.
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


def find_goal_configurations(
    problem: Problem, settings: PlannerSettings, seed: int, *, late: Callable[[], bool] = lambda: False
) -> GoalConfigurations:
    """Find distinct collision-free configurations that reach a problem's goal, with the clearance that it requires.

    Where none has that, those are returned that lack least of it. Where the base floats, a goal in space is sought with the
    base as it begins: the search for motions sets out from there.

    Args:
        problem: robot, scene, start and goal.
        settings: of the planner: `goal_candidates` is the most that are returned of a goal in space.
        seed: random seed; the same one gives the same configurations, on any number of threads.
        late: whether time is up: what was found by then is returned; the first guesses or swarms are always run.

    Returns:
        What was found; `q` is empty if nothing was.
    """
    robot, start, goal = problem.robot, problem.start, problem.goal
    follows_arm = problem.base_model.follows_arm
    in_joint_space = isinstance(goal, (ConfigurationGoal, ConfigurationsGoal))
    clearance = problem.at_goal if in_joint_space else problem.at_start
    tube = tracking_room(problem, settings)
    asked = bool(problem.clearance or problem.clearances or tube)
    looked_for = not in_joint_space or bool(np.any(goal.tolerance))
    taken = tube.guessed(start[None], len(clearance.scene.obstacles)) if tube is not None and looked_for else None
    plain = SearchedClearance(asked=usual_clearance(problem))
    search = _Search(
        robot=robot,
        clearance=clearance,
        required=clearance.required_by(problem) if asked else None,
        swarms=GoalSwarms(
            robot=robot,
            scene=clearance.scene,
            searched=clearance_of_goals(problem, clearance, taken) if asked and looked_for else plain,
            seed=seed,
            threads=settings.threads,
            late=late,
        ),
        candidates=settings.goal_candidates,
        late=late,
        tube=tube,
    )
    if in_joint_space:
        return _find_in_joint_space(goal, start, search)
    # Where the search for motions moves the end too, and the first motion is enough, pulling takes longer than it saves.
    pull = not (follows_arm and settings.stop_at_first)
    found = _SpaceSearch(reach=Reach(robot=robot, goal=goal), start=start, search=search, pull=pull).run()
    if len(found.q) or not follows_arm:
        return found
    # Out of reach for the base as it begins, but the arm will move it: the search begins at what comes nearest.
    nearest = (start if found.closest is None else found.closest)[None]
    return replace(found, q=nearest.copy(), clearance=search.clearance.least(nearest))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
    """What looks for configurations, and what they are checked against.

    Attributes:
        robot: with n joints.
        clearance: of configurations, to the scene and between links.
        required: the clearance of each pair; None: no contact is enough.
        swarms: that look for them.
        candidates: how many configurations are wanted at most.
        late: whether time is up.
        tube: of a tracking error; None: there is none.
    """

    robot: Robot
    clearance: ClearanceModel
    required: KernelClearance | None
    swarms: GoalSwarms
    candidates: int
    late: Callable[[], bool]
    tube: TrackingRoom | None

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The limits (n,) of the joints, with room for a tracking error [rad or m]."""
        robot = self.robot
        return within_tube(robot, robot.lower, robot.upper, 0.0 if self.tube is None else self.tube.tracking)

    def room(self, q: Array) -> Room:
        """Compare the clearances of configurations (b, n), within the tube of a tracking error, with those required."""
        return self.clearance.room(q, self.required, None if self.tube is None else self.tube.likely_taken(q))

    def guesses(self, reach: Reach, start: Array, bounds: tuple[Array, Array]) -> native.GoalSearch64:
        """Return the kernel's search from many guesses within bounds (n,) each."""
        scene, searched = self.clearance.scene, self.swarms.searched
        pairs, (lower, upper) = searched.kernel_pairs, bounds
        made = make_kernel_model(self.robot, scene, pair_margins=pairs) if pairs else kernel_model(self.robot, scene)
        return native.GoalSearch64(
            scene=made.model64,
            goal=reach.kernel_goal,
            start=np.array(start),
            lower=lower,
            upper=upper,
            whole_turns=whole_turns(self.robot),
            margin=searched.asked,
            seed=self.swarms.seed,
        )


@dataclass(slots=True)
class _Counts:
    """How much was looked at so far; see `GoalConfigurations`."""

    searches: int = 0
    reached: int = 0
    in_collision: int = 0

    def found(self, q: Array, clear: Array, start: Array) -> GoalConfigurations:
        """Put together configurations (g, n) and their clearances (g,), nearest to the start first."""
        order = np.argsort(np.linalg.norm(q - start, axis=1), kind="stable")
        return GoalConfigurations(q=q[order], clearance=clear[order], **asdict(self))

    def none(self, closest: Array | None, distance: float = 0.0, angle: float = 0.0, *, dof: int) -> GoalConfigurations:
        """Say that there are none, and what came closest."""
        q = np.zeros((0, dof))
        return GoalConfigurations(q=q, clearance=q[:, 0], closest=closest, distance=distance, angle=angle, **asdict(self))


# ---- Goals in joint space --------------------------------------------------------------------------------------------


def _find_in_joint_space(goal: JointGoal, start: Array, search: _Search) -> GoalConfigurations:
    """Find the free ones of a goal's configurations; if none is, free ones beside them within the tolerance.

    Those with the clearance that is required go before those without. A configuration that is given may be nearer.
    """
    rows = np.atleast_2d(goal.q)
    room = search.room(rows)
    free = room.least > 0
    good = free & (room.beyond >= 0)
    counts = _Counts(reached=len(rows), in_collision=int((~free).sum()))
    if good.any():
        return counts.found(rows[good], room.least[good], start)
    if np.max(goal.tolerance) > (_WORTH_MOVING if free.any() else 0):
        order = np.argsort(-room.beyond, kind="stable")
        found = _beside(goal.tolerance, rows[order][: search.candidates], search, counts, roomy=bool(free.any()))
        if found:
            return counts.found(np.array([q for q, _ in found]), np.array([clear for _, clear in found]), start)
    if free.any():
        return counts.found(rows[free], room.least[free], start)
    return counts.none(rows[int(np.argmax(room.least))], dof=search.robot.dof)


def _beside(
    tolerance: float | Array, rows: Array, search: _Search, counts: _Counts, *, roomy: bool
) -> list[tuple[Array, float]]:
    """Look around configurations for the nearest free ones within the tolerance, and their clearances.

    Those with the clearance that is required count before those without, and no others if `roomy`.
    """
    found: list[tuple[Array, float]] = []
    least, greatest = search.bounds
    counts.searches = _SWARMS * len(rows)
    for i, row in enumerate(rows):
        if i and search.late():
            break
        x = search.swarms.run(
            None,
            lower=np.maximum(row - tolerance, least),
            upper=np.minimum(row + tolerance, greatest),
            home=row,
            particles=64,
            iterations=120,
            first=i * _SWARMS,
            count=_SWARMS,
        )
        room = search.room(x)
        counts.reached += len(x)
        counts.in_collision += int((room.least <= 0).sum())
        free = np.flatnonzero((room.beyond > LEAST_CLEARANCE) & (room.least > LEAST_CLEARANCE))
        if not (free.size or roomy):
            free = np.flatnonzero(room.least > LEAST_CLEARANCE)
        if free.size:
            best = free[np.argmin(np.linalg.norm(x[free] - row, axis=1))]
            found.append((x[best], float(room.least[best])))
    return found


# ---- Goals in space --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stage:
    """How hard to look: swarms for each goal candidate asked for, their size, and how near the goal they must come.

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


class _SpaceSearch:
    """A search for distinct free configurations that reach a goal in space: guesses first, then swarms.

    Args:
        reach: the goal.
        start: (n,) to be near [rad or m].
        search: what looks for them, and what they are checked against.
        pull: whether what is found is pulled towards the start.
    """

    def __init__(self, *, reach: Reach, start: Array, search: _Search, pull: bool) -> None:
        self._reach, self._start, self._search, self._pull = reach, start, search, pull
        self._bounds = within_tube(
            search.robot, *reaching_bounds(search.robot, start), 0.0 if search.tube is None else search.tube.tracking
        )
        self._best, self._counts = _Closest(), _Counts()
        self._beyond = _beyond_reach(search.robot, reach.goal)
        self._kernel = search.guesses(reach, start, self._bounds)

    def run(self) -> GoalConfigurations:
        """Return what is found; see `find_goal_configurations`."""
        found = self._by_guesses()
        if found is None and not (self._search.late() or self._beyond or self._best.is_far(self._reach) or self._is_blocked()):
            found = self._by_swarms()
        best = self._best
        return found or self._counts.none(best.q, best.distance, best.angle, dof=self._search.robot.dof)

    def _by_guesses(self) -> GoalConfigurations | None:
        """Let damped least squares run from twice as many guesses each time, until that brings nothing new."""
        kernel, counts, most = self._kernel, self._counts, self._search.candidates
        guesses, before = _GUESSES * most, -1
        while True:
            kernel.look(guesses - kernel.begun)
            q = kernel.differing(most)
            enough = len(q) == most or 0 < len(q) <= before or self._beyond
            if enough or self._search.late() or guesses >= _MOST_GUESSES * most:
                break
            guesses, before = 2 * guesses, len(q)
        counts.searches, counts.reached, counts.in_collision = kernel.begun, kernel.reached, kernel.in_collision
        found = self._found(q, at_centre=True)
        if found is not None:
            return found
        q = kernel.lacking(_LEAST_LACKING * most) if not len(q) else q
        room = self._search.room(q)
        roomy = with_room(np.ones(len(q), dtype=bool), room)
        found = self._found(q[roomy], at_centre=True)
        if found is not None:
            return found
        lower, upper = self._bounds
        missed = polished(self._reach, kernel.missed(_NEAREST_MISSES), lower, upper, rounds=_ROUNDS_OF_MISSES)
        self._best.offer(self._reach, q, room.least)
        self._best.offer(self._reach, missed, self._search.room(missed).least)
        return None

    def _is_blocked(self) -> bool:
        """Whether an obstacle is where the goal's frame takes the link that it is fixed to, whatever the other joints do.

        A body that is deeper in an obstacle than any of its points can move stays in it. Within the goal's tolerances they
        move by no more than the distance, and the angle times their distance from the frame.
        """
        reach, goal, q = self._reach, self._reach.goal, self._kernel.lacking(1)
        if not len(q) or isinstance(goal, PositionGoal) or goal.free_axis is not None:
            return False
        depth: Array = -self._search.clearance.to_kernel_obstacles(q)[0].min(axis=-1, initial=0.0)
        near, turned = goal.tolerances
        for part, deep in zip(self._search.robot.shapes, depth.tolist(), strict=True):
            if part.joint == reach.joint:
                points, rounding = bounding_points(part.shape)
                far = float(np.linalg.norm(points - reach.T_joint_frame[:3, 3], axis=1).max()) + rounding
                if deep > 2 * (near + turned * far):  # from one side of the tolerances to the other
                    return True
        return False

    def _by_swarms(self) -> GoalConfigurations | None:
        """Let swarms look near the goal for what is free, and bring that onto it."""
        search, reach, counts, first = self._search, self._reach, self._counts, 0
        lower, upper = self._bounds
        for stage in _STAGES:
            count = stage.swarms * search.candidates
            swarms = search.swarms.run(
                reach.goal,
                lower=lower,
                upper=upper,
                home=self._start,
                particles=stage.particles,
                iterations=stage.iterations,
                first=first,
                count=count,
                slack=stage.slack,
            )
            seen = nearest_turns(search.robot, np.vstack([self._start, swarms]), self._start)
            onto = polished(reach, seen, lower, upper, rounds=stage.rounds)
            there, as_seen = reaches(reach, onto), reaches(reach, seen)
            room, room_as_seen = search.room(onto), search.room(seen)
            free = (there & (room.least > 0)) | (as_seen & (room_as_seen.least > 0))
            first += count
            counts.searches += count
            counts.reached += int((there | as_seen).sum())
            counts.in_collision += int(((there | as_seen) & ~free).sum())
            # What is at the goal's centre goes before what is only within its tolerance.
            for q, good, has, at_centre in ((onto, there, room, True), (seen, as_seen, room_as_seen, False)):
                roomy = with_room(good, has)
                found = self._found(q[roomy], at_centre=at_centre)
                if found is not None:
                    return found
            self._best.offer(reach, onto, room.least)
            self._best.offer(reach, seen, room_as_seen.least)
            if search.late() or (stage is not _STAGES[0] and self._best.is_far(reach)):
                return None
        return None

    def _found(self, q: Array, *, at_centre: bool) -> GoalConfigurations | None:
        """Pull free configurations (b, n) at the goal towards the start, and return those that differ, if there are any.

        What is pulled loses none of the room it has, up to what the search asks for.
        """
        if not len(q):
            return None
        most = self._search.candidates
        if self._pull or len(q) > most:
            q = self._kernel.pulled(q, most, pull=self._pull, at_centre=at_centre)
        q = self._kernel.with_turns(q, most)
        room = self._search.room(q)
        kept = with_room(np.ones(len(q), dtype=bool), room)
        return self._counts.found(q[kept], room.least[kept], self._start) if kept.any() else None


def reaching_bounds(robot: Robot, start: Array) -> tuple[Array, Array]:
    """Return the box that goal configurations are sought in, (n,) each: the limits, or half a turn about the start.

    Where a whole turn moves links, as it does where others follow at another pace, it is a whole turn about the start: the
    search for motions goes as far.
    """
    far = np.where(whole_turns(robot), math.pi, math.tau)
    lower = np.where(robot.lower >= start - FAR, robot.lower, np.minimum(start, robot.upper) - far)
    upper = np.where(robot.upper <= start + FAR, robot.upper, np.maximum(start, robot.lower) + far)
    return lower, upper


def _beyond_reach(robot: Robot, goal: SpaceGoal) -> bool:
    near, _ = goal.tolerances
    return bool(np.linalg.norm(goal.position) > reach_of(robot, goal.frame or robot.tip) + near)


@dataclass(slots=True)
class _Closest:
    """The configuration nearest to the goal; of those that reach it, the one least in collision."""

    q: Array | None = None
    distance: float = np.inf
    angle: float = np.inf
    merit: tuple[bool, float] = field(default=(True, np.inf))  # whether it misses the goal, and by how much

    def offer(self, reach: Reach, q: Array, clear: Array) -> None:
        """Take the best of configurations (b, n) with clearances (b,), if it is better."""
        if not len(q):
            return
        distance, angle = goal_errors(reach, q)
        misses = ~reaches(reach, q)
        merit = np.where(misses, np.hypot(distance, LEVER * angle), -clear)
        best = np.lexsort((merit, misses))[0]
        if (bool(misses[best]), float(merit[best])) < self.merit:
            self.merit = bool(misses[best]), float(merit[best])
            self.q, self.distance, self.angle = q[best], float(distance[best]), float(angle[best])

    def is_far(self, reach: Reach) -> bool:
        """Whether nothing came near the goal: it is brought onto without regard to obstacles, so none is in the way."""
        near, turned = reach.goal.tolerances
        return self.merit[0] and (self.distance > 3 * near + _NEAR or self.angle > 3 * turned + _NEAR)


# ---- The distance of configurations from a goal in space, and the way onto it ----------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Reach(Brief):
    """A goal in space for one robot.

    Attributes:
        robot: with n joints.
        goal: the goal; its frame is the robot's tip if it names none.
        model: the kernel's model of the joints.
        joint: index of the joint whose moving frame the goal's frame rides on.
        T_joint_frame: (4, 4) from the goal's frame to that moving frame [m].
    """

    robot: Robot
    goal: SpaceGoal
    model: native.Model64 = field(init=False)
    joint: int = field(init=False)
    T_joint_frame: Array = field(init=False)

    def __post_init__(self) -> None:
        frame = self.robot.frame(self.goal.frame or self.robot.tip)
        keep(self, model=tree_model(self.robot), joint=frame.joint, T_joint_frame=frame.T_joint_frame)

    @property
    def kernel_goal(self) -> native.FrameGoal:
        """The goal as the kernel takes it."""
        near, turned = self.goal.tolerances
        return kernel_goal(self.robot, self.goal, distance=near, angle=turned)


def kernel_goal(robot: Robot, goal: SpaceGoal, *, distance: float, angle: float) -> native.FrameGoal:
    """Return a goal in space as the kernel takes it, with tolerances [m] and [rad]."""
    kinds, frame = native.FrameGoalKind, robot.frame(goal.frame or robot.tip)
    pose = np.eye(4) if isinstance(goal, PositionGoal) else goal.pose
    axis = None if isinstance(goal, PositionGoal) else goal.free_axis
    return native.FrameGoal(
        kind=kinds.position if isinstance(goal, PositionGoal) else kinds.pose if axis is None else kinds.axis,
        joint=frame.joint,
        local=frame.T_joint_frame[:3, :3].copy(),
        offset=frame.T_joint_frame[:3, 3].copy(),
        wanted=pose[:3, :3].copy(),
        position=np.array(goal.position),
        axis=np.zeros(3) if axis is None else np.array(axis),
        position_tolerance=distance,
        angle_tolerance=angle,
    )


def goal_errors(reach: Reach, q: Array) -> tuple[Array, Array]:
    """Return how far the goal's frame is from where it is to be.

    Args:
        reach: the goal.
        q: (b, n) configurations [rad or m].

    Returns:
        The distance (b,) [m] and the angle (b,) [rad]: of the turn between the orientations, or of the free axis; 0 for a
        position.
    """
    frames = reach.model.joint_frames(np.ascontiguousarray(q))
    return pose_errors(reach.goal, product(frames[:, reach.joint], reach.T_joint_frame))


def pose_errors(goal: SpaceGoal, T: Array) -> tuple[Array, Array]:
    """Return how far frames that stand at T (b, 4, 4) are from where the goal's is to be: (b,) [m] and (b,) [rad]."""
    distance = np.linalg.norm(goal.position - T[:, :3, 3], axis=-1)
    if isinstance(goal, PositionGoal):
        return distance, np.zeros(len(T))
    R, R_goal = T[:, :3, :3], goal.pose[:3, :3]
    if goal.free_axis is None:
        turn = rotation_vectors(product(R_goal, np.swapaxes(R, -1, -2)))
    else:
        turn = turns_between(product(R, goal.free_axis), product(R_goal, goal.free_axis))
    return distance, np.linalg.norm(turn, axis=-1)


def reaches(reach: Reach, q: Array) -> NDArray[np.bool_]:
    """Tell which configurations (b, n) reach the goal within its tolerances, (b,)."""
    distance, angle = goal_errors(reach, q)
    near, turned = reach.goal.tolerances
    return (distance <= near) & (angle <= turned)


def reach_of(robot: Robot, frame: str) -> float:
    """Return a bound [m] of how far from the base a frame's origin can get."""
    known = _known_reaches(robot)
    if frame not in known:
        known[frame] = _reach_of(robot, robot.frame(frame))
    return known[frame]


@cached_by_identity
def _known_reaches(_: Robot) -> dict[str, float]:
    """Return room for the reaches of a robot's frames."""
    return {}


def _reach_of(robot: Robot, placed: Frame) -> float:
    reach, at = length(placed.T_joint_frame[:3, 3]), placed.joint
    while at >= 0:
        joint = robot.joints[at]
        reach += length(joint.T_parent_joint[:3, 3])
        if joint.kind == "prismatic":
            values = [joint.multiplier * limit + joint.offset for limit in (robot.lower[joint.dof], robot.upper[joint.dof])]
            reach += float(np.abs(values).max())
        at = joint.parent
    return reach


def polished(reach: Reach, q: Array, lower: Array, upper: Array, *, rounds: int = 40) -> Array:
    """Bring configurations to the goal's very centre, or as near to it as bounds and arm allow.

    Damped least squares (Levenberg and Marquardt; damped by the error, after Sugihara, 2011), all rows side by side. Joints
    that push against a bound stay on it.

    Args:
        reach: the goal.
        q: (b, n) where to begin [rad or m].
        lower: (n,) bounds, which q stays within.
        upper: (n,) likewise.
        rounds: the most steps.

    Returns:
        (b, n): each no farther from the goal than it was, in m plus 0.2 m times the chord of the angle, 2 sin(angle / 2).
    """
    inside = np.ascontiguousarray(np.clip(q, lower, upper))
    return native.polished64(reach.model, reach.kernel_goal, inside, np.array(lower), np.array(upper), rounds)
