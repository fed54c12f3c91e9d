"""The proof of a trajectory: `certify` checks its input, proves clearance, checks the limits, and states the result.

Nothing of the search is used. The steps are in the other modules of this room: where the base goes (`base_proofs`), what has to
be shown (`claim`), a proof of it (`finder`), whether it shows it (`checker`), what is measured beside it (`measured`), and what
is stated about all that (`certificate`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_number, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.core.identity_cache import cached_by_identity
from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory, LimitMargins, RecordedTrajectory, Trajectory
from spacearm.motion.recorded import for_robot
from spacearm.proof.base_proofs import (
    BaseFindings,
    base_proof,
    base_setup_of,
    link_frames,
    own_parameter,
    require_same,
    time_at,
)
from spacearm.proof.certificate import Certificate, ClosestApproach, Limit, NearPair, broken_limits
from spacearm.proof.checker import Checked, check_proof
from spacearm.proof.claim import Claim, claim_of, with_near
from spacearm.proof.finder import find_proof
from spacearm.proof.measured import MeasuredApproaches, NearestPair, measure_approaches
from spacearm.proof.near_pairs import find_near
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.proof_tree import ProofTree
from spacearm.proof.required_clearance import DEFAULT_CLEARANCE, PairClearance, as_pair_clearances, required_clearance
from spacearm.proof.tracking import Tracking, require_bounded, tracking_of
from spacearm.proof.witness import witness_name
from spacearm.robot import Robot
from spacearm.robot.unchecked_pairs import UncheckedPair, bare_links, lacks_envelope, unchecked_pairs

Status = Literal["holds", "fails", "undecided"]

LIMITS: tuple[Limit, ...] = ("position", "velocity", "acceleration")
RESOLUTION = 1e-7
_AROUND = 0.02  # of the curve: so far around an instant is measured where there is no proof
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
    tracking: Tracking | None = None,
    proof: ProofTree | None = None,
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
        resolution: stretches shorter than this share of the curve, all its pieces counting alike, are not halved. The
            certificate is undecided then.
        tracking: by how much each joint may be off the trajectory at any instant [rad or m]: a number for all joints, or a
            mapping from joints' names, and "all", to numbers. Then clearances and position limits are proven for all that
            stays within it; a base that follows the arm allows none. Velocities and accelerations are those of the trajectory
            itself. None: the joints are where the trajectory says.
        proof: of the clearances, as a plan file carries one, to be checked. If it does not show them, a note says so, and
            another one is looked for. None: one is looked for.
        minimum_clearance: former name; no longer taken.

    Returns:
        The certificate. It never says that a motion holds when it does not; it may be undecided. docs/certificate.md has the
        proofs.

    Raises:
        ProblemError: no trajectory, one of another robot (other joints, or joints elsewhere) or for another base, a setting
            out of its range, a proof that is none, or numbers so large that their rounding is larger than any clearance.
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
    tube = tracking_of(robot, tracking)
    require_bounded(setup.model, tube)
    _require_proof(proof)
    begun = time.perf_counter()
    margins = _within_tube(trajectory.margins(robot, jerk_limit=jerk_limit), tube)  # of the problem's limits
    checked = checked if jerk_limit is None else (*checked, "jerk")
    base = base_proof(robot, trajectory, setup)
    required = required_clearance(robot, problem.scene, asked, by_pair)
    path = PathIntervals(base.curve)
    claim = claim_of(robot, problem.scene, base, path, required=required, by_pair=by_pair, tracking=tube)
    _require_no_large_number(claim)
    found = _Clearances(problem, claim, proof, finest)
    kept = _limits_kept(robot, trajectory, margins, checked, found.base)
    clear = found.status == "holds"
    return Certificate(
        status=found.status if kept else "fails",
        clear=clear,
        clearance=found.proven_in_full if clear and kept else None,
        required=asked,
        required_by_pair=by_pair,
        closest=found.closest,
        near_pairs=found.near_pairs(holds=clear and kept),
        limits=margins,
        checked=checked,
        tracking=tube if tube.any() else None,
        resolution=found.resolution,
        evaluations=found.evaluations,
        seconds=time.perf_counter() - begun,
        witness=witness_name(),
        proof=found.proof if clear else None,
        robot=robot,
        scene=problem.scene,
        trajectory=trajectory,
        base_setup=setup,
        base_findings=found.base,
        unchecked=_unchecked(robot),
        bare=bare_links(robot),
        notes=(*notes, *found.notes),
    )


def _require_proof(given: object) -> None:
    """Refuse what is no proof, or one with something else than arrays; what they hold is the checker's to judge.

    Raises:
        ProblemError: it is none.
    """
    if given is None:
        return
    arrays = (given.steps, given.directions) if isinstance(given, ProofTree) else ()
    if not arrays or any(type(array) is not np.ndarray for array in arrays):
        raise ProblemError(f"proof is {shown(given)}, expected a ProofTree of two NumPy arrays, as Certificate.proof is one")


def _asked(problem: HasScene, clearance: float | None) -> tuple[float, tuple[PairClearance, ...]]:
    """Return the clearance that is required [m], and those by pair.

    Raises:
        ProblemError: a clearance below 0, or no row of PairClearance.
    """
    if clearance is None:
        clearance = getattr(problem, "clearance", DEFAULT_CLEARANCE)
    asked = as_number("clearance", clearance, ProblemError, at_least=0, unit="m")
    return asked, as_pair_clearances(getattr(problem, "clearances", ()))


def _within_tube(margins: LimitMargins, tube: NDArray[np.float64]) -> LimitMargins:
    """Return the margins of all that stays within a tracking error (n,) of a trajectory, as far as positions go."""
    return replace(margins, position=margins.position - tube) if tube.any() else margins


def _require_no_large_number(claim: Claim) -> None:
    """Refuse a claim with a number whose rounding outweighs any clearance.

    Raises:
        ProblemError: there is one.
    """
    bodies, joints = claim.bodies, claim.robot.joints
    _, low, high = claim.base.curve.hulls(0, bisections=0)
    numbers = [low, high, bodies.vertices, bodies.radius, bodies.disc, claim.base.setup.start, claim.held.required]
    numbers += [np.array([[joint.offset, joint.multiplier] for joint in joints])]
    numbers += [np.array([joint.T_parent_joint[:3, 3] for joint in joints])]
    largest = float(np.max([np.abs(array).max(initial=0.0) for array in numbers]))
    if not largest <= _LARGEST:
        raise ProblemError(
            f"the robot, the scene or the path has a number of {largest:.4g}, expected at most {_LARGEST:g} [m or rad]: beyond "
            "it rounding outweighs any clearance"
        )


class _Clearances:
    """The proof that pairs of bodies keep apart, with what is measured beside it.

    Attributes:
        status: of all pairs of bodies.
        claim: what was to be shown; with the pairs that are near at an end.
        base: what was found about the base; None if it is at rest, or its motion unknown.
        proof: that shows the claim; None if the status is not "holds".
        proven: (phases,) the clearance proven, by phase [m].
        resolution, evaluations: as in `Certificate`.
        notes: to be added to the certificate's.
    """

    def __init__(self, problem: HasScene, claim: Claim, given: ProofTree | None, finest: float) -> None:
        """Prove, or say why not.

        Args:
            problem: may have `base_limits`.
            claim: what has to be shown, without pairs that are near at an end.
            given: a proof to be checked, if any.
            finest: shorter stretches are not halved.
        """
        self.claim, self.base, self.proof = claim, None, None
        self.status: Status = "undecided"
        self.resolution, self.evaluations, self.notes = 1.0, 0, ()
        self.proven = np.full(claim.held.phases, -np.inf)
        self._approaches: MeasuredApproaches | None = None
        if claim.base.setup.model.lacking(claim.robot):
            return
        claim.base.begin()
        self.base = claim.base.findings(getattr(problem, "base_limits", None), lambda u: _placed(claim, u))
        if self.base is None or self.base.followed:
            self._prove(given, finest)

    def _prove(self, given: ProofTree | None, finest: float) -> None:
        near = find_near(self.claim)
        if near:
            self.claim = with_near(self.claim, near)
        checked = None if given is None else check_proof(self.claim, given)
        found = find_proof(self.claim, resolution=finest)
        if checked is not None and checked.fault:
            self.notes = (f"the proof given does not show it ({checked.fault}), so another one was looked for",)
            given = checked = None
        proof = found.proof if given is None else given
        if proof is not None and checked is None:
            checked = check_proof(self.claim, proof)
        self.evaluations = found.stretches
        around = _AROUND if checked is None or checked.fault else checked.finest
        self._approaches = measure_approaches(self.claim, found.closest, found.worst, finest=around)
        self._conclude(proof, checked)

    def _conclude(self, proof: ProofTree | None, checked: Checked | None) -> None:
        """Hold the check of a proof against what was measured: neither is believed where they contradict each other."""
        assert self._approaches is not None
        if self._approaches.fails:
            self.status = "fails"
        elif checked is not None and not checked.fault and not self._approaches.contradict(checked.proven):
            self.status = "undecided" if lacks_envelope(self.claim.robot) else "holds"
            self.proof, self.proven = proof, checked.proven
            self.resolution, self.evaluations = checked.finest, checked.stretches
            self.notes = (*self.notes, *self._on_links_apart())
        elif checked is not None and checked.fault:
            self.notes = (*self.notes, f"the proof that was found is not one ({checked.fault})")

    @property
    def proven_in_full(self) -> float:
        """The clearance is at least this for all pairs that are held to what is required [m]; infinite if there are none.

        If none is held to that at any time, it is the clearance of all pairs; but not of links that cannot meet.
        """
        full = float(self.proven[self.claim.held.full_phases].min())
        return full if np.isfinite(full) else float(self.proven[:-1].min())

    @property
    def closest(self) -> ClosestApproach | None:
        """The closest approach of what `proven_in_full` is about, or else the pair that lacks most; None: none was measured."""
        found = self._approaches
        if found is None:
            return None
        near = found.worst
        if self.status == "holds":
            near = found.nearest(self.claim.held.full_phases) or found.nearest(range(len(self.proven) - 1))
        return None if near is None else _closest(near, self.claim)

    def near_pairs(self, *, holds: bool) -> tuple[NearPair, ...]:
        """Return the pairs that are near at an end, with names and times: once for each end, or once for both.

        Args:
            holds: whether what was proven of them may be stated.
        """
        claim = self.claim
        begin, end = claim.base.curve.domain
        links = tuple(dict.fromkeys(shape.name for shape in claim.robot.shapes))
        obstacles = len(claim.scene.obstacles)
        out: list[NearPair] = []
        for i, near in enumerate(claim.held.pairs):
            obstacle = near.other if near.other < obstacles else None
            for part in near.parts:
                phase = 3 * i + part.phase
                times = time_at(claim.base, np.clip([part.begin, part.end], begin, end))
                measured = None if self._approaches is None else self._approaches.closest[phase]
                pair = NearPair(
                    link=links[near.link],
                    other=f"link '{links[near.other - obstacles]}'"
                    if obstacle is None
                    else f"obstacle {claim.scene.called(obstacle)}",
                    obstacle=obstacle,
                    ends=part.ends,
                    clearance=part.has,
                    required=near.required,
                    held_to=near.held(part.phase),
                    proven=min(float(self.proven[phase]), near.required) if holds else None,  # a bundle may have more
                    measured=part.has if measured is None else min(part.has, measured.clearance),
                    begin=float(times[0]),
                    end=float(times[1]),
                    in_tube=bool(claim.tracking.any()),
                )
                out.append(pair)
        return tuple(out)

    def _on_links_apart(self) -> tuple[str, ...]:
        """Say so where links that cannot meet come nearer than what is proven of all others."""
        near = None if self._approaches is None else self._approaches.closest[-1]
        if near is None or near.clearance >= self.proven_in_full:
            return ()
        named = _closest(near, self.claim)
        return (
            f"link '{named.link}' and {named.other} come nearer, {named.clearance * 1e3:.3g} mm as measured: they cannot meet "
            "within the limits, and of such links it is only proven that they do not",
        )


def _placed(claim: Claim, u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return T_w_joint (r, j + 1, 4, 4) at parameters (r,) of the curve; the last is the base."""
    return claim.base.placed(u, link_frames(claim.base, u))


@cached_by_identity
def _unchecked(robot: Robot) -> tuple[UncheckedPair, ...]:
    return unchecked_pairs(robot)


def _closest(near: NearestPair, claim: Claim) -> ClosestApproach:
    """Return a closest approach with names, time, and the parameter of the trajectory's own curve."""
    obstacle, shapes = near.obstacle, claim.robot.shapes
    return ClosestApproach(
        link=shapes[near.shape].name,
        other=f"link '{shapes[near.other].name}'" if obstacle is None else f"obstacle {claim.scene.called(obstacle)}",
        obstacle=obstacle,
        time=float(time_at(claim.base, np.array(near.u))),
        u=own_parameter(claim.base, near.u),
        clearance=near.clearance,
        required=near.required,
        points=near.points,
        tube=near.tube,
    )


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
