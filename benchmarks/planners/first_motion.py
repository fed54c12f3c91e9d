"""The first motion and its length, ours beside VAMP's, on any of VAMP's robots: in turn, in one run, on one core.

    python benchmarks/planners/first_motion.py --data DIR [--data DIR ...] --problems 10

DIR holds MotionBenchMaker's problems for a robot, as `spacearm bench mbm` takes them; its URDF's name begins with the robot's.
VAMP is RRT-Connect and its simplification, compiled from its source of PyPI, with its own settings for each robot. Its time is
its own count. Ours is the search of `plan()` alone, to the first motion; and once more for 10 ms, for the length. Times are as
measured, the least of `--repetitions` runs that do the same. What is found is looked at afterwards in steps of 0.005 rad by
Pinocchio and Coal: the search alone looks at instants, and `plan()` offers a motion only when it is proven.

A problem is left out where an end of it is in collision, for us or for VAMP. Times and lengths are compared on the problems
that VAMP solved. A motion that we do not find there counts as infinitely late. Lengths are compared where both have one: ours
after 10 ms, or, if the first motion comes later, that.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from cases import Case, Collection, along, load_collection
from page import put_into
from with_vamp import Answers, Vamp, own_trees

from spacearm.motion import Motion
from spacearm.planner import PlannerSettings
from spacearm.planner.motion_search import Islands
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.study.other_checker import STEP, OtherChecker, dense_configurations
from spacearm.study.reference_core import load_now, machine_note

LIMIT = 1.0
"""A motion that takes longer is not found [s]."""

BUDGET = 0.01
"""When the length is told [s]."""

TARGETS = {"first median": 0.6, "first p95": 1.0, "length": 0.95}
"""Ours over VAMP's, at most."""

_SLOW = 0.3  # seconds after which a run is not repeated


@dataclass
class Ours:
    """One seed of ours.

    Attributes:
        seed: of the search.
        first: time to the first motion [s]; None if there is none within `LIMIT`.
        evaluations: motions looked at before it.
        first_length: its length [rad].
        length: after `BUDGET`, or that of the first motion where it is later [rad].
        first_collides: whether Pinocchio and Coal find the first motion in collision; None: not looked at.
        collides: likewise the motion after `BUDGET`.
    """

    seed: int
    first: float | None = None
    evaluations: int = 0
    first_length: float | None = None
    length: float | None = None
    first_collides: bool | None = None
    collides: bool | None = None


@dataclass
class Row:
    """A problem: what VAMP found, and what we did.

    Attributes:
        robot: of the problem.
        family: of the problem.
        name: of the problem in its family.
        joints: of the robot that move.
        straight: length of the straight motion [rad].
        margin: that we ask for at what is looked at [m].
        vamp_free: whether VAMP takes both ends for free; None where it was not asked.
        vamp_seconds: of RRT-Connect and simplification [s].
        vamp_rough_seconds: of RRT-Connect alone [s].
        vamp_length: simplified [rad]; None: not solved.
        vamp_rough_length: before that [rad].
        vamp_collides: whether Pinocchio and Coal find the simplified path in collision; None: not looked at.
        ours: by seed.
    """

    robot: str
    family: str
    name: str
    joints: int
    straight: float
    margin: float
    vamp_free: bool | None = None
    vamp_seconds: float = np.nan
    vamp_rough_seconds: float = np.nan
    vamp_length: float | None = None
    vamp_rough_length: float | None = None
    vamp_collides: bool | None = None
    ours: list[Ours] = field(default_factory=list)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, action="append", required=True, help="the problems of a robot")
    parser.add_argument("--robot", action="append", default=[], help="only these robots; none: all")
    parser.add_argument("--group", help="whose joints move; none: as the requests say")
    parser.add_argument("--problems", type=int, help="of each family")
    parser.add_argument("--half", choices=("odd", "even", "all"), default="all", help="of the problems, by their numbers")
    parser.add_argument("--family", action="append", default=[], help="only families whose name begins so")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--repetitions", type=int, default=3, help="of each timed run")
    parser.add_argument("--only", choices=("ours", "vamp"), help="leave the other out")
    parser.add_argument("--families", action="store_true", help="a row for each family too")
    parser.add_argument("--no-check", action="store_true", help="do not look at the motions by Pinocchio and Coal")
    parser.add_argument("--json", type=Path, help="write every problem's numbers")
    parser.add_argument("--markdown", type=Path, help="write the tables")
    parser.add_argument("--page", type=Path, help="put the tables into this page")
    parser.add_argument("--readme", type=Path, help="put a short table into this page")
    parser.add_argument("--figure", type=Path, help="draw the share solved over time, for each robot")
    args = parser.parse_args()
    begun, loads = time.perf_counter(), [load_now()]
    rows: list[Row] = []
    left_out: dict[str, dict[str, str]] = {}
    for folder in args.data:
        collection = load_collection(folder, most=args.problems, half=args.half, group=args.group, families=args.family)
        if not args.robot or collection.robot in args.robot:
            left_out[collection.robot] = collection.left_out
            rows += measured(collection, args)
            loads.append(load_now())
            write_json(args.json, rows, left_out)
    lines = report(rows, left_out, args, loads, time.perf_counter() - begun)
    first = targets(groups(rows, families=False))
    print("\n".join([*first, "", *lines]))
    if args.markdown:
        args.markdown.write_text("\n".join([*first, "", *lines]) + "\n", encoding="utf-8")
    if args.page:
        put_into(args.page, "targets", first)
        put_into(args.page, "first motion", lines)
    if args.readme:
        put_into(args.readme, "speed", _table(groups(rows, families=False), _SHORT))
    if args.figure:
        draw(rows, args.figure)


def write_json(path: Path | None, rows: list[Row], left_out: dict[str, dict[str, str]]) -> None:
    if path is not None:
        path.write_text(json.dumps({"rows": [asdict(row) for row in rows], "left_out": left_out}, indent=1), encoding="utf-8")


# ---- measuring ---------------------------------------------------------------------------------------------------------


def measured(collection: Collection, args: argparse.Namespace) -> list[Row]:
    """Let both take turns, problem after problem; what VAMP takes for a collision goes to those left out."""
    vamp = None if args.only == "ours" else Vamp(collection.robot, collection.joints, repetitions=args.repetitions)
    other = None if args.no_check else collection.other_checker()
    rows = []
    for case in collection.cases:
        print(f"{collection.robot} {case.name}   ", end="\r", file=sys.stderr, flush=True)
        dof = len(collection.joints)
        row = Row(collection.robot, case.item.family, case.item.name, dof, case.straight, case.margin)
        if vamp is not None:
            _note(row, vamp.ask(case), case, other)
            if not row.vamp_free:
                collection.left_out[case.name] = "VAMP finds an end in collision"
                continue
        if args.only != "vamp":
            row.ours = [_ours(case, seed, args.repetitions, other) for seed in range(args.seeds)]
        rows.append(row)
    if vamp is not None:
        vamp.close()
    return rows


def _note(row: Row, answers: Answers, case: Case, other: OtherChecker | None) -> None:
    row.vamp_free = answers.start_free and answers.goal_free
    rough, simplified = answers.of("RRTC"), answers.of("RRTC+simplify")
    row.vamp_rough_seconds, row.vamp_seconds = rough.seconds, simplified.seconds
    if simplified.corners is not None:
        row.vamp_length, row.vamp_rough_length = simplified.length, rough.length
        if other is not None:
            row.vamp_collides = other.look(case.item, along(simplified.corners, STEP)).collisions > 0


def _ours(case: Case, seed: int, repetitions: int, other: OtherChecker | None) -> Ours:
    out = Ours(seed)
    for islands in [prepared(case, seed, LIMIT) for _ in range(repetitions)]:  # prepared before: one runs right after the other
        run(islands, LIMIT, until_first=True)
        history = islands.history()
        if not history or history[0].seconds > LIMIT:
            return out
        if out.first is None:
            motion = islands.motions()[-1]
            out.evaluations, out.first_length = history[0].evaluations, motion.length()
            out.first_collides = _collides(case, motion, other)
        out.first = min(history[0].seconds, out.first or np.inf)
        if out.first > _SLOW:
            break
    islands = searched(case, seed, BUDGET, until_first=False)
    improvements = zip(islands.history(), islands.motions()[::-1], strict=True)
    found = [motion for entry, motion in improvements if entry.seconds <= BUDGET]
    out.length = found[-1].length() if found else out.first_length
    out.collides = _collides(case, found[-1], other) if found else out.first_collides
    return out


def _collides(case: Case, motion: Motion, other: OtherChecker | None) -> bool | None:
    return None if other is None else other.look(case.item, dense_configurations(motion)).collisions > 0


def searched(case: Case, seed: int, seconds: float, *, until_first: bool) -> Islands:
    """The search of `plan()`, without the proof."""
    islands = prepared(case, seed, seconds)
    run(islands, seconds, until_first=until_first)
    return islands


def prepared(case: Case, seed: int, seconds: float) -> Islands:
    """A search that may begin."""
    settings = PlannerSettings(evaluations=None, time_budget=seconds, threads=1)
    return Islands(case.problem, case.goal[None].copy(), settings, seed=seed, searched=SearchedClearance(asked=case.margin))


def run(islands: Islands, seconds: float, *, until_first: bool) -> None:
    islands.run(evaluations=0, seconds=seconds, until_first=until_first, stall=0)


# ---- tables ------------------------------------------------------------------------------------------------------------


@dataclass
class Summary:
    """Of some rows; times in ms, lengths in rad."""

    name: str
    problems: int
    runs: int
    in_time: int
    vamp_solved: int
    ours_first: tuple[float, float]
    vamp_first: tuple[float, float]
    ours_length: float
    vamp_length: float
    ratio: float
    within_budget: int
    collide: tuple[int, int, int]

    @property
    def median(self) -> float:
        return self.ours_first[0] / self.vamp_first[0]

    @property
    def p95(self) -> float:
        return self.ours_first[1] / self.vamp_first[1]


def summary_of(name: str, rows: Sequence[Row]) -> Summary:
    runs = [(row, run) for row in rows for run in row.ours]
    common = [(row, run) for row, run in runs if row.vamp_length is not None]
    both = [(row, run) for row, run in common if run.length is not None]
    nan = float("nan")
    return Summary(
        name=name,
        problems=len(rows),
        runs=len(runs),
        in_time=sum(run.first is not None for _, run in runs),
        vamp_solved=sum(row.vamp_length is not None and row.vamp_seconds <= LIMIT for row in rows),
        ours_first=_quantiles([np.inf if run.first is None else 1e3 * run.first for _, run in common or runs]),
        vamp_first=_quantiles([1e3 * row.vamp_seconds for row in rows if row.vamp_length is not None]),
        ours_length=float(np.mean([run.length for _, run in both])) if both else nan,
        vamp_length=float(np.mean([row.vamp_length for row, _ in both])) if both else nan,
        ratio=float(np.mean([run.length / row.vamp_length for row, run in both])) if both else nan,
        within_budget=sum(run.first is not None and run.first <= BUDGET for _, run in runs),
        collide=(
            sum(bool(run.first_collides) for _, run in runs),
            sum(bool(run.collides) for _, run in runs),
            sum(bool(row.vamp_collides) for row in rows),
        ),
    )


def _quantiles(values: Sequence[float]) -> tuple[float, float]:
    if not values:
        return float("nan"), float("nan")
    median, p95 = np.percentile(values, [50, 95], method="higher" if np.isinf(values).any() else "linear")
    return float(median), float(p95)


def called(row: Row) -> str:
    """Return how a row's robot is called in a table."""
    return f"{_CALLED.get(row.robot, row.robot)}, {row.joints} joints"


_CALLED = {"panda": "Panda", "ur5": "UR5", "fetch": "Fetch", "baxter": "Baxter"}


def groups(rows: Sequence[Row], *, families: bool) -> list[Summary]:
    out = []
    for robot in dict.fromkeys(row.robot for row in rows):
        own = [row for row in rows if row.robot == robot]
        out.append(summary_of(called(own[0]), own))
        if families:
            names = dict.fromkeys(row.family for row in own)
            out += [
                summary_of(f"{robot}: {name.removesuffix(f'_{robot}')}", [row for row in own if row.family == name])
                for name in names
            ]
    return out


def report(
    rows: list[Row], left_out: dict[str, dict[str, str]], args: argparse.Namespace, loads: Sequence[float], seconds: float
) -> list[str]:
    """Return the lines: what was missed, the first motion, the length, what was left out."""
    summaries = groups(rows, families=args.families)
    half = {"odd": " with odd numbers", "even": " with even numbers", "all": ""}[args.half]
    return [
        f"{len(rows)} problems{half}, seeds of ours: {args.seeds}, least of {args.repetitions} runs; {seconds:.0f} s in all, "
        f"load {min(loads):.1f} to {max(loads):.1f}. {machine_note()}.",
        f"VAMP's nearest neighbours: {'its own k-d trees' if own_trees() else 'a scan in place of its k-d trees'}.",
        "",
        "**How soon is there a motion?** One core, as measured, median / p95; on the problems that VAMP solved.",
        "",
        *_table(summaries, _FIRST),
        "",
        f"**How long is it?** Ours after {1e3 * BUDGET:g} ms, beside VAMP's simplified path; means, and mean of the ratios.",
        "",
        *_table(summaries, _LENGTH),
        "",
        _left_out(left_out),
    ]


Columns = tuple[tuple[str, Callable[[Summary], str]], ...]

_FIRST: Columns = (
    ("robot", lambda s: s.name),
    ("problems", lambda s: str(s.problems)),
    ("ours [ms]", lambda s: "{:.2f} / {:.2f}".format(*s.ours_first)),
    ("VAMP, simplified [ms]", lambda s: "{:.2f} / {:.2f}".format(*s.vamp_first)),
    ("ours / VAMP", lambda s: f"{s.median:.2f} / {s.p95:.2f}"),
    ("ours within 1 s", lambda s: f"{s.in_time} of {s.runs}"),
    ("VAMP within 1 s", lambda s: f"{s.vamp_solved} of {s.problems}"),
    ("ours collide", lambda s: str(s.collide[0])),
    ("VAMP's collide", lambda s: str(s.collide[2])),
)

_LENGTH: Columns = (
    ("robot", lambda s: s.name),
    ("problems", lambda s: str(s.problems)),
    ("ours [rad]", lambda s: f"{s.ours_length:.3f}"),
    ("VAMP, simplified [rad]", lambda s: f"{s.vamp_length:.3f}"),
    ("ours / VAMP", lambda s: f"{s.ratio:.3f}"),
    ("first motion within 10 ms", lambda s: f"{s.within_budget} of {s.runs}"),
    ("ours collide", lambda s: str(s.collide[1])),
)


_SHORT: Columns = (
    ("robot", lambda s: s.name),
    ("problems", lambda s: str(s.problems)),
    ("first motion, median / 95 in 100", lambda s: "{:.2f} / {:.2f} ms".format(*s.ours_first)),
    ("VAMP", lambda s: "{:.2f} / {:.2f} ms".format(*s.vamp_first)),
    ("found within 1 s", lambda s: f"{s.in_time} (VAMP {s.vamp_solved})"),
    ("length after 10 ms, ours / VAMP's", lambda s: f"{s.ratio:.2f}"),
)


def _table(summaries: Sequence[Summary], columns: Columns) -> list[str]:
    lines = ["| " + " | ".join(name for name, _ in columns) + " |", "|---" * len(columns) + "|"]
    return lines + ["| " + " | ".join(cell(summary) for _, cell in columns) + " |" for summary in summaries]


def targets(summaries: Sequence[Summary]) -> list[str]:
    """Return a table of the targets of each robot, those that are missed first."""
    missed, met = [], []
    for s in summaries:
        if not s.runs:
            continue
        share = 100 * s.in_time / s.runs
        checks = [("found within 1 s", "100 %", f"{share:.4g} %", s.in_time == s.runs)]
        if s.vamp_solved:
            values = {"first median": s.median, "first p95": s.p95, "length": s.ratio}
            checks += [
                (_SAID[name], f"≤ {most:g} ×", f"{values[name]:.2f} ×", values[name] <= most) for name, most in TARGETS.items()
            ]
        for name, target, value, ok in checks:
            row = f"| {s.name}: {name} | {target} | {value} |"
            (met if ok else missed).append(f"{row} yes |" if ok else f"{row} **no** |")
    return ["| what | target | measured | met |", "|---|---|---|---|", *missed, *met]


_SAID = {
    "first median": "first motion beside VAMP's simplified, median",
    "first p95": "first motion beside VAMP's simplified, 95 in 100",
    "length": f"length after {1e3 * BUDGET:g} ms beside VAMP's simplified",
}


def _left_out(left_out: dict[str, dict[str, str]]) -> str:
    parts = []
    for robot, reasons in left_out.items():
        theirs = sum(reason.startswith("VAMP") for reason in reasons.values())
        parts.append(f"{len(reasons)} of {robot}" + (f" ({theirs} for VAMP alone)" if theirs else ""))
    return f"Left out, for an end is in collision: {', '.join(parts)}."


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the share of the problems that is solved within a time, for each robot."""
    from matplotlib.ticker import FuncFormatter

    from spacearm.show.figure_style import BLUE, PAGE, VERMILION, look, new_figure, tidy

    robots = list(dict.fromkeys(row.robot for row in rows))
    with look():
        figure = new_figure(PAGE, 2.2)
        axes = figure.subplots(1, len(robots), sharey=True, sharex=True, squeeze=False)[0]
        for ax, robot in zip(axes, robots, strict=True):
            own = [row for row in rows if row.robot == robot]
            ours = [run.first for row in own for run in row.ours]
            theirs = [row.vamp_seconds if row.vamp_length is not None else None for row in own]
            for values, color, name in (
                (ours, BLUE, "spacearm, first motion"),
                (theirs, VERMILION, "VAMP, RRT-Connect and simplification"),
            ):
                found = np.sort([1e3 * value for value in values if value is not None])
                share = 100 * np.arange(1, len(found) + 1) / max(len(values), 1)
                if len(found):
                    ax.step([*found, 1e3 * LIMIT], [*share, share[-1]], where="post", color=color, label=name)
            ax.set(xscale="log", xlabel="time [ms]", title=called(own[0]), xlim=(0.01, 1e3), ylim=(0, 101))
            ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            tidy(ax)
        axes[0].set_ylabel("solved [%]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
        figure.savefig(path, dpi=200, metadata={"Software": None, "Title": "first motions"})


if __name__ == "__main__":
    main()
