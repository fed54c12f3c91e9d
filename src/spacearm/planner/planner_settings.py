"""Settings of the planner: what a user may want to say of the search, with units, ranges and what each does.

What else the search is made of are constants, each with its reason, where they are used: in the kernel's search, in `planning`
and in `inverse_kinematics`.
"""

# pyright: reportUnnecessaryIsInstance=false
# What callers pass is checked at run time too.

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, TypeVar, cast

from spacearm.core.checks import as_number, dimensions_of, keep, shown
from spacearm.core.errors import SettingsError
from spacearm.core.records import one_of, require_settings, setting_names, settings, whole
from spacearm.proof.tracking import Tracking, plain_tracking
from spacearm.swarm import IPSO, PSO
from spacearm.swarm.minimizer import MOST_THREADS

# Bounds of the settings: what counters, float32 and memory can bear, far beyond what is of use.
_COUNTABLE = 2**62  # evaluations, which the kernel counts in 64 bits
_LONGEST = 1e9  # [s]
_WIDEST = 1e3  # [m]
_WEIGHTS = 1e-12, 1e12  # of a weight that is not 0: beyond, sums in float32 are of one term alone
_JERKS = 1e-9, 1e12  # [rad/s^3 or m/s^3]
_MOST_GOALS = 256  # goal configurations, and islands
_MOST_PROOFS = 1000
_MOST_TURNS = 64  # numbers of control points that take turns
_MOST_INTERIOR = 24  # control points of one motion
_MOST_PARTICLES = 100_000

_EVALUATIONS = 20_000  # of each island where nothing else limits the search: about 50 ms for seven joints among ten boxes
T = TypeVar("T")

TIME_LAWS = ("uniform", "time_optimal")
SWARM = PSO(particles=16, iterations=400, inertia=0.6, cognitive=1.49, social=1.49, neighbours=3, start_velocity=0.02)
"""The swarm of motions: small, on a ring, and slow to start, for it begins near motions that are known to be good."""


@settings
class Weights:
    """What makes a motion better: the fitness is the weighted sum of these terms, each 0 or more.

    Attributes:
        length: joint path length [rad or m].
        duration: the fastest uniform time within the velocity, acceleration and jerk limits [s].
        tip: path length of the end effector [m].
        clearance: mean over the motion of what the clearances lack to `PlannerSettings.preferred_clearance`, summed over
            pairs [m].
        smoothness: mean of |q'''|^2, the third derivative over s in [0, 1] [rad^2 or m^2].
        f1: the paper's eq. (5), mean over the motion: distances of the joint centres from the obstacles' centres [m].
        f2: eq. (6): distance of the end effector from where it ends, squared and 1 more, then its root [m].
        f3: eq. (7): that distance [m].
        base_final: of a floating base: the angle that it has turned by at the end [rad].
        base_peak: the greatest angle that it is turned by at any time [rad].
        base_rate: its greatest rate [rad/s].
        joint_momentum: the arm's greatest angular momentum, of its joints' motion alone [N m s].
    """

    length: float = 1.0
    duration: float = 0.0
    tip: float = 0.0
    clearance: float = 0.0
    smoothness: float = 0.0
    f1: float = 0.0
    f2: float = 0.0
    f3: float = 0.0
    base_final: float = 0.0
    base_peak: float = 0.0
    base_rate: float = 0.0
    joint_momentum: float = 0.0

    def __post_init__(self) -> None:
        least, most = _WEIGHTS
        values = [
            as_number(f"weight {name}", getattr(self, name), SettingsError, at_least=0, at_most=most)
            for name in setting_names(Weights)
        ]
        for name, value in zip(setting_names(Weights), values, strict=True):
            if 0 < value < least:
                raise SettingsError(f"weight {name} is {value:g}, expected 0, or {least:g} up to {most:g}")
        if not any(values):
            raise SettingsError("all weights are 0, expected at least one above 0; weigh the length if nothing else counts")


@settings
class PlannerSettings:
    """How a motion is searched for, and when the search ends.

    It ends when the budget of evaluations or of time is spent, or when it has converged. Without a time budget the same random
    seed gives the same motion, on any number of threads. Where a proof fails, a quarter of the evaluations is added each time,
    never of the time.

    Attributes:
        evaluations: candidate motions that each island looks at, 1 or more; None: 20,000, or no limit where `time_budget` or
            `convergence` is given. Where the end of a floating base's motion is asked for, moving a candidate there counts too:
            32 looks at the end are one evaluation.
        time_budget: planning ends after this time [s]: goal configurations, motions, proofs, and what is tried again where a
            proof failed, for which a fifth is reserved. However little it is, these are done once: the first guesses for the
            goal, a search of up to 1 ms for a first motion, and the proof of the best motion. Where that fails, others are
            tried until 0.15 s after the beginning, and two that were found earlier even then. None: no limit.
        convergence: evaluations without an improvement of 0.1 %, or without any motion, after which an island ends; None:
            never.
        stop_at_first: be content with the first motion.
        weights: of the fitness' terms.
        preferred_clearance: clearance beyond which the term `clearance` asks for no more [m]; what is required is the
            problem's `clearance`.
        interior_points: control points of the swarm's motions, 1 to 24, one number or several that take turns; two more each
            where a floating base's end or greatest turn is asked for.
        swarm: PSO or IPSO; its iterations are the most of one turn.
        goal_candidates: for a goal in space: the most distinct configurations that are planned to, 1 to 256.
        islands: searches side by side, 1 to 256, each with a random sequence of its own; the best motion counts.
        threads: that islands and goal searches are spread over; None: one a core.
        time_law: "uniform" or "time_optimal": smooth and quicker, and slower to compute.
        jerk_limit: of every joint [rad/s^3 or m/s^3]; None: none.
        proofs: how many motions are given to the proof at most, 1 to 1000: where one fails, another is searched for.
        tracking: how far each joint may be from the motion at any instant [rad, or m for a prismatic joint]: a number for all,
            or a mapping such as {"all": 0.002, "shoulder": 0.001}. The proof then holds for all that stays so near, and the
            search asks for as much more clearance. For a fixed base.
    """

    evaluations: int | None = None
    time_budget: float | None = None
    convergence: int | None = None
    stop_at_first: bool = False
    weights: Weights = Weights()
    preferred_clearance: float = 0.05
    interior_points: tuple[int, ...] = (2, 3)
    swarm: PSO | IPSO = SWARM
    goal_candidates: int = 8
    islands: int = 1
    threads: int | None = 1
    time_law: str = "uniform"
    jerk_limit: float | None = None
    proofs: int = 30
    tracking: Tracking = 0.0

    def __post_init__(self) -> None:
        if self.evaluations is not None:
            whole("evaluations", self.evaluations, at_least=1, at_most=_COUNTABLE)
        if self.time_budget is not None:
            as_number("time_budget", self.time_budget, SettingsError, above=0, at_most=_LONGEST, unit="s")
        if self.convergence is not None:
            whole("convergence", self.convergence, at_least=1, at_most=_COUNTABLE)
        if not isinstance(self.stop_at_first, bool):
            raise SettingsError(f"stop_at_first is {shown(self.stop_at_first)}, expected True or False")
        keep(self, weights=_record("weights", self.weights, (Weights,)), swarm=_record("swarm", self.swarm, (PSO, IPSO)))
        whole("particles of the swarm of motions", self.swarm.particles, at_least=1, at_most=_MOST_PARTICLES)
        as_number("preferred_clearance", self.preferred_clearance, SettingsError, at_least=0, at_most=_WIDEST, unit="m")
        keep(self, interior_points=_counts(self.interior_points))
        whole("goal_candidates", self.goal_candidates, at_least=1, at_most=_MOST_GOALS)
        whole("islands", self.islands, at_least=1, at_most=_MOST_GOALS)
        if self.threads is not None:
            whole("threads", self.threads, at_least=1, at_most=MOST_THREADS)
        one_of("time_law", self.time_law, TIME_LAWS)
        if self.jerk_limit is not None:
            as_number("jerk_limit", self.jerk_limit, SettingsError, at_least=_JERKS[0], at_most=_JERKS[1])
        whole("proofs", self.proofs, at_least=1, at_most=_MOST_PROOFS)
        keep(self, tracking=plain_tracking(self.tracking, SettingsError))

    @property
    def most_evaluations(self) -> int | None:
        """The limit of evaluations that holds; None if there is none."""
        if self.evaluations is None and self.time_budget is None and self.convergence is None:
            return _EVALUATIONS
        return self.evaluations


_CLEARANCE = (
    "which is searched for and proven: Problem(..., clearance=0.01), or `clearance: 0.01` in a problem file, "
    "beside start and goal"
)
_MOVED = {
    "margin": f"a problem has a `clearance` [m] now, {_CLEARANCE}",
    "comfort": "it is called preferred_clearance now",
}
_ELSEWHERE = dict.fromkeys(("clearance", "minimum_clearance"), f"it is the problem that has a `clearance` [m], {_CLEARANCE}")


def require_not_moved(name: str) -> None:
    """Refuse a setting that there was once, or that a problem has, with the word for it.

    Raises:
        SettingsError: it is one.
    """
    if name in _MOVED:
        raise SettingsError(f"PlannerSettings has no setting '{name}' any more: {_MOVED[name]}")
    if name in _ELSEWHERE:
        raise SettingsError(f"PlannerSettings has no setting '{name}': {_ELSEWHERE[name]}")


def _with_moved(plain: Callable[..., None]) -> Callable[..., None]:
    @functools.wraps(plain)
    def init(self: PlannerSettings, *args: object, **given: object) -> None:
        for name in given:
            require_not_moved(name)
        plain(self, *args, **given)

    return init


if not TYPE_CHECKING:
    PlannerSettings.__init__ = _with_moved(PlannerSettings.__init__)


def as_planner_settings(given: object) -> PlannerSettings:
    """Return settings of the planner, or the default ones for None.

    Raises:
        SettingsError: settings of something else.
    """
    if given is None:
        return PlannerSettings()
    if not isinstance(given, PlannerSettings):
        raise SettingsError(f"settings is {shown(given)}, expected PlannerSettings(...)")
    return given


def _counts(given: object) -> tuple[int, ...]:
    counts: tuple[object, ...] | None = (given,)
    if dimensions_of(given) != 0:
        counts = tuple(cast("Iterable[object]", given)) if isinstance(given, Iterable) else None
    if not counts:
        what = shown(given) if counts is None else "empty"
        raise SettingsError(f"interior_points is {what}, expected whole numbers from 1 to {_MOST_INTERIOR}")
    if len(counts) > _MOST_TURNS:
        raise SettingsError(f"interior_points has {len(counts)} numbers, expected at most {_MOST_TURNS}; each is a turn")
    return tuple(whole("interior_points", count, at_least=1, at_most=_MOST_INTERIOR) for count in counts)


def _record(name: str, given: object, kinds: tuple[type[T], ...]) -> T:
    """Take a record, or the mapping that a file holds for the first of the kinds (or the one that `kind` names)."""
    if isinstance(given, kinds):
        return given
    if not isinstance(given, Mapping):
        raise SettingsError(f"{name} is {shown(given)}, expected {' or '.join(f'{kind.__name__}(...)' for kind in kinds)}")
    values = dict(cast("Mapping[str, object]", given))
    kind = values.pop("kind", kinds[0].__name__)
    one_of(f"{name}: kind", kind, tuple(known.__name__ for known in kinds))
    chosen = next(known for known in kinds if known.__name__ == kind)
    require_settings(chosen, values)
    return chosen(**values)
