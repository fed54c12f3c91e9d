"""Which of the configurations that reach a goal are kept: those with room, and of those that are alike one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.clearance import Room
from spacearm.planner.searched_clearance import SEARCH_ROOM

Array = NDArray[np.float64]

LEAST_CLEARANCE = 1e-6
"""[m] What only just does not touch leaves no room to prove a motion."""
_DISTINCT = 0.2  # [rad or m] goal configurations closer than this, in every joint, count as one
_WIDER = 1.3  # factor of that distance, until no more than asked for are left
_ALIKE = 1e-3  # [m] configurations that lack as much of the clearance required, but for this, are as good


def with_room(good: NDArray[np.bool_], room: Room) -> NDArray[np.bool_]:
    """Choose, of what is good, what has room beyond what is required; if nothing has, what lacks least of it."""
    free = good & (room.least > LEAST_CLEARANCE)
    for beyond in (SEARCH_ROOM, 0.0):
        roomy = free & (room.beyond >= beyond)
        if roomy.any():
            return roomy
    return free & (room.lacking <= room.lacking[free].min(initial=np.inf) + _ALIKE)


def distinct(q: Array, start: Array, most: int) -> NDArray[np.intp]:
    """Choose configurations that differ: nearest to the start first, and none near one that was chosen.

    What counts as near is widened until no more than asked for are left.
    """
    order: list[int] = np.argsort(np.linalg.norm(q - start, axis=1), kind="stable").tolist()
    apart = np.zeros((len(q), len(q)))
    for joint in q.T:
        np.maximum(apart, np.abs(joint[:, None] - joint), out=apart)
    radius = _DISTINCT
    while True:
        chosen: list[int] = []
        for i in order:
            if (apart[i, chosen] > radius).all():
                chosen.append(i)
        if len(chosen) <= most:
            return np.array(chosen, dtype=np.intp)
        radius *= _WIDER
