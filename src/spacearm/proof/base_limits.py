"""How far a floating base is disturbed, at most, and which limits of that are not kept."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

_SLACK = 1e-9  # relative: of a limit that is met by moving slower


class HasBaseLimits(Protocol):
    """Limits of what an arm may do to its base; None is no limit. `BaseLimits` has them."""

    @property
    def final(self) -> float | None:
        """[rad]."""
        ...

    @property
    def peak(self) -> float | None:
        """[rad]."""
        ...

    @property
    def rate(self) -> float | None:
        """[rad/s]."""
        ...

    @property
    def joint_momentum(self) -> float | None:
        """[N m s]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseFigures:
    """Of a floating base over a trajectory: bounds for every t, a few parts in a million above what is reached.

    Attributes:
        error: how far an attitude may be off [rad].
        final: angle between the attitudes at the end and at the beginning, which may be off by the error [rad].
        peak: no angle from the attitude at the beginning is greater [rad].
        rate: the base turns no faster [rad/s].
        joint_momentum: the arm's angular momentum, of its joints' motion alone, is never greater [N m s].
    """

    error: float
    final: float
    peak: float
    rate: float
    joint_momentum: float


def asked(limits: HasBaseLimits | None) -> tuple[str, ...]:
    """Return the names of the limits that there are."""
    return tuple(name for name in ("final", "peak", "rate", "joint_momentum") if getattr(limits, name, None) is not None)


def exceeded(figures: BaseFigures, limits: HasBaseLimits | None) -> tuple[str, ...]:
    """Return a phrase for each limit that is not proven to be kept at every instant."""
    if limits is None:
        return ()
    out = []
    for what, value, limit, scale, unit in (
        ("the base ends turned by", figures.final + figures.error, limits.final, math.degrees(1), "deg"),
        ("the base turns by", figures.peak, limits.peak, math.degrees(1), "deg"),
        ("the base turns at", figures.rate, limits.rate, math.degrees(1), "deg/s"),
        ("the arm's momentum reaches", figures.joint_momentum, limits.joint_momentum, 1.0, "N m s"),
    ):
        if limit is not None and not value <= limit * (1 + _SLACK):
            digits = 4 if value > 1.001 * limit else 10  # so that the two differ
            out.append(f"{what} {value * scale:.{digits}g} {unit}, more than {limit * scale:.{digits}g}")
    return tuple(out)
