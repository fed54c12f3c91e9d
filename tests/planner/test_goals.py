"""Goal configurations: each reaches the goal, is free and within the limits; and a sentence where there is none."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spacearm.core.rotations import rotation_vectors
from spacearm.geometry import Box, Cylinder, HalfSpace, Scene, Sphere, pose
from spacearm.planner import ConfigurationGoal, PlannerSettings, PositionGoal, Problem
from spacearm.planner.inverse_kinematics import Reach, find_goal_configurations, goal_errors, polished
from spacearm.robot import Robot, forward_kinematics, load_robot
from support import drawn_shapes, strategies, urdf_text
from support.dense_samples import arms, planar
from support.goal_checks import ROUNDING, assert_sound, goal_at, missed
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames as pinocchio_frames

ARM = load_robot("zhang2022")
FEW = PlannerSettings(goal_candidates=4)
CLUTTER = (
    Sphere((0.5, 0.5, 0.0), 0.15),
    Box((0.3, 0.2, 0.4), pose((0.2, -0.6, 0.3), (1.0, 0.3, 0.0, 0.2)), name="box"),
    Cylinder(0.1, 0.5, (0.0, 0.4, 0.8)),
    HalfSpace((0, 0, 1), (0, 0, -1.2), name="floor"),
)


def reachable(seed: int, kind: str, *, scene: Any = CLUTTER, robot: Robot = ARM) -> Problem:
    """A goal that a drawn configuration reaches, free of collision as the start is."""
    generator = np.random.default_rng(seed)
    while True:
        start, q = generator.uniform(robot.lower, robot.upper, (2, robot.dof))
        if least_distances(robot, Scene(scene), pinocchio_frames(robot, np.array([start, q]))).min() > 0.02:
            return Problem(robot, Scene(scene), start=start, goal=goal_at(forward_kinematics(robot, q), kind))


# ---- what is found ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["position", "pose", "free axis"])
def test_goals_that_can_be_reached_are_and_soundly(kind: str) -> None:
    """20 goals of each kind; a search that misses a tenth of them would be let through once in eight runs."""
    several = 0
    for seed in range(20):
        problem = reachable(seed, kind)
        found = find_goal_configurations(problem, FEW, seed)
        assert_sound(problem, found)
        assert len(found.q) >= 1
        assert found.searches + 1 >= found.reached > found.in_collision
        several += len(found.q) > 1
    assert several >= 15  # a redundant arm has more than one way


def test_a_seed_gives_the_same_bits_on_any_number_of_threads() -> None:
    for kind in ("position", "pose"):
        problem = reachable(3, kind)
        one = find_goal_configurations(problem, FEW, 7)
        two = find_goal_configurations(problem, replace(FEW, threads=2), 7)
        other = find_goal_configurations(problem, FEW, 8)
        np.testing.assert_array_equal(one.q, two.q)
        np.testing.assert_array_equal(one.clearance, two.clearance)
        assert (one.searches, one.reached) == (two.searches, two.reached)
        assert one.q.shape != other.q.shape or not np.array_equal(one.q, other.q)


@given(st.integers(0, 1000))
@settings(max_examples=8)
def test_a_planar_arm_reaches_a_point_in_its_two_ways_exactly(seed: int) -> None:
    """Two links of 1 m and a point at distance r: cos(elbow) = (r^2 - 2) / 2."""
    generator = np.random.default_rng(seed)
    r, bearing = generator.uniform(0.5, 1.8), generator.uniform(-1.2, 1.2)
    point = np.array([r * math.cos(bearing), r * math.sin(bearing), 0.0])
    problem = Problem(planar(), Scene([]), start=(0.1, 0.0), goal=PositionGoal(point))
    found = find_goal_configurations(problem, FEW, seed)
    elbow = math.acos((r**2 - 2) / 2)
    ways = np.array([[bearing - elbow / 2, elbow], [bearing + elbow / 2, -elbow]])
    order = np.argsort(np.linalg.norm(ways - problem.start, axis=1))
    np.testing.assert_allclose(found.q, ways[order], rtol=0, atol=1e-8)


def test_the_start_is_taken_where_it_is_at_the_goal_already() -> None:
    problem = reachable(0, "position")
    T = forward_kinematics(ARM, problem.start)
    T[0, 3] += 9e-4
    for kind in ("position", "pose", "free axis"):
        at_goal = replace(problem, goal=goal_at(T, kind))
        np.testing.assert_array_equal(find_goal_configurations(at_goal, FEW, 0).q[0], problem.start)


def test_a_wide_tolerance_is_made_use_of() -> None:
    """A ball about the goal keeps the arm 0.1 m away from it, and the tolerance lets it."""
    T = forward_kinematics(ARM, np.full(7, 0.4))
    ball = Sphere(T[:3, 3], 0.1)
    start = np.clip(np.full(7, -0.5), ARM.lower, ARM.upper)
    for kind, options in (
        ("position", {"tolerance": 0.2}),
        ("pose", {"position_tolerance": 0.2, "orientation_tolerance": 1.0}),
        ("free axis", {"position_tolerance": 0.2, "orientation_tolerance": 1.0}),
    ):
        problem = Problem(ARM, [ball], start=start, goal=goal_at(T, kind, **options))
        found = find_goal_configurations(problem, FEW, 0)
        assert_sound(problem, found)
        assert len(found.q)
        narrow = replace(problem, goal=goal_at(T, kind))
        assert not len(find_goal_configurations(narrow, FEW, 0).q)


def test_joints_that_turn_without_end_end_within_half_a_turn_of_the_start() -> None:
    text = urdf_text.chain(
        urdf_text.joint("one", "link_0", "link_1", kind="continuous"),
        urdf_text.joint("two", "link_1", "link_2", kind="continuous", xyz="1 0 0"),
        urdf_text.joint("three", "link_2", "link_3", kind="continuous", xyz="1 0 0"),
        urdf_text.joint("end", "link_3", "link_4", kind="fixed", xyz="0.5 0 0"),
    )
    robot = urdf_text.loaded(text, tip="link_4")
    for turns in (0.0, 100.0):
        start = np.array([0.3, 0.2, -0.4]) + turns
        problem = Problem(robot, [], start=start, goal=PositionGoal((1.0, 1.2, 0.0)))  # type: ignore[arg-type]
        found = find_goal_configurations(problem, FEW, 0)
        assert_sound(problem, found)
        assert len(found.q)
        assert (np.abs(found.q - start) <= math.pi + ROUNDING).all()


@settings(max_examples=12)
@given(st.data(), st.sampled_from(["position", "pose", "free axis"]))
def test_whatever_is_found_for_drawn_robots_is_sound(data: st.DataObject, kind: str) -> None:
    robot = data.draw(arms())
    assume(robot.frame(robot.tip).joint >= 0)
    start, q = data.draw(strategies.configurations(robot, (2,)))
    links = sorted({capsule.name for capsule in robot.capsules})
    pairs = [(a, b) for i, a in enumerate(links) for b in links[i + 1 :]]
    robot = replace(robot, self_pairs=tuple(data.draw(st.lists(st.sampled_from(pairs), max_size=2))) if pairs else ())
    scene = Scene(data.draw(st.lists(drawn_shapes.obstacles(), max_size=3)))
    problem = Problem(robot, scene, start=start, goal=goal_at(forward_kinematics(robot, q), kind))
    found = find_goal_configurations(problem, PlannerSettings(goal_candidates=1), 0)
    assert_sound(problem, found)


# ---- goals in joint space --------------------------------------------------------------------------------------------


def turn(goal: Any, *scene: Sphere, robot: Robot | None = None, start: Any = (-1.0, 0.0)) -> Problem:
    """The planar arm, stretched at first."""
    return Problem(robot or planar(), Scene(scene), start=start, goal=goal)


def test_a_free_configuration_is_taken_as_it_is() -> None:
    for tolerance in (0.0, 0.3):
        problem = turn(ConfigurationGoal((1.0, 0.5), tolerance=tolerance), Sphere((2, -1, 0), 0.1))
        found = find_goal_configurations(problem, FEW, 0)
        np.testing.assert_array_equal(found.q, [[1.0, 0.5]])
        assert (found.searches, found.reached, found.in_collision) == (0, 1, 0)
        assert_sound(problem, found)


def test_of_several_configurations_the_free_ones_are_taken_nearest_first() -> None:
    rows = [(2.0, 0.0), (0.0, 0.0), (0.5, 0.0), (-0.9, 0.2)]
    problem = turn(rows, Sphere((1.5, 0, 0), 0.1))
    found = find_goal_configurations(problem, FEW, 0)
    np.testing.assert_array_equal(found.q, [rows[3], rows[2], rows[0]])
    assert (found.reached, found.in_collision) == (4, 1)
    assert_sound(problem, found)


def test_beside_a_configuration_in_collision_the_nearest_free_one_within_its_tolerance_is_taken() -> None:
    """The stretched arm at 0, and a ball that it clears from asin((0.1 + 0.05) / 1.5) rad on."""
    ball = Sphere((1.5, 0.0, 0.0), 0.1)
    least = math.asin(0.15 / 1.5)
    for tolerance in (0.2, (0.2, 0.0), (0.15, 0.01)):
        problem = turn(ConfigurationGoal((0.0, 0.0), tolerance=tolerance), ball)
        found = find_goal_configurations(replace(problem, clearance=0.0), FEW, 0)
        assert_sound(problem, found)
        assert len(found.q) == 1
        assert (np.abs(found.q[0]) <= np.broadcast_to(tolerance, 2) + ROUNDING).all()
        if tolerance == (0.2, 0.0):
            assert least < abs(found.q[0, 0]) < least + 0.005
    for tolerance in (0.0, (0.9 * least, 0.0), (0.0, 0.05)):
        problem = turn(ConfigurationGoal((0.0, 0.0), tolerance=tolerance), ball)
        found = find_goal_configurations(problem, FEW, 0)
        assert not len(found.q)
        np.testing.assert_array_equal(found.closest, [0.0, 0.0])
        assert found.in_collision == found.reached > 0


# ---- the way onto the goal -------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(st.data(), st.sampled_from(["position", "pose", "free axis"]))
def test_errors_are_pinocchios_and_polishing_never_makes_them_worse(data: st.DataObject, kind: str) -> None:
    robot = data.draw(arms())
    T = data.draw(strategies.transforms())
    reach = Reach(robot=robot, goal=goal_at(T, kind))
    q = data.draw(strategies.configurations(robot, (3,)))
    distance, angle = goal_errors(reach, q)
    for row, d, a in zip(q, distance, angle, strict=True):
        np.testing.assert_allclose((d, a), missed(robot, reach.goal, row), rtol=0, atol=1e-7)
    better = polished(reach, q, robot.lower, robot.upper)
    assert ((better >= robot.lower) & (better <= robot.upper)).all()
    new_distance, new_angle = goal_errors(reach, better)
    before = np.hypot(distance, 0.4 * np.sin(angle / 2))  # angles by their chord
    after = np.hypot(new_distance, 0.4 * np.sin(new_angle / 2))
    assert (after <= before + 1e-12).all()


@pytest.mark.parametrize("kind", ["position", "pose", "free axis"])
def test_polishing_from_nearby_gets_there_to_the_last_digit(kind: str) -> None:
    generator = np.random.default_rng(0)
    q = generator.uniform(0.9 * ARM.lower, 0.9 * ARM.upper, (200, 7))
    near = np.clip(q + generator.uniform(-0.1, 0.1, q.shape), ARM.lower, ARM.upper)
    there = 0
    for row, begin in zip(q, near, strict=True):
        reach = Reach(robot=ARM, goal=goal_at(forward_kinematics(ARM, row), kind))
        distance, angle = goal_errors(reach, polished(reach, begin[None], ARM.lower, ARM.upper, rounds=15))
        there += bool(distance[0] < 1e-9 and angle[0] < 1e-8)
    assert there >= 190  # some begin beside a singularity, or a limit in between


@given(st.lists(st.tuples(strategies.points(), strategies.ANGLES), min_size=1, max_size=5))
def test_rotation_vectors_turn_as_their_rotations_do(drawn: list[tuple[np.ndarray, float]]) -> None:
    vectors = np.array([angle * axis / max(float(np.linalg.norm(axis)), 1e-3) for axis, angle in drawn])
    R = Rotation.from_rotvec(vectors).as_matrix()
    ours = rotation_vectors(R)
    np.testing.assert_allclose(Rotation.from_rotvec(ours).as_matrix(), R, rtol=0, atol=1e-7)
    assert (np.linalg.norm(ours, axis=1) <= math.pi + 1e-12).all()


# ---- real scenes -----------------------------------------------------------------------------------------------------

MBM = os.environ.get("SPACEARM_MBM")


def moveit_scene(path: Path) -> Scene:
    """The boxes and cylinders of a MoveIt planning scene."""
    obstacles: list[Any] = []
    for thing in yaml.safe_load(path.read_text())["world"]["collision_objects"]:
        for solid, place in zip(thing["primitives"], thing["primitive_poses"], strict=True):
            x, y, z, w = place["orientation"]
            T, size = pose(place["position"], (w, x, y, z)), solid["dimensions"]
            obstacles.append(Box(size, T) if solid["type"] == "box" else Cylinder(size[1], size[0], T))
    return Scene(obstacles)


@pytest.mark.skipif(MBM is None, reason="SPACEARM_MBM does not name the MotionBenchMaker data")
@pytest.mark.parametrize("kind", ["position", "pose", "free axis"])
def test_the_hand_gets_to_where_each_familys_first_request_puts_it(kind: str) -> None:
    folder = Path(MBM or "")
    robot = load_robot(folder / "panda_spherized.urdf", srdf=folder / "panda.srdf", group="panda_arm", tip="panda_hand")
    families = sorted(path for path in folder.iterdir() if path.is_dir())
    assert len(families) == 7
    for family in families:
        request = yaml.safe_load((family / "request0001.yaml").read_text())
        state = request["start_state"]["joint_state"]
        at = dict(zip(state["name"], state["position"], strict=True))
        asked = {joint["joint_name"]: joint["position"] for joint in request["goal_constraints"][0]["joint_constraints"]}
        start, q = ([values[name] for name in robot.dof_names] for values in (at, asked))
        goal = goal_at(forward_kinematics(robot, q), kind)
        problem = Problem(robot, moveit_scene(family / "scene0001.yaml"), start=start, goal=goal)
        found = find_goal_configurations(problem, PlannerSettings(), 0)
        assert_sound(problem, found)
        assert len(found.q) >= 1
