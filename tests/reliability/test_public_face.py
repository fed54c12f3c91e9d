"""A share of benchmarks/soak_public_face.py: wrong input to a public name is answered in one sentence, and soon."""

from __future__ import annotations

import importlib.util
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from house.source import REPOSITORY

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="timers of POSIX")


@pytest.fixture(scope="module")
def soak() -> Any:
    """Load the benchmark, which is no package."""
    path = REPOSITORY / "benchmarks" / "soak_public_face.py"
    spec = importlib.util.spec_from_file_location("soak_public_face", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["soak_public_face"] = module  # where its dataclasses are looked for
    spec.loader.exec_module(module)
    return module


def test_wrong_input_is_a_spacearm_error(soak: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # a wrong path may be a good name for a file
    assert list(soak.faults(tmp_path, count=800, seed=20)) == []


def test_the_good_calls_are_good_and_of_every_public_function(soak: Any, tmp_path: Path) -> None:
    called = {call.name.partition(".")[0] for call in soak.calls(tmp_path)}
    results = {"BaseReport", "Certificate", "Diagnosis", "Finding", "KernelInfo", "LinkEnvelope", "ParetoFront", "Plan"}
    results |= {"Robustness", "SavedPlan", "SelfPairs", "SpacearmError", "SwarmResult"}
    browsers = {"save_video"}  # takes seconds; tests/show/test_video.py gives it wrong input
    assert set(sa.__all__) - called == results | browsers | {"builtin_robots", "kernel_info"}
    refused = {"Swarm.load", "load_moveit"}  # for want of a good file
    for call in soak.calls(tmp_path):
        if call.name not in refused:
            call.what(*call.arguments, **(call.named or {}))


def test_motions_through_very_many_points_are_refused() -> None:
    points = np.zeros((5000, 7))
    with pytest.raises(sa.SpacearmError, match="control_points has 5000 points, expected at most 514"):
        sa.Motion(points)


@pytest.mark.parametrize(
    "change", [{"mass": 1e308}, {"com": (1e300, 0, 0)}, {"com": (0, 1e150, 0)}, {"inertia": 1e300 * np.eye(3)}]
)
def test_bodies_beyond_measure_do_not_float(change: dict[str, Any]) -> None:
    robot = sa.load_robot("srs7")
    wild = replace(robot, bodies=(robot.bodies[0], replace(robot.bodies[1], **change), *robot.bodies[2:]))
    home = robot.configuration("home")
    with pytest.raises(sa.SpacearmError, match=r"cannot float: body 'link_1' has a mass of .*, expected all below 1e\+15"):
        sa.Problem(wild, [], start=home, goal=home, base="floating")


def test_a_plan_whose_fitness_is_infinite_is_saved(tmp_path: Path) -> None:
    robot = sa.load_robot("zhang2022")
    found = sa.plan(sa.Problem(robot, [], start=np.zeros(7), goal=np.full(7, 0.1)), sa.PlannerSettings(evaluations=30), rng=0)
    sa.save_plan(replace(found, fitness={**found.fitness, "clearance": float("inf")}), tmp_path / "plan.json")
    assert '"clearance": null' in (tmp_path / "plan.json").read_text()
    assert sa.load_saved_plan(tmp_path / "plan.json").status == "found"


def test_no_motions_are_judged_as_none() -> None:
    robot = sa.load_robot("zhang2022")
    swarm = sa.MotionSwarm(sa.Problem(robot, [], start=np.zeros(7), goal=np.full(7, 0.1)), rng=0)
    assert swarm.judge(swarm.ask()[:0]).fitness.shape == (0,)


def test_a_robot_whose_name_is_not_ascii_is_exported(tmp_path: Path) -> None:
    robot = replace(sa.load_robot("zhang2022"), name="卫星", dof_names=("a,b", *sa.load_robot("zhang2022").dof_names[1:]))
    trajectory = sa.Trajectory(robot, sa.Motion([np.zeros(7), np.full(7, 0.1)]))
    sa.write_aem(trajectory, tmp_path / "t.aem")
    assert "OBJECT_NAME = ??" in (tmp_path / "t.aem").read_text()
    from spacearm.files import save_trajectory

    save_trajectory(trajectory, tmp_path / "t.csv")
    assert sa.load_trajectory(robot, tmp_path / "t.csv").limits.holds
