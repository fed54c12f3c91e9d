"""MoveIt's files at random, with frames everywhere: a robot (URDF and SRDF), a planning scene and a request, all of them legal.

Both layouts of objects are drawn (with a pose of their own, and without), every way to write a vector, every kind of frame in
every header, joints outside the group, a moved base, things in the hand, and all the fields that ought to be told of.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Rng = np.random.Generator


@dataclass
class Files:
    """What was drawn: paths, the group, and what the robot's root is held by."""

    urdf: Path
    srdf: Path | None
    scene: Path
    request: Path
    group: str | None


STL = [((0, 0, 0), (1, 0, 0), (0, 1, 0)), ((0, 0, 0), (0, 1, 0), (0, 0, 1))]
STL += [((0, 0, 0), (0, 0, 1), (1, 0, 0)), ((1, 0, 0), (0, 0, 1), (0, 1, 0))]


def _floats(values: Any) -> list[float]:
    return [round(float(value), 6) for value in values]


def _text(values: Any) -> str:
    return " ".join(f"{value:g}" for value in values)


class Drawing:
    """Draws a robot and its files; one for each number."""

    def __init__(self, rng: Rng, folder: Path) -> None:
        self.rng, self.folder = rng, folder
        self.virtual = str(rng.choice(["none", "fixed", "floating", "planar", "no srdf"], p=[0.25, 0.2, 0.25, 0.1, 0.2]))
        self.world = str(rng.choice(["world", "odom", "map"]))
        self.links, self.moving, self.joints = ["root"], set[str](), dict[str, tuple[str, float, float]]()
        self.followers: dict[str, tuple[str, float, float]] = {}
        self.group: list[str] = []
        self.objects: list[str] = []
        self.fixed: list[str] = []
        self.base_moved = False

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    # The robot.

    def robot(self) -> tuple[Path, Path | None, str | None]:
        rng, rows, elements = self.rng, [], []
        kinds = [("lift", "prismatic", False), ("turn", "revolute", False)] if self.virtual != "no srdf" else []
        kinds = kinds[: int(rng.integers(0, 3))]
        kinds += [("stand", "fixed", False)] if self.chance(0.5) else []
        kinds += [(f"j{i}", str(rng.choice(["revolute", "continuous", "prismatic"])), True) for i in range(rng.integers(1, 4))]
        kinds += [("flange", "fixed", False), ("wrist", "revolute", True)]
        parent, moved = "root", False
        for name, kind, planned in kinds:
            child = f"{name}_link"
            rows.append(self._joint(name, kind, parent, child))
            self.links.append(child)
            moved = moved or planned
            if moved:
                self.moving.add(child)
            if planned:
                self.group.append(name)
            parent = child
        self.hand = parent
        if self.virtual != "no srdf" and self.chance(0.6):  # a gripper that the group leaves out, one finger follows the other
            rows.append(self._joint("finger", "prismatic", parent, "finger_link"))
            rows.append(self._joint("thumb", "prismatic", parent, "thumb_link", mimic=("finger", -1.0, 0.001)))
            self.links += ["finger_link", "thumb_link"]
            self.moving |= {"finger_link", "thumb_link"}
        for link in self.links:
            shape = f'<collision><geometry><sphere radius="0.0{rng.integers(1, 5)}"/></geometry></collision>'
            elements.append(f'<link name="{link}">{shape if self.chance(0.7) or link == self.hand else ""}</link>')
        urdf = self.folder / "robot.urdf"
        urdf.write_text(f'<robot name="drawn">{"".join(elements)}{"".join(rows)}</robot>')
        if self.virtual == "no srdf":
            return urdf, None, None
        joints = "".join(f'<joint name="{name}"/>' for name in self.group)
        held = ""
        if self.virtual != "none":
            held = f'<virtual_joint name="vj" type="{self.virtual}" parent_frame="{self.world}" child_link="root"/>'
        srdf = self.folder / "robot.srdf"
        srdf.write_text(f'<robot name="drawn"><group name="arm">{joints}</group>{held}</robot>')
        return urdf, srdf, "arm"

    def _joint(self, name: str, kind: str, parent: str, child: str, mimic: tuple[str, float, float] | None = None) -> str:
        rng = self.rng
        axis = rng.normal(size=3) if self.chance(0.5) else np.eye(3)[rng.integers(3)]
        origin = f'<origin xyz="{_text(rng.uniform(-0.4, 0.4, 3))}" rpy="{_text(rng.uniform(-3, 3, 3))}"/>'
        low, high = -float(rng.uniform(0.2, 2.5)), float(rng.uniform(0.2, 2.5))
        low, high = (low / 5, high / 5) if kind == "prismatic" else (low, high)
        if mimic is not None:
            low, high = -9.0, 9.0
            self.followers[name] = mimic
        elif kind != "fixed":
            self.joints[name] = (kind, low, high)
        limits = "" if kind == "continuous" else f' lower="{low!r}" upper="{high!r}"'
        body = "" if kind == "fixed" else f'<axis xyz="{_text(axis)}"/><limit{limits} velocity="1" effort="1"/>'
        if mimic is not None:
            body += f'<mimic joint="{mimic[0]}" multiplier="{mimic[1]}" offset="{mimic[2]}"/>'
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        return f'<joint name="{name}" type="{kind}">{ends}{origin}{body}</joint>'

    # Parts of messages.

    def vector(self, values: Any, letters: str) -> Any:
        row = _floats(values)
        return dict(zip(letters, row, strict=True)) if self.chance(0.4) else row

    def place(self, size: float = 1.0) -> dict[str, Any]:
        q = self.rng.normal(size=4)
        q = q / np.linalg.norm(q) * (1.0 if self.chance(0.8) else 1.0 + 1e-4)
        if self.chance(0.15):
            q = np.array([0.0, 0.0, 0.0, 0.0 if self.chance(0.3) else 1.0])
        at = self.rng.uniform(-size, size, 3)
        pose = {"position": self.vector(at, "xyz"), "orientation": self.vector(q, "xyzw")}
        if self.chance(0.1):
            del pose["orientation"]
        return pose

    def header(self, frames: list[str], none: float = 0.2) -> dict[str, Any]:
        if self.chance(none):
            return {} if self.chance(0.5) else {"header": {"frame_id": "", "seq": 0}}
        name = str(self.rng.choice(frames))
        return {"header": {"frame_id": f"/{name}" if self.chance(0.15) else name, "stamp": {"secs": 0, "nsecs": 0}}}

    @property
    def planning(self) -> str:
        return self.world if self.virtual in ("floating", "planar", "no srdf") else "root"

    def still_frames(self) -> list[str]:
        names = [link for link in self.links if link not in self.moving]
        names += [self.planning] * 2 + self.fixed + self.objects
        return names + ([self.world] if self.virtual == "fixed" else [])

    def shape(self) -> tuple[str, dict[str, Any]]:
        kind = str(
            self.rng.choice(["box", "sphere", "cylinder", "mesh", "mesh file", "plane"], p=[0.35, 0.2, 0.2, 0.1, 0.1, 0.05])
        )
        if kind == "mesh":
            corners = [[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]]
            faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
            if self.chance(0.5):
                return "meshes", {"vertices": corners, "triangles": faces}
            rows = [dict(zip("xyz", row, strict=True)) for row in corners]
            return "meshes", {"vertices": rows, "triangles": [{"vertex_indices": row} for row in faces]}
        if kind == "mesh file":
            name = str(self.rng.choice(["part.stl", "package://parts/part.stl", f"file://{self.folder}/part.stl"]))
            return "meshes", {"resource": name, "dimensions": _floats(self.rng.uniform(0.05, 0.3, 3))}
        if kind == "plane":
            return "planes", {"coef": _floats([*self.rng.normal(size=3), self.rng.uniform(-1, 1)])}
        count = {"box": 3, "sphere": 1, "cylinder": 2}[kind]
        number = {"box": 1, "sphere": 2, "cylinder": 3}[kind]
        size = _floats(self.rng.choice([0.03, 0.05, 0.11, 0.2], count))
        return "primitives", {"type": number if self.chance(0.3) else kind, "dimensions": size}

    def thing(self, name: str, frames: list[str], *, planes: bool = True) -> dict[str, Any]:
        out: dict[str, Any] = {"id": name, **self.header(frames)}
        for _ in range(self.rng.choice([1, 1, 1, 2, 3])):
            key, shape = self.shape()
            while key == "planes" and not planes:
                key, shape = self.shape()
            out.setdefault(key, []).append(shape)
            out.setdefault({"primitives": "primitive_poses", "meshes": "mesh_poses", "planes": "plane_poses"}[key], []).append(
                self.place(0.5)
            )
        if self.chance(0.5):  # the newer layout
            out["pose"] = self.place()
            if self.chance(0.15):
                for key in ("primitive_poses", "mesh_poses", "plane_poses"):
                    out.pop(key, None)
        elif self.chance(0.3):
            out["pose"] = {"position": [0, 0, 0], "orientation": {"x": 0, "y": 0, "z": 0, "w": 0}}
        if self.chance(0.4):
            out["subframe_names"], out["subframe_poses"] = ["tip", "grip"], [self.place(0.2), self.place(0.2)]
        if self.chance(0.3):
            out["operation"] = 0
        return out

    # Messages.

    def state(self, share: float, *, base: np.ndarray | None) -> dict[str, Any]:
        values = {}
        for name, (kind, low, high) in self.joints.items():
            if self.chance(share):
                values[name] = float(self.rng.uniform(-4, 4) if kind == "continuous" else self.rng.uniform(low, high))
        for name, (leader, multiplier, offset) in self.followers.items():
            if leader in values and self.chance(0.7):
                values[name] = multiplier * values[leader] + offset
        if self.chance(0.3):
            values["l_wheel_joint"] = 0.3
        names = list(self.rng.permutation(list(values))) if values else []
        out: dict[str, Any] = {"joint_state": {"name": names, "position": [values[name] for name in names]}}
        if base is not None:
            names = ["vj"] if self.virtual in ("floating", "planar") or self.chance(0.5) else ["virtual_joint"]
            names = ["vj"] if self.virtual in ("floating", "planar") else names
            at = {"translation": self.vector(base[:3], "xyz"), "rotation": self.vector(base[3:], "xyzw")}
            out["multi_dof_joint_state"] = {"joint_names": names, "transforms": [at], "twist": [], "wrench": []}
            if self.chance(0.5):
                out["multi_dof_joint_state"]["header"] = {"frame_id": self.planning}
        return out

    def base(self) -> np.ndarray:
        q = self.rng.normal(size=4)
        return np.round(np.array([*self.rng.uniform(-1, 1, 3), *(q / np.linalg.norm(q))]), 6)

    def attachment(self, name: str, frames: list[str]) -> dict[str, Any]:
        links = [link for link in self.links if link in self.moving]
        link = str(self.rng.choice(links))
        thing = self.thing(name, [link] * 3 + frames, planes=False)
        out = {"link_name": link, "object": thing, "touch_links": list(self.rng.choice(self.links, 2)), "weight": 0.5}
        if self.chance(0.3):
            out.pop("touch_links")
        return out

    def scene(self) -> dict[str, Any]:
        self.fixed = ["table", "shelf"][: self.rng.integers(0, 3)]
        fixed = []
        if self.fixed or self.virtual == "no srdf" or self.chance(0.7):
            fixed.append({"header": {"frame_id": self.planning}, "child_frame_id": self.planning, "transform": {}})
            fixed[0]["transform"] = {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}
        for name in self.fixed:
            at = self.place()
            T = {"translation": at["position"], "rotation": at.get("orientation", [0, 0, 0, 1])}
            fixed.append({"header": {"frame_id": name}, "child_frame_id": self.planning, "transform": T})
        out: dict[str, Any] = {"name": "", "robot_model_name": "drawn", "fixed_frame_transforms": fixed}
        can_move = self.virtual in ("floating", "planar", "no srdf")
        base = self.base() if can_move and self.chance(0.5) else None
        out["robot_state"] = self.state(float(self.rng.choice([0, 0.5, 1.0])), base=base)
        self.attached = []
        if self.chance(0.3):
            self.attached.append("cup")
            out["robot_state"]["attached_collision_objects"] = [self.attachment("cup", self.still_frames())]
        items = []
        for i in range(int(self.rng.integers(0, 5))):
            name = f"thing{i}"
            frames = self.still_frames() + self.links + [f"{other}/tip" for other in self.tips(items)] + self.attached
            items.append(self.thing(name, frames))
            self.objects.append(name)
        self._change(items)
        if self.chance(0.25) and self.objects:  # one of the world's things is taken up, without saying its shape again
            solid = [i for i in items if i.get("operation", 0) == 0 and "planes" not in i and self._stays(i["id"], items)]
            if solid:
                taken = str(solid[0]["id"])
                link = str(self.rng.choice(sorted(self.moving)))
                entry = {"link_name": link, "object": {"id": taken}, "touch_links": []}
                out["robot_state"].setdefault("attached_collision_objects", []).append(entry)
                self.objects.remove(taken)
        out["world"] = {"collision_objects": items}
        if self.chance(0.3):
            out["link_padding"] = [{"link_name": self.hand, "padding": 0}]
            out["link_scale"] = [{"link_name": self.hand, "scale": 1}]
        self.drawn_base = base
        return out

    def _stays(self, name: str, items: list[dict[str, Any]]) -> bool:
        others = [item for item in items if item["id"] == name and item.get("operation", 0) != 0]
        named = [item for item in items if name in str((item.get("header") or {}).get("frame_id", ""))]
        return not others and not named

    def tips(self, items: list[dict[str, Any]]) -> list[str]:
        return [item["id"] for item in items if "subframe_names" in item]

    def _change(self, items: list[dict[str, Any]]) -> None:
        """Append to an object, move one, and take one away."""
        if not self.objects:
            return
        name = str(self.rng.choice(self.objects))
        first = next(item for item in items if item["id"] == name)
        what = self.rng.choice(["append", "move", "remove", "nothing"], p=[0.15, 0.15, 0.1, 0.6])
        frames = [self.planning, "root"]
        if what == "append" and "planes" not in first:
            items.append({**self.thing(name, frames, planes=False), "operation": 2})
            items[-1].pop("subframe_names", None), items[-1].pop("subframe_poses", None)
        elif what == "move" and "planes" not in first:
            items.append({"id": name, **self.header(frames), "pose": self.place(), "operation": 3})
        elif what == "remove":
            items.append({"id": name, "operation": 1})
            self.objects.remove(name)

    def request(self) -> dict[str, Any]:
        can_move = self.virtual in ("floating", "planar", "no srdf")
        base = self.base() if can_move and self.chance(0.3) else None
        start = self.state(1.0, base=base)
        start["is_diff"] = bool(self.chance(0.5))
        if self.chance(0.4):
            start["attached_collision_objects"] = [self.attachment("tool", self.still_frames())]
        goals = [self._space_goal()] if self.chance(0.5) else [self._joint_goal() for _ in range(self.rng.choice([1, 1, 2]))]
        factors = {
            f"max_{kind}_scaling_factor": float(self.rng.choice([0, 0.1, 1, 2])) for kind in ("velocity", "acceleration")
        }
        return {"start_state": start, "goal_constraints": goals, "group_name": "arm", "planner_id": "RRT", **factors}

    def _joint_goal(self) -> dict[str, Any]:
        rows = []
        for name, (kind, low, high) in self.joints.items():
            if name in self.group:
                at = float(self.rng.uniform(-3, 3) if kind == "continuous" else self.rng.uniform(low, high))
                rows.append({"joint_name": name, "position": at, "tolerance_above": 0.01, "tolerance_below": 0.02, "weight": 1})
        return {"joint_constraints": rows}

    def _space_goal(self) -> dict[str, Any]:
        link = str(self.rng.choice(sorted(self.moving & {f"{name}_link" for name in (*self.group, "flange")})))
        kind = str(self.rng.choice(["sphere", "box", "cylinder"]))
        size = _floats(self.rng.uniform(0.01, 0.1, {"sphere": 1, "box": 3, "cylinder": 2}[kind]))
        region = {"primitives": [{"type": kind, "dimensions": size}], "primitive_poses": [self.place()]}
        position = {**self.header(self.still_frames()), "link_name": link, "constraint_region": region, "weight": 1}
        if self.chance(0.5):
            position["target_point_offset"] = self.vector(self.rng.uniform(-0.1, 0.1, 3), "xyz")
        goal = {"position_constraints": [position]}
        if self.chance(0.6):
            q = self.rng.normal(size=4)
            angles = self.rng.uniform(0.01, 0.3, 3)
            if self.chance(0.4):
                angles[self.rng.integers(3)] = 2 * math.pi
            named = {f"absolute_{axis}_axis_tolerance": float(angle) for axis, angle in zip("xyz", angles, strict=True)}
            turned = {"link_name": link, "orientation": self.vector(q / np.linalg.norm(q), "xyzw"), **named}
            turned |= self.header(self.still_frames())
            if self.chance(0.5):
                turned["parameterization"] = int(self.rng.integers(2))
            goal["orientation_constraints"] = [turned]
        return goal


def drawn_files(rng: Rng, folder: Path) -> Files:
    """Draw a robot, a scene and a request, and write them into a folder."""
    drawing = Drawing(rng, folder)
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {a} {b} {c}\n" for a, b, c in face) + "endloop\nendfacet\n"
        for face in STL
    )
    (folder / "part.stl").write_text(f"solid s\n{facets}endsolid s\n")
    urdf, srdf, group = drawing.robot()
    scene, request = drawing.scene(), drawing.request()
    paths = folder / "scene.yaml", folder / "request.yaml"
    for path, content in zip(paths, (scene, request), strict=True):
        path.write_text(json.dumps(content, indent=1))
    return Files(urdf=urdf, srdf=srdf, scene=paths[0], request=paths[1], group=group)
