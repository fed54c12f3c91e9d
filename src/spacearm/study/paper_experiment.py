"""The paper's experiment: every method, mode and radius, many runs each, and a planned path to each method's best.

There are two studies. A task of the first does a block of runs of one method; a task of the second plans the path to the best
configuration that the runs of a method found.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.core.errors import ProblemError
from spacearm.files import plan_as_dict
from spacearm.motion import Trajectory
from spacearm.motion.trajectory_values import trajectory_from_dict
from spacearm.planner import ConfigurationGoal, Problem, plan
from spacearm.proof import Certificate, certify
from spacearm.study.paper_problem import (
    NEAR,
    THRESHOLD,
    PaperSettings,
    best_known_value,
    paper_objective,
    paper_robot,
    paper_scene,
)
from spacearm.study.run_study import Progress, Study, run_study
from spacearm.study.statistics import Summary, summarise
from spacearm.swarm import FeasibleFirst, Penalty, SwarmResult, SwarmSettings, named_settings, run_trials
from spacearm.swarm.ask_tell import SwarmHistory

PENALTY_WEIGHT = 100.0  # of the weighted penalty option
_BLOCK = 20  # runs a task: about 0.05 s on one core
_PATH_STEPS = 1_000_000  # evaluations that take about as long as a planned path; for the progress only


# ---- the runs ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class RunsTask:
    """A block of runs of a method in one mode and with one radius.

    Attributes:
        method: name of the swarm settings.
        mode: "goal" or "literal".
        radius: of the obstacles A_R [m].
        first: number of the first run.
        count: of runs.
        settings: of the experiment.
        threads: processor threads; None: one a core. The numbers do not depend on it.
    """

    method: str
    mode: str
    radius: float
    first: int
    count: int
    settings: PaperSettings
    threads: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecord:
    """A run of a swarm, as `SwarmResult` has it, with its history over the iterations."""

    trial: int
    status: str
    fitness: float
    violation: float
    x: list[float]
    iterations: int
    evaluations: int
    failed_evaluations: int
    seconds: float
    fitness_history: list[float]
    violation_history: list[float]
    evaluation_history: list[int]
    position_history: list[list[float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunsRecord:
    """The runs of a task.

    Attributes:
        runs: by number.
        seconds: they took.
    """

    runs: list[RunRecord]
    seconds: float


def do_runs(task: RunsTask) -> RunsRecord:
    """Do a block of runs."""
    robot = paper_robot(task.settings.link_radius)
    begun = time.perf_counter()
    runs = run_trials(
        paper_objective(task.settings, task.mode, task.radius),
        robot.lower,
        robot.upper,
        _swarm(task.method, task.settings),
        seed=task.settings.seed,
        trials=task.count,
        first_trial=task.first,
        threads=task.threads,
        keep_positions=True,
    )
    return RunsRecord(runs=[_run_record(run) for run in runs], seconds=time.perf_counter() - begun)


def _run_record(run: SwarmResult) -> RunRecord:
    assert run.history.positions is not None  # they were asked for
    return RunRecord(
        trial=run.trial,
        status=run.status,
        fitness=float(run.fitness),
        violation=float(run.violation),
        x=run.x.tolist(),
        iterations=run.iterations,
        evaluations=run.evaluations,
        failed_evaluations=run.failed_evaluations,
        seconds=run.seconds,
        fitness_history=run.history.fitness.tolist(),
        violation_history=run.history.violation.tolist(),
        evaluation_history=run.history.evaluations.tolist(),
        position_history=run.history.positions.tolist(),
    )


def _result(run: RunRecord, swarm: SwarmSettings, seed: int) -> SwarmResult:
    return SwarmResult(
        x=np.array(run.x),
        fitness=run.fitness,
        violation=run.violation,
        status=run.status,
        iterations=run.iterations,
        evaluations=run.evaluations,
        failed_evaluations=run.failed_evaluations,
        seed=seed,
        trial=run.trial,
        settings=swarm,
        history=SwarmHistory(
            fitness=np.array(run.fitness_history),
            violation=np.array(run.violation_history),
            evaluations=np.array(run.evaluation_history, dtype=np.int64),
            positions=np.array(run.position_history),
        ),
        seconds=run.seconds,
    )


def _swarm(method: str, settings: PaperSettings) -> SwarmSettings:
    swarm = named_settings(method)
    if settings.constraints == "penalty" and swarm.constraints == FeasibleFirst():
        swarm = replace(swarm, constraints=Penalty(weight=PENALTY_WEIGHT))
    return swarm


def _place(task: RunsTask | PathTask) -> str:
    return f"{task.method}, {task.mode}, A_R {task.radius:g} m"


def _shared(settings: PaperSettings) -> dict[str, Any]:
    """Return the settings that each run depends on."""
    return {
        "seed": settings.seed,
        "tolerance": settings.tolerance,
        "weights": list(settings.weights),
        "link_radius": settings.link_radius,
        "constraints": settings.constraints,
    }


RUNS = Study(
    name="paper, runs",
    run=do_runs,
    record=RunsRecord,
    key=lambda task: f"{_place(task)}, runs {task.first} to {task.first + task.count - 1}",
    definition=lambda task: {**_shared(task.settings), "swarm": asdict(_swarm(task.method, task.settings))},
)
"""The study of the runs."""


# ---- the planned paths -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class PathTask:
    """A path to be planned, from the stretched arm to the best configuration of a method's runs.

    Attributes:
        method: name of the swarm settings.
        mode: "goal" or "literal".
        radius: of the obstacles A_R [m].
        q: (7,) the configuration [rad]; None if no run found a feasible one.
        settings: of the experiment.
    """

    method: str
    mode: str
    radius: float
    q: tuple[float, ...] | None
    settings: PaperSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class PathRecord:
    """The path of a task.

    Attributes:
        plan: as a plan file has it; None if there was nothing to plan to.
        note: why there is no path, or no proven one.
        timings: of the planner, by stage [s].
    """

    plan: dict[str, Any] | None
    note: str
    timings: dict[str, float]


def do_path(task: PathTask) -> PathRecord:
    """Plan a path.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    if task.q is None:
        return PathRecord(plan=None, note="no run found a feasible configuration", timings={})
    try:
        path = plan(_path_problem(task), rng=task.settings.seed)
    except ProblemError as error:
        return PathRecord(plan=None, note=str(error), timings={})
    if path.interrupted:
        raise KeyboardInterrupt
    return PathRecord(plan=plan_as_dict(path), note=path.message, timings=dict(path.timings))


def _path_problem(task: PathTask) -> Problem:
    robot = paper_robot(task.settings.link_radius)
    goal = ConfigurationGoal(np.clip(np.array(task.q), robot.lower, robot.upper))
    # The paper asks that nothing touches, and for no clearance.
    return Problem(robot, paper_scene(task.radius), start=np.zeros(robot.dof), goal=goal, clearance=0.0)


PATHS = Study(
    name="paper, paths",
    run=do_path,
    record=PathRecord,
    key=lambda task: f"{_place(task)}: path",
    definition=lambda task: {**_shared(task.settings), "q": None if task.q is None else list(task.q)},
)
"""The study of the planned paths."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedPath:
    """A planned path.

    Attributes:
        problem: that was planned.
        values: the plan as a plan file has it.
        timings: of the planner, by stage [s].
    """

    problem: Problem
    values: dict[str, Any]
    timings: dict[str, float]

    @property
    def found(self) -> bool:
        """Whether a motion was found and proven."""
        return self.values["status"] == "found"

    @cached_property
    def trajectory(self) -> Trajectory | None:
        """The motion; None where there is none."""
        if self.values["motion"] is None:
            return None
        trajectory = trajectory_from_dict(self.problem.robot, self.values["motion"])
        assert isinstance(trajectory, Trajectory)
        return trajectory

    @cached_property
    def certificate(self) -> Certificate | None:
        """The certificate of the motion, made anew: one in a file is never believed; None where there is no motion."""
        return None if self.trajectory is None else certify(self.problem, self.trajectory)


# ---- the experiment ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MethodRuns:
    """A method's runs in one mode and with one radius.

    Attributes:
        method: name of the swarm settings.
        mode: "goal" or "literal".
        radius: of the obstacles A_R [m].
        settings: of the swarm.
        runs: the results, with the best position of every iteration in their history.
        summary: the row of Table 3.
        path: the planned motion to the best run's configuration; None if no run was feasible, or that one is in contact.
        path_note: why there is no path, or no proven one.
        seconds: all runs took.
    """

    method: str
    mode: str
    radius: float
    settings: SwarmSettings
    runs: tuple[SwarmResult, ...]
    summary: Summary
    path: PlannedPath | None
    path_note: str
    seconds: float

    @property
    def best_run(self) -> SwarmResult:
        """The run with the best result, feasible first."""
        return _best(self.runs)


def _best(runs: Sequence[SwarmResult]) -> SwarmResult:
    return min(runs, key=lambda run: (run.violation, run.fitness))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """All of it.

    Attributes:
        settings: what was run.
        cells: one for each radius, mode and method, in this order.
        best_known: for each (mode, radius), the best known value, None without one, and how it was found.
        seconds: it took; of an experiment that was resumed, since then.
    """

    settings: PaperSettings
    cells: tuple[MethodRuns, ...]
    best_known: dict[tuple[str, float], tuple[float | None, str]]
    seconds: float

    def cell(self, method: str, mode: str, radius: float) -> MethodRuns:
        """Return one cell."""
        return next(c for c in self.cells if (c.method, c.mode, c.radius) == (method, mode, radius))


@dataclass(slots=True, kw_only=True)
class _Found:
    """What the tasks of a cell found."""

    method: str
    mode: str
    radius: float
    runs: list[SwarmResult] = field(default_factory=list)
    seconds: float = 0.0
    path: PlannedPath | None = None
    path_note: str = ""


def run_experiment(
    settings: PaperSettings,
    *,
    records: Path | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Experiment:
    """Run the experiment.

    Args:
        settings: what to run.
        records: file to which runs are appended, and which a stopped experiment is resumed from; see `run_study`. The paths go
            into a second file beside it, its name with "-paths".
        jobs: processes; with more than 1, each does its runs in one thread.
        progress: called with the steps done (about an evaluation each), those in all, and what is being done.

    Raises:
        SpacearmError: as of `run_study`.
        KeyboardInterrupt: Ctrl-C.
    """
    begun = time.perf_counter()
    cells = [
        _Found(method=method, mode=mode, radius=radius)
        for radius in settings.radii
        for mode in settings.modes
        for method in settings.methods
    ]
    second = None if records is None else records.with_name(f"{records.stem}-paths{records.suffix}")
    _do_runs(settings, cells, records, jobs, progress)
    _do_paths(settings, cells, second, jobs, progress)
    known = {
        (mode, radius): best_known_value(
            settings,
            mode,
            radius,
            [run.fitness for cell in cells if (cell.mode, cell.radius) == (mode, radius) for run in cell.runs if run.success],
        )
        for radius in settings.radii
        for mode in settings.modes
    }
    summed = tuple(_summed(settings, cell, cells, known[cell.mode, cell.radius][0]) for cell in cells)
    if progress:
        total = _steps(settings, cells)
        progress(total, total, "done")
    return Experiment(settings=settings, cells=summed, best_known=known, seconds=time.perf_counter() - begun)


def _do_runs(settings: PaperSettings, cells: list[_Found], records: Path | None, jobs: int, progress: Progress | None) -> None:
    threads = settings.threads if jobs == 1 else 1
    tasks = [
        RunsTask(
            method=cell.method,
            mode=cell.mode,
            radius=cell.radius,
            first=first,
            count=min(_BLOCK, settings.runs - first),
            settings=settings,
            threads=threads,
        )
        for cell in cells
        for first in range(0, settings.runs, _BLOCK)
    ]
    ends = np.cumsum([0, *(_evaluations(task.method, settings) * task.count for task in tasks)])
    total = _steps(settings, cells)

    def tell(done: int, _: int, what: str) -> None:
        if progress and done < len(tasks):
            progress(int(ends[done]), total, what.partition(", runs")[0])

    found = run_study(RUNS, tasks, records=records, jobs=jobs, progress=tell)
    by_place = {(cell.method, cell.mode, cell.radius): cell for cell in cells}
    for task, record in zip(tasks, found, strict=True):
        cell, swarm = by_place[task.method, task.mode, task.radius], _swarm(task.method, settings)
        cell.runs += [_result(run, swarm, settings.seed) for run in record.runs]
        cell.seconds += record.seconds


def _do_paths(settings: PaperSettings, cells: list[_Found], records: Path | None, jobs: int, progress: Progress | None) -> None:
    tasks = []
    for cell in cells:
        best = _best(cell.runs)
        q = tuple(best.x.tolist()) if best.success else None
        tasks.append(PathTask(method=cell.method, mode=cell.mode, radius=cell.radius, q=q, settings=settings))
    total = _steps(settings, cells)

    def tell(done: int, _: int, what: str) -> None:
        if progress and done < len(tasks):
            progress(total - (len(tasks) - done) * _PATH_STEPS, total, what)

    found = run_study(PATHS, tasks, records=records, jobs=jobs, progress=tell)
    for cell, task, record in zip(cells, tasks, found, strict=True):
        cell.path_note = record.note
        if record.plan is not None:
            cell.path = PlannedPath(problem=_path_problem(task), values=record.plan, timings=record.timings)


def _evaluations(method: str, settings: PaperSettings) -> int:
    swarm = _swarm(method, settings)
    return swarm.particles * swarm.iterations


def _steps(settings: PaperSettings, cells: Sequence[_Found]) -> int:
    return sum(settings.runs * _evaluations(cell.method, settings) + _PATH_STEPS for cell in cells)


def _summed(settings: PaperSettings, cell: _Found, cells: Sequence[_Found], best_known: float | None) -> MethodRuns:
    first = next(other for other in cells if (other.mode, other.radius) == (cell.mode, cell.radius))
    summary = summarise(
        cell.runs,
        threshold=THRESHOLD,
        best_known=best_known,
        near=NEAR,
        reference=None if first is cell else first.runs,
    )
    return MethodRuns(
        method=cell.method,
        mode=cell.mode,
        radius=cell.radius,
        settings=_swarm(cell.method, settings),
        runs=tuple(cell.runs),
        summary=summary,
        path=cell.path,
        path_note=cell.path_note,
        seconds=cell.seconds,
    )
