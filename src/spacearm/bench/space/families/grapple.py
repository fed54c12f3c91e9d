"""Approach to a grapple fixture between thrusters: along its axis, past the nozzles that stand around it."""

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
    tip_at,
    transform,
)
from spacearm.bench.space.robots import light
from spacearm.scene import Box, Cylinder, Obstacle

Array = NDArray[np.float64]


def draw(rng: np.random.Generator) -> Draft:
    """Draw a client's face with a fixture and three to five nozzles around it; the hand ends before the fixture."""
    site = _SITES()[int(rng.choice(4, p=[0.35, 0.25, 0.2, 0.2]))]
    away = direction(rng.uniform(-math.pi, math.pi), rng.uniform(0.0, 1.1))
    face = away + rng.normal(0, 0.2, 3)
    T = transform(frame_along(face, rng.uniform(-math.pi, math.pi)), site.at(away * rng.uniform(0.62, 0.76)))
    scale = site.scale

    def on_face(x: float, y: float, height: float) -> Array:
        return T[:3, :3] @ (scale * np.array([x, y, -height])) + T[:3, 3]

    def standing(x: float, y: float, foot: float, length: float, radius: float, name: str) -> Cylinder:
        return Cylinder(scale * radius, scale * length, transform(T[:3, :3], on_face(x, y, foot + length / 2)), name=name)

    body = Box(scale * np.array([0.9, 0.9, 0.5]), transform(T[:3, :3], on_face(0, 0, -0.25)), name="client")
    obstacles: list[Obstacle] = [body, standing(0, 0, 0.0, 0.02, 0.05, "fixture plate")]
    number, first = int(rng.integers(3, 6)), rng.uniform(0, math.tau)
    for i in range(number):
        angle, radius = first + math.tau * i / number + rng.normal(0, 0.1), rng.uniform(0.135, 0.18)
        x, y, length = radius * math.cos(angle), radius * math.sin(angle), rng.uniform(0.1, 0.2)
        obstacles.append(standing(x, y, 0.0, 0.04, 0.025, f"thruster {i + 1} throat"))
        obstacles.append(standing(x, y, 0.04, length / 2, 0.038, f"thruster {i + 1} nozzle"))
        obstacles.append(standing(x, y, 0.04 + length / 2, length / 2, 0.05, f"thruster {i + 1} exit"))
    aside, turn = rng.uniform(0.2, 0.45), rng.uniform(0, math.tau)
    begin = on_face(aside * math.cos(turn), aside * math.sin(turn), rng.uniform(0.08, 0.3))
    in_joints = bool(rng.random() < 0.3)
    keep, limits = asked_of_the_base(rng, in_joints=in_joints, peak=(4, 12))
    return Draft(
        robot=site.robot,
        obstacles=tuple(obstacles),
        start=(tip_at(site, begin),),
        goal=(hand_at(site, on_face(0, 0, rng.uniform(0.07, 0.09)), T[:3, 2], within=math.radians(3)),),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
    )


def _SITES() -> tuple[Site, ...]:
    return (
        Site(robot=light("srs7", 100), shoulder=(0, 0, 0.31)),
        Site(robot=light("srs7", 200), shoulder=(0, 0, 0.31)),
        Site(robot=light("ets7", 1000), shoulder=(-0.79, -0.29, 1.35), scale=2.4, along="x"),
        Site(robot=light("servicer7", 800), shoulder=(0, 0, 1.3), scale=2.6),
    )
