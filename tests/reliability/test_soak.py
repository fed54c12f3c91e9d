"""A share of benchmarks/soak.py: drawn problems are planned and others look at the motions; what is wrong can be seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spacearm.core.errors import SpacearmError
from spacearm.geometry import Scene, Sphere
from spacearm.planner import Plan, PlannerSettings, Problem, plan
from spacearm.planner.goals import ConfigurationGoal
from spacearm.proof import certify
from spacearm.robot import Robot, load_robot
from support import drawn_trajectories
from support.drawn_bodies import drawn_body_problem
from support.drawn_problems import drawn_problem
from support.plan_checker import complaints


@pytest.mark.parametrize("block", range(4))
def test_a_drawn_problem_gives_a_motion_that_others_confirm_or_a_reason(block: int) -> None:
    for number in range(8 * block, 8 * block + 8):
        problem, settings = drawn_problem(1, number)
        wrong = complaints(plan(problem, settings, rng=number), instants=60, rng=np.random.default_rng(number))
        assert not wrong, (number, wrong)


@pytest.mark.parametrize("block", range(3))
def test_a_problem_with_every_shape_gives_a_motion_that_others_confirm_or_a_reason(block: int) -> None:
    """With benchmarks/soak.py --shapes there are more of them."""
    for number in range(5 * block, 5 * block + 5):
        problem, settings = drawn_body_problem(3, number)
        wrong = complaints(plan(problem, settings, rng=number), instants=100, rng=np.random.default_rng(number))
        assert not wrong, (number, wrong)


def test_the_checker_sees_where_a_floating_base_is() -> None:
    """A promise that is too large is found out where the base has drifted to, and there only."""
    for number in range(40):
        problem, settings = drawn_body_problem(3, number)
        if problem.base == "fixed" or not problem.scene.obstacles:
            continue
        out = plan(problem, settings, rng=number)
        near = None if out.certificate is None else out.certificate.closest
        if not out.found or near is None or near.obstacle is None or out.certificate is None:
            continue
        assert complaints(out, instants=50, rng=np.random.default_rng(0)) == []
        more = replace(out.certificate, clearance=near.clearance + 1e-4)
        assert any(near.link in sentence for sentence in said(replace(out, certificate=more)))
        return
    pytest.fail("no motion of a floating base was found")


def test_a_drawn_problem_is_the_same_again() -> None:
    one, other = drawn_problem(1, 5), drawn_problem(1, 5)
    assert one.settings == other.settings
    assert np.array_equal(one.problem.start, other.problem.start)
    assert len(one.problem.scene.obstacles) == len(other.problem.scene.obstacles)


@pytest.mark.parametrize("block", range(4))
def test_what_holds_of_a_drawn_trajectory_is_so(block: int) -> None:
    """A share of benchmarks/soak_trajectories.py."""
    held = 0
    for number in range(12 * block, 12 * block + 12):
        try:
            case = drawn_trajectories.drawn_case(7, number)
        except SpacearmError:
            continue
        certificate = certify(case, case.trajectory, limits=("position", "velocity"))
        wrong = drawn_trajectories.complaints(case, certificate, np.random.default_rng(number))
        assert not wrong, (number, case.kind, wrong)
        held += certificate.holds
    assert held


def test_the_checker_of_trajectories_sees_what_is_not_so() -> None:
    rng = np.random.default_rng(0)
    for number in range(40):
        try:
            case = drawn_trajectories.drawn_case(7, number)
        except SpacearmError:
            continue
        certificate = certify(case, case.trajectory, limits=("position", "velocity"))
        if not certificate.holds or certificate.closest is None or case.base != "fixed":
            continue
        assert certificate.clearance is not None
        more = replace(certificate, clearance=certificate.closest.clearance + 1e-3)
        assert any(sentence.startswith("proven") for sentence in drawn_trajectories.complaints(case, more, rng))
        slow = case._replace(robot=replace(case.robot, velocity=case.robot.velocity * 1e-3))
        assert any("times its limit" in sentence for sentence in drawn_trajectories.complaints(slow, certificate, rng))
        return
    pytest.fail("nothing was proven")


@pytest.fixture(scope="module")
def found() -> Plan:
    problem = Problem(
        load_robot("zhang2022"),
        Scene([Sphere((0.5, 0.5, 0.0), 0.1)]),
        start=np.zeros(7),
        goal=ConfigurationGoal([-1.0, 0, 0, -0.5, 0, 0, 0]),
    )
    out = plan(problem, PlannerSettings(evaluations=300), rng=0)
    assert out.found
    return out


def said(found: Plan) -> list[str]:
    return complaints(found, instants=300, rng=np.random.default_rng(0))


def test_the_checker_is_content_with_a_plan_as_it_is(found: Plan) -> None:
    assert said(found) == []


def test_the_checker_sees_a_certificate_that_promises_too_much(found: Plan) -> None:
    certificate = found.certificate
    assert certificate is not None
    assert certificate.closest is not None
    more = certificate.closest.clearance + 1e-4
    (sentence,) = said(replace(found, certificate=replace(certificate, clearance=more)))
    assert " m stated, " in sentence


def test_the_checker_sees_a_limit_that_is_broken(found: Plan) -> None:
    slow = with_robot(found, replace(found.problem.robot, velocity=0.5 * found.problem.robot.velocity))
    assert any("velocity limit" in sentence for sentence in said(slow))
    lazy = with_robot(found, replace(found.problem.robot, acceleration=0.5 * found.problem.robot.acceleration))
    assert any("acceleration limit" in sentence for sentence in said(lazy))
    jerky = replace(found, settings=replace(found.settings, jerk_limit=1e-3))
    assert any("jerk limit" in sentence for sentence in said(jerky))


def with_robot(found: Plan, robot: Robot) -> Plan:
    return replace(found, problem=replace(found.problem, robot=robot))


def test_the_checker_sees_other_ends(found: Plan) -> None:
    elsewhere = replace(found.problem, goal=ConfigurationGoal([-1.0, 0, 0, -0.4, 0, 0, 0]))
    assert any("beyond the goal" in sentence for sentence in said(replace(found, problem=elsewhere)))
    moved = replace(found.problem, start=np.full(7, 0.01))
    assert any("does not begin" in sentence for sentence in said(replace(found, problem=moved)))


def test_the_checker_sees_a_refusal_without_reason(found: Plan) -> None:
    assert any("Coal" in sentence for sentence in said(replace(found, status="start_in_collision")))
    hit = replace(found.problem, scene=Scene([Sphere((0, 0.5, 0), 0.1)]))
    assert any("penetrates" in sentence for sentence in said(replace(found, problem=hit)))


def test_the_checker_sees_a_message_of_two_lines(found: Plan) -> None:
    assert any("no line" in sentence for sentence in said(replace(found, status="not_found", advice="a\nb")))
