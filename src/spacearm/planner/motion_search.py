"""The native search for motions, on one island or several side by side."""

from __future__ import annotations

import math
import mmap
import os
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_readonly
from spacearm.core.errors import ProblemError
from spacearm.core.native import native
from spacearm.core.random_seed import Rng, seed_of
from spacearm.core.records import setting_names
from spacearm.motion import Motion
from spacearm.motion.limit_margins import as_jerk_limit
from spacearm.planner.clearance import Margins, margins_within_reach
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal
from spacearm.planner.inverse_kinematics import FAR
from spacearm.planner.kernel_model import kernel_model, native_class
from spacearm.planner.plan_result import Improvement
from spacearm.planner.planner_settings import PlannerSettings, as_planner_settings
from spacearm.planner.problem import Problem, as_searchable
from spacearm.robot.unchecked_pairs import require_envelope
from spacearm.swarm import Swarm
from spacearm.swarm.swarm_settings import kernel_settings

Array = NDArray[np.float64]

_PRECISION = 32  # the search's; the proof is float64
_MORE_POINTS = 2  # of control points, where more is asked of a floating base than clearance
_FINEST = 1e-4  # [m or rad] no nearer to the end of a floating base's motion does float32 come for sure
_ROOM = 1 << 27  # bytes, for a thread more and its work
_RATES = 1e-12, 1e12  # limits beyond are as good as these, and stay numbers in float32
_WITHIN, _WITHIN_LIMIT = 0.5, 0.995  # of tolerances and limits: so near the search comes, for float32 and instants between


class Islands:
    """Searches over spline motions from the start to goal configurations; their best motion, and how it came about.

    Args:
        problem: robot, scene, start and limits.
        goals: (g, n) configurations to end in [rad or m].
        settings: of the planner.
        seed: random seed of all islands.
        margins: clearances asked for at the instants looked at; None: `settings.margin`, less where an end has no room.
    """

    def __init__(
        self, problem: Problem, goals: Array, settings: PlannerSettings, *, seed: int, margins: Margins | None = None
    ) -> None:
        problem = problem.local
        self._problem, self._goals, self._settings = problem, goals, settings
        self.margins = _margins(problem, goals, settings.margin) if margins is None else margins
        self.bounds = search_bounds(problem)
        self._base = asked_of_the_base(problem)
        self._free_end = self._base.get("kind", 0) != 0
        constrained = self._free_end or "attitude" in self._base or problem.base_limits.peak is not None
        self._more_points = _MORE_POINTS if constrained else 0
        self._all = [self.search(_PRECISION, seed, island) for island in range(settings.islands)]

    def search(self, precision: int, seed: int, island: int) -> Any:
        """Return a search of the kernel's, for numbers of 32 or 64 bits."""
        problem, settings = self._problem, self._settings
        robot = problem.robot
        model = kernel_model(robot, problem.scene, precision=precision)
        jerk = np.zeros(0) if settings.jerk_limit is None else np.array(as_jerk_limit(robot, settings.jerk_limit))
        weights = {name: float(getattr(settings.weights, name)) for name in setting_names(type(settings.weights))}
        scene, margins = model.native, self.margins
        if len(margins.most):
            scene = scene.eased(margins.capsules, margins.obstacles, margins.others, margins.most)
        return native_class("MotionSearch", precision)(
            problem.base_model.kernel_robot(scene, robot),
            np.array(problem.start),
            np.ascontiguousarray(self._goals),
            *(np.array(bound) for bound in self.bounds),
            np.clip(robot.velocity, *_RATES),
            np.clip(robot.acceleration, *_RATES),
            jerk,
            margins.asked,
            settings.comfort,
            model.tip,
            np.array(model.centres, dtype=np.int32),
            np.array([weights[name] for name in native.motion_terms]),
            self._base if precision == _PRECISION else asked_of_the_base(problem, precision),
            {"interior": [count + self._more_points for count in settings.interior_points]},
            native.SwarmSettings.make(kernel_settings(settings.swarm)),
            seed,
            island,
        )

    def run(
        self, *, evaluations: int, seconds: float, until_first: bool, stall: int, progress: Callable[[int], Any] | None = None
    ) -> None:
        """Go on searching; 0 is no limit. Interrupted by Ctrl-C, all islands stop and keep what they have.

        Where the system starts no more threads, those that run do all the work.
        """
        waiting, stopped, failures = deque(self._all), False, list[BaseException]()
        begin = threading.Event()

        def go_on(done: int) -> bool:
            if progress is not None:
                progress(done)
            return not stopped

        def work() -> None:
            while not stopped:
                try:
                    island = waiting.popleft()
                except IndexError:
                    return
                island.run(evaluations, share, until_first, stall, go_on)

        def help_out() -> None:
            nonlocal stopped
            begin.wait()
            try:
                work()
            except BaseException as error:  # told by the calling thread
                failures.append(error)
                stopped = True

        helpers = _started(help_out, min(self._settings.threads or os.cpu_count() or 1, len(self._all)) - 1)
        rounds = -(-len(self._all) // (1 + len(helpers)))
        share = seconds / rounds  # islands that wait for a thread have their share of the time
        try:
            begin.set()
            work()
            for helper in helpers:
                helper.join()
        except BaseException:
            stopped = True
            begin.set()
            for helper in helpers:
                helper.join()
            raise
        if failures:
            raise failures[0]

    def add_instant(self, s: float, spread: float) -> None:
        """Look at an instant, and those around it, from now on; motions that collide there are forgotten."""
        for island in self._all:
            island.add_instant(s, spread)

    @property
    def best(self) -> Motion | None:
        """The best free motion, if there is one; of the first island that has it."""
        found = [island.best for island in self._all if island.best is not None]
        return self._motion(min(found, key=lambda best: best["fitness"])) if found else None

    @property
    def fallback(self) -> Motion | None:
        """The motion that is least in collision, if any was looked at."""
        found = [island.fallback for island in self._all if island.fallback is not None]
        return self._motion(min(found, key=lambda fallback: fallback["violation"])) if found else None

    @property
    def evaluations(self) -> int:
        """Candidate motions looked at."""
        return sum(island.evaluations for island in self._all)

    def motions(self) -> list[Motion]:
        """Return the motions of the history, best first."""
        entries = [entry for island in self._all for entry in island.history]
        return [self._motion({"goal": e[4], "points": e[5]}) for e in sorted(entries, key=lambda e: e[2])]

    def history(self) -> tuple[Improvement, ...]:
        """Return the improvements in the order of evaluations; each is better than all before it."""
        entries = sorted(
            ((e[1], number, e) for number, island in enumerate(self._all) for e in island.history), key=lambda row: row[:2]
        )
        out: list[Improvement] = []
        for _, number, (seconds, evaluations, fitness, by, goal, points) in entries:
            if out and fitness >= out[-1].fitness:
                continue
            out.append(
                Improvement(
                    seconds=seconds,
                    evaluations=evaluations,
                    fitness=fitness,
                    by=by,
                    goal=goal,
                    interior_points=len(points) - self._free_end,
                    island=number,
                )
            )
        return tuple(out)

    def judge(self, rows: NDArray[np.float32], interior: int, goal: int = 0) -> dict[str, Any]:
        """Return fitness, violation, terms and whether free, of motions given by their interior control points (m, K n)."""
        return self._all[0].judge(rows, interior, goal)

    def terms(self, motion: Motion) -> dict[str, float]:
        """Return a motion's fitness term by term; its goal is one of this search's."""
        goal, points = self._goal_of(motion), self._points_of(motion)
        rows = np.ascontiguousarray(points.reshape(1, -1), dtype=np.float32)
        values = self.judge(rows, motion.interior, goal)["terms"][0]
        return {name: float(value) for name, value in zip(native.motion_terms, values, strict=True)}

    def settled(self, motion: Motion) -> Motion:
        """Return a motion of a floating base with what is asked of its end met in float64; itself if nothing is.

        The search's motions meet it in float32. What cannot be met more exactly stays as it was.
        """
        if not self._base.get("kind") and "attitude" not in self._base:
            return motion
        rows = np.ascontiguousarray(self._points_of(motion).reshape(1, -1))
        exact, met = self.search(64, 0, 0).settled(rows, motion.interior, self._goal_of(motion))
        if not met[0]:
            return motion
        return self._motion({"points": exact.reshape(-1, motion.dof), "goal": self._goal_of(motion)})

    def _goal_of(self, motion: Motion) -> int:
        return int(np.argmin(np.abs(self._goals - motion.control_points[-1]).max(axis=1)))

    def _points_of(self, motion: Motion) -> Array:
        """Return the control points that the search moves."""
        return motion.control_points[1:] if self._free_end else motion.control_points[1:-1]

    def _motion(self, found: dict[str, Any]) -> Motion:
        lower, upper = self.bounds
        inside = np.clip(np.asarray(found["points"], dtype=np.float64), lower, upper)  # float32 may round a bound outwards
        ends = [] if self._free_end else [self._goals[found["goal"]]]
        return Motion(np.vstack([self._problem.start, inside.reshape(-1, len(lower)), *ends]))


def _margins(problem: Problem, goals: Array, margin: float) -> Margins:
    """Return the margin that can be asked for between the start and the goals (g, n)."""
    # Where the arm moves its base, nobody knows where the base will be at a goal, and so what is near.
    ends = problem.start[None] if problem.base_model.follows_arm else np.vstack([problem.start, goals])
    return margins_within_reach(problem, ends, margin)


def search_bounds(problem: Problem) -> tuple[Array, Array]:
    """Return the box that motions are sought in, (n,) each: the limits; for joints without, a turn about the start."""
    robot, start, goal = problem.robot, problem.start, problem.goal
    lower = np.where(robot.lower >= start - FAR, robot.lower, start - math.tau)
    upper = np.where(robot.upper <= start + FAR, robot.upper, start + math.tau)
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        rows = np.atleast_2d(goal.q)
        low, high = (rows - goal.tolerance).min(axis=0), (rows + goal.tolerance).max(axis=0)
        lower = np.maximum(np.minimum(lower, low), robot.lower)
        upper = np.minimum(np.maximum(upper, high), robot.upper)
    return lower, upper


def _started(work: Callable[[], None], count: int) -> list[threading.Thread]:
    """Start so many threads, or as many as the system starts."""
    out: list[threading.Thread] = []
    for _ in range(count):
        thread = threading.Thread(target=work, daemon=True)
        try:
            # A thread that finds no memory for its own variables ends the process: some must be left.
            mmap.mmap(-1, _ROOM).close()
            thread.start()
        except (RuntimeError, MemoryError, OSError):
            break
        out.append(thread)
    return out


def asked_of_the_base(problem: Problem, precision: int = _PRECISION) -> dict[str, Any]:
    """Return what the kernel is told of the base and, where the arm moves it, of how the motion is to end.

    Args:
        problem: told in the frame of the base as it stands at the beginning.
        precision: of the kernel's numbers, 32 or 64 bits; the shorter ones cannot come as near as one may ask.
    """
    out = problem.base_model.kernel_base(problem.robot, problem.momentum, problem.duration)
    if not problem.base_model.follows_arm:
        return out
    goal, limits = problem.goal, problem.base_limits
    finest = _FINEST if precision == _PRECISION else 0.0
    if isinstance(goal, (PositionGoal, PoseGoal)):
        frame = problem.robot.frame(goal.frame or problem.robot.tip)
        pose = goal.pose if isinstance(goal, PoseGoal) else np.eye(4)
        axis = goal.free_axis if isinstance(goal, PoseGoal) else None
        near, turned = goal.tolerances
        out |= {
            "kind": 1 if isinstance(goal, PositionGoal) else 3 if axis is None else 2,
            "joint": frame.joint,
            "local": frame.T_joint_frame[:3, :3].ravel().tolist(),
            "offset": frame.T_joint_frame[:3, 3].tolist(),
            "wanted": pose[:3, :3].ravel().tolist(),
            "position": goal.position.tolist(),
            "axis": [0.0, 0.0, 0.0] if axis is None else axis.tolist(),
            "near": max(_WITHIN * near, finest),
            "turned": max(_WITHIN * turned, finest),
        }
    wanted = problem.base_goal
    if wanted is not None:
        out |= {"attitude": wanted.attitude_wxyz.tolist(), "attitude_turned": max(_WITHIN * wanted.tolerance, finest)}
    elif limits.final is not None:
        within = max(_WITHIN_LIMIT * limits.final, finest)
        out |= {"attitude": [1.0, 0.0, 0.0, 0.0], "attitude_turned": within, "attitude_within": True}
    for key, limit in (("most_turned", limits.peak), ("most_rate", limits.rate), ("most_arm", limits.joint_momentum)):
        if limit is not None:
            out[key] = _WITHIN_LIMIT * limit
    return out


# ---- A swarm of motions by hand: for objectives and penalties of one's own -------------------------------------------


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
        problem, settings = as_searchable(problem), as_planner_settings(settings)
        require_envelope(problem.robot)
        self.problem, self.settings = problem, settings
        self.goal = _configuration(problem, goal)
        self.interior = settings.interior_points[0]
        joint_goal = replace(problem, goal=ConfigurationGoal(self.goal))
        self._islands = Islands(joint_goal, self.goal[None].copy(), settings, seed=0)
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
