"""The report pages of the two benchmarks: how many problems are solved over time, the tables, and some plans in space.

The plans are made once more for the page, for records hold no motions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.version import version
from spacearm.planner import Plan, PlannerSettings, Problem, plan
from spacearm.report.report_knots import knots_of
from spacearm.report.report_page import plot, section, series
from spacearm.report.report_plan import report_of_plans
from spacearm.report.report_views import flat_view, take_views
from spacearm.study.motionbenchmaker import Item, read_item
from spacearm.study.motionbenchmaker_runs import LIMIT, Benchmark
from spacearm.study.motionbenchmaker_runs import Run as MbmRun
from spacearm.study.spacebench import SpaceProblem
from spacearm.study.spacebench_runs import Run as SpaceRun
from spacearm.study.spacebench_runs import SpaceBench, for_a_fixed_base, on_a_free_base
from spacearm.study.study_tables import Table

Data = dict[str, Any]
Array = NDArray[np.float64]
Progress = Callable[[int, int, str], Any]
R = TypeVar("R", MbmRun, SpaceRun)

FIRST, SLOWEST, UNSOLVED = "the first of its family", "it took longest in its family", "it was not solved in time"
"""Why a plan is shown."""

MOST_PLANS = 6
"""That a page shows in space."""

_RAW = "as measured here"  # ends the title of a table whose times are not the reference core's
_POINTS = 240  # of a curve over time
_REFERENCE = "[ms of the reference core]"


# ---- curves ------------------------------------------------------------------------------------------------------------


def share_plot(
    name: str, title: str, groups: Mapping[str, tuple[Sequence[float], int]], *, x_label: str, log_x: bool, note: str = ""
) -> Data:
    """Return the plot of the share of records with a value up to x, a staircase for each group.

    Args:
        name: unique among the page's plots.
        title: of the plot.
        groups: of each its values, and how many records it has in all; those without a value never count.
        x_label: what the values are.
        log_x: whether they are drawn over a logarithmic axis.
        note: a sentence below it.
    """
    known = np.array([value for values, _ in groups.values() for value in values], dtype=np.float64)
    x = _axis(known, log=log_x)
    curves = []
    for tone, (group, (values, count)) in enumerate(groups.items()):
        share = 100 * np.searchsorted(np.sort(values), x, side="right") / max(count, 1)
        curves.append(series(f"{group} ({len(values)} of {count})", share, tone, steps=True, dashed=group == "all"))
    return plot(name, title, "%", x, curves, x_label=x_label, clock=False, log_x=log_x, note=note)


def _axis(values: Array, *, log: bool) -> Array:
    """Return places that reach a little beyond the values."""
    if not len(values):
        return np.array([1.0, 10.0])
    low, high = float(values.min()), float(values.max())
    if log:
        low = max(low, 1e-9)
        return np.geomspace(low / 1.3, max(high, low) * 1.3, _POINTS)
    return np.linspace(min(low, 0.0), high + 0.05 * (high - min(low, 0.0)) + 1e-12, _POINTS)


def _by_family(runs: Iterable[R], families: Sequence[str], value: Callable[[R], float | None]) -> Data:
    runs = list(runs)
    groups: dict[str, tuple[list[float], int]] = {}
    for name in [*families, "all"] if len(families) > 1 else families:
        those = [run for run in runs if name in ("all", run.family)]
        found = [at for at in map(value, those) if at is not None]
        groups[name] = (found, len(those))
    return groups


# ---- which plans are shown ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice(Generic[R]):
    """A run whose plan is shown.

    Attributes:
        run: that was measured.
        why: in words.
    """

    run: R
    why: str


def chosen(runs: Sequence[R], took: Callable[[R], float | None], *, most: int = MOST_PLANS) -> list[Choice[R]]:
    """Choose runs to show: the first of each family, then the one of each that took longest, those without a plan before.

    Args:
        runs: a family's together.
        took: to the plan [s]; None where there is none.
        most: of them.
    """
    families = list(dict.fromkeys(run.family for run in runs))
    firsts = [Choice(run=next(run for run in runs if run.family == name), why=FIRST) for name in families]
    worst: list[Choice[R]] = []
    for name in families:
        run = max((run for run in runs if run.family == name), key=lambda run: _or_never(took(run)))
        worst.append(Choice(run=run, why=UNSOLVED if took(run) is None else SLOWEST))
    worst.sort(key=lambda one: -_or_never(took(one.run)))
    firsts = firsts[: max(most - 2, 1)] if len(firsts) + 2 > most else firsts
    out: list[Choice[R]] = []
    for one in (*firsts, *worst):
        if len(out) < most and all(one.run is not other.run for other in out):
            out.append(one)
    return out


def _or_never(seconds: float | None) -> float:
    return math.inf if seconds is None else seconds


# ---- MotionBenchMaker --------------------------------------------------------------------------------------------------


def mbm_page(
    benchmark: Benchmark,
    tables: Sequence[Table],
    notes: Sequence[str],
    said: Data,
    lengths: tuple[ArrayLike, Mapping[str, ArrayLike]],
    items: Sequence[Item] = (),
    *,
    progress: Progress | None = None,
) -> Data:
    """Return the page of a measurement of MotionBenchMaker's problems.

    Args:
        benchmark: what was measured.
        tables: of it.
        notes: what stands below them.
        said: the verdict.
        lengths: times [s of the reference core], and the mean length by then of groups of runs [rad].
        items: the problems; some plans of them are shown.
        progress: called with the plans made, those in all, and what is being planned.
    """
    at, by_group = lengths
    curves = [
        series(name, values, 0 if name == "all" else 1, faint=name != "all")
        for name, values in sorted(by_group.items(), key=lambda entry: entry[0] == "all")
    ]
    plots = [
        share_plot(
            "first",
            "problems solved: the first motion that the search holds free",
            _by_family(benchmark.valid, benchmark.families, lambda run: _ms(run.first, run.scale)),
            x_label=f"time of search {_REFERENCE}",
            log_x=True,
        ),
        share_plot(
            "certified",
            "problems solved: plan() returns a certified motion",
            _by_family(benchmark.valid, benchmark.families, lambda run: _ms(run.seconds if run.certified else None, run.scale)),
            x_label=f"time of plan() {_REFERENCE}",
            log_x=True,
            note=f"plan() searches {1e3 * benchmark.protocol.plan:g} ms before the proof; solved within {LIMIT:g} s",
        ),
        plot(
            "lengths",
            "mean joint path length after a time of search",
            "rad",
            1e3 * np.asarray(at, dtype=np.float64),
            curves,
            x_label=f"time of search {_REFERENCE}",
            clock=False,
            log_x=True,
            note="faint: a seed; a problem counts with its first motion until that is found",
        ),
    ]
    title = f"MotionBenchMaker: {benchmark.robot.group} among its obstacles"
    page = _page(title, _mbm_block(benchmark), flat_view("Overview", said, plots=plots, sections=_sections(tables, notes)))
    wanted = chosen([run for run in benchmark.valid if run.seed == 0], _mbm_took) if items else []
    arm = benchmark.robot.load() if wanted else None
    for i, choice in enumerate(wanted):
        run = choice.run
        item = next((one for one in items if (one.family, one.name) == (run.family, run.name)), None)
        if item is None or arm is None:
            continue
        if progress:
            progress(i, len(wanted), f"{run.family} {run.name}")
        budget = benchmark.protocol.plan / run.scale
        settings = PlannerSettings(evaluations=None, time_budget=budget, threads=1)
        made = _planned(read_item(item, arm), settings, run.seed)
        _add_view(page, made, f"{run.family} {run.name}", choice.why, _again(made, run.length))
    return page


def _mbm_took(run: MbmRun) -> float | None:
    return run.seconds * run.scale if run.certified else None


def _mbm_block(benchmark: Benchmark) -> list[list[str]]:
    protocol, runs = benchmark.protocol, benchmark.runs
    return [
        ["benchmark", f"{len(runs)} runs, {protocol.seeds} of each problem, in {len(benchmark.families)} families"],
        ["robot", f"group '{benchmark.robot.group}' of {benchmark.robot.urdf.name}"],
        ["measured", f"{1e3 * protocol.search:g} ms of search alone; plan() with {1e3 * protocol.plan:g} ms of search"],
        ["made with", f"spacearm {version()}"],
    ]


# ---- SpaceBench --------------------------------------------------------------------------------------------------------


def space_page(
    bench: SpaceBench,
    tables: Sequence[Table],
    notes: Sequence[str],
    said: Data,
    items: Sequence[SpaceProblem] = (),
    *,
    progress: Progress | None = None,
) -> Data:
    """Return the page of a measurement of SpaceBench.

    Args:
        bench: what was measured.
        tables: of it.
        notes: what stands below them.
        said: the verdict.
        items: the problems; some plans of them are shown.
        progress: called with the plans made, those in all, and what is being planned.
    """
    limit = bench.protocol.limit
    plots = [
        share_plot(
            "solved",
            "problems solved: the first certified motion",
            _by_family(
                bench.runs, bench.families, lambda run: _ms(run.seconds if run.solved_within(limit) else None, run.scale)
            ),
            x_label=f"time of plan() {_REFERENCE}",
            log_x=True,
        ),
        share_plot(
            "peaks",
            "motions whose base turns by up to",
            _by_family(
                [run for run in bench.runs if run.peak is not None],
                bench.families,
                lambda run: None if run.peak is None else math.degrees(run.peak),
            ),
            x_label="greatest angle of the base [deg]",
            log_x=False,
        ),
        share_plot(
            "missed",
            "planned for a fixed base, then let go: tips that miss their goal by up to",
            _by_family(
                [run for run in bench.runs if run.missed_by is not None],
                bench.families,
                lambda run: None if run.missed_by is None else max(1e3 * run.missed_by, 1e-3),
            ),
            x_label="distance from the goal [mm]",
            log_x=True,
            note="of goals in space; a goal in joint space is always reached",
        ),
    ]
    overview = flat_view("Overview", said, plots=plots if bench.runs else [], sections=_sections(tables, notes))
    page = _page("SpaceBench: arms on spacecraft whose base floats", _space_block(bench), overview)
    wanted = chosen([run for run in bench.runs if run.seed == 0], lambda run: _space_took(run, limit)) if items else []
    for i, choice in enumerate(wanted):
        run = choice.run
        item = next((one for one in items if one.name == run.name), None)
        if item is None:
            continue
        if progress:
            progress(i, len(wanted), run.name)
        settings = PlannerSettings(time_budget=limit / run.scale, stop_at_first=True, threads=1)
        made = _planned(item.problem, settings, run.seed)
        _add_view(page, made, run.name, choice.why, _again(made, run.length), _let_go(run))
        _add_ghost(page["views"][-1], item, settings, run)
    return page


def _add_ghost(view: Data, item: SpaceProblem, settings: PlannerSettings, run: SpaceRun) -> None:
    """Add the motion planned for a fixed base to a view, pale, on the base that is free to move."""
    fixed = _planned(for_a_fixed_base(item.problem), settings, run.seed)
    if not fixed.found or fixed.trajectory is None:
        return
    knots = knots_of(on_a_free_base(item.problem, fixed.trajectory), [])
    solid = view["actors"][0] | {"name": "planned for a floating base"}
    ghost = solid | {"name": "planned for a fixed base, let go", "knots": knots, "tone": 1, "ghost": True}
    view["actors"] = [solid, ghost]
    view["clock"]["duration"] = max(view["clock"]["duration"], float(fixed.trajectory.duration))


def _space_took(run: SpaceRun, limit: float) -> float | None:
    return run.seconds * run.scale if run.solved_within(limit) else None


def _let_go(run: SpaceRun) -> str:
    if run.let_go == "no motion":
        return ""
    deep = "" if run.deepest is None else f", {1e3 * run.deepest:.0f} mm deep"
    missed = "" if run.missed_by is None else f"; its tip misses the goal by {1e3 * run.missed_by:.0f} mm"
    return f"the pale arm: a motion planned and proven for a fixed base, let go; it {run.let_go}{deep}{missed}"


def _space_block(bench: SpaceBench) -> list[list[str]]:
    problems = len({run.name for run in bench.runs})
    return [
        ["benchmark", f"{problems} problems in {len(bench.families)} families"],
        ["runs", f"{len(bench.runs)}, and {len(bench.published)} of published problems"],
        ["solved", f"with a certified motion within {bench.protocol.limit:g} s of the reference core"],
        ["made with", f"spacearm {version()}"],
    ]


# ---- parts of both -----------------------------------------------------------------------------------------------------


def _ms(seconds: float | None, scale: float) -> float | None:
    return None if seconds is None else 1e3 * seconds * scale


def _page(title: str, block: list[list[str]], overview: Data) -> Data:
    return {"title": title, "block": block, "robots": [], "meshes": [], "views": [overview], "sections": []}


def _sections(tables: Sequence[Table], notes: Sequence[str]) -> list[Data]:
    shown = [table_section(table, opened=True) for table in tables]
    return [*shown, section("What is to be known", notes=list(notes), opened=True)]


def table_section(table: Table, *, opened: bool) -> Data:
    """Return a table as a part of a page: the beginning of its title above it, all of it below if there is more."""
    ends = [table.title.find(mark) for mark in (",", ";", ": ") if mark in table.title]
    name = table.title[: min(ends, default=len(table.title))].strip()
    if table.title.endswith(_RAW):
        name, opened = f"{name}, {_RAW}", False
    notes = [table.title] if name != table.title else []
    return section(name, table=(table.header, table.rows), notes=notes, opened=opened)


def _planned(problem: Problem, settings: PlannerSettings, seed: int) -> Plan:
    """Plan a problem again; its scene is a new one, so that nothing is remembered of it."""
    found = plan(replace(problem, scene=type(problem.scene)(problem.scene.obstacles)), settings, rng=seed)
    if found.interrupted:
        raise KeyboardInterrupt
    return found


def _again(found: Plan, measured: float | None) -> str:
    length = None if not found.found or found.trajectory is None else found.trajectory.motion.length()
    if length is None or measured is None:
        return "planned once more for this page, with the same seed"
    if math.isclose(length, measured, rel_tol=1e-6):
        return "planned once more for this page, with the same seed: the motion that was measured"
    return (
        f"planned once more for this page, with the same seed; the search ends by time, and gives another motion: {length:.2f} "
        f"rad, where {measured:.2f} rad was measured"
    )


def _add_view(page: Data, found: Plan, name: str, why: str, *notes: str) -> None:
    """Add a plan to the page; what is slow or failed says so in its name."""
    name += {FIRST: "", SLOWEST: ", slowest", UNSOLVED: ", not solved"}[why]
    for view in take_views(page, report_of_plans(found, names=[name])):
        said = section("Why this one", notes=[why, *(note for note in notes if note)], opened=True)
        page["views"].append({**view, "name": name, "sections": [said, *view["sections"]]})
