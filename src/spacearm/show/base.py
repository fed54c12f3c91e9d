"""A floating base over time: its attitude, how fast it turns, and the momentum that remains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import ProblemError
from spacearm.momentum.turning import conjugate, multiplied
from spacearm.motion import AnyTrajectory
from spacearm.planner.floating import BaseLimits
from spacearm.show.momentum_residual import residual_momentum
from spacearm.show.style import (
    BLACK,
    BLUE,
    COLUMN,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    label_right,
    legend_below,
    look,
    new_figure,
    tidy,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_SAMPLES, _JUDGED = 401, 201
_AXES = BLUE, ORANGE, GREEN
_LEAST = 1e-18  # what is exactly 0 has no place on a logarithmic axis


def figure_base_motion(trajectory: AnyTrajectory, *, limits: BaseLimits | None = None, title: str = "") -> Figure:
    """Draw how a floating base turns: its rotation vector from where it began, its rate, and the momentum that remains.

    The residual is of the total momentum against what is conserved, relative to the greatest momentum of a single link, as in
    the certificate; that of the poses takes the base's rate from differences of its attitude, and so judges the integration.

    Args:
        trajectory: whose base floats.
        limits: that were asked for; those of angle and rate are drawn.
        title: above all.

    Raises:
        ProblemError: the base is fixed.
    """
    require_floating(trajectory)
    with look():
        figure = new_figure(COLUMN, 5.4)
        attitude, rate, residual = figure.subplots(3, 1, sharex=True, height_ratios=(1.25, 1, 1))
        t = np.linspace(0.0, trajectory.duration, _SAMPLES)
        asked = limits or BaseLimits()
        _components(attitude, t, rotation_vectors(trajectory, t), {"limit": asked.peak, "limit\nat end": asked.final})
        attitude.set_ylabel("rotation [deg]")
        _components(rate, t, trajectory.base_rate(t)[1], {"limit": asked.rate})
        rate.set_ylabel("rate [deg/s]")
        _residual(residual, trajectory)
        residual.set_xlabel("time [s]")
        residual.set_xlim(0.0, trajectory.duration or 1.0)
        for ax, text in ((attitude, "rotation vector from the start"), (rate, "angular rate, base axes")):
            ax.set_title(text, loc="left", fontsize=7.5)
        residual.set_title("residual momentum / greatest of a link", loc="left", fontsize=7.5)
        if title:
            figure.suptitle(title, x=0.01, ha="left", fontsize=8)
        _legend(rate)
        figure.align_ylabels([attitude, rate, residual])
        return figure


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


def _legend(ax: Axes) -> None:
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
