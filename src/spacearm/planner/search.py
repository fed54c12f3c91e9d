"""The planner: a swarm of splines from the start to a goal configuration, and a proof of what it finds."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown
from spacearm.errors import ProblemError, SettingsError
from spacearm.motion import Motion, Trajectory, basis
from spacearm.planner.ends import goal_configurations, require_free, search_bounds
from spacearm.planner.kernel_model import KernelModel, make_kernel_model, native_class
from spacearm.planner.problem import Problem
from spacearm.planner.result import Improvement, Plan
from spacearm.planner.settings import PlannerSettings
from spacearm.proof import Certificate, certify
from spacearm.swarm import Rng, SwarmResult, run_trials, seed_of

Array = NDArray[np.float64]

_PRECISION = 32  # the search's; the proof is float64
_MOST_SAMPLES = 1024


def plan(
    problem: Problem,
    settings: PlannerSettings | None = None,
    *,
    rng: Rng = None,
    progress: Callable[[str], Any] | None = None,
) -> Plan:
    """Plan a motion: collision-free and within the limits at every instant, with a proof.

    The particles are the interior control points of spline motions; less violation beats more, and among collision-free
    motions the shorter joint path wins. A motion counts as found only when its certificate holds.

    Args:
        problem: robot, scene, start and goal.
        settings: of the search.
        rng: seed, generator or None; the plan records the seed.
        progress: called with a word on each stage that begins.

    Returns:
        The plan; `status` says whether there is a motion, `message` what to do if not.

    Raises:
        ProblemError: the start or the goal configuration is in collision, or the goal position is out of reach.
        SettingsError: settings of something else.
    """
    if not isinstance(problem, Problem):
        raise ProblemError(f"problem is {shown(problem)}, expected a Problem; make one with Problem(...) or load_problem(...)")
    settings = PlannerSettings() if settings is None else settings
    if not isinstance(settings, PlannerSettings):
        raise SettingsError(f"settings is {shown(settings)}, expected PlannerSettings(...)")
    seed = seed_of(rng)
    tell = progress or (lambda _: None)
    begun = time.perf_counter()
    start_clearance = require_free(problem, problem.start, "start")
    tell("goal configurations")
    goals = goal_configurations(problem, settings, seed)
    searched = time.perf_counter()
    deadline = None if settings.time_budget is None else begun + settings.time_budget
    search = _Search(problem=problem, settings=settings, seed=seed, deadline=deadline, start_clearance=start_clearance)
    for index, goal in enumerate(goals):
        tell(f"motions to goal {index + 1} of {len(goals)}")
        search.towards(index, goal)
        if search.late and search.best is not None:
            break
    return search.finished(goals, goals_seconds=searched - begun, total=time.perf_counter() - begun)


@dataclass(kw_only=True)
class _Search:
    """The best motion over all goals and restarts."""

    problem: Problem
    settings: PlannerSettings
    seed: int
    deadline: float | None
    start_clearance: float
    best: Trajectory | None = None
    certificate: Certificate | None = None
    fallback: tuple[float, Trajectory, Certificate] | None = None
    history: list[Improvement] = field(default_factory=list)
    certify_seconds: float = 0.0

    @property
    def late(self) -> bool:
        return self.deadline is not None and time.perf_counter() > self.deadline

    @property
    def best_length(self) -> float:
        return np.inf if self.best is None else self.best.motion.length()

    def towards(self, index: int, goal: Array) -> None:
        """Try the straight motion, then the swarm; where a proof fails, again with more samples."""
        direct = float(np.linalg.norm(goal - self.problem.start))
        if direct >= self.best_length:
            return  # no motion there can be shorter than the straight one
        if self._offer(index, -1, Motion(np.array([self.problem.start, goal])), violation=0.0) == "holds":
            return
        model = make_kernel_model(self.problem.robot, self.problem.scene, precision=_PRECISION)
        samples, restart = self.settings.samples, 0
        while restart < self.settings.restarts and not (self.late and self.fallback):
            run = self._run(model, goal, samples, restart)
            motion = self._motion(goal, run)
            status = self._offer(index, restart, motion, run.violation)
            if status == "undecided":
                return  # an end in contact, or nearly: no other motion to it would fare better
            if run.success and status == "fails" and samples < _MOST_SAMPLES:
                samples *= 2  # it slipped through between the samples
                continue
            restart += 1

    def finished(self, goals: Array, *, goals_seconds: float, total: float) -> Plan:
        trajectory, certificate = self.best, self.certificate
        status, advice = "found", ""
        if trajectory is None and self.fallback is not None:
            _, trajectory, certificate = self.fallback
            status, advice = "not_found", f"the best one: {certificate.message}; allow more restarts or interior_points"
        elif trajectory is None:
            status, advice = "goal_not_reached", "allow more goal_candidates, a larger tolerance or a smaller margin"
        fitness = {} if trajectory is None else {"length": trajectory.motion.length(), "duration": trajectory.duration}
        return Plan(
            status=status,
            problem=self.problem,
            settings=self.settings,
            seed=self.seed,
            trajectory=trajectory,
            certificate=certificate,
            goals=goals,
            fitness=fitness,
            history=tuple(self.history),
            timings={
                "goals": goals_seconds,
                "search": total - goals_seconds - self.certify_seconds,
                "certify": self.certify_seconds,
            },
            advice=advice,
        )

    def _run(self, model: KernelModel, goal: Array, samples: int, restart: int) -> SwarmResult:
        interior = self.settings.interior_points
        table = basis(np.linspace(0.0, 1.0, samples), interior)
        margin = min(self.settings.margin, 0.9 * self.start_clearance, 0.9 * require_free(self.problem, goal, "goal"))
        objective = native_class("MotionObjective", _PRECISION)(
            model.native, np.array(self.problem.start), goal, table, margin, 1.0
        )
        lower, upper = search_bounds(self.problem)
        straight = self.problem.start + np.linspace(0, 1, interior + 2)[1:-1, None] * (goal - self.problem.start)
        return run_trials(
            objective,
            np.tile(lower, interior),
            np.tile(upper, interior),
            self.settings.swarm,
            seed=self.seed,
            first_trial=restart,
            threads=1,
            initial=np.clip(straight.reshape(1, -1), np.tile(lower, interior), np.tile(upper, interior)).astype(np.float32),
        )[0]

    def _motion(self, goal: Array, run: SwarmResult) -> Motion:
        lower, upper = search_bounds(self.problem)
        # Float32 may round a bound outwards.
        inside = np.clip(run.x.reshape(self.settings.interior_points, -1), lower, upper)
        return Motion(np.vstack([self.problem.start, inside, goal]))

    def _offer(self, index: int, restart: int, motion: Motion, violation: float) -> str:
        """Certify a motion and keep it if it is the best so far; return the certificate's status."""
        length = motion.length()
        if length >= self.best_length:
            return "longer"  # proven or not, it would not be kept
        trajectory = Trajectory(self.problem.robot, motion)
        certificate = certify(self.problem, trajectory)
        self.certify_seconds += certificate.seconds
        if certificate.holds:
            self.best, self.certificate = trajectory, certificate
        else:
            worst = certificate.closest.clearance if certificate.closest else -np.inf
            if self.fallback is None or worst > self.fallback[0]:
                self.fallback = (worst, trajectory, certificate)
        entry = Improvement(goal=index, restart=restart, length=length, violation=violation, proven=certificate.holds)
        if certificate.holds or self.best is None:
            self.history.append(entry)
        return certificate.status
