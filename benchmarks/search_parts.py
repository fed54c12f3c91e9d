"""What each part of the search for motions is worth: probing trees, refinement, the swarm, and the numbers they go by.

Each variant runs on every problem of a folder of MotionBenchMaker problems (scene*.yaml and request*.yaml, with the robot
beside them), several seeds, one thread. The variants take turns problem by problem, so that all see the same machine.

    python benchmarks/search_parts.py --data DIR
    python benchmarks/search_parts.py --data DIR --seeds 2 --variants all "no swarm"

"first" is the time until the search holds a motion free; "packs" are the 16 configurations looked at together until then,
which no other load on the machine disturbs. Lengths are means over the problems solved by then, whose number is behind
them. The robot's name, group and files are those of the Panda.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.core.native import native
from spacearm.files import load_moveit
from spacearm.planner import Problem
from spacearm.planner.kernel_model import kernel_model
from spacearm.planner.planner_settings import SWARM
from spacearm.planner.searched_clearance import SEARCH_ROOM
from spacearm.robot import load_robot
from spacearm.swarm.swarm_settings import kernel_settings

MARKS = (0.7e-3, 7e-3, 35e-3)  # [s] of searching

VARIANTS: dict[str, dict[str, Any]] = {
    "all": {},
    "no trees": {"patience": 0},
    "no trees, 64 particles": {"patience": 0, "swarm": {"particles": 64}},
    "no swarm": {"swarm_turn": 0},
    "no refinement": {"refine_stall": 1},
    "swarm every turn but one": {"swarm_turn": 2},
    "refinement gives up later": {"refine_stall": 400},
    "1 control point": {"interior": [1]},
    "2": {"interior": [2]},
    "3": {"interior": [3]},
    "4": {"interior": [4]},
    "32 particles": {"swarm": {"particles": 32}},
    "the paper's PSO, w 0.5, c 2": {"swarm": {"inertia": 0.5, "cognitive": 2.0, "social": 2.0}},
    "no ring": {"swarm": {"neighbours": None}},
    "edges of 0.8 rad": {"tree_step": 0.8},
    "edges of 1.5 rad": {"tree_step": 1.5},
    "half the samples near the line": {"tree_near_line": 0.5},
    "samples anywhere": {"tree_near_line": 0.0},
    "margin 5 mm": {"margin": 0.005},
    "margin 10 mm": {"margin": 0.01},
}


def main() -> None:
    """Run the variants and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--variants", nargs="*", default=list(VARIANTS))
    options = parser.parse_args()
    problems = _problems(options.data)
    found: dict[str, list[tuple[float, float, list[float]]]] = {name: [] for name in options.variants}
    for seed in range(options.seeds):
        for problem in problems:
            for name in options.variants:
                found[name].append(_run(problem, seed, dict(VARIANTS[name])))
    straight = float(np.mean([np.linalg.norm(p.goal.q - p.start) for p in problems]))  # type: ignore[union-attr]
    print(f"{len(problems)} problems, {options.seeds} seeds; straight line {straight:.3f}\n")
    print("| search | first, median / p95 [ms] | packs, median / p95 | " + " | ".join(f"{m * 1e3:g} ms" for m in MARKS) + " |")
    print("|---|---|---|" + "---|" * len(MARKS))
    for name, rows in found.items():
        first, packs = np.array([r[0] for r in rows]) * 1e3, np.array([r[1] for r in rows])
        lengths = [[r[2][k] for r in rows if np.isfinite(r[2][k])] for k in range(len(MARKS))]
        shown = " | ".join(f"{np.mean(v):.3f} ({len(v)})" if v else "-" for v in lengths)
        print(
            f"| {name} | {np.median(first):.3f} / {np.percentile(first, 95):.2f} "
            f"| {np.median(packs):.0f} / {np.percentile(packs, 95):.0f} | {shown} |"
        )


def _problems(folder: Path) -> list[Problem]:
    robot = load_robot(folder / "panda_spherized.urdf", srdf=folder / "panda.srdf", group="panda_arm")
    scenes = sorted(folder.glob("*/scene*.yaml"))
    return [load_moveit(robot, scene, scene.with_name(scene.name.replace("scene", "request"))) for scene in scenes]


def _run(problem: Problem, seed: int, variant: dict[str, Any]) -> tuple[float, float, list[float]]:
    """Return seconds and packs until the first motion, and the length at each mark."""
    robot, margin = problem.robot, variant.pop("margin", SEARCH_ROOM)
    swarm = replace(SWARM, **variant.pop("swarm", {}))
    model = kernel_model(robot, problem.scene)
    settings = native.SearchSettings()
    settings.swarm = kernel_settings(swarm)
    for name, value in variant.items():
        setattr(settings, name, value)
    asked = native.MotionProblem(
        start=np.array(problem.start),
        goals=np.atleast_2d(problem.goal.q).copy(),  # type: ignore[union-attr]
        lower=np.array(robot.lower),
        upper=np.array(robot.upper),
        velocity=np.array(robot.velocity),
        acceleration=np.array(robot.acceleration),
        margin=margin,
        preferred_clearance=0.05,
        tip=model.tip,
        centers=np.zeros(0, dtype=np.int32),
        weights=native.MotionWeights(),
        base=native.FixedBase(),
    )

    def search() -> native.MotionSearch32:
        return native.MotionSearch32(scene=model.model32, problem=asked, settings=settings, seed=seed, island=0)

    first = search()
    first.run(evaluations=0, seconds=MARKS[-1], until_first=True, stall=0, progress=None)
    packs = first.configurations / native.lanes32
    whole = search()
    whole.run(evaluations=0, seconds=MARKS[-1], until_first=False, stall=0, progress=None)
    history = whole.history
    lengths = [min((entry.fitness for entry in history if entry.seconds <= mark), default=np.inf) for mark in MARKS]
    return history[0].seconds if history else MARKS[-1], packs, lengths


if __name__ == "__main__":
    main()
