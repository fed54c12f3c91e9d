"""Where the base gets to: by published numbers, by closed forms, and by brute force; and how far it gets on a interval."""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.dynamics import BASE_MODELS, Momentum
from spacearm.geometry import Scene
from spacearm.motion import Curve, Motion, PiecewisePath, Trajectory
from spacearm.proof.base_attitude import TOLERANCE, BaseAttitude
from spacearm.proof.base_momentum import _PlacedMasses, _rates, tree_of
from spacearm.proof.base_proofs import LOST, BaseSetup, FloatingBaseProof
from spacearm.proof.mechanism import JointMap, kinematics_of
from spacearm.proof.polynomial_bounds import RHO, PanelPath, ellipses_of, greatest_norm
from spacearm.robot import Robot
from support.floating_arms import Adrift, body, brute_force, floating_arms, frames_of, lander, momentum_map, wheel
from support.floating_checker import moving
from support.oracles.servicer import ROWS, servicer

BRUTE = 3e-8  # [rad] of the method of fourth order in 200 steps a piece
NONE = Momentum()


def setup_of(momentum: Momentum = NONE, start: np.ndarray | None = None) -> BaseSetup:
    start = np.eye(4) if start is None else start
    return BaseSetup(model=BASE_MODELS["floating"], start=start, linear=momentum.linear, angular=momentum.angular)


def attitude_of(robot: Robot, curve: Curve, momentum: Momentum = NONE, time_rate: float = 0.0) -> BaseAttitude:
    return BaseAttitude(robot, curve, start=np.eye(4), angular=momentum.angular * time_rate)


def angle_between(R: np.ndarray, S: np.ndarray) -> float:
    return float((np.linalg.norm(R - S, axis=(-2, -1)) / np.sqrt(2)).max())  # of small ones


# ---- the attitude ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("row", ROWS)
def test_the_servicer_turns_as_published(row: tuple[tuple[float, ...], ...]) -> None:
    joints, _, wxyz, degrees, _ = row
    found = attitude_of(servicer(), Motion([np.zeros(7), joints]))
    np.testing.assert_allclose(found._quaternions(np.ones(1))[0], wxyz, rtol=0, atol=1e-6)
    assert np.degrees(found.final()) == pytest.approx(degrees, abs=1e-4)
    assert found.error < TOLERANCE
    assert found.evaluations <= 200


@given(st.floats(-9, 9), st.floats(0.01, 50))
def test_a_flywheel_turns_the_base_back_by_its_share(turn: float, moment: float) -> None:
    found = attitude_of(wheel(moment), Motion([[0.0], [turn]]))
    u = np.linspace(0, 1, 7)
    angle = -turn * moment / (3 + moment) * (10 * u**3 - 15 * u**4 + 6 * u**5)
    expected = np.zeros((7, 3, 3))
    expected[:, 0, 0] = expected[:, 1, 1] = np.cos(angle)
    expected[:, 1, 0], expected[:, 0, 1], expected[:, 2, 2] = np.sin(angle), -np.sin(angle), 1.0
    assert angle_between(found.at(u), expected) <= found.error + 1e-14 <= 2 * TOLERANCE  # rounding is on top of it


@settings(max_examples=25)
@given(st.data())
def test_the_base_of_any_robot_goes_where_small_steps_take_it(data: st.DataObject) -> None:
    robot = data.draw(floating_arms())
    count = data.draw(st.integers(2, 4))
    q = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1))).uniform(-1.5, 1.5, (count, robot.dof))
    curve = data.draw(st.sampled_from([Motion, lambda rows: PiecewisePath.from_linear(np.arange(len(rows)), rows)]))(q)
    momentum = Momentum(angular=data.draw(st.sampled_from([(0, 0, 0), (0.1, -0.2, 0.3)])))
    time_rate = data.draw(st.sampled_from([0.0, 2.0]))
    found = attitude_of(robot, curve, momentum, time_rate)
    way = brute_force(Adrift(robot, Scene([]), momentum=momentum), curve, time_rate=time_rate, steps=600)
    allowed = BRUTE + found.error
    assert angle_between(found.at(way.u), way.T_w_b[:, :3, :3]) <= allowed
    assert found.error <= 10 * TOLERANCE


def test_a_path_of_many_pieces_is_followed_through_its_corners() -> None:
    rng = np.random.default_rng(0)
    robot = servicer()
    path = PiecewisePath.from_linear(np.arange(80) / 10, np.cumsum(rng.uniform(-0.05, 0.05, (80, 7)), axis=0))
    found = attitude_of(robot, path)
    way = brute_force(Adrift(robot, Scene([])), path, steps=4)
    assert angle_between(found.at(way.u), way.T_w_b[:, :3, :3]) < 1e-9
    assert found.error <= TOLERANCE
    assert found.evaluations <= 10 * 80


def test_many_turns_of_a_tumbling_base_are_followed() -> None:
    """A base with equal moments keeps its rate: 40 rad in 20 s."""
    ball = lander(bodies=(body("base", -1, 1.0, (0, 0, 0), 2.0),), capsules=())
    found = attitude_of(ball, Motion([[0, 0], [1, 1]]), Momentum(angular=(0, 4, 0)), 20.0)
    c, s = np.cos(40.0), np.sin(40.0)
    assert angle_between(found.at(np.ones(1)), np.array([[[c, 0, s], [0, 1, 0], [-s, 0, c]]])) <= found.error
    assert found.error < 1e-9


@pytest.mark.parametrize("axis", [(1.0, 0, 0), (0.3, 1.0, 0.2), (0, 0.05, 1.0)])
def test_errors_of_a_long_body_that_tumbles_grow_with_time_only(axis: tuple[float, float, float]) -> None:
    """Moments of 1, 11 and 11.3, and radians of tumbling: by the most that they could grow at any time it would be e^25."""
    stick = lander(
        bodies=(body("base", -1, 5.0, (0, 0, 0), (1.0, 11.0, 11.3)), body("fore", 1, 1.0, (0.5, 0, 0), 0.1)), capsules=()
    )
    momentum = Momentum(angular=11.0 * np.array(axis) / np.linalg.norm(axis) * 0.25)
    path = Motion([[0, 0], [1, -1]])
    found = attitude_of(stick, path, momentum, 20.0)
    assert found.error < 1e-7
    way = brute_force(Adrift(stick, Scene([]), momentum=momentum), path, time_rate=20.0, steps=2500)
    assert angle_between(found.at(way.u), way.T_w_b[:, :3, :3]) <= found.error + 1e-6


# ---- nothing hides between the points ----------------------------------------------------------------------------------


def blind(points: int, turn: float, count: int = 3) -> PiecewisePath:
    """A flywheel's path whose rate has double zeros in all Gauss points of each piece, and at its ends."""
    gauss = np.polynomial.legendre.leggauss(points)[0]
    rate = np.polynomial.Polynomial.fromroots(np.repeat(np.concatenate([[-1.0, 1.0], gauss]), 2))
    way = rate.integ(lbnd=-1)(np.polynomial.Polynomial([-1.0, 2.0])).coef  # powers of x in [0, 1]
    degree = len(way) - 1
    share = np.array([sum(comb(k, i) / comb(degree, i) * way[i] for i in range(k + 1)) for k in range(degree + 1)])
    share = (share / share[-1] * turn / count)[:, None]
    return PiecewisePath(np.arange(count + 1), [share - share[0] + share[-1] * k for k in range(count)])


@pytest.mark.parametrize("points", [3, 5, 6, 8, 12])
def test_a_rate_that_vanishes_in_gauss_points_turns_the_base_all_the_same(points: int) -> None:
    path = blind(points, 1.3)
    found = attitude_of(wheel(), path)
    u = np.linspace(0, 3, 601)
    angle = -path.sample(u)[:, 0] / 4
    expected = np.tile(np.eye(3), (601, 1, 1))
    expected[:, 0, 0] = expected[:, 1, 1] = np.cos(angle)
    expected[:, 1, 0], expected[:, 0, 1] = np.sin(angle), -np.sin(angle)
    assert angle_between(found.at(u), expected) <= found.error < 1e-8
    assert found.peak() == pytest.approx(np.abs(path.sample(np.linspace(0, 3, 20_001))).max() / 4, rel=1e-5)
    assert found.rate() >= np.abs(path.sample(u, 1)).max() / 4


@settings(max_examples=25)
@given(st.data())
def test_peak_rate_and_momentum_are_never_greater_than_said_and_hardly_less(data: st.DataObject) -> None:
    robot = data.draw(floating_arms())
    q = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1))).uniform(
        -1.5, 1.5, (data.draw(st.integers(2, 4)), robot.dof)
    )
    made: Any = Motion(q) if data.draw(st.booleans()) else PiecewisePath.from_cubic(np.arange(len(q)), q)
    momentum, time_rate = Momentum(angular=data.draw(st.sampled_from([(0, 0, 0), (0.1, -0.2, 0.3)]))), 2.0
    found = attitude_of(robot, made, momentum, time_rate)
    u = np.linspace(*made.domain, 20_001)
    turned = found.at(u)
    _, H_w, H_q = momentum_map(robot, made.sample(u))
    carried = (H_q @ made.sample(u, 1)[..., None])[..., 0]
    local = np.swapaxes(turned, 1, 2) @ momentum.angular * time_rate
    reached = (
        2 * np.arcsin(np.minimum(1, np.linalg.norm(turned - turned[0], axis=(1, 2)) / np.sqrt(8))).max(),
        np.linalg.norm(np.linalg.solve(H_w, (local - carried)[..., None])[..., 0], axis=1).max(),
        np.linalg.norm(carried, axis=1).max(),
    )
    for most, said in zip(reached, (found.peak(), found.rate(), found.joint_momentum()), strict=True):
        assert most <= said * (1 + 1e-9) + 1e-12
        assert said <= most * (1 + 1e-4) + 3 * found.error + 1e-7  # half of a sample's step is 5e-5 of the path


@settings(max_examples=25)
@given(st.data())
def test_momentum_at_complex_joint_values_is_within_its_bounds(data: st.DataObject) -> None:
    robot = data.draw(floating_arms())
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    coefficients = rng.normal(size=(1, data.draw(st.integers(2, 7)), robot.dof)) * data.draw(st.sampled_from([0.05, 0.5]))
    path = PiecewisePath([0.0, 2.0], coefficients)
    panel = PanelPath.of(path, JointMap(robot))
    growth = ellipses_of(robot).growth(panel)
    for i, rho in enumerate(RHO):
        if not growth.inertia[0, i] < 1e60:
            break  # and further out it is no less
        at = rho * np.exp(2j * np.pi * np.arange(24) / 24)
        xi = (at + 1 / at) / 2
        x, degree = (1 + xi)[:, None] / 2, coefficients.shape[1] - 1
        k = np.arange(degree + 1)
        rows = np.array([comb(degree, i) for i in k]) * x**k * (1 - x) ** (degree - k)
        lower, c = k[:-1], np.array([comb(degree - 1, i) for i in k[:-1]])
        slopes = c * x**lower * (1 - x) ** (degree - 1 - lower) * degree / 2
        found = moving(robot, rows @ coefficients[0], slopes @ np.diff(coefficients[0], axis=0))
        assert (np.linalg.norm(found.H, ord=2, axis=(1, 2)) <= growth.inertia[0, i] * (1 + 1e-9)).all()
        assert (np.linalg.norm(found.carried, axis=1) <= growth.carried[0, i] * (1 + 1e-9)).all()


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 3))
def test_the_greatest_norm_of_a_polynomial_is_bounded_closely(seed: int, count: int, panels: int) -> None:
    rng = np.random.default_rng(seed)
    c = rng.normal(size=(panels, count, 3)) * 0.7 ** np.arange(count)[:, None]
    scale, extra = rng.uniform(0.5, 2, panels), rng.uniform(0, 0.1, panels)
    xi = np.cos(np.linspace(0, np.pi, 20_001))
    values = np.polynomial.chebyshev.chebvander(xi, count - 1) @ c
    reached = (scale[:, None] * np.linalg.norm(values, axis=2) + extra[:, None]).max()
    assert reached <= greatest_norm(c, scale, extra) <= reached * (1 + 1e-5)


def test_a_path_that_cannot_be_followed_is_said_to_be_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm goes to and fro a thousand turns in a piece: no number of panels that there may be will do."""
    monkeypatch.setattr("spacearm.proof.base_attitude._MOST_EVALUATIONS", 20_000)
    found = attitude_of(lander(), PiecewisePath([0, 1], [np.outer((-1.0) ** np.arange(40), [1e5, 1e5])]))
    assert found.error > LOST


# ---- how its rate changes --------------------------------------------------------------------------------------------


@settings(max_examples=25)
@given(floating_arms(), st.integers(0, 2**32 - 1))
def test_the_rates_and_their_derivatives_are_those_of_the_momentum_form(robot: Robot, seed: int) -> None:
    robot = Robot(**{**{n: getattr(robot, n) for n in robot.__dataclass_fields__}})
    q = np.random.default_rng(seed).uniform(-2, 2, (3, robot.dof))
    kinematics, joints = kinematics_of(robot), JointMap(robot)
    scale = np.zeros((len(robot.joints), robot.dof))
    scale[np.arange(len(robot.joints)), joints.dof] = joints.multiplier

    def rates(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        W, D = _rates(tree_of(robot), _PlacedMasses(tree_of(robot), kinematics.frames(joints.values(q))))
        return W, np.moveaxis(D.reshape(len(q), 3, len(robot.joints), -1), 1, -1)

    def of_oracle(q: np.ndarray) -> np.ndarray:
        _, H_w, H_q = momentum_map(robot, q)
        return -np.swapaxes(np.linalg.solve(H_w, H_q), 1, 2)

    W, D = rates(q)
    np.testing.assert_allclose(np.einsum("jn,rjc->rnc", scale, W), of_oracle(q), atol=1e-9 * max(1.0, np.abs(W).max()))
    slopes = np.einsum("kn,im,rkic->rnmc", scale, scale, D)
    h = 1e-5
    for m in range(robot.dof):
        step = h * np.eye(robot.dof)[m]
        expected = (of_oracle(q + step) - of_oracle(q - step)) / (2 * h)
        np.testing.assert_allclose(slopes[:, :, m], expected, atol=1e-6 * max(1.0, np.abs(D).max()))


def test_frames_of_the_brute_force_are_the_proofs() -> None:
    """Guards the other tests: both say where every joint is."""
    robot, curve = lander(), Motion([[0, 0], [1, -2]])
    base = FloatingBaseProof(robot, Trajectory(robot, curve), setup_of())
    kinematics, joints = kinematics_of(robot), JointMap(robot)
    base.begin()
    way = brute_force(Adrift(robot, Scene([])), curve)
    mine = base.placed(way.u, kinematics.frames(joints.values(way.q)))
    np.testing.assert_allclose(mine, frames_of(robot, way.q, way.T_w_b), atol=1e-9)
