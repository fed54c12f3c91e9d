"""Processes that do tasks: one task a process at a time, interruptible, and nobody waits for a process that died."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from spacearm.core.errors import SpacearmError

T = TypeVar("T")
R = TypeVar("R")

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMEXPR_NUM_THREADS")
_POLL = 1.0  # how often hanging processes are looked for [s]
_READY = "ready"
_GUARD = 'a program that runs studies needs the line `if __name__ == "__main__":` before what it does'


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
