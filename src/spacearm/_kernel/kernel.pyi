"""The compiled kernel, the same at every level. Written by tools/kernel_stub.py with nanobind 3.1.0: do not edit."""

from collections.abc import Callable, Sequence
import enum
from typing import Annotated

import numpy
import numpy.typing
from numpy.typing import NDArray


class Joints:
    """
    The joints, parents before children; values are multiplier * q[dof] + offset.
    """

    def __init__(self, *, parent: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], prismatic: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')], dof: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], multiplier: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], offset: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], rotation: Annotated[NDArray[numpy.float64], dict(shape=(None, 3, 3), order='C')], translation: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], dofs: int) -> None: ...

class Points:
    """Points, each in the frame of the joint that carries it; -1: the base."""

    def __init__(self, *, joint: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], local: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')]) -> None: ...

class PointCapsules:
    """Capsules between two points each, by the points' indices."""

    def __init__(self, *, a: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], b: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], radius: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> None: ...

class Spheres:
    """Spheres: as many obstacles."""

    def __init__(self, *, center: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], radius: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> None: ...

class Capsule:
    """An obstacle: a segment from a to b, with a radius."""

    def __init__(self, *, a: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], b: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], radius: float) -> None: ...

class Box:
    """An obstacle; `axes` has its x, y and z axis as rows."""

    def __init__(self, *, center: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], axes: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='C')], half_size: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], rounding: float = 0.0) -> None: ...

class Cylinder:
    """An obstacle: a cylinder with flat ends."""

    def __init__(self, *, center: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], axis: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], half_length: float, radius: float, rounding: float = 0.0) -> None: ...

class Polytope:
    """An obstacle: the hull of its vertices (k, 3)."""

    def __init__(self, *, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], rounding: float = 0.0) -> None: ...

class Solid:
    """
    A body of a link that is no capsule: a shape, and where its own axes (as rows) and origin are in the frame of the joint.
    """

    def __init__(self, *, shape: ConvexShape, axes: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='C')], origin: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]) -> None: ...

class HalfSpace:
    """An obstacle: solid where normal . x <= offset."""

    def __init__(self, *, normal: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], offset: float) -> None: ...

class Envelope:
    """
    The bodies of the links, each in the frame of its joint, and pairs of links to keep clear of each other. A body is a capsule from a to b, or the one of `solids` that `solid` says; -1: none.
    """

    def __init__(self, *, joint: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], link: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], a: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], b: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], radius: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], pairs: Annotated[NDArray[numpy.int32], dict(shape=(None, 2), order='C')], solid: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')] | None = None, solids: Sequence[Solid] = []) -> None: ...

class PairMargins:
    """
    Margins of pairs, lower or higher than that of all others [m]: of a body and an obstacle, or another body where the obstacle is -1. Bodies are those of the envelope, obstacles the kernel's. A margin holds for all of the body's link, so all bodies of a link have the same one; of one pair the last counts.
    """

    def __init__(self, *, body: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], obstacle: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], other: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], margin: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> None: ...

class Masses:
    """
    The masses of the base and of each joint's body, in that joint's frame; inertia about the centre of mass: xx, yy, zz, xy, xz, yz.
    """

    def __init__(self, *, mass: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], com: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], inertia: Annotated[NDArray[numpy.float64], dict(shape=(None, 6), order='C')]) -> None: ...

class World:
    """A robot and what is around it: what a model is built from."""

    def __init__(self, *, joints: Joints, points: Points | None = None, point_capsules: PointCapsules | None = None, point_spheres: Spheres | None = None, envelope: Envelope | None = None, obstacles: Sequence[Spheres | Capsule | Box | Cylinder | HalfSpace | Polytope] = (), pair_margins: PairMargins | None = None, masses: Masses | None = None) -> None: ...

class SwarmVariant(enum.Enum):
    pso = 0

    symbiotic = 1

    cooperative = 2

    evolving = 3

class BoundsRule(enum.Enum):
    absorb = 0

    reflect = 1

    periodic = 2

class ConstraintRule(enum.Enum):
    feasible_first = 0

    penalty = 1

class SwarmSettings:
    """
    Settings of a swarm, all with defaults; swarm_settings.hpp says what each is.
    """

    def __init__(self) -> None: ...

    variant: SwarmVariant

    bounds: BoundsRule

    constraints: ConstraintRule

    particles: int

    evaluations: int

    inertia_start: float

    inertia_end: float

    cognitive: float

    social: float

    cooperation: float

    velocity_clamp: float

    start_velocity: float

    ring: int

    penalty_start: float

    penalty_end: float

    penalty_rise: float

    tolerance_share: float

    tolerance_until: float

    tolerance_power: int

    evolving_share: float

    elite_share: float

    memory: int

    shrink_to: int

    def check(self) -> None:
        """Raises ValueError where a number is out of range."""

class SearchSettings:
    """
    Settings of a search, all with defaults; search_settings.hpp says what each is.
    """

    def __init__(self) -> None: ...

    swarm: SwarmSettings

    tree_step: float

    tree_near_line: float

    tree_spread: float

    @property
    def interior(self) -> list[int]: ...

    @interior.setter
    def interior(self, arg: Sequence[int], /) -> None: ...

    @property
    def ladder(self) -> list[int]: ...

    @ladder.setter
    def ladder(self, arg: Sequence[int], /) -> None: ...

    patience: int

    first_turn: int

    swarm_share: float

    shortcuts: int

    shortcut_stall: int

    refine_stall: int

    swarm_every: int

    swarm_stall: int

    give_up: float

    detour: float

    shake: float

    swarm_spread: float

    def check(self) -> None:
        """Raises ValueError where a number is out of range."""

class MotionWeights:
    """
    What a motion's fitness weighs: its terms, 0 or more; `length` is 1 unless set.
    """

    def __init__(self) -> None: ...

    length: float

    duration: float

    tip: float

    clearance: float

    smoothness: float

    f1: float

    f2: float

    f3: float

    base_final: float

    base_peak: float

    base_rate: float

    joint_momentum: float

motion_terms: tuple[str, ...] = ...

class FrameGoalKind(enum.Enum):
    position = 1

    axis = 2

    pose = 3

class FrameGoal:
    """
    Where a frame is to be at the end: its axes `local` and origin `offset` in the frame of the joint that carries it, those wanted in the frame of the base at the beginning; `axis` is the free one.
    """

    def __init__(self, *, kind: FrameGoalKind, joint: int, local: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='C')], offset: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], wanted: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='C')], position: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], axis: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], position_tolerance: float, angle_tolerance: float) -> None: ...

class AttitudeGoal:
    """
    How the base is to stand at the end, in its frame at the beginning [rad]; `anywhere_within`: all attitudes within the tolerance are as good.
    """

    def __init__(self, *, wxyz: Annotated[NDArray[numpy.float64], dict(shape=(4), order='C')], tolerance: float, anywhere_within: bool) -> None: ...

class FixedBase:
    """
    A base that does not move; 0 s: the motion may last as long as it likes.
    """

    def __init__(self, *, duration: float = 0.0) -> None: ...

class FloatingBase:
    """
    A base that floats, and what is asked of it; a limit of 0 is none. All in the frame of the base at the beginning.
    """

    def __init__(self, *, frame: FrameGoal | None = None, attitude: AttitudeGoal | None = None, most_turned: float = 0.0, most_rate: float = 0.0, most_arm_momentum: float = 0.0, duration: float = 0.0, angular: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')] | None = None, drift: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')] | None = None) -> None: ...

class NearPairs:
    """
    Pairs that are nearer at an end of a motion than `required`, p of them. A motion holds such a pair to `at_start` until it is first `required` apart, to `at_goal` (p, goals) from when it is last so, and to `required` in between; to the lesser of both if it never is [m]. At an end where a pair is not near, give `required`. Rows say what belongs to a pair: all bodies of its link, with all of the kernel's obstacles that its obstacle is, or with other bodies where the obstacle is -1. Trees and edges know no order: there the pair's own margin holds (PairMargins), which has to be the least of the above.
    """

    def __init__(self, *, pair: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], body: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], obstacle: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], other: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], required: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], at_start: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], at_goal: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]) -> None: ...

class MotionProblem:
    """What is asked of a motion."""

    def __init__(self, *, start: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], goals: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], velocity: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], acceleration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], jerk: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')] | None = None, margin: float, preferred_clearance: float, tip: int, centers: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], weights: MotionWeights, base: FixedBase | FloatingBase, near_pairs: NearPairs | None = None) -> None: ...

class Model64:
    """A robot among obstacles."""

    def __init__(self, world: World) -> None: ...

    def joint_frames(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None, None))]:
        """Frames of the joints (rows, joints, 4, 4)."""

    def points(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]:
        """Positions of the points (rows, points, 3) [m]."""

    def clearances(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]:
        """Of point capsules and spheres (rows, capsules, spheres) [m]."""

    def obstacle_clearances(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]:
        """
        Of the envelope's bodies and the obstacles (rows, bodies, obstacles) [m]; negative inside, by the depth: of a capsule and a box or a cylinder that of the deepest point of its axis.
        """

    def pair_clearances(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))], pairs: Annotated[NDArray[numpy.int32], dict(shape=(None, 2), order='C')]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """Of pairs of bodies (rows, pairs) [m], as `obstacle_clearances`."""

    def shortfalls(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))], margin: float, stop_early: bool) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """
        How far the clearance falls short of the margin, summed over pairs (rows,) [m].
        """

    def free(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))], margin: float) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]:
        """Whether all pairs keep it (rows,)."""

    def levers(self, most: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """
        How far at most a unit of each joint moves any point of the bodies (n,); `most`: the joints' greatest values without their signs (n,).
        """

    def momentum_terms(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))], dq: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        With the base at rest: centre of mass, angular momentum, inertia (xx, yy, zz, xy, xz, yz), rate of a free base, velocity of the centre (rows, 18).
        """

class TrialResult64:
    """What one trial of a swarm came to; histories have one entry a round."""

    @property
    def fitness(self) -> float: ...

    @property
    def violation(self) -> float: ...

    @property
    def rounds(self) -> int: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def first_feasible_round(self) -> int:
        """-1: none was feasible."""

    @property
    def position(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def fitness_history(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def violation_history(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def evaluation_history(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...

    @property
    def position_history(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """(rounds, dims), or (0, dims) if they were not kept."""

class PaperObjective64:
    """The paper's fitness and constraints of one configuration."""

    def __init__(self, *, scene: Model64, centers: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], tip: int, goal: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], weights: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], must_reach: bool, tolerance: float) -> None: ...

    def terms(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """f1, f2 and f3 (rows, 3)."""

    def evaluate(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
        """Fitness and violation (rows,) of rows of positions."""

    def search(self, *, lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], settings: SwarmSettings, seed: int, first_trial: int, trials: int, threads: int, keep_positions: bool, stop_when_feasible: bool, seconds: float, initial: Annotated[NDArray[numpy.float64], dict(shape=(None, None))] | None, progress: Callable[[int], object] | None) -> list[TrialResult64]:
        """
        Independent trials of a swarm, spread over threads; `progress` is told the rounds done, and says whether to go on.
        """

class ReachObjective64:
    """Configurations that bring points of the robot to given places."""

    def __init__(self, *, scene: Model64, points: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], targets: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], tolerances: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], margin: float, home: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> None: ...

    def evaluate(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
        """Fitness and violation (rows,) of rows of positions."""

    def search(self, *, lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], settings: SwarmSettings, seed: int, first_trial: int, trials: int, threads: int, keep_positions: bool, stop_when_feasible: bool, seconds: float, initial: Annotated[NDArray[numpy.float64], dict(shape=(None, None))] | None, progress: Callable[[int], object] | None) -> list[TrialResult64]:
        """
        Independent trials of a swarm, spread over threads; `progress` is told the rounds done, and says whether to go on.
        """

class Swarm64:
    """A particle swarm: ask, then tell, round after round."""

    def __init__(self, settings: SwarmSettings, lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], seed: int, trial: int) -> None: ...

    def ask(self) -> None: ...

    def positions(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """(active, dims) the positions asked for."""

    def place_first(self, rows: Annotated[NDArray[numpy.float64], dict(shape=(None, None))]) -> None: ...

    def tell(self, fitness: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], violation: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> None: ...

    @property
    def round(self) -> int: ...

    @property
    def active(self) -> int: ...

    @property
    def spent(self) -> bool: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def best_fitness(self) -> float: ...

    @property
    def best_violation(self) -> float: ...

    @property
    def best_position(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def failed_evaluations(self) -> int: ...

    def state(self) -> dict[str, numpy.typing.NDArray[numpy.float64 | numpy.float32 | numpy.int64]]:
        """All that a later round depends on, by name."""

    def restore(self, state: dict[str, numpy.typing.NDArray[numpy.float64 | numpy.float32 | numpy.int64]]) -> None: ...

class FoundMotion64:
    """A motion, and what it is worth."""

    @property
    def fitness(self) -> float:
        """Infinite where the motion is not free."""

    @property
    def violation(self) -> float:
        """0 where it is free [m]."""

    @property
    def goal(self) -> int: ...

    @property
    def points(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """The interior control points, and the end where that is free (K, n)."""

class Improvement64:
    """A motion that was the best when it was found."""

    @property
    def seconds(self) -> float: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def fitness(self) -> float: ...

    @property
    def by(self) -> str:
        """straight, rrt_connect, refine or swarm."""

    @property
    def goal(self) -> int: ...

    @property
    def points(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

class Judgement64:
    """What motions are worth, one a row."""

    @property
    def fitness(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def violation(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def terms(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """(rows, terms), in the order of `motion_terms`."""

    @property
    def free(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]: ...

class Projection64:
    """Motions projected onto their terminal constraints."""

    @property
    def points(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def met(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]: ...

class FollowedPath64:
    """What became of a path of straight edges."""

    @property
    def outcome(self) -> str:
        """
        free; blocked: the path itself is not; unmet: something else than clearance; unfinished: too many corners.
        """

    @property
    def points(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def edge(self) -> int:
        """Where it is blocked; -1: it is not."""

    @property
    def at(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def looks(self) -> int: ...

class MotionSearch64:
    """The search for motions, one island."""

    def __init__(self, *, scene: Model64, problem: MotionProblem, settings: SearchSettings, seed: int, island: int) -> None: ...

    def run(self, *, evaluations: int, seconds: float, until_first: bool, stall: int, progress: Callable[[int], object] | None) -> None:
        """
        Goes on; 0 is no limit. `progress` is told the evaluations now and then, and stops the search with False.
        """

    def add_instant(self, at: float, spread: float) -> None:
        """Looks there from now on; motions that collide there are forgotten."""

    def judge(self, rows: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], interior: int, goal: int) -> Judgement64:
        """What motions (rows, K n) are worth."""

    def blend_corners(self, corners: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], goal: int) -> FollowedPath64:
        """
        The motion along a path (m, n) from the start to a goal, as near to it as it takes to be free.
        """

    def shorten(self, corners: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], goal: int, *, shortcuts: int, seed: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        A path (m, n) without the points that it does not need, shortened by so many random shortcuts.
        """

    def with_interior(self, rows: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], interior: int, goal: int, wanted: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        The motions with another number of control points that are nearest to motions (rows, K n).
        """

    def base_along(self, rows: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], interior: int, goal: int, nodes: int, ends_only: bool) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]:
        """
        Position and attitude wxyz of the base at the nodes (rows, nodes + 1, 7), or at the last (rows, 1, 7).
        """

    def project(self, rows: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], interior: int, goal: int) -> Projection64:
        """Motions (rows, K n) moved until their terminal constraints are met."""

    @property
    def best(self) -> FoundMotion64 | None: ...

    @property
    def fallback(self) -> FoundMotion64 | None:
        """
        Of the motions that are not free, the one that is the least in collision.
        """

    @property
    def history(self) -> list[Improvement64]: ...

    @property
    def optimal(self) -> bool: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def configurations(self) -> int: ...

    @property
    def seconds(self) -> float: ...

def uniforms64(seed: int, trial: int, purpose: int, iteration: int, first: int, block: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

def sincos64(x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]: ...

class Model32:
    """A robot among obstacles."""

    def __init__(self, world: World) -> None: ...

    def joint_frames(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None, None, None))]:
        """Frames of the joints (rows, joints, 4, 4)."""

    def points(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None, None))]:
        """Positions of the points (rows, points, 3) [m]."""

    def clearances(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None, None))]:
        """Of point capsules and spheres (rows, capsules, spheres) [m]."""

    def obstacle_clearances(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None, None))]:
        """
        Of the envelope's bodies and the obstacles (rows, bodies, obstacles) [m]; negative inside, by the depth: of a capsule and a box or a cylinder that of the deepest point of its axis.
        """

    def pair_clearances(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))], pairs: Annotated[NDArray[numpy.int32], dict(shape=(None, 2), order='C')]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """Of pairs of bodies (rows, pairs) [m], as `obstacle_clearances`."""

    def shortfalls(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))], margin: float, stop_early: bool) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]:
        """
        How far the clearance falls short of the margin, summed over pairs (rows,) [m].
        """

    def free(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))], margin: float) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]:
        """Whether all pairs keep it (rows,)."""

    def levers(self, most: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]:
        """
        How far at most a unit of each joint moves any point of the bodies (n,); `most`: the joints' greatest values without their signs (n,).
        """

    def momentum_terms(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))], dq: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """
        With the base at rest: centre of mass, angular momentum, inertia (xx, yy, zz, xy, xz, yz), rate of a free base, velocity of the centre (rows, 18).
        """

class TrialResult32:
    """What one trial of a swarm came to; histories have one entry a round."""

    @property
    def fitness(self) -> float: ...

    @property
    def violation(self) -> float: ...

    @property
    def rounds(self) -> int: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def first_feasible_round(self) -> int:
        """-1: none was feasible."""

    @property
    def position(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]: ...

    @property
    def fitness_history(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]: ...

    @property
    def violation_history(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]: ...

    @property
    def evaluation_history(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...

    @property
    def position_history(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """(rounds, dims), or (0, dims) if they were not kept."""

class PaperObjective32:
    """The paper's fitness and constraints of one configuration."""

    def __init__(self, *, scene: Model32, centers: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], tip: int, goal: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], weights: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], must_reach: bool, tolerance: float) -> None: ...

    def terms(self, q: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """f1, f2 and f3 (rows, 3)."""

    def evaluate(self, x: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> tuple[Annotated[NDArray[numpy.float32], dict(shape=(None,))], Annotated[NDArray[numpy.float32], dict(shape=(None,))]]:
        """Fitness and violation (rows,) of rows of positions."""

    def search(self, *, lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], settings: SwarmSettings, seed: int, first_trial: int, trials: int, threads: int, keep_positions: bool, stop_when_feasible: bool, seconds: float, initial: Annotated[NDArray[numpy.float32], dict(shape=(None, None))] | None, progress: Callable[[int], object] | None) -> list[TrialResult32]:
        """
        Independent trials of a swarm, spread over threads; `progress` is told the rounds done, and says whether to go on.
        """

class ReachObjective32:
    """Configurations that bring points of the robot to given places."""

    def __init__(self, *, scene: Model32, points: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')], targets: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')], tolerances: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], margin: float, home: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> None: ...

    def evaluate(self, x: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> tuple[Annotated[NDArray[numpy.float32], dict(shape=(None,))], Annotated[NDArray[numpy.float32], dict(shape=(None,))]]:
        """Fitness and violation (rows,) of rows of positions."""

    def search(self, *, lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], settings: SwarmSettings, seed: int, first_trial: int, trials: int, threads: int, keep_positions: bool, stop_when_feasible: bool, seconds: float, initial: Annotated[NDArray[numpy.float32], dict(shape=(None, None))] | None, progress: Callable[[int], object] | None) -> list[TrialResult32]:
        """
        Independent trials of a swarm, spread over threads; `progress` is told the rounds done, and says whether to go on.
        """

class Swarm32:
    """A particle swarm: ask, then tell, round after round."""

    def __init__(self, settings: SwarmSettings, lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], seed: int, trial: int) -> None: ...

    def ask(self) -> None: ...

    def positions(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """(active, dims) the positions asked for."""

    def place_first(self, rows: Annotated[NDArray[numpy.float32], dict(shape=(None, None))]) -> None: ...

    def tell(self, fitness: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C')], violation: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C')]) -> None: ...

    @property
    def round(self) -> int: ...

    @property
    def active(self) -> int: ...

    @property
    def spent(self) -> bool: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def best_fitness(self) -> float: ...

    @property
    def best_violation(self) -> float: ...

    @property
    def best_position(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]: ...

    @property
    def failed_evaluations(self) -> int: ...

    def state(self) -> dict[str, numpy.typing.NDArray[numpy.float64 | numpy.float32 | numpy.int64]]:
        """All that a later round depends on, by name."""

    def restore(self, state: dict[str, numpy.typing.NDArray[numpy.float64 | numpy.float32 | numpy.int64]]) -> None: ...

class FoundMotion32:
    """A motion, and what it is worth."""

    @property
    def fitness(self) -> float:
        """Infinite where the motion is not free."""

    @property
    def violation(self) -> float:
        """0 where it is free [m]."""

    @property
    def goal(self) -> int: ...

    @property
    def points(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """The interior control points, and the end where that is free (K, n)."""

class Improvement32:
    """A motion that was the best when it was found."""

    @property
    def seconds(self) -> float: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def fitness(self) -> float: ...

    @property
    def by(self) -> str:
        """straight, rrt_connect, refine or swarm."""

    @property
    def goal(self) -> int: ...

    @property
    def points(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]: ...

class Judgement32:
    """What motions are worth, one a row."""

    @property
    def fitness(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]: ...

    @property
    def violation(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]: ...

    @property
    def terms(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """(rows, terms), in the order of `motion_terms`."""

    @property
    def free(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]: ...

class Projection32:
    """Motions projected onto their terminal constraints."""

    @property
    def points(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]: ...

    @property
    def met(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,))]: ...

class FollowedPath32:
    """What became of a path of straight edges."""

    @property
    def outcome(self) -> str:
        """
        free; blocked: the path itself is not; unmet: something else than clearance; unfinished: too many corners.
        """

    @property
    def points(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]: ...

    @property
    def edge(self) -> int:
        """Where it is blocked; -1: it is not."""

    @property
    def at(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None,))]: ...

    @property
    def looks(self) -> int: ...

class MotionSearch32:
    """The search for motions, one island."""

    def __init__(self, *, scene: Model32, problem: MotionProblem, settings: SearchSettings, seed: int, island: int) -> None: ...

    def run(self, *, evaluations: int, seconds: float, until_first: bool, stall: int, progress: Callable[[int], object] | None) -> None:
        """
        Goes on; 0 is no limit. `progress` is told the evaluations now and then, and stops the search with False.
        """

    def add_instant(self, at: float, spread: float) -> None:
        """Looks there from now on; motions that collide there are forgotten."""

    def judge(self, rows: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')], interior: int, goal: int) -> Judgement32:
        """What motions (rows, K n) are worth."""

    def blend_corners(self, corners: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')], goal: int) -> FollowedPath32:
        """
        The motion along a path (m, n) from the start to a goal, as near to it as it takes to be free.
        """

    def shorten(self, corners: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')], goal: int, *, shortcuts: int, seed: int) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """
        A path (m, n) without the points that it does not need, shortened by so many random shortcuts.
        """

    def with_interior(self, rows: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')], interior: int, goal: int, wanted: int) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]:
        """
        The motions with another number of control points that are nearest to motions (rows, K n).
        """

    def base_along(self, rows: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')], interior: int, goal: int, nodes: int, ends_only: bool) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None, None))]:
        """
        Position and attitude wxyz of the base at the nodes (rows, nodes + 1, 7), or at the last (rows, 1, 7).
        """

    def project(self, rows: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')], interior: int, goal: int) -> Projection32:
        """Motions (rows, K n) moved until their terminal constraints are met."""

    @property
    def best(self) -> FoundMotion32 | None: ...

    @property
    def fallback(self) -> FoundMotion32 | None:
        """
        Of the motions that are not free, the one that is the least in collision.
        """

    @property
    def history(self) -> list[Improvement32]: ...

    @property
    def optimal(self) -> bool: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def configurations(self) -> int: ...

    @property
    def seconds(self) -> float: ...

def uniforms32(seed: int, trial: int, purpose: int, iteration: int, first: int, block: int) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None))]: ...

def sincos32(x: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C')]) -> tuple[Annotated[NDArray[numpy.float32], dict(shape=(None,))], Annotated[NDArray[numpy.float32], dict(shape=(None,))]]: ...

class GoalSearch64:
    """
    Free configurations that bring a frame to its goal, from many guesses side by side.
    """

    def __init__(self, *, scene: Model64, goal: FrameGoal, start: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], whole_turns: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')], margin: float, seed: int) -> None: ...

    def look(self, guesses: int) -> None:
        """Goes on with so many guesses more; the first is the start."""

    @property
    def begun(self) -> int:
        """Guesses."""

    @property
    def reached(self) -> int:
        """How many of them led to the goal."""

    @property
    def in_collision(self) -> int:
        """How many of those are in collision."""

    def differing(self, most: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        (g, n) that have the clearance asked for, spread wide, nearest to the start first.
        """

    def lacking(self, most: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        (g, n) that lack some of the clearance asked for, those that lack least first.
        """

    def missed(self, most: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        (b, n) where guesses ended that missed the goal, the nearest to it first.
        """

    def pulled(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], most: int, *, pull: bool, at_centre: bool) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        (g, n) of configurations at the goal, and with `pull` of what they become when pulled towards the start.
        """

    def with_turns(self, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], most: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        (g, n) configurations, and while there are fewer those a whole turn of a joint away.
        """

def polished64(scene: Model64, goal: FrameGoal, q: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], rounds: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """
    (b, n) brought to the goal's centre by damped least squares, or as near to it as bounds and arm allow.
    """

def product(a: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C')], b: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C')]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]:
    """Matrices (p, m, k) by matrices (p or 1, k, n)."""

def sines(x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
    """Sines and cosines."""

def angles(y: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """The angles of vectors (x, y) [rad]."""

def cube_roots(x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

class CoreKind(enum.Enum):
    """The core of a convex shape; a point is a segment of half length 0."""

    segment = 0

    box = 1

    cylinder = 2

    polytope = 3

class ConvexShape:
    """
    All points within a radius of a core; a polytope's vertices are in its own frame.
    """

    def __init__(self, *, kind: CoreKind, half: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], radius: float, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C')]) -> None: ...

def convex_distances64(a: ConvexShape, poses_a: Annotated[NDArray[numpy.float64], dict(shape=(None, 4, 4), order='C')], b: ConvexShape, poses_b: Annotated[NDArray[numpy.float64], dict(shape=(None, 4, 4), order='C')], *, enough: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Signed distances (m,) [m] of two shapes at poses (m, 4, 4) each; at `enough` or beyond, that at least.
    """

def convex_distances32(a: ConvexShape, poses_a: Annotated[NDArray[numpy.float64], dict(shape=(None, 4, 4), order='C')], b: ConvexShape, poses_b: Annotated[NDArray[numpy.float64], dict(shape=(None, 4, 4), order='C')], *, enough: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """The same, computed in float."""

def spline_values(s: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], interior: int, derivative: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

level: str = ...

lanes32: int = ...

lanes64: int = ...

compiler: str = ...
