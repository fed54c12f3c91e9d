"""Plans: proven, repeatable, straight where nothing is in the way, and a sentence where there is none."""

from __future__ import annotations

import math
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import objectives
from spacearm.core.errors import ProblemError, SettingsError
from spacearm.files import load_problem_file, plan_as_dict
from spacearm.geometry import Box, HalfSpace, Scene, Sphere, pose
from spacearm.motion import Motion
from spacearm.planner import (
    ConfigurationGoal,
    ConfigurationsGoal,
    Plan,
    PlannerSettings,
    PoseGoal,
    PositionGoal,
    Problem,
    Weights,
    plan,
)
from spacearm.planner.plan_result import STATUSES
from spacearm.proof import certify
from spacearm.robot import Frame, Joint, LinkCapsule, Robot, forward_kinematics
from spacearm.swarm import IPSO
from support import strategies, urdf_text
from support.dense_samples import planar
from support.messages import assert_refused, assert_sentence
from support.motion_searches import BUILD, crowded, needle, quintic, thin_planar
from support.oracles import coal_shapes, pinocchio_points
from support.planar_problems import CLUTTERED, walled

PAPER = load_problem_file(Path(__file__).parents[2] / "examples" / "01_first_plan.yaml")
SMALL = PlannerSettings(evaluations=800, goal_candidates=2)
BALL = Sphere((1.2, 1.2, 0.0), 0.3)


def turn(
    *, scene: Any = (BALL,), start: Any = (0.0, 0.0), goal: Any = (math.pi / 2, 0.0), robot: Any = None, **asked: Any
) -> Problem:
    """The planar arm, stretched, from x to y; a ball stands where the stretched arm would pass."""
    return Problem(robot or planar(), Scene(scene), start=start, goal=goal, **asked)


def assert_proven(found: Plan, seed: int = 0, *, instants: int = 2000) -> None:
    """A plan holds from start to goal, at instants that nobody of ours chose, by Coal and Pinocchio."""
    problem, trajectory = found.problem, found.trajectory
    robot = problem.robot
    assert (found.status, found.found, found.ends.status) == ("found", True, "free")
    assert trajectory is not None
    assert found.certificate is not None
    assert found.certificate.holds
    assert certify(problem, trajectory, jerk_limit=found.settings.jerk_limit).holds
    points = trajectory.motion.control_points
    np.testing.assert_array_equal(points[0], problem.start)
    assert any(np.array_equal(points[-1], q) for q in found.goals)
    assert ((points >= robot.lower) & (points <= robot.upper)).all()
    t = np.sort(np.random.default_rng(seed).uniform(0, 1, instants)) * trajectory.duration
    state = trajectory.sample(t)
    frames = pinocchio_points.joint_frames(robot, state.q)
    assert coal_shapes.least_distances(robot, problem.scene, frames).min() > 0
    assert (np.abs(state.dq) <= robot.velocity * (1 + 1e-9)).all()
    assert (np.abs(state.ddq) <= robot.acceleration * (1 + 1e-9)).all()
    assert found.fitness["length"] == trajectory.motion.length()
    assert found.fitness["duration"] == trajectory.duration
    fitness = [entry.fitness for entry in found.history]
    assert fitness == sorted(set(fitness), reverse=True)
    assert {entry.goal for entry in found.history} <= set(range(len(found.goals)))


def assert_same_plan(one: Plan, other: Plan) -> None:
    """Both plans are the same, bit for bit; only the clock may differ."""
    np.testing.assert_equal(plan_as_dict(one), plan_as_dict(other))


# ---- what is found ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_the_papers_problem_is_planned_and_proven(seed: int) -> None:
    found = plan(PAPER.problem, replace(PAPER.settings, evaluations=1500), rng=seed)
    assert_proven(found, seed)
    assert found.seed == seed
    goal = found.problem.goal
    assert isinstance(goal, PositionGoal)
    for q in found.goals:
        assert np.linalg.norm(forward_kinematics(found.problem.robot, q)[:3, 3] - goal.position) <= goal.tolerance
    assert set(found.timings) >= {"prepare", "goals", "search", "certify", "total"}
    parts = [seconds for part, seconds in found.timings.items() if part != "total"]
    assert min(parts) >= 0
    assert sum(parts) <= found.timings["total"] + 1e-9  # they do not overlap
    assert found.evaluations >= 1500
    assert found.proofs >= 1


HOW: dict[str, dict[str, Any]] = {
    "as a rule": {},
    "islands": {"islands": 3},
    "IPSO": {"swarm": IPSO(particles=24, iterations=40)},
    "one control point": {"interior_points": 1},
    "many control points": {"interior_points": (24, 8)},
    "duration": {"weights": Weights(length=0.0, duration=1.0)},
    "every term": {"weights": Weights(length=1, duration=1, tip=1, clearance=9, smoothness=1e-4, f1=0.01, f2=0.1, f3=0.1)},
    "jerk": {"jerk_limit": 2.0},
    "time-optimal": {"time_law": "time_optimal"},
    "time-optimal, jerk": {"time_law": "time_optimal", "jerk_limit": 2.0},
    "the first": {"stop_at_first": True},
}


@pytest.mark.parametrize("how", HOW)
def test_clutter_of_every_shape_is_planned_around_in_every_way(how: str) -> None:
    chosen = replace(SMALL, **HOW[how])
    found = plan(CLUTTERED, chosen, rng=1)
    assert_proven(found)
    np.testing.assert_array_equal(found.goals, [objectives.AROUND[1]])
    straight = math.dist(*objectives.AROUND)
    assert straight < found.fitness["length"] < 3 * straight
    assert set(found.fitness) >= {"length", "duration"}
    weighed = {name for name in found.settings.weights.__slots__ if getattr(found.settings.weights, name)}
    assert set(found.fitness) == weighed | {"length", "duration"}
    if chosen.jerk_limit is not None:
        assert found.trajectory is not None
        t = np.linspace(0, found.trajectory.duration, 4001)
        jerk = np.diff(found.trajectory.sample(t).ddq, axis=0) / np.diff(t)[:, None]
        assert np.abs(jerk).max() <= chosen.jerk_limit * (1 + 1e-6)


def test_time_optimal_is_quicker_and_a_jerk_limit_slower() -> None:
    def duration(**changes: Any) -> float:
        return plan(CLUTTERED, replace(SMALL, **changes), rng=1).fitness["duration"]

    uniform = duration()
    assert duration(time_law="time_optimal") < uniform
    assert duration(jerk_limit=0.5) > uniform
    assert duration(weights=Weights(length=0.0, duration=1.0)) < uniform


def test_what_is_content_with_the_first_motion_stops_there() -> None:
    first, best = (plan(CLUTTERED, replace(SMALL, stop_at_first=stop), rng=2) for stop in (True, False))
    assert len(first.history) == 1
    assert first.history[0].evaluations == best.history[0].evaluations
    assert first.evaluations < best.evaluations
    assert best.fitness["length"] < first.fitness["length"]


def test_what_has_converged_stops() -> None:
    found = plan(CLUTTERED, PlannerSettings(evaluations=None, convergence=300), rng=2)
    assert_proven(found)
    assert found.evaluations - found.history[-1].evaluations <= 300 + 16


def test_a_longer_search_is_no_worse() -> None:
    lengths = [plan(CLUTTERED, replace(SMALL, evaluations=n), rng=3).history[-1].fitness for n in (100, 1000, 5000)]
    assert lengths == sorted(lengths, reverse=True)


@pytest.mark.parametrize("seed", range(3))
def test_a_configuration_goal_is_reached_exactly_around_the_ball(seed: int) -> None:
    found = plan(turn(), SMALL, rng=seed)
    assert_proven(found, seed)
    np.testing.assert_array_equal(found.goals, [[math.pi / 2, 0.0]])
    assert math.pi / 2 < found.fitness["length"] < 2 * math.pi


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


def test_of_several_goals_the_nearest_free_one_is_taken() -> None:
    goals = [[math.pi / 2, 0.0], [-0.5, 0.0], [-1.0, 1.0], [0.7, 0.0]]
    blocked = Sphere((1.9 * math.cos(0.7), 1.9 * math.sin(0.7), 0.0), 0.1)  # the fourth
    found = plan(turn(scene=[BALL, blocked], goal=ConfigurationsGoal(goals)), SMALL, rng=0)
    assert_proven(found)
    assert found.trajectory is not None
    assert found.trajectory.motion == Motion([[0.0, 0.0], [-0.5, 0.0]])
    assert len(found.goals) == 3
    assert found.evaluations == 3  # straight to each


def test_a_pose_goal_is_reached_in_its_orientation() -> None:
    q = np.array([0.9, -0.7])
    target = forward_kinematics(planar(), q)
    found = plan(turn(goal=PoseGoal(target), scene=[]), SMALL, rng=0)
    assert_proven(found)
    np.testing.assert_allclose(found.goals, [q], rtol=0, atol=0.02)


@settings(max_examples=10)
@given(st.data(), st.integers(0, 2**32))
def test_free_space_gives_the_straight_quintic(data: st.DataObject, seed: int) -> None:
    robot = data.draw(strategies.robots(max_joints=4))
    start, goal = data.draw(strategies.configurations(robot, (2,)))
    found = plan(Problem(robot, Scene([]), start=start, goal=goal), rng=seed)
    assert_proven(found, instants=200)
    assert found.trajectory is not None
    assert found.trajectory.motion == Motion([start, goal])
    assert [(entry.by, entry.interior_points) for entry in found.history] == [("straight", 0)]
    assert (found.evaluations, found.proofs) == (1, 1)


@settings(max_examples=12)
@given(st.data(), st.integers(0, 2**32))
def test_whatever_is_planned_among_drawn_obstacles_is_found_or_said_not_to_be(data: st.DataObject, seed: int) -> None:
    robot, obstacles, start, goals = data.draw(crowded(BUILD))
    found = plan(Problem(robot, Scene(obstacles), start=start, goal=goals), replace(SMALL, evaluations=300, proofs=3), rng=seed)
    assert found.status in ("found", "not_found", "not_proven")
    if found.found:
        assert_proven(found, seed, instants=200)
    else:
        assert found.message
        assert found.trajectory is not None
        certificate = certify(found.problem, found.trajectory)
        if certificate.holds:  # but it is nearer than what was asked for
            assert certificate.closest is not None
            assert certificate.closest.clearance < found.problem.clearance + 0.002


def test_a_goal_that_is_the_start_is_a_plan_of_no_duration() -> None:
    found = plan(turn(goal=(0.0, 0.0)), SMALL, rng=0)
    assert_proven(found, instants=5)
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
        found = plan(Problem(robot, Scene([]), start=[start], goal=[goal]), SMALL, rng=0)
        assert_proven(found, instants=100)
        assert found.fitness["length"] == pytest.approx(abs(start - goal))


def test_a_slide_is_planned_with_like_any_joint() -> None:
    """A slide along x and an arm of 0.5 m across it, whose tip has to get around a ball."""
    limit = 'lower="-2" upper="2" velocity="1"'
    text = urdf_text.chain(
        urdf_text.joint("slide", "link_0", "link_1", kind="prismatic", limit=limit),
        urdf_text.joint("swing", "link_1", "link_2", kind="continuous"),
    )
    capsule = LinkCapsule(name="link_2", joint=1, a=np.zeros(3), b=np.array([0.5, 0, 0]), radius=0.02)
    robot = replace(urdf_text.loaded(text), capsules=(capsule,))
    problem = Problem(robot, Scene([]), start=[-1.5, 0.0], goal=[1.5, 0.0])
    free = plan(problem, SMALL, rng=0)
    assert_proven(free)
    at = forward_kinematics(robot, [0.0, 0.0])
    blocked = replace(problem, scene=Scene([Sphere(at[:3, 3] + 0.4 * at[:3, 0], 0.05)]))
    around = plan(blocked, SMALL, rng=0)
    assert_proven(around)
    assert around.fitness["length"] > free.fitness["length"]


# ---- the robot in its own way ----------------------------------------------------------------------------------------


def folding(*, lifts: bool) -> Robot:
    """Two links of 1 m, an elbow that turns without end, the fore one beside the upper one; at times on a lift."""
    shift = np.eye(4)
    shift[0, 3] = 1.0
    joints = [Joint(name="shoulder", kind="revolute", parent=-1, T_parent_joint=np.eye(4))]
    if lifts:
        joints.append(Joint(name="lift", kind="prismatic", parent=0, T_parent_joint=np.eye(4)))
    joints.append(Joint(name="elbow", kind="revolute", parent=len(joints) - 1, T_parent_joint=shift))
    n = len(joints)
    ends = np.array([[0.0, 0, 0], [0.8, 0, 0], [0.2, 0, 0], [0.9, 0, 0]])
    most = [math.pi, *[0.3] * lifts, np.inf]
    return Robot(
        name="folding",
        joints=tuple(joints),
        capsules=(
            LinkCapsule(name="upper", joint=0, a=ends[0], b=ends[1], radius=0.05),
            LinkCapsule(name="fore", joint=n - 1, a=ends[2], b=ends[3], radius=0.05),
        ),
        frames=(Frame(name="hand", joint=n - 1, T_joint_frame=shift),),
        tip="hand",
        lower=-np.array(most),
        upper=np.array(most),
        velocity=np.ones(n),
        acceleration=np.ones(n),
        self_pairs=(("upper", "fore"),),
    )


def folded(*, lifts: bool, goal: float) -> Problem:
    middle = [0.0] * lifts
    return Problem(folding(lifts=lifts), Scene([]), start=[0.0, *middle, 2.5], goal=[0.0, *middle, goal])


def test_an_arm_does_not_fold_through_itself() -> None:
    """From one side of the upper link to the other there is the way through it, and the way around."""
    around = plan(folded(lifts=False, goal=-2.5), SMALL, rng=0)
    assert_proven(around)
    assert around.fitness["length"] == pytest.approx(5.0)
    through = plan(folded(lifts=False, goal=2 * math.pi - 2.5), SMALL, rng=0)
    assert through.status == "not_found"
    assert_sentence("plan", "not found: the robot itself", through.message)
    over = plan(folded(lifts=True, goal=2 * math.pi - 2.5), SMALL, rng=0)
    assert_proven(over)
    assert over.trajectory is not None
    assert np.abs(over.trajectory.motion.sample(np.linspace(0, 1, 50))[:, 1]).max() > 0.1


def test_links_that_may_touch_do_not_count() -> None:
    through = replace(folded(lifts=False, goal=2 * math.pi - 2.5), robot=replace(folding(lifts=False), self_pairs=()))
    found = plan(through, SMALL, rng=0)
    assert_proven(found)
    assert found.fitness["length"] == pytest.approx(2 * math.pi - 5.0)


# ---- again and again -------------------------------------------------------------------------------------------------


def test_one_seed_gives_one_plan_on_any_number_of_threads() -> None:
    chosen = replace(SMALL, islands=3)
    for problem in (PAPER.problem, CLUTTERED):
        one, *others = (plan(problem, replace(chosen, threads=threads), rng=5) for threads in (1, 2, 5))
        for other in others:
            assert_same_plan(replace(one, settings=other.settings), other)
        assert_same_plan(one, plan(problem, replace(chosen, threads=1), rng=5))
        again = plan(problem, replace(chosen, threads=1), rng=6)
        assert again.trajectory != one.trajectory


def test_a_generator_or_nothing_as_rng_is_recorded() -> None:
    from_generator = plan(turn(), SMALL, rng=np.random.default_rng(1))
    assert_same_plan(from_generator, plan(turn(), SMALL, rng=np.random.default_rng(1)))
    fresh = plan(turn(), SMALL)
    assert_same_plan(fresh, plan(turn(), SMALL, rng=fresh.seed))


def test_islands_are_searches_of_their_own() -> None:
    found = plan(CLUTTERED, replace(SMALL, islands=4), rng=0)
    assert_proven(found)
    assert found.evaluations >= 4 * 800
    assert {entry.island for entry in found.history} <= set(range(4))
    alone = plan(CLUTTERED, SMALL, rng=0)
    assert found.history[-1].fitness <= alone.history[-1].fitness


def test_a_plan_survives_pickle() -> None:
    found = plan(turn(), SMALL, rng=0)
    assert_same_plan(pickle.loads(pickle.dumps(found)), found)


# ---- where there is no plan ------------------------------------------------------------------------------------------


NAMED = Sphere((1.5, 0.2, 0), 0.2, name="boulder")
WITHOUT: dict[str, tuple[str, Problem]] = {
    "start in collision": ("start_in_collision", turn(scene=[NAMED])),
    "start in collision, nameless": ("start_in_collision", turn(scene=[Sphere((1.5, 0.2, 0), 0.2)])),
    "start touches": ("start_in_collision", turn(scene=[Sphere((1.5, 0.25, 0), 0.2)])),
    "start below the floor": ("start_in_collision", turn(scene=[HalfSpace((0, 0, 1), (0, 0, 0.01), name="floor")])),
    "start and goal in collision": (
        "start_in_collision",
        turn(scene=[NAMED, Box((0.2, 0.2, 0.2), pose((0, 1.5, 0)))]),
    ),
    "start folded": ("start_in_collision", replace(folded(lifts=False, goal=0.0), start=[0.0, math.pi])),
    "goal in collision": ("goal_in_collision", turn(scene=[Sphere((0.2, 1.5, 0), 0.2)])),
    "goal folded": ("goal_in_collision", folded(lifts=False, goal=math.pi)),
    "all goals in collision": (
        "goal_in_collision",
        turn(scene=[Sphere((0.2, 1.5, 0), 0.2)], goal=ConfigurationsGoal([[1.55, 0.0], [1.5, 0.1]])),
    ),
    "goal with a tolerance in collision": (
        "goal_in_collision",
        turn(scene=[Sphere((0.0, 1.5, 0), 0.2)], goal=ConfigurationGoal((math.pi / 2, 0.0), tolerance=0.01)),
    ),
    "position inside an obstacle": (
        "goal_in_collision",
        turn(scene=[Sphere((0.0, 1.5, 0.0), 0.3)], goal=PositionGoal((0.0, 1.5, 0.0))),
    ),
    "position out of reach": ("goal_unreachable", turn(goal=PositionGoal((1.5, 1.5, 0.0)))),
    "position off the plane": ("goal_unreachable", turn(goal=PositionGoal((1.0, 0.5, 0.2)))),
    "position beyond a limit": (
        "goal_unreachable",
        turn(robot=planar(lower=(-0.1, -0.1), upper=(0.1, 0.1)), goal=PositionGoal((0.0, 1.9, 0.0)), scene=[]),
    ),
    "a wall in between": ("not_found", walled()),
}


@pytest.mark.parametrize("case", WITHOUT)
def test_what_cannot_be_planned_has_a_status_and_a_sentence(case: str) -> None:
    status, problem = WITHOUT[case]
    found = plan(problem, SMALL, rng=0)
    assert (found.status, found.found, found.interrupted) == (status, False, False)
    assert_sentence("plan", case, found.message)
    assert found.message == plan(problem, replace(SMALL, threads=2), rng=0).message
    if status == "not_found":
        assert found.trajectory is not None
        assert found.certificate is not None
        assert found.certificate.status == "fails"
        assert found.history == ()
        assert found.fitness["length"] == found.trajectory.motion.length()
    else:
        assert (found.trajectory, found.certificate, found.history, found.fitness) == (None, None, (), {})
        assert found.ends.status == status
        assert found.goals.shape == (0, 2)
    if status.endswith("collision"):
        assert found.ends.contacts
    pickle.loads(pickle.dumps(found))


def test_the_depth_in_the_sentence_is_coals() -> None:
    found = plan(turn(scene=[NAMED]), SMALL, rng=0)
    frames = pinocchio_points.joint_frames(planar(), np.zeros((1, 2)))
    depth = -coal_shapes.least_distances(planar(), found.problem.scene, frames)[0]
    assert f"{depth * 1e3:.4g} mm" in found.message
    assert "'fore'" in found.message
    assert "boulder" in found.message


@pytest.mark.parametrize(("gap", "status"), [(1e-12, "not_proven"), (1e-9, "not_proven"), (1e-6, "found")])
def test_an_end_that_all_but_touches_is_proven_down_to_a_micrometre(gap: float, status: str) -> None:
    found = plan(turn(scene=[Sphere((0.25 + gap, 1.5, 0), 0.2)]), SMALL, rng=0)
    assert found.status == status
    assert found.proofs <= SMALL.proofs
    if status == "found":
        assert_proven(found)
    else:
        assert "too close to be told" in found.message


def test_a_proof_that_fails_is_learned_from() -> None:
    """A needle between two of the instants that are looked at: the straight motion is taken for free, and then is not."""
    s = 0.5 + 0.5 / 128
    thorn = needle(quintic(s) * math.pi / 2, 1.9)
    problem = turn(robot=thin_planar(), scene=[thorn], clearance=0.0)
    hasty = plan(problem, replace(SMALL, proofs=1), rng=0)
    assert (hasty.status, hasty.proofs, hasty.interrupted) == ("not_proven", 1, False)
    assert hasty.trajectory is not None
    assert hasty.trajectory.motion.interior == 0
    assert hasty.certificate is not None
    assert not hasty.certificate.holds
    assert hasty.message.startswith("a motion was found, but its proof does not hold; the last one: link 'fore'")
    assert hasty.message.endswith("; allow more proofs")
    forewarned = plan(problem, replace(SMALL, proofs=2), rng=0)
    assert forewarned.proofs == 2
    assert forewarned.trajectory != hasty.trajectory
    assert all(entry.by != "straight" for entry in forewarned.history)


@pytest.mark.parametrize("radius", [0.001, 0.01, 0.02])
def test_a_thin_arm_is_planned_around_a_thin_obstacle(radius: float) -> None:
    """Between two instants the tip goes some 5 cm, and the needle is 2 mm thick; a bent elbow passes it easily."""
    robot = replace(planar(), capsules=tuple(replace(link, radius=radius) for link in planar().capsules))
    for k in range(3):
        thorn = needle(quintic(0.5 + (0.5 + k) / 128) * math.pi / 2, 1.9)
        found = plan(turn(robot=robot, scene=[thorn]), SMALL, rng=k)
        assert_proven(found, k)
        assert found.proofs <= 15


# ---- time and interruption -------------------------------------------------------------------------------------------


def test_a_time_budget_ends_the_search() -> None:
    hurried = plan(CLUTTERED, PlannerSettings(evaluations=None, time_budget=0.1), rng=0)
    assert_proven(hurried)
    assert hurried.timings["search"] < 0.1 + 0.3
    for islands in (2, 5):
        several = plan(CLUTTERED, PlannerSettings(evaluations=None, time_budget=0.1, islands=islands), rng=0)
        assert several.timings["search"] < 0.1 + 0.3
    assert plan(walled(), PlannerSettings(evaluations=None, time_budget=0.05), rng=0).status == "not_found"
    least = plan(turn(), PlannerSettings(evaluations=None, time_budget=1e-9), rng=0)
    assert least.status in STATUSES
    assert least.message


def test_progress_names_the_stages() -> None:
    said: list[str] = []
    found = plan(PAPER.problem, SMALL, rng=0, progress=said.append)
    assert said[0] == "goal configurations"
    assert said[1].startswith(f"motions to {len(found.goals)} goal configuration")
    assert said[2:] == ["proof"] * found.proofs


@pytest.mark.parametrize("problem", [CLUTTERED, turn()], ids=["clutter", "ball"])
def test_an_interrupted_search_gives_the_best_motion_that_holds(problem: Problem) -> None:
    said: list[str] = []

    def interrupt(stage: str) -> None:
        said.append(stage)
        if said.count("proof") == 1 and stage == "proof":
            raise KeyboardInterrupt

    found = plan(problem, SMALL, rng=0, progress=interrupt)
    assert_proven(found)
    assert found.interrupted
    assert found.message.startswith(STATUSES["found"] + "; it was interrupted; clearance proven at least")


def test_what_is_interrupted_before_there_is_anything_is_the_callers() -> None:
    def interrupt(stage: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        plan(CLUTTERED, SMALL, rng=0, progress=interrupt)


def test_what_progress_raises_reaches_the_caller() -> None:
    def fail(stage: str) -> None:
        if stage == "proof":
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        plan(CLUTTERED, SMALL, rng=0, progress=fail)


INTERRUPTED = """
import os, signal, threading
from spacearm.planner import PlannerSettings, plan
from support.planar_problems import CLUTTERED, walled

problem, islands = {problem}, {islands}
def begun(stage):
    if stage.startswith("motions"):
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
found = plan(problem, PlannerSettings(evaluations=None, time_budget=600.0, islands=islands, threads=2), rng=0, progress=begun)
print(found.status, found.interrupted, len(found.history) > 0)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="signals are POSIX's")
@pytest.mark.parametrize(("problem", "islands"), [("CLUTTERED", 1), ("CLUTTERED", 3), ("walled()", 1)])
def test_ctrl_c_gives_the_best_so_far(problem: str, islands: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED.format(problem=problem, islands=islands)],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    status, interrupted, improved = done.stdout.split()
    assert interrupted == "True"
    expected = ("not_found", "False") if problem == "walled()" else ("found", "True")
    assert (status, improved) == expected


# ---- what is no problem ----------------------------------------------------------------------------------------------

REFUSED: dict[str, tuple[Any, Any]] = {
    "no problem": (ProblemError, lambda: plan(PAPER)),  # type: ignore[arg-type]
    "settings of a swarm": (SettingsError, lambda: plan(turn(), IPSO())),  # type: ignore[arg-type]
    "settings as a dictionary": (SettingsError, lambda: plan(turn(), {"evaluations": 3})),  # type: ignore[arg-type]
    "rng text": (SettingsError, lambda: plan(turn(), rng="0")),  # type: ignore[arg-type]
    "rng negative": (SettingsError, lambda: plan(turn(), rng=-1)),
    "rng half": (SettingsError, lambda: plan(turn(), rng=0.5)),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_planned_at_all_is_refused(case: str) -> None:
    error, call = REFUSED[case]
    assert_refused("plan", case, error, call)
