"""Along a module with handrails: the hand works close to the hull, and goes from one place to another between the rails."""

from __future__ import annotations

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
    transform,
)
from spacearm.bench.space.robots import light
from spacearm.scene import Cylinder, Obstacle

Array = NDArray[np.float64]

_HULL = 2.2  # radius of the module [m], as of the Space Station's
_RAIL, _STAND_OFF = 0.018, 0.09  # radius of a handrail, and of its axis from the hull [m]
_MASSES = (100.0, 150.0, 250.0)  # of the base [kg]


def draw(rng: np.random.Generator) -> Draft:
    """Draw a hull beside the arm, three to five handrails on it, and two places close to it with a rail between them."""
    site = Site(robot=light("srs7", float(rng.choice(_MASSES))), shoulder=(0, 0, 0.31))
    away = direction(rng.uniform(-math.pi, math.pi), rng.uniform(0.45, 1.3))
    gap = rng.uniform(0.45, 0.6)
    # The hull's frame: z along the module's axis, x out of it towards the arm.
    R = frame_along(-away, rng.uniform(-math.pi, math.pi))[:, [2, 0, 1]]
    T = transform(R, site.at(away * (gap + _HULL)))
    obstacles: list[Obstacle] = [Cylinder(_HULL, 3.5, T, name="hull")]
    places = rng.uniform(0.2, 0.42) * np.array([-1.0, 1.0]) + rng.normal(0, 0.05)
    number = int(rng.integers(3, 6))
    for i in range(number):
        along = places[0] + (places[1] - places[0]) * (0.15 + 0.7 * (i + 0.5) / number)
        obstacles += _handrail(T, along, rng.normal(0, 0.12), rng.uniform(0.25, 0.5), bool(rng.random() < 0.7), i)

    def close(along: float) -> Array:
        return _on_hull(T, along, rng.uniform(-0.15, 0.15), rng.uniform(0.05, 0.08))

    inward = lambda: away + rng.normal(0, 0.15, 3)  # noqa: E731
    begin, end = close(places[0]), close(places[1])
    in_joints = bool(rng.random() < 0.35)
    keep, limits = asked_of_the_base(rng, in_joints=in_joints, peak=(6, 15))
    wide = math.radians(20)
    return Draft(
        robot=site.robot,
        obstacles=tuple(obstacles),
        start=(hand_at(site, begin, inward(), within=wide),),
        goal=(hand_at(site, end, inward(), within=math.radians(5)),),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
    )


def _on_hull(T: Array, along: float, across: float, height: float) -> Array:
    """Return a point by its place along the axis and around it [m], and its height above the hull [m]."""
    angle, radius = across / _HULL, _HULL + height
    return T[:3, :3] @ np.array([radius * math.cos(angle), radius * math.sin(angle), along]) + T[:3, 3]


def _handrail(T: Array, along: float, across: float, length: float, around: bool, number: int) -> tuple[Obstacle, ...]:
    """A rail and its two posts; `around` is whether it lies around the module or along it."""
    half = np.array([0.0, length / 2] if around else [length / 2, 0.0])
    ends = [_on_hull(T, along + s * half[0], across + s * half[1], _STAND_OFF) for s in (-1, 1)]
    feet = [_on_hull(T, along + s * half[0], across + s * half[1], 0.0) for s in (-1, 1)]
    return rods([(ends[0], ends[1]), *zip(ends, feet, strict=True)], _RAIL, np.eye(4), f"rail {number + 1} part")
