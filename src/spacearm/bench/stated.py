"""What a problem's files state, read once more and by other means, for a checker that is to owe us nothing."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spacearm.errors import FileFormatError
from spacearm.reading import read_bytes

_DIMENSIONS = {"box": 3, "cylinder": 2, "sphere": 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedSolid:
    """A primitive of a planning scene.

    Attributes:
        name: of the object it belongs to.
        kind: "box", "cylinder" or "sphere".
        size: edges x y z, or height and radius, or radius [m].
        poses: (position [m], quaternion x y z w) from the planning frame inwards.
    """

    name: str
    kind: str
    size: tuple[float, ...]
    poses: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...]


def stated_solids(path: Path) -> list[StatedSolid]:
    """Read a planning scene's primitives.

    Raises:
        FileFormatError: there is something in it that the other checker does not know.
    """
    out = []
    try:
        scene = _mapping(path)
        frames = _frames(scene)
        if (scene.get("robot_state") or {}).get("attached_collision_objects"):
            raise FileFormatError(f"{path} attaches objects to the robot, expected none: the other checker knows no others")
        for body in scene["world"]["collision_objects"]:
            frame = _name(body.get("header"))
            if body.get("meshes") or body.get("planes") or frame not in frames:
                raise FileFormatError(
                    f"{path} has an object '{body['id']}' with meshes or planes or in a frame of its own, expected primitives "
                    "in a frame that the scene fixes: the other checker knows no others"
                )
            outer = [*frames[frame], *([_pose(body["pose"])] if body.get("pose") else [])]
            for solid, at in zip(body["primitives"], body["primitive_poses"], strict=True):
                kind, size = str(solid["type"]), _numbers(solid["dimensions"])
                if len(size) != _DIMENSIONS[kind]:
                    raise ValueError
                out.append(StatedSolid(name=str(body["id"]), kind=kind, size=size, poses=(*outer, _pose(at))))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        raise FileFormatError(
            f"{path} cannot be read by the other checker, expected a planning scene of boxes, cylinders and spheres by name"
        ) from None
    return out


def stated_start(path: Path) -> dict[str, float]:
    """Read a request's start by joint [rad or m]; empty where it has none."""
    request = _mapping(path)
    try:
        if request["start_state"].get("attached_collision_objects"):
            raise FileFormatError(f"{path} attaches objects to the robot, expected none: the other checker knows no others")
        state = request["start_state"]["joint_state"]
        return {str(name): float(at) for name, at in zip(state["name"], state["position"], strict=True)}
    except (AttributeError, KeyError, TypeError, ValueError):
        return {}


def _frames(scene: dict[str, Any]) -> dict[str, list[Any]]:
    """Return the poses that lead to each frame: MoveIt has the named one in the header, and the planning frame as child."""
    fixed = scene.get("fixed_frame_transforms") or []
    planning = {str(item["child_frame_id"]).lstrip("/") for item in fixed}
    frames: dict[str, list[Any]] = {"": [], "world": [], **{name: [] for name in planning}}
    if len(planning) == 1:
        for item in fixed:
            at, name = item["transform"], _name(item.get("header")) or "world"
            frames[name] = [(_numbers(at["translation"]), _numbers(at["rotation"]))]
    return frames


def _name(header: Any) -> str:
    return str((header or {}).get("frame_id") or "").lstrip("/")


def _pose(given: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    position, xyzw = (_numbers(given[key]) for key in ("position", "orientation"))
    if (len(position), len(xyzw)) != (3, 4):
        raise ValueError
    return position, xyzw


def _numbers(given: Any) -> tuple[float, ...]:
    """Return numbers that are listed, or named as ROS does."""
    values: Iterable[Any] = [given[key] for key in "xyzw" if key in given] if isinstance(given, dict) else given
    return tuple(float(value) for value in values)


def _mapping(path: Path) -> dict[str, Any]:
    import yaml

    content = read_bytes(path, what="a file of MoveIt in YAML")
    try:
        found = yaml.load(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except (yaml.YAMLError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise FileFormatError(f"{path} is no mapping in YAML, expected a file of MoveIt; correct the file")
    return found
