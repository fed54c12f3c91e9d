"""Every public value, and what its attributes return, is printed in eight lines of 120 columns; so are hostile ones."""

from __future__ import annotations

import ast
import dataclasses
import importlib.util
import inspect
import sys
from collections import deque
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from house.source import PACKAGE, REPOSITORY, python_files, room
from spacearm.core.brief import COLUMNS, LINES

_MEMBERS = 3  # of a tuple or a mapping
_DEEPEST = 5
_ABOVE = ("cli", "study", "view", "")  # rooms whose values are not public


def printed(value: Any) -> str:
    """Return what is printed, once it is known to fit."""
    text = repr(value)
    lines = text.split("\n")
    what = type(value).__qualname__
    assert len(lines) <= LINES, f"{what} takes {len(lines)} lines:\n{text[:3000]}"
    assert max(map(len, lines)) <= COLUMNS, f"{what} is {max(map(len, lines))} columns wide:\n{text[:3000]}"
    assert "".join(lines).isprintable(), f"{what}: {text[:300]!r}"
    return text


def ours(value: Any) -> bool:
    """Whether a value is of a class of this package, and no exception."""
    return type(value).__module__.startswith("spacearm.") and not isinstance(value, BaseException)


def inside(value: Any) -> list[Any]:
    """Return what the public attributes of a value return, its properties included, or the first members."""
    if isinstance(value, (tuple, list, frozenset, set)) and not hasattr(value, "_fields"):
        return list(value)[:_MEMBERS]
    if isinstance(value, dict):
        return list(value.values())[:_MEMBERS]
    if not ours(value):
        return []
    names = {name for name in dir(value) if not name.startswith("_")}
    if dataclasses.is_dataclass(value):
        names |= {one.name for one in dataclasses.fields(value) if not one.name.startswith("_")}
    out = []
    for name in sorted(names):
        try:
            got = getattr(value, name)
        except sa.SpacearmError:
            continue  # of a motion without end, or of one that takes no time
        if not callable(got) and not inspect.ismodule(got):
            out.append(got)
    return out


def walked(roots: list[Any]) -> set[str]:
    """Print all that is reached from some values, and return the names of the classes."""
    seen, classes = set[int](), set[str]()
    kept, left = [], deque((value, 0) for value in roots)
    while left:
        value, depth = left.popleft()
        if id(value) in seen or depth > _DEEPEST:
            continue
        seen.add(id(value))
        kept.append(value)  # so that no other value has its id
        if ours(value) and not type(value).__module__.startswith("spacearm._kernel"):
            printed(value)
            classes.add(type(value).__name__)
        left.extend((one, depth + 1) for one in inside(value))
    return classes


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """Return what every public function and class makes."""
    path = REPOSITORY / "benchmarks" / "soak_public_face.py"
    spec = importlib.util.spec_from_file_location("soak_public_face", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["soak_public_face"] = module
    spec.loader.exec_module(module)
    refused = {"Swarm.load", "load_moveit"}  # for want of a good file
    calls = module.calls(tmp_path_factory.mktemp("made"))
    return [call.what(*call.arguments, **(call.named or {})) for call in calls if call.name not in refused]


def test_every_public_value_is_printed_in_few_lines(made: list[Any]) -> None:
    named = sa.named_settings("ring")
    robot = sa.load_robot("srs7")
    home = robot.configuration("home")
    missed = sa.plan(sa.Problem(robot, [sa.Sphere((0, 0, 0.5), 0.4)], start=home, goal=home + 0.1), rng=0)
    swarm = sa.MotionSwarm(missed.problem, goal=home + 0.1, rng=0)
    envelopes = sa.envelope_report(REPOSITORY / "examples" / "arm.urdf")
    classes = walked([*made, named, missed, swarm, envelopes, sa.kernel_info()])
    public = {name for name in sa.__all__ if isinstance(getattr(sa, name), type)} - {"SpacearmError"}
    assert public <= classes, f"none of these was printed: {sorted(public - classes)}"
    assert {"JointState", "Improvement", "EndReport", "ClosestApproach", "LimitMargins", "ProofTree", "Tube"} <= classes


def test_no_public_record_is_printed_by_its_dataclass() -> None:
    """A dataclass writes a __repr__ of its own unless it is told not to."""
    wrong = []
    for path in python_files():
        if room(path) in (*_ABOVE, "_kernel"):
            continue
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            bases = {ast.unparse(base) for base in getattr(node, "bases", ())}
            if isinstance(node, ast.ClassDef) and bases & {"Brief", "Frozen", "OnABase", "_WithLocal"}:
                for call in node.decorator_list:
                    if "dataclass(" in ast.unparse(call) and "repr=False" not in ast.unparse(call):
                        wrong.append(f"{path.relative_to(PACKAGE)}: {node.name}")
    assert not wrong, f"write @dataclass(..., repr=False): {wrong}"


LONG = "long name \x1b[31m\n" * 300


def test_hostile_values_are_printed_in_few_lines() -> None:
    robot = sa.load_robot("srs7")
    home = robot.configuration("home")
    joints = tuple(dataclasses.replace(one, name=f"{LONG}{i}") for i, one in enumerate(robot.joints))
    odd = dataclasses.replace(robot, name=LONG, joints=joints, dof_names=(), notes=(LONG,) * 500, source=LONG)
    many = [sa.Sphere((5.0 + 0.001 * i, 5, 5), 0.01, name=f"{LONG}{i}") for i in range(3000)]
    points = np.random.default_rng(0).normal(size=(5000, 3))
    problem = sa.Problem(odd, many, start=home, goal=home + 0.1, base="fixed", notes=[LONG] * 50)
    plan = sa.plan(dataclasses.replace(problem, scene=sa.Scene(many[:2])), sa.PlannerSettings(evaluations=30), rng=0)
    path = sa.PiecewisePath(np.arange(2001.0), np.zeros((2000, 6, 7)))
    values = [
        odd,
        problem,
        problem.scene,
        plan,
        plan.certificate,
        plan.trajectory,
        dataclasses.replace(plan, advice=LONG, timings={LONG: 1.0}, trajectory=None, certificate=None),
        sa.Polytope(points, name=LONG),
        sa.SphereSet(points + 9, np.full(5000, 0.1), name=LONG),
        sa.Scene([sa.Polytope(points, name=LONG)] * 3),
        path,
        sa.RecordedTrajectory(odd, path, base="fixed", notes=(LONG,) * 99, contradictions=(LONG,) * 9),
        sa.NamedConfiguration(name=LONG, q=np.zeros(500)),
        sa.ConfigurationsGoal(np.zeros((400, 7))),
        sa.Swarm(-np.ones(5000), np.ones(5000), sa.PSO(particles=5, iterations=3), rng=0),
        sa.minimize(lambda x: x.sum(axis=1), -np.ones(900), np.ones(900), sa.PSO(particles=5, iterations=3), rng=0),
    ]
    walked([value for value in values if value is not odd])
    assert all(printed(value) for value in values)
    assert "\x1b" not in "".join(map(repr, values))


def test_what_is_printed_of_a_plan_is_what_a_user_wants_to_know() -> None:
    robot = sa.load_robot("srs7")
    home = robot.configuration("home")
    plan = sa.plan(sa.Problem(robot, [sa.Sphere((0.5, 0.5, 0), 0.1, name="ball")], start=home, goal=home + 0.3), rng=0)
    text = printed(plan)
    assert text.startswith("<Plan found: robot 'srs7', 1 obstacle, floating base\n")
    for part in ("10 mm asked for", "proven", "joint path", "seed 0", "deg at most", "first motion after"):
        assert part in text
    assert repr([plan]).startswith("[<Plan found")
