"""Drawn convex shapes of every kind with their rounding, for links and obstacles, and robots made of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from spacearm.geometry import Box, Capsule, ConvexShape, Cylinder, Obstacle, Polytope, PolytopeSet, Sphere, core_of
from spacearm.robot import LinkShape, Robot
from support import strategies
from support.dense_samples import arms
from support.drawn_shapes import half_spaces, sphere_sets

ROUNDINGS = st.sampled_from([0.0, 0.0, 1e-3, 0.1])
SIZES = st.floats(1e-3, 0.6, allow_subnormal=False)
MOST = 40  # vertices of a polytope: more than are all followed


@st.composite
def polytopes(draw: st.DrawFn, largest: float = 0.5) -> Polytope:
    """Hulls of points: some are points, segments or flat, some have points inside, some many vertices."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.sampled_from([1, 2, 3, 4, 5, 8, 12, MOST]))
    points = rng.uniform(-1, 1, (count, 3))
    if draw(st.booleans()):
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    points *= [draw(st.sampled_from([0.0, 0.01, 0.3, 1.0])) if i else 1.0 for i in range(3)]
    T = draw(strategies.transforms())
    size = draw(st.sampled_from([0.05, 1.0])) * largest
    return Polytope(size * points @ T[:3, :3].T + T[:3, 3], rounding=draw(ROUNDINGS))


def shapes() -> st.SearchStrategy[ConvexShape]:
    """Convex shapes of every kind."""
    boxes = st.tuples(SIZES, SIZES, SIZES).map(np.array)
    return st.one_of(
        st.builds(Sphere, strategies.points(), SIZES),
        st.builds(Capsule, strategies.points(), strategies.points(), SIZES),
        st.builds(Box, boxes, strategies.transforms(), rounding=ROUNDINGS),
        st.builds(Cylinder, SIZES, SIZES, strategies.transforms(), rounding=ROUNDINGS),
        polytopes(),
    )


def polytope_sets() -> st.SearchStrategy[PolytopeSet]:
    return st.lists(polytopes(), min_size=1, max_size=4).map(PolytopeSet)


def obstacles() -> st.SearchStrategy[Obstacle]:
    """Obstacles of every kind, some far away."""
    return st.one_of(shapes(), shapes(), half_spaces(), sphere_sets(), polytope_sets())


@st.composite
def shaped_arms(draw: st.DrawFn, *, most: int = 4) -> Robot:
    """Drawn trees with shapes of every kind on their links, and pairs of links that must keep clear of each other."""
    robot = draw(arms())
    joint = st.integers(-1, len(robot.joints) - 1)
    parts = [
        LinkShape(name=f"link_{at}_{draw(st.integers(0, 1))}", joint=at, shape=draw(shapes()))
        for at in draw(st.lists(joint, min_size=1, max_size=most))
    ]
    links = sorted({part.name for part in parts})
    every = [(one, other) for i, one in enumerate(links) for other in links[i + 1 :]]
    pairs = draw(st.lists(st.sampled_from(every), unique=True)) if every else []
    return replace(robot, shapes=tuple(parts), self_pairs=tuple(pairs))


def points_of(shape: ConvexShape, count: int, rng: np.random.Generator) -> np.ndarray:
    """Points (count, 3) of the core of a shape, its corners or rims among them, by the definition of the shape."""
    core = core_of(shape)
    if core.kind == "polytope":
        weights = rng.dirichlet(np.full(len(core.vertices), 0.2), count)
        own = np.concatenate([core.vertices, weights @ core.vertices])[:count]
    elif core.kind == "cylinder":
        angle, share = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.choice([0.3, 1.0, 1.0], count))
        z = rng.choice([-1.0, 1.0, 1.0, 0.4], count)
        own = np.column_stack([share * np.cos(angle), share * np.sin(angle), z]) * core.half
    else:
        own = rng.choice([-1.0, 1.0, 1.0, 0.4], (count, 3)) * core.half
    return own @ core.T[:3, :3].T + core.T[:3, 3]
