"""Links and obstacles of every shape: the kernel's clearances against Coal, NumPy by golden section, and a ruler."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import drawn
from kernel.builds import Build, surround
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere
from spacearm.robot import LinkCapsule
from support import strategies
from support.kernel_cases import bench, capsule, resized, rounding
from support.oracles import coal_shapes, solids

Axes = Sequence[tuple[np.ndarray, np.ndarray]]


def on_bench(build: Build, links: Sequence[LinkCapsule], obstacles: Sequence[Obstacle]) -> np.ndarray:
    """Clearances (links, obstacles) [m] of links that stay where they are."""
    model = surround(build, bench(*links), obstacles).native
    return model.obstacle_clearances(build.array([[0.0]]))[0].astype(np.float64)


def as_links(axes: Axes, radius: float = 0.0) -> list[LinkCapsule]:
    return [capsule(a, b, radius) for a, b in axes]


def expected_distances(axes: Axes, obstacles: Sequence[Obstacle]) -> np.ndarray:
    """Signed distances (axes, obstacles) of the definition [m]."""
    a, b = (np.array(ends, dtype=np.float64).reshape(-1, 3) for ends in zip(*axes, strict=True))
    return np.stack([solids.link_distance(obstacle, a, b) for obstacle in obstacles], axis=1)


def extent(obstacle: Obstacle) -> float:
    """How far from the origin its numbers go [m]."""
    middle, _, half = drawn.landmarks(obstacle)
    return float(np.linalg.norm(middle) + np.linalg.norm(half))


def allowed(build: Build, axes: Axes, obstacles: Sequence[Obstacle], distance: np.ndarray) -> np.ndarray:
    """What the kernel's distances (axes, obstacles) may be off by [m], rounding and the last stretch of its search.

    The distances given are those of the axes, a capsule's axis included.

    Along an axis of length L it halves down to a stretch of h L, where it takes the slope for straight. The square of the
    distance has a curvature of at most 2 L^2, so outside a shape that costs (h L)^2 / (8 d) at most; and where the axis
    enters it, or inside, where the distance has corners, half of the stretch: if it holds all of a thin shape.
    """
    L = np.array([np.linalg.norm(b - a) for a, b in axes])[:, None]
    far = np.array([np.linalg.norm(a) for a, _ in axes])[:, None]
    rounded = rounding(build) * (1 + far + L + np.array([extent(o) for o in obstacles]))
    stretch = L * 2.0 ** -(10 if build.bits == 32 else 26)
    outside = np.divide(stretch**2 / 8, distance, out=np.full_like(distance, np.inf), where=distance > 0)
    searched = [isinstance(o, (Box, Cylinder)) for o in obstacles]
    # Of two axes, the squared distance is what is rounded; it matters where they all but meet.
    squared = 4 * float(np.finfo(build.scalar).eps) * (L + np.array([extent(o) for o in obstacles])) ** 2
    crossing = np.sqrt(np.maximum(distance, 0) ** 2 + squared) - np.maximum(distance, 0)
    rods = [isinstance(o, Capsule) for o in obstacles]
    return rounded + np.where(searched, np.minimum(outside, stretch / 2), 0.0) + np.where(rods, crossing, 0.0)


def axis_distances(axes: Axes, obstacles: Sequence[Obstacle]) -> np.ndarray:
    """As expected_distances, of a capsule's axis rather than its surface, for the allowance."""
    thin = [Capsule(o.a, o.b, 1e-300) if isinstance(o, Capsule) else o for o in obstacles]
    return expected_distances(axes, thin)


@settings(max_examples=15)
@given(st.data())
def test_the_clearance_is_the_axis_least_signed_distance_less_the_radius(build: Build, data: st.DataObject) -> None:
    obstacles = data.draw(st.lists(drawn.obstacles(), min_size=1, max_size=3))
    axes = [data.draw(drawn.axes_by(o)) for o in obstacles for _ in range(3)]
    radius = data.draw(st.sampled_from([0.0, 0.05, 3.0]))
    found = on_bench(build, as_links(axes, radius), obstacles) + radius
    expected = expected_distances(axes, obstacles)
    error = allowed(build, axes, obstacles, axis_distances(axes, obstacles)) + rounding(build, radius)
    assert (np.abs(found - expected) <= error).all(), (found - expected, error)


@settings(max_examples=100)
@given(st.data())
def test_the_oracles_agree_where_coal_has_an_answer(data: st.DataObject) -> None:
    """Where a link and an obstacle are apart, Coal's distance is the definition's."""
    obstacle = data.draw(drawn.obstacles())
    a, b = data.draw(drawn.axes_by(obstacle))
    radius = data.draw(st.sampled_from([1e-3, 0.05]))
    expected = expected_distances([(a, b)], [obstacle])[0, 0] - radius
    (solid,) = coal_shapes.placed_obstacle(obstacle)
    found = coal_shapes.distance(coal_shapes.placed_capsule(a, b, radius), solid)
    size = 1 + float(np.linalg.norm(a) + np.linalg.norm(b)) + extent(obstacle)
    if expected > 1e-6 * size:
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-6 * size)
    else:
        assert found < 1e-5 * size


# ---- many, the same for every build ----------------------------------------------------------------------------------


class Many(NamedTuple):
    """Axes and obstacles among each other, all distances (axes, obstacles) in [m].

    Attributes:
        axes: their ends.
        obstacles: of every shape.
        distance: by the definition.
        of_axes: those of the axes, a capsule's axis included.
        coal: Coal's where they are well apart, else nan.
    """

    axes: list[tuple[np.ndarray, np.ndarray]]
    obstacles: list[Obstacle]
    distance: np.ndarray
    of_axes: np.ndarray
    coal: np.ndarray


@cache
def many() -> Many:
    rng = np.random.default_rng(0)
    obstacles: list[Obstacle] = []
    for i in range(60):
        T = np.eye(4)
        if i % 3:
            T[:3, :3] = coal_shapes.frame_along(rng.normal(size=3))
        T[:3, 3] = rng.uniform(-1, 1, 3)
        sizes = rng.uniform(0.02, 0.5, 3) * rng.choice([0.1, 1.0, 1.0, 10.0])
        obstacles.append(
            [
                Sphere(T[:3, 3], sizes[0]),
                Capsule(T[:3, 3], T[:3, 3] + sizes[0] * T[:3, 2], sizes[1]),
                Box(2 * sizes, T),
                Cylinder(sizes[0], sizes[1], T),
                HalfSpace(T[:3, 2], T[:3, 3] + sizes),
            ][i % 5]
        )
    a = rng.uniform(-1.5, 1.5, (100, 3))
    axes = list(zip(a, a + rng.normal(size=(100, 3)) * rng.choice([0.0, 0.01, 0.4, 4.0], (100, 1)), strict=True))
    expected = expected_distances(axes, obstacles)
    coal = np.full(expected.shape, np.nan)
    for i, k in np.argwhere(expected > 0.01):
        link = coal_shapes.placed_capsule(*axes[i], 1e-3)
        coal[i, k] = coal_shapes.distance(link, coal_shapes.placed_obstacle(obstacles[k])[0]) + 1e-3
    return Many(axes, obstacles, expected, axis_distances(axes, obstacles), coal)


def test_many_links_among_many_obstacles_are_as_far_as_coal_says(build: Build) -> None:
    given = many()
    found = on_bench(build, as_links(given.axes), given.obstacles)
    assert (np.abs(found - given.distance) <= allowed(build, given.axes, given.obstacles, given.of_axes)).all()
    apart = np.isfinite(given.coal)
    assert 0.3 < apart.mean() < 0.9
    np.testing.assert_allclose(found[apart], given.coal[apart], rtol=0, atol=1e-5)


@pytest.mark.parametrize("size", [1e-4, 1e4])
def test_size_does_not_matter(build: Build, size: float) -> None:
    """Everything in another unit of length: the kernel has no length of its own."""
    axes, obstacles, expected, of_axes, _ = many()
    found = on_bench(build, as_links([(a * size, b * size) for a, b in axes]), [resized(o, size) for o in obstacles])
    assert (np.abs(found / size - expected) <= allowed(build, axes, obstacles, of_axes)).all()


# ---- a ruler ---------------------------------------------------------------------------------------------------------

BOX = Box((2.0, 4.0, 8.0))
DRUM = Cylinder(1.0, 4.0)
ROD = Capsule((-1.0, 0, 0), (1.0, 0, 0), 0.25)
FLOOR = HalfSpace((0, 0, 1.0), (0, 0, 0.5))
RULED: dict[str, tuple[Obstacle, tuple[float, ...], tuple[float, ...], float]] = {
    "box: beside a face": (BOX, (2, -1, 0), (2, 1, 0), 1.0),
    "box: on a face": (BOX, (1, -1, 0), (1, 1, 0), 0.0),
    "box: in a face, beyond its edges": (BOX, (1, -9, 0), (1, 9, 0), 0.0),
    "box: along an edge": (BOX, (1, 2, -4), (1, 2, 4), 0.0),
    "box: away from a corner": (BOX, (1, 2, 4), (4, 6, 16), 0.0),
    "box: towards a corner": (BOX, (4, 6, 16), (2, 4, 6), 3.0),
    "box: past an edge, at a right angle": (BOX, (4, 6, -9), (4, 6, 9), 5.0),
    "box: through its middle along x": (BOX, (-9, 0, 0), (9, 0, 0), -1.0),
    "box: through its middle along z": (BOX, (0, 0, -9), (0, 0, 9), -1.0),
    "box: a point in its middle": (BOX, (0, 0, 0), (0, 0, 0), -1.0),
    "box: a point on a corner": (BOX, (1, 2, 4), (1, 2, 4), 0.0),
    "box: a point within": (BOX, (0.25, 1.5, 0), (0.25, 1.5, 0), -0.5),
    "drum: through its axis": (DRUM, (0, 0, -9), (0, 0, 9), -1.0),
    "drum: across its middle": (DRUM, (-9, 0, 0), (9, 0, 0), -1.0),
    "drum: along its side": (DRUM, (1, 0, -9), (1, 0, 9), 0.0),
    "drum: on its lid": (DRUM, (-9, 0, 2), (9, 0, 2), 0.0),
    "drum: above its lid": (DRUM, (-9, 0, 3), (9, 0, 3), 1.0),
    "drum: off its rim": (DRUM, (4, -9, 6), (4, 9, 6), 5.0),
    "drum: a point in its middle": (DRUM, (0, 0, 0), (0, 0, 0), -1.0),
    "drum: a point above its axis": (DRUM, (0, 0, 5), (0, 0, 5), 3.0),
    "drum: a point on its rim": (DRUM, (1, 0, 2), (1, 0, 2), 0.0),
    "rod: the same axis": (ROD, (-1, 0, 0), (1, 0, 0), -0.25),
    "rod: in line, apart": (ROD, (2, 0, 0), (9, 0, 0), 0.75),
    "rod: in line, overlapping": (ROD, (0.5, 0, 0), (9, 0, 0), -0.25),
    "rod: parallel": (ROD, (-9, 2, 0), (9, 2, 0), 1.75),
    "rod: parallel, the other way": (ROD, (9, 2, 0), (-9, 2, 0), 1.75),
    "rod: parallel, past its end": (ROD, (4, 4, 0), (9, 4, 0), 4.75),
    "rod: crossing at a right angle": (ROD, (0, -1, 1), (0, 1, 1), 0.75),
    "rod: meeting its end": (ROD, (1, 0, 0), (1, 5, 0), -0.25),
    "rod: a point beyond its end": (ROD, (4, 4, 0), (4, 4, 0), 4.75),
    "floor: above": (FLOOR, (0, 0, 2), (5, 0, 1), 0.5),
    "floor: parallel": (FLOOR, (0, 0, 2), (5, 0, 2), 1.5),
    "floor: through": (FLOOR, (0, 0, 2), (5, 0, -2), -2.5),
    "floor: a point on it": (FLOOR, (3, 3, 0.5), (3, 3, 0.5), 0.0),
}


@pytest.mark.parametrize("case", RULED)
def test_distances_are_what_a_ruler_gives(build: Build, case: str) -> None:
    """As the table has it, with the link's ends exchanged, and with x, y, z as y, z, x."""
    obstacle, a, b, expected = RULED[case]
    a, b, R = np.array(a, dtype=np.float64), np.array(b, dtype=np.float64), np.eye(3)[:, [1, 2, 0]]
    found = [
        on_bench(build, [capsule(a, b, 0.125), capsule(b, a, 0.125)], [obstacle]),
        on_bench(build, [capsule(R @ a, R @ b, 0.125)], [turned(obstacle, R)]),
    ]
    # At a corner of the distance, which some have at the middle of the axis, the search may stop beside it.
    stretch = np.linalg.norm(b - a) * 2.0 ** -(10 if build.bits == 32 else 26)
    for clearance in np.concatenate(found).ravel():
        assert -rounding(build, 10.0) <= clearance - (expected - 0.125) <= stretch / 4 + rounding(build, 10.0)


def turned(o: Obstacle, R: np.ndarray) -> Obstacle:
    if isinstance(o, Capsule):
        return Capsule(R @ o.a, R @ o.b, o.radius)
    if isinstance(o, HalfSpace):
        return HalfSpace(R @ o.normal, R @ o.point)
    T = np.eye(4)
    T[:3, :3] = R
    return Box(o.size, T) if isinstance(o, Box) else Cylinder(o.radius, o.length, T)  # type: ignore[union-attr]


@pytest.mark.parametrize("gap", [0.0, 1e-4, 0.1])
@pytest.mark.parametrize("length", [0.01, 1.0, 30.0])
def test_axes_that_are_nearly_parallel_are_measured_where_they_cross(build: Build, length: float, gap: float) -> None:
    """A rod along x, and links that cross above it, turned by less and less: the distance is the gap."""
    rod = Capsule((0, 0, 0), (length, 0, 0), 0.25)
    links = []
    turns = [0.1, 0.01, 3e-3, 1.1e-3, 9e-4, 5e-4, 1e-4, 1e-5, 1e-6, 1e-8, 0.0]
    for turn, share, at in product(turns, [0.0, 0.1, 0.5, 0.9, 1.0], [0.0, 0.3, 0.5, 1.0]):
        way = length * np.array([np.cos(turn), np.sin(turn), 0.0])
        crossing = np.array([share * length, 0, gap])
        links.append((crossing - at * way, crossing + (1 - at) * way))
        links.append((crossing + (1 - at) * way, crossing - at * way))
    found = on_bench(build, as_links(links), [rod])[:, 0] + 0.25
    # Rounding of squares: what is left of them is off by some roundings of the length's.
    eps = 4 * float(np.finfo(build.scalar).eps)
    error = np.sqrt(gap**2 + eps * length**2) - gap + rounding(build, 2 * length, gap)
    np.testing.assert_allclose(found, gap, rtol=0, atol=error)


# ---- a robot's own capsules ------------------------------------------------------------------------------------------


@st.composite
def capsule_pairs(draw: st.DrawFn) -> tuple[LinkCapsule, LinkCapsule]:
    """Two capsules, one in an awkward place by the other: crossing, parallel or nearly, end to end, without length."""
    radii = st.sampled_from([0.0, 0.02, 0.5])
    other = Capsule(draw(strategies.points()), draw(strategies.points()), 0.5)
    if draw(st.booleans()):
        other = Capsule(other.a, other.a, 0.5)
    one = draw(drawn.axes_by(other))
    return capsule(*one, draw(radii)), capsule(other.a, other.b, draw(radii))


@settings(max_examples=15)
@given(st.lists(capsule_pairs(), min_size=1, max_size=4))
def test_pairs_are_as_far_apart_as_coals_capsules(build: Build, drawn_pairs: list[tuple[LinkCapsule, LinkCapsule]]) -> None:
    links = [link for pair in drawn_pairs for link in pair]
    pairs = np.arange(len(links), dtype=np.int32).reshape(-1, 2)
    model = surround(build, bench(*links)).native
    found = model.pair_clearances(build.array([[0.0]]), pairs)[0]
    for i, (one, two) in enumerate(drawn_pairs):
        axis = expected_distances([(one.a, one.b)], [Capsule(two.a, two.b, 1e-300)])
        error = float(allowed(build, [(one.a, one.b)], [Capsule(two.a, two.b, 1e-300)], axis)[0, 0])
        assert found[i] == pytest.approx(axis[0, 0] - one.radius - two.radius, rel=0, abs=error)
        if one.radius > 0 and two.radius > 0 and axis[0, 0] > 1e-3:
            by_coal = coal_shapes.distance(
                coal_shapes.placed_capsule(one.a, one.b, one.radius), coal_shapes.placed_capsule(two.a, two.b, two.radius)
            )
            size = 1 + float(np.linalg.norm(one.a) + np.linalg.norm(one.b))
            assert found[i] == pytest.approx(by_coal, rel=0, abs=error + 1e-6 * size)


def test_a_pair_may_be_asked_for_in_either_order_and_again(build: Build) -> None:
    rng = np.random.default_rng(0)
    links = [capsule(a, b, r) for a, b, r in zip(*rng.uniform(-1, 1, (2, 9, 3)), rng.uniform(0, 0.2, 9), strict=True)]
    model = surround(build, bench(*links)).native
    pairs = np.array([(i, k) for i in range(9) for k in range(9) if i != k], dtype=np.int32)
    q = build.array([[0.0], [1.0]])
    found, back = (model.pair_clearances(q, np.ascontiguousarray(p)) for p in (pairs, pairs[:, ::-1]))
    np.testing.assert_allclose(found, back, rtol=0, atol=rounding(build, 2.0))
    np.testing.assert_array_equal(model.pair_clearances(q, np.repeat(pairs, 2, axis=0)), np.repeat(found, 2, axis=1))
    assert model.pair_clearances(q, pairs[:0]).shape == (2, 0)
