"""Obstacles and scenes. All coordinates are in the base frame at the start, [m]."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import Frozen, as_number, as_readonly, shown
from spacearm.errors import SceneError


@dataclass(frozen=True, slots=True, eq=False)
class Sphere(Frozen):
    """A ball, the paper's enclosure of an obstacle.

    Attributes:
        center: (3,) [m].
        radius: [m], above 0.

    Raises:
        SceneError: a centre that is not three finite numbers, or a radius that is not above 0.
    """

    center: NDArray[np.float64]
    radius: float

    if TYPE_CHECKING:  # what is taken is wider than what is kept

        def __init__(self, center: ArrayLike, radius: float) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", as_readonly("the sphere's center", self.center, (3,), SceneError))
        object.__setattr__(self, "radius", as_number("the sphere's radius", self.radius, SceneError, above=0, unit="m"))


Obstacle: TypeAlias = Sphere
"""Any shape a scene may hold; further shapes join here as a union."""

_SHAPES = (Sphere,)


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
        if isinstance(given, (*_SHAPES, str, bytes, dict)) or not isinstance(given, Iterable):
            raise SceneError(f"obstacles is {shown(given)}, expected a list of them; write Scene([Sphere(...), ...])")
        obstacles = tuple(given)
        for i, item in enumerate(obstacles):
            if not isinstance(item, _SHAPES):
                names = ", ".join(shape.__name__ for shape in _SHAPES)
                raise SceneError(f"obstacles[{i}] is {shown(item)}, expected an obstacle: {names}")
        object.__setattr__(self, "obstacles", obstacles)
