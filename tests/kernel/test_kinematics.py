"""The kernel's kinematics against Pinocchio, its sine and cosine against NumPy's extended precision."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import accuracy, drawn
from kernel.builds import Build, place
from spacearm.robot import Frame, Joint, Robot, load_robot
from spacearm.robot.model import JOINT_KINDS
from support.oracles import pinocchio_points

RIDERS = st.lists(st.tuples(st.integers(-1, 12), drawn.points()), max_size=4)


def layouts(q: np.ndarray) -> dict[str, np.ndarray]:
    """The same values, arranged in memory in all the ways that callers do."""
    rows, columns = q.shape
    wide = np.full((2 * rows, 3 * columns), np.nan, dtype=q.dtype)
    wide[::2, ::3] = q
    backwards = np.ascontiguousarray(q[::-1, ::-1])
    return {
        "rows": np.ascontiguousarray(q),
        "columns": np.asfortranarray(q),
        "strided": wide[::2, ::3],
        "backwards": backwards[::-1, ::-1],
    }


@settings(max_examples=10)
@given(st.data())
def test_frames_and_points_are_where_pinocchio_puts_them(build: Build, data: st.DataObject) -> None:
    robot = data.draw(drawn.robots())
    rows = data.draw(st.sampled_from([1, build.lanes - 1, build.lanes, build.lanes + 1, 33]))
    q = data.draw(drawn.batches(robot, build, rows))
    riders = [(min(joint, len(robot.joints) - 1), local) for joint, local in data.draw(RIDERS)]
    model = place(build, robot, points=riders)
    frames = pinocchio_points.joint_frames(robot, q)
    error = accuracy.placement_error(build, robot, q)
    order = data.draw(st.sampled_from(["rows", "columns", "strided", "backwards"]))
    found = model.native.joint_frames(layouts(q)[order])
    assert found.shape == (rows, len(robot.joints), 4, 4)
    np.testing.assert_allclose(found, frames, rtol=0, atol=error)
    np.testing.assert_array_equal(found[..., 3, :], np.broadcast_to([0, 0, 0, 1], found[..., 3, :].shape))
    np.testing.assert_allclose(
        model.native.points(layouts(q)[order]),
        pinocchio_points.points(frames, model.points),
        rtol=0,
        atol=error,
    )


RIGHT_ANGLED = [
    np.eye(3)[list(order)] * signs
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(np.eye(3)[list(order)] * signs) > 0
]


@pytest.mark.parametrize("kind", JOINT_KINDS)
def test_what_a_single_point_needs_is_computed(build: Build, kind: str) -> None:
    """Columns of a frame that nothing asks for are left out: here one point alone asks, through two joints."""
    q = build.array([[0.7, -0.4], [2.0, 1.0]])
    for R, local in product(RIGHT_ANGLED, np.vstack([np.zeros(3), np.eye(3)])):
        T_first_second = np.eye(4)
        T_first_second[:3, :3] = R
        robot = Robot(
            name="two",
            joints=(
                Joint(name="first", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
                Joint(name="second", kind=kind, parent=0, T_parent_joint=T_first_second),
            ),
            frames=(Frame(name="tip", joint=1, T_joint_frame=np.eye(4)),),
            tip="tip",
            lower=np.full(2, -3.0),
            upper=np.full(2, 3.0),
            velocity=np.ones(2),
            acceleration=np.ones(2),
        )
        model = place(build, robot, points=[(1, local)])
        expected = pinocchio_points.points(pinocchio_points.joint_frames(robot, q), model.points)
        error = accuracy.placement_error(build, robot, q)
        np.testing.assert_allclose(model.native.points(q), expected, rtol=0, atol=error)


def test_memory_order_and_batch_size_do_not_change_a_bit(build: Build) -> None:
    robot = load_robot("zhang2022")
    model = place(build, robot, points=[(6, (0.1, 0.2, 0.3))]).native
    q = build.array(np.random.default_rng(0).uniform(-3, 3, (33, robot.dof)))
    frames, placed = model.joint_frames(q), model.points(q)
    for rows in (1, build.lanes - 1, build.lanes, build.lanes + 1, 33):
        for order in layouts(q[:rows]).values():
            np.testing.assert_array_equal(model.joint_frames(order), frames[:rows])
            np.testing.assert_array_equal(model.points(order), placed[:rows])


def test_no_configurations_have_no_frames(build: Build) -> None:
    robot = load_robot("zhang2022")
    model = place(build, robot, points=[(0, (1, 2, 3))]).native
    none = build.array(np.zeros((0, robot.dof)))
    assert model.joint_frames(none).shape == (0, 7, 4, 4)
    assert model.points(none).shape[::2] == (0, 3)


def test_a_rotation_stays_one(build: Build) -> None:
    robot = load_robot("zhang2022")
    q = build.array(np.random.default_rng(1).uniform(-50, 50, (200, robot.dof)))
    R = place(build, robot).native.joint_frames(q)[..., :3, :3].astype(np.float64)
    allowed = 10 * len(robot.joints) * accuracy.SINCOS_ERROR[build.bits]
    np.testing.assert_allclose(R @ R.swapaxes(-1, -2), np.broadcast_to(np.eye(3), R.shape), rtol=0, atol=allowed)


# ---- sine and cosine ------------------------------------------------------------------------------------------------


def angles(build: Build, largest: float) -> np.ndarray:
    """Even, random and awkward angles up to +- largest: neighbours of the multiples of quarter turns, and tiny ones."""
    rng = np.random.default_rng(2)
    quarters = np.unique(np.round(np.linspace(1, largest / (np.pi / 2), 4000))) * (np.pi / 2)
    quarters = build.array(quarters[quarters < largest])
    awkward = [
        quarters,
        np.nextafter(quarters, build.scalar(0)),
        np.nextafter(quarters, build.scalar(np.inf)),
        build.array(np.logspace(-30, 0, 500)),
        build.array([0.0]),
    ]
    even = build.array(np.linspace(0, min(largest, 4 * np.pi), 20_000))
    random = build.array(rng.uniform(0, largest, 20_000))
    positive = np.concatenate([even, random, *awkward])
    return np.concatenate([positive, -positive])


@pytest.mark.parametrize("turns", ["near", "far"])
def test_sine_and_cosine_are_within_their_bound(build: Build, turns: str) -> None:
    bounds = accuracy.SINCOS_ERROR if turns == "near" else accuracy.SINCOS_ERROR_FAR
    x = angles(build, 1e4 if turns == "near" else 1e5)
    sine, cosine = build.named("sincos")(x)
    exact = x.astype(np.longdouble)
    assert float(np.abs(sine - np.sin(exact)).max()) <= bounds[build.bits]
    assert float(np.abs(cosine - np.cos(exact)).max()) <= bounds[build.bits]


def test_small_angles_keep_their_relative_accuracy(build: Build) -> None:
    x = build.array(np.logspace(-30, -2, 2000))
    sine, cosine = build.named("sincos")(x)
    eps = np.finfo(build.scalar).eps
    np.testing.assert_allclose(sine, np.sin(x.astype(np.longdouble)), rtol=2 * eps, atol=0)
    np.testing.assert_allclose(cosine, np.cos(x.astype(np.longdouble)), rtol=2 * eps, atol=0)


def test_sine_is_odd_and_cosine_is_even(build: Build) -> None:
    x = angles(build, 1e5)
    sine, cosine = build.named("sincos")(x)
    mirrored_sine, mirrored_cosine = build.named("sincos")(-x)
    np.testing.assert_array_equal(mirrored_sine, -sine)
    np.testing.assert_array_equal(mirrored_cosine, cosine)


@pytest.mark.parametrize("x", [np.inf, -np.inf, np.nan])
def test_what_is_no_angle_has_no_sine(build: Build, x: float) -> None:
    sine, cosine = build.named("sincos")(build.array([x]))
    assert np.isnan(sine).all()
    assert np.isnan(cosine).all()
