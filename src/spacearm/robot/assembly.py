"""From a described tree of links to a Robot: what moves, what is held, which links must keep clear."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from spacearm.checks import shown
from spacearm.errors import RobotError
from spacearm.reading import located
from spacearm.robot.base import held_base, notes_on_base, rooted
from spacearm.robot.groups import Members, group_members
from spacearm.robot.held_joints import hold_joints, rest_value
from spacearm.robot.joint_limits_file import with_joint_limits_file
from spacearm.robot.left_out import notes_on_envelope
from spacearm.robot.limits import narrowed
from spacearm.robot.links import LinkTree, leader_of
from spacearm.robot.model import NamedConfiguration, Robot, require_base
from spacearm.robot.srdf import GroupState, Srdf, load_srdf
from spacearm.robot.srdf_fit import require_same_robot, what_does_not_fit
from spacearm.robot.tip import default_tip, ends_of
from spacearm.robot.tree import build_robot, require_tree

SelfCollision = Literal["auto", "srdf", "computed", "none"]
_FEW = 4  # joints that are all named
_SELF_COLLISION = ("auto", "srdf", "computed", "none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Assembly:
    """What a user chooses of a described robot; `load_robot` explains each."""

    srdf: str | os.PathLike[str] | None = None
    group: str | None = None
    fixed: Mapping[str, float] | None = None
    tip: str | None = None
    velocity_limit: Any = None
    acceleration_limit: Any = None
    position_limits: Mapping[str, Any] | None = None
    joint_limits: str | os.PathLike[str] | None = None
    self_collision: SelfCollision = "auto"
    base: Literal["fixed", "floating"] | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Origin:
    """What a robot was put together from, its `origin`.

    Attributes:
        tree: the description.
        choices: the user's.
        srdf: the SRDF that these name, as it was read; None if there is none.
        made: the robot, as it was before anyone changed it.
    """

    tree: LinkTree
    choices: Assembly
    srdf: Srdf | None
    made: Robot


def assemble(tree: LinkTree, choices: Assembly, *, srdf: Srdf | None = None) -> Robot:
    """Make a Robot of a tree; an SRDF that has been read already need not be read again.

    Raises:
        FileFormatError: an SRDF that is none.
        RobotError: a group, joint or link that is not there, or a robot that cannot be; the file is named.
    """
    _require_choices(choices)
    described, members = tree, None
    with located(tree.source):
        require_tree(tree)
        tree = rooted(tree, choices.base)
    if choices.joint_limits is not None:
        tree = with_joint_limits_file(tree, choices.joint_limits)
    if choices.srdf is not None:
        srdf = load_srdf(choices.srdf) if srdf is None else srdf
        require_same_robot(srdf, tree)
        tree = _with_spheres(replace(tree, notes=(*tree.notes, *srdf.notes)), srdf)
        if choices.group is not None:
            members = group_members(srdf, choices.group, tree)
    tree = held_base(tree, choices.base, srdf)
    with located(tree.source):
        tree = narrowed(tree, choices.position_limits)
        tree = hold_joints(tree, {} if choices.fixed is None else choices.fixed)
        tree = _hold_the_others(tree, choices.group, srdf, members)
    tree = _with_tip(tree, choices, srdf, members)
    with located(tree.source):
        limits = {"velocity_limit": choices.velocity_limit, "acceleration_limit": choices.acceleration_limit}
        robot = build_robot(tree, **limits)
    named, notes = _configurations(robot, tree, srdf, choices.group)
    robot = replace(
        robot,
        configurations=named,
        notes=(*robot.notes, *notes, *notes_on_base(robot), *notes_on_envelope(robot), *_note_on_tip(robot)),
    )
    if srdf is not None:
        robot = replace(robot, notes=(*robot.notes, *what_does_not_fit(srdf, tree)))
    robot = _with_self_pairs(robot, tree, srdf, choices.self_collision)
    return replace(robot, origin=Origin(tree=described, choices=choices, srdf=srdf, made=robot))


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
    if tree.tip is None and srdf is not None and len(ends_of(tree).links) > 1:
        mounts = set(srdf.mounts) & set(ends_of(tree).after)
        if len(mounts) == 1:
            (tip,) = mounts
            return replace(tree, tip=tip, notes=(*tree.notes, f"the tip is '{tip}', where the SRDF mounts the end effector"))
    if tree.tip is None and any(joint.kind in ("revolute", "continuous", "prismatic") for joint in tree.joints):
        with located(tree.source):
            return default_tip(tree)
    return tree


def _note_on_tip(robot: Robot) -> tuple[str, ...]:
    if robot.frame(robot.tip).joint >= 0:
        return ()
    return (f"no joint moves the tip '{robot.tip}': a goal of its pose cannot be planned; give tip= a link further on",)


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
            held[f"not in group '{group}'" if outside else "passive in the SRDF"][joint.name] = rest_value(joint, tree)
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


def _configurations(
    robot: Robot, tree: LinkTree, srdf: Srdf | None, group: str | None
) -> tuple[tuple[NamedConfiguration, ...], tuple[str, ...]]:
    """Collect the configurations: the chosen group's first, then those that name all joints, the robot file's own last.

    As in MoveIt, joints that a state does not name are at 0, or in the middle of their range where 0 is outside. A state that
    names none of the robot's joints is none of its configurations.
    """
    states = [] if srdf is None else [(state, _stated(state, robot, tree)) for state in srdf.states]
    states = [(state, values) for state, values in states if values]
    states.sort(key=lambda one: (one[0].group != group, len(one[1]) < robot.dof))
    found: dict[str, NamedConfiguration] = {}
    notes, twice = [], []
    for state, values in states:
        if state.name in found:
            if state.group == group or group is None:
                twice.append(f"'{state.name}' of group '{state.group}'")
            continue
        assumed = {name: default_value(robot, i) for i, name in enumerate(robot.dof_names) if name not in values}
        found[state.name] = NamedConfiguration(name=state.name, q=np.array([{**values, **assumed}[n] for n in robot.dof_names]))
        if assumed:
            notes.append(f"'{state.name}' leaves out {_placed_by_default(assumed)}")
    for name, stated in tree.configurations:
        if name not in found and all(dof in dict(stated) for dof in robot.dof_names):
            found[name] = NamedConfiguration(name=name, q=np.array([dict(stated)[dof] for dof in robot.dof_names]))
    said = [f"states of the SRDF do not name every joint: {'; '.join(notes)}"] if notes else []
    if twice:
        said.append(f"states of the SRDF that bear the name of another one are left out: {', '.join(twice)}")
    return tuple(found.values()), tuple(said)


def _placed_by_default(assumed: dict[str, float]) -> str:
    """Name joints that a state leaves out, and where they are; of many only those that are not at 0."""
    said = [f"{name} (at {value:g})" for name, value in assumed.items() if value != 0.0 or len(assumed) <= _FEW]
    if len(assumed) <= _FEW:
        return ", ".join(said)
    return f"{len(assumed)} joints (at 0{', but for ' if said else ''}{', '.join(said)})"


def _stated(state: GroupState, robot: Robot, tree: LinkTree) -> dict[str, float]:
    """Return the values that a state gives degrees of freedom, of which it may name a joint that follows another."""
    joints = {joint.name: joint for joint in tree.joints if joint.kind != "fixed"}
    values: dict[str, float] = {}
    for name, value in sorted(state.values, key=lambda one: one[0] not in robot.dof_names):
        if name in joints:
            lead = leader_of(joints[name], tree)
            if lead.multiplier != 0.0:
                values.setdefault(lead.leader, (value - lead.offset) / lead.multiplier)
    return values


def default_value(robot: Robot, dof: int) -> float:
    """Return where MoveIt has a joint that nobody places: at 0, or in the middle of a range that 0 is not in [rad or m]."""
    lower, upper = float(robot.lower[dof]), float(robot.upper[dof])
    if lower <= 0 <= upper:
        return 0.0
    return (lower + upper) / 2 if np.isfinite(upper - lower) else min(max(lower, 0.0), upper)


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
