"""Inverse kinematics: ours beside damped least squares on Pinocchio, Pink and TRAC-IK, on the same poses, in turn.

    python benchmarks/inverse_kinematics.py                                    # the built-in robots
    python benchmarks/inverse_kinematics.py --data DIR [--data DIR ...]        # and those of MotionBenchMaker's files
    python benchmarks/inverse_kinematics.py --data DIR --install               # fetches Pink and TRAC-IK first

A pose is drawn: that of a configuration within the limits whose clearance is more than 2 mm, as that of the start. Robots of
files are drawn in free space, and among the obstacles of problems with odd numbers. Wanted is one configuration, and then eight
that differ by 0.2 rad or m in a joint, all of them free of collision. Of many poses there are fewer: then as many as ours finds
from thousands of seeds.

Ours is what `plan()` calls, with one thread, and all of the call is timed: the models of robot and scene are built before, as
those of the others are. The others begin at configurations drawn within the limits, one after the other, for a time limit;
their collisions are found by our kernel, and that is not timed. The least of three calls counts of ours, after one that is not
timed. Times are the processor's, so that other work on the machine does not count; those of both threads of TRAC-IK, which runs
two solvers at once. Every configuration of ours is looked at by Pinocchio: its pose and its limits.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from spacearm.core.errors import SpacearmError
from spacearm.geometry import Scene
from spacearm.planner import PlannerSettings, PoseGoal, Problem, clearance
from spacearm.planner.inverse_kinematics import find_goal_configurations
from spacearm.robot import Robot, forward_kinematics, load_robot
from spacearm.study.motionbenchmaker import find_items, find_robot, read_item
from spacearm.study.reference_core import load_now, machine_note

ENVIRONMENT = Path(__file__).resolve().parents[1] / ".venv-planners"
"""Where Pink and TRAC-IK are: apart, for they are none of ours."""
PACKAGES = ("pin-pink==4.4.0", "qpsolvers==4.13.0", "daqp==0.11.0", "loop-rate-limiters==1.2.0", "pytracik==0.0.3")
BUILTIN = ("srs7", "ssrms", "servicer7", "ets7", "zhang2022")
GROUPS = {"panda": ("panda_arm", "panda_hand"), "ur5": ("manipulator", None), "fetch": ("arm_with_torso", None)}
WANTED, APART, ROOM = 8, 0.2, 0.002
STEPS, DAMPING = 100, 1e-6  # of damped least squares
PINK_STEP = 0.5  # [s] of one step of Pink, whose velocity is not limited
TRAC_SECONDS, TRAC_ERROR = 0.005, 1e-5  # of one call of TRAC-IK: its defaults

Seeds = Iterator[np.ndarray]
Solver = Callable[[np.ndarray], "np.ndarray | None"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--data", type=Path, action="append", default=[], help="folder with the URDF, SRDF and families of a robot"
    )
    parser.add_argument("--poses", type=int, default=20, help="of each robot and kind of scene")
    parser.add_argument("--seconds", type=float, default=0.25, help="for each of the others and each pose")
    parser.add_argument("--install", action="store_true", help="fetch Pink and TRAC-IK")
    args = parser.parse_args()
    if args.install:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(ENVIRONMENT)]
        subprocess.run([*pip, *PACKAGES], check=True)
    sys.path.append(str(ENVIRONMENT))
    rows, loads = list[Row](), [load_now()]
    for folder in args.data:
        arm = Arm.of_files(folder)
        rows += compete(arm, f"{arm.name}, free space", free_problems(arm.robot, args.poses), args.seconds)
        rows += compete(arm, f"{arm.name}, obstacles", problems_among(arm.robot, folder, args.poses), args.seconds)
        loads.append(load_now())
    for name in BUILTIN:
        arm = Arm(name, load_robot(name))
        rows += compete(arm, name, free_problems(arm.robot, args.poses), args.seconds)
    loads.append(load_now())
    print(f"\nLoad {min(loads):.1f} to {max(loads):.1f}. {machine_note()}.\n")
    print("\n".join(table(rows)))


# ---- the poses -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Arm:
    """A robot, and its URDF where there is one."""

    name: str
    robot: Robot
    urdf: Path | None = None

    @classmethod
    def of_files(cls, folder: Path) -> Arm:
        files = find_robot(folder, find_items(folder))
        urdf, srdf = files.urdf, files.srdf
        name = srdf.stem
        group, tip = GROUPS[name]
        return cls(name, load_robot(urdf, srdf=srdf, group=group, **({} if tip is None else {"tip": tip})), urdf)


def free_problems(robot: Robot, count: int) -> list[Problem]:
    return [drawn(robot, Scene([]), seed) for seed in range(count)]


def problems_among(robot: Robot, folder: Path, count: int) -> list[Problem]:
    """Return drawn poses among the obstacles of problems with odd numbers, of all families alike."""
    folder = folder / "problems" if (folder / "problems").is_dir() else folder
    items = [item for item in find_items(folder) if int(item.name) % 2]
    families = sorted({item.family for item in items})
    order = sorted(items, key=lambda item: (int(item.name), families.index(item.family)))
    return [drawn(robot, read_item(item, robot).scene, seed) for seed, item in enumerate(order[:count])]


def drawn(robot: Robot, scene: Scene, seed: int) -> Problem:
    rng, free = np.random.default_rng(seed), list[np.ndarray]()
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    while len(free) < 2:
        q = rng.uniform(lower, upper)
        problem = Problem(robot, scene, start=q, goal=q, base="fixed", clearance=0.0)
        if clearance(problem, q) > ROOM:
            free.append(q)
    start, goal = free
    return Problem(robot, scene, start=start, goal=PoseGoal(forward_kinematics(robot, goal)), base="fixed", clearance=0.0)


# ---- the others ------------------------------------------------------------------------------------------------------


class Chain:
    """The joints of a robot as Pinocchio has them; each has a number of its own in q."""

    def __init__(self, robot: Robot) -> None:
        self.robot, self.model = robot, pin.Model()
        ids: list[int] = []
        for joint in robot.joints:
            kind = pin.JointModelRZ() if joint.kind == "revolute" else pin.JointModelPZ()
            parent = 0 if joint.parent < 0 else ids[joint.parent]
            ids.append(self.model.addJoint(parent, kind, pin.SE3(np.array(joint.T_parent_joint)), joint.name))
        tip = robot.frame(robot.tip)
        place = pin.SE3(np.array(tip.T_joint_frame))
        self.frame = self.model.addFrame(pin.Frame("goal", ids[tip.joint], place, pin.FrameType.OP_FRAME))
        self.model.lowerPositionLimit, self.model.upperPositionLimit = np.array(robot.lower), np.array(robot.upper)
        self.data = self.model.createData()

    def missing(self, q: np.ndarray, target: pin.SE3) -> pin.SE3:
        """Return the target as seen from the frame."""
        pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.frame].actInv(target)

    def reaches(self, q: np.ndarray, goal: PoseGoal) -> bool:
        missing = self.missing(q, pin.SE3(np.array(goal.pose)))
        near = np.linalg.norm(missing.translation) <= goal.position_tolerance
        return bool(near and np.linalg.norm(pin.log3(missing.rotation)) <= goal.orientation_tolerance)


def least_squares(chain: Chain, goal: PoseGoal) -> Solver:
    """Return the loop of Pinocchio's documentation: damped steps on the logarithm of what is missing, clipped to the limits."""
    target, robot = pin.SE3(np.array(goal.pose)), chain.robot

    def solve(q: np.ndarray) -> np.ndarray | None:
        for _ in range(STEPS):
            missing = chain.missing(q, target)
            error = pin.log6(missing).vector
            if np.linalg.norm(error) < 1e-4:
                return q
            J = pin.computeFrameJacobian(chain.model, chain.data, q, chain.frame, pin.LOCAL)
            J = pin.Jlog6(missing.inverse()) @ J
            q = np.clip(q + J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(6), error), robot.lower, robot.upper)
        return None

    return solve


def pink_solver(chain: Chain, goal: PoseGoal) -> Solver:
    """Return steps of Pink's quadratic programs, with limits, until the frame is at the pose."""
    import pink

    task = pink.FrameTask("goal", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
    task.set_target(pin.SE3(np.array(goal.pose)))

    def solve(q: np.ndarray) -> np.ndarray | None:
        at = pink.Configuration(chain.model, chain.data, q)
        for _ in range(STEPS):
            if np.linalg.norm(task.compute_error(at)) < 1e-4:
                return at.q
            try:
                velocity = pink.solve_ik(at, [task], PINK_STEP, solver="daqp", damping=1e-9, safety_break=False)
            except Exception:  # a program without solution
                return None
            at.integrate_inplace(velocity, PINK_STEP)
        return None

    return solve


def trac_solver(arm: Arm, goal: PoseGoal) -> Solver:
    """Return TRAC-IK, which runs two solvers at once for 5 ms at most."""
    import pytracik

    assert arm.urdf is not None
    tree = ElementTree.fromstring(arm.urdf.read_text())
    children = {joint.find("child").get("link") for joint in tree.iter("joint") if joint.find("child") is not None}  # type: ignore[union-attr]
    root = next(link.get("name") for link in tree.findall("link") if link.get("name") not in children)
    for link in tree.findall("link"):  # of which it warns at the root
        for inertial in link.findall("inertial"):
            link.remove(inertial)
    text = ElementTree.tostring(tree, encoding="unicode")
    made = pytracik.TRAC_IK(root, arm.robot.tip, text, TRAC_SECONDS, TRAC_ERROR, pytracik.SolveType.Speed)
    if pytracik.get_num_joints(made) != arm.robot.dof:
        raise RuntimeError("other joints")
    pytracik.set_joint_limits(made, np.array(arm.robot.lower), np.array(arm.robot.upper))
    place, turn = goal.pose[:3, 3], pin.Quaternion(np.array(goal.pose[:3, :3])).coeffs()

    def solve(q: np.ndarray) -> np.ndarray | None:
        found = pytracik.ik(made, q, *place, *turn)
        return np.array(found[1:]) if found[0] >= 0 else None

    return solve


# ---- the comparison --------------------------------------------------------------------------------------------------


@dataclass
class Row:
    """One pose and one contender.

    Attributes:
        case: where the pose is from.
        who: the contender.
        first: seconds until the first configuration; infinite if there is none.
        all: likewise until all that are wanted.
        found: how many.
        wanted: how many are.
        wrong: how many miss the pose or a limit.
    """

    case: str
    who: str
    first: float
    all: float
    found: int
    wanted: int
    wrong: int = 0


def compete(arm: Arm, case: str, problems: Sequence[Problem], seconds: float) -> list[Row]:
    rows, chain = list[Row](), Chain(arm.robot)
    others: dict[str, Callable[[PoseGoal], Solver]] = {"Pinocchio": lambda goal: least_squares(chain, goal)}
    if ENVIRONMENT.is_dir():
        others["Pink"] = lambda goal: pink_solver(chain, goal)
        if arm.urdf is not None:
            others["TRAC-IK"] = lambda goal: trac_solver(arm, goal)
    for number, problem in enumerate(problems):
        print(f"{case} {number}    ", end="\r", file=sys.stderr, flush=True)
        rows.append(ours(case, chain, problem, number))
        goal: Any = problem.goal
        for who, make in others.items():
            rows.append(theirs(replace(rows[-1], who=who, wrong=0), make(goal), problem, number, seconds))
    return rows


def ours(case: str, chain: Chain, problem: Problem, seed: int) -> Row:
    wanted = min(WANTED, len(configurations(problem, 256, seed)[0]))
    _, first = configurations(problem, 1, seed, times=3)
    q, seconds = configurations(problem, WANTED, seed, times=3)
    robot, goal = problem.robot, problem.goal
    assert isinstance(goal, PoseGoal)
    wrong = sum(not (inside(robot, row) and chain.reaches(row, goal)) for row in q)
    return Row(case, "spacearm", first, seconds if len(q) >= wanted else np.inf, len(q), wanted, wrong)


def configurations(problem: Problem, most: int, seed: int, *, times: int = 0) -> tuple[np.ndarray, float]:
    """Return our configurations, and the least time of some further calls."""
    settings, seconds = PlannerSettings(goal_candidates=most, threads=1), np.inf
    q = find_goal_configurations(problem, settings, seed).q
    for _ in range(times):
        begun = time.process_time()
        find_goal_configurations(problem, settings, seed)
        seconds = min(seconds, time.process_time() - begun)
    return q, seconds if len(q) else np.inf


def inside(robot: Robot, q: np.ndarray) -> bool:
    return bool(((q >= robot.lower) & (q <= robot.upper)).all())


def theirs(row: Row, solve: Solver, problem: Problem, seed: int, seconds: float) -> Row:
    rng, robot, spent = np.random.default_rng(seed), problem.robot, 0.0
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    first, kept = np.inf, list[np.ndarray]()
    while spent < seconds and len(kept) < row.wanted:
        begun = time.process_time()
        q = solve(rng.uniform(lower, upper))
        spent += time.process_time() - begun
        if q is None or any(np.abs(q - other).max() <= APART for other in kept) or clearance(problem, q) <= 0:
            continue
        kept.append(q)
        first = min(first, spent)
    return replace(row, first=first, found=len(kept), all=spent if len(kept) == row.wanted else np.inf)


def table(rows: Sequence[Row]) -> list[str]:
    lines = [
        f"| poses of | solver | any found | first [ms], median / p95 | {WANTED} or all found | {WANTED} or all [ms] | wrong |",
        "|---|---|---|---|---|---|---|",
    ]
    for case, who in dict.fromkeys((row.case, row.who) for row in rows):
        own = [row for row in rows if (row.case, row.who) == (case, who)]
        some, full = sum(row.found > 0 for row in own), sum(row.found >= row.wanted for row in own)
        cells = [case, who, f"{some} of {len(own)}", quantiles([row.first for row in own])]
        cells += [f"{full} of {len(own)}", quantiles([row.all for row in own])]
        cells.append(str(sum(row.wrong for row in own)) if who == "spacearm" else "")
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def quantiles(values: Sequence[float]) -> str:
    found = (float(np.percentile(values, percent, method="higher")) for percent in (50, 95))
    return " / ".join("–" if np.isinf(value) else f"{1e3 * value:.2f}" for value in found)


if __name__ == "__main__":
    try:
        main()
    except SpacearmError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
