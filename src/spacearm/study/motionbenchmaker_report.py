"""MotionBenchMaker's report from its runs: a page and tables for people, report.json for machines, a figure if asked for.

Times are the reference core's unless they are called raw.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.extras import require_extra
from spacearm.core.interrupts import unbroken
from spacearm.core.output import write_new
from spacearm.core.version import version
from spacearm.report.report_page import write_report
from spacearm.report.report_views import verdict
from spacearm.show.figure_style import BLACK, BLUE, CYCLE, GREY, PAGE, SKY, VERMILION, figure_of, look, new_figure, tidy
from spacearm.show.motion_shown import axes_given
from spacearm.study.bench_pages import Progress, mbm_page
from spacearm.study.motionbenchmaker import Item
from spacearm.study.motionbenchmaker_runs import LIMIT, Benchmark, Run
from spacearm.study.other_checker import STEP
from spacearm.study.reference_core import REFERENCE, load_note, machine, machine_note, speed_note
from spacearm.study.statistics import Spread, Target, mean, target_table
from spacearm.study.study_tables import Table, listed, markdown, milliseconds, number, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_MANY = 5  # failures listed before it would no longer be read

BUDGETS = (0.001, 0.01, 0.05)
"""When the length is told [s of the reference core]."""

PANDA = "panda_arm"
"""The group of the arm that the targets of times and lengths were set for."""

FULL_SET_STRAIGHT = 4.18
"""Mean length of the straight motions of the 699 problems that the length targets were set on [rad]."""

LENGTH_TARGETS = (4.90, 4.55, 4.48)
"""Of the mean length after each of `BUDGETS`, on those problems [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LengthBy:
    """Lengths after a time.

    Attributes:
        solved: runs that had a motion by then.
        mean: of these [rad].
        all: the mean with the first motion of those that came later; nobody is left out who was solved at all [rad].
    """

    solved: int
    mean: float
    all: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Of some runs; those whose problem cannot be solved are only counted.

    Attributes:
        runs: with a problem that can be solved.
        ends_collide: runs without.
        solved: runs with a first motion in time.
        first: time to it [s].
        with_preparation: the same, what comes before the search included [s].
        prepare: what comes before the search [s].
        first_evaluations: motions looked at before it; the same on every machine.
        first_length: its length, mean [rad]; the same on every machine.
        straight: length of the straight motion, mean [rad].
        lengths: after each of `BUDGETS`.
        certified: runs whose plan was found and proven in time.
        certificate: one proof [s].
        total: `plan()`, all in all [s].
        proofs: mean and most in a plan.
        plan_length: mean [rad].
        looked_at: configurations of plans that the other checker looked at.
        collisions: plans in which it found any.
    """

    runs: int
    ends_collide: int
    solved: int
    first: Spread
    with_preparation: Spread
    prepare: Spread
    first_evaluations: Spread
    first_length: float
    straight: float
    lengths: tuple[LengthBy, ...]
    certified: int
    certificate: Spread
    total: Spread
    proofs: tuple[float, int]
    plan_length: float
    looked_at: int
    collisions: int


def summary_of(runs: Sequence[Run], *, raw: bool = False) -> Summary:
    """Sum up some runs.

    Args:
        runs: of one family, or all.
        raw: times as they were measured here, not the reference core's. Budgets stay the reference core's.
    """
    valid = [run for run in runs if not run.ends_collide]
    solved = [run for run in valid if run.first is not None]

    def spread(of: Sequence[Run], seconds: Callable[[Run], float]) -> Spread:
        return Spread.of([seconds(run) * (1.0 if raw else run.scale) for run in of])

    return Summary(
        runs=len(valid),
        ends_collide=len(runs) - len(valid),
        solved=len(solved),
        first=spread(solved, lambda run: run.history[0][0]),
        with_preparation=spread(solved, lambda run: run.prepare + run.history[0][0]),
        prepare=spread(valid, lambda run: run.prepare),
        first_evaluations=Spread.of([float(run.first_evaluations or 0) for run in solved]),
        first_length=mean([run.history[0][1] for run in solved]),
        straight=mean([run.straight for run in valid]),
        lengths=tuple(_length_by(solved, budget) for budget in BUDGETS),
        certified=sum(run.certified for run in valid),
        certificate=spread([run for run in valid if run.proofs], lambda run: run.certify / run.proofs),
        total=spread(valid, lambda run: run.seconds),
        proofs=(mean([run.proofs for run in valid]), max((run.proofs for run in valid), default=0)),
        plan_length=mean([run.length for run in valid if run.length is not None]),
        looked_at=sum(run.looked_at for run in valid),
        collisions=sum(run.collisions > 0 for run in valid),
    )


def _length_by(solved: Sequence[Run], budget: float) -> LengthBy:
    found = [run.length_by(budget) for run in solved]
    had = [length for length in found if length is not None]
    late = [run.history[0][1] for run, length in zip(solved, found, strict=True) if length is None]
    return LengthBy(solved=len(had), mean=mean(had), all=mean([*had, *late]))


# ---- targets -----------------------------------------------------------------------------------------------------------


def targets_of(benchmark: Benchmark) -> list[Target]:
    """Return the targets.

    Those of the Panda alone are of times on the reference core, and of lengths for this collection's straight motions.
    """
    all_runs = summary_of(benchmark.runs)
    share = all_runs.straight / FULL_SET_STRAIGHT
    by_seed = [summary_of([run for run in benchmark.runs if run.seed == seed]) for seed in range(benchmark.protocol.seeds)]
    certified = min((s.certified / s.runs for s in by_seed if s.runs), default=math.nan)
    found = Target(
        what=f"found and certified within {LIMIT:g} s, the worst seed",
        target=100,
        measured=100 * certified,
        unit="%",
        at_least=True,
    )
    collisions = Target(what="plans with a collision found afterwards", target=0, measured=all_runs.collisions, unit="")
    if benchmark.robot.group != PANDA:
        return [found, collisions]
    return [
        found,
        Target(what="first motion, median", target=0.15, measured=1e3 * all_runs.first.median, unit="ms"),
        Target(what="first motion, 95 in 100", target=1, measured=1e3 * all_runs.first.p95, unit="ms"),
        *(
            Target(
                what=f"length after {1e3 * budget:g} ms, mean",
                target=round(share * target, 3),
                measured=length.all,
                unit="rad",
            )
            for budget, target, length in zip(BUDGETS, LENGTH_TARGETS, all_runs.lengths, strict=True)
            if budget <= benchmark.protocol.search
        ),
        Target(what="one certificate, median", target=20, measured=1e3 * all_runs.certificate.median, unit="ms"),
        collisions,
    ]


def lengths_over_time(runs: Sequence[Run], times: Sequence[float]) -> Array:
    """Return the mean length after each of some times [s of the reference core], as `LengthBy.all` [rad]; it never rises."""
    solved = [run for run in runs if not run.ends_collide and run.first is not None]
    return np.array([_length_by(solved, t).all for t in times])


# ---- tables ----------------------------------------------------------------------------------------------------------


def tables(benchmark: Benchmark) -> list[Table]:
    """Return the tables: first motions, lengths, plans, targets."""
    return [
        _first_table(benchmark, raw=False),
        _first_table(benchmark, raw=True),
        _length_table(benchmark),
        _plan_table(benchmark, raw=False),
        _plan_table(benchmark, raw=True),
        _target_table(benchmark),
    ]


def notes(benchmark: Benchmark) -> list[str]:
    """Return what is to be known beside the tables: the core, the load, and every failure."""
    measured = speed_note([run.scale for run in benchmark.runs])
    out = [
        f"{measured}, measured before each family and seed; budgets are scaled likewise",
        machine_note(),
        load_note(benchmark.loads) or "load: not known",
        "clearance 0: a plan is asked not to touch anything, and no more, as are those of the planners it is compared with",
        "deterministic, the same on every machine: straight, evaluations and length of the first motion; the rest depends on "
        "time",
    ]
    out[:0] = [f"group '{benchmark.robot.group}' of {benchmark.robot.srdf.name}", *benchmark.notes]
    if benchmark.jobs > 1:
        out.append(f"measured {benchmark.jobs} at a time: the runs disturbed each other, and take longer than one at a time")
    missing = sorted({f"{run.family} {run.name}" for run in benchmark.runs if run.ends_collide})
    if missing:
        out.append(f"not counted, an end is in collision: {listed(missing, _MANY)}")
    failed = [f"{run.family} {run.name} seed {run.seed} ({_failure(run)})" for run in benchmark.valid if _failure(run)]
    out.append(f"failures: {listed(failed, _MANY)}" if failed else "failures: none")
    return out


def _failure(run: Run) -> str:
    if run.collisions:
        return f"another checker finds {run.collides} in collision"
    if run.status != "found":
        return run.status
    if not run.certified:
        return f"took {run.seconds * run.scale:.2f} s"
    return "" if run.first is not None else "the bare search found nothing"


def _grouped(benchmark: Benchmark, *, raw: bool = False) -> list[tuple[str, Summary]]:
    groups = [(name, [run for run in benchmark.runs if run.family == name]) for name in benchmark.families]
    return [(name, summary_of(runs, raw=raw)) for name, runs in [*groups, ("all", list(benchmark.runs))]]


def _core(*, raw: bool) -> str:
    return "ms as measured here" if raw else "ms of the reference core"


def _first_table(benchmark: Benchmark, *, raw: bool) -> Table:
    header = ("family", "runs", "solved", "first median", "p95", "max", "with preparation median", "p95", "evaluations median")
    rows = [
        (
            name,
            str(s.runs),
            str(s.solved),
            *(milliseconds(x, 3) for x in (s.first.median, s.first.p95, s.first.greatest)),
            *(milliseconds(x, 2) for x in (s.with_preparation.median, s.with_preparation.p95)),
            number(s.first_evaluations.median, 0),
        )
        for name, s in _grouped(benchmark, raw=raw)
    ]
    return Table(f"time to the first motion that the search holds free, {_core(raw=raw)}", header, rows)


def _length_table(benchmark: Benchmark) -> Table:
    header = ("family", "straight", "first")
    budgets = [(i, budget) for i, budget in enumerate(BUDGETS) if budget <= benchmark.protocol.search]
    for _, budget in budgets:
        header += (f"{1e3 * budget:g} ms: solved", "mean", "all")
    rows = []
    for name, s in _grouped(benchmark):
        cells = [name, number(s.straight, 3), number(s.first_length, 3)]
        for i, _ in budgets:
            cells += [f"{s.lengths[i].solved}/{s.runs}", number(s.lengths[i].mean, 3), number(s.lengths[i].all, 3)]
        rows.append(tuple(cells))
    title = (
        "joint path length [rad] after a time of search on the reference core; mean: of those solved by then; all: later "
        "ones with their first motion"
    )
    return Table(title, header, rows)


def _plan_table(benchmark: Benchmark, *, raw: bool) -> Table:
    header = ("family", "runs", "certified", "certificate median", "p95", "proofs mean", "most")
    header += ("total median", "p95", "max", "length", "collisions after")
    rows = [
        (
            name,
            str(s.runs),
            f"{s.certified} ({_share(s)})",
            *(milliseconds(x, 1) for x in (s.certificate.median, s.certificate.p95)),
            number(s.proofs[0], 2),
            str(s.proofs[1]),
            *(milliseconds(x, 0) for x in (s.total.median, s.total.p95, s.total.greatest)),
            number(s.plan_length, 3),
            str(s.collisions),
        )
        for name, s in _grouped(benchmark, raw=raw)
    ]
    title = (
        f"plan(), {1e3 * benchmark.protocol.plan:g} ms of search and the proof, more where nothing is proven; "
        f"certified within {LIMIT:g} s; {_core(raw=raw)}"
    )
    return Table(title, header, rows)


def _share(s: Summary) -> str:
    return f"{100 * s.certified / s.runs:.5g} %" if s.runs else "-"


def _target_table(benchmark: Benchmark) -> Table:
    straight = summary_of(benchmark.runs).straight
    if benchmark.robot.group != PANDA:
        title = f"targets of any arm; those of times and lengths are for the Panda's group '{PANDA}' alone"
        return target_table(title, targets_of(benchmark), digits=4)
    title = (
        f"targets; those of lengths were set on 699 problems whose straight motions measure {FULL_SET_STRAIGHT} rad, and are "
        f"scaled by this collection's {number(straight, 3)} rad"
    )
    return target_table(title, targets_of(benchmark), digits=4)


# ---- the figure ------------------------------------------------------------------------------------------------------


def figure_benchmark(benchmark: Benchmark, ax: Any = None) -> Figure:
    """Draw the mean length over the time of search, and the distribution of the time to the first motion, by family.

    Args:
        benchmark: what was measured.
        ax: 2 axes to draw in, as `figure.subplots(1, 2)` makes them; a new figure unless given.

    Raises:
        SettingsError: another number of axes, or matplotlib is not installed.
    """
    with look():
        cells = new_figure(PAGE, 2.8).subplots(1, 2) if ax is None else axes_given(ax, (1, 2), what="this figure")
        left, right = np.ravel(cells)
        _draw_lengths(left, benchmark)
        _draw_firsts(right, benchmark)
        return figure_of(left)


def _draw_lengths(ax: Axes, benchmark: Benchmark) -> None:
    longest = benchmark.protocol.search
    times = _times(benchmark)
    straight = summary_of(benchmark.runs).straight
    for seed in range(benchmark.protocol.seeds):
        length = lengths_over_time([run for run in benchmark.runs if run.seed == seed], times.tolist())
        ax.plot(1e3 * times, length, color=SKY, linewidth=0.6, alpha=0.7, label="one seed" if seed == 0 else None)
    ax.plot(1e3 * times, lengths_over_time(benchmark.runs, times.tolist()), color=BLUE, label="mean of all runs")
    reached = [(b, t * straight / FULL_SET_STRAIGHT) for b, t in zip(BUDGETS, LENGTH_TARGETS, strict=True) if b <= longest]
    if reached and benchmark.robot.group == PANDA:
        ax.plot(*zip(*[(1e3 * b, t) for b, t in reached], strict=True), "v", color=VERMILION, markersize=4, label="targets")
    ax.axhline(straight, color=GREY, linestyle=(0, (4, 2)), linewidth=0.8, label="straight: none is shorter")
    ax.set(xscale="log", xlabel="time of search on the reference core [ms]", ylabel="joint path length [rad]")
    tidy(ax)
    ax.legend(loc="upper right")
    _plain_ticks(ax)


def _draw_firsts(ax: Axes, benchmark: Benchmark) -> None:
    groups: list[tuple[str, Any]] = [(name, CYCLE[i % 6]) for i, name in enumerate(benchmark.families)]
    for place, (name, color) in enumerate([*groups, ("all", BLACK)]):
        runs = [run for run in benchmark.valid if name in ("all", run.family)]
        firsts = np.sort([1e3 * run.first * run.scale for run in runs if run.first is not None])
        share = 100 * np.arange(1, len(firsts) + 1) / max(len(runs), 1)
        dashed = (0, (3, 1)) if place >= 6 and name != "all" else "-"
        width = 1.5 if name == "all" else 0.9
        ax.step(np.maximum(firsts, 1e-3), share, where="post", color=color, linewidth=width, linestyle=dashed, label=name)
    if benchmark.robot.group == PANDA:
        ax.plot([0.15, 1.0], [50, 95], "v", color=VERMILION, markersize=4, label="targets", linestyle="none")
    ax.set(xscale="log", ylim=(0, 101), xlabel="time to the first motion on the reference core [ms]", ylabel="solved [%]")
    tidy(ax)
    ax.legend(loc="lower right")
    _plain_ticks(ax)


def _plain_ticks(ax: Axes) -> None:
    from matplotlib.ticker import FuncFormatter

    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


# ---- files -------------------------------------------------------------------------------------------------------------


def report_as_dict(benchmark: Benchmark) -> dict[str, Any]:
    """Return the report as plain values: protocol, machine, summaries, targets, and every run."""
    summaries = {name: plain(asdict(s)) for name, s in _grouped(benchmark)}
    return {
        "spacearm-bench-mbm": 1,
        "version": version(),
        "machine": machine(),
        "reference_seconds_per_configuration": REFERENCE,
        "protocol": asdict(benchmark.protocol) | {"limit": LIMIT, "threads": 1, "recheck_step_rad": STEP},
        "robot": {"urdf": str(benchmark.robot.urdf), "srdf": str(benchmark.robot.srdf), "group": benchmark.robot.group},
        "notes": list(benchmark.notes),
        "loads": plain(list(benchmark.loads)),
        "seconds": benchmark.seconds,
        "deterministic": ["straight", "first_evaluations", "the first length in history"],
        "targets": [plain(asdict(t) | {"met": t.met}) for t in targets_of(benchmark)],
        "summaries": summaries,
        "summaries_raw": {name: plain(asdict(s)) for name, s in _grouped(benchmark, raw=True)},
        "runs": [plain(asdict(run)) for run in benchmark.runs],
    }


def save_report(
    benchmark: Benchmark,
    folder: str | os.PathLike[str],
    *,
    items: Sequence[Item] = (),
    figures: bool = False,
    progress: Progress | None = None,
) -> list[Path]:
    """Write report.html, report.json and tables.md into a folder; return what was written.

    Args:
        benchmark: what was measured.
        folder: where.
        items: the problems; some of them are planned once more, for the page.
        figures: also draw lengths and first motions over time with matplotlib.
        progress: called with the plans made, those in all, and what is being planned.

    Raises:
        OutputError: the folder cannot be written.
        SettingsError: figures without matplotlib.
        KeyboardInterrupt: Ctrl-C.
    """
    if figures:
        require_extra("matplotlib", "drawing figures", instead="leave the figures out: report.html needs no library")
    target = Path(folder)
    page, report, text = target / "report.html", target / "report.json", target / "tables.md"
    write_new(report, json.dumps(report_as_dict(benchmark), allow_nan=False) + "\n")
    write_new(text, as_markdown(benchmark))
    known = tables(benchmark), notes(benchmark), _verdict(benchmark), _lengths_by_seed(benchmark)
    write_report(mbm_page(benchmark, *known, items, progress=progress), page)
    if not figures:
        return [page, report, text]
    from spacearm.show.figure_style import save_figure

    provenance = {"Title": "spacearm bench mbm", "Author": f"spacearm {version()}"}
    with unbroken():
        drawn = figure_benchmark(benchmark)
    return [page, report, text, *save_figure(drawn, target / "benchmark", provenance=provenance)]


def _verdict(benchmark: Benchmark) -> dict[str, Any]:
    s = summary_of(benchmark.runs)
    text = (
        f"The search holds a first motion free after {milliseconds(s.first.median, 2)} ms in the median, and after at "
        f"most {milliseconds(s.first.p95, 2)} ms in 95 of 100 runs, on the reference core. Another checker finds a collision "
        f"in {s.collisions} of the plans."
    )
    good = s.certified == s.runs and not s.collisions
    headline = f"{s.certified} of {s.runs} runs found and certified within {LIMIT:g} s"
    return verdict("good" if good else "bad" if s.collisions else "plain", headline, text)


def _lengths_by_seed(benchmark: Benchmark) -> tuple[Array, dict[str, Array]]:
    times = _times(benchmark)
    groups = {f"seed {seed}": [run for run in benchmark.runs if run.seed == seed] for seed in range(benchmark.protocol.seeds)}
    groups = (groups if len(groups) > 1 else {}) | {"all": list(benchmark.runs)}
    return times, {name: lengths_over_time(runs, times.tolist()) for name, runs in groups.items()}


def _times(benchmark: Benchmark) -> Array:
    """Return times of search at which lengths are told [s of the reference core]."""
    return np.geomspace(3e-5, max(benchmark.protocol.search, 1e-4), 120)


def as_markdown(benchmark: Benchmark) -> str:
    """Return tables and notes as markdown."""
    return markdown(tables(benchmark), notes(benchmark))
