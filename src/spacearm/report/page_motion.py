"""The motions of a report's page in numbers: joints, base and end effector at instants, as the page computes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import matrix_of, multiplied, quaternion_of
from spacearm.report.report_page import unpacked

Array = NDArray[np.float64]
Data = dict[str, Any]


class PageMotion:
    """How an actor of a page moves.

    Attributes:
        robot: the page's.
        times: (k,) instants of the knots, ascending.
    """

    def __init__(self, actor: Data, robots: list[Data]) -> None:
        self.robot: Data = robots[actor["robot"]]
        knots = actor["knots"]
        self.times = unpacked(knots["t"]).astype(np.float64)
        self._q, self._dq = (unpacked(knots[key]).reshape(len(self.times), -1).astype(np.float64) for key in ("q", "dq"))
        base = knots.get("base")
        self._at = matrix(knots["baseAt"])
        self._base = (
            None if base is None else [unpacked(base[key]).reshape(len(self.times), -1) for key in ("p", "v", "w", "dw")]
        )

    @property
    def moves(self) -> bool:
        """Whether there is more than one instant."""
        return len(self.times) > 1

    @property
    def base_moves(self) -> bool:
        """Whether the base moves."""
        return self._base is not None and self.moves

    def positions(self, t: Array) -> Array:
        """Return q (k, n) at instants (k,) [rad or m]."""
        return _between(self.times, self._q, self._dq, t)

    def values(self, t: Array) -> Array:
        """Return the joints' values (k, j) at instants (k,) [rad or m]."""
        q = self.positions(t)
        joints = self.robot["joints"]
        return np.stack([one["multiplier"] * q[:, one["dof"]] + one["offset"] for one in joints], axis=1)

    def base(self, t: Array) -> Array:
        """Return the base's frame T_w_b (k, 4, 4) at instants (k,) [m]."""
        T = np.tile(self._at, (len(t), 1, 1))
        if self._base is not None:
            T[:, :3, 3] = _between(self.times, self._base[0], self._base[1], t)
            T[:, :3, :3] = matrix_of(self.base_quaternions(t))
        return T

    def base_quaternions(self, t: Array) -> Array:
        """Return how the base is turned at instants (k,), (k, 4) wxyz; the sign does not jump."""
        if self._base is None:
            return np.tile(quaternion_of(self._at[:3, :3]), (len(t), 1))
        turned = _between(self.times, self._base[2], self._base[3], t)
        return turned / np.linalg.norm(turned, axis=1, keepdims=True)

    def joint_frames(self, t: Array) -> Array:
        """Return each joint's moving frame in its parent's (k, j, 4, 4) at instants (k,) [m]."""
        values = self.values(t)
        frames = np.empty((*values.shape, 4, 4))
        for i, joint in enumerate(self.robot["joints"]):
            frames[:, i] = matrix(joint["T"]) @ _moved(joint["kind"], values[:, i])
        return frames

    def joint_quaternions(self, i: int, t: Array) -> Array:
        """Return how a revolute joint's moving frame is turned in its parent's at instants (k,), (k, 4) wxyz."""
        half = self.values(t)[:, i] / 2
        about_z = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
        return multiplied(np.tile(quaternion_of(matrix(self.robot["joints"][i]["T"])[:3, :3]), (len(t), 1)), about_z)

    def tips(self, t: Array) -> Array:
        """Return the end effector's frame T_w_tip (k, 4, 4) at instants (k,) [m]."""
        frames, tip = self.joint_frames(t), self.robot["tip"]
        T, at = np.tile(matrix(tip["T"]), (len(t), 1, 1)), tip["joint"]
        while at >= 0:
            T, at = frames[:, at] @ T, self.robot["joints"][at]["parent"]
        return self.base(t) @ T


def matrix(T: list[float]) -> Array:
    """Return a transform (4, 4) of the page's 12 numbers."""
    return np.vstack([np.reshape(np.asarray(T, dtype=np.float64), (3, 4)), [0, 0, 0, 1]])


def _moved(kind: str, values: Array) -> Array:
    T = np.tile(np.eye(4), (len(values), 1, 1))
    if kind == "prismatic":
        T[:, 2, 3] = values
    else:
        s, c = np.sin(values), np.cos(values)
        T[:, 0, 0], T[:, 0, 1], T[:, 1, 0], T[:, 1, 1] = c, -s, s, c
    return T


def _between(times: Array, x: NDArray[Any], dx: NDArray[Any], t: Array) -> Array:
    """Return cubic Hermite curves through knots at instants."""
    x, dx = np.asarray(x, dtype=np.float64), np.asarray(dx, dtype=np.float64)
    if len(times) == 1:
        return np.tile(x, (len(t), 1))
    i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    length = (times[i + 1] - times[i])[:, None]
    s = np.clip((t - times[i])[:, None] / np.where(length > 0, length, 1.0), 0, 1)
    h = s * s * (3 - 2 * s)
    rates = s * (1 - s) * (1 - s) * dx[i] + s * s * (s - 1) * dx[i + 1]
    return (1 - h) * x[i] + h * x[i + 1] + length * rates
