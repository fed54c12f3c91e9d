"""Trajectories in files, ours or anybody's: tables in CSV, and ROS's JointTrajectory in YAML or JSON (`ros_messages`).

A table's header names the columns: the time (`t_s`, `t`, `time`, `time_from_start`; `t_ms` and the like say their unit), the
joints by their names, or `q_`, `dq_` and `ddq_` before them for positions, rates and accelerations; `base_x`, `base_y`,
`base_z` [m] and `base_qw`, `base_qx`, `base_qy`, `base_qz` the base's pose in the inertial frame, `base_vx` to `base_vz` and
`base_wx` to `base_wz` its rates; `tip_x_m`, `tip_y_m`, `tip_z_m` where the end effector is. The order is free. Without a
header there are n + 1 columns: the time and the joints in the robot's order. Columns are parted by comma, semicolon, tab or
space.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_whole, shown
from spacearm.core.errors import FileFormatError, SettingsError, nearest
from spacearm.core.output import require_writable, write_out
from spacearm.core.reading import located, read_bytes
from spacearm.dynamics import Momentum
from spacearm.dynamics.base_models import Base
from spacearm.files.base_columns import (
    BASE_COLUMNS,
    TIP_COLUMNS,
    TURNING_COLUMNS,
    VELOCITY_COLUMNS,
    as_matrix,
    columns_of,
    unit_poses,
)
from spacearm.files.ros_messages import rows_of_messages
from spacearm.files.stated_columns import (
    KINDS,
    PER_SECOND,
    STILL,
    Rows,
    Series,
    TimeUnit,
    checked_unit,
    contradictions,
    doubts,
    note_beginning,
    time_column,
    whole_and_rest,
)
from spacearm.files.written_rows import rows_at, rows_of
from spacearm.motion import AnyTrajectory
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import RecordedTrajectory, require_trajectory
from spacearm.robot import Robot
from spacearm.robot.model import require_robot

Array = NDArray[np.float64]

Interpolation = Literal["linear", "cubic", "quintic"]
"""Between rows: straight lines; cubics with the file's rates; quintics with its rates and accelerations."""

_NEEDS: dict[Interpolation, int] = {"linear": 1, "cubic": 2, "quintic": 3}
_AT_REST = 1e-9
_MESSAGE = re.compile(rb"\A(?:\xef\xbb\xbf)?(?:\s|#[^\n]*\n|---[^\n]*\n)*(?:[{\[]|[A-Za-z_][\w ]*:(?:\s|$)|- )")
_SAMPLES = 201  # rows of a trajectory that is written, at least


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


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers in rows.

    Attributes:
        names: of the columns; None without a header.
        header_line: where they stand in the file, from 1; 0 without a header.
        lines: (m,) where each row stands.
        values: (m, columns), finite.
        comments: before the numbers, as they stand there.
    """

    names: tuple[str, ...] | None
    header_line: int
    lines: list[int]
    values: NDArray[np.float64]
    comments: tuple[str, ...] = ()


def read_table(path: str | os.PathLike[str], *, what: str) -> Table:
    """Read a table: columns parted by comma, semicolon, tab or space; lines that begin with # are comments.

    A header in a comment, as NumPy writes it, is taken too if it names as many columns as there are.

    Args:
        path: the file.
        what: what it should hold, for messages.

    Raises:
        FileFormatError: it is missing or no text, a row has more or fewer columns, or an entry is no finite number.
    """
    try:
        text = read_bytes(path, what=what).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path} is not text (byte {error.start} is no UTF-8), expected {what}; check the path") from None
    if not text.strip():
        raise FileFormatError(f"{path} is empty, expected {what}")
    if "\0" in text:
        raise FileFormatError(f"{path} is binary, expected {what}; check the path")
    names, header_line, comment = None, 0, None
    comments: list[str] = []
    lines: list[int] = []
    values: list[list[float]] = []
    for line, cells in _cells(path, text):
        if cells[0].startswith("#"):
            if not values and names is None:
                comment = (line, tuple(cell for cell in (cells[0][1:].strip(), *cells[1:]) if cell))
            comments.append(" ".join(cells))
            continue
        if not values and names is None:
            if comment and len(comment[1]) == len(cells):
                header_line, names = comment
            if not all(_is_number(cell) for cell in cells):
                header_line, names = line, tuple(cells)
                continue
        columns = len(names) if names else len(values[0]) if values else len(cells)
        if len(cells) != columns:
            raise FileFormatError(
                f"{path}: line {line} has {len(cells)} columns, expected {columns} as before it; correct the row"
            )
        values.append([_number(path, line, i, cell, names) for i, cell in enumerate(cells)])
        lines.append(line)
    shape = len(values), len(values[0]) if values else 0
    return Table(names, header_line, lines, np.array(values, dtype=np.float64).reshape(shape), tuple(comments))


def _cells(path: object, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each line that is not blank, stripped, with its number."""
    rows = text.splitlines()
    filled = [row for row in rows if row.strip()]
    first = next((row for row in filled if not row.lstrip().startswith("#")), filled[0])
    mark = max(",;\t", key=first.count)
    if mark not in first:
        yield from ((i, row.split()) for i, row in enumerate(rows, start=1) if row.strip())
        return
    reader = csv.reader(rows, delimiter=mark, skipinitialspace=True)
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                yield reader.line_num, [cell.strip() for cell in row]
    except csv.Error as error:
        raise FileFormatError(f"{path}: line {reader.line_num}: {error}, expected a row of numbers; correct the file") from None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _number(path: object, line: int, column: int, cell: str, names: tuple[str, ...] | None) -> float:
    where = f"{path}: line {line}: column {names[column] if names else column + 1}"
    try:
        number = float(cell) if "_" not in cell else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise FileFormatError(f"{where} is {shown(cell)}, expected a finite number; correct the row")
    return number


_SHOWN = 12


def rows_of_table(robot: Robot, table: Table, *, unit: TimeUnit | None, notes: list[str]) -> Rows:
    """Pick the columns.

    Raises:
        FileFormatError: a joint or the time is missing or there twice, or a joint moves that the robot does not have.
    """
    checked_unit(unit)
    if len(table.values) < 2:
        raise FileFormatError(f"it holds {len(table.values)} row(s) of numbers, expected two or more: a start and a goal")
    places = [f"line {line}" for line in table.lines]
    if table.names is None:
        t, state = _without_header(robot, table, unit, notes)
        return Rows(places=places, t=t, states=[state])
    columns = {name: i for i, name in enumerate(table.names)}
    if len(columns) < len(table.names):
        twice = next(name for i, name in enumerate(table.names) if columns[name] != i)
        raise FileFormatError(f"line {table.header_line}: column '{twice}' is there twice, expected each once; rename one")
    t, used = _times(table, columns, unit, notes)
    states, chosen = _states(robot, table, columns)
    used += chosen
    series = {}
    for key, names in (
        ("base", BASE_COLUMNS), ("velocity", VELOCITY_COLUMNS), ("turning", TURNING_COLUMNS), ("tip", TIP_COLUMNS)
    ):  # fmt: skip
        values = columns_of(names, columns, table.values)
        if values is not None:
            values = unit_poses(values, places) if key == "base" else values
            series[key] = Series(t=t - t[0], values=values, places=places)
            used += names
    unused = [name for name in table.names if name not in used]
    _require_no_other_joints(robot, table, columns, unused)
    if unused:
        notes.append(f"columns left alone: {', '.join(unused)}")
    said = _comments(table)
    return Rows(places=places, t=t, states=states, robot=said.get("robot"), duration=_seconds(said.get("duration")), **series)


def _without_header(robot: Robot, table: Table, unit: TimeUnit | None, notes: list[str]) -> tuple[Array, Array]:
    if table.values.shape[1] != robot.dof + 1:
        raise FileFormatError(
            f"it has {table.values.shape[1]} columns and no header, expected {robot.dof + 1}: the time and the joints "
            f"{', '.join(robot.dof_names)}; or add a header"
        )
    notes.append(f"no header: the columns are taken as time [{unit or 's'}] and {', '.join(robot.dof_names)}")
    return table.values[:, 0] / PER_SECOND[unit or "s"], table.values[:, 1:].copy()


def _times(table: Table, columns: dict[str, int], unit: TimeUnit | None, notes: list[str]) -> tuple[Array, list[str]]:
    """Return the times [s], and the columns that they are from."""
    assert table.names is not None
    found, pair = time_column(table.names), whole_and_rest(table.names)
    if found is None and pair is not None:
        if unit not in (None, "s"):
            raise FileFormatError(f"the time is in the columns {', '.join(pair)}, and time_unit is {shown(unit)}; leave it out")
        return table.values[:, columns[pair[0]]] + table.values[:, columns[pair[1]]] / 1e9, [*pair]
    if found is None:
        there = ", ".join(table.names[:_SHOWN])
        raise FileFormatError(f"line {table.header_line}: no column is the time, expected 't_s' [s]; there are {shown(there)}")
    name, said = found
    if said is not None and unit is not None and said != unit:
        raise FileFormatError(f"column '{name}' is in {said} by its name, and time_unit is {shown(unit)}, expected one of them")
    if (said or "s") != "s":
        notes.append(f"times are in {said}, as column '{name}' says")
    return table.values[:, columns[name]] / PER_SECOND[unit or said or "s"], [name]


def _states(robot: Robot, table: Table, columns: dict[str, int]) -> tuple[list[Array], list[str]]:
    """Return positions, and rates and accelerations if there are any, (m, n) each, and their columns."""
    assert table.names is not None
    states, used = [], []
    for kind in KINDS:
        chosen = [_column(columns, kind, joint, table.header_line) for joint in robot.dof_names]
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
    return states, used


def _column(columns: dict[str, int], kind: str, joint: str, line: int) -> str | None:
    """Return the name of the column that holds a joint's positions, rates or accelerations."""
    names = (f"{kind}_{joint}", joint) if kind == "q" else (f"{kind}_{joint}",)
    there = [name for name in names if name in columns]
    if len(there) > 1:
        raise FileFormatError(f"line {line}: '{there[0]}' and '{there[1]}' are both joint '{joint}', expected one; rename one")
    return there[0] if there else None


def _require_no_other_joints(robot: Robot, table: Table, columns: dict[str, int], unused: list[str]) -> None:
    """Refuse a file in which a joint moves that the robot does not have: who runs it moves that joint too."""
    for name in unused:
        for kind in KINDS:
            if not name.startswith(f"{kind}_"):
                continue
            joint = name[len(kind) + 1 :]
            if joint in robot.dof_names:
                raise FileFormatError(
                    f"column '{name}' is there without the rates before it, expected dq_ where there is ddq_; leave it out"
                )
            values = table.values[:, columns[name]]
            if np.ptp(values) > STILL or (kind != "q" and np.abs(values).max() > STILL):
                raise FileFormatError(
                    f"line {table.header_line}: column '{name}' moves a joint '{joint}', which robot '{robot.name}' does not "
                    f"have or holds still; {nearest(joint, robot.dof_names)}; leave the column out if it does not count"
                )


_COMMENT = re.compile(r"^#?\s*(robot|duration)(?:_s|\s*\[s\])?\s*[:=]\s*(.+?)\s*$", re.IGNORECASE)


def _comments(table: Table) -> dict[str, str]:
    """Return the robot's name and the duration, where comments state them."""
    found = (_COMMENT.match(comment) for comment in table.comments)
    return {match.group(1).lower(): match.group(2).strip("'\"") for match in found if match}


def _seconds(text: str | None) -> float | None:
    try:
        number = float((text or "").removesuffix("s"))
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def save_trajectory(
    trajectory: AnyTrajectory,
    path: str | os.PathLike[str],
    *,
    samples: int | None = None,
    jerk_limit: ArrayLike | None = None,
    overwrite: bool = False,
) -> tuple[str, ...]:
    """Write a trajectory as CSV: time [s], then position, rate and acceleration of every joint, and the tip's position.

    If the base floats or does not begin at the origin, its position [m] and attitude wxyz follow, in the inertial frame as the
    tip's position is. `load_trajectory` reads from it the same motion, which keeps the limits that the trajectory keeps: rows
    stand where its polynomial pieces meet, every number is written in full, and where rounding would pass a limit the motion is
    written slower by so much, mostly a billionth.

    Args:
        trajectory: to be written.
        path: of the file, a new one.
        samples: number of rows at equal steps, which may be too few to keep the limits; None: about 200 or as many as it takes,
            at equal steps if the trajectory's pieces are equal.
        jerk_limit: to be kept by what is read, too.
        overwrite: replace a file that is there.

    Returns:
        What differs from the trajectory by more than the last digits, a sentence each; mostly nothing.

    Raises:
        OutputError: the file exists already, or cannot be written.
        SettingsError: samples that are none.
    """
    require_trajectory(trajectory)
    require_writable(path, overwrite=overwrite)
    if samples is None:
        rows = rows_of(trajectory, least=_SAMPLES, jerk_limit=jerk_limit)
    else:
        count = as_whole("samples", samples, SettingsError, at_least=1, at_most=1_000_000)
        rows = rows_at(trajectory, np.linspace(0.0, trajectory.duration, count))
    names = trajectory.robot.dof_names
    kinds = ("q", "dq", "ddq")[: len(rows.states)]
    header = ["t_s", *(f"{kind}_{name}" for kind in kinds for name in names), *TIP_COLUMNS]
    columns = [rows.t, *rows.states, rows.trajectory.tip(rows.t)[:, :3, 3]]
    if trajectory.base != "fixed" or not np.array_equal(trajectory.base_start, np.eye(4)):
        header += BASE_COLUMNS
        columns += rows.trajectory.base_pose(rows.t)
    lines = [",".join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    names_line = io.StringIO()
    csv.writer(names_line, lineterminator="\n").writerow(header)  # a name may hold a comma
    write_out(path, names_line.getvalue() + "\n".join(lines) + "\n", overwrite=overwrite)
    return rows.notes
