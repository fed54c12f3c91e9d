"""A share of benchmarks/soak_meshes.py: a checker looks for the solid, and what is wrong can be seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support import drawn_meshes
from support.drawn_meshes import looked_at, winding


@pytest.mark.parametrize("block", range(2))
def test_a_drawn_mesh_is_held_with_the_solid_it_came_from(block: int, tmp_path: Path) -> None:
    for number in range(3 * block, 3 * block + 3):
        found = looked_at(2, number, tmp_path)
        assert not found.complaints, (number, found)


def test_a_skin_is_seen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    whole = drawn_meshes.enclose_mesh
    monkeypatch.setattr(
        drawn_meshes, "enclose_mesh", lambda mesh, **how: whole(mesh, inside="none", excess=0.03 * np.ptp(BOX[:, 0, 0]))
    )
    monkeypatch.setattr(drawn_meshes, "drawn_mesh", lambda *_: drawn_meshes.DrawnMesh(BOX, [BOX], spoilt=["one", "inverted"]))
    assert any(
        "inside the solid" in complaint for number in range(3) for complaint in looked_at(0, number, tmp_path).complaints
    )


BOX = np.array(drawn_meshes.trimesh.creation.box((1, 1, 1)).triangles)


def test_the_solid_angle_tells_inside_from_outside() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (200, 3))
    np.testing.assert_allclose(winding(points, BOX), (np.abs(points) < 0.5).all(axis=1), atol=1e-9)
