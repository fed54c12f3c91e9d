"""SpaceBench's report from its runs: a page and tables for people, report.json for machines, figures if asked for."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spacearm.core.extras import require_extra
from spacearm.core.interrupts import unbroken
from spacearm.core.output import write_new
from spacearm.core.version import version
from spacearm.report.report_page import write_report
from spacearm.report.report_views import verdict
from spacearm.show.figure_style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    PAGE,
    PURPLE,
    VERMILION,
    figure_of,
    look,
    new_figure,
    tidy,
)
from spacearm.show.motion_shown import axes_given
from spacearm.study.bench_pages import Progress, space_page
from spacearm.study.reference_core import REFERENCE, load_note, machine, machine_note, speed_note
from spacearm.study.spacebench import PUBLISHED_ROTATION, SpaceProblem
from spacearm.study.spacebench_families import FAMILIES
from spacearm.study.spacebench_runs import LEAST_PEAK, PAPERS_SCENE, SERVICER, Outcome, PublishedRun, Run, SpaceBench
from spacearm.study.statistics import Spread, Target, mean, median, share, target_table
from spacearm.study.study_tables import Table, degrees, listed, markdown, milliseconds, number, percent, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MANY = 8  # failures listed before it would no longer be read

OUTCOMES: tuple[Outcome, ...] = ("collides", "comes too near", "misses its goal", "disturbs the base", "holds")
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
        let_go: share of the motions planned for a fixed base, by what becomes of them when the base is free to move; NaN
            without any.
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
        search=median([run.search * run.scale for run in solved]),
        certify=median([run.certify * run.scale for run in solved]),
        length=mean([run.length for run in solved if run.length is not None]),
        straight=mean([run.straight for run in solved if run.straight is not None]),
        known_length=mean([run.known_length for run in runs]),
        peak=Spread.of([run.peak for run in solved if run.peak is not None]),
        let_go={what: share(fixed, lambda run, what=what: run.let_go == what) for what in OUTCOMES},
        fixed=len(fixed),
        missed_by=median(missed),
    )


def targets_of(bench: SpaceBench) -> list[Target]:
    """Return the published problems' targets; none if they were not run."""
    servicer, calm, papers = (_of(bench, what) for what in (SERVICER, LEAST_PEAK, PAPERS_SCENE))
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
    if papers:
        done = [run.seconds * run.scale for run in papers if run.status == "found"]
        out.append(_target("the paper's scene: certified", 100, 100 * len(done) / len(papers), "% of seeds", at_least=True))
        out.append(_target("the paper's scene: first certified motion, median", 50, 1e3 * median(done), "ms"))
    return out


def _target(what: str, target: float, measured: float, unit: str, *, at_least: bool = False) -> Target:
    return Target(what=what, target=target, measured=measured, unit=unit, at_least=at_least)


def _of(bench: SpaceBench, what: str) -> list[PublishedRun]:
    return [run for run in bench.published if run.what == what]


def _all(runs: Sequence[PublishedRun], name: str) -> list[float]:
    return [value for value in (getattr(run, name) for run in runs) if value is not None]


# ---- tables ----------------------------------------------------------------------------------------------------------


def tables(bench: SpaceBench) -> list[Table]:
    """Return the tables: what was planned, what becomes of fixed-base motions, published problems."""
    out: list[Table] = []
    if bench.runs:
        out += [_plan_table(bench), _let_go_table(bench)]
    if bench.published:
        out.append(_target_table(bench))
    return out


def notes(bench: SpaceBench) -> list[str]:
    """Return what is to be known beside the tables: the core, the load, and every failure."""
    scales = [run.scale for run in (*bench.runs, *bench.published)]
    out = [speed_note(scales)] if scales else []
    out.append(machine_note())
    if load := load_note(bench.loads):
        out.append(load)
    if bench.jobs > 1:
        out.append(f"measured {bench.jobs} at a time: the runs disturbed each other, and take longer than one at a time")
    if asked := sorted({1e3 * run.clearance for run in bench.runs}):
        out.append(f"clearance asked for: {' or '.join(f'{value:g}' for value in asked)} mm; 0 in the published problems")
    limit = bench.protocol.limit
    failed = [f"{run.name} seed {run.seed} ({run.status})" for run in bench.runs if not run.solved_within(limit)]
    failed += [f"{run.what} seed {run.seed} ({run.status})" for run in bench.published if run.status != "found"]
    out.append(f"not solved: {listed(failed, _MANY)}" if failed else "not solved: none")
    return out


def grouped(bench: SpaceBench) -> list[tuple[str, SpaceSummary]]:
    """Return the summary of each family, and of all."""
    groups = [(name, [run for run in bench.runs if run.family == name]) for name in bench.families]
    return [(name, summary_of(runs, bench.protocol.limit)) for name, runs in [*groups, ("all", list(bench.runs))]]


def _plan_table(bench: SpaceBench) -> Table:
    header = ("family", "runs", "solved", "median", "p95", "of it search", "proof")
    header += ("length", "straight", "known", "base peak median", "max")
    rows = [
        (
            name,
            str(s.runs),
            f"{s.solved} ({percent(s.solved / s.runs)})",
            *(milliseconds(x) for x in (s.first.median, s.first.p95, s.search, s.certify)),
            *(number(x, 2) for x in (s.length, s.straight, s.known_length)),
            *(degrees(x) for x in (s.peak.median, s.peak.greatest)),
        )
        for name, s in grouped(bench)
    ]
    title = (
        f"the base floats: solved within {bench.protocol.limit:g} s; time to the first certified motion [ms of the reference "
        "core]; mean joint path length [rad]; the base's greatest angle [deg]"
    )
    return Table(title, header, rows)


def _let_go_table(bench: SpaceBench) -> Table:
    header = ("family", "motions", "collide", "come too near", "miss the goal", "disturb the base", "hold")
    header += ("tip misses its goal by, median",)
    rows = [
        (
            name,
            str(s.fixed),
            *(percent(share) for share in s.let_go.values()),
            "-" if math.isnan(s.missed_by) else f"{1e3 * s.missed_by:.0f} mm",
        )
        for name, s in sorted_outcomes(grouped(bench))
    ]
    title = "planned and proven for a fixed base, then certified for a floating base: share of the motions that then"
    return Table(title, header, rows)


def sorted_outcomes(groups: list[tuple[str, SpaceSummary]]) -> list[tuple[str, SpaceSummary]]:
    """Return the groups that have such motions."""
    return [(name, s) for name, s in groups if s.fixed]


def _target_table(bench: SpaceBench) -> Table:
    return target_table("published problems, to the first certified motion, on the reference core", targets_of(bench), digits=3)


# ---- the figures -----------------------------------------------------------------------------------------------------


_COLORS = dict(zip(OUTCOMES, (VERMILION, PURPLE, ORANGE, LIGHT, GREEN), strict=True))


def figure_spacebench(bench: SpaceBench, ax: Any = None) -> Figure:
    """Draw the fate of the motions planned for a fixed base, by family, and the greatest angles of the base.

    Args:
        bench: what was measured.
        ax: 2 axes to draw in, as `figure.subplots(1, 2)` makes them; a new figure unless given.

    Raises:
        SettingsError: another number of axes, or matplotlib is not installed.
    """
    with look():
        cells = new_figure(PAGE, 2.8).subplots(1, 2) if ax is None else axes_given(ax, (1, 2), what="this figure")
        left, right = np.ravel(cells)
        _draw_let_go(left, bench)
        _draw_peaks(right, bench)
        return figure_of(left)


def _draw_let_go(ax: Axes, bench: SpaceBench) -> None:
    groups = [*bench.families, "all"]
    summaries = [
        summary_of([run for run in bench.runs if name in ("all", run.family)], bench.protocol.limit) for name in groups
    ]
    below = np.zeros(len(groups))
    for what, color in _COLORS.items():
        share = np.array([100 * np.nan_to_num(s.let_go[what]) for s in summaries])
        ax.bar(groups, share, bottom=below, color=color, width=0.7, label=what)
        for i, (height, base) in enumerate(zip(share, below, strict=True)):
            if height >= 6:
                pale = what in ("disturbs the base", "misses its goal")
                ax.text(i, base + height / 2, f"{height:.0f}", ha="center", va="center", color=BLACK if pale else "white")
        below += share
    ax.set(ylim=(0, 100), ylabel="motions planned for a fixed base [%]", title="on a floating base, the motion")
    tidy(ax)
    ax.legend(ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.12))


def _draw_peaks(ax: Axes, bench: SpaceBench) -> None:
    rng = np.random.default_rng(0)  # spreads the points sideways, so that they can be told apart
    for i, name in enumerate(bench.families):
        peaks = [math.degrees(run.peak) for run in bench.runs if run.family == name and run.peak is not None]
        if not peaks:
            continue
        ax.plot(i + rng.uniform(-0.25, 0.25, len(peaks)), peaks, "o", color=BLUE, markersize=2.2, alpha=0.6)
        ax.hlines(float(np.median(peaks)), i - 0.33, i + 0.33, color=BLACK, linewidth=1.2)
    ax.set_xticks(range(len(bench.families)), bench.families)
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set(ylim=(0, None), ylabel="greatest angle of the base [deg]", title="motions planned with the base free")
    tidy(ax)


def figure_families(items: Sequence[SpaceProblem]) -> Figure:
    """Draw a problem of each family with its known solution: the first in the list."""
    from spacearm.planner import PoseGoal, PositionGoal
    from spacearm.show.path_figures import figure_path_3d

    firsts = {item.family: item for item in reversed(items)}
    shown = sorted(firsts.values(), key=lambda item: list(FAMILIES).index(item.family))
    with look():
        figure = new_figure(PAGE, 1.9, layout=None)
        for i, item in enumerate(shown):
            left, width = i / len(shown) - 0.03, 1 / len(shown) + 0.06  # the drawing leaves room around it
            ax = figure.add_axes((left, -0.13, width, 1.13), projection="3d", computed_zorder=False)
            problem, goal = item.problem, item.problem.goal
            place = goal.position if isinstance(goal, (PositionGoal, PoseGoal)) else None
            figure_path_3d(
                item.solution,
                robot=problem.robot,
                scene=problem.scene,
                start=problem.start,
                goal=place,
                ax=ax,
                view=_from_beside(item),
            )
            ax.set_axis_off()
            ax.patch.set_visible(False)  # what reaches over from the neighbour is not painted over
            legend = ax.get_legend()
            if legend is not None:
                legend.remove()
            figure.text((i + 0.5) / len(shown), 0.94, item.name, ha="center", fontsize=8)
        return figure


def _from_beside(item: SpaceProblem) -> tuple[float, float]:
    """Return elevation and azimuth [deg] of an eye that looks at arm and obstacles from the side."""
    tip = item.solution.tip(item.solution.duration)[:3, 3]
    away = tip - item.problem.base_start[:3, 3]
    return 25.0, math.degrees(math.atan2(away[1], away[0])) - 110.0


# ---- files -------------------------------------------------------------------------------------------------------------


def report_as_dict(bench: SpaceBench) -> dict[str, Any]:
    """Return the report as plain values: protocol, machine, summaries, targets, and every run."""
    return {
        "spacearm-bench-space": 1,
        "version": version(),
        "machine": machine(),
        "reference_seconds_per_configuration": REFERENCE,
        "protocol": asdict(bench.protocol) | {"threads": 1},
        "loads": plain(list(bench.loads)),
        "seconds": bench.seconds,
        "summaries": {name: plain(asdict(s)) for name, s in grouped(bench)} if bench.runs else {},
        "targets": [plain(asdict(t) | {"met": bool(t.met)}) for t in targets_of(bench)],
        "published": [plain(asdict(run)) for run in bench.published],
        "runs": [plain(asdict(run)) for run in bench.runs],
    }


def save_report(
    bench: SpaceBench,
    folder: str | os.PathLike[str],
    *,
    items: Sequence[SpaceProblem] = (),
    figures: bool = False,
    progress: Progress | None = None,
) -> list[Path]:
    """Write report.html, report.json and tables.md into a folder; return what was written.

    Args:
        bench: what was measured.
        folder: where.
        items: the problems; some of them are planned once more, for the page.
        figures: also draw, with matplotlib, a problem of each family, how fixed-base motions end, and how far bases turn.
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
    write_new(report, json.dumps(report_as_dict(bench), allow_nan=False) + "\n")
    write_new(text, as_markdown(bench))
    write_report(space_page(bench, tables(bench), notes(bench), _verdict(bench), items, progress=progress), page)
    if not figures or not bench.runs:
        return [page, report, text]
    from spacearm.show.figure_style import save_figure

    provenance = {"Title": "spacearm bench space", "Author": f"spacearm {version()}"}
    with unbroken():
        drawn = figure_spacebench(bench)
    written = [page, report, text, *save_figure(drawn, target / "spacebench", provenance=provenance)]
    if items:
        with unbroken():
            drawn = figure_families(items)
        written += save_figure(drawn, target / "families", provenance=provenance)
    return written


def _verdict(bench: SpaceBench) -> dict[str, Any]:
    if not bench.runs:
        met = sum(target.met for target in targets_of(bench))
        return verdict("plain", f"{met} of {len(targets_of(bench))} targets of the published problems are met")
    s = summary_of(bench.runs, bench.protocol.limit)
    text = (
        f"The first certified motion takes {milliseconds(s.first.median)} ms in the median, and at most "
        f"{milliseconds(s.first.p95)} ms in 95 of 100 runs, on the reference core."
    )
    if s.fixed:
        text += f" Of {s.fixed} motions planned for a fixed base, {percent(s.let_go['collides'])} collide when the base floats."
    headline = f"{s.solved} of {s.runs} runs solved within {bench.protocol.limit:g} s"
    return verdict("good" if s.solved == s.runs else "plain", headline, text)


def as_markdown(bench: SpaceBench) -> str:
    """Return tables and notes as markdown."""
    return markdown(tables(bench), notes(bench))
