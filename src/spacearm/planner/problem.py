"""What is to be planned: a robot, a scene, a start and a goal, checked as far as that needs no kinematics."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import Frozen, as_readonly, shown
from spacearm.errors import ProblemError, nearest
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, Goal, PoseGoal, PositionGoal
from spacearm.robot.model import Robot
from spacearm.scene import Obstacle, Scene

Array = NDArray[np.float64]

_ROUNDING = 1e-9  # [rad or m] this far beyond a limit is a file's last digit, and is set onto the limit


@dataclass(frozen=True, slots=True, eq=False)
class Problem(Frozen):
    """A motion-planning problem.

    Attributes:
        robot: what moves.
        scene: what is in the way; a list of obstacles is taken too.
        start: (n,) joint positions at the beginning [rad or m], within the limits.
        goal: where to end; n numbers are taken as a ConfigurationGoal, rows of n as a ConfigurationsGoal. The frame of a
            PositionGoal or PoseGoal is filled in; configurations that may be whole turns away are turned nearest to the
            start.
        base: "fixed".

    Whether start and goal are free of collision and within reach is the planner's to say.

    Raises:
        ProblemError: a start or goal that does not fit the robot, or a base that is not supported.
    """

    robot: Robot
    scene: Scene
    _: KW_ONLY
    start: Array
    goal: Goal
    base: Literal["fixed"] = "fixed"

    if TYPE_CHECKING:  # what is taken is wider than what is kept

        def __init__(
            self,
            robot: Robot,
            scene: Scene | Iterable[Obstacle],
            *,
            start: ArrayLike,
            goal: Goal | ArrayLike,
            base: Literal["fixed"] = "fixed",
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.robot, Robot):
            raise ProblemError(f"robot is {shown(self.robot)}, expected a Robot; make one with load_robot(...)")
        if not isinstance(self.scene, Scene):
            object.__setattr__(self, "scene", _scene(self.scene))
        _require_base(self.base)
        object.__setattr__(self, "start", within_limits(self.robot, self.start, what="start"))
        object.__setattr__(self, "goal", _goal(self.robot, self.goal, self.start))


def within_limits(robot: Robot, q: ArrayLike, *, what: Literal["start", "goal"], prefix: str = "") -> Array:
    """Check a configuration against the robot; what is beyond a limit by no more than 1e-9 is set onto it.

    Args:
        robot: the robot.
        q: (n,) joint positions [rad or m].
        what: "start" or "goal", for the message.
        prefix: begins the message.

    Returns:
        The configuration (n,), read-only.

    Raises:
        ProblemError: another length, numbers that are not finite, or a joint beyond its limits, which is
            named.
    """
    name = prefix + ("start" if what == "start" else "the goal configuration")
    given = as_readonly(name, q, (robot.dof,), ProblemError, advice=_one_per_joint(robot))
    kept = np.clip(given, robot.lower, robot.upper)
    beyond = np.flatnonzero(np.abs(given - kept) > _ROUNDING)
    if beyond.size:
        raise ProblemError(prefix + _beyond_limit(robot, given, beyond, what))
    return as_readonly(name, kept, (robot.dof,), ProblemError)


def _one_per_joint(robot: Robot) -> str:
    return f"give one number per joint of robot '{robot.name}': {', '.join(robot.dof_names)}"


def _beyond_limit(robot: Robot, q: Array, beyond: NDArray[Any], what: str) -> str:
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


def whole_turns(robot: Robot) -> NDArray[np.bool_]:
    """Tell of which joints a whole turn moves no link, (n,): not of slides, nor where others follow at another pace."""
    out = np.ones(robot.dof, dtype=bool)
    for joint in robot.joints:
        out[joint.dof] &= joint.kind == "revolute" and float(joint.multiplier).is_integer()
    return out


def _scene(given: Any) -> Scene:
    if given is None or not isinstance(given, Iterable):
        raise ProblemError(f"scene is {shown(given)}, expected a Scene; write Scene([]) for free space")
    return Scene(given)  # type: ignore[arg-type]


def _require_base(base: Any) -> None:
    if base == "floating":
        raise ProblemError("base 'floating' is not supported yet, expected 'fixed'; plan with base='fixed'")
    if base != "fixed":
        raise ProblemError(f"base is {shown(base)}, expected 'fixed'")


def _goal(robot: Robot, goal: Any, start: Array) -> Goal:
    if isinstance(goal, (PositionGoal, PoseGoal)):
        return replace(goal, frame=_goal_frame(robot, goal.frame))
    if not isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        goal = _configurations(robot, goal)
    if isinstance(goal.tolerance, np.ndarray):
        as_readonly("the goal's tolerance", goal.tolerance, (robot.dof,), ProblemError, advice=_one_per_joint(robot))
    rows = goal.q if isinstance(goal, ConfigurationsGoal) else [goal.q]
    kept = []
    for i, row in enumerate(rows):
        q = within_limits(robot, row, what="goal", prefix=f"goal {i}: " if len(rows) > 1 else "")
        kept.append(nearest_turns(robot, q, start) if goal.shortest else q)
    return replace(goal, q=np.array(kept) if isinstance(goal, ConfigurationsGoal) else kept[0])


def _configurations(robot: Robot, goal: Any) -> ConfigurationGoal | ConfigurationsGoal:
    if isinstance(goal, (str, bytes, dict)) or not isinstance(goal, Iterable):
        raise ProblemError(
            f"goal is {shown(goal)}, expected {robot.dof} joint positions, or a ConfigurationGoal, ConfigurationsGoal, "
            "PositionGoal or PoseGoal"
        )
    given: Any = goal if isinstance(goal, np.ndarray) else list(goal)
    rows = len(given) > 0 and all(isinstance(row, (list, tuple, np.ndarray)) for row in given)
    if rows and len(given) == 4 and robot.dof != 4 and all(np.iterable(row) and len(list(row)) == 4 for row in given):
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
