"""Clearances: how far the robot's links are from obstacles and from each other, and what margin a search can ask for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import keep, shown
from spacearm.core.errors import ProblemError
from spacearm.core.native import native
from spacearm.dynamics.base_models import BASE_MODELS, BaseModel
from spacearm.geometry import Scene
from spacearm.planner.kernel_model import kernel_model, self_capsule_pairs
from spacearm.robot import Robot
from spacearm.robot.kinematics import as_configurations

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


@dataclass(frozen=True, slots=True, eq=False)
class ClearanceModel:
    """A robot among obstacles, prepared to be asked for the clearances of many configurations.

    The base stands at the origin of the scene's frame. Configurations are rows (b, n) that fit the robot; they are not checked.

    Attributes:
        robot: with c capsules, of which p pairs must keep clear of each other.
        scene: with k obstacles.
        pairs: (p, 2) indices into `robot.capsules`.
        obstacle_of: (j,) which of the scene's obstacles each of the kernel's is; a sphere set is several.
    """

    robot: Robot
    scene: Scene
    pairs: NDArray[np.int32] = field(init=False)
    obstacle_of: NDArray[np.intp] = field(init=False)
    _model: native.Model64 = field(init=False)

    def __post_init__(self) -> None:
        model = kernel_model(self.robot, self.scene)
        keep(self, pairs=self_capsule_pairs(self.robot), obstacle_of=model.obstacle_of, _model=model.model64)

    def to_obstacles(self, q: Array) -> Array:
        """Return the signed distances (b, c, k) of capsules and obstacles [m]."""
        found, count = self.to_kernel_obstacles(q), len(self.scene.obstacles)
        if len(self.obstacle_of) == count:
            return found
        out = np.full((*found.shape[:-1], count), np.inf)
        for kernels, ours in enumerate(self.obstacle_of.tolist()):
            np.minimum(out[..., ours], found[..., kernels], out=out[..., ours])
        return out

    def to_kernel_obstacles(self, q: Array) -> Array:
        """Return the signed distances (b, c, j) of capsules and the kernel's obstacles [m]."""
        return self._model.obstacle_clearances(np.ascontiguousarray(q))

    def between_links(self, q: Array) -> Array:
        """Return the signed distances (b, p) of the pairs [m]."""
        return self._model.pair_clearances(np.ascontiguousarray(q), self.pairs)

    def least(self, q: Array) -> Array:
        """Return the least of all (b,) [m]; infinite without obstacles and pairs."""
        to_scene: Array = self.to_kernel_obstacles(q).min(axis=(-2, -1), initial=np.inf)
        return np.minimum(to_scene, self.between_links(q).min(axis=-1, initial=np.inf))


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
    rows, shape = _rows(problem.robot, q)
    found = _prepared(problem).to_obstacles(rows)
    return found.reshape(*shape, *found.shape[1:])


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
    rows, shape = _rows(problem.robot, q)
    found = _prepared(problem).between_links(rows)
    return found.reshape(*shape, *found.shape[1:])


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
    rows, shape = _rows(problem.robot, q)
    return _prepared(problem).least(rows).reshape(shape)


def _rows(robot: Robot, q: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Return configurations (..., n) as rows (b, n), checked, and the leading axes."""
    array = as_configurations(robot, q)
    return array.reshape(-1, robot.dof), array.shape[:-1]


def _prepared(problem: HasScene) -> ClearanceModel:
    """Return the model of a problem as it is told in the frame of its base at the beginning, if it has a base."""
    here: HasScene = getattr(problem, "local", problem)
    return ClearanceModel(here.robot, here.scene)


# ---- Margins that a search can ask for between its ends --------------------------------------------------------------


def _none() -> NDArray[np.int32]:
    return np.zeros(0, dtype=np.int32)


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
    model = _prepared(problem)
    rows = np.asarray(ends, dtype=np.float64)
    to_scene: Array = model.to_kernel_obstacles(rows).min(axis=0)  # (c, j)
    to_self: Array = model.between_links(rows).min(axis=0)  # (p,)
    if min(to_scene.min(initial=np.inf), to_self.min(initial=np.inf)) >= 2 * margin:
        return Margins(asked=margin)
    base: BaseModel = getattr(problem, "base_model", BASE_MODELS["fixed"])
    capsules = model.robot.capsules
    if not base.follows_arm:  # no motion changes the distance between a base that stays and an obstacle
        to_scene[[capsule.joint < 0 for capsule in capsules]] = np.inf
    names = [capsule.name for capsule in capsules]
    capsules_of: dict[str, list[int]] = {}  # of each link
    for i, name in enumerate(names):
        capsules_of.setdefault(name, []).append(i)
    near: dict[tuple[str, str], float] = {}
    rows_of_kernel: list[tuple[int, int, int, float]] = []
    close: list[list[int]] = np.argwhere((to_scene < 2 * margin).T).tolist()
    for obstacle, link in dict.fromkeys((k, names[i]) for k, i in close):
        other = f"obstacle {model.scene.called(int(model.obstacle_of[obstacle]))}"
        least = float(to_scene[capsules_of[link], obstacle].min())
        near[link, other] = min(near.get((link, other), np.inf), least)
        rows_of_kernel += [(i, obstacle, -1, least) for i in capsules_of[link]]
    if (to_self < 2 * margin).any():
        of_pairs: list[list[int]] = model.pairs.tolist()
        closest: dict[tuple[str, str], float] = {}
        for (i, k), clear in zip(of_pairs, to_self.tolist(), strict=True):
            closest[names[i], names[k]] = min(closest.get((names[i], names[k]), np.inf), clear)
        for i, k in of_pairs:
            least = closest[names[i], names[k]]
            if least < 2 * margin:
                near[names[i], f"link '{names[k]}'"] = least
                rows_of_kernel.append((i, -1, k, least))
    links, obstacles, others = (np.array([row[column] for row in rows_of_kernel], dtype=np.int32) for column in range(3))
    return Margins(
        asked=margin,
        lowered=tuple(
            LoweredMargin(link=link, other=other, clearance=clear, used=max(0.0, clear / 2))
            for (link, other), clear in sorted(near.items(), key=lambda item: item[1])
        ),
        capsules=links,
        obstacles=obstacles,
        others=others,
        most=np.array([max(0.0, row[3] / 2) for row in rows_of_kernel]),
    )
