"""A soak: thousands of drawn problems planned under a memory limit, and every plan looked at by others.

Robots with branches, slides, mimics and joints that turn without end; obstacles of every shape; goals of every kind; small
budgets. A motion that was found is measured by Pinocchio and Coal at many random instants: it must keep the clearance that
its certificate states, its limits, and end where it should. Nothing may be raised but a SpacearmError, nothing may crash or
hang, and the memory must not grow. A problem is drawn from (seed, number), which is printed with whatever is wrong.

    python benchmarks/soak.py --count 10000 --processes 2
    python benchmarks/soak.py --seed 0 --only 1234
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

GROWTH = 5e-3  # [MB] a problem, over the second half of a process' problems, above which memory leaks
ENOUGH = 400  # problems of a process from which on its growth means something
AGAIN = 0.02  # share of the problems that are planned twice, for the same bits


class Outcome(NamedTuple):
    """What became of a problem."""

    number: int
    status: str
    complaints: list[str]
    planning: float  # [s]
    proof: float  # [s] of it
    checking: float  # [s]
    resident: float  # [MB] afterwards


def look_at(seed: int, number: int, instants: int) -> Outcome:
    """Plan one problem and check the plan."""
    from spacearm.errors import SpacearmError
    from spacearm.planner import plan
    from spacearm.proof.digest import trajectory_digest
    from support.drawn_problems import drawn_problem
    from support.plan_checker import complaints

    rng = np.random.default_rng((seed, number, 1))
    begun = planned = time.perf_counter()
    status, wrong, proof = "", [], 0.0
    try:
        drawn = drawn_problem(seed, number)
        begun = time.perf_counter()
        found = plan(drawn.problem, drawn.settings, rng=number)
        planned = time.perf_counter()
        status, proof = found.status, found.timings.get("certify", 0.0)
        wrong = complaints(found, instants=instants, rng=rng)
        if rng.random() < AGAIN:
            again = plan(drawn.problem, drawn.settings, rng=number)
            same = [None if each.trajectory is None else trajectory_digest(each.trajectory) for each in (found, again)]
            if again.status != status or same[0] != same[1]:
                wrong.append("planned again with the same seed, another motion came out")
    except SpacearmError as error:
        planned, status = time.perf_counter(), "refused"
        wrong = [f"refused: {error}"]  # what is drawn is a problem, if a hard one
    except MemoryError:
        planned, status, wrong = time.perf_counter(), "memory", ["the memory limit was reached"]
    except Exception:
        planned, status, wrong = time.perf_counter(), "raised", [traceback.format_exc(limit=-4)]
    return Outcome(number, status, wrong, planned - begun, proof, time.perf_counter() - planned, _resident())


def _resident() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def work(pipe: Connection, seed: int, instants: int, limit_gb: float) -> None:
    """Look at the problems whose numbers come through the pipe, until it is closed."""
    most = int(limit_gb * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    try:
        while True:
            pipe.send(look_at(seed, pipe.recv(), instants))
    except (EOFError, KeyboardInterrupt, BrokenPipeError):
        return


@dataclass
class Worker:
    """A process, and what it is at."""

    process: BaseProcess
    pipe: Connection
    number: int = -1
    since: float = 0.0
    resident: list[float] = field(default_factory=list)

    @property
    def growth(self) -> float:
        """Of the memory over the second half of its problems [MB a problem]; 0 while there are too few."""
        later = self.resident[len(self.resident) // 2 :]
        if len(self.resident) < ENOUGH:
            return 0.0
        return float(np.polyfit(np.arange(len(later)), later, 1)[0])


class Soak:
    """The processes, and the sums of what they say."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.statuses: Counter[str] = Counter()
        self.wrong: list[tuple[int, str]] = []
        self.seconds: list[tuple[float, float, float, int]] = []  # planning, proof, checking, number
        self.gone: list[Worker] = []
        self.context = multiprocessing.get_context("spawn")
        self.workers = [self.begin() for _ in range(options.processes)]

    def begin(self) -> Worker:
        """Begin a process."""
        ours, theirs = self.context.Pipe()
        arguments = (theirs, self.options.seed, self.options.instants, self.options.memory)
        process = self.context.Process(target=work, args=arguments, daemon=True)
        process.start()
        theirs.close()
        return Worker(process, ours)

    def run(self, tell: Callable[[], None]) -> None:
        """Hand out the numbers; `tell` is called after each problem."""
        numbers = iter(range(self.options.first, self.options.first + self.options.count))
        begun = time.perf_counter()
        idle, busy = list(self.workers), list[Worker]()
        while True:
            while idle and (not self.options.seconds or time.perf_counter() - begun < self.options.seconds):
                number = next(numbers, None)
                if number is None:
                    break
                worker = idle.pop()
                worker.number, worker.since = number, time.perf_counter()
                worker.pipe.send(number)
                busy.append(worker)
            if not busy:
                return
            ready = wait([worker.pipe for worker in busy], timeout=1.0)
            for worker in list(busy):
                if worker.pipe in ready or time.perf_counter() - worker.since > self.options.hang:
                    busy.remove(worker)
                    idle.append(worker if self.heard(worker, spoke=worker.pipe in ready) else self.replaced(worker))
                    tell()

    def heard(self, worker: Worker, *, spoke: bool) -> bool:
        """Take in what a worker says; False if it crashed or hangs."""
        try:
            outcome: Outcome | None = worker.pipe.recv() if spoke else None
        except (EOFError, ConnectionResetError):
            worker.process.join(5)
            self.statuses["crashed"] += 1
            self.wrong.append((worker.number, f"the process ended with exit code {worker.process.exitcode}"))
            return False
        if outcome is None:
            self.statuses["hung"] += 1
            self.wrong.append((worker.number, f"no answer within {self.options.hang:g} s"))
            return False
        self.statuses[outcome.status] += 1
        self.wrong += [(outcome.number, sentence) for sentence in outcome.complaints]
        self.seconds.append((outcome.planning, outcome.proof, outcome.checking, outcome.number))
        worker.resident.append(outcome.resident)
        return True

    def replaced(self, worker: Worker) -> Worker:
        """End a process, and begin another one in its place."""
        worker.process.kill()
        self.workers.remove(worker)
        self.gone.append(worker)
        self.workers.append(self.begin())
        return self.workers[-1]

    def end(self) -> None:
        """Close the pipes, which ends the processes, and judge the memory."""
        for worker in self.workers:
            worker.pipe.close()
            worker.process.join(5)
        for worker in (*self.workers, *self.gone):
            if worker.growth > GROWTH:
                self.wrong.append((worker.number, f"memory grows by {1e3 * worker.growth:.3g} MB in 1000 problems"))


def main() -> int:
    """Run the soak; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000, help="problems")
    parser.add_argument("--first", type=int, default=0, help="number of the first one: resumes a run")
    parser.add_argument("--only", type=int, help="this one only, in this process")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--instants", type=int, default=200, help="random instants of each motion found")
    parser.add_argument("--memory", type=float, default=3.0, help="limit of each process' address space [GB]")
    parser.add_argument("--hang", type=float, default=120.0, help="a problem that takes longer hangs [s]")
    parser.add_argument("--seconds", type=float, default=0.0, help="begin no more problems after this time [s]; 0: no limit")
    options = parser.parse_args()
    if options.only is not None:
        outcome = look_at(options.seed, options.only, options.instants)
        print(outcome._asdict())
        return 1 if outcome.complaints else 0
    return soaked(options)


def soaked(options: argparse.Namespace) -> int:
    """Run many problems, tell the progress, print the summary."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    begun = time.perf_counter()
    soak, console, shown = Soak(options), Console(stderr=True), 0
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=options.count)

        def tell() -> None:
            nonlocal shown
            for number, sentence in soak.wrong[shown:]:
                bar.console.print(f"--seed {options.seed} --only {number}: {sentence}", markup=False, highlight=False)
            shown = len(soak.wrong)
            bar.update(task, advance=1, description=f"{shown} wrong" if shown else "")

        try:
            soak.run(tell)
        except KeyboardInterrupt:
            console.print(f"interrupted; --first {options.first + len(soak.seconds)} goes on")
        soak.end()
        tell()
    summarize(soak, time.perf_counter() - begun)
    return 1 if soak.wrong else 0


def summarize(soak: Soak, took: float) -> None:
    """Print the figures."""
    from rich.console import Console
    from rich.table import Table

    rows = np.array(soak.seconds) if soak.seconds else np.zeros((1, 4))
    table = Table(title=f"{sum(soak.statuses.values())} problems in {took:.0f} s", show_header=False)
    for status, count in soak.statuses.most_common():
        table.add_row(status, str(count))
    instants = soak.statuses["found"] * (soak.options.instants + 11)
    table.add_row("instants measured", str(instants))
    for name, column in (("planning", 0), ("of it proofs", 1), ("checking", 2)):
        middle, high, most = np.percentile(rows[:, column], (50, 99, 100)) * 1e3
        table.add_row(f"{name} [ms]", f"{middle:.0f} (median), {high:.0f} (99 %), {most:.0f} (most)")
    slowest = rows[np.argsort(rows[:, 0])[::-1][:5]]
    table.add_row("slowest", ", ".join(f"{int(row[3])} ({row[0]:.1f} s)" for row in slowest))
    for worker in (*soak.workers, *soak.gone):
        if worker.resident:
            growth = f"{1e3 * worker.growth:+.2f} MB in 1000 problems" if len(worker.resident) >= ENOUGH else "too few to tell"
            resident = worker.resident
            memory = f"{resident[0]:.0f}, at most {max(resident):.0f}, at last {resident[-1]:.0f} MB; later {growth}"
            table.add_row("memory of a process", memory)
    table.add_row("wrong", str(len(soak.wrong)))
    Console(width=110).print(table)
    for number, sentence in soak.wrong[:20]:
        print(f"--seed {soak.options.seed} --only {number}: {sentence}")


if __name__ == "__main__":
    sys.exit(main())
