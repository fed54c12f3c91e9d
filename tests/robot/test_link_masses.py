"""The masses of the links, as Pinocchio reads them from the same URDF."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import RobotError
from spacearm.robot import Body, Robot
from support import srdf_text, strategies, urdf_text
from support.forward_kinematics import joint_transforms
from support.messages import assert_refused

GOOD = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'


def inertial(mass: float, com: np.ndarray, rpy: tuple[float, ...], root: np.ndarray) -> str:
    """An <inertial> whose inertia is that of a body: from a root (3, 3) of its second moments."""
    second = root @ root.T + 1e-3 * np.eye(3)
    I = np.trace(second) * np.eye(3) - second  # noqa: E741
    names = [(f"i{'xyz'[i]}{'xyz'[k]}", repr(float(I[i, k]))) for i in range(3) for k in range(i, 3)]
    moments = " ".join(f'{name}="{value}"' for name, value in names)
    place = f'<origin xyz="{" ".join(map(repr, com.tolist()))}" rpy="{" ".join(map(repr, rpy))}"/>'
    return f'<inertial>{place}<mass value="{mass!r}"/><inertia {moments}/></inertial>'


@st.composite
def inertials(draw: st.DrawFn) -> str:
    rpy = draw(st.tuples(*[strategies.ANGLES] * 3))
    root = np.array([draw(strategies.points()) for _ in range(3)])
    return inertial(draw(st.floats(0.01, 10)), draw(strategies.points()), rpy, root)


def total(robot: Robot, q: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass (3,) and inertia (3, 3) about it of all that moves, in the base frame."""
    placed = joint_transforms(robot, q)
    parts = [(body, placed[body.joint]) for body in robot.bodies if body.joint >= 0]
    mass = sum(body.mass for body, _ in parts)
    centers = [T[:3, :3] @ body.com + T[:3, 3] for body, T in parts]
    com = sum(body.mass * c for (body, _), c in zip(parts, centers, strict=True)) / mass
    inertia = np.zeros((3, 3))
    for (body, T), c in zip(parts, centers, strict=True):
        r = c - com
        inertia += T[:3, :3] @ body.inertia @ T[:3, :3].T + body.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return mass, com, inertia


@settings(max_examples=25)
@given(st.data())
def test_masses_are_read_as_pinocchio_reads_them(data: st.DataObject) -> None:
    text = data.draw(urdf_text.urdfs(max_joints=6))
    text = re.sub(r"(<link [^>]*>)", lambda found: found[0] + data.draw(inertials()), text)
    model = pin.buildModelFromXML(text)
    robot = urdf_text.loaded(text, tip="tip")
    assert len(robot.bodies) == len(robot.frames)
    q = data.draw(strategies.configurations(robot))
    filled = pin.neutral(model)
    for joint in robot.joints:
        value = joint.multiplier * q[joint.dof] + joint.offset
        there = model.joints[model.getJointId(joint.name)]
        filled[there.idx_q : there.idx_q + there.nq] = value if there.nq == 1 else (np.cos(value), np.sin(value))
    placements = model.createData()
    pin.ccrba(model, placements, filled, np.zeros(model.nv))
    mass, com, inertia = total(robot, q)
    assert mass == pytest.approx(placements.mass[0] if placements.mass[0] > 0 else placements.Ig.mass)
    np.testing.assert_allclose(com, placements.com[0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(inertia, placements.Ig.inertia, rtol=0, atol=1e-6 * np.abs(inertia).max())


def with_inertial(text: str) -> Robot:
    urdf = srdf_text.two_arms().replace('<link name="left_tool">', f'<link name="left_tool">{text}')
    urdf = urdf.replace('<link name="torso">', f'<link name="torso">{GOOD}')
    return srdf_text.loaded(urdf, tip="left_tool", self_collision="none")


def test_links_without_a_mass_have_no_body() -> None:
    (body,) = with_inertial("").bodies
    assert (body.name, body.joint, body.mass) == ("torso", -1, 2.0)
    np.testing.assert_array_equal(body.inertia, np.eye(3))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<inertial/>", "<mass value> is missing"),
        ('<inertial><mass value="heavy"/></inertial>', "<mass value> is 'heavy'"),
        ('<inertial><mass value="nan"/></inertial>', "<mass value> is 'nan'"),
        ('<inertial><mass value="-1"/></inertial>', "below 0"),
        (GOOD.replace('ixx="1"', 'ixx="1e400"'), "<inertia ixx> is '1e400'"),
        (GOOD.replace('ixx="1"', 'ixx="-1"'), "negative principal moment"),
        (GOOD.replace("<mass", '<origin xyz="1 2"/><mass'), "<origin xyz> is '1 2'"),
    ],
)
def test_a_mass_that_cannot_be_read_stops_nobody_and_is_told(text: str, reason: str) -> None:
    robot = with_inertial(text)
    assert [body.name for body in robot.bodies] == ["torso"]
    assert any("the mass of 1 link cannot be read" in note and "left_tool (" in note and reason in note for note in robot.notes)


@pytest.mark.parametrize(
    ("case", "changes"),
    [
        ("body of negative mass", {"mass": -1}),
        ("body with a skew inertia", {"inertia": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}),
        ("body with an inertia of six", {"inertia": [1, 2, 3, 4, 5, 6]}),
        ("body without a name", {"name": ""}),
        ("body on joint -2", {"joint": -2}),
    ],
)
def test_a_body_that_cannot_be_is_refused(case: str, changes: dict[str, Any]) -> None:
    fields: dict[str, Any] = {"name": "hand", "joint": 0, "mass": 1, "com": (0, 0, 0), "inertia": np.eye(3)}
    assert_refused("robot", case, RobotError, lambda: Body(**(fields | changes)))
