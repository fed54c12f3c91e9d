"""Clearances of configurations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import ProblemError
from spacearm.dynamics.base_models import BASE_MODELS
from spacearm.geometry import Scene
from spacearm.planner.kernel_model import kernel_model, self_capsule_pairs
from spacearm.robot import Robot
from spacearm.robot.kinematics import as_configurations

Array = NDArray[np.float64]


def _none() -> NDArray[np.int32]:
    return np.zeros(0, dtype=np.int32)


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
    found = model.model64.obstacle_clearances(np.ascontiguousarray(array.reshape(-1, problem.robot.dof)))
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
    return model.model64.pair_clearances(rows, pairs).reshape(*array.shape[:-1], len(pairs))


def clearance(problem: HasScene, q: ArrayLike) -> Array:
    """Return the least clearance of each configuration: over all links and obstacles, and the robot's own pairs.

    Args:
        problem: the robot and the scene.
        q: (..., n) configurations [rad or m].

    Returns:
        (...,) [m]; negative is penetration; infinite without obstacles and pairs.

    Raises:
        ProblemError: what has no robot and scene.
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
    native = kernel_model(problem.robot, problem.scene).model64
    pairs = self_capsule_pairs(problem.robot)

    def least(q: Array) -> Array:
        rows = np.ascontiguousarray(q)
        scene = native.obstacle_clearances(rows).min(axis=(-2, -1), initial=np.inf)
        return np.minimum(scene, native.pair_clearances(rows, pairs).min(axis=-1, initial=np.inf))

    return least


@dataclass(frozen=True, slots=True, kw_only=True)
class LoweredMargin:
    """Two things that begin or end too near to each other for the margin that was asked for.

    Attributes:
        link: name of the robot's link.
        other: what it is near to, as in "obstacle 'shelf'" or "link 'forearm'".
        clearance: the least that they have at the start or a goal [m].
        used: the margin asked of the two instead: half of that [m].
    """

    link: str
    other: str
    clearance: float
    used: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Margins:
    """The clearance that a search asks for.

    Attributes:
        asked: of all pairs but those lowered [m].
        lowered: those, the lowest first.
        capsules, obstacles, others: (p,) the same for the kernel: capsules, and its obstacles, or -1 and other capsules.
        most: (p,) the margins of these [m].
    """

    asked: float
    lowered: tuple[LoweredMargin, ...] = ()
    capsules: NDArray[np.int32] = field(default_factory=_none)
    obstacles: NDArray[np.int32] = field(default_factory=_none)
    others: NDArray[np.int32] = field(default_factory=_none)
    most: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def touching(self) -> bool:
        """Whether something has no clearance at all at the start or a goal."""
        return any(near.clearance <= 0 for near in self.lowered)

    @property
    def message(self) -> str:
        """Which margin was lowered, in half a sentence; "" if none was."""
        for near in self.lowered[:1]:
            more = len(self.lowered) - 1
            others = f" (and of {more} more pair{'s' if more > 1 else ''})" if more else ""
            return (
                f"the margin of {self.asked * 1e3:.4g} mm was lowered to {near.used * 1e3:.3g} mm between link '{near.link}' "
                f"and {near.other}{others}, which have {near.clearance * 1e3:.3g} mm at the start or a goal"
            )
        return ""


def margins_within_reach(problem: HasScene, ends: ArrayLike, margin: float) -> Margins:
    """Return the clearance that can be asked for between ends.

    Of two things that are nearer at an end than twice the margin it is half of what they have there; of all others the margin.

    Args:
        problem: the robot and the scene.
        ends: (e, n) configurations, the start and goals [rad or m].
        margin: that is wanted [m].
    """
    robot, scene = problem.robot, problem.scene
    model = kernel_model(robot, scene)
    rows = np.ascontiguousarray(as_configurations(robot, ends))
    to_scene = model.model64.obstacle_clearances(rows).min(axis=0)  # (c, k)
    pairs = self_capsule_pairs(robot)
    to_self = model.model64.pair_clearances(rows, pairs).min(axis=0)  # (p,)
    if min(to_scene.min(initial=np.inf), to_self.min(initial=np.inf)) >= 2 * margin:
        return Margins(asked=margin)
    if not getattr(
        problem, "base_model", BASE_MODELS["fixed"]
    ).follows_arm:  # a base that stays and the obstacles have what they have
        to_scene[[capsule.joint < 0 for capsule in robot.capsules]] = np.inf
    names = [capsule.name for capsule in robot.capsules]
    of: dict[str, list[int]] = {}  # the capsules of each link
    for i, name in enumerate(names):
        of.setdefault(name, []).append(i)
    near: dict[tuple[str, str], float] = {}
    listed: list[tuple[int, int, int, float]] = []
    close = np.argwhere((to_scene < 2 * margin).T).tolist()
    for obstacle, link in dict.fromkeys((k, names[i]) for k, i in close):
        other = f"obstacle {scene.called(int(model.obstacle_of[obstacle]))}"
        least = float(to_scene[of[link], obstacle].min())
        near[link, other] = min(near.get((link, other), np.inf), least)
        listed += [(i, obstacle, -1, least) for i in of[link]]
    if (to_self < 2 * margin).any():
        linked = [(names[i], names[k]) for i, k in pairs.tolist()]
        closest: dict[tuple[str, str], float] = {}
        for pair, clear in zip(linked, to_self.tolist(), strict=True):
            closest[pair] = min(closest.get(pair, np.inf), clear)
        for pair, (i, k) in zip(linked, pairs.tolist(), strict=True):
            if closest[pair] < 2 * margin:
                near[pair[0], f"link '{pair[1]}'"] = closest[pair]
                listed.append((i, -1, k, closest[pair]))
    capsules, obstacles, others = (np.array([row[column] for row in listed], dtype=np.int32) for column in range(3))
    return Margins(
        asked=margin,
        lowered=tuple(
            LoweredMargin(link=link, other=other, clearance=clear, used=max(0.0, clear / 2))
            for (link, other), clear in sorted(near.items(), key=lambda item: item[1])
        ),
        capsules=capsules,
        obstacles=obstacles,
        others=others,
        most=np.array([max(0.0, row[3] / 2) for row in listed]),
    )
