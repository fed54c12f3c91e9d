"""spacearm beside the swarm and evolution libraries a Python user would reach for: one function, one budget.

Each library minimises the paper's objective (`paper_numpy.py`) and three textbook functions in 7-D, with 300
particles and 100 iterations (Table 1) or as many evaluations of its own kind, 30,000 in all, on one thread.
Every library lives in an environment of its own, `.venv-compare/<library>`, because some pin what others
need.

    python benchmarks/compare_swarms.py --install            # make the environments, then compare (20 seeds)
    python benchmarks/compare_swarms.py --quick              # 3 seeds, two functions, under two minutes
    python benchmarks/compare_swarms.py --libraries pygmo cma --problems seed --json out.json

The tables say, for each method: milliseconds a run (median), how many of them the objective took and how
many the library took on top; and of the penalised value F + 100 violation of the best candidate found:
mean, best and worst over the seeds, the share of runs that hit (at most 1 % above the best known, 0.01
where that is 0), and the share that is feasible (violation at most 1e-6). What was found is recomputed from
the objective, not taken from the library; evaluations beyond the budget do not count. A library that cannot
be installed or run is a row that says so.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import paper_numpy
from contenders.problems import PROBLEMS, Problem

HERE = Path(__file__).resolve().parent
ENVIRONMENTS = HERE.parent / ".venv-compare"
OWN = ("spacearm_python", "spacearm_native")  # run by this interpreter
FOREIGN = ("pyswarms", "pymoo", "pygmo", "scipy", "cma", "mealpy")  # distribution names
FEASIBLE = 1e-6
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def interpreter(library: str) -> Path:
    """The Python that runs a contender."""
    if library in OWN:
        return Path(sys.executable)
    return ENVIRONMENTS / library / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def install(library: str) -> None:
    """Make a library's environment. What fails here shows up as a failed row later."""
    if not interpreter(library).exists():
        subprocess.run([sys.executable, "-m", "venv", ENVIRONMENTS / library], check=True)
    pip = [interpreter(library), "-m", "pip", "install", "-q", "--disable-pip-version-check", library]
    done = subprocess.run(pip, check=False)
    print(f"{library}: {'installed' if done.returncode == 0 else 'pip failed'}", file=sys.stderr)


def run(library: str, args: argparse.Namespace) -> dict[str, Any]:
    """One contender's report, or what went wrong."""
    python = interpreter(library)
    if not python.exists():
        return {"library": library, "failure": "no environment: run with --install"}
    command = [str(python), "-m", f"contenders.{library}", "--seeds", str(args.seeds)]
    command += ["--particles", str(args.particles), "--iterations", str(args.iterations)]
    command += ["--problems", *args.problems]
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(HERE), "PYTHONDONTWRITEBYTECODE": "1"}
    with tempfile.TemporaryDirectory() as scratch:  # some libraries leave logs where they run
        try:
            done = subprocess.run(command, cwd=scratch, env=environment, capture_output=True, text=True, timeout=args.timeout)
        except subprocess.TimeoutExpired:
            return {"library": library, "failure": f"stopped after {args.timeout:g} s"}
    try:
        return json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        last = (done.stderr.strip().splitlines() or ["no output"])[-1]
        return {"library": library, "failure": last}


def summary(problem: Problem, result: dict[str, Any], best_known: float) -> dict[str, Any]:
    """One row of the table from the runs of one method on one problem."""
    runs = result["runs"]
    violation = np.array([r["violation"] for r in runs])
    value = np.array([r["fitness"] for r in runs]) + paper_numpy.PENALTY * violation
    milliseconds = np.array([r["seconds"] for r in runs]) * 1e3
    objective = np.array([r["objective_seconds"] for r in runs]) * 1e3
    return {
        "evaluations": int(np.median([r["evaluations"] for r in runs])),
        "calls": int(np.median([r["calls"] for r in runs])),
        "ms": float(np.median(milliseconds)),
        "objective_ms": float(np.median(objective)),
        "overhead_ms": float(np.median(milliseconds - objective)),
        "mean": float(value.mean()),
        "best": float(value.min()),
        "worst": float(value.max()),
        "hits": float(np.mean(value <= best_known + problem.hit)),
        "feasible": float(np.mean((violation <= FEASIBLE) & [r["inside_bounds"] for r in runs])),
    }


HEAD = ("library", "method", "constraints", "evaluations", "calls", "ms a run", "objective", "overhead")
HEAD += ("mean", "best", "worst", "hits", "feasible")


def cells(row: dict[str, Any]) -> list[str]:
    """A row as text."""
    start = [row["library"], row.get("method", ""), row.get("handling", "")]
    if "failure" in row:
        return [*start, f"failed: {row['failure']}".replace("|", "/"), *[""] * (len(HEAD) - 4)]
    numbers = [f"{row['evaluations']:,}", f"{row['calls']:,}"]
    numbers += [f"{row[k]:.1f}" for k in ("ms", "objective_ms", "overhead_ms")]
    numbers += [f"{row[k]:.4g}" for k in ("mean", "best", "worst")]
    return start + numbers + [f"{row[k]:.0%}" for k in ("hits", "feasible")]


def tabulate(rows: list[dict[str, Any]]) -> str:
    """A markdown table with columns wide enough to be read as text."""
    lines = [list(HEAD), *(cells(row) for row in rows)]
    widths = [max(len(line[i]) for line in lines if i != 3 or "failed" not in line[3]) for i in range(len(HEAD))]
    text = ["| " + " | ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) + " |" for line in lines]
    return "\n".join([text[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *text[1:]])


def rows_of(problem: Problem, reports: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The table's rows for one problem, fastest first, failures last."""
    rows = []
    for report in reports:
        name = f"{report['library']} {report.get('version', '')}".strip()
        if "failure" in report:
            rows.append({"library": name, "failure": report["failure"]})
        for result in report.get("results", []):
            if result["problem"] != problem.name:
                continue
            handling = result["handling"] if problem.constrained else "none"
            row = {"library": name, "method": result["method"], "handling": handling}
            if "failure" in result:
                rows.append({**row, "failure": result["failure"]})
            else:
                rows.append({**row, **summary(problem, result, problem.best_known)})
    return sorted(rows, key=lambda row: row.get("ms", np.inf))


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    every = (*OWN, *FOREIGN)
    parser.add_argument("--install", action="store_true", help="create or refresh the environments first")
    parser.add_argument("--quick", action="store_true", help="3 seeds, the paper's problem and one textbook function")
    parser.add_argument("--libraries", nargs="+", default=every, choices=every, metavar="NAME")
    parser.add_argument("--problems", nargs="+", choices=sorted(PROBLEMS), metavar="NAME")
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--particles", type=int, default=300)
    parser.add_argument("--iterations", type=int, default=100)
    parser.add_argument("--timeout", type=float, default=1800, help="for one library [s]")
    parser.add_argument("--json", metavar="FILE", help="write the reports, run by run, to FILE")
    args = parser.parse_args()
    usual = ["paper", "rosenbrock"] if args.quick else ["paper", "sphere", "rastrigin", "rosenbrock"]
    args.problems = args.problems or usual
    args.seeds = args.seeds or (3 if args.quick else 20)
    return args


def main() -> None:
    args = arguments()
    if args.install:
        for library in args.libraries:
            if library in FOREIGN:
                install(library)
    reports = []
    for library in args.libraries:
        print(f"running {library} ...", file=sys.stderr)
        reports.append(run(library, args))
    tables = {name: rows_of(PROBLEMS[name], reports) for name in args.problems}
    for name, rows in tables.items():
        budget = args.particles * args.iterations
        known = f"best known {PROBLEMS[name].best_known:g}"
        print(f"\n## {name}: {budget:,} evaluations, {args.seeds} seeds, {known}\n")
        print(tabulate(rows))
    if args.json:
        Path(args.json).write_text(json.dumps({"tables": tables, "reports": reports}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
