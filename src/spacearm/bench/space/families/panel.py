"""Around a solar panel: the panel of a client stands between where the hand is and where it is to work."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from spacearm.bench.space.draft import Draft, Site, asked_of_the_base, direction, hand_at, tip_at, transform
from spacearm.bench.space.robots import light
from spacearm.scene import Box, Capsule

Array = NDArray[np.float64]

_MASSES = (1474.1, 800.0, 500.0)  # of the servicer's base [kg]


def draw(rng: np.random.Generator) -> Draft:
    """Draw the panel of a client, on its yoke, reaching in between two sides of the servicer's arm."""
    site = Site(robot=light("servicer7", float(rng.choice(_MASSES))), shoulder=(0, 0, 1.3), scale=2.6)
    bearing, height = rng.uniform(-math.pi, math.pi), rng.uniform(0.15, 0.45)
    tilt = rng.uniform(-0.35, 0.35)
    out, up = direction(bearing, 0.0), np.array([0.0, 0.0, 1.0])
    normal = np.cross(up, out)
    lean = math.cos(tilt) * up + math.sin(tilt) * normal
    face = np.cross(lean, out)
    inner, length, tall = rng.uniform(0.22, 0.38), rng.uniform(0.9, 1.5), rng.uniform(0.4, 0.7)
    T = transform(np.column_stack([out, face, lean]), site.at(out * (inner + length / 2) + up * height))
    panel = Box(site.scale * np.array([length, 0.025, tall]), T, name="panel")
    edge = T[:3, 3] + out * site.scale * length / 2
    yoke = Capsule(edge, edge + out * 0.2 * site.scale, 0.03 * site.scale, name="yoke")
    bus = Box(np.full(3, 0.5 * site.scale), transform(T[:3, :3], edge + out * 0.45 * site.scale), name="client")

    def beside(side: int) -> Array:
        radius, angle = rng.uniform(0.45, 0.75), side * rng.uniform(0.25, 1.0)
        return site.at(radius * direction(bearing + angle, 0.0) + up * (height + rng.uniform(-0.15, 0.25)))

    side = int(rng.choice([-1, 1]))
    begin, end = beside(side), beside(-side)
    in_joints = bool(rng.random() < 0.4)
    keep, limits = asked_of_the_base(rng, in_joints=in_joints, peak=(5, 15))
    goal = tip_at(site, end) if rng.random() < 0.4 else hand_at(site, end, side * face + rng.normal(0, 0.3, 3))
    return Draft(
        robot=site.robot,
        obstacles=(panel, yoke, bus),
        start=(tip_at(site, begin),),
        goal=(goal,),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
    )
