"""The path of the end effector and the arm on its way, in the plane (the paper's Figs. 6a and 9a).

As the paper draws them: obstacles are blue and transparent, the end effector's start and end are red circles, the target
is a green one, the planned path is a blue line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.motion import Trajectory
from spacearm.robot import Robot
from spacearm.scene import HalfSpace, Obstacle, Scene, Sphere, SphereSet
from spacearm.show.path_drawing import (
    LEGEND_ROW,
    OBSTACLE_ALPHA,
    draw_bases,
    draw_envelopes,
    draw_lines,
    extent,
    legend_handles,
    make_drawing,
)
from spacearm.show.shapes import common_outline, cut_in_plane, silhouette
from spacearm.show.style import BLUE, COLUMN, SKY, figure_of, legend_below, look, new_figure, tidy

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
    """Draw the path in the plane z = 0: obstacles become their outlines, links segments (the paper's section 2.1).

    Of a half-space the part in the plane z = 0 is drawn, and nothing if its boundary is level.

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
    drawing = make_drawing(trajectory, robot, start, goal, trace)
    low, high = extent(drawing, scene, 2)
    with look():
        handles = legend_handles(drawing, scene, low, high)
        ax = _axes_to_scale(high - low, len(handles)) if ax is None else ax
        for obstacle in scene.obstacles:
            _obstacle(ax, obstacle, low, high)
        draw_bases(ax, drawing, np.eye(3)[0], np.eye(3)[1], low, high)
        draw_envelopes(ax, drawing, *np.eye(3)[:2], dims=2)
        draw_lines(ax, drawing, 2)
        tidy(ax)
        ax.set_xlim(low[0], high[0])
        ax.set_ylim(low[1], high[1])
        ax.set_aspect("equal")
        ax.set_xlabel("x [m]")
        ax.set_ylabel("y [m]")
        ax.set_title(title, loc="left")
        legend_below(ax, 2, handles=handles)
        return figure_of(ax)


def _obstacle(ax: Axes, obstacle: Obstacle, low: Array, high: Array) -> None:
    """Draw an obstacle as it is seen along z."""
    from matplotlib.patches import Circle, PathPatch, Polygon
    from matplotlib.path import Path

    fill: dict[str, Any] = {"facecolor": SKY, "alpha": OBSTACLE_ALPHA, "linewidth": 0}
    edge: dict[str, Any] = {"color": BLUE, "linewidth": 0.6}
    if isinstance(obstacle, Sphere):
        at = (float(obstacle.center[0]), float(obstacle.center[1]))
        ax.add_patch(Circle(at, obstacle.radius, **fill))
        ax.add_patch(Circle(at, obstacle.radius, fill=False, **edge))
    elif isinstance(obstacle, SphereSet):
        discs = list(zip(obstacle.centers[:, :2].tolist(), obstacle.radii.tolist(), strict=True))
        # One path: where discs overlap, it is filled once.
        ax.add_patch(PathPatch(Path.make_compound_path(*(Path.circle(at, radius) for at, radius in discs)), **fill))
        ax.plot(*common_outline(obstacle.centers[:, :2], obstacle.radii).T, zorder=1, **edge)
    else:
        outline = cut_in_plane(obstacle, low, high) if isinstance(obstacle, HalfSpace) else silhouette(obstacle, *np.eye(3)[:2])
        if len(outline):
            ax.add_patch(Polygon(outline[:, :2], **fill))
            ax.add_patch(Polygon(outline[:, :2], fill=False, **edge))


def _axes_to_scale(size: Array, entries: int) -> Axes:
    """Return axes in a figure of a column's width, as large as the picture's (2,) size [m] allows."""
    left, right, bottom, top = 0.6, 0.1, 0.98, 0.22  # [inch], for labels, legend and title
    bottom += LEGEND_ROW * max(0, (entries + 1) // 2 - 4)
    most = np.array([COLUMN - left - right, 3.4])
    width, height = size * float((most / size).min())
    width, height = max(width, 1.0), max(height, 1.0)
    figure = new_figure(COLUMN, bottom + height + top, layout=None)
    room = left + (COLUMN - left - right - width) / 2
    full = bottom + height + top
    return figure.add_axes((room / COLUMN, bottom / full, width / COLUMN, height / full))
