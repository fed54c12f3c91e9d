"""Why there can be no plan: what the robot collides with at an end of the motion, and what keeps a goal from being reached."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.planner.clearance import ClearanceModel
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, JointGoal, PositionGoal, SpaceGoal
from spacearm.planner.inverse_kinematics import (
    FAR,
    GoalConfigurations,
    Reach,
    polished,
    reach_of,
    reaches,
    reaching_bounds,
)
from spacearm.planner.problem import Problem, whole_turns
from spacearm.robot import Robot

Array = NDArray[np.float64]

_LISTED = 3  # contacts and joints in a message; more of them would not be read
_TOUCH = 1e-9  # [m] penetration that is rounding
_BEGUN = 64  # configurations from which the goal is tried without joint limits, beside the closest one found


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Contact(Brief):
    """Two things that touch or penetrate.

    Attributes:
        link: name of the robot's link.
        other: what it collides with: an obstacle by its name or its place in the scene, or another link by its name.
        kind: "obstacle" or "link".
        depth: of penetration [m]; 0 where they touch.
    """

    link: str
    other: str
    kind: Literal["obstacle", "link"]
    depth: float

    @property
    def message(self) -> str:
        """The contact in words."""
        other = f"link '{self.other}'" if self.kind == "link" else f"obstacle {self.other}"
        how = f"penetrate by {self.depth * 1e3:.4g} mm" if self.depth > _TOUCH else "touch"
        return f"link '{self.link}' and {other} {how}"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BeyondLimit(Brief):
    """A joint that would have to be beyond its limit.

    Attributes:
        joint: its name.
        value: where it would have to be [rad or m].
        limit: the limit on that side.
        unit: "rad" or "m".
    """

    joint: str
    value: float
    limit: float
    unit: str

    @property
    def message(self) -> str:
        """The excess in words."""
        side = "above" if self.value > self.limit else "below"
        return f"joint '{self.joint}' would have to be at {self.value:.4g} {self.unit}, {side} its limit {self.limit:.4g}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class EndReport(Brief):
    """Whether a motion can begin and end.

    Attributes:
        status: "free", "start_in_collision", "goal_in_collision" or "goal_unreachable".
        contacts: at `q`, deepest first; one for each pair of a link and what it meets.
        beyond: the joints whose limits keep the goal from being reached, if limits do.
        q: (n,) the start, or the configuration that comes nearest to the goal; None if all is free.
        distance: by how much it misses the goal's position [m].
        angle: by how much it misses the goal's orientation [rad].
        message: in a sentence, with what to do; empty if all is free.
    """

    status: Literal["free", "start_in_collision", "goal_in_collision", "goal_unreachable"]
    contacts: tuple[Contact, ...] = ()
    beyond: tuple[BeyondLimit, ...] = ()
    q: Array | None = None
    distance: float = 0.0
    angle: float = 0.0
    message: str = ""


def check_ends(problem: Problem) -> EndReport:
    """Check the start, and a goal that is given as configurations, for collision.

    A goal with a tolerance and a goal in space are left to `find_goal_configurations` and `explain_goal`.

    Args:
        problem: robot, scene, start and goal.

    Returns:
        "start_in_collision", "goal_in_collision" or "free".
    """
    goal, start = problem.goal, problem.start[None]
    given = goal if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)) and not np.any(goal.tolerance) else None
    rows = start[:0] if given is None else np.atleast_2d(given.q)
    if problem.at_goal is problem.at_start:
        least = problem.at_start.least(np.vstack([start, rows]))
    else:
        least = np.concatenate([problem.at_start.least(start), problem.at_goal.least(rows)])
    goal_met = given is not None and not (least[1:] > 0).any()
    if least[0] <= 0:
        met = contacts(problem.at_start, problem.start)
        message = f"the start is in collision: {_listed(met)}{'; so is the goal' * goal_met}; {_advice('start', met)}"
        return EndReport(status="start_in_collision", contacts=met, q=problem.start, message=message)
    if given is not None and goal_met:
        return _goal_in_collision(problem.at_goal, given)
    return EndReport(status="free")


def contacts(model: ClearanceModel, q: Array) -> tuple[Contact, ...]:
    """List what touches or penetrates in one configuration (n,), deepest first, each pair of names once."""
    names = [part.name for part in model.robot.shapes]
    deepest: dict[tuple[str, str, Literal["obstacle", "link"]], float] = {}
    to_obstacles, between_links = model.to_obstacles(q[None])[0], model.between_links(q[None])[0]
    met: list[list[int]] = np.argwhere(to_obstacles <= 0).tolist()
    for capsule, obstacle in met:
        hit = names[capsule], model.scene.called(obstacle), "obstacle"
        deepest[hit] = max(deepest.get(hit, 0.0), float(-to_obstacles[capsule, obstacle]))
    for pair in np.flatnonzero(between_links <= 0).tolist():
        one, other = (names[int(i)] for i in model.pairs[pair])
        deepest[one, other, "link"] = max(deepest.get((one, other, "link"), 0.0), float(-between_links[pair]))
    made = [Contact(link=link, other=other, kind=kind, depth=depth) for (link, other, kind), depth in deepest.items()]
    return tuple(sorted(made, key=lambda contact: (-contact.depth, contact.link, contact.other)))


def explain_goal(problem: Problem, found: GoalConfigurations) -> EndReport:
    """Say why no collision-free configuration reaches the goal.

    Args:
        problem: robot, scene, start and goal.
        found: what `find_goal_configurations` gave for it.

    Returns:
        "goal_in_collision" if the goal is reached, but only in collision: the contacts of the least bad configuration are
        named. Else "goal_unreachable": joint limits are named if it is reached without them, and the closest approach is.
        "free" if there are goal configurations.
    """
    if len(found.q) or found.closest is None:
        return EndReport(status="free")
    robot, goal = problem.robot, problem.goal
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        return _goal_in_collision(problem.at_goal, goal)
    frame, met = goal.frame or robot.tip, contacts(problem.at_start, found.closest)
    if found.reached:
        message = (
            f"frame '{frame}' reaches the goal only in collision: at the least, {_listed(met)}; move the goal or what is in "
            "the way, or allow a larger tolerance"
        )
        return EndReport(
            status="goal_in_collision",
            contacts=met,
            q=found.closest,
            distance=found.distance,
            angle=found.angle,
            message=message,
        )
    beyond = _limits_in_the_way(robot, goal, problem.start, found.closest)
    approach = f"frame '{frame}' comes no nearer to the goal than {_missed(goal, found)}"
    if beyond:
        why = f"to reach it, {_listed(beyond)}; move the goal or the base, or widen the limit"
    else:
        why = f"{_reach_of(robot, goal)}; move the goal or the base, or allow a larger tolerance"
    return EndReport(
        status="goal_unreachable",
        beyond=beyond,
        contacts=met,
        q=found.closest,
        distance=found.distance,
        angle=found.angle,
        message=f"{approach}: {why}",
    )


def _goal_in_collision(model: ClearanceModel, goal: JointGoal) -> EndReport:
    rows = np.atleast_2d(goal.q)
    least = int(np.argmax(model.least(rows)))
    met = contacts(model, rows[least])
    tolerant = ", as is all that was tried within its tolerance" if np.any(goal.tolerance) else ""
    if len(rows) == 1:
        message = f"the goal is in collision{tolerant}: {_listed(met)}"
    else:
        message = (
            f"all {len(rows)} goal configurations are in collision{tolerant}: at the least, in number {least}, {_listed(met)}"
        )
    message = f"{message}; {_advice('goal', met)}"
    return EndReport(status="goal_in_collision", contacts=met, q=rows[least], message=message)


def _advice(what: str, met: tuple[Contact, ...]) -> str:
    if met and all(contact.kind == "link" for contact in met):
        other = "let the links touch (an SRDF says which may, `touching` what a held thing may)"
        closer = "if the real parts are apart, a smaller `excess` encloses their meshes more closely"
        return f"change `{what}`, or {other}; {closer}"
    return f"change `{what}` or the scene"


def _limits_in_the_way(robot: Robot, goal: SpaceGoal, start: Array, closest: Array) -> tuple[BeyondLimit, ...]:
    """Reach for the goal without joint limits, and tell which would be broken where that breaks them least."""
    lower, upper = reaching_bounds(robot, start)
    begun = np.vstack([closest, np.random.default_rng(0).uniform(lower, upper, (_BEGUN, robot.dof))])
    free = np.full(robot.dof, FAR)
    reach = Reach(robot=robot, goal=goal)
    q = polished(reach, begun, -free, free)
    q = q[reaches(reach, q)]
    if not len(q):
        return ()
    # Whole turns move no link: each joint is turned to where it breaks its limits least, if at all.
    limited = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    middle = np.where(limited, (np.where(limited, robot.lower, 0) + np.where(limited, robot.upper, 0)) / 2, q)
    q = np.where(whole_turns(robot), q - math.tau * np.round((q - middle) / math.tau), q)
    excess = np.maximum(np.maximum(robot.lower - q, q - robot.upper), 0.0)
    best = int(np.argmin(excess.max(axis=1)))
    order: list[int] = np.argsort(-excess[best], kind="stable").tolist()
    return tuple(
        BeyondLimit(
            joint=robot.dof_names[i],
            value=float(q[best, i]),
            limit=float(robot.upper[i] if q[best, i] > robot.upper[i] else robot.lower[i]),
            unit="m" if robot.is_prismatic(i) else "rad",
        )
        for i in order
        if excess[best, i] > 0
    )


def _missed(goal: SpaceGoal, found: GoalConfigurations) -> str:
    text = f"{round(found.distance, 6):.4g} m"
    return text if isinstance(goal, PositionGoal) else f"{text} and {math.degrees(found.angle):.3g} deg"


def _reach_of(robot: Robot, goal: SpaceGoal) -> str:
    reach, distance = reach_of(robot, goal.frame or robot.tip), float(np.linalg.norm(goal.position))
    if distance > reach:
        return f"the goal is {distance:.4g} m from the base, and the frame gets at most {reach:.4g} m far"
    there = "get there" if isinstance(goal, PositionGoal) else "take such a pose"
    return f"the arm cannot {there}, whatever its joint limits"


def _listed(items: tuple[Contact | BeyondLimit, ...]) -> str:
    text = ", ".join(item.message for item in items[:_LISTED]) or "there is next to no clearance"
    return f"{text} (and {len(items) - _LISTED} more)" if len(items) > _LISTED else text
