"""Fuzzing of every reader: tens of thousands of broken files, each of which must give a result or one sentence.

Valid URDFs, SRDFs, robots, problems, plans, trajectories, MoveIt scenes and requests, meshes and point clouds are changed in
one to four places: bits flipped, cut off, tokens swapped, lines doubled, numbers made nan or 1e308, types changed, nested
thirty thousand deep. A traceback, a warning, a message of several lines, a crash, or five seconds of computing without an
answer are findings; the file is kept. A case is drawn from (seed, reader, number), which is printed with it.

    python benchmarks/fuzz.py --count 5000 --jobs 2
    python benchmarks/fuzz.py --readers urdf --only 1234
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from fault_search import Case, Outcome, search


@cache
def prepared() -> tuple[dict[str, Any], tempfile.TemporaryDirectory[str]]:
    """Return the readers by name, and a folder with the files that the texts name."""
    from support.file_readers import beside, readers

    folder = tempfile.TemporaryDirectory()
    beside(Path(folder.name))
    return readers(), folder


def look(case: Case) -> Outcome:
    """Read a file that is wrong; keep it if it is a finding."""
    from support.wrong_files import finding, wrong_file

    readers, folder = prepared()
    reader = readers[case.part]
    data = wrong_file(reader, (case.seed, list(readers).index(case.part), case.number))
    if case.options["keep"] is not None:  # written before it is read, for reading it may end the process
        kept = Path(case.options["keep"]) / f"{case.part.replace(' ', '_')}_{case.number}"
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(data)
    kind, details = finding(reader, Path(folder.name) / f"case.{reader.suffix}", data)
    fine = kind in ("read", "refused")
    if fine and case.options["keep"] is not None:
        kept.unlink()
    return Outcome(became=[f"{case.part}: {kind}"], complaints=[] if fine else [f"{kind}: {details}"])


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--keep", help="folder for the files that are findings")


def main() -> int:
    """Run the fuzzing; 1 if there are findings."""
    from support.file_readers import readers

    names = list(readers())
    return search(
        look,
        doc=__doc__,
        what="files",
        count=5000,
        parts=names,
        parts_option="readers",
        add_options=add_options,
        jobs=2,
        hang=30.0,
    )


if __name__ == "__main__":
    sys.exit(main())
