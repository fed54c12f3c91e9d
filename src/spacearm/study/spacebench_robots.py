"""The robots of SpaceBench: built-in ones, some on a lighter base, one scaled, and one with two arms."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.errors import RobotError
from spacearm.geometry import Box, Capsule, ConvexShape, Cylinder, Polytope, Sphere
from spacearm.robot import Frame, Joint, LinkShape, Robot, forward_kinematics, load_robot
from spacearm.robot.model import Body
from spacearm.robot.self_collision import find_self_pairs

Array = NDArray[np.float64]

PAPER_REACH = 1.336
"""Length of the paper's arm stretched out, from its base to its tip [m]."""

_BUS = (1.3, 0.8, 0.3)  # edges of the two-armed spacecraft [m]
_SHOULDER = 0.45  # of each arm, from the middle of the bus along x [m]


@cache
def light(name: str, mass: float) -> Robot:
    """Return a built-in robot whose base has another mass, its inertia scaled with it.

    Args:
        name: of the built-in robot.
        mass: of the base [kg].

    Raises:
        RobotError: no such robot, or one whose base has no mass.
    """
    robot = load_robot(name, base="floating")
    own = sum(body.mass for body in robot.bodies if body.joint < 0)
    if own <= 0:
        raise RobotError(f"robot '{name}' has a base without mass, expected one that floats; name another robot")
    share = mass / own
    bodies = tuple(
        replace(body, mass=body.mass * share, inertia=body.inertia * share) if body.joint < 0 else body for body in robot.bodies
    )
    return replace(
        robot,
        name=f"{name}-{mass:g}kg",
        bodies=bodies,
        notes=(
            *robot.notes,
            f"SpaceBench: the base of {own:g} kg was given {mass:g} kg, its inertia scaled by the same factor",
        ),
    )


@cache
def scaled_srs7() -> Robot:
    """Return "srs7" with its lengths scaled so that the tip is `PAPER_REACH` above the base; radii and all masses are kept.

    A link's moments of inertia across its length grow with the square of the scale; the base, 100 kg, is kept as it is.
    """
    robot = load_robot("srs7", base="floating")
    scale = PAPER_REACH / _height(robot)
    joints = tuple(replace(joint, T_parent_joint=_stretched(joint.T_parent_joint, scale)) for joint in robot.joints)
    frames = tuple(replace(frame, T_joint_frame=_stretched(frame.T_joint_frame, scale)) for frame in robot.frames)
    shapes = tuple(part if part.joint < 0 else replace(part, shape=_longer_shape(part.shape, scale)) for part in robot.shapes)
    return replace(
        robot,
        name="srs7-1.336m",
        joints=joints,
        frames=frames,
        shapes=shapes,
        bodies=tuple(_longer(body, scale) for body in robot.bodies),
        notes=(*robot.notes, f"SpaceBench: all lengths of the arm times {scale:.6g}; radii, masses and the base are kept"),
    )


def _height(robot: Robot) -> float:
    """How far the tip is from the first joint, all joints at 0 [m]."""
    return float(np.linalg.norm(forward_kinematics(robot, np.zeros(robot.dof))[:3, 3]))


def _longer_shape(shape: ConvexShape, scale: float) -> ConvexShape:
    """A shape scaled from its joint's origin; radii and roundings are kept."""
    match shape:
        case Sphere():
            return replace(shape, center=shape.center * scale)
        case Capsule():
            return replace(shape, a=shape.a * scale, b=shape.b * scale)
        case Cylinder():
            return replace(shape, length=shape.length * scale, pose=_stretched(shape.pose, scale))
        case Box():
            return replace(shape, size=shape.size * scale, pose=_stretched(shape.pose, scale))
        case Polytope():
            return replace(shape, vertices=shape.vertices * scale)


def _stretched(T: Array, scale: float) -> Array:
    out = T.copy()
    out[:3, 3] *= scale
    return out


def _longer(body: Body, scale: float) -> Body:
    """A link of the arm as a solid cylinder of the same mass and radius, longer by a factor; links at a point stay so."""
    if body.joint < 0 or not np.linalg.norm(body.com) > 0:
        return body
    along = body.com / np.linalg.norm(body.com)
    round_the_axis = float(along @ body.inertia @ along)
    across = (float(np.trace(body.inertia)) - round_the_axis) / 2
    longer = round_the_axis / 2 + (across - round_the_axis / 2) * scale**2  # m r^2 / 4 + m l^2 / 12
    inertia = longer * np.eye(3) + (round_the_axis - longer) * np.outer(along, along)
    return replace(body, com=body.com * scale, inertia=inertia)


@cache
def two_arms(mass: float) -> Robot:
    """Return a spacecraft with two "srs7" arms side by side, 14 joints; q holds the left arm's seven first.

    Args:
        mass: of the base, a box of 1.3 x 0.8 x 0.3 m of even density [kg].
    """
    arm = load_robot("srs7", base="floating")
    left, right = (_mounted(arm, side, x, first) for side, x, first in (("left", -_SHOULDER, 0), ("right", _SHOULDER, arm.dof)))
    square = np.square(_BUS)
    base = Body(name="base", joint=-1, mass=mass, com=np.zeros(3), inertia=mass / 12 * np.diag(square.sum() - square))
    bus = LinkShape(name="base", joint=-1, shape=Box(_BUS))
    root = next(frame for frame in arm.frames if frame.name == "base")
    robot = Robot(
        name=f"srs7-twice-{mass:g}kg",
        joints=(*left.joints, *right.joints),
        shapes=(bus, *left.shapes, *right.shapes),
        frames=(root, *left.frames, *right.frames),
        tip="left_tip",
        dof_names=(*left.dof_names, *right.dof_names),
        lower=_both(arm.lower),
        upper=_both(arm.upper),
        velocity=_both(arm.velocity),
        acceleration=_both(arm.acceleration),
        base="floating",
        bodies=(base, *left.bodies, *right.bodies),
        source="spacearm bench space",
        notes=(*arm.notes, f"SpaceBench: two arms, {2 * _SHOULDER:g} m apart, on a box of {mass:g} kg and even density"),
    )
    return find_self_pairs(robot, samples=300).applied_to(robot)


def _both(values: ArrayLike) -> Array:
    return np.concatenate([values, values])


@dataclass(frozen=True, slots=True)
class _Parts:
    """An arm without a base of its own."""

    joints: tuple[Joint, ...]
    shapes: tuple[LinkShape, ...]
    frames: tuple[Frame, ...]
    dof_names: tuple[str, ...]
    bodies: tuple[Body, ...]


def _mounted(arm: Robot, side: str, x: float, first: int) -> _Parts:
    """An arm without its base, every name with its side, its first joint moved along x, its joints numbered from `first`."""

    def named(name: str) -> str:
        return f"{side}_{name}"

    def moved(T: Array) -> Array:
        out = T.copy()
        out[0, 3] += x
        return out

    def riding(items: Iterable[Any]) -> tuple[Any, ...]:
        return tuple(replace(item, name=named(item.name), joint=item.joint + first) for item in items if item.joint >= 0)

    joints = tuple(
        replace(
            joint,
            name=named(joint.name),
            parent=joint.parent if joint.parent < 0 else joint.parent + first,
            T_parent_joint=moved(joint.T_parent_joint) if joint.parent < 0 else joint.T_parent_joint,
            dof=joint.dof + first,
        )
        for joint in arm.joints
    )
    frames = tuple(
        replace(frame, parent=frame.parent if frame.parent == "base" else named(frame.parent)) for frame in riding(arm.frames)
    )
    return _Parts(joints, riding(arm.shapes), frames, tuple(named(n) for n in arm.dof_names), riding(arm.bodies))
