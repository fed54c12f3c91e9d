"""The frames that MoveIt's messages name, and where they are in the planning frame, which becomes the inertial frame.

MoveIt's planning frame is the parent frame of the virtual joint that holds the robot's root (unless that joint is fixed), else
the root link. An unset frame is the planning frame. Names are looked up in MoveIt's order: the planning frame, links of the
robot, what is attached to it, objects of the world and their subframes, and the scene's `fixed_frame_transforms`. Of these,
`header.frame_id` is the frame that is named and `child_frame_id` the planning frame, the reverse of tf.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.assembly import Origin
from spacearm.robot.model import Robot

if TYPE_CHECKING:
    from spacearm.files.moveit_messages import InFrame, PlanningScene, TransformStamped

Array = NDArray[np.float64]

_WORLD = "world"
_MOST_NAMED = 40
_SAME = 1e-6  # [m and -] transforms are written rounded


@dataclass(frozen=True, slots=True, kw_only=True)
class Frames:
    """What is known of frames, each as T_w_frame (4, 4), w the planning frame [m].

    Attributes:
        planning: names of the planning frame.
        default: of an unset frame.
        base: of the robot's base.
        links: of the robot's links.
        moving: names of those frames that the planned joints move.
        attached: of what is attached to links, and of its subframes.
        objects: of the world's objects, and of their subframes.
        fixed: those that the scene fixes.
        useless: fixed transforms that do not lead to the planning frame, by the frame that they would name.
        notes: what was assumed.
        with_robot: whether there is a robot.
    """

    planning: tuple[str, ...] = ()
    default: Array = field(default_factory=lambda: np.eye(4))
    base: Array = field(default_factory=lambda: np.eye(4))
    links: dict[str, Array] = field(default_factory=dict)
    moving: frozenset[str] = frozenset()
    attached: dict[str, Array] = field(default_factory=dict)
    objects: dict[str, Array] = field(default_factory=dict)
    fixed: dict[str, Array] = field(default_factory=dict)
    useless: dict[str, TransformStamped] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    with_robot: bool = False

    def of(self, part: InFrame, *, still: bool = False) -> Array:
        """Return T_w_frame (4, 4) of the frame that a message's header names.

        Args:
            part: what has the header.
            still: refuse a frame that the planned joints move.

        Raises:
            FileFormatError: a frame that is not known; or one that moves, where it must not.
        """
        name = part.frame
        if not name:
            return self.default
        moves = name in self.moving or name in self.attached
        if still and moves:
            raise part.frame_error(
                f"frame '{name}' is moved by the robot's joints, expected one that stands; state the goal in the planning frame"
            )
        found = self.find(name)
        if found is None:
            raise part.frame_error(self._unknown(name))
        if moves:
            self.say(f"what the scene states in frame '{name}', which the joints move, stands where the scene's state has it")
        return found

    def find(self, name: str) -> Array | None:
        """Return T_w_frame (4, 4), or None."""
        for known in (self.links, dict.fromkeys(self.planning, np.eye(4)), self.attached, self.objects, self.fixed):
            if name in known:
                return known[name]
        if name == _WORLD and (self.with_robot or not self.planning):
            if self.planning:
                self.say(f"frame 'world' is not placed by the scene: it is taken for the planning frame '{self.planning[0]}'")
            return np.eye(4)
        return None

    def say(self, note: str) -> None:
        """Add a note, once."""
        if note not in self.notes:
            self.notes.append(note)

    def _unknown(self, name: str) -> str:
        if name in self.useless:
            child = self.useless[name].child
            wanted = ", ".join(self.planning) or _WORLD
            return (
                f"frame '{name}' is fixed in frame '{child}', expected the planning frame ({wanted}): MoveIt has the named "
                "frame in header.frame_id, and the planning frame in child_frame_id"
            )
        if not self.with_robot:
            return (
                f"frame '{name}' is not known without a robot, expected {self._known()}; leave frame_id out where it is the "
                "planning frame, or use load_moveit(robot, ...)"
            )
        return f"frame '{name}' is not known, expected one of {self._known()}; place it in fixed_frame_transforms"

    def _known(self) -> str:
        names = [*self.planning, _WORLD, *self.fixed, *self.objects, *self.attached, *self.links]
        names = list(dict.fromkeys(names))
        more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
        return ", ".join(names[:_MOST_NAMED]) + more

    def at(self, base: Array, poses: Mapping[str, Array]) -> Frames:
        """Return the same with the robot elsewhere: its base, and its links in the base frame; nothing is attached."""
        return replace(self, base=base, links={name: base @ T for name, T in poses.items()}, attached={})


def frames_of(
    scene: PlanningScene | None, robot: Robot | None, base: Array, poses: Mapping[str, Array], notes: list[str] | None = None
) -> Frames:
    """Find the planning frame, and read a planning scene's `fixed_frame_transforms`.

    Args:
        scene: the planning scene; None: there are no fixed transforms.
        robot: None if it is not known.
        base: (4, 4) T_w_base in the scene's state [m].
        poses: T_base_link of the robot's links in the scene's state.
        notes: gets sentences on what is assumed.

    Raises:
        FileFormatError, SceneError: transforms that are none.
    """
    stated = [] if scene is None else scene.fixed_frame_transforms
    children = list(dict.fromkeys(item.child for item in stated))
    model, alias = _model_frame(robot)
    target = _target(stated, children, model)
    links = {name: base @ T for name, T in poses.items()}
    frames = Frames(base=base, links=links, notes=[] if notes is None else notes, with_robot=robot is not None)
    if robot is not None:
        frames = replace(frames, moving=frozenset(frame.name for frame in robot.frames if frame.joint >= 0))
    T_w_target = np.eye(4) if target is None else frames.links.get(target, np.eye(4))
    unplaced = target is not None and target not in frames.links and target != alias
    if model is None:  # no joint of the robot's root says what the planning frame is
        model = target if unplaced else _root(robot)
    elif unplaced and target not in (model, _WORLD):
        return _named(replace(frames, useless={_name_of(item): item for item in stated}), model, None)
    for item in stated:
        T = item.transform.matrix()
        if item.child == target:
            frames.fixed[_name_of(item)] = T_w_target @ T
            _require_agreement(item, frames)
        else:
            frames.useless[_name_of(item)] = item
    if alias is not None:
        frames.fixed.setdefault(alias, base)
    return _named(replace(frames, default=T_w_target), model, target)


def _require_agreement(item: TransformStamped, frames: Frames) -> None:
    """Refuse a transform that places a link of the robot where its state does not have it: for MoveIt the state counts."""
    name = _name_of(item)
    if name not in frames.links or np.abs(frames.links[name] - frames.fixed[name]).max() <= _SAME:
        return
    if name in frames.moving:
        frames.say(f"link '{name}' is where the scene's state has it, not where fixed_frame_transforms places it, as in MoveIt")
        return
    raise item.error(
        f"fixed_frame_transforms places link '{name}' elsewhere than the robot's state has it, expected the same place; remove "
        "it, or place the base by multi_dof_joint_state"
    )


def _named(frames: Frames, model: str | None, target: str | None) -> Frames:
    if frames.useless:
        names = ", ".join(f"'{name}'" for name in frames.useless)
        frames.say(f"fixed_frame_transforms that do not lead to the planning frame '{model}' are left out: of {names}")
    names = [model, None if target in frames.links else target]
    return replace(frames, planning=tuple(dict.fromkeys(name for name in names if name is not None)))


def _name_of(item: TransformStamped) -> str:
    return item.frame if "frame_id" in item.header.model_fields_set else _WORLD  # MotionBenchMaker leaves 'world' out


def _target(stated: list[TransformStamped], children: list[str], model: str | None) -> str | None:
    """Choose the frame that the fixed transforms lead to, which MoveIt also lists with itself."""
    own = [_name_of(item) for item in stated if _name_of(item) == item.child]
    return next((name for name in (model, *own, *children) if name in children), None)


def _model_frame(robot: Robot | None) -> tuple[str | None, str | None]:
    """Return the parent frame of a virtual joint that moves the robot's root, and that of one that fixes it, or None."""
    origin: Origin | None = None if robot is None else robot.origin
    if origin is None or origin.srdf is None:
        return None, None
    of_root = [joint for joint in origin.srdf.virtual_joints if joint.child == _root(robot) and joint.parent]
    parents = {joint.kind == "fixed": joint.parent.lstrip("/") for joint in of_root}
    return parents.get(False), parents.get(True)


def _root(robot: Robot | None) -> str | None:
    if robot is None:
        return None
    return next((frame.name for frame in robot.frames if not frame.parent and frame.joint < 0), None)


def root_joints(robot: Robot) -> dict[str, str]:
    """Return the kinds of the SRDF's virtual joints of the robot's root, by name; none without an SRDF."""
    origin: Origin | None = robot.origin
    if origin is None or origin.srdf is None:
        return {}
    return {joint.name: joint.kind for joint in origin.srdf.virtual_joints if joint.child == _root(robot)}
