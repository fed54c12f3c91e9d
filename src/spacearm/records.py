"""Records as plain values, what JSON can hold, and back, bit for bit.

A record is one of our frozen dataclasses. Its dictionary has a key for each field that is part of its value; arrays and
tuples become lists, and an infinite number becomes null. Reading takes nothing for granted: every value is checked against
the field's type here, and against its meaning by the record itself.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from functools import cache
from typing import Any, TypeVar

import numpy as np

from spacearm.checks import Raise, shown, value_fields
from spacearm.errors import nearest

T = TypeVar("T")

_WORDS: dict[Any, tuple[type | tuple[type, ...], str]] = {
    str: (str, "text"),
    bool: (bool, "true or false"),
    int: (int, "a whole number"),
    float: ((int, float), "a number"),
}


def record_as_dict(record: Any) -> dict[str, Any]:
    """Return a record as plain values."""
    return {name: plain(getattr(record, name)) for name in value_fields(record)}


def plain(value: Any) -> Any:
    """Return a value of a record's field as plain values.

    Raises:
        TypeError: it is of a kind that no record of ours holds.
    """
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if dataclasses.is_dataclass(value):
        return record_as_dict(value)
    raise TypeError(f"no plain value for {type(value).__name__}")


def record_from_dict(
    record: type[T], values: Any, what: str, error: Raise, *, infinite: Mapping[str, float] | None = None
) -> T:
    """Make a record of plain values.

    Args:
        record: its class.
        values: a dictionary with a key for each field; those with a default may be missing.
        what: what a message calls it, as in "joints[2]".
        error: class of the error to raise.
        infinite: for names of fields, which infinity null stands for in a list of numbers.

    Raises:
        error: no dictionary, an unknown or missing key, or a value of another type.
        SpacearmError: the record's own, for values that cannot be.
    """
    if not isinstance(values, dict):
        raise error(f"{what} is {shown(values)}, expected a mapping with the keys {', '.join(_hints(record))}")
    hints = _hints(record)
    for key in values:
        if key not in hints:
            raise error(f"{what} has key {shown(key)}, which is not known; {nearest(str(key), hints)}")
    given, infinite = {}, infinite or {}
    for field in dataclasses.fields(record):  # type: ignore[arg-type]
        if field.name in values:
            value = values[field.name]
            if field.name in infinite and isinstance(value, list):
                value = [infinite[field.name] if entry is None else entry for entry in value]
            given[field.name] = _read(hints[field.name], value, f"{what}.{field.name}", error)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise error(f"{what} has no key '{field.name}', expected it; add it")
    return record(**given)


@cache
def _hints(record: type) -> dict[str, Any]:
    hints = typing.get_type_hints(record)
    return {name: hints[name] for name in value_fields(record)}


def _read(hint: Any, value: Any, what: str, error: Raise) -> Any:
    origin, forms = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in forms:
            return None
        return _read(next(form for form in forms if form is not type(None)), value, what, error)
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return record_from_dict(hint, value, what, error)
    if origin in (tuple, np.ndarray):
        if not isinstance(value, list):
            raise error(f"{what} is {shown(value)}, expected a list")
        if origin is np.ndarray:
            return value
        kinds = [forms[0]] * len(value) if forms[-1] is Ellipsis else list(forms)
        if len(kinds) != len(value):
            raise error(f"{what} is {shown(value)}, expected a list of {len(kinds)}")
        return tuple(
            _read(kind, entry, f"{what}[{i}]", error) for i, (kind, entry) in enumerate(zip(kinds, value, strict=True))
        )
    if hint in _WORDS:
        kind, word = _WORDS[hint]
        if not isinstance(value, kind) or (isinstance(value, bool) and hint is not bool):
            raise error(f"{what} is {shown(value)}, expected {word}")
    elif isinstance(value, (list, dict)):  # a word of a few
        raise error(f"{what} is {shown(value)}, expected one of {', '.join(map(str, forms))}")
    return value
