"""Whether our reader of MoveIt's files and the other one place everything alike."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from spacearm import forward_kinematics, load_moveit, load_robot
from spacearm.geometry import Box, Cylinder, HalfSpace, Polytope, PolytopeSet, Sphere
from spacearm.planner import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal, Problem
from support.drawn_moveit import Files
from support.moveit_reader import OtherReader, _pose, _row
from support.oracles.polytopes import outside_polytopes
from support.oracles.solids import point_distance

SAME = 1e-9
"""Greatest difference of two numbers that ought to be the same [m, rad and -]; the readers multiply in other orders."""


def complaints(files: Files, rng: np.random.Generator) -> list[str]:
    """Read files both ways and list what differs."""
    robot = load_robot(files.urdf, srdf=files.srdf, group=files.group, acceleration_limit=1.0)
    problem = load_moveit(robot, files.scene, files.request, mesh_excess=0.05)
    other = OtherReader(files, robot.dof_names)
    return [*_obstacles(problem, other), *_robot(problem, other), *_held(problem, other), *_goal(problem, other, rng)]


def _differs(what: str, ours: Any, theirs: Any) -> Iterator[str]:
    worst = float(np.abs(np.asarray(ours) - np.asarray(theirs)).max())
    if not worst <= SAME:
        yield f"{what} differs by {worst:.3g}"


def _obstacles(problem: Problem, other: OtherReader) -> Iterator[str]:
    ours = {obstacle.name: obstacle for obstacle in problem.scene.obstacles}
    wanted = 0
    for name, thing in other.objects.items():
        for i, (kind, size, T) in enumerate(thing.shapes):
            called = name if len(thing.shapes) == 1 else f"{name} {i + 1}"
            wanted += 1
            if called not in ours:
                yield f"obstacle '{called}' is missing"
                continue
            yield from _shape(called, ours[called], kind, size, thing.T @ T, other)
    if wanted != len(problem.scene.obstacles):
        yield f"{len(problem.scene.obstacles)} obstacles, expected {wanted}"


def _shape(name: str, ours: Any, kind: str, size: np.ndarray, T: np.ndarray, other: OtherReader) -> Iterator[str]:
    if kind == "box" and isinstance(ours, Box):
        yield from _differs(f"box '{name}'", ours.pose, T)
        yield from _differs(f"size of '{name}'", ours.size, size)
    elif kind == "sphere" and isinstance(ours, Sphere):
        yield from _differs(f"sphere '{name}'", [*ours.center, ours.radius], [*T[:3, 3], *size])
    elif kind == "cylinder" and isinstance(ours, Cylinder):
        yield from _differs(f"cylinder '{name}'", ours.pose, T)
        yield from _differs(f"size of '{name}'", [ours.length, ours.radius], size)
    elif kind == "mesh" and isinstance(ours, PolytopeSet):
        corners = size @ T[:3, :3].T + T[:3, 3]
        if outside_polytopes(corners, ours.pieces).max() > SAME:
            yield f"a corner of mesh '{name}' is out of its pieces"
        yield from _within(name, ours, corners)
    elif kind == "plane" and isinstance(ours, HalfSpace):
        n = T[:3, :3] @ size[:3] / np.linalg.norm(size[:3])
        on = T[:3, 3] - n * size[3] / np.linalg.norm(size[:3])
        # The poses of old files place planes as seen from where the robot's base is in the scene's state.
        yield from _differs(f"plane '{name}'", min(np.abs(ours.normal - n).max(), np.abs(ours.normal + n).max()), 0)
        yield from _differs(f"plane '{name}'", ours.normal @ (ours.point - on), 0)
    else:
        yield f"'{name}' is a {type(ours).__name__}, expected a {kind}"


def _within(name: str, ours: PolytopeSet, corners: np.ndarray) -> Iterator[str]:
    low, high = corners.min(axis=0), corners.max(axis=0)
    excess = (ours.excess or 0.0) + SAME
    for piece in ours.pieces:
        least, most = piece.vertices.min(axis=0) - piece.rounding, piece.vertices.max(axis=0) + piece.rounding
        if (least < low - excess).any() or (most > high + excess).any():
            yield f"the pieces of mesh '{name}' stand out of it by more than they say"


def _robot(problem: Problem, other: OtherReader) -> Iterator[str]:
    yield from _differs("the base", problem.base_start, other.base)
    for link in other.links:
        ours = problem.base_start @ forward_kinematics(problem.robot, problem.start, frame=link)
        yield from _differs(f"link '{link}' at the start", ours, other.poses[link])


def _held(problem: Problem, other: OtherReader) -> Iterator[str]:
    robot, known = problem.robot, {frame.name for frame in problem.robot.frames}
    at = lambda name: problem.base_start @ forward_kinematics(robot, problem.start, frame=name)  # noqa: E731
    carried = {entry.name for entry in robot.shapes}
    for name, thing in other.held.items():
        T = other.poses[thing.link] @ thing.T
        for frame, there in ((name, T), *((f"{name}/{inner}", T @ S) for inner, S in thing.subframes.items())):
            if frame not in known:
                yield f"frame '{frame}' of what is held is missing"
            else:
                yield from _differs(f"frame '{frame}'", at(frame), there)
        for i, (kind, size, S) in enumerate(thing.shapes):
            called = name if len(thing.shapes) == 1 else f"{name} {i + 1}"
            if called not in carried:
                yield f"'{called}' is not held"
                continue
            yield from _enclosed(called, kind, size, T @ S, problem)


def _enclosed(name: str, kind: str, size: np.ndarray, T: np.ndarray, problem: Problem) -> Iterator[str]:
    """Whether points of a held shape's surface are within the robot's shapes of that name."""
    from spacearm.robot.kinematics import joint_frames

    points = _surface(kind, size) @ T[:3, :3].T + T[:3, 3]
    inside = np.full(len(points), np.inf)
    for entry in problem.robot.shapes:
        if entry.name == name:
            joint = joint_frames(problem.robot, problem.start)[entry.joint] if entry.joint >= 0 else np.eye(4)
            frame = problem.base_start @ joint
            own, shape = (points - frame[:3, 3]) @ frame[:3, :3], entry.shape
            away = outside_polytopes(own, [shape]) if isinstance(shape, Polytope) else point_distance(shape, own)
            inside = np.minimum(inside, away)
    if inside.max() > 1e-7:
        yield f"a point of held '{name}' is {inside.max():.3g} m out of its shapes"
    reach = np.linalg.norm(points - points.mean(axis=0), axis=1).max()
    if inside.min() < -3 * reach - 0.1:
        yield f"held '{name}' is far within its shapes"


def _surface(kind: str, size: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(0)
    if kind == "mesh":
        return rng.dirichlet(np.ones(4), size=60) @ size
    directions = rng.normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    if kind == "sphere":
        return directions * size[0]
    if kind == "box":
        return directions / np.abs(directions).max(axis=1)[:, None] * size / 2
    around = directions[:, :2] / np.linalg.norm(directions[:, :2], axis=1)[:, None] * size[1]
    return np.column_stack([around, directions[:, 2] * size[0] / 2])


def _goal(problem: Problem, other: OtherReader, rng: np.random.Generator) -> Iterator[str]:
    goal, asked, names = problem.goal, other.request["goal_constraints"], problem.robot.dof_names
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        rows = np.atleast_2d(goal.q)
        for q, item in zip(rows, asked, strict=True):
            stated = {row["joint_name"]: row["position"] for row in item["joint_constraints"]}
            ours, theirs = (other.link_poses(v) for v in (dict(zip(names, q, strict=True)), stated))
            for link in other.links:
                yield from _differs(f"link '{link}' at the goal", ours[link], theirs[link])
        return
    position = asked[0]["position_constraints"][0]
    T = other.frame(position) @ _pose(position["constraint_region"]["primitive_poses"][0])
    assert isinstance(goal, (PositionGoal, PoseGoal))
    yield from _differs("the goal's position", goal.position, T[:3, 3])
    q = np.clip(rng.uniform(-1, 1, len(names)), problem.robot.lower, problem.robot.upper)
    reached = other.link_poses(dict(zip(names, q, strict=True)))[position["link_name"]]
    offset = _row(position.get("target_point_offset", [0, 0, 0]), "xyz")
    ours = problem.base_start @ forward_kinematics(problem.robot, q, frame=goal.frame)
    yield from _differs("the goal's point of the link", ours[:3, 3], reached[:3, :3] @ offset + reached[:3, 3])
    if isinstance(goal, PoseGoal):
        yield from _differs("the goal's link", ours[:3, :3], reached[:3, :3])
        turned = asked[0]["orientation_constraints"][0]
        R = other.frame(turned)[:3, :3] @ _pose({"position": [0, 0, 0], "orientation": turned["orientation"]})[:3, :3]
        yield from _differs("the goal's orientation", goal.pose[:3, :3], R)
        yield from _no_wider(goal, turned, rng)


def _no_wider(goal: PoseGoal, turned: dict[str, Any], rng: np.random.Generator) -> Iterator[str]:
    """Whether every orientation that we take for reached is one for MoveIt, `OrientationConstraint::decide`."""
    limits = np.array([turned[f"absolute_{axis}_axis_tolerance"] for axis in "xyz"])
    R_frame = _pose({"position": [0, 0, 0], "orientation": turned["orientation"]})[:3, :3]
    for _ in range(20):
        axis = rng.normal(size=3)
        if goal.free_axis is not None:  # a tilt of the axis, after any turn about it
            axis -= (axis @ goal.free_axis) * goal.free_axis
        tilt = _turn(axis, 0.999 * goal.orientation_tolerance * rng.random())
        diff = tilt if goal.free_axis is None else tilt @ _turn(goal.free_axis, rng.uniform(-np.pi, np.pi))
        if turned.get("parameterization", 0) == 1:
            v = np.abs(R_frame @ _log(diff))
        else:
            pitch = np.arctan2(diff[0, 2], np.hypot(diff[0, 0], diff[0, 1]))
            v = np.abs([np.arctan2(-diff[1, 2], diff[2, 2]), pitch, np.arctan2(-diff[0, 1], diff[0, 0])])
        if (v > limits + 1e-9).any():
            yield f"an orientation that reaches the goal misses MoveIt's tolerances: {v} of {limits}"
            return


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    import pinocchio as pin

    return pin.AngleAxis(float(angle), axis / np.linalg.norm(axis)).matrix()


def _log(R: np.ndarray) -> np.ndarray:
    import pinocchio as pin

    return pin.log3(R)
