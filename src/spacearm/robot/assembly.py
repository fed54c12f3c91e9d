"""From a described tree of links to a Robot: joints that move or are locked, the tip, the links that must keep clear.

`assemble` does that once for what a user chooses; `locked_elsewhere` does it again with joints locked at other values. A locked
joint is folded away, as if the file had fixed it there.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import as_number, shown, value_fields
from spacearm.core.errors import RobotError, nearest
from spacearm.core.exact import product, sines
from spacearm.core.reading import located
from spacearm.geometry.shapes import ConvexShape, Polytope, Sphere
from spacearm.robot.build_robot import build_robot, choose_base, notes_on_base, require_tree, rooted, turned_onto_z
from spacearm.robot.joint_limits import narrowed, with_joint_limits_file
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.link_tree import LinkJoint, LinkTree, Mimic, default_tip, ends_of, leader_of
from spacearm.robot.model import NamedConfiguration, Robot, require_base
from spacearm.robot.srdf import GroupState, Members, Srdf, group_members, load_srdf, require_same_robot, what_does_not_fit
from spacearm.robot.unchecked_pairs import notes_on_envelope

Array = NDArray[np.float64]

SelfCollision = Literal["auto", "srdf", "computed", "none"]

_SELF_COLLISION = ("auto", "srdf", "computed", "none")
_MOVING = ("revolute", "continuous", "prismatic")
_SHAPES = ("joints", "shapes", "frames", "bodies")  # what a change of which cannot be repeated with joints elsewhere

_ROUNDING = 1e-6  # [rad or m] limits and locked values are often rounded, each in a file of its own
_FEW = 4  # joints that are all named


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Assembly(Brief):
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Origin(Brief):
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
    tree = choose_base(tree, choices.base, srdf)
    with located(tree.source):
        tree = narrowed(tree, choices.position_limits)
        tree = lock_joints(tree, {} if choices.fixed is None else choices.fixed)
        tree = _lock_the_others(tree, choices.group, srdf, members)
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
    enclosed = {link for link, _ in tree.shapes}
    taken, shapes = [], list(tree.shapes)
    for link, spheres in srdf.spheres:
        if tree.with_envelope and link in tree.links and link not in enclosed and spheres:
            taken.append(link)
            shapes += [(link, _ball(sphere)) for sphere in spheres]
    if not taken:
        return tree
    note = f"the envelope of {', '.join(taken)} is the SRDF's sphere approximation, since the file gives none"
    return replace(tree, shapes=tuple(shapes), notes=(*tree.notes, note))


def _ball(sphere: Sequence[float]) -> ConvexShape:
    *center, radius = sphere
    return Sphere(center, radius) if radius > 0 else Polytope([center])


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


def _lock_the_others(tree: LinkTree, group: str | None, srdf: Srdf | None, members: Members | None) -> LinkTree:
    """Lock the joints that are not in the group, and follow none that is, and those that have no motor."""
    passive = () if srdf is None else srdf.passive_joints
    locked: dict[str, dict[str, float]] = {f"not in group '{group}'": {}, "passive in the SRDF": {}}
    rigid = []
    for joint in tree.joints:
        outside = members is not None and joint.name not in members.joints
        if joint.kind == "fixed" or not (outside or joint.name in passive):
            continue
        if joint.kind in ("floating", "planar"):
            rigid.append(joint.name)
        elif leader_of(joint, tree).leader == joint.name:
            locked[f"not in group '{group}'" if outside else "passive in the SRDF"][joint.name] = rest_value(joint, tree)
    notes = list(tree.notes)
    for why, values in locked.items():
        said = [f"{name} at {value:g}" for name, value in values.items()]
        if said:
            notes.append(f"{why} and therefore locked: {', '.join(said)}; give fixed= to lock them elsewhere")
        tree = lock_joints(tree, values)
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
    links = {part.name for part in robot.shapes}
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


def lock_joints(tree: LinkTree, values: Mapping[str, float]) -> LinkTree:
    """Fix joints at given values; those that mimic one of them are fixed with it.

    Args:
        tree: links and joints.
        values: [rad or m] by joint. A joint that mimics another sets that one, too; a joint that the file has
            fixed already stays as it is, which a note tells.

    Raises:
        RobotError: no such joint, a value out of its limits, or two that contradict each other.
    """
    locked = _by_leader(tree, values)
    joints, notes, useless = [], list(tree.notes), []
    for joint in tree.joints:
        if joint.kind == "fixed":
            if joint.name in values:
                useless.append(joint.name)
        elif joint.kind not in ("floating", "planar"):
            lead = leader_of(joint, tree)
            if lead.leader in locked:
                joint = _fixed(joint, lead.multiplier * locked[lead.leader] + lead.offset)
        joints.append(joint)
    if useless:
        notes.append(f"fixed= names {', '.join(useless)}, which the file itself has fixed: it stays where it is there")
    if locked:
        notes.append("locked: " + ", ".join(f"{name} at {value:g}" for name, value in locked.items()))
    return replace(tree, joints=tuple(joints), notes=tuple(notes))


def _by_leader(tree: LinkTree, values: Mapping[str, float]) -> dict[str, float]:
    """Turn the values given into those of the joints that lead."""
    if not isinstance(values, Mapping):
        raise RobotError(f"fixed is {shown(values)}, expected a mapping from joint to value, as in {{'finger': 0.02}}")
    joints = {joint.name: joint for joint in tree.joints}
    locked: dict[str, float] = {}
    said: dict[str, str] = {}
    for name, given in values.items():
        if name not in joints:
            raise RobotError(f"fixed names joint {shown(name)}, which does not exist; {nearest(str(name), joints)}")
        joint = joints[name]
        value = as_number(f"fixed['{name}']", given, RobotError, unit="m" if joint.kind == "prismatic" else "rad")
        if joint.kind == "fixed":
            continue
        if joint.kind in ("floating", "planar"):
            raise RobotError(f"fixed names joint '{name}', which is {joint.kind} and has no single value; leave it out")
        lead = leader_of(joint, tree)
        _require_within(joint, value, f"fixed['{name}']")
        if lead.multiplier == 0.0:
            continue  # it does not move, and _require_within has seen its value
        value = (value - lead.offset) / lead.multiplier
        if abs(locked.setdefault(lead.leader, value) - value) > _ROUNDING:
            raise RobotError(
                f"fixed puts joint '{lead.leader}' at {locked[lead.leader]:g} by '{said[lead.leader]}' and at {value:g} by "
                f"'{name}', which move together; drop one of them"
            )
        said.setdefault(lead.leader, name)
    for joint in tree.joints:
        if joint.kind in ("revolute", "prismatic", "continuous"):
            lead = leader_of(joint, tree)
            if lead.leader in locked:
                _require_within(joint, lead.multiplier * locked[lead.leader] + lead.offset, f"joint '{joint.name}'")
    return locked


def rest_value(joint: LinkJoint, tree: LinkTree) -> float:
    """Return the value nearest to 0 that a joint may have, and those that follow it with it [rad or m]."""
    low, high = -math.inf, math.inf
    for other in tree.joints:
        if other.kind not in ("revolute", "prismatic") or other.lower is None or other.upper is None:
            continue
        lead = leader_of(other, tree)
        if lead.leader == joint.name and lead.multiplier != 0.0:
            ends = sorted((end - lead.offset) / lead.multiplier for end in (other.lower, other.upper))
            low, high = max(low, ends[0]), min(high, ends[1])
    return min(max(0.0, low), max(high, low))


def _require_within(joint: LinkJoint, value: float, what: str) -> None:
    if joint.kind == "continuous" or joint.lower is None or joint.upper is None or joint.upper < joint.lower:
        return
    if not joint.lower - _ROUNDING <= value <= joint.upper + _ROUNDING:
        raise RobotError(
            f"{what} is {value:g}, expected {joint.lower:g} to {joint.upper:g}, its limits; change the value or the limits"
        )


def _fixed(joint: LinkJoint, value: float) -> LinkJoint:
    return replace(
        joint, kind="fixed", axis=None, mimic=None, T_parent_child=product(joint.T_parent_child, moved(joint, value))
    )


def moved(joint: LinkJoint, value: Any) -> Array:
    """Return the transform (4, 4) of a joint's child at a value, in the child's frame at value 0."""
    T_child_axis = turned_onto_z(joint.name, joint.axis if joint.axis is not None else (0, 0, 0))
    T = np.eye(4)
    if joint.kind == "prismatic":
        T[2, 3] = value
    else:
        s, c = (float(part) for part in sines(value))
        T[:2, :2] = [[c, -s], [s, c]]
    return product(product(T_child_axis, T), T_child_axis.T)  # a pure rotation: its transpose is its inverse


def locked_leaders(robot: Robot) -> dict[str, Mimic]:
    """Name the joints of the file that are locked, by the joint that leads each; none of a robot without a file."""
    origin: Origin | None = robot.origin
    if origin is None:
        return {}
    plans_for = {joint.name for joint in robot.joints}
    return {
        joint.name: leader_of(joint, origin.tree)
        for joint in origin.tree.joints
        if joint.kind in _MOVING and joint.name not in plans_for
    }


def joint_limits_in_file(robot: Robot, name: str) -> tuple[float | None, float | None]:
    """Return a joint's limits as its file states them [rad or m]; None where it states none."""
    joint = next(joint for joint in robot.origin.tree.joints if joint.name == name)
    return (None, None) if joint.kind == "continuous" else (joint.lower, joint.upper)


def locked_values(robot: Robot) -> dict[str, float]:
    """Return where joints of the file are locked, by the names of those that lead others or none [rad or m]."""
    leaders = {lead.leader for lead in locked_leaders(robot).values()}
    values = _fixed_by_user(robot.origin) if leaders else {}
    return {
        joint.name: values.get(joint.name, rest_value(joint, robot.origin.tree))
        for joint in (robot.origin.tree.joints if leaders else ())
        if joint.name in leaders
    }


def _fixed_by_user(origin: Origin) -> dict[str, float]:
    joints = {joint.name: joint for joint in origin.tree.joints}
    values = {}
    for name, value in (origin.choices.fixed or {}).items():
        if joints[name].kind in _MOVING:
            lead = leader_of(joints[name], origin.tree)
            values[lead.leader] = (float(value) - lead.offset) / (lead.multiplier or 1.0)
    return values


def locked_elsewhere(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return the robot with locked joints at other values, as if it had been loaded with `fixed` so.

    The values need not be within the joints' limits: a joint that does not move breaks none. What was changed since the
    robot was loaded (limits, tip, configurations, pairs of links) stays changed.

    Args:
        robot: read from a file.
        values: [rad or m] by the names of joints that lead others or none, of `locked_leaders`.

    Raises:
        RobotError: the robot's shape was changed since it was loaded, as by `hold`.
    """
    origin: Origin = robot.origin
    if any(getattr(robot, name) != getattr(origin.made, name) for name in _SHAPES):
        said = ", ".join(f"'{name}': {value:g}" for name, value in values.items())
        raise RobotError(
            f"robot '{robot.name}' has been changed since it was loaded, as by hold(), and its locked joints are to stand "
            f"elsewhere; give load_robot fixed={{{said}}} and change it then"
        )
    fixed = {**(origin.choices.fixed or {}), **values}
    tree = _without_limits(origin.tree, values)
    made = assemble(tree, replace(origin.choices, fixed=_leading(fixed, values, tree)), srdf=origin.srdf)
    own: dict[str, Any] = {
        name: getattr(robot, name)
        for name in value_fields(robot)
        if name not in (*_SHAPES, "notes") and not np.array_equal(getattr(origin.made, name), getattr(robot, name))
    }
    notes = [note for note in robot.notes if note not in origin.made.notes]
    made_so = replace(made, origin=replace(made.origin, tree=origin.tree))
    return replace(made_so, **own, notes=(*made.notes, *notes))


def _leading(fixed: Mapping[str, float], values: Mapping[str, float], tree: LinkTree) -> dict[str, float]:
    """Leave out what the user said of joints that follow one of those given: these come from the one that leads."""
    followers = {
        joint.name
        for joint in tree.joints
        if joint.kind in _MOVING and joint.name not in values and leader_of(joint, tree).leader in values
    }
    return {name: value for name, value in fixed.items() if name not in followers}


def _without_limits(tree: LinkTree, values: Mapping[str, float]) -> LinkTree:
    def freed(joint: LinkJoint) -> LinkJoint:
        moves = joint.kind in _MOVING
        locked = moves and leader_of(joint, tree).leader in values
        return replace(joint, lower=None, upper=None) if locked else joint

    return replace(tree, joints=tuple(freed(joint) for joint in tree.joints))


def frame_poses(robot: Robot, values: Mapping[str, float]) -> dict[str, Array]:
    """Return where every frame of the robot is, (4, 4) T_base_frame [m], with its joints at given values.

    Locked joints stand there, too, if they are given a value; else where they are locked.

    Args:
        robot: the robot.
        values: [rad or m] by joint; of a joint that follows another, that one's counts. Joints without one are at 0, or
            the nearest to it that their limits allow.
    """
    rest = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
    q = np.array([values.get(name, at) for name, at in zip(robot.dof_names, rest, strict=True)])
    joints = base_and_joint_frames(robot, q[None])[0]
    poses = {frame.name: joints[frame.joint + 1] @ frame.T_joint_frame for frame in robot.frames}
    locked = {name: lead for name, lead in locked_leaders(robot).items() if lead.leader in values}
    return poses if not locked else {**poses, **_tree_poses(robot, {**dict(zip(robot.dof_names, q, strict=True)), **values})}


def _tree_poses(robot: Robot, values: Mapping[str, float]) -> dict[str, Array]:
    """Walk the file's own links, by its own joints."""
    origin: Origin = robot.origin
    tree, ordered, fixed = origin.tree, require_tree(origin.tree), _fixed_by_user(origin)
    children = {joint.child for joint in ordered}
    poses = {link: np.eye(4) for link in tree.links if link not in children}
    by_name = {joint.name: joint for joint in tree.joints}
    for joint in ordered:
        T = np.asarray(joint.T_parent_child)
        if joint.kind in _MOVING:
            lead = leader_of(joint, tree)
            at = values.get(lead.leader, fixed.get(lead.leader, rest_value(by_name[lead.leader], tree)))
            T = T @ moved(joint, lead.multiplier * float(at) + lead.offset)
        poses[joint.child] = poses[joint.parent] @ T
    return poses
