"""Rotations: the same as SciPy's, and the two orders of operations agree."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spacearm.core.rotations import (
    angle,
    conjugate,
    exponential,
    matrix_by_parts,
    matrix_of,
    multiplied,
    product_by_parts,
    quaternion_of,
    rate_matrices,
    rotated,
    rotation_from_rpy,
    rotation_vectors,
    running_products,
    turns_between,
)

TOLERANCE = 1e-14  # some units in the last place of numbers up to 2
ANGLES = st.sampled_from([0.0, 1e-9, 1e-5, 0.3, 1.5, np.pi - 1e-9, np.pi])
SEEDS = st.integers(0, 2**32 - 1)


def drawn(seed: int, *shape: int) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def of(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q[..., [1, 2, 3, 0]].reshape(-1, 4))


@given(SEEDS, st.sampled_from([(), (1,), (3, 2)]))
def test_products_and_matrices_are_scipys_in_both_orders(seed: int, shape: tuple[int, ...]) -> None:
    p, q = drawn(seed, *shape), drawn(seed + 1, *shape)
    expected = (of(p) * of(q)).as_matrix().reshape(*shape, 3, 3)
    for product, matrix in ((multiplied, matrix_of), (product_by_parts, matrix_by_parts)):
        np.testing.assert_allclose(matrix(product(p, q)), expected, atol=TOLERANCE)
    np.testing.assert_allclose(product_by_parts(p, q), multiplied(p, q), atol=TOLERANCE)
    v = q[..., 1:]
    np.testing.assert_allclose(rotated(p, v), (matrix_of(p) @ v[..., None])[..., 0], atol=TOLERANCE)
    rate = np.concatenate([np.zeros_like(v[..., :1]), v], axis=-1)
    np.testing.assert_allclose((rate_matrices(v) @ p[..., None])[..., 0], multiplied(p, rate), atol=TOLERANCE)


@given(SEEDS, ANGLES)
def test_rotation_vectors_quaternions_and_matrices_are_inverse_to_each_other(seed: int, turn: float) -> None:
    axis = drawn(seed)[1:]
    vector = axis / np.linalg.norm(axis) * turn
    q = exponential(vector)
    np.testing.assert_allclose(matrix_of(q), Rotation.from_rotvec(vector).as_matrix(), atol=TOLERANCE)
    back = quaternion_of(matrix_of(q))
    assert back[0] >= 0
    np.testing.assert_allclose(matrix_of(back), matrix_of(q), atol=TOLERANCE)
    assert angle(multiplied(conjugate(q), back)) == pytest.approx(0, abs=1e-13)
    assert angle(q) == pytest.approx(turn, abs=1e-13)
    found = rotation_vectors(matrix_of(q)[None])[0]
    np.testing.assert_allclose(
        Rotation.from_rotvec(found).as_matrix(), matrix_of(q), atol=1e-7
    )  # near pi the axis has half the digits


@given(SEEDS, st.integers(1, 9))
def test_running_products_are_those_one_after_the_other(seed: int, count: int) -> None:
    turns = drawn(seed, count)
    for product in (multiplied, product_by_parts):
        expected = [turns[0]]
        for turn in turns[1:]:
            expected.append(product(expected[-1], turn))
        np.testing.assert_allclose(running_products(turns, product), expected, atol=TOLERANCE)


@given(st.tuples(*[st.floats(-7, 7)] * 3))
def test_roll_pitch_yaw_are_about_fixed_axes(rpy: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(rotation_from_rpy(rpy), Rotation.from_euler("xyz", rpy).as_matrix(), atol=TOLERANCE)


@given(SEEDS)
def test_the_least_turn_takes_one_direction_to_the_other(seed: int) -> None:
    a, b = (drawn(seed + k)[1:] for k in (0, 1))
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    for one in (a, b, -b):
        turn = turns_between(one[None], b)[0]
        np.testing.assert_allclose(Rotation.from_rotvec(turn).apply(one), b, atol=1e-12)
        assert np.linalg.norm(turn) == pytest.approx(np.arccos(np.clip(one @ b, -1, 1)), abs=1e-7)
