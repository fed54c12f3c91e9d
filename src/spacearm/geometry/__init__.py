"""Shapes, scenes and meshes."""

from spacearm.geometry.enclosing_balls import enclose_mesh, enclose_points
from spacearm.geometry.scene import Obstacle, Scene
from spacearm.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, SphereSet, pose

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "HalfSpace",
    "Obstacle",
    "Scene",
    "Sphere",
    "SphereSet",
    "enclose_mesh",
    "enclose_points",
    "pose",
]
