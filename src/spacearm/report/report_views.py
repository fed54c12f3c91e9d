"""Views of a report that are not of one plan: plots and tables alone, and those of another report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

Data = dict[str, Any]


def verdict(tone: Literal["good", "bad", "plain"], headline: str, text: str = "") -> Data:
    """Return what stands at the top of a view."""
    return {"tone": tone, "headline": headline, "text": text}


def flat_view(name: str, said: Data, *, plots: Sequence[Data] = (), sections: Sequence[Data] = ()) -> Data:
    """Return a view of plots and tables alone, without a picture in space.

    Args:
        name: of the view.
        said: its verdict.
        plots: none over the clock, for there is none.
        sections: below the plots.
    """
    made: Data = {"name": name, "verdict": said, "clock": {"unit": "s", "duration": 0.0}}
    made |= {"actors": [], "obstacles": [], "targets": []}
    return made | {"plots": list(plots), "sections": list(sections)}


def take_views(page: Data, other: Data) -> list[Data]:
    """Take the robots and meshes of another page into a page, each once, and return the other's views as they stand there.

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
