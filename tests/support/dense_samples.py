"""The clearance along a trajectory at very many instants: NumPy for all of them, Coal and Pinocchio for the closest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st

from spacearm.geometry import Scene, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.proof import PairClearance
from spacearm.robot import Frame, Joint, LinkCapsule, Robot
from support import strategies
from support.drawn_motions import motions_of
from support.oracles.coal_shapes import clearances
from support.oracles.pinocchio_points import joint_frames


class Setting(NamedTuple):
    """What a proof is asked about."""

    robot: Robot
    scene: Scene
    clearance: float = 0.0
    clearances: tuple[PairClearance, ...] = ()


def moving_frames(robot: Robot, q: np.ndarray) -> np.ndarray:
    """T_base_joint (rows, joints, 4, 4) from the definition of Robot."""
    placed: list[np.ndarray] = []
    for joint in robot.joints:
        value = joint.multiplier * q[:, joint.dof] + joint.offset
        T = np.tile(np.eye(4), (len(q), 1, 1))
        if joint.kind == "revolute":
            c, s = np.cos(value), np.sin(value)
            T[:, 0, 0], T[:, 0, 1], T[:, 1, 0], T[:, 1, 1] = c, -s, s, c
        else:
            T[:, 2, 3] = value
        before = joint.T_parent_joint if joint.parent < 0 else placed[joint.parent] @ joint.T_parent_joint
        placed.append(before @ T)
    return np.stack(placed, axis=1)


def capsule_ends(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both ends of every capsule's axis, (rows, capsules, 3) each [m]."""
    frames = moving_frames(robot, q)
    base = np.tile(np.eye(4), (len(q), 1, 1))
    ends = []
    for name in ("a", "b"):
        columns = []
        for link in robot.capsules:
            T = base if link.joint < 0 else frames[:, link.joint]
            columns.append(T[:, :3, :3] @ getattr(link, name) + T[:, :3, 3])
        ends.append(np.stack(columns, axis=1) if columns else np.zeros((len(q), 0, 3)))
    return ends[0], ends[1]


def dense_clearances(setting: Setting, q: np.ndarray) -> np.ndarray:
    """Signed distances (rows, capsules, balls) [m]: from a centre to a segment, less both radii."""
    a, b = capsule_ends(setting.robot, q)
    axis = b - a
    squared = (axis**2).sum(axis=-1)
    out = []
    for ball in setting.scene.obstacles:
        left = ball.center - a
        along = np.divide((left * axis).sum(axis=-1), squared, out=np.zeros_like(squared), where=squared > 0)
        nearest = left - np.clip(along, 0, 1)[..., None] * axis
        radii = np.array([link.radius for link in setting.robot.capsules]) + ball.radius
        out.append(np.linalg.norm(nearest, axis=-1) - radii)
    return np.stack(out, axis=-1)


def least_clearance(setting: Setting, trajectory: Trajectory, instants: int, seed: int) -> float:
    """The least of 20,000 or so random instants [m], by Coal at the closest of them."""
    s = np.sort(np.random.default_rng(seed).uniform(0, 1, instants))
    q = trajectory.sample(s * trajectory.duration).q
    coarse = dense_clearances(setting, q).min(axis=(1, 2))
    closest = q[np.argsort(coarse)[:5]]
    exact = clearances(joint_frames(setting.robot, closest), setting.robot.capsules, setting.scene.obstacles)
    np.testing.assert_allclose(exact.min(axis=(1, 2)), np.sort(coarse)[:5], rtol=0, atol=1e-7)
    return float(exact.min())


@st.composite
def arms(draw: st.DrawFn, *, self_pairs: bool = False) -> Robot:
    """Drawn trees with at least one capsule; in some a joint follows another, in some links must keep clear of each other."""
    robot = draw(strategies.robots(min_joints=1, max_joints=4))
    count = len(robot.joints)
    capsules = tuple(draw(st.lists(strategies.capsules(count), min_size=1, max_size=4)))
    joints, kept = list(robot.joints), count
    if count >= 2 and draw(st.booleans()):
        last = joints[-1]
        multiplier = draw(st.sampled_from([-1.0, 0.5, 2.0, 0.0]))
        joints[-1] = Joint(
            name=last.name,
            kind=last.kind,
            parent=last.parent,
            T_parent_joint=last.T_parent_joint,
            dof=0,
            multiplier=multiplier,
            offset=draw(st.sampled_from([0.0, 0.3])),
        )
        kept -= 1
    joints = [joint if joint.dof == 0 else Joint(**{**fields(joint), "dof": -1}) for joint in joints]
    return Robot(
        name="drawn",
        joints=tuple(joints),
        capsules=capsules,
        frames=robot.frames,
        tip="tip",
        **{name: getattr(robot, name)[:kept] for name in ("lower", "upper", "velocity", "acceleration")},
        self_pairs=tuple(draw(_pairs(sorted({capsule.name for capsule in capsules})))) if self_pairs else (),
    )


def _pairs(links: list[str]) -> st.SearchStrategy[list[tuple[str, str]]]:
    every = [(one, other) for i, one in enumerate(links) for other in links[i + 1 :]]
    return st.lists(st.sampled_from(every), unique=True) if every else st.just([])


def fields(joint: Joint) -> dict[str, object]:
    return {name: getattr(joint, name) for name in ("name", "kind", "parent", "T_parent_joint", "multiplier", "offset")}


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    robot = draw(arms())
    return Trajectory(robot, draw(motions_of(robot, most=3)))


@st.composite
def on_the_way(draw: st.DrawFn, trajectory: Trajectory, gap: float, radius: float) -> Sphere:
    """A sphere so far from the surface of a link, at an instant and a side that are drawn."""
    s = draw(st.floats(0, 1))
    a, b = capsule_ends(trajectory.robot, trajectory.sample(np.array([s * trajectory.duration])).q)
    link = draw(st.integers(0, len(trajectory.robot.capsules) - 1))
    along = draw(st.floats(0, 1))
    point, axis = a[0, link] + along * (b - a)[0, link], (b - a)[0, link]
    side = np.cross(axis, draw(strategies.points())) if axis.any() else draw(strategies.points())
    length = np.linalg.norm(side)
    side = side / length if length > 1e-9 else np.zeros(3)
    reach = trajectory.robot.capsules[link].radius + gap + radius
    return Sphere(point + reach * side, radius)


def planar(**changes: object) -> Robot:
    """Two links of 1 m in the plane, 5 cm thick, each joint free to turn half way."""
    shift = np.eye(4)
    shift[0, 3] = 1.0
    given: dict[str, object] = {
        "name": "planar",
        "joints": (
            Joint(name="shoulder", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
            Joint(name="elbow", kind="revolute", parent=0, T_parent_joint=shift),
        ),
        "capsules": tuple(
            LinkCapsule(name=name, joint=i, a=np.zeros(3), b=np.array([1.0, 0, 0]), radius=0.05)
            for i, name in enumerate(("upper", "fore"))
        ),
        "frames": (
            Frame(name="base", joint=-1, T_joint_frame=np.eye(4)),
            Frame(name="hand", joint=1, T_joint_frame=shift),
        ),
        "tip": "hand",
        "lower": (-np.pi, -np.pi),
        "upper": (np.pi, np.pi),
        "velocity": (1.0, 1.0),
        "acceleration": (1.0, 1.0),
    }
    return Robot(**{**given, **changes})  # type: ignore[arg-type]


def swing(start: float, goal: float, elbow: float = 0.0) -> Motion:
    """The planar arm turning at the shoulder, stretched unless told otherwise."""
    return Motion([[start, elbow], [goal, elbow]])
