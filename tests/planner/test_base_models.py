"""A third base model, made here alone, goes through trajectories, the proof and the planner: nobody asks for its name.

Ideal wheels keep the attitude of the base; its position moves so that the centre of mass of base and arm stays. The kernel
knows no such base yet: it searches as if the base stayed, and the proof judges what the search finds.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from house.source import PACKAGE, python_files, where
from spacearm.core.errors import ProblemError
from spacearm.core.native import native
from spacearm.core.rotations import quaternion_of
from spacearm.dynamics import BASE_MODELS, BaseModel, BaseTrack, JointPath, Momentum, center_of_mass, moments
from spacearm.dynamics.base_models import BaseDemands
from spacearm.dynamics.momentum import require_possible_masses
from spacearm.geometry import Scene, Sphere
from spacearm.motion import AnyTrajectory, Motion, RecordedTrajectory, Trajectory, time_optimal
from spacearm.motion.trajectory_values import trajectory_as_dict, trajectory_from_dict
from spacearm.planner import BaseLimits, PlannerSettings, Problem, plan
from spacearm.proof import BaseFindings, certify
from spacearm.proof.base_attitude import BaseAttitude
from spacearm.proof.base_momentum import BaseMotionBounds, FloatingBaseArrays, Reaction, masses_of, stated_elsewhere
from spacearm.proof.base_proofs import (
    BASE_PROOFS,
    BaseFigures,
    BaseProof,
    BaseSetup,
    asked_limits,
    broken_base_limits,
    link_frames,
    time_at,
)
from spacearm.robot import Robot, forward_kinematics
from spacearm.robot.unchecked_pairs import lacks_masses
from support.floating_arms import lander

NAME = "attitude_held"
START = np.array([[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, -0.25], [0.0, 0.0, 1.0, 2.0], [0.0, 0.0, 0.0, 1.0]])


# ---- the model ---------------------------------------------------------------------------------------------------------


class HeldTrack:
    """Where it is: as the centre of mass wants it, turned as at the start."""

    def __init__(self, robot: Robot, path: JointPath, start: np.ndarray) -> None:
        self.robot, self.path, self.start = robot, path, start
        self.first = center_of_mass(robot, path.sample(path.domain[0]))

    def pose(self, u: ArrayLike, /) -> tuple[np.ndarray, np.ndarray]:
        at = np.clip(u, *self.path.domain)
        moved = self.first - center_of_mass(self.robot, self.path.sample(at))
        position = moved @ self.start[:3, :3].T + self.start[:3, 3]
        return position, np.broadcast_to(quaternion_of(self.start[:3, :3]), (*np.shape(u), 4)).copy()

    def twist(self, u: ArrayLike, /) -> tuple[np.ndarray, np.ndarray]:
        rates = moments(self.robot, self.path.sample(u)).J_c @ self.path.sample(u, 1)[..., None]
        velocity = -rates[..., 0] @ self.start[:3, :3].T
        return velocity, np.zeros_like(velocity)

    def placed(self, u: ArrayLike, T_b_x: np.ndarray, /) -> np.ndarray:
        T = np.broadcast_to(self.start, T_b_x.shape).copy()
        T[..., :3, 3] = self.pose(u)[0]
        return T @ T_b_x


class AttitudeHeld(BaseModel):
    """Wheels keep the attitude; how much momentum they take up is what may be limited."""

    name, sentence = NAME, "Wheels hold the base's attitude."
    follows_arm = needs_masses = True
    keeps_momentum = takes_goal = False
    limits = ("joint_momentum",)

    def require(self, robot: Robot, momentum: Momentum) -> None:
        require_possible_masses(robot)
        assert momentum.is_zero

    def lacking(self, robot: Robot) -> str:
        return lacks_masses(robot)

    def track(self, robot: Robot, path: JointPath, *, start: np.ndarray, momentum: Momentum, duration: float) -> BaseTrack:
        return HeldTrack(robot, path, start)

    def kernel_masses(self, robot: Robot) -> None:
        return None

    def kernel_base(self, robot: Robot, momentum: Momentum, duration: float | None, demands: BaseDemands) -> native.FixedBase:
        return native.FixedBase(duration=duration or 0.0)


class AttitudeHeldProof(BaseProof):
    """The reaction of a floating base without its turn."""

    def __init__(self, robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> None:
        self.robot, self.trajectory, self.setup = robot, trajectory, setup
        self.curve = trajectory.curve

    def begin(self) -> None:
        self.masses, none = masses_of(self.robot), np.zeros(3)
        self.reaction = Reaction(self.robot, linear=none, angular=none, time_rate=0.0, attitude_error=0.0)
        start = self.setup.start
        self.center = start[:3, :3] @ self.center_of(link_frames(self, np.array(self.curve.domain[:1])))[0] + start[:3, 3]

    def placed(self, u: np.ndarray, frames: np.ndarray) -> np.ndarray:
        T = np.tile(self.setup.start, (len(u), 1, 1, 1))
        T[:, 0, :3, 3] = self.center - self.center_of(frames) @ self.setup.start[:3, :3].T
        return T @ frames

    def motion_bounds(self, frames: Any, rate: Any, deviation: Any, step: Any, half: Any) -> BaseMotionBounds:
        floating = self.reaction.bounds_on(frames, rate, deviation, step, half)
        none = np.zeros(len(half))
        return replace(floating, omega=np.zeros((len(half), 3)), rotation=none, rotation_second_order=none)

    def for_finder(self) -> FloatingBaseArrays:
        """A base that holds its attitude is one that floats and has an infinite inertia; here a very large one."""
        masses, joints = self.masses, self.robot.joints
        base = masses.joint < 0
        begin, end = self.curve.domain
        return FloatingBaseArrays(
            parent=np.array([joint.parent for joint in joints], np.int32),
            revolute=np.array([joint.kind == "revolute" for joint in joints]),
            joint_of_body=masses.joint.astype(np.int32),
            mass=masses.mass,
            com=masses.com,
            inertia=np.where(base[:, None, None], 1e25 * np.eye(3), masses.inertia),
            greatest=masses.greatest,
            spread=masses.spread,
            base_least=1e25,
            ends=np.array([[begin, end]]),
            start=quaternion_of(self.setup.start[:3, :3])[None],
            coefficients=np.zeros((1, 1, 4)),
            begin=begin,
            center=self.center,
            velocity=np.zeros(3),
            angular=np.zeros(3),
            attitude_error=0.0,
        )

    def findings(self, limits: Any, frames_at: Any) -> BaseFindings:
        u, figures = np.linspace(*self.curve.domain, 65), self.figures()
        elsewhere = stated_elsewhere(*self.trajectory.base_pose(time_at(self, u)), frames_at(u)[:, -1])
        return BaseFindings(
            residual_momentum=0.0,
            elsewhere=elsewhere,
            error=0.0,
            rotation_final=0.0,
            rotation_peak=0.0,
            rate=0.0,
            joint_momentum=figures.joint_momentum,
            checked=asked_limits(limits),
            broken_limits=broken_base_limits(figures, limits),
        )

    def figures(self) -> BaseFigures:
        begin, end = self.curve.domain
        momentum = BaseAttitude(self.robot, self.curve, start=self.setup.start, angular=np.zeros(3)).joint_momentum()
        speed = (end - begin) / self.trajectory.duration
        return BaseFigures(error=0.0, final=0.0, peak=0.0, rate=0.0, joint_momentum=momentum * speed)

    def at_end(self) -> np.ndarray:
        position, _ = self.trajectory.base_pose(self.trajectory.duration)
        return np.block([[self.setup.start[:3, :3], position[:, None]], [np.eye(4)[3:]]])

    def turns_about_at_end(self) -> np.ndarray:
        return self.center

    def center_of(self, frames: np.ndarray) -> np.ndarray:
        at = frames[:, self.masses.joint]
        com = np.einsum("rbcd,bd->rbc", at[..., :3, :3], self.masses.com) + at[..., :3, 3]
        return np.einsum("b,rbc->rc", self.masses.mass, com) / self.masses.total


@pytest.fixture(autouse=True)
def _known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BASE_MODELS, NAME, AttitudeHeld())
    monkeypatch.setitem(BASE_PROOFS, NAME, AttitudeHeldProof)


def test_every_model_has_its_proof() -> None:
    assert BASE_MODELS.keys() == BASE_PROOFS.keys()
    assert all(name == model.name for name, model in BASE_MODELS.items())


def test_nobody_asks_for_a_models_name() -> None:
    """But those who read robot files; and a writer may leave out what is `fixed`, the default."""
    asks = re.compile(r"""\bbase ([=!]= "floating"|== "fixed")""")
    readers = {"robot", "doctor"}
    found = [
        f"{where(path)}: {line.strip()}"
        for path in python_files()
        if not readers & set(path.relative_to(PACKAGE).parts)
        for line in path.read_text(encoding="utf-8").splitlines()
        if asks.search(line)
    ]
    assert not found, "ask the base model: " + "; ".join(found)


# ---- trajectories --------------------------------------------------------------------------------------------------------

ROBOT = lander()
PATH = Motion([[-0.5, 1.0], [0.8, -1.0], [1.4, 0.2]])
MADE: dict[str, Any] = {
    "uniform": lambda **held: Trajectory(ROBOT, PATH, **held),
    "time-optimal": lambda **held: replace(time_optimal(ROBOT, PATH), **held),
    "recorded": lambda **held: RecordedTrajectory(ROBOT, Trajectory(ROBOT, PATH).path, **held),
}
ALL = pytest.mark.parametrize("name", MADE)


def held(name: str) -> AnyTrajectory:
    return MADE[name](base=NAME, base_start=START)


@ALL
def test_the_centre_of_mass_stays_and_the_attitude_too(name: str) -> None:
    trajectory = held(name)
    t = np.linspace(0, trajectory.duration, 30)
    position, attitude = trajectory.base_pose(t)
    centers = position + center_of_mass(ROBOT, trajectory.sample(t).q) @ START[:3, :3].T
    np.testing.assert_allclose(centers, centers[:1].repeat(30, axis=0), atol=1e-12)
    assert np.abs(position - position[0]).max() > 0.1  # it does move
    assert (attitude == quaternion_of(START[:3, :3])).all()


@ALL
def test_its_rate_is_the_derivative_of_its_pose(name: str) -> None:
    trajectory, h = held(name), 1e-6
    t = np.linspace(0.1, 0.9, 7) * trajectory.duration
    velocity, turning = trajectory.base_rate(t)
    differences = (trajectory.base_pose(t + h)[0] - trajectory.base_pose(t - h)[0]) / (2 * h)
    np.testing.assert_allclose(velocity, differences, atol=1e-7)
    assert not turning.any()


@ALL
def test_it_comes_back_from_plain_values(name: str) -> None:
    trajectory = held(name)
    again = trajectory_from_dict(ROBOT, trajectory_as_dict(trajectory))
    assert again.base == NAME
    np.testing.assert_array_equal(again.tip(0.5), trajectory.tip(0.5))


# ---- the proof -------------------------------------------------------------------------------------------------------------


def least_distance(trajectory: AnyTrajectory, scene: Scene, t: np.ndarray) -> float:
    """The least clearance [m] of the links from balls at instants (m,), in NumPy."""
    robot, q = trajectory.robot, trajectory.sample(t).q
    hand = forward_kinematics(robot, q, frame="hand") @ np.linalg.inv(robot.frame("hand").T_joint_frame)
    shoulder = np.zeros((len(t), 4, 4))
    shoulder[:] = np.eye(4)
    shoulder[:, 0, 0] = shoulder[:, 1, 1] = np.cos(q[:, 0])
    shoulder[:, 1, 0], shoulder[:, 0, 1] = np.sin(q[:, 0]), -np.sin(q[:, 0])
    frames = {0: shoulder, 1: hand, -1: np.tile(np.eye(4), (len(t), 1, 1))}
    least = np.inf
    for link in robot.capsules:
        T = trajectory.base_track.placed(trajectory._along(t)[0], frames[link.joint])
        a, b = (T[:, :3, :3] @ end + T[:, :3, 3] for end in (link.a, link.b))
        for ball in scene.obstacles:
            assert isinstance(ball, Sphere)
            along = ((ball.center - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1)
            nearest = a + np.clip(along, 0, 1)[:, None] * (b - a)
            least = min(least, float(np.linalg.norm(nearest - ball.center, axis=1).min()) - link.radius - ball.radius)
    return least


@ALL
@pytest.mark.parametrize("seed", range(4))
def test_its_certificates_are_right(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    trajectory = held(name)
    scene = Scene([Sphere(START[:3, 3] + rng.uniform(1.2, 2.4) * _direction(rng), 0.1) for _ in range(3)])
    problem = Problem(ROBOT, scene, start=PATH.control_points[0], goal=PATH.control_points[-1], base=NAME, base_start=START)
    certificate = certify(problem, trajectory)
    t = np.linspace(0, trajectory.duration, 400)
    least = least_distance(trajectory, scene, t)
    assert certificate.base == NAME
    assert certificate.status in ("holds", "fails")
    if certificate.holds:
        assert certificate.clearance is not None
        assert 0 < certificate.clearance <= least + 1e-9
        assert certificate.closest is not None
        assert certificate.closest.clearance == pytest.approx(least, abs=2e-3)
    else:
        assert least < 2e-3
    assert certificate.base_findings is not None
    assert certificate.base_findings.elsewhere < 1e-9


def _direction(rng: np.random.Generator) -> np.ndarray:
    v = np.append(rng.normal(size=2), 0.0)
    return v / np.linalg.norm(v)


def test_the_wheels_momentum_may_be_limited_and_an_angle_not() -> None:
    def problem(**limits: float) -> Problem:
        start, goal = PATH.control_points[0], PATH.control_points[-1]
        return Problem(ROBOT, [], start=start, goal=goal, base=NAME, base_start=START, base_limits=BaseLimits(**limits))

    trajectory = held("uniform")
    assert certify(problem(joint_momentum=1e3), trajectory).holds
    certificate = certify(problem(joint_momentum=1e-2), trajectory)
    assert certificate.fails_by_base_limits
    assert "the arm's momentum reaches" in certificate.message
    with pytest.raises(ProblemError, match="base_limits"):
        problem(peak=0.1)


# ---- the planner -------------------------------------------------------------------------------------------------------------


def test_a_plan_is_found_proven_and_reported() -> None:
    scene = Scene([Sphere((0.3, 1.9, 0.0), 0.15)])
    problem = Problem(ROBOT, scene, start=(-0.5, 0.5), goal=(1.2, 0.8), base=NAME)
    found = plan(problem, PlannerSettings(evaluations=3000), rng=0)
    assert found.found, found.message
    assert found.trajectory is not None
    assert found.certificate is not None
    assert (found.trajectory.base, found.certificate.base) == (NAME, NAME)
    assert found.base is not None
    assert (found.base.final, found.base.peak, found.base.rate) == (0.0, 0.0, 0.0)
    assert found.base.joint_momentum > 0
