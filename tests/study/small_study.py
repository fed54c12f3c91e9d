"""A study as small as can be, for the tests of how studies run."""

from __future__ import annotations

import math
import os
import time
from dataclasses import dataclass

import numpy as np

from spacearm.core.errors import ProblemError
from spacearm.study.run_study import Study


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """A number to be drawn."""

    number: int
    scale: float = 1.0
    does: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """What was drawn."""

    value: float
    parts: tuple[float, ...]
    word: str
    threads: str | None


def draw(task: Draw) -> Drawn:
    if task.does == "wrong":
        raise ProblemError("the problem cannot be")
    if task.does == "raise":
        raise ZeroDivisionError("nothing can be shared")
    if task.does == "die":
        os._exit(7)
    if task.does == "sleep":
        time.sleep(60)
    value = task.scale * float(np.random.default_rng((5, task.number)).normal())
    return Drawn(
        value=value,
        parts=(math.inf, -math.inf, 1 / 3),
        word=f"number {task.number}",
        threads=os.environ.get("OPENBLAS_NUM_THREADS"),
    )


DRAWING = Study(
    name="drawing",
    run=draw,
    record=Drawn,
    key=lambda task: f"draw {task.number}",
    definition=lambda task: {"scale": task.scale},
)


def tasks(count: int, **changes: Draw) -> list[Draw]:
    """Return so many draws; `draw_3=...` replaces one."""
    return [changes.get(f"draw_{number}", Draw(number=number)) for number in range(count)]
