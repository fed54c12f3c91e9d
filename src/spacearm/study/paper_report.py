"""The report of the paper's experiment: a page and tables for people, report.json for machines, Figures 4-9 if asked for.

report.json holds every setting, declared reading, seed and version, and the numbers of each run. It and report.html hold no
time and no date: the same settings and seed give the same bytes. What it took is in timings.json.

Where the paper draws PSO (Figures 4, 5, 6) the first method is drawn, and where it draws IPSO (Figures 7, 8, 9) every other
one: `figure4_pso`, `figure7_ipso-m`, ... The goal mode is drawn, or the literal one if it alone was run.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.core.extras import require_extra
from spacearm.core.interrupts import unbroken
from spacearm.core.native import kernel_info
from spacearm.core.output import make_new_folder, write_new
from spacearm.core.records import as_dict
from spacearm.core.version import version
from spacearm.report.report_page import write_report
from spacearm.show import (
    ComparedMethod,
    figure_clearance,
    figure_comparison,
    figure_convergence,
    figure_joints,
    figure_joints_over_iterations,
    figure_path_2d,
    figure_path_3d,
    save_figure,
)
from spacearm.study.paper_experiment import Experiment, MethodRuns
from spacearm.study.paper_page import paper_page
from spacearm.study.paper_problem import (
    GOAL_POSITION,
    NEAR,
    OBSTACLE_CENTERS,
    READINGS,
    REPORTED,
    REPORTED_FOR,
    START_POSITION,
    THRESHOLD,
    paper_robot,
    paper_scene,
)
from spacearm.study.study_tables import Table, markdown
from spacearm.swarm import SwarmResult

Draw = Callable[[], Any]

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
    figures: bool = False,
    progress: Callable[[int, int, str], Any] | None = None,
) -> list[Path]:
    """Write report.html, report.json, table3.md and timings.json into a new or empty folder; return what was written.

    Args:
        experiment: that was run.
        folder: new or empty.
        figures: also draw Figures 4-9 and the comparison, which takes about half a minute.
        progress: called with the views or figures done, those in all, and what is being made.

    Raises:
        OutputError: the folder is not empty, or cannot be written.
        SettingsError: figures without matplotlib.
    """
    if figures:
        require_extra("matplotlib", "drawing figures", instead="leave the figures out: report.html needs no library")
    folder = make_new_folder(folder)
    page, report, table, timings = (folder / n for n in ("report.html", "report.json", "table3.md", "timings.json"))
    write_new(report, json.dumps(report_as_dict(experiment), indent=1, allow_nan=False) + "\n")
    write_new(table, _text(experiment))
    write_new(timings, json.dumps(_timings(experiment), indent=1) + "\n")
    write_report(paper_page(experiment, table_rows(experiment), [*LEGEND, *path_notes(experiment)], progress=progress), page)
    drawn = save_figures(experiment, folder / "figures", progress=progress) if figures else []
    return [page, report, table, timings, *drawn]


def _timings(experiment: Experiment) -> dict[str, Any]:
    kernel = kernel_info()
    return {
        "spacearm-paper-timings": 1,
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


# ---- figures ---------------------------------------------------------------------------------------------------------


def save_figures(experiment: Experiment, folder: Path, *, progress: Callable[[int, int, str], Any] | None = None) -> list[Path]:
    """Draw every figure into a new folder, as PNG and PDF; return the files.

    Raises:
        OutputError: the folder is not empty, or cannot be written.
    """
    make_new_folder(folder)
    settings = experiment.settings
    mode = "goal" if "goal" in settings.modes else settings.modes[0]
    drawings: list[tuple[str, Draw]] = []
    for radius in settings.radii:
        suffix = "" if len(settings.radii) == 1 else f"_radius-{radius:g}m"
        cells = [experiment.cell(method, mode, radius) for method in settings.methods]
        for i, cell in enumerate(cells):
            numbers = (4, 5, 6) if i == 0 else (7, 8, 9)
            drawings += _of_method(experiment, cell, numbers, f"{cell.method}{suffix}")
        drawings.append((f"comparison{suffix}", lambda cells=cells: _comparison(experiment, cells)))
    provenance = {
        "Title": "spacearm paper",
        "Author": f"spacearm {version()}",
        "Subject": f"Zhang et al. 2022, doi 10.3390/sym14050938; {settings.runs} runs, seed {settings.seed}, {mode} mode",
    }
    written: list[Path] = []
    for i, (name, draw) in enumerate(drawings):
        if progress:
            progress(i, len(drawings), name)
        with unbroken():
            figure = draw()
        written += save_figure(figure, folder / name, provenance=provenance)
    if progress:
        progress(len(drawings), len(drawings), "done")
    return written


def _of_method(experiment: Experiment, cell: MethodRuns, numbers: tuple[int, int, int], name: str) -> list[tuple[str, Draw]]:
    robot, best = paper_robot(experiment.settings.link_radius), cell.best_run
    scene = paper_scene(cell.radius)
    trajectory = cell.path.trajectory if cell.path is not None and cell.path.found else None
    reported = REPORTED.get(REPORTED_FOR.get(cell.method, ""))
    convergence, joints, path = numbers
    places = {"start": np.zeros(robot.dof), "goal": GOAL_POSITION, "trace": best.history.positions}
    drawings: list[tuple[str, Draw]] = [
        (
            f"figure{convergence}_{name}",
            lambda: figure_convergence(
                cell.runs,
                title=f"{cell.method}: fitness over iterations",
                best_known=experiment.best_known[cell.mode, cell.radius][0],
                reported=None if reported is None or cell.mode != "goal" else reported.best,
                threshold=THRESHOLD,
            ),
        ),
        (
            f"figure{joints}_{name}",
            lambda: figure_joints_over_iterations(best, robot=robot, title=f"{cell.method}: joints of the best particle"),
        ),
        (
            f"figure{path}a_{name}",
            lambda: figure_path_2d(trajectory, robot=robot, scene=scene, title=f"{cell.method}: planned path", **places),
        ),
        (
            f"figure{path}b_{name}",
            lambda: figure_path_3d(trajectory, robot=robot, scene=scene, title=f"{cell.method}: planned path", **places),
        ),
    ]
    if trajectory is not None and cell.path is not None:
        certificate = cell.path.certificate
        drawings += [
            (f"path-joints_{name}", lambda: figure_joints(trajectory, title=f"{cell.method}: planned motion")),
            (
                f"path-clearance_{name}",
                lambda: figure_clearance(
                    trajectory, scene=scene, certificate=certificate, title=f"{cell.method}: planned motion"
                ),
            ),
        ]
    return drawings


def _comparison(experiment: Experiment, cells: list[MethodRuns]) -> Any:
    rows = [
        ComparedMethod(
            name=cell.method,
            runs=cell.runs,
            reported=None if cell.mode != "goal" else _reported(cell.method),
        )
        for cell in cells
    ]
    first = cells[0]
    return figure_comparison(
        rows,
        title=f"{experiment.settings.runs} runs of each method",
        best_known=experiment.best_known[first.mode, first.radius][0],
        threshold=THRESHOLD if first.mode == "goal" else None,
    )


def _reported(method: str) -> tuple[float, float, float] | None:
    row = REPORTED.get(REPORTED_FOR.get(method, ""))
    return None if row is None else (row.best, row.mean, row.worst)
