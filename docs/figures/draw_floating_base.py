"""Draw docs/figures/floating_base.png: one goal, planned for a fixed and for a floating base."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import spacearm as sa
from spacearm.core.rotations import matrix_of
from spacearm.show.drawing import base_envelope, envelope, skeleton
from spacearm.show.figure_style import BLACK, BLUE, GREEN, SKY, SMALL, VERMILION, look, new_figure
from spacearm.show.outlines import silhouette

Array = NDArray[np.float64]

GOAL = (0.58, 0.36, 0.39)  # m
START = np.radians([-25, 63, 0, 41, 0, 0, 0])
STRUTS = {"strut A": (0.82, 0.15), "strut B": (0.67, -0.12)}  # x, y; along z
SEED, SETTINGS = 0, sa.PlannerSettings(evaluations=4000)
ACROSS, UP = np.eye(3)[:2]
PALE, DARK = "#B5B5B5", "#555555"
VIEW = (-0.58, 1.0), (-0.62, 0.56)  # m, of x and y


def main(path: str = "docs/figures/floating_base.png") -> None:
    """Plan for a fixed and for a floating base, certify, and draw."""
    robot = sa.load_robot("srs7")
    scene = sa.Scene([sa.Capsule((x, y, -0.6), (x, y, 1.2), 0.04, name=name) for name, (x, y) in STRUTS.items()])
    bolted = sa.Problem(robot, scene, start=START, goal=sa.PositionGoal(GOAL), base="fixed")
    free = sa.Problem(robot, scene, start=START, goal=sa.PositionGoal(GOAL), base="floating")
    first, second = sa.plan(bolted, SETTINGS, rng=SEED), sa.plan(free, SETTINGS, rng=SEED)
    assert first.trajectory is not None
    assert second.trajectory is not None
    adrift = replace(first.trajectory, base="floating")
    hit = sa.certify(free, adrift).closest
    assert hit is not None
    with look():
        figure = new_figure(7.2, 2.75)
        axes = figure.subplots(1, 3, sharey=True)
        draw(axes[0], scene, first.trajectory, "planned for a fixed base", at=hit.time)
        skeleton_of(axes[1], first.trajectory, hit.time, GREEN, linestyle=(0, (1.5, 1.5)), linewidth=1.0)
        draw(axes[1], scene, adrift, "the same motion, floating base", at=hit.time, struck=hit.points)
        draw(axes[2], scene, second.trajectory, "planned for a floating base", at=abreast(second.trajectory))
        axes[0].set_ylabel("y [m]")
        figure.legend(handles=legend(), loc="outside lower center", ncols=7)
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=200, metadata={"Software": None, "Title": "the same goal with the base fixed and floating"})


def abreast(trajectory: sa.Trajectory) -> float:
    """Return when the end effector comes past strut B, as far along y [s]."""
    t = np.linspace(0, trajectory.duration, 401)
    return float(t[np.argmax(trajectory.tip(t)[:, 1, 3] > STRUTS["strut B"][1])])


def draw(ax: Any, scene: sa.Scene, trajectory: sa.Trajectory, title: str, *, at: float, struck: Array | None = None) -> None:
    """Draw a trajectory from above: pale at its start, dark at its end, and coloured at an instant between.

    Args:
        ax: axes.
        scene: upright struts.
        trajectory: its base where it really is.
        title: of the picture.
        at: the instant between [s].
        struck: (2, 3) points that meet at that instant, which is then the end [m].
    """
    end = trajectory.duration if struck is None else at
    base(ax, trajectory, 0.0, face="#F3F3F1", edge=PALE, style="--")
    base(ax, trajectory, end, face="none", edge=DARK if struck is None else VERMILION)
    arm(ax, trajectory, 0.0, PALE)
    arm(ax, trajectory, at, GREEN if struck is None else VERMILION)
    if struck is None:
        arm(ax, trajectory, end, DARK)
    for name, obstacle in zip(STRUTS, scene.obstacles, strict=True):
        outline = silhouette(obstacle, ACROSS, UP)[:, :2]  # type: ignore[arg-type]
        ax.fill(*outline.T, facecolor=SKY, edgecolor=BLUE, linewidth=0.8, zorder=6)
        ax.annotate(name[-1], STRUTS[name], ha="center", va="center", fontsize=SMALL, zorder=7)
    path = trajectory.tip(np.linspace(0, end, 301))[:, :2, 3]
    ax.plot(*path.T, color=BLUE, linewidth=1.1, zorder=8)
    if end < trajectory.duration:
        rest = trajectory.tip(np.linspace(end, trajectory.duration, 301))[:, :2, 3]
        ax.plot(*rest.T, color=BLUE, linewidth=0.9, linestyle=(0, (1, 1.5)), zorder=8)
    ax.plot(*GOAL[:2], "*", color=BLACK, markersize=7, zorder=9, markeredgewidth=0)
    turned = np.degrees(2 * np.arccos(min(1.0, abs(float(trajectory.base_pose(end)[1][0])))))
    if struck is not None:
        ax.plot(*struck.mean(axis=0)[:2], "x", color=VERMILION, markersize=11, markeredgewidth=2.2, zorder=10)
        said = f"hits strut B at {at:.1f} s, the base turned by {turned:.0f}°"
    else:
        said = f"proven; the base turns by {turned:.0f}°" if turned > 0.01 else "proven, if the base cannot move"
    ax.annotate(said, (0.03, 0.03), xycoords="axes fraction", fontsize=SMALL, color=BLACK if struck is None else VERMILION)
    ax.set_aspect("equal")
    ax.set_xlim(*VIEW[0])
    ax.set_ylim(*VIEW[1])
    ax.set_xticks((-0.5, 0.0, 0.5, 1.0))
    ax.set_yticks((-0.5, 0.0, 0.5))
    ax.set_xlabel("x [m]")
    ax.set_title(title)


def base(ax: Any, trajectory: sa.Trajectory, t: float, *, face: str, edge: str, style: str = "-") -> None:
    """Draw the outline of the base's envelope, as one."""
    from scipy.spatial import ConvexHull

    parts = base_envelope(trajectory.robot, base_pose(trajectory, t))
    points = np.concatenate([silhouette(part, ACROSS, UP) for part in parts])[:, :2]
    outline = points[ConvexHull(points).vertices]
    ax.fill(*outline.T, facecolor=face, edgecolor=edge, linewidth=1.0, linestyle=style, zorder=1 if face == "none" else 0.5)


def arm(ax: Any, trajectory: sa.Trajectory, t: float, color: str) -> None:
    """Draw the arm: the outlines of its envelope and the lines from joint to joint."""
    for part in envelope(trajectory.robot, trajectory.sample(t).q, base_pose(trajectory, t)):
        ax.fill(*silhouette(part, ACROSS, UP)[:, :2].T, facecolor=color, alpha=0.3, linewidth=0, zorder=3)
    skeleton_of(ax, trajectory, t, color, linewidth=1.6)


def skeleton_of(ax: Any, trajectory: sa.Trajectory, t: float, color: str, **style: Any) -> None:
    """Draw the lines from joint to joint."""
    for segment in skeleton(trajectory.robot, trajectory.sample(t).q, base_pose(trajectory, t)):
        ax.plot(*segment[:, :2].T, marker="o", color=color, markersize=2.6, markeredgewidth=0, zorder=4, **style)


def base_pose(trajectory: sa.Trajectory, t: float) -> Array:
    """Return T_w_b (4, 4) at a time [s]."""
    position, attitude = trajectory.base_pose(t)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = matrix_of(attitude), position
    return T


def legend() -> list[Any]:
    """Return what the colours mean."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=PALE, linewidth=2, label="start"),
        Line2D([], [], color=GREEN, linewidth=2, label="passing strut B"),
        Line2D([], [], color=VERMILION, linewidth=2, label="hitting it"),
        Line2D([], [], color=GREEN, linewidth=1, linestyle=(0, (1.5, 1.5)), label="as it was planned"),
        Line2D([], [], color=DARK, linewidth=2, label="end"),
        Line2D([], [], color=BLUE, linewidth=1.1, label="path of the end effector"),
        Line2D([], [], marker="*", color=BLACK, linestyle="none", markersize=7, markeredgewidth=0, label="goal"),
    ]


if __name__ == "__main__":
    main(*sys.argv[1:])
