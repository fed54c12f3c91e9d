"""Settings of the planner."""

from __future__ import annotations

from spacearm.checks import as_number
from spacearm.errors import SettingsError
from spacearm.settings import settings, whole
from spacearm.swarm import PSO, Penalty

REACHING = PSO(
    particles=100,
    iterations=100,
    inertia=0.7298,
    cognitive=1.49618,
    social=1.49618,
    neighbours=3,
    constraints=Penalty(weight=30.0, final_weight=1000.0, rise_from=0.3),
)
"""The swarm in configuration space that looks for configurations which reach a position."""


@settings
class PlannerSettings:
    """How a motion is searched for.

    Attributes:
        interior_points: control points between start and goal, K.
        samples: instants of each candidate motion at which clearance is taken; doubled when a proof fails.
        particles: candidate motions at a time.
        iterations: rounds of a search.
        restarts: searches for each goal configuration; the shortest proven motion is kept.
        margin: clearance asked for at the samples [m]; lowered where the start or goal is closer than that.
        goal_candidates: for a goal position: how many swarms look for configurations that reach it, and how many of
            the distinct ones found, nearest first, are planned to.
        time_budget: no further search is begun after this time [s]; None: no limit.
        threads: that searches are spread over; None: one a core. The result does not depend on it.
    """

    interior_points: int = 2
    samples: int = 32
    particles: int = 64
    iterations: int = 100
    restarts: int = 4
    margin: float = 0.005
    goal_candidates: int = 8
    time_budget: float | None = None
    threads: int | None = 1

    def __post_init__(self) -> None:
        whole("interior_points", self.interior_points, at_least=1, at_most=20)
        whole("samples", self.samples, at_least=4, at_most=4096)
        whole("particles", self.particles, at_least=1)
        whole("iterations", self.iterations, at_least=1)
        whole("restarts", self.restarts, at_least=1)
        as_number("margin", self.margin, SettingsError, at_least=0, unit="m")
        whole("goal_candidates", self.goal_candidates, at_least=1)
        if self.time_budget is not None:
            as_number("time_budget", self.time_budget, SettingsError, above=0, unit="s")
        if self.threads is not None:
            whole("threads", self.threads, at_least=1)

    @property
    def swarm(self) -> PSO:
        """The swarm of motions."""
        return PSO(
            particles=self.particles,
            iterations=self.iterations,
            inertia=0.7298,
            cognitive=1.49618,
            social=1.49618,
            neighbours=3,
        )
