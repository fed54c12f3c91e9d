"""What other checks miss: thin things between samples, grazes, turns, slides, mimics, other planners' paths."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Scene, Sphere, SphereSet
from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory
from spacearm.proof import Certificate, certify
from spacearm.proof.path_intervals import PathIntervals
from spacearm.robot import Joint, LinkCapsule, Robot
from support.bounded_paths import parts
from support.dense_samples import Setting, planar, swing

ANGLES = st.floats(-0.95, 0.95)


def facing(angle: float, distance: float, height: float = 0.0) -> np.ndarray:
    """A pose whose x points away from the shoulder, so far from it."""
    c, s = np.cos(angle), np.sin(angle)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = [distance * c, distance * s, height]
    return T


def turntable(radius: float = 0.05, **changes: Any) -> Robot:
    """One joint that turns without end and carries a ball 1 m out."""
    ball = LinkCapsule(name="ball", joint=0, a=np.array([1.0, 0, 0]), b=np.array([1.0, 0, 0]), radius=radius)
    limits = {"lower": (-np.inf,), "upper": (np.inf,), "velocity": (1.0,), "acceleration": (1.0,)}
    return planar(
        **{"joints": planar().joints[:1], "capsules": (ball,), "tip": "base"} | limits | changes, frames=planar().frames[:1]
    )


def recorded(robot: Robot, *rows: tuple[float, ...]) -> RecordedTrajectory:
    """Straight from row to row, one a second."""
    return RecordedTrajectory(robot, PiecewisePath.from_linear(np.arange(len(rows)), rows))


def judged(robot: Robot, obstacles: list[Obstacle], trajectory: Any, **options: Any) -> Certificate:
    return certify(Setting(robot, Scene(obstacles)), trajectory, **{"limits": (), **options})


# ---- thin things -----------------------------------------------------------------------------------------------------

THIN: dict[str, Any] = {
    "a sheet across the way": lambda at: Box((0.8, 0.001, 1.0), facing(at, 1.5)),
    "a sheet that the fingertips touch": lambda at: Box((0.02, 0.001, 0.02), facing(at, 2.05)),
    "a wire": lambda at: Cylinder(0.0005, 1.0, facing(at, 1.7)),
    "a wire with round ends": lambda at: Capsule(*(facing(at, 1.7, z)[:3, 3] for z in (-0.5, 0.5)), 0.0005),
    "a pea": lambda at: Sphere(facing(at, 1.3, 0.0495)[:3, 3], 0.001),
    "a row of peas": lambda at: SphereSet([facing(at, r, 0.0495)[:3, 3] for r in (1.1, 1.2, 1.3)], [0.001] * 3),
}


@pytest.mark.parametrize("case", THIN)
@settings(max_examples=25)
@given(at=ANGLES)
def test_what_is_1_mm_thin_is_hit_wherever_it_stands(case: str, at: float) -> None:
    robot = planar()
    for trajectory in (Trajectory(robot, swing(-1, 1)), recorded(robot, (-1, 0), (1, 0))):
        certificate = judged(robot, [THIN[case](at)], trajectory)
        assert certificate.status == "fails"
        assert certificate.closest is not None
        assert certificate.closest.link == "fore"
        q = trajectory.sample(certificate.closest.time).q
        assert abs(q[0] - at) < 0.1


def test_a_line_without_thickness_is_stopped_by_a_pea_and_a_thread() -> None:
    bare = planar(capsules=(LinkCapsule(name="line", joint=1, a=np.zeros(3), b=np.array([1.0, 0, 0]), radius=0.0),))
    for thing in (Sphere((1.5, 0, 0), 0.001), Cylinder(0.0005, 1.0, (1.5, 0, 0)), Box((0.001, 0.001, 1), (1.5, 0, 0))):
        assert judged(bare, [thing], Trajectory(bare, swing(-1, 1.1))).status == "fails"


# ---- grazes ----------------------------------------------------------------------------------------------------------

REACH = 1.05
SHAPES: dict[str, Any] = {
    "sphere": lambda at, gap: Sphere(facing(at, REACH + 0.1 + gap)[:3, 3], 0.1),
    "capsule": lambda at, gap: Capsule(*(facing(at, REACH + 0.1 + gap, z)[:3, 3] for z in (-1, 1)), 0.1),
    "box, by a face": lambda at, gap: Box((0.2, 0.2, 0.2), facing(at, REACH + 0.1 + gap)),
    "cylinder, by its side": lambda at, gap: Cylinder(0.1, 0.4, facing(at, REACH + 0.1 + gap)),
    "half-space": lambda at, gap: HalfSpace(-facing(at, 1)[:3, 0], facing(at, REACH + gap)[:3, 3]),
    "sphere set": lambda at, gap: SphereSet([facing(at, REACH + 0.1 + gap)[:3, 3], (5, 5, 5)], [0.1, 0.1]),
}


@pytest.mark.parametrize("shape", SHAPES)
@settings(max_examples=25)
@example(at=0.20792066761153616)  # the first look falls within a nanometre of where they begin to touch
@given(at=ANGLES)
def test_touching_never_holds_nor_does_a_graze(shape: str, at: float) -> None:
    robot = turntable()
    trajectory = Trajectory(robot, Motion([[-1.0], [1.0]]))
    assert judged(robot, [SHAPES[shape](at, 0.0)], trajectory).status != "holds"
    assert judged(robot, [SHAPES[shape](at, -1e-5)], trajectory).status == "fails"
    certificate = judged(robot, [SHAPES[shape](at, 1e-4)], trajectory)
    assert certificate.holds
    assert certificate.clearance is not None
    assert 0.49e-4 < certificate.clearance <= 1e-4


@pytest.mark.parametrize("shape", SHAPES)
def test_touching_at_an_end_never_holds(shape: str) -> None:
    robot = turntable()
    for end in (-1.0, 1.0):
        obstacle = SHAPES[shape](end, 0.0)
        assert judged(robot, [obstacle], Trajectory(robot, Motion([[-1.0], [1.0]]))).status != "holds"
        assert judged(robot, [obstacle], recorded(robot, (-1.0,), (1.0,))).status != "holds"


# ---- turns -----------------------------------------------------------------------------------------------------------


def test_a_wrapped_angle_means_what_it_says() -> None:
    """From 3.1 to -3.1 is a long way round, past what stands at 0; unwrapped it is a short one."""
    robot, post = turntable(), Cylinder(0.05, 1.0, (1.0, 0, 0))
    assert judged(robot, [post], recorded(robot, (3.1,), (-3.1,))).status == "fails"
    assert judged(robot, [post], recorded(robot, (3.1,), (2 * np.pi - 3.1,))).holds


@pytest.mark.parametrize("turns", [1, 20, 100])
def test_many_turns_are_all_looked_at(turns: int) -> None:
    """A carriage that rises as it turns meets a pea on its last turn only."""
    rise = Joint(name="rise", kind="prismatic", parent=0, T_parent_joint=np.eye(4))
    robot = turntable(
        joints=(planar().joints[0], rise),
        capsules=(LinkCapsule(name="ball", joint=1, a=np.array([1.0, 0, 0]), b=np.array([1.0, 0, 0]), radius=0.001),),
        **dict.fromkeys(("upper", "velocity", "acceleration"), (np.inf, 9.0)) | {"velocity": (1, 1), "acceleration": (1, 1)},
        lower=(-np.inf, 0.0),
    )
    trajectory = recorded(robot, (0.0, 0.0), (2 * np.pi * turns, 0.01 * turns))
    on_the_last = Sphere((np.cos(0.3), -np.sin(0.3), 0.01 * (turns - 0.3 / 2 / np.pi)), 0.001)
    assert judged(robot, [on_the_last], trajectory).status == "fails"
    beside_it = Sphere((np.cos(0.3), -np.sin(0.3), 0.01 * (turns - 0.3 / 2 / np.pi) + 0.004), 0.001)
    assert judged(robot, [beside_it], trajectory).holds


# ---- slides and mimics -----------------------------------------------------------------------------------------------


def slider(**changes: Any) -> Robot:
    """A slide along x whose rod reaches 1 m further; with `dof=0` a second one on it follows the first."""
    along_x = np.eye(4)
    along_x[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    joints = [Joint(name="slide", kind="prismatic", parent=-1, T_parent_joint=along_x)]
    if changes:
        joints.append(Joint(name="follower", kind="prismatic", parent=0, T_parent_joint=np.eye(4), dof=0, **changes))
    rod = LinkCapsule(name="rod", joint=len(joints) - 1, a=np.zeros(3), b=np.array([0, 0, 1.0]), radius=0.01)
    return turntable(joints=tuple(joints), capsules=(rod,), lower=(-5.0,), upper=(5.0,))


@pytest.mark.parametrize("multiplier", [None, 1.0, 3.0, -0.5])
@given(gap=st.sampled_from([-1e-6, 1e-6, 1e-3]))
def test_a_slide_stops_where_the_wall_is(multiplier: float | None, gap: float) -> None:
    robot = slider() if multiplier is None else slider(multiplier=multiplier, offset=0.25)
    tip = 2.0 + 1.01 + (0.0 if multiplier is None else 2.0 * multiplier + 0.25)
    wall = Box((0.001, 2, 2), (tip + gap + 0.0005, 0, 0))
    certificate = judged(robot, [wall], Trajectory(robot, Motion([[0.0], [2.0]])))
    assert certificate.status == ("holds" if gap > 0 else "fails")


# ---- itself ----------------------------------------------------------------------------------------------------------


def folding(*pairs: tuple[str, str]) -> Robot:
    """Three links of 1 m in the plane; the hand can be folded back onto the upper arm."""
    shift = planar().joints[1].T_parent_joint
    joints = (*planar().joints, Joint(name="wrist", kind="revolute", parent=1, T_parent_joint=shift))
    links = tuple(
        LinkCapsule(name=name, joint=i, a=np.array([0.2, 0, 0]), b=np.array([0.8, 0, 0]), radius=0.05)
        for i, name in enumerate(("upper", "fore", "hand"))
    )
    limits = {"lower": (-4.0,) * 3, "upper": (4.0,) * 3, "velocity": (1.0,) * 3, "acceleration": (1.0,) * 3}
    return planar(joints=joints, capsules=links, self_pairs=pairs, **limits)


def test_an_arm_that_folds_onto_itself_fails_where_its_links_must_keep_clear() -> None:
    fold = Motion([[0, 0.0, 0.0], [0.5, 5 * np.pi / 6, 5 * np.pi / 6]])
    watched = folding(("hand", "upper"))
    certificate = judged(watched, [], Trajectory(watched, fold))
    assert certificate.status == "fails"
    near = certificate.closest
    assert near is not None
    assert (near.link, near.other, near.obstacle) == ("hand", "link 'upper'", None)
    assert "link 'hand' and link 'upper'" in certificate.message
    free = folding()
    assert judged(free, [], Trajectory(free, fold)).holds


def test_turning_the_whole_arm_costs_self_collision_nothing() -> None:
    robot = folding(("hand", "upper"))
    pose = (2 * np.pi / 3 - 0.35, 2 * np.pi / 3)  # the hand ends a few millimetres before the upper arm
    certificate = judged(robot, [], Trajectory(robot, Motion([[-3, *pose], [3, *pose]])))
    assert certificate.holds
    assert certificate.evaluations < 20
    assert certificate.closest is not None
    assert certificate.clearance == pytest.approx(certificate.closest.clearance, rel=0.01)


# ---- many obstacles --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("together", [True, False])
def test_thousands_of_spheres_are_no_trouble(together: bool) -> None:
    robot = planar()
    rng = np.random.default_rng(0)
    centers = rng.uniform(-3, 3, (3000, 3))
    centers = centers[np.abs(centers[:, 2]) > 0.2]
    spheres: list[Obstacle] = [Sphere(center, 0.05) for center in centers]
    trajectory = Trajectory(robot, swing(-1, 1, 0.5))
    scene = [SphereSet(centers, np.full(len(centers), 0.05))] if together else spheres
    certificate = judged(robot, scene, trajectory)
    assert certificate.holds
    assert certificate.evaluations < 500
    hit = judged(robot, [*scene, Sphere((1.3, 0.4, 0), 0.001)], trajectory)
    assert hit.status == "fails"
    assert hit.closest is not None
    assert hit.closest.obstacle == len(scene)


# ---- other planners' paths -------------------------------------------------------------------------------------------


def test_a_path_that_is_free_at_its_waypoints_fails_between_them() -> None:
    robot = planar()
    zigzag = recorded(robot, (-1, 0.3), (-0.4, -0.3), (0.4, 0.3), (1, 0))
    between = Sphere((1.99, 0.0, 0), 0.05)  # where the arm passes stretched
    assert judged(robot, [between], zigzag).status == "fails"
    away = Sphere((2.4, 0.0, 0), 0.05)
    assert judged(robot, [away], zigzag).holds


def test_corners_break_the_acceleration_limit_unless_it_is_left_out() -> None:
    robot = planar()
    zigzag = recorded(robot, (-0.4, 0.3), (0.1, -0.3), (0.4, 0.3))
    whole = judged(robot, [], zigzag, limits=("position", "velocity", "acceleration"))
    assert whole.status == "fails"
    assert "no finite acceleration" in whole.message
    assert len(whole.broken_limits) == 2
    assert judged(robot, [], zigzag, limits=("position", "velocity")).holds
    smooth = RecordedTrajectory(robot, PiecewisePath.from_cubic([0, 2, 4], [(-0.4, 0.3), (0.1, -0.3), (0.4, 0.3)]))
    assert judged(robot, [], smooth, limits=("position", "velocity", "acceleration")).holds
    assert not judged(robot, [], smooth, limits=(), jerk_limit=0.5).holds


def test_a_path_of_many_rows_takes_no_more_looks_than_a_smooth_one() -> None:
    robot = planar()
    smooth = Trajectory(robot, swing(-1, 1))
    t = np.linspace(0, smooth.duration, 5001)
    rows = RecordedTrajectory(robot, PiecewisePath.from_linear(t, smooth.sample(t).q))
    ball: list[Obstacle] = [Sphere((2.2, 0.3, 0), 0.1)]
    one, other = (judged(robot, ball, trajectory) for trajectory in (smooth, rows))
    assert one.holds
    assert other.holds
    assert other.evaluations < 3 * one.evaluations
    assert one.closest is not None
    assert other.closest is not None
    assert one.closest.time == pytest.approx(other.closest.time, abs=0.05)


def test_a_leap_within_microseconds_is_looked_at_like_any_other_piece() -> None:
    """A file's two rows with almost the same time: the arm crosses the ball between them."""
    robot = planar()
    t = [0.0, 1.0, 1.0 + 2e-6, 2.0]
    rows = [(-0.5, 0), (-0.4, 0), (0.4, 0), (0.5, 0)]
    path = PiecewisePath.from_linear(t, rows)
    leap = RecordedTrajectory(robot, path)
    assert judged(robot, [Sphere((1.8, 0, 0), 0.01)], leap).status == "fails"
    assert judged(robot, [Sphere((2.3, 0, 0), 0.1)], leap).holds


# ---- asking for more -------------------------------------------------------------------------------------------------


def test_more_clearance_can_be_asked_for() -> None:
    robot = turntable()
    trajectory = Trajectory(robot, Motion([[-1.0], [1.0]]))
    ball = SHAPES["sphere"](0.3, 0.1)
    for wanted in (0.0, 0.05, 0.0999):
        certificate = judged(robot, [ball], trajectory, clearance=wanted)
        assert certificate.holds
        assert certificate.clearance is not None
        assert wanted < certificate.clearance <= 0.1
    for wanted in (0.1001, 0.5):
        certificate = judged(robot, [ball], trajectory, clearance=wanted)
        assert certificate.status == "fails"
        assert "expected more than" in certificate.message
    assert judged(robot, [ball], trajectory, clearance=0.1).status != "holds"


def test_a_coarse_resolution_is_undecided_sooner() -> None:
    robot = turntable()
    trajectory = Trajectory(robot, Motion([[-1.0], [1.0]]))
    touching = SHAPES["box, by a face"](0.3, 1e-8)
    coarse, fine = (judged(robot, [touching], trajectory, resolution=r) for r in (0.1, 1e-6))
    assert (coarse.status, fine.status) == ("undecided", "holds")
    assert coarse.evaluations < fine.evaluations


@pytest.mark.parametrize(
    "options",
    [
        {"limits": "position"},
        {"limits": ("speed",)},
        {"limits": 3},
        {"clearance": -1e-9},
        {"clearance": np.nan},
        {"resolution": 0.0},
        {"jerk_limit": 0.0},
        {"jerk_limit": "much"},
    ],
)
def test_settings_that_cannot_be_are_refused(options: dict[str, Any]) -> None:
    robot = turntable()
    with pytest.raises(ProblemError):
        judged(robot, [], Trajectory(robot, Motion([[-1.0], [1.0]])), **options)


# ---- numbers of several sizes ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("other", [0.0, 9.9e5])
def test_a_stair_of_steps_that_are_rounding_beside_another_joint_is_a_motion(other: float) -> None:
    """The shoulder creeps into a pea in steps of 1.4e-8 rad, 4,000 a way, off the middle of a run of pieces."""
    robot = planar(lower=(-4.0, -np.inf), upper=(4.0, np.inf))
    count, at, step = 24_000, 5_300, 1.4e-8
    shoulder = np.zeros(count)
    shoulder[at : at + 4000] = step * np.arange(4000)
    shoulder[at + 4000 : at + 8000] = step * (4000 - np.arange(4000))
    if not other:  # without the larger number beside it each step is a jump
        points = np.stack([np.stack([shoulder, np.zeros(count)], axis=1)] * 2, axis=1)
        with pytest.raises(ProblemError, match=r"jumps by 1\.4e-08"):
            RecordedTrajectory(robot, PiecewisePath(np.arange(count + 1) * 1e-4, points))
        return
    points = np.stack([np.stack([shoulder, np.full(count, other)], axis=1)] * 2, axis=1)
    made = RecordedTrajectory(robot, PiecewisePath(np.arange(count + 1) * 1e-4, points))
    pea = Sphere((0.9, 0.05 + 0.01 + 2e-5, 0), 0.01)
    bare = planar(capsules=robot.capsules[:1], lower=(-4.0, -np.inf), upper=(4.0, np.inf))
    certificate = judged(bare, [pea], made)
    assert certificate.status == "fails"
    assert certificate.closest is not None
    assert certificate.closest.clearance == pytest.approx(2e-5 - 0.9 * 4000 * step, abs=2e-6)
    slow = planar(velocity=(1e-4, 1.0), lower=(-4.0, -np.inf), upper=(4.0, np.inf))
    assert judged(slow, [], made, limits=("velocity",)).status == "fails"


def test_coefficients_of_great_size_between_small_values_are_allowed_their_rounding() -> None:
    """Of degree 40, up and down by 1e6, and nearly 0 in the middle."""
    robot = turntable()
    wild = 1e6 * (-1.0) ** np.arange(41)
    path = PiecewisePath([0, 1], wild[None, :, None])
    cut = PathIntervals(path)
    assert cut.linear_bounds(parts(cut)).deviation.min() >= 1e-8
    assert judged(robot, [], RecordedTrajectory(robot, path)).holds


# ---- time laws -------------------------------------------------------------------------------------------------------


def test_a_leap_in_a_share_of_the_time_that_is_rounding_is_looked_at() -> None:
    """Out and back within 3e-5 of 30 s: within no limit; with others that allow it, where it is."""
    x, q = 0.51, [[-1.0, 0.0], *[[1.0, 0.0]] * 10, [-1.0, 0.0]]
    law = TimeLaw([0, x, x + 1e-6, 1], [[0, 0.004, 0.01, 0.01], [0.01, 0.01, 0.99, 0.99], [0.99, 0.99, 0.996, 1]])
    with pytest.raises(ProblemError, match="duration is 30 s, expected at least"):
        Trajectory(planar(), Motion(q), time_law=law, duration=30.0)
    quick = planar(velocity=(1e7, 1e7), acceleration=(1e14, 1e14))
    made = Trajectory(quick, Motion(q), time_law=law, duration=30.0)
    told = made.limits.velocity[0] * quick.velocity[0]
    u = 30 * x + np.linspace(0, 3e-5, 4001)
    assert told >= 0.99 * np.abs(np.gradient(made.sample(u).q[:, 0], u)).max()
    assert judged(planar(), [], made, limits=("velocity",)).status == "fails"
    assert judged(quick, [Sphere((1.5, 0, 0), 0.1)], made).status == "fails"


# ---- what is broken --------------------------------------------------------------------------------------------------


def test_the_worst_broken_limit_is_named_first() -> None:
    """By the share of it that is too much, whichever joint or limit it is."""
    t = np.linspace(0, 1, 6)
    q = np.column_stack([0.2 * t, 3 * t])
    made = RecordedTrajectory(planar(), PiecewisePath.from_cubic(t, q))
    robot = planar(velocity=(0.1, 1.0), acceleration=(100.0, 100.0), lower=(-1, -1), upper=(0.19, 1.0))
    certificate = judged(robot, [], made, limits=("position", "velocity", "acceleration"))
    broken = certificate.broken_limits
    assert certificate.message == f"{broken[0]} (and {len(broken) - 1} more)"
    assert broken[0].startswith("joint 'elbow' may exceed its velocity limit")
    assert broken[1].startswith("joint 'elbow' may pass a position limit by 2 rad")
    assert broken[2].startswith("joint 'shoulder' may exceed its velocity limit")
    assert broken[3].startswith("joint 'shoulder' may pass a position limit by 0.01 rad")
    corner = judged(
        robot, [], RecordedTrajectory(planar(), PiecewisePath.from_linear(t, q**2)), limits=("velocity", "acceleration")
    )
    assert "has no finite acceleration" in corner.message
