"""A plan looked at by others: Pinocchio's kinematics, Coal's distances, and limits by differences of positions."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import coal
import numpy as np
from scipy.spatial.transform import Rotation

from spacearm.geometry import Capsule, ConvexShape, HalfSpace, Obstacle, Scene, bounding_points
from spacearm.motion import Trajectory
from spacearm.planner import ConfigurationGoal, ConfigurationsGoal, Plan, PoseGoal, PositionGoal, Problem
from spacearm.planner.plan_result import STATUSES
from spacearm.robot import Robot
from spacearm.robot.link_shapes import as_capsule
from support.oracles.coal_shapes import Placed, distance, geometry_of, least_distances, placed_obstacle, shape_pairs
from support.oracles.pinocchio_points import joint_frames
from support.oracles.solids import has_definition, least_on_segments, link_distance
from support.pair_distances import distances, stated

ROUNDING = 1e-9  # [m] of Pinocchio's kinematics and of closed forms
GJK = 1e-7  # [m] of Coal's iterations; what is nearer to the bound is measured by thirds
TOUCH = 1e-6  # [m] penetration that a checker may or may not see
_BY_PAIR = 1e-6  # [m] of Coal's iterations, with pairs of any shape
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
    frames = _frames(plan, times)
    least, _ = least_clearance(problem.robot, problem.scene, frames, proven)
    if least < proven - ROUNDING:
        out += _pairs_below(plan, times, frames)
    return out + _broken_limits(plan) + _wrong_ends(plan)


def _frames(plan: Plan, times: np.ndarray) -> np.ndarray:
    """Frames (rows, joints, 4, 4) where the arm is; where its base floats in inertial space, and the base's own last."""
    trajectory, robot = plan.trajectory, plan.problem.robot
    assert trajectory is not None
    frames = joint_frames(robot, trajectory.sample(times).q)
    if plan.problem.base == "fixed":
        return frames
    order = np.argsort(times)
    base = np.empty((len(times), 1, 4, 4))
    base[order, 0] = _base_poses(trajectory, times[order])
    return np.concatenate([base @ frames, base], axis=1)


def _base_poses(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    at, wxyz = trajectory.base_pose(times)
    T = np.tile(np.eye(4), (len(times), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = Rotation.from_quat(wxyz, scalar_first=True).as_matrix(), at
    return T


def _pairs_below(plan: Plan, times: np.ndarray, frames: np.ndarray) -> list[str]:
    """Name the pairs that have less than the certificate states of each: pairs near at an end are held to less there."""
    assert plan.certificate is not None
    out = []
    for pair, apart in distances(plan.problem.robot, plan.problem.scene, frames):
        short = stated(plan.certificate, pair, times) - apart
        row = int(np.argmax(short))
        if short[row] > GJK:
            out.append(f"{pair}: {apart[row] + short[row]:.12g} m stated, {apart[row]:.12g} m at t = {times[row]:.17g} s")
    return out


def least_clearance(robot: Robot, scene: Scene, frames: np.ndarray, proven: float) -> tuple[float, int]:
    """The least clearance [m] and its row, of what may be below a bound; frames (rows, joints, 4, 4).

    What a ball around each shape shows to be farther away is left out: the answer is inf where nothing is below the bound.
    """
    links = _Links(robot, frames)
    least, at = math.inf, 0

    def look(row: int, measured: float, exactly: Callable[[], float | None]) -> None:
        nonlocal least, at
        exact = None if measured < proven - GJK else exactly()  # it is slow
        found = measured if exact is None else exact
        if found < least:
            least, at = found, row

    for obstacle in scene.obstacles:
        for part in placed_obstacle(obstacle):
            if isinstance(obstacle, HalfSpace):
                apart = (links.middle - obstacle.point) @ obstacle.normal - links.reach
            else:
                apart = np.linalg.norm(links.middle - _center(part), axis=-1) - links.reach - _reach(part)
            for row, i in np.argwhere(apart < proven).tolist():
                measured = distance(links.placed(row, i), part)
                if measured < proven - ROUNDING:
                    look(row, measured, partial(links.exact_to, obstacle, row, i))
    for i, k in shape_pairs(robot):
        apart = np.linalg.norm(links.middle[:, i] - links.middle[:, k], axis=-1) - links.reach[i] - links.reach[k]
        for row in np.flatnonzero(apart < proven).tolist():
            measured = distance(links.placed(row, i), links.placed(row, k))
            if measured < proven - ROUNDING:
                look(row, measured, partial(links.exact_between, row, i, k))
    return least, at


class _Links:
    """A robot's shapes at rows of frames (rows, joints, 4, 4): Coal's geometries, and balls around them."""

    def __init__(self, robot: Robot, frames: np.ndarray) -> None:
        self._joint = [part.joint for part in robot.shapes]
        self._made = [geometry_of(part.shape) for part in robot.shapes]
        self._capsule = [as_capsule(part) for part in robot.shapes]
        self._frames = frames
        self._base_is_still = frames.shape[1] == len(robot.joints)
        balls = [_ball(part.shape) for part in robot.shapes]
        self.reach = np.array([radius for _, radius in balls])
        at = [self._at(i)[:, :3, :3] @ center + self._at(i)[:, :3, 3] for i, (center, _) in enumerate(balls)]
        self.middle = np.array(at).reshape(len(balls), len(frames), 3).transpose(1, 0, 2)  # (rows, shapes, 3)

    def _at(self, i: int) -> np.ndarray:
        if self._joint[i] < 0 and self._base_is_still:
            return np.broadcast_to(np.eye(4), (len(self._frames), 4, 4))
        return self._frames[:, self._joint[i]]

    def placed(self, row: int, i: int) -> Placed:
        made, T = self._made[i]
        at = self._at(i)[row] @ T
        return made, coal.Transform3s(np.ascontiguousarray(at[:3, :3]), np.array(at[:3, 3]))

    def _axis(self, row: int, i: int) -> tuple[np.ndarray, np.ndarray, float] | None:
        capsule = self._capsule[i]
        if capsule is None:
            return None
        T = self._at(i)[row]
        a, b = (T[:3, :3] @ end + T[:3, 3] for end in (capsule.a, capsule.b))
        return a, b, capsule.radius

    def exact_to(self, obstacle: Obstacle, row: int, i: int) -> float | None:
        """The distance by thirds, of a capsule to a shape whose definition NumPy knows; None for others."""
        axis = self._axis(row, i)
        if axis is None or not has_definition(obstacle):
            return None
        return float(link_distance(obstacle, axis[0], axis[1]) - axis[2])

    def exact_between(self, row: int, i: int, k: int) -> float | None:
        one, other = self._axis(row, i), self._axis(row, k)
        return None if one is None or other is None else _between(*one[:2], *other[:2]) - one[2] - other[2]


def _ball(shape: ConvexShape) -> tuple[np.ndarray, float]:
    points, radius = bounding_points(shape)
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    return center, float(np.linalg.norm(points - center, axis=1).max() + radius)


def _between(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> float:
    """Distance [m] of two segments, by thirds: the distance to a segment is convex along the other one."""
    thin = Capsule(c, d, 1e-300)
    return float(least_on_segments(lambda p: link_distance(thin, p, p), a, b))


def _center(part: Placed) -> np.ndarray:
    return np.array(part[1].getTranslation())


def _reach(part: Placed) -> float:
    """The radius [m] of a ball about a shape's place that holds it."""
    shape = part[0]
    shape.computeLocalAABB()
    return float(np.linalg.norm(shape.aabb_center) + shape.aabb_radius + shape.getSweptSphereRadius())


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
