"""Where a floating base gets to: its attitude along a path, from the conservation of momentum, and by how much it may be wrong.

In base axes, with H and h of the centroidal map (Pinocchio's), joint values v(u), and the angular momentum L, which is constant
in the inertial frame, the base turns by

    omega = H^-1 (R^T L dt/du - h dv/du)      per unit of u.

The path is cut into panels. On each, dQ/dxi = Q o omega / 2 is solved by a polynomial Q that fulfils it in n Gauss points: a
linear system for the quaternions there. With L = 0 omega does not depend on R and one solution is all; otherwise R is put in,
and it is solved again until nothing changes.

By how much that polynomial misses the equation between the points is bounded, not estimated. What it misses,

    F = 2 H (Q* o dQ/dxi) + |Q|^2 h dv/dxi - |Q|^2 R^T L dt/dxi,

is an entire function of xi that vanishes in the Gauss points; bounds of it on ellipses around the panel (see `ellipses`) bound
it on the panel, and |F| / (lambda |Q|^2) is the greatest error of the rate, with lambda the least moment of inertia. Panels are
halved until all of this adds up to less than the tolerance. docs/certificate.md, section 5, has the proofs.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.motion import Curve
from spacearm.motion.piecewise import weights
from spacearm.proof.base_setup import BaseSetup
from spacearm.proof.displacement import JointMap
from spacearm.proof.moving_bodies import free_model, masses_of
from spacearm.proof.polynomial_bounds import (
    Growth,
    PanelPath,
    ellipses_of,
    factors,
    factors_of,
    fall,
    flow_of,
    greatest_norm,
    integrated,
    on_ellipses,
)
from spacearm.proof.quaternions import CONJUGATE, product, quaternion, rotation, running, times
from spacearm.robot import Robot

Array = NDArray[np.float64]

TOLERANCE = 1e-9
"""[rad] of the attitude, everywhere; where more evaluations than there may be are needed for it, `error` is more."""

# Gauss points of a panel, how far the joints of a chain may travel on it together [rad or m], what it costs in configurations
_POINTS = ((5, 0.02, 1.5), (8, 0.3, 2.0), (12, 1.3, 4.0), (16, 2.6, 8.0))
_HALVINGS, _MOST = 40, 300_000  # configurations
_MOST_TUMBLE = 600.0  # [rad] about a hundred turns in one motion
_WINDOW = 1.0  # [rad] by which a tumbling base turns, that is solved for at once
_SWEEPS, _STEADY = 60, 1e-13
_LEAST = 1e-300
_EPS = float(np.finfo(np.float64).eps)
_ROUNDING = 64 * _EPS  # [rad] of the attitude, a panel
_DIGITS = 32  # units in the last place by which a joint's value may be off
_OUTWARD = 1.001  # of bounds that are sums of some hundred terms
_BENT = 0.5  # by which |Q|^2 may differ from 1
_MANY = 4  # panels a piece, above which more points are better
_PRESUMED = 3.0  # before H is known: |F| is so many times |h v'|
_GROWS_LITTLE = 1.0  # e to the power of it: what errors of a tumbling base may grow by without a closer look


class _Cut(NamedTuple):
    """Panels p of the path, before anything is computed there.

    Attributes:
        path: the joints' polynomials.
        growth: bounds on ellipses.
    """

    path: PanelPath
    growth: Growth


class _Panels(NamedTuple):
    """Panels p with g Gauss points; rates per unit of xi.

    Attributes:
        inertia, yielding: (p, g, 3, 3) H and H^-1.
        carried: (p, g, 3) h v', the arm's own angular momentum.
        push: (p, g, 3) omega of the arm's motion, in base axes.
    """

    inertia: Array
    yielding: Array
    carried: Array
    push: Array


class _Turns(NamedTuple):
    """Solutions on panels p with g Gauss points.

    Attributes:
        slope, inside: (p, g, 4) dQ/dxi and Q in the points, Q being 1 where the panel begins.
        start: (p + 1, 4) the attitudes where they begin, and at the end.
        missed: (p,) by how much omega in the points is not what it was solved for.
    """

    slope: Array
    inside: Array
    start: Array
    missed: Array


class _Bounds(NamedTuple):
    """Bounds on panels p.

    Attributes:
        cut: (p,) [rad] the error of the attitude that is made there, by what is between the points.
        rounded: (p,) [rad] likewise by rounding.
        rate: (p,) of omega, per unit of xi.
        carried: (p,) of the arm's angular momentum, interpolated.
        bent: (p,) by how much |Q|^2 differs from 1.
        tumble: (p,) how far the base turns by its momentum, at most [rad].
        later: (p,) by what factor errors that are made here may grow until the end.
    """

    cut: Array
    rounded: Array
    rate: Array
    carried: Array
    bent: Array
    tumble: Array
    later: Array


class Drift:
    """The base's attitude along a path.

    Attributes:
        error: [rad] no attitude is further from the true one.
        evaluations: configurations at which the centroidal map was asked for.
    """

    def __init__(self, robot: Robot, curve: Curve, setup: BaseSetup, *, time_rate: float) -> None:
        """Integrate.

        Args:
            robot: with masses.
            curve: its joints' path.
            setup: where the base starts and with which momentum.
            time_rate: dt/du [s], constant.

        Raises:
            RobotError: masses that cannot be.
            ProblemError: it tumbles too often to be followed.
        """
        self._masses = masses_of(robot)
        self._model, self._at_q, self._at_v = free_model(robot)
        self._state = self._model.createData()
        self._curve, self._joints = curve, JointMap(robot)
        self._ellipses = ellipses_of(robot)
        own = PanelPath.of(curve, self._joints)
        self._angular = setup.angular * time_rate
        self._spin = float(np.linalg.norm(self._angular))
        self._begin = quaternion(setup.start[:3, :3])
        self._length = max(float(own.ends[-1, 1] - own.ends[0, 0]), _LEAST)
        self.evaluations = 0
        first = self._sampled_at(own.values[:1, :1], own.rates[:1, :1]).inertia[0, 0]
        self._presumed = max(self._masses.base_least, float(np.linalg.eigvalsh(first)[0]) / 2)  # H's least
        self._choose_points(own)
        self._integrate(own)

    def _choose_points(self, path: PanelPath) -> None:
        """Choose how many Gauss points a panel has, by how far joints of a chain, and the base, turn on its pieces."""
        far = (path.travel @ self._masses.beyond).max(axis=1, initial=0.0)
        far += self._spin * np.diff(path.ends, axis=1)[:, 0] / self._presumed
        costs = [
            (points + more) * np.exp2(np.ceil(np.log2(np.maximum(far / most, 1.0)))).sum() for points, most, more in _POINTS
        ]
        self._use(_POINTS[int(np.argmin(costs))][0])

    def _use(self, points: int) -> None:
        self._count = points
        self._xi, self._weight, self._to_coefficients, self._to_chebyshev, self._reach, self._fall = _rule(points)

    def attitude(self, u: Array) -> Array:
        """Return R_w_b (r, 3, 3) at parameters u (r,)."""
        return rotation(self._quaternions(u))

    # ---- what is greatest ----------------------------------------------------------------------------------------------

    def final(self) -> float:
        """Return how far the base is turned from its start at the end [rad]; it may be off by `error`."""
        turned = product(self._begin * CONJUGATE, self._turns.start[-1])
        return float(2 * np.arctan2(np.linalg.norm(turned[1:]), abs(turned[0])))

    def peak(self) -> float:
        """Return a bound of how far the base is turned from its start at any u [rad]."""
        at_start = product(self._begin * CONJUGATE, self._turns.start[:-1])
        scale = 1 / np.sqrt(1 - self._bounds.bent)
        most = greatest_norm(product(at_start[:, None], self._chebyshev_of_turn())[..., 1:], scale, np.zeros_like(scale))
        return min(np.pi, 2 * float(np.arcsin(min(1.0, most))) + self.error)

    def rate(self) -> float:
        """Return a bound of the base's rate of turn, per unit of u [rad]."""
        half, bounds = self._half, self._bounds
        if not np.isfinite(self.error):
            return np.inf
        at, to_chebyshev = _products(self._count)
        Q, slope = at @ self._chebyshev_of_turn(), at[:, :-1] @ (self._to_chebyshev @ self._turns.slope)
        omega = 2 * product(Q * CONJUGATE, slope)[..., 1:]  # |Q|^2 times it
        extra = (bounds.rate + bounds.tumble / 2 * self.error) / half
        return greatest_norm(to_chebyshev @ omega, 1 / (half * (1 - bounds.bent)), extra)

    def _chebyshev_of_turn(self) -> Array:
        """Return the Chebyshev coefficients of Q, (p, g + 1, 4)."""
        d = self._to_integral(self._turns.slope)
        first = np.array([1.0, 0.0, 0.0, 0.0]) - (-1.0) ** np.arange(1, self._count + 1) @ d
        return np.concatenate([first[:, None], d], axis=1)

    def joint_momentum(self) -> float:
        """Return a bound of the arm's angular momentum by its joints' motion alone, per unit of u [N m s]."""
        half = self._half
        return greatest_norm(self._to_chebyshev @ self._panels.carried, 1 / half, self._bounds.carried / half)

    @property
    def instants(self) -> Array:
        """Where panels begin, their middles, and the end: parameters (2 p + 1,)."""
        low, high = self._cut.path.ends.T
        return np.append(np.stack([low, (low + high) / 2], axis=1).ravel(), high[-1])

    # ---- the panels ----------------------------------------------------------------------------------------------------

    def _integrate(self, own: PanelPath) -> None:
        cut = self._first_cut(own)
        panels = self._sampled(cut.path)
        while True:
            turned = self._tumbles(panels, cut.path)
            if turned.sum() > _MOST_TUMBLE:
                raise ProblemError(
                    f"the momentum turns the base by some {turned.sum():.3g} rad along the trajectory, expected less than "
                    f"{_MOST_TUMBLE:g} rad; check the units of masses, momentum and duration"
                )
            if self.evaluations > _MOST or not (fast := turned > _WINDOW).any():
                break
            cut, panels = self._halved(cut, panels, fast)
        for halving in range(_HALVINGS):
            self._cut, self._panels = cut, panels
            self._half = np.maximum(np.diff(cut.path.ends, axis=1)[:, 0] / 2, _LEAST)
            self._turns = self._solved()
            self._bounds = bounds = self._bounded()
            made = bounds.cut * bounds.later
            coarse = (made > self._allowed(cut.path.ends)) & (bounds.cut > bounds.rounded)
            enough = made.sum() <= TOLERANCE or not coarse.any()
            if enough or self.evaluations > _MOST or halving == _HALVINGS - 1:
                self.error = float(((bounds.cut + bounds.rounded) * bounds.later).sum())
                break
            if self._count < _POINTS[-1][0] and len(coarse) + coarse.sum() > _MANY * len(own.ends):
                self._use(_POINTS[-1][0])
                cut = self._first_cut(own)
                panels = self._sampled(cut.path)
            else:
                cut, panels = self._halved(cut, panels, coarse)
        self._ends, self._start = self._cut.path.ends, self._turns.start[:-1]
        self._coefficients = self._to_coefficients @ self._turns.slope

    def _allowed(self, ends: Array) -> Array:
        """Return what error may be made on each panel: half by their lengths, half by their number."""
        return TOLERANCE / 2 * (np.diff(ends, axis=1)[:, 0] / self._length + 1 / len(ends))

    def _first_cut(self, own: PanelPath) -> _Cut:
        """Cut the path as will be needed, by what is known without its momentum; where that is often, take more points."""
        cut = whole = self._grown(own)
        for _ in range(_HALVINGS):
            if len(cut.path.ends) > _MANY * len(own.ends) and self._count < _POINTS[-1][0]:
                self._use(_POINTS[-1][0])
                cut = whole
            tumble = self._spin * np.diff(cut.path.ends, axis=1) / 2
            missed = 4 * self._least_of(_PRESUMED * (cut.growth.carried + tumble)) / self._presumed
            coarse = missed > self._allowed(cut.path.ends)
            if not coarse.any() or len(coarse) * self._count > _MOST:
                break
            cut = _joined(cut, self._grown(_some(cut.path, coarse).halves()), coarse)
        return cut

    def _grown(self, path: PanelPath) -> _Cut:
        return _Cut(path, self._ellipses.growth(path))

    def _halved(self, cut: _Cut, panels: _Panels, coarse: NDArray[np.bool_]) -> tuple[_Cut, _Panels]:
        fine = self._grown(_some(cut.path, coarse).halves())
        return _joined(cut, fine, coarse), _merged(panels, self._sampled(fine.path), coarse)

    def _sampled(self, path: PanelPath) -> _Panels:
        """Ask Pinocchio for the centroidal map in all Gauss points."""
        share = (1 + self._xi) / 2
        values, rates = (weights(points.shape[1] - 1, share) @ points for points in (path.values, path.rates))
        return self._sampled_at(values, rates)

    def _sampled_at(self, values: Array, rates: Array) -> _Panels:
        """Ask Pinocchio at joint values, with rates, (p, g, j)."""
        import pinocchio  # pyright: ignore[reportMissingImports]

        shape = values.shape[:2]
        count = shape[0] * shape[1]
        q = np.tile(pinocchio.neutral(self._model), (count, 1))
        q[:, self._at_q] = values.reshape(count, -1)
        map_of = np.empty((count, 3, self._model.nv))
        ask, model, state = pinocchio.computeCentroidalMap, self._model, self._state
        for i, row in enumerate(q):
            map_of[i] = ask(model, state, row)[3:]
        self.evaluations += count
        inertia = np.ascontiguousarray(map_of[:, :, 3:6])
        carried = np.einsum("icd,id->ic", map_of[:, :, self._at_v], rates.reshape(count, -1))
        yielding: Array = np.linalg.inv(inertia).astype(np.float64)
        push = -np.einsum("icd,id->ic", yielding, carried)
        matrices, vectors = (*shape, 3, 3), (*shape, 3)
        return _Panels(inertia.reshape(matrices), yielding.reshape(matrices), carried.reshape(vectors), push.reshape(vectors))

    def _tumbles(self, panels: _Panels, path: PanelPath) -> Array:
        """Return how far the base turns in panels by its angular momentum, more or less, (p,) [rad]."""
        most = np.linalg.norm(panels.yielding, axis=(2, 3)).max(axis=1)
        return most * np.diff(path.ends, axis=1)[:, 0] * self._spin

    # ---- one solution --------------------------------------------------------------------------------------------------

    def _solved(self) -> _Turns:
        """Solve all panels."""
        panels = self._panels
        if not self._spin:
            return self._turned(panels.push, self._begin, np.zeros(len(panels.push)))
        window = np.floor(np.cumsum(self._tumbles(panels, self._cut.path)) / _WINDOW)
        parts, begin = [], self._begin
        for of in np.unique(window):
            rows = window == of
            some = _Panels(*(column[rows] for column in panels))
            parts.append(self._tumbled(some, self._half[rows], begin))
            begin = parts[-1].start[-1]
        slope, inside, missed = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("slope", "inside", "missed")
        )
        return _Turns(slope, inside, np.concatenate([*(part.start[:-1] for part in parts), begin[None]]), missed)

    def _tumbled(self, panels: _Panels, half: Array, begin: Array) -> _Turns:
        """Solve panels in which omega depends on the attitude, again and again until nothing changes."""
        omega = panels.push
        for _ in range(_SWEEPS):
            turns = self._turned(omega, begin, np.zeros(len(omega)))
            R = rotation(product(turns.start[:-1, None], turns.inside))
            local = (np.swapaxes(R, -1, -2) @ self._angular)[..., None] * half[:, None, None, None]
            before, omega = omega, panels.push + (panels.yielding @ local)[..., 0]
            changed = np.abs(omega - before).max(axis=(1, 2))
            if changed.max() <= _STEADY * np.abs(omega).max():
                return turns._replace(missed=2 * changed)
        raise ProblemError(
            "the spacecraft tumbles too fast along the trajectory to be followed, expected less momentum or a shorter duration"
        )

    def _turned(self, omega: Array, begin: Array, missed: Array) -> _Turns:
        """Solve panels, from an attitude (4,), for rates omega (p, g, 3) given in the Gauss points."""
        right = times(omega) / 2  # (p, g, 4, 4): Q o omega / 2, as a matrix on Q
        count, points = omega.shape[:2]
        system = -np.einsum("ij,pjcd->picjd", self._reach, right).reshape(count, 4 * points, 4 * points)
        system += np.eye(4 * points)
        one = np.tile([1.0, 0.0, 0.0, 0.0], points)
        Q = np.linalg.solve(system, np.tile(one[:, None], (count, 1, 1)))[..., 0].reshape(count, points, 4)
        slope = np.einsum("pgcd,pgd->pgc", right, Q)
        end = np.array([1.0, 0.0, 0.0, 0.0]) + self._weight @ slope
        start = running(np.concatenate([begin[None], end / np.linalg.norm(end, axis=1)[:, None]]))
        return _Turns(slope, Q, start, missed)

    # ---- by how much it may be wrong -----------------------------------------------------------------------------------

    def _bounded(self) -> _Bounds:
        """Bound what the solution misses on each panel."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return self._bounds_of(self._panels, self._turns, self._cut)

    def _bounds_of(self, panels: _Panels, turns: _Turns, cut: _Cut) -> _Bounds:
        points, growth, own = self._count, cut.growth, self._spin * self._half
        slope = on_ellipses(np.linalg.norm(self._to_chebyshev @ turns.slope, axis=2))  # (p, r) of |dQ/dxi|
        way = np.linalg.norm(self._to_integral(turns.slope), axis=2)
        way = on_ellipses(np.concatenate([way.sum(axis=1)[:, None], way], axis=1))  # of |Q - 1|
        near = 1 + np.sqrt(2) * way
        missed = near * (2 * growth.inertia * slope + near * (growth.carried + own[:, None]))
        missed = np.where(np.isfinite(missed), missed, np.inf)
        F = _OUTWARD * self._least_of(missed)
        bent = 4 * _OUTWARD * self._least_of(2 * near * slope) + _ROUNDING
        hopeless = ~(bent < _BENT)
        bent = np.where(hopeless, 0.0, bent)
        least, most = self._moments(panels, (1 + points) * _OUTWARD * self._least_of(growth.inertia))
        least = least * (1 - bent)
        # In the points themselves: rounding, and what a solution for a tumbling base left.
        trace = np.trace(panels.inertia, axis1=2, axis2=3).max(axis=1)
        weight = np.where(self._joints.turns, 1.0, np.sqrt(2 * self._masses.total / trace)[:, None])  # of slides, by lengths
        travel, size = (weight * growth.travel).sum(axis=1), (weight * cut.path.size).sum(axis=1)
        lost = 4 * cut.path.values.shape[1]  # by sums of so many terms
        digits = _EPS * (64 + lost + (_DIGITS + lost) * size)
        there = digits * trace * 2 * (slope[:, 0] + travel) + trace * turns.missed + 64 * _EPS * own
        cut_off, rounded = 4 * F / least, 2 * there / least + _ROUNDING
        rate = ((1 + points) * F + points * there) / least
        carried = (1 + points) * _OUTWARD * self._least_of(growth.carried) + points * digits * trace * 2 * travel
        cut_off, rate = (np.where(hopeless | np.isnan(off), np.inf, off) for off in (cut_off, rate))
        later = np.ones(len(own))
        if self._spin:
            grows = own * np.maximum(1 / least - 1 / most, 0.0)
            later = self._grown_later(grows, cut_off + rounded, growth.inertia, near, least)
        return _Bounds(cut_off, rounded, rate, carried, bent, 2 * own / least, later)

    def _grown_later(self, grows: Array, made: Array, inertia: Array, near: Array, least: Array) -> Array:
        """Return by what factors errors made on panels grow until the end, (p,)."""
        if grows.sum() < _GROWS_LITTLE or not np.isfinite(made).all():
            return factors(grows)
        panels, own = self._panels, self._spin * self._half
        R = rotation(product(self._turns.start[:-1, None], self._turns.inside))
        x, y, z = self._angular
        L = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        A = R @ panels.yielding @ np.swapaxes(R, -1, -2) @ L * self._half[:, None, None, None]
        flow = flow_of(A, self._reach, self._weight, self._to_chebyshev)
        missed = near**2 * (inertia * flow.slope + own[:, None] * flow.inside)
        off = np.exp(grows) * 4 * _OUTWARD * self._least_of(np.where(np.isfinite(missed), missed, np.inf)) / least
        return factors_of(flow, off, grows, made, 2 * own / least)

    def _least_of(self, sizes: Array) -> Array:
        """Return how far interpolation may be off, of functions of these sizes (p, r) on the ellipses: (p,) by the best one."""
        return (self._fall[1:] * sizes[:, 1:]).min(axis=1)

    def _moments(self, panels: _Panels, off: Array) -> tuple[Array, Array]:
        """Bound the least and the greatest moment of inertia on panels (p,), H being off by so much (p,) between the points.

        x.H x is a polynomial of xi for every x, up to that; and a polynomial is stationary in theta where it is least.
        """
        count = 2 * self._count
        theta = (np.arange(count) + 0.5) * np.pi / count
        coefficients = self._to_chebyshev @ panels.inertia.reshape(len(off), self._count, 9)
        j = np.arange(float(self._count))
        bow = np.linalg.norm(coefficients, axis=2) @ j**2 * (np.pi / count) ** 2 / 8
        moments = np.linalg.eigvalsh((np.cos(np.outer(theta, j)) @ coefficients).reshape(len(off), count, 3, 3))
        off = off + bow + 64 * _EPS * moments[..., 2].max(axis=1)
        least, most = moments[..., 0].min(axis=1) - off, moments[..., 2].max(axis=1) + off
        return np.fmax(least, self._masses.base_least), np.where(np.isfinite(most), most, np.inf)

    def _to_integral(self, slope: Array) -> Array:
        """Return the Chebyshev coefficients 1 to g of Q (p, g, 4), from dQ/dxi in the points."""
        return integrated(self._to_chebyshev @ slope)

    def _quaternions(self, u: Array) -> Array:
        panel = np.clip(np.searchsorted(self._ends[:, 0], u, side="right") - 1, 0, len(self._ends) - 1)
        low, high = self._ends[panel].T
        xi = np.clip((2 * u - low - high) / np.maximum(high - low, _LEAST), -1.0, 1.0)
        turned = np.einsum("rg,rgc->rc", _integrals(xi, self._count), self._coefficients[panel])
        turned[:, 0] += 1.0
        turned = product(self._start[panel], turned)
        return turned / np.linalg.norm(turned, axis=1)[:, None]


# ---- columns of panels -------------------------------------------------------------------------------------------------

Columns = TypeVar("Columns", PanelPath, Growth, _Panels)


def _some(columns: Columns, which: NDArray[np.bool_]) -> Columns:
    return type(columns)(*(column[which] for column in columns))


def _merged(old: Columns, halves: Columns, halved: NDArray[np.bool_]) -> Columns:
    """Return columns in order, with two halves in place of each panel that is halved."""
    order = np.argsort(np.concatenate([np.flatnonzero(~halved), np.repeat(np.flatnonzero(halved), 2)]), kind="stable")
    return type(old)(*(np.concatenate([one[~halved], other])[order] for one, other in zip(old, halves, strict=True)))


def _joined(old: _Cut, halves: _Cut, halved: NDArray[np.bool_]) -> _Cut:
    return _Cut(_merged(old.path, halves.path, halved), _merged(old.growth, halves.growth, halved))


# ---- Gauss points ------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def _rule(points: int) -> tuple[Array, ...]:
    """Return g Gauss points, their weights, maps from values there to the coefficients of Legendre's and Chebyshev's
    polynomials (g, g), the integrals from -1 to each point (g, g), and how interpolation's error falls on ellipses (r,).
    """
    xi, weight = legendre.leggauss(points)
    to_legendre = np.linalg.inv(legendre.legvander(xi, points - 1))
    to_chebyshev = np.linalg.inv(chebyshev.chebvander(xi, points - 1))
    made = xi, weight, to_legendre, to_chebyshev, _integrals(xi, points) @ to_legendre, fall(points)
    return tuple(np.asarray(array, dtype=np.float64) for array in made)


@lru_cache(maxsize=8)
def _products(points: int) -> tuple[Array, Array]:
    """Return Chebyshev polynomials 0 to g in 2 g points (2 g, g + 1), and the map from values there (2 g, 2 g)."""
    at = chebyshev.chebpts1(2 * points)
    values, whole = (np.asarray(chebyshev.chebvander(at, d), dtype=np.float64) for d in (points, 2 * points - 1))
    return values, np.linalg.inv(whole).astype(np.float64)


def _integrals(xi: Array, count: int) -> Array:
    """Return the integrals of the Legendre polynomials 0 to count - 1 from -1 to xi (r,), (r, count)."""
    values = legendre.legvander(xi, count)
    out = np.empty((len(xi), count))
    out[:, 0] = xi + 1.0
    k = np.arange(1, count)
    out[:, 1:] = (values[:, 2:] - values[:, :-2]) / (2 * k + 1)
    return out
