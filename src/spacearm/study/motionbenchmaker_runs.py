"""MotionBenchMaker measured: each problem with each seed is a task.

A task measures the bare search, then `plan()` with its proof, then what another checker says of the motion.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.geometry import Scene
from spacearm.planner import ConfigurationGoal, Plan, PlannerSettings, Problem, plan
from spacearm.planner.motion_search import Islands
from spacearm.planner.problem import SET_ONTO_LIMITS
from spacearm.planner.searched_clearance import searched_clearance
from spacearm.robot import Robot
from spacearm.study.motionbenchmaker import Item, RobotFiles, read_item
from spacearm.study.other_checker import OtherChecker, dense_configurations, overlapping_pairs
from spacearm.study.reference_core import CoreSpeed, speed_for
from spacearm.study.run_study import Progress, Study, jobs_of, run_study
from spacearm.study.study_records import file_digest
from spacearm.study.study_tables import listed

_MANY = 5  # pairs or problems named before it would no longer be read

LIMIT = 1.0
"""A problem that takes longer than this is not solved [s of the reference core]."""

_SHARE_OF_THE_REST = 0.8
"""Of the time until `LIMIT`, for a second call of `plan()`: a proof that has begun is finished, even if that takes longer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """What is measured. Times are the reference core's.

    Attributes:
        seeds: runs of each problem, with seeds 0, 1, ...
        search: how long the bare search goes on [s].
        plan: the deadline of `plan()` [s]: for its search, its proof, and what is tried again. Where it finds nothing, it is
            called again, with most of what is left of `LIMIT`.
    """

    seeds: int = 5
    search: float = 0.05
    plan: float = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A problem solved with a seed. Times are as measured here; times `scale` they are the reference core's.

    Attributes:
        family: of the problem.
        name: of the problem in its family.
        seed: of both searches.
        scale: seconds of the reference core for a second of this one, when this was measured.
        load: how many processes wanted a core then; None where the system does not tell.
        straight: length of the straight motion: none is shorter [rad].
        prepare: from a problem that nobody has seen before to a search that may begin [s].
        history: (seconds, length [rad]) of each improvement of the bare search.
        first_evaluations: motions looked at before the first that was free; None where there was none.
        evaluations: motions looked at in all.
        status: of `plan()`.
        message: of `plan()`, where it found none.
        seconds: of `plan()`, all in all [s].
        certify: of its proofs [s].
        proofs: how many they were.
        length: of the plan [rad]; None where there is none.
        clearance: proven of it [m]; None where there is none.
        looked_at: configurations of the plan that the other checker looked at.
        collisions: those that it found in collision.
        collides: the first such pair.
    """

    family: str
    name: str
    seed: int
    scale: float
    straight: float
    prepare: float
    history: tuple[tuple[float, float], ...]
    first_evaluations: int | None
    evaluations: int
    status: str
    message: str
    seconds: float
    certify: float
    proofs: int
    length: float | None
    clearance: float | None
    looked_at: int
    collisions: int
    collides: str
    load: float | None = None

    @property
    def ends_collide(self) -> bool:
        """Whether the problem cannot be solved: an end of it is in collision."""
        return self.status in ("start_in_collision", "goal_in_collision")

    @property
    def first(self) -> float | None:
        """Time to the first motion that the search holds free, if it came in time [s]."""
        return self.history[0][0] if self.history and self.history[0][0] * self.scale <= LIMIT else None

    @property
    def certified(self) -> bool:
        """Whether `plan()` found a motion and proved it in time."""
        return self.status == "found" and self.seconds * self.scale <= LIMIT

    def length_by(self, reference_seconds: float) -> float | None:
        """Return the length after that time of the reference core; None if nothing was found by then."""
        found = [length for at, length in self.history if at * self.scale <= reference_seconds]
        return found[-1] if found else None


def measure(item: Item, problem: Problem, seed: int, protocol: Protocol, speed: CoreSpeed, other: OtherChecker) -> Run:
    """Measure one problem with one seed.

    Args:
        item: the problem's files, for the other checker.
        problem: the same as it was read.
        seed: of the searches.
        protocol: what is measured.
        speed: of this core.
        other: looks at what `plan()` gives.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    scale = speed.scale
    straight = float(np.linalg.norm(_goal(problem) - problem.start))
    prepare, islands = _searched(_unseen(problem), seed, protocol, scale)
    history = islands.history() if islands is not None else ()
    motions = islands.motions()[::-1] if islands is not None else []  # best first: the history backwards
    found, seconds = _planned(_unseen(problem), seed, protocol, scale)
    recheck = None
    if found.found and found.trajectory is not None:
        recheck = other.look(item, dense_configurations(found.trajectory.motion))
    return Run(
        family=item.family,
        name=item.name,
        seed=seed,
        scale=scale,
        straight=straight,
        prepare=prepare,
        history=tuple((entry.seconds, motion.length()) for entry, motion in zip(history, motions, strict=True)),
        first_evaluations=history[0].evaluations if history else None,
        evaluations=islands.evaluations if islands is not None else 0,
        status=found.status,
        message="" if found.found else found.message,
        seconds=seconds,
        certify=found.timings.get("certify", 0.0),
        proofs=found.proofs,
        length=_length(found),
        clearance=found.certificate.clearance if found.found and found.certificate is not None else None,
        looked_at=0 if recheck is None else recheck.looked_at,
        collisions=0 if recheck is None else recheck.collisions,
        collides="" if recheck is None else recheck.first,
        load=None if np.isnan(speed.load) else speed.load,
    )


def _searched(problem: Problem, seed: int, protocol: Protocol, scale: float) -> tuple[float, Islands | None]:
    """Search for as long as the protocol says, and for a first motion as long as may be; the time before comes first."""
    begun = time.perf_counter()
    goals = _goal(problem)[None].copy()
    searched = searched_clearance(problem, np.vstack([problem.start, goals]))
    if searched.touching:
        return time.perf_counter() - begun, None
    settings = PlannerSettings(evaluations=None, time_budget=protocol.search / scale, threads=1)
    islands = Islands(problem, goals, settings, seed=seed, searched=searched)
    prepare = time.perf_counter() - begun
    islands.run(evaluations=0, seconds=protocol.search / scale, until_first=False, stall=0)
    if islands.best is None:
        islands.run(evaluations=0, seconds=(LIMIT - protocol.search) / scale, until_first=True, stall=0)
    return prepare, islands


def _planned(problem: Problem, seed: int, protocol: Protocol, scale: float) -> tuple[Plan, float]:
    """Call `plan()` with its deadline; where no motion is proven, once more with what is left of `LIMIT`."""
    begun = time.perf_counter()
    budget = protocol.plan / scale
    while True:
        found = plan(problem, PlannerSettings(evaluations=None, time_budget=budget, threads=1), rng=seed)
        if found.interrupted:
            raise KeyboardInterrupt
        seconds = time.perf_counter() - begun
        budget = _SHARE_OF_THE_REST * (LIMIT / scale - seconds)
        if found.status not in ("not_found", "not_proven") or budget < protocol.plan / scale:
            return found, seconds


def _unseen(problem: Problem) -> Problem:
    """Return the same problem with a new scene, so that what the planner computed for the scene before does not count."""
    return replace(problem, scene=Scene(problem.scene.obstacles))


def _goal(problem: Problem) -> np.ndarray:
    assert isinstance(problem.goal, ConfigurationGoal)  # the collection has no other
    return problem.goal.q


def _length(found: Plan) -> float | None:
    return found.trajectory.motion.length() if found.found and found.trajectory is not None else None


# ---- the study ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class MbmTask:
    """A problem to be measured with a seed.

    Attributes:
        item: the problem's files.
        robot: its files.
        seed: of both searches.
        protocol: what is measured.
        digests: of the files, by what they hold.
    """

    item: Item
    robot: RobotFiles
    seed: int
    protocol: Protocol
    digests: tuple[tuple[str, str], ...]


def mbm_tasks(items: Sequence[Item], robot: RobotFiles, protocol: Protocol) -> list[MbmTask]:
    """Return the tasks: by seed, family and problem.

    Raises:
        FileFormatError: a file that is missing or empty.
    """
    of_robot = (("urdf", file_digest(robot.urdf, what="a URDF")), ("srdf", file_digest(robot.srdf, what="an SRDF")))
    of_items = [
        (
            ("scene", file_digest(item.scene, what="a planning scene")),
            ("request", file_digest(item.request, what="a motion request")),
        )
        for item in items
    ]
    return [
        MbmTask(item=item, robot=robot, seed=seed, protocol=protocol, digests=(*of_robot, *digests))
        for seed in range(protocol.seeds)
        for item, digests in zip(items, of_items, strict=True)
    ]


def run_task(task: MbmTask) -> Run:
    """Measure a task. In each process, the first one is measured twice: what is imported on the way is not timed."""
    prepared = _prepared(task.robot, task.digests[:2])
    problem = prepared.problem(task.item, task.digests[2:])
    speed = speed_for(f"seed {task.seed}, {task.item.family}")
    if not prepared.warm:
        measure(task.item, problem, 0, task.protocol, speed, prepared.other)
        prepared.warm = True
    return measure(task.item, problem, task.seed, task.protocol, speed, prepared.other)


def _definition(task: MbmTask) -> dict[str, Any]:
    return {
        "search_s": task.protocol.search,
        "plan_s": task.protocol.plan,
        "group": task.robot.group,
        **dict(task.digests),
    }


MBM = Study(
    name="motionbenchmaker",
    run=run_task,
    record=Run,
    key=lambda task: f"{task.item.family} {task.item.name} seed {task.seed}",
    definition=_definition,
    timed=True,
)
"""The study of these tasks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """All runs, and how they were made.

    Attributes:
        protocol: what was measured.
        robot: its files.
        runs: by seed, family and problem.
        seconds: that it took; of a study that was resumed, since then.
        jobs: how many runs were measured at a time.
        notes: what was assumed or left out of the robot and the problems, a sentence each.
    """

    protocol: Protocol
    robot: RobotFiles
    runs: tuple[Run, ...]
    seconds: float
    jobs: int = 1
    notes: tuple[str, ...] = ()

    @property
    def families(self) -> tuple[str, ...]:
        """The families, in order."""
        return tuple(dict.fromkeys(run.family for run in self.runs))

    @property
    def valid(self) -> tuple[Run, ...]:
        """The runs of problems that can be solved."""
        return tuple(run for run in self.runs if not run.ends_collide)

    @property
    def loads(self) -> tuple[float, ...]:
        """How many processes wanted a core, each time the core was measured; nan where the system does not tell."""
        groups = groupby(self.runs, key=lambda run: (run.seed, run.family, run.load))
        return tuple(float("nan") if load is None else load for (_, _, load), _ in groups)


def run_benchmark(
    items: Sequence[Item],
    robot: RobotFiles,
    protocol: Protocol | None = None,
    *,
    records: Path | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Benchmark:
    """Measure all problems with all seeds; before each family the speed of the core is measured anew.

    Args:
        items: the problems' files, a family's together.
        robot: its files.
        protocol: what is measured.
        records: file to which each run is appended, and which a stopped benchmark is resumed from; see `run_study`.
        jobs: runs measured at a time; None: one, for they disturb each other.
        progress: called with the runs done, the runs in all, and what is next.

    Raises:
        SpacearmError: a file that is missing, broken or of another format, before anything is measured; as of `run_study`.
        KeyboardInterrupt: Ctrl-C.
    """
    protocol = Protocol() if protocol is None else protocol
    begun = time.perf_counter()
    if progress:
        progress(0, protocol.seeds * len(items), "reading")
    tasks = mbm_tasks(items, robot, protocol)
    problems = [_prepared(robot, task.digests[:2]).problem(task.item, task.digests[2:]) for task in tasks[: len(items)]]
    speed_for.cache_clear()  # how fast the core was in a benchmark before says nothing now
    runs = run_study(MBM, tasks, records=records, jobs=jobs, progress=progress)
    return Benchmark(
        protocol=protocol,
        robot=robot,
        runs=tuple(runs),
        seconds=time.perf_counter() - begun,
        jobs=jobs_of(MBM, jobs),
        notes=_notes_of(items, problems),
    )


def _notes_of(items: Sequence[Item], problems: Sequence[Problem]) -> tuple[str, ...]:
    """Say what the collection is planned with, and without."""
    if not problems:
        return ()
    robot = problems[0].robot
    out = [f"robot {robot.name}, {robot.dof} joints, tip '{robot.tip}' (goals are configurations: the tip has no part)"]
    apart = [pair.text for pair in overlapping_pairs(robot)]
    if apart:
        out.append(f"no plan keeps them apart, and nobody looks at them afterwards: {listed(apart, _MANY)}")
    onto = [
        f"{item.family} {item.name}"
        for item, problem in zip(items, problems, strict=True)
        if any(SET_ONTO_LIMITS in note for note in problem.notes)
    ]
    if onto:
        out.append(
            f"an end is beyond joint limits by rounding, and was {SET_ONTO_LIMITS}, in {len(onto)}: {listed(onto, _MANY)}"
        )
    return tuple(out)


@dataclass(slots=True)
class _Prepared:
    """What a process has read: the robot, the other checker, and problems by their files and the files' digests."""

    arm: Robot
    other: OtherChecker
    problems: dict[Any, Problem] = field(default_factory=dict)
    warm: bool = False

    def problem(self, item: Item, digests: tuple[tuple[str, str], ...]) -> Problem:
        """Return a problem, read by both checkers."""
        if (item, digests) not in self.problems:
            self.problems[item, digests] = read_item(item, self.arm)
            self.other.read(item)
        return self.problems[item, digests]


@lru_cache(maxsize=1)
def _prepared(robot: RobotFiles, digests: tuple[tuple[str, str], ...]) -> _Prepared:
    arm = robot.load()
    return _Prepared(arm=arm, other=OtherChecker(robot, arm.dof_names, overlapping=overlapping_pairs(arm)))
