"""The trees of the search: how much they have to look at until they meet, on robots that are made otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from kernel import objectives
from kernel.builds import surround
from spacearm.geometry import Box, Obstacle, Sphere, pose
from spacearm.robot import Frame, Joint, LinkCapsule, Robot
from support.kernel_cases import resized
from support.motion_searches import BUILD, EXACT, GOAL, START

SEEDS = range(6)


def configurations(robot: Robot, obstacles: Sequence[Obstacle], start: np.ndarray, goal: np.ndarray, margin: float) -> float:
    """The median over the seeds, until a path has become a motion."""
    counts = []
    for seed in SEEDS:
        search = objectives.motion_search(BUILD, robot, obstacles, start, goal, margin=margin, seed=seed)
        search.run(evaluations=20000, seconds=0.0, until_first=True, stall=0, progress=None)
        assert search.best is not None
        counts.append(search.configurations)
    return float(np.median(counts))


def in_unit(robot: Robot, size: float) -> Robot:
    """The robot in another unit of length; its slides, if any, stay what they are in their own numbers."""

    def moved(T: np.ndarray) -> np.ndarray:
        T = T.copy()
        T[:3, 3] *= size
        return T

    return replace(
        robot,
        joints=tuple(replace(j, T_parent_joint=moved(j.T_parent_joint)) for j in robot.joints),
        frames=tuple(replace(f, T_joint_frame=moved(f.T_joint_frame)) for f in robot.frames),
        capsules=tuple(replace(c, a=c.a * size, b=c.b * size, radius=c.radius * size) for c in robot.capsules),
    )


@pytest.mark.parametrize("size", [1 / 64, 64.0])
def test_the_size_of_a_robot_does_not_matter(size: float) -> None:
    """An arm of centimetres or of many metres takes about as many configurations: steps are of joints, not of metres."""
    robot, obstacles = objectives.thick_arm(), objectives.CLUTTER
    expected = configurations(robot, obstacles, np.array(START), np.array(GOAL), 0.002)
    there = in_unit(robot, size)
    assert (there.lower == robot.lower).all()
    found = configurations(there, [resized(o, size) for o in obstacles], np.array(START), np.array(GOAL), 0.002 * size)
    assert expected / 2 < found < expected * 2


def rail(turns: float) -> Robot:
    """An arm of two links on a rail of 4 m; its last link also turns about its own axis, by so many turns at most."""
    up, ahead, along = np.eye(4), np.eye(4), np.eye(4)
    up[2, 3], ahead[0, 3] = 0.5, 0.6
    along[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]  # z along the link
    sideways = np.eye(4)
    sideways[:3, :3] = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]  # z along y
    back = np.linalg.inv(sideways) @ up
    joints = (
        Joint(name="rail", kind="prismatic", parent=-1, T_parent_joint=sideways),
        Joint(name="shoulder", kind="revolute", parent=0, T_parent_joint=back, dof=1),
        Joint(name="elbow", kind="revolute", parent=1, T_parent_joint=ahead, dof=2),
        Joint(name="roll", kind="revolute", parent=2, T_parent_joint=along, dof=3),
    )
    links = (("upper", 1, [0.6, 0, 0]), ("fore", 2, [0.5, 0, 0]), ("hand", 3, [0, 0, 0.6]))
    return Robot(
        name="rail",
        joints=joints,
        capsules=tuple(LinkCapsule(name=n, joint=j, a=np.zeros(3), b=np.array(b, float), radius=0.05) for n, j, b in links),
        frames=(Frame(name="tip", joint=3, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=np.array([-2.0, -3.0, -3.0, -2 * np.pi * turns]),
        upper=np.array([2.0, 3.0, 3.0, 2 * np.pi * turns]),
        velocity=np.ones(4),
        acceleration=np.ones(4),
    )


def test_a_rail_and_a_joint_that_moves_nothing_are_no_obstacle() -> None:
    """From one bay to the next, past a wall that reaches the rail: the arm has to fold. Turning the hand changes nothing."""
    wall = [Box((1.5, 0.1, 2.0), pose((0.95, 0.0, 0.0)))]
    start, goal = np.array([-1.0, 0.1, -0.2, 0.0]), np.array([1.0, -0.1, 0.2, 3.0])
    few = configurations(rail(1), wall, start, goal, 0.002)
    many = configurations(rail(50), wall, start, goal, 0.002)
    assert few < 2000 * BUILD.lanes
    assert many < 3 * few
    search = objectives.motion_search(BUILD, rail(1), wall, start, goal)
    search.run(evaluations=20000, seconds=0.0, until_first=True, stall=0, progress=None)
    points = np.vstack([start, search.best.points, goal])
    q = BUILD.module.spline_values(np.linspace(0, 1, 400), len(points) - 2, 0) @ points
    assert surround(EXACT, rail(1), wall).native.free(np.ascontiguousarray(q), 0.0).all()


def gantry(size: float) -> Robot:
    """A ball on three slides, each as long as the size [m]."""
    turned, again = np.eye(4), np.eye(4)
    turned[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    again[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    return Robot(
        name="gantry",
        joints=tuple(
            Joint(name=name, kind="prismatic", parent=i - 1, T_parent_joint=T, dof=i)
            for i, (name, T) in enumerate((("x", turned), ("y", again), ("z", turned)))
        ),
        capsules=(LinkCapsule(name="ball", joint=2, a=np.zeros(3), b=np.zeros(3), radius=0.05 * size),),
        frames=(Frame(name="tip", joint=2, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=np.full(3, -size / 2),
        upper=np.full(3, size / 2),
        velocity=np.full(3, size),
        acceleration=np.full(3, size),
    )


@pytest.mark.parametrize("size", [1 / 64, 1.0, 64.0])
def test_how_far_slides_go_does_not_matter(size: float) -> None:
    """A robot of slides alone has no angles: its steps are shares of what its slides move."""
    draws = np.random.default_rng(3).uniform(-0.5, 0.5, (80, 3))
    balls = [Sphere(c * size, 0.14 * size) for c in draws if np.linalg.norm(np.abs(c) - 0.49) > 0.22]  # none in a corner
    end = np.full(3, 0.49 * size)
    for seed in SEEDS:
        search = objectives.motion_search(BUILD, gantry(size), balls, -end, end, margin=0.001 * size, seed=seed)
        search.run(evaluations=2000, seconds=0.0, until_first=True, stall=0, progress=None)
        assert search.best is not None
