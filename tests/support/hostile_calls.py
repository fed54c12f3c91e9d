"""Calls of the public face with arguments that nobody should give: each must give a result or one sentence, and soon."""

from __future__ import annotations

import signal
import traceback
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import spacearm as sa
from spacearm.core.errors import SpacearmError

VALUES: tuple[Any, ...] = (
    *(-1, 0, 1, 2**31 - 1, 2**31, 2**63, 10**18, 10**300, 10**5000),
    *(-1.0, 0.5, 1e-320, 1e-300, 1e16, 1e30, 1e300, float("nan"), float("inf"), -float("inf")),
    *("", "a", b"a", None, True, 1j, object()),
    *([], [[]], [1.0], [[1.0], [1.0, 2.0]], {}, {"a": 1}, (1e300,) * 3, (float("nan"),) * 7, [1e16] * 7),
    *(
        np.zeros(0),
        np.zeros((0, 7)),
        np.full((2, 7), np.nan),
        np.full((3, 4, 7), 1e300),
        np.array(1e300),
        np.array(["a"]),
        np.array(None),
    ),
)
ROBOT = sa.load_robot("srs7")
START, GOAL = np.radians([-25, 63, 0, 41, 0, 0, 0]), np.radians([60, 40, 10, 60, 10, 20, 0])
POST = sa.Capsule((0.82, 0.15, -0.6), (0.82, 0.15, 1.2), 0.04)
PROBLEM = sa.Problem(ROBOT, [POST], start=START, goal=GOAL, base="fixed")
MOTION = sa.Motion([START, GOAL])
SHORT = sa.Motion([START, START + 0.05])
TRAJECTORY = sa.Trajectory(ROBOT, MOTION, base="floating")
FEW = sa.PlannerSettings(evaluations=30)
CHEAP = 20_000  # evaluations of a swarm that is tried out


def _tried(made: Any) -> Any:
    if made.particles * made.iterations <= CHEAP:
        sa.minimize(_parabola, [-1.0] * 3, [1.0] * 3, made, rng=0)
    return made


def _parabola(x: Any) -> Any:
    return (np.asarray(x) ** 2).sum(axis=1) + 1.0, np.abs(x[:, 0])


def _planned(**given: Any) -> Any:
    made = sa.PlannerSettings(**{"evaluations": 30, "swarm": sa.PSO(particles=4, iterations=4), **given})
    within = (made.evaluations or 0) <= 1000 and made.swarm.particles <= 1000 and made.proofs <= 50
    return sa.plan(PROBLEM, made, rng=0) if within else made


def _problem(**given: Any) -> Any:
    made = sa.Problem(**{"robot": ROBOT, "scene": [POST], "start": START, "goal": GOAL, **given})
    return sa.plan(made, FEW, rng=0)


def _with(**given: Any) -> Any:
    return _problem(base="floating", **given)


def _swarm(**given: Any) -> Any:
    made = sa.MotionSwarm(PROBLEM, FEW, rng=0)
    made.ask()
    made.tell(**given)


Call = tuple[Callable[..., Any], dict[str, Any]]
"""A call that is fine, and the arguments that are changed."""
CALLS: dict[str, Call] = {
    "PSO": (
        lambda **k: _tried(sa.PSO(**k)),
        {n: getattr(sa.PSO(particles=20, iterations=20), n) for n in sa.PSO.__dataclass_fields__},
    ),
    "IPSO": (
        lambda **k: _tried(sa.IPSO(**k)),
        {n: getattr(sa.IPSO(variant="evolving", particles=20, iterations=20), n) for n in sa.IPSO.__dataclass_fields__},
    ),
    "FeasibleFirst": (
        lambda **k: _tried(sa.PSO(particles=9, iterations=9, constraints=sa.FeasibleFirst(**k))),
        {"forgiven": 0.5, "until": 0.5, "power": 3},
    ),
    "Penalty": (
        lambda **k: _tried(sa.PSO(particles=9, iterations=9, constraints=sa.Penalty(**k))),
        {"weight": 1.0, "final_weight": 5.0, "rise_from": 0.5},
    ),
    "minimize": (
        lambda **k: sa.minimize(**{"f": _parabola, "settings": sa.PSO(particles=9, iterations=9), **k}),
        {
            "lower": [-1.0],
            "upper": [1.0],
            "rng": 0,
            "initial": [[0.0]],
            "target": 0.0,
            "stall_iterations": 3,
            "max_seconds": 1.0,
            "checkpoint_every": 1,
        },
    ),
    "PlannerSettings": (
        _planned,
        {n: getattr(FEW, n) for n in sa.PlannerSettings.__dataclass_fields__ if n not in ("evaluations", "swarm", "time_law")},
    ),
    "Weights": (lambda **k: _planned(weights=sa.Weights(**k)), dict.fromkeys(sa.Weights.__dataclass_fields__, 1.0)),
    "Problem": (
        _problem,
        {"start": START, "goal": GOAL, "scene": [POST], "base_start": None, "duration": None, "base": "fixed"},
    ),
    "Problem, floating": (
        _with,
        {"momentum": None, "base_goal": None, "base_limits": None, "duration": 9.0, "base_start": None},
    ),
    "PositionGoal": (
        lambda **k: _problem(goal=sa.PositionGoal(**k)),
        {"position": (0.5, 0.3, 0.4), "tolerance": 1e-3, "frame": None},
    ),
    "PoseGoal": (
        lambda **k: sa.PoseGoal(**k),
        {"pose": np.eye(4), "position_tolerance": 1e-3, "orientation_tolerance": 0.1, "free_axis": "z", "frame": None},
    ),
    "ConfigurationGoal": (
        lambda **k: _problem(goal=sa.ConfigurationGoal(**k)),
        {"q": GOAL, "tolerance": 0.1, "shortest": True},
    ),
    "AttitudeGoal": (lambda **k: sa.AttitudeGoal(**k), {"attitude_wxyz": (1, 0, 0, 0), "tolerance": 0.1}),
    "BaseLimits": (
        lambda **k: _with(base_limits=sa.BaseLimits(**k)),
        {"final": 1.0, "peak": 1.0, "rate": 1.0, "joint_momentum": 9.0},
    ),
    "Momentum": (lambda **k: _with(momentum=sa.Momentum(**k), duration=9.0), {"linear": (0, 0, 1), "angular": (0, 0, 0.1)}),
    "Sphere": (lambda **k: _problem(scene=[sa.Sphere(**k)]), {"center": (3.0, 0, 0), "radius": 0.1}),
    "Capsule": (lambda **k: _problem(scene=[sa.Capsule(**k)]), {"a": (3.0, 0, 0), "b": (3.0, 0, 1), "radius": 0.1}),
    "Box": (lambda **k: _problem(scene=[sa.Box(**k)]), {"size": (1, 1, 1), "pose": (3.0, 0, 0)}),
    "Cylinder": (lambda **k: _problem(scene=[sa.Cylinder(**k)]), {"radius": 0.1, "length": 1.0, "pose": (3.0, 0, 0)}),
    "HalfSpace": (lambda **k: _problem(scene=[sa.HalfSpace(**k)]), {"normal": (0, 0, 1), "point": (0, 0, -3.0)}),
    "Motion": (lambda **k: sa.Trajectory(ROBOT, sa.Motion(**k)), {"control_points": [START, GOAL]}),
    "Motion.sample": (lambda **k: MOTION.sample(**k), {"s": 0.5, "derivative": 1}),
    "Motion.length": (lambda **k: MOTION.length(**k), {"samples": 9}),
    "Trajectory": (
        lambda **k: sa.Trajectory(ROBOT, MOTION, **k),
        {"duration": 99.0, "time_law": None, "base": None, "base_start": None},
    ),
    **{f"Trajectory.{name}": (getattr(TRAJECTORY, name), {"t": 0.5}) for name in ("sample", "base_pose", "base_rate", "tip")},
    "Trajectory.time_at": (lambda **k: TRAJECTORY.time_at(**k), {"s": 0.5}),
    "Trajectory.margins": (lambda **k: TRAJECTORY.margins(**k), {"jerk_limit": 9.0}),
    "certify": (
        lambda **k: sa.certify(PROBLEM, sa.Trajectory(ROBOT, MOTION, base="fixed"), **k),
        {"jerk_limit": 9.0, "clearance": 0.0, "tracking": 1e-4, "proof": None},
    ),
    "robustness": (
        lambda **k: sa.robustness(PROBLEM, sa.Trajectory(ROBOT, SHORT, base="fixed"), singly=False, **k),
        {"joints": "all", "resolution": 0.5},
    ),
    "clearance": (lambda **k: sa.clearance(PROBLEM, **k), {"q": START}),
    "forward_kinematics": (lambda **k: sa.forward_kinematics(ROBOT, **k), {"q": START}),
    "time_optimal": (lambda **k: sa.time_optimal(ROBOT, MOTION, **k), {"jerk_limit": 9.0, "gridpoints": 20, "pieces": 16}),
    "MotionSwarm.judge": (
        lambda **k: sa.MotionSwarm(PROBLEM, FEW, rng=0).judge(**k),
        {"control_points": [MOTION.control_points]},
    ),
    "MotionSwarm.tell": (_swarm, {"fitness": np.ones(16), "violation": np.zeros(16)}),
    "hold": (lambda **k: sa.hold(ROBOT, sa.Box((0.1, 0.1, 0.1)), **k), {"pose": (0, 0, 0.1), "frame": None, "touching": ()}),
}


def hostile_call(key: tuple[int, int]) -> tuple[str, dict[str, Any]]:
    """Draw a call, and one or two arguments that are changed."""
    rng = np.random.default_rng(key)
    name = list(CALLS)[rng.integers(len(CALLS))]
    arguments = CALLS[name][1]
    changed = rng.permutation(list(arguments))[: rng.integers(1, 3)].tolist()
    return name, {argument: VALUES[rng.integers(len(VALUES))] for argument in changed}


def finding(name: str, changed: dict[str, Any], *, seconds: float = 20.0) -> tuple[str, str]:
    """Make a call: ("fine", ""), ("refused", the sentence), or what went wrong and where."""
    call, arguments = CALLS[name]

    def stop(*_: Any) -> None:
        raise TimeoutError(f"no answer within {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            call(**{**arguments, **changed})
    except SpacearmError as error:
        return ("refused", str(error)) if "\n" not in str(error) else ("a message of several lines", str(error))
    except BaseException as error:
        return type(error).__name__, "".join(traceback.format_exception(error)[-6:])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    return "fine", ""
