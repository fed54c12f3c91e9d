"""How far the joints, and with them the robot's bodies, get from where they are at the midpoint of an interval.

An interval is a run of consecutive pieces of the curve, or a part of one piece. On each, for every u and for each joint,

    |q(u) - q(m) - w (u - m)| <= e,    |u - m| <= h

with the midpoint m, a rate w and a deviation e. On a part of a piece, w is q'(m) and e is h^2/2 times the greatest |q''| by the
hull of the piece (Taylor). On a run of pieces q' may jump between them. There w is the centre of all rates that occur, by their
hulls, and e is h times half their range.

These give two bounds for a point of a body, such as the end of its axis or a corner: the displacement bound, and the
second-order bound for its displacement along a direction. Joint k moves it by at most rho_k |dv_k|. Here rho_k is its distance
from the joint's axis *at the midpoint*, or 1 for a prismatic joint. docs/certificate.md, sections 3 to 5, has the proofs; the
letters are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import cross
from spacearm.motion import Curve
from spacearm.proof.base_momentum import BaseMotionBounds
from spacearm.proof.bodies import Bodies, BodyGroup, JointMap, RelativeBodies, body_axes
from spacearm.proof.solids import Balls, Boxes, Solids, solids_of_cores

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_FIRST_INTERVALS = 12  # intervals to begin with, at least
_EPS = float(np.finfo(np.float64).eps)
_SAMPLE_ROUNDING = 64 * _EPS  # times the greatest coefficient of a joint: the rounding of its samples and rates
_ROUNDING_PER_DEGREE = 4 * _EPS  # likewise, in addition for every degree of the polynomials
_JOIN_ROUNDING = 64 * _EPS  # likewise, for each join of two pieces: what PiecewisePath takes for no jump
_VALUE_ROUNDING = 1e-15  # times a joint's value at the midpoint: the rounding of multiplier and offset
_DISTANCE_ROUNDING = 1e-14  # times a squared distance, which is added to rho^2, a difference of squares
_NUMBERS = 500_000  # in an array that is computed at once: 4 MB

MotionBounds = Callable[[Array, Array, Array, Array, Array], BaseMotionBounds | None]
"""Bounds the base's motion on intervals; see `BaseProof.motion_bounds`."""

Frames = Callable[[Array, Array], Array]
"""Takes parameters (r,) of the curve and joint values (r, j); gives T_w_joint (r, j + 1, 4, 4), the last for the base."""


# ---- Bounds of the joints --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intervals:
    """r intervals of a curve.

    Attributes:
        first, last: (r,) its pieces are first to last - 1.
        ends: (r, 2) where they begin and end, in u.
        share: (r,) of the curve, if all its pieces count alike.
    """

    first: Indices
    last: Indices
    ends: Array
    share: Array

    def __len__(self) -> int:
        """Return r."""
        return len(self.first)

    def select(self, which: Indices) -> Intervals:
        """Return some of them."""
        return Intervals(first=self.first[which], last=self.last[which], ends=self.ends[which], share=self.share[which])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearBounds:
    """Straight lines through the midpoints of intervals, and how far the curve deviates from them.

    Attributes:
        u: (r,) the midpoints m.
        half: (r,) half the lengths h.
        q, rate: (r, n) the configuration and the rate w there.
        deviation: (r, n) e, for every u of the interval.
    """

    u: Array
    half: Array
    q: Array
    rate: Array
    deviation: Array


class PathIntervals:
    """A curve's pieces, cut until there are enough intervals to begin with, and bounds of the joints' motion on intervals."""

    def __init__(self, curve: Curve) -> None:
        self._curve = curve
        bisections = 0
        while curve.pieces << bisections < _FIRST_INTERVALS:
            bisections += 1
        self._ends, self._least_rate, self._greatest_rate = curve.hulls(1, bisections=bisections)
        _, low, high = curve.hulls(2, bisections=bisections)
        self._second = np.maximum(-low, high)  # (p, n) the greatest |q''|
        self._speed = np.maximum(-self._least_rate, self._greatest_rate)  # (p, n) the greatest |q'|
        _, low, high = curve.hulls(0, bisections=0)  # the coefficients themselves: values between them may be far smaller
        self._size = np.maximum(1.0, np.maximum(-low, high).max(axis=0))  # (n,)
        self._rounding = _SAMPLE_ROUNDING + _ROUNDING_PER_DEGREE * curve.degree

    def first(self) -> Intervals:
        """Return the intervals to begin with, which make up the whole curve."""
        pieces = len(self._ends)
        cuts = np.unique(np.linspace(0, pieces, min(pieces, 2 * _FIRST_INTERVALS) + 1).astype(np.intp))
        first, last = cuts[:-1], cuts[1:]
        ends = np.stack([self._ends[first, 0], self._ends[last - 1, 1]], axis=1)
        return Intervals(first=first, last=last, ends=ends, share=(last - first) / pieces)

    def halved(self, of: Intervals) -> Intervals:
        """Return two for each: a run of pieces is divided between two of them, a part of a piece at its midpoint."""
        run = of.last - of.first > 1
        between = (of.first + of.last) // 2
        parted: Indices = np.minimum(between, len(self._ends) - 1)
        center: Array = of.ends.mean(axis=1)
        middle = np.where(run, self._ends[parted, 0], center)
        first = np.stack([of.first, np.where(run, between, of.first)], axis=1).ravel()
        last = np.stack([np.where(run, between, of.last), of.last], axis=1).ravel()
        return Intervals(
            first=first,
            last=last,
            ends=np.stack([of.ends[:, 0], middle, middle, of.ends[:, 1]], axis=1).reshape(-1, 2),
            share=np.where(np.repeat(run, 2), (last - first) / len(self._ends), np.repeat(of.share, 2) / 2),
        )

    def linear_bounds(self, of: Intervals) -> LinearBounds:
        """Return the straight lines, and the deviations for every u of the intervals."""
        u = of.ends.mean(axis=1)
        half = (np.diff(of.ends, axis=1)[:, 0] / 2 + 2 * _EPS * np.abs(of.ends).max(axis=1))[:, None]
        rate, second = self._curve.sample(u, 1), self._second[of.first]
        deviation = second * half**2 / 2
        speed = self._speed[of.first]
        # A part of a piece so short that its midpoint is one of its ends is bounded like a run: q' there may be of another.
        inside = (u > of.ends[:, 0]) & (u < of.ends[:, 1])
        for i in np.flatnonzero((of.last - of.first > 1) | ~inside):
            low = self._least_rate[of.first[i] : of.last[i]].min(axis=0)
            high = self._greatest_rate[of.first[i] : of.last[i]].max(axis=0)
            rate[i], deviation[i] = (low + high) / 2, (high - low) / 2 * half[i]
            speed[i] = np.maximum(-low, high)
        joins = _JOIN_ROUNDING * np.maximum(0, of.last - of.first - 1)[:, None] * self._size
        rounding = joins + self._rounding * (self._size + speed * half + deviation)
        return LinearBounds(u=u, half=half[:, 0], q=self._curve.sample(u), rate=rate, deviation=deviation + rounding)


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
