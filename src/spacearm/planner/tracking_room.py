"""Room for a tracking error: how much clearance the tube around a motion takes, and what a search has to ask for more.

A proof with a tracking error holds a pair of bodies to its clearance anywhere in the tube. So a search has to look for a motion
with as much more as the tube takes: `proof.tracking.TubeReach` says how much that is in a configuration. On a motion that is
not known yet it is guessed from the straight ones. The guess is of any direction; toward what is near, a tube mostly takes
less. So a search begins with a share of it, and asks for all of it where a proof fails.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import keep
from spacearm.core.errors import SettingsError
from spacearm.core.identity_cache import cached_by_identity
from spacearm.planner.clearance import KernelClearance
from spacearm.planner.kernel_model import self_shape_pairs
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem
from spacearm.proof.convex_bodies import robot_bodies
from spacearm.proof.mechanism import chain
from spacearm.proof.tracking import TubeReach, require_bounded, tracking_of
from spacearm.robot import Robot
from spacearm.robot.kinematics import tree_model

Array = NDArray[np.float64]

_INSTANTS = 5  # of each straight motion, at which it is looked how much the tube takes
_SHARE = 0.6  # of what the tube takes there: on 40 motions of a Panda it took 0.35 to 0.7 toward the nearest obstacle
_ALL = 1.05  # likewise, where a proof has failed: other motions bend
_MOST_PAIRS = 20_000  # of shapes and obstacles; of more, all pairs are asked for the most that the tube takes of any


class Taken(NamedTuple):
    """How much of their clearance a tube takes from pairs of bodies.

    Attributes:
        to_obstacles: (c,) from a shape and any obstacle [m].
        between_links: (p,) from the pairs of shapes that must keep clear [m].
    """

    to_obstacles: Array
    between_links: Array

    def added_to(self, required: KernelClearance) -> KernelClearance:
        """Return what is required of the pairs, and this in addition."""
        wider = required.to_obstacles + self.to_obstacles[:, None]
        return KernelClearance(wider, required.between_links + self.between_links, alike=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackingRoom:
    """The tube around motions of one robot.

    Attributes:
        robot: with n degrees of freedom, c shapes, and p pairs of them that must keep clear.
        tracking: (n,) the tracking error [rad or m]; not all 0.
    """

    robot: Robot
    tracking: Array
    _reach: TubeReach = field(init=False)

    def __post_init__(self) -> None:
        keep(self, _reach=TubeReach(self.robot, self.tracking))

    def taken(self, q: Array) -> Taken:
        """Return how much the tube may take in configurations (b, n), in any direction: (b, c) and (b, p) [m]."""
        shapes = _shapes_of(self.robot)
        T = tree_model(self.robot).joint_frames(np.ascontiguousarray(q))  # (b, j, 4, 4)
        base = np.broadcast_to(np.eye(4), (len(T), 1, 4, 4))
        at = np.concatenate([T, base], axis=1)[:, shapes.joint]
        center = np.einsum("bscd,sd->bsc", at[..., :3, :3], shapes.center) + at[..., :3, 3]
        by_joint = self._reach.of_joints(T, center, shapes.reach)  # (b, c, j)
        return Taken(
            np.einsum("bcj,cj->bc", by_joint, shapes.moved),
            np.einsum("bpj,pj->bp", by_joint[:, shapes.first], shapes.moved_of_pair),
        )

    def likely_taken(self, q: Array) -> Taken:
        """Return how much it is likely to take toward what is near, in configurations (b, n): (b, c) and (b, p) [m]."""
        return Taken(*(_SHARE * part for part in self.taken(q)))

    def most_taken(self, q: Array) -> Taken:
        """Return the most that it takes in any of configurations (b, n): (c,) and (p,) [m]."""
        found = self.taken(q)
        return Taken(found.to_obstacles.max(axis=0, initial=0.0), found.between_links.max(axis=0, initial=0.0))

    def guessed(self, ends: Array, obstacles: int, *, wide: bool = False) -> Taken:
        """Return the most that it is likely to take between a start and goals.

        Args:
            ends: (1 + g, n) the start, then the goals [rad or m].
            obstacles: how many there are: of very many pairs, all are asked for the most that it takes from any.
            wide: whether a proof has failed with less.
        """
        share = np.linspace(0.0, 1.0, _INSTANTS)[:, None, None]
        rows = ends[0] + share * (ends - ends[0])
        most = self.most_taken(rows.reshape(-1, ends.shape[1]))
        return self._wide(Taken(*((_ALL if wide else _SHARE) * part for part in most)), obstacles)

    def _wide(self, taken: Taken, obstacles: int) -> Taken:
        """Return the most of all shapes of a link, and of two links; or of any, for very many pairs."""
        if len(taken.to_obstacles) * obstacles <= _MOST_PAIRS:
            shapes = _shapes_of(self.robot)
            return Taken(_most_of(taken.to_obstacles, shapes.link), _most_of(taken.between_links, shapes.links))
        most = max(float(part.max(initial=0.0)) for part in taken)
        return Taken(*(np.full_like(part, most) for part in taken))


class _Shapes(NamedTuple):
    """A robot's shapes and the pairs that must keep clear, as `TubeReach` takes them; of a pair the first moves."""

    joint: NDArray[np.intp]
    center: Array
    reach: Array
    moved: Array
    first: NDArray[np.intp]
    moved_of_pair: Array
    link: NDArray[np.intp]
    links: NDArray[np.intp]


@cached_by_identity
def _shapes_of(robot: Robot) -> _Shapes:
    bodies = robot_bodies(robot)
    row = np.zeros(len(robot.shapes), dtype=np.intp)
    own = np.flatnonzero(bodies.shape >= 0)
    row[bodies.shape[own]] = own
    joint = np.array([part.joint for part in robot.shapes], dtype=np.intp)
    carried = np.zeros((len(robot.joints) + 1, len(robot.joints)), dtype=bool)  # the last row is the base's
    for k in range(len(robot.joints)):
        carried[k, chain(robot, k)] = True
    pairs = self_shape_pairs(robot).astype(np.intp)
    swapped = joint[pairs[:, 0]] < joint[pairs[:, 1]]
    first, other = np.where(swapped, pairs[:, 1], pairs[:, 0]), np.where(swapped, pairs[:, 0], pairs[:, 1])
    moved = carried[joint]
    between = (moved[first] ^ moved[other]).astype(np.float64)
    number = {name: i for i, name in enumerate(dict.fromkeys(part.name for part in robot.shapes))}
    link = np.array([number[part.name] for part in robot.shapes], dtype=np.intp)
    links = link[pairs[:, 0]] * len(number) + link[pairs[:, 1]]
    return _Shapes(joint, bodies.center[row], bodies.reach[row], moved.astype(np.float64), first, between, link, links)


def _most_of(values: Array, group: NDArray[np.intp]) -> Array:
    """Return the greatest value of each value's group, all (s,)."""
    most = np.zeros(int(group.max(initial=-1)) + 1)
    np.maximum.at(most, group, values)
    return most[group]


def tracking_room(problem: Problem, settings: PlannerSettings) -> TrackingRoom | None:
    """Return the tube that settings ask for; None if joints are taken to be exactly where the motion says.

    Raises:
        SettingsError: it names what is no joint of the robot, or the arm moves its base.
    """
    if not settings.tracking:
        return None
    tracking = tracking_of(problem.robot, settings.tracking, SettingsError)
    require_bounded(problem.base_model, tracking, SettingsError)
    return TrackingRoom(robot=problem.robot, tracking=tracking) if tracking.any() else None


def within_tube(robot: Robot, lower: Array, upper: Array, tracking: Array | float) -> tuple[Array, Array]:
    """Return bounds (n,) of a search, no nearer to the joints' limits than a tracking error (n,) [rad or m]."""
    return np.maximum(lower, robot.lower + tracking), np.minimum(upper, robot.upper - tracking)
