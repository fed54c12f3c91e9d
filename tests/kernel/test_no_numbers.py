"""A NaN, or a number without measure, never counts as free of collision, and no particle becomes one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kernel import objectives
from kernel.builds import Build, surround
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere

FAR: dict[str, Obstacle] = {
    "sphere": Sphere((9.0, 9.0, 9.0), 0.1),
    "capsule": Capsule((9.0, 9.0, 9.0), (9.0, 9.0, 10.0), 0.1),
    "box": Box((0.1, 0.1, 0.1), (9.0, 9.0, 9.0)),
    "cylinder": Cylinder(0.1, 0.1, (9.0, 9.0, 9.0)),
    "half-space": HalfSpace((0, 0, 1), (0, 0, -9.0)),
}
NO_NUMBERS = [np.nan, np.inf, -np.inf]


@pytest.mark.parametrize("value", NO_NUMBERS, ids=str)
@pytest.mark.parametrize("kind", FAR)
def test_a_configuration_without_a_number_collides(build: Build, kind: str, value: float) -> None:
    robot = objectives.thick_arm()
    native = surround(build, robot, [FAR[kind]]).native
    for joint in range(2):  # those that all of the arm hangs on
        q = build.array(np.zeros((20, robot.dof)))
        q[7, joint] = value
        for early in (False, True):
            shortfall = native.shortfalls(q, 0.01, early)
            assert shortfall[7] == np.inf
            assert not np.isnan(shortfall).any()
            if not early:
                np.testing.assert_array_equal(np.delete(shortfall, 7), 0)


@pytest.mark.parametrize("value", [*NO_NUMBERS, 1e30], ids=str)
@pytest.mark.parametrize("obstacles", [[], [FAR["box"]]], ids=["free space", "a box"])
def test_a_motion_without_a_number_is_not_free(build: Build, obstacles: list[Obstacle], value: float) -> None:
    search = objectives.motion_search(build, objectives.thick_arm(), obstacles, *map(np.array, objectives.AROUND))
    rows = build.array(np.zeros((3, 14)))
    rows[1, 9] = value
    found = search.judge(rows, 2, 0)
    assert not found.free[1]
    assert found.violation[1] == np.inf
    assert np.isfinite(found.violation[[0, 2]]).all()


def test_an_objective_without_a_number_is_the_worst(build: Build) -> None:
    for made in (objectives.paper_objective, objectives.reach_objective):
        objective = made(build, objectives.paper_robot())
        q = build.array(np.zeros((2, 7)))
        q[1, 0] = np.nan
        fitness, violation = objective.evaluate(q)
        assert np.isfinite([fitness[0], violation[0]]).all()
        assert not fitness[1] <= fitness[0] or not violation[1] <= violation[0]


@pytest.mark.parametrize("bounds", ["absorb", "reflect", "periodic"])
def test_particles_that_run_away_stay_within_the_bounds(build: Build, bounds: str) -> None:
    chosen: dict[str, Any] = {"particles": 20, "evaluations": 10**6, "bounds": bounds, "velocity_clamp": 0.0}
    swarm = build.swarm({**chosen, "inertia_start": 1e12, "inertia_end": 1e12, "cognitive": 1e12}, [-1.0, 2.0], [1.0, 5.0])
    for _ in range(60):
        swarm.ask()
        x = swarm.positions()
        assert ((x >= [-1.0, 2.0]) & (x <= [1.0, 5.0])).all()
        swarm.tell(build.array((x * x).sum(axis=1)), build.array(np.zeros(20)))
