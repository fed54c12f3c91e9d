"""How a study runs: the tasks that are not recorded yet are done, and each record is written down as it comes.

Tasks are done in processes, one task a process at a time. They can be interrupted, and nobody waits for a process that died.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

from spacearm.core.errors import SettingsError, SpacearmError
from spacearm.core.records import whole
from spacearm.study.study_records import appending, load_records, require_same_definition

T = TypeVar("T")
R = TypeVar("R")

MOST_JOBS = 1024
"""More processes cost memory and win nothing."""

Progress: TypeAlias = Callable[[int, int, str], Any]
"""Called with the tasks done, the tasks in all, and the name of the one that is next."""

Execute: TypeAlias = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[tuple[int, Any]]]
"""Does tasks: takes a function and its arguments, and yields the number of each argument with its result, in any order."""

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMEXPR_NUM_THREADS")
_POLL = 1.0  # how often hanging processes are looked for [s]
_READY = "ready"
_GUARD = 'a program that runs studies needs the line `if __name__ == "__main__":` before what it does'


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


# ---- processes --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost:
    """A task whose process ended or was ended.

    Attributes:
        why: in words.
    """

    why: str


@dataclass(frozen=True, slots=True, eq=False)
class _Worker:
    process: BaseProcess
    pipe: Connection


def in_this_process(run: Callable[[T], R], tasks: Iterable[T]) -> Iterator[tuple[int, R | Lost]]:
    """Do tasks one after the other; yield the number of each in the list, and its record."""
    for number, task in enumerate(tasks):
        yield number, run(task)


def in_processes(
    run: Callable[[T], R], tasks: Iterable[T], *, jobs: int, memory_gb: float | None = None, hang: float | None = None
) -> Iterator[tuple[int, R | Lost]]:
    """Do tasks in several processes; yield the number of each in the list, and its record, in the order in which they end.

    The processes are begun afresh, so a program that calls this needs the line ``if __name__ == "__main__":`` before what it
    does. Each uses one thread for linear algebra. Ctrl-C ends them all.

    Args:
        run: a function of a module, which the processes import.
        tasks: that can be pickled.
        jobs: processes.
        memory_gb: limit of the address space of each process [GB]; None: no limit.
        hang: a process that takes longer for a task is ended [s]; None: no limit.

    Raises:
        SpacearmError: raised by a task.
        RuntimeError: anything else that a task raised, with its traceback.
    """
    context = multiprocessing.get_context("spawn")

    def begin() -> _Worker:
        ours, theirs = context.Pipe()
        with _one_thread(), _no_interrupt():
            process = context.Process(target=_work, args=(theirs, run, memory_gb), daemon=True)
            process.start()
        theirs.close()
        return _Worker(process, ours)

    waiting = iter(enumerate(tasks))
    following = next(waiting, None)
    starting = [begin() for _ in range(jobs if following is not None else 0)]
    busy: dict[_Worker, tuple[int, float]] = {}  # at which task, and since when
    try:
        while busy or following is not None:
            ready = wait([worker.pipe for worker in (*starting, *busy)], timeout=_POLL)
            now = time.perf_counter()
            for worker, (number, since) in list(busy.items()):
                late = hang is not None and now - since > hang
                if worker.pipe not in ready and not late:
                    continue
                found = _heard(worker) if worker.pipe in ready else Lost(why=f"no answer within {hang:g} s")
                del busy[worker]
                if isinstance(found, Lost):
                    _end(worker)
                    starting.append(begin())
                else:
                    starting.append(worker)  # it says anew that it is ready
                yield number, found
            for worker in [worker for worker in starting if worker.pipe in ready]:
                if following is None:
                    break
                if isinstance(said := _heard(worker), Lost):
                    raise RuntimeError(f"a process could not be begun ({said.why}), expected it to import the study; {_GUARD}")
                number, task = following
                worker.pipe.send(task)
                starting.remove(worker)
                busy[worker] = (number, time.perf_counter())
                following = next(waiting, None)
    finally:
        for worker in (*starting, *busy):
            _end(worker)


def _end(worker: _Worker) -> None:
    worker.process.kill()
    worker.process.join()
    worker.pipe.close()


def _heard(worker: _Worker) -> Any:
    try:
        raised, found = worker.pipe.recv()
    except (EOFError, ConnectionResetError):
        worker.process.join(5)
        return Lost(why=f"the process ended with exit code {worker.process.exitcode}")
    if raised:
        raise found
    return found


def _work(pipe: Connection, run: Callable[[Any], Any], memory_gb: float | None) -> None:
    """Do the tasks that come through the pipe, until it is closed."""
    if memory_gb is not None:
        import resource

        most = int(memory_gb * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    try:
        while True:
            pipe.send((False, _READY))
            pipe.send(_done(run, pipe.recv()))
    except (EOFError, BrokenPipeError):
        return


def _done(run: Callable[[Any], Any], task: Any) -> tuple[bool, Any]:
    try:
        return False, run(task)
    except SpacearmError as error:
        return True, error
    except Exception:
        return True, RuntimeError(f"a task failed in its process:\n{traceback.format_exc()}")


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let processes that are begun meanwhile use one thread for linear algebra."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Keep Ctrl-C from processes that are begun meanwhile: the process that began them ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # of multiprocessing: were it begun below, it would let the signal through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
