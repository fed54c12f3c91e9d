"""A second reader of robots' files, made of ElementTree, PyYAML and Pinocchio, and what it has to complain of in the first."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import yaml

from spacearm import Motion, Problem, Trajectory, certify, forward_kinematics
from spacearm.core.errors import RobotError
from spacearm.motion.limit_margins import fastest_duration
from spacearm.robot import Robot, load_robot
from support.drawn_urdfs import DrawnFiles

VAST = 1e4
CLOSE = 1e-9
REFUSALS = (
    "velocity_limit=",
    "exclude each other",
    "mimic multiplier",
    "without limit",
    "no moving joint",
    "nothing in common",
    "no joint of",
    "its limits; change the value",  # of a joint that is held with the one it follows, or does not move at all
)


class Own(NamedTuple):
    """A joint's own limits, from every source, and what moves it."""

    kind: str
    lower: float
    upper: float
    velocity: float
    acceleration: float
    leader: str
    multiplier: float
    offset: float


def own_limits(drawn: DrawnFiles) -> dict[str, Own]:
    """Read the joints that move, and every limit that any source states for them."""
    elements = {e.get("name", ""): e for e in ET.fromstring(drawn.urdf).findall("joint") if e.get("type") != "fixed"}
    moveit: dict[str, Any] = yaml.safe_load(drawn.limits)["joint_limits"] if drawn.limits else {}
    return {name: _own(name, elements, moveit.get(name) or {}, drawn.options) for name in elements}


def _own(name: str, elements: dict[str, ET.Element], moveit: dict[str, Any], options: dict[str, Any]) -> Own:
    joint = elements[name]
    limit = joint.find("limit")
    assert limit is not None
    lower, upper, speed = (float(limit.get(key, "nan")) for key in ("lower", "upper", "velocity"))
    kind = joint.get("type", "")
    if kind == "continuous":
        lower, upper = -math.inf, math.inf
    ranges = [(lower, upper), (options.get("position_limits") or {}).get(name, (-math.inf, math.inf))]
    ranges.append((moveit.get("min_position", -math.inf), moveit.get("max_position", math.inf)))
    lower, upper = max(r[0] for r in ranges), min(r[1] for r in ranges)
    speeds, pushes = [speed if 0 < speed < VAST else math.inf], [math.inf]
    for found, kind_of in ((speeds, "velocity"), (pushes, "acceleration")):
        if moveit.get(f"has_{kind_of}_limits", True):
            found.append(moveit.get(f"max_{kind_of}", math.inf))
        given = options.get(f"{kind_of}_limit", math.inf)
        found.append(given.get(name, math.inf) if isinstance(given, dict) else given)
    at, multiplier, offset = joint, 1.0, 0.0
    while (mimic := at.find("mimic")) is not None:
        offset += multiplier * float(mimic.get("offset", "0"))
        multiplier *= float(mimic.get("multiplier", "1"))
        at = elements[mimic.get("joint", "")]
    lower, upper = (-math.inf if lower <= -VAST else lower), (math.inf if upper >= VAST else upper)
    return Own(kind, lower, upper, min(speeds), min(pushes), at.get("name", ""), multiplier, offset)


def complaints(drawn: DrawnFiles, directory: Path, rng: np.random.Generator) -> tuple[str, list[str]]:
    """Load the drawn files, and compare with what this reader makes of them; return what became of them, and complaints."""
    path, odd = directory / "plain.urdf", directory / "odd.urdf"
    path.write_text(drawn.urdf)
    odd.write_bytes(drawn.odd)
    options = dict(drawn.options)
    for name, text in (("srdf", drawn.srdf), ("joint_limits", drawn.limits)):
        if text:
            (directory / name).write_text(text)
            options[name] = directory / name
    try:
        robot = load_robot(path, **options)
    except RobotError as error:
        reason = next((words for words in REFUSALS if words in str(error)), "")
        return f"refused: {reason}", [] if reason else [f"refused: {error}"]
    again = load_robot(odd, **options)
    wrong = [] if _alike(robot, again) else ["the odd XML gives another robot"]
    for file in (path, odd):  # it knows no velocity limits below 0
        file.write_bytes(file.read_bytes().replace(b' velocity="-', b' velocity="'))
    model = pin.buildModelFromUrdf(str(path))
    if drawn.read_by_all and pin.buildModelFromUrdf(str(odd)).njoints != model.njoints:
        wrong.append("Pinocchio reads another robot in the odd XML")
    own = own_limits(drawn)
    wrong += _wrong_limits(robot, own)
    wrong += _wrong_places(robot, own, drawn, model, rng)
    wrong += _wrong_motion(robot, own, rng)
    wrong += _wrong_srdf(robot, own, drawn)
    return "loaded", wrong


def _alike(first: Robot, second: Robot) -> bool:
    names = ("dof_names", "joints", "frames", "base", "tip")
    same = all(getattr(first, name) == getattr(second, name) for name in names)
    return same and all(
        np.array_equal(getattr(first, x), getattr(second, x)) for x in ("lower", "upper", "velocity", "acceleration")
    )


def _moved(robot: Robot, own: dict[str, Own]) -> dict[str, tuple[int, Own]]:
    """The joints that q moves, each with its entry of q."""
    entries = {name: i for i, name in enumerate(robot.dof_names)}
    return {name: (entries[one.leader], one) for name, one in own.items() if one.leader in entries}


def _wrong_limits(robot: Robot, own: dict[str, Own]) -> list[str]:
    wrong = []
    moved = _moved(robot, own)
    if {name for name in own if own[name].leader == name} < set(robot.dof_names):
        wrong.append(f"q is {robot.dof_names}")
    at_limit = np.zeros((4, robot.dof), dtype=bool)
    for name, (i, one) in moved.items():
        m, slack = one.multiplier, CLOSE * (1 + abs(one.offset))
        ends = sorted((m * end + one.offset if m else one.offset) for end in (robot.lower[i], robot.upper[i]))
        for end, limit, sign in ((ends[0], one.lower, -1), (ends[1], one.upper, 1)):
            if end == limit:  # infinite ones too
                at_limit[0 if (sign < 0) == (m > 0) else 1, i] |= bool(m)
                continue
            size = slack + CLOSE * (abs(limit) if math.isfinite(limit) else 0)
            if sign * (end - limit) > size:
                wrong.append(f"{name} goes to {end}, beyond {limit}")
            if m and abs(end - limit) <= size:
                at_limit[0 if (sign < 0) == (m > 0) else 1, i] = True
        for row, rate, limit in ((2, robot.velocity[i], one.velocity), (3, robot.acceleration[i], one.acceleration)):
            if abs(m) * rate > limit * (1 + CLOSE):
                wrong.append(f"{name} may do {abs(m) * rate} of order {row - 1}, above {limit}")
            at_limit[row, i] |= bool(m) and abs(m) * rate >= limit * (1 - CLOSE)
    infinite = np.isinf([robot.lower, robot.upper])
    assumed = robot.acceleration == robot.velocity
    at_limit |= np.vstack([infinite, np.zeros(robot.dof, dtype=bool), assumed])
    for row, i in np.argwhere(~at_limit):
        wrong.append(f"limit {row} of {robot.dof_names[i]} is narrower than any joint needs")
    return wrong


def _values(robot: Robot, q: np.ndarray, own: dict[str, Own]) -> dict[str, float]:
    return {name: one.multiplier * q[i] + one.offset for name, (i, one) in _moved(robot, own).items()}


def _wrong_places(robot: Robot, own: dict[str, Own], drawn: DrawnFiles, model: Any, rng: np.random.Generator) -> list[str]:
    if "group" in drawn.options:  # others are held, which is another test's
        return []
    data, worst = model.createData(), 0.0
    span = np.where(np.isfinite(robot.upper - robot.lower), robot.upper - robot.lower, 6.0)
    base = np.where(np.isfinite(robot.lower), robot.lower, np.where(np.isfinite(robot.upper), robot.upper - span, -3.0))
    for _ in range(3):
        q = base + rng.uniform(0, 1, robot.dof) * span
        full = pin.neutral(model)
        for name, value in _values(robot, q, own).items():
            joint = model.joints[model.getJointId(name)]
            full[joint.idx_q : joint.idx_q + joint.nq] = (value,) if joint.nq == 1 else (math.cos(value), math.sin(value))
        pin.framesForwardKinematics(model, data, full)
        for frame in robot.frames:
            T = data.oMf[model.getFrameId(frame.name, pin.FrameType.BODY)].homogeneous
            off = np.abs(T - forward_kinematics(robot, q, frame=frame.name))
            worst = max(worst, float(off[:3, :3].max()), float(off[:3, 3].max() / (1 + np.abs(T[:3, 3]).max())))
    return [f"frames are {worst:.2g} off Pinocchio's"] if worst > 1e-6 else []


def _wrong_motion(robot: Robot, own: dict[str, Own], rng: np.random.Generator) -> list[str]:
    """Move as fast as the limits allow, and look at every joint's own."""
    low = np.where(np.isfinite(robot.lower), robot.lower, np.minimum(-3, robot.upper - 1))
    high = np.where(np.isfinite(robot.upper), robot.upper, np.maximum(3, low + 1))
    points = rng.uniform(low, high, (int(rng.integers(2, 6)), robot.dof))
    motion, jerk = Motion(points), float(10 ** rng.uniform(-3, 3)) if rng.random() < 0.3 else None
    duration = fastest_duration(robot, motion, jerk_limit=jerk)
    if not 0 < duration < 1e9:
        return []
    trajectory, wrong = Trajectory(robot, motion, duration=duration), []
    found = certify(Problem(robot, [], start=points[0], goal=points[-1]), trajectory, jerk_limit=jerk)
    if found.status == "fails":
        wrong.append(f"the fastest motion fails: {found.message}")
    state = trajectory.sample(np.linspace(0, trajectory.duration, 401))
    for name, (i, one) in _moved(robot, own).items():
        q = one.multiplier * state.q[:, i] + one.offset
        slack = 1e-6 * (1 + np.abs(q).max())
        if q.min() < one.lower - slack or q.max() > one.upper + slack:
            wrong.append(f"moving, {name} leaves its range")
        dddq = np.diff(state.ddq, axis=0) / (trajectory.duration / 400)  # a mean of it, which is less than its peak
        for rate, limit in ((state.dq, one.velocity), (state.ddq, one.acceleration), (dddq, jerk or math.inf)):
            if np.abs(one.multiplier * rate[:, i]).max() > limit * (1 + 1e-6):
                wrong.append(f"moving, {name} reaches {np.abs(one.multiplier * rate[:, i]).max()}, above {limit}")
    return wrong


def _wrong_srdf(robot: Robot, own: dict[str, Own], drawn: DrawnFiles) -> list[str]:
    wrong = [] if robot.base == "fixed" else ["the base floats, unasked"]
    if not drawn.srdf:
        return wrong
    stated = {e.get("name", ""): float(e.get("value", "nan")) for e in ET.fromstring(drawn.srdf).findall("group_state/joint")}
    named = [i for i, name in enumerate(robot.dof_names) if name in stated]
    if named:
        q = robot.configuration("ready")
        wrong += [f"'ready' has {q[i]} for {robot.dof_names[i]}" for i in named if q[i] != stated[robot.dof_names[i]]]
        led = {own[name].leader for name in stated}
        for i, name in enumerate(robot.dof_names):
            if name not in led and not robot.lower[i] <= q[i] <= robot.upper[i]:
                wrong.append(f"'ready' leaves {name} outside its range")
    return wrong
