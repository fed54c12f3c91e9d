"""Instances of the paper's problem: its own, and drawn ones on which nothing was tuned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from spacearm.core.native import native
from spacearm.geometry import Scene, Sphere
from spacearm.planner.kernel_model import KernelModel, make_kernel_model
from spacearm.study.paper_problem import GOAL_POSITION, OBSTACLE_CENTERS, PaperSettings, paper_robot

RADII = (0.06, 0.10, 0.15)
MODES = ("goal", "literal")
ARM = paper_robot()
SETTINGS = PaperSettings()  # weights, tolerance and link radius of every instance


@dataclass(frozen=True, kw_only=True)
class Instance:
    """The paper's arm among spheres.

    Attributes:
        name: for tables.
        mode: "goal" or "literal".
        centers: (k, 3) of the obstacles [m].
        radii: (k,) of the obstacles [m].
        goal: (3,) of the end effector [m].
    """

    name: str
    mode: str
    centers: tuple[tuple[float, ...], ...]
    radii: tuple[float, ...]
    goal: tuple[float, ...]

    @cached_property
    def model(self) -> KernelModel:
        """Arm and scene as the kernel has them."""
        return make_kernel_model(ARM, self._scene)

    @cached_property
    def objective(self) -> Any:
        """The kernel's objective, float64."""
        return self.make_objective(64)

    def make_objective(self, precision: int) -> Any:
        given: dict[str, Any] = {
            "centers": np.array(self.model.centres, dtype=np.int32),
            "tip": self.model.tip,
            "goal": np.array(self.goal, dtype=np.float64),
            "weights": np.array(SETTINGS.weights, dtype=np.float64),
            "must_reach": self.mode == "goal",
            "tolerance": SETTINGS.tolerance,
        }
        if precision == 32:
            return native.PaperObjective32(scene=self.model.model32, **given)
        return native.PaperObjective64(scene=self.model.model64, **given)

    @property
    def _scene(self) -> Scene:
        return Scene([Sphere(c, r) for c, r in zip(self.centers, self.radii, strict=True)])


def paper_instance(mode: str, radius: float) -> Instance:
    """The paper's obstacles and goal."""
    return Instance(
        name=f"{mode} {radius:.2f}",
        mode=mode,
        centers=OBSTACLE_CENTERS,
        radii=(radius,) * len(OBSTACLE_CENTERS),
        goal=GOAL_POSITION,
    )


def drawn_instances(count: int, *, seed: int = 2022) -> list[Instance]:
    """Scenes that nothing was tuned on: 3 to 6 spheres in space, a goal that a collision-free configuration reaches.

    The spheres are centred 0.3 to 1.2 m from the shoulder, in any direction, with radii of 0.06 to 0.20 m; the goal is
    the end effector's place at a configuration drawn within the limits, every link at least 1 cm clear.
    """
    rng = np.random.default_rng(seed)
    instances = []
    while len(instances) < count:
        k = int(rng.integers(3, 7))
        direction = rng.normal(size=(k, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        centers = direction * rng.uniform(0.3, 1.2, (k, 1))
        radii = rng.uniform(0.06, 0.20, k)
        q = rng.uniform(ARM.lower, ARM.upper, (1, ARM.dof))
        drawn = Instance(
            name=f"drawn {len(instances) + 1}",
            mode="goal",
            centers=tuple(map(tuple, centers.tolist())),
            radii=tuple(radii.tolist()),
            goal=(0.0, 0.0, 0.0),
        )
        model = drawn.model.model64
        if model.clearances(q).min() < 0.01:
            continue
        goal = model.points(q)[0, drawn.model.tip]
        instances.append(
            Instance(name=drawn.name, mode="goal", centers=drawn.centers, radii=drawn.radii, goal=tuple(goal.tolist()))
        )
    return instances
