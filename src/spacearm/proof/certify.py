"""The proof of a trajectory, from outside."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from spacearm.core.checks import as_number, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.core.identity_cache import kept
from spacearm.dynamics.base_models import BASE_MODELS
from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory, RecordedTrajectory, Trajectory
from spacearm.motion.recorded import for_robot
from spacearm.proof.base_setup import BaseFindings, BaseSetup, base_setup_of, require_same
from spacearm.proof.base_track import BaseProof, FixedBaseProof, base_proof, own_parameter, time_at
from spacearm.proof.certificate import Certificate, ClosestApproach, Limit, broken_limits
from spacearm.proof.intervals import Proof, Status
from spacearm.proof.separation import Near
from spacearm.robot import Robot
from spacearm.robot.unchecked_pairs import UncheckedPair, bare_links, lacks_envelope, unchecked_pairs

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
        trajectory: of that robot and that base, ours or anybody's. Its joints go by their names: another order is put right,
            and noted. Where the base floats its motion is integrated anew, from the masses and the joints' path; what the
            trajectory itself says of it is compared.
        limits: those to be kept, of "position", "velocity" and "acceleration". A path with corners has no acceleration.
        jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: jerk is not looked at.
        minimum_clearance: the clearance must be more than this [m]; of pairs that cannot meet (`robot.apart`) more than 0.
        resolution: intervals shorter than this share of the curve, all its pieces counting alike, are not halved again;
            "undecided" is said then.

    Returns:
        The certificate. It never says that a motion holds when it does not; it may be undecided. docs/certificate.md says
        why.

    Raises:
        ProblemError: no trajectory, one of another robot (other joints, or joints elsewhere) or for another base, a setting
            out of its range, or numbers so large that their rounding outweighs any clearance.
        RobotError: a floating base of a robot whose masses cannot be.
    """
    if not isinstance(trajectory, (Trajectory, RecordedTrajectory)):
        raise ProblemError(f"trajectory is {shown(trajectory)}, expected a Trajectory; make one with Trajectory(robot, motion)")
    if not (isinstance(getattr(problem, "robot", None), Robot) and isinstance(getattr(problem, "scene", None), Scene)):
        raise ProblemError(f"problem is {shown(problem)}, expected a Problem, or what else has a robot and a scene")
    robot = problem.robot
    trajectory, notes = for_robot(trajectory, robot)
    setup = base_setup_of(problem, robot, who="problem")
    require_same(setup, base_setup_of(trajectory, robot, who="trajectory"))
    checked = _checked_limits(limits)
    minimum = as_number("minimum_clearance", minimum_clearance, ProblemError, at_least=0, unit="m")
    finest = as_number("resolution", resolution, ProblemError, above=0)
    begun = time.perf_counter()
    with np.errstate(over="ignore", invalid="ignore"):  # numbers without measure are told, not computed with
        base = base_proof(robot, trajectory, setup)
        proof = Proof(robot, problem.scene, base, minimum=minimum, resolution=finest)
        largest = proof.largest()
    if not largest <= _LARGEST:
        raise ProblemError(
            f"the robot, the scene or the path has a number of {largest:.4g}, expected at most {_LARGEST:g} [m or rad]: beyond "
            "it rounding outweighs any clearance"
        )
    margins = trajectory.margins(robot, jerk_limit=jerk_limit)  # the problem's limits, whoever made the trajectory
    checked = checked if jerk_limit is None else (*checked, "jerk")
    found: BaseFindings | None = None
    status: Status = "undecided"
    near: Near | None = None
    if not setup.model.lacking(robot):
        proof.begin()
        found = base.findings(getattr(problem, "base_limits", None), proof.frames_at)
        if found is None or found.followed:
            status, near = proof.judged()
    closest = None if near is None else _closest(near, robot, problem.scene, base)
    evaluations, shortest = proof.evaluations, proof.resolution
    if status == "holds" and robot.apart is not None:
        apart = _apart(robot, trajectory, finest)
        evaluations, shortest = evaluations + apart.evaluations, min(shortest, apart.resolution)
        if apart.status != "holds":
            status, closest = apart.status, apart.closest
        elif closest is not None and apart.closest is not None and apart.closest.clearance < proof.proven:
            notes = (*notes, _nearer(apart.closest))
    if status == "holds" and lacks_envelope(robot):
        status = "undecided"
    clear = status == "holds"
    disturbed = found is not None and found.followed and bool(found.broken_limits)
    if broken_limits(robot, margins, checked) or disturbed or (found is not None and found.broken):
        status = "fails"
    if getattr(trajectory, "contradictions", ()):  # its file states what is not so, and may be run by that
        status = "fails"
    return Certificate(
        status=status,
        clear=clear,
        clearance=proof.proven if status == "holds" else None,
        minimum_clearance=minimum,
        closest=closest,
        limits=margins,
        checked=checked,
        resolution=shortest,
        evaluations=evaluations,
        seconds=time.perf_counter() - begun,
        witness=proof.witness.name,
        robot=robot,
        scene=problem.scene,
        trajectory=trajectory,
        base_setup=setup,
        base_findings=found,
        unchecked=_unchecked(robot),
        bare=bare_links(robot),
        notes=notes,
    )


class _Apart(NamedTuple):
    """What became of the pairs of links that cannot meet within the limits."""

    status: Status
    closest: ClosestApproach | None
    evaluations: int
    resolution: float


def _apart(robot: Robot, trajectory: AnyTrajectory, finest: float) -> _Apart:
    """Prove that they do not meet, wherever the trajectory goes; how far they stay apart does not depend on the planner.

    Where the base goes does not matter to them.
    """
    bones = _with_apart_only(robot)
    still = BaseSetup(model=BASE_MODELS["fixed"], start=np.eye(4), linear=np.zeros(3), angular=np.zeros(3))
    base = FixedBaseProof(bones, trajectory, still)
    proof = Proof(bones, Scene(), base, minimum=0.0, resolution=finest, worth=0.0)
    proof.begin()
    status, near = proof.judged()
    closest = None if near is None else _closest(near, bones, Scene(), base)
    return _Apart(status, closest, proof.evaluations, proof.resolution)


def _nearer(near: ClosestApproach) -> str:
    """Say that pairs of which no clearance is claimed come nearer than the clearance that is."""
    return (
        f"link '{near.link}' and {near.other} come nearer, {near.clearance * 1e3:.3g} mm as measured: they cannot meet within "
        "the limits, and of such links it is only proven that they do not"
    )


@kept
def _with_apart_only(robot: Robot) -> Robot:
    assert robot.apart is not None
    links = {link for pair in robot.apart.pairs for link in pair}
    capsules = tuple(capsule for capsule in robot.capsules if capsule.name in links)
    return replace(robot, capsules=capsules, self_pairs=robot.apart.pairs, apart=None)


@kept
def _unchecked(robot: Robot) -> tuple[UncheckedPair, ...]:
    return unchecked_pairs(robot)


def _closest(near: Near, robot: Robot, scene: Scene, base: BaseProof) -> ClosestApproach:
    obstacle = near.obstacle
    return ClosestApproach(
        link=robot.capsules[near.capsule].name,
        other=f"link '{robot.capsules[near.other].name}'" if obstacle is None else f"obstacle {scene.called(obstacle)}",
        obstacle=obstacle,
        time=float(time_at(base, np.array(near.u))),
        u=own_parameter(base, near.u),
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
