"""The same plan file from a processor that has less: told so to the C library, to OpenBLAS and to NumPy."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from spacearm.core.native import available_levels

START = np.radians([-25, 63, 0, 41, 0, 0, 0])
NEAR, GOAL = START + np.array([0.8, -0.3, 0.4, 0.5, 0.3, -0.4, 0.5]), np.radians([60, 40, 10, 60, 10, 20, 0])
POSTS = [sa.Capsule((x, y, -0.6), (x, y, 1.2), 0.04) for x, y in ((0.82, 0.15), (0.67, -0.12))]
WEIGHTS = sa.Weights(
    length=1, duration=0.1, tip=0.1, clearance=1, smoothness=0.01, f1=0.1, f2=0.1, f3=0.1, base_peak=1, base_rate=1
)
CASES: dict[str, tuple[Any, dict[str, Any], dict[str, Any]]] = {
    "fixed": (GOAL, {"base": "fixed"}, {}),
    "time-optimal": (GOAL, {"base": "fixed"}, {"time_law": "time_optimal", "jerk_limit": 2.0}),
    "elsewhere": (GOAL, {"base": "floating", "base_start": sa.pose((1.0, 2.0, 3.0), (0.9, 0.1, 0.2, 0.3))}, {}),
    "all weights": (NEAR, {"base": "floating"}, {"weights": WEIGHTS}),
    "base goal": (GOAL, {"base": "floating", "base_goal": sa.AttitudeGoal((1, 0.01, 0, 0), tolerance=0.02)}, {}),
    "limits": (NEAR, {"base": "floating", "base_limits": sa.BaseLimits(peak=0.3, rate=0.01, joint_momentum=2.0)}, {}),
    "tumbling": (NEAR, {"base": "floating", "momentum": sa.Momentum(angular=(0, 0, 0.5)), "duration": 12.0}, {}),
    "in space": (sa.PositionGoal((0.58, 0.36, 0.39)), {"base": "fixed"}, {}),
}
LESS = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-FMA4",
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR AVX512F AVX512CD AVX512_SKX AVX2 FMA3",
    "SPACEARM_KERNEL": available_levels()[-1],
}


def recorded() -> dict[str, Any]:
    """All that is recorded of each plan."""
    robot, out = sa.load_robot("srs7"), dict[str, Any]()
    for name, (goal, problem, settings) in CASES.items():
        place = problem.get("base_start")
        posts = POSTS if place is None else [sa.Capsule(_at(place, o.a), _at(place, o.b), o.radius) for o in POSTS]
        task = sa.Problem(robot, posts, start=START, goal=goal, **problem)
        plan = sa.plan(task, sa.PlannerSettings(**{"evaluations": 400, "islands": 2, **settings}), rng=7)
        assert plan.trajectory is not None
        assert plan.certificate is not None
        out[name] = [
            plan.status,
            plan.trajectory.motion.control_points.tolist(),
            plan.trajectory.duration.hex(),
            plan.certificate.as_dict(),
            plan.fitness,
            plan.goals.tolist(),
            [[i.evaluations, i.fitness, i.by] for i in plan.history],
        ]
    return out


def _at(place: np.ndarray, point: np.ndarray) -> np.ndarray:
    return (place[:3, :3] * point).sum(axis=1) + place[:3, 3]


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="these variables are of x86-64")
def test_a_lesser_processor_makes_the_same_plans() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "reliability.test_other_processors"],
        cwd=Path(__file__).parents[1],
        env={**os.environ, **LESS},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found, expected = json.loads(done.stdout), json.loads(json.dumps(recorded()))
    for name in CASES:
        assert found[name] == expected[name], name


if __name__ == "__main__":
    print(json.dumps(recorded()))
