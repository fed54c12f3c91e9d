"""What settings are: frozen records of plain values, whose unknown names are refused with the nearest known one."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from spacearm.checks import as_number, as_whole, shown
from spacearm.errors import SettingsError, nearest

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
    made: Any = dataclasses.dataclass(frozen=True, slots=True, kw_only=True)(cls)
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
