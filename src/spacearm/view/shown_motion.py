"""The motion that is shown: from a plan or from a plan file, where robot and base are at each time, and what is known of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import AnyTrajectory
from spacearm.motion.trajectory import base_frames
from spacearm.planner import Plan
from spacearm.view.edited_problem import EditedProblem
from spacearm.view.nearest import Nearest, Tone, nearest

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShownMotion:
    """A motion in time, and the problem that it was made for.

    Attributes:
        edited: the problem as it was then.
        trajectory: the motion.
        plan: that found it; None: it is from a file.
        status: as plans have it: "found", "not_proven", ...
        headline: the verdict in a few words.
        message: in full.
        tone: "good" if it is proven; "near" if a file says so; else "bad".
    """

    edited: EditedProblem
    trajectory: AnyTrajectory
    plan: Plan | None
    status: str
    headline: str
    message: str
    tone: Tone

    @property
    def duration(self) -> float:
        """Its duration [s]."""
        return float(self.trajectory.duration)

    @property
    def times(self) -> Array:
        """Times (k,) at which it is looked at for curves [s]: 161 alike."""
        return np.linspace(0.0, self.duration, 161)

    def at(self, t: float) -> tuple[Array, Array]:
        """Return the joints' positions (n,) [rad or m], and where the base is, T_w_b (4, 4) [m], at a time [s]."""
        time = min(max(float(t), 0.0), self.duration)
        return np.asarray(self.trajectory.sample(time).q, dtype=np.float64), self.base_at(time)

    def base_at(self, t: float) -> Array:
        """Return where the base is at a time, T_w_b (4, 4) [m]."""
        if not self.trajectory.base_model.follows_arm:
            return self.edited.problem.base_start
        return base_frames(self.trajectory, t)

    def tip_path(self) -> Array:
        """Return the path of the end effector, (k, 3) in the inertial frame [m]."""
        return np.asarray(self.trajectory.tip(self.times)[:, :3, 3])

    def base_path(self) -> Array:
        """Return the path of the base's origin, (k, 3) [m]; empty for a base that does not move."""
        if not self.trajectory.base_model.follows_arm:
            return np.zeros((0, 3))
        return np.asarray(self.trajectory.base_pose(self.times)[0])

    def nearest_at(self, t: float, edited: EditedProblem | None = None) -> Nearest | None:
        """Return the nearest pair at a time [s], among the obstacles as they are now, if that is given."""
        q, T_w_b = self.at(t)
        return nearest((edited or self.edited).problem, q, T_w_b)

    def clearances(self) -> Array:
        """Return the least clearance at `times` (k,) [m], measured; infinite where nothing is in the way."""
        found = [self.nearest_at(t) for t in self.times]
        return np.array([np.inf if one is None else one.clearance for one in found])


def motion_of_plan(edited: EditedProblem, plan: Plan) -> ShownMotion | None:
    """Return the motion of a plan, proven or not; None if it has none."""
    if plan.trajectory is None:
        return None
    least = None if plan.certificate is None else plan.certificate.clearance
    if plan.found:
        headline = (
            "Proven" if least is None or not np.isfinite(least) else f"Proven: at least {least * 1e3:.4g} mm clear for all t"
        )
    else:
        headline = "Not proven" if plan.status == "not_proven" else "No motion found: this is the one that lacks least"
    return ShownMotion(
        edited=edited,
        trajectory=plan.trajectory,
        plan=plan,
        status=plan.status,
        headline=headline,
        message=plan.message,
        tone="good" if plan.found else "bad",
    )


def motion_of_file(edited: EditedProblem) -> ShownMotion | None:
    """Return the motion of the plan file that a problem came from; None if it came from a problem file.

    What the file says of a proof is not believed: it is told as what the file says.
    """
    saved = edited.source.plan
    if saved is None:
        return None
    said = "" if saved.certificate is None else str(saved.certificate.get("status", ""))
    edited_since = saved.edits
    holds = saved.status == "found" and said == "holds" and not edited_since
    return ShownMotion(
        edited=edited,
        trajectory=saved.trajectory,
        plan=None,
        status=saved.status,
        headline="From a file, which says that it is proven"
        if holds
        else "From a file that was edited: not proven"
        if edited_since
        else f"From a file, which says: {saved.status}",
        message="; ".join(
            [*edited_since, "The file's proof is not checked here: `spacearm certify` does that, or plan again."]
        ),
        tone="near" if holds else "bad",
    )
