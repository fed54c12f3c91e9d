"""The robot of a problem file, with what it holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from spacearm.errors import ProblemError
from spacearm.planner.files.scenes import beside, placed, read_solid
from spacearm.planner.held import hold
from spacearm.reading import YamlFile
from spacearm.robot.load import builtin_robots, load_robot
from spacearm.robot.model import Robot

if TYPE_CHECKING:
    from spacearm.planner.files.schema import HeldModel, RobotModel


def read_robot(file: YamlFile, model: RobotModel) -> Robot:
    """Load the robot that a problem file names, and put into its hand what it holds.

    Raises:
        SpacearmError: a robot that cannot be, or something that cannot be held; file and line are named.
    """
    with file.at("robot"):
        robot = _loaded(model, file.path.parent)
    for i, held in enumerate(model.holding or ()):
        with file.at("robot", "holding", i):
            robot = _holding(robot, held, i, file.path.parent, model.capsules_per_shape)
    return robot


def _loaded(model: RobotModel, directory: Path) -> Robot:
    if (model.name is None) == (model.file is None):
        given = "neither name nor file" if model.name is None else "both name and file"
        raise ProblemError(f"robot has {given}, expected one; built-in names: {', '.join(builtin_robots())}")
    # A name that is not built in but looks like a path is one: `robot: arm.urdf`.
    is_path = model.file is not None or bool(Path(model.name or "").suffix) or "/" in (model.name or "")
    return load_robot(
        beside(directory, model.file or model.name or "") if is_path else model.name or "",
        srdf=None if model.srdf is None else beside(directory, model.srdf),
        joint_limits=None if model.joint_limits is None else beside(directory, model.joint_limits),
        **model.model_dump(exclude={"name", "file", "srdf", "joint_limits", "holding"}),  # the others are called as there
    )


def _holding(robot: Robot, held: HeldModel, index: int, directory: Path, count: int) -> Robot:
    name = held.name if held.name is not None else "held" if index == 0 else f"held_{index + 1}"
    return hold(
        robot,
        read_solid(held, directory, name=""),
        frame=held.frame,
        pose=placed(held),
        touching=held.touching or (),
        name=name,
        capsules_per_shape=count,
        mass=held.mass,
        com=held.com,
        inertia=held.inertia,
    )
