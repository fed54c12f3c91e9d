"""Trajectories from CSV files, ours or anybody's.

A header names the columns: the time `t_s` (also `t`, `time`, `time_s`), the joints by their names, or `q_`, `dq_` and `ddq_`
before them for positions, rates and accelerations; `base_x`, `base_y`, `base_z` [m] and `base_qw`, `base_qx`, `base_qy`,
`base_qz` the base's pose in the inertial frame; the order is free and other columns are left alone. Without a header there
are n + 1 columns: the time and the joints in the robot's order. Columns are parted by comma, semicolon, tab or space.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import shown
from spacearm.errors import FileFormatError, nearest
from spacearm.momentum import Momentum
from spacearm.motion.base_columns import BASE_COLUMNS, base_poses, compared, first_pose
from spacearm.motion.on_a_base import Base
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import RecordedTrajectory
from spacearm.motion.tables import Table, read_table
from spacearm.reading import located
from spacearm.robot import Robot

Array = NDArray[np.float64]

Interpolation = Literal["linear", "cubic", "quintic"]
"""Between rows: straight lines; cubics with the file's rates; quintics with its rates and accelerations."""

_KINDS = ("q", "dq", "ddq")
_NEEDS: dict[Interpolation, int] = {"linear": 1, "cubic": 2, "quintic": 3}
_TIMES = ("t_s", "t", "time", "time_s")
_AT_REST = 1e-9
_SHOWN = 12


@dataclass(frozen=True, slots=True)
class _Rows:
    """Times (m,), positions, rates and accelerations (m, n), and the base's poses (m, 7), as far as the file has them."""

    lines: list[int]
    t: Array
    states: list[Array]
    base: Array | None = None


def load_trajectory(
    robot: Robot,
    path: str | os.PathLike[str],
    *,
    interpolation: Interpolation | None = None,
    degrees: bool = False,
    unwrap: bool = False,
    base: Base | None = None,
    base_start: ArrayLike | None = None,
    momentum: Momentum | None = None,
) -> RecordedTrajectory:
    """Read a trajectory from CSV, to certify or to draw it; see the module for the columns.

    Args:
        robot: whose joints move.
        path: of the file.
        interpolation: between rows. None: "quintic" where the file has rates and accelerations, "cubic" where it has rates,
            else "linear", as controllers of joint trajectories do. "cubic" without rates is the spline at rest at both ends.
        degrees: turning joints are in degrees, their rates and accelerations too; otherwise in radians.
        unwrap: turning joints take the short way from row to row; otherwise a jump of a turn is a turn.
        base: "fixed" or "floating"; None: as the robot says.
        base_start: (4, 4) T_w_b at the beginning [m]; None: the file's first pose of the base, else the origin.
        momentum: of base and arm, if the base floats; None: none.

    Returns:
        The trajectory, its time from 0, with `notes` on what was assumed. It may break limits.

    Raises:
        FileFormatError: the file is missing or broken, lacks a joint or the time, holds what is no number, or its times do
            not increase, or its base moves though it is fixed.
        ProblemError: a base that cannot be.
        RobotError: a floating base of a robot whose masses cannot be.
    """
    if interpolation is not None and interpolation not in _NEEDS:
        raise FileFormatError(f"interpolation is {shown(interpolation)}, expected 'linear', 'cubic' or 'quintic'")
    table = read_table(path, what="a trajectory in CSV")
    notes: list[str] = []
    with located(path):
        rows = _rows(robot, table, notes)
        _require_increasing(rows)
        turning = np.array([not robot.is_prismatic(i) for i in range(robot.dof)])
        if degrees:
            for state in rows.states:
                state[:, turning] = np.radians(state[:, turning])
        else:
            _require_radians(robot, turning, rows)
        _note_turns(robot, turning, rows, unwrap, notes)
        if interpolation is None:
            interpolation = ("linear", "cubic", "quintic")[len(rows.states) - 1]
            notes.append(f"{interpolation} between rows: the file gives {_given(rows)}")
        curve = _interpolated(rows, interpolation, notes)
        _note_ends(robot, curve, interpolation, notes)
        if base_start is None and rows.base is not None:
            base_start = first_pose(rows.base)
        read = RecordedTrajectory(robot, curve, base=base, base_start=base_start, momentum=momentum)
        if rows.base is not None:
            notes.append(compared(read, rows.t - rows.t[0], rows.base, rows.lines))
        return replace(read, notes=tuple(notes))


def _rows(robot: Robot, table: Table, notes: list[str]) -> _Rows:
    """Pick the columns."""
    if len(table.values) < 2:
        raise FileFormatError(f"it holds {len(table.values)} row(s) of numbers, expected two or more: a start and a goal")
    if table.names is None:
        if table.values.shape[1] != robot.dof + 1:
            raise FileFormatError(
                f"it has {table.values.shape[1]} columns and no header, expected {robot.dof + 1}: the time and the joints "
                f"{', '.join(robot.dof_names)}; or add a header"
            )
        notes.append(f"no header: the columns are taken as time [s] and {', '.join(robot.dof_names)}")
        return _Rows(table.lines, table.values[:, 0].copy(), [table.values[:, 1:].copy()])
    columns = {name: i for i, name in enumerate(table.names)}
    if len(columns) < len(table.names):
        twice = next(name for i, name in enumerate(table.names) if columns[name] != i)
        raise FileFormatError(f"line {table.header_line}: column '{twice}' is there twice, expected each once; rename one")
    time = next((name for wanted in _TIMES for name in table.names if name.lower() == wanted), None)
    if time is None:
        there = ", ".join(table.names[:_SHOWN])
        raise FileFormatError(f"line {table.header_line}: no column is the time, expected 't_s' [s]; there are {shown(there)}")
    used = [time]
    states = []
    for kind in _KINDS:
        chosen = [_column(columns, kind, joint) for joint in robot.dof_names]
        missing = [joint for joint, name in zip(robot.dof_names, chosen, strict=True) if name is None]
        if kind == "q" or len(missing) < robot.dof:
            if missing:
                prefix = "" if kind == "q" else f"{kind}_"
                raise FileFormatError(
                    f"line {table.header_line}: no column is named '{prefix}{missing[0]}', expected one for each joint; "
                    f"{nearest(prefix + missing[0], table.names)}"
                )
        elif missing:
            break
        names = [name for name in chosen if name is not None]
        used += names
        states.append(table.values[:, [columns[name] for name in names]])
    poses = base_poses(columns, table.values, table.lines)
    unused = [name for name in table.names if name not in used and name not in BASE_COLUMNS]
    if unused:
        notes.append(f"columns left alone: {', '.join(unused)}")
    return _Rows(table.lines, table.values[:, columns[time]].copy(), states, poses)


def _column(columns: dict[str, int], kind: str, joint: str) -> str | None:
    """Return the name of the column that holds a joint's positions, rates or accelerations."""
    names = (f"{kind}_{joint}", joint) if kind == "q" else (f"{kind}_{joint}",)
    return next((name for name in names if name in columns), None)


def _require_increasing(rows: _Rows) -> None:
    still = np.diff(rows.t) <= 0
    if still.any():
        i = int(np.argmax(still))
        raise FileFormatError(
            f"line {rows.lines[i + 1]}: time {rows.t[i + 1]:.9g} s comes after {rows.t[i]:.9g} s, expected times that "
            "increase; sort the rows and leave out what is there twice"
        )


def _require_radians(robot: Robot, turning: NDArray[np.bool_], rows: _Rows) -> None:
    q, turn = rows.states[0], 2 * np.pi
    beyond = ((q > robot.upper + turn) | (q < robot.lower - turn)) & turning
    if beyond.any():
        i, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
        raise FileFormatError(
            f"line {rows.lines[int(i)]}: joint '{robot.dof_names[int(joint)]}' is at {q[i, joint]:.6g} rad, more than a turn "
            f"beyond its limits {robot.lower[joint]:.4g} to {robot.upper[joint]:.4g}, expected radians; "
            "give degrees=True if these are degrees"
        )


def _note_turns(robot: Robot, turning: NDArray[np.bool_], rows: _Rows, unwrap: bool, notes: list[str]) -> None:
    """Take the short way if told; else say where a joint makes about a turn from row to row."""
    q = rows.states[0]
    turns = np.where(turning, np.round(np.diff(q, axis=0) / (2 * np.pi)), 0.0)
    if unwrap:
        q[1:] -= 2 * np.pi * np.cumsum(turns, axis=0)
    elif turns.any():
        for joint in np.flatnonzero(turns.any(axis=0)):
            at = int(np.argmax(turns[:, joint] != 0))
            notes.append(
                f"joint '{robot.dof_names[joint]}' turns by {q[at + 1, joint] - q[at, joint]:.4g} rad between lines "
                f"{rows.lines[at]} and {rows.lines[at + 1]}, taken literally; unwrap takes the short way"
            )


def _given(rows: _Rows) -> str:
    return ("positions only", "positions and rates", "positions, rates and accelerations")[len(rows.states) - 1]


def _interpolated(rows: _Rows, interpolation: Interpolation, notes: list[str]) -> PiecewisePath:
    if rows.t[0] != 0:
        notes.append(f"time begins at {rows.t[0]:.9g} s in the file, at 0 here")
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
