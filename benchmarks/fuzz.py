"""Fuzzing of every reader: tens of thousands of broken files, each of which must give a result or one sentence.

Valid URDFs, SRDFs, robots, problems, plans, trajectories, MoveIt scenes and requests, meshes and point clouds are changed in
one to four places: bits flipped, cut off, tokens swapped, lines doubled, numbers made nan or 1e308, types changed, nested
thirty thousand deep. A traceback, a warning, a message of several lines, a crash, or five seconds of computing without an
answer are findings; the file is kept. A case is drawn from (seed, reader, number), which is printed with it.

    python benchmarks/fuzz.py --count 5000 --processes 2
    python benchmarks/fuzz.py --readers urdf --first 1234 --count 1
"""

from __future__ import annotations

import argparse
import multiprocessing
import re
import resource
import sys
import tempfile
import time
from collections import Counter
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

FINE = ("read", "refused")


def work(pipe: Connection, at: Synchronized[int], name: str, seed: int, first: int, last: int, limit_gb: float) -> None:
    """Read the files from first to last; send counts and findings."""
    from support.file_readers import beside, readers
    from support.wrong_files import finding, wrong_file

    most = int(limit_gb * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    known = readers()
    reader, index = known[name], list(known).index(name)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        beside(folder)
        for number in range(first, last):
            at.value = number
            data = wrong_file(reader, (seed, index, number))
            begun = time.perf_counter()
            kind, details = finding(reader, folder / f"case.{reader.suffix}", data)
            pipe.send((number, kind, details, time.perf_counter() - begun, b"" if kind in FINE else data))
    pipe.close()


class Fuzz:
    """One reader's cases, in a process of its own that is begun anew when it crashes."""

    def __init__(self, name: str, options: argparse.Namespace) -> None:
        self.name, self.options = name, options
        self.counts: Counter[str] = Counter()
        self.findings: dict[str, list[tuple[int, str]]] = {}
        self.slowest = 0.0
        self.next, self.last = options.first, options.first + options.count
        self.context = multiprocessing.get_context("spawn")
        self.begin()

    def begin(self) -> None:
        """Begin the process."""
        self.at = self.context.Value("q", self.next)
        self.pipe, theirs = self.context.Pipe(duplex=False)
        arguments = (theirs, self.at, self.name, self.options.seed, self.next, self.last, self.options.memory)
        self.process = self.context.Process(target=work, args=arguments, daemon=True)
        self.process.start()
        theirs.close()

    def hear(self) -> bool:
        """Take in what there is; False when all is done."""
        try:
            number, kind, details, seconds, data = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            if self.process.exitcode == 0 and self.next >= self.last:
                return False
            self.found(self.at.value, "crashes", f"exit code {self.process.exitcode}", b"")
            self.next = self.at.value + 1
            if self.next >= self.last:
                return False
            self.begin()
            return True
        self.next = number + 1
        self.slowest = max(self.slowest, seconds)
        if kind in FINE:
            self.counts[kind] += 1
        else:
            self.found(number, kind, details, data)
        return True

    def found(self, number: int, kind: str, details: str, data: bytes) -> None:
        """Count a finding, and keep the first of its kind with its file."""
        self.counts["findings"] += 1
        known = self.findings.setdefault(f"{kind} at {_place(details)}", [])
        known.append((number, details))
        if len(known) == 1 and data and self.options.keep:
            folder = Path(self.options.keep)
            folder.mkdir(parents=True, exist_ok=True)
            (folder / f"{self.name.replace(' ', '_')}_{number}").write_bytes(data)


def _place(details: str) -> str:
    """The innermost line of ours in a traceback, so that findings of one cause are one."""
    places = re.findall(r'File "[^"]*?(spacearm/[^"]*)", line (\d+)', details)
    return ":".join(places[-1]) if places else details.split("\n", 1)[0][:100]


def main() -> int:
    """Run the fuzzing; 1 if there are findings."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=5000, help="files of each reader")
    parser.add_argument("--first", type=int, default=0, help="number of the first one: resumes a run")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--readers", nargs="*", help="names of readers; all by default")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--memory", type=float, default=3.0, help="limit of each process' address space [GB]")
    parser.add_argument("--keep", help="folder for the files that are findings")
    options = parser.parse_args()
    from support.file_readers import readers

    names = list(readers())
    for name in options.readers or ():
        if name not in names:
            parser.error(f"there is no reader '{name}'; known: {', '.join(names)}")
    return fuzzed(options.readers or names, options)


def fuzzed(names: list[str], options: argparse.Namespace) -> int:
    """Run the readers, so many at a time; print counts and findings."""
    from multiprocessing.connection import wait

    from rich.console import Console
    from rich.progress import Progress

    begun, done, running, waiting = time.perf_counter(), list[Fuzz](), list[Fuzz](), list(names)
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("files", total=len(names) * options.count)
        while waiting or running:
            while waiting and len(running) < options.processes:
                running.append(Fuzz(waiting.pop(0), options))
            ready = wait([fuzz.pipe for fuzz in running], timeout=1.0)
            for fuzz in [fuzz for fuzz in running if fuzz.pipe in ready]:
                if fuzz.hear():
                    bar.update(task, advance=1)
                else:
                    running.remove(fuzz)
                    done.append(fuzz)
    summarize(done, time.perf_counter() - begun, options)
    return 1 if any(fuzz.findings for fuzz in done) else 0


def summarize(done: list[Fuzz], took: float, options: argparse.Namespace) -> None:
    """Print the counts of each reader, and each finding once."""
    from rich.console import Console
    from rich.table import Table

    table = Table("reader", "read", "refused", "findings", "slowest [s]")
    for fuzz in done:
        counts = (str(fuzz.counts[kind]) for kind in ("read", "refused", "findings"))
        table.add_row(fuzz.name, *counts, f"{fuzz.slowest:.2f}")
    total = sum(sum(fuzz.counts.values()) for fuzz in done)
    table.title = f"{total} files in {took:.0f} s"
    Console(width=100).print(table)
    for fuzz in done:
        for kind, cases in fuzz.findings.items():
            number, details = cases[0]
            again = f"--seed {options.seed} --readers '{fuzz.name}' --first {number} --count 1"
            print(f"{again}: {kind}, {len(cases)} times\n{details}")


if __name__ == "__main__":
    sys.exit(main())
