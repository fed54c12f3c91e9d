"""Links and joints as files describe them, which every reader hands to `assemble`; and where the chains of such a tree end.

Where nobody names the end effector, it is the end of the only chain that joints move. Many links have nothing behind them and
are no end: a frame of the controller fixed to the base, a camera on an upper arm. An end is on the last body of a chain, which
joints move and from which no joint goes on. Where several frames are fixed to that body, a name that everybody uses (tool0,
tcp, ...) decides, if only one has it, or that the others are sensors or fingers; where chains fork, as into fingers that move,
a name on the body at which they do.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.errors import RobotError, nearest
from spacearm.geometry.shapes import ConvexShape

if TYPE_CHECKING:
    from spacearm.robot.envelope import LinkEnclosure
    from spacearm.robot.link_visuals import LinkVisual

Array = NDArray[np.float64]

LONGEST = 1e6
"""Lengths of a robot beyond this are taken for a mistake [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Mimic(Brief):
    """A joint's value follows another's: ``multiplier * leader + offset``."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LinkJoint(Brief):
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LinkMass(Brief):
    """The mass of a link [kg], its centre (3,) [m], and its inertia (3, 3) about that [kg m^2], all in the link's frame."""

    link: str
    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LinkTree(Brief):
    """Links and the joints between them.

    Attributes:
        name: for people.
        links, joints: names of links, and joints, in the file's order.
        shapes: the envelope, each as the link's name and a convex shape in the link's frame [m].
        envelopes: what these stand for, of links with collision shapes.
        masses: of the links that have one.
        visuals: how links look, in the link's frame; their joint is not known yet.
        shaped: links of a URDF with a shape, drawn or for collision.
        unreadable: links whose mass the file states so that it cannot be used, each with what is wrong.
        base: "fixed" or "floating".
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
    shapes: tuple[tuple[str, ConvexShape], ...] = ()
    envelopes: tuple[LinkEnclosure, ...] = ()
    masses: tuple[LinkMass, ...] = ()
    visuals: tuple[LinkVisual, ...] = ()
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


_NAMES = (
    frozenset(["tcp", "tool", "ee", "eef", "effector", "endeffector", "toolframe"]),
    frozenset(["flange", "tip", "hand", "gripper", "grasp"]),
)
"""Words by which ends of arms go, the plain ones first."""

_OTHERS = frozenset(
    ["camera", "cam", "optical", "sensor", "ft", "imu", "finger", "fingertip", "thumb", "changer", "mount", "sc"]
)
_LISTED = 8


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Ends(Brief):
    """Where a tree's chains end.

    Attributes:
        last: the joints from which no other that moves goes on.
        fork: the last joint that all of these hang on, one of them if it is alone; "" where they fork at the base.
        links: the links with nothing behind them on the bodies of `last`.
        at_fork: those on the body of `fork`.
        carrier: the link of that body from which the chains go on, or the root.
        hand: whether what forks are fingers rather than arms: more joints lie before the fork than behind it.
        after: by link, the joint that moves it, and how far from that joint it is [m].
        depth: by link, how many joints move it.
    """

    last: tuple[str, ...]
    fork: str
    links: tuple[str, ...]
    at_fork: tuple[str, ...]
    carrier: str
    hand: bool
    after: dict[str, tuple[str, float]]
    depth: dict[str, int]


def ends_of(tree: LinkTree) -> Ends:
    """Find where a tree's chains end; links and joints must form one tree."""
    above = {joint.child: joint for joint in tree.joints}
    movers = {link: _movers(link, above) for link in tree.links}
    inner = {joint.parent for joint in tree.joints}
    moving = [joint for joint in tree.joints if joint.kind != "fixed"]
    going_on = {name for joint in moving for name in movers[joint.parent]}
    last = tuple(joint.name for joint in moving if joint.name not in going_on)
    ways = [movers[joint.child] for joint in moving if joint.name in last]
    shared = [name for name in (ways[0] if ways else []) if all(name in way for way in ways)]
    fork = shared[0] if shared else ""
    links = tuple(link for link in tree.links if link not in inner and movers[link] and movers[link][0] in last)
    at_fork = tuple(link for link in tree.links if link not in inner and movers[link] and movers[link][0] == fork)
    after = {link: (movers[link][0], _distance(link, above)) for link in tree.links if movers[link]}
    hand = bool(shared) and 2 * len(shared) > max(map(len, ways))
    carrier = _carrier(tree, ways, above)
    depth = {link: len(movers[link]) for link in tree.links}
    return Ends(last=last, fork=fork, links=links, at_fork=at_fork, carrier=carrier, hand=hand, after=after, depth=depth)


def default_tip(tree: LinkTree) -> LinkTree:
    """Name a tree's tip where there is one that everybody means; a note says how it was chosen.

    Raises:
        RobotError: there are several; each is listed with the joint that moves it.
    """
    ends = ends_of(tree)
    candidates = ends.links if len(ends.last) == 1 else ends.at_fork
    if len(ends.last) == len(candidates) == 1:
        return replace(tree, tip=candidates[0])
    named = _named_so(candidates)
    plain = [link for link in candidates if not _words(link) & _OTHERS]
    if named is None and len(ends.last) == 1 and len(plain) < 2:  # the others are cameras, fingers and the like
        named = plain[0] if plain else _named_so(tuple(link for link in ends.after if ends.after[link][0] == ends.fork))
    if not ends.last or named is None:
        raise RobotError(f"robot '{tree.name}' {several_ends(ends)}; name the end effector, as in tip='{advised(ends)}'")
    others = [link for link in (*candidates, *ends.links) if link != named]
    note = f"the tip is '{named}', by its name; {_listed(dict.fromkeys(others), ends)} end there too, give tip= for another"
    return replace(tree, tip=named, notes=(*tree.notes, note))


def advised(ends: Ends) -> str:
    """Return the link that is most likely meant where several might be."""
    if len(ends.last) > 1 and ends.hand:
        return ends.carrier
    for words in (frozenset(["tcp"]), frozenset(["tool"]), *_NAMES):
        named = [link for link in ends.links if _words(link) & words and not _words(link) & _OTHERS]
        if named:
            return named[-1]
    return max(reversed(ends.links), key=lambda link: (ends.depth[link], ends.after[link][1])) if ends.links else ends.carrier


def several_ends(ends: Ends) -> str:
    """Say where chains end, in words that go on after the robot's name."""
    count = len(ends.last)
    if count == 1:
        many = f"has {len(ends.links)} links at the end of its chain"
    else:
        fork = f", which fork at '{ends.carrier}'" if ends.fork else ""
        many = f"has {count} chains{fork}, with {len(ends.links)} ends"
    return f"{many}: {_listed(dict.fromkeys(ends.links), ends)}"


def _listed(links: dict[str, None], ends: Ends) -> str:
    names = list(links)
    said = [f"'{link}' ({ends.after[link][1]:.2g} m after '{ends.after[link][0]}')" for link in names[:_LISTED]]
    return ", ".join(said) + (f", ... ({len(names)} in all)" if len(names) > _LISTED else "")


def _movers(link: str, above: dict[str, LinkJoint]) -> list[str]:
    """List the joints that move a link, the nearest first."""
    found = []
    while link in above:
        if above[link].kind != "fixed":
            found.append(above[link].name)
        link = above[link].parent
    return found


def _distance(link: str, above: dict[str, LinkJoint]) -> float:
    """Return how far a link's frame is from the joint that moves it [m]."""
    T = np.eye(4)
    while link in above and above[link].kind == "fixed":
        T = np.asarray(above[link].T_parent_child) @ T
        link = above[link].parent
    return float(np.linalg.norm(T[:3, 3]))


def _carrier(tree: LinkTree, ways: list[list[str]], above: dict[str, LinkJoint]) -> str:
    """Return the last link that all chains go through."""
    paths = []
    for way in ways:
        link, path = next(joint.child for joint in tree.joints if joint.name == way[0]), []
        while link in above:
            link = above[link].parent
            path.append(link)
        paths.append(path)
    shared = [link for link in (paths[0] if paths else []) if all(link in path for path in paths)]
    return shared[0] if shared else tree.links[0]


def _named_so(links: tuple[str, ...]) -> str | None:
    """Return the only link that is called as ends of arms are; None if there is none, or several are."""
    for names in _NAMES:
        found = [link for link in links if _words(link) & names and not _words(link) & _OTHERS]
        if found:
            return found[0] if len(found) == 1 else None
    return None


def _words(name: str) -> frozenset[str]:
    parted = re.sub(r"([a-z])([A-Z])", r"\1 \2", name)
    return frozenset(word.lower() for word in re.findall(r"[A-Za-z]+", parted))
