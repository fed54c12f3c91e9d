"""The frames that MoveIt's messages name: where they stand in the robot's base frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.moveit.part import Part, transform
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

_NOT_MOVED = 1e-9  # [m and -]
_BASE = ("", "world")


@dataclass(frozen=True, slots=True)
class Frames:
    """What is known of frames: the robot's own, and those that the planning scene fixes."""

    robot: Robot | None
    fixed: dict[str, Array]

    def of(self, part: Part) -> Array:
        """Return T_base_frame (4, 4) of the frame that a message's header names, the identity where it names none.

        Raises:
            FileFormatError: a frame that is not known, or that a joint moves.
        """
        named = part.deep("header", "frame_id")
        name = "" if named is None else named.text().lstrip("/")
        if name in self.fixed:
            return self.fixed[name]
        if name in _BASE:
            return np.eye(4)
        assert named is not None
        if self.robot is None:
            raise named.error(f"frame '{name}' is not known without a robot, expected world; use load_moveit(robot, ...)")
        for frame in self.robot.frames:
            if frame.name == name:
                if frame.joint < 0:
                    return frame.T_joint_frame
                raise named.error(f"frame '{name}' is moved by the robot's joints, expected one that stands; state it in world")
        standing = ", ".join(["world", *self.fixed, *(frame.name for frame in self.robot.frames if frame.joint < 0)])
        raise named.error(f"frame '{name}' is not known, expected one that stands: {standing}")


def frames_of(scene: Part | None, robot: Robot | None) -> Frames:
    """Read a planning scene's `fixed_frame_transforms`.

    Raises:
        FileFormatError, SceneError: transforms that are none.
    """
    fixed = {}
    for item in [] if scene is None else scene.items("fixed_frame_transforms"):
        T = item.need("transform")
        name = item.need("child_frame_id").text().lstrip("/")
        fixed[name] = transform(T.get("translation"), T.get("rotation"), unset=True)
    return Frames(robot, fixed)


def require_plain_state(state: Part | None) -> None:
    """Refuse a robot state that has something attached, or a base that does not stand in the world's origin.

    Raises:
        FileFormatError: one of these.
    """
    if state is None:
        return
    held = state.get("attached_collision_objects")
    if held is not None and held.value:
        raise held.error("attached_collision_objects are not read, expected none; remove them and add what is held with hold()")
    joints = state.get("multi_dof_joint_state")
    for item in [] if joints is None else joints.items("transforms"):
        T = transform(item.get("translation"), item.get("rotation"), unset=True)
        if np.abs(T - np.eye(4)).max() > _NOT_MOVED:
            raise item.error(
                "the robot's base is moved in the world, expected it at the origin; state the scene in its base frame"
            )
