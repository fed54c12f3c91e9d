"""Records as plain values, what JSON can hold, and back, bit for bit.

A record is one of our frozen dataclasses. Its dictionary has a key for each field that is part of its value; arrays and
tuples become lists, and an infinite number becomes null. Reading takes nothing for granted: pydantic checks the keys and the
types by a model made from the dataclass, and the record's own constructor checks what the values mean.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, TypeVar

import numpy as np

from spacearm.checks import Raise, value_fields

T = TypeVar("T")


def record_as_dict(record: Any) -> dict[str, Any]:
    """Return a record as plain values."""
    return {name: plain(getattr(record, name)) for name in value_fields(record)}


def plain(value: Any) -> Any:
    """Return a value of a record's field as plain values.

    Raises:
        TypeError: it is of a kind that no record of ours holds.
    """
    from pydantic_core import to_jsonable_python

    return to_jsonable_python(value, inf_nan_mode="null", fallback=_numbers)


def _numbers(value: Any) -> Any:
    """Return Python's own numbers for NumPy's."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"no plain value for {type(value).__name__}")


def record_from_dict(
    record: type[T], values: Any, what: str, error: Raise, *, infinite: Mapping[str, float] | None = None
) -> T:
    """Make a record of plain values.

    Args:
        record: its class.
        values: a dictionary with a key for each field; those with a default may be missing.
        what: what a message calls it, as in "joints[2]"; "" where the message names the place otherwise.
        error: class of the error to raise.
        infinite: for names of fields, which infinity null stands for in a list of numbers.

    Raises:
        error: no dictionary, an unknown or missing key, or a value of another type.
        SpacearmError: the record's own, for values that cannot be.
    """
    from pydantic import ValidationError

    from spacearm.reading import complaint

    if isinstance(values, dict) and infinite:
        values = {key: _with_infinity(value, infinite.get(key)) for key, value in values.items()}
    try:
        return _adapter(record).validate_python(values)
    except ValidationError as wrong:
        raise error(complaint(wrong, what)[1]) from None


def _with_infinity(value: Any, infinity: float | None) -> Any:
    if infinity is None or not isinstance(value, list):
        return value
    return [infinity if entry is None else entry for entry in value]


@cache
def _adapter(record: type) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(_type_of(record))


def _type_of(hint: Any) -> Any:
    """Return what pydantic is to read for a field's type: the same types, strictly, and models for records."""
    from pydantic import AfterValidator, BeforeValidator, Strict, create_model

    from spacearm.strict_model import StrictModel, a_list_of

    origin, forms = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return typing.Union[tuple(_type_of(form) for form in forms)]  # noqa: UP007  # of a list of types
    if origin is np.ndarray:
        return list[Any]  # the record's own check has the sentence
    if origin is tuple and forms[-1] is Ellipsis:
        return tuple[_type_of(forms[0]), ...]
    if origin is tuple:
        return Annotated[tuple[tuple(map(_type_of, forms))], BeforeValidator(a_list_of(len(forms)))]
    if not dataclasses.is_dataclass(hint):
        return Annotated[hint, Strict()] if hint in (str, bool, int, float) else hint
    record: Any = hint
    hints, known = typing.get_type_hints(record), value_fields(record)
    fields: Any = {
        field.name: (_type_of(hints[field.name]), ... if _is_needed(field) else None)
        for field in dataclasses.fields(record)
        if field.name in known
    }
    model = create_model(record.__name__, __base__=StrictModel, **fields)
    return Annotated[
        model, AfterValidator(lambda read: record(**{name: getattr(read, name) for name in read.model_fields_set}))
    ]


def _is_needed(field: Any) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
