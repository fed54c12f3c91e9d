"""The limits of each degree of freedom, from those that a file states for its joints."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import RobotError
from spacearm.robot.links import LinkJoint, Mimic

Array = NDArray[np.float64]


def joint_limits(
    moving: list[LinkJoint],
    leads: dict[str, Mimic],
    leaders: list[str],
    velocity_limit: float | None,
    acceleration_limit: float | None,
) -> tuple[Array, list[str]]:
    """Intersect, per degree of freedom, the limits of every joint it moves.

    Returns:
        Rows lower, upper, velocity, acceleration (4, n), and notes on what was assumed.
    """
    low, high, speed, push = np.array([[-math.inf], [math.inf], [math.inf], [math.inf]]).repeat(len(leaders), axis=1)
    notes = []
    for joint in moving:
        lead = leads[joint.name]
        i, m, follows = leaders.index(lead.leader), lead.multiplier, joint.mimic is not None
        lower, upper = _range(joint, follows)
        velocity = _velocity(joint, velocity_limit, follows)
        if m == 0.0:
            if not lower <= lead.offset <= upper:
                raise RobotError(
                    f"joint '{joint.name}' stays at {lead.offset:g} (its mimic multiplier is 0), expected "
                    f"{lower:g} to {upper:g}; change the offset or the limits"
                )
            continue
        ends = sorted(((lower - lead.offset) / m, (upper - lead.offset) / m))
        low[i], high[i] = max(low[i], ends[0]), min(high[i], ends[1])
        speed[i] = min(speed[i], velocity / abs(m))
        push[i] = min(push[i], math.inf if joint.acceleration is None else joint.acceleration / abs(m))
    for i, name in enumerate(leaders):
        if low[i] > high[i]:
            raise RobotError(
                f"joint '{name}' and its mimics have limits that exclude each other (from {low[i]:g} to "
                f"{high[i]:g}), expected a common range; widen one of them"
            )
    stated = push.copy()
    push = np.minimum(push, math.inf if acceleration_limit is None else acceleration_limit)
    unstated = [name for i, name in enumerate(leaders) if not np.isfinite(push[i])]
    if unstated:
        notes.append(f"no acceleration limit is stated for {', '.join(unstated)}: full speed in one second is assumed")
        push = np.where(np.isfinite(push), push, speed)
    elif acceleration_limit is not None and (stated > acceleration_limit).any():
        notes.append(f"acceleration limits were set to at most {acceleration_limit:g}")
    if velocity_limit is not None:
        notes.append(f"velocity limits were set to at most {velocity_limit:g}")
    return np.array([low, high, speed, push]), notes


def _range(joint: LinkJoint, follows: bool) -> tuple[float, float]:
    if joint.kind == "continuous" or (follows and joint.lower is None and joint.upper is None):
        return -math.inf, math.inf
    if joint.lower is None or joint.upper is None:
        missing = " and ".join(end for end in ("lower", "upper") if getattr(joint, end) is None)
        way_out = ", or make it continuous if it turns without end" if joint.kind == "revolute" else ""
        raise RobotError(f"joint '{joint.name}' ({joint.kind}) states no {missing} limit; add it{way_out}")
    if joint.upper < joint.lower:
        raise RobotError(
            f"joint '{joint.name}' has lower limit {joint.lower:g} above its upper limit {joint.upper:g}; exchange them"
        )
    return joint.lower, joint.upper


def _velocity(joint: LinkJoint, ceiling: float | None, follows: bool) -> float:
    stated = joint.velocity or None  # exporters write 0 for "unknown"
    if stated is not None and stated < 0:
        raise RobotError(f"joint '{joint.name}' has velocity limit {stated:g}, expected more than 0; correct it")
    if stated is None and ceiling is None:
        if follows:
            return math.inf  # its leader's limit holds
        given = "no velocity limit" if joint.velocity is None else "velocity limit 0"
        raise RobotError(
            f"joint '{joint.name}' has {given}, expected more than 0; state it in the file or give velocity_limit="
        )
    return min(value for value in (stated, ceiling) if value is not None)
