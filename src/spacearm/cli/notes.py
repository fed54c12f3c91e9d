"""What was assumed, on stderr: a line each."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from spacearm.robot import Robot, builtin_robots


def tell_notes(about: object, notes: Iterable[str]) -> None:
    """Print notes about a file or a robot; the same one once."""
    for note in dict.fromkeys(notes):
        print(f"spacearm: {about}: {note}", file=sys.stderr)


def tell_robot(robot: Robot) -> None:
    """Print what was assumed of a robot; of those that come with spacearm the pages tell where they are from."""
    if robot.source not in builtin_robots():
        tell_notes(f"robot '{robot.name}'", robot.notes)
