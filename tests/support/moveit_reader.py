"""MoveIt's files read by others: Pinocchio's kinematics and plain NumPy, after MoveIt's own source.

Written from moveit_core (`Transforms`, `PlanningScene::getFrameTransform`, `processCollisionObjectAdd/Move/Remove`,
`shapesAndPosesFromCollisionObjectMessage`, `processAttachedCollisionObjectMsg`, `resolveConstraintFrames`), not from our
reader, of which nothing is used here. Poses are (4, 4) in the planning frame [m].
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from support.drawn_moveit import Files

_KINDS = (("primitives", "primitive_poses"), ("meshes", "mesh_poses"), ("planes", "plane_poses"))
_NUMBERS = {1: "box", 2: "sphere", 3: "cylinder"}
_TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


@dataclass
class Thing:
    """An object: its pose, its shapes (kind, size or corners, pose in the object), its subframes."""

    T: np.ndarray
    shapes: list[tuple[str, np.ndarray, np.ndarray]]
    subframes: dict[str, np.ndarray] = field(default_factory=dict)
    link: str = ""


def _row(given: Any, letters: str) -> np.ndarray:
    return np.array([given[letter] for letter in letters] if isinstance(given, dict) else given, dtype=float)


def _T(position: Any, orientation: Any) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = 0 if position is None else _row(position, "xyz")
    if orientation is not None:
        x, y, z, w = q = _row(orientation, "xyzw")
        if q.any():
            T[:3, :3] = pin.Quaternion(w, x, y, z).normalized().matrix()
    return T


def _pose(given: Any) -> np.ndarray:
    return np.eye(4) if given is None else _T(given.get("position"), given.get("orientation"))


def _unset(pose: Any) -> bool:
    if pose is None:
        return True
    q = pose.get("orientation")
    return not _row(pose["position"], "xyz").any() and (q is None or not _row(q, "xyzw").any())


class OtherReader:
    """Reads a scene and a request for a robot.

    Attributes:
        objects: the world's, by id.
        held: what is attached to links at the start, by id, with its pose in the link.
        joints: every joint's value at the start.
        base: of the robot's root at the start.
    """

    def __init__(self, files: Files, dof_names: tuple[str, ...]) -> None:
        self.model = pin.buildModelFromUrdf(str(files.urdf))
        self.data = self.model.createData()
        self.folder = files.scene.parent
        self.scene, self.request = (json.loads(path.read_text()) for path in (files.scene, files.request))
        self.links = [element.get("name") for element in ET.parse(files.urdf).getroot().findall("link")]
        self.mimics = {
            joint.get("name"): joint.find("mimic").attrib  # type: ignore[union-attr]
            for joint in ET.parse(files.urdf).getroot().findall("joint")
            if joint.find("mimic") is not None
        }
        self.limits = {
            joint.get("name"): [float(joint.find("limit").get(key, "nan")) for key in ("lower", "upper")]  # type: ignore[union-attr]
            for joint in ET.parse(files.urdf).getroot().findall("joint")
            if joint.find("limit") is not None
        }
        self.planning, self.fixed_parent = self._planning_frame(files.srdf)
        before, start = self.scene.get("robot_state") or {}, self.request.get("start_state") or {}
        stated, asked = (self._values(state) for state in (before, start))
        self.joints, first = {**stated, **asked}, {**asked, **stated}
        bases = [self._base(state) for state in (start, before)]
        self.base = next((T for T in bases if T is not None), np.eye(4))
        base_in_scene = next((T for T in reversed(bases) if T is not None), np.eye(4))
        self.objects: dict[str, Thing] = {}
        self.held: dict[str, Thing] = {}
        self.fixed: dict[str, np.ndarray] = {}
        self.poses = self._poses(first, base_in_scene)
        for item in self.scene.get("fixed_frame_transforms") or []:
            assert item["child_frame_id"] == self.planning
            at = item["transform"]
            self.fixed[item["header"]["frame_id"]] = _T(at["translation"], at["rotation"])
        attached = before.get("attached_collision_objects") or []
        for item in attached:
            if any(item["object"].get(key) for key, _ in _KINDS):
                self._attach(item)
        for item in self.scene["world"]["collision_objects"]:
            self._apply(item)
        for item in attached:
            if not any(item["object"].get(key) for key, _ in _KINDS):
                self._attach(item)
        self.poses = self._poses(self.joints, self.base)
        for item in start.get("attached_collision_objects") or []:
            self._attach(item)

    def _planning_frame(self, srdf: Path | None) -> tuple[str, str]:
        """MoveIt's model frame: the parent of the root's virtual joint unless that is fixed, else the root link."""
        root = "root"
        joint = None if srdf is None else ET.parse(srdf).getroot().find("virtual_joint")
        if joint is not None and joint.get("type") != "fixed":
            return str(joint.get("parent_frame")), ""
        if srdf is None:  # only the scene says what its planning frame is
            children = {item["child_frame_id"] for item in self.scene.get("fixed_frame_transforms") or []}
            return next(iter(children), root), ""
        return root, "" if joint is None else str(joint.get("parent_frame"))

    def _values(self, state: dict[str, Any]) -> dict[str, float]:
        joints = state.get("joint_state") or {}
        return dict(zip(joints.get("name", []), joints.get("position", []), strict=True))

    def _base(self, state: dict[str, Any]) -> np.ndarray | None:
        joints = state.get("multi_dof_joint_state")
        return None if joints is None else _T(joints["transforms"][0]["translation"], joints["transforms"][0]["rotation"])

    def rest(self, name: str) -> float:
        """The value nearest to 0 that a joint may have."""
        low, high = self.limits[name]
        return 0.0 if np.isnan(low) else float(np.clip(0.0, low, high))

    def _poses(self, values: dict[str, float], base: np.ndarray) -> dict[str, np.ndarray]:
        q = pin.neutral(self.model)
        for i, name in enumerate(self.model.names):
            if not i:
                continue
            if name in self.mimics:
                of = self.mimics[name]
                leader = values.get(of["joint"], self.rest(of["joint"]))
                value = float(of["multiplier"]) * leader + float(of["offset"])
            else:
                value = values.get(name, self.rest(name))
            joint = self.model.joints[i]
            q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
        pin.framesForwardKinematics(self.model, self.data, q)
        frame = lambda link: self.model.getFrameId(link, pin.FrameType.BODY)  # noqa: E731
        return {link: base @ self.data.oMf[frame(link)].homogeneous for link in self.links}

    def link_poses(self, values: dict[str, float]) -> dict[str, np.ndarray]:
        """Where the links are with other values of joints, the base being where it is at the start."""
        return self._poses({**self.joints, **values}, self.base)

    def frame(self, message: dict[str, Any]) -> np.ndarray:
        """The frame that a message's header names."""
        name = str((message.get("header") or {}).get("frame_id") or "").lstrip("/")
        if not name:
            return np.eye(4)
        if name == self.planning and name not in self.links:
            return np.eye(4)
        if name in self.links:
            return self.poses[name]
        for one in self.held:
            thing, T = self.held[one], self.poses[self.held[one].link] @ self.held[one].T
            if name == one:
                return T
            if name.startswith(f"{one}/") and name[len(one) + 1 :] in thing.subframes:
                return T @ thing.subframes[name[len(one) + 1 :]]
        for one, thing in self.objects.items():
            if name == one:
                return thing.T
            if name.startswith(f"{one}/") and name[len(one) + 1 :] in thing.subframes:
                return thing.T @ thing.subframes[name[len(one) + 1 :]]
        if name in self.fixed:
            return self.fixed[name]
        assert name == self.fixed_parent, f"frame {name} is not known to the other reader"
        return self.poses["root"]

    def _thing(self, item: dict[str, Any]) -> Thing:
        pairs = []
        for key, places in _KINDS:
            shapes, at = item.get(key) or [], item.get(places) or []
            pairs += [(key, shape, _pose(at[i]) if i < len(at) else np.eye(4)) for i, shape in enumerate(shapes)]
        shapes = [(*self._shape(key, shape), T) for key, shape, T in pairs]
        whole = item.get("pose")
        T = _pose(whole)
        if len(shapes) == 1 and _unset(whole):  # switch_object_pose_and_shape_pose
            T, shapes = shapes[0][2], [(*shapes[0][:2], np.eye(4))]
        names = item.get("subframe_names") or []
        inner = {name: _pose(at) for name, at in zip(names, item.get("subframe_poses") or [], strict=True)}
        return Thing(self.frame(item) @ T, shapes, inner)

    def _shape(self, key: str, shape: dict[str, Any]) -> tuple[str, np.ndarray]:
        if key == "planes":
            return "plane", np.array(shape["coef"], dtype=float)
        if key == "meshes" and "resource" in shape:
            return "mesh", _TETRAHEDRON * np.array(shape["dimensions"])
        if key == "meshes":
            return "mesh", np.array([_row(corner, "xyz") for corner in shape["vertices"]])
        kind = shape["type"]
        return str(_NUMBERS.get(kind, kind)), np.array(shape["dimensions"], dtype=float)

    def _apply(self, item: dict[str, Any]) -> None:
        name, operation = item["id"], item.get("operation", 0)
        if operation == 1:
            self.objects.pop(name)
        elif operation == 3:
            self.objects[name].T = self.frame(item) @ _pose(item["pose"])
        elif operation == 2 and name in self.objects:
            more, before = self._thing(item), self.objects[name]
            into = np.linalg.inv(before.T) @ more.T
            before.shapes += [(kind, size, into @ T) for kind, size, T in more.shapes]
        else:
            self.objects[name] = self._thing(item)

    def _attach(self, item: dict[str, Any]) -> None:
        thing, link = item["object"], item["link_name"]
        made = self._thing(thing) if any(thing.get(key) for key, _ in _KINDS) else self.objects.pop(thing["id"])
        self.objects.pop(thing["id"], None)
        self.held[thing["id"]] = Thing(np.linalg.inv(self.poses[link]) @ made.T, made.shapes, made.subframes, link)
