"""Obstacles that are moved by hand: the handle of each, the obstacle moved with it, and how a problem file states that.

A handle has a position and an orientation in the inertial frame. It is in the middle of its obstacle, and turned as the
obstacle's own axes are; an obstacle without axes of its own begins with an unturned one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import keep
from spacearm.core.rotations import quaternion_of
from spacearm.geometry import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    SphereSet,
    moved_shape,
    pose,
)
from spacearm.geometry.scene import moved_scene

Array = NDArray[np.float64]

UNTURNED = (1.0, 0.0, 0.0, 0.0)


class Handle(NamedTuple):
    """Where a handle is, in the inertial frame.

    Attributes:
        position: (3,) [m].
        wxyz: (4,) its orientation, a quaternion of length 1, scalar first.
    """

    position: Array
    wxyz: Array

    @property
    def T(self) -> Array:
        """The transform (4, 4), T_w_handle."""
        return pose(self.position, self.wxyz)


def as_handle(position: ArrayLike, wxyz: ArrayLike) -> Handle:
    """Return a handle, its quaternion made one of length 1."""
    q = np.array(wxyz, dtype=np.float64)
    return Handle(np.array(position, dtype=np.float64), q / np.linalg.norm(q))


class FileEdit(NamedTuple):
    """What is to be written into a mapping of a problem file.

    Attributes:
        values: new values by key.
        drops: keys that these replace.
    """

    values: dict[str, Any]
    drops: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Movable:
    """An obstacle of a problem, and how it is moved.

    Attributes:
        own: the obstacle as the problem has it at first.
        file: (4, 4) where a file places what the obstacle is made of, which is what is written back; None: it is not placed.
        in_file: a polytope in the file's coordinates; None: it is none, or not from a file.
        fixed: why it cannot be moved, in words; "" if it can.
        first: its handle at first.
    """

    own: Obstacle
    file: Array | None = None
    in_file: Polytope | None = None
    fixed: str = ""
    first: Handle = field(init=False)

    def __post_init__(self) -> None:
        if isinstance(self.own, (Box, Cylinder)):
            first = as_handle(self.own.pose[:3, 3], quaternion_of(self.own.pose[:3, :3]))
        else:
            wxyz = UNTURNED if self.file is None else quaternion_of(self.file[:3, :3])
            first = as_handle(middle_of(self.own), wxyz)
        keep(self, first=first)

    @property
    def turns(self) -> bool:
        """Whether turning it changes anything."""
        return not isinstance(self.own, Sphere)

    def at(self, handle: Handle) -> Obstacle:
        """Return the obstacle with its handle elsewhere."""
        own = self.own
        if isinstance(own, Sphere):
            return replace(own, center=handle.position)
        if isinstance(own, (Box, Cylinder)):
            return replace(own, pose=handle.T)
        if self.in_file is not None:
            return moved_shape(self.in_file, self._placed(handle))
        R = handle.T[:3, :3] @ self.first.T[:3, :3].T
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, handle.position - R @ self.first.position
        return moved_scene(Scene([own]), T).obstacles[0]

    def edit(self, handle: Handle) -> FileEdit:
        """Return what a problem file says of the obstacle with its handle elsewhere, in the mapping of its shape."""
        moved = self.at(handle)
        if isinstance(moved, Sphere):
            return FileEdit({"center": moved.center.tolist()})
        if isinstance(moved, Capsule):
            return FileEdit({"a": moved.a.tolist(), "b": moved.b.tolist()})
        if isinstance(moved, HalfSpace):
            return FileEdit({"normal": moved.normal.tolist(), "point": moved.point.tolist()})
        at = handle.position if self.file is None else self._placed(handle)[:3, 3]
        return FileEdit({"position": at.tolist(), "q_wxyz": handle.wxyz.tolist()}, ("rpy_deg",))

    def _placed(self, handle: Handle) -> Array:
        """Return where the file's coordinates are, (4, 4), with the handle elsewhere."""
        assert self.file is not None
        middle = self.file[:3, :3].T @ (self.first.position - self.file[:3, 3])  # in the file's coordinates
        T = handle.T
        T[:3, 3] -= T[:3, :3] @ middle
        return T


def middle_of(obstacle: Obstacle) -> Array:
    """Return the middle of an obstacle, (3,) [m]; of a half-space, its point."""
    if isinstance(obstacle, Sphere):
        return obstacle.center
    if isinstance(obstacle, HalfSpace):
        return obstacle.point
    if isinstance(obstacle, (Box, Cylinder)):
        return obstacle.pose[:3, 3]
    if isinstance(obstacle, Capsule):
        points = np.array([obstacle.a, obstacle.b])
    elif isinstance(obstacle, SphereSet):
        points = np.vstack([obstacle.centers - obstacle.radii[:, None], obstacle.centers + obstacle.radii[:, None]])
    elif isinstance(obstacle, PolytopeSet):
        points = np.vstack([piece.vertices for piece in obstacle.pieces])
    else:
        points = obstacle.vertices
    return (points.min(axis=0) + points.max(axis=0)) / 2
