"""A long search for a certificate of a floating base that is wrong, by a checker that shares nothing with the proof.

A case is a motion, which is certified among `--scenes` obstacles, one after the other. What is drawn is in
tests/support/floating_cases.py, the checker in tests/support/floating_checker.py.

    python benchmarks/soak_floating_base.py --count 100000 --jobs 2
    python benchmarks/soak_floating_base.py --count 5000 --scenes 20   # quicker: 20 obstacles a motion
    python benchmarks/soak_floating_base.py --seed 0 --only 1234
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from fault_search import Case, Outcome, search


def look(case: Case) -> Outcome:
    """Draw a motion, certify it among each of its obstacles, and check the certificates."""
    from spacearm.core.errors import SpacearmError
    from spacearm.proof import certify
    from support.floating_cases import drawn, drawn_again
    from support.floating_checker import complaints, looseness

    try:
        problem, trajectory, way = drawn(case.seed, case.number)
    except SpacearmError as refused:
        return Outcome(became=[f"refused: {str(refused)[:40]}"])
    became = ["the checker itself knows the attitude to no better than 1e-6 rad"] if way.off > 1e-6 else []
    wrong, measured = [], {}
    for again in range(max(1, case.options["scenes"])):
        if again:
            problem = drawn_again(problem, trajectory, way, np.random.default_rng((case.seed, case.number, again)))
        try:
            certificate = certify(problem, trajectory, limits=())  # type: ignore[arg-type]
        except SpacearmError as refused:
            became.append(f"refused: {str(refused)[:40]}")
            continue
        assert certificate.floating is not None
        became.append(certificate.status)
        measured = {
            "a proof [s]": certificate.seconds,
            "error of the attitude [rad]": certificate.floating.error,
            "by how much the greatest rate is said too large": looseness(trajectory, way, certificate),
        }
        wrong += [f"obstacle {again}: {sentence}" for sentence in complaints(problem, trajectory, way, certificate)]
        if case.only:
            print(certificate.message, certificate.floating)
    return Outcome(became=became, complaints=wrong, measured=measured)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--scenes", type=int, default=1, help="obstacles drawn beside each motion")


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="motions", add_options=add_options))
