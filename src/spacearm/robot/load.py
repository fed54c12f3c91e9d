"""Robots by name or by file."""

from __future__ import annotations

import os
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Literal

from spacearm.checks import shown
from spacearm.errors import FileFormatError, RobotError, nearest
from spacearm.reading import YamlFile, located, read_bytes, read_yaml
from spacearm.robot.model import Robot
from spacearm.robot.tree import build_robot, require_collision
from spacearm.robot.urdf import load_urdf
from spacearm.robot.yaml_robot import tree_from_yaml

_BUILTIN = resources.files("spacearm.robot") / "builtin"


def builtin_robots() -> tuple[str, ...]:
    """Return the names of the robots that come with spacearm."""
    return tuple(sorted(Path(entry.name).stem for entry in _BUILTIN.iterdir() if entry.name.endswith(".yaml")))


def load_robot(
    source: str | os.PathLike[str],
    *,
    tip: str | None = None,
    velocity_limit: float | None = None,
    acceleration_limit: float | None = None,
    collision: Literal["urdf", "none"] = "urdf",
) -> Robot:
    """Load a robot that comes with spacearm, or one from a file.

    Args:
        source: a built-in robot's name, or the path of a URDF file or of a robot file (`yaml_robot` has its
            format).
        tip: name of the link that is the end effector; needed where the robot has several chains.
        velocity_limit: no joint is to be faster [rad/s or m/s]; needed where the file states no limit.
        acceleration_limit: likewise [rad/s^2 or m/s^2]; where neither the file nor this states one, a joint
            gets the number of its velocity limit (full speed within one second), and the robot's notes say
            so.
        collision: "urdf" takes the envelope the file describes; "none" leaves the robot without one.

    Raises:
        RobotError: no such built-in robot, or one that cannot be.
        FileFormatError: a file that is missing, broken or of another format.
    """
    require_collision(collision)
    if isinstance(source, str) and _is_name(source):
        if source not in builtin_robots():
            raise RobotError(f"robot {shown(source)} is neither a file nor built in; {nearest(source, builtin_robots())}")
        with resources.as_file(_BUILTIN / f"{source}.yaml") as path:
            file, origin = read_yaml(path, key="spacearm-robot", what="a robot file"), source
    elif _is_xml(source):
        return load_urdf(
            source,
            tip=tip,
            velocity_limit=velocity_limit,
            acceleration_limit=acceleration_limit,
            collision=collision,
        )
    else:
        file, origin = read_yaml(source, key="spacearm-robot", what="a robot file"), str(source)
    return _from_yaml(file, origin, tip, velocity_limit, acceleration_limit, collision)


def _from_yaml(
    file: YamlFile,
    origin: str,
    tip: str | None,
    velocity_limit: float | None,
    acceleration_limit: float | None,
    collision: str,
) -> Robot:
    tree = tree_from_yaml(file, source=origin)
    tree = replace(tree, tip=tree.tip if tip is None else tip, capsules=() if collision == "none" else tree.capsules)
    with located(origin):
        return build_robot(tree, velocity_limit=velocity_limit, acceleration_limit=acceleration_limit)


def _is_name(source: str) -> bool:
    """Whether a string is to be a built-in robot's name; write ./name for a file that is called like one."""
    return source in builtin_robots() or not (Path(source).suffix or "/" in source or os.path.exists(source))


def _is_xml(source: str | os.PathLike[str]) -> bool:
    content = read_bytes(source, what="a robot: a URDF or a robot file")
    if content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return True
    if Path(source).suffix.lower() in (".urdf", ".xml", ".xacro"):
        raise FileFormatError(f"{source} holds no XML, expected a URDF (<robot ...>); check the path")
    return False
