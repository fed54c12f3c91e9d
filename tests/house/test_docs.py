"""What the pages show runs, in order; and the files and the sections that they name exist."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from house.source import REPOSITORY

PAGES = sorted((REPOSITORY / "docs").glob("*.md"))

_LINKS = (("base", 0.08, 0.2), ("upper", 0.06, 0.3), ("lower", 0.05, 0.3), ("wrist", 0.04, 0.1), ("hand", 0.04, 0.06))
_JOINTS = (
    ("j1", "base", "shoulder", "0 0 0.2", "0 0 1"),
    ("j2", "shoulder", "upper", "0 0 0", "0 1 0"),
    ("j3", "upper", "upper2", "0 0 0.3", "0 0 1"),
    ("j4", "upper2", "lower", "0 0 0", "0 1 0"),
    ("j5", "lower", "wrist", "0 0 0.35", "0 0 1"),
    ("j6", "wrist", "hand", "0 0 0.12", "0 1 0"),
)


def arm() -> tuple[str, str]:
    """Return the URDF and SRDF of an arm of six joints."""
    shapes = {name: (radius, length) for name, radius, length in _LINKS}
    links = "".join(
        f'<link name="{name}">'
        + (
            f'<collision><origin xyz="0 0 {shapes[name][1] / 2}"/><geometry><cylinder radius="{shapes[name][0]}" '
            f'length="{shapes[name][1]}"/></geometry></collision>'
            if name in shapes
            else ""
        )
        + "</link>"
        for name in ("base", "shoulder", "upper", "upper2", "lower", "wrist", "hand")
    )
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit lower="-2.8" upper="2.8" velocity="1.5" effort="10"/></joint>'
        for name, parent, child, xyz, axis in _JOINTS
    )
    pairs = (("base", "upper"), ("upper", "lower"), ("lower", "wrist"), ("wrist", "hand"), ("lower", "hand"))
    allowed = "".join(f'<disable_collisions link1="{a}" link2="{b}" reason="Adjacent"/>' for a, b in pairs)
    group = '<group name="arm"><chain base_link="base" tip_link="hand"/></group>'
    return f'<robot name="arm">{links}{joints}</robot>', f'<robot name="arm">{group}{allowed}</robot>'


def blocks(page: Path) -> list[str]:
    """Return a page's Python."""
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_planning_for_your_own_robot_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in zip(("arm.urdf", "arm.srdf"), arm(), strict=True):
        Path(name).write_text(text, encoding="utf-8")
    names: dict[str, object] = {}
    for block in blocks(REPOSITORY / "docs" / "planning.md"):
        exec(compile(block, "planning.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "a motion was found and proven" in printed
    assert "holds" in printed
    assert printed.rstrip().splitlines()[-1].startswith("clearance is at least")  # of the swarm by hand
    assert Path("plan.json").exists()


def test_the_floating_base_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks(REPOSITORY / "docs" / "floating_base.md"):
        exec(compile(block, "floating_base.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "15.1 degrees" in printed
    assert "fails | link 'link_7' and obstacle 'strut B'" in printed  # what was proven with the base held
    assert "penetrate by 591 mm" in printed  # the published motion
    found = [names[name] for name in ("first", "second", "reached", "slow", "caught")]
    assert [plan.status for plan in found] == ["found"] * 5
    assert all(plan.certificate.holds for plan in found)
    # What is left of a goal: the plan's own report against the trajectory, and both against the page's words.
    second, reached, slow = names["second"], names["reached"], names["slow"]
    tip = second.trajectory.tip(second.trajectory.duration)[:3, 3]
    assert abs(tip - names["goal"].position).max() < 1e-6
    assert reached.base.goal_distance < 1e-6
    assert reached.base.base_angle < 1e-6
    assert slow.base.rate <= names["gentle"].base_limits.rate * (1 + 1e-6)
    assert {path.name for path in Path().iterdir()} == {"plan.json", "base.aem", "arm.json"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_files_a_page_names_exist(page: Path) -> None:
    named = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    missing = [name for name in named if not name.startswith("http") and not (page.parent / name).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_sections_a_page_names_exist(page: Path) -> None:
    named = re.findall(r"\]\(([^):]*)#([^)]+)\)", page.read_text(encoding="utf-8"))
    missing = [f"{name}#{anchor}" for name, anchor in named if anchor not in anchors((page.parent / name) if name else page)]
    assert not missing


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
