"""Searches for motions among obstacles: crowded scenes, needles, islands."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from kernel import drawn, objectives
from kernel.builds import Build, surround
from spacearm.core.native import available_levels
from spacearm.geometry import Scene, Sphere
from spacearm.planner import PlannerSettings, Problem
from spacearm.planner.motion_search import Islands
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.robot import Robot
from support import strategies
from support.dense_samples import planar
from support.kernel_cases import enveloped
from support.oracles import pinocchio_points

BUILD = Build(available_levels()[0], 32)
EXACT = Build(available_levels()[0], 64)
START, GOAL = objectives.AROUND


@st.composite
def crowded(draw: st.DrawFn, build: Build) -> tuple[Robot, list[Any], np.ndarray, np.ndarray]:
    """A drawn robot, obstacles that leave its start and its goals free, these included; its limits may hold no 0."""
    robot = draw(strategies.robots(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    robot = enveloped(rng, robot, draw(st.sampled_from([1, 2, 6])))
    ends = build.array(draw(strategies.configurations(robot, (3,)))).astype(np.float64)
    ends = np.clip(ends, robot.lower, robot.upper)
    # Links that touch at an end need not keep clear, nor do links from what they touch there.
    model = surround(EXACT, robot)
    close = {(robot.capsules[i].name, robot.capsules[k].name) for i, k in model.pairs[(pair_least(model, ends) < 0.03)]}
    robot = replace(robot, self_pairs=tuple(pair for pair in robot.self_pairs if pair not in close))
    shapes = [draw(drawn.obstacles()) for _ in range(draw(st.sampled_from([0, 1, 4])))]
    shapes += [Sphere(rng.uniform(-2, 2, 3), rng.uniform(0.02, 0.4)) for _ in range(draw(st.sampled_from([0, 8])))]
    shapes += draw(drawn.balls_near(robot, pinocchio_points.joint_frames(robot, ends[:2].mean(axis=0)[None])[0]))  # half way
    if shapes:
        clear = surround(EXACT, robot, shapes).native.obstacle_clearances(np.ascontiguousarray(ends))
        clear = clear.min(axis=(0, 1), initial=np.inf)
        shapes = [shape for shape, room in zip(shapes, clear, strict=True) if room > 0.03]
    return robot, shapes, ends[0], ends[1:]


PROBLEM = Problem(objectives.thick_arm(), Scene(objectives.CLUTTER), start=START, goal=GOAL)


def islands(threads: int, count: int = 3, **changes: Any) -> Islands:
    chosen = PlannerSettings(islands=count, threads=threads, **changes)
    made = Islands(PROBLEM, np.array([GOAL]), chosen, seed=7, searched=SearchedClearance(asked=0.002))
    made.run(evaluations=500, seconds=0.0, until_first=False, stall=0)
    return made


def needle(at: float, length: float) -> Sphere:
    """A ball of 2 mm where the tip of the planar arm, stretched, is when its shoulder is at an angle."""
    return Sphere((length * math.cos(at), length * math.sin(at), 0.0), 0.002)


def quintic(s: float) -> float:
    return s**3 * (10 - 15 * s + 6 * s**2)


def thin_planar() -> Robot:
    robot = planar()
    return replace(robot, capsules=tuple(replace(link, radius=0.001) for link in robot.capsules))


def pair_least(model: Any, q: np.ndarray) -> np.ndarray:
    return model.native.pair_clearances(np.ascontiguousarray(q), model.pairs).min(axis=0)
