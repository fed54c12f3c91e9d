"""By how much a joint moves the bodies at most: never less than Pinocchio says, and not much more where it is easy to say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import drawn
from kernel.builds import Build, surround
from spacearm.robot import Frame, Joint, LinkCapsule, Robot
from support.kernel_cases import bench, enveloped
from support.oracles import pinocchio_points


def on_links(robot: Robot, q: np.ndarray) -> np.ndarray:
    """The ends of the capsules' axes (rows, points, 3) [m]."""
    riders = [(c.joint, end) for c in robot.capsules for end in (c.a, c.b)]
    return pinocchio_points.points(pinocchio_points.joint_frames(robot, q), riders)


@settings(max_examples=15)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_no_point_moves_further_than_the_lever(build: Build, data: st.DataObject, seed: int) -> None:
    """Joints move one by one, by little and by much; also those that others follow."""
    rng = np.random.default_rng(seed)
    robot = enveloped(rng, data.draw(drawn.robots()), 4)
    most = rng.uniform(0.5, 3.0, robot.dof)
    lever = surround(build, robot, []).native.levers(most)
    assert lever.shape == (robot.dof,)
    if not robot.capsules:
        return
    for d in range(robot.dof):
        q = rng.uniform(-most, most, (20, robot.dof))
        moved = q.copy()
        moved[:, d] = rng.uniform(-most[d], most[d], 20)
        by = np.linalg.norm(on_links(robot, moved) - on_links(robot, q), axis=2).max(axis=1)
        assert (by <= lever[d] * np.abs(moved[:, d] - q[:, d]) * (1 + 1e-5) + 1e-5).all()


def test_of_a_straight_arm_it_is_the_length_beyond_the_joint(build: Build) -> None:
    """Two revolute joints with links of 1 m, on a slide of 2 m, and a ball at the tip."""
    ahead = np.eye(4)
    ahead[0, 3] = 1.0
    joints = (
        Joint(name="slide", kind="prismatic", parent=-1, T_parent_joint=np.eye(4)),
        Joint(name="first", kind="revolute", parent=0, T_parent_joint=np.eye(4), dof=1),
        Joint(name="second", kind="revolute", parent=1, T_parent_joint=ahead, dof=2),
    )
    robot = Robot(
        name="slide",
        joints=joints,
        capsules=(LinkCapsule(name="tip", joint=2, a=np.array([1.0, 0, 0]), b=np.array([1.0, 0, 0]), radius=0.1),),
        frames=(Frame(name="tip", joint=2, T_joint_frame=ahead),),
        tip="tip",
        lower=np.array([0.0, -3.0, -3.0]),
        upper=np.array([2.0, 3.0, 3.0]),
        velocity=np.ones(3),
        acceleration=np.ones(3),
    )
    most = np.array([2.0, 3.0, 3.0])
    np.testing.assert_allclose(surround(build, robot, []).native.levers(most), [1.0, 2.1, 1.1], rtol=1e-4)
    behind = replace(  # the first joint turns the slide, too
        robot,
        joints=(replace(joints[1], parent=-1, dof=0), replace(joints[0], parent=0, dof=1), joints[2]),
        lower=robot.lower[[1, 0, 2]],
        upper=robot.upper[[1, 0, 2]],
    )
    np.testing.assert_allclose(surround(build, behind, []).native.levers(most[[1, 0, 2]]), [4.1, 1.0, 1.1], rtol=1e-4)


def test_without_bodies_there_is_none(build: Build) -> None:
    robot = bench()
    np.testing.assert_array_equal(surround(build, robot, []).native.levers(np.ones(1)), [0.0])
