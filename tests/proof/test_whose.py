"""What a certificate is about: the problem's own joints, all pairs of links but those that it names."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import ProblemError, RobotError
from spacearm.dynamics import hold
from spacearm.files.plan_file import recheck_trajectory
from spacearm.geometry import Box, Scene, Sphere
from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory
from spacearm.motion.recorded import robot_in_order
from spacearm.motion.trajectory_values import trajectory_as_dict, trajectory_from_dict
from spacearm.planner import Problem, plan
from spacearm.proof import certify
from spacearm.proof.certificate import trajectory_digest
from spacearm.robot import Robot, load_robot
from support import srdf_text, urdf_text

ROD = urdf_text.collision('<cylinder radius="0.05" length="0.8"/>', xyz="0.5 0 0", rpy="0 1.5707963267948966 0")
BALL = urdf_text.collision('<sphere radius="0.06"/>')


def rods(count: int = 3, limit: float = 3.0, **options: Any) -> Robot:
    limits = f'lower="{-limit}" upper="{limit}" velocity="1" effort="1"'
    joints = [urdf_text.joint(f"j{i}", f"l{i}", f"l{i + 1}", xyz="1 0 0", limit=limits) for i in range(count)]
    return urdf_text.loaded(urdf_text.robot(*(urdf_text.link(f"l{i}", ROD) for i in range(count + 1)), *joints), **options)


ARM = rods(2)
TURNED = robot_in_order(ARM, [1, 0])
END = np.array([0.2, 1.5])


def motions() -> list[Any]:
    """The same joint motion of the other order's robot: as a motion, with a time law, and recorded."""
    ends = np.array([[0, 0], END[::-1]])
    law = TimeLaw.uniform()
    path = PiecewisePath.from_cubic([0, 5.0], ends)
    return [
        Trajectory(TURNED, Motion(ends)),
        Trajectory(TURNED, Motion(ends), time_law=law, duration=9.0),
        RecordedTrajectory(TURNED, path),
    ]


@pytest.mark.parametrize("index", range(3))
def test_joints_go_by_their_names(index: int) -> None:
    trajectory = motions()[index]
    problem = Problem(ARM, [Sphere((2, 2, 0), 0.1)], start=[0, 0], goal=END)
    certificate = certify(problem, trajectory, limits=("position", "velocity"))
    t = np.linspace(0, trajectory.duration, 7)
    assert np.array_equal(certificate.trajectory.sample(t).q, trajectory.sample(t).q[:, ::-1])
    assert certificate.trajectory.duration == trajectory.duration
    (note,) = certificate.notes
    assert "another order" in note
    assert note in certificate.message
    # The obstacle is where the problem's robot goes, and not where it would go with the joints taken by their places.
    there = last_rod(END)
    hit = certify(Problem(ARM, [Sphere(there, 0.05)], start=[0, 0], goal=[0, 0]), trajectory, limits=())
    assert hit.status == "fails"
    ours = certify(Problem(ARM, [Sphere(last_rod(END[::-1]), 0.05)], start=[0, 0], goal=[0, 0]), trajectory, limits=())
    assert ours.holds


def last_rod(q: np.ndarray) -> np.ndarray:
    """The middle of the last rod."""
    one, two = float(q[0]), float(q[0] + q[1])
    return np.array([1 + np.cos(one) + 0.5 * np.cos(two), np.sin(one) + 0.5 * np.sin(two), 0])


def test_the_limits_are_those_of_the_named_joints() -> None:
    narrow = replace(ARM, upper=[3, 1.0])
    certificate = certify(Problem(narrow, [], start=[0, 0], goal=[0, 0]), motions()[0])
    assert certificate.status == "fails"
    assert "'j1' may pass" in certificate.message


@pytest.mark.parametrize(
    ("names", "expected"),
    [(("j0", "elbow"), "'j1'.*'elbow'"), (("a", "b"), "'j0', 'j1'.*'a', 'b'"), (("j0", "J1"), "'j1'")],
)
def test_joints_of_other_names_are_refused(names: tuple[str, str], expected: str) -> None:
    other = replace(ARM, dof_names=names)
    with pytest.raises(ProblemError, match=expected):
        certify(Problem(ARM, [], start=[0, 0], goal=END), Trajectory(other, Motion([[0, 0], END])))


def test_a_robot_with_more_or_fewer_joints_is_refused_by_name() -> None:
    longer = rods(3)
    with pytest.raises(ProblemError, match="'j2'"):
        certify(Problem(ARM, [], start=[0, 0], goal=END), Trajectory(longer, Motion([[0, 0, 0], [0.1, 0, 0]])))
    with pytest.raises(ProblemError, match="'j2'"):
        certify(Problem(longer, [], start=[0, 0, 0], goal=[0.1, 0, 0]), Trajectory(ARM, Motion([[0, 0], END])))


def changed(**fields: Any) -> Robot:
    return replace(ARM, joints=(ARM.joints[0], replace(ARM.joints[1], **fields)))


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (changed(T_parent_joint=np.eye(4)), "'j1' stands elsewhere"),
        (changed(multiplier=-1.0), "'j1' has multiplier -1, not 1"),
        (changed(offset=0.1), "'j1' has offset 0.1, not 0"),
        (changed(kind="prismatic"), "'j1' is prismatic, not revolute"),
        (changed(parent=-1), "'j1' is carried by another one"),
        (changed(name="k1"), "has a joint '.1'"),
        (replace(ARM, joints=(replace(ARM.joints[0], dof=1), replace(ARM.joints[1], dof=0))), "goes with"),
    ],
)
def test_joints_of_the_same_names_that_are_others_are_refused(other: Robot, expected: str) -> None:
    other = replace(other, dof_names=("j0", "j1"), self_pairs=())
    trajectory = Trajectory(other, Motion([[0, 0], END]))
    with pytest.raises(ProblemError, match=expected):
        certify(Problem(ARM, [], start=[0, 0], goal=END), trajectory)
    assert certify(Problem(ARM, [], start=[0, 0], goal=END), Trajectory(ARM, trajectory.motion)).holds


def test_what_does_not_move_a_joint_may_differ() -> None:
    trajectory = Trajectory(ARM, Motion([[0, 0], END]))
    for other in (hold(ARM, Sphere((0, 0, 0), 0.01)), replace(ARM, name="b", tip="l1"), replace(ARM, velocity=[9, 9])):
        assert certify(Problem(other, [], start=[0, 0], goal=END), trajectory).notes == ()


def test_a_saved_motion_has_the_names_of_its_joints() -> None:
    for trajectory in motions():
        values = json.loads(json.dumps(trajectory_as_dict(trajectory)))
        assert values["joints"] == ["j1", "j0"]
        assert trajectory_from_dict(TURNED, values) == trajectory
        back = trajectory_from_dict(ARM, values)
        t = np.linspace(0, trajectory.duration, 5)
        assert np.allclose(back.sample(t).q, trajectory.sample(t).q[:, ::-1], rtol=0, atol=1e-15)
        assert any("another order" in note for note in back.notes)
        assert back.robot == ARM
        older = {key: value for key, value in values.items() if key != "joints"}
        assert trajectory_digest(trajectory_from_dict(TURNED, older)) == trajectory_digest(trajectory)
        with pytest.raises(ProblemError, match="'j1'"):
            trajectory_from_dict(replace(ARM, dof_names=("j0", "elbow")), values)
        with pytest.raises(ProblemError, match="joints"):
            trajectory_from_dict(ARM, {**values, "joints": "j0 j1"})


# ---- what is left out -----------------------------------------------------------------------------------------------------
FOLD = np.array([2.09, 2.09, 2.09])  # a closed triangle: the last rod lies in the first


def test_pairs_that_cannot_meet_within_the_limits_are_proven_whatever_limits_are_kept() -> None:
    robot = rods(limit=0.3)
    assert robot.self_pairs == ()
    path = PiecewisePath.from_cubic([0, 10, 20], [np.zeros(3), FOLD / 2, FOLD])
    certificate = certify(
        Problem(robot, [], start=np.zeros(3), goal=[0.1, 0, 0]), RecordedTrajectory(robot, path), limits=("velocity",)
    )
    assert certificate.status == "fails"
    assert certificate.closest is not None
    assert {certificate.closest.link, certificate.closest.other} == {"l3", "link 'l0'"}


def test_pairs_that_cannot_meet_are_part_of_the_claim_but_not_of_its_figure() -> None:
    robot = rods(limit=0.3)
    certificate = certify(
        Problem(robot, [Sphere((0, 5, 0), 0.1)], start=np.zeros(3), goal=[0.1, 0, 0]),
        Trajectory(robot, Motion([np.zeros(3), [0.2, 0.1, 0.2]])),
        clearance=0.5,
    )
    assert certificate.holds  # neighbours are 0.1 m apart, wherever the limits let them go
    assert certificate.unchecked == ()


def test_the_native_kernel_takes_no_part_in_a_certificate(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = rods(limit=0.3)
    problem = Problem(robot, [Sphere((0, 5, 0), 0.1)], start=np.zeros(3), goal=[0.1, 0, 0])
    trajectory = Trajectory(robot, Motion([np.zeros(3), [0.2, 0.1, 0.2]]))
    monkeypatch.setattr("spacearm.robot.kinematics.joint_frames", None)
    monkeypatch.setattr("spacearm.robot.kinematics.tree_model", None)
    assert certify(problem, trajectory).holds


def always_meeting() -> Robot:
    joints = [
        urdf_text.joint("j1", "base", "a", xyz="0 0 0.1", axis="0 1 0"),
        urdf_text.joint("j2", "a", "b", xyz="0 0 0.06"),
        urdf_text.joint("j3", "b", "c"),
    ]
    text = urdf_text.robot(urdf_text.link("base"), *(urdf_text.link(name, BALL) for name in "abc"), *joints)
    return srdf_text.loaded(text, srdf_text.srdf(srdf_text.disabled("a", "b"), srdf_text.disabled("b", "c")))


def test_pairs_that_nobody_allows_but_that_always_meet_are_named_in_message_and_file() -> None:
    robot = always_meeting()
    problem = Problem(robot, [], start=np.zeros(3), goal=[0.5, 0, 0])
    certificate = certify(problem, Trajectory(robot, Motion([np.zeros(3), [0.5, 0, 0]])))
    assert certificate.holds
    assert (
        "3 pairs of links not checked: 1 always in contact ('a' and 'c' overlap by 59.9 mm or more in every"
        in certificate.message
    )
    assert "a fault of the model: correct the shapes, or allow the pair in the SRDF" in certificate.message
    assert certificate.as_dict()["not_checked"]["pairs"] == [
        {"links": ["a", "b"], "reason": "allowed to touch"},
        {"links": ["a", "c"], "reason": "overlap by 59.9 mm or more in every configuration"},
        {"links": ["b", "c"], "reason": "allowed to touch"},
    ]


def test_links_without_an_envelope_are_named_in_message_and_file() -> None:
    robot = replace(rods(), solid=("l0", "l1", "l2", "l3", "camera"))
    problem = Problem(robot, [], start=np.zeros(3), goal=[0.1, 0, 0])
    certificate = certify(problem, Trajectory(robot, Motion([np.zeros(3), [0.1, 0, 0]])))
    assert "for want of an envelope: 'camera'" in certificate.message
    assert certificate.as_dict()["not_checked"]["links_without_envelope"] == ["camera"]


def test_nothing_is_proven_of_a_robot_without_an_envelope_unless_none_is_meant() -> None:
    bare = replace(rods(), shapes=(), self_pairs=(), solid=())
    motion, inside = Motion([np.zeros(3), [0.1, 0, 0]]), [Box((9, 9, 9))]
    problem = Problem(bare, inside, start=np.zeros(3), goal=[0.1, 0, 0])
    certificate = certify(problem, Trajectory(bare, motion))
    assert certificate.status == "undecided"
    assert "has no envelope" in certificate.message
    meant = replace(bare, collision="none")
    certificate = certify(Problem(meant, inside, start=np.zeros(3), goal=[0.1, 0, 0]), Trajectory(meant, motion))
    assert certificate.holds
    assert "no envelope" in certificate.message


# ---- masses of a floating base --------------------------------------------------------------------------------------------
def test_a_floating_base_is_not_proven_with_a_mass_that_nobody_knows() -> None:
    servicer = load_robot("servicer7")
    home = servicer.configuration("home")
    held = hold(servicer, Box((0.5, 0.5, 0.5)), pose=(0, 0, 0.35), touching=["link_7", "link_6", "link_5"])
    assert any("mass" in note and "held" in note for note in held.notes)
    for robot in (held, replace(servicer, bodies=servicer.bodies[:-1])):
        problem = Problem(robot, [], start=home, goal=home + 0.01)
        trajectory = Trajectory(robot, Motion([home, home + 0.01]))
        with pytest.raises(RobotError, match="cannot float"):
            plan(problem)
        for certificate in (certify(problem, trajectory), recheck_trajectory(problem, trajectory).certificate):
            assert (certificate.status, certificate.clear, certificate.base_findings) == ("undecided", False, None)
            assert "cannot float" in certificate.message

    class Scened:  # as anybody may hand it in
        robot, scene = held, Scene()

    assert "hold(..., mass=...)" in certify(Scened(), Trajectory(servicer, Motion([home, home + 0.01]))).message
    weighed = hold(servicer, Box((0.5, 0.5, 0.5)), pose=(0, 0, 0.35), touching=["link_7", "link_6", "link_5"], mass=500)
    assert (
        certify(Problem(weighed, [], start=home, goal=home), Trajectory(weighed, Motion([home, home + 0.01]))).base
        == "floating"
    )
    assert Problem(held, [], start=home, goal=home, base="fixed").base == "fixed"
