"""The proof of motions beside what else is done to look at them: time, guarantee, and what is missed.

On motions that spacearm plans for MotionBenchMaker's problems, and for a servicer of boxes with its base held, methods take
turns:

- the finder and the checker of proofs;
- adaptive bisection with first-order bounds and a distance query (Schwarzer, Saha and Latombe 2005): our own baseline, in the
  finder's own terms with only the search changed, and in Python with Coal's distances. Both ask for the same distances;
- continuous collision detection of pairs of bodies between configurations 0.05 rad apart: FCL's conservative advancement;
- samples 0.005 rad apart: by Pinocchio and Coal, and by the native kernel.

Then a ball is put into the way of each motion that it touches for an instant, 1 um to 1 mm deep: who finds it? And the
clearance that is required is brought close to what there is: what does the time become? Times are processor times of one
thread, the least of several; what is made once for a robot and a scene is not counted.

    python benchmarks/proofs_beside_others.py --data PANDA --data FETCH --data BAXTER --install \\
        --figure docs/figures/proofs.png --page docs/benchmarks.md

FCL (python-fcl from PyPI) goes into an environment of its own, and the bisection is compiled there with g++. Coal 3.0.3 has no
continuous collision detection in Python, so FCL, from which it comes, stands for it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[1:1] = [str(HERE / "planners"), str(HERE.parent / "tests")]

from page import put_into  # noqa: E402  # of benchmarks/planners

from proofs import beside_methods as methods  # noqa: E402
from proofs.beside_motions import DEPTHS, AMotion, of_collection, of_problem_file, with_balls  # noqa: E402
from spacearm.study.reference_core import load_note, load_now, machine_note  # noqa: E402

ENVIRONMENT = HERE.parent / ".venv-planners"
FCL = "python-fcl==0.7.0.11"
MARGINS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
"""How much more than required there is [m]."""

PROOF, NATIVE, COAL = "spacearm, found and checked", "bisection, native", "bisection, Python and Coal"
ADVANCED, SAMPLED, KERNEL = "FCL, advancement", "samples, Coal", "samples, native kernel"
FOUND, CHECKED = "spacearm, found", "spacearm, checked"

GUARANTEES = {
    PROOF: "every instant, all pairs, with a clearance; rounding is bounded; a second program checks the proof, and believes "
    "neither distances nor finder",
    NATIVE: "every instant, if each distance is right; rounding is left out; nothing is left to be checked",
    COAL: "as above",
    ADVANCED: "every instant of bodies that move straight and turn evenly between two configurations, which joints do not do",
    SAMPLED: "the configurations looked at",
    KERNEL: "the configurations looked at, in single precision",
}


@dataclass
class Results:
    """What was measured.

    Attributes:
        verdicts: by method, of each motion.
        found: by method and depth, how many of how many collisions were found.
        margins: by margin, of each motion and of each of the methods there: seconds, configurations, queries.
        away: how far bodies get from the lines that FCL moves them along [m], by motion.
        robots: of the motions.
        loads: of the machine.
    """

    robots: list[str] = field(default_factory=list)
    verdicts: dict[str, list[methods.Verdict]] = field(default_factory=dict)
    found: dict[str, dict[float, list[bool]]] = field(default_factory=dict)
    margins: dict[float, dict[str, list[methods.Verdict]]] = field(default_factory=dict)
    away: list[float] = field(default_factory=list)
    loads: list[float] = field(default_factory=list)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, action="append", default=[], help="MotionBenchMaker's problems of a robot")
    parser.add_argument("--problems", type=int, default=2, help="of each family")
    parser.add_argument("--servicer", type=Path, default=HERE.parent / "examples" / "07_box_servicer.yaml")
    parser.add_argument("--servicer-motions", type=int, default=10)
    parser.add_argument("--tight", type=int, default=5, help="motions of each robot of which little more is required")
    parser.add_argument("--rounds", type=int, default=3, help="the least time of so many counts")
    parser.add_argument("--seed", type=int, default=0, help="of the balls")
    parser.add_argument("--install", action="store_true", help=f"fetch {FCL} from PyPI")
    parser.add_argument("--no-fcl", action="store_true")
    parser.add_argument("--json", type=Path, help="write all that was measured")
    parser.add_argument("--page", type=Path, help="put the tables into this page")
    parser.add_argument("--figure", type=Path, help="draw it")
    args = parser.parse_args()
    if args.install:
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q", "install", "--no-deps", "--upgrade"]
        subprocess.run([*pip, "--target", str(ENVIRONMENT), FCL], check=True)
    sys.path.append(str(ENVIRONMENT))
    contestants = _contestants(fcl=not args.no_fcl)
    motions = [motion for folder in args.data for motion in of_collection(folder, args.problems)]
    motions += of_problem_file(args.servicer, "Servicer", args.servicer_motions)
    begun, results, tight = time.perf_counter(), Results(), Counter[str]()
    for i, motion in enumerate(motions):
        _say(f"{motion.robot}, {motion.name} ({i + 1} of {len(motions)})")
        judge(motion, contestants, args.rounds, results)
        look_for_balls(with_balls(motion, (args.seed, i)), contestants, results)
        if tight[motion.robot] < args.tight:
            come_close(motion, args.rounds, results)
            tight[motion.robot] += 1
        motion.forget()
    lines = report(results, args, time.perf_counter() - begun)
    print("\n".join(lines))
    if args.page:
        put_into(args.page, "proofs", lines)
    if args.json:
        args.json.write_text(json.dumps(asdict(results), default=str), encoding="utf-8")
    if args.figure:
        from proofs.beside_drawing import draw

        draw(results, args.figure)


def _contestants(*, fcl: bool) -> dict[str, methods.Method]:
    native = methods.bisected_natively(ENVIRONMENT)
    out = {PROOF: methods.proved, NATIVE: native, COAL: methods.bisected, ADVANCED: methods.advanced}
    if not fcl:
        del out[ADVANCED]
    return {**out, SAMPLED: methods.sampled_by_coal, KERNEL: methods.sampled_by_kernel}


# ---- measurements ----------------------------------------------------------------------------------------------------


def judge(motion: AMotion, contestants: dict[str, methods.Method], rounds: int, into: Results) -> None:
    """Let all methods look at a motion, in turns."""
    into.robots.append(motion.robot)
    into.loads.append(load_now())
    seen: dict[str, list[methods.Verdict]] = {name: [] for name in contestants}
    for round_ in range(rounds + 1):  # the first one warms up
        for name, method in contestants.items():
            if round_ < 2 or name not in (COAL, ADVANCED):
                seen[name].append(method(motion))
    for name, verdicts in seen.items():
        into.verdicts.setdefault(name, []).append(min(verdicts[1:], key=lambda one: one.seconds))
    if ADVANCED in contestants:
        into.away.append(methods.interpolation_error(motion))


def look_for_balls(motions: Iterable[AMotion], contestants: dict[str, methods.Method], into: Results) -> None:
    """Let all methods look at motions that touch a ball for an instant."""
    for motion in motions:
        for name, method in contestants.items():
            by_depth = into.found.setdefault(name, {depth: [] for depth in DEPTHS})
            by_depth[motion.depth].append(method(motion).free is not True)


def come_close(motion: AMotion, rounds: int, into: Results) -> None:
    """Require almost as much as there is."""
    native = methods.bisected_natively(ENVIRONMENT)
    for margin in MARGINS:
        if motion.least <= margin:
            continue
        claim = motion.claim(motion.least - margin)
        for name, method in ((PROOF, methods.proved), (NATIVE, native)):
            seen = [method(motion, claim) for _ in range(rounds)]  # type: ignore[call-arg]
            best = min(seen, key=lambda one: one.seconds)
            into.margins.setdefault(margin, {}).setdefault(name, []).append(best)


def _say(what: str) -> None:
    print(f"{what:<100}", end="\r", file=sys.stderr, flush=True)


# ---- tables ----------------------------------------------------------------------------------------------------------


def report(results: Results, args: argparse.Namespace, seconds: float) -> list[str]:
    robots = list(dict.fromkeys(results.robots))
    counts = ", ".join(f"{results.robots.count(robot)} of {robot}" for robot in robots)
    load = load_note(results.loads) or "load: not known"
    lines = [
        f"{len(results.robots)} planned motions ({counts}), nothing may touch; least of {args.rounds} rounds; {seconds:.0f} s "
        f"in all, {load}. {machine_note()}.",
        "",
        "**Time and guarantee.** Processor time of one motion [ms], median / p95.",
        "",
        _row("method", *robots, "configurations", "distances", "what it guarantees"),
        "|" + "---|" * (len(robots) + 4),
    ]
    for name, verdicts in results.verdicts.items():
        cells = [_quantiles([1e3 * verdicts[i].seconds for i in _of(results, robot)]) for robot in robots]
        asked = [verdict.queries for verdict in verdicts]
        queries = f"{np.median(asked):,.0f}" if any(asked) else "–"
        configurations = f"{np.median([verdict.configurations for verdict in verdicts]):,.0f}"
        lines.append(_row(name, *cells, configurations, queries, GUARANTEES[name]))
        if name == PROOF:
            for part in ("found", "checked"):
                cells = [_quantiles([1e3 * verdicts[i].parts[part] for i in _of(results, robot)]) for robot in robots]
                lines.append(_row(f"– {part} alone", *cells, "", "", ""))
    lines += ["", *_exceptions(results), "", *_missed(results), "", *_close(results)]
    return lines


def _exceptions(results: Results) -> list[str]:
    """Return sentences about motions that a method does not call free."""
    total = len(results.robots)
    said = [
        f"{name} does not call {count} of {total} free"
        for name, verdicts in results.verdicts.items()
        if (count := sum(verdict.free is not True for verdict in verdicts))
    ]
    out = "All methods call all motions free. " if not said else "; ".join(said) + ". "
    out += (
        "In the proof and the bisection a configuration is a stretch of the path, and a distance that of two bodies or balls."
    )
    if results.away:
        middle, most = 1e3 * np.median(results.away), 1e3 * max(results.away)
        out += (
            f" Between configurations {methods.ADVANCED} rad apart bodies' centres get {middle:.2f} mm (median of motions; at "
            f"most {most:.2f} mm) away from the lines along which FCL moves them."
        )
    return [out]


def _missed(results: Results) -> list[str]:
    depths = [f"{1e6 * depth:g} um" if depth < 1e-3 else f"{1e3 * depth:g} mm" for depth in DEPTHS]
    count = len(next(iter(results.found.values()))[DEPTHS[0]])
    lines = [
        "**What is missed.** A ball of 1 to 5 mm touches each motion for an instant, this deep. The numbers are of those that "
        f"are not called free, of about {count} each.",
        "",
        _row("method", *depths),
        "|" + "---|" * (len(depths) + 1),
    ]
    for name, by_depth in results.found.items():
        lines.append(_row(name, *(f"{sum(by_depth[depth])} of {len(by_depth[depth])}" for depth in DEPTHS)))
    return lines


def _close(results: Results) -> list[str]:
    lines = [
        "**How time grows where it is tight.** This much less than the measured least clearance is required; processor time "
        "[ms] and configurations, medians.",
        "",
        _row("room", "motions", FOUND, CHECKED, "configurations", NATIVE, "configurations", "proven / settled"),
        "|" + "---|" * 8,
    ]
    for margin, by_method in sorted(results.margins.items(), reverse=True):
        ours, theirs = by_method[PROOF], by_method[NATIVE]
        room = f"{1e3 * margin:g} mm" if margin >= 1e-4 else f"{1e6 * margin:g} um"
        cells = [
            _median([1e3 * one.parts["found"] for one in ours]),
            _median([1e3 * one.parts["checked"] for one in ours]),
            f"{np.median([one.configurations for one in ours]):,.0f}",
            _median([1e3 * one.seconds for one in theirs]),
            f"{np.median([one.configurations for one in theirs]):,.0f}",
            f"{sum(one.free is True for one in ours)} / {sum(one.free is True for one in theirs)}",
        ]
        lines.append(_row(room, str(len(ours)), *cells))
    return lines


def _of(results: Results, robot: str) -> list[int]:
    return [i for i, one in enumerate(results.robots) if one == robot]


def _row(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def _quantiles(values: Sequence[float]) -> str:
    middle, high = np.percentile(values, [50, 95])
    return f"{_digits(middle)} / {_digits(high)}"


def _median(values: Sequence[float]) -> str:
    return _digits(float(np.median(values)))


def _digits(value: Any) -> str:
    return f"{value:.2f}" if value < 10 else f"{value:.1f}" if value < 100 else f"{value:,.0f}"


if __name__ == "__main__":
    main()
