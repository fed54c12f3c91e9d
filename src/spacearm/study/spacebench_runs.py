"""SpaceBench measured: each problem with each seed is a task, and so is each seed of the published problems.

A task plans a problem with its base free to move. Then it plans the same problem as if the base were fixed, and judges that
motion on the free base.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any, Literal

from spacearm.motion import Trajectory
from spacearm.planner import PlannerSettings, Problem, Weights, plan, report_base
from spacearm.proof import certify
from spacearm.proof.certificate import digest
from spacearm.robot.model import robot_as_dict
from spacearm.study.reference_core import CoreSpeed, load_now, scale_now, speed_for
from spacearm.study.run_study import Progress, Study, jobs_of, run_study
from spacearm.study.spacebench import SpaceProblem, papers_problem, servicer_problem, space_problem_as_dict

SERVICER, LEAST_PEAK, PAPERS_SCENE = "servicer", "servicer, least peak", "the paper's scene"
"""The published problems, as the report calls them."""

_CALM = Weights(length=1e-3, base_peak=10.0)
_INTERIOR = 4  # control points where the least peak is looked for

Outcome = Literal["holds", "collides", "comes too near", "misses its goal", "disturbs the base", "no motion"]
"""What becomes of a motion that was planned for a fixed base when the base is free to move; the first failure that applies.

It comes too near if it touches nothing, and has less than the problem's clearance or not provably more.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpaceProtocol:
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
        load: how many processes wanted a core then; None where the system does not tell.
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
        let_go: what becomes of that motion when the base is free to move.
        deepest: how deep it collides then, at the instant that the certificate found [m]; None where it does not.
        missed_by: by how much its tip misses the goal then [m]; None for goals in joint space.
        clearance: that the problem asks for [m].
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
    let_go: Outcome
    deepest: float | None
    missed_by: float | None
    load: float | None = None
    clearance: float = 0.0

    @property
    def solved(self) -> bool:
        """Whether a certified motion was found."""
        return self.status == "found"

    def solved_within(self, limit: float) -> bool:
        """Whether it was found within a time of the reference core [s]."""
        return self.solved and self.seconds * self.scale <= limit


def measure(item: SpaceProblem, seed: int, protocol: SpaceProtocol, speed: CoreSpeed) -> Run:
    """Measure one problem with one seed.

    Args:
        item: the problem.
        seed: of both plans.
        protocol: what is measured.
        speed: of this core.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    scale = speed.scale
    settings = PlannerSettings(time_budget=protocol.limit / scale, stop_at_first=True, threads=1)
    begun = time.perf_counter()
    found = plan(_unseen(item.problem), settings, rng=seed)
    seconds = time.perf_counter() - begun
    fixed = plan(for_a_fixed_base(item.problem), settings, rng=seed)
    if found.interrupted or fixed.interrupted:
        raise KeyboardInterrupt
    let_go: Outcome = "no motion"
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
        clearance=item.problem.clearance,
        load=None if math.isnan(speed.load) else speed.load,
    )


def released(problem: Problem, trajectory: Trajectory) -> tuple[Outcome, float | None, float | None]:
    """Judge a trajectory that was planned for a fixed base on a base that is free to move.

    Args:
        problem: with a base that floats.
        trajectory: of the same joints, with the base fixed.

    Returns:
        What becomes of it, how deep it collides [m], and by how much its tip misses the goal [m].
    """
    free = on_a_free_base(problem, trajectory)
    certificate, report = certify(problem, free), report_base(problem, free)
    closest = certificate.closest
    if closest is not None and closest.clearance <= 0:
        return "collides", -closest.clearance, report.goal_distance
    if not certificate.clear:
        return "comes too near", None, report.goal_distance
    if any("end effector" in phrase for phrase in report.missed):
        return "misses its goal", None, report.goal_distance
    return ("disturbs the base" if report.missed else "holds"), None, report.goal_distance


def on_a_free_base(problem: Problem, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory of a fixed base on the base of a problem, which is free to move."""
    return replace(trajectory, base="floating", base_start=problem.base_start, momentum=problem.momentum)


def for_a_fixed_base(problem: Problem) -> Problem:
    """Return the same problem with the base fixed, and nothing required of it."""
    return replace(problem, base="fixed", base_goal=None, base_limits=None)  # type: ignore[arg-type]


def _unseen(problem: Problem) -> Problem:
    """Return the same problem with a new scene, so that what the planner computed for the scene before does not count."""
    return replace(problem, scene=type(problem.scene)(problem.scene.obstacles))


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedRun:
    """A published problem with a seed, to the first certified motion, or with the base's peak as the fitness.

    Attributes:
        what: `SERVICER`, `LEAST_PEAK` or `PAPERS_SCENE`.
        seed: of the plan.
        scale: seconds of the reference core for a second of this one, when this was measured.
        load: how many processes wanted a core then; None where the system does not tell.
        status: of the plan.
        seconds: all in all [s].
        parts: of that, by stage [s].
        goal_distance: by which the end effector misses its goal [m]; None where there is no motion.
        goal_angle: likewise [rad].
        base_final: by how much the base is turned at the end [rad].
        base_peak: the greatest angle by which it is turned during the motion [rad].
    """

    what: str
    seed: int
    scale: float
    status: str
    seconds: float
    parts: dict[str, float]
    goal_distance: float | None
    goal_angle: float | None
    base_final: float | None
    base_peak: float | None
    load: float | None = None


# ---- the studies -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class SpaceTask:
    """A problem to be measured with a seed.

    Attributes:
        item: the problem.
        seed: of both plans.
        protocol: what is measured.
    """

    item: SpaceProblem
    seed: int
    protocol: SpaceProtocol


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedTask:
    """A published problem to be planned with a seed.

    Attributes:
        what: `SERVICER`, `LEAST_PEAK` or `PAPERS_SCENE`.
        seed: of the plan.
        limit: of the time to the first certified motion [s of the reference core].
        peak_budget: how long the least peak is looked for [s of the reference core].
    """

    what: str
    seed: int
    limit: float
    peak_budget: float


def run_space_task(task: SpaceTask) -> Run:
    """Measure a task. In each process, the first one is measured twice: what is imported on the way is not timed."""
    speed = speed_for(f"SpaceBench, {task.item.family}")
    if not _measured:
        measure(task.item, 0, task.protocol, speed)
        _measured.append(True)
    return measure(task.item, task.seed, task.protocol, speed)


def run_published_task(task: PublishedTask) -> PublishedRun:
    """Plan a published problem; the speed of the core is measured before each."""
    _warm_published(task.what)
    problem, scale, load = _published(task.what), scale_now(), load_now()
    settings = PlannerSettings(time_budget=task.limit / scale, stop_at_first=True)
    if task.what == LEAST_PEAK:
        settings = PlannerSettings(time_budget=task.peak_budget / scale, weights=_CALM, interior_points=(_INTERIOR,))
    begun = time.perf_counter()
    found = plan(problem, settings, rng=task.seed)
    seconds = time.perf_counter() - begun
    if found.interrupted:
        raise KeyboardInterrupt
    base = found.base if found.found else None
    return PublishedRun(
        what=task.what,
        seed=task.seed,
        scale=scale,
        status=found.status,
        seconds=seconds,
        parts={name: value for name, value in found.timings.items() if name != "total"},
        goal_distance=None if base is None else base.goal_distance,
        goal_angle=None if base is None else base.goal_angle,
        base_final=None if base is None else base.final,
        base_peak=None if base is None else base.peak,
        load=None if math.isnan(load) else load,
    )


def _published(what: str) -> Problem:
    if what == PAPERS_SCENE:
        return papers_problem()
    return servicer_problem(restore=what == SERVICER)


_measured: list[bool] = []  # not empty once this process has measured a task


@cache
def _warm_published(what: str) -> None:
    """Plan once in each process: what is read on the way is not timed."""
    plan(_published(what), PlannerSettings(evaluations=100, stop_at_first=True), rng=0)


def _defined(item: SpaceProblem) -> dict[str, Any]:
    """What a problem's records belong to; a clearance of 0 is not part of it, so that older records stay."""
    values = space_problem_as_dict(item)
    return values if values["clearance"] else {key: value for key, value in values.items() if key != "clearance"}


SPACE = Study(
    name="spacebench",
    run=run_space_task,
    record=Run,
    key=lambda task: f"{task.item.name} seed {task.seed}",
    definition=lambda task: {
        "limit_s": task.protocol.limit,
        "robot": digest(robot_as_dict(task.item.problem.robot)),
        "problem": digest(_defined(task.item)),
    },
    timed=True,
)
"""The study of the problems of the set."""

PUBLISHED = Study(
    name="spacebench, published problems",
    run=run_published_task,
    record=PublishedRun,
    key=lambda task: f"{task.what} seed {task.seed}",
    definition=lambda task: {"limit_s": task.limit, "peak_budget_s": task.peak_budget},
    timed=True,
)
"""The study of the published problems."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpaceBench:
    """All runs, and how they were made.

    Attributes:
        protocol: what was measured.
        runs: by family, problem and seed.
        published: runs of the published problems.
        seconds: that it took; of a study that was resumed, since then.
        jobs: how many runs were measured at a time.
    """

    protocol: SpaceProtocol
    runs: tuple[Run, ...]
    published: tuple[PublishedRun, ...]
    seconds: float
    jobs: int = 1

    @property
    def families(self) -> tuple[str, ...]:
        """The families, in order."""
        return tuple(dict.fromkeys(run.family for run in self.runs))

    @property
    def loads(self) -> tuple[float, ...]:
        """How many processes wanted a core, each time the core was measured; nan where the system does not tell."""
        groups = [key for key, _ in groupby(self.runs, key=lambda run: (run.family, run.load))]
        groups += [key for key, _ in groupby(self.published, key=lambda run: (run.what, run.load))]
        return tuple(math.nan if load is None else load for _, load in groups)


def run_spacebench(
    items: Sequence[SpaceProblem],
    protocol: SpaceProtocol | None = None,
    *,
    published: int = 0,
    peak_budget: float = 2.0,
    records: Path | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> SpaceBench:
    """Measure problems with all seeds; before each family the speed of the core is measured anew.

    Args:
        items: the problems, a family's together.
        protocol: what is measured.
        published: seeds of each of the published problems; 0 leaves them out.
        peak_budget: how long each search for the least peak of the servicer's base goes on, on the reference core [s].
        records: file to which each run is appended, and which a stopped benchmark is resumed from; see `run_study`. The runs of
            the published problems go into a second file beside it, its name with "-published".
        jobs: runs measured at a time; None: one, for they disturb each other.
        progress: called with the runs done, the runs in all, and what is next.

    Raises:
        SpacearmError: as of `run_study`.
        KeyboardInterrupt: Ctrl-C.
    """
    protocol = SpaceProtocol() if protocol is None else protocol
    begun, tell = time.perf_counter(), progress or (lambda done, total, what: None)
    tasks = [SpaceTask(item=item, seed=seed, protocol=protocol) for item in items for seed in range(protocol.seeds)]
    others = [
        PublishedTask(what=what, seed=seed, limit=protocol.limit, peak_budget=peak_budget)
        for what in (SERVICER, PAPERS_SCENE, LEAST_PEAK)
        for seed in range(published)
    ]
    total, second = len(tasks) + len(others), None
    if records is not None:
        second = records.with_name(f"{records.stem}-published{records.suffix}")
    speed_for.cache_clear()  # how fast the core was in a benchmark before says nothing now
    runs = run_study(SPACE, tasks, records=records, jobs=jobs, progress=lambda done, _, what: tell(done, total, what))
    extra = run_study(
        PUBLISHED,
        others,
        records=second if others else None,
        jobs=jobs,
        progress=lambda done, _, what: tell(len(tasks) + done, total, what),
    )
    return SpaceBench(
        protocol=protocol,
        runs=tuple(runs),
        published=tuple(extra),
        seconds=time.perf_counter() - begun,
        jobs=jobs_of(SPACE, jobs),
    )
