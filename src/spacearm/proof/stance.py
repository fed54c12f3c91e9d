"""The base setup that a proof starts from: what holds the base, where it begins, and with which momentum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_readonly, as_transform, shown
from spacearm.errors import ProblemError
from spacearm.momentum.base_models import BASE_MODELS, BaseModel
from spacearm.robot import Robot

Array = NDArray[np.float64]

_SAME = 1e-9  # of a place or a momentum relative to its size, and of a rotation [rad]: a file's last digit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseSetup:
    """A base in the inertial frame, in which the obstacles rest.

    Attributes:
        model: what holds it.
        start: T_w_b (4, 4) at the beginning [m].
        linear: (3,) total momentum [N s], inertial frame.
        angular: (3,) total angular momentum about the system's centre of mass [N m s], inertial frame.
    """

    model: BaseModel
    start: Array
    linear: Array
    angular: Array

    @property
    def base(self) -> str:
        """The name of what holds it."""
        return self.model.name

    @property
    def drifting(self) -> bool:
        """Whether it moves by itself, so that its motion depends on time."""
        return self.model.keeps_momentum and bool(self.linear.any() or self.angular.any())

    @property
    def at_origin(self) -> bool:
        """Whether it starts where the base frame is."""
        return bool((self.start == np.eye(4)).all())


def base_setup_of(holder: Any, robot: Robot, *, who: str) -> BaseSetup:
    """Read how a problem or a trajectory takes the base to be held; what it does not say is as the robot has it, at the origin.

    Args:
        holder: may have `base`, `base_start` and `momentum`.
        robot: whose base.
        who: "problem" or "trajectory", for the message.

    Raises:
        ProblemError: a base that no model has, a start that is no pose, or a momentum that is none.
    """
    base = getattr(holder, "base", None)
    base = robot.base if base is None else base
    if not isinstance(base, str) or base not in BASE_MODELS:
        raise ProblemError(f"the {who}'s base is {shown(base)}, expected {' or '.join(map(repr, BASE_MODELS))}")
    start, momentum = getattr(holder, "base_start", None), getattr(holder, "momentum", None)
    pose = np.eye(4) if start is None else as_transform(f"the {who}'s base_start", start, ProblemError)
    linear, angular = (
        np.zeros(3) if momentum is None else as_readonly(f"momentum.{part}", getattr(momentum, part), (3,), ProblemError)
        for part in ("linear", "angular")
    )
    return BaseSetup(model=BASE_MODELS[base], start=pose, linear=linear, angular=angular)


def require_same(problem: BaseSetup, trajectory: BaseSetup) -> None:
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
    if not problem.model.keeps_momentum:
        return
    for what, unit in (("linear", "N s"), ("angular", "N m s")):
        mine, other = getattr(problem, what), getattr(trajectory, what)
        if np.abs(other - mine).max() > _SAME * np.abs(mine).max():
            raise ProblemError(
                f"the trajectory has the {what} momentum {np.array2string(other, precision=6)} {unit}, expected the problem's "
                f"{np.array2string(mine, precision=6)} {unit}; make it with Trajectory(..., momentum=problem.momentum)"
            )
