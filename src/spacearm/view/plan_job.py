"""One plan at a time, in a thread of its own: what it is doing, its best motion so far, and an end on request."""

from __future__ import annotations

import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from spacearm.core.errors import SpacearmError
from spacearm.motion import Motion
from spacearm.planner import Plan, plan
from spacearm.planner.plan_result import SearchState
from spacearm.view.edited_problem import EditedProblem

State = Literal["running", "done", "cancelled", "failed"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidate:
    """A motion that a search has found so far; it is not proven.

    Attributes:
        motion: the path of the joints.
        fitness: less is better.
        seconds: since the job began.
    """

    motion: Motion
    fitness: float
    seconds: float


class PlanJob:
    """A plan of a problem as it was when the job began.

    Args:
        edited: the problem.
        seed: random seed.
        tell: called from the job's thread when something is new, with the job; never after the job was abandoned.
    """

    def __init__(self, edited: EditedProblem, seed: int, tell: Callable[[PlanJob], object]) -> None:
        self.edited, self.seed = edited, seed
        self.state: State = "running"
        self.stage = "begins"
        self.message = ""
        self.plan: Plan | None = None
        self.candidates: list[Candidate] = []
        self.evaluations = 0
        self._tell, self._begun = tell, time.monotonic()
        self._cancelled, self._raised = threading.Event(), False
        self._thread = threading.Thread(target=self._run, name="spacearm-plan", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def cancel(self) -> None:
        """Ask it to end with the best motion that it has; a proof that is under way is finished first."""
        self._cancelled.set()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended, and return whether it has."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    @property
    def running(self) -> bool:
        """Whether it goes on."""
        return self.state == "running"

    @property
    def ending(self) -> bool:
        """Whether it was asked to end, and has not yet."""
        return self.running and self._cancelled.is_set()

    @property
    def seconds(self) -> float:
        """The time since it began [s]."""
        return time.monotonic() - self._begun

    def _run(self) -> None:
        try:
            self.plan = plan(
                self.edited.problem, self.edited.settings, rng=self.seed, progress=self._at_stage, watch=self._found
            )
            self.message = self.plan.message
            state: State = "cancelled" if self.plan.interrupted and not self.plan.found else "done"
        except KeyboardInterrupt:
            state, self.message = "cancelled", "it was cancelled before there was a motion"
        except SpacearmError as error:
            state, self.message = "failed", str(error)
        except Exception:
            traceback.print_exc(file=sys.stderr)
            state, self.message = "failed", "an error of spacearm itself; the terminal has it: please report it"
        self.state = state
        self._tell(self)

    def _at_stage(self, stage: str) -> None:
        self.stage = stage
        self._tell(self)
        self._end_if_asked()

    def _found(self, found: SearchState) -> None:
        self.evaluations = max(self.evaluations, found.evaluations)
        motion = found.motion
        if motion is not None and (not self.candidates or self.candidates[-1].motion is not motion):
            self.candidates.append(Candidate(motion=motion, fitness=found.fitness, seconds=self.seconds))
            self._tell(self)
        self._end_if_asked()

    def _end_if_asked(self) -> None:
        if self._cancelled.is_set() and not self._raised:
            self._raised = True  # once: what follows is the proof of what there is
            raise KeyboardInterrupt
