"""Trajectories on a base that is not bolted down at the origin: poses, values, and files."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from spacearm.core.errors import FileFormatError, ProblemError, RobotError
from spacearm.dynamics import BaseMotion, Momentum, center_of_mass, system_mass
from spacearm.files import load_trajectory
from spacearm.files.trajectory_file import save_trajectory
from spacearm.motion import Motion, RecordedTrajectory, Trajectory, time_optimal
from spacearm.motion.trajectory_values import trajectory_as_dict, trajectory_from_dict
from spacearm.robot import Robot, forward_kinematics
from support.drawn_spacecraft import motion_of, spacecraft
from support.messages import assert_refused
from support.oracles.pinocchio_floating import floating_model, floating_q
from support.oracles.servicer import ROWS, servicer
from support.small_robots import two_link

ROBOT = servicer()
PATH = Motion([np.zeros(7), np.full(7, 0.6), ROWS[0][0]])
TUMBLING = Momentum(linear=(3.0, 1.0, -2.0), angular=(20.0, -30.0, 10.0))
START = np.array([[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, -0.25], [0.0, 0.0, 1.0, 2.0], [0.0, 0.0, 0.0, 1.0]])


def recorded(**held: Any) -> RecordedTrajectory:
    return RecordedTrajectory(ROBOT, Trajectory(ROBOT, PATH).path, **held)


MADE: dict[str, Any] = {
    "floating": lambda: Trajectory(ROBOT, PATH),
    "floating from elsewhere": lambda: Trajectory(ROBOT, PATH, base_start=START),
    "tumbling": lambda: Trajectory(ROBOT, PATH, base_start=START, momentum=TUMBLING, notes=("by hand",)),
    "time-optimal": lambda: time_optimal(ROBOT, PATH, base_start=START),
    "time-optimal, tumbling": lambda: time_optimal(ROBOT, PATH, momentum=TUMBLING),
    "fixed elsewhere": lambda: Trajectory(ROBOT, PATH, base="fixed", base_start=START),
    "fixed at the origin": lambda: Trajectory(ROBOT, PATH, base="fixed"),
    "recorded, floating": lambda: recorded(base_start=START),
    "recorded, tumbling": lambda: recorded(base_start=START, momentum=TUMBLING),
    "recorded, fixed elsewhere": lambda: recorded(base="fixed", base_start=START),
}
ALL = pytest.mark.parametrize("name", MADE)


@ALL
def test_frames_are_where_pinocchio_puts_them_on_the_base(name: str) -> None:
    trajectory, model = MADE[name](), floating_model(ROBOT)
    tip = model.addFrame(pin.Frame("tip", model.njoints - 1, pin.SE3(ROBOT.frame("tip").T_joint_frame), pin.OP_FRAME))
    data, t = model.createData(), np.linspace(-1.0, trajectory.duration + 1, 12)
    position, attitude = trajectory.base_pose(t)
    found, q = trajectory.tip(t), trajectory.sample(t).q
    for i in range(len(t)):
        pin.framesForwardKinematics(model, data, floating_q(ROBOT, position[i], attitude[i], q[i]))
        np.testing.assert_allclose(found[i], data.oMf[tip].homogeneous, rtol=0, atol=1e-13)


@ALL
def test_the_base_begins_where_it_was_put(name: str) -> None:
    trajectory = MADE[name]()
    tip = trajectory.base_start @ forward_kinematics(ROBOT, trajectory.sample(0.0).q)
    np.testing.assert_allclose(trajectory.tip(0.0), tip, rtol=0, atol=1e-14)
    np.testing.assert_allclose(trajectory.base_pose(-5.0)[0], trajectory.base_start[:3, 3], rtol=0, atol=1e-14)


@ALL
def test_the_bases_rate_is_that_of_its_pose(name: str) -> None:
    trajectory, h = MADE[name](), 1e-3
    t = np.linspace(0.02, 0.98, 15) * trajectory.duration
    (p0, q0), (p1, q1), (_, q) = trajectory.base_pose(t - h), trajectory.base_pose(t + h), trajectory.base_pose(t)
    velocity, omega = trajectory.base_rate(t)
    np.testing.assert_allclose((p1 - p0) / (2 * h), velocity, rtol=0, atol=1e-7)
    for i in range(len(t)):
        turned = pin.log3((pin.Quaternion(np.roll(q0[i], -1)).inverse() * pin.Quaternion(np.roll(q1[i], -1))).matrix())
        np.testing.assert_allclose(turned / (2 * h), omega[i], rtol=0, atol=1e-7)
    assert q.shape == (15, 4)
    for values in trajectory.base_rate([-1.0, trajectory.duration + 1.0]):
        assert not values.any()


@ALL
def test_the_centre_of_mass_moves_as_the_momentum_says(name: str) -> None:
    trajectory = MADE[name]()
    if trajectory.base == "fixed":
        assert trajectory.base_motion is None
        return
    assert isinstance(trajectory.base_motion, BaseMotion)
    assert trajectory.base_motion is trajectory.base_motion  # integrated once
    assert trajectory.base_motion.error <= 1e-9
    t = np.linspace(0, trajectory.duration, 20)
    position, attitude = trajectory.base_pose(t)
    centers = center_of_mass(ROBOT, trajectory.sample(t).q)
    turned = np.array([pin.Quaternion(np.roll(q, -1)) * c for q, c in zip(attitude, centers, strict=True)])
    at = turned + position
    np.testing.assert_allclose(at - at[0], np.outer(t, trajectory.momentum.linear) / system_mass(ROBOT), rtol=0, atol=1e-12)


@ALL
def test_it_is_a_value_that_files_and_pickles_keep_to_the_last_bit(name: str) -> None:
    trajectory = MADE[name]()
    values = json.loads(json.dumps(trajectory_as_dict(trajectory)))
    for again in (trajectory_from_dict(ROBOT, values), pickle.loads(pickle.dumps(trajectory)), replace(trajectory)):
        assert again == trajectory
        assert hash(again) == hash(trajectory)
        for a, b in zip(again.base_pose([0.1, 5.0]), trajectory.base_pose([0.1, 5.0]), strict=True):
            np.testing.assert_array_equal(a, b)
    assert ("base_start" in values) == (not np.array_equal(trajectory.base_start, np.eye(4)))
    assert ("base" in values) == (trajectory.base == "floating")
    assert trajectory != replace(trajectory, base_start=(0.0, 0.0, 9.0))


def test_a_base_on_the_same_path_does_not_know_who_recorded_it() -> None:
    """With and without momentum; over s and over time."""
    for momentum in (Momentum(), TUMBLING):
        ours = Trajectory(ROBOT, PATH, base_start=START, momentum=momentum)
        theirs = RecordedTrajectory(ROBOT, ours.path, base_start=START, momentum=momentum)
        t = np.linspace(0, ours.duration, 25)
        for a, b in zip(ours.base_pose(t), theirs.base_pose(t), strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=5e-9)


def test_what_does_not_move_in_no_time_leaves_the_base_where_it_is() -> None:
    still = Trajectory(ROBOT, Motion(np.zeros((2, 7))), base_start=START, momentum=TUMBLING)
    assert still.duration == 0
    np.testing.assert_allclose(still.base_pose([0.0, 1.0])[0], [START[:3, 3]] * 2, rtol=0, atol=1e-15)


@pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,)])
@ALL
def test_samples_keep_the_batchs_shape(name: str, shape: tuple[int, ...]) -> None:
    trajectory, t = MADE[name](), np.full(shape, 0.7)
    assert trajectory.tip(t).shape == (*shape, 4, 4)
    assert [values.shape for values in trajectory.base_pose(t)] == [(*shape, 3), (*shape, 4)]
    assert [values.shape for values in trajectory.base_rate(t)] == [(*shape, 3), (*shape, 3)]


def test_the_robot_says_how_its_base_is_held_unless_told() -> None:
    assert Trajectory(ROBOT, PATH).base == "floating"
    assert Trajectory(replace(ROBOT, base="fixed"), PATH).base == "fixed"
    assert Trajectory(replace(ROBOT, base="fixed"), PATH, base="floating").base == "floating"
    values = trajectory_as_dict(Trajectory(ROBOT, PATH, base="fixed"))
    assert trajectory_from_dict(ROBOT, values).base == "fixed"


@pytest.mark.parametrize("robot", [ROBOT, spacecraft(1), spacecraft(6)], ids=lambda robot: robot.name)
def test_a_table_holds_the_base_and_is_read_again(robot: Robot, tmp_path: Path) -> None:
    trajectory = Trajectory(robot, motion_of(robot, 5, size=1.0), base_start=START)
    path = tmp_path / "trajectory.csv"
    save_trajectory(trajectory, path)
    header = path.read_text().splitlines()[0].split(",")
    assert header[-7:] == ["base_x", "base_y", "base_z", "base_qw", "base_qx", "base_qy", "base_qz"]
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    position, attitude = trajectory.base_pose(table[:, 0])
    np.testing.assert_allclose(table[:, -7:], np.column_stack([position, attitude]), rtol=0, atol=1e-10)
    again = load_trajectory(robot, path)
    assert again.base == "floating"
    t = np.linspace(0, trajectory.duration, 7)
    np.testing.assert_allclose(again.tip(t), trajectory.tip(t), rtol=0, atol=1e-6)  # quintics between 201 rows
    assert any("conservation of momentum" in note for note in again.notes)


def test_a_table_of_a_base_fixed_elsewhere_is_read_where_it_is(tmp_path: Path) -> None:
    path = tmp_path / "trajectory.csv"
    trajectory = Trajectory(ROBOT, PATH, base="fixed", base_start=START)
    save_trajectory(trajectory, path)
    again = load_trajectory(ROBOT, path, base="fixed")
    np.testing.assert_allclose(again.base_start, START, rtol=0, atol=1e-12)
    moved = load_trajectory(ROBOT, path, base="floating", base_start=np.eye(4))
    np.testing.assert_array_equal(moved.base_start, np.eye(4))


def _table(tmp_path: Path, *, drop: str = "", scale: float = 1.0) -> Path:
    path = tmp_path / "trajectory.csv"
    path.unlink(missing_ok=True)
    save_trajectory(Trajectory(ROBOT, PATH), path, samples=5)
    rows = [row.split(",") for row in path.read_text().splitlines()]
    for row in rows[1:]:
        row[-4:] = [repr(float(cell) * scale) for cell in row[-4:]]
    if drop:
        keep = [i for i, name in enumerate(rows[0]) if name != drop]
        rows = [[row[i] for i in keep] for row in rows]
    path.write_text("\n".join(",".join(row) for row in rows) + "\n")
    return path


def test_tables_whose_base_cannot_be_are_refused(tmp_path: Path) -> None:
    cases: dict[str, Any] = {
        "table: a fixed base moves": lambda: load_trajectory(ROBOT, _table(tmp_path), base="fixed"),
        "table: part of a pose": lambda: load_trajectory(ROBOT, _table(tmp_path, drop="base_qy")),
        "table: no unit quaternion": lambda: load_trajectory(ROBOT, _table(tmp_path, scale=2.0)),
    }
    for case, call in cases.items():
        assert_refused("motion", case, FileFormatError, call, path=tmp_path / "trajectory.csv")


def test_a_robot_without_masses_cannot_float() -> None:
    assert_refused(
        "motion",
        "floating without masses",
        RobotError,
        lambda: Trajectory(two_link(), Motion(np.zeros((2, 2))), base="floating"),
    )


def test_plain_values_of_a_base_that_cannot_be_are_refused() -> None:
    values = trajectory_as_dict(MADE["tumbling"]())
    for case, change in {
        "plain: base mistyped": {"base": "loose"},
        "plain: base_start short": {"base_start": [[1.0, 0.0], [0.0, 1.0]]},
        "plain: momentum of two": {"momentum": {"linear": [0.0, 1.0], "angular": [0.0, 0.0, 0.0]}},
        "plain: momentum mistyped": {"momentum": {"lineal": [0.0, 1.0, 0.0]}},
        "plain: momentum and fixed": {"base": "fixed"},
    }.items():
        changed = {**values, **change}
        assert_refused("motion", case, ProblemError, lambda changed=changed: trajectory_from_dict(ROBOT, changed))
