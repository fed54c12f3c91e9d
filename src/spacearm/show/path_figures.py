"""The path of the end effector, and the arm on its way, in the plane and in space (the paper's Figs. 6 and 9).

As in the paper, obstacles are blue and transparent, the end effector's start and end are red circles, the target is a green
one, and the planned path is a blue line. In space each obstacle is the outline seen from the eye and what lies inside it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.errors import ProblemError
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Polytope, PolytopeSet, Scene, Sphere, SphereSet
from spacearm.robot import Robot
from spacearm.show.drawing import (
    LEGEND_ROW,
    OBSTACLE_ALPHA,
    PathDrawing,
    draw_bases,
    draw_envelopes,
    draw_lines,
    extent,
    legend_handles,
    make_drawing,
)
from spacearm.show.figure_style import BLUE, COLUMN, GREY, LIGHT, SKY, figure_of, legend_below, look, new_figure, tidy
from spacearm.show.motion_shown import motion_shown, target_of
from spacearm.show.outlines import common_outline, cut, cut_in_plane, cylinder_ends, middle, shape_faces, silhouette

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


Array = NDArray[np.float64]

_FILL = OBSTACLE_ALPHA + 0.1
_LIGHT = np.array([0.25, -0.45, 0.86])  # from where the light comes, for the faces' brightness


def draw_obstacles(ax: Any, scene: Scene, low: Array, high: Array, view: tuple[float, float]) -> None:
    """Draw every obstacle into three-dimensional axes.

    Args:
        ax: the axes.
        scene: the obstacles.
        low, high: (3,) the picture's bounds, to which half-spaces are cut [m].
        view: elevation and azimuth of the eye [deg].
    """
    across, up = across_and_up(view)
    eye = np.cross(across, up)
    pen = _Pen(ax, eye, across, up)
    for obstacle in scene.obstacles:
        if isinstance(obstacle, HalfSpace):
            pen.plane(cut(obstacle, low, high))
    for obstacle in sorted(scene.obstacles, key=lambda item: float(middle(item) @ eye)):
        pen.solid(obstacle)


def parted(scene: Scene, point: Array, view: tuple[float, float]) -> tuple[Scene, Scene]:
    """Return the obstacles behind a point (3,) [m] and those before it, as the eye sees them; half-spaces are behind."""
    eye = np.cross(*across_and_up(view))
    before = [
        not isinstance(obstacle, HalfSpace) and float((middle(obstacle) - point) @ eye) > 0 for obstacle in scene.obstacles
    ]
    pairs = list(zip(scene.obstacles, before, strict=True))
    return Scene([o for o, near in pairs if not near]), Scene([o for o, near in pairs if near])


def across_and_up(view: tuple[float, float]) -> tuple[Array, Array]:
    """Return the picture's axes, (3,) each: unit vectors to the right and up, for the eye's elevation and azimuth [deg]."""
    elevation, azimuth = np.radians(view)
    across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    eye = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    return across, np.asarray(np.cross(eye, across), dtype=np.float64)


class _Pen:
    """Draws as seen from one eye; `across` and `up` are the picture's axes."""

    def __init__(self, ax: Any, eye: Array, across: Array, up: Array) -> None:
        self.ax, self.eye, self.across, self.up = ax, eye, across, up
        turn = np.linspace(0, 2 * np.pi, 73)[:-1, None]
        self.disc = np.cos(turn) * across + np.sin(turn) * up  # (72, 3)

    def plane(self, corners: Array) -> None:
        if len(corners):
            self._fill([corners], SKY, 0.13)
            self._line(corners, BLUE, 0.5)

    def solid(self, obstacle: Obstacle) -> None:
        if isinstance(obstacle, HalfSpace):
            return
        if isinstance(obstacle, SphereSet):
            self._balls(obstacle)
            return
        if isinstance(obstacle, PolytopeSet):
            for piece in sorted(obstacle.pieces, key=lambda item: float(middle(item) @ self.eye)):
                self.solid(piece)
            return
        outline = silhouette(obstacle, self.across, self.up)
        self._fill([outline], SKY, _FILL)
        if isinstance(obstacle, (Box, Polytope)):
            self._faces(shape_faces(obstacle))
        elif isinstance(obstacle, Cylinder):
            self._cylinder(obstacle)
        else:
            self._sheen(obstacle)
        self._line(outline, BLUE, 0.6)

    def _faces(self, faces: list[Array]) -> None:
        """Brighten the faces that are seen, each by how it lies to the light, and draw their edges."""
        for face in faces:
            normal = np.cross(face[1] - face[0], face[2] - face[1])
            normal /= np.linalg.norm(normal)
            if normal @ self.eye > 1e-6:
                self._fill([face], "white", 0.45 * max(0.0, float(normal @ _LIGHT)))
                self._line(face, BLUE, 0.4)

    def _cylinder(self, cylinder: Cylinder) -> None:
        """A band of light along the side, and the end that is seen."""
        axis = cylinder.pose[:3, 2]
        ends = cylinder_ends(cylinder)
        side = np.cross(axis, self.eye)
        if np.linalg.norm(side) > 1e-3:
            side /= np.linalg.norm(side)
            half = axis * cylinder.length / 2
            for share in np.linspace(0.8, 0.1, 12):
                a, b = (cylinder.radius * side * (sign * share + 0.35 * (1 - share)) for sign in (-1, 1))
                band = np.array([a - half, b - half, b + half, a + half]) + cylinder.pose[:3, 3]
                self._fill([band], "white", 0.035)
        seen = ends[1] if axis @ self.eye > 0 else ends[0]
        self._fill([seen], "white", 0.35)
        self._line(seen, BLUE, 0.4)

    def _sheen(self, body: Sphere | Capsule) -> None:
        ends = [body.center] if isinstance(body, Sphere) else [body.a, body.b]
        for share in np.linspace(0.8, 0.1, 15):
            shift = (1 - share) * 0.45 * body.radius * (self.up - self.across)
            lit = [Sphere(end + shift, share * body.radius) for end in ends]
            shape = lit[0] if len(lit) == 1 else Capsule(lit[0].center, lit[1].center, share * body.radius)
            self._fill([silhouette(shape, self.across, self.up)], "white", 0.045)

    def _balls(self, balls: SphereSet) -> None:
        """Draw balls as bubbles that hide each other; the nearest last."""
        order = np.argsort(balls.centers @ self.eye, kind="stable")
        step = 1 if len(order) < 200 else 3
        rims = balls.centers[order, None] + balls.radii[order, None, None] * self.disc[::step]
        width = 0.4 if len(order) < 60 else 0.25 if len(order) < 400 else 0.12
        self._fill(list(rims), "#BBDFF7", 1.0, edgecolor=BLUE, linewidth=width)

    def _fill(self, polygons: list[Array], color: str, alpha: float, **style: Any) -> None:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        style = {"linewidth": 0, **style}
        self.ax.add_collection3d(Poly3DCollection(polygons, facecolor=color, alpha=alpha, zorder=2, **style))

    def _line(self, outline: Array, color: str, width: float) -> None:
        self.ax.plot(*np.vstack([outline, outline[:1]]).T, color=color, linewidth=width, zorder=2)


def figure_path_2d(
    result: Any,
    ax: Axes | None = None,
    *,
    robot: Robot | None = None,
    scene: Scene | None = None,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    trace: ArrayLike | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the path in the plane z = 0: obstacles become their outlines, links segments (the paper's section 2.1).

    Of a half-space the part in the plane z = 0 is drawn, and nothing if its boundary is level.

    Args:
        result: a plan, a saved plan or a trajectory; None where there is no motion: the arm is then drawn at the start and at
            the trace's end, and `robot` and `start` must be given.
        ax: to draw in; a new figure unless given.
        robot: that moves; None: the result's.
        scene: what is in the way; None: that of the plan's problem, or nothing.
        start: (n,) configuration at the beginning [rad or m]; None: the motion's.
        goal: (3,) where the end effector is to be [m]; None: the plan's goal.
        trace: (T, n) the swarm's best configuration of every iteration [rad or m].
        title: above the axes; None: the name of a plan's robot.

    Raises:
        ProblemError: a result that is none, a start that is not one configuration, a goal that is not a point.
        RobotError: configurations that are not the robot's.
        SettingsError: matplotlib is not installed.
    """
    drawing, scene, title = _collected(result, robot, scene, start, goal, trace, title)
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


def _collected(
    result: Any,
    robot: Robot | None,
    scene: Scene | None,
    start: ArrayLike | None,
    goal: ArrayLike | None,
    trace: ArrayLike | None,
    title: str | None,
) -> tuple[PathDrawing, Scene, str]:
    """Return what is drawn of a motion, among what, and under which title."""
    if result is None:
        if robot is None or start is None:
            missing = "robot" if robot is None else "start"
            raise ProblemError(f"a path is drawn of no motion and without {missing}, expected both robot and start; give them")
        return make_drawing(None, robot, start, goal, trace), Scene() if scene is None else scene, title or ""
    given = motion_shown(result, what="a figure of the path")
    motion, problem = given.trajectory, given.problem
    assert motion is not None  # `motion_shown` saw to it
    robot = motion.robot if robot is None else robot
    if problem is not None:
        scene = problem.scene if scene is None else scene
        goal = target_of(problem.goal, robot, motion) if goal is None else goal
    begin = motion.sample(0.0).q if start is None else start
    drawing = make_drawing(motion, robot, begin, goal, trace)
    return drawing, Scene() if scene is None else scene, given.title if title is None else title


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
    elif isinstance(obstacle, PolytopeSet):
        outlines = [silhouette(piece, *np.eye(3)[:2])[:, :2] for piece in obstacle.pieces]
        rims = [np.vstack([outline, outline[:1]]) for outline in outlines]
        ax.add_patch(PathPatch(Path.make_compound_path(*(Path(rim, closed=True) for rim in rims)), **fill))
        for outline in outlines:
            ax.add_patch(Polygon(outline, fill=False, **edge))
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


def figure_path_3d(
    result: Any,
    ax: Any = None,
    *,
    robot: Robot | None = None,
    scene: Scene | None = None,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    trace: ArrayLike | None = None,
    title: str | None = None,
    view: tuple[float, float] = (32.0, -58.0),
) -> Figure:
    """Draw the path in space, with equal scales, over its shadow on the floor of the picture.

    Args:
        result, robot, scene, start, goal, trace, title: as for `figure_path_2d`.
        ax: three-dimensional axes to draw in, as `figure.add_subplot(projection="3d")` makes them; a new figure unless given.
        view: elevation and azimuth of the eye [deg].

    Raises:
        ProblemError: a result that is none, a start that is not one configuration, a goal that is not a point.
        RobotError: configurations that are not the robot's.
        SettingsError: matplotlib is not installed.
    """
    drawing, scene, title = _collected(result, robot, scene, start, goal, trace, title)
    low, high = extent(drawing, scene, 3)
    with look():
        own = ax is None
        if own:
            ax = new_figure(COLUMN, COLUMN, layout=None).add_axes((0, 0, 1, 1), projection="3d", computed_zorder=False)
        ax.computed_zorder = False  # the order in which things are drawn is ours
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
            legend_below(ax, 2, offset=12.0, handles=handles)
            ax.set_title(title, loc="left")
        return figure


def _box(ax: Any, low: Array, high: Array, view: tuple[float, float]) -> None:
    """Set limits, equal scales, the viewpoint and light axes."""
    from matplotlib.ticker import MultipleLocator

    step = _tick_step(float((high - low).max()))
    for name, a, b, pad in zip("xyz", low, high, (-5, -2, -4), strict=True):
        getattr(ax, f"set_{name}lim")(a, b)
        getattr(ax, f"set_{name}label")(f"{name} [m]", labelpad=pad, fontsize=7.5)
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
            shapes = obstacle.pieces if isinstance(obstacle, PolytopeSet) else (obstacle,)
            rims = [silhouette(shape, *np.eye(3)[:2])[:, :2] for shape in shapes]
            lifted = np.full((1, 2), np.nan)
            outline = np.concatenate([part for rim in rims for part in (rim, rim[:1], lifted)])
        ax.plot(*outline.T, floor, color=GREY, alpha=0.5, linewidth=0.5, zorder=1)
    for segment in drawing.poses[-1].segments:
        ax.plot(*segment.T[:2], floor, color=LIGHT, linewidth=1.4, zorder=1)
    for end in drawing.ends:
        ax.plot(end[[0, 0]], end[[1, 1]], [floor, end[2]], color=GREY, linewidth=0.6, linestyle=(0, (1, 2)), zorder=1.2)
    if drawing.path is not None:
        ax.plot(*drawing.path.T[:2], floor, color=GREY, alpha=0.6, linewidth=0.8, zorder=1.1)
