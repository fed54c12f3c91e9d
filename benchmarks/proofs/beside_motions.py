"""The motions that all methods look at: planned ones, and the same with a ball in their way that they touch for an instant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import coal
import numpy as np
from numpy.typing import NDArray

from proofs.coal_oracle import CoalOracle
from spacearm.files import load_problem
from spacearm.geometry import Scene, Sphere
from spacearm.motion import Trajectory
from spacearm.planner import BaseLimits, PlannerSettings, Problem, plan
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.claim import Claim, claim_of
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import required_clearance

Array = NDArray[np.float64]

STEP = 0.005
"""How far apart the sampled configurations are, as the norm over the joints [rad]."""

DEPTHS = (1e-6, 1e-5, 1e-4, 1e-3)
"""How deep the balls in the way are touched [m]."""

_EVALUATIONS = 2000  # of the search for a motion
_ROOM, _SMALL = 5e-4, 5e-3  # [m] that a ball's centre has at least and at most: its radius
_TRIES = 100


@dataclass(frozen=True, eq=False)
class AMotion:
    """A planned motion among obstacles; nothing may touch.

    Attributes:
        robot: what the table calls the set of motions.
        name: of the motion.
        problem, trajectory: of it.
        depth: how deep it touches the ball in its way [m]; 0: there is none, and it is free.
        touched: the instant at which it does.
    """

    robot: str
    name: str
    problem: Problem
    trajectory: Trajectory
    depth: float = 0.0
    touched: float = float("nan")

    @cached_property
    def oracle(self) -> CoalOracle:
        return CoalOracle(self.problem.robot, self.problem.scene)

    def forget(self) -> None:
        """Forget the oracle, which may be large."""
        self.__dict__.pop("oracle", None)

    def instants(self, step: float) -> tuple[Array, Array]:
        """Return parameters (m,) and configurations (m, n) at most a step apart."""
        domain = self.trajectory.curve.domain
        count = 64
        while True:
            u = np.linspace(*domain, count + 1)
            q = self.trajectory.curve.sample(u)
            gaps = np.linalg.norm(np.diff(q, axis=0), axis=1)
            if gaps.max() <= step:
                break
            count *= 2
        along = np.concatenate([[0.0], np.cumsum(gaps)])
        even = np.interp(np.linspace(0, along[-1], 2 + int(along[-1] / (0.97 * step))), along, u)
        return even, self.trajectory.curve.sample(even)

    def placed(self, u: Array) -> Array:
        """Return the oracle's q at parameters (r,)."""
        return self.oracle.full(self.trajectory.curve.sample(u))

    @cached_property
    def least(self) -> float:
        """The least clearance of all pairs, measured [m]."""
        u = np.linspace(*self.trajectory.curve.domain, 257)
        distances = self.oracle.distances(self.placed(u))
        some = np.argsort(distances.min(axis=0))[:5]
        return min(_closest(self, int(pair), u, distances[:, pair])[1] for pair in some)

    def claim(self, clearance: float = 0.0) -> Claim:
        """Return what a proof has to show: that all pairs keep a clearance [m]; with 0, that nothing touches."""
        problem, trajectory = self.problem, self.trajectory
        setup = base_setup_of(trajectory, problem.robot, who="trajectory")
        base = begun_base_proof(problem.robot, trajectory, setup)
        required = required_clearance(problem.robot, problem.scene, clearance)
        return claim_of(problem.robot, problem.scene, base, PathIntervals(base.curve), required=required)


def planned(name: str, called: str, problem: Problem, seed: int) -> AMotion | None:
    """Plan a motion with a fixed base; None: none was found."""
    problem = replace(problem, clearance=0.0, clearances=(), base="fixed", base_goal=None, base_limits=BaseLimits())
    found = plan(problem, PlannerSettings(evaluations=_EVALUATIONS, threads=1), rng=seed)
    if found.trajectory is None or not isinstance(found.trajectory, Trajectory):
        return None
    return AMotion(name, called, problem, found.trajectory)


def of_collection(folder: Path, most: int) -> list[AMotion]:
    """Plan motions for MotionBenchMaker's problems, the first ones of each family."""
    from planners.cases import load_collection

    collection = load_collection(folder, most=most)
    name = collection.robot.capitalize()
    made = [planned(name, case.name, case.problem, seed) for seed, case in enumerate(collection.cases)]
    return [one for one in made if one is not None]


def of_problem_file(path: Path, name: str, count: int) -> list[AMotion]:
    """Plan motions for a problem file, with different seeds."""
    problem = load_problem(path)
    made = [planned(name, f"{path.stem}, seed {seed}", problem, seed) for seed in range(count)]
    return [one for one in made if one is not None]


# ---- A ball in the way -----------------------------------------------------------------------------------------------


def with_balls(motion: AMotion, seed: Sequence[int]) -> Iterator[AMotion]:
    """Put a ball into the way of a motion, one for each depth.

    The centre of the ball is drawn beside the swept volume, and the ball is as large as its least clearance along the motion,
    and the depth more. So the motion is in collision for an instant, by that depth, and free otherwise.
    """
    for k, depth in enumerate(DEPTHS):
        made = _with_ball(motion, depth, np.random.default_rng((*seed, k)))
        if made is not None:
            yield made


def _with_ball(motion: AMotion, depth: float, rng: np.random.Generator) -> AMotion | None:
    begin, end = motion.trajectory.curve.domain
    u = np.linspace(begin, end, 257)
    robot = replace(motion.problem.robot, self_pairs=(), apart=None)
    for _ in range(_TRIES):
        point = _beside(motion, rng)
        alone = replace(motion, problem=replace(motion.problem, robot=robot, scene=_ball(point, 0.0)))
        distances = alone.oracle.distances(alone.placed(u))
        pair = int(np.argmin(distances.min(axis=0)))
        if not _ROOM < distances.min() < _SMALL:
            continue
        touched, least = _closest(alone, pair, u, distances[:, pair])
        if least > _ROOM and begin + 0.02 * (end - begin) < touched < end - 0.02 * (end - begin):
            scene = Scene([*motion.problem.scene.obstacles, *_ball(point, least + depth).obstacles])
            made = replace(motion, problem=replace(motion.problem, scene=scene), depth=depth, touched=touched)
            if made.oracle.distances(made.placed(np.linspace(begin, end, 1025))).min() > -1.5 * depth:
                return made
    return None


def _beside(motion: AMotion, rng: np.random.Generator) -> Array:
    """Return a point (3,) a few millimetres beside a body that moves fast, across its motion."""
    begin, end = motion.trajectory.curve.domain
    u = rng.uniform(begin + 0.05 * (end - begin), end - 0.05 * (end - begin)) + np.array([0.0, 1e-4 * (end - begin)])
    oracle, centers = motion.oracle, []
    count = len(motion.problem.robot.shapes)
    for full in motion.placed(u):
        oracle.place(full)
        centers.append([np.array(oracle.found.oMg[i].translation) for i in range(count)])
    moved = np.subtract(*np.array(centers)[::-1])
    speed = np.linalg.norm(moved, axis=1)
    body = int(rng.choice(count, p=speed**2 / (speed**2).sum()))
    away = np.cross(moved[body], rng.normal(size=3))
    size = float(oracle.bodies.geometryObjects[body].geometry.aabb_radius)
    far = np.array(centers)[1, body] + 2 * size * away / np.linalg.norm(away)
    geometry, at = oracle.bodies.geometryObjects[body].geometry, oracle.found.oMg[body]
    result = coal.DistanceResult()
    coal.distance(
        geometry,
        coal.Transform3s(np.array(at.rotation), np.array(at.translation)),
        coal.Sphere(1e-9),
        coal.Transform3s(np.eye(3), far),
        coal.DistanceRequest(),
        result,
    )
    near = np.array(result.getNearestPoint1())
    return near + rng.uniform(0.001, 0.004) * (far - near) / np.linalg.norm(far - near)


def _ball(point: Array, radius: float) -> Scene:
    return Scene([Sphere(point, max(radius, 1e-12), name="in the way")])


def _closest(motion: AMotion, pair: int, u: Array, distances: Array) -> tuple[float, float]:
    """Return the instant at which a pair is closest, and the distance there [m]."""
    at, least, wide = float(u[np.argmin(distances)]), float(distances.min()), float(u[1] - u[0])
    for _ in range(14):
        around = np.clip(np.linspace(at - wide, at + wide, 9), u[0], u[-1])
        found = motion.oracle.of_pair(pair, motion.placed(around))
        at, least = float(around[np.argmin(found)]), min(least, float(found.min()))
        wide /= 3
    return at, least
