"""Clearances of configurations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import shown
from spacearm.errors import ProblemError
from spacearm.planner.kernel_model import kernel_model, self_capsule_pairs
from spacearm.robot import Robot
from spacearm.robot.kinematics import as_configurations
from spacearm.scene import Scene

Array = NDArray[np.float64]


class HasScene(Protocol):
    """Whatever has a robot and a scene; a Problem does."""

    @property
    def robot(self) -> Robot:
        """What moves."""
        ...

    @property
    def scene(self) -> Scene:
        """What is in the way."""
        ...


def at_start(problem: HasScene) -> HasScene:
    """Return a problem as told in the frame of its base at the beginning; what has no base is told so already."""
    return getattr(problem, "local", problem)


def clearances(problem: HasScene, q: ArrayLike) -> Array:
    """Return the clearance of every link's capsule and every obstacle: the least signed distance of the capsule's axis to
    the obstacle, less the capsule's radius. A floating base is where it stands at the beginning.

    Args:
        problem: the robot, with c capsules, and the scene, with k obstacles.
        q: (..., n) configurations [rad or m].

    Returns:
        (..., c, k) [m]; negative is penetration.

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    problem = at_start(problem)
    array = as_configurations(problem.robot, q)
    model = kernel_model(problem.robot, problem.scene)
    found = model.native.obstacle_clearances(np.ascontiguousarray(array.reshape(-1, problem.robot.dof)))
    obstacles = len(problem.scene.obstacles)
    if len(model.obstacle_of) != obstacles:  # sphere sets are several of the kernel's obstacles
        out = np.full((*found.shape[:-1], obstacles), np.inf)
        for kernels, ours in enumerate(model.obstacle_of):
            np.minimum(out[..., ours], found[..., kernels], out=out[..., ours])
        found = out
    return found.reshape(*array.shape[:-1], *found.shape[1:])


def self_clearances(problem: HasScene, q: ArrayLike) -> Array:
    """Return the clearance between the robot's own capsules.

    Args:
        problem: the robot, with p pairs of capsules that must keep clear (`self_capsule_pairs` lists them).
        q: (..., n) configurations [rad or m].

    Returns:
        (..., p) signed distances [m]; negative is penetration.

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    array = as_configurations(problem.robot, q)
    pairs = self_capsule_pairs(problem.robot)
    model = kernel_model(problem.robot, problem.scene)
    rows = np.ascontiguousarray(array.reshape(-1, problem.robot.dof))
    return model.native.pair_clearances(rows, pairs).reshape(*array.shape[:-1], len(pairs))


def clearance(problem: HasScene, q: ArrayLike) -> Array:
    """Return the least clearance of each configuration: over all links and obstacles, and the robot's own pairs.

    Args:
        problem: the robot and the scene.
        q: (..., n) configurations [rad or m].

    Returns:
        (...,) [m]; negative is penetration; infinite without obstacles and pairs.

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    if not (isinstance(getattr(problem, "robot", None), Robot) and isinstance(getattr(problem, "scene", None), Scene)):
        raise ProblemError(f"problem is {shown(problem)}, expected a Problem, or what else has a robot and a scene")
    scene = clearances(problem, q).min(axis=(-2, -1), initial=np.inf)
    return np.minimum(scene, self_clearances(problem, q).min(axis=-1, initial=np.inf))


def clearance_of(problem: HasScene) -> Callable[[Array], Array]:
    """Prepare `clearance` for one problem that is asked about many times.

    Args:
        problem: the robot, with n degrees of freedom, and the scene.

    Returns:
        A function of configurations (b, n) that returns their clearances (b,) [m].
    """
    problem = at_start(problem)
    native = kernel_model(problem.robot, problem.scene).native
    pairs = self_capsule_pairs(problem.robot)

    def least(q: Array) -> Array:
        rows = np.ascontiguousarray(q)
        scene = native.obstacle_clearances(rows).min(axis=(-2, -1), initial=np.inf)
        return np.minimum(scene, native.pair_clearances(rows, pairs).min(axis=-1, initial=np.inf))

    return least


def margin_within_reach(problem: HasScene, ends: ArrayLike, margin: float) -> float:
    """Return the clearance that can be asked for between ends: no more than half of what there is at each of them.

    Args:
        problem: the robot and the scene.
        ends: (e, n) configurations, the start and goals [rad or m].
        margin: that is wanted [m].

    Returns:
        [m], 0 or more.
    """
    return max(0.0, min(margin, 0.5 * float(clearance(problem, ends).min())))
