"""The proof of a trajectory, from outside."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from spacearm.checks import as_number, shown
from spacearm.errors import ProblemError, nearest
from spacearm.motion import AnyTrajectory, RecordedTrajectory, Trajectory
from spacearm.proof.base import Base
from spacearm.proof.base_limits import asked, exceeded
from spacearm.proof.certificate import Certificate, ClosestApproach, FloatingBase, Limit, broken_limits
from spacearm.proof.intervals import Proof
from spacearm.proof.measuring import Near
from spacearm.proof.residual import account_of, instants_of
from spacearm.proof.stance import require_same, stance_of
from spacearm.robot import Robot
from spacearm.scene import Scene

LIMITS: tuple[Limit, ...] = ("position", "velocity", "acceleration")
RESOLUTION = 1e-7
_LARGEST = 1e6


class HasScene(Protocol):
    """Whatever has a robot and a scene; a Problem does.

    It may also have `base`, `base_start` and `momentum`: by default the base is as the robot says, at the origin, without. And
    `base_limits`, which a floating base has to keep at every instant.
    """

    @property
    def robot(self) -> Robot:
        """What moves."""
        ...

    @property
    def scene(self) -> Scene:
        """What is in the way."""
        ...


def certify(
    problem: HasScene,
    trajectory: AnyTrajectory,
    *,
    limits: Sequence[Limit] = LIMITS,
    jerk_limit: ArrayLike | None = None,
    minimum_clearance: float = 0.0,
    resolution: float = RESOLUTION,
) -> Certificate:
    """Prove that a trajectory keeps clear of the obstacles, of the robot itself, and within the limits for all t.

    Args:
        problem: the robot, the pairs of its links that must keep clear, the scene, how the base is held, and how little a
            floating one may be disturbed.
        trajectory: of that robot and that base, ours or anybody's. Where the base floats its motion is integrated anew, from
            the masses and the joints' path; what the trajectory itself says of it is compared.
        limits: those to be kept, of "position", "velocity" and "acceleration". A path with corners has no acceleration.
        jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: jerk is not looked at.
        minimum_clearance: the clearance must be more than this [m].
        resolution: intervals shorter than this share of the curve, all its pieces counting alike, are not halved again;
            "undecided" is said then.

    Returns:
        The certificate. It never says that a motion holds when it does not; it may be undecided. docs/certificate.md says
        why.

    Raises:
        ProblemError: no trajectory, one of another number of joints or for another base, a setting out of its range, or
            numbers so large that their rounding outweighs any clearance.
        RobotError: a floating base of a robot whose masses cannot be.
    """
    if not isinstance(trajectory, (Trajectory, RecordedTrajectory)):
        raise ProblemError(f"trajectory is {shown(trajectory)}, expected a Trajectory; make one with Trajectory(robot, motion)")
    robot, curve = problem.robot, trajectory.curve
    if curve.dof != robot.dof:
        raise ProblemError(f"the trajectory moves {curve.dof} joints, expected the {robot.dof} of robot '{robot.name}'")
    stance = stance_of(problem, robot, who="problem")
    require_same(stance, stance_of(trajectory, robot, who="trajectory"))
    checked = _checked_limits(limits)
    minimum = as_number("minimum_clearance", minimum_clearance, ProblemError, at_least=0, unit="m")
    finest = as_number("resolution", resolution, ProblemError, above=0)
    begun = time.perf_counter()
    with np.errstate(over="ignore", invalid="ignore"):  # numbers without measure are told, not computed with
        base = Base(robot, trajectory, stance)
        proof = Proof(robot, problem.scene, base, minimum=minimum, resolution=finest)
        largest = proof.largest()
    if not largest <= _LARGEST:
        raise ProblemError(
            f"the robot, the scene or the path has a number of {largest:.4g}, expected at most {_LARGEST:g} [m or rad]: beyond "
            "it rounding outweighs any clearance"
        )
    margins = trajectory.margins(robot, jerk_limit=jerk_limit)  # the problem's limits, whoever made the trajectory
    checked = checked if jerk_limit is None else (*checked, "jerk")
    proof.begin()
    floating = _floating(problem, trajectory, proof, base)
    status, near = proof.judged() if floating is None or floating.followed else ("undecided", None)
    clear = status == "holds"
    disturbed = floating is not None and floating.followed and bool(floating.broken_limits)
    if broken_limits(robot, margins, checked) or disturbed or (floating is not None and floating.broken):
        status = "fails"
    return Certificate(
        status=status,
        clear=clear,
        clearance=proof.proven if status == "holds" else None,
        minimum_clearance=minimum,
        closest=None if near is None else _closest(near, robot, problem.scene, base),
        limits=margins,
        checked=checked,
        resolution=proof.resolution,
        evaluations=proof.evaluations,
        seconds=time.perf_counter() - begun,
        witness=proof.witness.name,
        robot=robot,
        scene=problem.scene,
        trajectory=trajectory,
        stance=stance,
        floating=floating,
    )


def _floating(problem: HasScene, trajectory: AnyTrajectory, proof: Proof, base: Base) -> FloatingBase | None:
    """Return what is to be said about a base, None if it is fixed."""
    if base.drift is None:
        return None
    u = instants_of(base)
    account = account_of(problem.robot, trajectory, base, u, proof.frames_at(u)[:, -1])
    figures, limits = base.figures(), getattr(problem, "base_limits", None)
    return FloatingBase(
        residual_momentum=account.residual,
        elsewhere=account.elsewhere,
        error=figures.error,
        rotation_final=figures.final,
        rotation_peak=figures.peak,
        rate=figures.rate,
        joint_momentum=figures.joint_momentum,
        checked=asked(limits),
        broken_limits=exceeded(figures, limits),
    )


def _closest(near: Near, robot: Robot, scene: Scene, base: Base) -> ClosestApproach:
    obstacle, u = near.obstacle, base.own_parameter(near.u)
    return ClosestApproach(
        link=robot.capsules[near.capsule].name,
        other=f"link '{robot.capsules[near.other].name}'" if obstacle is None else f"obstacle {scene.called(obstacle)}",
        obstacle=obstacle,
        time=float(base.times(np.array([near.u]))[0]),
        u=u,
        clearance=near.clearance,
        points=near.points,
    )


def _checked_limits(limits: Sequence[Limit]) -> tuple[Limit, ...]:
    if isinstance(limits, str) or not isinstance(limits, Sequence):
        raise ProblemError(f"limits is {shown(limits)}, expected some of {', '.join(LIMITS)}, as in limits=('position',)")
    for limit in limits:
        if limit not in LIMITS:
            raise ProblemError(f"limits names {shown(limit)}, which is none; {nearest(str(limit), LIMITS)}")
    return tuple(limit for limit in LIMITS if limit in limits)
