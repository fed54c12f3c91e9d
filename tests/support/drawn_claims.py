"""Drawn claims, each from a seed: robots and scenes of every shape on bases of every kind, and parts of them to be proven."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from spacearm.dynamics import Momentum
from spacearm.geometry import HalfSpace, Obstacle, Scene, SphereSet, pose
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.claim import Claim, claim_of
from spacearm.proof.path_intervals import Intervals, PathIntervals
from spacearm.proof.proof_tree import ProofTree
from spacearm.proof.required_clearance import required_clearance
from spacearm.robot import Robot
from spacearm.robot.unchecked_pairs import apart_pairs
from support.drawn_bodies import drawn_shape_obstacle, with_bodies, with_masses
from support.drawn_problems import drawn_configuration, drawn_robot
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames

Array = np.ndarray


class Drawn(NamedTuple):
    """A claim, and what it is about."""

    claim: Claim
    robot: Robot
    scene: Scene
    trajectory: AnyTrajectory


class Part(PathIntervals):
    """A part of a path, as if it were the whole."""

    def __init__(self, path: PathIntervals, interval: Intervals) -> None:
        self.__dict__.update(path.__dict__)
        self._interval = interval

    def whole(self) -> Intervals:
        return self._interval


def drawn_claim(
    seed: int, *, floating: bool = False, reach: float = 1.0, clearance: float = 0.0, tracking: bool = False
) -> Drawn:
    """Draw a claim; nothing says that it is true.

    Args:
        seed: of everything.
        floating: whether the arm moves the base; it then tumbles at times.
        reach: share of the joints' ranges that is moved through.
        clearance: required of all pairs [m].
        tracking: whether the joints may deviate.
    """
    rng = np.random.default_rng((seed, 12))
    robot = with_bodies(rng, drawn_robot(rng), base=bool(rng.random() < 0.6))
    while not robot.shapes:
        robot = with_bodies(rng, drawn_robot(rng), base=True)
    robot = replace(with_masses(rng, robot) if floating else robot, base="floating" if floating else "fixed")
    names = sorted({part.name for part in robot.shapes})
    every = [(one, other) for i, one in enumerate(names) for other in names[i + 1 :]]
    robot = replace(robot, self_pairs=tuple(pair for pair in every if rng.random() < 0.5))
    scene = Scene(_obstacles(rng))
    trajectory = _trajectory(rng, robot, reach, floating=floating)
    return Drawn(claim_about(robot, scene, trajectory, clearance, _tube(rng, robot, tracking)), robot, scene, trajectory)


def cleared_claim(seed: int, *, floating: bool = False, reach: float = 1.0, tracking: bool = False) -> Drawn:
    """Draw a claim, and leave out of it what comes nearer than 2 cm, as far as is measured; some pairs of links cannot meet."""
    drawn = drawn_claim(seed, floating=floating, reach=reach)
    rng, robot, u = np.random.default_rng((seed, 13)), drawn.robot, np.linspace(*drawn.claim.path.curve.domain, 60)
    frames = placed_frames(drawn.claim, u)
    alone = replace(robot, self_pairs=())
    kept = [one for one in drawn.scene.obstacles if least_distances(alone, Scene([one]), frames).min() > 0.02]
    pairs = [
        pair for pair in robot.self_pairs if least_distances(replace(robot, self_pairs=(pair,)), Scene([]), frames).min() > 0.02
    ]
    never = [pair for pair in pairs if rng.random() < 0.3]
    robot = replace(robot, self_pairs=tuple(pair for pair in pairs if pair not in never))
    robot = replace(robot, apart=apart_pairs(robot, never))
    tube = _tube(rng, robot, tracking)
    trajectory = replace_robot(drawn.trajectory, robot)
    return Drawn(claim_about(robot, Scene(kept), trajectory, 0.0, tube), robot, Scene(kept), trajectory)


def replace_robot(trajectory: Any, robot: Robot) -> Any:
    """Return the same trajectory of another robot."""
    names = [name for name in trajectory.__dataclass_fields__ if name not in ("_", "robot")]
    return type(trajectory)(robot, **{name: getattr(trajectory, name) for name in names})


def placed_frames(claim: Claim, u: Array, off: Array | float = 0.0) -> Array:
    """T_w_joint (r, j + 1, 4, 4) at parameters (r,), the last for the base, of joints that deviate by `off`."""
    own = joint_frames(claim.robot, claim.path.curve.sample(u) + off)
    return claim.base.placed(u, np.concatenate([own, np.broadcast_to(np.eye(4), (len(u), 1, 4, 4))], axis=1))


def frames_at(claim: Claim, u: Array, off: Array | float = 0.0) -> Array:
    """All frames (r, j + 2, 4, 4) at parameters (r,), inertial one first, with joints that deviate."""
    placed, world = placed_frames(claim, u, off), np.broadcast_to(np.eye(4), (len(u), 1, 4, 4))
    return np.concatenate([world, placed[:, -1:], placed[:, :-1]], axis=1)


def least_clearance(drawn: Drawn, seed: int, instants: int = 60) -> float:
    """The least clearance of all pairs at many instants, by Pinocchio and Coal, of joints that deviate as they may [m]."""
    claim, rng, robot = drawn.claim, np.random.default_rng(seed), drawn.claim.robot
    u = np.concatenate([claim.path.curve.domain, rng.uniform(*claim.path.curve.domain, instants)])
    off = claim.tracking * rng.choice([-1.0, 0.0, 1.0], (len(u), len(claim.tracking)))
    pairs = (*robot.self_pairs, *(() if robot.apart is None else robot.apart.pairs))
    every = replace(robot, self_pairs=tuple(sorted(pairs)), apart=None)
    return float(least_distances(every, drawn.scene, placed_frames(claim, u, off)).min())


def claim_about(
    robot: Robot, scene: Scene, trajectory: AnyTrajectory, clearance: float = 0.0, tracking: Array | None = None, **more: Any
) -> Claim:
    """Return the claim that a trajectory keeps a clearance."""
    base = begun_base_proof(robot, trajectory, base_setup_of(trajectory, robot, who="trajectory"))
    required = required_clearance(robot, scene, clearance)
    return claim_of(robot, scene, base, PathIntervals(base.curve), required=required, tracking=tracking, **more)


def _tube(rng: np.random.Generator, robot: Robot, tracking: bool) -> Array | None:
    return 10 ** rng.uniform(-6, -2, robot.dof) * (rng.random(robot.dof) < 0.7) if tracking else None


def _obstacles(rng: np.random.Generator) -> list[Obstacle]:
    some: list[Obstacle] = [drawn_shape_obstacle(rng, i) for i in range(int(rng.integers(1, 6)))]
    if rng.random() < 0.5:
        count = int(rng.choice([3, 65, 300]))
        some.append(SphereSet(rng.normal(size=(count, 3)), rng.uniform(0.005, 0.05, count)))
    if rng.random() < 0.5:
        normal = rng.normal(size=3)
        some.append(HalfSpace(normal, -rng.uniform(0.3, 3) * normal / np.linalg.norm(normal)))
    return some


def _trajectory(rng: np.random.Generator, robot: Robot, reach: float, *, floating: bool) -> AnyTrajectory:
    start = pose(rng.normal(size=3), rng.normal(size=4)) if rng.random() < 0.5 else np.eye(4)
    held: dict[str, Any] = {"base_start": start}
    if floating and rng.random() < 0.4:
        held["momentum"] = Momentum(linear=rng.normal(size=3), angular=rng.normal(size=3))
    begin = drawn_configuration(rng, robot)
    if rng.random() < 0.6:
        rows = [begin + reach * (drawn_configuration(rng, robot) - begin) for _ in range(int(rng.integers(1, 5)))]
        return Trajectory(robot, Motion(np.array([begin, *rows])), **held)
    count = int(rng.choice([2, 6, 40]))
    steps = np.array([reach * (drawn_configuration(rng, robot) - begin) for _ in range(count - 1)])
    q = (
        np.concatenate([begin[None], begin + steps])
        if rng.random() < 0.5
        else begin + np.outer(np.arange(count), steps[0] / count)
    )
    make = PiecewisePath.from_linear if rng.random() < 0.5 else PiecewisePath.from_cubic
    return RecordedTrajectory(robot, make(np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1, count - 1))]), q), **held)


def any_pair(rng: np.random.Generator, claim: Claim) -> tuple[int, int]:
    """Draw two bodies of the table that are kept apart, shapes or bundles."""
    i, bodies = int(rng.integers(len(claim.pairs.first))), claim.bodies
    pair = [int(claim.pairs.first[i]), int(claim.pairs.other[i])]
    for k in (0, 1):
        while bodies.members[pair[k]] and rng.random() < 0.8:
            pair[k] = int(bodies.first_member[pair[k]] + rng.integers(bodies.members[pair[k]]))
    return pair[0], pair[1]


def any_stretch(rng: np.random.Generator, claim: Claim, deepest: int = 12) -> Intervals:
    """Draw a stretch of the path by halving it."""
    interval = claim.path.whole()
    for _ in range(int(rng.integers(deepest + 1))):
        interval = claim.path.halved(interval).select(rng.integers(0, 2, 1))
    return interval


def only(claim: Claim, first: int, other: int, interval: Intervals | None = None, required: float = -1e9) -> Claim:
    """Return the claim of two bodies on a stretch of the path alone; by default whatever is proven is enough."""
    held = replace(claim.held, required=np.full_like(claim.held.required, required), near=np.zeros_like(claim.held.near))
    pairs = replace(claim.pairs, first=np.array([first]), other=np.array([other]))
    return replace(claim, pairs=pairs, held=held, path=claim.path if interval is None else Part(claim.path, interval))


def tree(steps: Any, directions: Any) -> ProofTree:
    """Return a proof of lists."""
    return ProofTree(steps=np.array(steps, np.uint8), directions=np.array(directions, np.float64).reshape(-1, 3))
