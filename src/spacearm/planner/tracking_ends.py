"""Whether a motion can begin and end with a tracking error: limits and clearances there must leave room for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.planner.clearance import ClearanceModel
from spacearm.planner.explanations import EndReport
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.problem import Problem
from spacearm.planner.tracking_room import TrackingRoom
from spacearm.proof.measured import clearances_in_tube
from spacearm.proof.tracking import tracking_in_words

Array = NDArray[np.float64]

_ENOUGH = 1e-3  # [m] so much left in the tube need not be measured exactly


def require_room_at_ends(problem: Problem, room: TrackingRoom) -> None:
    """Refuse a start, or goal configurations, whose tube goes beyond the joints' limits.

    Raises:
        ProblemError: the first such joint is named, with the tracking error that it has room for.
    """
    _require_within(problem, room, problem.start[None], "start")
    goal = problem.goal
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)) and not np.any(goal.tolerance):
        _require_within(problem, room, np.atleast_2d(goal.q), "goal")


def _require_within(problem: Problem, room: TrackingRoom, rows: Array, what: str) -> None:
    robot = problem.robot
    has = np.minimum(rows - robot.lower, robot.upper - rows)  # (b, n)
    lacks = room.tracking - has - 1e-12
    if (lacks > 0).any(axis=1).all():
        row = int(np.argmin(lacks.max(axis=1)))
        joint = int(np.argmax(lacks[row]))
        unit = "m" if robot.is_prismatic(joint) else "rad"
        raise ProblemError(
            f"the {what} of joint '{robot.dof_names[joint]}' is {max(has[row, joint], 0.0):.4g} {unit} from its limit, "
            f"expected at least its tracking error, {room.tracking[joint]:.4g} {unit}; make that smaller, or move the {what}"
        )


def check_tube_at_ends(problem: Problem, room: TrackingRoom) -> EndReport:
    """Check whether the tube touches anything at the start, or at all goals that are given as configurations.

    Args:
        problem: told in the frame of its base; its ends are free of collision.
        room: the tube.

    Returns:
        "start_in_collision", "goal_in_collision" or "free".
    """
    message = _met_by_tube(problem.at_start, problem.start[None], room, "at the start")
    if message:
        return EndReport(status="start_in_collision", q=problem.start, message=message)
    goal = problem.goal
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)) and not np.any(goal.tolerance):
        rows = np.atleast_2d(goal.q)
        message = _met_by_tube(problem.at_goal, rows, room, "at the goal")
        if message:
            return EndReport(status="goal_in_collision", q=rows[0], message=message)
    return EndReport(status="free")


def with_tube_explained(problem: Problem, report: EndReport, room: TrackingRoom) -> EndReport:
    """Return why no goal configuration was found, with what the tube touches at the one that comes nearest."""
    if report.q is None or report.contacts or report.status != "goal_in_collision":
        return report
    message = _met_by_tube(problem.at_goal, report.q[None], room, "at the goal, at the least,")
    return replace(report, message=message) if message else report


def _met_by_tube(model: ClearanceModel, rows: Array, room: TrackingRoom, where: str) -> str:
    """Say what the tube touches in the best of configurations (b, n); "" if it touches nothing in one of them."""
    robot, scene = model.robot, model.scene
    left, _ = clearances_in_tube(robot, scene, rows, room.tracking, _ENOUGH)
    least = left.reshape(len(rows), -1).min(axis=1, initial=np.inf)
    best = int(np.argmax(least))
    if least[best] > 0:
        return ""
    link, other = (int(i) for i in np.unravel_index(int(np.argmin(left[best])), left[best].shape))
    has, _ = clearances_in_tube(robot, scene, rows[[best]], np.zeros(robot.dof), np.inf)
    links = tuple(dict.fromkeys(part.name for part in robot.shapes))
    count, clear = len(scene.obstacles), float(has[0, link, other])
    met = f"obstacle {scene.called(other)}" if other < count else f"link '{links[other - count]}'"
    takes = clear - float(left[best, link, other])
    said = tracking_in_words(robot, room.tracking)
    return (
        f"{where} link '{links[link]}' and {met} have {clear * 1e3:.4g} mm, and a tracking error of {said} may take "
        f"{takes * 1e3:.4g} mm; ask for less than {clear / takes:.3g} times that error"
    )
