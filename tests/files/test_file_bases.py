"""What a problem file says of the base and of the time, in each of its forms, and the sentence for each that is no good."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import FileFormatError, ProblemError, RobotError, SceneError, SettingsError, SpacearmError
from spacearm.dynamics import Momentum, center_of_mass
from spacearm.files.problem_file import load_problem, load_problem_file
from spacearm.geometry import Scene, pose
from spacearm.planner.planner_settings import Weights
from spacearm.planner.problem import AttitudeGoal, BaseLimits, Problem
from spacearm.robot import load_robot
from support.messages import assert_refused
from support.urdf_text import chain, joint
from support.written_files import written

ROBOT = load_robot("srs7")
PROBLEM = """\
spacearm: 1
robot: srs7
start: home
goal: {position: [0.25, 0.5, 0.6]}
"""
QUARTER = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # about z


def loaded(directory: Path, text: str) -> Problem:
    return load_problem(written(directory, PROBLEM + text))


def test_a_base_that_is_not_named_is_as_the_robot_says(tmp_path: Path) -> None:
    assert loaded(tmp_path, "").base == "floating"
    assert loaded(tmp_path, "base: fixed\n").base == "fixed"
    assert load_problem(written(tmp_path, PROBLEM.replace("srs7", "zhang2022"))).base == "fixed"
    assert load_problem(written(tmp_path, PROBLEM.replace("srs7", "zhang2022") + "base: floating\n")).base == "floating"


def test_a_file_gives_the_same_problem_as_the_library(tmp_path: Path) -> None:
    text = """\
base: floating
base_start: {position: [1, 2, 3], rpy_deg: [0, 0, 90]}
base_goal: {q_wxyz: [2, 0, 0, 0], tolerance: 0.01}
base_limits: {peak: 0.1, rate: 0.2, joint_momentum: 3}
momentum: {linear: [1, 0, 0], angular: [0, 0, 0.5]}
duration: 40
"""
    plain = load_problem(written(tmp_path, PROBLEM))
    made = loaded(tmp_path, text)
    np.testing.assert_allclose(made.base_start, pose((1, 2, 3), QUARTER), atol=1e-15)
    assert made == Problem(
        ROBOT,
        Scene(),
        start=ROBOT.configuration("home"),
        goal=plain.goal,
        base="floating",
        base_start=made.base_start,
        base_goal=AttitudeGoal((1, 0, 0, 0), 0.01),
        base_limits=BaseLimits(peak=0.1, rate=0.2, joint_momentum=3),
        momentum=Momentum(linear=(1, 0, 0), angular=(0, 0, 0.5)),
        duration=40,
    )


@pytest.mark.parametrize("base", ["fixed", "floating"])
@pytest.mark.parametrize(
    ("text", "turned"),
    [
        ("mass_center", (1, 0, 0, 0)),
        ("{mass_center: true}", (1, 0, 0, 0)),
        ("{mass_center: true, rpy_deg: [0, 0, 90]}", QUARTER),
        ("{mass_center: true, q_wxyz: [1, 0, 0, 1]}", QUARTER),
    ],
)
def test_the_inertial_origin_may_be_the_centre_of_mass(text: str, turned: Any, base: str, tmp_path: Path) -> None:
    made = loaded(tmp_path, f"base: {base}\nbase_start: {text}\n")
    com = center_of_mass(made.robot, made.start)
    np.testing.assert_allclose(made.base_start @ [*com, 1], (0, 0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(made.base_start[:3, :3], pose((0, 0, 0), turned)[:3, :3], atol=1e-12)


def test_a_base_may_start_anywhere(tmp_path: Path) -> None:
    np.testing.assert_array_equal(loaded(tmp_path, "base_start: {position: [1, 2, 3]}\n").base_start, pose((1, 2, 3)))
    turned = loaded(tmp_path, "base_start: {rpy_deg: [0, 0, 90], mass_center: false}\nbase: fixed\n")
    np.testing.assert_allclose(turned.base_start, pose((0, 0, 0), QUARTER), atol=1e-15)


@pytest.mark.parametrize(
    ("text", "attitude", "tolerance"),
    [
        ("as_it_was", QUARTER, 5e-4),
        ("{as_it_was: true, tolerance_deg: 2}", QUARTER, math.radians(2)),
        ("{q_wxyz: [3, 0, 0, 0], as_it_was: false}", (1, 0, 0, 0), 5e-4),
        ("{rpy_deg: [0, 90, 0], tolerance: 1e-2}", (math.sqrt(0.5), 0, math.sqrt(0.5), 0), 0.01),
    ],
)
def test_an_attitude_goal_may_be_written_in_several_ways(text: str, attitude: Any, tolerance: float, tmp_path: Path) -> None:
    goal = loaded(tmp_path, f"base_start: {{rpy_deg: [0, 0, 90]}}\nbase_goal: {text}\n").base_goal
    assert goal is not None
    np.testing.assert_allclose(goal.attitude_wxyz, attitude, atol=1e-15)
    assert goal.tolerance == tolerance


def test_limits_may_be_given_in_degrees(tmp_path: Path) -> None:
    one = loaded(tmp_path, "base_limits: {final_deg: 1, peak_deg: 2, rate_deg: 3}\n").base_limits
    assert one == BaseLimits(final=math.radians(1), peak=math.radians(2), rate=math.radians(3))
    other = loaded(tmp_path, "base_limits: {final: 1, peak: 2, rate: 3, joint_momentum: 4}\n").base_limits
    assert other == BaseLimits(final=1, peak=2, rate=3, joint_momentum=4)
    assert loaded(tmp_path, "base_limits: {}\n").base_limits == BaseLimits()
    assert loaded(tmp_path, "momentum: {}\n").momentum == Momentum()


def test_keys_with_nothing_behind_them_are_left_out(tmp_path: Path) -> None:
    keys = ("base", "base_start", "base_goal", "base_limits", "momentum", "duration")
    assert loaded(tmp_path, "".join(f"{key}:\n" for key in keys)) == loaded(tmp_path, "")


def test_the_bases_weights_are_read(tmp_path: Path) -> None:
    text = "planner: {weights: {base_final: 1, base_peak: 2, base_rate: 3, joint_momentum: 4}}\n"
    weights = load_problem_file(written(tmp_path, PROBLEM + text)).settings.weights
    assert weights == Weights(base_final=1, base_peak=2, base_rate=3, joint_momentum=4)


REFUSED: dict[str, tuple[type[SpacearmError], str]] = {
    "base mistyped": (FileFormatError, "base: float\n"),
    "base a mapping": (FileFormatError, "base: {floating: true}\n"),
    "base_start a word": (FileFormatError, "base_start: centre\n"),
    "base_start a list": (FileFormatError, "base_start: [0, 0, 1]\n"),
    "base_start key mistyped": (FileFormatError, "base_start: {postion: [0, 0, 1]}\n"),
    "base_start in a plane": (SceneError, "base_start: {position: [0, 0]}\n"),
    "base_start infinite": (FileFormatError, "base_start: {position: [0, 0, .inf]}\n"),
    "base_start turned twice": (SceneError, "base_start: {q_wxyz: [1, 0, 0, 0], rpy_deg: [0, 0, 0]}\n"),
    "base_start turned by nothing": (SceneError, "base_start: {q_wxyz: [0, 0, 0, 0]}\n"),
    "base_start in two places": (ProblemError, "base_start: {position: [0, 0, 1], mass_center: true}\n"),
    "base_start mass_center a number": (FileFormatError, "base_start: {mass_center: 1}\n"),
    "base_goal a word": (FileFormatError, "base_goal: as it was\n"),
    "base_goal a list": (FileFormatError, "base_goal: [1, 0, 0, 0]\n"),
    "base_goal key mistyped": (FileFormatError, "base_goal: {rpy: [0, 0, 0]}\n"),
    "base_goal of two attitudes": (ProblemError, "base_goal: {q_wxyz: [1, 0, 0, 0], as_it_was: true}\n"),
    "base_goal without attitude": (ProblemError, "base_goal: {tolerance_deg: 1}\n"),
    "base_goal of three numbers": (ProblemError, "base_goal: {q_wxyz: [1, 0, 0]}\n"),
    "base_goal of zeros": (ProblemError, "base_goal: {q_wxyz: [0, 0, 0, 0]}\n"),
    "base_goal of two turns": (SceneError, "base_goal: {rpy_deg: [0, 0]}\n"),
    "base_goal tolerance zero": (ProblemError, "base_goal: {as_it_was: true, tolerance: 0}\n"),
    "base_goal tolerance below 0 in degrees": (ProblemError, "base_goal: {as_it_was: true, tolerance_deg: -1}\n"),
    "base_goal tolerance twice": (ProblemError, "base_goal: {as_it_was: true, tolerance: 1, tolerance_deg: 1}\n"),
    "base_goal of a fixed base": (ProblemError, "base: fixed\nbase_goal: as_it_was\n"),
    "base_limits a number": (FileFormatError, "base_limits: 3\n"),
    "base_limits key mistyped": (FileFormatError, "base_limits: {peek_deg: 1}\n"),
    "base_limits text": (FileFormatError, "base_limits: {peak_deg: 1 degree}\n"),
    "base_limits zero": (ProblemError, "base_limits: {joint_momentum: 0}\n"),
    "base_limits zero in degrees": (ProblemError, "base_limits: {rate_deg: 0}\n"),
    "base_limits twice": (ProblemError, "base_limits: {rate_deg: 1, rate: 1}\n"),
    "base_limits beside the goal": (ProblemError, "base_limits: {final_deg: 1}\nbase_goal: as_it_was\n"),
    "base_limits of a fixed base": (ProblemError, "base: fixed\nbase_limits: {peak_deg: 1}\n"),
    "momentum a list": (FileFormatError, "momentum: [0, 0, 1]\n"),
    "momentum key mistyped": (FileFormatError, "momentum: {angluar: [0, 0, 1]}\n"),
    "momentum in a plane": (ProblemError, "duration: 9\nmomentum: {angular: [0, 1]}\n"),
    "momentum without duration": (ProblemError, "momentum: {angular: [0, 0, 1]}\n"),
    "momentum of a fixed base": (ProblemError, "base: fixed\nduration: 9\nmomentum: {angular: [0, 0, 1]}\n"),
    "duration zero": (ProblemError, "duration: 0\n"),
    "duration text": (FileFormatError, "duration: 9 s\n"),
    "duration beside time_optimal": (SettingsError, "duration: 9\nplanner:\n  time_law: time_optimal\n"),
    "weight below 0": (SettingsError, "planner: {weights: {base_peak: -1}}\n"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_told_by_its_line(case: str, tmp_path: Path) -> None:
    error, text = REFUSED[case]
    path = written(tmp_path, PROBLEM + text)
    assert_refused("problem_base", case, error, lambda: load_problem(path), path=path)


@pytest.mark.parametrize("text", ["base: floating\n", "base_start: mass_center\n"])
def test_a_robot_without_masses_does_not_float(text: str, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(chain(joint("a", "link_0", "link_1")), encoding="utf-8")
    lines = "spacearm: 1\nrobot: {file: arm.urdf, acceleration_limit: 1}\nstart: [0]\ngoal: {configuration: [0.5]}\n"
    path = written(tmp_path, lines + text)
    case = f"no masses, {text.split(':')[0]}"
    assert_refused("problem_base", case, RobotError, lambda: load_problem(path), path=path)
