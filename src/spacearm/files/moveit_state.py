"""Where the robot is (`moveit_msgs/RobotState`): all its joints, its base, and what is attached to its links.

An attached object (`moveit_msgs/AttachedCollisionObject`) becomes a part of the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import nearest
from spacearm.dynamics.payload import hold
from spacearm.files.moveit_scene import APPEND, MOVE, REMOVE, Body, Frames, body_of, root_joints
from spacearm.files.moveit_shapes import named
from spacearm.geometry import HalfSpace, Obstacle
from spacearm.geometry.solid_moments import solid_moments
from spacearm.robot.assembly import joint_limits_in_file, locked_elsewhere, locked_leaders, locked_values
from spacearm.robot.model import Frame, Robot

if TYPE_CHECKING:
    from spacearm.files.moveit_messages import (
        AttachedCollisionObject,
        JointState,
        Message,
        MultiDOFJointState,
        RobotState,
        Twist,
    )


Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class AttachedObject:
    """An object in the hand.

    Attributes:
        part: where it is stated.
        link: that it is attached to.
        body: its shapes; T is T_link_object.
        touching: names of links that it may touch.
        mass: its weight as stated, which is a mass [kg]; 0 if it states none.
    """

    part: AttachedCollisionObject
    link: str
    body: Body
    touching: tuple[str, ...]
    mass: float = 0.0


def attached_by(
    items: Sequence[AttachedCollisionObject],
    attached: Mapping[str, AttachedObject],
    world: dict[str, Body],
    frames: Frames,
    robot: Robot,
    *,
    mesh_excess: float | None = None,
) -> dict[str, AttachedObject]:
    """Apply what a state attaches and takes off, one by one.

    Args:
        items: the state's `attached_collision_objects`.
        attached: what is attached before, by id.
        world: the world's objects; one of them that comes to be attached is taken out.
        frames: in the state that attaches them; those of what is attached are put in.
        robot: that they are attached to.
        mesh_excess: how far the pieces of a mesh may stand out of it [m].

    Raises:
        FileFormatError, SceneError: what is wrong, with file and line.
    """
    now = dict(attached)
    for item in items:
        thing, operation, name = item.object, item.object.operation, item.object.id or ""
        if operation == MOVE:
            raise thing.error(f"attached object {shown(name)} is to be moved, which MoveIt does not do; attach it where it is")
        if operation == REMOVE:
            gone = [key for key, one in now.items() if name in ("", key) and (item.link_name or "") in ("", one.link)]
            now = {key: one for key, one in now.items() if key not in gone}
            continue
        one = _attached_object(item, name or "held", world, frames, robot, mesh_excess)
        if operation == APPEND and name in now:
            one = _both(now[name], one)
        now[name or "held"] = one
        for frame, T in one.body.frames().items():
            frames.attached[frame] = frames.links[one.link] @ T
    return now


def _both(before: AttachedObject, more: AttachedObject) -> AttachedObject:
    if before.link != more.link:
        raise more.part.error(
            f"object '{more.body.name}' is attached to '{before.link}' and to '{more.link}', expected one link"
        )
    T = np.linalg.inv(before.body.T) @ more.body.T
    shapes = tuple(replace(shape, T=T @ shape.T) for shape in more.body.shapes)
    body = replace(
        before.body, shapes=(*before.body.shapes, *shapes), subframes={**before.body.subframes, **more.body.subframes}
    )
    return replace(before, body=body, touching=(*before.touching, *more.touching), mass=max(before.mass, more.mass))


def _attached_object(
    item: AttachedCollisionObject,
    name: str,
    world: dict[str, Body],
    frames: Frames,
    robot: Robot,
    mesh_excess: float | None,
) -> AttachedObject:
    thing = item.object
    if item.link_name is None:
        raise item.error(f"key 'link_name' is missing in {item.called}; add it")
    link = item.link_name.lstrip("/")
    if link not in frames.links:
        raise item.error(f"robot '{robot.name}' has no link {shown(link)}; {nearest(link, frames.links)}", "link_name")
    T_link_w = np.linalg.inv(frames.links[link])
    if thing.has_shapes:
        if not thing.frame:
            frames.say(f"'{name}', attached to '{link}', has no frame: its pose is taken in the planning frame, as in MoveIt")
        # A pose in the link's own frame comes out exactly, wherever the link is.
        around = replace(frames, links={**frames.links, link: np.eye(4)}, moving=frozenset())
        own = thing.frame == link
        body = body_of(thing, name, around if own else frames, mesh_excess)
        body = body if own else replace(body, T=T_link_w @ body.T)
    elif name in world:
        body = replace(world[name], T=T_link_w @ world[name].T)
    else:
        raise thing.error(
            f"attached object {shown(name)} has no shape and is none of the world's, expected primitives or meshes; add them"
        )
    if world.pop(name, None) is not None:
        frames.say(f"'{name}' is attached to '{link}': that it is in the world as well is left out")
        for frame in [key for key in frames.objects if key == name or key.startswith(f"{name}/")]:
            del frames.objects[frame]
    return AttachedObject(part=item, link=link, body=body, touching=(link, *item.touch_links), mass=item.weight)


def with_attached(
    robot: Robot, attached: Sequence[AttachedObject], may_touch: Callable[[str, str], bool] | None, notes: list[str]
) -> Robot:
    """Return the robot with objects attached to its links, each a frame of the object's id, with its subframes.

    Args:
        robot: the robot.
        attached: the objects.
        may_touch: whether the scene's matrix lets an object and a link touch; None: it is not asked.
        notes: gets sentences on what is left out.

    Raises:
        RobotError: what cannot be a payload, a name that is taken; file and line are named.
    """
    for one in attached:
        robot = one.part.located(lambda one=one, robot=robot: _with_one_attached(robot, one, may_touch, notes))
    return robot


def _with_one_attached(
    robot: Robot, one: AttachedObject, may_touch: Callable[[str, str], bool] | None, notes: list[str]
) -> Robot:
    name, links = one.body.name, {frame.name for frame in robot.frames}
    strange = [link for link in dict.fromkeys(one.touching) if link not in links]
    if strange:
        notes.append(f"'{name}' may touch {', '.join(strange)}, which robot '{robot.name}' does not have")
    touching = [link for link in links if link in one.touching or (may_touch is not None and may_touch(name, link))]
    if one.part.detach_posture.points:
        notes.append(f"the detach_posture of '{name}' is left out: nothing lets go of it")
    labels = [named(name, i, len(one.body.shapes)) for i in range(len(one.body.shapes))]
    obstacles = [
        shape.part.located(lambda shape=shape, label=label: shape.made.make(shape.T, label))
        for shape, label in zip(one.body.shapes, labels, strict=True)
    ]
    masses = _masses_of(one, obstacles, notes)
    for obstacle, label, mass in zip(obstacles, labels, masses, strict=True):
        robot = hold(robot, obstacle, frame=one.link, pose=one.body.T, touching=touching, name=label, mass=mass)
    return _with_frames(robot, one)


def _masses_of(one: AttachedObject, obstacles: Sequence[Obstacle], notes: list[str]) -> list[float | None]:
    """Return the mass of each shape of an object [kg]: its weight, spread evenly over their volumes; None if it has none."""
    name, held = one.body.name, [obstacle for obstacle in obstacles if not isinstance(obstacle, HalfSpace)]
    if not one.mass > 0 or len(held) < len(obstacles):  # what has no end is refused by `hold`
        if one.mass:
            notes.append(f"the weight of '{name}', {one.mass:g} kg, is left out: a mass is above 0")
        return [None] * len(obstacles)
    if len(held) == 1:
        notes.append(f"the weight of '{name}', {one.mass:g} kg, is taken for a mass that fills its shape evenly")
        return [one.mass]
    volumes = [solid_moments(obstacle).volume for obstacle in held]
    if not min(volumes) > 0:
        notes.append(
            f"the weight of '{name}', {one.mass:g} kg, is left out: one of its {len(held)} shapes is flat, and nothing says "
            "how it is spread over them; it would matter if the base floated"
        )
        return [None] * len(held)
    notes.append(f"the weight of '{name}', {one.mass:g} kg, is taken for a mass that fills its {len(held)} shapes evenly")
    return [one.mass * volume / sum(volumes) for volume in volumes]


def _with_frames(robot: Robot, one: AttachedObject) -> Robot:
    """Put the object's own frame where MoveIt has it, which need not be the middle of its shape, and add its subframes."""
    holder = robot.frame(one.link)
    places = {name: holder.T_joint_frame @ T for name, T in one.body.frames().items()}
    frames = tuple(
        Frame(name=name, joint=holder.joint, T_joint_frame=T, parent=one.link if name == one.body.name else one.body.name)
        for name, T in places.items()
    )
    return replace(robot, frames=(*(frame for frame in robot.frames if frame.name not in places), *frames))


_SAME = 1e-9  # [rad, m and -]
_ROUNDING = 1e-6  # [rad or m] joints that follow others are written rounded
_RESTS = 1e-9  # [rad/s or m/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """What a message says of the robot.

    Attributes:
        part: where; None where there is no message.
        joints: values by joint, as stated [rad or m].
        base: (4, 4) T_w_base [m]; None if it says nothing.
        attached: what it attaches to links, or takes off them.
        is_diff: whether it only adds to the state before it.
    """

    part: RobotState | None = None
    joints: Mapping[str, float] = field(default_factory=dict)
    base: Array | None = None
    attached: tuple[AttachedCollisionObject, ...] = ()
    is_diff: bool = False


def read_state(part: RobotState | None, robot: Robot, notes: list[str], *, what: str) -> State:
    """Read a robot state.

    Args:
        part: `start_state` or `robot_state`; None: there is none.
        robot: whose state it is.
        notes: gets sentences on what is left out.
        what: its name, for them.

    Raises:
        FileFormatError, SceneError: something in it that is none, or that cannot be taken into account.
    """
    if part is None:
        return State()
    joints = part.joint_state
    if joints is not None:
        for key, so in (("velocity", ": the motion starts at rest"), ("effort", "")):
            if _moves(getattr(joints, key)):
                notes.append(f"{what} has joints with a {key}, which is left out{so}")
    return State(
        part=part,
        joints={} if joints is None else _values(joints),
        base=_base(part.multi_dof_joint_state, robot, notes, what),
        attached=tuple(part.attached_collision_objects),
        is_diff=bool(part.is_diff),
    )


def _moves(row: Any) -> bool:
    return isinstance(row, list) and any(isinstance(v, (int, float)) and not abs(v) <= _RESTS for v in row)


def _values(joints: JointState) -> dict[str, float]:
    names, positions = joints.name, joints.position
    if len(names) != len(positions):
        raise joints.error(f"joint_state has {len(names)} names and {len(positions)} positions, expected one for each")
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise joints.error(f"joint_state names joint {shown(twice)} twice, expected each joint once; remove one")
    return dict(zip(names, (value + 0.0 for value in positions), strict=True))


def _base(part: MultiDOFJointState | None, robot: Robot, notes: list[str], what: str) -> Array | None:
    """Return T_w_base (4, 4) by the joint that holds the robot's root in the world, or None."""
    if part is None:
        return None
    names, places = part.joint_names, part.transforms
    if names and len(names) != len(places):
        raise part.error(f"{part.called} has {len(names)} joint_names and {len(places)} transforms, expected one for each")
    if any(_turns(item) for item in part.twist):
        notes.append(f"{what} has a base that moves, which is left out: it starts at rest")
    known, found = root_joints(robot), None
    for name, item in zip(names or [""] * len(places), places, strict=True):
        T = item.matrix()
        if np.abs(T - np.eye(4)).max() <= _SAME:
            found = np.eye(4) if name in known or not known or not name else found
            continue
        if known and name and name not in known:
            raise item.error(
                f"{part.called} moves joint {shown(name)}, which does not hold the robot's root; {nearest(name, known)}"
            )
        if known and set(known.values()) == {"fixed"}:
            raise item.error(f"{part.called} moves the base, which the SRDF fixes by joint '{name}'; correct one of them")
        if found is not None:
            raise item.error(f"{part.called} moves {len(places)} joints, expected one, which holds the robot's root")
        _require_in_planning_frame(part, robot)
        found = T
        at = ", ".join(f"{value:g}" for value in T[:3, 3])
        notes.append(f"{what} has the robot's base at ({at}) m in the planning frame: that is base_start")
    return found


def _turns(item: Twist) -> bool:
    return max(map(abs, (*item.linear, *item.angular))) > _RESTS


def _require_in_planning_frame(part: MultiDOFJointState, robot: Robot) -> None:
    name = part.frame
    origin = robot.origin
    parents = [] if origin is None or origin.srdf is None else [joint.parent for joint in origin.srdf.virtual_joints]
    if name and name != "world" and parents and name not in parents:
        raise part.frame_error(
            f"{part.called} is stated in frame '{name}', expected the planning frame '{parents[0]}'; state the base there"
        )


def require_no_base_variables(state: State, robot: Robot) -> None:
    """Refuse a base whose pose is stated number by number among the joints.

    Raises:
        FileFormatError: such a number that is not the one of an unmoved base.
    """
    for name, value in state.joints.items():
        joint, _, local = name.rpartition("/")
        if joint in root_joints(robot) and abs(value - (1.0 if local == "rot_w" else 0.0)) > _SAME and state.part is not None:
            raise state.part.error(
                f"joint_state moves the robot's base by '{name}', which is not read, expected its pose; give it in "
                "multi_dof_joint_state"
            )


def with_others_locked(robot: Robot, values: Mapping[str, float], notes: list[str]) -> Robot:
    """Return the robot with the joints that it does not plan for where a state has them.

    Args:
        robot: the robot.
        values: of joints, as stated [rad or m].
        notes: gets sentences on what is locked where, and on joints that are not there.

    Raises:
        RobotError: the robot has been changed since it was loaded, and joints are to be locked elsewhere.
    """
    locked = locked_leaders(robot)
    wanted = {name: values[name] for name, lead in locked.items() if lead.leader == name and name in values}
    for name, lead in locked.items():
        if lead.leader != name and name in values and lead.multiplier:
            wanted.setdefault(lead.leader, (values[name] - lead.offset) / lead.multiplier)
    before = locked_values(robot)
    changed = {name: value for name, value in wanted.items() if abs(value - before[name]) > 0.0}
    if changed:
        robot = locked_elsewhere(robot, {**wanted})
        said = [f"{name} at {value:g}{_beyond(robot, name, value)}" for name, value in changed.items()]
        notes.append(f"locked where the start has them, as the robot does not plan for them: {', '.join(said)}")
    for name, lead in locked.items():
        if name in values and lead.leader in wanted:
            _compare(name, lead.leader, values[name], lead.multiplier * wanted[lead.leader] + lead.offset, notes)
    _say_unknown(robot, values, locked, notes)
    return robot


def _beyond(robot: Robot, name: str, value: float) -> str:
    lower, upper = joint_limits_in_file(robot, name)
    if lower is None or upper is None or lower > upper or lower <= value <= upper:
        return ""
    return f" (beyond its limits {lower:g} to {upper:g})"


def _compare(name: str, leader: str, stated: float, follows: float, notes: list[str]) -> None:
    if name != leader and abs(stated - follows) > _ROUNDING:
        notes.append(
            f"joint '{name}' follows '{leader}' and is at {follows:g}; that the start has it at {stated:g} is left out"
        )


def _say_unknown(robot: Robot, values: Mapping[str, float], locked: Mapping[str, object], notes: list[str]) -> None:
    fixed = set() if robot.origin is None else {j.name for j in robot.origin.tree.joints if j.kind == "fixed"}
    known = {*locked, *(joint.name for joint in robot.joints), *robot.dof_names}
    still = [f"{name} at {value:g}" for name, value in values.items() if name in fixed and value]
    if still:
        notes.append(
            f"values of the start that are left out, for the robot's file has these joints fixed in place: {', '.join(still)}"
        )
    others = {name: value for name, value in values.items() if name not in known and name not in fixed}
    unknown = [f"{name} at {value:g}" for name, value in others.items() if name.rpartition("/")[0] not in root_joints(robot)]
    if unknown:
        notes.append(f"the start has joints that robot '{robot.name}' does not have: {', '.join(unknown)}")


def start_of(robot: Robot, values: Mapping[str, float], part: Message, notes: list[str]) -> Array:
    """Return the start (n,) [rad or m], by the joints' names.

    Raises:
        FileFormatError: a joint without a position.
    """
    return planned_values(robot, values, part, "joint_state", notes)


def planned_values(robot: Robot, values: Mapping[str, float], part: Message, what: str, notes: list[str]) -> Array:
    """Return a value for each degree of freedom (n,), by the names of joints; one that follows another speaks for it, too.

    Raises:
        FileFormatError: one of which no joint is named.
    """
    q = []
    for dof, name in enumerate(robot.dof_names):
        followers = [joint for joint in robot.joints if joint.dof == dof and joint.name != name and joint.name in values]
        told = next((joint for joint in followers if joint.multiplier), None)
        if name in values:
            q.append(values[name])
        elif told is not None:
            q.append((values[told.name] - told.offset) / told.multiplier)
        else:
            known = nearest(name, values)
            raise part.error(f"{what} does not name joint '{name}', which robot '{robot.name}' plans for; {known}")
        for joint in followers:
            _compare(joint.name, name, values[joint.name], joint.multiplier * q[-1] + joint.offset, notes)
    return np.array(q)
