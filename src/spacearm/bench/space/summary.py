"""The numbers of SpaceBench: by family and in all, and the published problems beside their targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spacearm.bench.space.measure import LetGo, Run
from spacearm.bench.space.published import PUBLISHED_ROTATION
from spacearm.bench.space.run import LEAST_PEAK, SEEDS_SCENE, SERVICER, PublishedRun, SpaceBench
from spacearm.bench.summary import Spread, Target

OUTCOMES: tuple[LetGo, ...] = ("collides", "misses its goal", "disturbs the base", "holds")
"""What may become of a fixed-base planner's motion, in the order of the reports."""

SERVICER_LIMIT = 2.0
"""Within this time the servicer's problem is to be solved [s of the reference core]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpaceSummary:
    """Of some runs. Times are the reference core's.

    Attributes:
        runs: how many.
        solved: with a certified motion within the protocol's time.
        first: time to it [s].
        search: what of that went to the search, median [s].
        certify: to the proof, median [s].
        length: mean of the first motions [rad].
        straight: mean of the straight lines between their ends [rad].
        known_length: mean of the known solutions [rad].
        peak: of the base's greatest angle [rad].
        let_go: share of the fixed-base planner's motions, by what became of them when the base was let go; nan without any.
        fixed: how many such motions there are.
        missed_by: median of what the tip misses its goal by then, of goals in space [m].
    """

    runs: int
    solved: int
    first: Spread
    search: float
    certify: float
    length: float
    straight: float
    known_length: float
    peak: Spread
    let_go: dict[str, float]
    fixed: int
    missed_by: float


def summary_of(runs: Sequence[Run], limit: float) -> SpaceSummary:
    """Sum up some runs.

    Args:
        runs: of one family, or all.
        limit: a problem that takes longer is not solved [s of the reference core].
    """
    solved = [run for run in runs if run.solved_within(limit)]
    fixed = [run for run in runs if run.let_go != "no motion"]
    missed = [run.missed_by for run in fixed if run.missed_by is not None]
    return SpaceSummary(
        runs=len(runs),
        solved=len(solved),
        first=Spread.of([run.seconds * run.scale for run in solved]),
        search=_median([run.search * run.scale for run in solved]),
        certify=_median([run.certify * run.scale for run in solved]),
        length=_mean([run.length for run in solved if run.length is not None]),
        straight=_mean([run.straight for run in solved if run.straight is not None]),
        known_length=_mean([run.known_length for run in runs]),
        peak=Spread.of([run.peak for run in solved if run.peak is not None]),
        let_go={what: _share(fixed, what) for what in OUTCOMES},
        fixed=len(fixed),
        missed_by=_median(missed),
    )


def targets_of(bench: SpaceBench) -> list[Target]:
    """Return the published problems' targets; none if they were not run."""
    servicer, calm, seed = (_of(bench, what) for what in (SERVICER, LEAST_PEAK, SEEDS_SCENE))
    out: list[Target] = []
    if servicer:
        done = [run for run in servicer if run.status == "found"]
        worst = lambda values: max(values, default=math.nan)  # noqa: E731
        quick = [run for run in done if run.seconds * run.scale <= SERVICER_LIMIT]
        out += [
            _target("servicer: certified within 2 s", 100, 100 * len(quick) / len(servicer), "% of seeds", at_least=True),
            _target("servicer: end effector misses its goal by, at most", 1, 1e3 * worst(_all(done, "goal_distance")), "mm"),
            _target("servicer: and by, at most", 0.1, math.degrees(worst(_all(done, "goal_angle"))), "deg"),
            _target("servicer: base turned at the end by, at most", 0.05, math.degrees(worst(_all(done, "base_final"))), "deg"),
        ]
    if calm:
        least = min(_all([run for run in calm if run.status == "found"], "base_peak"), default=math.nan)
        published = round(math.degrees(PUBLISHED_ROTATION), 3)
        out.append(_target("servicer, base ending as it likes: least peak", published, math.degrees(least), "deg"))
    if seed:
        done = [run.seconds * run.scale for run in seed if run.status == "found"]
        out.append(_target("seed's scene: certified", 100, 100 * len(done) / len(seed), "% of seeds", at_least=True))
        out.append(_target("seed's scene: first certified motion, median", 50, 1e3 * _median(done), "ms"))
    return out


def _target(what: str, target: float, measured: float, unit: str, *, at_least: bool = False) -> Target:
    return Target(what=what, target=target, measured=measured, unit=unit, at_least=at_least)


def _of(bench: SpaceBench, what: str) -> list[PublishedRun]:
    return [run for run in bench.published if run.what == what]


def _all(runs: Sequence[PublishedRun], name: str) -> list[float]:
    return [value for value in (getattr(run, name) for run in runs) if value is not None]


def _share(runs: Sequence[Run], what: str) -> float:
    return sum(run.let_go == what for run in runs) / len(runs) if runs else math.nan


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else math.nan


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else math.nan
