"""Makes SpaceBench's problems from seeds: draws them, reaches for their ends, and solves them.

python -m spacearm.study.spacebench_generate FOLDER [--seed N] [--problems N] [--families NAME ...]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import SpacearmError
from spacearm.core.rotations import quaternion_of, rotation_from_rpy
from spacearm.geometry import Scene
from spacearm.geometry.scene import moved_scene
from spacearm.motion import Motion, Trajectory
from spacearm.planner import AttitudeGoal, ConfigurationGoal, PlannerSettings, PoseGoal, PositionGoal, Problem, plan
from spacearm.planner.clearance import clearance
from spacearm.planner.inverse_kinematics import find_goal_configurations
from spacearm.planner.plan_result import Plan, report_base
from spacearm.proof import certify
from spacearm.study.spacebench import SpaceProblem, write_family
from spacearm.study.spacebench_families import FAMILIES, Draft, Family

Array = NDArray[np.float64]

PROBLEMS = 50
"""In each family of the frozen set."""

SEED = 2026
"""Of the frozen set."""

_ROOM = 0.004  # beyond the required clearance, at both ends with the base at rest [m]
_REACHING = PlannerSettings(goal_candidates=4)
_IN_JOINTS = PlannerSettings(evaluations=200_000, stop_at_first=True, proofs=6)
_IN_SPACE = PlannerSettings(evaluations=40_000, stop_at_first=True, proofs=6)  # each costs more: the goal depends on the motion
_FURTHER = 3_000  # evaluations, for a solution that does not wander


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """What came of drawing problems.

    Attributes:
        problems: those that were kept.
        left_out: how many drawn ones were not, by reason.
    """

    problems: tuple[SpaceProblem, ...]
    left_out: dict[str, int]


def generate(
    family: str, *, seed: int = SEED, number: int = PROBLEMS, progress: Callable[[int, int], object] | None = None
) -> Drawn:
    """Draw problems of a family until a number of them are kept.

    Kept is a problem whose ends have more than the clearance that the family asks for, that the straight motion to a goal
    configuration does not solve, and that `plan` solves with a certificate; the shortest motion that it finds in a little time
    is the known solution. It keeps the clearance all the time. The same seed gives the same problems.

    Args:
        family: a name of `FAMILIES`.
        seed: of the set.
        number: of problems.
        progress: called with the problems kept, and those wanted.
    """
    kept: list[SpaceProblem] = []
    left_out: Counter[str] = Counter()
    attempt = 0
    while len(kept) < number:
        rng = np.random.default_rng([seed, list(FAMILIES).index(family), attempt])
        found = attempted(FAMILIES[family], rng, f"{family}-{len(kept) + 1:02d}", family)
        attempt += 1
        if isinstance(found, str):
            left_out[found] += 1
            continue
        kept.append(found)
        if progress is not None:
            progress(len(kept), number)
    return Drawn(problems=tuple(kept), left_out=dict(left_out))


def attempted(draw: Family, rng: np.random.Generator, name: str, family: str) -> SpaceProblem | str:
    """Draw a problem and solve it; return it with its solution, or why it is left out."""
    problem = _posed(draw(rng), rng)
    if isinstance(problem, str):
        return problem
    if _straight_solves(problem):
        return "the straight motion solves it"
    settings = _IN_JOINTS if isinstance(problem.goal, ConfigurationGoal) else _IN_SPACE
    seed = int(rng.integers(2**31))
    found = plan(problem, settings, rng=seed)
    if found.status in ("not_found", "not_proven"):  # what asks much of the base needs more freedom
        settings = replace(settings, interior_points=(4, 6))
        found = plan(problem, settings, rng=seed)
    if found.status in ("start_in_collision", "goal_in_collision", "goal_unreachable"):
        return "an end cannot be reached with the clearance"
    if not found.found or found.trajectory is None:
        return "no certified motion was found in the time allowed"
    if not _keeps_all(found):
        return "the certified motion has less than the clearance at its end"
    solution = found.trajectory
    further = plan(problem, replace(settings, evaluations=_FURTHER, stop_at_first=False), rng=seed)
    if further.found and further.trajectory is not None and _keeps_all(further):
        solution = min(solution, further.trajectory, key=lambda trajectory: trajectory.motion.length())
    return SpaceProblem(family=family, name=name, problem=problem, solution=solution)


def _keeps_all(found: Plan) -> bool:
    """Whether every pair keeps the required clearance all the time, at the ends too."""
    return found.certificate is not None and not found.certificate.near_pairs


def _posed(draft: Draft, rng: np.random.Generator) -> Problem | str:
    """Reach for the ends, and put the base somewhere in the inertial frame, and the obstacles and the goal with it."""
    start = _reached(draft, draft.start, rng)
    goal = None if start is None else _goal(draft, start, rng)
    if start is None or goal is None:
        return "an end cannot be reached with the clearance"
    T = np.eye(4)
    T[:3, :3] = rotation_from_rpy(np.round(rng.uniform(-0.6, 0.6, 3), 3))
    T[:3, 3] = np.round(rng.uniform(-1, 1, 3), 3)
    if isinstance(goal, PositionGoal):
        goal = replace(goal, position=T[:3, :3] @ goal.position + T[:3, 3])
    elif isinstance(goal, PoseGoal):
        goal = replace(goal, pose=T @ goal.pose)
    keep = draft.keep_attitude
    return Problem(
        draft.robot,
        moved_scene(_scene(draft), T),
        start=start,
        goal=goal,
        base="floating",
        base_start=T,
        base_goal=None if keep is None else AttitudeGoal(quaternion_of(T[:3, :3]), keep),
        base_limits=draft.limits,
        clearance=draft.clearance,
    )


def _goal(draft: Draft, start: Array, rng: np.random.Generator) -> Array | PositionGoal | PoseGoal | None:
    if draft.in_joints:
        return _reached(draft, draft.goal, rng, start)
    (goal,) = draft.goal
    return goal if _reached(draft, draft.goal, rng, start) is not None else None


def _reached(
    draft: Draft, goals: tuple[PositionGoal | PoseGoal, ...], rng: np.random.Generator, start: Array | None = None
) -> Array | None:
    """Return a configuration that reaches the goals with the base at rest, each with its own arm, and has room; or None."""
    robot = draft.robot
    near = np.clip(robot.configurations[0].q if robot.configurations else np.zeros(robot.dof), robot.lower, robot.upper)
    q = near.copy() if start is None else start.copy()
    each = robot.dof // len(draft.start)
    for i, goal in enumerate(goals):
        problem = Problem(robot, _scene(draft), start=q, goal=goal, base="fixed", clearance=draft.clearance)
        found = find_goal_configurations(problem, _REACHING, int(rng.integers(2**31)))
        roomy = found.q[found.clearance > draft.clearance + _ROOM]
        if not len(roomy):
            return None
        arm = slice(i * each, (i + 1) * each)
        q[arm] = roomy[int(rng.integers(len(roomy)))][arm]
    q = np.round(q, 9).clip(robot.lower, robot.upper)
    free = clearance(Problem(robot, _scene(draft), start=q, goal=q, base="fixed"), q)
    return q if float(free) > draft.clearance + _ROOM else None


def _scene(draft: Draft) -> Scene:
    return Scene(draft.obstacles)


def _straight_solves(problem: Problem) -> bool:
    """Whether the straight motion to a configuration that reaches the goal with the base at rest does all that is asked."""
    goals = find_goal_configurations(problem.local, _REACHING, 0).q
    for goal in goals[:1]:
        if np.array_equal(goal, problem.start):
            return True
        motion = Motion(np.linspace(problem.start, goal, 2))
        trajectory = Trajectory(problem.robot, motion, base=problem.base, base_start=problem.base_start)
        if not report_base(problem, trajectory).missed and certify(problem, trajectory).holds:
            return True
    return False


def main() -> int:
    """Draw, solve and write; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m spacearm.study.spacebench_generate", description="Write the frozen set of SpaceBench."
    )
    parser.add_argument("folder", type=Path, help="where a file for each family is written, over one that is there")
    parser.add_argument("--seed", type=int, default=SEED, help="of the set; the same one gives the same files (%(default)s)")
    parser.add_argument("--problems", type=int, default=PROBLEMS, help="of each family (%(default)s)")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=tuple(FAMILIES), help="only these")
    given = parser.parse_args()
    try:
        given.folder.mkdir(parents=True, exist_ok=True)
        for family in given.families:
            begun = time.perf_counter()
            drawn = generate(family, seed=given.seed, number=given.problems, progress=_tell(family))
            path = given.folder / f"{family}.json"
            write_family(path, family, drawn.problems, seed=given.seed, left_out=drawn.left_out)
            print(f"\r{path}: {len(drawn.problems)} problems, {time.perf_counter() - begun:.1f} s; left out: {drawn.left_out}")
    except (SpacearmError, OSError) as error:
        print(f"spacearm: {error}", file=sys.stderr)
        return 2
    return 0


def _tell(family: str):
    return lambda done, total: print(f"\r{family} {done}/{total}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
