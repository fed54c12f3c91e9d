"""Momentum by blocks, against Pinocchio, the sums as they are written, and heavy bases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from spacearm.core.errors import ProblemError, RobotError, SpacearmError
from spacearm.dynamics import (
    Momentum,
    base_at_mass_center,
    base_rate,
    center_of_mass,
    moments,
    momentum_map,
    require_masses,
    system_mass,
)
from spacearm.dynamics.momentum import moving
from spacearm.robot import Body, Robot, joint_frames, load_robot
from support.drawn_spacecraft import spacecraft
from support.messages import assert_refused
from support.oracles.pinocchio_floating import floating_model, floating_q, floating_v, free_rate, momentum
from support.oracles.pinocchio_model import full_q
from support.oracles.servicer import servicer

ROBOTS = pytest.mark.parametrize("robot", [servicer(), *map(spacecraft, range(12))], ids=lambda robot: robot.name)
_AT_ORIGIN = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
# Both sides round; what they round is as large as the largest block.
_ROUNDING = 1e-12


@ROBOTS
def test_the_blocks_give_pinocchios_centroidal_momentum(robot: Robot) -> None:
    rng, model = np.random.default_rng(1), floating_model(robot)
    for _ in range(20):
        q, dq, omega = rng.uniform(-3, 3, robot.dof), rng.normal(size=robot.dof), rng.normal(size=3)
        H_w, H_q = momentum_map(robot, q)
        total, _, largest = momentum(
            model, floating_q(robot, *_AT_ORIGIN, q), floating_v(robot, _AT_ORIGIN[1], np.zeros(3), omega, dq)
        )
        np.testing.assert_allclose(H_w @ omega + H_q @ dq, total[3:], rtol=0, atol=_ROUNDING * largest)


@ROBOTS
def test_the_base_turns_so_that_no_angular_momentum_is_left(robot: Robot) -> None:
    rng, model = np.random.default_rng(2), floating_model(robot)
    for _ in range(20):
        q, dq = rng.uniform(-3, 3, robot.dof), rng.normal(size=robot.dof)
        omega = base_rate(robot, q, dq)
        at, v = floating_q(robot, *_AT_ORIGIN, q), floating_v(robot, _AT_ORIGIN[1], np.zeros(3), omega, dq)
        total, _, largest = momentum(model, at, v)
        assert np.abs(total[3:]).max() <= 1e-13 * largest
        expected = free_rate(model, at, v[6:], np.zeros(3))
        np.testing.assert_allclose(omega, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


@ROBOTS
def test_the_centre_of_mass_and_its_velocity_are_pinocchios(robot: Robot) -> None:
    rng, model = np.random.default_rng(3), floating_model(robot)
    data = model.createData()
    assert system_mass(robot) == pytest.approx(pin.computeTotalMass(model), rel=1e-14)
    for _ in range(20):
        q, dq = rng.uniform(-3, 3, robot.dof), rng.normal(size=robot.dof)
        pin.centerOfMass(
            model, data, floating_q(robot, *_AT_ORIGIN, q), floating_v(robot, _AT_ORIGIN[1], np.zeros(3), np.zeros(3), dq)
        )
        np.testing.assert_allclose(center_of_mass(robot, q), data.com[0], rtol=0, atol=1e-13)
        np.testing.assert_allclose(moments(robot, q).J_c @ dq, data.vcom[0], rtol=0, atol=1e-13)


@ROBOTS
def test_the_blocks_are_the_sums_over_bodies_as_they_are_written(robot: Robot) -> None:
    q = np.random.default_rng(4).uniform(-3, 3, robot.dof)
    H_w, H_q = _sums(robot, q)
    for found, expected in zip(momentum_map(robot, q), (H_w, H_q), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=_ROUNDING * np.abs(H_w).max())


def _sums(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ORACLES.md B2, body by body: J by the joints on the way from the base."""
    frames = np.concatenate([np.eye(4)[None], joint_frames(robot, q)])
    jacobians = []
    for body in robot.bodies:
        place = frames[1 + body.joint, :3, :3] @ body.com + frames[1 + body.joint, :3, 3]
        J_v, J_w, on = np.zeros((3, robot.dof)), np.zeros((3, robot.dof)), body.joint
        while on >= 0:
            joint, axis = robot.joints[on], frames[1 + on, :3, 2]
            if joint.kind == "revolute":
                J_v[:, joint.dof] += joint.multiplier * np.cross(axis, place - frames[1 + on, :3, 3])
                J_w[:, joint.dof] += joint.multiplier * axis
            else:
                J_v[:, joint.dof] += joint.multiplier * axis
            on = joint.parent
        R = frames[1 + body.joint, :3, :3]
        jacobians.append((body.mass, place, R @ body.inertia @ R.T, J_v, J_w))
    mass = sum(body.mass for body in robot.bodies)
    center = sum(m * place for m, place, *_ in jacobians) / mass
    J_cm = sum(m * J_v for m, _, _, J_v, _ in jacobians) / mass
    H_w, H_q = np.zeros((3, 3)), np.zeros((3, robot.dof))
    for m, place, inertia, J_v, J_w in jacobians:
        r = place - center
        H_w += inertia + m * (r @ r * np.eye(3) - np.outer(r, r))
        H_q += inertia @ J_w + m * np.cross(r, J_v - J_cm, axis=0)
    return H_w, H_q


@pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,), (1100,)])
def test_leading_axes_are_batch(shape: tuple[int, ...]) -> None:
    robot = spacecraft(3)
    q = np.random.default_rng(5).uniform(-2, 2, (*shape, robot.dof))
    found = moments(robot, q)
    assert found.center.shape == (*shape, 3)
    assert found.H_w.shape == (*shape, 3, 3)
    assert found.H_q.shape == found.J_c.shape == (*shape, 3, robot.dof)
    assert base_rate(robot, q, q).shape == (*shape, 3)
    for index in list(np.ndindex(*shape))[-2:]:
        for many, one in zip(found, moments(robot, q[index]), strict=True):
            np.testing.assert_allclose(many[index], one, rtol=0, atol=1e-12 * np.abs(one).max())


def test_a_very_heavy_base_does_not_turn() -> None:
    q, dq = np.random.default_rng(6).uniform(-2, 2, (2, 50, 7))
    assert np.abs(base_rate(servicer(1e9 / 1474.1), q, dq)).max() < 1e-6
    assert np.abs(base_rate(servicer(), q, dq)).max() > 1e-2


def test_at_the_mass_centre_the_inertial_origin_is_that_of_base_and_arm() -> None:
    robot, q = servicer(), np.full(7, 0.4)
    T = base_at_mass_center(robot, q, (0.5, 0.5, -0.5, 0.5))
    np.testing.assert_allclose(T[:3, :3] @ center_of_mass(robot, q) + T[:3, 3], 0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(T[:3, :3], pin.Quaternion(0.5, 0.5, -0.5, 0.5).toRotationMatrix(), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(full_q(robot, q), q)


def _with(*bodies: Body) -> Robot:
    return replace(servicer(), bodies=bodies)


def _body(joint: int, mass: float, *moments: float) -> Body:
    return Body(name=f"on {joint}", joint=joint, mass=mass, com=np.array([0.1, 0, 0]), inertia=np.diag(moments))


_BASE = _body(-1, 10.0, 1.0, 1.0, 1.0)
REFUSED = {
    "no masses": (RobotError, lambda: momentum_map(_with(), np.zeros(7))),
    "massless base": (RobotError, lambda: base_rate(_with(_body(2, 1.0, 1, 1, 1)), np.zeros(7), np.zeros(7))),
    "base a point": (RobotError, lambda: require_masses(_with(_body(-1, 10.0, 0, 0, 0)))),
    "negative inertia": (RobotError, lambda: require_masses(_with(_BASE, _body(1, 2.0, 1.0, 1.0, -0.1)))),
    "inertia against the triangle": (RobotError, lambda: require_masses(_with(_BASE, _body(1, 2.0, 1.0, 0.5, 0.2)))),
    "inertia without mass": (RobotError, lambda: require_masses(_with(_BASE, _body(1, 0.0, 1.0, 1.0, 1.0)))),
    "rates of too few joints": (RobotError, lambda: base_rate(servicer(), np.zeros(7), np.zeros(6))),
    "attitude of zeros": (ProblemError, lambda: base_at_mass_center(servicer(), np.zeros(7), (0, 0, 0, 0))),
    "momentum of two numbers": (ProblemError, lambda: Momentum(linear=(1.0, 2.0))),
}


@pytest.mark.parametrize("case", REFUSED)
def test_masses_and_momenta_that_cannot_be_are_refused(case: str) -> None:
    error, call = REFUSED[case]
    assert issubclass(error, SpacearmError)
    assert_refused("momentum", case, error, call)


def test_links_without_extent_and_joints_without_mass_are_no_fault() -> None:
    require_masses(_with(_BASE, _body(3, 2.0, 0.0, 0.0, 0.0)))


def test_momentum_is_a_value() -> None:
    assert Momentum() == Momentum(angular=(0, 0, 0))
    assert Momentum().is_zero
    assert not Momentum(angular=(0, 0, 1e-9)).is_zero
    assert hash(Momentum(linear=[1, 2, 3])) == hash(Momentum(linear=(1.0, 2.0, 3.0)))


def test_a_fixed_arm_without_masses_has_none() -> None:
    robot = replace(load_robot("zhang2022"), bodies=())
    assert system_mass(robot) == 0.0


@pytest.mark.parametrize("seed", range(8))
def test_the_kernel_gives_what_the_blocks_do(seed: int) -> None:
    robot, rng = spacecraft(seed), np.random.default_rng(seed)
    q, dq = rng.uniform(-3, 3, (33, robot.dof)), rng.normal(size=(33, robot.dof))
    quick, found = moving(robot, q, dq), moments(robot, q)
    scale = np.abs(found.H_w).max()
    np.testing.assert_allclose(quick.center, found.center, atol=1e-12)
    np.testing.assert_allclose(quick.center_rate, (found.J_c @ dq[..., None])[..., 0], atol=1e-12)
    np.testing.assert_allclose(quick.H_w, found.H_w, atol=1e-12 * scale)
    np.testing.assert_allclose(quick.arm, (found.H_q @ dq[..., None])[..., 0], atol=1e-11 * scale)
    np.testing.assert_allclose(quick.free_rate, base_rate(robot, q, dq), atol=1e-11)
