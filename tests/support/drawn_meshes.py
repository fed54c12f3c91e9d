"""Drawn meshes, as exporters write them, each from (seed, number); and a checker that knows the solid they came from.

A clean part is a closed surface whose inside is told by the solid angle that it fills around a point (a formula, no ray and no
code of ours). It is then spoilt: turned inside out, mirrored, doubled, cracked, cut, given walls and holes. What it encloses
stays known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh

from spacearm.geometry import Polytope, SphereSet, convex_pieces, enclose_mesh
from spacearm.robot import load_robot
from support.oracles.polytopes import outside_polytopes

Array = np.ndarray

_NEAR = 1e-9  # of the size: what is nearer to the surface may be either


@dataclass
class DrawnMesh:
    """A mesh, and what is inside of it.

    Attributes:
        triangles: (n, 3, 3), as they are given.
        solids: clean closed surfaces (k, 3, 3), in the same place: what is in any is solid.
        fuzz: how far the given surface may be off the clean one [m].
        open: whether it has an opening that no one takes for small.
        spoilt: what was done to it.
    """

    triangles: Array
    solids: list[Array]
    fuzz: float = 0.0
    open: bool = False
    spoilt: list[str] = field(default_factory=list)


class Outcome(NamedTuple):
    """What became of a mesh: what was drawn, whether it was refused, and what is wrong."""

    drawn: list[str]
    refused: str
    complaints: list[str]


def drawn_mesh(seed: int, number: int) -> DrawnMesh:
    """Draw a mesh of one to four parts, spoil it in up to three ways, and put it anywhere in any size."""
    rng = np.random.default_rng((seed, number))
    mesh = _drawn_parts(rng)
    ways = list(SPOILT)
    for i in rng.permutation(len(ways))[: rng.integers(0, 4)]:
        if ways[i] not in ("explode", "openings") or not mesh.spoilt[1:]:
            SPOILT[ways[i]](mesh, rng)
            mesh.spoilt.append(ways[i])
            if ways[i] in ("explode", "openings"):
                break
    size = float(10.0 ** rng.uniform(-3, 3))
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3] if rng.random() < 0.7 else np.eye(3)
    scale = size * np.exp(rng.uniform(-0.7, 0.7, 3)) * np.where(rng.random(3) < 0.2, -1, 1)
    shift = rng.normal(size=3) * size * rng.choice([0.0, 1.0, 10.0])
    mesh.triangles = (mesh.triangles * scale) @ turn.T + shift
    mesh.solids = [(solid * scale) @ turn.T + shift for solid in mesh.solids]
    mesh.fuzz *= float(np.abs(scale).max())
    return mesh


def _drawn_parts(rng: np.random.Generator) -> DrawnMesh:
    kind = str(rng.choice(["one", "apart", "overlap", "nested", "glued"], p=[0.35, 0.1, 0.3, 0.15, 0.1]))
    if kind == "glued":  # boxes with a wall in common, there once or twice
        boxes = [
            trimesh.creation.box((1, 1, 1), transform=trimesh.transformations.translation_matrix((i, 0, 0))) for i in (0, 1)
        ]
        parts = [np.array(box.triangles) for box in boxes]
        given = np.concatenate(parts)
        wall = np.abs(given[:, :, 0] - 0.5).max(axis=1) < 1e-9
        if rng.random() < 0.5:
            given = np.concatenate([given[~wall], given[wall][:2]])
        return DrawnMesh(given, parts, spoilt=[kind])
    parts = [_part(rng) for _ in range(1 if kind == "one" else int(rng.integers(2, 5)))]
    for i, part in enumerate(parts[1:], start=1):
        if kind == "nested":
            parts[i] = part * 0.3**i
        else:
            parts[i] = part + rng.normal(size=3) * (3.0 if kind == "apart" else 0.4)
    given = [part[:, ::-1] if rng.random() < 0.3 else part for part in parts]
    return DrawnMesh(np.concatenate(given), parts, spoilt=[kind])


def _part(rng: np.random.Generator) -> Array:
    made: list[Callable[[], trimesh.Trimesh]] = [
        lambda: trimesh.creation.box(rng.uniform(0.2, 1.5, 3)),
        lambda: trimesh.creation.box((1.0, 0.8, float(rng.choice([0.01, 0.05])))),
        lambda: trimesh.creation.icosphere(int(rng.integers(1, 3)), 0.6),
        lambda: trimesh.creation.cylinder(0.4, float(rng.choice([0.1, 1.0])), sections=24),
        lambda: trimesh.creation.annulus(0.3, 0.6, 0.5, sections=24),
        lambda: trimesh.creation.torus(0.5, 0.2, major_sections=20, minor_sections=10),
        lambda: trimesh.creation.cone(0.5, 1.0, sections=16),
        lambda: trimesh.convex.convex_hull(rng.normal(size=(12, 3)) * 0.4),
        _angle,
    ]
    mesh = made[int(rng.integers(len(made)))]()
    return np.array(mesh.triangles)


def _angle() -> trimesh.Trimesh:
    """An L."""
    outline = np.array([(0, 0), (1, 0), (1, 0.3), (0.3, 0.3), (0.3, 1), (0, 1)], dtype=float)
    flat = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    low, high = np.column_stack([outline, np.zeros(6)]), np.column_stack([outline, np.full(6, 0.4)])
    vertices = np.concatenate([low, high])
    faces = [f[::-1] for f in flat] + [tuple(i + 6 for i in f) for f in flat]
    for i in range(6):
        k = (i + 1) % 6
        faces += [(i, k, k + 6), (i, k + 6, i + 6)]
    return trimesh.Trimesh(vertices, faces, process=False)


def _size(mesh: DrawnMesh) -> float:
    return float(np.ptp(mesh.triangles.reshape(-1, 3), axis=0).max())


def _finer(triangles: Array, edge: float) -> Array:
    vertices, faces = trimesh.remesh.subdivide_to_size(
        triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), edge
    )
    return vertices[faces]


def _inverted(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    mesh.triangles = mesh.triangles[:, ::-1]


def _doubled(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    chosen = mesh.triangles if rng.random() < 0.6 else mesh.triangles[rng.random(len(mesh.triangles)) < 0.5]
    mesh.triangles = np.concatenate([mesh.triangles, np.roll(chosen, 1, axis=1) if rng.random() < 0.3 else chosen[:, ::-1]])


def _second_skin(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """The same surface again, inside out and cut into other triangles."""
    mesh.triangles = np.concatenate([mesh.triangles, _finer(mesh.triangles, 0.6)[:, ::-1]])


def _other_diagonals(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """A second skin, inside out, in which neighbours that make up a plane quad are cut along the other diagonal."""
    given = trimesh.Trimesh(*_merged(mesh.triangles), process=False)
    extra = []
    for (i, k), angle in zip(given.face_adjacency, given.face_adjacency_angles, strict=True):
        if angle > 1e-6:
            continue
        quad = list(dict.fromkeys([*given.faces[i], *given.faces[k]]))
        common = [v for v in quad if v in given.faces[i] and v in given.faces[k]]
        lone = [v for v in quad if v not in common]
        if len(common) == 2 and len(lone) == 2:
            extra += [given.vertices[[lone[0], lone[1], common[0]]], given.vertices[[lone[1], lone[0], common[1]]]]
    if extra:
        mesh.triangles = np.concatenate([mesh.triangles, np.array(extra)])


def _merged(triangles: Array) -> tuple[Array, Array]:
    vertices, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, faces.reshape(-1, 3)


def _flipped(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    chosen = rng.random(len(mesh.triangles)) < 0.4
    mesh.triangles[chosen] = mesh.triangles[chosen, ::-1]


def _rounded(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """Every corner is rounded on its own, so that no two are the same."""
    size = _size(mesh)
    mesh.triangles = mesh.triangles + rng.uniform(-2e-7, 2e-7, mesh.triangles.shape) * size
    mesh.fuzz += 1e-6 * size


def _halved_edges(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """Faces are cut in two on one side of an edge only: T-junctions."""
    chosen = rng.random(len(mesh.triangles)) < 0.3
    a, b, c = np.moveaxis(mesh.triangles[chosen], 1, 0)
    middle = (a + b) / 2
    mesh.triangles = np.concatenate([mesh.triangles[~chosen], np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
    mesh.fuzz += 1e-12 * _size(mesh)


def _small_holes(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """Single faces of a fine mesh are missing."""
    size = min(float(np.ptp(solid.reshape(-1, 3), axis=0).max()) for solid in mesh.solids)
    area = np.linalg.norm(np.cross(*np.moveaxis(mesh.triangles[:, 1:] - mesh.triangles[:, :1], 1, 0)), axis=1).sum() / 2
    if area > 30 * size**2:
        return  # too many faces
    fine = _finer(mesh.triangles, 0.12 * size)
    missing = rng.choice(len(fine), size=min(3, len(fine) // 50), replace=False)
    mesh.triangles = np.delete(fine, missing, axis=0)
    mesh.fuzz += 0.13 * size


def _flat_faces(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    chosen = mesh.triangles[rng.integers(0, len(mesh.triangles), 3)].copy()
    chosen[:, 2] = chosen[:, 1] if rng.random() < 0.5 else (chosen[:, 0] + chosen[:, 1]) / 2
    mesh.triangles = np.concatenate([mesh.triangles, chosen])


def _wall(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """A wall inside a part, along its faces' corners or loose."""
    solid = mesh.solids[0]
    corners = solid.reshape(-1, 3)
    chosen = corners[rng.integers(0, len(corners), 3)]
    middle = corners.mean(axis=0)
    mesh.triangles = np.concatenate(
        [mesh.triangles, (chosen if rng.random() < 0.5 else middle + 0.3 * (chosen - middle))[None]]
    )


def _explode(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """Every face is a little smaller than its place: gaps all over."""
    middle = mesh.triangles.mean(axis=1, keepdims=True)
    share = float(rng.choice([1e-4, 2e-3]))
    mesh.triangles = middle + (1 - share) * (mesh.triangles - middle)
    mesh.fuzz += 2 * share * _size(mesh)


def _openings(mesh: DrawnMesh, rng: np.random.Generator) -> None:
    """Half of all faces are missing."""
    middle = mesh.triangles.reshape(-1, 3).mean(axis=0)
    direction = rng.normal(size=3)
    kept = (mesh.triangles.mean(axis=1) - middle) @ direction < 0
    if kept.any():
        mesh.triangles = mesh.triangles[kept]
        mesh.open = True
        mesh.solids = []


SPOILT: dict[str, Callable[[DrawnMesh, np.random.Generator], None]] = {
    "inverted": _inverted,
    "doubled": _doubled,
    "second skin": _second_skin,
    "other diagonals": _other_diagonals,
    "flipped": _flipped,
    "rounded": _rounded,
    "halved edges": _halved_edges,
    "small holes": _small_holes,
    "flat faces": _flat_faces,
    "wall": _wall,
    "explode": _explode,
    "openings": _openings,
}


def winding(points: Array, triangles: Array) -> Array:
    """Return the solid angle of a closed surface around points (m, 3), over that of a sphere: 0 outside, 1 or -1 inside."""
    total = np.zeros(len(points))
    for i in range(0, len(triangles), 500):
        a, b, c = np.moveaxis(triangles[i : i + 500][None] - points[:, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(x, axis=2) for x in (a, b, c))
        above = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb
        total += 2 * np.arctan2(above, below).sum(axis=1)
    return total / (4 * np.pi)


def distance(points: Array, triangles: Array) -> Array:
    """Return about how far points (m, 3) are from triangles (n, 3, 3), (m,) [m]."""
    vertices, faces = _merged(triangles)
    middle, size = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max())  # trimesh takes 1e-8 for nothing
    mesh = trimesh.Trimesh((vertices - middle) / size, faces, process=False)
    return size * trimesh.proximity.closest_point(mesh, (points - middle) / size)[1]


def solid_points(mesh: DrawnMesh, rng: np.random.Generator, count: int) -> Array:
    """Return points inside the clean solids, no nearer to their surface than the fuzz."""
    found = []
    for solid in mesh.solids:
        corners = solid.reshape(-1, 3)
        # Half of them anywhere in the box around it, half of them near its surface or its middle axis.
        anywhere = rng.uniform(corners.min(axis=0), corners.max(axis=0), (count, 3))
        ends = corners[rng.integers(0, len(corners), (count, 2))]
        between = ends[:, 0] + rng.random((count, 1)) * (ends[:, 1] - ends[:, 0])
        points = np.concatenate([anywhere, between])
        points = points[np.abs(winding(points, solid)) > 0.5]
        if len(points):
            far = distance(points, solid) > max(mesh.fuzz, _NEAR * float(np.ptp(corners, axis=0).max()))
            found.append(points[far])
    return np.concatenate(found) if found else np.zeros((0, 3))


def surface_points(triangles: Array, rng: np.random.Generator, count: int) -> Array:
    """Return points of triangles, their corners too."""
    weights = rng.dirichlet((0.7, 0.7, 0.7), count)
    inner = np.einsum("ij,ijk->ik", weights, triangles[rng.integers(0, len(triangles), count)])
    return np.concatenate([inner, triangles.reshape(-1, 3)[:2000]])


def _apart(points: Array, balls: SphereSet) -> Array:
    out = np.full(len(points), np.inf)
    for i in range(0, len(balls.radii), 64):
        away = np.linalg.norm(points[:, None] - balls.centers[i : i + 64], axis=2) - balls.radii[i : i + 64]
        out = np.minimum(out, away.min(axis=1))
    return out


def looked_at(seed: int, number: int, folder: Path) -> Outcome:
    """Enclose a drawn mesh, as an obstacle or a link, from memory or from a file, and have the solid's points looked for."""
    from spacearm.core.errors import SpacearmError

    mesh, rng = drawn_mesh(seed, number), np.random.default_rng((seed, number, 1))
    kind = str(rng.choice(["array", "stl", "obj", "ply", "dae", "glb"]))
    drawn = [*mesh.spoilt, f"as {kind}"]
    size = _size(mesh)
    rounding = 0.0 if kind == "array" else 1e-6 * max(size, float(np.abs(mesh.triangles).max()))
    mesh.fuzz += rounding
    inner, outer = solid_points(mesh, rng, 150), surface_points(mesh.triangles, rng, 300)
    wrong: list[str] = []
    try:
        given: Any = mesh.triangles if kind == "array" else _written(mesh.triangles, folder / f"part.{kind}", rng)
        how: dict[str, Any] = {"excess": float(rng.choice([0.03, 0.08, 0.2])) * size}
        if rng.random() < 0.5:
            how = {"spheres": int(rng.choice([1, 10, 60]))}
        balls = enclose_mesh(given, **how)
        beyond = float(_apart(outer, balls).max()) - rounding
        if beyond > 0:
            wrong.append(f"{beyond:.3g} m of the surface is outside the balls")
        if mesh.open:
            closed = trimesh.Trimesh(*_merged(mesh.triangles), process=False).is_watertight  # whole parts were taken away
            if not closed and not any("open" in note or "shuts off" in note or "closed" in note for note in balls.notes):
                wrong.append(f"it is open, which no note says: {balls.notes}")
        elif len(inner) and (deepest := float(_apart(inner, balls).max())) > 0:
            wrong.append(f"a point inside the solid is {deepest:.3g} m outside the balls ({deepest / size:.2g} of its size)")
        if mesh.spoilt in (["one"], ["apart"], ["overlap"]):
            wrong += _too_large(mesh, balls, rng, size)
        if rng.random() < 0.3:
            wrong += _in_pieces(mesh, given, rounding, inner, outer, rng)
        if kind in ("stl", "obj", "dae") and rng.random() < 0.3:
            wrong += _as_link(mesh, folder / f"part.{kind}", rounding, inner, outer, rng)
    except SpacearmError as error:
        return Outcome(drawn, str(error), wrong)
    return Outcome(drawn, "", wrong)


def _too_large(mesh: DrawnMesh, balls: SphereSet, rng: np.random.Generator, size: float) -> list[str]:
    """Look for points of the balls that are farther from a clean solid than they say."""
    way = rng.normal(size=(40, 3))
    ball = rng.integers(0, len(balls.radii), 40)
    rims = balls.centers[ball] + balls.radii[ball, None] * way / np.linalg.norm(way, axis=1, keepdims=True)
    free = np.ones(len(rims), dtype=bool)
    for solid in mesh.solids:
        free &= np.abs(winding(rims, solid)) < 0.5
    out = np.min([distance(rims[free], solid) for solid in mesh.solids], axis=0) if free.any() else np.zeros(1)
    assert balls.excess is not None
    return [f"a ball stands out by {out.max():.3g} m"] if out.max() > balls.excess + 1e-5 * size else []


def _as_link(mesh: DrawnMesh, path: Path, rounding: float, inner: Array, outer: Array, rng: np.random.Generator) -> list[str]:
    """Give the mesh to a link: its surface, and what is in the solid, must lie in the link's shapes."""
    (folder := path.parent).joinpath("arm.urdf").write_text(
        f'<robot name="r"><link name="base"/><link name="arm"><collision><geometry><mesh filename="{path.name}"/></geometry>'
        '</collision></link><joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>'
        '<limit velocity="1" effort="1"/></joint></robot>'
    )
    count, as_pieces = int(rng.choice([1, 3, 8])), bool(rng.random() < 0.5)
    how: dict[str, Any] = {"pieces_per_mesh": count} if as_pieces else {"capsules_per_shape": count}
    robot = load_robot(folder / "arm.urdf", **how)
    points = outer if mesh.open else np.concatenate([inner, outer])
    out = outside_polytopes(points, [one.shape for one in robot.shapes if isinstance(one.shape, Polytope)])
    for capsule in robot.capsules:
        along = capsule.b - capsule.a
        share = np.clip((points - capsule.a) @ along / max(float(along @ along), 1e-300), 0, 1)
        away = np.linalg.norm(points - capsule.a - share[:, None] * along, axis=1) - capsule.radius
        out = np.minimum(out, away)
    far = float(out.max()) - rounding
    return [f"with {how}, {far:.3g} m of it is outside its link's envelope"] if far > 1e-9 * _size(mesh) else []


def _in_pieces(mesh: DrawnMesh, given: Any, rounding: float, inner: Array, outer: Array, rng: np.random.Generator) -> list[str]:
    """Enclose the mesh in convex pieces: its surface, and what is in the solid, must lie in them."""
    how: dict[str, Any] = {"pieces": int(rng.choice([1, 3, 8])), "vertices": int(rng.choice([6, 64]))}
    pieces = convex_pieces(given, **how)
    points = outer if mesh.open else np.concatenate([inner, outer])
    far = float(outside_polytopes(points, pieces.pieces).max()) - rounding
    return [f"with {how}, {far:.3g} m of it is outside its convex pieces"] if far > 0 else []


def _written(triangles: Array, path: Path, rng: np.random.Generator) -> Path:
    """Write triangles to a file; COLLADA in a drawn unit."""
    vertices, faces = _merged(triangles)
    unit = float(rng.choice([1.0, 0.01, 0.0254, 0.001])) if path.suffix == ".dae" else 1.0
    mesh = trimesh.Trimesh(vertices / unit, faces, process=False)
    mesh.export(path)
    if unit != 1.0:
        path.write_text(path.read_text().replace('meter="1"', f'meter="{unit}"').replace('meter="1.0"', f'meter="{unit}"'))
        if f'meter="{unit}"' not in path.read_text():
            path.write_text(path.read_text().replace("<asset>", f'<asset><unit meter="{unit}"/>', 1))
    return path
