"""The independent proof of a trajectory: nothing of the search is trusted."""

from spacearm.proof.certificate import Certificate, ClosestApproach, FloatingBase
from spacearm.proof.certify import certify

__all__ = ["Certificate", "ClosestApproach", "FloatingBase", "certify"]
