"""The search for a proof: the Python face of the native finder (kernel/proof).

The finder is quick and is not believed: what it says is an opinion, and its proof is data for the checker. It searches for
planes between all pairs on stretches of the path, and measures some pairs on its way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.native_finder import native_finder
from spacearm.proof.base_proofs import BaseProof
from spacearm.proof.claim import Claim
from spacearm.proof.convex_bodies import BodyPairs, ConvexBodies
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.proof_tree import ProofTree
from spacearm.robot import Robot

Array = NDArray[np.float64]
Status = Literal["holds", "fails", "undecided"]

_STATUS: tuple[Status, ...] = ("holds", "fails", "undecided")
_REMEMBERED = 4  # tables of robots and scenes seen last


@dataclass(frozen=True, slots=True, kw_only=True)
class Suspect:
    """A pair of shapes that is close, as the finder measured it.

    Attributes:
        first, other: the bodies of the claim's table; no bundles.
        u: where on the curve.
        clearance: what the pair has there; not above 0 where it touches [m].
    """

    first: int
    other: int
    u: float
    clearance: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """What the finder found.

    Attributes:
        status: its opinion: "holds" with a proof, "fails" after a measurement of no more than a pair is held to, "undecided".
        proof: the proof; None unless it holds.
        closest: by phase, the closest pair that was measured; None where none was.
        worst: the pair with the least above what it is held to, or the one that is undecided; None if nothing was measured.
        nodes, stretches: how many nodes the search made, and on how many stretches of the path.
    """

    status: Status
    proof: ProofTree | None
    closest: tuple[Suspect | None, ...]
    worst: Suspect | None
    nodes: int
    stretches: int


def find_proof(claim: Claim, *, resolution: float = 1e-7, proven_share: float = 0.5) -> Found:
    """Search a proof.

    Args:
        claim: what it has to show.
        resolution: a pair that is open on a shorter share of the path is undecided.
        proven_share: how much is to be proven of the least excess that was measured; excess is what a pair has more than it is
            held to. Links that cannot meet only must not touch.
    """
    motion = native_motion(claim)
    found = native_finder.find_proof(
        tables=motion.tables,
        path=motion.path,
        held=_held(claim, proven_share),
        tracking=np.ascontiguousarray(claim.tracking, dtype=np.float64),
        start=motion.start,
        floating=motion.floating,
        resolution=resolution,
    )
    status = _STATUS[found.status.value]
    return Found(
        status=status,
        proof=ProofTree(steps=found.steps, directions=found.directions) if status == "holds" else None,
        closest=tuple(_suspect(one) for one in found.closest),
        worst=_suspect(found.worst),
        nodes=found.nodes,
        stretches=found.stretches,
    )


def _suspect(found: native_finder.Suspect) -> Suspect | None:
    if found.first < 0:
        return None
    return Suspect(first=found.first, other=found.other, u=found.u, clearance=found.clearance)


# ---- What the kernel takes -------------------------------------------------------------------------------------------

_TABLES: deque[tuple[ConvexBodies, BodyPairs, native_finder.Tables]] = deque(maxlen=_REMEMBERED)


class NativeMotion(NamedTuple):
    """What the kernel has to know to place a claim's bodies.

    Attributes:
        tables: joints, bodies and pairs.
        path: the joints' path.
        start: (4, 4) the base's first pose.
        floating: where the base goes; None if it is at rest.
    """

    tables: native_finder.Tables
    path: native_finder.Path
    start: Array
    floating: native_finder.FloatingBase | None


def native_motion(claim: Claim) -> NativeMotion:
    """Return what the kernel has to know of a claim; its parts are the same objects for what was seen last."""
    return NativeMotion(
        _tables(claim.robot, claim.bodies, claim.pairs), _path(claim.path), _real(claim.base.setup.start), _floating(claim.base)
    )


def _tables(robot: Robot, bodies: ConvexBodies, pairs: BodyPairs) -> native_finder.Tables:
    """Return the kernel's tables; the same object for the tables seen last."""
    for of_bodies, of_pairs, made in list(_TABLES):
        if of_bodies is bodies and of_pairs is pairs:
            return made
    joints = robot.joints
    made = native_finder.Tables(
        parent=_whole([joint.parent for joint in joints]),
        dof=_whole([joint.dof for joint in joints]),
        revolute=np.array([joint.kind == "revolute" for joint in joints], dtype=bool),
        multiplier=np.array([joint.multiplier for joint in joints], dtype=np.float64),
        offset=np.array([joint.offset for joint in joints], dtype=np.float64),
        placement=np.array([joint.T_parent_joint for joint in joints], dtype=np.float64).reshape(-1, 4, 4),
        dofs=robot.dof,
        frame=_whole(bodies.frame),
        first_point=_whole(bodies.first_point),
        points=_whole(bodies.points),
        vertices=_real(bodies.vertices),
        disc=_real(bodies.disc),
        axis=_real(bodies.axis),
        radius=_real(bodies.radius),
        center=_real(bodies.center),
        reach=_real(bodies.reach),
        half_space=np.ascontiguousarray(bodies.half_space),
        first_member=_whole(bodies.first_member),
        members=_whole(bodies.members),
        owner=_whole(bodies.owner),
        first=_whole(pairs.first),
        other=_whole(pairs.other),
        motion_of=_whole(pairs.motion_of),
        sign=_real(pairs.sign),
        order=_real(pairs.order),
        free=np.ascontiguousarray(pairs.free),
        whole_order=_real(pairs.whole_order),
    )
    _TABLES.append((bodies, pairs, made))
    return made


@cached_by_identity
def _path(path: PathIntervals) -> native_finder.Path:
    curve = path.curve
    begins, _, _ = curve.hulls(0, bisections=0)
    return native_finder.Path(
        ends=_real(path.ends),
        least_rate=_real(path.least_rate),
        greatest_rate=_real(path.greatest_rate),
        second=_real(path.second),
        size=_real(path.size),
        rounding=path.rounding,
        breaks=np.append(begins[:, 0], begins[-1, 1]),
        coefficients=_real(curve.bezier()),
    )


def _held(claim: Claim, proven_share: float) -> native_finder.Held:
    held = claim.held
    known = np.full(held.phases, np.inf)
    known[1 : 1 + 3 * len(held.pairs)] = [excess for pair in held.pairs for excess in pair.known_excess]
    share = np.full(held.phases, proven_share)
    share[-1] = 0.0
    return native_finder.Held(
        required=_real(held.required),
        phase=_whole(held.phase),
        near=_whole(held.near),
        held=_real(held.held),
        until=_real(held.until),
        since=_real(held.since),
        known_excess=known,
        share=share,
    )


@cached_by_identity
def _floating(base: BaseProof) -> native_finder.FloatingBase | None:
    arrays = base.for_finder()
    return None if arrays is None else native_finder.FloatingBase(**arrays._asdict())


def _whole(values: Sequence[int] | NDArray[Any]) -> NDArray[np.int64]:
    return np.ascontiguousarray(values, dtype=np.int64)


def _real(values: Array) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)
