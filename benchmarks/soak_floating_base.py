"""A long search for a certificate of a floating base that is wrong, by a checker that shares nothing with the proof.

What is drawn is in tests/support/floating_cases.py, the checker in tests/support/floating_checker.py.

    python benchmarks/soak_floating_base.py --certificates 100000 --seed 0
    python benchmarks/soak_floating_base.py --certificates 100000 --seed 0 --scenes 20   # quicker: 20 obstacles a motion
    python benchmarks/soak_floating_base.py --seed 0 --only 1234
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
from spacearm.proof import certify
from support.floating_cases import drawn, drawn_again
from support.floating_checker import complaints, looseness


def run(
    certificates: int, seed: int, *, only: int | None = None, scenes: int = 1, tell: bool = True
) -> tuple[int, Counter[str]]:
    """Draw, certify and check; return how many are wrong, and how many there were of each status.

    Args:
        certificates: how many, `scenes` of them for each motion.
        seed: of all that is drawn.
        only: the number of the one motion to look at.
        scenes: obstacles drawn beside each motion, one after the other.
        tell: print what is found.
    """
    wrong, unsure, statuses = 0, 0, Counter[str]()
    loose, errors, seconds, begun = [], [], [], time.perf_counter()
    for number in range(-(-certificates // scenes)) if only is None else [only]:
        try:
            case, trajectory, way = drawn(seed, number)
        except SpacearmError as refused:
            statuses[f"refused: {str(refused)[:40]}"] += 1
            continue
        unsure += way.off > 1e-6
        for again in range(scenes):
            if again:
                case = drawn_again(case, trajectory, way, np.random.default_rng((seed, number, again)))
            try:
                certificate = certify(case, trajectory, limits=())  # type: ignore[arg-type]
            except SpacearmError as refused:
                statuses[f"refused: {str(refused)[:40]}"] += 1
                continue
            statuses[certificate.status] += 1
            seconds.append(certificate.seconds)
            assert certificate.floating is not None
            errors.append(certificate.floating.error)
            loose.append(looseness(trajectory, way, certificate))
            found = complaints(case, trajectory, way, certificate)
            wrong += bool(found)
            for sentence in found if tell else []:
                print(f"--seed {seed} --scenes {scenes} --only {number}: {sentence}", flush=True)
            if only is not None:
                print(certificate.message, certificate.floating)
        if tell and number % max(1, 1000 // scenes) == 0 and number:
            print(
                f"{sum(statuses.values())} in {time.perf_counter() - begun:.0f} s, {wrong} wrong: {dict(statuses)}", flush=True
            )
    if tell and seconds:
        middle, most = np.percentile(seconds, (50, 99)) * 1e3
        print(f"{sum(statuses.values())} certificates, {wrong} wrong: {dict(statuses)}")
        print(f"of {unsure} the checker itself knows the attitude to no better than 1e-6 rad")
        print(f"a proof takes {middle:.0f} ms (median), {most:.0f} ms (99 %)")
        print(f"attitude errors {np.median(errors):.2g} rad, 99 % {np.percentile(errors, 99):.2g}, most {max(errors):.2g}")
        print(f"the greatest rate is said too large by {np.median(loose):.2g}, 95 % {np.percentile(loose, 95):.2g}")
    return wrong, statuses


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--certificates", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="this case only")
    parser.add_argument("--scenes", type=int, default=1, help="obstacles drawn beside each motion")
    options = parser.parse_args()
    return 1 if run(options.certificates, options.seed, only=options.only, scenes=max(1, options.scenes))[0] else 0


if __name__ == "__main__":
    sys.exit(main())
