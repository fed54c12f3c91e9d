"""Shapes, scenes and meshes."""

from spacearm.geometry.convex_cores import Core, bounding_points, core_of, moved_shape, support
from spacearm.geometry.convex_pieces import convex_pieces
from spacearm.geometry.enclosing_balls import enclose_mesh, enclose_points
from spacearm.geometry.scene import Obstacle, Scene
from spacearm.geometry.shapes import (
    Box,
    Capsule,
    ConvexShape,
    Cylinder,
    HalfSpace,
    Polytope,
    PolytopeSet,
    Sphere,
    SphereSet,
    pose,
)

__all__ = [
    "Box",
    "Capsule",
    "ConvexShape",
    "Core",
    "Cylinder",
    "HalfSpace",
    "Obstacle",
    "Polytope",
    "PolytopeSet",
    "Scene",
    "Sphere",
    "SphereSet",
    "bounding_points",
    "convex_pieces",
    "core_of",
    "enclose_mesh",
    "enclose_points",
    "moved_shape",
    "pose",
    "support",
]
