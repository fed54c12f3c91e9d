"""How far an arm disturbs its base, at most, which limits of that are not kept, and what is found about the base."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import as_readonly, as_transform, shown
from spacearm.core.errors import ProblemError
from spacearm.dynamics.base_models import BASE_MODELS, BaseModel
from spacearm.robot import Robot

# ---- The base setup that a proof starts from: what holds the base, where it begins, and with which momentum ----------

Array = NDArray[np.float64]

_SAME = 1e-9  # of a place or a momentum relative to its size, and of a rotation [rad]: a file's last digit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseSetup:
    """A base in the inertial frame, in which the obstacles rest.

    Attributes:
        model: what holds it.
        start: T_w_b (4, 4) at the beginning [m].
        linear: (3,) total momentum [N s], inertial frame.
        angular: (3,) total angular momentum about the system's centre of mass [N m s], inertial frame.
    """

    model: BaseModel
    start: Array
    linear: Array
    angular: Array

    @property
    def base(self) -> str:
        """The name of what holds it."""
        return self.model.name

    @property
    def drifting(self) -> bool:
        """Whether it moves by itself, so that its motion depends on time."""
        return self.model.keeps_momentum and bool(self.linear.any() or self.angular.any())

    @property
    def at_origin(self) -> bool:
        """Whether it starts where the base frame is."""
        return bool((self.start == np.eye(4)).all())


def base_setup_of(holder: Any, robot: Robot, *, who: str) -> BaseSetup:
    """Read how a problem or a trajectory takes the base to be held; what it does not say is as the robot has it, at the origin.

    Args:
        holder: may have `base`, `base_start` and `momentum`.
        robot: whose base.
        who: "problem" or "trajectory", for the message.

    Raises:
        ProblemError: a base that no model has, a start that is no pose, or a momentum that is none.
    """
    base = getattr(holder, "base", None)
    base = robot.base if base is None else base
    if not isinstance(base, str) or base not in BASE_MODELS:
        raise ProblemError(f"the {who}'s base is {shown(base)}, expected {' or '.join(map(repr, BASE_MODELS))}")
    start, momentum = getattr(holder, "base_start", None), getattr(holder, "momentum", None)
    pose = np.eye(4) if start is None else as_transform(f"the {who}'s base_start", start, ProblemError)
    linear, angular = (
        np.zeros(3) if momentum is None else as_readonly(f"momentum.{part}", getattr(momentum, part), (3,), ProblemError)
        for part in ("linear", "angular")
    )
    return BaseSetup(model=BASE_MODELS[base], start=pose, linear=linear, angular=angular)


def require_same(problem: BaseSetup, trajectory: BaseSetup) -> None:
    """Check that a trajectory was made for the base that a problem has.

    Raises:
        ProblemError: it was made for another one.
    """
    if trajectory.base != problem.base:
        raise ProblemError(
            f"the trajectory is of a {trajectory.base} base, expected the problem's, which is {problem.base}; "
            f"make it with Trajectory(..., base='{problem.base}')"
        )
    mine, other = problem.start[:3], trajectory.start[:3]
    away, turned = (float(np.abs(difference).max()) for difference in (other[:, 3] - mine[:, 3], other[:, :3] - mine[:, :3]))
    if away > _SAME * (1 + np.abs(mine[:, 3]).max()) or turned > _SAME:
        raise ProblemError(
            f"the trajectory's base starts elsewhere than the problem's (its base_start differs by {away:.3g} m and "
            f"{turned:.3g} rad), expected the same pose; make it with Trajectory(..., base_start=problem.base_start)"
        )
    if not problem.model.keeps_momentum:
        return
    for what, unit in (("linear", "N s"), ("angular", "N m s")):
        mine, other = getattr(problem, what), getattr(trajectory, what)
        if np.abs(other - mine).max() > _SAME * np.abs(mine).max():
            raise ProblemError(
                f"the trajectory has the {what} momentum {np.array2string(other, precision=6)} {unit}, expected the problem's "
                f"{np.array2string(mine, precision=6)} {unit}; make it with Trajectory(..., momentum=problem.momentum)"
            )


# ---- -----------------------------------------------------------------------------------------------------------------
# How far an arm disturbs its base, at most, which limits of that are not kept, and what is found about the base.

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
