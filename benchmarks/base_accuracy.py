"""How right the search's base motion is: its final attitude on even grids of nodes, against an adaptive integration.

    python benchmarks/base_accuracy.py
    python benchmarks/base_accuracy.py --motions 200 --robots servicer7 ets7

For each robot, random motions through three interior control points; errors of the attitude at the end [rad], median and
greatest, in the search's float32 and in float64. The search meets what is asked of the end on 64 nodes, and the float64 that
settles a motion before its proof takes 256 (`kernel/motion/floating_base.hpp`); the proof integrates by itself.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.dynamics import BaseMotion
from spacearm.motion import Motion
from spacearm.planner import PlannerSettings, Problem
from spacearm.planner.motion_search import Islands
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.robot import Robot, load_robot

Array = NDArray[np.float64]

INTERIOR = 3
NODES = (32, 64, 128, 256)
WIDEST = 3.0  # [rad] for joints that turn further
SCATTER = 0.7  # [rad] of the control points about the straight motion
PRECISIONS = (32, 64)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", type=int, default=60, help="of each robot")
    parser.add_argument("--robots", nargs="+", default=["servicer7", "srs7"], help="built-in ones, or files")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    print("| robot | base turned, median / greatest | numbers | " + " | ".join(f"{count} nodes" for count in NODES) + " |")
    print("|---" * (3 + len(NODES)) + "|")
    for name in given.robots:
        turned, errors = measure(load_robot(name), given.motions, np.random.default_rng(given.seed))
        for precision in PRECISIONS:
            cells = [f"{np.median(errors[precision, count]):.1e} / {max(errors[precision, count]):.1e}" for count in NODES]
            degrees = np.degrees([np.median(turned), max(turned)])
            print(f"| {name} | {degrees[0]:.1f}° / {degrees[1]:.1f}° | float{precision} | " + " | ".join(cells) + " |")


def measure(robot: Robot, motions: int, rng: np.random.Generator) -> tuple[list[float], dict[tuple[int, int], list[float]]]:
    """Return by what angle the base is turned in the end, and the errors by precision and nodes, each a motion's [rad]."""
    turned: list[float] = []
    errors: dict[tuple[int, int], list[float]] = {(precision, count): [] for precision in PRECISIONS for count in NODES}
    lower, upper = np.maximum(robot.lower, -WIDEST), np.minimum(robot.upper, WIDEST)
    start = np.clip(np.zeros(robot.dof), lower, upper)
    for _ in range(motions):
        goal = rng.uniform(lower, upper)
        straight = start + (goal - start) * np.linspace(0, 1, INTERIOR + 2)[1:-1, None]
        points = np.clip(straight + rng.normal(size=straight.shape) * SCATTER, lower, upper)
        right = BaseMotion(robot, Motion([start, *points, goal])).pose(1.0)[1]
        turned.append(angle(right, np.array([1.0, 0.0, 0.0, 0.0])))
        problem = Problem(robot, [], start=start, goal=goal, base="floating")
        islands = Islands(problem, goal[None], PlannerSettings(), seed=0, searched=SearchedClearance(asked=0.0))
        for precision, search in zip(PRECISIONS, kernels(islands), strict=True):
            row = points.reshape(1, -1).astype(f"float{precision}")
            for count in NODES:
                found = search.base_along(row, INTERIOR, 0, count, True)[0, 0, 3:]
                errors[precision, count].append(angle(found.astype(np.float64), right))
    return turned, errors


def kernels(islands: Islands) -> tuple[Any, Any]:
    """Return the native search, and the one in float64 that settles motions for their proof."""
    return islands.search32(0, 0), islands.search64()


def angle(one: Array, other: Array) -> float:
    """Return the angle between two attitudes (4,) [rad]; exact for small ones, where the cosine is not."""
    near = min(np.linalg.norm(one - other), np.linalg.norm(one + other))
    return float(4 * np.arcsin(min(1.0, near / 2)))


if __name__ == "__main__":
    main()
