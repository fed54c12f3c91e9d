"""Scenes as plain values, so that a file may hold one in full."""

from __future__ import annotations

from typing import Any

from spacearm.checks import shown
from spacearm.errors import SceneError, nearest
from spacearm.reading import located
from spacearm.records import record_as_dict, record_from_dict
from spacearm.scene.obstacles import Obstacle, Scene
from spacearm.scene.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, SphereSet

_SHAPES: dict[str, type[Obstacle]] = {
    "sphere": Sphere,
    "capsule": Capsule,
    "box": Box,
    "cylinder": Cylinder,
    "half_space": HalfSpace,
    "sphere_set": SphereSet,
}


def scene_as_list(scene: Scene, *, notes: bool = True) -> list[dict[str, Any]]:
    """Return a scene's obstacles as plain values: each a mapping from the shape's name to its attributes.

    Args:
        scene: the obstacles.
        notes: with what was found in enclosing meshes; a hash is made without.
    """
    names = {shape: name for name, shape in _SHAPES.items()}
    every = [(names[type(item)], record_as_dict(item)) for item in scene.obstacles]
    return [{name: {key: value for key, value in values.items() if notes or key != "notes"}} for name, values in every]


def scene_from_list(values: Any) -> Scene:
    """Make a scene of plain values, the same bit for bit as the one that `scene_as_list` was given.

    Raises:
        SceneError: values that are no scene; the obstacle is named.
    """
    if not isinstance(values, list):
        raise SceneError(f"obstacles is {shown(values)}, expected a list")
    return Scene([_obstacle(value, f"obstacles[{i}]") for i, value in enumerate(values)])


def _obstacle(value: Any, what: str) -> Obstacle:
    if not isinstance(value, dict) or len(value) != 1:
        raise SceneError(f"{what} is {shown(value)}, expected a mapping with one key: {', '.join(_SHAPES)}")
    name, attributes = next(iter(value.items()))
    if name not in _SHAPES:
        raise SceneError(f"{what} is a {shown(name)}, which is no shape; {nearest(str(name), _SHAPES)}")
    with located(what):
        return record_from_dict(_SHAPES[name], attributes, name, SceneError)
