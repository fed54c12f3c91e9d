"""A problem that is being changed: where it came from, what was changed of it, and how it is written as a problem file.

Everything here is immutable. A change gives a new `EditedProblem`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, OutputError, ProblemError
from spacearm.core.reading import YamlFile, located, read_text, read_yaml, yaml_of_others
from spacearm.core.rotations import quaternion_of
from spacearm.dynamics import base_at_mass_center
from spacearm.files.plan_file import SavedPlan, load_saved_plan
from spacearm.files.problem_file import problem_of
from spacearm.files.scene_file import placed
from spacearm.geometry import Obstacle, Polytope, Scene, pose
from spacearm.planner.goals import ConfigurationGoal, PoseGoal, PositionGoal
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem
from spacearm.view.placements import Handle, Movable
from spacearm.view.problem_text import Edit, dumped, moved_paths, relative_to, spliced, written
from spacearm.view.problem_values import difference, values_of_problem

Array = NDArray[np.float64]

_WHAT = "a problem file"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """Where a problem came from.

    Attributes:
        path: of the file.
        problem, settings: what it holds.
        movables: the obstacles, with how each is moved.
        yaml: a problem file; None: the file is a plan.
        text: of a problem file.
        plan: a plan file; None: the file is a problem.
        turned_about_mass: (4,) the attitude of a base that starts with the centre of mass of arm and base at the inertial
            origin, wherever the arm starts; None: it starts where the problem says.
    """

    path: Path
    problem: Problem
    settings: PlannerSettings
    movables: tuple[Movable, ...]
    yaml: YamlFile | None = None
    text: str = ""
    plan: SavedPlan | None = None
    turned_about_mass: Array | None = None


def read_source(path: Path) -> Source:
    """Read a problem file or a plan file.

    Raises:
        FileFormatError: neither, or a broken one.
        SpacearmError: a robot, scene or problem that cannot be; the place is named.
    """
    if path.suffix.lower() == ".json":
        saved = load_saved_plan(path)
        movables = tuple(Movable(own=item) for item in saved.problem.scene.obstacles)
        return Source(path=path, problem=saved.problem, settings=PlannerSettings(), movables=movables, plan=saved)
    file = read_yaml(path, key="spacearm", what=_WHAT)
    found = problem_of(file)
    return Source(
        path=path,
        problem=found.problem,
        settings=found.settings,
        movables=_movables(file, found.problem),
        yaml=file,
        text=read_text(path, what=_WHAT),
        turned_about_mass=_turned_about_mass(file),
    )


def _movables(file: YamlFile, problem: Problem) -> tuple[Movable, ...]:
    """Return the obstacles of a problem file with how each is moved; a MoveIt scene holds several."""
    from spacearm.files.problem_schema import ProblemModel

    models, obstacles = file.parsed(ProblemModel).scene, list(problem.scene.obstacles)
    others = len(obstacles) - sum(model.moveit is None for model in models)
    out: list[Movable] = []
    for model in models:
        if model.moveit is None:
            out.append(_movable(model, obstacles[len(out)]))
            continue
        if sum(one.moveit is not None for one in models) > 1:
            others = len(_of_moveit(file, model))
        why = f"it is part of the MoveIt scene {model.moveit.file}: move it there"
        out += [Movable(own=item, fixed=why) for item in obstacles[len(out) : len(out) + others]]
    return tuple(out)


def _of_moveit(file: YamlFile, model: Any) -> list[Obstacle]:
    from spacearm.files.scene_file import read_obstacles

    return read_obstacles(file, [model])


def _movable(model: Any, own: Obstacle) -> Movable:
    if model.points is not None or (model.mesh is not None and model.mesh.spheres is not None):
        kind = "the point cloud" if model.mesh is None else "the mesh"
        return Movable(own=own, fixed=f"{kind} is enclosed in balls where the file places it: change its position in the file")
    if model.polytope is not None:
        shape = Polytope(model.polytope.vertices, rounding=model.polytope.rounding, name=own.name)
        return Movable(own=own, file=placed(model.polytope), in_file=shape)
    return Movable(own=own, file=None if model.mesh is None else placed(model.mesh))


def _turned_about_mass(file: YamlFile) -> Array | None:
    from spacearm.files.problem_schema import ProblemModel

    model = file.parsed(ProblemModel).base_start
    return quaternion_of(placed(model)[:3, :3]) if model is not None and model.mass_center else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EditedProblem:
    """A problem with changes.

    Attributes:
        source: where it came from.
        problem, settings: as they are now.
        handles: of the obstacles that were moved, by their place in the scene.
        goal_wxyz: (4,) the orientation of a goal pose that was turned by hand.
        changed: "start", "goal", "clearance" or "planner": what was changed beside obstacles.
        revision: counts the changes.
    """

    source: Source
    problem: Problem
    settings: PlannerSettings
    handles: Mapping[int, Handle] = field(default_factory=dict[int, Handle])
    goal_wxyz: Array | None = None
    changed: frozenset[str] = frozenset()
    revision: int = 0

    @staticmethod
    def of(source: Source) -> EditedProblem:
        """Return the problem as its file has it."""
        return EditedProblem(source=source, problem=source.problem, settings=source.settings)

    def _with(self, what: str, **values: Any) -> EditedProblem:
        return replace(self, changed=self.changed | {what}, revision=self.revision + 1, **values)

    # ---- Changes ------------------------------------------------------------------------------------------------------

    def with_start(self, q: ArrayLike) -> EditedProblem:
        """Return it with the arm starting elsewhere; what is beyond a limit is set onto it.

        Raises:
            ProblemError: q does not fit the robot.
        """
        problem = self.problem
        robot, turned = problem.robot, self.source.turned_about_mass
        q = _as_row("start", q, robot.dof)
        q = np.clip(q, robot.lower, robot.upper)
        moved = {} if turned is None else {"base_start": base_at_mass_center(robot, q, turned)}
        return self._with("start", problem=replace(problem, start=q, **moved))

    def with_goal_position(self, position: ArrayLike) -> EditedProblem:
        """Return it with a goal in space elsewhere, (3,) in the inertial frame [m].

        Raises:
            ProblemError: the goal is a configuration, or no point.
        """
        goal, at = self.problem.goal, _as_row("the goal's position", position, 3)
        if isinstance(goal, PositionGoal):
            return self._with("goal", problem=replace(self.problem, goal=replace(goal, position=at)))
        return self.with_goal_pose(at, self._goal_wxyz())

    def with_goal_pose(self, position: ArrayLike, wxyz: ArrayLike) -> EditedProblem:
        """Return it with the goal's frame at a position (3,) [m] and in an orientation (4,), inertial frame.

        Raises:
            ProblemError: the goal is no pose, or the numbers make none.
        """
        goal = self.problem.goal
        if not isinstance(goal, PoseGoal):
            raise ProblemError(f"the goal is a {type(goal).__name__}, expected a PoseGoal; it has no orientation to be changed")
        q = _as_row("the goal's orientation", wxyz, 4)
        if not 1e-6 < float(np.linalg.norm(q)) < 1e6:
            raise ProblemError(f"the goal's orientation is {shown(q.tolist())}, expected a quaternion of length 1")
        q = q / np.linalg.norm(q)
        turned = replace(goal, pose=pose(_as_row("the goal's position", position, 3), q))
        return self._with("goal", problem=replace(self.problem, goal=turned), goal_wxyz=q)

    def with_goal_configuration(self, q: ArrayLike) -> EditedProblem:
        """Return it with another goal configuration, (n,) [rad or m]; what is beyond a limit is set onto it.

        Raises:
            ProblemError: the goal is in space or several configurations, or q does not fit the robot.
        """
        goal, robot = self.problem.goal, self.problem.robot
        if not isinstance(goal, ConfigurationGoal):
            raise ProblemError(f"the goal is a {type(goal).__name__}, expected one configuration; it is changed by its pose")
        q = np.clip(_as_row("the goal configuration", q, robot.dof), robot.lower, robot.upper)
        return self._with("goal", problem=replace(self.problem, goal=replace(goal, q=q, shortest=False)))

    def with_obstacle(self, index: int, handle: Handle) -> EditedProblem:
        """Return it with an obstacle moved.

        Raises:
            ProblemError: there is no such obstacle, or it cannot be moved.
        """
        movables, obstacles = self.source.movables, list(self.problem.scene.obstacles)
        if not 0 <= index < len(movables):
            raise ProblemError(f"obstacle {index} is moved, expected one of 0 to {len(movables) - 1}")
        if movables[index].fixed:
            raise ProblemError(f"obstacle {self.problem.scene.called(index)} cannot be moved here: {movables[index].fixed}")
        obstacles[index] = movables[index].at(handle)
        problem = replace(self.problem, scene=Scene(obstacles))
        return replace(self, problem=problem, handles={**self.handles, index: handle}, revision=self.revision + 1)

    def with_clearance(self, clearance: float) -> EditedProblem:
        """Return it with another clearance [m].

        Raises:
            ProblemError: below 0, or no number.
        """
        return self._with("clearance", problem=replace(self.problem, clearance=clearance))

    def with_budget(self, evaluations: int | None, seconds: float | None) -> EditedProblem:
        """Return it with another budget of the search: evaluations, and time [s]; None: no limit, or the usual one.

        Raises:
            SettingsError: out of range.
        """
        settings = replace(self.settings, evaluations=evaluations, time_budget=seconds)
        return self._with("planner", settings=settings)

    # ---- What it is now -----------------------------------------------------------------------------------------------

    def handle(self, index: int) -> Handle:
        """Return where the handle of an obstacle is."""
        return self.handles.get(index, self.source.movables[index].first)

    def goal_handle(self) -> Handle | None:
        """Return where a goal in space is; None for a goal in joint space."""
        goal = self.problem.goal
        if isinstance(goal, (PositionGoal, PoseGoal)):
            return Handle(np.array(goal.position), self._goal_wxyz())
        return None

    def _goal_wxyz(self) -> Array:
        goal = self.problem.goal
        if not isinstance(goal, PoseGoal):
            return np.array([1.0, 0.0, 0.0, 0.0])
        return quaternion_of(goal.pose[:3, :3]) if self.goal_wxyz is None else self.goal_wxyz

    @property
    def has_changes(self) -> bool:
        """Whether it differs from what the file has."""
        return bool(self.changed or self.handles)

    # ---- As a problem file --------------------------------------------------------------------------------------------

    def as_text(self, folder: Path) -> str:
        """Return the problem as YAML: what was not changed stays as its file has it. It is read back, and compared.

        Args:
            folder: that the file is to be written to: paths in it are relative to that.

        Raises:
            OutputError: a problem that YAML cannot tell exactly, as one of a plan whose robot is not built in.
        """
        source = self.source
        if source.yaml is None:
            budget = self._budget() if "planner" in self.changed else {}
            return self._checked(dumped(values_of_problem(self.problem, self._goal_wxyz(), budget)), folder)
        edits = [*moved_paths(source.yaml.value, source.path.parent, folder), *self._edits(source.yaml.value)]
        text = spliced(source.yaml, source.text, edits)
        if text is not None:
            try:
                return self._checked(text, folder)
            except (OutputError, FileFormatError):
                pass  # as where an alias stands for a value that was changed
        return self._checked(written(source.yaml.value, edits), folder)

    def _edits(self, value: dict[str, Any]) -> list[Edit]:
        edits: list[Edit] = []
        top: dict[str, Any] = {}
        if "start" in self.changed:
            edits.append(Edit(place=(), values={"start": self.problem.start.tolist()}, drops=("start_deg",)))
        if "clearance" in self.changed:
            top["clearance"] = self.problem.clearance
        if "goal" in self.changed:
            edits.append(self._edit_of_goal(value))
        if "planner" in self.changed:
            budget = self._budget()
            if isinstance(value.get("planner"), dict):
                gone = {key: None for key in ("evaluations", "time_budget") if key in value["planner"]}
                edits.append(Edit(place=("planner",), values=gone | budget))
            else:
                top["planner"] = budget
        if top:
            edits.append(Edit(place=(), values=top))
        for index, handle in sorted(self.handles.items()):
            edits.append(self._edit_of_obstacle(value, index, handle))
        return edits

    def _budget(self) -> dict[str, Any]:
        given = {"evaluations": self.settings.evaluations, "time_budget": self.settings.time_budget}
        return {key: entry for key, entry in given.items() if entry is not None}

    def _edit_of_goal(self, value: dict[str, Any]) -> Edit:
        goal = self.problem.goal
        if isinstance(goal, ConfigurationGoal):
            if not isinstance(value["goal"], dict):
                return Edit(place=(), values={"goal": {"configuration": goal.q.tolist()}})
            shortest = {"shortest": False} if "shortest" in value["goal"] else {}
            return Edit(place=("goal",), values={"configuration": goal.q.tolist(), **shortest}, drops=("configuration_deg",))
        if isinstance(goal, PositionGoal):
            return Edit(place=("goal",), values={"position": goal.position.tolist()})
        handle = self.goal_handle()
        assert handle is not None
        return Edit(
            place=("goal", "pose"),
            values={"position": handle.position.tolist(), "q_wxyz": handle.wxyz.tolist()},
            drops=("rpy_deg",),
        )

    def _edit_of_obstacle(self, value: dict[str, Any], index: int, handle: Handle) -> Edit:
        entry = self._entries(value)[index]
        shape = next(key for key in value["scene"][entry] if key != "name")
        change = self.source.movables[index].edit(handle)
        return Edit(place=("scene", entry, shape), values=change.values, drops=change.drops)

    def _entries(self, value: dict[str, Any]) -> dict[int, int]:
        """Return which entry of the file's scene each obstacle is, those of MoveIt scenes left out."""
        out: dict[int, int] = {}
        free = (i for i, movable in enumerate(self.source.movables) if "MoveIt" not in movable.fixed)
        for entry, item in enumerate(value.get("scene") or ()):
            if "moveit" not in item:
                out[next(free)] = entry
        return out

    def _checked(self, text: str, folder: Path) -> str:
        """Return the text, once it is known to mean this problem.

        Raises:
            OutputError: it does not.
        """
        file = yaml_of_others(text, folder / "problem.yaml", key="spacearm", what=_WHAT)
        with located("what would be written"):
            found = problem_of(file)
        other = difference(found.problem, self.problem)
        if not other and self.source.yaml is not None and found.settings != self.settings:
            other = "planner"
        if other:
            raise OutputError(
                f"a problem file cannot tell this problem: {other} would be read back otherwise; save the plan instead, which "
                "holds everything"
            )
        return text


def file_near(path: Path, folder: Path) -> str:
    """Return what a message calls a file: relative to a folder where it is below that."""
    name = relative_to(path, folder)
    return str(path) if name.startswith("..") else name


def _as_row(name: str, values: ArrayLike, count: int) -> Array:
    try:
        row = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ProblemError(f"{name} is {shown(values)}, expected {count} numbers") from None
    if row.shape != (count,) or not np.isfinite(row).all():
        raise ProblemError(f"{name} is {shown(values)}, expected {count} finite numbers")
    return row
