"""Which links of a robot must keep clear of each other, found from its envelope and its joints.

Sampling alone proves nothing, so a pair is unchecked only for a reason that holds: no joint moves the two against each other;
they are neighbours, and the limits of the joint between them must keep them apart; or their envelopes meet nearly always, so
that they say nothing. Each is recorded in `Robot.unchecked`. A pair that is proven never to meet (`never_meet`) is left to the
certificate, which proves it like any other; the search skips it, and `Robot.apart` records it. A pair that is merely never seen
to meet is checked.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import as_whole
from spacearm.core.errors import RobotError
from spacearm.robot.capsules import CONTACT, Axes, PlacedAxes, clearance, least_clearance, link_axes, placed
from spacearm.robot.kinematics import base_and_joint_frames, skeleton
from spacearm.robot.model import Robot, require_robot
from spacearm.robot.unchecked_pairs import UncheckedPair, always_meets, apart_pairs, called, is_rigid, ways_to_links

Array = NDArray[np.float64]

Reason = Literal["checked", "rigid", "adjacent", "always", "cannot meet"]

VAST = 1e6
"""Limits beyond this are none [rad or m]."""

ALWAYS = 0.95
"""Share of the samples from which on a pair counts as one that always meets."""

_SAMPLES = 1000
_NAMED = 6  # pairs that a note names
_COINCIDENT = 1e-9  # [m] joints whose origins are nearer than this turn about one point
_TOUCHING = 1e-6  # [m] links that only a locked joint is between are told from touching ones by this
_JOINTS = 4  # boxes of more dimensions are too many
_BOXES = 10_000  # boxes that are looked at before giving up
_AT_ONCE = 64  # boxes to begin with, since as many cost no more than one
_ROUNDING = 1e-9  # [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkPair:
    """What was found about two links.

    Attributes:
        links: their names, in alphabetical order.
        reason: "checked" if they must keep clear; else why not: "rigid" (no joint moves them against each
            other, or none that its limits let move), "adjacent" (neighbours, whose envelopes meet in some
            configurations: the limits of the joint between them must keep them apart), "always" (their
            envelopes meet in nearly every configuration), "cannot meet" (proven for every configuration within
            the limits).
        met: share of the samples in which their envelopes met [-].
        clearance: the least signed distance in any sample [m].
    """

    links: tuple[str, str]
    reason: Reason
    met: float
    clearance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SelfPairs:
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
            if one.reason == "always" or (locked and one.clearance <= _TOUCHING):
                unchecked.append(always_meets(robot, one.links))
            elif one.reason == "cannot meet" or locked:
                apart.append(one.links)
            elif one.reason == "adjacent":
                unchecked.append(UncheckedPair(links=one.links, reason="adjacent"))
        return replace(robot, self_pairs=self.pairs, apart=apart_pairs(robot, apart), unchecked=tuple(unchecked))

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence on the whole, and one on each kind of unchecked pairs that can meet."""
        counts = Counter(pair.reason for pair in self.found)
        others = ", ".join(f"{counts[why]} {why}" for why in ("rigid", "adjacent", "cannot meet") if counts[why])
        notes = [
            f"self-collision was computed: {_pairs_of_links(len(self.pairs))} must keep clear"
            + (f" (not in the search: {others})" if others else "")
        ]
        always = [(pair.links, f"{pair.met:.0%}") for pair in self.found if pair.reason == "always"]
        notes += _notes_on_pairs(
            always,
            one="the envelopes of {} meet in {} of all configurations: that pair is not checked",
            several=f"the envelopes of {{}} pairs of links meet in {ALWAYS:.0%} or more of all configurations: they are not "
            "checked",
        )
        near = [(pair.links, f"{pair.met:.1%}") for pair in self.found if pair.reason == "adjacent" and 0 < pair.met < ALWAYS]
        return (
            *notes,
            *_notes_on_pairs(
                near,
                one="{} are neighbours and their envelopes meet in {} of all configurations: that pair is not checked, the "
                "joint's limits must keep them apart",
                several="{} pairs of neighbours have envelopes that meet in some configurations: they are not checked, the "
                "limits of the joints between them must keep them apart",
            ),
        )


def find_self_pairs(robot: Robot, *, samples: int = _SAMPLES, seed: int = 0) -> SelfPairs:
    """Find the pairs of links that must keep clear of each other.

    Args:
        robot: with an envelope.
        samples: number of random configurations to look at, besides the one nearest to 0.
        seed: of their random numbers; the same seed gives the same answer.

    Raises:
        RobotError: `samples` or `seed` is no whole number, 0 or more.
    """
    require_robot(robot)
    q = _samples(robot, as_whole("samples", samples, RobotError, at_least=0), as_whole("seed", seed, RobotError, at_least=0))
    axes, bones = link_axes(robot), skeleton(robot)
    frames = base_and_joint_frames(bones, q)
    where = {name: placed(axes[name], frames) for name in axes}
    neighbours = {pair for pair in _neighbours(robot, set(axes)) if _at_one_place(robot, axes[pair[0]], axes[pair[1]])}
    found = []
    for first, second in itertools.combinations(sorted(axes), 2):
        least, met = least_clearance(where[first], where[second])
        reason = _reason(bones, axes[first], axes[second], met, (first, second) in neighbours)
        found.append(LinkPair(links=(first, second), reason=reason, met=met, clearance=least))
    return SelfPairs(found=tuple(found), samples=len(q))


def with_allowed_pairs(robot: Robot, may_touch: Callable[[str, str], bool], *, by: str) -> Robot:
    """Return the robot with the pairs of links that must keep clear where somebody else says which may touch.

    Left out and recorded are those that may touch, those that no joint moves against each other, and those that nobody
    allows to touch but that meet in every configuration: with them there would be no plan. A note says which.

    Args:
        robot: with an envelope.
        may_touch: called with the names of two links.
        by: who says so, for the note, as in "the SRDF".
    """
    axes, bones = link_axes(robot), skeleton(robot)
    frames = base_and_joint_frames(bones, _samples(robot, 0, 0))
    where = {name: placed(axes[name], frames) for name in axes}
    many: dict[str, PlacedAxes] = {}  # of the links that meet where all joints are at rest
    pairs, unchecked, stuck, always, ways = [], [], [], [], ways_to_links(robot)
    for links in itertools.combinations(sorted(axes), 2):
        if may_touch(*links):
            unchecked.append(UncheckedPair(links=links, reason="allowed"))
            continue
        tied = is_rigid(robot, *(ways[link] for link in links))
        meet = bool(clearance(*(where[link] for link in links))[0] < CONTACT)
        if tied and meet:
            stuck.append((links, ""))
        if tied:
            continue
        if meet:
            if not many:
                frames = base_and_joint_frames(bones, _samples(robot, _SAMPLES, 0))
            for link in links:
                many.setdefault(link, placed(axes[link], frames))
            meet = least_clearance(*(many[link] for link in links))[1] == 1
        if not meet:
            pairs.append(links)
            continue
        unchecked.append(always_meets(robot, links))
        always.append((links, ""))
    notes = [f"self-collision by {by}: {_pairs_of_links(len(pairs))} must keep clear"]
    notes += _notes_on_pairs(
        stuck,
        one="the envelopes of {} meet and no joint moves them apart: that pair is not checked",
        several="the envelopes of {} pairs of links meet and no joint moves them apart: they are not checked",
    )
    notes += _notes_on_pairs(
        always,
        one=f"the envelopes of {{}} meet in every configuration, and {by} does not allow them to: that pair is not checked",
        several=f"the envelopes of {{}} pairs of links meet in every configuration, and {by} does not allow them to: they are "
        "not checked",
    )
    return replace(robot, self_pairs=tuple(pairs), apart=None, unchecked=tuple(unchecked), notes=(*robot.notes, *notes))


def _notes_on_pairs(found: list[tuple[tuple[str, str], str]], *, one: str, several: str) -> list[str]:
    """Return one note on all pairs of a kind, each with its share of the samples or ""; `unchecked` of the robot has all."""
    if len(found) < 2:
        return [one.format(called(links), share) for links, share in found]
    said = [f"{called(links)} ({share})" if share else called(links) for links, share in found[:_NAMED]]
    more = f", ... ({len(found) - _NAMED} more)" if len(found) > _NAMED else ""
    return [f"{several.format(len(found))}: {', '.join(said)}{more}"]


def _pairs_of_links(count: int) -> str:
    return f"{count} pair{'' if count == 1 else 's'} of links"


def _reason(robot: Robot, first: Axes, second: Axes, met: float, neighbours: bool) -> Reason:
    between = joints_between(robot, first, second)
    if not between:
        return "rigid"
    if neighbours and met > 0:
        return "adjacent"
    if met >= ALWAYS:
        return "always"
    proven = None if met > 0 else never_meet(robot, first, second, between)
    if proven:
        return "cannot meet"
    return "adjacent" if neighbours else "checked"


def _samples(robot: Robot, count: int, seed: int) -> Array:
    lower, upper = finite_range(robot)
    q = lower + np.random.default_rng(seed).random((count, robot.dof)) * (upper - lower)
    return np.vstack([np.clip(np.zeros(robot.dof), lower, upper), q])


def finite_range(robot: Robot) -> tuple[Array, Array]:
    """Return limits (n,) and (n,) between which configurations are drawn: one turn where there are none."""
    lower, upper = np.where(robot.lower < -VAST, -np.inf, robot.lower), np.where(robot.upper > VAST, np.inf, robot.upper)
    free = np.isinf(lower) & np.isinf(upper)
    lower[free], upper[free] = -math.pi, math.pi
    lower, upper = np.where(np.isinf(lower), upper - 2 * math.pi, lower), np.where(np.isinf(upper), lower + 2 * math.pi, upper)
    return lower, upper


def _at_one_place(robot: Robot, first: Axes, second: Axes) -> bool:
    """Whether one joint moves two links against each other, or several about one point, as in a spherical wrist."""
    between = [robot.joints[j] for j in joints_between(robot, first, second)]
    return all(joint.kind == "revolute" and np.abs(joint.T_parent_joint[:3, 3]).max() < _COINCIDENT for joint in between[1:])


def _neighbours(robot: Robot, links: set[str]) -> set[tuple[str, str]]:
    """Pair each link with the next one towards the base that has an envelope.

    A robot that does not say which frame is whose parent has the links of a joint and its parent joint as neighbours.
    """
    parents = {frame.name: frame.parent for frame in robot.frames}
    if not any(parents.values()):
        joints = {capsule.name: capsule.joint for capsule in robot.capsules}
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


def joints_between(robot: Robot, first: Axes, second: Axes) -> list[int]:
    """List the joints that move two links against each other; those whose limits are one value do not move."""
    ways: list[set[int]] = []
    for axes in (first, second):
        for joint in {int(j) for j in axes.joint}:
            way = set()
            while joint >= 0:
                way.add(joint)
                joint = robot.joints[joint].parent
            ways.append(way)
    between = set.union(*ways) - set.intersection(*ways)
    return [j for j in sorted(between) if _moves(robot, j)]


def never_meet(robot: Robot, first: Axes, second: Axes, between: list[int]) -> bool | None:
    """Try to prove that two links never meet within the limits.

    The distance of two links changes at most as fast as their points move against each other: per radian of a joint between
    them by the reach of the points beyond it from its axis, per metre of a sliding joint by a metre. So where, in the middle of
    a box of joint values, the clearance is more than the half edges of the box allow, the whole box is clear; other boxes are
    halved.

    Args:
        robot: the robot.
        first, second: the envelopes of the links.
        between: `joints_between` of them.

    Returns:
        True if they cannot meet, False if a configuration was found in which they do, None if neither.
    """
    dofs = sorted({robot.joints[j].dof for j in between})
    lower, upper = _whole_range(robot, dofs, between)
    if len(dofs) > _JOINTS or max(np.abs(lower).max(), np.abs(upper).max()) > VAST:
        return None
    speed = np.zeros(len(dofs))  # of the distance, per unit of each dof
    for j in between:
        speed[dofs.index(robot.joints[j].dof)] += abs(robot.joints[j].multiplier) * _reach(robot, j, first, second, between)
    q_rest = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
    centers, half, seen = ((lower + upper) / 2)[None], (upper - lower) / 2, 0
    while len(centers) < _AT_ONCE:
        centers = _halved(centers, half, speed)
    while len(centers):
        seen += len(centers)
        if seen > _BOXES:
            return None
        q = np.tile(q_rest, (len(centers), 1))
        q[:, dofs] = centers
        frames = base_and_joint_frames(robot, q)
        moved = float(speed @ half) + _ROUNDING  # at most, from the middle of a box
        gap = clearance(placed(first, frames), placed(second, frames), up_to=moved)
        if (gap < 0).any():
            return False
        centers = _halved(centers[gap <= moved], half, speed)
    return True


def _halved(centers: Array, half: Array, speed: Array) -> Array:
    """Cut every box in two where it moves the links most; `half`, the half edges (k,), is changed in place."""
    widest = int(np.argmax(speed * half))
    half[widest] /= 2
    step = np.zeros(len(half))
    step[widest] = half[widest]
    return np.concatenate([centers - step, centers + step])


def _moves(robot: Robot, joint: int) -> bool:
    dof = robot.joints[joint].dof
    return bool(robot.lower[dof] < robot.upper[dof]) and robot.joints[joint].multiplier != 0.0


def _whole_range(robot: Robot, dofs: list[int], between: list[int]) -> tuple[Array, Array]:
    """Return the limits of the dofs; a joint that turns a whole turn or more needs but one."""
    lower, upper = robot.lower[dofs].copy(), robot.upper[dofs].copy()
    for i, dof in enumerate(dofs):
        moved = [robot.joints[j] for j in between if robot.joints[j].dof == dof]
        if float(upper[i]) - float(lower[i]) > 2 * math.pi and all(
            j.kind == "revolute" and abs(j.multiplier) == 1.0 for j in moved
        ):
            lower[i], upper[i] = -math.pi, math.pi
    return lower, upper


def _reach(robot: Robot, joint: int, first: Axes, second: Axes, between: list[int]) -> float:
    """Bound how far points of the links beyond a joint, on the side away from the base, are from its axis [m]."""
    if robot.joints[joint].kind == "prismatic":
        return 1.0
    return max(_reach_of(robot, joint, axes) for axes in (first, second))


def _reach_of(robot: Robot, joint: int, axes: Axes) -> float:
    furthest = 0.0
    for j, a, b in zip(axes.joint, axes.a, axes.b, strict=True):
        at, across = int(j), max(math.hypot(p[0], p[1]) for p in (a, b))
        ball = max(float(np.linalg.norm(p)) for p in (a, b))  # about the origin of the joint's frame
        while at >= 0 and at != joint:
            here = robot.joints[at]
            slide = 0.0
            if here.kind == "prismatic":
                ends = (robot.lower[here.dof], robot.upper[here.dof])
                slide = max(abs(here.multiplier * end + here.offset) for end in ends)
            offset = here.T_parent_joint[:3, 3]
            across = math.hypot(offset[0], offset[1]) + ball + slide
            ball = float(np.linalg.norm(offset)) + ball + slide
            at = here.parent
        if at == joint:
            furthest = max(furthest, across)
    return furthest
