"""What was made of the objects seen last."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
Made = TypeVar("Made")

_MOST = 4


def kept(make: Callable[[T], Made]) -> Callable[[T], Made]:
    """Keep what a function made of the last few objects, for the same object to be asked about again.

    The same, not an equal one: to compare robots or scenes takes longer than most of what is made of them.
    """
    seen: deque[tuple[T, Made]] = deque(maxlen=_MOST)  # whoever is in it is alive, so no other object is taken for it

    def made_of(given: T) -> Made:
        for one, made in list(seen):
            if one is given:
                return made
        made = make(given)
        seen.append((given, made))
        return made

    return made_of
