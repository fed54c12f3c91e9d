"""Fewer triangles for pictures: how many, how far points move, what stays."""

import numpy as np
import pytest
import trimesh

from spacearm.geometry.mesh_decimation import Surface, decimated, welded


def surface_of(mesh: trimesh.Trimesh, colors: np.ndarray | None = None) -> Surface:
    """A mesh of trimesh's, taken apart and put together again."""
    return welded(np.asarray(mesh.triangles), colors)


def as_mesh(surface: Surface) -> trimesh.Trimesh:
    """The surface as trimesh has it."""
    return trimesh.Trimesh(surface.points, surface.faces, process=False)


def test_corners_at_one_place_become_one() -> None:
    box = surface_of(trimesh.creation.box())
    assert (len(box.points), len(box.faces)) == (8, 12)
    assert as_mesh(box).is_watertight


def test_flat_and_repeated_triangles_are_left_out() -> None:
    triangles = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 2 + [[[0, 0, 0], [1, 0, 0], [0, 0, 0]]])
    colors = np.array([[1.0, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]])
    surface = welded(triangles, colors)
    assert len(surface.faces) == 1
    assert surface.colors is not None
    np.testing.assert_array_equal(surface.colors, colors[:1])


def test_few_triangles_stay_as_they_are() -> None:
    ball = surface_of(trimesh.creation.icosphere(3))
    (same,), cell = decimated([ball], 1280)
    assert same is ball
    assert cell == 0


@pytest.mark.parametrize("most", [10_000, 2_000, 1_000])
def test_many_triangles_become_few(most: int) -> None:
    ball = surface_of(trimesh.creation.icosphere(5, radius=0.5))
    (fewer,), cell = decimated([ball], most)
    assert most / 4 < len(fewer.faces) <= most
    off = np.abs(np.linalg.norm(fewer.points, axis=1) - 0.5)
    assert off.max() < cell * np.sqrt(3)
    assert as_mesh(fewer).volume == pytest.approx(as_mesh(ball).volume, rel=0.05)


def test_sharp_edges_stay() -> None:
    fine = trimesh.creation.box((1, 0.6, 0.3)).subdivide_to_size(0.02)
    (fewer,), cell = decimated([surface_of(fine)], 1500)
    assert cell > 0.02
    low, high = fewer.points.min(axis=0), fewer.points.max(axis=0)
    np.testing.assert_allclose(high - low, (1, 0.6, 0.3), atol=2e-3)
    assert as_mesh(fewer).volume == pytest.approx(0.18, rel=0.02)


def test_meshes_are_as_fine_as_each_other_and_small_ones_keep_their_form() -> None:
    large = surface_of(trimesh.creation.icosphere(5, radius=1.0))
    small = surface_of(trimesh.creation.icosphere(4, radius=0.01))
    (one, other), cell = decimated([large, small], 3000)
    assert cell > 0.02  # the small one would be a point
    assert as_mesh(other).volume == pytest.approx(as_mesh(small).volume, rel=0.15)
    assert len(one.faces) > len(other.faces)


def test_colours_go_with_their_triangles() -> None:
    mesh = trimesh.creation.icosphere(5)
    above = mesh.triangles_center[:, 2] > 0
    colors = np.where(above[:, None], [1.0, 0, 0, 1], [0, 0, 1.0, 1])
    (fewer,), cell = decimated([surface_of(mesh, colors)], 2000)
    assert fewer.colors is not None
    middle = fewer.points[fewer.faces].mean(axis=1)[:, 2]
    clear = np.abs(middle) > 2 * cell
    assert (fewer.colors[clear, 0] == (middle[clear] > 0)).all()


def test_nothing_is_fine() -> None:
    assert decimated([], 10) == ([], 0.0)
