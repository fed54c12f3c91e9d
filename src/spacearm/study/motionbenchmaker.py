"""MotionBenchMaker's problems, or others in MoveIt's files, on disk.

Each family is a folder with scene*.yaml and request*.yaml.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from spacearm.core.errors import FileFormatError, nearest
from spacearm.files.moveit import load_moveit, requested_group
from spacearm.planner import ConfigurationGoal, Problem
from spacearm.robot import Robot, load_robot
from spacearm.robot.srdf import group_members, load_srdf
from spacearm.robot.urdf import urdf_tree

_SCENE = re.compile(r"scene(\d*)\.ya?ml")
_LAYOUT = "folders with scene*.yaml and request*.yaml, one folder a family"


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """A problem on disk.

    Attributes:
        family: its folder's name.
        name: the number in its files' names.
        scene: the planning scene.
        request: the motion request.
    """

    family: str
    name: str
    scene: Path
    request: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotFiles:
    """Where the robot is described.

    Attributes:
        urdf: its joints and bodies.
        srdf: its groups, and which links may touch.
        group: whose joints move.
    """

    urdf: Path
    srdf: Path
    group: str

    def load(self) -> Robot:
        """Return the robot. Of a group with several chains the last one's end is the tip: goals are configurations here."""
        tree = urdf_tree(self.urdf, collision="none")
        tips = group_members(load_srdf(self.srdf), self.group, tree).tips
        return load_robot(self.urdf, srdf=self.srdf, group=self.group, tip=tips[-1] if len(tips) > 1 else None)


def find_items(folder: Path, *, families: Sequence[str] = (), most: int | None = None) -> list[Item]:
    """Find the problems in a folder.

    Args:
        folder: of the families, or a family itself.
        families: the names of those wanted; none: all.
        most: of each family.

    Raises:
        FileFormatError: no such folder, no problems in it, no such family, or a scene without its request.
    """
    if not folder.is_dir():
        kind = "is a file" if folder.exists() else "does not exist"
        raise FileFormatError(f"{folder} {kind}, expected {_LAYOUT}; check --data")
    try:
        inner = folder / "problems"  # as in the archives of VAMP
        places = {folder, *folder.iterdir(), *(inner.iterdir() if inner.is_dir() else ())}
        found = {path.name: _of_family(path) for path in sorted(places) if path.is_dir()}
    except OSError as error:
        raise FileFormatError(f"{folder} cannot be read ({error.strerror}), expected {_LAYOUT}; check --data") from None
    found = {name: items for name, items in found.items() if items}
    if not found:
        raise FileFormatError(f"{folder} holds no problems, expected {_LAYOUT}; check --data")
    for name in families:
        if name not in found:
            raise FileFormatError(f"{folder} has no family '{name}'; {nearest(name, found)}")
    return [item for name, items in found.items() if not families or name in families for item in items[:most]]


def find_robot(
    folder: Path, items: Sequence[Item], *, urdf: Path | None = None, srdf: Path | None = None, group: str | None = None
) -> RobotFiles:
    """Take the robot's files that are given, else the only ones in the folder; and the group, else the one of the requests.

    Args:
        folder: of the problems.
        items: the problems.
        urdf: the robot's joints and bodies.
        srdf: its groups.
        group: whose joints move; None: `group_name` in the requests.

    Raises:
        FileFormatError: there is no such file, or several; the requests name no group, or different ones.
    """
    return RobotFiles(
        urdf=urdf or _only(folder, "urdf"), srdf=srdf or _only(folder, "srdf"), group=group or _requested_group(items)
    )


def _requested_group(items: Sequence[Item]) -> str:
    found: dict[str, Item] = {}
    for item in items:
        name = requested_group(item.request)
        if not name:
            raise FileFormatError(f"{item.request} names no group in 'group_name', expected one; name it by --group")
        found.setdefault(name, item)
    if len(found) > 1:
        listed = ", ".join(f"'{name}' in {item.family} {item.name}" for name, item in found.items())
        raise FileFormatError(
            f"the requests name several groups ({listed}), expected one; name one by --group or pick --families"
        )
    return next(iter(found))


def _only(folder: Path, kind: str) -> Path:
    found = sorted(folder.glob(f"*.{kind}"))
    if len(found) != 1:
        listed = ", ".join(path.name for path in found[:4]) or "none"
        raise FileFormatError(f"{folder} holds {len(found)} {kind.upper()} files ({listed}), expected one; name it by --{kind}")
    return found[0]


def _of_family(folder: Path) -> list[Item]:
    items = []
    for scene in sorted(folder.iterdir()):
        match = _SCENE.fullmatch(scene.name)
        if match is None or not scene.is_file():
            continue
        request = scene.with_name("request" + scene.name.removeprefix("scene"))
        if not request.is_file():
            raise FileFormatError(f"{scene} has no {request.name} beside it, expected a request for every scene; add it")
        items.append(Item(family=folder.name, name=match[1], scene=scene, request=request))
    return items


def read_item(item: Item, robot: Robot) -> Problem:
    """Read a problem whose goal is one configuration; a tolerance of it is not made use of.

    No clearance is asked for but that nothing touches, as with the planners that MotionBenchMaker compares.

    Raises:
        FileFormatError: a file that is missing, broken or of another format, or another goal.
        SpacearmError: obstacles that cannot be, or ends out of the robot's limits.
    """
    found = load_moveit(robot, item.scene, item.request, clearance=0.0)
    if not isinstance(found.goal, ConfigurationGoal):
        kind = type(found.goal).__name__
        raise FileFormatError(f"{item.request} has a {kind}, expected joint_constraints for one configuration; leave it out")
    return replace(found, goal=ConfigurationGoal(found.goal.q))
