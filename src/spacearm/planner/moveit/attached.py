"""What MoveIt's states attach to links of the robot (`moveit_msgs/AttachedCollisionObject`): it becomes a part of the robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown
from spacearm.errors import nearest
from spacearm.planner.held import hold
from spacearm.planner.moveit.frames import Frames
from spacearm.planner.moveit.scene import APPEND, MOVE, REMOVE, Body, body_of
from spacearm.planner.moveit.shapes import named
from spacearm.robot.model import Frame, Robot

if TYPE_CHECKING:
    from spacearm.planner.moveit.part import AttachedCollisionObject

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
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


def held_by(
    items: Sequence[AttachedCollisionObject],
    held: Mapping[str, Held],
    world: dict[str, Body],
    frames: Frames,
    robot: Robot,
    *,
    mesh_excess: float | None = None,
) -> dict[str, Held]:
    """Apply what a state attaches and takes off, one by one.

    Args:
        items: the state's `attached_collision_objects`.
        held: what is attached before, by id.
        world: the world's objects; one of them that comes to be attached is taken out.
        frames: in the state that attaches them; those of what is attached are put in.
        robot: that holds them.
        mesh_excess: how far the balls around a mesh may stand out of it [m].

    Raises:
        FileFormatError, SceneError: what is wrong, with file and line.
    """
    now = dict(held)
    for item in items:
        thing, operation, name = item.object, item.object.operation, item.object.id or ""
        if operation == MOVE:
            raise thing.error(f"attached object {shown(name)} is to be moved, which MoveIt does not do; attach it where it is")
        if operation == REMOVE:
            gone = [key for key, one in now.items() if name in ("", key) and (item.link_name or "") in ("", one.link)]
            now = {key: one for key, one in now.items() if key not in gone}
            continue
        one = _held(item, name or "held", world, frames, robot, mesh_excess)
        if operation == APPEND and name in now:
            one = _both(now[name], one)
        now[name or "held"] = one
        for frame, T in one.body.frames().items():
            frames.attached[frame] = frames.links[one.link] @ T
    return now


def _both(before: Held, more: Held) -> Held:
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


def _held(
    item: AttachedCollisionObject,
    name: str,
    world: dict[str, Body],
    frames: Frames,
    robot: Robot,
    mesh_excess: float | None,
) -> Held:
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
    return Held(part=item, link=link, body=body, touching=(link, *item.touch_links), mass=item.weight)


def with_held(robot: Robot, held: Sequence[Held], may_touch: Callable[[str, str], bool] | None, notes: list[str]) -> Robot:
    """Return the robot with objects attached to its links, each a frame of the object's id, with its subframes.

    Args:
        robot: the robot.
        held: the objects.
        may_touch: whether the scene's matrix lets an object and a link touch; None: it is not asked.
        notes: gets sentences on what is left out.

    Raises:
        RobotError: what cannot be held, a name that is taken; file and line are named.
    """
    for one in held:
        robot = one.part.located(lambda one=one, robot=robot: _in_hand(robot, one, may_touch, notes))
    return robot


def _in_hand(robot: Robot, one: Held, may_touch: Callable[[str, str], bool] | None, notes: list[str]) -> Robot:
    name, links = one.body.name, {frame.name for frame in robot.frames}
    strange = [link for link in dict.fromkeys(one.touching) if link not in links]
    if strange:
        notes.append(f"'{name}' may touch {', '.join(strange)}, which robot '{robot.name}' does not have")
    touching = [link for link in links if link in one.touching or (may_touch is not None and may_touch(name, link))]
    if one.part.detach_posture.points:
        notes.append(f"the detach_posture of '{name}' is left out: nothing lets go of it")
    mass = one.mass if one.mass > 0 and len(one.body.shapes) == 1 else None  # how it is spread over several, nothing says
    if mass is not None:
        notes.append(f"the weight of '{name}', {mass:g} kg, is taken for a mass that fills its shape evenly")
    elif one.mass:
        notes.append(
            f"the weight of '{name}', {one.mass:g} kg, is left out: it has {len(one.body.shapes)} shapes, and how it is spread "
            "over them is not stated; it would matter if the base floated"
        )
    for i, shape in enumerate(one.body.shapes):
        label = named(name, i, len(one.body.shapes))
        obstacle = shape.part.located(lambda shape=shape, label=label: shape.made.make(shape.T, label))
        robot = hold(robot, obstacle, frame=one.link, pose=one.body.T, touching=touching, name=label, mass=mass)
    return _with_frames(robot, one)


def _with_frames(robot: Robot, one: Held) -> Robot:
    """Put the object's own frame where MoveIt has it, which need not be the middle of its shape, and add its subframes."""
    holder = robot.frame(one.link)
    places = {name: holder.T_joint_frame @ T for name, T in one.body.frames().items()}
    frames = tuple(
        Frame(name=name, joint=holder.joint, T_joint_frame=T, parent=one.link if name == one.body.name else one.body.name)
        for name, T in places.items()
    )
    return replace(robot, frames=(*(frame for frame in robot.frames if frame.name not in places), *frames))
