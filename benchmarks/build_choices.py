"""What the kernel's build options are worth: its inner loop compiled each way, timed in turns.

Packs of 64 or 32 bytes, and multiply-adds fused or not, at each instruction level. `inner_loop.cpp` holds the loop; no
Python is involved, so these are the kernel's bare rates. Needs the compiler that builds spacearm ($CXX, or c++).

    python benchmarks/build_choices.py
    python benchmarks/build_choices.py --rounds 20 --json build_choices.json
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from rounds import machine, print_table
from spacearm.core.native import available_levels, kernel_info

HERE = Path(__file__).resolve().parent
OPTIONS = ["-std=gnu++20", "-O3", "-fno-math-errno", "-fno-trapping-math", "-Wno-psabi"]  # as in CMakeLists.txt
NUMBER = {"x86-64-v4": 4, "x86-64-v3": 3, "x86-64-v2": 2, "generic": 0}
COLUMNS = ("float64", "float32", "random float64", "random float32")


def variants() -> list[tuple[str, int, str]]:
    """(level, bytes of a pack, contraction); a v4 register fills a pack of 64."""
    out = []
    for level in available_levels():
        out.append((level, 64, "off"))
        if level != "x86-64-v4":
            out.append((level, 32, "off"))
        if NUMBER[level] >= 3:
            out.append((level, 64, "fast"))
    return out


def build(level: str, size: int, contraction: str, program: Path) -> None:
    number = NUMBER[level]
    march = [f"-march={level}"] if number else []
    defined = [f"-DSPACEARM_LEVEL={number}", f"-DSPACEARM_PACK_BYTES={size}", "-DSPACEARM_NAMESPACE=inner"]
    command = [os.environ.get("CXX", "c++"), *OPTIONS, f"-ffp-contract={contraction}", *march, *defined]
    subprocess.run([*command, f"-I{HERE.parent / 'kernel'}", str(HERE / "inner_loop.cpp"), "-o", str(program)], check=True)


def measure(program: Path) -> list[float]:
    """Nanoseconds in the order of COLUMNS."""
    lines = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout.split("\n")
    (double, random_double), (single, random_single) = (map(float, line.split()) for line in lines[:2])
    return [double, single, random_double, random_single]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--json", metavar="FILE", help="also write the figures to FILE")
    args = parser.parse_args()
    print(machine(f"kernel compiled by {kernel_info().compiler}"))
    with tempfile.TemporaryDirectory() as folder:
        programs = {}
        for i, variant in enumerate(variants()):
            print(f"compiling {variant} ...", file=sys.stderr)
            programs[variant] = Path(folder) / f"inner_{i}"
            build(*variant, programs[variant])
        rounds = [[measure(program) for program in programs.values()] for _ in range(args.rounds)]
    median, least = np.median(rounds, axis=0), np.min(rounds, axis=0)
    print_table(
        "The inner loop: ns a configuration, and ns a random number, median (least) over the rounds",
        "level | pack [bytes] | fused multiply-adds | " + " | ".join(COLUMNS),
        [
            [level, size, "no" if contraction == "off" else "yes", *(f"{m:.2f} ({b:.2f})" for m, b in zip(ms, bs, strict=True))]
            for (level, size, contraction), ms, bs in zip(programs, median, least, strict=True)
        ],
    )
    if args.json:
        rows = [
            {"variant": v, "median": dict(zip(COLUMNS, ms, strict=True))}
            for v, ms in zip(programs, median.tolist(), strict=True)
        ]
        Path(args.json).write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
