"""A long search for a certificate that is wrong: drawn robots, scenes and trajectories, looked at by others afterwards.

Robots with branches, slides and mimics; links and obstacles of every shape; splines, straight lines and cubics; clearances of
0 to 0.5 m, by pair too, and often more than there is at the start or the end, so that pairs are near there. Where a certificate
holds, Pinocchio and Coal measure the clearance of every pair at many random instants and around the closest approach; where it
fails, at the instant that it names. A case is drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak_certificate.py --seconds 600 --count 1000000 --instants 500
    python benchmarks/soak_certificate.py --seed 0 --only 1234
    python benchmarks/soak_certificate.py --count 1000 --data DIR    # planned motions of MotionBenchMaker's Panda instead
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fault_search import Case, Outcome, search  # puts the tests' modules on the path
from spacearm.files import load_moveit
from spacearm.geometry import (
    Box,
    Capsule,
    ConvexShape,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    SphereSet,
    pose,
)
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.planner import PlannerSettings, plan
from spacearm.proof import Certificate, PairClearance, certify
from spacearm.robot import Frame, Joint, LinkCapsule, LinkShape, Robot, load_robot
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames
from support.pair_distances import distances, stated

TOLERANCE = 1e-7  # [m] Coal's and Pinocchio's rounding
DEPTH = 1e-4  # [m] of Coal's penetration depths


class Trial(NamedTuple):
    """What a certificate is asked about: whether anything touches."""

    robot: Robot
    scene: Scene
    trajectory: AnyTrajectory
    clearance: float = 0.0
    clearances: tuple[PairClearance, ...] = ()


def drawn(seed: int, number: int) -> Trial:
    rng = np.random.default_rng((seed, number))
    robot = drawn_robot(rng)
    scene = Scene([drawn_obstacle(rng) for _ in range(rng.integers(0, 7))])
    trajectory = drawn_trajectory(rng, robot)
    return Trial(
        robot, scene, trajectory, *drawn_clearances(np.random.default_rng((seed, number, 1)), robot, scene, trajectory)
    )


def drawn_clearances(
    rng: np.random.Generator, robot: Robot, scene: Scene, trajectory: AnyTrajectory
) -> tuple[float, tuple[PairClearance, ...]]:
    """What is required: nothing in a third of all cases, more than there is at an end in another third; some by link."""
    if rng.random() < 1 / 3:
        return 0.0, ()
    clearance = float(rng.choice([0.001, 0.01, 0.1, 0.5]))
    if rng.random() < 0.5:
        ends = trajectory.curve.sample(np.array(trajectory.curve.domain))
        least = least_distances(robot, scene, joint_frames(robot, ends))
        some = least[(least > 0) & np.isfinite(least)]
        clearance = float(rng.uniform(0.9, 3) * some.min()) if some.size else clearance
    links = sorted({part.name for part in robot.shapes})
    some = [PairClearance(float(rng.choice([0.0, 0.02, 0.2])), link=link) for link in links if rng.random() < 0.3]
    return clearance, tuple(some) if rng.random() < 0.5 else ()


def planned(folder: Path, seed: int, number: int) -> Trial:
    """Plan one of MotionBenchMaker's problems, another one each time."""
    fixed = {f"panda_finger_joint{i}": 0.065 for i in (1, 2)}
    robot = load_robot(folder / "panda_spherized.urdf", srdf=folder / "panda.srdf", group="panda_arm", fixed=fixed)
    scenes = sorted(folder.glob("*/scene*.yaml"))
    scene = scenes[number % len(scenes)]
    problem = load_moveit(robot, scene, scene.with_name(scene.name.replace("scene", "request")))
    found = plan(problem, PlannerSettings(evaluations=2000), rng=seed + number)
    assert found.trajectory is not None, f"{scene}: {found.message}"
    return Trial(robot, problem.scene, found.trajectory)


def drawn_robot(rng: np.random.Generator, most_joints: int = 9) -> Robot:
    count = int(rng.integers(1, most_joints + 1))
    joints: list[Joint] = []
    dofs = 0
    for i in range(count):
        parent = i - 1 if rng.random() < 0.8 else int(rng.integers(-1, i)) if i else -1
        follows = dofs > 0 and rng.random() < 0.15
        joints.append(
            Joint(
                name=f"joint_{i}",
                kind="prismatic" if rng.random() < 0.25 else "revolute",
                parent=parent,
                T_parent_joint=pose(0.4 * rng.normal(size=3), rng.normal(size=4)),
                dof=int(rng.integers(0, dofs)) if follows else dofs,
                multiplier=float(rng.choice([-1.0, 0.5, 2.0])) if follows else 1.0,
                offset=0.3 if follows else 0.0,
            )
        )
        dofs += not follows
    kind = str(rng.choice(["balls", "capsules", "every"]))
    parts: list[LinkShape] = []
    for _ in range(rng.integers(1, count + 5)):
        joint = int(rng.integers(-1, count))
        parts.append(LinkShape(name=f"link_{joint}", joint=joint, shape=drawn_part(rng, kind)))
    links = sorted({part.name for part in parts})
    pairs = [(one, other) for i, one in enumerate(links) for other in links[i + 1 :] if rng.random() < 0.4]
    names = tuple(f"dof_{i}" for i in range(dofs))
    turns = [next(joint.kind for joint in joints if joint.dof == i) for i in range(dofs)]
    mixed = any(joint.kind != turns[joint.dof] for joint in joints)
    names = tuple(next(joint.name for joint in joints if joint.dof == i) for i in range(dofs)) if mixed else names
    return Robot(
        name="drawn",
        joints=tuple(joints),
        shapes=tuple(parts),
        frames=(Frame(name="tip", joint=count - 1, T_joint_frame=np.eye(4)),),
        tip="tip",
        dof_names=names,
        lower=np.full(dofs, -np.inf),
        upper=np.full(dofs, np.inf),
        velocity=np.ones(dofs),
        acceleration=np.ones(dofs),
        self_pairs=tuple(pairs),
    )


def drawn_part(rng: np.random.Generator, kind: str) -> ConvexShape:
    """Return a shape of a link: a ball, a capsule or a segment, or one of every kind."""
    a = 0.3 * rng.normal(size=3)
    if kind == "every" and rng.random() < 0.8:
        return drawn_solid(rng, pose(a, rng.normal(size=4)), float(rng.choice([0.001, 0.05, 0.2])))
    b = a if kind == "balls" or rng.random() < 0.3 else a + 0.3 * rng.normal(size=3)
    radius = float(rng.choice([0, 0.01, 0.1]))
    return LinkCapsule(name="drawn", joint=-1, a=a, b=b, radius=radius).as_shape.shape


def drawn_solid(rng: np.random.Generator, placed: np.ndarray, size: float) -> Box | Cylinder | Polytope:
    """Return a box, a cylinder or a polytope: some are thin, flat or rounded."""
    rounding = float(rng.choice([0.0, 0.0, 1e-3, 0.05]))
    kind = int(rng.integers(3))
    if kind == 0:
        return Box(rng.uniform(0.001, 0.6, 3), placed, rounding=rounding)
    if kind == 1:
        return Cylinder(size, float(rng.uniform(0.001, 1)), placed, rounding=rounding)
    points = rng.normal(size=(rng.choice([1, 2, 3, 4, 8, 20, 60]), 3)) * rng.choice([0.0, 0.01, 0.2], 3)
    return Polytope(points @ placed[:3, :3].T + placed[:3, 3], rounding=rounding)


def drawn_obstacle(rng: np.random.Generator) -> Obstacle:
    size = float(rng.choice([0.001, 0.05, 0.3]))
    at, placed = rng.normal(size=3), pose(rng.normal(size=3), rng.normal(size=4))
    kind = int(rng.integers(7))
    if kind == 0:
        return Sphere(at, size)
    if kind == 1:
        return Capsule(at, rng.normal(size=3), size)
    if kind <= 3:
        return drawn_solid(rng, placed, size)
    if kind == 4:
        normal = rng.normal(size=3)
        return HalfSpace(normal, -rng.uniform(0.5, 2) * normal / np.linalg.norm(normal))
    count = int(rng.integers(1, 150))
    if kind == 5:
        pieces = [at + 0.1 * rng.normal(size=3) + 0.05 * rng.normal(size=(8, 3)) for _ in range(1 + count // 10)]
        return PolytopeSet([Polytope(piece) for piece in pieces])
    return SphereSet(at + 0.1 * rng.normal(size=(count, 3)), rng.uniform(0.01, 0.05, count))


def drawn_trajectory(rng: np.random.Generator, robot: Robot) -> AnyTrajectory:
    size, kind = float(rng.choice([0.1, 0.5, 2.0])), int(rng.integers(3))
    if kind == 0:
        return Trajectory(robot, Motion(size * rng.normal(size=(rng.integers(2, 7), robot.dof))))
    count = int(rng.integers(2, 60))
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 1, count - 1))])
    q = np.cumsum(0.3 * size * rng.normal(size=(count, robot.dof)), axis=0)
    return RecordedTrajectory(robot, PiecewisePath.from_linear(t, q) if kind == 1 else PiecewisePath.from_cubic(t, q))


def complaint(trial: Trial, certificate: Certificate, instants: int, rng: np.random.Generator) -> str | None:
    """Say what is wrong with a certificate, if anything is."""
    robot, scene, trajectory = trial.robot, trial.scene, trial.trajectory
    near = certificate.closest
    if near is None:
        return None if certificate.holds and not (scene.obstacles or robot.self_pairs) else "nothing was measured"
    begin, end = trajectory.curve.domain
    around = np.clip(near.u + 1e-3 * (end - begin) * rng.normal(size=20), begin, end)
    u = np.concatenate([[near.u], around, rng.uniform(begin, end, instants)])
    frames = joint_frames(robot, trajectory.curve.sample(u if certificate.holds else u[:1]))
    if certificate.status == "fails":
        least = least_distances(robot, scene, frames)[0]
        if least > min(near.required + TOLERANCE, near.clearance + DEPTH):
            return f"it fails at u = {near.u:.17g}, where the clearance is {least:.9g} m"
    if not certificate.holds:
        return None
    if (certificate.clearance or 0) <= 0:
        return "it holds without clearance"
    for pair, measured in distances(robot, scene, frames):
        lacking = stated(certificate, pair, np.asarray(trajectory.time_at(u))) - measured
        if lacking.max() > TOLERANCE:
            i = int(np.argmax(lacking))
            return f"{pair}: proven {measured[i] + lacking[i]:.9g} m, but {measured[i]:.9g} m at u = {u[i]:.17g}"
    if trial.clearance == 0 and near.clearance > 2 * (certificate.clearance or 0) + TOLERANCE:
        return f"measured {near.clearance:.9g} m, but only {certificate.clearance:.9g} m proven"
    return None


def look(case: Case) -> Outcome:
    """Draw or plan a trajectory, certify it, and measure it."""
    data, instants = case.options["data"], case.options["instants"]
    trial = drawn(case.seed, case.number) if data is None else planned(data, case.seed, case.number)
    certificate = certify(trial, trial.trajectory, limits=())
    found = complaint(trial, certificate, instants, np.random.default_rng(case.number))
    if case.only:
        print(certificate.message)
    return Outcome(
        became=[certificate.status, *(["holds, with near pairs"] if certificate.holds and certificate.near_pairs else [])],
        complaints=[] if found is None else [found],
        measured={"a proof [s]": certificate.seconds},
    )


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--instants", type=int, default=200, help="random instants of each trajectory that is proven")
    parser.add_argument("--data", type=Path, help="folder of MotionBenchMaker's problems, to be planned")


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="trajectories", add_options=add_options))
