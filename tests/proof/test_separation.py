"""Planes between bodies and solids: true for any direction, and as good as Coal's distance for the proposed one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import HalfSpace, Obstacle, Scene, Sphere, SphereSet
from spacearm.proof.bodies import bodies_of
from spacearm.proof.separation import (
    GUARD,
    ClearanceBounds,
    OpenPairs,
    clearance_bounds,
    link_pairs,
    obstacle_groups,
    out_of_cells,
    shape_pairs,
)
from spacearm.proof.solids import Balls, Solids, cells_of, solids_of
from spacearm.robot import LinkCapsule, Robot
from support import strategies
from support.bounded_paths import bounded, line
from support.dense_samples import planar
from support.drawn_shapes import bodies, directions, obstacles, points_in
from support.oracles.coal_shapes import distance, placed_capsule, placed_obstacle

COALS = 1e-7  # [m] tolerance of Coal where it has no closed form


def resting(a: np.ndarray, b: np.ndarray, radius: float) -> Robot:
    """An arm whose only capsule is bolted to the base."""
    return planar(capsules=(LinkCapsule(name="bolted", joint=-1, a=a, b=b, radius=radius),))


def looked(robot: Robot, obstacle: Obstacle, n: np.ndarray | None = None) -> ClearanceBounds:
    """The gaps of the robot's capsules and an obstacle's solids, at rest."""
    body, relative_bodies = bodies_of(robot)
    midpoints, _ = bounded(robot, line((0, 0), (0, 0)))
    (solids,) = solids_of(Scene([obstacle]))
    count = len(solids.radius)
    pairs = OpenPairs(np.zeros(count, np.intp), np.ones(count, np.intp), np.arange(count))
    directed = None if n is None else np.tile(n, (count, 1))
    return clearance_bounds(midpoints, body, relative_bodies, pairs, solids, enough=np.inf, n=directed)


@settings(max_examples=30)
@given(strategies.points(2.0), strategies.points(2.0), st.booleans(), st.sampled_from([0.0, 0.05]), obstacles())
def test_what_is_proven_is_less_than_coals_distance_and_a_balls_gap_is_it(
    a: np.ndarray, b: np.ndarray, ball: bool, radius: float, obstacle: Obstacle
) -> None:
    b = a if ball else b
    known = looked(resting(a, b, radius), obstacle)
    link = placed_capsule(a, b, radius)
    true = min(distance(link, solid) for solid in placed_obstacle(obstacle))
    if true > 0:
        assert known.on_interval.min() <= true + COALS
        assert known.at_most.min() >= true - COALS
        assert (known.on_interval <= known.at_most).all()
    if np.array_equal(a, b) and true > 1e-6:
        assert known.on_interval.min() == pytest.approx(true, abs=1e-8)
        assert known.at_most.min() == pytest.approx(true, abs=1e-8)


@settings(max_examples=30)
@given(strategies.points(2.0), strategies.points(2.0), obstacles(), directions())
def test_no_direction_proves_more_than_there_is(a: np.ndarray, b: np.ndarray, obstacle: Obstacle, n: np.ndarray) -> None:
    known = looked(resting(a, b, 0.05), obstacle, n / np.linalg.norm(n))
    link = placed_capsule(a, b, 0.05)
    true = min(distance(link, solid) for solid in placed_obstacle(obstacle))
    assert known.on_interval.min() <= max(0.0, true) + COALS


@settings(max_examples=25)
@given(strategies.points(2.0), strategies.points(2.0), obstacles(), directions(), st.floats(-300, 300))
def test_a_direction_of_any_length_proves_no_more_than_that_of_length_1(
    a: np.ndarray, b: np.ndarray, obstacle: Obstacle, n: np.ndarray, size: float
) -> None:
    robot, n = resting(a, b, 0.05), n / np.linalg.norm(n)
    known, scaled = looked(robot, obstacle, n), looked(robot, obstacle, n * 10.0**size)
    # Rounding may take either off the one direction that proves anything of a half-space.
    lost = isinstance(obstacle, HalfSpace) & (np.isneginf(scaled.on_interval) | np.isneginf(known.on_interval))
    np.testing.assert_allclose(scaled.on_interval[~lost], known.on_interval[~lost], rtol=0, atol=1e-12)
    np.testing.assert_allclose(scaled.at_midpoint[~lost], known.at_midpoint[~lost], rtol=0, atol=1e-12)


@pytest.mark.parametrize("n", [(0, 0, 0), (np.nan, 0, 1), (np.inf, 0, 0), (np.inf, np.nan, -np.inf)])
def test_what_is_no_direction_proves_nothing(n: tuple[float, ...]) -> None:
    known = looked(resting(np.zeros(3), np.zeros(3), 0.05), Sphere((1, 0, 0), 0.1), np.array(n, dtype=float))
    assert known.on_interval[0] == -np.inf


@given(bodies(), directions(), st.integers(0, 2**32 - 1))
def test_the_support_is_that_of_the_furthest_point(obstacle: Obstacle, n: np.ndarray, seed: int) -> None:
    n = n / np.linalg.norm(n)
    (solids,) = solids_of(Scene([obstacle]))
    every = np.arange(len(solids.radius))
    axes, origin = solids.placed(every)
    local = np.tile(n, (len(every), 1)) if axes is None else n @ axes
    extent = (origin @ n + solids.support(every, local) + solids.radius).max()
    points = points_in(obstacle, 4000, np.random.default_rng(seed))
    size = np.ptp(points, axis=0).max()
    assert (points @ n).max() <= extent + 1e-12
    assert (points @ n).max() >= extent - 0.2 * size


@given(bodies(), strategies.points(2.0), st.integers(0, 2**32 - 1))
def test_no_point_of_a_solid_is_nearer_than_the_nearest(obstacle: Obstacle, x: np.ndarray, seed: int) -> None:
    (solids,) = solids_of(Scene([obstacle]))
    every = np.arange(len(solids.radius))
    axes, origin = solids.placed(every)
    local = x - origin if axes is None else np.einsum("kc,kcd->kd", x - origin, axes)
    gap = (np.linalg.norm(local - solids.nearest(every, local), axis=1) - solids.radius).min()
    points = points_in(obstacle, 2000, np.random.default_rng(seed))
    assert np.linalg.norm(points - x, axis=1).min() >= gap - 1e-12


def test_a_half_space_is_bounded_along_its_normal_only() -> None:
    (plane,) = solids_of(Scene([HalfSpace((0.6, 0, 0.8), (1, 2, 3))]))
    n = np.array([[0, 0, 1.0], [1e-9, 0, 1], [0, 0, -1], [0, 1, 0]])
    assert plane.support(np.zeros(4, np.intp), n).tolist() == [0, np.inf, np.inf, np.inf]


def test_inside_of_a_solid_nothing_is_proven() -> None:
    known = looked(resting(np.zeros(3), np.zeros(3), 0.0), Sphere((0, 0, 0), 0.5))
    assert known.on_interval[0] == -np.inf
    assert known.at_most[0] == -0.5


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-10, GUARD / 2])
def test_the_guard_outweighs_rounding(gap: float) -> None:
    """Far from the origin too, where a coordinate's last digit is coarser."""
    for far in (0.0, 1e3, 1e6):
        at = np.array([far, 0.3, 0.7])
        known = looked(resting(at, at, 0.1), Sphere(at + np.array([0, 0, 0.3 + gap]), 0.2))
        assert known.on_interval[0] <= 0
        assert known.on_interval[0] >= -1e-5 * max(1, far / 1e6)
    apart = looked(resting(at, at, 0.1), Sphere(at + np.array([0, 0, 0.3 + 1e-8]), 0.2))
    assert apart.on_interval[0] <= 0  # at 1,000 km no 10 nm are told apart


def test_links_are_solids_where_they_are() -> None:
    robot = planar(self_pairs=(("upper", "fore"),))
    body, relative_bodies = bodies_of(robot)
    midpoints, _ = bounded(robot, line((0.3, 2.5), (0.3, 2.5)))
    solids = midpoints.solids(0)
    relative = relative_bodies.self_relative[0] + 1  # the capsule in the first family
    pairs = OpenPairs(np.zeros(1, np.intp), np.array([relative]), np.array([0]))
    known = clearance_bounds(midpoints, body, relative_bodies, pairs, solids, enough=np.inf)
    assert known.at_most[0] == pytest.approx(-0.1)  # they meet in the elbow


# ---- cells -----------------------------------------------------------------------------------------------------------


def scattered(count: int) -> Solids:
    rng = np.random.default_rng(count)
    return solids_of(Scene([SphereSet(rng.normal(size=(count, 3)), rng.uniform(0.01, 0.3, count))]))[0]


@pytest.mark.parametrize("count", [65, 100, 128, 1000, 1003])
def test_cells_enclose_their_balls_and_leave_none_out(count: int) -> None:
    balls = scattered(count)
    assert isinstance(balls, Balls)
    cells = cells_of(balls)
    assert cells is not None
    pairs = out_of_cells(cells, OpenPairs(*(np.arange(len(cells.radius)),) * 3))
    assert sorted(pairs.solid.tolist()) == list(range(count))
    far = np.linalg.norm(balls.center[pairs.solid] - cells.center[pairs.interval], axis=1) + balls.radius[pairs.solid]
    assert (far <= cells.radius[pairs.interval]).all()
    assert cells.radius.mean() < 2.5  # of a cloud about 4 m wide: neighbours are together


def test_few_balls_need_no_cells() -> None:
    balls = scattered(64)
    assert isinstance(balls, Balls)
    assert cells_of(balls) is None


def test_every_capsule_meets_every_solid_and_every_named_capsule() -> None:
    robot = planar(
        capsules=tuple(
            LinkCapsule(name=name, joint=joint, a=np.zeros(3), b=np.array([0.5, 0, 0]), radius=0.05)
            for joint, name in ((0, "a"), (1, "b"), (1, "b"), (0, "a"), (-1, "c"))
        ),
        self_pairs=(("a", "b"), ("b", "c")),
    )
    body, relative_bodies = bodies_of(robot)
    groups = obstacle_groups(
        Scene([Sphere((0, 0, 5), 1), Sphere((0, 0, -5), 1), HalfSpace((0, 0, 1), (0, 0, -9))]), relative_bodies
    )
    assert len(groups) == 3
    for group, expected in zip(groups[:2], (2, 1), strict=True):
        pairs = shape_pairs(group, body, relative_bodies, link_pairs(group, relative_bodies, 2))
        found = sorted(zip(pairs.interval, relative_bodies.body[pairs.relative], pairs.solid, strict=True))
        assert found == [(i, c, k) for i in range(2) for c in range(5) for k in range(expected)]
    pairs = shape_pairs(groups[2], body, relative_bodies, link_pairs(groups[2], relative_bodies, 1))
    met = {frozenset((int(relative_bodies.body[r]), int(s))) for r, s in zip(pairs.relative, pairs.solid, strict=True)}
    assert met == {frozenset(pair) for pair in [(0, 1), (0, 2), (3, 1), (3, 2), (1, 4), (2, 4)]}
    assert len(pairs.relative) == len(met)
