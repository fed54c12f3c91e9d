"""What a search asks for: the clearance that is required of each pair and room for what it does not look at, or what there is.

A search looks at instants, and a proof needs room. So it is asked for a little more than is required. A pair that has less at
the start or a goal can only be asked for what it has there; a pair that has less than required is held to that until it is out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief
from spacearm.core.native import native
from spacearm.dynamics.base_models import BASE_MODELS, BaseModel
from spacearm.planner.clearance import ClearanceModel, HasScene, KernelClearance, prepared
from spacearm.planner.tracking_room import Taken
from spacearm.proof.required_clearance import held_to

Array = NDArray[np.float64]

SEARCH_ROOM = 0.002
"""[m] A search asks for so much more than is required, for the instants between those that it looks at, and for the proof."""

_OUT_ROOM = 1.2e-4
"""[m] A pair near at an end counts as out where it has so much more than is required. The proof says so from 0.1 mm on: a pair
that the proof calls out and the search does not may be asked for too little. Of 150 drawn problems with such pairs, 148 are
found with it, at the first proof, and 147 with 0.3 mm (3,000 evaluations, 10 or 20 mm of clearance)."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class NearAtEnd(Brief):
    """Two things that begin or end nearer to each other than is required of them.

    Attributes:
        link: name of the robot's link.
        other: what it is near to, as in "obstacle 'shelf'" or "link 'forearm'".
        clearance: the least that they have at the start or a goal [m], above 0.
        required: of them as soon as they are out [m].
        at_start: what is asked of the two from the start until they are out [m].
        at_goals: likewise before each of the goals; none where the arm moves its base, whose place there is not known.
    """

    link: str
    other: str
    clearance: float
    required: float
    at_start: float
    at_goals: tuple[float, ...] = ()

    @property
    def out(self) -> float:
        """The clearance asked of the two once they are out [m]."""
        return self.required + _OUT_ROOM

    @property
    def least(self) -> float:
        """The least that is asked of them anywhere [m]."""
        return min(self.out, self.at_start, *self.at_goals)


_SURELY_OUT = 1e-4  # [m] a pair that has so much more than is required at an end is not near there

Row = tuple[int, int, int]
"""A pair of the kernel's: a body, and an obstacle or -1 and another body."""


def _no_rows() -> NDArray[np.int32]:
    return np.zeros((0, 3), dtype=np.int32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SearchedClearance(Brief):
    """The clearances that a search asks for at the instants that it looks at.

    Attributes:
        asked: of all pairs but those below [m].
        near: pairs that begin or end nearer than is required of them, the nearest first.
        touching: whether something has no clearance at all at the start or a goal.
        rows: (p, 3) pairs of which another clearance is asked, for the kernel: bodies, and its obstacles, or -1 and other
            bodies.
        of_pairs: (p,) the clearance asked of these at every instant [m].
        near_rows: (r, 4) the same for `near`: first which of them.
    """

    asked: float
    near: tuple[NearAtEnd, ...] = ()
    touching: bool = False
    rows: NDArray[np.int32] = field(default_factory=_no_rows)
    of_pairs: Array = field(default_factory=lambda: np.zeros(0))
    near_rows: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 4), dtype=np.int32))

    @property
    def kernel_pairs(self) -> native.PairMargins | None:
        """The pairs as the kernel takes them; None if there are none."""
        if not len(self.of_pairs):
            return None
        body, obstacle, other = (np.ascontiguousarray(column) for column in self.rows.T)
        return native.PairMargins(body=body, obstacle=obstacle, other=other, margin=self.of_pairs)

    def kernel_near_pairs(self, goals: int) -> native.NearPairs | None:
        """Return the pairs near at an end as the kernel takes them, for a number of goals; None if there are none."""
        if not len(self.near_rows):
            return None
        pair, body, obstacle, other = (np.ascontiguousarray(column) for column in self.near_rows.T)
        return native.NearPairs(
            pair=pair,
            body=body,
            obstacle=obstacle,
            other=other,
            required=np.array([near.out for near in self.near]),
            at_start=np.array([near.at_start for near in self.near]),
            at_goal=np.array([near.at_goals or [near.out] * goals for near in self.near], dtype=np.float64),
        )


def searched_clearance(problem: HasScene, ends: ArrayLike, taken: Taken | None = None) -> SearchedClearance:
    """Return the clearances that a search asks for between ends.

    Of each pair it is what is required of it and 2 mm more; of a pair that has less at an end, half of what it has there
    beyond what is required. A pair that has less at an end than is required is held to what it has there until it is out.

    Args:
        problem: the robot and the scene, and what is required.
        ends: (1 + g, n) configurations, the start and goals [rad or m]; no goal where the arm moves its base.
        taken: what a tracking error may take from each pair on the way, which is asked for in addition; None: nothing.
    """
    model = prepared(problem)
    required, asked = _asked(problem, model, taken)
    rows = np.asarray(ends, dtype=np.float64)
    to_scene, to_links = model.measured(rows)  # (e, c, j), (e, p)
    if required.alike and min(to_scene.min(initial=np.inf), to_links.min(initial=np.inf)) >= asked + SEARCH_ROOM:
        return SearchedClearance(asked=asked)
    base: BaseModel = getattr(problem, "base_model", BASE_MODELS["fixed"])
    if not base.follows_arm:  # no motion changes the distance between a base that stays and an obstacle
        to_scene[:, [part.joint < 0 for part in model.robot.shapes]] = np.inf
    return _Pairs(model, asked).searched(to_scene, to_links, required)


def _asked(problem: HasScene, model: ClearanceModel, taken: Taken | None) -> tuple[KernelClearance, float]:
    """Return what is required of each pair and what is asked of most, with what a tracking error takes."""
    required = model.required_by(problem)
    if taken is None:
        return required, usual_clearance(problem)
    required = taken.added_to(required)
    most = max((float(part.max(initial=0.0)) for part in taken), default=0.0)
    return required, float(getattr(problem, "clearance", 0.0)) + most + SEARCH_ROOM


def clearance_of_goals(problem: HasScene, model: ClearanceModel, taken: Taken | None = None) -> SearchedClearance:
    """Return the clearances that a search for goal configurations asks for.

    Of links that are nearer to each other at the start than is required, and may be so in every configuration, it is what
    they have there.

    Args:
        problem: with a start, and what is required.
        model: of its robot, among what it may meet at the goal.
        taken: what a tracking error may take from each pair, which is asked for in addition; None: nothing.
    """
    required, asked = _asked(problem, model, taken)
    start: Array = getattr(problem, "start")  # noqa: B009  # a problem has one
    at_start = model.between_links(start[None])
    at_start = np.where(at_start < required.between_links, at_start, np.inf)
    far = np.full((1, *required.to_obstacles.shape), np.inf)
    return _Pairs(model, asked).searched(far, at_start, required)


def usual_clearance(problem: HasScene) -> float:
    """Return the clearance that a search asks for of pairs for which the problem states none of their own [m]."""
    return float(getattr(problem, "clearance", 0.0)) + SEARCH_ROOM


def between_ends(clear: float, required: float) -> float:
    """Return what is asked of a pair [m] that has a clearance at the nearest end, and of which one is required."""
    if clear <= 0:
        return 0.0
    held = held_at_end(clear, required)
    return held + min(SEARCH_ROOM, (clear - held) / 2)


def held_at_end(clear: float, required: float) -> float:
    """Return what a pair is held to [m] that has a clearance at the nearest end, and of which one is required."""
    return required if clear > required + _SURELY_OUT else float(held_to(clear, required))


class _Pairs:
    """Collects what is asked of pairs, link by link: all bodies of a link have the same clearance to an obstacle."""

    def __init__(self, model: ClearanceModel, asked: float) -> None:
        self._model, self._asked = model, asked
        self._names = [part.name for part in model.robot.shapes]
        self._bodies: dict[str, list[int]] = {}
        for i, name in enumerate(self._names):
            self._bodies.setdefault(name, []).append(i)
        self._of_rows: dict[Row, float] = {}
        self._near: list[tuple[NearAtEnd, list[Row]]] = []
        self._touching = False

    def searched(self, to_scene: Array, to_links: Array, required: KernelClearance) -> SearchedClearance:
        """Return what is asked of all pairs, by their clearances at the ends (e, c, j) and (e, p) [m]."""
        self._add_obstacles(to_scene, required.to_obstacles)
        self._add_links(to_links, required.between_links)
        near = sorted(self._near, key=lambda entry: entry[0].clearance)
        near_rows = [(k, *row) for k, (_, rows) in enumerate(near) for row in rows]
        return SearchedClearance(
            asked=self._asked,
            near=tuple(one for one, _ in near),
            touching=self._touching,
            rows=np.array(list(self._of_rows), dtype=np.int32).reshape(-1, 3),
            of_pairs=np.array(list(self._of_rows.values()), dtype=np.float64),
            near_rows=np.array(near_rows, dtype=np.int32).reshape(-1, 4),
        )

    def _special(self, at_ends: Array, required: Array) -> NDArray[np.bool_]:
        """Tell of which pairs something else than usual is asked."""
        near: Array = at_ends.min(axis=0)
        return (near < required + 2 * SEARCH_ROOM) | (required + SEARCH_ROOM != self._asked)

    def _add_obstacles(self, at_ends: Array, required: Array) -> None:
        special: list[list[int]] = np.argwhere(self._special(at_ends, required).T).tolist()
        near: dict[tuple[str, int], float] = {}
        for obstacle, link in dict.fromkeys((k, self._names[i]) for k, i in special):
            bodies = self._bodies[link]
            least, asked = float(at_ends[:, bodies, obstacle].min()), float(required[bodies[0], obstacle])
            self._put([(i, obstacle, -1) for i in bodies], least, asked)
            if held_at_end(least, asked) < asked:
                near.setdefault((link, int(self._model.obstacle_of[obstacle])), asked)
        for (link, obstacle), asked in near.items():
            bodies, parts = self._bodies[link], np.flatnonzero(self._model.obstacle_of == obstacle).tolist()
            of_ends: Array = at_ends[:, bodies][:, :, parts].min(axis=(1, 2))
            rows = [(i, k, -1) for k in parts for i in bodies]
            self._add_near(link, f"obstacle {self._model.scene.called(obstacle)}", of_ends, asked, rows)

    def _add_links(self, at_ends: Array, required: Array) -> None:
        special = self._special(at_ends, required)
        if not special.any():
            return
        number = {name: i for i, name in enumerate(dict.fromkeys(self._names))}
        link_of = np.array([number[name] for name in self._names])
        pairs = self._model.pairs
        of_links = link_of[pairs[:, 0]] * len(number) + link_of[pairs[:, 1]]
        groups, first = np.unique(of_links[special], return_index=True)
        for group in groups[np.argsort(first)].tolist():
            some = np.flatnonzero(of_links == group)
            of_ends: Array = at_ends[:, some].min(axis=1)
            least, asked = float(of_ends.min()), float(required[some[0]])
            rows: list[Row] = [(i, -1, k) for i, k in pairs[some].tolist()]
            self._put(rows, least, asked)
            if held_at_end(least, asked) < asked:
                link, other = (self._names[int(i)] for i in pairs[some[0]])
                self._add_near(link, f"link '{other}'", of_ends, asked, rows)

    def _put(self, rows: Iterable[Row], least: float, required: float) -> None:
        self._touching |= least <= 0
        self._of_rows.update(dict.fromkeys(rows, between_ends(least, required)))

    def _add_near(self, link: str, other: str, of_ends: Array, required: float, rows: list[Row]) -> None:
        start, *goals = of_ends.tolist()
        near = NearAtEnd(
            link=link,
            other=other,
            clearance=min(start, *goals) if goals else start,
            required=required,
            at_start=between_ends(start, required),
            at_goals=tuple(between_ends(goal, required) for goal in goals),
        )
        if near.clearance > 0:
            self._near.append((near, rows))
            self._of_rows.update(dict.fromkeys(rows, near.least))
