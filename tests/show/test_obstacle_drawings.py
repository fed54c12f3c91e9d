"""How obstacles are drawn: outlines, extents, cuts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Scene, Sphere, SphereSet
from spacearm.planner import Problem
from spacearm.show import figure_clearance, figure_path_2d, figure_path_3d
from spacearm.show.outlines import common_outline, cut, cut_in_plane, hull, silhouette, span
from support import drawn_shapes
from support.drawn_runs import moved, texts, two_joints

CONVEX = drawn_shapes.convex_shapes()
VIEW = np.array([[0.6, 0.8, 0.0], [-0.48, 0.36, 0.8]])  # across, up
TOLERANCE = 1e-9
POLYGON = 1 - np.cos(np.pi / 72)  # by how much of its radius a circle of 72 corners falls short


def outside(points: np.ndarray, outline: np.ndarray) -> float:
    """How far points (k, 2) are out of a convex outline, counter-clockwise, at most."""
    edges = np.roll(outline, -1, axis=0) - outline
    lengths = np.linalg.norm(edges, axis=1)
    edges, outline = edges[lengths > 0], outline[lengths > 0]
    normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths[lengths > 0, None]
    return float(((points[:, None] - outline) * normals).sum(axis=2).max())


@given(drawn_shapes.bodies() | CONVEX | drawn_shapes.polytope_sets(), st.integers(0, 9))
def test_a_span_holds_the_body_and_no_more(body: Obstacle, seed: int) -> None:
    low, high = span(body)
    points = drawn_shapes.points_in(body, 4000, np.random.default_rng(seed))
    assert (points >= low - TOLERANCE).all()
    assert (points <= high + TOLERANCE).all()
    assert ((points.min(axis=0) - low) <= 0.25 * (high - low)).all()
    assert ((high - points.max(axis=0)) <= 0.25 * (high - low)).all()


@given(CONVEX, st.sampled_from([VIEW, np.eye(3)[:2]]), st.integers(0, 9))
def test_a_silhouette_holds_the_body_and_is_of_the_body(body: Obstacle, view: np.ndarray, seed: int) -> None:
    outline = silhouette(body, *view)  # type: ignore[arg-type]
    points = drawn_shapes.points_in(body, 500, np.random.default_rng(seed)) @ view.T
    size = max(*(span(body)[1] - span(body)[0]), 0.0)
    assert outside(points, outline @ view.T) <= POLYGON * size + TOLERANCE
    low, high = span(body)
    assert (outline >= low - 10 * TOLERANCE).all()
    assert (outline <= high + 10 * TOLERANCE).all()


@given(st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=12))
def test_a_hull_holds_its_points_and_turns_one_way(drawn: list[tuple[int, int]]) -> None:
    points = np.array(drawn, dtype=float)
    corners = points[hull(points)]
    assert {tuple(c) for c in corners.tolist()} <= {tuple(p) for p in points.tolist()}
    if len(corners) > 2:
        assert outside(points, corners) <= 1e-12
        turned = np.roll(corners, -1, axis=0) - corners
        assert (turned[:, 0] * np.roll(turned[:, 1], -1) - turned[:, 1] * np.roll(turned[:, 0], -1) > 0).all()


@given(drawn_shapes.half_spaces())
def test_a_cut_lies_in_the_plane_and_the_box(half_space: HalfSpace) -> None:
    low, high = np.array([-1.0, -0.5, -0.2]), np.array([1.0, 1.5, 0.4])
    corners = cut(half_space, low, high)
    assert np.abs((corners - half_space.point) @ half_space.normal).max(initial=0.0) < TOLERANCE
    assert (corners >= low - TOLERANCE).all()
    assert (corners <= high + TOLERANCE).all()


@given(drawn_shapes.half_spaces(), st.integers(0, 9))
def test_the_part_of_a_rectangle_that_is_solid(half_space: HalfSpace, seed: int) -> None:
    low, high = np.array([-1.0, -0.5]), np.array([1.0, 1.5])
    if np.hypot(*half_space.normal[:2]) < 1e-9:
        assert not len(cut_in_plane(half_space, low, high))
        return
    corners = cut_in_plane(half_space, low, high)
    points = low + np.random.default_rng(seed).random((200, 2)) * (high - low)
    solid = (np.column_stack([points, np.zeros(200)]) - half_space.point) @ half_space.normal < -TOLERANCE
    if solid.any():
        assert outside(points[solid], corners) < 1e-6
    assert len(corners) or not solid.any()


def test_discs_that_overlap_have_one_outline() -> None:
    outline = common_outline(np.array([[0.0, 0.0], [0.6, 0.0], [5.0, 0.0]]), np.array([0.5, 0.5, 0.1]))
    points = outline[~np.isnan(outline).any(axis=1)]
    for center, radius in (((0, 0), 0.5), ((0.6, 0), 0.5), ((5, 0), 0.1)):
        assert (np.linalg.norm(points - center, axis=1) >= radius - 1e-9).all()
    assert len(common_outline(np.zeros((3000, 2)), np.ones(3000))) == 0


EVERY_SHAPE = Scene(
    [
        Box((0.3, 0.2, 0.5), (0.9, 0.9, 0.0), name="locker"),
        Cylinder(0.12, 0.5, (0.2, -0.6, 0.1)),
        Capsule((-0.3, 0.2, 0), (-0.5, 0.6, 0.4), 0.08, name="rail"),
        Capsule((-0.3, 0.2, 0), (-0.3, 0.2, 0), 0.08),
        HalfSpace((0, 0, 1), (0, 0, -0.35)),
        HalfSpace((1, 0.3, 0), (-0.8, 0, 0)),
        HalfSpace((1, 0, 0), (-90, 0, 0)),
        Sphere((-0.2, -0.4, 0.2), 0.15),
        SphereSet(np.random.default_rng(0).normal(size=(250, 3)) * 0.2, np.full(250, 0.05)),
    ]
)


@pytest.mark.parametrize("figure_path", [figure_path_2d, figure_path_3d])
def test_every_shape_can_be_drawn_and_is_in_the_picture(figure_path) -> None:
    robot = two_joints()
    figure = figure_path(moved(robot), robot=robot, scene=EVERY_SHAPE, start=[0, 0])
    figure.canvas.draw()
    ax = figure.axes[0]
    bodies = [span(o) for o in EVERY_SHAPE.obstacles if not isinstance(o, HalfSpace)]
    assert ax.get_xlim()[0] <= min(low[0] for low, _ in bodies)
    assert ax.get_ylim()[1] >= max(high[1] for _, high in bodies)
    assert ax.get_xlim()[0] > -2  # a plane far away does not widen it
    near = Scene([HalfSpace((0, 1, 0), (0, -0.3, 0))])
    assert figure_path(moved(robot), robot=robot, scene=near, start=[0, 0]).axes[0].get_ylim()[0] < -0.3


@hypothesis_settings(max_examples=8, deadline=None)
@given(st.lists(drawn_shapes.obstacles(), max_size=3).map(Scene))
def test_any_scene_can_be_drawn(scene: Scene) -> None:
    robot = two_joints()
    for figure_path in (figure_path_2d, figure_path_3d):
        figure_path(moved(robot), robot=robot, scene=scene, start=[0, 0]).canvas.draw()


def test_a_clearance_is_labelled_with_the_obstacles_name() -> None:
    trajectory = moved(two_joints())
    scene = Scene([Sphere((0.2, 0.9, 0.1), 0.15, name="docking port"), Sphere((1.0, -0.4, 0.0), 0.1)])
    assert Problem(trajectory.robot, scene, start=[0, 0], goal=[0.1, 0.1]).scene is scene
    text = texts(figure_clearance(trajectory, scene=scene))
    assert "docking port" in text
    assert "obstacle 1" in text
