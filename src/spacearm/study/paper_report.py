"""The experiment's report: tables for people, report.json for machines.

report.json holds every setting, declared reading, seed and version, and each run's numbers. It holds no time and no
date: the same settings and seed give the same bytes. What it took is in timings.json.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.core.native import kernel_info
from spacearm.core.output import make_new_folder, write_new
from spacearm.core.records import as_dict
from spacearm.core.version import version
from spacearm.study.paper_experiment import Experiment, MethodRuns
from spacearm.study.paper_figures import save_figures
from spacearm.study.paper_problem import (
    GOAL_POSITION,
    NEAR,
    OBSTACLE_CENTERS,
    REPORTED,
    REPORTED_FOR,
    START_POSITION,
    THRESHOLD,
)
from spacearm.study.paper_readings import READINGS
from spacearm.study.study_tables import Table, markdown
from spacearm.swarm import SwarmResult

_PAPER = (
    "J. Zhang, J. Zhang, Q. Zhang, X. Wei, Obstacle Avoidance Path Planning of Space Robot Based on Improved Particle "
    "Swarm Optimization, Symmetry 2022, 14(5), 938, doi 10.3390/sym14050938"
)

HEADER = ("method", "worst", "best", "mean", f"to {THRESHOLD}", f"within {NEAR:.0%}", "feasible", "p", "planned path")
LEGEND = (
    "worst, best, mean: F, eq. (4), of the feasible runs",
    f"to {THRESHOLD}: share of all runs that are feasible and reach the paper's threshold",
    f"within {NEAR:.0%}: share of all runs that are feasible and that near to the best known value",
    "p: of the rank-sum test against the first method",
    "planned path: to the best run's configuration; proven is free of collision at every instant",
)


def table_rows(experiment: Experiment) -> list[Table]:
    """Return Table 3 for each mode and radius, the paper's rows last: (title, header, rows)."""
    tables = []
    for (mode, radius), (best_known, found_by) in experiment.best_known.items():
        cells = [cell for cell in experiment.cells if (cell.mode, cell.radius) == (mode, radius)]
        rows = [_row(cell) for cell in cells]
        if mode == "goal":
            rows += [
                (
                    f"paper: {name.upper()}",
                    f"{r.worst:.4f}",
                    f"{r.best:.4f}",
                    f"{r.mean:.4f}",
                    f"{r.threshold_share:.0%}",
                    *[""] * 4,
                )
                for name, r in REPORTED.items()
            ]
        runs = experiment.settings.runs
        title = f"Table 3, {mode} mode, A_R = {radius:g} m, {runs} run{'s' if runs > 1 else ''} of each method"
        known = f"best known {best_known:.5f}: {found_by}" if best_known is not None else f"no best known value: {found_by}"
        tables.append(Table(f"{title}; {known}", HEADER, rows))
    return tables


def path_notes(experiment: Experiment) -> list[str]:
    """Tell why a cell has no proven path, a line for each reason."""
    reasons: dict[str, list[str]] = {}
    for cell in experiment.cells:
        if cell.path is None or not cell.path.found:
            where = f"{cell.method} ({cell.mode}, A_R {cell.radius:g} m)"
            reasons.setdefault(cell.path_note, []).append(where)
    return [f"no proven path for {', '.join(cells)}: {note}" for note, cells in reasons.items()]


def _row(cell: MethodRuns) -> tuple[str, ...]:
    s = cell.summary
    path = "none" if cell.path is None else "proven" if cell.path.found else "not proven"
    return (
        cell.method,
        *(f"{value:.4f}" if math.isfinite(value) else "-" for value in (s.worst, s.best, s.mean)),
        f"{s.threshold_share:.0%}",
        f"{s.near_share:.0%}",
        f"{s.feasible_share:.0%}",
        "" if s.p_value is None else f"{s.p_value:.2g}",
        path,
    )


def report_as_dict(experiment: Experiment) -> dict[str, Any]:
    """Return the report as plain values: no times, no dates."""
    settings = as_dict(experiment.settings)
    settings.pop("threads")  # the numbers do not depend on it
    return {
        "spacearm-paper": 1,
        "version": version(),
        "numbers": "IEEE float64; the same bits on every instruction level and any number of threads",
        "paper": _PAPER,
        "settings": settings,
        "readings": [{"open": r.open, "reading": r.reading, "why": r.why} for r in READINGS],
        "scene": {
            "robot": "zhang2022",
            "obstacle_centers_m": [list(c) for c in OBSTACLE_CENTERS],
            "start_position_m": list(START_POSITION),
            "goal_position_m": list(GOAL_POSITION),
        },
        "threshold": THRESHOLD,
        "near": NEAR,
        "reported": {
            name: {"worst": r.worst, "best": r.best, "mean": r.mean, "threshold_share": r.threshold_share}
            for name, r in REPORTED.items()
        },
        "best_known": [
            {"mode": mode, "radius_m": radius, "value": value, "found_by": found_by}
            for (mode, radius), (value, found_by) in experiment.best_known.items()
        ],
        "cells": [_cell_as_dict(cell) for cell in experiment.cells],
    }


def _cell_as_dict(cell: MethodRuns) -> dict[str, Any]:
    s = cell.summary
    return {
        "method": cell.method,
        "mode": cell.mode,
        "radius_m": cell.radius,
        "stands_beside": REPORTED_FOR.get(cell.method),
        "swarm": {"kind": type(cell.settings).__name__, **as_dict(cell.settings)},
        "summary": {
            "worst": _number(s.worst),
            "best": _number(s.best),
            "mean": _number(s.mean),
            "threshold_share": s.threshold_share,
            "near_share": s.near_share,
            "feasible_share": s.feasible_share,
            "rank_sum_p": s.p_value,
        },
        "runs": [_run_as_dict(run) for run in cell.runs],
        "path": None if cell.path is None else cell.path.values,
        "path_note": cell.path_note,
    }


def _run_as_dict(run: SwarmResult) -> dict[str, Any]:
    return {
        "seed": run.seed,
        "trial": run.trial,
        "status": run.status,
        "fitness": _number(run.fitness),
        "violation": _number(run.violation),
        "q": run.x.tolist(),
        "iterations": run.iterations,
        "evaluations": run.evaluations,
        "fitness_history": run.history.fitness.tolist(),
        "violation_history": run.history.violation.tolist(),
    }


def _number(value: float) -> float | None:
    """JSON has no infinity and no NaN."""
    return value if math.isfinite(value) else None


def _text(experiment: Experiment) -> str:
    return markdown(table_rows(experiment), (*LEGEND, *path_notes(experiment)))


def save_report(
    experiment: Experiment,
    folder: str | os.PathLike[str],
    *,
    figures: bool = True,
    progress: Callable[[int, int, str], Any] | None = None,
) -> list[Path]:
    """Write report.json, table3.md, timings.json and the figures into a new or empty folder; return what was written.

    Raises:
        OutputError: the folder is not empty, or cannot be written.
    """
    folder = make_new_folder(folder)
    report, table, timings = folder / "report.json", folder / "table3.md", folder / "timings.json"
    write_new(report, json.dumps(report_as_dict(experiment), indent=1, allow_nan=False) + "\n")
    write_new(table, _text(experiment))
    write_new(timings, json.dumps(_timings(experiment), indent=1) + "\n")
    drawn = save_figures(experiment, folder / "figures", progress=progress) if figures else []
    return [report, table, timings, *drawn]


def _timings(experiment: Experiment) -> dict[str, Any]:
    kernel = kernel_info()
    return {
        "kernel": {"level": kernel.level, "compiler": kernel.compiler},
        "seconds": experiment.seconds,
        "cells": [
            {
                "method": cell.method,
                "mode": cell.mode,
                "radius_m": cell.radius,
                "runs_seconds": cell.seconds,
                "ns_per_evaluation": cell.seconds * 1e9 / float(np.sum([run.evaluations for run in cell.runs])),
                "path_seconds": None if cell.path is None else cell.path.timings,
            }
            for cell in experiment.cells
        ],
    }
