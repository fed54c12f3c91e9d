"""Scenes and obstacles: what they take, keep and refuse."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from spacearm.core.errors import SceneError
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Scene, Sphere, SphereSet
from support import strategies
from support.messages import assert_refused


def test_a_scene_takes_any_iterable_and_keeps_a_tuple() -> None:
    spheres = [Sphere((0, 0, 1), 0.1), Sphere(center=np.array([1, 2, 3]), radius=np.float32(0.5))]
    for given_as in (spheres, tuple(spheres), iter(spheres), (sphere for sphere in spheres)):
        assert Scene(given_as).obstacles == tuple(spheres)  # type: ignore[arg-type]
    assert Scene(obstacles=spheres) == Scene(spheres)  # type: ignore[arg-type]


def test_a_scene_may_be_empty() -> None:
    assert Scene().obstacles == Scene([]).obstacles == ()  # type: ignore[arg-type]


WRONG_WORDS = {
    "box with a position": lambda: Box(size=(1, 1, 1), position=(0, 0, 0)),  # type: ignore[call-arg]
    "cylinder with a height": lambda: Cylinder(radius=1, height=2),  # type: ignore[call-arg]
    "capsule with a start": lambda: Capsule(start=(0, 0, 0), end=(0, 0, 1), radius=1),  # type: ignore[call-arg]
    "sphere without a radius": lambda: Sphere((0, 0, 0)),  # type: ignore[call-arg]
    "sphere with a name by position": lambda: Sphere((0, 0, 0), 1, "n"),  # type: ignore[misc]
    "sphere with a centre twice": lambda: Sphere((0, 0, 0), center=(0, 0, 0), radius=1),  # type: ignore[misc]
    "half-space with an offset": lambda: HalfSpace((0, 0, 1), offset=1),  # type: ignore[call-arg]
    "sphere set with a radius": lambda: SphereSet([(0, 0, 0)], radius=1),  # type: ignore[call-arg]
    "scene of an unknown word": lambda: Scene(shapes=[]),  # type: ignore[call-arg]
}


@pytest.mark.parametrize("case", WRONG_WORDS)
def test_a_word_that_a_shape_does_not_know_is_told(case: str) -> None:
    assert_refused("scene", case, SceneError, WRONG_WORDS[case])


def test_a_spheres_center_is_copied_and_read_only() -> None:
    center = np.array([1.0, 2.0, 3.0])
    sphere = Sphere(center, 0.1)
    center[0] = 9.0
    np.testing.assert_array_equal(sphere.center, (1, 2, 3))
    assert not sphere.center.flags.writeable


def test_zeros_of_either_sign_make_equal_spheres_of_equal_hash() -> None:
    assert Sphere((0.0, 0, 0), 1) == Sphere((-0.0, 0, 0), 1)
    assert hash(Sphere((0.0, 0, 0), 1)) == hash(Sphere((-0.0, 0, 0), 1))


@given(strategies.scenes())
def test_a_scene_survives_pickle_and_copy(scene: Scene) -> None:
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert copy.deepcopy(scene) == scene


REFUSED: dict[str, Any] = {
    "radius zero": lambda: Sphere((0, 0, 0), 0),
    "radius negative": lambda: Sphere((0, 0, 0), -0.1),
    "radius infinite": lambda: Sphere((0, 0, 0), np.inf),
    "radius NaN": lambda: Sphere((0, 0, 0), np.nan),
    "radius text": lambda: Sphere((0, 0, 0), "0.1"),
    "radius true": lambda: Sphere((0, 0, 0), True),
    "radius a list": lambda: Sphere((0, 0, 0), [0.1]),
    "center in a plane": lambda: Sphere((0, 0), 0.1),
    "center NaN": lambda: Sphere((0, np.nan, 0), 0.1),
    "center None": lambda: Sphere(None, 0.1),
    "center complex": lambda: Sphere((1j, 0, 0), 0.1),
    "center a number": lambda: Sphere(0.0, 0.1),
    "scene is a sphere": lambda: Scene(Sphere((0, 0, 0), 1)),
    "scene is a number": lambda: Scene(3),
    "scene is None": lambda: Scene(None),
    "scene is a mapping": lambda: Scene({"sphere": 1}),
    "scene holds tuples": lambda: Scene([Sphere((0, 0, 0), 1), ((0, 0, 0), 1)]),
    "scene holds classes": lambda: Scene([Sphere]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_obstacle_is_refused(case: str) -> None:
    assert_refused("scene", case, SceneError, REFUSED[case])
