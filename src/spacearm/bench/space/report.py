"""SpaceBench's report: tables for people, report.json for machines, a figure."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from spacearm.bench.report import Table
from spacearm.bench.space.collection import SpaceProblem
from spacearm.bench.space.figure import figure_families, figure_spacebench
from spacearm.bench.space.run import SpaceBench
from spacearm.bench.space.summary import SpaceSummary, summary_of, targets_of
from spacearm.bench.written import markdown, plain
from spacearm.bench.yardstick import REFERENCE, machine
from spacearm.interrupts import unbroken
from spacearm.output import write_new
from spacearm.version import version

_MANY = 8  # failures listed before it would no longer be read


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
    loads = [load for load in bench.loads if not math.isnan(load)]
    out = ["machine: " + ", ".join(f"{key} {value}" for key, value in machine().items())]
    if scales:
        least, most = (1e6 * REFERENCE / scale for scale in (max(scales), min(scales)))
        out.insert(
            0,
            f"times are stated for a core on which the NumPy kernel takes {1e6 * REFERENCE:g} us a configuration; here it took "
            f"{least:.2f} to {most:.2f} us",
        )
    if loads:
        out.append(f"load: {min(loads):.1f} to {max(loads):.1f} processes")
    limit = bench.protocol.limit
    failed = [f"{run.name} seed {run.seed} ({run.status})" for run in bench.runs if not run.solved_within(limit)]
    failed += [f"{run.what} seed {run.seed} ({run.status})" for run in bench.published if run.status != "found"]
    more = f" and {len(failed) - _MANY} more, all in report.json" if len(failed) > _MANY else ""
    out.append(f"not solved: {', '.join(failed[:_MANY])}{more}" if failed else "not solved: none")
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
            f"{s.solved} ({_percent(s.solved / s.runs)})",
            *(_ms(x) for x in (s.first.median, s.first.p95, s.search, s.certify)),
            *(_number(x, 2) for x in (s.length, s.straight, s.known_length)),
            *(_degrees(x) for x in (s.peak.median, s.peak.greatest)),
        )
        for name, s in grouped(bench)
    ]
    title = (
        f"the base floats: solved within {bench.protocol.limit:g} s; time to the first certified motion [ms of the reference "
        "core]; mean joint path length [rad]; the base's greatest angle [deg]"
    )
    return title, header, rows


def _let_go_table(bench: SpaceBench) -> Table:
    header = ("family", "motions", "collide", "miss the goal", "disturb the base", "hold", "tip misses its goal by, median")
    rows = [
        (
            name,
            str(s.fixed),
            *(_percent(share) for share in s.let_go.values()),
            "-" if math.isnan(s.missed_by) else f"{1e3 * s.missed_by:.0f} mm",
        )
        for name, s in sorted_outcomes(grouped(bench))
    ]
    title = "planned and proven for a fixed base, then the base is let go: share of the motions that then"
    return title, header, rows


def sorted_outcomes(groups: list[tuple[str, SpaceSummary]]) -> list[tuple[str, SpaceSummary]]:
    """Return the groups that have such motions."""
    return [(name, s) for name, s in groups if s.fixed]


def _target_table(bench: SpaceBench) -> Table:
    rows = [
        (
            t.what,
            f"{'>=' if t.at_least else '<='} {t.target:g} {t.unit}",
            f"{t.measured:.3g} {t.unit}",
            "yes" if t.met else "no",
        )
        for t in targets_of(bench)
    ]
    return (
        "published problems, to the first certified motion, on the reference core",
        ("what", "target", "measured", "met"),
        rows,
    )


def _percent(share: float) -> str:
    if math.isnan(share):
        return "-"
    return f"{100 * share:.1f} %" if 0.99 < share < 1 else f"{100 * share:.0f} %"


def _ms(seconds: float) -> str:
    return _number(1e3 * seconds, 0)


def _degrees(angle: float) -> str:
    return _number(math.degrees(angle), 1)


def _number(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


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
    bench: SpaceBench, folder: str | os.PathLike[str], *, items: Sequence[SpaceProblem] = (), figure: bool = True
) -> list[Path]:
    """Write report.json, tables.md and the figures into a folder; return what was written.

    Args:
        bench: what was measured.
        folder: where.
        items: the problems; one of each family is drawn.
        figure: whether any figure is drawn.

    Raises:
        OutputError: the folder cannot be written.
    """
    target = Path(folder)
    report, text = target / "report.json", target / "tables.md"
    write_new(report, json.dumps(report_as_dict(bench), allow_nan=False) + "\n")
    write_new(text, as_markdown(bench))
    if not figure or not bench.runs:
        return [report, text]
    from spacearm.show.save import save_figure

    provenance = {"Title": "spacearm bench space", "Author": f"spacearm {version()}"}
    with unbroken():
        drawn = figure_spacebench(bench)
    written = [report, text, *save_figure(drawn, target / "spacebench", provenance=provenance)]
    if items:
        with unbroken():
            drawn = figure_families(items)
        written += save_figure(drawn, target / "families", provenance=provenance)
    return written


def as_markdown(bench: SpaceBench) -> str:
    """Return tables and notes as markdown."""
    return markdown(tables(bench), notes(bench))
