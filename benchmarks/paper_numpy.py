"""The paper's objective in plain NumPy: what a swarm costs without a kernel.

Equations (1) to (7), (10) and (11) of Zhang et al. 2022 (doi 10.3390/sym14050938), vectorised over particles,
for the reading of the experiment that spacearm declares (robot, obstacles, weights, four distinct joint
centres). It is the common yardstick of `compare_swarms.py`: each library minimises this very function.

    python benchmarks/paper_numpy.py          # time each formulation
    python benchmarks/paper_numpy.py --json paper_numpy.json
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "src"))  # for environments where spacearm is not installed

from spacearm.study.numpy_reference import (
    AXES,
    GOAL,
    LINKS,
    LOWER,
    OBSTACLES,
    RADIUS,
    UPPER,
    Mode,
    by_matrices,
    rotation,
    with_goal,
)

Formulation = Callable[[np.ndarray, Mode], tuple[np.ndarray, np.ndarray]]

PENALTY = 100.0  # weight of the violation where a library knows no constraints


def objective(q: np.ndarray, mode: Mode = "goal") -> tuple[np.ndarray, np.ndarray]:
    """Fitness (4) and violation of configurations q (n, 7) [rad], each (n,); the fastest way below."""
    return by_components(q, mode)


def penalised(q: np.ndarray, mode: Mode = "goal") -> np.ndarray:
    """The weighted-penalty form F + 100 violation of configurations q (n, 7), (n,)."""
    fitness, violation = objective(q, mode)
    return fitness + PENALTY * violation


# --- 1. as one writes it first, `by_matrices`: rotation matrices, distances by broadcasting. It is in the package, whose
# own benchmarks measure by it.


# --- 2. einsum


def by_einsum(q: np.ndarray, mode: Mode = "goal") -> tuple[np.ndarray, np.ndarray]:
    """The same with einsum for the products and the squared lengths."""
    links, obstacles, goal = (a.astype(q.dtype) for a in (LINKS, OBSTACLES, GOAL))
    r = [rotation(axis, angle) for axis, angle in zip(AXES, q.T, strict=True)]
    upper = np.einsum("nij,njk->nik", r[0], r[1])  # joint 3 turns about its link: no effect on the elbow
    fore = np.einsum("nij,njk,nkl->nil", upper, r[2], r[3], optimize=["einsum_path", (0, 1), (0, 1)])
    tool = np.einsum("nij,njk,nk->ni", r[4], r[5], r[6][:, :, 1], optimize=["einsum_path", (1, 2), (0, 1)])
    centres = np.zeros((len(q), 4, 3), q.dtype)
    centres[:, 1] = links[0] * upper[:, :, 1]
    centres[:, 2] = centres[:, 1] + links[1] * fore[:, :, 1]
    centres[:, 3] = centres[:, 2] + links[2] * np.einsum("nij,nj->ni", fore, tool)

    offset = obstacles - centres[:, :, None, :]  # (n, 4, 3 obstacles, 3)
    square = np.einsum("npoi,npoi->npo", offset, offset)
    f1 = np.sqrt(square).sum(axis=(1, 2))
    along = centres[:, 1:] - centres[:, :3]
    dot = np.einsum("nloi,nli->nlo", offset[:, :3], along)
    t = np.clip(dot / (links**2)[:, None], 0, 1)
    nearest = np.sqrt(np.maximum(0, square[:, :3] + t * (t * (links**2)[:, None] - 2 * dot)))
    violation = np.maximum(0, RADIUS - nearest).sum(axis=(1, 2))
    return with_goal(f1, np.linalg.norm(centres[:, 3] - goal, axis=-1), violation, mode)


# --- 3. coordinate by coordinate, using the arm's structure

SHOULDER_SQUARE = np.sum(OBSTACLES**2, axis=1)  # the shoulder stays at the origin
SHOULDER_F1 = float(np.sqrt(SHOULDER_SQUARE).sum())


def by_components(q: np.ndarray, mode: Mode = "goal") -> tuple[np.ndarray, np.ndarray]:
    """Particles along the last, contiguous axis; no matrices; distances from squared distances alone.

    The arm is turned from its tip to its root, so only the three moving centres are carried. The distance
    from an obstacle to a link of length L follows from the squared distances a, b to its two ends: the
    projection lies at s = (a - b + L^2) / 2L along it, and the square is a - 2 s' s + s'^2 with s' = s
    cut to [0, L].
    """
    angles = np.ascontiguousarray(q.T)  # (7, n)
    sin, cos = np.sin(angles), np.cos(angles)
    p = _centres(sin, cos)  # (3 coordinates, 3 moving centres, n)

    kind = q.dtype
    offset = p[:, :, None] - OBSTACLES.T.astype(kind)[:, None, :, None]  # (3, 3 centres, 3 obstacles, n)
    offset *= offset
    square = np.empty((4, *offset.shape[2:]), kind)  # (4 centres, 3 obstacles, n)
    square[0] = SHOULDER_SQUARE[:, None]
    np.add(offset[0], offset[1], out=square[1:])
    square[1:] += offset[2]
    f1 = np.sqrt(square[1:]).reshape(9, -1).sum(axis=0)  # (5)
    f1 += kind.type(SHOULDER_F1)

    length = LINKS.astype(kind)[:, None, None]
    s = square[:3] - square[1:]
    s += length * length
    s *= 0.5 / length
    cut = np.minimum(np.maximum(s, 0), length)  # (2), (3): on the link, or on an extension
    s *= -2
    s += cut
    s *= cut
    s += square[:3]
    hinge = RADIUS - np.sqrt(np.maximum(s, 0, out=s), out=s)
    violation = np.maximum(hinge, 0, out=hinge).reshape(9, -1).sum(axis=0)  # (1), (10), (11)

    to_goal = p[:, 2] - GOAL.astype(kind)[:, None]
    to_goal *= to_goal
    return with_goal(f1, np.sqrt(to_goal.sum(axis=0)), violation, mode)


def _centres(sin: np.ndarray, cos: np.ndarray) -> np.ndarray:
    """Elbow, wrist and end effector, (3 coordinates, 3 centres, n), for sines and cosines (7, n)."""
    s1, s2, s3, s4, s5, s6, s7 = sin
    c1, c2, c3, c4, c5, c6, c7 = cos
    l1, l2, l3 = LINKS.tolist()
    x7, y7 = -l3 * s7, l3 * c7  # Rz(q7) of (0, l3, 0)
    z6 = s6 * y7
    x5, z5 = c5 * x7 + s5 * z6, c5 * z6 - s5 * x7  # Ry(q5) Rx(q6)
    y5 = c6 * y7 + l2
    p = np.empty((3, 3, sin.shape[1]), sin.dtype)
    x, y, z = p
    y[0], y[1], y[2] = l1, l2 * c4 + l1, s4 * x5 + c4 * y5 + l1
    xe = c4 * x5 - s4 * y5
    xw = -l2 * s4
    x[0], x[1], x[2] = 0, c3 * xw, c3 * xe + s3 * z5  # Ry(q3)
    z[0], z[1], z[2] = 0, -s3 * xw, c3 * z5 - s3 * xe
    y_turned = c2 * y - s2 * z  # Rx(q2), on the three centres at once
    p[2] = s2 * y + c2 * z
    p[1] = s1 * x + c1 * y_turned  # Rz(q1)
    p[0] = c1 * x - s1 * y_turned
    return p


FORMULATIONS: dict[str, Formulation] = {
    "rotation matrices": by_matrices,
    "einsum": by_einsum,
    "components": by_components,
}


def require_agreement(q: np.ndarray) -> None:
    """Stop when the formulations do not say the same of configurations q (n, 7)."""
    expected = by_matrices(q)
    for function in FORMULATIONS.values():
        for value, reference in zip(function(q, "goal"), expected, strict=True):
            np.testing.assert_allclose(value, reference, rtol=0, atol=1e-12)  # the sums of some 20 lengths near 1 m


def nanoseconds(function: Formulation, q: np.ndarray, *, repeats: int = 30) -> float:
    """Median time of one configuration [ns] when `function` evaluates the rows of q together."""
    loops = 20
    function(q, "goal")
    samples = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(loops):
            function(q, "goal")
        samples.append((time.perf_counter() - start) / loops)
    return float(np.median(samples)) / len(q) * 1e9


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="+", default=[1, 300, 3000], help="particles evaluated together")
    parser.add_argument("--json", metavar="FILE", help="also write the figures to FILE")
    args = parser.parse_args()
    rng = np.random.default_rng(0)
    require_agreement(rng.uniform(LOWER, UPPER, (2000, 7)))
    figures = []
    for rows in args.rows:
        q = rng.uniform(LOWER, UPPER, (rows, 7))
        for name, function in FORMULATIONS.items():
            for dtype in (np.float64, np.float32):
                ns = nanoseconds(function, q.astype(dtype))
                figures.append({"rows": rows, "formulation": name, "dtype": np.dtype(dtype).name, "ns": ns})
    print(f"NumPy {np.__version__}, Python {sys.version.split()[0]}; ns per configuration")
    for row in figures:
        print(f"{row['rows']:6d} rows  {row['formulation']:<18s} {row['dtype']}  {row['ns']:10.0f}")
    if args.json:
        with open(args.json, "w", encoding="utf-8") as file:
            json.dump({"numpy": np.__version__, "figures": figures}, file, indent=1)


if __name__ == "__main__":
    main()
