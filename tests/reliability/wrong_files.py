"""A wrong file is read: a result or one sentence, and soon."""

from __future__ import annotations

import signal
import traceback
import warnings
from pathlib import Path
from types import FrameType
from typing import NoReturn

import numpy as np

from reliability.mutations import mutated
from reliability.readers import Reader
from spacearm.errors import SpacearmError

SOON = 5.0  # [s]
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
    before = signal.signal(signal.SIGALRM, _over)
    signal.setitimer(signal.ITIMER_REAL, SOON)
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
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    return "read", ""


def _over(signum: int, frame: FrameType | None) -> NoReturn:
    raise TooLong
