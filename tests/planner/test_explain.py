"""Why there can be no plan: contacts, limits and closest approaches, against closed forms and Coal."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from spacearm.geometry import Scene, Sphere, SphereSet, pose
from spacearm.planner import ConfigurationGoal, PlannerSettings, PoseGoal, PositionGoal, Problem
from spacearm.planner.explanations import EndReport, check_ends, contacts, explain_goal
from spacearm.planner.inverse_kinematics import find_goal_configurations, reach_of
from spacearm.robot import LinkCapsule, Robot, forward_kinematics
from support import drawn_shapes, strategies, urdf_text
from support.dense_samples import arms, planar
from support.messages import assert_sentence
from support.oracles.coal_shapes import Placed, distance, placed_capsule, placed_obstacle
from support.oracles.pinocchio_points import joint_frames as pinocchio_frames

FEW = PlannerSettings(goal_candidates=2)


def turn(goal: Any, *scene: Sphere, robot: Robot | None = None, start: Any = (-1.0, 0.0)) -> Problem:
    """The planar arm, two links of 1 m, stretched at first."""
    return Problem(robot or planar(), Scene(scene), start=start, goal=goal)


def explained(problem: Problem) -> EndReport:
    """What the planner would say of a problem whose motion cannot begin or end."""
    report = check_ends(problem)
    return report if report.status != "free" else explain_goal(problem, find_goal_configurations(problem, FEW, 0))


def placed_on(frames: np.ndarray, capsule: LinkCapsule) -> Placed:
    """A link's capsule where the moving frames (joints, 4, 4) put it."""
    T = np.eye(4) if capsule.joint < 0 else frames[capsule.joint]
    return placed_capsule(*(T[:3, :3] @ end + T[:3, 3] for end in (capsule.a, capsule.b)), capsule.radius)


def bent() -> Robot:
    """The planar arm with an elbow that hardly bends."""
    return planar(lower=(-np.pi, -0.05), upper=(np.pi, 0.1))


def folding() -> Robot:
    """The planar arm with a thick hand on it that must keep clear of the upper link."""
    hand = LinkCapsule(name="hand", joint=1, a=np.array([1.0, 0, 0]), b=np.array([1.0, 0, 0]), radius=0.2)
    return planar(capsules=(*planar().capsules, hand), self_pairs=(("upper", "hand"),))


def slide() -> Robot:
    """A slide of 2 m along x and an arm of 0.5 m on it."""
    limit = 'lower="-1" upper="1" velocity="1"'
    text = urdf_text.chain(
        urdf_text.joint("slide", "link_0", "link_1", kind="prismatic", limit=limit, axis="1 0 0"),
        urdf_text.joint("swing", "link_1", "link_2", kind="continuous"),
        urdf_text.joint("end", "link_2", "link_3", kind="fixed", xyz="0.5 0 0"),
    )
    return urdf_text.loaded(text, tip="link_3")


BALL = Sphere((1.5, 0.0, 0.0), 0.1, name="ball")
NEAR = Sphere((0.5, 0.1, 0.0), 0.1)
CASES: dict[str, Any] = {
    "start in collision": lambda: turn((2.0, 0.0), BALL, start=(0.0, 0.0)),
    "start in collision twice": lambda: turn((2.0, 0.0), BALL, NEAR, start=(0.0, 0.0)),
    "start in collision with five": lambda: turn(
        (2.0, 0.0), *[Sphere((1.5, 0.02 * i, 0), 0.1) for i in range(5)], start=(0, 0)
    ),
    "start touches": lambda: turn((2.0, 0.0), Sphere((1.5, 0.15, 0.0), 0.1), start=(0.0, 0.0)),
    "both ends in collision": lambda: turn((0.1, 0.0), BALL, start=(0.0, 0.0)),
    "goal in collision": lambda: turn((0.0, 0.0), BALL),
    "goal in collision within its tolerance": lambda: turn(ConfigurationGoal((0, 0), tolerance=0.05), BALL),
    "start in collision with itself": lambda: turn((2.0, 0.0), robot=folding(), start=(0.0, 3.0)),
    "goal in collision with itself and a ball": lambda: turn((0.0, 3.0), NEAR, robot=folding()),
    "position that folds the arm": lambda: turn(PositionGoal((0.1, 0.0, 0.0)), robot=folding()),
    "all goals in collision": lambda: turn([(0.0, 0.0), (0.09, 0.0), (0.02, 0.0)], BALL),
    "position inside a ball": lambda: turn(PositionGoal((1.5, 0.0, 0.0)), BALL),
    "position out of reach": lambda: turn(PositionGoal((3.0, 4.0, 0.0))),
    "position out of the plane": lambda: turn(PositionGoal((1.0, 0.0, 0.3))),
    "position that the elbow's limit keeps": lambda: turn(PositionGoal((1.0, 0.0, 0.0)), robot=bent()),
    "pose that the elbow's limit keeps": lambda: turn(PoseGoal(forward_kinematics(planar(), [0.3, 1.0])), robot=bent()),
    "pose turned out of the plane": lambda: turn(PoseGoal(pose((2.0, 0.0, 0.0), (1, 1, 0, 0)))),
    "axis turned out of the plane": lambda: turn(PoseGoal(pose((1.0, 0.0, 0.0), (1, 1, 0, 0)), free_axis="z")),
    "position beyond the slide": lambda: turn(PositionGoal((2.2, 0.0, 0.0)), robot=slide(), start=(0.0, 0.0)),
}


@pytest.mark.parametrize("case", CASES)
def test_why_there_can_be_no_motion_is_said_in_a_sentence(case: str) -> None:
    report = explained(CASES[case]())
    assert report.status != "free"
    assert_sentence("explain", case, report.message)


def test_free_ends_need_no_words() -> None:
    for goal in ((2.0, 0.0), [(0.0, 0.0), (2.0, 0.0)], PositionGoal((0.0, 1.5, 0.0)), ConfigurationGoal((0, 0), tolerance=0.5)):
        problem = turn(goal, BALL)
        report = check_ends(problem)
        assert (report.status, report.contacts, report.message, report.q) == ("free", (), "", None)
        assert explain_goal(problem, find_goal_configurations(problem, FEW, 0)).status == "free"


def test_the_depth_is_the_distance_that_is_missing() -> None:
    report = check_ends(turn((0.0, 0.0), BALL, NEAR))
    assert report.status == "goal_in_collision"
    np.testing.assert_array_equal(report.q, [0.0, 0.0])
    assert [(c.link, c.other, c.kind) for c in report.contacts] == [("fore", "'ball'", "obstacle"), ("upper", "1", "obstacle")]
    np.testing.assert_allclose([c.depth for c in report.contacts], [0.15, 0.05], rtol=0, atol=1e-12)


@settings(max_examples=25)
@given(st.data())
def test_contacts_are_coals(data: st.DataObject) -> None:
    """Every pair of names that Coal finds penetrating is listed with its greatest depth, and no other."""
    robot = data.draw(arms())
    links = sorted({capsule.name for capsule in robot.capsules})
    pairs = [(a, b) for i, a in enumerate(links) for b in links[i + 1 :]]
    robot = replace(robot, self_pairs=tuple(data.draw(st.lists(st.sampled_from(pairs), max_size=3))) if pairs else ())
    scene = Scene(data.draw(st.lists(drawn_shapes.obstacles(), max_size=3)))
    start, goal = data.draw(strategies.configurations(robot, (2,)))
    problem = Problem(robot, scene, start=start, goal=goal)
    frames = pinocchio_frames(robot, start[None])[0]
    placed = [(capsule.name, placed_on(frames, capsule)) for capsule in robot.capsules]
    solids = [(scene.called(k), solid) for k, o in enumerate(scene.obstacles) for solid in placed_obstacle(o)]
    tried = [((name, other, "obstacle"), distance(one, solid)) for name, one in placed for other, solid in solids]
    tried += [
        ((a, b, "link"), distance(one, other))
        for a, b in robot.self_pairs
        for name, one in placed
        for far, other in placed
        if (name, far) == (a, b)
    ]
    assume(all(abs(gap) > 1e-5 for _, gap in tried))
    expected: dict[tuple[str, str, str], float] = {}
    for key, gap in tried:
        if gap < 0:
            expected[key] = max(expected.get(key, 0.0), -gap)
    found = contacts(problem.at_start, problem.start)
    depths = {(c.link, c.other, c.kind): c.depth for c in found}
    assert len(found) == len(depths)
    assert set(depths) == set(expected)
    for key, depth in depths.items():
        # Coal's depth is the least way out of the whole capsule, ours that of its axis' deepest point.
        assert depth <= expected[key] + 1e-5
        if all(isinstance(o, (Sphere, SphereSet)) for o in scene.obstacles):
            np.testing.assert_allclose(depth, expected[key], rtol=0, atol=1e-6)
    assert [c.depth for c in found] == sorted(depths.values(), reverse=True)
    assert (check_ends(problem).status == "start_in_collision") == bool(expected)


@given(st.floats(2.1, 6.0), st.floats(-3.0, 3.0))
@settings(max_examples=10)
def test_the_closest_approach_is_the_stretched_arms(r: float, bearing: float) -> None:
    report = explained(turn(PositionGoal((r * math.cos(bearing), r * math.sin(bearing), 0.0))))
    assert (report.status, report.angle, report.beyond) == ("goal_unreachable", 0.0, ())
    np.testing.assert_allclose(report.distance, r - 2, rtol=0, atol=1e-5)
    assert report.q is not None
    np.testing.assert_allclose(report.q, [bearing, 0.0], rtol=0, atol=1e-2)


@given(st.floats(0.3, 1.8))
@settings(max_examples=10)
def test_a_limit_in_the_way_is_named_with_the_angle_that_is_needed(r: float) -> None:
    """An elbow that bends by 0.1 keeps the hand 2 cos(0.05) m away; a point at r takes acos(r^2 / 2 - 1)."""
    report = explained(turn(PositionGoal((r, 0.0, 0.0)), robot=bent()))
    assert report.status == "goal_unreachable"
    np.testing.assert_allclose(report.distance, 2 * math.cos(0.05) - r, rtol=0, atol=1e-5)
    (elbow,) = report.beyond
    assert (elbow.joint, elbow.limit, elbow.unit) == ("elbow", 0.1, "rad")
    np.testing.assert_allclose(elbow.value, math.acos(r**2 / 2 - 1), rtol=0, atol=2e-3)


def test_a_goal_inside_an_obstacle_keeps_the_least_bad_configuration() -> None:
    report = explained(turn(PositionGoal((0.0, 1.5, 0.0)), Sphere((0.0, 1.5, 0.0), 0.3)))
    assert (report.status, report.distance, report.angle) == ("goal_in_collision", report.distance, 0.0)
    assert report.distance <= 1e-3
    assert report.contacts[0].other == "0"
    assert report.contacts[0].depth >= 0.35 - 1e-3  # the hand is at the ball's middle


@settings(max_examples=20)
@given(st.data())
def test_no_configuration_gets_farther_than_the_reach(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots())
    q = data.draw(strategies.configurations(robot, (20,)))
    far = np.linalg.norm(forward_kinematics(robot, q)[:, :3, 3], axis=1)
    assert (far <= reach_of(robot, robot.tip) + 1e-9).all()
