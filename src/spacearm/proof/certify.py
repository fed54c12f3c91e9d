"""The proof of a trajectory: `certify` checks its input, proves clearance, checks the limits, and states the result.

Nothing of the search is used. The steps are in the other modules of this room: where the base goes (`base_proofs`), whether all
pairs of bodies keep apart (`interval_search`), and what is stated about it (`certificate`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from spacearm.core.checks import as_number, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.core.identity_cache import cached_by_identity
from spacearm.dynamics.base_models import BASE_MODELS
from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory, LimitMargins, RecordedTrajectory, Trajectory
from spacearm.motion.recorded import for_robot
from spacearm.proof.base_proofs import (
    BaseFindings,
    BaseProof,
    BaseSetup,
    FixedBaseProof,
    base_proof,
    base_setup_of,
    own_parameter,
    require_same,
    time_at,
)
from spacearm.proof.certificate import Certificate, ClosestApproach, Limit, NearPair, broken_limits
from spacearm.proof.interval_search import ClearanceProof, Status
from spacearm.proof.required_clearance import (
    DEFAULT_CLEARANCE,
    PairClearance,
    RequiredClearance,
    as_pair_clearances,
    required_clearance,
)
from spacearm.proof.separation import NearestPair
from spacearm.robot import Robot
from spacearm.robot.unchecked_pairs import UncheckedPair, bare_links, lacks_envelope, unchecked_pairs

LIMITS: tuple[Limit, ...] = ("position", "velocity", "acceleration")
RESOLUTION = 1e-7
_LARGEST = 1e6  # [m or rad] the rounding of larger numbers, 1e-10 of them, is larger than a clearance worth proving


class HasScene(Protocol):
    """An object with a robot and a scene, such as a Problem.

    It may also have `clearance`, the clearance that is required [m], and `clearances`, a row of `PairClearance`. Defaults:
    `DEFAULT_CLEARANCE`, and none. It may have `base`, `base_start` and `momentum`. Defaults: the robot's base model, the
    identity, no momentum. It may have `base_limits`, which a floating base has to keep at every instant.
    """

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        ...

    @property
    def scene(self) -> Scene:
        """The obstacles."""
        ...


def certify(
    problem: HasScene,
    trajectory: AnyTrajectory,
    *,
    limits: Sequence[Limit] = LIMITS,
    jerk_limit: ArrayLike | None = None,
    clearance: float | None = None,
    resolution: float = RESOLUTION,
    minimum_clearance: None = None,
) -> Certificate:
    """Prove that a trajectory keeps clear of the obstacles and of the robot itself, and within the limits, for all t.

    Each pair of bodies has to keep its required clearance, or more than 0 where 0 is required. A pair that has less at the
    start or the goal is held to what it has there until it gets out; `required_clearance` has the rule.

    Args:
        problem: the robot, the pairs of its links that must keep clear, the scene, the clearances required, how the base is
            held, and how much a floating base may be disturbed.
        trajectory: of that robot and that base, of spacearm or of another program. Its joints are matched by their names:
            another order is corrected, and noted. The motion of a floating base is integrated anew, from the masses and the
            joints' path. What the trajectory itself states of its base is compared.
        limits: those to be kept, of "position", "velocity" and "acceleration". A path with corners has no acceleration.
        jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: jerk is not checked.
        clearance: that is required of all pairs without a value of their own in `problem.clearances` [m]; None: the problem's.
            Pairs that cannot meet (`robot.apart`) have to keep more than 0, or their own value.
        resolution: intervals shorter than this share of the curve, all its pieces counting alike, are not halved. The
            certificate is undecided then.
        minimum_clearance: former name; no longer taken.

    Returns:
        The certificate. It never says that a motion holds when it does not; it may be undecided. docs/certificate.md has the
        proofs.

    Raises:
        ProblemError: no trajectory, one of another robot (other joints, or joints elsewhere) or for another base, a setting
            out of its range, or numbers so large that their rounding is larger than any clearance.
        RobotError: a floating base of a robot whose masses are impossible.
    """
    if not isinstance(trajectory, (Trajectory, RecordedTrajectory)):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise ProblemError(f"trajectory is {shown(trajectory)}, expected a Trajectory; make one with Trajectory(robot, motion)")
    if not (isinstance(getattr(problem, "robot", None), Robot) and isinstance(getattr(problem, "scene", None), Scene)):
        raise ProblemError(f"problem is {shown(problem)}, expected a Problem, or what else has a robot and a scene")
    robot = problem.robot
    trajectory, notes = for_robot(trajectory, robot)
    setup = base_setup_of(problem, robot, who="problem")
    require_same(setup, base_setup_of(trajectory, robot, who="trajectory"))
    checked = _checked_limits(limits)
    if minimum_clearance is not None:
        raise ProblemError(
            f"certify is given minimum_clearance {shown(minimum_clearance)}, which it no longer takes; give the problem its "
            "clearance, as in Problem(..., clearance=0.01), or certify(..., clearance=0.01)"
        )
    asked, by_pair = _asked(problem, clearance)
    finest = as_number("resolution", resolution, ProblemError, above=0)
    begun = time.perf_counter()
    base, proof = _prepared(
        problem, trajectory, setup, required=required_clearance(robot, problem.scene, asked, by_pair), finest=finest
    )
    margins = trajectory.margins(robot, jerk_limit=jerk_limit)  # the problem's limits, whoever made the trajectory
    checked = checked if jerk_limit is None else (*checked, "jerk")
    found = _clearance(problem, trajectory, base, proof, by_pair=by_pair, finest=finest)
    clear = found.status == "holds"
    kept = _limits_kept(robot, trajectory, margins, checked, found.base)
    return Certificate(
        status=found.status if kept else "fails",
        clear=clear,
        clearance=proof.proven_in_full if clear and kept else None,
        required=asked,
        required_by_pair=by_pair,
        closest=found.closest,
        near_pairs=_near_pairs(proof, robot, problem.scene, base, holds=clear and kept),
        limits=margins,
        checked=checked,
        resolution=found.resolution,
        evaluations=found.evaluations,
        seconds=time.perf_counter() - begun,
        witness=proof.witness.name,
        robot=robot,
        scene=problem.scene,
        trajectory=trajectory,
        base_setup=setup,
        base_findings=found.base,
        unchecked=_unchecked(robot),
        bare=bare_links(robot),
        notes=(*notes, *found.notes),
    )


def _asked(problem: HasScene, clearance: float | None) -> tuple[float, tuple[PairClearance, ...]]:
    """Return the clearance that is required [m], and those by pair.

    Raises:
        ProblemError: a clearance below 0, or no row of PairClearance.
    """
    if clearance is None:
        clearance = getattr(problem, "clearance", DEFAULT_CLEARANCE)
    asked = as_number("clearance", clearance, ProblemError, at_least=0, unit="m")
    return asked, as_pair_clearances(getattr(problem, "clearances", ()))


def _prepared(
    problem: HasScene, trajectory: AnyTrajectory, setup: BaseSetup, *, required: RequiredClearance, finest: float
) -> tuple[BaseProof, ClearanceProof]:
    """Return the proofs of base and clearance, with nothing computed yet.

    Raises:
        ProblemError: a number is too large.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # such numbers are refused below
        base = base_proof(problem.robot, trajectory, setup)
        proof = ClearanceProof(problem.robot, problem.scene, base, required=required, resolution=finest)
        largest = proof.largest_number()
    if not largest <= _LARGEST:
        raise ProblemError(
            f"the robot, the scene or the path has a number of {largest:.4g}, expected at most {_LARGEST:g} [m or rad]: beyond "
            "it rounding outweighs any clearance"
        )
    return base, proof


class _Clearance(NamedTuple):
    """The result of the clearance proofs.

    Attributes:
        status: of all pairs of bodies.
        closest: the closest approach.
        base: what was found about the base.
        evaluations, resolution: as in `ClearanceProof`.
        notes: to be added to the certificate's.
    """

    status: Status
    closest: ClosestApproach | None
    base: BaseFindings | None
    evaluations: int
    resolution: float
    notes: tuple[str, ...] = ()


def _clearance(
    problem: HasScene,
    trajectory: AnyTrajectory,
    base: BaseProof,
    proof: ClearanceProof,
    *,
    by_pair: tuple[PairClearance, ...],
    finest: float,
) -> _Clearance:
    """Prove that all pairs of bodies keep apart: those with a clearance, then those that cannot meet."""
    robot, scene = problem.robot, problem.scene
    found: BaseFindings | None = None
    status: Status = "undecided"
    near: NearestPair | None = None
    if not base.setup.model.lacking(robot):
        proof.integrate_base()
        found = base.findings(getattr(problem, "base_limits", None), proof.frames_at)
        if found is None or found.followed:
            status, near = proof.result()
    closest = None if near is None else _closest(near, robot, scene, base)
    result = _Clearance(status, closest, found, proof.evaluations, proof.resolution)
    if status == "holds" and robot.apart is not None:
        result = _with_apart(result, proof.proven_in_full, _apart(robot, trajectory, by_pair=by_pair, finest=finest))
    if result.status == "holds" and lacks_envelope(robot):
        result = result._replace(status="undecided")
    return result


def _apart(robot: Robot, trajectory: AnyTrajectory, *, by_pair: tuple[PairClearance, ...], finest: float) -> _Clearance:
    """Prove that the pairs of links that cannot meet within the limits do not meet on the trajectory.

    Only contact matters for them, unless a pair has a clearance of its own: the planner does not look at them. The motion of
    the base does not matter.
    """
    links = _with_apart_only(robot)
    at_rest = BaseSetup(model=BASE_MODELS["fixed"], start=np.eye(4), linear=np.zeros(3), angular=np.zeros(3))
    base = FixedBaseProof(links, trajectory, at_rest)
    named = {(min(link, other), max(link, other)) for link, other in links.self_pairs}
    own = [one for one in by_pair if one.link and one.other_link and tuple(sorted((one.link, one.other_link))) in named]
    required = required_clearance(links, Scene(), 0.0, own)
    proof = ClearanceProof(links, Scene(), base, required=required, resolution=finest, proven_share=0.0)
    proof.integrate_base()
    status, near = proof.result()
    closest = None if near is None else _closest(near, links, Scene(), base)
    return _Clearance(status, closest, None, proof.evaluations, proof.resolution)


def _with_apart(result: _Clearance, proven: float, apart: _Clearance) -> _Clearance:
    """Return the result of the pairs with a clearance (`proven`), with that of the pairs that cannot meet."""
    result = result._replace(
        evaluations=result.evaluations + apart.evaluations, resolution=min(result.resolution, apart.resolution)
    )
    if apart.status != "holds":
        return result._replace(status=apart.status, closest=apart.closest)
    near = apart.closest
    if result.closest is None or near is None or near.clearance >= proven:
        return result
    note = (
        f"link '{near.link}' and {near.other} come nearer, {near.clearance * 1e3:.3g} mm as measured: they cannot meet within "
        "the limits, and of such links it is only proven that they do not"
    )
    return result._replace(notes=(note,))


@cached_by_identity
def _with_apart_only(robot: Robot) -> Robot:
    """Return the robot with only the links that cannot meet, and with their pairs as those that must keep clear."""
    assert robot.apart is not None
    links = {link for pair in robot.apart.pairs for link in pair}
    shapes = tuple(part for part in robot.shapes if part.name in links)
    return replace(robot, shapes=shapes, self_pairs=robot.apart.pairs, apart=None)


@cached_by_identity
def _unchecked(robot: Robot) -> tuple[UncheckedPair, ...]:
    return unchecked_pairs(robot)


def _closest(near: NearestPair, robot: Robot, scene: Scene, base: BaseProof) -> ClosestApproach:
    """Return a closest approach with names, time, and the parameter of the trajectory's own curve."""
    obstacle = near.obstacle
    return ClosestApproach(
        link=robot.shapes[near.shape].name,
        other=f"link '{robot.shapes[near.other].name}'" if obstacle is None else f"obstacle {scene.called(obstacle)}",
        obstacle=obstacle,
        time=float(time_at(base, np.array(near.u))),
        u=own_parameter(base, near.u),
        clearance=near.clearance,
        required=near.required,
        points=near.points,
    )


def _near_pairs(proof: ClearanceProof, robot: Robot, scene: Scene, base: BaseProof, *, holds: bool) -> tuple[NearPair, ...]:
    """Return the pairs that are near at an end, with names and times: once for each end, or once for both."""
    begin, end = base.curve.domain
    links = tuple(dict.fromkeys(shape.name for shape in robot.shapes))
    out: list[NearPair] = []
    for i, near in enumerate(proof.requirements.near):
        obstacle = near.other if near.other < len(scene.obstacles) else None
        for part in near.parts:
            phase = 3 * i + part.phase
            times = time_at(base, np.clip([part.begin, part.end], begin, end))
            pair = NearPair(
                link=links[near.link],
                other=f"link '{links[near.other - len(scene.obstacles)]}'"
                if obstacle is None
                else f"obstacle {scene.called(obstacle)}",
                obstacle=obstacle,
                ends=part.ends,
                clearance=part.has,
                required=near.required,
                held_to=near.held(part.phase),
                proven=float(proof.proven[phase]) if holds else None,
                measured=min(part.has, float(proof.measured.clearance[phase])),
                begin=float(times[0]),
                end=float(times[1]),
            )
            out.append(pair)
    return tuple(out)


def _limits_kept(
    robot: Robot, trajectory: AnyTrajectory, margins: LimitMargins, checked: tuple[Limit, ...], base: BaseFindings | None
) -> bool:
    """Return whether the limits of joints and base are kept, and what the trajectory states of itself is true."""
    if broken_limits(robot, margins, checked) or getattr(trajectory, "contradictions", ()):
        return False
    return base is None or not (base.broken or (base.followed and base.broken_limits))


def _checked_limits(limits: Sequence[Limit]) -> tuple[Limit, ...]:
    """Return the limits to be checked, in our order.

    Raises:
        ProblemError: no sequence, or an unknown name.
    """
    if isinstance(limits, str) or not isinstance(limits, Sequence):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise ProblemError(f"limits is {shown(limits)}, expected some of {', '.join(LIMITS)}, as in limits=('position',)")
    for limit in limits:
        if limit not in LIMITS:
            raise ProblemError(f"limits names {shown(limit)}, which is none; {nearest(str(limit), LIMITS)}")
    return tuple(limit for limit in LIMITS if limit in limits)
