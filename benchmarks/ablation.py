"""What each part of the swarm's settings is worth, and whether they are tuned to one instance only.

Every named setting runs on the paper's problem (goal mode, A_R 0.10) within the same 30,000 evaluations: 500 runs, and
the 20 runs of seed 0 that the paper's Table 3 would show. Then the same settings run where nothing was tuned: on the
other radii, in the literal mode, and on 20 drawn scenes, each beside its own best known value.

    python benchmarks/ablation.py
    python benchmarks/ablation.py --runs 100 --scenes 5       # a minute
    python benchmarks/ablation.py --settings ring-rising ipso-e --records ablation.jsonl    # goes on after a stop

"Within 1 %" is the share of all runs that end feasible and at most 1 % above the best known value; worst and mean are
over the feasible runs. The best known value of a drawn scene is the least of what gradient descents (best_known.py) and
20 long runs (300,000 evaluations) find. Times are medians over batches of runs on one thread.
"""

from __future__ import annotations

import argparse
import contextlib
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from best_known import DESCENTS, best_of, starts_on
from instances import ARM, MODES, RADII, Instance, drawn_instances, paper_instance
from rounds import print_table
from spacearm.study.paper_problem import BEST_KNOWN, NEAR
from spacearm.study.run_study import Study, run_study
from spacearm.swarm import NAMED_SETTINGS, named_settings, run_trials

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


@dataclass(frozen=True, kw_only=True)
class Measure:
    """A setting, by name, to be run on an instance, a number of times with a seed; `best_known` is the instance's value."""

    settings: str
    instance: Instance
    best_known: float
    runs: int
    seed: int = SEED


def measure(task: Measure) -> Row:
    """Run a setting on an instance many times, on one thread."""
    instance, runs = Instance(**asdict(task.instance)), task.runs
    batches = [len(part) for part in np.array_split(np.arange(runs), min(BATCHES, runs))]
    values, seconds, first = [], [], 0
    for trials in batches:
        begun = time.perf_counter()
        results = run_trials(
            instance.objective,
            ARM.lower,
            ARM.upper,
            named_settings(task.settings),
            seed=task.seed,
            first_trial=first,
            trials=trials,
            threads=1,
        )
        seconds.append((time.perf_counter() - begun) / trials)
        values += [run.fitness if run.success else np.inf for run in results]
        first += trials
    f = np.array(values)
    fine = f[np.isfinite(f)] if np.isfinite(f).any() else np.array([np.nan])
    return Row(
        near=float(np.mean(f <= task.best_known * (1 + NEAR))),
        worst=float(fine.max()),
        mean=float(fine.mean()),
        best=float(fine.min()),
        feasible=float(np.mean(np.isfinite(f))),
        milliseconds=float(np.median(seconds)) * 1e3,
    )


ABLATION = Study(
    name="ablation",
    run=measure,
    record=Row,
    key=lambda task: f"{task.settings} on {task.instance.name}, {task.runs} runs, seed {task.seed}",
    definition=lambda task: {
        **asdict(task.instance),
        "best_known": task.best_known,
        "swarm": asdict(named_settings(task.settings)),
    },
    timed=True,
)
"""The study of all settings on all instances; timed, so one task at a time."""


def known_value(instance: Instance, *, starts: int) -> float:
    """The best known value of a drawn scene: the least that descents and long runs find."""
    long = run_trials(instance.objective, ARM.lower, ARM.upper, LONG, seed=SEED, trials=20, threads=1)
    values = [run.fitness for run in long if run.success]
    fresh = Instance(**asdict(instance))  # the kernel's objects that it holds stay in this process
    with contextlib.suppress(RuntimeError):  # no descent ended feasible
        values.append(best_of(fresh, run_study(DESCENTS, starts_on(fresh, starts=starts))).fitness)
    return min(values)


def rows_of(names: list[str], cases: list[tuple[Instance, float]], records: Path | None, **how: int) -> dict[str, list[Row]]:
    """Return each setting's rows, one for each instance with its best known value."""
    tasks = [Measure(settings=name, instance=instance, best_known=best, **how) for name in names for instance, best in cases]
    rows = run_study(ABLATION, tasks, records=records)
    return {name: rows[i * len(cases) : (i + 1) * len(cases)] for i, name in enumerate(names)}


def print_main(names: list[str], runs: int, records: Path | None) -> None:
    """The ablation's table."""
    cases = [(paper_instance(*MAIN), BEST_KNOWN[MAIN])]
    many, few = rows_of(names, cases, records, runs=runs), rows_of(names, cases, records, runs=20, seed=0)
    lines: list[list[object]] = [
        [
            name,
            f"{round(row.near * runs)} of {runs}",
            f"{row.worst:.4f}",
            f"{row.mean:.4f}",
            f"{row.feasible:.0%}",
            f"{row.milliseconds:.2f}",
            f"{round(twenty.near * 20)} of 20",
            f"{twenty.worst:.4f}",
        ]
        for name in names
        for row, twenty in zip(many[name], few[name], strict=True)
    ]
    print_table(
        f"Goal mode, A_R 0.10: best known {BEST_KNOWN[MAIN]:.6f}, 30,000 evaluations a run",
        f"settings | within 1 %, {runs} runs | worst | mean | feasible | ms a run | within 1 %, 20 runs of seed 0 | worst",
        lines,
    )


def print_other(names: list[str], runs: int, records: Path | None) -> None:
    """The paper's other radii and mode."""
    places = [(mode, radius) for mode in MODES for radius in RADII if (mode, radius) != MAIN]
    cases = [(paper_instance(*place), BEST_KNOWN[place]) for place in places]
    lines: list[list[object]] = [
        [name, *(f"{row.near:.1%} ({row.worst / best - 1:.1%})" for row, (_, best) in zip(rows, cases, strict=True))]
        for name, rows in rows_of(names, cases, records, runs=runs).items()
    ]
    print_table(
        f"The other radii and the literal mode: share of {runs} runs within 1 % (worst excess over best known)",
        "settings | " + " | ".join(instance.name for instance, _ in cases),
        lines,
    )


def print_drawn(names: list[str], scenes: int, runs: int, starts: int, records: Path | None) -> None:
    """Scenes on which nothing was tuned."""
    cases = [(Instance(**asdict(each)), known_value(each, starts=starts)) for each in drawn_instances(scenes)]
    lines: list[list[object]] = []
    for name, rows in rows_of(names, cases, records, runs=runs).items():
        near = np.array([row.near for row in rows])
        feasible = np.array([row.feasible for row in rows])
        excess = np.nanmean([row.mean / best - 1 for row, (_, best) in zip(rows, cases, strict=True)])
        shares = (f"{near.mean():.1%}", f"{np.sum(near == 1)} of {scenes}", f"{near.min():.0%}")
        lines.append([name, *shares, f"{feasible.mean():.1%}", f"{feasible.min():.0%}", f"{excess:.2%}"])
    print_table(
        f"{scenes} drawn scenes, {runs} runs each, beside each scene's own best known value",
        "settings | within 1 %, all | scenes with all runs | worst scene | feasible, all | worst scene | mean excess",
        lines,
    )


def main() -> None:
    """Measure and print the three tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--settings", nargs="+", default=list(NAMED_SETTINGS), choices=list(NAMED_SETTINGS), metavar="NAME")
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--scene-runs", type=int, default=100)
    parser.add_argument("--starts", type=int, default=200, help="gradient descents for a drawn scene's best known value")
    parser.add_argument("--records", type=Path, help="file of records; the same again goes on after a stop")
    args = parser.parse_args()
    print_main(args.settings, args.runs, args.records)
    print_other(args.settings, args.runs, args.records)
    if args.scenes:
        print_drawn(args.settings, args.scenes, args.scene_runs, args.starts, args.records)


if __name__ == "__main__":
    main()
