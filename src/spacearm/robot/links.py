"""Links and joints as files describe them: what the URDF and the YAML reader hand to `tree`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import RobotError, nearest

Array = NDArray[np.float64]

LONGEST = 1e6
"""Lengths of a robot beyond this are taken for a mistake [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mimic:
    """A joint's value follows another's: ``multiplier * leader + offset``."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkJoint:
    """A joint between two links, as a file states it; limits that the file leaves out are None.

    Attributes:
        name: unique.
        kind: "revolute", "continuous", "prismatic", "fixed", "floating" or "planar"; a robot is made of the first four.
        parent, child: names of the links.
        T_parent_child: (4, 4), from the child link's frame at value 0 to the parent link's [m].
        axis: (3,) in the child link's frame, of any length above 0; None for a fixed joint.
        lower, upper: [rad or m].
        velocity, acceleration: [rad/s, rad/s^2 or m/s, m/s^2].
        mimic: the joint that it follows.
    """

    name: str
    kind: str
    parent: str
    child: str
    T_parent_child: Array
    axis: Array | None = None
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    acceleration: float | None = None
    mimic: Mimic | None = None


@dataclass(frozen=True, slots=True, eq=False)
class LinkMass:
    """The mass of a link [kg], its centre (3,) [m], and its inertia (3, 3) about that [kg m^2], all in the link's frame."""

    link: str
    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkTree:
    """Links and the joints between them.

    Attributes:
        name: for people.
        links, joints: names of links, and joints, in the file's order.
        capsules: the envelope, (link, a, b, radius) in the link's frame [m].
        masses: of the links that have one.
        shaped: links of a URDF with a shape, drawn or for collision.
        unreadable: links whose mass the file states so that it cannot be used, each with what is wrong.
        base: how the root is held: "fixed" or "floating".
        configurations: named ones, each with the value of some joints [rad or m].
        with_envelope: False if the user wants none.
        self_collision: what the file asks for: "none", "computed", or pairs of links that must keep clear.
        tip: the link that is the end effector, if the file says so.
        source: the file, or the name of a built-in robot.
        notes: what was assumed, a sentence each.
    """

    name: str
    links: tuple[str, ...]
    joints: tuple[LinkJoint, ...]
    capsules: tuple[tuple[str, Array, Array, float], ...] = ()
    masses: tuple[LinkMass, ...] = ()
    shaped: tuple[str, ...] = ()
    unreadable: tuple[tuple[str, str], ...] = ()
    base: Literal["fixed", "floating"] = "fixed"
    configurations: tuple[tuple[str, tuple[tuple[str, float], ...]], ...] = ()
    with_envelope: bool = True
    self_collision: str | tuple[tuple[str, str], ...] = "none"
    tip: str | None = None
    source: str = ""
    notes: tuple[str, ...] = ()


def leader_of(joint: LinkJoint, tree: LinkTree) -> Mimic:
    """Follow a chain of mimics to the joint that moves them all; a joint that mimics none leads itself.

    Raises:
        RobotError: it mimics what is no moving joint, or in a circle.
    """
    moving = {other.name: other for other in tree.joints if other.kind != "fixed"}
    at, multiplier, offset, passed = joint, 1.0, 0.0, [joint.name]
    while at.mimic is not None:
        if at.mimic.leader not in moving:
            known = nearest(at.mimic.leader, [name for name in moving if name != at.name])
            raise RobotError(f"joint '{at.name}' mimics '{at.mimic.leader}', which is no moving joint; {known}")
        offset += multiplier * at.mimic.offset
        multiplier *= at.mimic.multiplier
        at = moving[at.mimic.leader]
        if at.name in passed:
            raise RobotError(f"joints {' -> '.join([*passed, at.name])} mimic each other in a circle; free one of them")
        passed.append(at.name)
    return Mimic(leader=at.name, multiplier=multiplier, offset=offset)
