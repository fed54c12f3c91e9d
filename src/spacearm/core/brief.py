"""What is printed of a value: at most eight lines of 120 columns, made in a time that does not depend on how large it is.

A small value is printed as the call that makes it: `Sphere((0, 0, 0), 0.1)`; attributes that have their default are left out. A
larger one is shortened where it is long: arrays to their shape and first numbers, tuples to a count, values inside of values to
a few words in angle brackets. A result states what is worth knowing about it, a row each: its class has a method `_in_short`.
"""

from __future__ import annotations

import dataclasses
import math
import textwrap
from collections import Counter
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

LINES, COLUMNS = 8, 120
"""The most that is printed."""

Rows: TypeAlias = "list[tuple[str, str]]"
"""Names and what is said of them, the most important first."""

_ROOMS = 2000, 300, 120, 60, 30  # characters for a value, from the first that lets all of them fit
_WORDS, _LONGEST = 60, 200  # characters of a name, and of a text inside of a value
_DEEPEST = 3  # values inside of values that are printed as calls
_EXACT = 64  # characters up to which a row of numbers is printed exactly
_NUMBERS = 16  # of an array that are printed
_FEW = 4  # numbers of a longer one
_COUNTED = 1000  # members of a tuple whose classes are counted


class Brief:
    """Base of our values: they are printed in few lines. Use with `@dataclass(repr=False)`."""

    __slots__ = ()

    def __repr__(self) -> str:
        return brief(self)


def brief(value: Any) -> str:
    """Return what is printed of a dataclass or a named tuple."""
    said = getattr(value, "_in_short", None)
    return _as_rows(*said()) if said is not None else _as_call(value)


def call_if_short(value: Any) -> str:
    """Return the call that makes a value, shortened in nothing but long arrays and texts; "" if that takes too many lines."""
    lines = _call_lines(type(value).__name__, _arguments(value, _ROOMS[0], 0))
    return "\n".join(lines) if len(lines) <= LINES else ""


def in_short(value: Any) -> tuple[str, Rows]:
    """Return the headline and the rows of a value that has them."""
    return value._in_short()


def words(text: object, most: int = _WORDS) -> str:
    """Return a text on one line, cut, without what a terminal would take for a command."""
    given = str(text)
    shown = " ".join(given[: 4 * most].split()) if len(given) > most or not given.isprintable() else given
    if not shown.isprintable():
        shown = "".join(c if c.isprintable() else repr(c)[1:-1] for c in shown[: 4 * most])
    return shown if len(shown) <= most and len(given) <= 4 * most else shown[: most - 3] + "..."


def named(name: object) -> str:
    """Return a name in quotes, cut."""
    return f"'{words(name, 40)}'"


def counted(number: int, noun: str, several: str = "") -> str:
    """Return a number and its noun: "1 joint", "7 joints"."""
    return f"{number:,} {noun if number == 1 else several or noun + 's'}"


def listed(names: Any, most: int = 6) -> str:
    """Return the first names of some, and how many more there are."""
    given = list(names[: most + 1]) if isinstance(names, (tuple, list)) else list(names)
    shown = ", ".join(words(name, 24) for name in given[:most])
    return shown if len(names) <= most else f"{shown}, ... ({len(names):,} in all)"


def numbers(values: Any, most: int = 8) -> str:
    """Return a row of numbers, four digits each: "(0.7, 0.3, 0)"."""
    flat = np.asarray(values).ravel()
    shown = ", ".join(f"{float(value):.4g}" for value in flat[:most])
    return f"({shown}{', ...' if flat.size > most else ',' if flat.size == 1 else ''})"


# ---- As rows ---------------------------------------------------------------------------------------------------------


def _as_rows(headline: str, rows: Rows) -> str:
    """Print a headline and rows; what is long continues on the lines that are left."""
    head = f"<{words(headline, COLUMNS - 2)}"
    if len(rows) > LINES - 1:
        left = ", ".join(words(name, 24) for name, _ in rows[LINES - 2 :])
        rows = [*rows[: LINES - 2], ("also", left)]
    rows = [(words(name, 24), text) for name, text in rows]
    width = max((len(name) for name, _ in rows), default=0)
    free = LINES - 1 - len(rows)
    lines = [head]
    for name, text in rows:
        room = COLUMNS - width - 5
        wrapped = textwrap.wrap(words(text, (free + 1) * room), room, max_lines=free + 1, placeholder=" ...") or [""]
        free -= len(wrapped) - 1
        lines += [f"  {(name if i == 0 else '').ljust(width)}  {line}".rstrip() for i, line in enumerate(wrapped)]
    return "\n".join(lines) + ">"


# ---- As a call -------------------------------------------------------------------------------------------------------


def _as_call(value: Any) -> str:
    """Print a call; the values get less room until it has few enough lines."""
    lines: list[str] = []
    for room in _ROOMS:
        lines = _call_lines(type(value).__name__, _arguments(value, room, 0))
        if len(lines) <= LINES:
            return "\n".join(lines)
    return "\n".join([*lines[: LINES - 1], f"    ...)  # and {len(lines) - LINES + 1} lines more"])


def _call_lines(name: str, arguments: list[str]) -> list[str]:
    whole = f"{name}({', '.join(arguments)})"
    if len(whole) <= COLUMNS:
        return [whole]
    lines = [f"{name}("]
    for i, argument in enumerate(arguments):
        piece = argument + ("," if i < len(arguments) - 1 else ")")
        if len(lines) > 1 and len(lines[-1]) + 1 + len(piece) <= COLUMNS:
            lines[-1] += f" {piece}"
        else:
            lines += textwrap.wrap(piece, COLUMNS - 4, initial_indent="    ", subsequent_indent="        ")
    return lines


def _arguments(value: Any, room: int, depth: int) -> list[str]:
    """Return the arguments of the call that makes a value: those by position first, and none that has its default."""
    if not dataclasses.is_dataclass(value):
        return [f"{name}={_text(getattr(value, name), room, depth)}" for name in value._fields]
    arguments, by_position = [], True
    everything = depth == 0 and hasattr(type(value), "printed_whole")  # of settings the defaults are worth knowing
    for field in dataclasses.fields(value):
        if not field.repr or not hasattr(value, field.name):
            continue
        given = getattr(value, field.name)
        if not everything and _is_default(given, field):
            by_position = False
            continue
        if isinstance(given, np.ndarray) and given.shape == (4, 4):
            text = _pose(given, point=field.default is None)
        else:
            text = _text(given, room, depth)
        by_position = by_position and not field.kw_only and field.init
        arguments.append(text if by_position else f"{field.name}={text}")
    return arguments


def _is_default(given: Any, field: Any) -> bool:
    if field.default is None and isinstance(given, np.ndarray):  # a constructor that takes None puts the identity there
        return given.shape == (4, 4) and np.array_equal(given, np.eye(4))
    if field.default is not dataclasses.MISSING:
        return given is field.default or (isinstance(given, (str, int, float, tuple)) and given == field.default)
    return field.default_factory is not dataclasses.MISSING and isinstance(given, dict) and not given


def _text(value: Any, room: int, depth: int) -> str:
    """Print a value inside of another one in about as many characters as there is room for."""
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, str):
        most = min(max(room, 20), _LONGEST)
        return repr(value) if len(value) <= most and value.isprintable() else repr(words(value, most))
    if dataclasses.is_dataclass(value) or hasattr(value, "_fields"):
        return _inside(value, room, depth)
    if isinstance(value, (tuple, list, frozenset, set)):
        return _members(value, room, depth)
    if isinstance(value, Mapping):
        return _mapping(value, room, depth)
    if isinstance(value, (np.generic,)):
        value = value.item()
    text = words(repr(value), max(room, 20)) if not isinstance(value, int) or abs(value) < 10**20 else f"{float(value):.6g}"
    return text


def _inside(value: Any, room: int, depth: int) -> str:
    """Print a value inside of another one: as a call if there is room, else its class and its name."""
    if hasattr(value, "_in_short"):
        text = f"<{words(value._in_short()[0], max(room, 40) - 2)}>"
    elif depth < _DEEPEST:
        text = f"{type(value).__name__}({', '.join(_arguments(value, room, depth + 1))})"
    else:
        text = ""
    if text and len(text) <= max(room, 40):
        return text
    name = getattr(value, "name", "")
    return f"<{type(value).__name__} {named(name)}>" if isinstance(name, str) and name else f"<{type(value).__name__}>"


def _members(value: Any, room: int, depth: int) -> str:
    left, right = {"tuple": "()", "list": "[]"}.get(type(value).__name__, "{}")
    if len(value) <= _NUMBERS and depth < _DEEPEST:
        texts = [_text(item, room, depth + 1) for item in value]
        text = f"{left}{', '.join(texts)}{',' if len(texts) == 1 and left == '(' else ''}{right}"
        if len(text) <= room:
            return text
    kinds = Counter(type(item).__name__ for item, _ in zip(value, range(_COUNTED), strict=False))
    if len(value) > _COUNTED or len(kinds) > 3:
        return f"<{len(value):,} members>"
    return "<" + ", ".join(f"{count:,} {kind}" for kind, count in kinds.most_common()) + ">"


def _mapping(value: Mapping[Any, Any], room: int, depth: int) -> str:
    if len(value) <= _NUMBERS and depth < _DEEPEST:
        text = "{" + ", ".join(f"{_text(k, room, depth + 1)}: {_text(v, room, depth + 1)}" for k, v in value.items()) + "}"
        if len(text) <= room:
            return text
    keys = [key for key, _ in zip(value, range(_FEW), strict=False)]
    return f"<{len(value):,} entries: {', '.join(words(key, 24) for key in keys)}{', ...' if len(value) > _FEW else ''}>"


# ---- Arrays ----------------------------------------------------------------------------------------------------------


def _array(array: Any) -> str:
    if array.shape == (4, 4) and array[3].tolist() == [0, 0, 0, 1]:
        return _pose(array, point=False)
    if array.size <= _NUMBERS and array.dtype.kind in "iufb":
        exact = _nested(array, _number)
        return exact if len(exact) <= _EXACT else f"about {_nested(array, lambda v: f'{v:.6g}')}"
    first = ", ".join(f"{item:.4g}" if array.dtype.kind in "iuf" else words(item, 12) for item in array.ravel()[:_FEW].tolist())
    return f"<{' x '.join(map(str, array.shape))}: {first}{', ...' if array.size > _FEW else ''}>"


def _nested(array: Any, number: Any) -> str:
    if array.ndim == 0:
        return number(array.item())
    inner = [_nested(row, number) for row in array]
    return f"({', '.join(inner)}{',' if len(inner) == 1 else ''})"


def _number(value: Any) -> str:
    text = repr(value)
    return text.removesuffix(".0") if isinstance(value, float) and math.isfinite(value) else text


def _pose(T: Any, *, point: bool) -> str:
    """Print a transform: where it is, and how it turns; one that does not turn as a point, if that is what its owner takes."""
    if (T[:3, :3] == np.eye(3)).all():
        return _array(T[:3, 3]) if point else f"<at {numbers(T[:3, 3])}, not turned>"
    axis = np.array([T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]])
    size = float(np.linalg.norm(axis))
    angle = math.degrees(math.atan2(size, float(np.trace(T[:3, :3])) - 1))
    if size < 1e-6:  # half a turn, whose axis is an eigenvector
        values, vectors = np.linalg.eigh((T[:3, :3] + T[:3, :3].T) / 2)
        axis, size = vectors[:, int(np.argmax(values))], 1.0
    return f"<at {numbers(T[:3, 3])}, turned {angle:.4g} deg about {numbers(np.round(axis / size, 6) + 0.0)}>"
