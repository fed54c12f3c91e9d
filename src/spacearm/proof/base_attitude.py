"""The attitude of a floating base along a path, by the conservation of momentum, and a bound of its error.

With H and h of Pinocchio's centroidal map in base axes, joint values v(u), and the angular momentum L, which is constant in
the inertial frame, the base turns at the rate

    omega = H^-1 (R^T L dt/du - h dv/du)      per unit of u.

The path is cut into panels, xi from -1 to 1. On each, dQ/dxi = Q o omega / 2 is solved by a polynomial Q that satisfies it in n
Gauss points: a linear system for the quaternions there. Without momentum omega does not depend on R, and one solution suffices.
Otherwise R is inserted, and the system is solved again until nothing changes.

The error between the points is bounded, and not estimated. The residual of the equation,

    F = 2 H (Q* o dQ/dxi) + |Q|^2 h dv/dxi - |Q|^2 R^T L dt/dxi,

is an entire function of xi that vanishes in the Gauss points. Bounds of it on ellipses around the panel (`polynomial_bounds`)
bound it on the panel, and |F| / (lambda |Q|^2) is the greatest error of the rate, with lambda the least moment of inertia.
Panels are halved until the sum of all errors is less than the tolerance. docs/certificate.md, section 5, has the proofs.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.rotations import conjugate, matrix_by_parts, product_by_parts, quaternion_of, running_products
from spacearm.motion import Curve
from spacearm.proof.base_momentum import masses_of
from spacearm.proof.gauss_points import gauss, in_points
from spacearm.proof.mechanism import free_base_data, free_base_model, joints_of, pinocchio
from spacearm.proof.polynomial_bounds import (
    Growth,
    PanelPath,
    ellipses_of,
    error_factors,
    error_factors_by_flow,
    flow_of,
    greatest_norm,
    on_ellipses,
    outer_eigenvalues,
)
from spacearm.robot import Robot

Array = NDArray[np.float64]

TOLERANCE = 1e-9
"""[rad] The error of the attitude, everywhere. If it needs more evaluations than are allowed, `error` is larger."""


class _Rule(NamedTuple):
    """How many Gauss points a panel has, and when.

    Attributes:
        points: their number.
        travel: how far the joints of a chain may travel on a panel together, for an error of about the tolerance [rad or m].
        overhead: what a panel costs besides its points, in evaluations.
    """

    points: int
    travel: float
    overhead: float


_RULES = (_Rule(5, 0.02, 1.5), _Rule(8, 0.3, 2.0), _Rule(12, 1.3, 4.0), _Rule(16, 2.6, 8.0))
_HALVINGS = 40  # of panels, at most
_MOST_EVALUATIONS = 300_000  # configurations, at most
_MOST_TUMBLE = 600.0  # [rad] by which the momentum may turn the base in one motion: about a hundred turns
_WINDOW = 1.0  # [rad] by which a tumbling base turns on the panels that are solved together
_SWEEPS = 60  # solutions for a tumbling base, at most
_STEADY = 1e-13  # times the greatest rate: a change of omega up to this ends the sweeps
_HALVINGS_AHEAD = 3  # of a piece, before anything is known of it but how far the joints travel
_ALMOST = 0.1  # of a halving: a panel may be longer than its rule says by this power of 2
_GOLDEN = (3 - 5**0.5) / 2  # of a panel
_SHORTEST = 1e-300  # in place of a length of 0 in a quotient
_EPS = float(np.finfo(np.float64).eps)
_ROUNDING = 64 * _EPS  # [rad] of the attitude, for each panel
_VALUE_ROUNDING = 32  # units in the last place by which a joint's value may be wrong
_OUTWARD = 1.001  # times bounds that are sums of some hundred terms: their rounding
_MOST_BENT = 0.5  # by which |Q|^2 may differ from 1 on a panel; beyond it the panel is halved
_MANY_PANELS = 4  # for each piece of the path: with more, a rule with more points is better
_PRESUMED_RESIDUAL = 3.0  # times |h v'| and the tumble: a guess of |F| before H is known, to cut the path in advance
_LITTLE_GROWTH = 1.0  # exponent: errors of a tumbling base that grow by less than e need no flow


class _Cut(NamedTuple):
    """The path cut into p panels.

    Attributes:
        path: the joints' polynomials on them.
        growth: bounds of inertia and momentum on ellipses around them.
    """

    path: PanelPath
    growth: Growth


class _Panels(NamedTuple):
    """The centroidal map in the g Gauss points of p panels, in base axes; rates per unit of xi.

    Attributes:
        inertia, inverse: (p, g, 3, 3) H and H^-1.
        carried: (p, g, 3) h v', the angular momentum of the joints' motion.
        push: (p, g, 3) omega by the joints' motion.
    """

    inertia: Array
    inverse: Array
    carried: Array
    push: Array


class _Turns(NamedTuple):
    """Solutions on p panels with g Gauss points.

    Attributes:
        slope, inside: (p, g, 4) dQ/dxi and Q in the points; Q is 1 where the panel begins.
        start: (p + 1, 4) the attitudes where the panels begin, and at the end.
        missed: (p,) the difference between omega in the points and what the system was solved for.
    """

    slope: Array
    inside: Array
    start: Array
    missed: Array


class _Bounds(NamedTuple):
    """Bounds on p panels.

    Attributes:
        cut_off: (p,) the error of the attitude that is made there between the Gauss points [rad].
        rounded: (p,) the error that is made there by rounding [rad].
        rate: (p,) the error of omega at any point, per unit of xi [rad].
        carried: (p,) the error of the interpolated angular momentum of the joints' motion.
        bent: (p,) by how much |Q|^2 differs from 1.
        tumble: (p,) how far the momentum turns the base [rad].
        later: (p,) the factor by which errors that are made here may grow until the end.
    """

    cut_off: Array
    rounded: Array
    rate: Array
    carried: Array
    bent: Array
    tumble: Array
    later: Array


class BaseAttitude:
    """The base's attitude along a path.

    Attributes:
        error: no attitude is further from the true one than this [rad].
        evaluations: configurations at which the centroidal map was computed.
    """

    def __init__(self, robot: Robot, curve: Curve, *, start: Array, angular: Array) -> None:
        """Integrate.

        Args:
            robot: with masses.
            curve: the path of its joints.
            start: T_w_b (4, 4) at the beginning.
            angular: (3,) the angular momentum L times dt/du, which is constant, in the inertial frame [kg m^2 rad].

        Raises:
            RobotError: the robot's masses are impossible.
            ProblemError: the base tumbles too often to be followed.
        """
        self._masses = masses_of(robot)
        self._model, self._at_q, self._at_v = free_base_model(robot)
        self._state = free_base_data(robot)
        self._joints, self._ellipses = joints_of(robot), ellipses_of(robot)
        own = PanelPath.of(curve, self._joints)
        self._angular = angular
        self._spin = float(np.linalg.norm(self._angular))
        self._begin = quaternion_of(start[:3, :3])
        self._length = max(float(own.ends[-1, 1] - own.ends[0, 0]), _SHORTEST)
        self.evaluations = 0
        self._presumed = _presumed_moment(robot)
        self._choose_points(own)
        self._integrate(own)

    def _choose_points(self, path: PanelPath) -> None:
        """Choose the number of Gauss points of a panel, by how far the joints of a chain and the base turn on the pieces."""
        travel = 2 * self._ellipses.coefficients(path).sum(axis=1)  # for high degrees far less than the hull says
        far = (travel @ self._masses.beyond).max(axis=1, initial=0.0)
        far += self._spin * np.diff(path.ends, axis=1)[:, 0] / self._presumed
        far = np.where(np.isfinite(far), far, np.inf)
        halvings = [np.ceil(np.log2(np.maximum(far / rule.travel, 1.0)) - _ALMOST) for rule in _RULES]
        costs = [(rule.points + rule.overhead) * np.exp2(h).sum() for rule, h in zip(_RULES, halvings, strict=True)]
        self._halvings = {rule.points: np.minimum(h, _HALVINGS_AHEAD) for rule, h in zip(_RULES, halvings, strict=True)}
        self._use(_RULES[int(np.argmin(costs))].points)

    def _use(self, points: int) -> None:
        self._count = points
        self._weight, self._to_legendre, self._to_chebyshev, self._to_integral, self._integrals, self._fall = gauss(points)

    def at(self, u: Array) -> Array:
        """Return R_w_b (r, 3, 3) at parameters u (r,)."""
        return matrix_by_parts(self._quaternions(u))

    @property
    def panels(self) -> tuple[Array, Array, Array]:
        """Where p panels begin and end (p, 2), the attitudes where they begin (p, 4), and the coefficients (p, g, 4).

        On a panel the attitude is that at its beginning times Q / |Q|, with Q = 1 plus the sum of the coefficients times the
        integrals of Legendre's polynomials 0 to g - 1 from -1 to xi.
        """
        return self._ends, self._turns.start[:-1], self._to_legendre @ self._turns.slope

    # ---- bounds for every u --------------------------------------------------------------------------------------------

    def final(self) -> float:
        """Return the angle between the last attitude and the first [rad]; it may be wrong by `error`."""
        turned = _left_matrix(conjugate(self._begin)) @ self._turns.start[-1]
        return float(2 * np.arctan2(np.sqrt(turned[1:] @ turned[1:]), abs(turned[0])))

    def peak(self) -> float:
        """Return a bound of the angle to the first attitude, for any u [rad]."""
        at_start = _left_matrix(self._turns.start[:-1] @ _left_matrix(conjugate(self._begin)).T)  # of Q_0* o Q_start
        vectors = self._chebyshev_of_turn() @ np.swapaxes(at_start[:, 1:], -1, -2)
        scale = 1 / np.sqrt(1 - self._bounds.bent)
        most = greatest_norm(vectors, scale, np.zeros_like(scale))
        return min(np.pi, 2 * float(np.arcsin(min(1.0, most))) + self.error)

    def rate(self) -> float:
        """Return a bound of the base's rate of turn, per unit of u [rad].

        The polynomial turns at 2 vec(Q* o dQ/dxi) / |Q|^2, which is at most 2 |dQ/dxi| / |Q|, and hardly less: |Q| is constant
        but for the error.
        """
        half, bounds = self._half, self._bounds
        if not np.isfinite(self.error):
            return np.inf
        extra = (bounds.rate + bounds.tumble / 2 * self.error) / half
        return greatest_norm(self._to_chebyshev @ self._turns.slope, 2 / (half * np.sqrt(1 - bounds.bent)), extra)

    def _chebyshev_of_turn(self) -> Array:
        """Return the Chebyshev coefficients of Q, (p, g + 1, 4)."""
        d = self._integral_coefficients(self._turns.slope)
        first = np.array([1.0, 0.0, 0.0, 0.0]) - (-1.0) ** np.arange(1, self._count + 1) @ d
        return np.concatenate([first[:, None], d], axis=1)

    def joint_momentum(self) -> float:
        """Return a bound of the angular momentum of the joints' motion, per unit of u [kg m^2 rad]."""
        half = self._half
        return greatest_norm(self._to_chebyshev @ self._panels.carried, 1 / half, self._bounds.carried / half)

    @property
    def instants(self) -> Array:
        """The parameters (2 p + 1,) where panels begin, at a golden section of each, and at the end.

        Panels are halves of halves, and so are the steps of other integrations: a golden section is within their steps.
        """
        low, high = self._cut.path.ends.T
        return np.append(np.stack([low, low + _GOLDEN * (high - low)], axis=1).ravel(), high[-1])

    # ---- the panels ----------------------------------------------------------------------------------------------------

    def _integrate(self, own: PanelPath) -> None:
        cut = self._first_cut(own)
        panels = self._sampled(cut.path)
        while self._spin:
            turned = self._tumbles(panels, cut.path)
            if turned.sum() > _MOST_TUMBLE:
                raise ProblemError(
                    f"the momentum turns the base by some {turned.sum():.3g} rad along the trajectory, expected less than "
                    f"{_MOST_TUMBLE:g} rad; check the units of masses, momentum and duration"
                )
            if self.evaluations > _MOST_EVALUATIONS or not (fast := turned > _WINDOW).any():
                break
            cut, panels = self._halved(cut, panels, fast)
        for halving in range(_HALVINGS):
            self._cut, self._panels = cut, panels
            self._half = np.maximum(np.diff(cut.path.ends, axis=1)[:, 0] / 2, _SHORTEST)
            self._turns = self._solved()
            self._bounds = bounds = self._bounded()
            made = bounds.cut_off * bounds.later
            coarse = (made > self._allowed(cut.path.ends)) & (bounds.cut_off > bounds.rounded)
            enough = made.sum() <= TOLERANCE or not coarse.any()
            if enough or self.evaluations > _MOST_EVALUATIONS or halving == _HALVINGS - 1:
                self.error = float(((bounds.cut_off + bounds.rounded) * bounds.later).sum())
                break
            if self._count < _RULES[-1].points and len(coarse) + coarse.sum() > _MANY_PANELS * len(own.ends):
                self._use(_RULES[-1].points)
                cut = self._first_cut(own)
                panels = self._sampled(cut.path)
            else:
                cut, panels = self._halved(cut, panels, coarse)
        self._ends, start = self._cut.path.ends, self._turns.start[:-1]
        self._chebyshev = self._chebyshev_of_turn() @ np.swapaxes(_left_matrix(start), -1, -2)  # of Q_start o Q, (p, g + 1, 4)

    def _allowed(self, ends: Array) -> Array:
        """Return the error that each panel may make, (p,) [rad]: half by the panels' lengths, half by their number."""
        return TOLERANCE / 2 * (np.diff(ends, axis=1)[:, 0] / self._length + 1 / len(ends))

    def _first_cut(self, own: PanelPath) -> _Cut:
        """Cut the path by a guess of the residual, before any evaluation. Take more points if that gives many panels."""
        cut = self._cut_ahead(own)
        for _ in range(_HALVINGS):
            if len(cut.path.ends) > _MANY_PANELS * len(own.ends) and self._count < _RULES[-1].points:
                self._use(_RULES[-1].points)
                cut = self._cut_ahead(own)
            tumble = self._spin * np.diff(cut.path.ends, axis=1) / 2
            missed = 4 * self._least_of(_PRESUMED_RESIDUAL * (cut.growth.carried + tumble)) / self._presumed
            coarse = missed > self._allowed(cut.path.ends)
            if not coarse.any() or len(coarse) * self._count > _MOST_EVALUATIONS:
                break
            cut = _joined(cut, self._grown(_some_path(cut.path, coarse).halves()), coarse)
        return cut

    def _cut_ahead(self, own: PanelPath) -> _Cut:
        """Cut the path by how far the joints travel on its pieces."""
        levels = self._halvings[self._count].astype(np.intp)
        while np.exp2(levels).sum() * self._count > _MOST_EVALUATIONS and levels.any():
            levels = np.maximum(levels - 1, 0)
        return self._grown(own.cut(levels))

    def _grown(self, path: PanelPath) -> _Cut:
        return _Cut(path, self._ellipses.growth(path))

    def _halved(self, cut: _Cut, panels: _Panels, coarse: NDArray[np.bool_]) -> tuple[_Cut, _Panels]:
        fine = self._grown(_some_path(cut.path, coarse).halves())
        return _joined(cut, fine, coarse), _Panels(*_merged(panels, self._sampled(fine.path), coarse))

    def _sampled(self, path: PanelPath) -> _Panels:
        """Compute the centroidal map in all Gauss points."""
        values, rates = (in_points(of.shape[1] - 1, self._count) @ of for of in (path.values, path.rates))
        return self._sampled_at(values, rates)

    def _sampled_at(self, values: Array, rates: Array) -> _Panels:
        """Compute Pinocchio's centroidal map at joint values, with rates, (p, g, j)."""
        library = pinocchio()
        shape = values.shape[:2]
        count = shape[0] * shape[1]
        q = np.tile(library.neutral(self._model), (count, 1))
        q[:, self._at_q] = values.reshape(count, -1)
        map_of = np.empty((count, 3, self._model.nv))
        compute, model, state = library.computeCentroidalMap, self._model, self._state
        for i, row in enumerate(q):
            map_of[i] = compute(model, state, row)[3:]
        self.evaluations += count
        inertia = np.ascontiguousarray(map_of[:, :, 3:6])
        carried = np.einsum("icd,id->ic", map_of[:, :, self._at_v], rates.reshape(count, -1))
        inverse: Array = np.linalg.inv(inertia).astype(np.float64)
        push = -np.einsum("icd,id->ic", inverse, carried)
        matrices, vectors = (*shape, 3, 3), (*shape, 3)
        return _Panels(inertia.reshape(matrices), inverse.reshape(matrices), carried.reshape(vectors), push.reshape(vectors))

    def _tumbles(self, panels: _Panels, path: PanelPath) -> Array:
        """Estimate how far the angular momentum turns the base on panels, (p,) [rad]."""
        most = np.linalg.norm(panels.inverse, axis=(2, 3)).max(axis=1)
        return most * np.diff(path.ends, axis=1)[:, 0] * self._spin

    # ---- one solution --------------------------------------------------------------------------------------------------

    def _solved(self) -> _Turns:
        """Solve all panels."""
        panels = self._panels
        if not self._spin:
            return self._turned(panels.push, self._begin, np.zeros(len(panels.push)))
        window = np.floor(np.cumsum(self._tumbles(panels, self._cut.path)) / _WINDOW)
        parts: list[_Turns] = []
        begin = self._begin
        for of in np.unique(window).tolist():
            rows = window == of
            some = _Panels(*(column[rows] for column in panels))
            parts.append(self._tumbled(some, self._half[rows], begin))
            begin = parts[-1].start[-1]
        return _Turns(
            slope=np.concatenate([part.slope for part in parts]),
            inside=np.concatenate([part.inside for part in parts]),
            start=np.concatenate([*(part.start[:-1] for part in parts), begin[None]]),
            missed=np.concatenate([part.missed for part in parts]),
        )

    def _tumbled(self, panels: _Panels, half: Array, begin: Array) -> _Turns:
        """Solve panels on which omega depends on the attitude: again and again until nothing changes."""
        omega = panels.push
        for _ in range(_SWEEPS):
            turns = self._turned(omega, begin, np.zeros(len(omega)))
            R = matrix_by_parts(product_by_parts(turns.start[:-1, None], turns.inside))
            local = (np.swapaxes(R, -1, -2) @ self._angular)[..., None] * half[:, None, None, None]
            before, omega = omega, panels.push + (panels.inverse @ local)[..., 0]
            changed = np.abs(omega - before).max(axis=(1, 2))
            if changed.max() <= _STEADY * np.abs(omega).max():
                return turns._replace(missed=2 * changed)
        raise ProblemError(
            "the spacecraft tumbles too fast along the trajectory to be followed, expected less momentum or a shorter duration"
        )

    def _turned(self, omega: Array, begin: Array, missed: Array) -> _Turns:
        """Solve panels, from an attitude (4,), for rates omega (p, g, 3) given in the Gauss points.

        A quaternion is the first row (w + i x, y + i z) of a complex matrix, and its product with another one is that row times
        the other one's matrix. So the system has two complex unknowns for each point.
        """
        count, points = omega.shape[:2]
        matrix = np.empty((2, 2, count, points), dtype=np.complex128)  # the transpose, of omega / 2
        x, y, z = np.moveaxis(omega / 2, -1, 0)
        matrix[0, 0], matrix[1, 1] = 1j * x, -1j * x
        matrix[1, 0], matrix[0, 1] = y + 1j * z, -y + 1j * z
        system = -self._integrals[:, None, :, None] * matrix.transpose(2, 0, 3, 1)[:, None]  # (p, g, 2, g, 2)
        system = system.reshape(count, 2 * points, 2 * points)
        system.reshape(count, -1)[:, :: 2 * points + 1] += 1.0
        row = np.linalg.solve(system, np.tile([[1.0], [0.0]], (count, points, 1))).reshape(count, points, 2)
        Q = row.view(np.float64)
        slope = product_by_parts(Q, np.concatenate([np.zeros_like(omega[..., :1]), omega / 2], axis=-1))
        end = np.array([1.0, 0.0, 0.0, 0.0]) + self._weight @ slope
        turns = np.concatenate([begin[None], end / np.linalg.norm(end, axis=1)[:, None]])
        start = running_products(turns, product_by_parts)
        return _Turns(slope, Q, start, missed)

    # ---- the bound of its error ----------------------------------------------------------------------------------------

    def _bounded(self) -> _Bounds:
        """Bound the error that the solution makes on each panel."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return self._bounds_of(self._panels, self._turns, self._cut)

    def _bounds_of(self, panels: _Panels, turns: _Turns, cut: _Cut) -> _Bounds:
        points, growth, own = self._count, cut.growth, self._spin * self._half
        slope = on_ellipses(np.linalg.norm(self._to_chebyshev @ turns.slope, axis=2))  # (p, r) of |dQ/dxi|
        moved = np.linalg.norm(self._integral_coefficients(turns.slope), axis=2)
        moved = on_ellipses(np.concatenate([moved.sum(axis=1)[:, None], moved], axis=1))  # of |Q - 1|
        near = 1 + np.sqrt(2) * moved  # g
        missed = near * (2 * growth.inertia * slope + near * (growth.carried + own[:, None]))
        missed = np.where(np.isfinite(missed), missed, np.inf)
        F = _OUTWARD * self._least_of(missed)
        bent = 4 * _OUTWARD * self._least_of(2 * near * slope) + _ROUNDING
        hopeless = ~(bent < _MOST_BENT)
        bent = np.where(hopeless, 0.0, bent)
        least, most = self._moments(panels, (1 + points) * _OUTWARD * self._least_of(growth.inertia))
        least = least * (1 - bent)
        # In the points themselves: rounding, and what the last sweep for a tumbling base changed.
        trace = np.trace(panels.inertia, axis1=2, axis2=3).max(axis=1)
        weight = np.where(
            self._joints.revolute, 1.0, np.sqrt(2 * self._masses.total / trace)[:, None]
        )  # of prismatic joints: 1 over a length
        travel, size = (weight * growth.travel).sum(axis=1), (weight * cut.path.size).sum(axis=1)
        lost = 4 * cut.path.values.shape[1]  # units in the last place: sums of as many terms as there are coefficients
        digits = _EPS * (64 + lost + (_VALUE_ROUNDING + lost) * size)
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
        """Return the factors by which errors made on panels may grow until the end, (p,)."""
        if grows.sum() < _LITTLE_GROWTH or not np.isfinite(made).all():
            return error_factors(grows)
        panels, own = self._panels, self._spin * self._half
        R = matrix_by_parts(product_by_parts(self._turns.start[:-1, None], self._turns.inside))
        x, y, z = self._angular
        L = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        A = R @ panels.inverse @ np.swapaxes(R, -1, -2) @ L * self._half[:, None, None, None]
        flow = flow_of(A, integrals=self._integrals, weight=self._weight, to_chebyshev=self._to_chebyshev)
        missed = near**2 * (inertia * flow.slope + own[:, None] * flow.inside)
        off = np.exp(grows) * 4 * _OUTWARD * self._least_of(np.where(np.isfinite(missed), missed, np.inf)) / least
        return error_factors_by_flow(flow, off=off, grows=grows, made=made, tumble=2 * own / least)

    def _least_of(self, sizes: Array) -> Array:
        """Return the error of interpolation (p,) of functions of these sizes (p, r) on the ellipses, by the best ellipse."""
        return (self._fall[1:] * sizes[:, 1:]).min(axis=1)

    def _moments(self, panels: _Panels, off: Array) -> tuple[Array, Array]:
        """Bound the least and the greatest moment of inertia on panels (p,); `off` (p,) is the error of interpolating H.

        For every x, x.H x is a polynomial of xi up to this error. A polynomial is stationary in theta where it is least.
        """
        count = 2 * self._count
        theta = (np.arange(count) + 0.5) * np.pi / count
        coefficients = self._to_chebyshev @ panels.inertia.reshape(len(off), self._count, 9)
        j = np.arange(float(self._count))
        sag = np.linalg.norm(coefficients, axis=2) @ j**2 * (np.pi / count) ** 2 / 8
        low, high = outer_eigenvalues((np.cos(np.outer(theta, j)) @ coefficients).reshape(len(off), count, 3, 3))
        off = off + sag + 64 * _EPS * high.max(axis=1)
        least, most = low.min(axis=1) - off, high.max(axis=1) + off
        return np.fmax(least, self._masses.base_least), np.where(np.isfinite(most), most, np.inf)

    def _integral_coefficients(self, slope: Array) -> Array:
        """Return the Chebyshev coefficients 1 to g of Q (p, g, 4), from dQ/dxi in the points."""
        return self._to_integral @ slope

    def _quaternions(self, u: Array) -> Array:
        panel = np.minimum(np.maximum(np.searchsorted(self._ends[:, 0], u, side="right") - 1, 0), len(self._ends) - 1)
        low, high = self._ends[panel].T
        xi = np.minimum(np.maximum((2 * u - low - high) / np.maximum(high - low, _SHORTEST), -1.0), 1.0)
        terms = np.cos(np.arccos(xi)[:, None] * np.arange(self._count + 1.0))
        turned = (terms[:, None] @ self._chebyshev[panel])[:, 0]
        return turned / np.sqrt(np.einsum("rc,rc->r", turned, turned))[:, None]


@cached_by_identity
def _presumed_moment(robot: Robot) -> float:
    """Return a guess of H's least moment [kg m^2]: half of it where all joint values are 0."""
    model = free_base_model(robot)[0]
    library = pinocchio()
    H = library.computeCentroidalMap(model, free_base_data(robot), library.neutral(model))[3:, 3:6]
    return max(masses_of(robot).base_least, float(np.linalg.eigvalsh(H)[0]) / 2)


# ---- Panels replaced by their halves ---------------------------------------------------------------------------------


def _some_path(path: PanelPath, which: NDArray[np.bool_]) -> PanelPath:
    return PanelPath(*(column[which] for column in path))


def _order(halved: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the order in which kept panels, then two halves of each of the others, are along the path."""
    return np.argsort(np.concatenate([np.flatnonzero(~halved), np.repeat(np.flatnonzero(halved), 2)]), kind="stable")


def _merged(old: tuple[Array, ...], halves: tuple[Array, ...], halved: NDArray[np.bool_]) -> tuple[Array, ...]:
    """Return columns of panels in order, with two halves in place of each panel that is halved."""
    order = _order(halved)
    return tuple(np.concatenate([one[~halved], other])[order] for one, other in zip(old, halves, strict=True))


def _joined(old: _Cut, halves: _Cut, halved: NDArray[np.bool_]) -> _Cut:
    return _Cut(PanelPath(*_merged(old.path, halves.path, halved)), Growth(*_merged(old.growth, halves.growth, halved)))


# ---- Products of quaternions -----------------------------------------------------------------------------------------


def _left_matrix(p: Array) -> Array:
    """Return the matrices (..., 4, 4) that map a quaternion q to the product p o q."""
    return (p @ _left()).reshape(*p.shape, 4)


@lru_cache(maxsize=1)
def _left() -> Array:
    """Return the map (4, 16) from a quaternion to its matrix of `_left_matrix`."""
    columns = [product_by_parts(np.eye(4), one) for one in np.eye(4)]  # [part of q][part of p][row]
    return np.moveaxis(np.array(columns), 0, -1).reshape(4, 16)
