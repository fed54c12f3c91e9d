"""The floating base's motion, against known numbers, Pinocchio, MuJoCo, and the laws of mechanics."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from spacearm.core.errors import ProblemError, RobotError
from spacearm.core.rotations import exponential, running_products
from spacearm.dynamics import (
    BaseMotion,
    Momentum,
    base_at_mass_center,
    base_rate,
    center_of_mass,
    momentum_map,
    system_mass,
)
from spacearm.dynamics.base_motion import NODES, step_turn
from spacearm.motion import Motion, Trajectory, time_optimal
from spacearm.robot import Robot, load_robot
from support.drawn_spacecraft import motion_of, spacecraft
from support.messages import assert_refused
from support.oracles import mujoco_floating
from support.oracles.pinocchio_floating import floating_model, floating_q, floating_v, free_rate, momentum
from support.oracles.servicer import AT_ZERO, ROWS, servicer

SERVICER = servicer()
ROBOTS = pytest.mark.parametrize("robot", [SERVICER, *map(spacecraft, (0, 2, 3, 5))], ids=lambda robot: robot.name)
TUMBLES = pytest.mark.parametrize("share", [0.0, 0.02, 0.3], ids=["at rest", "drifting", "tumbling"])
DURATION = 20.0


def _momentum(robot: Robot, share: float) -> Momentum:
    """A momentum that turns the base by about `share` rad/s."""
    size = np.trace(sum(body.inertia for body in robot.bodies)) * share
    return Momentum(linear=np.array([0.3, -0.2, 0.1]) * share * system_mass(robot), angular=size * np.array([0.2, -0.5, 0.7]))


def _start() -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    T[:3, 3] = 0.4, -1.1, 2.0
    return T


def _turn_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The angle between attitudes (..., 4) [rad]: twice the sine of a quarter of it is their distance."""
    distance = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    return 4 * np.arcsin(distance / 2)


@pytest.mark.parametrize("row", ROWS, ids=["least rotation", "elbow up"])
def test_the_servicer_ends_where_the_oracle_says(row: tuple) -> None:
    joints, duration, attitude, degrees, tip = row
    start = base_at_mass_center(SERVICER, np.zeros(7))
    trajectory = Trajectory(SERVICER, Motion([np.zeros(7), joints]), base_start=start)
    assert trajectory.duration == pytest.approx(duration, rel=1e-6)
    found = trajectory.base_pose(trajectory.duration)[1]
    np.testing.assert_allclose(found, attitude, rtol=0, atol=1e-7)  # of which seven digits are known
    assert np.degrees(_turn_between(found, np.array([1.0, 0, 0, 0]))) == pytest.approx(degrees, abs=1e-4)
    np.testing.assert_allclose(trajectory.tip(0.0)[:3, 3], AT_ZERO, rtol=0, atol=1e-14)
    np.testing.assert_allclose(trajectory.tip(trajectory.duration)[:3, 3], tip, rtol=0, atol=1e-6)


def test_eulers_method_gives_what_the_project_published() -> None:
    final, q, attitude = np.array(ROWS[0][0]), np.zeros(7), np.array([1.0, 0, 0, 0])
    for tau in np.arange(100) / 100:  # joints and attitude alike, as that project does
        dq = final * (30 * tau**2 - 60 * tau**3 + 30 * tau**4)
        attitude = attitude + _quaternion_rate(attitude, base_rate(SERVICER, q, dq)) / 100
        attitude /= np.linalg.norm(attitude)
        q = q + dq / 100
    published = (0.99997952, -1.05075036e-3, 6.31334314e-3, 7.60428370e-5)
    np.testing.assert_allclose(attitude, published, rtol=0, atol=1e-7)  # its joints are known to six digits


def _quaternion_rate(wxyz: np.ndarray, omega_b: np.ndarray) -> np.ndarray:
    w, v = wxyz[0], wxyz[1:]
    return np.concatenate([[-v @ omega_b], w * omega_b + np.cross(v, omega_b)]) / 2


@TUMBLES
@ROBOTS
def test_pinocchio_finds_the_momentum_that_the_base_was_given(robot: Robot, share: float) -> None:
    path, given = motion_of(robot, 7), _momentum(robot, share)
    base = BaseMotion(robot, path, base_start=_start(), momentum=given, duration=DURATION, tolerance=1e-10)
    model, u = floating_model(robot), np.linspace(0.03, 0.97, 25)
    position, attitude = base.pose(u)
    velocity, omega = base.twist(u)
    for i, at in enumerate(u):
        total, linear, angular = momentum(
            model,
            floating_q(robot, position[i], attitude[i], path.sample(at)),
            floating_v(robot, attitude[i], velocity[i], omega[i], path.sample(at, 1)) / DURATION,
        )
        assert np.abs(total[:3] - given.linear).max() <= 1e-12 * linear
        assert np.abs(total[3:] - given.angular).max() <= 1e-12 * angular


@TUMBLES
@ROBOTS
def test_the_attitude_is_that_of_another_integration_by_pinocchios_rates(robot: Robot, share: float) -> None:
    path, given = motion_of(robot, 11), _momentum(robot, share)
    base = BaseMotion(robot, path, base_start=_start(), momentum=given, duration=DURATION, tolerance=1e-10)
    assert base.error <= 1e-10
    model = floating_model(robot)

    def derivative(u: float, wxyz: np.ndarray) -> np.ndarray:
        wxyz = wxyz / np.linalg.norm(wxyz)
        at = floating_q(robot, np.zeros(3), wxyz, path.sample(u))
        rates = floating_v(robot, wxyz, np.zeros(3), np.zeros(3), path.sample(u, 1))[6:]
        omega = free_rate(model, at, rates, given.angular * DURATION)
        return _quaternion_rate(wxyz, omega)

    begin, attitudes = base.pose(0.0)[1], []
    ends = np.linspace(0, 1, path.pieces + 1)  # the rates have corners of a high order there
    for first, last in pairwise(ends):
        done = solve_ivp(
            derivative, (first, last), begin, method="DOP853", rtol=1e-12, atol=1e-12, t_eval=np.linspace(first, last, 4)
        )
        attitudes.append(done.y.T[1:])
        begin = attitudes[-1][-1]
    expected = np.concatenate(attitudes)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    found = base.pose(np.linspace(0, 1, 3 * path.pieces + 1)[1:])[1]
    assert _turn_between(found, expected).max() <= 1e-9


@TUMBLES
@ROBOTS
def test_between_its_nodes_the_motion_is_as_right_as_at_them(robot: Robot, share: float) -> None:
    path, given, u = motion_of(robot, 13, interior=1), _momentum(robot, share), np.linspace(0, 1, 101)
    how = {"base_start": _start(), "momentum": given, "duration": DURATION}
    coarse = BaseMotion(robot, path, tolerance=1e-5, **how)
    fine = BaseMotion(robot, path, tolerance=1e-12, **how)
    assert coarse.steps < fine.steps
    # Errors add up on the way; a momentum's own dependence on attitude may magnify them a little.
    assert _turn_between(coarse.pose(u)[1], fine.pose(u)[1]).max() <= (3 if share else 1) * coarse.error
    assert coarse.error <= 1e-5


@TUMBLES
@ROBOTS
def test_pose_and_twist_belong_together(robot: Robot, share: float) -> None:
    path, h, u = motion_of(robot, 17), 1e-5, np.linspace(0.05, 0.95, 19)
    base = BaseMotion(robot, path, base_start=_start(), momentum=_momentum(robot, share), duration=DURATION)
    (before, q0), (after, q1), (_, now) = base.pose(u - h), base.pose(u + h), base.pose(u)
    velocity, omega = base.twist(u)
    scale = 1 + np.abs(velocity).max() + np.abs(omega).max()
    np.testing.assert_allclose((after - before) / (2 * h), velocity, rtol=0, atol=1e-6 * scale**3)
    for i in range(len(u)):
        expected = _quaternion_rate(now[i], omega[i])
        np.testing.assert_allclose((q1[i] - q0[i]) / (2 * h), expected, rtol=0, atol=1e-6 * scale**3)


@TUMBLES
@ROBOTS
def test_the_centre_of_mass_rests_or_drifts_steadily(robot: Robot, share: float) -> None:
    path, given, u = motion_of(robot, 19), _momentum(robot, share), np.linspace(0, 1, 50)
    base = BaseMotion(robot, path, base_start=_start(), momentum=given, duration=DURATION)
    start, centers = _start(), center_of_mass(robot, path.sample(u))
    position, attitude = base.pose(u)
    model = floating_model(robot)
    for i, at in enumerate(u):
        found = pin.centerOfMass(model, model.createData(), floating_q(robot, position[i], attitude[i], path.sample(at)))
        expected = start[:3, :3] @ centers[0] + start[:3, 3] + given.linear / system_mass(robot) * DURATION * at
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


@ROBOTS
def test_back_along_its_path_the_arm_brings_the_base_back(robot: Robot) -> None:
    path = motion_of(robot, 23)
    there = BaseMotion(robot, path, base_start=_start())
    position, attitude = there.pose(1.0)
    T = _start()
    T[:3, 3] = position
    T[:3, :3] = _matrix(attitude)
    back = BaseMotion(robot, Motion(path.control_points[::-1]), base_start=T)
    u = np.linspace(0, 1, 21)
    for found, expected in zip(back.pose(1 - u), there.pose(u), strict=True):
        tolerance = 2e-9 * (1 if found.shape[1] == 4 else np.abs(center_of_mass(robot, path.sample(u))).max())
        np.testing.assert_allclose(np.minimum(np.abs(found - expected), np.abs(found + expected)), 0, rtol=0, atol=tolerance)


def _matrix(wxyz: np.ndarray) -> np.ndarray:
    return pin.Quaternion(np.roll(wxyz, -1)).toRotationMatrix()


def test_without_momentum_no_timing_changes_where_the_base_goes() -> None:
    path = Motion([np.zeros(7), np.full(7, 0.5), ROWS[0][0]])
    quick, slow = time_optimal(SERVICER, path), Trajectory(SERVICER, path, duration=500.0)
    assert quick.duration < Trajectory(SERVICER, path).duration < slow.duration
    s = np.linspace(0, 1, 33)
    poses = [BaseMotion(SERVICER, path).pose(s)]
    for trajectory in (quick, slow):
        over_time = BaseMotion(SERVICER, trajectory.path)  # integrated over the time of each
        poses.append(over_time.pose(trajectory.time_at(s)))
    for position, attitude in poses[1:]:
        np.testing.assert_allclose(position, poses[0][0], rtol=0, atol=1e-8)
        np.testing.assert_allclose(attitude, poses[0][1], rtol=0, atol=2e-9)


def test_a_free_body_tumbles_as_euler_found() -> None:
    """The arm at rest: H_w omega is constant in the inertial frame and so is the energy; many turns."""
    rest = Motion([np.full(7, 0.7), np.full(7, 0.7)])
    given = Momentum(angular=(3000.0, -2000.0, 2500.0))
    base = BaseMotion(SERVICER, rest, momentum=given, duration=60.0)
    assert base.error <= 1e-9
    H_w, _ = momentum_map(SERVICER, rest.sample(0.0))
    u = np.linspace(0, 1, 200)
    omega = base.rate(u) / 60.0
    energy = np.einsum("ui,ij,uj->u", omega, H_w, omega) / 2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)
    attitude = base.pose(u)[1]
    for i in range(len(u)):
        np.testing.assert_allclose(_matrix(attitude[i]) @ H_w @ omega[i], given.angular, rtol=0, atol=1e-8)
    done = solve_ivp(
        lambda t, w: np.linalg.solve(H_w, np.cross(H_w @ w, w)), (0, 60), omega[0], method="DOP853", rtol=1e-12, atol=1e-14
    )
    np.testing.assert_allclose(omega[-1], done.y[:, -1], rtol=0, atol=1e-9)
    assert _turns(omega, 60.0) > 2


def _turns(omega: np.ndarray, duration: float) -> float:
    return float(np.linalg.norm(omega, axis=1).mean() * duration / (2 * np.pi))


def test_a_very_heavy_base_stays_where_it_is() -> None:
    heavy = servicer(1e9 / 1474.1)
    path = Motion([np.zeros(7), ROWS[1][0]])
    floating = Trajectory(heavy, path, base_start=_start())
    fixed = Trajectory(heavy, path, base="fixed", base_start=_start())
    t = np.linspace(0, floating.duration, 40)
    np.testing.assert_allclose(floating.tip(t), fixed.tip(t), rtol=0, atol=1e-6)
    np.testing.assert_allclose(floating.base_pose(t)[0], fixed.base_pose(t)[0], rtol=0, atol=1e-6)


@pytest.mark.parametrize("share", [0.0, 0.02])
@pytest.mark.parametrize("robot", [SERVICER, spacecraft(4, plain=True), spacecraft(9, plain=True)], ids=lambda r: r.name)
def test_mujoco_ends_in_the_same_pose(robot: Robot, share: float) -> None:
    """Equations of motion instead of momentum: forces at the joints alone, Runge-Kutta's method in time."""
    duration, steps = 5.0, 400
    path, given = motion_of(robot, 29, interior=1, size=1.0), _momentum(robot, share)
    base = BaseMotion(robot, path, base_start=_start(), momentum=given, duration=duration, tolerance=1e-11)
    ends = base.pose([0.0, 1.0])
    begin, omega = base.twist(0.0)
    model = mujoco_floating.floating_model(robot, duration / steps)
    qpos, qvel = mujoco_floating.run(
        robot,
        model,
        np.concatenate([ends[0][0], ends[1][0], path.sample(0.0)]),
        np.concatenate([begin / duration, omega / duration, np.zeros(robot.dof)]),
        lambda t: path.sample(t / duration, 2) / duration**2,
        steps,
    )
    np.testing.assert_allclose(qpos[7:], path.sample(1.0), rtol=0, atol=1e-7)  # MuJoCo's own error
    assert _turn_between(qpos[3:7], ends[1][1]) <= 1e-6
    np.testing.assert_allclose(qpos[:3], ends[0][1], rtol=0, atol=1e-6)
    np.testing.assert_allclose(qvel[3:6], base.rate(1.0) / duration, rtol=0, atol=1e-6)


def test_the_error_of_equal_steps_falls_with_their_sixth_power() -> None:
    # The servicer's long panels make steep rates: the order shows as soon as steps resolve them.
    path = Motion([np.zeros(7), np.array(ROWS[1][0]) * 0.5])
    right, errors = BaseMotion(SERVICER, path, tolerance=1e-13).pose(1.0)[1], []
    for count in (16, 32, 64):
        at = (np.arange(count)[:, None] + NODES) / count
        turns = step_turn(base_rate(SERVICER, path.sample(at), path.sample(at, 1)), np.full(count, 1 / count))
        errors.append(_turn_between(right, running_products(exponential(turns))[-1]))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(6, abs=0.5)


@pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,), (5000,)])
def test_leading_axes_are_batch(shape: tuple[int, ...]) -> None:
    base = BaseMotion(spacecraft(1), motion_of(spacecraft(1), 3), momentum=_momentum(spacecraft(1), 0.02), duration=3.0)
    u = np.random.default_rng(0).uniform(-0.2, 1.2, shape)
    position, attitude = base.pose(u)
    assert position.shape == (*shape, 3)
    assert attitude.shape == (*shape, 4)
    assert base.rate(u).shape == (*shape, 3)
    np.testing.assert_allclose(np.linalg.norm(attitude, axis=-1), 1.0, rtol=0, atol=1e-14)


def test_a_floating_base_begins_where_it_was_put() -> None:
    base = BaseMotion(SERVICER, Motion([np.zeros(7), ROWS[0][0]]), base_start=_start())
    position, attitude = base.pose([-1.0, 0.0])
    np.testing.assert_allclose(position, [_start()[:3, 3]] * 2, rtol=0, atol=1e-15)
    np.testing.assert_allclose(_matrix(attitude[1]), _start()[:3, :3], rtol=0, atol=1e-15)


_PATH = Motion([np.zeros(7), np.ones(7)])
REFUSED = {
    "momentum without duration": (
        ProblemError,
        lambda: BaseMotion(SERVICER, _PATH, momentum=Momentum(angular=(0.0, 0.0, 1.0))),
    ),
    "momentum of a spinning top": (
        ProblemError,
        lambda: BaseMotion(SERVICER, _PATH, momentum=Momentum(angular=(0.0, 0.0, 1e9)), duration=10.0),
    ),
    "tolerance of nothing": (ProblemError, lambda: BaseMotion(SERVICER, _PATH, tolerance=0.0)),
    "base_start no transform": (ProblemError, lambda: BaseMotion(SERVICER, _PATH, base_start=np.zeros((4, 4)))),
    "path of other joints": (RobotError, lambda: BaseMotion(SERVICER, Motion([np.zeros(6), np.ones(6)]))),
}


@pytest.mark.parametrize("case", REFUSED)
def test_base_motions_that_cannot_be_are_refused(case: str) -> None:
    error, call = REFUSED[case]
    assert_refused("momentum", case, error, call)


@pytest.mark.parametrize("row", ROWS, ids=["least rotation", "elbow up"])
def test_the_built_in_servicer_is_the_oracles(row: tuple) -> None:
    robot, path = load_robot("servicer7"), Motion([np.zeros(7), row[0]])
    ours, known = (BaseMotion(each, path, base_start=base_at_mass_center(each, np.zeros(7))) for each in (robot, SERVICER))
    u = np.linspace(0, 1, 9)
    for found, expected in zip(ours.pose(u), known.pose(u), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
