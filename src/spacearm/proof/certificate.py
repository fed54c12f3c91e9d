"""The certificate: what a proof states about a trajectory, in words and as plain values, with hashes of what it is about."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief, Rows, counted, named
from spacearm.core.notebook_hook import InNotebooks
from spacearm.geometry import Scene
from spacearm.geometry.scene import scene_as_list
from spacearm.motion import AnyTrajectory, LimitMargins
from spacearm.motion.trajectory_values import trajectory_as_dict
from spacearm.proof.base_proofs import LOST, BaseFindings, BaseSetup
from spacearm.proof.proof_tree import ProofTree
from spacearm.proof.required_clearance import PairClearance, pair_clearance_as_dict
from spacearm.proof.tracking import tracking_as_dict, tracking_in_words
from spacearm.robot import Robot
from spacearm.robot.model import robot_as_dict
from spacearm.robot.unchecked_pairs import UncheckedPair, lacks_envelope, words_on_unchecked

Limit = Literal["position", "velocity", "acceleration", "jerk"]

CERTIFICATE_KEY = "spacearm-certificate"
CERTIFICATE_VERSION = 1
"""The version of the format of `Certificate.as_dict`. Certificates without this key have version 1, too."""

ROUNDING = 1e-12
"""[rad or m] An excess of a position limit up to this is rounding."""

_DIGITS = 9  # decimals of recorded measurements [m, rad, s]
_LEAST_ERROR = 1e-9  # [rad] a smaller error of the attitude is recorded as this, for it depends on the processor's rounding
_LEAST_RESIDUAL = 1e-12  # a smaller residual momentum is recorded as this, for the same reason
_NOTABLE_ERROR = 1e-7  # [rad] a message mentions larger errors of the attitude
_END_WORDS = {"start": "the start", "goal": "the goal", "both": "start and goal"}
_LISTED = 3  # pairs near at an end that a message names
_PROVENANCE = ("source", "notes", "apart", "unchecked", "collision", "solid", "unweighed")
# Keys of a robot that are left out of hashes: where it comes from, and what follows from the other keys.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class ClosestApproach(Brief):
    """The least clearance measured.

    Attributes:
        link: name of the robot's link.
        other: what it is closest to, as in "obstacle 'shelf'", "obstacle 3" or "link 'forearm'".
        obstacle: index in the scene of the obstacle; None if it is a link.
        time: the instant [s].
        u: the parameter of the trajectory's curve.
        clearance: [m]; negative for a penetration.
        required: what the pair is held to there [m].
        points: (2, 3) the nearest points of the two, or those that penetrate deepest, in the inertial frame [m].
        tube: what a tracking error may take from the clearance there [m]; 0 without one.
    """

    link: str
    other: str
    obstacle: int | None
    time: float
    u: float
    clearance: float
    required: float
    points: NDArray[np.float64]
    tube: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class NearPair(Brief):
    """A pair of bodies that has less than the required clearance at the start or the goal, and what it is held to instead.

    A pair that is near at both ends and gets out between them is listed once for each end.

    Attributes:
        link: name of the robot's link.
        other: the other body, as in "obstacle 'shelf'", "obstacle 3" or "link 'forearm'".
        obstacle: index in the scene of the obstacle; None if it is a link.
        ends: where it is near: "start", "goal", or "both" for a pair that does not get out between them.
        clearance: what it has there, at both ends the lesser; with a tracking error, at least within it [m].
        required: the clearance that is asked for [m]. It is held to this before `begin` and after `end`.
        held_to: what it has to keep from `begin` to `end` [m].
        proven: it has at least this from `begin` to `end` [m]; None unless the certificate holds.
        measured: the least measured from `begin` to `end` [m].
        begin, end: the times between which it is held to less than is asked for [s].
        in_tube: whether there is a tracking error.
    """

    link: str
    other: str
    obstacle: int | None
    ends: Literal["start", "goal", "both"]
    clearance: float
    required: float
    held_to: float
    proven: float | None
    measured: float
    begin: float
    end: float
    in_tube: bool = False

    @property
    def text(self) -> str:
        """The pair and what is proven or required of it, in words."""
        times = {"start": f"up to t = {self.end:.4g} s", "goal": f"from t = {self.begin:.4g} s", "both": "all the time"}
        kept = f"held to {_mm(self.held_to)}" if self.proven is None else f"proven at least {_mm(self.proven)}"
        has = f"{_mm(self.clearance)}{' within the tracking error' if self.in_tube else ''}"
        return f"link '{self.link}' and {self.other}, {has} at {_END_WORDS[self.ends]}: {kept} {times[self.ends]}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Certificate(Brief, InNotebooks):
    """Whether a trajectory is free of collisions, and within the limits of joints and of a floating base, at every instant.

    Attributes:
        status: "holds"; "fails": a collision or a broken limit was found; "undecided": a pair is too close to be distinguished
            from contact at the stated resolution, or the base's attitude is not known well enough.
        clear: whether the clearance is proven, whatever is found about limits and about what the trajectory states.
        clearance: proven: the clearance is at least this for all t [m]; None unless the certificate holds; infinite if nothing
            is in the way. It is about obstacles and `robot.self_pairs`, all the time but for the times in `near_pairs`; if no
            pair is ever held to the full, it is the least of those. Pairs that cannot meet (`robot.apart`) do not touch.
        required: the clearance that is asked for [m].
        required_by_pair: the clearances that are asked for of some pairs, in place of it.
        closest: the least clearance measured at an instant, of what `clearance` is about; None without obstacles or links. If
            the certificate fails, it is the pair that lacks most to what it is held to; if it does so because of pairs that
            cannot meet, it is theirs.
        limits: margins of the joint limits, for all t.
        checked: the limits that were asked for: "position", "velocity", "acceleration", "jerk".
        resolution: the shortest interval evaluated, as a share of the curve, all its pieces counting alike.
        evaluations: configurations evaluated by the check of the proof, or by the search for one.
        seconds: the time that the proof took, its search included.
        witness: the libraries for kinematics and distances.
        robot, scene, trajectory: what it is about.
        base_setup: how the base is held, its start pose, and the momentum.
        base_findings: what was found about a base that the arm moves; None if the base is fixed, or its motion unknown.
        near_pairs: the pairs that have less than is asked for at the start or the goal, and what was proven for them.
        unchecked: the pairs of links that are not part of the claim, each with the reason.
        bare: links without an envelope: nothing is claimed of them.
        proof: that pairs of bodies keep apart, as data; None unless `clear`.
        tracking: (n,) how far each joint may be off the trajectory, which the claim includes [rad or m]; None: not at all.
        notes: further remarks, a sentence each.
    """

    status: Literal["holds", "fails", "undecided"]
    clear: bool
    clearance: float | None
    required: float
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
    required_by_pair: tuple[PairClearance, ...] = ()
    near_pairs: tuple[NearPair, ...] = ()
    unchecked: tuple[UncheckedPair, ...] = ()
    bare: tuple[str, ...] = ()
    proof: ProofTree | None = field(default=None, repr=False)
    tracking: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()

    def _in_short(self) -> tuple[str, Rows]:
        rows = [("finding", self.message)]
        if self.closest is not None:
            near = self.closest
            rows.append(
                ("closest", f"measured {_mm(near.clearance)}: link '{near.link}' and {near.other} at t = {near.time:.4g} s")
            )
        asked = f"{_mm(self.required)} asked for"
        proven = self.clearance if self.holds else None
        rows.append(("clearance", asked if proven is None else f"{asked}, at least {_mm(proven)} proven for all t"))
        rows.append(("limits", f"looked at: {', '.join(self.checked) or 'none'}; {'kept' if self.limits.holds else 'broken'}"))
        left_out = counted(len(self.unchecked), "pair of links is", "pairs of links are")
        rows += [("left out", f"{left_out} not part of it: certificate.unchecked")] if self.unchecked else []
        size = "" if self.proof is None else f", {len(self.proof.steps):,} nodes, {len(self.proof.directions):,} planes"
        rows.append(("proof", f"{self.evaluations:,} configurations, {self.seconds * 1e3:.4g} ms{size}; {self.witness}"))
        duration = f"{self.trajectory.duration:.4g} s"
        return f"Certificate {self.status}: robot {named(self.robot.name)}, {self.base} base, motion of {duration}", rows

    @property
    def base(self) -> str:
        """The name of the base model, as in "fixed" or "floating"."""
        return self.base_setup.base

    @property
    def floating(self) -> BaseFindings | None:
        """The `base_findings`."""
        return self.base_findings

    @property
    def residual_momentum(self) -> float | None:
        """`base_findings.residual_momentum`; None if the base is fixed."""
        return None if self.base_findings is None else self.base_findings.residual_momentum

    @property
    def base_error(self) -> float | None:
        """No attitude of the base in the proof is wrong by more than this [rad]; None if the base is fixed."""
        return None if self.base_findings is None else self.base_findings.error

    @property
    def base_rotation_final(self) -> float | None:
        """The angle between the base's first and last attitude [rad]; None if the base is fixed."""
        return None if self.base_findings is None else self.base_findings.rotation_final

    @property
    def base_rotation_peak(self) -> float | None:
        """No angle to the first attitude is greater, at any t [rad]; None if the base is fixed."""
        return None if self.base_findings is None else self.base_findings.rotation_peak

    @property
    def holds(self) -> bool:
        """Whether the trajectory is proven."""
        return self.status == "holds"

    @property
    def problem_hash(self) -> str:
        """The SHA-256 of robot, scene and base setup."""
        return problem_digest(self.robot, self.scene, self.base_setup)

    @property
    def trajectory_hash(self) -> str:
        """The SHA-256 of the trajectory."""
        return trajectory_digest(self.trajectory)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """What the trajectory's file states and its joints do not do, a sentence each."""
        return getattr(self.trajectory, "contradictions", ())

    @property
    def broken_limits(self) -> tuple[str, ...]:
        """The checked limits of joints that may be broken, a sentence each, the worst first."""
        return broken_limits(self.robot, self.limits, self.checked, self.tracking)

    @property
    def fails_by_base_limits(self) -> bool:
        """Whether it fails only because of limits of the base."""
        base = self.base_findings
        others = self.broken_limits or self.contradictions
        return self.status == "fails" and self.clear and not others and base is not None and not base.broken

    @property
    def message(self) -> str:
        """The result in a sentence, with what is not part of the claim."""
        said = [self._finding, *self.notes]
        if self.status == "holds":
            said[1:1] = [self._near_finding, self._not_in_tube, words_on_unchecked(self.unchecked, self.bare)]
        return "; ".join(filter(None, said))

    @property
    def _finding(self) -> str:
        near, base = self.closest, self.base_findings
        if near is not None and near.clearance <= near.required and self.status == "fails":
            return f"{_too_close(near)}{self._why_held(near)}"
        for sentence in self.contradictions[:1]:
            return sentence
        if base is not None and base.broken:
            return base.broken
        broken = (*self.broken_limits, *(base.broken_limits if base is not None and base.followed else ()))
        for sentence in broken[:1]:
            return f"{sentence} (and {len(broken) - 1} more)" if len(broken) > 1 else sentence
        lacking = self.base_setup.model.lacking(self.robot) or lacks_envelope(self.robot)
        if lacking:
            return lacking
        if base is not None and not base.followed:
            return (
                f"where the base turns to is known to {base.error:.2g} rad only, expected {LOST:g} at most: the "
                "path bends too much, or the base tumbles too much; prove it in shorter parts"
            )
        return self._clearance_finding

    def _why_held(self, near: ClosestApproach) -> str:
        """Say why a pair that does not touch is held to less than is asked for; "" if it is not."""
        for pair in self.near_pairs if near.clearance > 0 else ():
            named = {f"link '{pair.link}'", pair.other} == {f"link '{near.link}'", near.other}
            if named and pair.held_to == near.required:
                return f", for it has {_mm(pair.clearance)} at {_END_WORDS[pair.ends]}; {_mm(pair.required)} are asked for"
        return ""

    @property
    def _clearance_finding(self) -> str:
        near = self.closest
        if near is None:
            kept = f"{', '.join(self.checked)} limits hold for all t" if self.checked else "limits were not looked at"
            free = "nothing is in the way" if self.robot.shapes else "the robot is meant to have no envelope"
            return f"{free}; {kept}{self._in_tube}"
        where = f"link '{near.link}' and {near.other} at t = {near.time:.4g} s"
        if self.status == "undecided":
            than = _mm(near.required) if near.required else "contact"
            error = self.base_error or 0.0
            known = "" if error < _NOTABLE_ERROR else f" (the base's attitude is known to {error:.2g} rad)"
            within = f"{where} come within {near.clearance * 1e3:.3g} mm"
            if near.tube > 0:
                return f"{within}, {self._taken_from(near)}"
            return f"{within}, too close to be told from {than}{known}{self._why_held(near)}"
        measured = f"measured closest {_mm(near.clearance)}{' without that error' if self._in_tube else ''}: {where}"
        return f"clearance proven at least {_mm(self.clearance or 0)} for all t{self._in_tube}, {measured}"

    def _taken_from(self, near: ClosestApproach) -> str:
        """Say what a tracking error may take from a pair that is not proven, and which error would leave enough."""
        held = near.required if near.clearance > near.required else 0.0  # near at an end: all that it has there is taken
        share, than = (near.clearance - held) / near.tube, _mm(held) if held else "contact"
        less = f"; ask for less than {share:.3g} of that error" if share < 1 else ""
        taken = f"of which a tracking error of {self._error_in_words} may take {near.tube * 1e3:.3g} mm"
        return f"{taken}, too close to be told from {than}{less}{self._why_held(near)}"

    @property
    def _error_in_words(self) -> str:
        return "" if self.tracking is None else tracking_in_words(self.robot, self.tracking)

    @property
    def _in_tube(self) -> str:
        """The tracking error of the claim, as the end of a phrase; "" without one."""
        return "" if self.tracking is None else f", with a tracking error of {self._error_in_words} at any instant"

    @property
    def _not_in_tube(self) -> str:
        """What the tracking error is not about; "" without one."""
        kept = [name for name in self.checked if name != "position"]
        if self.tracking is None or not kept:
            return ""
        return f"{', '.join(kept)} are those of the trajectory itself, not of what follows it with that error"

    @property
    def nearer(self) -> str:
        """How many pairs of bodies begin or end nearer than is required of them, in words; "" if none does."""
        count = len({(near.link, near.other) for near in self.near_pairs})
        return f"{count} pair{'s' if count > 1 else ''} nearer at an end" if count else ""

    @property
    def _near_finding(self) -> str:
        """What is proven of the pairs that are near at an end; "" without any."""
        said = [near.text for near in self.near_pairs[:_LISTED]]
        more = len(self.near_pairs) - _LISTED
        if more > 0:
            said.append(f"{more} more")
        return f"but nearer at an end: {', '.join(said)}" if said else ""

    def as_dict(self) -> dict[str, object]:
        """Return the certificate as plain values, None for what is infinite.

        The time that the proof took is left out. Measured numbers are rounded, because Pinocchio, Coal and the C library differ
        in the last digits from processor to processor: lengths, angles and times to 1e-9, the proven clearance down, errors up
        to one digit, bounds of the base up to eight digits. So the same proof gives the same values.
        """
        near, limits = self.closest, self.limits
        return {
            CERTIFICATE_KEY: CERTIFICATE_VERSION,
            "status": self.status,
            "message": self.message,
            "clearance_m": None if self.clearance is None or math.isinf(self.clearance) else _rounded_down(self.clearance),
            "required_clearance_m": self.required,
            "required_by_pair": [pair_clearance_as_dict(pair) for pair in self.required_by_pair],
            "closest": None if near is None else _closest_as_dict(near),
            "near_pairs": [_near_pair_as_dict(pair) for pair in self.near_pairs],
            **({} if self.tracking is None else {"tracking": tracking_as_dict(self.robot, self.tracking)}),
            "limits": {
                "checked": list(self.checked),
                "position_margin": _finite(limits.position),
                "velocity_share": _finite(limits.velocity),
                "acceleration_share": _finite(limits.acceleration),
                "jerk_share": None if limits.jerk is None else _finite(limits.jerk),
            },
            **({} if self.base_findings is None else {"base": _findings_as_dict(self.base_findings)}),
            "not_checked": {
                "pairs": [{"links": list(one.links), "reason": one.why} for one in self.unchecked],
                "links_without_envelope": list(self.bare),
            },
            "remarks": list(self.notes),
            "resolution": self.resolution,
            "evaluations": self.evaluations,
            "witness": self.witness,
            "problem_hash": self.problem_hash,
            "trajectory_hash": self.trajectory_hash,
        }


def _closest_as_dict(near: ClosestApproach) -> dict[str, object]:
    return {
        "link": near.link,
        "other": near.other,
        "obstacle": near.obstacle,
        "time_s": round(near.time, _DIGITS),
        "u": round(near.u, _DIGITS),
        "clearance_m": round(near.clearance, _DIGITS),
        "required_m": _rounded_down(near.required),
        "points_m": [[round(x, _DIGITS) for x in point] for point in near.points.tolist()],
        **({"tube_m": round(near.tube, _DIGITS)} if near.tube else {}),
    }


def _near_pair_as_dict(near: NearPair) -> dict[str, object]:
    return {
        "link": near.link,
        "other": near.other,
        "obstacle": near.obstacle,
        "ends": near.ends,
        "clearance_m": round(near.clearance, _DIGITS),
        "required_m": near.required,
        "held_to_m": _rounded_down(near.held_to),
        "proven_m": None if near.proven is None else _rounded_down(near.proven),
        "measured_m": round(near.measured, _DIGITS),
        "begin_s": round(near.begin, _DIGITS),
        "end_s": round(near.end, _DIGITS),
    }


def _findings_as_dict(base: BaseFindings) -> dict[str, object]:
    return {
        "residual_momentum": _rounded_up(max(base.residual_momentum, _LEAST_RESIDUAL), digits=1),
        "attitude_error_at_most_rad": _rounded_up(max(base.error, _LEAST_ERROR), digits=1),
        "rotation_final_rad": round(base.rotation_final, _DIGITS),
        "rotation_peak_at_most_rad": _rounded_up(base.rotation_peak, digits=8),
        "rate_at_most_rad_s": _rounded_up(base.rate, digits=8),
        "joint_momentum_at_most_n_m_s": _rounded_up(base.joint_momentum, digits=8),
        "limits_checked": list(base.checked),
        "limits_broken": list(base.broken_limits),
    }


def broken_limits(
    robot: Robot, margins: LimitMargins, checked: tuple[Limit, ...], tracking: NDArray[np.float64] | None = None
) -> tuple[str, ...]:
    """Return a sentence for each checked limit of a joint that is not kept for all t.

    The worst comes first: the limit that is exceeded by the greatest share of itself. For a position limit it is the share of
    half the range between the joint's two limits, or of 1 rad or m if one of them is infinite. `tracking` (n,): the tracking
    error that the margins are for, if any [rad or m].
    """
    out: list[tuple[float, str]] = []
    if "position" in checked:
        half = (robot.upper - robot.lower) / 2
        half = np.where(np.isfinite(half) & (half > 0), half, 1.0)
        for i in np.flatnonzero(~(margins.position >= -ROUNDING)):
            unit, by = "m" if robot.is_prismatic(int(i)) else "rad", 0.0 - margins.position[i]
            error = "" if tracking is None else f" with a tracking error of {tracking[i]:.4g} {unit}"
            out.append((by / half[i], f"joint '{robot.dof_names[i]}' may pass a position limit by {by:.4g} {unit}{error}"))
    for name, shares in (("velocity", margins.velocity), ("acceleration", margins.acceleration), ("jerk", margins.jerk)):
        if name in checked and shares is not None:
            for i in np.flatnonzero(~(shares <= 1)):
                out.append((float(shares[i]) - 1, f"joint '{robot.dof_names[i]}' {_beyond(name, float(shares[i]))}"))
    return tuple(sentence for _, sentence in sorted(out, key=lambda broken: -broken[0] if broken[0] > 0 else -math.inf))


def _beyond(name: str, share: float) -> str:
    if math.isinf(share):
        return f"has no finite {name}: the one before it jumps, at a corner of the path"
    return f"may exceed its {name} limit: {share:.6g} times it"


def _too_close(near: ClosestApproach) -> str:
    where = f"link '{near.link}' and {near.other} at t = {near.time:.4g} s"
    if near.clearance <= 0:
        return f"{where} penetrate by {0.0 - near.clearance * 1e3:.3g} mm"
    return f"{where} come within {_mm(near.clearance)}, expected more than {_mm(near.required)}"


def _mm(length: float) -> str:
    return f"{length * 1e3:.4g} mm"


def _rounded_down(length: float) -> float:
    """Return the greatest multiple of 1e-9 that is not above a length [m]."""
    scale = 10**_DIGITS
    down = math.floor(length * scale)
    return down / scale if down / scale <= length else (down - 1) / scale


def _rounded_up(bound: float, *, digits: int) -> float | None:
    """Return a number with a few digits that is not below a bound of 0 or more; None for an infinite one."""
    if not math.isfinite(bound):
        return None
    if bound <= 0:
        return bound
    up = float(f"{bound:.{digits - 1}e}")
    return up if up >= bound else float(f"{up + 10.0 ** (math.floor(math.log10(up)) - digits + 1):.{digits - 1}e}")


def _finite(values: NDArray[np.float64]) -> list[float | None]:
    """Return numbers with None in place of those that JSON does not know: a continuous joint has an infinite margin."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


# ---- Hashes ----------------------------------------------------------------------------------------------------------


def digest(values: object) -> str:
    """Return the SHA-256 of plain values, in hexadecimal. The order of keys does not matter.

    All hashes in files of spacearm are made by this function. A number counts with all its digits, as JSON writes it.
    """
    return hashlib.sha256(json.dumps(values, sort_keys=True, allow_nan=False).encode()).hexdigest()


def canonical(robot: Robot, scene: Scene) -> dict[str, object]:
    """Return a robot and a scene as the plain values that all hashes are made of.

    Notes, the robot's source, and the base model in the robot's file are left out. The problem states the base model.
    """
    values: dict[str, object] = robot_as_dict(robot)
    for key in ("base", *_PROVENANCE):
        values.pop(key, None)
    return {"robot": values, "obstacles": scene_as_list(scene, notes=False)}


def problem_digest(robot: Robot, scene: Scene, setup: BaseSetup) -> str:
    """Return the SHA-256 of what a certificate is about: robot, scene and base setup. Start and goal do not matter.

    The hash of a whole problem, `files.plan_file.problem_hash`, is made of the same values, of start and goal, and of what is
    asked of the base. A base that is fixed at the identity adds nothing.
    """
    stated: dict[str, object] = {}
    if setup.base != "fixed" or not setup.at_origin:
        stated = {"base": setup.base, "base_start": setup.start.tolist()}
    if setup.drifting:
        stated["momentum"] = [setup.linear.tolist(), setup.angular.tolist()]
    return digest({**canonical(robot, scene), **stated})


def trajectory_digest(trajectory: AnyTrajectory) -> str:
    """Return the SHA-256 of a trajectory's path and time law."""
    values: dict[str, object] = trajectory_as_dict(trajectory)
    for provenance in ("notes", "joints"):
        values.pop(provenance, None)
    return digest(values)
