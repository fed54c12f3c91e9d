"""The report page of the paper's experiment: swarms in space, planned paths, curves, Table 3, and the declared readings.

It holds no time and no date: the same settings and seed give the same bytes. The particles of a method are those of its best
run, which is done once more by ask and tell; that gives the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from spacearm.core.records import as_dict
from spacearm.core.version import version
from spacearm.planner import Plan, PlannerSettings
from spacearm.planner.explanations import EndReport
from spacearm.show.report_joined import take_views
from spacearm.show.report_meshes import Meshes
from spacearm.show.report_page import section, transform
from spacearm.show.report_plan import report_of_plans
from spacearm.show.report_scene import obstacles_data, robot_data
from spacearm.show.report_swarm import (
    arm_over_iterations,
    convergence_plot,
    joints_plot,
    methods_plot,
    reached_plot,
    spread_plot,
    swarm_cloud,
    violation_plot,
)
from spacearm.study.paper_experiment import Experiment, MethodRuns
from spacearm.study.paper_problem import (
    GOAL_POSITION,
    OBSTACLE_CENTERS,
    READINGS,
    REPORTED,
    REPORTED_FOR,
    THRESHOLD,
    PaperSettings,
    paper_objective,
    paper_robot,
    paper_scene,
)
from spacearm.study.study_tables import Table
from spacearm.swarm import SwarmResult
from spacearm.swarm.swarm_recording import record_again

Data = dict[str, Any]
Progress = Callable[[int, int, str], Any]

_POINTS = 80_000  # particles in all views together: about 0.7 MB
_POINTS_A_VIEW = 12_000
_MOST_RUNS = 100  # of a method whose curves are drawn


def paper_page(experiment: Experiment, tables: list[Table], notes: list[str], *, progress: Progress | None = None) -> Data:
    """Return the page of an experiment, as `web/src/data.ts` describes it.

    Args:
        experiment: that was run.
        tables: Table 3 of each mode and radius.
        notes: what stands below them.
        progress: called with the views done, those in all, and what is being made.
    """
    settings, meshes, total = experiment.settings, Meshes(), len(experiment.cells)
    page: Data = {
        "title": "Obstacle avoidance by particle swarms: the experiment of Zhang et al. 2022",
        "block": _title_block(settings),
        "robots": [robot_data(paper_robot(settings.link_radius), meshes)],
        "meshes": meshes.items,
        "views": [],
    }
    for i, cell in enumerate(experiment.cells):
        if progress:
            progress(i, total, cell.method)
        page["views"].append(_swarm_view(experiment, cell, meshes, points=min(_POINTS_A_VIEW, _POINTS // total)))
        page["views"] += _path_views(experiment, cell, page)
    if progress:
        progress(total, total, "done")
    sections = [
        *_table_sections(tables, notes),
        section("All methods", notes=_ABOUT_CURVES, plots=_method_plots(experiment), opened=True),
        _beside_the_paper(experiment),
        section(
            "Readings: where the paper is silent, and what is taken",
            table=(("open", "taken", "why"), [(r.open, r.reading, r.why) for r in READINGS]),
        ),
        _settings_section(experiment),
        section("Notes", notes=list(dict.fromkeys(meshes.said()))),
        section("Make it again", code=command_of(settings), notes=_AGAIN, opened=True),
    ]
    return page | {"sections": [part for part in sections if len(part) > 2]}


_ABOUT_CURVES = (
    "one curve for each method, over all of its runs; the curves of a method's single runs are in its own view",
    "evaluations: of fitness and constraints; each run may spend 30,000",
)
_AGAIN = (
    "the same settings and seed give this file again, byte for byte; what the runs took is in timings.json beside it",
    "report.json beside it has the numbers of every run",
)


# ---- views -------------------------------------------------------------------------------------------------------------


def _swarm_view(experiment: Experiment, cell: MethodRuns, meshes: Meshes, *, points: int) -> Data:
    settings, best = experiment.settings, cell.best_run
    robot = paper_robot(settings.link_radius)
    recording = record_again(best, paper_objective(settings, cell.mode, cell.radius), robot.lower, robot.upper)
    cloud, left_out = swarm_cloud(recording, robot, most=points)
    shown = [best, *(run for run in cell.runs if run is not best)][:_MOST_RUNS]
    drawn = [run for run in cell.runs if any(run is one for one in shown)]
    notes = [
        f"shown: run {best.trial} of seed {best.seed}, the best of the {len(cell.runs)}; it was done once more to keep its "
        "particles, with the same bits",
        "iteration 0 is the first round, whose positions are drawn at random",
        "the arm is the best configuration so far; the points are the end effectors of all particles",
        left_out,
        "" if (fewest := int(recording.active.min())) == recording.active.max() else f"the swarm shrinks to {fewest} particles",
        "" if len(drawn) == len(cell.runs) else f"the curves of {len(drawn)} of the {len(cell.runs)} runs are drawn",
        f"planned path: {cell.path_note}",
    ]
    return {
        "name": f"{_name(experiment, cell)}: swarm",
        "verdict": _verdict(experiment, cell),
        "clock": {"unit": "iteration", "duration": best.iterations - 1, "step": 1},
        "actors": [arm_over_iterations(best, 0, name="best so far")],
        "obstacles": obstacles_data(paper_scene(cell.radius), meshes),
        "targets": [_goal(settings, cell.mode)],
        "cloud": cloud,
        "plots": [
            convergence_plot(drawn, best, title="fitness F of the swarm's best", lines=_lines(experiment, cell)),
            violation_plot(best),
            joints_plot(best, robot),
            spread_plot(recording, best, robot),
        ],
        "sections": [section("About this run", notes=[note for note in notes if note], opened=True), _result_section(best)],
    }


def _path_views(experiment: Experiment, cell: MethodRuns, page: Data) -> list[Data]:
    """Return the view of a cell's planned path; none where there is no motion."""
    path = cell.path
    if path is None or path.trajectory is None:
        return []
    values = path.values
    found = Plan(
        status=values["status"],
        problem=path.problem,
        settings=PlannerSettings(),
        seed=values["seed"],
        goals=np.array(values["goals"]),
        ends=EndReport(status="free"),
        timings={},
        trajectory=path.trajectory,
        certificate=path.certificate,
        fitness=values["fitness"],
        evaluations=values["evaluations"],
        proofs=values["proofs"],
    )
    name = f"{_name(experiment, cell)}: planned path"
    made = report_of_plans(found, names=[name], commands=[command_of(experiment.settings)])
    said = section(
        "About this path",
        notes=[
            f"from the stretched arm to the best configuration of {cell.method}, run {cell.best_run.trial}",
            "the paper's particle is one configuration, not a path: the motion and its certificate are ours",
        ],
        opened=True,
    )
    return [{**view, "sections": [said, *view["sections"]]} for view in take_views(page, made)]


def _name(experiment: Experiment, cell: MethodRuns) -> str:
    settings = experiment.settings
    parts = [cell.method]
    parts += [cell.mode] if len(settings.modes) > 1 else []
    parts += [f"A_R {cell.radius:g} m"] if len(settings.radii) > 1 else []
    return ", ".join(parts)


def _verdict(experiment: Experiment, cell: MethodRuns) -> Data:
    best, s, runs = cell.best_run, cell.summary, len(cell.runs)
    if not best.success:
        text = f"The best of them breaks the constraints by {best.violation:.3g}."
        return {"tone": "bad", "headline": f"No run of {cell.method} is feasible", "text": text}
    known = experiment.best_known[cell.mode, cell.radius][0]
    parts = [
        f"Of {runs} run{'s' if runs > 1 else ''}, {s.feasible_share:.0%} are feasible and {s.threshold_share:.0%} reach "
        f"{THRESHOLD}; F is {s.worst:.4f} at worst and {s.mean:.4f} in the mean."
    ]
    if known is not None:
        parts.append(f"The best known value is {known:.4f}; {s.near_share:.0%} of the runs are within 1 % of it.")
    reported = REPORTED.get(REPORTED_FOR.get(cell.method, ""))
    if reported is not None and cell.mode == "goal":
        parts.append(f"The paper reports {reported.best:.4f} at best and {reported.mean:.4f} in the mean.")
    return {"tone": "good", "headline": f"{cell.method}: F = {best.fitness:.4f} at best", "text": " ".join(parts)}


def _lines(experiment: Experiment, cell: MethodRuns) -> list[tuple[float, str]]:
    known = experiment.best_known[cell.mode, cell.radius][0]
    reported = REPORTED.get(REPORTED_FOR.get(cell.method, ""))
    lines = [] if known is None else [(known, "best known")]
    if reported is not None and cell.mode == "goal":
        lines.append((reported.best, "best that the paper reports"))
    return [*lines, *([(THRESHOLD, "threshold of Table 3")] if cell.mode == "goal" else [])]


def _goal(settings: PaperSettings, mode: str) -> Data:
    T = np.eye(4)
    T[:3, 3] = GOAL_POSITION
    radius = settings.tolerance if mode == "goal" else 0.0
    return {"name": "goal", "kind": "position", "T": transform(T), "radius": radius}


def _result_section(best: SwarmResult) -> Data:
    rows = [
        ("fitness F", f"{best.fitness:.10g}"),
        ("violation", f"{best.violation:.3g}"),
        ("iterations", f"{best.iterations}"),
        ("evaluations", f"{best.evaluations:,}"),
        ("configuration [rad]", ", ".join(f"{value:.6f}" for value in best.x)),
        ("why it stopped", best.message),
    ]
    return section("Result", rows=rows)


# ---- sections ----------------------------------------------------------------------------------------------------------


def _title_block(settings: PaperSettings) -> list[list[str]]:
    radii = ", ".join(f"{radius:g}" for radius in settings.radii)
    return [
        ["experiment", f"{len(settings.methods)} methods, {settings.runs} run{'s' if settings.runs > 1 else ''} of each"],
        ["paper", "J. Zhang, J. Zhang, Q. Zhang, X. Wei, Symmetry 2022, 14(5), 938, doi 10.3390/sym14050938"],
        ["robot", "zhang2022, 7 joints, base held fixed"],
        ["obstacles", f"{len(OBSTACLE_CENTERS)} spheres, A_R = {radii} m"],
        ["seed", str(settings.seed)],
        ["made with", f"spacearm {version()}"],
        ["numbers", "IEEE float64, the same bits on every machine and any number of threads"],
    ]


def _table_sections(tables: list[Table], notes: list[str]) -> list[Data]:
    made = []
    for i, (title, header, rows) in enumerate(tables):
        name, _, known = title.partition("; ")
        made.append(section(name, table=(header, rows), notes=[known, *notes], opened=i == 0))
    return made


def _method_plots(experiment: Experiment) -> list[Data]:
    plots = []
    for mode, radius in experiment.best_known:
        cells = {cell.method: cell.runs for cell in experiment.cells if (cell.mode, cell.radius) == (mode, radius)}
        where = f"{mode} mode, A_R = {radius:g} m"
        plots.append(methods_plot(f"methods-{mode}-{radius:g}", f"median F over the evaluations, {where}", cells))
        plots.append(reached_plot(f"reached-{mode}-{radius:g}", f"share of the runs by the F that they reach, {where}", cells))
    return plots


def _beside_the_paper(experiment: Experiment) -> Data:
    header = ("", "best", "mean", "worst", f"to {THRESHOLD}", "its figures", "here")
    rows: list[tuple[str, ...]] = []
    for name, r in REPORTED.items():
        figures, best = ("4, 5, 6" if name == "pso" else "7, 8, 9"), f"{r.best:.4f}"
        rows.append(
            (f"paper: {name.upper()}", best, f"{r.mean:.4f}", f"{r.worst:.4f}", f"{r.threshold_share:.0%}", figures, "")
        )
    for cell in experiment.cells:
        if cell.mode != "goal":
            continue
        s, beside = cell.summary, REPORTED_FOR.get(cell.method)
        figures = "" if beside is None else "4, 5, 6" if beside == "pso" else "7, 8, 9"
        numbers = (f"{value:.4f}" if math.isfinite(value) else "-" for value in (s.best, s.mean, s.worst))
        where = f"{_name(experiment, cell)}: swarm" + (", planned path" if cell.path is not None else "")
        rows.append((_name(experiment, cell), *numbers, f"{s.threshold_share:.0%}", figures, where))
    return section("Beside the paper", table=(header, rows), notes=_ABOUT_THE_PAPER)


_ABOUT_THE_PAPER = (
    "the paper's figures cannot be reproduced exactly: it states neither the robot, nor the signs of the joint limits, nor the "
    "radius of the obstacles; what is taken instead is under the readings",
    "Figures 4 and 7, fitness over iterations: the first plot of a swarm's view; Figures 5 and 8, joints over iterations: its "
    "third; Figures 6 and 9, the path: the view of the planned path, and the way of the best end effector in the swarm's view",
)


def _settings_section(experiment: Experiment) -> Data:
    settings = as_dict(experiment.settings)
    settings.pop("threads")  # the numbers do not depend on it
    rows = [(name, _text(value)) for name, value in settings.items()]
    swarms = {cell.method: cell.settings for cell in experiment.cells}
    for method, swarm in swarms.items():
        values = ", ".join(f"{name} {_text(value)}" for name, value in as_dict(swarm).items() if value is not None)
        rows.append((f"swarm of {method}", f"{type(swarm).__name__}: {values}"))
    return section("Settings", rows=rows)


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return "(" + ", ".join(f"{name} {_text(inner)}" for name, inner in value.items()) + ")"
    if isinstance(value, list):
        return ", ".join(_text(inner) for inner in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def command_of(settings: PaperSettings) -> str:
    """Return the command that runs an experiment again; the folder is for the reader to choose."""
    default, words = PaperSettings(), ["spacearm paper -o out/paper"]
    for field in fields(settings):
        value = getattr(settings, field.name)
        if field.name == "threads" or value == getattr(default, field.name):
            continue
        values = value if isinstance(value, tuple) else (value,)
        words.append(f"--{field.name.replace('_', '-')} {' '.join(map(str, values))}")
    return " ".join(words)
