"""The masses of a robot, one rigid body a joint: links that are fixed to each other move as one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import RobotError
from spacearm.robot import Robot
from spacearm.robot.left_out import require_all_masses
from spacearm.robot.model import require_robot

Array = NDArray[np.float64]

_GREATEST = 1e15  # [kg, kg m, kg m^2]; of more float64 keeps no digits that count
_SLACK = 0.01  # by which published moments of inertia, rounded, may miss the triangle inequality
_ROUNDING = 1e-9
_ADVICE = "run `spacearm doctor` on its model"


@dataclass(frozen=True, slots=True)
class Masses:
    """The bodies of a robot lumped, the base first.

    Attributes:
        pseudo: (1 + j, 4, 4) sums of m [x; 1][x; 1]^T over each body in its moving frame: the second moments, the first, and
            the mass. Turning and moving a body is T P T^T, and bodies are joined by adding.
        outward: (1 + j, 1 + j) 1 where the column's body is carried by the row's joint, itself included.
        shares: (j, n) how each joint moves for a unit rate of each degree of freedom.
        turning: (j,) whether a joint turns rather than slides.
    """

    pseudo: Array
    outward: Array
    shares: Array
    turning: NDArray[np.bool_]


@lru_cache(maxsize=32)
def lumped_masses(robot: Robot) -> Masses:
    """Return the masses of a robot's bodies, one for the base and one for each joint.

    Raises:
        RobotError: masses of which nothing that floats can be made.
    """
    count, pseudo = 1 + len(robot.joints), _pseudo_inertias(robot)
    outward = np.eye(count)
    for child in range(count - 1, 0, -1):  # parents come before children
        outward[1 + robot.joints[child - 1].parent] += outward[child]
    shares = np.zeros((count - 1, robot.dof))
    for i, joint in enumerate(robot.joints):
        shares[i, joint.dof] = joint.multiplier
    _require_possible(robot, pseudo)
    require_all_masses(robot)
    masses = Masses(pseudo, outward, shares, np.array([joint.kind == "revolute" for joint in robot.joints]))
    for array in (masses.pseudo, masses.outward, masses.shares, masses.turning):
        array.setflags(write=False)
    return masses


def require_masses(robot: Robot) -> None:
    """Check that a robot can float: its base has a mass and an inertia, and no body has an impossible one.

    Raises:
        RobotError: it cannot.
    """
    require_robot(robot)
    lumped_masses(robot)


def require_possible_masses(robot: Robot) -> None:
    """Refuse masses with which no base can float; links of unknown mass are passed over, which `require_masses` refuses.

    Raises:
        RobotError: no masses, a base without one, or some that no body has.
    """
    require_robot(robot)
    _require_possible(robot, _pseudo_inertias(robot))


def _pseudo_inertias(robot: Robot) -> Array:
    """Return those of the base and of what each joint carries, (1 + j, 4, 4).

    Raises:
        RobotError: numbers beyond measure.
    """
    pseudo = np.zeros((1 + len(robot.joints), 4, 4))
    for body in robot.bodies:
        with np.errstate(over="ignore", invalid="ignore"):
            own = _pseudo_inertia(body.mass, body.com, body.inertia)
        if not (np.abs(own) < _GREATEST).all():
            raise RobotError(
                f"robot '{robot.name}' cannot float: body '{body.name}' has a mass of {body.mass:.4g} kg at "
                f"{body.com.tolist()} m and moments of inertia up to {np.abs(body.inertia).max():.4g} kg m^2, which is beyond "
                f"measure, expected all below {_GREATEST:g}; {_ADVICE}"
            )
        pseudo[1 + body.joint] += own
    return pseudo


def _require_possible(robot: Robot, lumped: Array) -> None:
    what = f"robot '{robot.name}' cannot float:"
    if not robot.bodies:
        raise RobotError(f"{what} its model states no masses, expected some for the base and the links; {_ADVICE}")
    for i, pseudo in enumerate(lumped):
        mass, where = pseudo[3, 3], "the base" if i == 0 else f"what joint '{robot.joints[i - 1].name}' moves"
        if mass == 0:
            if i == 0:
                raise RobotError(f"{what} its base has no mass, expected one above 0 kg; {_ADVICE}")
            if not pseudo.any():
                continue
            raise RobotError(f"{what} {where} has an inertia but no mass, expected both; {_ADVICE}")
        second = pseudo[:3, :3] - np.outer(pseudo[:3, 3], pseudo[:3, 3]) / mass  # about the centre of mass
        principal = np.sort(np.linalg.eigvalsh(np.trace(second) * np.eye(3) - second))
        size = max(float(np.abs(principal).max()), float(np.trace(pseudo[:3, :3])))
        least, middle, most = np.where(np.abs(principal) > _ROUNDING * size, principal, 0.0)
        shown = f"principal moments of inertia {least:.4g}, {middle:.4g} and {most:.4g} kg m^2"
        if least < 0 or (i == 0 and least == 0):
            raise RobotError(f"{what} {where} has {shown}, expected them above 0; {_ADVICE}")
        if most > (least + middle) * (1 + _SLACK):
            raise RobotError(f"{what} {where} has {shown}, expected none above the sum of the others; {_ADVICE}")


def _pseudo_inertia(mass: float, com: Array, inertia: Array) -> Array:
    out = np.empty((4, 4))
    out[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia + mass * np.outer(com, com)
    out[:3, 3] = out[3, :3] = mass * com
    out[3, 3] = mass
    return out
