"""A wrong file is read: a result or one sentence, and soon."""

from __future__ import annotations

import signal
import traceback
import warnings
from pathlib import Path
from types import FrameType
from typing import NoReturn

import numpy as np

from spacearm.core.errors import SpacearmError
from support.file_readers import Reader
from support.mutations import mutated

SOON = 5.0  # [s] of the processor's time, for a machine may be busy
AT_LAST = 60.0  # [s] by the clock
LONGEST = 1500  # characters of a sentence


class TooLong(BaseException):
    """The time is over; no `except Exception` on the way takes it."""


def wrong_file(reader: Reader, number: tuple[int, ...]) -> bytes:
    """Draw a file."""
    rng = np.random.default_rng(number)
    return mutated(reader.texts[int(rng.integers(len(reader.texts)))], rng)


def finding(reader: Reader, path: Path, data: bytes) -> tuple[str, str]:
    """Read a file; return "read", "refused" or what went wrong, and in the last case the details."""
    path.write_bytes(data)
    before = [signal.signal(which, _over) for which in _SIGNALS]
    _alarm(SOON, AT_LAST)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            reader.read(path)
    except SpacearmError as error:
        said = str(error)
        if not said or len(said.splitlines()) != 1 or len(said) > LONGEST or not said.isprintable():
            return "no sentence", repr(said)[:2000]
        return "refused", said
    except TooLong:
        return "hangs", traceback.format_exc(limit=-6)
    except Warning as warning:
        return "warns", f"{type(warning).__name__}: {warning}\n{traceback.format_exc(limit=-6)}"
    except MemoryError:
        return "memory", traceback.format_exc(limit=-6)
    except Exception as error:
        return f"raises {type(error).__name__}", traceback.format_exc(limit=-6)
    finally:
        _alarm(0, 0)
        for which, handler in zip(_SIGNALS, before, strict=True):
            signal.signal(which, handler)
    return "read", ""


_SIGNALS = (signal.SIGPROF, signal.SIGALRM)


def _alarm(processor: float, clock: float) -> None:
    signal.setitimer(signal.ITIMER_PROF, processor)
    signal.setitimer(signal.ITIMER_REAL, clock)


def _over(signum: int, frame: FrameType | None) -> NoReturn:
    raise TooLong
