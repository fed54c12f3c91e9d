"""The independent proof of a trajectory: nothing of the search is trusted."""

from spacearm.proof.base_proofs import BaseFindings
from spacearm.proof.certificate import Certificate, ClosestApproach
from spacearm.proof.certify import certify
from spacearm.proof.required_clearance import DEFAULT_CLEARANCE, PairClearance
from spacearm.proof.robustness import Robustness, Tube, robustness

__all__ = [
    "DEFAULT_CLEARANCE",
    "BaseFindings",
    "Certificate",
    "ClosestApproach",
    "PairClearance",
    "Robustness",
    "Tube",
    "certify",
    "robustness",
]
