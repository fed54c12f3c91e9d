"""A swarm of motions by hand: for objectives and penalties of one's own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm._kernel import native
from spacearm.checks import as_readonly, shown
from spacearm.errors import ProblemError, SettingsError
from spacearm.motion import Motion
from spacearm.planner.clearance import Margins, margins_within_reach
from spacearm.planner.goals import ConfigurationGoal, PoseGoal, PositionGoal
from spacearm.planner.islands import Islands
from spacearm.planner.problem import Problem, placed_ends, require_searchable
from spacearm.planner.settings import PlannerSettings
from spacearm.robot.left_out import require_envelope
from spacearm.swarm import Rng, Swarm, seed_of

Array = NDArray[np.float64]

_MOST_INTERIOR = 32
_FURTHEST = 1e6  # [rad or m]
_BETWEEN = 1e-3  # [m] of violation where the 32 instants show none, and finer ones do
_START = (0.0, 0.1, 0.3, 0.6, 1.0)  # [rad or m] how far from the straight motion the first particles are drawn


class Judged(NamedTuple):
    """What the planner itself thinks of motions.

    Attributes:
        fitness: (m,) weighted sum of the terms.
        violation: (m,) shortfall of clearance, summed over pairs and 32 instants [m]; 1 mm where only the finer instants show
            one; 0 if all instants looked at are free.
        free: (m,) whether all instants looked at are free, the finer ones too.
        terms: (m,) each, by the names of `Weights`.
    """

    fitness: Array
    violation: Array
    free: NDArray[np.bool_]
    terms: dict[str, Array]


class MotionSwarm:
    """A swarm whose particles are motions from a problem's start to one goal configuration.

    A round is ``motions = swarm.ask()``, then ``swarm.tell(fitness)`` or ``swarm.tell(fitness, violation)`` with numbers of
    your own; `judge` gives the planner's, to add to. What the swarm finds is not proven: give `best` to `certify`.

    Args:
        problem: robot, scene, start; its goal too, unless `goal` is given.
        settings: of the planner: `interior_points` (the first of them), `swarm`, `weights` and `margin` count.
        goal: (n,) configuration to end in [rad or m]; needed where the problem's goal is none. It is then all that is asked of
            the end: with a floating base, where the end effector gets to depends on the whole motion.
        rng: seed, generator or None.

    Raises:
        ProblemError: a goal that is no configuration.
        RobotError: a robot without an envelope, unless none is meant.
        SettingsError: settings of something else.
    """

    def __init__(
        self, problem: Problem, settings: PlannerSettings | None = None, *, goal: ArrayLike | None = None, rng: Rng = None
    ) -> None:
        if not isinstance(problem, Problem):
            raise ProblemError(f"problem is {shown(problem)}, expected a Problem; make one with Problem(...)")
        settings = PlannerSettings() if settings is None else settings
        if not isinstance(settings, PlannerSettings):
            raise SettingsError(f"settings is {shown(settings)}, expected PlannerSettings(...)")
        require_searchable(problem)
        require_envelope(problem.robot)
        self.problem, self.settings = problem, settings
        self.goal = _configuration(problem, goal)
        self.interior = settings.interior_points[0]
        ends = placed_ends(problem, self.goal[None])
        margins = margins_within_reach(problem.local, ends, settings.margin)
        joint_goal = replace(problem, goal=ConfigurationGoal(self.goal))
        self._islands = Islands(joint_goal, self.goal[None].copy(), settings, seed=0, margins=margins)
        seed = seed_of(rng)
        lower, upper = (np.tile(bound, self.interior) for bound in self._islands.bounds)
        self._swarm = Swarm(lower, upper, settings.swarm, rng=seed, initial=self._around_straight(seed, lower, upper))

    @property
    def margins(self) -> Margins:
        """The clearances that `judge` asks for, and which of them were lowered: where start or goal are nearer."""
        return self._islands.margins

    @property
    def done(self) -> bool:
        """Whether the swarm's iterations are spent."""
        return self._swarm.done

    @property
    def straight(self) -> Motion:
        """The straight motion, with as many control points as the particles."""
        return Motion(np.linspace(self.problem.start, self.goal, self.interior + 2))

    @property
    def best(self) -> Motion:
        """The best motion told so far: less violation first, then less fitness."""
        return Motion(self._rows(self._swarm.best_x[None])[0])

    def ask(self) -> Array:
        """Return the motions to look at: control points (particles, K + 2, n) [rad or m], for `Motion`."""
        return self._rows(self._swarm.ask())

    def tell(self, fitness: ArrayLike, violation: ArrayLike | None = None) -> None:
        """Tell what the motions asked for are worth.

        Args:
            fitness: (particles,) less is better.
            violation: (particles,) by how much constraints are broken, 0 if not; None: they are not.
        """
        self._swarm.tell(fitness, violation)

    def judge(self, control_points: ArrayLike) -> Judged:
        """Return what the planner thinks of motions.

        Args:
            control_points: (m, K + 2, n) as `ask` gives them [rad or m].

        Raises:
            ProblemError: another shape.
        """
        n = self.problem.robot.dof
        points = as_readonly("control_points", control_points, (None, None, n), ProblemError)
        if np.abs(points).max(initial=0.0) > _FURTHEST:
            raise ProblemError(
                f"control_points has a number of {np.abs(points).max():.3g}, expected at most {_FURTHEST:g} rad or m; "
                "check the units"
            )
        interior = points.shape[1] - 2
        if not 0 <= interior <= _MOST_INTERIOR:
            raise ProblemError(
                f"control_points has shape {points.shape}, expected (m, K + 2, {n}): start, up to {_MOST_INTERIOR} points, "
                "the goal"
            )
        rows = np.ascontiguousarray(points[:, 1:-1].reshape(len(points), interior * n), dtype=np.float32)
        found = self._islands.judge(rows, interior)
        terms = {name: found["terms"][:, i].astype(np.float64) for i, name in enumerate(native.motion_terms)}
        violation, free = found["violation"].astype(np.float64), np.array(found["free"], dtype=bool)
        # Else the best motions would be those that slip through between the instants.
        violation = np.where(free, violation, np.where(violation > 0, violation, _BETWEEN))
        return Judged(found["fitness"].astype(np.float64), violation, free, terms)

    def _rows(self, x: Array) -> Array:
        inside = np.asarray(x).reshape(len(x), self.interior, self.problem.robot.dof)
        ends = (np.broadcast_to(end, (len(x), 1, len(end))) for end in (self.problem.start, self.goal))
        first, last = ends
        return np.concatenate([first, inside, last], axis=1)

    def _around_straight(self, seed: int, lower: Array, upper: Array) -> Array:
        line = self.straight.control_points[1:-1].ravel()
        spread = np.resize(_START, self.settings.swarm.particles)
        noise: Any = np.random.default_rng(seed).normal(size=(len(spread), len(line)))
        return np.clip(line + spread[:, None] * noise, lower, upper)


def _configuration(problem: Problem, goal: ArrayLike | None) -> Array:
    if goal is not None:
        return as_readonly("goal", goal, (problem.robot.dof,), ProblemError)
    if problem.base_model.follows_arm and isinstance(problem.goal, (PositionGoal, PoseGoal)):
        raise ProblemError(
            f"the base floats and the problem's goal is a {type(problem.goal).__name__}, expected a configuration to end in: "
            "where the end effector gets to depends on the whole motion; give `goal`, or leave the search to plan(...)"
        )
    if not isinstance(problem.goal, ConfigurationGoal):
        raise ProblemError(
            f"the problem's goal is a {type(problem.goal).__name__}, expected a configuration to end in; give `goal`, as in "
            "one of plan(...).goals"
        )
    return problem.goal.q
