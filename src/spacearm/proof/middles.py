"""Bodies at the middles of stretches, and how far they can get from there.

With joint values v, joint k's share in a body's motion relative to the frame it is watched from is at most rho_k |dv_k|: rho_k
is the distance of the body's axis (of an end of it, whichever is further) from joint k's axis *at the middle*, or 1 for a
slide. Moving the joints one after the other, those nearest to the frame first, shows that no drift of rho_k has to be allowed
for. docs/certificate.md has the proofs of `way` and `bend`.

Where the arm moves the base, all is in the inertial frame. A body's motion there is its motion about the system's centre of
mass with the base at rest, to which the same bounds apply (every joint has a lever arm, less its share in that centre's), and
the base's turn about that centre (see `recoil`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.bodies import Bodies, RelativeBodies
from spacearm.proof.recoil import BaseMotionBounds
from spacearm.proof.spans import Lines
from spacearm.proof.vectors import cross
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MotionBounds = Callable[[Array, Array, Array, Array, Array], BaseMotionBounds | None]
"""Bounds the base's motion on stretches; see `BaseProof.motion_bounds`."""

Frames = Callable[[Array, Array], Array]
"""Takes parameters (r,) of the curve and joint values (r, j), gives T_w_joint (r, j + 1, 4, 4); the last is the base itself."""

_ROUNDING = 1e-15  # of a joint's value, relative
_NUMBERS = 500_000  # at once
_SQUARED_ROUNDING = 1e-14  # of a squared distance that comes as a difference


class JointMap:
    """From the robot's n degrees of freedom to its j joints' values, mimics included."""

    def __init__(self, robot: Robot) -> None:
        self.dof = np.array([joint.dof for joint in robot.joints])
        self.multiplier = np.array([joint.multiplier for joint in robot.joints])
        self.offset = np.array([joint.offset for joint in robot.joints])
        self.reach = np.array([joint.T_parent_joint[:3, 3] for joint in robot.joints])  # (j, 3) from the joint before [m]
        self.turns = np.array([joint.kind == "revolute" for joint in robot.joints])

    def values(self, q: Array) -> Array:
        """Return the joints' values (r, j) at configurations (r, n)."""
        return q[:, self.dof] * self.multiplier + self.offset


def _stays(*_: Array) -> None:
    """Return None, the bounds of a base that stays."""


class Middles:
    """Some relative bodies at the middles of r stretches.

    Attributes:
        frames: (r, j + 1, 4, 4) T_w_joint.
        position: (r, b, e, 3) the ends of all bodies' axes, in the inertial frame [m].
        u, half: (r,) where they are on the curve, and half the stretches' lengths.
        row: where in what follows a relative body stands, -1 for those not watched.
        way: (r, m, e) no end of a relative body's axis gets further than this from where it is at the middle [m].
        velocity: (r, m, e, 3) of the ends there, per unit of u, in inertial axes.
        bend: (r, m, e) along any direction fixed in the frame watched from, an end gets no further than half the length times
            its velocity along it, and this [m].
    """

    def __init__(
        self,
        bodies: Bodies,
        relative_bodies: RelativeBodies,
        joints: JointMap,
        frames: Frames,
        lines: Lines,
        base_motion: MotionBounds = _stays,
    ) -> None:
        self._bodies, self._relative_bodies, self._joints = bodies, relative_bodies, joints
        values = joints.values(lines.q)
        self.frames = frames(lines.u, values)
        self.u, self.half = lines.u, lines.h
        at = self.frames[:, bodies.joint]  # (r, b, 4, 4)
        self.position = bodies.ends @ np.swapaxes(at[..., :3, :3], -1, -2) + at[..., None, :3, 3]
        scale = np.abs(joints.multiplier)
        self._rate = lines.rate[:, joints.dof] * joints.multiplier  # (r, j)
        self._drift = lines.drift[:, joints.dof] * scale + _ROUNDING * np.abs(values)
        self._step = np.abs(self._rate) * lines.h[:, None] + self._drift
        self._z, self._origin = self.frames[:, :-1, :3, 2], self.frames[:, :-1, :3, 3]  # (r, j, 3)
        self._base_bounds = base_motion(self.frames, self._rate, self._drift, self._step, lines.h)

    def watch(self, used: Indices) -> None:
        """Bound the motions of some relative bodies (m,), and of these only."""
        self.row = np.full(len(self._relative_bodies.body), -1)
        self.row[used] = np.arange(len(used))
        size = self.position.shape[0] * self.position.shape[2] * self._step.shape[1]
        batch = max(1, _NUMBERS // max(size, 1))
        parts = [self._watched(used[i : i + batch]) for i in range(0, len(used), batch)]
        self.way, self.bend, self.velocity = (np.concatenate(column, axis=1) for column in zip(*parts, strict=True))

    def _watched(self, used: Indices) -> tuple[Array, Array, Array]:
        """Return way, bend and velocity of some relative bodies."""
        body, motion = self._relative_bodies.body[used], self._relative_bodies.motion[used]
        points = self.position[:, body]  # (r, m, e, 3)
        free = self._relative_bodies.free[motion]  # (m,)
        moves = np.where(free[:, None], 1.0, np.abs(self._relative_bodies.sign)[motion])  # (m, j)
        rho = self._reach(points, motion, free)
        way = np.einsum("rmej,rmj->rme", rho, self._step[:, None] * moves)
        pairs = self._step[:, None] * np.einsum("pki,ri->rpk", self._relative_bodies.order, self._step) / 2  # (r, p, j)
        bend = np.einsum("rmej,rmj->rme", rho, self._drift[:, None] * moves + pairs[:, motion])
        bend += way * (pairs @ self._joints.turns)[:, motion, None]
        velocity = self._velocity(points, motion)
        if self._base_bounds is not None and free.any():
            self._add_base_motion(self._base_bounds, points, free, way, bend, velocity)
        return way, bend, velocity

    def _reach(self, points: Array, motion: Indices, free: NDArray[np.bool_]) -> Array:
        """Return rho (r, m, e, j), rounded up."""
        away = points[..., None, :] - self._origin[:, None, None]
        slides = np.ones((len(free), 1, away.shape[-2]))
        if self._base_bounds is not None and free.any():
            carried = self._relative_bodies.sign[motion[free]]  # (f, j)
            pull = self._base_bounds.pull[:, None, None]
            away[:, free] = away[:, free] * carried[:, None, :, None] - pull
            slides[free, 0] = np.abs(carried - self._base_bounds.share)
        along = np.einsum("rmejc,rjc->rmej", away, self._z)
        squared = np.einsum("rmejc,rmejc->rmej", away, away)
        rho = np.sqrt(np.maximum(squared - along**2, 0.0) + _SQUARED_ROUNDING * squared)
        return np.where(self._joints.turns, rho, slides)

    def _add_base_motion(
        self,
        base: BaseMotionBounds,
        points: Array,
        free: NDArray[np.bool_],
        way: Array,
        bend: Array,
        velocity: Array,
    ) -> None:
        """Add the base's turn and the centre of mass's way to bodies that are watched from the inertial frame."""
        about = points[:, free] - base.center[:, None, None]  # (r, f, e, 3)
        radius = np.sqrt(np.einsum("rmec,rmec->rme", about, about))
        turn, half = base.turn[:, None, None], self.half[:, None, None]
        bend[:, free] += turn * way[:, free] + radius * (turn**2 / 2 + base.bend[:, None, None] + base.off)
        way[:, free] += radius * (turn + base.off) + np.linalg.norm(base.along, axis=-1)[:, None, None] * half
        turns, z = self._joints.turns[:, None], self._z
        lever = np.where(turns, cross(z, base.pull), z * base.share[:, None])
        centers = np.einsum("rj,rjc->rc", self._rate, lever)  # of the centre of mass, with the base held
        velocity[:, free] += (base.along - centers)[:, None, None] + cross(base.omega[:, None, None], about)

    def _velocity(self, points: Array, motion: Indices) -> Array:
        """Return omega x p + v, from the twists (r, p, 3) of the relative motions."""
        turns = self._joints.turns[:, None]
        spin = self._z * turns * self._rate[..., None]
        push = np.where(turns, cross(self._origin, self._z), self._z) * self._rate[..., None]
        omega, v = self._relative_bodies.sign @ spin, self._relative_bodies.sign @ push
        return cross(omega[:, motion, None], points) + v[:, motion, None]
