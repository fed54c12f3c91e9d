"""Drawn obstacles of every shape, and points of them by the shapes' definitions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Polytope, PolytopeSet, Sphere, SphereSet
from support import strategies

SIZES = st.floats(0.01, 1.0, allow_subnormal=False)
NAMES = st.sampled_from(["", "module", "Überwachung", "a 'b'"])


def directions() -> st.SearchStrategy[np.ndarray]:
    """Vectors (3,) that are not short."""
    return strategies.points(1.0).filter(lambda v: np.linalg.norm(v) > 1e-2)


def boxes() -> st.SearchStrategy[Box]:
    return st.builds(Box, st.tuples(SIZES, SIZES, SIZES).map(np.array), strategies.transforms(), name=NAMES)


def cylinders() -> st.SearchStrategy[Cylinder]:
    return st.builds(Cylinder, SIZES, SIZES, strategies.transforms(), name=NAMES)


def spheres() -> st.SearchStrategy[Sphere]:
    return st.builds(Sphere, strategies.points(), SIZES, name=NAMES)


def capsules() -> st.SearchStrategy[Capsule]:
    return st.builds(Capsule, strategies.points(), strategies.points(), SIZES, name=NAMES)


def half_spaces() -> st.SearchStrategy[HalfSpace]:
    return st.builds(HalfSpace, directions(), strategies.points(), name=NAMES)


@st.composite
def sphere_sets(draw: st.DrawFn, most: int = 8) -> SphereSet:
    count = draw(st.integers(1, most))
    centers = np.array([draw(strategies.points()) for _ in range(count)])
    radii = np.array([draw(SIZES) for _ in range(count)])
    return SphereSet(centers, radii, excess=draw(st.none() | st.floats(0, 1, allow_subnormal=False)), name=draw(NAMES))


ROUNDINGS = st.just(0.0) | st.floats(0.01, 0.3, allow_subnormal=False)


def rounded_boxes() -> st.SearchStrategy[Box]:
    return st.builds(Box, st.tuples(SIZES, SIZES, SIZES).map(np.array), strategies.transforms(), rounding=ROUNDINGS, name=NAMES)


def rounded_cylinders() -> st.SearchStrategy[Cylinder]:
    return st.builds(Cylinder, SIZES, SIZES, strategies.transforms(), rounding=ROUNDINGS, name=NAMES)


def polytopes() -> st.SearchStrategy[Polytope]:
    """Hulls of 4 to 12 points, some flat."""
    points = st.tuples(st.integers(4, 12), st.integers(0, 999), st.booleans(), strategies.points()).map(
        lambda drawn: np.random.default_rng(drawn[1]).normal(size=(drawn[0], 3)) * [1, 1, 0 if drawn[2] else 1] + drawn[3]
    )
    return st.builds(Polytope, points, rounding=ROUNDINGS, name=NAMES)


def polytope_sets(most: int = 4) -> st.SearchStrategy[PolytopeSet]:
    return st.builds(PolytopeSet, st.lists(polytopes(), min_size=1, max_size=most).map(tuple), name=NAMES)


def convex_shapes() -> st.SearchStrategy[Obstacle]:
    """Shapes that a link may have."""
    return st.one_of(spheres(), capsules(), rounded_boxes(), rounded_cylinders(), polytopes())


def bodies() -> st.SearchStrategy[Obstacle]:
    """Obstacles of finite size."""
    return st.one_of(spheres(), capsules(), boxes(), cylinders(), sphere_sets())


def obstacles() -> st.SearchStrategy[Obstacle]:
    """Obstacles of every shape."""
    return bodies() | half_spaces()


def points_in(obstacle: Obstacle, count: int, rng: np.random.Generator) -> np.ndarray:
    """Points (count, 3) of a body, most of them far out, by its definition."""
    turned = rng.normal(size=(count, 3))
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    if isinstance(obstacle, Sphere):
        return obstacle.center + obstacle.radius * turned
    if isinstance(obstacle, Capsule):
        return obstacle.a + rng.random((count, 1)) * (obstacle.b - obstacle.a) + obstacle.radius * turned
    if isinstance(obstacle, SphereSet):
        ball = rng.integers(0, len(obstacle.radii), count)
        return obstacle.centers[ball] + obstacle.radii[ball, None] * turned
    if isinstance(obstacle, PolytopeSet):
        piece = rng.integers(0, len(obstacle.pieces), count)
        each = [points_in(one, count, rng) for one in obstacle.pieces]
        return np.array([each[k][i] for i, k in enumerate(piece.tolist())]).reshape(-1, 3)
    if isinstance(obstacle, Polytope):
        weights = rng.dirichlet(np.full(len(obstacle.vertices), 0.2), count)
        return weights @ obstacle.vertices + obstacle.rounding * turned
    if isinstance(obstacle, (Box, Cylinder)) and obstacle.rounding:
        return points_in(replace(obstacle, rounding=0.0), count, rng) + obstacle.rounding * turned
    if isinstance(obstacle, Box):
        local = (rng.random((count, 3)) - 0.5) * obstacle.size
    else:
        assert isinstance(obstacle, Cylinder)
        angle, radius = rng.uniform(0, 2 * np.pi, count), obstacle.radius * np.sqrt(rng.random(count))
        local = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), (rng.random(count) - 0.5) * obstacle.length])
    return local @ obstacle.pose[:3, :3].T + obstacle.pose[:3, 3]
