"""A tracking error: how far each joint may be from the planned trajectory, and how far that lets the bodies get.

A controller does not follow a trajectory exactly. With a tracking error tau_k for every degree of freedom, the proof is about
all trajectories that stay within tau_k of the planned one at every instant: about a *tube* around it. A mimic joint has its
share, tau_k times |multiplier|. docs/certificate.md, "Tracking error", says what is claimed, and what is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import Raise, as_number, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.dynamics.base_models import BaseModel
from spacearm.robot import Robot

Array = NDArray[np.float64]

ALL = "all"
"""In place of a joint's name: every joint that has no value of its own."""

MOST = 1e3
"""[rad or m] A larger tracking error is an error of its own."""

PlainTracking: TypeAlias = float | tuple[tuple[str, float], ...]
"""A tracking error as settings hold it, which can be hashed: a number, or the pairs of a mapping."""

Tracking: TypeAlias = PlainTracking | Mapping[str, float]
"""A tracking error as callers give it: a number for all joints, or a mapping from names of joints, and "all", to numbers."""


# ---- Reading ---------------------------------------------------------------------------------------------------------


def plain_tracking(given: object, error: Raise = ProblemError, *, name: str = "tracking") -> PlainTracking:
    """Check the numbers of a tracking error, without a robot.

    Args:
        given: a number, a mapping from names to numbers, or the pairs of one; None: 0.
        error: class of the error to raise.
        name: what the user calls it.

    Raises:
        error: anything else; a number below 0 or above 1000, or one that is not finite; a name twice.
    """
    if given is None:
        return 0.0
    pairs = _pairs(given)
    if pairs is None:
        if isinstance(given, (str, bytes, list, tuple)) or (isinstance(given, np.ndarray) and given.ndim):
            wanted = 'a number [rad, or m for a prismatic joint], or a mapping such as {"all": 0.002, "shoulder": 0.001}'
            raise error(f"{name} is {shown(given)}, expected {wanted}")
        return as_number(name, given, error, at_least=0, at_most=MOST, unit="rad or m")
    out: dict[str, float] = {}
    for joint, value in pairs:
        if not isinstance(joint, str):
            raise error(f"{name} names {shown(joint)}, expected the name of a joint, or 'all'")
        if joint in out:
            raise error(f"{name} names {shown(joint)} twice, expected each joint once")
        out[joint] = as_number(f"{name} of {shown(joint)}", value, error, at_least=0, at_most=MOST, unit="rad or m")
    return tuple(out.items())


def _pairs(given: object) -> list[tuple[object, object]] | None:
    """Return names and numbers of a mapping, or of the pairs of one; None for anything else."""
    if isinstance(given, Mapping):
        return list(cast("Mapping[object, object]", given).items())
    if isinstance(given, (list, tuple)):
        rows = [tuple(cast("list[object]", row)) for row in cast("list[object]", given) if isinstance(row, (list, tuple))]
        pairs: list[tuple[object, object]] = [(row[0], row[1]) for row in rows if len(row) == 2 and isinstance(row[0], str)]
        return pairs if len(pairs) == len(cast("list[object]", given)) else None
    return None


def tracking_of(robot: Robot, given: Tracking | None, error: Raise = ProblemError, *, name: str = "tracking") -> Array:
    """Return the tracking error of each degree of freedom.

    A name counts before "all", and what is not named is exact. Names are those of degrees of freedom: a mimic joint follows
    another one, and takes that one's error times its multiplier.

    Args:
        robot: with n degrees of freedom.
        given: a number for all, or a mapping from names of joints, and "all", to numbers; None: no error.
        error: class of the error to raise.
        name: what the user calls it.

    Returns:
        (n,) [rad, or m for a prismatic joint].

    Raises:
        error: no such joint, with the nearest name; a mimic joint; what `plain_tracking` refuses.
    """
    plain = plain_tracking(given, error, name=name)
    if not isinstance(plain, tuple):
        return np.full(robot.dof, plain)
    values: dict[str, float] = dict(plain)
    for joint in values:
        if joint != ALL and joint not in robot.dof_names:
            raise error(_unknown(robot, joint, name))
    rest = values.get(ALL, 0.0)
    return np.array([values.get(joint, rest) for joint in robot.dof_names], dtype=np.float64)


def _unknown(robot: Robot, joint: str, name: str) -> str:
    """Say why a name is not that of a degree of freedom."""
    for one in robot.joints:
        if one.name == joint:
            leader = robot.dof_names[one.dof]
            return (
                f"{name} names the joint '{joint}', which follows '{leader}' (mimic); name '{leader}': its error counts for "
                f"'{joint}' too, {abs(one.multiplier):g} times"
            )
    return f"{name} names {shown(joint)}, which is no joint of robot '{robot.name}'; {nearest(joint, (ALL, *robot.dof_names))}"


def require_bounded(model: BaseModel, tracking: Array, error: Raise = ProblemError) -> None:
    """Refuse a tracking error of an arm that moves its base.

    Raises:
        error: the base follows the arm, and an error is above 0.
    """
    if model.follows_arm and tracking.any():
        raise error(
            f"tracking is up to {tracking.max():g} and the base is {model.name}, expected no tracking error with it: how far "
            "such an error turns the base is not bounded yet; leave tracking out, or give base='fixed'"
        )


# ---- In words and as plain values ------------------------------------------------------------------------------------


def tracking_as_dict(robot: Robot, tracking: Array) -> dict[str, float]:
    """Return a tracking error (n,) as a mapping, as `tracking_of` takes it: "all" alone where all joints have the same."""
    if robot.dof and (tracking == tracking[0]).all():
        return {ALL: float(tracking[0])}
    return dict(zip(robot.dof_names, tracking.tolist(), strict=True))


def tracking_in_words(robot: Robot, tracking: Array) -> str:
    """Return a tracking error (n,) in words, as in "0.002 rad", or "0.002 rad ('shoulder' 0.001 rad)"."""
    values = [(joint, float(tracking[i]), _unit(robot, i)) for i, joint in enumerate(robot.dof_names)]
    kinds = {unit: [value for _, value, other in values if other == unit] for unit in ("rad", "m")}
    usual = {
        unit: max(set(given), key=lambda value, given=given: (given.count(value), value))
        for unit, given in kinds.items()
        if given
    }
    said = " and ".join(f"{value:.6g} {unit}" for unit, value in usual.items())
    others = [f"'{joint}' {value:.6g} {unit}" for joint, value, unit in values if value != usual[unit]]
    return f"{said} ({', '.join(others)})" if others else said


def _unit(robot: Robot, dof: int) -> str:
    return "m" if robot.is_prismatic(dof) else "rad"


# ---- How far the bodies get ------------------------------------------------------------------------------------------


class TubeReach:
    """How far bodies get, in the frames of others, from where the planned trajectory has them.

    It is the displacement bound of docs/certificate.md, section 3, at an instant: no point of a body gets further. So a pair of
    bodies that has c on the planned trajectory has at least c less this anywhere in the tube.

    Args:
        robot: with j joints.
        tracking: (n,) the tracking error [rad or m].
    """

    def __init__(self, robot: Robot, tracking: Array) -> None:
        joints = robot.joints
        self._step = np.array([tracking[joint.dof] * abs(joint.multiplier) for joint in joints], dtype=np.float64)  # (j,)
        self._revolute = np.array([joint.kind == "revolute" for joint in joints], dtype=bool)

    def of_joints(self, T_joints: Array, center: Array, reach: Array) -> Array:
        """Return how far each joint alone moves s bodies at r instants, (r, s, j) [m].

        Args:
            T_joints: (r, j, 4, 4) the moving frames of the joints [m].
            center: (r, s, 3) the middles of the bodies' cores, in the same frame as those [m].
            reach: (s,) how far a core gets from its middle [m].
        """
        away = center[:, :, None] - T_joints[:, None, :, :3, 3]  # (r, s, j, 3)
        across = away - (away * T_joints[:, None, :, :3, 2]).sum(axis=-1, keepdims=True) * T_joints[:, None, :, :3, 2]
        rho = np.sqrt((across**2).sum(axis=-1)) + reach[:, None]
        return np.where(self._revolute, rho, 1.0) * self._step

    def of(self, T_joints: Array, center: Array, reach: Array, moves: NDArray[np.bool_]) -> Array:
        """Return how far s bodies get, (r, s) [m]; `moves` (s, j) says which joints move a body in the frame of the other."""
        return np.einsum("rsj,sj->rs", self.of_joints(T_joints, center, reach), moves.astype(np.float64))
