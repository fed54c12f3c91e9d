"""What a certificate says of each pair of bodies, beside Coal's distances of that pair alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from spacearm.geometry import Scene
from spacearm.proof import Certificate
from spacearm.proof.required_clearance import required_clearance
from spacearm.robot import Robot
from support.oracles.coal_shapes import least_distances

Pair = tuple[str, str]  # a link, and what a certificate calls the other body


def distances(robot: Robot, scene: Scene, frames: np.ndarray) -> Iterator[tuple[Pair, np.ndarray]]:
    """Yield each pair that must keep clear, with its distances (rows,) [m] by Coal; frames (rows, joints, 4, 4)."""
    for link in dict.fromkeys(part.name for part in robot.shapes):
        alone = _only(robot, link)
        for i, obstacle in enumerate(scene.obstacles):
            yield (link, f"obstacle {scene.called(i)}"), least_distances(alone, Scene([obstacle]), frames)
    for one, other in robot.self_pairs:
        yield (one, f"link '{other}'"), least_distances(_only(robot, one, other), Scene(), frames)


def _only(robot: Robot, *links: str) -> Robot:
    shapes = tuple(part for part in robot.shapes if part.name in links)
    return replace(
        robot, shapes=shapes, capsules=None, self_pairs=(links,) if len(links) == 2 else (), apart=None, unchecked=()
    )  # type: ignore[arg-type]


def stated(certificate: Certificate, pair: Pair, t: np.ndarray) -> np.ndarray:
    """What a certificate that holds states of a pair at times (rows,): the distance is more than this [m]."""
    required = required_clearance(certificate.robot, certificate.scene, certificate.required, certificate.required_by_pair)
    link, other = required.links.index(pair[0]), pair[1]
    if other.startswith("link "):
        r = required.between_links[link, required.links.index(other[6:-1])]
    else:
        names = [f"obstacle {certificate.scene.called(i)}" for i in range(len(certificate.scene.obstacles))]
        r = required.to_obstacles[link, names.index(other)]
    assert certificate.clearance is not None
    out = np.full(len(t), max(float(r), certificate.clearance))
    for near in certificate.near_pairs:
        if {near.link, near.other} == set(pair) or {f"link '{near.link}'", near.other} == {f"link '{pair[0]}'", other}:
            assert near.proven is not None
            assert near.held_to < near.proven <= near.measured + 1e-8  # Coal is a few nanometres off
            out[(near.begin <= t) & (t <= near.end)] = near.proven
    return out
