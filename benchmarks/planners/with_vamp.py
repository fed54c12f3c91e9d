"""VAMP's own robots, compiled here, on the same problems.

VAMP knows no cylinders between flat ends: its authors take capsules around them, and boxes within them for the family "box"
(whose cylinder is to be grasped), and so do we. Its build fetches two libraries from a network. `vamp/` stands in for them;
where a copy of the first, github.com/KavrakiLab/nigh, is in `.venv-planners/nigh`, or where SPACEARM_NIGH says, its own k-d
trees are taken.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cases import ENVIRONMENT, HERE, Case, Trace, along

from spacearm.geometry import Box, Capsule, Cylinder, Sphere

VERSION = "0.6.4"
BUDGETS = (1_000, 3_000, 10_000, 30_000)
"""Iterations of AORRTC, each a run of its own."""

ROBOTS = {
    "panda": ("Panda", 1.0, True),
    "ur5": ("UR5", 1.5, True),
    "fetch": ("Fetch", 1.0, True),
    "baxter": ("Baxter", 0.5, False),
}
"""VAMP's robots: what the type is called; VAMP's own choice of the trees' step (`ROBOT_RRT_RANGES`) [rad]; and whether nodes
that could not be extended take samples from near them alone (`dynamic_domain`). VAMP does that by default. On the Baxter it
does better without: 24 of 24 problems solved instead of 22, 95 in 100 within 51 ms instead of 122 ms."""

_FLAGS = "-std=c++17 -O3 -DNDEBUG -march=native -mavx2 -fno-math-errno -fno-signed-zeros -fno-trapping-math -fno-rounding-math "
_FLAGS += "-ffp-contract=fast -fassociative-math -w"  # VAMP's own


@dataclass(frozen=True)
class Answer:
    """What one of VAMP's planners found.

    Attributes:
        planner: "RRTC", "RRTC+simplify" or "AORRTC".
        iterations: of AORRTC; else 0.
        seconds: the planner's own count, the least of a few repetitions [s].
        length: of the path [rad]; nan where there is none.
        corners: (m, n) of the path, joints in our order; None where there is none.
    """

    planner: str
    iterations: int
    seconds: float
    length: float
    corners: np.ndarray | None


@dataclass(frozen=True)
class Answers:
    """What VAMP says of a problem: whether it takes the start and the goal for free, and what its planners found."""

    start_free: bool
    goal_free: bool
    found: list[Answer]

    def of(self, planner: str) -> Answer:
        """Return the first answer of a planner."""
        return next(answer for answer in self.found if answer.planner == planner)


class Vamp:
    """VAMP's program for a robot: it is asked for one problem after another, and waits in between.

    Args:
        robot: one of `ROBOTS`.
        joints: our order of the joints.
        repetitions: of each run, the quickest counts.
        budgets: iterations of AORRTC; none: it is left out.
    """

    def __init__(
        self,
        robot: str,
        joints: tuple[str, ...],
        *,
        repetitions: int = 3,
        budgets: tuple[int, ...] = (),
    ) -> None:
        _, step, dynamic_domain = ROBOTS[robot]
        command = [str(build(robot)), str(repetitions), str(step), str(int(dynamic_domain)), *map(str, budgets)]
        self._program = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        names = self._line().split()
        if sorted(names) != sorted(joints):
            raise ValueError(f"VAMP's {robot} has the joints {', '.join(names)}, and ours {', '.join(joints)}")
        self._theirs = [joints.index(name) for name in names]
        self._ours = [names.index(name) for name in joints]

    def ask(self, case: Case) -> Answers:
        """Return VAMP's answers to a problem."""
        assert self._program.stdin is not None
        self._program.stdin.write(_text(case, self._theirs) + "\n")
        self._program.stdin.flush()
        _, start, goal = self._line().split()
        found = []
        while line := self._line().strip():
            found.append(self._answer(line))
        return Answers(start == "1", goal == "1", found)

    def close(self) -> None:
        """End the program."""
        assert self._program.stdin is not None
        self._program.stdin.close()
        self._program.wait()

    def _line(self) -> str:
        assert self._program.stdout is not None
        line = self._program.stdout.readline()
        if not line:
            raise RuntimeError(f"VAMP's program ended with {self._program.wait()}")
        return line

    def _answer(self, line: str) -> Answer:
        planner, iterations, solved, seconds, cost, count, *numbers = line.split()
        corners = np.array(numbers, dtype=np.float64).reshape(int(count), -1)[:, self._ours] if int(solved) else None
        return Answer(planner, int(iterations), float(seconds), float(cost) if int(solved) else np.nan, corners)


def own_trees() -> Path | None:
    """Return the folder of VAMP's library of k-d trees, where there is one."""
    given = os.environ.get("SPACEARM_NIGH")
    place = Path(given) if given else ENVIRONMENT / "nigh"
    return place if (place / "src" / "nigh").is_dir() else None


def build(robot: str) -> Path:
    """Fetch VAMP and Eigen from PyPI, compile a robot's program, and return it; it is kept."""
    nigh = own_trees()
    program = ENVIRONMENT / f"vamp_{robot}{'_nigh' if nigh else ''}"
    newest = max(path.stat().st_mtime for path in (HERE / "vamp").rglob("*.*"))
    if program.exists() and program.stat().st_mtime > newest:
        return program
    source, eigen = _sources()
    includes = [source, *([nigh / "src"] if nigh else []), HERE / "vamp"]
    command = ["g++", *_FLAGS.split(), f"-DROBOT={ROBOTS[robot][0]}", f"-DROBOT_FILE=<vamp/robots/{robot}.hh>"]
    command += [part for path in includes for part in ("-I", str(path))] + ["-isystem", str(eigen)]
    print(f"compiling VAMP's {robot}", file=sys.stderr)
    subprocess.run([*command, str(HERE / "vamp" / "planner.cpp"), "-o", str(program)], check=True)
    return program


def _sources() -> tuple[Path, Path]:
    """Return the folders of VAMP's and Eigen's headers."""
    source = ENVIRONMENT / f"vamp_planner-{VERSION}"
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q"]
    if not source.exists():
        fetch = ["download", "--no-deps", "--no-binary", ":all:", "--no-build-isolation", "-d", str(ENVIRONMENT)]
        subprocess.run([*pip, *fetch, f"vamp-planner=={VERSION}"], check=True)
        with tarfile.open(ENVIRONMENT / f"vamp_planner-{VERSION}.tar.gz") as archive:
            archive.extractall(ENVIRONMENT, filter="data")
    eigen = ENVIRONMENT / "cmeel.prefix" / "include" / "eigen3"
    if not eigen.exists():
        subprocess.run([*pip, "install", "--no-deps", "--target", str(ENVIRONMENT), "cmeel-eigen"], check=True)
    return source / "src" / "impl", eigen


def planned(cases: list[Case], robot: str) -> list[Trace]:
    """VAMP's runs on all cases: RRT-Connect with simplification, and AORRTC by iterations."""
    vamp = Vamp(robot, cases[0].problem.robot.dof_names, budgets=BUDGETS)
    traces = [_trace(answer, case) for case in cases for answer in vamp.ask(case).found if answer.planner != "RRTC"]
    vamp.close()
    return traces


def _trace(answer: Answer, case: Case) -> Trace:
    anytime = f"VAMP AORRTC, {answer.iterations} iterations"
    name = "VAMP RRT-Connect, simplified" if answer.planner == "RRTC+simplify" else anytime
    trace = Trace(name, case.name, 0, seconds=answer.seconds)
    if answer.corners is not None:
        trace.note(answer.seconds, 0, answer.length)
        trace.way = along(answer.corners, 0.005)
    return trace


def _text(case: Case, order: list[int]) -> str:
    boxes, capsules, spheres = [], [], []
    for o in case.problem.scene.obstacles:
        if isinstance(o, Box):
            boxes.append([*o.pose[:3, 3], *o.pose[:3, :3].T.ravel(), *(o.size / 2)])
        elif isinstance(o, Cylinder) and case.item.family.split("_")[0] == "box":
            boxes.append([*o.pose[:3, 3], *o.pose[:3, :3].T.ravel(), o.radius, o.radius, o.length / 2])
        elif isinstance(o, Cylinder):
            middle, half = o.pose[:3, 3], o.pose[:3, 2] * o.length / 2
            capsules.append([*(middle + half), *(middle - half), o.radius])
        elif isinstance(o, Capsule):
            capsules.append([*o.a, *o.b, o.radius])
        elif isinstance(o, Sphere):
            spheres.append([*o.center, o.radius])
        else:
            raise ValueError(f"{case.name} has a {type(o).__name__}, which VAMP is not told of")
    rows = [case.start[order], case.goal[order]]
    for shapes in (boxes, capsules, spheres):
        rows += [[len(shapes)], *shapes]
    return "\n".join(" ".join(f"{x:.9g}" for x in row) for row in rows)
