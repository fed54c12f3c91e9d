"""A problem that is changed and written: it is read back as it was, and what was not changed stays as it was written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import spacearm as sa
from house.source import REPOSITORY
from spacearm.core.errors import OutputError, ProblemError
from spacearm.core.reading import yaml_of_others
from spacearm.files import load_problem, load_problem_file
from spacearm.planner.goals import ConfigurationGoal, PoseGoal, PositionGoal
from spacearm.view.edited_problem import EditedProblem, read_source
from spacearm.view.placements import as_handle
from spacearm.view.problem_text import Edit, dumped, flow, spliced, written
from spacearm.view.problem_values import difference

EXAMPLES = sorted(
    path for path in (REPOSITORY / "examples").glob("*.yaml") if path.read_text(encoding="utf-8").find("\nspacearm: 1") >= 0
)

TEXT = """\
# A comment.
spacearm: 1
robot: zhang2022   # built in
scene:
  - name: mast     # of the client
    box:
      # in block style
      size: [0.1, 0.1, 1.0]
      position: [0.7, 0.7, 0.0]
      rpy_deg: [0, 0, 45]
  - sphere: {radius: 0.1, center: [-0.5, 0.5, 0]}
  - polytope: {vertices: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], position: [-0.6, -0.6, 0.2]}
  - half_space: {normal: [0, 0, 1], point: [0, 0, -1]}
start_deg: {elbow: 30} # degrees

goal:
  configuration_deg: [10, 0, 0, 0, 0, 0, 0]   # at rest
clearance: 0.02 # wide
"""


def edited_of(text: str, folder: Path) -> EditedProblem:
    path = folder / "given.yaml"
    path.write_text(text, encoding="utf-8")
    return EditedProblem.of(read_source(path))


def read_back(edited: EditedProblem, folder: Path) -> tuple[sa.Problem, str]:
    text = edited.as_text(folder)
    (folder / "written.yaml").write_text(text, encoding="utf-8")
    return load_problem(folder / "written.yaml"), text


def same(one: sa.Problem, other: sa.Problem) -> bool:
    """Whether two problems are the same bit for bit, wherever their robots were read from."""
    return replace(one, robot=other.robot) == other


def changed_everywhere(edited: EditedProblem, seed: int) -> EditedProblem:
    rng = np.random.default_rng(seed)
    robot = edited.problem.robot
    low, high = np.maximum(robot.lower, -1), np.minimum(robot.upper, 1)
    edited = edited.with_start(rng.uniform(np.minimum(low, high), high)).with_clearance(0.0123).with_budget(1234, 2.5)
    goal, at = edited.goal_handle(), rng.normal(size=3)
    if isinstance(edited.problem.goal, PoseGoal):
        edited = edited.with_goal_pose(at, rng.normal(size=4))
    elif goal is not None:
        edited = edited.with_goal_position(at)
    for i, movable in enumerate(edited.source.movables):
        if not movable.fixed:
            edited = edited.with_obstacle(i, as_handle(edited.handle(i).position + rng.normal(size=3), rng.normal(size=4)))
    return edited


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_a_changed_example_is_read_back_as_it_was(example: Path, tmp_path: Path) -> None:
    before = EditedProblem.of(read_source(example))
    edited = changed_everywhere(before, 1)
    problem, text = read_back(edited, tmp_path)
    meshes = any("mesh" in line for line in text.splitlines() if "file:" in line)
    assert difference(problem, edited.problem) == ""
    assert meshes or same(problem, edited.problem)
    assert load_problem_file(tmp_path / "written.yaml").settings == edited.settings
    comments = [line.partition("#")[2] for line in example.read_text(encoding="utf-8").splitlines() if "#" in line]
    assert all(comment in text for comment in comments)
    assert difference(before.problem, load_problem(example)) == ""  # nothing was changed in place


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_without_changes_is_written_as_it_is_but_for_paths(example: Path, tmp_path: Path) -> None:
    edited = EditedProblem.of(read_source(example))
    assert edited.as_text(example.parent) == example.read_text(encoding="utf-8")
    problem, _ = read_back(edited, tmp_path)
    assert same(problem, load_problem(example))


def test_what_is_not_changed_keeps_its_words_and_comments(tmp_path: Path) -> None:
    edited = edited_of(TEXT, tmp_path)
    moved = edited.with_obstacle(0, as_handle([0.5, 0.5, 0.0], [1, 0, 0, 0]))
    problem, text = read_back(moved.with_start(np.full(7, 0.25)), tmp_path)
    assert problem.scene.obstacles[0].pose[:3, 3].tolist() == [0.5, 0.5, 0.0]
    wanted = TEXT.replace("position: [0.7, 0.7, 0.0]", "position: [0.5, 0.5, 0.0]")
    wanted = wanted.replace("rpy_deg: [0, 0, 45]", "q_wxyz: [1.0, 0.0, 0.0, 0.0]")
    wanted = wanted.replace("start_deg: {elbow: 30}", "start: [0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25]")
    assert text == wanted


@given(st.integers(0, 10**6))
def test_drawn_changes_are_read_back_bit_for_bit(seed: int) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as name:
        edited = changed_everywhere(edited_of(TEXT, Path(name)), seed)
        q = np.random.default_rng(seed).uniform(-0.2, 0.2, 7)
        edited = edited.with_goal_configuration(q)
        problem, _ = read_back(edited, Path(name))
        assert problem == edited.problem


def test_every_form_of_start_and_goal_is_replaced(tmp_path: Path) -> None:
    q = np.linspace(-0.2, 0.2, 7)
    for start in ("start: [0, 0, 0, 0, 0, 0, 0]", "start:\n  elbow: 0.5\n  wrist_3: 0.1", "start_deg: {elbow: 10}"):
        for goal in (
            "goal: {configuration: {elbow: 1}}",
            "goal:\n  configuration_deg: [0, 0, 0, 0, 0, 0, 0]\n  tolerance: 0.1",
        ):
            edited = edited_of(f"spacearm: 1\nrobot: zhang2022\n{start}\n{goal}\n", tmp_path)
            edited = edited.with_start(q).with_goal_configuration(-q)
            problem, _ = read_back(edited, tmp_path)
            assert problem == edited.problem
            assert isinstance(problem.goal, ConfigurationGoal)
            assert problem.start.tolist() == q.tolist()


def test_a_named_goal_becomes_one_in_numbers(tmp_path: Path) -> None:
    edited = edited_of("spacearm: 1\nrobot: srs7\nbase: fixed\nstart: home\ngoal: home\n", tmp_path)
    q = np.array(edited.problem.start) * 0.9
    problem, text = read_back(edited.with_goal_configuration(q), tmp_path)
    assert problem.goal.q.tolist() == q.tolist()
    assert "start: home\n" in text


def test_values_that_aliases_share_are_written_anew(tmp_path: Path) -> None:
    text = (
        "spacearm: 1\nrobot: zhang2022\nscene:\n  - sphere: &ball {center: [0.5, 0.5, 0], radius: 0.1}\n    name: one\n"
        "  - {name: two, sphere: *ball}\nstart: [0, 0, 0, 0, 0, 0, 0]\ngoal: {position: [0.7, 0.3, 0.0]}\n"
    )
    edited = edited_of(text, tmp_path).with_obstacle(1, as_handle([0.0, 0.9, 0.3], [1, 0, 0, 0]))
    problem, _ = read_back(edited, tmp_path)
    assert problem == edited.problem
    assert problem.scene.obstacles[0].center.tolist() == [0.5, 0.5, 0.0]
    assert problem.scene.obstacles[1].center.tolist() == [0.0, 0.9, 0.3]


def test_a_base_about_the_centre_of_mass_follows_the_start(tmp_path: Path) -> None:
    text = "spacearm: 1\nrobot: srs7\nbase: floating\nbase_start: {mass_center: true, rpy_deg: [10, 20, 30]}\nstart: home\n"
    edited = edited_of(text + "base_goal: as_it_was\ngoal: {position: [0.3, 0.6, 0.5]}\n", tmp_path)
    q = np.array(edited.problem.start) + 0.2
    moved = edited.with_start(q)
    assert np.linalg.norm(moved.problem.base_start - edited.problem.base_start) > 1e-4
    problem, _ = read_back(moved, tmp_path)
    assert problem == moved.problem


def test_obstacles_that_a_file_cannot_move_say_why(tmp_path: Path) -> None:
    for name in ("scan.csv", "antenna.stl"):
        (tmp_path / name).write_bytes((REPOSITORY / "examples" / name).read_bytes())
    text = (
        "spacearm: 1\nrobot: zhang2022\nscene:\n  - points: {file: scan.csv, position: [2, 0, 0]}\n"
        "  - mesh: {file: antenna.stl, spheres: 8, position: [0, 2, 0]}\n"
        "start: [0, 0, 0, 0, 0, 0, 0]\ngoal: {position: [0.7, 0.3, 0.0]}\n"
    )
    edited = edited_of(text, tmp_path)
    for i in (0, 1):
        with pytest.raises(ProblemError, match=r"cannot be moved here: the .* is enclosed in balls"):
            edited.with_obstacle(i, edited.handle(i))
    with pytest.raises(ProblemError, match="obstacle 2 is moved, expected one of 0 to 1"):
        edited.with_obstacle(2, edited.handle(1))


def test_the_problem_of_a_plan_is_written_if_a_file_can_tell_it(tmp_path: Path) -> None:
    robot = sa.load_robot("zhang2022")
    scene = [
        sa.Sphere((0.5, 0.5, 0.0), 0.1, name="ball"),
        sa.Box((0.1, 0.2, 0.3), sa.pose((0.2, 1.2, 0.4), (0.9, 0.1, 0.2, 0.3))),
        sa.Capsule((-1, 0, 0), (-1, 1, 0), 0.05),
        sa.Polytope([(1, 1, 1), (1.1, 1, 1), (1, 1.1, 1), (1, 1, 1.1)]),
        sa.HalfSpace((0, 0, 1), (0, 0, -1)),
    ]
    problem = sa.Problem(robot, scene, start=[0] * 7, goal=PositionGoal((0.7, 0.3, 0.0)), clearance=0.005)
    plan = sa.plan(problem, sa.PlannerSettings(stop_at_first=True), rng=0)
    sa.save_plan(plan, tmp_path / "plan.json")
    edited = EditedProblem.of(read_source(tmp_path / "plan.json"))
    for i in range(5):
        edited = edited.with_obstacle(i, as_handle(edited.handle(i).position + 0.01, [1, 0.1, 0, 0]))
    found, _ = read_back(edited, tmp_path)
    assert difference(found, edited.problem) == ""


def test_the_problem_of_a_plan_that_a_file_cannot_tell_is_refused(tmp_path: Path) -> None:
    robot = sa.load_robot(REPOSITORY / "examples" / "arm.urdf", srdf=REPOSITORY / "examples" / "arm.srdf")
    problem = sa.Problem(robot, [], start=np.zeros(robot.dof), goal=np.full(robot.dof, 0.1))
    sa.save_plan(sa.plan(problem, rng=0), tmp_path / "plan.json")
    with pytest.raises(OutputError, match="expected a built-in one"):
        EditedProblem.of(read_source(tmp_path / "plan.json")).as_text(tmp_path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda edited: edited.with_start([1, 2]), "start is .* expected 7"),
        (lambda edited: edited.with_start([np.nan] * 7), "start is .* expected 7 finite"),
        (lambda edited: edited.with_start("home"), "start is 'home'"),
        (lambda edited: edited.with_clearance(-1), "clearance is -1"),
        (lambda edited: edited.with_budget(0, None), "evaluations is 0"),
        (lambda edited: edited.with_budget(None, np.inf), "time_budget is inf"),
        (lambda edited: edited.with_goal_position([0, 0, 0]), "is a ConfigurationGoal, expected a PoseGoal"),
        (lambda edited: edited.with_goal_configuration([0] * 6), "the goal configuration"),
    ],
)
def test_changes_that_cannot_be_are_refused(change: object, words: str, tmp_path: Path) -> None:
    edited = edited_of(TEXT, tmp_path)
    with pytest.raises(sa.SpacearmError, match=words):
        change(edited)  # type: ignore[operator]


def test_a_start_beyond_a_limit_is_set_onto_it(tmp_path: Path) -> None:
    edited = edited_of(TEXT, tmp_path)
    moved = edited.with_start(np.full(7, 100.0))
    assert moved.problem.start.tolist() == edited.problem.robot.upper.tolist()


# ---- The text ---------------------------------------------------------------------------------------------------------


def value_of(text: str) -> object:
    return yaml_of_others(text, "x", key="spacearm", what="a file").value


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**9), 10**9)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@example({"a": {"False": None, "NULL": 1, "~": 2, "1": 3, "": 4}})
@given(st.dictionaries(st.text("abcdef", min_size=1, max_size=5), plain, max_size=4))
def test_what_is_written_on_one_line_is_read_back(values: dict[str, object]) -> None:
    whole = {"spacearm": 1, **values}
    assert value_of(dumped(whole)) == whole
    assert "\n" not in flow(values)


@given(st.data())
def test_an_edit_in_the_text_and_one_of_the_values_mean_the_same(data: st.DataObject) -> None:
    text = "spacearm: 1\na: {x: 1, y: [1, 2]} # one\nb:\n  c:\n    - z: 1 # two\n      w: old\n    - {}\n  d: text\n"
    file = yaml_of_others(text, "x", key="spacearm", what="a file")
    places = [(), ("a",), ("b",), ("b", "c", 0), ("b", "c", 1)]
    edits = []
    for place in data.draw(st.lists(st.sampled_from(places), unique=True)):
        holder: object = file.value
        for part in place:
            holder = holder[part]  # type: ignore[index]
        known = [key for key in holder if key not in ("spacearm", "a", "b", "c")]  # type: ignore[attr-defined]
        names = data.draw(st.lists(st.sampled_from([*known, "new", "newer"]), unique=True, min_size=1))
        values = {name: data.draw(plain) for name in names}
        drops = tuple(data.draw(st.lists(st.sampled_from(sorted(set(known) - set(names)) or [""]), max_size=1)))
        drops = drops if any(name not in known for name in names) else ()
        edits.append(Edit(place=place, values=values, drops=drops))
    found = spliced(file, text, edits)
    assert found is not None
    assert value_of(found) == value_of(written(file.value, edits))
    assert found.count("#") >= 1 or any(edit.place for edit in edits)
