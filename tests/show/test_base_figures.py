"""Figures of motions whose base floats: everything is where it really is, and the base itself is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from matplotlib.text import Text
from scipy.spatial.transform import Rotation

from spacearm.core.errors import ProblemError
from spacearm.geometry import Box, Capsule, HalfSpace, Scene, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.motion.trajectory import base_frames
from spacearm.planner import BaseLimits
from spacearm.robot import forward_kinematics, joint_frames, load_robot
from spacearm.show import figure_base_motion, figure_base_paths, figure_clearance, figure_pareto, figure_path_2d, figure_path_3d
from spacearm.show.base_figures import differenced_rates, residual_momentum, rotation_vectors
from spacearm.show.drawing import (
    base_envelope,
    envelope,
    extent,
    make_drawing,
    pose_times,
    skeleton,
)
from spacearm.show.outlines import cut_off, silhouette
from spacearm.show.path_figures import parted
from support.drawn_runs import levels, texts
from support.floating_runs import POINTS, ROBOT, floating, front
from support.messages import assert_refused
from support.oracles.coal_shapes import distance, placed_shape

SCENE = Scene([Sphere((0.9, -1.2, 2.6), 0.1, name="debris"), Box(size=(0.3, 0.3, 0.3), pose=(1.2, -0.6, 2.2))])
GOALS = (0.9, -1.0, 2.5)


def drawn(figure: Any) -> Any:
    """Draw a figure, which warns of what does not fit."""
    figure.canvas.draw()
    return figure


@pytest.mark.parametrize("momentum", [0.0, 0.5])
def test_arm_and_base_are_drawn_where_they_are(momentum: float) -> None:
    trajectory = floating(momentum)
    drawing = make_drawing(trajectory, ROBOT, POINTS[0], GOALS, None)
    times = [0.0, *pose_times(trajectory, 5), trajectory.duration]
    assert len(drawing.poses) == 7
    for pose, t in zip(drawing.poses, times, strict=True):
        np.testing.assert_allclose(pose.segments[-1, 1], trajectory.tip(t)[:3, 3], atol=1e-9)
        np.testing.assert_allclose(pose.segments[0, 0], trajectory.base_pose(t)[0], atol=1e-9)
        position, wxyz = trajectory.base_pose(t)
        turn = Rotation.from_quat(wxyz[[1, 2, 3, 0]])
        frames = joint_frames(ROBOT, trajectory.sample(t).q)
        links = [capsule for capsule in ROBOT.capsules if capsule.joint >= 0]
        for body, link in zip(pose.envelope, links, strict=True):
            assert isinstance(body, Capsule)
            end = frames[link.joint, :3, :3] @ link.b + frames[link.joint, :3, 3]
            np.testing.assert_allclose(body.b, turn.apply(end) + position, atol=1e-9)
    assert [len(pose.base) for pose in drawing.poses] == [1, 0, 0, 0, 0, 0, 1]
    np.testing.assert_allclose(drawing.ends, trajectory.tip([0.0, trajectory.duration])[:, :3, 3], atol=1e-12)
    assert drawing.path is not None
    np.testing.assert_allclose(drawing.path[[0, -1]], drawing.ends, atol=1e-12)
    np.testing.assert_allclose(drawing.bases[-1], trajectory.base_pose(trajectory.duration)[0])


def test_a_base_that_is_held_aside_is_drawn_once_and_there() -> None:
    start = np.eye(4)
    start[:3, 3] = 1.0, 2.0, 3.0
    held = Trajectory(ROBOT, Motion(POINTS), base="fixed", base_start=start)
    drawing = make_drawing(held, ROBOT, POINTS[0], None, None)
    assert [len(pose.base) for pose in drawing.poses] == [0] * 6 + [1]
    np.testing.assert_array_equal(drawing.bases, [[1.0, 2.0, 3.0]])
    at_origin = make_drawing(Trajectory(ROBOT, Motion(POINTS), base="fixed"), ROBOT, POINTS[0], None, None)
    for here, there in zip(at_origin.poses, drawing.poses, strict=True):
        np.testing.assert_allclose(here.segments + np.array([1.0, 2.0, 3.0]), there.segments, atol=1e-12)
    for figure_path in (figure_path_2d, figure_path_3d):
        text = texts(drawn(figure_path(held, robot=ROBOT, scene=SCENE, start=POINTS[0])))
        assert "base" in text
        assert "pale at start" not in text
        assert "path of the base origin" not in text


@pytest.mark.parametrize("figure_path", [figure_path_2d, figure_path_3d])
def test_a_path_on_a_floating_base_names_the_base_and_its_path(figure_path: Any) -> None:
    figure = drawn(figure_path(floating(), robot=ROBOT, scene=SCENE, start=POINTS[0], goal=GOALS, title="srs7"))
    assert "base, pale at start" in texts(figure)
    assert "path of the base origin" in texts(figure)


def test_of_a_base_with_long_panels_what_is_near_the_arm_is_drawn() -> None:
    robot = load_robot("servicer7")
    points = np.array([np.zeros(7), [0.73, 0.53, -0.76, -0.88, 0.36, -0.64, 0.53]])
    trajectory = Trajectory(robot, Motion(points), base="floating")
    drawing = make_drawing(trajectory, robot, points[0], None, None)
    low, high = extent(drawing, Scene(), 3)
    assert (high - low).max() < 8.0  # the panels span 14.3 m
    assert "base (cut off), pale at start" in texts(
        drawn(figure_path_3d(trajectory, robot=robot, scene=Scene(), start=points[0]))
    )
    for body in drawing.poses[-1].base:
        for part in cut_off(body, low, high):
            seen = silhouette(part, *np.eye(3)[:2])
            radius = getattr(body, "radius", 0.0)
            assert (seen[:, :2] >= low[:2] - radius - 1e-9).all()
            assert (seen[:, :2] <= high[:2] + radius + 1e-9).all()


@hypothesis_settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6), st.floats(0.05, 0.5))
def test_what_is_cut_off_is_the_part_whose_axis_is_inside(numbers: list[float], radius: float) -> None:
    a, b = np.array(numbers[:3]), np.array(numbers[3:])
    if np.linalg.norm(b - a) < 1e-3:
        return
    low, high = np.array([-1.0, -1.5, -2.0]), np.array([1.0, 1.5, 2.0])
    parts = cut_off(Capsule(a, b, radius), low, high)
    share = np.linspace(0, 1, 2001)[:, None]
    points = a + share * (b - a)
    inside = ((points >= low) & (points <= high)).all(axis=1)
    if not parts:
        assert inside.sum() <= 1
    elif len(parts) == 1 and isinstance(parts[0], Capsule):
        assert inside.all()
    else:
        length = parts[0].length  # type: ignore[union-attr]
        assert abs(length - inside.mean() * np.linalg.norm(b - a)) < 2e-3 * np.linalg.norm(b - a)
        assert sum(isinstance(part, Sphere) for part in parts) == int(inside[0]) + int(inside[-1])


def test_obstacles_are_behind_or_before_the_base() -> None:
    view = (0.0, 0.0)  # the eye looks along -x
    scene = Scene([Sphere((2.0, 0, 0), 0.1, name="near"), Sphere((-2.0, 0, 0), 0.1), HalfSpace((0, 0, 1), (9.0, 0, -1))])
    behind, before = parted(scene, np.zeros(3), view)
    assert [obstacle.name for obstacle in before.obstacles] == ["near"]
    assert len(behind.obstacles) == 2


def test_the_clearance_is_to_where_the_obstacle_is_from_the_moving_base() -> None:
    trajectory = floating()
    sphere = Sphere((0.9, -1.2, 2.6), 0.1, name="debris")
    ax = drawn(figure_clearance(trajectory, scene=Scene([sphere]))).axes[0]
    curve = next(line for line in ax.get_lines() if len(line.get_xdata()) > 100)
    for i in (0, 123, 250, 400):
        t = float(curve.get_xdata()[i])
        T = base_frames(trajectory, t)
        bodies = [*envelope(ROBOT, trajectory.sample(t).q, T), *base_envelope(ROBOT, T)]
        nearest = min(distance(placed_shape(sphere), placed_shape(body)) for body in bodies)
        assert abs(float(curve.get_ydata()[i]) - nearest) < 1e-6


def test_rotation_vectors_are_those_of_the_poses() -> None:
    trajectory = floating(0.5)
    t = np.linspace(0, trajectory.duration, 7)
    turns = Rotation.from_quat(trajectory.base_pose(t)[1][:, [1, 2, 3, 0]])
    np.testing.assert_allclose(rotation_vectors(trajectory, t), (turns[0].inv() * turns).as_rotvec(), atol=1e-12)


@pytest.mark.parametrize("momentum", [0.0, 0.5])
def test_a_true_account_leaves_no_momentum(momentum: float) -> None:
    trajectory = floating(momentum)
    found = residual_momentum(trajectory, np.linspace(0.0, trajectory.duration, 21))
    assert max(found.linear.max(), found.angular.max()) < 1e-12
    assert np.isnan(found.of_poses[[0, -1]]).all()
    assert np.nanmax(found.of_poses) < 1e-6


@dataclass
class Lying:
    """A trajectory whose account of its base is wrong by a factor in its rates, or in its poses."""

    true: Trajectory
    rates: float = 1.0
    poses: float = 1.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self.true, name)

    def base_rate(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        velocity, omega = self.true.base_rate(t)
        return velocity, omega * self.rates

    def base_pose(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        position, wxyz = self.true.base_pose(t)
        begin = Rotation.from_quat(self.true.base_pose(0.0)[1][[1, 2, 3, 0]])
        flat = wxyz.reshape(-1, 4)
        turned = (begin.inv() * Rotation.from_quat(flat[:, [1, 2, 3, 0]])).as_rotvec() * self.poses
        return position, (begin * Rotation.from_rotvec(turned)).as_quat()[:, [3, 0, 1, 2]].reshape(wxyz.shape)


def test_a_false_account_leaves_momentum() -> None:
    t = np.linspace(0.0, floating().duration, 21)
    by_rates = residual_momentum(Lying(floating(), rates=1.01), t)  # type: ignore[arg-type]
    assert by_rates.angular.max() > 1e-3
    by_poses = residual_momentum(Lying(floating(), poses=1.01), t)  # type: ignore[arg-type]
    assert np.nanmax(by_poses.of_poses) > 1e-3
    assert by_poses.angular.max() < 1e-12


def test_differenced_rates_are_the_rates() -> None:
    t = np.linspace(0.0, 8.0, 11)[1:-1]
    np.testing.assert_allclose(differenced_rates(floating(0.5), t), floating(0.5).base_rate(t)[1], atol=1e-8)


def test_the_base_over_time_has_units_and_its_limits() -> None:
    limits = BaseLimits(peak=np.radians(30.0), final=np.radians(20.0), rate=np.radians(12.0))
    figure = drawn(figure_base_motion(floating(), limits=limits, title="srs7"))
    attitude, rate, residual = figure.axes
    assert [ax.get_ylabel() for ax in figure.axes] == ["rotation [deg]", "rate [deg/s]", "residual [-]"]
    assert residual.get_xlabel() == "time [s]"
    assert residual.get_yscale() == "log"
    assert "momentum / greatest of a link" in residual.get_title(loc="left")
    np.testing.assert_allclose(levels(attitude), [30.0, 20.0])
    np.testing.assert_allclose(levels(rate), [12.0])
    t = attitude.get_lines()[0].get_xdata()
    turned = np.degrees(np.linalg.norm(rotation_vectors(floating(), t), axis=1))
    np.testing.assert_allclose(attitude.get_lines()[0].get_ydata(), turned, atol=1e-9)
    assert attitude.get_ylim()[1] > 30.0
    edge = figure.bbox
    for text in figure.findobj(Text):  # but for numbers at ticks, some of which are not shown
        box = text.get_window_extent()
        assert len(text.get_text()) < 8 or (box.x0 >= edge.x0 - 1 and box.x1 <= edge.x1 + 1), text
    for name in ("magnitude", "differences of the attitude", "stated rates"):
        assert name in texts(figure)


def test_a_base_that_does_not_move_can_be_drawn() -> None:
    still = Trajectory(ROBOT, Motion(POINTS[[0, 0]]), base="floating")
    drawn(figure_base_motion(still))
    drawn(figure_base_paths(still))
    for figure_path in (figure_path_2d, figure_path_3d):
        drawn(figure_path(still, robot=ROBOT, scene=SCENE, start=POINTS[0]))


def test_the_paths_have_equal_scales_and_the_centre_of_mass_rests() -> None:
    figure = drawn(figure_base_paths(floating(), title="srs7"))
    assert [(ax.get_xlabel(), ax.get_ylabel()) for ax in figure.axes] == 2 * [
        ("x [m]", "y [m]"),
        ("x [m]", "z [m]"),
        ("y [m]", "z [m]"),
    ]
    for ax in figure.axes:
        assert np.isclose(np.diff(ax.get_xlim()), np.diff(ax.get_ylim()))
        box = ax.get_window_extent()
        assert np.isclose(box.width, box.height, rtol=1e-3)
    tip, base = figure.axes[0].get_lines()[0], figure.axes[3].get_lines()[0]
    np.testing.assert_allclose(np.column_stack(tip.get_data())[-1], floating().tip(floating().duration)[:2, 3], atol=1e-12)
    np.testing.assert_allclose(np.column_stack(base.get_data())[0], [0.5, -1.0], atol=1e-12)
    assert np.ptp(np.column_stack(figure.axes[3].get_lines()[3].get_data()), axis=0).max() < 1e-9


@pytest.mark.parametrize("figure_of", [figure_base_motion, figure_base_paths])
def test_a_fixed_base_has_no_motion_to_draw(figure_of: Any) -> None:
    held = Trajectory(ROBOT, Motion(POINTS), base="fixed")
    assert_refused("show", "motion of a fixed base", ProblemError, lambda: figure_of(held))


def test_a_front_is_a_stair_through_its_plans() -> None:
    figure = drawn(figure_pareto(front([10.0, 12.0, 14.0, 20.0], [5.0, 3.0, 4.0, 1.0], [True, True, False, True]), title="a"))
    ax = figure.axes[0]
    assert ax.get_xlabel() == "duration [s]"
    assert ax.get_ylabel() == "greatest angle of the base [deg]"
    stair, kept, beaten = ax.get_lines()
    assert stair.get_drawstyle() == "steps-post"
    np.testing.assert_allclose(np.column_stack(stair.get_data())[1:-1], [[10, 5], [12, 3], [20, 1]])
    np.testing.assert_allclose(np.column_stack(kept.get_data()), [[10, 5], [12, 3], [20, 1]])
    np.testing.assert_allclose(np.column_stack(beaten.get_data()), [[14, 4]])
    (low, high), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    assert low < 10.0 < 20.0 < high
    assert bottom < 1.0 < 5.0 < top


def test_a_front_of_one_plan_is_drawn_and_one_of_none_is_refused() -> None:
    assert "beaten" not in texts(drawn(figure_pareto(front([10.0], [0.0], [True]))))
    assert_refused("show", "front without plans", ProblemError, lambda: figure_pareto(front([], [], [])))


def test_a_skeleton_is_moved_with_its_base() -> None:
    T = base_frames(floating(), 1.0)
    expected = T @ forward_kinematics(ROBOT, POINTS[1])
    np.testing.assert_allclose(skeleton(ROBOT, POINTS[1], T)[-1, 1], expected[:3, 3], atol=1e-12)
