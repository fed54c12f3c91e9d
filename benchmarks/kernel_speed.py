"""How fast the kernel is, each figure a ratio taken side by side in one run, or a time with a target.

    python benchmarks/kernel_speed.py                   # all; pyswarms needs compare_swarms.py --install once
    python benchmarks/kernel_speed.py --parts fitness levels
    python benchmarks/kernel_speed.py --json kernel_speed.json

Contestants take turns (rounds.py): times are the least and the median over the rounds, ratios the median of the rounds'
ratios. Run it on a calm machine, alone.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import paper_numpy
from compare_swarms import HERE, ONE_THREAD, interpreter
from instances import ARM, paper_instance
from rounds import Rounds, machine, print_table, take_turns
from spacearm.core.native import ENVIRONMENT_VARIABLE, kernel_info
from spacearm.swarm import PSO, minimize, named_settings, run_trials

BATCH = 300  # Table 1's particles
LARGE = 30_000
CACHED = 4_096  # rows that stay in the second-level cache
BITS = (64, 32)

Row = dict[str, Any]


# --- fitness


def fitness_rounds(bits: int, rounds: int, *, with_numpy: bool = True) -> Rounds:
    """One evaluation of the paper's fitness and violation, contestant by contestant; seconds a configuration."""
    objective = paper_instance("goal", 0.10).make_objective(bits)
    kind = np.float64 if bits == 64 else np.float32
    drawn = np.random.default_rng(0).uniform(paper_numpy.LOWER, paper_numpy.UPPER, (LARGE, 7)).astype(kind)
    batch, cached = drawn[:BATCH].copy(), drawn[:CACHED].copy()
    contestants: dict[str, Callable[[], object]] = {
        "kernel, 300": lambda: objective.evaluate(batch),
        "kernel, 30,000": lambda: objective.evaluate(drawn),
        "kernel, 4,096": lambda: objective.evaluate(cached),
    }
    rows = {"kernel, 300": BATCH, "kernel, 30,000": LARGE, "kernel, 4,096": CACHED}
    if with_numpy:
        numpy_batches = {"300": batch, "3,000": drawn[:3000].copy()}
        for form, function in paper_numpy.FORMULATIONS.items():
            for size, q in numpy_batches.items():
                contestants[f"NumPy {form}, {size}"] = lambda function=function, q=q: function(q, "goal")
                rows[f"NumPy {form}, {size}"] = len(q)
    taken = take_turns(contestants, rounds=rounds)
    return Rounds({name: seconds / rows[name] for name, seconds in taken.seconds.items()})


def fitness_part(rounds: int) -> list[Row]:
    require_agreement()
    rows = []
    for bits in BITS:
        taken = fitness_rounds(bits, rounds)
        for name in taken.seconds:
            rows.append(
                {
                    "what": name,
                    "bits": bits,
                    "least_ns": taken.least(name) * 1e9,
                    "median_ns": taken.median(name) * 1e9,
                    "times_kernel_300": taken.ratio(name, "kernel, 300"),
                    "times_kernel_cached": taken.ratio(name, "kernel, 4,096"),
                }
            )
    print_table(
        "Fitness and violation of one configuration, 7 joints, 3 spheres, one core",
        "form, rows at once | bits | least [ns] | median [ns] | x kernel, 300 | x kernel, 4,096",
        [[r["what"], r["bits"], *(f"{value:.1f}" for value in list(r.values())[2:])] for r in rows],
    )
    return rows


def require_agreement() -> None:
    """Stop when kernel and NumPy do not compute the same."""
    q = np.random.default_rng(1).uniform(paper_numpy.LOWER, paper_numpy.UPPER, (2000, 7))
    for value, reference in zip(paper_instance("goal", 0.10).objective.evaluate(q), paper_numpy.objective(q), strict=True):
        np.testing.assert_allclose(value, reference, rtol=0, atol=1e-11)


# --- instruction levels


def levels_part(rounds: int) -> list[Row]:
    """The same for every build that this processor runs, each in a process of its own, in turns."""
    found: dict[tuple[str, int], dict[str, list[float]]] = {}
    for _ in range(5):
        for level in kernel_info().available:
            command = [sys.executable, __file__, "--level-only", "--rounds", str(max(10, rounds // 5))]
            environment = {**os.environ, ENVIRONMENT_VARIABLE: level}
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
            for row in json.loads(done.stdout):
                for name in ("least_ns", "median_ns", "batch_ns", "run_ms"):
                    found.setdefault((level, row["bits"]), {}).setdefault(name, []).append(row[name])
    rows = [
        {
            "level": level,
            "bits": bits,
            "least_ns": min(values["least_ns"]),
            **{name: float(np.median(values[name])) for name in ("median_ns", "batch_ns", "run_ms")},
        }
        for (level, bits), values in found.items()
    ]
    print_table(
        "Instruction levels",
        "level | bits | 4,096 rows, least [ns] | median [ns] | 300 rows [ns] | a PSO run [ms]",
        [[r["level"], r["bits"], *(f"{value:.2f}" for value in list(r.values())[2:])] for r in rows],
    )
    return rows


def level_only(rounds: int) -> None:
    """What a level's process prints."""
    rows = []
    for bits in BITS:
        taken = fitness_rounds(bits, rounds, with_numpy=False)
        runs = take_turns({"run": lambda bits=bits: native_run("pso", bits=bits)}, rounds=rounds)
        rows.append(
            {
                "bits": bits,
                "least_ns": taken.least("kernel, 4,096") * 1e9,
                "median_ns": taken.median("kernel, 4,096") * 1e9,
                "batch_ns": taken.median("kernel, 300") * 1e9,
                "run_ms": runs.median("run") * 1e3,
            }
        )
    print(json.dumps(rows))


# --- whole runs


def native_run(method: str, *, bits: int = 64, trials: int = 1, threads: int = 1, first: int = 0) -> None:
    run_trials(
        _objective(bits),
        ARM.lower,
        ARM.upper,
        named_settings(method),
        seed=0,
        first_trial=first,
        trials=trials,
        threads=threads,
    )


_OBJECTIVES: dict[int, Any] = {}


def _objective(bits: int) -> Any:
    if bits not in _OBJECTIVES:
        _OBJECTIVES[bits] = paper_instance("goal", 0.10).make_objective(bits)
    return _OBJECTIVES[bits]


def pyswarms_part(rounds: int) -> list[Row]:
    """One PSO run of Table 1, native and in pyswarms."""
    python = interpreter("pyswarms")
    if not python.exists():
        print("\npyswarms: no environment; run compare_swarms.py --install --libraries pyswarms --quick")
        return []
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(HERE), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [str(python), "-m", "contenders.pyswarms_on_demand"]
    with (
        tempfile.TemporaryDirectory() as scratch,
        subprocess.Popen(
            command,
            cwd=scratch,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as child,
    ):
        stdin, stdout = child.stdin, child.stdout
        assert stdin is not None
        assert stdout is not None

        def theirs(form: str) -> float:
            stdin.write(form + "\n")
            stdin.flush()
            return float(stdout.readline())

        contestants: dict[str, Callable[[], object]] = {
            f"pyswarms, NumPy {form}": lambda form=form: theirs(form) for form in paper_numpy.FORMULATIONS
        }
        contestants |= {f"native, {bits} bits": lambda bits=bits: native_run("pso", bits=bits) for bits in BITS}
        taken = take_turns(contestants, rounds=rounds, block=0.01)
        stdin.close()
    rows = [
        {
            "what": name,
            "least_ms": taken.least(name) * 1e3,
            "median_ms": taken.median(name) * 1e3,
            "times_native": taken.ratio(name, "native, 64 bits"),
        }
        for name in taken.seconds
    ]
    print_table(
        "One run of Table 1: 300 particles, 100 iterations, one thread",
        "how | least [ms] | median [ms] | x native, 64 bits",
        [[r["what"], *(f"{value:.2f}" for value in list(r.values())[1:])] for r in rows],
    )
    return rows


def table_part(rounds: int) -> list[Row]:
    """The paper's Table 3: PSO, IPSO-M, IPSO-S, 20 runs each, on two threads."""
    methods = ("pso", "ipso-m", "ipso-s")

    def all_three() -> None:
        for method in methods:
            native_run(method, trials=20, threads=2)

    taken = take_turns({"table": all_three}, rounds=max(5, rounds // 3))
    return [_timed("3 methods x 20 runs, two threads", taken, "table", 1e3, "ms")]


def overhead_part(rounds: int) -> list[Row]:
    """What `minimize` takes beyond the Python function it calls, an iteration."""

    def run() -> float:
        inside = 0.0

        def f(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            nonlocal inside
            begun = time.perf_counter()
            told = paper_numpy.objective(x)
            inside += time.perf_counter() - begun
            return told

        begun = time.perf_counter()
        result = minimize(f, paper_numpy.LOWER, paper_numpy.UPPER, PSO(), rng=0)
        return (time.perf_counter() - begun - inside) / result.iterations

    return [_timed("`minimize` beyond f, 300 x 7, an iteration", take_turns({"m": run}, rounds=rounds), "m", 1e6, "us")]


def start_part(rounds: int) -> list[Row]:
    """How long Python and the command line take to start."""
    script = Path(sys.executable).with_name("spacearm")
    use = "import spacearm as sa; sa.minimize; sa.plan; sa.load_robot('zhang2022')"
    commands = {
        "python -c pass": [sys.executable, "-c", "pass"],
        "import spacearm": [sys.executable, "-c", "import spacearm"],
        "import spacearm, load a robot": [sys.executable, "-c", use],
        "spacearm --help": [str(script), "--help"],
    }
    rows = []
    contestants = {}
    for name, command in commands.items():
        try:
            subprocess.run(command, capture_output=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            print(f"{name}: does not run here, left out", file=sys.stderr)
            continue
        contestants[name] = lambda command=command: subprocess.run(command, capture_output=True, check=True)
    taken = take_turns(contestants, rounds=max(5, rounds // 3))
    for name in contestants:
        rows.append(_timed(f"`{name}`", taken, name, 1.0, "s"))
    return rows


def _timed(what: str, taken: Rounds, name: str, scale: float, unit: str) -> Row:
    return {"what": what, "unit": unit, "least": taken.least(name) * scale, "median": taken.median(name) * scale}


# --- targets


def targets(results: dict[str, list[Row]]) -> list[tuple[str, str, str, str]]:
    """(what, target, measured, met)"""
    out = []
    fitness = {(r["what"], r["bits"]): r for r in results.get("fitness", [])}
    for bits, least in ((64, 80), (32, 150)):
        for form in paper_numpy.FORMULATIONS if fitness else ():
            row = fitness[f"NumPy {form}, 300", bits]
            best = row["times_kernel_cached"]
            text = f"{row['times_kernel_300']:.0f} x (300 rows), {best:.0f} x (4,096 rows)"
            out.append((f"kernel against NumPy {form}, {bits} bits", f">= {least} x", text, _yes(best >= least)))
    for r in results.get("pyswarms", []):
        if r["what"].startswith("pyswarms"):
            out.append(
                (f"a PSO run against {r['what']}", ">= 40 x", f"{r['times_native']:.0f} x", _yes(r["times_native"] >= 40))
            )
    limits = {"3 methods": (150, "< 150 ms"), "`minimize": (40, "< 40 us"), "`import spacearm`": (0.3, "< 0.3 s")}
    limits["`spacearm --help`"] = (0.5, "< 0.5 s")
    for r in results.get("times", []):
        for start, (limit, text) in limits.items():
            if r["what"].startswith(start):
                out.append((r["what"], text, f"{r['median']:.3g} {r['unit']}", _yes(r["median"] < limit)))
    return out


def _yes(met: bool) -> str:
    return "yes" if met else "no"


PARTS: dict[str, Callable[[int], list[Row]]] = {
    "fitness": fitness_part,
    "levels": levels_part,
    "pyswarms": pyswarms_part,
    "table": table_part,
    "overhead": overhead_part,
    "start": start_part,
}
TIMED = ("table", "overhead", "start")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=list(PARTS), metavar="PART")
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument("--json", metavar="FILE", help="also write the figures to FILE")
    parser.add_argument("--level-only", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.level_only:
        level_only(args.rounds)
        return
    info = kernel_info()
    line = machine(f"kernel {info.level}, {info.compiler}")
    print(line)
    results: dict[str, list[Row]] = {"times": []}
    for part in args.parts:
        rounds = max(5, args.rounds // 5) if part == "pyswarms" else args.rounds
        rows = PARTS[part](rounds)
        results["times" if part in TIMED else part] = (results["times"] if part in TIMED else []) + rows
    times = [[r["what"], f"{r['least']:.4g} {r['unit']}", f"{r['median']:.4g} {r['unit']}"] for r in results["times"]]
    print_table("Times", "what | least | median", times)
    print_table("Targets", "what | target | measured | met", [list(row) for row in targets(results)])
    if args.json:
        Path(args.json).write_text(json.dumps({"machine": line, **results}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
