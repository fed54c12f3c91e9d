"""The path of the end effector and the arm on its way, in space (the paper's Figs. 6b and 9b)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.motion import Trajectory
from spacearm.robot import Robot
from spacearm.scene import HalfSpace, Scene, SphereSet
from spacearm.show.obstacles_in_space import across_and_up, draw_obstacles, parted
from spacearm.show.path_drawing import (
    LEGEND_ROW,
    PathDrawing,
    draw_bases,
    draw_envelopes,
    draw_lines,
    extent,
    legend_handles,
    make_drawing,
)
from spacearm.show.shapes import common_outline, silhouette
from spacearm.show.style import COLUMN, GREY, LIGHT, figure_of, look, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


def figure_path_3d(
    trajectory: Trajectory | None,
    robot: Robot,
    scene: Scene,
    *,
    start: ArrayLike,
    goal: ArrayLike | None = None,
    trace: ArrayLike | None = None,
    title: str = "",
    view: tuple[float, float] = (32.0, -58.0),
    ax: Any = None,
) -> Figure:
    """Draw the path in space, with equal scales, over its shadow on the floor of the picture.

    Args:
        trajectory, robot, scene, start, goal, trace, title: as for `figure_path_2d`.
        view: elevation and azimuth of the eye [deg].
        ax: three-dimensional axes to draw in; a new figure unless given.

    Raises:
        ProblemError: a start that is not one configuration, a goal that is not a point.
        RobotError: configurations that are not the robot's.
    """
    drawing = make_drawing(trajectory, robot, start, goal, trace)
    low, high = extent(drawing, scene, 3)
    with look():
        own = ax is None
        if own:
            ax = new_figure(COLUMN, COLUMN, layout=None).add_axes((0, 0, 1, 1), projection="3d", computed_zorder=False)
        _box(ax, low, high, view)
        _shadow(ax, drawing, scene, float(low[2]))
        behind, before = parted(scene, drawing.bases[-1], view)
        draw_obstacles(ax, behind, low, high, view)
        draw_bases(ax, drawing, *across_and_up(view), low, high)
        draw_obstacles(ax, before, low, high, view)
        draw_envelopes(ax, drawing, *across_and_up(view), dims=3)
        draw_lines(ax, drawing, 3)
        figure, handles = figure_of(ax), legend_handles(drawing, scene, low, high)
        if own:
            _fill(figure, ax, low, high, len(handles))
            figure.legend(handles=handles, loc="lower center", ncols=2)
            figure.text(0.02, 0.99, title, va="top", fontsize=8)
        else:
            ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2)
            ax.set_title(title, loc="left")
        return figure


def _box(ax: Any, low: Array, high: Array, view: tuple[float, float]) -> None:
    """Set limits, equal scales, the viewpoint and light axes."""
    from matplotlib.ticker import MultipleLocator

    step = _tick_step(float((high - low).max()))
    for name, a, b, pad in zip("xyz", low, high, (-5, -2, -4), strict=True):
        getattr(ax, f"set_{name}lim")(a, b)
        getattr(ax, f"set_{name}label")(f"{name} [m]", labelpad=pad)
        axis = getattr(ax, f"{name}axis")
        axis.set_major_locator(MultipleLocator(step))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.pane.set_edgecolor(LIGHT)
        axis.line.set_linewidth(0.6)
        axis._axinfo["grid"].update(color=LIGHT, linewidth=0.4)
        axis._axinfo["tick"].update(inward_factor=0.0, outward_factor=0.15)
    ax.tick_params(labelsize=6.5, pad=-2)
    ax.tick_params(axis="z", pad=0)
    ax.set_box_aspect(high - low)
    ax.view_init(elev=view[0], azim=view[1])


def _tick_step(span: float) -> float:
    """Return a round step that gives about six ticks on the longest axis; the same on all."""
    wanted = span / 6
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * min((1.0, 2.0, 5.0, 10.0), key=lambda factor: abs(factor * power - wanted)))


def _fill(figure: Figure, ax: Any, low: Array, high: Array, entries: int) -> None:
    """Zoom and place the axes so that the box fills the column, and give the figure the height that this takes."""
    left, right, bottom, top = 0.15, 0.5, 0.84, 0.2  # [inch] for tick labels, axis labels, legend and title
    bottom += LEGEND_ROW * max(0, (entries + 1) // 2 - 3)
    ax.set_position((0.0, 0.0, 1.0, COLUMN / figure.get_figheight()))
    least, most = _seen_box(ax, low, high)
    zoom = float(min((COLUMN - left - right) / (most - least)[0], 3.2 / (most - least)[1]))
    ax.set_box_aspect(high - low, zoom=zoom)
    least, most = _seen_box(ax, low, high)
    width, height = most - least
    full = bottom + float(height) + top
    at = np.array([left + (COLUMN - left - right - width) / 2, bottom]) - least
    figure.set_size_inches(COLUMN, full)
    ax.set_position((at[0] / COLUMN, at[1] / full, 1.0, COLUMN / full))


def _seen_box(ax: Any, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the corners of the rectangle on the page that the axes' box takes, (2,) each [inch]."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    ax.apply_aspect()
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3)
    x, y, _ = proj_transform(corners[:, 0], corners[:, 1], corners[:, 2], ax.get_proj())
    seen = ax.transData.transform(np.column_stack([x, y])) / ax.figure.dpi
    return seen.min(axis=0), seen.max(axis=0)


def _shadow(ax: Any, drawing: PathDrawing, scene: Scene, floor: float) -> None:
    """Draw obstacles, path and last pose on the floor, grey: so the eye can tell heights."""
    for obstacle in scene.obstacles:
        if isinstance(obstacle, HalfSpace):
            continue
        if isinstance(obstacle, SphereSet):
            outline = common_outline(obstacle.centers[:, :2], obstacle.radii)
        else:
            outline = silhouette(obstacle, *np.eye(3)[:2])[:, :2]
            outline = np.concatenate([outline, outline[:1]])
        ax.plot(*outline.T, floor, color=GREY, alpha=0.5, linewidth=0.5, zorder=1)
    for segment in drawing.poses[-1].segments:
        ax.plot(*segment.T[:2], floor, color=LIGHT, linewidth=1.4, zorder=1)
    for end in drawing.ends:
        ax.plot(end[[0, 0]], end[[1, 1]], [floor, end[2]], color=GREY, linewidth=0.6, linestyle=(0, (1, 2)), zorder=1.2)
    if drawing.path is not None:
        ax.plot(*drawing.path.T[:2], floor, color=GREY, alpha=0.6, linewidth=0.8, zorder=1.1)
