"""A part of a MoveIt file: a value that knows its line. ROS writes the same message in several ways; all are read."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_readonly, shown
from spacearm.errors import FileFormatError, SpacearmError, nearest
from spacearm.reading import Place, YamlFile
from spacearm.scene import pose

Array = NDArray[np.float64]
T = TypeVar("T")

XYZ, XYZW = ("x", "y", "z"), ("x", "y", "z", "w")


@dataclass(frozen=True, slots=True)
class Part:
    """A value of a YAML file, and its place there."""

    file: YamlFile
    place: Place
    value: Any

    @property
    def called(self) -> str:
        """What a message calls it: its key, with its number where it is in a list."""
        tail = self.place[-2:] if self.place and isinstance(self.place[-1], int) else self.place[-1:]
        return "".join(f"[{part}]" if isinstance(part, int) else str(part) for part in tail) or "the file"

    def error(self, sentence: str) -> FileFormatError:
        """Return a sentence about this part as an error, with file and line."""
        return FileFormatError(f"{self.file.where(self.place)}: {sentence}")

    def located(self, make: Callable[[], T]) -> T:
        """Call something, and put file and line before the message of what it raises."""
        try:
            return make()
        except SpacearmError as error:
            raise type(error)(f"{self.file.where(self.place)}: {error}") from None

    def get(self, key: str) -> Part | None:
        """Return what a key of this mapping holds; None where it is missing or null.

        Raises:
            FileFormatError: this is no mapping.
        """
        if not isinstance(self.value, dict):
            raise self.error(f"{self.called} is {shown(self.value)}, expected a mapping (key: value)")
        value = self.value.get(key)
        return None if value is None else Part(self.file, (*self.place, key), value)

    def need(self, key: str) -> Part:
        """Return what a key of this mapping holds.

        Raises:
            FileFormatError: the key is missing.
        """
        found = self.get(key)
        if found is None:
            raise self.error(f"key '{key}' is missing in {self.called}; add it")
        return found

    def deep(self, *keys: str) -> Part | None:
        """Return what keys of mappings within each other lead to; None where one is missing or null."""
        found: Part | None = self
        for key in keys:
            found = None if found is None else found.get(key)
        return found

    def require_keys(self, known: Sequence[str]) -> None:
        """Refuse keys that are not known, where to overlook one would change what is meant.

        Raises:
            FileFormatError: this is no mapping, or has another key; the nearest known one is named.
        """
        if not isinstance(self.value, dict):
            raise self.error(f"{self.called} is {shown(self.value)}, expected a mapping (key: value)")
        for key in self.value:
            if key not in known:
                place = Part(self.file, (*self.place, str(key)), None)
                raise place.error(f"key {shown(key)} is not known in {self.called}; {nearest(str(key), known)}")

    def items(self, key: str) -> list[Part]:
        """Return the entries of the list that a key of this mapping holds; none where it is missing or null.

        Raises:
            FileFormatError: it is no list.
        """
        found = self.get(key)
        return [] if found is None else list(found.entries())

    def entries(self) -> Iterator[Part]:
        """Yield the entries of this list.

        Raises:
            FileFormatError: it is no list.
        """
        if not isinstance(self.value, list):
            raise self.error(f"{self.called} is {shown(self.value)}, expected a list")
        for i, value in enumerate(self.value):
            yield Part(self.file, (*self.place, i), value)

    def text(self) -> str:
        """Return this text; a number is taken as it would be written.

        Raises:
            FileFormatError: it is no text.
        """
        if isinstance(self.value, bool) or not isinstance(self.value, (str, int, float)):
            raise self.error(f"{self.called} is {shown(self.value)}, expected text")
        return str(self.value).strip()

    def number(self) -> float:
        """Return this finite number.

        Raises:
            FileFormatError: it is none.
        """
        value = self.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(f"{self.called} is {shown(value)}, expected a number")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error(f"{self.called} is {number}, expected a finite number")
        return number

    def numbers(self, count: int | None, letters: Sequence[str] = (), *, advice: str = "") -> Array:
        """Return this row of finite numbers, (count,): a list, or a mapping by letters, as `{x: 0, y: 0, z: 1}`;
        the advice ends the message about another length.

        Raises:
            FileFormatError: it is none, or of another length.
        """
        value = self.value
        if isinstance(value, dict) and letters:
            self.require_keys(letters)
            value = [self.need(letter).number() for letter in letters]
        if not isinstance(value, list):
            as_mapping = f" or a mapping with {', '.join(letters)}" if letters else ""
            row = "a list of numbers" if count is None else f"a list of {count} number{'s' if count > 1 else ''}"
            raise self.error(f"{self.called} is {shown(value)}, expected {row}{as_mapping}")
        advice = advice or (f"give {', '.join(letters)}" if letters else "")
        return as_readonly(self.called, value, (count,), self.error, advice=advice)


def transform(position: Part | None, q_xyzw: Part | None, *, unset: bool = False) -> Array:
    """Return T (4, 4) of a position [m] and a quaternion in ROS's order, x y z w; what is missing moves nothing.

    Args:
        position, q_xyzw: parts of the file.
        unset: whether a quaternion of zeros is taken for one that nobody filled in, as MoveIt does.

    Raises:
        FileFormatError, SceneError: numbers that are none, or a quaternion of zeros.
    """
    at = np.zeros(3) if position is None else position.numbers(3, XYZ)
    if q_xyzw is None:
        return pose(at)
    x, y, z, w = q = q_xyzw.numbers(4, XYZW)
    if not q.any():
        if unset:
            return pose(at)
        raise q_xyzw.error(f"{q_xyzw.called} is [0, 0, 0, 0], expected a unit quaternion x y z w; [0, 0, 0, 1] turns nothing")
    return q_xyzw.located(lambda: pose(at, (w, x, y, z)))


def is_empty_pose(part: Part | None) -> bool:
    """Whether MoveIt takes a pose for one that nobody filled in: all its numbers are 0, or it is not there."""
    if part is None:
        return True
    at, q = part.get("position"), part.get("orientation")
    nowhere = at is None or not at.numbers(3, XYZ).any()
    return nowhere and (q is None or not q.numbers(4, XYZW).any())


def pose_of(part: Part, *, unset: bool = False) -> Array:
    """Return T (4, 4) of a ROS pose, `{position: [x, y, z], orientation: [x, y, z, w]}`.

    Raises:
        FileFormatError, SceneError: no position, or what `transform` refuses.
    """
    part.require_keys(("position", "orientation"))
    return transform(part.need("position"), part.get("orientation"), unset=unset)
