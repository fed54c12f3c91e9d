"""Certificates with a tracking error, and the widest tube that a trajectory survives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import ProblemError
from spacearm.geometry import Box, Scene, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.proof import Certificate, certify, robustness
from spacearm.robot import LinkShape
from support.dense_samples import Setting
from support.floating_arms import Adrift, lander
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames
from support.small_robots import CARRIAGE_RADIUS, slider, two_link

GAP = 0.01  # [m] between the carriage and the ball that it passes


def passing(gap: float = GAP, clearance: float = 0.0, begin: float = -1.0) -> tuple[Setting, Trajectory]:
    """A ball that slides past another one, with a gap between them."""
    robot = slider()
    ball = Sphere((0.0, 0.0, 2 * CARRIAGE_RADIUS + gap), CARRIAGE_RADIUS, name="ball")
    setting = Setting(robot, Scene([ball]), clearance=clearance)
    return setting, Trajectory(robot, Motion(np.array([(begin, 0.0), (1.0, 0.0)])))


def planar() -> tuple[Setting, Trajectory]:
    """Two links of which the hand ends beside a box."""
    robot = two_link(shapes=(LinkShape(name="hand", joint=1, shape=Box((0.2, 0.1, 0.1), pose_at(0.9))),))
    box = Box((0.2, 0.2, 0.2), pose_at(1.4, 1.4), name="box")
    setting = Setting(robot, Scene([box]), clearance=0.0)
    return setting, Trajectory(robot, Motion(np.array([(-0.8, 0.1), (0.68, 0.0)])))


def pose_at(x: float, y: float = 0.0) -> np.ndarray:
    T = np.eye(4)
    T[:2, 3] = x, y
    return T


# ---- Certificates ----------------------------------------------------------------------------------------------------


def test_a_certificate_tells_its_tracking_error() -> None:
    setting, trajectory = passing()
    exact, wide = certify(setting, trajectory), certify(setting, trajectory, tracking={"z": 0.004})
    assert exact.holds
    assert exact.tracking is None
    assert "tracking" not in exact.as_dict()
    assert wide.holds
    assert wide.tracking is not None
    np.testing.assert_array_equal(wide.tracking, [0.0, 0.004])
    assert wide.as_dict()["tracking"] == {"x": 0.0, "z": 0.004}
    assert "with a tracking error of 0.004 m ('x' 0 m) at any instant" in wide.message
    assert "velocity, acceleration are those of the trajectory itself" in wide.message
    assert (wide.clearance or 0) <= GAP - 0.004


def test_a_tracking_error_of_0_is_none() -> None:
    setting, trajectory = passing()
    exact, none = certify(setting, trajectory), certify(setting, trajectory, tracking={"all": 0.0})
    assert none.as_dict() == exact.as_dict()


def test_a_tube_that_is_too_wide_is_undecided_and_says_what_would_do() -> None:
    setting, trajectory = passing()
    certificate = certify(setting, trajectory, tracking={"z": 0.02})
    assert certificate.status == "undecided"
    assert certificate.closest is not None
    assert certificate.closest.tube == pytest.approx(0.02)
    assert "of which a tracking error of 0.02 m ('x' 0 m) may take 20 mm" in certificate.message
    assert "ask for less than 0.5 of that error" in certificate.message


def test_position_limits_hold_for_the_tube_too() -> None:
    robot = slider()
    trajectory = Trajectory(robot, Motion(np.array([(-2.999, 0.0), (0.0, 0.0)])))
    setting = Setting(robot, Scene(()), clearance=0.0)
    assert certify(setting, trajectory, tracking=0.0009).holds
    certificate = certify(setting, trajectory, tracking=0.002)
    assert certificate.status == "fails"
    assert certificate.broken_limits == ("joint 'x' may pass a position limit by 0.001 m with a tracking error of 0.002 m",)
    assert certificate.limits.position[0] == pytest.approx(-0.001)


def test_a_floating_base_takes_no_tracking_error() -> None:
    robot = lander()
    setting = Adrift(robot, Scene(()))
    trajectory = Trajectory(robot, Motion(np.outer([0.0, 0.1], np.ones(robot.dof))), base="floating")
    with pytest.raises(ProblemError, match="how far such an error turns the base is not bounded yet"):
        certify(setting, trajectory, tracking=0.001)
    assert certify(setting, trajectory, tracking=0.0).holds
    with pytest.raises(ProblemError, match="the base is floating"):
        robustness(setting, trajectory)


@pytest.mark.parametrize(("has", "held"), [(0.008, 0.0049), (0.011, 0.0079)])
def test_a_pair_near_at_the_start_is_held_to_what_it_has_in_the_tube(has: float, held: float) -> None:
    robot = slider()
    wall = Box((0.2, 2.0, 2.0), pose_at(-1.0 - CARRIAGE_RADIUS - 0.1 - has), name="cradle")
    setting = Setting(robot, Scene([wall]), clearance=0.01)
    trajectory = Trajectory(robot, Motion(np.array([(-1.0, 0.0), (1.0, 0.0)])))
    certificate = certify(setting, trajectory, tracking={"x": 0.003})
    assert certificate.holds
    (near,) = certificate.near_pairs
    assert near.held_to == pytest.approx(held, abs=1e-6)
    assert near.clearance == pytest.approx(has - 0.003, abs=1e-6)
    assert "within the tracking error at the start" in certificate.message


def test_a_pair_of_which_the_tube_takes_all_at_the_start_is_undecided() -> None:
    setting, trajectory = passing(gap=0.008, clearance=0.01, begin=0.0)
    assert certify(setting, trajectory).near_pairs
    certificate = certify(setting, trajectory, tracking={"z": 0.01})
    assert certificate.status == "undecided"
    assert "come within 8 mm, of which a tracking error of 0.01 m ('x' 0 m) may take 10 mm" in certificate.message
    assert "too close to be told from contact; ask for less than 0.8 of that error" in certificate.message
    assert certify(setting, trajectory, tracking={"z": 0.007}).holds
    exact = certify(passing(gap=0.008, clearance=0.01)[0], passing(gap=0.008, clearance=0.01)[1], tracking={"z": 0.001})
    assert exact.status == "fails"


# ---- The widest tube -------------------------------------------------------------------------------------------------


def holds(setting: Setting, trajectory: Trajectory, **options: Any) -> Certificate:
    certificate = certify(setting, trajectory, **options)
    assert certificate.holds, certificate.message
    return certificate


def test_a_slide_survives_the_gap() -> None:
    setting, trajectory = passing()
    found = robustness(setting, trajectory, joints="z")
    assert 0.985 * GAP <= found.tracking <= GAP
    assert found.together.not_proven <= 1.011 * found.tracking
    assert found.singly == (found.together,)
    assert (found.together.link, found.together.other) == ("carriage", "obstacle 'ball'")
    assert found.together.time == pytest.approx(trajectory.duration / 2, rel=0.05)
    assert "joint 'z'" in found.message
    assert holds(setting, trajectory, tracking={"z": found.tracking}).tracking is not None
    assert not certify(setting, trajectory, tracking={"z": found.together.not_proven}).holds


def test_what_is_survived_is_proven_and_next_to_what_is_not_true() -> None:
    setting, trajectory = planar()
    found = robustness(setting, trajectory, resolution=0.02)
    assert [tube.joints for tube in (found.together, *found.singly)] == [("shoulder", "elbow"), ("shoulder",), ("elbow",)]
    q = trajectory.curve.sample(np.linspace(*trajectory.curve.domain, 400))
    for tube in (found.together, *found.singly):
        errors = dict.fromkeys(tube.joints, tube.tracking)
        holds(setting, trajectory, limits=("position",), tracking=errors)
        off = np.array([errors.get(joint, 0.0) for joint in setting.robot.dof_names])
        signs = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1), (0, 0)])
        for wider, touches in ((1.0, False), (1.4, True)):
            at = (q[:, None] + wider * off * signs).reshape(-1, 2)
            least = least_distances(setting.robot, setting.scene, joint_frames(setting.robot, at)).min()
            assert (least <= 0) == touches


def test_pairs_keep_what_is_required_at_the_ends() -> None:
    robot = slider()
    wall = Box((0.2, 2.0, 2.0), pose_at(-1.0 - CARRIAGE_RADIUS - 0.1 - 0.013), name="cradle")
    setting = Setting(robot, Scene([wall]), clearance=0.01)
    trajectory = Trajectory(robot, Motion(np.array([(-1.0, 0.0), (1.0, 0.0)])))
    found = robustness(setting, trajectory, joints=["x"])
    assert 0.98 * 0.003 <= found.tracking <= 0.003
    assert found.together.limited_by == "link 'carriage' and obstacle 'cradle', of which 10 mm are required at the start"


def test_a_joints_limit_may_be_what_is_in_the_way() -> None:
    robot = slider()
    setting = Setting(robot, Scene(()), clearance=0.0)
    trajectory = Trajectory(robot, Motion(np.array([(-2.9, 0.0), (0.0, 0.0)])))
    found = robustness(setting, trajectory)
    assert 0.098 <= found.tracking <= 0.1
    assert found.together.limited_by.startswith("joint 'x' may pass a position limit")
    assert found.singly[1].tracking > 2.9
    free = robustness(setting, trajectory, limits=())
    assert free.tracking >= 1.5
    assert free.together.limited_by == ""
    assert "no wider one was looked for" in free.message


def test_a_trajectory_that_is_not_proven_has_no_tube() -> None:
    setting, trajectory = passing(gap=-0.01)
    found = robustness(setting, trajectory)
    assert (found.tracking, found.singly, found.certificate.status) == (0.0, (), "fails")
    assert found.message.startswith("not proven even without a tracking error: ")


def test_progress_is_told() -> None:
    said: list[tuple[int, int]] = []
    setting, trajectory = passing()
    robustness(setting, trajectory, resolution=0.5, progress=lambda done, total, what: said.append((done, total)))
    assert said == [(0, 3), (1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    ("arguments", "options", "said"),
    [
        ((3,), {}, "planned is 3, expected a plan, or a problem and a trajectory"),
        (passing(), {"joints": "zz"}, "joints names 'zz', which is no joint of robot 'slider'; "),
        (passing(), {"joints": []}, "joints is empty"),
        (passing(), {"joints": 3}, "joints is 3"),
        (passing(), {"resolution": 0.0}, "resolution is 0, expected"),
    ],
)
def test_wrong_questions_are_refused(arguments: tuple[Any, ...], options: dict[str, Any], said: str) -> None:
    with pytest.raises(ProblemError) as refused:
        robustness(*arguments, **options)
    assert str(refused.value).startswith(said)
