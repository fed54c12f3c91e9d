"""`spacearm robustness`: how much tracking error a saved plan, or another trajectory, survives.

The proof and the files are imported by the functions that use them, after the options are read: help is printed without.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from spacearm.cli.arguments import parsed
from spacearm.cli.progress import progress_bar
from spacearm.cli.terminal import loading, show_list, show_table
from spacearm.core.errors import SettingsError
from spacearm.core.output import require_new
from spacearm.core.reading import located
from spacearm.core.version import version

if TYPE_CHECKING:
    from spacearm.motion import AnyTrajectory
    from spacearm.planner import Problem
    from spacearm.proof import Robustness, Tube
    from spacearm.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Options:
    """Find the widest tube around a motion for which its proof still holds: how far the joints may be from it at any instant.

    All revolute joints have the same tracking error; a prismatic joint has as many metres as they have radians. The tube that
    is printed is proven, of all joints together and of each alone. If not even the motion itself is proven, the exit code is 1.

    Attributes:
        file: a plan.json, or a trajectory in CSV or of ROS.
        problem: a problem file (YAML) to prove the motion for; none: the problem in the plan.
        output: write the result to this new file, as JSON.
        joints: only these joints have a tracking error; none: all joints.
        resolution: relative; a tube that is wider by this share is not proven.
        json: print the result as JSON instead of the summary.
    """

    file: Annotated[Positional[Path], arg(metavar="FILE")]
    problem: Annotated[Path | None, arg(metavar="PROBLEM.YAML")] = None
    output: Annotated[Path | None, arg(metavar="RESULT.JSON", aliases=("-o",))] = None
    joints: Annotated[tuple[str, ...], arg(metavar="NAME")] = ()
    resolution: float = 0.01
    json: bool = False


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(Options, arguments, command="robustness")
    from spacearm.files.plan_file import save_json
    from spacearm.proof import robustness

    if options.output is not None:
        require_new(options.output, advice="choose another name with -o")
    with loading():
        problem, trajectory = _given(options)
    with progress_bar("tubes") as bar, located(options.file):
        found = robustness(problem, trajectory, joints=options.joints or "all", resolution=options.resolution, progress=bar)
    values = {"spacearm-robustness": 1, "version": version(), "file": options.file.name, **found.as_dict()}
    if options.output is not None:
        save_json(values, options.output)
    if options.json:
        print(json.dumps(values, indent=2, allow_nan=False))
    else:
        _show(found)
    return 0 if found.certificate.holds else 1


def _given(options: Options) -> tuple[Problem, AnyTrajectory]:
    """Return the problem and the trajectory that the files hold."""
    from spacearm.cli.certify_command import is_plan
    from spacearm.core.reading import read_bytes
    from spacearm.files import load_problem, load_saved_plan, load_trajectory

    problem = None if options.problem is None else load_problem(options.problem)
    if is_plan(read_bytes(options.file, what="a plan or a trajectory")):
        saved = load_saved_plan(options.file)
        return saved.problem if problem is None else problem, saved.trajectory
    if problem is None:
        raise SettingsError(
            f"{options.file} is no plan in JSON, so it is taken for a trajectory; give --problem PROBLEM.YAML to prove it for"
        )
    return problem, load_trajectory(
        problem.robot, options.file, base=problem.base, base_start=problem.base_start, momentum=problem.momentum
    )


def _show(found: Robustness) -> None:
    robot = found.certificate.robot
    rows = [("finding", found.message)]
    rows += [("near", near.text) for near in found.certificate.near_pairs]
    rows.append(
        ("looked at", f"{found.certificates} certificates, {found.seconds:.2g} s, to {found.resolution:.3g} of each tube")
    )
    show_list(rows)
    if not found.singly:
        return
    print()
    show_table(
        "one joint alone, all others exact",
        ("joint", "tracking error", "unit", "limited by"),
        [(tube.joints[0], _number(tube), _unit(robot, tube), tube.limited_by or "nothing") for tube in found.singly],
    )


def _number(tube: Tube) -> str:
    return f"{tube.tracking:.4g}" if math.isfinite(tube.not_proven) else f"{tube.tracking:.4g} or more"


def _unit(robot: Robot, tube: Tube) -> str:
    return "m" if robot.is_prismatic(robot.dof_names.index(tube.joints[0])) else "rad"
