"""What the commands say of a floating base."""

from __future__ import annotations

import math

from spacearm.planner import BaseReport


def base_rows(base: BaseReport) -> list[tuple[str, str]]:
    """Return lines for a summary: how the base turns, what it takes up, and by how much the goals are missed."""
    final, peak, rate = (_small(math.degrees(value)) for value in (base.final, base.peak, base.rate))
    rows = [
        (
            "base",
            f"turned by {final} deg at the end, {peak} deg at most; turns at {rate} deg/s at most; "
            f"joint momentum {_small(base.joint_momentum)} N m s at most",
        )
    ]
    ends = []
    if base.goal_distance is not None:
        off = f" and {_small(math.degrees(base.goal_angle))} deg" if base.goal_angle else ""
        ends.append(f"end effector {_small(base.goal_distance * 1e3)} mm{off} from its goal")
    if base.base_angle is not None:
        ends.append(f"base {_small(math.degrees(base.base_angle))} deg from its goal attitude")
    if ends:
        rows.append(("ends with", ", ".join(ends)))
    return rows + [("not as asked", text) for text in base.missed]


def _small(value: float) -> str:
    return f"{value:.3g}" if value >= 1e-3 or value == 0 else "< 0.001"
