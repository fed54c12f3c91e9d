"""Which joints an SRDF's group moves, which of its states are configurations, and where its tip is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from spacearm.checks import shown
from spacearm.errors import RobotError, nearest
from spacearm.robot.links import LinkJoint, LinkTree
from spacearm.robot.srdf import Group, Srdf


@dataclass(frozen=True, slots=True, kw_only=True)
class Members:
    """What a group comes to.

    Attributes:
        joints: names, in the tree's order; fixed ones are not listed.
        tips: the links at the ends: those that its chains name, else those from which none of its joints goes on.
    """

    joints: tuple[str, ...]
    tips: tuple[str, ...]


def group_members(srdf: Srdf, name: str, tree: LinkTree) -> Members:
    """Find the joints of a group: those on its chains, above its links, named by it, or of its subgroups.

    Args:
        srdf: the file.
        name: of the group.
        tree: the robot that the file is about; links and joints must form one tree.

    Raises:
        RobotError: no such group, links or joints that the robot does not have, subgroups in a circle, or no
            joint that moves.
    """
    members: dict[str, None] = {}
    chain_tips: dict[str, None] = {}
    above = {joint.child: joint for joint in tree.joints}
    for group in with_subgroups(srdf, name):
        where = f"{srdf.source}: group '{group.name}'"
        for joint in group.joints:
            known = [joint.name for joint in tree.joints]
            if joint not in known and joint not in {virtual.name for virtual in srdf.virtual_joints}:
                raise RobotError(f"{where} names joint '{joint}', which the robot does not have; {nearest(joint, known)}")
            members[joint] = None
        for link in (*group.links, *(link for chain in group.chains for link in chain)):
            if link not in tree.links:
                raise RobotError(f"{where} names link '{link}', which the robot does not have; {nearest(link, tree.links)}")
        members.update((above[link].name, None) for link in group.links if link in above)
        for base, tip in group.chains:
            members.update((joint.name, None) for joint in _between(base, tip, above))
            chain_tips[tip] = None
    moving = [joint for joint in tree.joints if joint.name in members and joint.kind != "fixed"]
    if not moving:
        raise RobotError(f"{srdf.source}: group '{name}' has no moving joint, expected at least one; choose another group")
    tips = _furthest(chain_tips, above) or _ends(moving, tree)
    names = {joint.name for joint in moving}
    moved = tuple(tip for tip in tips if any(joint.name in names for joint in _between(tip, _root(tip, above), above)))
    return Members(joints=tuple(joint.name for joint in moving), tips=moved or tips)


def with_subgroups(srdf: Srdf, name: str) -> list[Group]:
    """List a group, and the groups that it consists of.

    Raises:
        RobotError: no such group, or groups in a circle.
    """
    groups = {group.name: group for group in srdf.groups}
    found: dict[str, Group] = {}

    def add(wanted: str, passed: tuple[str, ...]) -> None:
        if wanted in passed:
            raise RobotError(f"{srdf.source}: groups {' -> '.join((*passed, wanted))} contain each other in a circle")
        if wanted not in groups:
            where = f"group '{passed[-1]}' of {srdf.source} contains group" if passed else f"{srdf.source} has no group"
            raise RobotError(f"{where} {shown(wanted)}{', which is not there' if passed else ''}; {nearest(wanted, groups)}")
        if wanted not in found:
            found[wanted] = groups[wanted]
            for subgroup in groups[wanted].subgroups:
                add(subgroup, (*passed, wanted))

    if not isinstance(name, str):
        raise RobotError(f"group is {shown(name)}, expected the name of a group in {srdf.source}; {nearest('', groups)}")
    add(name, ())
    return list(found.values())


def _between(base: str, tip: str, above: dict[str, LinkJoint]) -> list[LinkJoint]:
    """List the joints on the way from one link to another; they need not lie on one branch."""

    def way_up(link: str) -> list[LinkJoint]:
        way = []
        while link in above:
            way.append(above[link])
            link = above[link].parent
        return way

    first, second = way_up(base), way_up(tip)
    shared = {joint.name for joint in first} & {joint.name for joint in second}
    return [joint for joint in (*first, *second) if joint.name not in shared]


def _root(link: str, above: dict[str, LinkJoint]) -> str:
    while link in above:
        link = above[link].parent
    return link


def _furthest(tips: Iterable[str], above: dict[str, LinkJoint]) -> tuple[str, ...]:
    """Leave out the tips that lie on the way to another one."""
    inner: set[str] = set()
    for tip in tips:
        while tip in above:
            tip = above[tip].parent
            inner.add(tip)
    return tuple(tip for tip in tips if tip not in inner)


def _ends(moving: list[LinkJoint], tree: LinkTree) -> tuple[str, ...]:
    """Find the links that the joints carry and from which none of them goes on, along fixed joints to their last link."""
    above = {joint.child: joint for joint in tree.joints}
    names = {joint.name for joint in moving}
    inner: set[str] = set()
    for joint in moving:
        link = joint.parent
        while link in above:
            inner.add(above[link].name)
            link = above[link].parent
    ends = []
    for joint in moving:
        if joint.name in inner & names:
            continue
        link = joint.child
        while True:
            below = [other for other in tree.joints if other.parent == link]
            if len(below) != 1 or below[0].kind != "fixed":
                break
            link = below[0].child
        ends.append(link)
    return tuple(ends)
