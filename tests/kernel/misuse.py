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
from kernel.builds import Build
from spacearm.core.native import available_levels
from spacearm.robot.kinematics import tree_arrays

BUILD = Build(available_levels()[0], 64)
ROBOT = objectives.paper_robot()
BOUNDS = np.array(ROBOT.lower), np.array(ROBOT.upper)
BOX = np.zeros(2), np.ones(2)
SETTINGS: dict[str, Any] = {"particles": 20, "evaluations": 200}


def model(**changes: Any) -> Any:
    """A model of the paper's arm with one point, capsule and sphere, some of its arrays changed."""
    arrays = {
        **tree_arrays(ROBOT),
        "point_joint": np.array([0, 6], dtype=np.int32),
        "point_local": np.zeros((2, 3)),
        "capsule_a": np.array([0], dtype=np.int32),
        "capsule_b": np.array([1], dtype=np.int32),
        "capsule_radius": np.array([0.1]),
        "sphere_center": np.ones((1, 3)),
        "sphere_radius": np.array([0.1]),
    }
    return BUILD.named("Model").make(**{**arrays, **changes})


def ints(*values: int) -> np.ndarray:
    return np.array(values, dtype=np.int32)


def q(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def seed(**changes: Any) -> Any:
    """A seed objective with some of its arguments changed."""
    given = {"centers": ints(0, 1), "tip": 1, "goal": np.zeros(3), "weights": np.ones(3), **changes}
    return BUILD.named("SeedObjective")(model(), *given.values(), True, 1e-3)


def evaluated(objective: Any, columns: int = 7) -> Any:
    return objective.evaluate(q(1, columns))


def reach(**changes: Any) -> Any:
    """A reach objective with some of its arguments changed."""
    given = {"points": ints(1), "targets": np.zeros((1, 3)), "tolerances": np.ones(1), "margin": 0.0, "home": np.zeros(7)}
    return BUILD.named("ReachObjective")(surrounded(), *{**given, **changes}.values())


def surrounded(**changes: Any) -> Any:
    """The model with an envelope of two links, one capsule each, and a ball, some of its arrays changed."""
    arrays = {
        "index": ints(0, 1),
        "joint": ints(0, 6),
        "link": ints(0, 1),
        "a": np.zeros((2, 3)),
        "b": np.ones((2, 3)),
        "radius": np.full(2, 0.1),
        "pairs": ints(0, 1).reshape(1, 2),
        "obstacle_kind": ints(1),
        "obstacle_numbers": np.ones((1, 15)),
    }
    made = model().surrounded(**{**arrays, **changes})
    made.shortfalls(q(1, 7), 0.1, False)
    made.obstacle_clearances(q(1, 7))
    return made


def motions(**changes: Any) -> Any:
    """A search for motions with some of its arguments changed, run for a little."""
    given = {
        "scene": surrounded(),
        "start": np.zeros(7),
        "goals": np.ones((2, 7)),
        "lower": BOUNDS[0],
        "upper": BOUNDS[1],
        "velocity": np.ones(7),
        "acceleration": np.ones(7),
        "jerk": np.zeros(0),
        "margin": 0.0,
        "comfort": 0.1,
        "tip": 1,
        "centers": ints(0, 1),
        "weights": np.ones(12),
        "base": {},
        "settings": {},
        "swarm": BUILD.settings(**SETTINGS),
        "seed": 0,
        "island": 0,
    }
    made = BUILD.named("MotionSearch")(**{**given, **changes})
    made.run(300, 0.0, False, 0, None)
    return made


def search(**changes: Any) -> Any:
    bounds = changes.pop("bounds", BOUNDS)
    return objectives.searched(BUILD, objectives.seed_objective(BUILD, ROBOT), bounds, SETTINGS, **changes)


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
    arrays = tree_arrays(ROBOT) | {
        "point_local": np.zeros((2, 3)),
        "capsule_radius": np.array([0.1]),
        "sphere_center": np.ones((1, 3)),
        "sphere_radius": np.array([0.1]),
    }
    return model(**{name: np.full_like(arrays[name], np.nan)})


Case = Callable[[], Any]
REFUSED: dict[str, Case] = {
    "evaluate: too few columns": lambda: evaluated(seed(), 6),
    "evaluate: too many columns": lambda: evaluated(seed(), 8),
    "evaluate: no columns": lambda: evaluated(seed(), 0),
    "evaluate: one configuration without a batch": lambda: seed().evaluate(q(7)),
    "evaluate: three axes": lambda: seed().evaluate(q(1, 1, 7)),
    "evaluate: text": lambda: seed().evaluate("0000000"),
    "evaluate: None": lambda: seed().evaluate(None),
    "evaluate: complex numbers": lambda: seed().evaluate(q(1, 7) + 1j),
    "terms: too few columns": lambda: seed().terms(q(1, 6)),
    "reach: too few columns": lambda: evaluated(reach(), 6),
    "reach: no targets": lambda: evaluated(reach(points=ints(), targets=q(0, 3), tolerances=q(0))),
    "reach: fewer targets than points": lambda: evaluated(reach(points=ints(0, 1))),
    "reach: targets in the plane": lambda: evaluated(reach(targets=q(1, 2))),
    "reach: more tolerances than targets": lambda: evaluated(reach(tolerances=np.ones(2))),
    "reach: a point that is none": lambda: evaluated(reach(points=ints(2))),
    "reach: a negative point": lambda: evaluated(reach(points=ints(-1))),
    "reach: a home of another length": lambda: evaluated(reach(home=np.zeros(6))),
    "surrounded: fewer indices than capsules": lambda: surrounded(index=ints(0)),
    "surrounded: an index beyond the last": lambda: surrounded(index=ints(0, 2)),
    "surrounded: a negative index": lambda: surrounded(index=ints(0, -1)),
    "surrounded: an index given twice": lambda: surrounded(index=ints(1, 1)),
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
    "surrounded: an unknown shape": lambda: surrounded(obstacle_kind=ints(6)),
    "surrounded: no shape": lambda: surrounded(obstacle_kind=ints(0)),
    "surrounded: a negative shape": lambda: surrounded(obstacle_kind=ints(-1)),
    "surrounded: fewer rows than obstacles": lambda: surrounded(obstacle_kind=ints(1, 1)),
    "surrounded: rows too short": lambda: surrounded(obstacle_numbers=np.ones((1, 14))),
    "obstacle_clearances: too few columns": lambda: surrounded().obstacle_clearances(q(1, 6)),
    "pair_clearances: too few columns": lambda: surrounded().pair_clearances(q(1, 6), ints(0, 1).reshape(1, 2)),
    "pair_clearances: a capsule beyond the last": lambda: surrounded().pair_clearances(q(1, 7), ints(0, 2).reshape(1, 2)),
    "pair_clearances: a negative capsule": lambda: surrounded().pair_clearances(q(1, 7), ints(-1, 1).reshape(1, 2)),
    "pair_clearances: pairs of one": lambda: surrounded().pair_clearances(q(1, 7), ints(0, 1).reshape(2, 1)),
    "shortfalls: too many columns": lambda: surrounded().shortfalls(q(1, 8), 0.0, False),
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
    "motions: seven weights": lambda: motions(weights=np.ones(7)),
    "motions: a misspelt setting": lambda: motions(settings={"interor": [2]}),
    "motions: a text for a number": lambda: motions(settings={"probe_step": "far"}),
    "motions: control points beyond 32": lambda: motions(settings={"interior": [33]}),
    "motions: no control points": lambda: motions(settings={"interior": []}),
    "motions: a ladder without steps": lambda: motions(settings={"ladder": []}),
    "motions: a ladder with a step of 0": lambda: motions(settings={"ladder": [0, 1]}),
    "motions: a step of no length": lambda: motions(settings={"probe_step": 0.0}),
    "motions: a step that is no number": lambda: motions(settings={"probe_step": np.nan}),
    "motions: no failures allowed": lambda: motions(settings={"refine_stall": 0}),
    "motions: a negative patience": lambda: motions(settings={"patience": -1}),
    "motions: a negative island": lambda: motions(island=-1),
    "motions: a negative seed": lambda: motions(seed=-1),
    "judge: too few columns": lambda: motions().judge(q(1, 13), 2, 0),
    "judge: a negative number of control points": lambda: motions().judge(q(1, 0), -1, 0),
    "judge: no such goal": lambda: motions().judge(q(1, 14), 2, 2),
    "judge: a negative goal": lambda: motions().judge(q(1, 14), 2, -1),
    "judge: control points beyond 32": lambda: motions().judge(q(1, 7 * 100), 100, 0),
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
    "seed: a centre that is no point": lambda: evaluated(seed(centers=ints(0, 2))),
    "seed: a negative centre": lambda: evaluated(seed(centers=ints(-1))),
    "restore: a value missing": lambda: restore(position=None),
    "search: a negative number of trials": lambda: search(trials=-1),
    "uniforms: a negative trial": lambda: BUILD.named("uniforms")(0, -1, 0, 0, 0, 0),
    "joint_frames: too few columns": lambda: model().joint_frames(q(1, 6)),
    "joint_frames: no columns": lambda: model().joint_frames(q(1, 0)),
    "points: too few columns": lambda: model().points(q(1, 6)),
    "clearances: too few columns": lambda: model().clearances(q(1, 6)),
    "clearances: too many columns": lambda: model().clearances(q(1, 8)),
    "model: fewer kinds than joints": lambda: model(kind=ints(0)),
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
    "seed: a tip that is no point": lambda: evaluated(seed(tip=10**6)),
    "seed: a goal in the plane": lambda: evaluated(seed(goal=np.zeros(2))),
    "seed: two weights": lambda: evaluated(seed(weights=np.ones(2))),
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
    "motions: a comfort of 1e300": lambda: motions(comfort=1e300),
    "motions: weights of 1e300": lambda: motions(weights=np.full(12, 1e300)),
    "motions: failures beyond counting": lambda: motions(settings={"swarm_stall": 2**31 - 1}),
    "motions: a step of 1e300": lambda: motions(settings={"probe_step": 1e300}),
    "motions: a step of 1e-300": lambda: motions(settings={"probe_step": 1e-300}),
    "run: a negative budget": lambda: motions().run(-1, 0.0, False, 0, None),
    "run: seconds that are no number": lambda: motions().run(1, np.nan, False, 0, None),
    "add_instant: an instant that is no number": lambda: motions().add_instant(np.nan, 0.1),
    "add_instant: an instant beyond the end": lambda: motions().add_instant(1.5, 0.1),
    **{f"model: {name} of NaN": lambda name=name: _model_without_number(name) for name in NUMBERS},
    "surrounded: a capsule without a number": lambda: surrounded(a=np.full((2, 3), np.nan)),
    "surrounded: a radius without end": lambda: surrounded(radius=np.full(2, np.inf)),
    **{
        f"surrounded: an obstacle of kind {kind} without a number": lambda kind=kind: surrounded(
            obstacle_kind=ints(kind), obstacle_numbers=np.full((1, 15), np.nan)
        )
        for kind in range(1, 6)
    },
    "surrounded: an obstacle of 1e300 m": lambda: surrounded(obstacle_numbers=np.full((1, 15), 1e300)),
    "weighed: a mass that is no number": lambda: model().weighed(np.full(8, np.nan), q(8, 3), q(8, 6)),
    "weighed: an inertia of 1e300": lambda: model().weighed(np.ones(8), q(8, 3), np.full((8, 6), 1e300)),
    "swarm: bounds that are no numbers": lambda: BUILD.swarm(SETTINGS, [np.nan, 0], [1, 1]),
    "swarm: bounds without end": lambda: BUILD.swarm(SETTINGS, [-np.inf, 0], [np.inf, 1]),
    "swarm: bounds the wrong way round": lambda: BUILD.swarm(SETTINGS, [1, 1], [0, 0]),
    "search: more trials than memory": lambda: search(trials=2**31 - 1),
    "search: seconds that are no number": lambda: search(seconds=np.nan),
    "product: matrices that do not fit": lambda: BUILD.module.product(q(1, 2, 3), q(1, 2, 3)),
    "product: matrices of other numbers": lambda: BUILD.module.product(q(2, 2, 3), q(3, 3, 2)),
    "solved: a vector too short": lambda: BUILD.module.solved(q(1, 3, 3), q(1, 2)),
    "angles: fewer abscissae than ordinates": lambda: BUILD.module.angles(q(3), q(2)),
}

REFUSALS = {"ValueError", "TypeError", "IndexError", "KeyError"}


def _told_twice(**settings: Any) -> Any:
    made = swarm(**settings)
    made.tell(np.zeros(20), np.zeros(20))
    return made


def _slow_search(progress: Case) -> Any:
    objective = objectives.seed_objective(BUILD, ROBOT)
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
