"""Settings of the swarm: PSO as in Table 1 of the paper, IPSO as in Table 2, what can be varied, and named settings."""

# pyright: reportUnnecessaryIsInstance=false
# What callers pass is checked at run time too.

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from spacearm.core.checks import as_number, shown
from spacearm.core.errors import SettingsError, nearest
from spacearm.core.native import native
from spacearm.core.records import one_of, settings, share, whole

# Bounds of the settings: what memory and float32 can bear, far beyond what is of use.
_MOST_PARTICLES = 10**7
_MOST_ITERATIONS = 10**8  # their history has 24 bytes each
_MOST_POWER = 1000
_MOST_ENTRIES = 10**6  # of the success history
_MOST_FACTOR = 1000.0  # that velocities are multiplied by: they stay numbers
_MOST_WEIGHT = 1e12  # that violations are multiplied by: likewise

BOUNDS = ("absorb", "reflect", "periodic")
VARIANTS = ("symbiotic", "cooperative", "evolving")


@settings
class FeasibleFirst:
    """Less violation wins; among equals, less fitness.

    Attributes:
        forgiven: violations up to this quantile of the first round's count as none at first; 0 forgives nothing.
            The tolerance falls as (1 - t)^power (Takahama and Sakai 2006).
        until: share of the budget after which nothing is forgiven.
        power: of that fall.
    """

    forgiven: float = 0.0
    until: float = 0.8
    power: int = 5

    def __post_init__(self) -> None:
        share("forgiven", self.forgiven)
        share("until", self.until, above_zero=True)
        whole("power", self.power, at_least=1, at_most=_MOST_POWER)


@settings
class Penalty:
    """Fitness + weight x violation is what the swarm goes by; the result is still judged feasible first.

    Attributes:
        weight: fitness per unit of violation.
        final_weight: what the weight rises to, with the square of time, from `rise_from` on; None: it stays.
        rise_from: share of the budget at which it begins to rise.
    """

    weight: float = 100.0
    final_weight: float | None = None
    rise_from: float = 0.5

    def __post_init__(self) -> None:
        as_number("weight", self.weight, SettingsError, above=0, at_most=_MOST_WEIGHT)
        if self.final_weight is not None:
            as_number("final_weight", self.final_weight, SettingsError, at_least=self.weight, at_most=_MOST_WEIGHT)
        share("rise_from", self.rise_from)


Constraints: TypeAlias = FeasibleFirst | Penalty
"""How violations are weighed against fitness."""


@settings
class PSO:
    """Particle swarm optimisation, eqs. (12) and (13); the defaults are the paper's Table 1.

    Attributes:
        particles: the size of the swarm.
        iterations: rounds of evaluations, the first, random one included; particles x iterations is the budget.
        inertia: w, or (at the start, at the end) for the linear fall of eq. (14).
        cognitive: c1, towards the particle's own best.
        social: c2, towards the best of those it follows.
        velocity_clamp: greatest velocity as a share of each dimension's range; None leaves it free.
        start_velocity: the first velocities are uniform in +- this share of the range.
        neighbours: None: all follow the swarm's best; k: each follows the best of the k to either side on a ring.
        bounds: a particle that leaves is put on the bound without velocity ("absorb"), mirrored ("reflect"), or
            enters on the other side ("periodic").
        constraints: how violations are weighed.
    """

    particles: int = 300
    iterations: int = 100
    inertia: float | tuple[float, float] = 0.5
    cognitive: float = 2.0
    social: float = 2.0
    velocity_clamp: float | None = None
    start_velocity: float = 0.2
    neighbours: int | None = None
    bounds: Literal["absorb", "reflect", "periodic"] = "absorb"
    constraints: Constraints = FeasibleFirst()

    def __post_init__(self) -> None:
        _check_common(self)


@settings
class IPSO:
    """Improved particle swarm optimisation with three populations, Section 3.2; the defaults are Table 2.

    Populations 1 and 2 move as in PSO with eq. (14); population 3 depends on both:

    - "symbiotic" (variant M, after Niu et al. 2007): a master that follows its own best and the slaves' best;
    - "cooperative" (variant S, after Zhang and Ding 2011): driven by the velocities of populations 1 and 2, with one
      best for all; fitness must be positive;
    - "evolving" (ours): recombines personal bests by differential evolution with a success history (SHADE, Tanabe and
      Fukunaga 2013), steering towards its own elite and the leaders of populations 1 and 2.

    Attributes:
        variant: what population 3 does.
        cooperation: c3 of the symbiotic master, towards the slaves' best.
        evolving_share: share of the particles in population 3 of the evolving variant; the others are split evenly.
        elite_share: it steers towards one of this best share of it.
        memory: entries in its success history.
        shrink_to: it loses its worst members down to this many as the budget is spent; None: it stays.

    The other settings are those of `PSO`.
    """

    variant: Literal["symbiotic", "cooperative", "evolving"] = "symbiotic"
    particles: int = 300
    iterations: int = 100
    inertia: float | tuple[float, float] = (0.9, 0.4)
    cognitive: float = 2.0
    social: float = 2.0
    cooperation: float = 2.0
    velocity_clamp: float | None = 0.2
    start_velocity: float = 0.2
    neighbours: int | None = None
    bounds: Literal["absorb", "reflect", "periodic"] = "absorb"
    constraints: Constraints = FeasibleFirst()
    evolving_share: float = 1 / 3
    elite_share: float = 0.11
    memory: int = 20
    shrink_to: int | None = None

    def __post_init__(self) -> None:
        one_of("variant", self.variant, VARIANTS)
        _check_common(self)
        whole("particles", self.particles, at_least=6, at_most=_MOST_PARTICLES)
        as_number("cooperation", self.cooperation, SettingsError, at_least=0, at_most=_MOST_FACTOR)
        share("evolving_share", self.evolving_share, above_zero=True)
        share("elite_share", self.elite_share, above_zero=True)
        whole("memory", self.memory, at_least=1, at_most=_MOST_ENTRIES)
        if self.shrink_to is not None:
            if self.variant != "evolving":
                raise SettingsError(
                    f"shrink_to is {shown(self.shrink_to)} with the {self.variant} variant, expected None: only the evolving "
                    "population 3 shrinks; leave it out"
                )
            whole("shrink_to", self.shrink_to, at_least=4, at_most=self.particles)
        if self.variant == "cooperative" and self.velocity_clamp is None:
            raise SettingsError(
                "velocity_clamp is None, expected a share of the range: the cooperative variant adds up velocities and "
                "runs away without; give one, such as 0.2"
            )


SwarmSettings: TypeAlias = PSO | IPSO
"""Settings of any swarm."""


def inertia_range(record: SwarmSettings) -> tuple[float, float]:
    """Return the inertia weight at the start and at the end."""
    return record.inertia if isinstance(record.inertia, tuple) else (record.inertia, record.inertia)


def kernel_settings(record: SwarmSettings) -> native.SwarmSettings:
    """Return settings as the kernel takes them."""
    out = native.SwarmSettings()
    out.inertia_start, out.inertia_end = map(float, inertia_range(record))
    out.particles = int(record.particles)
    out.evaluations = int(record.particles) * int(record.iterations)
    out.cognitive, out.social = float(record.cognitive), float(record.social)
    out.velocity_clamp = float(record.velocity_clamp or 0.0)
    out.start_velocity = float(record.start_velocity)
    out.ring = min(int(record.neighbours or 0), int(record.particles))  # as many are all of them
    out.bounds = native.BoundsRule[record.bounds]
    rule = record.constraints
    if isinstance(rule, Penalty):
        out.constraints = native.ConstraintRule.penalty
        out.penalty_start = float(rule.weight)
        out.penalty_end = float(rule.weight if rule.final_weight is None else rule.final_weight)
        out.penalty_rise = float(rule.rise_from)
    else:
        out.tolerance_share, out.tolerance_until = float(rule.forgiven), float(rule.until)
        out.tolerance_power = int(rule.power)
    if isinstance(record, IPSO):
        out.variant = native.SwarmVariant[record.variant]
        out.cooperation = float(record.cooperation)
        out.evolving_share, out.elite_share = float(record.evolving_share), float(record.elite_share)
        out.memory, out.shrink_to = int(record.memory), int(record.shrink_to or 0)
    return out


def _check_common(record: SwarmSettings) -> None:
    whole("particles", record.particles, at_least=1, at_most=_MOST_PARTICLES)
    whole("iterations", record.iterations, at_least=1, at_most=_MOST_ITERATIONS)
    weights = record.inertia if isinstance(record.inertia, tuple) else (record.inertia,)
    if isinstance(record.inertia, list) or len(weights) not in (1, 2):
        raise SettingsError(f"inertia is {shown(record.inertia)}, expected a number or a pair (at the start, at the end)")
    for weight in weights:
        as_number("inertia", weight, SettingsError, at_least=0, at_most=_MOST_FACTOR)
    as_number("cognitive", record.cognitive, SettingsError, at_least=0, at_most=_MOST_FACTOR)
    as_number("social", record.social, SettingsError, at_least=0, at_most=_MOST_FACTOR)
    if record.velocity_clamp is not None:
        as_number("velocity_clamp", record.velocity_clamp, SettingsError, above=0, at_most=_MOST_FACTOR)
    as_number("start_velocity", record.start_velocity, SettingsError, at_least=0, at_most=_MOST_FACTOR)
    if record.neighbours is not None:
        whole("neighbours", record.neighbours, at_least=1, at_most=_MOST_PARTICLES)
    one_of("bounds", record.bounds, BOUNDS)
    if not isinstance(record.constraints, (FeasibleFirst, Penalty)):
        raise SettingsError(f"constraints is {shown(record.constraints)}, expected FeasibleFirst(...) or Penalty(weight=...)")


# ---- Named settings --------------------------------------------------------------------------------------------------
#
# They are the paper's settings, ours, and steps between. What each step adds is measured in docs/benchmarks.md.
#
# The numbers of the rising penalty are for an objective like the paper's, whose fitness changes by about one per metre
# of violation. It begins where a violation still pays a little, so that the swarm crosses obstacles, and ends where it
# never does.

_CONSTRICTION: dict[str, Any] = {"inertia": 0.7298, "cognitive": 1.49618, "social": 1.49618}  # Clerc and Kennedy 2002
_INSIDE: dict[str, Any] = {"velocity_clamp": 0.2, "bounds": "reflect"}
_RISING = Penalty(weight=1.5, final_weight=100.0, rise_from=0.5)

NAMED_SETTINGS: dict[str, SwarmSettings] = {
    "pso": PSO(),
    "ipso-m": IPSO(variant="symbiotic"),
    "ipso-s": IPSO(variant="cooperative"),
    "constriction": PSO(**_CONSTRICTION),
    "ring": PSO(**_CONSTRICTION, neighbours=3),
    "ring-small": PSO(**_CONSTRICTION, neighbours=3, particles=100, iterations=300),
    "ring-forgiving": PSO(
        **_CONSTRICTION, neighbours=3, particles=100, iterations=300, constraints=FeasibleFirst(forgiven=0.1)
    ),
    "ring-unclamped": PSO(**_CONSTRICTION, neighbours=3, particles=100, iterations=300, constraints=_RISING),
    "ring-rising": PSO(**_CONSTRICTION, **_INSIDE, neighbours=3, particles=100, iterations=300, constraints=_RISING),
    "evolving-rising": IPSO(
        variant="evolving",
        evolving_share=1.0,
        shrink_to=4,
        particles=100,
        iterations=300,
        constraints=_RISING,
    ),
    "ipso-e": IPSO(
        variant="evolving",
        **_CONSTRICTION,
        **_INSIDE,
        neighbours=3,
        shrink_to=4,
        particles=100,
        iterations=300,
        constraints=_RISING,
    ),
}

DEFAULT_SETTINGS = "ring-small"
"""The name of those for any function: they need no scale of it, and end as feasible as the paper's PSO and better."""


def named_settings(name: str) -> SwarmSettings:
    """Return the settings of that name.

    Raises:
        SettingsError: none has it; the nearest and the known names are listed.
    """
    if not isinstance(name, str) or name not in NAMED_SETTINGS:
        raise SettingsError(f"there are no swarm settings named {shown(name)}; {nearest(str(name), NAMED_SETTINGS)}")
    return NAMED_SETTINGS[name]
