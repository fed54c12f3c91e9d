"""The scene in the browser: robot, ghost, obstacles, handles, paths, the nearest pair. It draws, and changes nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import Motion
from spacearm.planner.goals import PoseGoal, PositionGoal
from spacearm.robot.kinematics import forward_kinematics
from spacearm.view.arm_nodes import ArmNodes, place, size_of
from spacearm.view.colors import BASE_PATH, BEST_CANDIDATE, CANDIDATE, DARK_GRID, GRID, PATH, TONES, Color
from spacearm.view.edited_problem import EditedProblem
from spacearm.view.nearest import Nearest
from spacearm.view.obstacle_nodes import ObstacleNodes, extent_of
from spacearm.view.placements import Handle, as_handle
from spacearm.view.reach import Reachable
from spacearm.view.robot_visuals import visuals_of
from spacearm.view.shown_motion import ShownMotion

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

_SAMPLES = 40  # of a candidate's path
_MOST_CANDIDATES = 8  # drawn at once
_VIEW = float(np.radians(38.0))  # of the camera, from top to bottom
_AWAY = 0.82  # times the distance from which a ball around robot and obstacles is just seen


@dataclass(slots=True)
class Shown:
    """What is to be seen.

    Attributes:
        ghost: the arm at the goal.
        names: of obstacles.
        paths: of tip and base.
        nearest: the nearest pair.
        candidates: the motions found while a plan is made.
        visuals: what the robot's file draws, in place of its envelope.
        grid: the plane z = 0.
    """

    ghost: bool = True
    names: bool = True
    paths: bool = True
    nearest: bool = True
    candidates: bool = True
    visuals: bool = True
    grid: bool = True


class SceneView:
    """The scene of a session.

    Args:
        server: viser's.
        edited: the problem that it begins with.
    """

    def __init__(self, server: ViserServer, edited: EditedProblem) -> None:
        self._server, self.shown = server, Shown()
        scene, robot = server.scene, edited.problem.robot
        self.reach = size_of(robot)
        self.middle, self.extent = extent_of(edited, self.reach)
        scene.set_up_direction("+z")
        scene.world_axes.visible = False
        self._set_camera()
        self._grid = self._grid_on(dark=False)
        self._origin = scene.add_frame(
            "/origin", axes_length=0.12 * self.extent, axes_radius=0.002 * self.extent, origin_radius=0.003 * self.extent
        )
        visuals = visuals_of(robot)
        self.has_visuals = bool(visuals.parts)
        self.notes = visuals.notes
        self.arm = ArmNodes(scene, "/arm", robot, visuals=visuals.parts)
        self.ghost = ArmNodes(scene, "/ghost", robot, ghost=TONES["good"])
        self.ghost.show(False)
        self.obstacles = ObstacleNodes(scene, edited, 2.0 * self.extent)
        self._tool = scene.add_frame("/tool", axes_length=0.06 * self.reach, axes_radius=0.002 * self.reach)
        self._goal = scene.add_frame("/goal", axes_length=0.09 * self.reach, axes_radius=0.003 * self.reach)
        self._lines: dict[str, Any] = {}
        self._label = scene.add_label("/nearest/label", "", anchor="bottom-center", visible=False)
        self.handles = {name: self._handle(name, edited) for name in ("goal", "tip", "obstacle")}
        self.update_goal(edited)

    def darken(self, dark: bool) -> None:
        """Draw the grid for a dark background, or a light one."""
        self._grid.remove()
        self._grid = self._grid_on(dark=dark)
        self._grid.visible = self.shown.grid

    def _grid_on(self, *, dark: bool) -> Any:
        cells, sections = DARK_GRID if dark else GRID
        cell = float(10.0 ** np.floor(np.log10(self.extent / 2)))
        size = float(np.ceil(2.5 * self.extent / cell) * cell)
        return self._server.scene.add_grid(
            "/grid",
            size,
            size,
            cell_size=cell,
            section_size=5 * cell,
            position=np.round(self.middle / cell) * cell * [1, 1, 0],
            cell_color=cells,
            section_color=sections,
        )

    def _set_camera(self) -> None:
        camera = self._server.initial_camera
        away = np.array([0.55, -0.75, 0.42]) * self.extent * _AWAY / np.sin(_VIEW / 2)
        camera.position, camera.look_at, camera.up = tuple(self.middle + away), tuple(self.middle), (0.0, 0.0, 1.0)
        camera.fov, camera.near, camera.far = _VIEW, 0.005 * self.extent, 200.0 * self.extent

    def _handle(self, name: str, edited: EditedProblem) -> Any:
        turns = name != "goal" or isinstance(edited.problem.goal, PoseGoal)
        return self._server.scene.add_transform_controls(
            f"/handles/{name}",
            scale=0.22 * self.reach if name == "goal" else 0.17 * self.reach,
            disable_rotations=not turns,
            depth_test=False,
            opacity=0.9,
            visible=name == "goal" and edited.goal_handle() is not None,
        )

    # ---- Where things are ---------------------------------------------------------------------------------------------

    def update_goal(self, edited: EditedProblem) -> None:
        """Put the goal's axes and its handle where the goal is."""
        handle = edited.goal_handle()
        if handle is None:
            goal = np.atleast_2d(edited.problem.goal.q)[0]  # type: ignore[union-attr]
            place(self._goal, edited.problem.base_start @ forward_kinematics(edited.problem.robot, goal))
            return
        place(self._goal, handle.T)
        self.put_handle("goal", handle)

    def put_handle(self, name: str, handle: Handle) -> None:
        """Put a handle somewhere."""
        node = self.handles[name]
        if not np.array_equal(node.position, handle.position):
            node.position = handle.position
        if not np.array_equal(node.wxyz, handle.wxyz):
            node.wxyz = handle.wxyz

    def handle_now(self, name: str) -> Handle:
        """Return where a handle was dragged to."""
        node = self.handles[name]
        return as_handle(node.position, node.wxyz)

    def tip_of(self, edited: EditedProblem, q: Array, T_w_b: Array) -> Array:
        """Return where the end effector is, T_w_tip (4, 4) [m]."""
        return T_w_b @ forward_kinematics(edited.problem.robot, q)

    def place_arm(self, edited: EditedProblem, q: Array, T_w_b: Array) -> None:
        """Put the arm at q with its base at T_w_b."""
        self.arm.place(q, T_w_b)
        place(self._tool, self.tip_of(edited, q, T_w_b))

    def show_ghost(self, found: Reachable, T_w_b: Array) -> None:
        """Show the arm at the goal, or where it comes nearest to it."""
        self.ghost.show(self.shown.ghost and found.q is not None)
        if found.q is not None:
            self.ghost.tint(TONES[found.tone])
            self.ghost.place(found.q, T_w_b)

    def show_nearest(self, found: Nearest | None) -> None:
        """Draw the nearest pair, with its distance."""
        points = None if found is None or not self.shown.nearest else found.points
        self._line("/nearest/line", None if points is None else points[None], TONES[found.tone] if found else CANDIDATE, 3.0)
        self._label.visible = points is not None
        if points is not None and found is not None:
            self._label.text = f"{found.clearance * 1e3:.4g} mm"
            self._label.position = points.mean(axis=0)

    def show_motion(self, motion: ShownMotion | None) -> None:
        """Draw the paths of the end effector and of the base."""
        shown = motion is not None and self.shown.paths
        self._line("/paths/tip", _segments(motion.tip_path()) if shown and motion else None, PATH, 3.0)
        base = motion.base_path() if shown and motion else np.zeros((0, 3))
        self._line("/paths/base", _segments(base) if len(base) else None, BASE_PATH, 2.5)

    def show_candidates(self, edited: EditedProblem, motions: Sequence[Motion]) -> None:
        """Draw the paths of the end effector along motions found so far, the best one last and strongest."""
        drawn = list(motions)[-_MOST_CANDIDATES:] if self.shown.candidates else []
        paths = [_segments(self._tip_path(edited, motion)) for motion in drawn]
        self._line("/candidates/earlier", np.concatenate(paths[:-1]) if len(paths) > 1 else None, CANDIDATE, 1.5)
        self._line("/candidates/best", paths[-1] if paths else None, BEST_CANDIDATE, 3.0)

    def _tip_path(self, edited: EditedProblem, motion: Motion) -> Array:
        """Return a candidate's path with the base where it begins, (k, 3) [m]."""
        q = motion.derivatives(np.linspace(0.0, 1.0, _SAMPLES), 0)[0]
        T = forward_kinematics(edited.problem.robot, q)
        base = edited.problem.base_start
        return T[:, :3, 3] @ base[:3, :3].T + base[:3, 3]

    def _line(self, name: str, segments: Array | None, color: Color, width: float) -> None:
        node = self._lines.get(name)
        if segments is None or not len(segments):
            if node is not None:
                node.visible = False
            return
        points = np.ascontiguousarray(segments, dtype=np.float32)
        if node is not None and len(node.points) == len(points) and tuple(node.colors.reshape(-1)[:3]) == color:
            node.points, node.visible = points, True
            return
        if node is not None:
            node.remove()
        self._lines[name] = self._server.scene.add_line_segments(
            name, points, colors=np.array(color, dtype=np.uint8), thickness=width, thickness_units="screen"
        )

    # ---- What is to be seen -------------------------------------------------------------------------------------------

    def apply_shown(self) -> None:
        """Show and hide what `shown` says, as far as it does not depend on the session."""
        self.obstacles.show_names(self.shown.names)
        self.arm.show_visuals(self.shown.visuals)
        self.ghost.show_visuals(self.shown.visuals)
        self._grid.visible = self._origin.visible = self.shown.grid
        self.ghost.show(self.shown.ghost and self.ghost.q is not None)


def _segments(points: Array) -> Array:
    return np.stack([points[:-1], points[1:]], axis=1)


def goal_in_words(edited: EditedProblem) -> str:
    """Return what kind of goal there is, in words."""
    goal = edited.problem.goal
    if isinstance(goal, PositionGoal):
        return f"a point for frame '{goal.frame}', within {goal.tolerance * 1e3:.4g} mm"
    if isinstance(goal, PoseGoal):
        turned = "; it may turn about one axis" if goal.free_axis is not None else ""
        return (
            f"a pose for frame '{goal.frame}', within {goal.position_tolerance * 1e3:.4g} mm and "
            f"{np.degrees(goal.orientation_tolerance):.3g} deg{turned}"
        )
    rows = len(np.atleast_2d(goal.q))
    return "a configuration" if rows == 1 else f"any of {rows} configurations"
