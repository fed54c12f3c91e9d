"""Something in the hand: it rides along as it is, has mass, and keeps clear of the links that can meet it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import RobotError
from spacearm.dynamics import hold
from spacearm.geometry import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    SphereSet,
    moved_shape,
    pose,
)
from spacearm.geometry.solid_moments import solid_moments
from spacearm.motion import Motion, Trajectory
from spacearm.planner import Problem, plan
from spacearm.proof import certify
from spacearm.robot import Robot, forward_kinematics, load_robot
from support import srdf_text, strategies, urdf_text
from support.forward_kinematics import frame_transform, joint_transforms
from support.messages import assert_refused
from support.oracles.coal_shapes import distance, placed_shape
from support.oracles.solids import from_segments

ROUNDING = 1e-9
ARMS = srdf_text.loaded(srdf_text.two_arms(), tip="left_tool")
ZHANG = load_robot("zhang2022")


def depths(robot: Robot, q: np.ndarray, points: np.ndarray, name: str = "held") -> np.ndarray:
    """How far points (k, 3) in the base frame are outside of what is held, by Coal [m]; negative inside."""
    placed = [np.eye(4), *joint_transforms(robot, q)]
    own = [placed_shape(moved_shape(part.shape, placed[part.joint + 1])) for part in robot.shapes if part.name == name]
    ball = coal.Sphere(0.0)
    return np.array([min(distance((ball, coal.Transform3s(np.eye(3), p)), one) for one in own) for p in points])


def ball(count: int = 40) -> np.ndarray:
    """Directions (count, 3)."""
    k = np.arange(count)
    z, turn = 1 - (2 * k + 1) / count, k * math.pi * (3 - math.sqrt(5))
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])


TETRAHEDRON = np.array([(0, 0, 0), (0.2, 0, 0), (0, 0.3, 0), (0.05, 0.05, 0.1)])
TURNED = pose((0.1, -0.2, 0.3), (0.5, 0.1, -0.7, 0.2))
SHAPES: dict[str, tuple[Any, Callable[[], np.ndarray]]] = {
    "sphere": (Sphere((0.1, 0.2, 0.3), 0.05), lambda: np.array([0.1, 0.2, 0.3]) + 0.05 * ball()),
    "capsule": (Capsule((0, 0, 0), (0, 0.3, 0), 0.02), lambda: np.vstack([0.02 * ball(), (0, 0.3, 0) + 0.02 * ball()])),
    "box": (
        Box((0.3, 0.2, 0.05), TURNED),
        lambda: np.sign(ball()) * (0.15, 0.1, 0.025) @ TURNED[:3, :3].T + TURNED[:3, 3],
    ),
    "cylinder": (
        Cylinder(0.1, 0.06, TURNED),
        lambda: (
            np.column_stack([0.1 * np.cos(np.arange(40)), 0.1 * np.sin(np.arange(40)), 0.03 * np.sign(ball()[:, 2])])
            @ TURNED[:3, :3].T
            + TURNED[:3, 3]
        ),
    ),
    "polytope": (Polytope(TETRAHEDRON), lambda: TETRAHEDRON),
    "rounded box": (
        Box((0.3, 0.2, 0.05), TURNED, rounding=0.02),
        lambda: (np.array([0.15, 0, 0.025 + 0.02]) * np.array([[1, 1, 1], [-1, 1, -1]])) @ TURNED[:3, :3].T + TURNED[:3, 3],
    ),
    "polytope set": (
        PolytopeSet((Polytope(TETRAHEDRON), Polytope(TETRAHEDRON + 0.3)), excess=0.002),
        lambda: np.vstack([TETRAHEDRON, TETRAHEDRON + 0.3]),
    ),
    "sphere set": (
        SphereSet([(0, 0, 0), (0.1, 0, 0)], [0.05, 0.02], excess=0.004),
        lambda: np.vstack([0.05 * ball(), (0.1, 0, 0) + 0.02 * ball()]),
    ),
}


@pytest.mark.parametrize("kind", SHAPES)
def test_what_is_held_rides_on_the_hand_as_it_is(kind: str) -> None:
    shape, points = SHAPES[kind]
    T_tool_x = pose((0, 0, 0.1), (0.3, 0.2, 0.9, -0.1))
    robot = hold(ARMS, shape, frame="right_tool", pose=T_tool_x)
    generator = np.random.default_rng(2)
    for q in generator.uniform(-1, 1, (5, robot.dof)):
        T = frame_transform(robot, q, "right_tool") @ T_tool_x
        there = points() @ T[:3, :3].T + T[:3, 3]
        assert abs(depths(robot, q, there).max()) <= 1e-6  # all are in it, and the farthest on its surface, as Coal sees it
        if hasattr(shape, "pose"):
            np.testing.assert_allclose(frame_transform(robot, q, "held"), T @ shape.pose, atol=ROUNDING)
    assert "mm too large" in robot.notes[-1] or "exact" in robot.notes[-1]
    assert robot.dof == ARMS.dof
    assert ARMS.frames == robot.frames[:-1]


@settings(max_examples=25)
@given(st.data())
def test_an_obstacle_of_the_scene_is_taken_up_where_it_is(data: st.DataObject) -> None:
    q = data.draw(strategies.configurations(ZHANG))
    center = data.draw(strategies.points())
    T_tip_w = np.linalg.inv(forward_kinematics(ZHANG, q))
    robot = hold(ZHANG, Sphere(center, 0.1), pose=T_tip_w)
    np.testing.assert_allclose(frame_transform(robot, q, "held")[:3, 3], center, atol=1e-12)


def test_it_keeps_clear_of_every_link_that_can_meet_it() -> None:
    robot = hold(ARMS, Sphere((0, 0, 0.1), 0.03))
    with_held = {pair[1 - pair.index("held")] for pair in robot.self_pairs if "held" in pair}
    links = {part.name for part in ARMS.shapes}
    # The fingers slide on the hand, and so can meet it; the hand itself is tied to it.
    assert with_held == links - {"left_hand"}
    assert set(ARMS.self_pairs) <= set(robot.self_pairs)
    touching = hold(ARMS, Sphere((0, 0, 0.1), 0.03), touching=["left_thumb", "left_finger", "left_tool"])
    assert {pair[1 - pair.index("held")] for pair in touching.self_pairs if "held" in pair} == with_held - {
        "left_thumb",
        "left_finger",
    }


def test_it_keeps_clear_of_the_links_even_where_these_need_not_of_each_other() -> None:
    robot = hold(ZHANG, Sphere((0, 0, 0), 0.03))
    assert robot.self_pairs == (("forearm", "held"), ("held", "upper_arm"))


def test_two_things_may_be_held_under_two_names() -> None:
    robot = hold(hold(ARMS, Sphere((0, 0, 0), 0.03), name="cup"), Sphere((0, 0, 0), 0.03), frame="right_tool", name="lid")
    assert ("cup", "lid") in robot.self_pairs
    assert robot.frame("lid").parent == "right_tool"
    on_it = hold(robot, Sphere((0, 0, 0.05), 0.01), frame="cup", name="lump")
    assert ("cup", "lump") not in on_it.self_pairs


def test_a_point_is_taken_for_a_pose_that_is_not_turned() -> None:
    there = hold(ARMS, Sphere((0, 0, 0), 0.1), pose=(1, 2, 3)).shapes[-1]
    assert there == hold(ARMS, Sphere((1, 2, 3), 0.1)).shapes[-1]


def test_a_number_of_capsules_is_not_used_and_that_is_told() -> None:
    robot = hold(ARMS, Box((0.3, 0.3, 0.02)), capsules_per_shape=3)
    assert robot.shapes == hold(ARMS, Box((0.3, 0.3, 0.02))).shapes
    assert "'held' keeps its shape: capsules_per_shape is no longer used" in robot.notes


def test_a_robot_without_an_envelope_may_hold_something() -> None:
    bare = urdf_text.loaded(urdf_text.chain(urdf_text.joint("a", "link_0", "link_1")))
    robot = hold(bare, Box((0.1, 0.1, 0.1)))
    assert {part.name for part in robot.shapes} == {"held"}
    assert robot.self_pairs == ()


@pytest.mark.parametrize(
    ("case", "call"),
    [
        ("held: half-space", lambda: hold(ARMS, HalfSpace((0, 0, 1), (0, 0, 0)))),
        ("held: no shape", lambda: hold(ARMS, "a cup")),  # type: ignore[arg-type]
        ("held: scene", lambda: hold(ARMS, Scene())),  # type: ignore[arg-type]
        ("held: by no robot", lambda: hold("panda", Sphere((0, 0, 0), 1))),  # type: ignore[arg-type]
        ("held: unknown frame", lambda: hold(ARMS, Sphere((0, 0, 0), 1), frame="left_tol")),
        ("held: name taken", lambda: hold(ARMS, Sphere((0, 0, 0), 1), name="left_tool")),
        ("held: name taken by another", lambda: hold(hold(ARMS, Sphere((0, 0, 0), 1)), Sphere((0, 0, 0), 1))),
        ("held: name empty", lambda: hold(ARMS, Sphere((0, 0, 0), 1), name="")),
        ("held: touching mistyped", lambda: hold(ARMS, Sphere((0, 0, 0), 1), touching=["left_thum"])),
        ("held: touching a list", lambda: hold(ARMS, Sphere((0, 0, 0), 1), touching=[["left_thumb"]])),  # type: ignore[list-item]
        ("held: touching is one name", lambda: hold(ARMS, Sphere((0, 0, 0), 1), touching="left_thumb")),
        ("held: pose of three by three", lambda: hold(ARMS, Sphere((0, 0, 0), 1), pose=np.eye(3))),
        ("held: pose of two numbers", lambda: hold(ARMS, Sphere((0, 0, 0), 1), pose=(1, 2))),
        ("held: pose that is no rotation", lambda: hold(ARMS, Sphere((0, 0, 0), 1), pose=2 * np.eye(4))),
    ],
)
def test_what_cannot_be_held_is_refused(case: str, call: Callable[[], Robot]) -> None:
    assert_refused("robot", case, RobotError, call)


# ---- masses -----------------------------------------------------------------------------------------------------------------
SERVICER = load_robot("servicer7")
BALLS = SphereSet([(0.1, 0, 0), (0.2, 0, 0), (0.1, 0.1, 0.3)], [0.1, 0.15, 0.05])
ROUND = ("sphere", "capsule", "box", "cylinder")  # what `inside_of` knows
WEIGHED: dict[str, Any] = {name: shape for name, (shape, _) in SHAPES.items() if name in ROUND}
WEIGHED["sphere set"] = BALLS


def inside_of(shape: Any, points: np.ndarray) -> np.ndarray:
    """Which of points (k, 3), in the shape's coordinates, are inside."""
    if isinstance(shape, Sphere):
        return np.linalg.norm(points - shape.center, axis=1) <= shape.radius
    if isinstance(shape, Capsule):
        return from_segments(points, shape.a, shape.b) <= shape.radius
    if isinstance(shape, SphereSet):
        away = np.linalg.norm(points[:, None] - shape.centers, axis=2)
        return (away <= shape.radii).any(axis=1)
    own = (points - shape.pose[:3, 3]) @ shape.pose[:3, :3]
    if isinstance(shape, Box):
        return (np.abs(own) <= shape.size / 2).all(axis=1)
    return (np.hypot(own[:, 0], own[:, 1]) <= shape.radius) & (np.abs(own[:, 2]) <= shape.length / 2)


@pytest.mark.parametrize("name", WEIGHED)
def test_the_mass_of_what_is_held_is_that_of_an_evenly_filled_shape(name: str) -> None:
    shape, T_tip_x = WEIGHED[name], pose((0.1, 0.2, 0.3), (0.3, 0.5, -0.2, 0.7))
    robot = hold(SERVICER, shape, pose=T_tip_x, mass=7.0)
    body = robot.bodies[-1]
    points = np.random.default_rng(0).uniform(-1, 1, (400_000, 3)) * 0.6
    points = points[inside_of(shape, points)]
    frame = SERVICER.frame(SERVICER.tip)
    T = frame.T_joint_frame @ T_tip_x
    there = points @ T[:3, :3].T + T[:3, 3]
    off = there - there.mean(axis=0)
    second = off.T @ off / len(off) * 7.0
    inertia = np.trace(second) * np.eye(3) - second
    few = 4 / math.sqrt(len(points)) + 0.02
    assert body.name == "held"
    assert body.joint == frame.joint
    assert body.mass == 7.0
    assert np.abs(body.com - there.mean(axis=0)).max() <= few * 0.2
    assert np.abs(body.inertia - inertia).max() <= few * np.abs(inertia).max()


def test_a_centre_and_an_inertia_are_taken_in_the_held_things_own_frame() -> None:
    T_tip_x, box = pose((0.1, 0.2, 0.3), (0.3, 0.5, -0.2, 0.7)), Box((0.3, 0.2, 0.1), TURNED)
    entries, com = (0.3, 0.2, 0.25, 0.01, 0.02, -0.03), (0.01, 0.02, 0.03)
    matrix = np.array([[0.3, 0.01, 0.02], [0.01, 0.2, -0.03], [0.02, -0.03, 0.25]])
    robot = hold(SERVICER, box, pose=T_tip_x, mass=4, com=com, inertia=entries, name="unit")
    assert robot == hold(SERVICER, box, pose=T_tip_x, mass=4, com=com, inertia=matrix, name="unit")
    own, body = robot.frame("unit").T_joint_frame, robot.bodies[-1]
    assert np.allclose(body.com, own[:3, :3] @ com + own[:3, 3])
    assert np.allclose(body.inertia, own[:3, :3] @ matrix @ own[:3, :3].T)


@pytest.mark.parametrize("kind", SHAPES)
def test_a_density_fills_the_shape_evenly(kind: str) -> None:
    shape, _ = SHAPES[kind]
    even = solid_moments(shape)
    robot = hold(SERVICER, shape, pose=TURNED, density=2700)
    body = robot.bodies[-1]
    assert body.mass == pytest.approx(2700 * even.volume)
    by_mass = hold(SERVICER, shape, pose=TURNED, mass=body.mass).bodies[-1]
    np.testing.assert_allclose(body.com, by_mass.com, atol=1e-12)
    np.testing.assert_allclose(body.inertia, by_mass.inertia, atol=1e-12)
    assert any(f"{body.mass:.4g} kg: 2700 kg/m^3" in note for note in robot.notes)
    assert "held" not in dict(robot.unweighed)


def test_a_floating_base_is_not_planned_with_a_payload_without_mass() -> None:
    home = SERVICER.configuration("home")
    robot = hold(SERVICER, Box((0.3, 0.2, 0.1)))
    assert any("'held' is held, and nothing says its mass" in note for note in robot.notes)
    with pytest.raises(RobotError, match=r"cannot float: the mass of 'held' .* is not known"):
        plan(Problem(robot, Scene(), start=home, goal=home))
    for weight in ({"mass": 3.0}, {"density": 1000.0}):
        heavy = Problem(hold(SERVICER, Box((0.3, 0.2, 0.1)), **weight), Scene(), start=home, goal=home + 0.01, clearance=0)
        certificate = certify(heavy, Trajectory(heavy.robot, Motion([home, home + 0.01])))
        assert "not known" not in certificate.message
    bare = certify(Problem(robot, Scene(), start=home, goal=home + 0.01), Trajectory(robot, Motion([home, home + 0.01])))
    assert not bare.holds
    assert "'held'" in bare.message


MASSES: dict[str, dict[str, Any]] = {
    "mass and density": {"mass": 1, "density": 1000},
    "density of 0": {"density": 0},
    "density of text": {"density": "steel"},
    "density and centre": {"density": 1000, "com": (0, 0, 0)},
    "density and inertia": {"density": 1000, "inertia": np.eye(3)},
    "mass below 0": {"mass": -1},
    "mass of 0": {"mass": 0},
    "mass of text": {"mass": "heavy"},
    "no mass": {"inertia": np.eye(3)},
    "centre only": {"com": (0, 0, 0)},
    "impossible inertia": {"mass": 1, "inertia": np.diag([1, 1, 3])},
    "negative inertia": {"mass": 1, "inertia": np.diag([1, 1, -1])},
    "inertia of five": {"mass": 1, "inertia": (1, 2, 3, 4, 5)},
    "centre of two": {"mass": 1, "com": (1, 2)},
    "inertia of text": {"mass": 1, "inertia": "round"},
}


@pytest.mark.parametrize("case", MASSES)
def test_masses_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("held", case, RobotError, lambda: hold(SERVICER, Box((1, 1, 1)), **MASSES[case]))


def test_a_density_of_what_has_no_volume_is_refused() -> None:
    plate = Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    assert_refused("held", "density of a plate", RobotError, lambda: hold(SERVICER, plate, density=1000))
    assert hold(SERVICER, plate, mass=6).bodies[-1].mass == 6


def test_the_base_of_a_robot_that_holds_something_heavy_turns_with_it() -> None:
    home = SERVICER.configuration("home")
    box = Box((0.5, 0.5, 0.5))
    moved = Motion([home, home + 0.4])
    free = Trajectory(SERVICER, moved)
    light, heavy = (Trajectory(hold(SERVICER, box, mass=mass), moved) for mass in (1e-6, 500.0))
    ends = [each.base_pose(each.duration)[1] for each in (free, light, heavy)]
    assert np.abs(ends[0] - ends[1]).max() < 1e-6
    assert np.abs(ends[0] - ends[2]).max() > 1e-2
