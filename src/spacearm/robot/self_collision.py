"""Which links of a robot must keep clear of each other, found from their shapes and its joints.

A pair is unchecked only for a reason that holds: no joint moves the two against each other; they are neighbours, and the limits
of the joint between them must keep them apart; or they overlap in every configuration, which is a fault of the model and is
told. Each is recorded in `Robot.unchecked`. A pair that is proven never to meet (`never_meet`), nor to come near, is left to
the certificate, which proves it like any other; the search skips it, and `Robot.apart` records it. Every other pair is checked.
What was found is kept between runs in the user's cache.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import as_whole
from spacearm.core.errors import RobotError
from spacearm.core.long_work import LongWork
from spacearm.core.user_cache import cached_json
from spacearm.robot.kinematics import base_and_joint_frames, skeleton
from spacearm.robot.link_distances import CONTACT, LinkBody, PlacedBody, distances, least_distance, link_bodies, placed
from spacearm.robot.model import Robot, require_robot
from spacearm.robot.unchecked_pairs import (
    REMEDY,
    Pair,
    UncheckedPair,
    always_meets,
    apart_pairs,
    called,
    fingerprint,
    is_rigid,
    overlap_in_words,
    ways_to_links,
)
from spacearm.robot.whole_range import always_overlap, finite_range, joints_between, never_meet

Array = NDArray[np.float64]

Reason = Literal["checked", "rigid", "adjacent", "always", "cannot meet"]

NEARLY_ALWAYS = 0.95
"""Share of the samples from which on a pair that meets leaves hardly a motion."""

ROOM = 0.05
"""[m] Links that are never nearer than this cannot meet, unless they are neighbours. So a search that skips them keeps every
clearance up to this."""

_SAMPLES = 1000
_ENOUGH = 100  # samples, before a pair counts as one that always meets without a proof
_NAMED = 6  # pairs that a note names
_COINCIDENT = 1e-9  # [m] joints whose origins are nearer than this turn about one point
_TOUCHING = 1e-6  # [m] links that only a locked joint is between are told from touching ones by this
_ANALYSIS = 2  # version, for the cache: it is raised when the same robot gives other pairs


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LinkPair(Brief):
    """What was found about two links.

    Attributes:
        links: their names, in alphabetical order.
        reason: "checked" if they must keep clear; else why not: "rigid" (no joint moves them against each
            other, or none that its limits let move), "adjacent" (neighbours, whose shapes meet in some
            configurations: the limits of the joint between them must keep them apart), "always" (their
            shapes overlap in every configuration), "cannot meet" (proven for every configuration within
            the limits: they never touch if they are neighbours, else they are never nearer than `ROOM`).
        met: share of the samples in which they met [-].
        clearance: the least signed distance in any sample [m].
        depth: of a pair that always meets: two of its shapes overlap at least so deep in every configuration [m].
        proven: whether that is proven for all configurations within the limits; else it was so in all samples.
    """

    links: tuple[str, str]
    reason: Reason
    met: float
    clearance: float
    depth: float = 0.0
    proven: bool = False

    @property
    def overlaps_always(self) -> bool:
        """Whether the two meet in every configuration although a joint moves them against each other."""
        return self.met == 1 and self.reason in ("adjacent", "always")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SelfPairs(Brief):
    """Every pair of links with an envelope, and what was found about it.

    Attributes:
        found: the pairs, in alphabetical order.
        samples: number of configurations that were looked at.
    """

    found: tuple[LinkPair, ...]
    samples: int

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The pairs that must keep clear, as `Robot.self_pairs` takes them."""
        return tuple(pair.links for pair in self.found if pair.reason == "checked")

    def applied_to(self, robot: Robot) -> Robot:
        """Return the robot that was looked at with these pairs, and with those that are unchecked and why; its notes stay.

        Pairs that cannot meet, or that no joint with room between its limits moves, are looked at by a certificate only.
        """
        apart, unchecked, ways = [], [], ways_to_links(robot)
        for one in self.found:
            locked = one.reason == "rigid" and not is_rigid(robot, *(ways[link] for link in one.links))
            if one.reason == "always":
                unchecked.append(always_meets(robot, one.links, depth=one.depth, proven=one.proven))
            elif locked and one.clearance <= _TOUCHING:
                unchecked.append(always_meets(robot, one.links, depth=max(-one.clearance, 0.0), proven=True))
            elif one.reason == "cannot meet" or locked:
                apart.append(one.links)
            elif one.reason == "adjacent":
                unchecked.append(UncheckedPair(links=one.links, reason="adjacent"))
        return replace(robot, self_pairs=self.pairs, apart=apart_pairs(robot, apart), unchecked=tuple(unchecked))

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence on the whole, and one on each kind of pairs that can meet and are unchecked, or nearly always meet."""
        counts = Counter(pair.reason for pair in self.found)
        others = ", ".join(f"{counts[why]} {why}" for why in ("rigid", "adjacent", "cannot meet") if counts[why])
        notes = [
            f"self-collision was computed: {_pairs_of_links(len(self.pairs))} must keep clear"
            + (f" (not in the search: {others})" if others else "")
        ]
        notes += _notes_on_overlaps([(one.links, one.depth, one.proven) for one in self.found if one.reason == "always"])
        notes += _notes_on_pairs(
            [(one.links, f"{one.met:.1%}") for one in self.found if one.reason == "checked" and one.met >= NEARLY_ALWAYS],
            one="{} meet in {} of all configurations, and must keep clear: they leave hardly a motion",
            several="{} pairs of links meet in nearly every configuration, and must keep clear: they leave hardly a motion",
        )
        return (
            *notes,
            *_notes_on_pairs(
                [
                    (one.links, f"{one.met:.1%}")
                    for one in self.found
                    if one.reason == "adjacent" and 0 < one.met < NEARLY_ALWAYS
                ],
                one="{} are neighbours and meet in {} of all configurations: that pair is not checked, the joint's limits must "
                "keep them apart",
                several="{} pairs of neighbours meet in some configurations: they are not checked, the limits of the joints "
                "between them must keep them apart",
            ),
        )


def find_self_pairs(robot: Robot, *, samples: int = _SAMPLES, seed: int = 0) -> SelfPairs:
    """Find the pairs of links that must keep clear of each other.

    What was found for the same shapes, joints and limits before is taken from the user's cache.

    Args:
        robot: with an envelope.
        samples: number of random configurations to look at, besides the one nearest to 0.
        seed: of their random numbers; the same seed gives the same answer.

    Raises:
        RobotError: `samples` or `seed` is no whole number, 0 or more.
    """
    require_robot(robot)
    count, seed = as_whole("samples", samples, RobotError, at_least=0), as_whole("seed", seed, RobotError, at_least=0)
    names = sorted({part.name for part in robot.shapes})
    neighbours = _neighbours(robot, set(names))

    def look() -> list[list[Any]]:
        sampled, work = _Sampled(robot, _samples(robot, count, seed)), LongWork()
        pairs, rows = list(itertools.combinations(names, 2)), []
        for i, links in enumerate(pairs):
            work.say(f"which links can meet: pair {i + 1} of {len(pairs)}", done=i, total=len(pairs))
            one = sampled.look_at(*links, neighbours=links in neighbours)
            rows.append([*one.links, one.reason, one.met, one.clearance, one.depth, one.proven])
        return rows

    key = [fingerprint(robot, names), sorted(neighbours), count, seed]
    rows = cached_json("self-pairs", _ANALYSIS, key, look)
    found = tuple(
        LinkPair(links=(a, b), reason=reason, met=met, clearance=least, depth=depth, proven=proven)
        for a, b, reason, met, least, depth, proven in rows
    )
    return SelfPairs(found=found, samples=count + 1)


@dataclass(slots=True)
class _Sampled:
    """The links of a robot in m configurations q (m, n)."""

    robot: Robot
    q: Array
    bodies: dict[str, LinkBody] = field(init=False)
    bones: Robot = field(init=False)
    frames: Array = field(init=False)
    places: dict[str, PlacedBody] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.bodies, self.bones = link_bodies(self.robot), skeleton(self.robot)
        self.frames = base_and_joint_frames(self.bones, self.q)

    def place(self, link: str) -> PlacedBody:
        """Return a link where it is in all configurations."""
        if link not in self.places:
            self.places[link] = placed(self.bodies[link], self.frames)
        return self.places[link]

    def look_at(self, first: str, second: str, *, neighbours: bool) -> LinkPair:
        """Return what can be said about two links; `neighbours` are those without a third one between them."""
        links, between = (first, second), joints_between(self.bones, self.bodies[first], self.bodies[second])
        if not between:
            still = [placed(self.bodies[link], self.frames[:1]) for link in links]
            least, met = least_distance(still[0], still[1])
            return LinkPair(links=links, reason="rigid", met=met, clearance=least)
        least, met = least_distance(self.place(first), self.place(second))
        adjacent = neighbours and _at_one_place(self.bones, between)
        if adjacent and met > 0:
            return LinkPair(links=links, reason="adjacent", met=met, clearance=least)
        if met == 1:
            depth, proven = self.overlap(first, second)
            if depth is not None:
                return LinkPair(links=links, reason="always", met=met, clearance=least, depth=depth, proven=proven)
        room = 0.0 if adjacent else ROOM
        apart = met == 0 and never_meet(self.bones, self.bodies[first], self.bodies[second], between, room=room)
        reason: Reason = "cannot meet" if apart else "adjacent" if adjacent else "checked"
        return LinkPair(links=links, reason=reason, met=met, clearance=least)

    def overlap(self, first: str, second: str) -> tuple[float | None, bool]:
        """Return the depth that two links, which meet in all samples, have at least, and whether it is proven.

        The depth is None where they are free somewhere, or where too little was looked at.
        """
        seen = max(float(-distances(self.place(first), self.place(second)).max()), 0.0)
        between = joints_between(self.bones, self.bodies[first], self.bodies[second])
        if not between:
            return seen, True
        proven = always_overlap(self.bones, self.bodies[first], self.bodies[second], between, seen=seen)
        if proven is False or (proven is None and len(self.q) < _ENOUGH):
            return None, False
        return (seen, False) if proven is None else (proven, True)


def with_allowed_pairs(robot: Robot, may_touch: Callable[[str, str], bool], *, by: str) -> Robot:
    """Return the robot with the pairs of links that must keep clear where somebody else says which may touch.

    Left out and recorded are those that may touch, those that no joint moves against each other, and those that nobody
    allows to touch but that overlap in every configuration: with them there would be no plan. Notes tell which.

    Args:
        robot: with an envelope.
        may_touch: called with the names of two links.
        by: who says so, for the note, as in "the SRDF".
    """
    names = sorted({part.name for part in robot.shapes})
    allowed = {links for links in itertools.combinations(names, 2) if may_touch(*links)}
    asked = [links for links in itertools.combinations(names, 2) if links not in allowed]
    overlaps, ways = _overlaps(robot, names, asked), ways_to_links(robot)
    rigid = {links for links in asked if is_rigid(robot, *(ways[link] for link in links))}
    neighbours = {links for links in _neighbours(robot, set(names)) & overlaps.keys() - rigid if _joined(robot, links)}
    unchecked = [UncheckedPair(links=links, reason="allowed") for links in allowed]
    pairs, stuck, faults = [], [], []
    for links in asked:
        depth, proven = overlaps.get(links, (0.0, False))
        if links in rigid:
            stuck += [(links, "")] if links in overlaps else []
        elif links not in overlaps:
            pairs.append(links)
        elif links in neighbours:
            unchecked.append(UncheckedPair(links=links, reason="adjacent"))
        else:
            unchecked.append(always_meets(robot, links, depth=depth, proven=proven))
            faults.append((links, depth, proven))
    notes = [f"self-collision by {by}: {_pairs_of_links(len(pairs))} must keep clear"]
    notes += _notes_on_pairs(
        stuck,
        one="{} overlap and no joint moves them apart: that pair is not checked",
        several="{} pairs of links overlap and no joint moves them apart: they are not checked",
    )
    notes += _notes_on_pairs(
        [(links, "") for links in sorted(neighbours)],
        one=f"{{}} are neighbours that overlap in every configuration, and {by} does not allow them to: that pair is not "
        "checked",
        several=f"{{}} pairs of neighbours overlap in every configuration, and {by} does not allow them to: they are not "
        "checked",
    )
    notes += _notes_on_overlaps(faults, by=by)
    return replace(robot, self_pairs=tuple(pairs), apart=None, unchecked=tuple(unchecked), notes=(*robot.notes, *notes))


def _overlaps(robot: Robot, names: Sequence[str], asked: list[Pair]) -> dict[Pair, tuple[float, bool]]:
    """Return those of some pairs that overlap in every configuration, with the depth [m] and whether that is proven."""

    def look() -> list[list[Any]]:
        rest, many, found = _Sampled(robot, _samples(robot, 0, 0)), _Sampled(robot, _samples(robot, _SAMPLES, 0)), []
        work = LongWork()
        for i, (first, second) in enumerate(asked):
            what = f"which links overlap in every configuration: pair {i + 1} of {len(asked)}"
            work.say(what, done=i, total=len(asked))
            if distances(rest.place(first), rest.place(second), enough=2 * CONTACT)[0] >= CONTACT:
                continue
            still = not joints_between(rest.bones, rest.bodies[first], rest.bodies[second])
            where = rest if still else many
            if least_distance(where.place(first), where.place(second))[1] == 1:
                depth, proven = where.overlap(first, second)
                found += [] if depth is None else [[first, second, depth, proven]]
        return found

    rows = cached_json("self-overlaps", _ANALYSIS, [fingerprint(robot, names), asked], look)
    return {(first, second): (depth, proven) for first, second, depth, proven in rows}


def _notes_on_overlaps(faults: Sequence[tuple[Pair, float, bool]], *, by: str = "") -> list[str]:
    """Return one note on all pairs that overlap in every configuration, with their depths."""
    unwanted = f", and {by} does not allow them to" if by else ""
    found = [(links, overlap_in_words(depth, proven=proven)) for links, depth, proven in faults]
    return _notes_on_pairs(
        found,
        one=f"{{}}: {{}}{unwanted}: a fault of the model; that pair is not checked; {REMEDY}",
        several=f"{{}} pairs of links overlap in every configuration{unwanted}: faults of the model; they are not checked; "
        f"{REMEDY}",
    )


def _notes_on_pairs(found: list[tuple[tuple[str, str], str]], *, one: str, several: str) -> list[str]:
    """Return one note on all pairs of a kind, each with its share of the samples or ""; `unchecked` of the robot has all."""
    if len(found) < 2:
        return [one.format(called(links), share) for links, share in found]
    said = [f"{called(links)} ({share})" if share else called(links) for links, share in found[:_NAMED]]
    more = f", ... ({len(found) - _NAMED} more)" if len(found) > _NAMED else ""
    return [f"{several.format(len(found))}: {', '.join(said)}{more}"]


def _pairs_of_links(count: int) -> str:
    return f"{count} pair{'' if count == 1 else 's'} of links"


def _samples(robot: Robot, count: int, seed: int) -> Array:
    lower, upper = finite_range(robot)
    q = lower + np.random.default_rng(seed).random((count, robot.dof)) * (upper - lower)
    return np.vstack([np.clip(np.zeros(robot.dof), lower, upper), q])


def _joined(robot: Robot, links: Pair) -> bool:
    """Whether two links are joined at one place, by joints that can move."""
    bodies = link_bodies(robot)
    return _at_one_place(robot, joints_between(robot, *(bodies[link] for link in links)))


def _at_one_place(robot: Robot, between: Sequence[int]) -> bool:
    """Whether one joint moves two links against each other, or several about one point, as in a spherical wrist."""
    joints = [robot.joints[j] for j in between]
    return all(joint.kind == "revolute" and np.abs(joint.T_parent_joint[:3, 3]).max() < _COINCIDENT for joint in joints[1:])


def _neighbours(robot: Robot, links: set[str]) -> set[tuple[str, str]]:
    """Pair each link with the next one towards the base that has an envelope.

    A robot that does not say which frame is whose parent has the links of a joint and its parent joint as neighbours.
    """
    parents = {frame.name: frame.parent for frame in robot.frames}
    if not any(parents.values()):
        joints = {part.name: part.joint for part in robot.shapes}
        above = {name: robot.joints[joint].parent if joint >= 0 else None for name, joint in joints.items()}
        return {(min(a, b), max(a, b)) for a in joints for b in joints if above[a] == joints[b]}
    found = set()
    for link in links:
        parent = parents.get(link, "")
        while parent and parent not in links:
            parent = parents.get(parent, "")
        if parent:
            found.add((min(link, parent), max(link, parent)))
    return found
