"""All problems of SpaceBench with all seeds, and the published ones, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from spacearm.bench.space.collection import SpaceProblem
from spacearm.bench.space.measure import Protocol, Run, measure
from spacearm.bench.space.published import seed_problem, servicer_problem
from spacearm.bench.yardstick import load_now, scale_now
from spacearm.planner import PlannerSettings, Problem, Weights, plan

SERVICER, LEAST_PEAK, SEEDS_SCENE = "servicer", "servicer, least peak", "seed's scene"
"""The published problems, as the report calls them."""

_CALM = Weights(length=1e-3, base_peak=10.0)
_INTERIOR = 4  # control points where the least peak is looked for


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedRun:
    """A published problem with a seed, to the first certified motion, or with the base's peak as the fitness.

    Attributes:
        what: `SERVICER`, `LEAST_PEAK` or `SEEDS_SCENE`.
        seed: of the plan.
        scale: seconds of the reference core for a second of this one, when this was measured.
        status: of the plan.
        seconds: all in all [s].
        parts: of that, by stage [s].
        goal_distance: by which the end effector misses its goal [m]; None where there is no motion.
        goal_angle: likewise [rad].
        base_final: by how much the base is turned at the end [rad].
        base_peak: the most that it is turned by on the way [rad].
    """

    what: str
    seed: int
    scale: float
    status: str
    seconds: float
    parts: dict[str, float]
    goal_distance: float | None
    goal_angle: float | None
    base_final: float | None
    base_peak: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpaceBench:
    """All runs, and how they were made.

    Attributes:
        protocol: what was measured.
        runs: by family, problem and seed.
        published: runs of the published problems.
        loads: how many processes wanted a core, each time the NumPy kernel was measured.
        seconds: that it took.
    """

    protocol: Protocol
    runs: tuple[Run, ...]
    published: tuple[PublishedRun, ...]
    loads: tuple[float, ...]
    seconds: float

    @property
    def families(self) -> tuple[str, ...]:
        """The families, in order."""
        return tuple(dict.fromkeys(run.family for run in self.runs))


def run_spacebench(
    items: Sequence[SpaceProblem],
    protocol: Protocol | None = None,
    *,
    published: int = 0,
    peak_budget: float = 2.0,
    progress: Callable[[int, int, str], Any] | None = None,
) -> SpaceBench:
    """Measure problems with all seeds; before each family the NumPy kernel is measured anew.

    Args:
        items: the problems, a family's together.
        protocol: what is measured.
        published: seeds of each of the published problems; 0 leaves them out.
        peak_budget: how long each search for the least peak of the servicer's base goes on, on the reference core [s].
        progress: called with the runs done, the runs in all, and what is next.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    protocol = Protocol() if protocol is None else protocol
    tell = progress or (lambda done, total, what: None)
    begun, total = time.perf_counter(), protocol.seeds * len(items) + 3 * published
    runs: list[Run] = []
    extra: list[PublishedRun] = []
    loads: list[float] = []
    for item in items[:1]:
        measure(item, 0, protocol, scale_now())  # what is imported on the way is not timed
    for family, group in groupby(items, key=lambda item: item.family):
        scale = scale_now()
        loads.append(load_now())
        for item in group:
            for seed in range(protocol.seeds):
                tell(len(runs), total, f"{family} {item.name}")
                runs.append(measure(item, seed, protocol, scale))
    quick = lambda scale: PlannerSettings(time_budget=protocol.limit / scale, stop_at_first=True)  # noqa: E731
    calm = lambda scale: PlannerSettings(  # noqa: E731
        time_budget=peak_budget / scale, weights=_CALM, interior_points=(_INTERIOR,)
    )
    for what, make, settings in (
        (SERVICER, servicer_problem, quick),
        (SEEDS_SCENE, seed_problem, quick),
        (LEAST_PEAK, lambda: servicer_problem(restore=False), calm),
    ):
        if published:
            plan(make(), PlannerSettings(evaluations=100, stop_at_first=True), rng=0)  # what is read on the way is not timed
            loads.append(load_now())
        for seed in range(published):
            tell(len(runs) + len(extra), total, what)
            scale = scale_now()
            extra.append(_published(what, make(), settings(scale), seed, scale))
    return SpaceBench(
        protocol=protocol,
        runs=tuple(runs),
        published=tuple(extra),
        loads=tuple(loads),
        seconds=time.perf_counter() - begun,
    )


def _published(what: str, problem: Problem, settings: PlannerSettings, seed: int, scale: float) -> PublishedRun:
    begun = time.perf_counter()
    found = plan(problem, settings, rng=seed)
    seconds = time.perf_counter() - begun
    if found.interrupted:
        raise KeyboardInterrupt
    base = found.base if found.found else None
    return PublishedRun(
        what=what,
        seed=seed,
        scale=scale,
        status=found.status,
        seconds=seconds,
        parts={name: value for name, value in found.timings.items() if name != "total"},
        goal_distance=None if base is None else base.goal_distance,
        goal_angle=None if base is None else base.goal_angle,
        base_final=None if base is None else base.final,
        base_peak=None if base is None else base.peak,
    )
