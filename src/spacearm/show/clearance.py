"""Clearance over time, and the bound that the certificate proves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import Trajectory
from spacearm.planner.clearance import clearances, self_clearances
from spacearm.proof import Certificate
from spacearm.robot import Robot
from spacearm.scene import Scene
from spacearm.scene.moved import moved_scene
from spacearm.show.arm import base_frames
from spacearm.show.style import (
    BLACK,
    COLUMN,
    CYCLE,
    GREY,
    figure_of,
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

_SAMPLES, _SAMPLES_FLOATING = 801, 401


def figure_clearance(
    trajectory: Trajectory,
    scene: Scene,
    certificate: Certificate | None = None,
    *,
    title: str = "",
    ax: Axes | None = None,
) -> Figure:
    """Draw the clearance of the whole arm to each obstacle and to itself over time, and the proven lower bound.

    Args:
        trajectory: of the robot.
        scene: the obstacles; the nearest ones have a colour, beyond seven the others are grey.
        certificate: of the trajectory in the scene; without one no bound is drawn.
        title: above the axes.
        ax: to draw in; a new figure unless given.
    """
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


def _clearances(trajectory: Trajectory, scene: Scene, t: Array) -> tuple[Array, list[str]]:
    """Return the least clearances (times, curves) [m] and what each is of: the obstacles, and the robot's own links."""
    arm, q = _Arm(trajectory.robot, scene), trajectory.sample(t).q
    values, names = np.empty((len(t), 0)), []
    if arm.robot.capsules and scene.obstacles:
        values = _to_obstacles(trajectory, scene, t, q)
        names = [obstacle.name or f"obstacle {i}" for i, obstacle in enumerate(scene.obstacles)]
    if arm.robot.self_pairs:
        values = np.column_stack([values, self_clearances(arm, q).min(axis=1)])
        names.append("between links")
    return values, names


def _to_obstacles(trajectory: Trajectory, scene: Scene, t: Array, q: Array) -> Array:
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


_SAYS = {"fails": "fails", "undecided": "is undecided", "holds": "bounds no clearance"}


def _length(value: float) -> str:
    """Print a length in the unit that suits it."""
    for factor, unit in ((1.0, "m"), (1e3, "mm")):
        if abs(value) * factor >= 0.1:
            return f"{value * factor:.3g} {unit}"
    return f"{value * 1e6:.3g} µm"
