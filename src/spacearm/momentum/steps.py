"""Integration of an attitude: steps as long as their errors allow, and the attitude after each.

Errors of turns add up and are not magnified on the way, since turning both changes no angle between them. So each step may
have the share of the error allowed that its length has of the whole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import length, product
from spacearm.momentum.magnus import NODES, PARTIAL, step_turn
from spacearm.momentum.turning import angle, conjugate, exponential, multiplied, rotated, running_products

Array = NDArray[np.float64]

Field = Callable[[Array], tuple[Array, Array | None]]
"""At v (m,): the rates (m, 3) without angular momentum, and what times that, in base axes, adds to them (m, 3, 3) or None."""

_HALVED = 32  # of the difference between a step and its halves, a share left in these; 63 as steps become short
_LEAST = 1e-15  # [rad] differences this small are rounding
_MOST_STEPS = 1 << 15
_SWEEPS = 60
_SETTLED = 2e-15  # of quaternions and turns
_TUMBLE = 1.0  # [rad] turned by the momentum in steps that are solved together


class Steps(NamedTuple):
    """Attitudes after steps of an independent variable v.

    Attributes:
        nodes: (m + 1,) where steps begin and end.
        attitude_wxyz: (m + 1, 4) there, in the inertial frame.
        error: estimate of the greatest error of these [rad].
    """

    nodes: Array
    attitude_wxyz: Array
    error: float


class _Spans(NamedTuple):
    """Steps from `begin`, with the field at their nodes: free (..., 3, 3), spin (..., 3, 3, 3) or None."""

    begin: Array
    length: Array
    free: Array
    spin: Array | None

    def take(self, which: NDArray[np.bool_]) -> _Spans:
        return _Spans(*(None if part is None else part[which] for part in self))  # type: ignore[arg-type]

    def in_a_row(self) -> _Spans:
        """Return pairs of halves (m, 2, ...) as steps (2 m, ...)."""
        return _Spans(*(None if part is None else part.reshape(-1, *part.shape[2:]) for part in self))  # type: ignore[arg-type]


def adaptive_steps(field: Field, nodes: Array, start_wxyz: Array, angular: Array, tolerance: float) -> Steps:
    """Integrate an attitude, halving steps until the estimated error is at most the tolerance.

    Args:
        field: the rates.
        nodes: (m + 1,) of the first steps: where the field is not smooth, and enough to see how it runs.
        start_wxyz: (4,) at the first.
        angular: (3,) momentum, in the inertial frame.
        tolerance: of the attitude at all nodes [rad]; where rounding or the number of steps is in the way, it is exceeded.
    """
    wholes = _spans(field, nodes[:-1], np.diff(nodes))
    halves = _halves(field, wholes)
    while True:
        flat = halves.in_a_row()
        attitude, turns = _chained(flat, start_wxyz, angular)
        single = exponential(_independent(wholes, attitude[:-1:2], angular))
        left = angle(multiplied(conjugate(single), multiplied(turns[::2], turns[1::2])))
        shares = tolerance * wholes.length / wholes.length.sum()
        split = (left / _HALVED > shares) & (left > _LEAST)
        error = float(left.sum()) / _HALVED
        if error <= tolerance or not split.any() or len(split) > _MOST_STEPS:
            return Steps(np.append(flat.begin, nodes[-1]), attitude, error + _LEAST)
        fresh = halves.take(split).in_a_row()
        order = np.argsort(np.concatenate([wholes.begin[~split], fresh.begin]))
        wholes, halves = (
            _joined(kept.take(~split), new, order) for kept, new in ((wholes, fresh), (halves, _halves(field, fresh)))
        )


def attitude_within(field: Field, steps: Steps, v: Array, angular: Array) -> Array:
    """Return the attitude (m, 4) at v (m,): one short step from the node before each."""
    node = np.clip(np.searchsorted(steps.nodes, v, side="right") - 1, 0, len(steps.nodes) - 1)
    start = steps.attitude_wxyz[node]
    spans = _spans(field, steps.nodes[node], v - steps.nodes[node])
    out = multiplied(start, exponential(_independent(spans, start, angular)))
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def _spans(field: Field, begin: Array, length: Array) -> _Spans:
    at = begin[..., None] + length[..., None] * NODES[6]
    free, spin = field(at.ravel())
    return _Spans(begin, length, free.reshape(*at.shape, 3), None if spin is None else spin.reshape(*at.shape, 3, 3))


def _halves(field: Field, spans: _Spans) -> _Spans:
    """Return each step's halves, (m, 2, ...)."""
    half = spans.length / 2
    return _spans(field, np.stack([spans.begin, spans.begin + half], axis=1), np.stack([half, spans.length - half], axis=1))


def _joined(a: _Spans, b: _Spans, order: NDArray[np.int64]) -> _Spans:
    pairs = zip(a, b, strict=True)
    return _Spans(*(None if x is None or y is None else np.concatenate([x, y])[order] for x, y in pairs))  # type: ignore[arg-type]


def _independent(spans: _Spans, attitude: Array, angular: Array) -> Array:
    """Return the turns (m, 3) of steps that begin at attitudes (m, 4)."""
    if spans.spin is None:
        return step_turn(spans.free, spans.length)
    within, turn = np.zeros_like(spans.free), np.zeros_like(attitude[:, 1:])
    for _ in range(_SWEEPS):
        turn, now = _swept(spans, attitude, within, angular)
        change, within = np.abs(now - within).max(initial=0.0), now
        if change < _SETTLED:
            break
    return turn


def _swept(spans: _Spans, attitude: Array, within: Array, angular: Array) -> tuple[Array, Array]:
    """Return better turns of steps (m, 3) and of their parts up to each node (m, 3, 3), which the momentum depends on."""
    assert spans.spin is not None
    momentum = rotated(conjugate(multiplied(attitude[:, None], exponential(within))), angular)  # in base axes
    rates = spans.free + product(spans.spin, momentum[..., None])[..., 0]
    return step_turn(rates, spans.length), step_turn(product(PARTIAL, rates[:, None]), spans.length[:, None] * NODES[6])


def _chained(spans: _Spans, start: Array, angular: Array) -> tuple[Array, Array]:
    """Return the attitudes (m + 1, 4) before and after steps in order, and their turns (m, 4)."""
    if spans.spin is None:
        turns = exponential(step_turn(spans.free, spans.length))
        return np.concatenate([start[None], multiplied(start, running_products(turns))]), turns
    # How a tumbling base turns depends on its attitude. Steps are solved together, again and again until nothing changes, as
    # many at a time as turn by about a radian: then a dozen or two times will do.
    size = np.linalg.norm(spans.spin, axis=(-2, -1)).max(axis=-1) * length(angular) * spans.length
    window = np.floor(np.cumsum(size) / _TUMBLE).astype(np.int64)
    attitudes, all_turns = [start[None]], []
    for part in np.unique(window):
        turns, after = _solved_together(spans.take(window == part), attitudes[-1][-1], angular)
        attitudes.append(after)
        all_turns.append(turns)
    return np.concatenate(attitudes), np.concatenate(all_turns)


def _solved_together(spans: _Spans, first: Array, angular: Array) -> tuple[Array, Array]:
    """Return the turns (m, 4) of steps in order, and the attitudes (m, 4) after them."""
    after = np.repeat(first[None], len(spans.begin), axis=0)
    turns, within = after, np.zeros_like(spans.free)
    for _ in range(_SWEEPS):
        turn, now = _swept(spans, np.concatenate([first[None], after[:-1]]), within, angular)
        turns = exponential(turn)
        moved = multiplied(first, running_products(turns))
        change = max(np.abs(moved - after).max(), np.abs(now - within).max())
        after, within = moved, now
        if change < _SETTLED:
            break
    return turns, after
