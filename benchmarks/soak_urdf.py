"""A soak of the readers of robots: drawn URDF, SRDF and joint_limits.yaml, and a second reader that looks at the robots.

Mimics of mimics, slides that follow turning joints, limits from every source and limits that mean none, lengths from
millimetres to kilometres, XML that only urdfdom reads. The second reader (`tests/support/urdf_checker.py`) is made of
ElementTree, PyYAML and Pinocchio: it compares frames, and every joint's own limits, also along motions that are as fast as the
limits allow. A robot is drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak_urdf.py --count 10000
    python benchmarks/soak_urdf.py --seed 0 --only 1234
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from fault_search import Case, Outcome, search


def look(case: Case) -> Outcome:
    """Draw one robot, load it, and compare; its files are printed if it is the only one."""
    from support.drawn_urdfs import drawn_files
    from support.urdf_checker import complaints

    files = drawn_files(case.seed, case.number)
    if case.only:
        print(files)
    with tempfile.TemporaryDirectory() as folder:
        became, wrong = complaints(files, Path(folder), np.random.default_rng((case.seed, case.number, 1)))
    return Outcome(became=[became], complaints=wrong)


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="robots"))
