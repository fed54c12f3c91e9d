"""The curves of a motion for a report: joints, tool, and a base that the arm moves, over time.

Rates of the tool are computed from the joints' and the base's rates, not by differences.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import matrix_of, rotation_vectors
from spacearm.dynamics import momentum_map
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.planner.problem import BaseLimits
from spacearm.report.report_clearance import PairClearances
from spacearm.report.report_knots import breaks_of
from spacearm.report.report_page import plot, series
from spacearm.robot import Robot, joint_frames

Array = NDArray[np.float64]
Plot = dict[str, Any]

INSTANTS = 501
"""Evenly spread, at which curves are computed, beside those just before and after breaks."""

_TURN = 2 * math.pi
_JUMP = 1.0  # [rad] from one instant to the next
_MOST_BREAKS = 150  # of a motion's pieces whose both sides are instants of the curves, the accelerations that jump most
_BESIDE = 1e-7  # times the piece's length: so near are the two sides of a break
_DEGREE = math.degrees(1.0)
_LEAST_FLOOR, _FLOOR = 1e-3, 0.1  # [mm] of the logarithmic axis of clearances
_GREY = 6  # the page's grey tone: of what summarises the others
_RESIDUAL_FLOOR = 1e-18
_JUDGED = 61  # instants at which the momentum is compared


class Sampled(NamedTuple):
    """A motion at instants.

    Attributes:
        t: (m,) [s].
        q, dq, ddq: (m, n) [rad or m, per s, per s^2].
        T: (m, 4, 4) the end effector in the inertial frame [m].
        velocity: (m, 3) of the end effector [m/s], inertial frame.
        omega: (m, 3) its rate [rad/s], inertial frame.
        base_at: (m, 3) the base's origin [m], inertial frame.
        base_R: (m, 3, 3) its orientation R_w_b.
        base_omega: (m, 3) its rate [rad/s], base axes.
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    T: Array
    velocity: Array
    omega: Array
    base_at: Array
    base_R: Array
    base_omega: Array


def instants_of(trajectory: AnyTrajectory, also: Sequence[float] = ()) -> Array:
    """Return instants (m,) [s] for curves: evenly spread, and both sides of breaks at which the accelerations jump.

    Args:
        trajectory: the motion.
        also: instants that are to be among them.
    """
    duration = trajectory.duration
    if duration == 0:
        return np.zeros(1)
    breaks = breaks_of(trajectory)
    even = np.unique(np.concatenate([np.linspace(0.0, duration, INSTANTS), also]))
    if len(breaks) <= 2:
        return even
    inner, size = breaks[1:-1], np.diff(breaks)
    before, after = inner - _BESIDE * size[:-1], inner + _BESIDE * size[1:]
    jump = np.abs(trajectory.sample(after).ddq - trajectory.sample(before).ddq)
    scale = np.maximum(np.abs(trajectory.sample(even).ddq).max(axis=0), 1e-30)
    worst = (jump / scale).max(axis=1)
    some = np.argsort(-worst, kind="stable")[:_MOST_BREAKS]
    some = some[worst[some] > 1e-3]
    return np.sort(np.concatenate([even, before[some], after[some]]))


def sampled(trajectory: AnyTrajectory, t: Array) -> Sampled:
    """Return a motion at instants (m,) [s]."""
    q, dq, ddq = trajectory.sample(t)
    frames = joint_frames(trajectory.robot, q)
    T, velocity, omega = _tool(trajectory.robot, frames, dq)
    position, attitude, base_velocity, base_omega = trajectory.base_state(t)
    R = matrix_of(attitude)
    placed = T.copy()
    placed[:, :3, :3] = R @ T[:, :3, :3]
    turned = np.einsum("mij,mj->mi", R, T[:, :3, 3])
    placed[:, :3, 3] = position + turned
    spin = np.einsum("mij,mj->mi", R, base_omega)
    moved = base_velocity + np.cross(spin, turned) + np.einsum("mij,mj->mi", R, velocity)
    turning = spin + np.einsum("mij,mj->mi", R, omega)
    return Sampled(t, q, dq, ddq, placed, moved, turning, position, R, base_omega)


def _tool(robot: Robot, frames: Array, dq: Array) -> tuple[Array, Array, Array]:
    """Return T_b_tip (m, 4, 4), the tip's velocity and its rate (m, 3) in base axes, while the base rests."""
    tip = robot.frame(robot.tip)
    T = frames[:, tip.joint] @ tip.T_joint_frame if tip.joint >= 0 else np.broadcast_to(tip.T_joint_frame, (len(dq), 4, 4))
    velocity, omega, at = np.zeros((len(dq), 3)), np.zeros((len(dq), 3)), tip.joint
    while at >= 0:
        joint = robot.joints[at]
        axis = frames[:, at, :3, 2] * (joint.multiplier * dq[:, joint.dof])[:, None]
        if joint.kind == "prismatic":
            velocity += axis
        else:
            omega += axis
            velocity += np.cross(axis, T[:, :3, 3] - frames[:, at, :3, 3])
        at = joint.parent
    return T, velocity, omega


# ---- Joints ----------------------------------------------------------------------------------------------------------


def joint_plots(trajectory: AnyTrajectory, at: Sampled) -> list[Plot]:
    """Return plots of the joints' positions, rates and accelerations against their limits: turning joints in deg."""
    robot = trajectory.robot
    sliding = np.array([robot.is_prismatic(i) for i in range(robot.dof)])
    plots: list[Plot] = []
    for kind, which, factor, unit in (
        ("", np.flatnonzero(~sliding), _DEGREE, "deg"),
        ("sliding ", np.flatnonzero(sliding), 1e3, "mm"),
    ):
        if not len(which):
            continue
        for name, values, lower, upper, per in (
            ("positions", at.q, robot.lower, robot.upper, ""),
            ("rates", at.dq, -robot.velocity, robot.velocity, "/s"),
            ("accelerations", at.ddq, -robot.acceleration, robot.acceleration, "/s²"),
        ):
            curves = [series(robot.dof_names[i], values[:, i] * factor, k) for k, i in enumerate(which.tolist())]
            limits = [(k, float(lower[i]) * factor, float(upper[i]) * factor) for k, i in enumerate(which.tolist())]
            title = f"{kind}joint {name}".capitalize()
            plots.append(plot(f"{kind.strip() or 'joint'}-{name}", title, unit + per, at.t, curves, limits=limits))
    return plots


# ---- Clearance -------------------------------------------------------------------------------------------------------


def clearance_plot(found: PairClearances, *, asked: float, proven: float | None) -> Plot:
    """Return a plot of the clearances by pair, with what is asked for and what is proven [m]."""
    values = found.values * 1e3
    curves = [series("closest of all", found.least * 1e3, _GREY)]
    curves += [series(name, values[:, i], i if i < _GREY else i + 1) for i, name in enumerate(found.names)]
    lines = [(asked * 1e3, f"asked for: {asked * 1e3:.4g} mm")] if asked > 0 else []
    if proven is not None and 0 < proven < math.inf:
        lines.append((proven * 1e3, f"proven: {proven * 1e3:.4g} mm"))
    floor = floor_of(np.concatenate([found.least * 1e3, [value for value, _ in lines]]))
    notes = [f"The {len(found.names)} pairs that come nearest, of {found.pairs}."] if found.pairs > len(found.names) else []
    if (found.least <= 0).any():
        notes.append(f"Contact is drawn at {floor:g} mm.")
    note = " ".join(notes)
    title = "Clearance by pair"
    return plot("clearance", title, "mm", found.t, curves, log=True, floor=floor, lines=lines, note=note)


def floor_of(values: Array) -> float:
    """Return the least value of a logarithmic axis [mm]: 0.1, or a power of 10 below the least clearance."""
    positive = values[values > 0]
    least = float(positive.min()) if len(positive) else _FLOOR
    return max(_LEAST_FLOOR, min(_FLOOR, 10.0 ** math.floor(math.log10(least))))


# ---- Tool ------------------------------------------------------------------------------------------------------------


def tool_plots(trajectory: AnyTrajectory, at: Sampled) -> list[Plot]:
    """Return plots of the end effector: its speed and rate, its position, and by what it has turned since the start."""
    turned = turned_since_start(at.T[:, :3, :3])
    speed, rate = np.linalg.norm(at.velocity, axis=1), np.linalg.norm(at.omega, axis=1)
    name = trajectory.robot.tip
    by_axis = [series(axis, at.T[:, i, 3] * 1e3, i) for i, axis in enumerate("xyz")]
    angle = np.linalg.norm(turned, axis=1)
    orientation = [series("angle", angle * _DEGREE, 0)]
    orientation += [series(axis, turned[:, i] * _DEGREE, i + 1, dashed=True) for i, axis in enumerate("xyz")]
    return [
        plot("tool-speed", f"Speed of {name}", "mm/s", at.t, [series("speed", speed * 1e3, 0)]),
        plot("tool-rate", f"Angular speed of {name}", "deg/s", at.t, [series("angular speed", rate * _DEGREE, 1)]),
        plot("tool-position", f"Position of {name}, inertial frame", "mm", at.t, by_axis),
        plot(
            "tool-orientation",
            f"Orientation of {name}, from the start",
            "deg",
            at.t,
            orientation,
            note="The rotation vector from the orientation at the start, inertial axes, and its angle.",
        ),
    ]


def turned_since_start(R: Array) -> Array:
    """Return by what rotation vectors (m, 3) orientations (m, 3, 3) are turned from the first one, in inertial axes [rad].

    Beyond half a turn they go on without a jump: of all vectors that mean the same orientation it is the one nearest to that
    before it.
    """
    vectors = rotation_vectors(R @ R[0].T)
    if not (np.linalg.norm(np.diff(vectors, axis=0), axis=1) > _JUMP).any():
        return vectors
    for i in range(1, len(vectors)):
        size = float(np.linalg.norm(vectors[i]))
        if size > 0:
            axis = vectors[i] / size
            vectors[i] += axis * _TURN * round((float(axis @ vectors[i - 1]) - size) / _TURN)
    return vectors


# ---- Base ------------------------------------------------------------------------------------------------------------


def base_plots(trajectory: AnyTrajectory, at: Sampled, limits: BaseLimits | None) -> list[Plot]:
    """Return plots of a base that the arm moves: angle, rate, position and momentum; none for a fixed base."""
    if not trajectory.base_model.follows_arm:
        return []
    asked = limits or BaseLimits()
    omega, turned = np.einsum("mij,mj->mi", at.base_R, at.base_omega), turned_since_start(at.base_R)
    angle, rate = np.linalg.norm(turned, axis=1), np.linalg.norm(omega, axis=1)
    drift = (at.base_at - at.base_at[0]) * 1e3
    return [
        plot(
            "base-angle",
            "Base: angle from the start",
            "deg",
            at.t,
            _with_axes("angle", angle * _DEGREE, turned * _DEGREE),
            lines=_lines((asked.peak, "limit"), (asked.final, "limit at the end"), factor=_DEGREE, unit="deg"),
            note="The rotation vector from the attitude at the start, inertial axes, and its angle.",
        ),
        plot(
            "base-rate",
            "Base: angular rate",
            "deg/s",
            at.t,
            _with_axes("rate", rate * _DEGREE, omega * _DEGREE),
            lines=_lines((asked.rate, "limit"), factor=_DEGREE, unit="deg/s"),
        ),
        plot(
            "base-position",
            "Base: way from the start",
            "mm",
            at.t,
            _with_axes("distance", np.linalg.norm(drift, axis=1), drift),
        ),
        _momentum_plot(trajectory, at, asked),
        _residual_plot(trajectory),
    ]


def _with_axes(name: str, size: Array, parts: Array) -> list[dict[str, Any]]:
    return [series(name, size, 0), *(series(axis, parts[:, i], i + 1, dashed=True) for i, axis in enumerate("xyz"))]


def _lines(*given: tuple[float | None, str], factor: float, unit: str) -> list[tuple[float, str]]:
    return [(value * factor, f"{label}: {value * factor:.4g} {unit}") for value, label in given if value is not None]


def _momentum_plot(trajectory: AnyTrajectory, at: Sampled, asked: BaseLimits) -> Plot:
    """Return a plot of the angular momentum about the system's centre of mass: the arm's, the base's reaction, and in all."""
    H_w, H_q = momentum_map(trajectory.robot, at.q)
    arm, whole = np.einsum("mij,mj->mi", H_q, at.dq), np.einsum("mij,mj->mi", H_w, at.base_omega)
    total = np.einsum("mij,mj->mi", at.base_R, arm + whole)
    curves = [
        series("joints' motion", np.linalg.norm(arm, axis=1), 0),
        series("turning of the whole", np.linalg.norm(whole, axis=1), 1, dashed=True),
        series("in all", np.linalg.norm(total, axis=1), 2),
    ]
    lines = _lines((asked.joint_momentum, "limit"), factor=1.0, unit="N m s")
    title, note = (
        "Angular momentum about the centre of mass",
        "Of the joints' motion alone, of the whole turning with the base, and both.",
    )
    return plot("momentum", title, "N m s", at.t, curves, lines=lines, note=note)


def _residual_plot(trajectory: AnyTrajectory) -> Plot:
    """Return a plot of by how much the momentum that the trajectory states misses what is conserved."""
    from spacearm.show.base_figures import residual_momentum

    t = np.linspace(0.0, trajectory.duration, _JUDGED)
    found = residual_momentum(trajectory, t)
    floor = _RESIDUAL_FLOOR
    curves = [
        series("linear", np.maximum(found.linear, floor), 0),
        series("angular", np.maximum(found.angular, floor), 1),
        series("angular, rate by differences of the attitude", np.maximum(found.of_poses, floor), 2, dashed=True),
    ]
    note = "What the total momentum misses to what is conserved, by Pinocchio, as a share of the greatest momentum of a link."
    return plot("residual", "Residual momentum", "share", t, curves, log=True, floor=floor, note=note)


def path_length(points: Array) -> float:
    """Return the length of a line through points (m, 3) [m]."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def joint_path_length(trajectory: AnyTrajectory, q: Array) -> float:
    """Return the length of a motion in joint space [rad or m]; q (m, n): what it is sampled at."""
    if isinstance(trajectory, Trajectory):
        return trajectory.motion.length()
    return path_length(q)
