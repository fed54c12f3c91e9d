"""Fuzzing of the public face: calls with one or two absurd arguments, which must give a result or one sentence, and soon.

Numbers beyond integers and floats, NaN, text, nothing, arrays of other shapes: each call is drawn from (seed, number), which is
printed with what it found. A raw exception, a warning, a crash or no answer within 20 seconds are findings.

    python benchmarks/fuzz_arguments.py --count 5000
    python benchmarks/fuzz_arguments.py --seed 0 --first 1234 --count 1
"""

from __future__ import annotations

import argparse
import ast
import os
import resource
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def run(options: argparse.Namespace, first: int, last: int, pipe: int) -> None:
    """Make the calls from first to last; write a line for each, and what it found."""
    from spacearm.checks import shown as as_shown
    from support.hostile_calls import finding, hostile_call

    most = int(options.memory * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    with os.fdopen(pipe, "w") as out:
        for number in range(first, last):
            name, changed = hostile_call((options.seed, number))
            kind, details = finding(name, changed)
            shown = (
                ""
                if kind in ("fine", "refused")
                else f"{name}({', '.join(f'{n}={as_shown(v)}' for n, v in changed.items())})\t{details}"
            )
            out.write(f"{number}\t{kind}\t{shown!r}\n")
            out.flush()


def main() -> int:
    """Run the fuzzing; 1 if there are findings."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0, help="number of the first one: resumes a run")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--memory", type=float, default=4.0, help="limit of the process' address space [GB]")
    options = parser.parse_args()
    counts, number, last = Counter[str](), options.first, options.first + options.count
    while number < last:
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            run(options, number, last, writing)
            os._exit(0)
        os.close(writing)
        with os.fdopen(reading) as lines:
            for line in lines:
                done, kind, shown = line.rstrip("\n").split("\t", 2)
                number = int(done) + 1
                counts[kind] += 1
                if shown != "''":
                    print(f"--seed {options.seed} --first {done} --count 1: {kind}\n{ast.literal_eval(shown)}", flush=True)
        _, status = os.waitpid(child, 0)
        if status != 0:
            counts["crashed"] += 1
            print(f"--seed {options.seed} --first {number} --count 1: the process ended with status {status}", flush=True)
            number += 1
    print(dict(counts))
    return 1 if set(counts) - {"fine", "refused"} else 0


if __name__ == "__main__":
    sys.exit(main())
