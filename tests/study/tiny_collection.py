"""A collection of problems as small as can be: two links in the plane, and something in their way."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from support import srdf_text, urdf_text
from support.urdf_text import collision, joint, link

WIDE = 'lower="-2.9" upper="2.9" velocity="1" effort="1"'
BEADS = [collision('<sphere radius="0.05"/>', xyz=f"{x} 0 0") for x in (0.3, 0.4, 0.5)]
ARM = urdf_text.robot(
    link("base"),
    link("upper", *BEADS),
    link("fore", *BEADS),
    joint("shoulder", "base", "upper", limit=WIDE),
    joint("elbow", "upper", "fore", xyz="0.6 0 0", limit=WIDE),
)
GROUPS = srdf_text.srdf(
    srdf_text.group("arm", chain=("base", "fore")), srdf_text.disabled("upper", "fore"), srdf_text.disabled("base", "upper")
)


def box(
    size: Sequence[float], position: Sequence[float], *, xyzw: Sequence[float] = (0, 0, 0, 1), **more: Any
) -> dict[str, Any]:
    """A collision object."""
    return {
        "id": "block",
        "primitives": [{"type": "box", "dimensions": list(size)}],
        "primitive_poses": [{"position": list(position), "orientation": list(xyzw)}],
        **more,
    }


def scene(*objects: dict[str, Any]) -> dict[str, Any]:
    """A planning scene."""
    return {"world": {"collision_objects": list(objects)}}


def request(
    start: Sequence[float], goal: Sequence[float], *, group: str = "arm", names: Sequence[str] = ("shoulder", "elbow")
) -> dict[str, Any]:
    """A motion request."""
    wanted = [{"joint_name": name, "position": at} for name, at in zip(names, goal, strict=True)]
    return {
        "group_name": group,
        "start_state": {"joint_state": {"name": list(names), "position": list(start)}},
        "goal_constraints": [{"joint_constraints": wanted}],
    }


def write_robot(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.urdf").write_text(ARM)
    (folder / "arm.srdf").write_text(GROUPS)


def write_problem(family: Path, number: int, what: dict[str, Any], asked: dict[str, Any]) -> None:
    """Write a problem's two files; JSON is YAML."""
    family.mkdir(parents=True, exist_ok=True)
    (family / f"scene{number:04d}.yaml").write_text(json.dumps(what))
    (family / f"request{number:04d}.yaml").write_text(json.dumps(asked))


def write_collection(folder: Path) -> Path:
    """Write a robot and three problems of two families: one free, one with a block in the way, one that cannot be."""
    write_robot(folder)
    across = request([-1.0, 0.1], [1.0, 0.1])
    write_problem(folder / "easy", 1, scene(), across)
    write_problem(folder / "hard", 1, scene(box([0.2, 0.1, 0.1], [1.1, 0, 0])), across)
    write_problem(folder / "hard", 2, scene(box([0.2, 0.2, 0.1], [0.5, 0.2, 0])), request([0.4, 0.0], [1.0, 0.0]))
    return folder
