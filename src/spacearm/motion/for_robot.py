"""A trajectory of one robot taken for another: joints go by their names, and must be the same joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spacearm.errors import ProblemError
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import AnyTrajectory, RecordedTrajectory
from spacearm.motion.spline import Motion
from spacearm.robot import Joint, Robot

_SAME = 1e-9  # of a transform, a multiplier or an offset, relative to its size: a file's last digit


def for_robot(trajectory: AnyTrajectory, robot: Robot, *, same_joints: bool = True) -> tuple[AnyTrajectory, tuple[str, ...]]:
    """Return a trajectory with its joints in a robot's order, and notes on what was done.

    It stays a trajectory of its own robot, in all but that order: its own limits do not count for the other one.

    Args:
        trajectory: of any robot.
        robot: whose joints are meant.
        same_joints: refuse a robot whose joints of the same names stand elsewhere or move otherwise; else a note says so.

    Raises:
        ProblemError: the joints have other names, or are other joints: that motion is not one of this robot.
    """
    own = trajectory.robot
    if own is robot:
        return trajectory, ()
    notes = []
    if own.dof_names != robot.dof_names:
        columns = in_order(own.dof_names, robot.dof_names, who=f"the trajectory, of robot '{own.name}',")
        trajectory = _in_order(trajectory, columns)
        notes.append(
            "the trajectory has the joints in another order than the problem: they were put into the problem's by name"
        )
    other = _other_joint(own, robot)
    if other and same_joints:
        raise ProblemError(
            f"the trajectory is of another robot than the problem: {other}; if its joint positions are meant for robot "
            f"'{robot.name}' all the same, make it anew with that robot, as in Trajectory(problem.robot, trajectory.motion)"
        )
    if other:
        notes.append(f"the trajectory was made for another robot: {other}")
    return trajectory, tuple(notes)


def in_order(own: tuple[str, ...], wanted: tuple[str, ...], *, who: str) -> list[int]:
    """Return where each of a robot's joints is among the names that somebody gives them.

    Args:
        own: the names given, in the order of the numbers.
        wanted: the robot's.
        who: whose names these are, for the message, as in "the trajectory".

    Raises:
        ProblemError: they are not the same names.
    """
    missing = [name for name in wanted if name not in own]
    strange = [name for name in own if name not in wanted]
    if missing or strange or len(own) != len(wanted):
        lacks = f"has no {_listed(missing)}" if missing else ""
        has = f"moves {_listed(strange)}, which the robot does not have" if strange else ""
        said = " and ".join(filter(None, (lacks, has))) or f"names {len(own)} joints for {len(wanted)}"
        raise ProblemError(f"{who} {said}, expected the joints {', '.join(wanted)}, in any order")
    return [own.index(name) for name in wanted]


def _listed(names: list[str]) -> str:
    return (
        f"joint{'s' if len(names) > 1 else ''} {', '.join(repr(name) for name in names[:6])}{', ...' if len(names) > 6 else ''}"
    )


def _in_order(trajectory: AnyTrajectory, columns: list[int]) -> AnyTrajectory:
    """Return the same trajectory with its columns, and those of its robot, in another order."""
    robot = robot_in_order(trajectory.robot, columns)
    if isinstance(trajectory, RecordedTrajectory):
        path = PiecewisePath(trajectory.path.breaks, trajectory.path.coefficients[..., columns])
        return replace(trajectory, robot=robot, path=path)
    return replace(trajectory, robot=robot, motion=Motion(trajectory.motion.control_points[:, columns]))


def robot_in_order(robot: Robot, columns: list[int]) -> Robot:
    """Return the same robot with its degrees of freedom in another order."""
    place = {dof: i for i, dof in enumerate(columns)}
    return replace(
        robot,
        joints=tuple(replace(joint, dof=place[joint.dof]) for joint in robot.joints),
        dof_names=tuple(robot.dof_names[dof] for dof in columns),
        configurations=tuple(replace(one, q=one.q[columns]) for one in robot.configurations),
        **{limit: getattr(robot, limit)[columns] for limit in ("lower", "upper", "velocity", "acceleration")},
    )


def _other_joint(own: Robot, robot: Robot) -> str:
    """Say in what the joints of two robots differ, the first that does; "" if they are the same."""
    mine, theirs = ({joint.name: joint for joint in each.joints} for each in (own, robot))
    for name in mine.keys() ^ theirs.keys():
        return f"only the {'trajectory' if name in mine else 'problem'}'s has a joint '{name}'"
    for name, joint in theirs.items():
        differs = _difference(own, mine[name], robot, joint)
        if differs:
            return f"its joint '{name}' {differs}"
    return ""


def _difference(own: Robot, mine: Joint, robot: Robot, joint: Joint) -> str:
    parents = [each.joints[j.parent].name if j.parent >= 0 else "" for each, j in ((own, mine), (robot, joint))]
    leaders = [each.dof_names[j.dof] for each, j in ((own, mine), (robot, joint))]
    if mine.kind != joint.kind:
        return f"is {mine.kind}, not {joint.kind}"
    if parents[0] != parents[1]:
        return f"is moved by '{parents[0]}', not by '{parents[1]}'" if all(parents) else "is carried by another one"
    if leaders[0] != leaders[1]:
        return f"goes with '{leaders[0]}', not with '{leaders[1]}'"
    for what in ("multiplier", "offset"):
        one, other = getattr(mine, what), getattr(joint, what)
        if abs(one - other) > _SAME * (1 + abs(other)):
            return f"has {what} {one:g}, not {other:g}"
    off = float(np.abs(mine.T_parent_joint - joint.T_parent_joint).max())
    if off > _SAME * (1 + float(np.abs(joint.T_parent_joint).max())):
        return f"stands elsewhere (T_parent_joint differs by {off:.3g})"
    return ""
