"""Which of the configurations that reach a goal are kept: those with room, else those that lack least of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.clearance import Room
from spacearm.planner.searched_clearance import SEARCH_ROOM

Array = NDArray[np.float64]

LEAST_CLEARANCE = 1e-6
"""[m] What only just does not touch leaves no room to prove a motion."""
_ALIKE = 1e-3  # [m] configurations that lack as much of the clearance required, but for this, are as good


def with_room(good: NDArray[np.bool_], room: Room) -> NDArray[np.bool_]:
    """Choose, of what is good, what has room beyond what is required; if nothing has, what lacks least of it."""
    free = good & (room.least > LEAST_CLEARANCE)
    for beyond in (SEARCH_ROOM, 0.0):
        roomy = free & (room.beyond >= beyond)
        if roomy.any():
            return roomy
    return free & (room.lacking <= room.lacking[free].min(initial=np.inf) + _ALIKE)
