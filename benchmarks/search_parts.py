"""What each part of the search for motions is worth, on any robots: trees, refinement, the swarm, and the numbers they go by.

    python benchmarks/search_parts.py --data DIR [--data DIR ...]
    python benchmarks/search_parts.py --data DIR --seeds 2 --variants all "no swarm"

DIR holds MotionBenchMaker's problems for a robot, as `spacearm bench mbm` takes them. Each variant runs on every problem, one
thread; the variants take turns problem by problem, so that all see the same machine. "First" is the time to the first motion;
"packs" are the configurations looked at until then, by sixteen, which do not depend on the machine. Lengths are beside those of
the search as it is, after 10 ms; later motions count with their first.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent / "planners"))

from cases import Case, load_collection
from page import put_into

from spacearm.core.native import native
from spacearm.planner.kernel_model import kernel_model
from spacearm.planner.planner_settings import SWARM
from spacearm.study.reference_core import load_now, machine_note
from spacearm.swarm.swarm_settings import kernel_settings

LIMIT, BUDGET = 1.0, 0.01  # [s] for the first motion, and until its length is told

VARIANTS: dict[str, dict[str, Any]] = {
    "all": {},
    "no trees": {"patience": 0},
    "no trees, 64 particles": {"patience": 0, "swarm": {"particles": 64}},
    "no swarm": {"swarm_every": 0, "swarm_share": 0.0},
    "no refinement": {"refine_stall": 1},
    "shorter paths are not sought": {"shortcuts": 1},
    "1 control point": {"interior": [1]},
    "the paper's PSO, w 0.5, c 2": {"swarm": {"inertia": 0.5, "cognitive": 2.0, "social": 2.0}},
    "no ring": {"swarm": {"neighbours": None}},
    "edges half as long": {"tree_step": 0.5},
    "edges twice as long": {"tree_step": 2.0},
    "half the samples near the line": {"tree_near_line": 0.5},
    "samples anywhere": {"tree_near_line": 0.0},
    "half as widely around it": {"tree_spread": 0.5},
    "margin 5 mm": {"margin": 0.005},
}
"""Settings that differ, times the search's own where a length is given."""


@dataclass
class Found:
    """One run: seconds and packs to the first motion, infinite where there is none, and the length after `BUDGET`."""

    first: float
    packs: float
    length: float


def main() -> None:
    """Run the variants and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, action="append", required=True, help="the problems of a robot")
    parser.add_argument("--problems", type=int, default=2, help="of each family")
    parser.add_argument("--half", choices=("odd", "even", "all"), default="even", help="of the problems, by their numbers")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--variants", nargs="*", default=list(VARIANTS))
    parser.add_argument("--page", type=Path, help="put the table into this page")
    args = parser.parse_args()
    begun, loads = time.perf_counter(), [load_now()]
    names = list(dict.fromkeys(["all", *args.variants]))
    found: dict[str, dict[str, list[Found]]] = {}
    for folder in args.data:
        collection = load_collection(folder, most=args.problems, half=args.half)
        own = found[collection.robot] = {name: [] for name in names}
        for case in collection.cases:
            print(f"{collection.robot} {case.name}   ", end="\r", file=sys.stderr, flush=True)
            for seed in range(args.seeds):
                for name in names:
                    own[name].append(_run(case, seed, dict(VARIANTS[name])))
        loads.append(load_now())
    lines = report(found, args, loads, time.perf_counter() - begun)
    print("\n".join(lines))
    if args.page:
        put_into(args.page, "search parts", lines)


def report(
    found: dict[str, dict[str, list[Found]]], args: argparse.Namespace, loads: Sequence[float], seconds: float
) -> list[str]:
    """Return the table."""
    counts = ", ".join(f"{len(own['all'])} of the {robot}" for robot, own in found.items())
    lines = [
        f"Runs: {counts}. {seconds:.0f} s in all, load {min(loads):.1f} to {max(loads):.1f}. {machine_note()}.",
        "",
        "| search | " + " | ".join(f"{robot}: first [ms], median / p95" for robot in found) + " | packs | not found | length |",
        "|---" * (len(found) + 4) + "|",
    ]
    for name in next(iter(found.values())):
        cells = [_quantiles([1e3 * run.first for run in own[name]], 2) for own in found.values()]
        runs = [run for own in found.values() for run in own[name]]
        usual = [run for own in found.values() for run in own["all"]]
        both = [a.length / b.length for a, b in zip(runs, usual, strict=True) if np.isfinite([a.length, b.length]).all()]
        cells += [_quantiles([run.packs for run in runs], 0), str(sum(not np.isfinite(run.first) for run in runs))]
        lines.append("| " + " | ".join([name, *cells, f"{np.mean(both):.3f}" if both else "-"]) + " |")
    return lines


def _quantiles(values: Sequence[float], digits: int) -> str:
    return " / ".join(f"{float(np.percentile(values, percent, method='higher')):.{digits}f}" for percent in (50, 95))


def _run(case: Case, seed: int, variant: dict[str, Any]) -> Found:
    """Search with settings that differ."""
    problem, robot = case.problem, case.problem.robot
    margin = min(variant.pop("margin", case.margin), case.margin if case.margin < 0.002 else np.inf)
    swarm = replace(SWARM, **variant.pop("swarm", {}))
    model = kernel_model(robot, problem.scene)
    settings = native.SearchSettings()
    settings.swarm = kernel_settings(swarm)
    for name, value in variant.items():
        scaled = name in ("tree_step", "tree_spread")
        setattr(settings, name, getattr(settings, name) * value if scaled else value)
    asked = native.MotionProblem(
        start=np.array(problem.start),
        goals=case.goal[None].copy(),
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

    def search(seconds: float, *, until_first: bool) -> native.MotionSearch32:
        out = native.MotionSearch32(scene=model.model32, problem=asked, settings=settings, seed=seed, island=0)
        out.run(evaluations=0, seconds=seconds, until_first=until_first, stall=0, progress=None)
        return out

    first = search(LIMIT, until_first=True)
    if not first.history:
        return Found(np.inf, np.inf, np.inf)
    whole = [entry.fitness for entry in search(BUDGET, until_first=False).history if entry.seconds <= BUDGET]
    length = min(whole, default=first.history[0].fitness)
    return Found(first.history[0].seconds, first.configurations / native.lanes32, length)


if __name__ == "__main__":
    main()
