"""What a figure of a motion is given: a plan, a saved plan, or a trajectory; and the axes that it draws in."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import shown
from spacearm.core.errors import ProblemError, SettingsError
from spacearm.motion import AnyTrajectory
from spacearm.motion.trajectory import OnABase, base_frames
from spacearm.planner import Plan, PoseGoal, PositionGoal, Problem
from spacearm.planner.goals import ConfigurationsGoal, Goal
from spacearm.proof import Certificate
from spacearm.robot import Robot, forward_kinematics

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class MotionShown(Brief):
    """What is known of a motion that is drawn.

    Attributes:
        trajectory: the motion; None where there is none.
        problem: that it is for; None of a trajectory alone.
        certificate: of the motion; None where there is none.
        title: what its figures are called unless they are given a title.
    """

    trajectory: AnyTrajectory | None
    problem: Problem | None = None
    certificate: Certificate | None = None
    title: str = ""


def motion_shown(result: Any, *, what: str) -> MotionShown:
    """Return what is known of a motion.

    Args:
        result: a Plan, a SavedPlan, or a trajectory.
        what: the figure, for the message.

    Raises:
        ProblemError: something else, or a plan without a motion.
    """
    if isinstance(result, OnABase):
        return MotionShown(trajectory=result)  # type: ignore[arg-type]
    trajectory, problem = getattr(result, "trajectory", None), getattr(result, "problem", None)
    if not isinstance(problem, Problem):
        raise ProblemError(f"{what} is given {shown(result)}, expected a Plan, a SavedPlan or a Trajectory")
    if trajectory is None:
        raise ProblemError(f"{what} is given a plan without a motion, expected one with a trajectory; {result.message}")
    certificate = result.certificate if isinstance(result, Plan) else None
    proven = not isinstance(result, Plan) or result.found
    title = problem.robot.name if proven else f"{problem.robot.name}: not proven"
    return MotionShown(trajectory=trajectory, problem=problem, certificate=certificate, title=title)


def target_of(goal: Goal, robot: Robot, trajectory: AnyTrajectory) -> Array:
    """Return the point (3,) that is drawn as the target [m]; of several configurations, the one nearest to the end.

    A configuration's is where it has the end effector as the base stands at the end.
    """
    if isinstance(goal, (PositionGoal, PoseGoal)):
        return goal.position
    q = goal.q
    if isinstance(goal, ConfigurationsGoal):
        end = trajectory.sample(trajectory.duration).q
        q = goal.q[int(np.argmin(np.linalg.norm(goal.q - end, axis=1)))]
    return (base_frames(trajectory, trajectory.duration) @ forward_kinematics(robot, q))[:3, 3]


def axes_given(ax: Any, shape: tuple[int, ...], *, what: str) -> NDArray[Any]:
    """Return the axes that a figure with several panels is to be drawn in, as an array of a shape.

    Args:
        ax: as many axes as the figure has panels, row by row: an array of `Figure.subplots`, or a list.
        shape: of the panels.
        what: the figure, for the message.

    Raises:
        SettingsError: another number of axes.
    """
    given: list[Axes] = np.asarray(ax, dtype=object).ravel().tolist() if isinstance(ax, (Iterable, np.ndarray)) else [ax]
    wanted = int(np.prod(shape))
    if len(given) != wanted or not all(hasattr(one, "plot") for one in given):
        grid = ", ".join(map(str, shape))
        raise SettingsError(
            f"ax is {len(given)} axes, expected the {wanted} of {what}; make them with figure.subplots({grid}), or leave ax out"
        )
    return np.asarray(given, dtype=object).reshape(shape)
