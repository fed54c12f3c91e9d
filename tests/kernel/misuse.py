"""Calls of the kernel that must be refused, each tried in a process of its own, for some would end it.

`python -m kernel.misuse` tries them all and prints what came of each as JSON: the exception's name, "accepted", or the
signal that ended the process.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from kernel import objectives
from kernel.builds import Build, joint_arrays, place
from spacearm.core.native import available_levels

BUILD = Build(available_levels()[0], 64)
ROBOT = objectives.paper_robot()
BOUNDS = np.array(ROBOT.lower), np.array(ROBOT.upper)
BOX = np.zeros(2), np.ones(2)
SETTINGS: dict[str, Any] = {"particles": 20, "evaluations": 200}


# The fields of each part of a world: one point, capsule and sphere; an envelope of two links, one capsule each.
PARTS: dict[str, tuple[str, ...]] = {
    "Joints": ("parent", "prismatic", "dof", "multiplier", "offset", "rotation", "translation", "dofs"),
    "Points": ("point_joint", "point_local"),
    "PointCapsules": ("capsule_a", "capsule_b", "capsule_radius"),
    "Spheres": ("sphere_center", "sphere_radius"),
    "Envelope": ("joint", "link", "a", "b", "radius", "pairs"),
    "Masses": ("mass", "com", "inertia"),
}
PREFIX = {"Points": "point_", "PointCapsules": "capsule_", "Spheres": "sphere_"}
PLACES = {
    "Joints": "joints",
    "Points": "points",
    "PointCapsules": "point_capsules",
    "Spheres": "point_spheres",
    "Envelope": "envelope",
    "Masses": "masses",
}


def world(arrays: dict[str, Any], **more: Any) -> Any:
    """A world of those parts whose fields are given."""
    made = {}
    for part, fields in PARTS.items():
        if fields[0] in arrays:
            made[PLACES[part]] = part_of(part, arrays)
    return BUILD.named("Model")(BUILD.module.World(**made, **more))


def part_of(part: str, arrays: dict[str, Any]) -> Any:
    """A part of a world of its arrays."""
    given = {field.removeprefix(PREFIX.get(part, "")): arrays[field] for field in PARTS[part]}
    return getattr(BUILD.module, part)(**given)


def model_arrays() -> dict[str, Any]:
    return {
        **joint_arrays(ROBOT),
        "point_joint": np.array([0, 6], dtype=np.int32),
        "point_local": np.zeros((2, 3)),
        "capsule_a": np.array([0], dtype=np.int32),
        "capsule_b": np.array([1], dtype=np.int32),
        "capsule_radius": np.array([0.1]),
        "sphere_center": np.ones((1, 3)),
        "sphere_radius": np.array([0.1]),
    }


def model(**changes: Any) -> Any:
    """A model of the paper's arm with one point, capsule and sphere, some of its arrays changed."""
    return world({**model_arrays(), **changes})


def ints(*values: int) -> np.ndarray:
    return np.array(values, dtype=np.int32)


def q(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def paper(**changes: Any) -> Any:
    """The paper's objective with some of its arguments changed."""
    given = {"centers": ints(0, 1), "tip": 1, "goal": np.zeros(3), "weights": np.ones(3), **changes}
    return BUILD.named("PaperObjective")(scene=model(), **given, must_reach=True, tolerance=1e-3)


def evaluated(objective: Any, columns: int = 7) -> Any:
    return objective.evaluate(q(1, columns))


def reach(**changes: Any) -> Any:
    """A reach objective with some of its arguments changed."""
    given = {"points": ints(1), "targets": np.zeros((1, 3)), "tolerances": np.ones(1), "margin": 0.0, "home": np.zeros(7)}
    return BUILD.named("ReachObjective")(scene=surrounded(), **{**given, **changes})


SHAPES: dict[str, dict[str, Any]] = {
    "Spheres": {"center": np.ones((1, 3)), "radius": np.ones(1)},
    "Capsule": {"a": np.ones(3), "b": np.zeros(3), "radius": 1.0},
    "Box": {"center": np.ones(3), "axes": np.eye(3), "half_size": np.ones(3), "rounding": 0.1},
    "Cylinder": {"center": np.ones(3), "axis": np.array([0.0, 0, 1]), "half_length": 1.0, "radius": 1.0, "rounding": 0.1},
    "Polytope": {"vertices": np.eye(3), "rounding": 0.1},
    "HalfSpace": {"normal": np.array([0.0, 0, 1]), "offset": -1.0},
}


def shape(kind: str, **changes: Any) -> Any:
    return getattr(BUILD.module, kind)(**{**SHAPES[kind], **changes})


def envelope_arrays() -> dict[str, Any]:
    return {
        "joint": ints(0, 6),
        "link": ints(0, 1),
        "a": np.zeros((2, 3)),
        "b": np.ones((2, 3)),
        "radius": np.full(2, 0.1),
        "pairs": ints(0, 1).reshape(1, 2),
    }


def surrounded(obstacles: Any = None, pair_margins: Any = None, **changes: Any) -> Any:
    """The model with an envelope and a ball, some of its arrays changed."""
    obstacles = [shape("Spheres")] if obstacles is None else obstacles
    arrays = {**model_arrays(), **envelope_arrays(), **changes}
    made = world(arrays, obstacles=obstacles, pair_margins=pair_margins)
    made.shortfalls(q(1, 7), 0.1, False)
    made.obstacle_clearances(q(1, 7))
    return made


def margins(**changes: Any) -> Any:
    """The same with a pair that has a margin of its own."""
    given = {"body": ints(0), "obstacle": ints(0), "other": ints(-1), "margin": np.zeros(1), **changes}
    return surrounded(pair_margins=BUILD.module.PairMargins(**given))


def bodied(kind: str = "polytope", count: int = 3, origin: Any = None, axes: Any = None, **changes: Any) -> Any:
    """The same with a body that is no capsule."""
    kernel = BUILD.module
    made = kernel.ConvexShape(
        kind=getattr(kernel.CoreKind, kind), half=np.ones(3), radius=0.1, vertices=np.eye(3)[:count].copy()
    )
    solid = kernel.Solid(shape=made, axes=np.eye(3) if axes is None else axes, origin=np.zeros(3) if origin is None else origin)
    arrays = {**model_arrays(), **envelope_arrays()}
    envelope = {name: arrays[name] for name in PARTS["Envelope"]}
    envelope = kernel.Envelope(**envelope, **{"solid": ints(-1, 0), "solids": [solid], **changes})
    given = {PLACES[part]: part_of(part, arrays) for part in PARTS if part != "Envelope" and PARTS[part][0] in arrays}
    model = BUILD.named("Model")(kernel.World(**given, envelope=envelope, obstacles=[shape("Polytope")]))
    model.shortfalls(q(1, 7), 0.1, False)
    return model


def near(**changes: Any) -> Any:
    """A search with a pair that is near at an end."""
    given = {
        "pair": ints(0),
        "body": ints(0),
        "obstacle": ints(0),
        "other": ints(-1),
        "required": np.ones(1),
        "at_start": np.ones(1),
        "at_goal": np.ones((1, 2)),
        **changes,
    }
    return ran(motions(near_pairs=BUILD.module.NearPairs(**given)))


def weighed(**changes: Any) -> Any:
    """The model with masses."""
    masses = {"mass": np.ones(8), "com": q(8, 3), "inertia": q(8, 6), **changes}
    return world({**model_arrays(), **masses})


def motions(scene: Any = None, settings: Any = None, seed: int = 0, island: int = 0, **changes: Any) -> Any:
    """A search for motions with some of its arguments changed, run for a little."""
    weights = BUILD.module.MotionWeights()
    for name in BUILD.module.motion_terms:
        setattr(weights, name, changes.pop("weight", 1.0))
    given = {
        "start": np.zeros(7),
        "goals": np.ones((2, 7)),
        "lower": BOUNDS[0],
        "upper": BOUNDS[1],
        "velocity": np.ones(7),
        "acceleration": np.ones(7),
        "jerk": np.zeros(0),
        "margin": 0.0,
        "preferred_clearance": 0.1,
        "tip": 1,
        "centers": ints(0, 1),
        "weights": weights,
        "base": BUILD.module.FixedBase(),
    }
    made = BUILD.named("MotionSearch")(
        scene=surrounded() if scene is None else scene,
        problem=BUILD.module.MotionProblem(**{**given, **changes}),
        settings=BUILD.search_settings(SETTINGS, **(settings or {})),
        seed=seed,
        island=island,
    )
    return ran(made)


def ran(made: Any, **changes: Any) -> Any:
    made.run(**{"evaluations": 300, "seconds": 0.0, "until_first": False, "stall": 0, "progress": None, **changes})
    return made


def floating(**changes: Any) -> Any:
    """A search on a floating base, some of what is asked of it changed."""
    return motions(scene=weighed(), base=BUILD.module.FloatingBase(**changes))


def frame_goal(**changes: Any) -> Any:
    given = {
        "kind": BUILD.module.FrameGoalKind.pose,
        "joint": 6,
        "local": np.eye(3),
        "offset": np.zeros(3),
        "wanted": np.eye(3),
        "position": np.zeros(3),
        "axis": np.zeros(3),
        "position_tolerance": 1e-3,
        "angle_tolerance": 1e-3,
    }
    return BUILD.module.FrameGoal(**{**given, **changes})


def goals(scene: Any = None, goal: Any = None, **changes: Any) -> Any:
    """A search for goal configurations of the paper's arm, some of its numbers changed."""
    given = {"start": np.zeros(7), "lower": -np.ones(7), "upper": np.ones(7), "whole_turns": np.ones(7, dtype=bool)}
    given |= {"margin": 0.002, "seed": 0}
    made = place(BUILD, ROBOT).native if scene is None else scene
    return BUILD.module.GoalSearch64(scene=made, goal=frame_goal() if goal is None else goal, **{**given, **changes})


def polished(rows: Any = None, lower: Any = None, goal: Any = None, rounds: int = 3) -> Any:
    """Configurations of the paper's arm, brought to a goal."""
    q7 = np.zeros((2, 7)) if rows is None else rows
    low = -np.ones(7) if lower is None else lower
    goal = frame_goal() if goal is None else goal
    return BUILD.module.polished64(place(BUILD, ROBOT).native, goal, q7, low, np.ones(7), rounds)


def search(**changes: Any) -> Any:
    bounds = changes.pop("bounds", BOUNDS)
    return objectives.searched(BUILD, objectives.paper_objective(BUILD, ROBOT), bounds, SETTINGS, **changes)


def swarm(rounds: int = 1, **settings: Any) -> Any:
    """A swarm over a square after some rounds."""
    made = BUILD.swarm({**SETTINGS, **settings}, *BOX)
    for _ in range(rounds):
        made.ask()
        made.tell(np.ones(made.active), np.zeros(made.active))
    return made


def restore(particles: int = 20, **changes: Any) -> Any:
    """Restore a changed state of 20 particles into a swarm of so many."""
    state = {**swarm().state(), **changes}
    target = swarm(particles=particles)
    target.restore({name: values for name, values in state.items() if values is not None})
    target.ask()
    return target.positions()


def restored_asked(**changes: Any) -> Any:
    """Restore a changed state of an evolving swarm that waits to be told."""
    asked = swarm(variant="evolving")
    asked.ask()
    target = swarm(0, variant="evolving")
    target.restore({**asked.state(), **changes})
    target.tell(np.zeros(20), np.zeros(20))
    return ask_told(target)


def counters(at: int, value: int) -> np.ndarray:
    changed = swarm().state()["counters"].copy()
    changed[at] = value
    return changed


def ask_told(made: Any) -> Any:
    made.ask()
    made.tell(np.ones(made.active), np.zeros(made.active))
    made.ask()
    return made.positions()


HUGE: list[tuple[str, float]] = [
    ("ring", 2**30),
    ("ring", 2**31 - 1),
    ("particles", 2**31 - 1),
    ("evaluations", 2**63 - 1),
    ("memory", 2**31 - 1),
    ("tolerance_power", 2**31 - 1),
    ("shrink_to", 2**31 - 1),
    *(
        (name, value)
        for name in ("inertia_start", "cognitive", "social", "velocity_clamp", "penalty_end")
        for value in (1e300, np.nan)
    ),
]
NUMBERS = ("multiplier", "offset", "rotation", "translation", "point_local", "capsule_radius", "sphere_center", "sphere_radius")


def _model_without_number(name: str) -> Any:
    return model(**{name: np.full_like(model_arrays()[name], np.nan)})


Case = Callable[[], Any]
REFUSED: dict[str, Case] = {
    "evaluate: too few columns": lambda: evaluated(paper(), 6),
    "evaluate: too many columns": lambda: evaluated(paper(), 8),
    "evaluate: no columns": lambda: evaluated(paper(), 0),
    "evaluate: one configuration without a batch": lambda: paper().evaluate(q(7)),
    "evaluate: three axes": lambda: paper().evaluate(q(1, 1, 7)),
    "evaluate: text": lambda: paper().evaluate("0000000"),
    "evaluate: None": lambda: paper().evaluate(None),
    "evaluate: complex numbers": lambda: paper().evaluate(q(1, 7) + 1j),
    "terms: too few columns": lambda: paper().terms(q(1, 6)),
    "reach: too few columns": lambda: evaluated(reach(), 6),
    "reach: no targets": lambda: evaluated(reach(points=ints(), targets=q(0, 3), tolerances=q(0))),
    "reach: fewer targets than points": lambda: evaluated(reach(points=ints(0, 1))),
    "reach: targets in the plane": lambda: evaluated(reach(targets=q(1, 2))),
    "reach: more tolerances than targets": lambda: evaluated(reach(tolerances=np.ones(2))),
    "reach: a point that is none": lambda: evaluated(reach(points=ints(2))),
    "reach: a negative point": lambda: evaluated(reach(points=ints(-1))),
    "reach: a home of another length": lambda: evaluated(reach(home=np.zeros(6))),
    "surrounded: a capsule on no joint": lambda: surrounded(joint=ints(0, 7)),
    "surrounded: a joint below the base": lambda: surrounded(joint=ints(0, -2)),
    "surrounded: a negative link": lambda: surrounded(link=ints(-1, 0)),
    "surrounded: an absurdly high link": lambda: surrounded(link=ints(0, 2**31 - 1)),
    "surrounded: fewer links than capsules": lambda: surrounded(link=ints(0)),
    "surrounded: fewer starts than capsules": lambda: surrounded(a=q(1, 3)),
    "surrounded: ends in the plane": lambda: surrounded(b=q(2, 2)),
    "surrounded: fewer radii than capsules": lambda: surrounded(radius=q(1)),
    "surrounded: a pair of an unknown link": lambda: surrounded(pairs=ints(0, 2).reshape(1, 2)),
    "surrounded: a pair of a negative link": lambda: surrounded(pairs=ints(-1, 0).reshape(1, 2)),
    "surrounded: a link paired with itself": lambda: surrounded(pairs=ints(1, 1).reshape(1, 2)),
    "surrounded: pairs of three": lambda: surrounded(pairs=ints(0, 1, 0).reshape(1, 3)),
    "surrounded: pairs of one": lambda: surrounded(pairs=ints(0).reshape(1, 1)),
    "surrounded: a text for an obstacle": lambda: surrounded(obstacles=["ball"]),
    "surrounded: a capsule's ends in the plane": lambda: shape("Capsule", a=np.zeros(2)),
    "surrounded: fewer radii than centres": lambda: shape("Spheres", radius=np.zeros(0)),
    "surrounded: a box with two axes": lambda: shape("Box", axes=np.eye(3)[:2].copy()),
    "margins: a capsule beyond the last": lambda: margins(body=ints(2)),
    "margins: a negative capsule": lambda: margins(body=ints(-1)),
    "margins: an obstacle beyond the last": lambda: margins(obstacle=ints(1)),
    "margins: neither an obstacle nor a capsule": lambda: margins(obstacle=ints(-1)),
    "margins: another capsule beyond the last": lambda: margins(obstacle=ints(-1), other=ints(2)),
    "margins: a margin that is no number": lambda: margins(margin=np.full(1, np.nan)),
    "margins: fewer margins than pairs": lambda: margins(margin=q(0)),
    "bodies: a solid that is none": lambda: bodied(solid=ints(-1, 1)),
    "bodies: a negative solid": lambda: bodied(solid=ints(-2, 0)),
    "bodies: fewer solids than bodies": lambda: bodied(solid=ints(0)),
    "bodies: a polytope without vertices": lambda: bodied(count=0),
    "bodies: a box with vertices": lambda: bodied(kind="box"),
    "bodies: an origin without end": lambda: bodied(origin=np.full(3, np.inf)),
    "bodies: axes that are no numbers": lambda: bodied(axes=np.full((3, 3), np.nan)),
    "polytope: no vertices": lambda: surrounded(obstacles=[shape("Polytope", vertices=np.zeros((0, 3)))]),
    "polytope: vertices in the plane": lambda: shape("Polytope", vertices=np.zeros((3, 2))),
    "near pairs: a pair that is none": lambda: near(pair=ints(1)),
    "near pairs: a negative pair": lambda: near(pair=ints(-1)),
    "near pairs: a body beyond the last": lambda: near(body=ints(2)),
    "near pairs: an obstacle beyond the last": lambda: near(obstacle=ints(1)),
    "near pairs: neither an obstacle nor a body": lambda: near(obstacle=ints(-1)),
    "near pairs: fewer bodies than pairs": lambda: near(body=ints()),
    "near pairs: one clearance for two goals": lambda: near(at_goal=np.ones((1, 1))),
    "near pairs: no clearance at the start": lambda: near(at_start=np.ones(0)),
    "near pairs: a clearance that is no number": lambda: near(required=np.full(1, np.nan)),
    "obstacle_clearances: too few columns": lambda: surrounded().obstacle_clearances(q(1, 6)),
    "pair_clearances: too few columns": lambda: surrounded().pair_clearances(q(1, 6), ints(0, 1).reshape(1, 2)),
    "pair_clearances: a capsule beyond the last": lambda: surrounded().pair_clearances(q(1, 7), ints(0, 2).reshape(1, 2)),
    "pair_clearances: a negative capsule": lambda: surrounded().pair_clearances(q(1, 7), ints(-1, 1).reshape(1, 2)),
    "pair_clearances: pairs of one": lambda: surrounded().pair_clearances(q(1, 7), ints(0, 1).reshape(2, 1)),
    "shortfalls: too many columns": lambda: surrounded().shortfalls(q(1, 8), 0.0, False),
    "free: too many columns": lambda: surrounded().free(q(1, 8), 0.0),
    "levers: too few joints": lambda: surrounded().levers(np.ones(6)),
    "motions: a start of another length": lambda: motions(start=np.zeros(6)),
    "motions: a goal of another length": lambda: motions(goals=np.ones((2, 8))),
    "motions: no goals": lambda: motions(goals=np.ones((0, 7))),
    "motions: bounds of another length": lambda: motions(lower=BOX[0]),
    "motions: bounds the wrong way round": lambda: motions(lower=BOUNDS[1], upper=BOUNDS[0]),
    "motions: bounds that are no numbers": lambda: motions(lower=np.full(7, np.nan)),
    "motions: velocities of another length": lambda: motions(velocity=np.ones(6)),
    "motions: one jerk for all": lambda: motions(jerk=np.ones(1)),
    "motions: a tip that is no point": lambda: motions(tip=2),
    "motions: a negative tip": lambda: motions(tip=-1),
    "motions: a centre that is no point": lambda: motions(centers=ints(2)),
    "motions: a misspelt setting": lambda: motions(settings={"interor": [2]}),
    "motions: a text for a number": lambda: motions(settings={"tree_step": "far"}),
    "motions: control points beyond 512": lambda: motions(settings={"interior": [513]}),
    "motions: no control points": lambda: motions(settings={"interior": []}),
    "motions: a ladder without steps": lambda: motions(settings={"ladder": []}),
    "motions: a ladder with a step of 0": lambda: motions(settings={"ladder": [0, 1]}),
    "motions: a step of no length": lambda: motions(settings={"tree_step": 0.0}),
    "motions: a step that is no number": lambda: motions(settings={"tree_step": np.nan}),
    "motions: no failures allowed": lambda: motions(settings={"refine_stall": 0}),
    "motions: a negative patience": lambda: motions(settings={"patience": -1}),
    "motions: a negative island": lambda: motions(island=-1),
    "motions: a negative seed": lambda: motions(seed=-1),
    "judge: too few columns": lambda: motions().judge(q(1, 13), 2, 0),
    "judge: a negative number of control points": lambda: motions().judge(q(1, 0), -1, 0),
    "judge: no such goal": lambda: motions().judge(q(1, 14), 2, 2),
    "judge: a negative goal": lambda: motions().judge(q(1, 14), 2, -1),
    "judge: control points beyond 512": lambda: motions().judge(q(1, 7 * 600), 600, 0),
    "spline_values: a sixth derivative": lambda: BUILD.module.spline_values(q(3), 2, 6),
    "spline_values: a negative derivative": lambda: BUILD.module.spline_values(q(3), 2, -1),
    "spline_values: a negative number of control points": lambda: BUILD.module.spline_values(q(3), -1, 0),
    "spline_values: an instant before the start": lambda: BUILD.module.spline_values(np.array([-0.5]), 2, 0),
    "spline_values: an instant that is no number": lambda: BUILD.module.spline_values(np.array([np.nan]), 2, 0),
    "model: a child before its parent": lambda: model(parent=ints(1, 0, 1, 2, 3, 4, 5)),
    "model: a parent below -1": lambda: model(parent=ints(-2, 0, 1, 2, 3, 4, 5)),
    "model: a dof beyond the last": lambda: model(dof=ints(0, 1, 2, 3, 4, 5, 7)),
    "model: a negative dof": lambda: model(dof=ints(-1, 1, 2, 3, 4, 5, 6)),
    "model: a point on no joint": lambda: model(point_joint=ints(0, 7)),
    "model: a capsule's end that is no point": lambda: model(capsule_b=ints(2)),
    "model: a capsule's start below 0": lambda: model(capsule_a=ints(-1)),
    "tell: too few values": lambda: swarm().tell(np.ones(19), np.ones(19)),
    "tell: too many values": lambda: swarm().tell(np.ones(21), np.ones(21)),
    "tell: fewer violations than fitnesses": lambda: swarm().tell(np.ones(20), np.ones(19)),
    "tell: a column": lambda: swarm().tell(np.ones((20, 1)), np.ones((20, 1))),
    "place_first: too few columns": lambda: swarm(0).place_first(q(2, 1)),
    "swarm: bounds of different lengths": lambda: BUILD.swarm(SETTINGS, [0, 0], [1, 1, 1]),
    "swarm: a negative seed": lambda: BUILD.swarm(SETTINGS, *BOX, seed=-1),
    "swarm: a trial beyond 32 bits": lambda: BUILD.swarm(SETTINGS, *BOX, trial=2**32),
    "search: bounds of too few dimensions": lambda: search(bounds=BOX),
    "search: an upper bound of too few dimensions": lambda: search(bounds=(BOUNDS[0], BOX[1])),
    "search: initial positions of too few columns": lambda: search(initial=q(1, 6)),
    "settings: no particles": lambda: BUILD.settings(particles=0),
    "settings: no budget": lambda: BUILD.settings(evaluations=0),
    "settings: no memory": lambda: BUILD.settings(memory=0),
    "settings: an unknown variant": lambda: BUILD.settings(variant="ipso"),
    "settings: an unknown bounds rule": lambda: BUILD.settings(bounds="bounce"),
    "settings: an unknown constraint rule": lambda: BUILD.settings(constraints="none"),
    "paper: a centre that is no point": lambda: evaluated(paper(centers=ints(0, 2))),
    "paper: a negative centre": lambda: evaluated(paper(centers=ints(-1))),
    "restore: a value missing": lambda: restore(position=None),
    "search: a negative number of trials": lambda: search(trials=-1),
    "uniforms: a negative trial": lambda: BUILD.named("uniforms")(0, -1, 0, 0, 0, 0),
    "joint_frames: too few columns": lambda: model().joint_frames(q(1, 6)),
    "joint_frames: no columns": lambda: model().joint_frames(q(1, 0)),
    "points: too few columns": lambda: model().points(q(1, 6)),
    "clearances: too few columns": lambda: model().clearances(q(1, 6)),
    "clearances: too many columns": lambda: model().clearances(q(1, 8)),
    "model: fewer dofs than joints": lambda: model(dof=ints(0)),
    "model: fewer multipliers than joints": lambda: model(multiplier=np.ones(1)),
    "model: fewer offsets than joints": lambda: model(offset=np.zeros(1)),
    "model: fewer rotations than joints": lambda: model(rotation=np.ones((1, 3, 3))),
    "model: rotations of another shape": lambda: model(rotation=np.ones((7, 2, 2))),
    "model: fewer translations than joints": lambda: model(translation=np.ones((1, 3))),
    "model: fewer places than points": lambda: model(point_local=np.zeros((1, 3))),
    "model: places in the plane": lambda: model(point_local=np.zeros((2, 2))),
    "model: fewer ends than starts": lambda: model(capsule_b=ints()),
    "model: fewer radii than capsules": lambda: model(capsule_radius=np.zeros(0)),
    "model: centres in the plane": lambda: model(sphere_center=np.ones((1, 2))),
    "model: fewer radii than centres": lambda: model(sphere_radius=np.zeros(0)),
    "paper: a tip that is no point": lambda: evaluated(paper(tip=10**6)),
    "paper: a goal in the plane": lambda: evaluated(paper(goal=np.zeros(2))),
    "paper: two weights": lambda: evaluated(paper(weights=np.ones(2))),
    "restore: the state of a smaller swarm": lambda: restore(particles=5000),
    "restore: positions cut short": lambda: restore(position=np.zeros(3)),
    "restore: positions in words": lambda: restore(position="everywhere"),
    "restore: counters cut short": lambda: restore(counters=np.zeros(2, dtype=np.int64)),
    "restore: more particles than there are": lambda: restore(counters=counters(3, 10**6)),
    "restore: a history entry that is none": lambda: restore(counters=counters(4, 10**6)),
    "tell: without having asked, evolving": lambda: ask_told(_told_twice(variant="evolving")),
    "settings: a misspelt name": lambda: BUILD.settings(partickles=3),
    "settings: a text for a number": lambda: BUILD.settings(particles="many"),
    "settings: a negative evolving share": lambda: ask_told(swarm(variant="evolving", evolving_share=-3.0)),
    "settings: an evolving share above 1": lambda: ask_told(swarm(variant="evolving", evolving_share=3.0)),
    "settings: an elite of more than all": lambda: ask_told(swarm(variant="evolving", elite_share=100.0)),
    "swarm: no dimensions": lambda: ask_told(BUILD.swarm({**SETTINGS, "variant": "evolving"}, [], [])),
    "search: progress answers with a number": lambda: _slow_search(lambda done: 1),
    "OPEN BUG: restore: gains cut short, asked": lambda: restored_asked(gain=np.zeros(0)),
    "OPEN BUG: restore: drawn factors cut short, asked": lambda: restored_asked(drawn_factor=np.zeros(1)),
    "restore: an archive of broken rows": lambda: restore(archive=np.zeros(3)),
    "restore: more rounds than can be counted": lambda: restore(counters=counters(0, 2**40)),
    "restore: more evaluations than can be counted": lambda: restore(counters=counters(1, 2**63 - 1)),
    **{
        f"settings: {name} of {value:.3g}": lambda name=name, value=value: ask_told(swarm(**{name: value}))
        for name, value in HUGE
    },
    **{
        f"motions: {name} of {value}": lambda name=name, value=value: motions(**{name: np.full(7, value)})
        for name in ("start", "lower", "upper", "velocity", "acceleration", "jerk")
        for value in (np.nan, -1e300)
    },
    "motions: a goal without end": lambda: motions(goals=np.full((2, 7), np.inf)),
    "motions: a margin that is no number": lambda: motions(margin=np.nan),
    "motions: a preferred clearance of 1e300": lambda: motions(preferred_clearance=1e300),
    "motions: weights of 1e300": lambda: motions(weight=1e300),
    "motions: failures beyond counting": lambda: motions(settings={"swarm_stall": 2**31 - 1}),
    "motions: a step of 1e300": lambda: motions(settings={"tree_step": 1e300}),
    "motions: a step of 1e-300": lambda: motions(settings={"tree_step": 1e-300}),
    "run: a negative budget": lambda: ran(motions(), evaluations=-1),
    "run: seconds that are no number": lambda: ran(motions(), seconds=np.nan),
    "add_instant: an instant that is no number": lambda: motions().add_instant(np.nan, 0.1),
    "add_instant: an instant beyond the end": lambda: motions().add_instant(1.5, 0.1),
    **{f"model: {name} of NaN": lambda name=name: _model_without_number(name) for name in NUMBERS},
    "surrounded: a capsule without a number": lambda: surrounded(a=np.full((2, 3), np.nan)),
    "surrounded: a radius without end": lambda: surrounded(radius=np.full(2, np.inf)),
    **{
        f"surrounded: a {kind} without {field}": lambda kind=kind, field=field, value=value: surrounded(
            obstacles=[shape(kind, **{field: value * np.nan})]
        )
        for kind, fields in SHAPES.items()
        for field, value in fields.items()
    },
    "surrounded: an obstacle of 1e300 m": lambda: surrounded(obstacles=[shape("Capsule", radius=1e300)]),
    "weighed: a mass that is no number": lambda: weighed(mass=np.full(8, np.nan)),
    "weighed: an inertia of 1e300": lambda: weighed(inertia=np.full((8, 6), 1e300)),
    "weighed: no mass at all": lambda: weighed(mass=q(8)),
    "weighed: a mass too few": lambda: weighed(mass=np.ones(7), com=q(7, 3), inertia=q(7, 6)),
    "weighed: fewer centres than masses": lambda: weighed(com=q(7, 3)),
    "floating: a robot without masses": lambda: motions(base=BUILD.module.FloatingBase()),
    "floating: a frame on no joint": lambda: floating(frame=frame_goal(joint=7)),
    "floating: a frame on the base": lambda: floating(frame=frame_goal(joint=-1)),
    "floating: a place without a number": lambda: floating(frame=frame_goal(position=np.full(3, np.nan))),
    "floating: axes without a number": lambda: floating(frame=frame_goal(wanted=np.full((3, 3), np.nan))),
    "floating: a tolerance that is no number": lambda: floating(frame=frame_goal(position_tolerance=np.nan)),
    "floating: a negative limit": lambda: floating(most_turned=-1.0),
    "floating: a limit that is no number": lambda: floating(most_rate=np.nan),
    "floating: a momentum without a drift": lambda: floating(angular=np.ones(3), duration=1.0),
    "floating: a momentum without a duration": lambda: floating(angular=np.ones(3), drift=np.ones(3)),
    "floating: a momentum that is no number": lambda: floating(angular=np.full(3, np.nan), drift=np.ones(3), duration=1.0),
    "fixed: a duration that is no number": lambda: motions(base=BUILD.module.FixedBase(duration=np.nan)),
    "base_along: no nodes": lambda: motions().base_along(q(1, 7), 1, 0, 0, False),
    "base_along: nodes that fill no pack": lambda: motions().base_along(q(1, 7), 1, 0, 17, False),
    "project: too few columns": lambda: motions().project(q(1, 13), 2, 0),
    **{
        f"goals: {name} of {value}": lambda name=name, value=value: goals(**{name: np.full(7, value)})
        for name in ("start", "lower", "upper")
        for value in (np.nan, -np.inf, 1e300)
    },
    **{f"goals: {name} too short": lambda name=name: goals(**{name: np.zeros(6)}) for name in ("start", "lower", "upper")},
    "goals: whole turns too short": lambda: goals(whole_turns=np.ones(6, dtype=bool)),
    "goals: bounds the wrong way round": lambda: goals(lower=np.ones(7), upper=np.zeros(7)),
    "goals: a margin that is no number": lambda: goals(margin=np.nan),
    "goals: no scene": lambda: goals(scene=0),
    "goals: a frame on no joint": lambda: goals(goal=frame_goal(joint=7)),
    "goals: a frame on the base": lambda: goals(goal=frame_goal(joint=-1)),
    "goals: a position that is no number": lambda: goals(goal=frame_goal(position=np.full(3, np.nan))),
    "goals: axes that are no numbers": lambda: goals(goal=frame_goal(wanted=np.full((3, 3), np.inf))),
    "goals: a tolerance that is no number": lambda: goals(goal=frame_goal(angle_tolerance=np.nan)),
    "look: fewer than no guesses": lambda: goals().look(-1),
    "look: guesses beyond counting": lambda: goals().look(2**31 - 1),
    "differing: none": lambda: goals().differing(0),
    "differing: fewer than none": lambda: goals().differing(-1),
    "pulled: too few columns": lambda: goals().pulled(q(2, 6), 2, pull=True, at_centre=True),
    "pulled: no numbers": lambda: goals().pulled(np.full((2, 7), np.nan), 2, pull=True, at_centre=True),
    "pulled: none wanted": lambda: goals().pulled(q(2, 7), 0, pull=True, at_centre=True),
    "with_turns: too many columns": lambda: goals().with_turns(q(2, 8), 4),
    "polished: too few columns": lambda: polished(q(2, 6)),
    "polished: no numbers": lambda: polished(np.full((2, 7), np.inf)),
    "polished: bounds of another length": lambda: polished(lower=np.zeros(6)),
    "polished: a frame on no joint": lambda: polished(goal=frame_goal(joint=9)),
    "polished: rounds beyond counting": lambda: polished(rounds=2**31 - 1),
    "polished: fewer rounds than none": lambda: polished(rounds=-1),
    "swarm: bounds that are no numbers": lambda: BUILD.swarm(SETTINGS, [np.nan, 0], [1, 1]),
    "swarm: bounds without end": lambda: BUILD.swarm(SETTINGS, [-np.inf, 0], [np.inf, 1]),
    "swarm: bounds the wrong way round": lambda: BUILD.swarm(SETTINGS, [1, 1], [0, 0]),
    "search: more trials than memory": lambda: search(trials=2**31 - 1),
    "search: seconds that are no number": lambda: search(seconds=np.nan),
    "product: matrices that do not fit": lambda: BUILD.module.product(q(1, 2, 3), q(1, 2, 3)),
    "product: matrices of other numbers": lambda: BUILD.module.product(q(2, 2, 3), q(3, 3, 2)),
    "angles: fewer abscissae than ordinates": lambda: BUILD.module.angles(q(3), q(2)),
}

REFUSALS = {"ValueError", "TypeError", "IndexError", "KeyError", "AttributeError"}


def _told_twice(**settings: Any) -> Any:
    made = swarm(**settings)
    made.tell(np.zeros(20), np.zeros(20))
    return made


def _slow_search(progress: Case) -> Any:
    objective = objectives.paper_objective(BUILD, ROBOT)
    chosen = {**SETTINGS, "evaluations": 10**9}
    return objectives.searched(BUILD, objective, BOUNDS, chosen, seconds=0.2, progress=progress)


def tried(case: Case) -> str:
    """What came of a call, made in a child of this process."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            case()
            outcome = "accepted"
        except BaseException as error:
            outcome = type(error).__name__
        os.write(writing, outcome.encode())
        os._exit(0)
    os.close(writing)
    _, status = os.waitpid(child, 0)
    said = os.read(reading, 1000).decode()
    os.close(reading)
    return signal.Signals(os.WTERMSIG(status)).name if os.WIFSIGNALED(status) else said


@cache
def outcomes() -> dict[str, str]:
    """What came of every case, tried in a process without threads."""
    done = subprocess.run(
        [sys.executable, "-m", "kernel.misuse"],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return json.loads(done.stdout)


if __name__ == "__main__":
    print(json.dumps({name: tried(case) for name, case in REFUSED.items()}))
