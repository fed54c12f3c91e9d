"""Whether the goal can be reached, and with which configuration: what the ghost arm shows; and the arm pulled by its tip."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import SpacearmError
from spacearm.core.exact import product
from spacearm.geometry import pose
from spacearm.planner.explanations import check_ends, explain_goal
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal
from spacearm.planner.inverse_kinematics import Reach, find_goal_configurations, goal_errors, polished
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem
from spacearm.robot.unchecked_pairs import lacks_envelope
from spacearm.view.nearest import Tone

Array = NDArray[np.float64]

_SEED = 0  # what is shown does not change while nothing does
_ROUNDS = 60  # of damped least squares while the tip is pulled
_REACHED, _TURNED = 1e-3, math.radians(0.5)  # so near the tip is where it was pulled to


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reachable:
    """Whether a goal can be reached.

    Attributes:
        tone: "good": a configuration reaches it, with the clearance asked for; "near": with less; "bad": none, or only ones in
            collision; "plain": it is not known.
        message: in a sentence.
        q: (n,) a configuration that reaches it, or comes nearest [rad or m]; None: there is none to show.
    """

    tone: Tone
    message: str
    q: Array | None


def reachable(problem: Problem, settings: PlannerSettings) -> Reachable:
    """Look for configurations that reach a problem's goal, as planning does; and at the start.

    Where the base floats, a goal in space is looked at with the base as it begins, which the message says.
    """
    lacking = lacks_envelope(problem.robot)
    if lacking:
        return Reachable(tone="bad", message=lacking, q=None)
    try:
        return _looked_for(problem.local, settings)
    except SpacearmError as error:
        return Reachable(tone="bad", message=str(error), q=None)


def _looked_for(problem: Problem, settings: PlannerSettings) -> Reachable:
    goal, floats = problem.goal, problem.base_model.follows_arm
    in_space = isinstance(goal, (PositionGoal, PoseGoal))
    ends = check_ends(problem)
    if ends.status == "goal_in_collision":
        return Reachable(tone="bad", message=ends.message, q=ends.q)
    found = find_goal_configurations(problem, settings, _SEED)
    if not len(found.q):
        report = explain_goal(problem, found)
        return Reachable(tone="bad", message=report.message or "the goal is out of reach", q=found.closest)
    as_it_begins = "; the base floats, so where the arm ends follows from the whole motion: this is with the base as it begins"
    reaches = not in_space or found.searches == 0 or _is_reached(problem, found.q[0])
    if not reaches:
        return Reachable(
            tone="near",
            message=f"no configuration reaches the goal with the base as it begins; it may in motion{as_it_begins}",
            q=found.q[0],
        )
    clear, asked = float(found.clearance[0]), problem.clearance
    if clear <= 0:  # of a floating base: planning begins there all the same
        return Reachable(tone="near", message=f"only configurations in collision reach it{as_it_begins}", q=found.q[0])
    count = len(found.q)
    said = f"{count} configuration{'s reach' if count > 1 else ' reaches'} it" if in_space else "the configuration is free"
    said += f", {clear * 1e3:.4g} mm clear" if np.isfinite(clear) else ""
    near = clear < asked
    said += f" ({asked * 1e3:.4g} mm are asked for)" if near else ""
    return Reachable(
        tone="near" if near else "good", message=said + (as_it_begins if floats and in_space else ""), q=found.q[0]
    )


def _is_reached(problem: Problem, q: Array) -> bool:
    goal = problem.goal
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        return True
    distance, angle = goal_errors(Reach(robot=problem.robot, goal=goal), q[None])
    near, turned = goal.tolerances
    return bool(distance[0] <= near and angle[0] <= turned)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pulled:
    """An arm that was pulled by a frame of it.

    Attributes:
        q: (n,) the configuration, within the limits [rad or m].
        reached: whether the frame is where it was pulled to.
        limits: names of the joints that are at a limit.
    """

    q: Array
    reached: bool
    limits: tuple[str, ...]


def pulled(problem: Problem, q: Array, position: Array, wxyz: Array, *, turned: bool) -> Pulled:
    """Return where the joints go if the tip is pulled, from a configuration, without regard to obstacles.

    Args:
        problem: robot and where its base begins.
        q: (n,) where the joints are [rad or m].
        position: (3,) where the tip is to be, inertial frame [m].
        wxyz: (4,) its orientation.
        turned: whether the orientation counts.
    """
    robot = problem.robot
    T_b_w = np.linalg.inv(problem.base_start)
    T = product(T_b_w, pose(position, wxyz))
    T[3], T[:3, :3] = (0.0, 0.0, 0.0, 1.0), _rotation(T[:3, :3])
    goal = PoseGoal(T, frame=robot.tip) if turned else PositionGoal(T[:3, 3], frame=robot.tip)
    reach = Reach(robot=robot, goal=goal)
    found = polished(reach, q[None], robot.lower, robot.upper, rounds=_ROUNDS)
    distance, angle = goal_errors(reach, found)
    at = [
        name
        for name, value, low, high in zip(robot.dof_names, found[0], robot.lower, robot.upper, strict=True)
        if value <= low or value >= high
    ]
    return Pulled(q=found[0], reached=bool(distance[0] <= _REACHED and angle[0] <= _TURNED), limits=tuple(at))


def _rotation(R: Array) -> Array:
    """Return the rotation nearest to a matrix (3, 3) that rounding has made none."""
    U, _, V = np.linalg.svd(R)
    return U @ np.diag([1.0, 1.0, float(np.sign(np.linalg.det(U @ V)))]) @ V
