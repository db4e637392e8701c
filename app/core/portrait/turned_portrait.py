"""Portraits of turned heads.

The light on the skin does not depend on the camera. The nodes are therefore those of the head, plus
some that are visible only in side views. Their positions in a picture, their reflections and the
skin's light towards the camera are computed here. A file stores the nodes around each sample and
the colour of the sample.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Indices
from app.core.portrait.full_size_portrait import fresnel, shadowing
from app.core.portrait.light import ROUGHNESS
from app.core.portrait.portrait_head import (
    SKY,
    SPREAD,
    PortraitHead,
    PortraitSkin,
    SeenNodes,
    SkinNodes,
)

Arrays: TypeAlias = "Mapping[str, NDArray[Any]]"
SIDE: Final = 320
"""Number of rows and columns of a picture from the side."""
PLACE_STEP: Final = 1e-4
"""Step of stored positions, in scene units. Their heights are relative to the camera."""
COLOUR_STEPS: Final = 128
SOME: Final = ((0.125, 0.375), (0.375, 0.875), (0.625, 0.125), (0.875, 0.625))
"""Row and column offsets of the four samples inside a pixel at an edge."""
_LEAVING: Final = {"dark": (0.05, -0.02, -0.08)}
_LEAVING_USUAL: Final = (0.25, 0.12, 0.02)
"""Reduction of the skin's red, green and blue light at grazing angles, relative to head-on."""
_DIMMED: Final = 0.65
"""Cosine below which this reduction begins."""
_FLAT: Final = 1e-9  # area of a degenerate triangle, in pixels
_FACETS: Final = 7  # along each axis, to integrate a rough surface
_SMOOTH: Final = 0.04  # roughness of the tear film
_TEARS: Final = 0.9  # relative to skin's reflection, from their index of 1.376
_FREE: Final = 0.75  # of the sky at a horizon's edge: lobes reach up from there
_LEAST: Final = 0.05  # cosine: below it a surface is seen edge-on
_MIRROR: Final = np.array([-1, 1, 1], np.float32)


def with_aside(
    front: PortraitHead, tone: PortraitSkin, arrays: Arrays, more: PortraitSkin
) -> tuple[SkinNodes, PortraitSkin, Float32]:
    """Return a head's nodes: those of the front, those visible only from the side, and hidden ones.

    Args:
        arrays: Arrays from the files. "shade" is the part of the sky hidden from nodes, relative to
            the front's own hair.
        more: Skin of the new nodes and of the front's nodes that are traced again.

    Returns:
        The nodes, the skin between them, and the cosines at which the skin was traced, (M,)
        float32.
    """
    old, again, visible_count = front.nodes, arrays["again"], len(front.visible.index)
    count, other_count = len(old.normals), len(arrays["straight"]) - len(again)
    total = count + len(arrays["normals"])
    order = np.r_[
        :visible_count,
        count : count + other_count,
        visible_count:count,
        count + other_count : total,
    ]

    def both(one: Any, other: Any, rows: Indices = order, axis: int = 0) -> Any:
        return np.take(np.concatenate([one, other], axis), rows, axis)

    eye = np.unpackbits(arrays["eye"], count=total - count).astype(bool)
    horizon = both(old.horizon, arrays["horizon"].transpose(1, 2, 0), axis=2)
    if "shade" in arrays:
        horizon = horizon + arrays["shade"].transpose(1, 2, 0)
    nodes = SkinNodes(
        both(old.normals, arrays["normals"] / np.float32(32767)),
        horizon,
        both(old.eye, eye),
        old.profile,
        both(old.patches, arrays["patches"].astype(np.intp)),
    )
    begins, parts = np.cumsum([0, *nodes.counts]), [np.argsort(order)[:count]]
    parts += [begins[k] + np.arange(old.counts[k]) for k in (1, 2)]
    half, source = np.divmod(tone.source, sum(old.counts))
    source = np.concatenate(parts)[source] + half * begins[-1]
    columns = np.r_[
        :visible_count, visible_count + len(again) : visible_count + len(again) + other_count
    ]
    columns[again] = visible_count + np.arange(len(again))
    share = both(tone.share, more.share, columns, 1)
    skin = PortraitSkin(both(source, more.source, columns, 1), share)
    if len(arrays["positions"]) != total or not skin.fits(nodes, len(columns)):
        raise ValueError("sizes")
    return nodes, skin, both(front.visible.straight, arrays["straight"], columns)


def seen_from(
    nodes: SkinNodes,
    straight: Float32,
    arrays: Arrays,
    frame: Mapping[str, Any],
    yaw_deg: float,
    skin: str,
) -> PortraitHead:
    """Return one view of a turned head.

    Args:
        straight: (M,). The cosines from `with_aside`.
        frame: Position of the camera, and its pixels: "origin" is in scene units, "top" and "step"
            are slopes.
        yaw_deg: Yaw of the view, in degrees, negative for the mirror image.
        skin: Name of the skin tone.
    """
    inside, edge = np.unpackbits(arrays["pixels"], axis=-1, count=SIDE).astype(bool)
    triangles = np.cumsum(arrays["triangles"], axis=0, dtype=np.int16).view(np.uint16)
    half, node = np.divmod(triangles[arrays["triangle"]].astype(np.intp), len(straight))
    index, corners = np.unique(half * len(nodes.normals) + node, return_inverse=True)
    three, node = corners.reshape(-1, 3), index % len(nodes.normals)
    both = np.hstack([arrays["positions"] * np.float32(PLACE_STEP), nodes.normals])
    both = np.concatenate([both, both * np.tile(_MIRROR, 2)])[index]
    position, normal = both[:, :3], both[:, 3:]
    view = np.asarray(frame["origin"], np.float32) - position
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    four = np.argwhere(edge)[:, None] + np.array(SOME)
    pixels = np.concatenate([np.argwhere(inside) + 0.5, four.reshape(-1, 2)])
    right, down = _project(position, frame, math.radians(abs(yaw_deg)))
    weights = _weights(down[three].T - pixels[:, 0], right[three].T - pixels[:, 1])
    weights *= np.asarray(triangles.any(axis=1))[arrays["triangle"], None]
    at, steps = tuple(pixels.astype(np.intp).T), np.float32(COLOUR_STEPS)
    albedo = np.asarray(cv2.imdecode(arrays["albedo"], cv2.IMREAD_COLOR))[at][:, ::-1] / steps
    pores = np.asarray(cv2.imdecode(arrays["detail"], cv2.IMREAD_GRAYSCALE))[at] / steps
    eye, cosine = nodes.eye[node], (normal * view).sum(axis=1)
    gain, way = mirrored(nodes, index, normal, view, ROUGHNESS)
    glass = np.flatnonzero(eye[three].all(axis=1) & weights.any(axis=1))
    round_ = (normal[three[glass]] * weights[glass, :, None]).sum(axis=1)
    round_ /= np.linalg.norm(round_, axis=1, keepdims=True)
    shine, back = mirrored(nodes, index[three[glass, 0]], round_, view[three[glass, 0]], _SMOOTH)
    passes = np.where(eye[:, None], 1, _leaving(cosine, skin) / _leaving(straight[node], skin))
    # Edge-on, a surface would reflect a lamp without limit, so such skin and eyes do not reflect.
    dull = eye | (cosine < _LEAST)
    visible_nodes = SeenNodes(index, normal, view, np.where(eye, 0, gain), way, dull, passes)
    samples = inside, edge, three, weights, albedo, pores, glass, shine * np.float32(_TEARS), back
    return PortraitHead(nodes, visible_nodes, *samples, yaw_deg=yaw_deg)


def _project(positions: Float32, frame: Mapping[str, Any], yaw: float) -> tuple[Any, Any]:
    """Project positions to columns and rows, in pixels, with `yaw` given in radians."""
    x, y, z = (positions - np.asarray(frame["origin"])).T
    away = (x * math.sin(yaw) - z * math.cos(yaw)) * frame["step"]
    right = (x * math.cos(yaw) + z * math.sin(yaw)) / away + SIDE / 2
    return right, frame["top"] / frame["step"] - y / away


def _weights(down: NDArray[Any], right: NDArray[Any]) -> Float32:
    """Return the weights of the three nodes of each sample, from their offsets, (3, S) each."""
    # Equal weights for coinciding nodes, which have no area.
    after = np.roll(down, -1, axis=0), np.roll(right, -1, axis=0)
    parts = np.roll(down * after[1] - right * after[0], -1, axis=0).T + _FLAT
    shares = np.clip(parts / parts.sum(axis=1, keepdims=True), 0, 1)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True), np.float32)


def _leaving(cosine: Float32, skin: str) -> Float32:
    """Return the fraction of its light that the skin emits at the given angles, (n, 3).

    The fraction varies less for dark skin, which scatters little light.
    """
    edge = np.clip(1 - cosine[:, None] / np.float32(_DIMMED), 0, 1)
    return np.asarray(1 - edge**3 * np.array(_LEAVING.get(skin, _LEAVING_USUAL), np.float32))


def mirrored(
    nodes: SkinNodes, index: Indices, normals: Float32, view: Float32, roughness: float
) -> tuple[Float32, Float32]:
    """Return the part of even light that rough surfaces reflect to the camera, and its direction.

    The reflection is integrated over Beckmann's facets by their slopes (Gauss-Hermite), as far as
    the nodes see the sky.

    Args:
        index: (n,) intp. Indices into all nodes and all mirrored nodes.
        normals, view: (n, 3) float32. Surface normals, and directions to the camera.

    Returns:
        The fraction, (n,) float32, and the direction, (n, 3) float32.
    """
    beside = np.cross(normals, np.array([0, 1, 0.01], np.float32))
    beside /= np.linalg.norm(beside, axis=1, keepdims=True)
    above = np.cross(normals, beside)
    cosine = (normals * view).sum(axis=1)
    straight = np.maximum(cosine, np.float32(_LEAST))
    slopes, counts = np.polynomial.hermite.hermgauss(_FACETS)
    grid = np.stack(np.meshgrid(slopes, slopes), -1).reshape(-1, 2).astype(np.float32) * roughness
    total = np.zeros((len(index), 4), np.float32)
    for (x, y), count in zip(grid, np.outer(counts, counts).ravel(), strict=True):
        length = np.sqrt(1 + x**2 + y**2)
        facet = (normals + x * beside + y * above) / length
        facing = np.maximum((facet * view).sum(axis=1), 0)
        out = 2 * facing[:, None] * facet - view
        up = np.maximum((out * normals).sum(axis=1), 0)
        amount = (
            facing * fresnel(facing) * shadowing(straight, roughness) * shadowing(up, roughness)
        )
        amount *= (up > 0) * (cosine > 0) * _open(nodes, index, out) / straight
        amount *= np.float32(count * length / math.pi)
        total += amount[:, None] * np.insert(out, 0, 1, axis=1)
    size = np.linalg.norm(total[:, 1:], axis=1, keepdims=True)
    return total[:, 0], np.where(size > 0, total[:, 1:] / np.maximum(size, 1e-9), normals)


def _open(nodes: SkinNodes, index: Indices, ways: Float32) -> Float32:
    """Return the fraction of sky around each direction, (n, 3), that nodes of both halves see."""
    half, node = np.divmod(index, len(nodes.normals))
    azimuth = np.arctan2((2 * half - 1) * ways[:, 0], ways[:, 2])
    column = ((azimuth / (2 * np.pi) + 0.5) * SKY[1]).astype(np.intp) % SKY[1]
    row = ((0.5 - np.arcsin(np.clip(ways[:, 1], -1, 1)) / np.pi) * SKY[0]).astype(np.intp)
    inside = nodes.horizon[np.minimum(row, SKY[0] - 1), column, node]
    return np.asarray(np.clip(_FREE + inside / np.float32(SPREAD), 0, 1))
