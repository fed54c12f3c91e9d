"""What each part of the swarm's settings is worth, and whether they are tuned to one instance only.

Every named setting runs on the seed's problem (goal mode, A_R 0.10) within the same 30,000 evaluations: 500 runs, and
the 20 runs of seed 0 that the paper's Table 3 would show. Then the same settings run where nothing was tuned: on the
other radii, in the literal mode, and on 20 drawn scenes, each beside its own best known value.

    python benchmarks/ablation.py
    python benchmarks/ablation.py --runs 100 --scenes 5       # a minute
    python benchmarks/ablation.py --settings ring-rising ipso-e --json ablation.json

"Within 1 %" is the share of all runs that end feasible and at most 1 % above the best known value; worst and mean are
over the feasible runs. The best known value of a drawn scene is the least of what gradient descents (best_known.py) and
20 long runs (300,000 evaluations) find. Times are medians over batches of runs on one thread.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from best_known import find_best
from instances import ARM, MODES, RADII, Instance, drawn_instances, paper_instance
from spacearm.study.paper_problem import BEST_KNOWN, NEAR
from spacearm.swarm import NAMED_SETTINGS, SwarmSettings, named_settings, run_trials

MAIN = ("goal", 0.10)
SEED = 7  # of the many runs; the 20 runs of the paper's table use 0
BATCHES = 10
LONG = replace(named_settings("ring-rising"), particles=300, iterations=1000)


@dataclass(frozen=True, kw_only=True)
class Row:
    """A setting on an instance.

    Attributes:
        near: share of the runs within 1 % of the best known value.
        worst, mean, best: over the feasible runs.
        feasible: their share.
        milliseconds: a run, median over batches.
    """

    near: float
    worst: float
    mean: float
    best: float
    feasible: float
    milliseconds: float


def measure(
    settings: SwarmSettings, instance: Instance, best_known: float, *, runs: int, seed: int = SEED, threads: int = 1
) -> Row:
    """Run a setting on an instance many times."""
    batches = [len(part) for part in np.array_split(np.arange(runs), min(BATCHES, runs))]
    values, seconds, first = [], [], 0
    for trials in batches:
        begun = time.perf_counter()
        results = run_trials(
            instance.objective,
            ARM.lower,
            ARM.upper,
            settings,
            seed=seed,
            first_trial=first,
            trials=trials,
            threads=threads,
        )
        seconds.append((time.perf_counter() - begun) / trials)
        values += [run.fitness if run.success else np.inf for run in results]
        first += trials
    f = np.array(values)
    fine = f[np.isfinite(f)] if np.isfinite(f).any() else np.array([np.nan])
    return Row(
        near=float(np.mean(f <= best_known * (1 + NEAR))),
        worst=float(fine.max()),
        mean=float(fine.mean()),
        best=float(fine.min()),
        feasible=float(np.mean(np.isfinite(f))),
        milliseconds=float(np.median(seconds)) * 1e3,
    )


def known_value(instance: Instance, *, starts: int = 100) -> float:
    """The best known value of a drawn scene: the least that descents and long runs find."""
    long = run_trials(instance.objective, ARM.lower, ARM.upper, LONG, seed=SEED, trials=20, threads=1)
    values = [run.fitness for run in long if run.success]
    with contextlib.suppress(RuntimeError):  # no descent ended feasible
        values.append(find_best(instance, starts=starts).fitness)
    return min(values)


def chosen_settings(names: list[str]) -> dict[str, SwarmSettings]:
    return {name: named_settings(name) for name in names}


def print_main(settings: dict[str, SwarmSettings], runs: int) -> dict[str, dict[str, Row]]:
    """The ablation's table."""
    instance, known = paper_instance(*MAIN), BEST_KNOWN[MAIN]
    print(f"\n## Goal mode, A_R 0.10: best known {known:.6f}, 30,000 evaluations a run\n")
    print(
        f"| settings | within 1 %, {runs} runs | worst | mean | feasible | ms a run | within 1 %, 20 runs of seed 0 | worst |"
    )
    print("|---|---|---|---|---|---|---|---|")
    out = {}
    for name, setting in settings.items():
        many = measure(setting, instance, known, runs=runs)
        few = measure(setting, instance, known, runs=20, seed=0)
        print(
            f"| {name} | {round(many.near * runs)} of {runs} | {many.worst:.4f} | {many.mean:.4f} | {many.feasible:.0%} "
            f"| {many.milliseconds:.2f} | {round(few.near * 20)} of 20 | {few.worst:.4f} |",
            flush=True,
        )
        out[name] = {"many": many, "twenty": few}
    return out


def print_other(settings: dict[str, SwarmSettings], runs: int) -> dict[str, dict[str, Row]]:
    """The paper's other radii and mode."""
    cases = [(mode, radius) for mode in MODES for radius in RADII if (mode, radius) != MAIN]
    print(f"\n## The other radii and the literal mode: share of {runs} runs within 1 % (worst excess over best known)\n")
    print("| settings | " + " | ".join(f"{mode} {radius:.2f}" for mode, radius in cases) + " |")
    print("|---" * (len(cases) + 1) + "|")
    out: dict[str, dict[str, Row]] = {}
    for name, setting in settings.items():
        rows = {case: measure(setting, paper_instance(*case), BEST_KNOWN[case], runs=runs) for case in cases}
        cells = [f"{row.near:.1%} ({row.worst / BEST_KNOWN[case] - 1:.1%})" for case, row in rows.items()]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
        out[name] = {f"{mode} {radius:.2f}": row for (mode, radius), row in rows.items()}
    return out


def print_drawn(settings: dict[str, SwarmSettings], scenes: int, runs: int, starts: int) -> dict[str, list[Row]]:
    """Scenes on which nothing was tuned."""
    instances = drawn_instances(scenes)
    known = [known_value(instance, starts=starts) for instance in instances]
    print(f"\n## {scenes} drawn scenes, {runs} runs each, beside each scene's own best known value\n")
    print("| settings | within 1 %, all | scenes with all runs | worst scene | feasible, all | worst scene | mean excess |")
    print("|---|---|---|---|---|---|---|")
    out = {}
    for name, setting in settings.items():
        rows = [measure(setting, i, best, runs=runs) for i, best in zip(instances, known, strict=True)]
        near = np.array([row.near for row in rows])
        feasible = np.array([row.feasible for row in rows])
        excess = np.nanmean([row.mean / best - 1 for row, best in zip(rows, known, strict=True)])
        print(
            f"| {name} | {near.mean():.1%} | {np.sum(near == 1)} of {scenes} | {near.min():.0%} | {feasible.mean():.1%} "
            f"| {feasible.min():.0%} | {excess:.2%} |",
            flush=True,
        )
        out[name] = rows
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--settings", nargs="+", default=list(NAMED_SETTINGS), choices=list(NAMED_SETTINGS), metavar="NAME")
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--scene-runs", type=int, default=100)
    parser.add_argument("--starts", type=int, default=200, help="gradient descents for a drawn scene's best known value")
    parser.add_argument("--json", metavar="FILE", help="also write the rows to FILE")
    args = parser.parse_args()
    settings = chosen_settings(args.settings)
    tables = {"main": print_main(settings, args.runs), "other": print_other(settings, args.runs)}
    if args.scenes:
        tables["drawn"] = print_drawn(settings, args.scenes, args.scene_runs, args.starts)
    if args.json:
        Path(args.json).write_text(json.dumps(tables, indent=1, default=asdict), encoding="utf-8")


if __name__ == "__main__":
    main()
