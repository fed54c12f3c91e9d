"""Which pairs of bodies are near at the start or the goal, what they have there, and when they are out.

All of this is measured, and nothing proven rests on it: a measured instant only says up to where a pair is held to less than
the required clearance, and the proof has to succeed with that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.claim import Claim, NearEnd
from spacearm.proof.measured import least_clearances, limit_of, required_by_owner
from spacearm.proof.required_clearance import held_to, out_level

Array = NDArray[np.float64]
Pair = tuple[int, int]

_TOUCHING = 1e-13  # [m] what has no more at an end touches there: it is the rounding of numbers of a few metres
_INSTANTS = 128  # at which it is measured whether near pairs are out
_ZOOMS, _ZOOM_INSTANTS = 2, 17  # how often, and at how many instants, between the last that is not out and the first that is


def find_near(claim: Claim) -> tuple[NearEnd, ...]:
    """Measure which pairs are near at the start or the goal, and when they are out.

    With a tracking error, what a pair has is what it has at least within the tube: its clearance less what the error may take.

    Args:
        claim: what is required of the pairs; which of them are near in it does not matter.
    """
    required = required_by_owner(claim)
    if not (required > 0).any():
        return ()
    domain = claim.base.curve.domain
    at_ends, which = least_clearances(claim, np.array(domain), in_tube=True)
    if (which < 0).all():
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
    """Return the clearances (r, number of pairs) of some pairs at instants, or a little more than required if it is more."""
    least, _ = least_clearances(claim, u, limit_of(required, pairs), in_tube=True)
    link, other = np.transpose(pairs)
    return least[:, link, other]
