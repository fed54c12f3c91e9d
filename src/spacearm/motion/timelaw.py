"""The time law: how fast a motion may be run within the limits, at every instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.motion.spline import Motion
from spacearm.robot import Robot

Array = NDArray[np.float64]

# Bezier points carry rounding of about 1e-14 of the control points' size; the duration makes up for it.
_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LimitMargins:
    """How far a trajectory stays inside each joint's limits, for all t, by its hulls.

    Attributes:
        position: (n,) least distance to a position limit [rad or m]; negative where it may be broken.
        velocity: (n,) greatest |dq| as a share of the limit; at most 1 if kept.
        acceleration: (n,) greatest |ddq| as a share of the limit.
    """

    position: Array
    velocity: Array
    acceleration: Array

    @property
    def holds(self) -> bool:
        """Whether all limits are kept for all t."""
        kept = (self.velocity <= 1).all() and (self.acceleration <= 1).all()
        return bool(kept and (self.position >= -_ROUNDING).all())


def greatest(motion: Motion, derivative: int) -> Array:
    """Return a bound (n,) of |d^k q / ds^k| that holds for every s."""
    _, low, high = motion.hulls(derivative)
    return np.maximum(-low.min(axis=0), high.max(axis=0)).clip(min=0.0)


def fastest_duration(robot: Robot, motion: Motion) -> float:
    """Return the least duration of a uniform time law q(t/T) that keeps velocity and acceleration limits [s].

    With s = t/T, dq/dt = q'/T and d2q/dt2 = q''/T^2, so T is the greatest of |q'|/limit and sqrt(|q''|/limit), with the
    bounds of q' and q'' by their hulls: it holds between any samples too. 0 for a motion that does not move.
    """
    velocity = greatest(motion, 1) / robot.velocity
    acceleration = greatest(motion, 2) / robot.acceleration
    duration = max(float(velocity.max()), float(np.sqrt(acceleration.max())))
    return duration * (1 + _ROUNDING)


def limit_margins(robot: Robot, motion: Motion, duration: float) -> LimitMargins:
    """Return how far a motion run in this time stays inside the limits, for all t."""
    _, low, high = motion.hulls(0)
    time = duration if duration > 0 else np.inf
    return LimitMargins(
        position=np.minimum(low.min(axis=0) - robot.lower, robot.upper - high.max(axis=0)),
        velocity=greatest(motion, 1) / time / robot.velocity,
        acceleration=greatest(motion, 2) / time**2 / robot.acceleration,
    )
