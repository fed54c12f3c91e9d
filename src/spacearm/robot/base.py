"""How a robot's base is held: fixed, or free to float."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from spacearm.errors import RobotError
from spacearm.robot.left_out import lacks_masses
from spacearm.robot.links import LinkTree
from spacearm.robot.model import Robot
from spacearm.robot.srdf import Srdf, VirtualJoint


def held_base(tree: LinkTree, choice: Literal["fixed", "floating"] | None, srdf: Srdf | None) -> LinkTree:
    """Say in a tree how its root is held.

    A base floats only where it is asked to: by the user, or by spacearm's own robot file. MoveIt's setups of ordinary arms
    often have a floating virtual joint, so that an SRDF's is told in a note and frees nothing; a fixed one holds the base.

    Args:
        tree: links and joints that form one tree.
        choice: what the user says, or None.
        srdf: the SRDF, if there is one.
    """
    base, notes = tree.base, []
    for joint in _of_the_root(tree, srdf):
        if joint.kind == "fixed":
            base = "fixed"
        elif choice is None and base == "fixed":
            advice = "; give base='floating' to let it float" if joint.kind == "floating" else ""
            notes.append(
                f"the SRDF's virtual joint '{joint.name}' is {joint.kind}, which is not followed: the base is fixed{advice}"
            )
    if choice is None and base != tree.base:
        notes.append("the base is fixed, as the SRDF's virtual joint says; the robot file would let it float")
    return replace(tree, base=base if choice is None else choice, notes=(*tree.notes, *notes))


def rooted(tree: LinkTree, choice: Literal["fixed", "floating"] | None) -> LinkTree:
    """Take the meaning of a floating or planar joint between the root, as "world", and the base.

    With a base that floats, the joint and what is above it go: the base is the root. With a base that is fixed, the joint stays
    at its origin. Such joints elsewhere in the tree are left as they are.

    Args:
        tree: links and joints that form one tree.
        choice: what the user says of the base, or None.

    Raises:
        RobotError: the base is to float, but the joint is planar, or what is above it is not empty.
    """
    above = _rigid_with(_root(tree), tree)
    leaving = [joint for joint in tree.joints if joint.kind != "fixed" and joint.parent in above]
    free = [joint for joint in leaving if joint.kind in ("floating", "planar")]
    if len(free) != 1:
        return tree
    joint = free[0]
    if choice != "floating":
        held = replace(joint, kind="fixed", axis=None)
        joints = tuple(held if other is joint else other for other in tree.joints)
        advice = "; give base='floating' to let the base float" if joint.kind == "floating" else ""
        note = f"joint '{joint.name}' between the root and '{joint.child}' is {joint.kind}, and held at its origin{advice}"
        return replace(tree, joints=joints, notes=(*tree.notes, note))
    full = {link for link, *_ in tree.capsules} | {mass.link for mass in tree.masses if mass.mass > 0}
    if joint.kind == "planar" or len(leaving) > 1 or full & above:
        why = (
            "is planar"
            if joint.kind == "planar"
            else f"hangs on '{joint.parent}', which carries shapes, masses or other joints"
        )
        raise RobotError(
            f"base is 'floating', but joint '{joint.name}' above '{joint.child}' {why}; expected a floating joint from an "
            "empty root, or none; cut the base off there"
        )
    T = np.asarray(joint.T_parent_child)
    moved = "" if np.array_equal(T, np.eye(4)) else f", its origin {np.round(T[:3, 3], 6).tolist()} left out"
    note = f"the base is '{joint.child}', which floating joint '{joint.name}' frees{moved}"
    gone = {other.name for other in tree.joints if other.child in above} | {joint.name}
    return replace(
        tree,
        links=tuple(link for link in tree.links if link not in above),
        joints=tuple(other for other in tree.joints if other.name not in gone),
        masses=tuple(mass for mass in tree.masses if mass.link not in above),
        notes=(*tree.notes, note),
    )


def _rigid_with(link: str, tree: LinkTree) -> set[str]:
    """Return the links that fixed joints tie to one, itself included."""
    found, waiting = {link}, [link]
    while waiting:
        at = waiting.pop()
        below = [joint.child for joint in tree.joints if joint.kind == "fixed" and joint.parent == at]
        waiting += [child for child in below if child not in found]
        found.update(below)
    return found


def _of_the_root(tree: LinkTree, srdf: Srdf | None) -> tuple[VirtualJoint, ...]:
    return () if srdf is None else tuple(joint for joint in srdf.virtual_joints if joint.child == _root(tree))


def _root(tree: LinkTree) -> str:
    children = {joint.child for joint in tree.joints}
    return next((link for link in tree.links if link not in children), "")


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
