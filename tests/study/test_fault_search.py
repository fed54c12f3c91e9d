"""The searches for faults of `benchmarks/`: what is wrong is printed to be pasted, and a crash is a finding."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from house.source import REPOSITORY

PROGRAM = """
import os, sys
sys.path.insert(0, {benchmarks!r})
from fault_search import Case, Outcome, search

def look(case: Case) -> Outcome:
    if case.number == 3:
        os._exit(9)
    if case.number == 4:
        raise ZeroDivisionError("nothing can be shared")
    wrong = ["it is five"] if case.number == 5 and case.seed == 2 else []
    return Outcome(became=["odd" if case.number % 2 else "even"], complaints=wrong, measured={{"number": float(case.number)}})

if __name__ == "__main__":
    sys.exit(search(look, doc="A search.", what="numbers"))
"""


def searched(folder: Path, *words: str) -> tuple[int, str]:
    (folder / "search.py").write_text(PROGRAM.format(benchmarks=str(REPOSITORY / "benchmarks")))
    done = subprocess.run(
        [sys.executable, "search.py", *words], cwd=folder, capture_output=True, text=True, check=False, timeout=120
    )
    return done.returncode, done.stdout + done.stderr


def test_complaints_crashes_and_exceptions_are_told_and_a_stopped_search_goes_on(tmp_path: Path) -> None:
    assert searched(tmp_path, "--count", "3", "--records", "r.jsonl")[0] == 0
    code, text = searched(tmp_path, "--count", "7", "--seed", "0", "--jobs", "2", "--records", "r.jsonl")
    assert code == 1
    assert "--seed 0 --only 3: the process ended with exit code 9" in text
    assert "--seed 0 --only 4: Traceback" in text
    assert "7 numbers in" in text
    assert "2 complaints" in text
    assert len((tmp_path / "r.jsonl").read_text().splitlines()) == 1 + 7
    code, text = searched(tmp_path, "--only", "5", "--seed", "2")
    assert code == 1
    assert "--seed 2 --only 5: it is five" in text
