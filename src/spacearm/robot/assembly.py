"""From a described tree of links to a Robot: what moves, what is held, which links must keep clear."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from spacearm.checks import shown
from spacearm.errors import RobotError
from spacearm.reading import located
from spacearm.robot.base import held_base, notes_on_base
from spacearm.robot.groups import Members, group_members
from spacearm.robot.held_joints import hold_joints, rest_value
from spacearm.robot.left_out import notes_on_envelope
from spacearm.robot.links import LinkTree, leader_of
from spacearm.robot.model import NamedConfiguration, Robot, require_base
from spacearm.robot.srdf import Srdf, load_srdf
from spacearm.robot.srdf_fit import require_same_robot, what_does_not_fit
from spacearm.robot.tree import build_robot, ends_of, require_tree

SelfCollision = Literal["auto", "srdf", "computed", "none"]
_SELF_COLLISION = ("auto", "srdf", "computed", "none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Assembly:
    """What a user chooses of a described robot; `load_robot` explains each."""

    srdf: str | os.PathLike[str] | None = None
    group: str | None = None
    fixed: Mapping[str, float] | None = None
    tip: str | None = None
    velocity_limit: float | None = None
    acceleration_limit: float | None = None
    self_collision: SelfCollision = "auto"
    base: Literal["fixed", "floating"] | None = None


def assemble(tree: LinkTree, choices: Assembly) -> Robot:
    """Make a Robot of a tree.

    Raises:
        FileFormatError: an SRDF that is none.
        RobotError: a group, joint or link that is not there, or a robot that cannot be; the file is named.
    """
    _require_choices(choices)
    with located(tree.source):
        require_tree(tree)
    srdf = members = None
    if choices.srdf is not None:
        srdf = load_srdf(choices.srdf)
        require_same_robot(srdf, tree)
        tree = _with_spheres(tree, srdf)
        if choices.group is not None:
            members = group_members(srdf, choices.group, tree)
    tree = _with_tip(tree, choices, srdf, members)
    tree = held_base(tree, choices.base, srdf, choices.group)
    with located(tree.source):
        tree = hold_joints(tree, {} if choices.fixed is None else choices.fixed)
        tree = _hold_the_others(tree, choices.group, srdf, members)
        limits = {"velocity_limit": choices.velocity_limit, "acceleration_limit": choices.acceleration_limit}
        robot = build_robot(tree, **limits)
    named = _configurations(robot, tree, srdf, choices.group)
    robot = replace(robot, configurations=named, notes=(*robot.notes, *notes_on_base(robot), *notes_on_envelope(robot)))
    if srdf is not None:
        robot = replace(robot, notes=(*robot.notes, *what_does_not_fit(srdf, tree)))
    return _with_self_pairs(robot, tree, srdf, choices.self_collision)


def _require_choices(choices: Assembly) -> None:
    if choices.self_collision not in _SELF_COLLISION:
        known = ", ".join(map(repr, _SELF_COLLISION))
        raise RobotError(f"self_collision is {shown(choices.self_collision)}, expected one of {known}")
    if choices.base is not None:
        require_base(choices.base)
    if choices.srdf is None and choices.group is not None:
        raise RobotError(f"group is {shown(choices.group)}, but no SRDF says what that is; give srdf= as well, or leave it out")
    if choices.srdf is None and choices.self_collision == "srdf":
        raise RobotError("self_collision is 'srdf', but there is no SRDF; give srdf=, or self_collision='computed'")


def _with_spheres(tree: LinkTree, srdf: Srdf) -> LinkTree:
    """Take the SRDF's spheres for the links that have no envelope."""
    enclosed = {link for link, *_ in tree.capsules}
    taken, capsules = [], list(tree.capsules)
    for link, spheres in srdf.spheres:
        if tree.with_envelope and link in tree.links and link not in enclosed and spheres:
            taken.append(link)
            capsules += [(link, np.array(sphere[:3]), np.array(sphere[:3]), sphere[3]) for sphere in spheres]
    if not taken:
        return tree
    note = f"the envelope of {', '.join(taken)} is the SRDF's sphere approximation, since the file gives none"
    return replace(tree, capsules=tuple(capsules), notes=(*tree.notes, note))


def _with_tip(tree: LinkTree, choices: Assembly, srdf: Srdf | None, members: Members | None) -> LinkTree:
    if choices.tip is not None:
        return replace(tree, tip=choices.tip)
    if members is not None:
        if len(members.tips) != 1:
            raise RobotError(
                f"group '{choices.group}' has {len(members.tips)} chains, ending in "
                f"{', '.join(map(repr, members.tips[:12]))}; name the end effector, as in tip='{members.tips[-1]}'"
            )
        return replace(tree, tip=members.tips[0])
    if tree.tip is None and srdf is not None and len(ends_of(tree)) > 1:
        mounts = set(srdf.mounts) & set(tree.links)
        if len(mounts) == 1:
            (tip,) = mounts
            return replace(tree, tip=tip, notes=(*tree.notes, f"the tip is '{tip}', where the SRDF mounts the end effector"))
    return tree


def _hold_the_others(tree: LinkTree, group: str | None, srdf: Srdf | None, members: Members | None) -> LinkTree:
    """Hold the joints that are not in the group, and follow none that is, and those that have no motor."""
    passive = () if srdf is None else srdf.passive_joints
    held: dict[str, dict[str, float]] = {f"not in group '{group}'": {}, "passive in the SRDF": {}}
    rigid = []
    for joint in tree.joints:
        outside = members is not None and joint.name not in members.joints
        if joint.kind == "fixed" or not (outside or joint.name in passive):
            continue
        if joint.kind in ("floating", "planar"):
            rigid.append(joint.name)
        elif leader_of(joint, tree).leader == joint.name:
            held[f"not in group '{group}'" if outside else "passive in the SRDF"][joint.name] = rest_value(joint)
    notes = list(tree.notes)
    for why, values in held.items():
        said = [f"{name} at {value:g}" for name, value in values.items()]
        if said:
            notes.append(f"{why} and therefore held: {', '.join(said)}; give fixed= to hold them elsewhere")
        tree = hold_joints(tree, values)
    if rigid:
        notes.append(f"{', '.join(rigid)} can float or slide in a plane, and stays where the file has it")
    joints = tuple(replace(joint, kind="fixed", axis=None) if joint.name in rigid else joint for joint in tree.joints)
    return replace(tree, joints=joints, notes=tuple(notes))


def _configurations(robot: Robot, tree: LinkTree, srdf: Srdf | None, group: str | None) -> tuple[NamedConfiguration, ...]:
    """Keep those that give every degree of freedom a value; the chosen group's come first, the robot file's own last."""
    states = () if srdf is None else sorted(srdf.states, key=lambda state: state.group != group)
    found: dict[str, NamedConfiguration] = {}
    for name, stated in (*((state.name, state.values) for state in states), *tree.configurations):
        values = dict(stated)
        if name not in found and all(dof in values for dof in robot.dof_names):
            found[name] = NamedConfiguration(name=name, q=np.array([values[dof] for dof in robot.dof_names]))
    return tuple(found.values())


def _with_self_pairs(robot: Robot, tree: LinkTree, srdf: Srdf | None, choice: SelfCollision) -> Robot:
    links = {capsule.name for capsule in robot.capsules}
    if choice == "auto" and srdf is None and not isinstance(tree.self_collision, str):
        pairs = tuple(pair for pair in tree.self_collision if links.issuperset(pair))
        return replace(robot, self_pairs=pairs)
    if choice == "auto":
        choice = "srdf" if srdf is not None else "computed" if tree.self_collision == "computed" else "none"
    if choice == "none" or len(links) < 2:
        return robot
    from spacearm.robot.self_collision import find_self_pairs, with_allowed_pairs

    if choice == "srdf" and srdf is not None:
        return with_allowed_pairs(robot, srdf.may_touch, by="the SRDF")
    found = find_self_pairs(robot)
    robot = found.applied_to(robot)
    return replace(robot, notes=(*robot.notes, *found.notes))
