"""Where a floating base gets to: its attitude along a path, from the conservation of momentum.

In base axes, with H and h of the centroidal map (Pinocchio's), joint values v(u), and the angular momentum L, which is constant
in the inertial frame, the base turns by

    omega = H^-1 (R^T L dt/du - h dv/du)      per unit of u.

The path is cut into panels. On each, dQ/dxi = Q o omega / 2 is solved by a polynomial that fulfils it in 12 Gauss points, or
fewer on short pieces: a linear system for the quaternions there, exact to the 24th order at the panel's end. How fast the
coefficients of that polynomial fall tells how far it may be off in between; where that is too much the panel is halved. With
L = 0 omega does not depend on R and one solution is all; otherwise R is put in, and it is solved again until nothing changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from spacearm.errors import ProblemError
from spacearm.motion import Curve
from spacearm.proof.masses import free_model, masses_of
from spacearm.proof.middles import JointMap
from spacearm.proof.stance import Stance
from spacearm.robot import Robot

Array = NDArray[np.float64]

TOLERANCE = 1e-10
"""[rad] of the attitude, everywhere."""

_POINTS = ((0.01, 6), (0.1, 8), (np.inf, 12))  # Gauss points of a panel in which a joint travels so far [rad or m]
_TRAVEL = 1.5  # [rad or m] of one joint in a panel to begin with
_HALVINGS, _MOST = 30, 300_000  # configurations
_MOST_TUMBLE = 600.0  # [rad] about a hundred turns in one motion
_WINDOW = 1.0  # [rad] by which a tumbling base turns, that is solved for at once
_SWEEPS, _STEADY = 60, 1e-13
_LEAST = 1e-300
_ROUNDING = 64 * float(np.finfo(np.float64).eps)
_PEAK_SAMPLES = 1000


class _Panels(NamedTuple):
    """Panels p with g Gauss points.

    Attributes:
        ends: (p, 2).
        push: (p, g, 3) omega of the arm's motion, per unit of u, in base axes.
        yielding: (p, g, 3, 3) H^-1 there.
    """

    ends: Array
    push: Array
    yielding: Array


class Drift:
    """The base's attitude along a path.

    Attributes:
        error: [rad] an estimate, on the large side, of how far the attitude may be off anywhere.
        evaluations: configurations at which the centroidal map was asked for.
    """

    def __init__(self, robot: Robot, curve: Curve, stance: Stance, *, time_rate: float) -> None:
        """Integrate.

        Args:
            robot: with masses.
            curve: its joints' path.
            stance: where the base starts and with which momentum.
            time_rate: dt/du [s], constant.

        Raises:
            RobotError: masses that cannot be.
            ProblemError: it tumbles too often to be followed.
        """
        masses_of(robot)
        self._model, self._at_q, self._at_v = free_model(robot)
        self._state = self._model.createData()
        self._curve, self._joints = curve, JointMap(robot)
        self._angular = stance.angular * time_rate
        self._begin = _quaternion(stance.start[:3, :3])
        own, low, high = curve.hulls(1, bisections=0)
        travel = (np.maximum(-low, high) * np.diff(own, axis=1)).max(axis=1)
        typical = float(np.median(travel)) if len(own) > 1 else np.inf
        self._points = next(points for most, points in _POINTS if not typical > most)
        self._xi, self._weight = legendre.leggauss(self._points)
        vandermonde = legendre.legvander(self._xi, self._points - 1)
        self._to_coefficients = np.linalg.inv(vandermonde)  # (g, g)
        self._reach = self._integrals(self._xi) @ self._to_coefficients  # (g, g): from -1 to each point
        self.evaluations = 0
        self._integrate(_cut(own, travel))

    def attitude(self, u: Array) -> Array:
        """Return R_w_b (r, 3, 3) at parameters u (r,)."""
        return _rotation(self._quaternions(u))

    def angles(self) -> tuple[float, float]:
        """Return how far the base is turned from its start at the end, and at most at 1000 instants and the end [rad]."""
        turned = self._quaternions(np.linspace(*self._curve.domain, _PEAK_SAMPLES + 1))
        turned = _product(self._begin * [1, -1, -1, -1], turned)
        angle = 2 * np.arctan2(np.linalg.norm(turned[:, 1:], axis=1), np.abs(turned[:, 0]))
        return float(angle[-1]), float(angle.max())

    # ---- the panels ----------------------------------------------------------------------------------------------------

    def _integrate(self, ends: Array) -> None:
        panels = self._sampled(ends)
        turned = float(self._tumbles(panels).sum())
        if turned > _MOST_TUMBLE:
            raise ProblemError(
                f"the momentum turns the base by some {turned:.3g} rad along the trajectory, expected less than "
                f"{_MOST_TUMBLE:g} rad; check the units of masses, momentum and duration"
            )
        while self.evaluations < _MOST and (fast := self._tumbles(panels) > _WINDOW).any():
            panels = self._halved(panels, fast)
        slope, start = self._solved(panels)
        off = self._off(slope)
        allowed = TOLERANCE / max(float(ends[-1, 1] - ends[0, 0]), _LEAST)  # per unit of u
        for _ in range(_HALVINGS):
            coarse = off > np.maximum(allowed * np.diff(panels.ends, axis=1)[:, 0], 2 * _ROUNDING)
            if not coarse.any() or self.evaluations > _MOST:
                break
            panels = self._halved(panels, coarse)
            slope, start = self._solved(panels)
            off = self._off(slope)
        self._ends, self._start, self._coefficients = panels.ends, start, self._to_coefficients @ slope
        self.error = float(off.sum())

    def _off(self, slope: Array) -> Array:
        """Estimate how far the attitude may be off (p,) [rad] in panels, from dQ/dxi (p, g, 4).

        As if all that is left out were as large as the last two coefficients that are not, whose integrals are at most
        2 / (2 k + 1); the angle is twice the quaternion's.
        """
        last = np.linalg.norm(self._to_coefficients[-2:] @ slope, axis=2).max(axis=1)
        return 4 * last / (self._points - 1) + _ROUNDING

    def _tumbles(self, panels: _Panels) -> Array:
        """Return how far the base turns in panels by its angular momentum, more or less, (p,) [rad]."""
        most = np.linalg.norm(panels.yielding, axis=(2, 3)).max(axis=1)
        return most * np.diff(panels.ends, axis=1)[:, 0] * float(np.linalg.norm(self._angular))

    def _halved(self, panels: _Panels, coarse: NDArray[np.bool_]) -> _Panels:
        ends = panels.ends[coarse]
        middle = ends.mean(axis=1)
        fine = self._sampled(np.stack([ends[:, 0], middle, middle, ends[:, 1]], axis=1).reshape(-1, 2))
        joined = _Panels(*(np.concatenate([old[~coarse], new]) for old, new in zip(panels, fine, strict=True)))
        order = np.argsort(joined.ends[:, 0], kind="stable")
        return _Panels(*(column[order] for column in joined))

    def _sampled(self, ends: Array) -> _Panels:
        """Ask Pinocchio for the centroidal map in all Gauss points."""
        import pinocchio  # pyright: ignore[reportMissingImports]

        u = (ends.mean(axis=1)[:, None] + np.diff(ends, axis=1) / 2 * self._xi).ravel()
        values = self._joints.values(self._curve.sample(u))
        rates = self._curve.sample(u, 1)[:, self._joints.dof] * self._joints.multiplier
        q = np.tile(pinocchio.neutral(self._model), (len(u), 1))
        q[:, self._at_q] = values
        inertia, carried = np.empty((len(u), 3, 3)), np.empty((len(u), 3))
        ask, model, state, at = pinocchio.computeCentroidalMap, self._model, self._state, self._at_v
        for i, (row, rate) in enumerate(zip(q, rates, strict=True)):
            angular = ask(model, state, row)[3:]
            inertia[i] = angular[:, 3:6]
            carried[i] = angular[:, at] @ rate
        self.evaluations += len(u)
        yielding: Array = np.linalg.inv(inertia).astype(np.float64)
        push = -np.einsum("icd,id->ic", yielding, carried)
        shape = len(ends), self._points
        return _Panels(ends, push.reshape(*shape, 3), yielding.reshape(*shape, 3, 3))

    # ---- one solution --------------------------------------------------------------------------------------------------

    def _solved(self, panels: _Panels) -> tuple[Array, Array]:
        """Return dQ/dxi (p, g, 4) in the Gauss points, Q from each panel's start, and the attitudes (p, 4) there."""
        if not self._angular.any():
            slope, _, start = self._turned(panels.ends, panels.push, self._begin)
            return slope, start[:-1]
        window = np.floor(np.cumsum(self._tumbles(panels)) / _WINDOW)
        slopes, starts, begin = [], [], self._begin
        for of in np.unique(window):
            some = _Panels(*(column[window == of] for column in panels))
            slope, start = self._tumbled(some, begin)
            slopes.append(slope)
            starts.append(start[:-1])
            begin = start[-1]
        return np.concatenate(slopes), np.concatenate(starts)

    def _tumbled(self, panels: _Panels, begin: Array) -> tuple[Array, Array]:
        """Solve panels in which omega depends on the attitude, again and again until nothing changes."""
        omega = panels.push
        for _ in range(_SWEEPS):
            slope, inside, start = self._turned(panels.ends, omega, begin)
            R = _rotation(_product(start[:-1, None], inside))
            local = (np.swapaxes(R, -1, -2) @ self._angular)[..., None]
            before, omega = omega, panels.push + (panels.yielding @ local)[..., 0]
            if np.abs(omega - before).max() <= _STEADY * np.abs(omega).max():
                return slope, start
        raise ProblemError(
            "the spacecraft tumbles too fast along the trajectory to be followed, expected less momentum or a shorter duration"
        )

    def _turned(self, ends: Array, omega: Array, begin: Array) -> tuple[Array, Array, Array]:
        """Solve panels, from an attitude (4,), for rates omega (p, g, 3) given in the Gauss points.

        Returns:
            dQ/dxi and Q (p, g, 4) from the panel's start, and the attitudes (p + 1, 4) where they start, and at the end.
        """
        half = np.diff(ends, axis=1)[:, :, None, None] / 2
        right = _times(omega) * (half / 2)  # (p, g, 4, 4): Q o omega / 2 per xi, as a matrix on Q
        count, points = omega.shape[:2]
        system = -np.einsum("ij,pjcd->picjd", self._reach, right).reshape(count, 4 * points, 4 * points)
        system += np.eye(4 * points)
        one = np.tile([1.0, 0.0, 0.0, 0.0], points)
        Q = np.linalg.solve(system, np.tile(one[:, None], (count, 1, 1)))[..., 0].reshape(count, points, 4)
        slope = np.einsum("pgcd,pgd->pgc", right, Q)
        end = np.array([1.0, 0.0, 0.0, 0.0]) + self._weight @ slope
        return slope, Q, _running(np.concatenate([begin[None], end / np.linalg.norm(end, axis=1)[:, None]]))

    def _quaternions(self, u: Array) -> Array:
        panel = np.clip(np.searchsorted(self._ends[:, 0], u, side="right") - 1, 0, len(self._ends) - 1)
        low, high = self._ends[panel].T
        xi = np.clip((2 * u - low - high) / np.maximum(high - low, _LEAST), -1.0, 1.0)
        turned = np.einsum("rg,rgc->rc", self._integrals(xi), self._coefficients[panel])
        turned[:, 0] += 1.0
        turned = _product(self._start[panel], turned)
        return turned / np.linalg.norm(turned, axis=1)[:, None]

    def _integrals(self, xi: Array) -> Array:
        """Return the integrals of the Legendre polynomials 0 to g - 1 from -1 to xi (r,), (r, g)."""
        values = legendre.legvander(xi, self._points)
        out = np.empty((len(xi), self._points))
        out[:, 0] = xi + 1.0
        k = np.arange(1, self._points)
        out[:, 1:] = (values[:, 2:] - values[:, :-2]) / (2 * k + 1)
        return out


def _cut(own: Array, travel: Array) -> Array:
    """Cut a path's own pieces (p, 2), in which a joint travels so far (p,), so that none travels far in a panel."""
    counts = np.clip(np.ceil(travel / _TRAVEL), 1, 1000).astype(np.intp)
    cuts = [np.linspace(a, b, n + 1) for (a, b), n in zip(own.tolist(), counts.tolist(), strict=True)]
    return np.concatenate([np.stack([cut[:-1], cut[1:]], axis=1) for cut in cuts])


# ---- quaternions -------------------------------------------------------------------------------------------------------


def _product(a: Array, b: Array) -> Array:
    """Return a o b, (..., 4)."""
    w, x, y, z = np.moveaxis(b, -1, 0)
    p, i, j, k = np.moveaxis(a, -1, 0)
    return np.stack(
        [
            p * w - i * x - j * y - k * z,
            p * x + i * w + j * z - k * y,
            p * y - i * z + j * w + k * x,
            p * z + i * y - j * x + k * w,
        ],
        axis=-1,
    )


def _times(omega: Array) -> Array:
    """Return matrices (..., 4, 4) that take Q to Q o (0, omega)."""
    x, y, z = np.moveaxis(omega, -1, 0)
    o = np.zeros_like(x)
    rows = [[o, -x, -y, -z], [x, o, z, -y], [y, -z, o, x], [z, y, -x, o]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _running(turns: Array) -> Array:
    """Return the products (p, 4) of the first, the first two, ... of so many quaternions."""
    out, step = turns.copy(), 1
    while step < len(out):
        out[step:] = _product(out[:-step], out[step:])
        step *= 2
    return out / np.linalg.norm(out, axis=1)[:, None]


def _rotation(wxyz: Array) -> Array:
    """Return R (..., 3, 3) of unit quaternions."""
    w, x, y, z = np.moveaxis(wxyz, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _quaternion(R: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation (3, 3)."""
    # The greatest column of 4 q q^T is q times its greatest entry, so nothing is divided by what may be 0.
    trace = float(np.trace(R))
    outer = np.empty((4, 4))
    outer[0, 0], outer[1:, 1:] = 1 + trace, R + R.T + (1 - trace) * np.eye(3)
    outer[0, 1:] = outer[1:, 0] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    column = outer[:, int(np.argmax(np.diag(outer)))]
    return column / np.linalg.norm(column)
