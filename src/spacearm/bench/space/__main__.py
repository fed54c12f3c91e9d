"""Write the frozen set: python -m spacearm.bench.space FOLDER [--seed N] [--problems N] [--families NAME ...]."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from spacearm.bench.space.collection import FAMILIES, write_family
from spacearm.bench.space.generate import PROBLEMS, SEED, generate
from spacearm.errors import SpacearmError


def main() -> int:
    """Draw, solve and write; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m spacearm.bench.space", description="Write the frozen set of SpaceBench.")
    parser.add_argument("folder", type=Path, help="where a file for each family is written, over one that is there")
    parser.add_argument("--seed", type=int, default=SEED, help="of the set; the same one gives the same files (%(default)s)")
    parser.add_argument("--problems", type=int, default=PROBLEMS, help="of each family (%(default)s)")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=FAMILIES, help="only these")
    given = parser.parse_args()
    try:
        given.folder.mkdir(parents=True, exist_ok=True)
        for family in given.families:
            begun = time.perf_counter()
            drawn = generate(family, seed=given.seed, number=given.problems, progress=_tell(family))
            path = given.folder / f"{family}.json"
            write_family(path, family, drawn.problems, seed=given.seed, left_out=drawn.left_out)
            print(f"\r{path}: {len(drawn.problems)} problems, {time.perf_counter() - begun:.1f} s; left out: {drawn.left_out}")
    except (SpacearmError, OSError) as error:
        print(f"spacearm: {error}", file=sys.stderr)
        return 2
    return 0


def _tell(family: str):
    return lambda done, total: print(f"\r{family} {done}/{total}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
