"""Motions that are hard to prove, made by hand so that their least clearance is known: finder, checker and certificate.

A turntable carries a ball, or a long thin box, past an obstacle. Whatever path the joint takes, the least clearance is that of
the angle at which it passes; Coal measures it there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from spacearm.geometry import Box, Scene, Sphere
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory
from spacearm.proof import certify
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.checker import Checked, check_proof
from spacearm.proof.claim import claim_of
from spacearm.proof.finder import Found, find_proof
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import required_clearance
from spacearm.robot import LinkShape, Robot
from support.dense_samples import Setting, planar
from support.floating_cases import blind_path
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames

PASSED = 0.3  # [rad] the angle at which the obstacle is passed
FROM, TO = -0.8, 0.9
TURN = 2 * np.pi
RADIUS, BALL = 0.05, 0.1  # [m] of what is carried, and of what is passed

ROOMS = (1e-3, 1e-6, 1e-7)
"""Least clearances that are proven [m]."""


def turntable(shape: Any) -> Robot:
    """One joint that turns without end, and a shape on it."""
    fields: dict[str, Any] = {
        "joints": planar().joints[:1],
        "shapes": (LinkShape(name="carried", joint=0, shape=shape),),
        "capsules": None,
        "self_pairs": (),
        "frames": planar().frames[:1],
        "tip": "base",
        "lower": (-np.inf,),
        "upper": (np.inf,),
        "velocity": (1e9,),
        "acceleration": (1e12,),
    }
    return planar(**fields)


def recorded(path: Callable[..., PiecewisePath], t: Any, q: Any) -> Callable[[Robot], AnyTrajectory]:
    rows = np.asarray(q, dtype=np.float64)[:, None]
    return lambda robot: RecordedTrajectory(robot, path(np.asarray(t, dtype=np.float64), rows))


def resting_in_gauss_points(seed: int) -> Callable[[Robot], AnyTrajectory]:
    """Both the rate and the acceleration vanish in Gauss points: a sampler sees an arm that rests."""
    path = blind_path(np.random.default_rng(seed), np.array([0.0, 1.0, 2.5]), np.array([[FROM], [0.1], [TO]]))
    return lambda robot: RecordedTrajectory(robot, path)


def spline(*q: float, law: TimeLaw | None = None) -> Callable[[Robot], AnyTrajectory]:
    return lambda robot: Trajectory(robot, Motion(np.array(q)[:, None]), time_law=law)


def wavy(count: int) -> np.ndarray:
    """Angles from FROM to TO that go back again and again, and pass PASSED somewhere between two rows."""
    share = np.linspace(0, 1, count)
    return FROM + (TO - FROM) * share + 0.03 * np.sin(300 * share) * share * (1 - share)


PATHS: dict[str, Callable[[Robot], AnyTrajectory]] = {
    "a straight line": recorded(PiecewisePath.from_linear, [0, 1], [FROM, TO]),
    "a spline": spline(FROM, -0.5, 0.2, 0.5, TO),
    "there and back, turning at the obstacle": recorded(
        lambda t, q: PiecewisePath.from_quintic(t, q, np.zeros_like(q), np.zeros_like(q)), [0, 1, 2], [FROM, PASSED, FROM]
    ),
    "a corner at the obstacle": recorded(PiecewisePath.from_linear, [0, 1, 2], [FROM, PASSED, FROM]),
    "resting in 3 to 12 Gauss points": resting_in_gauss_points(0),
    "resting in other Gauss points": resting_in_gauss_points(3),
    "a steep spline": spline(FROM, FROM, FROM, FROM, TO, TO, TO),
    "a leap within two microseconds": recorded(
        PiecewisePath.from_linear, [0, 1, 1 + 2e-6, 2], [FROM, FROM + 0.01, TO - 0.01, TO]
    ),
    "ten thousand pieces": recorded(PiecewisePath.from_linear, np.linspace(0, 10, 10_001), wavy(10_001)),
    "a thousand cubics": recorded(PiecewisePath.from_cubic, np.linspace(0, 10, 1_001), wavy(1_001)),
    "after a turn": recorded(PiecewisePath.from_linear, [0, 1], [FROM + TURN, TO + TURN]),
    "after a thousand turns back": recorded(PiecewisePath.from_linear, [0, 1], [FROM - 1000 * TURN, TO - 1000 * TURN]),
    "through a whole turn": recorded(PiecewisePath.from_linear, [0, 1], [FROM, FROM + TURN]),
}


def ball(room: float) -> tuple[Any, Scene]:
    """A ball 1 m out, and one that it passes."""
    far = 1 + RADIUS + BALL + room
    return Sphere((1.0, 0, 0), RADIUS), Scene([Sphere((far * np.cos(PASSED), far * np.sin(PASSED), 0), BALL)])


def thin_box(room: float) -> tuple[Any, Scene]:
    """A box 2 m long and 1 mm thin that turns about its middle, and the corner of another one that its end passes."""
    reach = float(np.hypot(1.0, 0.0005))
    z = np.array([np.cos(PASSED), np.sin(PASSED), 0.0])  # away from the shaft, along the diagonal of the other box
    x = np.array([-np.sin(PASSED), np.cos(PASSED), 0.0])
    diagonal = np.stack([x, np.cross(z, x), z], axis=1)
    edges = np.array([[1, -1, 0], [1, 1, -2], [1, 1, 1]]) / np.sqrt([2, 6, 3])[:, None]  # rows: the last one is the diagonal
    T = np.eye(4)
    T[:3, :3] = diagonal @ edges
    T[:3, 3] = (reach + room + 0.1 * np.sqrt(3)) * z
    return Box((2.0, 0.001, 0.002)), Scene([Box((0.2, 0.2, 0.2), T)])


PASSING: dict[str, Callable[[float], tuple[Any, Scene]]] = {"ball": ball, "thin box": thin_box}


def proof_of(robot: Robot, scene: Scene, trajectory: AnyTrajectory, clearance: float = 0.0) -> tuple[Found, Checked | None]:
    base = begun_base_proof(robot, trajectory, base_setup_of(trajectory, robot, who="trajectory"))
    required = required_clearance(robot, scene, clearance)
    claim = claim_of(robot, scene, base, PathIntervals(base.curve), required=required)
    found = find_proof(claim)
    return found, None if found.proof is None else check_proof(claim, found.proof)


def measured(robot: Robot, scene: Scene) -> float:
    """What Coal measures where a ball passes, and the one and the other corner of the box."""
    corner = np.arctan(0.0005)
    return float(least_distances(robot, scene, joint_frames(robot, PASSED + np.array([[-corner], [0], [corner]]))).min())


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("passing", PASSING)
def test_what_passes_with_little_room_is_proven_with_half_of_it(passing: str, path: str, room: float) -> None:
    shape, scene = PASSING[passing](room)
    robot = turntable(shape)
    assert measured(robot, scene) == pytest.approx(room, abs=1e-9)
    found, checked = proof_of(robot, scene, PATHS[path](robot))
    assert found.status == "holds"
    assert checked is not None
    assert not checked.fault
    assert room / 2 - 1e-8 <= checked.proven[0] <= room


@pytest.mark.parametrize("room", [0.0, -1e-9, -1e-6, -1e-3])
@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("passing", PASSING)
def test_what_touches_for_an_instant_is_never_proven(passing: str, path: str, room: float) -> None:
    shape, scene = PASSING[passing](room)
    robot = turntable(shape)
    found, _ = proof_of(robot, scene, PATHS[path](robot))
    assert found.status != "holds"
    assert found.proof is None
    if room <= -1e-6:
        assert found.status == "fails"
        assert found.worst is not None
        assert found.worst.clearance <= 0


@pytest.mark.parametrize("excess", [1e-3, 1e-6, -1e-6])
@pytest.mark.parametrize("path", PATHS)
def test_a_clearance_is_kept_by_a_micrometre_or_is_not(path: str, excess: float) -> None:
    shape, scene = ball(0.02)
    robot = turntable(shape)
    found, checked = proof_of(robot, scene, PATHS[path](robot), clearance=0.02 - excess)
    assert found.status == ("holds" if excess > 0 else "fails")
    if checked is not None:
        assert not checked.fault
        assert 0.02 - excess < checked.proven[0] <= 0.02


@pytest.mark.parametrize("path", ["resting in 3 to 12 Gauss points", "a steep spline", "ten thousand pieces", "after a turn"])
def test_the_certificate_says_the_same(path: str) -> None:
    for room, status in ((1e-6, "holds"), (-1e-6, "fails")):
        shape, scene = thin_box(room)
        robot = turntable(shape)
        certificate = certify(Setting(robot, scene), PATHS[path](robot), limits=())
        assert certificate.status == status
        assert certificate.closest is not None
        assert certificate.closest.clearance == pytest.approx(room, abs=1e-6)
