"""Draw docs/figures/overview.png: the planned path, and the fitness that 20 runs of each method reach."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from spacearm.show import ComparedMethod, figure_comparison, figure_path_3d
from spacearm.study.paper_experiment import run_experiment
from spacearm.study.paper_problem import GOAL_POSITION, REPORTED, REPORTED_FOR, PaperSettings, paper_robot, paper_scene

METHODS = ("pso", "ipso-m", "ipso-s", "ring-rising", "ipso-e")


def main(path: str = "docs/figures/overview.png") -> None:
    """Run the experiment's goal mode and draw it."""
    experiment = run_experiment(PaperSettings(modes=("goal",), methods=METHODS))
    figure = Figure(figsize=(10.5, 4.4), layout="constrained")
    left, right = figure.add_gridspec(1, 2, width_ratios=(1, 1.35))
    plan = experiment.cell("ring-rising", "goal", 0.10).path
    assert plan is not None
    figure_path_3d(
        plan.trajectory,
        robot=paper_robot(),
        scene=paper_scene(),
        start=np.zeros(7),
        goal=GOAL_POSITION,
        title="a proven path to the best configuration",
        ax=figure.add_subplot(left, projection="3d"),
    )
    rows = []
    for cell in experiment.cells:
        row = REPORTED.get(REPORTED_FOR.get(cell.method, ""))
        reported = None if row is None else (row.best, row.mean, row.worst)
        rows.append(ComparedMethod(name=cell.method, runs=cell.runs, reported=reported))
    best_known, _ = experiment.best_known["goal", 0.10]
    figure_comparison(rows, title="20 runs of each method", best_known=best_known, threshold=4.33, ax=figure.add_subplot(right))
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150, metadata={"Software": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
