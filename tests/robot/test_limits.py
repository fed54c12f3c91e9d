"""Every limit from every source reaches the degree of freedom; limits that mean none are none."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm import Motion, Problem, Trajectory, certify
from spacearm.core.errors import FileFormatError, ProblemError, RobotError
from spacearm.motion.limit_margins import as_jerk_limit
from spacearm.robot import Robot, load_robot
from support import srdf_text, urdf_text
from support.messages import assert_refused
from support.urdf_text import chain, joint

WIDE = 'lower="-10" upper="10" velocity="10" effort="1"'


def pair(multiplier: float, *, kind: str = "revolute", limit: str = WIDE, offset: float = 0.0) -> str:
    """A joint "a", and "b" that follows it."""
    mimic = f'<mimic joint="a" multiplier="{multiplier}" offset="{offset}"/>'
    return chain(
        joint("a", "link_0", "link_1", limit=WIDE),
        joint("b", "link_1", "link_2", xyz="1 0 0", kind=kind, limit=limit, extra=mimic),
    )


def one(limit: str, *, kind: str = "revolute", extra: str = "", **options: Any) -> Robot:
    return urdf_text.loaded(chain(joint("a", "link_0", "link_1", kind=kind, limit=limit, extra=extra)), **options)


def noted(robot: Robot, *words: str) -> bool:
    return any(all(word in note for word in words) for note in robot.notes)


@given(
    st.sampled_from([-7.0, -1.0, -0.01, 0.0, 0.3, 1.0, 5.0]),
    st.sampled_from(["revolute", "prismatic", "continuous"]),
    st.floats(0.01, 50),
    st.floats(0.01, 50),
    st.sampled_from(["number", "mapping", "follower"]),
)
def test_no_joint_passes_a_limit_that_the_user_gives(m: float, kind: str, v: float, a: float, form: str) -> None:
    names = {"number": None, "mapping": ("a", "b"), "follower": ("b",)}[form]
    given_v, given_a = (x if names is None else dict.fromkeys(names, x) for x in (v, a))
    robot = urdf_text.loaded(pair(m, kind=kind), velocity_limit=given_v, acceleration_limit=given_a)
    share = [abs(m)] if names == ("b",) else [1.0, abs(m)]
    assert max(share) * robot.velocity[0] <= v * (1 + 1e-12)
    if form != "follower" or m != 0:
        assert max(share) * robot.acceleration[0] <= a * (1 + 1e-12)
    # ... and no tighter than need be.
    wanted = min([v / f for f in share if f > 0] + [10.0] + [10 / abs(f) for f in (m,) if f])
    assert robot.velocity[0] == pytest.approx(wanted)


def test_a_certificate_holds_for_the_joint_that_follows_too() -> None:
    robot = urdf_text.loaded(pair(5), velocity_limit=2.0, acceleration_limit=2.0, collision="none")
    trajectory = Trajectory(robot, Motion([[-0.1], [0.1]]))
    assert certify(Problem(robot, [], start=[-0.1], goal=[0.1]), trajectory).holds
    samples = trajectory.sample(np.linspace(0, trajectory.duration, 1001))
    assert 5 * np.abs(samples.ddq).max() <= 2 * (1 + 1e-9)
    assert 5 * np.abs(samples.dq).max() <= 2 * (1 + 1e-9)


def test_one_limit_of_jerk_holds_for_the_joint_that_follows_too() -> None:
    robot = urdf_text.loaded(pair(-5), acceleration_limit=2.0)
    np.testing.assert_allclose(as_jerk_limit(robot, 10.0), [2.0])
    np.testing.assert_array_equal(as_jerk_limit(robot, [10.0]), [10.0])  # of q's entries
    np.testing.assert_array_equal(as_jerk_limit(urdf_text.loaded(pair(0.1), acceleration_limit=2.0), 10.0), [10.0])
    with pytest.raises(ProblemError, match="jerk_limit"):
        as_jerk_limit(robot, 0)


def test_arrays_of_limits_are_those_of_q() -> None:
    text = chain(*(joint(name, f"link_{i}", f"link_{i + 1}") for i, name in enumerate("abc")))
    robot = urdf_text.loaded(text, velocity_limit=[0.1, 0.2, 3], acceleration_limit=np.array([1.0, 2, 3]))
    np.testing.assert_array_equal(robot.velocity, (0.1, 0.2, 1))
    np.testing.assert_array_equal(robot.acceleration, (1, 2, 3))
    assert noted(robot, "velocity limits were set to at most 0.1 (a), 0.2 (b), 3 (c)")


@pytest.mark.parametrize("vast", ["1e4", "1e16", "1.79769e+308", "inf", "1e999", "Infinity"])
def test_vast_limits_of_a_turning_joint_mean_none(vast: str) -> None:
    robot = one(f'lower="-{vast}" upper="{vast}" velocity="1"')
    assert (robot.lower[0], robot.upper[0]) == (-math.inf, math.inf)
    assert noted(robot, "mean none", "without end turns a")
    robot = one(f'lower="-2" upper="{vast}" velocity="1"')
    assert (robot.lower[0], robot.upper[0]) == (-2, math.inf)
    assert noted(robot, "without end to one side turns a")


def test_a_winch_of_a_thousand_radians_keeps_its_limits() -> None:
    robot = one('lower="-1000" upper="1000" velocity="1"')
    assert (robot.lower[0], robot.upper[0]) == (-1000, 1000)
    assert not noted(robot, "mean none")


@pytest.mark.parametrize("velocity", ["0", "-1", "-2.5", "1e4", "1e16", "inf"])
def test_velocity_limits_that_mean_none_need_one(velocity: str) -> None:
    limit = f'lower="-1" upper="1" velocity="{velocity}"'
    with pytest.raises(RobotError, match=r"joint 'a' has velocity limit .* which means none.*velocity_limit="):
        one(limit)
    robot = one(limit, velocity_limit=0.5)
    assert robot.velocity[0] == 0.5
    assert noted(robot, "no velocity limit, or one that means none, is stated for a")


def test_all_joints_without_a_velocity_limit_are_named() -> None:
    text = chain(*(joint(name, f"link_{i}", f"link_{i + 1}", limit='lower="-1" upper="1"') for i, name in enumerate("abc")))
    with pytest.raises(RobotError, match=r"joint 'a' has no velocity limit.*so do b, c"):
        urdf_text.loaded(text)
    robot = urdf_text.loaded(text, velocity_limit={"a": 1, "b": 2, "c": 3})
    np.testing.assert_array_equal(robot.velocity, (1, 2, 3))
    robot = urdf_text.loaded(text, velocity_limit=dict.fromkeys("abc", 1), fixed={"b": 0.5})
    assert noted(robot, "velocity_limit names joints that do not move: b")


def test_a_slide_without_an_end_needs_limits_of_the_users() -> None:
    limit = 'lower="-1e16" upper="1e16" velocity="1"'
    with pytest.raises(RobotError, match=r"slides from -1e\+16 to 1e\+16 m.*position_limits=\{'a': \(lower, upper\)\}"):
        one(limit, kind="prismatic")
    robot = one(limit, kind="prismatic", position_limits={"a": (0, 0.8)})
    assert (robot.lower[0], robot.upper[0]) == (0, 0.8)
    assert noted(robot, "position limits were narrowed", "a (0 to 0.8)")
    follower = urdf_text.loaded(pair(0.1, kind="prismatic", limit='lower="-inf" upper="inf" velocity="-1"'))
    assert (follower.lower[0], follower.velocity[0]) == (-10, 10)  # its leader's hold


def test_limits_of_position_given_by_the_user_reach_leaders_through_followers() -> None:
    robot = urdf_text.loaded(pair(-2, offset=1), position_limits={"b": (0, 4), "a": (-1, 1)})
    assert (robot.lower[0], robot.upper[0]) == (-1, 0.5)
    robot = one("", kind="continuous", extra="", velocity_limit=1, position_limits={"a": (-3, 3)})
    assert (robot.lower[0], robot.upper[0]) == (-3, 3)


SOFT = '<safety_controller k_velocity="1" {}/>'


def test_soft_limits_are_told_and_not_followed() -> None:
    """Benchmarks' own requests for the Panda go beyond them."""
    limit = 'lower="-1" upper="1" velocity="1"'
    robot = one(limit, extra=SOFT.format('soft_lower_limit="-0.9" soft_upper_limit="2"'))
    assert (robot.lower[0], robot.upper[0]) == (-1, 1)
    assert noted(robot, "soft limits", "a (-0.9 to 2)", "position_limits=")
    for nothing in (
        "",
        'soft_lower_limit="0" soft_upper_limit="0"',
        'soft_lower_limit="x" soft_upper_limit="1"',
        'soft_lower_limit="-2" soft_upper_limit="1"',
    ):
        robot = one(limit, extra=SOFT.format(nothing))
        assert (robot.lower[0], robot.upper[0]) == (-1, 1)
        assert not noted(robot, "soft")


LIMITS = """\
default_velocity_scaling_factor: 0.1
joint_limits:
  a: {has_velocity_limits: true, max_velocity: 2, has_acceleration_limits: false, max_acceleration: 0}
  b: {has_velocity_limits: true, max_velocity: 50, max_acceleration: 6, min_position: -3, max_position: 20, max_jerk: 9}
  other: {max_velocity: 1}
"""


def moveit(text: str, directory: Path, *, urdf: str = "", **options: Any) -> Robot:
    (directory / "arm.urdf").write_text(urdf or pair(3))
    (directory / "joint_limits.yaml").write_text(text)
    return load_robot(directory / "arm.urdf", joint_limits=directory / "joint_limits.yaml", **options)


def test_limits_of_moveits_file_reach_the_degree_of_freedom(tmp_path: Path) -> None:
    robot = moveit(LIMITS, tmp_path)
    np.testing.assert_allclose(robot.velocity, [2])
    np.testing.assert_allclose(robot.acceleration, [2])  # that of b, which goes three times as far
    np.testing.assert_allclose([robot.lower[0], robot.upper[0]], [-1, 10 / 3])
    assert noted(robot, "allows more than the robot's file", "b (position)", "b (velocity)")
    assert noted(robot, "ignored: other")
    assert noted(robot, "max_jerk")
    assert noted(robot, "default_velocity_scaling_factor: 0.1")
    indented = "\n".join(f"  {line}" for line in LIMITS.splitlines())
    ros2 = f"robot_description_planning:\n{indented}\n"
    nested = "/**:\n  ros__parameters:\n" + "\n".join(f"    {line}" for line in ros2.splitlines())
    for text in (ros2, nested):
        again = moveit(text, tmp_path)
        np.testing.assert_array_equal(again.acceleration, robot.acceleration)


def test_moveits_file_gives_limits_that_the_urdf_lacks(tmp_path: Path) -> None:
    urdf = chain(joint("a", "link_0", "link_1", kind="continuous", limit=None))
    robot = moveit(
        "joint_limits: {a: {max_velocity: 2, max_acceleration: 3, min_position: -1, max_position: 1}}", tmp_path, urdf=urdf
    )
    assert (robot.lower[0], robot.upper[0], robot.velocity[0], robot.acceleration[0]) == (-1, 1, 2, 3)


@pytest.mark.parametrize(
    ("case", "error", "text"),
    [
        ("no such key", FileFormatError, "limits: {a: {max_velocity: 1}}\n"),
        ("a list", FileFormatError, "- 1\n"),
        ("of another robot", RobotError, "joint_limits: {x: {max_velocity: 1}}\n"),
        ("joint that is a number", FileFormatError, "joint_limits: {a: 1}\n"),
        ("text for a number", FileFormatError, "joint_limits: {a: {max_velocity: fast}}\n"),
        ("positions exchanged", RobotError, "joint_limits: {a: {min_position: 1, max_position: 0}}\n"),
        ("positions elsewhere", RobotError, "joint_limits: {a: {min_position: 20, max_position: 30}}\n"),
    ],
)
def test_a_file_of_joint_limits_that_is_none_is_refused(case: str, error: Any, text: str, tmp_path: Path) -> None:
    path = tmp_path / "joint_limits.yaml"
    assert_refused("joint_limits", case, error, lambda: moveit(text, tmp_path), path=path)


@pytest.mark.parametrize(
    ("case", "options"),
    [
        ("velocity of an unknown joint", {"velocity_limit": {"c": 1}}),
        ("velocity below 0", {"velocity_limit": {"a": -1}}),
        ("velocity of text", {"velocity_limit": {"a": "fast"}}),
        ("velocities of another number", {"velocity_limit": [1, 2]}),
        ("velocities of 0", {"velocity_limit": [0.0]}),
        ("acceleration of a flag", {"acceleration_limit": True}),
        ("range of an unknown joint", {"position_limits": {"c": (0, 1)}}),
        ("range of one number", {"position_limits": {"a": 1}}),
        ("range exchanged", {"position_limits": {"a": (1, 0)}}),
        ("range elsewhere", {"position_limits": {"a": (20, 30)}}),
        ("ranges in a list", {"position_limits": [(0, 1)]}),
    ],
)
def test_limits_that_are_none_are_refused(case: str, options: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(pair(2))
    assert_refused("joint_limits", case, RobotError, lambda: load_robot(path, **options), path=path)


def test_limits_of_followers_in_a_robot_file_reach_the_degree_of_freedom(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(
        "spacearm-robot: 1\nname: arm\njoints:\n"
        "  - {name: a, kind: revolute, parent: x, child: y, axis: [0, 0, 1],\n"
        "     lower: -9, upper: 9, velocity: 4, acceleration: 9}\n"
        "  - {name: b, kind: prismatic, parent: y, child: z, axis: [0, 0, 1],\n"
        "     lower: -1, upper: 2, velocity: 6, acceleration: 3,\n"
        "     mimic: {joint: a, multiplier: -5, offset: 1}}\n"
    )
    robot = load_robot(path)
    np.testing.assert_allclose([robot.lower[0], robot.upper[0]], [-0.2, 0.4])
    np.testing.assert_allclose([robot.velocity[0], robot.acceleration[0]], [1.2, 0.6])
    np.testing.assert_allclose(load_robot(path, acceleration_limit={"b": 1}).acceleration, [0.2])


def test_a_multiplier_that_leaves_no_speed_is_refused() -> None:
    with pytest.raises(RobotError, match="multiplier"):
        urdf_text.loaded(pair(1e308, limit='velocity="1e-3"'))


def test_joints_that_are_held_leave_those_that_follow_within_their_limits() -> None:
    text = pair(2, offset=0.5, limit='lower="-5" upper="0.1" velocity="1"')
    held = srdf_text.loaded(
        text.replace("</robot>", urdf_text.link("link_3") + joint("c", "link_2", "link_3") + "</robot>"),
        srdf_text.srdf(srdf_text.group("arm", joints=("c",))),
        group="arm",
    )
    assert noted(held, "locked: a at -0.2")
