"""A motion as a report's page moves it: cubic Hermite curves between knots, as many as the tip's place needs.

Knots are added until the curves differ from the motion by so little that no point of the robot is
off by more than `TOLERANCE`; a joint's difference counts by how far from its axis anything can be. At a kink of the rates there
are two knots at the same time, with the rates before and after it.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import multiplied
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.report.report_page import packed, transform
from spacearm.report.report_scene import reaches
from spacearm.robot import Robot

Array = NDArray[np.float64]

TOLERANCE = 2e-6
"""[m] No point of the robot is drawn further from where it is than this and the rounding of float32."""

MOST_KNOTS = 6000
"""A motion with more pieces, as recordings may have, is drawn by straight lines between some instants, which is noted."""

_SHARES = np.array([0.25, 0.5, 0.75])  # of an interval, at which it is compared
_BETWEEN = np.arange(1, 8) / 8  # of a piece
_LEAST = 1e-9  # of a piece: so far beside its ends rates are taken
_NEXT = 4 * float(np.finfo(np.float64).eps)  # of the duration: the next instant, and no rounding
_SAME = 1e-6  # of the greatest rate: two that differ by less are no kink
_ROUNDING = 2.0**-24  # of a number in float32
_SHORTEST = 1e-9  # of the duration: no shorter intervals are halved
_ROUNDS = 24


class _State(NamedTuple):
    """Values and rates at instants, (m, c) each: the joints', and of a base that moves its position and quaternion."""

    x: Array
    dx: Array


def knots_of(trajectory: AnyTrajectory, notes: list[str]) -> dict[str, Any]:
    """Return a trajectory's knots as the page reads them; what was left out is added to the notes."""
    t, x, dx = hermite_knots(trajectory, notes)
    n, kind = trajectory.robot.dof, packing_of(trajectory, t, x, dx)
    made: dict[str, Any] = {"t": packed(t, "f64"), "q": packed(x[:, :n], kind), "dq": packed(dx[:, :n], kind)}
    if x.shape[1] > n:
        parts = {"p": (x, n), "v": (dx, n), "w": (x, n + 3), "dw": (dx, n + 3)}
        made["base"] = {key: packed(of[:, at : at + (3 if key in "pv" else 4)], kind) for key, (of, at) in parts.items()}
    return made | {"baseAt": transform(trajectory.base_start)}


def packing_of(trajectory: AnyTrajectory, t: Array, x: Array, dx: Array) -> Literal["f32", "f64"]:
    """Return the numbers that knots need: float32, but float64 for joints that turn so far that float32 rounds too much."""
    weights = _weights(trajectory, x.shape[1])
    between = float(np.diff(t, append=t[-1:]).max())
    rounding = _ROUNDING * (np.abs(x).max(axis=0) + np.abs(dx).max(axis=0) * between / 4) @ weights
    return "f32" if float(rounding) < TOLERANCE else "f64"


def resting_knots(q: Array, base_start: Array) -> dict[str, Any]:
    """Return the only knot of a robot that stands in a configuration (n,), its base at T_w_b (4, 4)."""
    rows = np.asarray(q, dtype=np.float64)[None]
    return {"t": packed([0.0], "f64"), "q": packed(rows), "dq": packed(0 * rows), "baseAt": transform(base_start)}


def hermite_knots(trajectory: AnyTrajectory, notes: list[str]) -> tuple[Array, Array, Array]:
    """Return the times (k,) of the knots, the values (k, c) and the rates (k, c) there.

    The values are the joints', and of a base that moves its position and its quaternion wxyz, whose sign does not jump.
    """
    if trajectory.duration == 0:
        x = _state(trajectory, np.zeros(1)).x
        return np.zeros(1), x, np.zeros_like(x)
    breaks = breaks_of(trajectory)
    if len(breaks) > MOST_KNOTS // 2:
        return _thinned(trajectory, breaks, notes)
    begin, end = breaks[:-1], breaks[1:]
    shares = np.concatenate([[0.0, 0.0], _BETWEEN, [1.0, 1.0]])  # those between keep a tumbling base's quaternion
    at = begin[:, None] + (end - begin)[:, None] * shares
    beside = np.maximum(_LEAST * (end - begin), _NEXT * trajectory.duration)
    at[:, 1], at[:, -2], at[:, -1] = begin + beside, end - beside, end
    x, dx = (part.reshape(*at.shape, -1) for part in _state(trajectory, at.ravel()))
    first = _Intervals(begin, end, x[:, 0], x[:, -1], dx[:, 1], dx[:, -2])
    found = _refined(trajectory, first, notes)
    return _joined(found)


def breaks_of(trajectory: AnyTrajectory) -> Array:
    """Return the times at which a trajectory's pieces begin and end, from 0 to the duration [s]."""
    duration = trajectory.duration
    if not isinstance(trajectory, Trajectory):
        return np.asarray(trajectory.path.breaks, dtype=np.float64)
    pieces = trajectory.motion.pieces
    t = trajectory.time_at(np.arange(1, pieces) / pieces)
    if trajectory.time_law is not None:
        t = np.concatenate([t, trajectory.time_law.breaks[1:-1] * duration])
    inner = np.sort(t)
    apart = np.diff(inner, prepend=0.0) > _SHORTEST * duration
    inner = inner[apart & (inner < duration * (1 - _SHORTEST))]
    return np.concatenate([[0.0], inner, [duration]])


class _Intervals(NamedTuple):
    """Intervals of time, with values and rates at both ends."""

    begin: Array
    end: Array
    x0: Array
    x1: Array
    d0: Array
    d1: Array

    def take(self, which: NDArray[Any]) -> _Intervals:
        return _Intervals(*(part[which] for part in self))

    def at(self, share: float) -> Array:
        """Return the Hermite curves at a share of each interval (m, c)."""
        return hermite(share, self.x0, self.x1, self.d0, self.d1, (self.end - self.begin)[:, None])


def hermite(share: float | Array, x0: Array, x1: Array, d0: Array, d1: Array, length: Array) -> Array:
    """Return the cubic with values x0, x1 and rates d0, d1 at the ends of an interval, at a share of it."""
    s = share
    h01 = s * s * (3 - 2 * s)
    h10, h11 = s * (1 - s) * (1 - s), s * s * (s - 1)
    return (1 - h01) * x0 + h01 * x1 + length * (h10 * d0 + h11 * d1)


def _refined(trajectory: AnyTrajectory, first: _Intervals, notes: list[str]) -> _Intervals:
    """Halve intervals until their curves are near enough."""
    weights = _weights(trajectory, first.x0.shape[1])
    done: list[_Intervals] = []
    open_ = first
    for _ in range(_ROUNDS):
        length = open_.end - open_.begin
        at = open_.begin[:, None] + length[:, None] * _SHARES
        true = _state(trajectory, at.ravel())
        x, dx = (part.reshape(*at.shape, -1) for part in true)
        if x.shape[-1] > trajectory.robot.dof:
            x, dx = _same_sign(x, dx, open_.x0[:, None], trajectory.robot.dof)
        off = np.stack([open_.at(share) for share in _SHARES.tolist()], axis=1) - x
        wrong = (np.abs(off) @ weights).max(axis=1) > TOLERANCE
        wrong &= length > _SHORTEST * trajectory.duration
        if sum(map(_length, done)) + 2 * len(length) > MOST_KNOTS and wrong.any():
            worst = float((np.abs(off) @ weights).max())
            notes.append(
                f"the motion is drawn to {worst * 1e3:.2g} mm only: it bends so often that the page would be too large"
            )
            wrong[:] = False
        done.append(open_.take(~wrong))
        if not wrong.any():
            break
        bad, middle, at_middle, rate = open_.take(wrong), at[wrong, 1], x[wrong, 1], dx[wrong, 1]
        halves = (
            _Intervals(bad.begin, middle, bad.x0, at_middle, bad.d0, rate),
            _Intervals(middle, bad.end, at_middle, bad.x1, rate, bad.d1),
        )
        open_ = _Intervals(*(np.concatenate(parts) for parts in zip(*halves, strict=True)))
    everything = _Intervals(*(np.concatenate(parts) for parts in zip(*done, strict=True)))
    return everything.take(np.argsort(everything.begin, kind="stable"))


def _length(intervals: _Intervals) -> int:
    return len(intervals.begin)


def _joined(found: _Intervals) -> tuple[Array, Array, Array]:
    """Return the knots of intervals in a row: one where two meet, or two where the rates differ."""
    t, x, dx = [found.begin[:1]], [found.x0[:1]], [found.d0[:1]]
    size = np.maximum(np.abs(found.d0).max(axis=0), np.abs(found.d1).max(axis=0))
    kinks = (np.abs(found.d0[1:] - found.d1[:-1]) > _SAME * size).any(axis=1)
    counts = np.append(1 + kinks, 1)
    which = np.repeat(np.arange(len(counts)), counts)
    second = np.append(False, which[1:] == which[:-1])
    following = np.minimum(which + 1, len(counts) - 1)
    t.append(found.end[which])
    x.append(found.x1[which])
    dx.append(np.where(second[:, None], found.d0[following], found.d1[which]))
    return np.concatenate(t), np.concatenate(x), np.concatenate(dx)


def _thinned(trajectory: AnyTrajectory, breaks: Array, notes: list[str]) -> tuple[Array, Array, Array]:
    """Return knots of straight lines between some instants of a motion with many pieces."""
    some = np.unique(np.linspace(0, len(breaks) - 1, MOST_KNOTS // 2).round().astype(np.int64))
    t = breaks[some]
    x = _state(trajectory, t).x
    slope = np.diff(x, axis=0) / np.diff(t)[:, None]
    middle = (t[1:] + t[:-1]) / 2
    between = _state(trajectory, middle).x
    if x.shape[1] > trajectory.robot.dof:
        between, _ = _same_sign(between[:, None], between[:, None], x[:-1, None], trajectory.robot.dof)
        between = between[:, 0]
    off = np.abs((x[1:] + x[:-1]) / 2 - between) @ _weights(trajectory, x.shape[1])
    notes.append(
        f"the motion has {len(breaks) - 1:,} pieces and is drawn by straight lines between {len(t):,} instants: up to about "
        f"{float(off.max()) * 1e3:.2g} mm from where it is"
    )
    return (
        np.concatenate([t[:1], np.repeat(t[1:-1], 2), t[-1:]]),
        np.concatenate([x[:1], np.repeat(x[1:-1], 2, axis=0), x[-1:]]),
        np.repeat(slope, 2, axis=0),
    )


# ---- Sampling --------------------------------------------------------------------------------------------------------


def _state(trajectory: AnyTrajectory, t: Array) -> _State:
    """Return values and rates at times (m,); quaternions follow each other without a jump of their sign."""
    q, dq, _ = trajectory.sample(t)
    if not trajectory.base_model.follows_arm:
        return _State(q, dq)
    p, w, v, omega = trajectory.base_state(t)
    dw = multiplied(w, np.concatenate([np.zeros((len(t), 1)), omega], axis=1)) / 2
    flips = np.where((w[1:] * w[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    sign = np.concatenate([[1.0], np.cumprod(flips)])[:, None]
    return _State(np.concatenate([q, p, sign * w], axis=1), np.concatenate([dq, v, sign * dw], axis=1))


def _same_sign(x: Array, dx: Array, like: Array, dof: int) -> tuple[Array, Array]:
    """Give quaternions (..., c) the sign of others."""
    w = slice(dof + 3, dof + 7)
    sign = np.where((x[..., w] * like[..., w]).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    x, dx = x.copy(), dx.copy()
    x[..., w] *= sign
    dx[..., w] *= sign
    return x, dx


def _weights(trajectory: AnyTrajectory, count: int) -> Array:
    """Return by how much a difference of each value moves any point of the robot, at most (c,) [m per unit]."""
    robot = trajectory.robot
    far = reaches(robot)
    weights = np.zeros(count)
    weights[: robot.dof] = joint_weights(robot, far)
    if count > robot.dof:
        reach = float(far.max(initial=0.0)) + sum(float(np.linalg.norm(j.T_parent_joint[:3, 3])) for j in robot.joints)
        weights[robot.dof : robot.dof + 3], weights[robot.dof + 3 :] = 1.0, 2 * reach
    return weights


def joint_weights(robot: Robot, far: Array) -> Array:
    """Return by how much a difference of each degree of freedom moves any point of a robot, at most (n,) [m per rad or m]."""
    weights = np.zeros(robot.dof)
    for joint, reach in zip(robot.joints, far.tolist(), strict=True):
        weights[joint.dof] += abs(joint.multiplier) * (1.0 if joint.kind == "prismatic" else reach)
    return weights
