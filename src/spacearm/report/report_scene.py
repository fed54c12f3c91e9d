"""Robots and scenes as a report's page draws them: joints, envelope, obstacles by name, and where motions begin and end.

The page computes poses from the joints by itself, so a robot is stored once, whatever moves with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Polytope, PolytopeSet, Scene, Sphere, SphereSet, bounding_points
from spacearm.motion import AnyTrajectory
from spacearm.motion.trajectory import base_frames
from spacearm.planner.goals import Goal, PoseGoal, PositionGoal
from spacearm.report.report_meshes import Meshes, geometries_of, geometry_of
from spacearm.report.report_page import transform
from spacearm.robot import Robot, forward_kinematics
from spacearm.robot.link_shapes import LinkShape, as_capsule

Array = NDArray[np.float64]
Data = dict[str, Any]

_LINE = 0.004  # times the robot's reach: lines without thickness are drawn by this radius
_MOST_BALLS, _MOST_NAMED = 300, 1000  # spheres without and with a name that are obstacles of their own; more are drawn as one
_MOST_TARGETS = 6  # goal configurations that are marked
_STILL = 1e-9  # [m] joints' centres that are no further apart are one


def robot_data(robot: Robot, meshes: Meshes, visuals: Sequence[Data] = ()) -> Data:
    """Return a robot as the page reads it.

    Args:
        robot: with an envelope or without one.
        meshes: of the report.
        visuals: the parts that its file draws, as `web/src/data.ts` describes them; links without one get their envelope.
    """
    tip, line = robot.frame(robot.tip), _LINE * reach_of(robot)
    held = _beyond_the_tip(robot)
    shapes = [_part(part, meshes, line) | ({"held": True} if part.name in held else {}) for part in robot.shapes]
    if not visuals and not any(_is_thick(part) for part in robot.shapes):
        meshes.notes.append(
            f"robot '{robot.name}' has no envelope with a thickness: it is drawn by thin rods between its joints"
        )
        shapes += _rods(robot, line) if not shapes else []
    drawn = {part["name"] for part in visuals}
    return {
        "name": robot.name,
        "joints": [
            {
                "name": joint.name,
                "kind": joint.kind,
                "parent": joint.parent,
                "T": transform(joint.T_parent_joint),
                "dof": joint.dof,
                "multiplier": joint.multiplier,
                "offset": joint.offset,
            }
            for joint in robot.joints
        ],
        "dofNames": list(robot.dof_names),
        "tip": {"name": tip.name, "joint": tip.joint, "T": transform(tip.T_joint_frame)},
        "shapes": shapes,
        "visuals": [*visuals, *(shape for shape in shapes if shape["name"] not in drawn)] if drawn else [],
    }


def _part(part: LinkShape, meshes: Meshes, line: float) -> Data:
    geometry = geometry_of(part.shape, meshes, owner=f"link '{part.name}'", line=line)
    return {"name": part.name, "joint": part.joint, "geometry": geometry}


def _beyond_the_tip(robot: Robot) -> set[str]:
    """Return the names of the frames that are fixed to the end effector's, as what it holds is."""
    beyond = {robot.tip}
    for frame in robot.frames:  # parents before children
        if frame.parent in beyond:
            beyond.add(frame.name)
    return beyond - {robot.tip}


def _is_thick(part: LinkShape) -> bool:
    capsule = as_capsule(part)
    return capsule is None or capsule.radius > 0


def _rods(robot: Robot, radius: float) -> list[Data]:
    """Return thin rods from joint to joint and to the end effector."""
    tip = robot.frame(robot.tip)
    ends = [(joint.parent, joint.T_parent_joint[:3, 3], joint.name) for joint in robot.joints]
    ends.append((tip.joint, tip.T_joint_frame[:3, 3], tip.name))
    rods: list[Data] = []
    for carrier, end, name in ends:
        if np.linalg.norm(end) > _STILL:
            rod = {"kind": "capsule", "radius": radius, "a": [0.0, 0.0, 0.0], "b": end.tolist()}
            rods.append({"name": f"rod to {name}", "joint": carrier, "geometry": rod})
    return rods


def reaches(robot: Robot) -> Array:
    """Return how far from each joint's origin what it carries may be, at most (j,) [m]: shapes, frames and further joints."""
    far = np.zeros(len(robot.joints))
    for frame in robot.frames:
        if frame.joint >= 0:
            far[frame.joint] = max(far[frame.joint], float(np.linalg.norm(frame.T_joint_frame[:3, 3])))
    for part in robot.shapes:
        if part.joint >= 0:
            points, radius = bounding_points(part.shape)
            far[part.joint] = max(far[part.joint], float(np.linalg.norm(points, axis=1).max()) + radius)
    for i in range(len(robot.joints) - 1, -1, -1):
        joint = robot.joints[i]
        if joint.parent >= 0:
            far[joint.parent] = max(far[joint.parent], far[i] + _away(robot, i))
    return far


def reach_of(robot: Robot) -> float:
    """Return how far from the base's origin anything of a robot may be, at most [m]."""
    base = [float(np.linalg.norm(bounding_points(one.shape)[0], axis=1).max()) for one in robot.shapes if one.joint < 0]
    arms = [far + _away(robot, i) for i, far in enumerate(reaches(robot).tolist()) if robot.joints[i].parent < 0]
    return max([*base, *arms, 1e-6])


def _away(robot: Robot, i: int) -> float:
    """Return how far a joint's origin may be from its parent's, at most [m]."""
    joint = robot.joints[i]
    away = float(np.linalg.norm(joint.T_parent_joint[:3, 3]))
    if joint.kind == "prismatic":
        ends = np.array([robot.lower[joint.dof], robot.upper[joint.dof]])
        away += float(np.abs(joint.multiplier * ends[np.isfinite(ends)] + joint.offset).max(initial=0.0))
    return away


# ---- Obstacles -------------------------------------------------------------------------------------------------------


def obstacles_data(scene: Scene, meshes: Meshes, *, line: float = 0.002) -> list[Data]:
    """Return the obstacles of a scene as the page reads them; many spheres are drawn as one obstacle, which is noted.

    Args:
        scene: in the inertial frame.
        meshes: of the report.
        line: the radius by which lines and points are drawn [m].
    """
    balls = [item for item in scene.obstacles if isinstance(item, Sphere)]
    many = balls if len(balls) > _MOST_NAMED else [item for item in balls if not item.name]
    together = set(map(id, many)) if len(many) > _MOST_BALLS else set[int]()
    out: list[Data] = []
    for i, item in enumerate(scene.obstacles):
        if id(item) in together:
            continue
        owner = f"obstacle {scene.called(i)}"
        out.append({"name": item.name or f"obstacle {i}", "parts": geometries_of(item, meshes, owner=owner, line=line)})
    if together:
        name, all_ = f"{len(many):,} spheres", SphereSet([item.center for item in many], [item.radius for item in many])
        out.append({"name": name, "parts": geometries_of(all_, meshes, owner=name, line=line)})
        meshes.notes.append(f"{name} are drawn together, as one obstacle")
    return out


def pieces_of(robot: Robot, scene: Scene) -> int:
    """Return how many convex pieces of a robot and a scene the page draws by triangles."""
    sets = sum(len(item.pieces) for item in scene.obstacles if isinstance(item, PolytopeSet))
    return sets + sum(isinstance(one, Polytope) for one in (*scene.obstacles, *(part.shape for part in robot.shapes)))


# ---- Where motions begin and end -------------------------------------------------------------------------------------


def targets_data(
    robot: Robot, start: Array | None, goal: Goal | None, base_start: Array, trajectory: AnyTrajectory | None
) -> list[Data]:
    """Return where a motion is to begin and to end, as the page reads it.

    A goal in joint space is marked where it has the end effector as the base stands at the end. Of many goal configurations
    those nearest to the end are marked.

    Args:
        robot: the robot.
        start: (n,) [rad or m]; None: the motion's.
        goal: None: it is not known.
        base_start: T_w_b (4, 4) at the beginning [m].
        trajectory: the motion; None: there is none.
    """
    out: list[Data] = []
    if start is None and trajectory is not None:
        start = trajectory.sample(0.0).q
    if start is not None:
        out.append(_target("start", "configuration", base_start @ forward_kinematics(robot, start)))
    return [*out, *([] if goal is None else _goals(robot, goal, trajectory, base_start))]


def _goals(robot: Robot, goal: Goal, trajectory: AnyTrajectory | None, base_start: Array) -> list[Data]:
    if isinstance(goal, PositionGoal):
        T = np.eye(4)
        T[:3, 3] = goal.position
        return [_target("goal", "position", T, goal.tolerance)]
    if isinstance(goal, PoseGoal):
        return [_target("goal", "pose", goal.pose, goal.position_tolerance)]
    configurations, T_w_b = np.atleast_2d(goal.q), base_start
    if trajectory is not None:
        T_w_b = base_frames(trajectory, trajectory.duration)
        away = np.linalg.norm(configurations - trajectory.sample(trajectory.duration).q, axis=1)
        configurations = configurations[np.argsort(away, kind="stable")]
    tips = T_w_b @ forward_kinematics(robot, configurations[:_MOST_TARGETS])
    return [_target("goal" if i == 0 else f"other goal {i}", "configuration", T) for i, T in enumerate(tips)]


def _target(name: str, kind: str, T: Array, radius: float = 0.0) -> Data:
    return {"name": name, "kind": kind, "T": transform(T), "radius": radius}
