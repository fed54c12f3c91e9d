"""`plan()` with its proof on any robots: how many motions are found and certified, and how long it takes.

    python benchmarks/planners/certified.py --data DIR [--data DIR ...] --problems 3

This is `spacearm bench mbm` for several robots, in one table; that command says what is measured. Times are as measured.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from page import put_into

from spacearm.core.errors import SpacearmError
from spacearm.study.motionbenchmaker import find_items, find_robot
from spacearm.study.motionbenchmaker_report import summary_of
from spacearm.study.motionbenchmaker_runs import Benchmark, Protocol, run_benchmark
from spacearm.study.reference_core import load_note, machine_note


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, action="append", required=True, help="the problems of a robot")
    parser.add_argument("--problems", type=int, help="of each family")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--search", type=float, default=0.01, help="of the search alone [s of the reference core]")
    parser.add_argument("--budget", type=float, default=0.2, help="of the search in plan() [s of the reference core]")
    parser.add_argument("--page", type=Path, help="put the table into this page")
    args = parser.parse_args()
    protocol = Protocol(seeds=args.seeds, search=args.search, plan=args.budget)
    benches = []
    for folder in args.data:
        items = find_items(folder, most=args.problems)
        robot = find_robot(folder, items)
        print(f"{robot.urdf.stem}   ", end="\r", file=sys.stderr, flush=True)
        benches.append(run_benchmark(items, robot, protocol))
    lines = report(benches, args)
    print("\n".join(lines))
    if args.page:
        put_into(args.page, "certified", lines)


def report(benches: list[Benchmark], args: argparse.Namespace) -> list[str]:
    load = load_note([load for bench in benches for load in bench.loads]) or "load: not known"
    lines = [
        f"Seeds: {args.seeds}. {sum(bench.seconds for bench in benches):.0f} s in all, {load}. {machine_note()}.",
        "",
        "| robot | problems | ends collide | certified within 1 s | plan() [ms] | one certificate [ms] | proofs, mean / most | "
        "collide afterwards |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for bench in benches:
        s = summary_of(bench.runs, raw=True)
        cells = [bench.robot.urdf.stem.split("_")[0], str(s.runs), str(s.ends_collide), f"{s.certified} of {s.runs}"]
        cells += [f"{1e3 * spread.median:.1f} / {1e3 * spread.p95:.1f}" for spread in (s.total, s.certificate)]
        cells += [f"{s.proofs[0]:.2f} / {s.proofs[1]}", str(s.collisions)]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


if __name__ == "__main__":
    try:
        main()
    except SpacearmError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
