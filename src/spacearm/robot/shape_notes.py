"""What to tell about a robot's collision shapes: how their files were read, shapes without extent, doubtful units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from spacearm.robot.envelope import Shape

OVERSIZED = 20.0
"""A mesh so many times larger than the whole chain of joints is taken for one in millimetres."""

_LEAST = 2.0  # [m] smaller meshes are nobody's millimetres
_NAMED = 6  # links in a note
_FLAT = 1e-9  # share of a shape's largest extent, below which it is a surface


def chain_length(joints: Iterable[tuple[str, str, float]]) -> float:
    """Return the longest way from a root to a link along the joints' origins [m].

    Args:
        joints: parent link, child link, and the length of the joint's origin [m]; circles are cut.
    """
    above = {child: (parent, length) for parent, child, length in joints}
    longest = 0.0
    for link in above:
        at, total, passed = link, 0.0, set[str]()
        while at in above and at not in passed:
            passed.add(at)
            at, length = above[at]
            total += length
        longest = max(longest, total)
    return longest


def looks_like_millimetres(size: float, chain: float) -> bool:
    """Whether a mesh of a size [m] is too large for a robot whose joints reach so far [m]."""
    return size > _LEAST and 0 < chain * OVERSIZED < size


def shape_notes(shapes: Mapping[str, Sequence[Shape]], chain: float) -> tuple[str, ...]:
    """Return a sentence for each kind of thing that is to be known.

    Args:
        shapes: each link's collision shapes.
        chain: `chain_length` of the robot [m].
    """
    of_kind: dict[str, list[str]] = {}
    for link, own in shapes.items():
        for shape in own:
            for kind in _kinds(shape, chain):
                of_kind.setdefault(kind, []).append(link)
    return tuple(f"{kind}: {_listed(dict.fromkeys(links))}" for kind, links in of_kind.items())


def _kinds(shape: Shape, chain: float) -> list[str]:
    kinds = [f"mesh files, {note}" for note in shape.notes]
    if shape.triangles is None:
        if min(shape.size) <= 0:
            kinds.append(f"a {shape.kind} with an edge or radius of 0 m is enclosed as what is left of it, a line or a point")
        return kinds
    extent = np.ptp(shape.triangles.reshape(-1, 3), axis=0)
    if looks_like_millimetres(float(extent.max()), chain):
        kinds.append(
            f"meshes far larger than the {chain:.3g} m that the joints reach; if they are in millimetres, write "
            'scale="0.001 0.001 0.001"'
        )
    spread = np.linalg.svd(_corners(shape) - _corners(shape)[0], compute_uv=False)
    if spread[-1] <= _FLAT * spread[0]:
        kinds.append("a mesh that is flat has no inside, and is enclosed as a plate without thickness")
    return kinds


def _corners(shape: Shape) -> np.ndarray:
    assert shape.triangles is not None
    points = shape.triangles.reshape(-1, 3)
    return points[:: max(1, len(points) // 2000)]


def _listed(links: Iterable[str]) -> str:
    names = list(links)
    more = f", ... ({len(names)} links)" if len(names) > _NAMED else ""
    return ", ".join(f"'{name}'" for name in names[:_NAMED]) + more
