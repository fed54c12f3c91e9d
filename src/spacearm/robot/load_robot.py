"""Robots by name or by file."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Literal

from numpy.typing import ArrayLike

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, RobotError, nearest
from spacearm.core.long_work import on_progress
from spacearm.core.reading import read_bytes, read_yaml
from spacearm.geometry.convex_pieces import PIECES
from spacearm.robot.assembly import Assembly, SelfCollision, assemble
from spacearm.robot.build_robot import require_collision
from spacearm.robot.envelope import LinkEnvelope, ShapeLimits
from spacearm.robot.link_tree import LinkTree
from spacearm.robot.model import Robot
from spacearm.robot.urdf import urdf_tree

_BUILTIN = resources.files("spacearm.robot") / "builtin"


def builtin_robots() -> tuple[str, ...]:
    """Return the names of the robots that come with spacearm."""
    return tuple(sorted(Path(entry.name).stem for entry in _BUILTIN.iterdir() if entry.name.endswith(".yaml")))


def load_robot(
    source: str | os.PathLike[str],
    *,
    srdf: str | os.PathLike[str] | None = None,
    group: str | None = None,
    fixed: Mapping[str, float] | None = None,
    tip: str | None = None,
    velocity_limit: float | Mapping[str, float] | ArrayLike | None = None,
    acceleration_limit: float | Mapping[str, float] | ArrayLike | None = None,
    position_limits: Mapping[str, tuple[float, float]] | None = None,
    joint_limits: str | os.PathLike[str] | None = None,
    collision: Literal["urdf", "none"] = "urdf",
    pieces_per_mesh: int | Mapping[str, int] = PIECES,
    excess: float | Mapping[str, float] | None = None,
    capsules_per_shape: int | None = None,
    self_collision: SelfCollision = "auto",
    base: Literal["fixed", "floating"] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Robot:
    """Load a robot that comes with spacearm, or one from a file.

    Args:
        source: a built-in robot's name, or the path of a URDF file or of a robot file (`robot_yaml` has its
            format).
        srdf: path of an SRDF file about the same robot: groups, named configurations, links that may touch.
        group: name of a group in it; only its joints move. Others stay where `fixed` puts them, else at 0 or
            the nearest to it that their limits allow, and the robot's notes say so.
        fixed: joints that are locked at a value [rad or m], by name; they are no part of q.
        tip: name of the link that is the end effector; by default the end of the group's chain, or of the
            robot's, of those that joints move; needed where there are several.
        velocity_limit: no joint is to be faster [rad/s or m/s]; needed where the file states no limit, or what means none: 0, a
            number below, one of 1e4 or more. A number holds for every joint, those that mimic others included; a mapping
            names joints; an array (n,) has one for each entry of q.
        acceleration_limit: likewise [rad/s^2 or m/s^2]; where neither the file nor this states one, a joint
            gets the number of its velocity limit (full speed within one second), and the robot's notes say
            so.
        position_limits: (lower, upper) [rad or m] by joint, within those of the file. A sliding joint whose file means none
            (1e4 m or more) needs them; a turning one is without end there.
        joint_limits: path of MoveIt's joint_limits.yaml; where it and the robot's file both state a limit, the narrower
            one holds.
        collision: "urdf" takes the envelope the file describes; "none" leaves the robot without one, on purpose. A robot
            that comes out without one otherwise is told in its notes, and not planned with.
        pieces_per_mesh: how many convex pieces may enclose one collision mesh of a URDF; a mapping names links. All of the mesh
            is inside them. Other shapes are taken as they are.
        excess: fewer pieces are used where these stand out of the mesh by no more than this [m]; a mapping names links. By
            default 2 % of the mesh's size. `envelope_report` tells by how much they do.
        capsules_per_shape: encloses every shape in capsules, at most this number each, as earlier versions did; they
            stand out of the shapes, by as much as the robot's notes tell. By default no capsules are put around anything.
        self_collision: which links must keep clear of each other. "srdf": all but those that the SRDF allows to
            touch, and those that meet in every configuration; "computed": those that `find_self_pairs` finds;
            "none". "auto" is the SRDF where there is one, else computed for a URDF and none for other robots.
        base: "fixed" or "floating", unless a problem says otherwise. By default as spacearm's own
            robot file says; else fixed, whatever an SRDF's virtual joint would allow, which a note tells.
        progress: called with a few words once a second, if loading takes longer than that.

    Raises:
        RobotError: no such built-in robot, group, joint or link, or a robot that cannot be.
        FileFormatError: a file that is missing, broken or of another format.
    """
    require_collision(collision)
    limits = ShapeLimits(pieces=pieces_per_mesh, excess=excess, capsules=capsules_per_shape)
    choices = Assembly(
        srdf=srdf,
        group=group,
        fixed=fixed,
        tip=tip,
        velocity_limit=velocity_limit,
        acceleration_limit=acceleration_limit,
        position_limits=position_limits,
        joint_limits=joint_limits,
        self_collision=self_collision,
        base=base,
    )
    with nullcontext() if progress is None else on_progress(progress):
        return assemble(_described(source, collision, limits), choices)


def envelope_report(
    source: str | os.PathLike[str],
    *,
    pieces_per_mesh: int | Mapping[str, int] = PIECES,
    excess: float | Mapping[str, float] | None = None,
    capsules_per_shape: int | None = None,
) -> tuple[LinkEnvelope, ...]:
    """Measure the envelope that `load_robot` gives to the links of a robot.

    Args:
        source: a built-in robot's name, or the path of a URDF file or of a robot file.
        pieces_per_mesh, excess, capsules_per_shape: as in `load_robot`.

    Returns:
        One record for each link with collision shapes. What stands out is a bound for meshes, and good to about two percent for
        capsules.

    Raises:
        FileFormatError: no such file, or no robot in it.
        RobotError: no such built-in robot, a mesh that cannot be read, or limits that are none.
    """
    limits = ShapeLimits(pieces=pieces_per_mesh, excess=excess, capsules=capsules_per_shape)
    return tuple(one.measured() for one in _described(source, "urdf", limits).envelopes)


def _described(source: str | os.PathLike[str], collision: Literal["urdf", "none"], limits: ShapeLimits) -> LinkTree:
    """Read the description of a robot, of whatever kind it is."""
    if isinstance(source, str) and _is_name(source):
        if source not in builtin_robots():
            raise RobotError(f"robot {shown(source)} is neither a file nor built in; {nearest(source, builtin_robots())}")
        with resources.as_file(_BUILTIN / f"{source}.yaml") as path:
            return _tree_of_robot_file(path, source, collision, limits)
    if _is_xml(source):
        return urdf_tree(source, collision=collision, limits=limits)
    return _tree_of_robot_file(source, str(source), collision, limits)


def _tree_of_robot_file(path: str | os.PathLike[str], source: str, collision: str, limits: ShapeLimits) -> LinkTree:
    from spacearm.robot.robot_yaml import tree_from_yaml

    file = read_yaml(path, key="spacearm-robot", what="a robot file")
    tree = tree_from_yaml(file, source=source, limits=limits)
    return replace(tree, shapes=(), envelopes=(), with_envelope=False) if collision == "none" else tree


def _is_name(source: str) -> bool:
    """Whether a string is to be a built-in robot's name; write ./name for a file that is called like one."""
    return source in builtin_robots() or not (Path(source).suffix or "/" in source or os.path.exists(source))


def _is_xml(source: str | os.PathLike[str]) -> bool:
    content = read_bytes(source, what="a robot: a URDF or a robot file")
    if content.lstrip(b"\xef\xbb\xbf\xff\xfe \0\t\r\n").startswith(b"<"):
        return True
    if Path(source).suffix.lower() in (".urdf", ".xml", ".xacro"):
        if b"<robot" in content:  # behind a line that a program printed
            return True
        raise FileFormatError(f"{source} holds no XML, expected a URDF (<robot ...>); check the path")
    return False
