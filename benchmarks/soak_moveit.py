"""A soak of MoveIt's files: thousands are drawn, with frames everywhere, and another reader places everything once more.

Robots whose group leaves joints out, with and without a virtual joint; scenes and requests in both layouts of objects, with
headers that name the planning frame, links, objects, subframes, fixed transforms or nothing; moved bases, things in the hand,
meshes in files; goals by joints and in space. The other reader is Pinocchio and plain NumPy, written after MoveIt's source.
Files are drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak_moveit.py --count 5000
    python benchmarks/soak_moveit.py --seed 0 --only 1234 --keep DIR
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def look_at(seed: int, number: int, folder: Path) -> list[str]:
    """Draw files, and list what the two readers place differently; everything drawn is legal, so a refusal is wrong, too."""
    from support.drawn_moveit import drawn_files
    from support.moveit_checker import complaints

    rng = np.random.default_rng((seed, number))
    files = drawn_files(rng, folder)
    try:
        return complaints(files, rng)
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return [f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"]


def main() -> int:
    """Run them, print what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="one number, told in full")
    parser.add_argument("--keep", type=Path, help="a folder for the files of --only")
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.count) if options.only is None else [options.only]
    begun, wrong = time.perf_counter(), Counter[str]()
    for number in numbers:
        with tempfile.TemporaryDirectory() as folder:
            said = look_at(options.seed, number, Path(folder))
            if options.keep is not None:
                shutil.copytree(folder, options.keep, dirs_exist_ok=True)
        for sentence in said if options.only is not None else said[:1]:
            wrong[sentence.split(" differs")[0][:60]] += 1
            print(f"--seed {options.seed} --only {number}: {sentence}", flush=True)
    print(f"{len(numbers)} drawn in {time.perf_counter() - begun:.0f} s, {sum(wrong.values())} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
