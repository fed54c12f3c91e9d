"""Figures of a floating base: its attitude and rate over time, the momentum that remains, and its path in the inertial frame.

The momentum that a trajectory states for its base is compared with what is conserved, by Pinocchio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.core.rotations import conjugate, multiplied
from spacearm.dynamics import center_of_mass
from spacearm.motion import AnyTrajectory
from spacearm.motion.trajectory import base_frames
from spacearm.planner.problem import BaseLimits
from spacearm.proof.mechanism import JointMap, free_base_model, pinocchio
from spacearm.show.drawing import RED
from spacearm.show.figure_style import (
    BLACK,
    BLUE,
    COLUMN,
    GREEN,
    ORANGE,
    PAGE,
    PURPLE,
    SKY,
    VERMILION,
    figure_of,
    label_right,
    legend_below,
    look,
    new_figure,
    tidy,
)
from spacearm.show.motion_shown import MotionShown, axes_given, motion_shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


Array = NDArray[np.float64]

_STENCIL = np.array([-3, -2, -1, 1, 2, 3]), np.array([-1, 9, -45, 45, -9, 1]) / 60  # a derivative, of sixth order
_STEP = 2e-3  # of the duration


_SAMPLES, _JUDGED = 401, 201  # instants that are drawn, and those whose momentum is compared
_AXES = BLUE, ORANGE, GREEN
_LEAST = 1e-18  # what is exactly 0 has no place on a logarithmic axis
_PATH_SAMPLES = 801
_PLANES = (0, 1), (0, 2), (1, 2)


class Residual(NamedTuple):
    """By how much the total momentum misses what is conserved, over time, (m,) each and relative to the greatest of a link.

    Attributes:
        linear: with the velocity that the trajectory states for its base.
        angular: about the system's centre of mass, with the rate that it states.
        of_poses: angular, with the rate that follows from the poses that it states, by differences; NaN near the ends.
    """

    linear: Array
    angular: Array
    of_poses: Array


def residual_momentum(trajectory: AnyTrajectory, t: Array) -> Residual:
    """Compare the momentum of a trajectory whose base floats with what it has to be.

    Args:
        trajectory: with masses.
        t: (m,) instants [s].
    """
    library, (model, at_q, at_v) = pinocchio(), free_base_model(trajectory.robot)
    state, joints = model.createData(), JointMap(trajectory.robot)
    moved = trajectory.sample(t)
    position, wxyz = trajectory.base_pose(t)
    velocity, omega = trajectory.base_rate(t)
    q, v = np.zeros((len(t), model.nq)), np.zeros((len(t), model.nv))
    q[:, :3], q[:, 3:7], q[:, at_q] = position, wxyz[:, [1, 2, 3, 0]], joints.values(moved.q)
    v[:, at_v] = moved.dq[:, joints.dof] * joints.multiplier
    differenced = differenced_rates(trajectory, t)
    given = np.concatenate([trajectory.momentum.linear, trajectory.momentum.angular])
    missed, by_poses, links = np.empty((len(t), 6)), np.empty((len(t), 3)), np.empty((len(t), model.njoints - 1, 6))
    for i, (row, rate) in enumerate(zip(q, v, strict=True)):
        R = library.Quaternion(row[3:7]).toRotationMatrix()
        rate[:3] = R.T @ velocity[i]
        rate[3:6] = differenced[i]
        by_poses[i] = library.computeCentroidalMomentum(model, state, row, rate).angular - given[3:]
        rate[3:6] = omega[i]
        missed[i] = library.computeCentroidalMomentum(model, state, row, rate).vector - given
        for k in range(1, model.njoints):
            own = state.oMi[k].act(model.inertias[k] * state.v[k])  # about the world's origin
            links[i, k - 1, :3], links[i, k - 1, 3:] = own.linear, own.angular - np.cross(state.com[0], own.linear)
    linear, angular = (float(np.linalg.norm(links[..., part], axis=-1).max()) for part in (slice(0, 3), slice(3, 6)))
    return Residual(
        np.linalg.norm(missed[:, :3], axis=1) / (linear or 1.0),
        np.linalg.norm(missed[:, 3:], axis=1) / (angular or 1.0),
        np.linalg.norm(by_poses, axis=1) / (angular or 1.0),
    )


def differenced_rates(trajectory: AnyTrajectory, t: Array) -> Array:
    """Return how the base turns, (m, 3) in base axes [rad/s], by differences of its attitude; NaN too near to the ends."""
    step = _STEP * trajectory.duration
    at = t[:, None] + step * _STENCIL[0]  # (m, 6)
    middle, around = trajectory.base_pose(t)[1], trajectory.base_pose(at)[1]
    turns = multiplied(conjugate(middle)[:, None], around)
    turns *= np.where(turns[..., :1] < 0, -1.0, 1.0)
    # The rotation vector from the middle's attitude begins at 0, where its derivative is the rate itself.
    size = np.linalg.norm(turns[..., 1:], axis=-1, keepdims=True)
    vectors = turns[..., 1:] * np.where(size > 0, 2 * np.arctan2(size, turns[..., :1]) / np.where(size > 0, size, 1.0), 2.0)
    rates = np.einsum("k,mkc->mc", _STENCIL[1], vectors) / (step or 1.0)
    rates[(at[:, 0] < 0) | (at[:, -1] > trajectory.duration)] = np.nan
    return rates


def figure_base_motion(result: Any, ax: Any = None, *, limits: BaseLimits | None = None, title: str | None = None) -> Figure:
    """Draw how a floating base turns: its rotation vector from where it began, its rate, and the momentum that remains.

    The residual is of the total momentum against what is conserved, relative to the greatest momentum of a single link, as in
    the certificate; that of the poses takes the base's rate from differences of its attitude, and so judges the integration.

    Args:
        result: a plan, a saved plan or a trajectory, whose base floats.
        ax: 3 axes to draw in, from the top down, as `figure.subplots(3, 1)` makes them; a new figure unless given.
        limits: that were asked for; None: those of the plan's problem. Those of angle and rate are drawn.
        title: above all; None: the name of a plan's robot.

    Raises:
        ProblemError: the base is fixed, or a result without a motion.
        SettingsError: another number of axes, or matplotlib is not installed.
    """
    given, trajectory, title = _floating(result, title)
    limits = given.problem.base_limits if limits is None and given.problem is not None else limits
    with look():
        if ax is None:
            cells = new_figure(COLUMN, 5.4).subplots(3, 1, sharex=True, height_ratios=(1.25, 1, 1))
        else:
            cells = axes_given(ax, (3, 1), what="this figure: rotation, rate and residual momentum").ravel()
        attitude, rate, residual = cells
        t = np.linspace(0.0, trajectory.duration, _SAMPLES)
        asked = limits or BaseLimits()
        _components(attitude, t, rotation_vectors(trajectory, t), {"limit": asked.peak, "limit\nat end": asked.final})
        attitude.set_ylabel("rotation [deg]")
        _components(rate, t, trajectory.base_rate(t)[1], {"limit": asked.rate})
        rate.set_ylabel("rate [deg/s]")
        _residual(residual, trajectory)
        residual.set_xlabel("time [s]")
        residual.set_xlim(0.0, trajectory.duration or 1.0)
        above = f"{title}\n" if title and ax is not None else ""
        for cell, text in ((attitude, f"{above}rotation vector from the start"), (rate, "angular rate, base axes")):
            cell.set_title(text, loc="left", fontsize=7.5)
        residual.set_title("residual momentum / greatest of a link", loc="left", fontsize=7.5)
        figure = figure_of(attitude)
        if title and ax is None:
            figure.suptitle(title, x=0.01, ha="left", fontsize=8)
        _legend_of_components(rate)
        figure.align_ylabels([attitude, rate, residual])
        return figure


def _floating(result: Any, title: str | None) -> tuple[MotionShown, AnyTrajectory, str]:
    """Return what is known of a motion, its trajectory and the title.

    Raises:
        ProblemError: its base is fixed.
    """
    given = motion_shown(result, what="a figure of the base")
    trajectory = given.trajectory
    assert trajectory is not None  # `motion_shown` saw to it
    require_floating(trajectory)
    return given, trajectory, given.title if title is None else title


def rotation_vectors(trajectory: AnyTrajectory, t: Array) -> Array:
    """Return by what rotation vector (m, 3) the base has turned since the start, in its axes at the start [rad].

    The angle is between 0 and pi, at each instant for itself.
    """
    turned = multiplied(conjugate(trajectory.base_pose(0.0)[1]), trajectory.base_pose(t)[1])
    turned *= np.where(turned[:, :1] < 0, -1.0, 1.0)
    size = np.linalg.norm(turned[:, 1:], axis=1, keepdims=True)
    angle = 2 * np.arctan2(size, turned[:, :1])
    return turned[:, 1:] * np.where(size > 0, angle / np.where(size > 0, size, 1.0), 2.0)


def require_floating(trajectory: AnyTrajectory) -> None:
    """Refuse a trajectory whose base is fixed.

    Raises:
        ProblemError: it is.
    """
    if not trajectory.base_model.follows_arm:
        raise ProblemError(
            "the base is fixed, expected a floating one: there is no motion of it to draw; leave this figure out"
        )


def _components(ax: Axes, t: Array, vectors: Array, limits: Mapping[str, float | None]) -> None:
    """Draw the components of vectors (m, 3) [rad] and their length in degrees, and the limits on it."""
    values = np.degrees(vectors)
    length = np.linalg.norm(values, axis=1)
    ax.plot(t, length, color=BLACK, linewidth=1.3)
    for i, color in enumerate(_AXES):
        ax.plot(t, values[:, i], color=color, linewidth=0.9)
    asked = [(math.degrees(limit), name, VERMILION) for name, limit in limits.items() if limit is not None]
    for limit, _, color in asked:
        ax.axhline(limit, color=color, linewidth=0.8, linestyle=(0, (4, 2)))
    tidy(ax)
    low, high = float(np.min(values, initial=0.0)), max([float(length.max()), *(limit for limit, _, _ in asked)])
    pad = 0.07 * (high - low) or 1.0
    ax.set_ylim(low - pad, high + pad)
    label_right(ax, asked)


def _legend_of_components(ax: Axes) -> None:
    """Name the lines of this panel and of the one above."""
    from matplotlib.lines import Line2D

    names = ("magnitude", 1.3, BLACK), *((name, 0.9, color) for name, color in zip("xyz", _AXES, strict=True))
    handles = [Line2D([], [], color=color, linewidth=width, label=name) for name, width, color in names]
    legend_below(ax, 4, offset=7.0, handles=handles)


def _residual(ax: Axes, trajectory: AnyTrajectory) -> None:
    from matplotlib.ticker import LogLocator

    t = np.linspace(0.0, trajectory.duration, _JUDGED)
    found = residual_momentum(trajectory, t)
    for values, color, label in (
        (found.of_poses, PURPLE, "angular, by differences of the attitude"),
        (found.angular, BLACK, "angular, by the stated rates"),
        (found.linear, SKY, "linear, by the stated rates"),
    ):
        ax.semilogy(t, np.maximum(values, _LEAST), color=color, linewidth=0.9, label=label)
    tidy(ax)
    greatest = max(float(np.nanmax(values, initial=0.0)) for values in found)
    ax.set_ylim(1e-17, 10.0 ** math.ceil(math.log10(max(greatest, 1e-13)) + 0.5))
    ax.yaxis.set_major_locator(LogLocator(numticks=6))
    ax.minorticks_off()
    ax.set_ylabel("residual [-]")
    legend_below(ax, 1)


def figure_base_paths(result: Any, ax: Any = None, *, title: str | None = None) -> Figure:
    """Draw the paths of the end effector and of the base's origin in the inertial frame, seen along z, y and x.

    Every panel has equal scales on both axes; the base moves much less than the end effector and has a scale of its own. The
    centre of mass of base and arm stands still, or drifts if there is momentum.

    Args:
        result: a plan, a saved plan or a trajectory, whose base floats.
        ax: 6 axes to draw in, those of the end effector first, as `figure.subplots(2, 3)` makes them; a new figure unless
            given.
        title: above all; None: the name of a plan's robot.

    Raises:
        ProblemError: the base is fixed, or a result without a motion.
        SettingsError: another number of axes, or matplotlib is not installed.
    """
    _, trajectory, title = _floating(result, title)
    t = np.linspace(0.0, trajectory.duration, _PATH_SAMPLES)
    frames = base_frames(trajectory, t)
    center = np.einsum("tij,tj->ti", frames[:, :3, :3], center_of_mass(trajectory.robot, trajectory.sample(t).q))
    center += frames[:, :3, 3]
    with look():
        if ax is None:
            grid = new_figure(PAGE, 4.9, layout="compressed").subplots(2, 3)
        else:
            grid = axes_given(ax, (2, 3), what="this figure: end effector and base from three sides")
        for (a, b), (above, below) in zip(_PLANES, grid.T, strict=True):
            _path(above, trajectory.tip(t)[:, :3, 3], a, b, BLUE)
            _path(below, frames[:, :3, 3], a, b, VERMILION)
            below.plot(center[:, a], center[:, b], color=BLACK, linewidth=0.8)
            below.plot(center[-1, a], center[-1, b], "x", color=BLACK, markersize=5)
            for cell in (above, below):
                cell.set_xlabel(f"{'xyz'[a]} [m]")
                cell.set_ylabel(f"{'xyz'[b]} [m]")
                _square(cell)
        grid[0, 0].set_title(f"{title}\nend effector" if title and ax is not None else "end effector", loc="left")
        grid[1, 0].set_title("base origin", loc="left")
        figure = figure_of(grid[0, 0])
        if ax is not None:
            legend_below(grid[1, 1], 2, handles=_path_handles())
            return figure
        if title:
            figure.suptitle(title, x=0.01, ha="left", fontsize=8)
        handles = _path_handles()
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
        return figure


def _path(ax: Axes, points: Array, a: int, b: int, color: str) -> None:
    ax.plot(points[:, a], points[:, b], color=color, linewidth=1.5)
    ax.plot(points[0, a], points[0, b], "o", color=RED, markersize=4.5, markerfacecolor="white", zorder=3)
    ax.plot(points[-1, a], points[-1, b], "o", color=RED, markersize=4.5, zorder=3)
    tidy(ax)


def _square(ax: Axes) -> None:
    """Give both axes the same span about what is drawn, so that scales are equal and panels are square."""
    from matplotlib.ticker import MaxNLocator

    spans = [ax.get_xlim(), ax.get_ylim()]
    half = max((high - low) / 2 for low, high in spans) or 0.5
    for set_limits, (low, high) in zip((ax.set_xlim, ax.set_ylim), spans, strict=True):
        set_limits((low + high) / 2 - half, (low + high) / 2 + half)
    ax.set_aspect("equal")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))


def _path_handles() -> list[Any]:
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=BLUE, linewidth=1.5, label="path of the end effector"),
        Line2D([], [], color=VERMILION, linewidth=1.5, label="path of the base origin"),
        Line2D([], [], color=RED, marker="o", markerfacecolor="white", markersize=4.5, linestyle="", label="start"),
        Line2D([], [], color=RED, marker="o", markersize=4.5, linestyle="", label="end"),
        Line2D([], [], color=BLACK, marker="x", markersize=5, linewidth=0.8, label="centre of mass of base and arm"),
    ]
