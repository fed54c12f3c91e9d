"""What is not kept clear, and why: pairs of links, links without an envelope, and links whose mass nobody knows."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from spacearm.core.checks import UNWRITTEN, Frozen, as_name, as_number, keep, shown
from spacearm.core.errors import RobotError
from spacearm.core.identity_cache import cached_by_identity
from spacearm.geometry.convex_cores import core_of
from spacearm.robot.link_shapes import LinkShape, as_capsule

if TYPE_CHECKING:
    from spacearm.robot.model import Robot

Pair = tuple[str, str]

REASONS = {
    "rigid": "no joint moves them against each other",
    "adjacent": "neighbours",
    "always": "always in contact",
    "changed": "in contact before the robot was changed",
    "allowed": "allowed to touch",
    "touching": "attached, and allowed to touch",
    "not asked for": "not asked for",
}
"""Why a pair of links is not checked, and how that is said."""

_SHORT = {"rigid": "rigid to each other"}  # where no more than a count is said

NAMED = ("always", "changed")
"""Reasons for which messages name the pair: nobody said that it may touch."""

COLLISIONS = ("envelope", "none")
_LISTED = 3  # names in a message, before it would no longer be read
_TOUCHING = 1e-6  # [m] what overlaps by less than this touches

REMEDY = "correct the shapes, or allow the pair in the SRDF"
"""What is to be done about two links that overlap in every configuration."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class UncheckedPair(Frozen):
    """Two links that nobody keeps clear of each other.

    Attributes:
        links: their names, in alphabetical order.
        reason: a key of `REASONS`.
        made_for: of a pair that is always in contact: the hash of the shapes, joints and limits for which that was found;
            for others the pair is not known to be in contact.
        depth: of such a pair: two of its shapes overlap at least so deep in every configuration [m]; 0 if that is not known.
        proven: whether that is proven for all configurations within the limits; else it was so in all that were drawn.

    Raises:
        RobotError: no two names, a reason that is none, or a depth below 0.
    """

    links: Pair
    reason: str
    made_for: str = ""
    depth: float = field(default=0.0, metadata=UNWRITTEN)
    proven: bool = field(default=False, metadata=UNWRITTEN)

    def __post_init__(self) -> None:
        keep(self, links=_as_pair("an unchecked pair", self.links))
        if not isinstance(self.reason, str) or self.reason not in REASONS:
            raise RobotError(f"an unchecked pair has reason {shown(self.reason)}, expected one of {', '.join(REASONS)}")
        keep(self, depth=as_number("an unchecked pair's depth", self.depth, RobotError, at_least=0, unit="m"))
        if not isinstance(self.proven, bool):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise RobotError(f"an unchecked pair's proven is {shown(self.proven)}, expected True or False")

    @property
    def why(self) -> str:
        """The reason in words, with the depth of an overlap."""
        return overlap_in_words(self.depth, proven=self.proven) if self.reason == "always" else REASONS[self.reason]

    @property
    def text(self) -> str:
        """The pair and the reason in words."""
        return f"{called(self.links)} ({self.why})"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class ApartPairs(Frozen):
    """Pairs of links that cannot meet within the limits, so that a search need not look at them. A certificate does.

    Attributes:
        pairs: names of links, two by two.
        made_for: hash of the shapes and joints for which that was found.
        lower, upper: (n,) the limits for which it was found [rad or m], None where a joint has none.

    A robot of other shapes or joints, or with wider limits, checks the pairs.

    Raises:
        RobotError: what is no pair of names.
    """

    pairs: tuple[Pair, ...]
    made_for: str
    lower: tuple[float | None, ...]
    upper: tuple[float | None, ...]

    def __post_init__(self) -> None:
        keep(self, pairs=tuple(sorted({_as_pair("a pair that cannot meet", pair) for pair in self.pairs})))


def _as_pair(what: str, given: Any) -> Pair:
    if not isinstance(given, (tuple, list)) or len(given) != 2 or given[0] == given[1]:
        raise RobotError(f"{what} is {shown(given)}, expected the names of two links")
    first, second = (as_name(f"{what}: a link", name, RobotError) for name in given)
    return min(first, second), max(first, second)


def overlap_in_words(depth: float, *, proven: bool) -> str:
    """Say that two links always overlap, with the depth [m] that they have at least; or that they touch."""
    where = "in every configuration" if proven else "in every configuration that was drawn"
    tenths = math.floor(depth * 1e4)  # of a millimetre
    deep = f" by {tenths / 10:g} mm or more" if tenths else ""
    return f"overlap{deep} {where}" if depth > _TOUCHING else REASONS["always"]


def called(links: Pair) -> str:
    """Return a pair's names for a message."""
    return f"'{links[0]}' and '{links[1]}'"


def fingerprint(robot: Robot, links: Iterable[str], *, limits: bool = True) -> str:
    """Return the SHA-256 of all that decides whether some links can meet: their shapes, the joints, and the limits."""
    wanted, hashed = set(links), hashlib.sha256()
    for joint in robot.joints:
        hashed.update(f"{joint.kind} {joint.parent} {joint.dof} {joint.multiplier!r} {joint.offset!r};".encode())
        hashed.update(joint.T_parent_joint.tobytes())
    if limits:
        hashed.update(robot.lower.tobytes() + robot.upper.tobytes())
    for part in robot.shapes:
        if part.name in wanted:
            _hash_shape(hashed.update, part)
    return hashed.hexdigest()


def _hash_shape(update: Callable[[bytes], None], part: LinkShape) -> None:
    capsule = as_capsule(part)
    if capsule is not None:
        update(f"{part.name!r} {part.joint} {capsule.radius!r};".encode())
        update(capsule.a.tobytes() + capsule.b.tobytes())
        return
    core = core_of(part.shape)
    update(f"{part.name!r} {part.joint} {core.kind} {len(core.vertices)} {core.radius!r};".encode())
    update(core.T.tobytes() + core.half.tobytes() + core.vertices.tobytes())


def apart_pairs(robot: Robot, pairs: Iterable[Pair]) -> ApartPairs | None:
    """Note down for a robot, as it is now, which pairs cannot meet; None if there are none."""
    listed = tuple(pairs)
    if not listed:
        return None
    return ApartPairs(
        pairs=listed,
        made_for=fingerprint(robot, {link for pair in listed for link in pair}, limits=False),
        lower=tuple(value if math.isfinite(value) else None for value in robot.lower.tolist()),
        upper=tuple(value if math.isfinite(value) else None for value in robot.upper.tolist()),
    )


def _within(robot: Robot, apart: ApartPairs) -> bool:
    """Whether a robot's limits lie within those for which pairs of it were found to be apart."""
    if len(apart.lower) != robot.dof or len(apart.upper) != robot.dof:
        return False
    lower = all(low is None or low <= value for low, value in zip(apart.lower, robot.lower.tolist(), strict=True))
    return lower and all(high is None or value <= high for high, value in zip(apart.upper, robot.upper.tolist(), strict=True))


def always_meets(robot: Robot, links: Pair, *, depth: float = 0.0, proven: bool = False) -> UncheckedPair:
    """Note down for a robot, as it is now, that two links are always in contact; arguments as in `UncheckedPair`."""
    return UncheckedPair(links=links, reason="always", made_for=fingerprint(robot, links), depth=depth, proven=proven)


def settled_pairs(robot: Robot) -> dict[str, Any]:
    """Return `self_pairs`, `apart` and `unchecked` of a robot that is being made, so that they fit each other and the rest.

    What the search skipped for other shapes, joints or limits is checked again. What names links without an
    envelope is dropped, as is a reason for not checking a pair that is checked.
    """
    enclosed = {part.name for part in robot.shapes}
    pairs, apart = robot.self_pairs, robot.apart
    if apart is not None:
        left = [pair for pair in apart.pairs if pair not in set(pairs) and enclosed.issuperset(pair)]
        made_for = fingerprint(robot, {link for pair in apart.pairs for link in pair}, limits=False)
        same = made_for == apart.made_for and _within(robot, apart)
        if not same and left:
            pairs = tuple(sorted({*pairs, *left}))
        apart = None if not same else apart if len(left) == len(apart.pairs) else apart_pairs(robot, left)
    checked = {*pairs, *(() if apart is None else apart.pairs)}
    unchecked = {one.links: one for one in robot.unchecked if one.links not in checked and enclosed.issuperset(one.links)}
    return {"self_pairs": pairs, "apart": apart, "unchecked": tuple(unchecked[links] for links in sorted(unchecked))}


def unchecked_pairs(robot: Robot) -> tuple[UncheckedPair, ...]:
    """List every pair of links with an envelope that is not kept clear of each other, with the reason, by name."""
    checked = {*robot.self_pairs, *(() if robot.apart is None else robot.apart.pairs)}
    recorded, ways = {one.links: one for one in robot.unchecked}, ways_to_links(robot)
    out = []
    for links in itertools.combinations(sorted(ways), 2):
        if links in checked:
            continue
        one = recorded.get(links)
        if is_rigid(robot, *(ways[link] for link in links)):
            one = UncheckedPair(links=links, reason="rigid")
        elif one is None or one.reason == "rigid":
            one = UncheckedPair(links=links, reason="not asked for")
        elif one.reason == "always" and one.made_for != fingerprint(robot, links):
            one = UncheckedPair(links=links, reason="changed")
        out.append(one)
    return tuple(out)


def ways_to_links(robot: Robot) -> dict[str, list[frozenset[int]]]:
    """Return for each link with an envelope the joints between the base and what its shapes ride on."""
    carriers: dict[str, set[int]] = {}
    for part in robot.shapes:
        carriers.setdefault(part.name, set()).add(part.joint)
    return {link: [way_to(robot, joint) for joint in joints] for link, joints in carriers.items()}


def way_to(robot: Robot, joint: int) -> frozenset[int]:
    """Return the joints between the base and what rides on a joint, itself included."""
    way = set()
    while joint >= 0:
        way.add(joint)
        joint = robot.joints[joint].parent
    return frozenset(way)


def is_rigid(robot: Robot, first: Sequence[frozenset[int]], second: Sequence[frozenset[int]]) -> bool:
    """Tell whether no joint moves two links against each other, whatever the limits, by the ways to what they ride on."""
    ways = [*first, *second]
    between = frozenset.union(*ways) - frozenset.intersection(*ways)
    return not any(robot.joints[j].multiplier for j in between)


def words_on_unchecked(pairs: Sequence[UncheckedPair], bare: Sequence[str]) -> str:
    """Say in a phrase what is not checked, folded by reason; "" if nothing is to be said.

    Args:
        pairs: all that are not checked; those that nobody said may touch are named.
        bare: links without an envelope; they are named.
    """
    said = []
    if pairs:
        kinds = [_kind([one for one in pairs if one.reason == reason]) for reason in REASONS]
        count = f"{len(pairs)} pair{'s' if len(pairs) > 1 else ''} of links not checked"
        said.append(f"{count}: {', '.join(filter(None, kinds))}")
    if any(one.reason == "always" for one in pairs):
        said.append(f"links that overlap in every configuration are a fault of the model: {REMEDY}")
    if bare:
        said.append(f"kept clear of nothing, for want of an envelope: {_some([repr(link) for link in bare])}")
    return "; ".join(said)


def _kind(pairs: Sequence[UncheckedPair]) -> str:
    """Count the pairs with one reason; name them, if nobody said that they may touch."""
    if not pairs:
        return ""
    reason = pairs[0].reason
    if reason not in NAMED:
        return f"{len(pairs)} {_SHORT.get(reason, REASONS[reason])}"
    named = [f"{called(one.links)} {one.why if one.depth else ''}".strip() for one in pairs]
    return f"{len(pairs)} {REASONS[reason]} ({_some(named)})"


def rows_on_unchecked(pairs: Sequence[UncheckedPair], bare: Sequence[str]) -> list[tuple[str, str]]:
    """Return all that is not checked as rows of a list: a name, and the pairs with one reason."""
    rows = []
    for reason, words in REASONS.items():
        found = [one for one in pairs if one.reason == reason]
        listed = [" - ".join(one.links) + (f" {one.why}" if one.depth else "") for one in found]
        remedy = f"; a fault of the model: {REMEDY}" if reason == "always" else ""
        if listed:
            count = f"{len(listed)} pair{'s' if len(listed) > 1 else ''}"
            rows.append(("not checked", f"{count}, {words}: {', '.join(listed)}{remedy}"))
    if bare:
        rows.append(("no envelope", ", ".join(bare)))
    return rows


def _some(words: Sequence[str]) -> str:
    more = len(words) - _LISTED
    return ", ".join(words[:_LISTED]) + (f" and {more} more" if more > 0 else "")


def lacks_envelope(robot: Robot) -> str:
    """Say that a robot has no envelope, unless none is meant; "" if all is well."""
    if robot.collision == "none" or robot.shapes:
        return ""
    return (
        f"robot '{robot.name}' has no envelope: none of its links has a collision shape, so it would be kept clear of nothing; "
        "give it shapes ('spacearm doctor --fix' takes those that are drawn), or say that none is meant, with "
        "collision='none'"
    )


def require_envelope(robot: Robot) -> None:
    """Refuse a robot without an envelope, unless none is meant.

    Raises:
        RobotError: it has none.
    """
    lacking = lacks_envelope(robot)
    if lacking:
        raise RobotError(lacking)


def notes_on_envelope(robot: Robot) -> tuple[str, ...]:
    """Say in notes that a robot has no envelope, or which of its links have none; frames without a shape need none."""
    lacking, bare = lacks_envelope(robot), bare_links(robot)
    if lacking:
        return (lacking,)
    if not bare:
        return ()
    return (f"no envelope, for want of a collision shape: {', '.join(bare)}; they are kept clear of nothing",)


@cached_by_identity
def bare_links(robot: Robot) -> tuple[str, ...]:
    """List the links that have a shape or a mass in their file, but no envelope; none if none is meant to have one.

    Where no file tells, these are what a joint moves on which no shape rides: bodies away from its origin, and what reaches
    from it to a next joint or to the end effector.
    """
    if robot.collision == "none":
        return ()
    enclosed, carrying = {part.name for part in robot.shapes}, {part.joint for part in robot.shapes}
    free = [body for body in robot.bodies if body.joint >= 0 and body.joint not in carrying]
    solid = [*robot.solid, *(body.name for body in free if body.mass > 0 and body.com.any())]
    if not robot.solid:
        solid += _spanning(robot, carrying | {body.joint for body in free if body.name in solid})
    return tuple(dict.fromkeys(link for link in solid if link not in enclosed))


def _spanning(robot: Robot, known: set[int]) -> list[str]:
    """Name what reaches from one joint to the next or to the end effector, of joints that are not known.

    A frame in the joint's origin has the link's name; without one it is the joint's.
    """
    long = {joint.parent for joint in robot.joints if joint.parent >= 0 and joint.T_parent_joint[:3, 3].any()}
    long |= {frame.joint for frame in robot.frames if frame.name == robot.tip and frame.T_joint_frame[:3, 3].any()} - {-1}
    names = {frame.joint: frame.name for frame in robot.frames if not frame.T_joint_frame[:3, 3].any()}
    return [names.get(i, robot.joints[i].name) for i in sorted(long - known)]


def without_mass(robot: Robot) -> tuple[tuple[str, str], ...]:
    """List the links that have a shape but no mass that is known, each with the reason; a robot that floats may have none.

    Besides those that the robot itself names, these are links on a joint on which no body rides, not even one of 0 kg.
    """
    weighed = {body.joint for body in robot.bodies}
    known = dict(robot.unweighed)
    for part in robot.shapes:
        if part.joint >= 0 and part.joint not in weighed:
            known.setdefault(part.name, "none is stated")
    return tuple(known.items())


def lacks_masses(robot: Robot) -> str:
    """Say that a robot cannot float since the mass of some links is not known, and what to give; "" if all are."""
    lacking = without_mass(robot)
    if not lacking:
        return ""
    payloads = [name for name, why in lacking if why == NOT_SAID]
    advice = []
    if payloads:
        advice.append("give hold(..., mass=...), in a problem file `mass` beside the shape of the payload")
    if len(payloads) < len(lacking):
        advice.append("give each link an <inertial> with mass and inertia (mass 0 if a link that is fixed to it has it)")
    listed = _some([f"'{name}' ({why})" for name, why in lacking])
    return (
        f"robot '{robot.name}' cannot float: the mass of {listed} is not known, and "
        f"where the base goes depends on it; {', and '.join(advice)}, or plan with base='fixed'"
    )


def require_all_masses(robot: Robot) -> None:
    """Refuse a robot that is to float and has links whose mass is not known.

    Raises:
        RobotError: it has some; they are named, with what to give.
    """
    lacking = lacks_masses(robot)
    if lacking:
        raise RobotError(lacking)


NOT_SAID = "held, and nothing says what it weighs"
"""Why a payload has no mass."""


def known_unweighed(robot: Robot) -> tuple[tuple[str, str], ...]:
    """Return a robot's `unweighed`, while it is being made: once each, and without those that have a mass by now."""
    weighed = {body.name for body in robot.bodies if body.mass > 0}
    out: dict[str, str] = {}
    for entry in robot.unweighed:
        if not isinstance(entry, (tuple, list)) or len(entry) != 2:
            raise RobotError(f"unweighed holds {shown(entry)}, expected a link's name and why its mass is not known")
        name, why = entry
        if as_name("unweighed: a link", name, RobotError) not in weighed:
            out.setdefault(name, as_name("unweighed: why", why, RobotError))
    return tuple(out.items())
