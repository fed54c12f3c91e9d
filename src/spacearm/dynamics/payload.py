"""Attached objects: a robot that carries a payload.

The payload becomes capsules of the robot's envelope and a frame of its own. If its mass is given it is also a body, whose
centre of mass and inertia are those of the shape evenly filled unless they are given too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_name, as_number, as_pose, as_readonly, as_whole, is_a_row, shown
from spacearm.core.errors import RobotError, nearest
from spacearm.dynamics.base_models import base_model
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere, SphereSet
from spacearm.robot import Body
from spacearm.robot.capsule_fit import Segment
from spacearm.robot.envelope import enclosed, greatest_excess
from spacearm.robot.model import Frame, LinkCapsule, Robot, require_possible_inertia
from spacearm.robot.unchecked_pairs import NOT_SAID, UncheckedPair, is_rigid, way_to, ways_to_links
from spacearm.robot.urdf import CAPSULES_PER_SHAPE, MOST_CAPSULES_PER_SHAPE, Shape

Array = NDArray[np.float64]

_POINTS = 64  # of the grid along the longest edge of the box around a sphere set


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
    """Return the robot with an object attached to one of its frames.

    The object moves with the frame. It becomes a part of the envelope, so it must keep clear of every obstacle, and of
    every link except those that it may touch and those that no joint moves against it. A frame of its name has its
    origin in the object's. On a floating base its mass counts, and must be given.

    Args:
        robot: the robot; it stays as it is.
        obstacle: any shape but a half-space. Its coordinates are taken in the frame of `pose`.
        frame: the frame that it is attached to; the end effector (`robot.tip`) unless given.
        pose: (4, 4), T_frame_x, from the coordinates of the obstacle to those of the frame [m], or a point (3,)
            for one that is not turned; by default they are the same. To take up an obstacle of the scene where it
            is, give the inverse of `forward_kinematics(robot, q, frame=frame)`.
        touching: names of links that it may touch, as the fingers around it.
        name: of its capsules and its frame.
        capsules_per_shape: how many capsules may enclose a box or cylinder; the robot's last note says by how
            much they stand out.
        mass: of the object [kg]; a robot with a floating base can be planned only if it is given.
        com: (3,) its centre of mass, in its own frame `name` [m]; by default that of the shape, evenly filled.
        inertia: (3, 3) about its centre of mass along the axes of that frame, or its entries xx, yy, zz, xy, xz, yz
            [kg m^2]; by default that of the shape, evenly filled with the mass.

    Raises:
        RobotError: a mass, centre or inertia that cannot be; an object that cannot be attached, a frame or link
            that is not there, a name that is taken, or a pose that is none.
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
    body = _body_of(name, holder.joint, T_joint_own, obstacle, mass, com, inertia)
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


def _body_of(
    name: str, joint: int, T_joint_own: Array, obstacle: Obstacle, mass: Any, com: ArrayLike | None, inertia: ArrayLike | None
) -> Body | None:
    """Return the payload as a body; None if its mass is not given.

    Args:
        name: of the payload.
        joint: number of the joint that carries it.
        T_joint_own: (4, 4) from its own frame to that joint's [m].
        obstacle: its shape, whose middle is the origin of its own frame.
        mass: [kg], or None.
        com: (3,) in its own frame [m]; None: that of the shape, evenly filled.
        inertia: (3, 3) about that centre along the axes of its own frame, or its entries xx, yy, zz, xy, xz, yz [kg m^2];
            None: that of the shape, evenly filled.

    Raises:
        RobotError: a centre or an inertia without a mass, or numbers that are no body's.
    """
    if mass is None:
        if com is not None or inertia is not None:
            raise RobotError(
                f"{'inertia' if com is None else 'com'} of '{name}' is given without mass, expected both; give mass"
            )
        return None
    kilograms = as_number(f"mass of '{name}'", mass, RobotError, above=0, unit="kg")
    middle, second = _even(obstacle)
    if com is not None:
        middle = as_readonly(f"com of '{name}'", com, (3,), RobotError)
    about = kilograms * second if inertia is None else _inertia(f"inertia of '{name}'", inertia)
    require_possible_inertia(f"'{name}'", about)
    R = T_joint_own[:3, :3]
    turned = R @ about @ R.T
    return Body(
        name=name,
        joint=joint,
        mass=kilograms,
        com=R @ middle + T_joint_own[:3, 3],
        inertia=(turned + turned.T) / 2,
    )


def _inertia(what: str, given: ArrayLike) -> Array:
    advice = "give a matrix (3, 3), or its entries xx, yy, zz, xy, xz, yz"
    if np.ndim(given) == 1:  # type: ignore[arg-type]
        xx, yy, zz, xy, xz, yz = as_readonly(what, given, (6,), RobotError, advice=advice)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return as_readonly(what, given, (3, 3), RobotError, advice=advice)


def _even(obstacle: Obstacle) -> tuple[Array, Array]:
    """Return the centre of mass (3,) [m] and the inertia per mass about it (3, 3) [m^2] of an evenly filled shape."""
    none = np.zeros(3)
    if isinstance(obstacle, Sphere):
        return none, 0.4 * obstacle.radius**2 * np.eye(3)
    if isinstance(obstacle, Box):
        squared = np.square(obstacle.size)
        return none, np.diag(squared.sum() - squared) / 12
    if isinstance(obstacle, Cylinder):
        across = obstacle.radius**2 / 4 + obstacle.length**2 / 12
        return none, np.diag([across, across, obstacle.radius**2 / 2])
    if isinstance(obstacle, Capsule):
        return none, _capsule(obstacle.b - obstacle.a, obstacle.radius)
    assert isinstance(obstacle, SphereSet), "nothing else can be attached"
    return _balls(obstacle)


def _capsule(along: Array, radius: float) -> Array:
    """Return the inertia per mass of a cylinder with half a ball on each end."""
    length = float(np.linalg.norm(along))
    if length == 0:
        return 0.4 * radius**2 * np.eye(3)
    share = length / (length + 4 / 3 * radius)  # of the mass in the cylinder
    axial = share * radius**2 / 2 + (1 - share) * 0.4 * radius**2
    across = share * (length**2 / 12 + radius**2 / 4)
    across += (1 - share) * (0.4 * radius**2 + length**2 / 4 + 0.375 * length * radius)
    z = along / length
    return across * np.eye(3) + (axial - across) * np.outer(z, z)


def _balls(balls: SphereSet) -> tuple[Array, Array]:
    """Return the same for balls that may overlap, by points on a grid; the error is about two percent."""
    low = (balls.centers - balls.radii[:, None]).min(axis=0)
    high = (balls.centers + balls.radii[:, None]).max(axis=0)
    step = float((high - low).max()) / _POINTS
    counts = [max(1, math.ceil(edge / step)) for edge in (high - low).tolist()]
    axes = [lo + (np.arange(n) + 0.5) * (edge / n) for lo, edge, n in zip(low, high - low, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.zeros(len(points), dtype=bool)
    for center, radius in zip(balls.centers, balls.radii, strict=True):
        inside |= np.einsum("pc,pc->p", points - center, points - center) <= radius**2
    if not inside.any():  # balls far smaller than the grid: their centres will do
        points, inside = balls.centers, np.ones(len(balls.centers), dtype=bool)
    filled = points[inside]
    middle = filled.mean(axis=0)
    off = filled - middle
    second = off.T @ off / len(filled) + np.eye(3) * step**2 / 12
    return middle, np.trace(second) * np.eye(3) - second
