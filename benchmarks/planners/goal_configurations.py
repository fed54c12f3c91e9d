"""Goal configurations of a pose: ours beside damped least squares on Pinocchio, on any robots, in turn.

    python benchmarks/planners/goal_configurations.py --data DIR [--data DIR ...] --problems 5

The poses are those of the goals of MotionBenchMaker's problems, among their obstacles. Wanted are eight distinct configurations
that are free of collision. Ours is what `plan()` calls, one thread: the least of three calls, after one that is not timed. The
other is the loop of Pinocchio's documentation, in Python, from random seeds: steps of damped least squares on the logarithm of
what is missing, clipped to the limits; its configurations are checked by our kernel. What is found is looked at afterwards by
Pinocchio and Coal.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from cases import Case, Collection, load_collection
from page import put_into

from spacearm.planner import PlannerSettings, PoseGoal, Problem, clearance
from spacearm.planner.inverse_kinematics import find_goal_configurations
from spacearm.robot import forward_kinematics
from spacearm.study.other_checker import OtherChecker, stated_start
from spacearm.study.reference_core import load_now, machine_note

WANTED = 8
APART = 0.1  # two configurations are distinct if a joint differs by more [rad or m]
REPETITIONS = 3
STEPS, DAMPING = 100, 1e-6  # of damped least squares
LIMIT = 0.5  # seconds for it


@dataclass
class Row:
    """A pose: seconds and configurations of both; seeds and those that came to the pose of the other."""

    robot: str
    ours: float
    found: int
    wrong: int
    theirs: float
    their_found: int
    seeds: int
    reached: int


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, action="append", required=True, help="the problems of a robot")
    parser.add_argument("--problems", type=int, default=5, help="of each family")
    parser.add_argument("--half", choices=("odd", "even", "all"), default="all", help="of the problems, by their numbers")
    parser.add_argument("--no-other", action="store_true", help="leave damped least squares on Pinocchio out")
    parser.add_argument("--page", type=Path, help="put the table into this page")
    args = parser.parse_args()
    begun, rows, loads = time.perf_counter(), [], [load_now()]
    for folder in args.data:
        rows += measured(load_collection(folder, most=args.problems, half=args.half), other=not args.no_other)
        loads.append(load_now())
    lines = report(rows, loads, time.perf_counter() - begun)
    print("\n".join(lines))
    if args.page:
        put_into(args.page, "goal configurations", lines)


def measured(collection: Collection, *, other: bool) -> list[Row]:
    """Let both take turns on the poses of a robot."""
    checker, rows = collection.other_checker(), []
    for number, case in enumerate(collection.cases):
        print(f"{collection.robot} {case.name}   ", end="\r", file=sys.stderr, flush=True)
        pose = forward_kinematics(case.problem.robot, case.goal)
        problem = replace(case.problem, goal=PoseGoal(pose))
        theirs = LeastSquares(collection, case, pose)
        seconds, q = _ours(problem, number)
        rows.append(
            Row(
                collection.robot,
                seconds,
                len(q),
                _wrong(theirs, checker, case, q),
                *(theirs.run(number) if other else (np.inf, 0, 0, 0)),
            )
        )
    return rows


def _ours(problem: Problem, seed: int) -> tuple[float, np.ndarray]:
    settings = PlannerSettings(goal_candidates=WANTED, threads=1)
    found, seconds = find_goal_configurations(problem, settings, seed), np.inf
    for _ in range(REPETITIONS):
        begun = time.perf_counter()
        found = find_goal_configurations(problem, settings, seed)
        seconds = min(seconds, time.perf_counter() - begun)
    return seconds, found.q


def _wrong(theirs: LeastSquares, checker: OtherChecker, case: Case, q: np.ndarray) -> int:
    """Count configurations that collide by Coal, or miss the pose by Pinocchio."""
    if not len(q):
        return 0
    return max(checker.look(case.item, q).collisions, sum(not theirs.reaches(row) for row in q))


class LeastSquares:
    """Damped least squares on Pinocchio for a pose."""

    def __init__(self, collection: Collection, case: Case, pose: np.ndarray) -> None:
        self.problem, robot = case.problem, case.problem.robot
        self.model = pin.buildModelFromUrdf(str(collection.files.urdf))
        self.data = self.model.createData()
        self.frame = self.model.getFrameId(robot.tip)
        joints = [self.model.joints[self.model.getJointId(name)] for name in robot.dof_names]
        self.columns, self.rates = [joint.idx_q for joint in joints], [joint.idx_v for joint in joints]
        self.full = pin.neutral(self.model)
        for name, at in stated_start(case.item.request).items():
            if self.model.existJointName(name) and self.model.joints[self.model.getJointId(name)].nq == 1:
                self.full[self.model.joints[self.model.getJointId(name)].idx_q] = at
        self.target = pin.SE3(pose[:3, :3], pose[:3, 3])
        self.tolerance = PoseGoal(pose)

    def error(self, q: np.ndarray) -> Any:
        """Place the model, and return the pose wanted as seen from the frame."""
        self.full[self.columns] = q
        pin.framesForwardKinematics(self.model, self.data, self.full)
        return self.data.oMf[self.frame].actInv(self.target)

    def reaches(self, q: np.ndarray) -> bool:
        """Whether the frame is at the pose, within the tolerances."""
        return self.within(self.error(q))

    def within(self, missing: Any) -> bool:
        angle = np.linalg.norm(pin.log3(missing.rotation))
        place = np.linalg.norm(missing.translation)
        return bool(place <= self.tolerance.position_tolerance and angle <= self.tolerance.orientation_tolerance)

    def run(self, seed: int) -> tuple[float, int, int, int]:
        """Return seconds, distinct free configurations, seeds, and seeds that came to the pose."""
        rng, robot = np.random.default_rng(seed), self.problem.robot
        kept: list[np.ndarray] = []
        seeds = reached = 0
        begun = time.perf_counter()
        while len(kept) < WANTED and time.perf_counter() - begun < LIMIT:
            seeds += 1
            q = self.descended(rng.uniform(robot.lower, robot.upper))
            if q is None:
                continue
            reached += 1
            if all(np.abs(q - other).max() > APART for other in kept) and clearance(self.problem, q[None]).min() > 0:
                kept.append(q)
        seconds = time.perf_counter() - begun
        return seconds if len(kept) == WANTED else np.inf, len(kept), seeds, reached

    def descended(self, q: np.ndarray) -> np.ndarray | None:
        """Descend from a configuration; None: it does not come to the pose."""
        robot = self.problem.robot
        for _ in range(STEPS):
            missing = self.error(q)
            if self.within(missing):
                return q
            J = pin.computeFrameJacobian(self.model, self.data, self.full, self.frame, pin.LOCAL)[:, self.rates]
            J = pin.Jlog6(missing.inverse()) @ J
            step = J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(6), pin.log6(missing).vector)
            q = np.clip(q + step, robot.lower, robot.upper)
        return None


def report(rows: Sequence[Row], loads: Sequence[float], seconds: float) -> list[str]:
    lines = [
        f"{len(rows)} poses; {seconds:.0f} s in all, load {min(loads):.1f} to {max(loads):.1f}. {machine_note()}.",
        "",
        f"Time to {WANTED} distinct free configurations, median / p95; a pose with fewer counts as infinitely late for least "
        "squares, which goes on for 0.5 s, and with its time for ours, which ends when it has looked everywhere.",
        "",
        f"| robot | poses | ours [ms] | ours: {WANTED} found | mean | least | wrong | least squares on Pinocchio [ms] | "
        f"{WANTED} found | mean | least | seeds that reach the pose |",
        "|---" * 12 + "|",
    ]
    for robot in dict.fromkeys(row.robot for row in rows):
        own = [row for row in rows if row.robot == robot]
        cells = [robot, str(len(own)), _quantiles([row.ours for row in own])]
        cells += _counts([row.found for row in own])
        cells += [str(sum(row.wrong for row in own)), _quantiles([row.theirs for row in own])]
        cells += _counts([row.their_found for row in own])
        share = sum(row.reached for row in own) / max(sum(row.seeds for row in own), 1)
        lines.append("| " + " | ".join([*cells, f"{100 * share:.0f} %"]) + " |")
    return lines


def _counts(found: Sequence[int]) -> list[str]:
    return [f"{sum(count >= WANTED for count in found)} of {len(found)}", f"{np.mean(found):.1f}", str(min(found))]


def _quantiles(values: Sequence[float]) -> str:
    return " / ".join(f"{1e3 * float(np.percentile(values, percent, method='higher')):.2f}" for percent in (50, 95))


if __name__ == "__main__":
    main()
