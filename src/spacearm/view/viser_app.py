"""The viewer: a session, its scene and its panel, and what happens when somebody does something in a browser.

viser calls from its own threads. They only leave word with one worker, which changes the session and draws: so two browsers
never change something at once, and of a flood of events the latest counts. What takes longer, whether the goal can be reached
and the curve of a motion, is done by a second worker.
"""

from __future__ import annotations

import contextlib
import sys
import traceback
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import SpacearmError
from spacearm.core.rotations import quaternion_of
from spacearm.view.clearance_curve import ClearanceCurve
from spacearm.view.colors import BRAND
from spacearm.view.control_panel import Actions, ControlPanel
from spacearm.view.latest_worker import LatestWorker
from spacearm.view.nearest import Nearest, nearest
from spacearm.view.panel_words import job_html, status_html, verdict_html
from spacearm.view.placements import Handle, as_handle
from spacearm.view.reach import Reachable
from spacearm.view.scene_view import SceneView
from spacearm.view.session import Change, Session

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

_SHOWN_FOR = 8.0  # [s] of a notification


class ViewerApp:
    """A session in browsers.

    Args:
        session: the state.
        server: viser's, started.
    """

    def __init__(self, session: Session, server: ViserServer) -> None:
        self.session, self._server = session, server
        self._playing, self._moving, self._t = False, session.motion is not None, 0.0
        self._reach: Reachable | None = None
        self._near: Nearest | None = None
        self._dragged: set[str] = set()
        self._theme(dark=False)
        self._lay_out()
        self.scene = SceneView(server, session.edited)
        self._work = LatestWorker("spacearm-view", self._failed, self._tick)
        self._slow = LatestWorker("spacearm-view-reach", self._failed)
        self.panel = ControlPanel(server.gui, session, self.scene, self._actions())
        self._curve = ClearanceCurve(server.gui, self.panel.player)
        self._bind_handles()
        self.scene.obstacles.on_click(lambda index: self._do("choose", partial(self._choose, index)))
        session.listen(self._changed)
        self._work.post("first", self._first)

    def close(self) -> None:
        """End all work."""
        self.session.close()
        self._work.close()
        self._slow.close()

    def settle(self, seconds: float = 10.0) -> bool:
        """Wait until what was asked for is done, and return whether it is."""
        return self._work.settle(seconds) and self._slow.settle(seconds) and self._work.settle(seconds)

    def _theme(self, *, dark: bool) -> None:
        gui = self._server.gui
        gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False, brand_color=BRAND, control_width="large")

    def _lay_out(self) -> None:
        with contextlib.suppress(AttributeError):  # of a version of viser whose panel cannot be docked
            self._server.gui.main_panel.dock_right()

    def _first(self) -> None:
        self._draw_problem()
        self._draw_motion()
        if self.session.motion is not None:
            self._play()

    # ---- What people do -----------------------------------------------------------------------------------------------

    def _do(self, kind: str, action: Callable[[], object]) -> None:
        self._work.post(kind, action)

    def _actions(self) -> Actions:
        session, do = self.session, self._do
        return Actions(
            plan=lambda: do("plan", session.plan),
            cancel=session.cancel,
            undo=lambda: do("undo", session.undo_changes),
            play=lambda: do("play", self._toggle_play),
            seek=lambda t: do("seek", partial(self._seek, t)),
            start_joint=lambda i, value: do(f"start {i}", partial(session.set_start_joint, i, value)),
            goal_joint=lambda i, value: do(f"goal {i}", partial(session.set_goal_joint, i, value)),
            named_start=lambda name: do("start", lambda: session.set_start(session.edited.problem.robot.configuration(name))),
            goal=lambda handle: do("goal", partial(self._goal_to, handle)),
            choose=lambda index: do("choose", partial(self._choose, index)),
            obstacle=lambda handle: do("obstacle", partial(self._obstacle_to, handle)),
            clearance=lambda value: do("clearance", partial(session.set_clearance, value)),
            budget=lambda count, seconds: do("budget", partial(session.set_budget, count, seconds)),
            seed=lambda seed: do("seed", partial(session.set_seed, seed)),
            pull=lambda on: do("pull", partial(self._show_tip, on)),
            shown=lambda name, on: do(f"shown {name}", partial(self._show, name, on)),
            save=lambda what, name: do("save", partial(self._save, what, name)),
        )

    def _bind_handles(self) -> None:
        moved: dict[str, Callable[[Handle], object]] = {
            "goal": self._goal_to,
            "tip": self._tip_to,
            "obstacle": self._obstacle_to,
        }
        for name, action in moved.items():
            self._bind_handle(name, action)

    def _bind_handle(self, name: str, action: Callable[[Handle], object]) -> None:
        handle = self.scene.handles[name]

        def dragged() -> None:
            self._dragged.add(name)
            action(self.scene.handle_now(name))

        def left() -> None:
            self._dragged.discard(name)
            self._put_handles()

        @handle.on_update
        async def _(event: Any) -> None:  # by viser's loop, in order
            phase = getattr(event, "phase", "update")
            self._do(f"handle {name}", dragged)
            if phase == "end":
                self._do(f"handle {name} left", left)

    def _tip_to(self, handle: Handle) -> None:
        self.panel.told_of_pull(self.session.pull_tip(handle))

    def _goal_to(self, handle: Handle) -> None:
        if self.session.edited.goal_wxyz is None and not hasattr(self.session.edited.problem.goal, "pose"):
            self.session.set_goal_position(handle.position)
        else:
            self.session.set_goal_pose(handle.position, handle.wxyz)

    def _obstacle_to(self, handle: Handle) -> None:
        if self.panel.chosen >= 0:
            self.session.move_obstacle(self.panel.chosen, handle)

    def _choose(self, index: int) -> None:
        edited = self.session.edited
        index = index if 0 <= index < len(edited.source.movables) else -1
        self.panel.put_choice(index)
        handle = self.scene.handles["obstacle"]
        movable = edited.source.movables[index] if index >= 0 else None
        handle.visible = movable is not None and not movable.fixed
        if movable is not None:
            handle.disable_rotations = not movable.turns
            self.scene.put_handle("obstacle", edited.handle(index))
        self._color_obstacles()

    def _show_tip(self, on: bool) -> None:
        self.scene.handles["tip"].visible = on
        self._stop()
        self._put_handles()

    def _show(self, name: str, on: bool) -> None:
        if name == "dark":
            self._theme(dark=on)
            self.scene.darken(on)
            return
        setattr(self.scene.shown, name, on)
        self.scene.apply_shown()
        self._draw_motion()
        self._draw_candidates()
        self._draw_now()

    def _save(self, what: str, name: str) -> None:
        save = {"problem": self.session.save_problem, "plan": self.session.save_plan, "report": self.session.save_report}[what]
        try:
            path = save(name)
        except SpacearmError as error:
            self.panel.told_of_save(str(error), good=False)
            return
        self.panel.told_of_save(f"{path.name}", good=True)
        ending = path.suffix
        self.panel.names[what].value = self.session.folder.free_name(
            path.name.removesuffix(ending).rstrip("0123456789_"), ending
        )

    # ---- Playing ------------------------------------------------------------------------------------------------------

    def _toggle_play(self) -> None:
        if self._playing:
            self._stop()
        else:
            self._play()

    def _play(self) -> None:
        motion = self.session.motion
        if motion is None:
            return
        self._t = 0.0 if self._t >= motion.duration else self._t
        self._playing, self._moving = True, True
        self.panel.play.label = "Pause"
        self._work.wake()

    def _stop(self) -> None:
        if self._playing:
            self._playing = False
            self.panel.play.label = "Play"

    def _seek(self, t: float) -> None:
        self._stop()
        self._t, self._moving = t, True
        self._draw_now()

    def _tick(self, elapsed: float) -> bool:
        """Go on playing by some time, and return whether it goes on."""
        job = self.session.job
        if job is not None and job.running:
            self.panel.update_job(job_html(job))
            self._draw_status()
        motion = self.session.motion
        if self._playing and motion is not None:
            self._t += elapsed * float(self.panel.speed.value)
            if self._t >= motion.duration:
                self._t = self._t % motion.duration if self.panel.again.value and motion.duration > 0 else motion.duration
                if not self.panel.again.value:
                    self._stop()
            self._draw_now()
        return self._playing or (job is not None and job.running)

    # ---- Drawing ------------------------------------------------------------------------------------------------------

    def _changed(self, change: Change) -> None:
        """Note down what has changed; called by whoever changed it."""
        drawn: dict[Change, Callable[[], object]] = {
            "problem": self._problem_changed,
            "job": self._draw_job,
            "candidate": self._draw_candidates,
            "motion": self._motion_found,
            "saved": lambda: None,
        }
        self._work.post(f"draw {change}", drawn[change])

    def _problem_changed(self) -> None:
        self._stop()
        self._moving = False
        self._draw_problem()

    def _draw_problem(self) -> None:
        edited = self.session.edited
        with self._server.atomic():
            self.scene.obstacles.update(edited)
            if "goal" not in self._dragged:
                self.scene.update_goal(edited)
            self.panel.update_problem()
            self._put_handles()
            self._draw_now()
        self._slow.post("reach", self._look_for_goal)

    def _put_handles(self) -> None:
        """Put the handles that nobody drags where they belong."""
        edited = self.session.edited
        if "tip" not in self._dragged and self.scene.handles["tip"].visible:
            T = self.scene.tip_of(edited, edited.problem.start, edited.problem.base_start)
            self.scene.put_handle("tip", as_handle(T[:3, 3], quaternion_of(np.ascontiguousarray(T[:3, :3]))))
        if "obstacle" not in self._dragged and self.panel.chosen >= 0:
            self.scene.put_handle("obstacle", edited.handle(self.panel.chosen))
        goal = edited.goal_handle()
        if "goal" not in self._dragged and goal is not None:
            self.scene.put_handle("goal", goal)

    def _look_for_goal(self) -> None:
        found = self.session.reachable()
        self._do("draw reach", partial(self._draw_reach, found))

    def _draw_reach(self, found: Reachable) -> None:
        self._reach = found
        self._draw_ghost()
        self._draw_status()

    def _draw_ghost(self) -> None:
        if self._reach is not None:
            self.scene.show_ghost(self._reach, self.session.edited.problem.base_start)

    def _draw_now(self) -> None:
        """Draw the arm where it is: at the start, or on its way."""
        edited, motion = self.session.edited, self.session.motion
        with self._server.atomic():
            if self._moving and motion is not None:
                q, T_w_b = motion.at(self._t)
                self.panel.put_time(self._t, motion.duration)
            else:
                q, T_w_b = edited.problem.start, edited.problem.base_start
            self.scene.place_arm(edited, q, T_w_b)
            self._near = nearest(edited.problem, q, T_w_b)
            self.scene.show_nearest(self._near)
            self._curve.mark(self._t if self._moving else None, self._near)
            self._color_obstacles()
            self._draw_status()

    def _color_obstacles(self) -> None:
        near = self._near
        hit = near.obstacle if near is not None and near.tone == "bad" else -1
        self.scene.obstacles.color(chosen=self.panel.chosen, hit=hit)

    def _draw_status(self) -> None:
        words = status_html(self.session, self._near, self._reach, moving=self._moving)
        if self.panel.status.content != words:
            self.panel.status.content = words

    def _draw_job(self) -> None:
        job = self.session.job
        self.panel.update_job(job_html(job))
        words = verdict_html(self.session)
        self.panel.player.visible = bool(words)
        if self.panel.verdict.content != words:
            self.panel.verdict.content = words
        if job is not None and job.running:
            self._work.wake()
        self._draw_candidates()
        self._draw_status()

    def _draw_candidates(self) -> None:
        job = self.session.job
        running = job is not None and job.running
        edited = self.session.edited if job is None else job.edited
        self.scene.show_candidates(edited, [one.motion for one in self.session.candidates()] if running else [])

    def _motion_found(self) -> None:
        self._t = 0.0
        self._draw_motion()
        self._play()

    def _draw_motion(self) -> None:
        motion = self.session.motion
        self.scene.show_motion(motion)
        words = verdict_html(self.session)
        self.panel.player.visible = bool(words)
        self.panel.verdict.content = words
        if motion is not None:
            self.panel.put_time(self._t, motion.duration)
            self._slow.post("curve", partial(self._measure, motion))

    def _measure(self, motion: Any) -> None:
        found = motion.clearances()
        self._do("curve", partial(self._curve.show, motion, found))

    # ---- What goes wrong ----------------------------------------------------------------------------------------------

    def _failed(self, error: Exception) -> None:
        """Tell all browsers what went wrong; what is an error of ours goes to the terminal too."""
        ours = not isinstance(error, SpacearmError)
        self._playing = False
        if ours:
            traceback.print_exception(error, file=sys.stderr)
        text = "an error of spacearm itself; the terminal has it: please report it" if ours else str(error)
        for client in self._server.get_clients().values():
            client.add_notification("Not done", text, color="red", auto_close_seconds=_SHOWN_FOR)
        if not ours:
            self._work.post("values", self.panel.update_problem)  # what was refused is not shown
