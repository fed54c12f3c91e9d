"""The kernel's floating base: momentum against Pinocchio, the base's motion and the terms against float64 in Python."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from kernel import objectives
from kernel.builds import LEVELS, Build, place
from spacearm.core.native import available_levels
from spacearm.core.rotations import angle, conjugate, matrix_of, multiplied
from spacearm.dynamics import BaseMotion, Momentum, moments, system_mass
from spacearm.dynamics.momentum import link_masses
from spacearm.geometry import Box, Capsule, HalfSpace, Scene, Sphere
from spacearm.geometry.scene import moved_scene
from spacearm.motion import Motion, Trajectory
from spacearm.planner import PoseGoal, PositionGoal, Problem, clearances
from spacearm.planner.inverse_kinematics import pose_errors
from spacearm.planner.motion_search import base_demands
from spacearm.robot import Body, LinkCapsule, Robot
from support.drawn_spacecraft import motion_of, spacecraft
from support.oracles import pinocchio_floating, servicer

ROBOTS = [spacecraft(seed) for seed in range(6)]
OBSTACLES = [
    Sphere((0.6, 0.4, 0.2), 0.3),
    Box((0.4, 0.3, 0.8)),
    Capsule((1, 0, 0), (0, 1, 0.5), 0.1),
    HalfSpace((0, 0, 1), (0, 0, -1.2)),
]


def floating_search(build: Build, robot: Robot, start: Any, goal: Any, base: Any = None, **given: Any) -> Any:
    """A search for motions of a robot on a floating base to one goal configuration."""
    base = build.module.FloatingBase() if base is None else base
    obstacles, masses = given.pop("obstacles", []), link_masses(robot)._asdict()
    return objectives.motion_search(build, robot, obstacles, start, [goal], base=base, masses=masses, **given)


def with_envelope(robot: Robot, seed: int) -> Robot:
    """A drawn robot with a capsule or two on its base and on every joint."""
    rng = np.random.default_rng(seed)
    capsules = [
        LinkCapsule(name=f"link{joint}", joint=joint, a=rng.normal(size=3) * 0.1, b=rng.normal(size=3) * 0.2, radius=0.05)
        for joint in [-1, -1, *range(len(robot.joints))]
    ]
    weighed = {body.joint for body in robot.bodies}
    none = [joint for joint in range(len(robot.joints)) if joint not in weighed]  # said to weigh nothing, not forgotten
    light = [Body(name=f"light{i}", joint=i, mass=0.0, com=np.zeros(3), inertia=np.zeros((3, 3))) for i in none]
    robot = replace(robot, bodies=(*robot.bodies, *light))
    return replace(robot, capsules=tuple(capsules), self_pairs=(("link-1", f"link{len(robot.joints) - 1}"),))


def rows_of(build: Build, motion: Motion) -> np.ndarray:
    return build.array(motion.control_points[1:-1].reshape(1, -1))


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_momentum_is_pinocchios(build: Build, robot: Robot) -> None:
    native = place(build, robot, masses=link_masses(robot)._asdict()).native
    rng = np.random.default_rng(7)
    q, dq = rng.uniform(-3, 3, (19, robot.dof)), rng.normal(size=(19, robot.dof))
    found = np.asarray(native.momentum_terms(build.array(q), build.array(dq)), dtype=np.float64)
    model = pinocchio_floating.floating_model(robot)
    data = model.createData()
    accuracy = 1e-10 if build.bits == 64 else 2e-4
    for row, at, rate in zip(found, build.array(q).astype(float), build.array(dq).astype(float), strict=True):
        full = pinocchio_floating.floating_q(robot, np.zeros(3), np.array([1.0, 0, 0, 0]), at)
        A = pin.computeCentroidalMap(model, data, full)
        joints = np.array([joint.multiplier * rate[joint.dof] for joint in robot.joints])
        arm, inertia = (A[:, 6:] @ joints)[3:], A[3:, 3:6]
        H = np.array([[row[6], row[9], row[10]], [row[9], row[7], row[11]], [row[10], row[11], row[8]]])
        scale = np.abs(inertia).max()
        np.testing.assert_allclose(row[:3], pin.centerOfMass(model, data, full), atol=accuracy * 10)
        pin.centerOfMass(model, data, full, np.concatenate([np.zeros(6), joints]))
        np.testing.assert_allclose(row[15:], data.vcom[0], atol=accuracy * 20)
        np.testing.assert_allclose(H, inertia, atol=accuracy * scale)
        np.testing.assert_allclose(row[3:6], arm, atol=accuracy * scale * max(1.0, np.abs(rate).max()))
        np.testing.assert_allclose(
            row[12:15], pinocchio_floating.free_rate(model, full, joints, np.zeros(3)), atol=accuracy * 20
        )


def test_the_servicer_ends_as_published(build: Build) -> None:
    """ORACLES B1: the attitude after the joint law, and the end effector from the system's centre of mass."""
    robot, start = servicer.servicer(), np.zeros(7)
    for goal, attitude in (
        ((0.890033, 0.28735, 2.78844, 2.90451, 1.05669, 1.85941, 1.0428), (0.9999790, -0.0010796, 0.0063876, 0.0001211)),
        ((1.11508, 0.304819, -0.678856, 3.23913, 1.23781, -2.07818, -2.15025), (0.9998846, 0.0076675, -0.0064234, -0.0114343)),
    ):
        search = floating_search(build, robot, start, goal, bounds=(np.full(7, -7), np.full(7, 7)))
        end = search.base_along(build.array(np.zeros((1, 0))), 0, 0, 128, True)[0, 0]
        np.testing.assert_allclose(end[3:], attitude, atol=1e-6)


@pytest.mark.parametrize("tumbling", [False, True], ids=["at rest", "tumbling"])
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_base_goes_where_float64_says(build: Build, robot: Robot, tumbling: bool) -> None:
    motion, duration = motion_of(robot, 3, size=1.0), 30.0
    start, goal = motion.control_points[[0, -1]]
    base = build.module.FloatingBase()
    momentum = Momentum()
    if tumbling:
        inertia = moments(robot, start).H_w
        momentum = Momentum(linear=(0.4, -0.2, 0.1), angular=inertia @ np.array([0.01, -0.02, 0.015]))
        drift = momentum.linear * duration / system_mass(robot)
        base = build.module.FloatingBase(duration=duration, angular=momentum.angular, drift=drift)
    search = floating_search(build, robot, start, goal, base)
    exact = BaseMotion(robot, motion, momentum=momentum, duration=duration)
    for nodes, off in ((128, 3e-4), (512, 3e-6)) if build.bits == 64 else ((128, 3e-4),):
        found = np.asarray(search.base_along(rows_of(build, motion), motion.interior, 0, nodes, False)[0], dtype=np.float64)
        position, attitude = exact.pose(np.linspace(0, 1, nodes + 1))
        assert angle(multiplied(conjugate(attitude), found[:, 3:])).max() < off
        np.testing.assert_allclose(found[:, :3], position, atol=off * 10)
        ends = search.base_along(rows_of(build, motion), motion.interior, 0, nodes, True)[0]
        np.testing.assert_array_equal(
            ends[0], search.base_along(rows_of(build, motion), motion.interior, 0, nodes, False)[0, -1]
        )


def test_twice_the_nodes_divide_the_error_by_sixteen_or_more() -> None:
    build = Build("generic", 64)
    falls = []
    for robot in ROBOTS:
        motion = motion_of(robot, 5, size=0.7, interior=1)
        search = floating_search(build, robot, *motion.control_points[[0, -1]])
        exact = BaseMotion(robot, motion, tolerance=1e-12).pose(1.0)[1]
        errors = []
        for nodes in (64, 128, 256):
            end = search.base_along(rows_of(build, motion), 1, 0, nodes, True)[0, 0, 3:]
            errors.append(float(angle(multiplied(conjugate(exact), end))))
        falls.append(math.log2(errors[0] / errors[2]) / 2)
    assert np.median(falls) > 3.9


@pytest.mark.parametrize("robot", ROBOTS[:4], ids=lambda robot: robot.name)
def test_clearance_is_taken_where_arm_and_base_are(build: Build, robot: Robot) -> None:
    robot = with_envelope(robot, 1)
    motion, margin = motion_of(robot, 4, size=1.0), 0.05
    search = floating_search(build, robot, *motion.control_points[[0, -1]], obstacles=OBSTACLES, margin=margin)
    judged = search.judge(rows_of(build, motion), motion.interior, 0)
    s = np.arange(1, 65) / 64
    position, attitude = BaseMotion(robot, motion).pose(s)
    short = 0.0
    for q, at, turn in zip(motion.sample(s), position, attitude, strict=True):
        T_b_w = np.eye(4)
        T_b_w[:3, :3] = matrix_of(turn).T
        T_b_w[:3, 3] = -T_b_w[:3, :3] @ at
        seen = Problem(robot, moved_scene(Scene(OBSTACLES), T_b_w), start=q, goal=q, base="fixed")
        short += np.maximum(margin - clearances(seen, q), 0).sum()
        from spacearm.planner.clearance import self_clearances

        short += np.maximum(margin - self_clearances(seen, q), 0).sum()
    assert short > 0.5
    assert judged.violation[0] == pytest.approx(short, rel=2e-3, abs=1e-3)


@pytest.mark.parametrize("robot", ROBOTS[:4], ids=lambda robot: robot.name)
def test_terms_of_the_base(build: Build, robot: Robot) -> None:
    motion = motion_of(robot, 6, size=0.8)
    trajectory = Trajectory(robot, motion)
    search = floating_search(build, robot, *motion.control_points[[0, -1]])
    names = build.module.motion_terms
    terms = dict(zip(names, search.judge(rows_of(build, motion), motion.interior, 0).terms[0].tolist(), strict=True))
    s = np.arange(0, 65) / 64
    turned = angle(trajectory.base_motion.pose(s)[1])
    assert terms["base_final"] == pytest.approx(turned[-1], abs=2e-4)
    assert terms["base_peak"] == pytest.approx(turned.max(), abs=2e-4)
    rate = np.linalg.norm(trajectory.base_motion.rate(s), axis=1).max() / terms["duration"]
    assert terms["base_rate"] == pytest.approx(rate, rel=1e-3)
    arm = np.linalg.norm((moments(robot, motion.sample(s)).H_q @ motion.sample(s, 1)[..., None])[..., 0], axis=1).max()
    assert terms["joint_momentum"] == pytest.approx(arm / terms["duration"], rel=1e-3)
    tip = trajectory.tip(s * trajectory.duration)[:, :3, 3]
    assert terms["tip"] == pytest.approx(np.linalg.norm(np.diff(tip, axis=0), axis=1).sum(), rel=1e-3)


@pytest.mark.parametrize("kind", ["position", "pose", "axis"])
def test_motions_are_moved_until_their_ends_are_met(build: Build, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = servicer.servicer()
    start, near = np.zeros(7), np.array([0.4, 0.3, 0.5, -0.4, 0.6, 0.3, 0.2])
    wanted = Trajectory(robot, Motion([start, near + 0.1]), base="floating").tip(1e9)
    goal: Any = PositionGoal(wanted[:3, 3], tolerance=1e-3)
    if kind != "position":
        goal = PoseGoal(wanted, position_tolerance=1e-3, orientation_tolerance=1e-3, free_axis="z" if kind == "axis" else None)
    robot = replace(robot, lower=np.full(7, -4.0), upper=np.full(7, 4.0))
    problem = Problem(robot, [], start=start, goal=goal, base="floating", base_goal=(1, 0, 0, 0))
    for module in ("motion_search", "inverse_kinematics"):  # where the demands and the goal's frame are put together
        monkeypatch.setattr(f"spacearm.planner.{module}.native", build.module)
    demands = base_demands(problem)
    base = build.module.FloatingBase(frame=demands.frame, attitude=demands.attitude)
    search = floating_search(build, robot, start, near, base, bounds=(robot.lower, robot.upper))
    line = np.linspace(start, near, 6)[1:-1]
    first = build.array(np.vstack([line + 0.05 * np.sin(np.arange(28)).reshape(4, 7), near]).reshape(1, -1))
    projected = search.project(first, 4, 0)
    assert projected.met.tolist() == [True]
    motion = Motion(np.vstack([start, projected.points.astype(np.float64).reshape(-1, 7)]))
    trajectory = Trajectory(robot, motion, base="floating")
    distance, turned = pose_errors(problem.goal, trajectory.tip(trajectory.duration)[None])
    off = angle(trajectory.base_pose(trajectory.duration)[1])
    within = 1.0 if build.bits == 32 else 1e-3
    assert distance[0] < within * 1e-3
    assert turned[0] < within * 1e-3
    assert off < within * 5e-4


@pytest.mark.parametrize("bits", [64, 32])
def test_searches_on_a_floating_base_give_the_same_bits_at_every_level(bits: int) -> None:
    robot = replace(with_envelope(ROBOTS[1], 2), self_pairs=())
    start, goal = np.full(robot.dof, 0.1), np.full(robot.dof, 0.9)
    found = []
    for level in LEVELS:
        if level in available_levels():
            build = Build(level, bits)
            still = build.module.AttitudeGoal(wxyz=np.array([1.0, 0, 0, 0]), tolerance=1e-3, anywhere_within=False)
            base = build.module.FloatingBase(attitude=still)
            search = floating_search(
                build, robot, start, goal, base, settings={"interior": [4]}, weights={"length": 1.0, "base_peak": 1.0}
            )
            history = objectives.run_motions(search, 60).history
            found.append([(e.evaluations, e.fitness, e.by, e.points.tobytes()) for e in history])
    assert found[0]
    assert all(other == found[0] for other in found)
