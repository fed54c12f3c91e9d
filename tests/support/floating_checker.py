"""Where floating robots are, by a checker that shares nothing with the proof: its own kinematics, momentum and distances.

The attitude is integrated by Magnus's method of fourth order or, where the spacecraft tumbles, Runge and Kutta's, twice: with
so many steps and half as many.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from spacearm.dynamics import Momentum
from spacearm.geometry import Capsule, HalfSpace, Scene, Sphere
from spacearm.motion import AnyTrajectory, RecordedTrajectory
from spacearm.planner import BaseLimits
from spacearm.proof import Certificate
from spacearm.proof.base_proofs import FloatingBaseProof, base_setup_of, begun_base_proof
from spacearm.robot import Robot

STEPS = 500  # of the integration, over all pieces
ROUNDING = 1e-8  # of lengths, relative to the robot's size; of angles [rad]
Array = np.ndarray


class Case(NamedTuple):
    """What a certificate is asked about."""

    robot: Robot
    scene: Scene
    base_limits: BaseLimits
    base: str
    base_start: Array
    momentum: Momentum
    clearance: float = 0.0


class Motions(NamedTuple):
    """Where the checker has a robot, at m instants of its curve.

    Attributes:
        u: (m,) of the path over time, or of a path without momentum.
        R, at: (m, 3, 3) and (m, 3) the base's pose in the inertial frame.
        ends: (m, c, 2, 3) of the capsules' axes, in the inertial frame.
        rate, carried: (m,) the base's rate of turn, and the arm's angular momentum, per unit of u.
        off: by how much the attitudes may be wrong [rad].
    """

    u: Array
    R: Array
    at: Array
    ends: Array
    rate: Array
    carried: Array
    off: float


class Moving(NamedTuple):
    """The robot with its base held: m configurations, base axes."""

    frames: list[Array]
    center: Array
    H: Array
    carried: Array


def moving(robot: Robot, q: Array, dq: Array) -> Moving:
    """Kinematics and angular momentum about the centre of mass, joint by joint; of complex joint values, too."""
    m, frames = len(q), []

    def zeros(*shape: int) -> Array:
        return np.zeros(shape, dtype=q.dtype)

    spins: list[Array] = []
    speeds: list[Array] = []  # of the joints' origins
    for joint in robot.joints:
        above = joint.parent
        R0, x0, w0, v0 = (
            (np.broadcast_to(np.eye(3), (m, 3, 3)), zeros(m, 3), zeros(m, 3), zeros(m, 3))
            if above < 0
            else (frames[above][:, :3, :3], frames[above][:, :3, 3], spins[above], speeds[above])
        )
        R, x = R0 @ joint.T_parent_joint[:3, :3], x0 + R0 @ joint.T_parent_joint[:3, 3]
        value, rate = joint.multiplier * q[:, joint.dof] + joint.offset, joint.multiplier * dq[:, joint.dof]
        z, v = R[:, :, 2], v0 + np.cross(w0, x - x0)
        if joint.kind == "revolute":
            c, s = np.cos(value)[:, None], np.sin(value)[:, None]
            R = np.stack([R[:, :, 0] * c + R[:, :, 1] * s, R[:, :, 1] * c - R[:, :, 0] * s, z], axis=2)
            w = w0 + z * rate[:, None]
        else:
            x, w = x + z * value[:, None], w0
            v = v0 + np.cross(w0, x - x0) + z * rate[:, None]
        T = zeros(m, 4, 4)
        T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = R, x, 1.0
        frames.append(T)
        spins.append(w)
        speeds.append(v)
    frames.append(np.broadcast_to(np.eye(4), (m, 4, 4)))
    spins.append(zeros(m, 3))
    speeds.append(zeros(m, 3))
    mass = np.array([body.mass for body in robot.bodies])
    r = np.stack([frames[b.joint][:, :3, :3] @ b.com + frames[b.joint][:, :3, 3] for b in robot.bodies], axis=1)
    dr = np.stack(
        [speeds[b.joint] + np.cross(spins[b.joint], r[:, i] - frames[b.joint][:, :3, 3]) for i, b in enumerate(robot.bodies)],
        axis=1,
    )
    center, center_rate = (np.einsum("b,mbc->mc", mass, of) / mass.sum() for of in (r, dr))
    H, carried = zeros(m, 3, 3), zeros(m, 3)
    for i, body in enumerate(robot.bodies):
        R = frames[body.joint][:, :3, :3]
        inertia, s = R @ body.inertia @ np.swapaxes(R, 1, 2), r[:, i] - center
        H += inertia + body.mass * ((s**2).sum(axis=1)[:, None, None] * np.eye(3) - s[:, :, None] * s[:, None])
        carried += (inertia @ spins[body.joint][..., None])[..., 0] + body.mass * np.cross(s, dr[:, i] - center_rate)
    return Moving(frames, center, H, carried)


def nodes_of(path: Any, finer: int) -> tuple[Array, Array]:
    """Return steps (k, 2) that begin and end where pieces do, and the pieces' ends."""
    pieces = path.hulls(0, bisections=0)[0]
    each = finer * max(2, -(-STEPS // 2 // len(pieces)))
    cut = np.array([np.linspace(low, high, each + 1) for low, high in pieces])
    return np.stack([cut[:, :-1], cut[:, 1:]], axis=2).reshape(-1, 2), pieces


def within(path: Any, u: Array, pieces: Array, each: int, derivative: int) -> Array:
    """Sample (k, x) points, each row inside of its own piece."""
    owner = np.repeat(np.arange(len(pieces)), each)
    low, high = pieces[owner].T
    inner = np.clip(u, (low + 1e-9 * (high - low))[:, None], (high - 1e-9 * (high - low))[:, None])
    return path.sample(inner.ravel(), derivative)


def integrated(robot: Robot, path: Any, momentum: Momentum, start: Array, finer: int) -> tuple[Array, Array]:
    """Return the ends of all steps (k + 1,), and the base's R (k + 1, 3, 3) there."""
    cut, pieces = nodes_of(path, finer)
    each, h = len(cut) // len(pieces), cut[:, 1] - cut[:, 0]
    L = momentum.angular
    shares = np.array([0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6]) if not L.any() else np.array([0.0, 0.5, 1.0])
    u = cut[:, :1] + h[:, None] * shares
    found = moving(robot, within(path, u, pieces, each, 0), within(path, u, pieces, each, 1))
    inverse = np.linalg.inv(found.H)
    push = -(inverse @ found.carried[..., None])[..., 0].reshape(len(cut), len(shares), 3)
    if L.any():
        Q = _runge_kutta(push, inverse.reshape(len(cut), 3, 3, 3), h, L)
    else:
        one, two = push[:, 0], push[:, 1]
        Q = _products(_exp(h[:, None] / 2 * (one + two) + np.sqrt(3) / 12 * h[:, None] ** 2 * np.cross(one, two)))
    return np.append(cut[:, 0], cut[-1, 1]), start[:3, :3] @ _matrices(Q)


def _runge_kutta(push: Array, inverse: Array, h: Array, L: Array) -> Array:
    """Solve Q' = Q o omega / 2 step by step, omega = push + H^-1 R^T L; L in the axes of the start."""
    x, y, z = L.tolist()

    def slope(Q: tuple[float, ...], p: list[float], Y: list[list[float]]) -> tuple[float, ...]:
        a, b, c, d = Q
        n = 1 / (a * a + b * b + c * c + d * d)
        l0 = ((a * a + b * b - c * c - d * d) * x + 2 * (b * c + a * d) * y + 2 * (b * d - a * c) * z) * n
        l1 = (2 * (b * c - a * d) * x + (a * a - b * b + c * c - d * d) * y + 2 * (c * d + a * b) * z) * n
        l2 = (2 * (b * d + a * c) * x + 2 * (c * d - a * b) * y + (a * a - b * b - c * c + d * d) * z) * n
        i, j, k = (p[r] + Y[r][0] * l0 + Y[r][1] * l1 + Y[r][2] * l2 for r in range(3))
        return (
            0.5 * (-b * i - c * j - d * k),
            0.5 * (a * i + c * k - d * j),
            0.5 * (a * j - b * k + d * i),
            0.5 * (a * k + b * j - c * i),
        )

    Q: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    out = [Q]
    for (p0, p1, p2), (Y0, Y1, Y2), step in zip(push.tolist(), inverse.tolist(), h.tolist(), strict=True):
        one = slope(Q, p0, Y0)
        two = slope(tuple(q + step / 2 * s for q, s in zip(Q, one, strict=True)), p1, Y1)
        three = slope(tuple(q + step / 2 * s for q, s in zip(Q, two, strict=True)), p1, Y1)
        four = slope(tuple(q + step * s for q, s in zip(Q, three, strict=True)), p2, Y2)
        Q = tuple(q + step / 6 * (a + 2 * b + 2 * c + d) for q, a, b, c, d in zip(Q, one, two, three, four, strict=True))
        out.append(Q)
    found = np.array(out)
    return found / np.linalg.norm(found, axis=1)[:, None]


def _exp(turn: Array) -> Array:
    angle = np.linalg.norm(turn, axis=1)[:, None]
    return np.concatenate([np.cos(angle / 2), turn / 2 * np.sinc(angle / 2 / np.pi)], axis=1)


def _times(a: Array, b: Array) -> Array:
    w, v, x, y = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
    return np.concatenate([w * x - (v * y).sum(axis=1)[:, None], w * y + x * v + np.cross(v, y)], axis=1)


def _products(steps: Array) -> Array:
    """Return 1, the first step, the first two, ... (k + 1, 4)."""
    out, far = np.concatenate([np.array([[1.0, 0, 0, 0]]), steps]), 1
    while far < len(out):
        out[far:] = _times(out[:-far].copy(), out[far:])
        far *= 2
    return out / np.linalg.norm(out, axis=1)[:, None]


def _matrices(Q: Array) -> Array:
    w, v = Q[:, 0], Q[:, 1:]
    skew = np.zeros((len(Q), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        skew[:, j, i], skew[:, i, j] = v[:, k], -v[:, k]
    return np.eye(3) + 2 * (w[:, None, None] * skew + skew @ skew)


def checked(case: Case, trajectory: AnyTrajectory) -> Motions:
    """Integrate twice, the second time in twice the steps, and place the capsules."""
    robot, momentum, start = case.robot, case.momentum, case.base_start
    tumbling = bool(momentum.angular.any() or momentum.linear.any())
    path: Any = trajectory.path if tumbling else trajectory.curve
    own = Momentum(angular=start[:3, :3].T @ momentum.angular)
    _, coarse = integrated(robot, path, own, start, 1)
    u, R = integrated(robot, path, own, start, 2)
    off = float(np.linalg.norm(R[::2] - coarse, axis=(1, 2)).max())  # some 20 times the error of the finer one
    pieces = path.hulls(0, bisections=0)[0]
    cut = np.stack([u[:-1], u[1:]], axis=1)
    each = len(cut) // len(pieces)
    # Each end of a step as the end of its own piece: rates may jump between pieces.
    found = moving(robot, within(path, cut, pieces, each, 0), within(path, cut, pieces, each, 1))
    Rs = np.stack([R[:-1], R[1:]], axis=1).reshape(-1, 3, 3)
    local = np.swapaxes(Rs, 1, 2) @ momentum.angular
    omega = np.linalg.solve(found.H, (local - found.carried)[..., None])[..., 0]
    mass = sum(body.mass for body in robot.bodies)
    begin = start[:3, :3] @ found.center[0] + start[:3, 3]
    drift = momentum.linear / mass if tumbling else np.zeros(3)
    at = begin + (cut.ravel() - u[0])[:, None] * drift - (Rs @ found.center[..., None])[..., 0]
    ends = []
    for capsule in robot.capsules:
        T = found.frames[capsule.joint]
        both = [(Rs @ (T[:, :3, :3] @ end + T[:, :3, 3])[..., None])[..., 0] + at for end in (capsule.a, capsule.b)]
        ends.append(np.stack(both, axis=1))
    spin, carried = np.linalg.norm(omega, axis=1), np.linalg.norm(found.carried, axis=1)
    return Motions(cut.ravel(), Rs, at, np.stack(ends, axis=1), spin, carried, off)


def to_segments(ends: Array, a: Array, b: Array) -> Array:
    """Distances (m, c) of segments (m, c, 2, 3) to the segment a-b: the ends of each to the other, and where they cross."""

    def to_point(p: Array, low: Array, high: Array) -> Array:
        way = high - low
        length = (way * way).sum(axis=-1)
        share = np.clip(((p - low) * way).sum(axis=-1) / np.where(length > 0, length, 1.0), 0, 1)
        return np.linalg.norm(p - low - share[..., None] * way, axis=-1)

    low, high = ends[:, :, 0], ends[:, :, 1]
    best = np.minimum(to_point(a, low, high), to_point(b, low, high))
    best = np.minimum(best, np.minimum(to_point(low, a, b), to_point(high, a, b)))
    u, v, w = high - low, b - a, low - a
    A, B, C, D, E = (u * u).sum(-1), (u * v).sum(-1), float(v @ v), (u * w).sum(-1), (v * w).sum(-1)
    det = A * C - B * B
    fine = det > 1e-12 * np.maximum(A * C, 1e-300)
    s, t = (np.where(fine, of / np.where(fine, det, 1.0), -1.0) for of in (B * E - C * D, A * E - B * D))
    inside = fine & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    across = np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
    return np.where(inside, np.minimum(best, across), best)


def distances(robot: Robot, scene: Scene, ends: Array) -> Array:
    """Return the clearances (m,) of capsules from balls, capsules and half-spaces."""
    radius = np.array([capsule.radius for capsule in robot.capsules])
    least = np.full(len(ends), np.inf)
    for obstacle in scene.obstacles:
        if isinstance(obstacle, Sphere):
            away = to_segments(ends, obstacle.center, obstacle.center) - obstacle.radius
        elif isinstance(obstacle, Capsule):
            away = to_segments(ends, obstacle.a, obstacle.b) - obstacle.radius
        else:
            assert isinstance(obstacle, HalfSpace)
            away = ((ends - obstacle.point) @ obstacle.normal).min(axis=2)
        least = np.minimum(least, (away - radius).min(axis=1))
    return least


# ---- its verdict ------------------------------------------------------------------------------------------------------


def speed_of(trajectory: AnyTrajectory, way: Motions) -> Array:
    """du/dt (m,): 1 if u is time."""
    if way.u[-1] != trajectory.curve.domain[1] or isinstance(trajectory, RecordedTrajectory):
        return np.ones(len(way.u))
    if not trajectory.momentum.is_zero:
        return np.ones(len(way.u))
    if trajectory.time_law is None:
        return np.full(len(way.u), 1 / trajectory.duration)
    share = trajectory.time_law.inverse(way.u)
    return trajectory.time_law.sample(share, 1) / trajectory.duration


def turned(way: Motions) -> Array:
    relative = way.R[0].T @ way.R
    return 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(relative - np.eye(3), axis=(1, 2)) / np.sqrt(8)))


def complaints(case: Case, trajectory: AnyTrajectory, way: Motions, certificate: Certificate) -> list[str]:
    """Say what is wrong with a certificate."""
    out, speed = [], speed_of(trajectory, way)
    found = certificate.base_findings
    assert found is not None
    size = float(np.abs(way.ends - way.at[:, None, None]).max()) + 1e-6
    reach = size + float(np.abs(way.at).max())
    proof = begun_base_proof(case.robot, trajectory, base_setup_of(case, case.robot, who="problem"))
    assert isinstance(proof, FloatingBaseProof)
    begin, end = proof.curve.domain  # as far along as the checker is, whether that is time or not
    inner = np.clip(begin + (way.u - way.u[0]) * ((end - begin) / (way.u[-1] - way.u[0])), begin, end)
    missed = float(np.linalg.norm(proof.attitude.at(inner) - way.R, axis=(1, 2)).max() / np.sqrt(2))
    if not missed <= found.error + way.off + ROUNDING:
        out.append(
            f"the attitude is off by {missed:.3g} rad, said to be at most {found.error:.3g}; the checker's {way.off:.2g}"
        )
    for name, value, said in (
        ("peak", float(turned(way).max()), found.rotation_peak),
        ("rate", float((way.rate * speed).max()), found.rate),
        ("joint momentum", float((way.carried * speed).max()), found.joint_momentum),
    ):
        if value > said * (1 + 1e-7) + way.off + ROUNDING * (name == "peak"):
            out.append(f"{name} is {value:.9g}, said to be at most {said:.9g}")
    if certificate.holds:
        limits = case.base_limits
        for name, value in (
            ("peak", turned(way).max()),
            ("rate", (way.rate * speed).max()),
            ("joint_momentum", (way.carried * speed).max()),
        ):
            limit = getattr(limits, name)
            if limit is not None and value > limit * (1 + 1e-7) + way.off + ROUNDING * (name == "peak"):
                out.append(f"it holds, and {name} is {value:.9g}, its limit {limit:.9g}")
        least = float(distances(case.robot, case.scene, way.ends).min())
        allowed = ROUNDING * reach + (way.off + 1e-9) * size
        if certificate.clearance is None or least < certificate.clearance - allowed:
            out.append(f"proven {certificate.clearance} m, measured {least:.9g} m")
    return out


def looseness(trajectory: AnyTrajectory, way: Motions, certificate: Certificate) -> float:
    """By how much the greatest rate said exceeds the one that the checker saw, relative."""
    assert certificate.base_findings is not None
    seen = float((way.rate * speed_of(trajectory, way)).max())
    return certificate.base_findings.rate / seen - 1 if seen > 1e-9 else 0.0
