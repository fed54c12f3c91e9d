"""Trajectories on a base: the base's pose over time, and with it the end effector's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import Frozen, as_numbers, keep
from spacearm.core.errors import FileFormatError, ProblemError
from spacearm.core.rotations import matrix_of
from spacearm.dynamics import BaseMotion, JointPath, Momentum
from spacearm.dynamics.base_models import Base, BaseModel, BaseTrack, base_model, checked_base
from spacearm.robot import Robot, forward_kinematics

Array = NDArray[np.float64]


class OnABase(Frozen):
    """What our trajectories have in common: how their base is held, and where it is at each time.

    The base's motion is worked out when it is first asked for, and cached; it is no part of the value.
    """

    __slots__ = ("_base_track",)

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
        object.__setattr__(self, "_base_track", None)

    @property
    def base_model(self) -> BaseModel:
        """What holds the base."""
        return base_model(self.base)

    @property
    def base_track(self) -> BaseTrack:
        """Where the base is along the path that its motion is worked out for.

        Raises:
            RobotError: masses that are not known.
            ProblemError: the momentum turns the base too often.
        """
        track: BaseTrack | None = self._base_track
        if track is None:
            path, duration = self._base_path()
            track = self.base_model.track(self.robot, path, start=self.base_start, momentum=self.momentum, duration=duration)
            object.__setattr__(self, "_base_track", track)
        return track

    @property
    def base_motion(self) -> BaseMotion | None:
        """How the motion of a floating base was integrated; None where nothing was."""
        track = self.base_track
        return track if isinstance(track, BaseMotion) else None

    def base_pose(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return the base's position (..., 3) [m] and attitude_wxyz (..., 4) in the inertial frame.

        Args:
            t: (...,) time [s]; before 0 and after the duration, what holds at the ends.
        """
        time = as_numbers("t", t, ProblemError)
        return self.base_track.pose(self._along(time)[0])

    def base_rate(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return how fast the base moves: its origin in the inertial frame [m/s], and its turning in base axes [rad/s].

        Args:
            t: (...,) time [s]; before 0 and after the duration both are 0.

        Returns:
            Each (..., 3).
        """
        time = as_numbers("t", t, ProblemError)
        u, speed = self._along(time)
        speed = np.where((time >= 0) & (time <= self._span()), speed, 0.0)[..., None]
        velocity, omega = self.base_track.twist(u)
        return velocity * speed, omega * speed

    def tip(self, t: ArrayLike, *, frame: str | None = None) -> Array:
        """Return where a frame is, the end effector unless named: T_w_tip (..., 4, 4), inertial frame [m]."""
        time = as_numbers("t", t, ProblemError)
        T_b_tip = forward_kinematics(self.robot, self._configuration(time), frame=frame)
        return self.base_track.placed(self._along(time)[0], T_b_tip)


# ---- -----------------------------------------------------------------------------------------------------------------
# What tables and messages say of the base and of the end effector: columns, and poses in the inertial frame.


BASE_COLUMNS = ("base_x", "base_y", "base_z", "base_qw", "base_qx", "base_qy", "base_qz")
VELOCITY_COLUMNS = ("base_vx", "base_vy", "base_vz")
TURNING_COLUMNS = ("base_wx", "base_wy", "base_wz")
TIP_COLUMNS = ("tip_x_m", "tip_y_m", "tip_z_m")

_UNIT = 1e-3  # by which a quaternion of few digits may miss length 1


def columns_of(names: tuple[str, ...], columns: dict[str, int], values: Array) -> Array | None:
    """Return these columns of a table, (m, k); None without them.

    Raises:
        FileFormatError: some of them only.
    """
    there = [name for name in names if name in columns]
    if not there:
        return None
    if len(there) < len(names):
        missing = next(name for name in names if name not in columns)
        raise FileFormatError(f"column '{there[0]}' is there and '{missing}' is not, expected all of {', '.join(names)}")
    return values[:, [columns[name] for name in names]]


def unit_poses(poses: Array, places: list[str]) -> Array:
    """Return positions and quaternions wxyz, (m, 7), the quaternions of length 1.

    Args:
        poses: (m, 7) as a file has them.
        places: (m,) where each stands in it.

    Raises:
        FileFormatError: quaternions that are none.
    """
    length = np.linalg.norm(poses[:, 3:].clip(-2, 2), axis=1)  # the squares of what is far too large may be no numbers
    wrong = np.abs(length - 1) > _UNIT
    if wrong.any():
        i = int(np.argmax(wrong))
        raise FileFormatError(
            f"{places[i]}: the base's quaternion has length {length[i]:.6g}, expected 1: an attitude w, x, y, z in "
            f"{', '.join(BASE_COLUMNS[3:])}"
        )
    return np.column_stack([poses[:, :3], poses[:, 3:] / length[:, None]])


def as_matrix(pose: Array) -> Array:
    """Return a pose (7,) as T_w_b (4, 4)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = matrix_of(pose[3:]), pose[:3]
    return T
