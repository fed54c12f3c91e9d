"""What `spacearm plan` writes when asked to: files for others, and what a gentler motion costs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path

from spacearm.cli.notes import tell_notes
from spacearm.cli.terminal import progress_bar
from spacearm.interrupts import unbroken
from spacearm.motion.exports import write_aem, write_ros_trajectory
from spacearm.output import write_new
from spacearm.planner import ParetoFront, Plan, pareto_front, save_plan


def export_trajectory(found: Plan, folder: Path, kinds: Sequence[str], *, epoch: str | None) -> list[str]:
    """Write a proven trajectory in the formats asked for; return the files' names.

    Raises:
        SettingsError: an epoch that is no date.
    """
    if not found.found or found.trajectory is None:
        return []
    written = []
    if "aem" in kinds:
        write_aem(found.trajectory, folder / "trajectory.aem", start_epoch=epoch)
        written.append("trajectory.aem")
    if "ros" in kinds:
        path = folder / "trajectory.ros.json"
        tell_notes(path, write_ros_trajectory(found.trajectory, path, jerk_limit=found.settings.jerk_limit))
        written.append("trajectory.ros.json")
    return written


def save_pareto(found: Plan, folder: Path, *, points: int, figures: bool) -> list[str]:
    """Plan between quick and gentle; write a table, every plan and a figure; return the files' names.

    Raises:
        ProblemError: a problem whose base is fixed, or that states its duration.
    """
    with progress_bar("quick or gentle") as bar:
        front = pareto_front(found.problem, found.settings, points=points, rng=found.seed, progress=bar)
    if not front.plans:
        return []
    plans = [f"pareto_{i:02d}.json" for i in range(1, len(front.plans) + 1)]
    for name, member in zip(plans, front.plans, strict=True):
        save_plan(member, folder / name)
    write_new(folder / "pareto.csv", _table(front, plans))
    written = ["pareto.csv", *plans]
    if figures:
        from spacearm.version import version

        with unbroken():
            from spacearm.show import figure_pareto, save_figure

            figure = figure_pareto(front, title=found.problem.robot.name)
        provenance = {"Title": "spacearm plan --pareto", "Author": f"spacearm {version()}", "Subject": f"seed {found.seed}"}
        png, _ = save_figure(figure, folder / "pareto", provenance=provenance)
        written.append(png.name)
    return written


def _table(front: ParetoFront, plans: Sequence[str]) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["plan", "duration_s", "base_peak_deg", "on_front"])
    for name, duration, angle, best in zip(plans, front.durations, front.disturbances, front.best, strict=True):
        rows.writerow([name, f"{duration:.9g}", f"{math.degrees(angle):.9g}", int(best)])
    return text.getvalue()
