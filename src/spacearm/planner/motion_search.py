"""The kernel's search for motions, on one island or several side by side; and a swarm of motions by ask and tell.

An island is a search with a random sequence of its own: RRT-Connect trees, refinement and the swarm take turns on it.
"""

from __future__ import annotations

import math
import mmap
import os
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief, Rows, brief, counted, in_short
from spacearm.core.checks import as_readonly
from spacearm.core.errors import ProblemError
from spacearm.core.native import native
from spacearm.core.random_seed import Rng, seed_of
from spacearm.dynamics.base_models import BaseDemands
from spacearm.motion import Motion
from spacearm.motion.limit_margins import as_jerk_limit
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal
from spacearm.planner.inverse_kinematics import FAR, kernel_goal
from spacearm.planner.kernel_model import KernelModel, kernel_model, make_kernel_model
from spacearm.planner.plan_result import Improvement, SearchState
from spacearm.planner.planner_settings import PlannerSettings, as_planner_settings
from spacearm.planner.problem import Problem, as_searchable
from spacearm.planner.searched_clearance import SearchedClearance, searched_clearance
from spacearm.planner.tracking_room import TrackingRoom, tracking_room, within_tube
from spacearm.robot.unchecked_pairs import require_envelope
from spacearm.swarm import Swarm
from spacearm.swarm.swarm_settings import kernel_settings

Array = NDArray[np.float64]

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
        searched: clearances asked for at the instants looked at; None: those that the problem requires and 2 mm more, less
            where an end has no room.
        wide: whether a proof has failed with the room that is left for a tracking error at first.
    """

    def __init__(
        self,
        problem: Problem,
        goals: Array,
        settings: PlannerSettings,
        *,
        seed: int,
        searched: SearchedClearance | None = None,
        wide: bool = False,
    ) -> None:
        problem = problem.local
        self._problem, self._goals, self._settings = problem, goals, settings
        room = tracking_room(problem, settings)
        self.searched = _searched(problem, goals, room, wide=wide) if searched is None else searched
        self.bounds = search_bounds(problem, 0.0 if room is None else room.tracking)
        demands = base_demands(problem)
        self._free_end = demands.frame is not None
        self._constrained_end = self._free_end or demands.attitude is not None
        self._more_points = _MORE_POINTS if self._constrained_end or demands.most_turned > 0 else 0
        self._model = self._made_model()
        self._all = [self.search32(seed, island) for island in range(settings.islands)]

    def search32(self, seed: int, island: int) -> native.MotionSearch32:
        """Return a search of the kernel's for numbers of 32 bits."""
        problem = self._request(base_demands(self._problem))
        scene, settings = self._model.model32, self._search_settings()
        return native.MotionSearch32(scene=scene, problem=problem, settings=settings, seed=seed, island=island)

    def search64(self) -> native.MotionSearch64:
        """Return one for numbers of 64 bits, to bring what was found onto its goal."""
        problem = self._request(base_demands(self._problem, finest=0.0))
        scene, settings = self._model.model64, self._search_settings()
        return native.MotionSearch64(scene=scene, problem=problem, settings=settings, seed=0, island=0)

    def _made_model(self) -> KernelModel:
        problem, pairs = self._problem, self.searched.kernel_pairs
        masses = problem.base_model.kernel_masses(problem.robot)
        if masses is None and pairs is None:
            return kernel_model(problem.robot, problem.scene)
        return make_kernel_model(problem.robot, problem.scene, pair_margins=pairs, masses=masses)

    def _request(self, demands: BaseDemands) -> native.MotionProblem:
        problem, settings = self._problem, self._settings
        robot = problem.robot
        lower, upper = self.bounds
        weights = native.MotionWeights()
        for name in native.motion_terms:
            setattr(weights, name, float(getattr(settings.weights, name)))
        jerk = None if settings.jerk_limit is None else np.array(as_jerk_limit(robot, settings.jerk_limit), dtype=np.float64)
        return native.MotionProblem(
            start=np.array(problem.start),
            goals=np.ascontiguousarray(self._goals),
            lower=np.array(lower),
            upper=np.array(upper),
            velocity=np.clip(robot.velocity, *_RATES),
            acceleration=np.clip(robot.acceleration, *_RATES),
            jerk=jerk,
            margin=self.searched.asked,
            preferred_clearance=settings.preferred_clearance,
            tip=self._model.tip,
            centers=np.array(self._model.centres, dtype=np.int32),
            weights=weights,
            base=problem.base_model.kernel_base(robot, problem.momentum, problem.duration, demands),
            near_pairs=self.searched.kernel_near_pairs(len(self._goals)),
        )

    def _search_settings(self) -> native.SearchSettings:
        out = native.SearchSettings()
        out.interior = [count + self._more_points for count in self._settings.interior_points]
        out.swarm = kernel_settings(self._settings.swarm)
        return out

    def run(
        self,
        *,
        evaluations: int,
        seconds: float,
        until_first: bool,
        stall: int,
        progress: Callable[[int], object] | None = None,
        watch: Callable[[SearchState], object] | None = None,
    ) -> None:
        """Go on searching; 0 is no limit. Interrupted by Ctrl-C, all islands stop and keep what they have.

        Where the system starts no more threads, those that run do all the work.

        Args:
            evaluations, seconds: of each island, at most.
            until_first: be content with the first motion.
            stall: evaluations without an improvement after which an island ends.
            progress: called with an island's evaluations some 25 times a second; what it raises ends the search.
            watch: likewise, with what has been found so far. Neither changes what is found.
        """
        stopped, watching = False, None if watch is None else _Watching(watch, self._motion)

        def asked_by(island: native.MotionSearch32) -> Callable[[int], bool]:
            def go_on(done: int) -> bool:
                if progress is not None:
                    progress(done)
                if watching is not None:
                    watching.look(island)
                return not stopped

            return go_on

        if len(self._all) == 1:  # no threads to be prepared, which takes a good part of an easy search
            only, go_on = self._all[0], asked_by(self._all[0])
            only.run(evaluations=evaluations, seconds=seconds, until_first=until_first, stall=stall, progress=go_on)
            return
        waiting, failures = deque(self._all), list[BaseException]()
        begin = threading.Event()

        def work() -> None:
            while not stopped:
                try:
                    island = waiting.popleft()
                except IndexError:
                    return
                go_on = asked_by(island)
                island.run(evaluations=evaluations, seconds=share, until_first=until_first, stall=stall, progress=go_on)

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
    def found(self) -> bool:
        """Whether there is a free motion."""
        return any(island.best is not None for island in self._all)

    @property
    def best(self) -> Motion | None:
        """The best free motion, if there is one; of the first island that has it."""
        found = [best for island in self._all if (best := island.best) is not None]
        return self._motion(min(found, key=lambda best: best.fitness)) if found else None

    @property
    def fallback(self) -> Motion | None:
        """The motion that is least in collision, if any was looked at."""
        found = [fallback for island in self._all if (fallback := island.fallback) is not None]
        return self._motion(min(found, key=lambda fallback: fallback.violation)) if found else None

    @property
    def evaluations(self) -> int:
        """Candidate motions looked at."""
        return sum(island.evaluations for island in self._all)

    def motions(self) -> list[Motion]:
        """Return the motions of the history, best first."""
        entries = [entry for island in self._all for entry in island.history]
        return [self._motion(entry) for entry in sorted(entries, key=lambda entry: entry.fitness)]

    def history(self) -> tuple[Improvement, ...]:
        """Return the improvements in the order of evaluations; each is better than all before it."""
        entries = sorted(
            ((number, entry) for number, island in enumerate(self._all) for entry in island.history),
            key=lambda row: (row[1].evaluations, row[0]),
        )
        out: list[Improvement] = []
        for number, entry in entries:
            if out and entry.fitness >= out[-1].fitness:
                continue
            out.append(
                Improvement(
                    seconds=entry.seconds,
                    evaluations=entry.evaluations,
                    fitness=entry.fitness,
                    by=entry.by,
                    goal=entry.goal,
                    interior_points=len(entry.points) - self._free_end,
                    island=number,
                )
            )
        return tuple(out)

    def judge(self, rows: NDArray[np.float32], interior: int, goal: int = 0) -> native.Judgement32:
        """Return fitness, violation, terms and whether free, of motions given by their interior control points (m, K n)."""
        return self._all[0].judge(rows, interior, goal)

    def terms(self, motion: Motion) -> dict[str, float]:
        """Return a motion's fitness term by term; its goal is one of this search's."""
        goal, points = self._goal_of(motion), self._points_of(motion)
        rows = np.ascontiguousarray(points.reshape(1, -1), dtype=np.float32)
        values = self.judge(rows, motion.interior, goal).terms[0]
        return {name: float(value) for name, value in zip(native.motion_terms, values, strict=True)}

    def projected(self, motion: Motion) -> Motion:
        """Return a motion projected onto the constraints at its end in float64; itself where nothing is asked of the end.

        The search's motions meet them in float32. What cannot be met more exactly stays as it was.
        """
        if not self._constrained_end:
            return motion
        rows = np.ascontiguousarray(self._points_of(motion).reshape(1, -1))
        projected = self.search64().project(rows, motion.interior, self._goal_of(motion))
        if not projected.met[0]:
            return motion
        return self._placed(projected.points.reshape(-1, motion.dof), self._goal_of(motion))

    def _goal_of(self, motion: Motion) -> int:
        return int(np.argmin(np.abs(self._goals - motion.control_points[-1]).max(axis=1)))

    def _points_of(self, motion: Motion) -> Array:
        """Return the control points that the search moves."""
        return motion.control_points[1:] if self._free_end else motion.control_points[1:-1]

    def _motion(self, found: native.FoundMotion32 | native.Improvement32) -> Motion:
        return self._placed(found.points.astype(np.float64), found.goal)

    def _placed(self, points: Array, goal: int) -> Motion:
        """Return the motion with these control points, as the search has them, and a goal."""
        lower, upper = self.bounds
        inside = np.clip(points, lower, upper)  # float32 may round a bound outwards
        ends = [] if self._free_end else [self._goals[goal]]
        return Motion(np.vstack([self._problem.start, inside.reshape(-1, len(lower)), *ends]))


class _Watching:
    """Tells somebody the best motion of several islands while they search, each in a thread of its own."""

    def __init__(self, tell: Callable[[SearchState], object], motion_of: Callable[[native.FoundMotion32], Motion]) -> None:
        self._tell, self._motion_of = tell, motion_of
        self._lock = threading.Lock()
        self._motion: Motion | None = None
        self._fitness = math.inf

    def look(self, island: native.MotionSearch32) -> None:
        """Tell what there is; called by the island itself, which stands still."""
        best, evaluations = island.best, island.evaluations
        with self._lock:
            if best is not None and best.fitness < self._fitness:
                self._motion, self._fitness = self._motion_of(best), best.fitness
            self._tell(SearchState(evaluations=evaluations, motion=self._motion, fitness=self._fitness))


def _searched(problem: Problem, goals: Array, room: TrackingRoom | None, *, wide: bool) -> SearchedClearance:
    """Return the clearances that can be asked for between the start and the goals (g, n)."""
    # Where the arm moves its base, the place of the base at a goal is not known, and so what is near it.
    ends = problem.start[None] if problem.base_model.follows_arm else np.vstack([problem.start, goals])
    taken = None if room is None else room.guessed(ends, len(problem.scene.obstacles), wide=wide)
    return searched_clearance(problem, ends, taken)


def search_bounds(problem: Problem, tracking: Array | float = 0.0) -> tuple[Array, Array]:
    """Return the box that motions are sought in, (n,) each: the limits; for joints without, a turn about the start.

    A tracking error (n,) [rad or m] makes it smaller on all sides.
    """
    robot, start, goal = problem.robot, problem.start, problem.goal
    lower = np.where(robot.lower >= start - FAR, robot.lower, start - math.tau)
    upper = np.where(robot.upper <= start + FAR, robot.upper, start + math.tau)
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        rows = np.atleast_2d(goal.q)
        low, high = (rows - goal.tolerance).min(axis=0), (rows + goal.tolerance).max(axis=0)
        lower = np.maximum(np.minimum(lower, low), robot.lower)
        upper = np.minimum(np.maximum(upper, high), robot.upper)
    return within_tube(robot, lower, upper, tracking)


def _started(work: Callable[[], None], count: int) -> list[threading.Thread]:
    """Start this number of threads, or as many as the system starts."""
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


def base_demands(problem: Problem, *, finest: float = _FINEST) -> BaseDemands:
    """Return what is asked of a motion whose base the arm moves: of its end, and of the base.

    Args:
        problem: told in the frame of the base as it stands at the beginning.
        finest: [m or rad] tolerances below are taken as this one; float32 cannot come as near as one may ask.
    """
    if not problem.base_model.follows_arm:
        return BaseDemands()
    limits = problem.base_limits
    turned, rate, arm = (
        0.0 if limit is None else _WITHIN_LIMIT * limit for limit in (limits.peak, limits.rate, limits.joint_momentum)
    )
    return BaseDemands(
        frame=_frame_goal(problem, finest),
        attitude=_attitude_goal(problem, finest),
        most_turned=turned,
        most_rate=rate,
        most_arm_momentum=arm,
    )


def _frame_goal(problem: Problem, finest: float) -> native.FrameGoal | None:
    goal = problem.goal
    if not isinstance(goal, (PositionGoal, PoseGoal)):
        return None
    near, turned = (max(_WITHIN * tolerance, finest) for tolerance in goal.tolerances)
    return kernel_goal(problem.robot, goal, distance=near, angle=turned)


def _attitude_goal(problem: Problem, finest: float) -> native.AttitudeGoal | None:
    wanted, final = problem.base_goal, problem.base_limits.final
    if wanted is not None:
        tolerance = max(_WITHIN * wanted.tolerance, finest)
        return native.AttitudeGoal(wxyz=np.array(wanted.attitude_wxyz), tolerance=tolerance, anywhere_within=False)
    if final is None:
        return None
    within = max(_WITHIN_LIMIT * final, finest)
    return native.AttitudeGoal(wxyz=np.array([1.0, 0.0, 0.0, 0.0]), tolerance=within, anywhere_within=True)


# ---- A swarm of motions by ask and tell, for the caller's own objectives and penalties -------------------------------

_MOST_INTERIOR = 512  # control points that the kernel takes
_FURTHEST = 1e6  # [rad or m] of a control point: float32 has no digits behind the point there
_BETWEEN = 1e-3  # [m] of violation where the 32 instants show none, and finer ones do
_SPREADS = (0.0, 0.1, 0.3, 0.6, 1.0)  # [rad or m] standard deviations of the first particles from the straight motion, in turn


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

    def __repr__(self) -> str:
        return brief(self)


class MotionSwarm(Brief):
    """A swarm whose particles are motions from a problem's start to one goal configuration.

    A round is ``motions = swarm.ask()``, then ``swarm.tell(fitness)`` or ``swarm.tell(fitness, violation)`` with numbers of
    your own; `judge` gives the planner's, to add to. What the swarm finds is not proven: give `best` to `certify`.

    Args:
        problem: robot, scene, start; its goal too, unless `goal` is given.
        settings: of the planner: `interior_points` (the first of them), `swarm` and `weights` count.
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
    def searched(self) -> SearchedClearance:
        """The clearances that `judge` asks for."""
        return self._islands.searched

    def _in_short(self) -> tuple[str, Rows]:
        rows = [("problem", in_short(self.problem)[0].removeprefix("Problem: ")), *in_short(self._swarm)[1]]
        return f"MotionSwarm: {counted(self.interior, 'control point')} between start and goal", rows

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
        terms = {name: found.terms[:, i].astype(np.float64) for i, name in enumerate(native.motion_terms)}
        violation, free = found.violation.astype(np.float64), found.free
        # Else the best motions would be those that slip through between the instants.
        violation = np.where(free, violation, np.where(violation > 0, violation, _BETWEEN))
        return Judged(found.fitness.astype(np.float64), violation, free, terms)

    def _rows(self, x: Array) -> Array:
        inside = np.asarray(x).reshape(len(x), self.interior, self.problem.robot.dof)
        ends = (np.broadcast_to(end, (len(x), 1, len(end))) for end in (self.problem.start, self.goal))
        first, last = ends
        return np.concatenate([first, inside, last], axis=1)

    def _around_straight(self, seed: int, lower: Array, upper: Array) -> Array:
        line = self.straight.control_points[1:-1].ravel()
        spread = np.resize(_SPREADS, self.settings.swarm.particles)
        noise = np.random.default_rng(seed).normal(size=(len(spread), len(line)))
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
