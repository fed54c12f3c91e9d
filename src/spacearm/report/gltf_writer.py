"""glTF 2.0 in one binary file (GLB): nodes, meshes, materials and animations, written piece by piece.

The format is the Khronos Group's. Nodes are in metres; the y axis points up, so a scene whose z axis does goes below a node
that turns it.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.rotations import quaternion_of
from spacearm.geometry.mesh_colors import light_of_screen

Array = NDArray[np.float64]
Item = dict[str, Any]

_FLOAT, _U16, _U32 = 5126, 5123, 5125
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_VERTICES, _INDICES = 34962, 34963  # what a view of the buffer is for
_LINE_STRIP, _TRIANGLES = 3, 4
_ROUGHNESS = 0.62
_STILL = 1e-12


class GltfWriter:
    """Gathers a file's parts; `written` returns it."""

    def __init__(self, generator: str) -> None:
        self._asset = {"version": "2.0", "generator": generator}
        self._buffer = bytearray()
        self._lists: dict[str, list[Item]] = {}
        self._materials: dict[tuple[Any, ...], int] = {}
        self._channels: list[Item] = []
        self._samplers: list[Item] = []

    def _append(self, which: str, item: Item) -> int:
        self._lists.setdefault(which, []).append(item)
        return len(self._lists[which]) - 1

    def accessor(self, values: ArrayLike, *, indices: bool = False, target: int | None = None, bounds: bool = False) -> int:
        """Store numbers (k,) or (k, c) and return their place."""
        array = np.asarray(values)
        array = array.astype(("<u2" if array.size and array.max() < 65535 else "<u4") if indices else "<f4")
        self._buffer += b"\0" * (-len(self._buffer) % 4)
        content = np.ascontiguousarray(array).tobytes()
        view: Item = {"buffer": 0, "byteOffset": len(self._buffer), "byteLength": len(content)}
        self._buffer += content
        if target is not None:
            view["target"] = target
        component = {"<f4": _FLOAT, "<u2": _U16, "<u4": _U32}[array.dtype.str]
        kind = _KINDS[1 if array.ndim == 1 else array.shape[1]]
        made: Item = {"componentType": component, "count": len(array), "type": kind}
        if bounds:
            rows = array.reshape(len(array), -1)
            made |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        return self._append("accessors", {"bufferView": self._append("bufferViews", view), **made})

    def material(self, color: ArrayLike, *, opacity: float = 1.0, two_sided: bool = False, painted: bool = False) -> int:
        """Return the place of a material.

        Args:
            color: (3,) red, green and blue as a screen takes them (sRGB), 0 to 1.
            opacity: below 1: seen through.
            two_sided: also seen from inside.
            painted: of a mesh whose points have colours, which are multiplied with this one.
        """
        rgb = tuple(np.round(np.asarray(color, dtype=np.float64), 6).tolist())
        key = (rgb, opacity, two_sided, painted)
        if key not in self._materials:
            light = light_of_screen(np.array(rgb)).tolist()
            surface = {"baseColorFactor": [*light, opacity], "metallicFactor": 0.0, "roughnessFactor": _ROUGHNESS}
            made: Item = {"pbrMetallicRoughness": surface}
            made |= {"alphaMode": "BLEND"} if opacity < 1 else {}
            made |= {"doubleSided": True} if two_sided or opacity < 1 else {}
            self._materials[key] = self._append("materials", made)
        return self._materials[key]

    def surface(self, positions: Array, normals: Array, faces: NDArray[Any], colors: Array | None = None) -> Item:
        """Store triangles and return what a mesh says of them, without a material.

        Args:
            positions, normals: (k, 3) [m].
            faces: (m, 3) indices of them.
            colors: (k, 3) of the points, as shares of light; None: those of the material.
        """
        attributes = {
            "POSITION": self.accessor(positions, target=_VERTICES, bounds=True),
            "NORMAL": self.accessor(normals, target=_VERTICES),
        }
        if colors is not None:
            attributes["COLOR_0"] = self.accessor(colors, target=_VERTICES)
        return {
            "attributes": attributes,
            "indices": self.accessor(faces.ravel(), indices=True, target=_INDICES),
            "mode": _TRIANGLES,
        }

    def line(self, points: Array) -> Item:
        """Store a line through points (k, 3) [m]."""
        return {"attributes": {"POSITION": self.accessor(points, target=_VERTICES, bounds=True)}, "mode": _LINE_STRIP}

    def mesh(self, name: str, surfaces: list[tuple[Item, int]]) -> int:
        """Make a mesh of surfaces or lines, each with its material."""
        return self._append(
            "meshes", {"name": name, "primitives": [{**surface, "material": material} for surface, material in surfaces]}
        )

    def node(
        self,
        name: str,
        *,
        T: Array | None = None,
        scale: ArrayLike | None = None,
        mesh: int | None = None,
        parent: int | None = None,
        extras: Item | None = None,
    ) -> int:
        """Add a node, placed by T (4, 4) [m] and scaled within itself, below another one."""
        made: Item = {"name": name}
        if T is not None:
            made |= placed(T)
        if scale is not None and not np.allclose(scale, 1.0, rtol=0, atol=_STILL):
            made["scale"] = np.asarray(scale, dtype=np.float64).tolist()
        if mesh is not None:
            made["mesh"] = mesh
        if extras:
            made["extras"] = extras
        place = self._append("nodes", made)
        if parent is not None:
            self._lists["nodes"][parent].setdefault("children", []).append(place)
        return place

    def animate(self, node: int, path: str, times: int, values: Array) -> None:
        """Move a node.

        Args:
            node: its place.
            path: "translation" or "rotation".
            times: the place of the instants (k,) [s].
            values: (k, 3) [m], or quaternions (k, 4) wxyz.
        """
        values = np.roll(values, -1, axis=1) if path == "rotation" else values  # glTF has xyzw
        self._samplers.append({"input": times, "output": self.accessor(values), "interpolation": "LINEAR"})
        self._channels.append({"sampler": len(self._samplers) - 1, "target": {"node": node, "path": path}})

    def written(self, roots: list[int], *, name: str, extras: Item | None = None) -> bytes:
        """Return the file."""
        document: Item = {"asset": self._asset, "scene": 0, "scenes": [{"name": name, "nodes": roots}], **self._lists}
        if extras:
            document["scenes"][0]["extras"] = extras
        if self._channels:
            document["animations"] = [{"name": "motion", "channels": self._channels, "samplers": self._samplers}]
        binary = bytes(self._buffer) + b"\0" * (-len(self._buffer) % 4)
        if binary:
            document["buffers"] = [{"byteLength": len(binary)}]
        text = json.dumps(document, allow_nan=False, separators=(",", ":")).encode()
        chunks = [(text + b" " * (-len(text) % 4), b"JSON"), *([(binary, b"BIN\0")] if binary else [])]
        body = b"".join(struct.pack("<I", len(content)) + kind + content for content, kind in chunks)
        return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def placed(T: Array) -> Item:
    """Return what a node says of its place T (4, 4): nothing where it is its parent's."""
    made: Item = {}
    if np.abs(T[:3, 3]).max() > _STILL:
        made["translation"] = T[:3, 3].tolist()
    if np.abs(T[:3, :3] - np.eye(3)).max() > _STILL:
        made["rotation"] = np.roll(quaternion_of(T[:3, :3]), -1).tolist()
    return made
