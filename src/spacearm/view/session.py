"""The state that all browsers share: the problem, the plan that is made, the motion that is shown, and what is saved.

It knows nothing of browsers. Every method may be called from any thread; the last writer wins. Listeners are called after a
change, by the thread that made it and without the lock.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.errors import OutputError
from spacearm.core.records import whole
from spacearm.files.plan_file import plan_text
from spacearm.planner import Plan
from spacearm.view.edited_problem import EditedProblem, Source
from spacearm.view.nearest import Nearest, nearest
from spacearm.view.output_folder import OutputFolder
from spacearm.view.placements import Handle
from spacearm.view.plan_job import Candidate, PlanJob
from spacearm.view.reach import Pulled, Reachable, pulled, reachable
from spacearm.view.shown_motion import ShownMotion, motion_of_file, motion_of_plan

Array = NDArray[np.float64]
Change = Literal["problem", "job", "candidate", "motion", "saved"]

_MOST_SEED = 2**63 - 1


class Session:
    """A viewer's session.

    Args:
        source: what it begins with; the motion of a plan file is shown at once.
        folder: where files are saved.
        seed: random seed of the plans.
    """

    def __init__(self, source: Source, folder: OutputFolder, *, seed: int = 0) -> None:
        self._lock = threading.RLock()
        self._listeners: list[Callable[[Change], object]] = []
        self._edited = EditedProblem.of(source)
        self._motion = motion_of_file(self._edited)
        self._job: PlanJob | None = None
        self._seed = seed
        self.folder = folder
        self.saved: tuple[str, ...] = ()

    def listen(self, listener: Callable[[Change], object]) -> None:
        """Call a function after every change, with what has changed."""
        self._listeners.append(listener)

    # ---- What there is ------------------------------------------------------------------------------------------------

    @property
    def edited(self) -> EditedProblem:
        """The problem as it is now."""
        return self._edited

    @property
    def motion(self) -> ShownMotion | None:
        """The motion that is shown; None if there is none."""
        return self._motion

    @property
    def job(self) -> PlanJob | None:
        """The plan that is being made, or the last one."""
        return self._job

    @property
    def seed(self) -> int:
        """The random seed of the next plan."""
        return self._seed

    @property
    def is_planning(self) -> bool:
        """Whether a plan is being made."""
        job = self._job
        return job is not None and job.running

    @property
    def outdated(self) -> bool:
        """Whether the problem was changed since the motion was made: then nothing is proven of what is shown."""
        with self._lock:
            return self._motion is not None and self._motion.edited.revision != self._edited.revision

    def candidates(self) -> Sequence[Candidate]:
        """Return the motions that the plan being made has found so far."""
        job = self._job
        return () if job is None else tuple(job.candidates)

    def nearest(self) -> Nearest | None:
        """Return the nearest pair at the start."""
        problem = self._edited.problem
        return nearest(problem, problem.start, problem.base_start)

    def reachable(self) -> Reachable:
        """Return whether the goal can be reached; takes as long as the first step of planning."""
        edited = self._edited
        return reachable(edited.problem, edited.settings)

    # ---- Changes ------------------------------------------------------------------------------------------------------

    def _change(self, change: Callable[[EditedProblem], EditedProblem]) -> None:
        with self._lock:
            self._edited = change(self._edited)
        self._told("problem")

    def set_start(self, q: ArrayLike) -> None:
        """Let the arm start at q (n,) [rad or m], set onto the limits.

        Raises:
            ProblemError: it does not fit the robot.
        """
        self._change(lambda edited: edited.with_start(q))

    def set_start_joint(self, dof: int, value: float) -> None:
        """Let one joint start elsewhere [rad or m]; the others stay exactly where they are.

        Raises:
            ProblemError: no finite number.
        """

        def changed(edited: EditedProblem) -> EditedProblem:
            q = np.array(edited.problem.start)
            q[dof] = value
            return edited.with_start(q)

        self._change(changed)

    def pull_tip(self, handle: Handle, *, turned: bool = True) -> Pulled:
        """Let the arm start where its tip is pulled to, as near as it gets, and return how near that is."""
        with self._lock:
            problem = self._edited.problem
            found = pulled(problem, problem.start, handle.position, handle.wxyz, turned=turned)
            self._edited = self._edited.with_start(found.q)
        self._told("problem")
        return found

    def set_goal_position(self, position: ArrayLike) -> None:
        """Put the goal's frame elsewhere, (3,) in the inertial frame [m].

        Raises:
            ProblemError: the goal is in joint space, or no point.
        """
        self._change(lambda edited: edited.with_goal_position(position))

    def set_goal_pose(self, position: ArrayLike, wxyz: ArrayLike) -> None:
        """Put the goal's frame at a position (3,) [m], in an orientation (4,), inertial frame.

        Raises:
            ProblemError: the goal is no pose, or the numbers make none.
        """
        self._change(lambda edited: edited.with_goal_pose(position, wxyz))

    def set_goal_joint(self, dof: int, value: float) -> None:
        """Let one joint end elsewhere [rad or m].

        Raises:
            ProblemError: the goal is not one configuration.
        """

        def changed(edited: EditedProblem) -> EditedProblem:
            q = np.array(getattr(edited.problem.goal, "q", edited.problem.start), dtype=np.float64)
            if q.ndim == 1:
                q[dof] = value
            return edited.with_goal_configuration(q)

        self._change(changed)

    def move_obstacle(self, index: int, handle: Handle) -> None:
        """Move an obstacle by its handle.

        Raises:
            ProblemError: there is no such obstacle, or it cannot be moved.
        """
        self._change(lambda edited: edited.with_obstacle(index, handle))

    def set_clearance(self, clearance: float) -> None:
        """Ask for another clearance [m].

        Raises:
            ProblemError: below 0.
        """
        self._change(lambda edited: edited.with_clearance(clearance))

    def set_budget(self, evaluations: int | None, seconds: float | None) -> None:
        """Give the search another budget: evaluations and time [s]; None: no limit, or the usual one.

        Raises:
            SettingsError: out of range.
        """
        self._change(lambda edited: edited.with_budget(evaluations, seconds))

    def set_seed(self, seed: int) -> None:
        """Give the next plan another random seed.

        Raises:
            SettingsError: out of range.
        """
        self._seed = whole("seed", seed, at_least=0, at_most=_MOST_SEED)
        self._told("job")

    def undo_changes(self) -> None:
        """Go back to what the file has."""
        with self._lock:
            first = EditedProblem.of(self._edited.source)
            self._edited = replace(first, revision=self._edited.revision + 1)
        self._told("problem")

    # ---- Planning -----------------------------------------------------------------------------------------------------

    def plan(self) -> bool:
        """Begin to plan, and return whether that began: no second plan begins while one is being made."""
        with self._lock:
            if self.is_planning:
                return False
            job = self._job = PlanJob(self._edited, self._seed, self._job_told)
        job.start()
        self._told("job")
        return True

    def cancel(self) -> None:
        """Ask the plan that is being made to end with the best motion that it has."""
        job = self._job
        if job is not None and job.running:
            job.cancel()
            self._told("job")

    def close(self) -> None:
        """End the plan that is being made, and wait a little for that."""
        job = self._job
        if job is not None and job.running:
            job.cancel()
            job.wait(2.0)

    def _job_told(self, job: PlanJob) -> None:
        if job is not self._job:
            return
        if job.running:
            self._told("candidate")
            return
        motion = None if job.plan is None else motion_of_plan(job.edited, job.plan)
        with self._lock:
            self._motion = self._motion if motion is None else motion
        if motion is not None:
            self._told("motion")
        self._told("job")

    # ---- Saving -------------------------------------------------------------------------------------------------------

    def save_problem(self, name: str) -> Path:
        """Write the problem as it is now to a new YAML file in the folder; return its path.

        Raises:
            OutputError: a name that is none, a file that is there, or a problem that YAML cannot tell exactly.
        """
        edited = self._edited
        self.folder.new_file(name, ".yaml")
        return self._saved(self.folder.write(name, ".yaml", edited.as_text(self.folder.path)))

    def save_plan(self, name: str) -> Path:
        """Write the plan that is shown to a new JSON file in the folder; return its path.

        Raises:
            OutputError: there is no plan of this session, a name that is none, or a file that is there.
        """
        return self._saved(self.folder.write(name, ".json", plan_text(self._plan_shown())))

    def save_report(self, name: str) -> Path:
        """Write a report on the motion that is shown to a new HTML file in the folder; return its path.

        Raises:
            OutputError: there is no motion, a name that is none, or a file that is there.
        """
        from spacearm.report.report_page import page_html
        from spacearm.report.report_plan import report_of_plans

        motion = self._motion
        plan = motion.edited.source.plan if motion is not None and motion.plan is None else self._plan_shown()
        self.folder.new_file(name, ".html")
        return self._saved(self.folder.write(name, ".html", page_html(report_of_plans([plan]))))

    def _plan_shown(self) -> Plan:
        motion = self._motion
        if motion is None or motion.plan is None:
            raise OutputError("there is no plan to be saved yet, expected one; press Plan first")
        return motion.plan

    def _saved(self, path: Path) -> Path:
        with self._lock:
            self.saved = (*self.saved, path.name)
        self._told("saved")
        return path

    def _told(self, change: Change) -> None:
        for listener in list(self._listeners):
            listener(change)
