"""The planning problem: a robot, a scene, a start and a goal, and what is asked of a base that moves with its arm.

Everything is checked when a problem is made, as far as that needs no kinematics. `Problem.local` is the same problem told in
the frame of the base as it stands at the beginning: the search knows only that frame.
"""

# pyright: reportUnnecessaryIsInstance=false
# What callers pass is checked at run time too.

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from importlib import import_module
from typing import TYPE_CHECKING, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Rows
from spacearm.core.checks import Frozen, as_number, as_readonly, as_sentences, keep, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.core.exact import product
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.notebook_hook import InNotebooks
from spacearm.core.rotations import as_unit, matrix_of, quaternion_of
from spacearm.dynamics import Momentum, momentum_map, system_mass
from spacearm.dynamics.base_models import LIMITS, Base, BaseModel, FloatingBase, base_model, checked_base
from spacearm.geometry import Obstacle, Scene
from spacearm.geometry.scene import moved_scene
from spacearm.planner.clearance import ClearanceModel, clearance_model
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, Goal, PoseGoal, PositionGoal
from spacearm.planner.plans_in_short import problem_in_short
from spacearm.proof.required_clearance import DEFAULT_CLEARANCE, PairClearance, RequiredClearance, required_clearance
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

_LEAST_LIMIT = 1e-9  # [rad, rad/s or N m s] of the base: below, rounding decides
_NO_LIMIT = 1e12  # as good as no limit
SNAP_TOLERANCE = 1e-5
"""[rad or m] A start or goal so little beyond a joint's limit is set onto it by default: so much is a file's rounding."""
SET_ONTO_LIMITS = "set onto them"
"""What a problem's note says of an end that was beyond a limit by rounding."""
_MOST_SNAPPED = 0.1  # [rad or m] more is no rounding
_WIDEST = 1e3  # [m] of a clearance
_MOST_TURNED = 1e6  # [rad or m] of a joint: beyond, float64 has too few digits to prove anything with
_MOST_SEARCHED = 1e4  # [rad or m] of a joint: beyond, float32 has too few digits to search with
_FURTHEST = 1e6  # [m] of the base from the inertial origin, at the beginning and by its drift: likewise for float64
_SHORTEST, _LONGEST = 1e-6, 1e9  # [s] durations: far beyond any motion, and their squares are numbers in float32
_VAST_CLEARANCE = 0.5  # [m] of a problem: beyond, it may be meant in millimetres, which is told
_MOST_TUMBLING = 18.0  # [rad] that the momentum turns the base by: nearly three turns, the most that the search can follow
_MOST_ANGULAR = 1e9  # [N m s] of the momentum: no spacecraft has as much
_FOR_PROOFS = ("pinocchio", "numpy.ma")  # imported with the first problem, in 60 ms: else the first plan would wait for them
_FREE_SPACE = Scene([])  # always the same one: what is made of a robot among it is made once


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AttitudeGoal(Frozen):
    """How the base is to stand when the motion ends.

    Attributes:
        attitude_wxyz: (4,) unit quaternion of R_w_b, from base to inertial frame; what is given is made one of length 1.
        tolerance: [rad] by which it may be missed, above 0; by default about 0.03 degrees.

    Raises:
        ProblemError: numbers that are no quaternion, or a tolerance that is not above 0.
    """

    attitude_wxyz: Array
    tolerance: float = 5e-4

    if TYPE_CHECKING:  # the constructor takes more types than the fields have

        def __init__(self, attitude_wxyz: ArrayLike, tolerance: float = ...) -> None: ...

    def __post_init__(self) -> None:
        tolerance = as_number("the base goal's tolerance", self.tolerance, ProblemError, above=0, at_most=_NO_LIMIT, unit="rad")
        unit = as_unit("the base goal's attitude_wxyz", self.attitude_wxyz)
        keep(self, attitude_wxyz=as_readonly("attitude_wxyz", unit, (4,), ProblemError), tolerance=tolerance)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class BaseLimits(Frozen):
    """How little the arm may disturb its base; None is no limit.

    A rate or a momentum is kept by moving slower, unless the problem states its duration; angles do not depend on time.

    Attributes:
        final: angle between the base's attitudes at the end and at the beginning [rad].
        peak: the greatest angle from the attitude at the beginning, at any time [rad].
        rate: how fast the base may turn [rad/s].
        joint_momentum: the arm's angular momentum about the system's centre of mass, its joints' motion alone [N m s]: what
            reaction wheels would have to take up to hold the base's attitude.

    Raises:
        ProblemError: a limit that is not above 0, or so small that only rest would keep it.
    """

    final: float | None = None
    peak: float | None = None
    rate: float | None = None
    joint_momentum: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("final", "rad"), ("peak", "rad"), ("rate", "rad/s"), ("joint_momentum", "N m s")):
            given, what = getattr(self, name), f"base limit {name}"
            if given is not None:
                value = as_number(what, given, ProblemError, at_least=_LEAST_LIMIT, at_most=_NO_LIMIT, unit=unit)
                keep(self, **{name: value})

    @property
    def asked(self) -> tuple[str, ...]:
        """The names of the limits that there are."""
        return tuple(name for name in LIMITS if getattr(self, name) is not None)

    @property
    def any(self) -> bool:
        """Whether there is a limit at all."""
        return bool(self.asked)


class _WithLocal(Frozen):
    """Gives a problem room to keep itself as seen from its base; that is no part of its value."""

    __slots__ = ("_local",)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Problem(_WithLocal, InNotebooks):
    """A motion-planning problem.

    Attributes:
        robot: what moves.
        scene: what is in the way, at rest in the inertial frame; a list of obstacles is taken too.
        start: (n,) joint positions at the beginning [rad or m], within the limits.
        goal: where to end; n numbers are taken as a ConfigurationGoal, rows of n as a ConfigurationsGoal. The frame of a
            PositionGoal or PoseGoal is filled in, and its place is in the inertial frame; configurations that may be whole
            turns away are turned nearest to the start.
        base: "fixed", or "floating": free to drift and turn as the arm moves; None: as the robot says.
        base_start: (4, 4) T_w_b at the beginning [m]; a point (3,) is taken too; None: at the inertial origin, unturned.
        momentum: of base and arm, if the base floats; None: none. With angular momentum it needs a duration.
        base_goal: how the floating base is to stand at the end; four numbers are taken as its attitude_wxyz.
        base_limits: how little the arm may disturb the floating base.
        duration: of the motion [s]; None: the least that the limits allow.
        clearance: that every link keeps from every obstacle, and from the links that it must keep clear of, during the whole
            motion [m], 0 or more; 0: there is no contact. A pair that has less at the start or the goal keeps what it has
            there, and the clearance from when it first has it.
        clearances: others, for some pairs: `PairClearance`, or mappings with its fields. The more specific one counts, of two
            alike the later.
        snap_tolerance: a start or goal beyond a joint's limit by no more than this is set onto the limit, and a note says
            so [rad or m]; 0 up to 0.1.
        notes: what was assumed, snapped or left out on the way here, a sentence each; no part of the problem's value.

    Whether start and goal are free of collision and within reach is the planner's to say.

    Raises:
        ProblemError: a start or goal that does not fit the robot, a base that cannot be, or a clearance of what is not there.
        RobotError: a floating base of a robot whose masses cannot be.
    """

    robot: Robot
    scene: Scene
    _: KW_ONLY
    start: Array
    goal: Goal
    base: Base = None  # type: ignore[assignment]  # filled in below
    base_start: Array = None  # type: ignore[assignment]
    momentum: Momentum = None  # type: ignore[assignment]
    base_goal: AttitudeGoal | None = None
    base_limits: BaseLimits = None  # type: ignore[assignment]
    duration: float | None = None
    clearance: float = DEFAULT_CLEARANCE
    clearances: tuple[PairClearance, ...] = ()
    snap_tolerance: float = SNAP_TOLERANCE
    notes: tuple[str, ...] = field(default=(), compare=False)

    if TYPE_CHECKING:  # the constructor takes more types than the fields have

        def __init__(
            self,
            robot: Robot,
            scene: Scene | Iterable[Obstacle],
            *,
            start: ArrayLike,
            goal: Goal | ArrayLike,
            base: Base | None = None,
            base_start: ArrayLike | None = None,
            momentum: Momentum | None = None,
            base_goal: AttitudeGoal | ArrayLike | None = None,
            base_limits: BaseLimits | None = None,
            duration: float | None = None,
            clearance: float = ...,
            clearances: Iterable[PairClearance | Mapping[str, object]] = (),
            snap_tolerance: float = ...,
            notes: Iterable[str] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.robot, Robot):
            raise ProblemError(f"robot is {shown(self.robot)}, expected a Robot; make one with load_robot(...)")
        if not isinstance(self.scene, Scene):
            keep(self, scene=_scene(self.scene))
        keep(self, **checked_base(self.robot, self.base, self.base_start, self.momentum))
        goal, limits, duration = _asked_of_the_base(self)
        keep(self, base_goal=goal, base_limits=limits, duration=duration)
        keep(self, clearance=_clearance(self.clearance), clearances=_clearances(self.clearances))
        if self.clearances:
            required_clearance(self.robot, self.scene, self.clearance, self.clearances)  # refuses what is not there
        snap = _snap_tolerance(self.snap_tolerance)
        notes = list(as_sentences("notes", self.notes, ProblemError))
        start = within_limits(self.robot, self.start, what="start", tolerance=snap, notes=notes)
        goal = _goal(self.robot, self.goal, start, snap, notes)
        if self.clearance > _VAST_CLEARANCE:
            notes.append(
                f"a clearance of {self.clearance:g} m is asked for, more than arms are likely to keep; check its units"
            )
        keep(self, start=start, goal=goal, snap_tolerance=snap, notes=tuple(dict.fromkeys(notes)), _local=None)
        _require_slow_tumbling(self)
        for library in _FOR_PROOFS:
            import_module(library)

    def _in_short(self) -> tuple[str, Rows]:
        return problem_in_short(self)

    @property
    def base_model(self) -> BaseModel:
        """What holds the base."""
        return base_model(self.base)

    @property
    def floats(self) -> bool:
        """Whether the base floats."""
        return isinstance(self.base_model, FloatingBase)

    @property
    def required(self) -> RequiredClearance:
        """The clearance that is required of every pair."""
        return required_clearance(self.robot, self.scene, self.clearance, self.clearances)

    @property
    def at_start(self) -> ClearanceModel:
        """What the arm may meet while the base is where it stands at the beginning."""
        return clearance_model(self.robot, self.local.scene)

    @property
    def at_goal(self) -> ClearanceModel:
        """What it may meet at a goal configuration: no obstacle where it moves its base, whose place there is not known."""
        return clearance_model(self.robot, _FREE_SPACE) if self.base_model.follows_arm else self.at_start

    @property
    def local(self) -> Problem:
        """The same problem told in the frame of the base as it stands at the beginning: there `base_start` is unity."""
        if self._local is None:
            keep(self, _local=self if np.array_equal(self.base_start, np.eye(4)) else _told_from_the_base(self))
        return cast(Problem, self._local)


def _told_from_the_base(problem: Problem) -> Problem:
    R, p = problem.base_start[:3, :3], problem.base_start[:3, 3]
    T_b_w = np.eye(4)
    T_b_w[:3, :3], T_b_w[:3, 3] = R.T, -product(R.T, p)
    goal, base_goal, momentum = problem.goal, problem.base_goal, problem.momentum
    if isinstance(goal, PositionGoal):
        goal = replace(goal, position=product(R.T, goal.position - p))
    elif isinstance(goal, PoseGoal):
        goal = replace(goal, pose=product(T_b_w, goal.pose))
    if base_goal is not None:
        base_goal = replace(base_goal, attitude_wxyz=quaternion_of(product(R.T, matrix_of(base_goal.attitude_wxyz))))
    return replace(
        problem,
        scene=moved_scene(problem.scene, T_b_w),
        goal=goal,
        base_start=np.eye(4),
        base_goal=base_goal,
        momentum=Momentum(linear=product(R.T, momentum.linear), angular=product(R.T, momentum.angular)),
    )


def _asked_of_the_base(problem: Problem) -> tuple[AttitudeGoal | None, BaseLimits, float | None]:
    """Return `base_goal`, `base_limits` and `duration`, checked."""
    goal, limits = problem.base_goal, cast("BaseLimits | None", problem.base_limits)
    limits = BaseLimits() if limits is None else limits
    if goal is not None and not isinstance(goal, AttitudeGoal):
        goal = AttitudeGoal(goal)
    if not isinstance(limits, BaseLimits):
        raise ProblemError(f"base_limits is {shown(limits)}, expected BaseLimits(...)")
    model = problem.base_model
    if (goal is not None and not model.takes_goal) or not set(limits.asked) <= set(model.limits):
        what = "base_goal" if goal is not None and not model.takes_goal else "base_limits"
        raise ProblemError(
            f"base is '{problem.base}' and {what} is given, expected a floating base with it; give base='floating'"
        )
    if goal is not None and limits.final is not None:
        raise ProblemError(
            "base_goal and base_limits.final are both given, expected one of them; the goal has its own tolerance"
        )
    duration = problem.duration
    if duration is not None:
        duration = as_number("duration", duration, ProblemError, above=0, unit="s")
    elif not problem.momentum.is_zero:
        raise ProblemError(
            "momentum is given without a duration, expected both: how far the spacecraft tumbles depends on time"
        )
    _require_within_reason(problem, duration)
    return goal, limits, duration


def _require_within_reason(problem: Problem, duration: float | None) -> None:
    """Refuse what is so far away, or takes so short or long, that rounding or overflow would decide."""
    far = float(np.abs(problem.base_start[:3, 3]).max())
    if far > _FURTHEST:
        raise ProblemError(f"base_start is {far:.3g} m from the inertial origin, expected at most {_FURTHEST:g} m")
    if duration is None:
        return
    if not _SHORTEST <= duration <= _LONGEST:
        raise ProblemError(f"duration is {duration:.3g} s, expected {_SHORTEST:g} to {_LONGEST:g} s")
    if not problem.momentum.is_zero:
        with np.errstate(over="ignore"):
            drift = float(np.abs(problem.momentum.linear).max() / system_mass(problem.robot) * duration)
        spin = float(np.abs(problem.momentum.angular).max())
        if drift > _FURTHEST:
            raise ProblemError(
                f"momentum.linear carries the spacecraft {drift:.3g} m away in {duration:.4g} s, expected at most "
                f"{_FURTHEST:g} m; check its units and the duration's"
            )
        if spin > _MOST_ANGULAR:
            raise ProblemError(
                f"momentum.angular is up to {spin:.3g} N m s, expected at most {_MOST_ANGULAR:g}; check its units"
            )


def _require_slow_tumbling(problem: Problem) -> None:
    if not problem.momentum.angular.any():
        return
    inertia = float(np.linalg.eigvalsh(momentum_map(problem.robot, problem.start)[0])[0])
    turned = float(np.linalg.norm(problem.momentum.angular)) / inertia * (problem.duration or 0.0)
    if turned > _MOST_TUMBLING:
        raise ProblemError(
            f"momentum.angular turns the spacecraft by up to {turned:.3g} rad in {problem.duration:.4g} s, expected at most "
            f"{_MOST_TUMBLING:g} rad, which the search can follow; state a shorter duration, or check the units"
        )


def within_limits(
    robot: Robot,
    q: ArrayLike,
    *,
    what: Literal["start", "goal"],
    prefix: str = "",
    tolerance: float = SNAP_TOLERANCE,
    notes: list[str] | None = None,
) -> Array:
    """Check a configuration against the robot; what is a little beyond a limit is set onto it.

    Args:
        robot: the robot.
        q: (n,) joint positions [rad or m].
        what: "start" or "goal", for the message.
        prefix: begins the message.
        tolerance: how little is a little [rad or m].
        notes: gets a sentence on what was set onto a limit, and by how much.

    Returns:
        The configuration (n,), read-only.

    Raises:
        ProblemError: another length, numbers that are not finite or far too large, or a joint beyond its limits, which
            is named.
    """
    name = prefix + ("start" if what == "start" else "the goal configuration")
    given = as_readonly(name, q, (robot.dof,), ProblemError, advice=_one_per_joint(robot))
    inside = np.clip(given, robot.lower, robot.upper)
    _require_at_most(_MOST_TURNED, robot, given, what=what, prefix=prefix)
    beyond = np.flatnonzero(np.abs(given - inside) > tolerance)
    if beyond.size:
        raise ProblemError(prefix + _beyond_limit(robot, given, beyond, what))
    snapped = np.flatnonzero(given != inside)
    if snapped.size and notes is not None:
        each = [
            f"'{robot.dof_names[i]}' by {abs(given[i] - inside[i]):.2g} {'m' if robot.is_prismatic(int(i)) else 'rad'}"
            for i in snapped
        ]
        notes.append(f"{name} is a little beyond the limits and was {SET_ONTO_LIMITS}: joint {', '.join(each)}")
    return as_readonly(name, inside, (robot.dof,), ProblemError)


def as_searchable(problem: object) -> Problem:
    """Return a problem whose start and goal are near enough to 0 for the search, which computes in float32.

    Raises:
        ProblemError: no problem, or a joint is more than 1e4 rad or m from 0.
    """
    if not isinstance(problem, Problem):
        raise ProblemError(f"problem is {shown(problem)}, expected a Problem; make one with Problem(...) or load_problem(...)")
    robot, start, goal = problem.robot, problem.start, problem.goal
    _require_at_most(_MOST_SEARCHED, robot, start, what="start")
    for q in np.atleast_2d(goal.q) if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)) else ():
        _require_at_most(_MOST_SEARCHED, robot, q, what="goal")
    return problem


def _require_at_most(most: float, robot: Robot, q: Array, *, what: str, prefix: str = "") -> None:
    far = int(np.argmax(np.abs(q)))
    if abs(q[far]) > most:
        raise ProblemError(
            f"{prefix}joint '{robot.dof_names[far]}' {'starts' if what == 'start' else 'ends'} at {q[far]:.4g}, expected "
            f"at most {most:g} {'m' if robot.is_prismatic(far) else 'rad'}; check the units, or take whole turns away"
        )


def _one_per_joint(robot: Robot) -> str:
    return f"give one number per joint of robot '{robot.name}': {', '.join(robot.dof_names)}"


def _beyond_limit(robot: Robot, q: Array, beyond: NDArray[np.intp], what: str) -> str:
    i = int(beyond[0])
    above = q[i] > robot.upper[i]
    limit = robot.upper[i] if above else robot.lower[i]
    prismatic = robot.is_prismatic(i)
    digits = 4 if f"{q[i]:.4g}" != f"{limit:.4g}" else 12
    others = f" (and {beyond.size - 1} more)" if beyond.size > 1 else ""
    verb, side = "starts" if what == "start" else "ends", "above" if above else "below"
    text = (
        f"joint '{robot.dof_names[i]}'{others} {verb} at {q[i]:.{digits}g} {'m' if prismatic else 'rad'}, "
        f"{side} its limit {limit:.{digits}g}; change `{what}` or the limit"
    )
    # Nobody means 40 rad: a value beyond a full turn that fits as degrees was most likely written in them.
    in_degrees = robot.lower[i] <= math.radians(q[i]) <= robot.upper[i]
    meant_degrees = not prismatic and abs(q[i]) > math.tau and in_degrees
    return text + (", or convert degrees to radians" if meant_degrees else "")


def nearest_turns(robot: Robot, q: Array, near: Array) -> Array:
    """Turn joints without limits by whole turns, which moves no link, to where they are nearest to a configuration.

    Args:
        robot: the robot.
        q: (..., n) configurations [rad or m].
        near: (n,) where to be near.

    Returns:
        (..., n). Joints with a limit, slides, and those that others follow at another pace stay as they are.
    """
    endless = whole_turns(robot) & (robot.lower == -np.inf) & (robot.upper == np.inf)
    return np.where(endless, q - math.tau * np.round((q - near) / math.tau), q)


@cached_by_identity
def whole_turns(robot: Robot) -> NDArray[np.bool_]:
    """Tell of which joints a whole turn moves no link, (n,): not of slides, nor where others follow at another pace."""
    out = np.ones(robot.dof, dtype=bool)
    for joint in robot.joints:
        out[joint.dof] &= joint.kind == "revolute" and float(joint.multiplier).is_integer()
    out.setflags(write=False)
    return out


def _clearance(given: object) -> float:
    return as_number("clearance", given, ProblemError, at_least=0, at_most=_WIDEST, unit="m")


def _clearances(given: object) -> tuple[PairClearance, ...]:
    if isinstance(given, (str, bytes, Mapping)) or not isinstance(given, Iterable):
        advice = "expected a list of PairClearance(...), or of mappings such as {'obstacle': 'client', 'clearance': 0.05}"
        raise ProblemError(f"clearances is {shown(given)}, {advice}")
    return tuple(as_pair_clearance(i, entry) for i, entry in enumerate(cast("Iterable[object]", given)))


def as_pair_clearance(index: int, given: object) -> PairClearance:
    """Return a PairClearance, made of a mapping with its fields if it is one.

    Raises:
        ProblemError: something else, or a field that there is not or that is missing.
    """
    if isinstance(given, PairClearance):
        return given
    if not isinstance(given, Mapping):
        raise ProblemError(
            f"clearances[{index}] is {shown(given)}, expected a PairClearance(...), or a mapping with its fields"
        )
    values, known = dict(cast("Mapping[str, object]", given)), ["links", *(one.name for one in fields(PairClearance))]
    for name in values:
        if name not in known:
            raise ProblemError(f"clearances[{index}] has no field {shown(name)}; {nearest(str(name), known)}")
    if "clearance" not in values:
        raise ProblemError(f"clearances[{index}] states no clearance, expected one [m]; add it")
    if "links" in values:
        values |= _two_links(index, values.pop("links"))
    return PairClearance(**values)  # type: ignore[arg-type]  # it checks them


def _two_links(index: int, given: object) -> dict[str, object]:
    if not isinstance(given, (list, tuple)) or len(cast("list[object]", given)) != 2:
        raise ProblemError(f"clearances[{index}].links is {shown(given)}, expected the names of two links")
    return dict(zip(("link", "other_link"), cast("list[object]", given), strict=True))


def _snap_tolerance(given: object) -> float:
    return as_number("snap_tolerance", given, ProblemError, at_least=0, at_most=_MOST_SNAPPED, unit="rad or m")


def _scene(given: object) -> Scene:
    if not isinstance(given, Iterable):
        raise ProblemError(f"scene is {shown(given)}, expected a Scene; write Scene([]) for free space")
    return Scene(cast("Iterable[Obstacle]", given))  # which refuses what is no obstacle


def _goal(robot: Robot, goal: Goal | ArrayLike, start: Array, snap: float, notes: list[str]) -> Goal:
    if isinstance(goal, (PositionGoal, PoseGoal)):
        return replace(goal, frame=_goal_frame(robot, goal.frame))
    if not isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        goal = _configurations(robot, goal)
    if not isinstance(goal.tolerance, float):
        as_readonly("the goal's tolerance", goal.tolerance, (robot.dof,), ProblemError, advice=_one_per_joint(robot))
    rows = goal.q if isinstance(goal, ConfigurationsGoal) else [goal.q]
    each: list[Array] = []
    for i, row in enumerate(rows):
        prefix = f"goal {i}: " if len(rows) > 1 else ""
        q = within_limits(robot, row, what="goal", prefix=prefix, tolerance=snap, notes=notes)
        each.append(nearest_turns(robot, q, start) if goal.shortest else q)
    return replace(goal, q=np.array(each) if isinstance(goal, ConfigurationsGoal) else each[0])


def _configurations(robot: Robot, goal: object) -> ConfigurationGoal | ConfigurationsGoal:
    if isinstance(goal, (str, bytes, dict)) or not isinstance(goal, Iterable):
        raise ProblemError(
            f"goal is {shown(goal)}, expected {robot.dof} joint positions, or a ConfigurationGoal, ConfigurationsGoal, "
            "PositionGoal or PoseGoal"
        )
    entries = list(cast("Iterable[object]", goal))
    given = cast("ArrayLike", goal if isinstance(cast("object", goal), np.ndarray) else entries)
    rows = len(entries) > 0 and all(isinstance(row, (list, tuple, np.ndarray)) for row in entries)
    if rows and len(entries) == 4 and robot.dof != 4 and all(len(list(cast("Iterable[object]", row))) == 4 for row in entries):
        raise ProblemError(f"goal is 4 by 4, expected {robot.dof} joint positions; for a pose in space write PoseGoal(pose)")
    if rows:
        return ConfigurationsGoal(given)
    q = as_readonly("the goal configuration", given, (None,), ProblemError)
    if q.size == 3 and robot.dof != 3:
        raise ProblemError(
            f"goal has 3 numbers, expected {robot.dof} joint positions; for a point in space write PositionGoal((x, y, z))"
        )
    return ConfigurationGoal(q)


def _goal_frame(robot: Robot, given: str | None) -> str:
    name = robot.tip if given is None else given
    frame = next((frame for frame in robot.frames if frame.name == name), None)
    if frame is None:
        known = nearest(name, (frame.name for frame in robot.frames))
        raise ProblemError(f"the goal's frame '{name}' is none of robot '{robot.name}'; {known}")
    if frame.joint < 0:
        raise ProblemError(f"the goal's frame '{name}' is fixed to the base and no joint moves it; name another frame")
    return name
