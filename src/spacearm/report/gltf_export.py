"""A report's animated scene as glTF (GLB), for other tools: Blender, game engines, viewers on the web.

Each joint, each link and each obstacle is a node of its name; the hierarchy is the robot's. Joints turn or slide, and a base
that moves does, by keys so dense that a straight line between them is off by no more than `TOLERANCE`. glTF's y axis points up:
the whole scene, whose z axis does, is below a node that turns it, "z up".
"""

from __future__ import annotations

import os
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.output import require_writable, write_out
from spacearm.core.version import version
from spacearm.report.gltf_shapes import Solid, capsule, mesh_solid, unit_ball, unit_box, unit_cylinder
from spacearm.report.gltf_writer import GltfWriter
from spacearm.report.page_motion import PageMotion, matrix
from spacearm.report.report_page import unpacked

Array = NDArray[np.float64]
Data = dict[str, Any]

TOLERANCE = 1e-4
"""[rad or m] By this a joint that is drawn between two keys is off, at most."""

MOST_KEYS = 5000
"""A motion that would need more keys is drawn with these."""

_PROBES = 2000  # instants at which accelerations are looked at
_MOST_BALLS = 256  # of a set of spheres, each a node; more become one mesh
_MOST_FACES = 400_000  # of that mesh
_SEVERAL = 24  # colours of a mesh, each with a material; more become colours of points
_PATH_POINTS = 400
_PLANE = 4.0  # times the scene's size: the square that a half-space is drawn by
_LINKS = ("#e9ecef", "#b3bcc6")
_BASE, _PANEL, _TOOL, _PAYLOAD, _OBSTACLE, _MARK = "#cfc8ba", "#46689a", "#5b6875", "#e0a526", "#8c99a8", "#d9dee4"
# The colours above and the rules below are those of the page in the light: web/src/palette.ts and figures.ts.
_BY_NAME = (
    (re.compile("panel|solar|array|wing|sail", re.IGNORECASE), _PANEL),
    (re.compile("tool|gripper|hand|finger|effector|grapple|camera|jaw", re.IGNORECASE), _TOOL),
    (re.compile("payload|grasped|cargo|held", re.IGNORECASE), _PAYLOAD),
)
_TONES = ("#0072b2", "#d55e00", "#009e73", "#b4578f", "#c48a00", "#3a9bd8", "#4d5761", "#8a6d3b")
_GHOST = 0.3  # opacity


def save_glb(plans: Any, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write the animated scene of a motion, or of several beside each other, as binary glTF (.glb).

    Args:
        plans: a Plan, a SavedPlan or a Certificate, or several of them; those after the first are seen through.
        path: of the file, a new one.
        overwrite: replace a file that is there.

    Raises:
        OutputError: the file exists already, or cannot be written.
        ProblemError: something that is none of these.
    """
    from spacearm.report.report_plan import report_of_plans

    require_writable(path, overwrite=overwrite)
    write_out(path, glb_of_page(report_of_plans(plans)), overwrite=overwrite)


def glb_of_page(page: Data, view: int = 0) -> bytes:
    """Return a view of a report's page as GLB.

    Args:
        page: as `web/src/data.ts` describes it.
        view: which of its views.
    """
    shown = page["views"][view]
    out = GltfWriter(f"spacearm {version()}")
    root = out.node("z up", T=np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]))
    scene = _Scene(out, page, root)
    for actor in shown["actors"]:
        scene.add_actor(actor)
    size = scene.size(shown)
    for obstacle in shown["obstacles"]:
        scene.add_obstacle(obstacle, size)
    for target in shown["targets"]:
        out.node(target["name"], T=matrix(target["T"]), parent=root, extras={"kind": target["kind"]})
    extras = {"title": page["title"], "view": shown["name"], "units": "metres, seconds"}
    return out.written([root], name=shown["name"], extras=extras)


class _Scene:
    """What is written of a page, shapes once each."""

    def __init__(self, out: GltfWriter, page: Data, root: int) -> None:
        self.out, self.page, self.root = out, page, root
        self._surfaces: dict[Any, list[tuple[Data, str | None, bool]]] = {}
        self._meshes: dict[Any, int] = {}
        self._reach = [1.0]

    # ---- Robots ----

    def add_actor(self, actor: Data) -> None:
        """Add a robot, and its motion."""
        motion = PageMotion(actor, self.page["robots"])
        robot, opacity = motion.robot, _GHOST if actor["ghost"] else 1.0
        tone = _TONES[actor["tone"] % len(_TONES)] if actor["ghost"] else None
        start = motion.times[:1]
        frames = motion.joint_frames(start)[0]
        base = self.out.node(actor["name"], T=motion.base(start)[0], parent=self.root, extras={"robot": robot["name"]})
        nodes = [base]
        for joint, T in zip(robot["joints"], frames, strict=True):
            nodes.append(self.out.node(joint["name"], T=T, parent=nodes[joint["parent"] + 1], extras={"kind": joint["kind"]}))
        self._add_links(robot, nodes, tone, opacity)
        tip = robot["tip"]
        self.out.node(tip["name"], T=matrix(tip["T"]), parent=nodes[tip["joint"] + 1], extras={"kind": "end effector"})
        if motion.moves:
            self._animate(motion, nodes)
            self._add_path(motion, actor)

    def _add_links(self, robot: Data, nodes: list[int], tone: str | None, opacity: float) -> None:
        parts = robot["visuals"] or robot["shapes"]
        links: dict[tuple[int, str], list[Data]] = {}
        for part in parts:
            links.setdefault((part["joint"], part["name"]), []).append(part)
        names = list(dict.fromkeys(name for joint, name in links if joint >= 0))
        for (joint, name), own in links.items():
            plain = _plain_color(own[0], names)
            if len(own) == 1:
                color = tone or own[0].get("color") or plain
                self.add_shape(name, own[0]["geometry"], color, parent=nodes[joint + 1], opacity=opacity, paint=tone is None)
                continue
            link = self.out.node(name, parent=nodes[joint + 1])
            for i, part in enumerate(own):
                color = tone or part.get("color") or plain
                self.add_shape(f"{name} {i + 1}", part["geometry"], color, parent=link, opacity=opacity, paint=tone is None)

    def _animate(self, motion: PageMotion, nodes: list[int]) -> None:
        t = keys_of(motion)
        times = self.out.accessor(t - t[0], bounds=True)
        if motion.base_moves:
            self.out.animate(nodes[0], "translation", times, motion.base(t)[:, :3, 3])
            self.out.animate(nodes[0], "rotation", times, motion.base_quaternions(t))
        frames = motion.joint_frames(t)
        for i, joint in enumerate(motion.robot["joints"]):
            if joint["kind"] == "prismatic":
                self.out.animate(nodes[i + 1], "translation", times, frames[:, i, :3, 3])
            else:
                self.out.animate(nodes[i + 1], "rotation", times, motion.joint_quaternions(i, t))

    def _add_path(self, motion: PageMotion, actor: Data) -> None:
        t = np.linspace(motion.times[0], motion.times[-1], _PATH_POINTS)
        points = motion.tips(t)[:, :3, 3]
        self._reach.append(float(np.abs(points).max()))
        color = _TONES[actor["tone"] % len(_TONES)]
        surface = [(self.out.line(points), self.out.material(_rgb(color)))]
        name = f"path of {motion.robot['tip']['name']}"
        self.out.node(name, mesh=self.out.mesh(name, surface), parent=self.root)

    # ---- Obstacles ----

    def size(self, view: Data) -> float:
        """Return how far from the origin the scene's things are [m], of obstacles about."""
        for obstacle in view["obstacles"]:
            for part in obstacle["parts"]:
                self._reach += [abs(value) for value in (*part.get("center", ()), *part.get("T", [0.0] * 12)[3::4])]
        return max(self._reach)

    def add_obstacle(self, obstacle: Data, size: float) -> None:
        """Add an obstacle: a node of its name, with its parts below it if there are several."""
        parts, name = obstacle["parts"], obstacle["name"]
        if len(parts) == 1 and parts[0]["kind"] not in ("spheres", "halfspace"):
            self.add_shape(name, parts[0], _OBSTACLE, parent=self.root)
            return
        node = self.out.node(name, parent=self.root)
        for i, part in enumerate(parts):
            if part["kind"] == "spheres":
                self._add_spheres(name, part, node)
            elif part["kind"] == "halfspace":
                self._add_halfspace(name, part, node, size)
            else:
                self.add_shape(f"{name} {i + 1}", part, _OBSTACLE, parent=node)

    def _add_spheres(self, name: str, part: Data, parent: int) -> None:
        """Add spheres: few of them as nodes that share a mesh, many as one mesh, coarser the more there are."""
        centers = unpacked(part["centers"]).reshape(-1, 3).astype(np.float64)
        radii = unpacked(part["radii"]).astype(np.float64)
        if len(radii) <= _MOST_BALLS:
            for i, (center, radius) in enumerate(zip(centers, radii, strict=True)):
                ball = {"kind": "sphere", "center": center.tolist(), "radius": float(radius)}
                self.add_shape(f"{name} {i + 1}", ball, _OBSTACLE, parent=parent)
            return
        halved = next((n for n in (2, 1) if len(radii) * 20 * 4**n <= _MOST_FACES), 0)
        ball = unit_ball(halved)
        points = (centers[:, None] + radii[:, None, None] * ball.points).reshape(-1, 3)
        faces = (ball.faces + len(ball.points) * np.arange(len(radii))[:, None, None]).reshape(-1, 3)
        surface = self.out.surface(points, np.tile(ball.normals, (len(radii), 1)), faces)
        mesh = self.out.mesh(f"{len(radii):,} spheres", [(surface, self.out.material(_rgb(_OBSTACLE)))])
        self.out.node(f"{name} spheres", mesh=mesh, parent=parent)

    def _add_halfspace(self, name: str, part: Data, parent: int, size: float) -> None:
        """Add the boundary of a half-space, as a square about the point nearest to the origin."""
        normal = np.array(part["normal"], dtype=np.float64)
        u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        u = _PLANE / 2 * size * u / np.linalg.norm(u)
        v = np.cross(normal, u)
        corners = part["offset"] * normal + np.array([-u - v, u - v, u + v, v - u])
        surface = self.out.surface(corners, np.tile(normal, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))
        mesh = self.out.mesh(f"boundary of {name}", [(surface, self.out.material(_rgb(_MARK), two_sided=True))])
        self.out.node(f"boundary of {name}", mesh=mesh, parent=parent)

    # ---- Shapes ----

    def add_shape(self, name: str, geometry: Data, color: str, *, parent: int, opacity: float = 1.0, paint: bool = True) -> int:
        """Add a node with a shape: of one kind and size there is one mesh, which nodes share."""
        kind, T, scale = geometry["kind"], np.eye(4), np.ones(3)
        key: tuple[Any, ...] = (kind,)
        if kind == "box":
            T, scale = matrix(geometry["T"]), np.array(geometry["size"])
        elif kind == "cylinder":
            T, scale = matrix(geometry["T"]), np.array([geometry["radius"], geometry["radius"], geometry["length"]])
        elif kind == "sphere":
            T[:3, 3], scale = geometry["center"], np.full(3, geometry["radius"])
        elif kind == "capsule":
            T, length = _along(np.array(geometry["a"]), np.array(geometry["b"]))
            key = (kind, geometry["radius"], length)
        else:
            T, scale, key = matrix(geometry["T"]), np.array(geometry.get("scale", [1.0] * 3)), (kind, geometry["mesh"])
        mesh = self._mesh(key, color, opacity, paint)
        return self.out.node(name, T=T, scale=scale, mesh=mesh, parent=parent)

    def _mesh(self, key: tuple[Any, ...], color: str, opacity: float, paint: bool) -> int:
        if key not in self._surfaces:
            self._surfaces[key] = self._stored(key)
        look = (key, color, opacity, paint)
        if look not in self._meshes:
            surfaces = [
                (
                    surface,
                    self.out.material(
                        (1.0, 1.0, 1.0) if painted and paint else _rgb(own if own and paint else color),
                        opacity=opacity,
                        two_sided=key[0] == "mesh",
                        painted=painted,
                    ),
                )
                for surface, own, painted in self._surfaces[key]
            ]
            self._meshes[look] = self.out.mesh(" ".join(map(str, key)), surfaces)
        return self._meshes[look]

    def _stored(self, key: tuple[Any, ...]) -> list[tuple[Data, str | None, bool]]:
        """Store the triangles of a shape: surfaces, each with its own colour or None, and whether its points have colours."""
        kind = key[0]
        if kind != "mesh":
            made = {"box": unit_box, "cylinder": unit_cylinder, "sphere": unit_ball}
            solid = capsule(key[1], key[2]) if kind == "capsule" else made[kind]()
            return [(self.out.surface(solid.points, solid.normals, solid.faces), None, False)]
        solid = mesh_solid(self.page["meshes"][key[1]])
        if solid.colors is None:
            return [(self.out.surface(solid.points, solid.normals, solid.faces), None, False)]
        colors, index = np.unique(np.round(255 * solid.colors).astype(int), axis=0, return_inverse=True)
        if len(colors) > _SEVERAL:
            points, normals, faces, light = _painted(solid)
            return [(self.out.surface(points, normals, faces, light), None, True)]
        parts = [_part(solid, index.reshape(-1) == i) for i in range(len(colors))]
        names = ["#" + "".join(f"{value:02x}" for value in color) for color in colors.tolist()]
        return [(self.out.surface(*part), name, False) for part, name in zip(parts, names, strict=True)]


def _part(solid: Solid, which: NDArray[np.bool_]) -> tuple[Array, Array, NDArray[np.intp]]:
    used, faces = np.unique(solid.faces[which], return_inverse=True)
    return solid.points[used], solid.normals[used], faces.reshape(-1, 3)


def _painted(solid: Solid) -> tuple[Array, Array, NDArray[np.intp], Array]:
    """Return triangles that share no points, whose points have the triangles' colours as shares of light."""
    from spacearm.geometry.mesh_colors import light_of_screen

    corners = solid.faces.ravel()
    assert solid.colors is not None
    light = np.repeat(light_of_screen(solid.colors), 3, axis=0)
    return solid.points[corners], solid.normals[corners], np.arange(len(corners)).reshape(-1, 3), light


def _along(a: Array, b: Array) -> tuple[Array, float]:
    """Return a frame (4, 4) in the middle between two points, whose z goes from the one to the other, and their distance."""
    T, length = np.eye(4), float(np.linalg.norm(b - a))
    T[:3, 3] = (a + b) / 2
    if length > 0:
        z = (b - a) / length
        x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
        x /= np.linalg.norm(x)
        T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return T, length


def _plain_color(part: Data, links: list[str]) -> str:
    """Return the colour of a link whose file states none, as the page has it."""
    found = next((color for pattern, color in _BY_NAME if pattern.search(part["name"])), None)
    if found is not None or part.get("held"):
        return found or _PAYLOAD
    return _BASE if part["joint"] < 0 else _LINKS[links.index(part["name"]) % 2]


def _rgb(color: str) -> Array:
    return np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255


def keys_of(motion: PageMotion) -> Array:
    """Return instants (k,) so dense that lines between them are off by `TOLERANCE` at most; kinks are among them."""
    begin, end = float(motion.times[0]), float(motion.times[-1])
    t = np.linspace(begin, end, _PROBES)
    base = motion.base(t)
    followed = np.concatenate([motion.values(t), base[:, :3, 3], base[:, :3, :3].reshape(len(t), 9)], axis=1)
    bend = float(np.abs(np.diff(followed, n=2, axis=0)).max())  # acceleration times the square of the probes' step
    # A curve with acceleration a is off by a h^2 / 8 from the line over h.
    count = int(np.ceil((_PROBES - 1) * np.sqrt(bend / (8 * TOLERANCE)))) + 1
    grid = np.linspace(begin, end, min(max(count, 2), MOST_KEYS))
    kinks = motion.times[:-1][np.diff(motion.times) == 0]
    return np.unique(np.concatenate([grid, kinks]))
