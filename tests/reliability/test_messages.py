"""A message is a line that can be read, whatever names it holds."""

from __future__ import annotations

import numpy as np
import pytest

from spacearm.core.errors import ProblemError, RobotError, SceneError, nearest
from spacearm.geometry import Box, HalfSpace, Scene, pose
from spacearm.planner.goals import PoseGoal
from spacearm.planner.problem import Problem
from spacearm.robot import load_robot


def test_a_message_with_an_endless_name_is_cut_and_keeps_its_advice() -> None:
    said = str(RobotError(f"link '{'a' * 10**6}' has no mass; give it one"))
    assert len(said) == 1500
    assert said.startswith("link 'aaa")
    assert said.endswith("aaa' has no mass; give it one")


def test_a_message_of_some_length_is_left_as_it_is() -> None:
    assert str(RobotError("a" * 1500)) == "a" * 1500


def test_endless_names_are_not_listed_in_full_nor_compared() -> None:
    said = nearest("b" * 10**6, ["base", "a" * 10**6])
    assert said == f"known: base, {'a' * 57}..."
    assert nearest("bas", ["base", "a" * 10**6]).startswith("did you mean 'base'?")


@pytest.mark.parametrize("large", [1e155, 1e200, 1e308])
def test_a_direction_too_long_to_be_squared_is_refused_without_a_warning(large: float) -> None:
    with pytest.raises(SceneError, match="expected a direction"):
        HalfSpace((large, 0, 0), (0, 0, 0))
    with pytest.raises(SceneError, match="expected a unit quaternion"):
        pose((0, 0, 0), (large, 0, 0, 0))
    with pytest.raises(Exception, match="expected a direction"):
        PoseGoal(np.eye(4), free_axis=(large, 0, 0))


def test_rows_of_several_lengths_are_told() -> None:
    with pytest.raises(SceneError, match="rows of different lengths"):
        Box((1, 1, 1), [[1, 0], [1]])  # type: ignore[arg-type]
    with pytest.raises(ProblemError, match="rows of different lengths"):
        Problem(load_robot("zhang2022"), Scene([]), start=np.zeros(7), goal=[[[1], [1, 2]], [1]])  # type: ignore[list-item]


def test_a_name_cannot_command_the_terminal_or_break_the_line() -> None:
    assert str(RobotError("link 'a\x1b[31m\nb\x07é' is red")) == "link 'a\\x1b[31m b\\x07é' is red"
