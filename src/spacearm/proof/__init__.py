"""The independent proof of a trajectory: nothing of the search is trusted."""

from spacearm.proof.base_proofs import BaseFindings
from spacearm.proof.certificate import Certificate, ClosestApproach
from spacearm.proof.certify import certify

__all__ = [
    "BaseFindings",
    "Certificate",
    "ClosestApproach",
    "certify",
]
