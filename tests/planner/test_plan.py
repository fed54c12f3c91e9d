"""Plans: proven, repeatable, straight where nothing is in the way, and a sentence where there is none."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import strategies
import urdf_text
from proof.dense import Setting, least_clearance, planar
from snapshot import assert_refused
from spacearm.errors import ProblemError, RobotError, SettingsError, SpacearmError
from spacearm.motion import Motion
from spacearm.planner import (
    ConfigurationGoal,
    Plan,
    PlannerSettings,
    PositionGoal,
    Problem,
    clearance,
    clearances,
    load_problem_file,
    plan,
    plan_as_dict,
)
from spacearm.planner.result import STATUSES
from spacearm.proof import certify
from spacearm.robot import LinkCapsule, forward_kinematics
from spacearm.scene import Scene, Sphere

PAPER = load_problem_file(Path(__file__).parents[2] / "examples" / "problem.yaml")
SMALL = PlannerSettings(particles=32, iterations=40, restarts=2, goal_candidates=2)
BALL = Sphere((1.2, 1.2, 0.0), 0.3)


def turn(*, scene: Any = (BALL,), start: Any = (0.0, 0.0), goal: Any = (math.pi / 2, 0.0), robot: Any = None) -> Problem:
    """The planar arm, stretched, from x to y; a ball stands where the stretched arm would pass."""
    return Problem(robot or planar(), Scene(scene), start=start, goal=goal)


def assert_proven(found: Plan, seed: int = 0) -> None:
    """A plan holds from start to goal, at instants that nobody of ours chose."""
    problem, trajectory = found.problem, found.trajectory
    assert (found.status, found.found, found.message) == ("found", True, STATUSES["found"])
    assert trajectory is not None
    assert found.certificate is not None
    assert certify(problem, trajectory).holds
    ends = trajectory.motion.control_points[[0, -1]]
    np.testing.assert_array_equal(ends[0], problem.start)
    goal = problem.goal
    if isinstance(goal, ConfigurationGoal):
        np.testing.assert_array_equal(ends[1], goal.q)
    else:
        reached = forward_kinematics(problem.robot, ends[1], frame=goal.frame)[:3, 3]
        assert np.linalg.norm(reached - goal.position) <= goal.tolerance
        assert any(np.array_equal(ends[1], q) for q in found.goals)
    if problem.scene.obstacles and problem.robot.capsules:
        assert least_clearance(Setting(problem.robot, problem.scene), trajectory, 5000, seed) > 0
    state = trajectory.sample(np.linspace(0, trajectory.duration, 2000))
    assert (np.abs(state.dq) <= problem.robot.velocity * (1 + 1e-9)).all()
    assert (np.abs(state.ddq) <= problem.robot.acceleration * (1 + 1e-9)).all()


def assert_same_plan(one: Plan, other: Plan) -> None:
    """Both plans are the same, bit for bit; only the clock may differ."""
    np.testing.assert_equal(plan_as_dict(one), plan_as_dict(other))


@pytest.mark.parametrize("seed", range(6))
def test_the_papers_problem_is_planned_and_proven(seed: int) -> None:
    found = plan(PAPER.problem, PAPER.settings, rng=seed)
    assert_proven(found, seed)
    assert found.seed == seed
    assert found.fitness["length"] == found.trajectory.motion.length()  # type: ignore[union-attr]
    assert found.fitness["duration"] == found.trajectory.duration  # type: ignore[union-attr]
    lengths = [entry.length for entry in found.history if entry.proven]
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[-1] == found.fitness["length"]
    assert set(found.timings) == {"goals", "search", "certify"}


def test_one_seed_gives_one_plan_on_any_number_of_threads() -> None:
    one, two = (plan(PAPER.problem, replace(PAPER.settings, threads=threads), rng=5) for threads in (1, 2))
    assert_same_plan(replace(one, settings=two.settings), two)
    assert_same_plan(one, plan(PAPER.problem, PAPER.settings, rng=5))
    other = plan(PAPER.problem, PAPER.settings, rng=6)
    assert not np.array_equal(one.goals, other.goals)


def test_a_generator_or_nothing_as_rng_is_recorded() -> None:
    from_generator = plan(turn(), SMALL, rng=np.random.default_rng(1))
    assert_same_plan(from_generator, plan(turn(), SMALL, rng=np.random.default_rng(1)))
    fresh = plan(turn(), SMALL)
    assert_same_plan(fresh, plan(turn(), SMALL, rng=fresh.seed))


@pytest.mark.parametrize("seed", range(4))
def test_a_configuration_goal_is_reached_exactly_around_the_ball(seed: int) -> None:
    found = plan(turn(), SMALL, rng=seed)
    assert_proven(found, seed)
    assert len(found.goals) == 1
    assert found.fitness["length"] > math.pi / 2
    assert found.fitness["length"] < 2 * math.pi


@pytest.mark.parametrize("seed", range(3))
def test_a_position_goal_of_a_planar_arm_is_one_of_its_two_closed_form_solutions(seed: int) -> None:
    """Two links of 1 m and a point at distance r: cos(elbow) = (r^2 - 2) / 2."""
    point = np.array([0.4, 1.1, 0.0])
    found = plan(turn(goal=PositionGoal(point, tolerance=1e-4), scene=[]), SMALL, rng=seed)
    assert_proven(found, seed)
    elbow = math.acos((point @ point - 2) / 2)
    bearing = math.atan2(point[1], point[0])
    solutions = np.array([[bearing - elbow / 2, elbow], [bearing + elbow / 2, -elbow]])
    for q in found.goals:
        assert np.abs(solutions - q).max(axis=1).min() < 1e-3
    # Stretched along x at first: both are equally bent, and the one that turns the shoulder less is nearer.
    np.testing.assert_allclose(found.goals[0], solutions[0], rtol=0, atol=1e-3)


@settings(max_examples=15)
@given(st.data(), st.integers(0, 2**32))
def test_free_space_gives_the_straight_quintic(data: st.DataObject, seed: int) -> None:
    robot = data.draw(strategies.robots(max_joints=4))
    start, goal = data.draw(strategies.configurations(robot, (2,)))
    found = plan(Problem(robot, Scene([]), start=start, goal=goal), rng=seed)
    assert_proven(found)
    assert found.trajectory is not None
    assert found.trajectory.motion == Motion([start, goal])
    assert [entry.restart for entry in found.history] == [-1]


def test_a_goal_that_is_the_start_is_a_plan_of_no_duration() -> None:
    found = plan(turn(goal=(0.0, 0.0)), SMALL, rng=0)
    assert_proven(found)
    assert found.fitness == {"length": 0.0, "duration": 0.0}


def turntable() -> Any:
    """A joint that turns without end, and an arm of 1 m on it."""
    joint = urdf_text.joint("wheel", "link_0", "link_1", kind="continuous")
    robot = urdf_text.loaded(urdf_text.chain(joint))
    capsule = LinkCapsule(name="link_1", joint=0, a=np.zeros(3), b=np.array([1.0, 0, 0]), radius=0.05)
    return replace(robot, capsules=(capsule,))


def test_a_joint_without_limits_turns_as_far_as_it_is_told() -> None:
    robot = turntable()
    for start, goal in ((-3.0, 3.0), (100.0, -20.0)):
        assert_proven(plan(Problem(robot, Scene([]), start=[start], goal=[goal]), SMALL, rng=0))


def slide() -> Any:
    """A slide along x and an arm of 0.5 m across it."""
    limit = 'lower="-2" upper="2" velocity="1"'
    text = urdf_text.chain(
        urdf_text.joint("slide", "link_0", "link_1", kind="prismatic", limit=limit),
        urdf_text.joint("swing", "link_1", "link_2", kind="continuous"),
    )
    robot = urdf_text.loaded(text)
    capsule = LinkCapsule(name="link_2", joint=1, a=np.zeros(3), b=np.array([0.5, 0, 0]), radius=0.02)
    return replace(robot, capsules=(capsule,))


def test_a_slide_is_planned_with_like_any_joint() -> None:
    robot = slide()
    problem = Problem(robot, Scene([]), start=[-1.5, 0.0], goal=[1.5, 0.0])
    assert_proven(plan(problem, SMALL, rng=0))
    # A ball on the way of the arm's tip, not of the slide.
    middle = forward_kinematics(robot, [0.0, 0.0])[:3, 3]
    arm = np.array(forward_kinematics(robot, [0.0, 0.0])[:3, 0])
    blocked = replace(problem, scene=Scene([Sphere(middle + 0.4 * arm, 0.05)]))
    found = plan(blocked, PlannerSettings(restarts=6), rng=0)
    assert found.status in STATUSES
    if found.found:
        assert_proven(found)


# ---- where there is no plan ------------------------------------------------------------------------------------------

REFUSED: dict[str, Any] = {
    "plan: start in collision": lambda: plan(turn(scene=[Sphere((1.5, 0.2, 0), 0.2)]), rng=0),
    "plan: goal in collision": lambda: plan(turn(scene=[Sphere((0.2, 1.5, 0), 0.2)]), rng=0),
    "plan: start touches": lambda: plan(turn(scene=[Sphere((1.5, 0.25, 0), 0.2)]), rng=0),
    "plan: position out of reach": lambda: plan(turn(goal=PositionGoal((1.5, 1.5, 0.0))), rng=0),
    "plan: position out of the slide's reach": lambda: plan(
        Problem(slide(), Scene([]), start=[0, 0], goal=PositionGoal((9.0, 0.0, 0.0))), rng=0
    ),
    "plan: no problem": lambda: plan(PAPER),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_problem_that_cannot_be_solved_is_refused(case: str) -> None:
    assert_refused("plan", case, ProblemError, REFUSED[case])


def enclosed(radius: float) -> Problem:
    """A goal position inside a ball."""
    return turn(scene=[Sphere((0.0, 1.5, 0.0), radius)], goal=PositionGoal((0.0, 1.5, 0.0)))


def walled() -> Problem:
    """Two balls that close the plane, so that a stretched arm on one side never gets to the other."""
    robot = planar(lower=(-1.7, -0.1), upper=(1.7, 0.1))
    return turn(robot=robot, scene=[Sphere((1.2, 0.0, 0.0), 0.4)], start=(-1.5, 0.0), goal=(1.5, 0.0))


def test_a_goal_inside_an_obstacle_is_not_reached_and_says_so() -> None:
    found = plan(enclosed(0.3), SMALL, rng=0)
    assert (found.status, found.trajectory, found.certificate) == ("goal_not_reached", None, None)
    assert found.goals.shape == (0, 2)
    assert found.fitness == {}
    assert found.message == (
        "no collision-free configuration that reaches the goal was found; "
        "allow more goal_candidates, a larger tolerance or a smaller margin"
    )


def test_a_wall_leaves_the_best_motion_and_says_what_it_hits() -> None:
    found = plan(walled(), SMALL, rng=0)
    assert (found.status, found.found) == ("not_found", False)
    assert found.certificate is not None
    assert found.trajectory is not None
    assert found.certificate.status == "fails"
    assert found.message.startswith("no collision-free motion was found; the best one: link '")
    assert "penetrate by" in found.message
    assert found.message.endswith("; allow more restarts or interior_points")
    assert not any(entry.proven for entry in found.history)
    assert_same_plan(found, plan(walled(), SMALL, rng=0))


@pytest.mark.parametrize("gap", [1e-12, 1e-9, 1e-6])
def test_an_end_that_touches_ends_soon(gap: float) -> None:
    ball = Sphere((0.25 + gap, 1.5, 0), 0.2)
    found = plan(turn(scene=[ball]), SMALL, rng=0)
    assert found.status in ("found", "not_found")
    assert found.certificate is not None
    assert found.certificate.evaluations < 5000
    if found.found:
        assert_proven(found)


def test_no_search_begins_after_the_time_budget() -> None:
    """So what has a budget of next to nothing tries one search and no more, where the wall would take them all."""
    hurried = plan(walled(), replace(SMALL, restarts=1000, time_budget=1e-6), rng=0)
    assert hurried.status == "not_found"
    assert {entry.restart for entry in hurried.history} <= {-1, 0}
    enough = plan(turn(), replace(SMALL, time_budget=1e-6), rng=0)
    assert enough.status in STATUSES


def test_progress_names_the_stages() -> None:
    said: list[str] = []
    found = plan(PAPER.problem, SMALL, rng=0, progress=said.append)
    assert said[0] == "goal configurations"
    assert said[1:] == [f"motions to goal {i + 1} of {len(found.goals)}" for i in range(len(found.goals))]


# ---- settings --------------------------------------------------------------------------------------------------------

SETTINGS: dict[str, Any] = {
    "plan: settings of a swarm": lambda: plan(turn(), PAPER.settings.swarm),  # type: ignore[arg-type]
    "plan: settings as a dictionary": lambda: plan(turn(), {"restarts": 3}),  # type: ignore[arg-type]
    "plan: rng text": lambda: plan(turn(), rng="0"),  # type: ignore[arg-type]
    "planner setting mistyped": lambda: PlannerSettings(restart=3),  # type: ignore[call-arg]
    "planner settings by position": lambda: PlannerSettings(3),  # type: ignore[call-arg]
    "interior_points zero": lambda: PlannerSettings(interior_points=0),
    "interior_points too many": lambda: PlannerSettings(interior_points=21),
    "samples too few": lambda: PlannerSettings(samples=3),
    "particles zero": lambda: PlannerSettings(particles=0),
    "restarts half": lambda: PlannerSettings(restarts=0.5),  # type: ignore[arg-type]
    "margin negative": lambda: PlannerSettings(margin=-0.01),
    "goal_candidates zero": lambda: PlannerSettings(goal_candidates=0),
    "time_budget zero": lambda: PlannerSettings(time_budget=0.0),
    "threads zero": lambda: PlannerSettings(threads=0),
}


@pytest.mark.parametrize("case", SETTINGS)
def test_settings_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("plan", case, SettingsError, SETTINGS[case])


@pytest.mark.parametrize("interior", [1, 5, 20])
def test_any_number_of_interior_points_plans(interior: int) -> None:
    found = plan(turn(), replace(SMALL, interior_points=interior), rng=0)
    assert found.status in STATUSES
    if found.found:
        assert_proven(found)


# ---- clearance -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,)])
def test_clearance_keeps_the_batchs_shape(shape: tuple[int, ...]) -> None:
    problem = turn(scene=[BALL, Sphere((0, 0, 3), 0.1), Sphere((0, 0, -3), 0.1)])
    q = np.zeros((*shape, 2))
    assert clearances(problem, q).shape == (*shape, 2, 3)
    least = clearance(problem, q)
    assert np.shape(least) == shape
    # The stretched arm along x, and the ball's centre beside its middle.
    np.testing.assert_allclose(least, 1.2 - 0.3 - 0.05, rtol=0, atol=1e-12)


def test_without_obstacles_or_links_the_clearance_is_infinite() -> None:
    assert clearance(turn(scene=[]), [0.0, 0.0]) == np.inf
    bare = turn(robot=planar(capsules=()))
    np.testing.assert_array_equal(clearance(bare, np.zeros((3, 2))), [np.inf] * 3)
    assert clearances(bare, [0.0, 0.0]).shape == (0, 1)


def test_clearance_refuses_what_is_no_configuration() -> None:
    for q in ([0.0], [0.0, np.nan], "home", 3.0):
        with pytest.raises(RobotError):
            clearance(turn(), q)  # type: ignore[arg-type]


def test_a_plan_survives_pickle() -> None:
    found = plan(turn(), SMALL, rng=0)
    assert_same_plan(pickle.loads(pickle.dumps(found)), found)


def test_one_error_class_catches_every_refusal() -> None:
    for call in (*REFUSED.values(), *SETTINGS.values()):
        with pytest.raises(SpacearmError):
            call()
