"""How far the robot's bodies get from where they are at the midpoint of an interval.

`path_intervals` bounds the joints' motion. That gives two bounds for a point of a body, such as the end of its axis or a
corner: the displacement bound, and the second-order bound for its displacement along a direction. Joint k moves it by at most
rho_k |dv_k|. Here rho_k is its distance from the joint's axis *at the midpoint*, or 1 for a prismatic joint.
docs/certificate.md, sections 3 to 5, has the proofs; the letters are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import cross
from spacearm.proof.base_momentum import BaseMotionBounds
from spacearm.proof.bodies import Bodies, BodyGroup, JointMap, RelativeBodies, body_axes
from spacearm.proof.path_intervals import LinearBounds
from spacearm.proof.solids import Balls, Boxes, Solids, solids_of_cores

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_VALUE_ROUNDING = 1e-15  # times a joint's value at the midpoint: the rounding of multiplier and offset
_DISTANCE_ROUNDING = 1e-14  # times a squared distance, which is added to rho^2, a difference of squares
_NUMBERS = 500_000  # in an array that is computed at once: 4 MB

MotionBounds = Callable[[Array, Array, Array, Array, Array], BaseMotionBounds | None]
"""Bounds the base's motion on intervals; see `BaseProof.motion_bounds`."""

Frames = Callable[[Array, Array], Array]
"""Takes parameters (r,) of the curve and joint values (r, j); gives T_w_joint (r, j + 1, 4, 4), the last for the base."""


# ---- Displacement bounds of the bodies -------------------------------------------------------------------------------


def _at_rest(*_: Array) -> None:
    """Return None: the motion bounds of a base at rest."""


@dataclass(slots=True, kw_only=True, eq=False)
class PointBounds:
    """How the points of a group's bodies move on r intervals; `BodyGroup` says which points.

    Attributes:
        position: (r, g, e, 3) of all bodies of the group at the midpoints, in the inertial frame [m].
        displacement_bound: (r, m, e) no point of a relative body gets further than this from its midpoint's place [m].
        furthest: (r, m) the greatest of them; of boxes, cylinders and polytopes only.
        velocity: (r, m, e, 3) at the midpoints, per unit of u, in inertial axes [m].
        second_order_bound: (r, m, e) along any direction fixed in the frame of the other body, a point gets no further than
            half the length times its velocity along it, plus this [m].
    """

    position: Array
    displacement_bound: Array
    furthest: Array
    velocity: Array
    second_order_bound: Array


class IntervalMidpoints:
    """The robot's bodies at the midpoints of r intervals, and bounds for some relative bodies on the whole intervals.

    Moving the joints one after the other, those nearest to the frame of the other body first, shows that no change of rho_k has
    to be allowed for. Where the arm moves the base, all is in the inertial frame. A body's motion there is its motion about the
    system's centre of mass with the base at rest, and the base's rotation about that centre. To the first the same bounds
    apply, with the joints' lever arms less their share in the centre's motion.

    Attributes:
        frames: (r, j + 1, 4, 4) T_w_joint.
        u, half: (r,) where the midpoints are on the curve, and half the intervals' lengths.
        groups: the points of each group of bodies; their bounds after `bound`.
        row: (number of relative bodies,) the index m of a relative body in the bounds of its group.
    """

    def __init__(
        self,
        bodies: Bodies,
        relative_bodies: RelativeBodies,
        joints: JointMap,
        frames: Frames,
        linear: LinearBounds,
        base_motion: MotionBounds = _at_rest,
    ) -> None:
        self._bodies, self._relative_bodies, self._joints = bodies, relative_bodies, joints
        values = joints.values(linear.q)
        self.frames = frames(linear.u, values)
        self.u, self.half = linear.u, linear.half
        self.groups = [self._placed(group) for group in bodies.groups]
        self.row = np.full(len(relative_bodies.body), -1)
        self._solids: dict[int, Solids] = {}
        scale = np.abs(joints.multiplier)
        self._rate = linear.rate[:, joints.dof] * joints.multiplier  # (r, j)
        self._deviation = linear.deviation[:, joints.dof] * scale + _VALUE_ROUNDING * np.abs(values)
        self._step = np.abs(self._rate) * linear.half[:, None] + self._deviation
        self._z, self._origin = self.frames[:, :-1, :3, 2], self.frames[:, :-1, :3, 3]  # (r, j, 3)
        self._base_bounds = base_motion(self.frames, self._rate, self._deviation, self._step, linear.half)

    def _placed(self, group: BodyGroup) -> PointBounds:
        """Return the points of a group at the midpoints; nothing is bounded yet."""
        at = self.frames[:, self._bodies.joint[group.body]]  # (r, g, 4, 4)
        position = group.points @ np.swapaxes(at[..., :3, :3], -1, -2) + at[..., None, :3, 3]
        none = np.zeros((len(self.frames), 0, 0))
        return PointBounds(position=position, displacement_bound=none, furthest=none, velocity=none, second_order_bound=none)

    def solids(self, group: int) -> Solids:
        """Return the bodies of a group as solids at the midpoints: body k of g on interval i is number i g + k."""
        if group not in self._solids:
            self._solids[group] = self._solids_of(group)
        return self._solids[group]

    def _solids_of(self, group: int) -> Solids:
        some, position, count = self._bodies.groups[group], self.groups[group].position, len(self.half)
        at = self.frames[:, self._bodies.joint[some.body]]
        if some.cores:
            center = np.array([core.T[:3, 3] for core in some.cores])
            origin = np.einsum("rgcd,gd->rgc", at[..., :3, :3], center) + at[..., :3, 3]
            axes = at[..., :3, :3] @ body_axes(self._bodies)[group]
            return solids_of_cores(some.cores, self._bodies.radius[some.body], axes, origin)
        radius, center = np.tile(self._bodies.radius[some.body], count), position.mean(axis=2).reshape(-1, 3)
        none = np.zeros(len(radius), np.intp)
        if some.points.shape[1] == 1:
            return Balls(center=center, radius=radius, obstacle=none, first=none, count=none)
        half = np.zeros((len(radius), 3))
        half[:, 2] = np.tile(np.linalg.norm(some.points[:, 1] - some.points[:, 0], axis=1) / 2, count)
        axes = (at[..., :3, :3] @ body_axes(self._bodies)[group]).reshape(-1, 3, 3)
        return Boxes(axes=axes, origin=center, half=half, radius=radius, obstacle=none)

    def bound(self, used: Indices) -> None:
        """Bound the motions of some relative bodies (m,), and of no others of their groups."""
        if not used.size:
            return
        if len(self.groups) == 1:
            self.row = np.full(len(self._relative_bodies.body), -1)
            self._bound_group(0, used)
            return
        every = self._bodies.group[self._relative_bodies.body]
        for group in np.unique(every[used]).tolist():
            self.row[every == group] = -1  # nothing is known of the others any more
            self._bound_group(group, used[every[used] == group])

    def _bound_group(self, group: int, used: Indices) -> None:
        into = self.groups[group]
        self.row[used] = np.arange(len(used))
        size = into.position.shape[0] * into.position.shape[2] * self._step.shape[1]
        batch = max(1, _NUMBERS // max(size, 1))
        parts = [self._bounds(into.position, used[i : i + batch]) for i in range(0, len(used), batch)]
        into.displacement_bound, into.second_order_bound, into.velocity = (
            np.concatenate(column, axis=1) for column in zip(*parts, strict=True)
        )
        if group:
            into.furthest = into.displacement_bound.max(axis=2)

    def _bounds(self, position: Array, used: Indices) -> tuple[Array, Array, Array]:
        """Return displacement bound, second-order bound and velocity of the points of some relative bodies of a group."""
        body, motion = self._relative_bodies.body[used], self._relative_bodies.motion[used]
        points = position[:, self._bodies.place[body]]  # (r, m, e, 3)
        free = self._relative_bodies.free[motion]  # (m,)
        moves = np.where(free[:, None], 1.0, np.abs(self._relative_bodies.sign)[motion])  # (m, j)
        rho = self._rho(points, motion, free)
        first = np.einsum("rmej,rmj->rme", rho, self._step[:, None] * moves)
        pairs = self._step[:, None] * np.einsum("pki,ri->rpk", self._relative_bodies.order, self._step) / 2  # (r, p, j)
        second = np.einsum("rmej,rmj->rme", rho, self._deviation[:, None] * moves + pairs[:, motion])
        second += first * (pairs @ self._joints.revolute)[:, motion, None]
        velocity = self._velocity(points, motion)
        if self._base_bounds is not None and free.any():
            self._add_base_motion(self._base_bounds, points, free, first, second, velocity)
        return first, second, velocity

    def _rho(self, points: Array, motion: Indices, free: NDArray[np.bool_]) -> Array:
        """Return rho_k (r, m, e, j) [m, or 1 for a prismatic joint], rounded up."""
        away = points[..., None, :] - self._origin[:, None, None]
        prismatic = np.ones((len(free), 1, away.shape[-2]))
        if self._base_bounds is not None and free.any():
            carried = self._relative_bodies.sign[motion[free]]  # (f, j)
            away[:, free] = away[:, free] * carried[:, None, :, None] - self._base_bounds.com_lever[:, None, None]
            prismatic[free, 0] = np.abs(carried - self._base_bounds.mass_share)
        along = np.einsum("rmejc,rjc->rmej", away, self._z)
        squared = np.einsum("rmejc,rmejc->rmej", away, away)
        rho = np.sqrt(np.maximum(squared - along**2, 0.0) + _DISTANCE_ROUNDING * squared)
        return np.where(self._joints.revolute, rho, prismatic)

    def _add_base_motion(
        self, base: BaseMotionBounds, points: Array, free: NDArray[np.bool_], first: Array, second: Array, velocity: Array
    ) -> None:
        """Add the base's rotation and the motion of the centre of mass to bodies that move in the inertial frame."""
        about = points[:, free] - base.com[:, None, None]  # (r, f, e, 3)
        radius = np.sqrt(np.einsum("rmec,rmec->rme", about, about))
        rotation, half = base.rotation[:, None, None], self.half[:, None, None]
        beyond = rotation**2 / 2 + base.rotation_second_order[:, None, None] + base.attitude_error
        second[:, free] += rotation * first[:, free] + radius * beyond
        drift = np.linalg.norm(base.com_velocity, axis=-1)[:, None, None] * half
        first[:, free] += radius * (rotation + base.attitude_error) + drift
        revolute, z = self._joints.revolute[:, None], self._z
        lever = np.where(revolute, cross(z, base.com_lever), z * base.mass_share[:, None])
        com_rate = np.einsum("rj,rjc->rc", self._rate, lever)  # of the centre of mass, if the base were at rest
        velocity[:, free] += (base.com_velocity - com_rate)[:, None, None] + cross(base.omega[:, None, None], about)

    def _velocity(self, points: Array, motion: Indices) -> Array:
        """Return omega x p + v, from the twists (r, p, 3) of the relative motions."""
        revolute = self._joints.revolute[:, None]
        spin = self._z * revolute * self._rate[..., None]
        push = np.where(revolute, cross(self._origin, self._z), self._z) * self._rate[..., None]
        omega, v = self._relative_bodies.sign @ spin, self._relative_bodies.sign @ push
        return cross(omega[:, motion, None], points) + v[:, motion, None]
