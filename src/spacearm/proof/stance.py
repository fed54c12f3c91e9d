"""How a proof takes the base to be held: bolted down somewhere, or drifting from there with a constant momentum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_readonly, as_transform, shown
from spacearm.errors import ProblemError
from spacearm.robot import Robot

Array = NDArray[np.float64]

_SAME = 1e-9  # of a place or a momentum relative to its size, and of a rotation [rad]: a file's last digit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stance:
    """A base in the inertial frame, in which the obstacles rest.

    Attributes:
        base: "fixed" or "floating".
        start: T_w_b (4, 4) at the beginning [m].
        linear: (3,) total momentum [N s], inertial frame.
        angular: (3,) total angular momentum about the system's centre of mass [N m s], inertial frame.
    """

    base: Literal["fixed", "floating"]
    start: Array
    linear: Array
    angular: Array

    @property
    def floating(self) -> bool:
        """Whether nothing holds the base."""
        return self.base == "floating"

    @property
    def tumbling(self) -> bool:
        """Whether it moves by itself, so that its motion depends on time."""
        return self.floating and bool(self.linear.any() or self.angular.any())

    @property
    def at_origin(self) -> bool:
        """Whether it starts where the base frame is."""
        return bool((self.start == np.eye(4)).all())


def stance_of(holder: Any, robot: Robot, *, who: str) -> Stance:
    """Read how a problem or a trajectory takes the base to be held; what it does not say is as the robot has it, at the origin.

    Args:
        holder: may have `base`, `base_start` and `momentum`.
        robot: whose base.
        who: "problem" or "trajectory", for the message.

    Raises:
        ProblemError: a base that is neither fixed nor floating, a start that is no pose, or a momentum that is none.
    """
    base = getattr(holder, "base", None)
    base = robot.base if base is None else base
    if base not in ("fixed", "floating"):
        raise ProblemError(f"the {who}'s base is {shown(base)}, expected 'fixed' or 'floating'")
    start, momentum = getattr(holder, "base_start", None), getattr(holder, "momentum", None)
    pose = np.eye(4) if start is None else as_transform(f"the {who}'s base_start", start, ProblemError)
    linear, angular = (
        np.zeros(3) if momentum is None else as_readonly(f"momentum.{part}", getattr(momentum, part), (3,), ProblemError)
        for part in ("linear", "angular")
    )
    return Stance(base=base, start=pose, linear=linear, angular=angular)


def require_same(problem: Stance, trajectory: Stance) -> None:
    """Check that a trajectory was made for the base that a problem has.

    Raises:
        ProblemError: it was made for another one.
    """
    if trajectory.base != problem.base:
        raise ProblemError(
            f"the trajectory is of a {trajectory.base} base, expected the problem's, which is {problem.base}; "
            f"make it with Trajectory(..., base='{problem.base}')"
        )
    mine, other = problem.start[:3], trajectory.start[:3]
    away, turned = (float(np.abs(difference).max()) for difference in (other[:, 3] - mine[:, 3], other[:, :3] - mine[:, :3]))
    if away > _SAME * (1 + np.abs(mine[:, 3]).max()) or turned > _SAME:
        raise ProblemError(
            f"the trajectory's base starts elsewhere than the problem's (its base_start differs by {away:.3g} m and "
            f"{turned:.3g} rad), expected the same pose; make it with Trajectory(..., base_start=problem.base_start)"
        )
    if not problem.floating:
        return
    for what, unit in (("linear", "N s"), ("angular", "N m s")):
        mine, other = getattr(problem, what), getattr(trajectory, what)
        if np.abs(other - mine).max() > _SAME * np.abs(mine).max():
            raise ProblemError(
                f"the trajectory has the {what} momentum {np.array2string(other, precision=6)} {unit}, expected the problem's "
                f"{np.array2string(mine, precision=6)} {unit}; make it with Trajectory(..., momentum=problem.momentum)"
            )
