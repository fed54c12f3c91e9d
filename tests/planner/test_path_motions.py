"""From paths to motions: paths are shortened, free ones become motions, whatever their corners; many control points."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from kernel import objectives
from kernel.builds import BUILDS, LEVELS, Build
from spacearm import Problem, Trajectory, certify
from spacearm.core.native import available_levels
from spacearm.geometry import Scene, Sphere
from spacearm.motion import Motion
from support.kernel_cases import TERMS, by_scipy, clamped_quintic, looked_at
from support.small_robots import CARRIAGE_RADIUS, slider

MARGIN, GAP = 2e-3, 1e-3  # [m] that the search asks for, and what a path has beyond it
MANY = (25, 40, 101, 300)  # of interior control points, more than there are tables for


@pytest.fixture(scope="module", params=[build for build in BUILDS if build.level == available_levels()[0]], ids=str)
def build(request: pytest.FixtureRequest) -> Build:
    """The fastest level, in both scalars."""
    return request.param


def to_path(points: np.ndarray, path: np.ndarray) -> np.ndarray:
    """The distances (m,) of points (m, 2) from a path's segments."""
    a, b = path[:-1], path[1:]
    along = b - a
    share = ((points[:, None] - a) * along).sum(axis=2) / np.maximum((along**2).sum(axis=1), 1e-12)
    nearest = a + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def slot(path: np.ndarray, rng: np.random.Generator, count: int, gap: float = GAP) -> list[Sphere]:
    """Balls on all sides of a path, which leave the carriage just so much room on it."""
    centers = rng.uniform(-3, 3, (count, 2))
    radii = to_path(centers, path) - CARRIAGE_RADIUS - MARGIN - gap
    return [Sphere((c[0], 0.0, c[1]), r) for c, r in zip(centers, radii, strict=True) if r > 0.01]


def search_along(build: Build, path: np.ndarray, balls: list[Sphere], **options: Any) -> Any:
    return objectives.motion_search(build, slider(), balls, path[0], path[-1:], margin=MARGIN, **options)


def spline_of(path: np.ndarray, points: np.ndarray) -> BSpline:
    """SciPy's spline with these interior control points."""
    rows = np.vstack([np.repeat(path[:1], 3, axis=0), points, np.repeat(path[-1:], 3, axis=0)])
    return BSpline(clamped_quintic(len(points)), rows, 5)


def clearances(q: np.ndarray, balls: list[Sphere]) -> np.ndarray:
    return np.min([np.linalg.norm(q - b.center[[0, 2]], axis=1) - b.radius - CARRIAGE_RADIUS for b in balls], axis=0)


# ---- from a path to a motion -----------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(st.integers(3, 10), st.integers(0, 10**6), st.sampled_from([5, 40, 300]), st.sampled_from([1e-3, 1e-5]))
def test_a_free_path_becomes_a_free_motion(build: Build, corners: int, seed: int, count: int, gap: float) -> None:
    rng = np.random.default_rng(seed)
    path = rng.uniform(-2.5, 2.5, (corners, 2))
    balls = slot(path, rng, count, gap)
    search = search_along(build, path, balls)
    found = search.blend_corners(build.array(path), 0)
    assert (found.outcome, found.edge) == ("free", -1)
    points = found.points.astype(np.float64)
    judged = search.judge(build.array(points.reshape(1, -1)), len(points), 0)
    assert judged.free[0]
    q = spline_of(path, points)(np.linspace(0, 1, 2000))
    # It keeps to the path but for its corners, and these it cuts by less than half of their edges.
    edges = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert to_path(q, path).max() <= 0.5 * edges.max()
    if balls:
        assert clearances(q, balls).min() > -0.05  # between the instants it may dip a little
    again = search.blend_corners(build.array(path), 0)
    np.testing.assert_array_equal(again.points, found.points)


def test_a_motion_that_may_cut_no_corner_is_the_path(build: Build) -> None:
    """Balls all around the path, and one in the inside of every corner, which the path just touches."""
    path = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0], [-2.0, -1.2], [1.0, -1.2]])
    balls = slot(path, np.random.default_rng(1), 2000, gap=1e-6)
    for i in range(1, len(path) - 1):
        inward = sum((path[k] - path[i]) / np.linalg.norm(path[k] - path[i]) for k in (i - 1, i + 1))
        center = path[i] + inward * (0.1 + CARRIAGE_RADIUS + MARGIN + 1e-6)
        balls.append(Sphere((center[0], 0.0, center[1]), 0.1))
    found = search_along(build, path, balls).blend_corners(build.array(path), 0)
    assert found.outcome == "free"
    q = spline_of(path, found.points.astype(np.float64))(np.linspace(0, 1, 5000))
    assert to_path(q, path).max() < 0.02
    # Every corner is reached, and rounded: the motion does not stop there.
    assert all(np.linalg.norm(q - corner, axis=1).min() < 0.02 for corner in path[1:-1])


def test_few_corners_in_free_space_take_few_control_points(build: Build) -> None:
    path = np.array([[-2.0, 0.0], [0.0, 1.0], [2.0, 0.0]])
    found = search_along(build, path, []).blend_corners(build.array(path), 0)
    assert (found.outcome, len(found.points), found.looks) == ("free", 1, 1)


@pytest.mark.parametrize("edge", [0, 1, 2])
def test_a_path_that_is_not_free_names_the_edge(build: Build, edge: int) -> None:
    path = np.array([[-2.0, -2.0], [-1.0, 2.0], [1.0, -2.0], [2.0, 2.0]])
    middle = (path[edge] + path[edge + 1]) / 2
    ball = Sphere((middle[0], 0.0, middle[1]), 0.2)
    around = slot(path, np.random.default_rng(2), 2000)
    found = search_along(build, path, [ball, *around]).blend_corners(build.array(path), 0)
    assert (found.outcome, found.edge) == ("blocked", edge)
    at = found.at.astype(np.float64)
    assert to_path(at[None], path[edge : edge + 2])[0] < 1e-4
    assert clearances(at[None], [ball])[0] < MARGIN


def test_a_path_with_too_many_corners_is_told(build: Build) -> None:
    rng = np.random.default_rng(0)
    found = search_along(build, np.linspace(-2, 2, 600)[:, None] + rng.normal(size=(600, 2)) * 0.01, []).blend_corners(
        build.array(np.linspace(-2, 2, 600)[:, None] + np.zeros((600, 2))), 0
    )
    assert found.outcome == "unfinished"


def test_the_motion_of_a_long_path_is_proven(build: Build) -> None:
    """Many corners and little room: the certificate holds as it does for any motion, and takes no longer for its length."""
    rng = np.random.default_rng(5)
    path = np.array([[-2.4 + 0.6 * i, 1.5 * (-1) ** i] for i in range(9)])
    balls = slot(path, rng, 150, gap=0.02)
    found = search_along(build, path, balls).blend_corners(build.array(path), 0)
    assert found.outcome == "free"
    assert len(found.points) > 10
    robot = slider()
    motion = Motion(np.vstack([path[0], found.points.astype(np.float64), path[-1]]))
    problem = Problem(robot, Scene(balls), start=path[0], goal=path[-1])
    certificate = certify(problem, Trajectory(robot, motion))
    assert certificate.status == "holds"
    assert certificate.evaluations < 3000


# ---- shorter paths ---------------------------------------------------------------------------------------------------


def length_of(path: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def even(path: np.ndarray, count: int = 400) -> np.ndarray:
    """Configurations on all edges of a path."""
    share = np.linspace(0, 1, count)[:, None]
    return np.concatenate([a + (b - a) * share for a, b in pairwise(path)])


BETWEEN = (1 / 32) ** 2 / (2 * CARRIAGE_RADIUS)
"""[m] How deep two balls get into each other between two instants that are 1/16 m apart, at most."""


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 10), st.integers(0, 10**6), st.sampled_from([0, 20, 300]))
def test_a_path_becomes_no_longer_keeps_its_ends_and_stays_free(build: Build, corners: int, seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    path = rng.uniform(-2.5, 2.5, (corners, 2))
    balls = slot(path, rng, count, gap=0.05)
    search = search_along(build, path, balls)
    pruned, short = (search.shorten(build.array(path), 0, shortcuts=n, seed=seed).astype(np.float64) for n in (0, 200))
    for found in (pruned, short):
        np.testing.assert_allclose(found[[0, -1]], path[[0, -1]], atol=1e-6)
        assert not balls or clearances(even(found), balls).min() > MARGIN - BETWEEN - 1e-5
    assert length_of(short) <= length_of(pruned) + 1e-5
    assert length_of(pruned) <= length_of(path) + 1e-5
    if not balls:
        assert len(pruned) == 2
    else:  # what is left are points of the path, in order
        kept = [int(np.abs(path - q).max(axis=1).argmin()) for q in pruned]
        np.testing.assert_allclose(pruned, path[kept], atol=1e-6)
        assert kept == sorted(kept)


@pytest.mark.parametrize("seed", range(4))
def test_around_a_ball_a_path_comes_near_the_shortest_one(build: Build, seed: int) -> None:
    """Two tangents and the arc between them, by the formula; pruning alone leaves the detour."""
    radius = 1.0 + CARRIAGE_RADIUS + MARGIN
    path = np.array([[-2.0, 0.0], [-1.5, 2.4], [1.5, 2.4], [2.0, 0.0]])
    search = search_along(build, path, [Sphere((0.0, 0.0, 0.0), 1.0)])
    tangent, arc = np.sqrt(4 - radius**2), np.pi - 2 * np.arccos(radius / 2)
    shortest = 2 * tangent + radius * arc
    pruned, short = (search.shorten(build.array(path), 0, shortcuts=n, seed=seed).astype(np.float64) for n in (0, 1000))
    assert length_of(pruned) > 1.2 * shortest
    assert 0.99 * shortest < length_of(short) < 1.03 * shortest


# ---- many control points ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("K", MANY)
def test_terms_of_many_control_points_are_the_formulas(build: Build, K: int) -> None:
    """Length, duration and smoothness over two instants a span, by SciPy's derivatives."""
    start, goal = np.array([-2.0, 0.0]), np.array([2.0, 1.0])
    rng = np.random.default_rng(K)
    points = np.linspace(start, goal, K + 2)
    points[1:-1] += rng.normal(size=(K, 2)) * 0.1
    search = objectives.motion_search(build, slider(), [], start, goal[None], jerk=np.full(2, 3.0), margin=MARGIN)
    terms = search.judge(build.array(points[1:-1].reshape(1, -1)), K, 0).terms[0]
    s = (np.arange(2 * (K + 1)) + 0.5) / (2 * (K + 1))
    first, second, third = (by_scipy(s, K, k) @ points for k in (1, 2, 3))
    duration = max(np.abs(first).max(), np.sqrt(np.abs(second).max()), np.cbrt(np.abs(third).max() / 3.0))
    expected = {
        "length": np.linalg.norm(first, axis=1).mean(),
        "duration": duration,
        "smoothness": (third**2).sum(axis=1).mean(),
    }
    for name, value in expected.items():
        assert terms[TERMS.index(name)] == pytest.approx(value, rel=2e-3 if build.bits == 32 else 1e-9), name


@pytest.mark.parametrize("K", MANY)
def test_many_control_points_are_free_where_every_instant_is(build: Build, K: int) -> None:
    start, goal = np.array([-2.0, 0.0]), np.array([2.0, 1.0])
    rng = np.random.default_rng(K)
    balls = [Sphere((x, 0.0, z), 0.15) for x, z in rng.uniform(-1.5, 1.5, (3, 2))]
    search = search_along(build, np.array([start, goal]), balls)
    line = np.linspace(start, goal, K + 2)[1:-1]
    bend = np.sin(np.linspace(0, 3, K))[:, None] * rng.normal(size=(80, 1, 2))
    rows = build.array((line + bend).reshape(80, -1))
    free = np.array(search.judge(rows, K, 0).free)
    least = np.array([clearances(q, balls).min() for q in looked_at(build, rows, K, start, goal)]) - MARGIN
    assert least[free].min() > -1e-4
    assert least[~free].max() < 1e-4
    assert 0.05 < free.mean() < 0.95


@pytest.mark.parametrize(("own", "wanted"), [(25, 25), (30, 12), (7, 40), (200, 60), (40, 200)])
def test_another_number_of_control_points_is_the_nearest_motion(build: Build, own: int, wanted: int) -> None:
    """Least squares at even instants, by NumPy; the search's own adds a trace of damping."""
    start, goal = np.array([-2.0, 0.0]), np.array([2.0, 1.0])
    points = np.linspace(start, goal, own + 2)
    points[1:-1] += np.sin(np.linspace(0, 6, own))[:, None] * [0.3, -0.2]
    search = objectives.motion_search(build, slider(), [], start, goal[None])
    found = search.with_interior(build.array(points[1:-1].reshape(1, -1)), own, 0, wanted).reshape(wanted, 2)
    count = 4 * (max(own, wanted) + 1)
    s = (np.arange(count) + 0.5) / count
    basis = by_scipy(s, wanted, 0)
    target = by_scipy(s, own, 0) @ points - basis[:, :1] * start - basis[:, -1:] * goal
    expected = np.linalg.lstsq(basis[:, 1:-1], target, rcond=None)[0]
    rows = np.vstack([start, found.astype(np.float64), goal])
    nearest = np.vstack([start, expected, goal])
    np.testing.assert_allclose(basis @ rows, basis @ nearest, atol=1e-4)


@pytest.mark.parametrize("bits", [32, 64])
def test_every_level_has_the_same_motions(bits: int) -> None:
    rng = np.random.default_rng(9)
    path = rng.uniform(-2.5, 2.5, (7, 2))
    balls = slot(path, rng, 100)
    found = []
    for level in LEVELS:
        build = Build(level, bits)
        search = search_along(build, path, balls)
        blended = search.blend_corners(build.array(path), 0)
        more = search.with_interior(build.array(blended.points.reshape(1, -1)), len(blended.points), 0, 40)
        judged = search.judge(more, 40, 0)
        short = search.shorten(build.array(path), 0, shortcuts=100, seed=3)
        found.append(
            [
                short.tolist(),
                blended.looks,
                blended.points.tolist(),
                more.tolist(),
                judged.terms.tolist(),
                judged.violation.tolist(),
            ]
        )
    assert all(one == found[0] for one in found[1:])
