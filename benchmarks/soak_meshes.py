"""A soak of meshes: drawn as exporters write them, enclosed, and looked at by a checker that knows the solid.

Boxes, plates, balls, rings, cones, angles, hulls, alone, apart, overlapping, nested or glued; inside out, mirrored, doubled,
with a second skin, flipped faces, rounded corners, T-junctions, small holes, walls, gaps, openings; turned, and scaled from
1e-3 to 1e3; from memory, STL, OBJ, PLY, GLB, and COLLADA in drawn units. Every point of the surface, and of the solid that it
came from, must be in the balls, or in the capsules of a link. A mesh is drawn from (seed, number), which is printed with
whatever is wrong.

    python benchmarks/soak_meshes.py --count 3000 --seed 0
    python benchmarks/soak_meshes.py --seed 0 --only 1234
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def main() -> int:
    """Draw, enclose, look; return 1 if anything is wrong."""
    from support.drawn_meshes import Outcome, looked_at

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", type=int)
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.count) if options.only is None else [options.only]
    drawn: Counter[str] = Counter()
    refused: Counter[str] = Counter()
    wrong, slowest, begun = 0, (0.0, -1), time.perf_counter()
    with tempfile.TemporaryDirectory() as place:
        for number in numbers:
            at = time.perf_counter()
            try:
                found = looked_at(options.seed, number, Path(place))
            except Exception:
                found = Outcome([], "", [traceback.format_exc(limit=-4)])
            slowest = max(slowest, (time.perf_counter() - at, number))
            drawn.update(found.drawn)
            if found.refused:
                refused[found.refused.split(",")[0][:60]] += 1
            for complaint in found.complaints:
                wrong += 1
                print(f"seed {options.seed}, number {number} ({', '.join(found.drawn)}): {complaint}", flush=True)
    print(f"{len(numbers):,} meshes in {time.perf_counter() - begun:.0f} s; the slowest, {slowest[1]}, took {slowest[0]:.1f} s")
    print("drawn: " + ", ".join(f"{name} {count}" for name, count in drawn.most_common()))
    print(f"refused: {sum(refused.values())}" + "".join(f"\n    {count} x {text}" for text, count in refused.most_common()))
    print(f"wrong: {wrong}")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
