"""A collection of planning problems on disk: folders, one a family, with scene*.yaml and request*.yaml of MoveIt."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spacearm.errors import FileFormatError, nearest
from spacearm.planner import Problem
from spacearm.reading import located, read_bytes
from spacearm.robot import Robot, load_robot
from spacearm.scene import Box, Cylinder, Obstacle, Scene, Sphere, pose

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
        """Return the robot."""
        return load_robot(self.urdf, srdf=self.srdf, group=self.group)


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
        found = {path.name: _of_family(path) for path in sorted({folder, *folder.iterdir()}) if path.is_dir()}
    except OSError as error:
        raise FileFormatError(f"{folder} cannot be read ({error.strerror}), expected {_LAYOUT}; check --data") from None
    found = {name: items for name, items in found.items() if items}
    if not found:
        raise FileFormatError(f"{folder} holds no problems, expected {_LAYOUT}; check --data")
    for name in families:
        if name not in found:
            raise FileFormatError(f"{folder} has no family '{name}'; {nearest(name, found)}")
    return [item for name, items in found.items() if not families or name in families for item in items[:most]]


def find_robot(folder: Path, *, urdf: Path | None, srdf: Path | None, group: str) -> RobotFiles:
    """Take the robot's files that are given, else the only ones in the folder.

    Raises:
        FileFormatError: there is none, or several.
    """
    return RobotFiles(urdf=urdf or _only(folder, "urdf"), srdf=srdf or _only(folder, "srdf"), group=group)


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


# ---- reading -----------------------------------------------------------------------------------------------------------


def read_item(item: Item, robot: Robot) -> Problem:
    """Read a problem: scene, start, and the goal's joint positions.

    Raises:
        FileFormatError: a file that is missing, broken or of another format, or an obstacle that is no sphere, box or
            cylinder.
        SpacearmError: obstacles that cannot be, or ends out of the robot's limits.
    """
    start, goal = read_ends(item.request)
    with located(item.request):
        q = [[_named(end, name) for name in robot.dof_names] for end in (start, goal)]
    with located(item.scene):
        obstacles = [_obstacle(*primitive) for primitive in read_primitives(item.scene)]
        return Problem(robot, Scene(obstacles), start=q[0], goal=q[1])


def read_ends(path: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Read a request's start and goal, by joint [rad or m]."""
    request = _mapping(path, "a motion request of MoveIt")
    try:
        state = request["start_state"]["joint_state"]
        start = {str(name): float(at) for name, at in zip(state["name"], state["position"], strict=True)}
        rows = request["goal_constraints"][0]["joint_constraints"]
        return start, {str(row["joint_name"]): float(row["position"]) for row in rows}
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise FileFormatError(
            f"{path} has no {error}, expected a motion request of MoveIt: start_state and goal_constraints by joints"
            if isinstance(error, KeyError)
            else f"{path} is no motion request of MoveIt with a start and a goal by joints; correct the file"
        ) from None


def read_primitives(path: Path) -> list[tuple[str, str, list[float], list[float], list[float]]]:
    """Read a scene's solids as the file states them: name, kind, dimensions, position, and quaternion x y z w."""
    scene = _mapping(path, "a planning scene of MoveIt")
    out = []
    try:
        for body in scene["world"]["collision_objects"]:
            for solid, at in zip(body["primitives"], body["primitive_poses"], strict=True):
                numbers = [[float(x) for x in row] for row in (solid["dimensions"], at["position"], at["orientation"])]
                out.append((str(body["id"]), str(solid["type"]), *numbers))
    except (KeyError, TypeError, ValueError) as error:
        raise FileFormatError(
            f"{path} has no {error}, expected a planning scene of MoveIt whose collision objects are primitives"
            if isinstance(error, KeyError)
            else f"{path} is no planning scene of MoveIt whose collision objects are primitives; correct the file"
        ) from None
    return out


def _obstacle(name: str, kind: str, size: list[float], position: list[float], xyzw: list[float]) -> Obstacle:
    if len(xyzw) != 4 or len(position) != 3 or len(size) != {"box": 3, "cylinder": 2, "sphere": 1}.get(kind):
        raise FileFormatError(
            f"object '{name}' is a {kind} with {len(size)} dimensions, expected a box with 3, a cylinder with 2 (height, "
            "radius) or a sphere with 1, each with a position and a quaternion"
        )
    if kind == "sphere":
        return Sphere(position, size[0], name=name)
    T = pose(position, (xyzw[3], *xyzw[:3]))
    return Box(size, T, name=name) if kind == "box" else Cylinder(size[1], size[0], T, name=name)


def _named(values: dict[str, float], name: str) -> float:
    if name not in values:
        raise FileFormatError(f"no value for joint '{name}', expected one for each joint of the group; {nearest(name, values)}")
    return values[name]


def _mapping(path: Path, what: str) -> dict[str, Any]:
    import yaml

    content = read_bytes(path, what=what)
    try:
        found = yaml.load(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except (yaml.YAMLError, ValueError, RecursionError):
        raise FileFormatError(f"{path} is no YAML, expected {what}; correct the file") from None
    if not isinstance(found, dict):
        raise FileFormatError(f"{path} holds no mapping, expected {what}; correct the file")
    return found
