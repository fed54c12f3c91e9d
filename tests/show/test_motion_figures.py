"""Figures of motions: joints over time, the path in the plane and in space, clearance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError, RobotError
from spacearm.dynamics import hold
from spacearm.geometry import Capsule, Scene, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.planner import ConfigurationGoal, Problem, clearance
from spacearm.proof import Certificate, certify
from spacearm.robot import forward_kinematics, load_robot
from spacearm.show import figure_clearance, figure_joints, figure_path_2d, figure_path_3d
from spacearm.show.drawing import envelope, pose_times, skeleton
from spacearm.show.figure_style import new_figure
from support import strategies
from support.drawn_runs import SCENE, levels, moved, texts, two_joints

PATHS = [figure_path_2d, figure_path_3d]


def drawn(figure: object) -> object:
    """Draw a figure, which warns of what does not fit."""
    figure.canvas.draw()  # type: ignore[attr-defined]
    return figure


def proof(trajectory: Trajectory, scene: Scene) -> Certificate:
    """Certify a motion that begins at 0."""
    end = trajectory.motion.control_points[-1]
    return certify(Problem(trajectory.robot, scene, start=[0, 0], goal=ConfigurationGoal(end)), trajectory)


def test_joints_over_time_have_their_limits_and_units() -> None:
    robot = two_joints(prismatic=True)
    figure = drawn(figure_joints(moved(robot), title="two"))
    grid = np.array(figure.axes).reshape(2, 3)  # type: ignore[attr-defined]
    assert [[ax.get_ylabel().split("[")[1] for ax in row] for row in grid] == [
        ["deg]", "deg/s]", "deg/s²]"],
        ["m]", "m/s]", "m/s²]"],
    ]
    assert [ax.get_xlabel() for ax in grid[-1]] == ["time [s]"] * 3
    np.testing.assert_allclose(levels(grid[0, 1]), np.degrees([-1.0, 1.0]))
    np.testing.assert_allclose(levels(grid[1, 2]), [-0.25, 0.25])
    for row in grid:
        for ax in row:
            low, high = ax.get_ylim()
            assert low <= ax.get_lines()[0].get_ydata().min()
            assert high >= ax.get_lines()[0].get_ydata().max()


def test_a_motion_that_rests_can_be_drawn() -> None:
    robot = two_joints()
    still = Trajectory(robot, Motion(np.array([[0.1, 0.2], [0.1, 0.2]])))
    drawn(figure_joints(still))
    drawn(figure_clearance(still, scene=SCENE))
    for figure_path in PATHS:
        drawn(figure_path(still, robot=robot, scene=SCENE, start=[0.1, 0.2]))


@pytest.mark.parametrize("figure_path", PATHS)
@pytest.mark.parametrize("prismatic", [False, True])
def test_a_path_has_axes_in_metres_and_names_what_is_drawn(figure_path, prismatic: bool) -> None:
    robot = two_joints(prismatic=prismatic)
    trace = np.array([[0.0, 0.0], [0.0, 0.0], [0.5, 0.2], [0.8, 0.6]])
    figure = drawn(
        figure_path(moved(robot), robot=robot, scene=SCENE, start=[0, 0], goal=(0.4, 0.9, 0), trace=trace, title="two")
    )
    ax = figure.axes[0]  # type: ignore[attr-defined]
    assert ax.get_xlabel() == "x [m]"
    assert ax.get_ylabel() == "y [m]"
    for name in ("planned path", "swarm's best", "start and end", "target", "obstacle", "arm"):
        assert name in texts(figure)


@pytest.mark.parametrize("figure_path", PATHS)
def test_without_a_trajectory_the_trace_or_the_start_alone_is_drawn(figure_path) -> None:
    robot = two_joints(radius=0.0)
    trace = np.array([[0.5, 0.2]])
    alone = texts(drawn(figure_path(None, robot=robot, scene=Scene(), start=[0, 0])))
    assert "planned path" not in alone
    assert "obstacle" not in alone
    assert "target" not in alone
    assert "swarm's best" in texts(
        drawn(figure_path(None, robot=robot, scene=SCENE, start=[0, 0], goal=(1, 0, 0), trace=trace))
    )


def test_the_plane_shows_circles_ends_and_target_where_they_are() -> None:
    from matplotlib.patches import Circle

    robot = two_joints()
    trajectory = moved(robot)
    ax = figure_path_2d(trajectory, robot=robot, scene=SCENE, start=[0, 0], goal=(0.4, 0.9, 0.3)).axes[0]
    circles = {(*patch.center, patch.radius) for patch in ax.patches if isinstance(patch, Circle)}
    assert circles == {(0.9, 0.6, 0.1), (0.2, 0.9, 0.15)}
    assert ax.get_aspect() == 1.0
    ends = forward_kinematics(robot, trajectory.motion.sample([0.0, 1.0]))[:, :2, 3]
    points = [np.column_stack(line.get_data()) for line in ax.get_lines()]
    assert any(np.allclose(p, ends) for p in points if p.shape == (2, 2))
    assert any(np.allclose(p, [[0.4, 0.9]]) for p in points if p.shape == (1, 2))
    (low_x, high_x), (low_y, high_y) = ax.get_xlim(), ax.get_ylim()
    for x, y, radius in circles:
        assert low_x < x - radius < x + radius < high_x
        assert low_y < y - radius < y + radius < high_y


def test_space_has_equal_scales() -> None:
    robot = two_joints()
    ax = figure_path_3d(moved(robot), robot=robot, scene=SCENE, start=[0, 0]).axes[0]
    spans = [np.diff(limits)[0] for limits in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())]
    np.testing.assert_allclose(ax._box_aspect / np.linalg.norm(ax._box_aspect), spans / np.linalg.norm(spans))


def test_paths_are_drawn_into_given_axes() -> None:
    robot = two_joints()
    figure = new_figure(7.0, 3.0)
    plane = figure.add_subplot(1, 2, 1)
    space = figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
    assert figure_path_2d(moved(robot), robot=robot, scene=SCENE, start=[0, 0], ax=plane) is figure
    assert figure_path_3d(moved(robot), robot=robot, scene=SCENE, start=[0, 0], ax=space) is figure
    drawn(figure)


@pytest.mark.parametrize("figure_path", PATHS)
def test_a_start_or_a_goal_that_cannot_be_is_refused(figure_path) -> None:
    robot = two_joints()
    with pytest.raises(ProblemError, match="one configuration"):
        figure_path(None, robot=robot, scene=SCENE, start=[[0, 0]])
    with pytest.raises(RobotError, match="q has shape"):
        figure_path(None, robot=robot, scene=SCENE, start=[0, 0, 0])
    with pytest.raises(ProblemError, match="the goal has shape"):
        figure_path(None, robot=robot, scene=SCENE, start=[0, 0], goal=(0.0, 1.0))


@hypothesis_settings(max_examples=25)
@given(st.data())
def test_the_skeleton_of_any_robot_ends_at_its_tip(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots())
    q = data.draw(strategies.configurations(robot))
    segments = skeleton(robot, q)
    assert segments.shape[1:] == (2, 3)
    tip = forward_kinematics(robot, q)[:3, 3]
    nearest = np.linalg.norm(segments.reshape(-1, 3) - tip, axis=1).min(initial=np.inf)
    assert nearest < 1e-8 or not len(segments) or np.linalg.norm(tip - segments[-1, 1]) < 1e-8


def test_the_papers_arm_has_three_links() -> None:
    arm = load_robot("zhang2022")
    lengths = np.linalg.norm(np.diff(skeleton(arm, np.zeros(7)), axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(lengths, [0.668, 0.4128, 0.2552])
    assert envelope(arm, np.zeros(7)) == ()  # its links are lines


def test_the_envelope_moves_with_the_arm() -> None:
    upper, lower = envelope(two_joints(radius=0.05), [np.pi / 2, np.pi / 2])
    assert isinstance(upper, Capsule)
    assert isinstance(lower, Capsule)
    np.testing.assert_allclose([upper.a, upper.b, lower.b], [[0, 0, 0], [0, 0.6, 0], [-0.6, 0.6, 0]], atol=1e-15)
    assert upper.radius == lower.radius == 0.05


@pytest.mark.parametrize("figure_path", PATHS)
def test_what_the_hand_holds_is_in_the_picture(figure_path) -> None:
    bare = two_joints(radius=0.0)
    assert "envelope" not in texts(figure_path(moved(bare), robot=bare, scene=SCENE, start=[0, 0]))
    robot = hold(bare, Sphere((0.5, 0.0, 0.0), 0.2))  # beyond the tip, which starts at x = 1.2
    figure = drawn(figure_path(moved(robot), robot=robot, scene=SCENE, start=[0, 0]))
    ax = figure.axes[0]  # type: ignore[attr-defined]
    assert "envelope" in texts(figure)
    assert ax.get_xlim()[1] > 1.9
    filled = ax.findobj(lambda artist: type(artist).__name__.startswith("PathPatch"))
    assert len(filled) == 7  # start, five between, end


def test_poses_are_equally_far_apart_along_the_path() -> None:
    robot = two_joints()
    trajectory = Trajectory(robot, Motion(np.array([[0.0, 0.0], [1.2, 0.0]])))  # the tip runs on a circle
    angles = trajectory.sample(pose_times(trajectory, 3)).q[:, 0]
    np.testing.assert_allclose(angles, [0.3, 0.6, 0.9], atol=1e-3)


def test_the_clearance_drawn_is_the_planners_and_the_bound_the_certificates() -> None:
    robot = two_joints()
    trajectory = moved(robot)
    scene = Scene([Sphere((0.2, 0.9, 0.1), 0.15), Sphere((1.0, -0.4, 0.0), 0.1)])
    certificate = proof(trajectory, scene)
    assert certificate.holds
    ax = drawn(figure_clearance(trajectory, scene=scene, certificate=certificate, title="two")).axes[0]  # type: ignore[attr-defined]
    assert ax.get_ylabel() == "clearance [m]"
    assert ax.get_xlabel() == "time [s]"
    curves = [line for line in ax.get_lines() if len(line.get_xdata()) > 100]
    problem = Problem(robot, scene, start=[0, 0], goal=ConfigurationGoal([0.8, 0.6]))
    expected = clearance(problem, trajectory.sample(curves[0].get_xdata()).q)
    np.testing.assert_allclose(np.min([line.get_ydata() for line in curves], axis=0), expected, atol=1e-12)
    assert certificate.clearance in levels(ax)
    assert "proven for all t" in texts(ax)
    assert "obstacle 1" in texts(ax)


def test_what_is_not_proven_says_so() -> None:
    robot = two_joints()
    scene = Scene([Sphere((1.1, 0.1, 0.0), 0.1)])
    certificate = proof(moved(robot), scene)
    assert certificate.status == "fails"
    text = texts(drawn(figure_clearance(moved(robot), scene=scene, certificate=certificate)))
    assert "not proven: the certificate fails" in text
    assert "proven for all t" not in text


def test_without_obstacles_nothing_is_in_the_way_and_many_are_not_all_named() -> None:
    trajectory = moved(two_joints())
    assert "nothing is in the way" in texts(
        drawn(figure_clearance(trajectory, scene=Scene(), certificate=proof(trajectory, Scene())))
    )
    many = Scene([Sphere((2.0 + i, 0.0, 0.0), 0.1) for i in range(9)])
    text = texts(drawn(figure_clearance(trajectory, scene=many)))
    assert "obstacle 6" in text
    assert "obstacle 7" not in text
    assert "others" in text
