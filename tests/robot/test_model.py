"""A Robot: checked, read-only, equal by value, and sure of its joint centres."""

from __future__ import annotations

import copy
import json
import pickle
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import RobotError
from spacearm.geometry import Box
from spacearm.robot import Frame, Joint, LinkCapsule, LinkShape, Robot, joint_centres, load_robot
from spacearm.robot.model import robot_as_dict, robot_from_dict
from support import strategies
from support.forward_kinematics import joint_transforms
from support.messages import assert_refused
from support.oracles.solids import from_segments
from support.small_robots import two_link

COINCIDENT = 1e-8  # [m] what is listed as one centre within 1e-9 stays together through a few rotations


def following(**changes: Any) -> Joint:
    """The elbow, moving with the shoulder."""
    fields: dict[str, Any] = {"name": "elbow", "kind": "revolute", "parent": 0, "T_parent_joint": np.eye(4)}
    return Joint(**(fields | {"dof": 0} | changes))


@given(strategies.robots())
def test_a_robot_survives_pickle_and_copy_unchanged_and_read_only(robot: Robot) -> None:
    for again in (pickle.loads(pickle.dumps(robot)), copy.deepcopy(robot), copy.copy(robot), replace(robot)):
        assert again == robot
        assert hash(again) == hash(robot)
        assert not again.lower.flags.writeable
        assert not again.joints[0].T_parent_joint.flags.writeable


def test_robots_that_differ_in_one_number_are_not_equal() -> None:
    assert two_link() == two_link()
    assert two_link() != two_link(lower=(-1, -1.5))
    assert two_link() != "two_link"


def test_arrays_are_copied_and_read_only() -> None:
    lower = np.array([-1.0, -2.0])
    robot = two_link(lower=lower)
    lower[0] = -9.0
    assert robot.lower[0] == -1.0
    with pytest.raises(ValueError, match="read-only"):
        robot.lower[0] = 0.0
    with pytest.raises(FrozenInstanceError):
        robot.name = "other"  # type: ignore[misc]


def test_a_file_of_a_robot_from_before_bases_could_float_has_a_fixed_one() -> None:
    floating = robot_as_dict(two_link(base="floating"))
    assert robot_from_dict(floating) == two_link(base="floating")
    del floating["base"]
    assert robot_from_dict(floating) == two_link()


def test_each_joint_gets_its_own_place_in_q_and_followers_share_one() -> None:
    robot = two_link()
    assert [joint.dof for joint in robot.joints] == [0, 1]
    assert (robot.dof, robot.dof_names, robot.dof_index("elbow")) == (2, ("shoulder", "elbow"), 1)
    one = dict.fromkeys(("upper", "velocity", "acceleration"), (1.0,)) | {"lower": (-1.0,)}
    robot = two_link(joints=(two_link().joints[0], following(multiplier=-1)), **one)
    assert [joint.dof for joint in robot.joints] == [0, 0]
    assert robot.dof_names == ("shoulder",)


def test_a_dof_is_named_after_the_joint_whose_value_it_is() -> None:
    follower = Joint(name="first", kind="prismatic", parent=-1, T_parent_joint=np.eye(4), dof=0, multiplier=0.5)
    one = dict.fromkeys(("upper", "velocity", "acceleration"), (1.0,)) | {"lower": (-1.0,)}
    robot = two_link(joints=(follower, following(name="second")), **one)
    assert robot.dof_names == ("second",)
    assert not robot.is_prismatic(0)


def test_the_papers_arm_has_four_joint_centres() -> None:
    robot = load_robot("zhang2022")
    centres = joint_centres(robot)
    placed = joint_transforms(robot, np.zeros(7))
    y = [0.0 if j < 0 else float((placed[j] @ [*point, 1.0])[1]) for j, point in centres]
    assert [j for j, _ in centres] == [-1, 2, 3, 6]
    np.testing.assert_allclose(y, (0, 0.668, 1.0808, 1.336), atol=1e-15)


def test_a_tip_on_a_listed_centre_is_not_listed_again() -> None:
    robot = two_link(frames=(Frame(name="hand", joint=1, T_joint_frame=np.eye(4)),))
    assert [joint for joint, _ in joint_centres(robot)] == [-1, 0]


def test_a_centre_on_a_hinges_axis_is_one_with_what_it_never_leaves() -> None:
    up = np.eye(4)
    up[2, 3] = 1.0
    first = Joint(name="a", kind="revolute", parent=-1, T_parent_joint=np.eye(4))
    second = Joint(name="b", kind="revolute", parent=0, T_parent_joint=up)
    # The tip lies 1 m down b's axis, which is a's: it never leaves a's origin.
    down = np.eye(4)
    down[2, 3] = -1.0
    robot = two_link(joints=(first, second), frames=(Frame(name="hand", joint=1, T_joint_frame=down),))
    assert [(joint, tuple(point)) for joint, point in joint_centres(robot)] == [
        (-1, (0, 0, 0)),
        (0, (0, 0, 1)),
    ]


def test_a_sliding_joint_carries_its_childs_centre_away() -> None:
    slide = Joint(name="slide", kind="prismatic", parent=-1, T_parent_joint=np.eye(4))
    turn = Joint(name="turn", kind="revolute", parent=0, T_parent_joint=np.eye(4))
    robot = two_link(joints=(slide, turn))
    assert [joint for joint, _ in joint_centres(robot)] == [-1, 0, 1]


@given(st.data())
def test_joint_centres_are_all_origins_and_the_tip_each_once(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots())
    q = data.draw(strategies.configurations(robot))
    placed = [np.eye(4), *joint_transforms(robot, q)]  # by joint + 1
    listed = [(placed[joint + 1] @ [*point, 1.0])[:3] for joint, point in joint_centres(robot)]
    origins = [(placed[j.parent + 1] @ j.T_parent_joint)[:3, 3] for j in robot.joints]
    tip = robot.frame(robot.tip)
    origins.append((placed[tip.joint + 1] @ tip.T_joint_frame)[:3, 3])
    assert 1 <= len(listed) <= len(origins)
    for origin in origins:
        assert min(np.linalg.norm(origin - point) for point in listed) <= COINCIDENT


REFUSED: dict[str, Any] = {
    "no joints": lambda: two_link(joints=()),
    "joints are one joint": lambda: two_link(joints=following()),
    "a joint is none": lambda: two_link(joints=("elbow",)),
    "name empty": lambda: two_link(name=" "),
    "unknown kind": lambda: following(kind="hinge"),
    "joint name no text": lambda: following(name=4),
    "parent no index": lambda: following(parent=0.5),
    "dof no index": lambda: following(dof=-2),
    "not a rotation": lambda: following(T_parent_joint=np.diag((1, 1, 2, 1))),
    "left-handed": lambda: following(T_parent_joint=np.diag((1, 1, -1, 1))),
    "last row": lambda: following(T_parent_joint=np.eye(4) + _row()),
    "transform of another shape": lambda: following(T_parent_joint=np.eye(3)),
    "transform with NaN": lambda: following(T_parent_joint=np.full((4, 4), np.nan)),
    "multiplier no number": lambda: following(multiplier="2"),
    "offset infinite": lambda: following(offset=np.inf),
    "capsule radius negative": lambda: LinkCapsule(name="arm", joint=0, a=(0, 0, 0), b=(0, 0, 1), radius=-0.1),
    "capsule end NaN": lambda: LinkCapsule(name="arm", joint=0, a=(0, np.nan, 0), b=(0, 0, 1), radius=0.1),
    "capsule end in a plane": lambda: LinkCapsule(name="arm", joint=0, a=(0, 0), b=(0, 0, 1), radius=0.1),
    "capsule on no joint": lambda: two_link(capsules=[LinkCapsule(name="arm", joint=2, a=(0, 0, 0), b=(0, 0, 1), radius=0.1)]),
    "frame on no joint": lambda: two_link(frames=[Frame(name="hand", joint=5, T_joint_frame=np.eye(4))]),
    "child before parent": lambda: two_link(joints=two_link().joints[::-1]),
    "joint name twice": lambda: two_link(joints=(two_link().joints[0], following(name="shoulder", dof=-1))),
    "frame name twice": lambda: two_link(frames=two_link().frames * 2),
    "unknown tip": lambda: two_link(tip="hnd"),
    "unknown frame": lambda: two_link().frame("Base"),
    "unknown dof": lambda: two_link().dof_index("elbw"),
    "dof names a number": lambda: two_link(dof_names=3),
    "notes one text": lambda: two_link(notes="a note"),
    "self pairs a number": lambda: two_link(self_pairs=3),
    "self pair a number": lambda: two_link(self_pairs=[3]),
    "self pair a set": lambda: two_link(self_pairs=[{"upper"}]),
    "self pair of lists": lambda: two_link(self_pairs=[(["upper"], "fore")]),
    "dof left out": lambda: two_link(joints=(two_link().joints[0], following(dof=2)), dof_names=("a", "b", "c")),
    "lower above upper": lambda: two_link(lower=(-1, 3)),
    "lower infinite upwards": lambda: two_link(lower=(-1, np.inf), upper=(1, np.inf)),
    "limit NaN": lambda: two_link(upper=(np.nan, 2)),
    "one limit too few": lambda: two_link(lower=(-1,)),
    "limits as text": lambda: two_link(lower=("-1", "-2")),
    "limits missing": lambda: two_link(lower=(None, -2)),
    "limits ragged": lambda: two_link(lower=((1, 2), 3)),
    "limits true": lambda: two_link(lower=(True, False)),
    "velocity zero": lambda: two_link(velocity=(1, 0)),
    "velocity infinite": lambda: two_link(velocity=(1, np.inf)),
    "acceleration negative": lambda: two_link(acceleration=(-1, 1)),
}


def _row() -> np.ndarray:
    T = np.zeros((4, 4))
    T[3, 0] = 1.0
    return T


@pytest.mark.parametrize("case", REFUSED)
def test_a_robot_that_cannot_be_is_refused(case: str) -> None:
    assert_refused("robot", case, RobotError, REFUSED[case])


def test_capsules_and_shapes_are_one_list_and_come_back_from_plain_values() -> None:
    capsule = LinkCapsule(name="arm", joint=0, a=np.zeros(3), b=np.array([0, 0, 1.0]), radius=0.1)
    line = LinkCapsule(name="line", joint=0, a=np.zeros(3), b=np.array([0, 0, 1.0]), radius=0.0)
    box = LinkShape(name="bus", joint=-1, shape=Box((1, 1, 1), rounding=0.01))
    plain = two_link()
    arm = Robot(
        name="arm",
        joints=plain.joints,
        capsules=(capsule, line),
        frames=plain.frames,
        tip=plain.tip,
        lower=plain.lower,
        upper=plain.upper,
        velocity=plain.velocity,
        acceleration=plain.acceleration,
    )
    assert arm.capsules == (capsule, line)
    mixed = replace(arm, shapes=(box, *arm.shapes))
    *around, second, last = mixed.capsules
    assert (second, last) == (capsule, line)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (500, 3))
    assert all(any(from_segments(p, one.a, one.b) <= one.radius for one in around) for p in points)
    assert replace(mixed, capsules=(line,)).shapes == (line.as_shape,)
    for robot in (arm, mixed):
        assert robot_from_dict(json.loads(json.dumps(robot_as_dict(robot)))) == robot
    assert "capsules" in robot_as_dict(arm)
    assert "shapes" in robot_as_dict(mixed)
