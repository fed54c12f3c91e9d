"""The joints: of the swarm's best over the iterations (the paper's Figs. 5 and 8), and of a trajectory over time.

Angles are drawn in degrees, lengths in metres.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import RobotError, SettingsError
from spacearm.motion import Trajectory
from spacearm.robot import Robot
from spacearm.show.convergence import DASHED, infeasible_part, iteration_axis
from spacearm.show.style import BLUE, GREY, LIGHT, PAGE, VERMILION, look, new_figure, tidy
from spacearm.swarm import SwarmResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_BAND = "#EEF3F7"  # where a joint may be


def figure_joints_over_iterations(run: SwarmResult, robot: Robot, *, title: str = "") -> Figure:
    """Draw each joint of the swarm's best over the iterations, with its limits.

    Args:
        run: with the positions in its history, each a configuration.
        robot: whose configurations they are.
        title: above all.

    Raises:
        SettingsError: the run kept no positions.
        RobotError: the positions are not the robot's.
    """
    positions = run.history.positions
    if positions is None:
        raise SettingsError("the run kept no positions, expected them in its history; run it with history='positions'")
    if positions.shape[1] != robot.dof:
        raise RobotError(f"the run has {positions.shape[1]} dimensions, expected the {robot.dof} of robot '{robot.name}'")
    with look():
        columns = min(4, robot.dof)
        rows = math.ceil(robot.dof / columns)
        figure = new_figure(PAGE * max(columns, 2) / 4, 0.45 + 1.35 * rows)
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
        x = np.arange(1, len(positions) + 1)
        feasible = run.history.violation <= 0
        free = rows * columns - robot.dof  # the cells at the end of the first row, so that every column ends at the bottom
        cells = [*grid[0, : columns - free], *grid[1:].ravel()]
        for ax in grid[0, columns - free :]:
            ax.set_visible(False)
        for dof, ax in enumerate(cells):
            scale, unit = _print_unit(robot, dof)
            _joint_curve(ax, x, positions[:, dof] * scale, feasible)
            _limits(ax, robot.lower[dof] * scale, robot.upper[dof] * scale, unit)
            ax.set_title(robot.dof_names[dof], loc="left", fontsize=7.5)
            ax.set_ylabel(f"$q_{{{dof + 1}}}$ [{unit}]", labelpad=1)
            iteration_axis(ax, len(x), ticks=4)
        for ax in grid[-1]:
            ax.set_xlabel("iteration")
        _suptitle(figure, title)
        _legend(figure, infeasible=not feasible.all(), free=free > 0)
        return figure


def figure_joints(trajectory: Trajectory, *, title: str = "") -> Figure:
    """Draw q, dq and ddq of every joint over time, with the limits of each.

    Args:
        trajectory: to be drawn.
        title: above all.
    """
    robot = trajectory.robot
    with look():
        figure = new_figure(PAGE, 0.75 + 0.82 * robot.dof)
        grid = figure.subplots(robot.dof, 3, sharex=True, squeeze=False)
        t = np.linspace(0.0, trajectory.duration, 401)
        state = trajectory.sample(t)
        bounds = (robot.lower, robot.upper), (-robot.velocity, robot.velocity), (-robot.acceleration, robot.acceleration)
        for dof in range(robot.dof):
            scale, unit = _print_unit(robot, dof)
            for column, (values, (low, high), per) in enumerate(zip(state, bounds, ("", "/s", "/s²"), strict=True)):
                ax = grid[dof, column]
                ax.plot(t, values[:, dof] * scale, color=BLUE, linewidth=1.3)
                _limits(ax, low[dof] * scale, high[dof] * scale, unit)
                ax.set_xlim(0.0, trajectory.duration or 1.0)
                letters = ("q", r"\dot q", r"\ddot q")[column]
                ax.set_ylabel(f"${letters}_{{{dof + 1}}}$ [{unit}{per}]", labelpad=3)
            grid[dof, 0].set_title(robot.dof_names[dof], loc="left", fontsize=7.5, pad=2)
        for ax in grid[-1]:
            ax.set_xlabel("time [s]")
        figure.align_ylabels(grid)
        _suptitle(figure, title)
        _legend(figure, infeasible=False, free=False)
        return figure


def _print_unit(robot: Robot, dof: int) -> tuple[float, str]:
    """Return the factor to the unit in print, and its name."""
    return (1.0, "m") if robot.is_prismatic(dof) else (math.degrees(1.0), "deg")


def _joint_curve(ax: Axes, x: NDArray[np.int64], y: Array, feasible: NDArray[np.bool_]) -> None:
    common: dict[str, Any] = {"drawstyle": "steps-post", "marker": "o" if len(x) == 1 else "", "markersize": 3}
    ax.plot(x, infeasible_part(y, feasible), linestyle=DASHED, color=GREY, linewidth=1.1, **common)
    ax.plot(x, np.where(feasible, y, np.nan), color=BLUE, linewidth=1.3, **common)


def _limits(ax: Axes, lower: float, upper: float, unit: str) -> None:
    """Draw the limits that there are, and the band between them."""
    from matplotlib.ticker import MaxNLocator

    tidy(ax)
    steps = [1, 1.5, 2, 3, 4.5, 6, 9, 10] if unit == "deg" else [1, 2, 5, 10]
    ax.yaxis.set_major_locator(MaxNLocator(5, steps=steps, min_n_ticks=3))
    finite = [limit for limit in (lower, upper) if np.isfinite(limit)]
    for limit in finite:
        ax.axhline(limit, color=VERMILION, linewidth=0.8, linestyle=(0, (4, 2)))
    if len(finite) == 2:
        ax.axhspan(lower, upper, color=_BAND, linewidth=0, zorder=0)
        pad = 0.09 * (upper - lower) or 1.0
        ax.set_ylim(lower - pad, upper + pad)


def _suptitle(figure: Figure, title: str) -> None:
    if title:
        figure.suptitle(title, x=0.01, ha="left", fontsize=8)


def _legend(figure: Figure, *, infeasible: bool, free: bool) -> None:
    """Put the legend into the cell that is free, or under all axes."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Line2D([], [], color=BLUE, linewidth=1.3, label="joint")]
    if infeasible:
        handles.append(Line2D([], [], color=GREY, linestyle=DASHED, linewidth=1.1, label="not feasible yet"))
    handles.append(Line2D([], [], color=VERMILION, linewidth=0.8, linestyle=(0, (4, 2)), label="limit"))
    handles.append(Patch(facecolor=_BAND, edgecolor=LIGHT, linewidth=0.4, label="within the limits"))
    if free:
        figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(0.99, 0.9))
    else:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
