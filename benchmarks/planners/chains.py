"""How the first motion grows with the number of joints: chains of 6 to 30 joints among shelves.

    python benchmarks/planners/chains.py --figure docs/figures/chains.png

Every chain is 1.5 m long; its joints turn about z and y by turns (`scaling.arm`). In front of it stands a shelf of three by
three compartments. A problem leads from one compartment to another: both ends are drawn there with the tip inside and 1 cm of
clearance or more, and the straight motion between them collides. The problems are the same on every machine. Ours is the search
of `plan()` alone. OMPL's RRT-Connect with its own settings, without simplification, asks the same kernel through Python; its
time is told without Python. What is found is looked at afterwards in steps of 0.005 rad, in float64.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from cases import ENVIRONMENT, MARGIN, Case, Trace
from first_motion import LIMIT, searched
from page import put_into
from scaling import arm

from spacearm.geometry import Box, Scene
from spacearm.planner import Problem, clearance
from spacearm.planner.kernel_model import kernel_model
from spacearm.robot import Robot, forward_kinematics, joint_frames
from spacearm.study.motionbenchmaker import Item
from spacearm.study.other_checker import dense_configurations
from spacearm.study.reference_core import load_now, machine_note

JOINTS = (6, 8, 10, 12, 15, 20, 25, 30)
NEAR, FAR = 0.65, 1.05  # the shelf's front and back [m]
WIDTH, HEIGHT = 1.2, 0.9  # of the shelf [m]
BOARD = 0.02  # thickness of its boards [m]
DEEP = 0.15  # how far the tip is in a compartment [m]
ROOM = 0.01  # clearance of start and goal [m]
DRAWN = 1_000  # configurations to begin with, for a compartment
STEPS = 40  # of damped least squares from each of them


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--joints", type=int, nargs="+", default=JOINTS)
    parser.add_argument("--problems", type=int, default=6, help="of each number of joints")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=2.0, help="of OMPL, Python and all")
    parser.add_argument("--no-ompl", action="store_true", help="leave OMPL out")
    parser.add_argument("--json", type=Path, help="write the numbers")
    parser.add_argument("--markdown", type=Path, help="write the table")
    parser.add_argument("--page", type=Path, help="put the table into this page")
    parser.add_argument("--figure", type=Path, help="draw them")
    args = parser.parse_args()
    sys.path.append(str(ENVIRONMENT))
    begun, loads = time.perf_counter(), [load_now()]
    rows = []
    for count in args.joints:
        rows.append(measured(count, chain_cases(count, args.problems), args))
        loads.append(load_now())
    lines = report(rows, args, loads, time.perf_counter() - begun)
    print("\n".join(lines))
    if args.markdown:
        args.markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")
    if args.page:
        put_into(args.page, "chains", lines)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    if args.figure:
        draw(rows, args.figure)


# ---- problems ----------------------------------------------------------------------------------------------------------


def shelf() -> list[Box]:
    """Four boards, four uprights and a back; in front of a base at the origin."""
    middle, depth = (NEAR + FAR) / 2, FAR - NEAR
    boards = [Box([depth, WIDTH, BOARD], [middle, 0, z]) for z in np.linspace(-HEIGHT / 2, HEIGHT / 2, 4)]
    uprights = [Box([depth, BOARD, HEIGHT], [middle, y, 0]) for y in np.linspace(-WIDTH / 2, WIDTH / 2, 4)]
    return [*boards, *uprights, Box([BOARD, WIDTH, HEIGHT], [FAR, 0, 0])]


def chain_cases(dof: int, problems: int) -> list[Case]:
    """Problems for a chain, the same on every machine."""
    robot, scene = arm(dof), Scene(shelf())
    rng = np.random.default_rng(dof)
    ends = [_in_compartment(robot, scene, y, z, rng) for y in (-1, 0, 1) for z in (-1, 0, 1)]
    out: list[Case] = []
    for _ in range(100 * problems):
        a, b = rng.choice(len(ends), 2, replace=False)
        if not (len(ends[a]) and len(ends[b])):
            continue
        start, goal = ends[a][rng.integers(len(ends[a]))], ends[b][rng.integers(len(ends[b]))]
        problem = Problem(robot, scene, start=start, goal=goal)
        way = start + np.linspace(0, 1, 64)[:, None] * (goal - start)
        if clearance(problem, way).min() < 0:
            number = f"{len(out) + 1:04d}"
            item = Item(family=f"chain_{dof}", name=number, scene=Path("drawn"), request=Path("drawn"))
            out.append(Case(item, problem, MARGIN))
            _ = kernel_model(robot, scene).model32
            if len(out) == problems:
                break
    return out


def _in_compartment(robot: Robot, scene: Scene, column: int, row: int, rng: np.random.Generator) -> np.ndarray:
    """Return free configurations (m, n) with the tip in a compartment, by damped least squares from drawn ones."""
    target = np.array([NEAR + DEEP, column * WIDTH / 3, row * HEIGHT / 3])
    q = rng.uniform(robot.lower, robot.upper, (DRAWN, robot.dof)) * rng.uniform(0.1, 1, (DRAWN, 1))
    for _ in range(STEPS):
        frames, tip = joint_frames(robot, q), forward_kinematics(robot, q)[:, :3, 3]
        arms = tip[:, None] - frames[:, :, :3, 3]
        jacobian = np.cross(frames[:, :, :3, 2], arms)  # (m, n, 3): every joint turns about its z axis
        square = np.einsum("mni,mnj->mij", jacobian, jacobian) + 1e-3 * np.eye(3)
        away = np.clip(target - tip, -0.1, 0.1)
        q = np.clip(
            q + np.einsum("mni,mi->mn", jacobian, np.linalg.solve(square, away[..., None])[..., 0]), robot.lower, robot.upper
        )
    q = q[np.linalg.norm(forward_kinematics(robot, q)[:, :3, 3] - target, axis=1) < 0.02]
    if not len(q):
        return q
    probe = Problem(robot, scene, start=np.zeros(robot.dof), goal=np.zeros(robot.dof))
    return q[clearance(probe, q) > ROOM]


# ---- measuring ---------------------------------------------------------------------------------------------------------


def measured(dof: int, cases: Sequence[Case], args: argparse.Namespace) -> dict[str, Any]:
    """Let both take turns on the problems of a number of joints."""
    ours: list[float] = []
    theirs: list[float] = []
    evaluations: list[float] = []
    collide = [0, 0]
    crossing = 0.0 if args.no_ompl else _crossing(cases[0])
    for case, seed in itertools.product(cases, range(args.seeds)):
        print(f"{dof} joints, {case.name}, seed {seed}    ", end="\r", file=sys.stderr, flush=True)
        islands = searched(case, seed, LIMIT, until_first=True)
        history = islands.history()
        found = bool(history) and history[0].seconds <= LIMIT
        ours.append(history[0].seconds if found else np.inf)
        evaluations.append(history[0].evaluations if found else np.inf)
        collide[0] += found and _collides(case, dense_configurations(islands.motions()[-1]))
        if not args.no_ompl:
            trace = _ompl(case, seed, args.seconds)
            bare = trace.seconds - trace.python - trace.calls * crossing
            theirs.append(max(bare, 0.0) if trace.solved else np.inf)
            collide[1] += trace.solved and _collides(case, trace.way)
    return {
        "joints": dof,
        "problems": len(cases),
        "ours": ours,
        "evaluations": evaluations,
        "ompl": theirs,
        "collide": collide,
    }


def _ompl(case: Case, seed: int, seconds: float) -> Trace:
    import with_ompl

    return with_ompl.planned("RRTConnect", case, seed, seconds, simplify=False, step=None)


def _crossing(case: Case) -> float:
    import with_ompl

    return with_ompl.empty_call(case)


def _collides(case: Case, q: np.ndarray) -> int:
    return int(clearance(case.problem, q).min() < 0)


# ---- telling -----------------------------------------------------------------------------------------------------------


def report(rows: Sequence[dict[str, Any]], args: argparse.Namespace, loads: Sequence[float], seconds: float) -> list[str]:
    lines = [
        f"{rows[0]['problems']} problems of each number of joints, {args.seeds} seeds; {seconds:.0f} s in all, load "
        f"{min(loads):.1f} to {max(loads):.1f}. {machine_note()}.",
        "",
        "First motion, median / p95; a problem that is not solved counts as infinitely late.",
        "",
        "| joints | ours [ms] | motions looked at, median | ours within 1 s | ours collide | OMPL without Python [ms] | "
        "OMPL solved | OMPL's collide |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        cells = [str(row["joints"]), _quantiles(row["ours"]), f"{_quantile(row['evaluations'], 50):,.0f}", _share(row["ours"])]
        cells += [str(row["collide"][0]), _quantiles(row["ompl"]), _share(row["ompl"]), str(row["collide"][1])]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _quantile(values: Sequence[float], percent: float) -> float:
    """Return the value that so many in a hundred do not exceed; it may be infinite."""
    return float(np.percentile(values, percent, method="higher")) if len(values) else float("nan")


def _quantiles(values: Sequence[float]) -> str:
    return " / ".join(f"{1e3 * _quantile(values, percent):.2f}" for percent in (50, 95)) if values else "-"


def _share(values: Sequence[float]) -> str:
    return f"{int(np.isfinite(values).sum())} of {len(values)}" if values else "-"


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Draw the time to the first motion, and the share that is found, by the number of joints."""
    from matplotlib.ticker import FuncFormatter

    from spacearm.show.figure_style import BLUE, PAGE, VERMILION, look, new_figure, tidy

    joints = [row["joints"] for row in rows]
    with look():
        figure = new_figure(PAGE, 2.6)
        left, right = figure.subplots(1, 2, width_ratios=[3, 2])
        for key, color, name in (
            ("ours", BLUE, "spacearm, search alone"),
            ("ompl", VERMILION, "OMPL RRT-Connect, without Python"),
        ):
            if not rows[0][key]:
                continue
            for percent, line, marker in ((50, "-", "o"), (95, (0, (4, 2)), "^")):
                values = np.array([1e3 * _quantile(row[key], percent) for row in rows])
                shown = np.where(np.isfinite(values), values, np.nan)
                label = f"{name}, {'median' if percent == 50 else '95 in 100'}"
                left.plot(joints, shown, marker=marker, linestyle=line, color=color, markersize=3, label=label)
            right.plot(joints, [100 * np.isfinite(row[key]).mean() for row in rows], "o-", color=color, markersize=3)
        left.set(yscale="log", xlabel="joints", ylabel="first motion [ms]")
        left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        right.set(xlabel="joints", ylabel="found in time [%]", ylim=(0, 103))
        for ax in (left, right):
            ax.set_xticks(joints)
            tidy(ax)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        figure.savefig(path, dpi=200, metadata={"Software": None, "Title": "chains"})


if __name__ == "__main__":
    main()
