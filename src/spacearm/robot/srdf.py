"""SRDF files: what MoveIt adds to a URDF. Groups of joints, named states, and pairs of links that may touch.

Read are group, group_state, end_effector, virtual_joint, passive_joint, disable_collisions, disable_default_collisions,
enable_collisions and link_sphere_approximation; anything else is ignored. `group_members` finds what a group moves, and
`what_does_not_fit` tells the names that the robot does not have.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from spacearm.core.brief import Brief
from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, RobotError, nearest
from spacearm.core.reading import located, read_bytes
from spacearm.robot.link_tree import LinkJoint, LinkTree
from spacearm.robot.robot_xml import note_on_repairs, numbers_in, xacro_left_in, xml_document

Pair = tuple[str, str]
"""Two names of links, in alphabetical order."""

_VIRTUAL = ("fixed", "floating", "planar")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Group(Brief):
    """A group as its file states it: chains (base link, tip link), and names of joints, links and other groups."""

    name: str
    chains: tuple[tuple[str, str], ...] = ()
    joints: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    subgroups: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class GroupState(Brief):
    """A named configuration: the value of each joint that it names [rad or m]; the group is "" where none is stated."""

    name: str
    group: str
    values: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class VirtualJoint(Brief):
    """How the robot's root, the child, moves in the world, the parent frame: "fixed", "floating" or "planar"."""

    name: str
    kind: str
    child: str
    parent: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Srdf(Brief):
    """An SRDF file.

    Attributes:
        source: its path.
        groups, states, virtual_joints: in the file's order.
        mounts: links on which end effectors are mounted.
        passive_joints: names of joints without a motor.
        disabled: pairs of links that need not keep clear.
        silent_links: links that need not keep clear of anything, but for the pairs in `enabled`.
        enabled: pairs that must keep clear although one of them is silent.
        spheres: for each link with an approximation, its spheres (x, y, z, radius) in the link's frame [m].
        notes: what was put right in reading it.
    """

    source: str
    groups: tuple[Group, ...] = ()
    states: tuple[GroupState, ...] = ()
    mounts: tuple[str, ...] = ()
    virtual_joints: tuple[VirtualJoint, ...] = ()
    passive_joints: tuple[str, ...] = ()
    disabled: frozenset[Pair] = frozenset()
    silent_links: frozenset[str] = frozenset()
    enabled: frozenset[Pair] = frozenset()
    spheres: tuple[tuple[str, tuple[tuple[float, ...], ...]], ...] = ()
    notes: tuple[str, ...] = ()

    def may_touch(self, first: str, second: str) -> bool:
        """Whether two links need not keep clear of each other; as in MoveIt, a disabled pair outweighs an enabled one."""
        both = pair(first, second)
        if both in self.disabled:
            return True
        return both not in self.enabled and not self.silent_links.isdisjoint(both)


def pair(first: str, second: str) -> Pair:
    """Put two names in alphabetical order."""
    return (first, second) if first <= second else (second, first)


def load_srdf(path: str | os.PathLike[str]) -> Srdf:
    """Read an SRDF file.

    Raises:
        FileFormatError: no such file, no XML, no SRDF, or an element without what it needs; the line is named.
    """
    content = read_bytes(path, what="an SRDF")
    with located(path):
        root, repairs = xml_document(content, what="an SRDF", root="robot")
        _require_srdf(root)
        srdf = _srdf(root, str(path))
        of_none = [state.name for state in srdf.states if not state.group]
        said = [f"states of the SRDF that name no group are those of the whole robot: {', '.join(of_none)}"] if of_none else []
        return replace(srdf, notes=(*note_on_repairs(repairs, "the SRDF"), *said))


def _require_srdf(root: Any) -> None:
    if root.find("link") is not None:
        raise FileFormatError(
            "this holds <link> elements, expected an SRDF; is it the URDF? give that first, and this as srdf="
        )


def _srdf(root: Any, source: str) -> Srdf:
    groups = tuple(_group(element) for element in root.findall("group"))
    _require_once(root.findall("group"), [group.name for group in groups])
    states = tuple(_state(element) for element in root.findall("group_state"))
    _require_once(root.findall("group_state"), [f"{state.group}/{state.name}" for state in states])
    spheres = tuple(_spheres(element) for element in root.findall("link_sphere_approximation"))
    _require_once(root.findall("link_sphere_approximation"), [link for link, _ in spheres])
    return Srdf(
        source=source,
        groups=groups,
        states=states,
        mounts=tuple(link for *_, link in _all(root, "end_effector", "name", "group", "parent_link")),
        virtual_joints=tuple(_virtual_joint(element) for element in root.findall("virtual_joint")),
        passive_joints=tuple(name for (name,) in _all(root, "passive_joint", "name")),
        disabled=frozenset(pair(a, b) for a, b in _all(root, "disable_collisions", "link1", "link2")),
        silent_links=frozenset(link for (link,) in _all(root, "disable_default_collisions", "link")),
        enabled=frozenset(pair(a, b) for a, b in _all(root, "enable_collisions", "link1", "link2")),
        spheres=spheres,
    )


def _group(element: Any) -> Group:
    (name,) = _texts(element, "name")
    return Group(
        name=name,
        chains=tuple((base, tip) for base, tip in _all(element, "chain", "base_link", "tip_link")),
        joints=tuple(joint for (joint,) in _all(element, "joint", "name")),
        links=tuple(link for (link,) in _all(element, "link", "name")),
        subgroups=tuple(subgroup for (subgroup,) in _all(element, "group", "name")),
    )


def _state(element: Any) -> GroupState:
    (name,), group = _texts(element, "name"), (element.get("group") or "").strip()
    values, joints = [], element.findall("joint")
    for joint in joints:
        (joint_name,) = _texts(joint, "name")
        numbers = _numbers(joint, "value")
        if len(numbers) == 1:  # a virtual joint has several, and is none of ours
            values.append((joint_name, numbers[0]))
    once = list(dict.fromkeys((joint.get("name"), joint.get("value")) for joint in joints))  # a line twice says the same
    _require_once(joints, [joint for joint, _ in once])
    return GroupState(name=name, group=group, values=tuple(dict.fromkeys(values)))


def _virtual_joint(element: Any) -> VirtualJoint:
    name, kind, child = _texts(element, "name", "type", "child_link")
    if kind not in _VIRTUAL:
        with _at(element):
            raise FileFormatError(f"<virtual_joint> '{name}' has type {shown(kind)}, which is none; {nearest(kind, _VIRTUAL)}")
    return VirtualJoint(name=name, kind=kind, child=child, parent=(element.get("parent_frame") or "").strip())


def _spheres(element: Any) -> tuple[str, tuple[tuple[float, ...], ...]]:
    (link,) = _texts(element, "link")
    spheres = []
    for sphere in element.findall("sphere"):
        center, radius = _numbers(sphere, "center", count=3), _numbers(sphere, "radius", count=1)
        if radius[0] < 0:
            with _at(sphere):
                raise FileFormatError(f"<sphere radius> of link '{link}' is {radius[0]:g}, expected 0 or more [m]")
        if radius[0] > 0:  # a radius of 0 says that there is none
            spheres.append((*center, radius[0]))
    return link, tuple(spheres)


def _all(parent: Any, tag: str, *attributes: str) -> Iterable[tuple[str, ...]]:
    for element in parent.findall(tag):
        yield _texts(element, *attributes)


def _texts(element: Any, *attributes: str) -> tuple[str, ...]:
    for attribute in attributes:
        if not (element.get(attribute) or "").strip():
            with _at(element):
                raise FileFormatError(f'<{element.tag}> has no {attribute}, expected <{element.tag} {attribute}="...">; add it')
        if xacro_left_in(element.get(attribute)):
            with _at(element):
                raise FileFormatError(
                    f"<{element.tag} {attribute}> is {shown(element.get(attribute))}, which xacro should have replaced; expand "
                    "the file first, as in: xacro arm.srdf.xacro > arm.srdf"
                )
    return tuple(element.get(attribute).strip() for attribute in attributes)


def _numbers(element: Any, attribute: str, *, count: int | None = None) -> list[float]:
    (text,) = _texts(element, attribute)
    numbers = numbers_in(text)
    if not numbers or (count is not None and len(numbers) != count):
        wanted = "finite numbers" if count is None else f"{count} finite number{'s' if count > 1 else ''}"
        with _at(element):
            raise FileFormatError(f"<{element.tag} {attribute}> is {shown(text)}, expected {wanted}")
    return numbers


def _require_once(elements: list[Any], names: list[str]) -> None:
    for i, name in enumerate(names):
        if name in names[:i]:
            with _at(elements[i]):
                raise FileFormatError(f"<{elements[i].tag}> '{name}' is there twice, expected once; remove one of them")


def _at(element: Any) -> Any:
    return located(f"line {element.sourceline}")


_LISTED = 5  # in one note


def require_same_robot(srdf: Srdf, tree: LinkTree) -> None:
    """Refuse an SRDF that names links, but none of the robot's.

    Raises:
        RobotError: it does.
    """
    named = [link for group in srdf.groups for link in (*group.links, *(end for chain in group.chains for end in chain))]
    named += sorted(_links_of_pairs(srdf))
    if named and set(named).isdisjoint(tree.links):
        raise RobotError(
            f"{srdf.source} names no link of robot '{tree.name}', which has no '{named[0]}'; {nearest(named[0], tree.links)}; "
            "give the SRDF of that robot"
        )


def what_does_not_fit(srdf: Srdf, tree: LinkTree) -> tuple[str, ...]:
    """Say in notes what an SRDF tells about links and joints that the robot does not have."""
    links, joints = set(tree.links), {joint.name for joint in tree.joints}
    joints |= {joint.name for joint in srdf.virtual_joints}
    unknown = _links_of_pairs(srdf) | {link for link, _ in srdf.spheres} | set(srdf.mounts)
    notes = list(_ignored("link", unknown - links, tree.links))
    stated = {name for state in srdf.states for name, _ in state.values} | set(srdf.passive_joints)
    notes += _ignored("joint", stated - joints, [joint.name for joint in tree.joints])
    return tuple(notes)


def _links_of_pairs(srdf: Srdf) -> set[str]:
    return {link for both in srdf.disabled | srdf.enabled for link in both} | set(srdf.silent_links)


def _ignored(what: str, unknown: Iterable[str], known: Iterable[str]) -> Iterable[str]:
    names = sorted(unknown)
    if names:
        listed = ", ".join(repr(name) for name in names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
        yield f"the SRDF names {what}s that the robot does not have and were ignored: {listed} ({nearest(names[0], known)})"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Members(Brief):
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
