"""A swarm of motions by ask and tell, with a base that floats."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import ProblemError
from spacearm.geometry import Box, Sphere, pose
from spacearm.motion import Trajectory
from spacearm.planner import BaseLimits, MotionSwarm, PlannerSettings, PoseGoal, PositionGoal, Problem, report_base
from spacearm.proof import certify
from spacearm.robot import load_robot
from spacearm.swarm import PSO
from support.dense_samples import planar
from support.messages import assert_refused

CRAFT = load_robot("srs7")
HOME = CRAFT.configuration("home")
END = HOME + np.array((1.0, 0.4, 0, -0.37, 0, 0.3, 0))
SETTINGS = PlannerSettings(swarm=PSO(particles=16, iterations=40, neighbours=3))


def adrift(goal: Any = END, **asked: Any) -> Problem:
    return Problem(CRAFT, [Sphere((0.4, 0.4, 0.7), 0.05)], start=HOME, goal=goal, base_start=pose((0, 0, 0.02)), **asked)


def searched(swarm: MotionSwarm) -> Trajectory:
    while not swarm.done:
        motions = swarm.ask()
        judged = swarm.judge(motions)
        swarm.tell(judged.fitness, judged.violation)
    problem = swarm.problem
    return Trajectory(CRAFT, swarm.best, base=problem.base, base_start=problem.base_start)


@pytest.mark.parametrize("limits", [None, BaseLimits(peak=0.35)])
def test_a_goal_in_joint_space_is_reached_while_the_base_floats(limits: BaseLimits | None) -> None:
    problem = adrift(base_limits=limits)
    trajectory = searched(MotionSwarm(problem, SETTINGS, rng=0))
    np.testing.assert_array_equal(trajectory.motion.control_points[-1], END)
    certificate = certify(problem, trajectory)
    assert certificate.holds, certificate.message
    assert report_base(problem, trajectory).missed == ()


@pytest.mark.parametrize("seed", range(3))
def test_what_slips_through_between_the_coarse_instants_is_violating(seed: int) -> None:
    """A thin sheet stands where the straight motion passes between two of the 32 instants."""
    robot = planar(capsules=tuple(replace(link, radius=0.02) for link in planar().capsules))
    sheet = Box((1.2, 0.05, 0.5), pose((1.3, 0.0, 0.0)))
    problem = Problem(robot, [sheet], start=[-0.6, 0.0], goal=[0.7, 0.1])
    swarm = MotionSwarm(problem, SETTINGS, rng=seed)
    while not swarm.done:
        judged = swarm.judge(swarm.ask())
        assert ((judged.violation == 0) == judged.free).all()
        swarm.tell(judged.fitness, judged.violation)
    best = swarm.judge(swarm.best.control_points[None])
    assert best.free[0] == certify(problem, Trajectory(robot, swarm.best)).holds


def test_with_a_configuration_given_that_is_the_goal() -> None:
    problem = adrift(PositionGoal((0.3, 0.5, 0.6)))
    trajectory = searched(MotionSwarm(problem, SETTINGS, goal=END, rng=0))
    same = searched(MotionSwarm(adrift(), SETTINGS, rng=0))
    assert trajectory.motion == same.motion


@pytest.mark.parametrize("goal", [PositionGoal((0.3, 0.5, 0.6)), PoseGoal(pose((0.3, 0.5, 0.6)))])
def test_a_goal_in_space_is_left_to_the_planner(goal: Any) -> None:
    case = f"motion swarm, {type(goal).__name__}"
    assert_refused("problem_base", case, ProblemError, lambda: MotionSwarm(adrift(goal), SETTINGS))
