"""Whether an SRDF is about a robot, and what in it is not: names that the robot does not have."""

from __future__ import annotations

from collections.abc import Iterable

from spacearm.errors import RobotError, nearest
from spacearm.robot.links import LinkTree
from spacearm.robot.srdf import Srdf

_LISTED = 5  # in one note


def require_same_robot(srdf: Srdf, tree: LinkTree) -> None:
    """Refuse an SRDF that names links, but none of the robot's.

    Raises:
        RobotError: it does.
    """
    named = [link for group in srdf.groups for link in (*group.links, *(end for chain in group.chains for end in chain))]
    named += sorted(_of_pairs(srdf))
    if named and set(named).isdisjoint(tree.links):
        raise RobotError(
            f"{srdf.source} names no link of robot '{tree.name}', which has no '{named[0]}'; {nearest(named[0], tree.links)}; "
            "give the SRDF of that robot"
        )


def what_does_not_fit(srdf: Srdf, tree: LinkTree) -> tuple[str, ...]:
    """Say in notes what an SRDF tells about links and joints that the robot does not have."""
    links, joints = set(tree.links), {joint.name for joint in tree.joints}
    joints |= {joint.name for joint in srdf.virtual_joints}
    unknown = _of_pairs(srdf) | {link for link, _ in srdf.spheres} | set(srdf.mounts)
    notes = list(_left_out("link", unknown - links, tree.links))
    stated = {name for state in srdf.states for name, _ in state.values} | set(srdf.passive_joints)
    notes += _left_out("joint", stated - joints, [joint.name for joint in tree.joints])
    return tuple(notes)


def _of_pairs(srdf: Srdf) -> set[str]:
    return {link for both in srdf.disabled | srdf.enabled for link in both} | set(srdf.silent_links)


def _left_out(what: str, unknown: Iterable[str], known: Iterable[str]) -> Iterable[str]:
    names = sorted(unknown)
    if names:
        listed = ", ".join(repr(name) for name in names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
        yield f"the SRDF names {what}s that the robot does not have and were left out: {listed} ({nearest(names[0], known)})"
