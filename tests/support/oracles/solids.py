"""Signed distances in plain NumPy, from the definition of each shape: outside the way to the surface, inside minus that."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Polytope, PolytopeSet, Sphere, SphereSet


def point_distance(obstacle: Obstacle, p: np.ndarray) -> np.ndarray:
    """Signed distances (...) [m] of points (..., 3) to an obstacle, a set of spheres being their union."""
    if isinstance(obstacle, Sphere):
        return np.linalg.norm(p - obstacle.center, axis=-1) - obstacle.radius
    if isinstance(obstacle, SphereSet):
        every = [point_distance(Sphere(c, float(r)), p) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]
        return np.min(every, axis=0)
    if isinstance(obstacle, HalfSpace):
        return (p - obstacle.point) @ obstacle.normal
    if isinstance(obstacle, Capsule):
        return from_segments(p, obstacle.a, obstacle.b) - obstacle.radius
    local = (p - obstacle.pose[:3, 3]) @ obstacle.pose[:3, :3]
    if isinstance(obstacle, Box):
        return _outside(np.abs(local) - obstacle.size / 2)
    assert isinstance(obstacle, Cylinder)
    radial = np.hypot(local[..., 0], local[..., 1]) - obstacle.radius
    return _outside(np.stack([radial, np.abs(local[..., 2]) - obstacle.length / 2], axis=-1))


def has_definition(obstacle: Obstacle) -> bool:
    """Whether `point_distance` knows a shape: polytopes and rounded shapes are left to Coal."""
    return not isinstance(obstacle, (Polytope, PolytopeSet)) and not getattr(obstacle, "rounding", 0.0)


def _outside(beyond: np.ndarray) -> np.ndarray:
    """Distance to where all coordinates are below 0, which bounds a convex shape by planes at right angles."""
    return np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(axis=-1), 0)


def from_segments(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances (...) [m] of points (..., 3) from segments from a to b."""
    axis, squared = b - a, ((b - a) ** 2).sum(axis=-1)
    along = ((p - a) * axis).sum(axis=-1) / np.where(squared > 1e-200, squared, 1.0)
    return np.linalg.norm(p - a - np.clip(along, 0, 1)[..., None] * axis, axis=-1)


def axes_distance(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Least distances (...) [m] between the points of segments from a to b (..., 3) and those of segments from c to d."""
    return least_on_segments(lambda p: from_segments(p, c, d), a, b)


def least_on_segments(distance: Callable[[np.ndarray], np.ndarray], a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The least of a function of points (..., 3) over segments from a to b (..., 3), along which it is convex.

    By golden section: the least is never in the part beside the greater of two values. No slope is used, and no bound.
    """
    golden = (5**0.5 - 1) / 2
    at = lambda t: a + t[..., None] * (b - a)  # noqa: E731
    low, high = np.zeros(a.shape[:-1]), np.ones(a.shape[:-1])
    one, two = high - golden, low + golden
    d_one, d_two = distance(at(one)), distance(at(two))
    least = np.minimum(np.minimum(distance(a), distance(b)), np.minimum(d_one, d_two))
    for _ in range(75):
        right = d_one > d_two
        low, high = np.where(right, one, low), np.where(right, high, two)
        kept, d_kept = np.where(right, two, one), np.where(right, d_two, d_one)
        new = np.where(right, low + golden * (high - low), high - golden * (high - low))
        d_new = distance(at(new))
        least = np.minimum(least, d_new)
        one, two = np.where(right, kept, new), np.where(right, new, kept)
        d_one, d_two = np.where(right, d_kept, d_new), np.where(right, d_new, d_kept)
    return least


def link_distance(obstacle: Obstacle, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Least signed distance (...) [m] of the points of segments from a to b (..., 3) to an obstacle."""
    if isinstance(obstacle, SphereSet):  # not convex
        every = [link_distance(Sphere(c, float(r)), a, b) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]
        return np.min(every, axis=0)
    return least_on_segments(lambda p: point_distance(obstacle, p), a, b)


def far(obstacle: Obstacle) -> float:
    """How far from the origin an obstacle's numbers go [m]."""
    if isinstance(obstacle, Sphere):
        return float(np.linalg.norm(obstacle.center) + obstacle.radius)
    if isinstance(obstacle, SphereSet):
        return float((np.linalg.norm(obstacle.centers, axis=1) + obstacle.radii).max())
    if isinstance(obstacle, Capsule):
        return float(max(np.linalg.norm(obstacle.a), np.linalg.norm(obstacle.b)) + obstacle.radius)
    if isinstance(obstacle, HalfSpace):
        return float(np.linalg.norm(obstacle.point))
    if isinstance(obstacle, PolytopeSet):
        return max(map(far, obstacle.pieces))
    if isinstance(obstacle, Polytope):
        return float(np.linalg.norm(obstacle.vertices, axis=1).max() + obstacle.rounding)
    extent = np.linalg.norm(obstacle.size) if isinstance(obstacle, Box) else obstacle.radius + obstacle.length
    return float(np.linalg.norm(obstacle.pose[:3, 3]) + extent)
