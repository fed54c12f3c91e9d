"""The native nearest points of two convex bodies: exact where there is a formula, and by Coal for drawn bodies of all kinds."""

from __future__ import annotations

from itertools import combinations_with_replacement, product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spacearm.core.native_finder import native_finder
from spacearm.geometry import Box, Capsule, ConvexShape, Cylinder, HalfSpace, Polytope, Scene, Sphere, pose
from spacearm.proof.convex_bodies import scene_bodies
from support.oracles.coal_shapes import distance, placed_shape

KINDS = ("sphere", "capsule", "box", "cylinder", "polytope")
PAIRS = list(combinations_with_replacement(KINDS, 2))
GAPS = (1e-9, 1e-7, 1e-5, 1e-3)
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
Z = np.array([0.0, 0.0, 1.0])

Body = dict[str, object]


def hull(points: object, *, radius: float = 0.0, disc: float = 0.0, axis: object = Z) -> Body:
    """All within a radius of the hull of points, widened by a disc."""
    rows = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    return {"points": rows, "disc": disc, "axis": np.array(axis, dtype=np.float64), "radius": radius, "half_space": False}


def body_of(obstacle: ConvexShape | HalfSpace) -> Body:
    """An obstacle's row of the table of bodies."""
    table = scene_bodies(Scene([obstacle]))
    points = table.vertices[table.first_point[0] : table.first_point[0] + table.points[0]]
    made = hull(points, radius=float(table.radius[0]), disc=float(table.disc[0]), axis=table.axis[0])
    return made | {"half_space": bool(table.half_space[0])}


def moved(body: Body, R: object = np.eye(3), p: object = (0.0, 0.0, 0.0), scale: float = 1.0) -> Body:
    """A body scaled, then turned by R and moved by p."""
    turn = np.asarray(R)
    points = np.ascontiguousarray(scale * np.asarray(body["points"]) @ turn.T + np.asarray(p))
    sizes = {name: scale * float(body[name]) for name in ("disc", "radius")}  # type: ignore[arg-type]
    return body | sizes | {"points": points, "axis": turn @ np.asarray(body["axis"])}


def nearest(a: Body, b: Body) -> tuple[float, np.ndarray, bool]:
    """The clearance, the direction and whether it separates the cores; the direction has length 1 and turns with the order."""
    clearance, n, apart = native_finder.nearest_points(*(native_finder.PlacedBody(**one) for one in (a, b)))  # type: ignore[arg-type]
    assert np.linalg.norm(n) == pytest.approx(1, abs=1e-14)
    return clearance, np.array(n), apart


def gap(a: Body, b: Body, n: np.ndarray) -> float:
    """What a plane square to n proves [m], in long double."""

    def support(body: Body, n: np.ndarray) -> np.longdouble:
        axis = np.asarray(body["axis"], np.longdouble)
        rim = np.sqrt((np.cross(n, axis) ** 2).sum())
        return (np.asarray(body["points"], np.longdouble) @ n).max() + body["disc"] * rim + body["radius"]  # type: ignore[operator]

    exact = n.astype(np.longdouble)
    exact /= np.sqrt((exact**2).sum())
    return float(-support(a, -exact) - support(b, exact))


def drawn(kind: str, rng: np.random.Generator, scale: float) -> ConvexShape:
    """A shape of a kind: some long, some flat, some axis-aligned, some rounded."""

    def size() -> float:
        return float(scale * rng.choice([1, 0.1, 0.01]) * rng.uniform(0.3, 1))

    at = rng.uniform(-1, 1, 3) * scale
    if kind == "sphere":
        return Sphere(at, size())
    if kind == "capsule":
        return Capsule(at, at + rng.normal(size=3) * size(), size())
    T = np.eye(4)
    T[:3, 3] = at
    turn = rng.integers(0, 4, 3) * np.pi / 2 if rng.random() < 0.3 else rng.normal(size=3)
    T[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    rounding = float(rng.choice([0.0, 0.1 * scale]))
    if kind == "box":
        return Box((size(), size(), size()), T, rounding=rounding)
    if kind == "cylinder":
        return Cylinder(size(), size(), T, rounding=rounding)
    points = rng.normal(size=(rng.integers(5, 40), 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return Polytope(points * (size(), size(), size()) + at, rounding=rounding)


# ---- drawn -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_clearances_are_proven_by_their_directions_and_are_coals(one: str, other: str) -> None:
    rng = np.random.default_rng([KINDS.index(one), KINDS.index(other)])
    # Coal's distances of cylinders, and of large boxes, are further off than its tolerance.
    off = 1e-4 if "cylinder" in (one, other) else 2e-6
    for _ in range(60):
        scale = float(rng.choice([1.0, 10.0]))
        shapes = drawn(one, rng, scale), drawn(other, rng, scale)
        a, b = map(body_of, shapes)
        clearance, n, apart = nearest(a, b)
        measured = distance(*map(placed_shape, shapes))
        if not apart:
            assert measured <= off * scale
            assert clearance <= 0
            continue
        assert clearance == pytest.approx(gap(a, b, n), abs=1e-13 * scale)
        assert clearance == pytest.approx(measured, abs=off * scale)
        back, turned, _ = nearest(b, a)
        assert back == pytest.approx(clearance, abs=1e-10)
        assert gap(a, b, -turned) == pytest.approx(clearance, abs=1e-10)


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_no_direction_near_by_proves_more_for_bodies_that_all_but_touch(one: str, other: str) -> None:
    rng = np.random.default_rng([9, KINDS.index(one), KINDS.index(other)])
    for between in GAPS * 5:
        a, b = body_of(drawn(one, rng, 1.0)), body_of(drawn(other, rng, 1.0))
        a = moved(a, p=3 * rng.normal(size=3))
        clearance, n, apart = nearest(a, b)
        cores = clearance + float(a["radius"]) + float(b["radius"])  # type: ignore[arg-type]
        if not apart:
            continue
        a = moved(a, p=(between - cores) * n)  # the cores are `between` apart
        clearance, n, apart = nearest(a, b)
        assert apart
        best = max(gap(a, b, n + rng.normal(size=3) * 10.0**-k) for k in range(3, 11) for _ in range(8))
        assert best <= clearance + 2e-11


# ---- formulas --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("between", GAPS)
@pytest.mark.parametrize("seed", range(5))
def test_faces_that_all_but_touch_have_the_true_normal(between: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    below = hull(CORNERS * (1, 2, 0.1) - 0.1 * Z)
    spun = Rotation.from_rotvec(rng.uniform(0, 6) * Z).as_matrix()
    x, y = rng.uniform(-0.6, 0.6, 2)
    for upper in (
        moved(hull(CORNERS * (0.3, 0.5, 0.2)), spun, (x, y, 0.2)),
        moved(hull(0.2 * np.stack([-Z, Z]), disc=0.3), spun, (x, y, 0.2)),  # a cylinder that stands
        moved(hull([[-0.2, 0, 0], [0.2, 0, 0]], disc=0.3, axis=(1, 0, 0)), spun, (x, y, 0.3)),  # and one that lies
        moved(hull([[-0.2, 0, 0], [0.2, 0, 0]]), spun, (x, y, 0)),
        moved(hull([[0.4, 0, 0], [-0.3, 0.4, 0], [0, -0.5, 0], [0, 0, 0.7]]), spun, (x, y, 0)),
    ):
        clearance, n, apart = nearest(moved(upper, R, R @ (between * Z)), moved(below, R))
        assert apart
        assert clearance == pytest.approx(between, abs=2e-15 + 1e-11 * bool(upper["disc"]))
        exact = 1e-12 if not upper["disc"] else 1e-10
        assert np.abs(n - R @ Z).max() <= exact


@pytest.mark.parametrize("between", GAPS)
def test_edges_that_all_but_touch_have_the_normal_of_both(between: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        R, turn = (Rotation.from_rotvec(rng.normal(size=3)).as_matrix() for _ in range(2))
        along = Rotation.from_rotvec(rng.uniform(0.3, 1.2) * Z).as_matrix() @ (1, 0, 0)
        low, high = np.array([[-1, 0, 0], [1.0, 0, 0]]), np.stack([-along, along]) + between * Z
        for a, b in (
            (hull(high), hull(low)),
            (hull([*high, along + Z, 0.1 * turn[0] + 2 * Z]), hull([*low, -0.5 * Z])),
        ):
            clearance, n, apart = nearest(moved(a, R), moved(b, R))
            assert apart
            assert clearance == pytest.approx(between, abs=4e-15)
            assert np.abs(n - R @ Z).max() <= 1e-12


def test_points_and_segments_by_hand() -> None:
    point = hull([0, 0, 3], radius=0.5)
    for segment, expected in (
        ([[-1, 0, 0], [1, 0, 0]], 3),
        ([[1, 0, 0], [2, 0, 0]], np.sqrt(10)),
        ([[-4, 0, 3], [-4, 0, 3]], 4),
        ([[0, 0, 1], [0, 0, 2]], 1),
    ):
        assert nearest(point, hull(segment, radius=0.25))[0] == pytest.approx(expected - 0.75, abs=1e-15)
    across = hull([[0, -1, 2], [0, 1, 2]])
    for segment, expected in (
        ([[-1, 0, 0], [1, 0, 0]], 2),
        ([[-1, 0.5, 0], [-1, 3, 0]], np.sqrt(5)),  # parallel
        ([[0, 2, 2], [0, 3, 2]], 1),  # in line
        ([[5, 0, 2], [5, 0, 2]], 5),
    ):
        assert nearest(across, hull(segment))[0] == pytest.approx(expected, abs=1e-15)


def test_a_sphere_and_a_cylinder_by_hand() -> None:
    can = hull([[0, 0, -1], [0, 0, 1]], disc=0.5, radius=0.1)
    for at, expected in (
        ((0, 0, 3), 2),
        ((0.4, 0, 3), 2),
        ((2, 0, 0.5), 1.5),
        ((3.5, 0, 5), 5),
        ((0.2, 0.1, 0.3), 0),
    ):
        clearance, _, apart = nearest(hull(at, radius=0.2), can)
        assert clearance == pytest.approx(expected - 0.3, abs=1e-15)
        assert apart == (expected > 0)
    plate = hull([0, 0, 0], disc=0.5)
    assert nearest(hull([0.1, 0, 0.7]), plate)[0] == pytest.approx(0.7, abs=1e-15)


def test_a_half_space_takes_the_lowest_point() -> None:
    floor = body_of(HalfSpace((0, 0, 2), (0, 0, 0.5)))
    for body, lowest in (
        (hull([0, 0, 1], radius=0.1), 0.9),
        (hull(CORNERS + 2 * Z), 1.0),
        (hull([[0, 0, 2], [2, 0, 2]], disc=0.3, axis=(1, 0, 0)), 1.7),
    ):
        clearance, n, apart = nearest(body, floor)
        assert clearance == pytest.approx(lowest - 0.5, abs=1e-15)
        assert apart
        assert n.tolist() == [0, 0, 1]
        assert nearest(floor, body)[1].tolist() == [0, 0, -1]
    assert not nearest(hull([[0, 0, 1], [0, 0, 0.4]]), floor)[2]


@pytest.mark.parametrize("seed", range(30))
def test_degenerate_hulls_are_what_they_look_like(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-1, 1, (2, 3))
    shares = np.concatenate([[0, 1, 1, 0], rng.uniform(0, 1, 5)])
    line, segment = hull(a + shares[:, None] * (b - a)), hull([a, b])
    corners = a + CORNERS[:, :2] @ rng.normal(size=(2, 3))  # flat, every corner twice
    other = moved(body_of(drawn(str(rng.choice(KINDS)), rng, 1.0)), p=4 * rng.normal(size=3))
    for odd, plain in (
        (line, segment),
        (hull(np.repeat(a[None], 5, axis=0)), hull(a)),
        (hull(corners), hull(np.unique(corners.round(14), axis=0))),
        (hull([a, a]), hull(a)),
    ):
        expected = nearest(plain, other)[0]
        assert nearest(odd, other)[0] == pytest.approx(expected, abs=2e-11)
        assert nearest(other, odd)[0] == pytest.approx(expected, abs=2e-11)


@pytest.mark.parametrize("seed", range(30))
def test_a_box_with_its_corners_in_another_order_is_the_same_body(seed: int) -> None:
    rng = np.random.default_rng(seed)
    box = body_of(drawn("box", rng, 1.0))
    shuffled = box | {"points": np.ascontiguousarray(np.asarray(box["points"])[rng.permutation(8)])}
    ball = hull(rng.uniform(-2, 2, 3), radius=0.01)
    clearance, n, apart = nearest(ball, box)
    assert nearest(ball, shuffled)[2] == apart
    if apart:
        assert nearest(ball, shuffled)[0] == pytest.approx(clearance, abs=1e-13)
        assert nearest(ball, shuffled)[1] == pytest.approx(n, abs=1e-9)


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_far_away_and_tiny_bodies_have_the_same_clearance(one: str, other: str) -> None:
    rng = np.random.default_rng([7, KINDS.index(one), KINDS.index(other)])
    for _ in range(20):
        a, b = moved(body_of(drawn(one, rng, 1.0)), p=3 * rng.normal(size=3)), body_of(drawn(other, rng, 1.0))
        clearance, _, apart = nearest(a, b)
        away = 1e3 * rng.normal(size=3)
        far, _, far_apart = nearest(moved(a, p=away), moved(b, p=away))
        tiny, tiny_n, tiny_apart = nearest(moved(a, scale=1e-3), moved(b, scale=1e-3))
        assert apart == far_apart == tiny_apart
        if apart:
            assert far == pytest.approx(clearance, abs=2e-11)
            assert tiny == pytest.approx(1e-3 * clearance, abs=2e-11)
            assert gap(a, b, tiny_n) >= clearance - 2e-8
        else:
            assert max(clearance, far, tiny) <= 0


def test_bodies_that_overlap_are_not_apart() -> None:
    rng = np.random.default_rng(3)
    for one, other in product(KINDS, KINDS):
        a, b = body_of(drawn(one, rng, 1.0)), body_of(drawn(other, rng, 1.0))
        a = moved(a, p=np.asarray(b["points"]).mean(axis=0) - np.asarray(a["points"]).mean(axis=0))
        clearance, n, apart = nearest(a, b)
        cores = clearance + float(a["radius"]) + float(b["radius"])  # type: ignore[arg-type]
        assert cores <= 1e-15  # two points, say, are only at the same place up to rounding
        assert not apart or cores > 0
        assert gap(a, b, n) <= 1e-15


def test_a_body_without_points_is_refused() -> None:
    with pytest.raises(ValueError, match="no points"):
        native_finder.PlacedBody(**hull(np.zeros((0, 3))))  # type: ignore[arg-type]


def test_a_box_of_an_obstacle_is_recognised() -> None:
    box = Box((1, 2, 3), pose((0.1, 0.2, 0.3), (1, 0.3, 0.2, 0.1)))
    assert nearest(hull([3, 3, 3]), body_of(box))[0] == pytest.approx(
        distance(placed_shape(Sphere((3, 3, 3), 1e-9)), placed_shape(box)), abs=1e-8
    )


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 1e308, 1e200])
def test_numbers_that_are_none_come_to_an_end(number: float) -> None:
    rng = np.random.default_rng(0)
    for one, other in product(KINDS, KINDS):
        a, b = body_of(drawn(one, rng, 1.0)), body_of(drawn(other, rng, 1.0))
        a["points"] = np.array(a["points"])
        a["points"][-1, 1] = number  # type: ignore[index]
        made = [native_finder.PlacedBody(**body) for body in (a, b)]  # type: ignore[arg-type]
        clearance, n, apart = native_finder.nearest_points(*made)
        assert not apart or np.isfinite(n).all(), clearance
