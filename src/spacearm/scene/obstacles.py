"""Scenes: the obstacles around the arm."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from spacearm.checks import Frozen, is_a_row, shown
from spacearm.errors import SceneError
from spacearm.scene.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, SphereSet

Obstacle: TypeAlias = Sphere | Capsule | Box | Cylinder | HalfSpace | SphereSet
"""Any shape a scene may hold."""

_SHAPES = (Sphere, Capsule, Box, Cylinder, HalfSpace, SphereSet)


@dataclass(frozen=True, slots=True, eq=False)
class Scene(Frozen):
    """What the arm must keep clear of.

    Attributes:
        obstacles: any iterable of obstacles; kept as a tuple. Empty is allowed: free space.

    Raises:
        SceneError: something that is no obstacle; its place is named.
    """

    obstacles: tuple[Obstacle, ...] = ()

    if TYPE_CHECKING:  # what is taken is wider than what is kept

        def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None: ...

    def __post_init__(self) -> None:
        given: Any = self.obstacles
        if isinstance(given, (*_SHAPES, str, bytes, dict)) or not is_a_row(given):
            raise SceneError(f"obstacles is {shown(given)}, expected a list of them; write Scene([Sphere(...), ...])")
        obstacles = tuple(given)
        for i, item in enumerate(obstacles):
            if not isinstance(item, _SHAPES):
                names = ", ".join(shape.__name__ for shape in _SHAPES)
                raise SceneError(f"obstacles[{i}] is {shown(item)}, expected an obstacle: {names}")
        object.__setattr__(self, "obstacles", obstacles)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was found and assumed in enclosing its meshes, a sentence each, the obstacle named."""
        named = [(self.called(i), item) for i, item in enumerate(self.obstacles) if isinstance(item, SphereSet)]
        return tuple(f"obstacle {name}: {note}" for name, item in named for note in item.notes)

    def called(self, index: int) -> str:
        """Return what a message calls an obstacle: its name, or its place in the list."""
        name = self.obstacles[index].name
        return f"'{name}'" if name else f"{index}"
