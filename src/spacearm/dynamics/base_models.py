"""Base models: what holds a robot's base. One interface, one class for each model, and a table of them by name.

All rooms ask the model and never its name. A base model says where the base is along a motion, which goals and limits it takes,
what it needs to know of the robot, what the kernel is given and what is printed. Its bounds for the proof are a class of their
own in the room `proof`, found by the model's name. docs/base_models.md shows how another model is added.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_pose, shown
from spacearm.core.errors import ProblemError, RobotError
from spacearm.core.exact import product
from spacearm.core.native import native
from spacearm.core.rotations import quaternion_of
from spacearm.dynamics.base_motion import BaseMotion, JointPath
from spacearm.dynamics.momentum import Momentum, kernel_masses, require_possible_masses, system_mass
from spacearm.robot import Robot
from spacearm.robot.unchecked_pairs import lacks_masses

Array = NDArray[np.float64]

Base: TypeAlias = Literal["fixed", "floating"]
"""The names of the base models that files and arguments may give."""

LIMITS = ("final", "peak", "rate", "joint_momentum")
"""The limits of a base, by name; see `BaseLimits`."""


class BaseTrack(Protocol):
    """Where a base is along a path of the arm's joints, by the path's parameter u; `BaseMotion` is one."""

    def pose(self, u: ArrayLike, /) -> tuple[Array, Array]:
        """Return the base's position (..., 3) [m] and attitude_wxyz (..., 4) in the inertial frame at u (...,)."""
        ...

    def twist(self, u: ArrayLike, /) -> tuple[Array, Array]:
        """Return the velocity of its origin [m], inertial frame, and its turning [rad], base axes, per unit of u, (..., 3)."""
        ...

    def placed(self, u: ArrayLike, T_b_x: Array, /) -> Array:
        """Return frames (..., 4, 4) of the base, one for each u, in the inertial frame: T_w_x [m]."""
        ...


class RestingBase:
    """A base that stays where it is: the identity track."""

    def __init__(self, start: Array | None = None) -> None:
        """Take where it stands, T_w_b (4, 4) [m]; None: at the origin, unturned."""
        self._start = np.eye(4) if start is None else start

    def pose(self, u: ArrayLike, /) -> tuple[Array, Array]:
        """Return its position (..., 3) [m] and attitude_wxyz (..., 4), the same for all u (...,)."""
        shape = np.shape(u)
        values = (self._start[:3, 3], quaternion_of(self._start[:3, :3]))
        position, attitude = (np.broadcast_to(value, (*shape, len(value))).copy() for value in values)
        return position, attitude

    def twist(self, u: ArrayLike, /) -> tuple[Array, Array]:
        """Return velocity and turning, each (..., 3): 0."""
        shape = (*np.shape(u), 3)
        return np.zeros(shape), np.zeros(shape)

    def placed(self, u: ArrayLike, T_b_x: Array, /) -> Array:
        """Return frames (..., 4, 4) of the base in the inertial frame [m]."""
        return T_b_x if np.array_equal(self._start, np.eye(4)) else product(self._start, T_b_x)


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseDemands:
    """What a search demands of a motion whose base moves; a limit of 0 is none.

    Attributes:
        frame: where a frame of the robot is to be at the end.
        attitude: how the base is to stand at the end.
        most_turned: the greatest turn of the base [rad].
        most_rate: its greatest rate [rad/s].
        most_arm_momentum: the greatest angular momentum of the arm's own motion [N m s].
    """

    frame: native.FrameGoal | None = None
    attitude: native.AttitudeGoal | None = None
    most_turned: float = 0.0
    most_rate: float = 0.0
    most_arm_momentum: float = 0.0


class BaseModel(ABC):
    """What holds a base, and what follows from it.

    Attributes:
        name: as files and arguments give it.
        sentence: the same as a remark in a file.
        follows_arm: whether the arm's motion moves the base. Then a configuration alone does not say where the base is; the
            whole motion has to be known.
        keeps_momentum: whether base and arm keep a total momentum that may be given. With one other than 0 the base also moves
            by itself, and its motion depends on time.
        needs_masses: whether the robot's masses have to be known.
        takes_goal: whether a problem may demand an attitude at the end.
        limits: the names among `LIMITS` that a problem may set.
    """

    name: str
    sentence: str
    follows_arm: bool
    keeps_momentum: bool
    needs_masses: bool
    takes_goal: bool
    limits: tuple[str, ...]

    @abstractmethod
    def require(self, robot: Robot, momentum: Momentum) -> None:
        """Check that the model fits a robot; masses that are not known are passed over.

        Raises:
            RobotError: masses that cannot be.
            ProblemError: a momentum that such a base cannot have.
        """

    @abstractmethod
    def lacking(self, robot: Robot) -> str:
        """Return what is missing to compute the base's motion, in a sentence; "" if nothing is."""

    @abstractmethod
    def track(self, robot: Robot, path: JointPath, *, start: Array, momentum: Momentum, duration: float) -> BaseTrack:
        """Return where the base is along a path.

        Args:
            robot: whose base.
            path: of its joints; over time if the model keeps a momentum and there is some.
            start: T_w_b (4, 4) at the beginning [m].
            momentum: of base and arm.
            duration: of the path [s].

        Raises:
            RobotError: masses that cannot be, or are not known.
            ProblemError: a momentum that turns the base too often.
        """

    @abstractmethod
    def kernel_masses(self, robot: Robot) -> native.Masses | None:
        """Return the masses that the kernel needs to carry the base along; None: none."""

    @abstractmethod
    def kernel_base(
        self, robot: Robot, momentum: Momentum, duration: float | None, demands: BaseDemands
    ) -> native.FixedBase | native.FloatingBase:
        """Return the base as the kernel's search has it.

        Args:
            robot: whose base.
            momentum: of base and arm.
            duration: of the motion [s]; None: as it comes.
            demands: of the motion's end and of the base; a base that stays has none.
        """


class FixedBase(BaseModel):
    """A base that does not move."""

    name, sentence = "fixed", "The base is fixed."
    follows_arm = keeps_momentum = needs_masses = takes_goal = False
    limits = ()

    def require(self, robot: Robot, momentum: Momentum) -> None:
        """Refuse a momentum: a base that stays has none."""
        if not momentum.is_zero:
            raise ProblemError("base is 'fixed' and momentum is not 0, expected a floating base with it; give base='floating'")

    def lacking(self, robot: Robot) -> str:
        """Return "": nothing has to be known."""
        return ""

    def track(self, robot: Robot, path: JointPath, *, start: Array, momentum: Momentum, duration: float) -> BaseTrack:
        """Return the identity track."""
        return RestingBase(start)

    def kernel_masses(self, robot: Robot) -> None:
        """Return None: the kernel needs no masses."""

    def kernel_base(self, robot: Robot, momentum: Momentum, duration: float | None, demands: BaseDemands) -> native.FixedBase:
        """Return the identity track, with the duration, if there is one."""
        return native.FixedBase(duration=duration or 0.0)


class FloatingBase(BaseModel):
    """A base that nothing holds: its motion follows from the conservation of momentum."""

    name, sentence = "floating", "The base is floating: no thruster or wheel acts."
    follows_arm = keeps_momentum = needs_masses = takes_goal = True
    limits = LIMITS

    def require(self, robot: Robot, momentum: Momentum) -> None:
        """Refuse masses that cannot be.

        Raises:
            RobotError: no masses, a base without one, or some that no body has.
        """
        require_possible_masses(robot)  # unknown masses are reported by `lacking`, and refused where the motion is computed

    def lacking(self, robot: Robot) -> str:
        """Return of which links the mass is not known, and what to give."""
        return lacks_masses(robot)

    def track(self, robot: Robot, path: JointPath, *, start: Array, momentum: Momentum, duration: float) -> BaseTrack:
        """Integrate the base's motion."""
        return BaseMotion(robot, path, base_start=start, momentum=momentum, duration=duration)

    def kernel_masses(self, robot: Robot) -> native.Masses:
        """Return the masses of base and links."""
        return kernel_masses(robot)

    def kernel_base(
        self, robot: Robot, momentum: Momentum, duration: float | None, demands: BaseDemands
    ) -> native.FloatingBase:
        """Return the demands, the duration, the angular momentum, and how far linear momentum carries the base."""
        drift = None if momentum.is_zero else momentum.linear * (duration or 0.0) / system_mass(robot)
        return native.FloatingBase(
            frame=demands.frame,
            attitude=demands.attitude,
            most_turned=demands.most_turned,
            most_rate=demands.most_rate,
            most_arm_momentum=demands.most_arm_momentum,
            duration=duration or 0.0,
            angular=None if momentum.is_zero else momentum.angular,
            drift=drift,
        )


BASE_MODELS: dict[str, BaseModel] = {model.name: model for model in (FixedBase(), FloatingBase())}
"""The base models by name."""


def base_model(name: Any, *, what: str = "base") -> BaseModel:
    """Return the base model of that name.

    Args:
        name: as a file or an argument gives it.
        what: it is, for the message.

    Raises:
        ProblemError: there is none of that name.
    """
    if not isinstance(name, str) or name not in BASE_MODELS:
        raise ProblemError(f"{what} is {shown(name)}, expected one of {', '.join(map(repr, BASE_MODELS))}")
    return BASE_MODELS[name]


def require_known(model: BaseModel, robot: Robot) -> None:
    """Refuse a robot of which something is not known that its base's motion depends on.

    Raises:
        RobotError: what is lacking, and what to give.
    """
    lacking = model.lacking(robot)
    if lacking:
        raise RobotError(lacking)


def checked_base(robot: Robot, base: Any, base_start: Any, momentum: Any) -> dict[str, Any]:
    """Return `base`, `base_start` (4, 4) and `momentum`, checked; None stands for the robot's base, the origin, and none.

    Raises:
        ProblemError: values that cannot be, or momentum of a fixed base.
        RobotError: a floating base of a robot without masses.
    """
    base = robot.base if base is None else base
    model = base_model(base)
    momentum = Momentum() if momentum is None else momentum
    if not isinstance(momentum, Momentum):
        raise ProblemError(f"momentum is {shown(momentum)}, expected a Momentum(linear=..., angular=...), or None")
    model.require(robot, momentum)
    return {"base": base, "base_start": as_pose("base_start", base_start, ProblemError), "momentum": momentum}
