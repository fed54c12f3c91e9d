"""Which pairs of bodies are near at the start or the goal, what they have there, and when they are out.

All of this is measured, and nothing proven rests on it: a measured instant only says up to where a pair is held to less than
the required clearance, and the proof has to succeed with that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel._measure import Clearances
from spacearm.core.identity_cache import cached_by_identity
from spacearm.proof.bodies import JointMap
from spacearm.proof.claim import Claim
from spacearm.proof.convex_bodies import WORLD, BodyPairs, ConvexBodies
from spacearm.proof.pair_requirements import NearEnd
from spacearm.proof.required_clearance import held_to, out_level
from spacearm.proof.witness import Witness
from spacearm.robot import Robot

Array = NDArray[np.float64]
Pair = tuple[int, int]

_AROUND = 2.5e-4  # [m] above the required clearance it does not matter what a pair has: it is out
_TOUCHING = 1e-13  # [m] what has no more at an end touches there: it is the rounding of numbers of a few metres
_INSTANTS = 128  # at which it is measured whether near pairs are out
_ZOOMS, _ZOOM_INSTANTS = 2, 17  # how often, and at how many instants, between the last that is not out and the first that is


# ---- Clearances at instants ------------------------------------------------------------------------------------------


def frames_at(claim: Claim, u: Array) -> Array:
    """Return where the frames of a claim's bodies are (r, j + 2, 3, 4) at parameters (r,) of its curve.

    The inertial frame comes first, then the base and the joints' frames.
    """
    witness, joints = _kinematics(claim.robot)
    placed = claim.base.placed(u, witness.frames(joints.values(claim.base.curve.sample(u))))
    out = np.empty((len(u), placed.shape[1] + 1, 3, 4))
    out[:, 0] = np.eye(4)[:3]
    out[:, 1], out[:, 2:] = placed[:, -1, :3], placed[:, :-1, :3]
    return out


def least_clearances(claim: Claim, u: Array, limit: Array | None = None) -> Array:
    """Measure the least clearance of every link and every other body at instants.

    Args:
        claim: the bodies, the pairs of them that are kept apart, and their path.
        u: (r,) the instants, in the parameter of the curve.
        limit: (l, k + l) above it clearances need not be exact; pairs with minus infinity are left out [m]. None: a quarter of
            a millimetre above what is required of pairs of which more than 0 is.

    Returns:
        (r, l, k + l) by link and other body, obstacles first, then links, in metres: at most the limit. Two links are in the
        row of the one that comes first. Pairs that are left out have infinity. Where the cores of two bodies meet, it is no
        depth of penetration, but 0 or less.
    """
    if limit is None:
        limit = _limit(required_by_owner(claim))
    fill = np.where(np.isfinite(limit), limit, np.inf)
    return _clearances(claim.bodies, claim.pairs).least(frames_at(claim, u), limit, fill)


def required_by_owner(claim: Claim) -> Array:
    """Return what is required of every link and other body (l, k + l), obstacles first, then links [m]."""
    bodies, held = claim.bodies, claim.held
    links, obstacles = len(held.required), len(claim.scene.obstacles)
    out = np.zeros((links, obstacles + links))
    shapes = np.flatnonzero((bodies.members == 0) & (bodies.owner >= 0))
    column = np.where(bodies.frame[shapes] == WORLD, bodies.owner[shapes], obstacles + bodies.owner[shapes])
    out[:, column] = held.required[:, shapes]
    return out


def _limit(required: Array) -> Array:
    return np.where(required > 0, required + _AROUND, -np.inf)


@cached_by_identity
def _kinematics(robot: Robot) -> tuple[Witness, JointMap]:
    return Witness(robot), JointMap(robot)


@cached_by_identity
def _tables(_: ConvexBodies) -> dict[int, tuple[BodyPairs, Clearances]]:
    """Return room for the tables of bodies, by the identity of the pairs that are kept with them."""
    return {}


def _clearances(bodies: ConvexBodies, pairs: BodyPairs) -> Clearances:
    made = _tables(bodies)
    if id(pairs) not in made:
        if len(made) >= 4:
            made.clear()
        columns = {
            name: np.ascontiguousarray(getattr(bodies, name))
            for name in (
                *("frame", "first_point", "points", "vertices", "disc", "axis", "radius", "center", "reach", "half_space"),
                *("first_member", "members", "owner"),
            )
        }
        made[id(pairs)] = pairs, Clearances(**columns, first=pairs.first, other=pairs.other)
    return made[id(pairs)][1]


# ---- Near pairs ------------------------------------------------------------------------------------------------------


def find_near(claim: Claim) -> tuple[NearEnd, ...]:
    """Measure which pairs are near at the start or the goal, and when they are out.

    Args:
        claim: what is required of the pairs; which of them are near in it does not matter.
    """
    required = required_by_owner(claim)
    if not (required > 0).any():
        return ()
    domain = claim.base.curve.domain
    limit = _limit(required)
    at_ends = least_clearances(claim, np.array(domain), limit)
    if not (at_ends < limit).any():
        return ()
    at_ends[at_ends <= _TOUCHING] = 0.0
    near = (held_to(at_ends, required) < required).any(axis=0)
    pairs: list[Pair] = [(int(link), int(other)) for link, other in np.argwhere(near)]
    if not pairs:
        return ()
    link, other = np.transpose(pairs)
    at_start, at_goal = at_ends[:, link, other]
    until, since, level = _out(claim, required, pairs, at_start, at_goal)
    held = required[link, other]
    columns = (held, at_start, at_goal, until, since, level - held)
    return tuple(NearEnd(*pair, *row) for pair, row in zip(pairs, np.transpose(columns).tolist(), strict=True))


def _out(claim: Claim, required: Array, pairs: list[Pair], at_start: Array, at_goal: Array) -> tuple[Array, Array, Array]:
    """Return up to when pairs (m,) are held to what they have at the start, and since when to what they have at the goal.

    Args:
        claim, required: what it is about.
        pairs: the pairs that are near at an end.
        at_start, at_goal: (m,) what they have there [m].

    Returns:
        `NearEnd.until` and `NearEnd.since`, and the clearances from which on they are out [m], (m,) each.
    """
    held = required[tuple(np.transpose(pairs))]
    starts_near, ends_near = held_to(at_start, held) < held, held_to(at_goal, held) < held
    u = np.linspace(*claim.base.curve.domain, _INSTANTS + 1)
    clearances = _of_pairs(claim, required, u, pairs)
    level = out_level(clearances.max(axis=0), held)
    out = clearances >= level
    never, first, last = ~out.any(axis=0), np.argmax(out, axis=0), _INSTANTS - np.argmax(out[::-1], axis=0)
    until = np.where(never & starts_near, np.inf, -np.inf)
    since = np.where(never & ~starts_near, -np.inf, np.inf)
    begin, end = np.flatnonzero(starts_near & ~never), np.flatnonzero(ends_near & ~never)
    inside = np.concatenate([np.maximum(0, first[begin] - 1), np.minimum(_INSTANTS, last[end] + 1)])
    outside, some = np.concatenate([first[begin], last[end]]), np.concatenate([begin, end])
    crossed = _crossings(claim, required, [pairs[i] for i in some.tolist()], level[some], u[inside], u[outside])
    until[begin], since[end] = crossed[: len(begin)], crossed[len(begin) :]
    return until, since, level


def _crossings(claim: Claim, required: Array, pairs: list[Pair], level: Array, inside: Array, outside: Array) -> Array:
    """Return instants (m,) at which pairs are out, soon after they become so between an instant inside and one outside.

    Args:
        claim, required: what it is about.
        pairs, level: (m,) the pairs, and the clearances from which on they are out [m].
        inside, outside: (m,) the instants.
    """
    which = np.arange(len(pairs))
    for _ in range(_ZOOMS if pairs else 0):
        between = np.linspace(inside, outside, _ZOOM_INSTANTS)  # (i, m)
        found = _of_pairs(claim, required, between.ravel(), pairs).reshape(*between.shape, len(pairs))
        k = np.maximum(1, np.argmax(found[:, which, which] >= level, axis=0))
        inside, outside = between[k - 1, which], between[k, which]
    return outside


def _of_pairs(claim: Claim, required: Array, u: Array, pairs: list[Pair]) -> Array:
    """Return the clearances of some pairs (r, number of pairs) at instants, or a little more than required if it is more."""
    limit, obstacles = np.full(required.shape, -np.inf), required.shape[1] - len(required)
    for link, other in pairs:
        limit[link, other] = required[link, other] + _AROUND
        if other >= obstacles:
            limit[other - obstacles, obstacles + link] = limit[link, other]
    least = least_clearances(claim, u, limit)
    return np.stack([least[:, link, other] for link, other in pairs], axis=1)
