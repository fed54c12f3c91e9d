"""The certificate of a base that floats: whoever forgets the base, or any part of its motion, is told apart here."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError, RobotError
from spacearm.dynamics import Momentum
from spacearm.geometry import Box, Cylinder, Obstacle, Scene, Sphere
from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory
from spacearm.planner import BaseLimits
from spacearm.proof import Certificate, certify
from spacearm.proof.certificate import problem_digest
from spacearm.robot import Robot
from support.drawn_motions import motions_of
from support.drawn_shapes import obstacles
from support.floating_arms import Adrift, along, body, floating_arms, frames_of, lander, line, wheel
from support.messages import assert_refused
from support.oracles.coal_shapes import distance, placed_capsule, placed_obstacle

ROUNDING = 1e-7  # [m] Coal's, and of the brute force's attitude over some metres
INSTANTS = 25

SWING = Motion([[-1.0, 0.5], [1.5, -0.5]])
TURN = Motion([[0.0], [4.0]])  # of the wheel: a quarter of it goes to the base, backwards
SHARE = 1 / 4


def judged(setting: Adrift, motion: Motion, **options: Any) -> Certificate:
    made = Trajectory(
        setting.robot,
        motion,
        base=setting.base,  # type: ignore[arg-type]
        base_start=setting.base_start,
        momentum=setting.momentum,
        **{name: options.pop(name) for name in ("duration", "time_law") if name in options},
    )
    return certify(setting, made, **options)


def measured(setting: Adrift, q: np.ndarray, T_w_b: np.ndarray) -> np.ndarray:
    """The least clearances (rows,) of a robot whose base is at T_w_b (rows, 4, 4), by Coal."""
    robot = setting.robot
    solids = [shape for obstacle in setting.scene.obstacles for shape in placed_obstacle(obstacle)]
    names = [link.name for link in robot.capsules]
    pairs = [
        (i, k)
        for one, other in robot.self_pairs
        for i, a in enumerate(names)
        for k, b in enumerate(names)
        if (a, b) == (one, other)
    ]
    out = []
    for T in frames_of(robot, q, T_w_b):
        links = [
            placed_capsule(*(T[c.joint, :3, :3] @ end + T[c.joint, :3, 3] for end in (c.a, c.b)), c.radius)
            for c in robot.capsules
        ]
        found = [distance(link, solid) for link in links for solid in solids] + [distance(links[i], links[k]) for i, k in pairs]
        out.append(min(found, default=np.inf))
    return np.array(out)


def where_it_turns(robot: Robot, share: float, link: int, at: float) -> np.ndarray:
    """A point of a link's axis, so far from end a to b, on the way of SWING, in the inertial frame; by brute force."""
    setting = Adrift(robot, Scene([]))
    way = along(setting, Trajectory(robot, SWING))
    i = round(share * (len(way.u) - 1))
    capsule = robot.capsules[link]
    T = frames_of(robot, way.q[i : i + 1], way.T_w_b[i : i + 1])[0, capsule.joint]
    return T[:3, :3] @ (capsule.a + at * (capsule.b - capsule.a)) + T[:3, 3]


# ---- what a fixed base would say -----------------------------------------------------------------------------------------


def test_what_is_free_with_a_fixed_base_collides_when_it_is_let_go() -> None:
    robot = lander()
    hit = Sphere(where_it_turns(robot, 0.7, 0, 0.9), 0.01)  # where the panel gets to
    assert judged(Adrift(robot, Scene([hit]), base="fixed"), SWING).holds
    certificate = judged(Adrift(robot, Scene([hit])), SWING)
    assert certificate.status == "fails"
    assert certificate.closest is not None
    assert certificate.closest.link == "panel"
    assert certificate.base == "floating"


def test_what_collides_with_a_fixed_base_may_be_free_when_it_is_let_go() -> None:
    robot = lander()
    at_the_end = np.array([np.cos(1.5) + np.cos(1.0), np.sin(1.5) + np.sin(1.0), 0.0])
    hit = Sphere(at_the_end, 0.05)
    assert judged(Adrift(robot, Scene([hit]), base="fixed"), SWING).status == "fails"
    assert judged(Adrift(robot, Scene([hit])), SWING).holds


def test_a_base_of_a_great_mass_is_as_good_as_fixed() -> None:
    heavy = lander(mass=1e9, moment=1e9)
    scene = Scene([Sphere((0.5, 2.1, 0), 0.2), Box((0.2, 0.2, 0.2), (1.7, -1.9, 0.1))])
    floating, fixed = judged(Adrift(heavy, scene), SWING), judged(Adrift(heavy, scene, base="fixed"), SWING)
    assert floating.holds
    assert floating.clearance == pytest.approx(fixed.clearance, abs=1e-6)
    assert floating.base_rotation_peak < 1e-7  # type: ignore[operator]


# ---- what the base itself meets ----------------------------------------------------------------------------------------------

THIN: dict[str, Any] = {
    "a sheet": lambda p: Box((0.001, 0.5, 0.5), p),
    "a wire": lambda p: Cylinder(0.0005, 1.0, p),
    "a pea": lambda p: Sphere(p, 0.0005),
}


@pytest.mark.parametrize("thing", THIN)
@settings(max_examples=15)
@given(share=st.floats(0.1, 0.9), at=st.floats(0.3, 1), link=st.integers(0, 2))
def test_what_is_1_mm_thin_is_hit_wherever_it_stands_in_the_way(thing: str, share: float, at: float, link: int) -> None:
    robot = lander()
    certificate = judged(Adrift(robot, Scene([THIN[thing](where_it_turns(robot, share, link, at))])), SWING)
    assert certificate.status == "fails"


@settings(max_examples=25)
@given(at=st.floats(0.02, 0.98), gap=st.sampled_from([-1e-5, 0.0, 1e-6, 1e-3]))
def test_a_panel_that_is_turned_by_a_flywheel_touches_what_it_touches(at: float, gap: float) -> None:
    """The panel's ball goes along a circle of 1 m: an obstacle outside of it is as far as it is."""
    angle = -TURN.sample(1.0)[0] * SHARE * at
    ball = Sphere(np.array([np.cos(angle), np.sin(angle), 0]) * (1.05 + gap + 0.2), 0.2)
    certificate = judged(Adrift(wheel(), Scene([ball])), TURN)
    if gap < 0:
        assert certificate.status == "fails"
    elif gap == 0:
        assert certificate.status != "holds"
    else:
        assert certificate.holds
        assert 0.49 * gap - 2e-9 <= certificate.clearance <= gap  # type: ignore[operator]
        assert certificate.evaluations < 300


def test_a_panel_turns_no_further_than_momentum_takes_it() -> None:
    just_beyond = -4.0 * SHARE - 0.11  # [rad]; the ball reaches 0.05, the pea 0.05 of the panel's circle
    pea = Sphere((np.cos(just_beyond), np.sin(just_beyond), 0), 0.05)
    assert judged(Adrift(wheel(), Scene([pea])), TURN).holds
    assert judged(Adrift(wheel(moment=1.5), Scene([pea])), TURN).status == "fails"


def test_links_and_base_that_meet_do_so_wherever_the_base_is() -> None:
    """A pair of links needs no base motion: with a fixed base and a floating one the proof says the same."""
    for reach, status in ((3.3, "fails"), (2.0, "holds")):
        robot = lander(self_pairs=(("fore", "panel"),))
        fold = Motion([[0.0, 0.0], [reach, 0.3]])
        floating, fixed = (judged(Adrift(robot, Scene([]), base=base), fold) for base in ("floating", "fixed"))
        assert floating.status == fixed.status == status
        if status == "holds":
            assert floating.clearance == pytest.approx(fixed.clearance, rel=1e-6)
            assert floating.evaluations == fixed.evaluations


# ---- momentum --------------------------------------------------------------------------------------------------------


def resting() -> Motion:
    return Motion([[0.0], [0.0]])


def test_a_tumbling_spacecraft_turns_by_its_momentum_and_time() -> None:
    """4 kg m^2 with 0.4 N m s: 0.1 rad/s, whatever the wheel does, so in 20 s the panel gets to 2 rad."""
    momentum = Momentum(angular=(0, 0, 0.4))
    for angle, status in ((1.9, "fails"), (2.12, "holds"), (-0.12, "holds")):
        pea = Sphere((np.cos(angle), np.sin(angle), 0), 0.05)
        setting = Adrift(wheel(), Scene([pea]), momentum=momentum)
        assert judged(setting, resting(), duration=20.0).status == status
    later = Adrift(wheel(), Scene([Sphere((np.cos(2.12), np.sin(2.12), 0), 0.05)]), momentum=momentum)
    assert judged(later, resting(), duration=22.0).status == "fails"


@pytest.mark.parametrize("gap", [-1e-6, 1e-6])
def test_a_drifting_spacecraft_gets_as_far_as_its_momentum_and_time_take_it(gap: float) -> None:
    """11 kg with 1.1 N s: 0.1 m/s; in 10 s the panel's ball is 1 m further."""
    wall = Box((0.001, 2, 2), (1 + 0.05 + 1.0 + 0.0005 + gap, 0, 0))
    setting = Adrift(wheel(), Scene([wall]), momentum=Momentum(linear=(1.1, 0, 0)))
    certificate = judged(setting, resting(), duration=10.0)
    assert certificate.status == ("holds" if gap > 0 else "fails")
    assert certificate.base_rotation_peak == pytest.approx(0, abs=1e-12)


def test_with_momentum_the_time_law_counts() -> None:
    robot, momentum = lander(), Momentum(angular=(0, 0, 2.0))
    law = TimeLaw([0, 1], [[0, 0, 0.1, 0.2, 1, 1]])
    setting = Adrift(robot, Scene([Sphere((0, 5, 0), 0.1)]), momentum=momentum)
    slow = Trajectory(robot, SWING, duration=40.0, time_law=law, momentum=momentum)
    found = certify(setting, slow)
    same = certify(setting, RecordedTrajectory(robot, slow.path, momentum=momentum))
    other = judged(setting, SWING, duration=40.0)
    assert found.holds
    assert found.base_rotation_final == pytest.approx(same.base_rotation_final, abs=1e-9)
    assert abs(found.base_rotation_final - other.base_rotation_final) > 1e-2  # type: ignore[operator]
    assert found.closest is not None
    assert same.closest is not None
    assert found.closest.time == pytest.approx(slow.time_at(found.closest.u))
    assert found.closest.time == pytest.approx(same.closest.time, abs=1e-6)


# ---- a start elsewhere -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_robot_and_scene_moved_together_are_the_same_problem(base: str) -> None:
    T = np.eye(4)
    T[:3, :3] = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    T[:3, 3] = (3, -2, 7)
    at = np.array([0.3, 2.2, 0.05])
    robot = lander()
    here = judged(Adrift(robot, Scene([Sphere(at, 0.1)]), base=base), SWING)
    there = judged(Adrift(robot, Scene([Sphere(T[:3, :3] @ at + T[:3, 3], 0.1)]), base=base, base_start=T), SWING)
    assert here.holds
    assert there.holds
    assert here.clearance == pytest.approx(there.clearance, abs=1e-8)
    assert here.closest is not None
    assert there.closest is not None
    np.testing.assert_allclose(there.closest.points, here.closest.points @ T[:3, :3].T + T[:3, 3], atol=1e-6)
    astray = judged(Adrift(robot, Scene([Sphere(at, 0.1)]), base=base, base_start=T), SWING)
    assert astray.closest is not None
    assert astray.closest.clearance > 3


# ---- whatever is proven is true --------------------------------------------------------------------------------------


@settings(max_examples=30)
@given(st.data())
def test_what_is_proven_of_a_floating_robot_is_true(data: st.DataObject) -> None:
    robot = data.draw(floating_arms())
    momentum = data.draw(st.sampled_from([None, None, Momentum(linear=(0.2, 0, -0.3), angular=(0.03, -0.1, 0.07))]))
    setting = Adrift(robot, Scene(data.draw(st.lists(obstacles(), max_size=4))), momentum=momentum)
    if data.draw(st.booleans()):
        motion = data.draw(motions_of(robot, most=2))
        least = Trajectory(robot, motion, base="fixed").duration
        assume(least < 9)
        made: Any = Trajectory(robot, motion, momentum=momentum, duration=9.0)
    else:
        rows = np.random.default_rng(data.draw(st.integers(0, 9))).uniform(-1, 1, (4, robot.dof))
        made = RecordedTrajectory(robot, PiecewisePath.from_linear(np.arange(4), rows), momentum=momentum)
    certificate = certify(setting, made, limits=())
    near = certificate.closest
    assert certificate.residual_momentum < 1e-9  # type: ignore[operator]
    if near is None:
        assert certificate.holds
        return
    way = along(setting, made, steps=200)
    time = made.time_at(way.u) if momentum is None else way.u
    some = np.random.default_rng(0).choice(len(way.u), INSTANTS)
    least = measured(setting, way.q[some], way.T_w_b[some]).min()
    if certificate.holds:
        assert certificate.clearance is not None
        assert least >= certificate.clearance - ROUNDING
        return
    assert near.clearance < 1e-3
    nearby = np.argsort(np.abs(time - near.time))[:3]
    assert measured(setting, way.q[nearby], way.T_w_b[nearby]).min() < 0.3


# ---- the trajectory's own account ------------------------------------------------------------------------------------


class Bolted(Trajectory):
    """Says that its base floats, and stays where it was."""

    __slots__ = ()

    def base_pose(self, t: Any) -> Any:
        position, wxyz = super().base_pose(np.zeros_like(t))
        return position, wxyz

    def base_rate(self, t: Any) -> Any:
        return tuple(np.zeros_like(rate) for rate in super().base_rate(t))


class Shifted(Trajectory):
    """Moves its base well, elsewhere."""

    __slots__ = ()

    def base_pose(self, t: Any) -> Any:
        position, wxyz = super().base_pose(t)
        return position + np.array([1e-5, 0, 0]), wxyz


def test_a_base_motion_that_does_not_conserve_momentum_fails() -> None:
    setting = Adrift(lander(), Scene([]))
    honest = certify(setting, Trajectory(setting.robot, SWING))
    assert honest.holds
    assert honest.residual_momentum < 1e-12  # type: ignore[operator]
    bolted = certify(setting, Bolted(setting.robot, SWING))
    assert bolted.status == "fails"
    assert 0.1 < bolted.residual_momentum < 10  # type: ignore[operator]
    assert "does not conserve momentum" in bolted.message
    shifted = certify(setting, Shifted(setting.robot, SWING))
    assert shifted.status == "fails"
    assert "from where momentum takes it" in shifted.message


def test_the_base_rotation_is_told() -> None:
    certificate = judged(Adrift(wheel(), Scene([])), Motion([[0.0], [2.0], [3.0], [1.0]]))
    assert certificate.base_rotation_final == pytest.approx(SHARE, abs=1e-9)
    motion = Motion([[0.0], [2.0], [3.0], [1.0]])
    peak = SHARE * np.abs(motion.sample(np.linspace(0, 1, 4001))).max()
    assert peak <= certificate.base_rotation_peak <= peak * (1 + 1e-5)  # type: ignore[operator]
    assert certificate.base_error < 1e-9  # type: ignore[operator]
    fixed = judged(Adrift(wheel(), Scene([]), base="fixed"), motion)
    for name in ("base_rotation_final", "base_rotation_peak", "base_error", "residual_momentum"):
        assert getattr(fixed, name) is None


def test_limits_of_the_base_are_proven_for_every_instant() -> None:
    """The wheel's share of 1/4 goes to the base: the quintic's greatest rate is 15/8 of the mean."""
    robot, duration = wheel(), 8.0
    made = Trajectory(robot, TURN, duration=duration)
    reached = {"final": 1.0, "peak": 1.0, "rate": 15 / 8 / duration, "joint_momentum": 4 * 15 / 8 / duration}
    for name, most in reached.items():
        setting = Limited(robot, Scene([Sphere((0, 5, 0), 0.1)]), BaseLimits(**{name: most * (1 + 1e-5)}))
        assert certify(setting, made).holds
        strict = certify(setting._replace(base_limits=BaseLimits(**{name: most * (1 - 1e-7)})), made)
        assert strict.status == "fails"
        assert strict.fails_by_base_limits
        assert strict.clearance is None
        assert "more than" in strict.message
        assert strict.as_dict()["base"]["limits_broken"] == [strict.message]
        assert strict.as_dict()["base"]["limits_checked"] == [name]
    law = TimeLaw([0, 1], [[0, 0.2, 0.4, 1]])
    slow = replace(made, time_law=law, duration=30.0)
    t = np.linspace(0, 30, 20_001)
    rate = np.abs(slow.sample(t).dq).max() / 4
    found = certify(Limited(robot, Scene([]), BaseLimits(rate=rate * (1 + 1e-5))), slow)
    assert found.holds
    assert found.base_findings is not None
    assert rate <= found.base_findings.rate <= rate * (1 + 1e-5)


class Limited(NamedTuple):
    robot: Robot
    scene: Scene
    base_limits: BaseLimits
    base: str = "floating"
    clearance: float = 0.0


def test_a_base_that_cannot_be_followed_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spacearm.proof.base_attitude._MOST_EVALUATIONS", 20_000)  # no number would do
    wild = PiecewisePath([0, 1], [np.outer((-1.0) ** np.arange(40), [1e5, 1e5])])
    certificate = certify(Adrift(lander(), Scene([Sphere((0, 9, 0), 0.1)])), RecordedTrajectory(lander(), wild), limits=())
    assert certificate.status == "undecided"
    assert "where the base turns to is known" in certificate.message


def test_the_file_of_a_fixed_base_is_as_it_was() -> None:
    robot, scene = lander(), Scene([Sphere((0, 5, 0), 0.1)])
    fixed = judged(Adrift(robot, scene, base="fixed"), SWING)
    keys = "spacearm-certificate status message clearance_m required_clearance_m required_by_pair closest near_pairs limits"
    assert list(fixed.as_dict()) == [
        *keys.split(),
        "not_checked",
        "remarks",
        "resolution",
        "evaluations",
        "witness",
        "problem_hash",
        "trajectory_hash",
    ]
    assert fixed.problem_hash == judged(Adrift(replace(robot, base="fixed"), scene, base="fixed"), SWING).problem_hash
    floating = judged(Adrift(robot, scene), SWING)
    assert floating.problem_hash != fixed.problem_hash
    assert floating.as_dict()["base"]["rotation_final_rad"] == pytest.approx(floating.base_rotation_final, abs=5e-10)
    start = np.eye(4)
    start[0, 3] = 1.0
    others = [Adrift(robot, scene, base_start=start), Adrift(robot, scene, momentum=Momentum(linear=(1, 0, 0)))]
    hashes = {floating.problem_hash, *(judged(other, SWING, duration=9.0).problem_hash for other in others)}
    assert len(hashes) == 3
    assert problem_digest(robot, scene, fixed.base_setup) == fixed.problem_hash


def test_what_is_recorded_says_no_more_than_what_was_proven() -> None:
    certificate = judged(Adrift(lander(), Scene([Sphere((0, 5, 0), 0.1)])), SWING)
    values = certificate.as_dict()
    assert certificate.clearance is not None
    assert certificate.base_error is not None
    assert certificate.residual_momentum is not None
    assert certificate.clearance - 1.1e-9 < values["clearance_m"] <= certificate.clearance
    for recorded, error, least in (
        ("attitude_error_at_most_rad", certificate.base_error, 1e-9),
        ("residual_momentum", certificate.residual_momentum, 1e-12),
    ):
        assert error <= values["base"][recorded] <= max(2 * error, least)
        assert float(f"{values['base'][recorded]:.0e}") == values["base"][recorded]  # one digit


# ---- refusals --------------------------------------------------------------------------------------------------------


def _elsewhere() -> np.ndarray:
    T = np.eye(4)
    T[2, 3] = 0.25
    return T


REFUSED: dict[str, tuple[Any, Any, Any]] = {
    "a trajectory of a fixed base": (ProblemError, {}, {"base": "fixed"}),
    "a trajectory of a floating base": (ProblemError, {"base": "fixed"}, {}),
    "another start": (ProblemError, {"base_start": _elsewhere()}, {}),
    "another start of a fixed base": (ProblemError, {"base": "fixed"}, {"base": "fixed", "base_start": _elsewhere()}),
    "another momentum": (ProblemError, {"momentum": Momentum(angular=(0, 0, 1))}, {"momentum": Momentum(angular=(0, 0, 2))}),
    "a momentum that the problem has not": (ProblemError, {}, {"momentum": Momentum(linear=(1, 0, 0))}),
    "a base that is neither": (ProblemError, {"base": "hovering"}, {}),
}


@pytest.mark.parametrize("case", REFUSED)
def test_another_base_is_refused(case: str) -> None:
    error, problem, trajectory = REFUSED[case]
    robot = lander()
    setting = Adrift(robot, Scene([]), **problem)
    made = Trajectory(robot, SWING, duration=9.0, **trajectory)
    assert_refused("proof", case, error, lambda: certify(setting, made))


@pytest.mark.parametrize(
    ("case", "bodies"),
    [
        ("no mass of the base", (body("arm", 0, 1.0, (0, 0, 0), 1.0),)),
        ("no inertia of the base", (body("base", -1, 1.0, (0, 0, 0), 0.0),)),
        ("a negative inertia", (body("base", -1, 1.0, (0, 0, 0), 1.0), body("arm", 0, 1.0, (0, 0, 0), (1, 1, -0.1)))),
        ("a mass beyond measure", (body("base", -1, 1e13, (0, 0, 0), 1.0),)),
    ],
)
def test_masses_that_cannot_be_are_refused(case: str, bodies: Any) -> None:
    from spacearm.proof.base_momentum import masses_of

    assert_refused("proof", case, RobotError, lambda: masses_of(lander(bodies=bodies)))


def test_the_obstacles_of_a_robot_without_masses_are_those_of_a_fixed_base() -> None:
    bare = lander(bodies=(), base="fixed")
    ball: list[Obstacle] = [Sphere((0, 5, 0), 0.1)]
    assert judged(Adrift(bare, Scene(ball), base="fixed"), SWING).holds
    assert line("x", -1, (0, 0, 0), (1, 0, 0), 0.1).joint == -1


# ---- laws that dwell -------------------------------------------------------------------------------------------------


KNOTTED = Motion([[0, 0], [0.5, 0.2], [1.0, 0.0]])


@pytest.mark.parametrize(("middle", "motions"), [(0.2, [SWING]), (0.5, [SWING, KNOTTED]), (0.9, [KNOTTED])])
@pytest.mark.parametrize("momentum", [None, Momentum(linear=(0.3, 0, 0), angular=(0, 0.4, 2.0))])
def test_a_law_that_dwells_is_no_false_alarm(middle: float, motions: list[Motion], momentum: Momentum | None) -> None:
    """At a place between, and at a knot: from the place alone the time cannot be told, and the base turns on meanwhile."""
    law = TimeLaw([0, 0.2, 0.8, 1], [[0, 0, middle, middle], [middle] * 4, [middle, middle, 1, 1]])
    for motion in motions:
        slow = Trajectory(lander(), motion, duration=120.0, time_law=law, momentum=momentum)
        setting = Adrift(slow.robot, Scene([Sphere((0, 5, 0), 0.1)]), momentum=momentum)
        found = certify(setting, slow)
        assert found.holds, found.message
        same = certify(setting, RecordedTrajectory(slow.robot, slow.path, momentum=momentum), limits=())
        assert same.holds, same.message
        assert found.closest is not None
        assert same.closest is not None
        assert found.closest.clearance == pytest.approx(same.closest.clearance, abs=1e-4)
        if momentum is not None:
            assert found.closest.time == pytest.approx(same.closest.time, abs=1e-4)
            np.testing.assert_allclose(found.closest.points, same.closest.points, atol=1e-3)


def test_a_start_turned_slightly_far_from_the_origin_is_another_start() -> None:
    """The place may be a million metres away: that makes a turn of 1e-5 rad no smaller."""
    T, turned = np.eye(4), np.eye(4)
    T[0, 3] = turned[0, 3] = 1e6
    c, s = np.cos(1e-5), np.sin(1e-5)
    turned[:2, :2] = [[c, -s], [s, c]]
    robot = lander()
    setting = Adrift(robot, Scene([]), base_start=T)
    assert certify(setting, Trajectory(robot, SWING, base_start=T)).holds
    with pytest.raises(ProblemError, match="and 1e-05 rad"):
        certify(setting, Trajectory(robot, SWING, base_start=turned))
