"""What is in the way: obstacles, and the scene they make up."""

from spacearm.scene.obstacles import Obstacle, Scene, Sphere

__all__ = ["Obstacle", "Scene", "Sphere"]
