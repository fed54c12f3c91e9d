"""Trajectories from files, ours or anybody's: tables in CSV, and ROS's JointTrajectory in YAML or JSON.

A table's header names the columns: the time (`t_s`, `t`, `time`, `time_from_start`; `t_ms` and the like say their unit), the
joints by their names, or `q_`, `dq_` and `ddq_` before them for positions, rates and accelerations; `base_x`, `base_y`,
`base_z` [m] and `base_qw`, `base_qx`, `base_qy`, `base_qz` the base's pose in the inertial frame, `base_vx` to `base_vz` and
`base_wx` to `base_wz` its rates; `tip_x_m`, `tip_y_m`, `tip_z_m` where the end effector is. The order is free. Without a
header there are n + 1 columns: the time and the joints in the robot's order. Columns are parted by comma, semicolon, tab or
space. For messages see `joint_trajectory`.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError
from spacearm.core.reading import located, read_bytes
from spacearm.dynamics import Momentum
from spacearm.dynamics.base_models import Base
from spacearm.files.base_columns import as_matrix
from spacearm.files.ros_messages import rows_of_messages
from spacearm.files.stated_columns import Rows, TimeUnit, contradictions, doubts, note_beginning
from spacearm.files.trajectory_table import read_table, rows_of_table
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import RecordedTrajectory
from spacearm.robot import Robot
from spacearm.robot.model import require_robot

Array = NDArray[np.float64]

Interpolation = Literal["linear", "cubic", "quintic"]
"""Between rows: straight lines; cubics with the file's rates; quintics with its rates and accelerations."""

_NEEDS: dict[Interpolation, int] = {"linear": 1, "cubic": 2, "quintic": 3}
_AT_REST = 1e-9
_MESSAGE = re.compile(rb"\A(?:\xef\xbb\xbf)?(?:\s|#[^\n]*\n|---[^\n]*\n)*(?:[{\[]|[A-Za-z_][\w ]*:(?:\s|$)|- )")


def load_trajectory(
    robot: Robot,
    path: str | os.PathLike[str],
    *,
    interpolation: Interpolation | None = None,
    degrees: bool = False,
    unwrap: bool = False,
    time_unit: TimeUnit | None = None,
    base: Base | None = None,
    base_start: ArrayLike | None = None,
    momentum: Momentum | None = None,
) -> RecordedTrajectory:
    """Read a trajectory from CSV or from a JointTrajectory of ROS, to certify or to draw it; see the module for the columns.

    Joints are taken by their names, in whatever order the file has them. What the file states beside the joints' positions is
    compared with what these make of it: its rates, its base, its end effector, its robot's name. What differs is in the
    trajectory's `contradictions`, and its certificate fails.

    Args:
        robot: whose joints move.
        path: of the file.
        interpolation: between rows. None: "quintic" where the file has rates and accelerations, "cubic" where it has rates,
            else "linear", as controllers of joint trajectories do. "cubic" without rates is the spline at rest at both ends.
        degrees: turning joints are in degrees, their rates and accelerations too; otherwise in radians.
        unwrap: turning joints take the short way from row to row; otherwise a jump of a turn is a turn.
        time_unit: "s", "ms", "us" or "ns"; None: as the time's column says, else seconds.
        base: "fixed" or "floating"; None: as the robot says.
        base_start: (4, 4) T_w_b at the beginning [m]; None: the file's first pose of the base, else the origin.
        momentum: of base and arm, if the base floats; None: none.

    Returns:
        The trajectory, its time from 0, with `notes` on what was assumed. It may break limits.

    Raises:
        FileFormatError: the file is missing or broken, lacks a joint or the time, has a joint twice or one that moves and that
            the robot does not have, holds what is no number, its times do not increase, or its base moves though it is fixed.
        ProblemError: a base that cannot be.
        RobotError: a floating base of a robot whose masses cannot be.
    """
    require_robot(robot)
    if interpolation is not None and (not isinstance(interpolation, str) or interpolation not in _NEEDS):
        raise FileFormatError(f"interpolation is {shown(interpolation)}, expected 'linear', 'cubic' or 'quintic'")
    notes: list[str] = []
    rows = _rows(robot, path, time_unit, interpolation, notes)
    with located(path):
        _require_increasing(rows)
        turning = np.array([not robot.is_prismatic(i) for i in range(robot.dof)])
        if degrees:
            for state in rows.states:
                state[:, turning] = np.radians(state[:, turning])
            begin = {
                name: np.radians(rows.begin[name])
                for i, name in enumerate(robot.dof_names)
                if name in rows.begin and turning[i]
            }
            rows = replace(rows, begin={**rows.begin, **begin})
        else:
            _require_radians(robot, turning, rows)
        _note_turns(robot, turning, rows, unwrap, notes)
        if interpolation is None:
            interpolation = ("linear", "cubic", "quintic")[len(rows.states) - 1]
            notes.append(f"{interpolation} between rows: the file gives {_given(rows)}")
        curve = _interpolated(rows, interpolation, notes)
        _note_ends(robot, curve, interpolation, notes)
        notes += doubts(robot, rows)
        if base_start is None and rows.base is not None:
            base_start = as_matrix(rows.base.values[0])
        read = RecordedTrajectory(robot, curve, base=base, base_start=base_start, momentum=momentum)
        return replace(read, contradictions=contradictions(read, rows, notes), notes=tuple(notes))


def _rows(
    robot: Robot, path: str | os.PathLike[str], unit: TimeUnit | None, interpolation: Interpolation | None, notes: list[str]
) -> Rows:
    """Read the file, whatever it is; a joint's order does not matter where names tell."""
    what = "a trajectory in CSV, or a JointTrajectory of ROS"
    content = read_bytes(path, what=what)
    if _MESSAGE.match(content):
        return rows_of_messages(robot, path, content, unit=unit, only_positions=interpolation == "linear", notes=notes)
    table = read_table(path, what=what)
    with located(path):
        return rows_of_table(robot, table, unit=unit, notes=notes)


def _require_increasing(rows: Rows) -> None:
    still = np.diff(rows.t) <= 0
    if still.any():
        i = int(np.argmax(still))
        raise FileFormatError(
            f"{rows.places[i + 1]}: time {rows.t[i + 1]:.9g} s comes after {rows.t[i]:.9g} s, expected times that "
            "increase; sort the rows and leave out what is there twice"
        )


def _require_radians(robot: Robot, turning: NDArray[np.bool_], rows: Rows) -> None:
    q, turn = rows.states[0], 2 * np.pi
    beyond = ((q > robot.upper + turn) | (q < robot.lower - turn)) & turning
    if beyond.any():
        i, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
        raise FileFormatError(
            f"{rows.places[int(i)]}: joint '{robot.dof_names[int(joint)]}' is at {q[i, joint]:.6g} rad, more than a turn "
            f"beyond its limits {robot.lower[joint]:.4g} to {robot.upper[joint]:.4g}, expected radians; "
            "give degrees=True if these are degrees"
        )


def _note_turns(robot: Robot, turning: NDArray[np.bool_], rows: Rows, unwrap: bool, notes: list[str]) -> None:
    """Take the short way if told; else say where a joint makes about a turn from row to row."""
    q = rows.states[0]
    turns = np.where(turning, np.round(np.diff(q, axis=0) / (2 * np.pi)), 0.0)
    if unwrap:
        q[1:] -= 2 * np.pi * np.cumsum(turns, axis=0)
    elif turns.any():
        for joint in np.flatnonzero(turns.any(axis=0)):
            at = int(np.argmax(turns[:, joint] != 0))
            between = _between(rows.places[at], rows.places[at + 1])
            notes.append(
                f"joint '{robot.dof_names[joint]}' turns by {q[at + 1, joint] - q[at, joint]:.4g} rad between {between}, "
                "taken literally; unwrap takes the short way"
            )


def _between(one: str, other: str) -> str:
    what, _, number = other.rpartition(" ")
    return f"{what}s {one.rpartition(' ')[2]} and {number}" if what else f"{one} and {other}"


def _given(rows: Rows) -> str:
    return ("positions only", "positions and rates", "positions, rates and accelerations")[len(rows.states) - 1]


def _interpolated(rows: Rows, interpolation: Interpolation, notes: list[str]) -> PiecewisePath:
    note_beginning(rows, notes)
    t, states = rows.t - rows.t[0], rows.states
    if interpolation == "linear":
        return PiecewisePath.from_linear(t, states[0])
    if interpolation == "cubic":
        if len(states) == 1:
            notes.append("the file gives no rates: the cubics are those of the spline at rest at both ends")
        return PiecewisePath.from_cubic(t, *states[:2])
    if len(states) < _NEEDS[interpolation]:
        raise FileFormatError(
            f"it gives {_given(rows)}, expected columns dq_ and ddq_ for quintics; choose 'cubic' or 'linear'"
        )
    return PiecewisePath.from_quintic(t, states[0], states[1], states[2])


def _note_ends(robot: Robot, curve: PiecewisePath, interpolation: Interpolation, notes: list[str]) -> None:
    """Say if it does not begin or end at rest; lines, which never do, are told by their infinite accelerations."""
    if interpolation == "linear":
        return
    for end, speed in zip(("begins", "ends"), np.abs(curve.sample(curve.domain, 1)), strict=True):
        joint = int(np.argmax(speed / robot.velocity))
        if speed[joint] > _AT_REST * robot.velocity[joint]:
            notes.append(f"it {end} at {speed[joint]:.3g} per second of joint '{robot.dof_names[joint]}', not at rest")
