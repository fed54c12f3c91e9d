"""What is in the way: obstacles, and the scene they make up."""

from spacearm.scene.enclose import enclose_mesh, enclose_points
from spacearm.scene.obstacles import Obstacle, Scene
from spacearm.scene.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere, SphereSet, pose

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
