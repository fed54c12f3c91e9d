"""Ours: the native search alone, and `plan()` with its proof."""

from __future__ import annotations

import time

from cases import Case, Trace

from spacearm.planner import PlannerSettings, plan
from spacearm.planner.motion_search import Islands
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.study.other_checker import dense_configurations


def searched(case: Case, seed: int, *, seconds: float = 0, evaluations: int = 0) -> Trace:
    """The search of `plan()`, without the proof."""
    settings = PlannerSettings(evaluations=evaluations or None, time_budget=seconds or None, threads=1)
    islands = Islands(case.problem, case.goal[None].copy(), settings, seed=seed, searched=SearchedClearance(asked=case.margin))
    islands.run(evaluations=evaluations, seconds=seconds, until_first=False, stall=0)
    trace = Trace("spacearm, search alone", case.name, seed, seconds=seconds, calls=islands.evaluations)
    for entry, motion in zip(islands.history(), islands.motions()[::-1], strict=True):
        trace.note(entry.seconds, entry.evaluations, motion.length())
    if islands.best is not None:
        trace.way = dense_configurations(islands.best)
    return trace


def proven(case: Case, seed: int, *, seconds: float) -> Trace:
    """All of `plan()`; nothing counts before its proof."""
    settings = PlannerSettings(evaluations=None, time_budget=seconds, threads=1)
    begun = time.perf_counter()
    found = plan(case.problem, settings, rng=seed)
    trace = Trace(f"spacearm, plan() with {1e3 * seconds:g} ms", case.name, seed, seconds=time.perf_counter() - begun)
    if found.found and found.trajectory is not None:
        trace.note(trace.seconds, found.evaluations, found.trajectory.motion.length())
        trace.way = dense_configurations(found.trajectory.motion)
    return trace
