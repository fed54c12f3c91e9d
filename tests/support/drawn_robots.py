"""Robots as files have them, drawn; and a checker of its own, which knows only what was drawn.

A draft is links, joints and pairs as plain numbers. It is written as a URDF (and an SRDF that forgets pairs), which spacearm
loads. What spacearm then calls proven is measured here: forward kinematics and distances of capsules in NumPy, from the
draft's numbers and the joints' names alone, for every pair of links that the certificate does not name as not checked.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from spacearm.core.errors import SpacearmError
from spacearm.dynamics import hold
from spacearm.geometry import Capsule, Scene, Sphere
from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.motion.recorded import robot_in_order
from spacearm.planner import PlannerSettings, Problem, plan
from spacearm.proof import Certificate, certify
from spacearm.robot import Robot, find_self_pairs, load_robot

Array = np.ndarray

TOUCH = 1e-7  # relative to the robot's size: penetration that is rounding
_LIMIT = 1e-6  # relative: a limit that is missed by less is rounding


@dataclass(kw_only=True)
class DraftJoint:
    """A joint as the URDF has it."""

    name: str
    parent: str
    child: str
    kind: str
    T: Array
    axis: Array
    lower: float = 0.0
    upper: float = 0.0
    velocity: float = 1.0
    mimic: tuple[str, float, float] | None = None


@dataclass(kw_only=True)
class Draft:
    """A robot, its obstacles, and what was changed after it was loaded."""

    links: list[str]
    joints: list[DraftJoint]
    capsules: dict[str, list[tuple[Array, Array, float]]]  # in the link's frame [m]
    drawn: set[str]  # links with a drawn shape and none for collision
    size: float
    srdf: set[tuple[str, str]] | None = None
    held: tuple[str, Any] | None = None  # the link that holds it, and the shape
    touching: tuple[str, ...] = ()
    grown: float = 0.0  # added to all radii after loading [m]
    balls: list[tuple[Array, Array, float]] = field(default_factory=list)  # obstacles


def drawn_robot(rng: np.random.Generator) -> Draft:
    """Draw a robot of 2 to 6 joints: slides, mimics, fixed links, any size, links without shapes."""
    size = float(10 ** rng.choice([0.0, 0.0, 0.0, -2.0, 2.0]))
    count = int(rng.integers(2, 7))
    links, joints, moving = ["link_0"], [], []
    capsules: dict[str, list[tuple[Array, Array, float]]] = {}
    for i in range(count):
        parent = links[-1] if rng.random() < 0.8 else links[int(rng.integers(len(links)))]
        child = f"link_{i + 1}"
        links.append(child)
        joints.append(_drawn_joint(rng, f"joint_{i}", parent, child, moving, size))
        if joints[-1].kind != "fixed" and joints[-1].mimic is None:
            moving.append(joints[-1])
    if not moving:
        joints[0] = replace(joints[0], kind="revolute", lower=-1.5, upper=1.5, mimic=None)
    drawn = set()
    for link in links:
        what = rng.random()
        if what < 0.75 or link == links[-1]:
            capsules[link] = [_drawn_capsule(rng, size) for _ in range(int(rng.integers(1, 3)))]
        elif what < 0.9:
            drawn.add(link)
    draft = Draft(links=links, joints=joints, capsules=capsules, drawn=drawn, size=size)
    if rng.random() < 0.5:
        pairs = [tuple(sorted((joint.parent, joint.child))) for joint in joints]
        draft.srdf = {pair for pair in pairs if rng.random() < 0.8}  # it forgets some
    for _ in range(int(rng.integers(0, 4))):
        at = rng.normal(size=3) * size * 1.2
        draft.balls.append((at, at + rng.normal(size=3) * size * 0.3 * (rng.random() < 0.5), size * rng.uniform(0.02, 0.2)))
    return draft


def _drawn_joint(
    rng: np.random.Generator, name: str, parent: str, child: str, moving: list[DraftJoint], size: float
) -> DraftJoint:
    kind = str(rng.choice(["revolute", "revolute", "revolute", "continuous", "prismatic", "fixed"]))
    T = np.eye(4)
    T[:3, 3] = np.round(rng.normal(size=3) * 0.3 * size, 6)
    T[2, 3] += 0.4 * size
    T[:3, :3] = rotation(rng.choice([0.0, 1.5707963267948966, 0.4, -2.0], size=3))
    axis = np.eye(3)[int(rng.integers(3))] * rng.choice([-1.0, 1.0]) if rng.random() < 0.8 else rng.normal(size=3)
    joint = DraftJoint(name=name, parent=parent, child=child, kind=kind, T=T, axis=axis, velocity=float(rng.uniform(0.2, 2)))
    reach = size if kind == "prismatic" else float(rng.choice([0.3, 1.5, 3.0]))
    joint.lower, joint.upper = -reach * float(rng.uniform(0.2, 1)), reach * float(rng.uniform(0.2, 1))
    if rng.random() < 0.05:
        joint.lower = joint.upper = 0.1 * reach  # locked
    if moving and kind in ("revolute", "prismatic") and rng.random() < 0.2:
        leader = moving[int(rng.integers(len(moving)))]
        if leader.kind != "continuous":
            joint.mimic = (leader.name, float(rng.choice([1.0, -1.0, 0.5, 2.0])), 0.0)
            joint.lower, joint.upper = -100.0 * size, 100.0 * size
            joint.velocity = 100.0
    return joint


def _drawn_capsule(rng: np.random.Generator, size: float) -> tuple[Array, Array, float]:
    a = rng.normal(size=3) * 0.08 * size
    b = a if rng.random() < 0.4 else a + rng.normal(size=3) * 0.15 * size
    return np.round(a, 6), np.round(b, 6), float(np.round(rng.uniform(0.02, 0.08) * size, 6))


# ---- as files --------------------------------------------------------------------------------------------------------------
def urdf_of(draft: Draft) -> str:
    """Write a draft as a URDF; each capsule is a cylinder with a sphere on each end, whose envelope is exact."""
    parts = []
    for link in draft.links:
        shapes = "".join(_shapes_of(*capsule) for capsule in draft.capsules.get(link, ()))
        if link in draft.drawn:
            shapes = f'<visual><geometry><sphere radius="{0.05 * draft.size!r}"/></geometry></visual>'
        parts.append(f'<link name="{link}">{shapes}</link>')
    for joint in draft.joints:
        inside = f'<parent link="{joint.parent}"/><child link="{joint.child}"/>{_origin(joint.T)}'
        if joint.kind != "fixed":
            inside += f'<axis xyz="{_words(joint.axis)}"/>'
            inside += f'<limit lower="{joint.lower!r}" upper="{joint.upper!r}" velocity="{joint.velocity!r}" effort="1"/>'
        if joint.mimic is not None:
            leader, multiplier, offset = joint.mimic
            inside += f'<mimic joint="{leader}" multiplier="{multiplier!r}" offset="{offset!r}"/>'
        parts.append(f'<joint name="{joint.name}" type="{joint.kind}">{inside}</joint>')
    return f'<robot name="drawn">{"".join(parts)}</robot>'


def srdf_of(draft: Draft) -> str:
    """Write the pairs that may touch."""
    pairs = "".join(f'<disable_collisions link1="{a}" link2="{b}" reason="Adjacent"/>' for a, b in sorted(draft.srdf or ()))
    return f'<robot name="drawn">{pairs}</robot>'


def _shapes_of(a: Array, b: Array, radius: float) -> str:
    def shape(T: Array, geometry: str) -> str:
        return f"<collision>{_origin(T)}<geometry>{geometry}</geometry></collision>"

    at_a, at_b, between = np.eye(4), np.eye(4), np.eye(4)
    at_a[:3, 3], at_b[:3, 3] = a, b
    ball = f'<sphere radius="{radius!r}"/>'
    length = float(np.linalg.norm(b - a))
    if length == 0:
        return shape(at_a, ball)
    z = (b - a) / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    between[:3, :3], between[:3, 3] = np.column_stack([x, np.cross(z, x), z]), (a + b) / 2
    return shape(between, f'<cylinder radius="{radius!r}" length="{length!r}"/>') + shape(at_a, ball) + shape(at_b, ball)


def rotation(rpy: Array) -> Array:
    """Return the matrix of turns about the fixed x, y and z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ]
    )


def _origin(T: Array) -> str:
    pitch = math.atan2(-T[2, 0], math.hypot(T[0, 0], T[1, 0]))
    if math.hypot(T[0, 0], T[1, 0]) > 1e-9:
        roll, yaw = math.atan2(T[2, 1], T[2, 2]), math.atan2(T[1, 0], T[0, 0])
    else:
        roll, yaw = math.atan2(-T[1, 2], T[1, 1]), 0.0
    return f'<origin xyz="{_words(T[:3, 3])}" rpy="{roll!r} {pitch!r} {yaw!r}"/>'


def _words(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)


# ---- the checker -----------------------------------------------------------------------------------------------------------
def placed_capsules(draft: Draft, values: dict[str, float]) -> dict[str, list[tuple[Array, Array, float]]]:
    """Return where all capsules are, link by link, at values of the joints that lead."""
    T = {draft.links[0]: np.eye(4)}
    waiting = list(draft.joints)
    while waiting:
        joint = next(joint for joint in waiting if joint.parent in T)
        waiting.remove(joint)
        T[joint.child] = T[joint.parent] @ joint.T @ _moved(joint, joint_value(joint, values))
    capsules = dict(draft.capsules)
    if draft.held is not None:
        link, (a, b, radius) = draft.held
        T["held"], capsules["held"] = T[link], [(a, b, radius)]
    return {
        link: [(T[link][:3, :3] @ a + T[link][:3, 3], T[link][:3, :3] @ b + T[link][:3, 3], r + draft.grown) for a, b, r in own]
        for link, own in capsules.items()
    }


def joint_value(joint: DraftJoint, values: dict[str, float]) -> float:
    """Return a joint's value; mimics follow."""
    if joint.kind == "fixed":
        return 0.0
    if joint.mimic is not None:
        leader, multiplier, offset = joint.mimic
        return multiplier * values[leader] + offset
    return values[joint.name]


def _moved(joint: DraftJoint, value: float) -> Array:
    T = np.eye(4)
    if joint.kind == "fixed":
        return T
    n = joint.axis / np.linalg.norm(joint.axis)
    if joint.kind == "prismatic":
        T[:3, 3] = value * n
        return T
    K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    T[:3, :3] = np.eye(3) + math.sin(value) * K + (1 - math.cos(value)) * K @ K
    return T


def between(one: tuple[Array, Array, float], other: tuple[Array, Array, float]) -> float:
    """Return the signed distance of two capsules."""
    (a, b, r), (c, d, s) = one, other
    best = min(_point(a, c, d), _point(b, c, d), _point(c, a, b), _point(d, a, b))
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = u @ u, u @ v, v @ v, u @ w, v @ w
    determinant = uu * vv - uv * uv
    if determinant > 1e-14 * uu * vv:
        x, y = (uv * vw - vv * uw) / determinant, (uu * vw - uv * uw) / determinant
        if 0 <= x <= 1 and 0 <= y <= 1:
            best = min(best, float(np.linalg.norm(w + x * u - y * v)))
    return best - r - s


def _point(p: Array, a: Array, b: Array) -> float:
    along = b - a
    squared = along @ along
    share = min(max(float((p - a) @ along / squared), 0.0), 1.0) if squared > 0 else 0.0
    return float(np.linalg.norm(a + share * along - p))


def complaints(draft: Draft, certificate: Certificate, trajectory: Any, instants: int, *, limits: bool = True) -> list[str]:
    """List what is wrong with a certificate that holds, by the draft alone.

    Args:
        draft: of the robot.
        certificate: about it.
        trajectory: that it is about; its joints go by the names that its own robot has for them.
        instants: to look at.
        limits: the joints' limits were proven too.
    """
    names = trajectory.robot.dof_names
    unchecked = {one.links: one.reason for one in certificate.unchecked}
    out = _wrong_reasons(draft, unchecked)
    missing = (draft.drawn - set(draft.capsules)) - set(certificate.bare)
    if missing:
        out.append(f"links without an envelope are not named: {sorted(missing)}")
    if not certificate.holds:
        return out
    least, worst = math.inf, ""
    before: dict[str, float] | None = None
    times = np.linspace(0, trajectory.duration, instants)
    for t in times:
        values = dict(zip(names, trajectory.sample(float(t)).q.tolist(), strict=True))
        placed = placed_capsules(draft, values)
        for one, other in itertools.combinations(sorted(placed), 2):
            if (one, other) in unchecked:
                continue
            for x, y in itertools.product(placed[one], placed[other]):
                least, worst = min((least, worst), (between(x, y), f"{one} and {other} at t = {t:.6g}"))
        for (link, own), ball in itertools.product(placed.items(), draft.balls):
            for x in own:
                least, worst = min((least, worst), (between(x, ball), f"{link} and an obstacle at t = {t:.6g}"))
        if limits:
            out += _broken_limits(draft, values, before, times[1] - times[0])
        before = values
    if least < -TOUCH * draft.size:
        out.append(f"holds, but {worst} penetrate by {-least:.4g} m")
    return out


def _broken_limits(draft: Draft, values: dict[str, float], before: dict[str, float] | None, step: float) -> list[str]:
    out = []
    for joint in draft.joints:
        if joint.kind == "fixed":
            continue
        value, slack = joint_value(joint, values), _LIMIT * (abs(joint.upper - joint.lower) + 1e-3)
        if joint.kind != "continuous" and not joint.lower - slack <= value <= joint.upper + slack:
            out.append(f"{joint.name} is at {value:.9g}, beyond {joint.lower:.9g} to {joint.upper:.9g}")
        if before is not None and step > 0:
            rate = abs(value - joint_value(joint, before)) / step
            if rate > joint.velocity * (1 + _LIMIT):
                out.append(f"{joint.name} moves at {rate:.6g}, its limit is {joint.velocity:.6g}")
    return out[:3]


def _wrong_reasons(draft: Draft, unchecked: dict[tuple[str, str], str]) -> list[str]:
    """What was left out must be so for a reason that the draft confirms."""
    above = {joint.child: joint for joint in draft.joints}

    def moves(link: str) -> set[str]:
        on = draft.held[0] if link == "held" and draft.held is not None else link
        found = set()
        while on in above:
            if above[on].kind != "fixed":
                found.add(above[on].name)
            on = above[on].parent
        return found

    out = []
    for (one, other), reason in unchecked.items():
        tied = moves(one) == moves(other)
        allowed = draft.srdf is not None and (one, other) in draft.srdf
        held = "held" in (one, other)
        fits = {
            "rigid": tied,
            "allowed": allowed,
            "touching": held and (one in draft.touching or other in draft.touching),
            "adjacent": draft.srdf is None and not tied,
            "always": not tied and not held,
            "changed": not tied and not held,
            "not asked for": False,
        }
        if not fits[reason]:
            out.append(f"'{one}' and '{other}' are not checked: {reason}")
    return out


# ---- one number of a soak ----------------------------------------------------------------------------------------------------
def loaded(draft: Draft) -> Robot:
    """Load a draft through its files."""
    with TemporaryDirectory() as folder:
        urdf, srdf = Path(folder) / "drawn.urdf", Path(folder) / "drawn.srdf"
        urdf.write_text(urdf_of(draft), encoding="utf-8")
        srdf.write_text(srdf_of(draft), encoding="utf-8")
        return load_robot(
            urdf, srdf=srdf if draft.srdf is not None else None, tip=draft.links[-1], acceleration_limit=2.0, base="fixed"
        )


def look_at(seed: int, number: int, *, instants: int = 60) -> tuple[list[str], list[str]]:
    """Draw a robot, load it, change it, hold something, plan and certify.

    Returns:
        What is wrong, and what became of it, in a word each.
    """
    rng = np.random.default_rng((seed, number))
    draft = drawn_robot(rng)
    wrong, became = [], []
    try:
        robot = loaded(draft)
        robot = _changed(rng, draft, robot)
        scene = Scene([Sphere(a, r) if np.array_equal(a, b) else Capsule(a, b, r) for a, b, r in draft.balls])
        lower, upper = np.maximum(robot.lower, -3.0 * draft.size - 3), np.minimum(robot.upper, 3.0 * draft.size + 3)
        ends = rng.uniform(lower, upper, (4, robot.dof))
        near = ends[0] + (ends[1] - ends[0]) * rng.uniform(0.02, 1)
        found = plan(Problem(robot, scene, start=ends[0], goal=near), PlannerSettings(evaluations=300, proofs=3), rng=number)
        became.append(found.status)
        if found.certificate is not None and found.trajectory is not None:
            wrong += complaints(draft, found.certificate, found.trajectory, instants, limits=found.found)
        wrong += _certified(rng, draft, robot, scene, ends, became, instants)
    except SpacearmError as error:
        became.append("refused")
        if not any(words in str(error) for words in ("no envelope", "nothing can be planned", "no moving joint")):
            wrong.append(f"refused: {error}")
    return wrong, became


def _changed(rng: np.random.Generator, draft: Draft, robot: Robot) -> Robot:
    """Change a robot after it was loaded, and the draft with it."""
    what = rng.random()
    if what < 0.25:  # other limits, of joints that no other one follows
        leads = {joint.mimic[0] for joint in draft.joints if joint.mimic is not None}
        lower, upper = robot.lower.copy(), robot.upper.copy()
        for joint in draft.joints:
            if joint.name in robot.dof_names and joint.name not in leads and joint.kind == "revolute":
                i = robot.dof_names.index(joint.name)
                lower[i], upper[i] = joint.lower, joint.upper = -3.0, 3.0
        robot = replace(robot, lower=lower, upper=upper)
        return find_self_pairs(robot).applied_to(robot) if draft.srdf is None and rng.random() < 0.3 else robot
    if what < 0.4:
        draft.grown = float(rng.uniform(0, 0.05)) * draft.size
        grown = tuple(replace(capsule, radius=capsule.radius + draft.grown) for capsule in robot.capsules)
        return replace(robot, capsules=grown)
    if what < 0.6:
        a, b, radius = _drawn_capsule(rng, draft.size)
        shape = Sphere(a, radius) if np.array_equal(a, b) else Capsule(a, b, radius)
        draft.held = (draft.links[-1], (a, b, radius))
        draft.touching = tuple(link for link in draft.capsules if rng.random() < 0.4)
        return hold(robot, shape, touching=draft.touching)
    if what < 0.7:  # narrower limits keep what is apart
        middle = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
        return replace(robot, lower=middle + 0.7 * (robot.lower - middle), upper=middle + 0.7 * (robot.upper - middle))
    return robot


def _certified(
    rng: np.random.Generator, draft: Draft, robot: Robot, scene: Scene, ends: Array, became: list[str], instants: int
) -> list[str]:
    """Certify trajectories of others: beyond limits, and with the joints in another order."""
    wrong = []
    order = rng.permutation(robot.dof).tolist()
    other = robot_in_order(robot, order)
    problem = Problem(robot, scene, start=ends[0], goal=ends[0])
    share = float(rng.choice([0.02, 0.2, 1.0]))
    rows = ends[0] + share * (ends - ends[0]) * rng.uniform(0.5, 1.5, ends.shape)  # may be beyond the position limits
    path = PiecewisePath.from_cubic(np.arange(4) * 5.0, rows[:, order])
    recorded = RecordedTrajectory(other, path)
    found = certify(problem, recorded, limits=())
    became.append(f"certified {found.status}")
    wrong += complaints(draft, found, recorded, instants, limits=False)
    inside = np.clip(rows, robot.lower, robot.upper)[:, order]
    moved = Trajectory(other, Motion(inside))
    found = certify(problem, moved)
    became.append(f"certified {found.status}")
    return wrong + complaints(draft, found, moved, instants)
