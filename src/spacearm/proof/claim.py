"""What a proof has to show: which pairs of bodies keep how much clearance, along which path, with which error of the joints.

A claim is made of the robot, the scene and the trajectory, and of nothing that a search says. The finder (native) and the
checker read the same claim. Only the checker's word counts.

A pair is held to its required clearance, or to less while it is near at an end (`required_clearance`). Pairs are divided into
*phases*, so that a pair that barely keeps what it is held to does not lessen what is proven of the others. Phase 0 is of the
pairs that are held to the full all the time. A pair near at an end has three: from the start, up to the goal, and where it is
out. The last phase is of links that cannot meet within the limits: they only must not touch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity
from spacearm.geometry import Scene
from spacearm.proof.base_proofs import BaseProof
from spacearm.proof.convex_bodies import WORLD, BodyPairs, ConvexBodies, body_pairs, robot_bodies, scene_bodies
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import PairClearance, RequiredClearance, held_to
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

FROM_START, UP_TO_GOAL, OUT = 1, 2, 3
"""The phases of a pair near at an end; those of pair i are 3 i more."""


class NearPart(NamedTuple):
    """A part of a motion on which a pair is held to less than the required clearance.

    Attributes:
        phase: FROM_START or UP_TO_GOAL.
        ends: "start", "goal" or "both": where the pair is near.
        has: what it has there, at both the lesser [m].
        begin, end: from where to where on the curve; may be infinite.
    """

    phase: int
    ends: Literal["start", "goal", "both"]
    has: float
    begin: float
    end: float


class NearEnd(NamedTuple):
    """A pair that is near at the start or the goal.

    Attributes:
        link: index of the link in `RequiredClearance.links`.
        other: the other body: k obstacles of the scene come first, then the links.
        required: the clearance that is asked for [m].
        at_start, at_goal: what it has there [m].
        until: it is held to what it has at the start up to here on the curve; infinite: all the time.
        since: it is held to what it has at the goal from here on; minus infinity: all the time.
        room: the clearance above the required one at which it counts as out [m].
    """

    link: int
    other: int
    required: float
    at_start: float
    at_goal: float
    until: float
    since: float
    room: float

    @property
    def held_at_start(self) -> float:
        """What it is held to from the start on [m]."""
        return float(held_to(self.at_start, self.required))

    @property
    def held_at_goal(self) -> float:
        """What it is held to up to the goal [m]."""
        return float(held_to(self.at_goal, self.required))

    @property
    def parts(self) -> tuple[NearPart, ...]:
        """The parts of the motion on which it is held to less: one for each end, or one for all the time."""
        at_start, at_goal = self.held_at_start < self.required, self.held_at_goal < self.required
        if self.always:
            ends = "both" if at_start and at_goal else "start" if at_start else "goal"
            phase = UP_TO_GOAL if ends == "goal" else FROM_START
            has = self.at_goal if ends == "goal" else self.at_start if ends == "start" else min(self.at_start, self.at_goal)
            return (NearPart(phase, ends, has, -np.inf, np.inf),)
        from_start = NearPart(FROM_START, "start", self.at_start, -np.inf, self.until)
        up_to_goal = NearPart(UP_TO_GOAL, "goal", self.at_goal, self.since, np.inf)
        return (*((from_start,) if at_start else ()), *((up_to_goal,) if at_goal else ()))

    @property
    def always(self) -> bool:
        """Whether it is held to the lesser of both all the time."""
        return self.until == np.inf or self.since == -np.inf

    @property
    def known_excess(self) -> tuple[float, float, float]:
        """What is known of the least excess in the three phases: by what it has at the ends, and where it gets out [m]."""
        if self.always:
            least = min(self.at_start, self.at_goal) - self.held(FROM_START)
            return least, least, self.room
        from_start = self.at_start - self.held_at_start if self.until > -np.inf else np.inf
        up_to_goal = self.at_goal - self.held_at_goal if self.since < np.inf else np.inf
        return from_start, up_to_goal, self.room

    def held(self, phase: int) -> float:
        """Return what it is held to in a phase [m]."""
        if self.always:
            return min(self.held_at_start, self.held_at_goal)
        return (self.held_at_start, self.held_at_goal, self.required)[phase - 1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldClearances:
    """What pairs of bodies are held to.

    Attributes:
        required: (l, b) by link and body of the table: the clearance that is required; of a bundle the greatest of its members'
            [m].
        phase: (l, b) the phase; of pairs near at an end, and of bundles that hold such a body, 0.
        near: (l, b) 1 + the place of the pair in `pairs`, or 0.
        pairs: the pairs that are near at an end.
        held: (k, 3) what they are held to from the start, up to the goal, and where they are out [m].
        until, since: (k,) up to where on the curve they are held to the first, and from where on to the second.
        phases: how many there are.
    """

    required: Array
    phase: Indices
    near: Indices
    pairs: tuple[NearEnd, ...]
    held: Array
    until: Array
    since: Array
    phases: int

    @property
    def full_phases(self) -> list[int]:
        """The phases of pairs that are held to the full: those never near at an end, and near ones while they are out."""
        return [0, *range(OUT, 1 + 3 * len(self.pairs), 3)]

    def on(self, link: Indices, body: Indices, begin: Array, end: Array) -> tuple[Array, Indices]:
        """Return what pairs (t,) of links and bodies are held to on stretches of the curve, (t,) [m], and their phases (t,).

        A stretch on which the requirement changes is held to the greater one.
        """
        required, phase = self.required[link, body], self.phase[link, body]
        if not self.pairs:
            return required, phase
        near = self.near[link, body]
        which = np.flatnonzero(near)
        one = near[which] - 1
        begun, ending = end[which] <= self.until[one], begin[which] >= self.since[one]
        part = np.where(begun, FROM_START, np.where(ending, UP_TO_GOAL, OUT))
        required[which], phase[which] = self.held[one, part - 1], 3 * one + part
        return required, phase


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Claim:
    """What a proof has to show.

    Attributes:
        robot, scene: the bodies.
        base: the base along the trajectory; begun.
        path: the joints' path, with bounds.
        bodies: the table of all bodies, the robot's first.
        pairs: the pairs of outermost bodies that are kept apart.
        held: what they are held to.
        tracking: (n,) by how much each joint may deviate from the path, at every instant [rad or m].
    """

    robot: Robot
    scene: Scene
    base: BaseProof
    path: PathIntervals
    bodies: ConvexBodies
    pairs: BodyPairs
    held: HeldClearances
    tracking: Array


def claim_of(
    robot: Robot,
    scene: Scene,
    base: BaseProof,
    path: PathIntervals,
    *,
    required: RequiredClearance,
    by_pair: tuple[PairClearance, ...] = (),
    near: tuple[NearEnd, ...] = (),
    tracking: Array | None = None,
) -> Claim:
    """Return a claim.

    Args:
        robot, scene: the bodies.
        base: the base along the trajectory.
        path: of `base.curve`.
        required: the clearances required of all pairs.
        by_pair: those that were stated by pair: only these count for links that cannot meet.
        near: the pairs that are near at an end.
        tracking: (n,) how far each joint may be from the path [rad or m]; None: not at all.
    """
    floating = base.setup.model.follows_arm
    bodies, pairs = _kept_apart(robot, scene, floating=floating)
    claim = Claim(
        robot=robot,
        scene=scene,
        base=base,
        path=path,
        bodies=bodies,
        pairs=pairs,
        held=_held(robot, bodies, required, by_pair),
        tracking=np.zeros(base.curve.dof) if tracking is None else tracking,
    )
    return with_near(claim, near) if near else claim


def with_near(claim: Claim, near: tuple[NearEnd, ...]) -> Claim:
    """Return a claim in which these pairs are near at an end, and held to less there, and no others."""
    bodies, held, obstacles = claim.bodies, claim.held, len(claim.scene.obstacles)
    in_scene = bodies.frame == WORLD
    place = np.zeros(held.near.shape, np.intp)
    for i, one in enumerate(near):
        if one.other < obstacles:
            place[one.link, in_scene & (bodies.owner == one.other)] = i + 1
            continue
        for link, other in ((one.link, one.other - obstacles), (one.other - obstacles, one.link)):
            place[link, ~in_scene & (bodies.owner == other)] = i + 1
    phases = 1 + 3 * len(near) + 1
    of_near = HeldClearances(
        required=held.required,
        phase=np.where(held.phase == held.phases - 1, phases - 1, 0),
        near=place,
        pairs=near,
        held=np.array([[one.held(part) for part in (FROM_START, UP_TO_GOAL, OUT)] for one in near]).reshape(-1, 3),
        until=np.array([one.until for one in near], dtype=np.float64),
        since=np.array([one.since for one in near], dtype=np.float64),
        phases=phases,
    )
    return replace(claim, held=of_near)


@cached_by_identity
def _made_for(_: Robot) -> dict[tuple[int, bool], tuple[Scene, ConvexBodies, BodyPairs]]:
    """Return room for the tables of a robot, by the identity of the scene that is kept with them."""
    return {}


def _kept_apart(robot: Robot, scene: Scene, *, floating: bool) -> tuple[ConvexBodies, BodyPairs]:
    """Return the table of all bodies and the pairs; the same objects for a robot and a scene seen lately."""
    made = _made_for(robot)
    key = id(scene), floating
    found = made.get(key)  # other threads may clear `made` at any time
    if found is None:
        if len(made) >= 8:
            made.clear()
        bodies = robot_bodies(robot).followed_by(scene_bodies(scene))
        found = made[key] = scene, bodies, body_pairs(robot, bodies, floating=floating)
    return found[1:]


def _held(
    robot: Robot, bodies: ConvexBodies, required: RequiredClearance, by_pair: tuple[PairClearance, ...]
) -> HeldClearances:
    """Return what pairs of links and bodies of the table are held to, while none is near at an end."""
    links, obstacles = required.to_obstacles.shape
    between = required.between_links.copy()
    apart = np.zeros((links, links), dtype=bool)
    place = {name: i for i, name in enumerate(required.links)}
    if robot.apart is not None:
        own = {tuple(sorted((one.link, one.other_link))) for one in by_pair if one.link and one.other_link}
        for pair in robot.apart.pairs:
            i, k = place[pair[0]], place[pair[1]]
            apart[i, k] = apart[k, i] = True
            if tuple(sorted(pair)) not in own:
                between[i, k] = between[k, i] = 0.0
    of_owner = np.concatenate([required.to_obstacles, between], axis=1)  # (l, k + l)
    in_scene = bodies.frame == WORLD
    column = np.where(in_scene, bodies.owner, obstacles + bodies.owner)
    mixed = np.flatnonzero(bodies.owner < 0)  # bundles of several obstacles; their members come before them
    column[mixed] = 0
    by_body = of_owner[:, column]
    for body in mixed.tolist():
        members = slice(bodies.first_member[body], bodies.first_member[body] + bodies.members[body])
        by_body[:, body] = by_body[:, members].max(axis=1)
    phase = np.zeros(by_body.shape, np.intp)
    if apart.any():
        own_bodies = np.flatnonzero(~in_scene)
        phase[:, own_bodies] = apart[:, bodies.owner[own_bodies]]
    none = np.zeros(0)
    return HeldClearances(
        required=by_body,
        phase=phase,
        near=np.zeros(by_body.shape, np.intp),
        pairs=(),
        held=np.zeros((0, 3)),
        until=none,
        since=none,
        phases=2,
    )
