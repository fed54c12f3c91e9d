"""How a floating base moves while its arm runs a path.

Without angular momentum the base's attitude depends on the path alone, and not on its timing. Its position follows from the
centre of mass of base and arm, which rests or drifts at constant velocity. With angular momentum the base also turns by
itself, and time counts. Bodies are rigid; there is no force, no contact and no orbit.

The attitude is integrated by Magnus's series of sixth order: one rotation vector for a step, from the rates at Gauss's three
nodes. With rates omega in the turning axes, R' = R [omega]x, a step is R exp([turn]x), and commutators are cross products
(Blanes, Casas, Oteo and Ros, The Magnus expansion and some of its applications, 2009, section 5). Steps are halved where
their errors ask for it. Turning two attitudes by the same rotation changes no angle between them, so errors add up and do not
grow, and each step may have the share of the allowed error that its length has of the whole.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief, Rows, counted, named
from spacearm.core.checks import as_number, as_numbers, as_pose, require_kind, shown
from spacearm.core.errors import ProblemError
from spacearm.core.exact import cross, inverse3, length, powers, product, solved3
from spacearm.core.rotations import (
    angle,
    conjugate,
    exponential,
    matrix_of,
    multiplied,
    quaternion_of,
    rotated,
    running_products,
)
from spacearm.dynamics.momentum import Momentum, moving, require_masses, system_mass
from spacearm.robot import Robot
from spacearm.robot.kinematics import as_configurations

Array = NDArray[np.float64]

Field = Callable[[Array], tuple[Array, Array | None]]
"""The rates at v (m,): those without angular momentum (m, 3), and the matrices (m, 3, 3) that give, times the angular momentum
in base axes, what is added to them; None without angular momentum."""

NODES: Array = np.array([1 / 2 - sqrt(15) / 10, 1 / 2, 1 / 2 + sqrt(15) / 10])
"""Where in a step, from 0 to 1, the rates are evaluated: Gauss's nodes."""

_HALVED = 32  # divides the difference between a step and its two halves: the halves' error; 63 as steps become short
_LEAST = 1e-15  # [rad] smaller differences are rounding
_MOST_STEPS = 1 << 15  # steps that are halved at most once more
_FIRST_STEPS = 16  # at least, over the whole path
_FIRST_TURN = 0.5  # [rad] that the angular momentum may turn the base by in a first step
_MOST_TURN = 600.0  # [rad] that it may turn the base by in the whole motion: about a hundred turns
_WINDOW = 1.0  # [rad] that it turns the base by in steps that are solved together; then about twelve sweeps are enough
_SWEEPS = 60  # at most, of a fixed-point iteration over steps
_CONVERGED = 2e-15  # change of quaternions and turns [rad] at which sweeps end
_AT_ONCE = 4096  # values of u, so that the arrays fit into the cache


class JointPath(Protocol):
    """A piecewise polynomial q(u): a Motion over s, or a PiecewisePath over time."""

    @property
    def domain(self) -> tuple[float, float]:
        """Where u begins and ends."""
        ...

    def sample(self, u: ArrayLike, /, derivative: int = 0) -> Array:
        """Return q(u), or a derivative with respect to u, (..., n)."""
        ...

    def hulls(self, derivative: int, *, bisections: int = ...) -> tuple[Array, Array, Array]:
        """Return the ends (p, 2) of its pieces, each halved `bisections` times, and bounds of a derivative on them."""
        ...


class BaseMotion(Brief):
    """The motion of a floating base along a path of its arm's joints.

    Attributes:
        robot: whose base floats.
        curve: the path q(u) of its joints.
        base_start: (4, 4) T_w_b where the path begins [m].
        momentum: of base and arm, constant.
        error: estimate of the greatest error of the attitude [rad]; at most the tolerance, unless 65,536 steps or float64
            do not reach it.
        steps: how many were taken.
    """

    def __init__(
        self,
        robot: Robot,
        curve: JointPath,
        *,
        base_start: ArrayLike | None = None,
        momentum: Momentum | None = None,
        duration: float | None = None,
        tolerance: float = 1e-9,
    ) -> None:
        """Integrate the base's attitude along the path.

        Args:
            robot: with masses.
            curve: the path.
            base_start: T_w_b (4, 4), or a point (3,), where the path begins [m]; None: at the origin.
            momentum: of base and arm; None: none.
            duration: of the whole path [s]; needed with momentum other than 0, and of no effect without.
            tolerance: of the attitude [rad].

        Raises:
            RobotError: masses that cannot be, or a path for another number of joints.
            ProblemError: a momentum other than 0 without duration, one that makes the base spin, or values that cannot be.
        """
        require_masses(robot)
        if not all(hasattr(curve, name) for name in ("domain", "sample", "hulls")) or isinstance(curve, type):
            raise ProblemError(f"curve is {shown(curve)}, expected a Motion or a PiecewisePath")
        self.robot, self.curve = robot, curve
        self.base_start = as_pose("base_start", base_start, ProblemError)
        self.momentum = Momentum() if momentum is None else momentum
        require_kind("momentum", self.momentum, Momentum, ProblemError)
        tolerance = as_number("tolerance", tolerance, ProblemError, above=0, unit="rad")
        self._begin, self._end = curve.domain
        self._duration = 0.0
        if not self.momentum.is_zero:
            if duration is None:
                raise ProblemError("duration is None, expected a time [s]: with momentum the base moves by itself; give one")
            self._duration = as_number("duration", duration, ProblemError, at_least=0, unit="s")
        self._drift = self.momentum.linear / system_mass(robot)
        attitude = quaternion_of(self.base_start[:3, :3])
        first = as_configurations(robot, curve.sample(self._begin))[None]
        center = moving(robot, first, np.zeros_like(first)).center[0]
        self._center = self.base_start[:3, 3] + rotated(attitude, center)  # at the beginning, in the inertial frame
        self._steps = adaptive_steps(self._field, self._first_nodes(), attitude, self.momentum.angular, tolerance)
        self.error, self.steps = self._steps.error, len(self._steps.nodes) - 1

    def _in_short(self) -> tuple[str, Rows]:
        rows = [("integrated", f"{counted(self.steps, 'step')}, attitude to {self.error:.2g} rad")]
        return f"BaseMotion: robot {named(self.robot.name)} along a {type(self.curve).__name__}", rows

    def pose(self, u: ArrayLike) -> tuple[Array, Array]:
        """Return the base's position (..., 3) [m] and attitude_wxyz (..., 4) in the inertial frame.

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
        """
        at = as_numbers("u", u, ProblemError)
        parts = [self._pose(part) for part in _chunks(self._within(at.ravel()))]
        position, attitude = (np.concatenate(values) for values in zip(*parts, strict=True))
        return position.reshape(*at.shape, 3), attitude.reshape(*at.shape, 4)

    def rate(self, u: ArrayLike) -> Array:
        """Return how the base turns, (..., 3) per unit of u, base axes [rad].

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
        """
        return self.twist(u)[1]

    def twist(self, u: ArrayLike) -> tuple[Array, Array]:
        """Return the velocity of the base's origin (..., 3) in the inertial frame [m], and `rate`, per unit of u.

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
        """
        at = as_numbers("u", u, ProblemError)
        parts = [self._twist(part) for part in _chunks(self._within(at.ravel()))]
        velocity, omega = (np.concatenate(values).reshape(*at.shape, 3) for values in zip(*parts, strict=True))
        return velocity, omega

    def state(self, u: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return what `pose` and `twist` return, in one go."""
        at = as_numbers("u", u, ProblemError)
        parts = [self._state(part) for part in _chunks(self._within(at.ravel()))]
        position, attitude, velocity, omega = (np.concatenate(values) for values in zip(*parts, strict=True))
        position, velocity, omega = (values.reshape(*at.shape, 3) for values in (position, velocity, omega))
        return position, attitude.reshape(*at.shape, 4), velocity, omega

    def placed(self, u: ArrayLike, T_b_x: Array) -> Array:
        """Return frames of the base in the inertial frame, T_w_x (..., 4, 4).

        Args:
            u: (...,) on the path; beyond its ends, what holds there.
            T_b_x: (..., 4, 4) in the base's frame, one for each u [m].
        """
        position, attitude = self.pose(u)
        T_w_b = np.zeros_like(T_b_x)
        T_w_b[..., :3, :3], T_w_b[..., :3, 3], T_w_b[..., 3, 3] = matrix_of(attitude), position, 1.0
        return product(T_w_b, T_b_x)

    def _within(self, u: Array) -> Array:
        if np.isnan(u).any():
            raise ProblemError("an instant is nan, expected numbers; leave it out")
        return np.clip(u, self._begin, self._end)

    def _moved(self, u: Array) -> tuple[Array, Array]:
        """Return q and dq/du, (m, n); a path may know both at once."""
        both = getattr(self.curve, "moved", None)
        if both is not None:
            return both(u)
        return self.curve.sample(u), self.curve.sample(u, 1)

    @property
    def _time_scale(self) -> float:
        """dt/du [s]."""
        return self._duration / (self._end - self._begin)

    def _field(self, u: Array) -> tuple[Array, Array | None]:
        found = moving(self.robot, *self._moved(u))
        if not self.momentum.angular.any():
            return found.free_rate, None
        return found.free_rate, inverse3(found.H_w) * self._time_scale

    def _first_nodes(self) -> Array:
        ends = self.curve.hulls(0, bisections=0)[0]
        breaks = np.append(ends[:, 0], ends[-1, 1])
        parts = max(1, -(-_FIRST_STEPS // (len(breaks) - 1)))
        if self.momentum.angular.any():
            spin = self._field(breaks)[1]
            assert spin is not None
            turned = float(np.linalg.norm(spin, axis=(1, 2)).max() * length(self.momentum.angular))
            if turned * (breaks[-1] - breaks[0]) > _MOST_TURN:
                raise ProblemError(
                    f"momentum.angular is {shown(self.momentum.angular.tolist())}, which turns the base by up to "
                    f"{turned * (breaks[-1] - breaks[0]):.3g} rad in {self._duration:.4g} s, expected less than "
                    f"{_MOST_TURN:g} rad; check the units of masses, momentum and duration"
                )
            parts = max(parts, int(np.ceil(turned * np.diff(breaks).max() / _FIRST_TURN)))
        share = np.arange(parts) / parts
        return np.append((breaks[:-1, None] + share * np.diff(breaks)[:, None]).ravel(), breaks[-1])

    def _pose(self, u: Array) -> tuple[Array, Array]:
        attitude = attitude_within(self._field, self._steps, u, self.momentum.angular)
        return self._position(u, attitude, moving(self.robot, *self._moved(u)).center), attitude

    def _position(self, u: Array, attitude: Array, center: Array) -> Array:
        time = (u - self._steps.nodes[0]) * self._time_scale
        return self._center + self._drift * time[:, None] - rotated(attitude, center)

    def _twist(self, u: Array) -> tuple[Array, Array]:
        return self._state(u)[2:]

    def _state(self, u: Array) -> tuple[Array, Array, Array, Array]:
        found = moving(self.robot, *self._moved(u))
        attitude = attitude_within(self._field, self._steps, u, self.momentum.angular)
        omega = found.free_rate
        if self.momentum.angular.any():
            inverse = attitude * np.array([1.0, -1.0, -1.0, -1.0])
            spin = solved3(found.H_w, rotated(inverse, self.momentum.angular))
            omega = omega + spin * self._time_scale
        # Velocity of the centre of mass relative to the base's origin, base axes
        center = found.center_rate + cross(omega, found.center)
        velocity = self._drift * self._time_scale - rotated(attitude, center)
        return self._position(u, attitude, found.center), attitude, velocity, omega


class Steps(NamedTuple):
    """Attitudes after steps of an independent variable v.

    Attributes:
        nodes: (m + 1,) where steps begin and end.
        attitude_wxyz: (m + 1, 4) there, in the inertial frame.
        error: estimate of the greatest error of these [rad].
    """

    nodes: Array
    attitude_wxyz: Array
    error: float


class _Spans(NamedTuple):
    """Steps from `begin`, with the field at their nodes: free (..., 3, 3), spin (..., 3, 3, 3) or None."""

    begin: Array
    length: Array
    free: Array
    spin: Array | None

    def take(self, which: NDArray[np.bool_]) -> _Spans:
        return _Spans(*(None if part is None else part[which] for part in self))  # type: ignore[arg-type]

    def in_a_row(self) -> _Spans:
        """Return pairs of halves (m, 2, ...) as steps (2 m, ...)."""
        return _Spans(*(None if part is None else part.reshape(-1, *part.shape[2:]) for part in self))  # type: ignore[arg-type]


def adaptive_steps(field: Field, nodes: Array, start_wxyz: Array, angular: Array, tolerance: float) -> Steps:
    """Integrate an attitude, halving steps until the estimated error is at most the tolerance.

    Args:
        field: the rates.
        nodes: (m + 1,) of the first steps: where the field is not smooth, and enough to see how it runs.
        start_wxyz: (4,) at the first.
        angular: (3,) momentum, in the inertial frame.
        tolerance: of the attitude at all nodes [rad]; where rounding or the number of steps is in the way, it is exceeded.
    """
    wholes = _spans(field, nodes[:-1], np.diff(nodes))
    halves = _halves(field, wholes)
    while True:
        flat = halves.in_a_row()
        attitude, turns = _chained(flat, start_wxyz, angular)
        single = exponential(_independent(wholes, attitude[:-1:2], angular))
        left = angle(multiplied(conjugate(single), multiplied(turns[::2], turns[1::2])))
        shares = tolerance * wholes.length / wholes.length.sum()
        split = (left / _HALVED > shares) & (left > _LEAST)
        error = float(left.sum()) / _HALVED
        if error <= tolerance or not split.any() or len(split) > _MOST_STEPS:
            return Steps(np.append(flat.begin, nodes[-1]), attitude, error + _LEAST)
        fresh = halves.take(split).in_a_row()
        order = np.argsort(np.concatenate([wholes.begin[~split], fresh.begin]))
        wholes, halves = (
            _joined(old.take(~split), new, order) for old, new in ((wholes, fresh), (halves, _halves(field, fresh)))
        )


def attitude_within(field: Field, steps: Steps, v: Array, angular: Array) -> Array:
    """Return the attitude (m, 4) at v (m,): one short step from the node before each."""
    node = np.clip(np.searchsorted(steps.nodes, v, side="right") - 1, 0, len(steps.nodes) - 1)
    start = steps.attitude_wxyz[node]
    spans = _spans(field, steps.nodes[node], v - steps.nodes[node])
    out = multiplied(start, exponential(_independent(spans, start, angular)))
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def _spans(field: Field, begin: Array, length: Array) -> _Spans:
    at = begin[..., None] + length[..., None] * NODES
    free, spin = field(at.ravel())
    return _Spans(begin, length, free.reshape(*at.shape, 3), None if spin is None else spin.reshape(*at.shape, 3, 3))


def _halves(field: Field, spans: _Spans) -> _Spans:
    """Return each step's halves, (m, 2, ...)."""
    half = spans.length / 2
    return _spans(field, np.stack([spans.begin, spans.begin + half], axis=1), np.stack([half, spans.length - half], axis=1))


def _joined(a: _Spans, b: _Spans, order: NDArray[np.int64]) -> _Spans:
    pairs = zip(a, b, strict=True)
    return _Spans(*(None if x is None or y is None else np.concatenate([x, y])[order] for x, y in pairs))  # type: ignore[arg-type]


def _independent(spans: _Spans, attitude: Array, angular: Array) -> Array:
    """Return the turns (m, 3) of steps that begin at attitudes (m, 4)."""
    if spans.spin is None:
        return step_turn(spans.free, spans.length)
    within, turn = np.zeros_like(spans.free), np.zeros_like(attitude[:, 1:])
    for _ in range(_SWEEPS):
        turn, now = _swept(spans, attitude, within, angular)
        change, within = np.abs(now - within).max(initial=0.0), now
        if change < _CONVERGED:
            break
    return turn


def _swept(spans: _Spans, attitude: Array, within: Array, angular: Array) -> tuple[Array, Array]:
    """Return better turns of steps (m, 3) and of their parts up to each node (m, 3, 3), which the momentum depends on."""
    assert spans.spin is not None
    momentum = rotated(conjugate(multiplied(attitude[:, None], exponential(within))), angular)  # in base axes
    rates = spans.free + product(spans.spin, momentum[..., None])[..., 0]
    return step_turn(rates, spans.length), step_turn(product(_PARTS, rates[:, None]), spans.length[:, None] * NODES)


def _chained(spans: _Spans, start: Array, angular: Array) -> tuple[Array, Array]:
    """Return the attitudes (m + 1, 4) before and after steps in order, and their turns (m, 4)."""
    if spans.spin is None:
        turns = exponential(step_turn(spans.free, spans.length))
        return np.concatenate([start[None], multiplied(start, running_products(turns))]), turns
    # With angular momentum the rates depend on the attitude. Steps that together turn by about a radian are solved together,
    # by repeated sweeps until nothing changes.
    size = np.linalg.norm(spans.spin, axis=(-2, -1)).max(axis=-1) * length(angular) * spans.length
    window = np.floor(np.cumsum(size) / _WINDOW).astype(np.int64)
    attitudes, all_turns = [start[None]], []
    for part in np.unique(window):
        turns, after = _solved_together(spans.take(window == part), attitudes[-1][-1], angular)
        attitudes.append(after)
        all_turns.append(turns)
    return np.concatenate(attitudes), np.concatenate(all_turns)


def _solved_together(spans: _Spans, first: Array, angular: Array) -> tuple[Array, Array]:
    """Return the turns (m, 4) of steps in order, and the attitudes (m, 4) after them."""
    after = np.repeat(first[None], len(spans.begin), axis=0)
    turns, within = after, np.zeros_like(spans.free)
    for _ in range(_SWEEPS):
        turn, now = _swept(spans, np.concatenate([first[None], after[:-1]]), within, angular)
        turns = exponential(turn)
        moved = multiplied(first, running_products(turns))
        change = max(np.abs(moved - after).max(), np.abs(now - within).max())
        after, within = moved, now
        if change < _CONVERGED:
            break
    return turns, after


def step_turn(rates: Array, length: Array) -> Array:
    """Return the rotation vectors (..., 3) [rad] of steps.

    Args:
        rates: (..., 3, 3) at `NODES`, per unit of the length, in the turning axes.
        length: (...,) of each step.
    """
    turns = rates * length[..., None, None]
    first, middle, last = turns[..., 0, :], turns[..., 1, :], turns[..., 2, :]
    # The equation solved in the paper is that of R^T, whose matrix is -[omega]x.
    a1, a2, a3 = -middle, -sqrt(15) / 3 * (last - first), -10 / 3 * (last - 2 * middle + first)
    c1 = cross(a1, a2)
    c2 = -cross(a1, 2 * a3 + c1) / 60
    return -(a1 + a3 / 12 + cross(-20 * a1 - a3 + c1, a2 + c2) / 240)


def _rates_of_parts() -> Array:
    """Return the matrices (part, 3, 3) that map a step's rates at `NODES` to those of its parts from 0 to each node.

    The rates are taken to be parabolas through those at the nodes.
    """
    return product(powers(NODES[:, None] * NODES, 2), inverse3(powers(NODES, 2)))  # (part, node, power) by (power, node)


_PARTS = _rates_of_parts()


def _chunks(u: Array) -> list[Array]:
    return [u[i : i + _AT_ONCE] for i in range(0, max(len(u), 1), _AT_ONCE)]
