"""A long search for a certificate that is wrong about how a trajectory is written down.

Trajectories with jumps, stairs, corners, rests, dwells, steep time laws, huge values beside small ones, pieces of a microsecond
and polynomials of high degree; limits and obstacles that are just kept or just broken; some bases float, some of these tumble.
What holds is looked at by a checker with its own kinematics, distances and differences
(`tests/support/drawn_trajectories.py`). A case is drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak_trajectories.py --count 5000 --seed 1
    python benchmarks/soak_trajectories.py --seed 1 --only 1234
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from spacearm.errors import SpacearmError
from spacearm.proof import Certificate, certify
from support.drawn_trajectories import Case, complaints, drawn_case

_LIMITS = (("position", "velocity", "acceleration"), ("position", "velocity"), ("velocity",), ())


def looked_at(seed: int, number: int) -> tuple[Case, Certificate, list[str]]:
    """Draw a case, certify it, and look at it.

    Raises:
        SpacearmError: what was drawn is refused.
    """
    case = drawn_case(seed, number)
    rng = np.random.default_rng((seed, number, 1))
    certificate = certify(case, case.trajectory, limits=_LIMITS[int(rng.integers(0, len(_LIMITS)))])  # type: ignore[arg-type]
    return case, certificate, complaints(case, certificate, rng)


def main() -> int:
    """Run, and return the exit code: 1 if a certificate was wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=2000, help="cases")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="this case, in words")
    options = parser.parse_args()
    numbers = range(options.count) if options.only is None else [options.only]
    counted: Counter[tuple[str, str]] = Counter()
    wrong, begun = 0, time.perf_counter()
    for number in numbers:
        try:
            case, certificate, found = looked_at(options.seed, number)
        except SpacearmError as refusal:
            counted["(refused)", "refused"] += 1
            if options.only is not None:
                print(refusal)
            continue
        counted[case.kind + (", floating" if case.base == "floating" else ""), certificate.status] += 1
        for sentence in found:
            wrong += 1
            print(f"seed {options.seed}, number {number} ({case.kind}, {case.base}): {sentence}")
        if options.only is not None:
            print(certificate.status, certificate.message, certificate.broken_limits)
    for (kind, status), count in sorted(counted.items()):
        print(f"{kind:24} {status:10} {count:7}")
    print(f"{len(numbers)} cases in {time.perf_counter() - begun:.0f} s, seed {options.seed}: {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
