"""Ours: the native search."""

from __future__ import annotations

from cases import Case, Trace
from spacearm.bench.recheck import dense_configurations
from spacearm.planner import PlannerSettings
from spacearm.planner.islands import Islands


def searched(case: Case, seed: int, *, seconds: float = 0, evaluations: int = 0) -> Trace:
    """The search of `plan()`, without the proof."""
    settings = PlannerSettings(evaluations=evaluations or None, time_budget=seconds or None, threads=1)
    islands = Islands(case.problem, case.goal[None].copy(), settings, seed=seed, margin=case.margin)
    islands.run(evaluations=evaluations, seconds=seconds, until_first=False, stall=0)
    trace = Trace("spacearm", case.name, seed, seconds=seconds, calls=islands.evaluations)
    for entry, motion in zip(islands.history(), islands.motions()[::-1], strict=True):
        trace.note(entry.seconds, entry.evaluations, motion.length())
    if islands.best is not None:
        trace.way = dense_configurations(islands.best)
    return trace
