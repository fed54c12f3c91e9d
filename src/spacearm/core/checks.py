"""Checked values: read-only arrays, finite numbers, and records that stay so when copied or pickled.

Each check takes the name the user knows the value by and the error to raise, so that one sentence serves
every room.

The border between the two kinds of checks: what comes from a file is checked by pydantic models (`strict_model`, `records`) for
its keys and types; what a constructor of ours is given, from a file or from Python, is checked here for what it means.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import numbers
import operator
from collections.abc import Callable, Iterable
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief
from spacearm.core.errors import ProblemError, RobotError, SceneError, SettingsError, SpacearmError, nearest

if TYPE_CHECKING:
    from typing_extensions import Self

Raise = Callable[[str], SpacearmError]
"""An error class: called with the sentence it gives the error to raise."""

T = TypeVar("T")

_ORTHONORMAL = 1e-14  # by which R^T R of a rotation may miss the identity by rounding, of some products too


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
    except (TypeError, ValueError, OverflowError):
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


def as_numbers(name: str, value: ArrayLike, error: Raise) -> NDArray[np.float64]:
    """Return numbers of any shape as float64; those that are so already as they are, for that is done often.

    Raises:
        error: not numbers, or NaN among them.
    """
    if type(value) is np.ndarray and value.dtype == np.float64:
        return value
    if isinstance(value, float) and value == value:
        return np.asarray(value, dtype=np.float64)
    try:
        given = np.asarray(value)
        array = given.astype(np.float64) if given.dtype.kind in "iuf" else None
    except (TypeError, ValueError, OverflowError):
        array = None
    if array is None or np.isnan(array).any():
        raise error(f"{name} is {shown(value)}, expected a number or an array of numbers")
    return array


def require_kind(name: str, value: Any, kind: type | tuple[type, ...], error: Raise, *, advice: str = "") -> None:
    """Refuse what is not of our own kind.

    Args:
        name: what the user calls the value; begins the message.
        value: to be looked at.
        kind: the class, or several.
        error: class of the error to raise.
        advice: how to make one.

    Raises:
        error: another kind.
    """
    if not isinstance(value, kind):
        names = " or ".join(one.__name__ for one in (kind if isinstance(kind, tuple) else (kind,)))
        article = "an" if names[0] in "AEIOU" else "a"
        raise error(f"{name} is {shown(value)}, expected {article} {names}{f'; {advice}' if advice else ''}")


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


def dimensions_of(value: Any) -> int:
    """Return how many axes a value has as an array; -1 for rows of several lengths, which have none."""
    try:
        return np.ndim(value)
    except ValueError:
        return -1


def as_transform(name: str, value: ArrayLike, error: Raise) -> NDArray[np.float64]:
    """Check a rigid transform, (4, 4): a rotation, a translation [m], and the last row 0 0 0 1.

    A rotation of few digits becomes the one nearest to it, so that all that is made of it turns and does not shear: 1e-9 is
    more than rounding some metres away. One that is a rotation to rounding stays as it is.

    Raises:
        error: another shape, entries that are not finite, or an upper left block that is not a rotation.
    """
    T = as_readonly(name, value, (4, 4), error)
    off, determinant = _rotation_errors(T.tobytes())
    if not (off <= 1e-9 and determinant > 0):  # nor what is no number, where entries are too large to be squared
        raise error(
            f"{name} has an upper left block that is not a rotation (R^T R is {off:.2g} off the identity, "
            f"determinant {determinant:.4g}); give an orthonormal, right-handed one"
        )
    if T[3].tolist() != [0, 0, 0, 1]:
        raise error(f"{name} has last row {T[3].tolist()}, expected [0, 0, 0, 1]")
    return T if off <= _ORTHONORMAL else _turning(T)


@lru_cache(maxsize=64)
def _rotation_errors(numbers: bytes) -> tuple[float, float]:
    """Return by how much R^T R of a transform, given by its bytes, misses the identity, and the determinant of R."""
    R = np.frombuffer(numbers, dtype=np.float64).reshape(4, 4)[:3, :3]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return float(np.abs(np.einsum("ki,kj->ij", R, R) - np.eye(3)).max()), float(np.linalg.det(R))


def _turning(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a transform with the rotation nearest to its own, which is at most 1e-9 off one: by Newton's step, twice."""
    out = T.copy()
    R = T[:3, :3]
    for _ in range(2):  # 1e-9 becomes 1e-18 by the first; the second takes that one's rounding away
        R = np.einsum("ik,kj->ij", R, 1.5 * np.eye(3) - 0.5 * np.einsum("ki,kj->ij", R, R))  # no BLAS: the same bits everywhere
    out[:3, :3] = R + 0.0
    out.setflags(write=False)
    return out


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


def as_sentences(name: str, value: Any, error: Raise) -> tuple[str, ...]:
    """Check some sentences, in a list or whatever else may be iterated over.

    Raises:
        error: anything else.
    """
    if is_a_row(value) and not isinstance(value, (str, bytes)):
        given = tuple(value)
        if all(isinstance(sentence, str) for sentence in given):
            return given
        value = given
    raise error(f"{name} is {shown(value)}, expected sentences, as in ('measured',)")


def shown(value: Any) -> str:
    """Print a wrong value in a message, on one line and cut to a readable length."""
    try:
        text = " ".join(repr(value).split()).replace("( ", "(", 1)
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


class Frozen(Brief):
    """Base of our frozen dataclasses: equal by value, hashable, printed in few lines, rebuilt through their checks by pickle.

    Dataclasses compare arrays with ``==``, which is an array and no answer; and NumPy forgets on unpickling
    that an array was read-only. Use with ``@dataclass(frozen=True, slots=True, eq=False, repr=False)``. The hash, which
    caches ask for again and again, is kept once it is known.
    """

    __slots__ = ("_hash",)

    def __new__(cls, *args: Any, **given: Any) -> Self:
        """Refuse a wrong keyword, or too many or too few values, in our own words."""
        names, positional, needed = _taken_by(cls)
        passed = set(positional[: len(args)])
        known = len(args) <= len(positional) and given.keys() <= names.keys()
        if known and needed <= passed | given.keys() and not passed & given.keys():
            return super().__new__(cls)
        raise _error_of(cls)(_wrong_arguments(cls.__name__, args, given, names, positional, needed))

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
        fields = [field for field in dataclasses.fields(self) if not field.metadata.get("stays_here")]  # type: ignore[arg-type]
        return _rebuild, (type(self), {field.name: getattr(self, field.name) for field in fields})


UNWRITTEN = {"unwritten": True}
"""Metadata of a record's field that is not written while it has its default: what was written before it came stays the same."""


def value_fields(record: Any) -> list[str]:
    """Name the fields that are a record's value: all but those that its dataclass does not compare (`compare=False`)."""
    return [field.name for field in dataclasses.fields(record) if field.compare]


@cache
def _taken_by(cls: type) -> tuple[dict[str, None], tuple[str, ...], frozenset[str]]:
    """Return the names of what a class is made of, in order, those that may be given by position, and those that must be."""
    taken = list(inspect.signature(cls.__init__).parameters.values())[1:]
    by_position = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return (
        {one.name: None for one in taken},
        tuple(one.name for one in taken if one.kind in by_position),
        frozenset(one.name for one in taken if one.default is inspect.Parameter.empty),
    )


def _wrong_arguments(
    what: str,
    args: tuple[Any, ...],
    given: dict[str, Any],
    names: dict[str, None],
    positional: tuple[str, ...],
    needed: frozenset[str],
) -> str:
    for name in given:
        if name not in names:
            other = next((word for word in _OTHER_WORDS.get(name, ()) if word in names), None)
            if other is None:
                return f"{what} has no {name!r}; {nearest(name, names)}"
            return f"{what} has no {name!r}; did you mean {other!r}? known: {', '.join(names)}"
    if len(args) > len(positional):
        known = f"expected {len(positional)} at most ({', '.join(positional)})" if positional else "expected none"
        return f"{what} is given {len(args)} values without a name, {known}; name them: {', '.join(names)}"
    twice = [name for name in positional[: len(args)] if name in given]
    if twice:
        return f"{what} is given {twice[0]!r} twice, expected it once; remove one"
    missing = [name for name in names if name in needed and name not in positional[: len(args)] and name not in given]
    them = "it" if len(missing) == 1 else "them"
    return f"{what} is made without {', '.join(map(repr, missing))}, expected {them}; known: {', '.join(names)}"


def _error_of(cls: type) -> type[SpacearmError]:
    """Return what is raised for a class of ours: its room's error."""
    room = cls.__module__.split(".")[1] if "." in cls.__module__ else ""
    if cls.__name__.endswith("Settings") or room == "swarm":
        return SettingsError
    rooms = {"geometry": SceneError, "robot": RobotError, "doctor": RobotError, "planner": ProblemError, "proof": ProblemError}
    return rooms.get(room, SpacearmError)


_OTHER_WORDS = {
    "position": ("pose", "center", "point"),
    "orientation": ("pose", "normal"),
    "transform": ("pose",),
    "T": ("pose",),
    "origin": ("pose", "center", "point"),
    "center": ("pose", "centers", "point"),
    "centre": ("center", "pose"),
    "height": ("length",),
    "dimensions": ("size", "radius"),
    "extents": ("size",),
    "half_extents": ("size",),
    "half_size": ("size",),
    "edges": ("size",),
    "start": ("a",),
    "end": ("b",),
    "p0": ("a",),
    "p1": ("b",),
    "radius": ("radii",),
    "offset": ("point",),
}
"""Words of other programs for what we call otherwise."""


def _values(record: Any) -> list[Any]:
    return [getattr(record, name) for name in value_fields(record)]


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    return bool(a == b)


def _rebuild(cls: Callable[..., T], fields: dict[str, Any]) -> T:
    return cls(**fields)
