"""Measured clearances: the closest approach so far, and whether what is proven agrees with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.bodies import Bodies, RelativeBodies
from spacearm.proof.middles import Middles
from spacearm.proof.pairs import Kind, Tasks
from spacearm.proof.witness import Witness

Array = NDArray[np.float64]

DISAGREEMENT = 1e-6
"""[m] by which a measurement may be below what is proven, before nothing is believed."""

_ZOOMS, _POINTS = 2, 9


class Pair(NamedTuple):
    """A capsule of the robot, and a solid of a kind or another capsule."""

    kind: int
    capsule: int
    solid: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Near:
    """A measured closest approach.

    Attributes:
        capsule: index in the robot.
        obstacle: index in the scene; None if it is to a capsule.
        other: index in the robot of that capsule, or -1.
        u: where on the curve.
        clearance: [m].
        points: (2, 3) the nearest points, in the inertial frame [m].
    """

    capsule: int
    obstacle: int | None
    other: int
    u: float
    clearance: float
    points: Array


class Measurements:
    """Measures pairs, and keeps the closest.

    Attributes:
        clearance: the least measured [m]; infinite at first.
        doubt: whether less was measured than was proven.
    """

    def __init__(self, witness: Witness, kinds: list[Kind], bodies: Bodies, relative_bodies: RelativeBodies) -> None:
        self._witness, self._kinds, self._bodies, self._relative_bodies = witness, kinds, bodies, relative_bodies
        self.clearance, self.doubt = np.inf, False
        self._closest: tuple[Pair, float, Array] | None = None  # which, where, and the nearest points

    def task(self, kind: int, tasks: Tasks, row: int, middles: Middles, *, proven: float) -> tuple[float, Array]:
        """Measure a task's pair at its stretch's middle, where so much is proven.

        Returns:
            The clearance [m], and the direction (3,) from the other one to the capsule.
        """
        stretch, relative, solid = (int(column[row]) for column in tasks)
        pair = Pair(kind, int(self._relative_bodies.body[relative]), solid)
        found = self._measured(pair, middles.frames[stretch], float(middles.u[stretch]))
        self.doubt |= found[0] < proven - DISAGREEMENT
        return found

    def closest(self, domain: tuple[float, float], frames: Callable[[Array], Array], reach: float) -> Near | None:
        """Return the closest approach, after looking for a closer one of the same pair no further than `reach` on the curve.

        Args:
            domain: of the curve.
            frames: takes parameters (r,), gives T_w_joint (r, j + 1, 4, 4).
            reach: in the curve's parameter.
        """
        if self._closest is None:
            return None
        for _ in range(_ZOOMS):
            pair, u, _ = self._closest
            near = np.clip(np.linspace(u - reach, u + reach, _POINTS), *domain)
            for at, placed in zip(near.tolist(), frames(near), strict=True):
                self._measured(pair, placed, at)
            reach *= 2 / (_POINTS - 1)
        pair, u, points = self._closest
        solids = self._kinds[pair.kind].solids
        obstacle, other = (None, pair.solid) if solids is None else (int(solids.obstacle[pair.solid]), -1)
        return Near(capsule=pair.capsule, obstacle=obstacle, other=other, u=u, clearance=self.clearance, points=points)

    def _measured(self, pair: Pair, frames: Array, u: float) -> tuple[float, Array]:
        solids = self._kinds[pair.kind].solids
        if solids is None:
            found = self._witness.distance_between(frames, pair.capsule, pair.solid)
        else:
            found = self._witness.distance(frames, pair.capsule, solids, pair.solid)
        if found[0] < self.clearance:
            self.clearance, self._closest = found[0], (pair, u, self._witness.nearest_points())
        return found
