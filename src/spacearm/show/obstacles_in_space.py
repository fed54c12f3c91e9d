"""Obstacles in a picture of space: transparent, with a soft light on them, the far ones first.

Each is drawn as the outline seen from the eye and what lies inside it; a mesh would show its seams.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.scene import Box, Capsule, Cylinder, HalfSpace, Obstacle, Scene, Sphere, SphereSet
from spacearm.show.path_drawing import OBSTACLE_ALPHA
from spacearm.show.shapes import box_faces, cut, cylinder_ends, middle, silhouette
from spacearm.show.style import BLUE, SKY

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
        outline = silhouette(obstacle, self.across, self.up)
        self._fill([outline], SKY, _FILL)
        if isinstance(obstacle, Box):
            self._faces(box_faces(obstacle))
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
