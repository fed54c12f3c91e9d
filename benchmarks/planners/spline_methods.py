"""Optimisers of others on the spline problem of ours: two control points, judged by the planner's own kernel.

Everybody asks `Judge` for the fitness (joint path length) plus 100 times the violation [m] of some motions at a time, so the
budget of evaluations is the same. A motion counts when the planner would count it: all instants free, the finer ones too.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

import cma
import numpy as np
from cases import Case, Trace
from scipy.optimize import differential_evolution, minimize

from spacearm.motion import Motion
from spacearm.planner import MotionSwarm, PlannerSettings
from spacearm.study.other_checker import dense_configurations

PENALTY = 100.0  # rad a metre
INTERIOR = 2  # control points
POPULATION = 16  # the planner's own


class _Spent(Exception):
    """The budget is spent."""


class Judge:
    """Judges motions, counts and remembers; raises when the budget is spent."""

    def __init__(self, method: str, case: Case, seed: int, evaluations: int) -> None:
        settings = PlannerSettings(interior_points=(INTERIOR,))
        self.swarm = MotionSwarm(case.problem, settings, rng=seed)
        lower, upper = case.problem.robot.lower, case.problem.robot.upper
        self.lower, self.upper = np.tile(lower, INTERIOR), np.tile(upper, INTERIOR)
        self.straight = self.swarm.straight.control_points[1:-1].ravel()
        self.trace = Trace(method, case.name, seed)
        self.best: np.ndarray | None = None
        self._ends, self._budget, self._begun = (case.start, case.goal), evaluations, time.perf_counter()

    def points(self, x: np.ndarray) -> np.ndarray:
        """Control points (m, 4, n) of rows of x (m, 2 n)."""
        n = len(self._ends[0])
        ends = [np.broadcast_to(end, (len(x), 1, n)) for end in self._ends]
        return np.concatenate([ends[0], np.clip(x, self.lower, self.upper).reshape(len(x), INTERIOR, n), ends[1]], axis=1)

    def judge(self, control_points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fitness and violation (m,) of motions (m, 4, n)."""
        begun = time.perf_counter()
        found = self.swarm.judge(control_points)
        now = time.perf_counter()
        self.trace.kernel += now - begun
        for i in np.flatnonzero(found.free):
            count = self.trace.calls + int(i) + 1
            if count <= self._budget:
                before = len(self.trace.points)
                self.trace.note(now - self._begun, count, float(found.fitness[i]))
                self.best = control_points[i] if len(self.trace.points) > before else self.best
        self.trace.calls += len(control_points)
        self.trace.seconds = time.perf_counter() - self._begun
        if self.trace.calls >= self._budget:
            raise _Spent
        return found.fitness, found.violation

    def penalised(self, x: np.ndarray) -> np.ndarray:
        """What the others minimise, (m,) of rows (m, 2 n)."""
        fitness, violation = self.judge(self.points(x))
        return fitness + PENALTY * violation


def _ours(judge: Judge) -> None:
    """The planner's swarm, through ask and tell."""
    while not judge.swarm.done:
        judge.swarm.tell(*judge.judge(judge.swarm.ask()))


def _differential_evolution(judge: Judge) -> None:
    members = np.vstack([judge.straight, _around(judge)])
    differential_evolution(
        lambda x: judge.penalised(np.atleast_2d(x.T)),
        list(zip(judge.lower, judge.upper, strict=True)),
        init=np.clip(members, judge.lower, judge.upper),
        maxiter=10**6,
        tol=0,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=judge.trace.seed,
    )


def _nelder_mead(judge: Judge) -> None:
    """From one drawn start after the other."""
    rng = np.random.default_rng(judge.trace.seed)
    for round_ in range(10**6):
        start = judge.straight + (0.6 * rng.normal(size=len(judge.straight)) if round_ else 0.0)
        minimize(lambda x: float(judge.penalised(x[None])[0]), start, method="Nelder-Mead", options={"maxfev": 1500})


def _cma(judge: Judge) -> None:
    """With restarts, the population doubled each time."""
    for restart in range(10**6):
        options = {
            "popsize": POPULATION * 2**restart,
            "bounds": [judge.lower.tolist(), judge.upper.tolist()],
            "seed": judge.trace.seed + 1 + 1000 * restart,
            "verbose": -9,
        }
        search = cma.CMAEvolutionStrategy(np.clip(judge.straight, judge.lower, judge.upper), 0.3, options)
        while not search.stop():
            rows = np.array(search.ask())
            search.tell(list(rows), judge.penalised(rows).tolist())


def _around(judge: Judge) -> np.ndarray:
    """Where ours begins too: around the straight motion, wider and wider."""
    rng = np.random.default_rng(judge.trace.seed)
    spread = np.resize([0.1, 0.3, 0.6, 1.0], 2 * POPULATION - 1)
    return judge.straight + spread[:, None] * rng.normal(size=(len(spread), len(judge.straight)))


METHODS: dict[str, Callable[[Judge], None]] = {
    "spacearm swarm, ask/tell": _ours,
    "scipy DE": _differential_evolution,
    "scipy Nelder-Mead": _nelder_mead,
    "cma, restarts": _cma,
}


def minimised(method: str, case: Case, seed: int, evaluations: int) -> Trace:
    """A method's run on a case."""
    judge = Judge(method, case, seed, evaluations)
    with contextlib.suppress(_Spent):
        METHODS[method](judge)
    if judge.best is not None:
        judge.trace.way = dense_configurations(Motion(judge.best))
    judge.trace.python = judge.trace.seconds - judge.trace.kernel
    return judge.trace
