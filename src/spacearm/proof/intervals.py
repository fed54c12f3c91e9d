"""The logic of the proof.

At an interval's middle the clearance is measured. From there to any other instant of the interval, a point of a link
moves at most sum_i r_i |dq_i|, where r_i bounds the point's distance from joint i's axis and |dq_i| joint i's way, from
the hull of the motion's Bezier points on that interval. If the clearance exceeds that way the whole interval is free;
otherwise it is halved. Distances are 1-Lipschitz, so nothing between the instants looked at can be missed. Halving goes
on until half of the least clearance measured is proven, so that the proven figure is not a matter of luck.
"""

from __future__ import annotations

import time
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown
from spacearm.errors import ProblemError
from spacearm.motion import Motion, Trajectory, limit_margins
from spacearm.proof.certificate import Certificate, ClosestApproach
from spacearm.proof.witness import Witness
from spacearm.robot import Robot
from spacearm.scene import Scene

Array = NDArray[np.float64]

_BISECTIONS = 16  # halvings of the spline's own pieces before an interval is given up as undecided
_WORTH = 0.5  # the share of the least clearance measured that is to be proven
_GUARD = 1e-9  # [m] for the rounding of kinematics and distances


class HasScene(Protocol):
    """Whatever has a robot and a scene; a Problem does."""

    @property
    def robot(self) -> Robot:
        """What moves."""
        ...

    @property
    def scene(self) -> Scene:
        """What is in the way."""
        ...


def certify(problem: HasScene, trajectory: Trajectory) -> Certificate:
    """Prove that a trajectory keeps clear of the obstacles and within the joint limits for all t, or say where not.

    Args:
        problem: the robot and the scene to prove it for.
        trajectory: of that robot; fixed base.

    Returns:
        The certificate. It never says that a motion holds when it does not; it may be undecided.

    Raises:
        ProblemError: the trajectory is none, or moves another number of joints.
    """
    if not isinstance(trajectory, Trajectory):
        raise ProblemError(f"trajectory is {shown(trajectory)}, expected a Trajectory; make one with Trajectory(robot, motion)")
    begun = time.perf_counter()
    robot, motion = problem.robot, trajectory.motion
    if motion.dof != robot.dof:
        raise ProblemError(f"the trajectory moves {motion.dof} joints, expected the {robot.dof} of robot '{robot.name}'")
    witness = Witness(robot, problem.scene)
    search = _Intervals(robot, motion, witness, bool(robot.capsules) and bool(problem.scene.obstacles))
    clearance_status = search.run()
    limits = limit_margins(robot, motion, trajectory.duration)  # the problem's limits, whoever made the trajectory
    status = clearance_status if limits.holds else "fails"
    return Certificate(
        status=status,
        clearance=search.proven if status == "holds" else None,
        closest=search.closest(trajectory.duration),
        limits=limits,
        resolution=search.resolution,
        evaluations=search.evaluations,
        seconds=time.perf_counter() - begun,
        witness=witness.name,
    )


class _Intervals:
    """Halves intervals of s until each is proven, one level of halvings after the other."""

    def __init__(self, robot: Robot, motion: Motion, witness: Witness, anything: bool) -> None:
        self._robot, self._motion, self._witness = robot, motion, witness
        self._anything = anything
        self._reach = _reaches(robot, motion)
        self.proven = float("inf")
        self.resolution = 1.0
        self.evaluations = 0
        self._closest: tuple[float, int, int, float] | None = None

    def run(self) -> Literal["holds", "fails", "undecided"]:
        if not self._anything:
            return "holds"
        open_intervals = np.arange(self._motion.interior + 1)
        for level in range(_BISECTIONS + 1):
            ends, lows, highs = self._motion.hulls(0, bisections=level, pieces=open_intervals)
            failed = []
            for i, (begin, end), low, high in zip(open_intervals, ends, lows, highs, strict=True):
                middle = float(begin + end) / 2
                q = self._motion.sample(middle)
                clearance = self._witness.clearances(q)
                least = self._note(clearance, middle)
                if least <= 0:
                    return "fails"
                if least <= _GUARD:
                    return "undecided"  # no interval around this instant could ever be proven
                way = self._reach @ np.maximum(high - q, q - low)  # (capsules,)
                left = float((clearance - way[:, None]).min()) - _GUARD
                if left > (0.0 if level == _BISECTIONS else _WORTH * least):
                    self.proven = min(self.proven, left)
                else:
                    failed.append(i)
            self.resolution = float(ends[0, 1] - ends[0, 0])
            if not failed:
                return "holds"
            open_intervals = np.array([2 * i + half for i in failed for half in (0, 1)])
        return "undecided"

    def closest(self, duration: float) -> ClosestApproach | None:
        if self._closest is None:
            return None
        clearance, link, obstacle, s = self._closest
        return ClosestApproach(link=self._robot.capsules[link].name, obstacle=obstacle, time=s * duration, clearance=clearance)

    def _note(self, clearance: Array, s: float) -> float:
        """Return the least clearance measured so far."""
        self.evaluations += 1
        link, obstacle = np.unravel_index(int(np.argmin(clearance)), clearance.shape)
        least = float(clearance[link, obstacle])
        if self._closest is None or least < self._closest[0]:
            self._closest = (least, int(link), int(obstacle), s)
        return self._closest[0]


def _reaches(robot: Robot, motion: Motion) -> Array:
    """Return r, (capsules, n): a point of a capsule's axis moves at most r @ |dq|, for any configurations of the motion.

    A point at most r from a revolute joint's axis moves at most r |dq| with it, one on a prismatic joint |dq|. Going
    towards the base, the distance from a joint's origin grows by each offset and by a slide's greatest extension; the
    distance from its axis only by what of the offset is across.
    """
    _, low, high = motion.hulls(0)
    furthest = np.maximum(np.abs(low.min(axis=0)), np.abs(high.max(axis=0)))
    out = np.zeros((len(robot.capsules), robot.dof))
    for row, capsule in zip(out, robot.capsules, strict=True):
        at = capsule.joint
        from_origin = max(float(np.linalg.norm(end)) for end in (capsule.a, capsule.b))
        from_axis = max(float(np.hypot(end[0], end[1])) for end in (capsule.a, capsule.b))
        while at >= 0:
            joint = robot.joints[at]
            if joint.kind == "revolute":
                row[joint.dof] += abs(joint.multiplier) * from_axis
            else:
                row[joint.dof] += abs(joint.multiplier)
                from_origin += abs(joint.multiplier) * furthest[joint.dof] + abs(joint.offset)
            offset = joint.T_parent_joint[:3, 3]
            from_axis = from_origin + float(np.hypot(offset[0], offset[1]))
            from_origin += float(np.linalg.norm(offset))
            at = joint.parent
    return out
