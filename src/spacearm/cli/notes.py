"""What was assumed, on stderr: a line each."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from spacearm.robot import Robot, builtin_robots

_LONGEST = 200  # characters of a note on a robot, of which a large one has long lists


def tell_notes(about: object, notes: Iterable[str]) -> None:
    """Print notes about a file or a robot; the same one once."""
    for note in dict.fromkeys(notes):
        print(f"spacearm: {about}: {note}", file=sys.stderr)


def tell_robot(robot: Robot, *, more: str) -> None:
    """Print what was assumed of a robot; of those that come with spacearm the pages tell where they are from.

    Args:
        robot: with notes. Of a note with a long list the beginning is printed.
        more: where the notes are in full.
    """
    if robot.source in builtin_robots():
        return
    told = [_shortened(note) for note in robot.notes]
    tell_notes(f"robot '{robot.name}'", told)
    if any(short != note for short, note in zip(told, robot.notes, strict=True)):
        print(f"spacearm: {more} has the notes in full", file=sys.stderr)


def _shortened(note: str) -> str:
    if len(note) <= _LONGEST:
        return note
    shown = note[:_LONGEST].rpartition(", ")[0] or note[:_LONGEST]
    left = note[len(shown) :].count(", ")
    return f"{shown}, ..." + (f" ({left} more)" if left > 1 else "")
