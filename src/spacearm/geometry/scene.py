"""Scenes: the obstacles around the arm, in any frame, and as plain values, which a file holds in full."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Rows, brief, call_if_short, counted, listed
from spacearm.core.checks import Frozen, is_a_row, shown
from spacearm.core.errors import SceneError, nearest
from spacearm.core.exact import product
from spacearm.core.notebook_hook import InNotebooks
from spacearm.core.reading import located
from spacearm.core.records import record_as_dict, record_from_dict
from spacearm.geometry.convex_cores import moved_shape
from spacearm.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Polytope, PolytopeSet, Sphere, SphereSet

Array = NDArray[np.float64]

Obstacle: TypeAlias = Sphere | Capsule | Box | Cylinder | Polytope | HalfSpace | SphereSet | PolytopeSet
"""Any shape a scene may hold."""

_FEW = 8  # obstacles that are printed one by one
_SHAPES: dict[str, type[Obstacle]] = {
    "sphere": Sphere,
    "capsule": Capsule,
    "box": Box,
    "cylinder": Cylinder,
    "polytope": Polytope,
    "half_space": HalfSpace,
    "sphere_set": SphereSet,
    "polytope_set": PolytopeSet,
}
"""The shapes by the names that files give them."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Scene(Frozen, InNotebooks):
    """What the arm must keep clear of.

    Attributes:
        obstacles: any iterable of obstacles; kept as a tuple. Empty is allowed: free space.

    Raises:
        SceneError: something that is no obstacle; its place is named.
    """

    obstacles: tuple[Obstacle, ...] = ()

    if TYPE_CHECKING:  # the constructor takes more types than the fields have

        def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None: ...

    def __post_init__(self) -> None:
        given: Any = self.obstacles
        if isinstance(given, (*_SHAPES.values(), str, bytes, dict)) or not is_a_row(given):
            raise SceneError(f"obstacles is {shown(given)}, expected a list of them; write Scene([Sphere(...), ...])")
        obstacles = tuple(given)
        for i, item in enumerate(obstacles):
            if not isinstance(item, tuple(_SHAPES.values())):
                names = ", ".join(shape.__name__ for shape in _SHAPES.values())
                raise SceneError(f"obstacles[{i}] is {shown(item)}, expected an obstacle: {names}")
        object.__setattr__(self, "obstacles", obstacles)

    def __repr__(self) -> str:
        return (call_if_short(self) if len(self.obstacles) <= _FEW else "") or brief(self)

    def _in_short(self) -> tuple[str, Rows]:
        kinds = Counter(type(item).__name__ for item in self.obstacles).most_common()
        rows = [("shapes", ", ".join(f"{count:,} {kind}" for kind, count in kinds))] if kinds else []
        names = [item.name for item in self.obstacles if item.name]
        if names:
            rows.append(("names", listed(names, 12)))
        rows += [("notes", f"{counted(len(self.notes), 'note')} on enclosed meshes: scene.notes")] if self.notes else []
        return f"Scene: {counted(len(self.obstacles), 'obstacle') if self.obstacles else 'free space'}", rows

    @property
    def notes(self) -> tuple[str, ...]:
        """What was found and assumed in enclosing its meshes, a sentence each, the obstacle named."""
        sets = (SphereSet, PolytopeSet)
        named = [(self.called(i), item) for i, item in enumerate(self.obstacles) if isinstance(item, sets)]
        return tuple(f"obstacle {name}: {note}" for name, item in named for note in item.notes)

    def called(self, index: int) -> str:
        """Return what a message calls an obstacle: its name, or its place in the list."""
        name = self.obstacles[index].name
        return f"'{name}'" if name else f"{index}"


def moved_scene(scene: Scene, T: Array) -> Scene:
    """Return a scene with every point p of it at T p; names stay.

    Args:
        scene: the obstacles.
        T: (4, 4) a rigid transform [m].
    """
    return Scene([_moved(obstacle, T) for obstacle in scene.obstacles])


def _moved(obstacle: Obstacle, T: Array) -> Obstacle:
    if isinstance(obstacle, HalfSpace):
        normal = product(T[:3, :3], obstacle.normal)
        return replace(obstacle, normal=normal, point=product(obstacle.point, T[:3, :3].T) + T[:3, 3])
    if isinstance(obstacle, SphereSet):
        return replace(obstacle, centers=product(obstacle.centers, T[:3, :3].T) + T[:3, 3])
    if isinstance(obstacle, PolytopeSet):
        return replace(obstacle, pieces=tuple(moved_shape(piece, T) for piece in obstacle.pieces))
    return moved_shape(obstacle, T)


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
