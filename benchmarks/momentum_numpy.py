"""The floating base's motion by the kernel and in plain NumPy, side by side.

Kinematics, momentum blocks (spacearm.dynamics, ORACLES' momentum form), the base's rate and the product of its turns, for all
particles and samples at once: what a search needs to know of where the base is. One sample is one evaluation of the blocks.

    python benchmarks/momentum_numpy.py                    # nanoseconds a sample and particle
    python benchmarks/momentum_numpy.py --json momentum_numpy.json
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rounds import machine, print_table, take_turns
from spacearm.core.native import kernel_info
from spacearm.core.rotations import exponential, running_products
from spacearm.dynamics.momentum import free_rate, lumped_masses, moments_of_frames
from spacearm.motion import basis
from spacearm.planner import PlannerSettings, Problem
from spacearm.planner.motion_search import Islands
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.robot import Robot, joint_frames, load_robot

ROBOT, PARTICLES, SAMPLES, INTERIOR = "servicer7", 96, 64, 2
AT_ONCE = 1024  # configurations whose numbers stay in the cache together

Frames = Callable[[Robot, np.ndarray], np.ndarray]


def frames_by_matrices(robot: Robot, q: np.ndarray) -> np.ndarray:
    """T_base_joint (m, j, 4, 4) of q (m, n): matrices joint by joint, `@` over the batch."""
    out = np.empty((len(q), len(robot.joints), 4, 4))
    for i, joint in enumerate(robot.joints):
        value = joint.multiplier * q[:, joint.dof] + joint.offset
        moved = np.zeros((len(q), 4, 4))
        moved[:, range(4), range(4)] = 1.0
        if joint.kind == "revolute":
            moved[:, 0, 0] = moved[:, 1, 1] = np.cos(value)
            moved[:, 1, 0] = np.sin(value)
            moved[:, 0, 1] = -moved[:, 1, 0]
        else:
            moved[:, 2, 3] = value
        placed = joint.T_parent_joint @ moved
        out[:, i] = placed if joint.parent < 0 else out[:, joint.parent] @ placed
    return out


def base_attitudes(robot: Robot, points: np.ndarray, samples: int, *, frames: Frames = frames_by_matrices) -> np.ndarray:
    """Attitudes wxyz (samples, m, 4) of a base without momentum, after each of equal steps along motions: midpoint rule.

    Args:
        robot: with masses.
        points: (m, K + 2, n) control points of motions.
        samples: steps.
        frames: the kinematics.
    """
    s = (np.arange(samples) + 0.5) / samples
    q, dq = (np.einsum("sk,mkn->smn", basis(s, points.shape[1] - 2, derivative=k), points) for k in (0, 1))
    masses = lumped_masses(robot)
    rows, rates = q.reshape(-1, robot.dof), dq.reshape(-1, robot.dof)
    turns = np.empty((len(rows), 3))
    for i in range(0, len(rows), AT_ONCE):
        part = slice(i, i + AT_ONCE)
        turns[part] = free_rate(moments_of_frames(masses, frames(robot, rows[part])), rates[part])
    return running_products(exponential(turns.reshape(samples, len(points), 3) / samples))


def kernel_call(robot: Robot, points: np.ndarray, samples: int, precision: int) -> Callable[[], object]:
    """The same by the kernel: the poses at the ends, all nodes gone through."""
    problem = Problem(robot, [], start=points[0, 0], goal=points[0, -1], base="floating")
    islands = Islands(problem, points[:1, -1].copy(), PlannerSettings(), seed=0, searched=SearchedClearance(asked=0.0))
    search = islands.search32(0, 0) if precision == 32 else islands.search64()
    rows = np.ascontiguousarray(points[:, 1:-1].reshape(len(points), -1), dtype=np.float32 if precision == 32 else np.float64)
    return lambda: search.base_along(rows, points.shape[1] - 2, 0, samples, True)


def drawn_points(robot: Robot, particles: int, interior: int) -> np.ndarray:
    """Control points (m, K + 2, n) within the limits, or within half a turn of 0."""
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    return np.random.default_rng(0).uniform(lower, upper, (particles, interior + 2, robot.dof))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default=ROBOT, help="built-in name or file")
    parser.add_argument("--particles", type=int, default=PARTICLES)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", type=Path, help="write the figures here too")
    given = parser.parse_args()
    robot = load_robot(given.robot)
    masses = lumped_masses(robot)
    points = drawn_points(robot, given.particles, INTERIOR)
    q = points[:, 0].repeat(given.samples, axis=0)[:AT_ONCE]
    placed = joint_frames(robot, q)
    each = given.particles * given.samples
    contestants: dict[str, tuple[int, Callable[[], object]]] = {
        "base motion, kernel float32": (each, kernel_call(robot, points, given.samples, 32)),
        "base motion, kernel float64": (each, kernel_call(robot, points, given.samples, 64)),
        "base motion, NumPy": (each, lambda: base_attitudes(robot, points, given.samples)),
        "base motion, the kernel's kinematics": (
            each,
            lambda: base_attitudes(robot, points, given.samples, frames=joint_frames),
        ),
        "kinematics, NumPy": (len(q), lambda: frames_by_matrices(robot, q)),
        "blocks, NumPy": (len(q), lambda: moments_of_frames(masses, placed)),
    }
    timed = take_turns({name: call for name, (_, call) in contestants.items()}, rounds=given.rounds)
    rows = {
        name: {"least_ns": timed.least(name) / count * 1e9, "median_ns": timed.median(name) / count * 1e9}
        for name, (count, _) in contestants.items()
    }
    fastest = next(iter(rows.values()))["least_ns"]
    kernel = f"kernel {kernel_info().level}"
    print(machine(kernel))
    print_table(
        f"{robot.name}: {given.particles} particles, {given.samples} samples",
        "what | ns each, least | median | times the kernel",
        [
            [name, f"{row['least_ns']:.0f}", f"{row['median_ns']:.0f}", f"{row['least_ns'] / fastest:.1f}"]
            for name, row in rows.items()
        ],
    )
    if given.json:
        given.json.write_text(json.dumps({"machine": machine(kernel), "robot": robot.name, "rows": rows}, indent=2) + "\n")


if __name__ == "__main__":
    main()
