"""The seed's problem as objectives of any build: the paper's arm and obstacles, or none, or drawn ones; and motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kernel.builds import Build, place, surround
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere, pose
from spacearm.robot import Robot, joint_centres, load_robot

OBSTACLES = (Sphere((0.5, 0.5, 0.0), 0.1), Sphere((0.4, 0.7, 0.0), 0.1), Sphere((0.2, 0.8, 0.0), 0.1))
GOAL = np.array([0.7, 0.3, 0.0])
WEIGHTS = np.array([0.5, 0.25, 0.25])


def paper_robot() -> Robot:
    return load_robot("zhang2022")


def paper_objective(build: Build, robot: Robot, obstacles: tuple[Sphere, ...] = OBSTACLES) -> Any:
    """The paper's fitness in goal mode."""
    centres = list(joint_centres(robot))
    model = place(build, robot, points=centres, spheres=obstacles).native
    return objective_of(build, model, centers=np.arange(len(centres), dtype=np.int32), tip=len(centres) - 1)


def objective_of(build: Build, scene: Any, **given: Any) -> Any:
    """The paper's objective on a model; goal, weights, mode and tolerance as given, or as usual."""
    usual = {"goal": GOAL, "weights": WEIGHTS, "must_reach": True, "tolerance": 1e-3}
    return build.named("PaperObjective")(scene=scene, **{**usual, **given})


def reach_objective(build: Build, robot: Robot, obstacles: Sequence[Obstacle] = OBSTACLES) -> Any:
    """A configuration near home that reaches the goal with a margin."""
    centres = list(joint_centres(robot))
    model = surround(build, robot, obstacles, points=centres).native
    return build.named("ReachObjective")(
        scene=model,
        points=np.array([len(centres) - 1], dtype=np.int32),
        targets=GOAL[None].copy(),
        tolerances=np.array([1e-3]),
        margin=0.02,
        home=np.zeros(robot.dof),
    )


CLUTTER = (
    Box((0.1, 0.1, 0.6), pose((0.55, 0.35, 0.3))),
    Cylinder(0.08, 0.5, pose((-0.3, 0.8, 0.2))),
    Capsule((-0.2, 0.9, -0.4), (0.4, 0.9, -0.4), 0.06),
    HalfSpace((0, 0, 1), (0, 0, -0.9)),
    Sphere((0.3, -0.6, 0.4), 0.15),
)
"""One obstacle of every shape around the paper's arm."""
AROUND = (-1.95, -0.01, 2.48, -0.26, -1.08, -0.77, 1.66), (2.34, 0.23, 2.42, 1.07, -2.28, 0.08, -0.44)
"""A start and a goal between which the straight motion of `thick_arm` collides with them [rad]."""


def thick_arm() -> Robot:
    """The paper's arm with links of 8 cm."""
    robot = paper_robot()
    return replace(robot, capsules=tuple(replace(capsule, radius=0.04) for capsule in robot.capsules))


MOTION_SWARM = {
    "particles": 16,
    "evaluations": 16 * 400,
    "inertia_start": 0.6,
    "inertia_end": 0.6,
    "cognitive": 1.49,
    "social": 1.49,
    "ring": 3,
    "start_velocity": 0.02,
}
"""A small swarm on a ring, as the planner's."""


def motion_search(
    build: Build,
    robot: Robot,
    obstacles: Sequence[Obstacle],
    start: Any,
    goals: Any,
    *,
    bounds: tuple[Any, Any] | None = None,
    rates: tuple[Any, Any] | None = None,
    jerk: Any = (),
    margin: float = 0.002,
    preferred_clearance: float = 0.05,
    weights: dict[str, float] | None = None,
    settings: dict[str, Any] | None = None,
    swarm: dict[str, Any] | None = None,
    base: Any = None,
    masses: dict[str, np.ndarray] | None = None,
    pair_margins: dict[str, np.ndarray] | None = None,
    near_pairs: dict[str, np.ndarray] | None = None,
    seed: int = 0,
    island: int = 0,
) -> Any:
    """A search for motions from start (n,) to goals (g, n); by length, unless weights are given."""
    centres = list(joint_centres(robot))
    tip = robot.frame(robot.tip)
    points = [*centres, (tip.joint, tip.T_joint_frame[:3, 3])]
    chosen = {"length": 1.0} if weights is None else weights
    lower, upper = (robot.lower, robot.upper) if bounds is None else bounds
    velocity, acceleration = (robot.velocity, robot.acceleration) if rates is None else rates
    kernel = build.module
    weighed = kernel.MotionWeights()
    for name in kernel.motion_terms:
        setattr(weighed, name, chosen.get(name, 0.0))
    problem = kernel.MotionProblem(
        start=np.array(start, dtype=np.float64),
        goals=np.array(goals, dtype=np.float64).reshape(-1, robot.dof),
        lower=np.array(lower, dtype=np.float64),
        upper=np.array(upper, dtype=np.float64),
        velocity=np.array(velocity, dtype=np.float64),
        acceleration=np.array(acceleration, dtype=np.float64),
        jerk=np.array(jerk, dtype=np.float64),
        margin=margin,
        preferred_clearance=preferred_clearance,
        tip=len(points) - 1,
        centers=np.arange(len(centres), dtype=np.int32),
        weights=weighed,
        base=kernel.FixedBase() if base is None else base,
        near_pairs=None if near_pairs is None else kernel.NearPairs(**near_pairs),
    )
    return build.named("MotionSearch")(
        scene=surround(build, robot, obstacles, points=points, pair_margins=pair_margins, masses=masses).native,
        problem=problem,
        settings=build.search_settings(MOTION_SWARM if swarm is None else swarm, **(settings or {})),
        seed=seed,
        island=island,
    )


def run_motions(
    search: Any, evaluations: int = 0, *, seconds: float = 0.0, until_first: bool = False, stall: int = 0, progress: Any = None
) -> Any:
    """Run a search for motions; 0 is no limit."""
    search.run(evaluations=evaluations, seconds=seconds, until_first=until_first, stall=stall, progress=progress)
    return search


def searched(
    build: Build,
    objective: Any,
    bounds: tuple[np.ndarray, np.ndarray],
    settings: dict[str, Any],
    *,
    seed: int = 1,
    first_trial: int = 0,
    trials: int = 1,
    threads: int = 1,
    keep_positions: bool = False,
    stop_when_feasible: bool = False,
    seconds: float = 0.0,
    initial: np.ndarray | None = None,
    progress: Any = None,
) -> list[Any]:
    """Run the kernel's own search, one result a trial."""
    return objective.search(
        lower=bounds[0],
        upper=bounds[1],
        settings=build.settings(**settings),
        seed=seed,
        first_trial=first_trial,
        trials=trials,
        threads=threads,
        keep_positions=keep_positions,
        stop_when_feasible=stop_when_feasible,
        seconds=seconds,
        initial=initial,
        progress=progress,
    )


def goal_search(build: Build, robot: Robot, obstacles: Sequence[Obstacle], pose: np.ndarray, start: Any, seed: int = 0) -> Any:
    """A search for configurations that bring the robot's tip to a pose (4, 4)."""
    tip = robot.frame(robot.tip)
    goal = build.module.FrameGoal(
        kind=build.module.FrameGoalKind.pose,
        joint=tip.joint,
        local=tip.T_joint_frame[:3, :3].copy(),
        offset=tip.T_joint_frame[:3, 3].copy(),
        wanted=pose[:3, :3].copy(),
        position=pose[:3, 3].copy(),
        axis=np.zeros(3),
        position_tolerance=1e-3,
        angle_tolerance=1e-2,
    )
    return build.module.GoalSearch64(
        scene=surround(replace(build, bits=64), robot, list(obstacles)).native,
        goal=goal,
        start=np.array(start, dtype=np.float64),
        lower=np.array(robot.lower),
        upper=np.array(robot.upper),
        whole_turns=np.ones(robot.dof, dtype=bool),
        margin=0.002,
        seed=seed,
    )
