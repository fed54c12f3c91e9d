"""What spacearm raises: one base class, a leaf for each kind of wrong input.

Every message is one line that says what, the value, what was expected and what to do. A search that finds
nothing is not an error: it is a status of its result.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_SHOWN = 12  # names listed in a message before it would no longer be read
_MOST, _END = 1500, 300  # characters of a message, and of its end where it is cut
_LONGEST = 60  # characters of a name; more are nobody's name, and take long to compare


class SpacearmError(Exception):
    """Whatever spacearm raises on purpose; catch this to catch them all."""

    def __str__(self) -> str:
        # A broken file may have names of megabytes, or that command a terminal. What to do is said at the end.
        text = super().__str__()
        if not text.isprintable():
            text = "".join(c if c.isprintable() else " " if c.isspace() else repr(c)[1:-1] for c in text)
        return text if len(text) <= _MOST else f"{text[: _MOST - _END - 5]} ... {text[-_END:]}"


class RobotError(SpacearmError):
    """A robot that cannot be: its tree, its limits, its envelope, or a name it does not have."""


class SceneError(SpacearmError):
    """An obstacle or a scene that cannot be."""


class ProblemError(SpacearmError):
    """A start, a goal or a base that does not fit the robot or is not supported."""


class SettingsError(SpacearmError):
    """A setting out of its range, or one that does not exist."""


class FileFormatError(SpacearmError):
    """A file that is missing, broken, or of another format than the one expected."""


class SwarmError(SpacearmError):
    """A swarm driven out of turn, or an objective that returns what it should not."""


class OutputError(SpacearmError):
    """A result that cannot be written where it was asked to go."""


class KernelError(SpacearmError):
    """The compiled kernel is missing, or was handed what it does not take."""


for _error in (SpacearmError, *SpacearmError.__subclasses__()):
    _error.__module__ = "spacearm.errors"  # the public place; a traceback names it


def nearest(name: str, known: Iterable[str]) -> str:
    """Tell what a mistyped name may have meant: ``did you mean 'x'? known: x, y``.

    Args:
        name: what was written.
        known: the names that would have been right, in the order to list them.
    """
    names = [str(entry) for entry in known]
    if not names:
        return "none is known"
    shown = ", ".join(entry if len(entry) <= _LONGEST else f"{entry[: _LONGEST - 3]}..." for entry in names[:_SHOWN])
    if len(names) > _SHOWN:
        shown += f", ... ({len(names)} in all)"
    by_lower_case = {entry.lower(): entry for entry in reversed(names) if len(entry) <= _LONGEST}
    close = difflib.get_close_matches(str(name)[: 2 * _LONGEST].lower(), by_lower_case, n=1)
    return f"did you mean '{by_lower_case[close[0]]}'? known: {shown}" if close else f"known: {shown}"
