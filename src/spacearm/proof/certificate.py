"""What a proof says."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Scene
from spacearm.geometry.scene import scene_as_list
from spacearm.motion import AnyTrajectory, LimitMargins
from spacearm.motion.trajectory_values import trajectory_as_dict
from spacearm.proof.base_setup import LOST, BaseFindings, BaseSetup
from spacearm.robot import Robot
from spacearm.robot.model import robot_as_dict
from spacearm.robot.unchecked_pairs import REASONS, UncheckedPair, lacks_envelope, words_on_unchecked

# ---- Hashes that tell whether two problems, or two trajectories, are the same ----------------------------------------

_PROVENANCE = ("source", "notes", "apart", "unchecked", "collision", "solid", "unweighed")
"""What a robot tells of where it is from, and of what follows from the rest: it is no part of what a hash is about."""


def digest(values: Any) -> str:
    """Return the SHA-256 of plain values, in hexadecimal; the order of keys does not matter.

    Every hash in our files is this one. A number counts with all its digits, as JSON writes it.
    """
    return hashlib.sha256(json.dumps(values, sort_keys=True, allow_nan=False).encode()).hexdigest()


def canonical(robot: Robot, scene: Scene) -> dict[str, Any]:
    """Return a robot and a scene as the plain values that every hash is made of.

    Left out are notes, where the robot was read from, and how its file says that its base is held: the problem says that.
    """
    values = robot_as_dict(robot)
    for key in ("base", *_PROVENANCE):
        values.pop(key, None)
    return {"robot": values, "obstacles": scene_as_list(scene, notes=False)}


def problem_digest(robot: Robot, scene: Scene, setup: BaseSetup) -> str:
    """Return the SHA-256 of what a certificate is about: a robot, a scene and a base; start and goal do not matter.

    The hash of a whole problem, `planner.files.plans.problem_hash`, is of the same values and of start, goal and what is asked
    of the base. A base that is fixed at the origin adds nothing here, so that certificates from before bases could float keep
    their hashes.
    """
    held: dict[str, Any] = {}
    if setup.base != "fixed" or not setup.at_origin:
        held = {"base": setup.base, "base_start": setup.start.tolist()}
    if setup.drifting:
        held["momentum"] = [setup.linear.tolist(), setup.angular.tolist()]
    return digest({**canonical(robot, scene), **held})


def trajectory_digest(trajectory: AnyTrajectory) -> str:
    """Return the SHA-256 of a trajectory's path and time law."""
    values = trajectory_as_dict(trajectory)
    for provenance in ("notes", "joints"):
        values.pop(provenance, None)
    return digest(values)


# ---- What a proof says -----------------------------------------------------------------------------------------------

Limit = Literal["position", "velocity", "acceleration", "jerk"]

CERTIFICATE_KEY = "spacearm-certificate"
CERTIFICATE_VERSION = 1
"""Of the format of `Certificate.as_dict`; certificates from before it was written are of version 1, too."""

_DIGITS = 9  # of what is measured, where it is recorded
_TOLD = 1e-9  # [rad] a smaller error of the attitude is recorded as this: it depends on the processor's rounding
_NOISE = 1e-12  # a smaller share of the momentum, likewise
_TELLS = 1e-7  # [rad] less is of no account

ROUNDING = 1e-12
"""[rad or m] this far beyond a position limit is rounding."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosestApproach:
    """The least clearance measured.

    Attributes:
        link: name of the robot's link.
        other: what it is closest to, as in "obstacle 'shelf'", "obstacle 3" or "link 'forearm'".
        obstacle: index in the scene of the obstacle; None if it is a link.
        time: when [s].
        u: where on the trajectory's curve.
        clearance: [m]; negative is penetration.
        points: (2, 3) the nearest points of the two, or those that penetrate deepest, in the inertial frame [m]: the scene's.
    """

    link: str
    other: str
    obstacle: int | None
    time: float
    u: float
    clearance: float
    points: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certificate:
    """Whether a trajectory is free of collision and within the limits, of joints and of a floating base, at every instant.

    Attributes:
        status: "holds", "fails" (a collision or a broken limit was found), or "undecided" (the arm comes too close to be
            told from contact at the stated resolution, or it is not known well enough where the base turns to).
        clear: whether all of it is proven but for limits and what the trajectory tells of its base.
        clearance: proven: the clearance is at least this for all t [m]; None unless it holds; infinite without obstacles.
            Of obstacles and `robot.self_pairs`; of pairs that cannot meet (`robot.apart`) it is only proven that they do not.
        minimum_clearance: more than this was asked for [m], of the same.
        closest: the least clearance measured at an instant, of the same; None without obstacles or links. Where the pairs that
            cannot meet are why it does not hold, theirs.
        limits: margins of the joint limits, for all t.
        checked: the limits that were asked for: "position", "velocity", "acceleration", "jerk".
        resolution: the shortest interval looked at, as a share of the curve, all its pieces counting alike.
        evaluations: configurations looked at.
        seconds: it took.
        witness: whose kinematics and distances were used.
        robot, scene, trajectory: what it is about.
        base_setup: how the base was taken to be held, from where, and with which momentum.
        base_findings: what was found about a base that is moved; None if it is fixed, or nobody knows where it goes.
        unchecked: the pairs of links that are not part of the claim, each with the reason.
        bare: links without an envelope: nothing is claimed of them.
        notes: what else is to be known, a sentence each.
    """

    status: Literal["holds", "fails", "undecided"]
    clear: bool
    clearance: float | None
    minimum_clearance: float
    closest: ClosestApproach | None
    limits: LimitMargins
    checked: tuple[Limit, ...]
    resolution: float
    evaluations: int
    seconds: float
    witness: str
    robot: Robot = field(repr=False)
    scene: Scene = field(repr=False)
    trajectory: AnyTrajectory = field(repr=False)
    base_setup: BaseSetup = field(repr=False)
    base_findings: BaseFindings | None = None
    unchecked: tuple[UncheckedPair, ...] = ()
    bare: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def base(self) -> str:
        """How the base was taken to be held, as in "fixed" or "floating"."""
        return self.base_setup.base

    @property
    def floating(self) -> BaseFindings | None:
        """The `base_findings`."""
        return self.base_findings

    @property
    def residual_momentum(self) -> float | None:
        """By how much its own base motion misses the momentum, over the greatest of a link's; None: the base is fixed."""
        return None if self.base_findings is None else self.base_findings.residual_momentum

    @property
    def base_error(self) -> float | None:
        """No attitude of the base in the proof is further off than this, which it allows for [rad]; None: it is fixed."""
        return None if self.base_findings is None else self.base_findings.error

    @property
    def base_rotation_final(self) -> float | None:
        """The angle between the base's first and last attitude [rad]; None: it is fixed."""
        return None if self.base_findings is None else self.base_findings.rotation_final

    @property
    def base_rotation_peak(self) -> float | None:
        """No angle to the first attitude is greater, at any t [rad]; None: it is fixed."""
        return None if self.base_findings is None else self.base_findings.rotation_peak

    @property
    def holds(self) -> bool:
        """Whether the trajectory is proven."""
        return self.status == "holds"

    @property
    def problem_hash(self) -> str:
        """SHA-256 of the robot's, the scene's and the base's values."""
        return problem_digest(self.robot, self.scene, self.base_setup)

    @property
    def trajectory_hash(self) -> str:
        """SHA-256 of the trajectory's values."""
        return trajectory_digest(self.trajectory)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """What the trajectory's file states that is not so, a sentence each."""
        return getattr(self.trajectory, "contradictions", ())

    @property
    def broken_limits(self) -> tuple[str, ...]:
        """The limits among those checked that may be broken, each in words, the worst first."""
        return broken_limits(self.robot, self.limits, self.checked)

    @property
    def fails_by_base_limits(self) -> bool:
        """Whether it fails by limits of the base alone: all else is proven."""
        base = self.base_findings
        others = self.broken_limits or self.contradictions
        return self.status == "fails" and self.clear and not others and base is not None and not base.broken

    @property
    def message(self) -> str:
        """The finding in a sentence, with what is not part of it."""
        said = [self._finding, *self.notes]
        if self.status == "holds":
            said.insert(1, words_on_unchecked(self.unchecked, self.bare))
        return "; ".join(filter(None, said))

    @property
    def _finding(self) -> str:
        near = self.closest
        base = self.base_findings
        broken = (*self.broken_limits, *(base.broken_limits if base is not None and base.followed else ()))
        if near is not None and near.clearance <= self.minimum_clearance and self.status == "fails":
            return _too_close(near, self.minimum_clearance)
        for sentence in self.contradictions[:1]:
            return sentence
        if self.base_findings is not None and self.base_findings.broken:
            return self.base_findings.broken
        for sentence in broken[:1]:
            return f"{sentence} (and {len(broken) - 1} more)" if len(broken) > 1 else sentence
        lacking = self.base_setup.model.lacking(self.robot) or lacks_envelope(self.robot)
        if lacking:
            return lacking
        if self.base_findings is not None and not self.base_findings.followed:
            return (
                f"where the base turns to is known to {self.base_findings.error:.2g} rad only, expected {LOST:g} at most: the "
                "path bends too much, or the base tumbles too much; prove it in shorter parts"
            )
        if near is None:
            kept = f"{', '.join(self.checked)} limits hold for all t" if self.checked else "limits were not looked at"
            free = "nothing is in the way" if self.robot.capsules else "the robot is meant to have no envelope"
            return f"{free}; {kept}"
        where = f"link '{near.link}' and {near.other} at t = {near.time:.4g} s"
        if self.status == "undecided":
            than = f"{self.minimum_clearance * 1e3:.4g} mm" if self.minimum_clearance else "contact"
            off = "" if (self.base_error or 0.0) < _TELLS else f" (the base's attitude is known to {self.base_error:.2g} rad)"
            return f"{where} come within {near.clearance * 1e3:.3g} mm, too close to be told from {than}{off}"
        return f"clearance is at least {(self.clearance or 0) * 1e3:.4g} mm for all t; closest measured: {where}"

    def as_dict(self) -> dict[str, Any]:
        """Return the certificate as plain values, None for what is infinite.

        The time it took is left out, and measured numbers are rounded, for Pinocchio, Coal and the C library differ in the last
        digits from processor to processor: lengths, angles and times to 1e-9, the proven clearance down, errors up to two
        digits. So the same proof gives the same values.
        """
        near, limits = self.closest, self.limits
        own = self.base_findings
        base = (
            {}
            if own is None
            else {
                "base": {
                    "residual_momentum": _rounded_up(max(own.residual_momentum, _NOISE), digits=1),
                    "attitude_error_at_most_rad": _rounded_up(max(own.error, _TOLD), digits=1),
                    "rotation_final_rad": round(own.rotation_final, _DIGITS),
                    "rotation_peak_at_most_rad": _rounded_up(own.rotation_peak, digits=8),
                    "rate_at_most_rad_s": _rounded_up(own.rate, digits=8),
                    "joint_momentum_at_most_n_m_s": _rounded_up(own.joint_momentum, digits=8),
                    "limits_checked": list(own.checked),
                    "limits_broken": list(own.broken_limits),
                }
            }
        )
        return {
            CERTIFICATE_KEY: CERTIFICATE_VERSION,
            "status": self.status,
            "message": self.message,
            "clearance_m": None if self.clearance is None or math.isinf(self.clearance) else _rounded_down(self.clearance),
            "minimum_clearance_m": self.minimum_clearance,
            "closest": None
            if near is None
            else {
                "link": near.link,
                "other": near.other,
                "obstacle": near.obstacle,
                "time_s": round(near.time, _DIGITS),
                "u": round(near.u, _DIGITS),
                "clearance_m": round(near.clearance, _DIGITS),
                "points_m": [[round(x, _DIGITS) for x in point] for point in near.points.tolist()],
            },
            "limits": {
                "checked": list(self.checked),
                "position_margin": _finite(limits.position),
                "velocity_share": _finite(limits.velocity),
                "acceleration_share": _finite(limits.acceleration),
                "jerk_share": None if limits.jerk is None else _finite(limits.jerk),
            },
            **base,
            "not_checked": {
                "pairs": [{"links": list(one.links), "reason": REASONS[one.reason]} for one in self.unchecked],
                "links_without_envelope": list(self.bare),
            },
            "remarks": list(self.notes),
            "resolution": self.resolution,
            "evaluations": self.evaluations,
            "witness": self.witness,
            "problem_hash": self.problem_hash,
            "trajectory_hash": self.trajectory_hash,
        }


def broken_limits(robot: Robot, margins: LimitMargins, checked: tuple[Limit, ...]) -> tuple[str, ...]:
    """Return a sentence for each joint's limit, of those checked, that is not kept for all t.

    The worst comes first: that which is exceeded by the greatest share of itself, of a position limit by that of half the way
    between the joint's two limits, or of 1 rad or m where one of them is infinite.
    """
    out: list[tuple[float, str]] = []
    if "position" in checked:
        half = (robot.upper - robot.lower) / 2
        half = np.where(np.isfinite(half) & (half > 0), half, 1.0)
        for i in np.flatnonzero(~(margins.position >= -ROUNDING)):
            unit, by = "m" if robot.is_prismatic(int(i)) else "rad", 0.0 - margins.position[i]
            out.append((by / half[i], f"joint '{robot.dof_names[i]}' may pass a position limit by {by:.4g} {unit}"))
    for name, shares in (("velocity", margins.velocity), ("acceleration", margins.acceleration), ("jerk", margins.jerk)):
        if name in checked and shares is not None:
            for i in np.flatnonzero(~(shares <= 1)):
                out.append((float(shares[i]) - 1, f"joint '{robot.dof_names[i]}' {_beyond(name, float(shares[i]))}"))
    return tuple(sentence for _, sentence in sorted(out, key=lambda broken: -broken[0] if broken[0] > 0 else -math.inf))


def _beyond(name: str, share: float) -> str:
    if math.isinf(share):
        return f"has no finite {name}: the one before it jumps, at a corner of the path"
    return f"may exceed its {name} limit: {share:.6g} times it"


def _too_close(near: ClosestApproach, minimum: float) -> str:
    where = f"link '{near.link}' and {near.other} at t = {near.time:.4g} s"
    if near.clearance <= 0:
        return f"{where} penetrate by {0.0 - near.clearance * 1e3:.3g} mm"
    return f"{where} come within {near.clearance * 1e3:.4g} mm, expected more than {minimum * 1e3:.4g} mm"


def _rounded_down(length: float) -> float:
    """Return the greatest multiple of 1e-9 that is not above a length [m]."""
    scale = 10**_DIGITS
    down = math.floor(length * scale)
    return down / scale if down / scale <= length else (down - 1) / scale


def _rounded_up(bound: float, *, digits: int = 2) -> float | None:
    """Return a number of few digits that is not below a bound of 0 or more; None where there is none."""
    if not math.isfinite(bound):
        return None
    if bound <= 0:
        return bound
    up = float(f"{bound:.{digits - 1}e}")
    return up if up >= bound else float(f"{up + 10.0 ** (math.floor(math.log10(up)) - digits + 1):.{digits - 1}e}")


def _finite(values: NDArray[Any]) -> list[float | None]:
    """Return numbers as JSON knows them: a joint that turns without end has no margin."""
    return [value if math.isfinite(value) else None for value in values.tolist()]
