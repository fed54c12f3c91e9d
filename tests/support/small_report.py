"""A small page written by hand: a two-link arm, a swarm, a view without a picture, and plots of every kind."""

from __future__ import annotations

from typing import Any

import numpy as np

from spacearm.report.report_page import packed, plot, quantised, section, series, transform

T = np.linspace(0.0, 10.0, 101)
CLEARANCE = np.where(T < 5, 20.0 - 4 * T, 0.02 + 10 * (T - 5) ** 2)  # [mm]: below the floor at 5 s
FLOOR = 0.1


def placed(x: float, y: float, z: float) -> list[float]:
    """Return a transform that only moves."""
    moved = np.eye(4)
    moved[:3, 3] = x, y, z
    return transform(moved)


def robot() -> dict[str, Any]:
    """Return an arm of two links of 1 m that turns about z."""
    joints = [
        {"name": name, "kind": "revolute", "parent": i - 1, "T": placed(float(i), 0, 0), "dof": i, "multiplier": 1, "offset": 0}
        for i, name in enumerate(("shoulder", "elbow"))
    ]
    link = {"kind": "capsule", "radius": 0.08, "a": [0, 0, 0], "b": [1, 0, 0]}
    return {
        "name": "two-link arm",
        "joints": joints,
        "dofNames": ["shoulder", "elbow"],
        "tip": {"name": "hand", "joint": 1, "T": placed(1, 0, 0)},
        "shapes": [{"name": name, "joint": i, "geometry": link} for i, name in enumerate(("upper", "fore"))],
        "visuals": [],
    }


def joints() -> np.ndarray:
    """Return the joints' angles over the clock, (101, 2) [rad]."""
    return np.stack([0.1 * T, 0.02 * T**2], axis=1)


def arm_view() -> dict[str, Any]:
    """Return a view of the arm with its plots."""
    q = joints()
    rates = np.stack([np.full_like(T, 0.1), 0.04 * T], axis=1)
    names = "shoulder", "elbow"
    curves = [series(name, np.degrees(q[:, i]), i) for i, name in enumerate(names)]
    speeds = [series(name, np.degrees(rates[:, i]), i) for i, name in enumerate(names)]
    points = np.zeros((len(T), 2, 3))
    points[:, 1, 2] = 1e-3 * CLEARANCE
    return {
        "name": "arm",
        "verdict": {"tone": "good", "headline": "Proven", "text": "A motion was found."},
        "clock": {"unit": "s", "duration": 10.0},
        "actors": [
            {
                "name": "arm",
                "robot": 0,
                "knots": {"t": packed(T, "f64"), "q": packed(q), "dq": packed(rates), "baseAt": placed(0, 0, 0)},
                "tone": 0,
                "ghost": False,
            }
        ],
        "obstacles": [{"name": "ball", "parts": [{"kind": "sphere", "radius": 0.2, "center": [0.5, 1.2, 0]}]}],
        "targets": [{"name": "goal", "kind": "position", "T": placed(0, 2, 0), "radius": 0.01}],
        "closest": {
            "t": packed(T),
            "distance": packed(1e-3 * CLEARANCE),
            "points": packed(points),
            "pair": packed(np.zeros(len(T)), "u16"),
            "names": ["fore - ball"],
        },
        "plots": [
            plot("joints", "Joint angles", "deg", T, curves, limits=[(0, -180, 180), (1, None, 200)]),
            plot("rates", "Joint rates", "deg/s", T, speeds),
            plot(
                "clearance",
                "Clearance",
                "mm",
                T,
                [series("fore - ball", CLEARANCE)],
                log=True,
                floor=FLOOR,
                lines=[(5, "asked")],
            ),
        ],
        "sections": [
            section("Pairs", table=(("pair", "mm"), [[f"pair {i}", f"{i}.5"] for i in range(20)])),
            section("Make it again", code="spacearm plan problem.yaml --seed 1", opened=True),
        ],
    }


def swarm_view() -> dict[str, Any]:
    """Return a view of particles over 12 iterations."""
    points = np.random.default_rng(1).normal(size=(12, 8, 3))
    shares, low, high = quantised(points)
    x = np.arange(12)
    fitness = [series("best", 10.0**-x, 0), *(series(f"run {i}", 10.0 ** (1 - x), 6, faint=True) for i in range(5))]
    success = [series("hybrid", [0.0, 50, 50, 100], 0, steps=True)]
    return {
        "name": "swarm",
        "verdict": {"tone": "plain", "headline": "12 iterations", "text": "8 particles."},
        "clock": {"unit": "iteration", "duration": 11, "step": 1},
        "actors": [],
        "obstacles": [],
        "targets": [],
        "cloud": {"name": "particles", "low": low, "high": high, "points": shares},
        "plots": [
            plot("fitness", "Fitness", "-", x, fitness, x_label="iteration", log=True),
            plot("success", "Success", "%", [0.1, 1, 2, 10], success, clock=False, log_x=True),
        ],
        "sections": [],
    }


def tables_view() -> dict[str, Any]:
    """Return a view without a picture and without a clock."""
    curve = plot("size", "Sizes", "m", [1.0, 2, 3], [series("one", [1.0, np.nan, 3])], x_label="number", clock=False)
    return {
        "name": "tables",
        "verdict": {"tone": "bad", "headline": "Not found", "text": "No motion was found."},
        "clock": {"unit": "s", "duration": 0},
        "actors": [],
        "obstacles": [],
        "targets": [],
        "plots": [],
        "sections": [section("Numbers", rows=[("a", "1")], notes=["A note."], plots=[curve])],
    }


def small_report() -> dict[str, Any]:
    """Return a page of three views: an arm, a swarm, tables only."""
    return {
        "title": "Small <report> & more",
        "block": [[f"label {i}", f"value {i}"] for i in range(7)],
        "robots": [robot()],
        "meshes": [],
        "views": [arm_view(), swarm_view(), tables_view()],
        "sections": [section("Versions", rows=[("spacearm", "0.1.0")])],
    }
