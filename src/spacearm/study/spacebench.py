"""SpaceBench's problems: obstacles for arms on spacecraft whose base floats, and two problems that others have published.

The frozen set is a file a family, with its robots, its problems, and a known solution of each.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, SpacearmError, nearest
from spacearm.core.output import write_atomically
from spacearm.core.reading import read_bytes
from spacearm.core.records import record_as_dict
from spacearm.core.rotations import rotation_from_rpy
from spacearm.dynamics import base_at_mass_center
from spacearm.geometry.scene import scene_as_list, scene_from_list
from spacearm.motion import Motion, Trajectory
from spacearm.planner import AttitudeGoal, BaseLimits, PoseGoal, PositionGoal, Problem, goal_as_dict, goal_from_dict
from spacearm.robot import Robot, load_robot
from spacearm.robot.model import robot_as_dict, robot_from_dict
from spacearm.study.paper_problem import GOAL_POSITION, paper_scene
from spacearm.study.spacebench_families import FAMILIES
from spacearm.study.spacebench_robots import scaled_srs7

KEY = "spacearm-spacebench"
VERSION = 2
"""Of the files that are written; those of version 1 are read as well."""

_WITHOUT_CLEARANCE = 1  # version whose problems state no clearance, and were proven for 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpaceProblem:
    """A problem of the set.

    Attributes:
        family: its family.
        name: its name, as truss-01.
        problem: with a base that floats.
        solution: a motion that solves it, with its time law.
    """

    family: str
    name: str
    problem: Problem
    solution: Trajectory


def write_family(path: Path, family: str, problems: Iterable[SpaceProblem], *, seed: int, left_out: dict[str, int]) -> None:
    """Write a family's file: a problem to a line, the robots before them.

    Raises:
        OutputError: the file cannot be written.
    """
    problems = list(problems)
    robots = {item.problem.robot.name: item.problem.robot for item in problems}
    head = {KEY: VERSION, "family": family, "seed": seed, "left_out": left_out}
    lines = [f"{json.dumps(key)}: {_json(value)}" for key, value in head.items()]
    lines.append(
        '"robots": {\n' + ",\n".join(f"{json.dumps(n)}: {_json(robot_as_dict(r))}" for n, r in sorted(robots.items())) + "}"
    )
    lines.append('"problems": [\n' + ",\n".join(_json(space_problem_as_dict(item)) for item in problems) + "]")
    write_atomically(path, "{" + ",\n".join(lines) + "}\n")


def read_family(path: Path) -> list[SpaceProblem]:
    """Read a family's file, of this version or of version 1, whose problems have a clearance of 0: nothing touches.

    Raises:
        FileFormatError: a file that is missing or broken, or a problem in it that cannot be; it is named.
    """
    content = read_bytes(path, what="a family of SpaceBench")
    try:
        values = json.loads(content)
    except ValueError:
        values = None
    if not isinstance(values, dict) or values.get(KEY) not in (_WITHOUT_CLEARANCE, VERSION):
        raise FileFormatError(
            f"{path} is no family of SpaceBench, expected JSON with the key {KEY}: {VERSION} or "
            f"{_WITHOUT_CLEARANCE}; check the path"
        )
    stated = values[KEY] != _WITHOUT_CLEARANCE
    try:
        robots = {name: robot_from_dict(robot) for name, robot in values["robots"].items()}
        given = [(str(item["name"]), item) for item in values["problems"]]
        family = str(values["family"])
    except (KeyError, TypeError, AttributeError, SpacearmError) as error:
        raise FileFormatError(f"{path} cannot be read ({shown(str(error))}), expected a family of SpaceBench") from None
    out = []
    for name, item in given:
        try:
            out.append(_from_dict(item if stated else {"clearance": 0.0} | item, robots, family))
        except (KeyError, TypeError) as error:
            raise FileFormatError(f"{path}: problem {name} lacks {error}, expected a problem of SpaceBench") from None
        except SpacearmError as error:
            raise FileFormatError(f"{path}: problem {name}: {error}") from None
    return out


def find_problems(folder: Path, *, families: Sequence[str] = (), most: int | None = None) -> list[SpaceProblem]:
    """Read the set in a folder.

    Args:
        folder: with a file a family, as truss.json.
        families: the names of those wanted; none: all that are there.
        most: of each family.

    Raises:
        FileFormatError: no such folder, no such family in it, or a file that is broken.
    """
    there = [name for name in FAMILIES if (folder / f"{name}.json").is_file()]
    if not there:
        raise FileFormatError(
            f"{folder} holds no family of SpaceBench, expected truss.json and others; make them with "
            "python -m spacearm.study.spacebench_generate FOLDER, or check --data"
        )
    for name in families:
        if name not in there:
            raise FileFormatError(f"{folder} has no family '{name}'; {nearest(name, there)}")
    wanted = [name for name in there if not families or name in families]
    return [item for name in wanted for item in read_family(folder / f"{name}.json")[:most]]


def space_problem_as_dict(item: SpaceProblem) -> dict[str, Any]:
    """Return a problem with its solution as plain values, its robot by name."""
    problem, base_goal = item.problem, item.problem.base_goal
    return {
        "name": item.name,
        "robot": problem.robot.name,
        "base_start": problem.base_start.tolist(),
        "start": problem.start.tolist(),
        "goal": goal_as_dict(problem.goal),
        "base_goal": None if base_goal is None else record_as_dict(base_goal),
        "base_limits": record_as_dict(problem.base_limits) if problem.base_limits.any else None,
        "clearance": problem.clearance,
        "obstacles": scene_as_list(problem.scene),
        "solution": {"control_points": item.solution.motion.control_points.tolist(), "duration_s": item.solution.duration},
    }


def _from_dict(item: dict[str, Any], robots: dict[str, Robot], family: str) -> SpaceProblem:
    if item["robot"] not in robots:
        raise FileFormatError(f"its robot {shown(item['robot'])} is not in the file; {nearest(str(item['robot']), robots)}")
    robot, goal, limits = robots[item["robot"]], item["base_goal"], item["base_limits"]
    problem = Problem(
        robot,
        scene_from_list(item["obstacles"]),
        start=item["start"],
        goal=goal_from_dict(item["goal"]),
        base="floating",
        base_start=np.array(item["base_start"]),
        base_goal=None if goal is None else AttitudeGoal(goal["attitude_wxyz"], goal["tolerance"]),
        base_limits=None if limits is None else BaseLimits(**limits),
        clearance=item["clearance"],
    )
    solution = Trajectory(
        robot,
        Motion(item["solution"]["control_points"]),
        duration=item["solution"]["duration_s"],
        base="floating",
        base_start=problem.base_start,
    )
    return SpaceProblem(family=family, name=str(item["name"]), problem=problem, solution=solution)


def _json(value: Any) -> str:
    return json.dumps(value, allow_nan=False, separators=(",", ":"))


# ---- published problems ----------------------------------------------------------------------------------------------


PUBLISHED_ROTATION = math.radians(0.74)
"""By how much the base is turned after the best published motion of the servicer's problem [rad]."""

_SERVICER_GOAL = (1.5, -1.4, 2.2)  # of the end effector [m]
_SERVICER_RPY = (-30.0, -50.0, 45.0)  # roll, pitch, yaw of it [deg]


def servicer_problem(*, restore: bool = True) -> Problem:
    """Return the planning problem of the trajectory_planning project of lirun-sat, of the servicer with two panels.

    The end effector goes to its goal pose within 1 mm and 0.1 deg; links 5 to 7 keep clear of base, panels and links 1 and 2.

    Args:
        restore: the base is to end as it began, within 0.05 deg; otherwise as it likes.
    """
    robot = load_robot("servicer7")
    start = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
    pose = np.eye(4)
    pose[:3, :3] = rotation_from_rpy(np.radians(_SERVICER_RPY))
    pose[:3, 3] = _SERVICER_GOAL
    return Problem(
        robot,
        [],
        start=start,
        goal=PoseGoal(pose, position_tolerance=1e-3, orientation_tolerance=math.radians(0.1)),
        base="floating",
        base_start=base_at_mass_center(robot, start),
        base_goal=AttitudeGoal((1, 0, 0, 0), math.radians(0.05)) if restore else None,
        clearance=0.0,  # none was published
    )


def papers_problem() -> Problem:
    """Return the paper's scene for "srs7" at the length of the paper's arm, on a floating base of 100 kg.

    The arm stands on the inertial origin and points along y, as the paper's does at its start; there its elbow is at its least
    angle, 0.1 rad, for it cannot be stretched out. The end effector is to come within 1 mm of the paper's goal.
    """
    robot = scaled_srs7()
    T = np.eye(4)
    T[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # the arm's z is the scene's y
    return Problem(
        robot,
        paper_scene(),
        start=np.clip(np.zeros(robot.dof), robot.lower, robot.upper),
        goal=PositionGoal(GOAL_POSITION),
        base="floating",
        base_start=T,
        clearance=0.0,  # none was published
    )
