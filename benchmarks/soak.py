"""A soak: thousands of drawn problems planned under a memory limit, and every plan looked at by others.

Robots with branches, slides, mimics and joints that turn without end; obstacles of every shape; goals of every kind; small
budgets. A motion that was found is measured by Pinocchio and Coal at many random instants: it must keep the clearance that
its certificate states, its limits, and end where it should. Nothing may be raised but a SpacearmError, nothing may crash or
hang, and the memory must not grow. A problem is drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak.py --count 10000 --jobs 2 --records soak.jsonl
    python benchmarks/soak.py --shapes --instants 1000
    python benchmarks/soak.py --seed 0 --only 1234
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from fault_search import Case, Outcome, search

AGAIN = 0.02  # share of the problems that are planned twice, for the same bits


def look(case: Case) -> Outcome:
    """Plan one problem and check the plan."""
    from spacearm.core.errors import SpacearmError
    from spacearm.planner import plan
    from spacearm.proof.certificate import trajectory_digest
    from support.drawn_bodies import drawn_body_problem
    from support.drawn_problems import drawn_problem
    from support.plan_checker import complaints

    rng = np.random.default_rng((case.seed, case.number, 1))
    try:
        drawn = (drawn_body_problem if case.options["shapes"] else drawn_problem)(case.seed, case.number)
        found = plan(drawn.problem, drawn.settings, rng=case.number)
        wrong = complaints(found, instants=case.options["instants"], rng=rng)
        if rng.random() < AGAIN:
            again = plan(drawn.problem, drawn.settings, rng=case.number)
            same = [None if each.trajectory is None else trajectory_digest(each.trajectory) for each in (found, again)]
            if again.status != found.status or same[0] != same[1]:
                wrong.append("planned again with the same seed, another motion came out")
    except SpacearmError as error:  # what is drawn is a problem, if a hard one
        return Outcome(became=["refused"], complaints=[f"refused: {error}"])
    measured = {"planning [s]": found.timings["total"], "of it proofs [s]": found.timings.get("certify", 0.0)}
    return Outcome(became=[found.status], complaints=wrong, measured=measured)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--shapes", action="store_true", help="links, base and obstacles of every shape; bases that float")
    parser.add_argument("--instants", type=int, default=200, help="random instants of each motion found")


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="problems", count=10_000, add_options=add_options, jobs=2))
