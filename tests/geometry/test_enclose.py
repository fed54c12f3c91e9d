"""Meshes and point clouds enclosed in balls: all of it is held, and no ball stands out by more than is said."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError, SceneError
from spacearm.geometry import Scene, Sphere, SphereSet, enclose_mesh, enclose_points, pose
from spacearm.geometry.mesh_queries import Inside, Surface
from spacearm.geometry.mesh_topology import solid_of
from spacearm.geometry.meshes import read_points
from spacearm.geometry.scene import scene_as_list, scene_from_list
from support import strategies
from support.messages import assert_refused

COORDINATE = st.floats(-1.0, 1.0, allow_subnormal=False)
QUICK = hypothesis_settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])

CLOSED: dict[str, Callable[[], trimesh.Trimesh]] = {
    "cube": lambda: trimesh.creation.box((1, 1, 1)),
    "plate": lambda: trimesh.creation.box((0.7, 0.7, 0.04)),
    "ball": lambda: trimesh.creation.icosphere(2, 0.5),
    "ring": lambda: trimesh.creation.annulus(0.3, 0.5, 0.4),
    "rod": lambda: trimesh.creation.cylinder(0.05, 1.0),
    "cone": lambda: trimesh.creation.cone(0.3, 0.5),
    "tetrahedron": lambda: trimesh.convex.convex_hull(np.eye(4, 3)),
}
EXCESS = 0.04


def apart(points: np.ndarray, balls: SphereSet) -> np.ndarray:
    """How far points (n, 3) are outside of the balls, below 0 within, (n,) [m]."""
    out = np.full(len(points), np.inf)
    for i in range(0, len(balls.radii), 64):
        away = np.linalg.norm(points[:, None] - balls.centers[i : i + 64], axis=2) - balls.radii[i : i + 64]
        out = np.minimum(out, away.min(axis=1))
    return out


def on_triangles(triangles: np.ndarray, rng: np.random.Generator, count: int = 4000) -> np.ndarray:
    """Points of triangles (n, 3, 3), their corners and points of their edges too, (m, 3)."""
    weights = rng.dirichlet((0.7, 0.7, 0.7), count)
    inner = np.einsum("ij,ijk->ik", weights, triangles[rng.integers(0, len(triangles), count)])
    share = rng.random((len(triangles), 3, 1))
    edges = share * triangles + (1 - share) * np.roll(triangles, 1, axis=1)
    return np.concatenate([inner, edges.reshape(-1, 3), triangles.reshape(-1, 3)])


def within(mesh: trimesh.Trimesh, rng: np.random.Generator, count: int = 3000) -> np.ndarray:
    """Points inside a closed mesh, by trimesh's own test."""
    points = rng.uniform(*mesh.bounds, (count, 3))
    return points[mesh.contains(points)]


@pytest.mark.parametrize("name", CLOSED)
def test_all_of_a_solid_is_held_and_no_ball_stands_out_too_far(name: str) -> None:
    mesh, rng = CLOSED[name](), np.random.default_rng(1)
    balls = enclose_mesh(mesh, excess=EXCESS, name=name)
    assert balls.excess is not None
    assert balls.excess <= EXCESS + 1e-8
    assert apart(on_triangles(np.array(mesh.triangles), rng), balls).max() <= 0
    assert apart(within(mesh, rng), balls).max() <= 0
    turned = rng.normal(size=(3, len(balls.radii), 3))
    rims = balls.centers + balls.radii[:, None] * turned / np.linalg.norm(turned, axis=2, keepdims=True)
    out = -trimesh.proximity.signed_distance(mesh, rims.reshape(-1, 3)[:1500])
    assert out.max() <= balls.excess + 1e-9


@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("count", [1, 7, 40])
def test_so_many_balls_and_no_more(name: str, count: int) -> None:
    mesh, rng = CLOSED[name](), np.random.default_rng(1)
    balls = enclose_mesh(mesh, spheres=count)
    assert len(balls.radii) <= count
    assert apart(on_triangles(np.array(mesh.triangles), rng), balls).max() <= 0
    assert apart(within(mesh, rng, 500), balls).max() <= 0


def test_one_ball_is_nearly_the_least() -> None:
    assert enclose_mesh(CLOSED["cube"](), spheres=1).radii[0] < 0.5 * np.sqrt(3) * 1.01


def test_more_balls_stand_out_less() -> None:
    excess = [enclose_mesh(CLOSED["ring"](), spheres=count).excess for count in (1, 8, 64, 300)]
    assert all(a is not None and b is not None and b < 0.8 * a for a, b in pairwise(excess))
    numbers = [len(enclose_mesh(CLOSED["ring"](), excess=e).radii) for e in (0.2, 0.1, 0.05)]
    assert numbers == sorted(numbers)


def test_what_lies_deep_takes_few_balls() -> None:
    """A ball on the surface holds a disc no wider than the excess; one from deep inside holds far more."""
    assert len(enclose_mesh(CLOSED["cube"](), excess=0.02).radii) < 1100  # a ball for each (2 * 0.02)^2 of its sides: 3750


@st.composite
def soups(draw: st.DrawFn) -> np.ndarray:
    """Triangles anywhere, (n, 3, 3); some are segments or points, some are slivers, some have corners in common."""
    points = np.array(draw(st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=1, max_size=9)))
    corner = st.integers(0, len(points) - 1)
    faces = np.array(draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=12)))
    flat = draw(st.sampled_from([1.0, 1e-3, 0.0]))
    return points[faces] * (1.0, 1.0, flat)


@QUICK
@given(soups(), st.sampled_from([0.03, 0.1, 0.5]), st.integers(0, 9))
def test_any_triangles_are_held(triangles: np.ndarray, excess: float, seed: int) -> None:
    balls = enclose_mesh(triangles, excess=excess)
    assert balls.excess is not None
    assert balls.excess <= excess + 1e-8
    assert apart(on_triangles(triangles, np.random.default_rng(seed), 800), balls).max() <= 0


@QUICK
@given(soups(), st.integers(1, 12), st.integers(0, 9))
def test_any_triangles_are_held_by_so_many_balls(triangles: np.ndarray, count: int, seed: int) -> None:
    balls = enclose_mesh(triangles, spheres=count)
    assert len(balls.radii) <= count
    assert apart(on_triangles(triangles, np.random.default_rng(seed), 300), balls).max() <= 0


def test_slivers_whose_corners_nearly_are_one_are_held() -> None:
    """Corners that are taken for one in looking for the inside are not taken for one in what is enclosed."""
    slivers = np.array([[(0, 0, 1e-9), (0, 0, 0.75), (0, 0, 0.7500001)], [(0, 0, 0), (0, 0, 1e-9), (0.3, 0, 1)]])
    for triangles in (slivers, slivers[:1], slivers[1:], np.concatenate([slivers, BOX])):
        for how in ({"excess": 0.05}, {"spheres": 1}):
            balls = enclose_mesh(triangles, **how)  # type: ignore[arg-type]
            assert apart(on_triangles(triangles, np.random.default_rng(0), 300), balls).max() <= 0


def _in_hull(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    middle = mesh.vertices.mean(axis=0)
    heights = np.einsum("ijk,jk->ij", points[:, None] - mesh.triangles[:, 0], mesh.face_normals)
    sides = np.sign(np.einsum("jk,jk->j", middle - mesh.triangles[:, 0], mesh.face_normals))
    return (heights * sides >= 0).all(axis=1)


@QUICK
@given(
    st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=5, max_size=12, unique=True),
    strategies.transforms(),
    st.sampled_from([1.0, 0.01, (1.0, 2.0, -0.5)]),
)
def test_a_hull_is_held_where_it_was_put(corners: list[tuple[float, float, float]], T: np.ndarray, scale: Any) -> None:
    try:
        mesh = trimesh.convex.convex_hull(np.array(corners))
    except Exception:  # flat
        return
    if not mesh.is_watertight or mesh.volume < 1e-4:
        return
    balls = enclose_mesh(mesh, excess=0.15 * np.max(np.abs(scale)), pose=T, scale=scale)
    weights = np.random.default_rng(0).dirichlet(np.full(len(mesh.vertices), 0.3), 1500)
    points = (weights @ mesh.vertices * scale) @ T[:3, :3].T + T[:3, 3]
    assert apart(points, balls).max() <= 0
    placed = trimesh.Trimesh((mesh.vertices * scale) @ T[:3, :3].T + T[:3, 3], mesh.faces, process=False)
    turned = np.random.default_rng(1).normal(size=(150, 3))
    ball = np.arange(150) % len(balls.radii)
    rims = balls.centers[ball] + balls.radii[ball, None] * turned / np.linalg.norm(turned, axis=1, keepdims=True)
    _, away, _ = trimesh.proximity.closest_point(placed, rims[~_in_hull(placed, rims)])
    assert balls.excess is not None
    assert away.max(initial=0.0) <= balls.excess + 1e-6  # trimesh's distances are rough


def test_a_mesh_far_away_is_held_as_well() -> None:
    mesh = CLOSED["ring"]()
    balls = enclose_mesh(mesh, excess=0.05, pose=pose((3e3, -2e3, 1e3), (1, 0.2, 0.3, 0.4)), scale=1.0)
    near = enclose_mesh(mesh, excess=0.05)
    T = pose((3e3, -2e3, 1e3), (1, 0.2, 0.3, 0.4))
    np.testing.assert_allclose(balls.centers, near.centers @ T[:3, :3].T + T[:3, 3], atol=1e-9)
    mesh.apply_translation((3e3, -2e3, 1e3))
    balls = enclose_mesh(mesh, excess=0.05)
    assert apart(on_triangles(np.array(mesh.triangles), np.random.default_rng(0)), balls).max() <= 0


def test_overlapping_parts_are_held_inside() -> None:
    a, b = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1))
    b.apply_translation((0.5, 0.3, 0.2))
    points = np.random.default_rng(0).uniform(-1, 1.5, (2000, 3))
    expected = (np.abs(points) < 0.5).all(axis=1) | (np.abs(points - (0.5, 0.3, 0.2)) < 0.5).all(axis=1)
    for second in (b.triangles, b.triangles[:, ::-1]):  # the second one inside out: where both are, it winds 0 times
        inside = solid_of(np.concatenate([a.triangles, second])).inside
        assert inside is not None
        np.testing.assert_array_equal(inside(points), expected)


def test_a_cavity_is_solid_unless_faces_that_turn_inward_are_to_leave_it_free() -> None:
    hole = trimesh.creation.icosphere(3, 0.4)
    hole.invert()
    tank = trimesh.util.concatenate([trimesh.creation.box((1, 1, 1)), hole])
    filled = enclose_mesh(tank, excess=0.05)
    assert apart(np.zeros((1, 3)), filled) < 0
    assert any("cavities" in note for note in filled.notes)
    free = enclose_mesh(tank, excess=0.05, inside="oriented")
    assert apart(np.zeros((1, 3)), free) > 0.2
    assert apart(on_triangles(np.array(tank.triangles), np.random.default_rng(0)), free).max() <= 0
    assert apart(np.array([(0.45, 0.45, 0.45)]), free) <= 0
    assert apart(np.zeros((1, 3)), enclose_mesh(trimesh.creation.box((1, 1, 1)), excess=0.05, inside="none")) > 0.2


def test_an_open_mesh_is_a_skin_and_says_so() -> None:
    box = trimesh.creation.box((1, 1, 1))
    lid_off = trimesh.Trimesh(box.vertices, box.faces[:-2])
    balls = enclose_mesh(lid_off, excess=0.05)
    assert apart(np.zeros((1, 3)), balls) > 0.2
    assert any("open" in note for note in balls.notes)
    twice = enclose_mesh(
        trimesh.Trimesh(box.vertices, np.vstack([lid_off.faces, lid_off.faces[:, ::-1]]), process=False), excess=0.05
    )
    assert apart(np.zeros((1, 3)), twice) > 0.2
    assert any("open" in note for note in twice.notes)
    both = solid_of(np.concatenate([np.array([3.0, 0, 0]) + lid_off.triangles, box.triangles])).inside
    assert both is not None
    assert both(np.zeros((1, 3)))[0]
    assert not both(np.array([[3.0, 0, 0]]))[0]


BOX = np.array(trimesh.creation.box((1, 1, 1)).triangles)
FINE = np.array(trimesh.creation.box((1, 1, 1)).subdivide().subdivide().triangles)
HALVED = np.concatenate(
    [BOX[1:], [[BOX[0, 0], (BOX[0, 0] + BOX[0, 1]) / 2, BOX[0, 2]], [(BOX[0, 0] + BOX[0, 1]) / 2, *BOX[0, 1:]]]]
)
OTHER_DIAGONALS = np.array(trimesh.creation.box((1, 1, 1), transform=np.diag((-1, 1, 1, 1))).triangles)
MIDDLES = BOX.mean(axis=1, keepdims=True)
WALL = np.array([[(0, -0.5, -0.5), (0, 0.5, -0.5), (0, 0.5, 0.5)], [(0, -0.5, -0.5), (0, 0.5, 0.5), (0, -0.5, 0.5)]])
AS_PEOPLE_HAVE_THEM: dict[str, np.ndarray] = {
    "double-sided": np.concatenate([BOX, BOX[:, ::-1]]),
    "there twice": np.concatenate([BOX, np.roll(BOX, 1, axis=1)]),
    "half of it double-sided": np.concatenate([BOX, BOX[:5, ::-1]]),
    "a second skin of other triangles": np.concatenate([BOX, FINE[:, ::-1]]),
    "a second skin of other diagonals": np.concatenate([BOX, OTHER_DIAGONALS]),
    "inside out": BOX[:, ::-1],
    "every other face turned": np.concatenate([BOX[::2], BOX[1::2, ::-1]]),
    "corners not merged": BOX + np.random.default_rng(0).uniform(-1e-7, 1e-7, BOX.shape),
    "an edge halved on one side": HALVED,
    "a small hole": FINE[1:],
    "one face missing": BOX[:-1],
    "gaps around every face": MIDDLES + 0.999 * (BOX - MIDDLES),
    "a wall inside": np.concatenate([BOX, WALL]),
    "faces without area": np.concatenate([BOX, BOX[:3, [0, 1, 1]], BOX[:3, [0, 0, 0]]]),
    "another part inside, turned inward": np.concatenate([BOX, 0.5 * BOX[:, ::-1]]),
    "another part inside": np.concatenate([BOX, 0.5 * BOX]),
    "two with a wall in common": np.concatenate([BOX, BOX + np.array((1.0, 0, 0))]),
    "a bottle with a narrow neck": np.concatenate([FINE[np.abs(FINE - (0.5, 0.0, 0.0)).max(axis=(1, 2)) > 0.3], BOX * 0.01]),
}


@pytest.mark.parametrize("name", AS_PEOPLE_HAVE_THEM)
def test_what_any_convention_calls_solid_is_held(name: str) -> None:
    triangles, rng = AS_PEOPLE_HAVE_THEM[name], np.random.default_rng(2)
    for scale, shift in ((1.0, 0.0), (800.0 * np.array((-1, 1, 1)), 3000.0)):
        balls = enclose_mesh(triangles * scale + shift, excess=0.1 * np.max(np.abs(scale)))
        assert apart(rng.uniform(-0.499, 0.499, (600, 3)) * scale + shift, balls).max() <= 0
        assert apart(on_triangles(triangles * scale + shift, rng, 500), balls).max() <= 0


def test_faces_that_disagree_on_the_outside_still_bound_an_inside() -> None:
    mesh = CLOSED["ring"]()
    triangles = np.array(mesh.triangles)
    triangles[::3] = triangles[::3, ::-1]
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (3000, 3))
    inside, plain = solid_of(triangles).inside, solid_of(np.array(mesh.triangles)).inside
    assert inside is not None
    assert plain is not None
    np.testing.assert_array_equal(inside(points), plain(points))
    np.testing.assert_array_equal(plain(points), mesh.contains(points))


def test_points_seen_through_corners_and_edges_are_told_right() -> None:
    box = trimesh.creation.box((2, 2, 2))
    inside = Inside(np.array(box.vertices), np.array(box.faces), oriented=True)
    grid = np.stack(np.meshgrid(*[np.arange(-2, 2.01, 0.5)] * 3), axis=-1).reshape(-1, 3)
    clear = (np.abs(np.abs(grid) - 1) > 1e-9).all(axis=1)
    np.testing.assert_array_equal(inside(grid[clear]), (np.abs(grid[clear]) < 1).all(axis=1))


@QUICK
@given(soups(), st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=1, max_size=20))
def test_the_nearest_point_is_the_nearest_of_many(triangles: np.ndarray, queries: list[tuple[float, float, float]]) -> None:
    points, surface = np.array(queries), Surface(triangles)
    distance, at = surface.nearest(points)
    np.testing.assert_allclose(np.linalg.norm(at - points, axis=1), distance)
    sampled = on_triangles(triangles, np.random.default_rng(0), 2000)
    least = np.linalg.norm(points[:, None] - sampled, axis=2).min(axis=1)
    assert (distance <= least + 1e-12).all()
    assert surface.nearest(at)[0].max() < 1e-7  # of a sliver's plane only so much is known


def test_the_distance_from_a_large_mesh_is_trimeshs() -> None:
    mesh = trimesh.creation.annulus(0.3, 0.5, 0.4)
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (400, 3))
    _, expected, _ = trimesh.proximity.closest_point(mesh, points)
    np.testing.assert_allclose(Surface(np.array(mesh.triangles)).nearest(points)[0], expected, atol=1e-6)  # theirs is rough


@QUICK
@given(st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=1, max_size=40), st.integers(0, 9))
def test_the_nearest_of_points_is_found(cloud: list[tuple[float, float, float]], seed: int) -> None:
    points = np.array(cloud)
    queries = np.concatenate([points, np.random.default_rng(seed).uniform(-2, 2, (30, 3))])
    distance, at = Surface(np.repeat(points[:, None], 3, axis=1)).nearest(queries)
    expected = np.linalg.norm(queries[:, None] - points, axis=2).min(axis=1)
    np.testing.assert_allclose(distance, expected, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(at - queries, axis=1), expected, atol=1e-15)


@QUICK
@given(
    st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=1, max_size=30),
    st.sampled_from([0.0, 0.02, 0.3]),
    st.sampled_from([0.01, 0.1, 1.0]),
)
def test_points_are_held_with_their_radius(cloud: list[tuple[float, float, float]], radius: float, excess: float) -> None:
    points = np.array(cloud)
    balls = enclose_points(points, point_radius=radius, excess=excess, name="dust")
    assert balls.name == "dust"
    assert apart(points, balls).max() <= -radius
    assert balls.excess is not None
    assert balls.excess <= excess + 1e-8
    turned = np.random.default_rng(0).normal(size=(200, 1, 3))
    rims = balls.centers + balls.radii[:, None] * turned / np.linalg.norm(turned, axis=2, keepdims=True)
    out = np.linalg.norm(rims[:, :, None] - points, axis=3).min(axis=2) - radius
    assert out.max() <= balls.excess + 1e-9


def test_one_point_and_points_at_one_place_make_one_ball() -> None:
    for cloud in ([(1, 2, 3)], [(1, 2, 3)] * 5):
        balls = enclose_points(cloud, point_radius=0.1)
        assert len(balls.radii) == 1
        np.testing.assert_allclose(balls.centers, [(1, 2, 3)])
        np.testing.assert_allclose(balls.radii, [0.1], atol=1e-8)


def test_files_are_read(tmp_path: Path) -> None:
    mesh = CLOSED["rod"]()
    expected = enclose_mesh(mesh, excess=0.02)
    for kind in ("stl", "obj", "ply", "glb", "off"):
        mesh.export(tmp_path / f"rod.{kind}")
        balls = enclose_mesh(tmp_path / f"rod.{kind}", excess=0.02)
        assert len(balls.radii) < 1.5 * len(expected.radii)
        assert apart(on_triangles(np.array(mesh.triangles), np.random.default_rng(0)), balls).max() <= 1e-6  # float32
    points = np.random.default_rng(0).random((50, 3))
    np.save(tmp_path / "p.npy", points)
    trimesh.PointCloud(points).export(tmp_path / "p.ply")
    (tmp_path / "p.csv").write_text("x,y,z,intensity\n" + "".join(f"{x},{y},{z},7\n" for x, y, z in points.tolist()))
    (tmp_path / "p.xyz").write_text("# a scan\n" + "".join(f"{x} {y}\t{z}\n" for x, y, z in points.tolist()))
    for kind in ("npy", "ply", "csv", "xyz"):
        np.testing.assert_allclose(read_points(tmp_path / f"p.{kind}"), points, atol=1e-6)


SOUP = np.random.default_rng(0).random((3, 3, 3))

REFUSED: dict[str, Any] = {
    "mesh a number": lambda: enclose_mesh(3.0),
    "mesh of four corners": lambda: enclose_mesh(np.zeros((2, 4, 3))),
    "mesh with ragged faces": lambda: enclose_mesh(SimpleNamespace(vertices=np.eye(3), faces=[[0, 1], [2]])),
    "mesh without triangles": lambda: enclose_mesh(np.zeros((0, 3, 3))),
    "mesh with NaN": lambda: enclose_mesh(SOUP * np.nan),
    "mesh of another unit": lambda: enclose_mesh(SOUP, scale=1e9),
    "mesh scale zero": lambda: enclose_mesh(SOUP, scale=0),
    "mesh scale text": lambda: enclose_mesh(SOUP, scale="mm"),
    "mesh scale ragged": lambda: enclose_mesh(SOUP, scale=[[1, 2], [3]]),
    "mesh scale of two": lambda: enclose_mesh(SOUP, scale=(1, 2)),
    "mesh pose sheared": lambda: enclose_mesh(SOUP, pose=np.triu(np.ones((4, 4)))),
    "mesh pose ragged": lambda: enclose_mesh(SOUP, pose=[[1, 2], [3]]),
    "mesh pose in a plane": lambda: enclose_mesh(SOUP, pose=(0, 0)),
    "spheres zero": lambda: enclose_mesh(SOUP, spheres=0),
    "spheres a fraction": lambda: enclose_mesh(SOUP, spheres=1.5),
    "spheres true": lambda: enclose_mesh(SOUP, spheres=True),
    "excess zero": lambda: enclose_mesh(SOUP, excess=0),
    "excess below rounding": lambda: enclose_mesh(SOUP, excess=1e-300),
    "excess text": lambda: enclose_mesh(SOUP, excess="1 mm"),
    "excess that takes more balls than given": lambda: enclose_mesh(SOUP, excess=0.01, spheres=3),
    "points none": lambda: enclose_points(np.zeros((0, 3))),
    "points in a plane": lambda: enclose_points([(0, 0)]),
    "points with NaN": lambda: enclose_points([(0, 0, np.nan)]),
    "points of another unit": lambda: enclose_points([(0, 0, 1e9)]),
    "point radius negative": lambda: enclose_points([(0, 0, 0)], point_radius=-1),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_enclosed_is_refused(case: str) -> None:
    assert_refused("scene", case, SceneError, REFUSED[case])


def test_an_excess_that_takes_too_many_balls_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spacearm.geometry.enclosing_balls._MOST_CELLS", 500)
    case = "excess that takes too many balls"
    assert_refused("scene", case, SceneError, lambda: enclose_mesh(SOUP, excess=1e-5, name="hull"))


FILES: dict[str, tuple[str, bytes]] = {
    "mesh file empty": ("a.stl", b""),
    "mesh file of no mesh": ("a.stl", b"solid nothing\nendsolid\n"),
    "mesh file with a point only": ("a.obj", b"v 0 0 0\n"),
}
POINT_FILES: dict[str, tuple[str, bytes]] = {
    "point file of words": ("a.xyz", b"x y z\nhello\n"),
    "point file of two columns": ("a.csv", b"1,2\n"),
    "point file with a gap": ("a.csv", b"1,2,3\n1,,3\n"),
    "point file with a gap before another column": ("a.csv", b"1,,3,4\n"),
    "point file with infinity": ("a.csv", b"1,2,3\n1,inf,3\n"),
    "point file of headings": ("a.csv", b"x,y,z\n"),
}


@pytest.mark.parametrize("case", [*FILES, *POINT_FILES])
def test_a_file_that_holds_nothing_to_enclose_is_refused(case: str, tmp_path: Path) -> None:
    name, content = {**FILES, **POINT_FILES}[case]
    (tmp_path / name).write_bytes(content)
    read = enclose_mesh if case in FILES else read_points
    assert_refused("scene", case, FileFormatError, lambda: read(tmp_path / name), path=tmp_path)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.txt", b"hello"),
        ("a.glb", b"glTF\x02\x00\x00\x00"),
        ("a.npy", b"\x93NUMPY\x01\x00v\x00{'descr': '|O', 'fortran_order': False, 'shape': (1,), }"),
        ("b.npy", b"PK\x03\x04"),
    ],
)
def test_what_another_librarys_reader_refuses_is_said_in_one_line(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FileFormatError, match=r"cannot be read as (a mesh|points) \(.*\), expected") as caught:
        (read_points if name.endswith("npy") else enclose_mesh)(tmp_path / name)
    assert "\n" not in str(caught.value)


@QUICK
@given(st.sampled_from(["stl", "obj", "ply", "off", "glb", "dae"]), st.binary(max_size=300), st.integers(0, 10**6))
def test_a_damaged_mesh_file_is_read_or_refused_in_one_line(kind: str, noise: bytes, at: int) -> None:
    import tempfile

    whole = trimesh.creation.box((1, 1, 1)).export(file_type=kind)
    content = bytearray(whole.encode() if isinstance(whole, str) else whole)
    place = at % len(content)
    content[place : place + len(noise)] = noise
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / f"mesh.{kind}"
        path.write_bytes(bytes(content))
        try:
            enclose_mesh(path, spheres=3)
            said = ""
        except (FileFormatError, SceneError) as error:
            said = str(error)
        assert "\n" not in said


def test_a_scene_tells_what_was_found_in_its_meshes() -> None:
    balls = enclose_mesh(BOX[:-4], spheres=2, name="tray")
    assert all(note.startswith("obstacle 'tray': ") for note in Scene([balls]).notes)
    assert any("open" in note for note in Scene([balls]).notes)
    assert scene_from_list(scene_as_list(Scene([balls]))) == Scene([balls])
    assert Scene([Sphere((0, 0, 0), 1)]).notes == ()


def test_an_unknown_way_to_tell_the_inside_is_refused() -> None:
    assert_refused("scene", "inside unknown", SceneError, lambda: enclose_mesh(BOX, inside="full"))  # type: ignore[arg-type]
    assert_refused("scene", "inside oriented of an open mesh", SceneError, lambda: enclose_mesh(BOX[1:], inside="oriented"))
    turned = np.concatenate([BOX[:1, ::-1], BOX[1:]])
    assert_refused("scene", "inside oriented of turned faces", SceneError, lambda: enclose_mesh(turned, inside="oriented"))
