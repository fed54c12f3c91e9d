"""The kernel's clearances against Coal, closed forms, and the paper's own case split."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import accuracy, drawn
from kernel.builds import Build, place
from spacearm.geometry import Scene, Sphere
from spacearm.planner.kernel_model import make_kernel_model
from spacearm.robot import LinkCapsule, Robot
from support import strategies
from support.kernel_cases import bench, capsule, rounding
from support.oracles import coal_shapes, pinocchio_points

RADII = st.one_of(st.just(0.0), st.floats(1e-3, 0.5))


def on_bench(build: Build, capsules: list[LinkCapsule], balls: list[Sphere]) -> np.ndarray:
    """Clearances (capsules, balls) [m]."""
    model = place(build, bench(*capsules), spheres=balls)
    return model.native.clearances(build.array([[0.0]]))[0]


@settings(max_examples=12)
@given(st.data())
def test_clearances_are_coals(build: Build, data: st.DataObject) -> None:
    robot = data.draw(drawn.robots())
    q = data.draw(drawn.batches(robot, build, data.draw(st.sampled_from([1, 3]))))
    frames = pinocchio_points.joint_frames(robot, q)
    balls = data.draw(drawn.balls_near(robot, frames[0]))
    model = place(build, robot, spheres=balls, share_ends=data.draw(st.booleans()))
    far = max((float(np.linalg.norm(ball.center)) for ball in balls), default=0.0)
    np.testing.assert_allclose(
        model.native.clearances(q),
        coal_shapes.clearances(frames, robot.capsules, balls),
        rtol=0,
        atol=accuracy.placement_error(build, robot, q) + rounding(build, far),
    )


@settings(max_examples=25)
@given(strategies.robots(), strategies.scenes(), st.integers(0, 2**32 - 1))
@pytest.mark.parametrize("precision", [64, 32])
def test_sharing_points_between_links_changes_no_clearance(precision: int, robot: Robot, scene: Scene, seed: int) -> None:
    """make_kernel_model carries ends that coincide once, by the joint nearest the base."""
    build = Build("default", precision)
    q = build.array(np.random.default_rng(seed).uniform(-3, 3, (3, robot.dof)))
    found = getattr(make_kernel_model(robot, scene), f"model{precision}").clearances(q)
    frames = pinocchio_points.joint_frames(robot, q)
    error = accuracy.placement_error(build, robot, q) + rounding(build, 4.0)
    expected = coal_shapes.clearances(frames, robot.capsules, scene.obstacles)
    np.testing.assert_allclose(found, expected, rtol=0, atol=error)


# ---- closed forms ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("centre", "distance"),
    [
        ((0.5, 0.0, 0.0), 0.0),  # on the axis
        ((0.0, 0.0, 0.0), 0.0),  # at its start
        ((1.0, 0.0, 0.0), 0.0),  # at its end
        ((0.5, 0.0, 0.25), 0.25),  # beside it
        ((-0.5, 0.0, 0.0), 0.5),  # on its left extension
        ((1.75, 0.0, 0.0), 0.75),  # on its right extension
        ((-3.0, 4.0, 0.0), 5.0),  # off its left extension
        ((4.0, 0.0, -4.0), 5.0),  # off its right extension
    ],
)
@pytest.mark.parametrize(("link_radius", "ball_radius"), [(0.0, 0.25), (0.5, 0.25), (8.0, 16.0)])
def test_clearance_is_the_distance_to_the_axis_less_both_radii(
    build: Build, centre: tuple[float, ...], distance: float, link_radius: float, ball_radius: float
) -> None:
    link = capsule((0, 0, 0), (1, 0, 0), link_radius)
    # All these numbers and their squares are exact in either scalar, and so is the answer.
    assert on_bench(build, [link], [Sphere(centre, ball_radius)]) == distance - link_radius - ball_radius


def test_a_capsule_without_length_is_a_sphere(build: Build) -> None:
    point, ball = np.array([1.0, 2.0, 3.0]), Sphere((1.0, 5.0, 7.0), 0.5)
    assert on_bench(build, [capsule(point, point, 0.25)], [ball]) == 5 - 0.25 - 0.5


@settings(max_examples=20)
@given(st.integers(-44, -1), strategies.points(), RADII)
def test_a_very_short_capsule_is_nearly_a_sphere(build: Build, power: int, centre: np.ndarray, radius: float) -> None:
    length = 10.0**power
    links = [capsule((0, 0, 0), (0, length, 0), radius), capsule((1, 1, 1), (1, 1, 1 + length), radius)]
    found = on_bench(build, links, [Sphere(centre, 0.1)])[:, 0]
    spheres = np.linalg.norm(centre - [[0, 0, 0], [1, 1, 1]], axis=1) - radius - 0.1
    np.testing.assert_allclose(found, spheres, rtol=0, atol=length + rounding(build, 4.0))


@settings(max_examples=20)
@given(strategies.points(), strategies.points(), strategies.points(), RADII)
def test_the_ends_of_a_capsule_may_change_places(
    build: Build, a: np.ndarray, b: np.ndarray, centre: np.ndarray, radius: float
) -> None:
    found = on_bench(build, [capsule(a, b, radius), capsule(b, a, radius)], [Sphere(centre, 0.1)])
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=rounding(build, 4.0))


def test_no_links_or_no_obstacles_have_no_clearances(build: Build) -> None:
    link, ball = capsule((0, 0, 0), (1, 0, 0), 0.1), Sphere((0, 0, 1), 0.1)
    assert on_bench(build, [], [ball]).shape == (0, 1)
    assert on_bench(build, [link], []).shape == (1, 0)


# ---- the paper's way ------------------------------------------------------------------------------------------------


def by_cases(M_C: np.ndarray, M_D: np.ndarray, A_O: np.ndarray) -> float:
    """Least distance of the obstacle's centre to the link's control points, two or three of them [m]."""
    to_C, to_D, link = (float(np.linalg.norm(v)) for v in (A_O - M_C, A_O - M_D, M_D - M_C))
    controls = [to_C, to_D]  # eq. (1)
    if to_C > 0 and to_D > 0 and link > 0:
        cos_C = float((A_O - M_C) @ (M_D - M_C)) / (to_C * link)
        cos_D = float((A_O - M_D) @ (M_C - M_D)) / (to_D * link)
        on_left_extension, on_right_extension = cos_C < 0, cos_D < 0
        if not (on_left_extension or on_right_extension):
            assert to_C * cos_C <= link * (1 + 1e-12)  # eq. (2)
            projection = M_C + to_C * cos_C / link * (M_D - M_C)
            controls.append(float(np.linalg.norm(A_O - projection)))  # eq. (3)
    return min(controls)


LINKS = st.lists(st.tuples(strategies.points(), strategies.points()), min_size=1, max_size=4)
OBSTACLES = st.lists(strategies.points(2.0), min_size=1, max_size=4)


@settings(max_examples=20)
@given(LINKS, OBSTACLES, st.data())
def test_the_papers_two_or_three_control_points_give_the_same_distance(
    build: Build, ends: list[tuple[np.ndarray, np.ndarray]], centres: list[np.ndarray], data: st.DataObject
) -> None:
    # Beside drawn centres, one off each link's middle and ends: where the cases meet.
    shares = st.sampled_from([-0.5, 0.0, 0.5, 1.0, 1.5])
    centres = centres + [C + data.draw(shares) * (D - C) + [0, 0, 0.3] for C, D in ends]
    found = on_bench(build, [capsule(C, D, 0.0) for C, D in ends], [Sphere(A_O, 0.125) for A_O in centres])
    expected = [[by_cases(C, D, A_O) - 0.125 for A_O in centres] for C, D in ends]
    np.testing.assert_allclose(found, expected, rtol=0, atol=rounding(build, 8.0))


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 2, 2.0, math.pi])
def test_the_case_follows_the_projection(build: Build, turn: float) -> None:
    """A ball circles the end of a link: beside the link the axis is nearest, past it the end is."""
    centre = np.array([1 - math.cos(turn), math.sin(turn), 0.0])
    found = float(on_bench(build, [capsule((0, 0, 0), (1, 0, 0), 0.0)], [Sphere(centre, 0.5)])[0, 0])
    nearest = math.sin(turn) if turn < math.pi / 2 else 1.0
    assert found == pytest.approx(nearest - 0.5, abs=rounding(build, 2.0))
