"""The page about problem files, their JSON schema and the examples: each is in step with what is read."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

from house.source import REPOSITORY
from spacearm.core.records import as_dict
from spacearm.files.problem_file import load_problem, load_problem_file
from spacearm.files.problem_schema import SCHEMA_FILE, problem_schema
from spacearm.planner import plan
from spacearm.planner.planner_settings import PlannerSettings, Weights
from spacearm.swarm import IPSO, PSO

PAGE = (REPOSITORY / "docs" / "problem_file.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```yaml\n(.*?)```", PAGE, flags=re.DOTALL)
EXAMPLES = sorted((REPOSITORY / "examples").glob("*.yaml"))
BASE = """\
spacearm: 1
robot: {file: arm.urdf, srdf: arm.srdf}
start: {j2: -0.6}
goal: {position: [0.52, 0.2, 0.58]}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with the files that the page names."""
    shutil.copytree(REPOSITORY / "examples", tmp_path, dirs_exist_ok=True)
    return tmp_path


def completed(block: str) -> str:
    """Return a block of the page with what it lacks to be a problem."""
    given, base = yaml.safe_load(block), yaml.safe_load(BASE)
    if "start_deg" in given:
        del base["start"]
    lacking = {key: value for key, value in base.items() if key not in given}
    return block + yaml.safe_dump(lacking) if lacking else block


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_every_example_of_the_page_is_read_and_fits_the_schema(number: int, folder: Path) -> None:
    path = folder / "problem.yaml"
    path.write_text(completed(BLOCKS[number]), encoding="utf-8")
    file = load_problem_file(path)
    assert file.problem.robot.dof in (5, 6, 7)
    _require_fit(yaml.safe_load(path.read_text(encoding="utf-8")))


def test_the_full_example_of_the_page_is_planned(folder: Path) -> None:
    path = folder / "problem.yaml"
    path.write_text(BLOCKS[0], encoding="utf-8")
    assert set(yaml.safe_load(BLOCKS[0])) == {"spacearm", "robot", "scene", "start", "goal", "planner"}
    file = load_problem_file(path)
    found = plan(file.problem, file.settings, rng=0)
    assert found.found, found.message


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_the_examples_are_planned_and_fit_the_schema(path: Path) -> None:
    _require_fit(yaml.safe_load(path.read_text(encoding="utf-8")))
    file = load_problem_file(path)
    found = plan(file.problem, file.settings, rng=0)
    assert found.found, found.message


def test_the_shipped_schema_is_that_of_the_models() -> None:
    text = json.dumps(problem_schema(), indent=2, ensure_ascii=False) + "\n"
    if os.environ.get("UPDATE_SNAPSHOTS"):
        SCHEMA_FILE.write_text(text, encoding="utf-8")
    assert SCHEMA_FILE.read_text(encoding="utf-8") == text, "UPDATE_SNAPSHOTS=1 rewrites it"


def test_the_schema_is_a_schema() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(problem_schema())


WRONG = (
    "robot: {name: zhang2022, file: arm.urdf}",
    "robot: {tip: hand}",
    "robot: [zhang2022]",
    "robot: {name: zhang2022, self_collision: some}",
    "robot: {name: zhang2022, holding: [{half_space: {normal: [0, 0, 1], point: [0, 0, 0]}}]}",
    "scene: [{sphere: {center: [0, 0], radius: 1}}]",
    "scene: [{sphere: {center: [0, 0, 0], radius: '1'}}]",
    "scene: [{name: nothing}]",
    "scene: [{sphere: {center: [0, 0, 0], radius: 1}, box: {size: [1, 1, 1]}}]",
    "start: 0",
    "start_deg: [0, 0, 0, 0, 0, 0]",  # beside start
    "goal: {position: [0, 0, 1], configuration: ready}",
    "goal: {tolerance: 1}",
    "goal: {pose: {position: [0, 0, 1]}}",
    "base: float",
    "base_start: centre",
    "base_start: [0, 0, 1]",
    "base_start: {position: [0, 0, 1], mass_center: true}",
    "base_start: {position: [0, 0]}",
    "base_goal: as it was",
    "base_goal: {tolerance: 1}",
    "base_goal: {as_it_was: true, rpy_deg: [0, 0, 0]}",
    "base_limits: {peek: 1}",
    "momentum: [0, 0, 1]",
    "duration: short",
    "planner: {island: 1}",
    "planner: {weights: {lenght: 1}}",
    "planner: {swarm: {kind: GA}}",
    "planner: {time_law: fast}",
    "planner: {interior_points: []}",
)


@pytest.mark.parametrize("change", WRONG)
def test_the_schema_refuses_what_the_reader_refuses(change: str, folder: Path) -> None:
    from spacearm.core.errors import SpacearmError

    jsonschema = pytest.importorskip("jsonschema")
    value = {**yaml.safe_load(BASE), **yaml.safe_load(change)}
    assert not jsonschema.Draft202012Validator(problem_schema()).is_valid(value)
    (folder / "problem.yaml").write_text(yaml.safe_dump(value), encoding="utf-8")
    with pytest.raises(SpacearmError):
        load_problem(folder / "problem.yaml")


def test_every_key_is_described_in_the_schema_and_on_the_page() -> None:
    schema = problem_schema()
    for name, definition in {"ProblemModel": schema, **schema["$defs"]}.items():
        for key, described in definition["properties"].items():
            assert described.get("description") or key == "kind", (name, key)
            assert f"`{key}`" in PAGE or f"{key}:" in PAGE, (name, key)


def test_the_pages_defaults_are_the_settings() -> None:
    for heading, records in (("key", (PlannerSettings,)), ("key of `weights`", (Weights,)), ("key of `swarm`", (PSO, IPSO))):
        section = PAGE.split("\n## planner")[1].split(f"| {heading} |")[1].split("\n\n")[0]
        rows = [[cell.strip(" `") for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in section.splitlines()[2:]]
        stated = {row[0]: row[2] for row in rows}
        named = {name for record in records for name in as_dict(record())}
        assert set(stated) - {"kind"} == named
        for i, record in enumerate(records):
            for name, value in as_dict(record()).items():
                if not isinstance(value, dict):
                    cell = _one_of_two(stated[name], i)
                    found = yaml.safe_load(cell)
                    assert found == (pytest.approx(value, rel=1e-5) if isinstance(value, float) else value), name


def _one_of_two(cell: str, which: int) -> str:
    """Return PSO's or IPSO's default of `a, b`; lists have commas of their own."""
    parts = re.split(r", (?![^\[]*\])", cell)
    return parts[which if len(parts) > 1 else 0].strip("` ")


def _require_fit(value: Any) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator(problem_schema()).validate(value)
