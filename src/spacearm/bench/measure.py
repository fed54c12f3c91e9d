"""One problem and one seed, measured: the bare search, then `plan()` with its proof, then the other checker."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from spacearm.bench.collection import Item
from spacearm.bench.recheck import OtherChecker, dense_configurations
from spacearm.planner import Plan, PlannerSettings, Problem, plan
from spacearm.planner.clearance import margins_within_reach
from spacearm.planner.goals import ConfigurationGoal
from spacearm.planner.islands import Islands
from spacearm.scene import Scene

LIMIT = 1.0
"""A problem that takes longer than this is not solved [s of the reference core]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """What is measured. Times are the reference core's.

    Attributes:
        seeds: runs of each problem, with seeds 0, 1, ...
        search: how long the bare search goes on [s].
        plan: the deadline of `plan()` [s]: for its search, its proof, and what is tried again.
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


def measure(item: Item, problem: Problem, seed: int, protocol: Protocol, scale: float, other: OtherChecker) -> Run:
    """Measure one problem with one seed.

    Args:
        item: the problem's files, for the other checker.
        problem: the same as it was read.
        seed: of the searches.
        protocol: what is measured.
        scale: seconds of the reference core for a second of this one.
        other: looks at what `plan()` gives.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    straight = float(np.linalg.norm(_goal(problem) - problem.start))
    prepare, islands = _searched(_unseen(problem), seed, protocol, scale)
    history = islands.history() if islands is not None else ()
    motions = islands.motions()[::-1] if islands is not None else []  # best first: the history backwards
    settings = PlannerSettings(evaluations=None, time_budget=protocol.plan / scale, threads=1)
    begun = time.perf_counter()
    found = plan(_unseen(problem), settings, rng=seed)
    seconds = time.perf_counter() - begun
    if found.interrupted:
        raise KeyboardInterrupt
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
    )


def _searched(problem: Problem, seed: int, protocol: Protocol, scale: float) -> tuple[float, Islands | None]:
    """Search for as long as the protocol says, and for a first motion as long as may be; the time before comes first."""
    begun = time.perf_counter()
    goals = _goal(problem)[None].copy()
    margins = margins_within_reach(problem, np.vstack([problem.start, goals]), PlannerSettings().margin)
    if margins.touching:
        return time.perf_counter() - begun, None
    settings = PlannerSettings(evaluations=None, time_budget=protocol.search / scale, threads=1)
    islands = Islands(problem, goals, settings, seed=seed, margins=margins)
    prepare = time.perf_counter() - begun
    islands.run(evaluations=0, seconds=protocol.search / scale, until_first=False, stall=0)
    if islands.best is None:
        islands.run(evaluations=0, seconds=(LIMIT - protocol.search) / scale, until_first=True, stall=0)
    return prepare, islands


def _unseen(problem: Problem) -> Problem:
    """Return the same problem as if it were new: what the planner keeps of scenes it has seen does not count."""
    return replace(problem, scene=Scene(problem.scene.obstacles))


def _goal(problem: Problem) -> np.ndarray:
    assert isinstance(problem.goal, ConfigurationGoal)  # the collection has no other
    return problem.goal.q


def _length(found: Plan) -> float | None:
    return found.trajectory.motion.length() if found.found and found.trajectory is not None else None
