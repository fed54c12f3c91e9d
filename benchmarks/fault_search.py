"""Searches for faults: cases are drawn from a seed and a number, looked at in processes, and complaints printed to be pasted.

A program of this kind has a function that looks at a case and says what became of it and what is wrong; all else is here.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.study.run_study import Study, in_processes, run_study

TESTS = str(Path(__file__).resolve().parents[1] / "tests")
sys.path.insert(0, TESTS)

GROWTH = 5e-3  # [MB] a case, over the second half of a process' cases, above which memory leaks
ENOUGH = 400  # cases of a process from which on its growth means something
TOLD = 3  # complaints of a kind that are printed
KIND = 60  # characters of a complaint that tell its kind


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What is drawn.

    Attributes:
        seed, number: it is drawn from.
        part: of the program, as the name of a reader; empty where there is but one.
        options: of the program, as plain values.
        only: whether it is the only one, to be told in full.
    """

    seed: int
    number: int
    part: str = ""
    options: dict[str, Any] = field(default_factory=dict)
    only: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of a case.

    Attributes:
        became: in words, each of which is counted.
        complaints: what is wrong, a sentence each.
        measured: numbers of which median, 99 % and greatest are told, by name with its unit.
        seconds: the look took.
        resident: memory of the process afterwards [MB].
        process: its number.
    """

    became: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    measured: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    resident: float = 0.0
    process: int = 0


Look = Callable[[Case], Outcome]
"""Looks at a case; a function of a module."""


def search(
    look: Look,
    *,
    doc: str | None,
    what: str,
    count: int = 1000,
    parts: Sequence[str] = ("",),
    parts_option: str = "parts",
    add_options: Callable[[argparse.ArgumentParser], Any] | None = None,
    jobs: int = 1,
    memory: float | None = 3.0,
    hang: float = 120.0,
) -> int:
    """Run a program that searches for faults, from its command line; return its exit code, 1 if anything is wrong.

    Args:
        look: at a case.
        doc: of the program.
        what: the cases are, as "robots".
        count: of cases by default, for each part.
        parts: names of the parts of the program, each of which has cases of its own.
        parts_option: name of the option that chooses some of them.
        add_options: adds the program's own options.
        jobs: processes by default.
        memory: limit of the address space of each process by default [GB].
        hang: a case that takes longer hangs, by default [s].
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    common = parser.add_argument_group("the search")
    common.add_argument("--count", type=int, default=count, help=f"{what} (default %(default)s)")
    common.add_argument("--first", type=int, default=0, help="number of the first one")
    common.add_argument("--only", type=int, help="this one only, in this process, told in full")
    common.add_argument("--seed", type=int, default=0)
    common.add_argument("--jobs", type=int, default=jobs, help="processes (default %(default)s)")
    common.add_argument("--seconds", type=float, help="begin no more after this time [s]")
    common.add_argument("--memory", type=float, default=memory, help="limit of each process' address space [GB]")
    common.add_argument("--hang", type=float, default=hang, help="one that takes longer hangs [s]")
    common.add_argument("--records", type=Path, help="file of records; the same again goes on after a stop")
    if len(parts) > 1:
        common.add_argument(
            f"--{parts_option}", dest="parts", nargs="+", choices=list(parts), default=list(parts), metavar="NAME"
        )
    shared = {action.dest for action in parser._actions}
    if add_options is not None:
        add_options(parser)
    given = parser.parse_args()
    own = {name: value for name, value in vars(given).items() if name not in shared}
    chosen = given.parts if len(parts) > 1 else [""]
    numbers = range(given.first, given.first + given.count) if given.only is None else [given.only]
    only = given.only is not None
    cases = [Case(seed=given.seed, number=n, part=part, options=own, only=only) for part in chosen for n in numbers]
    option = f" --{parts_option}" if len(parts) > 1 else ""
    return _searched(look, cases, given, what, lambda case: _again(case, option))


def _again(case: Case, parts_option: str) -> str:
    part = f"{parts_option} '{case.part}'" if parts_option else ""
    return f"--seed {case.seed}{part} --only {case.number}"


def _searched(look: Look, cases: list[Case], given: argparse.Namespace, what: str, again: Callable[[Case], str]) -> int:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    study = Study(
        name=f"faults, {what}",
        run=partial(_looked_at, look),
        record=Outcome,
        key=again,
        definition=lambda case: {"seed": case.seed, **{name: _plain(value) for name, value in case.options.items()}},
        lost=lambda case, why: Outcome(became=["lost"], complaints=[why]),
    )
    console, kinds, heard = Console(stderr=True), Counter[str](), list[tuple[Case, Outcome]]()
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=len(cases))

        def hear(case: Case, outcome: Outcome) -> None:
            heard.append((case, outcome))
            for sentence in outcome.complaints:
                kind = _kind(sentence)
                kinds[kind] += 1
                if kinds[kind] <= TOLD:
                    bar.console.print(f"{again(case)}: {sentence}", markup=False, highlight=False, soft_wrap=True)

        begun = time.perf_counter()
        try:
            records = run_study(
                study,
                cases,
                records=given.records,
                jobs=given.jobs,
                seconds=given.seconds,
                progress=lambda done, total, _: bar.update(task, completed=done, description=f"{sum(kinds.values())} wrong"),
                watch=hear,
                execute=None
                if cases[0].only
                else partial(in_processes, jobs=given.jobs, memory_gb=given.memory, hang=given.hang),
            )
            if len(records) == len(cases):  # also those that were recorded before
                heard = list(zip(cases, records, strict=True))
        except KeyboardInterrupt:
            console.print("interrupted" + ("" if given.records else "; with --records FILE it goes on where it was"))
    outcomes = [outcome for _, outcome in heard]
    wrong = [sentence for outcome in outcomes for sentence in outcome.complaints] + _leaks(outcomes)
    print(f"{len(heard)} {what} in {time.perf_counter() - begun:.0f} s, {len(wrong)} complaints")
    _summarise(heard, kinds, again)
    for sentence in _leaks(outcomes):
        print(sentence)
    return 1 if wrong else 0


def _looked_at(look: Look, case: Case) -> Outcome:
    begun = time.perf_counter()
    try:
        found = look(case)
    except MemoryError:
        found = Outcome(became=["memory"], complaints=["the memory limit was reached"])
    except Exception:
        found = Outcome(became=["raised"], complaints=[traceback.format_exc(limit=-4)])
    return Outcome(
        became=found.became,
        complaints=found.complaints,
        measured=found.measured,
        seconds=time.perf_counter() - begun,
        resident=_resident(),
        process=os.getpid(),
    )


def _resident() -> float:
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def _kind(sentence: str) -> str:
    """Return what complaints of one cause have in common: the innermost line of a traceback, or how they begin."""
    places = [line.strip() for line in sentence.splitlines() if line.strip().startswith('File "')]
    return places[-1] if places else sentence[:KIND]


def _leaks(outcomes: Sequence[Outcome]) -> list[str]:
    """Say which processes' memory grew, over the second half of their cases."""
    by_process: dict[int, list[float]] = {}
    for outcome in outcomes:
        if outcome.process:
            by_process.setdefault(outcome.process, []).append(outcome.resident)
    out = []
    for resident in by_process.values():
        later = resident[len(resident) // 2 :]
        growth = float(np.polyfit(np.arange(len(later)), later, 1)[0]) if len(resident) >= ENOUGH else 0.0
        if growth > GROWTH:
            out.append(f"the memory of a process grows by {1e3 * growth:.3g} MB in 1000 cases, to {resident[-1]:.0f} MB")
    return out


def _summarise(heard: Sequence[tuple[Case, Outcome]], kinds: Counter[str], again: Callable[[Case], str]) -> None:
    words = Counter(word for _, outcome in heard for word in outcome.became)
    for word, times in words.most_common():
        print(f"  {times:8} {word}")
    measured: dict[str, list[float]] = {}
    for _, outcome in heard:
        for name, value in outcome.measured.items():
            measured.setdefault(name, []).append(value)
    for name, values in measured.items():
        middle, high, most = np.percentile(values, (50, 99, 100))
        print(f"  {name}: {middle:.4g} (median), {high:.4g} (99 %), {most:.4g} (most)")
    slowest = sorted(heard, key=lambda pair: -pair[1].seconds)[:3]
    if slowest:
        print("  slowest: " + ", ".join(f"{again(case)} ({outcome.seconds:.1f} s)" for case, outcome in slowest))
    most = max((outcome.resident for _, outcome in heard), default=0.0)
    print(f"  memory of a process, at most: {most:.0f} MB")
    for kind, times in kinds.most_common():
        if times > TOLD:
            print(f"  {times} times: {kind}")


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, Path) else value
