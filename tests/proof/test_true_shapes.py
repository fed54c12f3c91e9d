"""Bodies of every shape: what is proven of boxes, cylinders and polytopes is true, by Coal and by their points."""

from __future__ import annotations

import itertools
from dataclasses import replace

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from spacearm.dynamics import Momentum
from spacearm.geometry import (
    Box,
    ConvexShape,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    pose,
)
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.proof import Certificate, certify
from spacearm.proof.convex_bodies import robot_bodies, scene_bodies
from spacearm.proof.witness import CoalBodies, coal_polytope
from spacearm.robot import Joint, LinkShape, Robot
from support import strategies
from support.dense_samples import Setting, planar
from support.drawn_links import obstacles, polytopes, shaped_arms, shapes
from support.drawn_motions import motions_of
from support.floating_arms import Adrift, along, floating_arms, frames_of, lander
from support.oracles.coal_shapes import distance, geometry_of, least_distances, placed_obstacle, shape_pairs
from support.oracles.pinocchio_points import joint_frames

COALS = 1e-7  # [m] tolerance of Coal where it has no closed form, and how much thicker the oracle makes flat polytopes
INSTANTS = 40  # of each of the drawn trajectories


@settings(max_examples=60)
@given(polytopes(), polytopes(), strategies.points(3.0))
def test_the_witness_measures_hulls_as_least_squares_do(one: Polytope, other: Polytope, aside: np.ndarray) -> None:
    other = Polytope(other.vertices + aside, rounding=other.rounding)
    robot, scene = planar(capsules=None, shapes=(LinkShape(name="bolted", joint=-1, shape=one),)), Scene([other])
    bodies = robot_bodies(robot)
    in_scene = len(bodies)
    bodies = bodies.followed_by(scene_bodies(scene))
    measured, _ = CoalBodies(robot, scene, bodies).distance(np.tile(np.eye(4)[:3], (4, 1, 1)), 0, in_scene)
    weight = 1e4
    rows = [np.concatenate([one.vertices, -other.vertices]).T]
    rows += [weight * np.repeat([[1.0, 0.0], [0.0, 1.0]], [len(one.vertices), len(other.vertices)], axis=0).T]
    shares, _ = nnls(np.concatenate(rows), np.array([0, 0, 0, weight, weight]), maxiter=100_000)
    of_one, of_other = shares[: len(one.vertices)], shares[len(one.vertices) :]  # their sums are 1 but for the weight
    apart = np.linalg.norm(of_one / of_one.sum() @ one.vertices - of_other / of_other.sum() @ other.vertices)
    if measured > 1e-6:
        assert measured == pytest.approx(apart - one.rounding - other.rounding, abs=1e-6)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 9])
@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 100.0])
def test_flat_hulls_become_only_a_little_thicker(count: int, size: float) -> None:
    rng = np.random.default_rng(count)
    vertices = size * rng.normal(size=(count, 3)) @ np.diag([1.0, 1.0, 0.0]) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shape, ball = coal_polytope(vertices, 0.0), coal.Sphere(0.0)
    n = np.array([0.6, 0.0, 0.8])
    at = coal.Transform3s(np.eye(3), vertices[np.argmax(vertices @ n)] + 0.3 * n)
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    measured = coal.distance(shape, coal.Transform3s(), ball, at, request, coal.DistanceResult())
    assert 0.3 - 2e-9 * max(np.abs(vertices).max(), 1e-3) - 1e-8 <= measured <= 0.3 + 1e-8


# ---- certificates ----------------------------------------------------------------------------------------------------


@st.composite
def any_trajectories(draw: st.DrawFn, robot: Robot) -> AnyTrajectory:
    """Of ours, and straight ones from point to point."""
    if draw(st.booleans()):
        return Trajectory(robot, draw(motions_of(robot, most=3)))
    q = np.array(draw(st.lists(strategies.configurations(robot), min_size=2, max_size=8)))
    return RecordedTrajectory(robot, PiecewisePath.from_linear(np.arange(len(q)), q))


@settings(max_examples=60)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_a_certificate_of_bodies_of_every_shape_is_true(data: st.DataObject, seed: int) -> None:
    robot = data.draw(shaped_arms())
    setting = Setting(robot, Scene(data.draw(st.lists(obstacles(), max_size=3))))
    trajectory = data.draw(any_trajectories(robot))
    certificate = certify(setting, trajectory, limits=())
    near = certificate.closest
    if near is None:
        assert certificate.holds
        return

    def measured(u: np.ndarray) -> np.ndarray:
        return least_distances(robot, setting.scene, joint_frames(robot, trajectory.curve.sample(u)))

    if certificate.holds:
        assert certificate.clearance is not None
        u = np.random.default_rng(seed).uniform(*trajectory.curve.domain, INSTANTS)
        assert measured(u).min() >= certificate.clearance - COALS
        assert measured(np.array([near.u]))[0] >= certificate.clearance - COALS
        assert certificate.clearance >= near.clearance / 2 - COALS
    elif certificate.status == "fails":
        assert measured(np.array([near.u]))[0] <= COALS
    else:
        assert near.clearance <= 1e-3


# ---- hard to fool ----------------------------------------------------------------------------------------------------

LIMITS = {"lower": (-4.0,), **dict.fromkeys(("upper", "velocity", "acceleration"), (4.0,))}


def carried(kind: str, *shapes: ConvexShape) -> Robot:
    """Shapes on one joint: it turns about z, or slides along z."""
    joint = Joint(name="joint", kind=kind, parent=-1, T_parent_joint=np.eye(4))  # type: ignore[arg-type]
    parts = tuple(LinkShape(name="moved", joint=0, shape=shape) for shape in shapes)
    return planar(joints=(joint,), capsules=None, shapes=parts, frames=planar().frames[:1], tip="base", **LIMITS)


def judged(robot: Robot, obstacle: Obstacle, begin: float, end: float) -> Certificate:
    return certify(Setting(robot, Scene([obstacle])), Trajectory(robot, Motion([[begin], [end]])))


def thin(kind: str, pose_of: np.ndarray) -> ConvexShape:
    """A plate of 0.4 m and 2 mm, as a box, as a cylinder or as a flat polytope."""
    if kind == "box":
        return Box((0.4, 0.4, 0.002), pose_of)
    if kind == "cylinder":
        return Cylinder(0.2, 0.002, pose_of)
    corners = np.array([(x, y, 0.0) for x in (-0.2, 0.2) for y in (-0.2, 0.2)])
    return Polytope(corners @ pose_of[:3, :3].T + pose_of[:3, 3], rounding=0.001)


@pytest.mark.parametrize("other", ["box", "cylinder", "polytope"])
@pytest.mark.parametrize("one", ["box", "cylinder", "polytope"])
@pytest.mark.parametrize("at", [0.0, 0.3137, 1.9])
def test_a_plate_is_not_missed_where_it_passes_through_a_plate(one: str, other: str, at: float) -> None:
    """They touch during a thousandth of the motion."""
    robot = carried("prismatic", thin(one, pose((0, 0, 0))))
    struck = judged(robot, thin(other, pose((0.1, 0.05, at))), -2.0, 2.0)
    assert struck.status == "fails"
    assert struck.closest is not None
    assert struck.closest.clearance <= 0
    beside = judged(robot, thin(other, pose((0.4003 + 0.001 * [one, other].count("polytope"), 0, at))), -2.0, 2.0)
    assert beside.holds


@pytest.mark.parametrize("gap", [1e-3, 1e-5])
@pytest.mark.parametrize("shape", ["box", "polytope", "cylinder"])
def test_a_corner_that_grazes_has_the_clearance_that_it_has(shape: str, gap: float) -> None:
    """The corner of a box (the rim of a cylinder) passes a ball on a circle of known radius."""
    at = pose((1.0, 0, 0), (np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)))
    size = np.array([0.3, 0.3, 0.2])
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size / 2
    made: dict[str, tuple[ConvexShape, float]] = {
        "box": (Box(size, at), 1 + 0.15 * np.sqrt(2)),
        "polytope": (Polytope(corners @ at[:3, :3].T + at[:3, 3]), 1 + 0.15 * np.sqrt(2)),
        "cylinder": (Cylinder(0.15, 0.2, at), 1.15),
    }
    body, reach = made[shape]
    angle = 0.4321
    for sign, status in ((1, "holds"), (-1, "fails")):
        center = (reach + 0.1 + sign * gap) * np.array([np.cos(angle), np.sin(angle), 0.0])
        certificate = judged(carried("revolute", body), Sphere(center, 0.1), -1.0, 1.5)
        assert certificate.status == status
        assert certificate.closest is not None
        assert certificate.closest.clearance == pytest.approx(sign * gap, abs=1e-6 + 0.3 * gap)
        assert sign < 0 or gap / 3 < (certificate.clearance or 0) <= gap


def hollow(wall: float) -> PolytopeSet:
    """A box of six walls, 1 m wide inside."""
    walls = []
    for axis, side in itertools.product(range(3), (-1, 1)):
        half, center = np.full(3, 0.5 + wall), np.zeros(3)
        half[axis], center[axis] = wall / 2, side * (0.5 + wall / 2)
        walls.append(Polytope(center + np.array(list(itertools.product((-1, 1), repeat=3))) * half))
    return PolytopeSet(walls)


@pytest.mark.parametrize("shape", [Box((0.3, 0.3, 0.3)), Sphere((0, 0, 0), 0.15), Cylinder(0.15, 0.3)])
def test_a_body_inside_of_a_hollow_obstacle_is_free_until_it_meets_a_wall(shape: ConvexShape) -> None:
    robot = carried("prismatic", shape)
    inside = judged(robot, hollow(0.001), -0.3, 0.34)
    assert inside.holds
    assert inside.closest is not None
    assert inside.closest.clearance == pytest.approx(0.01, abs=1e-6)
    assert 0.005 - 1e-6 <= (inside.clearance or 0) <= 0.01
    for begin, end in ((-0.3, 0.3501), (-2.0, 2.0), (-2.0, 0.0)):
        assert judged(robot, hollow(0.001), begin, end).status == "fails"


# ---- a floating base -------------------------------------------------------------------------------------------------


def bus(robot: Robot) -> Robot:
    """The lander with a box for a base, a plate for a panel and cylinders for links."""
    shapes = (
        LinkShape(name="bus", joint=-1, shape=Box((0.3, 0.3, 0.3), rounding=0.02)),
        LinkShape(name="panel", joint=-1, shape=Box((2.0, 0.5, 0.01), (-1.2, 0, 0))),
        LinkShape(name="upper", joint=0, shape=Cylinder(0.05, 0.8, pose((0.6, 0, 0), (0.5, 0.5, 0.5, 0.5)))),
        LinkShape(name="fore", joint=1, shape=Polytope([(0, -0.05, 0), (0, 0.05, 0), (1, 0, 0.05), (1, 0, -0.05)])),
    )
    return replace(robot, shapes=shapes, self_pairs=(("bus", "fore"), ("panel", "fore"), ("panel", "upper")))


def in_space(setting: Adrift, q: np.ndarray, T_w_b: np.ndarray) -> np.ndarray:
    """The least clearances (rows,) of a robot whose base is at T_w_b (rows, 4, 4), by Coal."""
    robot, own = setting.robot, [geometry_of(part.shape) for part in setting.robot.shapes]
    solids = [solid for obstacle in setting.scene.obstacles for solid in placed_obstacle(obstacle)]
    out = []
    for T in frames_of(robot, q, T_w_b):
        at = [T[part.joint] @ core for part, (_, core) in zip(robot.shapes, own, strict=True)]
        placed = [
            (made, coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.array(T[:3, 3])))
            for (made, _), T in zip(own, at, strict=True)
        ]
        found = [distance(link, solid) for link in placed for solid in solids]
        found += [distance(placed[i], placed[k]) for i, k in shape_pairs(robot)]
        out.append(min(found, default=np.inf))
    return np.array(out)


@settings(max_examples=25)
@given(st.data())
def test_what_is_proven_of_a_floating_robot_of_any_shape_is_true(data: st.DataObject) -> None:
    robot = data.draw(floating_arms())
    parts = [
        LinkShape(name=f"link_{joint}", joint=joint, shape=data.draw(shapes()))
        for joint in data.draw(st.lists(st.integers(-1, len(robot.joints) - 1), min_size=1, max_size=3))
    ]
    links = sorted({part.name for part in parts})
    robot = replace(robot, shapes=tuple(parts), self_pairs=tuple(itertools.combinations(links, 2)))
    momentum = data.draw(st.sampled_from([None, None, Momentum(linear=(0.2, 0, -0.3), angular=(0.03, -0.1, 0.07))]))
    setting = Adrift(robot, Scene(data.draw(st.lists(obstacles(), max_size=2))), momentum=momentum)
    rows = np.random.default_rng(data.draw(st.integers(0, 9))).uniform(-1, 1, (3, robot.dof))
    made = RecordedTrajectory(robot, PiecewisePath.from_linear(np.arange(3), rows), momentum=momentum)
    certificate = certify(setting, made, limits=())
    if certificate.closest is None:
        return
    way = along(setting, made, steps=100)
    if certificate.holds:
        assert certificate.clearance is not None
        some = np.random.default_rng(0).choice(len(way.u), 25)
        assert in_space(setting, way.q[some], way.T_w_b[some]).min() >= certificate.clearance - COALS
    else:
        assert certificate.closest.clearance < 1e-3


def test_an_arm_that_meets_its_own_base_does_so_on_a_floating_base_too() -> None:
    robot = bus(lander())
    for elbow, status in ((2.2, "holds"), (3.05, "fails")):
        made = Trajectory(robot, Motion([[0.3, 0.0], [0.3, elbow]]), base="floating")
        setting = Adrift(robot, Scene())
        certificate = certify(setting, made)
        assert certificate.status == status
        way = along(setting, made)
        least = in_space(setting, way.q, way.T_w_b).min()
        assert (least > 0) == (status == "holds")
        assert certificate.closest is not None
        assert {certificate.closest.link, certificate.closest.other} & {"bus", "link 'bus'", "panel", "link 'panel'"}
        if certificate.holds:
            assert certificate.clearance is not None
            assert least / 2 - 1e-6 <= certificate.clearance <= least + COALS


def test_a_panel_on_a_floating_base_is_hit_where_the_base_turns_it() -> None:
    """The base turns against the arm, and with it the corner of a panel that no joint carries."""
    robot = bus(lander())
    made = Trajectory(robot, Motion([[-1.0, 0.5], [1.5, -0.5]]), base="floating")
    way = along(Adrift(robot, Scene()), made)
    corner = way.T_w_b[:, :3, :3] @ np.array([-2.2, 0.25, 0.0]) + way.T_w_b[:, :3, 3]
    outward = way.T_w_b[100, :3, :3] @ np.array([-1.0, 0, 0])
    for gap, status in ((1e-4, "holds"), (-1e-4, "fails")):
        reach = float((corner @ outward).max())
        setting = Adrift(robot, Scene([HalfSpace(-outward, (reach + gap) * outward)]))
        certificate = certify(setting, made)
        assert certificate.status == ("fails" if in_space(setting, way.q, way.T_w_b).min() <= 0 else status)
        if certificate.holds:
            assert certificate.clearance is not None
            assert certificate.clearance <= gap + COALS
