"""What holds for two links in every configuration within the limits: that they never meet, or that they always overlap.

The signed distance of two links changes at most as fast as their points move against each other: per radian of a joint between
them by the reach of the points beyond it from its axis, per metre of a sliding joint by a metre. So where, in the middle of a
box of joint values, the distance is more than the half edges of the box allow, the whole box is clear; where the depth is more,
they overlap in the whole box. Boxes that are neither are halved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.link_distances import LinkBody, distances, placed
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

VAST = 1e6
"""Limits beyond this are none [rad or m]."""

_JOINTS = 4  # boxes of more dimensions are too many
_BOXES = 10_000  # boxes that are looked at before giving up
_DEEP_BOXES = 2_000  # the same where depths are computed, which take 100 times as long
_AT_ONCE = 64  # boxes to begin with, since as many cost no more than one
_ROUNDING = 1e-9  # [m]
_DEPTH_ROUNDING = 1e-6  # [m] more than a depth may be too large by
_PROVEN_DEPTHS = (0.9, 0.5, 0.0)  # shares of the depth that was seen: the greatest that can be proven


def finite_range(robot: Robot) -> tuple[Array, Array]:
    """Return limits (n,) and (n,) between which configurations are drawn: one turn where there are none."""
    lower, upper = np.where(robot.lower < -VAST, -np.inf, robot.lower), np.where(robot.upper > VAST, np.inf, robot.upper)
    free = np.isinf(lower) & np.isinf(upper)
    lower[free], upper[free] = -math.pi, math.pi
    lower, upper = np.where(np.isinf(lower), upper - 2 * math.pi, lower), np.where(np.isinf(upper), lower + 2 * math.pi, upper)
    return lower, upper


def joints_between(robot: Robot, first: LinkBody, second: LinkBody) -> list[int]:
    """List the joints that move two links against each other; those whose limits are one value do not move."""
    ways: list[set[int]] = []
    for body in (first, second):
        for joint in {int(j) for j in body.joint}:
            way = set()
            while joint >= 0:
                way.add(joint)
                joint = robot.joints[joint].parent
            ways.append(way)
    between = set.union(*ways) - set.intersection(*ways)
    return [j for j in sorted(between) if _moves(robot, j)]


def never_meet(robot: Robot, first: LinkBody, second: LinkBody, between: Sequence[int], *, room: float = 0.0) -> bool | None:
    """Try to prove that two links never meet within the limits.

    Args:
        robot: the robot.
        first, second: the shapes of the links.
        between: `joints_between` of them.
        room: they count as meeting where their distance is less than this [m].

    Returns:
        True if they cannot meet, False if a configuration was found in which they do, None if neither.
    """
    boxes = _boxes(robot, first, second, between)
    if boxes is None:
        return None

    def look(frames: Array, moved: float) -> NDArray[np.bool_] | None:
        enough = (moved + room) * (1 + 1e-9)
        gap = distances(placed(first, frames), placed(second, frames), enough=enough)
        return None if (gap < room).any() else gap > moved + room

    return boxes.settled(look, most=_BOXES)


def always_overlap(
    robot: Robot, first: LinkBody, second: LinkBody, between: Sequence[int], *, seen: float
) -> float | Literal[False] | None:
    """Try to prove that two links overlap in every configuration within the limits.

    Args:
        robot, first, second, between: as in `never_meet`.
        seen: the least depth in some configurations [m].

    Returns:
        A depth that they have at least in every configuration [m]; False if a configuration was found in which they do not
        overlap, None if neither.
    """
    ended: bool | None = None
    for share in _PROVEN_DEPTHS if seen > _DEPTH_ROUNDING else ():
        boxes, depths = _boxes(robot, first, second, between), [seen]

        def look(
            frames: Array, moved: float, least: float = share * seen, depths: list[float] = depths
        ) -> NDArray[np.bool_] | None:
            gap = distances(placed(first, frames), placed(second, frames))
            depth = -gap - moved - _DEPTH_ROUNDING  # in the whole box
            depths.extend(depth[depth > least].tolist())
            return None if (gap >= -least).any() else depth > least

        if boxes is None:
            return None
        ended = boxes.settled(look, most=_DEEP_BOXES)
        if ended:
            return min(depths)
    return False if ended is False else None


@dataclass(slots=True)
class _Boxes:
    """The values of the joints between two links, in boxes.

    Attributes:
        robot: whose joints they are.
        dofs: indices of k degrees of freedom.
        centers: (b, k) middles of the boxes [rad or m].
        half: (k,) half edges of each box [rad or m].
        speed: (k,) of the distance of the links, at most, per unit of each [m/rad or m/m].
    """

    robot: Robot
    dofs: list[int]
    centers: Array
    half: Array
    speed: Array

    def settled(self, look: Callable[[Array, float], NDArray[np.bool_] | None], *, most: int) -> bool | None:
        """Halve boxes until all are settled.

        Args:
            look: called with the frames in the middles of boxes, and with how much the distance may change from there within
                a box [m]; it tells which boxes are settled, or returns None to end the search.
            most: boxes that are looked at.

        Returns:
            True if all are settled, False if `look` ended the search, None if there are too many.
        """
        rest = np.clip(np.zeros(self.robot.dof), self.robot.lower, self.robot.upper)
        seen = 0
        while len(self.centers) < _AT_ONCE:
            self._halve()
        while len(self.centers):
            seen += len(self.centers)
            if seen > most:
                return None
            q = np.tile(rest, (len(self.centers), 1))
            q[:, self.dofs] = self.centers
            done = look(base_and_joint_frames(self.robot, q), float(self.speed @ self.half) + _ROUNDING)
            if done is None:
                return False
            self.centers = self.centers[~done]
            self._halve()
        return True

    def _halve(self) -> None:
        """Cut every box in two where it moves the links most."""
        widest = int(np.argmax(self.speed * self.half))
        self.half[widest] /= 2
        step = np.zeros(len(self.half))
        step[widest] = self.half[widest]
        self.centers = np.concatenate([self.centers - step, self.centers + step])


def _boxes(robot: Robot, first: LinkBody, second: LinkBody, between: Sequence[int]) -> _Boxes | None:
    """Return one box of all values of the joints between two links; None if there are too many joints, or limits are none."""
    dofs = sorted({robot.joints[j].dof for j in between})
    if not 0 < len(dofs) <= _JOINTS:
        return None
    lower, upper = _range_of(robot, dofs, between)
    if max(np.abs(lower).max(), np.abs(upper).max()) > VAST:
        return None
    speed = np.zeros(len(dofs))
    for j in between:
        reach = 1.0 if robot.joints[j].kind == "prismatic" else max(_reach(robot, j, first), _reach(robot, j, second))
        speed[dofs.index(robot.joints[j].dof)] += abs(robot.joints[j].multiplier) * reach
    return _Boxes(robot, dofs, ((lower + upper) / 2)[None], (upper - lower) / 2, speed)


def _moves(robot: Robot, joint: int) -> bool:
    dof = robot.joints[joint].dof
    return bool(robot.lower[dof] < robot.upper[dof]) and robot.joints[joint].multiplier != 0.0


def _range_of(robot: Robot, dofs: list[int], between: Sequence[int]) -> tuple[Array, Array]:
    """Return the limits of the dofs; a joint that turns a whole turn or more needs but one."""
    lower, upper = robot.lower[dofs].copy(), robot.upper[dofs].copy()
    for i, dof in enumerate(dofs):
        moved = [robot.joints[j] for j in between if robot.joints[j].dof == dof]
        if float(upper[i]) - float(lower[i]) > 2 * math.pi and all(
            j.kind == "revolute" and abs(j.multiplier) == 1.0 for j in moved
        ):
            lower[i], upper[i] = -math.pi, math.pi
    return lower, upper


def _reach(robot: Robot, joint: int, body: LinkBody) -> float:
    """Bound how far the cores of a link beyond a joint, on the side away from the base, are from its axis [m].

    Rounding does not count: a ball that turns about its middle moves nothing.
    """
    furthest = 0.0
    for j, points in zip(body.joint, body.points, strict=True):
        at = int(j)
        across = float(np.hypot(points[:, 0], points[:, 1]).max())
        ball = float(np.linalg.norm(points, axis=1).max())  # about the origin of the joint's frame
        while at >= 0 and at != joint:
            here = robot.joints[at]
            slide = 0.0
            if here.kind == "prismatic":
                ends = (robot.lower[here.dof], robot.upper[here.dof])
                slide = max(abs(here.multiplier * end + here.offset) for end in ends)
            offset = here.T_parent_joint[:3, 3]
            across = math.hypot(offset[0], offset[1]) + ball + slide
            ball = float(np.linalg.norm(offset)) + ball + slide
            at = here.parent
        if at == joint:
            furthest = max(furthest, across)
    return furthest
