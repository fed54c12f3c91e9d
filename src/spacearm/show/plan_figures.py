"""The figures of a plan: its path, its joints over time, its clearance, and how a floating base moves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from spacearm.core.interrupts import unbroken
from spacearm.core.version import version
from spacearm.planner import Plan
from spacearm.show.base_figures import figure_base_motion, figure_base_paths
from spacearm.show.figure_style import save_figure
from spacearm.show.path_figures import figure_path_2d, figure_path_3d
from spacearm.show.trajectory_figures import figure_clearance, figure_joints

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_plan_figures(plan: Plan, folder: Path, *, progress: Callable[[int, int, str], object] | None = None) -> list[Path]:
    """Draw a plan's trajectory, proven or not, into a folder, as PNG and PDF; return the files.

    Args:
        plan: to be drawn.
        folder: that exists.
        progress: called with the figures drawn, those in all, and the next one.

    Raises:
        OutputError: a file exists, or cannot be written.
        SettingsError: matplotlib is not installed.
    """
    if plan.trajectory is None:
        return []
    robot = plan.problem.robot
    drawings: dict[str, Callable[[Plan], Figure]] = {
        "path_2d": figure_path_2d,
        "path_3d": figure_path_3d,
        "joints": figure_joints,
    }
    if robot.shapes and (plan.problem.scene.obstacles or robot.self_pairs):
        drawings["clearance"] = figure_clearance
    if plan.trajectory.base_model.follows_arm:
        drawings["base_motion"] = figure_base_motion
        drawings["base_paths"] = figure_base_paths
    provenance = {"Title": "spacearm plan", "Author": f"spacearm {version()}", "Subject": f"seed {plan.seed}"}
    written: list[Path] = []
    for done, (name, draw) in enumerate(drawings.items()):
        if progress is not None:
            progress(done, len(drawings), name.replace("_", " "))
        with unbroken():
            figure = draw(plan)
        written += save_figure(figure, folder / name, provenance=provenance)
    return written
