"""What a picture of a path consists of, the same in the plane and in space: poses, lines, circles and their legend."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import as_readonly
from spacearm.errors import ProblemError
from spacearm.motion import Trajectory
from spacearm.robot import Robot
from spacearm.robot.kinematics import as_configurations
from spacearm.scene import Capsule, HalfSpace, Scene, Sphere
from spacearm.show.arm import envelope, pose_times, skeleton, tips
from spacearm.show.shapes import silhouette, span
from spacearm.show.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY

Array = NDArray[np.float64]

RED = "#D00000"  # the paper's; told from the target's green by size and fill too
OBSTACLE_ALPHA = 0.4
_ENVELOPE_ALPHA = 0.2
_BETWEEN = 5  # poses between start and end
_NEAR = 0.3  # of the picture: half-spaces farther away are not in it
_PALE = np.array([0.80, 0.80, 0.80]), np.array([0.55, 0.55, 0.55])  # of the first and the last of them


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """The arm in one configuration: segments (s, 2, 3) [m], the envelope about them, and how it is drawn."""

    segments: Array
    envelope: tuple[Sphere | Capsule, ...]
    color: Any
    width: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathDrawing:
    """What is drawn, in 3-D [m].

    Attributes:
        poses: of the arm, the first below the others.
        path: (m, 3) planned path of the end effector; None without a trajectory.
        trace: (k, 3) end effector of the swarm's best, each place once; None without one.
        ends: (1 or 2, 3) end effector at the start, and at the end of what there is.
        goal: (3,) the target, or None.
    """

    poses: tuple[Pose, ...]
    path: Array | None
    trace: Array | None
    ends: Array
    goal: Array | None

    def points(self) -> Array:
        """Return all points, (p, 3), that have to be in the picture."""
        parts = [self.ends, *(pose.segments.reshape(-1, 3) for pose in self.poses)]
        parts += [np.array(span(body)) for pose in self.poses for body in pose.envelope]
        parts += [part for part in (self.path, self.trace) if part is not None]
        return np.concatenate([*parts, np.zeros((1, 3)), *([] if self.goal is None else [self.goal[None]])])


def make_drawing(
    trajectory: Trajectory | None, robot: Robot, start: ArrayLike, goal: ArrayLike | None, trace: ArrayLike | None
) -> PathDrawing:
    """Collect what is drawn; the arguments are those of the figures."""
    q = as_configurations(robot, start)
    if q.shape != (robot.dof,):
        raise ProblemError(f"start has shape {q.shape}, expected one configuration ({robot.dof},)")
    best = None if trace is None else as_configurations(robot, trace).reshape(-1, robot.dof)
    target = None if goal is None else as_readonly("the goal", goal, (3,), ProblemError)
    configurations = [q]
    if trajectory is not None:
        times = np.concatenate([[0.0], pose_times(trajectory, _BETWEEN), [trajectory.duration]])
        configurations = list(trajectory.sample(times).q)
    elif best is not None and len(best):
        configurations.append(best[-1])
    ends = tips(robot, np.array([configurations[0], configurations[-1]][: len(configurations)]))
    path = None
    if trajectory is not None:
        path = tips(robot, trajectory.sample(np.linspace(0.0, trajectory.duration, 401)).q)
    return PathDrawing(
        poses=tuple(_poses(robot, configurations)),
        path=path,
        trace=None if best is None or not len(best) else _each_once(tips(robot, best)),
        ends=ends,
        goal=target,
    )


def draw_lines(ax: Any, drawing: PathDrawing, dims: int) -> None:
    """Draw all but the obstacles into axes of two or three dimensions."""
    for layer, pose in enumerate(drawing.poses):
        order = 3 + 0.01 * layer
        for segment in pose.segments:
            ax.plot(*segment.T[:dims], color=pose.color, linewidth=pose.width, zorder=order)
        dots = np.unique(np.round(pose.segments.reshape(-1, 3), 9), axis=0)
        ax.plot(*dots.T[:dims], "o", color=pose.color, markersize=1.3 * pose.width + 0.7, markeredgewidth=0, zorder=order)
    if drawing.trace is not None:
        ax.plot(*drawing.trace.T[:dims], zorder=6.5, **_TRACE)
    if drawing.path is not None:
        ax.plot(*drawing.path.T[:dims], zorder=5, **_PATH)
    if drawing.goal is not None:
        ax.plot(*drawing.goal[:dims, None], zorder=6, **_TARGET)
    ax.plot(*drawing.ends.T[:dims], zorder=7, **_ENDS)


def draw_envelopes(ax: Any, drawing: PathDrawing, across: Array, up: Array, dims: int) -> None:
    """Fill the outlines of the arm's envelope, of each pose as one, as seen at right angles to two unit vectors (3,)."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path
    from mpl_toolkits.mplot3d.art3d import PathPatch3D

    for pose in drawing.poses:
        outlines = [silhouette(body, across, up) for body in pose.envelope]
        if not outlines:
            continue
        rims = [np.vstack([outline, outline[:1]]) for outline in outlines]
        # One path: where outlines overlap, it is filled once.
        path = Path.make_compound_path(*(Path(rim[:, :2], closed=True) for rim in rims))
        style: dict[str, Any] = {"facecolor": pose.color, "alpha": _ENVELOPE_ALPHA, "linewidth": 0, "zorder": 2.5}
        if dims == 2:
            ax.add_patch(PathPatch(path, **style))
        else:
            ax.add_artist(PathPatch3D(path, zs=np.concatenate(rims)[:, 2], **style))


def extent(drawing: PathDrawing, scene: Scene, dims: int, *, pad: float = 0.06) -> tuple[Array, Array]:
    """Return the least and the greatest coordinates of the picture, (dims,) each [m]: half-spaces only if they are near."""
    points = drawing.points()
    low, high = points.min(axis=0), points.max(axis=0)
    for obstacle in scene.obstacles:
        if not isinstance(obstacle, HalfSpace):
            least, greatest = span(obstacle)
            low, high = np.minimum(low, least), np.maximum(high, greatest)
    for half_space in [obstacle for obstacle in scene.obstacles if isinstance(obstacle, HalfSpace)]:
        corner = np.where(half_space.normal > 0, low, high)  # the box's nearest to it
        height = float((corner - half_space.point) @ half_space.normal)
        if 0 < height < _NEAR * float((high - low).max()):
            foot = corner - height * half_space.normal
            low, high = np.minimum(low, foot), np.maximum(high, foot)
    low, high = low[:dims], high[:dims]
    margin = pad * max(float((high - low).max()), 1e-3)
    return low - margin, high + margin


def legend_handles(drawing: PathDrawing, scene: Scene, dims: int) -> list[Any]:
    """Return the legend's entries, only of what is there; in the plane, a link over a circle may be above or below it."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    planned = drawing.path is not None
    handles: list[Any] = []
    if planned:
        handles.append(Line2D([], [], label="planned path", **_PATH))
    if drawing.trace is not None:
        handles.append(Line2D([], [], label="swarm's best, by iteration", **_TRACE))
    handles.append(Line2D([], [], label="start and end", **_ENDS))
    if drawing.goal is not None:
        handles.append(Line2D([], [], label="target", **_TARGET))
    if scene.obstacles:
        text = "obstacle, seen along z" if dims == 2 else "obstacle"
        handles.append(Patch(facecolor=SKY, edgecolor=BLUE, alpha=OBSTACLE_ALPHA, linewidth=0.6, label=text))
    text = "arm, grey at the start" if len(drawing.poses) > 1 else "arm"
    handles.append(Line2D([], [], color=BLACK, linewidth=1.8, marker="o", markersize=3, label=text))
    if any(pose.envelope for pose in drawing.poses):
        handles.append(Patch(facecolor=BLACK, alpha=_ENVELOPE_ALPHA, linewidth=0, label="its envelope"))
    return handles


_PATH: dict[str, Any] = {"color": BLUE, "linewidth": 1.8}
_TRACE: dict[str, Any] = {
    "color": ORANGE,
    "linewidth": 0.7,
    "linestyle": (0, (3, 2)),
    "marker": ".",
    "markersize": 3,
    "markeredgewidth": 0,
}
_ENDS: dict[str, Any] = {"color": RED, "marker": "o", "markersize": 5, "markeredgewidth": 0, "linestyle": ""}
_TARGET: dict[str, Any] = {
    "color": GREEN,
    "marker": "o",
    "markersize": 9,
    "markerfacecolor": "none",
    "markeredgewidth": 1.8,
    "linestyle": "",
}


def _poses(robot: Robot, configurations: list[Array]) -> Iterator[Pose]:
    last = len(configurations) - 1
    for i, q in enumerate(configurations):
        if i == last:
            color, width = BLACK, 1.8
        elif i == 0:
            color, width = GREY, 1.8
        else:
            share = (i - 1) / max(1, last - 2)
            color, width = tuple((1 - share) * _PALE[0] + share * _PALE[1]), 0.9
        yield Pose(segments=skeleton(robot, q), envelope=envelope(robot, q), color=color, width=width)


def _each_once(points: Array) -> Array:
    """Leave out points that are where the one before is."""
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6
    return points[np.concatenate([[True], moved])]
