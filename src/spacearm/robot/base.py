"""How a robot's base is held: fixed, or free to float."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from spacearm.robot.groups import with_subgroups
from spacearm.robot.left_out import lacks_masses
from spacearm.robot.links import LinkTree
from spacearm.robot.model import Robot
from spacearm.robot.srdf import Srdf, VirtualJoint


def held_base(tree: LinkTree, choice: Literal["fixed", "floating"] | None, srdf: Srdf | None, group: str | None) -> LinkTree:
    """Say in a tree how its root is held.

    The user's choice comes first, then the SRDF's virtual joint of the root, then the robot file. As for any other joint,
    a group that does not name the virtual joint holds it: the base of MoveIt's ordinary arms stays fixed.

    Args:
        tree: links and joints that form one tree.
        choice: what the user says, or None.
        srdf: the SRDF, if there is one.
        group: name of the chosen group in it, if any.
    """
    base, notes = tree.base, []
    for joint in _of_the_root(tree, srdf):
        if joint.kind == "planar":
            notes.append(f"the SRDF's virtual joint '{joint.name}' is planar, which no spacecraft's is: the base is {base}")
        elif joint.kind == "floating" and not _named(joint, srdf, group):
            base = "fixed"
            if choice is None:
                notes.append(
                    f"the SRDF's virtual joint '{joint.name}' is floating, but not in group '{group}': the base is fixed; "
                    "give base='floating' to let it float"
                )
        else:
            base = "floating" if joint.kind == "floating" else "fixed"
    base = base if choice is None else choice
    return replace(tree, base=base, notes=(*tree.notes, *notes))


def _of_the_root(tree: LinkTree, srdf: Srdf | None) -> tuple[VirtualJoint, ...]:
    return () if srdf is None else tuple(joint for joint in srdf.virtual_joints if joint.child == _root(tree))


def _named(joint: VirtualJoint, srdf: Srdf | None, group: str | None) -> bool:
    """Whether no group is chosen, or it moves the joint, itself or through its subgroups."""
    if srdf is None or group is None:
        return True
    return any(joint.name in part.joints for part in with_subgroups(srdf, group))


def _root(tree: LinkTree) -> str:
    children = {joint.child for joint in tree.joints}
    return next(link for link in tree.links if link not in children)


def notes_on_base(robot: Robot) -> tuple[str, ...]:
    """Say in a note that a floating base, or a link, has no mass, so that nobody can tell how the base moves."""
    if robot.base == "fixed":
        return ()
    if any(body.joint < 0 and body.mass > 0 for body in robot.bodies):
        lacking = lacks_masses(robot)
        return (lacking,) if lacking else ()
    root = next((frame.name for frame in robot.frames if frame.joint < 0), "base")
    return (
        f"the base floats, but no link fixed to '{root}' has a mass: its motion cannot be computed; "
        "state that mass, or give base='fixed'",
    )
