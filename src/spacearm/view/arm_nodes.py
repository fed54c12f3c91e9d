"""A robot in the scene: its base, and a mesh for each joint that carries something; its ghost likewise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import quaternion_of
from spacearm.robot import Robot
from spacearm.robot.kinematics import joint_frames
from spacearm.view.colors import BASE, LINKS, Color
from spacearm.view.shape_meshes import Triangles, joined, triangles_of

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]

_ROD = 0.012  # times the size of the robot: a robot without an envelope is drawn as rods of this radius
_LINE = 0.008  # likewise of links that are lines


class ArmNodes:
    """A robot's nodes.

    Args:
        scene: viser's.
        name: of the root node, as in "/arm".
        robot: to be drawn.
        ghost: its colour, if it is drawn translucent.
        visuals: meshes by joint, -1 for the base: (triangles, colour); they are drawn in place of the envelope if asked for.
    """

    def __init__(
        self,
        scene: SceneApi,
        name: str,
        robot: Robot,
        *,
        ghost: Color | None = None,
        visuals: list[tuple[int, Triangles, Color]] | None = None,
    ) -> None:
        self._robot, self._ghost = robot, ghost
        self.root = scene.add_frame(name, show_axes=False)
        self._frames = {joint: scene.add_frame(f"{name}/{_of(joint)}", show_axes=False) for joint in range(len(robot.joints))}
        self.envelope = [
            self._mesh(scene, f"{name}/{_of(joint)}/envelope" if joint >= 0 else f"{name}/envelope", made, self._color(joint))
            for joint, made in envelope_of(robot).items()
            if joint >= 0 or ghost is None  # two bases in one place would flicker
        ]
        self.visuals = [
            self._mesh(scene, f"{name}/{_of(joint)}/visual_{i}" if joint >= 0 else f"{name}/visual_{i}", made, color)
            for i, (joint, made, color) in enumerate(visuals or ())
        ]
        self.q: Array | None = None
        self.show_visuals(bool(self.visuals))

    def _mesh(self, scene: SceneApi, name: str, made: Triangles, color: Color) -> Any:
        ghost = self._ghost is not None
        return scene.add_mesh_simple(
            name,
            made.points.astype(np.float32),
            made.faces.astype(np.uint32),
            color=self._ghost or color,
            opacity=0.3 if ghost else None,
            side="double",
            cast_shadow=not ghost,
            receive_shadow=not ghost,
        )

    def _color(self, joint: int) -> Color:
        return BASE if joint < 0 else LINKS[joint % 2]

    def place(self, q: Array, T_w_b: Array) -> None:
        """Put the robot at q (n,) with its base at T_w_b (4, 4)."""
        place(self.root, T_w_b)
        frames = joint_frames(self._robot, q)
        for joint, frame in self._frames.items():
            place(frame, frames[joint])
        self.q = q

    def tint(self, color: Color) -> None:
        """Give a ghost another colour."""
        if color != self._ghost:
            self._ghost = color
            for node in (*self.envelope, *self.visuals):
                node.color = color

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        if self.root.visible != visible:
            self.root.visible = visible

    def show_visuals(self, visuals: bool) -> None:
        """Show what the robot's file draws, or the envelope that is kept clear."""
        for node in self.visuals:
            node.visible = visuals
        for node in self.envelope:
            node.visible = not (visuals and self.visuals)


def _of(joint: int) -> str:
    return f"joint_{joint}"


def place(node: Any, T: Array) -> None:
    """Put a node at T (4, 4), in its parent's frame."""
    node.position = T[:3, 3]
    node.wxyz = quaternion_of(np.ascontiguousarray(T[:3, :3]))


def envelope_of(robot: Robot) -> dict[int, Triangles]:
    """Return what a robot's envelope looks like, by joint, -1 for the base; rods where it has none."""
    parts: dict[int, list[Triangles]] = {}
    line = _LINE * size_of(robot)
    for part in robot.shapes:
        parts.setdefault(part.joint, []).append(triangles_of(part.shape, line))
    if not parts:
        parts = _rods(robot)
    return {joint: joined(made) for joint, made in parts.items()}


def _rods(robot: Robot) -> dict[int, list[Triangles]]:
    from spacearm.geometry import Capsule, Sphere

    tip = robot.frame(robot.tip)
    ends = [(joint.parent, joint.T_parent_joint[:3, 3]) for joint in robot.joints] + [(tip.joint, tip.T_joint_frame[:3, 3])]
    radius = _ROD * max(sum(float(np.linalg.norm(end)) for _, end in ends), 0.1)
    out: dict[int, list[Triangles]] = {}
    for joint, end in ends:
        made = Capsule(np.zeros(3), end, radius) if np.linalg.norm(end) > radius else Sphere(end, 1.5 * radius)
        out.setdefault(joint, []).append(triangles_of(made))
    return out


def size_of(robot: Robot) -> float:
    """Return how far a robot reaches, about [m]."""
    from spacearm.planner.inverse_kinematics import reach_of

    reach = reach_of(robot, robot.tip)
    return float(np.clip(reach if np.isfinite(reach) else 1.0, 0.1, 1e3))
