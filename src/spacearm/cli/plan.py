"""`spacearm plan`: from a problem.yaml to a proven motion."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from spacearm.checks import shown
from spacearm.cli.arguments import parsed
from spacearm.cli.base_rows import base_rows
from spacearm.cli.folder import results_folder
from spacearm.cli.notes import tell_notes, tell_robot
from spacearm.cli.plan_extras import export_trajectory, save_pareto
from spacearm.cli.terminal import progress_bar, show_list
from spacearm.errors import ProblemError, SettingsError
from spacearm.interrupts import unbroken
from spacearm.motion.exports.aem import as_epoch
from spacearm.motion.stated_times import as_duration
from spacearm.planner import Plan, load_problem_file, plan, plan_as_dict, save_plan, save_trajectory
from spacearm.planner.pareto import require_choice
from spacearm.reading import located
from spacearm.robot.left_out import rows_on_unchecked
from spacearm.settings import whole

_WRONG = ("no_envelope", "start_in_collision", "goal_in_collision")
"""As given: the input's fault, and there is nothing to search for."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to plan, and where the results go.

    Attributes:
        problem: a problem file (YAML): robot, scene, start and goal; the planner's settings are in it too.
        output: a new or empty folder for plan.json, trajectory.csv and figures.
        seed: repeats a plan; none: drawn, and recorded in plan.json.
        figures: draw the path, the joints over time, the clearance, and how a floating base moves.
        json: print plan.json's content instead of the summary.
        export: also write the trajectory for others: aem (trajectory.aem, the base's attitude as CCSDS has it), ros
            (trajectory.ros.json, messages of ROS 2).
        epoch: when the motion begins, for aem; none: no date, and the file says so.
        pareto: plan so many times more between quick and gentle to a floating base, and draw duration against its peak angle.
    """

    problem: Path = field(metadata={"name": "PROBLEM.YAML"})
    output: Path = field(metadata={"name": "FOLDER", "flag": "-o"})
    seed: int | None = None
    figures: bool = True
    json: bool = False
    export: tuple[Literal["aem", "ros"], ...] = ()
    epoch: str | None = field(default=None, metadata={"name": "TIME"})
    pareto: int | None = None

    def __post_init__(self) -> None:
        if self.epoch is not None:
            as_epoch("--epoch", self.epoch)
            if "aem" not in self.export:
                raise SettingsError(f"--epoch is {shown(self.epoch)}, and no file needs it, expected --export aem with it")
        if self.pareto is not None:
            whole("pareto", self.pareto, at_least=2, at_most=1000)
        if self.seed is not None:
            whole("seed", self.seed, at_least=0, at_most=2**63 - 1)


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(
        Options,
        arguments,
        command="plan",
        description="Plan a collision-free motion within all limits, prove it, and write it down. Where none is found the "
        "best one seen is in plan.json, and the exit code is 1.",
    )
    file = load_problem_file(options.problem)
    tell_notes(options.problem, file.problem.scene.notes)
    if options.pareto is not None:
        with located(options.problem):
            require_choice(file.problem, "peak")
    with results_folder(options.output) as folder:
        with progress_bar("planning") as bar, located(options.problem):
            found = plan(file.problem, file.settings, rng=options.seed, progress=lambda what: bar(0, 0, what))
            if found.status in _WRONG and found.goal_search is None:
                raise ProblemError(found.message)
        written = _save(found, folder, figures=options.figures and not found.interrupted)
        if found.interrupted:
            raise KeyboardInterrupt  # with what was found until then written down
        written += export_trajectory(found, folder, options.export, epoch=options.epoch)
        if options.pareto is not None and found.found:
            written += save_pareto(found, folder, points=options.pareto, figures=options.figures)
    tell_robot(found.problem.robot, more=f"plan.json in {options.output} (problem.robot.notes)")
    tell_notes(options.problem, () if found.trajectory is None else found.trajectory.notes)
    if options.json:
        print(json.dumps(plan_as_dict(found), indent=2))
    else:
        show_list(_summary(found, folder, written))
    if not found.found:
        print(f"spacearm: {found.message}", file=sys.stderr)
    return 0 if found.found else 1


def _save(found: Plan, folder: Path, *, figures: bool) -> list[str]:
    """Write the plan's files; return their names. An unproven motion is no trajectory for anyone to execute."""
    save_plan(found, folder / "plan.json")
    written = ["plan.json"]
    if found.found and found.trajectory is not None:
        notes = save_trajectory(found.trajectory, folder / "trajectory.csv", jerk_limit=found.settings.jerk_limit)
        tell_notes(folder / "trajectory.csv", notes)
        written.append("trajectory.csv")
    if figures and found.trajectory is not None:
        with unbroken():
            from spacearm.show import save_plan_figures

        with progress_bar("figures") as bar:
            bar(0, 0, "path, joints and clearance")
            written += [path.name for path in save_plan_figures(found, folder) if path.suffix == ".png"]
    return written


def _summary(found: Plan, folder: Path, written: Sequence[str]) -> list[tuple[str, str]]:
    rows = [("status", found.status), ("seed", str(found.seed)), ("goal configurations", _goals(found))]
    if found.history:
        first, last = found.history[0], found.history[-1]
        rows.append(
            (
                "search",
                f"first motion after {first.seconds * 1e3:.3g} ms ({first.by}), the best after {last.seconds * 1e3:.3g} ms "
                f"({last.by}); {found.evaluations} motions looked at, {found.proofs} proven or refuted",
            )
        )
    if found.trajectory is not None:
        rows += [
            ("joint path length", f"{found.fitness['length']:.4f} {_unit(found)}"),
            ("duration", as_duration(found.trajectory.duration)),
        ]
    if found.base is not None:
        rows += base_rows(found.base)
    if found.margins is not None and found.margins.lowered:
        rows.append(("margin", found.margins.message))
    if found.certificate is not None:
        rows.append(("certificate", f"{found.certificate.status}: {found.certificate.message}"))
        rows += rows_on_unchecked(found.certificate.unchecked, found.certificate.bare)
    rows += [("note", note) for note in found.problem.notes]
    rows.append(("time", ", ".join(f"{name} {seconds * 1e3:.0f} ms" for name, seconds in found.timings.items())))
    rows.append(("written", f"{', '.join(written)} in {folder}"))
    return rows


def _goals(found: Plan) -> str:
    search = found.goal_search
    if search is None or not search.searches:
        return str(len(found.goals))
    if (
        found.problem.base_model.follows_arm
    ):  # where the arm ends depends on how the base turns: these are where the search begins
        return f"{len(found.goals)} distinct ones to begin with, which would reach the goal if the base stayed"
    return f"{len(found.goals)} distinct ones, of {search.reached} that reach the goal; {search.in_collision} of these collide"


def _unit(found: Plan) -> str:
    robot = found.problem.robot
    slides = [robot.is_prismatic(i) for i in range(robot.dof)]
    return "m" if all(slides) else "rad and m" if any(slides) else "rad"
