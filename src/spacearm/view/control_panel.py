"""The controls beside the scene: what to plan, start, goal, obstacles, what is shown, and files.

The panel makes the controls and shows values in them. What a person does there it hands to `Actions`, by viser's threads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import quaternion_of, rotation_from_rpy
from spacearm.planner.goals import ConfigurationGoal, PoseGoal, PositionGoal
from spacearm.view.joint_sliders import JointSliders
from spacearm.view.obstacle_nodes import MANY
from spacearm.view.panel_words import block, row
from spacearm.view.placements import Handle, as_handle
from spacearm.view.reach import Pulled
from spacearm.view.scene_view import SceneView, goal_in_words
from spacearm.view.session import Session

if TYPE_CHECKING:
    from viser import GuiApi

Array = NDArray[np.float64]

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "5", "10")
_NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class Actions:
    """What a person may do; each is called by a thread of viser's.

    Attributes:
        plan, cancel, undo: buttons.
        play: begins or ends playing.
        seek: a time [s].
        start_joint, goal_joint: a joint's place and value [rad or m].
        named_start: the name of a configuration.
        goal: a position and an orientation.
        choose: the place of an obstacle; -1: none.
        obstacle: where the chosen one is.
        clearance, budget, seed: fields.
        pull: whether the tip's handle is shown.
        shown: one of `Shown`, and whether it is.
        save: "problem", "plan" or "report", and the file's name.
    """

    plan: Callable[[], object]
    cancel: Callable[[], object]
    undo: Callable[[], object]
    play: Callable[[], object]
    seek: Callable[[float], object]
    start_joint: Callable[[int, float], object]
    goal_joint: Callable[[int, float], object]
    named_start: Callable[[str], object]
    goal: Callable[[Handle], object]
    choose: Callable[[int], object]
    obstacle: Callable[[Handle], object]
    clearance: Callable[[float], object]
    budget: Callable[[int | None, float | None], object]
    seed: Callable[[int], object]
    pull: Callable[[bool], object]
    shown: Callable[[str, bool], object]
    save: Callable[[str, str], object]


class ControlPanel:
    """The panel of a session.

    Args:
        gui: viser's.
        session: to be shown.
        scene: that belongs to it.
        actions: what a person may do.
    """

    def __init__(self, gui: GuiApi, session: Session, scene: SceneView, actions: Actions) -> None:
        self._gui, self._session, self._actions = gui, session, actions
        self._exact: dict[int, Handle] = {}  # what fields show, with all digits
        self.status = gui.add_html("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Plan"):
            self._plan_tab()
        with tabs.add_tab("Start"):
            self._start_tab()
        with tabs.add_tab("Goal"):
            self._goal_tab()
        with tabs.add_tab("Obstacles"):
            self._obstacles_tab()
        with tabs.add_tab("Files"):
            self._files_tab()
        with tabs.add_tab("View"):
            self._view_tab(scene)
        self.update_problem()

    # ---- Plan and motion ----------------------------------------------------------------------------------------------

    def _plan_tab(self) -> None:
        gui, actions, edited = self._gui, self._actions, self._session.edited
        self.plan = gui.add_button("Plan", hint="Search for a motion and prove it")
        _clicked(self.plan, actions.plan)
        self.cancel = gui.add_button("Cancel", color="gray", disabled=True, hint="End with the best motion so far")
        _clicked(self.cancel, actions.cancel)
        self.job = gui.add_html("")
        self.clearance = self._number("Clearance [mm]", _millimetres(edited.problem.clearance), least=0.0, step=0.5)
        self._on(self.clearance, lambda: actions.clearance(float(self.clearance.value) / 1000))
        self.evaluations = self._number("Evaluations", edited.settings.evaluations or 0, least=0, step=1000)
        self.evaluations.hint = "Motions that the search looks at; 0: no limit beside the time, or the usual 20,000"
        self.seconds = self._number("Time limit [s]", edited.settings.time_budget or 0.0, least=0.0, step=0.5)
        self.seconds.hint = "Planning ends after this time; 0: no limit"
        for field in (self.evaluations, self.seconds):
            self._on(field, self._budget_changed)
        self.seed = self._number("Seed", self._session.seed, least=0, step=1)
        self._on(self.seed, lambda: actions.seed(int(self.seed.value)))
        self.player = gui.add_folder("Motion", visible=self._session.motion is not None)
        with self.player:
            end, step = _clock(1.0 if self._session.motion is None else self._session.motion.duration)
            self.time = gui.add_slider("Time [s]", min=0.0, max=end, step=step, initial_value=0.0)
            self._on(self.time, lambda: actions.seek(float(self.time.value)))
            self.play = gui.add_button("Play")
            _clicked(self.play, actions.play)
            self.speed = gui.add_dropdown("Speed", options=SPEEDS, initial_value="1")
            self.again = gui.add_checkbox("Repeat", initial_value=True)
            self.curve: Any = None
            self.verdict = gui.add_html("")

    def _number(self, label: str, value: float, *, least: float, step: float) -> Any:
        return self._gui.add_number(label, initial_value=value, min=least, step=step)

    def _on(self, field: Any, changed: Callable[[], object]) -> None:
        @field.on_update
        def _(event: Any) -> None:
            if event.client_id is not None:  # else the session itself put it there
                changed()

    def _budget_changed(self) -> None:
        evaluations, seconds = int(self.evaluations.value), float(self.seconds.value)
        self._actions.budget(evaluations or None, seconds or None)

    def put_time(self, t: float, duration: float) -> None:
        """Show a time of the motion [s]."""
        end, step = _clock(duration)
        if self.time.max != end:
            self.time.max, self.time.step = end, step
        _put(self.time, float(np.clip(t, 0.0, self.time.max)))

    # ---- Start --------------------------------------------------------------------------------------------------------

    def _start_tab(self) -> None:
        gui, actions, problem = self._gui, self._actions, self._session.edited.problem
        self.pull = gui.add_checkbox(
            "Pull the tip", initial_value=False, hint="A handle at the end effector: the joints follow"
        )
        self._on(self.pull, lambda: actions.pull(bool(self.pull.value)))
        names = [one.name for one in problem.robot.configurations]
        if names:
            self.named = gui.add_dropdown("Configuration", options=(_NONE, *names), initial_value=_NONE)

            def chosen() -> None:
                if self.named.value != _NONE:
                    actions.named_start(str(self.named.value))

            self._on(self.named, chosen)
        self.start = JointSliders(gui, problem, problem.start, actions.start_joint)
        self.start_note = gui.add_html("")

    def told_of_pull(self, found: Pulled) -> None:
        """Say whether the tip got where it was pulled to, and which joints are at a limit."""
        words = "The tip is where it was pulled to." if found.reached else "The tip gets no nearer."
        if found.limits:
            words += f" At a limit: {', '.join(found.limits)}."
        _set(self.start_note, "content", block([row("", words, "good" if found.reached else "near")]))

    # ---- Goal ---------------------------------------------------------------------------------------------------------

    def _goal_tab(self) -> None:
        gui, actions, edited = self._gui, self._actions, self._session.edited
        gui.add_html(block([row("Goal", goal_in_words(edited))]))
        goal = edited.problem.goal
        self.goal_joints: JointSliders | None = None
        self.goal_at: tuple[Any, Any | None] | None = None
        handle = edited.goal_handle()
        if isinstance(goal, ConfigurationGoal):
            self.goal_joints = JointSliders(gui, edited.problem, goal.q, actions.goal_joint)
        elif handle is not None:
            self.goal_at = self._place_fields(handle, turns=isinstance(goal, PoseGoal), changed=actions.goal)
        else:
            gui.add_html(block([row("", "Several configurations are changed in the file.")]))

    def _place_fields(self, handle: Handle, *, turns: bool, changed: Callable[[Handle], object]) -> tuple[Any, Any | None]:
        """Add fields for a position and an orientation."""
        at = self._gui.add_vector3("Position [m]", initial_value=_rounded(handle.position), step=0.01)
        rpy = self._gui.add_vector3("Turned [deg]", initial_value=_rpy(handle.wxyz), step=1.0) if turns else None
        if rpy is not None:
            rpy.hint = "Turns about the fixed x, then y, then z"

        def now(turned: bool) -> None:
            kept = self._exact.get(id(at), handle)
            wxyz = quaternion_of(rotation_from_rpy(np.radians(rpy.value))) if turned and rpy is not None else kept.wxyz
            position = np.where(np.array(_rounded(kept.position)) == at.value, kept.position, at.value)
            changed(as_handle(position, wxyz))

        self._on(at, lambda: now(False))
        if rpy is not None:
            self._on(rpy, lambda: now(True))
        return at, rpy

    def _put_place(self, fields: tuple[Any, Any | None], handle: Handle) -> None:
        at, rpy = fields
        self._exact[id(at)] = handle
        _put(at, _rounded(handle.position))
        if rpy is not None:
            _put(rpy, _rpy(handle.wxyz))

    # ---- Obstacles ----------------------------------------------------------------------------------------------------

    def _obstacles_tab(self) -> None:
        gui, actions, edited = self._gui, self._actions, self._session.edited
        count = len(edited.problem.scene.obstacles)
        self.chosen = -1
        self._labels = [_NONE, *(_label(edited, i) for i in range(count))]
        if count > MANY:
            self.choice = gui.add_number("Obstacle (-1: none)", initial_value=-1, min=-1, max=count - 1, step=1)
            self._on(self.choice, lambda: actions.choose(int(self.choice.value)))
        else:
            self.choice = gui.add_dropdown("Obstacle", options=tuple(self._labels), initial_value=_NONE)
            self._on(self.choice, lambda: actions.choose(self._labels.index(str(self.choice.value)) - 1))
        self.choice_note = gui.add_html(block([row("", "Click an obstacle, or choose it here, and drag its handle.")]))
        first = Handle(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        self.obstacle_at = self._place_fields(first, turns=True, changed=actions.obstacle)
        for field in self.obstacle_at:
            if field is not None:
                field.visible = False

    def put_choice(self, index: int) -> None:
        """Show which obstacle is chosen; -1: none."""
        edited = self._session.edited
        self.chosen = index
        _put(self.choice, index if not isinstance(self.choice.value, str) else self._labels[index + 1])
        movable = edited.source.movables[index] if index >= 0 else None
        note = "Click an obstacle, or choose it here, and drag its handle." if movable is None else _label(edited, index)
        if movable is not None and movable.fixed:
            note = f"It cannot be moved here: {movable.fixed}."
        self.choice_note.content = block([row("", note, "near" if movable is not None and movable.fixed else "plain")])
        shown = movable is not None and not movable.fixed
        at, rpy = self.obstacle_at
        at.visible = shown
        if rpy is not None:
            rpy.visible = shown and movable is not None and movable.turns
        if shown:
            self._put_place(self.obstacle_at, edited.handle(index))

    # ---- Files and view -----------------------------------------------------------------------------------------------

    def _files_tab(self) -> None:
        gui, actions, session = self._gui, self._actions, self._session
        gui.add_html(block([row("Folder", str(session.folder.path)), row("", "New files only: nothing is overwritten.")]))
        stem = session.edited.source.path.stem
        self.names: dict[str, Any] = {}
        for what, ending, label in (("problem", ".yaml", "Problem"), ("plan", ".json", "Plan"), ("report", ".html", "Report")):
            name = session.folder.free_name(stem if what == "problem" else f"{stem}_{what}", ending)
            self.names[what] = field = gui.add_text(f"{label} as", initial_value=name)
            button = gui.add_button(f"Save {what}", color="gray")
            self._save_button(button, what, field)
        self.saved = gui.add_html("")
        undo = gui.add_button("Undo all changes", color="gray", hint="Back to what the file has")
        _clicked(undo, actions.undo)

    def _save_button(self, button: Any, what: str, field: Any) -> None:
        _clicked(button, lambda: self._actions.save(what, str(field.value)))

    def told_of_save(self, text: str, *, good: bool) -> None:
        """Say what became of a file."""
        self.saved.content = block([row("Saved" if good else "Not saved", text, "good" if good else "bad")])

    def _view_tab(self, scene: SceneView) -> None:
        gui = self._gui
        labels = {
            "ghost": "Arm at the goal",
            "nearest": "Nearest pair",
            "paths": "Paths of tip and base",
            "candidates": "Motions found so far",
            "names": "Names of obstacles",
            "grid": "Grid and axes",
        }
        if scene.has_visuals:
            labels["visuals"] = "As the robot's file draws it"
        self.toggles: dict[str, Any] = {}
        for name, label in labels.items():
            self.toggles[name] = box = gui.add_checkbox(label, initial_value=bool(getattr(scene.shown, name)))
            self._toggle(box, name)
        self.dark = gui.add_checkbox("Dark", initial_value=False)
        self._toggle(self.dark, "dark")
        notes = [*scene.notes, *self._session.edited.problem.robot.notes, *self._session.edited.problem.notes]
        if notes:
            with gui.add_folder("Notes", expand_by_default=False):
                gui.add_html(block([row("", note) for note in notes[:12]]))

    def _toggle(self, box: Any, name: str) -> None:
        self._on(box, lambda: self._actions.shown(name, bool(box.value)))

    # ---- Values -------------------------------------------------------------------------------------------------------

    def update_problem(self) -> None:
        """Show the values of the problem as it is now."""
        edited = self._session.edited
        problem, settings = edited.problem, edited.settings
        _put(self.clearance, _millimetres(problem.clearance))
        _put(self.evaluations, settings.evaluations or 0)
        _put(self.seconds, settings.time_budget or 0.0)
        self.start.put(problem.start)
        if self.goal_joints is not None and isinstance(problem.goal, ConfigurationGoal):
            self.goal_joints.put(problem.goal.q)
        handle = edited.goal_handle()
        if self.goal_at is not None and handle is not None and isinstance(problem.goal, (PositionGoal, PoseGoal)):
            self._put_place(self.goal_at, handle)
        if self.chosen >= 0 and not edited.source.movables[self.chosen].fixed:
            self._put_place(self.obstacle_at, edited.handle(self.chosen))

    def update_job(self, words: str) -> None:
        """Show whether a plan is being made."""
        planning = self._session.is_planning
        _set(self.plan, "disabled", planning)
        _set(self.plan, "label", "Plans ..." if planning else "Plan")
        _set(self.cancel, "disabled", not planning)
        _set(self.job, "content", words)
        _put(self.seed, self._session.seed)


def _clicked(button: Any, action: Callable[[], object]) -> None:
    @button.on_click
    def _(_: Any) -> None:
        action()


def _millimetres(length: float) -> float:
    return round(length * 1e3, 9)


def _clock(duration: float) -> tuple[float, float]:
    """Return the end of the time's slider, and its step [s]: round numbers."""
    step = float(10.0 ** np.floor(np.log10(max(duration, 1e-3) / 500)))
    return float(np.round(np.ceil(max(duration, 1e-3) / step) * step, 9)), step


def _put(field: Any, value: Any) -> None:
    if field.value != value:
        field.value = value


def _set(field: Any, name: str, value: Any) -> None:
    if getattr(field, name) != value:
        setattr(field, name, value)


def _label(edited: Any, index: int) -> str:
    item = edited.problem.scene.obstacles[index]
    return f"{index}: {item.name or type(item).__name__}"


def _rounded(position: Array) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 4) + 0.0 for value in position)
    return x, y, z


def _rpy(wxyz: Array) -> tuple[float, float, float]:
    """Return the turns about the fixed x, y and z of a quaternion, in degrees to a hundredth."""
    w, x, y, z = wxyz
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    a, b, c = (round(float(np.degrees(value)), 2) + 0.0 for value in (roll, pitch, yaw))
    return a, b, c
