"""Proofs that somebody else made: what is none is refused in a sentence, and never costs more room than it has bytes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import FileFormatError, ProblemError
from spacearm.geometry import Scene, Sphere
from spacearm.motion import PiecewisePath, RecordedTrajectory
from spacearm.proof import certify
from spacearm.proof.proof_tree import ProofTree
from support.small_robots import slider


def proven() -> tuple[Any, RecordedTrajectory, ProofTree]:
    """A carriage that passes a ball, and the proof that it keeps clear."""
    robot = slider()
    path = PiecewisePath([0, 10, 20], [[[-1, 0], [-0.5, 0.1], [0.5, 0.2], [1, 0]], [[1, 0], [1.5, -0.2], [1.6, 0], [1, 0.2]]])
    problem = SimpleNamespace(robot=robot, scene=Scene([Sphere((0, 0.25, 0.1), 0.1)]), clearance=0.01)
    trajectory = RecordedTrajectory(robot, path)
    proof = certify(problem, trajectory).proof
    assert proof is not None
    return problem, trajectory, proof


@pytest.mark.parametrize("nodes", [-1, 1.5, "7", True, None, 10**11, 10**30, float("inf"), float("nan")])
def test_a_wrong_number_of_nodes_is_refused_before_room_is_made(nodes: Any) -> None:
    values = proven()[2].as_dict() | {"nodes": nodes}
    with pytest.raises(FileFormatError, match="nodes"):
        ProofTree.from_dict(values)


@pytest.mark.parametrize("planes", [-1, 10**30, float("inf")])
def test_a_wrong_number_of_planes_is_refused(planes: Any) -> None:
    with pytest.raises(FileFormatError, match=r"planes|cannot be read"):
        ProofTree.from_dict(proven()[2].as_dict() | {"planes": planes})


@pytest.mark.parametrize("name", ["nodes", "planes", "steps", "directions", "spacearm-proof"])
@pytest.mark.parametrize("value", [True, 1.0, "é", "AAAA", [1], {}, 2**63, np.array([1, 2])])
def test_a_wrong_value_is_a_fault_of_the_file(name: str, value: Any) -> None:
    with pytest.raises(FileFormatError) as refused:
        ProofTree.from_dict(proven()[2].as_dict() | {name: value})
    assert "\n" not in str(refused.value)


def test_what_is_no_proof_is_refused_in_a_sentence() -> None:
    problem, trajectory, proof = proven()
    wrong: list[Any] = [
        5,
        proof.as_dict(),
        ProofTree(steps=None, directions=None),  # type: ignore[arg-type]
        ProofTree(steps=proof.steps.tolist(), directions=proof.directions),  # type: ignore[arg-type]
        ProofTree(steps=proof.steps, directions=np.ma.masked_array(proof.directions)),
    ]
    for given in wrong:
        with pytest.raises(ProblemError, match="expected a ProofTree"):
            certify(problem, trajectory, proof=given)
