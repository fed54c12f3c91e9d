"""Attached objects: a robot that carries a payload.

The payload becomes shapes of the robot's envelope, as it is, and a frame of its own. If its mass or its density is given it is
also a body, whose centre of mass and inertia are those of the shape evenly filled unless they are given too.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_name, as_number, as_pose, as_readonly, is_a_row, shown
from spacearm.core.errors import RobotError, nearest
from spacearm.dynamics.base_models import base_model
from spacearm.geometry import ConvexShape, HalfSpace, Obstacle, PolytopeSet, Sphere, SphereSet, core_of, moved_shape
from spacearm.geometry.solid_moments import SolidMoments, solid_moments
from spacearm.robot import Body
from spacearm.robot.inertias import require_possible_inertia
from spacearm.robot.link_shapes import CONVEX, LinkShape
from spacearm.robot.model import Frame, Robot
from spacearm.robot.unchecked_pairs import NOT_SAID, UncheckedPair, is_rigid, way_to, ways_to_links

Array = NDArray[np.float64]

_FINITE = "a sphere, capsule, box, cylinder, polytope, sphere set or polytope set"


def hold(
    robot: Robot,
    obstacle: Obstacle,
    *,
    frame: str | None = None,
    pose: ArrayLike | None = None,
    touching: Iterable[str] = (),
    name: str = "held",
    mass: float | None = None,
    com: ArrayLike | None = None,
    inertia: ArrayLike | None = None,
    density: float | None = None,
    capsules_per_shape: object = None,
) -> Robot:
    """Return the robot with an object attached to one of its frames.

    The object moves with the frame. Its shape becomes a part of the envelope, as it is, so it must keep clear of every
    obstacle, and of every link except those that it may touch and those that no joint moves against it. A frame of its name
    has its origin in the object's. On a floating base its mass counts, and must be given.

    Args:
        robot: the robot; it stays as it is.
        obstacle: any shape but a half-space. Its coordinates are taken in the frame of `pose`.
        frame: the frame that it is attached to; the end effector (`robot.tip`) unless given.
        pose: (4, 4), T_frame_x, from the coordinates of the obstacle to those of the frame [m], or a point (3,)
            for one that is not turned; by default they are the same. To take up an obstacle of the scene where it
            is, give the inverse of `forward_kinematics(robot, q, frame=frame)`.
        touching: names of links that it may touch, as the fingers around it.
        name: of its shapes and its frame.
        mass: of the object [kg]; a robot with a floating base can be planned only if it or the density is given.
        com: (3,) its centre of mass, in its own frame `name` [m]; by default that of the shape, evenly filled.
        inertia: (3, 3) about its centre of mass along the axes of that frame, or its entries xx, yy, zz, xy, xz, yz
            [kg m^2]; by default that of the shape, evenly filled with the mass.
        density: of the object instead of its mass [kg/m^3], everywhere the same.
        capsules_per_shape: no longer used, since what is held keeps its shape; a note says so.

    Raises:
        RobotError: a mass, density, centre or inertia that cannot be; an object that cannot be attached, a frame or link
            that is not there, a name that is taken, or a pose that is none.
    """
    if not isinstance(robot, Robot):
        raise RobotError(f"robot is {shown(robot)}, expected a Robot; make one with load_robot(...)")
    as_name("name", name, RobotError)
    if name in {entry.name for entry in (*robot.frames, *robot.shapes)}:
        raise RobotError(f"name '{name}' is taken by a link or a frame of robot '{robot.name}'; give another with name=")
    holder = robot.frame(robot.tip if frame is None else frame)
    free = _links_to_touch(robot, touching)
    T_joint_x = holder.T_joint_frame @ as_pose("pose", pose, RobotError)
    parts, excess = _parts_of(obstacle)
    carried = tuple(
        LinkShape(name=name, joint=holder.joint, shape=replace(moved_shape(part, T_joint_x), name="")) for part in parts
    )
    T_joint_own = T_joint_x @ _own_frame(obstacle)
    body, said = _body_of(name, holder.joint, T_joint_x, obstacle, mass=mass, com=com, inertia=inertia, density=density)
    own = [way_to(robot, holder.joint)]
    links = [link for link, ways in ways_to_links(robot).items() if not is_rigid(robot, ways, own)]
    notes = [*said, f"'{name}', a {_kind(obstacle)}, is held by frame '{holder.name}': {excess}"]
    if capsules_per_shape is not None:
        notes.insert(0, f"'{name}' keeps its shape: capsules_per_shape is no longer used")
    if body is None and base_model(robot.base).needs_masses:
        notes.insert(
            0,
            f"'{name}' is held, and nothing says its mass: a {robot.base} base needs it; give hold(..., mass=...) or density=",
        )
    return replace(
        robot,
        bodies=robot.bodies if body is None else (*robot.bodies, body),
        unweighed=robot.unweighed if body is not None else (*robot.unweighed, (name, NOT_SAID)),
        shapes=(*robot.shapes, *carried),
        frames=(*robot.frames, Frame(name=name, joint=holder.joint, T_joint_frame=T_joint_own, parent=holder.name)),
        self_pairs=(*robot.self_pairs, *((name, link) for link in links if link not in free)),
        unchecked=(
            *robot.unchecked,
            *(UncheckedPair(links=(name, link), reason="touching") for link in links if link in free),
        ),
        notes=(*robot.notes, *notes),
    )


def _parts_of(obstacle: Any) -> tuple[tuple[ConvexShape, ...], str]:
    """Return the convex shapes that an object is made of, and how far they stand out of it, in words."""
    if isinstance(obstacle, CONVEX):
        return (obstacle,), "exact"
    if isinstance(obstacle, HalfSpace):
        raise RobotError(f"a half-space has no end and cannot be held; give {_FINITE}")
    if isinstance(obstacle, SphereSet):
        parts: tuple[ConvexShape, ...] = tuple(
            Sphere(center, float(radius)) for center, radius in zip(obstacle.centers, obstacle.radii, strict=True)
        )
    elif isinstance(obstacle, PolytopeSet):
        parts = obstacle.pieces
    else:
        raise RobotError(f"obstacle is {shown(obstacle)}, expected {_FINITE}")
    words = "exact" if not obstacle.excess else f"{1000 * obstacle.excess:.3g} mm too large at most"
    return parts, f"{len(parts)} piece{'s' if len(parts) > 1 else ''}, {words}"


def _own_frame(obstacle: Any) -> Array:
    """Return the object's own frame in its coordinates, (4, 4) [m]: a pose that it has, or the middle of a ball or a rod."""
    if hasattr(obstacle, "pose"):
        return obstacle.pose
    T = np.eye(4)
    if hasattr(obstacle, "center") or hasattr(obstacle, "a"):
        T[:3, 3] = core_of(obstacle).T[:3, 3]
    return T


def _kind(obstacle: Any) -> str:
    return {SphereSet: "sphere set", PolytopeSet: "polytope set"}.get(type(obstacle), type(obstacle).__name__.lower())


def _links_to_touch(robot: Robot, touching: Any) -> set[str]:
    if isinstance(touching, (str, bytes)) or not is_a_row(touching):
        raise RobotError(f"touching is {shown(touching)}, expected a list of links, as in touching=['hand']")
    known = list(dict.fromkeys(entry.name for entry in (*robot.shapes, *robot.frames)))
    names = list(touching)
    for link in names:
        if not isinstance(link, str) or link not in known:
            meant = nearest(link if isinstance(link, str) else shown(link), known)
            raise RobotError(f"touching names {shown(link)}, which is no link of robot '{robot.name}'; {meant}")
    return set(names)


def _body_of(
    name: str,
    joint: int,
    T_joint_x: Array,
    obstacle: Any,
    *,
    mass: float | None,
    com: ArrayLike | None,
    inertia: ArrayLike | None,
    density: float | None,
) -> tuple[Body | None, list[str]]:
    """Return the payload as a body, and what there is to say of it; None if neither its mass nor its density is given.

    Args:
        name: of the payload.
        joint: number of the joint that carries it.
        T_joint_x: (4, 4) from the coordinates of its shape to that joint's frame [m].
        obstacle: its shape.
        mass: [kg], or None.
        com: (3,) in its own frame [m]; None: that of the shape, evenly filled.
        inertia: (3, 3) about that centre along the axes of its own frame, or its entries xx, yy, zz, xy, xz, yz [kg m^2];
            None: that of the shape, evenly filled.
        density: [kg/m^3] in place of the mass, or None.

    Raises:
        RobotError: a centre or an inertia without a mass, both mass and density, or numbers that are no body's.
    """
    for what, given in (("com", com), ("inertia", inertia)):
        if mass is None and given is not None:
            raise RobotError(f"{what} of '{name}' is given without mass, expected both; give mass")
    if mass is None and density is None:
        return None, []
    filled = solid_moments(obstacle)
    kilograms, notes = _mass_of(name, filled, mass, density)
    own = _own_frame(obstacle)
    R_own = own[:3, :3]
    middle = filled.center if com is None else R_own @ as_readonly(f"com of '{name}'", com, (3,), RobotError) + own[:3, 3]
    about = kilograms * filled.inertia
    if inertia is not None:
        about = R_own @ _inertia(f"inertia of '{name}'", inertia) @ R_own.T
        about = (about + about.T) / 2
    require_possible_inertia(f"'{name}'", about)
    R = T_joint_x[:3, :3]
    turned = R @ about @ R.T
    body = Body(name=name, joint=joint, mass=kilograms, com=R @ middle + T_joint_x[:3, 3], inertia=(turned + turned.T) / 2)
    return body, notes


def _mass_of(name: str, filled: SolidMoments, mass: float | None, density: float | None) -> tuple[float, list[str]]:
    """Return the mass [kg], and how it follows from a density."""
    if density is None:
        return as_number(f"mass of '{name}'", mass, RobotError, above=0, unit="kg"), []
    if mass is not None:
        raise RobotError(f"both mass and density of '{name}' are given, expected one; drop density")
    even = as_number(f"density of '{name}'", density, RobotError, above=0, unit="kg/m^3")
    if not filled.volume > 0:
        raise RobotError(f"density of '{name}' is given, but its shape is flat and has no volume; give mass instead")
    kilograms = even * filled.volume
    return kilograms, [f"'{name}' has {kilograms:.4g} kg: {even:g} kg/m^3 in {filled.volume:.4g} m^3, everywhere the same"]


def _inertia(what: str, given: ArrayLike) -> Array:
    advice = "give a matrix (3, 3), or its entries xx, yy, zz, xy, xz, yz"
    if np.ndim(given) == 1:  # type: ignore[arg-type]
        xx, yy, zz, xy, xz, yz = as_readonly(what, given, (6,), RobotError, advice=advice)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return as_readonly(what, given, (3, 3), RobotError, advice=advice)
