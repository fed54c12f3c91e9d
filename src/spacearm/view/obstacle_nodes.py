"""The obstacles in the scene: a mesh each, moved as a whole; many balls as one batch of the same mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import HalfSpace, Obstacle, Sphere, SphereSet
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.view.arm_nodes import envelope_of, place
from spacearm.view.colors import BAD, CHOSEN, OBSTACLE, Color
from spacearm.view.edited_problem import EditedProblem
from spacearm.view.placements import Handle, Movable, middle_of
from spacearm.view.shape_meshes import Triangles, triangles_of_obstacle, unit_ball

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]

MANY = 60
"""More balls than this are drawn as one batch."""

_MOST_NAMES = 40
_FAR = 4.0  # times the reach of the arm from its base: what is farther is not waited for by the camera
_OF_PLANE = 0.25  # opacity of a half-space's plane


class ObstacleNodes:
    """The obstacles' nodes.

    Args:
        scene: viser's.
        edited: the problem.
        extent: half the edge of the square that a half-space's plane is drawn as [m].
    """

    def __init__(self, scene: SceneApi, edited: EditedProblem, extent: float) -> None:
        self._scene, self._extent = scene, extent
        self._drawn: dict[int, Obstacle] = {}
        self._nodes: dict[int, Any] = {}
        self._meshes: dict[int, Any] = {}
        self._names: dict[int, Any] = {}
        self._colors: dict[int, Color] = {}
        obstacles, movables = edited.problem.scene.obstacles, edited.source.movables
        balls = [i for i, item in enumerate(obstacles) if isinstance(item, Sphere)]
        self._batched = balls if len(balls) > MANY else []
        self._batch = self._batch_of([obstacles[i] for i in self._batched]) if self._batched else None
        for i, movable in enumerate(movables):
            if i not in set(self._batched):
                self._add(i, movable)
        self._name_some(edited)
        self.update(edited)

    def _add(self, i: int, movable: Movable) -> None:
        name, own = f"/obstacles/{i}", movable.own
        self._nodes[i] = self._scene.add_frame(name, show_axes=False)
        at: Array = np.linalg.inv(movable.first.T).astype(np.float64)
        if isinstance(own, SphereSet):
            self._meshes[i] = self._balls(f"{name}/balls", own.centers @ at[:3, :3].T + at[:3, 3], own.radii)
            return
        plane = isinstance(own, HalfSpace)
        made = triangles_of_obstacle(own, extent=self._extent).moved(at)
        self._meshes[i] = self._scene.add_mesh_simple(
            f"{name}/shape",
            made.points.astype(np.float32),
            made.faces.astype(np.uint32),
            color=OBSTACLE,
            opacity=_OF_PLANE if plane else None,
            side="double",
            cast_shadow=not plane,
        )

    def _balls(self, name: str, centers: Array, radii: Array) -> Any:
        ball: Triangles = unit_ball(16, 8)
        return self._scene.add_batched_meshes_simple(
            name,
            ball.points.astype(np.float32),
            ball.faces.astype(np.uint32),
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(centers), 1)),
            batched_positions=np.asarray(centers),
            batched_scales=np.asarray(radii),
            batched_colors=OBSTACLE,
            lod="off",
        )

    def _batch_of(self, balls: list[Obstacle]) -> Any:
        return self._balls("/obstacles/balls", *_centers_and_radii(balls))

    def _name_some(self, edited: EditedProblem) -> None:
        named = [i for i, item in enumerate(edited.problem.scene.obstacles) if item.name][:_MOST_NAMES]
        for i in named:
            self._names[i] = self._scene.add_label(
                f"/names/{i}", edited.problem.scene.obstacles[i].name, anchor="bottom-center", font_screen_scale=0.8
            )

    def update(self, edited: EditedProblem) -> None:
        """Put the obstacles where the problem has them now."""
        obstacles = edited.problem.scene.obstacles
        moved = [i for i, item in enumerate(obstacles) if self._drawn.get(i) is not item]
        for i in moved:
            self._drawn[i] = obstacles[i]
            if i in self._nodes:
                place(self._nodes[i], edited.handle(i).T)
            if i in self._names:
                self._names[i].position = top_of(obstacles[i])
        if self._batch is not None and set(moved) & set(self._batched):
            self._batch.batched_positions = _centers_and_radii([obstacles[i] for i in self._batched])[0].astype(np.float32)

    def color(self, *, chosen: int, hit: int) -> None:
        """Show which obstacle is chosen and which one the arm is in contact with; -1: none."""
        for i, mesh in self._meshes.items():
            color = BAD if i == hit else CHOSEN if i == chosen else OBSTACLE
            if self._colors.get(i, OBSTACLE) == color:
                continue
            self._colors[i] = color
            if hasattr(mesh, "batched_colors"):
                mesh.batched_colors = np.array(color, dtype=np.uint8)
            else:
                mesh.color = color
        if self._batch is not None and self._colors.get(-1) != (chosen, hit, 0):
            self._colors[-1] = (chosen, hit, 0)
            colors = np.tile(np.array(OBSTACLE, dtype=np.uint8), (len(self._batched), 1))
            for i, color in ((chosen, CHOSEN), (hit, BAD)):
                if i in self._batched:
                    colors[self._batched.index(i)] = color
            self._batch.batched_colors = colors

    def show_names(self, shown: bool) -> None:
        """Show or hide the names."""
        for label in self._names.values():
            label.visible = shown

    def on_click(self, chosen: Any) -> None:
        """Call a function with the place of the obstacle that is clicked."""
        for i, mesh in self._meshes.items():

            def clicked(_: Any, i: int = i) -> None:
                chosen(i)

            mesh.on_click(clicked)


def _centers_and_radii(balls: list[Obstacle]) -> tuple[Array, Array]:
    found = [(ball.center, ball.radius) for ball in balls if isinstance(ball, Sphere)]
    return np.array([center for center, _ in found]), np.array([radius for _, radius in found])


def top_of(obstacle: Obstacle) -> Array:
    """Return a point above an obstacle, for its name, (3,) [m]."""
    if isinstance(obstacle, HalfSpace):
        return obstacle.point
    at = np.array(middle_of(obstacle))
    at[2] = float(_corners(obstacle)[1, 2]) + 0.02
    return at


def extent_of(edited: EditedProblem, reach: float) -> tuple[Array, float]:
    """Return the middle of robot and obstacles (3,), and how far they reach from it [m]; what is very far does not count."""
    problem = edited.problem
    base = problem.base_start
    frames = base_and_joint_frames(problem.robot, problem.start[None])[0]
    arm = [made.moved(base @ frames[joint + 1]).points for joint, made in envelope_of(problem.robot).items()]
    points = [base[:3, 3][None], *(np.array([part.min(axis=0), part.max(axis=0)]) for part in arm)]
    handle: Handle | None = edited.goal_handle()
    if handle is not None:
        points.append(handle.position[None])
    for item in problem.scene.obstacles:
        if not isinstance(item, HalfSpace):
            points.append(_corners(item))
    near = np.concatenate(points)
    near = near[np.linalg.norm(near - base[:3, 3], axis=1) < _FAR * reach]
    low, high = near.min(axis=0), near.max(axis=0)
    return (low + high) / 2, max(0.5 * reach, float(np.linalg.norm(high - low)) / 2)


def _corners(obstacle: Obstacle) -> Array:
    """Return two opposite corners of a box around an obstacle, (2, 3) [m]."""
    if isinstance(obstacle, SphereSet):
        low, high = obstacle.centers - obstacle.radii[:, None], obstacle.centers + obstacle.radii[:, None]
        return np.array([low.min(axis=0), high.max(axis=0)])
    if isinstance(obstacle, Sphere):
        return np.array([obstacle.center - obstacle.radius, obstacle.center + obstacle.radius])
    points = triangles_of_obstacle(obstacle, extent=1.0).points
    return np.array([points.min(axis=0), points.max(axis=0)])
