"""A Problem: checked against its robot, as far as that needs no kinematics."""

from __future__ import annotations

import copy
import json
import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError, RobotError, SceneError
from spacearm.core.rotations import matrix_of, quaternion_of
from spacearm.dynamics import Momentum
from spacearm.geometry import HalfSpace, Scene, Sphere, pose
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal, goal_as_dict, goal_from_dict
from spacearm.planner.problem import AttitudeGoal, BaseLimits, Problem, nearest_turns
from spacearm.robot import Joint, joint_frames, load_robot
from support import strategies, urdf_text
from support.messages import assert_refused

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


def test_rows_of_numbers_are_taken_as_several_configurations_whatever_holds_them() -> None:
    rows = np.arange(21).reshape(3, 7) / 100
    for goal in (rows, rows.tolist(), tuple(map(tuple, rows)), list(rows), iter(rows), ConfigurationsGoal(rows)):
        assert problem(goal=goal).goal == ConfigurationsGoal(rows)
    assert problem(goal=rows[:1]).goal == ConfigurationsGoal(rows[:1])


def test_a_position_goals_frame_is_filled_in() -> None:
    assert problem().goal.frame == "end_effector"
    assert problem(goal=PositionGoal((0, 1, 0), frame="forearm", tolerance=0.1)).goal.frame == "forearm"
    assert GOAL.frame is None
    assert problem(goal=PoseGoal(np.eye(4))).goal.frame == "end_effector"
    assert problem(goal=PoseGoal(np.eye(4), frame="forearm")).goal.frame == "forearm"


def test_a_free_axis_is_a_direction_of_length_one() -> None:
    for axis, kept in (("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1)), ((0, 3, -4), (0, 0.6, -0.8))):
        np.testing.assert_array_equal(PoseGoal(np.eye(4), free_axis=axis).free_axis, kept)
    assert PoseGoal(np.eye(4)).free_axis is None


SMALL = st.floats(1e-6, 10, allow_subnormal=False)


@st.composite
def goals(draw: st.DrawFn) -> Any:
    """Goals of every kind, for a robot of three joints."""
    each = st.one_of(st.floats(0, 1, allow_subnormal=False), st.lists(st.floats(0, 1), min_size=3, max_size=3))
    kind = draw(st.sampled_from(["configuration", "configurations", "position", "pose"]))
    frame = draw(st.sampled_from([None, "tip"]))
    if kind == "position":
        return PositionGoal(draw(strategies.points()), tolerance=draw(SMALL), frame=frame)
    if kind == "pose":
        direction = strategies.points().filter(lambda v: np.linalg.norm(v) > 1e-3)
        return PoseGoal(
            draw(strategies.transforms()),
            position_tolerance=draw(SMALL),
            orientation_tolerance=draw(SMALL),
            frame=frame,
            free_axis=draw(st.one_of(st.none(), st.sampled_from("xyz"), direction)),
        )
    rows = np.array(draw(st.lists(strategies.points(), min_size=1, max_size=4)))
    options = {"tolerance": draw(each), "shortest": draw(st.booleans())}
    return ConfigurationGoal(rows[0], **options) if kind == "configuration" else ConfigurationsGoal(rows, **options)


@given(goals())
def test_a_goal_comes_back_from_its_plain_values_and_from_pickle(goal: Any) -> None:
    text = json.dumps(goal_as_dict(goal), allow_nan=False)
    assert goal_from_dict(json.loads(text)) == goal
    assert hash(goal_from_dict(json.loads(text))) == hash(goal)
    assert pickle.loads(pickle.dumps(goal)) == goal
    assert copy.deepcopy(goal) == goal


def test_a_list_of_obstacles_is_taken_as_a_scene() -> None:
    assert problem(scene=[Sphere((1, 0, 0), 0.1)]).scene == Scene((Sphere((1, 0, 0), 0.1),))


def test_a_files_last_digit_beyond_a_limit_is_set_onto_the_limit() -> None:
    upper = ARM.upper[ARM.dof_index("elbow")]
    assert problem(start=at("elbow", upper + 1e-10)).start[3] == upper
    assert problem(goal=at("elbow", upper + 1e-10)).goal.q[3] == upper
    # Public files round a limit to 3.14159, and their requests end at 3.14159265.
    made = problem(start=at("elbow", upper + 2.65e-6), goal=[at("elbow", upper), at("elbow", upper + 9e-6)])
    assert made.start[3] == upper
    assert made.goal.q[1, 3] == upper
    assert len(made.notes) == 2
    assert made.notes[0] == "start is a little beyond the limits and was set onto them: joint 'elbow' by 2.6e-06 rad"
    assert made.notes[1].startswith("goal 1: the goal configuration is a little beyond")
    assert problem().notes == ()
    assert problem(notes=["seen"]).notes == ("seen",)
    assert problem(notes=["seen"]) == problem()


def test_a_joint_without_limits_starts_anywhere() -> None:
    text = urdf_text.chain(urdf_text.joint("wheel", "link_0", "link_1", kind="continuous"))
    robot = urdf_text.loaded(text)
    assert Problem(robot, [], start=[100.0], goal=[-100.0]).start[0] == 100.0  # type: ignore[arg-type]


def test_the_shortest_way_ends_whole_turns_away_where_the_start_is_nearest() -> None:
    text = urdf_text.chain(urdf_text.joint("wheel", "link_0", "link_1", kind="continuous"))
    robot = urdf_text.loaded(text)
    for start, goal, end in ((-3.0, 3.0, 3.0 - math.tau), (100.0, 0.5, 0.5 + 16 * math.tau), (0.0, 3.0, 3.0)):
        made = Problem(robot, Scene([]), start=[start], goal=ConfigurationGoal([goal], shortest=True))
        np.testing.assert_allclose(made.goal.q, [end], rtol=0, atol=1e-12)
        assert abs(made.goal.q[0] - start) <= math.pi + 1e-9
        several = Problem(robot, Scene([]), start=[start], goal=ConfigurationsGoal([[goal], [goal + 1]], shortest=True))
        assert (np.abs(several.goal.q - start) <= math.pi + 1e-9).all()
        assert pickle.loads(pickle.dumps(made)) == made


@given(st.data())
def test_whole_turns_move_no_link_and_joints_with_limits_stay(data: st.DataObject) -> None:
    """Followers at another pace would move, so what they follow is left alone."""
    drawn = data.draw(strategies.robots())
    endless = data.draw(st.lists(st.booleans(), min_size=drawn.dof, max_size=drawn.dof))
    pace = data.draw(st.sampled_from([1.0, -2.0, 0.5]))
    follower = Joint(name="follower", kind="revolute", parent=-1, T_parent_joint=np.eye(4), dof=0, multiplier=pace)
    robot = replace(
        drawn,
        joints=(*drawn.joints, follower),
        lower=np.where(endless, -np.inf, drawn.lower),
        upper=np.where(endless, np.inf, drawn.upper),
    )
    q, near = (data.draw(strategies.configurations(robot)) * 7 for _ in range(2))
    turned = nearest_turns(robot, q, near)
    np.testing.assert_allclose(joint_frames(robot, turned), joint_frames(robot, q), rtol=0, atol=1e-9)
    for i in range(robot.dof):
        free = endless[i] and not robot.is_prismatic(i) and (i > 0 or pace != 0.5)
        assert abs(turned[i] - near[i]) <= math.pi + 1e-9 if free else turned[i] == q[i]


def test_a_base_is_held_as_its_robot_says_unless_the_problem_does() -> None:
    floating = replace(ARM, base="floating")
    assert (problem().base, problem(robot=floating).base) == ("fixed", "floating")
    assert (problem(base="floating").floats, problem(robot=floating, base="fixed").floats) == (True, False)


def test_what_is_not_said_of_the_base_is_nothing() -> None:
    made = problem(base="floating")
    np.testing.assert_array_equal(made.base_start, np.eye(4))
    assert made.momentum.is_zero
    assert (made.base_goal, made.base_limits.any, made.duration) == (None, False, None)
    np.testing.assert_array_equal(problem(base_start=(1, 2, 3)).base_start, pose((1, 2, 3)))
    assert problem(base="floating", base_goal=(2, 0, 0, 0)).base_goal == AttitudeGoal((1, 0, 0, 0))
    assert not made.base_start.flags.writeable


def test_a_problem_with_a_floating_base_is_a_value() -> None:
    asked: dict[str, Any] = {
        "base": "floating",
        "base_start": pose((1, 2, 3), (1, 0, 0, 1)),
        "momentum": Momentum(linear=(1, 0, 0), angular=(0, 0, 1)),
        "base_goal": AttitudeGoal((1, 1, 0, 0)),
        "base_limits": BaseLimits(peak=0.1, rate=0.2, joint_momentum=3),
        "duration": 9.0,
    }
    made = problem(**asked)
    assert pickle.loads(pickle.dumps(made)) == made == copy.deepcopy(made) == problem(**asked)
    others = (("base_start", None), ("momentum", None), ("base_goal", None), ("base_limits", None), ("duration", 8.0))
    for name, other in others:
        assert replace(made, **{name: other}) != made


@given(st.data())
def test_told_from_its_base_a_problem_is_the_same(data: st.DataObject) -> None:
    """Points, directions and turns are taken into the base frame; what is within the robot stays."""
    T = data.draw(strategies.transforms())
    p, q = data.draw(strategies.points()), data.draw(strategies.transforms())
    given_: dict[str, Any] = {"base": "floating", "duration": 1.0, "scene": [Sphere(p, 0.1), HalfSpace((0, 0, 1), p)]}
    given_ |= {"momentum": Momentum(linear=p, angular=q[:3, 3]), "base_goal": quaternion_of(q[:3, :3])}
    made = problem(**given_, base_start=T, goal=PoseGoal(q))
    local = made.local
    sphere, plane = local.scene.obstacles
    np.testing.assert_allclose(T @ [*sphere.center, 1], [*p, 1], atol=1e-9)
    np.testing.assert_allclose(T[:3, :3] @ plane.normal, (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(T @ local.goal.pose, q, atol=1e-9)
    np.testing.assert_allclose(T[:3, :3] @ matrix_of(local.base_goal.attitude_wxyz), q[:3, :3], atol=1e-9)
    np.testing.assert_allclose(T[:3, :3] @ local.momentum.linear, p, atol=1e-9)
    np.testing.assert_allclose(T[:3, :3] @ local.momentum.angular, q[:3, 3], atol=1e-9)
    np.testing.assert_array_equal(local.base_start, np.eye(4))
    assert local.local is local
    assert problem(**given_).local.scene == problem(**given_).scene


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
    "start barely above": lambda: problem(start=at("elbow", 2.96709)),
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
    "goal of short rows": lambda: problem(goal=np.zeros((2, 6))),
    "goal of uneven rows": lambda: problem(goal=[[0] * 7, [0] * 6]),
    "goal of three axes": lambda: problem(goal=np.zeros((2, 2, 7))),
    "goal of no numbers": lambda: problem(goal=[]),
    "goal of no rows": lambda: problem(goal=ConfigurationsGoal(np.zeros((0, 7)))),
    "goal of a row above its limit": lambda: problem(goal=[np.zeros(7), at("elbow", 3.2)]),
    "goal a pose": lambda: problem(goal=pose((0.7, 0.3, 0.0))),
    "goal tolerance below 0": lambda: ConfigurationGoal(np.zeros(7), tolerance=-0.1),
    "goal tolerance of a joint below 0": lambda: ConfigurationGoal(np.zeros(2), tolerance=[0.1, -0.1]),
    "goal tolerance of other joints": lambda: ConfigurationsGoal(np.zeros((2, 7)), tolerance=[0.1, 0.1]),
    "goal tolerance None": lambda: ConfigurationGoal(np.zeros(7), tolerance=None),
    "goal shortest a word": lambda: ConfigurationGoal(np.zeros(7), shortest="yes"),
    "goal pose a point": lambda: PoseGoal((0.7, 0.3, 0.0)),
    "goal pose not rigid": lambda: PoseGoal(np.diag([1, 1, 2, 1])),
    "goal pose position tolerance": lambda: PoseGoal(np.eye(4), position_tolerance=0),
    "goal pose orientation tolerance": lambda: PoseGoal(np.eye(4), orientation_tolerance=-1.0),
    "goal pose axis by name": lambda: PoseGoal(np.eye(4), free_axis="w"),
    "goal pose axis of length 0": lambda: PoseGoal(np.eye(4), free_axis=(0, 0, 0)),
    "goal pose axis in a plane": lambda: PoseGoal(np.eye(4), free_axis=(0, 1)),
    "goal pose frame mistyped": lambda: problem(goal=PoseGoal(np.eye(4), frame="forarm")),
    "goal pose frame on the base": lambda: problem(goal=PoseGoal(np.eye(4), frame="base")),
    "goal values of no kind": lambda: goal_from_dict({"tolerance": 0.1}),
    "goal values of two kinds": lambda: goal_from_dict({"position": [0, 0, 0], "pose": np.eye(4).tolist()}),
    "goal values mistyped": lambda: goal_from_dict({"position": [0, 0, 0], "tolerence": 0.1}),
    "goal values a list": lambda: goal_from_dict([0, 0, 0]),
    "goal frame mistyped": lambda: problem(goal=PositionGoal((0, 1, 0), frame="forarm")),
    "goal frame on the base": lambda: problem(goal=PositionGoal((0, 1, 0), frame="base")),
    "goal position in a plane": lambda: PositionGoal((0.7, 0.3)),
    "goal position NaN": lambda: PositionGoal((0.7, np.nan, 0)),
    "goal tolerance zero": lambda: PositionGoal((0.7, 0.3, 0.0), tolerance=0),
    "goal tolerance text": lambda: PositionGoal((0.7, 0.3, 0.0), tolerance="1 mm"),
    "goal frame no name": lambda: PositionGoal((0.7, 0.3, 0.0), frame=3),
    "goal configuration of text": lambda: ConfigurationGoal("home"),
    "goal configuration NaN": lambda: ConfigurationGoal([0, np.nan]),
    "base mistyped": lambda: problem(base="Fixed"),
    "base a number": lambda: problem(base=1),
    "base_start not rigid": lambda: problem(base_start=np.diag([1, 1, 2, 1])),
    "base_start of two numbers": lambda: problem(base_start=(0, 1)),
    "base_start NaN": lambda: problem(base_start=(0, np.nan, 0)),
    "base_start a word": lambda: problem(base_start="mass_center"),
    "momentum of a fixed base": lambda: problem(momentum=Momentum(angular=(0, 0, 1)), duration=1),
    "momentum without duration": lambda: problem(base="floating", momentum=Momentum(angular=(0, 0, 1))),
    "momentum a row": lambda: problem(base="floating", momentum=(0, 0, 1)),
    "momentum in a plane": lambda: Momentum(linear=(0, 1)),
    "base_goal of a fixed base": lambda: problem(base_goal=(1, 0, 0, 0)),
    "base_goal of three numbers": lambda: problem(base="floating", base_goal=(1, 0, 0)),
    "base_goal of zeros": lambda: problem(base="floating", base_goal=(0, 0, 0, 0)),
    "base_goal a word": lambda: problem(base="floating", base_goal="as_it_was"),
    "base_goal tolerance zero": lambda: AttitudeGoal((1, 0, 0, 0), 0.0),
    "base_limits of a fixed base": lambda: problem(base_limits=BaseLimits(peak=0.1)),
    "base_limits a mapping": lambda: problem(base="floating", base_limits={"peak": 0.1}),
    "base_limits below 0": lambda: BaseLimits(rate=-0.1),
    "base_limits text": lambda: BaseLimits(joint_momentum="1"),
    "base_limits beside the goal": lambda: problem(base="floating", base_goal=(1, 0, 0, 0), base_limits=BaseLimits(final=0.1)),
    "base_start out of this world": lambda: problem(base_start=(0, 0, 1e9)),
    "momentum that carries it away": lambda: problem(base="floating", momentum=Momentum(linear=(1e300, 0, 0)), duration=1),
    "momentum that spins it": lambda: problem(base="floating", momentum=Momentum(angular=(0, 0, 1e300)), duration=1),
    "base_limits of rest": lambda: BaseLimits(rate=1e-300),
    "duration of no time": lambda: problem(duration=1e-300),
    "duration of an age": lambda: problem(duration=1e300),
    "duration zero": lambda: problem(duration=0),
    "duration infinite": lambda: problem(duration=math.inf),
    "duration a word": lambda: problem(duration="short"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_problem_that_cannot_be_is_refused(case: str) -> None:
    assert_refused("problem", case, ProblemError, REFUSED[case])


def test_a_base_floats_only_with_masses() -> None:
    light = replace(ARM, bodies=())
    assert_refused("problem", "base floating without masses", RobotError, lambda: problem(robot=light, base="floating"))
    assert_refused(
        "problem", "robot floating without masses", RobotError, lambda: problem(robot=replace(light, base="floating"))
    )


def test_a_scene_that_is_none_is_the_scenes_to_refuse() -> None:
    assert_refused("problem", "scene of names", SceneError, lambda: problem(scene=["ball"]))
