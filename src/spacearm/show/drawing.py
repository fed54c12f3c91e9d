"""What a picture of a path consists of, the same in the plane and in space: obstacles, the arm, lines, and their legend."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_readonly
from spacearm.core.errors import ProblemError
from spacearm.geometry import (
    Box,
    ConvexShape,
    HalfSpace,
    Polytope,
    Scene,
    moved_shape,
)
from spacearm.motion import AnyTrajectory
from spacearm.motion.trajectory import base_frames
from spacearm.robot import LinkShape, Robot, forward_kinematics, joint_frames
from spacearm.robot.kinematics import as_configurations
from spacearm.robot.link_shapes import as_capsule
from spacearm.show.figure_style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION
from spacearm.show.outlines import cut_off, middle, shape_faces, silhouette, span

Array = NDArray[np.float64]


_COINCIDENT = 1e-9  # [m] shorter segments are left out: the three origins of a spherical joint are one centre
RED = "#D00000"  # the paper's; told from the target's green by size and fill too
OBSTACLE_ALPHA = 0.4
LEGEND_ROW = 0.15  # height of a row of the legend [inch]
_ENVELOPE_ALPHA = 0.2
_BETWEEN = 5  # poses between start and end
_OFTEN = 401
_NEAR = 0.3  # of the picture: half-spaces farther away are not in it
_AROUND, _WHOLE = 0.2, 1.7  # of the picture: how much of the base is drawn around the rest, and with how much all of it is
_BASE = "#F3F3F1", "#E3E2DE"  # of the base's envelope at the start and at the end
_PALE = np.array([0.80, 0.80, 0.80]), np.array([0.55, 0.55, 0.55])  # of the first and the last of them
_PATH: dict[str, Any] = {"color": BLUE, "linewidth": 1.8}
_BASE_PATH: dict[str, Any] = {"color": VERMILION, "linewidth": 1.2}
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


def skeleton(robot: Robot, q: ArrayLike, T_w_b: ArrayLike | None = None) -> Array:
    """Return the segments from joint centre to joint centre, and to the tip.

    Args:
        robot: the robot.
        q: (n,) one configuration [rad or m].
        T_w_b: (4, 4) where the base is [m]; None: at the origin.

    Returns:
        (s, 2, 3) their ends, inertial frame [m]; those without length are left out.
    """
    at = joint_frames(robot, q)[:, :3, 3]
    base = np.zeros(3)
    pairs = [(base if joint.parent < 0 else at[joint.parent], at[i]) for i, joint in enumerate(robot.joints)]
    tip = robot.frame(robot.tip)
    pairs.append((base if tip.joint < 0 else at[tip.joint], forward_kinematics(robot, q)[:3, 3]))
    segments = np.array(pairs)
    segments = segments[np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) > _COINCIDENT]
    return _moved(segments, T_w_b)


def envelope(robot: Robot, q: ArrayLike, T_w_b: ArrayLike | None = None) -> tuple[ConvexShape, ...]:
    """Return the shapes of the links, and of the payload, where they are in one configuration; lines and points are left out.

    Args:
        robot, q, T_w_b: as for `skeleton`.
    """
    frames = _moved_frames(joint_frames(robot, q), T_w_b)
    return tuple(moved_shape(part.shape, frames[part.joint]) for part in robot.shapes if part.joint >= 0 and _is_thick(part))


def base_envelope(robot: Robot, T_w_b: ArrayLike | None = None) -> tuple[ConvexShape, ...]:
    """Return the shapes of the base, where the base is; lines and points are left out."""
    T = np.eye(4) if T_w_b is None else np.asarray(T_w_b, dtype=np.float64)
    return tuple(moved_shape(part.shape, T) for part in robot.shapes if part.joint < 0 and _is_thick(part))


def _is_thick(part: LinkShape) -> bool:
    """Whether a shape is more than a line or a point, as the paper's links are."""
    capsule = as_capsule(part)
    return capsule is None or capsule.radius > 0


def tips(robot: Robot, q: ArrayLike) -> Array:
    """Return where the end effector is, (..., 3) [m], for configurations (..., n) [rad or m] and the base at the origin."""
    return forward_kinematics(robot, q)[..., :3, 3]


def _moved(points: Array, T_w_b: ArrayLike | None) -> Array:
    if T_w_b is None:
        return points
    T = np.asarray(T_w_b, dtype=np.float64)
    return np.asarray(points @ T[:3, :3].T + T[:3, 3], dtype=np.float64)


def _moved_frames(frames: Array, T_w_b: ArrayLike | None) -> Array:
    return frames if T_w_b is None else np.asarray(T_w_b, dtype=np.float64) @ frames


def pose_times(trajectory: AnyTrajectory, count: int) -> Array:
    """Return times (count,) [s] between start and end at which the end effector is equally far along its path."""
    t = np.linspace(0.0, trajectory.duration, 513)
    steps = np.linalg.norm(np.diff(trajectory.tip(t)[:, :3, 3], axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    shares = np.arange(1, count + 1) / (count + 1)
    return np.interp(shares * gone[-1], gone, t) if gone[-1] > 0 else shares * trajectory.duration


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """The arm in one configuration: segments (s, 2, 3) [m], the envelope about them, the base's, and how it is drawn."""

    segments: Array
    envelope: tuple[ConvexShape, ...]
    base: tuple[ConvexShape, ...]
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
        bases: (m, 3) where the base's origin is, likewise: one place for a fixed one.
    """

    poses: tuple[Pose, ...]
    path: Array | None
    trace: Array | None
    ends: Array
    goal: Array | None
    bases: Array

    def points(self) -> Array:
        """Return all points, (p, 3), that have to be in the picture: all but the base's envelope."""
        parts = [self.ends, *(pose.segments.reshape(-1, 3) for pose in self.poses)]
        parts += [np.array(span(body)) for pose in self.poses for body in pose.envelope]
        parts += [part for part in (self.path, self.trace) if part is not None]
        return np.concatenate([*parts, self.bases, *([] if self.goal is None else [self.goal[None]])])


def make_drawing(
    trajectory: AnyTrajectory | None, robot: Robot, start: ArrayLike, goal: ArrayLike | None, trace: ArrayLike | None
) -> PathDrawing:
    """Collect what is drawn; the arguments are those of the figures."""
    q = as_configurations(robot, start)
    if q.shape != (robot.dof,):
        raise ProblemError(f"start has shape {q.shape}, expected one configuration ({robot.dof},)")
    best = None if trace is None else as_configurations(robot, trace).reshape(-1, robot.dof)
    target = None if goal is None else as_readonly("the goal", goal, (3,), ProblemError)
    configurations, frames = [q], np.eye(4)[None]
    path = None
    if trajectory is not None:
        times = np.concatenate([[0.0], pose_times(trajectory, _BETWEEN), [trajectory.duration]])
        configurations, frames = list(trajectory.sample(times).q), base_frames(trajectory, times)
        often = np.linspace(0.0, trajectory.duration, _OFTEN)
        path, bases = trajectory.tip(often)[:, :3, 3], trajectory.base_pose(often)[0]
    else:
        bases = frames[:, :3, 3]
        if best is not None and len(best):
            configurations.append(best[-1])
            frames = np.repeat(frames, 2, axis=0)
    ends = [frames[i] @ forward_kinematics(robot, configurations[i]) for i in range(0, len(frames), max(1, len(frames) - 1))]
    return PathDrawing(
        poses=tuple(_poses(robot, configurations, frames)),
        path=path,
        trace=None if best is None or not len(best) else _each_once(_moved_tips(robot, best, frames[0])),
        ends=np.array(ends)[:, :3, 3],
        goal=target,
        bases=bases if np.ptp(bases, axis=0).any() else bases[:1],
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
    if len(drawing.bases) > 1:
        ax.plot(*drawing.bases.T[:dims], zorder=5.5, **_BASE_PATH)
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


def draw_bases(ax: Any, drawing: PathDrawing, across: Array, up: Array, low: Array, high: Array) -> None:
    """Fill the outline of the base's envelope at the start and at the end.

    Call it before what may be in front of the base: it hides what is behind.

    Args:
        ax: axes of as many dimensions as the bounds.
        drawing: with the base.
        across, up: (3,) unit vectors, the picture is seen at right angles to them.
        low, high: (dims,) the picture's bounds; in space the base is cut there, as axes do it in the plane [m].
    """
    from matplotlib.collections import PolyCollection
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    eye, dims = np.cross(across, up), len(low)
    for pose in drawing.poses:
        parts = pose.base if dims == 2 else [part for body in pose.base for part in cut_off(body, low, high)]
        bodies = sorted(parts, key=lambda body: float(middle(body) @ eye))
        outlines = [silhouette(body, across, up) for body in bodies]
        if not outlines:
            continue
        last = pose is drawing.poses[-1]
        face = _BASE[int(last)]
        # All edges first and then all fillings: what is left of the edges is the outline of them all.
        for style in ({"facecolor": "none", "edgecolor": pose.color, "linewidth": 1.2}, {"facecolor": face, "linewidth": 0.0}):
            if dims == 2:
                ax.add_collection(PolyCollection([rim[:, :2] for rim in outlines], zorder=0.9, **style), autolim=False)
            else:
                ax.add_collection3d(Poly3DCollection(outlines, zorder=2, **style), autolim=False)
        if dims == 3 and last:
            style = {"facecolor": face, "edgecolor": "#B4B4B4", "linewidth": 0.25}
            parts = [part for body in bodies for part in (silhouette(body, across, up), *_seen_faces(body, eye))]
            ax.add_collection3d(Poly3DCollection(parts, zorder=2, sort_zpos=None, **style), autolim=False)


def _seen_faces(body: ConvexShape, eye: Array) -> list[Array]:
    """Return the flat faces of a box or a polytope that are turned towards the eye."""
    if not isinstance(body, (Box, Polytope)) or body.rounding:
        return []
    return [face for face in shape_faces(body) if np.cross(face[1] - face[0], face[2] - face[1]) @ eye > 0]


def extent(drawing: PathDrawing, scene: Scene, dims: int, *, pad: float = 0.06) -> tuple[Array, Array]:
    """Return the least and the greatest coordinates of the picture, (dims,) each [m].

    Half-spaces are in it only if they are near, and of the base what is near the arm: panels may be much longer.
    """
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
    bodies = [span(body) for pose in drawing.poses for body in pose.base]
    if bodies:
        size = float((high - low).max())
        least, greatest = np.min([s[0] for s in bodies], axis=0), np.max([s[1] for s in bodies], axis=0)
        whole = float((np.maximum(high, greatest) - np.minimum(low, least)).max()) <= _WHOLE * size
        around = np.inf if whole else _AROUND * size
        low = np.minimum(low, np.maximum(least, low - around))
        high = np.maximum(high, np.minimum(greatest, high + around))
    low, high = low[:dims], high[:dims]
    margin = pad * max(float((high - low).max()), 1e-3)
    return low - margin, high + margin


def base_is_cut(drawing: PathDrawing, low: Array, high: Array) -> bool:
    """Tell whether some of the base is outside of the picture, whose bounds are (dims,) each [m]."""
    spans = [span(body) for pose in drawing.poses for body in pose.base]
    return any((least[: len(low)] < low).any() or (greatest[: len(low)] > high).any() for least, greatest in spans)


def legend_handles(drawing: PathDrawing, scene: Scene, low: Array, high: Array) -> list[Any]:
    """Return the legend's entries, only of what is there; in the plane, a link over a circle may be above or below it.

    Args:
        drawing, scene: what is drawn.
        low, high: (dims,) the picture's bounds [m].
    """
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
        text = "obstacle, seen along z" if len(low) == 2 else "obstacle"
        handles.append(Patch(facecolor=SKY, edgecolor=BLUE, alpha=OBSTACLE_ALPHA, linewidth=0.6, label=text))
    text = "arm, grey at the start" if len(drawing.poses) > 1 else "arm"
    handles.append(Line2D([], [], color=BLACK, linewidth=1.8, marker="o", markersize=3, label=text))
    if any(pose.envelope for pose in drawing.poses):
        handles.append(Patch(facecolor=BLACK, alpha=_ENVELOPE_ALPHA, linewidth=0, label="its envelope"))
    if any(pose.base for pose in drawing.poses):
        moves = len(drawing.poses) > 1 and drawing.poses[:1][0].base
        text = ("base (cut off)" if base_is_cut(drawing, low, high) else "base") + (", pale at start" if moves else "")
        handles.append(Patch(facecolor=_BASE[1], edgecolor=BLACK, linewidth=0.6, label=text))
    if len(drawing.bases) > 1:
        handles.append(Line2D([], [], label="path of the base origin", **_BASE_PATH))
    return handles


def _poses(robot: Robot, configurations: list[Array], frames: Array) -> Iterator[Pose]:
    last = len(configurations) - 1
    moves = bool(np.ptp(frames, axis=0).any())
    for i, (q, T) in enumerate(zip(configurations, frames, strict=True)):
        if i == last:
            color, width = BLACK, 1.8
        elif i == 0:
            color, width = GREY, 1.8
        else:
            share = (i - 1) / max(1, last - 2)
            color, width = tuple((1 - share) * _PALE[0] + share * _PALE[1]), 0.9
        base = base_envelope(robot, T) if i == last or (moves and i == 0) else ()
        yield Pose(segments=skeleton(robot, q, T), envelope=envelope(robot, q, T), base=base, color=color, width=width)


def _moved_tips(robot: Robot, q: Array, T: Array) -> Array:
    return tips(robot, q) @ T[:3, :3].T + T[:3, 3]


def _each_once(points: Array) -> Array:
    """Leave out points that are where the one before is."""
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6
    return points[np.concatenate([[True], moved])]
