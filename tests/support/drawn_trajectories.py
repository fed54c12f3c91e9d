"""Trajectories as attackers and bad recorders make them, and a checker of certificates that shares no code with the proof.

Jumps, stairs, rests, dwells, steep laws, huge values beside small ones, pieces of a microsecond, high degrees, tables. Limits
and obstacles are drawn so that they are just kept or just broken. The checker has its own kinematics and distances (NumPy),
looks at samples around every join, and takes rates and accelerations from differences of positions.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from spacearm.dynamics import Momentum
from spacearm.geometry import Capsule, HalfSpace, Obstacle, Scene, Sphere, pose
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory
from spacearm.proof import Certificate
from spacearm.robot import Body, Frame, Joint, LinkCapsule, Robot
from support.floating_arms import Way, along

EPS = float(np.finfo(np.float64).eps)
AT_ONCE = 4000  # instants of a trajectory that are looked at


class Case(NamedTuple):
    """What a certificate is asked about, and how it was drawn; `base`, `base_start` and `momentum` as a Problem has them."""

    kind: str
    robot: Robot
    scene: Scene
    trajectory: AnyTrajectory
    given: PiecewisePath | None
    base: str
    base_start: Any
    momentum: Momentum | None
    clearance: float = 0.0


def drawn_case(seed: int, number: int) -> Case:
    """Draw a case from (seed, number).

    Raises:
        SpacearmError: what was drawn is refused.
    """
    rng = np.random.default_rng((seed, number))
    floats = bool(rng.random() < 0.06)
    robot = _robot(rng, floats)
    kind = str(rng.choice(list(_PATHS)))
    made: Any = _PATHS[kind](rng, robot.dof)
    momentum = None
    if floats and rng.random() < 0.6:
        momentum = Momentum(linear=0.1 * rng.normal(size=3), angular=0.05 * rng.normal(size=3))
    given = made if isinstance(made, PiecewisePath) else None
    if given is not None:
        trajectory: AnyTrajectory = RecordedTrajectory(robot, given, momentum=momentum)
    else:
        motion, law, duration = made
        quick = replace(robot, velocity=np.full(robot.dof, 1e12), acceleration=np.full(robot.dof, 1e24))
        trajectory = Trajectory(quick, motion, time_law=law, duration=duration, momentum=momentum)
    t = instants(rng, trajectory, 1500)
    q = trajectory.sample(t).q
    robot = _limited(rng, robot, t, q)
    scene = Scene(_obstacles(rng, robot, q))
    return Case(kind, robot, scene, trajectory, given, robot.base, None, momentum)


# ---- robots, limits, obstacles -----------------------------------------------------------------------------------------


def _robot(rng: np.random.Generator, floats: bool) -> Robot:
    count = int(rng.integers(2, 4)) if floats else int(rng.integers(1, 5))
    joints, dofs = [], 0
    for i in range(count):
        follows = bool(dofs and rng.random() < 0.15)
        joints.append(
            Joint(
                name=f"j{i}",
                kind="prismatic" if rng.random() < 0.25 and not floats else "revolute",
                parent=i - 1 if rng.random() < 0.85 else -1,
                T_parent_joint=pose(rng.choice([0.4, 0.4, 5.0]) * rng.normal(size=3), rng.normal(size=4)),
                dof=int(rng.integers(0, dofs)) if follows else dofs,
                multiplier=float(rng.choice([-1.0, 0.5, 2.0])) if follows else 1.0,
                offset=0.3 if follows else 0.0,
            )
        )
        dofs += not follows
    capsules = tuple(
        LinkCapsule(name=f"link{i}", joint=i, a=0.2 * rng.normal(size=3), b=0.4 * rng.normal(size=3), radius=0.05)
        for i in range(count)
    )
    bodies: tuple[Body, ...] = ()
    if floats:
        bodies = tuple(
            Body(
                name=f"body{i}",
                joint=i,
                mass=20.0 if i < 0 else 3.0,
                com=0.1 * rng.normal(size=3),
                inertia=np.eye(3) * (2.0 if i < 0 else 0.1),
            )
            for i in range(-1, count)
        )
    far = [(i, k) for i in range(count) for k in range(i + 2, count)]
    return Robot(
        name="drawn",
        joints=tuple(joints),
        capsules=capsules,
        bodies=bodies,
        base="floating" if floats else "fixed",
        frames=(Frame(name="tip", joint=count - 1, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=np.full(dofs, -np.inf),
        upper=np.full(dofs, np.inf),
        velocity=np.ones(dofs),
        acceleration=np.ones(dofs),
        self_pairs=tuple((f"link{i}", f"link{k}") for i, k in far if rng.random() < 0.5),
    )


def _limited(rng: np.random.Generator, robot: Robot, t: np.ndarray, q: np.ndarray) -> Robot:
    """Give limits that are about as much as is used."""
    near = lambda: np.exp(rng.normal(size=robot.dof) * rng.choice([1e-7, 1e-3, 0.3, 3.0]) + rng.choice([0.0, 0.5, 3.0, 3.0]))  # noqa: E731
    rates = np.abs(np.diff(q, axis=0) / np.diff(t)[:, None])
    span = np.maximum(np.ptp(q, axis=0), 1e-9) * 0.5 * near()
    middle = (q.max(axis=0) + q.min(axis=0)) / 2
    bends = np.abs(np.diff(rates, axis=0)) / np.maximum(t[2:] - t[:-2], 1e-9)[:, None]
    share = float(rng.choice([0.8, 0.98, 1.0, 1.0]))  # of the instants: what is quick for an instant only may be overlooked
    bounded = rng.random(robot.dof) < 0.5
    return replace(
        robot,
        lower=np.where(bounded, middle - span, -np.inf),
        upper=np.where(bounded, middle + span, np.inf),
        velocity=np.maximum(np.quantile(rates, share, axis=0), 1e-9) * near(),
        acceleration=np.maximum(np.quantile(bends, share, axis=0), 1e-9) * near(),
    )


def _obstacles(rng: np.random.Generator, robot: Robot, q: np.ndarray) -> list[Obstacle]:
    """What the arm passes at a small gap, or touches, at one of these configurations."""
    a, b = capsule_ends(robot, q)
    out: list[Obstacle] = []
    for _ in range(int(rng.integers(0, 4))):
        link = int(rng.integers(0, len(robot.capsules)))
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        ends = np.stack([a[:, link], b[:, link]], axis=1)
        heights = ends @ n
        at = np.unravel_index(int(np.argmax(heights)), heights.shape)
        gap = float(rng.choice([-1, 1, 1]) * 10 ** rng.uniform(-8, -1))
        surface = ends[at] + (robot.capsules[link].radius + gap) * n
        shape = rng.integers(0, 3)
        if shape == 0:
            out.append(Sphere(surface + 0.05 * n, 0.05))
        elif shape == 1:
            side = np.cross(n, rng.normal(size=3))
            out.append(Capsule(surface + 0.05 * n - side, surface + 0.05 * n + side, 0.05))
        else:
            out.append(HalfSpace(-n, surface))
    return out


# ---- paths -------------------------------------------------------------------------------------------------------------


def _times(rng: np.random.Generator, pieces: int) -> np.ndarray:
    steps = np.maximum(float(rng.choice([1.0, 1e-1, 1e-3, 1e-5, 2e-6])) * rng.uniform(0.5, 1.5, pieces), 1.1e-6)
    if rng.random() < 0.3:
        steps[rng.integers(0, pieces)] = 1.0
    return np.concatenate([[0.0], np.cumsum(steps)])


def _rows(rng: np.random.Generator, count: int, dof: int) -> np.ndarray:
    """Rows that wander, now and then rest, some joints far from 0 and some hardly moving."""
    q = np.cumsum(rng.normal(size=(count, dof)) * 10.0 ** rng.uniform(-3, 0), axis=0) / np.sqrt(count)
    q *= 10.0 ** rng.choice([0, 0, 0, -4, -8], dof)
    for _ in range(int(rng.integers(0, 3))):
        first = int(rng.integers(0, count))
        q[first : first + int(rng.integers(1, count + 1))] = q[first]
    return q + rng.choice([0.0, 0.0, 1.0], dof) * 10.0 ** rng.uniform(0, 5.9, dof)


def _table(rng: np.random.Generator, dof: int) -> PiecewisePath:
    count = int(rng.choice([2, 5, 30, 300]))
    t, q = _times(rng, count - 1), _rows(rng, count, dof)
    how = rng.integers(0, 4)
    if how == 0:
        return PiecewisePath.from_linear(t, q)
    if how == 1:
        return PiecewisePath.from_cubic(t, q, ends=str(rng.choice(["clamped", "natural"])))  # type: ignore[arg-type]
    v = np.gradient(q, t, axis=0)
    if how == 2:
        return PiecewisePath.from_cubic(t, q, v)
    return PiecewisePath.from_quintic(t, q, v, np.gradient(v, t, axis=0))


def _jumping(rng: np.random.Generator, dof: int) -> PiecewisePath:
    """A table whose pieces are moved off each other a little."""
    path = _table(rng, dof)
    points = path.coefficients.copy()
    joint, size = int(rng.integers(0, dof)), 10 ** rng.uniform(-18, -7)
    which = rng.random(len(points)) < rng.choice([0.02, 0.5, 1.0])
    points[which, :, joint] += size * rng.choice([-1.0, 1.0, 1.0], int(which.sum()))[:, None]
    return PiecewisePath(path.breaks, points)


def _stairs(rng: np.random.Generator, dof: int) -> PiecewisePath:
    """Constant pieces whose steps are about the rounding of the largest number there is."""
    count = int(rng.choice([20, 300, 3000]))
    base = rng.normal(size=dof) * 10.0 ** rng.uniform(-2, 5.9, dof)
    step = rng.choice([0.2, 0.9, 1.5]) * 64 * EPS * max(1.0, np.abs(base).max())
    steps = np.zeros((count, dof))
    steps[:, int(rng.integers(0, dof))] = step * rng.choice([-1, 0, 1, 1, 1], count)
    q = base * rng.choice([0, 1], dof) + np.cumsum(steps, axis=0)
    return PiecewisePath(_times(rng, count), np.repeat(q[:, None], int(rng.integers(1, 5)), axis=1))


def _bent(rng: np.random.Generator, dof: int) -> PiecewisePath:
    """Lines in tiny pieces whose corners are about the rounding of the numbers."""
    count = int(rng.choice([50, 1000]))
    t = np.concatenate([[0.0], np.cumsum(np.full(count, float(rng.choice([2e-6, 1e-5]))))])
    base = rng.normal(size=dof) * 10.0 ** rng.uniform(-2, 5.9, dof)
    corner = rng.choice([0.1, 1.0, 3.0]) * 128 * EPS * np.maximum(1.0, np.abs(base)) * rng.choice([0, 1, 1], dof)
    q = base + np.cumsum(np.cumsum(np.broadcast_to(corner, (count + 1, dof)), axis=0), axis=0)
    return PiecewisePath.from_linear(t, q)


def _high(rng: np.random.Generator, dof: int) -> PiecewisePath:
    degree, pieces = int(rng.choice([6, 12, 30, 30 if rng.random() < 0.9 else 100])), int(rng.integers(1, 4))
    points = rng.normal(size=(pieces, degree + 1, dof)) * 10.0 ** rng.uniform(-2, float(rng.choice([0, 2, 5])), dof)
    points[1:, 0] = points[:-1, -1]
    return PiecewisePath(_times(rng, pieces), points)


def _law(rng: np.random.Generator) -> TimeLaw | None:
    """Steps between dwells, steep or not: every piece begins and ends at rest, or the law is one polynomial."""
    how = rng.integers(0, 6)
    if how == 0:
        return None
    if how == 1:  # nearly all of the way in hardly any time
        x, share, a = rng.uniform(0.2, 0.8), 10 ** rng.uniform(-7.5, -5), 10 ** rng.uniform(-4, -1)
        b = 1 - a
        return TimeLaw([0, x, x + share, 1], [[0, a / 2, a, a], [a, a, b, b], [b, b, 1 - a / 2, 1]])
    if how == 2:
        inner = np.sort(rng.uniform(0, 1, int(rng.integers(0, 8))) ** rng.choice([0.1, 1, 8]))
        return TimeLaw([0, 1], [[0, *inner, 1]])
    count = int(rng.integers(1, 6))
    lengths = 10.0 ** rng.uniform(float(rng.choice([-6.5, -3, -0.5])), 0, count)
    rises = rng.uniform(0, 1, count) * rng.choice([0, 1, 1], count)
    rises[int(rng.integers(0, count))] += 0.2
    x = np.concatenate([[0.0], np.cumsum(lengths) / lengths.sum()])
    s = np.concatenate([[0.0], np.cumsum(rises) / rises.sum()])
    x[-1] = s[-1] = 1.0
    if rng.random() < 0.5:  # a break of the law at a knot, or nearly
        s[1:-1] = np.round(s[1:-1] * 12) / 12 + rng.choice([0.0, 1e-9, -1e-7])
        s = np.maximum.accumulate(np.clip(s, 0, 1))
    middle = rng.uniform(0, 1, count)
    return TimeLaw(x, [[a, a, a + m * (b - a), b, b] for a, b, m in zip(s[:-1], s[1:], middle, strict=True)])


def _timed(rng: np.random.Generator, dof: int) -> tuple[Motion, TimeLaw | None, float]:
    points = _rows(rng, int(rng.choice([2, 3, 4, 12])), dof)
    if rng.random() < 0.4:  # out, a rest, and back or on: a piece of the spline that does not move
        points = np.vstack(
            [
                points[0],
                *[points[0] + 10 ** rng.uniform(-2, 0) * rng.normal(size=dof)] * 10,
                points[int(rng.integers(0, 2)) - 1],
            ]
        )
    return Motion(np.clip(points, -1e5, 1e5)), _law(rng), float(10 ** rng.uniform(-1, 2))


_PATHS: dict[str, Any] = {
    "table": _table,
    "jumps": _jumping,
    "stairs": _stairs,
    "corners": _bent,
    "high degree": _high,
    "time law": _timed,
    "more time laws": _timed,
}


# ---- the checker -------------------------------------------------------------------------------------------------------


def instants(rng: np.random.Generator, trajectory: AnyTrajectory, count: int) -> np.ndarray:
    """Instants all over, on both sides of joins, and within pieces however short; increasing."""
    breaks = trajectory.path.breaks if trajectory.duration > 0 else np.zeros(1)
    some = np.sort(rng.choice(len(breaks), min(len(breaks), count // 8), replace=False))
    lengths = np.append(np.diff(breaks), 0.0)[some]
    near = breaks[some, None] + lengths[:, None] * np.array([-1e-3, 0.0, 1e-3, 0.3, 0.5, 0.999])
    t = np.concatenate(
        [near.ravel(), np.linspace(0, trajectory.duration, count // 8), rng.uniform(0, trajectory.duration, count // 8)]
    )
    return np.unique(np.clip(t, 0, trajectory.duration))


def capsule_ends(robot: Robot, q: np.ndarray, T_w_b: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Both ends of every capsule's axis (rows, capsules, 3), from the definition of Robot."""
    base = np.tile(np.eye(4), (len(q), 1, 1)) if T_w_b is None else T_w_b
    placed: list[np.ndarray] = []
    for joint in robot.joints:
        value = joint.multiplier * q[:, joint.dof] + joint.offset
        own = np.tile(np.eye(4), (len(q), 1, 1))
        if joint.kind == "revolute":
            own[:, 0, 0] = own[:, 1, 1] = np.cos(value)
            own[:, 1, 0] = np.sin(value)
            own[:, 0, 1] = -own[:, 1, 0]
        else:
            own[:, 2, 3] = value
        placed.append((base if joint.parent < 0 else placed[joint.parent]) @ joint.T_parent_joint @ own)
    frames = [base if link.joint < 0 else placed[link.joint] for link in robot.capsules]
    a, b = (
        np.stack(
            [T[:, :3, :3] @ getattr(link, end) + T[:, :3, 3] for T, link in zip(frames, robot.capsules, strict=True)], axis=1
        )
        for end in ("a", "b")
    )
    return a, b


def to_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances of points to segments."""
    d = b - a
    along = ((p - a) * d).sum(-1) / np.maximum((d * d).sum(-1), 1e-300)
    return np.linalg.norm(a + np.clip(along, 0, 1)[..., None] * d - p, axis=-1)


def between_segments(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distances of segments a-b and c-d: at an end of one, or where their lines are nearest."""
    least = np.minimum.reduce([to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b)])
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = ((x * y).sum(-1) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    area = uu * vv - uv**2
    skew = area > 1e-12 * uu * vv
    area = np.where(skew, area, 1.0)
    s, t = (uv * vw - vv * uw) / area, (uu * vw - uv * uw) / area
    inside = skew & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    return np.where(inside, np.minimum(least, np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)), least)


def least_clearance(case: Case, q: np.ndarray, T_w_b: np.ndarray | None = None) -> float:
    """The least clearance at configurations (rows, n) [m]."""
    robot, least = case.robot, np.inf
    a, b = capsule_ends(robot, q, T_w_b)
    for i, link in enumerate(robot.capsules):
        for item in case.scene.obstacles:
            if isinstance(item, Sphere):
                away = to_segment(item.center, a[:, i], b[:, i]) - item.radius
            elif isinstance(item, Capsule):
                away = between_segments(
                    a[:, i], b[:, i], np.broadcast_to(item.a, a[:, i].shape), np.broadcast_to(item.b, a[:, i].shape)
                )
                away = away - item.radius
            else:
                assert isinstance(item, HalfSpace)
                away = np.minimum((a[:, i] - item.point) @ item.normal, (b[:, i] - item.point) @ item.normal)
            least = min(least, float(away.min()) - link.radius)
    index = {link.name: i for i, link in enumerate(robot.capsules)}
    for one, other in robot.self_pairs:
        i, k = index[one], index[other]
        away = between_segments(a[:, i], b[:, i], a[:, k], b[:, k])
        least = min(least, float(away.min()) - robot.capsules[i].radius - robot.capsules[k].radius)
    return least


def complaints(case: Case, certificate: Certificate, rng: np.random.Generator) -> list[str]:
    """Return what is wrong with a certificate that holds, in sentences; none, if all that it says is so."""
    if not certificate.holds:
        return []
    out: list[str] = []
    t = instants(rng, case.trajectory, AT_ONCE)
    q = case.trajectory.sample(t).q
    size = np.maximum(1.0, np.abs(q).max(axis=0))
    if case.given is not None:  # as it was drawn, before anything was closed
        strayed = np.abs(case.given.sample(t) - q)
        if (strayed > 64 * EPS * (size.max() + np.abs(case.given.coefficients).max())).any():
            out.append(f"the path is not what was given, by {strayed.max():.3g}")
    out += _clearance_complaints(case, certificate, t, q)
    robot = case.robot
    if "position" in certificate.checked:
        beyond = np.maximum(q - robot.upper, robot.lower - q) / size
        if (beyond > 1e-11).any():
            out.append(f"a position limit is passed by {beyond.max():.3g} of the joint's size")
    if "velocity" in certificate.checked:
        for step in (1, 7, 60):
            dt = (t[step:] - t[:-step])[:, None]
            noise = (
                8 * EPS * (size + np.abs(t[step:])[:, None] * robot.velocity)
                + EPS * certificate.trajectory.duration * robot.velocity
            )
            excess = np.abs(q[step:] - q[:-step]) - noise - robot.velocity * dt * (1 + 1e-9)
            if (excess > 0).any():
                i, joint = np.unravel_index(int(np.argmax(excess / dt / robot.velocity)), excess.shape)
                share = float(np.abs(q[i + step] - q[i])[joint] / dt[i, 0] / robot.velocity[joint])
                out.append(
                    f"joint {int(joint)} moves at {share:.6g} times its limit between {t[i]:.9g} and {t[i + step]:.9g} s"
                )
                break
    if "acceleration" in certificate.checked:
        out += _acceleration_complaints(case, t, size)
    return out


def _clearance_complaints(case: Case, certificate: Certificate, t: np.ndarray, q: np.ndarray) -> list[str]:
    assert certificate.clearance is not None
    if np.isinf(certificate.clearance):
        return []
    T_w_b = None
    if case.base == "floating":
        way = _way(case)
        if way is None:
            return []
        q, T_w_b = way.q, way.T_w_b
        most = np.random.default_rng(0).permutation(len(q))[:AT_ONCE]
        q, T_w_b = q[most], T_w_b[most]
    allowed = 1e-9 + 1e-5 * (case.base == "floating")  # the integrator's own error
    least = least_clearance(case, q, T_w_b)
    if least < certificate.clearance - allowed:
        return [f"proven {certificate.clearance:.9g} m, seen {least:.9g} m"]
    return []


def _way(case: Case) -> Way | None:
    """Integrate the base's motion, in steps as short as it takes; None if the arm turns too far for that."""
    before, steps = None, 60
    while steps * case.trajectory.curve.pieces < 20_000:
        way = along(case, case.trajectory, steps=steps)  # type: ignore[arg-type]
        if before is not None and np.abs(way.T_w_b[-1] - before).max() < 1e-6:
            return way
        before, steps = way.T_w_b[-1], 2 * steps
    return None


def _acceleration_complaints(case: Case, t: np.ndarray, size: np.ndarray) -> list[str]:
    """By second differences at several steps, where they tell more than rounding."""
    robot, duration = case.robot, case.trajectory.duration
    speed = robot.velocity
    for h in duration * np.array([1e-1, 1e-2, 1e-3, 1e-4, 1e-5]):
        at = np.clip(t, h, duration - h)
        before, here, after = (case.trajectory.sample(at + k * h).q for k in (-1, 0, 1))
        noise = 32 * EPS * (size + speed * duration)
        excess = np.abs(after - 2 * here + before) - noise - robot.acceleration * h**2 * (1 + 1e-6)
        if (excess > 0).any():
            i, joint = np.unravel_index(int(np.argmax(excess)), excess.shape)
            share = float((excess[i, joint] / h**2 + robot.acceleration[joint]) / robot.acceleration[joint])
            return [
                f"joint {int(joint)} is accelerated at {share:.6g} times its limit around {at[i]:.9g} s (steps of {h:.3g} s)"
            ]
    return []
