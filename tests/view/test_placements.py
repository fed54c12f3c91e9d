"""Obstacles that are moved by their handles: where they are then, and that nothing moves while the handle does not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import spacearm as sa
from spacearm.geometry.scene import moved_scene
from spacearm.view.placements import Handle, Movable, as_handle, middle_of

OBSTACLES = (
    sa.Sphere((0.1, 0.2, 0.3), 0.1, name="ball"),
    sa.Capsule((0, 0, 0), (0.3, 0.4, 0), 0.05),
    sa.Box((0.1, 0.2, 0.3), sa.pose((1, 2, 3), (0.9, 0.1, 0.2, 0.3)), rounding=0.01),
    sa.Cylinder(0.1, 0.4, sa.pose((1, 2, 3), (0.5, 0.5, 0.5, 0.5))),
    sa.Polytope([(1, 1, 1), (1.1, 1, 1), (1, 1.1, 1), (1, 1, 1.1)]),
    sa.HalfSpace((0, 1, 1), (0.3, 0, 0)),
    sa.SphereSet([(0, 0, 0), (0.2, 0, 0)], [0.1, 0.05]),
    sa.PolytopeSet([sa.Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])]),
)
numbers = st.floats(-3, 3)


@pytest.mark.parametrize("own", OBSTACLES, ids=lambda one: type(one).__name__)
@given(data=st.data())
def test_an_obstacle_moves_as_its_handle_does(own: sa.Sphere, data: st.DataObject) -> None:
    movable = Movable(own=own)
    wxyz = data.draw(st.tuples(*[numbers] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
    handle = as_handle(data.draw(st.tuples(*[numbers] * 3)), wxyz)
    T = handle.T @ np.linalg.inv(movable.first.T)
    wanted = moved_scene(sa.Scene([own]), T).obstacles[0]
    found = movable.at(handle)
    assert type(found) is type(own)
    assert found.name == own.name
    np.testing.assert_allclose(middle_of(found), handle.position, atol=1e-9) if isinstance(own, sa.Sphere | sa.Box) else None
    for name in ("center", "a", "b", "pose", "vertices", "normal", "point", "centers", "radii"):
        if hasattr(wanted, name):
            np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), atol=1e-9)


@pytest.mark.parametrize("own", OBSTACLES, ids=lambda one: type(one).__name__)
def test_at_its_first_handle_nothing_has_moved(own: sa.Sphere) -> None:
    movable = Movable(own=own)
    found = movable.at(movable.first)
    np.testing.assert_allclose(middle_of(found), middle_of(own), atol=1e-12)
    assert movable.turns is not isinstance(own, sa.Sphere)


def test_a_handle_has_a_quaternion_of_length_1() -> None:
    handle = as_handle([1, 2, 3], [2, 0, 0, 0])
    assert isinstance(handle, Handle)
    assert handle.wxyz.tolist() == [1, 0, 0, 0]
    np.testing.assert_array_equal(handle.T[:3, 3], [1, 2, 3])
