"""A plan looked at by others: Pinocchio's kinematics, Coal's distances, and limits by differences of positions."""

from __future__ import annotations

import math

import coal
import numpy as np

from spacearm.geometry import Capsule, HalfSpace, Scene
from spacearm.planner import ConfigurationGoal, ConfigurationsGoal, Plan, PoseGoal, PositionGoal, Problem
from spacearm.planner.plan_result import STATUSES
from spacearm.robot import Robot
from support.oracles.coal_shapes import Placed, distance, least_distances, placed_obstacle
from support.oracles.pinocchio_points import joint_frames
from support.oracles.solids import least_on_segments, link_distance

ROUNDING = 1e-9  # [m] of Pinocchio's kinematics and of closed forms
GJK = 1e-7  # [m] of Coal's iterations; what is nearer to the bound is measured by thirds
TOUCH = 1e-6  # [m] penetration that a checker may or may not see
POSITION = 1e-9  # [rad or m] rounding of a position


def complaints(plan: Plan, *, instants: int, rng: np.random.Generator) -> list[str]:
    """List what is wrong with a plan, if anything is: its words, its clearance, its limits, its ends."""
    out = []
    if plan.status not in STATUSES:
        out.append(f"status {plan.status!r} is none of those known")
    if not plan.message or "\n" in plan.message or len(plan.message) > 1000:
        out.append(f"the message is no line: {plan.message!r}")
    out += _wrong_refusal(plan)
    if plan.found:
        out += _wrong_motion(plan, instants, rng)
    return out


def _wrong_refusal(plan: Plan) -> list[str]:
    """A start in collision must be one, and nothing else may be planned from one."""
    at = least_distances(plan.problem.robot, plan.problem.scene, joint_frames(plan.problem.robot, plan.problem.start[None]))[0]
    if plan.status == "start_in_collision":
        return [f"start_in_collision, but Coal has a clearance of {at:.9g} m"] if at > TOUCH else []
    return [f"{plan.status}, but the start penetrates by {-at:.9g} m"] if at < -TOUCH else []


def _wrong_motion(plan: Plan, instants: int, rng: np.random.Generator) -> list[str]:
    trajectory, certificate, problem = plan.trajectory, plan.certificate, plan.problem
    if trajectory is None or certificate is None or not certificate.holds:
        return ["found, but without a trajectory or a certificate that holds"]
    proven, near = certificate.clearance, certificate.closest
    if proven is None or not proven > 0:
        return [f"found, but a clearance of {proven} is proven"]
    times = rng.uniform(0, trajectory.duration, instants)
    if near is not None:
        times = np.concatenate([times, [near.time], near.time + 1e-3 * trajectory.duration * rng.normal(size=10)])
    times = np.clip(times, 0, trajectory.duration)
    out = []
    q = trajectory.sample(times).q
    least, row = least_clearance(problem.robot, problem.scene, joint_frames(problem.robot, q), proven)
    if least < proven - ROUNDING:
        out.append(f"proven {proven:.12g} m, but {least:.12g} m at t = {times[row]:.17g} s")
    return out + _broken_limits(plan) + _wrong_ends(plan)


def least_clearance(robot: Robot, scene: Scene, frames: np.ndarray, proven: float) -> tuple[float, int]:
    """The least clearance [m] and its row, of what may be below a bound; frames (rows, joints, 4, 4).

    What a ball around each shape shows to be farther away is left out: the answer is inf where nothing is below the bound.
    """
    a, b = (_on_links(robot, frames, end) for end in ("a", "b"))  # (rows, capsules, 3)
    radii = np.array([capsule.radius for capsule in robot.capsules])
    middle, half = (a + b) / 2, np.linalg.norm(b - a, axis=-1) / 2
    R = _turns_along(b - a)
    shapes = [coal.Capsule(float(r), float(2 * h)) for r, h in zip(radii, half[0], strict=True)]
    least, at = math.inf, 0

    def placed(row: int, i: int) -> Placed:
        return shapes[i], coal.Transform3s(R[row, i], middle[row, i])

    def look(row: int, measured: float, exact: float) -> None:
        nonlocal least, at
        found = measured if measured < proven - GJK else exact
        if found < least:
            least, at = found, row

    for obstacle in scene.obstacles:
        for part in placed_obstacle(obstacle):
            if isinstance(obstacle, HalfSpace):
                apart = np.minimum((a - obstacle.point) @ obstacle.normal, (b - obstacle.point) @ obstacle.normal) - radii
            else:
                apart = np.linalg.norm(middle - part[1].getTranslation(), axis=-1) - half - radii - _reach(part)
            for row, i in np.argwhere(apart < proven).tolist():
                measured = distance(placed(row, i), part)
                if measured < proven - ROUNDING:
                    exact = float(link_distance(obstacle, a[row, i], b[row, i]) - radii[i])
                    look(row, measured, exact)
    for i, k in _pairs(robot):
        apart = np.linalg.norm(middle[:, i] - middle[:, k], axis=-1) - half[:, i] - half[:, k] - radii[i] - radii[k]
        for row in np.flatnonzero(apart < proven).tolist():
            measured = distance(placed(row, i), placed(row, k))
            if measured < proven - ROUNDING:
                exact = _between(a[row, i], b[row, i], a[row, k], b[row, k]) - float(radii[i] + radii[k])
                look(row, measured, exact)
    return least, at


def _between(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> float:
    """Distance [m] of two segments, by thirds: the distance to a segment is convex along the other one."""
    thin = Capsule(c, d, 1e-300)
    return float(least_on_segments(lambda p: link_distance(thin, p, p), a, b))


def _turns_along(axes: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) whose z columns point along the axes (..., 3); any for an axis of length 0."""
    length = np.linalg.norm(axes, axis=-1, keepdims=True)
    z = np.where(length > 0, axes / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    x = np.cross(np.eye(3)[np.argmin(np.abs(z), axis=-1)], z)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _on_links(robot: Robot, frames: np.ndarray, end: str) -> np.ndarray:
    out = np.empty((len(frames), len(robot.capsules), 3))
    for i, capsule in enumerate(robot.capsules):
        T = frames[:, capsule.joint] if capsule.joint >= 0 else np.eye(4)
        out[:, i] = T[..., :3, :3] @ getattr(capsule, end) + T[..., :3, 3]
    return out


def _reach(part: Placed) -> float:
    """The radius [m] of a ball about a shape's place that holds it."""
    shape = part[0]
    shape.computeLocalAABB()
    return float(np.linalg.norm(shape.aabb_center) + shape.aabb_radius)


def _pairs(robot: Robot) -> list[tuple[int, int]]:
    wanted = set(robot.self_pairs)
    return [
        (i, k)
        for i, one in enumerate(robot.capsules)
        for k, other in enumerate(robot.capsules)
        if (one.name, other.name) in wanted
    ]


def _broken_limits(plan: Plan) -> list[str]:
    """Positions within limits; their differences over h are at most the rate times h, and so on for the others."""
    robot, trajectory = plan.problem.robot, plan.trajectory
    assert trajectory is not None
    if trajectory.duration == 0:
        return []
    t = np.linspace(0, trajectory.duration, 241)
    q, h, out = trajectory.sample(t).q, trajectory.duration / 240, []
    if (q < robot.lower - POSITION).any() or (q > robot.upper + POSITION).any():
        out.append("a position is beyond its limit")
    jerk = plan.settings.jerk_limit
    bounds = [("velocity", robot.velocity), ("acceleration", robot.acceleration)]
    bounds += [] if jerk is None else [("jerk", np.full(robot.dof, jerk))]
    for order, (name, most) in enumerate(bounds, start=1):
        rounding = 2**order * 1e-14 * np.abs(q).max()
        share = (np.abs(np.diff(q, n=order, axis=0)) - rounding) / (most * h**order)
        if share.max() > 1 + 1e-9:
            out.append(f"the {name} limit of joint {int(share.max(axis=0).argmax())} is exceeded: {share.max():.9g} times it")
    return out


def _wrong_ends(plan: Plan) -> list[str]:
    problem, trajectory = plan.problem, plan.trajectory
    assert trajectory is not None
    first, last = trajectory.sample([0.0, trajectory.duration]).q
    out = []
    if np.abs(first - problem.start).max() > POSITION:
        out.append("the motion does not begin at the start")
    miss = _miss(problem, last)
    if miss > 1e-8:
        out.append(f"the motion ends {miss:.4g} beyond the goal's tolerance")
    state = trajectory.sample([0.0, trajectory.duration])
    if trajectory.duration > 0 and (np.abs(state.dq) > 1e-9).any():
        out.append("the arm is not at rest at both ends")
    return out


def _miss(problem: Problem, q: np.ndarray) -> float:
    """By how much a configuration (n,) is outside the goal's tolerance [rad or m]."""
    goal = problem.goal
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        return float((np.abs(np.atleast_2d(goal.q) - q) - goal.tolerance).max(axis=-1).min())
    assert goal.frame is not None
    frame = problem.robot.frame(goal.frame)
    T = joint_frames(problem.robot, q[None])[0, frame.joint] @ frame.T_joint_frame
    away = float(np.linalg.norm(T[:3, 3] - goal.position))
    if isinstance(goal, PositionGoal):
        return away - goal.tolerance
    assert isinstance(goal, PoseGoal)
    if goal.free_axis is not None:
        one, other = T[:3, :3] @ goal.free_axis, goal.pose[:3, :3] @ goal.free_axis
        angle = math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other))
    else:
        angle = 2 * math.asin(min(1.0, float(np.linalg.norm(T[:3, :3] - goal.pose[:3, :3])) / math.sqrt(8)))
    return max(away - goal.position_tolerance, angle - goal.orientation_tolerance)
