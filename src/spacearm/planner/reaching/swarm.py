"""The swarm in configuration space that looks for configurations which reach a goal: the seed's own formulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import product, sines
from spacearm.planner.goals import PositionGoal
from spacearm.planner.kernel_model import make_kernel_model, native_class
from spacearm.planner.problem import Problem
from spacearm.planner.reaching.onto_goal import SpaceGoal
from spacearm.swarm import PSO, run_trials

Array = NDArray[np.float64]

_PRECISION = 32  # of the search; what it finds is brought onto the goal and checked in float64
_ANYWHERE = 1e6  # [m]
_LEVER = 0.25  # [m] how far from the frame's origin its axes are watched


@dataclass(frozen=True, slots=True, kw_only=True)
class Slack:
    """How near to the goal a swarm must come, where that is more than the goal's own tolerance.

    Attributes:
        distance: [m].
        angle: [rad].
    """

    distance: float
    angle: float


def swarm_configurations(
    problem: Problem,
    goal: SpaceGoal | None,
    bounds: tuple[Array, Array],
    swarm: PSO,
    *,
    home: Array,
    margin: float,
    slack: Slack | None = None,
    seed: int,
    first: int,
    count: int,
    threads: int | None,
    nearest: bool = False,
    late: Callable[[], bool] = lambda: False,
) -> Array:
    """Run independent swarms, each of which ends with a configuration that is free and near the goal, or nearly so.

    Args:
        problem: robot and scene; its own goal is not looked at.
        goal: where the frame is to be; None: anywhere.
        bounds: (n,) lower and upper [rad or m].
        swarm: settings of each.
        home: (n,) the configuration to stay near [rad or m].
        margin: clearance asked for [m].
        slack: how near to the goal is near enough; None: its tolerance.
        seed: of all.
        first: number of the first swarm.
        count: how many.
        threads: None for one a core; the result does not depend on it.
        nearest: spend the whole budget to come near home, rather than end as soon as there is something.
        late: whether time is up; then only those swarms that have begun give something.

    Returns:
        (count, n), fewer if time was up: configurations within the bounds, one a swarm; which are free and near enough is
        not said.
    """
    points, targets, tolerances = _watched(problem, goal, slack or Slack(distance=0.0, angle=0.0))
    model = make_kernel_model(problem.robot, problem.scene, precision=_PRECISION, points=points)
    objective = native_class("ReachObjective", _PRECISION)(
        model.native,
        np.array(model.points, dtype=np.int32),
        np.array(targets, dtype=np.float64).reshape(-1, 3),
        np.array(tolerances, dtype=np.float64),
        margin,
        np.array(home),
    )
    runs = run_trials(
        objective,
        *bounds,
        swarm,
        seed=seed,
        first_trial=first,
        trials=count,
        threads=threads,
        stop_when_feasible=not nearest,
        progress=lambda _: not late(),
    )
    x = np.array([run.x for run in runs]).reshape(-1, problem.robot.dof)
    return np.clip(x, *bounds)  # float32 may have rounded a bound outwards


def _watched(
    problem: Problem, goal: SpaceGoal | None, slack: Slack
) -> tuple[list[tuple[int, Array]], list[Array], list[float]]:
    """Return points of the goal's frame, where they are to be, and how near: a pose is three points, a direction two.

    Near a pose the distances of points with a lever say the same as its distance and angle. They leave out the corner of
    a wide tolerance where the origin is far off and the orientation exact.
    """
    frame = problem.robot.frame(problem.robot.tip if goal is None else goal.frame or problem.robot.tip)
    if goal is None:
        return [(frame.joint, frame.T_joint_frame[:3, 3])], [np.zeros(3)], [_ANYWHERE]
    if isinstance(goal, PositionGoal):
        return [(frame.joint, frame.T_joint_frame[:3, 3])], [goal.position], [max(goal.tolerance, slack.distance)]
    distance = max(goal.position_tolerance, slack.distance)
    angle = max(goal.orientation_tolerance, slack.angle)
    points = [(frame.joint, frame.T_joint_frame[:3, 3])]
    targets, tolerances = [goal.position], [distance]
    if angle < np.pi:
        axes = np.eye(3)[:2] if goal.free_axis is None else goal.free_axis[None]
        for axis in axes:
            local = np.append(_LEVER * axis, 1.0)
            points.append((frame.joint, product(frame.T_joint_frame, local)[:3]))
            targets.append(product(goal.pose, local)[:3])
            # A turn by the angle moves two ends across each other by the lever times its chord, over both together.
            tolerances.append(max(2 * _LEVER * float(sines(angle / 2)[0]) / np.sqrt(len(axes)), distance))
    return points, targets, tolerances
