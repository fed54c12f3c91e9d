"""What is worth knowing about a robot, in a few rows."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from spacearm.core.brief import Rows, counted, listed, named, numbers

if TYPE_CHECKING:
    from spacearm.robot.model import Robot


def robot_in_short(robot: Robot) -> tuple[str, Rows]:
    """Return a headline and rows on a robot: its joints with their limits, what is kept clear, its base, what was assumed."""
    rows = [("joints", listed(robot.dof_names)), ("limits", _limits(robot)), ("kept clear", _envelope(robot))]
    rows.append(("base", _base(robot)))
    rows.append(("frames", f"{counted(len(robot.frames), 'frame')}, the end effector is {named(robot.tip)}"))
    if robot.configurations:
        rows.append(("named", listed([one.name for one in robot.configurations])))
    for note in robot.notes[:1]:
        more = f" (and {len(robot.notes) - 1} more: robot.notes)" if len(robot.notes) > 1 else ""
        rows.append(("notes", f"{note}{more}"))
    return f"Robot {named(robot.name)}: {counted(robot.dof, 'joint')}, {robot.base} base", rows


def _limits(robot: Robot) -> str:
    turning = [i for i in range(robot.dof) if not robot.is_prismatic(i)]
    sliding = [i for i in range(robot.dof) if robot.is_prismatic(i)]
    said = []
    for which, scale, unit in ((turning, math.degrees(1.0), "deg"), (sliding, 1.0, "m")):
        if which:
            lower, upper = robot.lower[which] * scale, robot.upper[which] * scale
            said.append(f"from {numbers(lower, 7)} to {numbers(upper, 7)} {unit}")
    return "; ".join(said)


def _envelope(robot: Robot) -> str:
    if not robot.shapes:
        return "nothing: it has no envelope" + (", as it is meant" if robot.collision == "none" else "")
    kinds = Counter(type(part.shape).__name__ for part in robot.shapes)
    shapes = ", ".join(f"{count:,} {kind}" for kind, count in kinds.most_common())
    links = len({part.name for part in robot.shapes})
    return f"{shapes} on {counted(links, 'link')}; {counted(len(robot.self_pairs), 'pair')} of links from each other"


def _base(robot: Robot) -> str:
    if not robot.bodies:
        return f"{robot.base}; no masses are known"
    mass, of_base = (sum(body.mass for body in robot.bodies if body.joint < 0 or not base) for base in (False, True))
    unknown = f", the mass of {counted(len(robot.unweighed), 'link')} is not known" if robot.unweighed else ""
    return f"{robot.base}; {mass:.4g} kg in all, {of_base:.4g} kg of them the base's{unknown}"
