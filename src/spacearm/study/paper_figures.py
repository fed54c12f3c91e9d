"""Figures 4-9 of the paper, for our runs, and a comparison of all methods.

Where the paper draws PSO (Figures 4, 5, 6) we draw the first method, and where it draws IPSO (Figures 7, 8, 9) every
other one: `figure4_pso`, `figure7_ipso-m`, ... The goal mode is drawn, or the literal one if it alone was run.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.core.interrupts import unbroken
from spacearm.core.output import make_new_folder
from spacearm.core.version import version
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
from spacearm.study.paper_problem import GOAL_POSITION, REPORTED, REPORTED_FOR, THRESHOLD, paper_robot, paper_scene

Draw = Callable[[], Any]


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
            lambda: figure_joints_over_iterations(best, robot, title=f"{cell.method}: joints of the best particle"),
        ),
        (
            f"figure{path}a_{name}",
            lambda: figure_path_2d(trajectory, robot, scene, title=f"{cell.method}: planned path", **places),
        ),
        (
            f"figure{path}b_{name}",
            lambda: figure_path_3d(trajectory, robot, scene, title=f"{cell.method}: planned path", **places),
        ),
    ]
    if trajectory is not None and cell.path is not None:
        certificate = cell.path.certificate
        drawings += [
            (f"path-joints_{name}", lambda: figure_joints(trajectory, title=f"{cell.method}: planned motion")),
            (
                f"path-clearance_{name}",
                lambda: figure_clearance(trajectory, scene, certificate, title=f"{cell.method}: planned motion"),
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
