"""How far an arm disturbs its base, at most, which limits of that are not kept, and what is found about the base."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

CONSERVED = 1e-6
"""The greatest residual momentum that is taken for rounding, relative to the greatest momentum of a link."""

SAME = 1e-6
"""[m] by which no point of the base within 1 m of its origin may be elsewhere than the proof says."""

LOST = 1e-3
"""[rad] where an attitude may be off by more, nothing is said of what the base meets."""

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
    """Of a base that is moved, over a trajectory: bounds for every t, a few parts in a million above what is reached.

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseFindings:
    """What was found about a base that is moved.

    Attributes:
        residual_momentum: by how much the momentum misses what was given, along the base motion that the trajectory itself
            tells, over the greatest momentum of a link; Pinocchio's, at instants.
        elsewhere: how far that motion is from the one that was proven, at most at instants: angle [rad] plus distance [m].
        error: no attitude in the proof is further from the true one than this [rad]; the proof allows for it.
        rotation_final: angle to the first attitude at the end, which may be off by the error [rad].
        rotation_peak, rate, joint_momentum: bounds for all t of that angle [rad], of the base's rate of turn [rad/s], and of
            the arm's angular momentum, by its joints' motion alone [N m s].
        checked: the problem's limits of these, by name: "final", "peak", "rate", "joint_momentum".
        broken_limits: those that are not proven to be kept, a phrase each.
    """

    residual_momentum: float
    elsewhere: float
    error: float
    rotation_final: float
    rotation_peak: float
    rate: float
    joint_momentum: float
    checked: tuple[str, ...] = ()
    broken_limits: tuple[str, ...] = ()

    @property
    def followed(self) -> bool:
        """Whether it is known where the base turns to."""
        return self.error <= LOST

    @property
    def broken(self) -> str:
        """What is wrong with the trajectory's own base motion, in a sentence; "" if nothing is."""
        if not self.residual_momentum <= CONSERVED:
            return (
                f"the trajectory's base motion does not conserve momentum: it misses {self.residual_momentum:.3g} of the "
                f"greatest link's, expected at most {CONSERVED:g}"
            )
        if self.followed and not self.elsewhere <= SAME + self.error:
            return f"the trajectory has its base {self.elsewhere:.3g} m or rad from where momentum takes it"
        return ""


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
