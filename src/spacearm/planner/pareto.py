"""Quick, or gentle to the base: the plans between which there is no better one in both.

The first plan is as quick as it can be and the second as gentle; between them both count, each as a share of what they
differ by, at ratios from the one end to the other. Every plan is proven, and keeps all limits of the problem; those that
another one beats in both are told apart. A sweep of weights finds no plan in a hollow of the front, but it always has a
motion to go on from, where a search within a narrow limit on the base often finds none.
"""

# pyright: reportUnnecessaryIsInstance=false
# What callers pass is checked at run time too.

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief, Rows
from spacearm.core.errors import ProblemError
from spacearm.core.notebook_hook import InNotebooks
from spacearm.core.random_seed import Rng, seed_of
from spacearm.core.records import one_of, whole
from spacearm.planner.plan_result import Plan
from spacearm.planner.planner_settings import PlannerSettings, Weights, as_planner_settings
from spacearm.planner.planning import plan
from spacearm.planner.plans_in_short import front_in_short
from spacearm.planner.problem import Problem

Array = NDArray[np.float64]

Disturbance = Literal["peak", "final", "rate"]
"""Of the base: its greatest angle from the start, its angle at the end, or its greatest rate, as in `BaseReport`."""

_TIE = 0.01  # weight of what counts second, against what counts first
_LEAST = 1e-9  # [rad or rad/s] less is none


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class ParetoFront(Brief, InNotebooks):
    """Proven plans for one problem, by duration and by how much they disturb the base.

    Attributes:
        measure: "peak", "final" or "rate": what of the base is compared.
        plans: proven, the quickest first.
        durations: (p,) of them [s].
        disturbances: (p,) of the base [rad or rad/s].
        best: (p,) whether none of the others is at least as good in both and better in one.
        failed: how many searches found none.
    """

    measure: Disturbance
    plans: tuple[Plan, ...]
    durations: Array
    disturbances: Array
    best: NDArray[np.bool_]
    failed: int

    def _in_short(self) -> tuple[str, Rows]:
        return front_in_short(self)

    @property
    def front(self) -> tuple[Plan, ...]:
        """The plans that no other one beats, the quickest first."""
        return tuple(found for found, best in zip(self.plans, self.best, strict=True) if best)


def pareto_front(
    problem: Problem,
    settings: PlannerSettings | None = None,
    *,
    points: int = 7,
    measure: Disturbance = "peak",
    rng: Rng = None,
    progress: Callable[[int, int, str], object] | None = None,
) -> ParetoFront:
    """Plan a number of times between the quickest motion and the one that disturbs its base least.

    Args:
        problem: whose base floats; its own limits hold too.
        settings: of every search, but for the weights.
        points: how many plans, 2 or more.
        measure: "peak", "final" or "rate" of the base.
        rng: seed, generator or None; every plan has the same seed, and records it.
        progress: called with how many plans are done, how many there will be, and what is being planned.

    Returns:
        The proven plans; none if not even the quickest motion is found.

    Raises:
        ProblemError: the base is fixed, the duration is given, or a goal attitude already says how the base is to end.
        SettingsError: settings that cannot be.
        KeyboardInterrupt: Ctrl-C.
    """
    one_of("measure", measure, get_args(Disturbance))
    whole("points", points, at_least=2, at_most=1000)
    require_choice(problem, measure)
    settings = as_planner_settings(settings)
    seed, found = seed_of(rng), list[Plan]()

    def tell(done: int, what: str) -> None:
        if progress is not None:
            progress(done, points, what)

    def attempt(number: int, what: str, duration: float, base: float) -> Plan | None:
        tell(number, what)
        weights = Weights(**{"length": 0.0, "duration": duration, f"base_{measure}": base})
        made = plan(problem, replace(settings, weights=weights), rng=seed)
        if made.interrupted:
            raise KeyboardInterrupt
        found.extend([made] if made.found else [])
        return made if made.found else None

    quickest = attempt(0, "the quickest motion", 1.0, 0.0)
    if quickest is not None:
        time, turn = _time(quickest), max(_of(quickest, measure), _LEAST)
        gentlest = attempt(1, "the gentlest motion", _TIE / time, 1 / turn)
        longer = max(_time(gentlest or quickest) - time, _TIE * time)
        less = max(turn - _of(gentlest or quickest, measure), _TIE * turn)
        for number, share in enumerate(np.linspace(0.0, 1.0, points)[1:-1].tolist(), start=2):
            attempt(number, f"a motion between them, {share:.0%} gentle", (1 - share) / longer, share / less)
    tell(points, "")
    return _front(measure, found, points - len(found))


def not_beaten(first: Array, second: Array) -> NDArray[np.bool_]:
    """Tell which points (p,), (p,) no other is as good as in both and better in one; less is better."""
    as_good = (first[None] <= first[:, None]) & (second[None] <= second[:, None])
    better = (first[None] < first[:, None]) | (second[None] < second[:, None])
    return np.logical_not(np.any(as_good & better, axis=1), out=np.empty(len(first), dtype=bool))


def _front(measure: Disturbance, found: list[Plan], failed: int) -> ParetoFront:
    plans = sorted(found, key=lambda made: (_time(made), _of(made, measure)))
    durations, disturbances = np.array([_time(p) for p in plans]), np.array([_of(p, measure) for p in plans])
    return ParetoFront(
        measure=measure,
        plans=tuple(plans),
        durations=durations,
        disturbances=disturbances,
        best=not_beaten(durations, disturbances),
        failed=failed,
    )


def _time(made: Plan) -> float:
    assert made.trajectory is not None  # it was found
    return made.trajectory.duration


def _of(made: Plan, measure: Disturbance) -> float:
    assert made.base is not None  # `require_choice` saw to it
    return float(getattr(made.base, measure))


def require_choice(problem: Problem, measure: Disturbance) -> None:
    """Check that a problem leaves something between quick and gentle to choose.

    Raises:
        ProblemError: its base is fixed, its duration given, or its goal attitude says how the base is to end.
    """
    if not isinstance(problem, Problem) or measure not in problem.base_model.limits:
        raise ProblemError("the base is fixed, expected a floating one: nothing disturbs it; give base='floating'")
    if problem.duration is not None:
        raise ProblemError(f"the problem states its duration, {problem.duration:g} s, expected none: it is what varies")
    if measure == "final" and problem.base_goal is not None:
        raise ProblemError("the problem has a base_goal, and measure is 'final', expected 'peak' or 'rate' with it")
