"""Whether a motion can begin and end with a tracking error: limits and clearances there must leave room for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.motion import PiecewisePath, RecordedTrajectory
from spacearm.planner.clearance import ClearanceModel
from spacearm.planner.explanations import EndReport
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.problem import Problem
from spacearm.planner.tracking_room import TrackingRoom
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.claim import claim_of
from spacearm.proof.measured import least_clearances
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import required_clearance
from spacearm.proof.tracking import tracking_in_words

Array = NDArray[np.float64]

_FAR = 1e9  # [m] no clearance is larger


def _require_room_at_ends(problem: Problem, room: TrackingRoom) -> None:
    """Refuse a start, or goal configurations, whose tube goes beyond the joints' limits."""
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
            f"expected at least its tracking error, {room.tracking[joint]:.4g} {unit}; give it a smaller one by its name, or "
            f"move the {what}"
        )


def check_tube_at_ends(problem: Problem, room: TrackingRoom) -> EndReport:
    """Check whether the tube touches anything at the start, or at all goals that are given as configurations.

    Args:
        problem: told in the frame of its base; its ends are free of collision.
        room: the tube.

    Returns:
        "start_in_collision", "goal_in_collision" or "free".

    Raises:
        ProblemError: the tube goes beyond a joint's limits at the start or all goal configurations; the joint is named, with
            the room that it has.
    """
    _require_room_at_ends(problem, room)
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
    left = _clearances(model, rows, room.tracking)
    least = left.reshape(len(rows), -1).min(axis=1, initial=np.inf)
    best = int(np.argmax(least))
    if least[best] > 0:
        return ""
    link, other = (int(i) for i in np.unravel_index(int(np.argmin(left[best])), left[best].shape))
    has = _clearances(model, rows[[best]], np.zeros(robot.dof))
    links = tuple(dict.fromkeys(part.name for part in robot.shapes))
    count, clear = len(scene.obstacles), float(has[0, link, other])
    met = f"obstacle {scene.called(other)}" if other < count else f"link '{links[other - count]}'"
    takes = clear - float(left[best, link, other])
    said = tracking_in_words(robot, room.tracking)
    return (
        f"{where} link '{links[link]}' and {met} have {clear * 1e3:.4g} mm, and a tracking error of {said} may take "
        f"{takes * 1e3:.4g} mm; ask for less than {clear / takes:.3g} times that error"
    )


def _clearances(model: ClearanceModel, rows: Array, tracking: Array) -> Array:
    """Return the clearances of configurations (b, n) within a tube, (b, l, k + l); see `least_clearances`."""
    robot, scene = model.robot, model.scene
    u = np.arange(len(rows) + 1.0)
    trajectory = RecordedTrajectory(robot, PiecewisePath.from_linear(u, np.vstack([rows, rows[-1:]])), base="fixed")
    base = begun_base_proof(robot, trajectory, base_setup_of(trajectory, robot, who="trajectory"))
    path, required = PathIntervals(base.curve), required_clearance(robot, scene, 0.0)
    claim = claim_of(robot, scene, base, path, required=required, tracking=tracking)
    links = len(required.links)
    found, _ = least_clearances(claim, u[:-1], np.full((links, len(scene.obstacles) + links), _FAR), in_tube=True)
    return found
