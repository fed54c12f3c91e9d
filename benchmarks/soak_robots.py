"""A soak of robots: drawn as files, loaded, changed, planned and certified, and looked at by a checker of its own.

Robots with slides, mimics, locked joints, fixed links, links without shapes, of 1 cm to 100 m; SRDFs that forget pairs; limits
and shapes that are changed after loading; something in the hand; trajectories beyond the limits, and with the joints in
another order. Whatever is "found" or "holds" is measured by kinematics and distances that know only the numbers drawn, for
all pairs of links but those that the certificate names. A robot is drawn from (seed, number), printed with what is wrong.

    python benchmarks/soak_robots.py --count 5000
    python benchmarks/soak_robots.py --seed 0 --only 1234
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def main() -> int:
    """Run the soak; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="robots")
    parser.add_argument("--first", type=int, default=0, help="number of the first one: resumes a run")
    parser.add_argument("--only", type=int, help="this one only")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--instants", type=int, default=60, help="of each motion that is proven")
    parser.add_argument("--seconds", type=float, default=0.0, help="begin no more after this time [s]; 0: no limit")
    options = parser.parse_args()
    from support.drawn_robots import look_at

    numbers = range(options.first, options.first + options.count) if options.only is None else [options.only]
    became, wrong, done, begun = Counter[str](), 0, 0, time.perf_counter()
    for number in numbers:
        if options.seconds and time.perf_counter() - begun > options.seconds:
            break
        try:
            said, words = look_at(options.seed, number, instants=options.instants)
        except Exception:
            said, words = [traceback.format_exc(limit=-4)], ["raised"]
        became.update(words)
        wrong, done = wrong + bool(said), done + 1
        for sentence in said:
            print(f"--seed {options.seed} --only {number}: {sentence}", flush=True)
    print(f"{done} robots in {time.perf_counter() - begun:.0f} s, {wrong} of them wrong")
    for word, count in became.most_common():
        print(f"  {word:22} {count}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
