"""How long `plan()` takes with a budget of 1 ms, stage by stage, and the first call in a fresh process.

    python benchmarks/planning_time.py                                   # the floating servicers of SpaceBench
    python benchmarks/planning_time.py --data DIR [--data DIR ...]       # and the robots of MotionBenchMaker's files

Every problem is planned once, after one plan for its robot that does not count: its scene is new to spacearm. The goals of
MotionBenchMaker are configurations; the pose of the tip there is another goal. "proof" is the trajectory with its certificate,
and what is tried again where one fails. "rest" is what no stage counts. A first call is made in a process of its own, which has
imported spacearm and loaded the problem; "next" is the same call again. One thread; times are as measured, so nothing else
should run.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

from spacearm.core.errors import SpacearmError
from spacearm.planner import PlannerSettings, PoseGoal, Problem, plan
from spacearm.robot import forward_kinematics
from spacearm.study.motionbenchmaker import find_items, find_robot, read_item
from spacearm.study.reference_core import load_now, machine_note
from spacearm.study.spacebench import find_problems

SPACEBENCH = Path(__file__).resolve().parent / "spacebench" / "v1"
STAGES = {"prepare": ("prepare",), "goals": ("goals",), "search": ("search",), "proof": ("certify", "less clearance")}
LATER = 5  # calls after the first one, of which the median counts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--data", type=Path, action="append", default=[], help="folder with the files of a robot and its problems"
    )
    parser.add_argument("--problems", type=int, default=3, help="of each family")
    parser.add_argument("--budget", type=float, default=0.001, help="of plan() [s]")
    parser.add_argument("--processes", type=int, default=3, help="fresh ones for each first call")
    parser.add_argument("--first", choices=("joint", "pose", "floating"), help=argparse.SUPPRESS)  # in a process of its own
    args = parser.parse_args()
    if args.first:
        print(json.dumps(first_call(args.data[0], args.first, args.budget)))
        return
    loads = [load_now()]
    stages = [
        f"Budget {1e3 * args.budget:g} ms. Medians [ms]; of all of plan() the median and what 95 in 100 keep.",
        "",
        "| robot, goal | problems | found | plan() | " + " | ".join(STAGES) + " | rest |",
        "|---|---|---|---|" + "---|" * (len(STAGES) + 1),
    ]
    first = ["| first call | import | load | first plan() | next |", "|---|---|---|---|---|"]
    for folder, goal in [*((folder, goal) for folder in args.data for goal in ("joint", "pose")), (SPACEBENCH, "floating")]:
        problems = problems_of(folder, goal, args.problems)
        name = f"{folder.name}, {goal}" if goal != "floating" else "SpaceBench, floating"
        stages.append(stages_row(name, problems, args.budget))
        first.append(first_row(name, folder, goal, args))
        loads.append(load_now())
        print(name, file=sys.stderr, flush=True)
    print("\n".join([*stages, "", *first, "", f"Load {min(loads):.1f} to {max(loads):.1f}. {machine_note()}."]))


def problems_of(folder: Path, goal: str, most: int | None) -> list[Problem]:
    """Return problems of each family; without a required clearance where the arm is MotionBenchMaker's."""
    if goal == "floating":
        return [item.problem for item in find_problems(folder, most=most) if item.problem.floats]
    items = find_items(folder, most=most)
    robot = find_robot(folder, items).load()
    problems = [replace(read_item(item, robot), clearance=0.0) for item in items]
    return problems if goal == "joint" else [at_pose(problem) for problem in problems]


def at_pose(problem: Problem) -> Problem:
    return replace(problem, goal=PoseGoal(forward_kinematics(problem.robot, problem.goal.q)))


def settings(budget: float) -> PlannerSettings:
    return PlannerSettings(evaluations=None, time_budget=budget, threads=1)


def stages_row(name: str, problems: list[Problem], budget: float) -> str:
    """Plan all problems, and return the row of the table; those whose ends collide are left out."""
    timings, found, seen = list[dict[str, float]](), 0, set[int]()
    for problem in problems:
        if id(problem.robot) not in seen:
            seen.add(id(problem.robot))
            plan(replace(problem), settings(budget), rng=0)
        made = plan(problem, settings(budget), rng=0)
        if made.trajectory is not None:
            timings.append(made.timings)
            found += made.found
    columns = [[sum(t.get(part, 0.0) for part in parts) for t in timings] for parts in STAGES.values()]
    totals = [t["total"] for t in timings]
    columns.append([total - sum(parts) for total, parts in zip(totals, zip(*columns, strict=True), strict=True)])
    whole = f"{1e3 * statistics.median(totals):.2f} / {1e3 * sorted(totals)[int(0.95 * (len(totals) - 1))]:.2f}"
    cells = [name, str(len(timings)), str(found), whole, *(f"{1e3 * statistics.median(column):.2f}" for column in columns)]
    return "| " + " | ".join(cells) + " |"


# ---- the first call --------------------------------------------------------------------------------------------------


def first_row(name: str, folder: Path, goal: str, args: argparse.Namespace) -> str:
    """Make first calls in fresh processes, and return the row of the table."""
    call = [sys.executable, __file__, "--data", str(folder), "--first", goal, "--budget", str(args.budget)]
    runs = [json.loads(subprocess.run(call, check=True, capture_output=True).stdout) for _ in range(args.processes)]
    medians = [statistics.median(run[what] for run in runs) for what in ("import", "load", "first", "next")]
    return f"| {name} | " + " | ".join(f"{1e3 * median:.1f}" for median in medians) + " |"


def first_call(folder: Path, goal: str, budget: float) -> dict[str, float]:
    """Time loading a problem, the first plan and later ones; and an import of spacearm, in another process yet."""
    code = "import time; begun = time.perf_counter(); import spacearm; print(time.perf_counter() - begun)"
    imported = float(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout)
    begun = time.perf_counter()
    problem = problems_of(folder, goal, 1)[0]
    chosen, taken = settings(budget), [time.perf_counter()]
    for _ in range(1 + LATER):
        plan(problem, chosen, rng=0)
        taken.append(time.perf_counter())
    calls = [end - begin for begin, end in itertools.pairwise(taken)]
    return {"import": imported, "load": taken[0] - begun, "first": calls[0], "next": statistics.median(calls[1:])}


if __name__ == "__main__":
    try:
        main()
    except SpacearmError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
