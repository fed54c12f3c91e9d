"""Clearances: how far the robot's links are from obstacles and from each other, and what a search asks for of each pair."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import keep, shown
from spacearm.core.errors import ProblemError
from spacearm.core.native import native
from spacearm.dynamics.base_models import BASE_MODELS, BaseModel
from spacearm.geometry import Scene
from spacearm.planner.kernel_model import kernel_model, self_capsule_pairs
from spacearm.proof.required_clearance import RequiredClearance, held_to, required_clearance
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
        return _least(self.to_kernel_obstacles(q), self.between_links(q))

    def room(self, q: Array, required: KernelClearance | None) -> Room:
        """Compare the clearances of configurations (b, n) with those required of each pair; None: no contact is enough."""
        to_scene, between = self.to_kernel_obstacles(q), self.between_links(q)
        least = _least(to_scene, between)
        if required is None:
            return Room(least=least, beyond=least, lacking=np.maximum(-least, 0.0))
        to_scene, between = to_scene - required.to_obstacles, between - required.between_links
        lacking = np.maximum(-to_scene, 0.0).sum(axis=(-2, -1)) + np.maximum(-between, 0.0).sum(axis=-1)
        return Room(least=least, beyond=_least(to_scene, between), lacking=lacking)

    def required_of(self, required: RequiredClearance) -> KernelClearance:
        """Return what is required of the kernel's pairs."""
        row = {link: i for i, link in enumerate(required.links)}
        rows = np.array([row[capsule.name] for capsule in self.robot.capsules], dtype=np.intp)
        one, two = (rows[self.pairs[:, k]] for k in range(2))
        to_obstacles = np.zeros((len(rows), 0))
        if len(self.scene.obstacles):  # there may be none though the problem has some: where they are is not known
            to_obstacles = required.to_obstacles[rows[:, None], self.obstacle_of]
        return KernelClearance(to_obstacles=to_obstacles, between_links=required.between_links[one, two])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KernelClearance:
    """A clearance of each of the kernel's pairs.

    Attributes:
        to_obstacles: (c, j) of capsules and the kernel's obstacles [m].
        between_links: (p,) of the pairs of capsules [m].
    """

    to_obstacles: Array
    between_links: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """The clearances of configurations, beside those that are required.

    Attributes:
        least: (b,) the least clearance of all pairs [m].
        beyond: (b,) the least that a pair has beyond what is required of it [m]; negative: it has less.
        lacking: (b,) what the pairs have less than is required, summed [m].
    """

    least: Array
    beyond: Array
    lacking: Array

    def select(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Room:
        """Return those of some configurations."""
        return Room(least=self.least[rows], beyond=self.beyond[rows], lacking=self.lacking[rows])

    def put(self, rows: NDArray[np.bool_], other: Room) -> None:
        """Put others' in the place of some rows."""
        for name in ("least", "beyond", "lacking"):
            getattr(self, name)[rows] = getattr(other, name)[rows]

    def copy(self) -> Room:
        """Return a copy."""
        return Room(least=self.least.copy(), beyond=self.beyond.copy(), lacking=self.lacking.copy())


def _least(to_scene: Array, between: Array) -> Array:
    of_scene: Array = to_scene.min(axis=(-2, -1), initial=np.inf)
    return np.minimum(of_scene, between.min(axis=-1, initial=np.inf))


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


# ---- What a search asks for between its ends ------------------------------------------------------------------------

SEARCH_ROOM = 0.002
"""[m] A search asks for so much more than is required at the instants that it looks at: what lies between them, and the proof,
need room."""


def _none() -> NDArray[np.int32]:
    return np.zeros(0, dtype=np.int32)


@dataclass(frozen=True, slots=True, kw_only=True)
class NearPair:
    """Two things that begin or end nearer to each other than is required of them.

    Attributes:
        link: name of the robot's link.
        other: what it is near to, as in "obstacle 'shelf'" or "link 'forearm'".
        clearance: the least that they have at the start or a goal [m]; 0 or less: they are in contact.
        required: of them everywhere else [m].
        searched: the clearance asked of the two while they are near [m].
    """

    link: str
    other: str
    clearance: float
    required: float
    searched: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchedClearance:
    """The clearances that a search asks for at the instants that it looks at.

    Attributes:
        asked: of all pairs but those below [m].
        near: pairs that begin or end nearer than is required of them, the nearest first.
        touching: whether something has no clearance at all at the start or a goal.
        capsules, obstacles, others: (p,) pairs of which another clearance is asked, for the kernel: capsules, and its
            obstacles, or -1 and other capsules.
        of_pairs: (p,) the clearance asked of these [m].
    """

    asked: float
    near: tuple[NearPair, ...] = ()
    touching: bool = False
    capsules: NDArray[np.int32] = field(default_factory=_none)
    obstacles: NDArray[np.int32] = field(default_factory=_none)
    others: NDArray[np.int32] = field(default_factory=_none)
    of_pairs: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def kernel_pairs(self) -> native.PairMargins | None:
        """The pairs as the kernel takes them; None if there are none."""
        if not len(self.of_pairs):
            return None
        return native.PairMargins(body=self.capsules, obstacle=self.obstacles, other=self.others, margin=self.of_pairs)


def required_of(problem: HasScene) -> RequiredClearance:
    """Return the clearance that is required of every pair; nothing more than no contact where the problem does not say."""
    found = getattr(problem, "required", None)
    return found if isinstance(found, RequiredClearance) else required_clearance(problem.robot, problem.scene, 0.0, ())


def searched_clearance(problem: HasScene, ends: ArrayLike) -> SearchedClearance:
    """Return the clearances that a search asks for between ends.

    Of each pair it is what is required of it and 2 mm more; of a pair that has less at an end, half of what it has there
    beyond what is required. A pair that has less at an end than is required is held to what it has there.

    Args:
        problem: the robot and the scene, and what is required.
        ends: (e, n) configurations, the start and goals [rad or m].
    """
    model, required = _prepared(problem), required_of(problem)
    rows = np.asarray(ends, dtype=np.float64)
    to_scene: Array = model.to_kernel_obstacles(rows).min(axis=0)  # (c, j)
    to_self: Array = model.between_links(rows).min(axis=0)  # (p,)
    of_pairs = model.required_of(required)
    of_scene, of_links = of_pairs.to_obstacles, of_pairs.between_links
    asked = usual_clearance(problem)
    if _all_alike(of_scene, of_links, asked) and min(to_scene.min(initial=np.inf), to_self.min(initial=np.inf)) >= (
        asked + SEARCH_ROOM
    ):
        return SearchedClearance(asked=asked)
    base: BaseModel = getattr(problem, "base_model", BASE_MODELS["fixed"])
    if not base.follows_arm:  # no motion changes the distance between a base that stays and an obstacle
        to_scene[[capsule.joint < 0 for capsule in model.robot.capsules]] = np.inf
    return _by_pair(model, asked, (to_scene, of_scene), (to_self, of_links))


def clearance_of_goals(problem: HasScene, model: ClearanceModel) -> SearchedClearance:
    """Return the clearances that a search for goal configurations asks for.

    Of links that are nearer to each other at the start than is required, and may be so in every configuration, it is what
    they have there.

    Args:
        problem: with a start, and what is required.
        model: of its robot, among what it may meet at the goal.
    """
    required = model.required_of(required_of(problem))
    start: Array = getattr(problem, "start")  # noqa: B009
    at_start = model.between_links(start[None])[0]
    at_start = np.where(at_start < required.between_links, at_start, np.inf)
    far = np.full(required.to_obstacles.shape, np.inf)
    return _by_pair(model, usual_clearance(problem), (far, required.to_obstacles), (at_start, required.between_links))


def usual_clearance(problem: HasScene) -> float:
    """Return the clearance that a search asks for of pairs for which the problem states none of their own [m]."""
    return float(getattr(problem, "clearance", 0.0)) + SEARCH_ROOM


def _all_alike(of_scene: Array, of_links: Array, asked: float) -> bool:
    return bool((of_scene + SEARCH_ROOM == asked).all() and (of_links + SEARCH_ROOM == asked).all())


def _between_ends(clear: float, required: float) -> float:
    """Return what is asked of a pair [m] that has a clearance at the nearest end, and of which one is required."""
    if clear <= 0:
        return 0.0
    held = float(held_to(clear, required))
    return held + min(SEARCH_ROOM, (clear - held) / 2)


def _by_pair(model: ClearanceModel, asked: float, scene: tuple[Array, Array], links: tuple[Array, Array]) -> SearchedClearance:
    """Return what is asked of each pair, of clearances at the nearest end and those required: (c, j) and (p,) each."""
    names = [capsule.name for capsule in model.robot.capsules]
    capsules_of: dict[str, list[int]] = {}  # of each link
    for i, name in enumerate(names):
        capsules_of.setdefault(name, []).append(i)
    closest: dict[tuple[str, str], tuple[float, float]] = {}  # the least that a pair has, and what is required of it
    of_kernel: list[tuple[int, int, int, float]] = []
    touching = False

    def meet(link: str, other: str, clear: float, required: float) -> None:
        known = closest.get((link, other), (np.inf, 0.0))
        closest[link, other] = min(known[0], clear), max(known[1], required)

    to_scene, of_scene = scene
    special = (to_scene < of_scene + 2 * SEARCH_ROOM) | (of_scene + SEARCH_ROOM != asked)
    chosen: list[list[int]] = np.argwhere(special.T).tolist()
    for obstacle, link in dict.fromkeys((k, names[i]) for k, i in chosen):
        of_link = capsules_of[link]
        least, required = float(to_scene[of_link, obstacle].min()), float(of_scene[of_link[0], obstacle])
        meet(link, f"obstacle {model.scene.called(int(model.obstacle_of[obstacle]))}", least, required)
        of_kernel += [(i, obstacle, -1, _between_ends(least, required)) for i in of_link]
    to_self, of_links = links
    special = (to_self < of_links + 2 * SEARCH_ROOM) | (of_links + SEARCH_ROOM != asked)
    if special.any():
        of_pairs = cast("list[list[int]]", model.pairs.tolist())
        for (i, k), clear, required in zip(of_pairs, to_self.tolist(), of_links.tolist(), strict=True):
            meet(names[i], f"link '{names[k]}'", clear, required)
        for i, k in of_pairs:
            least, required = closest[names[i], f"link '{names[k]}'"]
            if least < required + 2 * SEARCH_ROOM or required + SEARCH_ROOM != asked:
                of_kernel.append((i, -1, k, _between_ends(least, required)))
    touching = any(clear <= 0 for clear, _ in closest.values())
    first, second, third = (np.array([row[column] for row in of_kernel], dtype=np.int32) for column in range(3))
    return SearchedClearance(
        asked=asked,
        near=tuple(
            NearPair(link=link, other=other, clearance=clear, required=required, searched=_between_ends(clear, required))
            for (link, other), (clear, required) in sorted(closest.items(), key=lambda item: item[1][0])
            if clear < required or clear <= 0
        ),
        touching=touching,
        capsules=first,
        obstacles=second,
        others=third,
        of_pairs=np.array([row[3] for row in of_kernel]),
    )
