"""Two arms on one spacecraft: both move at once, past a boom and each other, or one works and the other may balance it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from spacearm.bench.space.draft import Draft, Site, asked_of_the_base, tip_at
from spacearm.bench.space.robots import two_arms
from spacearm.scene import Box, Capsule, Obstacle

Array = NDArray[np.float64]

_MASSES = (120.0, 200.0)  # of the base [kg]
_TIPS = ("left_tip", "right_tip")


def draw(rng: np.random.Generator) -> Draft:
    """Draw a client before the arms whose boom reaches in between; the tips end on other sides than they began."""
    site = Site(robot=two_arms(float(rng.choice(_MASSES))), shoulder=(0, 0, 0.31))
    front = int(rng.choice([-1, 1]))
    # A client before the arms, that fits between them, and its boom, which reaches in between.
    size = rng.uniform((0.3, 0.15, 0.25), (0.6, 0.25, 0.5))
    middle = np.array([rng.normal(0, 0.08), front * (0.4 + size[1] / 2), rng.uniform(0.15, 0.4)])
    foot = middle + np.array([0.0, -front * size[1] / 2, rng.uniform(-0.1, 0.1)])
    end = foot + np.array([rng.normal(0, 0.1), -front * rng.uniform(0.35, 0.8), rng.uniform(-0.05, 0.15)])
    obstacles: tuple[Obstacle, ...] = (
        Box(size, site.at(middle), name="client"),
        Capsule(site.at(foot), site.at(end), rng.uniform(0.02, 0.04), name="boom"),
    )

    def aside(x: float, y: float) -> Array:
        return site.at((x + rng.normal(0, 0.06), y + rng.normal(0, 0.08), rng.uniform(0.05, 0.5)))

    both = bool(rng.random() < 0.6)
    begin = (aside(-0.6, front * 0.4), aside(0.6, front * 0.4))
    if both:  # the tips change places in depth, and come to the middle one above the other
        end = (aside(-0.15, -front * 0.3), aside(0.35, front * rng.choice([-0.35, 0.1])))
        keep, limits = asked_of_the_base(rng, in_joints=True, peak=(8, 20))
        goal = tuple(tip_at(site, point, frame=tip) for point, tip in zip(end, _TIPS, strict=True))
    else:
        keep, limits = (math.radians(0.5), asked_of_the_base(rng, in_joints=True, peak=(3, 10))[1])
        goal = (tip_at(site, aside(rng.uniform(-0.35, 0.1), -front * 0.35), frame=_TIPS[0]),)
    return Draft(
        robot=site.robot,
        obstacles=obstacles,
        start=tuple(tip_at(site, point, frame=tip) for point, tip in zip(begin, _TIPS, strict=True)),
        goal=goal,
        in_joints=both,
        keep_attitude=keep,
        limits=limits,
    )
