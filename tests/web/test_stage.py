"""The 3-D picture of a report: every kind of shape stands where it should, names do not overlap, nothing is drawn in vain."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.report.report_page import packed, quantised, write_report
from support.browser import Visit
from support.small_report import placed, small_report

Windows = Callable[..., Visit]

CORNERS = np.array([[-0.2, -0.2, -0.2], [0.4, -0.2, -0.2], [-0.2, 0.4, -0.2], [-0.2, -0.2, 0.4]])  # of a tetrahedron around 0
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
SHAPES: dict[str, dict[str, Any]] = {
    "box": {"kind": "box", "size": [0.4, 0.4, 0.4], "T": placed(0, 0, 0)},
    "cylinder": {"kind": "cylinder", "radius": 0.2, "length": 0.4, "T": placed(0, 0, 0)},
    "capsule": {"kind": "capsule", "radius": 0.2, "a": [0, -0.2, 0], "b": [0, 0.2, 0]},
    "sphere": {"kind": "sphere", "radius": 0.2, "center": [0, 0, 0]},
    "sphere set": {"kind": "spheres", "centers": packed([[0, -0.1, 0], [0, 0.1, 0]]), "radii": packed([0.2, 0.2])},
    "mesh": {"kind": "mesh", "mesh": 0, "T": placed(0, 0, 0)},
    "mirrored mesh": {"kind": "mesh", "mesh": 0, "T": placed(0, 0, 0), "scale": [-1, 1, 1]},
}


def view(name: str, obstacles: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a view of obstacles."""
    return {
        "name": name,
        "verdict": {"tone": "plain", "headline": name, "text": ""},
        "clock": {"unit": "s", "duration": 0},
        "actors": [],
        "obstacles": obstacles,
        "targets": [],
        "plots": [],
        "sections": [],
    }


@pytest.fixture(scope="module")
def shapes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with a view of each kind of shape, of a floor, and of twelve obstacles in a small place."""
    report = small_report()
    positions, low, high = quantised(CORNERS)
    report["meshes"] = [{"low": low, "high": high, "positions": positions, "indices": packed(FACES, "u16")}]
    report["views"] = [view(name, [{"name": f"a {name}", "parts": [shape]}]) for name, shape in SHAPES.items()]
    report["views"].append(
        view("floor", [{"name": "a floor", "parts": [{"kind": "halfspace", "normal": [0, 0, 2], "offset": -1}]}])
    )
    rows = [(x, y) for y in range(3) for x in range(4)]
    crowd = [
        {"name": f"obstacle {x} {y} of many", "parts": [{"kind": "sphere", "radius": 0.02, "center": [x / 9, y / 9, 0]}]}
        for x, y in rows
    ]
    report["views"].append(view("crowd", crowd))
    path = tmp_path_factory.mktemp("shapes") / "report.html"
    write_report(report, path)
    return path


def test_the_pointer_finds_every_kind_of_shape_where_it_stands(visit: Windows, shapes: Path) -> None:
    window = visit().open(shapes)
    page = window.page
    for i, name in enumerate(SHAPES):
        page.evaluate(f"spacearm.view({i})")
        page.evaluate("(spacearm.stage.set('names', false), spacearm.stage.look('front'), spacearm.stage.draw())")
        box = window.rect("canvas[role=img]")
        for x, y, told in ((0.5, 0.5, f"a {name}"), (0.01, 0.7, "")):  # the middle, and beside it
            page.mouse.move(box["x"] + box["width"] * x, box["y"] + box["height"] * y)
            window.frame()
            tip = page.locator(".stage-pointer")
            assert (tip.text_content() if tip.is_visible() else "") == told, name
    assert window.errors == []


def test_a_half_space_is_drawn_and_the_grid_lies_on_it(visit: Windows, shapes: Path) -> None:
    window = visit().open(shapes)
    window.page.evaluate(f"spacearm.view({len(SHAPES)})")
    window.frame()
    assert window.page.locator(".stage-note").inner_text().endswith("at z = \u22120.5 m")
    assert window.errors == []


def test_names_do_not_overlap_and_stay_in_the_picture(visit: Windows, shapes: Path) -> None:
    for size in ((1280, 800), (390, 844)):
        window = visit(size=size).open(shapes)
        window.page.evaluate(f"spacearm.view({len(SHAPES) + 1})")
        for look in ("corner", "top", "front", "side"):
            window.page.evaluate(f"(spacearm.stage.look('{look}'), spacearm.stage.draw())")
            script = """[...document.querySelectorAll('.stage-name')].filter((one) => one.style.visibility === 'visible')
                .map((one) => { const b = one.getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; })"""
            boxes = window.page.evaluate(script)
            picture = window.rect("canvas[role=img]")
            assert len(boxes) >= 3, look
            for a, b in combinations(boxes, 2):
                assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], look
            for left, top, right, bottom in boxes:
                assert left >= picture["x"], look
                assert top >= picture["y"], look
                assert right <= picture["x"] + picture["width"], look
                assert bottom <= picture["y"] + picture["height"], look


def test_nothing_is_drawn_while_nothing_changes(visit: Windows, small: Path) -> None:
    window = visit().open(small)
    page = window.page
    page.evaluate(
        "(() => { const s = spacearm.stage, draw = s.draw.bind(s); window.drawn = 0; s.draw = () => { drawn++; draw(); }; })()"
    )
    for _ in range(5):
        window.frame()
    assert page.evaluate("drawn") == 0
    page.evaluate("(spacearm.stage.seek(1), spacearm.stage.seek(2), spacearm.stage.seek(3))")
    window.frame()
    assert page.evaluate("drawn") == 1  # once, whatever was asked for in between


def test_views_and_themes_leave_nothing_behind(visit: Windows, shapes: Path) -> None:
    window = visit().open(shapes)
    script = f"""() => {{
        const {{ stage, page }} = spacearm;
        for (const theme of ["dark", "light"]) {{
            stage.setTheme(theme);
            for (let i = 0; i < {len(SHAPES) + 2}; i++) {{ stage.show(page.views[i]); stage.draw(); }}
        }}
        const {{ geometries, textures }} = stage.renderer.info.memory;
        return [geometries, textures, document.querySelectorAll(".stage-label").length];
    }}"""
    first = window.page.evaluate(script)
    assert window.page.evaluate(script) == first
