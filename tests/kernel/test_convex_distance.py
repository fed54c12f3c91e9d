"""Distances of any two convex shapes: the kernel's against Coal and SciPy.

Coal's search may end too early, with a distance that is too large: of hulls of points SciPy's least squares have the least.
Where shapes overlap, the hull of their differences has the depth. Coal's depth of a cylinder is inexact: the hulls of prisms
inside and around it bound it.
"""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from kernel.builds import Build
from spacearm.core.native import available_levels
from spacearm.geometry import Box, Capsule, ConvexShape, Cylinder, Polytope, Sphere, moved_shape
from spacearm.geometry.convex_cores import core_of
from support import strategies
from support.oracles import coal_shapes

KINDS = ("sphere", "capsule", "box", "cylinder", "polytope", "plate")
PAIRS = tuple(combinations_with_replacement(KINDS, 2))
PLACES = ("drawn", "touching", "nested", "parallel", "tiny", "huge")
POSES = 6  # of each pair of kinds, at each place
SIDES = 64  # of the prisms in place of a cylinder


class Case(NamedTuple):
    """Two shapes about the origin, and where the second is from the first.

    Attributes:
        one, other: the shapes.
        T: (m, 4, 4) the second's poses.
        least, most: (m,) bounds of their signed distance [m]; equal but for cylinders that overlap.
        size: (m,) how far the numbers go [m].
    """

    one: ConvexShape
    other: ConvexShape
    T: np.ndarray
    least: np.ndarray
    most: np.ndarray
    size: np.ndarray


# ---- drawing ---------------------------------------------------------------------------------------------------------


def drawn_shape(rng: np.random.Generator, kind: str, scale: float) -> ConvexShape:
    """A shape about the origin, of extents from a fifth of a millimetre to half a metre, at times rounded."""
    half = scale * rng.uniform(0.02, 0.5, 3) * rng.choice([1.0, 1.0, 0.01], 3)
    rounding = scale * float(rng.choice([0.0, 0.0, 0.03]))
    if kind == "sphere":
        return Sphere(np.zeros(3), half[0])
    if kind == "capsule":
        return Capsule((0, 0, -half[2]), (0, 0, half[2]), half[0])
    if kind == "box":
        return Box(2 * half, rounding=rounding)
    if kind == "cylinder":
        return Cylinder(half[0], 2 * half[2], rounding=rounding)
    count = int(rng.integers(4, 30))
    points = half * rng.normal(size=(count, 3))
    if kind == "plate":
        points = points[: int(rng.integers(3, 8))]
        points[:, 2] = 0.0
    return Polytope(points, rounding=rounding)


def right_angled(rng: np.random.Generator) -> np.ndarray:
    R = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], (3, 1))
    return R if np.linalg.det(R) > 0 else -R


def drawn_turn(rng: np.random.Generator, place: str) -> np.ndarray:
    """A rotation (3, 3): any, or right angles, or these but for a little."""
    if place != "parallel":
        return coal_shapes.frame_along(rng.normal(size=3)) @ strategies.rotation(2, float(rng.uniform(0, 6)))
    tilt = float(rng.choice([0.0, 0.0, 1e-8, 1e-5, 1e-3]))
    return strategies.rotation(int(rng.integers(3)), tilt) @ right_angled(rng)


def drawn_poses(rng: np.random.Generator, one: ConvexShape, other: ConvexShape, place: str) -> np.ndarray:
    """Poses (m, 4, 4) of the second shape."""
    T = np.tile(np.eye(4), (POSES, 1, 1))
    reach = extent(one) + extent(other)
    for at in T:
        at[:3, :3] = drawn_turn(rng, place)
        away = rng.normal(size=3)
        away *= reach * rng.uniform(0, 1.2) / np.linalg.norm(away)
        if place == "nested":
            away *= 0.05 * float(rng.choice([0.0, 1.0]))
        elif place == "parallel":  # some faces in one plane
            away = np.round(2 * away / extent(one)) * corners(one).max(axis=0) / 2
        at[:3, 3] = away
        if place == "touching":  # moved until they touch, all but
            n = away / np.linalg.norm(away)
            gap = support(one, n) + support(moved_shape(other, at), -n)
            at[:3, 3] += n * (gap + reach * float(rng.choice([0.0, 1e-9, 1e-4, -1e-4])))
    return T


def corners(shape: ConvexShape, *, around: bool = False) -> np.ndarray:
    """Points (k, 3) whose hull the core is; a cylinder's is a prism within it, or around it."""
    core = core_of(shape)
    if core.kind == "polytope":
        local = core.vertices
    elif core.kind == "cylinder":
        angle = 2 * np.pi * np.arange(SIDES) / SIDES
        radius = core.half[0] / (np.cos(np.pi / SIDES) if around else 1.0)
        ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(SIDES)])
        top = np.array([0, 0, core.half[2]])
        local = np.concatenate([ring + top, ring - top])
    else:
        local = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * core.half
    return local @ core.T[:3, :3].T + core.T[:3, 3]


def radius_of(shape: ConvexShape) -> float:
    return core_of(shape).radius


def support(shape: ConvexShape, n: np.ndarray) -> float:
    return float((corners(shape, around=True) @ n).max()) + radius_of(shape)


def extent(shape: ConvexShape) -> float:
    return float(np.linalg.norm(corners(shape), axis=1).max()) + radius_of(shape)


# ---- what is expected ------------------------------------------------------------------------------------------------


def hull_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Signed distance of the hulls of points [m] that overlap: of the origin in the hull of their differences."""
    between = (one[:, None] - other).reshape(-1, 3)
    try:
        return float(ConvexHull(between).equations[:, 3].max())
    except QhullError:  # a flat one has no depth
        return 0.0


def least_distance(one: np.ndarray, other: np.ndarray, reach: float) -> float:
    """Distance of the hulls of points [m]: least squares of weights that are 0 or more, and of which each hull's sum is 1."""
    n, m, heavy = len(one), len(other), 1e4
    sums = heavy * np.kron(np.eye(2), np.ones((1, max(n, m))))
    sums = np.concatenate([sums[:, :n], sums[:, max(n, m) : max(n, m) + m]], axis=1)
    system = np.concatenate([np.concatenate([one.T, -other.T], axis=1) / reach, sums])
    weights, _ = nnls(system, np.array([0, 0, 0, heavy, heavy]), maxiter=10000)
    a, b = weights[:n] / weights[:n].sum(), weights[n:] / weights[n:].sum()
    return float(np.linalg.norm(a @ one - b @ other))


def expected(one: ConvexShape, other: ConvexShape, reach: float) -> tuple[float, float]:
    """Bounds of the signed distance of two shapes [m], which are equal where it is known."""
    radii = radius_of(one) + radius_of(other)
    bare = [coal_shapes.placed_shape(_with_radius(shape, 1e-9 * reach)) for shape in (one, other)]
    apart = coal_shapes.distance(*bare) + 2e-9 * reach
    if not isinstance(one, Cylinder) and not isinstance(other, Cylinder):
        apart = min(apart, least_distance(corners(one), corners(other), reach))
    if apart > 1e-7 * reach:
        return apart - radii, apart - radii
    inside, around = (min(hull_distance(corners(one, around=a), corners(other, around=a)), 0.0) for a in (False, True))
    return around - radii, inside - radii + 1e-7 * reach


def _with_radius(shape: ConvexShape, radius: float) -> ConvexShape:
    if isinstance(shape, Sphere):
        return Sphere(shape.center, radius)
    if isinstance(shape, Capsule):
        return Capsule(shape.a, shape.b, radius)
    if isinstance(shape, Box):
        return Box(shape.size, shape.pose, rounding=radius)
    if isinstance(shape, Cylinder):
        return Cylinder(shape.radius, shape.length, shape.pose, rounding=radius)
    return Polytope(shape.vertices, rounding=radius)


@cache
def case(kinds: tuple[str, str], place: str) -> Case:
    rng = np.random.default_rng([PAIRS.index(kinds), PLACES.index(place)])
    scale = {"tiny": 1e-3, "huge": 1e3}.get(place, 1.0)
    one, other = (drawn_shape(rng, kind, scale) for kind in kinds)
    if place == "nested":
        other = drawn_shape(rng, kinds[1], 0.05)
    T = drawn_poses(rng, one, other, place)
    size = extent(one) + extent(other) + np.linalg.norm(T[:, :3, 3], axis=1)
    bounds = np.array([expected(one, moved_shape(other, at), float(s)) for at, s in zip(T, size, strict=True)])
    return Case(one, other, T, bounds[:, 0], bounds[:, 1], size)


# ---- what the kernel says --------------------------------------------------------------------------------------------


def native_shape(build: Build, shape: ConvexShape) -> tuple[Any, np.ndarray]:
    """A shape as the kernel's own object, and the pose (4, 4) of its core."""
    core = core_of(shape)
    kind = build.module.CoreKind["segment" if core.kind == "point" else core.kind]
    vertices = np.ascontiguousarray(core.vertices)
    return build.module.ConvexShape(kind=kind, half=core.half.copy(), radius=core.radius, vertices=vertices), core.T


def distances(
    build: Build, one: ConvexShape, T_one: np.ndarray, other: ConvexShape, T_other: np.ndarray, *, enough: float = 1e30
) -> np.ndarray:
    """Signed distances (m,) [m] of two shapes at poses (m, 4, 4) each."""
    (first, at_first), (second, at_second) = native_shape(build, one), native_shape(build, other)
    poses = [np.ascontiguousarray(T @ at) for T, at in ((T_one, at_first), (T_other, at_second))]
    return build.named("convex_distances")(first, poses[0], second, poses[1], enough=enough)


def allowed(build: Build, kinds: tuple[str, str], given: Case) -> tuple[np.ndarray, np.ndarray]:
    """By how much a distance may be too small, and too large [m].

    Too small: what the search leaves open. In double that is rounding, but where a cylinder lies within another body: about
    its axis many directions are as good, and their number is limited. Too large: the rounding of the coordinates alone. Of
    two segments the square of the distance is rounded.
    """
    single = build.bits == 32
    small = given.size * (1e-3 if single else 1e-4 if "cylinder" in kinds else 1e-8)
    large = given.size * (2e-6 if single else 1e-8)
    if set(kinds) <= {"sphere", "capsule"}:
        axes = np.maximum(given.most + radius_of(given.one) + radius_of(given.other), 0.0)
        squared = 8 * float(np.finfo(build.scalar).eps) * given.size**2
        large = large + np.sqrt(axes**2 + squared) - axes
    return small, large


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_shapes_are_as_far_apart_or_as_deep_as_the_oracles_say(build: Build, kinds: tuple[str, str], place: str) -> None:
    """Either way round, and from another frame."""
    given = case(kinds, place)
    small, large = allowed(build, kinds, given)
    still = np.tile(np.eye(4), (POSES, 1, 1))
    moved = np.tile(strategies.rotation(0, 0.7) @ strategies.rotation(1, -2.0), (POSES, 1, 1))
    seen = still.copy()
    seen[:, :3, :3], seen[:, :3, 3] = moved, 0.3 * given.size[:, None]
    for found in (
        distances(build, given.one, still, given.other, given.T),
        distances(build, given.other, given.T, given.one, still),
        distances(build, given.one, seen, given.other, seen @ given.T),
    ):
        assert (given.least - small <= found).all(), (found - given.least) / given.size
        assert (found <= given.most + large).all(), (found - given.most) / given.size


def test_the_cases_are_apart_and_overlap() -> None:
    given = [case(kinds, place) for kinds in PAIRS for place in PLACES]
    signs = np.concatenate([np.sign(each.most) for each in given])
    assert 0.2 < np.mean(signs > 0) < 0.8


@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_enough_is_enough_and_changes_nothing_below(build: Build, kinds: tuple[str, str]) -> None:
    given = case(kinds, "drawn")
    still = np.tile(np.eye(4), (POSES, 1, 1))
    exact = distances(build, given.one, still, given.other, given.T)
    enough = float(np.float32(np.median(exact)))
    found = distances(build, given.one, still, given.other, given.T, enough=enough)
    far = exact >= enough
    assert far.any()
    assert (found[far] >= enough).all()
    np.testing.assert_array_equal(found[~far], exact[~far])


@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_a_distance_does_not_depend_on_its_neighbours(build: Build, kinds: tuple[str, str]) -> None:
    given = [case(kinds, "drawn"), case(kinds, "nested")]
    one, other = given[0].one, given[0].other
    T = np.concatenate([each.T for each in given] * 3)
    still = np.tile(np.eye(4), (len(T), 1, 1))
    together = distances(build, one, still, other, T, enough=0.2)
    alone = [distances(build, one, still[i : i + 1], other, T[i : i + 1], enough=0.2)[0] for i in range(2 * POSES)]
    np.testing.assert_array_equal(together, alone * 3)


@pytest.mark.parametrize("broken", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_what_is_no_number_is_not_far_away(build: Build, kinds: tuple[str, str], broken: float) -> None:
    """In the pose of either shape, wherever it matters; and the other lanes have the distances that they had."""
    given = case(kinds, "drawn")
    measure = build.named("convex_distances")
    (one, at), (other, T_core) = native_shape(build, given.one), native_shape(build, given.other)
    at = np.tile(at, (POSES, 1, 1))
    exact = measure(one, at, other, given.T @ T_core, enough=0.1)
    for row, column in [(0, 3), (1, 3), (2, 3), (0, 2), (1, 2), (2, 2)]:
        if column == 2 and kinds[1] == "sphere":
            continue  # a ball has no axes
        poses = given.T @ T_core
        poses[1, row, column] = broken
        found = measure(one, at, other, poses, enough=0.1)
        np.testing.assert_array_equal(np.delete(found, 1), np.delete(exact, 1))
        for value in (found[1], measure(other, poses, one, at, enough=0.1)[1]):
            assert np.isnan(value) or value == -np.inf


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_a_polytope_of_few_points_is_a_point_a_segment_or_a_triangle(build: Build, kind: str, count: int) -> None:
    """Given as a polytope, which the package would not do."""
    rng = np.random.default_rng(count)
    points = rng.normal(size=(count, 3)) * 0.3
    few = build.module.ConvexShape(kind=build.module.CoreKind.polytope, half=np.zeros(3), radius=0.01, vertices=points)
    one = drawn_shape(rng, kind, 1.0)
    shape, T_core = native_shape(build, one)
    T = drawn_poses(rng, one, Polytope(points, rounding=0.01), "drawn")
    at = np.tile(T_core, (POSES, 1, 1))
    found = build.named("convex_distances")(shape, at, few, T, enough=1e30)
    for value, pose in zip(found, T, strict=True):
        least, most = expected(one, moved_shape(Polytope(points, rounding=0.01), pose), 2.0)
        assert least - 1e-3 <= value <= most + 2e-6


@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_every_level_has_the_same_bits(build: Build, kinds: tuple[str, str]) -> None:
    first = Build(available_levels()[0], build.bits)
    for place in PLACES:
        given = case(kinds, place)
        still = np.tile(np.eye(4), (POSES, 1, 1))
        found = [distances(each, given.one, still, given.other, given.T) for each in (build, first)]
        np.testing.assert_array_equal(*found)


def test_poses_of_different_numbers_are_refused(build: Build) -> None:
    with pytest.raises(ValueError, match="different numbers"):
        distances(build, Sphere((0, 0, 0), 1.0), np.tile(np.eye(4), (2, 1, 1)), Sphere((0, 0, 0), 1.0), np.eye(4)[None])


@pytest.mark.parametrize("change", [{"radius": np.nan}, {"half": np.full(3, np.inf)}, {"vertices": np.zeros((1, 3))}])
def test_shapes_that_are_none_are_refused(build: Build, change: dict[str, Any]) -> None:
    sound = {"kind": build.module.CoreKind.box, "half": np.ones(3), "radius": 0.0, "vertices": np.zeros((0, 3))}
    with pytest.raises(ValueError, match=r"number that is none|vertices"):
        build.module.ConvexShape(**{**sound, **change})
