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

from fault_search import Case, Outcome, search


def look(case: Case) -> Outcome:
    """Draw a robot, load it, change it, hold something, plan and certify."""
    from support.drawn_robots import look_at

    wrong, became = look_at(case.seed, case.number, instants=case.options["instants"])
    return Outcome(became=became, complaints=wrong)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--instants", type=int, default=60, help="of each motion that is proven")


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="robots", add_options=add_options))
