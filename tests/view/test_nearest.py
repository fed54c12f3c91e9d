"""The nearest pair: by the same measure as planning, its points that far apart, on a base that has moved too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import spacearm as sa
from house.source import REPOSITORY
from spacearm.files import load_problem
from spacearm.geometry.scene import moved_scene
from spacearm.view.nearest import nearest, parts_of

EXAMPLES = ("01_first_plan", "03_truss", "04_payload", "05_floating_servicer", "06_floating_truss", "07_box_servicer")


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_nearest_pair_is_that_of_the_planner(name: str) -> None:
    problem = load_problem(REPOSITORY / "examples" / f"{name}.yaml")
    rng = np.random.default_rng(0)
    low, high = np.maximum(problem.robot.lower, -2), np.minimum(problem.robot.upper, 2)
    for _ in range(8):
        q = rng.uniform(low, np.maximum(high, low))
        found = nearest(problem, q, problem.base_start)
        assert found is not None
        assert found.clearance == pytest.approx(float(sa.clearance(problem, q)), abs=1e-9)
        assert found.points is not None
        if found.clearance > 1e-6:
            assert np.linalg.norm(np.diff(found.points, axis=0)) == pytest.approx(found.clearance, abs=2e-6)
        assert found.tone == ("bad" if found.clearance <= 0 else "near" if found.clearance < found.required else "good")
        assert found.first in found.message


def test_a_base_that_has_moved_is_seen_from_where_it_is() -> None:
    problem = load_problem(REPOSITORY / "examples" / "06_floating_truss.yaml")
    T = sa.pose((0.05, -0.02, 0.1), (0.99, 0.02, 0.05, 0.1))
    moved = T @ problem.base_start
    found = nearest(problem, problem.start, moved)
    scene = moved_scene(problem.scene, np.linalg.inv(T))
    wanted = nearest(replace(problem, scene=scene), problem.start, problem.base_start)
    assert found is not None
    assert wanted is not None
    assert found.clearance == pytest.approx(wanted.clearance, abs=1e-9)
    assert found.points is not None
    assert wanted.points is not None
    np.testing.assert_allclose(found.points, wanted.points @ T[:3, :3].T + T[:3, 3], atol=1e-5)


def arm_beside(*obstacles: sa.Sphere, **given: object) -> sa.Problem:
    return sa.Problem(sa.load_robot("zhang2022"), list(obstacles), start=[0] * 7, goal=[0.1] * 7, **given)


def test_a_pair_that_lacks_clearance_goes_before_a_nearer_one() -> None:
    near, far = sa.Sphere((0.2, 0.5, 0), 0.1, name="near"), sa.Sphere((-0.4, 0.5, 0), 0.1, name="far")
    problem = arm_beside(near, far, clearances=[{"obstacle": "far", "clearance": 0.5}])
    found = nearest(problem, problem.start, problem.base_start)
    assert found is not None
    assert (found.tone, found.obstacle, found.required) == ("near", 1, 0.5)
    assert "500 mm are asked for" in found.message


def test_contact_is_bad_and_says_how_deep() -> None:
    problem = arm_beside(sa.Sphere((0.05, 0.5, 0), 0.1, name="ball"))
    found = nearest(problem, problem.start, problem.base_start)
    assert found is not None
    assert found.tone == "bad"
    assert "obstacle 'ball' penetrate by 50 mm" in found.message


def test_one_of_many_balls_and_pieces_is_found() -> None:
    balls = sa.SphereSet([(2, 0, 0), (0.3, 0.5, 0), (3, 0, 0)], [0.1, 0.1, 0.1], name="cloud")
    cube = np.array([(x, y, z) for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1)])
    pieces = sa.PolytopeSet([sa.Polytope(cube + 5), sa.Polytope(cube + np.array([0.15, 0.9, 0]))], name="mesh")
    for obstacle in (balls, pieces):
        problem = arm_beside(obstacle)  # type: ignore[arg-type]
        found = nearest(problem, problem.start, problem.base_start)
        assert found is not None
        assert found.points is not None
        assert np.linalg.norm(np.diff(found.points, axis=0)) == pytest.approx(found.clearance, abs=1e-6)
    assert len(parts_of(balls, 1)) == 1
    assert len(parts_of(balls, 7)) == 3


def test_free_space_has_no_nearest_pair() -> None:
    robot = replace(sa.load_robot("zhang2022"), self_pairs=())
    problem = sa.Problem(robot, [], start=[0] * 7, goal=[0.1] * 7)
    assert nearest(problem, problem.start, problem.base_start) is None
