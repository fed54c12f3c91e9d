"""The clearance that is asked for, by pair of bodies, and what a pair that is nearer than that at an end is held to.

A *pair* is a link and an obstacle, or two links. Every pair has a required clearance r: the problem's, or a value of its own
(`PairClearance`). A pair that has less than r at the start or the goal cannot keep r there. It is *near* at that end, and is
held to what it has there until it is *out*, which is when it is first measured at r or more. From then on it is held to r.
The goal is the mirror image. A search and a proof use the same functions, and neither trusts the other's result.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import Frozen, as_name, as_number, is_a_row, keep, require_kind, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.geometry import Scene
from spacearm.robot import Robot
from spacearm.robot.unchecked_pairs import called, unchecked_pairs

Array = NDArray[np.float64]

DEFAULT_CLEARANCE = 0.01
"""[m] The clearance that is required where nobody says otherwise."""

HELD_BACK = 1e-4
"""[m] A pair near at an end is held to what it has there less this, or to half of what it has if that is more. Without it the
pair would have to gain clearance from the first instant on, and no proof could tell it from a pair that loses some."""

_NEAR = (
    1e-6  # [m] a pair that has less than this above its required clearance at an end counts as near: it has no room for proof
)
_OUT = 1e-4  # [m] above the required clearance a pair is out, so that there is room for a proof where the requirement changes
_LEAST_OUT = 1e-5  # [m] a pair that never has twice this above its required clearance never gets out


# ---- The clearance by pair -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PairClearance(Frozen):
    """A required clearance for some pairs of bodies, in place of the problem's.

    It is for the pairs of an obstacle with every link, of a link with everything, of a link and an obstacle, or of two links.
    If several are for the same pair, one that names both bodies counts before one that names one, and a later one before an
    earlier one.

    Attributes:
        clearance: what these pairs have to keep [m]; with 0 they may not touch.
        obstacle: the name of an obstacle; None: all.
        link: the name of a link; None: all.
        other_link: the name of another link; None: all.

    Raises:
        ProblemError: a clearance below 0, no name, or both an obstacle and another link.
    """

    clearance: float
    obstacle: str | None = field(default=None, kw_only=True)
    link: str | None = field(default=None, kw_only=True)
    other_link: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        number = as_number("a pair's clearance", self.clearance, ProblemError, at_least=0, unit="m")
        names = {"obstacle": self.obstacle, "link": self.link, "other_link": self.other_link}
        given = {name: as_name(f"a pair's {name}", value, ProblemError) for name, value in names.items() if value is not None}
        if not given:
            raise ProblemError(f"a clearance of {number:g} m for a pair names nothing, expected obstacle, link, or two links")
        if "other_link" in given and ("link" not in given or "obstacle" in given):
            raise ProblemError(
                f"a pair with the other_link {shown(self.other_link)} has the link {shown(self.link)} and the obstacle "
                f"{shown(self.obstacle)}, expected two links, or a link and an obstacle"
            )
        if given.get("link", "") == given.get("other_link"):
            raise ProblemError(f"a pair's links are both {shown(self.link)}, expected two links")
        keep(self, clearance=number, **given)

    @property
    def names(self) -> str:
        """The pairs in words, as in "link 'gripper' and obstacle 'client'"."""
        words = {"link": self.link, "other_link": self.other_link, "obstacle": self.obstacle}
        said = [f"{name.removeprefix('other_')} '{value}'" for name, value in words.items() if value is not None]
        return " and ".join(said)


def pair_clearance_as_dict(pair: PairClearance) -> dict[str, Any]:
    """Return a pair's clearance as plain values, in the form that problem files have.

    It is `{obstacle: client, clearance: 0.05}`, `{link: gripper, obstacle: client, clearance: 0.0}`, or
    `{links: [a, b], clearance: 0.02}`.
    """
    if pair.other_link is not None:
        return {"links": [pair.link, pair.other_link], "clearance": pair.clearance}
    named = {"link": pair.link, "obstacle": pair.obstacle}
    return {**{name: value for name, value in named.items() if value is not None}, "clearance": pair.clearance}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class RequiredClearance(Frozen):
    """The clearance required of every pair of bodies.

    Attributes:
        links: the names of the l links with a shape, in order of their first shape.
        to_obstacles: (l, k) of a link and an obstacle of the scene [m].
        between_links: (l, l) of two links [m], symmetric. Whether the two are kept apart at all is the robot's to say.
    """

    links: tuple[str, ...]
    to_obstacles: Array
    between_links: Array

    def __post_init__(self) -> None:
        for values in (self.to_obstacles, self.between_links):
            values.setflags(write=False)


def required_clearance(
    robot: Robot, scene: Scene, clearance: float = DEFAULT_CLEARANCE, by_pair: Iterable[PairClearance] = ()
) -> RequiredClearance:
    """Return the clearance required of every pair of bodies.

    Args:
        robot, scene: the bodies; links with a shape, and obstacles, are l and k.
        clearance: of all pairs that have no value of their own [m].
        by_pair: values for some pairs.

    Raises:
        ProblemError: a clearance below 0; a name that is none, with the nearest one; or two links that nobody keeps apart.
    """
    least = as_number("clearance", clearance, ProblemError, at_least=0, unit="m")
    pairs = as_pair_clearances(by_pair)
    links = tuple(dict.fromkeys(shape.name for shape in robot.shapes))
    to_obstacles = np.full((len(links), len(scene.obstacles)), least)
    between_links = np.full((len(links), len(links)), least)
    for pair in sorted(pairs, key=_names_two):  # stable: of equals the later one is written last
        row = slice(None) if pair.link is None else _link(pair.link, links)
        if pair.other_link is not None:
            _require_checked(robot, str(pair.link), pair.other_link)
            other = _link(pair.other_link, links)
            between_links[row, other] = between_links[other, row] = pair.clearance
        elif pair.obstacle is not None:
            to_obstacles[row, _obstacles(pair.obstacle, scene)] = pair.clearance
        else:
            to_obstacles[row] = between_links[row] = between_links[:, row] = pair.clearance
    return RequiredClearance(links=links, to_obstacles=to_obstacles, between_links=between_links)


def as_pair_clearances(given: Any) -> tuple[PairClearance, ...]:
    """Check clearances by pair.

    Raises:
        ProblemError: no row of PairClearance.
    """
    if isinstance(given, (str, bytes, dict)) or not is_a_row(given):
        raise ProblemError(f"clearances is {shown(given)}, expected a row of PairClearance")
    pairs = tuple(given)
    for i, pair in enumerate(pairs):
        require_kind(
            f"clearances[{i}]", pair, PairClearance, ProblemError, advice="write PairClearance(0.05, obstacle='client')"
        )
    return pairs


def _names_two(pair: PairClearance) -> int:
    return sum(name is not None for name in (pair.obstacle, pair.link, pair.other_link))


def _link(name: str, links: Sequence[str]) -> int:
    if name not in links:
        raise ProblemError(f"a clearance is given for the link '{name}', which has no shape or is none; {nearest(name, links)}")
    return links.index(name)


def _obstacles(name: str, scene: Scene) -> list[int]:
    """Return the indices of the obstacles of a name."""
    found = [i for i, obstacle in enumerate(scene.obstacles) if obstacle.name == name]
    if not found:
        known = dict.fromkeys(obstacle.name for obstacle in scene.obstacles if obstacle.name)
        raise ProblemError(f"a clearance is given for the obstacle '{name}', which is none; {nearest(name, known)}")
    return found


def _require_checked(robot: Robot, link: str, other: str) -> None:
    links = (min(link, other), max(link, other))
    for one in unchecked_pairs(robot):
        if one.links == links:
            raise ProblemError(
                f"a clearance is given for the links {called(links)}, which are not kept apart ({one.why}); "
                "leave it out, or add the pair to the robot's self_pairs"
            )


# ---- Pairs near at an end --------------------------------------------------------------------------------------------


def held_to(at_end: ArrayLike, required: ArrayLike) -> Array:
    """Return what pairs are held to at an end, and from there until they are out.

    Args:
        at_end: (...) what the pairs have at the start, or at the goal [m].
        required: (...) their required clearances r [m].

    Returns:
        (...) [m] what a pair has there less 1e-4 m, or half of it, where that is less than r and the pair has less than
        r + 1e-6 m; else r. A pair that has 0 or less collides, and is held to r.
    """
    has, r = np.broadcast_arrays(np.asarray(at_end, np.float64), np.asarray(required, np.float64))
    held = has - np.minimum(HELD_BACK, has / 2)
    near = (has > 0) & (has < r + _NEAR) & (held < r)
    return np.where(near, held, r)


def out_level(greatest: ArrayLike, required: ArrayLike) -> Array:
    """Return the clearance from which on pairs count as out.

    It is r and a little more, so that there is room for a proof where the requirement changes: 1e-4 m, or half of the most that
    the pair has above r on this motion. A pair that never has more than r + 2e-5 m never gets out.

    Args:
        greatest: (...) the greatest clearances of the pairs on the motion [m].
        required: (...) their required clearances r [m].

    Returns:
        (...) [m]; infinite for a pair that never gets out.
    """
    r = np.asarray(required, np.float64)
    room = np.minimum(_OUT, (np.asarray(greatest, np.float64) - r) / 2)
    return np.where(room >= _LEAST_OUT, r + room, np.inf)
