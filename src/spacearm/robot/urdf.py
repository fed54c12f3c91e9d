"""URDF files, read through yourdfpy.

yourdfpy is lenient: it repairs broken XML without a word, lets a later link of the same name win, takes NaN
for a number, and answers a missing attribute with a bare KeyError. So the XML is checked here first
(`urdf_check`), and yourdfpy is handed only what spacearm uses: links with their collision shapes, and joints.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from spacearm.checks import shown_error
from spacearm.errors import FileFormatError, RobotError
from spacearm.reading import located, read_bytes
from spacearm.robot.links import LinkJoint, LinkTree, Mimic
from spacearm.robot.model import Robot
from spacearm.robot.tree import build_robot, require_collision

if TYPE_CHECKING:
    import yourdfpy


def load_urdf(
    path: str | os.PathLike[str],
    *,
    tip: str | None = None,
    velocity_limit: float | None = None,
    acceleration_limit: float | None = None,
    collision: Literal["urdf", "none"] = "urdf",
) -> Robot:
    """Read a robot from a URDF file.

    Fixed joints are folded away, mimic joints share the degree of freedom of the joint they follow, and q has
    the file's order of joints as far as parents come first. A rotation within 1e-9 of a signed permutation is
    taken as one. Collision shapes become capsules that enclose them (`envelope` says how).

    Args:
        path: the file.
        tip: name of the link that is the end effector; by default the last link of the chain.
        velocity_limit: no joint is to be faster [rad/s or m/s]; needed where the file states none, or 0.
        acceleration_limit: likewise [rad/s^2 or m/s^2]. URDF states none: the default is the number of each
            joint's velocity limit (full speed within one second), which the robot's notes tell.
        collision: "urdf" takes the envelope from the collision shapes, "none" leaves the robot without one.

    Raises:
        FileFormatError: no such file, or no URDF.
        RobotError: a robot that cannot be, or that spacearm does not support (planar and floating joints,
            loops); a mesh that cannot be read.
    """
    require_collision(collision)
    content = read_bytes(path, what="a URDF")
    with located(path):
        urdf = _parsed(content, with_collision=collision == "urdf")
        capsules = []
        if collision == "urdf":
            from spacearm.robot.envelope import link_capsules

            for link in urdf.links:
                capsules += link_capsules(link, Path(path).parent)
        tree = LinkTree(
            name=urdf.name,
            links=tuple(link.name for link in urdf.links),
            joints=tuple(_joint(joint) for joint in urdf.joints),
            capsules=tuple(capsules),
            tip=tip,
            source=str(path),
        )
        return build_robot(tree, velocity_limit=velocity_limit, acceleration_limit=acceleration_limit)


def _parsed(content: bytes, *, with_collision: bool) -> yourdfpy.Robot:
    import yourdfpy
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    from spacearm.robot.urdf_check import checked_root

    root = checked_root(content, with_collision=with_collision)
    try:
        urdf = yourdfpy.URDF.load(
            io.BytesIO(etree.tostring(root)),
            build_scene_graph=False,
            load_meshes=False,
            filename_handler=yourdfpy.urdf.filename_handler_null,
        )
    except Exception as error:  # yourdfpy documents no exceptions: KeyError, IndexError, ValueError were seen
        raise FileFormatError(f"this URDF cannot be read ({shown_error(error)}); correct the file") from error
    return urdf.robot


def _joint(joint: yourdfpy.Joint) -> LinkJoint:
    if joint.type in ("floating", "planar"):
        raise RobotError(
            f"joint '{joint.name}' is {joint.type}, expected revolute, continuous, prismatic or fixed; "
            "replace it by a chain of these"
        )
    limit: Any = joint.limit
    mimic: Any = joint.mimic
    stated = limit is not None
    return LinkJoint(
        name=joint.name,
        kind=str(joint.type),
        parent=str(joint.parent),
        child=str(joint.child),
        T_parent_child=np.eye(4) if joint.origin is None else joint.origin,
        axis=None if joint.type == "fixed" else joint.axis,
        lower=limit.lower if stated else None,
        upper=limit.upper if stated else None,
        velocity=limit.velocity if stated else None,
        mimic=None if mimic is None else Mimic(leader=mimic.joint, multiplier=mimic.multiplier, offset=mimic.offset),
    )
