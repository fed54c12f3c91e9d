"""The finder's floating base (C++) is the proof's: where it is, and how far it moves on a stretch of the path."""

from __future__ import annotations

import numpy as np
import pytest

from spacearm.core.native_finder import native_finder
from spacearm.dynamics import Momentum
from spacearm.proof.base_momentum import masses_of
from spacearm.proof.base_proofs import FloatingBaseProof, base_setup_of, begun_base_proof, link_frames
from support.floating_cases import drawn_robot, drawn_trajectory

CLOSE = 1e-10  # of each quantity's size: two orders of the same sums, for bases up to a thousand times lighter than their arms


def _begun(number: int) -> tuple[np.random.Generator, FloatingBaseProof]:
    rng = np.random.default_rng((12, number))
    robot = drawn_robot(rng)  # with slides, mimics and branches
    drifts = number % 3 == 0
    spin = 0.1 * masses_of(robot).base_least * rng.normal(size=3)
    momentum = Momentum(linear=rng.normal(size=3), angular=spin) if drifts else Momentum()
    trajectory = drawn_trajectory(rng, robot, momentum)
    base = begun_base_proof(robot, trajectory, base_setup_of(trajectory, robot, who="trajectory"))
    assert isinstance(base, FloatingBaseProof)
    return rng, base


def _native(base: FloatingBaseProof) -> native_finder.FloatingBase:
    return native_finder.FloatingBase(**base.for_finder()._asdict())


@pytest.mark.parametrize("number", range(24))
def test_the_native_base_is_where_the_proof_has_it(number: int) -> None:
    rng, base = _begun(number)
    begin, end = base.curve.domain
    u = np.concatenate([[begin, end], rng.uniform(begin, end, 20)])
    T_b_joint = link_frames(base, u)
    T_w_b = base.placed(u, T_b_joint)[:, -1, :3]
    found = _native(base).place(u, np.ascontiguousarray(T_b_joint[:, :-1, :3]))
    np.testing.assert_allclose(found, T_w_b, rtol=0, atol=CLOSE * (1 + np.abs(T_w_b).max()))


@pytest.mark.parametrize("number", range(24))
def test_the_native_bounds_of_the_base_are_the_proofs(number: int) -> None:
    rng, base = _begun(number)
    begin, end = base.curve.domain
    u, joints = rng.uniform(begin, end, 20), len(base.robot.joints)
    frames = base.placed(u, link_frames(base, u))
    half = (end - begin) * 10 ** rng.uniform(-5, -1, 20)
    rate = rng.normal(size=(20, joints)) * (rng.random(joints) < 0.8)
    deviation = np.abs(rng.normal(size=(20, joints))) * half[:, None] ** 2
    step = np.abs(rate) * half[:, None] + deviation
    proof = base.motion_bounds(frames, rate, deviation, step, half)
    found = _native(base).bounds(np.ascontiguousarray(frames[:, :, :3]), rate, deviation, step, half)
    assert set(found) == set(proof.__dataclass_fields__)
    assert found["attitude_error"] == proof.attitude_error
    for name in ("com", "com_lever", "mass_share", "com_velocity", "omega"):
        expected = getattr(proof, name)
        np.testing.assert_allclose(found[name], expected, rtol=0, atol=CLOSE * (1e-12 + np.abs(expected).max()), err_msg=name)
    for name in ("rotation", "rotation_second_order"):
        np.testing.assert_allclose(found[name], getattr(proof, name), rtol=CLOSE, err_msg=name)
