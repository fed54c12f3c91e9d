"""The checks that every room shares."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spacearm.core import errors
from spacearm.core.checks import as_number, as_readonly, as_transform, shown
from spacearm.core.errors import SceneError, SettingsError, SpacearmError, nearest
from spacearm.dynamics.base_models import checked_base
from spacearm.geometry import Box, Cylinder
from spacearm.planner import PoseGoal
from spacearm.robot import Frame, Joint, load_robot


def test_every_error_is_a_spacearm_error_and_there_are_under_ten() -> None:
    leaves = [e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, SpacearmError)]
    leaves.remove(SpacearmError)
    assert 0 < len(leaves) < 10
    assert all(leaf.__bases__ == (SpacearmError,) and leaf.__doc__ for leaf in leaves)


@given(hnp.arrays(st.sampled_from([float, np.float32, int]), hnp.array_shapes(), elements=st.integers(-9, 9)))
def test_numbers_come_back_equal_read_only_and_of_their_own(value: np.ndarray) -> None:
    kept = as_readonly("x", value, value.shape, SettingsError)
    np.testing.assert_array_equal(kept, value)
    assert kept.dtype == np.float64
    assert not kept.flags.writeable
    assert not np.shares_memory(kept, value)


def test_any_length_is_taken_where_none_is_asked_for() -> None:
    assert as_readonly("x", [], (None,), SettingsError).shape == (0,)
    assert as_readonly("x", [[1, 2]], (None, 2), SettingsError).shape == (1, 2)


def test_infinity_is_taken_only_where_asked_for_and_nan_never() -> None:
    assert as_readonly("x", [np.inf], (1,), SettingsError, finite=False)[0] == np.inf
    with pytest.raises(SettingsError, match=r"x\[1\] is inf, expected a finite number"):
        as_readonly("x", [0, np.inf], (2,), SettingsError)
    with pytest.raises(SettingsError, match=r"x\[0\] is nan, expected a number"):
        as_readonly("x", [np.nan], (1,), SettingsError, finite=False)


@pytest.mark.parametrize("value", [3, 3.0, np.int8(3), np.float32(3), np.array(3.0)])
def test_a_number_may_be_of_any_numeric_type(value: object) -> None:
    assert as_number("x", value, SettingsError) == 3.0


@pytest.mark.parametrize("value", ["3", b"3", True, None, [3], 3j, 10**400, object()])
def test_what_is_no_number_is_refused(value: object) -> None:
    with pytest.raises(SettingsError, match="expected a finite number"):
        as_number("x", value, SettingsError)


def test_bounds_are_open_above_and_closed_at_least() -> None:
    assert as_number("x", 0, SettingsError, at_least=0) == 0
    with pytest.raises(SettingsError, match="above 0"):
        as_number("x", 0, SettingsError, above=0)
    with pytest.raises(SettingsError, match="1 or more"):
        as_number("x", 0.99, SettingsError, at_least=1)


def test_the_nearest_name_is_told_with_the_known_ones() -> None:
    assert nearest("elbw", ["elbow", "wrist"]) == "did you mean 'elbow'? known: elbow, wrist"
    assert nearest("ELBOW", ["elbow"]) == "did you mean 'elbow'? known: elbow"
    assert nearest("xyz", ["elbow", "wrist"]) == "known: elbow, wrist"
    assert nearest("xyz", []) == "none is known"
    assert nearest("xyz", map(str, range(30))).endswith("9, 10, 11, ... (30 in all)")


@given(st.one_of(st.text(), st.lists(st.floats()), st.dictionaries(st.text(), st.text())))
def test_a_wrong_value_is_shown_on_one_short_line(value: object) -> None:
    assert len(shown(value).splitlines()) == 1
    assert len(shown(value)) <= 60


@pytest.mark.parametrize("error", [0.0, 1e-16, 1e-13, 4e-10])
def test_a_rotation_of_few_digits_becomes_the_nearest_one_and_stays(error: float) -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        R *= np.linalg.det(R)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R + error * rng.uniform(-1, 1, (3, 3)), rng.normal(size=3)
        made = as_transform("T", T, SceneError)
        assert np.abs(made[:3, :3].T @ made[:3, :3] - np.eye(3)).max() < 1e-14
        np.testing.assert_allclose(made, T, rtol=0, atol=2 * error + 1e-15)
        np.testing.assert_array_equal(made[:, 3], T[:, 3])
        np.testing.assert_array_equal(as_transform("T", made, SceneError), made)
        assert not made.flags.writeable
        if error <= 1e-16:
            np.testing.assert_array_equal(made, T)
    np.testing.assert_array_equal(as_transform("T", np.eye(4), SceneError), np.eye(4))


def test_what_is_further_from_a_rotation_is_refused() -> None:
    T = np.eye(4)
    T[0, 1] = 1e-8
    with pytest.raises(SceneError, match="not a rotation"):
        as_transform("T", T, SceneError)


def test_wherever_a_pose_enters_it_is_a_rotation_afterwards() -> None:
    """Else a far corner of a box, or the end of a chain of joints, is not where it is told."""
    T = np.eye(4)
    c, s = np.cos(0.7), np.sin(0.7)
    T[:2, :2] = np.array([[c, -s], [s, c]]) * (1 + 4e-10)
    made = [
        Box((1, 1, 1), T).pose,
        Cylinder(0.1, 1.0, T).pose,
        Joint(name="j", kind="revolute", parent=-1, T_parent_joint=T).T_parent_joint,
        Frame(name="f", joint=-1, T_joint_frame=T).T_joint_frame,
        PoseGoal(T).pose,
        checked_base(load_robot("servicer7"), "floating", T, None)["base_start"],
    ]
    for pose in made:
        assert np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max() < 1e-14
