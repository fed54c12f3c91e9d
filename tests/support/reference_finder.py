"""A slow finder of proofs, in plain Python: the oracle of the native finder, and the author of proofs for tests of the checker.

It takes the nodes one by one. Coal gives the direction. The bounds are written down here once more, joint by joint and point by
point, as docs/certificate.md states them, and not as the checker computes them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spacearm.proof.claim import Claim
from spacearm.proof.mechanism import JointMap, kinematics_of
from spacearm.proof.proof_tree import HALVES, MEMBERS_OF_FIRST, MEMBERS_OF_OTHER, SETTLED, ProofTree
from spacearm.proof.witness import coal, coal_box, coal_cylinder, coal_polytope

Array = np.ndarray

_OPENS = 0.1  # a bundle is opened if its excess is less than this share of what it loses on the stretch
MARGIN = 2e-9  # [m] that is proven beyond what is required, so that rounding cannot let the checker disagree


@dataclass(frozen=True)
class Bound:
    """What a direction proves of a pair on a stretch: the least clearance, and the gap at the midpoint [m]."""

    left: float
    gap: float


class Stretch:
    """The robot on one stretch of the path."""

    def __init__(self, claim: Claim, interval: Any) -> None:
        joints, line = JointMap(claim.robot), claim.path.linear_bounds(interval)
        values = joints.values(line.q)
        T = claim.base.placed(line.u, kinematics_of(claim.robot).frames(values))
        self.claim, self.interval, self.half, self.u = claim, interval, float(line.half[0]), float(line.u[0])
        scale = np.abs(joints.multiplier)
        self.w = (line.rate[:, joints.dof] * joints.multiplier)[0]
        self.e = line.deviation[0][joints.dof] * scale + 1e-15 * np.abs(values[0])
        self.tube = claim.tracking[joints.dof] * scale
        self.delta = np.abs(self.w) * self.half + self.e + self.tube
        self.base = claim.base.motion_bounds(T, self.w[None], self.e[None], self.delta[None], line.half)
        self.T = [np.eye(4), T[0, -1], *T[0, :-1]]
        self.revolute = joints.revolute
        self.begin, self.end = (float(x) for x in interval.ends[0])


def bound(stretch: Stretch, first: int, other: int, direction: Array) -> Bound:
    """Return what a direction proves of two bodies of the table."""
    claim, bodies, h = stretch.claim, stretch.claim.bodies, stretch.half
    n = bodies.axis[other] if bodies.half_space[other] else direction
    n = n / np.linalg.norm(n)
    A, B = stretch.T[bodies.frame[first]], stretch.T[bodies.frame[other]]
    motion = claim.pairs.motion_of[bodies.frame[first], bodies.frame[other]]
    D1, D2, omega, velocity = _motion(stretch, first, int(motion))
    D2 += _tube(stretch, first, int(motion), n)
    most = max(float(n @ y) for y in _points(claim, other, B)) + bodies.disc[other] * _across(n, B[:3, :3] @ bodies.axis[other])
    axis = A[:3, :3] @ bodies.axis[first]
    gaps, lefts = [], []
    for x in _points(claim, first, A):
        away = bodies.disc[first] * _across(n, axis)
        gap = float(n @ x) - away - most - bodies.radius[first] - bodies.radius[other]
        gap -= 1e-9 + 1e-13 * (np.abs(x).sum() + np.abs(B[:3, 3]).sum() + abs(most) + bodies.reach[first] + bodies.reach[other])
        along = abs(float(n @ (np.cross(omega, x) + velocity))) + bodies.disc[first] * _across(np.cross(n, omega), axis)
        gaps.append(gap)
        lefts.append(gap - min(along * h + D2, D1))
    return Bound(left=min(lefts), gap=min(gaps))


def _motion(stretch: Stretch, first: int, motion: int) -> tuple[float, float, Array, Array]:
    """Return D1 and D2 [m], and the twist about the world's origin per unit of u, of a body in the frame of another one."""
    claim, bodies, base = stretch.claim, stretch.claim.bodies, stretch.base
    sign, free = claim.pairs.sign[motion], bool(claim.pairs.free[motion]) and stretch.base is not None
    order = claim.pairs.whole_order if free else claim.pairs.order[motion]
    T = stretch.T[bodies.frame[first]]
    c, R = T[:3, :3] @ bodies.center[first] + T[:3, 3], float(bodies.reach[first])
    rho, omega, velocity = np.zeros(len(sign)), np.zeros(3), np.zeros(3)
    for k in range(len(sign)):
        z, o = stretch.T[2 + k][:3, 2], stretch.T[2 + k][:3, 3]
        rate = stretch.w[k] * sign[k]
        omega = omega + (rate * z if stretch.revolute[k] else 0.0)
        velocity = velocity + (np.cross(o, rate * z) if stretch.revolute[k] else rate * z)
        lever = c - o if not free else sign[k] * (c - o) - base.com_lever[0, k]
        share = 1.0 if not free else abs(sign[k] - base.mass_share[k])
        rho[k] = np.linalg.norm(np.cross(z, lever)) * (1 + 1e-13) + 1e-12 if stretch.revolute[k] else share
        if not free and not sign[k]:
            rho[k] = 0.0
    involved = np.ones(len(sign)) if free else np.abs(sign)
    delta, e, turns = stretch.delta * involved, stretch.e * involved, stretch.revolute * np.abs(sign)
    g = np.array([stretch.delta[k] / 2 * sum(order[k] * stretch.delta) for k in range(len(sign))])
    of_center = float(rho @ delta)
    D1 = of_center + R * float(turns @ delta)
    D2 = float(rho @ (e + g)) + of_center * float(g @ stretch.revolute) + R * float(turns @ (e + g))
    if free:
        radius = float(np.linalg.norm(c - base.com[0])) + R
        theta, second, error = float(base.rotation[0]), float(base.rotation_second_order[0]), base.attitude_error
        D2 += theta * D1 + radius * (theta**2 / 2 + second + error) + error * (D1 + radius * theta)
        D1 += radius * (theta + error) + float(np.linalg.norm(base.com_velocity[0])) * stretch.half
        for k in range(len(sign)):
            z = stretch.T[2 + k][:3, 2]
            moved = np.cross(z, base.com_lever[0, k]) if stretch.revolute[k] else z * base.mass_share[k]
            velocity = velocity - stretch.w[k] * moved
        omega = omega + base.omega[0]
        velocity = velocity + base.com_velocity[0] - np.cross(base.omega[0], base.com[0])
    return D1, D2, omega, velocity


def _tube(stretch: Stretch, first: int, motion: int, n: Array) -> float:
    """Return how far a body gets along a direction by the tracking error alone, to first order [m]."""
    claim, bodies, T = stretch.claim, stretch.claim.bodies, stretch.T[stretch.claim.bodies.frame[first]]
    c, R, lost = T[:3, :3] @ bodies.center[first] + T[:3, 3], float(bodies.reach[first]), 0.0
    for k in np.flatnonzero(claim.pairs.sign[motion] * stretch.tube):
        z, o = stretch.T[2 + k][:3, 2], stretch.T[2 + k][:3, 3]
        lost += stretch.tube[k] * (abs(n @ np.cross(z, c - o)) + R if stretch.revolute[k] else abs(n @ z))
    return float(lost)


def _points(claim: Claim, body: int, T: Array) -> Array:
    first = claim.bodies.first_point[body]
    return claim.bodies.vertices[first : first + claim.bodies.points[body]] @ T[:3, :3].T + T[:3, 3]


def _across(v: Array, axis: Array) -> float:
    return float(np.linalg.norm(v - (v @ axis) * axis))


class Measure:
    """Distances of bodies of a claim's table by Coal."""

    def __init__(self, claim: Claim) -> None:
        self._claim, self._shapes = claim, {}

    def __call__(self, first: int, other: int, T_first: Array, T_other: Array) -> tuple[float, Array]:
        """Return the distance [m], negative for a penetration, and the direction from the other body to the first one."""
        library, bodies = coal(), self._claim.bodies
        request, result = library.DistanceRequest(), library.DistanceResult()
        request.gjk_tolerance, request.gjk_max_iterations = 1e-9, 256
        A, B = self._placed(first, T_first), self._placed(other, T_other)
        if bodies.half_space[other]:
            n = bodies.axis[other]
            points = _points(self._claim, first, T_first)
            disc = bodies.disc[first] * _across(n, T_first[:3, :3] @ bodies.axis[first])
            plane = float(n @ bodies.vertices[bodies.first_point[other]])
            return float((points @ n).min()) - disc - bodies.radius[first] - plane, n
        distance = library.distance(*A, *B, request, result)
        return float(distance), -np.array(result.normal)

    def _placed(self, body: int, T: Array) -> tuple[Any, Any]:
        if body not in self._shapes:
            self._shapes[body] = self._shape(body)
        shape, own = self._shapes[body]
        at = T @ own
        return shape, coal().Transform3s(at[:3, :3], at[:3, 3])

    def _shape(self, body: int) -> tuple[Any, Array]:
        bodies, T = self._claim.bodies, np.eye(4)
        points, radius = _points(self._claim, body, np.eye(4)), float(bodies.radius[body])
        if bodies.disc[body]:
            T[:3, :3], T[:3, 3] = _axes(bodies.axis[body]), points.mean(axis=0)
            return coal_cylinder(float(bodies.disc[body]), float(np.linalg.norm(points[1] - points[0])) / 2, radius), T
        if len(points) == 1:
            T[:3, 3] = points[0]
            return coal().Sphere(radius), T
        if len(points) == 2:
            T[:3, :3], T[:3, 3] = _axes(points[1] - points[0]), points.mean(axis=0)
            half = float(np.linalg.norm(points[1] - points[0])) / 2
            return (coal().Capsule(radius, 2 * half) if radius else coal_box(np.array([1e-12, 1e-12, half]), 0.0)), T
        T[:3, 3] = points.mean(axis=0)
        return coal_polytope(points - T[:3, 3], radius), T


def _axes(z: Array) -> Array:
    z = z / np.linalg.norm(z)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def find_proof(claim: Claim, *, beyond: float = MARGIN, finest: float = 1e-6, most: int = 200_000) -> ProofTree | None:
    """Return a proof of a claim, or None if a pair has too little, or if it would be too long.

    Args:
        claim: what must be shown.
        beyond: by how much every pair must keep more than is required [m].
        finest: share of the path below which no stretch is halved.
        most: number of nodes.
    """
    measure, root = Measure(claim), ()
    stretches: dict[tuple[int, ...], Stretch] = {root: Stretch(claim, claim.path.whole())}
    nodes = [(int(a), int(b), root) for a, b in zip(claim.pairs.first, claim.pairs.other, strict=True)]
    steps: list[int] = []
    directions: list[Array] = []
    while nodes:
        following: list[tuple[int, int, tuple[int, ...]]] = []
        for a, b, way in nodes:
            step, direction = _step(measure, stretches[way], a, b, beyond)
            if step == HALVES:
                share = float(stretches[way].interval.share[0])
                if share < finest:
                    return None
                _halve(claim, stretches, way)
            if step is None or len(steps) > most:
                return None
            steps.append(step)
            if step == SETTLED:
                directions.append(direction)
            following += _children(claim, a, b, way, step)
        nodes = following
    return ProofTree(steps=np.array(steps, np.uint8), directions=np.array(directions, np.float64).reshape(-1, 3))


def _step(measure: Measure, stretch: Stretch, a: int, b: int, beyond: float) -> tuple[int | None, Array]:
    claim, bodies = stretch.claim, stretch.claim.bodies
    required = held_to(claim, a, b, stretch.begin, stretch.end)
    distance, n = measure(a, b, stretch.T[bodies.frame[a]], stretch.T[bodies.frame[b]])
    known = bound(stretch, a, b, n) if np.linalg.norm(n) > 0.5 else Bound(left=-np.inf, gap=-np.inf)
    if known.left > required + beyond:
        return SETTLED, n
    excess = known.gap - required
    opens = excess < _OPENS * (known.gap - known.left) if np.isfinite(known.gap) else True
    if opens and (bodies.members[a] or bodies.members[b]):
        first = bodies.members[a] and (not bodies.members[b] or bodies.radius[a] >= bodies.radius[b])
        return (MEMBERS_OF_FIRST if first else MEMBERS_OF_OTHER), n
    at = held_to(claim, a, b, stretch.u, stretch.u)
    if not bodies.members[a] and not bodies.members[b] and distance <= at:
        return None, n
    return HALVES, n


def held_to(claim: Claim, a: int, b: int, begin: float, end: float) -> float:
    """Return what two bodies of the table are held to on a stretch [m]."""
    link, other = np.array([claim.bodies.owner[a]]), np.array([b])
    return float(claim.held.on(link, other, np.array([begin]), np.array([end]))[0][0])


def _halve(claim: Claim, stretches: dict[tuple[int, ...], Stretch], way: tuple[int, ...]) -> None:
    if (*way, 0) not in stretches:
        both = claim.path.halved(stretches[way].interval)
        for side in (0, 1):
            stretches[(*way, side)] = Stretch(claim, both.select(np.array([side])))


def _children(claim: Claim, a: int, b: int, way: tuple[int, ...], step: int) -> list[tuple[int, int, tuple[int, ...]]]:
    bodies = claim.bodies
    if step == HALVES:
        return [(a, b, (*way, 0)), (a, b, (*way, 1))]
    if step == MEMBERS_OF_FIRST:
        return [(int(bodies.first_member[a]) + i, b, way) for i in range(int(bodies.members[a]))]
    if step == MEMBERS_OF_OTHER:
        return [(a, int(bodies.first_member[b]) + i, way) for i in range(int(bodies.members[b]))]
    return []
