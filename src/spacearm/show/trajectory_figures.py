"""A trajectory's joints and clearance over time, and the joints of the swarm's best over the iterations (Figs. 5 and 8).

Angles are drawn in degrees, lengths in metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError, RobotError, SettingsError
from spacearm.geometry import Scene
from spacearm.geometry.scene import moved_scene
from spacearm.motion import AnyTrajectory
from spacearm.motion.trajectory import base_frames
from spacearm.planner.clearance import clearances, self_clearances
from spacearm.proof import Certificate
from spacearm.robot import Robot
from spacearm.show.figure_style import (
    BLACK,
    BLUE,
    COLUMN,
    CYCLE,
    GREY,
    LIGHT,
    PAGE,
    VERMILION,
    figure_of,
    label_right,
    legend_below,
    look,
    new_figure,
    tidy,
)
from spacearm.show.motion_shown import axes_given, motion_shown
from spacearm.show.swarm_figures import DASHED, infeasible_part, iteration_axis
from spacearm.swarm import SwarmResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_BAND = "#EEF3F7"  # where a joint may be


_SAMPLES, _SAMPLES_FLOATING = 801, 401
_SAYS = {"fails": "fails", "undecided": "is undecided", "holds": "bounds no clearance"}


def figure_joints_over_iterations(result: SwarmResult, ax: Any = None, *, robot: Robot, title: str = "") -> Figure:
    """Draw each joint of the swarm's best over the iterations, with its limits.

    Args:
        result: of a swarm, with the positions in its history, each a configuration.
        ax: n axes to draw in, one a joint, as `figure.subplots(n, 1)` makes them; a new figure unless given.
        robot: whose configurations they are.
        title: above all.

    Raises:
        SettingsError: the run kept no positions, another number of axes, or matplotlib is not installed.
        RobotError: the positions are not the robot's.
    """
    positions = result.history.positions
    if positions is None:
        raise SettingsError("the run kept no positions, expected them in its history; run it with history='positions'")
    if positions.shape[1] != robot.dof:
        raise RobotError(f"the run has {positions.shape[1]} dimensions, expected the {robot.dof} of robot '{robot.name}'")
    with look():
        cells, lowest, free = _cells(robot) if ax is None else _given_cells(ax, robot)
        x = np.arange(1, len(positions) + 1)
        feasible = result.history.violation <= 0
        for dof, cell in enumerate(cells):
            scale, unit = _print_unit(robot, dof)
            _joint_curve(cell, x, positions[:, dof] * scale, feasible)
            _limits(cell, robot.lower[dof] * scale, robot.upper[dof] * scale, unit)
            cell.set_title(robot.dof_names[dof], loc="left", fontsize=7.5)
            cell.set_ylabel(f"$q_{{{dof + 1}}}$ [{unit}]", labelpad=1)
            iteration_axis(cell, len(x), ticks=4)
        for cell in lowest:
            cell.set_xlabel("iteration")
        handles = _handles(infeasible=not feasible.all())
        if ax is not None:
            return _finished(cells, title, handles)
        figure = figure_of(cells[0])
        _suptitle(figure, title)
        _legend(figure, handles, free=free)
        return figure


def _cells(robot: Robot) -> tuple[list[Axes], list[Axes], bool]:
    """Return axes for the joints in a new figure, those of them at the bottom, and whether there is room for a legend."""
    columns = min(4, robot.dof)
    rows = math.ceil(robot.dof / columns)
    grid = new_figure(PAGE * max(columns, 2) / 4, 0.45 + 1.35 * rows).subplots(rows, columns, sharex=True, squeeze=False)
    free = rows * columns - robot.dof  # the cells at the end of the first row, so that every column ends at the bottom
    for cell in grid[0, columns - free :]:
        cell.set_visible(False)
    return [*grid[0, : columns - free], *grid[1:].ravel()], list(grid[-1]), free > 0


def _given_cells(ax: Any, robot: Robot) -> tuple[list[Axes], list[Axes], bool]:
    cells = axes_given(ax, (robot.dof, 1), what="this figure, one a joint").ravel().tolist()
    return cells, cells[-1:], False


def figure_joints(result: Any, ax: Any = None, *, title: str | None = None) -> Figure:
    """Draw q, dq and ddq of every joint over time, with the limits of each.

    Args:
        result: a plan, a saved plan or a trajectory.
        ax: 3 n axes to draw in, a row for each joint, as `figure.subplots(n, 3)` makes them; a new figure unless given.
        title: above all; None: the name of a plan's robot.

    Raises:
        ProblemError: a result without a motion.
        SettingsError: another number of axes, or matplotlib is not installed.
    """
    given = motion_shown(result, what="a figure of the joints")
    trajectory, title = given.trajectory, given.title if title is None else title
    assert trajectory is not None  # `motion_shown` saw to it
    robot = trajectory.robot
    with look():
        if ax is None:
            grid = _grid_of_joints(robot.dof)
        else:
            grid = axes_given(ax, (robot.dof, 3), what="this figure: positions, rates and accelerations of each joint")
        t = np.linspace(0.0, trajectory.duration, 401)
        state = trajectory.sample(t)
        bounds = (robot.lower, robot.upper), (-robot.velocity, robot.velocity), (-robot.acceleration, robot.acceleration)
        for dof in range(robot.dof):
            scale, unit = _print_unit(robot, dof)
            for column, (values, (low, high), per) in enumerate(zip(state, bounds, ("", "/s", "/s²"), strict=True)):
                cell = grid[dof, column]
                cell.plot(t, values[:, dof] * scale, color=BLUE, linewidth=1.3)
                _limits(cell, low[dof] * scale, high[dof] * scale, unit)
                cell.set_xlim(0.0, trajectory.duration or 1.0)
                cell.set_ylabel(f"[{unit}{per}]", labelpad=3)
            grid[dof, 0].set_title(robot.dof_names[dof], loc="left", fontsize=7.5, pad=2)
        for top, what in zip(grid[0], ("position", "rate", "acceleration"), strict=True):
            top.set_title(what, loc="right", fontsize=7.5, pad=2, color=GREY)
        for cell in grid[-1]:
            cell.set_xlabel("time [s]")
        handles = _handles(infeasible=False)
        if ax is not None:
            return _finished(grid.ravel().tolist(), title, handles)
        figure = figure_of(grid[0, 0])
        if title:
            figure.text(0.01, 1 - 0.04 / figure.get_figheight(), title, va="top", fontsize=8)
        figure.legend(handles=handles, loc="lower center", ncols=len(handles))
        return figure


def _grid_of_joints(joints: int) -> Any:
    """Return axes (joints, 3) in a new figure. Their places are given: to find them takes longer than the rest."""
    above, row, gap, below = 0.32, 0.6, 0.24, 0.6  # [inch]
    left, between, right = 0.56, 0.6, 0.06
    height = above + row * joints + gap * (joints - 1) + below
    figure = new_figure(PAGE, height, layout=None)
    places = {"left": left / PAGE, "right": 1 - right / PAGE, "top": 1 - above / height, "bottom": below / height}
    width = (PAGE - left - right - 2 * between) / 3
    return figure.subplots(
        joints, 3, sharex=True, squeeze=False, gridspec_kw={**places, "wspace": between / width, "hspace": gap / row}
    )


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


def _finished(cells: Sequence[Axes], title: str, handles: Sequence[Any]) -> Figure:
    """Put title and legend where there is no figure of our own: above the first of the axes, and under the last."""
    if title:
        cells[0].set_title(f"{title}\n{cells[0].get_title(loc='left')}", loc="left", fontsize=7.5)
    legend_below(cells[-1], len(handles), handles=handles)
    return figure_of(cells[0])


def _handles(*, infeasible: bool) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Line2D([], [], color=BLUE, linewidth=1.3, label="joint")]
    if infeasible:
        handles.append(Line2D([], [], color=GREY, linestyle=DASHED, linewidth=1.1, label="not feasible yet"))
    handles.append(Line2D([], [], color=VERMILION, linewidth=0.8, linestyle=(0, (4, 2)), label="limit"))
    handles.append(Patch(facecolor=_BAND, edgecolor=LIGHT, linewidth=0.4, label="within the limits"))
    return handles


def _legend(figure: Figure, handles: Sequence[Any], *, free: bool) -> None:
    """Put the legend into the cell that is free, or under all axes."""
    if free:
        figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(0.99, 0.9))
    else:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def figure_clearance(
    result: Any,
    ax: Axes | None = None,
    *,
    scene: Scene | None = None,
    certificate: Certificate | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the clearance of the whole arm to each obstacle and to itself over time, and the proven lower bound.

    Args:
        result: a plan, a saved plan or a trajectory.
        ax: to draw in; a new figure unless given.
        scene: the obstacles; None: those of the plan's problem. The nearest ones have a colour, beyond seven the others are
            grey.
        certificate: of the trajectory in the scene; None: the plan's. Without one no bound is drawn.
        title: above the axes; None: the name of a plan's robot.

    Raises:
        ProblemError: a result without a motion, or a trajectory without a scene.
        SettingsError: matplotlib is not installed.
    """
    given = motion_shown(result, what="a figure of the clearance")
    trajectory, title = given.trajectory, given.title if title is None else title
    certificate = given.certificate if certificate is None else certificate
    scene = given.problem.scene if scene is None and given.problem is not None else scene
    assert trajectory is not None  # `motion_shown` saw to it
    if scene is None:
        raise ProblemError("the clearance of a trajectory is to be drawn, expected a scene with it; give scene=...")
    with look():
        ax = new_figure(COLUMN, 2.5).add_subplot() if ax is None else ax
        t = np.linspace(0.0, trajectory.duration, _SAMPLES_FLOATING if trajectory.base_model.follows_arm else _SAMPLES)
        values, names = _clearances(trajectory, scene, t)
        labels = _curves(ax, t, values, names)
        tidy(ax)
        ax.set_xlim(0.0, trajectory.duration or 1.0)
        ax.set_xlabel("time [s]")
        ax.set_ylabel("clearance [m]")
        ax.set_title(title, loc="left")
        if values.size:
            low, high = min(0.0, float(values.min())), float(values.max())
            ax.set_ylim(low - 0.07 * (high - low), high + 0.07 * (high - low))
            ax.axhspan(ax.get_ylim()[0], 0.0, color=GREY, alpha=0.18, linewidth=0)
            _bound(ax, certificate)
        else:
            ax.text(0.5, 0.5, "nothing is in the way", transform=ax.transAxes, ha="center", color=GREY)
        label_right(ax, labels)
        return figure_of(ax)


class _Arm(NamedTuple):
    """A robot among obstacles."""

    robot: Robot
    scene: Scene


def _clearances(trajectory: AnyTrajectory, scene: Scene, t: Array) -> tuple[Array, list[str]]:
    """Return the least clearances (times, curves) [m] and what each is of: the obstacles, and the robot's own links."""
    arm, q = _Arm(trajectory.robot, scene), trajectory.sample(t).q
    values, names = np.empty((len(t), 0)), []
    if arm.robot.shapes and scene.obstacles:
        values = _to_obstacles(trajectory, scene, t, q)
        names = [obstacle.name or f"obstacle {i}" for i, obstacle in enumerate(scene.obstacles)]
    if arm.robot.self_pairs:
        values = np.column_stack([values, self_clearances(arm, q).min(axis=1)])
        names.append("between links")
    return values, names


def _to_obstacles(trajectory: AnyTrajectory, scene: Scene, t: Array, q: Array) -> Array:
    """Return the least clearances (times, obstacles) [m]: the obstacles are told in the frame of the base, as it moves."""
    frames = base_frames(trajectory, t)
    inverse = np.linalg.inv(frames)
    if not np.ptp(frames, axis=0).any():
        return clearances(_Arm(trajectory.robot, moved_scene(scene, inverse[0])), q).min(axis=1)
    rows = [clearances(_Arm(trajectory.robot, moved_scene(scene, T)), row) for T, row in zip(inverse, q, strict=True)]
    return np.array(rows).min(axis=1)


def _curves(ax: Axes, t: Array, values: Array, names: Sequence[str]) -> list[tuple[float, str, str]]:
    nearest = np.argsort(values.min(axis=0), kind="stable")[: len(CYCLE)]
    labels = []
    others = np.setdiff1d(np.arange(values.shape[1]), nearest)
    if len(others):
        ax.plot(t, values[:, others], color=GREY, linewidth=0.5, zorder=2)
        labels.append((float(values[-1, others].max()), "others", GREY))
    for color, curve in zip(CYCLE, sorted(nearest.tolist()), strict=False):
        ax.plot(t, values[:, curve], color=color, linewidth=1.2, zorder=2.5)
        labels.append((float(values[-1, curve]), names[curve], color))
    return labels


def _bound(ax: Axes, certificate: Certificate | None) -> None:
    """Draw what contact is, what was measured and what is proven, and say so under the axes."""
    ax.axhline(0.0, color=GREY, linewidth=0.8, label="contact")
    if certificate is not None:
        near = certificate.closest
        if near is not None:
            text = f"closest measured: {_length(near.clearance)},\n{near.link} and {near.other}"
            style: dict[str, Any] = {"color": BLACK, "markersize": 4, "markerfacecolor": "white", "clip_on": False}
            ax.plot(near.time, near.clearance, "o", zorder=4, label=text, **style)
        if certificate.holds and certificate.clearance is not None:
            text = f"proven for all t: at least {_length(certificate.clearance)}"
            ax.axhline(certificate.clearance, color=BLACK, linewidth=1.0, linestyle=(0, (4, 2)), label=text)
        else:
            ax.plot([], [], linestyle="", label=f"not proven: the certificate {_SAYS[certificate.status]}")
    legend_below(ax, 1)


def _length(value: float) -> str:
    """Print a length in the unit that suits it."""
    for factor, unit in ((1.0, "m"), (1e3, "mm")):
        if abs(value) * factor >= 0.1:
            return f"{value * factor:.3g} {unit}"
    return f"{value * 1e6:.3g} µm"
