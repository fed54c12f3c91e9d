"""The proof: what it says holds, holds at 20,000 instants; what it says fails, fails there and that deep."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError
from spacearm.geometry import Scene, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.proof import certify
from spacearm.proof.certificate import Certificate
from spacearm.proof.witness import CoalBodies
from spacearm.robot import LinkCapsule
from support.dense_samples import Setting, dense_clearances, least_clearance, on_the_way, planar, swing, trajectories
from support.messages import assert_refused
from support.oracles.coal_shapes import clearances
from support.oracles.pinocchio_points import joint_frames

INSTANTS = 20_000
ROUNDING = 1e-7  # [m] Coal's and Pinocchio's, of arms a few metres long
TOO_CLOSE = 1e-5  # [m] further apart than this, nothing of a few metres is undecided
DRAWN = settings(max_examples=30)


def exact_clearances(setting: Setting, q: np.ndarray) -> np.ndarray:
    return clearances(joint_frames(setting.robot, q), setting.robot.capsules, setting.scene.obstacles)


def assert_true(setting: Setting, trajectory: Trajectory, certificate: Certificate, seed: int) -> None:
    """Hold a certificate against instants it did not choose."""
    least = least_clearance(setting, trajectory, INSTANTS, seed)
    near = certificate.closest
    assert near is not None
    q = trajectory.sample(near.time).q
    pairs = exact_clearances(setting, q[None])[0, :, near.obstacle]
    measured = [pairs[i] for i, link in enumerate(setting.robot.capsules) if link.name == near.link]
    assert min(abs(value - near.clearance) for value in measured) <= ROUNDING
    if certificate.status == "holds":
        assert certificate.clearance is not None
        assert certificate.clearance > 0
        assert least >= certificate.clearance - 1e-12
        assert near.clearance / 2 <= certificate.clearance + 2e-9
    elif certificate.status == "fails" and certificate.clear:  # of a motion of rounding size, rounding may break a limit
        assert near.clearance > 0
        assert "limit" in certificate.message
    elif certificate.status == "fails":
        assert near.clearance <= 0
        assert min(measured) <= ROUNDING
    else:
        assert near.clearance <= TOO_CLOSE


@DRAWN
@given(trajectories(), st.data(), st.integers(0, 2**32 - 1))
def test_a_certificate_is_true_of_any_scene(trajectory: Trajectory, data: st.DataObject, seed: int) -> None:
    sphere = st.one_of(
        on_the_way(trajectory, data.draw(st.sampled_from([-1e-4, 0.0, 1e-6, 1e-3, 0.03, 0.5])), 0.001),
        on_the_way(trajectory, data.draw(st.sampled_from([1e-4, 0.05, 1.0])), 0.3),
    )
    setting = Setting(trajectory.robot, Scene(data.draw(st.lists(sphere, min_size=1, max_size=3))))
    certificate = certify(setting, trajectory)
    assert_true(setting, trajectory, certificate, seed)


@DRAWN
@given(trajectories(), st.data())
def test_a_pea_on_the_way_is_never_missed(trajectory: Trajectory, data: st.DataObject) -> None:
    """Of 1 mm, half inside a link at some instant between whatever samples."""
    pea = data.draw(on_the_way(trajectory, -0.001, 0.001))
    certificate = certify(Setting(trajectory.robot, Scene([pea])), trajectory)
    assert not certificate.holds
    assert certificate.clearance is None


@DRAWN
@given(trajectories(), st.data())
def test_a_ball_that_swallows_a_link_fails(trajectory: Trajectory, data: st.DataObject) -> None:
    ball = data.draw(on_the_way(trajectory, -0.3, 0.3))
    certificate = certify(Setting(trajectory.robot, Scene([ball])), trajectory)
    assert certificate.status == "fails"
    assert certificate.closest is not None
    assert certificate.closest.clearance <= 0


# ---- closed forms ----------------------------------------------------------------------------------------------------


def stretched(gap: float, at: float, radius: float = 0.1) -> Setting:
    """A ball so far beyond the fingertips of the stretched arm, at an angle."""
    distance = 2.05 + gap + radius
    return Setting(planar(), Scene([Sphere((distance * np.cos(at), distance * np.sin(at), 0), radius)]))


@given(st.floats(1e-3, 0.5), st.floats(-0.9, 0.9))
def test_the_proven_clearance_is_no_more_than_the_true_and_half_of_it_at_least(gap: float, at: float) -> None:
    setting = stretched(gap, at)
    certificate = certify(setting, Trajectory(setting.robot, swing(-1, 1)))
    assert certificate.status == "holds"
    assert certificate.clearance is not None
    assert 0.5 * gap - 1e-8 <= certificate.clearance <= gap
    assert certificate.closest is not None
    assert gap - 1e-12 <= certificate.closest.clearance <= 2 * gap


@given(st.floats(1e-4, 0.2), st.floats(-0.9, 0.9))
def test_a_graze_fails(depth: float, at: float) -> None:
    setting = stretched(-depth, at)
    certificate = certify(setting, Trajectory(setting.robot, swing(-1, 1)))
    assert certificate.status == "fails"
    assert certificate.closest is not None
    assert certificate.closest.link == "fore"
    assert -depth - 1e-9 <= certificate.closest.clearance <= 0


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-10, 1e-9])
def test_contact_is_told_neither_way_and_ends_soon(gap: float) -> None:
    setting = stretched(gap, 0.4)
    certificate = certify(setting, Trajectory(setting.robot, swing(-1, 1)))
    assert certificate.status in ("undecided", "fails") if gap == 0 else certificate.status == "undecided"
    assert certificate.evaluations < 2000
    assert "too close" in certificate.message or "penetrate" in certificate.message


@pytest.mark.parametrize("gap", [1e-7, 1e-6, 1e-4])
def test_a_gap_however_narrow_is_proven_soon(gap: float) -> None:
    """The fingertips pass along the ball, and what they lose along its normal goes with the square of the interval."""
    setting = stretched(gap, 0.4)
    certificate = certify(setting, Trajectory(setting.robot, swing(-1, 1)))
    assert certificate.holds
    assert certificate.evaluations < 200


@pytest.mark.parametrize("gap", [0.0, 1e-13, 1e-10])
def test_lasting_contact_ends_soon_too(gap: float) -> None:
    """Of an arm at rest, and of a link that is bolted to the base."""
    setting = stretched(gap, 0.4)
    still = Trajectory(setting.robot, swing(0.4, 0.4))
    assert certify(setting, still).status != "holds"
    bolted = planar(capsules=(LinkCapsule(name="foot", joint=-1, a=np.zeros(3), b=np.array([0, 0, -1.0]), radius=0.1),))
    below = Setting(bolted, Scene([Sphere((0, 0, -1.3 - gap), 0.2)]))
    certificate = certify(below, Trajectory(bolted, swing(-1, 1)))
    assert certificate.status != "holds"
    assert certificate.evaluations < 100


def test_an_arm_at_rest_is_proven() -> None:
    setting = stretched(0.25, 0.0)
    certificate = certify(setting, Trajectory(setting.robot, swing(0.0, 0.0)))
    assert certificate.holds
    assert certificate.clearance == pytest.approx(0.25, abs=1e-8)


@pytest.mark.parametrize(
    "capsule",
    [
        LinkCapsule(name="point", joint=1, a=np.zeros(3), b=np.zeros(3), radius=0.0),
        LinkCapsule(name="ball", joint=1, a=np.zeros(3), b=np.zeros(3), radius=0.05),
        LinkCapsule(name="line", joint=0, a=np.zeros(3), b=np.array([1.0, 0, 0]), radius=0.0),
    ],
    ids=lambda capsule: capsule.name,
)
def test_links_without_length_or_thickness_are_links(capsule: LinkCapsule) -> None:
    """Each ends at the elbow, which swings on a circle of 1 m."""
    robot = planar(capsules=(capsule,))
    trajectory = Trajectory(robot, swing(-1, 1))
    for gap in (0.01, -0.0005):
        distance = 1 + capsule.radius + gap + 0.001
        setting = Setting(robot, Scene([Sphere((distance * np.cos(0.3), distance * np.sin(0.3), 0), 0.001)]))
        certificate = certify(setting, trajectory)
        assert certificate.status == ("holds" if gap > 0 else "fails")
        assert least_clearance(setting, trajectory, 2000, 0) == pytest.approx(gap, abs=5e-4)


def test_without_obstacles_or_links_nothing_is_in_the_way() -> None:
    bare = planar(capsules=(), collision="none")
    for robot, scene in ((planar(), Scene([])), (bare, Scene([Sphere((1, 0, 0), 0.5)]))):
        certificate = certify(Setting(robot, scene), Trajectory(robot, swing(-1, 1)))
        assert certificate.holds
        assert (certificate.clearance, certificate.closest, certificate.evaluations) == (np.inf, None, 0)
        assert certificate.as_dict()["clearance_m"] is None
        said = "nothing is in the way" if robot.capsules else "the robot is meant to have no envelope"
        assert certificate.message.startswith(said)


# ---- limits ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("broken", ["upper", "velocity", "acceleration"])
def test_the_limits_are_the_problems_whoever_made_the_trajectory(broken: str) -> None:
    generous = planar()
    strict = replace(generous, **{broken: getattr(generous, broken) * np.array([0.2, 1.0])})
    trajectory = Trajectory(generous, swing(-1, 1))
    certificate = certify(Setting(strict, Scene([])), trajectory)
    assert certificate.status == "fails"
    assert certificate.clearance is None
    assert not certificate.limits.holds
    assert re.match(r"joint 'shoulder' may (pass a position|exceed its \w+) limit", certificate.message)
    assert certify(Setting(generous, Scene([])), trajectory).holds


def test_broken_limits_outweigh_a_free_way() -> None:
    setting = stretched(0.3, 0.0)
    strict = replace(setting.robot, velocity=setting.robot.velocity / 2)
    certificate = certify(Setting(strict, setting.scene), Trajectory(setting.robot, swing(-1, 1)))
    assert certificate.status == "fails"


REFUSED: dict[str, Any] = {
    "another number of joints": lambda: certify(
        Setting(planar(), Scene([])), Trajectory(three_joints(), Motion(np.zeros((2, 3))))
    ),
    "a motion for a trajectory": lambda: certify(Setting(planar(), Scene([])), swing(0, 1)),  # type: ignore[arg-type]
}


def three_joints() -> Any:
    from spacearm.robot import Joint
    from support.small_robots import two_link

    arm = two_link()
    third = Joint(name="third", kind="revolute", parent=1, T_parent_joint=np.eye(4))
    limits = dict.fromkeys(("upper", "velocity", "acceleration"), (1, 1, 1)) | {"lower": (-1, -1, -1)}
    return two_link(joints=(*arm.joints, third), **limits)


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_proven_about_is_refused(case: str) -> None:
    assert_refused("proof", case, ProblemError, REFUSED[case])


# ---- the certificate -------------------------------------------------------------------------------------------------


def test_the_same_proof_gives_the_same_values() -> None:
    setting = stretched(0.01, 0.2)
    trajectory = Trajectory(setting.robot, swing(-1, 1))
    one, two = (certify(setting, trajectory) for _ in range(2))
    assert one.as_dict() == two.as_dict()
    assert one.evaluations > 1
    assert 0 < one.resolution < 1
    assert "pinocchio" in one.witness
    assert "coal" in one.witness


def test_the_numpy_oracle_is_coals() -> None:
    setting = Setting(planar(), Scene([Sphere((1, 1, 0.2), 0.3), Sphere((0, 0, 1), 0.1)]))
    q = np.random.default_rng(0).uniform(-3, 3, (50, 2))
    np.testing.assert_allclose(dense_clearances(setting, q), exact_clearances(setting, q), rtol=0, atol=1e-9)


@pytest.mark.parametrize("by", [1e-5, 1e-3])
def test_where_coal_measures_less_than_is_proven_nothing_is_believed(by: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two derivations that contradict each other, as if one of them had an error."""
    measured = CoalBodies.distance

    def less(*given: Any) -> Any:
        distance, points = measured(*given)
        return distance - by, points

    monkeypatch.setattr(CoalBodies, "distance", less)
    setting = stretched(0.3, 0.2)
    certificate = certify(setting, Trajectory(setting.robot, swing(-1, 1)))
    assert certificate.status == "undecided"
    assert certificate.clearance is None
