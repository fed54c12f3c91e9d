"""What rides on a base: the base's pose over time, and with it the end effector's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm._kernel.exact import product
from spacearm.checks import Frozen, as_numbers, as_pose, keep, shown
from spacearm.errors import ProblemError
from spacearm.momentum import BaseMotion, JointPath, Momentum
from spacearm.momentum.masses import require_possible_masses
from spacearm.momentum.turning import matrix_of, quaternion_of
from spacearm.robot import Robot, forward_kinematics
from spacearm.robot.model import BASE_KINDS

Array = NDArray[np.float64]

Base: TypeAlias = Literal["fixed", "floating"]


class OnABase(Frozen):
    """Base of our trajectories: how their base is held, and where it is at each time.

    The motion of a floating base is integrated when it is first asked for, and kept; it is no part of the value.
    """

    __slots__ = ("_base_motion",)

    if TYPE_CHECKING:
        robot: Robot
        base: Base
        base_start: Array
        momentum: Momentum

    def _configuration(self, t: Array) -> Array:
        """Return the joints' positions at a time."""
        raise NotImplementedError

    def _span(self) -> float:
        """Return the duration [s]."""
        raise NotImplementedError

    def _base_path(self) -> tuple[JointPath, float]:
        """Return the path that the base's motion is integrated along, and its duration."""
        raise NotImplementedError

    def _along(self, t: Array) -> tuple[Array, Array]:
        """Return where on that path the arm is at a time, and how fast it moves along it, both of the shape of t."""
        raise NotImplementedError

    def _check_base(self) -> None:
        """Check and fill in the base's fields, while the record is being made."""
        keep(self, **checked_base(self.robot, self.base, self.base_start, self.momentum))
        object.__setattr__(self, "_base_motion", None)

    @property
    def base_motion(self) -> BaseMotion | None:
        """The motion of the floating base; None if it is fixed."""
        if self.base == "fixed":
            return None
        if self._base_motion is None:
            path, duration = self._base_path()
            made = BaseMotion(self.robot, path, base_start=self.base_start, momentum=self.momentum, duration=duration)
            object.__setattr__(self, "_base_motion", made)
        return self._base_motion

    def base_pose(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return the base's position (..., 3) [m] and attitude_wxyz (..., 4) in the inertial frame.

        Args:
            t: (...,) time [s]; before 0 and after the duration, what holds at the ends.
        """
        time = as_numbers("t", t, ProblemError)
        moving = self.base_motion
        if moving is not None:
            return moving.pose(self._along(time)[0])
        return resting_base(time, self.base_start)

    def base_rate(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return how fast the base moves: its origin in the inertial frame [m/s], and its turning in base axes [rad/s].

        Args:
            t: (...,) time [s]; before 0 and after the duration both are 0.

        Returns:
            Each (..., 3).
        """
        time = as_numbers("t", t, ProblemError)
        moving = self.base_motion
        if moving is None:
            return np.zeros((*time.shape, 3)), np.zeros((*time.shape, 3))
        u, speed = self._along(time)
        speed = np.where((time >= 0) & (time <= self._span()), speed, 0.0)[..., None]
        velocity, omega = moving.twist(u)
        return velocity * speed, omega * speed

    def tip(self, t: ArrayLike, *, frame: str | None = None) -> Array:
        """Return where a frame is, the end effector unless named: T_w_tip (..., 4, 4), inertial frame [m]."""
        time = as_numbers("t", t, ProblemError)
        T_b_tip = forward_kinematics(self.robot, self._configuration(time), frame=frame)
        if self.base == "fixed":
            return T_b_tip if np.array_equal(self.base_start, np.eye(4)) else product(self.base_start, T_b_tip)
        position, attitude = self.base_pose(time)
        T_w_b = np.zeros_like(T_b_tip)
        T_w_b[..., :3, :3], T_w_b[..., :3, 3], T_w_b[..., 3, 3] = matrix_of(attitude), position, 1.0
        return product(T_w_b, T_b_tip)


def checked_base(robot: Robot, base: Any, base_start: Any, momentum: Any) -> dict[str, Any]:
    """Return `base`, `base_start` (4, 4) and `momentum`, checked; None stands for the robot's base, the origin, and none.

    Raises:
        ProblemError: values that cannot be, or momentum of a fixed base.
        RobotError: a floating base of a robot without masses.
    """
    if base is None:
        base = robot.base
    if not isinstance(base, str) or base not in BASE_KINDS:
        raise ProblemError(f"base is {shown(base)}, expected one of {', '.join(map(repr, BASE_KINDS))}")
    if momentum is None:
        momentum = Momentum()
    if not isinstance(momentum, Momentum):
        raise ProblemError(f"momentum is {shown(momentum)}, expected a Momentum(linear=..., angular=...), or None")
    if base == "floating":
        require_possible_masses(robot)  # where one is not known, whoever asks where the base goes is told; to plan is refused
    elif not momentum.is_zero:
        raise ProblemError("base is 'fixed' and momentum is not 0, expected a floating base with it; give base='floating'")
    return {"base": base, "base_start": as_pose("base_start", base_start, ProblemError), "momentum": momentum}


def resting_base(t: ArrayLike, base_start: Array | None = None) -> tuple[Array, Array]:
    """Return the position (..., 3) [m] and attitude_wxyz (..., 4) of a base that stays where it is."""
    shape, T_w_b = np.shape(t), np.eye(4) if base_start is None else base_start
    values = (T_w_b[:3, 3], quaternion_of(T_w_b[:3, :3]))
    position, attitude = (np.broadcast_to(value, (*shape, len(value))).copy() for value in values)
    return position, attitude
