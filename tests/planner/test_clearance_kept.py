"""The clearance that a problem requires: searched for, kept by every plan that is found, and told where it is not met."""

from __future__ import annotations

import math
import signal
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from spacearm.core.errors import ProblemError
from spacearm.files import plan_as_dict
from spacearm.files.plan_file import problem_as_dict, problem_from_dict, problem_hash
from spacearm.geometry import Box, HalfSpace, Obstacle, Scene, Sphere, pose
from spacearm.planner import ConfigurationGoal, Plan, PlannerSettings, PositionGoal, Problem, plan
from spacearm.planner.inverse_kinematics import find_goal_configurations
from spacearm.robot import Robot, load_robot
from support.dense_samples import planar
from support.messages import assert_refused
from support.oracles import coal_shapes, pinocchio_points

SMALL = PlannerSettings(evaluations=2000, goal_candidates=2)
BALL = Sphere((1.2, 1.2, 0.0), 0.3, name="ball")
INSTANTS = 1001


def turn(scene: Any = (BALL,), **asked: Any) -> Problem:
    """The planar arm, stretched, from x to y; a ball stands where the stretched arm would pass."""
    given = {"start": (0.0, 0.0), "goal": (math.pi / 2, 0.0), **asked}
    return Problem(given.pop("robot", planar()), Scene(scene), **given)


def measured(found: Plan, obstacles: list[Obstacle], links: tuple[str, ...] = ()) -> np.ndarray:
    """The least distance of some links (all) to some obstacles at many instants, by Coal and Pinocchio."""
    trajectory = found.trajectory
    assert trajectory is not None
    robot: Robot = found.problem.robot
    frames = pinocchio_points.joint_frames(robot, trajectory.sample(np.linspace(0, trajectory.duration, INSTANTS)).q)
    some = robot.capsules if not links else tuple(capsule for capsule in robot.capsules if capsule.name in links)
    return coal_shapes.least_distances(replace(robot, capsules=some, self_pairs=()), Scene(obstacles), frames)


# ---- kept, and proven ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("clearance", [0.0, 0.01, 0.03])
def test_a_plan_has_the_clearance_that_was_asked_for_at_every_instant(clearance: float, seed: int) -> None:
    found = plan(turn(clearance=clearance), SMALL, rng=seed)
    assert found.found, found.message
    assert found.certificate is not None
    assert found.certificate.clearance is not None
    assert found.certificate.clearance >= clearance
    assert measured(found, [BALL]).min() >= clearance


@pytest.mark.parametrize("seed", range(5))
def test_a_clearance_of_its_own_is_kept_by_the_pair_it_is_for_and_no_other(seed: int) -> None:
    """30 mm from the ball, 5 mm from the wall that the arm has to pass close by, and 80 mm of its upper part from the ball."""
    wall = Box((0.1, 1.0, 1.0), pose((-0.25, 1.5, 0)), name="wall")
    pairs = [sa.PairClearance(0.03, obstacle="ball"), sa.PairClearance(0.08, obstacle="ball", link="upper")]
    found = plan(turn([BALL, wall], clearance=0.005, clearances=pairs), SMALL, rng=seed)
    assert found.found, found.message
    assert measured(found, [BALL]).min() >= 0.03
    assert measured(found, [BALL], ("upper",)).min() >= 0.08
    assert measured(found, [wall]).min() >= 0.005


@pytest.mark.parametrize("seed", range(3))
def test_a_goal_in_space_is_reached_with_the_clearance_wherever_that_is_possible(seed: int) -> None:
    ball = Sphere((1.0, 1.1, 0.0), 0.2, name="ball")
    problem = turn([ball], goal=PositionGoal((0.9, 0.75, 0.0), tolerance=0.001), clearance=0.03)
    found = find_goal_configurations(problem, PlannerSettings(), seed)
    assert len(found.q)
    assert found.clearance.min() >= 0.03


# ---- near at an end ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("end", ["start", "goal"])
def test_an_arm_leaves_its_cradle_and_comes_no_nearer_to_it(end: str, seed: int) -> None:
    """The cradle is 3 mm from where the arm begins or ends, another ball in its way; 20 mm are asked for."""
    place = (1.5, -0.253, 0) if end == "start" else (-0.253, 1.5, 0)
    cradle = Sphere(place, 0.2, name="cradle")
    found = plan(turn([BALL, cradle], clearance=0.02), SMALL, rng=seed)
    assert found.found, found.message
    assert measured(found, [BALL]).min() >= 0.02
    to_cradle = measured(found, [cradle])
    to_cradle = to_cradle if end == "start" else to_cradle[::-1]
    assert to_cradle.min() >= 0.0029 - 1e-9
    out = int(np.argmax(to_cradle >= 0.0201))
    assert out > 0
    assert to_cradle[out:].min() >= 0.02
    assert found.searched is not None
    (near,) = found.searched.near
    assert (near.link, near.other, near.required) == ("fore", "obstacle 'cradle'", 0.02)
    assert near.clearance == pytest.approx(0.003)
    assert "cradle" in found.message


@pytest.mark.parametrize("seed", range(2))
def test_an_arm_on_a_floating_base_leaves_its_cradle_too(seed: int) -> None:
    """The hand begins 4 mm from the cradle; base and arm move, and the cradle does not."""
    robot, start = load_robot("srs7"), np.array([0, 0, 0, 0.4, 0, 0, 0])
    part = [shape for shape in robot.capsules if shape.joint >= 0][-1]
    T = pinocchio_points.joint_frames(robot, start[None])[0, part.joint]
    middle = T[:3, :3] @ ((part.a + part.b) / 2) + T[:3, 3]
    beside = np.cross(T[:3, :3] @ (part.b - part.a), (0.3, 0.4, 0.5))
    center = middle + beside / np.linalg.norm(beside) * (part.radius + 0.054)
    cradle = Sphere(center, 0.05, name="cradle")
    goal = (0.9, 0.3, 0.6, 1.5, -0.5, 0.4, 0.1)
    problem = Problem(robot, [cradle], start=start, goal=goal, base="floating", clearance=0.02)
    found = plan(problem, replace(SMALL, evaluations=1000), rng=seed)
    assert found.found, found.message
    assert found.trajectory is not None
    times = np.linspace(0, found.trajectory.duration, 301)
    position, attitude = found.trajectory.base_pose(times)
    frames = pinocchio_points.joint_frames(robot, found.trajectory.sample(times).q)
    T_w_b = np.array([pose(p, q) for p, q in zip(position, attitude, strict=True)])
    moving = replace(robot, shapes=tuple(shape for shape in robot.shapes if shape.joint >= 0), self_pairs=())
    away = coal_shapes.least_distances(moving, Scene([cradle]), T_w_b[:, None] @ frames)
    assert away.min() >= 0.0039 - 1e-6
    out = int(np.argmax(away >= 0.0201))
    assert out > 0
    assert away[out:].min() >= 0.02 - 1e-6


def test_a_start_that_touches_is_a_collision_as_ever() -> None:
    found = plan(turn([Sphere((1.5, -0.25, 0), 0.2)]), SMALL, rng=0)
    assert found.status == "start_in_collision"


# ---- not met -------------------------------------------------------------------------------------------------------------


def narrow(gap: float) -> Problem:
    """The stretched arm, which cannot bend, turns between two boxes that leave it this much on either side."""
    above, below = (
        Box((0.5, 0.8, 0.4), pose((1.5, 0.0, side * (0.25 + gap))), name=name) for name, side in (("above", 1), ("below", -1))
    )
    return turn([above, below], start=(-0.8, 0.0), goal=(0.8, 0.0), robot=planar(upper=(3.0, 1e-3), lower=(-3.0, -1e-3)))


def test_what_cannot_be_met_is_not_found_and_the_clearance_that_can_is_told() -> None:
    problem = replace(narrow(0.006), clearance=0.01)
    found = plan(problem, SMALL, rng=0)
    assert (found.status, found.found) == ("not_found", False)
    assert found.achievable is not None
    share = found.achievable
    assert 0.005 <= 0.01 * share < 0.006
    told = f"with clearance {0.01 * share:.4g} a motion is found and proven"
    assert found.message.startswith(f"no motion with a clearance of 10 mm was found; {told}; the best one: ")
    assert plan_as_dict(found)["achievable"] == {"share": share, "clearance_m": 0.01 * share}
    assert plan(problem, SMALL, rng=0).achievable == share  # repeatable
    assert plan(replace(problem, clearance=0.01 * share), SMALL, rng=0).found


def test_where_no_clearance_helps_that_is_told_too() -> None:
    found = plan(narrow(-0.001), PlannerSettings(evaluations=600), rng=0)
    assert (found.status, found.achievable) == ("not_found", None)
    assert "none was found with clearance 0 either" in found.message
    bare = plan(replace(narrow(-0.001), clearance=0.0), PlannerSettings(evaluations=600), rng=0)
    assert bare.message.startswith("no collision-free motion was found")


def test_ctrl_c_ends_the_search_with_less_clearance_too() -> None:
    said: list[str] = []

    def interrupt(stage: str) -> None:
        said.append(stage)
        if stage == "a motion with less clearance":
            signal.raise_signal(signal.SIGINT)

    found = plan(narrow(0.006), SMALL, rng=0, progress=interrupt)
    assert (found.status, found.interrupted, found.achievable) == ("not_found", True, None)
    assert said[-1] == "a motion with less clearance"
    assert "; it was interrupted; " in found.message
    assert "with clearance 0" not in found.message


def test_a_time_budget_holds_for_the_search_with_less_clearance_too() -> None:
    found = plan(narrow(0.006), PlannerSettings(time_budget=0.5), rng=0)
    assert found.status == "not_found"
    assert "with clearance 0.00" in found.message


# ---- what a problem states -----------------------------------------------------------------------------------------------


def test_a_problem_asks_for_10_mm_unless_it_says_otherwise() -> None:
    assert (turn().clearance, turn().clearances, turn().snap_tolerance) == (0.01, (), 1e-5)
    told = [{"obstacle": "ball", "clearance": 0.05}, {"links": ["upper", "fore"], "clearance": 0.02}]
    robot = planar(self_pairs=(("fore", "upper"),))
    problem = turn(clearances=told, robot=robot)
    pairs = (sa.PairClearance(0.05, obstacle="ball"), sa.PairClearance(0.02, link="upper", other_link="fore"))
    assert problem == turn(clearances=pairs, robot=robot)
    np.testing.assert_array_equal(problem.required.to_obstacles, np.full((2, 1), 0.05))


REFUSED: dict[str, Any] = {
    "negative": lambda: turn(clearance=-0.01),
    "not a number": lambda: turn(clearance=math.nan),
    "text": lambda: turn(clearance="10 mm"),
    "pairs a mapping": lambda: turn(clearances={"obstacle": "ball"}),
    "pairs a text": lambda: turn(clearances="ball"),
    "pair a number": lambda: turn(clearances=[0.05]),
    "pair mistyped": lambda: turn(clearances=[{"obstacel": "ball", "clearance": 0.05}]),
    "pair without clearance": lambda: turn(clearances=[{"obstacle": "ball"}]),
    "pair of no obstacle": lambda: turn(clearances=[{"obstacle": "bal", "clearance": 0.05}]),
    "pair of no link": lambda: turn(clearances=[{"link": "four", "clearance": 0.05}]),
    "pair of one link": lambda: turn(clearances=[{"links": ["fore"], "clearance": 0.05}]),
    "snap negative": lambda: turn(snap_tolerance=-1e-6),
    "snap too far": lambda: turn(snap_tolerance=0.2),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_clearance_that_cannot_be_is_refused(case: str) -> None:
    assert_refused("required_clearance", case, ProblemError, REFUSED[case])


@pytest.mark.parametrize(("beyond", "tolerance", "taken"), [(5e-6, 1e-5, True), (5e-5, 1e-5, False), (5e-3, 1e-2, True)])
def test_a_start_a_little_beyond_a_limit_is_set_onto_it_and_told(beyond: float, tolerance: float, taken: bool) -> None:
    robot = planar()
    start = (float(robot.upper[0]) + beyond, 0.0)
    if not taken:
        with pytest.raises(ProblemError, match="above its limit"):
            turn([], start=start, snap_tolerance=tolerance)
        return
    problem = turn([], start=start, goal=ConfigurationGoal(start), snap_tolerance=tolerance)
    assert problem.start[0] == robot.upper[0]
    assert [note for note in problem.notes if "set onto" in note]


def test_a_problem_goes_through_a_file_with_its_clearances_and_0_is_no_part_of_its_hash() -> None:
    pairs = [sa.PairClearance(0.05, obstacle="ball"), sa.PairClearance(0.02, link="fore")]
    for problem in (turn(clearance=0.0), turn(clearance=0.02), turn(clearances=pairs, snap_tolerance=1e-3)):
        values = problem_as_dict(problem)
        assert values["clearance"] == problem.clearance
        assert problem_from_dict(values) == problem
    values = problem_as_dict(turn(clearance=0.0))
    del values["clearance"]
    assert problem_from_dict(values).clearance == 0.0
    assert problem_hash(problem_from_dict(values)) == problem_hash(turn(clearance=0.0)) != problem_hash(turn())


def test_the_frame_that_the_base_begins_in_changes_no_clearance() -> None:
    pairs = [sa.PairClearance(0.05, obstacle="ball")]
    problem = turn([BALL, HalfSpace((0, 0, 1), (0, 0, -1))], clearance=0.02, clearances=pairs, base_start=pose((1, 2, 3)))
    assert (problem.local.clearance, problem.local.clearances) == (0.02, problem.clearances)
    np.testing.assert_array_equal(problem.local.required.to_obstacles, problem.required.to_obstacles)
