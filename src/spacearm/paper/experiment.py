"""The experiment: every method, mode and radius, many runs each, and a planned path to each method's best."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from spacearm.errors import ProblemError
from spacearm.paper.best_known import best_known_value
from spacearm.paper.scene import paper_robot, paper_scene, seed_objective
from spacearm.paper.settings import NEAR, THRESHOLD, PaperSettings
from spacearm.paper.statistics import Summary, summarise
from spacearm.planner import ConfigurationGoal, Plan, Problem, plan
from spacearm.swarm import FeasibleFirst, Penalty, SwarmResult, SwarmSettings, named_settings, run_trials

PENALTY_WEIGHT = 100.0  # of the weighted penalty option
_PATH_STEPS = 1_000_000  # a planned path takes about as long as so many evaluations; for the progress only


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
    path: Plan | None
    path_note: str
    seconds: float

    @property
    def best_run(self) -> SwarmResult:
        """The run with the best result, feasible first."""
        return min(self.runs, key=lambda run: (run.violation, run.fitness))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """All of it.

    Attributes:
        settings: what was run.
        cells: one for each radius, mode and method, in this order.
        best_known: for each (mode, radius), the best known value, None without one, and how it was found.
        seconds: it took.
    """

    settings: PaperSettings
    cells: tuple[MethodRuns, ...]
    best_known: dict[tuple[str, float], tuple[float | None, str]]
    seconds: float

    def cell(self, method: str, mode: str, radius: float) -> MethodRuns:
        """Return one cell."""
        return next(c for c in self.cells if (c.method, c.mode, c.radius) == (method, mode, radius))


def run_experiment(settings: PaperSettings, *, progress: Callable[[int, int, str], Any] | None = None) -> Experiment:
    """Run the experiment.

    Args:
        settings: what to run.
        progress: called with the steps done (about an evaluation each), those in all, and what is being done.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    begun = time.perf_counter()
    combinations = [(radius, mode) for radius in settings.radii for mode in settings.modes]
    swarms = {method: _swarm(method, settings) for method in settings.methods}
    evaluations = settings.runs * sum(swarm.particles * swarm.iterations for swarm in swarms.values())
    total = len(combinations) * (evaluations + len(swarms) * _PATH_STEPS)
    done = 0
    cells: list[MethodRuns] = []
    known: dict[tuple[str, float], tuple[float | None, str]] = {}

    def tell(steps: int, what: str) -> None:
        if progress:
            progress(min(steps, total), total, what)

    for radius, mode in combinations:
        objective = seed_objective(settings, mode, radius)
        robot = paper_robot(settings.link_radius)
        found: dict[str, _Found] = {}
        for method, swarm in swarms.items():
            name = f"{method}, {mode}, A_R {radius:g} m"
            tell(done, name)
            started = time.perf_counter()
            runs = run_trials(
                objective,
                robot.lower,
                robot.upper,
                swarm,
                seed=settings.seed,
                trials=settings.runs,
                threads=settings.threads,
                keep_positions=True,
                progress=lambda rounds, done=done, swarm=swarm, name=name: tell(done + rounds * swarm.particles, name),
            )
            seconds = time.perf_counter() - started
            done += settings.runs * swarm.particles * swarm.iterations
            tell(done, f"{name}: path")
            path, note = _path(settings, runs, radius)
            found[method] = _Found(runs=tuple(runs), seconds=seconds, path=path, path_note=note)
            done += _PATH_STEPS
        known[mode, radius] = best_known_value(
            settings, mode, radius, [run.fitness for one in found.values() for run in one.runs if run.success]
        )
        cells += _cells(settings, swarms, found, mode, radius, known[mode, radius][0])
    tell(total, "done")
    return Experiment(settings=settings, cells=tuple(cells), best_known=known, seconds=time.perf_counter() - begun)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    runs: tuple[SwarmResult, ...]
    seconds: float
    path: Plan | None
    path_note: str


def _swarm(method: str, settings: PaperSettings) -> SwarmSettings:
    swarm = named_settings(method)
    if settings.constraints == "penalty" and swarm.constraints == FeasibleFirst():
        swarm = replace(swarm, constraints=Penalty(weight=PENALTY_WEIGHT))
    return swarm


def _cells(
    settings: PaperSettings,
    swarms: dict[str, SwarmSettings],
    found: dict[str, _Found],
    mode: str,
    radius: float,
    best_known: float | None,
) -> list[MethodRuns]:
    reference = found[settings.methods[0]].runs
    cells = []
    for method, one in found.items():
        summary = summarise(
            one.runs,
            threshold=THRESHOLD,
            best_known=best_known,
            near=NEAR,
            reference=None if one.runs is reference else reference,
        )
        cells.append(
            MethodRuns(
                method=method,
                mode=mode,
                radius=radius,
                settings=swarms[method],
                runs=one.runs,
                summary=summary,
                path=one.path,
                path_note=one.path_note,
                seconds=one.seconds,
            )
        )
    return cells


def _path(settings: PaperSettings, runs: Sequence[SwarmResult], radius: float) -> tuple[Plan | None, str]:
    """Plan from the stretched arm to the best configuration found."""
    best = min(runs, key=lambda run: (run.violation, run.fitness))
    if not best.success:
        return None, "no run found a feasible configuration"
    robot = paper_robot(settings.link_radius)
    try:
        problem = Problem(
            robot,
            paper_scene(radius),
            start=np.zeros(robot.dof),
            goal=ConfigurationGoal(np.clip(best.x, robot.lower, robot.upper)),
        )
        path = plan(problem, rng=settings.seed)
    except ProblemError as error:
        return None, str(error)
    return path, path.message
