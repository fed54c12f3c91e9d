"""The robot as the proof sees it: capsules on joints, a ball around each link, and what moves relative to what.

A *relative body* is a body watched from another one's frame, the base's included: the joints between the two, and only these,
move it there. Watched from the inertial frame, a body of a robot whose arm moves its base is moved by all joints.
Relative bodies come in families: the ball around a link, then the link's capsules, all watched from the same frame.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import RobotError
from spacearm.core.identity_cache import kept
from spacearm.robot import Robot
from spacearm.robot.model import inertia_fault
from spacearm.robot.unchecked_pairs import require_all_masses

# ---- The masses of a robot that floats, checked, as arrays and as a model of Pinocchio's whose base is free ----------

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_LARGEST = 1e12  # [kg, m, kg m^2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Masses:
    """The b bodies of a robot with j joints.

    Attributes:
        joint: (b,) each rides on, -1 for the base.
        mass: (b,) [kg].
        com: (b, 3) in the joint's frame [m].
        inertia: (b, 3, 3) about it, there [kg m^2].
        greatest, spread: (b,) its greatest moment, and by how much that exceeds the least [kg m^2].
        beyond: (j, b) 1 if a joint moves a body, else 0.
        base_least: the least moment of all that is bolted to the base, about its own centre of mass [kg m^2], above 0.
    """

    joint: Indices
    mass: Array
    com: Array
    inertia: Array
    greatest: Array
    spread: Array
    beyond: Array
    base_least: float

    @property
    def total(self) -> float:
        """[kg]."""
        return float(self.mass.sum())


@kept
def masses_of(robot: Robot) -> Masses:
    """Return a robot's masses.

    Raises:
        RobotError: links whose mass is not known; without mass or inertia of the base no momentum can be conserved, nor with
            an inertia that no body has.
    """
    joint = np.array([body.joint for body in robot.bodies], dtype=np.intp)
    mass = np.array([body.mass for body in robot.bodies])
    com = np.array([body.com for body in robot.bodies]).reshape(-1, 3)
    inertia = np.array([body.inertia for body in robot.bodies]).reshape(-1, 3, 3)
    largest = max(float(np.abs(array).max(initial=0.0)) for array in (mass, com, inertia))
    if largest > _LARGEST:
        raise RobotError(
            f"robot '{robot.name}' has a mass or an inertia with a number of {largest:.4g}, expected at most {_LARGEST:g}; "
            "check the units"
        )
    base = joint < 0
    if not mass[base].sum() > 0:
        raise RobotError(
            f"robot '{robot.name}' floats, and its base has no mass; give it one, or plan with base='fixed' "
            "('spacearm doctor' tells what is missing)"
        )
    moments = np.linalg.eigvalsh(inertia)
    for body, (least, _, _) in zip(robot.bodies, moments, strict=True):
        if inertia_fault(body.inertia) == "negative":
            raise RobotError(
                f"body '{body.name}' of robot '{robot.name}' has a moment of inertia of {least:.4g} kg m^2, expected none "
                "below 0; 'spacearm doctor' tells more"
            )
    middle = mass[base] @ com[base] / mass[base].sum()
    base_least = float(np.linalg.eigvalsh(inertia[base].sum(axis=0) + _points(mass[base], com[base] - middle))[0])
    if not base_least > 0:
        raise RobotError(
            f"the base of robot '{robot.name}' has a moment of inertia of {base_least:.4g} kg m^2, expected all above 0; "
            "'spacearm doctor' tells more"
        )
    require_all_masses(robot)
    beyond = np.zeros((len(robot.joints), len(mass)))
    for b, on in enumerate(joint.tolist()):
        while on >= 0:
            beyond[on, b] = 1.0
            on = robot.joints[on].parent
    return Masses(
        joint=joint,
        mass=mass,
        com=com,
        inertia=inertia,
        greatest=np.maximum(moments[:, 2], 0.0),
        spread=moments[:, 2] - moments[:, 0],
        beyond=beyond,
        base_least=base_least,
    )


@kept
def free_model(robot: Robot) -> tuple[Any, Indices, Indices]:
    """Return Pinocchio's model with a free base and all masses, and where the robot's joints are in its q and v."""
    import pinocchio  # pyright: ignore[reportMissingImports]

    model = pinocchio.Model()
    base = model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "the base, free")
    kinds = {"revolute": pinocchio.JointModelRZ, "prismatic": pinocchio.JointModelPZ}
    ids: list[int] = []
    for joint in robot.joints:
        parent = ids[joint.parent] if joint.parent >= 0 else base
        ids.append(model.addJoint(parent, kinds[joint.kind](), pinocchio.SE3(np.array(joint.T_parent_joint)), joint.name))
    for body in robot.bodies:
        inertia = pinocchio.Inertia(body.mass, np.array(body.com), np.array(body.inertia))
        model.appendBodyToJoint(ids[body.joint] if body.joint >= 0 else base, inertia, pinocchio.SE3.Identity())
    at_q = np.array([model.joints[i].idx_q for i in ids], dtype=np.intp)
    return model, at_q, np.array([model.joints[i].idx_v for i in ids], dtype=np.intp)


def _points(mass: Array, at: Array) -> Array:
    """Return the inertia (3, 3) of points of mass (b,) at (b, 3) about the origin."""
    squared = np.einsum("b,bc,bc->", mass, at, at)
    return squared * np.eye(3) - np.einsum("b,bc,bd->cd", mass, at, at)


# ---- -----------------------------------------------------------------------------------------------------------------
# The robot as the proof sees it: capsules on joints, a ball around each link, and what moves relative to what.


_INERTIAL = -2  # in place of the joint watched from
_OUTWARD = 1 + 1e-12  # a link's ball is made larger by more than its rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """The robot's c capsules, then a ball around each of its l links: b bodies.

    Attributes:
        capsules: c.
        ends: (b, e, 3) of the axes, in the frame of the joint each rides on [m]; e is 1 if all are balls, else 2.
        radius: (b,) [m].
        joint: (b,) the joint it rides on, -1 for the base.
        links: (c,) the link of each capsule.
        members: (c,) the capsules, link by link.
        first, count: (b,) where in `members` those inside of a link's ball are; count 0 for a capsule.
    """

    capsules: int
    ends: Array
    radius: Array
    joint: Indices
    links: Indices
    members: Indices
    first: Indices
    count: Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RelativeBodies:
    """m relative bodies, and the p relative motions that they share.

    Attributes:
        body: (m,) which body.
        motion: (m,) by which relative motion.
        count: (m,) how many of those after it are inside of it; 0 for a capsule.
        sign: (p, j) how each joint's rate counts in the motion: 1, -1 (it moves the frame watched from), or 0.
        order: (p, j, j) weights of the pairs of joints (k, i) in the second derivative; see docs/certificate.md.
        free: (p,) whether it is watched from the inertial frame while the arm moves the base. `sign` then tells which joints
            are between the base and the body, and `order` is for all joints.
        over_scene: (l,) those of the links' balls, watched from where the obstacles rest.
        self_relative, self_body: (s,) those of links' balls that must keep clear of the ball whose frame they are watched from.
    """

    body: Indices
    motion: Indices
    count: Indices
    sign: Array
    order: Array
    free: NDArray[np.bool_]
    over_scene: Indices
    self_relative: Indices
    self_body: Indices


@kept
def bodies_of(robot: Robot) -> tuple[Bodies, RelativeBodies]:
    """Return a robot's bodies, and the relative bodies for its obstacles and its pairs of links; its base stays."""
    bodies = _bodies(robot)
    return bodies, _relative_bodies(robot, bodies, scene=-1)


@kept
def bodies_in_space_of(robot: Robot) -> tuple[Bodies, RelativeBodies]:
    """Return the same of a robot whose base is moved by its arm."""
    bodies = _bodies(robot)
    return bodies, _relative_bodies(robot, bodies, scene=_INERTIAL)


def ancestors(robot: Robot) -> NDArray[np.bool_]:
    """Tell which joints i are between joint k and the base, [k, i] of (j, j)."""
    out = np.zeros((len(robot.joints),) * 2, dtype=bool)
    for k, joint in enumerate(robot.joints):
        out[k, _chain(robot, joint.parent)] = True
    return out


def _bodies(robot: Robot) -> Bodies:
    by_link: dict[tuple[str, int], list[int]] = defaultdict(list)
    for i, capsule in enumerate(robot.capsules):
        by_link[capsule.name, capsule.joint].append(i)
    inside = list(by_link.values())
    count = np.array([len(link) for link in inside], dtype=np.intp)
    members = np.array([i for link in inside for i in link], dtype=np.intp)
    links = np.zeros(len(members), dtype=np.intp)
    links[members] = np.repeat(np.arange(len(inside)), count)
    a, b = (np.array([getattr(c, end) for c in robot.capsules]).reshape(-1, 3) for end in ("a", "b"))
    radius = np.array([capsule.radius for capsule in robot.capsules])
    ends = np.stack([a, b], axis=1)
    balls = [_ball(ends[link], radius[link]) for link in inside]
    centers = np.array([center for center, _ in balls]).reshape(-1, 1, 3)
    ends = np.concatenate([ends, np.repeat(centers, 2, axis=1)])
    return Bodies(
        capsules=len(members),
        ends=ends[:, :1] if np.array_equal(a, b) else ends,
        radius=np.concatenate([radius, [r for _, r in balls]]),
        joint=np.array([c.joint for c in robot.capsules] + [joint for _, joint in by_link], dtype=np.intp),
        links=links,
        members=members,
        first=np.concatenate([np.zeros(len(members), np.intp), np.cumsum(count) - count]),
        count=np.concatenate([np.zeros(len(members), np.intp), count]),
    )


def _ball(ends: Array, radius: Array) -> tuple[Array, float]:
    """Return centre and radius of a ball around capsules (k, 2, 3)."""
    grown = radius[:, None, None]
    center = ((ends - grown).min(axis=(0, 1)) + (ends + grown).max(axis=(0, 1))) / 2
    return center, float((np.linalg.norm(ends - center, axis=2).max(axis=1) + radius).max()) * _OUTWARD


def _relative_bodies(robot: Robot, bodies: Bodies, *, scene: int) -> RelativeBodies:
    paths: dict[tuple[int, int], int] = {}  # (joint of the body, joint watched from) -> relative motion
    families: dict[tuple[int, int], int] = {}  # (link's ball, relative motion) -> its first relative body
    body: list[int] = []
    motion: list[int] = []

    def family(ball: int, watched_from: int) -> int:
        path = paths.setdefault((int(bodies.joint[ball]), watched_from), len(paths))
        if (ball, path) not in families:
            families[ball, path] = len(body)
            first = bodies.first[ball]
            body.extend([ball, *bodies.members[first : first + bodies.count[ball]].tolist()])
            motion.extend([path] * (len(body) - len(motion)))
        return families[ball, path]

    balls = range(bodies.capsules, len(bodies.radius))
    over_scene = [family(ball, scene) for ball in balls]
    named = defaultdict(list)
    for ball in balls:
        named[robot.capsules[bodies.members[bodies.first[ball]]].name].append(ball)
    pairs = []
    for one, other in robot.self_pairs:
        for near in named[one]:
            for far in named[other]:
                low, high = sorted((near, far), key=lambda ball: bodies.joint[ball])
                pairs.append((family(high, int(bodies.joint[low])), low))
    sign, order = _relative_motions(robot, list(paths))
    self_relative, self_body = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    return RelativeBodies(
        body=np.array(body, dtype=np.intp),
        motion=np.array(motion, dtype=np.intp),
        count=bodies.count[body] if body else np.zeros(0, np.intp),
        sign=sign,
        order=order,
        free=np.array([watched_from == _INERTIAL for _, watched_from in paths], dtype=bool),
        over_scene=np.array(over_scene, dtype=np.intp),
        self_relative=self_relative,
        self_body=self_body,
    )


def _relative_motions(robot: Robot, paths: list[tuple[int, int]]) -> tuple[Array, Array]:
    count = len(robot.joints)
    turns = np.array([joint.kind == "revolute" for joint in robot.joints])
    sign, order = np.zeros((len(paths), count)), np.zeros((len(paths), count, count))
    for p, (moved, watched_from) in enumerate(paths):
        up, down = _chain(robot, moved), _chain(robot, watched_from)
        shared = set(up) & set(down)
        # From the frame watched from towards the base, and from there out to the body.
        away = [k for k in reversed(down) if k not in shared] + [k for k in up if k not in shared]
        for place, k in enumerate(away):
            sign[p, k] = -1.0 if k in down else 1.0
            before = away[:place]
            order[p, k, before] = 2.0 * turns[before]
            order[p, k, k] = turns[k]
        if watched_from == _INERTIAL:
            order[p] = (2.0 * ancestors(robot) + np.eye(count)) * turns
    return sign, order


def _chain(robot: Robot, joint: int) -> list[int]:
    """Return the joints from the base out to one."""
    out = []
    while joint >= 0:
        out.append(joint)
        joint = robot.joints[joint].parent
    return out[::-1]
