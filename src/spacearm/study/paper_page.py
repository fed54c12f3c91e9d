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
from spacearm.report.report_meshes import Meshes
from spacearm.report.report_page import section, transform
from spacearm.report.report_plan import report_of_plans
from spacearm.report.report_scene import obstacles_data, robot_data
from spacearm.report.report_swarm import (
    arm_over_iterations,
    convergence_plot,
    joints_plot,
    methods_plot,
    reached_plot,
    spread_plot,
    swarm_cloud,
    violation_plot,
)
from spacearm.report.report_views import flat_view, take_views, verdict
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
from spacearm.study.study_tables import Table, percent
from spacearm.swarm import SwarmResult
from spacearm.swarm.swarm_recording import record_again

Data = dict[str, Any]
Progress = Callable[[int, int, str], Any]

_POINTS = 80_000  # particles in all views together: about 0.7 MB
_POINTS_A_VIEW = 12_000
_MOST_CELLS = 12  # methods, modes and radii that have views of their own
_DRAWN_RADIUS = 0.015  # of the links in the swarms' views [m]
_MOST_RUNS = 100  # of a method whose curves are drawn


def paper_page(experiment: Experiment, tables: list[Table], notes: list[str], *, progress: Progress | None = None) -> Data:
    """Return the page of an experiment, as `web/src/data.ts` describes it.

    Args:
        experiment: that was run.
        tables: Table 3 of each mode and radius.
        notes: what stands below them.
        progress: called with the views done, those in all, and what is being made.
    """
    settings, meshes, cells = experiment.settings, Meshes(), experiment.cells[:_MOST_CELLS]
    page: Data = {
        "title": "Obstacle avoidance by particle swarms",
        "block": _title_block(settings),
        "robots": [_robot_of_swarms(settings, meshes)],
        "meshes": meshes.items,
        "views": [_overview(experiment, tables, notes)],
        "open": 1,
    }
    for i, cell in enumerate(cells):
        if progress:
            progress(i, len(cells), cell.method)
        page["views"].append(_swarm_view(experiment, cell, meshes, points=min(_POINTS_A_VIEW, _POINTS // len(cells))))
        page["views"] += _path_views(experiment, cell, page)
    if progress:
        progress(len(cells), len(cells), "done")
    return page | {"sections": [section("Make it again", code=command_of(settings), notes=_AGAIN)]}


def _robot_of_swarms(settings: PaperSettings, meshes: Meshes) -> Data:
    """Return the arm as the swarms' views draw it: thick enough to be seen among the particles."""
    return robot_data(paper_robot(max(settings.link_radius, _DRAWN_RADIUS)), meshes)


def _overview(experiment: Experiment, tables: list[Table], notes: list[str]) -> Data:
    """Return the view of all methods: curves and tables."""
    first = experiment.cells[0]
    cells = [cell for cell in experiment.cells if (cell.mode, cell.radius) == (first.mode, first.radius)]
    best = min(cells, key=lambda cell: (cell.best_run.violation, cell.summary.mean))
    said = verdict(
        "plain",
        f"{len(experiment.settings.methods)} methods, {sum(len(cell.runs) for cell in experiment.cells)} runs",
        f"In {_where(experiment, first)}, {best.method} has the least mean, F = {best.summary.mean:.4f}. Each method has a "
        "view of its swarm in space, and one of the planned, proven path to its best configuration." + _left_out(experiment),
    )
    sections = [
        *_table_sections(tables, notes),
        _beside_the_paper(experiment),
        section(
            "Readings: where the paper is silent, and what is taken",
            table=(("open", "taken", "why"), [(r.open, r.reading, r.why) for r in READINGS]),
        ),
        _settings_section(experiment),
    ]
    return flat_view("All methods, Table 3", said, plots=_method_plots(experiment), sections=sections)


_AGAIN = (
    "the same settings and seed give this file again, byte for byte; what the runs took is in timings.json beside it",
    "report.json beside it has the numbers of every run",
)


# ---- views -------------------------------------------------------------------------------------------------------------


def _left_out(experiment: Experiment) -> str:
    count = len(experiment.cells)
    if count <= _MOST_CELLS:
        return ""
    return (
        f" To keep this page small, {_MOST_CELLS} of the {count} have them, the first ones; report.json has the paths of all."
    )


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
        _thickness_note(settings),
        left_out,
        "" if (fewest := int(recording.active.min())) == recording.active.max() else f"the swarm shrinks to {fewest} particles",
        "" if len(drawn) == len(cell.runs) else f"the curves of {len(drawn)} of the {len(cell.runs)} runs are drawn",
        f"planned path: {cell.path_note}",
    ]
    return {
        "name": f"{_name(experiment, cell)}: swarm",
        "verdict": _verdict_of(experiment, cell),
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
    """Return the view of a cell's planned path, or of why there is none; no view where there was nothing to plan to."""
    path = cell.path
    if path is None:
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


def _thickness_note(settings: PaperSettings) -> str:
    drawn, kept = 2e3 * _DRAWN_RADIUS, 2e3 * settings.link_radius
    return f"links are drawn {drawn:g} mm thick here; what is kept clear is {kept:g} mm thick" if kept < drawn else ""


def _name(experiment: Experiment, cell: MethodRuns) -> str:
    """Return what a cell is called: its method, and what there is more than one of."""
    settings = experiment.settings
    parts = [cell.method]
    parts += [cell.mode] if len(settings.modes) > 1 else []
    parts += [f"A_R {cell.radius:g} m"] if len(settings.radii) > 1 else []
    return ", ".join(parts)


def _where(experiment: Experiment, cell: MethodRuns) -> str:
    radius = f", A_R = {cell.radius:g} m" if len(experiment.settings.radii) > 1 else ""
    return f"{cell.mode} mode{radius}"


def _verdict_of(experiment: Experiment, cell: MethodRuns) -> Data:
    best, s, runs = cell.best_run, cell.summary, len(cell.runs)
    if not best.success:
        text = f"The best of them breaks the constraints by {best.violation:.3g}."
        return verdict("bad", f"No run of {cell.method} is feasible", text)
    known = experiment.best_known[cell.mode, cell.radius][0]
    parts = [
        f"Of {runs} run{'s' if runs > 1 else ''}, {percent(s.feasible_share)} are feasible and {percent(s.threshold_share)} "
        f"reach {THRESHOLD}; F is {s.worst:.4f} at worst and {s.mean:.4f} in the mean."
    ]
    if known is not None:
        parts.append(f"The best known value is {known:.4f}; {percent(s.near_share)} of the runs are within 1 % of it.")
    reported = REPORTED.get(REPORTED_FOR.get(cell.method, ""))
    if reported is not None and cell.mode == "goal":
        parts.append(f"The paper reports {reported.best:.4f} at best and {reported.mean:.4f} in the mean.")
    return verdict("good", f"{cell.method}: F = {best.fitness:.4f} at best", " ".join(parts))


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
        ["after", "Zhang et al., Symmetry 2022, 14(5), 938"],
        ["doi", "10.3390/sym14050938"],
        ["robot", "zhang2022, 7 joints, base held fixed"],
        ["obstacles", f"{len(OBSTACLE_CENTERS)} spheres, A_R = {radii} m"],
        ["seed", str(settings.seed)],
        ["numbers", "float64, the same bits on every machine"],
        ["made with", f"spacearm {version()}"],
    ]


def _table_sections(tables: list[Table], notes: list[str]) -> list[Data]:
    made = []
    for i, (title, header, rows) in enumerate(tables):
        name, _, known = title.partition("; ")
        made.append(section(name, table=(header, rows), notes=[known, *notes], opened=i == 0))
    return made


def _method_plots(experiment: Experiment) -> list[Data]:
    plots: list[Data] = []
    for mode, radius in experiment.best_known:
        cells = [cell for cell in experiment.cells if (cell.mode, cell.radius) == (mode, radius)]
        where, runs = _where(experiment, cells[0]), {cell.method: cell.runs for cell in cells}
        plots.append(methods_plot(f"methods-{mode}-{radius:g}", f"median F over the evaluations, {where}", runs))
        plots.append(reached_plot(f"reached-{mode}-{radius:g}", f"share of the runs by F, {where}", runs))
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
