"""MoveIt's planning scenes (`moveit_msgs/PlanningScene`): frames, the world's collision objects, and the collision matrix.

MoveIt's planning frame, which becomes the inertial frame, is the parent frame of the virtual joint that holds the robot's root
(unless that joint is fixed), else the root link. An unset frame is the planning frame. Names are looked up in MoveIt's order:
the planning frame, links of the robot, what is attached to it, objects of the world and their subframes, and the scene's
`fixed_frame_transforms`. Of these, `header.frame_id` is the frame that is named and `child_frame_id` the planning frame, the
reverse of tf. The allowed collision matrix says which links of the robot need not keep clear of each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import nearest
from spacearm.files.moveit_shapes import MOST_OBSTACLES, Made, mesh, mesh_file, named, plane, primitive
from spacearm.geometry import Obstacle, Scene
from spacearm.robot.assembly import Origin
from spacearm.robot.model import Robot
from spacearm.robot.self_collision import with_allowed_pairs
from spacearm.robot.unchecked_pairs import unchecked_pairs

if TYPE_CHECKING:
    from spacearm.files.moveit_messages import (
        AllowedCollisionMatrix,
        CollisionObject,
        InFrame,
        Mesh,
        Message,
        PlanningScene,
        Pose,
        SolidPrimitive,
        TransformStamped,
    )

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


ADD, REMOVE, APPEND, MOVE = range(4)
"""What is done with an object."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A shape of an object, where the file has it, and T_object_shape (4, 4) [m]."""

    part: Message
    made: Made
    T: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """An object: its shapes, and frames of its own.

    Attributes:
        name: its id.
        T: (4, 4), from its own frame to the planning frame [m].
        shapes: in its own frame.
        subframes: (4, 4) in its own frame, by name [m].
    """

    name: str
    T: Array
    shapes: tuple[Shape, ...]
    subframes: dict[str, Array] = field(default_factory=dict)

    def obstacles(self) -> Iterator[Obstacle]:
        """Yield its shapes as obstacles, numbered if there are several.

        Raises:
            SceneError: one that cannot be, with file and line.
        """
        for i, shape in enumerate(self.shapes):
            called, T = named(self.name, i, len(self.shapes)), self.T @ shape.T
            yield shape.part.located(lambda shape=shape, T=T, called=called: shape.made.make(T, called))

    def frames(self) -> dict[str, Array]:
        """Return its frame and its subframes in the planning frame, (4, 4) by name [m]."""
        inner = {f"{self.name}/{name}": self.T @ T for name, T in self.subframes.items()}
        return {self.name: self.T, **inner}


def world_of(file: PlanningScene, frames: Frames, *, mesh_excess: float | None = None) -> dict[str, Body]:
    """Read the world of a planning scene, object by object as MoveIt does; each may name frames of those before it.

    Args:
        file: the planning scene.
        frames: its frames; those of the objects are put in.
        mesh_excess: how far the pieces of a mesh may stand out of it [m].

    Raises:
        FileFormatError, SceneError: what is wrong, with file and line.
    """
    octomap = file.world.octomap
    inner = octomap.get("octomap") if isinstance(octomap, dict) else None
    if isinstance(inner, dict) and inner.get("data"):
        words = "the octomap is not read, expected none; give its points to enclose_points"
        raise file.world.error(words, "octomap", "octomap", "data")
    bodies: dict[str, Body] = {}
    for item in file.world.collision_objects:
        _apply(item, bodies, frames, mesh_excess)
        frames.objects.clear()
        for body in bodies.values():
            frames.objects.update(body.frames())
        if sum(len(body.shapes) for body in bodies.values()) > MOST_OBSTACLES:
            raise item.error(f"the scene has more than {MOST_OBSTACLES:,} shapes; leave out what is out of reach")
    return bodies


def scene_of(bodies: dict[str, Body]) -> Scene:
    """Return the obstacles of a world's objects.

    Raises:
        SceneError: one that cannot be.
    """
    return Scene([obstacle for body in bodies.values() for obstacle in body.obstacles()])


def _apply(item: CollisionObject, bodies: dict[str, Body], frames: Frames, mesh_excess: float | None) -> None:
    """Add, remove, append or move, as the object's operation says."""
    given, operation = item.id, item.operation
    name = given or ""
    if operation == REMOVE:
        if name and name not in bodies:
            frames.say(f"object {shown(name)} is to be removed, which is not there; nothing was removed")
        for gone in [name] if name else list(bodies):
            bodies.pop(gone, None)
        return
    if operation == MOVE:
        if name not in bodies:
            raise item.error(f"object {shown(name)} is to be moved, which is not there; {nearest(name, bodies)}")
        bodies[name] = _moved(item, bodies[name], frames)
        return
    if operation == ADD and given is not None and name in bodies:
        raise item.error(f"object {shown(name)} is there twice, expected each id once; rename or remove one", "id")
    body = body_of(item, name, frames, mesh_excess)
    if not body.shapes:
        raise item.error(f"object {shown(name)} has no shape, expected primitives, meshes or planes; add them or remove it")
    bodies[name if given is not None or name not in bodies else f"{name} {len(bodies)}"] = _joined(bodies.get(name), body)


def _joined(before: Body | None, body: Body) -> Body:
    """Append a body's shapes to those of an object, in that one's frame."""
    if before is None or not body.name:
        return body
    T = np.linalg.inv(before.T) @ body.T
    more = tuple(replace(shape, T=T @ shape.T) for shape in body.shapes)
    return replace(before, shapes=(*before.shapes, *more), subframes=body.subframes or before.subframes)


def _moved(item: CollisionObject, body: Body, frames: Frames) -> Body:
    """Put an object that is there to another pose, as its operation says; shapes go with it, or have poses of their own."""
    at = [*item.primitive_poses, *item.mesh_poses, *item.plane_poses]
    if at and len(at) != len(body.shapes):
        raise item.error(
            f"object '{body.name}' is moved with {len(at)} poses, expected one for each of {len(body.shapes)} shapes"
        )
    shapes = tuple(replace(shape, T=_pose(place, frames)) for shape, place in zip(body.shapes, at, strict=False))
    T = np.eye(4) if item.pose is None else _pose(item.pose, frames)
    return replace(body, T=frames.of(item) @ T, shapes=shapes or body.shapes)


def body_of(item: CollisionObject, name: str, frames: Frames, mesh_excess: float | None) -> Body:
    """Read an object's shapes, its pose and its subframes.

    As in MoveIt, an object of a single shape without a pose of its own has that of the shape.

    Raises:
        FileFormatError: what is wrong, with file and line.
    """
    whole = item.pose
    shapes = _shapes(item, name, frames, mesh_excess)
    T = np.eye(4) if whole is None else _pose(whole, frames)
    if len(shapes) == 1 and (whole is None or whole.is_empty):
        T, shapes = shapes[0].T, [replace(shapes[0], T=np.eye(4))]
    labels, places = item.subframe_names, item.subframe_poses
    if len(labels) != len(places):
        raise item.error(
            f"object {shown(name)} has {len(labels)} subframe_names and {len(places)} subframe_poses, expected one for each"
        )
    inner = {label: _pose(place, frames) for label, place in zip(labels, places, strict=True)}
    return Body(name=name, T=frames.of(item) @ T, shapes=tuple(shapes), subframes=inner)


def _shapes(item: CollisionObject, name: str, frames: Frames, mesh_excess: float | None) -> list[Shape]:
    base = frames.base[:3, 3]
    shapes = []
    for key, poses, made in (
        ("primitives", "primitive_poses", [solid(part) for part in item.primitives]),
        ("meshes", "mesh_poses", [_mesh(part, mesh_excess) for part in item.meshes]),
        ("planes", "plane_poses", [plane(part.coef, base) for part in item.planes]),
    ):
        places: list[Pose] = getattr(item, poses)
        if len(places) > len(made) or (len(places) < len(made) and item.pose is None):
            raise item.error(f"object {shown(name)} has {len(made)} {key} and {len(places)} {poses}, expected one for each")
        at = [_pose(place, frames) for place in places] + [np.eye(4)] * (len(made) - len(places))
        shapes += [Shape(part=part, made=one, T=T) for part, one, T in zip(getattr(item, key), made, at, strict=True)]
    return shapes


def _pose(part: Pose, frames: Frames) -> Array:
    if part.orientation is not None and not any(part.orientation) and not part.is_empty:
        frames.say("poses with the orientation 0 0 0 0, which is none, are not turned, as in MoveIt")
    return part.matrix(unset=True)


def solid(part: SolidPrimitive) -> Made:
    """Return one of `primitives`."""
    return primitive(part.type, np.array(part.dimensions))


def _mesh(part: Mesh, excess: float | None) -> Made:
    if part.resource is not None:
        return mesh_file(part.resource, part.file.path.parent, np.array(part.dimensions or (1.0, 1.0, 1.0)), excess=excess)
    vertices, triangles = np.array(part.vertices or ()), np.array(part.triangles or ())
    return mesh(vertices.reshape(-1, 3), triangles.astype(np.int64).reshape(-1, 3), excess=excess)


_MOST_NAMED = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """A matrix as it is stated: whether two names may touch, and each name's default."""

    names: tuple[str, ...]
    entries: dict[tuple[str, str], bool]
    defaults: dict[str, bool]

    def may_touch(self, first: str, second: str) -> bool:
        """Whether two links or objects may touch; as in MoveIt, what has neither entry nor default may not."""
        stated = [self.defaults[name] for name in (first, second) if name in self.defaults]
        return self.entries.get((first, second), bool(stated) and all(stated))


def read_matrix(matrix: AllowedCollisionMatrix | None) -> Matrix | None:
    """Read a scene's `allowed_collision_matrix`; None where there is none.

    Raises:
        FileFormatError: one that is not square.
    """
    if matrix is None:
        return None
    names, rows = matrix.entry_names, matrix.entry_values
    if len(rows) != len(names):
        raise matrix.error(f"entry_values has {len(rows)} rows, expected one for each of {len(names)} entry_names")
    entries: dict[tuple[str, str], bool] = {}
    for i, row in enumerate(rows):
        if len(row) != len(names):
            words = f"entry_values[{i}] is {row}, expected a list of {len(names)} true or false"
            raise matrix.error(words, "entry_values", i)
        for j in range(i + 1, len(names)):
            entries[names[i], names[j]] = entries[names[j], names[i]] = row[j]
    defaults_of, values = matrix.default_entry_names, matrix.default_entry_values
    if len(values) != len(defaults_of):
        words = f"default_entry_values is {values}, expected a list of {len(defaults_of)} true or false"
        raise matrix.error(words, "default_entry_values")
    defaults = dict(zip(defaults_of, values, strict=True))
    return Matrix(names=tuple(names), entries=entries, defaults=defaults)


def robot_with_matrix(robot: Robot, matrix: Matrix) -> Robot:
    """Return the robot with the pairs of links that a matrix does not allow to touch.

    Pairs that no joint moves against each other are unchecked, as for an SRDF.
    """
    of_pairs = ("keep clear", "not checked")  # in each note on pairs: new ones are added in their place
    kept = tuple(note for note in robot.notes if not any(words in note for words in of_pairs))
    return with_allowed_pairs(replace(robot, notes=kept), matrix.may_touch, by="MoveIt's matrix")


def note_matrix(robot: Robot, matrix: Matrix, objects: set[str], attached: set[str], notes: list[str], *, used: bool) -> None:
    """Say in notes what of a matrix is left out.

    Args:
        robot: with its own pairs, or those of the matrix.
        matrix: the matrix.
        objects: ids of the world's objects.
        attached: ids of those that are attached to links.
        notes: gets the sentences.
        used: whether the robot's pairs are those of the matrix.
    """
    if not used:
        more = _unchecked(robot, matrix)
        if more:
            said = ", ".join(f"{a} and {b}" for a, b in more[:_MOST_NAMED])
            said += f" and {len(more) - _MOST_NAMED} more" if len(more) > _MOST_NAMED else ""
            notes.append(
                f"the scene's matrix wants pairs of links kept clear that the robot does not check: {said}; acm=True takes the "
                "matrix"
            )
    links = {part.name for part in robot.shapes} | attached
    touching = {name for name in objects if any(matrix.may_touch(name, link) for link in links)}
    if touching:
        said = ", ".join(f"'{name}'" for name in sorted(touching)[:_MOST_NAMED])
        notes.append(f"the scene's matrix lets links touch {said}, which is left out: every link keeps clear of every object")


def _unchecked(robot: Robot, matrix: Matrix) -> list[tuple[str, str]]:
    """List the pairs of links that a matrix names and wants kept clear, that can move, and that nobody checks.

    Pairs that cannot meet within the limits are not among them: the certificate proves these.
    """
    named = {*matrix.names, *matrix.defaults}
    return [
        one.links
        for one in unchecked_pairs(robot)
        if one.reason != "rigid" and named.issuperset(one.links) and not matrix.may_touch(*one.links)
    ]
