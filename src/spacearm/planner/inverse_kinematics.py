"""Inverse kinematics: the collision-free configurations that reach a goal.

A configuration is taken as it is where it is free of collision; else swarms look around it within its tolerance. For a goal in
space, swarms come near it from everywhere (`goal_swarms`), and damped least squares brings what they find onto the goal. Of the
results that are free, each is pulled towards the start, and those that differ remain, the nearest to the start first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import keep
from spacearm.core.exact import length, product, solved
from spacearm.core.native import native
from spacearm.core.rotations import rotation_vectors, turns_between
from spacearm.planner.clearance import ClearanceModel, KernelClearance, Room
from spacearm.planner.goal_choice import LEAST_CLEARANCE, distinct, with_room
from spacearm.planner.goal_swarms import GoalSwarms, Slack
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, JointGoal, PositionGoal, SpaceGoal
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem, nearest_turns
from spacearm.planner.searched_clearance import SEARCH_ROOM, SearchedClearance, clearance_of_goals, usual_clearance
from spacearm.robot.kinematics import tree_model
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

FAR = 1e3
"""[rad or m] A joint limit so far from the start is as good as none: the box of a search ends nearer."""
LEVER = 0.2
"""[m] An error of 1 rad weighs as much as an error of this length."""
_WORTH_MOVING = 1e-3  # [rad or m] a tolerance of a goal configuration within which it may gain clearance
_SWARMS = 4  # around each goal configuration that is in collision
_PULLS = 6  # steps towards the start
_PULL_ROUNDS = 4  # of damped least squares after each of them
_CLOSER = 1e-3  # [rad or m] by which a step must at least bring it nearer
_NEAR = 0.01  # [m or rad] what is farther from the goal than that and three times the tolerance is out of reach
_LONGEST_STEP = 0.6  # [rad or m] of any joint in one step of damped least squares
_EXACT = 1e-10  # [m] error that is called converged: rounding is 1e-15 or so


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
        late: whether time is up: what was found by then is returned; the first swarms are always run.

    Returns:
        What was found; `q` is empty if nothing was.
    """
    robot, start, goal = problem.robot, problem.start, problem.goal
    follows_arm = problem.base_model.follows_arm
    in_joint_space = isinstance(goal, (ConfigurationGoal, ConfigurationsGoal))
    clearance = problem.at_goal if in_joint_space else problem.at_start
    asked = bool(problem.clearance or problem.clearances)
    looked_for = not in_joint_space or bool(np.any(goal.tolerance))
    plain = SearchedClearance(asked=usual_clearance(problem))
    search = _Search(
        robot=robot,
        clearance=clearance,
        required=clearance.required_by(problem) if asked else None,
        swarms=GoalSwarms(
            robot=robot,
            scene=clearance.scene,
            searched=clearance_of_goals(problem, clearance) if asked and looked_for else plain,
            seed=seed,
            threads=settings.threads,
            late=late,
        ),
        candidates=settings.goal_candidates,
        late=late,
    )
    if in_joint_space:
        return _find_in_joint_space(goal, start, search)
    # Where the search for motions moves the end too, and the first motion is enough, pulling takes longer than it saves.
    pull = not (follows_arm and settings.stop_at_first)
    reach = Reach(robot=robot, goal=goal)
    found = _find_in_space(reach, start, search, pull=pull)
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
    """

    robot: Robot
    clearance: ClearanceModel
    required: KernelClearance | None
    swarms: GoalSwarms
    candidates: int
    late: Callable[[], bool]

    def room(self, q: Array) -> Room:
        """Compare the clearances of configurations (b, n) with those required."""
        return self.clearance.room(q, self.required)


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
    counts.searches = _SWARMS * len(rows)
    for i, row in enumerate(rows):
        if i and search.late():
            break
        x = search.swarms.run(
            None,
            lower=np.maximum(row - tolerance, search.robot.lower),
            upper=np.minimum(row + tolerance, search.robot.upper),
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


def _find_in_space(reach: Reach, start: Array, search: _Search, *, pull: bool) -> GoalConfigurations:
    """Find distinct free configurations that reach a goal in space; see `find_goal_configurations`."""
    lower, upper = reaching_bounds(search.robot, start)
    best, counts = _Closest(), _Counts()
    for stage in _STAGES:
        count = stage.swarms * search.candidates
        swarms = search.swarms.run(
            reach.goal,
            lower=lower,
            upper=upper,
            home=start,
            particles=stage.particles,
            iterations=stage.iterations,
            first=counts.searches,
            count=count,
            slack=stage.slack,
        )
        seen = nearest_turns(search.robot, np.vstack([start, swarms]), start)
        onto = polished(reach, seen, lower, upper, rounds=stage.rounds, late=search.late)
        as_seen = reaches(reach, seen)
        if as_seen[0]:
            onto[0] = seen[0]  # the start is there already: nothing needs to move
        there = reaches(reach, onto)
        room, room_as_seen = search.room(onto), search.room(seen)
        free = (there & (room.least > 0)) | (as_seen & (room_as_seen.least > 0))
        counts.searches += count
        counts.reached += int((there | as_seen).sum())
        counts.in_collision += int(((there | as_seen) & ~free).sum())
        # What is at the goal's centre goes before what is only within its tolerance.
        for q, good, has, at_centre in ((onto, there, room, True), (seen, as_seen, room_as_seen, False)):
            roomy = with_room(good, has)
            if roomy.any():
                q, clear = q[roomy], has.least[roomy]
                if pull:
                    q, clear = _pulled(reach, q, has.select(roomy), start, search, at_centre=at_centre)
                chosen = distinct(q, start, search.candidates)
                return counts.found(q[chosen], clear[chosen], start)
        best.offer(reach, onto, room.least)
        best.offer(reach, seen, room_as_seen.least)
        if search.late() or _beyond_reach(search.robot, reach.goal) or (stage is not _STAGES[0] and best.is_far(reach)):
            break
    return counts.none(best.q, best.distance, best.angle, dof=search.robot.dof)


def reaching_bounds(robot: Robot, start: Array) -> tuple[Array, Array]:
    """Return the box that goal configurations are sought in, (n,) each: the limits, or half a turn about the start."""
    lower = np.where(robot.lower >= start - FAR, robot.lower, np.minimum(start, robot.upper) - np.pi)
    upper = np.where(robot.upper <= start + FAR, robot.upper, np.maximum(start, robot.lower) + np.pi)
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


def _pulled(reach: Reach, q: Array, room: Room, start: Array, search: _Search, *, at_centre: bool) -> tuple[Array, Array]:
    """Add to configurations (b, n) what they become when pulled towards the start while the frame stays in place.

    Args:
        reach: the goal.
        q: free configurations that reach it.
        room: (b,) their clearances; what is pulled keeps 2 mm beyond what is required, or what there was if that was less.
        start: (n,) to pull towards [rad or m].
        search: bounds and clearances to keep.
        at_centre: whether they are at the goal's very centre, and are to stay there.

    Returns:
        (2 b, n) and the least clearance of each (2 b,) [m].
    """
    lower, upper = reaching_bounds(search.robot, start)
    least, most_lacking = np.minimum(SEARCH_ROOM, room.beyond), room.lacking
    near, clear = q.copy(), room.least.copy()
    away = np.linalg.norm(near - start, axis=1)
    share = np.full(len(q), 0.5)
    for _ in range(_PULLS):
        if search.late():
            break
        tried = np.clip(nearer(reach, near, start, share), lower, upper)
        if at_centre:
            tried = polished(reach, tried, lower, upper, rounds=_PULL_ROUNDS)
        new_room, new_away = search.room(tried), np.linalg.norm(tried - start, axis=1)
        good = (new_away < away - _CLOSER) & reaches(reach, tried)
        good &= (new_room.beyond >= least) & (new_room.lacking <= most_lacking) & (new_room.least > 0)
        near[good], clear[good], away[good] = tried[good], new_room.least[good], new_away[good]
        share = np.where(good, share, share * 0.4)
    return np.vstack([near, q]), np.concatenate([clear, room.least])


# ---- The distance of configurations from a goal in space, and damped least squares onto it ---------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """A goal in space for one robot, and the chain of joints that moves its frame.

    Attributes:
        robot: with n joints.
        goal: the goal; its frame is the robot's tip if it names none.
        model: the kernel's model of the joints.
        joint: index of the joint whose moving frame the goal's frame rides on.
        T_joint_frame: (4, 4) from the goal's frame to that moving frame [m].
        chain: (k,) indices of the joints from the base to the frame.
        moved_by: (k, n) 1 where an entry of q moves a joint of the chain; one may move several.
        turns: (k,) what a joint turns by for 1 in q; 0 for slides.
        slides: (k,) how far a joint slides for 1 in q; 0 for those that turn.
    """

    robot: Robot
    goal: SpaceGoal
    model: native.Model64 = field(init=False)
    joint: int = field(init=False)
    T_joint_frame: Array = field(init=False)
    chain: NDArray[np.intp] = field(init=False)
    moved_by: Array = field(init=False)
    turns: Array = field(init=False)
    slides: Array = field(init=False)

    def __post_init__(self) -> None:
        robot = self.robot
        frame = robot.frame(self.goal.frame or robot.tip)
        chain: list[int] = []
        at = frame.joint
        while at >= 0:
            chain.append(at)
            at = robot.joints[at].parent
        chain.reverse()
        joints = [robot.joints[i] for i in chain]
        keep(
            self,
            model=tree_model(robot),
            joint=frame.joint,
            T_joint_frame=frame.T_joint_frame,
            chain=np.array(chain, dtype=np.intp),
            moved_by=np.eye(robot.dof)[[joint.dof for joint in joints]],
            turns=np.array([joint.multiplier * (joint.kind == "revolute") for joint in joints]),
            slides=np.array([joint.multiplier * (joint.kind == "prismatic") for joint in joints]),
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
    residual, _ = _residuals(reach, reach.model.joint_frames(np.ascontiguousarray(q)))
    return np.linalg.norm(residual[:, :3], axis=-1), np.linalg.norm(residual[:, 3:], axis=-1) / LEVER


def pose_errors(goal: SpaceGoal, T: Array) -> tuple[Array, Array]:
    """Return how far frames that stand at T (b, 4, 4) are from where the goal's is to be: (b,) [m] and (b,) [rad]."""
    residual, _ = _missing(goal, T)
    return np.linalg.norm(residual[:, :3], axis=-1), np.linalg.norm(residual[:, 3:], axis=-1) / LEVER


def reaches(reach: Reach, q: Array) -> NDArray[np.bool_]:
    """Tell which configurations (b, n) reach the goal within its tolerances, (b,)."""
    distance, angle = goal_errors(reach, q)
    near, turned = reach.goal.tolerances
    return (distance <= near) & (angle <= turned)


def reach_of(robot: Robot, frame: str) -> float:
    """Return a bound [m] of how far from the base a frame's origin can get."""
    placed = robot.frame(frame)
    reach, at = length(placed.T_joint_frame[:3, 3]), placed.joint
    while at >= 0:
        joint = robot.joints[at]
        reach += length(joint.T_parent_joint[:3, 3])
        if joint.kind == "prismatic":
            values = [joint.multiplier * limit + joint.offset for limit in (robot.lower[joint.dof], robot.upper[joint.dof])]
            reach += float(np.abs(values).max())
        at = joint.parent
    return reach


def polished(
    reach: Reach, q: Array, lower: Array, upper: Array, *, rounds: int = 40, late: Callable[[], bool] = lambda: False
) -> Array:
    """Bring configurations to the goal's very centre, or as near to it as bounds and arm allow.

    Damped least squares (Levenberg and Marquardt), all rows side by side, joints that push against a bound stay on it.

    Args:
        reach: the goal.
        q: (b, n) where to begin [rad or m].
        lower: (n,) bounds, which q stays within.
        upper: (n,) likewise.
        rounds: the most steps.
        late: whether time is up.

    Returns:
        (b, n): each no farther from the goal than it was, in m plus 0.2 m per rad.
    """
    q = np.clip(q, lower, upper)
    if not len(q):
        return q
    damping = np.full(len(q), 1e-3)
    here = _placed(reach, q)
    going = np.flatnonzero(here.cost > _EXACT**2)
    for _ in range(rounds):
        if not going.size or late():
            break
        at = here.rows(going)
        tried = np.clip(q[going] + _step(at, q[going], lower, upper, damping[going]), lower, upper)
        there = _placed(reach, tried)
        better = there.cost < at.cost
        damping[going] = np.clip(np.where(better, damping[going] * 0.1, damping[going] * 8), 1e-12, 1e6)
        moved = going[better]
        progress = (at.cost - there.cost) > 1e-6 * at.cost
        q[moved] = tried[better]
        here.put(moved, there.rows(better))
        stuck = (better & ~progress) | (damping[going] >= 1e6)
        going = going[~stuck & (here.cost[going] > _EXACT**2)]
    return q


def nearer(reach: Reach, q: Array, towards: Array, share: Array) -> Array:
    """Move configurations (b, n) shares (b,) of the way towards another (n,), along what leaves the goal's frame in place."""
    J, wish = _placed(reach, q).jacobian, towards - q
    seen = np.einsum("bmn,bn->bm", J, wish)  # what the frame would see of it
    step = share[:, None] * (wish - np.einsum("bmn,bm->bn", J, _solved(J, seen, np.full(len(q), 1e-9))))
    return q + _shortened(step)


@dataclass(slots=True)
class _Placed:
    """Residuals (b, m) [m], their derivatives (b, m, n) and their squares' sums (b,)."""

    residual: Array
    jacobian: Array
    cost: Array

    def rows(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> _Placed:
        return _Placed(self.residual[which], self.jacobian[which], self.cost[which])

    def put(self, which: NDArray[np.intp], other: _Placed) -> None:
        self.residual[which], self.jacobian[which], self.cost[which] = other.residual, other.jacobian, other.cost


def _placed(reach: Reach, q: Array) -> _Placed:
    frames = reach.model.joint_frames(np.ascontiguousarray(q))
    residual, axis = _residuals(reach, frames)
    jacobian = _jacobian(reach, frames)
    if residual.shape[1] == 3:
        jacobian = jacobian[:, :3]
    elif axis is not None:  # turning about the free axis changes nothing
        jacobian[:, 3:] -= axis[:, :, None] * np.einsum("bi,bin->bn", axis, jacobian[:, 3:])[:, None, :]
    return _Placed(residual, jacobian, np.einsum("bm,bm->b", residual, residual))


def _residuals(reach: Reach, frames: Array) -> tuple[Array, Array | None]:
    """Return what is missing to the goal, (b, 3 or 6) [m], and where the free axis points, (b, 3), if there is one."""
    return _missing(reach.goal, product(frames[:, reach.joint], reach.T_joint_frame))


def _missing(goal: SpaceGoal, T: Array) -> tuple[Array, Array | None]:
    missing = goal.position - T[:, :3, 3]
    if isinstance(goal, PositionGoal):
        return missing, None
    R, R_goal = T[:, :3, :3], goal.pose[:3, :3]
    if goal.free_axis is None:
        return np.concatenate([missing, LEVER * rotation_vectors(product(R_goal, np.swapaxes(R, -1, -2)))], axis=1), None
    axis, wanted = product(R, goal.free_axis), product(R_goal, goal.free_axis)
    return np.concatenate([missing, LEVER * turns_between(axis, wanted)], axis=1), axis


def _jacobian(reach: Reach, frames: Array) -> Array:
    """Return how the frame moves and turns (times the lever) with q, (b, 6, n), in base axes."""
    point = product(frames[:, reach.joint, :3, :3], reach.T_joint_frame[:3, 3]) + frames[:, reach.joint, :3, 3]
    chain = frames[:, reach.chain]
    axes, arms = chain[..., :3, 2], point[:, None] - chain[..., :3, 3]  # (b, k, 3)
    columns = np.empty((len(frames), 6, len(reach.chain)))
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        across = axes[..., j] * arms[..., k] - axes[..., k] * arms[..., j]
        columns[:, i] = reach.turns * across + reach.slides * axes[..., i]
        columns[:, 3 + i] = LEVER * reach.turns * axes[..., i]
    return product(columns, reach.moved_by)


def _step(at: _Placed, q: Array, lower: Array, upper: Array, damping: Array) -> Array:
    # Damped by the error itself: small near the goal, where full steps converge quadratically.
    jacobian, scale = at.jacobian, damping * (1e-9 + at.cost)
    step = np.einsum("bmn,bm->bn", jacobian, _solved(jacobian, at.residual, scale))
    against = ((q <= lower) & (step < 0)) | ((q >= upper) & (step > 0))
    if against.any():
        jacobian = np.where(against[:, None, :], 0.0, jacobian)
        step = np.einsum("bmn,bm->bn", jacobian, _solved(jacobian, at.residual, scale))
    return _shortened(step)


def _shortened(step: Array) -> Array:
    longest = np.abs(step).max(axis=-1, keepdims=True, initial=1e-300)
    return step * np.minimum(1.0, _LONGEST_STEP / longest)


def _solved(J: Array, wanted: Array, scale: Array) -> Array:
    """Solve (J J^T + scale I) x = wanted, row by row."""
    JJ = product(J, np.swapaxes(J, -1, -2))
    diagonal = np.einsum("bmm->bm", JJ)
    diagonal += (scale + 1e-14 + 1e-13 * diagonal.sum(axis=-1))[:, None]  # never singular, whatever the arm's size
    return solved(JJ, wanted)
