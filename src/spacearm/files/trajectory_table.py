"""Tables as trajectories: which column is what."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, nearest
from spacearm.core.reading import read_bytes
from spacearm.files.base_columns import BASE_COLUMNS, TIP_COLUMNS, TURNING_COLUMNS, VELOCITY_COLUMNS, columns_of, unit_poses
from spacearm.files.stated_columns import (
    KINDS,
    PER_SECOND,
    STILL,
    Rows,
    Series,
    TimeUnit,
    checked_unit,
    time_column,
    whole_and_rest,
)
from spacearm.robot import Robot

# ---- Tables of numbers as text: CSV with or without a header ---------------------------------------------------------


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


# ---- Tables as trajectories: which column is what --------------------------------------------------------------------

Array = NDArray[np.float64]

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
    return Rows(
        places=places, t=t, states=states, robot=said.get("robot"), duration=_number_table_rows(said.get("duration")), **series
    )


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


def _number_table_rows(text: str | None) -> float | None:
    try:
        number = float((text or "").removesuffix("s"))
    except ValueError:
        return None
    return number if math.isfinite(number) else None
