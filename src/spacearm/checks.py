"""Checked values: read-only arrays, finite numbers, and records that stay so when copied or pickled.

Each check takes the name the user knows the value by and the error to raise, so that one sentence serves
every room.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
import operator
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.errors import SpacearmError

Raise = Callable[[str], SpacearmError]
"""An error class: called with the sentence it gives the error to raise."""

T = TypeVar("T")


def as_readonly(
    name: str,
    value: ArrayLike,
    shape: tuple[int | None, ...],
    error: Raise,
    *,
    finite: bool = True,
    advice: str = "",
) -> NDArray[np.float64]:
    """Copy numbers into a read-only float64 array of a given shape.

    Args:
        name: what the user calls the value; begins the message.
        value: numbers, array-like.
        shape: expected lengths; None where any length will do.
        error: class of the error to raise.
        finite: also refuse infinities. NaN is always refused.
        advice: what to do about a wrong shape, put at the message's end.

    Raises:
        error: not numbers, another shape, or an entry that is not finite; the entry is named.
    """
    expected = _shape_text(shape)
    ending = f"; {advice}" if advice else ""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        raise error(f"{name} has rows of different lengths, expected numbers of shape {expected}{ending}") from None
    # Kinds are asked for because NumPy would turn None into NaN, and "1" and True into 1.0, without a word.
    if given.size and given.dtype.kind not in "iuf":
        raise error(f"{name} is {shown(value)}, expected numbers of shape {expected}{ending}")
    if given.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, given.shape, strict=True)):
        raise error(f"{name} has shape {_shape_text(given.shape)}, expected {expected}{ending}")
    array = np.array(given, dtype=np.float64) + 0.0  # + 0.0 makes -0.0 into 0.0, so equal records hash alike
    bad = ~np.isfinite(array) if finite else np.isnan(array)
    if bad.any():
        index = np.unravel_index(int(np.argmax(bad)), array.shape)
        where = name + "".join(f"[{int(i)}]" for i in index)
        raise error(f"{where} is {array[index]}, expected a {'finite ' if finite else ''}number")
    array.setflags(write=False)
    return array


def as_number(
    name: str,
    value: Any,
    error: Raise,
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    unit: str = "",
) -> float:
    """Check one finite number and its bounds.

    Args:
        name: what the user calls the value; begins the message.
        value: an int or float, NumPy's included.
        error: class of the error to raise.
        above: the number must be greater.
        at_least: the number must not be less.
        at_most: the number must not be greater; give one where a huge number would break what it is used for.
        unit: for the message, as in "m".

    Raises:
        error: not a number, not finite, or out of bounds.
    """
    wanted, lowest = "a finite number", above if above is not None else at_least if at_least is not None else -math.inf
    if above is not None:
        wanted = f"a finite number above {above:g}"
    elif at_least is not None:
        wanted = f"a finite number, {at_least:g} or more"
    if at_most is not None:
        wanted = f"a number {'above' if above is not None else 'from'} {lowest:g} up to {at_most:g}"
    if unit:
        wanted += f" [{unit}]"
    scalar = value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(scalar, (bool, np.bool_)) or not isinstance(scalar, numbers.Real):
        raise error(f"{name} is {shown(value)}, expected {wanted}")
    try:
        number = float(scalar)
    except OverflowError:  # an int beyond 1e308
        number = math.inf
    low = (above is not None and number <= above) or (at_least is not None and number < at_least)
    if not math.isfinite(number) or low or (at_most is not None and number > at_most):
        raise error(f"{name} is {number:g}, expected {wanted}")
    return number + 0.0


def as_whole(name: str, value: Any, error: Raise, *, at_least: int, at_most: int | None = None, wanted: str = "") -> int:
    """Check a whole number and its bounds.

    Args:
        name: what the user calls the value; begins the message.
        value: an int, NumPy's included.
        error: class of the error to raise.
        at_least, at_most: the bounds.
        wanted: for the message, where the bounds alone would not say what is expected.

    Raises:
        error: no whole number, or out of bounds.
    """
    if not wanted:
        wanted = f"a whole number, {at_least} or more" if at_most is None else f"a whole number from {at_least} to {at_most}"
    try:
        number = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = None
    if number is None or number < at_least or (at_most is not None and number > at_most):
        raise error(f"{name} is {shown(value if number is None else number)}, expected {wanted}")
    return number


def as_floats(name: str, value: Any, error: Raise) -> NDArray[np.float64]:
    """Take numbers of any shape, as (...,) arguments are given; infinities and NaN are taken too.

    Raises:
        error: anything else.
    """
    if isinstance(value, float) or (type(value) is np.ndarray and value.dtype == np.float64):  # at once, for it is often asked
        return np.asarray(value, dtype=np.float64)
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        raise error(f"{name} has rows of different lengths, expected numbers") from None
    if given.size and given.dtype.kind not in "iuf":
        raise error(f"{name} is {shown(value)}, expected numbers")
    return given.astype(np.float64, copy=False)


def dimensions_of(value: Any) -> int:
    """Return how many axes a value has as an array; -1 for rows of several lengths, which have none."""
    try:
        return np.ndim(value)
    except ValueError:
        return -1


def as_transform(name: str, value: ArrayLike, error: Raise) -> NDArray[np.float64]:
    """Check a rigid transform, (4, 4): a rotation, a translation [m], and the last row 0 0 0 1.

    Raises:
        error: another shape, entries that are not finite, or an upper left block that is not a rotation.
    """
    T = as_readonly(name, value, (4, 4), error)
    R = T[:3, :3]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        off, determinant = float(np.abs(R.T @ R - np.eye(3)).max()), float(np.linalg.det(R))
    if not (off <= 1e-9 and determinant > 0):  # nor what is no number, where entries are too large to be squared
        raise error(
            f"{name} has an upper left block that is not a rotation (R^T R is {off:.2g} off the identity, "
            f"determinant {determinant:.4g}); give an orthonormal, right-handed one"
        )
    if not np.array_equal(T[3], (0, 0, 0, 1)):
        raise error(f"{name} has last row {T[3].tolist()}, expected [0, 0, 0, 1]")
    return T


def is_a_row(value: Any) -> bool:
    """Whether a value may be iterated over: an array of no axis is iterable by its class, but not so."""
    return isinstance(value, Iterable) and not (isinstance(value, np.ndarray) and value.ndim == 0)


def as_pose(name: str, value: ArrayLike | None, error: Raise) -> NDArray[np.float64]:
    """Check a rigid transform, (4, 4); a point (3,) is taken for one that does not turn, None for one that does nothing.

    Raises:
        error: neither.
    """
    if value is None:
        value = np.eye(4)
    elif dimensions_of(value) == 1:
        point = as_readonly(name, value, (3,), error, advice="give a transform (4, 4) or a point (3,)")
        value = np.eye(4)
        value[:3, 3] = point
    return as_transform(name, value, error)


def as_name(what: str, value: Any, error: Raise) -> str:
    """Check a name: a string that is not empty.

    Raises:
        error: anything else.
    """
    if not isinstance(value, str) or not value.strip():
        raise error(f"{what} is {shown(value)}, expected a name (a string that is not empty)")
    return value


def shown(value: Any) -> str:
    """Print a wrong value in a message, on one line and cut to a readable length."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a whole number of more than 4300 digits has none, and a stranger's object may have a broken one
        text = f"a {type(value).__name__} that cannot be printed"
    return text if len(text) <= 60 else text[:57] + "..."


def shown_error(error: Exception) -> str:
    """Print another library's exception in a message: its class and its text, once each and on one line."""
    name, text = type(error).__name__, " ".join(str(error).split())
    text = text if len(text) <= 120 else text[:117] + "..."
    return text if text.startswith(name) else f"{name}: {text}" if text else name


def _shape_text(shape: tuple[int | None, ...]) -> str:
    letters = iter("nmkl" if shape.count(None) > 1 else "n")
    lengths = [next(letters) if length is None else str(length) for length in shape]
    return f"({', '.join(lengths)}{',' if len(lengths) == 1 else ''})"


def keep(record: Any, **values: Any) -> None:
    """Give fields of a frozen record, while it is being made, their checked values."""
    for name, value in values.items():
        object.__setattr__(record, name, value)


class Frozen:
    """Base of our frozen dataclasses: equal by value, hashable, rebuilt through their checks by pickle.

    Dataclasses compare arrays with ``==``, which is an array and no answer; and NumPy forgets on unpickling
    that an array was read-only. Use with ``@dataclass(frozen=True, slots=True, eq=False)``. The hash, which caches ask for
    again and again, is kept once it is known.
    """

    __slots__ = ("_hash",)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(_same(a, b) for a, b in zip(_values(self), _values(other), strict=True))

    def __hash__(self) -> int:
        try:
            return self._hash
        except AttributeError:
            known = hash((type(self), *(v.tobytes() if isinstance(v, np.ndarray) else v for v in _values(self))))
            keep(self, _hash=known)
            return known

    def __reduce__(self) -> tuple[Any, ...]:
        names = [field.name for field in dataclasses.fields(self)]  # type: ignore[arg-type]
        return _rebuild, (type(self), dict(zip(names, _values(self), strict=True)))


def _values(record: Any) -> list[Any]:
    return [getattr(record, field.name) for field in dataclasses.fields(record)]


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    return bool(a == b)


def _rebuild(cls: Callable[..., T], fields: dict[str, Any]) -> T:
    return cls(**fields)
