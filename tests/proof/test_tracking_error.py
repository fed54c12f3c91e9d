"""A tracking error: how it is read, and that what is proven of a tube is true of all trajectories in it."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError
from spacearm.geometry import Box, Scene, Sphere
from spacearm.motion import AnyTrajectory, Motion, Trajectory
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.checker import check_proof
from spacearm.proof.claim import Claim, claim_of
from spacearm.proof.finder import find_proof
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import required_clearance
from spacearm.proof.tracking import TubeReach, plain_tracking, tracking_as_dict, tracking_in_words, tracking_of
from spacearm.robot import Frame, Joint, LinkShape, Robot
from support.dense_samples import Setting, arms
from support.drawn_links import shaped_arms
from support.drawn_motions import motions_of
from support.drawn_shapes import obstacles
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames
from support.small_robots import CARRIAGE_RADIUS, slider, two_link

ROUNDING = 1e-7  # [m] Coal's and Pinocchio's, of arms a few metres long
INSTANTS = 12  # of each of the drawn trajectories


def with_followers() -> Robot:
    """A shoulder, an elbow that follows it twice as far, and a slide."""
    along_x = np.eye(4)
    along_x[0, 3] = 0.5
    return Robot(
        name="follower",
        joints=(
            Joint(name="shoulder", kind="revolute", parent=-1, T_parent_joint=np.eye(4), dof=0),
            Joint(name="elbow", kind="revolute", parent=0, T_parent_joint=along_x, dof=0, multiplier=-2.0),
            Joint(name="slide", kind="prismatic", parent=1, T_parent_joint=along_x, dof=1),
        ),
        shapes=(LinkShape(name="hand", joint=2, shape=Box((0.1, 0.2, 0.1), np.eye(4))),),
        frames=(Frame(name="tip", joint=2, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=(-2, -1),
        upper=(2, 1),
        velocity=(1, 1),
        acceleration=(1, 1),
    )


# ---- Reading ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (None, [0, 0]),
        (0.002, [0.002, 0.002]),
        (np.float64(0.002), [0.002, 0.002]),
        ({}, [0, 0]),
        ({"all": 0.002}, [0.002, 0.002]),
        ({"slide": 0.001}, [0, 0.001]),
        ({"slide": 0.001, "all": 0.002}, [0.002, 0.001]),
        ((("all", 0.002), ("shoulder", 0.0)), [0, 0.002]),
    ],
)
def test_a_tracking_error_is_read_by_joint(given: Any, expected: list[float]) -> None:
    np.testing.assert_array_equal(tracking_of(with_followers(), given), expected)


@pytest.mark.parametrize("given", [0.25, {"all": 0.002}, {"slide": 0.001}, {"slide": 0.001, "all": 0.002}])
def test_a_tracking_error_is_the_same_in_plain_values(given: Any) -> None:
    robot = with_followers()
    tracking = tracking_of(robot, given)
    np.testing.assert_array_equal(tracking_of(robot, tracking_as_dict(robot, tracking)), tracking)
    assert hash(plain_tracking(given)) == hash(plain_tracking(given))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (-0.001, "tracking is -0.001, expected a number from 0 up to 1000 [rad or m]"),
        (math.nan, "tracking is nan"),
        (math.inf, "tracking is inf"),
        (True, "tracking is True"),
        ("all", "tracking is 'all', expected a number"),
        ([0.001, 0.002], "tracking is [0.001, 0.002], expected a number"),
        ({"slide": -1.0}, "tracking of 'slide' is -1"),
        ({"slide": "1"}, "tracking of 'slide' is '1'"),
        ({3: 0.1}, "tracking names 3, expected the name of a joint"),
        ({"slid": 0.1}, "tracking names 'slid', which is no joint of robot 'follower'; did you mean 'slide'?"),
        ({"elbow": 0.1}, "tracking names the joint 'elbow', which follows 'shoulder' (mimic); name 'shoulder'"),
        ((("slide", 0.1), ("slide", 0.2)), "tracking names 'slide' twice"),
    ],
)
def test_a_wrong_tracking_error_is_refused(given: Any, said: str) -> None:
    with pytest.raises(ProblemError) as refused:
        tracking_of(with_followers(), given)
    assert str(refused.value).startswith(said)


def test_a_tracking_error_is_told_with_its_units() -> None:
    robot = with_followers()
    assert tracking_in_words(robot, tracking_of(robot, {"shoulder": 0.002, "slide": 0.001})) == "0.002 rad and 0.001 m"
    assert tracking_in_words(two_link(), np.array([0.002, 0.002])) == "0.002 rad"
    assert tracking_in_words(two_link(), np.array([0.002, 0.001])) == "0.002 rad ('elbow' 0.001 rad)"


# ---- What is proven is true ------------------------------------------------------------------------------------------


def claimed(setting: Setting, trajectory: AnyTrajectory, tracking: np.ndarray) -> Claim:
    """The claim of a trajectory with a tracking error."""
    base = begun_base_proof(setting.robot, trajectory, base_setup_of(setting, setting.robot, who="problem"))
    required = required_clearance(setting.robot, setting.scene, setting.clearance)
    return claim_of(setting.robot, setting.scene, base, PathIntervals(base.curve), required=required, tracking=tracking)


def proven(setting: Setting, trajectory: AnyTrajectory, tracking: np.ndarray) -> float | None:
    """The clearance that is proven with a tracking error; None if none is."""
    claim = claimed(setting, trajectory, tracking)
    proof = find_proof(claim).proof
    if proof is None:
        return None
    checked = check_proof(claim, proof)
    assert not checked.fault
    return float(checked.proven.min())


def corners(trajectory: AnyTrajectory, tracking: np.ndarray, u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Configurations at the corners of the tube, and within it, at instants."""
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=len(tracking))))
    within = rng.uniform(-1, 1, (4, len(tracking)))
    q = trajectory.curve.sample(u)
    return (q[:, None] + tracking * np.concatenate([signs, within])).reshape(-1, len(tracking))


@settings(max_examples=40)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_no_trajectory_in_a_proven_tube_has_less_than_is_proven(data: st.DataObject, seed: int) -> None:
    robot = data.draw(st.one_of(arms(self_pairs=True), shaped_arms(), st.just(with_followers())))
    setting = Setting(robot, Scene(data.draw(st.lists(obstacles(), min_size=1, max_size=3))), clearance=0.0)
    trajectory, rng = Trajectory(robot, data.draw(motions_of(robot, most=3))), np.random.default_rng(seed)
    errors = rng.uniform(0, 1, robot.dof)
    widest = 0.0
    for size in np.geomspace(1e-4, 1.0, 20):
        if proven(setting, trajectory, size * errors) is None:
            break
        widest = size
    tracking, least = widest * errors, proven(setting, trajectory, widest * errors)
    if least is None:
        return
    near = find_proof(claimed(setting, trajectory, tracking)).closest[0]
    u = np.append(rng.uniform(*trajectory.curve.domain, INSTANTS), [] if near is None else near.u)
    q = corners(trajectory, tracking, u, rng)
    assert least_distances(robot, setting.scene, joint_frames(robot, q)).min() >= least - ROUNDING


@settings(max_examples=30)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_bodies_get_no_further_in_a_tube_than_is_said(data: st.DataObject, seed: int) -> None:
    robot = data.draw(st.one_of(arms(), st.just(with_followers())))
    rng = np.random.default_rng(seed)
    tracking = rng.uniform(0, 0.1, robot.dof)
    q = rng.uniform(np.maximum(robot.lower, -3), np.minimum(robot.upper, 3))
    body, point = int(rng.integers(len(robot.joints))), rng.uniform(-0.3, 0.3, 3)
    own = [k for k in range(len(robot.joints)) if k == body or k in _parents(robot, body)]
    moves = np.isin(np.arange(len(robot.joints)), own)[None]
    T = joint_frames(robot, np.vstack([q, q + tracking * rng.choice([-1, 1], (50, robot.dof))]))
    x = np.einsum("rcd,d->rc", T[:, body, :3, :3], point) + T[:, body, :3, 3]
    said = TubeReach(robot, tracking).of(T[:1, : len(robot.joints)], x[:1, None], np.zeros(1), moves)
    assert np.linalg.norm(x[1:] - x[0], axis=1).max() <= said[0, 0] + 1e-12


def _parents(robot: Robot, joint: int) -> list[int]:
    out = []
    while robot.joints[joint].parent >= 0:
        joint = robot.joints[joint].parent
        out.append(joint)
    return out


# ---- And not silly ---------------------------------------------------------------------------------------------------


def carriage(gap: float) -> tuple[Setting, Trajectory]:
    """A ball that slides past another one, with a gap between them."""
    robot = slider()
    ball = Sphere((0.0, 0.0, 2 * CARRIAGE_RADIUS + gap), CARRIAGE_RADIUS)
    return Setting(robot, Scene([ball]), clearance=0.0), Trajectory(robot, Motion(np.array([(-1.0, 0.0), (1.0, 0.0)])))


@pytest.mark.parametrize(("share", "holds"), [(0.0, True), (0.9, True), (0.999, True), (1.001, False)])
def test_a_slide_may_be_off_by_the_gap_and_no_more(share: float, holds: bool) -> None:
    setting, trajectory = carriage(0.01)
    least = proven(setting, trajectory, np.array([0.0, share * 0.01]))
    assert (least is not None) == holds
    if least is not None:
        assert (1 - share) * 0.01 / 3 <= least <= (1 - share) * 0.01


def test_an_error_across_the_gap_takes_next_to_nothing() -> None:
    setting, trajectory = carriage(0.01)
    assert proven(setting, trajectory, np.array([0.005, 0.0])) is not None


def test_an_error_along_the_obstacle_is_no_error_toward_it() -> None:
    robot = two_link(shapes=(LinkShape(name="hand", joint=1, shape=Sphere((1.0, 0.0, 0.0), 0.05)),))
    floor = Sphere((2.0, 0.0, -0.11), 0.05)  # below the plane that the arm moves in
    setting = Setting(robot, Scene([floor]), clearance=0.0)
    trajectory = Trajectory(robot, Motion(np.array([(-0.3, 0.0), (0.3, 0.0)])))
    assert proven(setting, trajectory, np.array([0.003, 0.003])) is not None


def test_a_tube_makes_a_proof_little_longer() -> None:
    balls = tuple(LinkShape(name="carriage", joint=1, shape=Sphere((x, 0, 0), CARRIAGE_RADIUS)) for x in (-0.1, 0.0, 0.1))
    setting, trajectory = carriage(0.01)
    setting = setting._replace(robot=slider(*balls))
    exact, wide = (find_proof(claimed(setting, trajectory, np.array([0.0, error]))) for error in (0.0, 0.0099))
    assert exact.status == wide.status == "holds"
    assert wide.stretches < 3 * exact.stretches + 20
