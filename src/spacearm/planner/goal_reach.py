"""How far configurations are from a goal in space, and the way from near it onto it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import length, product, solved
from spacearm.core.native import native
from spacearm.core.rotations import rotation_vectors, turns_between
from spacearm.planner.goals import PoseGoal, PositionGoal
from spacearm.robot.kinematics import tree_model
from spacearm.robot.model import Robot

Array = NDArray[np.float64]
SpaceGoal: TypeAlias = PositionGoal | PoseGoal
"""A goal that says where a frame is to be, not where the joints are."""

LEVER = 0.2
"""[m] An error of 1 rad weighs as much as one of so many metres."""
_LONGEST_STEP = 0.6  # [rad or m] of any joint
_EXACT = 1e-10  # [m] what is called converged: rounding is 1e-15 or so


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """A goal in space for one robot, and the chain of joints that moves its frame; `reach_to` makes it.

    Attributes:
        goal: the goal.
        model: the kernel's model of the joints.
        joint: index of the joint whose moving frame the goal's frame rides on.
        T_joint_frame: (4, 4) from the goal's frame to that moving frame [m].
        chain: (k,) indices of the joints from the base to the frame.
        moved_by: (k, n) 1 where an entry of q moves a joint of the chain; one may move several.
        turns: (k,) what a joint turns by for 1 in q; 0 for slides.
        slides: (k,) how far a joint slides for 1 in q; 0 for those that turn.
    """

    goal: SpaceGoal
    model: native.Model64
    joint: int
    T_joint_frame: Array
    chain: NDArray[np.intp]
    moved_by: Array
    turns: Array
    slides: Array


def reach_to(robot: Robot, goal: SpaceGoal) -> Reach:
    """Prepare a goal in space, with its frame filled in, for a robot."""
    frame = robot.frame(goal.frame or robot.tip)
    chain, at = [], frame.joint
    while at >= 0:
        chain.append(at)
        at = robot.joints[at].parent
    chain.reverse()
    joints = [robot.joints[i] for i in chain]
    return Reach(
        goal=goal,
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
    residual, _ = _residuals(reach, _frames(reach, q))
    return np.linalg.norm(residual[:, :3], axis=-1), np.linalg.norm(residual[:, 3:], axis=-1) / LEVER


def pose_errors(goal: SpaceGoal, T: Array) -> tuple[Array, Array]:
    """Return how far frames that stand at T (b, 4, 4) are from where the goal's is to be: (b,) [m] and (b,) [rad]."""
    residual, _ = _missing(goal, T)
    return np.linalg.norm(residual[:, :3], axis=-1), np.linalg.norm(residual[:, 3:], axis=-1) / LEVER


def reaches(reach: Reach, q: Array) -> NDArray[np.bool_]:
    """Tell which configurations (b, n) reach the goal within its tolerances, (b,)."""
    distance, angle = goal_errors(reach, q)
    near, turned = tolerances(reach.goal)
    return (distance <= near) & (angle <= turned)


def tolerances(goal: SpaceGoal) -> tuple[float, float]:
    """Return the greatest distance [m] and angle [rad] that count as reached."""
    if isinstance(goal, PositionGoal):
        return goal.tolerance, math.pi
    return goal.position_tolerance, goal.orientation_tolerance


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

    Damped least squares (Levenberg and Marquardt), all rows side by side, joints that push against a bound held there.

    Args:
        reach: the goal.
        q: (b, n) where to begin [rad or m].
        lower: (n,) bounds that are kept.
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


def _frames(reach: Reach, q: Array) -> Array:
    return reach.model.joint_frames(np.ascontiguousarray(q))  # (b, joints, 4, 4)


def _placed(reach: Reach, q: Array) -> _Placed:
    frames = _frames(reach, q)
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
    J, scale = at.jacobian, damping * (1e-9 + at.cost)
    step = np.einsum("bmn,bm->bn", J, _solved(J, at.residual, scale))
    held = ((q <= lower) & (step < 0)) | ((q >= upper) & (step > 0))
    if held.any():
        J = np.where(held[:, None, :], 0.0, J)
        step = np.einsum("bmn,bm->bn", J, _solved(J, at.residual, scale))
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
