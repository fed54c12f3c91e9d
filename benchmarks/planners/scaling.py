"""How time grows: with the number of obstacles, of joints, of threads.

    python benchmarks/planners/scaling.py --figure docs/figures/scaling.png

The arms are drawn, each 1.5 m long. Three balls stand in their way, as three spheres or as so many that cover them: the free
space stays nearly the same, and only the number of obstacles grows, as it does when a mesh or a point cloud is told more
finely. For a check of configurations alone the same number is also strewn all over the place. Start and goal are free by
1 cm, and the straight motion between them collides. All sizes take turns, round after round; a number is the median over its
rounds and problems. Times are as measured.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from page import put_into

from spacearm.geometry import Scene, Sphere
from spacearm.motion import Motion
from spacearm.planner import PlannerSettings, Problem, clearance
from spacearm.planner.kernel_model import kernel_model
from spacearm.planner.motion_search import Islands
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.robot import Frame, Joint, LinkCapsule, Robot
from spacearm.study.reference_core import REFERENCE, load_now, machine, seconds_per_configuration

OBSTACLES = (3, 10, 30, 100, 300, 1_000, 3_000, 10_000)
JOINTS = (6, 7, 10, 15, 20, 30)
REACH = 1.5  # length of every arm [m]
THICKNESS = 0.04  # radius of every link [m]
BALL = 0.25  # radius of each of the three balls [m]
STREWN = 0.004  # radius of obstacles all over the place [m]
ATTEMPTS = 20_000  # at drawing a problem
EVALUATIONS = 5_000
ROWS = 2_048  # configurations that are checked together
INSTANTS = 64  # of a motion that is checked


@dataclass(frozen=True)
class Size:
    """Problems of one size: the same robot among obstacles, some of them."""

    name: int
    radius: float
    problems: list[Problem]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--problems", type=int, default=6, help="of each size")
    parser.add_argument("--json", type=Path, help="write the numbers")
    parser.add_argument("--markdown", type=Path, help="write the tables")
    parser.add_argument("--page", type=Path, help="put the tables into this page")
    parser.add_argument("--figure", type=Path, help="draw them")
    args = parser.parse_args()
    begun = time.perf_counter()
    core, loads = [seconds_per_configuration()], [load_now()]
    by_obstacles = measured([drawn(7, count, args.problems) for count in OBSTACLES], args.rounds)
    core.append(seconds_per_configuration())
    by_joints = measured([drawn(count, 12, args.problems, name=count) for count in JOINTS], args.rounds)
    core.append(seconds_per_configuration())
    by_threads = threads(drawn(7, 30, args.problems), 2 * args.rounds)
    core.append(seconds_per_configuration())
    loads.append(load_now())
    found = {
        "machine": machine(),
        "numpy": float(np.median(core)),
        "loads": loads,
        "seconds": time.perf_counter() - begun,
        "obstacles": by_obstacles,
        "joints": by_joints,
        "threads": by_threads,
    }
    lines = report(found)
    print("\n".join(lines))
    if args.markdown:
        args.markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")
    if args.page:
        put_into(args.page, "scaling", lines)
    if args.json:
        args.json.write_text(json.dumps(found, indent=1), encoding="utf-8")
    if args.figure:
        draw(found, args.figure)


# ---- drawn problems ----------------------------------------------------------------------------------------------------


def arm(dof: int) -> Robot:
    """A serial arm on a column: the first joint turns about z, the others about z and y by turns, links of one length."""
    length = REACH / dof
    joints, capsules = [], []
    for i in range(dof):
        T = np.eye(4)
        if i:
            T[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]] if i % 2 else [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
            T[0, 3] = length
        joints.append(Joint(name=f"joint_{i}", kind="revolute", parent=i - 1, T_parent_joint=T))
        end = np.array([length, 0.0, 0.0])
        capsules.append(LinkCapsule(name=f"link_{i}", joint=i, a=np.zeros(3), b=end, radius=THICKNESS))
    tip = np.eye(4)
    tip[0, 3] = length
    bend = np.full(dof, min(2.8, 14.0 / dof))
    return Robot(
        name=f"drawn_{dof}",
        joints=tuple(joints),
        capsules=tuple(capsules),
        frames=(Frame(name="tip", joint=dof - 1, T_joint_frame=tip),),
        tip="tip",
        lower=-bend,
        upper=bend,
        velocity=np.full(dof, 2.0),
        acceleration=np.full(dof, 4.0),
    )


def drawn(dof: int, obstacles: int, problems: int, *, name: int | None = None) -> Size:
    """Problems of a size; the same on every machine."""
    robot, spheres = arm(dof), covered(obstacles)
    scene, radius = Scene(spheres), float(spheres[0].radius)
    rng = np.random.default_rng(dof)  # the same problems for every number of spheres, as far as they are free
    made: list[Problem] = []
    for _ in range(ATTEMPTS):
        ends = rng.uniform(robot.lower, robot.upper, (2, dof))
        problem = Problem(robot, scene, start=ends[0], goal=ends[1])
        way = ends[0] + np.linspace(0, 1, 64)[:, None] * (ends[1] - ends[0])
        if clearance(problem, ends).min() > 0.01 and clearance(problem, way).min() < 0:
            made.append(problem)
            if len(made) == problems:
                return Size(obstacles if name is None else name, radius, made)
    raise RuntimeError(f"{len(made)} problems found for {dof} joints and {obstacles} obstacles")


def covered(count: int) -> list[Sphere]:
    """So many spheres, within three balls and over all of their surfaces."""
    out = []
    for i, centre in enumerate(np.array([[0.75, 0.25, 0.2], [-0.3, 0.75, -0.1], [-0.35, -0.7, 0.25]])):
        own = count // 3 + (i < count % 3)
        radius = min(0.8 * BALL, 2.4 * BALL / np.sqrt(own)) if own > 1 else BALL
        k = np.arange(own) + 0.5
        height, turn = 1 - 2 * k / own, np.pi * (1 + 5**0.5) * k  # evenly over the surface
        flat = np.sqrt(1 - height**2)
        shell = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)
        out += [Sphere(centre + (BALL - radius) * direction, radius) for direction in shell]
    return out


def strewn(count: int) -> list[Sphere]:
    """So many small spheres, all over the place."""
    points = np.random.default_rng(count).uniform(-REACH, REACH, (count, 3))
    return [Sphere(point, STREWN) for point in points]


# ---- measuring ---------------------------------------------------------------------------------------------------------


def measured(sizes: list[Size], rounds: int) -> list[dict[str, Any]]:
    """Let all sizes take turns."""
    tables: list[dict[str, list[float]]] = [{} for _ in sizes]
    for round_ in range(rounds):
        for size, table in zip(sizes, tables, strict=True):
            print(f"{size.name}, round {round_ + 1}    ", end="\r", file=sys.stderr, flush=True)
            for number, problem in enumerate(size.problems):
                for key, value in once(problem, seed=round_, everything=number == 0).items():
                    table.setdefault(key, []).append(value)
    return [
        {"size": size.name, "radius": size.radius, "unsolved": int(sum(np.isinf(table["first"])))}
        | {key: float(np.median(values)) for key, values in table.items()}
        for size, table in zip(sizes, tables, strict=True)
    ]


def once(problem: Problem, *, seed: int, everything: bool) -> dict[str, float]:
    """Seconds of each thing, for one problem; what depends on the scene alone only with `everything`."""
    robot, goal = problem.robot, problem.goal.q
    out = {}
    if everything:
        rng = np.random.default_rng(seed)
        fresh = Scene(problem.scene.obstacles)
        copies = [Scene(problem.scene.obstacles) for _ in range(3)]
        out["prepare"] = min(taken(lambda copy=copy: kernel_model(robot, copy).model32) for copy in copies)
        native = kernel_model(robot, fresh).model32
        rows = rng.uniform(robot.lower, robot.upper, (ROWS, robot.dof)).astype(np.float32)
        native.shortfalls(rows, 0.002, False)
        out["configuration"] = min(taken(lambda: native.shortfalls(rows, 0.002, True)) for _ in range(3)) / ROWS
        cloud = kernel_model(robot, Scene(strewn(len(problem.scene.obstacles)))).model32
        cloud.shortfalls(rows, 0.002, False)
        out["strewn"] = min(taken(lambda: cloud.shortfalls(rows, 0.002, False)) for _ in range(3)) / ROWS
        bends = np.clip(0.3 * rng.normal(size=(64, 2, robot.dof)), -1, 1)
        ends = np.stack([problem.start, goal])
        thirds = ends[0] + np.array([[1], [2]]) / 3 * (ends[1] - ends[0])
        inner = np.clip(thirds + bends, robot.lower, robot.upper)
        motions = [Motion(np.vstack([ends[:1], points, ends[1:]])) for points in inner]
        rows = np.concatenate([motion.sample(np.linspace(0, 1, INSTANTS)) for motion in motions]).astype(np.float32)
        native.shortfalls(rows, 0.002, False)
        out["motion"] = min(taken(lambda: native.shortfalls(rows, 0.002, False)) for _ in range(3)) / len(motions)
    settings = PlannerSettings(evaluations=EVALUATIONS)
    islands = Islands(problem, goal[None].copy(), settings, seed=seed, searched=SearchedClearance(asked=0.002))
    seconds = taken(lambda: islands.run(evaluations=EVALUATIONS, seconds=20.0, until_first=False, stall=0))
    history = islands.history()
    out["first"] = history[0].seconds if history else np.inf
    out["evaluations"] = seconds
    return out


def taken(call: Callable[[], Any]) -> float:
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun


def threads(size: Size, rounds: int) -> dict[str, float]:
    """Two islands on one thread and on two, by turns; the same motions come out.

    How much two threads can give here is told by a task that they cannot disturb each other at: checks of configurations.
    """
    table: dict[int, list[float]] = {1: [], 2: []}
    found: dict[int, list[float]] = {1: [], 2: []}
    control: list[float] = []
    for round_ in range(rounds):
        for problem in size.problems:
            for count in (1, 2):
                settings = PlannerSettings(evaluations=4 * EVALUATIONS, islands=2, threads=count)
                islands = Islands(
                    problem, problem.goal.q[None].copy(), settings, seed=round_, searched=SearchedClearance(asked=0.002)
                )
                run = lambda: islands.run(evaluations=4 * EVALUATIONS, seconds=0, until_first=False, stall=0)  # noqa: B023, E731
                table[count].append(taken(run))
                found[count].append(min((entry.fitness for entry in islands.history()), default=np.inf))
            control.append(_control(problem))
    return {
        "one": float(np.median(table[1])),
        "two": float(np.median(table[2])),
        "ratio": float(np.median(np.array(table[1]) / np.array(table[2]))),
        "best_ratio": float(np.percentile(np.array(table[1]) / np.array(table[2]), 90)),
        "control": float(np.median(control)),
        "same": bool(np.array_equal(found[1], found[2])),
    }


def _control(problem: Problem) -> float:
    """How much faster two threads check 100 times 2,048 configurations than one does."""
    robot = problem.robot
    native = kernel_model(robot, problem.scene).model32
    rows = np.random.default_rng(0).uniform(robot.lower, robot.upper, (ROWS, robot.dof)).astype(np.float32)

    def work() -> None:
        for _ in range(50):
            native.shortfalls(rows, 0.002, False)

    alone = taken(lambda: (work(), work()))
    with ThreadPoolExecutor(2) as pool:
        together = taken(lambda: [task.result() for task in [pool.submit(work), pool.submit(work)]])
    return alone / together


# ---- telling -----------------------------------------------------------------------------------------------------------


def report(found: dict[str, Any]) -> list[str]:
    scale = REFERENCE / found["numpy"]
    lines = [
        ", ".join(f"{key} {value}" for key, value in found["machine"].items()) + ".",
        f"The NumPy kernel took {1e6 * found['numpy']:.2f} us a configuration (times {scale:.2f} are the reference core's); "
        f"load {min(found['loads']):.1f} to {max(found['loads']):.1f}; {found['seconds']:.0f} s in all.",
    ]
    for key, title in (("obstacles", "sphere obstacles, 7 joints"), ("joints", "joints, 12 sphere obstacles")):
        lines += [
            "",
            f"**{title}**, as measured",
            "",
            f"| {key} | radius [mm] | prepare [ms] | configuration [ns] | all of it, strewn [ns] | motion [us] | first [ms] | "
            f"{EVALUATIONS:,} evaluations [ms] | unsolved |",
            "|---|---|---|---|---|---|---|---|---|",
        ]
        for row in found[key]:
            cells = [f"{row['size']:,}", f"{1e3 * row['radius']:.1f}", f"{1e3 * row['prepare']:.2f}"]
            cells += [f"{1e9 * row[key]:.0f}" for key in ("configuration", "strewn")]
            cells += [f"{1e6 * row['motion']:.1f}", f"{1e3 * row['first']:.3f}", f"{1e3 * row['evaluations']:.1f}"]
            cells.append(str(row["unsolved"]))
            lines.append("| " + " | ".join(cells) + " |")
    given = found["threads"]
    lines += [
        "",
        f"**threads**: two islands of {4 * EVALUATIONS:,} evaluations on one thread {1e3 * given['one']:.1f} ms, on two "
        f"{1e3 * given['two']:.1f} ms: {given['ratio']:.2f} times as fast (median; 90th percentile {given['best_ratio']:.2f}); "
        f"checks of configurations alone gain {given['control']:.2f} times; "
        f"{'the same motions' if given['same'] else 'NOT the same motions'}",
    ]
    return lines


def draw(found: dict[str, Any], path: Path) -> None:
    from matplotlib.ticker import FuncFormatter

    from spacearm.show.figure_style import BLUE, GREEN, GREY, ORANGE, PAGE, SKY, VERMILION, look, new_figure, tidy

    lines = (
        ("configuration", 1e6, BLUE, "one configuration [us]"),
        ("strewn", 1e6, SKY, "one configuration, all of it, strewn [us]"),
        ("motion", 1e6, GREEN, f"one motion, {INSTANTS} instants [us]"),
        ("first", 1e3, VERMILION, "first motion [ms]"),
        ("evaluations", 1e3, ORANGE, f"{EVALUATIONS:,} evaluations [ms]"),
        ("prepare", 1e3, GREY, "preparation [ms]"),
    )
    with look():
        figure = new_figure(PAGE, 3.0)
        left, middle, right = figure.subplots(1, 3, width_ratios=[5, 4, 2.2])
        for ax, key, label in ((left, "obstacles", "sphere obstacles"), (middle, "joints", "joints")):
            sizes = np.array([row["size"] for row in found[key]], dtype=float)
            for name, unit, color, text in lines:
                values = np.array([row[name] for row in found[key]]) * unit
                ax.plot(sizes, values, "o-", color=color, markersize=3, label=text)
            for name, unit, _, _ in lines[2:3]:
                slope = found[key][0][name] * unit * sizes / sizes[0]
                ax.plot(sizes, slope, color=GREY, linewidth=0.6, linestyle=(0, (4, 2)), label="proportional")
            ax.set(xscale="log", yscale="log", xlabel=label)
            ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
            ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
            tidy(ax)
        middle.set_xticks(JOINTS, [str(count) for count in JOINTS])
        middle.minorticks_off()
        left.set_ylabel("time as measured")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        given = found["threads"]
        bars = right.bar(
            ["1 thread", "2 threads"], [1e3 * given["one"], 1e3 * given["two"]], color=[BLUE, VERMILION], width=0.6
        )
        right.bar_label(bars, fmt="%.0f", fontsize=6.5)
        right.set_ylabel(f"two islands, {4 * EVALUATIONS:,} evaluations each [ms]")
        tidy(right, grid="y")
        figure.savefig(path, dpi=200, metadata={"Software": None, "Title": "scaling"})


if __name__ == "__main__":
    main()
