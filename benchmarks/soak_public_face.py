"""Look for a public name that answers wrong input with anything else than a `SpacearmError` in one sentence.

    python benchmarks/soak_public_face.py --count 20000 --seed 1

Each call is a good one with one argument, or one entry of it, replaced: by another type, no number, far too many or too large
numbers, another shape. What raises something else, warns, or takes longer than 20 s is printed so that it can be pasted.
A small share of this runs in the tests.
"""

from __future__ import annotations

import copy
import os
import signal
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import spacearm as sa

if TYPE_CHECKING:
    from fault_search import Case, Outcome

LONGEST = 20  # [s] of a call

JUNK: dict[str, Any] = {
    "None": None,
    "True": True,
    "'a'": "a",
    "''": "",
    "b'x'": b"x",
    "nan": float("nan"),
    "inf": float("inf"),
    "-1": -1,
    "0": 0,
    "0.5": 0.5,
    "1e300": 1e300,
    "-1e-300": -1e-300,
    "10**400": 10**400,
    "2**63": 2**63,
    "1j": 1j,
    "[]": [],
    "[[]]": [[]],
    "[None]": [None],
    "{}": {},
    "{'a': 1}": {"a": 1},
    "set()": set(),
    "object()": object(),
    "int": int,
    "lambda: 0": lambda: 0,
    "np.zeros(0)": np.zeros(0),
    "np.zeros((2, 3, 4))": np.zeros((2, 3, 4)),
    "np.zeros((0, 7))": np.zeros((0, 7)),
    "np.full(7, np.nan)": np.full(7, np.nan),
    "np.full((4, 4), 1e300)": np.full((4, 4), 1e300),
    "np.array(['a'])": np.array(["a"]),
    "np.array([None])": np.array([None]),
    "np.array([1j])": np.array([1j]),
    "np.datetime64(0, 's')": np.datetime64(0, "s"),
    "[[1, 2], [3]]": [[1, 2], [3]],
    "range(3)": range(3),
    "Path('/nowhere')": Path("/nowhere"),
    "'\\ud800'": "\ud800",
    "'a\\0b'": "a\0b",
    "(x for x in ())": (x for x in ()),
    "SpacearmError('a')": sa.SpacearmError("a"),
}


@dataclass(frozen=True)
class Call:
    """A good call: what, by which name, and its arguments."""

    name: str
    what: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    named: dict[str, Any] | None = None


def square(x: Any) -> Any:
    """Return an objective that is quick."""
    return (x**2).sum(axis=1)


@cache
def calls(folder: Path) -> list[Call]:
    """Return a good call of every public function, class and method that takes anything."""
    robot = sa.load_robot("srs7")
    home, goal = robot.configuration("home"), robot.configuration("home") + 0.1
    quick = sa.PlannerSettings(evaluations=30)
    box = sa.Box((0.1, 0.1, 0.1), (2.0, 2.0, 2.0), name="box")
    problem = sa.Problem(robot, [box], start=home, goal=goal)
    plan = sa.plan(problem, quick, rng=0)
    motion = sa.Motion([home, goal])
    trajectory = sa.Trajectory(robot, motion)
    path = sa.PiecewisePath.from_linear([0.0, 1.0], [home, goal])
    recorded = sa.RecordedTrajectory(robot, path)
    law = sa.TimeLaw([0.0, 1.0], [[0.0, 0.0, 1.0, 1.0]])
    floating = sa.Problem(robot, [], start=home, goal=goal, base="floating")
    held = sa.Problem(robot, [box], start=home, goal=goal, base="fixed")
    of_held = sa.Trajectory(robot, motion, base="fixed")
    body = robot.bodies[0]
    sa.save_plan(plan, folder / "plan.json")
    (folder / "problem.yaml").write_text("spacearm: 1\nrobot: srs7\nstart: home\ngoal: {position: [0.5, 0.2, 0.3]}\n")
    (folder / "t.csv").write_text("t," + ",".join(robot.dof_names) + "\n0" + ",0" * 7 + "\n1" + ",0.1" * 7 + "\n")
    (folder / "arm.urdf").write_text(
        '<robot name="r"><link name="base"/><link name="a"/><joint name="j" type="revolute"><parent link="base"/>'
        '<child link="a"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
    )
    (folder / "scene.yaml").write_text("name: s\nworld: {collision_objects: []}\nrobot_model_name: srs7\n")
    tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (folder / "part.obj").write_text(tetrahedron)
    limits = {"lower": [-1.0], "upper": [1.0], "velocity": [1.0], "acceleration": [1.0]}
    joint = sa.Joint(name="j", kind="revolute", parent=-1, T_parent_joint=np.eye(4))
    frame = sa.Frame(name="tip", joint=0, T_joint_frame=np.eye(4))
    swarm = sa.Swarm([-1.0, -1.0], [1.0, 1.0], sa.PSO(particles=5, iterations=3), rng=0)
    judging = sa.MotionSwarm(problem, goal=goal, rng=0)
    asked = judging.ask()
    at = ("sample", "tip", "base_pose", "base_rate", "time_at")
    new = {"count": 0}

    def fresh(save: Callable[..., Any]) -> Callable[..., Any]:
        def run(first: Any, path: Any, *rest: Any, **named: Any) -> Any:
            new["count"] += 1
            where = Path(path) / f"new{new['count']}" if isinstance(path, Path) and path == folder else path
            return save(first, where, *rest, **named)

        return run

    def asking(**given: Any) -> Any:
        fresh_swarm = sa.MotionSwarm(**{"problem": problem, "goal": goal, "rng": 0, **given})
        return fresh_swarm.ask()

    def telling(fitness: Any, violation: Any) -> Any:
        one = sa.Swarm([-1.0, -1.0], [1.0, 1.0], sa.PSO(particles=5, iterations=3), rng=0)
        one.ask()
        return one.tell(fitness, violation)

    return [
        Call("Sphere", sa.Sphere, ((0.0, 0.0, 0.0), 0.1), {"name": "a"}),
        Call("Capsule", sa.Capsule, ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.1), {"name": "a"}),
        Call("Box", sa.Box, ((0.1, 0.1, 0.1), np.eye(4)), {"name": "a"}),
        Call("Cylinder", sa.Cylinder, (0.1, 1.0, (0.0, 0.0, 0.0)), {"name": "a"}),
        Call("HalfSpace", sa.HalfSpace, (), {"normal": (0, 0, 1.0), "point": (0, 0, 0.0), "name": "a"}),
        Call("Scene", sa.Scene, ([box],)),
        Call("pose", sa.pose, ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))),
        Call("SphereSet", sa.SphereSet, (), {"centers": np.zeros((2, 3)), "radii": np.ones(2), "excess": 0.1}),
        Call("Polytope", sa.Polytope, (np.eye(4, 3),), {"rounding": 0.1, "name": "a"}),
        Call("PolytopeSet", sa.PolytopeSet, ([sa.Polytope(np.eye(4, 3))],), {"excess": 0.1, "name": "a"}),
        Call("convex_pieces", sa.convex_pieces, (folder / "part.obj",), {"pieces": 2, "excess": 0.2, "scale": 1.0}),
        Call("enclose_points", sa.enclose_points, (np.eye(3),), {"point_radius": 0.01, "excess": 0.1}),
        Call("enclose_mesh", sa.enclose_mesh, (folder / "part.obj",), {"excess": 0.2, "scale": 1.0}),
        Call("load_robot", sa.load_robot, ("srs7",), {}),
        Call(
            "load_robot", sa.load_robot, (folder / "arm.urdf",),
            {"tip": "a", "velocity_limit": 1.0, "acceleration_limit": 1.0, "fixed": {}, "capsules_per_shape": 2},
        ),
        Call("Joint", sa.Joint, (), {
            "name": "j", "kind": "revolute", "parent": -1, "T_parent_joint": np.eye(4), "dof": 0, "multiplier": 1.0,
            "offset": 0.0,
        }),
        Call("Frame", sa.Frame, (), {"name": "tip", "joint": 0, "T_joint_frame": np.eye(4)}),
        Call("LinkShape", sa.LinkShape, (), {"name": "l", "joint": 0, "shape": sa.Box((0.1, 0.1, 0.1))}),
        Call("LinkCapsule", sa.LinkCapsule, (), {"name": "l", "joint": 0, "a": (0, 0, 0.0), "b": (1.0, 0, 0), "radius": 0.1}),
        Call("Body", sa.Body, (), {"name": "b", "joint": 0, "mass": body.mass, "com": body.com, "inertia": body.inertia}),
        Call("NamedConfiguration", sa.NamedConfiguration, (), {"name": "home", "q": [0.0]}),
        Call("Robot", sa.Robot, (), {
            "name": "r", "joints": (joint,), "frames": (frame,), "tip": "tip", "capsules": (), "bodies": (), **limits,
        }),
        Call("Robot.configuration", robot.configuration, ("home",)),
        Call("forward_kinematics", sa.forward_kinematics, (robot, home), {"frame": None}),
        Call("find_self_pairs", sa.find_self_pairs, (robot,)),
        Call("envelope_report", sa.envelope_report, (folder / "arm.urdf",)),
        Call("diagnose", sa.diagnose, (folder / "arm.urdf",), {"base": "fixed"}),
        Call("mend_urdf", fresh(sa.mend_urdf), (folder / "arm.urdf", folder)),
        Call("hold", sa.hold, (robot, box), {"frame": "tip", "touching": [], "name": "unit"}),
        Call("Momentum", sa.Momentum, (), {"linear": (0, 0, 0.0), "angular": (0, 0, 0.1)}),
        Call("momentum_map", sa.momentum_map, (robot, home)),
        Call("base_rate", sa.base_rate, (robot, home, home)),
        Call("center_of_mass", sa.center_of_mass, (robot, home)),
        Call("base_at_mass_center", sa.base_at_mass_center, (robot, home)),
        Call("system_mass", sa.system_mass, (robot,)),
        Call("BaseMotion", sa.BaseMotion, (robot, motion), {"base_start": np.eye(4), "duration": 1.0}),
        Call("Motion", sa.Motion, ([home, goal],)),
        Call("Motion.sample", motion.sample, (0.5, 1)),
        Call("PiecewisePath", sa.PiecewisePath, ([0.0, 1.0], np.zeros((1, 2, 7)))),
        Call("PiecewisePath.from_linear", sa.PiecewisePath.from_linear, ([0.0, 1.0], [home, goal])),
        Call("PiecewisePath.from_cubic", sa.PiecewisePath.from_cubic, ([0.0, 1.0], [home, goal], [home, home])),
        Call("PiecewisePath.from_quintic", sa.PiecewisePath.from_quintic, ([0.0, 1.0], *[[home, goal]] * 3)),
        Call("PiecewisePath.sample", path.sample, (0.5, 1)),
        Call("TimeLaw", sa.TimeLaw, ([0.0, 1.0], [[0.0, 0.0, 1.0, 1.0]])),
        Call("TimeLaw.sample", law.sample, (0.5, 1)),
        Call("TimeLaw.inverse", law.inverse, (0.5,)),
        Call("Trajectory", sa.Trajectory, (robot, motion), {
            "duration": 9.0, "time_law": law, "base": "fixed", "base_start": np.eye(4), "momentum": None, "notes": (),
        }),
        *(Call(f"Trajectory.{name}", getattr(trajectory, name), (0.5,)) for name in at),
        Call("Trajectory.margins", trajectory.margins, (robot,), {"jerk_limit": 1.0}),
        Call("RecordedTrajectory", sa.RecordedTrajectory, (robot, path), {"base": "fixed", "notes": ()}),
        *(Call(f"RecordedTrajectory.{name}", getattr(recorded, name), (0.5,)) for name in at),
        Call("time_optimal", sa.time_optimal, (robot, motion), {"jerk_limit": 5.0}),
        Call("resampled", sa.resampled, (trajectory,), {"rate_hz": 10.0}),
        Call("load_trajectory", sa.load_trajectory, (robot, folder / "t.csv"), {
            "interpolation": "linear", "time_unit": "s", "base": "fixed", "base_start": np.eye(4), "momentum": None,
        }),
        Call("write_aem", fresh(sa.write_aem), (trajectory, folder), {"step": 0.1, "object_name": "a", "start_epoch": None}),
        Call("write_ros_trajectory", fresh(sa.write_ros_trajectory), (trajectory, folder), {"step": 0.1, "frame_id": "a"}),
        Call("ConfigurationGoal", sa.ConfigurationGoal, (goal,), {"tolerance": 0.1}),
        Call("ConfigurationsGoal", sa.ConfigurationsGoal, ([goal],), {"tolerance": 0.1}),
        Call("PositionGoal", sa.PositionGoal, ((0.5, 0.2, 0.3),), {"tolerance": 0.01, "frame": "tip"}),
        Call("PoseGoal", sa.PoseGoal, (np.eye(4),), {
            "position_tolerance": 0.1, "orientation_tolerance": 0.1, "free_axis": "z",
        }),
        Call("PairClearance", sa.PairClearance, (0.05,), {"obstacle": "box", "link": None, "other_link": None}),
        Call("AttitudeGoal", sa.AttitudeGoal, ((1.0, 0, 0, 0),), {"tolerance": 0.1}),
        Call("BaseLimits", sa.BaseLimits, (), {"final": 0.1, "peak": 0.1, "rate": 0.1, "joint_momentum": 0.1}),
        Call("Weights", sa.Weights, (), {"length": 1.0, "duration": 0.1, "clearance": 0.1, "base_peak": 0.1}),
        Call("PlannerSettings", sa.PlannerSettings, (), {
            "evaluations": 30, "weights": sa.Weights(), "time_law": "uniform", "threads": 1, "islands": 1,
            "interior_points": (2, 3), "preferred_clearance": 0.1, "goal_candidates": 3, "proofs": 3,
        }),
        Call("Problem", sa.Problem, (robot, [box]), {
            "start": home, "goal": goal, "base": "floating", "base_start": np.eye(4), "duration": 99.0,
            "clearance": 0.01, "clearances": (), "snap_tolerance": 1e-5,
            "momentum": sa.Momentum(), "base_goal": None, "base_limits": sa.BaseLimits(),
        }),
        Call("clearance", sa.clearance, (problem, home)),
        Call("plan", sa.plan, (problem, quick), {"rng": 0}),
        Call("pareto_front", sa.pareto_front, (floating, quick), {"points": 2, "rng": 0}),
        Call("save_plan", fresh(sa.save_plan), (plan, folder)),
        Call("save_report", fresh(sa.save_report), (plan, folder)),
        Call("save_glb", fresh(sa.save_glb), (plan, folder)),
        Call("load_plan", sa.load_plan, (folder / "plan.json", problem)),
        Call("load_saved_plan", sa.load_saved_plan, (folder / "plan.json",)),
        Call("load_problem", sa.load_problem, (folder / "problem.yaml",)),
        Call("load_moveit_scene", sa.load_moveit_scene, (folder / "scene.yaml",)),
        Call("load_moveit", sa.load_moveit, (robot, folder / "scene.yaml", folder / "scene.yaml")),
        Call("certify", sa.certify, (problem, trajectory), {
            "limits": ("position",), "jerk_limit": 99.0, "clearance": 0.0, "resolution": 1e-3, "tracking": 0.0, "proof": None,
        }),
        Call("robustness", sa.robustness, (held, of_held), {"joints": "all", "singly": False, "resolution": 0.5}),
        Call("MotionSwarm", asking, (), {"problem": problem, "goal": goal, "settings": quick, "rng": 0}),
        Call("MotionSwarm.judge", judging.judge, (asked,)),
        Call("PSO", sa.PSO, (), {"particles": 5, "iterations": 3, "neighbours": 2, "inertia": 0.7}),
        Call("IPSO", sa.IPSO, (), {"particles": 6, "iterations": 3}),
        Call("FeasibleFirst", sa.FeasibleFirst, (), {"forgiven": 0.5, "power": 2}),
        Call("Penalty", sa.Penalty, (), {"weight": 1.0}),
        Call("Swarm", sa.Swarm, ([-1.0, -1.0], [1.0, 1.0], sa.PSO(particles=5, iterations=3)), {"rng": 0}),
        Call("Swarm.tell", telling, (np.zeros(5), np.zeros(5))),
        Call("Swarm.load", sa.Swarm.load, (folder / "plan.json",)),
        Call("Swarm.save", lambda path: fresh(lambda _, where: swarm.save(where))(None, path), (folder,)),
        Call("minimize", sa.minimize, (square, [-1.0, -1.0], [1.0, 1.0], sa.PSO(particles=5, iterations=3)), {"rng": 0}),
        Call("named_settings", sa.named_settings, ("ring",)),
    ]  # fmt: skip


def spoilt(call: Call, rng: np.random.Generator) -> tuple[str, tuple[Any, ...], dict[str, Any]]:
    """Return what is wrong, and the arguments of a call with it."""
    arguments, named = list(call.arguments), dict(call.named or {})
    keys: list[Any] = [*range(len(arguments)), *named]
    key = keys[int(rng.integers(len(keys)))]
    text = list(JUNK)[int(rng.integers(len(JUNK)))]
    junk = JUNK[text]
    holder: Any = arguments if isinstance(key, int) else named
    whole = holder[key]
    if isinstance(whole, (list, tuple, np.ndarray)) and len(whole) and rng.random() < 0.3:
        inner = whole.tolist() if isinstance(whole, np.ndarray) else copy.copy(list(whole))
        at = int(rng.integers(len(inner)))
        inner[at] = junk
        holder[key] = tuple(inner) if isinstance(whole, tuple) else inner
        return f"argument {key!r}: {text} at {at}", tuple(arguments), named
    holder[key] = junk
    return f"argument {key!r}: {text}", tuple(arguments), named


def fault(folder: Path, seed: int, number: int) -> tuple[str, str, str] | None:
    """Make a wrong call drawn from a seed and a number.

    Returns:
        Its name, what was wrong with it, and what came of it; None where that is a result or a `SpacearmError`.
    """
    rng, good = np.random.default_rng((seed, number)), calls(folder)
    call = good[int(rng.integers(len(good)))]
    what, arguments, named = spoilt(call, rng)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            _timed(call.what, arguments, named)
    except sa.SpacearmError as error:
        return (call.name, what, f"more than a line: {error}") if "\n" in str(error) else None
    except Exception as error:
        return call.name, what, f"{type(error).__name__}: {error}"
    return None


def faults(folder: Path, *, count: int, seed: int) -> Iterator[tuple[str, str, str]]:
    """Yield the faults of so many calls."""
    for number in range(count):
        found = fault(folder, seed, number)
        if found is not None:
            yield found


def _timed(what: Callable[..., Any], arguments: tuple[Any, ...], named: dict[str, Any]) -> None:
    def late(*_: object) -> None:
        raise TimeoutError(f"more than {LONGEST} s")

    if not hasattr(signal, "SIGALRM"):
        what(*arguments, **named)
        return
    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(LONGEST)
    try:
        what(*arguments, **named)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@cache
def place() -> tempfile.TemporaryDirectory[str]:
    """Make a folder and go there: a wrong path may be a good name for a file."""
    folder = tempfile.TemporaryDirectory()
    os.chdir(folder.name)
    return folder


def look(case: Case) -> Outcome:
    """Make a wrong call."""
    from fault_search import Outcome

    found = fault(Path(place().name), case.seed, case.number)
    if found is None:
        return Outcome(became=["fine"])
    name, what, came = found
    return Outcome(became=[name], complaints=[f"{name}, {what} -> {came[:160]}"])


def main() -> int:
    """Run from the command line."""
    from fault_search import search

    return search(look, doc=__doc__, what="calls", count=10_000, memory=None)


if __name__ == "__main__":
    sys.exit(main())
