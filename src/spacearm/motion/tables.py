"""Tables of numbers as text: CSV with or without a header."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown
from spacearm.errors import FileFormatError
from spacearm.reading import read_bytes


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
