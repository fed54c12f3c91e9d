"""Planes between a body and a solid, and whether the body stays beyond its plane for a whole stretch.

If n . x >= c for every point x of a body and n . y < c for every point y of a solid, the two are apart, whoever proposed n:
this is all that a proof rests on. The clearance at a stretch's middle is at least the gap along n; in the stretch the body
loses no more of it than `way`, nor than its speed along n and `bend` allow.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.bodies import Bodies, RelativeBodies
from spacearm.proof.middles import Middles
from spacearm.proof.pairs import Tasks
from spacearm.proof.solids import Balls, Boxes, Solids, body_axes

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

GUARD = 1e-9
"""[m] for the rounding of what is a few metres in size; more for what is larger."""

_RELATIVE_GUARD = 1e-13
_LEAST = 1e-140  # [m] shorter, the squares of a direction's parts have no digits left, and its length is anything
_TURNS = 4  # of falling from segment to solid and back


class Gaps(NamedTuple):
    """What is known of pairs (t,), in [m].

    Attributes:
        left: proven for the whole stretch: the clearance is more than this.
        least: proven at the middle.
        most: the clearance at the middle is at most this.
    """

    left: Array
    least: Array
    most: Array

    def some(self, which: Indices | NDArray[np.bool_]) -> Gaps:
        """Return some of them."""
        return Gaps(*(column[which] for column in self))


def gaps(
    middles: Middles,
    bodies: Bodies,
    relative_bodies: RelativeBodies,
    tasks: Tasks,
    solids: Solids,
    *,
    enough: float,
    n: Array | None = None,
) -> Gaps:
    """Bound the clearance of pairs, at the middles and for the whole stretches.

    Args:
        middles: where the bodies are.
        bodies, relative_bodies: of the robot.
        tasks: the pairs.
        solids: those that the tasks name.
        enough: once `left` exceeds this [m] it is not made any better.
        n: (t, 3) directions in the inertial frame from solid to body, of any length; those that are none prove nothing.
            None: those to the nearest point.
    """
    stretch, body, k = tasks.stretch, relative_bodies.body[tasks.relative], tasks.solid
    axes, origin = solids.placed(k)
    x = middles.position[stretch, body] - origin[:, None]  # (t, e, 3)
    if axes is not None:
        x = x @ axes  # a row times R is R^T x
    toward, apart = _proposed(x, solids, k)
    if n is not None:
        toward = _unit(n if axes is None else np.einsum("tc,tcd->td", n, axes))
    none = apart < _LEAST if n is None else (apart < _LEAST) | ~toward.any(axis=1)
    radii = bodies.radius[body] + solids.radius[k]
    guard = GUARD + _RELATIVE_GUARD * (np.sqrt(np.einsum("tec,tec->t", x, x)) + _length(origin))
    height = np.einsum("tc,tec->te", toward, x)
    at_middle = height - (solids.support(k, toward) + radii + guard)[:, None]  # (t, e)
    at_middle[none] = -np.inf  # inside the core, or no direction was found
    row = middles.row[tasks.relative]
    way = middles.way[stretch, row]
    left = (at_middle - way).min(axis=1)
    short = np.flatnonzero(left <= enough)
    if short.size:
        at = stretch[short], row[short]
        velocity = middles.velocity[at] if axes is None else middles.velocity[at] @ axes[short]
        speed = np.abs(np.einsum("tc,tec->te", toward[short], velocity))
        loss = speed * middles.half[at[0], None] + middles.bend[at]
        left[short] = (at_middle[short] - np.minimum(loss, way[short])).min(axis=1)
    return Gaps(left, at_middle.min(axis=1), apart - radii)


def link_solids(bodies: Bodies, middles: Middles) -> Balls | Boxes:
    """Return the robot's own bodies as solids where they are, r times b of them: body k of stretch i is number i b + k."""
    count, one_end = len(middles.half), bodies.ends.shape[1] == 1
    radius = np.tile(bodies.radius, count)
    none = np.zeros(len(radius), np.intp)
    center = middles.position.mean(axis=2).reshape(-1, 3)
    if one_end:
        return Balls(center=center, radius=radius, obstacle=none, first=none, count=none)
    half = np.zeros((len(radius), 3))
    half[:, 2] = np.tile(np.linalg.norm(bodies.ends[:, 1] - bodies.ends[:, 0], axis=1) / 2, count)
    axes = middles.frames[:, bodies.joint, :3, :3] @ body_axes(bodies)
    return Boxes(axes=axes.reshape(-1, 3, 3), origin=center, half=half, radius=radius, obstacle=none)


def _proposed(x: Array, solids: Solids, k: Indices) -> tuple[Array, Array]:
    """Return a direction from solid to body, (t, 3), and the distance (t,) of two points of the body's axis and the core.

    A point's is exact. A segment's comes from falling to and fro between the two, from the best of its ends and middle.
    """
    point = x[:, 0]
    if x.shape[1] == 2:
        middle = x.mean(axis=1)
        starts = np.stack([x[:, 0], middle, x[:, 1]])
        apart = [_length(start - solids.nearest(k, start)) for start in starts]
        point = starts[np.argmin(apart, axis=0), np.arange(len(x))]
        along = x[:, 1] - x[:, 0]
        squared = np.maximum(np.einsum("tc,tc->t", along, along), _LEAST)
        for _ in range(_TURNS):
            away = solids.nearest(k, point) - x[:, 0]
            share = np.clip(np.einsum("tc,tc->t", away, along) / squared, 0.0, 1.0)
            point = x[:, 0] + share[:, None] * along
    away = point - solids.nearest(k, point)
    length = _length(away)
    return away / np.maximum(length, _LEAST)[:, None], length


def _unit(n: Array) -> Array:
    """Return directions (t, 3) with length 1, whoever proposed them; 0 for those that are none.

    All that a plane proves rests on |n| <= 1: a longer n tells of a gap that is not there.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        n = n / np.abs(n).max(axis=1)[:, None]  # so that no square is too small or too large to be a number
        n = n / _length(n)[:, None]
    return np.where(np.isfinite(n).all(axis=1, keepdims=True), n, 0.0)


def _length(v: Array) -> Array:
    return np.sqrt(np.einsum("tc,tc->t", v, v))
