"""Planning: goal configurations, a search for motions to them, and a proof of what it finds.

In the order of reading: `plan` checks what it is given; `_planned` goes through the stages; `_Search` searches and proves in
turn until a proof holds; `_prove` makes a trajectory of a motion, and its certificate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import SettingsError
from spacearm.core.extras import require_extra
from spacearm.core.interrupts import interrupt_taken
from spacearm.core.random_seed import Rng, seed_of
from spacearm.core.records import setting_names
from spacearm.dynamics.base_models import require_known
from spacearm.motion import Motion, Trajectory, fastest_duration, time_optimal
from spacearm.planner.explanations import EndReport, check_ends, explain_goal
from spacearm.planner.inverse_kinematics import GoalConfigurations, find_goal_configurations
from spacearm.planner.motion_search import Islands
from spacearm.planner.plan_clock import PlanClock
from spacearm.planner.plan_result import BaseReport, Plan, SearchState, report_base, within_base_limits
from spacearm.planner.planner_settings import PlannerSettings, Weights, as_planner_settings
from spacearm.planner.problem import Problem, as_searchable
from spacearm.planner.tracking_ends import check_tube_at_ends, with_tube_explained
from spacearm.planner.tracking_room import tracking_room
from spacearm.proof import Certificate
from spacearm.proof import certify as certify
from spacearm.robot.unchecked_pairs import lacks_envelope

Array = NDArray[np.float64]

# What is tried again where a proof failed. The figures are choices, not measured: enough for another motion, and small against
# the first search.
_SPREAD = 0.004  # how far around an instant where a proof failed the search looks from then on, as a share of the motion
_EVALUATIONS_AGAIN = 0.25  # share of `evaluations` for the search of another motion
_SECONDS_AGAIN = 0.25  # share of `time_budget` for the same
_LEAST_EVALUATIONS_AGAIN = 500  # however small the share is
_LEAST_SECONDS_AGAIN = 0.02  # [s] likewise
_SECONDS_FOR_PROOFS = 0.2  # share of `time_budget` that the first search leaves for proofs and what follows them
_LEAST_SEARCH = 1e-3  # [s] for a first motion, however little time there is: most problems need less
_LEAST_SECONDS = 1e-6  # [s] a search for so long looks at the straight motions and ends; 0 would be no limit
_EARLIER = (0.5, 1.0)  # which of the motions found, from the best to the first, are proven where nothing else is left
_PROVEN_AFTER_INTERRUPT = 30  # motions given to the proof after Ctrl-C, at most
_DURATION_ROUNDING = 1e-6  # relative: a motion that takes so much longer than asked for is as long as asked for

Status = Literal[
    "found", "no_envelope", "start_in_collision", "goal_in_collision", "goal_unreachable", "not_found", "not_proven"
]


def plan(
    problem: Problem,
    settings: PlannerSettings | None = None,
    *,
    rng: Rng = None,
    progress: Callable[[str], object] | None = None,
    watch: Callable[[SearchState], object] | None = None,
) -> Plan:
    """Plan a motion: collision-free and within the limits at every instant, with a proof.

    The search is a hybrid of three methods that take turns: RRT-Connect trees, local refinement and the particle swarm. The
    trees find first paths around obstacles. Refinement pulls the best motion towards the straight one. The swarm's particles
    are interior control points of spline motions; they begin around the motions known, or anywhere while there is none. Less
    violation beats more, and among collision-free motions the fitness decides. `Plan.history` says what each method found.

    The first motion comes at once, and better ones follow until the budget is spent. A motion counts as found only when its
    certificate holds; where a proof fails the search goes on, and looks at that instant too. Ctrl-C ends the search with the
    best motion so far. With a time budget, one deadline holds for all of it; done once at least are the first look for goal
    configurations, one at the straight motions, and the proof of the best motion.

    Args:
        problem: robot, scene, start and goal.
        settings: of the search.
        rng: random seed, generator or None; the plan records the seed.
        progress: called with a word on each stage that begins.
        watch: called with what has been found, some 25 times a second while motions are searched for, and never twice at once;
            with several islands from their threads. It changes nothing. If it raises KeyboardInterrupt, the search ends as by
            Ctrl-C.

    Returns:
        The plan; `status` says whether there is a motion, `message` what is in the way and what to do if not.

    Raises:
        ProblemError: no problem, or a joint that begins or ends nearer to a limit than its tracking error.
        RobotError: a floating base of a robot that has links, or holds something, of unknown mass.
        SettingsError: settings of something else; or a tracking error of what is no joint, or of an arm that moves its base.
        KeyboardInterrupt: Ctrl-C before there was anything to return.
    """
    problem, settings = as_searchable(problem), as_planner_settings(settings)
    require_timing(problem.duration, settings)
    require_known(problem.base_model, problem.robot)
    try:
        return _planned(problem, settings, seed_of(rng), _Listeners(progress or _untold, watch))
    except MemoryError:
        raise SettingsError(
            "planning takes more memory than there is; ask for fewer islands, threads, goal_candidates or particles"
        ) from None


def require_timing(duration: float | None, settings: PlannerSettings) -> None:
    """Check that the duration that a problem states, if it does, and the settings go together.

    Raises:
        SettingsError: they do not; or a library that a time law needs is not installed.
    """
    if settings.time_law == "time_optimal":
        require_extra("toppra", "the time law 'time_optimal'", instead="use the time law 'uniform'")
    if duration is not None and settings.time_law != "uniform":
        raise SettingsError(
            f"time_law is {shown(settings.time_law)} and the problem states its duration, expected 'uniform' with it; leave "
            "one of them out"
        )


def _untold(_: str) -> None:
    """Nobody is told."""


class _Listeners(NamedTuple):
    """Who is told what goes on.

    Attributes:
        tell: a word on each stage.
        watch: what has been found; None: nobody is.
    """

    tell: Callable[[str], object]
    watch: Callable[[SearchState], object] | None


def _planned(problem: Problem, settings: PlannerSettings, seed: int, listeners: _Listeners) -> Plan:
    """Go through the stages: the ends, the goal configurations, the search with its proofs. The first that fails ends it."""
    clock, tell = PlanClock(settings.time_budget), listeners.tell

    def without_search(status: Status, ends: EndReport, found: GoalConfigurations | None = None) -> Plan:
        goals = np.zeros((0, len(problem.start))) if found is None else found.q
        return Plan(
            status=status,
            problem=problem,
            settings=settings,
            seed=seed,
            goals=goals,
            goal_search=found,
            ends=ends,
            timings=clock.total(),
        )

    ends = EndReport(status="free")
    if lacks_envelope(problem.robot):
        return without_search("no_envelope", ends)
    ends = check_ends(problem.local)
    tube = tracking_room(problem.local, settings)
    if tube is not None and ends.status == "free":
        ends = check_tube_at_ends(problem.local, tube)
    if ends.status != "free":
        return without_search(ends.status, ends)
    clock.lap("prepare")
    tell("goal configurations")
    found = find_goal_configurations(problem.local, settings, seed, late=lambda: clock.left <= 0)
    clock.lap("goals")
    if not len(found.q):
        ends = explain_goal(problem.local, found)
        ends = ends if tube is None else with_tube_explained(problem.local, ends, tube)
        unreachable = ends.status != "goal_in_collision"
        return without_search("goal_unreachable" if unreachable else "goal_in_collision", ends, found)

    islands = Islands(problem, found.q, settings, seed=seed)
    clock.lap("prepare")
    tell(f"motions to {len(found.q)} goal configuration{'s' if len(found.q) != 1 else ''}")
    wider = None if tube is None else partial(Islands, problem, found.q, settings, seed=seed, wide=True)
    search = _Search(problem=problem, settings=settings, islands=islands, clock=clock, listeners=listeners, wider=wider)
    status = search.run()
    islands = search.islands
    proof = search.proof or search.of_fallback()
    less = _Less()
    if status != "found" and not search.interrupted and _lacks_clearance(problem, proof):
        less = _with_less(search, proof, found.q, seed)
        clock.lap("less clearance")
        status = status if less.share is None else "not_found"
    return Plan(
        status=status,
        problem=problem,
        settings=settings,
        seed=seed,
        trajectory=None if proof is None else proof.trajectory,
        certificate=None if proof is None else proof.certificate,
        goals=found.q,
        goal_search=found,
        ends=ends,
        base=None if proof is None else proof.base,
        fitness={} if proof is None else _fitness(proof.trajectory, islands, settings.weights),
        history=islands.history(),
        proofs=search.proofs,
        evaluations=search.evaluated + islands.evaluations,
        interrupted=search.interrupted,
        timings=clock.total(),
        searched=islands.searched,
        achievable=less.share,
        advice=_advice(status, proof, _on_less(problem, less), spent=clock.left_again <= 0, tube=tube is not None),
    )


# ---- Search and proof in turn ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Budget:
    """How long the islands search, 0 is no limit; and whether they end with the first motion, whatever the settings say."""

    evaluations: int
    seconds: float
    until_first: bool = False


@dataclass(kw_only=True)
class _Search:
    """A search for a motion whose proof holds. What it has found stays when Ctrl-C ends it.

    Attributes:
        problem: to be proven.
        settings: of the planner.
        islands: that search for motions; they take instants where a proof failed.
        clock: of this call.
        listeners: told when a proof begins, and what has been found.
        wider: makes islands with more room for a tracking error, for where the search cannot see what the proof does; None if
            there is none, or they are at work already.
        proof: the last one that was tried.
        proofs: how many were.
        interrupted: whether Ctrl-C ended the search.
        evaluated: candidate motions that islands before these looked at.
    """

    problem: Problem
    settings: PlannerSettings
    islands: Islands
    clock: PlanClock
    listeners: _Listeners
    wider: Callable[[], Islands] | None
    proof: _Proof | None = field(default=None, init=False)
    proofs: int = field(default=0, init=False)
    interrupted: bool = field(default=False, init=False)
    _fallback: _Proof | None = field(default=None, init=False)
    evaluated: int = field(default=0, init=False)

    def run(self) -> Status:
        """Search until the budget is spent, and prove the best motion; where that fails, look for another."""
        budget, clock = self.settings.time_budget, self.clock
        seconds = 0.0 if budget is None else max(_LEAST_SECONDS, clock.left - _SECONDS_FOR_PROOFS * budget)
        try:
            self._go_on(_Budget(evaluations=self.settings.most_evaluations or 0, seconds=seconds))
            self._go_on_to_first(seconds)
            return self._prove_best()
        except KeyboardInterrupt:
            interrupt_taken()
            clock.lap("search")
            self.interrupted = True
            return self._best_so_far()

    def _go_on_to_first(self, searched: float) -> None:
        """After a first search of less than 1 ms that found nothing, search until it is 1 ms, or until there is a motion."""
        most = self.settings.most_evaluations
        left = 0 if most is None else most - self.islands.evaluations
        if 0 < searched < _LEAST_SEARCH and not self.islands.found and (most is None or left > 0):
            self._go_on(_Budget(evaluations=left, seconds=_LEAST_SEARCH - searched, until_first=True))

    def _go_on(self, budget: _Budget) -> None:
        self.islands.run(
            evaluations=budget.evaluations,
            seconds=budget.seconds,
            until_first=budget.until_first or self.settings.stop_at_first,
            stall=self.settings.convergence or 0,
            watch=self.listeners.watch,
        )
        self.clock.lap("search")

    def _go_on_after_failure(self) -> None:
        """Search a little more, within the time that is left."""
        evaluations, seconds = self.settings.most_evaluations or 0, self.settings.time_budget or 0.0
        if evaluations:
            evaluations = max(_LEAST_EVALUATIONS_AGAIN, int(_EVALUATIONS_AGAIN * evaluations))
        if seconds:
            wanted = max(_LEAST_SECONDS_AGAIN, _SECONDS_AGAIN * seconds)
            seconds = max(_LEAST_SECONDS, min(wanted, self.clock.left_again))
        self._go_on(_Budget(evaluations=evaluations, seconds=seconds))

    def _prove_best(self) -> Status:
        """Prove the best motion; where that fails, look for another."""
        failed: Motion | None = None
        for _ in range(self.settings.proofs):
            motion = self.islands.best
            if motion is None and self.proof is None:
                return self._of_fallback()
            if self.proof is not None and self.clock.left_again <= 0:
                return self._prove_earlier()
            if motion is not None:
                if motion == failed and self.wider is None:
                    return self._prove_earlier()  # the search cannot see what the proof does
                if motion == failed:
                    self._widen()
                    continue
                proof = self._prove(motion)
                if proof.as_asked:
                    return "found"
                failed = motion
                near = None if proof.collision_free else proof.certificate.closest
                if near is not None and 0 < near.u < 1:
                    self.islands.add_instant(near.u, _SPREAD)
                elif not proof.collision_free and not self.problem.base_model.follows_arm:
                    return "not_proven"  # an end is too near: no other motion would fare better
            self._go_on_after_failure()
        return "not_proven"

    def _widen(self) -> None:
        """Search anew, with more room for the tracking error."""
        assert self.wider is not None
        self.evaluated += self.islands.evaluations
        self.islands, self.wider = self.wider(), None
        self._go_on_after_failure()

    def _prove_earlier(self) -> Status:
        """Prove motions that were found earlier: what is not as good yet mostly has more clearance."""
        motions = self.islands.motions()
        for share in _EARLIER:
            if self.proofs >= self.settings.proofs or not motions:
                break
            if self._prove(motions[round(share * (len(motions) - 1))]).as_asked:
                return "found"
        return "not_proven"

    def _best_so_far(self) -> Status:
        """After Ctrl-C: the best motion that holds, of those found."""
        for motion in self.islands.motions()[: min(self.settings.proofs, _PROVEN_AFTER_INTERRUPT)]:
            if self._prove(motion).as_asked:
                return "found"
        if self.proof is None and self.islands.fallback is None:
            raise KeyboardInterrupt
        return "not_found" if self.proof is None else "not_proven"

    def _of_fallback(self) -> Status:
        """Prove the motion that lacks least: it may have what is required, though not the room that the search wants."""
        proof = self.of_fallback()
        if proof is None or not proof.as_asked:
            return "not_found"
        self.proof, self.proofs = proof, 1
        return "found"

    def of_fallback(self) -> _Proof | None:
        """Return what is known of the motion that lacks least, if any was looked at."""
        if self._fallback is None and self.islands.fallback is not None:
            self._fallback = _prove(self.problem, self.settings, self.islands.projected(self.islands.fallback))
            self.clock.lap("certify")
        return self._fallback

    def _prove(self, motion: Motion) -> _Proof:
        self.listeners.tell("proof")
        self.proofs += 1
        self.proof = _prove(self.problem, self.settings, self.islands.projected(motion))
        self.clock.lap("certify")
        return self.proof


# ---- A motion in time, and its proof ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Proof:
    """What is known of a motion in time.

    Attributes:
        trajectory: the motion in time.
        certificate: of it.
        base: what it does to a base that follows the arm; None where it does not.
        missed: what is not as was asked, a phrase each, beside what the certificate is for.
    """

    trajectory: Trajectory
    certificate: Certificate
    base: BaseReport | None
    missed: tuple[str, ...]

    @property
    def collision_free(self) -> bool:
        """Whether the trajectory is proven, though it may not be all that was asked for."""
        return self.certificate.holds or self.certificate.fails_by_base_limits

    @property
    def as_asked(self) -> bool:
        """Whether the trajectory is proven, and all that was asked for."""
        return self.certificate.holds and not self.missed


def _prove(problem: Problem, settings: PlannerSettings, motion: Motion) -> _Proof:
    """Make a trajectory of a motion, and its certificate."""
    if settings.time_law != "uniform":  # the time-optimal law costs more than a proof, and collisions do not depend on it
        trajectory = _uniform(problem, motion, jerk_limit=settings.jerk_limit)
        proof = _proof(problem, trajectory, certify(problem, trajectory, limits=(), tracking=settings.tracking))
        if not proof.collision_free:
            return proof
    trajectory = _timed(problem, settings, motion)
    return _proof(problem, trajectory, certify(problem, trajectory, jerk_limit=settings.jerk_limit, tracking=settings.tracking))


def _proof(problem: Problem, trajectory: Trajectory, certificate: Certificate) -> _Proof:
    base = report_base(problem, trajectory) if problem.base_model.follows_arm else None
    missed = () if base is None else base.missed
    asked = problem.duration
    if asked is not None and trajectory.duration > asked * (1 + _DURATION_ROUNDING):
        missed = (*missed, f"the joints' limits let it take no less than {trajectory.duration:.4g} s, not {asked:.4g} s")
    return _Proof(trajectory=trajectory, certificate=certificate, base=base, missed=missed)


def _timed(problem: Problem, settings: PlannerSettings, motion: Motion) -> Trajectory:
    """Return a motion in the time that settings and problem ask for."""
    jerk = settings.jerk_limit
    if settings.time_law == "time_optimal":
        made = time_optimal(problem.robot, motion, jerk_limit=jerk)
        made = replace(made, base=problem.base, base_start=problem.base_start, momentum=problem.momentum)
    else:
        fastest = None if jerk is None else fastest_duration(problem.robot, motion, jerk_limit=jerk)
        made = _uniform(problem, motion, fastest, jerk_limit=jerk)
    limits = problem.base_limits
    if problem.duration is not None or (limits.rate is None and limits.joint_momentum is None):
        return made
    return replace(made, duration=made.duration * within_base_limits(problem, made))


def _uniform(problem: Problem, motion: Motion, duration: float | None = None, *, jerk_limit: float | None) -> Trajectory:
    if problem.duration is not None:
        # The search keeps the duration at its instants. The hulls also bound what is between, and may ask for a little more.
        duration = max(problem.duration, fastest_duration(problem.robot, motion, jerk_limit=jerk_limit))
    return Trajectory(
        problem.robot,
        motion,
        duration=duration,
        base=problem.base,
        base_start=problem.base_start,
        momentum=problem.momentum,
    )


# ---- Less clearance, where the one that is required is not met ---------------------------------------------------------

_LESS_SHARE = 0.125  # of `evaluations` and `convergence`, or of what is left of `time_budget`, for each try with less clearance
_LESS_PROOFS = 4  # motions given to the proof in each
_SURELY_KEPT = (0.95, 0.5)  # of what the closest pair of a motion was measured to have, in turn
_BISECTIONS = 4  # tries between no clearance at all and the one that is required


def _lacks_clearance(problem: Problem, proof: _Proof | None) -> bool:
    """Whether a clearance is required, and it may be what no motion was found for."""
    asked = problem.clearance > 0 or any(pair.clearance > 0 for pair in problem.clearances)
    return asked and (proof is None or not proof.collision_free)


class _Less(NamedTuple):
    """What was found with less clearance than is required.

    Attributes:
        share: the share of it with which a motion is found and proven; None if none was found.
        none: whether none was found with a clearance of 0.
    """

    share: float | None = None
    none: bool = False


def _with_less(search: _Search, failed: _Proof | None, goals: Array, seed: int) -> _Less:
    """Look for the share of the clearances required with which a motion is found and proven.

    If the motion whose proof failed last keeps some of them, it is the first. More is found by bisection. The searches have
    seeds of their own, which follow from the plan's.
    """
    problem, settings, clock = search.problem, search.settings, search.clock
    share, most = None, 1.0
    try:
        search.listeners.tell("a motion with less clearance")
        share = _share_kept(problem, settings, failed)
        for number in range(1 + _BISECTIONS):
            if clock.left_again <= 0:
                break
            tried = 0.0 if share is None else (share + most) / 2
            if _is_met(with_less_clearance(problem, tried), goals, settings, (seed + 1 + number) % 2**63, clock):
                share = tried
            elif share is None:
                return _Less(none=True)
            else:
                most = tried
    except KeyboardInterrupt:
        interrupt_taken()
        search.interrupted = True
    return _Less(share)


def _share_kept(problem: Problem, settings: PlannerSettings, failed: _Proof | None) -> float | None:
    """Return a share of the clearances required that a motion is proven to keep; None if it is proven to keep none."""
    near = None if failed is None else failed.certificate.closest
    if failed is None or near is None or not 0 < near.clearance < near.required:
        return None
    for kept in _SURELY_KEPT:
        share = math.floor(kept * near.clearance / near.required * 100) / 100
        if _prove(with_less_clearance(problem, share), settings, failed.trajectory.motion).as_asked:
            return share
    return None


def with_less_clearance(problem: Problem, share: float) -> Problem:
    """Return the problem with a share of its clearances."""
    pairs = [replace(pair, clearance=share * pair.clearance) for pair in problem.clearances]
    return replace(problem, clearance=share * problem.clearance, clearances=tuple(pairs))


def _is_met(problem: Problem, goals: Array, settings: PlannerSettings, seed: int, clock: PlanClock) -> bool:
    """Search for a first motion for a while, and return whether one is proven."""
    islands = Islands(problem, goals, settings, seed=seed)
    evaluations, stall = (
        max(_LEAST_EVALUATIONS_AGAIN, int(_LESS_SHARE * given)) if given else 0
        for given in (settings.most_evaluations, settings.convergence)
    )
    for _ in range(_LESS_PROOFS):
        seconds = 0.0 if settings.time_budget is None else max(_LEAST_SECONDS, _LESS_SHARE * clock.left_again)
        islands.run(evaluations=evaluations, seconds=seconds, until_first=True, stall=stall)
        motion = islands.best or islands.fallback
        if motion is None:
            return False
        proof = _prove(problem, settings, islands.projected(motion))
        if proof.as_asked or islands.best is None:
            return proof.as_asked
        near = proof.certificate.closest
        if proof.collision_free or near is None or not 0 < near.u < 1 or clock.left_again <= 0:
            return False
        islands.add_instant(near.u, _SPREAD)
    return False


def _on_less(problem: Problem, less: _Less) -> str:
    """Say with how much clearance a motion is found and proven; "" if that is not known."""
    if less.share is None:
        return "none was found with clearance 0 either" if less.none else ""
    clearance, found = f"clearance {less.share * problem.clearance:.4g}", "a motion is found and proven"
    if not problem.clearances:
        return f"with {clearance} {found}"
    return f"with {less.share:.4g} of every clearance asked for ({clearance}) {found}"


# ---- Fitness and advice of the plan ----------------------------------------------------------------------------------


def _fitness(trajectory: Trajectory, islands: Islands, weights: Weights) -> dict[str, float]:
    """Return the trajectory's terms: length and duration exactly, the others as the search has them where they are weighed."""
    exact = {"length": trajectory.motion.length(), "duration": trajectory.duration}
    weighed = {name for name in setting_names(Weights) if getattr(weights, name) > 0} - set(exact)
    terms = islands.terms(trajectory.motion) if weighed else {}
    return exact | {name: value for name, value in terms.items() if name in weighed}


def _advice(status: Status, proof: _Proof | None, on_less: str, *, spent: bool, tube: bool) -> str:
    """Return what to do if there is no motion.

    `on_less` says what is found with less clearance, `spent` that the time is, `tube` that there is a tracking error.
    """
    if status == "found":
        return ""
    smaller = ", or a smaller tracking error" if tube else ""
    near, missed = ("", ()) if proof is None else (proof.certificate.message, proof.missed)
    if proof is not None and proof.certificate.fails_by_base_limits:
        near = " and ".join(missed)
    elif missed:
        near = f"{near}; {', and '.join(missed)}"
    if status == "not_found":
        said = [f"the best one: {near}"] if near else []
        other = "or a smaller clearance" if on_less.startswith("with ") and not missed else "or more interior_points"
        return "; ".join([*([on_less] if on_less else []), *said, f"allow more evaluations or time_budget, {other}{smaller}"])
    if status == "not_proven" and missed and proof is not None and proof.collision_free:
        return f"the last one: {near}; allow more evaluations or more interior_points, or ask for less"
    if status == "not_proven":
        more = "a longer time_budget" if spent else "more proofs"
        return f"the last one: {near}; allow {more}{smaller}"
    return ""
