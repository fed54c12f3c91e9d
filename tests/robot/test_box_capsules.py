"""Rows of capsules around a box: they hold it, and stand out as little as they say."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.robot.capsule_fit import box_capsules
from support.segments import point_segment_distance

ROUNDING = 1e-9  # share of the box's size
SIZES = st.tuples(*[st.floats(0.01, 10)] * 3)


def points_of(size: tuple[float, float, float], generator: np.random.Generator) -> np.ndarray:
    """Points of a box (k, 3): its corners, and others on its surface and inside."""
    inside = generator.uniform(-0.5, 0.5, (400, 3))
    surface = inside.copy()
    surface[np.arange(400), np.arange(400) % 3] = np.sign(inside[:, 0]) / 2
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return np.concatenate([corners, surface, inside]) * size


@given(SIZES, st.integers(1, 30))
def test_every_point_of_the_box_is_in_a_capsule(size: tuple[float, float, float], count: int) -> None:
    capsules = box_capsules(size, count)
    assert 1 <= len(capsules) <= count
    points = points_of(size, np.random.default_rng(0))
    depths = [c.radius - point_segment_distance(points, c.a, c.b) for c in capsules]
    assert np.max(depths, axis=0).min() >= -ROUNDING * max(size)


def box_excess(size: tuple[float, float, float], count: int) -> float:
    """Return by how much the capsules stand out of the box at most, along the normals of its faces [m]."""
    capsules = box_capsules(size, count)
    return max(float(np.max(np.abs(end) + c.radius - np.array(size) / 2)) for c in capsules for end in (c.a, c.b))


@given(SIZES, st.integers(1, 30))
def test_no_capsule_stands_out_further_than_along_the_normals_of_faces(size: tuple[float, float, float], count: int) -> None:
    generator = np.random.default_rng(1)
    directions = generator.normal(size=(2000, 3))
    directions = np.concatenate([np.eye(3), -np.eye(3), directions / np.linalg.norm(directions, axis=1)[:, None]])
    said, found = box_excess(size, count), 0.0
    for capsule in box_capsules(size, count):
        for end in (capsule.a, capsule.b):
            out = np.maximum(np.abs(end + capsule.radius * directions) - np.array(size) / 2, 0)
            found = max(found, float(np.linalg.norm(out, axis=1).max()))
    assert found == pytest.approx(said, rel=1e-9, abs=ROUNDING * max(size))


@given(SIZES)
def test_more_capsules_never_stand_out_further(size: tuple[float, float, float]) -> None:
    excesses = [box_excess(size, count) for count in range(1, 26)]
    assert all(b <= a for a, b in itertools.pairwise(excesses))


def test_a_panel_and_a_cube_by_hand() -> None:
    # 3 m in 9 rows of 1/3 m, 0.05 m to either side and as far from the ends: sqrt(1/6^2 + 2 x 0.05^2) - 0.05.
    assert box_excess((3.0, 6.2, 0.1), 9) == pytest.approx(np.sqrt(1 / 36 + 0.005) - 0.05)
    assert box_excess((2, 2, 2), 9) == pytest.approx((np.sqrt(3) - 1) / 3)
    assert len(box_capsules((2, 2, 2), 9)) == 9
    (ball,) = box_capsules((1, 1, 1), 1)
    assert ball.radius == pytest.approx(np.sqrt(3) / 2)
