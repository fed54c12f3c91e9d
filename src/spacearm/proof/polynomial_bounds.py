"""How fast momentum can grow off the real axis: what bounds a polynomial's error between the points where it is right.

On a panel of the path, xi from -1 to 1, joint values are polynomials, and the inertia H and the arm's angular momentum h v' are
entire functions of xi. Let rho > 1, and E the ellipse with the foci -1 and 1 whose half axes are (rho + 1/rho) / 2 and
(rho - 1/rho) / 2. A function that is analytic in E and no greater than M there has Chebyshev coefficients of at most
2 M rho^-j, so a polynomial of degree n - 1 comes closer to it than

    2 M rho^(1 - n) / (rho - 1)        on [-1, 1].

(Trefethen, Approximation Theory and Approximation Practice, theorems 8.1 and 8.2; for vectors with their norm.) Here are such
M, for some rho at once. With a joint's value a + i b its rotation has the norm e^|b|, and |x . y|, |x x y| <= |x| |y| for
complex vectors too. docs/certificate.md has the sums.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import kept
from spacearm.motion import Curve
from spacearm.motion.piecewise import halvings, weights
from spacearm.proof.displacement import JointMap
from spacearm.proof.moving_bodies import ancestors, masses_of
from spacearm.robot import Robot

# ---- -----------------------------------------------------------------------------------------------------------------
# Close upper bounds of polynomials on panels, for every point: samples, and by how much more there may be between.
#
# With xi = cos(theta) a polynomial is a sum of c_j cos(j theta): smooth for all theta, and stationary where it is
# greatest. So its greatest value exceeds the nearest of samples that are d apart in theta by no more than d^2 / 8
# times a bound of its second derivative. Where that is too much the samples are taken closer, around those that may
# be near the greatest.

Array = NDArray[np.float64]

_FINER = 16
_LOOKS = 5
_ROWS = 200_000  # at once, beyond which nothing is looked at more closely
_OUTWARD = 1 + 1e-12


def greatest_norm(coefficients: Array, scale: Array, extra: Array, *, close: float = 2e-6) -> float:
    """Bound scale times the norm of vector polynomials, plus extra, over all panels and all their points.

    Args:
        coefficients: (p, d + 1, c) Chebyshev coefficients.
        scale, extra: (p,) of each panel, 0 or more.
        close: by what share the bound may exceed a value that is reached; it holds even where that was not to be had.
    """
    count = coefficients.shape[1]
    sizes, j = np.linalg.norm(coefficients, axis=2), np.arange(float(count))
    first, second = sizes @ j, sizes @ j**2
    curved = 2 * (first**2 + sizes.sum(axis=1) * second)  # |d^2 |f|^2 / d theta^2| at most
    step = np.pi / (2 * count)
    values = _on_grid(count) @ coefficients
    squared = np.einsum("pgc,pgc->pg", values, values).ravel()
    panel = np.repeat(np.arange(len(curved)), 2 * count)
    theta = np.tile(_grid(count), len(curved))
    bound = reached = 0.0
    for look in range(_LOOKS):
        if look:
            step /= _FINER
            panel = np.repeat(panel, _FINER)
            theta = (theta[:, None] + (np.arange(_FINER) - (_FINER - 1) / 2) * step).ravel()
            values = np.einsum("rd,rdc->rc", np.cos(theta[:, None] * j), coefficients[panel])
            squared = np.einsum("rc,rc->r", values, values)
        value = scale[panel] * np.sqrt(squared) + extra[panel]
        above = scale[panel] * np.sqrt(squared + curved[panel] * step**2 / 8) + extra[panel]
        reached, most = max(reached, float(value.max())), float(above.max())
        passed = reached * (1 + close / 2)  # what is left out below is no greater
        near = above > passed
        if most <= reached * (1 + close) or look == _LOOKS - 1 or near.sum() * _FINER > _ROWS:
            return max(bound, most) * _OUTWARD
        bound = max(bound, passed)
        panel, theta = panel[near], theta[near]
    return bound


def _grid(count: int) -> Array:
    return (np.arange(2 * count) + 0.5) * np.pi / (2 * count)


@lru_cache(maxsize=32)
def _on_grid(count: int) -> Array:
    """Map Chebyshev coefficients to values on the grid, (2 count, count)."""
    out = np.cos(np.outer(_grid(count), np.arange(count)))
    out.setflags(write=False)
    return out


# ---- -----------------------------------------------------------------------------------------------------------------
# How fast momentum can grow off the real axis: what bounds a polynomial's error between the points where it is right.


RHO = np.array([1.0, 1.2, 1.6, 2.1, 2.9, 4.0, 5.5, 8.0, 12.0, 20.0, 40.0, 100.0, 250.0])
"""The ellipses; the first is the real panel itself."""

_EPS = float(np.finfo(np.float64).eps)
_STEEP = 80.0  # beyond e to the power of that nothing is learned
_HIGH = 8  # degrees above which rounding, times rho to that power, counts
_AT_ONCE = 128  # panels, so that what is computed stays in the cache
_WIDER = 2.0 ** np.arange(1, 13)
_LEAST = 1e-300


class Growth(NamedTuple):
    """Bounds on p panels, on each of r ellipses; all rates per unit of xi.

    Attributes:
        inertia: (p, r) of |H| [kg m^2].
        carried: (p, r) of |h v'| [N m s].
        travel: (p, j) of the joints' |v'| on the panel itself [rad or m].
    """

    inertia: Array
    carried: Array
    travel: Array


class PanelPath(NamedTuple):
    """The joints' path on p panels, as polynomials of xi.

    Attributes:
        ends: (p, 2) of the panels, in u.
        values: (p, d + 1, j) Bernstein coefficients of the joints' values [rad or m].
        rates: (p, e + 1, j) those of their derivatives, per unit of xi.
        coarse: (p, j) greatest of these on the whole piece of the curve, scaled to the panel's xi.
        share: (p,) of the piece that the panel is.
        size: (p, j) of the joints' greatest coefficients on the piece: what rounding is relative to.
    """

    ends: Array
    values: Array
    rates: Array
    coarse: Array
    share: Array
    size: Array

    @classmethod
    def of(cls, curve: Curve, joints: JointMap) -> PanelPath:
        """Return a curve's own pieces."""
        ends = curve.hulls(0, bisections=0)[0]
        values = curve.bezier()[..., joints.dof] * joints.multiplier + joints.offset
        rates = curve.bezier(1)[..., joints.dof] * joints.multiplier * (np.diff(ends, axis=1) / 2)[..., None]
        return cls(ends, values, rates, np.abs(rates).max(axis=1), np.ones(len(ends)), np.abs(values).max(axis=1))

    @property
    def travel(self) -> Array:
        """How far each joint travels, at most, (p, j) [rad or m]."""
        return 2 * np.abs(self.rates).max(axis=1)

    def halves(self) -> PanelPath:
        """Return two panels for each."""
        middle = self.ends.mean(axis=1)
        ends = np.stack([self.ends[:, 0], middle, middle, self.ends[:, 1]], axis=1).reshape(-1, 2)
        values, rates = (
            (halvings(of.shape[1] - 1, 1) @ of[:, None]).reshape(-1, *of.shape[1:]) for of in (self.values, self.rates)
        )
        coarse, share, size = (np.repeat(of, 2, axis=0) for of in (self.coarse / 2, self.share / 2, self.size))
        return PanelPath(ends, values, rates / 2, coarse, share, size)


@kept
def ellipses_of(robot: Robot) -> Ellipses:
    """Return a robot's."""
    return Ellipses(robot)


class Ellipses:
    """A robot's masses, as far as they bound its momentum at complex joint values."""

    def __init__(self, robot: Robot) -> None:
        masses = masses_of(robot)
        base = masses.joint < 0
        middle = masses.mass[base] @ masses.com[base] / masses.mass[base].sum()  # everything is seen from here
        self._turns = np.array([joint.kind == "revolute" for joint in robot.joints], dtype=bool)
        parent = np.array([joint.parent for joint in robot.joints], dtype=np.intp)
        reach = np.array([joint.T_parent_joint[:3, 3] for joint in robot.joints]).reshape(-1, 3)
        reach[parent < 0] -= middle
        self._parent = parent
        self._along, self._across = np.abs(reach[:, 2]), np.linalg.norm(reach[:, :2], axis=1)
        self._joint = masses.joint
        com = np.where(base[:, None], masses.com - middle, masses.com)
        self._com_along, self._com_across = np.abs(com[:, 2]), np.linalg.norm(com[:, :2], axis=1)
        self._before = ancestors(robot).T * 1.0  # (i, k): i is before k
        self._beyond = masses.beyond  # (j, b)
        self._mass, self._moment = masses.mass, masses.greatest

    def growth(self, path: PanelPath) -> Growth:
        """Bound inertia and momentum on panels."""
        with np.errstate(over="ignore", invalid="ignore"):
            rows = range(0, len(path.ends), _AT_ONCE)
            parts = [self._growth(PanelPath(*(column[i : i + _AT_ONCE] for column in path))) for i in rows]
        return Growth(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _growth(self, path: PanelPath) -> Growth:
        rates = self._coefficients(path)  # (p, e + 1, j) absolute Chebyshev coefficients
        way = _integrated(rates)
        up, down = _powers(rates.shape[1]), _powers(rates.shape[1] + 1)
        V = np.einsum("rd,pdj->prj", up[0], rates)  # |v'|
        off = np.einsum("rd,pdj->prj", down[1], way) * self._turns  # |Im v|
        first = np.abs(path.values[:, 0])  # (p, j)
        slid = first[:, None] + np.einsum("rd,pdj->prj", down[0] + 1.0, way)
        turn, slide = V * self._turns, ~self._turns
        before = off @ self._before
        steep = (before + off).max(axis=-1, initial=0.0) > _STEEP
        grown = np.exp(np.minimum(before, _STEEP))  # of the frame that a joint is on
        own, spun = np.exp(np.minimum(off, _STEEP)), turn @ self._before + turn
        # What stands before a joint's own offset: its parent's rotation, and how fast that turns.
        there, turned, its = (self._of_parent(values, base) for values, base in ((grown, 1.0), (own, 1.0), (spun, 0.0)))
        placed = there * np.hypot(self._along, turned * self._across)
        moved = placed * its
        moved = moved + slide * grown * (its * slid + V)
        placed = placed + slide * grown * slid
        # The bodies; those of the base stand still.
        held = np.concatenate([grown, np.ones_like(grown[..., :1])], axis=-1)[..., self._joint]
        wide = np.concatenate([own, np.ones_like(own[..., :1])], axis=-1)[..., self._joint]
        fast = np.concatenate([spun, np.zeros_like(spun[..., :1])], axis=-1)[..., self._joint]
        com = held * np.hypot(self._com_along, wide * self._com_across)
        r, dr = com + placed @ self._beyond, com * fast + moved @ self._beyond  # (p, r, b)
        omega = (grown * turn) @ self._beyond
        moment = self._moment * (held * wide) ** 2
        m = self._mass
        inertia = (moment + 4 * m * r**2).sum(axis=-1)
        carried = (moment * omega + m * r * dr).sum(axis=-1) + (r @ m) * (dr @ m) / m.sum()
        hopeless = steep | ~np.isfinite(inertia) | ~np.isfinite(carried)
        return Growth(
            inertia=np.where(hopeless, np.inf, inertia),
            carried=np.where(hopeless, np.inf, carried),
            travel=V[:, 0],
        )

    def _of_parent(self, values: Array, base: float) -> Array:
        """Return what a joint's parent has, (p, r, j)."""
        return np.where(self._parent >= 0, values[..., self._parent], base)

    def _coefficients(self, path: PanelPath) -> Array:
        """Return bounds of the Chebyshev coefficients of v' (p, e + 1, j), rounding included.

        A polynomial of degree e that is at most B on a piece is at most B R^e on the ellipse R around it, and a panel's own
        ellipse s lies in one of these: for high degrees that bounds coefficients of which the rounding hides the true size.
        """
        degree = path.rates.shape[1] - 1
        found = np.abs(_from_bernstein(degree) @ path.rates)
        found += (_EPS * (8 + 4 * degree) * path.coarse)[:, None]
        if degree <= _HIGH:
            return found
        away = path.share[:, None] * (_WIDER - 1 / _WIDER) / 2  # (p, s)
        wide = 1 + away + np.sqrt(2 * away + away**2)
        power = 2 * wide[:, None] ** degree * _WIDER ** -np.arange(degree + 1.0)[:, None]
        return np.minimum(found, power.min(axis=-1)[..., None] * path.coarse[:, None])


def fall(points: int) -> Array:
    """Return 2 rho^(1 - n) / (rho - 1), (r,), infinite for rho = 1: times M, how far n coefficients may be off at best."""
    out = np.full(len(RHO), np.inf)
    out[1:] = 2 * RHO[1:] ** (1.0 - points) / (RHO[1:] - 1)
    return out


def on_ellipses(coefficients: Array) -> Array:
    """Bound polynomials on the ellipses: (p, d + 1) absolute Chebyshev coefficients -> (p, r)."""
    return coefficients @ _powers(coefficients.shape[1])[0].T


def integrated(coefficients: Array) -> Array:
    """Return the Chebyshev coefficients 1 to d + 1 of the integral, (p, d + 1, ...)."""
    count = coefficients.shape[1]
    out = np.zeros_like(coefficients)
    j = np.arange(1, count + 1).reshape(-1, *[1] * (coefficients.ndim - 2))
    out[:] = coefficients / (2 * j)
    out[:, 0] = coefficients[:, 0]
    out[:, : count - 2] -= coefficients[:, 2:] / (2 * j[: count - 2])
    return out


def _integrated(sizes: Array) -> Array:
    """Bound the Chebyshev coefficients of integrals, (p, d + 2, j), the first being 0, by those of what is integrated."""
    count = sizes.shape[1]
    out = np.zeros((sizes.shape[0], count + 1, sizes.shape[2]))
    j = np.arange(1, count + 1)[:, None]
    out[:, 1:] = sizes / (2 * j)
    out[:, 1] = sizes[:, 0]
    out[:, 1 : count - 1] += sizes[:, 2:] / (2 * j[: count - 2])
    return out


@lru_cache(maxsize=64)
def _powers(count: int) -> Array:
    """Return bounds of |T_j| and |Im T_j| on the ellipses for j = 0 to count - 1, (2, r, count)."""
    j = np.arange(float(count))
    up, down = RHO[:, None] ** j, RHO[:, None] ** -j
    out = np.stack([(up + down) / 2, (up - down) / 2])
    out.setflags(write=False)
    return out


@lru_cache(maxsize=64)
def _from_bernstein(degree: int) -> Array:
    """Map Bernstein coefficients to Chebyshev's; by values in the Chebyshev points, where both are exact."""
    k = np.arange(degree + 1)
    theta = (k + 0.5) * np.pi / (degree + 1)
    out = np.cos(np.outer(k, theta)) * 2 / (degree + 1)
    out[0] /= 2
    out = out @ weights(degree, (1 + np.cos(theta)) / 2)
    out.setflags(write=False)
    return out


# ---- How errors of the attitude of a tumbling base grow until the end of its motion ----------------------------------
#
# An error phi (a rotation vector, inertial axes) obeys phi' = A phi + what is made on the way, with A = J^-1 [L x]
# dt/dxi and J the inertia in inertial axes; and beside that, terms of second order. Of A only what is not the same
# about all axes makes phi longer, so on a panel it grows by no more than e^grows. Over many panels that would be far
# too much: a stick that tumbles turns its errors rather than making them longer. So A's flow X over each panel is
# computed, with a bound of its own error, and the flows are multiplied. docs/certificate.md has the proof.


_SECOND = 3.0  # of |phi|^2 times the tumble, at most, for |phi| below 1e-3 rad
_SMALL = 1e-3  # [rad]
_FIRST_ORDER = 1.01
_ROUNDING = 1e-12
_MOST_PANELS = 1500  # whose flows are multiplied; of more, the sum of what they grow by is taken
_STEEPEST = 300.0


class Flow(NamedTuple):
    """A's flow over panels p.

    Attributes:
        end: (p, 3, 3) X at each panel's end, 1 where it begins.
        slope: (p, r) of |dX/dxi| on the ellipses, at most; `inside` (p, r) of |X|.
    """

    end: Array
    slope: Array
    inside: Array


def flow_of(A: Array, reach: Array, weight: Array, to_chebyshev: Array) -> Flow:
    """Solve X' = A X on panels by a polynomial that fulfils it in the Gauss points.

    Args:
        A: (p, g, 3, 3) in the points.
        reach, weight, to_chebyshev: (g, g), (g,) and (g, g): integrals from -1 to the points and to 1; the map to coefficients.
    """
    count, points = A.shape[:2]
    system = -np.einsum("ij,pjcd->picjd", reach, A).reshape(count, 3 * points, 3 * points) + np.eye(3 * points)
    X = np.linalg.solve(system, np.tile(np.eye(3), (count, points, 1))).reshape(count, points, 3, 3)
    rates = A @ X
    slope = (to_chebyshev @ rates.reshape(count, points, 9)).reshape(count, points, 9)
    way = np.linalg.norm(integrated(slope), axis=2)
    inside = 1 + on_ellipses(np.concatenate([way.sum(axis=1)[:, None], way], axis=1))
    return Flow(np.eye(3) + np.einsum("g,pgcd->pcd", weight, rates), on_ellipses(np.linalg.norm(slope, axis=2)), inside)


def factors(grows: Array) -> Array:
    """Return by what factor an error made on each panel grows until the end, (p,), by what all that follow make longer."""
    return np.exp(np.minimum(np.cumsum(grows[::-1])[::-1], _STEEPEST))


def factors_of(flow: Flow, off: Array, grows: Array, made: Array, tumble: Array) -> Array:
    """Return the same by the flows (p,), where that is less.

    Args:
        flow: over the panels.
        off: (p,) by how much its end may be wrong.
        grows: (p,) logarithm of the factor of the panel itself.
        made: (p,) errors that are made [rad].
        tumble: (p,) how far the base turns by its momentum, at most [rad].
    """
    crude, count = factors(grows), len(grows)
    if count > _MOST_PANELS:
        return crude
    until, worst = np.zeros((count, 3, 3)), np.ones(count)
    for n, X in enumerate(flow.end):
        until[:n] = X @ until[:n]
        until[n] = np.eye(3)
        worst[: n + 1] = np.maximum(worst[: n + 1], np.linalg.norm(until[: n + 1], axis=(1, 2)))
    later = _FIRST_ORDER * worst * np.exp(grows + grows.max())
    whole = float((later * made).sum())
    small = float((later * (off + _ROUNDING)).sum()) + float((later * tumble).sum()) * _SECOND * 2 * whole
    if not (small <= 0.5 and 2 * whole <= _SMALL):
        return crude
    return np.minimum(crude, later / (1 - small))
