"""Arithmetic for what is recorded: right to the last digit or two, and the same bits from every build."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spacearm.core import exact
from spacearm.core.native import available_levels, load_level

RNG = np.random.default_rng(0)
ANGLES = np.concatenate([RNG.uniform(-10, 10, 500), RNG.uniform(-1e4, 1e4, 200), [0.0, 1e-300, -1e-9, math.pi, 1e-4]])
UP, ALONG = (RNG.normal(size=2000) * 10.0 ** RNG.uniform(-9, 3, 2000) for _ in range(2))
SIZES = np.concatenate([10.0 ** RNG.uniform(-300, 300, 2000), [0.0, 1.0, 8.0, 5e-324]])


def test_sines_and_cosines() -> None:
    sine, cosine = exact.sines(ANGLES)
    np.testing.assert_allclose(sine, np.sin(ANGLES), rtol=0, atol=2e-15)
    np.testing.assert_allclose(cosine, np.cos(ANGLES), rtol=0, atol=2e-15)


def test_angles() -> None:
    np.testing.assert_allclose(exact.angle_of(UP, ALONG), np.arctan2(UP, ALONG), rtol=1e-15, atol=1e-15)
    for y, x in ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1)):
        assert exact.angle_of(y, x) == pytest.approx(math.atan2(y, x), abs=5e-16)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_roots(degree: int) -> None:
    np.testing.assert_allclose(exact.root(SIZES, degree), SIZES ** (1 / degree) if degree != 3 else np.cbrt(SIZES), rtol=5e-16)


@pytest.mark.parametrize(
    "shapes", [((4, 3), (3, 5)), ((2, 4, 3), (3, 9)), ((2, 1, 4, 3), (6, 3, 1)), ((3,), (3, 2)), ((5, 3), (3,))]
)
def test_products(shapes: tuple[tuple[int, ...], tuple[int, ...]]) -> None:
    a, b = (RNG.normal(size=shape) for shape in shapes)
    found = exact.product(a, b)
    assert found.shape == (a @ b).shape
    np.testing.assert_allclose(found, a @ b, rtol=0, atol=1e-14)


def test_equations() -> None:
    A, b = RNG.normal(size=(20, 3, 3)), RNG.normal(size=(20, 3))
    np.testing.assert_allclose(np.einsum("pij,pj->pi", A, exact.solved3(A, b)), b, rtol=0, atol=1e-10)
    np.testing.assert_allclose(np.einsum("pij,pjk->pik", A, exact.inverse3(A)), np.eye(3)[None].repeat(20, 0), atol=1e-10)


def test_every_build_gives_the_same_bits() -> None:
    A = RNG.normal(size=(9, 6, 6))

    def bits(level: str) -> list[bytes]:
        module = load_level(level)
        arrays = [
            *module.sines(ANGLES),
            module.angles(UP, ALONG),
            module.cube_roots(SIZES),
            module.product(A, A),
        ]
        return [array.tobytes() for array in arrays]

    first, *others = map(bits, available_levels())
    assert all(other == first for other in others)


def test_single_numbers_have_the_bits_of_packs() -> None:
    for level in available_levels():
        for one, other in zip(load_level(level).sines(ANGLES), load_level(level).sincos64(ANGLES), strict=True):
            np.testing.assert_array_equal(one, other)
