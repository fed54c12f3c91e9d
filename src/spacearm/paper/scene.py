"""The paper's robot, obstacles, start and goal, and its fitness as the kernel's objective."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.paper.settings import MODES, PaperSettings
from spacearm.planner.kernel_model import make_kernel_model, native_class
from spacearm.robot import Robot, load_robot
from spacearm.robot.kinematics import as_configurations
from spacearm.scene import Scene, Sphere
from spacearm.settings import one_of

Array = NDArray[np.float64]

OBSTACLE_CENTERS = ((0.5, 0.5, 0.0), (0.4, 0.7, 0.0), (0.2, 0.8, 0.0))
START_POSITION = (0.0, 1.336, 0.0)  # of the end effector: the stretched arm, q = 0
GOAL_POSITION = (0.7, 0.3, 0.0)


@lru_cache(maxsize=8)
def paper_robot(link_radius: float = 0.0) -> Robot:
    """Return the paper's arm, its links in cylinders of this radius [m]."""
    robot = load_robot("zhang2022")
    capsules = tuple(replace(capsule, radius=link_radius) for capsule in robot.capsules)
    return replace(robot, capsules=capsules)


def paper_scene(radius: float = 0.10) -> Scene:
    """Return the paper's three obstacles in spheres of this radius A_R [m]."""
    return Scene([Sphere(center, radius) for center in OBSTACLE_CENTERS])


def seed_objective(settings: PaperSettings, mode: str, radius: float, *, precision: int = 64) -> Any:
    """Return the kernel's objective: fitness eq. (4), violation eqs. (1)-(3), (10), (11), and the goal in that mode.

    Args:
        settings: for the weights, the goal's tolerance and the link radius.
        mode: "goal" or "literal".
        radius: of the obstacles A_R [m].
        precision: of its numbers, 32 or 64 bits.

    Raises:
        SettingsError: another mode.
        SceneError: a radius that is not above 0.
    """
    one_of("mode", mode, MODES)
    model = make_kernel_model(paper_robot(settings.link_radius), paper_scene(radius), precision=precision)
    return native_class("SeedObjective", precision)(
        model.native,
        np.array(model.centres, dtype=np.int32),
        model.tip,
        np.array(GOAL_POSITION),
        np.array(settings.weights, dtype=np.float64),
        mode == "goal",
        settings.tolerance,
    )


def seed_terms(q: ArrayLike, settings: PaperSettings | None = None, *, radius: float = 0.10) -> Array:
    """Return the terms f1, f2, f3 of eqs. (5), (6), (7).

    Args:
        q: (..., 7) configurations [rad].
        settings: for the weights and the link radius.
        radius: of the obstacles A_R [m].

    Returns:
        (..., 3) [m].
    """
    settings = settings or PaperSettings()
    array = as_configurations(paper_robot(), q)
    rows = np.ascontiguousarray(array.reshape(-1, 7))
    return seed_objective(settings, "literal", radius).terms(rows).reshape(*array.shape[:-1], 3)
