"""Bounds of polynomials and entire functions on panels, which bound the error of a base's attitude for every point.

Three bounds are here. `greatest_norm` bounds a vector polynomial closely. `Ellipses` bounds inertia and momentum on ellipses
in the complex plane. That bounds the error of a polynomial between the points where it is exact. `error_factors` bounds how
much an error of a tumbling base's attitude grows until the end. docs/certificate.md, section 5, has the proofs.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity
from spacearm.motion import Curve
from spacearm.motion.piecewise import halvings, weights
from spacearm.proof.base_momentum import masses_of
from spacearm.proof.mechanism import JointMap, ancestors
from spacearm.robot import Robot

Array = NDArray[np.float64]

RHO = np.array([1.0, 1.2, 1.6, 2.1, 2.9, 4.0, 5.5, 8.0, 12.0, 20.0, 40.0, 100.0, 250.0])
"""The ellipses: the sum of the half axes of each. The first is the panel itself."""

_EPS = float(np.finfo(np.float64).eps)
_HALF_THE_DIGITS = 2e-7  # times a matrix: the error of its eigenvalues, a hundred times the rounding of the cosine
_LEAST = 1e-300  # in place of 0 in a quotient
_FINER = 16  # samples in place of one, for a closer look at a polynomial
_LOOKS = 5  # closer looks, at most
_ROWS = 200_000  # samples at once, at most: with more there is no closer look
_OUTWARD = 1 + 1e-12  # times the greatest norm, for its rounding
_STEEP = 80.0  # exponent beyond which a bound on an ellipse is taken to be infinite
_HIGH_DEGREE = 8  # of a path's derivative: above it, coefficients that are rounding would count times rho to this power
_AT_ONCE = 128  # panels computed at once, so that the arrays stay in the processor's cache
_WIDER = np.array([2.0**k for k in range(1, 13)])  # ellipses s around a panel, for pieces of a high degree
_SECOND_ORDER = 3.0  # times |phi|^2 and the tumble: the terms of second order of an error phi below _SMALL_ERROR
_SMALL_ERROR = 1e-3  # [rad]
_FIRST_ORDER = 1.01  # times the sum of errors, which covers what is neglected for rotation vectors below _SMALL_ERROR
_FLOW_ROUNDING = 1e-12  # of the flow over a panel
_MOST_FLOWS = 600  # that are multiplied, which takes the square of their number; more panels are taken in groups
_STEEPEST = 300.0  # exponent of the factor by which errors grow, at most: e^300 is hopeless, and still a number

# ---- The greatest norm of a polynomial -------------------------------------------------------------------------------
#
# With xi = cos(theta) a polynomial is a sum of c_j cos(j theta). It is smooth for all theta, and stationary where it is
# greatest. So its greatest value exceeds the nearest of samples at the distance d in theta by at most d^2 / 8 times a
# bound of its second derivative. Where this is too much, closer samples are taken around those that may be near the
# greatest value.


def greatest_norm(coefficients: Array, scale: Array, extra: Array, *, close: float = 2e-6) -> float:
    """Return a bound of scale times the norm of vector polynomials, plus extra, over all panels and all their points.

    Args:
        coefficients: (p, d + 1, c) Chebyshev coefficients.
        scale, extra: (p,) of each panel, 0 or more.
        close: the share by which the bound may exceed a value that is reached. If that is not reached, the bound is larger, and
            still holds.
    """
    count = coefficients.shape[1]
    sizes, j = np.sqrt(np.einsum("pdc,pdc->pd", coefficients, coefficients)), np.arange(float(count))
    curved = 2 * ((sizes @ j) ** 2 + sizes.sum(axis=1) * (sizes @ j**2))  # |d^2 |f|^2 / d theta^2| at most
    step = np.pi / (2 * count)
    values = _on_grid(count) @ coefficients
    squared = np.einsum("pgc,pgc->pg", values, values).T
    panel, theta = np.broadcast_to(np.arange(len(curved)), squared.shape), np.broadcast_to(_grid(count)[:, None], squared.shape)
    bound = reached = 0.0
    for look in range(_LOOKS):
        if look:
            step /= _FINER
            panel = np.repeat(panel, _FINER)
            theta = (theta[:, None] + (np.arange(_FINER) - (_FINER - 1) / 2) * step).ravel()
            values = (np.cos(theta[:, None] * j)[:, None] @ coefficients[panel])[:, 0]
            squared = np.einsum("rc,rc->r", values, values)
        times, plus = (scale, extra) if look == 0 else (scale[panel], extra[panel])
        sag = curved * step**2 / 8
        value = times * np.sqrt(squared) + plus
        above = times * np.sqrt(squared + (sag if look == 0 else sag[panel])) + plus
        reached, most = max(reached, float(value.max())), float(above.max())
        passed = reached * (1 + close / 2)  # samples that are left out below are no greater
        near = above > passed
        if most <= reached * (1 + close) or look == _LOOKS - 1 or near.sum() * _FINER > _ROWS:
            return max(bound, most) * _OUTWARD
        bound = max(bound, passed)
        panel, theta = panel[near], theta[near]
    return bound


@lru_cache(maxsize=32)
def _grid(count: int) -> Array:
    return (np.arange(2 * count) + 0.5) * np.pi / (2 * count)


@lru_cache(maxsize=32)
def _on_grid(count: int) -> Array:
    """Return the map from Chebyshev coefficients to values on the grid, (2 count, count)."""
    out = np.cos(np.outer(_grid(count), np.arange(count)))
    out.setflags(write=False)
    return out


def outer_eigenvalues(H: Array) -> tuple[Array, Array]:
    """Return a lower bound of the least and an upper bound of the greatest eigenvalue of symmetric matrices (..., 3, 3).

    They are the roots of the characteristic polynomial by the cosine of a third of an angle (Smith, Eigenvalues of a symmetric
    3 x 3 matrix, 1961). Where two of them meet, that angle has half of the digits only, which the bounds allow for.
    """
    xx, yy, zz, xy, xz, yz = (H[..., i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    mean = (xx + yy + zz) / 3
    x, y, z = xx - mean, yy - mean, zz - mean
    spread = np.sqrt((x * x + y * y + z * z + 2 * (xy * xy + xz * xz + yz * yz)) / 6)
    determinant = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz)
    cosine = determinant / np.maximum(2 * spread**3, _LEAST)
    angle = np.arccos(np.minimum(np.maximum(cosine, -1.0), 1.0)) / 3
    off = _HALF_THE_DIGITS * (np.abs(mean) + spread)
    return mean + 2 * spread * np.cos(angle + 2 * np.pi / 3) - off, mean + 2 * spread * np.cos(angle) + off


# ---- Inertia and momentum on ellipses --------------------------------------------------------------------------------
#
# On a panel of the path, xi from -1 to 1, joint values are polynomials, and the inertia H and the arm's angular momentum
# h v' are entire functions of xi. Let rho > 1, and E the ellipse with the foci -1 and 1 whose half axes are
# (rho + 1/rho) / 2 and (rho - 1/rho) / 2. A function that is analytic in E and no greater than M there has Chebyshev
# coefficients of at most 2 M rho^-j. So there is a polynomial of degree n - 1 that differs from it by at most
#
#     2 M rho^(1 - n) / (rho - 1)        on [-1, 1].
#
# (Trefethen, Approximation Theory and Approximation Practice, theorems 8.1 and 8.2; for vectors with their norm.) Here
# are such M, for all ellipses at once. A rotation by the complex angle a + i b has the norm e^|b|, and |x . y| and
# |x x y| are at most |x| |y| for complex vectors, too.


class Growth(NamedTuple):
    """Bounds on p panels, on each of r ellipses; all rates per unit of xi.

    Attributes:
        inertia: (p, r) bounds of |H| [kg m^2].
        carried: (p, r) bounds of |h v'| [N m s].
        travel: (p, j) bounds of the joints' |v'| on the panel itself [rad or m].
    """

    inertia: Array
    carried: Array
    travel: Array


class PanelPath(NamedTuple):
    """The joints' path on p panels, as polynomials of xi.

    Attributes:
        ends: (p, 2) where the panels begin and end, in u.
        values: (p, d + 1, j) Bernstein coefficients of the joints' values [rad or m].
        rates: (p, e + 1, j) those of their derivatives, per unit of xi.
        coarse: (p, j) the greatest coefficients of the derivatives on the whole piece of the curve, scaled to the panel's xi.
        share: (p,) which share of the piece the panel is.
        size: (p, j) the joints' greatest coefficients on the piece, to which rounding is relative.
    """

    ends: Array
    values: Array
    rates: Array
    coarse: Array
    share: Array
    size: Array

    @classmethod
    def of(cls, curve: Curve, joints: JointMap) -> PanelPath:
        """Return the pieces of a curve as panels."""
        ends = curve.hulls(0, bisections=0)[0]
        values = curve.bezier()[..., joints.dof] * joints.multiplier + joints.offset
        rates = curve.bezier(1)[..., joints.dof] * joints.multiplier * (np.diff(ends, axis=1) / 2)[..., None]
        return cls(ends, values, rates, np.abs(rates).max(axis=1), np.ones(len(ends)), np.abs(values).max(axis=1))

    @property
    def travel(self) -> Array:
        """How far each joint travels, at most, (p, j) [rad or m]."""
        return 2 * np.abs(self.rates).max(axis=1)

    def cut(self, halvings: NDArray[np.intp]) -> PanelPath:
        """Return each panel cut into 2^halvings equal ones, (p,), in order along the path."""
        if (halvings == halvings[0]).all():
            return self._cut(int(halvings[0])) if halvings[0] else self
        parts = [self._select(halvings == count)._cut(int(count)) for count in np.unique(halvings)]
        order = np.argsort(np.concatenate([part.ends[:, 0] for part in parts]), kind="stable")
        return PanelPath(*(np.concatenate(column)[order] for column in zip(*parts, strict=True)))

    def halves(self) -> PanelPath:
        """Return two panels for each."""
        return self._cut(1)

    def _select(self, which: NDArray[np.bool_]) -> PanelPath:
        return PanelPath(*(column[which] for column in self))

    def _cut(self, count: int) -> PanelPath:
        many = 1 << count
        inner = self.ends[:, :1] + np.arange(1, many) / many * np.diff(self.ends, axis=1)
        inner = np.concatenate([self.ends[:, :1], inner, self.ends[:, 1:]], axis=1)
        ends = np.stack([inner[:, :-1], inner[:, 1:]], axis=2).reshape(-1, 2)
        values, rates = (
            (halvings(of.shape[1] - 1, count) @ of[:, None]).reshape(-1, *of.shape[1:]) for of in (self.values, self.rates)
        )
        coarse, share, size = (np.repeat(of, many, axis=0) for of in (self.coarse / many, self.share / many, self.size))
        return PanelPath(ends, values, rates / many, coarse, share, size)


@cached_by_identity
def ellipses_of(robot: Robot) -> Ellipses:
    """Return the `Ellipses` of a robot."""
    return Ellipses(robot)


class Ellipses:
    """Bounds of a robot's inertia and momentum at complex joint values, by the table in section 5 of docs/certificate.md."""

    def __init__(self, robot: Robot) -> None:
        masses = masses_of(robot)
        base = masses.joint < 0
        center = masses.mass[base] @ masses.com[base] / masses.mass[base].sum()  # places are relative to it
        self._revolute = np.array([*(joint.kind == "revolute" for joint in robot.joints), False]) * 1.0  # the base is none
        parent = np.array([joint.parent for joint in robot.joints], dtype=np.intp)
        reach = np.array([joint.T_parent_joint[:3, 3] for joint in robot.joints]).reshape(-1, 3)
        reach[parent < 0] -= center
        self._parent = parent
        self._along, self._across = np.abs(reach[:, 2]), np.linalg.norm(reach[:, :2], axis=1)
        self._joint = masses.joint
        com = np.where(base[:, None], masses.com - center, masses.com)
        self._com_along, self._com_across = np.abs(com[:, 2]), np.linalg.norm(com[:, :2], axis=1)
        self._before = np.zeros((len(robot.joints) + 1,) * 2)
        self._before[:-1, :-1] = ancestors(robot).T  # (i, k): i is before k
        self._beyond = masses.beyond  # (j, b)
        self._mass, self._moment = masses.mass, masses.greatest

    def growth(self, path: PanelPath) -> Growth:
        """Bound inertia and momentum on panels."""
        with np.errstate(over="ignore", invalid="ignore"):
            rows = range(0, len(path.ends), _AT_ONCE)
            parts = [self._growth(PanelPath(*(column[i : i + _AT_ONCE] for column in path))) for i in rows]
        return Growth(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _growth(self, path: PanelPath) -> Growth:
        coefficients = self.coefficients(path)  # (p, e + 1, j) absolute Chebyshev coefficients of v'
        count, joints = len(coefficients), len(self._parent)
        # All arrays below are of the joints and then the base, (p, r, j + 1): the base is at rest.
        rates, moved = np.zeros((2, count, coefficients.shape[1] + 1, joints + 1))
        rates[:, :-1, :joints] = coefficients
        moved[..., :joints] = _integrated(coefficients)
        up, down = _powers(rates.shape[1])
        V, off = up @ rates, down @ moved * self._revolute  # |v'|, |Im v|
        slid = np.zeros((count, 1, joints + 1))
        slid[:, 0, :joints] = np.abs(path.values[:, 0])
        slid = slid + (up + 1.0) @ moved
        turn = V * self._revolute
        before = off @ self._before
        steep = (before + off).max(axis=-1) > _STEEP
        grown = np.exp(np.minimum(before, _STEEP))  # N_k
        own, spun = np.exp(np.minimum(off, _STEEP)), turn @ self._before + turn
        # For the offset of a joint: the rotation of its parent, and how fast that turns.
        placed = grown[..., self._parent] * np.hypot(self._along, own[..., self._parent] * self._across)
        its = spun[..., self._parent]
        shifted = placed * its
        if not self._revolute[:-1].all():
            grown_now, its_now = grown[..., :-1] * (1 - self._revolute[:-1]), its
            shifted = shifted + grown_now * (its_now * slid[..., :-1] + V[..., :-1])
            placed = placed + grown_now * slid[..., :-1]
        # The bodies; those of the base are at rest.
        scale, wide = grown[..., self._joint], own[..., self._joint]
        com = scale * np.hypot(self._com_along, wide * self._com_across)
        r, dr = com + placed @ self._beyond, com * spun[..., self._joint] + shifted @ self._beyond  # (p, r, b)
        omega = (grown * turn)[..., :-1] @ self._beyond
        moment = self._moment * (scale * wide) ** 2
        m = self._mass
        inertia = moment.sum(axis=-1) + r**2 @ (4 * m)
        carried = (moment * omega).sum(axis=-1) + (r * dr) @ m + (r @ m) * (dr @ m) / m.sum()
        hopeless = steep | ~np.isfinite(inertia) | ~np.isfinite(carried)
        return Growth(
            inertia=np.where(hopeless, np.inf, inertia),
            carried=np.where(hopeless, np.inf, carried),
            travel=V[:, 0, :joints],
        )

    def coefficients(self, path: PanelPath) -> Array:
        """Return bounds of the Chebyshev coefficients of v' (p, e + 1, j), rounding included.

        A polynomial of degree e that is at most B on a piece is at most B R^e on the ellipse R around it (Bernstein). A panel's
        own ellipse s lies in one of these. For high degrees that bounds coefficients whose true size is hidden by rounding.
        """
        degree = int(path.rates.shape[1]) - 1
        found = np.abs(_from_bernstein(degree) @ path.rates)
        found += (_EPS * (8 + 4 * degree) * path.coarse)[:, None]
        if degree <= _HIGH_DEGREE:
            return found
        away = path.share[:, None] * (_WIDER - 1 / _WIDER) / 2  # (p, s)
        wide: Array = 1 + away + np.sqrt(2 * away + away**2)
        j = np.arange(degree + 1.0)[:, None]
        with np.errstate(over="ignore", invalid="ignore"):
            power = 2 * np.power(wide[:, None], degree) * np.power(_WIDER, -j)
            return np.fmin(found, power.min(axis=-1)[..., None] * path.coarse[:, None])


def fall(points: int) -> Array:
    """Return 2 rho^(1 - n) / (rho - 1) for n points, (r,); infinite for rho = 1. Times M it is the error epsilon."""
    out = np.full(len(RHO), np.inf)
    out[1:] = 2 * RHO[1:] ** (1.0 - points) / (RHO[1:] - 1)
    return out


def on_ellipses(coefficients: Array) -> Array:
    """Return bounds (p, r) of polynomials on the ellipses, by their absolute Chebyshev coefficients (p, d + 1)."""
    return coefficients @ _powers(coefficients.shape[1])[0].T


def integrated(coefficients: Array) -> Array:
    """Return the Chebyshev coefficients 1 to d + 1 of the integral, (p, d + 1, ...)."""
    count = coefficients.shape[1]
    out = np.zeros_like(coefficients)
    j = np.expand_dims(np.arange(1.0, count + 1), tuple(range(1, coefficients.ndim - 1)))
    out[:] = coefficients / (2 * j)
    out[:, 0] = coefficients[:, 0]
    out[:, : count - 2] -= coefficients[:, 2:] / (2 * j[: count - 2])
    return out


def _integrated(sizes: Array) -> Array:
    """Bound the Chebyshev coefficients of integrals, (p, d + 2, j), by those of the integrands; the first is taken as 0."""
    count = sizes.shape[1]
    out = np.zeros((sizes.shape[0], count + 1, sizes.shape[2]))
    j = np.arange(1.0, count + 1)[:, None]
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
    """Return the map from Bernstein coefficients to those of Chebyshev, by values in the Chebyshev points."""
    k = np.arange(degree + 1)
    theta = (k + 0.5) * np.pi / (degree + 1)
    out = np.cos(np.outer(k, theta)) * 2 / (degree + 1)
    out[0] /= 2
    out = out @ weights(degree, (1 + np.cos(theta)) / 2)
    out.setflags(write=False)
    return out


# ---- Growth of errors of a tumbling base's attitude ------------------------------------------------------------------
#
# An error phi (a rotation vector, inertial axes) satisfies phi' = A phi + the error that is made on the way + terms of
# second order, with A = J^-1 [L x] dt/dxi and J the inertia in inertial axes. Only the difference between J's moments
# makes phi longer, so on a panel phi grows by at most e^grows. Over many panels that product would be far too large: a
# long body that tumbles turns its errors rather than making them longer. So A's flow X over each panel is computed, with
# a bound of its own error, and the flows are multiplied.


class Flow(NamedTuple):
    """A's flow over p panels.

    Attributes:
        end: (p, 3, 3) X at each panel's end; it is 1 where the panel begins.
        slope, inside: (p, r) bounds of |dX/dxi| and of |X| on the ellipses.
    """

    end: Array
    slope: Array
    inside: Array


def flow_of(A: Array, *, integrals: Array, weight: Array, to_chebyshev: Array) -> Flow:
    """Solve X' = A X on panels by a polynomial that satisfies it in the Gauss points.

    Args:
        A: (p, g, 3, 3) in the points.
        integrals, weight, to_chebyshev: (g, g), (g,) and (g, g): from values in the points to the integrals from -1 to each
            point, to the integral from -1 to 1, and to Chebyshev's coefficients.
    """
    count, points = A.shape[:2]
    system: Array = -np.einsum("ij,pjcd->picjd", integrals, A).reshape(count, 3 * points, 3 * points) + np.eye(3 * points)
    solution = np.linalg.solve(system, np.tile(np.eye(3), (count, points, 1)))
    X = solution.reshape(count, points, 3, 3)
    rates = A @ X
    slope = (to_chebyshev @ rates.reshape(count, points, 9)).reshape(count, points, 9)
    moved = np.linalg.norm(integrated(slope), axis=2)
    inside = 1 + on_ellipses(np.concatenate([moved.sum(axis=1)[:, None], moved], axis=1))
    return Flow(np.eye(3) + np.einsum("g,pgcd->pcd", weight, rates), on_ellipses(np.linalg.norm(slope, axis=2)), inside)


def error_factors(grows: Array) -> Array:
    """Return the factors (p,) by which errors made on panels grow until the end: e to the sum of all later exponents."""
    return np.exp(np.minimum(np.cumsum(grows[::-1])[::-1], _STEEPEST))


def error_factors_by_flow(flow: Flow, *, off: Array, grows: Array, made: Array, tumble: Array) -> Array:
    """Return the same factors by the flows, where they are less.

    Args:
        flow: over the panels.
        off: (p,) by how much the flow at their ends may be wrong.
        grows: (p,) the logarithm of the factor of each panel.
        made: (p,) errors that are made on them [rad].
        tumble: (p,) how far the momentum turns the base on them, at most [rad].
    """
    crude = error_factors(grows)
    later = _FIRST_ORDER * longest_products(flow.end) * np.exp(grows + grows.max())
    whole = float((later * made).sum())
    small = float((later * (off + _FLOW_ROUNDING)).sum()) + float((later * tumble).sum()) * _SECOND_ORDER * 2 * whole
    if not (small <= 0.5 and 2 * whole <= _SMALL_ERROR):
        return crude
    return np.minimum(crude, later / (1 - small))


def longest_products(X: Array, *, most: int = _MOST_FLOWS) -> Array:
    """Bound the norms of X_q ... X_(p + 1) for every q from p to the last, (p,), for matrices X (p, 3, 3).

    More than `most` matrices are taken in groups. A product that begins in one group and ends in another is the rest of the
    first group, whole groups, and the head of the last one. Its norm is at most the product of their norms.
    """
    count = len(X)
    size = -(-count // most)
    if size <= 1:
        return _products_of(X[None])[1][0]
    groups = np.concatenate([X, np.tile(np.eye(3), (-count % size, 1, 1))]).reshape(-1, size, 3, 3)
    rest, within = _products_of(groups)
    head, longest_head = np.tile(np.eye(3), (len(groups), 1, 1)), np.ones(len(groups))
    for n in range(size):
        head = groups[:, n] @ head
        longest_head = np.maximum(longest_head, _spectral_norm(head))
    between, beyond = np.zeros((len(groups), 3, 3)), np.zeros(len(groups))
    for n, whole in enumerate(head):
        beyond[:n] = np.maximum(beyond[:n], _norm(between[:n]) * longest_head[n])
        between[:n] = whole @ between[:n]
        between[n] = np.eye(3)
    return np.maximum(within, _spectral_norm(rest) * beyond[:, None]).ravel()[:count]


def _products_of(X: Array) -> tuple[Array, Array]:
    """Return the products of all matrices after each one, (g, n, 3, 3), and the greatest norm on the way, (g, n)."""
    until, worst = np.zeros_like(X), np.ones(X.shape[:2])
    for n in range(X.shape[1]):
        until[:, :n] = X[:, n, None] @ until[:, :n]
        until[:, n] = np.eye(3)
        worst[:, : n + 1] = np.maximum(worst[:, : n + 1], _norm(until[:, : n + 1]))
    return until, worst


def _norm(X: Array) -> Array:
    return np.sqrt(np.einsum("...cd,...cd->...", X, X))


def _spectral_norm(X: Array) -> Array:
    """Return an upper bound of the greatest singular value of matrices (..., 3, 3)."""
    return np.sqrt(outer_eigenvalues(np.swapaxes(X, -1, -2) @ X)[1])
