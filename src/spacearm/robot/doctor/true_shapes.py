"""Whether two links meet by their true collision shapes, where their envelopes, which are larger, do (with Coal)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.envelope import Shape
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.model import Robot
from spacearm.robot.segments import clearance, link_axes, placed
from spacearm.robot.self_collision import finite_range

Array = NDArray[np.float64]

_MOST = 300  # configurations in which the true shapes are looked at

Parts = Sequence[tuple[Any, Array]]
"""Coal's shapes and their transforms in a link's frame, (4, 4)."""


def meeting_share(robot: Robot, shapes: Mapping[str, Sequence[Shape]], links: tuple[str, str], *, samples: int) -> float:
    """Return the share of random configurations in which two links meet.

    Args:
        robot: with an envelope.
        shapes: each link's collision shapes, in its frame; a link that has none is looked at by its envelope.
        links: their names.
        samples: how many configurations are drawn, always the same.
    """
    lower, upper = finite_range(robot)
    q = lower + np.random.default_rng(0).random((samples, robot.dof)) * (upper - lower)
    frames = base_and_joint_frames(robot, q)
    axes = link_axes(robot)
    near = np.flatnonzero(clearance(placed(axes[links[0]], frames), placed(axes[links[1]], frames)) < 0)
    if not near.size:
        return 0.0
    share = near.size / samples
    if not all(shapes.get(link) for link in links):
        return share
    looked = near[np.linspace(0, near.size - 1, min(near.size, _MOST)).astype(int)]
    first, second = ([_part(shape) for shape in shapes[link]] for link in links)
    places = [_places(robot, link, frames[looked]) for link in links]
    return share * float(np.mean([_meet(first, A, second, B) for A, B in zip(*places, strict=True)]))


def _places(robot: Robot, link: str, frames: Array) -> Array:
    frame = robot.frame(link)
    return frames[:, frame.joint + 1] @ frame.T_joint_frame


def _meet(first: Parts, T_first: Array, second: Parts, T_second: Array) -> bool:
    import coal  # pyright: ignore[reportMissingImports]

    def moved(T: Array) -> Any:
        return coal.Transform3s(T[:3, :3], T[:3, 3])

    for one, T_one in first:
        for other, T_other in second:
            result = coal.CollisionResult()
            if coal.collide(one, moved(T_first @ T_one), other, moved(T_second @ T_other), coal.CollisionRequest(), result):
                return True
    return False


def _part(shape: Shape) -> tuple[Any, Array]:
    import coal  # pyright: ignore[reportMissingImports]

    if shape.kind == "sphere":
        made: Any = coal.Sphere(shape.size[0])
    elif shape.kind == "cylinder":
        made = coal.Cylinder(*shape.size)
    elif shape.kind == "box":
        made = coal.Box(*shape.size)
    else:
        assert shape.triangles is not None
        made = coal.BVHModelOBBRSS()
        made.beginModel(len(shape.triangles), 3 * len(shape.triangles))
        corners = shape.triangles.reshape(-1, 3)
        triangles = coal.StdVec_Triangle()
        for k in range(0, len(corners), 3):
            triangles.append(coal.Triangle(k, k + 1, k + 2))
        vertices = coal.StdVec_Vec3s()
        vertices.extend(list(corners))
        made.addSubModel(vertices, triangles)
        made.endModel()
    return made, shape.T_link_shape
