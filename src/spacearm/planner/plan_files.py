"""Plans on disk: JSON with everything needed to run, check and repeat them.

Keys: `spacearm-plan` (version), `status`, `message`, `problem` (robot, start, goal, obstacles, as plain values; and a
SHA-256 `hash` of them), `seed`, `settings`, `motion` (`control_points` of the clamped quintic spline and `duration_s`),
`fitness`, `goals`, `history`, `certificate`. What is infinite, as a clearance without obstacles, is null. Timings are left
out: the same search gives the same bytes.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.errors import FileFormatError, OutputError
from spacearm.motion import Motion, Trajectory
from spacearm.output import write_atomically
from spacearm.planner.goals import ConfigurationGoal
from spacearm.planner.problem import Problem
from spacearm.planner.result import Plan
from spacearm.reading import read_bytes
from spacearm.robot import Robot
from spacearm.settings import as_dict

_KEY = "spacearm-plan"
_VERSION = 1
_SAMPLES = 201


def plan_as_dict(plan: Plan) -> dict[str, Any]:
    """Return a plan as plain values; see the module for the keys."""
    trajectory = plan.trajectory
    problem = problem_as_dict(plan.problem)
    return {
        _KEY: _VERSION,
        "status": plan.status,
        "message": plan.message,
        "problem": {**problem, "hash": _hash(problem)},
        "seed": plan.seed,
        "settings": as_dict(plan.settings),
        "motion": None
        if trajectory is None
        else {
            "control_points": trajectory.motion.control_points.tolist(),
            "duration_s": trajectory.duration,
        },
        "fitness": plan.fitness,
        "goals": plan.goals.tolist(),
        "history": [
            {
                "goal": entry.goal,
                "restart": entry.restart,
                "length": entry.length,
                "violation": entry.violation,
                "proven": entry.proven,
            }
            for entry in plan.history
        ],
        "certificate": None if plan.certificate is None else plan.certificate.as_dict(),
    }


def problem_as_dict(problem: Problem) -> dict[str, Any]:
    """Return a problem as plain values; the robot by its name, its joints' names and a digest of its numbers."""
    goal = problem.goal
    if isinstance(goal, ConfigurationGoal):
        wanted: dict[str, Any] = {"configuration": goal.q.tolist()}
    else:
        wanted = {"position": goal.position.tolist(), "tolerance": goal.tolerance, "frame": goal.frame}
    return {
        "robot": {
            "name": problem.robot.name,
            "joints": list(problem.robot.dof_names),
            "digest": _robot_digest(problem.robot),
        },
        "base": problem.base,
        "start": problem.start.tolist(),
        "goal": wanted,
        "obstacles": [{"sphere": {"center": o.center.tolist(), "radius": o.radius}} for o in problem.scene.obstacles],
    }


def save_plan(plan: Plan, path: str | os.PathLike[str]) -> None:
    """Write a plan as JSON.

    Raises:
        OutputError: the file exists already, or cannot be written.
    """
    if Path(path).exists():
        raise OutputError(f"{path} exists, expected a new file; choose another name")
    write_atomically(path, json.dumps(plan_as_dict(plan), indent=2, allow_nan=False) + "\n")


def save_trajectory(trajectory: Trajectory, path: str | os.PathLike[str], *, samples: int = _SAMPLES) -> None:
    """Write a trajectory as CSV: time [s], then position, rate and acceleration of every joint, and the tip's position.

    Raises:
        OutputError: the file exists already, or cannot be written.
    """
    if Path(path).exists():
        raise OutputError(f"{path} exists, expected a new file; choose another name")
    t = np.linspace(0.0, trajectory.duration, samples)
    state, tip = trajectory.sample(t), trajectory.tip(t)[:, :3, 3]
    names = trajectory.robot.dof_names
    header = ["t_s", *(f"{kind}_{name}" for kind in ("q", "dq", "ddq") for name in names), "tip_x_m", "tip_y_m", "tip_z_m"]
    buffer = io.StringIO()
    np.savetxt(
        buffer,
        np.column_stack([t, state.q, state.dq, state.ddq, tip]),
        delimiter=",",
        header=",".join(header),
        comments="",
        fmt="%.12g",
    )
    write_atomically(path, buffer.getvalue())


def load_plan(path: str | os.PathLike[str], problem: Problem) -> Trajectory:
    """Read back the trajectory of a saved plan, for the problem it was made for.

    Args:
        path: a plan.json.
        problem: what was planned.

    Raises:
        FileFormatError: the file is missing, broken or no plan, holds no motion, or is of another problem.
        ProblemError: its motion breaks the robot's limits.
    """
    content = read_bytes(path, what="a plan file")
    try:
        saved = json.loads(content)
        if not isinstance(saved, dict) or saved.get(_KEY) != _VERSION:
            raise FileFormatError(f"{path} has no '{_KEY}: {_VERSION}', expected a plan file; it is something else")
        motion, saved_hash = saved["motion"], saved["problem"]["hash"]
        if motion is None:
            raise FileFormatError(f"{path} holds no motion (status {saved['status']!r}), expected a plan that was found")
        points, duration = motion["control_points"], motion["duration_s"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise FileFormatError(f"{path} is broken, expected a plan file in JSON; plan again") from None
    if saved_hash != _hash(problem_as_dict(problem)):
        raise FileFormatError(f"{path} is a plan of another problem, expected one of this; give the problem it was made for")
    return Trajectory(problem.robot, Motion(points), duration=duration)


def _robot_digest(robot: Robot) -> str:
    """Return a SHA-256 of everything that decides where the robot's links are and how fast they may move."""
    parts: list[Any] = [robot.tip, robot.lower, robot.upper, robot.velocity, robot.acceleration]
    for joint in robot.joints:
        parts += [joint.kind, joint.parent, joint.T_parent_joint, joint.dof, joint.multiplier, joint.offset]
    for capsule in robot.capsules:
        parts += [capsule.name, capsule.joint, capsule.a, capsule.b, capsule.radius]
    for frame in robot.frames:
        parts += [frame.name, frame.joint, frame.T_joint_frame]
    plain = [part.tolist() if isinstance(part, np.ndarray) else part for part in parts]
    return hashlib.sha256(json.dumps(plain).encode()).hexdigest()


def _hash(values: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
