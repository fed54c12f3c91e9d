"""A soak of the readers of robots: drawn URDF, SRDF and joint_limits.yaml, and a second reader that looks at the robots.

Mimics of mimics, slides that follow turning joints, limits from every source and limits that mean none, lengths from
millimetres to kilometres, XML that only urdfdom reads. The second reader (`tests/support/urdf_checker.py`) is made of
ElementTree, PyYAML and Pinocchio: it compares frames, and every joint's own limits, also along motions that are as fast as the
limits allow. A robot is drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak_urdf.py --count 10000
    python benchmarks/soak_urdf.py --seed 0 --only 1234
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def look_at(seed: int, number: int) -> tuple[str, list[str]]:
    """Draw one robot, load it, and compare; return what became of it, and what is wrong."""
    from support.drawn_urdfs import drawn_files
    from support.urdf_checker import complaints

    with tempfile.TemporaryDirectory() as folder:
        try:
            return complaints(drawn_files(seed, number), Path(folder), np.random.default_rng((seed, number, 1)))
        except Exception:
            return "raised", [traceback.format_exc()]


def main() -> int:
    """Run it; the exit code is 1 if anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="the number of one robot, whose files are printed")
    options = parser.parse_args()
    if options.only is not None:
        from support.drawn_urdfs import drawn_files

        print(drawn_files(options.seed, options.only))
    begun, became, bad = time.perf_counter(), Counter[str](), 0
    for number in [options.only] if options.only is not None else range(options.count):
        what, wrong = look_at(options.seed, number)
        became[what] += 1
        bad += bool(wrong)
        for complaint in wrong:
            print(f"seed {options.seed}, number {number}: {complaint}", flush=True)
    print(f"{sum(became.values())} robots in {time.perf_counter() - begun:.0f} s, {bad} with complaints")
    for what, count in became.most_common():
        print(f"{count:8d} {what}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
