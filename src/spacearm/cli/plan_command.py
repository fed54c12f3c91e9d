"""`spacearm plan`: from a problem.yaml to a proven motion, and a report of it.

The planner and the files are imported by the functions that use them, after the options are read: help is printed without.
"""

from __future__ import annotations

import csv
import io
import json
import math
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from spacearm.cli.arguments import parsed, tracking_of_words
from spacearm.cli.progress import Bar, progress_bar
from spacearm.cli.results_folder import results_folder
from spacearm.cli.terminal import (
    base_rows,
    loading,
    rows_on_near_pairs,
    rows_on_tracking,
    show_list,
    tell_notes,
    tell_robot,
)
from spacearm.core.checks import as_number, shown
from spacearm.core.errors import ProblemError, SettingsError
from spacearm.core.extras import require_extra
from spacearm.core.interrupts import unbroken
from spacearm.core.output import write_new
from spacearm.core.reading import located
from spacearm.core.records import whole

if TYPE_CHECKING:
    from spacearm.planner import ParetoFront, Plan, PlannerSettings
    from spacearm.planner.plan_result import SearchState

_WRONG = ("no_envelope", "start_in_collision", "goal_in_collision")
"""As given: the input's fault, and there is nothing to search for."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Plan a collision-free motion within all limits, prove it, and write it down.

    If no motion is found, plan.json holds the best one seen, and the exit code is 1.

    Attributes:
        problem: a problem file (YAML): robot, scene, start and goal; it holds the planner's settings too.
        output: a new or empty folder for plan.json, trajectory.csv, report.html and figures.
        clearance: that the motion keeps [m], instead of the one in the problem file.
        tracking: how far each joint may be from the motion [rad or m], a number for all joints, or NAME=NUMBER for each of
            some (all=NUMBER for the others): the proof then holds for all that stays so near; none: as the problem file says.
        seed: the random seed, which repeats a plan; none: a new one is drawn, and recorded in plan.json.
        figures: draw the path, the joints over time, the clearance, and how a floating base moves, as PNG and PDF for papers.
        no_report: do not write report.html.
        json: print the content of plan.json instead of the summary.
        export: also write the trajectory for other programs: aem writes trajectory.aem, the attitude of the base as CCSDS
            defines it; ros writes trajectory.ros.json, messages of ROS 2.
        epoch: date and time at which the motion begins, for aem; none: the file states no date.
        pareto: plan this number of further motions between the shortest duration and the smallest peak angle of a floating
            base, and draw one against the other.
    """

    problem: Annotated[Positional[Path], arg(metavar="PROBLEM.YAML")]
    output: Annotated[Path, arg(metavar="FOLDER", aliases=("-o",))]
    clearance: float | None = None
    tracking: Annotated[tuple[str, ...], arg(metavar="NUMBER|NAME=NUMBER")] = ()
    seed: int | None = None
    figures: bool = False
    no_report: bool = False
    json: bool = False
    export: tuple[Literal["aem", "ros"], ...] = ()
    epoch: Annotated[str | None, arg(metavar="TIME")] = None
    pareto: int | None = None

    def __post_init__(self) -> None:
        if self.figures:
            require_extra("matplotlib", "--figures", instead="leave it out: report.html needs no library")
        if self.epoch is not None:
            from spacearm.files.ccsds_attitude import as_epoch

            as_epoch("--epoch", self.epoch)
            if "aem" not in self.export:
                raise SettingsError(f"--epoch is {shown(self.epoch)}, and no file needs it, expected --export aem with it")
        if self.pareto is not None:
            whole("pareto", self.pareto, at_least=2, at_most=1000)
        if self.seed is not None:
            whole("seed", self.seed, at_least=0, at_most=2**63 - 1)
        if self.clearance is not None:
            as_number("--clearance", self.clearance, SettingsError, at_least=0, unit="m")
        if self.tracking:
            from spacearm.proof.tracking import plain_tracking

            plain_tracking(tracking_of_words(self.tracking), SettingsError, name="--tracking")


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(Options, arguments, command="plan")
    from spacearm.files import load_problem_file, plan_as_dict
    from spacearm.planner import plan
    from spacearm.planner.pareto import require_choice

    with loading():
        file = load_problem_file(options.problem)
    problem = file.problem if options.clearance is None else replace(file.problem, clearance=options.clearance)
    settings = replace(file.settings, tracking=tracking_of_words(options.tracking)) if options.tracking else file.settings
    tell_notes(options.problem, problem.scene.notes)
    if options.pareto is not None:
        with located(options.problem):
            require_choice(problem, "peak")
    with results_folder(options.output) as folder:
        with progress_bar("planning") as bar, located(options.problem):
            found = plan(
                problem, settings, rng=options.seed, progress=lambda what: bar(0, 0, what), watch=_watching(bar, settings)
            )
            if found.status in _WRONG and found.goal_search is None:
                seen = "" if found.status == "no_envelope" else f"; `spacearm view {options.problem}` shows it"
                raise ProblemError(f"{found.message}{seen}")
        written = _save(found, folder)
        if not found.interrupted:
            written += _save_pictures(found, folder, options)
        if found.interrupted:
            raise KeyboardInterrupt  # with what was found until then written down
        written += _export(found, folder, options.export, epoch=options.epoch)
        if options.pareto is not None and found.found:
            written += _save_pareto(found, folder, points=options.pareto, figures=options.figures)
    tell_robot(found.problem.robot, more=f"plan.json in {options.output} (problem.robot.notes)")
    tell_notes(options.problem, () if found.trajectory is None else found.trajectory.notes)
    if options.json:
        print(json.dumps(plan_as_dict(found), indent=2))
    else:
        show_list(_summary(found, folder, written))
    if not found.found:
        print(f"spacearm: {found.message}", file=sys.stderr)
    return 0 if found.found else 1


def _watching(bar: Bar, settings: PlannerSettings) -> Callable[[SearchState], None]:
    """Return what tells a bar how far a search is: by its time budget, else by its evaluations, if either is limited."""
    begun, most = time.monotonic(), settings.most_evaluations
    budget = None if settings.time_budget is None else round(1e3 * settings.time_budget)  # [ms]

    def tell(state: SearchState) -> None:
        has = "no motion yet" if state.motion is None else f"best fitness {state.fitness:.4g}"
        what = f"{has}, {state.evaluations:,} motions looked at"
        if budget is not None:
            bar(min(round(1e3 * (time.monotonic() - begun)), budget), budget, what)
        else:
            bar(0 if most is None else min(state.evaluations, most), most or 0, what)

    return tell


def _save(found: Plan, folder: Path) -> list[str]:
    """Write the plan's files; return their names. An unproven motion is no trajectory for anyone to execute."""
    from spacearm.files import save_plan, save_trajectory

    save_plan(found, folder / "plan.json")
    written = ["plan.json"]
    if found.found and found.trajectory is not None:
        notes = save_trajectory(found.trajectory, folder / "trajectory.csv", jerk_limit=found.settings.jerk_limit)
        tell_notes(folder / "trajectory.csv", notes)
        written.append("trajectory.csv")
    return written


def _save_pictures(found: Plan, folder: Path, options: Options) -> list[str]:
    """Write the report, and the figures if they are asked for; return the files' names."""
    written: list[str] = []
    if not options.no_report:
        with unbroken():
            from spacearm.report.report_page import write_report
            from spacearm.report.report_plan import report_of_plans

        with progress_bar("report") as bar:
            bar(0, 0, "clearances, curves and scene")
            page = report_of_plans(found, commands=[_command(found, options)])
            write_report(page, folder / "report.html")
        written.append("report.html")
    if options.figures and found.trajectory is not None:
        with unbroken():
            from spacearm.show import save_plan_figures

        with progress_bar("figures") as bar:
            written += [path.name for path in save_plan_figures(found, folder, progress=bar) if path.suffix == ".png"]
    return written


def _command(found: Plan, options: Options) -> str:
    """Return the command that makes the plan again."""
    words = ["spacearm", "plan", str(options.problem), "-o", "out", "--seed", str(found.seed)]
    if options.clearance is not None:
        words += ["--clearance", f"{options.clearance!r}"]
    if options.tracking:
        words += ["--tracking", *options.tracking]
    return shlex.join(words)


def _export(found: Plan, folder: Path, kinds: Sequence[str], *, epoch: str | None) -> list[str]:
    """Write a proven trajectory in the formats asked for; return the files' names.

    Raises:
        SettingsError: an epoch that is no date.
    """
    if not found.found or found.trajectory is None:
        return []
    from spacearm.files import write_aem, write_ros_trajectory

    written = []
    if "aem" in kinds:
        write_aem(found.trajectory, folder / "trajectory.aem", start_epoch=epoch)
        written.append("trajectory.aem")
    if "ros" in kinds:
        path = folder / "trajectory.ros.json"
        tell_notes(path, write_ros_trajectory(found.trajectory, path, jerk_limit=found.settings.jerk_limit))
        written.append("trajectory.ros.json")
    return written


def _save_pareto(found: Plan, folder: Path, *, points: int, figures: bool) -> list[str]:
    """Plan between quick and gentle; write a table, every plan and a figure; return the files' names.

    Raises:
        ProblemError: a problem whose base is fixed, or that states its duration.
    """
    from spacearm.files import save_plan
    from spacearm.planner import pareto_front

    with progress_bar("quick or gentle") as bar:
        front = pareto_front(found.problem, found.settings, points=points, rng=found.seed, progress=bar)
    if not front.plans:
        return []
    plans = [f"pareto_{i:02d}.json" for i in range(1, len(front.plans) + 1)]
    for name, member in zip(plans, front.plans, strict=True):
        save_plan(member, folder / name)
    write_new(folder / "pareto.csv", _pareto_table(front, plans))
    written = ["pareto.csv", *plans]
    if figures:
        from spacearm.core.version import version

        with unbroken():
            from spacearm.show import figure_pareto, save_figure

            figure = figure_pareto(front, title=found.problem.robot.name)
        provenance = {"Title": "spacearm plan --pareto", "Author": f"spacearm {version()}", "Subject": f"seed {found.seed}"}
        png, _ = save_figure(figure, folder / "pareto", provenance=provenance)
        written.append(png.name)
    return written


def _pareto_table(front: ParetoFront, plans: Sequence[str]) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["plan", "duration_s", "base_peak_deg", "on_front"])
    for name, duration, angle, best in zip(plans, front.durations, front.disturbances, front.best, strict=True):
        rows.writerow([name, f"{duration:.9g}", f"{math.degrees(angle):.9g}", int(best)])
    return text.getvalue()


def _summary(found: Plan, folder: Path, written: Sequence[str]) -> list[tuple[str, str]]:
    from spacearm.files.stated_columns import as_duration
    from spacearm.robot.unchecked_pairs import rows_on_unchecked

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
    rows.append(("clearance", _clearance(found)))
    if found.certificate is not None:
        rows.append(("certificate", f"{found.certificate.status}: {found.certificate.message}"))
        rows += rows_on_tracking(found.certificate)
        rows += rows_on_near_pairs(found.certificate)
        rows += rows_on_unchecked(found.certificate.unchecked, found.certificate.bare)
    rows += [("note", note) for note in found.problem.notes]
    rows.append(("time", ", ".join(f"{name} {seconds * 1e3:.0f} ms" for name, seconds in found.timings.items())))
    rows.append(("written", f"{', '.join(written)} in {folder}"))
    return rows


def _clearance(found: Plan) -> str:
    """Say what was asked for, what is proven, and what was measured."""
    problem, certificate = found.problem, found.certificate
    said = [f"{problem.clearance * 1e3:.4g} mm asked for"]
    if problem.clearances:
        said.append(f"others for {len(problem.clearances)} pair{'s' if len(problem.clearances) > 1 else ''} or groups of pairs")
    if certificate is not None and certificate.holds and certificate.clearance is not None:
        proven = certificate.clearance
        said.append("nothing is in the way" if math.isinf(proven) else f"at least {proven * 1e3:.4g} mm proven")
    if certificate is not None and certificate.closest is not None:
        said.append(f"closest measured {certificate.closest.clearance * 1e3:.4g} mm")
    if certificate is not None and certificate.nearer:
        said.append(f"but {certificate.nearer}")
    if found.achievable is not None:
        said.append(f"found and proven with {found.achievable * problem.clearance * 1e3:.4g} mm")
    return ", ".join(said)


def _goals(found: Plan) -> str:
    search = found.goal_search
    if search is None or not search.searches:
        return str(len(found.goals))
    if found.problem.base_model.follows_arm:  # the turn of the base decides where the arm ends: the search begins at these
        return f"{len(found.goals)} distinct ones to begin with, which would reach the goal if the base stayed"
    return f"{len(found.goals)} distinct ones, of {search.reached} that reach the goal; {search.in_collision} of these collide"


def _unit(found: Plan) -> str:
    robot = found.problem.robot
    slides = [robot.is_prismatic(i) for i in range(robot.dof)]
    return "m" if all(slides) else "rad and m" if any(slides) else "rad"
