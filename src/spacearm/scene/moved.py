"""A scene told in another frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import product
from spacearm.scene.obstacles import Obstacle, Scene
from spacearm.scene.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere

Array = NDArray[np.float64]


def moved_scene(scene: Scene, T: Array) -> Scene:
    """Return a scene with every point p of it at T p; names stay.

    Args:
        scene: the obstacles.
        T: (4, 4) a rigid transform [m].
    """
    return Scene([_moved(obstacle, T) for obstacle in scene.obstacles])


def _moved(obstacle: Obstacle, T: Array) -> Obstacle:
    def at(points: Array) -> Array:
        return product(points, T[:3, :3].T) + T[:3, 3]

    if isinstance(obstacle, Sphere):
        return replace(obstacle, center=at(obstacle.center))
    if isinstance(obstacle, Capsule):
        return replace(obstacle, a=at(obstacle.a), b=at(obstacle.b))
    if isinstance(obstacle, (Box, Cylinder)):
        return replace(obstacle, pose=product(T, obstacle.pose))
    if isinstance(obstacle, HalfSpace):
        return replace(obstacle, normal=product(T[:3, :3], obstacle.normal), point=at(obstacle.point))
    return replace(obstacle, centers=at(obstacle.centers))
