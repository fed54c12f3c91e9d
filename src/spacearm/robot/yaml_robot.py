"""Robots as YAML: the format of the built-in ones, and of any other arm.

Key by key::

    spacearm-robot: 1          # format and version
    name: my_arm               # for people
    notes: [...]               # optional sentences: where the numbers are from, what was assumed
    base: floating             # how the base is held, unless a problem says otherwise: fixed (default) or floating
    tip: hand                  # the link that is the end effector; optional where there is one chain
    link_radius: 0.05          # optional: the radius of capsules that state none [m]
    joints:
      - name: elbow            # unique
        kind: revolute         # revolute, continuous (turns without end), prismatic or fixed
        parent: upper_arm      # a link; links exist by being named, and one, the base, is no joint's child
        child: forearm         # the link that the joint moves
        xyz: [0, 0.6, 0]       # origin of the child's frame in the parent's at value 0 [m]; default 0 0 0
        rpy: [0, 0, 1.57]      # its orientation: turns about the parent's fixed x, y, z [rad]; default 0 0 0
        rpy_deg: [0, 0, 90]    #   or in degrees
        axis: [0, 0, 1]        # direction of the axis in the child's frame; any joint but fixed needs it
        lower: -1.5            # limits [rad, or m for a prismatic joint]; revolute and prismatic need them
        upper: 1.5
        lower_deg: -90         #   or in degrees
        upper_deg: 90
        velocity: 1.0          # limit [rad/s or m/s]
        acceleration: 1.0      # limit [rad/s^2 or m/s^2]; default: full speed within one second
        mimic: {joint: shoulder, multiplier: -1, offset: 0}   # follows another joint; default 1 and 0
    capsules:                  # optional: what encloses the links; the segment's ends in the link's frame [m]
      - {link: forearm, from: [0, 0, 0], to: [0, 0.4, 0], radius: 0.05}
    boxes:                     # optional: boxes on the links, each enclosed in parallel capsules
      - {link: panel, size: [3, 6, 0.1], xyz: [0, 4, 0], rpy_deg: [0, 0, 0], capsules: 9}
                               #   edges and centre [m]; rpy [rad] instead of rpy_deg; capsules: how many at most
    masses:                    # optional: of links, each once
      - {link: forearm, mass: 12, com: [0, 0.2, 0], inertia: [0.2, 0.1, 0.2, 0, 0, 0]}
                               #   [kg]; centre of mass in the link's frame [m], default 0 0 0; moments about that centre along
                               #   the axes of the link's frame: the matrix's entries xx, yy, zz, xy, xz, yz [kg m^2]
    configurations:            # optional: named ones
      - {name: home, q: [0, 0.5]}        # a value for each joint that moves and follows no other, in the order of joints
      - {name: out, q_deg: [0, 90]}      #   or in degrees where all of them turn
    self_collision: none       # optional: computed, or the pairs of links that must keep clear: [[base, forearm], ...]

A link's frame is that of the joint whose child it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_number, as_readonly, shown
from spacearm.errors import RobotError, nearest
from spacearm.reading import YamlFile
from spacearm.robot.links import LinkJoint, LinkMass, LinkTree, Mimic
from spacearm.robot.yaml_parts import Stated, capsules_of_box, link_mass, placed, radians, require_link, stated_configuration

if TYPE_CHECKING:
    from spacearm.robot.yaml_schema import CapsuleModel, JointModel, RobotModel

Array = NDArray[np.float64]


def tree_from_yaml(file: YamlFile, *, source: str, capsules_per_shape: int) -> LinkTree:
    """Make a tree of links from a robot file.

    Args:
        file: the file, read.
        source: how the robot is to name its origin.
        capsules_per_shape: how many capsules may enclose a box that does not say it.

    Raises:
        FileFormatError: keys or values that are not those of the format.
        RobotError: numbers that make no joint, capsule, box, mass or configuration.
    """
    from spacearm.robot.yaml_schema import RobotModel

    model = file.parsed(RobotModel)
    joints = []
    for i, joint in enumerate(model.joints):
        with file.at("joints", i):
            joints.append(_joint(joint))
    links = tuple(dict.fromkeys(link for joint in joints for link in (joint.parent, joint.child)))
    capsules = []
    for i, capsule in enumerate(model.capsules):
        with file.at("capsules", i):
            capsules.append(_capsule(capsule, links, model.link_radius))
    for i, box in enumerate(model.boxes):
        with file.at("boxes", i):
            capsules += capsules_of_box(box, links, capsules_per_shape)
    masses: list[LinkMass] = []
    for i, mass in enumerate(model.masses):
        with file.at("masses", i):
            masses.append(link_mass(mass, links, [other.link for other in masses]))
    configurations: list[Stated] = []
    for i, configuration in enumerate(model.configurations):
        with file.at("configurations", i):
            configurations.append(stated_configuration(configuration, joints, [name for name, _ in configurations]))
    return LinkTree(
        name=model.name,
        links=links,
        joints=tuple(joints),
        capsules=tuple(capsules),
        self_collision=_self_collision(file, model, links),
        masses=tuple(masses),
        base=model.base,
        configurations=tuple(configurations),
        tip=model.tip,
        source=source,
        notes=tuple(model.notes),
    )


def _self_collision(file: YamlFile, model: RobotModel, links: tuple[str, ...]) -> str | tuple[tuple[str, str], ...]:
    if isinstance(model.self_collision, str):
        return model.self_collision
    enclosed = {shape.link for shape in (*model.capsules, *model.boxes)}
    for i, pair in enumerate(model.self_collision):
        with file.at("self_collision", i):
            if len(pair) != 2 or pair[0] == pair[1]:
                raise RobotError(f"self_collision[{i}] is {shown(pair)}, expected the names of two different links")
            for link in pair:
                if link not in enclosed:
                    lack = "has no capsules" if link in links else "does not exist"
                    raise RobotError(
                        f"self_collision[{i}] names link '{link}', which {lack}; {nearest(link, sorted(enclosed))}"
                    )
    return tuple((pair[0], pair[1]) for pair in model.self_collision)


def _joint(joint: JointModel) -> LinkJoint:
    where = f"joint '{joint.name}'"
    if joint.kind != "fixed" and joint.axis is None:
        raise RobotError(f"{where} ({joint.kind}) has no axis, expected a direction; add one such as axis: [0, 0, 1]")
    return LinkJoint(
        name=joint.name,
        kind=joint.kind,
        parent=joint.parent,
        child=joint.child,
        T_parent_child=placed(where, joint),
        axis=None if joint.axis is None else as_readonly(f"{where}: axis", joint.axis, (3,), RobotError),
        lower=_limit(where, joint, "lower"),
        upper=_limit(where, joint, "upper"),
        velocity=joint.velocity,
        acceleration=_positive(where, "acceleration", joint.acceleration),
        mimic=None
        if joint.mimic is None
        else Mimic(leader=joint.mimic.joint, multiplier=joint.mimic.multiplier, offset=joint.mimic.offset),
    )


def _limit(where: str, joint: JointModel, key: str) -> Any:
    if joint.kind == "prismatic" and getattr(joint, f"{key}_deg") is not None and getattr(joint, key) is None:
        raise RobotError(f"{where} is prismatic and states {key}_deg; write {key} [m]")
    return radians(where, joint, key)


def _positive(where: str, what: str, value: float | None) -> float | None:
    return None if value is None else as_number(f"{where}: {what}", value, RobotError, above=0)


def _capsule(capsule: CapsuleModel, links: tuple[str, ...], link_radius: float | None) -> tuple[str, Array, Array, float]:
    where = f"capsule of link '{capsule.link}'"
    require_link(where, capsule.link, links)
    radius = link_radius if capsule.radius is None else capsule.radius
    if radius is None:
        raise RobotError(f"{where} states no radius; add radius [m], or link_radius for all")
    return (
        capsule.link,
        as_readonly(f"{where}: from", capsule.start, (3,), RobotError),
        as_readonly(f"{where}: to", capsule.end, (3,), RobotError),
        as_number(f"{where}: radius", radius, RobotError, at_least=0, unit="m"),
    )
