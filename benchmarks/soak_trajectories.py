"""A long search for a certificate that is wrong about how a trajectory is written down.

Trajectories with jumps, stairs, corners, rests, dwells, steep time laws, huge values beside small ones, pieces of a microsecond
and polynomials of high degree; limits and obstacles that are just kept or just broken; some bases float, some of these tumble.
What holds is looked at by a checker with its own kinematics, distances and differences
(`tests/support/drawn_trajectories.py`). A case is drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak_trajectories.py --count 5000 --seed 1
    python benchmarks/soak_trajectories.py --seed 1 --only 1234
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from fault_search import Case, Outcome, search

_LIMITS: tuple[Any, ...] = (("position", "velocity", "acceleration"), ("position", "velocity"), ("velocity",), ())


def look(case: Case) -> Outcome:
    """Draw a trajectory, certify it, and look at it."""
    from spacearm.core.errors import SpacearmError
    from spacearm.proof import certify
    from support.drawn_trajectories import complaints, drawn_case

    try:
        drawn = drawn_case(case.seed, case.number)
        rng = np.random.default_rng((case.seed, case.number, 1))
        certificate = certify(drawn, drawn.trajectory, limits=_LIMITS[int(rng.integers(0, len(_LIMITS)))])
        wrong = complaints(drawn, certificate, rng)
    except SpacearmError as refusal:
        if case.only:
            print(refusal)
        return Outcome(became=["refused"])
    if case.only:
        print(certificate.status, certificate.message, certificate.broken_limits)
    kind = drawn.kind + (", floating" if drawn.base == "floating" else "")
    return Outcome(became=[f"{kind}: {certificate.status}"], complaints=[f"{kind}: {sentence}" for sentence in wrong])


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="trajectories", count=2000))
