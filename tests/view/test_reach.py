"""Whether the goal can be reached, in words and as a configuration; and an arm that is pulled by its tip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import spacearm as sa
from house.source import REPOSITORY
from spacearm.core.rotations import quaternion_of
from spacearm.files import load_problem_file
from spacearm.view.reach import pulled, reachable

FIRST = load_problem_file(REPOSITORY / "examples" / "01_first_plan.yaml")
FLOATING = load_problem_file(REPOSITORY / "examples" / "05_floating_servicer.yaml")


def test_a_goal_within_reach_has_a_ghost_that_reaches_it() -> None:
    found = reachable(FIRST.problem, FIRST.settings)
    assert found.tone == "good"
    assert "configurations reach it" in found.message
    assert found.q is not None
    tip = sa.forward_kinematics(FIRST.problem.robot, found.q)
    np.testing.assert_allclose(tip[:3, 3], FIRST.problem.goal.position, atol=1e-3)


def test_a_goal_out_of_reach_says_so_and_shows_the_nearest() -> None:
    problem = replace(FIRST.problem, goal=sa.PositionGoal((30.0, 0.0, 0.0)))
    found = reachable(problem, FIRST.settings)
    assert found.tone == "bad"
    assert "comes no nearer to the goal than 28.66 m" in found.message
    assert found.q is not None


def test_a_goal_inside_an_obstacle_is_bad() -> None:
    problem = replace(FIRST.problem, scene=sa.Scene([sa.Sphere((0.7, 0.3, 0.0), 0.2, name="ball")]))
    found = reachable(problem, FIRST.settings)
    assert found.tone == "bad"
    assert "ball" in found.message


def test_a_goal_with_less_than_is_asked_for_is_near() -> None:
    q = np.zeros(7)
    scene = [sa.Sphere((0.115, 0.5, 0), 0.1, name="ball")]
    problem = sa.Problem(sa.load_robot("zhang2022"), scene, start=[0.5] + [0] * 6, goal=q, clearance=0.03)
    found = reachable(problem, sa.PlannerSettings())
    assert found.tone == "near"
    assert "15 mm clear (30 mm are asked for)" in found.message


def test_a_floating_base_is_told() -> None:
    found = reachable(FLOATING.problem, FLOATING.settings)
    assert found.tone == "good"
    assert "the base floats" in found.message


def test_a_floating_arm_that_reaches_the_goal_in_collision_only_is_told() -> None:
    at = FLOATING.problem.goal.position
    problem = replace(FLOATING.problem, scene=sa.Scene([sa.Sphere(at, 0.4, name="ball")]))
    found = reachable(problem, FLOATING.settings)
    assert found.tone in ("near", "bad")
    assert "collision" in found.message or "ball" in found.message or "no configuration" in found.message


@pytest.mark.parametrize("file", [FIRST, FLOATING], ids=["fixed", "floating"])
def test_an_arm_that_is_pulled_a_little_follows(file: object) -> None:
    problem = file.problem  # type: ignore[attr-defined]
    q = np.clip(problem.start + 0.3, problem.robot.lower, problem.robot.upper)
    T = problem.base_start @ sa.forward_kinematics(problem.robot, q)
    found = pulled(problem, q, T[:3, 3] + [0, 0, 0.01], quaternion_of(T[:3, :3]), turned=True)
    assert found.reached
    U = problem.base_start @ sa.forward_kinematics(problem.robot, found.q)
    np.testing.assert_allclose(U[:3, 3], T[:3, 3] + [0, 0, 0.01], atol=1e-3)
    assert np.abs(found.q - q).max() < 0.5


def test_an_arm_that_is_pulled_too_far_stays_within_its_limits() -> None:
    problem = FIRST.problem
    found = pulled(problem, problem.start, np.array([50.0, 0, 0]), np.array([1.0, 0, 0, 0]), turned=False)
    assert not found.reached
    assert (found.q >= problem.robot.lower).all()
    assert (found.q <= problem.robot.upper).all()
