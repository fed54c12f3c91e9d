"""Views taken from another report: what both have is stored once, and refers to the right place."""

from __future__ import annotations

from typing import Any

from spacearm.report.report_views import flat_view, take_views, verdict


def geometry(mesh: int) -> dict[str, Any]:
    return {"kind": "mesh", "mesh": mesh, "T": [1.0] * 12}


def robot(name: str, mesh: int) -> dict[str, Any]:
    return {"name": name, "shapes": [{"name": "link", "joint": 0, "geometry": geometry(mesh)}], "visuals": []}


def page(robots: list[dict[str, Any]], meshes: list[str], obstacle: int) -> dict[str, Any]:
    view = flat_view("a", verdict("plain", "said")) | {
        "actors": [{"name": str(i), "robot": i} for i in range(len(robots))],
        "obstacles": [{"name": "o", "parts": [geometry(obstacle), {"kind": "sphere", "radius": 1.0}]}],
    }
    return {"robots": robots, "meshes": [{"positions": name} for name in meshes], "views": [view]}


def test_robots_and_meshes_are_stored_once_and_found_again() -> None:
    ours: dict[str, Any] = {"robots": [], "meshes": [{"positions": "other"}], "views": []}
    first = page([robot("one", 1), robot("two", 0)], ["shared", "one's"], 0)
    second = page([robot("two", 1)], ["its own", "shared"], 0)
    views = [*take_views(ours, first), *take_views(ours, second)]
    assert [mesh["positions"] for mesh in ours["meshes"]] == ["other", "shared", "one's", "its own"]
    assert [one["name"] for one in ours["robots"]] == ["one", "two"]
    assert [one["shapes"][0]["geometry"]["mesh"] for one in ours["robots"]] == [2, 1]
    assert [[actor["robot"] for actor in view["actors"]] for view in views] == [[0, 1], [1]]
    assert [view["obstacles"][0]["parts"][0]["mesh"] for view in views] == [1, 3]
    assert first["views"][0]["obstacles"][0]["parts"][0]["mesh"] == 0  # what was taken from is as it was


def test_a_flat_view_has_no_picture_and_no_clock() -> None:
    view = flat_view("Overview", verdict("good", "all", "of them"))
    assert (view["actors"], view["obstacles"], view["targets"], view["clock"]["duration"]) == ([], [], [], 0.0)
    assert view["verdict"] == {"tone": "good", "headline": "all", "text": "of them"}
