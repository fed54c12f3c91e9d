"""Motions that are drawn to be hard to judge: half of them come within 1e-9 to 1e-3 m of the clearance that is required.

A *group* has one robot, one scene and twenty motions, so that what is made once for a robot is made once. What a motion's least
clearance is, Pinocchio and Coal measure; then the clearance that is required is set a little below or above it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofs.coal_oracle import CoalOracle
from soak_certificate import drawn_obstacle, drawn_robot
from spacearm.dynamics import Momentum
from spacearm.geometry import Scene, pose
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory
from spacearm.proof import PairClearance
from spacearm.proof.base_proofs import BaseProof, base_setup_of, begun_base_proof
from spacearm.robot import Body, Robot
from support.floating_cases import blind_path

Array = NDArray[np.float64]

GROUP = 20
INSTANTS = 25  # of a motion at which all pairs are measured at first
_LEAST, _GREATEST = -9.0, -3.0  # logarithms of the distance [m] from what is required
_ROUNDS, _POINTS, _NARROWER = 10, 9, 4.0  # of the search for the closest approach


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawn:
    """A motion and what is asked of it.

    Attributes:
        robot, scene, trajectory: of it.
        base: where the base is along it.
        oracle: of robot and scene.
        clearance, clearances: that are required [m].
        tracking: (n,) by how much joints may deviate.
        closest: the instant that was found to be closest, in the parameter of the base's curve.
        grazing: by how much the least clearance that was found is more than required [m]; NaN: drawn otherwise.
        kind: in words.
    """

    robot: Robot
    scene: Scene
    trajectory: AnyTrajectory
    base: BaseProof
    oracle: CoalOracle
    clearance: float
    clearances: tuple[PairClearance, ...]
    tracking: Array
    closest: float
    grazing: float
    kind: str

    @property
    def base_start(self) -> Array:
        return self.trajectory.base_start

    @property
    def momentum(self) -> Momentum:
        return self.trajectory.momentum

    def placed(self, u: Array, deviation: Array | None = None) -> Array:
        """Return the oracle's q (r, 7 + joints) at parameters (r,) of the curve, the joints off by (r, n) or (n,)."""
        q = self.base.curve.sample(u)
        if self.trajectory.base != "floating":
            return self.oracle.full(q if deviation is None else q + deviation, self.trajectory.base_start)
        return self.oracle.full(q, base_poses(self.base, self.oracle, u, q))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Group:
    robot: Robot
    scene: Scene
    trajectories: list[AnyTrajectory]
    oracle: CoalOracle


def drawn(seed: int, number: int) -> Drawn:
    """Draw a motion. The same robot and scene serve for twenty numbers that follow each other."""
    group = _group(seed, number // GROUP)
    rng = np.random.default_rng((seed, number, 1))
    robot, scene, oracle = group.robot, group.scene, group.oracle
    trajectory = group.trajectories[number % GROUP]
    setup = base_setup_of(trajectory, robot, who="trajectory")
    base = begun_base_proof(robot, trajectory, setup)
    tracking = np.zeros(robot.dof)
    if trajectory.base == "fixed" and rng.random() < 0.2:
        tracking = 10 ** rng.uniform(-5, -2) * (rng.random(robot.dof) < 0.8)
    kind = f"{trajectory.base}, {_written(trajectory)}{', tracking error' if tracking.any() else ''}"
    made = Drawn(
        robot=robot,
        scene=scene,
        trajectory=trajectory,
        base=base,
        oracle=oracle,
        clearance=0.0,
        clearances=(),
        tracking=tracking,
        closest=float(base.curve.domain[0]),
        grazing=float("nan"),
        kind=kind,
    )
    if not oracle.pairs:
        return made
    if number % 2:
        return _with_any_clearance(rng, made)
    return _grazing(rng, made)


def _written(trajectory: AnyTrajectory) -> str:
    if isinstance(trajectory, Trajectory):
        return "spline"
    return "recording of over 200 pieces" if trajectory.path.pieces > 200 else f"pieces of degree {trajectory.path.degree}"


# ---- Clearances ------------------------------------------------------------------------------------------------------


def _grazing(rng: np.random.Generator, made: Drawn) -> Drawn:
    """Require a little less or more than there is: of all pairs, or of up to three obstacles each."""
    begin, end = made.base.curve.domain
    u = np.linspace(begin, end, INSTANTS)
    distances = made.oracle.distances(made.placed(u))
    column = int(np.argmin(distances.min(axis=0)))
    u_closest, least = _tightest(made, column, u, distances[:, column])
    if least <= 1e-9:  # it collides, or touches
        return replace(made, closest=u_closest, kind=made.kind + ", colliding")
    excess = float(10 ** rng.uniform(_LEAST, _GREATEST) * rng.choice([1, 1, 1, -1, -1]))
    clearance = max(0.0, least - excess)
    clearances: list[PairClearance] = []
    if rng.random() < 0.3:
        clearances = _by_pair(rng, made, u, distances, column)
    return replace(made, closest=u_closest, clearance=clearance, clearances=tuple(clearances), grazing=least - clearance)


def _by_pair(rng: np.random.Generator, made: Drawn, u: Array, distances: Array, but: int) -> list[PairClearance]:
    """Return clearances for some other pairs that they just keep, or just do not."""
    out: list[PairClearance] = []
    robot = made.robot
    links = [part.name for part in robot.shapes]
    free = [i for i in np.argsort(distances.min(axis=0)).tolist() if distances[:, i].min() > 1e-3 and i != but]
    taken = {_names(made, but)}
    for i in free[:12]:
        if len(out) == 2:
            break
        pair, names = made.oracle.pairs[i], _names(made, i)
        if names in taken or (pair.other >= 0 and links[pair.shape] == links[pair.other]):
            continue
        taken.add(names)
        same = [k for k in range(len(made.oracle.pairs)) if _names(made, k) == names]
        least = min(_tightest(made, k, u, distances[:, k])[1] for k in same[:3])
        wanted = max(0.0, least - float(10 ** rng.uniform(_LEAST, _GREATEST) * rng.choice([1, 1, 1, -1])))
        if pair.other >= 0:
            out.append(PairClearance(wanted, link=names[0], other_link=names[1]))
        else:
            out.append(PairClearance(wanted, link=names[0], obstacle=names[1]))
    return out


def _names(made: Drawn, column: int) -> tuple[str, str]:
    pair = made.oracle.pairs[column]
    first = made.robot.shapes[pair.shape].name
    if pair.other >= 0:
        return first, made.robot.shapes[pair.other].name
    return first, str(made.scene.obstacles[pair.obstacle].name)


def _with_any_clearance(rng: np.random.Generator, made: Drawn) -> Drawn:
    """Require nothing in half of all cases, or any clearance, often more than there is at an end; some by link."""
    if rng.random() < 0.5:
        return made
    clearance = float(rng.choice([1e-4, 0.001, 0.01, 0.1]))
    if rng.random() < 0.6:
        ends = made.oracle.distances(made.placed(np.array(made.base.curve.domain)))
        some = ends[ends > 0]
        clearance = float(rng.uniform(0.9, 3) * some.min()) if some.size else clearance
    links = sorted({part.name for part in made.robot.shapes})
    some = [PairClearance(float(rng.choice([0.0, 0.02, 0.2])), link=link) for link in links if rng.random() < 0.3]
    return replace(made, clearance=clearance, clearances=tuple(some) if rng.random() < 0.3 else ())


# ---- The closest approach --------------------------------------------------------------------------------------------


def _tightest(made: Drawn, pair: int, u: Array, distances: Array) -> tuple[float, float]:
    """Return the instant of a pair's closest approach, and the distance there, with the worst tracking error."""
    at, least = closest(made, pair, u, distances)
    off = worst_deviation(made, pair, at)
    if off is None:
        return at, least
    near = np.clip(at + (u[1] - u[0]) * np.linspace(-0.5, 0.5, 9), u[0], u[-1])
    return closest(made, pair, near, made.oracle.of_pair(pair, made.placed(near, off)), off)


def closest(made: Drawn, pair: int, u: Array, distances: Array, deviation: Array | None = None) -> tuple[float, float]:
    """Return the instant of a pair's closest approach and the distance there, from distances (r,) at instants (r,)."""
    i = int(np.argmin(distances))
    at, least, wide = float(u[i]), float(distances[i]), float(u[1] - u[0])
    begin, end = made.base.curve.domain
    for _ in range(_ROUNDS):
        around = np.clip(np.linspace(at - wide, at + wide, _POINTS), begin, end)
        found = made.oracle.of_pair(pair, made.placed(around, deviation))
        k = int(np.argmin(found))
        if found[k] < least:
            at, least = float(around[k]), float(found[k])
        wide /= _NARROWER
    return at, least


def worst_deviation(made: Drawn, pair: int, u: float) -> Array | None:
    """Return the corner (n,) of the tracking error's box where a pair is closest to first order; None: there is no error."""
    if not made.tracking.any():
        return None
    moved = np.concatenate([np.diag(made.tracking), -np.diag(made.tracking)])
    found = made.oracle.of_pair(pair, made.placed(np.full(len(moved), u), moved))
    return np.where(found[: len(found) // 2] < found[len(found) // 2 :], 1.0, -1.0) * made.tracking


def base_poses(base: BaseProof, oracle: CoalOracle, u: Array, q: Array) -> Array:
    """Return T_w_b (r, 4, 4) of a floating base by its proof, of which benchmarks/soak_floating_base.py finds the faults."""
    frames = np.empty((len(u), len(base.robot.joints) + 1, 4, 4))
    frames[:, -1] = np.eye(4)
    for row, values in zip(frames, oracle.full(q), strict=True):
        row[:-1] = oracle.joint_frames(values)
    return base.placed(u, frames)[:, -1]


# ---- Robots, scenes, trajectories ------------------------------------------------------------------------------------


@lru_cache(maxsize=2)
def _group(seed: int, group: int) -> _Group:
    """Draw a group: what collides on most of its motions is taken away, so that something is left to be proven."""
    rng = np.random.default_rng((seed, group, 0))
    robot = drawn_robot(rng, 14)
    if rng.random() < 0.2:
        robot = _floating(rng, robot)
    scene = Scene([replace_name(drawn_obstacle(rng), f"o{i}") for i in range(rng.integers(0, 7))])
    trajectories = [drawn_trajectory(rng, robot) for _ in range(GROUP)]
    oracle = CoalOracle(robot, scene)
    if oracle.pairs:
        robot, scene = _mostly_free(rng, robot, scene, oracle, trajectories)
        trajectories = [_for(robot, trajectory) for trajectory in trajectories]
        oracle = CoalOracle(robot, scene)
    return _Group(robot=robot, scene=scene, trajectories=trajectories, oracle=oracle)


def _mostly_free(
    rng: np.random.Generator, robot: Robot, scene: Scene, oracle: CoalOracle, trajectories: list[AnyTrajectory]
) -> tuple[Robot, Scene]:
    bad: dict[Any, int] = {}
    links = [part.name for part in robot.shapes]
    for trajectory in trajectories:
        u = np.linspace(*trajectory.curve.domain, 9)
        hit = oracle.distances(oracle.full(trajectory.curve.sample(u), trajectory.base_start)).min(axis=0) <= 0
        seen = {
            one.obstacle if one.obstacle >= 0 else (links[one.shape], links[one.other])
            for one, touched in zip(oracle.pairs, hit, strict=True)
            if touched
        }
        for key in seen:
            bad[key] = bad.get(key, 0) + 1
    away = {key for key, times in bad.items() if times > 1 and rng.random() < 0.95}
    obstacles = [one for i, one in enumerate(scene.obstacles) if i not in away]
    pairs = tuple(pair for pair in robot.self_pairs if pair not in away)
    return replace(robot, self_pairs=pairs), Scene(obstacles)


def replace_name(obstacle: Any, name: str) -> Any:
    return replace(obstacle, name=name)


def _for(robot: Robot, trajectory: AnyTrajectory) -> AnyTrajectory:
    return replace(trajectory, robot=robot)


def _floating(rng: np.random.Generator, robot: Robot) -> Robot:
    heavy, light = float(rng.choice([0.1, 1.0, 10.0])), float(rng.choice([0.3, 1.0, 10.0, 100.0]))
    bodies = [_body(rng, "bus", -1, heavy * light)]
    bodies += [_body(rng, f"mass_{i}", i, heavy * rng.uniform(0.1, 2)) for i in range(len(robot.joints))]
    return replace(robot, bodies=tuple(bodies), base="floating")


def _body(rng: np.random.Generator, name: str, joint: int, mass: float) -> Body:
    """Return a body with the inertia of some points of mass."""
    x = 0.3 * rng.normal(size=(4, 3))
    spread = mass / 4 * np.einsum("pi,pj->ij", x, x)
    inertia = np.trace(spread) * np.eye(3) - spread + 1e-3 * mass * np.eye(3)
    return Body(name=name, joint=joint, mass=float(mass), com=0.2 * rng.normal(size=3), inertia=(inertia + inertia.T) / 2)


def drawn_trajectory(rng: np.random.Generator, robot: Robot) -> AnyTrajectory:
    """Return splines, lines, cubics, quintics with rests, long recordings, and paths that rest in Gauss points."""
    size, kind = float(rng.choice([0.1, 0.5, 2.0])), rng.random()
    held: dict[str, Any] = {"base_start": pose(rng.normal(size=3), rng.normal(size=4)) if rng.random() < 0.2 else np.eye(4)}
    if robot.base == "floating" and rng.random() < 0.15:
        held["momentum"] = Momentum(angular=0.05 * robot.bodies[0].mass * rng.normal(size=3))
    if kind < 0.5:
        motion = Motion(size * rng.normal(size=(rng.integers(2, 7), robot.dof)))
        law = TimeLaw([0.0, 0.3, 1.0], [[0, 0.05, 0.1, 0.2], [0.2, 0.2 + 7 / 3 * 0.1, 0.8, 1]]) if kind < 0.04 else None
        return Trajectory(robot, motion, time_law=law, **held)
    count = int(rng.integers(2, 40)) if kind < 0.97 else int(rng.integers(300, 1500))
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 1, count - 1))])
    q = np.cumsum(min(0.3, 3 / np.sqrt(count)) * size * rng.normal(size=(count, robot.dof)), axis=0)
    if kind < 0.85:
        path = PiecewisePath.from_linear(t, q) if kind < 0.65 else PiecewisePath.from_cubic(t, q)
    elif kind < 0.93 and count >= 4:
        rests = np.flatnonzero(rng.random(count) < 0.3)
        q[rests[rests > 0]] = q[rests[rests > 0] - 1]
        path = PiecewisePath.from_quintic(t, q, np.zeros_like(q), np.zeros_like(q))
    elif kind < 0.97 and count >= 4:
        path = blind_path(rng, t[:4], q[:4])
    else:
        path = PiecewisePath.from_linear(t, q)
    return RecordedTrajectory(robot, path, **held)
