"""Colours of meshes, a triangle at a time: materials, textures sampled in the middle of each triangle, colours of corners.

Colours are red, green, blue and opacity, each 0 to 1, as a screen takes them (sRGB); nan where a file states none. What cannot
be read of a colour is no error: the triangles have none, and a note says why.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown, shown_error

Array = NDArray[np.float64]

Colors = tuple[Array, tuple[str, ...]]
"""(n, 4) of n triangles, and notes."""

_LARGEST_IMAGE = 64_000_000  # pixels


def collada_colors(surfaces: Iterable[tuple[Any, Any]], folder: Path) -> Colors:
    """Return the colours of COLLADA's surfaces.

    Args:
        surfaces: pycollada's GeometryNode that shows a surface, and its TriangleSet.
        folder: of the file, where images are.
    """
    found, notes = [np.zeros((0, 4))], []
    for node, triangles in surfaces:
        effect = next((one.target.effect for one in node.materials if one.symbol == triangles.material), None)
        paint = None if effect is None else effect.diffuse
        if effect is not None and (paint is None or effect.shadingtype == "constant"):
            paint = effect.emission or paint
        if paint is None or isinstance(paint, (tuple, list)):
            found.append(_one(None if paint is None else [float(value) for value in paint], len(triangles)))
            continue
        try:
            found.append(_sampled(folder / _image_of(paint), _texture_coordinates(triangles)))
        except Exception as error:  # images have errors of many kinds
            found.append(_one(None, len(triangles)))
            notes.append(_without_texture(error))
    return np.concatenate(found), tuple(dict.fromkeys(notes))


def _image_of(paint: Any) -> str:
    from urllib.parse import unquote, urlparse

    path = str(paint.sampler.surface.image.path)
    return unquote(urlparse(path).path) if path.startswith("file:") else unquote(path).replace("\\", "/")


def _texture_coordinates(triangles: Any) -> Array:
    """Return the place in the image of the middle of each triangle, (n, 2)."""
    if not triangles.texcoordset:
        raise ValueError("the triangles have no texture coordinates")
    return np.asarray(triangles.texcoordset[0], dtype=np.float64)[triangles.texcoord_indexset[0]].mean(axis=1)[:, :2]


def trimesh_colors(mesh: Any) -> Colors:
    """Return the colours of a mesh of trimesh's."""
    count, visual = len(mesh.faces), mesh.visual
    try:
        if visual.kind == "texture":
            return _of_material(visual, np.asarray(mesh.faces)), ()
        if visual.kind == "face":
            return np.asarray(visual.face_colors, dtype=np.float64) / 255, ()
        if visual.kind == "vertex":
            return np.asarray(visual.vertex_colors, dtype=np.float64)[mesh.faces].mean(axis=1) / 255, ()
    except Exception as error:  # images have errors of many kinds
        return _one(None, count), (_without_texture(error),)
    return _one(None, count), ()


def _of_material(visual: Any, faces: NDArray[np.intp]) -> Array:
    material = visual.material
    if hasattr(material, "baseColorFactor"):  # glTF's: it states light, not what a screen takes
        image, given = material.baseColorTexture, material.baseColorFactor
        color = None if given is None else np.append(np.asarray(given, dtype=np.float64), 255.0)[:4] / 255
        if color is not None:
            color[:3] = screen_of_light(color[:3])
    else:
        image, diffuse = material.image, np.asarray(material.diffuse, dtype=np.float64) / 255
        color = None if image is not None or _is_default(diffuse) else diffuse
    if image is None or visual.uv is None:
        return _one(color, len(faces))
    sampled = _at(np.asarray(image.convert("RGBA")), np.asarray(visual.uv)[faces].mean(axis=1))
    return sampled if color is None else sampled * color


def _is_default(diffuse: Array) -> bool:
    """Whether a colour is the grey that trimesh gives materials that state none."""
    return bool((np.round(255 * diffuse[:3]) == 102).all())


def _sampled(path: Path, places: Array) -> Array:
    if not os.path.isfile(path):
        raise FileNotFoundError(f"{shown(path.name)} is not there")
    return _at(_pixels(path, path.stat().st_mtime_ns), places)


@lru_cache(maxsize=1)  # the meshes of a robot often share one
def _pixels(path: Path, _: int) -> NDArray[np.uint8]:
    from PIL import Image

    with Image.open(path) as image:
        if image.width * image.height > _LARGEST_IMAGE:
            raise ValueError(f"{shown(path.name)} has {image.width} x {image.height} pixels")
        return np.asarray(image.convert("RGBA"))


def _at(pixels: NDArray[np.uint8], places: Array) -> Array:
    """Return the colours (n, 4) of an image at places (n, 2), which repeat beyond 0 to 1; v goes upwards."""
    height, width = pixels.shape[:2]
    u, v = np.nan_to_num(np.mod(places, 1.0)).T
    return pixels[((1 - v) * (height - 1)).astype(np.intp), (u * (width - 1)).astype(np.intp)].astype(np.float64) / 255


def _one(color: Any, count: int) -> Array:
    """Return a colour, or none, count times."""
    given = [np.nan] * 4 if color is None else [*map(float, color), 1.0][:4]
    row = np.array(given) if np.isnan(given).any() else np.clip(given, 0, 1)
    return np.tile(row, (count, 1))


def _without_texture(error: Exception) -> str:
    said = str(error) if isinstance(error, (FileNotFoundError, ValueError)) else shown_error(error)
    return f"a texture is left out: {said}"


def screen_of_light(light: Array) -> Array:
    """Return what a screen takes (sRGB) for shares of light (linear), 0 to 1."""
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def light_of_screen(color: Array) -> Array:
    """Return the shares of light (linear) of what a screen takes (sRGB), 0 to 1."""
    color = np.clip(color, 0, 1)
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
