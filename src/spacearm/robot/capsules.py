"""Segments with radii, many at once, in NumPy: where a link's capsules are, and how far they are from another's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.model import LinkCapsule, Robot

Array = NDArray[np.float64]

CONTACT = 1e-9
"""[m] links that are nearer than this meet: what touches is never free to move."""


@dataclass(frozen=True, slots=True)
class Axes:
    """The capsules of a link as arrays: joint (k,), -1 for the base; ends a and b (k, 3) in its moving frame; radius (k,)."""

    joint: NDArray[np.intp]
    a: Array
    b: Array
    radius: Array


@dataclass(frozen=True, slots=True)
class PlacedAxes:
    """The same in m configurations, in the base frame: ends a and b (m, k, 3), the same array for spheres; radius (k,)."""

    a: Array
    b: Array
    radius: Array


def axes_of(capsules: Sequence[LinkCapsule]) -> Axes:
    """Gather capsules into arrays."""
    return Axes(
        np.array([capsule.joint for capsule in capsules], dtype=np.intp),
        np.array([capsule.a for capsule in capsules]).reshape(-1, 3),
        np.array([capsule.b for capsule in capsules]).reshape(-1, 3),
        np.array([capsule.radius for capsule in capsules]),
    )


def link_axes(robot: Robot) -> dict[str, Axes]:
    """Gather the capsules of each link of a robot, by its name."""
    links: dict[str, list[LinkCapsule]] = {}
    for capsule in robot.capsules:
        links.setdefault(capsule.name, []).append(capsule)
    return {name: axes_of(capsules) for name, capsules in links.items()}


def placed(axes: Axes, frames: Array) -> PlacedAxes:
    """Place capsules by the base's and the joints' frames (m, 1 + joints, 4, 4)."""
    T = frames[:, axes.joint + 1]  # (m, k, 4, 4)
    R, p = T[..., :3, :3], T[..., :3, 3]
    a = np.einsum("mkij,kj->mki", R, axes.a) + p
    b = a if np.array_equal(axes.a, axes.b) else np.einsum("mkij,kj->mki", R, axes.b) + p
    return PlacedAxes(a, b, axes.radius)


def clearance(first: PlacedAxes, second: PlacedAxes, *, up_to: float = np.inf) -> Array:
    """Return the least signed distance (m,) of any capsule of one link to any of another [m].

    Args:
        first, second: the links.
        up_to: where a ball around each link shows that the distance is more than this, that of the balls will do.
    """
    if up_to == np.inf:
        return _clearance(first, second)
    (c1, r1), (c2, r2) = _ball(first), _ball(second)
    gap = np.linalg.norm(c1 - c2, axis=1) - r1 - r2
    near = gap <= up_to
    if near.any():
        gap[near] = _clearance(_rows(first, near), _rows(second, near))
    return gap


def least_clearance(first: PlacedAxes, second: PlacedAxes) -> tuple[float, float]:
    """Return the least signed distance of two links in m configurations [m], and the share of these in which they meet."""
    (c1, r1), (c2, r2) = _ball(first), _ball(second)
    nearest = np.argsort(np.linalg.norm(c1 - c2, axis=1) - r1 - r2)[:20]
    guess = float(_clearance(_rows(first, nearest), _rows(second, nearest)).min())
    gap = clearance(first, second, up_to=max(guess, CONTACT))
    return float(gap.min()), float((gap < CONTACT).mean())


def _clearance(first: PlacedAxes, second: PlacedAxes) -> Array:
    a1, b1 = first.a[:, :, None], first.b[:, :, None]  # (m, k, 1, 3)
    a2, b2 = second.a[:, None], second.b[:, None]  # (m, 1, l, 3)
    if first.a is first.b and second.a is second.b:
        distance = np.linalg.norm(a1 - a2, axis=-1)
    elif first.a is first.b:
        distance = point_segment_distance(a1, a2, b2)
    elif second.a is second.b:
        distance = point_segment_distance(a2, a1, b1)
    else:
        distance = segment_distance(a1, b1, a2, b2)
    return (distance - (first.radius[:, None] + second.radius)).min(axis=(1, 2))


def _rows(axes: PlacedAxes, chosen: NDArray[Any]) -> PlacedAxes:
    a = axes.a[chosen]
    return PlacedAxes(a, a if axes.a is axes.b else axes.b[chosen], axes.radius)


def _ball(axes: PlacedAxes) -> tuple[Array, Array]:
    """Return the middle (m, 3) and the radius (m,) of a ball around a link."""
    middle = (axes.a.mean(axis=1) + axes.b.mean(axis=1)) / 2
    ends = (axes.a,) if axes.a is axes.b else (axes.a, axes.b)
    reach = np.maximum.reduce([np.linalg.norm(end - middle[:, None], axis=2) for end in ends])
    return middle, (reach + axes.radius).max(axis=1)


def segment_distance(a1: Array, b1: Array, a2: Array, b2: Array) -> Array:
    """Return the distance [m] of segments a1 b1 and a2 b2; points (..., 3) that broadcast against each other.

    The least of five: each end from the other segment, and the two lines where their feet lie inside. Each is
    the distance of two points that are there, so rounding never makes the result too small by more than a
    few units in the last place of the coordinates.
    """
    d1, d2, r = b1 - a1, b2 - a2, a1 - a2
    ends = [
        point_segment_distance(a1, a2, b2),
        point_segment_distance(b1, a2, b2),
        point_segment_distance(a2, a1, b1),
        point_segment_distance(b2, a1, b1),
    ]
    least = np.minimum.reduce(ends)
    d11, d22, d12, c, f = _dot(d1, d1), _dot(d2, d2), _dot(d1, d2), _dot(d1, r), _dot(d2, r)
    determinant = d11 * d22 - d12 * d12
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (d12 * f - c * d22) / determinant, (d11 * f - d12 * c) / determinant
    inside = (s > 0) & (s < 1) & (t > 0) & (t < 1)
    if not inside.any():
        return least
    s, t = np.where(inside, s, 0.0)[..., None], np.where(inside, t, 0.0)[..., None]
    return np.where(inside, np.minimum(least, np.linalg.norm(r + s * d1 - t * d2, axis=-1)), least)


def point_segment_distance(p: Array, a: Array, b: Array) -> Array:
    """Return the distance [m] of points p from segments a b; points (..., 3) that broadcast against each other."""
    d = b - a
    square = _dot(d, d)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(square > 0, _dot(p - a, d) / square, 0.0)
    return np.linalg.norm(p - a - np.clip(share, 0.0, 1.0)[..., None] * d, axis=-1)


def _dot(u: Array, v: Array) -> Array:
    return np.einsum("...i,...i->...", u, v)
