"""The seed's problem as objectives of any build: the paper's arm and obstacles, or none, or drawn ones."""

from __future__ import annotations

from typing import Any

import numpy as np

from kernel.builds import Build, place
from spacearm.robot import Robot, joint_centres, load_robot
from spacearm.scene import Sphere

OBSTACLES = (Sphere((0.5, 0.5, 0.0), 0.1), Sphere((0.4, 0.7, 0.0), 0.1), Sphere((0.2, 0.8, 0.0), 0.1))
GOAL = np.array([0.7, 0.3, 0.0])
WEIGHTS = np.array([0.5, 0.25, 0.25])


def paper_robot() -> Robot:
    return load_robot("zhang2022")


def seed_objective(build: Build, robot: Robot, obstacles: tuple[Sphere, ...] = OBSTACLES) -> Any:
    """The seed's fitness in goal mode."""
    centres = list(joint_centres(robot))
    model = place(build, robot, points=centres, spheres=obstacles).native
    indices = np.arange(len(centres), dtype=np.int32)
    return build.named("SeedObjective")(model, indices, len(centres) - 1, GOAL, WEIGHTS, True, 1e-3)


def reach_objective(build: Build, robot: Robot, obstacles: tuple[Sphere, ...] = OBSTACLES) -> Any:
    """A configuration near home that reaches the goal with a margin."""
    centres = list(joint_centres(robot))
    model = place(build, robot, points=centres, spheres=obstacles).native
    return build.named("ReachObjective")(model, len(centres) - 1, GOAL, 1e-3, 0.02, np.zeros(robot.dof))


def motion_objective(build: Build, robot: Robot, obstacles: tuple[Sphere, ...] = OBSTACLES) -> Any:
    """Motions with two control points between start and goal, at 16 samples; any partition of unity is a basis."""
    s = np.linspace(0, 1, 16)[:, np.newaxis]
    basis = np.hstack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3])
    model = place(build, robot, spheres=obstacles).native
    start, goal = np.zeros(robot.dof), np.linspace(-1, 1, robot.dof)
    return build.named("MotionObjective")(model, start, goal, basis, 0.01, 0.5)


def searched(
    build: Build,
    objective: Any,
    bounds: tuple[np.ndarray, np.ndarray],
    settings: dict[str, Any],
    *,
    seed: int = 1,
    first_trial: int = 0,
    trials: int = 1,
    threads: int = 1,
    keep_positions: bool = False,
    stop_when_feasible: bool = False,
    seconds: float = 0.0,
    initial: np.ndarray | None = None,
    progress: Any = None,
) -> list[dict[str, Any]]:
    """Run the kernel's own search, one result a trial."""
    return objective.search(
        *bounds,
        build.settings(**settings),
        seed,
        first_trial,
        trials,
        threads,
        keep_positions,
        stop_when_feasible,
        seconds,
        initial,
        progress,
    )
