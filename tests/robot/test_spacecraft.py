"""The built-in spacecraft: their published numbers, and envelopes and masses that can be."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from spacearm.geometry import Box, Polytope, moved_shape
from spacearm.robot import Robot, builtin_robots, forward_kinematics, load_robot
from support.forward_kinematics import joint_transforms
from support.oracles.coal_shapes import distance, placed_shape
from support.oracles.pinocchio_model import full_q, pinocchio_model

FLOATING = ("ets7", "servicer7", "srs7", "ssrms")
ROUNDING = 1e-9
ROOM_AT_HOME = 0.02  # [m] a planner keeps 10 mm, and home is where motions begin


def center_of_mass(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Of base and links, in the base frame (3,) [m]."""
    placed_at = [*joint_transforms(robot, q), np.eye(4)]  # joint -1, the base, is the last
    centers = np.array([placed_at[body.joint][:3, :3] @ body.com + placed_at[body.joint][:3, 3] for body in robot.bodies])
    masses = np.array([body.mass for body in robot.bodies])
    return masses @ centers / masses.sum()


def self_clearances(robot: Robot, q: np.ndarray) -> dict[tuple[str, str], float]:
    """Signed distances of the links that must keep clear of each other, by Coal [m]."""
    frames, links = [*joint_transforms(robot, q), np.eye(4)], {}
    for part in robot.shapes:
        links.setdefault(part.name, []).append(placed_shape(moved_shape(part.shape, frames[part.joint])))
    return {(a, b): min(distance(one, other) for one in links[a] for other in links[b]) for a, b in robot.self_pairs}


@pytest.mark.parametrize(
    ("name", "base", "arm"),
    [
        ("servicer7", 1474.1, 153.539),
        ("srs7", 100, 20.67),
        ("ets7", 2552, 140.2),
        ("ssrms", 14515, 1505.32),
        ("zhang2022", 100, 24.04),
    ],
)
def test_masses_add_up_to_the_published_totals(name: str, base: float, arm: float) -> None:
    robot = load_robot(name)
    (of_base,) = [body.mass for body in robot.bodies if body.name == "base"]
    assert of_base == base
    assert sum(body.mass for body in robot.bodies) - of_base == pytest.approx(arm, abs=1e-9)


def test_the_servicers_end_effector_is_where_its_source_has_it() -> None:
    # Of the project's own program, in a frame whose origin is the system's centre of mass, at q = 0.
    robot = load_robot("servicer7")
    q = robot.configuration("home")
    tip = forward_kinematics(robot, q)[:3, 3] - center_of_mass(robot, q)
    np.testing.assert_allclose(tip, (-0.381849443981743, 0.568500546238447, 1.157380648460746), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(q, 0)


def test_the_servicer_has_its_sources_limits() -> None:
    robot = load_robot("servicer7")
    np.testing.assert_allclose(np.degrees(robot.upper), (360, 180, 360, 360, 360, 120, 360))
    np.testing.assert_allclose(np.degrees(robot.lower), (-360, 0, -360, -360, -360, -120, -360))
    assert (set(robot.velocity), set(robot.acceleration)) == ({0.0873}, {0.00873})
    others = ("base", "panel_left", "panel_right", "link_1", "link_2")
    assert set(robot.self_pairs) == {tuple(sorted((a, f"link_{k}"))) for a in others for k in (5, 6, 7)}


def test_the_light_arm_has_its_sources_shape() -> None:
    robot = load_robot("srs7")
    upright = np.zeros(7)  # out of its elbow's limits, and what the source's numbers are about
    frames = joint_transforms(robot, upright)
    np.testing.assert_allclose([T[2, 3] for T in frames], (0, 0.31, 0.31, 0.71, 0.71, 1.1, 1.1), atol=ROUNDING)
    np.testing.assert_allclose([T[:3, 2] for T in frames], np.eye(3)[[2, 1, 0, 1, 0, 1, 0]], atol=ROUNDING)
    np.testing.assert_allclose(forward_kinematics(robot, upright)[:3, 3], (0, 0, 1.178), atol=ROUNDING)


def test_canadarm2_is_as_long_and_turns_about_the_axes_that_are_published() -> None:
    robot = load_robot("ssrms")
    q = robot.configuration("home")
    tip = forward_kinematics(robot, q)[:3, 3] - forward_kinematics(robot, q, frame="link_1")[:3, 3]
    # Stretched, along the base's z; sideways two joints of 0.5692 m and the elbow's 0.475 m.
    np.testing.assert_allclose(tip, (0, -(2 * 0.5692 + 0.475), 2 * (1.3589 + 7.11)), atol=ROUNDING)
    axes = [T[:3, 2] for T in joint_transforms(robot, q)]
    roll, yaw, pitch = (0, 0, 1), (-1, 0, 0), (0, 1, 0)
    np.testing.assert_allclose(axes, [roll, yaw, pitch, pitch, pitch, yaw, roll], atol=ROUNDING)


def test_the_etss_arm_reaches_as_far_as_its_joints_are_apart() -> None:
    robot = load_robot("ets7")
    tip = forward_kinematics(robot, robot.configuration("home"))[:3, 3]
    # Joint by joint in the base frame, the quarter turns done by hand.
    np.testing.assert_allclose(tip, (-0.79 + 0.63 + 0.225 + 0.532, -0.29 + 0.15 - 0.125 - 0.262, 1 + 0.35 + 0.87 + 0.277))


@pytest.mark.parametrize("name", builtin_robots())
def test_the_center_of_mass_is_pinocchios(name: str) -> None:
    robot = load_robot(name)
    model, _ = pinocchio_model(robot)
    for body in robot.bodies:
        inertia = pin.Inertia(body.mass, np.array(body.com), np.array(body.inertia))
        model.appendBodyToJoint(body.joint + 1, inertia, pin.SE3.Identity())
    generator = np.random.default_rng(7)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    for q in generator.uniform(low, high, (5, robot.dof)):
        # Pinocchio leaves out what rides on its world, which here is the base.
        moving = sum(body.mass for body in robot.bodies if body.joint >= 0)
        theirs = moving * pin.centerOfMass(model, model.createData(), full_q(robot, q))
        theirs = theirs + sum(body.mass * body.com for body in robot.bodies if body.joint < 0)
        total = sum(body.mass for body in robot.bodies)
        np.testing.assert_allclose(center_of_mass(robot, q), theirs / total, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("name", builtin_robots())
def test_every_inertia_is_that_of_a_body(name: str) -> None:
    for body in load_robot(name).bodies:
        least, middle, largest = np.linalg.eigvalsh(body.inertia)
        assert least > 0
        assert largest <= (least + middle) * (1 + ROUNDING)


@pytest.mark.parametrize("name", FLOATING)
def test_it_floats_says_where_its_numbers_are_from_and_is_free_at_home(name: str) -> None:
    robot = load_robot(name)
    assert robot.base == "floating"
    assert any(note.startswith("source: ") for note in robot.notes)
    assert any(note.startswith("declared: ") for note in robot.notes)
    assert not any("has a mass" in note for note in robot.notes)
    assert "home" in [configuration.name for configuration in robot.configurations]
    for configuration in robot.configurations:
        q = configuration.q
        assert (robot.lower <= q).all()
        assert (q <= robot.upper).all()
        clearances = self_clearances(robot, q)
        assert min(clearances.values()) >= ROOM_AT_HOME, min(clearances, key=lambda pair: clearances[pair])
    assert {part.name for part in robot.shapes if part.joint < 0} & {a for a, _ in robot.self_pairs}
    assert len(robot.shapes) <= 11


def test_the_papers_arm_stays_on_a_fixed_base() -> None:
    robot = load_robot("zhang2022")
    assert robot.base == "fixed"
    assert robot.self_pairs == ()
    assert {capsule.joint for capsule in robot.capsules} == {2, 3, 6}


def test_each_link_of_the_servicer_holds_its_center_of_mass() -> None:
    robot = load_robot("servicer7")
    for body in robot.bodies:
        point = placed_shape(Polytope([body.com]))
        parts = [part.shape for part in robot.shapes if part.name == body.name]
        assert any(distance(point, placed_shape(part)) < 0 for part in parts), body.name


@pytest.mark.parametrize(
    ("name", "link", "size", "center"),
    [
        ("servicer7", "base", (2, 2, 2), (0, 0, 0)),
        ("servicer7", "panel_left", (3.0, 6.2, 0.1), (0, 4.1, 0)),
        ("servicer7", "panel_right", (3.0, 6.2, 0.1), (0, -4.1, 0)),
        ("srs7", "base", (0.8, 0.8, 0.3), (0, 0, 0)),
        ("ets7", "base", (2.2, 2.1, 2), (0, 0, 0)),
        ("ets7", "panel_left", (2, 5, 0.05), (0, 3.8, 0)),
        ("ets7", "panel_right", (2, 5, 0.05), (0, -3.8, 0)),
    ],
)
def test_bodies_and_panels_are_the_boxes_of_their_sources(
    name: str, link: str, size: tuple[float, ...], center: tuple[float, ...]
) -> None:
    robot = load_robot(name)
    assert [part.shape for part in robot.shapes if part.name == link] == [Box(size, center)]
    assert {part.joint for part in robot.shapes if part.name == link} == {-1}
    assert not any("stand out" in note for note in robot.notes)
