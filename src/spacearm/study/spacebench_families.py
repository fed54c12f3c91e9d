"""The families of SpaceBench: what draws a problem, told in the base's frame at the beginning, its ends still to be reached.

truss     reach into a bay of a truss, from outside or from another bay
panel     around the solar panel of a client
module    along the hull of a module with handrails
grapple   approach to a grapple fixture that stands between thrusters
arms      two arms on one spacecraft, past a boom and each other
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.geometry import Box, Capsule, Cylinder, Obstacle
from spacearm.planner import BaseLimits, PoseGoal, PositionGoal
from spacearm.proof.required_clearance import DEFAULT_CLEARANCE
from spacearm.robot import Robot
from spacearm.study.spacebench_robots import light, two_arms

Array = NDArray[np.float64]

CLOSE_CLEARANCE = 0.005
"""The clearance where the hand works within centimetres of a hull or between nozzles: `module` and `grapple` [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """A robot as the families see it; all lengths of a scene are scaled to it.

    Attributes:
        robot: with a base that floats.
        shoulder: (3,) where its arm begins to reach out, in the base's frame [m].
        scale: of the scene; 1 suits an arm that reaches 0.87 m.
        along: axis of the tip's frame that points out of the hand.
    """

    robot: Robot
    shoulder: tuple[float, float, float]
    scale: float = 1.0
    along: Literal["x", "z"] = "z"

    def at(self, offset: ArrayLike) -> Array:
        """Return a point by its offset from the shoulder, (3,) before scaling."""
        return np.array(self.shoulder) + self.scale * np.asarray(offset, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """A problem as it is drawn, in the base's frame at the beginning.

    Attributes:
        robot: what moves.
        obstacles: of the scene.
        start: where the arm's tip, or each arm's, begins.
        goal: where it ends.
        in_joints: whether the goal is told as joint positions that reach it with the base at rest, rather than in space.
        keep_attitude: the base is to end as it began, within this angle [rad]; None: as it comes.
        limits: how little the base may be disturbed.
        clearance: that all pairs of bodies have to keep [m].
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]
    start: tuple[PositionGoal | PoseGoal, ...]
    goal: tuple[PositionGoal | PoseGoal, ...]
    in_joints: bool
    keep_attitude: float | None = None
    limits: BaseLimits = field(default_factory=BaseLimits)
    clearance: float = DEFAULT_CLEARANCE


Family: TypeAlias = Callable[[np.random.Generator], Draft]
"""Draws a problem."""

Requirements: TypeAlias = tuple[float | None, BaseLimits]
"""Within what angle the base is to end as it began, and how little it may be disturbed."""


def base_requirements(rng: np.random.Generator, *, in_joints: bool, peak: tuple[float, float]) -> Requirements:
    """Draw the requirements on the base: none, to end as it began, or to turn little.

    Args:
        rng: of the problem.
        in_joints: no attitude is asked for at the end then.
        peak: range of the limit of its greatest angle [deg].
    """
    kind = rng.choice(["nothing", "attitude", "peak"], p=[0.5, 0.25, 0.25])
    limit, tolerance = math.radians(round(rng.uniform(*peak), 1)), math.radians(0.5)
    if kind == "attitude" and not in_joints:
        return tolerance, BaseLimits()
    return None, BaseLimits(peak=limit) if kind == "peak" else BaseLimits()


def direction(bearing: float, elevation: float) -> Array:
    """Return the unit vector (3,) at a bearing from x towards y and an elevation towards z [rad]."""
    c = math.cos(elevation)
    return np.array([c * math.cos(bearing), c * math.sin(bearing), math.sin(elevation)])


def frame_along(z: ArrayLike, turn: float = 0.0) -> Array:
    """Return a rotation (3, 3) whose third column is a direction, turned about it by an angle [rad]."""
    third = np.asarray(z, dtype=np.float64) / np.linalg.norm(z)
    helper = np.array([0.0, 0.0, 1.0]) if abs(third[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    first = np.cross(helper, third)
    first /= np.linalg.norm(first)
    second = np.cross(third, first)
    c, s = math.cos(turn), math.sin(turn)
    return np.column_stack([c * first + s * second, c * second - s * first, third])


def transform(rotation: Array, origin: ArrayLike) -> Array:
    """Return the transform (4, 4) of a rotation (3, 3) and an origin (3,) [m]."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, origin
    return T


def hand_at(
    site: Site, point: ArrayLike, pointing: ArrayLike, *, frame: str | None = None, within: float = math.radians(2)
) -> PoseGoal:
    """Return the goal of a hand at a point that points in a direction, turned about it as it likes.

    Args:
        site: the robot.
        point: (3,) of the tip, in the base's frame [m].
        pointing: (3,) direction out of the hand.
        frame: of the tip; None: the robot's.
        within: of the direction [rad].
    """
    R = frame_along(pointing)
    if site.along == "x":
        R = R[:, [2, 0, 1]]
    return PoseGoal(
        transform(R, point),
        position_tolerance=0.002 * site.scale,
        orientation_tolerance=within,
        free_axis=site.along,
        frame=frame,
    )


def tip_at(site: Site, point: ArrayLike, *, frame: str | None = None) -> PositionGoal:
    """Return the goal of a tip at a point (3,), in the base's frame [m], the hand pointing anywhere."""
    return PositionGoal(np.asarray(point, dtype=np.float64), tolerance=0.002 * site.scale, frame=frame)


def rods(ends: Sequence[tuple[Array, Array]], radius: float, T: Array, name: str) -> tuple[Capsule, ...]:
    """Return rods between points told in a frame T (4, 4) [m]."""
    return tuple(
        Capsule(T[:3, :3] @ a + T[:3, 3], T[:3, :3] @ b + T[:3, 3], radius, name=f"{name} {i + 1}")
        for i, (a, b) in enumerate(ends)
    )


# ---- truss ------------------------------------------------------------------------------------------------------------


def draw_truss(rng: np.random.Generator) -> Draft:
    """Draw a box truss of three bays before the arm, one of them closed by a diagonal; the tip ends inside another.

    The small arm meets a truss of bays of about 0.4 m; Canadarm2 one ten times as large.
    """
    site = _truss_sites()[int(rng.choice(3, p=[0.4, 0.35, 0.25]))]
    bay, width, depth = rng.uniform(0.38, 0.5), rng.uniform(0.36, 0.46), rng.uniform(0.32, 0.45)
    away = direction(rng.uniform(-math.pi, math.pi), rng.uniform(0.3, 1.3))
    middle = away * rng.uniform(0.42, 0.52)
    T = transform(frame_along(away, rng.uniform(-math.pi, math.pi)), site.at(middle))
    order = rng.permutation(3)
    goal_bay, start_bay, closed = (int(i) - 1 for i in order)
    obstacles = _truss(site, T, (bay, width, depth), rng.uniform(0.012, 0.02), closed)

    def inside(number: int) -> Array:
        across = rng.uniform(-0.25, 0.25, 2) * (bay, width)
        return _placed(site, T, (number * bay + across[0], across[1], rng.uniform(0.06, 0.2)))

    # From the middle bay the motion is short; half of the motions begin outside.
    begin = inside(start_bay) if rng.random() < 0.5 else _placed(site, T, (start_bay * bay, 0.0, -rng.uniform(0.1, 0.25)))
    end = inside(goal_bay)
    in_joints = bool(rng.random() < 0.4)
    keep, limits = base_requirements(rng, in_joints=in_joints, peak=(8, 20))
    goal = tip_at(site, end) if rng.random() < 0.5 else hand_at(site, end, T[:3, 2] + rng.normal(0, 0.2, 3))
    return Draft(
        robot=site.robot,
        obstacles=obstacles,
        start=(tip_at(site, begin),),
        goal=(goal,),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
    )


def _truss_sites() -> tuple[Site, ...]:
    return (
        Site(robot=light("srs7", 100), shoulder=(0, 0, 0.31)),
        Site(robot=light("srs7", 200), shoulder=(0, 0, 0.31)),
        Site(robot=light("ssrms", 14515), shoulder=(0, 0, 4.2), scale=11.0, along="x"),
    )


def _placed(site: Site, T: Array, local: tuple[float, float, float]) -> Array:
    return T[:3, :3] @ (site.scale * np.array(local)) + T[:3, 3]


def _truss(site: Site, T: Array, sizes: tuple[float, float, float], radius: float, closed: int) -> tuple[Capsule, ...]:
    """Chords, battens and diagonals of three bays; the front face is at z = 0 of the frame, the beam runs along x."""
    bay, width, depth = sizes
    corners = [(y, z) for y in (-width / 2, width / 2) for z in (0.0, depth)]
    stations = [bay * (i - 1.5) for i in range(4)]
    ends = [((stations[0], y, z), (stations[3], y, z)) for y, z in corners]  # chords
    for x in stations:  # battens: a frame around the beam
        for one, other in itertools.combinations(corners, 2):
            if one[0] == other[0] or one[1] == other[1]:
                ends.append(((x, *one), (x, *other)))
    for number, (x, y) in enumerate(itertools.pairwise(stations)):  # diagonals: of the back, of a side, and of one window
        flip = 1 if number % 2 else -1
        ends.append(((x, -flip * width / 2, depth), (y, flip * width / 2, depth)))
        ends.append(((x, flip * width / 2, 0.0), (y, flip * width / 2, depth)))
        if number - 1 == closed:
            ends.append(((x, -width / 2, 0.0), (y, width / 2, 0.0)))
    scaled = [(site.scale * np.array(a), site.scale * np.array(b)) for a, b in ends]
    return rods(scaled, radius * site.scale, T, "strut")


# ---- panel ------------------------------------------------------------------------------------------------------------


_PANEL_MASSES = (1474.1, 800.0, 500.0)  # of the servicer's base [kg]


def draw_panel(rng: np.random.Generator) -> Draft:
    """Draw the panel of a client, on its yoke, reaching in between two sides of the servicer's arm."""
    site = Site(robot=light("servicer7", float(rng.choice(_PANEL_MASSES))), shoulder=(0, 0, 1.3), scale=2.6)
    bearing, height = rng.uniform(-math.pi, math.pi), rng.uniform(0.15, 0.45)
    tilt = rng.uniform(-0.35, 0.35)
    out, up = direction(bearing, 0.0), np.array([0.0, 0.0, 1.0])
    normal = np.cross(up, out)
    lean = math.cos(tilt) * up + math.sin(tilt) * normal
    face = np.cross(lean, out)
    inner, length, tall = rng.uniform(0.22, 0.38), rng.uniform(0.9, 1.5), rng.uniform(0.4, 0.7)
    T = transform(np.column_stack([out, face, lean]), site.at(out * (inner + length / 2) + up * height))
    panel = Box(site.scale * np.array([length, 0.025, tall]), T, name="panel")
    edge = T[:3, 3] + out * site.scale * length / 2
    yoke = Capsule(edge, edge + out * 0.2 * site.scale, 0.03 * site.scale, name="yoke")
    bus = Box(np.full(3, 0.5 * site.scale), transform(T[:3, :3], edge + out * 0.45 * site.scale), name="client")

    def beside(side: int) -> Array:
        radius, angle = rng.uniform(0.45, 0.75), side * rng.uniform(0.25, 1.0)
        return site.at(radius * direction(bearing + angle, 0.0) + up * (height + rng.uniform(-0.15, 0.25)))

    side = int(rng.choice([-1, 1]))
    begin, end = beside(side), beside(-side)
    in_joints = bool(rng.random() < 0.4)
    keep, limits = base_requirements(rng, in_joints=in_joints, peak=(5, 15))
    goal = tip_at(site, end) if rng.random() < 0.4 else hand_at(site, end, side * face + rng.normal(0, 0.3, 3))
    return Draft(
        robot=site.robot,
        obstacles=(panel, yoke, bus),
        start=(tip_at(site, begin),),
        goal=(goal,),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
    )


# ---- module -----------------------------------------------------------------------------------------------------------


_HULL = 2.2  # radius of the module [m], as of the Space Station's
_RAIL, _STAND_OFF = 0.018, 0.09  # radius of a handrail, and of its axis from the hull [m]
_MODULE_MASSES = (100.0, 150.0, 250.0)  # of the base [kg]


def draw_module(rng: np.random.Generator) -> Draft:
    """Draw a hull beside the arm, three to five handrails on it, and two places close to it with a rail between them."""
    site = Site(robot=light("srs7", float(rng.choice(_MODULE_MASSES))), shoulder=(0, 0, 0.31))
    away = direction(rng.uniform(-math.pi, math.pi), rng.uniform(0.45, 1.3))
    gap = rng.uniform(0.45, 0.6)
    # The hull's frame: z along the module's axis, x out of it towards the arm.
    R = frame_along(-away, rng.uniform(-math.pi, math.pi))[:, [2, 0, 1]]
    T = transform(R, site.at(away * (gap + _HULL)))
    obstacles: list[Obstacle] = [Cylinder(_HULL, 3.5, T, name="hull")]
    places = rng.uniform(0.2, 0.42) * np.array([-1.0, 1.0]) + rng.normal(0, 0.05)
    number = int(rng.integers(3, 6))
    for i in range(number):
        along = places[0] + (places[1] - places[0]) * (0.15 + 0.7 * (i + 0.5) / number)
        obstacles += _handrail(T, along, rng.normal(0, 0.12), rng.uniform(0.25, 0.5), bool(rng.random() < 0.7), i)

    def close(along: float) -> Array:
        return _on_hull(T, along, rng.uniform(-0.15, 0.15), rng.uniform(0.05, 0.08))

    inward = lambda: away + rng.normal(0, 0.15, 3)  # noqa: E731
    begin, end = close(places[0]), close(places[1])
    in_joints = bool(rng.random() < 0.35)
    keep, limits = base_requirements(rng, in_joints=in_joints, peak=(6, 15))
    wide = math.radians(20)
    return Draft(
        robot=site.robot,
        obstacles=tuple(obstacles),
        start=(hand_at(site, begin, inward(), within=wide),),
        goal=(hand_at(site, end, inward(), within=math.radians(5)),),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
        clearance=CLOSE_CLEARANCE,
    )


def _on_hull(T: Array, along: float, across: float, height: float) -> Array:
    """Return a point by its place along the axis and around it [m], and its height above the hull [m]."""
    angle, radius = across / _HULL, _HULL + height
    return T[:3, :3] @ np.array([radius * math.cos(angle), radius * math.sin(angle), along]) + T[:3, 3]


def _handrail(T: Array, along: float, across: float, length: float, around: bool, number: int) -> tuple[Obstacle, ...]:
    """A rail and its two posts; `around` is whether it lies around the module or along it."""
    half = np.array([0.0, length / 2] if around else [length / 2, 0.0])
    ends = [_on_hull(T, along + s * half[0], across + s * half[1], _STAND_OFF) for s in (-1, 1)]
    feet = [_on_hull(T, along + s * half[0], across + s * half[1], 0.0) for s in (-1, 1)]
    return rods([(ends[0], ends[1]), *zip(ends, feet, strict=True)], _RAIL, np.eye(4), f"rail {number + 1} part")


# ---- grapple ----------------------------------------------------------------------------------------------------------


def draw_grapple(rng: np.random.Generator) -> Draft:
    """Draw a client's face with a fixture and three to five nozzles around it; the hand ends before the fixture."""
    site = _grapple_sites()[int(rng.choice(4, p=[0.35, 0.25, 0.2, 0.2]))]
    away = direction(rng.uniform(-math.pi, math.pi), rng.uniform(0.0, 1.1))
    face = away + rng.normal(0, 0.2, 3)
    T = transform(frame_along(face, rng.uniform(-math.pi, math.pi)), site.at(away * rng.uniform(0.62, 0.76)))
    scale = site.scale

    def on_face(x: float, y: float, height: float) -> Array:
        return T[:3, :3] @ (scale * np.array([x, y, -height])) + T[:3, 3]

    def standing(x: float, y: float, foot: float, length: float, radius: float, name: str) -> Cylinder:
        return Cylinder(scale * radius, scale * length, transform(T[:3, :3], on_face(x, y, foot + length / 2)), name=name)

    body = Box(scale * np.array([0.9, 0.9, 0.5]), transform(T[:3, :3], on_face(0, 0, -0.25)), name="client")
    obstacles: list[Obstacle] = [body, standing(0, 0, 0.0, 0.02, 0.05, "fixture plate")]
    number, first = int(rng.integers(3, 6)), rng.uniform(0, math.tau)
    for i in range(number):
        angle, radius = first + math.tau * i / number + rng.normal(0, 0.1), rng.uniform(0.135, 0.18)
        x, y, length = radius * math.cos(angle), radius * math.sin(angle), rng.uniform(0.1, 0.2)
        obstacles.append(standing(x, y, 0.0, 0.04, 0.025, f"thruster {i + 1} throat"))
        obstacles.append(standing(x, y, 0.04, length / 2, 0.038, f"thruster {i + 1} nozzle"))
        obstacles.append(standing(x, y, 0.04 + length / 2, length / 2, 0.05, f"thruster {i + 1} exit"))
    aside, turn = rng.uniform(0.2, 0.45), rng.uniform(0, math.tau)
    begin = on_face(aside * math.cos(turn), aside * math.sin(turn), rng.uniform(0.08, 0.3))
    in_joints = bool(rng.random() < 0.3)
    keep, limits = base_requirements(rng, in_joints=in_joints, peak=(4, 12))
    return Draft(
        robot=site.robot,
        obstacles=tuple(obstacles),
        start=(tip_at(site, begin),),
        goal=(hand_at(site, on_face(0, 0, rng.uniform(0.07, 0.09)), T[:3, 2], within=math.radians(3)),),
        in_joints=in_joints,
        keep_attitude=keep,
        limits=limits,
        clearance=CLOSE_CLEARANCE,
    )


def _grapple_sites() -> tuple[Site, ...]:
    return (
        Site(robot=light("srs7", 100), shoulder=(0, 0, 0.31)),
        Site(robot=light("srs7", 200), shoulder=(0, 0, 0.31)),
        Site(robot=light("ets7", 1000), shoulder=(-0.79, -0.29, 1.35), scale=2.4, along="x"),
        Site(robot=light("servicer7", 800), shoulder=(0, 0, 1.3), scale=2.6),
    )


# ---- arms -------------------------------------------------------------------------------------------------------------


_ARMS_MASSES = (120.0, 200.0)  # of the base [kg]
_TIPS = ("left_tip", "right_tip")


def draw_arms(rng: np.random.Generator) -> Draft:
    """Draw a client before the arms whose boom reaches in between; the tips end on other sides than they began."""
    site = Site(robot=two_arms(float(rng.choice(_ARMS_MASSES))), shoulder=(0, 0, 0.31))
    front = int(rng.choice([-1, 1]))
    # A client before the arms, that fits between them, and its boom, which reaches in between.
    size = rng.uniform((0.3, 0.15, 0.25), (0.6, 0.25, 0.5))
    middle = np.array([rng.normal(0, 0.08), front * (0.4 + size[1] / 2), rng.uniform(0.15, 0.4)])
    foot = middle + np.array([0.0, -front * size[1] / 2, rng.uniform(-0.1, 0.1)])
    end = foot + np.array([rng.normal(0, 0.1), -front * rng.uniform(0.35, 0.8), rng.uniform(-0.05, 0.15)])
    obstacles: tuple[Obstacle, ...] = (
        Box(size, site.at(middle), name="client"),
        Capsule(site.at(foot), site.at(end), rng.uniform(0.02, 0.04), name="boom"),
    )

    def aside(x: float, y: float) -> Array:
        return site.at((x + rng.normal(0, 0.06), y + rng.normal(0, 0.08), rng.uniform(0.05, 0.5)))

    both = bool(rng.random() < 0.6)
    begin = (aside(-0.6, front * 0.4), aside(0.6, front * 0.4))
    if both:  # the tips change places in depth, and come to the middle one above the other
        end = (aside(-0.15, -front * 0.3), aside(0.35, front * rng.choice([-0.35, 0.1])))
        keep, limits = base_requirements(rng, in_joints=True, peak=(8, 20))
        goal = tuple(tip_at(site, point, frame=tip) for point, tip in zip(end, _TIPS, strict=True))
    else:
        keep, limits = (math.radians(0.5), base_requirements(rng, in_joints=True, peak=(3, 10))[1])
        goal = (tip_at(site, aside(rng.uniform(-0.35, 0.1), -front * 0.35), frame=_TIPS[0]),)
    return Draft(
        robot=site.robot,
        obstacles=obstacles,
        start=tuple(tip_at(site, point, frame=tip) for point, tip in zip(begin, _TIPS, strict=True)),
        goal=goal,
        in_joints=both,
        keep_attitude=keep,
        limits=limits,
    )


FAMILIES: dict[str, Family] = {
    "truss": draw_truss,
    "panel": draw_panel,
    "module": draw_module,
    "grapple": draw_grapple,
    "arms": draw_arms,
}
"""The families, in the order of the reports, and what draws the problems of each."""
