"""Views of one report taken into another: what both have, robots and meshes, is stored once."""

from __future__ import annotations

from typing import Any

Data = dict[str, Any]


def take_views(page: Data, other: Data) -> list[Data]:
    """Take the robots and meshes of another page into a page, and return the other's views as they stand there.

    Args:
        page: with the keys "robots" and "meshes"; its robots and meshes are added to.
        other: a whole page.
    """
    meshes = _places(page["meshes"], other["meshes"])
    robots = _places(page["robots"], [_with_meshes(robot, meshes) for robot in other["robots"]])
    views: list[Data] = []
    for view in other["views"]:
        actors = [{**actor, "robot": robots[actor["robot"]]} for actor in view["actors"]]
        views.append({**view, "actors": actors, "obstacles": _with_meshes(view["obstacles"], meshes)})
    return views


def _places(known: list[Data], added: list[Data]) -> list[int]:
    """Return where each of the added ones is among the known ones, which those that are new are appended to."""
    places: list[int] = []
    for one in added:
        if one not in known:
            known.append(one)
        places.append(known.index(one))
    return places


def _with_meshes(value: Any, meshes: list[int]) -> Any:
    """Return plain values with geometries that refer to the meshes of the page."""
    if isinstance(value, list):
        return [_with_meshes(one, meshes) for one in value]
    if not isinstance(value, dict):
        return value
    moved = {key: _with_meshes(one, meshes) for key, one in value.items()}
    return moved | {"mesh": meshes[value["mesh"]]} if value.get("kind") == "mesh" else moved
