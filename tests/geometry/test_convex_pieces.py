"""Meshes in convex pieces: all of a solid is in one of them, and none stands out by more than is said.

The pieces are judged by the planes of SciPy's hulls, what is inside a mesh by trimesh, and distances by trimesh.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from spacearm.core.errors import FileFormatError, SceneError
from spacearm.core.long_work import on_progress
from spacearm.geometry import PolytopeSet, Scene, convex_pieces, pose
from spacearm.geometry import convex_pieces as make_pieces
from spacearm.geometry.scene import scene_as_list, scene_from_list
from support.drawn_meshes import drawn_mesh, solid_points, surface_points
from support.oracles.polytopes import outside_polytopes

CREATE = trimesh.creation
Shapes = dict[str, Callable[[], trimesh.Trimesh]]


def joined(*parts: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.util.concatenate(list(parts))


def box(size: tuple[float, float, float], at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    return CREATE.box(size, transform=trimesh.transformations.translation_matrix(at))


def extruded(*outline: tuple[float, float], height: float = 0.4) -> trimesh.Trimesh:
    """A prism over an outline that is seen whole from its first corner."""
    count = len(outline)
    low, high = (np.column_stack([np.array(outline), np.full(count, z)]) for z in (0.0, height))
    faces = [(0, i + 1, i) for i in range(1, count - 1)] + [(count, count + i, count + i + 1) for i in range(1, count - 1)]
    for i in range(count):
        k = (i + 1) % count
        faces += [(i, k, k + count), (i, k + count, i + count)]
    return trimesh.Trimesh(np.concatenate([low, high]), faces, process=False)


CONVEX: Shapes = {
    "cube": lambda: box((1, 1, 1)),
    "plate": lambda: box((1, 0.7, 1e-4)),
    "rod": lambda: CREATE.cylinder(0.05, 1.0),
    "cone": lambda: CREATE.cone(0.3, 0.5),
    "tetrahedron": lambda: trimesh.convex.convex_hull(np.eye(4, 3)),
}
HOLLOW: Shapes = {
    "L": lambda: extruded((0, 0), (1, 0), (1, 0.3), (0.3, 0.3), (0.3, 1), (0, 1)),
    "torus": lambda: CREATE.torus(0.5, 0.2, major_sections=24, minor_sections=12),
    "ring": lambda: CREATE.annulus(0.4, 0.6, 0.3, sections=24),
    "apart": lambda: joined(box((0.2, 0.2, 0.2), (-0.7, 0, 0)), box((0.2, 0.2, 0.2), (0.7, 0, 0))),
    "boxes in a cross": lambda: joined(box((1, 0.2, 0.2)), box((0.2, 1, 0.2)), box((0.2, 0.2, 1))),
    "shells": lambda: joined(box((1, 1, 1)), box((0.5, 0.5, 0.5)), box((0.2, 0.2, 0.2))),
    "panel with a mast": lambda: joined(box((2, 1, 0.02)), box((0.03, 0.03, 1), (0.3, 0.2, 0.5))),
}
EVERY = {**CONVEX, **HOLLOW}


def outside(points: np.ndarray, pieces: PolytopeSet) -> np.ndarray:
    """How far points (n, 3) are outside of the nearest piece, (n,) [m]."""
    return outside_polytopes(points, pieces.pieces)


def within(mesh: trimesh.Trimesh, rng: np.random.Generator, count: int = 2000) -> np.ndarray:
    """Points inside any of a mesh's closed parts, by trimesh."""
    points = rng.uniform(*mesh.bounds, (count, 3))
    inside = np.zeros(count, dtype=bool)
    for part in mesh.split(only_watertight=True):
        inside |= part.contains(points)
    return points[inside]


def rims(pieces: PolytopeSet, rng: np.random.Generator, count: int = 300) -> np.ndarray:
    """Points of the pieces: on the surfaces of their hulls, moved out by the rounding, and inside."""
    found = []
    for piece in pieces.pieces:
        hull = ConvexHull(piece.vertices)
        chosen = rng.integers(0, len(hull.simplices), count)
        inner = np.einsum("ij,ijk->ik", rng.dirichlet((0.7, 0.7, 0.7), count), piece.vertices[hull.simplices[chosen]])
        share = rng.random((count, 1))
        found += [
            inner + piece.rounding * hull.equations[chosen, :3],
            inner * share + (1 - share) * piece.vertices.mean(axis=0),
        ]
    return np.concatenate(found)


def stands_out(pieces: PolytopeSet, mesh: trimesh.Trimesh, rng: np.random.Generator) -> float:
    """How far points of the pieces are from a mesh of closed parts, at most [m]."""
    points = rims(pieces, rng)
    free = np.ones(len(points), dtype=bool)
    for part in mesh.split(only_watertight=True):
        free &= ~part.contains(points)
    return float(trimesh.proximity.closest_point(mesh, points[free])[1].max()) if free.any() else 0.0


@pytest.mark.parametrize("name", EVERY)
def test_all_of_a_solid_is_in_its_pieces_and_none_stands_out_more_than_is_said(name: str) -> None:
    mesh, rng = EVERY[name](), np.random.default_rng(1)
    pieces = convex_pieces(mesh, pieces=12, cache=False)
    assert pieces.excess is not None
    assert 1 <= len(pieces.pieces) <= 12
    assert outside(surface_points(np.array(mesh.triangles), rng, 3000), pieces).max() <= 0
    assert outside(within(mesh, rng), pieces).max() <= 0
    assert stands_out(pieces, mesh, rng) <= pieces.excess + 1e-8  # as precise as trimesh is


@pytest.mark.parametrize("name", CONVEX)
def test_a_convex_mesh_is_one_exact_piece(name: str) -> None:
    pieces = convex_pieces(CONVEX[name](), cache=False)
    assert len(pieces.pieces) == 1
    assert pieces.excess == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "count", "most"),
    [("L", 2, 3e-3), ("apart", 2, 1e-9), ("panel with a mast", 2, 5e-3), ("torus", 12, 0.03), ("boxes in a cross", 5, 5e-3)],
)
def test_few_pieces_stand_out_little(name: str, count: int, most: float) -> None:
    pieces = convex_pieces(HOLLOW[name](), cache=False)
    assert len(pieces.pieces) <= count
    assert pieces.excess is not None
    assert pieces.excess <= most


def test_an_excess_that_is_asked_for_is_kept_or_told() -> None:
    torus = HOLLOW["torus"]()
    close = convex_pieces(torus, excess=0.03, pieces=40, cache=False)
    assert close.excess is not None
    assert close.excess <= 0.03
    few = convex_pieces(torus, excess=0.01, pieces=3, cache=False)
    assert len(few.pieces) <= 3
    assert few.excess is not None
    (note,) = few.notes
    assert f"{1000 * few.excess:.3g} mm" in note
    assert "10 mm that were asked for" in note
    assert "allow more pieces" in note


def test_more_pieces_than_needed_are_not_made() -> None:
    assert len(convex_pieces(HOLLOW["L"](), excess=0.5, pieces=40, cache=False).pieces) == 1


@pytest.mark.parametrize("vertices", [4, 12, 64])
def test_a_hull_of_many_vertices_is_held_by_few(vertices: int) -> None:
    ball, rng = CREATE.icosphere(4, 0.5), np.random.default_rng(2)
    pieces = convex_pieces(ball, vertices=vertices, cache=False)
    (piece,) = pieces.pieces
    assert len(piece.vertices) <= vertices
    assert outside(surface_points(np.array(ball.triangles), rng, 3000), pieces).max() <= 0
    assert pieces.excess is not None
    assert stands_out(pieces, ball, rng) <= pieces.excess
    assert piece.rounding <= pieces.excess


FLAT = {
    "triangle": np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0.5]]]),
    "square": np.array([[[0, 0, 2], [1, 0, 2], [1, 1, 2]], [[0, 0, 2], [1, 1, 2], [0, 1, 2.0]]]),
    "segment": np.array([[[0, 0, 0], [1, 2, 3], [0.5, 1, 1.5]]]),
    "point": np.full((1, 3, 3), 3.0),
    "C in a plane": np.array(
        [[[0, 0, 0], [1, 0, 0], [1, 0.1, 0]], [[0, 0, 0], [0, 1, 0], [0.1, 1, 0]], [[0, 1, 0], [1, 1, 0], [1, 0.9, 0.0]]]
    ),
}


@pytest.mark.parametrize("name", FLAT)
def test_what_is_flat_is_held_by_flat_pieces(name: str) -> None:
    triangles = FLAT[name].astype(float)
    pieces = convex_pieces(triangles, cache=False)
    for points in (triangles.reshape(-1, 3), triangles.mean(axis=1)):
        assert outside(points, pieces).max() <= 0
    assert all(piece.rounding < 1e-5 for piece in pieces.pieces)


@pytest.mark.parametrize("number", range(16))
def test_meshes_as_exporters_write_them_are_held(number: int) -> None:
    """Inside out, double-sided, cracked, open, crossed by themselves, tiny and huge (`drawn_meshes`)."""
    mesh, rng = drawn_mesh(20, number), np.random.default_rng((20, number, 1))
    how: dict[str, Any] = {"pieces": int(rng.choice([1, 3, 8])), "vertices": int(rng.choice([8, 64]))}
    pieces = convex_pieces(mesh.triangles, **how, cache=False)
    assert len(pieces.pieces) <= how["pieces"]
    assert outside(surface_points(mesh.triangles, rng, 300), pieces).max() <= 0
    inner = solid_points(mesh, rng, 150)
    if len(inner) and not mesh.open:
        assert outside(inner, pieces).max() <= 0


@pytest.mark.parametrize("size", [1e-6, 1e5])
def test_the_pieces_grow_with_the_mesh(size: float) -> None:
    mesh, rng = HOLLOW["boxes in a cross"](), np.random.default_rng(3)
    pieces, larger = convex_pieces(mesh, cache=False), convex_pieces(mesh, scale=size, cache=False)
    assert outside(size * within(mesh, rng), larger).max() <= 0
    assert pieces.excess is not None
    assert larger.excess is not None
    assert max(pieces.excess, larger.excess / size) <= 0.021


def test_a_mesh_is_placed_and_scaled() -> None:
    mesh, rng = HOLLOW["L"](), np.random.default_rng(4)
    T = pose((3, -2, 100), (0.5, 0.1, -0.7, 0.2))
    pieces = convex_pieces(mesh, pose=T, scale=(2, -1, 0.5), name="bracket", cache=False)
    points = np.concatenate([within(mesh, rng), surface_points(np.array(mesh.triangles), rng, 500)]) * (2, -1, 0.5)
    assert outside(points @ T[:3, :3].T + T[:3, 3], pieces).max() <= 0
    assert {piece.name for piece in pieces.pieces} == {"bracket"}


def test_a_cavity_is_free_where_faces_turned_inward_say_so() -> None:
    """A module with walls: an arm may work inside of it."""
    walls, cavity = box((2, 2, 2)), box((1.8, 1.8, 1.8))
    cavity.invert()
    mesh = joined(walls, cavity)
    full, shell = (convex_pieces(mesh, inside=inside, pieces=6, cache=False) for inside in ("filled", "oriented"))
    assert len(full.pieces) == 1
    assert any("cavities" in note for note in full.notes)
    rng = np.random.default_rng(5)
    points = rng.uniform(-0.85, 0.85, (500, 3))
    assert (outside(points, shell) > 0).all()
    wall = surface_points(np.array(mesh.triangles), rng, 1000) * rng.uniform(0.9, 1, (1000 + len(mesh.triangles) * 3, 1))
    wall = wall[np.abs(wall).max(axis=1) >= 0.9]
    assert outside(wall, shell).max() <= 0
    skin = convex_pieces(mesh, inside="none", pieces=1, cache=False)
    assert outside(surface_points(np.array(mesh.triangles), rng, 500), skin).max() <= 0


def test_what_is_hollow_behind_a_narrow_neck_is_seen() -> None:
    """A flask: its cavity is open to the outside by a neck, and wider than that; the convex hull stands out into it."""
    outer = [(0.0, -0.5), (0.5, -0.5), (0.5, 0.5), (0.1, 0.5)]
    inner = [(0.1, 0.4), (0.4, 0.4), (0.4, -0.4), (0.0, -0.4)]
    flask = CREATE.revolve(np.array(outer + inner), sections=32)
    assert flask.is_watertight
    pieces = convex_pieces(flask, pieces=1, cache=False)
    assert pieces.excess is not None
    assert pieces.excess >= 0.39


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no pieces": ({"pieces": 0}, "pieces is 0"),
    "half a piece": ({"pieces": 1.5}, "pieces is 1.5"),
    "three vertices": ({"vertices": 3}, "vertices is 3"),
    "no excess": ({"excess": 0}, "excess is 0"),
    "NaN": ({"excess": float("nan")}, "excess is nan"),
    "inside": ({"inside": "out"}, "inside is 'out'"),
    "scale": ({"scale": (1, 0, 1)}, "scale is"),
    "no scale": ({"scale": None}, "scale is"),
    "pose": ({"pose": np.ones((4, 4))}, "pose"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_refused(name: str, tmp_path: Path) -> None:
    arguments, said = WRONG[name]
    (mesh := box((1, 1, 1))).export(tmp_path / "box.stl")
    for given in (mesh, tmp_path / "box.stl"):
        with pytest.raises(SceneError, match=said.replace("'", ".")):
            convex_pieces(given, **arguments)


def test_a_file_that_is_missing_or_no_mesh_is_refused(tmp_path: Path) -> None:
    (tmp_path / "words.stl").write_text("no mesh")
    for name in ("words.stl", "missing.stl", "missing.dae"):
        with pytest.raises(FileFormatError, match=name):
            convex_pieces(tmp_path / name)


def test_what_is_open_cannot_be_oriented() -> None:
    mesh = box((1, 1, 1))
    with pytest.raises(SceneError, match="not closed"):
        convex_pieces(np.array(mesh.triangles)[:-1], inside="oriented")


def test_pieces_come_from_the_cache_bit_for_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPACEARM_CACHE", str(tmp_path / "kept"))
    mesh = HOLLOW["L"]()
    first = convex_pieces(mesh, excess=0.01)
    module = sys.modules["spacearm.geometry.convex_pieces"]
    with monkeypatch.context() as patch:
        patch.setattr(module, "_made", None)  # nothing is computed again
        again = convex_pieces(mesh, excess=0.01)
        with pytest.raises(TypeError):
            convex_pieces(mesh, excess=0.02)
        with pytest.raises(TypeError):
            convex_pieces(mesh, excess=0.01, cache=False)
    fresh = convex_pieces(mesh, excess=0.01, cache=False)
    for other in (again, fresh):
        assert (other.excess, other.notes) == (first.excess, first.notes)
        for one, two in zip(first.pieces, other.pieces, strict=True):
            assert one.vertices.tobytes() == two.vertices.tobytes()
            assert one.rounding == two.rounding
    (entry,) = os.listdir(tmp_path / "kept")
    (tmp_path / "kept" / entry).write_bytes(b"damaged")
    assert convex_pieces(mesh, excess=0.01).excess == first.excess


@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "dae"])
def test_a_file_is_known_by_its_content(ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPACEARM_CACHE", str(tmp_path / "kept"))
    path, copy, other = tmp_path / f"a.{ending}", tmp_path / f"b.{ending}", tmp_path / f"c.{ending}"
    HOLLOW["L"]().export(path)
    copy.write_bytes(path.read_bytes())
    box((1, 2, 3)).export(other)
    first = convex_pieces(path, pieces=2)
    module = sys.modules["spacearm.geometry.convex_pieces"]
    with monkeypatch.context() as patch:
        patch.setattr(module, "scaled_mesh", None)  # nothing is read again
        again = convex_pieces(copy, pieces=2, pose=(0, 0, 1), name="other")
        assert (again.pieces[0].vertices == first.pieces[0].vertices + np.array([0, 0, 1])).all()
        assert again.notes == first.notes
        for wrong in (lambda: convex_pieces(other, pieces=2), lambda: convex_pieces(path, pieces=2, scale=2)):
            with pytest.raises(TypeError):
                wrong()
    assert len(convex_pieces(other).pieces) == 1


def test_long_work_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[str] = []
    with on_progress(heard.append):
        convex_pieces(HOLLOW["torus"](), pieces=2, name="ring", cache=False)
        monkeypatch.setattr("spacearm.core.long_work._QUIET", -1.0)
        monkeypatch.setattr("spacearm.core.long_work._BETWEEN", -1.0)
        heard.clear()
        convex_pieces(HOLLOW["torus"](), pieces=2, name="ring", cache=False)
        assert heard
        assert all(words.startswith("mesh 'ring' is cut into convex pieces: ") for words in heard)
        heard.clear()
    convex_pieces(HOLLOW["L"](), cache=False)
    assert not heard


def test_notes_and_pieces_are_those_of_a_scene() -> None:
    pieces = make_pieces(HOLLOW["L"](), name="bracket", cache=False)
    scene = Scene([pieces])
    assert scene.notes
    assert all(note.startswith("obstacle 'bracket': ") for note in scene.notes)
    (again,) = scene_from_list(scene_as_list(scene)).obstacles
    assert isinstance(again, PolytopeSet)
    assert (again.excess, again.notes, len(again.pieces)) == (pieces.excess, pieces.notes, len(pieces.pieces))
