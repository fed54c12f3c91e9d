"""The problem of the paper (Zhang et al. 2022): settings of its experiment, robot, scene, fitness, best known values.

At the end stand the readings: where the paper is silent, and what is taken there.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_number, shown
from spacearm.core.errors import SettingsError
from spacearm.core.native import native
from spacearm.core.records import one_of, settings, whole
from spacearm.geometry import Scene, Sphere
from spacearm.planner.kernel_model import make_kernel_model
from spacearm.robot import Robot, load_robot
from spacearm.robot.kinematics import as_configurations
from spacearm.swarm import NAMED_SETTINGS
from spacearm.swarm.minimizer import MOST_THREADS

Array = NDArray[np.float64]

OBSTACLE_CENTERS = ((0.5, 0.5, 0.0), (0.4, 0.7, 0.0), (0.2, 0.8, 0.0))
START_POSITION = (0.0, 1.336, 0.0)  # of the end effector: the stretched arm, q = 0
GOAL_POSITION = (0.7, 0.3, 0.0)

_WIDEST = 1e3  # [m]

MODES = ("goal", "literal")
THRESHOLD = 4.33
NEAR = 0.01  # "near" the best known value: within 1 %


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedRow:
    """A row of the paper's Table 3."""

    worst: float
    best: float
    mean: float
    threshold_share: float


REPORTED = {
    "pso": ReportedRow(worst=4.3341, best=3.3818, mean=4.2378, threshold_share=0.70),
    "ipso": ReportedRow(worst=4.3296, best=3.3760, mean=3.7699, threshold_share=1.00),
}
"""The paper's Table 3."""

REPORTED_FOR = {"pso": "pso", "ipso-m": "ipso", "ipso-s": "ipso"}
"""Which of its rows stands beside which method."""


@settings
class PaperSettings:
    """What of the experiment is run.

    Attributes:
        runs: runs of each method.
        methods: swarm settings to compare, the first with each of the others: pso, ipso-m, ipso-s (the paper's, with either
            reading of its population 3), constriction, ring, ring-small, ring-forgiving, ring-unclamped, ring-rising,
            evolving-rising, ipso-e.
        modes: goal (reaching the goal is a constraint), literal (eq. (4) alone), or both.
        radii: one or more obstacle radii A_R [m].
        tolerance: distance at which the goal counts as reached, in the goal mode [m].
        weights: omega_1, omega_2, omega_3 of eq. (4), each from 0 to 1, their sum 1.
        link_radius: radius of the cylinders round the links [m].
        constraints: feasible-first, or penalty for the weighted sum, in the methods that do not set their own.
        seed: seed of all runs.
        threads: processor threads; none: one a core. The numbers do not depend on it.
    """

    runs: int = 20
    methods: tuple[str, ...] = ("pso", "ipso-m", "ipso-s", "ring-rising", "ipso-e")
    modes: tuple[str, ...] = MODES
    radii: tuple[float, ...] = (0.10,)
    tolerance: float = 1e-3
    weights: tuple[float, float, float] = (0.5, 0.25, 0.25)
    link_radius: float = 0.0
    constraints: Literal["feasible-first", "penalty"] = "feasible-first"
    seed: int = 0
    threads: int | None = None

    def __post_init__(self) -> None:
        keep = functools.partial(object.__setattr__, self)  # plain numbers, also where NumPy's were given
        keep("runs", whole("runs", self.runs, at_least=1, at_most=100_000))
        for name, values in (("methods", self.methods), ("modes", self.modes), ("radii", self.radii)):
            if not isinstance(values, tuple) or not values:
                raise SettingsError(f"{name} is {shown(values)}, expected a tuple of one or more values")
            if any(value in values[:i] for i, value in enumerate(values)):
                raise SettingsError(f"{name} is {shown(values)}, expected each value once; leave the others out")
        for method in self.methods:
            one_of("method", method, tuple(NAMED_SETTINGS))
        for mode in self.modes:
            one_of("mode", mode, MODES)
        keep(
            "radii",
            tuple(as_number("radius", radius, SettingsError, above=0, at_most=_WIDEST, unit="m") for radius in self.radii),
        )
        keep("tolerance", as_number("tolerance", self.tolerance, SettingsError, above=0, at_most=_WIDEST, unit="m"))
        keep("link_radius", as_number("link_radius", self.link_radius, SettingsError, at_least=0, at_most=_WIDEST, unit="m"))
        one_of("constraints", self.constraints, ("feasible-first", "penalty"))
        keep("weights", _weights(self.weights))
        keep("seed", whole("seed", self.seed, at_least=0, at_most=2**63 - 1))
        if self.threads is not None:
            keep("threads", whole("threads", self.threads, at_least=1, at_most=MOST_THREADS))


def _weights(given: tuple[float, ...]) -> tuple[float, ...]:
    if not isinstance(given, tuple) or len(given) != 3:
        raise SettingsError(f"weights is {shown(given)}, expected a tuple of three: omega_1, omega_2, omega_3")
    weights = tuple(as_number(f"weights[{i}]", weight, SettingsError) for i, weight in enumerate(given))
    for i, weight in enumerate(weights):
        if not 0 <= weight <= 1:
            raise SettingsError(f"weights[{i}] is {weight:g}, expected a weight from 0 to 1, eq. (4)")
    if abs(sum(weights) - 1) > 1e-9:
        raise SettingsError(f"weights sum to {sum(weights):.12g}, expected 1, eq. (4); scale them")
    return weights


assert set(REPORTED_FOR) <= set(NAMED_SETTINGS)


# ---- robot, scene, fitness --------------------------------------------------------------------------------------------


@functools.lru_cache(maxsize=8)
def paper_robot(link_radius: float = 0.0) -> Robot:
    """Return the paper's arm, its links in cylinders of this radius [m]."""
    robot = load_robot("zhang2022")
    capsules = tuple(replace(capsule, radius=link_radius) for capsule in robot.capsules)
    return replace(robot, capsules=capsules)


def paper_scene(radius: float = 0.10) -> Scene:
    """Return the paper's three obstacles in spheres of this radius A_R [m]."""
    return Scene([Sphere(center, radius) for center in OBSTACLE_CENTERS])


@overload
def paper_objective(
    settings: PaperSettings, mode: str, radius: float, *, precision: Literal[64] = 64
) -> native.PaperObjective64: ...
@overload
def paper_objective(
    settings: PaperSettings, mode: str, radius: float, *, precision: int
) -> native.PaperObjective32 | native.PaperObjective64: ...
def paper_objective(
    settings: PaperSettings, mode: str, radius: float, *, precision: int = 64
) -> native.PaperObjective32 | native.PaperObjective64:
    """Return the kernel's objective: fitness eq. (4), violation eqs. (1)-(3), (10), (11), and the goal in that mode.

    Args:
        settings: for the weights, the goal's tolerance and the link radius.
        mode: "goal" or "literal".
        radius: of the obstacles A_R [m].
        precision: of its numbers, 32 or 64 bits.

    Raises:
        SettingsError: another mode.
        SceneError: a radius that is not above 0.
    """
    one_of("mode", mode, MODES)
    model = make_kernel_model(paper_robot(settings.link_radius), paper_scene(radius))
    centers, weights = np.array(model.centres, dtype=np.int32), np.array(settings.weights, dtype=np.float64)
    goal, must_reach, tolerance = np.array(GOAL_POSITION, dtype=np.float64), mode == "goal", settings.tolerance
    if precision == 32:
        return native.PaperObjective32(
            scene=model.model32,
            centers=centers,
            tip=model.tip,
            goal=goal,
            weights=weights,
            must_reach=must_reach,
            tolerance=tolerance,
        )
    return native.PaperObjective64(
        scene=model.model64,
        centers=centers,
        tip=model.tip,
        goal=goal,
        weights=weights,
        must_reach=must_reach,
        tolerance=tolerance,
    )


def paper_terms(q: ArrayLike, settings: PaperSettings | None = None, *, radius: float = 0.10) -> Array:
    """Return the terms f1, f2, f3 of eqs. (5), (6), (7).

    Args:
        q: (..., 7) configurations [rad].
        settings: for the weights and the link radius.
        radius: of the obstacles A_R [m].

    Returns:
        (..., 3) [m].
    """
    settings = settings or PaperSettings()
    array = as_configurations(paper_robot(), q)
    rows = np.ascontiguousarray(array.reshape(-1, 7))
    return paper_objective(settings, "literal", radius).terms(rows).reshape(*array.shape[:-1], 3)


# ---- best known values ------------------------------------------------------------------------------------------------


_FOUND_BY = "SLSQP from 2,000 random starts (benchmarks/best_known.py)"

BEST_KNOWN = {
    ("goal", 0.06): 2.936628358,
    ("goal", 0.10): 2.984974500,
    ("goal", 0.15): 3.068618424,
    ("literal", 0.06): 2.499680820,
    ("literal", 0.10): 2.561027421,
    ("literal", 0.15): 2.663172747,
}
"""The best known fitness by mode and obstacle radius [m], for the default weights, tolerance and link radius.

Found by gradient descent from many random starts, not by a swarm: SciPy's SLSQP with the obstacles' clearances and the goal's
distance as smooth constraints, 2,000 starts a case, kept when the kernel finds no violation
(`python benchmarks/best_known.py`). They are the best found, not proven optima.
"""


def best_known_value(settings: PaperSettings, mode: str, radius: float, feasible: Sequence[float]) -> tuple[float | None, str]:
    """Return the best known value and how it was found; the runs' own best where it is better or none is known.

    Args:
        settings: of the experiment.
        mode: "goal" or "literal".
        radius: of the obstacles A_R [m].
        feasible: the fitness of each feasible run.

    Returns:
        The value, None if no run was feasible and none is recorded, and the sentence.
    """
    default = PaperSettings()
    as_recorded = (settings.weights, settings.tolerance, settings.link_radius) == (
        default.weights,
        default.tolerance,
        default.link_radius,
    )
    recorded = BEST_KNOWN.get((mode, radius)) if as_recorded else None
    if recorded is None and not feasible:
        return None, "no run was feasible, and none is recorded for these settings"
    if recorded is None:
        return min(feasible), "the best of these runs; none is recorded for these settings"
    if feasible and min(feasible) < recorded:
        return min(feasible), "the best of these runs, better than the recorded one"
    return recorded, _FOUND_BY


# ---- readings --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A declared reading.

    Attributes:
        open: what the paper leaves open.
        reading: what we take.
        why: the reason.
    """

    open: str
    reading: str
    why: str


READINGS: tuple[Reading, ...] = (
    Reading(
        open="robot",
        reading="S-R-S arm: spherical shoulder at the origin, elbow, spherical wrist; links 0.668, 0.4128, 0.2552 m along "
        "+y at q = 0",
        why="the start (0, 1.336, 0) is then the stretched arm",
    ),
    Reading(
        open="joint axes at q = 0",
        reading="z, x, y, z, y, x, z",
        why="consecutive axes perpendicular; joints 1, 4, 7 move the arm in the plane z = 0",
    ),
    Reading(
        open="joint limits",
        reading="[deg] max 160, 20, 180, 170, 20, 20, 180; min -160, -20, -180, -150, -180, -46, -80",
        why="the most economical repair of the printed lines, whose signs are lost",
    ),
    Reading(
        open="obstacle radius A_R",
        reading="0.10 m; 0.06 and 0.15 on request",
        why="disjoint spheres need less than 0.112; the straight way is blocked above 0.054",
    ),
    Reading(open="radius of the links' cylinders", reading="0 m, a setting", why="no value is given"),
    Reading(
        open="control points in eq. (5)",
        reading="distinct joint centres: shoulder, elbow, wrist, end effector",
        why="seven centres with three at the origin give F >= 5.1 at the goal, above the paper's worst 4.33",
    ),
    Reading(open="third coordinate in eq. (6)", reading="z joins x and y", why="the goal is a point in space"),
    Reading(
        open="is the goal reached?",
        reading="mode 'goal': reaching it within 1 mm is a constraint; mode 'literal': only eq. (4)",
        why="f1 is minimised and pulls the arm towards the obstacles: with eq. (4) alone the optimum stops short of the goal",
    ),
    Reading(
        open="constraint handling",
        reading="feasible first; the weighted penalty as an option",
        why="not stated",
    ),
    Reading(
        open="reference [19], population 3",
        reading="variant M (symbiotic, after Niu et al. 2007) and variant S (cooperative, after Zhang and Ding 2011)",
        why="the two published three-population PSOs that fit the text",
    ),
    Reading(
        open="v1, v2, v3 in variant S",
        reading="the velocities before the update, G1 and G2 the fitness of the current positions",
        why="all three at the same time step",
    ),
    Reading(open="split of 300 particles", reading="100 / 100 / 100", why="both sources use equal populations"),
    Reading(open="c3 of variant M", reading="2, as c1 and c2", why="not stated"),
    Reading(
        open="velocity clamp",
        reading="0.2 of the joint range for IPSO; PSO unclamped as in Table 1",
        why="both sources of IPSO clamp",
    ),
    Reading(
        open="initial velocities",
        reading="uniform within +- 0.2 of the joint range",
        why="'stochastic under constraints'",
    ),
    Reading(
        open="particles beyond the joint limits",
        reading="set onto the limit, that component of the velocity to 0",
        why="not stated",
    ),
    Reading(
        open="what an iteration is",
        reading="one evaluation of every particle, the initial random one included: 100 iterations are 30,000 evaluations",
        why="Table 1 gives 300 particles and 100 iterations",
    ),
    Reading(
        open="inertia weight in eq. (14)",
        reading="w (printed v), falling linearly over the evaluations",
        why="the printed v is a misprint",
    ),
    Reading(
        open="r1, r2",
        reading="drawn for every particle, dimension and iteration",
        why="the usual reading",
    ),
    Reading(
        open="the path",
        reading="the motion that the planner finds from the start configuration to the swarm's best configuration, with its "
        "certificate; beside it, as the paper draws it, the trace of the best end effector over the iterations",
        why="the paper's particle is one configuration, not a path",
    ),
    Reading(
        open="base attitude",
        reading="Q_b0 = Q_bd = (1, 0, 0, 0): the base is held fixed",
        why="they are given as equal",
    ),
)
"""All declared readings."""
