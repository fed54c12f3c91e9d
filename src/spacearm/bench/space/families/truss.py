"""Reach through a truss: into one of its bays, from outside or from another bay."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from spacearm.bench.space.draft import (
    Draft,
    Site,
    asked_of_the_base,
    direction,
    frame_along,
    hand_at,
    rods,
    tip_at,
    transform,
)
from spacearm.bench.space.robots import light
from spacearm.scene import Capsule

Array = NDArray[np.float64]


def draw(rng: np.random.Generator) -> Draft:
    """Draw a box truss of three bays before the arm, one of them closed by a diagonal; the tip ends inside another.

    The small arm meets a truss of bays of about 0.4 m; Canadarm2 one ten times as large.
    """
    site = _SITES()[int(rng.choice(3, p=[0.4, 0.35, 0.25]))]
    bay, width, depth = rng.uniform(0.38, 0.5), rng.uniform(0.36, 0.46), rng.uniform(0.32, 0.45)
    away = direction(rng.uniform(-math.pi, math.pi), rng.uniform(0.3, 1.3))
    middle = away * rng.uniform(0.42, 0.52)
    T = transform(frame_along(away, rng.uniform(-math.pi, math.pi)), site.at(middle))
    order = rng.permutation(3)
    goal_bay, start_bay, closed = (int(i) - 1 for i in order)
    obstacles = _truss(site, T, (bay, width, depth), rng.uniform(0.012, 0.02), closed)

    def inside(number: int) -> Array:
        across = rng.uniform(-0.25, 0.25, 2) * (bay, width)
        return _placed(site, T, (number * bay + across[0], across[1], rng.uniform(0.06, 0.2)))

    # From the middle bay the way is short; half of the motions begin outside.
    begin = inside(start_bay) if rng.random() < 0.5 else _placed(site, T, (start_bay * bay, 0.0, -rng.uniform(0.1, 0.25)))
    end = inside(goal_bay)
    in_joints = bool(rng.random() < 0.4)
    keep, limits = asked_of_the_base(rng, in_joints=in_joints, peak=(8, 20))
    goal = tip_at(site, end) if rng.random() < 0.5 else hand_at(site, end, T[:3, 2] + rng.normal(0, 0.2, 3))
    return Draft(
        robot=site.robot,
        obstacles=obstacles,
        start=(tip_at(site, begin),),
        goal=(goal,),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
    )


def _SITES() -> tuple[Site, ...]:
    return (
        Site(robot=light("srs7", 100), shoulder=(0, 0, 0.31)),
        Site(robot=light("srs7", 200), shoulder=(0, 0, 0.31)),
        Site(robot=light("ssrms", 14515), shoulder=(0, 0, 4.2), scale=11.0, along="x"),
    )


def _placed(site: Site, T: Array, local: tuple[float, float, float]) -> Array:
    return T[:3, :3] @ (site.scale * np.array(local)) + T[:3, 3]


def _truss(site: Site, T: Array, sizes: tuple[float, float, float], radius: float, closed: int) -> tuple[Capsule, ...]:
    """Chords, battens and diagonals of three bays; the front face is at z = 0 of the frame, the beam runs along x."""
    bay, width, depth = sizes
    corners = [(y, z) for y in (-width / 2, width / 2) for z in (0.0, depth)]
    stations = [bay * (i - 1.5) for i in range(4)]
    ends = [((stations[0], y, z), (stations[3], y, z)) for y, z in corners]  # chords
    for x in stations:  # battens: a frame around the beam
        for one, other in itertools.combinations(corners, 2):
            if one[0] == other[0] or one[1] == other[1]:
                ends.append(((x, *one), (x, *other)))
    for number, (x, y) in enumerate(itertools.pairwise(stations)):  # diagonals: of the back, of a side, and of one window
        flip = 1 if number % 2 else -1
        ends.append(((x, -flip * width / 2, depth), (y, flip * width / 2, depth)))
        ends.append(((x, flip * width / 2, 0.0), (y, flip * width / 2, depth)))
        if number - 1 == closed:
            ends.append(((x, -width / 2, 0.0), (y, width / 2, 0.0)))
    scaled = [(site.scale * np.array(a), site.scale * np.array(b)) for a, b in ends]
    return rods(scaled, radius * site.scale, T, "strut")
