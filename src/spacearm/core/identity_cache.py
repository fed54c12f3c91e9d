"""Results of functions, cached by the identity of the argument."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import local
from typing import TypeVar

T = TypeVar("T")
Made = TypeVar("Made")

_MOST = 4  # results remembered for each function


def cached_by_identity(make: Callable[[T], Made]) -> Callable[[T], Made]:
    """Remember the results of a function of one argument for the objects that it was called with last.

    The same object must be passed, and not an equal one: to compare robots or scenes takes longer than most of these functions.
    """
    return _remembering(make, deque[tuple[T, Made]](maxlen=_MOST))


def cached_in_thread(make: Callable[[T], Made]) -> Callable[[T], Made]:
    """Remember results by the identity of the argument, each thread its own: results that calls change."""
    threads = local()

    def made_of(given: T) -> Made:
        if not hasattr(threads, "made_of"):
            threads.made_of = _remembering(make, deque[tuple[T, Made]](maxlen=_MOST))
        return threads.made_of(given)

    return made_of


def _remembering(make: Callable[[T], Made], seen: deque[tuple[T, Made]]) -> Callable[[T], Made]:
    # `seen` keeps its objects alive, so no new object can have the same identity.
    def made_of(given: T) -> Made:
        for one, made in list(seen):
            if one is given:
                return made
        made = make(given)
        seen.append((given, made))
        return made

    return made_of
