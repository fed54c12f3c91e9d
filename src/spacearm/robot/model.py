"""What moves: a tree of joints, the shapes of the links, named frames, and each joint's limits.

Frames: the base frame is the root. Each joint has a *moving frame*, whose z is the joint's axis: with value v
it is ``T_parent_joint @ Rz(v)`` (revolute) or ``T_parent_joint @ Tz(v)`` (prismatic) in the parent joint's
moving frame. Shapes and frames ride on one moving frame each, or on the base (joint -1).
"""

from __future__ import annotations

import functools
import inspect
import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Rows
from spacearm.core.checks import (
    Frozen,
    as_name,
    as_number,
    as_readonly,
    as_transform,
    keep,
    require_kind,
    shown,
    value_fields,
)
from spacearm.core.errors import RobotError, nearest
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.notebook_hook import InNotebooks
from spacearm.core.records import plain, record_from_dict
from spacearm.robot.link_shapes import (
    LinkCapsule,
    LinkShape,
    as_capsule,
    as_index,
    part_as_dict,
    part_from_dict,
    part_of_capsule,
)
from spacearm.robot.link_visuals import LinkVisual
from spacearm.robot.robot_in_short import robot_in_short
from spacearm.robot.unchecked_pairs import COLLISIONS, ApartPairs, UncheckedPair, known_unweighed, settled_pairs

Array = NDArray[np.float64]
RobotType = TypeVar("RobotType", bound="Robot")

_SKEW = 1e-9  # share of its largest entry by which an inertia may miss symmetry


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Body(Frozen):
    """The mass of one link; links that are fixed to each other are bodies of their own on the same joint.

    Attributes:
        name: of the link.
        joint: index of the joint whose moving frame it rides on, -1 for the base.
        mass: [kg].
        com: (3,) centre of mass, in that frame [m].
        inertia: (3, 3) about the centre of mass, along the axes of that frame [kg m^2].

    Raises:
        RobotError: a mass below 0, numbers that are not finite, or an inertia that is not symmetric.
    """

    name: str
    joint: int
    mass: float
    com: Array
    inertia: Array

    def __post_init__(self) -> None:
        where = f"body '{as_name('a body name', self.name, RobotError)}'"
        inertia = as_readonly(f"{where}: inertia", self.inertia, (3, 3), RobotError)
        half = inertia / 2  # of large numbers the sum would be infinite
        if np.abs(half - half.T).max() > _SKEW * np.abs(half).max():
            raise RobotError(f"{where}: inertia is {shown(inertia.tolist())}, expected a symmetric one")
        keep(
            self,
            joint=as_index(f"{where}: joint", self.joint),
            mass=as_number(f"{where}: mass", self.mass, RobotError, at_least=0, unit="kg"),
            com=as_readonly(f"{where}: com", self.com, (3,), RobotError),
            inertia=as_readonly(f"{where}: inertia", half + half.T, (3, 3), RobotError),
        )


JOINT_KINDS = ("revolute", "prismatic")
BASE_KINDS = ("fixed", "floating")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Joint(Frozen):
    """A moving joint; its value is ``multiplier * q[dof] + offset``.

    Attributes:
        name: unique in the robot.
        kind: "revolute" [rad] or "prismatic" [m]; it turns about or slides along z of its own frame.
        parent: index of the parent joint, -1 for the base.
        T_parent_joint: (4, 4), from this joint's frame at value 0 to the parent's moving frame [m].
        dof: index in q. -1 asks the robot for the next free one; joints that move together (URDF's mimic)
            share one.
        multiplier: of q[dof] [-].
        offset: added to it [rad or m].

    Raises:
        RobotError: a kind, transform or number that cannot be.
    """

    name: str
    kind: Literal["revolute", "prismatic"]
    parent: int
    T_parent_joint: Array
    dof: int = -1
    multiplier: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        as_name("a joint's name", self.name, RobotError)
        if not isinstance(self.kind, str) or self.kind not in JOINT_KINDS:
            raise RobotError(f"joint '{self.name}' has kind {shown(self.kind)}, expected one of {', '.join(JOINT_KINDS)}")
        where = f"joint '{self.name}'"
        keep(
            self,
            parent=as_index(f"{where}: parent", self.parent),
            dof=as_index(f"{where}: dof", self.dof),
            T_parent_joint=as_transform(f"{where}: T_parent_joint", self.T_parent_joint, RobotError),
            multiplier=as_number(f"{where}: multiplier", self.multiplier, RobotError),
            offset=as_number(f"{where}: offset", self.offset, RobotError),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Frame(Frozen):
    """A named place on the robot; every link of a URDF is one.

    Attributes:
        name: unique in the robot.
        joint: index of the joint whose moving frame it rides on, -1 for the base.
        T_joint_frame: (4, 4), from this frame to that moving frame [m].
        parent: name of the frame that a joint, moving or fixed, ties it to on the way to the base; "" for the
            root, and where that is not known.

    Raises:
        RobotError: a transform that is none.
    """

    name: str
    joint: int
    T_joint_frame: Array
    parent: str = ""

    def __post_init__(self) -> None:
        where = f"frame '{as_name('a frame name', self.name, RobotError)}'"
        if not isinstance(self.parent, str):
            raise RobotError(f"{where}: parent is {shown(self.parent)}, expected the name of a frame, or ''")
        keep(
            self,
            joint=as_index(f"{where}: joint", self.joint),
            T_joint_frame=as_transform(f"{where}: T_joint_frame", self.T_joint_frame, RobotError),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class NamedConfiguration(Frozen):
    """A configuration with a name, as "ready" or "home".

    Attributes:
        name: unique in the robot.
        q: (n,) [rad or m], in the order of the robot's `dof_names`.

    Raises:
        RobotError: numbers that are not finite.
    """

    name: str
    q: Array

    def __post_init__(self) -> None:
        where = f"configuration '{as_name('a configuration name', self.name, RobotError)}'"
        keep(self, q=as_readonly(where, self.q, (None,), RobotError))


def _taking_capsules(cls: type[RobotType]) -> type[RobotType]:
    """Let a class's constructor take `capsules` too: they take the place of its shapes."""
    made: Any = cls
    plain_init = made.__init__

    @functools.wraps(plain_init)
    def init(self: Any, *, capsules: Any = None, **given: Any) -> None:
        if capsules is not None:
            given["shapes"] = tuple(one.as_shape for one in _members("capsules", capsules, LinkCapsule))
        plain_init(self, **given)

    signature = inspect.signature(plain_init)
    further = inspect.Parameter("capsules", inspect.Parameter.KEYWORD_ONLY, default=None)
    init.__signature__ = signature.replace(parameters=[*signature.parameters.values(), further])  # type: ignore[attr-defined]
    made.__init__ = init
    return cls


@_taking_capsules
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Robot(Frozen, InNotebooks):
    """An arm, or a tree of them, on a base.

    Attributes:
        name: for people.
        joints: parents before children.
        shapes: of its links; empty if nothing is to be kept clear. The constructor takes
            `capsules` (LinkCapsule) as well; they take the place of the shapes.
        frames: named places, unique names.
        tip: name of the frame that is the end effector.
        dof_names: (n,) names of the entries of q; by default those of the joints that are no one's mimic.
        lower, upper: (n,) limits of q [rad or m]; -inf and inf where a joint turns without end.
        velocity: (n,) limits of |dq| [rad/s or m/s], above 0.
        acceleration: (n,) limits of |ddq| [rad/s^2 or m/s^2], above 0.
        base: "fixed" or "floating" (free to drift and turn), unless a problem says otherwise.
        bodies: the masses of the links, as far as the file states them; empty if it states none. Those on joint -1
            are the base's.
        self_pairs: names of links that must keep clear of each other, two by two; empty if none need to.
        apart: pairs that must keep clear as well, but cannot meet within the limits: a search does not look at them, a
            certificate does. Where shapes, joints or limits change, they become `self_pairs`.
        unchecked: pairs that are not checked, and why. `unchecked_pairs(robot)` lists all that are not checked.
        collision: "none" says that the robot is meant to have no envelope; one without is refused otherwise.
        solid: links that are more than frames: those with a shape, drawn or for collision, or a mass in their file. Those of
            them without an envelope are kept clear of nothing, which is told.
        unweighed: links with a shape whose mass is not known, each with the reason; a floating base refuses them.
        configurations: named ones.
        source: the file or built-in name it came from.
        notes: what was assumed in reading it, a sentence each.
        visuals: how its links look, for pictures; no part of its value. Meshes are named, not read.
        origin: of a robot from a file, what it was put together from, so that joints can be locked elsewhere afterwards; no
            part of its value, and kept neither by pickle nor in files.

    Raises:
        RobotError: a child before its parent, a name twice, limits that contradict, a tip that is no frame.
    """

    name: str
    joints: tuple[Joint, ...]
    shapes: tuple[LinkShape, ...] = ()
    frames: tuple[Frame, ...]
    tip: str
    dof_names: tuple[str, ...] = ()
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    base: Literal["fixed", "floating"] = "fixed"
    bodies: tuple[Body, ...] = ()
    self_pairs: tuple[tuple[str, str], ...] = ()
    apart: ApartPairs | None = None
    unchecked: tuple[UncheckedPair, ...] = ()
    collision: Literal["envelope", "none"] = "envelope"
    solid: tuple[str, ...] = ()
    unweighed: tuple[tuple[str, str], ...] = ()
    configurations: tuple[NamedConfiguration, ...] = ()
    source: str = ""
    notes: tuple[str, ...] = ()
    visuals: tuple[LinkVisual, ...] = field(default=(), repr=False, compare=False)
    origin: Any = field(default=None, repr=False, compare=False, metadata={"stays_here": True})

    if TYPE_CHECKING:  # the constructor takes `capsules` as well

        def __init__(
            self,
            *,
            name: str,
            joints: Iterable[Joint],
            shapes: Iterable[LinkShape] = (),
            capsules: Iterable[LinkCapsule] | None = None,
            frames: Iterable[Frame],
            tip: str,
            dof_names: Iterable[str] = (),
            lower: ArrayLike,
            upper: ArrayLike,
            velocity: ArrayLike,
            acceleration: ArrayLike,
            base: str = "fixed",
            bodies: Iterable[Body] = (),
            self_pairs: Iterable[tuple[str, str]] = (),
            apart: ApartPairs | None = None,
            unchecked: Iterable[UncheckedPair] = (),
            collision: str = "envelope",
            solid: Iterable[str] = (),
            unweighed: Iterable[tuple[str, str]] = (),
            configurations: Iterable[NamedConfiguration] = (),
            source: str = "",
            notes: Iterable[str] = (),
            visuals: Iterable[LinkVisual] = (),
            origin: Any = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        as_name("a robot's name", self.name, RobotError)
        require_base(self.base)
        joints = _number_dofs(_members("joints", self.joints, Joint))
        frames = _members("frames", self.frames, Frame)
        shapes = _members("shapes", self.shapes, LinkShape)
        bodies = _members("bodies", self.bodies, Body)
        visuals = _members("visuals", self.visuals, LinkVisual)
        if not joints:
            raise RobotError(f"robot '{self.name}' has no moving joint, expected at least one; nothing can be planned")
        _require_unique("joint", [joint.name for joint in joints])
        _require_unique("frame", [frame.name for frame in frames])
        _require_unique("body", [body.name for body in bodies])
        _require_tree(joints, (*frames, *shapes, *bodies, *visuals))
        names = _members("dof_names", self.dof_names, str) or _own_names(joints)
        _require_unique("dof", [as_name("a dof's name", name, RobotError) for name in names])
        _require_dofs_used(joints, names)
        pairs = _checked_pairs(self.self_pairs, {part.name for part in shapes})
        keep(self, joints=joints, frames=frames, shapes=shapes, bodies=bodies, dof_names=names, visuals=visuals)
        keep(self, notes=_members("notes", self.notes, str), self_pairs=pairs)
        keep(self, **_checked_limits(self))
        keep(self, **_checked_coverage(self))
        keep(self, configurations=_checked_configurations(self))
        self.frame(self.tip)

    def _in_short(self) -> tuple[str, Rows]:
        return robot_in_short(self)

    @property
    def capsules(self) -> tuple[LinkCapsule, ...]:
        """The envelope in capsules, for programs that know no other shapes: spheres and capsules are themselves.

        Around each other shape there are a few, which hold it and stand out of it.
        """
        return _in_capsules(self)

    @property
    def dof(self) -> int:
        """Number of degrees of freedom n, the length of q."""
        return len(self.dof_names)

    def frame(self, name: str) -> Frame:
        """Return the frame of that name.

        Raises:
            RobotError: no frame has it; the nearest name and the known ones are listed.
        """
        as_name("a frame's name", name, RobotError)
        for frame in self.frames:
            if frame.name == name:
                return frame
        known = nearest(name, (frame.name for frame in self.frames))
        raise RobotError(f"robot '{self.name}' has no frame {shown(name)}; {known}")

    def configuration(self, name: str) -> Array:
        """Return the configuration (n,) of that name [rad or m].

        Raises:
            RobotError: none has it; the nearest name and the known ones are listed.
        """
        as_name("a configuration's name", name, RobotError)
        for configuration in self.configurations:
            if configuration.name == name:
                return configuration.q
        known = nearest(name, (configuration.name for configuration in self.configurations))
        raise RobotError(f"robot '{self.name}' has no configuration {shown(name)}; {known}")

    def dof_index(self, name: str) -> int:
        """Return the index in q of the degree of freedom of that name.

        Raises:
            RobotError: none has it; the nearest name and the known ones are listed.
        """
        as_name("a joint's name", name, RobotError)
        if name in self.dof_names:
            return self.dof_names.index(name)
        raise RobotError(f"robot '{self.name}' has no joint {shown(name)}; {nearest(name, self.dof_names)}")

    def is_prismatic(self, dof: int) -> bool:
        """Whether q[dof] is a length [m] rather than an angle [rad]."""
        moved = [joint for joint in self.joints if joint.dof == dof]
        leader = next((joint for joint in moved if joint.name == self.dof_names[dof]), moved[0])
        return leader.kind == "prismatic"


_AROUND = 60  # capsules around a shape, at most; of a box of 1 m they stand out by some 25 mm


@cached_by_identity
def _in_capsules(robot: Robot) -> tuple[LinkCapsule, ...]:
    from spacearm.robot.capsule_fit import enclosing_capsules

    out: list[LinkCapsule] = []
    for part in robot.shapes:
        found = (
            [part] if as_capsule(part) else [replace(part, shape=one) for one in enclosing_capsules([part.shape], _AROUND)[0]]
        )
        out += [one for one in map(as_capsule, found) if one is not None]
    return tuple(out)


def require_base(base: Any) -> None:
    """Check whether a base is fixed or floats.

    Raises:
        RobotError: anything but "fixed" and "floating".
    """
    if not isinstance(base, str) or base not in BASE_KINDS:
        raise RobotError(f"base is {shown(base)}, expected one of {', '.join(map(repr, BASE_KINDS))}")


def _members(what: str, items: Any, kind: type) -> tuple[Any, ...]:
    if not isinstance(items, Iterable) or isinstance(items, (str, bytes)):
        raise RobotError(f"{what} is {shown(items)}, expected a list{'' if kind is object else f' of {kind.__name__}'}")
    members = tuple(items)
    for i, item in enumerate(members):
        if not isinstance(item, kind):
            raise RobotError(f"{what}[{i}] is {shown(item)}, expected a {kind.__name__}")
    return members


def _number_dofs(joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    free = 0
    numbered = []
    for joint in joints:
        numbered.append(replace(joint, dof=free) if joint.dof < 0 else joint)
        # A joint that follows another one asks for no index of its own.
        free += joint.dof < 0 or joint.dof == free
    return tuple(numbered)


def _own_names(joints: tuple[Joint, ...]) -> tuple[str, ...]:
    # A dof is called after the joint whose value it is; sorting is stable, so else after the first it moves.
    leaders = sorted(joints, key=lambda joint: (joint.multiplier, joint.offset) != (1.0, 0.0))
    names = {joint.dof: joint.name for joint in reversed(leaders)}
    return tuple(names[dof] for dof in sorted(names))


def _require_unique(what: str, names: list[str]) -> None:
    name, count = Counter(names).most_common(1)[0] if names else ("", 0)
    if count > 1:
        raise RobotError(f"{what} name '{name}' is used {count} times, expected once; rename the others")


def _require_tree(joints: tuple[Joint, ...], parts: tuple[Frame | LinkShape | Body | LinkVisual, ...]) -> None:
    for i, joint in enumerate(joints):
        if joint.parent >= i:
            raise RobotError(
                f"joint '{joint.name}' (index {i}) has parent {joint.parent}, expected -1 or an index below "
                f"{i}; list parents before children"
            )
    for part in parts:
        if part.joint >= len(joints):
            what = {Frame: "frame", LinkShape: "shape", Body: "body", LinkVisual: "visual"}[type(part)]
            raise RobotError(f"{what} '{part.name}' rides on joint {part.joint}, expected -1 (base) to {len(joints) - 1}")


def _require_dofs_used(joints: tuple[Joint, ...], names: tuple[str, ...]) -> None:
    used = {joint.dof for joint in joints}
    if used != set(range(len(names))):
        raise RobotError(
            f"the joints use the dofs {sorted(used)}, expected each of 0 to {len(names) - 1}; give dof_names one name per dof"
        )
    for dof, name in enumerate(names):
        kinds = {joint.kind for joint in joints if joint.dof == dof}
        if len(kinds) > 1 and not any(joint.name == name for joint in joints):
            raise RobotError(f"dof '{name}' moves revolute and prismatic joints; name it after the one it measures")


def _checked_pairs(given: Any, links: set[str]) -> tuple[tuple[str, str], ...]:
    """Return the pairs once each, their names and themselves in order."""
    out: set[tuple[str, str]] = set()
    for pair in _members("self_pairs", given, object):
        if not isinstance(pair, (tuple, list)) or len(pair) != 2 or pair[0] == pair[1]:
            raise RobotError(f"self_pairs holds {shown(pair)}, expected the names of two links with an envelope")
        for name in pair:
            if not isinstance(name, str) or name not in links:
                raise RobotError(f"self_pairs names '{name}', which has no envelope; {nearest(str(name), links)}")
        out.add((min(pair), max(pair)))
    return tuple(sorted(out))


def _checked_coverage(robot: Robot) -> dict[str, Any]:
    if not isinstance(robot.collision, str) or robot.collision not in COLLISIONS:
        raise RobotError(f"collision is {shown(robot.collision)}, expected one of {', '.join(map(repr, COLLISIONS))}")
    if robot.apart is not None and not isinstance(robot.apart, ApartPairs):
        raise RobotError(f"apart is {shown(robot.apart)}, expected ApartPairs(...), or None")
    keep(robot, unchecked=_members("unchecked", robot.unchecked, UncheckedPair))
    solid = tuple(dict.fromkeys(_members("solid", robot.solid, str)))
    keep(robot, unweighed=_members("unweighed", robot.unweighed, object))
    return {**settled_pairs(robot), "solid": solid, "unweighed": known_unweighed(robot)}


def _checked_configurations(robot: Robot) -> tuple[NamedConfiguration, ...]:
    named = _members("configurations", robot.configurations, NamedConfiguration)
    _require_unique("configuration", [configuration.name for configuration in named])
    advice = f"give one number per joint: {', '.join(robot.dof_names)}"
    for configuration in named:
        as_readonly(f"configuration '{configuration.name}'", configuration.q, (robot.dof,), RobotError, advice=advice)
    return named


def _checked_limits(robot: Robot) -> dict[str, Array]:
    advice = f"give one number per joint: {', '.join(robot.dof_names)}"
    limits = {
        name: as_readonly(name, getattr(robot, name), (robot.dof,), RobotError, finite=finite, advice=advice)
        for name, finite in (("lower", False), ("upper", False), ("velocity", True), ("acceleration", True))
    }
    for i, name in enumerate(robot.dof_names):
        low, high = limits["lower"][i], limits["upper"][i]
        if not low <= high or low == np.inf or high == -np.inf:
            raise RobotError(f"joint '{name}' has lower limit {low:g} and upper limit {high:g}, expected lower <= upper")
        for what in ("velocity", "acceleration"):
            if not limits[what][i] > 0:
                raise RobotError(f"joint '{name}' has {what} limit {limits[what][i]:g}, expected more than 0")
    return limits


def require_robot(robot: Any) -> None:
    """Refuse what is no robot.

    Raises:
        RobotError: it is none.
    """
    require_kind("robot", robot, Robot, RobotError, advice="make one with load_robot(...)")


def robot_as_dict(robot: Robot) -> dict[str, Any]:
    """Return a robot as plain values: a key for each of its attributes; null is the limit of a joint that has none.

    A robot whose shapes are all spheres and capsules has `capsules` in place of `shapes`.
    """
    out: dict[str, Any] = {}
    for name in value_fields(robot):
        if name != "shapes":
            out[name] = plain(getattr(robot, name))
        elif all(as_capsule(part) is not None for part in robot.shapes):
            out["capsules"] = plain(robot.capsules)
        else:
            out[name] = [part_as_dict(part) for part in robot.shapes]
    return out


def robot_from_dict(values: Any) -> Robot:
    """Make a robot of plain values, the same bit for bit as the one that `robot_as_dict` was given.

    Raises:
        RobotError: values that are no robot; the place is named.
    """
    if isinstance(values, dict):
        values = dict(values)
        parts = [part_of_capsule(one, f"capsules[{i}]") for i, one in enumerate(_listed(values, "capsules"))]
        parts += [part_from_dict(one, f"shapes[{i}]") for i, one in enumerate(_listed(values, "shapes"))]
        if parts:
            values["shapes"] = parts
    return record_from_dict(Robot, values, "robot", RobotError, infinite={"lower": -math.inf, "upper": math.inf})


def _listed(values: dict[str, Any], key: str) -> list[Any]:
    """Take a list out of plain values."""
    items = values.pop(key, [])
    if not isinstance(items, (list, tuple)):
        raise RobotError(f"{key} is {shown(items)}, expected a list")
    return list(items)
