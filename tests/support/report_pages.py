"""What a report's page holds, read as the page reads it: packed numbers, the data of a file, poses between knots."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any

import numpy as np

from spacearm.geometry import pose
from spacearm.robot import Robot

Array = np.ndarray

KINDS = {"f32": "<f4", "f64": "<f8", "u8": "u1", "u16": "<u2", "u32": "<u4"}


def unpacked(text: str, *shape: int) -> Array:
    """Packed numbers, as float64."""
    kind, _, data = text.partition(":")
    return np.frombuffer(base64.b64decode(data), KINDS[kind]).reshape(shape or -1).astype(np.float64)


def content(html: str) -> dict[str, Any]:
    """The data of a page; JSON has no number that is none."""
    found = re.search(r'<script id="data" type="application/gzip;base64">([^<]*)</script>', html)
    assert found is not None
    return json.loads(gzip.decompress(base64.b64decode(found[1])), parse_constant=_no_number)


def _no_number(name: str) -> None:
    raise AssertionError(f"the page has {name}")


def section(view: dict[str, Any], title: str) -> dict[str, Any]:
    """A section by its title."""
    return next(one for one in view["sections"] if one["title"] == title)


def curve(view: dict[str, Any], plot: str, label: str) -> tuple[Array, Array]:
    """The instants and the values of a curve."""
    found = next(one for one in view["plots"] if one["id"] == plot)
    values = next(one["values"] for one in found["series"] if one["label"] == label)
    return unpacked(found["x"]), unpacked(values)


def on_page(knots: dict[str, Any], robot: Robot, at: Array) -> tuple[Array, Array]:
    """The joints (m, n) and T_w_b (m, 4, 4) at times (m,), written anew from what `web/src/data.ts` says."""
    t = unpacked(knots["t"])
    q, T = (
        _hermite(t, unpacked(knots["q"], -1, robot.dof), unpacked(knots["dq"], -1, robot.dof), at),
        np.tile(np.eye(4), (len(at), 1, 1)),
    )
    T[:, :3] = np.array(knots["baseAt"]).reshape(3, 4)
    base = knots.get("base")
    if base is not None:
        p = _hermite(t, unpacked(base["p"], -1, 3), unpacked(base["v"], -1, 3), at)
        w = _hermite(t, unpacked(base["w"], -1, 4), unpacked(base["dw"], -1, 4), at)
        T = np.array([pose(point, quaternion) for point, quaternion in zip(p, w, strict=True)])
    return q, T


def _hermite(t: Array, x: Array, v: Array, at: Array) -> Array:
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, max(len(t) - 2, 0))
    k = np.minimum(i + 1, len(t) - 1)
    h = t[k] - t[i]
    s = np.clip(np.divide(at - t[i], h, out=np.zeros_like(at), where=h > 0), 0, 1)[:, None]
    h = h[:, None]
    begin, end = (2 * s**3 - 3 * s**2 + 1) * x[i], (3 * s**2 - 2 * s**3) * x[k]
    return begin + end + h * ((s**3 - 2 * s**2 + s) * v[i] + (s**3 - s**2) * v[k])
