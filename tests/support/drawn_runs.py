"""Runs, robots and trajectories to be drawn: small ones, made by hand."""

from __future__ import annotations

import numpy as np

from spacearm.geometry import Scene, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.robot import Frame, Joint, LinkCapsule, Robot
from spacearm.swarm import PSO, SwarmResult
from spacearm.swarm.ask_tell import SwarmHistory

SCENE = Scene([Sphere((0.9, 0.6, 0.0), 0.1), Sphere((0.2, 0.9, 0.1), 0.15)])


def run(
    fitness: list[float],
    violation: list[float] | None = None,
    *,
    positions: np.ndarray | None = None,
    trial: int = 0,
) -> SwarmResult:
    """Return a run with this history."""
    broken = [0.0] * len(fitness) if violation is None else violation
    count = len(fitness)
    x = np.zeros(2) if positions is None else positions[-1]
    return SwarmResult(
        x=x,
        fitness=fitness[-1],
        violation=broken[-1],
        status="budget",
        iterations=count,
        evaluations=10 * count,
        failed_evaluations=0,
        seed=0,
        trial=trial,
        settings=PSO(),
        history=SwarmHistory(
            fitness=np.array(fitness),
            violation=np.array(broken),
            evaluations=10 * np.arange(1, count + 1),
            positions=positions,
        ),
        seconds=0.0,
    )


def translation(x: float, y: float = 0.0) -> np.ndarray:
    """Return a transform (4, 4) that moves in the plane [m]."""
    T = np.eye(4)
    T[:2, 3] = x, y
    return T


def two_joints(*, prismatic: bool = False, radius: float = 0.03, endless: bool = False) -> Robot:
    """Return a planar arm with two links of 0.6 m; its second joint may slide along z instead."""
    bound = np.inf if endless else 2.0
    return Robot(
        name="two",
        joints=(
            Joint(name="turn", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
            Joint(name="slide", kind="prismatic" if prismatic else "revolute", parent=0, T_parent_joint=translation(0.6)),
        ),
        capsules=(
            LinkCapsule(name="upper", joint=0, a=np.zeros(3), b=np.array([0.6, 0, 0]), radius=radius),
            LinkCapsule(name="lower", joint=1, a=np.zeros(3), b=np.array([0.6, 0, 0]), radius=radius),
        ),
        frames=(Frame(name="tip", joint=1, T_joint_frame=translation(0.6)),),
        tip="tip",
        lower=np.array([-bound, -0.5]),
        upper=np.array([bound, 1.0]),
        velocity=np.array([1.0, 0.5]),
        acceleration=np.array([1.0, 0.25]),
    )


def moved(robot: Robot) -> Trajectory:
    """Return a motion of the robot with two joints."""
    return Trajectory(robot, Motion(np.array([[0.0, 0.0], [0.2, 0.5], [0.8, 0.6]])))


def texts(ax: object) -> str:
    """Return all texts in axes: labels, titles, legends and notes."""
    from matplotlib.text import Text

    return "\n".join(text.get_text() for text in ax.findobj(Text))  # type: ignore[attr-defined]


def levels(ax: object) -> list[float]:
    """Return the values of the lines that run level across axes."""
    drawn = [np.asarray(line.get_ydata(), dtype=float) for line in ax.get_lines()]  # type: ignore[attr-defined]
    return [float(y[0]) for y in drawn if len(y) == 2 and y[0] == y[1]]
