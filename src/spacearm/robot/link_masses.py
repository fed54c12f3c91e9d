"""The masses that a URDF states for its links. Nothing here stops anybody: what cannot be read is told in a note."""

from __future__ import annotations

from typing import Any

import numpy as np

from spacearm.core.checks import shown
from spacearm.core.rotations import rotation_from_rpy
from spacearm.robot.link_tree import LinkMass
from spacearm.robot.model import inertia_fault
from spacearm.robot.robot_xml import numbers_in

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def link_masses(root: Any) -> tuple[tuple[LinkMass, ...], tuple[tuple[str, str], ...]]:
    """Read the <inertial> of every link that has one.

    Args:
        root: a URDF, an lxml element.

    Returns:
        The masses; and for each <inertial> that cannot be used, the link and what is wrong: it is left without a mass.
    """
    found, wrong = [], []
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        try:
            found.append(_link_mass(link.get("name"), inertial))
        except ValueError as error:
            wrong.append((str(link.get("name")), str(error)))
    return tuple(found), tuple(wrong)


def notes_on_masses(wrong: tuple[tuple[str, str], ...]) -> tuple[str, ...]:
    """Say in one note which links are left without a mass, and why."""
    said = f"the masses of {len(wrong)} links cannot be read, which are left without one: "
    said += ", ".join(f"{link} ({why})" for link, why in wrong)
    return (said.replace("masses of 1 links", "mass of 1 link"),) if wrong else ()


def shaped_links(root: Any) -> tuple[str, ...]:
    """Return the names of the links of a URDF that have a shape, drawn or for collision; others are frames."""
    found = [link.get("name") for link in root.findall("link") if any(_has_shape(part) for part in link)]
    return tuple(name for name in found if name)


def _has_shape(part: Any) -> bool:
    return part.tag in ("visual", "collision") and part.find("geometry") is not None and len(part.find("geometry")) > 0


def _link_mass(link: str, inertial: Any) -> LinkMass:
    com, rpy = _numbers(inertial, "origin", "xyz", 3, "0 0 0"), _numbers(inertial, "origin", "rpy", 3, "0 0 0")
    (mass,) = _numbers(inertial, "mass", "value", 1, None)
    if mass < 0:
        raise ValueError(f"<mass value> is {mass:g}, below 0")
    if mass > 0 and inertial.find("inertia") is None:
        raise ValueError("<inertia> is missing")
    xx, xy, xz, yy, yz, zz = (_numbers(inertial, "inertia", moment, 1, "0")[0] for moment in _MOMENTS)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if mass == 0 and inertia.any():
        raise ValueError("<mass value> is 0, but <inertia> is not")
    if inertia_fault(inertia) == "negative":
        raise ValueError("<inertia> is that of no body: it has a negative principal moment")
    R = rotation_from_rpy(rpy)
    turned = R @ inertia @ R.T
    return LinkMass(link, mass, np.array(com), (turned + turned.T) / 2)


def _numbers(inertial: Any, tag: str, attribute: str, count: int, default: str | None) -> list[float]:
    element = inertial.find(tag)
    text = default if element is None else element.get(attribute, default)
    if text is None:
        raise ValueError(f"<{tag} {attribute}> is missing")
    numbers = numbers_in(text)
    if len(numbers) != count or not all(abs(number) < 1e12 for number in numbers):
        raise ValueError(f"<{tag} {attribute}> is {shown(text)}")
    return numbers
