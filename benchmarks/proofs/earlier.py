"""Asks another version of spacearm for its certificates, in a process of its own; problems cross as plain values.

Run as a program, this file is that process: it answers on its standard output, a pickle of plain values at a time.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO


@dataclass(frozen=True, slots=True, kw_only=True)
class Earlier:
    """What another version says of a motion.

    Attributes:
        status: of its certificate, or "refused".
        clearance: that it proved [m]; None: nothing.
        measured: the closest approach that it measured [m], and what is required there; None: none.
        message: in words.
    """

    status: str
    clearance: float | None
    measured: tuple[float, float] | None
    message: str


class EarlierVersion:
    """A process with another version of spacearm.

    Args:
        folder: that holds the package `spacearm` of the other version.
    """

    def __init__(self, folder: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(folder), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).resolve())],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        found = self._answer()
        if not Path(found).is_relative_to(folder.resolve()):
            raise RuntimeError(f"the other version was imported from {found}, expected it from {folder}")

    def certify(self, made: Any) -> Earlier:
        """Return what it says of a drawn motion."""
        from spacearm.geometry.scene import scene_as_list
        from spacearm.motion.trajectory_values import trajectory_as_dict
        from spacearm.robot.model import robot_as_dict

        pairs = [(pair.clearance, pair.link, pair.obstacle, pair.other_link) for pair in made.clearances]
        pickle.dump(
            {
                "robot": robot_as_dict(made.robot),
                "obstacles": scene_as_list(made.scene),
                "trajectory": trajectory_as_dict(made.trajectory),
                "base": made.trajectory.base,
                "clearance": made.clearance,
                "clearances": pairs,
            },
            self._stdin,
        )
        self._stdin.flush()
        return Earlier(**self._answer())

    @property
    def _stdin(self) -> BinaryIO:
        assert self._process.stdin is not None
        return self._process.stdin  # type: ignore[return-value]

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        return pickle.load(self._process.stdout)


@cache
def earlier_version(folder: Path) -> EarlierVersion:
    """Return the process of a folder; one for each process that asks."""
    return EarlierVersion(folder)


# ---- the other process -------------------------------------------------------------------------------------------------


def _serve() -> None:
    import spacearm

    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever else is printed goes elsewhere
    pickle.dump(str(Path(spacearm.__file__).resolve()), answers)
    answers.flush()
    while True:
        try:
            given = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(_certified(given), answers)
        answers.flush()


def _certified(given: dict[str, Any]) -> dict[str, Any]:
    from types import SimpleNamespace

    from spacearm.core.errors import SpacearmError
    from spacearm.geometry.scene import scene_from_list
    from spacearm.motion.trajectory_values import trajectory_from_dict
    from spacearm.proof import PairClearance, certify
    from spacearm.robot.model import robot_from_dict

    try:
        robot = robot_from_dict(given["robot"])
        trajectory = trajectory_from_dict(robot, given["trajectory"], within_limits=False)
        problem = SimpleNamespace(
            robot=robot,
            scene=scene_from_list(given["obstacles"]),
            base=given["base"],
            base_start=trajectory.base_start,
            momentum=trajectory.momentum,
            clearance=given["clearance"],
            clearances=tuple(
                PairClearance(value, link=link, obstacle=obstacle, other_link=other)
                for value, link, obstacle, other in given["clearances"]
            ),
        )
        found = certify(problem, trajectory, limits=())
    except SpacearmError as refused:
        return {"status": "refused", "clearance": None, "measured": None, "message": str(refused)}
    near = found.closest
    measured = None if near is None else (near.clearance, near.required)
    return {"status": found.status, "clearance": found.clearance, "measured": measured, "message": found.message}


if __name__ == "__main__":
    sys.path[0] = ""  # not the folder of this file
    _serve()
