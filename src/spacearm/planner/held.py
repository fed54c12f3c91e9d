"""Something held in the hand: a robot whose envelope has grown by it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import as_name, as_pose, as_whole, is_a_row, shown
from spacearm.errors import RobotError, nearest
from spacearm.momentum.base_models import base_model
from spacearm.planner.held_mass import held_body
from spacearm.robot.capsule_fit import Segment
from spacearm.robot.envelope import Shape, enclosed
from spacearm.robot.excess import greatest_excess
from spacearm.robot.left_out import NOT_SAID, UncheckedPair, is_rigid, way_to, ways_to_links
from spacearm.robot.model import Frame, LinkCapsule, Robot
from spacearm.robot.urdf import CAPSULES_PER_SHAPE, MOST_CAPSULES_PER_SHAPE
from spacearm.scene import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere, SphereSet

Array = NDArray[np.float64]


def hold(
    robot: Robot,
    obstacle: Obstacle,
    *,
    frame: str | None = None,
    pose: ArrayLike | None = None,
    touching: Iterable[str] = (),
    name: str = "held",
    capsules_per_shape: int = CAPSULES_PER_SHAPE,
    mass: float | None = None,
    com: ArrayLike | None = None,
    inertia: ArrayLike | None = None,
) -> Robot:
    """Return the robot with something in its hand.

    What is held moves with the frame. It becomes a part of the envelope, and so must keep clear of every obstacle;
    and of every link, but for those that it may touch and those that no joint moves against it. A frame of its
    name stands in its own origin. On a floating base its mass counts, and must be given.

    Args:
        robot: the robot; it stays as it is.
        obstacle: any shape but a half-space. Its coordinates are taken in the frame of `pose`.
        frame: the frame that holds it; the end effector (`robot.tip`) unless given.
        pose: (4, 4), T_frame_x, from the coordinates of the obstacle to those of the frame [m], or a point (3,)
            for one that is not turned; by default they are the same. To take up an obstacle of the scene where it
            is, give the inverse of `forward_kinematics(robot, q, frame=frame)`.
        touching: names of links that it may touch, as the fingers around it.
        name: of the capsules and the frame that it becomes.
        capsules_per_shape: how many capsules may enclose a box or cylinder; the robot's last note tells by how
            much they stand out.
        mass: of what is held [kg]; a robot with a floating base can be planned only if it is given.
        com: (3,) its centre of mass, in its own frame `name` [m]; by default that of the shape, evenly filled.
        inertia: (3, 3) about its centre of mass along the axes of that frame, or its entries xx, yy, zz, xy, xz, yz
            [kg m^2]; by default that of the shape, evenly filled with the mass.

    Raises:
        RobotError: a mass, centre or inertia that cannot be; what cannot be held, a frame or link that is not there, a name
            that is taken, or a pose that is none.
    """
    if not isinstance(robot, Robot):
        raise RobotError(f"robot is {shown(robot)}, expected a Robot; make one with load_robot(...)")
    as_name("name", name, RobotError)
    if name in {entry.name for entry in (*robot.frames, *robot.capsules)}:
        raise RobotError(f"name '{name}' is taken by a link or a frame of robot '{robot.name}'; give another with name=")
    holder = robot.frame(robot.tip if frame is None else frame)
    free = _links_to_touch(robot, touching)
    T_joint_x = holder.T_joint_frame @ as_pose("pose", pose, RobotError)
    count = as_whole("capsules_per_shape", capsules_per_shape, RobotError, at_least=1, at_most=MOST_CAPSULES_PER_SHAPE)
    origin, capsules, excess = _enclosed(obstacle, count)
    carried = tuple(
        LinkCapsule(name=name, joint=holder.joint, a=_moved(T_joint_x, c.a), b=_moved(T_joint_x, c.b), radius=c.radius)
        for c in capsules
    )
    T_joint_own = T_joint_x @ origin
    body = held_body(name, holder.joint, T_joint_own, obstacle, mass, com, inertia)
    own = [way_to(robot, holder.joint)]
    links = [link for link, ways in ways_to_links(robot).items() if not is_rigid(robot, ways, own)]
    kind = type(obstacle).__name__.lower()
    capsule_count = f"{len(capsules)} capsule{'s' if len(capsules) > 1 else ''}"
    notes = [f"'{name}', a {kind}, is held by frame '{holder.name}': {capsule_count}, {excess}"]
    if body is None and base_model(robot.base).needs_masses:
        notes.insert(0, f"'{name}' is held, and nothing says its mass: a {robot.base} base needs it; give hold(..., mass=...)")
    return replace(
        robot,
        bodies=robot.bodies if body is None else (*robot.bodies, body),
        unweighed=robot.unweighed if body is not None else (*robot.unweighed, (name, NOT_SAID)),
        capsules=(*robot.capsules, *carried),
        frames=(*robot.frames, Frame(name=name, joint=holder.joint, T_joint_frame=T_joint_own, parent=holder.name)),
        self_pairs=(*robot.self_pairs, *((name, link) for link in links if link not in free)),
        unchecked=(
            *robot.unchecked,
            *(UncheckedPair(links=(name, link), reason="touching") for link in links if link in free),
        ),
        notes=(*robot.notes, *notes),
    )


def _enclosed(obstacle: Any, count: int) -> tuple[Array, list[Segment], str]:
    """Return the obstacle's own frame (4, 4), the capsules around it, and how far they stand out, in words."""
    T = np.eye(4)
    if isinstance(obstacle, Sphere):
        T[:3, 3] = obstacle.center
        return T, [Segment(obstacle.center, obstacle.center, obstacle.radius)], "exact"
    if isinstance(obstacle, Capsule):
        T[:3, 3] = (obstacle.a + obstacle.b) / 2
        return T, [Segment(obstacle.a, obstacle.b, obstacle.radius)], "exact"
    if isinstance(obstacle, SphereSet):
        spheres = [Segment(c, c, float(r)) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]
        return T, spheres, "exact" if obstacle.excess is None else f"{1000 * obstacle.excess:.3g} mm too large at most"
    if isinstance(obstacle, Box):
        shape = Shape("box", tuple(float(edge) for edge in obstacle.size), obstacle.pose)
    elif isinstance(obstacle, Cylinder):
        shape = Shape("cylinder", (obstacle.radius, obstacle.length), obstacle.pose)
    elif isinstance(obstacle, HalfSpace):
        raise RobotError("a half-space has no end and cannot be held; give a sphere, capsule, box, cylinder or sphere set")
    else:
        raise RobotError(f"obstacle is {shown(obstacle)}, expected a sphere, capsule, box, cylinder or sphere set")
    capsules = enclosed([shape], count)
    return obstacle.pose, capsules, f"{1000 * greatest_excess([shape], capsules):.3g} mm too large at most"


def _links_to_touch(robot: Robot, touching: Any) -> set[str]:
    if isinstance(touching, (str, bytes)) or not is_a_row(touching):
        raise RobotError(f"touching is {shown(touching)}, expected a list of links, as in touching=['hand']")
    known = list(dict.fromkeys(entry.name for entry in (*robot.capsules, *robot.frames)))
    names = list(touching)
    for link in names:
        if not isinstance(link, str) or link not in known:
            meant = nearest(link if isinstance(link, str) else shown(link), known)
            raise RobotError(f"touching names {shown(link)}, which is no link of robot '{robot.name}'; {meant}")
    return set(names)


def _moved(T: Array, point: Array) -> Array:
    return T[:3, :3] @ point + T[:3, 3]
