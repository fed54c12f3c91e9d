"""Balls that enclose meshes and point clouds."""

from spacearm.scene.enclose.enclosures import enclose_mesh, enclose_points

__all__ = ["enclose_mesh", "enclose_points"]
