"""What a proof says."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from numpy.typing import NDArray

from spacearm.motion import LimitMargins


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosestApproach:
    """The least clearance measured.

    Attributes:
        link: name of the robot's link.
        obstacle: its index in the scene.
        time: when [s].
        clearance: [m]; negative is penetration.
    """

    link: str
    obstacle: int
    time: float
    clearance: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certificate:
    """Whether a trajectory is free of collision and within the joint limits, at every instant.

    Attributes:
        status: "holds", "fails" (a collision or a broken limit was found), or "undecided" (the arm comes too close to be
            told from contact at the stated resolution).
        clearance: proven: the clearance is at least this for all t [m]; None unless it holds; infinite without obstacles.
        closest: the least clearance measured at an instant; None without obstacles or links.
        limits: margins of the joint limits, for all t.
        resolution: length of the shortest interval looked at, as a share of the motion.
        evaluations: configurations looked at.
        seconds: it took.
        witness: whose kinematics and distances were used.
    """

    status: Literal["holds", "fails", "undecided"]
    clearance: float | None
    closest: ClosestApproach | None
    limits: LimitMargins
    resolution: float
    evaluations: int
    seconds: float
    witness: str

    @property
    def holds(self) -> bool:
        """Whether the trajectory is proven."""
        return self.status == "holds"

    @property
    def message(self) -> str:
        """The finding in a sentence."""
        near = self.closest
        if not self.limits.holds:
            return "a joint limit may be broken; see `limits` for the joint"
        if near is None:
            return "nothing is in the way, and the joint limits hold for all t"
        where = f"link '{near.link}' and obstacle {near.obstacle} at t = {near.time:.4g} s"
        if self.status == "fails":
            return f"{where} penetrate by {0.0 - near.clearance * 1e3:.3g} mm"
        if self.status == "undecided":
            return f"{where} come within {near.clearance * 1e3:.3g} mm, too close to be told from contact"
        return f"clearance is at least {(self.clearance or 0) * 1e3:.4g} mm for all t; closest measured: {where}"

    def as_dict(self) -> dict[str, Any]:
        """Return the certificate as plain values, None for what is infinite.

        The time it took is left out: the same proof gives the same values.
        """
        near = self.closest
        return {
            "status": self.status,
            "message": self.message,
            "clearance_m": None if self.clearance is None or math.isinf(self.clearance) else self.clearance,
            "closest": None
            if near is None
            else {
                "link": near.link,
                "obstacle": near.obstacle,
                "time_s": near.time,
                "clearance_m": near.clearance,
            },
            "limits": {
                "position_margin": _finite(self.limits.position),
                "velocity_share": _finite(self.limits.velocity),
                "acceleration_share": _finite(self.limits.acceleration),
            },
            "resolution": self.resolution,
            "evaluations": self.evaluations,
            "witness": self.witness,
        }


def _finite(values: NDArray[Any]) -> list[float | None]:
    """Return numbers as JSON knows them: a joint that turns without end has no margin."""
    return [value if math.isfinite(value) else None for value in values.tolist()]
