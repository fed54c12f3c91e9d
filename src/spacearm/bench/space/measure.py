"""One problem and one seed, measured: planned with its base free, and planned as if the base were fixed and then let go."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Literal

from spacearm.bench.space.collection import SpaceProblem
from spacearm.motion import Trajectory
from spacearm.planner import PlannerSettings, Problem, plan, report_base
from spacearm.proof import certify

LetGo = Literal["holds", "collides", "misses its goal", "disturbs the base", "no motion"]
"""What becomes of a fixed-base planner's motion when the base is let go; the first that applies of the failures."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """What is measured. Times are the reference core's.

    Attributes:
        seeds: runs of each problem, with seeds 0, 1, ...
        limit: a problem that takes longer is not solved [s].
    """

    seeds: int = 1
    limit: float = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A problem planned with a seed. Times are as measured here; times `scale` they are the reference core's.

    Attributes:
        family: of the problem.
        name: of the problem.
        seed: of both plans.
        scale: seconds of the reference core for a second of this one, when this was measured.
        status: of `plan()`.
        message: of `plan()`, where it found none.
        seconds: to the first certified motion, all in all [s].
        search: of that, looking for motions [s].
        certify: of that, the proofs [s].
        evaluations: candidate motions looked at.
        length: of the motion [rad]; None where there is none.
        straight: length of the straight line between its ends: none is shorter [rad].
        duration: of the motion [s].
        peak: the greatest angle that the base turns by [rad].
        final: the angle that it has turned by at the end [rad].
        known_length: of the known solution [rad].
        fixed: status of the plan for the fixed base.
        let_go: what became of that motion when the base was let go.
        deepest: how deep it collides then, at the instant that the certificate found [m]; None where it does not.
        missed_by: by how much its tip misses the goal then [m]; None for goals in joint space.
    """

    family: str
    name: str
    seed: int
    scale: float
    status: str
    message: str
    seconds: float
    search: float
    certify: float
    evaluations: int
    length: float | None
    straight: float | None
    duration: float | None
    peak: float | None
    final: float | None
    known_length: float
    fixed: str
    let_go: LetGo
    deepest: float | None
    missed_by: float | None

    @property
    def solved(self) -> bool:
        """Whether a certified motion was found."""
        return self.status == "found"

    def solved_within(self, limit: float) -> bool:
        """Whether it was found within a time of the reference core [s]."""
        return self.solved and self.seconds * self.scale <= limit


def measure(item: SpaceProblem, seed: int, protocol: Protocol, scale: float) -> Run:
    """Measure one problem with one seed.

    Args:
        item: the problem.
        seed: of both plans.
        protocol: what is measured.
        scale: seconds of the reference core for a second of this one.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    settings = PlannerSettings(time_budget=protocol.limit / scale, stop_at_first=True, threads=1)
    begun = time.perf_counter()
    found = plan(_unseen(item.problem), settings, rng=seed)
    seconds = time.perf_counter() - begun
    fixed = plan(_held(item.problem), settings, rng=seed)
    if found.interrupted or fixed.interrupted:
        raise KeyboardInterrupt
    let_go: LetGo = "no motion"
    deepest = missed_by = None
    if fixed.found and fixed.trajectory is not None:
        let_go, deepest, missed_by = released(item.problem, fixed.trajectory)
    motion = found.trajectory.motion if found.found and found.trajectory is not None else None
    base = found.base if motion is not None else None
    return Run(
        family=item.family,
        name=item.name,
        seed=seed,
        scale=scale,
        status=found.status,
        message="" if found.found else found.message,
        seconds=seconds,
        search=found.timings.get("search", 0.0),
        certify=found.timings.get("certify", 0.0),
        evaluations=found.evaluations,
        length=None if motion is None else motion.length(),
        straight=None if motion is None else math.dist(motion.control_points[0], motion.control_points[-1]),
        duration=None if motion is None or found.trajectory is None else found.trajectory.duration,
        peak=None if base is None else base.peak,
        final=None if base is None else base.final,
        known_length=item.solution.motion.length(),
        fixed=fixed.status,
        let_go=let_go,
        deepest=deepest,
        missed_by=missed_by,
    )


def released(problem: Problem, trajectory: Trajectory) -> tuple[LetGo, float | None, float | None]:
    """Let the base go that a trajectory was planned to be fixed for.

    Args:
        problem: with a base that floats.
        trajectory: of the same joints, with the base fixed.

    Returns:
        What becomes of it, how deep it collides [m], and by how much its tip misses the goal [m].
    """
    free = replace(trajectory, base="floating", base_start=problem.base_start, momentum=problem.momentum)
    certificate, report = certify(problem, free), report_base(problem, free)
    closest = certificate.closest
    if closest is not None and closest.clearance <= 0:
        return "collides", -closest.clearance, report.goal_distance
    if any("end effector" in phrase for phrase in report.missed):
        return "misses its goal", None, report.goal_distance
    return ("disturbs the base" if report.missed else "holds"), None, report.goal_distance


def _held(problem: Problem) -> Problem:
    """The same problem for a planner that thinks the base fixed: nothing can be asked of it then."""
    return replace(problem, base="fixed", base_goal=None, base_limits=None)  # type: ignore[arg-type]


def _unseen(problem: Problem) -> Problem:
    """The same problem as if it were new: what the planner keeps of problems that it has seen does not count."""
    return replace(problem, scene=type(problem.scene)(problem.scene.obstacles))
