"""Capsules that stand out as little as their number allows, rather than those of least volume.

A capsule of more radius may be shorter, so that its ends stand out less; and one that lies across its piece may stand out
less than one along it. For each piece in turn the axis and the radius are chosen by how far the capsule stands out where no
other one is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.capsule_fit import Segment, across, axis_ends, outermost, own_axes, smallest_circle
from spacearm.robot.segments import point_segment_distance

Array = NDArray[np.float64]

_GROWTH = np.array([0.0, 0.01, 0.03, 0.06, 0.1, 0.15, 0.21, 0.28, 0.36, 0.45])  # by how much of itself a radius may grow
_ON_SURFACE = 150  # points of each capsule that is tried
_FEW = 160  # points of a piece that a capsule is fitted to


def closer(pieces: Sequence[Array], capsules: Sequence[Segment], away: Callable[[Array], Array]) -> list[Segment]:
    """Fit capsules to pieces anew, each so that it stands out least.

    Args:
        pieces: triangles (k, 3, 3) of each [m].
        capsules: one around each piece.
        away: tells how far points (m, 3) are from the whole shape, 0 inside; of points in one of the capsules it need not be
            right.

    Returns:
        One capsule around each piece.
    """
    out = list(capsules)
    for i, piece in enumerate(pieces):
        points = piece.reshape(-1, 3)
        tried = [out[i], *_candidates(points)]
        out[i] = tried[int(np.argmin(_standing_out(tried, out[:i] + out[i + 1 :], away)))]
    return out


def _candidates(points: Array) -> list[Segment]:
    few = outermost(points, _FEW)
    found = []
    for direction in own_axes(few):
        (x,), (y,) = across(direction[None])
        flat = few @ np.column_stack([x, y])
        middle = smallest_circle(flat)
        distance = np.linalg.norm(flat - middle, axis=1)
        first, last, _ = axis_ends(few @ direction, distance, float(distance.max()) * (1 + _GROWTH))
        origin = middle[0] * x + middle[1] * y
        for a, b in zip(first.tolist(), last.tolist(), strict=True):
            low, high = (a, b) if a < b else ((a + b) / 2, (a + b) / 2)
            ends = origin + low * direction, origin + high * direction
            found.append(Segment(*ends, float(point_segment_distance(points, *ends).max())))
    return found


def _standing_out(tried: Sequence[Segment], others: Sequence[Segment], away: Callable[[Array], Array]) -> Array:
    """Return how far each capsule stands out at most where it is in no other (t,) [m]."""
    points = np.concatenate([surface_points(capsule, _ON_SURFACE) for capsule in tried])
    free = np.ones(len(points), dtype=bool)
    for other in others:
        free[free] = point_segment_distance(points[free], other.a, other.b) > other.radius
    out = np.zeros(len(points))
    out[free] = away(points[free])
    return out.reshape(len(tried), -1).max(axis=1)


def surface_points(capsule: Segment, count: int) -> Array:
    """Spread points evenly over a capsule's surface, (count, 3)."""
    axis = capsule.b - capsule.a
    length = float(np.linalg.norm(axis))
    z = axis / length if length > 0 else np.array([0.0, 0.0, 1.0])
    (x,), (y,) = across(z[None])
    k = np.arange(count)
    turn = k * np.pi * (3 - np.sqrt(5))
    height = (2 * k + 1) / count * (length / 2 + capsule.radius) - (length / 2 + capsule.radius)
    height[0], height[-1] = -length / 2 - capsule.radius, length / 2 + capsule.radius  # the poles stand out most
    past = np.maximum(np.abs(height) - length / 2, 0.0)
    radius = np.sqrt(np.maximum(capsule.radius**2 - past**2, 0.0))
    around = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    return (capsule.a + capsule.b) / 2 + height[:, None] * z + radius[:, None] * around
