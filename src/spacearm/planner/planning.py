"""The planner: goal configurations, a swarm of splines to them, and a proof of what it finds."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import ProblemError, SettingsError
from spacearm.core.interrupts import interrupt_taken
from spacearm.core.random_seed import Rng, seed_of
from spacearm.core.records import setting_names
from spacearm.dynamics.base_models import require_known
from spacearm.motion import Motion, Trajectory, fastest_duration, time_optimal
from spacearm.planner.clearance import margins_within_reach
from spacearm.planner.explanations import EndReport, check_ends, explain_goal
from spacearm.planner.inverse_kinematics import GoalConfigurations, find_goal_configurations
from spacearm.planner.motion_search import Islands
from spacearm.planner.plan_result import BaseReport, Plan, report_base, within_base_limits
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem, placed_ends, require_searchable
from spacearm.proof import Certificate
from spacearm.proof import certify as certify
from spacearm.robot.unchecked_pairs import lacks_envelope

Array = NDArray[np.float64]

_SPREAD = 0.004  # how far around a failed instant the search looks from then on, as a share of the motion
_AFTERWARDS = 0.25  # of the evaluations: for another motion, where a proof failed
_KEPT = 0.2  # of the time: for the same
_INTERRUPTED = 30  # motions given to the proof after Ctrl-C, at most
_LATE = 1e-6  # relative: so much longer than asked for is rounding
_LEAST_EVALUATIONS, _LEAST_SECONDS = 500, 0.02  # for the same
_TRIED_AGAIN = 0.15  # [s] from the beginning: so long a proof that fails may be tried again, however short the time budget
_AT_ONCE = 1e-6  # [s] a search for so long looks at the straight motions

Status = Literal[
    "found", "no_envelope", "start_in_collision", "goal_in_collision", "goal_unreachable", "not_found", "not_proven"
]


def plan(
    problem: Problem,
    settings: PlannerSettings | None = None,
    *,
    rng: Rng = None,
    progress: Callable[[str], Any] | None = None,
) -> Plan:
    """Plan a motion: collision-free and within the limits at every instant, with a proof.

    The particles are the interior control points of spline motions; less violation beats more, and among collision-free
    motions the fitness decides. The first motion comes at once and better ones follow until the budget is spent. A motion
    counts as found only when its certificate holds; where a proof fails the search goes on, and looks at that instant too.
    Ctrl-C ends the search with the best motion so far. With a time budget, one deadline holds for all of it; done once at
    least are the first look for goal configurations, one at the straight motions, and the proof of the best motion.

    Args:
        problem: robot, scene, start and goal.
        settings: of the search.
        rng: seed, generator or None; the plan records the seed.
        progress: called with a word on each stage that begins.

    Returns:
        The plan; `status` says whether there is a motion, `message` what is in the way and what to do if not.

    Raises:
        ProblemError: no problem.
        RobotError: a floating base of a robot that has links, or holds something, of unknown mass.
        SettingsError: settings of something else.
        KeyboardInterrupt: Ctrl-C before there was anything to return.
    """
    if not isinstance(problem, Problem):
        raise ProblemError(f"problem is {shown(problem)}, expected a Problem; make one with Problem(...) or load_problem(...)")
    settings = PlannerSettings() if settings is None else settings
    if not isinstance(settings, PlannerSettings):
        raise SettingsError(f"settings is {shown(settings)}, expected PlannerSettings(...)")
    require_timing(problem, settings)
    require_searchable(problem)
    require_known(problem.base_model, problem.robot)
    run = _Run(problem=problem, settings=settings, seed=seed_of(rng), tell=progress or (lambda _: None))
    try:
        return run.planned()
    except MemoryError:
        raise SettingsError(
            "planning takes more memory than there is; ask for fewer islands, threads, goal_candidates or particles"
        ) from None


def require_timing(problem: Problem, settings: PlannerSettings) -> None:
    """Check that a problem's timing and the settings' go together.

    Raises:
        SettingsError: they do not.
    """
    if problem.duration is not None and settings.time_law != "uniform":
        raise SettingsError(
            f"time_law is {shown(settings.time_law)} and the problem states its duration, expected 'uniform' with it; leave "
            "one of them out"
        )


@dataclass(kw_only=True)
class _Run:
    """One call of `plan`."""

    problem: Problem
    settings: PlannerSettings
    seed: int
    tell: Callable[[str], Any]
    ends: EndReport = field(default_factory=lambda: EndReport(status="free"))
    goal_search: GoalConfigurations | None = None
    islands: Islands | None = None
    certificate: Certificate | None = None
    trajectory: Trajectory | None = None
    base: BaseReport | None = None
    proofs: int = 0
    interrupted: bool = False
    timings: dict[str, float] = field(default_factory=dict)
    begun: float = field(default_factory=time.perf_counter)
    last: float = field(default_factory=time.perf_counter)

    def lap(self, stage: str) -> None:
        """Book the time since the last call on a stage."""
        now = time.perf_counter()
        self.timings[stage] = self.timings.get(stage, 0.0) + now - self.last
        self.last = now

    def planned(self) -> Plan:
        problem, settings = self.problem, self.settings
        if lacks_envelope(problem.robot):
            return self.ended("no_envelope")
        self.ends = check_ends(problem.local)
        if self.ends.status != "free":
            return self.ended(self.ends.status)
        self.lap("prepare")
        self.tell("goal configurations")
        self.goal_search = find_goal_configurations(problem.local, settings, self.seed, late=lambda: self.left <= 0)
        self.lap("goals")
        if not len(self.goal_search.q):
            self.ends = explain_goal(problem.local, self.goal_search)
            status: Status = "goal_in_collision" if self.ends.status == "goal_in_collision" else "goal_unreachable"
            return self.ended(status)
        return self.search()

    @property
    def left(self) -> float:
        """The time that is left [s]; infinite without a time budget."""
        budget = self.settings.time_budget
        return math.inf if budget is None else self.begun + budget - time.perf_counter()

    @property
    def left_again(self) -> float:
        """The time that is left for what is tried again where a proof failed [s]."""
        budget = self.settings.time_budget
        return math.inf if budget is None else self.begun + max(budget, _TRIED_AGAIN) - time.perf_counter()

    def search(self) -> Plan:
        goals = self.goals
        ends = placed_ends(self.problem, goals)
        margins = margins_within_reach(self.problem.local, ends, self.settings.margin)
        self.islands = Islands(self.problem, goals, self.settings, seed=self.seed, margins=margins)
        self.lap("prepare")
        self.tell(f"motions to {len(goals)} goal configuration{'s' if len(goals) != 1 else ''}")
        budget = self._budget()
        try:
            self._go_on(**budget)
            status = self._proven(budget)
        except KeyboardInterrupt:
            interrupt_taken()
            self.lap("search")
            self.interrupted = True
            status = self._best_so_far()
        return self.ended(status)

    @property
    def goals(self) -> Array:
        return np.zeros((0, self.problem.robot.dof)) if self.goal_search is None else self.goal_search.q

    def ended(self, status: Status) -> Plan:
        islands = self.islands
        if status == "not_found" and self.trajectory is None and islands is not None and islands.fallback is not None:
            self.trajectory = self._timed(islands.fallback)  # the best that was seen
            self.certificate = certify(self.problem, self.trajectory)
            self._report()
        self.timings["total"] = time.perf_counter() - self.begun
        return Plan(
            status=status,
            problem=self.problem,
            settings=self.settings,
            seed=self.seed,
            trajectory=self.trajectory,
            certificate=self.certificate,
            goals=self.goals,
            goal_search=self.goal_search,
            ends=self.ends,
            base=self.base,
            fitness=self._fitness(),
            history=() if islands is None else islands.history(),
            proofs=self.proofs,
            evaluations=0 if islands is None else islands.evaluations,
            interrupted=self.interrupted,
            timings=self.timings,
            margins=None if islands is None else islands.margins,
            advice=self._advice(status),
        )

    # ---- the search -------------------------------------------------------------------------------------------------
    def _budget(self) -> dict[str, Any]:
        given = self.settings
        return {
            "evaluations": given.most_evaluations or 0,
            "seconds": 0.0 if given.time_budget is None else max(_AT_ONCE, self.left - _KEPT * given.time_budget),
            "until_first": given.stop_at_first,
            "stall": given.convergence or 0,
        }

    def _go_on(self, *, evaluations: int, seconds: float, until_first: bool, stall: int) -> None:
        assert self.islands is not None
        self.islands.run(evaluations=evaluations, seconds=seconds, until_first=until_first, stall=stall)
        self.lap("search")

    def _again(self, budget: dict[str, Any]) -> None:
        """After a proof that failed: search a little more, within the time that is left."""
        if budget["seconds"]:
            given = self.settings.time_budget or 0.0
            budget = budget | {"seconds": max(_AT_ONCE, min(max(_LEAST_SECONDS, _AFTERWARDS * given), self.left_again))}
        self._go_on(**budget)

    def _proven(self, budget: dict[str, Any]) -> Status:
        """Prove the best motion; where that fails, look for another."""
        assert self.islands is not None
        less = dict(budget)
        if less["evaluations"]:
            less["evaluations"] = max(_LEAST_EVALUATIONS, int(_AFTERWARDS * less["evaluations"]))
        last: Motion | None = None
        for _ in range(self.settings.proofs):
            motion = self.islands.best
            if motion is None and self.certificate is None:
                return "not_found"
            if self.certificate is not None and self.left_again <= 0:
                return "not_proven"
            if motion is None:  # none that passes where proofs failed: a little longer
                self._again(less)
                continue
            if motion == last:
                return "not_proven"  # the search cannot see what the proof does
            if self._holds(motion):
                return "found"
            last = motion
            if self._proven_but():  # but it is not as asked
                self._again(less)
                continue
            near = self.certificate.closest if self.certificate is not None else None
            if near is None or not 0 < near.u < 1:
                if not self.problem.base_model.follows_arm:
                    return "not_proven"  # no other motion would fare better
                self._again(less)
                continue
            self.islands.add_instant(near.u, _SPREAD)
            self._again(less)
        return "not_proven"

    def _best_so_far(self) -> Status:
        """After Ctrl-C: the best motion that holds, of those found."""
        assert self.islands is not None
        for motion in self.islands.motions()[: min(self.settings.proofs, _INTERRUPTED)]:
            if self._holds(motion):
                return "found"
        if self.trajectory is None and self.islands.fallback is None:
            raise KeyboardInterrupt
        return "not_found" if self.trajectory is None else "not_proven"

    def _holds(self, motion: Motion) -> bool:
        self.tell("proof")
        self.proofs += 1
        if self.islands is not None:
            motion = self.islands.settled(motion)
        self.trajectory = self._trajectory(motion)
        if self.settings.time_law != "uniform":  # costs more than a proof, and collisions do not depend on it
            self.certificate = certify(self.problem, self.trajectory, limits=())
        if self.settings.time_law == "uniform" or (self.certificate is not None and self._proven_but()):
            self.trajectory = self._timed(motion)
            self.certificate = certify(self.problem, self.trajectory, jerk_limit=self.settings.jerk_limit)
        self._report()
        self.lap("certify")
        return self.certificate is not None and self.certificate.holds and not self._missed()

    def _proven_but(self) -> bool:
        """Whether the trajectory is proven, though it may not be all that was asked for."""
        return self.certificate is not None and (self.certificate.holds or self.certificate.fails_by_base_limits)

    def _missed(self) -> list[str]:
        """Say what is not as was asked, beside what the certificate is for."""
        missed = [] if self.base is None else list(self.base.missed)
        asked = self.problem.duration
        if asked is not None and self.trajectory is not None and self.trajectory.duration > asked * (1 + _LATE):
            missed.append(f"the joints' limits let it take no less than {self.trajectory.duration:.4g} s, not {asked:.4g} s")
        return missed

    def _report(self) -> None:
        if self.problem.base_model.follows_arm and self.trajectory is not None:
            self.base = report_base(self.problem, self.trajectory)

    def _trajectory(self, motion: Motion, duration: float | None = None) -> Trajectory:
        problem = self.problem
        if problem.duration is not None:
            # The search keeps to it by its instants; where the hulls, which bound what is between, say a little more, so be it.
            duration = max(problem.duration, fastest_duration(problem.robot, motion, jerk_limit=self.settings.jerk_limit))
        return Trajectory(
            problem.robot,
            motion,
            duration=duration,
            base=problem.base,
            base_start=problem.base_start,
            momentum=problem.momentum,
        )

    def _timed(self, motion: Motion) -> Trajectory:
        problem, jerk = self.problem, self.settings.jerk_limit
        if self.settings.time_law == "time_optimal":
            made = time_optimal(problem.robot, motion, jerk_limit=jerk)
            made = replace(made, base=problem.base, base_start=problem.base_start, momentum=problem.momentum)
        else:
            made = self._trajectory(motion, None if jerk is None else fastest_duration(problem.robot, motion, jerk_limit=jerk))
        limits = problem.base_limits
        if problem.duration is not None or (limits.rate is None and limits.joint_momentum is None):
            return made
        return replace(made, duration=made.duration * within_base_limits(problem, made))

    # ---- what is told -----------------------------------------------------------------------------------------------
    def _fitness(self) -> dict[str, float]:
        """The trajectory's terms: length and duration exactly, the others, where they are weighed, as the search has them."""
        if self.trajectory is None or self.islands is None:
            return {}
        terms = self.islands.terms(self.trajectory.motion)
        weighed = {name for name in setting_names(type(self.settings.weights)) if getattr(self.settings.weights, name) > 0}
        exact = {"length": self.trajectory.motion.length(), "duration": self.trajectory.duration}
        return exact | {name: value for name, value in terms.items() if name in weighed and name not in exact}

    def _advice(self, status: Status) -> str:
        near, missed = self.certificate.message if self.certificate is not None else "", self._missed()
        if self.certificate is not None and self.certificate.fails_by_base_limits:
            near = " and ".join(missed)
        elif missed:
            near = f"{near}; {', and '.join(missed)}"
        if status == "not_found":
            said = f"the best one: {near}; " if near else ""
            other = "more interior_points" if missed else "or a smaller margin"
            return f"{said}allow more evaluations or time_budget, {other}"
        if status == "not_proven" and missed and self._proven_but():
            return f"the last one: {near}; allow more evaluations or more interior_points, or ask for less"
        if status == "not_proven":
            more = "a longer time_budget" if self.left_again <= 0 else "more proofs"
            return f"the last one: {near}; ask for a larger margin, or allow {more}"
        return ""
