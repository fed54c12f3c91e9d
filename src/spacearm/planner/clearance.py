"""Clearances: how far the robot's links are from obstacles and from each other, beside what is required of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import keep, shown
from spacearm.core.errors import ProblemError
from spacearm.core.native import native
from spacearm.geometry import Scene
from spacearm.planner.kernel_model import IdentityCache, kernel_model, self_shape_pairs
from spacearm.proof.required_clearance import required_clearance
from spacearm.robot import Robot
from spacearm.robot.kinematics import as_configurations

Array = NDArray[np.float64]

_FEW = 16  # configurations whose clearances are kept
_KEPT = 100_000  # clearances of them at most
_PREPARED = 8  # models of robots and scenes that are kept


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


class _Measured(NamedTuple):
    """Clearances of some configurations, and in which row they are, by the bytes of a configuration."""

    place: dict[bytes, int]
    to_obstacles: Array
    between_links: Array


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ClearanceModel(Brief):
    """A robot among obstacles, prepared to be asked for the clearances of many configurations.

    The base stands at the origin of the scene's frame. Configurations are rows (b, n) that fit the robot; they are not checked.

    Attributes:
        robot: with c shapes, of which p pairs must keep clear of each other.
        scene: with k obstacles.
        pairs: (p, 2) indices into `robot.shapes`.
        obstacle_of: (j,) which of the scene's obstacles each of the kernel's is; a sphere set is several.
    """

    robot: Robot
    scene: Scene
    pairs: NDArray[np.int32] = field(init=False)
    obstacle_of: NDArray[np.intp] = field(init=False)
    _model: native.Model64 = field(init=False)
    _latest: _Measured = field(init=False)

    def __post_init__(self) -> None:
        model, none = kernel_model(self.robot, self.scene), np.zeros(0)
        keep(self, pairs=self_shape_pairs(self.robot), obstacle_of=model.obstacle_of, _model=model.model64)
        keep(self, _latest=_Measured({}, none, none))

    def to_obstacles(self, q: Array) -> Array:
        """Return the signed distances (b, c, k) of shapes and obstacles [m]."""
        found, count = self.to_kernel_obstacles(q), len(self.scene.obstacles)
        if len(self.obstacle_of) == count:
            return found
        out = np.full((*found.shape[:-1], count), np.inf)
        for kernels, ours in enumerate(self.obstacle_of.tolist()):
            np.minimum(out[..., ours], found[..., kernels], out=out[..., ours])
        return out

    def to_kernel_obstacles(self, q: Array) -> Array:
        """Return the signed distances (b, c, j) of shapes and the kernel's obstacles [m]."""
        return self._model.obstacle_clearances(np.ascontiguousarray(q))

    def between_links(self, q: Array) -> Array:
        """Return the signed distances (b, p) of the pairs [m]."""
        return self._model.pair_clearances(np.ascontiguousarray(q), self.pairs)

    def measured(self, q: Array) -> tuple[Array, Array]:
        """Return `to_kernel_obstacles` and `between_links`.

        The results of a few configurations are kept until others are measured: planning asks for those of the ends several
        times.
        """
        rows, latest = [row.tobytes() for row in q] if len(q) <= _FEW else [], self._latest
        if rows and all(row in latest.place for row in rows):
            at = [latest.place[row] for row in rows]
            return latest.to_obstacles[at], latest.between_links[at]
        to_obstacles, between = self.to_kernel_obstacles(q), self.between_links(q)
        if rows and to_obstacles.size + between.size <= _KEPT:
            place = {row: i for i, row in enumerate(rows)}
            keep(self, _latest=_Measured(place, to_obstacles.copy(), between.copy()))
        return to_obstacles, between

    def least(self, q: Array) -> Array:
        """Return the least of all (b,) [m]; infinite without obstacles and pairs."""
        return _least(*self.measured(q))

    def room(self, q: Array, required: KernelClearance | None, taken: tuple[Array, Array] | None = None) -> Room:
        """Compare the clearances of configurations with those required of each pair.

        Args:
            q: (b, n) configurations [rad or m].
            required: of the pairs; None: no contact is enough.
            taken: (b, c) and (b, p): what a tracking error takes from shapes and obstacles, and from pairs of shapes [m].
        """
        to_scene, between = self.measured(q)
        if taken is not None:
            to_scene, between = to_scene - taken[0][:, :, None], between - taken[1]
        least = _least(to_scene, between)
        if required is None:
            return Room(least=least, beyond=least, lacking=np.maximum(-least, 0.0))
        to_scene, between = to_scene - required.to_obstacles, between - required.between_links
        lacking = np.maximum(-to_scene, 0.0).sum(axis=(-2, -1)) + np.maximum(-between, 0.0).sum(axis=-1)
        return Room(least=least, beyond=_least(to_scene, between), lacking=lacking)

    def required_by(self, problem: HasScene) -> KernelClearance:
        """Return what a problem requires of the kernel's pairs; no more than no contact where it does not say."""
        shape, pairs = (len(self.robot.shapes), len(self.obstacle_of)), getattr(problem, "clearances", ())
        if not pairs:
            clearance = float(getattr(problem, "clearance", 0.0))
            return KernelClearance(np.full(shape, clearance), np.full(len(self.pairs), clearance), alike=True)
        required = required_clearance(problem.robot, problem.scene, getattr(problem, "clearance", 0.0), pairs)
        row = {link: i for i, link in enumerate(required.links)}
        rows = np.array([row[part.name] for part in self.robot.shapes], dtype=np.intp)
        one, two = (rows[self.pairs[:, k]] for k in range(2))
        to_obstacles = np.zeros(shape)
        if len(self.scene.obstacles):  # there may be none though the problem has some: where they are is not known
            to_obstacles = required.to_obstacles[rows[:, None], self.obstacle_of]
        return KernelClearance(to_obstacles, required.between_links[one, two], alike=False)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class KernelClearance(Brief):
    """A clearance of each of the kernel's pairs.

    Attributes:
        to_obstacles: (c, j) of shapes and the kernel's obstacles [m].
        between_links: (p,) of the pairs of shapes [m].
        alike: whether all are the same.
    """

    to_obstacles: Array
    between_links: Array
    alike: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Room(Brief):
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


def _least(to_scene: Array, between: Array) -> Array:
    count, shapes, obstacles = to_scene.shape
    of_scene: Array = to_scene.reshape(count, shapes * obstacles).min(axis=1, initial=np.inf)  # quicker than of two axes
    return np.minimum(of_scene, between.min(axis=-1, initial=np.inf))


def clearances(problem: HasScene, q: ArrayLike) -> Array:
    """Return the clearance of every shape of the links and every obstacle: their signed distance.

    A floating base is where it stands at the beginning.

    Args:
        problem: the robot, with c shapes, and the scene, with k obstacles.
        q: (..., n) configurations [rad or m].

    Returns:
        (..., c, k) [m]; negative is penetration.

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    rows, shape = _rows(problem.robot, q)
    found = prepared(problem).to_obstacles(rows)
    return found.reshape(*shape, *found.shape[1:])


def self_clearances(problem: HasScene, q: ArrayLike) -> Array:
    """Return the clearance between the robot's own shapes.

    Args:
        problem: the robot, with p pairs of shapes that must keep clear (`self_shape_pairs` lists them).
        q: (..., n) configurations [rad or m].

    Returns:
        (..., p) signed distances [m]; negative is penetration.

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    rows, shape = _rows(problem.robot, q)
    found = prepared(problem).between_links(rows)
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
    return prepared(problem).least(rows).reshape(shape)


def _rows(robot: Robot, q: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Return configurations (..., n) as rows (b, n), checked, and the leading axes."""
    array = as_configurations(robot, q)
    return array.reshape(-1, robot.dof), array.shape[:-1]


def prepared(problem: HasScene) -> ClearanceModel:
    """Return the model of a problem as it is told in the frame of its base at the beginning, if it has a base."""
    here: HasScene = getattr(problem, "local", problem)
    return clearance_model(here.robot, here.scene)


_models = IdentityCache[ClearanceModel](_PREPARED)


def clearance_model(robot: Robot, scene: Scene) -> ClearanceModel:
    """Return the model of a robot among obstacles; the same one for the objects seen last."""
    return _models.get((robot, scene), (), lambda: ClearanceModel(robot, scene))
