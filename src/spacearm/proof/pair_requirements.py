"""What a proof holds every pair of bodies to, on every interval: the required clearance, or less near an end.

A pair of bodies here is a relative body and a solid, such as two shapes. It belongs to a pair of a link and an obstacle, or
of two links, and is held to what that pair is held to. An interval on which the requirement changes is held to the greater one:
it is halved until that is proven, because the pair has a little more where the requirement changes.

Rows of pairs are divided into *phases*, so that a pair that barely keeps what it is held to does not lessen what is proven of
the others: phase 0 is of the pairs that are held to the full all the time. A pair near at an end has three: from the start,
up to the goal, and where it is out.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.bodies import Bodies, RelativeBodies
from spacearm.proof.displacement import IntervalMidpoints
from spacearm.proof.required_clearance import RequiredClearance, held_to
from spacearm.proof.separation import ObstacleGroup, OpenPairs
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

FROM_START, UP_TO_GOAL, OUT = 1, 2, 3
"""The phases of a pair near at an end; those of pair i are 3 i more."""


class NearPart(NamedTuple):
    """A part of a motion on which a pair is held to less than the required clearance.

    Attributes:
        phase: FROM_START or UP_TO_GOAL.
        ends: "start", "goal" or "both": where the pair is near.
        has: what it has there, at both the lesser [m].
        begin, end: from where to where on the curve; may be infinite.
    """

    phase: int
    ends: Literal["start", "goal", "both"]
    has: float
    begin: float
    end: float


class NearEnd(NamedTuple):
    """A pair that is near at the start or the goal.

    Attributes:
        link: index of the link in `RequiredClearance.links`.
        other: the other body: k obstacles of the scene come first, then the links.
        required: the clearance that is asked for [m].
        at_start, at_goal: what it has there [m].
        until: it is held to what it has at the start up to here on the curve; infinite: all the time.
        since: it is held to what it has at the goal from here on; minus infinity: all the time.
        room: the clearance above the required one at which it counts as out [m].
    """

    link: int
    other: int
    required: float
    at_start: float
    at_goal: float
    until: float
    since: float
    room: float

    @property
    def held_at_start(self) -> float:
        """What it is held to from the start on [m]."""
        return float(held_to(self.at_start, self.required))

    @property
    def held_at_goal(self) -> float:
        """What it is held to up to the goal [m]."""
        return float(held_to(self.at_goal, self.required))

    @property
    def parts(self) -> tuple[NearPart, ...]:
        """The parts of the motion on which it is held to less: one for each end, or one for all the time."""
        at_start, at_goal = self.held_at_start < self.required, self.held_at_goal < self.required
        if self.always:
            ends = "both" if at_start and at_goal else "start" if at_start else "goal"
            phase = UP_TO_GOAL if ends == "goal" else FROM_START
            has = self.at_goal if ends == "goal" else self.at_start if ends == "start" else min(self.at_start, self.at_goal)
            return (NearPart(phase, ends, has, -np.inf, np.inf),)
        from_start = NearPart(FROM_START, "start", self.at_start, -np.inf, self.until)
        up_to_goal = NearPart(UP_TO_GOAL, "goal", self.at_goal, self.since, np.inf)
        return (*((from_start,) if at_start else ()), *((up_to_goal,) if at_goal else ()))

    @property
    def always(self) -> bool:
        """Whether it is held to the lesser of both all the time."""
        return self.until == np.inf or self.since == -np.inf

    @property
    def known_excess(self) -> tuple[float, float, float]:
        """What is known of the least excess in the three phases: by what it has at the ends, and where it gets out [m]."""
        if self.always:
            least = min(self.at_start, self.at_goal) - self.held(FROM_START)
            return least, least, self.room
        from_start = self.at_start - self.held_at_start if self.until > -np.inf else np.inf
        up_to_goal = self.at_goal - self.held_at_goal if self.since < np.inf else np.inf
        return from_start, up_to_goal, self.room

    def held(self, phase: int) -> float:
        """Return what it is held to in a phase [m]."""
        if self.always:
            return min(self.held_at_start, self.held_at_goal)
        return (self.held_at_start, self.held_at_goal, self.required)[phase - 1]


class Held(NamedTuple):
    """What t pairs on intervals are held to; numbers instead of arrays if it is the same for all.

    Attributes:
        required: (t,) on the whole interval [m].
        phase: (t,) the phase of the interval.
        at_midpoint: (t,) at the interval's midpoint [m].
        phase_at_midpoint: (t,) the phase of the midpoint.
    """

    required: Array | float
    phase: Indices | int
    at_midpoint: Array | float
    phase_at_midpoint: Indices | int


class PairRequirements:
    """The clearances that pairs of bodies are held to.

    Attributes:
        links, obstacles: how many there are, l and k.
        required: (l, k + l) by link and other body: obstacles first, then links [m].
        near: the pairs that are near at an end.
    """

    def __init__(
        self,
        required: RequiredClearance,
        robot: Robot,
        bodies: Bodies,
        relative_bodies: RelativeBodies,
        groups: list[ObstacleGroup],
    ) -> None:
        self.links, self.obstacles = required.to_obstacles.shape
        self.required = np.concatenate([required.to_obstacles, required.between_links], axis=1)
        self.near: tuple[NearEnd, ...] = ()
        self._groups, self._relative_bodies = groups, relative_bodies
        self._link = _links_of(required, robot, bodies)
        self._near = np.zeros(self.required.shape, np.intp)  # by link and other body: 1 + the index in `near`, or 0
        self._held = np.zeros((0, 3))
        self._uniform = _uniform(self.required)

    @property
    def greatest(self) -> float:
        """The greatest clearance required [m]."""
        return float(self.required.max(initial=0.0))

    @property
    def phases(self) -> int:
        """How many phases there are."""
        return 1 + 3 * len(self.near)

    @property
    def full_phases(self) -> list[int]:
        """The phases of pairs that are held to the full: those never near at an end, and near ones while they are out."""
        return [0, *range(OUT, self.phases, 3)]

    def known_excess(self) -> list[float]:
        """Return the least excess known in each phase of the near pairs."""
        return [excess for one in self.near for excess in one.known_excess]

    def set_near(self, near: tuple[NearEnd, ...]) -> None:
        """Hold some pairs to what they have at an end, from now on."""
        self.near = near
        self._near[:] = 0
        for i, one in enumerate(near):
            self._near[one.link, one.other] = i + 1
            if one.other >= self.obstacles:
                self._near[one.other - self.obstacles, self.obstacles + one.link] = i + 1
        self._held = np.array([[one.held(phase) for phase in (FROM_START, UP_TO_GOAL, OUT)] for one in near]).reshape(-1, 3)
        self._until, self._since = (np.array([getattr(one, name) for one in near]) for name in ("until", "since"))

    def link_of(self, pairs: OpenPairs) -> Indices:
        """Return the link (t,) of pairs."""
        return self._link[self._relative_bodies.body[pairs.relative]]

    def bodies_of(self, group: int, pairs: OpenPairs) -> tuple[Indices, Indices]:
        """Return the link (t,) and the other body (t,) of pairs of a group, no cells."""
        link, solids = self.link_of(pairs), self._groups[group].solids
        other = self.obstacles + self._link[pairs.solid] if solids is None else solids.obstacle[pairs.solid]
        return link, other

    def on(self, group: int, pairs: OpenPairs, midpoints: IntervalMidpoints) -> Held:
        """Return what pairs of a group are held to on their intervals."""
        if self._uniform is not None and not self.near:
            return Held(self._uniform, 0, self._uniform, 0)
        link, other = self.bodies_of(group, pairs)
        required, near = self.required[link, other], self._near[link, other]
        u, half = midpoints.u[pairs.interval], midpoints.half[pairs.interval]
        return Held(*self._between(required, near, u - half, u + half), *self._between(required, near, u, u))

    def on_cells(self, group: int, pairs: OpenPairs) -> Held:
        """Return what pairs of links' balls and cells are held to: the greatest that any ball in the cell is held to."""
        if self._uniform is not None:
            return Held(self._uniform, 0, self._uniform, 0)
        required = self.of_cells(group, self.required[:, : self.obstacles])
        of_rows = required[self.link_of(pairs), pairs.solid]
        return Held(of_rows, 0, of_rows, 0)

    def of_cells(self, group: int, values: Array) -> Array:
        """Return the greatest of values (l, k) for links and obstacles in each cell of a group, (l, number of cells)."""
        solids, cells = self._groups[group]
        assert solids is not None
        assert cells is not None
        return np.maximum.reduceat(values[:, solids.obstacle], cells.first, axis=1)

    def at(self, group: int, shape: int, solid: int, u: float) -> tuple[float, int]:
        """Return what a shape and a solid of a group are held to at an instant [m], and the phase."""
        if self._uniform is not None and not self.near:
            return self._uniform, 0
        link, solids = self._link[shape], self._groups[group].solids
        other = self.obstacles + self._link[solid] if solids is None else solids.obstacle[solid]
        required, near = self.required[link, other], self._near[link, other]
        if not near:
            return float(required), 0
        held, phase = self._between(np.array([required]), np.array([near]), np.array([u]), np.array([u]))
        return float(held[0]), int(phase[0])

    def _between(self, required: Array, near: Indices, low: Array, high: Array) -> tuple[Array, Indices]:
        """Return what pairs are held to from `low` to `high` on the curve, and the phases."""
        phase = np.zeros(len(near), np.intp)
        which = np.flatnonzero(near)
        if which.size:
            one = near[which] - 1
            begun, ending = high[which] <= self._until[one], low[which] >= self._since[one]
            of_pair = np.where(begun, FROM_START, np.where(ending, UP_TO_GOAL, OUT))
            required = required.copy()
            required[which] = self._held[one, of_pair - 1]
            phase[which] = 3 * one + of_pair
        return required, phase


def _links_of(required: RequiredClearance, robot: Robot, bodies: Bodies) -> Indices:
    """Return the links (b,) of bodies: of shapes, then of the balls around links."""
    place = {name: i for i, name in enumerate(required.links)}
    of_shapes = np.array([place[shape.name] for shape in robot.shapes], dtype=np.intp)
    balls = bodies.members[bodies.first[len(of_shapes) :]]
    return np.concatenate([of_shapes, of_shapes[balls]])


def _uniform(required: Array) -> float | None:
    """Return the clearance that all pairs have to keep; None if they differ."""
    least, most = required.min(initial=np.inf), required.max(initial=0.0)
    return float(most) if least >= most else None
