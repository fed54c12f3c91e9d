"""From links and joints to a Robot, for every file format: the joints that move, what rides on each, and the base.

Fixed joints are folded onto the moving joint before them, each axis is turned onto z, mimic joints come to
share a degree of freedom whose limits keep every one of them within its own.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import RobotError, nearest
from spacearm.core.exact import length, product
from spacearm.geometry.convex_cores import moved_shape
from spacearm.geometry.shapes import ConvexShape
from spacearm.robot.joint_limits import joint_limits, require_ceiling
from spacearm.robot.link_shapes import LinkShape
from spacearm.robot.link_tree import LONGEST, LinkJoint, LinkMass, LinkTree, Mimic, default_tip, leader_of
from spacearm.robot.model import Body, Frame, Joint, Robot
from spacearm.robot.srdf import Srdf, VirtualJoint
from spacearm.robot.unchecked_pairs import lacks_masses

Array = NDArray[np.float64]

# A rotation this near a signed permutation is meant to be one: files carry pi/2 to ten digits or so.
_SNAP = 1e-9
_NOISE = 1e-15  # rounding of cos(pi/2) and the like; more would cost the rotation its orthonormality


def build_robot(tree: LinkTree, *, velocity_limit: Any = None, acceleration_limit: Any = None) -> Robot:
    """Turn a tree of links into a Robot.

    Args:
        tree: what the file says.
        velocity_limit: no joint is to be faster [rad/s or m/s]; needed where the file states no limit. A number holds for
            every joint, those that follow others included; a mapping names joints, an array (n,) has one for each entry of q.
        acceleration_limit: likewise [rad/s^2 or m/s^2]; without one, a joint whose file states none gets the
            number of its velocity limit (full speed within one second), which the robot's notes tell.

    Raises:
        RobotError: links that form no tree, or joints without a usable axis or limit.
    """
    velocity_limit = require_ceiling("velocity_limit", velocity_limit, tree, "rad/s or m/s")
    acceleration_limit = require_ceiling("acceleration_limit", acceleration_limit, tree, "rad/s^2 or m/s^2")
    ordered = require_tree(tree)
    moving = [joint for joint in ordered if joint.kind != "fixed"]
    for joint in moving:
        if joint.kind in ("floating", "planar"):
            raise RobotError(
                f"joint '{joint.name}' is {joint.kind}, expected revolute, continuous, prismatic or fixed; "
                "replace it by a chain of these"
            )
    if not moving:
        raise RobotError(f"robot '{tree.name}' has no moving joint, expected at least one; nothing can be planned")
    leads = {joint.name: leader_of(joint, tree) for joint in moving}
    leaders = [joint.name for joint in moving if leads[joint.name].leader == joint.name]
    joints, places = _placed(tree, ordered, leads, leaders)
    parents = {joint.child: joint.parent for joint in ordered}
    limits, notes = joint_limits(moving, leads, leaders, velocity_limit, acceleration_limit)
    return Robot(
        name=tree.name,
        joints=tuple(joints),
        frames=tuple(
            Frame(name=link, joint=j, T_joint_frame=T, parent=parents.get(link, "")) for link, (j, T) in places.items()
        ),
        bodies=tuple(_body(mass, places[mass.link]) for mass in tree.masses),
        shapes=tuple(_carried(link, places[link], shape) for link, shape in tree.shapes),
        tip=_tip(tree, places),
        dof_names=tuple(leaders),
        lower=limits[0],
        upper=limits[1],
        velocity=limits[2],
        acceleration=limits[3],
        base=tree.base,
        collision="envelope" if tree.with_envelope else "none",
        solid=_solid(tree, places),
        unweighed=_unweighed(tree, places),
        source=tree.source,
        notes=(*tree.notes, *notes),
        visuals=tuple(one.carried(*places[one.name]) for one in tree.visuals if one.name in places),
    )


def require_collision(collision: str) -> None:
    """Check where the envelope is to come from.

    Raises:
        RobotError: anything but "urdf" and "none".
    """
    if collision not in ("urdf", "none"):
        raise RobotError(f"collision is {shown(collision)}, expected 'urdf' or 'none'")


def snapped(T: ArrayLike) -> Array:
    """Clean a transform's rotation, (4, 4), of what a file's rounding left in it.

    A rotation within 1e-9 of a signed permutation becomes that permutation: rpy="1.57079632679 0 0" is meant
    as a quarter turn, and a point one metre away moves by a nanometre. In others, only entries within 1e-15
    of 0 or 1 become so.
    """
    T = np.array(T, dtype=np.float64)
    R = T[:3, :3]
    whole = np.round(R)
    near = np.abs(R - whole)
    T[:3, :3] = whole if near.max() <= _SNAP else np.where(near <= _NOISE, whole, R)
    return T


def turned_onto_z(name: str, axis: ArrayLike) -> Array:
    """Return the rotation (4, 4) whose z column is a joint's axis.

    For a coordinate axis, of either sign, it is a signed permutation, exactly.

    Raises:
        RobotError: an axis of length 0.
    """
    v = np.asarray(axis, dtype=np.float64)
    largest = float(np.abs(v).max())
    if largest == 0.0:
        raise RobotError(f"joint '{name}' has axis (0, 0, 0), expected a direction; give one such as (0, 0, 1)")
    z = v / largest  # first, so that tiny and huge axes have a length that is neither 0 nor infinite
    z = z / length(z)
    if np.abs(z - np.round(z)).max() <= _SNAP:
        z = np.round(z)
    k = int(np.argmax(np.abs(z)))
    x = np.zeros(3)
    x[(k + 1) % 3] = 1.0  # never parallel to z, whose largest entry is another
    x = x - (x * z).sum() * z
    x = x / length(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack((x, np.cross(z, x), z))
    return T


def require_tree(tree: LinkTree) -> list[LinkJoint]:
    """Check that links and joints form one tree, and list the joints in the file's order, parents first.

    Raises:
        RobotError: a name twice, a link that does not exist, several roots, or a loop.
    """
    for what, names in (("link", tree.links), ("joint", [joint.name for joint in tree.joints])):
        name, count = Counter(names).most_common(1)[0] if names else ("", 0)
        if count > 1:
            raise RobotError(f"{what} name '{name}' is used {count} times, expected once; rename the others")
    parents: dict[str, LinkJoint] = {}
    for joint in tree.joints:
        furthest = float(np.abs(np.asarray(joint.T_parent_child)[:3, 3]).max())
        if furthest > LONGEST:
            raise RobotError(
                f"joint '{joint.name}' has its origin {furthest:g} m away, expected {LONGEST:g} m or less; check its units"
            )
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in tree.links:
                raise RobotError(
                    f"joint '{joint.name}' has {role} link '{link}', which does not exist; {nearest(link, tree.links)}"
                )
        if joint.child in parents:
            raise RobotError(
                f"link '{joint.child}' is the child of joints '{parents[joint.child].name}' and "
                f"'{joint.name}', expected one; loops are not supported, cut it at one of them"
            )
        parents[joint.child] = joint
    roots = [link for link in tree.links if link not in parents]
    if len(roots) > 1:
        raise RobotError(
            f"links {', '.join(map(repr, roots[:6]))} have no parent joint, expected one root; "
            "join the others to it with fixed joints"
        )
    placed, ordered, waiting = set(roots), [], list(tree.joints)
    while waiting:
        ready = next((joint for joint in waiting if joint.parent in placed), None)
        if ready is None:
            names = ", ".join(f"'{joint.name}'" for joint in waiting[:6])
            raise RobotError(f"joints {names} form a loop, expected a tree from one root; cut the loop at one of them")
        waiting.remove(ready)
        ordered.append(ready)
        placed.add(ready.child)
    return ordered


def _placed(
    tree: LinkTree, ordered: list[LinkJoint], leads: dict[str, Mimic], leaders: list[str]
) -> tuple[list[Joint], dict[str, tuple[int, Array]]]:
    """Give each joint its transform and each link the moving joint it rides on: (joint, T_joint_link)."""
    children = {joint.child for joint in ordered}
    places = {link: (-1, np.eye(4)) for link in tree.links if link not in children}
    joints: list[Joint] = []
    for joint in ordered:
        on, T_on_parent = places[joint.parent]
        T_on_child = product(T_on_parent, snapped(joint.T_parent_child))
        if joint.kind == "fixed":
            places[joint.child] = (on, T_on_child)
            continue
        T_child_joint = turned_onto_z(joint.name, joint.axis if joint.axis is not None else (0, 0, 0))
        lead = leads[joint.name]
        joints.append(
            Joint(
                name=joint.name,
                kind="prismatic" if joint.kind == "prismatic" else "revolute",
                parent=on,
                T_parent_joint=snapped(product(T_on_child, T_child_joint)),
                dof=leaders.index(lead.leader),
                multiplier=lead.multiplier,
                offset=lead.offset,
            )
        )
        # T_child_joint is a pure rotation: its transpose is its inverse.
        places[joint.child] = (len(joints) - 1, T_child_joint.T)
    return joints, {link: places[link] for link in tree.links}


def _carried(link: str, place: tuple[int, Array], shape: ConvexShape) -> LinkShape:
    joint, T = place
    return LinkShape(name=link, joint=joint, shape=moved_shape(shape, T))


def _at(T: Array, point: Array) -> Array:
    return product(T[:3, :3], point) + T[:3, 3]


def _body(mass: LinkMass, place: tuple[int, Array]) -> Body:
    joint, T = place
    R = T[:3, :3]
    return Body(
        name=mass.link, joint=joint, mass=mass.mass, com=_at(T, mass.com), inertia=product(product(R, mass.inertia), R.T)
    )


def _solid(tree: LinkTree, places: dict[str, tuple[int, Array]]) -> tuple[str, ...]:
    """List the links that are more than frames.

    Of a URDF these have a shape or a mass. A robot file draws no shapes: there they have a mass away from their origin, for one
    at it may stand for a link without a length, between joints at one point; and a joint moves them.
    """
    massive = {mass.link: mass for mass in tree.masses if mass.mass > 0}
    if not tree.shaped:
        return tuple(link for link, mass in massive.items() if places[link][0] >= 0 and mass.com.any())
    return tuple(link for link in tree.links if link in tree.shaped or link in massive)


def _unweighed(tree: LinkTree, places: dict[str, tuple[int, Array]]) -> tuple[tuple[str, str], ...]:
    """List the links with a shape of which nobody knows what they weigh, and why.

    A mass of 0 is believed of a link that another one with a mass is fixed to: it is stated there.
    """
    masses = {mass.link: mass.mass for mass in tree.masses}
    weighed = {places[link][0] for link, mass in masses.items() if mass > 0}
    unknown = dict(tree.unreadable)
    for link in tree.links:
        if link not in tree.shaped:
            continue
        if link not in masses:
            unknown.setdefault(link, "the file states none")
        elif not masses[link] > 0 and places[link][0] not in weighed:
            unknown.setdefault(link, "the file states 0 kg")
    return tuple(unknown.items())


def _tip(tree: LinkTree, places: dict[str, tuple[int, Array]]) -> str:
    if tree.tip is not None:
        if tree.tip not in tree.links:
            raise RobotError(f"tip '{tree.tip}' is no link of robot '{tree.name}'; {nearest(tree.tip, tree.links)}")
        return tree.tip
    tip = default_tip(tree).tip
    assert tip is not None
    return tip


def choose_base(tree: LinkTree, choice: Literal["fixed", "floating"] | None, srdf: Srdf | None) -> LinkTree:
    """Say in a tree whether its root is fixed or floats.

    A base floats only where it is asked to: by the user, or by spacearm's own robot file. MoveIt's setups of ordinary arms
    often have a floating virtual joint, so that an SRDF's is told in a note and frees nothing; a fixed one holds the base.

    Args:
        tree: links and joints that form one tree.
        choice: what the user says, or None.
        srdf: the SRDF, if there is one.
    """
    base, notes = tree.base, []
    for joint in _root_virtual_joints(tree, srdf):
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
        locked = replace(joint, kind="fixed", axis=None)
        joints = tuple(locked if other is joint else other for other in tree.joints)
        advice = "; give base='floating' to let the base float" if joint.kind == "floating" else ""
        note = f"joint '{joint.name}' between the root and '{joint.child}' is {joint.kind}, and locked at its origin{advice}"
        return replace(tree, joints=joints, notes=(*tree.notes, note))
    full = {link for link, _ in tree.shapes} | {mass.link for mass in tree.masses if mass.mass > 0}
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


def _root_virtual_joints(tree: LinkTree, srdf: Srdf | None) -> tuple[VirtualJoint, ...]:
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
