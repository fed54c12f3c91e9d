"""A Problem: checked against its robot, as far as that needs no kinematics."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import strategies
import urdf_text
from snapshot import assert_refused
from spacearm.errors import ProblemError, SceneError
from spacearm.planner.goals import ConfigurationGoal, PositionGoal
from spacearm.planner.problem import Problem
from spacearm.robot import load_robot
from spacearm.scene import Scene, Sphere

ARM = load_robot("zhang2022")
GOAL = PositionGoal((0.7, 0.3, 0.0))


def problem(**changes: Any) -> Problem:
    fields: dict[str, Any] = {"robot": ARM, "scene": Scene(), "start": np.zeros(7), "goal": GOAL}
    return Problem(**(fields | changes))


def at(joint: str, value: float) -> np.ndarray:
    q = np.zeros(7)
    q[ARM.dof_index(joint)] = value
    return q


@given(st.data())
def test_any_two_configurations_within_the_limits_make_a_problem(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots())
    start, goal = data.draw(strategies.configurations(robot, (2,)))
    made = Problem(robot, data.draw(strategies.scenes()), start=start, goal=goal)
    assert made.goal == ConfigurationGoal(goal)
    np.testing.assert_array_equal(made.start, start)
    assert pickle.loads(pickle.dumps(made)) == made
    assert copy.deepcopy(made) == made


def test_numbers_are_taken_as_a_configuration_goal_whatever_holds_them() -> None:
    for goal in ([0.1] * 7, (0.1,) * 7, np.full(7, 0.1), np.full(7, 0.1, dtype=np.float32) * 0 + 0.1):
        assert isinstance(problem(goal=goal).goal, ConfigurationGoal)


def test_a_position_goals_frame_is_filled_in() -> None:
    assert problem().goal.frame == "end_effector"
    assert problem(goal=PositionGoal((0, 1, 0), frame="forearm", tolerance=0.1)).goal.frame == "forearm"
    assert GOAL.frame is None


def test_a_list_of_obstacles_is_taken_as_a_scene() -> None:
    assert problem(scene=[Sphere((1, 0, 0), 0.1)]).scene == Scene((Sphere((1, 0, 0), 0.1),))


def test_a_files_last_digit_beyond_a_limit_is_set_onto_the_limit() -> None:
    upper = ARM.upper[ARM.dof_index("elbow")]
    assert problem(start=at("elbow", upper + 1e-10)).start[3] == upper
    assert problem(goal=at("elbow", upper + 1e-10)).goal.q[3] == upper


def test_a_joint_without_limits_starts_anywhere() -> None:
    text = urdf_text.chain(urdf_text.joint("wheel", "link_0", "link_1", kind="continuous"))
    robot = urdf_text.loaded(text)
    assert Problem(robot, [], start=[100.0], goal=[-100.0]).start[0] == 100.0  # type: ignore[arg-type]


def sliding() -> Any:
    """A robot that slides from 0.1 to 1 m."""
    limit = 'lower="0.1" upper="1" velocity="1"'
    joint = urdf_text.joint("slide", "link_0", "link_1", kind="prismatic", limit=limit)
    return urdf_text.loaded(urdf_text.chain(joint))


REFUSED: dict[str, Any] = {
    "robot by name": lambda: problem(robot="zhang2022"),
    "no scene": lambda: problem(scene=None),
    "start too short": lambda: problem(start=np.zeros(6)),
    "start of two rows": lambda: problem(start=np.zeros((2, 7))),
    "start NaN": lambda: problem(start=at("elbow", np.nan)),
    "start None": lambda: problem(start=None),
    "start text": lambda: problem(start="home"),
    "start above its limit": lambda: problem(start=at("elbow", 3.2)),
    "start below its limit": lambda: problem(start=at("wrist_2", -1.0)),
    "start barely above": lambda: problem(start=at("elbow", 2.96706)),
    "start in degrees": lambda: problem(start=at("elbow", 90.0)),
    "start beyond several limits": lambda: problem(start=np.full(7, 4.0)),
    "start below a slide": lambda: Problem(sliding(), Scene(), start=[0], goal=[0.5]),
    "goal above its limit": lambda: problem(goal=at("elbow", 3.2)),
    "goal too long": lambda: problem(goal=np.zeros(8)),
    "goal a point": lambda: problem(goal=(0.7, 0.3, 0.0)),
    "goal text": lambda: problem(goal="home"),
    "goal None": lambda: problem(goal=None),
    "goal a number": lambda: problem(goal=1.0),
    "goal infinite": lambda: problem(goal=at("elbow", math.inf)),
    "goal of two rows": lambda: problem(goal=np.zeros((2, 7))),
    "goal frame mistyped": lambda: problem(goal=PositionGoal((0, 1, 0), frame="forarm")),
    "goal frame on the base": lambda: problem(goal=PositionGoal((0, 1, 0), frame="base")),
    "goal position in a plane": lambda: PositionGoal((0.7, 0.3)),
    "goal position NaN": lambda: PositionGoal((0.7, np.nan, 0)),
    "goal tolerance zero": lambda: PositionGoal((0.7, 0.3, 0.0), tolerance=0),
    "goal tolerance text": lambda: PositionGoal((0.7, 0.3, 0.0), tolerance="1 mm"),
    "goal frame no name": lambda: PositionGoal((0.7, 0.3, 0.0), frame=3),
    "goal configuration of text": lambda: ConfigurationGoal("home"),
    "goal configuration NaN": lambda: ConfigurationGoal([0, np.nan]),
    "base floating": lambda: problem(base="floating"),
    "base mistyped": lambda: problem(base="Fixed"),
    "base None": lambda: problem(base=None),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_problem_that_cannot_be_is_refused(case: str) -> None:
    assert_refused("problem", case, ProblemError, REFUSED[case])


def test_a_scene_that_is_none_is_the_scenes_to_refuse() -> None:
    assert_refused("problem", "scene of names", SceneError, lambda: problem(scene=["ball"]))
