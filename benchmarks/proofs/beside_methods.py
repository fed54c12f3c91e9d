"""The methods that are put beside the proof. Each says of a motion whether it is free, and what that took.

What is made once for a robot and a scene (tables, Coal's and FCL's shapes, the kernel's model) is made before the clock runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from proofs.beside_motions import STEP, AMotion
from proofs.coal_oracle import GJK_ITERATIONS, GJK_TOLERANCE
from proofs.native_bisection import bisect
from spacearm.geometry import PolytopeSet, core_of
from spacearm.planner import clearance
from spacearm.proof.checker import check_proof
from spacearm.proof.claim import Claim
from spacearm.proof.finder import find_proof
from spacearm.proof.path_intervals import Intervals
from support.oracles.coal_shapes import hull_of

Array = NDArray[np.float64]

ADVANCED = 0.05
"""How far apart the configurations are between which bodies are advanced [rad]."""

_FINEST = 1e-7  # share of the path below which the bisection gives up
_SPARE, _NEARLY = 1.0, 0.45  # when a bundle is opened: as the native finder does it


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a method says.

    Attributes:
        free: whether the motion is; None: it does not know.
        seconds: processor time [s].
        configurations, queries: at which, and how often, a distance or a collision was asked for; 0: not counted.
        parts: of the seconds, by name.
    """

    free: bool | None
    seconds: float
    configurations: int = 0
    queries: int = 0
    parts: dict[str, float] = field(default_factory=dict)


Method = Callable[[AMotion], Verdict]


# ---- spacearm --------------------------------------------------------------------------------------------------------


def proved(motion: AMotion, claim: Claim | None = None) -> Verdict:
    """Find a proof, and check it."""
    begun = time.process_time()
    claim = motion.claim() if claim is None else claim
    made = time.process_time()
    found = find_proof(claim)
    between = time.process_time()
    checked = None if found.proof is None else check_proof(claim, found.proof)
    ended = time.process_time()
    free = checked is not None and not checked.fault
    return Verdict(
        free=True if free else False if found.status == "fails" else None,
        seconds=ended - begun,
        configurations=found.stretches,
        queries=found.nodes,
        parts={"claim": made - begun, "found": between - made, "checked": ended - between},
    )


def bisected_natively(environment: Path) -> Method:
    """Return adaptive bisection in the kernel's own terms, compiled into an environment."""

    def judged(motion: AMotion, claim: Claim | None = None) -> Verdict:
        begun = time.process_time()
        claim = motion.claim() if claim is None else claim
        found = bisect(claim, environment)
        return Verdict(
            free={"holds": True, "fails": False, "undecided": None}[found.status],
            seconds=time.process_time() - begun,
            configurations=found.stretches,
            queries=found.nodes,
        )

    return judged


# ---- adaptive bisection, in Python on Coal ---------------------------------------------------------------------------


def bisected(motion: AMotion) -> Verdict:
    """Bisect until each pair's distance, which is Coal's, is more than the displacement bound."""
    shapes = _coal_shapes(motion)
    begun = time.process_time()
    claim = motion.claim()
    bodies, pairs, path = claim.bodies, claim.pairs, claim.path
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance, request.gjk_max_iterations = GJK_TOLERANCE, GJK_ITERATIONS
    roots = list(zip(pairs.first.tolist(), pairs.other.tolist(), strict=True))
    work: list[tuple[Intervals, list[tuple[int, int]]]] = [(path.whole(), roots)]
    configurations = queries = 0
    free: bool | None = True
    while work and free:
        interval, todo = work.pop()
        if interval.share[0] < _FINEST:
            free = None
            break
        stretch = _Placed(motion, claim, interval, shapes)
        configurations += 1
        halved: list[tuple[int, int]] = []
        for first, other in todo:  # grows while bundles are opened
            result.clear()
            distance = coal.distance(*stretch.at(first), *stretch.at(other), request, result)
            queries += 1
            loss = stretch.displacement(first, other)
            if distance > loss:
                continue
            a, b = int(bodies.members[first]), int(bodies.members[other])
            radii = (bodies.radius[first] if a else 0.0) + (bodies.radius[other] if b else 0.0)
            if (a or b) and distance + _SPARE * radii > loss and distance < _NEARLY * loss:
                own = bool(a) and (not b or bodies.radius[first] >= bodies.radius[other])
                bundle = first if own else other
                members = range(int(bodies.first_member[bundle]), int(bodies.first_member[bundle] + bodies.members[bundle]))
                todo += [(i, other) if own else (first, i) for i in members]
            elif distance <= 0 and not (a or b):
                free = False
                break
            else:
                halved.append((first, other))
        if halved and free:
            both = path.halved(interval)
            work += [(both.select(np.array([side])), list(halved)) for side in (1, 0)]
    return Verdict(free=free, seconds=time.process_time() - begun, configurations=configurations, queries=queries)


class _Placed:
    """All bodies of a claim at the midpoint of a stretch, and the displacement bounds on it."""

    def __init__(self, motion: AMotion, claim: Claim, interval: Intervals, shapes: list[tuple[Any, int]]) -> None:
        line = claim.path.linear_bounds(interval)
        robot, bodies = claim.robot, claim.bodies
        self._claim, self._oracle, self._shapes = claim, motion.oracle, shapes
        dof, scale = [joint.dof for joint in robot.joints], np.abs([joint.multiplier for joint in robot.joints])
        delta = (np.abs(line.rate[0]) * line.half[0] + line.deviation[0])[dof] * scale
        full = motion.oracle.full(line.q, claim.base.setup.start)[0]
        motion.oracle.place(full)
        frames = np.concatenate([np.eye(4)[None], claim.base.setup.start[None], motion.oracle.placed_joints()])
        of_body = frames[bodies.frame]
        self._centers = np.einsum("bij,bj->bi", of_body[:, :3, :3], bodies.center) + of_body[:, :3, 3]
        axis, origin = frames[2:, :3, 2], frames[2:, :3, 3]
        revolute = np.array([joint.kind == "revolute" for joint in robot.joints])
        lever = np.linalg.norm(np.cross(self._centers[:, None] - origin, axis), axis=2)
        self._lever = np.where(revolute, lever, 1.0)
        self._moved = np.abs(claim.pairs.sign) * delta
        self._rotation = (self._moved * revolute).sum(axis=1)
        self._at: dict[int, tuple[Any, coal.Transform3s]] = {}

    def at(self, body: int) -> tuple[Any, coal.Transform3s]:
        if body not in self._at:
            shape, geometry = self._shapes[body]
            if geometry < 0:
                T = coal.Transform3s(np.eye(3), self._centers[body])
            else:
                placed = self._oracle.found.oMg[geometry]
                T = coal.Transform3s(placed.rotation, placed.translation)
            self._at[body] = shape, T
        return self._at[body]

    def displacement(self, first: int, other: int) -> float:
        bodies, pairs = self._claim.bodies, self._claim.pairs
        m = int(pairs.motion_of[bodies.frame[first], bodies.frame[other]])
        return float(self._lever[first] @ self._moved[m] + bodies.reach[first] * self._rotation[m])


def _coal_shapes(motion: AMotion) -> list[tuple[Any, int]]:
    """Return Coal's shape of each body of the claim's table, and its place in the oracle; -1: a ball around others."""
    bodies, geometries = motion.claim().bodies, motion.oracle.bodies.geometryObjects
    parts: dict[int, int] = {}
    out: list[tuple[Any, int]] = []
    for b in range(len(bodies)):
        if bodies.members[b]:
            out.append((coal.Sphere(float(bodies.radius[b])), -1))
            continue
        if bodies.shape[b] >= 0:
            at = int(bodies.shape[b])
        else:
            owner = int(bodies.owner[b])
            at = motion.oracle.first_of_obstacle[owner] + parts.get(owner, 0)
            parts[owner] = parts.get(owner, 0) + 1
        out.append((geometries[at].geometry, at))
    return out


# ---- continuous collision detection of two bodies ----------------------------------------------------------------------


def advanced(motion: AMotion) -> Verdict:
    """Advance each pair of bodies between successive configurations, as FCL does it; pairs that are far apart are left out.

    Between two configurations FCL moves each body by itself: along a straight line, and at a constant rate of turn.
    """
    import fcl

    shapes = _fcl_shapes(motion)
    begun = time.process_time()
    request = fcl.ContinuousCollisionRequest(
        num_max_iterations=1000,
        ccd_solver_type=fcl.CCDSolverType.CCDC_CONSERVATIVE_ADVANCEMENT,
        ccd_motion_type=fcl.CCDMotionType.CCDM_LINEAR,
    )
    oracle, count = motion.oracle, len(shapes)
    u, _ = motion.instants(ADVANCED)
    first = np.array([pair.first for pair in oracle.bodies.collisionPairs])
    other = np.array([pair.second for pair in oracle.bodies.collisionPairs])
    size = np.array([one.geometry.aabb_radius for one in oracle.bodies.geometryObjects])
    rotations, places = np.empty((len(u), count, 3, 3)), np.empty((len(u), count, 3))
    for i, full in enumerate(motion.placed(u)):
        oracle.place(full)
        for k in range(count):
            rotations[i, k], places[i, k] = oracle.found.oMg[k].rotation, oracle.found.oMg[k].translation
    free, queries = True, 0
    for i in range(len(u) - 1):
        apart = places[i : i + 2, first] - places[i : i + 2, other]
        close = np.flatnonzero(_nearest_to_origin(apart[0], apart[1]) <= size[first] + size[other])
        ends: dict[int, tuple[Any, Any]] = {}
        for pair in close.tolist():
            moving = []
            for k in (int(first[pair]), int(other[pair])):
                if k not in ends:
                    begin, end = (fcl.Transform(rotations[j, k], places[j, k]) for j in (i, i + 1))
                    ends[k] = fcl.CollisionObject(shapes[k], begin), end
                moving += ends[k]
            result = fcl.ContinuousCollisionResult()
            fcl.continuousCollide(*moving, request, result)
            queries += 1
            if result.is_collide:
                free = False
                break
        if not free:
            break
    return Verdict(free=free, seconds=time.process_time() - begun, configurations=len(u), queries=queries)


def interpolation_error(motion: AMotion) -> float:
    """Return how far bodies' centres get, at most, from the lines that they are moved along [m]; measured halfway."""
    oracle, (u, _) = motion.oracle, motion.instants(ADVANCED)
    both = np.stack([u[:-1], u[1:], (u[:-1] + u[1:]) / 2])
    count = len(motion.problem.robot.shapes)
    places = np.empty((*both.shape, count, 3))
    for at in np.ndindex(both.shape):
        oracle.place(motion.placed(both[at][None])[0])
        places[at] = [oracle.found.oMg[k].translation for k in range(count)]
    a, b = (places[i] - places[2] for i in (0, 1))
    return float(_nearest_to_origin(a.reshape(-1, 3), b.reshape(-1, 3)).max())


def _nearest_to_origin(a: Array, b: Array) -> Array:
    """Return the distances (r,) of the origin to segments from a to b, (r, 3) each."""
    along = b - a
    squared = np.einsum("ri,ri->r", along, along)
    share = np.clip(-np.einsum("ri,ri->r", a, along) / np.where(squared > 0, squared, 1.0), 0, 1)
    return np.linalg.norm(a + share[:, None] * along, axis=1)


def _fcl_shapes(motion: AMotion) -> list[Any]:
    """Return FCL's shapes in the order of the oracle's; without the rounding of boxes, cylinders and polytopes."""
    robot, scene = motion.problem.robot, motion.problem.scene
    shapes = [_fcl_shape(part.shape) for part in robot.shapes]
    for obstacle in scene.obstacles:
        parts = obstacle.pieces if isinstance(obstacle, PolytopeSet) else (obstacle,)
        shapes += [_fcl_shape(part) for part in parts]
    return shapes


def _fcl_shape(shape: Any) -> Any:
    import fcl

    core = core_of(shape)
    if core.kind == "point":
        return fcl.Sphere(core.radius)
    if core.kind == "segment":
        return fcl.Capsule(core.radius, float(2 * core.half[2]))
    if core.kind == "box":
        return fcl.Box(*(2 * core.half).tolist())
    if core.kind == "cylinder":
        return fcl.Cylinder(float(core.half[0]), float(2 * core.half[2]))
    corners, faces = hull_of(core.vertices)
    center = corners.mean(axis=0)
    outward = [_outward(corners, face, center) for face in faces]
    flat = np.array([[len(face), *face] for face in outward]).ravel()
    return fcl.Convex(np.array(corners), len(faces), flat)


def _outward(corners: Array, face: list[int], center: Array) -> list[int]:
    a, b, c = corners[face]
    return face if np.cross(b - a, c - a) @ (a - center) > 0 else face[::-1]


# ---- samples ---------------------------------------------------------------------------------------------------------


def sampled_by_coal(motion: AMotion) -> Verdict:
    """Look at configurations `STEP` apart with Pinocchio and Coal, whose broad phase leaves most pairs out."""
    oracle, found = motion.oracle, motion.oracle.bodies.createData()
    for request in found.collisionRequests:
        request.gjk_tolerance = GJK_TOLERANCE
    manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(oracle.model, oracle.bodies, found)
    begun = time.process_time()
    u, _ = motion.instants(STEP)
    free = True
    for full in motion.placed(u):
        if pin.computeCollisions(oracle.model, oracle.data, manager, full, True):
            free = False
            break
    return Verdict(free=free, seconds=time.process_time() - begun, configurations=len(u))


def sampled_by_kernel(motion: AMotion) -> Verdict:
    """Look at configurations `STEP` apart with the native kernel, as `spacearm.planner.clearance` does it."""
    clearance(motion.problem, motion.problem.start[None])
    begun = time.process_time()
    u, q = motion.instants(STEP)
    free = bool((clearance(motion.problem, q) > 0).all())
    return Verdict(free=free, seconds=time.process_time() - begun, configurations=len(u))
