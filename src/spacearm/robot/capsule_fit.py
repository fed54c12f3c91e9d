"""Capsules around points and around boxes: the smallest one, or those that stand out least.

The smallest capsule around points: for a direction of the axis, the points seen along it have a smallest enclosing circle, and
its middle is where the axis goes. The radius is that of the circle or larger: the larger it is, the further the ends may be
pulled in, and the volume decides. Directions are tried all over the half sphere, and the best are refined.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.capsules import point_segment_distance

Array = NDArray[np.float64]


class Segment(NamedTuple):
    """A capsule without a name: two ends, (3,) each, and a radius [m]."""

    a: Array
    b: Array
    radius: float

    @property
    def volume(self) -> float:
        """Its volume [m^3]."""
        return capsule_volume(float(np.linalg.norm(self.b - self.a)), self.radius)


_FEW = 160  # points to fit to; of more points, the outermost ones in this number of directions come first
_GROWTH = np.concatenate([[0.0], np.geomspace(1e-3, 4.0, 24)])  # by how much of itself the radius may grow
_ROUGH_GROWTH = np.array([0.0, 0.003, 0.01, 0.03, 0.06, 0.1, 0.2, 0.4, 0.7])
_ROUNDS = 20  # in which points that were left out and lie outside are taken in
_ENOUGH = 20_000  # points to choose the outermost from
_FINEST = 5e-3  # share of the radius by which the last step in refining moves the ends
_FINEST_TURN = 1e-4  # [rad]
_TURNS = 40


def fit_capsule(points: Array, *, refine: bool = True) -> Segment:
    """Enclose points (k, 3) [m], at least one, and so their convex hull, in a capsule of nearly the least volume.

    Args:
        points: the points.
        refine: turn the axis until the volume no longer falls; else leave it in the best of a few directions.

    Returns:
        The capsule; its radius is the distance of the farthest point from the segment.
    """
    few = outermost(points)
    best = _best(few, refine)
    distance = point_segment_distance(points, best.a, best.b)
    for _ in range(_ROUNDS):
        if float(distance.max()) <= best.radius * (1 + 1e-9):
            break
        few = np.vstack([few, points[np.argsort(distance)[-10:]]])
        best = _best(few, refine)
        distance = point_segment_distance(points, best.a, best.b)
    return Segment(best.a, best.b, float(distance.max()))


def rough_volume(points: Array) -> float:
    """Return about the volume of the smallest capsule around points (k, 3) [m^3], quickly."""
    return float(_rough_volumes(outermost(points, 60), own_axes(points)).min())


def capsule_volume(length: float, radius: float) -> float:
    """Return the volume of a capsule whose axis has a length [m^3]."""
    return math.pi * radius * radius * (length + 4 / 3 * radius)


def union_volume(capsules: Sequence[Segment], count: int) -> float:
    """Measure the volume of capsules together by `count` points, spread evenly over the box around them [m^3]."""
    if len(capsules) == 1:
        return capsules[0].volume
    ends = np.array([(capsule.a, capsule.b) for capsule in capsules])
    radii = np.array([capsule.radius for capsule in capsules])[:, None, None]
    low, high = (ends - radii).min(axis=(0, 1)), (ends + radii).max(axis=(0, 1))
    # An additive recurrence in three dimensions, by the powers of the root of x^4 = x + 1: the same each time.
    root = 1.2207440846057596
    points = low + (0.5 + np.outer(np.arange(count), [1 / root, 1 / root**2, 1 / root**3])) % 1.0 * (high - low)
    inside = np.zeros(len(points), dtype=bool)
    for capsule in capsules:
        inside |= point_segment_distance(points, capsule.a, capsule.b) <= capsule.radius
    return float(inside.mean() * np.prod(high - low))


def along(points: Array, direction: Array) -> Segment:
    """Enclose points (k, 3) in the smallest capsule whose axis has a direction, of length 1, and passes the middle of
    their circle.
    """
    (x,), (y,) = across(direction[None])
    flat = points @ np.column_stack([x, y])
    middle = smallest_circle(flat)
    first, last, radius = shortest_axis(points @ direction, np.linalg.norm(flat - middle, axis=1))
    origin = middle[0] * x + middle[1] * y
    return Segment(origin + first * direction, origin + last * direction, radius)


def shortest_axis(at: Array, distance: Array) -> tuple[float, float, float]:
    """Choose the ends and the radius of a capsule on a given line.

    Args:
        at: (k,) where along the line the points are [m].
        distance: (k,) from it [m].

    Returns:
        First and last place on the line, and the radius [m], of least volume: a point is inside if the segment
        comes within sqrt(radius^2 - distance^2) of it.
    """
    least = float(distance.max())
    ball = float(np.hypot(at - (at.max() + at.min()) / 2, distance).max())  # needs no length at all
    radii = np.minimum(least * (1 + _GROWTH), max(ball, least))
    best = int(np.argmin(axis_ends(at, distance, radii)[2]))
    radii = np.linspace(radii[max(best - 1, 0)], radii[min(best + 1, len(radii) - 1)], 9)
    firsts, lasts, volumes = axis_ends(at, distance, radii)
    best = int(np.argmin(volumes))
    first, last = float(firsts[best]), float(lasts[best])
    if last < first:  # one ball holds them all, and may be put anywhere between
        first = last = (first + last) / 2
    return first, last, float(radii[best])


def axis_ends(at: Array, distance: Array, radii: Array) -> tuple[Array, Array, Array]:
    """Return the ends (g,) and (g,) of the shortest axes for given radii (g,), and the volumes (g,)."""
    slack = np.sqrt(np.maximum((radii[:, None] - distance) * (radii[:, None] + distance), 0.0))
    last, first = (at - slack).max(axis=1), (at + slack).min(axis=1)
    return first, last, math.pi * radii * radii * (np.maximum(last - first, 0.0) + 4 / 3 * radii)


def smallest_circle(points: Array) -> Array:
    """Return the middle (2,) of the smallest circle around points (k, 2).

    The farthest point is taken in and the circle of the few that hold it is drawn anew, until none is outside.
    """
    on_circle = [points[int(np.argmax(((points - points[0]) ** 2).sum(axis=1)))]]
    middle, square = on_circle[0], 0.0
    for _ in range(100):
        squares = ((points - middle) ** 2).sum(axis=1)
        farthest = int(np.argmax(squares))
        if squares[farthest] <= square * (1 + 1e-12) or not squares[farthest] > square:
            break
        middle, square, on_circle = _circle_of([*on_circle, points[farthest]])
    return middle


def _circle_of(points: list[Array]) -> tuple[Array, float, list[Array]]:
    """Return the smallest circle of at most four points: its middle, squared radius, and the points on it."""
    best: tuple[Array, float, list[Array]] | None = None
    n = len(points)
    for i in range(n):
        for j in range(i + 1, n):
            pair = [points[i], points[j]]
            best = _better(best, (pair[0] + pair[1]) / 2, pair, points)
            for k in range(j + 1, n):
                three = [*pair, points[k]]
                middle = _circumcentre(*three)
                if middle is not None:
                    best = _better(best, middle, three, points)
    return best if best is not None else (points[0], 0.0, points[:1])


def _better(
    best: tuple[Array, float, list[Array]] | None, middle: Array, on: list[Array], points: list[Array]
) -> tuple[Array, float, list[Array]] | None:
    square = max(float((p[0] - middle[0]) ** 2 + (p[1] - middle[1]) ** 2) for p in points)
    return (middle, square, on) if best is None or square < best[1] else best


def _circumcentre(a: Array, b: Array, c: Array) -> Array | None:
    (bx, by), (cx, cy) = b - a, c - a
    d = 2 * float(bx * cy - by * cx)
    if d == 0.0:
        return None
    b2, c2 = bx * bx + by * by, cx * cx + cy * cy
    return a + np.array([cy * b2 - by * c2, bx * c2 - cx * b2]) / d


def _best(points: Array, refine: bool) -> Segment:
    axes = np.vstack([own_axes(points), _hemisphere(40)])
    promising = np.argsort(_rough_volumes(points, axes), kind="stable")[:3]
    found = sorted(((along(points, axes[i]), axes[i]) for i in promising), key=lambda pair: pair[0].volume)
    if not refine:
        return found[0][0]
    return min((_refined(points, *pair) for pair in found[:2]), key=lambda capsule: capsule.volume)


def own_axes(points: Array) -> Array:
    """Return the main axes of points, and the coordinate axes, (k, 3)."""
    spread = points - points.mean(axis=0)
    main = np.linalg.eigh(spread.T @ spread)[1].T
    return np.vstack([np.eye(3), main[np.abs(main).max(axis=1) < 1 - 1e-6]])


def _rough_volumes(points: Array, directions: Array) -> Array:
    """Return about the volumes of the smallest capsules along directions (d, 3), and never less: (d,)."""
    x, y = across(directions)
    at, u, v = directions @ points.T, x @ points.T, y @ points.T  # (d, k)
    rows = np.arange(len(directions))
    cu, cv = (u.max(axis=1) + u.min(axis=1)) / 2, (v.max(axis=1) + v.min(axis=1)) / 2
    square = (u - cu[:, None]) ** 2 + (v - cv[:, None]) ** 2
    for step in range(3, 9):  # towards the farthest point, by less and less
        far = np.argmax(square, axis=1)
        mu, mv = cu + (u[rows, far] - cu) / step, cv + (v[rows, far] - cv) / step
        moved = (u - mu[:, None]) ** 2 + (v - mv[:, None]) ** 2
        better = moved.max(axis=1) < square.max(axis=1)
        cu, cv = np.where(better, mu, cu), np.where(better, mv, cv)
        square = np.where(better[:, None], moved, square)
    radii = np.sqrt(square.max(axis=1))[:, None] * (1 + _ROUGH_GROWTH)  # (d, g)
    slack = np.sqrt(np.maximum(radii[:, :, None] ** 2 - square[:, None], 0.0))  # (d, g, k)
    length = np.maximum((at[:, None] - slack).max(axis=2) - (at[:, None] + slack).min(axis=2), 0.0)
    return (math.pi * radii * radii * (length + 4 / 3 * radii)).min(axis=1)


def across(directions: Array) -> tuple[Array, Array]:
    """Complete directions (d, 3), of length 1, to right-handed axes x, y, direction."""
    x = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    x = x - (x * directions).sum(axis=1, keepdims=True) * directions
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    yzx, zxy = [1, 2, 0], [2, 0, 1]
    return x, directions[:, yzx] * x[:, zxy] - directions[:, zxy] * x[:, yzx]


def _refined(points: Array, best: Segment, axis: Array) -> Segment:
    """Turn the axis by smaller and smaller steps, as long as the volume falls."""
    step = 0.1
    for _ in range(_TURNS):
        if step * float(np.linalg.norm(best.b - best.a)) < _FINEST * best.radius or step < _FINEST_TURN:
            break
        (x,), (y,) = across(axis[None])
        turned = [axis + step * side for side in (x, y, -x, -y)]
        tried = [(along(points, u / np.linalg.norm(u)), u / np.linalg.norm(u)) for u in turned]
        capsule, direction = min(tried, key=lambda pair: pair[0].volume)
        if capsule.volume < best.volume * (1 - 1e-4):
            best, axis = capsule, direction
        else:
            step /= 3
    return best


def outermost(points: Array, count: int = _FEW) -> Array:
    """Return the points among (k, 3) that are about the outermost in any of `count` directions; all, if there are no more."""
    if len(points) <= count:
        return points
    thinned = points[:: max(1, len(points) // _ENOUGH)]
    chosen: set[int] = set()
    for direction in _hemisphere(count // 2):
        at = thinned @ direction
        chosen |= {int(np.argmax(at)), int(np.argmin(at))}
    return thinned[sorted(chosen)]


@cache
def _hemisphere(count: int) -> Array:
    """Return directions (count, 3) spread evenly over half a sphere (a Fibonacci lattice)."""
    k = np.arange(count)
    z, turn = (k + 0.5) / count, k * math.pi * (3 - math.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), z])


_CLOSER_GROWTH = np.array([0.0, 0.01, 0.03, 0.06, 0.1, 0.15, 0.21, 0.28, 0.36, 0.45])  # by how much of itself a radius may grow
_ON_SURFACE = 150  # points of each capsule that is tried


def closer(pieces: Sequence[Array], capsules: Sequence[Segment], away: Callable[[Array], Array]) -> list[Segment]:
    """Fit capsules to pieces anew, each so that it stands out least, rather than with the least volume.

    A capsule of more radius may be shorter, so that its ends stand out less; and one that lies across its piece may stand out
    less than one along it. For each piece in turn the axis and the radius are chosen by how far the capsule stands out where no
    other one is.

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
        first, last, _ = axis_ends(few @ direction, distance, float(distance.max()) * (1 + _CLOSER_GROWTH))
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


_ROUNDING = 1e-12  # share of the radius, so that the corners are inside


@dataclass(frozen=True, slots=True)
class _Grid:
    """Columns along the edge `along`, a given number of them across in each of the other directions."""

    along: int
    numbers: tuple[int, int, int]
    inset: float
    radius: float

    @property
    def excess(self) -> float:
        return self.radius - self.inset


def box_capsules(size: tuple[float, float, float], count: int) -> list[Segment]:
    """Enclose a box about the origin in at most `count` parallel capsules, which stand out as little as that allows.

    The box is cut into columns along one of its edges, a grid of them across, and each column gets a capsule. Where the box is
    w across a column, by v, and the capsule's ends lie d inside the box, the radius is that of the column's corners,
    r^2 = (w/2)^2 + (v/2)^2 + d^2. The capsule stands out by r - min(w/2, v/2, d) at most, along a face's normal: to any other
    side there is more box around it. The least of that over d is at d = min(w, v)/2.

    Of the grids that stand out equally little, the one with the fewest capsules is taken.

    Args:
        size: the three edges [m].
        count: 1 or more.

    Returns:
        The capsules, parallel to one edge of the box, in the box's frame.
    """
    grid = min((_grid(size, numbers) for numbers in _numbers(count)), key=lambda g: (g.excess, math.prod(g.numbers)))
    widths = np.array(size) / grid.numbers
    half = np.zeros(3)
    half[grid.along] = size[grid.along] / 2 - grid.inset
    capsules = []
    for place in itertools.product(*(range(number) for number in grid.numbers)):
        center = (np.array(place) + 0.5) * widths - np.array(size) / 2
        capsules.append(Segment(center - half, center + half, grid.radius * (1 + _ROUNDING)))
    return capsules


def _numbers(count: int) -> list[tuple[int, int, int]]:
    """List how many columns lie in each direction; along one of them, one."""
    pairs = [(i, k) for i in range(1, count + 1) for k in range(1, count // i + 1)]
    return [tuple(np.insert(pair, along, 1).tolist()) for along in range(3) for pair in pairs]  # type: ignore[misc]


def _grid(size: tuple[float, float, float], numbers: tuple[int, int, int]) -> _Grid:
    along = numbers.index(1) if numbers.count(1) == 1 else int(np.argmax(np.where(np.array(numbers) == 1, size, -1.0)))
    halves = [size[i] / numbers[i] / 2 for i in range(3) if i != along]
    inset = min(*halves, size[along] / 2)
    return _Grid(along, numbers, inset, math.hypot(*halves, inset))
