"""MoveIt's messages as pydantic models. ROS writes the same message in several ways; all are read.

Only what is used has a field. Messages in which an overlooked key would change what is meant refuse keys that are not known. A
key with null is one that is left out. Each message knows its place in its file, for sentences about it later on. Imported only
when such a file is read.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, TypeVar

import numpy as np
from annotated_types import Len
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, PrivateAttr, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, SpacearmError, nearest
from spacearm.core.reading import Place, YamlFile, require_known_keys
from spacearm.core.strict_model import Number, wrong_form
from spacearm.files.moveit_shapes import NUMBERED, PRIMITIVES
from spacearm.geometry import pose

Array = NDArray[np.float64]
T = TypeVar("T")

ADD, REMOVE, APPEND, MOVE = range(4)
_OPERATIONS = ("add", "remove", "append", "move")


def _text(given: Any) -> Any:
    """Take a number as it would be written."""
    if isinstance(given, bool) or not isinstance(given, (str, int, float)):
        raise wrong_form("text")
    return str(given).strip()


def _by_letters(letters: str) -> Callable[[Any], Any]:
    """Return a validator that takes a mapping as `{x: 0, y: 0, z: 1}` for a list."""

    def listed(given: Any) -> Any:
        if isinstance(given, dict) and given.keys() == set(letters):
            return [given[letter] for letter in letters]
        if not isinstance(given, list) or len(given) != len(letters):
            raise wrong_form(f"a list of {len(letters)} numbers or a mapping with {', '.join(letters)}")
        return given

    return listed


def _inside(key: str) -> BeforeValidator:
    """Take a mapping of one key for what that key holds."""
    return BeforeValidator(lambda given: given[key] if isinstance(given, dict) and given.keys() == {key} else given)


def _operation(given: Any) -> Any:
    """Take a number, a word, or the byte that ROS 2 prints."""
    value = given
    if isinstance(value, (str, bytes)) and len(value) == 1 and not str(value).isdigit():
        value = ord(value)
    if isinstance(value, str):
        value = _OPERATIONS.index(value.lower()) if value.lower() in _OPERATIONS else int(value) if value.isdigit() else value
    if isinstance(value, bool) or value not in range(4):
        raise wrong_form("0 (add), 1 (remove), 2 (append) or 3 (move)")
    return int(value)


def _flags(given: Any) -> Any:
    if not isinstance(given, list) or not all(value in (0, 1) for value in given):
        raise wrong_form("a list of true or false")
    return [bool(value) for value in given]


Text = Annotated[str, BeforeValidator(_text)]
XYZ = Annotated[list[Number], BeforeValidator(_by_letters("xyz"))]
XYZW = Annotated[list[Number], BeforeValidator(_by_letters("xyzw"))]
Flags = Annotated[list[bool], BeforeValidator(_flags), _inside("enabled")]
Operation = Annotated[int, BeforeValidator(_operation)]
Three = Annotated[list[Number], Len(3, 3), _inside("vertex_indices")]


class Message(BaseModel):
    """A message, or a part of one; a key that it does not know is left alone."""

    model_config = ConfigDict(frozen=True)  # so that defaults are shared, not copied

    only_these: ClassVar[bool] = False
    """Whether other keys are refused."""

    _file: Any = PrivateAttr(None)
    _place: Place = PrivateAttr(())

    @model_validator(mode="before")
    @classmethod
    def _stated(cls, given: Any) -> Any:
        if cls.only_these:
            require_known_keys(given, list(cls.model_fields))
        return {str(key): value for key, value in given.items() if value is not None} if isinstance(given, dict) else given

    @property
    def called(self) -> str:
        """What a sentence calls it: its key, with its number where it is in a list."""
        tail = self._place[-2:] if self._place and isinstance(self._place[-1], int) else self._place[-1:]
        return "".join(f"[{part}]" if isinstance(part, int) else str(part) for part in tail) or "the file"

    @property
    def file(self) -> YamlFile:
        """The file that it is in."""
        return self._file

    def error(self, sentence: str, *place: str | int) -> FileFormatError:
        """Return a sentence about this message, or a place in it, as an error with file and line."""
        return FileFormatError(f"{self.file.where((*self._place, *place))}: {sentence}")

    def located(self, make: Callable[[], T], *place: str | int) -> T:
        """Call something, and put file and line before the message of what it raises."""
        try:
            return make()
        except SpacearmError as error:
            raise type(error)(f"{self.file.where((*self._place, *place))}: {error}") from None


class StrictMessage(Message):
    """A message in which an overlooked key would change what is meant."""

    only_these: ClassVar[bool] = True


class Header(Message):
    """`std_msgs/Header`."""

    frame_id: Text = ""


class Pose(StrictMessage):
    """`geometry_msgs/Pose`."""

    position: XYZ
    orientation: XYZW | None = None

    @property
    def is_empty(self) -> bool:
        """Whether MoveIt takes it for one that nobody filled in: all its numbers are 0."""
        return not any(self.position) and not any(self.orientation or ())

    def matrix(self, *, unset: bool = False) -> Array:
        """Return T (4, 4); see `transform`."""
        return transform(self, "position", "orientation", unset=unset)


class Transform(Message):
    """`geometry_msgs/Transform`."""

    translation: XYZ | None = None
    rotation: XYZW | None = None

    def matrix(self) -> Array:
        """Return T (4, 4); a quaternion of zeros turns nothing, as in MoveIt."""
        return transform(self, "translation", "rotation", unset=True)


class InFrame(Message):
    """A message that is stated in a frame."""

    header: Header = Header()

    @property
    def frame(self) -> str:
        """The frame that the header names, without the slash that older files begin it with; "": none."""
        return self.header.frame_id.lstrip("/")

    def frame_error(self, sentence: str) -> FileFormatError:
        """Return a sentence about the frame as an error."""
        return self.error(sentence, "header", "frame_id")


class TransformStamped(InFrame):
    """`geometry_msgs/TransformStamped`."""

    child_frame_id: Text
    transform: Transform

    @property
    def child(self) -> str:
        """The name of the child frame."""
        return self.child_frame_id.lstrip("/")


class SolidPrimitive(StrictMessage):
    """`shape_msgs/SolidPrimitive`: a kind by its name or number, and dimensions in ROS's order [m]."""

    type: str
    dimensions: list[Number]
    polygon: Any = None

    @field_validator("type", mode="before")
    @classmethod
    def _kind(cls, given: Any) -> str:
        number = isinstance(given, int) and not isinstance(given, bool)
        kind = NUMBERED.get(given, str(given)) if number else _text(given).lower()
        if kind not in PRIMITIVES:
            words = f"type is {shown(given)}, which is no solid that is read; {nearest(kind, PRIMITIVES)}"
            raise PydanticCustomError("sentence", "{sentence}", {"sentence": words})
        return kind

    @field_validator("dimensions")
    @classmethod
    def _dimensions_of_kind(cls, given: list[float], info: ValidationInfo) -> list[float]:
        names = PRIMITIVES.get(info.data.get("type", ""), given)
        if len(given) != len(names):
            raise wrong_form(f"{len(names)} numbers; a {info.data['type']} has {', '.join(map(str, names))}")
        return given


class Mesh(StrictMessage):
    """`shape_msgs/Mesh`, or the path of a file and factors of its coordinates."""

    resource: Text | None = None
    dimensions: XYZ | None = None
    vertices: list[XYZ] | None = None
    triangles: list[Three] | None = None

    @field_validator("triangles")
    @classmethod
    def _numbers_of_vertices(cls, given: list[list[float]]) -> list[list[float]]:
        rows = np.array(given).reshape(-1, 3)
        wrong = ((rows != np.floor(rows)) | (np.abs(rows) > 2**53)).any(axis=1)
        if wrong.any():
            i = int(np.argmax(wrong))
            words = f"triangles[{i}] is {shown(given[i])}, expected three numbers of vertices"
            raise PydanticCustomError("sentence", "{sentence}", {"sentence": words, "key": i})
        return given

    @model_validator(mode="after")
    def _one_way(self) -> Mesh:
        given = {key for key in ("vertices", "triangles", "dimensions") if getattr(self, key) is not None}
        if self.resource is None and not given & {"vertices", "triangles"}:
            words = "the mesh is given by no vertices, expected vertices and triangles, or a resource: the path of a file"
            raise PydanticCustomError("sentence", "{sentence}", {"sentence": words})
        out_of_place = given & {"vertices", "triangles"} if self.resource is not None else given & {"dimensions"}
        if out_of_place:
            beside = "resource" if self.resource is not None else "vertices"
            words = f"{min(out_of_place)} stands beside {beside}, expected one of them; remove the other"
            raise PydanticCustomError("sentence", "{sentence}", {"sentence": words, "key": min(out_of_place)})
        return self


class Plane(StrictMessage):
    """`shape_msgs/Plane`: a, b, c, d of ax + by + cz + d = 0, or the list alone."""

    coef: Annotated[list[Number], Len(4, 4)]

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, given: Any) -> Any:
        return {"coef": given} if isinstance(given, list) else given


class CollisionObject(InFrame, StrictMessage):
    """`moveit_msgs/CollisionObject`."""

    pose: Pose | None = None
    id: Text | None = None
    type: Any = None
    primitives: list[SolidPrimitive] = []
    primitive_poses: list[Pose] = []
    meshes: list[Mesh] = []
    mesh_poses: list[Pose] = []
    planes: list[Plane] = []
    plane_poses: list[Pose] = []
    subframe_names: list[Text] = []
    subframe_poses: list[Pose] = []
    operation: Operation = ADD

    @property
    def has_shapes(self) -> bool:
        """Whether it has any shape."""
        return bool(self.primitives or self.meshes or self.planes)


class Posture(Message):
    """`trajectory_msgs/JointTrajectory`."""

    points: list[Any] = []


class AttachedCollisionObject(StrictMessage):
    """`moveit_msgs/AttachedCollisionObject`."""

    link_name: Text | None = None
    object: CollisionObject
    touch_links: list[Text] = []
    detach_posture: Posture = Posture()
    weight: Number = 0.0


class JointState(StrictMessage):
    """`sensor_msgs/JointState`."""

    header: Any = None
    name: list[Text] = []
    position: list[Number] = []
    velocity: Any = None
    effort: Any = None


class Twist(Message):
    """`geometry_msgs/Twist`."""

    linear: XYZ = [0.0, 0.0, 0.0]
    angular: XYZ = [0.0, 0.0, 0.0]


class MultiDOFJointState(InFrame, StrictMessage):
    """`sensor_msgs/MultiDOFJointState`."""

    joint_names: list[Text] = []
    transforms: list[Transform] = []
    twist: list[Twist] = []
    wrench: Any = None


class RobotState(StrictMessage):
    """`moveit_msgs/RobotState`."""

    joint_state: JointState | None = None
    multi_dof_joint_state: MultiDOFJointState | None = None
    attached_collision_objects: list[AttachedCollisionObject] = []
    is_diff: Any = False


class AllowedCollisionMatrix(Message):
    """`moveit_msgs/AllowedCollisionMatrix`."""

    entry_names: list[Text] = []
    entry_values: list[Flags] = []
    default_entry_names: list[Text] = []
    default_entry_values: Flags = []


class World(StrictMessage):
    """`moveit_msgs/PlanningSceneWorld`."""

    collision_objects: list[CollisionObject] = []
    octomap: Any = None


class LinkFactor(Message):
    """`moveit_msgs/LinkPadding` or `LinkScale`."""

    link_name: Text = ""
    padding: Number = 0.0
    scale: Number = 1.0


class PlanningScene(Message):
    """`moveit_msgs/PlanningScene`."""

    robot_state: RobotState | None = None
    fixed_frame_transforms: list[TransformStamped] = []
    allowed_collision_matrix: AllowedCollisionMatrix | None = None
    link_padding: list[LinkFactor] = []
    link_scale: list[LinkFactor] = []
    world: World
    is_diff: Any = False
    robot_model_name: Text = ""


class BoundingVolume(Message):
    """`moveit_msgs/BoundingVolume`."""

    primitives: list[SolidPrimitive] = []
    primitive_poses: list[Pose] = []
    meshes: list[Any] = []


class JointConstraint(StrictMessage):
    """`moveit_msgs/JointConstraint`."""

    joint_name: Text
    position: Number
    tolerance_above: Number = 0.0
    tolerance_below: Number = 0.0
    weight: Any = None


class PositionConstraint(InFrame, StrictMessage):
    """`moveit_msgs/PositionConstraint`."""

    link_name: Text
    target_point_offset: XYZ = [0.0, 0.0, 0.0]
    constraint_region: BoundingVolume
    weight: Any = None


class OrientationConstraint(InFrame, StrictMessage):
    """`moveit_msgs/OrientationConstraint`."""

    orientation: XYZW
    link_name: Text
    absolute_x_axis_tolerance: Number = 0.0
    absolute_y_axis_tolerance: Number = 0.0
    absolute_z_axis_tolerance: Number = 0.0
    parameterization: Number = 0.0
    weight: Any = None

    def matrix(self) -> Array:
        """Return T (4, 4)."""
        return transform(self, None, "orientation")


class Constraints(StrictMessage):
    """`moveit_msgs/Constraints` of a goal."""

    name: Any = None
    joint_constraints: list[JointConstraint] = []
    position_constraints: list[PositionConstraint] = []
    orientation_constraints: list[OrientationConstraint] = []
    visibility_constraints: list[Any] = []


class PathConstraints(Message):
    """`moveit_msgs/Constraints` of the way; whatever they are, they are refused."""

    joint_constraints: Any = None
    position_constraints: Any = None
    orientation_constraints: Any = None
    visibility_constraints: Any = None


class TrajectoryConstraints(Message):
    """`moveit_msgs/TrajectoryConstraints`."""

    constraints: list[PathConstraints] = []


class MotionPlanRequest(Message):
    """`moveit_msgs/MotionPlanRequest`."""

    start_state: RobotState | None = None
    goal_constraints: list[Constraints] = []
    path_constraints: PathConstraints = PathConstraints()
    trajectory_constraints: TrajectoryConstraints = TrajectoryConstraints()
    group_name: Text = ""
    max_velocity_scaling_factor: Number = 1.0
    max_acceleration_scaling_factor: Number = 1.0
    max_cartesian_speed: Number = 0.0


M = TypeVar("M", bound=Message)


def message(model: type[M], file: YamlFile) -> M:
    """Read a file as a message, and tell each part of it its place.

    Raises:
        FileFormatError: it does not fit; file and line are named.
    """
    found = file.parsed(model)
    _settle(found, file, ())
    return found


def _settle(value: Any, file: YamlFile, place: Place) -> None:
    if isinstance(value, list):
        for i, entry in enumerate(value if value and isinstance(value[0], Message) else ()):
            _settle(entry, file, (*place, i))
    elif isinstance(value, Message):
        value._file, value._place = file, place
        for name in value.model_fields_set:
            _settle(getattr(value, name), file, (*place, name))


def transform(owner: Message, position: str | None, rotation: str, *, unset: bool = False) -> Array:
    """Return T (4, 4) of a position [m] and a quaternion in ROS's order, x y z w; what is missing moves nothing.

    Args:
        owner: the message that holds them.
        position, rotation: its keys; None: the position is 0.
        unset: whether a quaternion of zeros is taken for one that nobody filled in, as MoveIt does.

    Raises:
        FileFormatError, SceneError: numbers that are none, or a quaternion of zeros.
    """
    at, q = getattr(owner, position) if position else None, getattr(owner, rotation)
    at = (0.0, 0.0, 0.0) if at is None else at
    if q is None or (unset and not any(q)):
        return pose(at)
    if not any(q):
        raise owner.error(
            f"{rotation} is [0, 0, 0, 0], expected a unit quaternion x y z w; [0, 0, 0, 1] turns nothing", rotation
        )
    x, y, z, w = q
    return owner.located(lambda: pose(at, (w, x, y, z)), rotation)
