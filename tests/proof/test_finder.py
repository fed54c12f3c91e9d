"""The native finder: what it calls a proof is one, what it calls a failure is one, and it finds what is there."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from spacearm.core.native_finder import native_finder
from spacearm.geometry import Box, HalfSpace, Scene, Sphere, SphereSet, pose
from spacearm.motion import AnyTrajectory, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.proof.checker import check_proof
from spacearm.proof.claim import Claim, NearEnd
from spacearm.proof.finder import Found, Suspect, find_proof
from support.dense_samples import planar, swing
from support.drawn_claims import Drawn, claim_about, drawn_claim
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames
from support.reference_finder import Measure

COAL = 1e-6  # [m] of a distance of bodies a few metres large
SHARE = 0.5
SEEDS = st.integers(0, 2**32 - 1)
SWING = swing(0.0, 1.5)


def measured(claim: Claim, suspect: Suspect) -> float:
    """What Coal says of a pair of the table."""
    u = np.array([suspect.u])
    own = joint_frames(claim.robot, claim.path.curve.sample(u))
    base = np.broadcast_to(np.eye(4), (1, 1, 4, 4))
    placed = claim.base.placed(u, np.concatenate([own, base], axis=1))[0]
    frames = [np.eye(4), placed[-1], *placed[:-1]]
    at = claim.bodies.frame
    return Measure(claim)(suspect.first, suspect.other, frames[at[suspect.first]], frames[at[suspect.other]])[0]


def held_at(claim: Claim, suspect: Suspect) -> tuple[float, int]:
    """What a pair is held to where it was measured, and its phase."""
    link, u = np.array([claim.bodies.owner[suspect.first]]), np.array([suspect.u])
    clearance, phase = claim.held.on(link, np.array([suspect.other]), u, u)
    return float(clearance[0]), int(phase[0])


def look_at(claim: Claim) -> Found:
    """Find a proof, check it, and compare what was measured with Coal."""
    found = find_proof(claim, proven_share=SHARE)
    for phase, suspect in enumerate(found.closest):
        if suspect is None:
            continue
        assert not claim.bodies.members[[suspect.first, suspect.other]].any()
        assert held_at(claim, suspect)[1] == phase
        coal = measured(claim, suspect)
        assert max(coal, 0.0) == pytest.approx(max(suspect.clearance, 0.0), abs=COAL)
    if found.status == "holds":
        assert found.proof is not None
        checked = check_proof(claim, found.proof)
        assert not checked.fault
        for phase, suspect in enumerate(found.closest[:-1]):
            if suspect is not None and not claim.held.near.any() and not claim.tracking.any():
                held = held_at(claim, suspect)[0]
                assert checked.proven[phase] - held >= SHARE * (suspect.clearance - held)
    elif found.status == "fails" and not claim.tracking.any():
        assert found.worst is not None
        assert measured(claim, found.worst) <= held_at(claim, found.worst)[0] + COAL
    return found


@settings(max_examples=60)
@given(SEEDS, st.sampled_from([1.0, 0.3, 0.05]), st.sampled_from([0.0, 0.01]))
def test_a_proof_that_is_found_is_one(seed: int, reach: float, clearance: float) -> None:
    look_at(drawn_claim(seed, reach=reach, clearance=clearance).claim)


@settings(max_examples=30)
@given(SEEDS, st.sampled_from([0.3, 0.05]))
def test_a_proof_that_is_found_is_one_on_a_floating_base(seed: int, reach: float) -> None:
    look_at(drawn_claim(seed, floating=True, reach=reach).claim)


@settings(max_examples=30)
@given(SEEDS, st.sampled_from([0.3, 0.05]))
def test_a_proof_that_is_found_is_one_in_a_tube(seed: int, reach: float) -> None:
    look_at(drawn_claim(seed, tracking=True, reach=reach).claim)


@settings(max_examples=20)
@given(SEEDS)
def test_what_never_comes_close_is_proven(seed: int) -> None:
    """By Coal, at many instants; between them less than a millimetre is lost."""
    drawn = drawn_claim(seed, reach=0.05)
    assume(drawn.claim.base.setup.at_origin)
    u = np.linspace(*drawn.trajectory.curve.domain, 400)
    least = least_distances(drawn.robot, drawn.scene, joint_frames(drawn.robot, drawn.trajectory.curve.sample(u))).min()
    found = find_proof(drawn.claim)
    if least > 1e-2:
        assert found.status == "holds"
    if found.status == "holds":
        assert found.proof is not None
        assert check_proof(drawn.claim, found.proof).proven.min() <= least + COAL


def swinging(scene: Scene, trajectory: AnyTrajectory | None = None) -> Claim:
    """The claim that a planar arm swings by a quarter turn and touches nothing."""
    return claim_about(planar(), scene, Trajectory(planar(), SWING) if trajectory is None else trajectory)


def test_nothing_in_the_way_is_proven_without_a_plane() -> None:
    found = find_proof(swinging(Scene([])))
    assert found.status == "holds"
    assert found.proof is not None
    assert len(found.proof.directions) == len(found.proof.steps) == found.nodes
    assert found.closest == (None, None)


def test_a_robot_without_shapes_needs_no_plane() -> None:
    robot = planar(capsules=())
    claim = claim_about(robot, Scene([Sphere([0.0, 0.0, 3.0], 1.0)]), Trajectory(robot, SWING))
    found = find_proof(claim)
    assert found.status == "holds"
    assert found.proof is not None
    assert not len(found.proof.steps)
    assert not check_proof(claim, found.proof).fault


def test_the_same_claim_has_the_same_proof_to_the_last_bit() -> None:
    for seed in (1, 4, 14, 25):
        one, other = (look_at(drawn_claim(seed, reach=0.05).claim) for _ in range(2))
        assert (one.proof is None) == (other.proof is None)
        if one.proof is not None and other.proof is not None:
            assert one.proof.as_dict() == other.proof.as_dict()


def test_threads_may_search_the_same_claim_at_once() -> None:
    claim = next(drawn.claim for drawn in drawn_floating() if find_proof(drawn.claim).proof is not None)
    alone = find_proof(claim).proof
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: find_proof(claim), range(40)):
            assert found.proof is not None
            assert alone is not None
            assert found.proof.as_dict() == alone.as_dict()


def drawn_floating() -> Iterator[Drawn]:
    return (drawn_claim(seed, floating=True, reach=0.1) for seed in range(100))


def test_a_half_space_is_kept_clear_of() -> None:
    below = HalfSpace([0.0, 0.0, 1.0], [0.0, 0.0, -0.2])
    assert look_at(swinging(Scene([below]))).status == "holds"
    assert look_at(swinging(Scene([replace(below, point=np.array([0.0, 0.0, 0.01]))]))).status == "fails"


def test_many_balls_take_little_more_than_few() -> None:
    rng = np.random.default_rng(3)
    centers = rng.normal(size=(20_000, 3)) * [3, 3, 1] + [0, 0, 4]
    found = look_at(swinging(Scene([SphereSet(centers, np.full(len(centers), 0.01))])))
    assert found.status == "holds"
    assert found.nodes < len(centers)


def test_a_path_of_ten_thousand_pieces_takes_little_more_than_a_smooth_one() -> None:
    t = np.linspace(0, 1, 10_001)
    q = np.stack([1.5 * (3 * t**2 - 2 * t**3), 0 * t], axis=1)
    ball = Scene([Sphere([0.2, 1.2, 0.6], 0.1)])
    rows = look_at(swinging(ball, RecordedTrajectory(planar(), PiecewisePath.from_linear(t, q))))
    smooth = look_at(swinging(ball, RecordedTrajectory(planar(), PiecewisePath.from_linear(t[::10], q[::10]))))
    assert rows.status == smooth.status == "holds"
    assert rows.stretches <= 2 * smooth.stretches


def test_polynomials_of_a_high_degree_are_evaluated() -> None:
    angles = np.outer(np.linspace(0, 1, 257) ** 2, [1.5, 0.3])
    path = PiecewisePath([0.0, 0.5, 2.0], np.stack([angles, angles[::-1]]))
    assert look_at(swinging(Scene([Sphere([0.2, 1.2, 0.6], 0.1)]), RecordedTrajectory(planar(), path))).status == "holds"


def touching(gap: float) -> Claim:
    """The claim of an arm whose first link passes a ball at a distance [m]."""
    robot = planar()
    radius = max(part.shape.radius for part in robot.shapes)
    return claim_about(robot, Scene([Sphere([0.5, 0.5, 0.2 + radius + gap], 0.2)]), Trajectory(robot, SWING))


def test_a_micrometre_is_proven_and_a_thousandth_of_it_undecided() -> None:
    assert look_at(touching(1e-6)).status == "holds"
    found = find_proof(touching(1e-9))
    assert found.status == "undecided"
    assert found.worst is not None
    assert 0 < measured(touching(1e-9), found.worst) < 1e-8
    assert found.proof is None
    assert look_at(touching(-1e-6)).status == "fails"


def test_the_worst_of_a_motion_that_fails_is_about_the_deepest() -> None:
    for size in (0.1, 0.4, 0.8):
        scene = Scene([Box([size, size, size], pose([0.9, 0.9, 0.03], [1.0, 0.2, 0.1, 0.4]))])
        claim = swinging(scene)
        found = find_proof(claim)
        assert found.status == "fails"
        assert found.worst is not None
        u = np.linspace(0, 1, 2000)
        deepest = least_distances(claim.robot, scene, joint_frames(claim.robot, claim.path.curve.sample(u))).min()
        assert measured(claim, found.worst) < 0.95 * deepest < 0


def test_what_would_need_shorter_stretches_is_undecided() -> None:
    found = find_proof(touching(1e-6), resolution=0.1)
    assert found.status == "undecided"
    assert found.worst is not None
    assert 0 < measured(touching(1e-6), found.worst) < 0.2


def test_a_pair_near_at_its_start_is_held_to_less_there() -> None:
    robot = planar()
    ball = Sphere([0.5, 0.0, 0.3], 0.2)
    trajectory = Trajectory(robot, SWING)
    alone = claim_about(robot, Scene([ball]), trajectory)
    has = min(one.clearance for one in find_proof(alone).closest if one is not None)
    assert find_proof(claim_about(robot, Scene([ball]), trajectory, has + 0.01)).status == "fails"
    near = tuple(
        NearEnd(link=i, other=0, required=has + 0.01, at_start=has, at_goal=np.inf, until=0.6, since=np.inf, room=1e-4)
        for i in range(len(alone.held.required))
    )
    claim = claim_about(robot, Scene([ball]), trajectory, has + 0.01, near=near)
    found = look_at(claim)
    assert found.status == "holds"
    assert found.proof is not None
    assert check_proof(claim, found.proof).proven[claim.held.full_phases].min() > has + 0.01


def test_arrays_that_do_not_fit_are_refused() -> None:
    claim = swinging(Scene([Sphere([0.2, 1.2, 0.6], 0.1)]))
    with pytest.raises(ValueError, match="arrays differ in their length"):
        find_proof(replace(claim, tracking=np.zeros(3)))
    with pytest.raises(TypeError):
        native_finder.find_proof(tables=None)  # pyright: ignore[reportCallIssue, reportArgumentType]
