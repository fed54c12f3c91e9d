"""How much tracking error a trajectory survives: the widest tube around it for which its certificate still holds.

The tube is found by bisection on the certificate. So the tube that is returned is proven, and a tube that is wider by the
resolution is not; its certificate says what is in the way. All revolute joints have the same tracking error in rad; a prismatic
joint has as many metres as they have radians.

A certificate with a tracking error lets a pair of bodies have less than is required at the start and the goal, if it has no
more within the tube. Here that is only for pairs that have less on the planned trajectory: all others keep what is required
of them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief, Rows, counted, named, words
from spacearm.core.checks import as_number, is_a_row, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.core.notebook_hook import InNotebooks
from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory
from spacearm.proof.certificate import Certificate, Limit
from spacearm.proof.certify import LIMITS, HasScene, certify
from spacearm.proof.tracking import ALL, require_bounded, tracking_in_words
from spacearm.robot import Robot

Array = NDArray[np.float64]

RESOLUTION = 0.01
"""Relative: a tube that is wider by this share is not proven."""

WIDEST = 3.0
"""[rad or m] A wider tube is not looked for."""

_BEGIN = 1e-3  # [rad or m] the first tube
_LEAST = 1e-9  # [rad or m] if not even this tube is proven, there is none
_FINEST = 1e-6  # of `resolution`, at least: the bisection ends

Progress = Callable[[int, int, str], object]
"""Called with the tubes that are known, the tubes in all, and the one that is looked for."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Tube(Brief):
    """The widest tube that is proven for some joints, while all other joints are exact.

    Attributes:
        joints: their names; those of all degrees of freedom, or one.
        tracking: every trajectory that stays within this of the planned one is proven [rad; m for a prismatic joint].
        not_proven: a tracking error that is not proven any more, larger by the resolution at most [rad or m]; infinite if
            there is none up to 3; 0 if not even the trajectory itself is proven.
        limited_by: what is in the way of a wider tube, in a sentence; "" if nothing is.
        link, other, time: if it is a pair of bodies: the robot's link, the other body, as in "obstacle 'shelf'", and the
            instant [s]; None if it is a joint's limit, or nothing.
    """

    joints: tuple[str, ...]
    tracking: float
    not_proven: float
    limited_by: str
    link: str | None = None
    other: str | None = None
    time: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Robustness(Brief, InNotebooks):
    """How much tracking error a trajectory survives.

    Attributes:
        together: the widest tube of all joints that were asked for.
        singly: the widest tube of each of them, while all others are exact.
        certificate: of the trajectory with the tube `together`; if it does not hold, the trajectory is not even proven without
            a tracking error, and there is no tube.
        resolution: relative, of all tubes.
        certificates: how many were tried.
        seconds: that it took.
    """

    together: Tube
    singly: tuple[Tube, ...]
    certificate: Certificate = field(repr=False)
    resolution: float
    certificates: int
    seconds: float

    def _in_short(self) -> tuple[str, Rows]:
        rows = [("result", self.message)]
        alone = [f"{words(tube.joints[0], 24)} {tube.tracking:.4g}" for tube in self.singly]
        rows += [("alone", f"{', '.join(alone)} [rad, m for a prismatic joint]")] if alone else []
        took = f"{counted(self.certificates, 'certificate')}, {self.seconds:.3g} s"
        rows.append(("took", f"{took}; tubes to {self.resolution:.3g} of their size"))
        return f"Robustness: robot {named(self.certificate.robot.name)}, {self.tracking:.4g} for all joints together", rows

    @property
    def tracking(self) -> float:
        """The tracking error that is proven for all joints together [rad; m for prismatic joints]."""
        return self.together.tracking

    @property
    def message(self) -> str:
        """The result in a sentence."""
        robot, tube = self.certificate.robot, self.together
        if not self.certificate.holds:
            return f"not proven even without a tracking error: {tube.limited_by}"
        whose = "every joint" if len(tube.joints) == robot.dof else _listed(tube.joints)
        said = tracking_in_words(robot, np.full(robot.dof, tube.tracking)) if len(tube.joints) == robot.dof else None
        said = said or f"{tube.tracking:.4g} {_unit(robot, tube.joints)}"
        least = "proven" if tube.limited_by else "proven, and no wider one was looked for"
        limit = f"; a wider tube is limited by {tube.limited_by}" if tube.limited_by else ""
        return f"{least} for every trajectory within {said} of {whose}{limit}"

    def as_dict(self) -> dict[str, object]:
        """Return plain values, None for what is infinite."""
        return {
            "together": _tube_as_dict(self.together),
            "singly": [_tube_as_dict(tube) for tube in self.singly],
            "resolution": self.resolution,
            "certificates": self.certificates,
            "certificate": self.certificate.as_dict(),
        }


def robustness(
    planned: Any,
    trajectory: AnyTrajectory | None = None,
    *,
    joints: str | Iterable[str] = ALL,
    singly: bool = True,
    resolution: float = RESOLUTION,
    limits: Sequence[Limit] = LIMITS,
    progress: Progress | None = None,
) -> Robustness:
    """Find the widest tube around a trajectory for which its certificate holds.

    Every tube that is returned is proven by `certify(..., tracking=...)`. Joints that are not asked for are exact. Pairs of
    bodies that have what is required of them at the start and the goal of the trajectory itself keep it within the tube too.

    Args:
        planned: a plan; or a problem, with the trajectory beside it.
        trajectory: of that problem; None: the plan's.
        joints: "all", or the names of one or several joints: they have the same tracking error, and all others have none.
        singly: also find the tube of each of these joints alone.
        resolution: relative: a tube wider by this share is not proven, 1e-6 up to 1.
        limits: as `certify` has them; within the tube only those of position are looked at.
        progress: called with the number of tubes that are known, and of all.

    Raises:
        ProblemError: no plan and no problem; a plan without a motion; an unknown joint; a base that moves with the arm.
    """
    begun = time.perf_counter()
    problem, motion = _planned(planned, trajectory)
    robot = problem.robot
    names = _joints(robot, joints)
    finest = as_number("resolution", resolution, ProblemError, at_least=_FINEST, at_most=1.0)
    exact = certify(problem, motion, limits=limits)
    require_bounded(exact.base_setup.model, np.ones(robot.dof))
    if not exact.holds:
        none = Tube(joints=names, tracking=0.0, not_proven=0.0, limited_by=exact.message)
        return _found(begun, none, (), exact, finest, tried=1)
    position: list[Limit] = ["position"] if "position" in limits else []
    search = _Bisection(problem, motion, resolution=finest, limits=position, near=_near(exact))
    wanted = [names, *((name,) for name in names if singly and len(names) > 1)]
    tubes: list[Tube] = []
    for done, some in enumerate(wanted):
        if progress is not None:
            progress(done, len(wanted), "all joints together" if done == 0 else f"joint '{some[0]}'")
        tubes.append(search.widest(some))
    if progress is not None:
        progress(len(wanted), len(wanted), "")
    certificate = certify(problem, motion, limits=limits, tracking=dict.fromkeys(names, tubes[0].tracking))
    alone = tuple(tubes[1:]) if len(names) > 1 else (tubes[0],)
    return _found(begun, tubes[0], alone, certificate, finest, tried=search.tried + 2)


def _found(
    begun: float, together: Tube, singly: tuple[Tube, ...], certificate: Certificate, resolution: float, *, tried: int
) -> Robustness:
    return Robustness(
        together=together,
        singly=singly,
        certificate=certificate,
        resolution=resolution,
        certificates=tried,
        seconds=time.perf_counter() - begun,
    )


class _Bisection:
    """Looks for the widest tubes of some joints of a trajectory."""

    def __init__(
        self,
        problem: HasScene,
        trajectory: AnyTrajectory,
        *,
        resolution: float,
        limits: Sequence[Limit],
        near: frozenset[tuple[str, str]],
    ) -> None:
        self.tried = 0
        self._problem, self._trajectory = problem, trajectory
        self._resolution, self._limits, self._near = resolution, limits, near
        self._digits = 2 + math.ceil(-math.log10(resolution))  # of what is tried

    def widest(self, joints: tuple[str, ...]) -> Tube:
        """Return the widest tube of some joints."""
        proven, refused = 0.0, math.inf
        failed: Certificate | None = None
        tried = _BEGIN
        while refused > proven * (1 + self._resolution) and _LEAST <= tried <= WIDEST:
            certificate = self._certificate(joints, tried)
            if certificate.holds and _near(certificate) <= self._near:
                proven = tried
            else:
                refused, failed = tried, certificate
            tried = float(f"{_between(proven, refused):.{self._digits}g}")
            if tried in (proven, refused):
                break
        if failed is None:
            return Tube(joints=joints, tracking=proven, not_proven=math.inf, limited_by="")
        return _limited(joints, proven, refused, failed, self._near)

    def _certificate(self, joints: tuple[str, ...], error: float) -> Certificate:
        self.tried += 1
        return certify(self._problem, self._trajectory, limits=self._limits, tracking=dict.fromkeys(joints, error))


def _between(proven: float, refused: float) -> float:
    """Return the next tracking error to be tried: twice what is proven, a quarter of what is not, or their geometric mean."""
    if math.isinf(refused):
        return min(2 * proven, WIDEST) if proven < WIDEST else math.inf
    return math.sqrt(proven * refused) if proven > 0 else refused / 4


def _near(certificate: Certificate) -> frozenset[tuple[str, str]]:
    """Return the pairs of bodies that begin or end nearer than is required of them."""
    return frozenset((pair.link, pair.other) for pair in certificate.near_pairs)


def _limited(
    joints: tuple[str, ...], proven: float, refused: float, failed: Certificate, known: frozenset[tuple[str, str]]
) -> Tube:
    """Return a tube with what is in the way of a wider one, by the certificate of that.

    Args:
        joints, proven, refused: of the tube.
        failed: the certificate of a wider one.
        known: pairs that begin or end nearer than is required of them on the planned trajectory.
    """
    for pair in failed.near_pairs if failed.holds else ():
        if (pair.link, pair.other) not in known:
            end = "the goal" if pair.ends == "goal" else "the start"
            return Tube(
                joints=joints,
                tracking=proven,
                not_proven=refused,
                limited_by=f"link '{pair.link}' and {pair.other}, of which {pair.required * 1e3:.4g} mm are required at {end}",
                link=pair.link,
                other=pair.other,
                time=pair.end if pair.ends == "goal" else pair.begin,
            )
    near = failed.closest
    if failed.broken_limits or failed.clear or near is None:
        why = failed.broken_limits[0] if failed.broken_limits else failed.message
        return Tube(joints=joints, tracking=proven, not_proven=refused, limited_by=why)
    return Tube(
        joints=joints,
        tracking=proven,
        not_proven=refused,
        limited_by=f"link '{near.link}' and {near.other} at t = {near.time:.4g} s ({near.clearance * 1e3:.4g} mm apart)",
        link=near.link,
        other=near.other,
        time=near.time,
    )


# ---- What is given, and what is said ---------------------------------------------------------------------------------


def _planned(planned: Any, trajectory: AnyTrajectory | None) -> tuple[HasScene, AnyTrajectory]:
    """Return the problem and the trajectory that are meant.

    Raises:
        ProblemError: there is none.
    """
    if trajectory is not None:
        if not (isinstance(getattr(planned, "robot", None), Robot) and isinstance(getattr(planned, "scene", None), Scene)):
            raise ProblemError(f"problem is {shown(planned)}, expected a Problem, or what else has a robot and a scene")
        return planned, trajectory
    if not (hasattr(planned, "problem") and hasattr(planned, "trajectory")):
        raise ProblemError(
            f"planned is {shown(planned)}, expected a plan, or a problem and a trajectory: robustness(problem, trajectory)"
        )
    if planned.trajectory is None:
        raise ProblemError(f"the plan has no motion (status {shown(getattr(planned, 'status', None))}), expected one that has")
    return planned.problem, planned.trajectory


def _joints(robot: Robot, given: str | Iterable[str]) -> tuple[str, ...]:
    """Return the names of joints that are asked for, in the robot's order.

    Raises:
        ProblemError: none, or an unknown one.
    """
    if isinstance(given, str):
        given = robot.dof_names if given == ALL and ALL not in robot.dof_names else (given,)
    if not is_a_row(given):
        raise ProblemError(f"joints is {shown(given)}, expected 'all', or names of joints")
    names = tuple(given)
    for name in names:
        if name not in robot.dof_names:
            known = nearest(str(name), (ALL, *robot.dof_names))
            raise ProblemError(f"joints names {shown(name)}, which is no joint of robot '{robot.name}'; {known}")
    if not names:
        raise ProblemError("joints is empty, expected 'all', or names of joints")
    return tuple(name for name in robot.dof_names if name in names)


def _listed(names: tuple[str, ...]) -> str:
    quoted = [f"'{name}'" for name in names]
    return f"joint {quoted[0]}" if len(quoted) == 1 else f"the joints {', '.join(quoted)}"


def _unit(robot: Robot, names: tuple[str, ...]) -> str:
    kinds = {robot.is_prismatic(robot.dof_names.index(name)) for name in names}
    return "rad or m" if len(kinds) > 1 else "m" if kinds == {True} else "rad"


def _tube_as_dict(tube: Tube) -> dict[str, object]:
    return {
        "joints": list(tube.joints),
        "tracking": tube.tracking,
        "not_proven": tube.not_proven if math.isfinite(tube.not_proven) else None,
        "limited_by": tube.limited_by or None,
        "link": tube.link,
        "other": tube.other,
        "time_s": tube.time,
    }
