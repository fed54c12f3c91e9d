"""Fuzzing of the public face: calls with one or two absurd arguments, which must give a result or one sentence, and soon.

Numbers beyond integers and floats, NaN, text, nothing, arrays of other shapes: each call is drawn from (seed, number), which is
printed with what it found. A raw exception, a warning, a crash or no answer within 20 seconds are findings.

    python benchmarks/fuzz_arguments.py --count 5000
    python benchmarks/fuzz_arguments.py --seed 0 --only 1234
"""

from __future__ import annotations

import sys

from fault_search import Case, Outcome, search


def look(case: Case) -> Outcome:
    """Make a call with absurd arguments."""
    from spacearm.core.checks import shown
    from support.hostile_calls import finding, hostile_call

    name, changed = hostile_call((case.seed, case.number))
    kind, details = finding(name, changed)
    if kind in ("fine", "refused"):
        return Outcome(became=[kind])
    call = f"{name}({', '.join(f'{argument}={shown(value)}' for argument, value in changed.items())})"
    return Outcome(became=[kind], complaints=[f"{call} {kind}: {details}"])


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="calls", count=5000, memory=4.0))
