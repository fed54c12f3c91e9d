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
import traceback
from pathlib import Path

import numpy as np

from fault_search import Case, Outcome, search


def look(case: Case) -> Outcome:
    """Draw files, and list what the two readers place differently; everything drawn is legal, so a refusal is wrong, too."""
    from support.drawn_moveit import drawn_files
    from support.moveit_checker import complaints

    rng = np.random.default_rng((case.seed, case.number))
    with tempfile.TemporaryDirectory() as folder:
        files = drawn_files(rng, Path(folder))
        try:
            wrong = complaints(files, rng)
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            wrong = [f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"]
        if case.only and case.options["keep"] is not None:
            shutil.copytree(folder, case.options["keep"], dirs_exist_ok=True)
    return Outcome(became=["differs" if wrong else "agrees"], complaints=wrong if case.only else wrong[:1])


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--keep", type=Path, help="a folder for the files of --only")


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="pairs of files", count=5000, add_options=add_options))
