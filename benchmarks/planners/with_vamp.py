"""VAMP's own Panda, compiled here, on the same problems.

VAMP knows no cylinders between flat ends: its authors take capsules around them, and boxes within them for the family "box"
(whose cylinder is to be grasped), and so do we. Its build fetches libraries from a network; `vamp/` stands in for them.
"""

from __future__ import annotations

import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
from cases import ENVIRONMENT, HERE, Case, Trace, along

from spacearm.geometry import Box, Cylinder

VERSION = "0.6.4"
BUDGETS = (1_000, 3_000, 10_000, 30_000)
"""Iterations of AORRTC, each a run of its own."""

_FLAGS = "-std=c++17 -O3 -DNDEBUG -march=native -mavx2 -fno-math-errno -fno-signed-zeros -fno-trapping-math -fno-rounding-math "
_FLAGS += "-ffp-contract=fast -fassociative-math -w"  # VAMP's own


def build() -> Path:
    """Fetch VAMP and Eigen from PyPI, compile, and return the program; it is kept."""
    program, source = ENVIRONMENT / "vamp_panda", ENVIRONMENT / f"vamp_planner-{VERSION}"
    newest = max(path.stat().st_mtime for path in (HERE / "vamp").rglob("*.*"))
    if program.exists() and program.stat().st_mtime > newest:
        return program
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q"]
    if not source.exists():
        fetch = ["download", "--no-deps", "--no-binary", ":all:", "--no-build-isolation", "-d", str(ENVIRONMENT)]
        subprocess.run([*pip, *fetch, f"vamp-planner=={VERSION}"], check=True)
        with tarfile.open(ENVIRONMENT / f"vamp_planner-{VERSION}.tar.gz") as archive:
            archive.extractall(ENVIRONMENT, filter="data")
    eigen = ENVIRONMENT / "cmeel.prefix" / "include" / "eigen3"
    if not eigen.exists():
        subprocess.run([*pip, "install", "--no-deps", "--target", str(ENVIRONMENT), "cmeel-eigen"], check=True)
    command = ["g++", *_FLAGS.split(), "-I", str(source / "src" / "impl"), "-I", str(HERE / "vamp"), "-isystem", str(eigen)]
    subprocess.run([*command, str(HERE / "vamp" / "panda.cpp"), "-o", str(program)], check=True)
    return program


def planned(cases: list[Case], *, repetitions: int = 3) -> list[Trace]:
    """VAMP's runs on all cases: RRT-Connect with simplification, and AORRTC by iterations."""
    given = "\n".join(_text(case) for case in cases) + "\n"
    command = [str(build()), str(repetitions), *map(str, BUDGETS)]
    told = subprocess.run(command, input=given, capture_output=True, text=True, check=True).stdout
    return [
        _trace(line, case)
        for case, block in zip(cases, told.strip().split("\n\n"), strict=True)
        for line in block.splitlines()
        if not line.startswith("RRTC ")
    ]


def _trace(line: str, case: Case) -> Trace:
    planner, iterations, solved, seconds, cost, corners, *numbers = line.split()
    name = "VAMP RRT-Connect, simplified" if planner == "RRTC+simplify" else f"VAMP AORRTC, {iterations} iterations"
    trace = Trace(name, case.name, 0, seconds=float(seconds))
    if int(solved):
        trace.note(float(seconds), 0, float(cost))
        trace.way = along(np.array(numbers, dtype=np.float64).reshape(int(corners), -1), 0.005)
    return trace


def _text(case: Case) -> str:
    boxes, capsules = [], []
    for o in case.problem.scene.obstacles:
        if isinstance(o, Box):
            boxes.append([*o.pose[:3, 3], *o.pose[:3, :3].T.ravel(), *(o.size / 2)])
        elif isinstance(o, Cylinder) and case.item.family.startswith("box"):
            boxes.append([*o.pose[:3, 3], *o.pose[:3, :3].T.ravel(), o.radius, o.radius, o.length / 2])
        elif isinstance(o, Cylinder):
            middle, half = o.pose[:3, 3], o.pose[:3, 2] * o.length / 2
            capsules.append([*(middle + half), *(middle - half), o.radius])
        else:
            raise ValueError(f"{case.name} has a {type(o).__name__}, which VAMP is not told of")
    rows = [case.start, case.goal, [len(boxes)], *boxes, [len(capsules)], *capsules]
    return "\n".join(" ".join(f"{x:.9g}" for x in row) for row in rows)
