"""The path of the end effector and the arm on its way (the paper's Figs. 6 and 9), in the plane and in space.

As the paper draws them: obstacles are blue and transparent, the end effector's start and end are red circles, the target
is a green one, the planned path is a blue line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.motion import Trajectory
from spacearm.robot import Robot
from spacearm.scene import Scene
from spacearm.show.arm import outlines
from spacearm.show.path_drawing import OBSTACLE_ALPHA, PathDrawing, draw_lines, extent, legend_handles, make_drawing
from spacearm.show.style import BLUE, COLUMN, GREY, LIGHT, SKY, figure_of, legend_below, look, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


def figure_path_2d(
    trajectory: Trajectory | None,
    robot: Robot,
    scene: Scene,
    *,
    start: ArrayLike,
    goal: ArrayLike | None = None,
    trace: ArrayLike | None = None,
    title: str = "",
    ax: Axes | None = None,
) -> Figure:
    """Draw the path in the plane z = 0: obstacles become circles, links segments (the paper's section 2.1).

    Args:
        trajectory: the planned motion; None where there is none, and the arm is drawn at the start and the trace's end.
        robot: that moves.
        scene: what is in the way.
        start: (n,) configuration at the beginning [rad or m].
        goal: (3,) where the end effector is to be [m]; None if there is no such point.
        trace: (T, n) the swarm's best configuration of every iteration [rad or m].
        title: above the axes.
        ax: to draw in; a new figure unless given.

    Raises:
        ProblemError: a start that is not one configuration, a goal that is not a point.
        RobotError: configurations that are not the robot's.
    """
    from matplotlib.patches import Circle, Polygon

    drawing = make_drawing(trajectory, robot, start, goal, trace)
    low, high = extent(drawing, scene, 2)
    with look():
        ax = _axes_to_scale(high - low) if ax is None else ax
        for obstacle in scene.obstacles:
            at = (float(obstacle.center[0]), float(obstacle.center[1]))
            ax.add_patch(Circle(at, obstacle.radius, facecolor=SKY, alpha=OBSTACLE_ALPHA, linewidth=0))
            ax.add_patch(Circle(at, obstacle.radius, fill=False, edgecolor=BLUE, linewidth=0.6))
        for pose in drawing.poses:
            for outline in outlines(robot, pose.q):
                ax.add_patch(Polygon(outline, facecolor=pose.color, alpha=0.2, linewidth=0, zorder=2.5))
        draw_lines(ax, drawing, 2)
        tidy(ax)
        ax.set_xlim(low[0], high[0])
        ax.set_ylim(low[1], high[1])
        ax.set_aspect("equal")
        ax.set_xlabel("x [m]")
        ax.set_ylabel("y [m]")
        ax.set_title(title, loc="left")
        legend_below(ax, 2, handles=legend_handles(drawing, scene))
        return figure_of(ax)


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
            figure = new_figure(COLUMN, 3.3, layout=None)
            ax = figure.add_axes((0.0, 0.15, 0.95, 0.85), projection="3d", computed_zorder=False)
        _box(ax, low, high, view)
        _shadow(ax, drawing, scene, float(low[2]))
        for obstacle in scene.obstacles:
            _sphere(ax, obstacle.center, obstacle.radius)
        draw_lines(ax, drawing, 3)
        ax.text2D(0.02, 0.96, title, transform=ax.transAxes, fontsize=8)
        handles = legend_handles(drawing, scene)
        if own:
            figure_of(ax).legend(handles=handles, loc="lower center", ncols=2)
        else:
            ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2)
        return figure_of(ax)


def _axes_to_scale(size: Array) -> Axes:
    """Return axes in a figure of a column's width, as large as the picture's (2,) size [m] allows."""
    left, right, bottom, top = 0.48, 0.1, 0.95, 0.22  # [inch], for labels, legend and title
    most = np.array([COLUMN - left - right, 3.4])
    width, height = size * float((most / size).min())
    width, height = max(width, 1.0), max(height, 1.0)
    figure = new_figure(COLUMN, bottom + height + top, layout=None)
    room = left + (COLUMN - left - right - width) / 2
    full = bottom + height + top
    return figure.add_axes((room / COLUMN, bottom / full, width / COLUMN, height / full))


def _box(ax: Any, low: Array, high: Array, view: tuple[float, float]) -> None:
    from matplotlib.ticker import MultipleLocator

    for name, a, b in zip("xyz", low, high, strict=True):
        getattr(ax, f"set_{name}lim")(a, b)
        getattr(ax, f"set_{name}label")(f"{name} [m]", labelpad=-4)
        axis = getattr(ax, f"{name}axis")
        axis.set_major_locator(MultipleLocator(_tick_step(float((high - low).max()))))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.pane.set_edgecolor(LIGHT)
        axis.line.set_linewidth(0.6)
        axis._axinfo["grid"].update(color=LIGHT, linewidth=0.4)
        axis._axinfo["tick"].update(inward_factor=0.0, outward_factor=0.15)
    ax.tick_params(labelsize=6.5, pad=-2)
    ax.set_box_aspect(high - low, zoom=1.2)
    ax.view_init(elev=view[0], azim=view[1])


def _tick_step(span: float) -> float:
    """Return a round step that gives about four ticks on the longest axis."""
    power = 10.0 ** np.floor(np.log10(span / 4))
    return float(power * min((1.0, 2.0, 2.5, 5.0, 10.0), key=lambda m: abs(m * power - span / 4)))


def _sphere(ax: Any, center: Array, radius: float) -> None:
    from matplotlib.colors import LightSource

    v, u = np.meshgrid(np.linspace(0, np.pi, 19), np.linspace(0, 2 * np.pi, 37))  # in this order normals point outwards
    unit = np.array([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
    x, y, z = np.asarray(center)[:, None, None] + radius * unit
    light = LightSource(azdeg=-100, altdeg=50)
    ax.plot_surface(x, y, z, color=SKY, alpha=OBSTACLE_ALPHA, linewidth=0, lightsource=light, zorder=2, rstride=1, cstride=1)


def _shadow(ax: Any, drawing: PathDrawing, scene: Scene, floor: float) -> None:
    """Draw obstacles, path and last pose on the floor, grey: so the eye can tell heights."""
    turn = np.linspace(0, 2 * np.pi, 49)
    for obstacle in scene.obstacles:
        x, y = (obstacle.center[i] + obstacle.radius * f(turn) for i, f in enumerate((np.cos, np.sin)))
        ax.plot(x, y, floor, color=GREY, alpha=0.5, linewidth=0.5, zorder=1)
    for segment in drawing.poses[-1].segments:
        ax.plot(*segment.T[:2], floor, color=LIGHT, linewidth=1.4, zorder=1)
    for end in drawing.ends:
        ax.plot(end[[0, 0]], end[[1, 1]], [floor, end[2]], color=GREY, linewidth=0.6, linestyle=(0, (1, 2)), zorder=1.2)
    if drawing.path is not None:
        ax.plot(*drawing.path.T[:2], floor, color=GREY, alpha=0.6, linewidth=0.8, zorder=1.1)
