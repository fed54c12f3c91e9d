"""Inverse kinematics from many guesses: all kinds of robots by Pinocchio, how many are found, and where the search ends."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import Box, Scene, Sphere
from spacearm.planner import PlannerSettings, PoseGoal, PositionGoal, Problem
from spacearm.planner.explanations import explain_goal
from spacearm.planner.inverse_kinematics import Reach, find_goal_configurations, polished, reach_of, reaches
from spacearm.robot import Robot, forward_kinematics, load_robot
from support import urdf_text
from support.dense_samples import planar
from support.goal_checks import assert_sound, goal_at, missed
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames as pinocchio_frames

EIGHT = PlannerSettings()
WIDE = 'lower="-2.9" upper="2.9" velocity="1" effort="1"'
TURNS = 'lower="-6.5" upper="6.5" velocity="1" effort="1"'
BALL = '<sphere radius="0.03"/>'


def links(count: int) -> list[str]:
    return [urdf_text.link(f"link_{i}", urdf_text.collision(BALL)) for i in range(count)]


def swinging(name: str, parent: int, *, axis: str, xyz: str, extra: str = "", limit: str = WIDE) -> str:
    child = f"link_{parent + 1}"
    return urdf_text.joint(name, f"link_{parent}", child, axis=axis, xyz=xyz, extra=extra, limit=limit)


def on_a_slide() -> Robot:
    """Six joints on a slide, the hand beside its last one."""
    slide = urdf_text.joint(
        "slide", "link_0", "link_1", kind="prismatic", axis="1 0 0", limit='lower="-0.4" upper="0.4" velocity="1" effort="1"'
    )
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
    joints = [swinging(f"j{i}", i + 1, axis=axis, xyz="0.2 0 0.1") for i, axis in enumerate(axes)]
    hand = urdf_text.joint("hand", "link_7", "link_8", kind="fixed", xyz="0.1 -0.05 0.2", rpy="0.3 0.4 -1.2")
    return urdf_text.loaded(urdf_text.robot(*links(9), slide, *joints, hand), tip="link_8")


def mimicking() -> Robot:
    """Joints that follow others: at half their pace, backwards, and a slide that an angle drives."""
    joints = [
        swinging("one", 0, axis="0 0 1", xyz="0 0 0.1"),
        swinging("two", 1, axis="0 1 0", xyz="0.1 0 0.2"),
        swinging("three", 2, axis="0 1 0", xyz="0.4 0 0", extra='<mimic joint="two" multiplier="-0.5" offset="0.2"/>'),
        swinging("four", 3, axis="1 0 0", xyz="0.3 0 0"),
        swinging("five", 4, axis="0 1 0", xyz="0.2 0 0"),
        urdf_text.joint(
            "six",
            "link_5",
            "link_6",
            kind="prismatic",
            axis="1 0 0",
            xyz="0.1 0 0",
            limit='lower="-1" upper="1" velocity="1" effort="1"',
            extra='<mimic joint="one" multiplier="0.05"/>',
        ),
        swinging("seven", 6, axis="1 0 0", xyz="0.1 0 0"),
    ]
    return urdf_text.loaded(urdf_text.robot(*links(8), *joints), tip="link_7")


def two_armed() -> Robot:
    """An arm of four joints, and another one of two that does not move its hand."""
    right = [swinging(f"r{i}", i, axis=axis, xyz="0.3 0 0.1") for i, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "0 0 1"))]
    left = [
        urdf_text.joint("l0", "link_0", "link_5", axis="0 0 1", xyz="0 0.4 0", limit=WIDE),
        urdf_text.joint("l1", "link_5", "link_6", axis="0 1 0", xyz="0.2 0 0", limit=WIDE),
    ]
    return urdf_text.loaded(urdf_text.robot(*links(7), *right, *left), tip="link_4")


ROBOTS: dict[str, Any] = {
    "slide": on_a_slide,
    "mimics": mimicking,
    "two arms": two_armed,
    **{name: lambda name=name: load_robot(name) for name in ("zhang2022", "srs7", "ssrms", "servicer7", "ets7")},
}
SCENE = Scene([Box((0.2, 0.2, 0.2), (0.3, -0.5, 0.4), name="box"), Sphere((-0.4, 0.3, 0.5), 0.15)])
IN_SPACE = ("ssrms", "servicer7", "ets7")  # whose bases are as large as that scene


def reached_problem(robot: Robot, seed: int, kind: str, **options: Any) -> Problem:
    """A goal that a drawn configuration reaches with 2 cm of room, as the start has."""
    generator = np.random.default_rng(seed)
    scene = Scene([]) if robot.name in IN_SPACE else SCENE
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    while True:
        start, q = generator.uniform(low, high, (2, robot.dof))
        if least_distances(robot, scene, pinocchio_frames(robot, np.array([start, q]))).min() > 0.02:
            return Problem(robot, scene, start=start, goal=goal_at(forward_kinematics(robot, q), kind, **options), base="fixed")


@pytest.mark.parametrize("kind", ["position", "pose", "free axis"])
@pytest.mark.parametrize("name", ROBOTS)
def test_what_robots_of_all_kinds_reach_is_found_and_sound(name: str, kind: str) -> None:
    robot = ROBOTS[name]()
    for seed in range(3):
        problem = reached_problem(robot, seed, kind)
        found = find_goal_configurations(problem, EIGHT, seed)
        assert_sound(problem, found)
        assert len(found.q)


@pytest.mark.parametrize("name", ["zhang2022", "srs7", "servicer7"])
def test_an_arm_of_seven_joints_has_its_eight_ways_to_a_pose_and_most_are_at_its_very_centre(name: str) -> None:
    """Of some poses there are fewer, as many more guesses show; where a joint is at its limit, the tolerance may help."""
    robot, all_there_are = load_robot(name), 0
    for seed in range(8):
        problem = reached_problem(robot, seed, "pose")
        found = find_goal_configurations(problem, EIGHT, seed)
        assert_sound(problem, found)
        many = find_goal_configurations(problem, PlannerSettings(goal_candidates=256), seed)
        all_there_are += len(found.q) >= min(8, len(many.q))
        assert np.median([max(missed(robot, problem.goal, q)) for q in found.q]) < 1e-7
    assert all_there_are >= 6


def test_of_the_ways_of_a_planar_arm_there_are_two_however_many_are_asked_for() -> None:
    problem = Problem(planar(), [], start=(0.1, 0.0), goal=PositionGoal((1.2, 0.5, 0.0)))  # type: ignore[arg-type]
    for most in (1, 2, 8, 64):
        found = find_goal_configurations(problem, PlannerSettings(goal_candidates=most), 0)
        assert len(found.q) == min(most, 2)
        assert found.searches == 16 * most * (1 if most <= 2 else 2)  # it ends where twice as many guesses bring nothing new


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
@settings(max_examples=10)
def test_joints_that_turn_more_than_once_come_nearest_to_the_start_and_then_whole_turns_away(one: float, two: float) -> None:
    """Two ways of the arm, each nearest to the start; then each a turn away, as far as the limits let it."""
    robot = planar(lower=(-6.5, -6.5), upper=(6.5, 6.5))
    start, point = np.array([one, two]), np.array([1.2, 0.5, 0.0])
    problem = Problem(robot, [], start=start, goal=PositionGoal(point))  # type: ignore[arg-type]
    found = find_goal_configurations(problem, EIGHT, 0)
    assert_sound(problem, found)
    r, bearing = float(np.linalg.norm(point)), math.atan2(point[1], point[0])
    elbow = math.acos((r**2 - 2) / 2)
    ways = np.array([[bearing - elbow / 2, elbow], [bearing + elbow / 2, -elbow]])
    turns = math.tau * np.array([(i, k) for i in (-1, 0, 1) for k in (-1, 0, 1)])
    everywhere = (ways[:, None] + turns).reshape(-1, 2)
    everywhere = everywhere[(np.abs(everywhere) <= 6.5).all(axis=1)]
    away = np.sort(np.linalg.norm(everywhere - start, axis=1))
    np.testing.assert_allclose(np.linalg.norm(found.q[:2] - start, axis=1)[0], away[0], rtol=0, atol=1e-7)
    for q in found.q:  # each is one of them
        assert np.abs(everywhere - q).max(axis=1).min() < 1e-7
    assert len(found.q) >= min(len(everywhere), 6)


@pytest.mark.parametrize("angle", [-5.5, -3.5, 3.5, 5.5])
def test_what_others_follow_at_another_pace_is_turned_as_far_as_the_search_for_motions_goes(angle: float) -> None:
    """A joint without limits, another that follows it at half its pace: only beyond half a turn is the goal reached."""
    joints = planar().joints
    robot = planar(
        joints=(joints[0], replace(joints[1], dof=0, multiplier=0.5)),
        lower=(-np.inf,),
        upper=(np.inf,),
        velocity=(1.0,),
        acceleration=(1.0,),
    )
    hand = pinocchio_frames(robot, np.array([[angle]]))[0, 1] @ robot.frame(robot.tip).T_joint_frame
    problem = Problem(robot, [], start=(0.0,), goal=PositionGoal(hand[:3, 3]))  # type: ignore[arg-type]
    found = find_goal_configurations(problem, EIGHT, 0)
    assert np.abs(found.q - angle).min() < 1e-6


def test_joints_that_do_not_move_the_frame_stay_where_they_are_if_they_can() -> None:
    robot = two_armed()
    other = [i for i, name in enumerate(robot.dof_names) if name.startswith("l")]
    problem = replace(reached_problem(robot, 0, "position"), scene=Scene([]))
    found = find_goal_configurations(problem, EIGHT, 0)
    np.testing.assert_array_equal(found.q[0][other], problem.start[other])


@pytest.mark.parametrize("kind", ["position", "pose", "free axis"])
def test_more_guesses_find_what_is_as_near_or_nearer(kind: str) -> None:
    """The guesses of a search for more candidates begin with those of one for fewer."""
    for seed in range(5):
        problem = reached_problem(load_robot("zhang2022"), seed, kind)
        few, many = (find_goal_configurations(problem, PlannerSettings(goal_candidates=n), 3).q for n in (8, 64))
        nearest = [np.linalg.norm(q[0] - problem.start) for q in (few, many)]
        assert nearest[1] <= nearest[0] + 0.3  # but for what other choices are pulled to


# ---- where nothing is found ------------------------------------------------------------------------------------------


def blocked() -> Problem:
    """A ball sits where the hand is to be."""
    problem = reached_problem(load_robot("zhang2022"), 1, "pose")
    return replace(problem, scene=Scene([Sphere(problem.goal.pose[:3, 3], 0.12, name="ball")]))  # type: ignore[union-attr]


def test_a_goal_that_is_reached_in_collision_alone_is_counted_and_explained() -> None:
    problem = blocked()
    found = find_goal_configurations(problem, PlannerSettings(goal_candidates=2), 0)
    assert not len(found.q)
    assert found.reached == found.in_collision > 0
    assert found.closest is not None
    for error, tolerance in zip(missed(problem.robot, problem.goal, found.closest), (1e-3, math.radians(0.5)), strict=True):
        assert error <= tolerance + 1e-9
    report = explain_goal(problem, found)
    assert report.status == "goal_in_collision"
    assert "'ball'" in report.message


@pytest.mark.parametrize("kind", ["position", "pose", "free axis"])
def test_swarms_look_no_more_where_the_hand_itself_is_in_an_obstacle_at_the_pose(kind: str) -> None:
    """With a pose, the hand is where it is, whatever the joints do; a tolerance as wide as the ball lets it out."""
    problem, two = blocked(), PlannerSettings(goal_candidates=2)
    T = problem.goal.pose  # type: ignore[union-attr]
    found = find_goal_configurations(replace(problem, goal=goal_at(T, kind)), two, 0)
    assert not len(found.q)
    assert (found.searches == 128 * 2) == (kind == "pose")
    if kind == "pose":
        wide = goal_at(T, kind, position_tolerance=0.3, orientation_tolerance=0.5)
        found = find_goal_configurations(replace(problem, goal=wide), two, 0)
        assert_sound(replace(problem, goal=wide), found)
        assert len(found.q)
        assert found.searches > 128 * 2


def test_a_goal_out_of_reach_ends_the_search_before_any_swarm() -> None:
    robot = load_robot("zhang2022")
    T = forward_kinematics(robot, np.full(7, 0.4))
    beyond, missing = T.copy(), T.copy()
    beyond[:3, 3] *= 100  # farther than all links together
    missing[:3, 3] *= 0.99 * reach_of(robot, robot.tip) / np.linalg.norm(T[:3, 3])
    for pose, most in ((beyond, 16 * 2), (missing, 128 * 2)):
        problem = Problem(robot, Scene([]), start=np.zeros(7), goal=PoseGoal(pose))
        found = find_goal_configurations(problem, PlannerSettings(goal_candidates=2), 0)
        assert (len(found.q), found.reached, found.in_collision) == (0, 0, 0)
        assert found.searches == most
        assert found.closest is not None
        distance, angle = missed(robot, problem.goal, found.closest)
        np.testing.assert_allclose((found.distance, found.angle), (distance, angle), rtol=0, atol=1e-9)
        assert explain_goal(problem, found).status == "goal_unreachable"


def test_when_time_is_up_the_first_guesses_are_all() -> None:
    settings = PlannerSettings(goal_candidates=2)
    assert find_goal_configurations(blocked(), settings, 0, late=lambda: True).searches == 16 * 2
    free = reached_problem(load_robot("zhang2022"), 1, "pose")
    assert len(find_goal_configurations(free, settings, 0, late=lambda: True).q)


def test_behind_a_wall_with_a_slit_swarms_find_what_guesses_do_not() -> None:
    """The planar arm folds around balls on both of its ways to the goal's centre; within the tolerance there is room."""
    goal = PositionGoal((1.5, 0.0, 0.0), tolerance=0.4)
    ball = Sphere((1.5, 0.0, 0.0), 0.1)
    problem = Problem(planar(), Scene([ball]), start=(-1.0, 0.0), goal=goal)
    found = find_goal_configurations(problem, PlannerSettings(goal_candidates=2), 0)
    assert_sound(problem, found)
    assert len(found.q)
    assert found.searches > 128 * 2


# ---- damped least squares --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["position", "pose", "free axis"])
@pytest.mark.parametrize("rows", [0, 1, 3, 8, 19])
def test_rows_are_polished_alike_alone_and_side_by_side(kind: str, rows: int) -> None:
    robot = on_a_slide()
    generator = np.random.default_rng(rows)
    q = generator.uniform(robot.lower, robot.upper, (rows, robot.dof))
    reach = Reach(robot=robot, goal=goal_at(forward_kinematics(robot, np.full(robot.dof, 0.2)), kind))
    together = polished(reach, q, robot.lower, robot.upper)
    assert together.shape == q.shape
    for row, one in zip(q, together, strict=True):
        alone = polished(reach, row[None], robot.lower, robot.upper)[0]
        if reaches(reach, alone[None])[0]:
            assert reaches(reach, one[None])[0]
        else:
            np.testing.assert_allclose(alone, one, rtol=0, atol=1e-12)


def test_joints_within_narrow_bounds_stay_there() -> None:
    robot = load_robot("zhang2022")
    reach = Reach(robot=robot, goal=goal_at(forward_kinematics(robot, np.full(7, 0.4)), "pose"))
    lower, upper = np.full(7, 0.1), np.full(7, 0.3)
    q = polished(reach, np.full((4, 7), 2.0), lower, upper)
    assert ((q >= lower) & (q <= upper)).all()
