"""Light on hair, brows, lashes and a collar: a small transport of their own, by pixel.

Paths start at the pixels that show some of it and are followed until they escape; their end is
recorded by cell of the soft light's grid. Pictures by cell are so similar that a few represent them
all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import drjit as dr  # noqa: TID253 - a module that only a rendering process imports
import mitsuba as mi  # noqa: TID253
import numpy as np
from numpy.typing import NDArray

from app.core.baking.scene import HeadMesh, mitsuba_mesh
from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.portrait.light import grid, mirrored_cells
from scenes.head_detail.colours import head_colours
from scenes.head_detail.scene import mitsuba_shapes
from scenes.portraits.scene import Frame

Float32 = NDArray[np.float32]
_LANES = 1 << 20
_DEPTH = 24
_SHARP = 3
_BLUR = 1.2
_DULL = 1e-3
_SKIN = (0.44, 0.22, 0.13)
"""Diffuse reflectance of medium skin: Jensen et al., SIGGRAPH 2001, skin 1."""
_FIRST = 64
"""Rays that measure the share of details in a pixel."""


@dataclass(frozen=True, slots=True)
class Detail:
    """Pixels that show hair or cloth.

    Attributes:
        shape: Rows and columns that were rendered; see `Frame.shape`.
        pixel: (Q,) int64. Flat positions in them.
        cover: (Q,) float32. Share of the pixel that is detail.
        light: (Q, G, 3) float32. Light toward the camera for each cell of radiance 1.
    """

    shape: tuple[int, int]
    pixel: NDArray[np.int64]
    cover: Float32
    light: Float32


def detailed_scene(name: str, hair: str, head: HeadMesh) -> tuple[Any, tuple[str, ...]]:
    """Return the scene of a head with hair, and the names of the details.

    Its skin is a cheap stand-in with the reflectance of skin, since it lights the hair.
    """
    white = {"type": "mesh_attribute", "name": "vertex_color"}
    skin = mi.load_dict({"type": "diffuse", "reflectance": white})
    eye = mi.load_dict({"type": "principled", "base_color": white, "roughness": 0.2})
    coloured = replace(head.skin, colours=head_colours(name) * np.array(_SKIN, np.float32))
    details = mitsuba_shapes(name, hair)
    assert head.eyes is not None
    parts = {
        "skin": mitsuba_mesh("skin", coloured, {"bsdf": skin}),
        "eyes": mitsuba_mesh("eyes", head.eyes, {"bsdf": eye}),
    }
    return mi.load_dict({"type": "scene", **parts, **details}), tuple(details)


def cover(scene: Any, frame: Frame, names: tuple[str, ...]) -> tuple[Float32, Float32]:
    """Return the share of each rendered pixel that details cover, and that anything covers."""
    rows, half = frame.shape
    found = []
    for kind in (names, ("skin", "eyes", *names)):
        total = np.zeros(rows * half)
        for part in range(0, _FIRST, 8):
            lane = dr.arange(mi.UInt32, rows * half * 8)
            rng = mi.PCG32(rows * half * 8, part)
            hit = _of(scene, scene.ray_intersect(_rays(frame, lane // 8, rng)), kind)
            total += np.array(hit).reshape(-1, 8).sum(axis=1)
        found.append((total / _FIRST).astype(np.float32).reshape(rows, half))
    return found[0], found[1]


def _rays(frame: Frame, pixel: Any, rng: Any) -> Any:
    columns = frame.shape[1]
    row, column = mi.Float(pixel // columns), mi.Float(pixel % columns)
    row, column = row + rng.next_float32(), column + rng.next_float32()
    return frame.look((column - frame.size / 2) * frame.step, frame.top - row * frame.step)


def _of(scene: Any, si: Any, names: tuple[str, ...]) -> Any:
    hit = mi.Bool(False)
    for shape in scene.shapes():
        if shape.id() in names:
            hit |= si.is_valid() & (si.shape == mi.ShapePtr(shape))
    return hit


def follow(
    scene: Any, frame: Frame, names: tuple[str, ...], pixel: NDArray[np.int64], paths: int
) -> Float32:
    """Return the light of some pixels' details toward the camera, by cell, (n, G, 3)."""
    row, azimuth, _, _ = grid()
    first = np.searchsorted(row, np.arange(int(row[-1]) + 2)).astype(np.uint32)
    rows, cells = int(row[-1]) + 1, len(azimuth)
    out = np.empty((len(pixel), cells, 3), np.float32)
    step = max(1, _LANES // paths)
    starts = mi.UInt32(first)
    for begin in range(0, len(pixel), step):
        some = pixel[begin : begin + step].astype(np.uint32)
        sums = dr.zeros(mi.Float, len(some) * cells * 3)
        _trace(scene, frame, names, mi.UInt32(some), paths, begin, (starts, rows, cells, sums))
        out[begin : begin + step] = np.array(sums).reshape(len(some), cells, 3) / paths
    return out


def _trace(
    scene: Any,
    frame: Frame,
    names: tuple[str, ...],
    pixels: Any,
    paths: int,
    seed: int,
    into: tuple[Any, ...],
) -> None:
    starts, rows, cells, sums = into
    count = dr.width(pixels) * paths
    lane = dr.arange(mi.UInt32, count)
    slot = lane // paths
    rng = mi.PCG32(count, seed + 7)
    ray = _rays(frame, dr.gather(mi.UInt32, pixels, slot), rng)
    context = mi.BSDFContext()

    def body(ray: Any, rng: Any, weight: Any, alive: Any, n: Any) -> tuple[Any, ...]:
        si = scene.ray_intersect(ray, alive)
        escapes = alive & ~si.is_valid() & (n > 0)
        height = dr.acos(dr.clip(ray.d.y, -1, 1)) / dr.pi * rows
        row = dr.minimum(mi.UInt32(height), rows - 1)
        low, high = dr.gather(mi.UInt32, starts, row), dr.gather(mi.UInt32, starts, row + 1)
        round_ = dr.atan2(-ray.d.x, ray.d.z) / dr.two_pi + 0.5
        column = dr.minimum(mi.UInt32(round_ * mi.Float(high - low)), high - low - 1)
        place = (slot * cells + low + column) * 3
        for channel, value in enumerate((weight.x, weight.y, weight.z)):
            dr.scatter_reduce(dr.ReduceOp.Add, sums, value, place + channel, escapes)
        # The first surface must be a detail: skin is drawn from its own transport.
        alive &= si.is_valid() & ((n > 0) | _of(scene, si, names))
        sample, scale = si.bsdf(ray).sample(
            context,
            si,
            rng.next_float32(),
            mi.Point2f(rng.next_float32(), rng.next_float32()),
            alive,
        )
        weight = weight * scale
        ray = si.spawn_ray(si.to_world(sample.wo))
        n += 1
        keep = dr.select(n > 4, dr.clip(dr.max(weight), 0.05, 1), 1)
        alive &= (dr.max(weight) > 0) & (n < _DEPTH) & (rng.next_float32() < keep)
        return ray, rng, weight * dr.rcp(keep), alive, n

    state = (ray, rng, mi.Color3f(1), mi.Bool(True), mi.UInt32(0))
    dr.while_loop(state, lambda *s: s[3], body)
    dr.eval(sums)


def compressed(detail: Detail, rank: int) -> tuple[Float32, Float32, Float32]:
    """Convert details of the left half to the form that ships.

    The functions are even or odd, so that the truncation looks the same on both sides of the
    middle. All but the first few are smoothed over the picture, as they contain more noise than
    hair.

    Returns:
        colour: (Q, 3) float32. Of each pixel in even light, its luminance 1.
        basis: (Q, R) float32. Light by basis function, in units of the colour.
        cells: (R, G, 3) float32.
    """
    twin = (3 * mirrored_cells()[:, None] + np.arange(3)).ravel()
    colour, basis, cells = shortened(detail, rank, twin)
    basis[:, _SHARP:] = _smoothed(detail, basis[:, _SHARP:], _BLUR)
    return colour, basis, cells


def shortened(
    detail: Detail, rank: int, twin: NDArray[np.int64] | None = None
) -> tuple[Float32, Float32, Float32]:
    """Compress without smoothing; `twin` gives the indices of mirrored cells."""
    whole = detail.light.sum(axis=1)
    colour: Float32 = whole / np.maximum(whole @ np.asarray(LUMINANCE_WEIGHTS), 1e-9)[:, None]
    # Every direction of the sky counts equally, and every channel.
    scale = _scale()
    scaled = (detail.light / np.maximum(colour, _DULL)[:, None] / scale).reshape(len(whole), -1)
    gram = (scaled.T @ scaled).astype(np.float64)
    _, vectors = np.linalg.eigh(gram if twin is None else gram + gram[np.ix_(twin, twin)])
    chosen = vectors[:, ::-1][:, :rank].T.astype(np.float32)
    basis: Float32 = np.asarray(scaled @ chosen.T, np.float32)
    return colour.astype(np.float32), basis, chosen.reshape(rank, -1, 3) * scale


def _scale() -> Float32:
    return np.sqrt(grid()[3]).astype(np.float32)[:, None]


def in_common(
    details: Sequence[Detail], short: Sequence[tuple[Float32, Float32]], rank: int, blur: float
) -> tuple[list[Float32], Float32]:
    """Express views of one head of hair in the same functions.

    Args:
        short: Basis and cells of each, from `shortened`.
        blur: Blur of all functions but the first few, pixels.

    Returns:
        (Q, R) float32 of each, and cells, (R, G, 3) float32.
    """
    rows = [(cells / _scale()).reshape(len(cells), -1) for _, cells in short]
    axes, lengths = np.linalg.qr(np.concatenate(rows).T.astype(np.float64))
    parts = np.split(lengths.T, np.cumsum([len(row) for row in rows])[:-1])
    along = [basis.astype(np.float64) @ part for (basis, _), part in zip(short, parts, strict=True)]
    _, vectors = np.linalg.eigh(np.add.reduce([one.T @ one for one in along]))
    chosen = vectors[:, ::-1][:, :rank]
    bases = [(one @ chosen).astype(np.float32) for one in along]
    for detail, basis in zip(details, bases, strict=True):
        basis[:, _SHARP:] = _smoothed(detail, basis[:, _SHARP:], blur)
    cells = (axes @ chosen).T.reshape(rank, -1, 3).astype(np.float32) * _scale()
    return bases, cells


def smoothed_colours(detail: Detail, colour: Float32, blur: float) -> Float32:
    """Average colours of pixels with their neighbours', weighted by detail."""
    weight = detail.cover[:, None]
    smooth = _smoothed(detail, colour * weight, blur) / np.maximum(weight, 1e-6)
    return smooth.astype(np.float32)


def _smoothed(detail: Detail, values: Float32, blur: float) -> Float32:
    """Average values of pixels with their neighbours', weighted by detail."""
    shape = detail.shape
    cover = np.zeros(shape, np.float32)
    cover.flat[detail.pixel] = detail.cover
    weight = cv2.GaussianBlur(cover, (0, 0), blur)
    out = np.empty_like(values)
    for k, column in enumerate(values.T):
        picture = np.zeros(shape, np.float32)
        picture.flat[detail.pixel] = column
        blurred = cv2.GaussianBlur(picture, (0, 0), blur)
        out[:, k] = blurred.flat[detail.pixel] / np.maximum(weight.flat[detail.pixel], 1e-6)
    return out * detail.cover[:, None]
