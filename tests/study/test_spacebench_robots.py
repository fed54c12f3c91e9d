"""The robots of SpaceBench: masses, lengths and envelopes against hand calculations and the robots they are made of."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from house.source import REPOSITORY
from spacearm.dynamics import center_of_mass, system_mass
from spacearm.geometry import Box, Cylinder, Polytope, Sphere, pose, support
from spacearm.motion import Motion, Trajectory
from spacearm.planner import PositionGoal, report_base
from spacearm.proof import certify
from spacearm.robot import LinkShape, forward_kinematics, joint_frames, load_robot
from spacearm.study import spacebench_robots
from spacearm.study.paper_problem import GOAL_POSITION, OBSTACLE_CENTERS
from spacearm.study.spacebench import PUBLISHED_ROTATION, papers_problem, servicer_problem
from spacearm.study.spacebench_robots import light, scaled_srs7, two_arms


def test_a_lighter_base_keeps_its_radii_of_gyration() -> None:
    own, lighter = load_robot("servicer7"), light("servicer7", 500)
    assert system_mass(lighter) == pytest.approx(system_mass(own) - 1474.1 + 500)
    (body,) = (body for body in lighter.bodies if body.joint < 0)
    np.testing.assert_allclose(np.diag(body.inertia) / 500, np.array([17388.34, 1340.43, 17981.26]) / 1474.1)
    assert lighter.bodies[1:] == own.bodies[1:]


def test_the_scaled_arm_has_the_length_of_the_papers_and_its_links_are_longer_cylinders() -> None:
    own, longer = load_robot("srs7"), scaled_srs7()
    np.testing.assert_allclose(forward_kinematics(longer, np.zeros(7))[:3, 3], (0, 0, 1.336), atol=1e-12)
    assert system_mass(longer) == pytest.approx(system_mass(own))
    scale = 1.336 / 1.178
    lengths = {"link_1": 0.31, "link_3": 0.4, "link_5": 0.39}
    for body in longer.bodies:
        if body.name in lengths:  # a solid cylinder: m (3 r^2 + l^2) / 12 across, m r^2 / 2 about its axis
            across = body.mass * (3 * 0.04**2 + (scale * lengths[body.name]) ** 2) / 12
            np.testing.assert_allclose(
                np.sort(np.linalg.eigvalsh(body.inertia)), [body.mass * 0.04**2 / 2, across, across], rtol=1e-6
            )
    q = np.random.default_rng(0).uniform(own.lower, own.upper)
    np.testing.assert_allclose(
        forward_kinematics(longer, q)[:3, 3], scale * forward_kinematics(own, q)[:3, 3], rtol=0, atol=1e-12
    )


def test_two_arms_are_two_of_the_one() -> None:
    one, both = load_robot("srs7"), two_arms(150)
    rng = np.random.default_rng(1)
    left, right = rng.uniform(one.lower, one.upper, (2, 7))
    q = np.concatenate([left, right])
    frames = joint_frames(both, q)
    for arm, side, x in ((left, "left", -0.45), (right, "right", 0.45)):
        expected = forward_kinematics(one, arm)
        expected[0, 3] += x
        frame = both.frame(f"{side}_tip")
        np.testing.assert_allclose(frames[frame.joint] @ frame.T_joint_frame, expected, atol=1e-12)
    links = system_mass(one) - 100
    assert system_mass(both) == pytest.approx(150 + 2 * links)
    moved = [center_of_mass(one, arm) * (100 + links) for arm in (left, right)]  # the base's own is at its origin
    np.testing.assert_allclose(center_of_mass(both, q), sum(moved) / (150 + 2 * links), atol=1e-12)
    assert ("left_link_5", "right_link_5") in both.self_pairs
    assert ("base", "right_link_7") in both.self_pairs


def test_links_of_every_shape_grow_with_the_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    own, scale = load_robot("srs7", base="floating"), 1.336 / 1.178
    turned = pose((0.01, 0.02, 0.2), (0.8, 0.6, 0, 0))
    corners = np.random.default_rng(2).normal(0, 0.05, (8, 3))
    shapes = (
        Sphere((0, 0, 0.2), 0.05),
        Box((0.1, 0.06, 0.3), turned),
        Cylinder(0.05, 0.3, turned),
        Polytope(corners, rounding=0.01),
    )
    robot = replace(own, self_pairs=(), shapes=tuple(LinkShape(name="link_3", joint=2, shape=shape) for shape in shapes))
    monkeypatch.setattr(spacebench_robots, "load_robot", lambda *_, **__: robot)
    ball, box, cylinder, polytope = (part.shape for part in scaled_srs7.__wrapped__().shapes)
    for axis in np.random.default_rng(3).normal(size=(20, 3)):
        assert support(box, axis) == pytest.approx(scale * support(shapes[1], axis))
        rounding = 0.01 * float(np.linalg.norm(axis))
        assert support(polytope, axis) - rounding == pytest.approx(scale * float((corners @ axis).max()))
    assert isinstance(ball, Sphere)
    assert ball.radius == 0.05
    np.testing.assert_allclose(ball.center, (0, 0, 0.2 * scale))
    assert isinstance(cylinder, Cylinder)
    assert (cylinder.radius, cylinder.length) == pytest.approx((0.05, 0.3 * scale))
    np.testing.assert_allclose(cylinder.pose[:3, 3], scale * turned[:3, 3])


def test_the_two_armed_spacecraft_is_a_box_as_large_as_its_inertia_says() -> None:
    robot = two_arms(120)
    (bus,) = (part.shape for part in robot.shapes if part.joint < 0)
    assert isinstance(bus, Box)
    (body,) = (body for body in robot.bodies if body.joint < 0)
    x, y, z = bus.size**2
    np.testing.assert_allclose(np.diag(body.inertia), 120 / 12 * np.array([y + z, x + z, x + y]))


def test_the_papers_problem_has_the_papers_scene_and_start() -> None:
    problem = papers_problem()
    assert [(sphere.center.tolist(), sphere.radius) for sphere in problem.scene.obstacles if isinstance(sphere, Sphere)] == [
        (list(center), 0.1) for center in OBSTACLE_CENTERS
    ]
    assert isinstance(problem.goal, PositionGoal)
    assert tuple(problem.goal.position) == GOAL_POSITION
    tip = (problem.base_start @ forward_kinematics(problem.robot, problem.start))[:3, 3]
    np.testing.assert_allclose(tip, (0, 1.336, 0), atol=0.06)  # stretched but for its elbow's 0.1 rad


def test_the_servicers_base_can_be_kept_within_a_third_of_a_degree() -> None:
    problem = servicer_problem(restore=False)
    stored = json.loads((REPOSITORY / "benchmarks" / "servicer_least_peak.json").read_text())
    motion = Motion(stored["control_points"])
    trajectory = Trajectory(problem.robot, motion, base="floating", base_start=problem.base_start)
    assert certify(problem, trajectory).holds
    report = report_base(problem, trajectory)
    assert not report.missed
    assert report.peak < np.radians(0.28) < PUBLISHED_ROTATION


def test_the_servicers_problem_begins_where_it_was_published() -> None:
    problem = servicer_problem()
    tip = (problem.base_start @ forward_kinematics(problem.robot, problem.start))[:3, 3]
    np.testing.assert_allclose(tip, (-0.381849443981743, 0.568500546238447, 1.157380648460746), atol=1e-9)
