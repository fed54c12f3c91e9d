"""How a floating base moves while its arm runs a path.

Without angular momentum the base's attitude follows from the path alone, whatever its timing; its position follows from the
centre of mass of base and arm, which stands still or drifts steadily. With momentum the base also turns by itself, and time
counts. Rigid bodies, no force, no contact, no orbit.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm._kernel.exact import inverse3, length, product, solved3
from spacearm.checks import as_number, as_numbers, as_pose, require_kind, shown
from spacearm.errors import ProblemError
from spacearm.momentum.blocks import system_mass
from spacearm.momentum.masses import require_masses
from spacearm.momentum.quick import moving
from spacearm.momentum.steps import adaptive_steps, attitude_within
from spacearm.momentum.total import Momentum
from spacearm.momentum.turning import cross, matrix_of, quaternion_of, rotated
from spacearm.robot import Robot
from spacearm.robot.kinematics import as_configurations

Array = NDArray[np.float64]

_FIRST_STEPS = 8
_TUMBLE = 0.5  # [rad] at most in a first step
_MOST_TUMBLE = 600.0  # [rad] about a hundred turns in one motion
_AT_ONCE = 4096


class JointPath(Protocol):
    """A piecewise polynomial q(u): a Motion over s, or a PiecewisePath over time."""

    @property
    def domain(self) -> tuple[float, float]:
        """Where u begins and ends."""
        ...

    def sample(self, u: ArrayLike, /, derivative: int = 0) -> Array:
        """Return q(u), or a derivative with respect to u, (..., n)."""
        ...

    def hulls(self, derivative: int, *, bisections: int = ...) -> tuple[Array, Array, Array]:
        """Return first of all the ends (p, 2) of its pieces, halved so many times."""
        ...


class BaseMotion:
    """The motion of a floating base along a path of its arm's joints; Magnus's series of sixth order, adaptive.

    Attributes:
        robot: whose base floats.
        curve: the path q(u) of its joints.
        base_start: (4, 4) T_w_b where the path begins [m].
        momentum: of base and arm, constant.
        error: estimate of the greatest error of the attitude [rad]; at most the tolerance, unless 65,536 steps or float64
            do not reach it.
        steps: how many were taken.
    """

    def __init__(
        self,
        robot: Robot,
        curve: JointPath,
        *,
        base_start: ArrayLike | None = None,
        momentum: Momentum | None = None,
        duration: float | None = None,
        tolerance: float = 1e-9,
    ) -> None:
        """Integrate the base's attitude along the path.

        Args:
            robot: with masses.
            curve: the path.
            base_start: T_w_b (4, 4), or a point (3,), where the path begins [m]; None: at the origin.
            momentum: of base and arm; None: none.
            duration: of the whole path [s]; needed with momentum other than 0, and of no effect without.
            tolerance: of the attitude [rad].

        Raises:
            RobotError: masses that cannot be, or a path for another number of joints.
            ProblemError: a momentum other than 0 without duration, one that makes the base spin, or values that cannot be.
        """
        require_masses(robot)
        if not all(hasattr(curve, name) for name in ("domain", "sample", "hulls")) or isinstance(curve, type):
            raise ProblemError(f"curve is {shown(curve)}, expected a Motion or a PiecewisePath")
        self.robot, self.curve = robot, curve
        self.base_start = as_pose("base_start", base_start, ProblemError)
        self.momentum = Momentum() if momentum is None else momentum
        require_kind("momentum", self.momentum, Momentum, ProblemError)
        tolerance = as_number("tolerance", tolerance, ProblemError, above=0, unit="rad")
        self._begin, self._end = curve.domain
        self._duration = 0.0
        if not self.momentum.is_zero:
            if duration is None:
                raise ProblemError("duration is None, expected a time [s]: with momentum the base moves by itself; give one")
            self._duration = as_number("duration", duration, ProblemError, at_least=0, unit="s")
        self._drift = self.momentum.linear / system_mass(robot)
        attitude = quaternion_of(self.base_start[:3, :3])
        first = as_configurations(robot, curve.sample(self._begin))[None]
        center = moving(robot, first, np.zeros_like(first)).center[0]
        self._center = self.base_start[:3, 3] + rotated(attitude, center)  # at the beginning, in the inertial frame
        self._steps = adaptive_steps(self._field, self._first_nodes(), attitude, self.momentum.angular, tolerance)
        self.error, self.steps = self._steps.error, len(self._steps.nodes) - 1

    def pose(self, u: ArrayLike) -> tuple[Array, Array]:
        """Return the base's position (..., 3) [m] and attitude_wxyz (..., 4) in the inertial frame.

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
        """
        at = as_numbers("u", u, ProblemError)
        parts = [self._pose(part) for part in _chunks(self._within(at.ravel()))]
        position, attitude = (np.concatenate(values) for values in zip(*parts, strict=True))
        return position.reshape(*at.shape, 3), attitude.reshape(*at.shape, 4)

    def rate(self, u: ArrayLike) -> Array:
        """Return how the base turns, (..., 3) per unit of u, base axes [rad].

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
        """
        return self.twist(u)[1]

    def twist(self, u: ArrayLike) -> tuple[Array, Array]:
        """Return the velocity of the base's origin (..., 3) in the inertial frame [m], and `rate`, per unit of u.

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
        """
        at = as_numbers("u", u, ProblemError)
        parts = [self._twist(part) for part in _chunks(self._within(at.ravel()))]
        velocity, omega = (np.concatenate(values).reshape(*at.shape, 3) for values in zip(*parts, strict=True))
        return velocity, omega

    def placed(self, u: ArrayLike, T_b_x: Array) -> Array:
        """Return frames of the base in the inertial frame, T_w_x (..., 4, 4).

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
            T_b_x: (..., 4, 4) in the base's frame, one for each u [m].
        """
        position, attitude = self.pose(u)
        T_w_b = np.zeros_like(T_b_x)
        T_w_b[..., :3, :3], T_w_b[..., :3, 3], T_w_b[..., 3, 3] = matrix_of(attitude), position, 1.0
        return product(T_w_b, T_b_x)

    def _within(self, u: Array) -> Array:
        return np.clip(u, self._begin, self._end)

    def _moved(self, u: Array) -> tuple[Array, Array]:
        """Return q and dq/du, (m, n)."""
        return self.curve.sample(u), self.curve.sample(u, 1)

    @property
    def _time_scale(self) -> float:
        """dt/du [s]."""
        return self._duration / (self._end - self._begin)

    def _field(self, u: Array) -> tuple[Array, Array | None]:
        found = moving(self.robot, *self._moved(u))
        if not self.momentum.angular.any():
            return found.free_rate, None
        return found.free_rate, inverse3(found.H_w) * self._time_scale

    def _first_nodes(self) -> Array:
        ends = self.curve.hulls(0, bisections=0)[0]
        breaks = np.append(ends[:, 0], ends[-1, 1])
        parts = max(1, -(-_FIRST_STEPS // (len(breaks) - 1)))
        spin = self._field(breaks)[1]
        if spin is not None:
            turned = float(np.linalg.norm(spin, axis=(1, 2)).max() * length(self.momentum.angular))
            if turned * (breaks[-1] - breaks[0]) > _MOST_TUMBLE:
                raise ProblemError(
                    f"momentum.angular is {shown(self.momentum.angular.tolist())}, which turns the base by up to "
                    f"{turned * (breaks[-1] - breaks[0]):.3g} rad in {self._duration:.4g} s, expected less than "
                    f"{_MOST_TUMBLE:g} rad; check the units of masses, momentum and duration"
                )
            parts = max(parts, int(np.ceil(turned * np.diff(breaks).max() / _TUMBLE)))
        share = np.arange(parts) / parts
        return np.append((breaks[:-1, None] + share * np.diff(breaks)[:, None]).ravel(), breaks[-1])

    def _pose(self, u: Array) -> tuple[Array, Array]:
        attitude = attitude_within(self._field, self._steps, u, self.momentum.angular)
        time = (u - self._steps.nodes[0]) * self._time_scale
        center = moving(self.robot, *self._moved(u)).center
        return self._center + self._drift * time[:, None] - rotated(attitude, center), attitude

    def _twist(self, u: Array) -> tuple[Array, Array]:
        found = moving(self.robot, *self._moved(u))
        attitude = attitude_within(self._field, self._steps, u, self.momentum.angular)
        omega = found.free_rate
        if self.momentum.angular.any():
            inverse = attitude * np.array([1.0, -1.0, -1.0, -1.0])
            spin = solved3(found.H_w, rotated(inverse, self.momentum.angular))
            omega = omega + spin * self._time_scale
        center = found.center_rate + cross(
            omega, found.center
        )  # velocity of the centre of mass relative to the base, base axes
        return self._drift * self._time_scale - rotated(attitude, center), omega


def _chunks(u: Array) -> list[Array]:
    return [u[i : i + _AT_ONCE] for i in range(0, max(len(u), 1), _AT_ONCE)]
