"""Planning while the base tilts: what is asked for is there, by trajectories integrated in float64 apart from the search."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from spacearm.core.rotations import angle, conjugate, matrix_of, multiplied
from spacearm.dynamics.momentum import moving
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Scene, Sphere, SphereSet, pose
from spacearm.planner import AttitudeGoal, BaseLimits, PlannerSettings, PoseGoal, PositionGoal, Problem, Weights, plan
from spacearm.robot import Robot, load_robot

SRS7 = load_robot("srs7")
START, GOAL = (0, 0, 0, 0.5, 0, 0, 0), (1.5, 0.3, 0.3, 1.7, 0.2, 0.3, 0)
OBSTACLES = [Sphere((0.9, -0.5, 0.9), 0.2), Box((0.1, 0.1, 1.0), (0.7, 0.6, 0.6), name="post")]
QUICK = PlannerSettings(evaluations=3000)


def servicer_pose() -> np.ndarray:
    """ORACLES B1: 1.5, -1.4, 2.2 m, roll -30, pitch -50, yaw 45 degrees."""
    r, p, y = np.radians([-30, -50, 45])
    x = np.array([[1, 0, 0], [0, np.cos(r), -np.sin(r)], [0, np.sin(r), np.cos(r)]])
    y_ = np.array([[np.cos(p), 0, np.sin(p)], [0, 1, 0], [-np.sin(p), 0, np.cos(p)]])
    z = np.array([[np.cos(y), -np.sin(y), 0], [np.sin(y), np.cos(y), 0], [0, 0, 1]])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = z @ y_ @ x, (1.5, -1.4, 2.2)
    return T


@pytest.fixture(scope="module")
def servicer() -> Robot:
    return load_robot("servicer7")


@pytest.mark.parametrize("seed", range(4))
def test_the_servicer_reaches_its_pose_and_leaves_its_base_as_it_was(servicer: Robot, seed: int) -> None:
    start, wanted = np.clip(np.zeros(7), servicer.lower, servicer.upper), servicer_pose()
    problem = Problem(
        servicer,
        [],
        start=start,
        goal=PoseGoal(wanted, position_tolerance=1e-3, orientation_tolerance=np.radians(0.1)),
        base_start=sa.base_at_mass_center(servicer, start),
        base_goal=AttitudeGoal((1, 0, 0, 0), np.radians(0.05)),
    )
    found = plan(problem, PlannerSettings(evaluations=20_000, stop_at_first=True), rng=seed)
    assert found.found, found.message
    assert found.trajectory is not None
    assert found.certificate is not None
    assert found.certificate.base == "floating"
    T = found.trajectory.tip(found.trajectory.duration)
    attitude = found.trajectory.base_pose(found.trajectory.duration)[1]
    off = np.arccos(np.clip((np.trace(T[:3, :3].T @ wanted[:3, :3]) - 1) / 2, -1, 1))
    assert np.linalg.norm(T[:3, 3] - wanted[:3, 3]) < 1e-6
    assert np.degrees(off) < 1e-3
    assert np.degrees(angle(attitude)) < 1e-3


def test_a_motion_on_a_floating_base_ends_in_its_joints_goal() -> None:
    problem = Problem(SRS7, OBSTACLES, start=START, goal=GOAL)
    assert problem.floats
    found = plan(problem, QUICK, rng=0)
    assert found.found, found.message
    assert found.trajectory is not None
    np.testing.assert_allclose(found.trajectory.sample(found.trajectory.duration).q, GOAL, atol=1e-12)
    assert found.base is not None
    assert found.base.final > np.radians(3)  # a light spacecraft


@pytest.mark.parametrize("limit", ["final", "peak"])
def test_limits_of_angles_are_kept(limit: str) -> None:
    free = plan(Problem(SRS7, [], start=START, goal=GOAL), QUICK, rng=0).base
    assert free is not None
    most = 0.6 * getattr(free, limit)
    found = plan(
        Problem(SRS7, [], start=START, goal=GOAL, base_limits=BaseLimits(**{limit: most})),
        PlannerSettings(evaluations=12_000),
        rng=0,
    )
    assert found.found, found.message
    assert found.base is not None
    assert getattr(found.base, limit) <= most
    assert getattr(found.base, limit) > 0.3 * most  # a limit, no target


@pytest.mark.parametrize("limit", ["rate", "joint_momentum"])
def test_limits_of_rates_are_kept_by_moving_slower(limit: str) -> None:
    free = plan(Problem(SRS7, [], start=START, goal=GOAL), QUICK, rng=0)
    assert free.base is not None
    assert free.trajectory is not None
    most = 0.25 * getattr(free.base, limit)
    problem = Problem(SRS7, [], start=START, goal=GOAL, base_limits=BaseLimits(**{limit: most}))
    slow = plan(problem, QUICK, rng=0)
    assert slow.found, slow.message
    assert slow.base is not None
    assert slow.trajectory is not None
    assert getattr(slow.base, limit) == pytest.approx(most, rel=1e-3)
    assert slow.trajectory.duration == pytest.approx(4 * free.trajectory.duration, rel=0.05)


@pytest.mark.parametrize("law", ["uniform", "time_optimal"])
def test_limits_of_the_base_are_kept_between_any_instants(law: Any) -> None:
    limits = BaseLimits(rate=np.radians(1.0), joint_momentum=0.6)
    problem = Problem(SRS7, [], start=START, goal=GOAL, base_limits=limits)
    found = plan(problem, PlannerSettings(evaluations=600, time_law=law), rng=3)
    assert found.found, found.message
    assert found.trajectory is not None
    assert found.certificate is not None
    assert found.certificate.base_findings is not None
    t = np.linspace(0, found.trajectory.duration, 20_001)
    state = found.trajectory.sample(t)
    rate = np.linalg.norm(found.trajectory.base_rate(t)[1], axis=1).max()
    arm = np.linalg.norm(moving(SRS7, state.q, state.dq).arm, axis=1).max()
    assert rate <= limits.rate * (1 + 1e-9)  # type: ignore[operator]
    assert arm <= limits.joint_momentum * (1 + 1e-9)  # type: ignore[operator]
    assert max(rate / limits.rate, arm / limits.joint_momentum) > 1 - 1e-4  # type: ignore[operator]
    assert found.certificate.base_findings.broken_limits == ()


def test_what_is_weighed_becomes_less() -> None:
    by = {
        name: plan(
            Problem(SRS7, [], start=START, goal=GOAL), replace(QUICK, weights=Weights(length=0.01, **{name: 1.0})), rng=0
        )
        for name in ("base_final", "base_peak", "base_rate", "joint_momentum")
    }
    plain = plan(Problem(SRS7, [], start=START, goal=GOAL), QUICK, rng=0).base
    for name, found in by.items():
        assert found.found
        assert found.base is not None
        assert getattr(found.base, name.removeprefix("base_")) < 0.9 * getattr(plain, name.removeprefix("base_"))


def test_a_tumbling_spacecraft_reaches_a_point_in_space() -> None:
    momentum = sa.Momentum(angular=(0.05, -0.08, 0.1), linear=(0.3, 0.1, 0))
    problem = Problem(
        SRS7, [], start=START, goal=PositionGoal((0.5, 0.3, 0.7), tolerance=1e-3), momentum=momentum, duration=25.0
    )
    found = plan(problem, PlannerSettings(evaluations=6000), rng=0)
    assert found.found, found.message
    assert found.trajectory is not None
    assert found.trajectory.duration == pytest.approx(25.0)
    np.testing.assert_allclose(found.trajectory.tip(25.0)[:3, 3], (0.5, 0.3, 0.7), atol=1e-3)


def test_a_duration_too_short_is_said() -> None:
    for base in ("fixed", "floating"):
        found = plan(
            Problem(SRS7, [], start=START, goal=GOAL, base=base, duration=0.5), PlannerSettings(evaluations=300), rng=0
        )
        assert not found.found
        assert "0.5 s" in found.message or "no less than" in found.message


def test_where_the_whole_is_put_makes_no_difference() -> None:
    """The same scene, goal and base seen from elsewhere: the same motion, to rounding; floating and fixed."""
    T = pose((0.4, -0.3, 0.7), (0.5, -0.5, 0.1, 0.7))
    goal = pose((0.45, 0.35, 0.7), (0.7, 0.1, 0.7, 0.1))
    for base in ("floating", "fixed"):
        here = Problem(SRS7, OBSTACLES, start=START, goal=PoseGoal(goal, orientation_tolerance=0.02), base=base)
        moved: list[Any] = [replace(OBSTACLES[0], center=T[:3, :3] @ OBSTACLES[0].center + T[:3, 3])]
        moved.append(replace(OBSTACLES[1], pose=T @ OBSTACLES[1].pose))
        there = Problem(SRS7, moved, start=START, goal=PoseGoal(T @ goal, orientation_tolerance=0.02), base=base, base_start=T)
        one, other = (plan(problem, PlannerSettings(evaluations=9000, stop_at_first=True), rng=1) for problem in (here, there))
        assert one.found, one.message
        assert other.found, other.message
        for found, wanted in ((one, goal), (other, T @ goal)):
            assert found.trajectory is not None
            np.testing.assert_allclose(found.trajectory.tip(found.trajectory.duration)[:3, 3], wanted[:3, 3], atol=1.1e-3)


def test_a_scene_is_told_from_the_base() -> None:
    T = pose((0.4, -0.3, 0.7), (0.5, -0.5, 0.1, 0.7))
    shapes: list[Any] = [
        Sphere((1, 2, 3), 0.1),
        Capsule((0, 0, 1), (1, 1, 1), 0.2),
        Box((1, 2, 3), (0.1, 0.2, 0.3)),
        Cylinder(0.3, 1.0, (1, 1, 1)),
        HalfSpace((0, 1, 1), (0, -3, 0)),
        SphereSet([(1, 0, 0), (0, 1, 0)], [0.1, 0.2]),
    ]
    q = np.array([START, (0.3, 0.2, -0.5, 1.0, 0.3, -0.4, 0.2)])
    here = Problem(SRS7, shapes, start=START, goal=START, base="fixed")
    from spacearm.geometry.scene import moved_scene

    there = Problem(SRS7, moved_scene(Scene(shapes), T), start=START, goal=START, base="fixed", base_start=T)
    np.testing.assert_allclose(sa.clearance(there, q), sa.clearance(here, q), atol=1e-12)


def test_the_goal_side_of_a_floating_base_is_not_judged_by_where_the_base_begins() -> None:
    """An obstacle where the arm's goal would be if the base stayed put: it does not."""
    free = plan(Problem(SRS7, [], start=START, goal=GOAL), QUICK, rng=0)
    assert free.trajectory is not None
    at = sa.forward_kinematics(SRS7, GOAL)[:3, 3]
    gone = np.linalg.norm(free.trajectory.tip(1e9)[:3, 3] - at)
    ball = Sphere(at, min(0.3 * gone, 0.05))
    assert plan(Problem(SRS7, [ball], start=START, goal=GOAL, base="fixed"), QUICK, rng=0).status == "goal_in_collision"
    found = plan(Problem(SRS7, [ball], start=START, goal=GOAL), PlannerSettings(evaluations=10_000), rng=0)
    assert found.found, found.message


def test_threads_and_islands_change_no_bit() -> None:
    problem = Problem(
        SRS7, OBSTACLES, start=START, goal=PositionGoal((0.5, 0.4, 0.6)), base_goal=AttitudeGoal((1, 0, 0, 0), 2e-3)
    )
    settings = PlannerSettings(evaluations=4000, islands=2)
    one, two = (plan(problem, replace(settings, threads=threads), rng=5) for threads in (1, 2))
    assert one.found, one.message
    assert one.trajectory is not None
    assert two.trajectory is not None
    assert one.trajectory.motion == two.trajectory.motion


def test_the_certificate_turns_the_base_as_the_report_does() -> None:
    found = plan(Problem(SRS7, OBSTACLES, start=START, goal=GOAL, base_start=(1, 2, 3)), QUICK, rng=2)
    assert found.certificate is not None
    assert found.base is not None
    assert found.trajectory is not None
    assert found.certificate.base_rotation_final == pytest.approx(found.base.final, abs=1e-8)
    turned = multiplied(conjugate(found.trajectory.base_pose(0.0)[1]), found.trajectory.base_pose(1e9)[1])
    assert found.base.final == pytest.approx(float(angle(turned)), abs=2e-9)
    assert found.certificate.residual_momentum is not None
    assert found.certificate.residual_momentum < 1e-9
    assert matrix_of(turned).shape == (3, 3)
