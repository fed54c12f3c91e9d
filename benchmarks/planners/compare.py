"""Planners side by side: ours, VAMP's, OMPL's on our checks, and optimisers of others on our spline problem.

    python benchmarks/planners/compare.py --data DIR --install --figure docs/figures/planners.png

DIR holds MotionBenchMaker's problems for the Panda, as `spacearm bench mbm` takes them. OMPL and cma are put into an
environment of their own; VAMP is compiled there. Contestants take turns on each problem and seed; times are as measured.
Whatever is found is looked at afterwards in steps of 0.005 rad by Pinocchio and Coal.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from cases import ENVIRONMENT, Case, Collection, Trace, load_collection
from page import put_into

from spacearm.study.reference_core import REFERENCE, load_now, machine, seconds_per_configuration

SEARCH = 0.5  # how long our bare search goes on [s]
PROVEN = (0.001, 0.05)  # how long that of `plan()` does [s]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="the problems")
    parser.add_argument("--problems", type=int, default=2, help="of each family")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=0.7, help="of each of OMPL's anytime planners")
    parser.add_argument("--evaluations", type=int, default=5000, help="of each optimiser")
    parser.add_argument("--install", action="store_true", help="fetch OMPL, cma, VAMP and Eigen from PyPI")
    parser.add_argument("--no-vamp", action="store_true", help="leave VAMP out (it needs g++)")
    parser.add_argument("--json", type=Path, help="write all traces")
    parser.add_argument("--markdown", type=Path, help="write the tables")
    parser.add_argument("--page", type=Path, help="put the tables into this page")
    parser.add_argument("--figure", type=Path, help="draw quality over time and evaluations")
    args = parser.parse_args()
    if args.install:
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q", "install", "--no-deps", "--upgrade"]
        subprocess.run([*pip, "--target", str(ENVIRONMENT), "ompl==2.0.1", "cma==4.5.0"], check=True)
    sys.path.append(str(ENVIRONMENT))
    collection = load_collection(args.data, most=args.problems)
    cases = collection.cases
    begun = time.perf_counter()
    traces, core = compete(collection, args)
    other = collection.other_checker()
    of = {case.name: case for case in cases}
    for trace in traces:
        if trace.way is not None:
            trace.collisions = other.look(of[trace.case].item, trace.way).collisions
    lines = report(traces, cases, core, args, time.perf_counter() - begun)
    print("\n".join(lines))
    if args.markdown:
        args.markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")
    if args.page:
        put_into(args.page, "planners", [*without(lines, "**OMPL through Python**")])
    if args.json:
        plain = [{key: value for key, value in vars(trace).items() if key != "way"} for trace in traces]
        args.json.write_text(json.dumps({"machine": machine(), "core": core, "traces": plain}), encoding="utf-8")
    if args.figure:
        from drawing import draw

        draw(traces, cases, args.figure)
    sys.stdout.flush()
    os._exit(0)  # OMPL's bindings complain at length about what they leak


def compete(collection: Collection, args: argparse.Namespace) -> tuple[list[Trace], dict[str, Any]]:
    """Let all take turns; return the traces, and how the core was."""
    import spline_methods
    import with_ompl
    import with_spacearm

    cases = collection.cases
    kernel, loads, traces = [], [], []
    crossing = with_ompl.empty_call(cases[0])
    for seed in range(args.seeds):
        for case in cases:
            print(f"{case.name}, seed {seed}   ", end="\r", file=sys.stderr, flush=True)
            kernel.append(seconds_per_configuration())
            loads.append(load_now())
            traces.append(with_spacearm.searched(case, seed, seconds=SEARCH))
            traces += [with_spacearm.proven(case, seed, seconds=budget) for budget in PROVEN]
            traces += [with_ompl.planned(name, case, seed, _limit(name, args)) for name in with_ompl.PLANNERS]
            traces += [spline_methods.minimised(name, case, seed, args.evaluations) for name in spline_methods.METHODS]
    if not args.no_vamp:
        import with_vamp

        traces += with_vamp.planned(cases, collection.robot)
    return traces, {"numpy": float(np.median(kernel)), "loads": [min(loads), max(loads)], "crossing": crossing}


def _limit(name: str, args: argparse.Namespace) -> float:
    return 5.0 if name == "RRTConnect" else args.seconds


# ---- tables ------------------------------------------------------------------------------------------------------------


def methods_of(traces: Iterable[Trace]) -> list[str]:
    return list(dict.fromkeys(trace.method for trace in traces))


def best_known(traces: Iterable[Trace]) -> dict[str, float]:
    """The shortest that anybody found, by case."""
    out: dict[str, float] = {}
    for trace in traces:
        if trace.solved and not trace.collisions:
            out[trace.case] = min(out.get(trace.case, np.inf), trace.points[-1][2])
    return out


def report(traces: list[Trace], cases: list[Case], core: dict[str, Any], args: argparse.Namespace, seconds: float) -> list[str]:
    known = best_known(traces)
    straight = np.mean([case.straight for case in cases])
    scale = REFERENCE / core["numpy"]
    lines = [
        f"{len(cases)} problems ({args.problems} of each family), {args.seeds} seeds (VAMP draws from a fixed sequence: one "
        f"run); mean straight length {straight:.3f} rad. {', '.join(f'{k} {v}' for k, v in machine().items())}.",
        f"The NumPy kernel took {1e6 * core['numpy']:.2f} us a configuration (times {scale:.2f} are the reference core's); "
        f"load {core['loads'][0]:.1f} to {core['loads'][1]:.1f}; {seconds:.0f} s in all.",
        "",
        "**Planners** (ms as measured, median / p95; excess: length over the shortest that anybody found for the problem and "
        "that does not collide)",
        "",
        *_head("planner", "solved", "first motion [ms]", "ends after [ms]", "length", "excess, median / mean", "collide"),
    ]
    splines = [name for name in methods_of(traces) if name.startswith(("scipy", "cma", "spacearm swarm"))]
    planners = [name for name in methods_of(traces) if name not in splines]
    for name in planners:
        runs = [trace for trace in traces if trace.method == name]
        lines.append("| " + " | ".join([name, *_planner_cells(runs, known)]) + " |")
    crossing = 1e6 * core["crossing"]
    lines += [
        "",
        "Collide: motions in which Pinocchio and Coal find a collision when they look every 0.005 rad.",
        "",
        "**OMPL through Python**: motions and configurations asked about, and where the time went, a run's mean. The last "
        f"column leaves out what Python took around the kernel, and {crossing:.2f} us a call for crossing into it; a C++ "
        "planner on the same kernel would be near it, or below, since it need not ask in small packs.",
        "",
        *_head(
            "planner", "calls", "configurations", "ms", "kernel [ms]", "kernel, ns each", "Python [ms]", "without Python [ms]"
        ),
    ]
    for name in planners:
        if name.startswith("OMPL"):
            lines.append("| " + " | ".join([name, *_python_cells([t for t in traces if t.method == name], core)]) + " |")
    lines += [
        "",
        f"**The spline problem**: two control points, {args.evaluations:,} evaluations by the planner's kernel, float32",
        "",
        *_head("optimiser", "solved", "evaluations to the first", "length", "excess, median / mean", "ms a run", "kernel [ms]"),
    ]
    for name in splines:
        lines.append("| " + " | ".join([name, *_spline_cells([t for t in traces if t.method == name], known)]) + " |")
    return lines


def without(lines: list[str], title: str) -> list[str]:
    """Return a report without the part of a title: from there to the next one."""
    titles = [i for i, line in enumerate(lines) if line.startswith("**")]
    first = next(i for i in titles if lines[i].startswith(title))
    return lines[:first] + lines[min((i for i in titles if i > first), default=len(lines)) :]


def _head(*names: str) -> list[str]:
    return ["| " + " | ".join(names) + " |", "|---" * len(names) + "|"]


def _planner_cells(runs: list[Trace], known: dict[str, float]) -> list[str]:
    solved = [run for run in runs if run.solved]
    looked = [run for run in runs if run.collisions is not None]
    return [
        f"{len(solved)} of {len(runs)}",
        _quantiles([1e3 * run.points[0][0] for run in solved]),
        _quantiles([1e3 * run.seconds for run in runs]),
        _mean([run.points[-1][2] for run in solved], 3),
        _excess(solved, known),
        f"{sum(run.collisions > 0 for run in looked)} of {len(looked)}",
    ]


def _python_cells(runs: list[Trace], core: dict[str, Any]) -> list[str]:
    configurations = sum(run.configurations for run in runs)
    bare = [run.seconds - run.python - run.calls * core["crossing"] for run in runs]
    return [
        f"{np.mean([run.calls for run in runs]):,.0f}",
        f"{np.mean([run.configurations for run in runs]):,.0f}",
        _mean([1e3 * run.seconds for run in runs], 1),
        _mean([1e3 * run.kernel for run in runs], 1),
        f"{1e9 * sum(run.kernel for run in runs) / max(configurations, 1):.0f}",
        _mean([1e3 * run.python for run in runs], 1),
        _mean([1e3 * x for x in bare], 1),
    ]


def _spline_cells(runs: list[Trace], known: dict[str, float]) -> list[str]:
    solved = [run for run in runs if run.solved]
    return [
        f"{len(solved)} of {len(runs)}",
        _quantiles([float(run.points[0][1]) for run in solved], digits=0),
        _mean([run.points[-1][2] for run in solved], 3),
        _excess(solved, known),
        _mean([1e3 * run.seconds for run in runs], 0),
        _mean([1e3 * run.kernel for run in runs], 0),
    ]


def _excess(solved: list[Trace], known: dict[str, float]) -> str:
    over = [100 * (run.points[-1][2] / known[run.case] - 1) for run in solved if run.case in known]
    return f"{np.median(over):.1f} / {np.mean(over):.1f} %" if over else "-"


def _quantiles(values: list[float], digits: int = 2) -> str:
    if not values:
        return "-"
    median, p95 = np.percentile(values, [50, 95])
    return f"{median:.{digits}f} / {p95:.{digits}f}"


def _mean(values: list[float], digits: int) -> str:
    return f"{np.mean(values):.{digits}f}" if values else "-"


if __name__ == "__main__":
    main()
