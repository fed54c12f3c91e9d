"""Problem files with anything in any place: each is read, or refused in one line by an error of ours."""

from __future__ import annotations

import copy
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import trimesh
import yaml

from spacearm.core.errors import SpacearmError
from spacearm.files.problem_file import load_problem_file
from support import urdf_text

WHOLE = """
spacearm: 1
robot:
  name: zhang2022
  tip: hand
  velocity_limit: 1.0
  capsules_per_shape: 2
  pieces_per_mesh: {hand: 3}
  excess: 0.1
  self_collision: computed
  holding:
    - {box: {size: [0.1, 0.1, 0.1], rpy_deg: [0, 0, 3]}, frame: hand, position: [0, 0, 0], touching: [hand], name: unit,
       mass: 2}
scene:
  - {name: a, sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}}
  - capsule: {a: [0, 0.9, -0.5], b: [0, 0.9, -0.3], radius: 0.02}
  - box: {size: [0.1, 0.1, 0.1], position: [-0.5, 0.5, 0.5], rpy_deg: [0, 0, 45]}
  - cylinder: {radius: 0.1, length: 0.3, position: [-0.5, 0.5, -0.5], q_wxyz: [1, 0, 0, 0]}
  - half_space: {normal: [0, 0, 1], point: [0, 0, -1]}
  - mesh: {file: a.stl, position: [0, 0, 5], scale: 1, excess: 0.05}
  - points: {file: scan.csv, scale: [1, 1, 2], spheres: 5, point_radius: 0.01}
start: [0, 0, 0, 0, 0, 0, 0]
goal:
  pose: {position: [0.7, 0.3, 0], rpy_deg: [0, 0, 0]}
  position_tolerance: 0.01
  orientation_tolerance_deg: 1
  free_axis: z
  frame: hand
base: floating
base_start: {position: [0, 0, 1], rpy_deg: [0, 0, 90], mass_center: false}
base_goal: {q_wxyz: [1, 0, 0, 0], tolerance_deg: 1}
base_limits: {peak_deg: 2, rate: 1, joint_momentum: 40}
momentum: {linear: [0, 0, 0.1], angular: [0, 0, 0.5]}
duration: 60
planner:
  evaluations: 100
  interior_points: [2, 3]
  weights: {length: 1}
  swarm: {kind: IPSO, inertia: [0.9, 0.4], constraints: {kind: Penalty, weight: 3}}
"""
OTHER = """
spacearm: 1
robot: {file: arm.urdf, fixed: {b: 0.1}}
start: {a: 1}
goal: {configurations: [{a: 1}, [0]], tolerance: [1], shortest: true}
"""
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 7, 0.5, 1e308, -1e308, 1e-320, float("nan"), float("inf"), 10**400, 2**63, -(2**70)),
    *("", " ", "x", "1", "~nobody/x.urdf", "/", "..", "\0", "a\nb", "{x}", "é" * 200, "arm.urdf", "a.stl", "scan.csv"),
    *([], [[]], [None], [1, 2, 3], [1e308] * 3, [float("nan")] * 3, ["a"] * 7, [0] * 7, [[1e-300] * 3]),
    *({}, {"a": 1}, {1: 2}, {None: None}, {"kind": "PSO"}, {"kind": []}, {"": ""}),
)


def places(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if place:
        yield place
    if len(place) < 6:  # a value may contain itself
        for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
            yield from places(value[key], (*place, key))


def inside(value: Any, place: tuple[Any, ...]) -> Any:
    for key in place:
        value = value[key]
    return value


def changed(value: Any, rng: random.Random) -> Any:
    """Return a problem in which up to three places hold something else, are gone, or are an alias of another place."""
    value = copy.deepcopy(value)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        place = rng.choice(list(places(value)))
        parent, key = inside(value, place[:-1]), place[-1]
        kind = rng.random()
        if kind < 0.7:
            parent[key] = copy.deepcopy(rng.choice(VALUES))
        elif kind < 0.8:
            del parent[key]
        elif kind < 0.9:
            parent[key] = inside(value, rng.choice(list(places(value))))
        elif isinstance(parent, dict):
            parent[f"{key}s"] = rng.choice(VALUES)
        if not value:
            return value
    return value


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    trimesh.creation.box((0.2, 0.1, 0.1)).export(tmp_path / "a.stl")
    (tmp_path / "scan.csv").write_text("0.5,0.5,0.5\n0.5,0.51,0.5\n")
    joints = (urdf_text.joint("a", "link_0", "link_1"), urdf_text.joint("b", "link_1", "link_2"))
    (tmp_path / "arm.urdf").write_text(urdf_text.chain(*joints))
    return tmp_path


@pytest.mark.parametrize("seed", range(6))
def test_a_changed_problem_is_read_or_refused_in_one_line(seed: int, folder: Path) -> None:
    rng = random.Random(seed)
    path = folder / "problem.yaml"
    for _ in range(25):
        value = changed(yaml.safe_load(rng.choice((WHOLE, WHOLE, OTHER))), rng)
        text = yaml.safe_dump(value, allow_unicode=True)
        if rng.random() < 0.15:
            text = text[: rng.randrange(len(text))]
        path.write_text(text, encoding="utf-8")
        said = ""
        try:
            load_problem_file(path)
        except SpacearmError as refusal:
            said = str(refusal)
        except Exception as error:
            raise AssertionError(f"of this problem:\n{text}") from error
        assert "\n" not in said, text


def test_both_problems_are_good_before_they_are_changed(folder: Path) -> None:
    for text in (WHOLE, OTHER):
        (folder / "problem.yaml").write_text(text, encoding="utf-8")
        load_problem_file(folder / "problem.yaml")
