"""A benchmark's report: tables for people, report.json for machines, a figure."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from spacearm.bench.figure import figure_benchmark
from spacearm.bench.mbm import Benchmark
from spacearm.bench.measure import LIMIT, Run
from spacearm.bench.recheck import STEP
from spacearm.bench.summary import BUDGETS, FULL_SET_STRAIGHT, Summary, Target, summary_of, targets_of
from spacearm.bench.written import markdown, plain
from spacearm.bench.yardstick import REFERENCE, machine
from spacearm.interrupts import unbroken
from spacearm.output import write_new
from spacearm.version import version

Table = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""Title, header, rows."""

_MANY = 5  # failures listed before it would no longer be read


def tables(benchmark: Benchmark) -> list[Table]:
    """Return the tables: first motions, lengths, plans, targets."""
    return [
        _first_table(benchmark, raw=False),
        _first_table(benchmark, raw=True),
        _length_table(benchmark),
        _plan_table(benchmark, raw=False),
        _plan_table(benchmark, raw=True),
        _target_table(targets_of(benchmark), benchmark),
    ]


def notes(benchmark: Benchmark) -> list[str]:
    """Return what is to be known beside the tables: the core, the load, and every failure."""
    scales = [run.scale for run in benchmark.runs]
    least, most = (1e6 * REFERENCE / scale for scale in (max(scales), min(scales)))
    loads = [load for load in benchmark.loads if not math.isnan(load)]
    out = [
        f"times are stated for a core on which the NumPy kernel takes {1e6 * REFERENCE:g} us a configuration; here it took "
        f"{least:.2f} to {most:.2f} us, measured before each family and seed; budgets are scaled likewise",
        "machine: " + ", ".join(f"{key} {value}" for key, value in machine().items()),
        f"load: {min(loads):.1f} to {max(loads):.1f} processes" if loads else "load: not known",
        "deterministic, the same on every machine: straight, evaluations and length of the first motion; the rest depends on "
        "time",
    ]
    missing = sorted({f"{run.family} {run.name}" for run in benchmark.runs if run.ends_collide})
    if missing:
        out.append(f"not counted, an end is in collision: {_listed(missing)}")
    failed = [f"{run.family} {run.name} seed {run.seed} ({_failure(run)})" for run in benchmark.valid if _failure(run)]
    out.append(f"failures: {_listed(failed)}" if failed else "failures: none")
    return out


def _failure(run: Run) -> str:
    if run.collisions:
        return f"another checker finds {run.collides} in collision"
    if run.status != "found":
        return run.status
    if not run.certified:
        return f"took {run.seconds * run.scale:.2f} s"
    return "" if run.first is not None else "the bare search found nothing"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MANY} more, all in report.json" if len(names) > _MANY else ""
    return ", ".join(names[:_MANY]) + more


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
            *(_ms(x, 3) for x in (s.first.median, s.first.p95, s.first.greatest)),
            *(_ms(x, 2) for x in (s.with_preparation.median, s.with_preparation.p95)),
            _number(s.first_evaluations.median, 0),
        )
        for name, s in _grouped(benchmark, raw=raw)
    ]
    return f"time to the first motion that the search holds free, {_core(raw=raw)}", header, rows


def _length_table(benchmark: Benchmark) -> Table:
    header = ("family", "straight", "first")
    budgets = [(i, budget) for i, budget in enumerate(BUDGETS) if budget <= benchmark.protocol.search]
    for _, budget in budgets:
        header += (f"{1e3 * budget:g} ms: solved", "mean", "all")
    rows = []
    for name, s in _grouped(benchmark):
        cells = [name, _number(s.straight, 3), _number(s.first_length, 3)]
        for i, _ in budgets:
            cells += [f"{s.lengths[i].solved}/{s.runs}", _number(s.lengths[i].mean, 3), _number(s.lengths[i].all, 3)]
        rows.append(tuple(cells))
    title = (
        "joint path length [rad] after so many ms of search on the reference core; mean: of those solved by then; all: later "
        "ones with their first motion"
    )
    return title, header, rows


def _plan_table(benchmark: Benchmark, *, raw: bool) -> Table:
    header = ("family", "runs", "certified", "certificate median", "p95", "proofs mean", "most")
    header += ("total median", "p95", "max", "length", "collisions after")
    rows = [
        (
            name,
            str(s.runs),
            f"{s.certified} ({_share(s)})",
            *(_ms(x, 1) for x in (s.certificate.median, s.certificate.p95)),
            _number(s.proofs[0], 2),
            str(s.proofs[1]),
            *(_ms(x, 0) for x in (s.total.median, s.total.p95, s.total.greatest)),
            _number(s.plan_length, 3),
            str(s.collisions),
        )
        for name, s in _grouped(benchmark, raw=raw)
    ]
    title = (
        f"plan(), {1e3 * benchmark.protocol.plan:g} ms of search and the proof; certified within {LIMIT:g} s; {_core(raw=raw)}"
    )
    return title, header, rows


def _share(s: Summary) -> str:
    return f"{100 * s.certified / s.runs:.5g} %" if s.runs else "-"


def _target_table(targets: Sequence[Target], benchmark: Benchmark) -> Table:
    rows = [
        (t.what, f"{'>=' if t.at_least else '<='} {t.target:g} {t.unit}".strip(), _measured(t), "yes" if t.met else "no")
        for t in targets
    ]
    straight = summary_of(benchmark.runs).straight
    title = (
        f"targets; those of lengths were set on 699 problems whose straight motions measure {FULL_SET_STRAIGHT} rad, and are "
        f"scaled by this collection's {_number(straight, 3)} rad"
    )
    return title, ("what", "target", "measured", "met"), rows


def _measured(target: Target) -> str:
    return f"{target.measured:.4g} {target.unit}".strip()


def _ms(seconds: float, digits: int) -> str:
    return _number(1e3 * seconds, digits)


def _number(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


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
        "loads": plain(list(benchmark.loads)),
        "seconds": benchmark.seconds,
        "deterministic": ["straight", "first_evaluations", "the first length in history"],
        "targets": [plain(asdict(t) | {"met": t.met}) for t in targets_of(benchmark)],
        "summaries": summaries,
        "summaries_raw": {name: plain(asdict(s)) for name, s in _grouped(benchmark, raw=True)},
        "runs": [plain(asdict(run)) for run in benchmark.runs],
    }


def save_report(benchmark: Benchmark, folder: str | os.PathLike[str], *, figure: bool = True) -> list[Path]:
    """Write report.json, tables.md and the figure into a folder; return what was written.

    Raises:
        OutputError: the folder cannot be written.
    """
    target = Path(folder)
    report, text = target / "report.json", target / "tables.md"
    write_new(report, json.dumps(report_as_dict(benchmark), allow_nan=False) + "\n")
    write_new(text, as_markdown(benchmark))
    if not figure:
        return [report, text]
    from spacearm.show.save import save_figure

    provenance = {"Title": "spacearm bench mbm", "Author": f"spacearm {version()}"}
    with unbroken():
        drawn = figure_benchmark(benchmark)
    return [report, text, *save_figure(drawn, target / "benchmark", provenance=provenance)]


def as_markdown(benchmark: Benchmark) -> str:
    """Return tables and notes as markdown."""
    return markdown(tables(benchmark), notes(benchmark))
