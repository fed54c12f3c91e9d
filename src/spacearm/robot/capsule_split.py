"""Few capsules around a surface: cut it by planes where that pays, and enclose each piece.

A capsule is convex, so it holds a piece of a triangle if it holds its corners. The solid behind the surface
lies inside as well, not only its skin: where the planes have one or two normals, a line through any point of
the solid that runs along all the planes leaves it on both sides within its piece. With three normals there is
no such line; then each cut closes both parts with the convex hull of where the plane meets the surface.

Up to three capsules are chosen by their volume, with a price for each, since each costs time in every check. Who allows more
wants a closer envelope: then what stands out least is chosen.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.capsule_closer import closer
from spacearm.robot.capsule_fit import Segment, across, fit_capsule, outermost, rough_volume, union_volume
from spacearm.robot.excess import Excess

Array = NDArray[np.float64]

_PRICE = 0.2  # share of the volume that each further capsule must save, since each costs time in every check;
CHOSEN_BY_VOLUME = 3
"""How many capsules are chosen by their volume; of more it is how far they stand out that decides."""
_PAYS = 0.98  # times what stands out with fewer: more must stand out less than that
_SWOLLEN = 1.25  # times the volume of the few: more must not take up more room than that
_CLOSE = 0.01  # of the shape's size: what stands out no more needs no further capsules
_GRIDS = 2  # ways to cut into so many parts that are looked at closely
_MANY = 1200  # triangles; of larger surfaces a selection of points tells where to cut
_PLACES = 5  # cuts tried along each direction
_IN_VOLUME = 6000  # points by which the volume of a plan is measured
_HALVINGS = 3  # of the distance between them, in placing the best


@dataclass(frozen=True, slots=True)
class Plane:
    """All points p with normal . p = offset; the normal (3,) has length 1."""

    normal: Array
    offset: float


Plan = list[tuple[int, Plane]]
"""Cuts, one after the other: which piece, and where; its two parts take its place in the list."""


def enclose(triangles: Array, count: int, excess: Excess | None = None) -> list[Segment]:
    """Enclose a surface, and what is inside it, in at most `count` capsules.

    Args:
        triangles: (k, 3, 3) corners [m], at least one.
        count: 1 or more. Fewer are used where more do not pay. Of up to three, what must fall is the volume of all together,
            times 1 + 0.2 per further capsule; of more, how far they stand out, by 2 %.
        excess: measures how far capsules stand out [m]; without it the volume decides for any count.
    """
    best = _of_least_volume(triangles, count if excess is None else min(count, CHOSEN_BY_VOLUME))
    return best if excess is None or count <= CHOSEN_BY_VOLUME else _of_least_excess(triangles, best, count, excess)


def _of_least_excess(triangles: Array, best: list[Segment], count: int, excess: Excess) -> list[Segment]:
    """Return the capsules that stand out least.

    What is tried for a number of parts does not depend on how many are allowed, so that allowing more never makes it worse.
    """
    rough = _selection(triangles)
    plans: dict[int, list[tuple[float, Plan]]] = {}
    for plan in _grids(rough, count):
        plans.setdefault(_parts_of(plan), []).append((_rough_sum(rough, plan), plan))
    greedy = {len(plan) + 1: plan for plan in _greedy(rough, count)}
    least, most = excess(best), _SWOLLEN * union_volume(best, _IN_VOLUME)
    close = _CLOSE * float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    for number in range(2, count + 1):
        if least <= close:
            break
        chosen = sorted(plans.get(number, []), key=lambda one: one[0])[:_GRIDS]
        tried: list[list[Segment]] = []
        for plan in [plan for _, plan in chosen] + [greedy[number]] * (number in greedy):
            pieces = _pieces(triangles, plan)
            capsules = [fit_capsule(piece.reshape(-1, 3), refine=False) for piece in pieces]
            tried += [capsules, closer(pieces, capsules, excess.about)]
        for capsules in tried:
            out = excess(capsules)
            if out < _PAYS * least and union_volume(capsules, _IN_VOLUME) < most:
                best, least = capsules, out
    return best


def _parts_of(plan: Plan) -> int:
    return len(plan) + 1


def _rough_sum(rough: Array, plan: Plan) -> float:
    return sum(_volume(piece) for piece in _pieces(rough, plan))


def _of_least_volume(triangles: Array, count: int) -> list[Segment]:
    best = [triangles]
    least = fit_capsule(triangles.reshape(-1, 3), refine=False).volume if count > 1 else 0.0
    for plan in _promising(_selection(triangles), count) if count > 1 else ():
        pieces = _pieces(triangles, plan)
        capsules = [fit_capsule(piece.reshape(-1, 3), refine=False) for piece in pieces]
        cost = union_volume(capsules, _IN_VOLUME) * (1 + _PRICE * (len(capsules) - 1))
        if cost < least:
            best, least = pieces, cost
    return [fit_capsule(piece.reshape(-1, 3)) for piece in best]


def cut(triangles: Array, plane: Plane, *, lids: bool = False) -> tuple[Array, Array]:
    """Cut a surface (k, 3, 3) into what is behind a plane and what is before it.

    Args:
        triangles: the corners [m].
        plane: where to cut.
        lids: close both parts with the convex hull of where the plane meets the surface.
    """
    signed = triangles @ plane.normal - plane.offset  # (k, 3)
    before = signed > 0
    crossing = before.any(axis=1) & ~before.all(axis=1)
    behind_whole, before_whole = triangles[~before.any(axis=1)], triangles[before.all(axis=1)]
    if not crossing.any():
        return behind_whole, before_whole
    T, d, side = triangles[crossing], signed[crossing], before[crossing]
    # Turn each triangle so that the corner which is alone on its side comes first.
    lone_before = side.sum(axis=1) == 1
    lone = np.where(lone_before, np.argmax(side, axis=1), np.argmin(side, axis=1))
    order = (lone[:, None] + np.arange(3)) % 3
    rows = np.arange(len(T))[:, None]
    T, d = T[rows, order], d[rows, order]
    p = T[:, 0] + (d[:, :1] / (d[:, :1] - d[:, 1:2])) * (T[:, 1] - T[:, 0])
    q = T[:, 0] + (d[:, :1] / (d[:, :1] - d[:, 2:3])) * (T[:, 2] - T[:, 0])
    tips = np.stack([T[:, 0], p, q], axis=1)
    rest = np.concatenate([np.stack([p, T[:, 1], T[:, 2]], axis=1), np.stack([p, T[:, 2], q], axis=1)])
    twice = np.concatenate([lone_before, lone_before])
    lid = _lid(np.concatenate([p, q]), plane.normal) if lids else triangles[:0]
    behind = np.concatenate([behind_whole, tips[~lone_before], rest[twice], lid])
    return behind, np.concatenate([before_whole, tips[lone_before], rest[~twice], lid])


def _lid(points: Array, normal: Array) -> Array:
    """Return the convex hull of points (k, 3) on a plane, as triangles."""
    (x,), (y,) = across(normal[None])
    ring = points[_hull(points @ x, points @ y)]
    return np.array([[ring[0], ring[i], ring[i + 1]] for i in range(1, len(ring) - 1)]).reshape(-1, 3, 3)


def _hull(across: Array, up: Array) -> list[int]:
    """List the corners of the convex hull of points in a plane, in turn (Andrew's monotone chain)."""
    order = [int(i) for i in np.lexsort((up, across))]
    x, y = across.tolist(), up.tolist()

    def half(indices: list[int]) -> list[int]:
        chain: list[int] = []
        for i in indices:
            while len(chain) > 1:
                o, p = chain[-2], chain[-1]
                if (x[p] - x[o]) * (y[i] - y[o]) - (y[p] - y[o]) * (x[i] - x[o]) > 0:
                    break
                chain.pop()
            chain.append(i)
        return chain

    lower, upper = half(order), half(order[::-1])
    return lower[:-1] + upper[:-1]


def _pieces(triangles: Array, plan: Plan) -> list[Array]:
    pieces = [triangles]
    lids = np.linalg.matrix_rank(np.array([plane.normal for _, plane in plan]).reshape(-1, 3), tol=1e-9) > 2
    for which, plane in plan:
        pieces[which : which + 1] = cut(pieces[which], plane, lids=bool(lids))
    return [piece for piece in pieces if len(piece)]


def _promising(rough: Array, count: int) -> list[Plan]:
    """Choose, for each number of pieces from 2 to `count`, the plan whose capsules have the least volume in sum."""
    best: dict[int, tuple[float, Plan]] = {}
    for plan in (*_grids(rough, count), *_greedy(rough, count)):
        pieces = _pieces(rough, plan)
        volume = sum(_volume(piece) for piece in pieces)
        if len(pieces) > 1 and volume < best.get(len(pieces), (np.inf, plan))[0]:
            best[len(pieces)] = volume, plan
    return [plan for _, plan in best.values()]


def _grids(rough: Array, count: int) -> Iterator[Plan]:
    """Propose to cut into parts of equal thickness, along one axis, or two, or three."""
    for normals in itertools.chain.from_iterable(itertools.combinations(axes, k) for axes in _frames(rough) for k in (1, 2, 3)):
        for parts in itertools.product(range(2, count + 1), repeat=len(normals)):
            if math.prod(parts) > count:
                continue
            plan: Plan = []
            pieces = 1
            for normal, number in zip(normals, parts, strict=True):
                low, high = _extent(rough, normal)
                offsets = [float(at) for at in np.linspace(low, high, number + 1)[1:-1]]
                plan += [(i * number + k, Plane(normal, at)) for i in range(pieces) for k, at in enumerate(offsets)]
                pieces *= number
            yield plan


def _greedy(rough: Array, count: int) -> Iterator[Plan]:
    """Propose to cut one by one, wherever the most is saved."""
    plan: Plan = []
    pieces, volumes = [rough], [_volume(rough)]
    while len(pieces) < count:
        which = int(np.argmax(volumes))
        split = _best_split(pieces[which])
        if split is None:
            return
        plane, parts = split
        plan = [*plan, (which, plane)]
        pieces[which : which + 1] = parts
        volumes[which : which + 1] = [_volume(part) for part in parts]
        yield plan


def _best_split(piece: Array) -> tuple[Plane, tuple[Array, Array]] | None:
    tried = []
    for normal in np.concatenate(_frames(piece)):
        low, high = _extent(piece, normal)
        tried += [_split(piece, Plane(normal, float(at))) for at in np.linspace(low, high, _PLACES + 2)[1:-1]]
    best = min(tried, key=lambda split: split[0])
    normal = best[1].normal
    low, high = _extent(piece, normal)
    step = (high - low) / (_PLACES + 1)
    for _ in range(_HALVINGS):
        step /= 2
        nearby = [_split(piece, Plane(normal, best[1].offset + side * step)) for side in (-1, 1)]
        best = min(best, *nearby, key=lambda split: split[0])
    return None if best[0] == np.inf else best[1:]


def _split(piece: Array, plane: Plane) -> tuple[float, Plane, tuple[Array, Array]]:
    parts = cut(piece, plane)
    volume = sum(_volume(part) for part in parts) if all(len(part) for part in parts) else np.inf
    return volume, plane, parts


def _volume(piece: Array) -> float:
    return rough_volume(piece.reshape(-1, 3))


def _extent(triangles: Array, normal: Array) -> tuple[float, float]:
    at = triangles.reshape(-1, 3) @ normal
    return float(at.min()), float(at.max())


def _frames(triangles: Array) -> list[Array]:
    """Return the coordinate axes, and the main axes of a surface where they are others, (3, 3) each."""
    points = triangles.reshape(-1, 3)
    spread = points - points.mean(axis=0)
    main = np.linalg.eigh(spread.T @ spread)[1].T
    return [np.eye(3)] if np.abs(main).max(axis=1).min() > 1 - 1e-6 else [np.eye(3), main]


def _selection(triangles: Array) -> Array:
    """Stand in for a surface of many triangles by points of it, each a triangle without extent."""
    if len(triangles) <= _MANY:
        return triangles
    points = triangles.reshape(-1, 3)
    spread = points[:: max(1, len(points) // _MANY)]
    return np.repeat(np.concatenate([outermost(points, 300), spread])[:, None], 3, axis=1)
