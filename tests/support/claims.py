"""Claims about a problem's trajectory, as `certify` makes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from spacearm.motion import AnyTrajectory
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.claim import Claim, NearEnd, claim_of
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import required_clearance


def claim_about(problem: Any, trajectory: AnyTrajectory, *, near: Sequence[NearEnd] = ()) -> Claim:
    """The claim about a trajectory of a problem, with the pairs that are near at an end."""
    base = begun_base_proof(problem.robot, trajectory, base_setup_of(problem, problem.robot, who="problem"))
    by_pair = tuple(getattr(problem, "clearances", ()))
    required = required_clearance(problem.robot, problem.scene, problem.clearance, by_pair)
    path = PathIntervals(base.curve)
    return claim_of(problem.robot, problem.scene, base, path, required=required, by_pair=by_pair, near=tuple(near))
