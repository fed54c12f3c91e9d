"""The keys of a problem file, their types and what they mean; docs/problem_file.md explains them with examples.

The JSON schema made from them lets editors complete, explain and check such files. Imported only when a problem file is read.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, Strict, WithJsonSchema, model_validator

from spacearm.core.strict_model import Number, StrictModel, wrong_form
from spacearm.geometry.convex_pieces import PIECES
from spacearm.planner.planner_settings import TIME_LAWS, PlannerSettings, Weights
from spacearm.planner.problem import SNAP_TOLERANCE
from spacearm.proof import DEFAULT_CLEARANCE
from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty


def _form(words: str, *kinds: type, numbers: bool = False) -> BeforeValidator:
    """Refuse what has none of a key's forms in one sentence, before pydantic tries each of them."""

    def checked(given: Any) -> Any:
        number = numbers and isinstance(given, (int, float)) and not isinstance(given, bool)
        fits = abs(given) < math.inf if number else isinstance(given, kinds)  # NaN is not less
        if not fits or (isinstance(given, dict) and not all(isinstance(key, str) for key in given)):
            raise wrong_form(words)
        return given

    return BeforeValidator(checked)


def _numbers(count: int) -> WithJsonSchema:
    return WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": count, "maxItems": count})


def _one_of(*keys: str) -> ConfigDict:
    """Tell editors that one of the keys is needed; the reader says it in a sentence of its own."""
    return ConfigDict(json_schema_extra={"oneOf": [{"required": [key]} for key in keys]})


def _on_one_line(given: str) -> str:
    if not given.isprintable():
        raise wrong_form("text of printable characters on one line")
    return given


Text = Annotated[str, Strict(), AfterValidator(_on_one_line)]
Flag = Annotated[bool, _form("true or false", bool)]
Count = Annotated[int, Strict()]
Vector = Annotated[list[Number], _numbers(3)]
Quaternion = Annotated[list[Number], _numbers(4)]
Joints = Annotated[
    list[Number] | dict[Text, Number], _form("a list (one number a joint) or a mapping (joint: number)", list, dict)
]
Configuration = Annotated[
    list[Number] | dict[Text, Number] | Text,
    _form("a list (one number a joint), a mapping (joint: number) or a configuration's name", list, dict, str),
]
Each = Annotated[Number | list[Number], _form("a finite number, or a list of them", list, numbers=True)]
Ceiling = Annotated[Number | dict[Text, Number], _form("a number, or a mapping (joint: number)", dict, numbers=True)]
Range = Annotated[list[Number], _numbers(2)]
Settings = Annotated[dict[str, Any], _form("a mapping (setting: value)", dict)]
Axis = Annotated[Text | Vector, _form("x, y, z or a direction (a list of three numbers)", str, list)]

_POSITION = "where its origin is, in the inertial frame [m]; by default 0, 0, 0"
_Q_WXYZ = "its orientation as a quaternion, scalar first, of any length but 0"
_RPY_DEG = "its orientation by turns about the fixed x, then y, then z [degrees], as in a URDF"
_ROUNDING = "the shape is all points within this distance of it [m], 0 or more"
_SPHERES = "how many balls may enclose it, at most"
_EXCESS = "how far the balls may stand out, at most [m]; by default 2 % of its size"
_SCALE = "of the file's coordinates: one number, or three for x, y and z"


class SphereModel(StrictModel):
    """A ball."""

    center: Vector = Field(description="in the inertial frame [m], the base frame at the start unless base_start is given")
    radius: Number = Field(description="[m], above 0")


class CapsuleModel(StrictModel):
    """A rod with round ends."""

    a: Vector = Field(description="one end of its axis [m]")
    b: Vector = Field(description="the other end [m]")
    radius: Number = Field(description="[m], above 0")


class PlacedModel(StrictModel):
    """Something with a place of its own."""

    position: Vector | None = Field(None, description=_POSITION)
    q_wxyz: Quaternion | None = Field(None, description=_Q_WXYZ)
    rpy_deg: Vector | None = Field(None, description=_RPY_DEG)


class BoxModel(PlacedModel):
    """A cuboid about its own origin."""

    size: Vector = Field(description="edge lengths along its x, y and z [m]")
    rounding: Number = Field(0.0, description=_ROUNDING)


class CylinderModel(PlacedModel):
    """A round cylinder about its own origin, along its z."""

    radius: Number = Field(description="[m], above 0")
    length: Number = Field(description="along its z [m], above 0")
    rounding: Number = Field(0.0, description=_ROUNDING)


class PolytopeModel(PlacedModel):
    """The convex hull of points, in its own coordinates."""

    vertices: list[Vector] = Field(description="points whose convex hull it is [m], at least one; it may be flat")
    rounding: Number = Field(0.0, description=_ROUNDING)


class HalfSpaceModel(StrictModel):
    """Everything behind a plane: a floor, a wall, a hull."""

    normal: Vector = Field(description="out of the solid, of any length but 0")
    point: Vector = Field(description="any point on the plane [m]")


class MeshModel(PlacedModel):
    """A mesh, enclosed in convex pieces, or in balls."""

    file: Text = Field(description="STL, OBJ, PLY, DAE or GLB; relative to the problem file")
    scale: Each = Field(1.0, description=_SCALE)
    pieces: Count | None = Field(None, description="how many convex pieces may enclose it, at most; by default 16")
    spheres: Count | None = Field(None, description="in place of pieces: enclose it in balls, and in how many at most")
    excess: Number | None = Field(
        None, description="how far the pieces or balls may stand out, at most [m]; by default 2 % of its size"
    )
    inside: Literal["filled", "oriented", "none"] = Field(
        "filled", description="what of it is solid; oriented leaves cavities free whose faces are turned inward"
    )


class PointsModel(PlacedModel):
    """A point cloud, enclosed in balls."""

    file: Text = Field(
        description=".npy (n, 3), .ply, or text (.csv, .xyz): x, y, z in each line; relative to the problem file"
    )
    point_radius: Number = Field(0.0, description="each point stands for a ball of this radius [m]")
    scale: Each = Field(1.0, description=_SCALE)
    spheres: Count | None = Field(None, description=_SPHERES)
    excess: Number | None = Field(None, description=_EXCESS)


class MoveItModel(StrictModel):
    """The obstacles of a MoveIt planning scene."""

    file: Text = Field(description="a planning scene, YAML or MoveIt's own text; relative to the problem file")
    mesh_excess: Number | None = Field(None, description="how far the pieces of its meshes may stand out [m]; by default 2 %")

    @model_validator(mode="before")
    @classmethod
    def _path(cls, given: Any) -> Any:
        return _named(given, "file", "the path of a MoveIt scene, or a mapping with file")


class SolidModel(StrictModel):
    """One key: a shape that ends somewhere."""

    sphere: SphereModel | None = Field(None, description="a ball")
    capsule: CapsuleModel | None = Field(None, description="a rod with round ends")
    box: BoxModel | None = Field(None, description="a cuboid")
    cylinder: CylinderModel | None = Field(None, description="a round cylinder with flat ends, along its z")
    polytope: PolytopeModel | None = Field(None, description="the convex hull of points")
    mesh: MeshModel | None = Field(None, description="a mesh from a file, enclosed in convex pieces")
    points: PointsModel | None = Field(None, description="a point cloud from a file, enclosed in balls")

    @model_validator(mode="before")
    @classmethod
    def _one_shape(cls, given: Any) -> Any:
        shapes = [key for key in SHAPES if key in cls.model_fields]
        if isinstance(given, dict) and all(key in cls.model_fields for key in given):
            found = [key for key in shapes if key in given]
            if len(found) != 1:
                words = f"one shape, not {' and '.join(found)}" if found else f"a shape: {', '.join(shapes)}"
                raise wrong_form(words)
            if given[found[0]] is None:
                raise wrong_form(f"{found[0]} to be a mapping (key: value)")
        return given


SHAPES = ("sphere", "capsule", "box", "cylinder", "polytope", "half_space", "mesh", "points", "moveit")
_SOLIDS = ("sphere", "capsule", "box", "cylinder", "polytope", "mesh", "points")


class ObstacleModel(SolidModel):
    """An obstacle: its shape, and a name."""

    model_config = _one_of(*SHAPES)

    half_space: HalfSpaceModel | None = Field(None, description="everything behind a plane")
    moveit: MoveItModel | None = Field(None, description="all obstacles of a MoveIt planning scene")
    name: Text | None = Field(None, description="what messages and figures call it; by default its place in the list")


class PayloadModel(SolidModel):
    """A payload: its shape, and how it is attached."""

    model_config = _one_of(*_SOLIDS)

    frame: Text | None = Field(None, description="the frame that holds it; by default the end effector")
    position: Vector | None = Field(None, description="of the shape's coordinates in that frame [m]; by default 0, 0, 0")
    q_wxyz: Quaternion | None = Field(None, description=_Q_WXYZ)
    rpy_deg: Vector | None = Field(None, description=_RPY_DEG)
    touching: list[Text] | None = Field(None, description="links that it may touch, as the fingers around it")
    name: Text | None = Field(None, description="of the frame and the link that it becomes; by default held, held_2, ...")
    mass: Number | None = Field(None, description="[kg], above 0; it or the density is needed if the base floats")
    density: Number | None = Field(None, description="instead of the mass [kg/m^3], above 0: it is everywhere the same")
    com: Vector | None = Field(
        None, description="its centre of mass in its own frame [m]; by default that of the shape, evenly filled"
    )
    inertia: Annotated[list[Number], _numbers(6)] | None = Field(
        None,
        description="xx, yy, zz, xy, xz, yz about its centre of mass, along its own frame's axes [kg m^2]; by default that of "
        "the shape, evenly filled with the mass",
    )


class RobotModel(StrictModel):
    """A robot: a name, or a file with options."""

    model_config = _one_of("name", "file")

    name: Text | None = Field(None, description="of a robot that comes with spacearm")
    file: Text | None = Field(None, description="a URDF or a robot file; relative to the problem file")
    srdf: Text | None = Field(None, description="an SRDF about the robot; relative to the problem file")
    group: Text | None = Field(None, description="the group of the SRDF that moves; the other joints are locked")
    fixed: dict[Text, Number] | None = Field(None, description="joints that are locked, and where [rad or m]")
    tip: Text | None = Field(None, description="the link that is the end effector; by default the end of the chain")
    velocity_limit: Ceiling | None = Field(None, description="no joint is to be faster [rad/s or m/s]; or by joint")
    acceleration_limit: Ceiling | None = Field(None, description="likewise [rad/s^2 or m/s^2]")
    position_limits: dict[Text, Range] | None = Field(None, description="lower and upper limit by joint [rad or m]")
    joint_limits: Text | None = Field(None, description="MoveIt's joint_limits.yaml; relative to the problem file")
    collision: Literal["urdf", "none"] = Field(
        "urdf", description="where the robot's envelope is from; none: it is meant to have none"
    )
    pieces_per_mesh: Count | dict[Text, Count] = Field(
        PIECES, description="how many convex pieces may enclose one mesh of the URDF; or by link"
    )
    excess: Number | dict[Text, Number] | None = Field(
        None, description="fewer pieces are used where they stand out of a mesh by no more than this [m]; or by link"
    )
    capsules_per_shape: Count | None = Field(
        None,
        description="encloses every shape of the robot in capsules, at most this number each; by default shapes stay",
    )
    self_collision: Literal["auto", "srdf", "computed", "none"] = Field(
        "auto", description="which links must keep clear of each other; auto: by the SRDF if there is one, else computed"
    )
    holding: list[PayloadModel] | None = Field(None, description="the payloads")

    @model_validator(mode="before")
    @classmethod
    def _name(cls, given: Any) -> Any:
        """Take ``robot: zhang2022`` for ``robot: {name: zhang2022}``."""
        return _named(given, "name", "a name, or a mapping (key: value)")


class PoseModel(StrictModel):
    """A position and an orientation."""

    model_config = _one_of("q_wxyz", "rpy_deg")

    position: Vector = Field(description="of the frame's origin, in the inertial frame [m]")
    q_wxyz: Quaternion | None = Field(None, description=_Q_WXYZ)
    rpy_deg: Vector | None = Field(None, description=_RPY_DEG)


class GoalModel(StrictModel):
    """A goal: one target, and what may differ from it."""

    model_config = _one_of("configuration", "configuration_deg", "configurations", "configurations_deg", "position", "pose")

    configuration: Configuration | None = Field(None, description="joint positions [rad or m], or a configuration's name")
    configuration_deg: Joints | None = Field(None, description="joint positions [degrees]")
    configurations: list[Configuration] | None = Field(None, description="several, of which the best is reached")
    configurations_deg: list[Joints] | None = Field(None, description="likewise [degrees]")
    position: Vector | None = Field(None, description="for the frame's origin, in the inertial frame [m]")
    pose: PoseModel | None = Field(None, description="a position and an orientation for the frame")
    tolerance: Each | None = Field(
        None, description="of a position [m], by default 0.001; of configurations [rad or m], one number or one a joint, 0"
    )
    tolerance_deg: Each | None = Field(None, description="of configurations [degrees], one number or one a joint")
    position_tolerance: Number | None = Field(None, description="of a pose's position [m]; by default 0.001")
    orientation_tolerance: Number | None = Field(None, description="of a pose's orientation [rad]; by default 0.5 degrees")
    orientation_tolerance_deg: Number | None = Field(None, description="of a pose's orientation [degrees]; by default 0.5")
    free_axis: Axis | None = Field(None, description="of the frame: x, y, z or a direction about which a pose may be turned")
    frame: Text | None = Field(None, description="the frame that is to get to the position or pose; by default the tip")
    shortest: Flag | None = Field(None, description="joints without limits may end whole turns away from a configuration")

    @model_validator(mode="before")
    @classmethod
    def _name(cls, given: Any) -> Any:
        """Take ``goal: ready`` for ``goal: {configuration: ready}``."""
        return _named(given, "configuration", "a mapping, as in configuration: [...], or the name of a configuration")


class BaseStartModel(PlacedModel):
    """Where the base is when the motion begins."""

    model_config = ConfigDict(json_schema_extra={"not": {"required": ["position", "mass_center"]}})

    mass_center: Flag | None = Field(
        None, description="instead of a position: the centre of mass of base and arm is at the inertial origin"
    )

    @model_validator(mode="before")
    @classmethod
    def _word(cls, given: Any) -> Any:
        """Take ``base_start: mass_center`` for ``base_start: {mass_center: true}``."""
        return _flagged(given, "mass_center", "mass_center, or a mapping with position, q_wxyz or rpy_deg")


class BaseGoalModel(StrictModel):
    """How the base is to stand at the end."""

    model_config = _one_of("q_wxyz", "rpy_deg", "as_it_was")

    q_wxyz: Quaternion | None = Field(None, description="its attitude, a quaternion, scalar first, of any length but 0")
    rpy_deg: Vector | None = Field(None, description="its attitude by turns about the fixed x, then y, then z [degrees]")
    as_it_was: Flag | None = Field(None, description="the attitude at the start")
    tolerance: Number | None = Field(None, description="by which it may be missed [rad]; by default 0.0005")
    tolerance_deg: Number | None = Field(None, description="the same in degrees")

    @model_validator(mode="before")
    @classmethod
    def _word(cls, given: Any) -> Any:
        """Take ``base_goal: as_it_was`` for ``base_goal: {as_it_was: true}``."""
        return _flagged(given, "as_it_was", "as_it_was, or a mapping with q_wxyz, rpy_deg or as_it_was")


class BaseLimitsModel(StrictModel):
    """How little the arm may disturb the base."""

    final: Number | None = Field(None, description="angle between its attitudes at the end and at the start [rad]")
    final_deg: Number | None = Field(None, description="the same in degrees")
    peak: Number | None = Field(None, description="the greatest angle from its attitude at the start, at any time [rad]")
    peak_deg: Number | None = Field(None, description="the same in degrees")
    rate: Number | None = Field(None, description="how fast it may turn [rad/s]")
    rate_deg: Number | None = Field(None, description="the same in degrees a second")
    joint_momentum: Number | None = Field(
        None, description="the arm's angular momentum about the system's centre of mass, of its joints' motion alone [N m s]"
    )


class MomentumModel(StrictModel):
    """What base and arm have, and keep."""

    linear: Vector | None = Field(None, description="in the inertial frame [N s]; by default 0, 0, 0")
    angular: Vector | None = Field(
        None, description="about the system's centre of mass, in the inertial frame [N m s]; by default 0, 0, 0"
    )


class PairClearanceModel(StrictModel):
    """A clearance for some pairs: of an obstacle, of a link, of a link and an obstacle, or of two links."""

    clearance: Number = Field(description="that these pairs keep [m], 0 or more")
    obstacle: Text | None = Field(None, description="the obstacle's name; by default all")
    link: Text | None = Field(None, description="the link's name; by default all")
    links: list[Text] | None = Field(None, description="two links' names, instead of link and obstacle")


class ProblemModel(StrictModel):
    """A problem file."""

    version: Literal[1] = Field(alias="spacearm", description="the format's version: 1")
    robot: RobotModel = Field(
        description="what moves: the name of a robot that comes with spacearm, a file, or either with options"
    )
    scene: list[ObstacleModel] = Field([], description="the obstacles; by default none")
    start: Configuration | None = Field(
        None, description="joint positions [rad or m], one a joint or by name (others 0), or a configuration's name"
    )
    start_deg: Joints | None = Field(None, description="the same in degrees, instead of start")
    goal: GoalModel = Field(description="where to end")
    clearance: Number = Field(
        DEFAULT_CLEARANCE,
        description="that links keep from obstacles and from each other during the whole motion [m], proven; 0: no contact",
    )
    clearances: list[PairClearanceModel] = Field([], description="others, for some pairs")
    base: Literal["fixed", "floating"] | None = Field(
        None, description="fixed, or floating, free to drift and turn; by default as the robot says"
    )
    base_start: BaseStartModel | None = Field(
        None, description="where the base is at the start; mass_center: with the system's centre of mass at the inertial origin"
    )
    base_goal: BaseGoalModel | None = Field(
        None, description="how the floating base is to stand at the end; as_it_was: as at the start"
    )
    base_limits: BaseLimitsModel | None = Field(None, description="how little the arm may disturb the floating base")
    momentum: MomentumModel | None = Field(None, description="of base and arm, if the base floats; by default none")
    duration: Number | None = Field(None, description="of the motion [s]; by default the least that the limits allow")
    snap_tolerance: Number = Field(
        SNAP_TOLERANCE,
        description="a start or goal beyond a joint's limit by no more than this is set onto it [rad or m]",
    )
    planner: Settings = Field({}, description="settings of the planner")
    editor_schema: Text | None = Field(None, alias="$schema", description="for editors; not read")

    @model_validator(mode="before")
    @classmethod
    def _left_out(cls, given: Any) -> Any:
        """Take a key with nothing behind it for one that is left out."""
        if not isinstance(given, dict):
            return given
        return {
            key: value for key, value in given.items() if value is not None or key not in ("scene", "clearances", "planner")
        }


def _named(given: Any, key: str, words: str) -> Any:
    """Take a word for a mapping of one key."""
    if not isinstance(given, (str, dict)):
        raise wrong_form(words)
    return {key: given} if isinstance(given, str) else given


def _flagged(given: Any, key: str, words: str) -> Any:
    """Take a certain word for a mapping that says yes to it."""
    if given == key:
        return {key: True}
    if not isinstance(given, dict):
        raise wrong_form(words)
    return given


SCHEMA_FILE = Path(__file__).with_name("problem.schema.json")
"""Where the schema is in the installed package; name it in a problem file's first line:
``# yaml-language-server: $schema=...``."""

_RECORDS = (Weights, PSO, IPSO, FeasibleFirst, Penalty)


def problem_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of problem files, made from the models that read them.

    What it accepts may still be refused for what it means: a joint beyond its limits, a frame that is not there.
    """

    schema = _tidied(ProblemModel.model_json_schema(by_alias=True))
    definitions = schema.pop("$defs")
    _take_words(schema["properties"]["robot"])
    _take_words(schema["properties"]["goal"])
    _take_words(definitions["ObstacleModel"]["properties"]["moveit"])
    _take_words(schema["properties"]["base_start"], "mass_center")
    _take_words(schema["properties"]["base_goal"], "as_it_was")
    schema["oneOf"] = [{"required": ["start"]}, {"required": ["start_deg"]}]
    for record in _RECORDS:
        definitions[record.__name__] = _record(record)
    planner = schema["properties"]["planner"]
    schema["properties"]["planner"] = {"description": planner["description"], **_record(PlannerSettings)}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "spacearm problem file",
        **schema,
        "$defs": dict(sorted(definitions.items())),
    }


def _take_words(schema: dict[str, Any], *words: str) -> None:
    """A word alone, any or one of a few, stands for a mapping of one key."""
    schema["anyOf"] = [{"enum": list(words)} if words else {"type": "string"}, {"$ref": schema.pop("$ref")}]


def _tidied(schema: Any) -> Any:
    """Leave out what pydantic adds for itself: titles, and null for what is left out."""
    if isinstance(schema, list):
        return [_tidied(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    out = {}
    for key, value in schema.items():
        if key in ("properties", "$defs"):
            out[key] = {name: _tidied(inner) for name, inner in value.items()}
        elif not (key == "title" or (key == "default" and value in (None, [], {}))):
            out[key] = _tidied(value)
    for key in ("anyOf", "allOf"):
        if key in out:
            forms = [form for form in out.pop(key) if form != {"type": "null"}]
            out |= forms[0] if len(forms) == 1 else {key: forms}
    return out


def _record(record: type) -> dict[str, Any]:
    """Describe a record of settings: its fields' types, defaults, and what its docstring says of each."""
    from pydantic import TypeAdapter

    told = _attribute_lines(PSO) | _attribute_lines(record) if record is IPSO else _attribute_lines(record)
    properties: dict[str, Any] = {} if record in (PlannerSettings, Weights) else {"kind": {"const": record.__name__}}
    for name, form in TypeAdapter(record).json_schema()["properties"].items():
        plain = {key: value for key, value in form.items() if key != "title" and not (key == "default" and _is_whole(value))}
        properties[name] = {**({"description": told[name]} if name in told else {}), **plain}
    if record is PlannerSettings:
        properties["time_law"]["enum"] = list(TIME_LAWS)
        counts = properties["interior_points"]
        counts["anyOf"] = [{"type": "integer"}, {"type": counts.pop("type"), "items": counts.pop("items"), "minItems": 1}]
        error = {"type": "number", "minimum": 0}
        properties["tracking"]["anyOf"] = [error, {"type": "object", "additionalProperties": error}]
    out: dict[str, Any] = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**out, "required": ["kind"]} if record in (IPSO, Penalty) else out  # the others are what a mapping means


def _is_whole(default: Any) -> bool:
    """Whether a default is a record, which its own definition tells, or null."""
    return default is None or isinstance(default, dict)


def _attribute_lines(record: type) -> dict[str, str]:
    """Return what a docstring's Attributes say, by name."""
    found: dict[str, str] = {}
    name = ""
    for line in (record.__doc__ or "").split("Attributes:")[-1].splitlines():
        start = re.match(r" {8}(\w+): (.*)", line)
        if start:
            name = start[1]
            found[name] = start[2].strip()
        elif name and line.startswith(" " * 12):
            found[name] += f" {line.strip()}"
        else:
            name = ""
    return {key: re.sub(r"\bNone\b", "null", text) for key, text in found.items()}
