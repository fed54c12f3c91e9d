"""How a study runs: the tasks that are not recorded yet are done, and each record is written down as it comes."""

from __future__ import annotations

import contextlib
import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

from spacearm.core.errors import SettingsError
from spacearm.core.records import whole
from spacearm.study.study_records import appending, load_records, require_same_definition
from spacearm.study.workers import Lost, in_processes, in_this_process

T = TypeVar("T")
R = TypeVar("R")

MOST_JOBS = 1024
"""More processes cost memory and win nothing."""

Progress: TypeAlias = Callable[[int, int, str], Any]
"""Called with the tasks done, the tasks in all, and the name of the one that is next."""

Execute: TypeAlias = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[tuple[int, Any]]]
"""Does tasks: takes a function and its arguments, and yields the number of each argument with its result, in any order."""


@dataclass(frozen=True, kw_only=True)
class Study(Generic[T, R]):
    """What a study does with each task.

    Attributes:
        name: of the study; its files of records begin with it.
        run: does a task; a function of a module, so that other processes can import it. Its chance comes from a seed that the
            task holds, so that the record is the same in any process and in any order.
        record: class of its records: a dataclass of numbers, texts, tuples, dictionaries and such dataclasses.
        key: names a task; each of a study's tasks has another name.
        definition: all that the record of a task depends on, as plain values; files and long values by their digest.
        timed: whether records hold times. Then tasks are done one at a time unless `jobs` says otherwise.
        lost: makes the record of a task whose process died or took too long, from the task and the reason; None: that ends the
            study with an error.
    """

    name: str
    run: Callable[[T], R]
    record: type[R]
    key: Callable[[T], str]
    definition: Callable[[T], Mapping[str, Any]]
    timed: bool = False
    lost: Callable[[T, str], R] | None = None


def run_study(
    study: Study[T, R],
    tasks: Sequence[T],
    *,
    records: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    seconds: float | None = None,
    progress: Progress | None = None,
    watch: Callable[[T, R], Any] | None = None,
    execute: Execute | None = None,
) -> list[R]:
    """Do the tasks of a study; return the records of those that are done, in the order of the tasks.

    Args:
        study: what is done with each.
        tasks: to be done.
        records: file to which each record is appended as it comes. What it holds already is not done again, so the same call
            goes on after a stop. None: nothing is written.
        jobs: processes; None: one a processor core, or 1 if the study is timed. With 1, the tasks are done in this process.
        seconds: after this time no more tasks are begun [s]; None: all are done.
        progress: called as tasks are done.
        watch: called with each task that is done and its record, at once; not with those that were recorded before.
        execute: does the tasks in place of the processes of this machine.

    Raises:
        SettingsError: jobs out of range, or two tasks of one name.
        FileFormatError: `records` is broken, of another study or version, or holds a task that is defined otherwise now.
        OutputError: `records` cannot be written, or another process is writing to it.
        SpacearmError: raised by a task; what was done before is recorded.
        RuntimeError: the process of a task died.
        KeyboardInterrupt: Ctrl-C; what was done before is recorded.
    """
    keys = [study.key(task) for task in tasks]
    if len(set(keys)) < len(keys):
        twice = Counter(keys).most_common(1)[0][0]
        raise SettingsError(f"study '{study.name}' has two tasks of the name '{twice}', expected one; change `key`")
    count = jobs_of(study, jobs)
    tell = progress or (lambda done, total, what: None)
    with contextlib.ExitStack() as stack:
        append = None if records is None else stack.enter_context(appending(records, study=study.name))
        found = {} if records is None else _recorded(study, tasks, records)
        todo = [task for task in tasks if study.key(task) not in found]
        if todo:
            tell(len(found), len(tasks), study.key(todo[0]))
        if execute is None:
            count = min(count, len(todo))
            execute = in_this_process if count <= 1 else partial(in_processes, jobs=count)
        outcomes = execute(study.run, todo if seconds is None else _begun_within(todo, seconds))
        stack.callback(getattr(outcomes, "close", lambda: None))  # ends the processes at once if anything is raised below
        for number, outcome in outcomes:
            task = todo[number]
            key, record = study.key(task), _record(study, task, outcome)
            found[key] = record
            if append is not None:
                append(key, study.definition(task), record)
            if watch is not None:
                watch(task, record)
            tell(len(found), len(tasks), study.key(todo[number + 1]) if number + 1 < len(todo) else key)
    return [found[key] for key in keys if key in found]


def _begun_within(tasks: Sequence[T], seconds: float) -> Iterator[T]:
    begun = time.perf_counter()
    for task in tasks:
        if time.perf_counter() - begun > seconds:
            return
        yield task


def jobs_of(study: Study[Any, Any], jobs: int | None) -> int:
    """Return how many processes a study uses if asked for `jobs`.

    Raises:
        SettingsError: fewer than one, or too many.
    """
    if jobs is None:
        return 1 if study.timed else os.cpu_count() or 1
    return whole("jobs", jobs, at_least=1, at_most=MOST_JOBS)


def _recorded(study: Study[T, R], tasks: Sequence[T], path: str | os.PathLike[str]) -> dict[str, R]:
    """Return the records of these tasks that the file holds already."""
    known = load_records(Path(path), study.record, study=study.name)
    found = {}
    for task in tasks:
        key = study.key(task)
        if key in known:
            require_same_definition(path, key, known[key].definition, study.definition(task))
            found[key] = known[key].record
    return found


def _record(study: Study[T, R], task: T, outcome: R | Lost) -> R:
    if not isinstance(outcome, Lost):
        return outcome
    if study.lost is None:
        raise RuntimeError(
            f"task '{study.key(task)}' of the study '{study.name}' gave no record: {outcome.why}; the records so far are kept, "
            "run the study again with jobs=1 to see more"
        )
    return study.lost(task, outcome.why)
