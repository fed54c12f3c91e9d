"""What each part of the search for motions is worth: trees, shortcuts, refinement, the swarm, and the numbers they go by.

    python benchmarks/planners/search_parts.py --data DIR [--data DIR ...]
    python benchmarks/planners/search_parts.py --data DIR --seeds 2 --variants all "no swarm"

DIR holds MotionBenchMaker's problems for a robot, as `spacearm bench mbm` takes them. Each variant runs on every problem,
several seeds, one thread. The variants take turns problem by problem, so that all see the same machine. "first" is the time
until the search holds a motion free; "packs" are the 16 configurations looked at together until then, which no other load on
the machine disturbs. Lengths are means over the problems solved by then, whose number is behind them.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from cases import Case, load_collection

from spacearm.core.native import native
from spacearm.planner.kernel_model import kernel_model
from spacearm.planner.planner_settings import SWARM
from spacearm.swarm.swarm_settings import kernel_settings

MARKS = (1e-3, 10e-3, 50e-3)  # [s] of searching

VARIANTS: dict[str, dict[str, Any]] = {
    "all": {},
    "no trees": {"patience": 0},
    "no trees, 64 particles": {"patience": 0, "swarm": {"particles": 64}},
    "no swarm": {"swarm_turn": 0},
    "no refinement": {"refine_stall": 1},
    "no shortcuts of paths": {"shortcuts": 1},
    "1 control point": {"interior": [1]},
    "32 particles": {"swarm": {"particles": 32}},
    "the paper's PSO, w 0.5, c 2": {"swarm": {"inertia": 0.5, "cognitive": 2.0, "social": 2.0}},
    "no ring": {"swarm": {"neighbours": None}},
    "edges of 0.7 rad": {"tree_step": 0.7},
    "edges of 1.4 rad": {"tree_step": 1.4},
    "samples near the line alone": {"tree_near_line": 1.0},
    "samples anywhere": {"tree_near_line": 0.0},
    "a quarter of the deviation": {"tree_spread": 0.5},
}


def main() -> None:
    """Run the variants and print a table for each folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, action="append", help="the problems of a robot")
    parser.add_argument("--problems", type=int, help="of each family; all unless given")
    parser.add_argument("--half", choices=["odd", "even", "all"], default="all", help="problems with such numbers")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--variants", nargs="*", default=list(VARIANTS))
    options = parser.parse_args()
    for folder in options.data:
        collection = load_collection(folder, most=options.problems, half=options.half)
        found: dict[str, list[tuple[float, float, list[float]]]] = {name: [] for name in options.variants}
        for seed in range(options.seeds):
            for case in collection.cases:
                for name in options.variants:
                    found[name].append(_run(case, seed, dict(VARIANTS[name])))
        _report(collection.robot, collection.cases, options.seeds, found)


def _report(robot: str, cases: list[Case], seeds: int, found: dict[str, list[tuple[float, float, list[float]]]]) -> None:
    straight = float(np.mean([case.straight for case in cases]))
    print(f"{robot}: {len(cases)} problems, {seeds} seeds; straight line {straight:.3f}\n")
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
    print()


def _run(case: Case, seed: int, variant: dict[str, Any]) -> tuple[float, float, list[float]]:
    """Return seconds and packs until the first motion, and the length at each mark."""
    problem, robot = case.problem, case.problem.robot
    swarm = replace(SWARM, **variant.pop("swarm", {}))
    model = kernel_model(robot, problem.scene)
    settings = native.SearchSettings()
    settings.swarm = kernel_settings(swarm)
    for name, value in variant.items():
        setattr(settings, name, value)
    asked = native.MotionProblem(
        start=np.array(problem.start),
        goals=np.atleast_2d(case.goal).copy(),
        lower=np.array(robot.lower),
        upper=np.array(robot.upper),
        velocity=np.array(robot.velocity),
        acceleration=np.array(robot.acceleration),
        margin=case.margin,
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
