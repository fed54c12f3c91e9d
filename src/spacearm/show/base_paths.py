"""Where the end effector and the base go in the inertial frame, each to its own scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.momentum import center_of_mass
from spacearm.motion import AnyTrajectory
from spacearm.show.arm import base_frames
from spacearm.show.base import require_floating
from spacearm.show.path_drawing import RED
from spacearm.show.style import BLACK, BLUE, PAGE, VERMILION, look, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_SAMPLES = 801
_PLANES = (0, 1), (0, 2), (1, 2)


def figure_base_paths(trajectory: AnyTrajectory, *, title: str = "") -> Figure:
    """Draw the paths of the end effector and of the base's origin in the inertial frame, seen along z, y and x.

    Every panel has equal scales on both axes; the base moves much less than the end effector and has a scale of its own. The
    centre of mass of base and arm stands still, or drifts if there is momentum.

    Args:
        trajectory: whose base floats.
        title: above all.

    Raises:
        ProblemError: the base is fixed.
    """
    require_floating(trajectory)
    t = np.linspace(0.0, trajectory.duration, _SAMPLES)
    frames = base_frames(trajectory, t)
    center = np.einsum("tij,tj->ti", frames[:, :3, :3], center_of_mass(trajectory.robot, trajectory.sample(t).q))
    center += frames[:, :3, 3]
    with look():
        figure = new_figure(PAGE, 4.9, layout="compressed")
        grid = figure.subplots(2, 3)
        for (a, b), (above, below) in zip(_PLANES, grid.T, strict=True):
            _path(above, trajectory.tip(t)[:, :3, 3], a, b, BLUE)
            _path(below, frames[:, :3, 3], a, b, VERMILION)
            below.plot(center[:, a], center[:, b], color=BLACK, linewidth=0.8)
            below.plot(center[-1, a], center[-1, b], "x", color=BLACK, markersize=5)
            for ax in (above, below):
                ax.set_xlabel(f"{'xyz'[a]} [m]")
                ax.set_ylabel(f"{'xyz'[b]} [m]")
                _square(ax)
        grid[0, 0].set_title("end effector", loc="left")
        grid[1, 0].set_title("base origin", loc="left")
        if title:
            figure.suptitle(title, x=0.01, ha="left", fontsize=8)
        _legend(figure)
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


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=BLUE, linewidth=1.5, label="path of the end effector"),
        Line2D([], [], color=VERMILION, linewidth=1.5, label="path of the base origin"),
        Line2D([], [], color=RED, marker="o", markerfacecolor="white", markersize=4.5, linestyle="", label="start"),
        Line2D([], [], color=RED, marker="o", markersize=4.5, linestyle="", label="end"),
        Line2D([], [], color=BLACK, marker="x", markersize=5, linewidth=0.8, label="centre of mass of base and arm"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
