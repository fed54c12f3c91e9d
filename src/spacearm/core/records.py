"""Settings and records: frozen dataclasses, checked, and as plain values that JSON can hold and back, bit for bit.

A class of settings refuses unknown names with the nearest known one. A record's dictionary has a key for each field that is
part of its value; arrays and tuples become lists, and an infinite number becomes null. Reading takes nothing for granted:
pydantic checks the keys and the types by a model made from the dataclass, and the record's own constructor checks what the
values mean.
"""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np

from spacearm.core.brief import brief
from spacearm.core.checks import Raise, as_number, as_whole, shown, value_fields
from spacearm.core.errors import SettingsError, nearest

if TYPE_CHECKING:
    from typing_extensions import dataclass_transform
else:

    def dataclass_transform(**_: bool) -> Any:
        """Stand in at run time, where Python 3.10 lacks it."""
        return lambda decorator: decorator


T = TypeVar("T")


@dataclass_transform(kw_only_default=True, frozen_default=True)
def settings(cls: type[T]) -> type[T]:
    """Make a class a record of settings: a frozen, keyword-only dataclass.

    Raises:
        SettingsError: (from the class made) a keyword that is no setting; the nearest known one is named.
    """
    made: Any = dataclasses.dataclass(frozen=True, slots=True, kw_only=True, repr=False)(cls)
    made.__repr__, made.printed_whole = brief, True
    plain = made.__init__

    @functools.wraps(plain)
    def init(self: Any, *args: Any, **given: Any) -> None:
        if args:
            raise SettingsError(
                f"{made.__name__} was given {shown(args[0])} without a name, expected name=value; "
                f"known: {', '.join(setting_names(made))}"
            )
        require_settings(made, given)
        plain(self, **given)

    made.__init__ = init
    return made


def setting_names(cls: type) -> tuple[str, ...]:
    """Return the names of a record's settings, in order."""
    return tuple(field.name for field in dataclasses.fields(cls))


def require_settings(cls: type, given: Mapping[str, Any]) -> None:
    """Refuse names that are no settings of a record.

    Raises:
        SettingsError: the first such name, and the nearest known one.
    """
    for name in given:
        if name not in setting_names(cls):
            raise SettingsError(f"{cls.__name__} has no setting '{name}'; {nearest(name, setting_names(cls))}")


def as_dict(record: Any) -> dict[str, Any]:
    """Return a record's settings as plain values, nested records as dictionaries with their class's name."""
    out: dict[str, Any] = {}
    for name in setting_names(type(record)):
        value = getattr(record, name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            value = {"kind": type(value).__name__, **as_dict(value)}
        out[name] = [_plain(item) for item in value] if isinstance(value, tuple) else _plain(value)
    return out


def _plain(value: Any) -> Any:
    """Return Python's own number for NumPy's, which no file format takes."""
    return value.item() if hasattr(value, "item") and hasattr(value, "dtype") else value


def whole(name: str, value: Any, *, at_least: int, at_most: int | None = None) -> int:
    """Check a whole number and its bounds.

    Raises:
        SettingsError: anything else.
    """
    return as_whole(name, value, SettingsError, at_least=at_least, at_most=at_most)


def share(name: str, value: Any, *, above_zero: bool = False) -> float:
    """Check a number in [0, 1].

    Raises:
        SettingsError: anything else.
    """
    number = as_number(name, value, SettingsError)
    if not (number > 0 if above_zero else number >= 0) or number > 1:
        raise SettingsError(f"{name} is {number:g}, expected a share {'above 0 and' if above_zero else 'from 0'} up to 1")
    return number


def one_of(name: str, value: Any, known: tuple[str, ...]) -> str:
    """Check one of a few words.

    Raises:
        SettingsError: anything else; the nearest known word is named.
    """
    if not isinstance(value, str) or value not in known:
        raise SettingsError(f"{name} is {shown(value)}; {nearest(value if isinstance(value, str) else shown(value), known)}")
    return value


def record_as_dict(record: Any) -> dict[str, Any]:
    """Return a record as plain values, without fields that say so (`UNWRITTEN`) and have their default."""
    unwritten = {one.name: one.default for one in dataclasses.fields(record) if one.metadata.get("unwritten")}
    values = {name: getattr(record, name) for name in value_fields(record)}
    return {name: plain(value) for name, value in values.items() if not (name in unwritten and value == unwritten[name])}


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

    from spacearm.core.reading import complaint

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
    from pydantic import AfterValidator, BeforeValidator, InstanceOf, Strict, create_model

    from spacearm.core.strict_model import StrictModel, a_list_of

    origin, forms = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return typing.Union[tuple(_type_of(form) for form in forms)]  # noqa: UP007  # of a list of types
    if origin is np.ndarray:
        return list[Any]  # the record's own check has the sentence
    if origin is tuple and forms[-1] is Ellipsis:
        return tuple[_type_of(forms[0]), ...]
    if origin is tuple:
        return Annotated[tuple[tuple(map(_type_of, forms))], BeforeValidator(a_list_of(len(forms)))]
    if getattr(hint, "read_before", False):
        return InstanceOf[hint]
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
