"""Boxes, masses and configurations of a robot file; `yaml_robot` explains the keys."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_number, as_readonly, as_whole
from spacearm.errors import RobotError, nearest
from spacearm.robot.box_capsules import box_capsules
from spacearm.robot.links import LONGEST, LinkJoint, LinkMass
from spacearm.robot.rotations import rotation_from_rpy

if TYPE_CHECKING:
    from spacearm.robot.yaml_schema import BoxModel, ConfigurationModel, JointModel, MassModel

Array = NDArray[np.float64]

_MOST = 1000  # capsules around one box
_ROUNDING = 1e-9  # share of the largest moment

Stated = tuple[str, tuple[tuple[str, float], ...]]
"""A configuration: its name, and the value of each joint that it names [rad or m]."""


def capsules_of_box(box: BoxModel, links: Sequence[str], count: int) -> list[tuple[str, Array, Array, float]]:
    """Enclose a box in capsules, (link, a, b, radius) in the link's frame [m].

    Args:
        box: as the file has it.
        links: names of the robot's.
        count: how many capsules at most, if the box does not say it.

    Raises:
        RobotError: a link that is not there, or edges or a number of capsules that are none.
    """
    where = f"box of link '{box.link}'"
    require_link(where, box.link, links)
    size = as_readonly(f"{where}: size", box.size, (3,), RobotError)
    if not (size > 0).all() or size.max() > LONGEST:
        raise RobotError(f"{where}: size is {size.tolist()}, expected three edges above 0 and at most {LONGEST:g} [m]")
    T = placed(where, box)
    if box.count is not None:
        count = as_whole(f"{where}: capsules", box.count, RobotError, at_least=1, at_most=_MOST)
    capsules = box_capsules(tuple(size.tolist()), count)
    return [(box.link, T[:3, :3] @ c.a + T[:3, 3], T[:3, :3] @ c.b + T[:3, 3], c.radius) for c in capsules]


def link_mass(mass: MassModel, links: Sequence[str], earlier: Sequence[str]) -> LinkMass:
    """Make a link's mass of what the file states.

    Raises:
        RobotError: a link that is not there, or has a mass already, or numbers that are no body's.
    """
    where = f"mass of link '{mass.link}'"
    require_link(where, mass.link, links)
    if mass.link in earlier:
        raise RobotError(f"{where} is there twice, expected once; add them up, or give the second its own link")
    xx, yy, zz, xy, xz, yz = as_readonly(
        f"{where}: inertia", mass.inertia, (6,), RobotError, advice="give the entries xx, yy, zz, xy, xz, yz"
    )
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    require_of_a_body(where, inertia)
    return LinkMass(
        mass.link,
        as_number(f"{where}: mass", mass.mass, RobotError, above=0, unit="kg"),
        as_readonly(f"{where}: com", mass.com, (3,), RobotError),
        inertia,
    )


def require_of_a_body(where: str, inertia: Array) -> None:
    """Refuse an inertia (3, 3) with a principal moment below 0, or one above the sum of the other two.

    Raises:
        RobotError: it is one.
    """
    least, middle, largest = np.linalg.eigvalsh(inertia)
    slack = _ROUNDING * max(abs(least), abs(largest))
    if least < -slack or largest > least + middle + slack:
        raise RobotError(
            f"{where}: inertia has the principal moments {least:g}, {middle:g} and {largest:g}, expected none below 0 and none "
            "above the sum of the other two; correct it"
        )


def stated_configuration(given: ConfigurationModel, joints: Sequence[LinkJoint], earlier: Sequence[str]) -> Stated:
    """Give each joint that moves and follows no other its value.

    Raises:
        RobotError: a name twice, no values, both units, or another number of them.
    """
    where = f"configuration '{given.name}'"
    if given.name in earlier:
        raise RobotError(f"{where} is there twice, expected once; rename the other")
    moving = [joint for joint in joints if joint.kind != "fixed" and joint.mimic is None]
    lengths = [joint.name for joint in moving if joint.kind == "prismatic"]
    if given.q_deg is not None and given.q is None and lengths:
        raise RobotError(f"{where} states q_deg, but joint '{lengths[0]}' is prismatic; write q [rad or m]")
    q = radians(where, given, "q")
    if q is None:
        raise RobotError(f"{where} states no q, expected one number per joint; add it, or q_deg")
    advice = f"give one number per joint: {', '.join(joint.name for joint in moving)}"
    values = as_readonly(where, q, (len(moving),), RobotError, advice=advice)
    return given.name, tuple((joint.name, float(value)) for joint, value in zip(moving, values, strict=True))


def placed(where: str, given: JointModel | BoxModel) -> Array:
    """Return the transform (4, 4) of the keys xyz and rpy or rpy_deg.

    Raises:
        RobotError: lists of another length, or both units.
    """
    T = np.eye(4)
    T[:3, 3] = as_readonly(f"{where}: xyz", given.xyz, (3,), RobotError)
    rpy = radians(where, given, "rpy") or (0.0, 0.0, 0.0)
    T[:3, :3] = rotation_from_rpy(as_readonly(f"{where}: rpy", rpy, (3,), RobotError))
    return T


def radians(where: str, given: Any, key: str) -> Any:
    """Take a key in radians (or metres), or its twin in degrees; None if there is neither.

    Raises:
        RobotError: both.
    """
    plain, degrees = getattr(given, key), getattr(given, f"{key}_deg")
    if degrees is None:
        return plain
    if plain is not None:
        raise RobotError(f"{where} states both {key} and {key}_deg, expected one; remove the other")
    return [math.radians(angle) for angle in degrees] if isinstance(degrees, list) else math.radians(degrees)


def require_link(where: str, link: str, links: Sequence[str]) -> None:
    """Refuse a link that no joint names.

    Raises:
        RobotError: it is one.
    """
    if link not in links:
        raise RobotError(f"{where}: no joint names that link; {nearest(link, links)}")
