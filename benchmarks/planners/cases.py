"""The problems of the comparison, and what a contestant leaves behind."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.core.errors import SpacearmError
from spacearm.planner import Problem, clearance
from spacearm.planner.kernel_model import kernel_model
from spacearm.study.motionbenchmaker import Item, RobotFiles, find_items, find_robot, read_item
from spacearm.study.other_checker import OtherChecker, overlapping_pairs

HERE = Path(__file__).resolve().parent
ENVIRONMENT = HERE.parents[1] / ".venv-planners"
"""Where the other libraries are: apart, for they are none of ours. `compare.py` makes them importable."""

MARGIN = 0.002
"""Clearance that everybody asks for at what is looked at [m]; less where an end of the problem is closer."""

PIECE = 0.05
"""How far apart the configurations are that a planner of ways with corners looks at [rad]."""


@dataclass(frozen=True)
class Case:
    """A problem of the collection."""

    item: Item
    problem: Problem
    margin: float

    @property
    def name(self) -> str:
        return f"{self.item.family} {self.item.name}"

    @property
    def start(self) -> np.ndarray:
        return self.problem.start

    @property
    def goal(self) -> np.ndarray:
        return self.problem.goal.q  # the collection has no other

    @property
    def straight(self) -> float:
        return float(np.linalg.norm(self.goal - self.start))


@dataclass
class Trace:
    """One run of one contestant.

    Attributes:
        method: who.
        case: what.
        seed: how.
        points: (seconds, evaluations, length) of each improvement.
        seconds: in all.
        calls: of the checker; 0 where they are native.
        configurations: looked at by the kernel; 0 where nobody counted.
        kernel: seconds in the kernel [s].
        python: seconds in Python around it [s].
        way: (m, n) configurations along what was found, to be looked at closely.
    """

    method: str
    case: str
    seed: int
    points: list[tuple[float, int, float]] = field(default_factory=list)
    seconds: float = 0.0
    calls: int = 0
    configurations: int = 0
    kernel: float = 0.0
    python: float = 0.0
    way: Any = None
    collisions: int | None = None

    @property
    def solved(self) -> bool:
        return bool(self.points)

    def note(self, seconds: float, evaluations: int, length: float) -> None:
        if not self.points or length < self.points[-1][2] - 1e-9:
            self.points.append((seconds, evaluations, length))


@dataclass
class Collection:
    """Problems of one robot.

    Attributes:
        robot: as its URDF file is called, as VAMP calls it too.
        files: of the robot.
        cases: those whose ends are free.
        left_out: the others, and why.
    """

    robot: str
    files: RobotFiles
    cases: list[Case]
    left_out: dict[str, str]

    @property
    def joints(self) -> tuple[str, ...]:
        return self.cases[0].problem.robot.dof_names

    def other_checker(self) -> OtherChecker:
        return OtherChecker(self.files, self.joints, overlapping=overlapping_pairs(self.cases[0].problem.robot))


def load_collection(
    folder: Path,
    *,
    most: int | None = None,
    half: str = "all",
    group: str | None = None,
    families: Sequence[str] = (),
) -> Collection:
    """Read problems of each family, and their models in the kernel.

    Args:
        folder: of the families, the robot's files beside them.
        most: so many of each family.
        half: "odd" or "even": those with such a number alone; or "all".
        group: whose joints move; None: the one of the requests.
        families: beginnings of the names of those wanted; none: all.
    """
    try:
        every = [item for item in find_items(folder) if half == "all" or int(item.name or 0) % 2 == (half == "odd")]
        named = tuple(families) or ("",)
        wanted = dict.fromkeys(item.family for item in every if item.family.startswith(named))
        items = [item for family in wanted for item in [item for item in every if item.family == family][:most]]
        files = find_robot(folder, items, group=group)
        robot = files.load()
    except SpacearmError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    out = Collection(files.urdf.stem.split("_")[0], files, [], {})
    for item in items:
        try:
            problem = read_item(item, robot)
        except SpacearmError as error:
            out.left_out[f"{item.family} {item.name}"] = str(error)
            continue
        least = float(clearance(problem, np.stack([problem.start, problem.goal.q])).min())
        if least > 0:
            out.cases.append(Case(item, problem, min(MARGIN, least / 2)))
            _ = kernel_model(robot, problem.scene).model32
        else:
            out.left_out[f"{item.family} {item.name}"] = f"an end is in collision by {-1e3 * least:.2f} mm"
    return out


def along(corners: np.ndarray, step: float) -> np.ndarray:
    """Configurations along a way with corners (m, n), neighbours at most a step apart."""
    out = [corners[:1]]
    for a, b in itertools.pairwise(corners):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / step)))
        out.append(a + np.linspace(1 / count, 1, count)[:, None] * (b - a))
    return np.concatenate(out)


def length_of(corners: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())
