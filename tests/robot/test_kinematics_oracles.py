"""Where a Robot says its parts are, against Pinocchio: from the same numbers, and from the same URDF."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.robot import Robot, load_robot
from support import strategies, urdf_text
from support.forward_kinematics import frame_transform
from support.oracles.pinocchio_model import full_q, pinocchio_model

# Twelve products of 4x4 matrices of entries about 1 and lengths of some metres, in double precision.
ROUNDING = 1e-12
# load_urdf takes a rotation within 1e-9 of a signed permutation for one; with twelve joints over some metres.
SNAPPED = 1e-7


@given(st.data())
def test_a_robot_and_its_pinocchio_model_place_every_frame_alike(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots())
    q = data.draw(strategies.configurations(robot))
    model, frame_ids = pinocchio_model(robot)
    placements = model.createData()
    pin.framesForwardKinematics(model, placements, full_q(robot, q))
    for name, frame_id in frame_ids.items():
        T = placements.oMf[frame_id].homogeneous
        np.testing.assert_allclose(frame_transform(robot, q, name), T, rtol=0, atol=ROUNDING)


@given(st.data())
def test_a_urdf_is_read_as_pinocchio_reads_it(data: st.DataObject) -> None:
    text = data.draw(urdf_text.urdfs())
    robot = urdf_text.loaded(text, tip="tip")
    q = data.draw(strategies.configurations(robot))
    model = pin.buildModelFromXML(text)
    placements = model.createData()
    pin.framesForwardKinematics(model, placements, _pinocchio_q(model, robot, q))
    for frame in robot.frames:
        T = placements.oMf[model.getFrameId(frame.name, pin.FrameType.BODY)].homogeneous
        np.testing.assert_allclose(frame_transform(robot, q, frame.name), T, rtol=0, atol=SNAPPED)


@given(st.data())
def test_a_urdf_robot_and_its_pinocchio_model_agree_with_mimics(data: st.DataObject) -> None:
    robot = urdf_text.loaded(data.draw(urdf_text.urdfs()), tip="tip")
    q = data.draw(strategies.configurations(robot))
    model, frame_ids = pinocchio_model(robot)
    placements = model.createData()
    pin.framesForwardKinematics(model, placements, full_q(robot, q))
    T = placements.oMf[frame_ids["tip"]].homogeneous
    np.testing.assert_allclose(frame_transform(robot, q, "tip"), T, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("q", "tip"),
    [
        ((0, 0, 0, 0, 0, 0, 0), (0, 1.336, 0)),
        ((math.pi / 2, 0, 0, 0, 0, 0, 0), (-1.336, 0, 0)),
        ((0, 0, 0, math.pi / 2, 0, 0, 0), (-0.668, 0.668, 0)),
        ((0, 0, 0, 0, 0, 0, math.pi / 2), (-0.2552, 1.0808, 0)),
        ((0, math.pi / 2, 0, 0, 0, 0, 0), (0, 0, 1.336)),
        ((0, 0, 0, 0, 0, -math.pi / 2, 0), (0, 1.0808, -0.2552)),
    ],
)
def test_the_papers_arm_reaches_where_its_lengths_say(q: tuple[float, ...], tip: tuple[float, ...]) -> None:
    robot = load_robot("zhang2022")
    T = frame_transform(robot, np.array(q), robot.tip)
    np.testing.assert_allclose(T[:3, 3], tip, atol=ROUNDING)


def _pinocchio_q(model: pin.Model, robot: Robot, q: np.ndarray) -> np.ndarray:
    """Fill Pinocchio's q joint by joint, by name; a continuous joint has a cosine and a sine there."""
    filled = pin.neutral(model)
    for joint in robot.joints:
        value = joint.multiplier * q[joint.dof] + joint.offset
        there = model.joints[model.getJointId(joint.name)]
        filled[there.idx_q : there.idx_q + there.nq] = value if there.nq == 1 else (math.cos(value), math.sin(value))
    return filled
