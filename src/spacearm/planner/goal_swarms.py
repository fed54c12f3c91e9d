"""Swarms in configuration space that look for configurations near a goal: the formulation of the paper, run by the kernel.

The kernel computes in float32 here; what the swarms find is brought onto the goal and checked in float64.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import product, sines
from spacearm.core.native import native
from spacearm.geometry import Scene
from spacearm.planner.goals import PositionGoal, SpaceGoal
from spacearm.planner.kernel_model import make_kernel_model
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.robot.model import Robot
from spacearm.swarm import PSO, run_trials

Array = NDArray[np.float64]

_ANYWHERE = 1e6  # [m] tolerance of a frame that may be anywhere: no robot reaches so far
_LEVER = 0.25  # [m] from the frame's origin to the points on its axes that are watched; about the size of a hand


@dataclass(frozen=True, slots=True, kw_only=True)
class Slack:
    """How near to the goal a swarm must come, where that is more than the goal's own tolerance.

    Attributes:
        distance: [m].
        angle: [rad].
    """

    distance: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalSwarms:
    """What all swarms of one search for goal configurations have in common.

    Attributes:
        robot: with n joints.
        scene: to be kept clear of, seen from the base.
        searched: the clearances asked for.
        seed: random seed of all.
        threads: that they are spread over; None for one a core. The result does not depend on it.
        late: whether time is up; then only those swarms that have begun give something.
    """

    robot: Robot
    scene: Scene
    searched: SearchedClearance
    seed: int
    threads: int | None
    late: Callable[[], bool]

    def run(
        self,
        goal: SpaceGoal | None,
        *,
        lower: Array,
        upper: Array,
        home: Array,
        particles: int,
        iterations: int,
        first: int,
        count: int,
        slack: Slack | None = None,
    ) -> Array:
        """Run independent swarms, each of which ends with a configuration that is free and near the goal, or nearly so.

        Args:
            goal: where a frame is to be; a swarm ends as soon as it is near enough. None: anywhere; the swarms spend their
                whole budget to come near home.
            lower: (n,) bounds [rad or m].
            upper: (n,) likewise.
            home: (n,) the configuration to stay near [rad or m].
            particles: of each swarm.
            iterations: of each swarm, at most.
            first: number of the first swarm: each has a random sequence of its own.
            count: how many.
            slack: how near to the goal is near enough; None: its tolerance.

        Returns:
            (count, n), fewer if time was up: configurations within the bounds, one a swarm; which are free and near enough
            is not said.
        """
        points, targets, tolerances = _watched_points(self.robot, goal, slack or Slack())
        model = make_kernel_model(self.robot, self.scene, points=points, pair_margins=self.searched.kernel_pairs)
        objective = native.ReachObjective32(
            scene=model.model32,
            points=np.array(model.points, dtype=np.int32),
            targets=np.array(targets, dtype=np.float64).reshape(-1, 3),
            tolerances=np.array(tolerances, dtype=np.float64),
            margin=self.searched.asked,
            home=np.array(home, dtype=np.float64),
        )
        runs = run_trials(
            objective,
            lower,
            upper,
            _constricted(particles, iterations),
            seed=self.seed,
            first_trial=first,
            trials=count,
            threads=self.threads,
            stop_when_feasible=goal is not None,
            progress=lambda _: not self.late(),
        )
        x = np.array([run.x for run in runs]).reshape(-1, self.robot.dof)
        return np.clip(x, lower, upper)  # float32 may have rounded a bound outwards


def _constricted(particles: int, iterations: int) -> PSO:
    """Return a swarm on a ring with the coefficients of Clerc and Kennedy (2002), which converge on their own."""
    return PSO(particles=particles, iterations=iterations, inertia=0.7298, cognitive=1.49618, social=1.49618, neighbours=3)


def _watched_points(
    robot: Robot, goal: SpaceGoal | None, slack: Slack
) -> tuple[list[tuple[int, Array]], list[Array], list[float]]:
    """Return points of the goal's frame, where they are to be, and how near: a pose is three points, a direction two.

    Near a pose the distances of points with a lever say the same as its distance and angle. They leave out the corner of
    a wide tolerance where the origin is far off and the orientation exact.
    """
    frame = robot.frame(robot.tip if goal is None else goal.frame or robot.tip)
    points: list[tuple[int, Array]] = [(frame.joint, frame.T_joint_frame[:3, 3])]
    if goal is None:
        return points, [np.zeros(3)], [_ANYWHERE]
    if isinstance(goal, PositionGoal):
        return points, [goal.position], [max(goal.tolerance, slack.distance)]
    distance = max(goal.position_tolerance, slack.distance)
    angle = max(goal.orientation_tolerance, slack.angle)
    targets, tolerances = [goal.position], [distance]
    if angle < np.pi:
        axes = np.eye(3)[:2] if goal.free_axis is None else goal.free_axis[None]
        for axis in axes:
            local = np.append(_LEVER * axis, 1.0)
            points.append((frame.joint, product(frame.T_joint_frame, local)[:3]))
            targets.append(product(goal.pose, local)[:3])
            # A turn by the angle moves two ends across each other by the lever times its chord, over both together.
            tolerances.append(max(2 * _LEVER * float(sines(angle / 2)[0]) / float(np.sqrt(len(axes))), distance))
    return points, targets, tolerances
