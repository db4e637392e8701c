"""The portrait at full size: soft light from many directions, sharp shadows, sheen, wet eyes.

Light that skin scatters is worked out at nodes and carried on by what the bake found; what the
surface mirrors comes from the panorama itself, for each sample.
"""

from __future__ import annotations

import math
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.portrait.head import PortraitHead, PortraitSkin, directions
from app.core.portrait.light import ROUGHNESS, Lamp, PortraitLight, mirrored_cells, soft_light

_SIDES: Final = 2
_LINE: Final = 256
_GLINTS: Final = 3
_STRAIGHT: Final = 0.028  # share that skin (index 1.4) mirrors of light from straight above


def portrait_picture(
    head: PortraitHead, skin: PortraitSkin, light: PortraitLight, turn_deg: float
) -> Float32:
    """Picture of a head in a place's light.

    Args:
        turn_deg: Azimuth in the panorama that the sitter faces.

    Returns:
        (rows, columns, 3) float32. Linear Rec. 709 on black, in the panorama's unit.
    """
    nodes = scattered(head, skin, entering(head, light, turn_deg))
    samples = _between(head, nodes)
    samples.reshape(-1, _SIDES, 3)[...] *= head.albedo[:, None]
    _mirror(head, light, turn_deg, samples)
    for lamp in light.lamps[:_GLINTS]:
        _glint(head, lamp, math.radians(turn_deg), samples)
    return _placed(head, samples)


def _between(head: PortraitHead, nodes: Float32) -> Float32:
    """Interpolate values of nodes at the samples."""
    three, weights = head.three, head.weights
    out = nodes[three[:, 0]] * weights[:, :1]
    for k in (1, 2):
        out += nodes[three[:, k]] * weights[:, k : k + 1]
    return out


def entering(head: PortraitHead, light: PortraitLight, turn_deg: float) -> Float32:
    """Light that enters each node, (N, 6) float32: of the left half, then of the right one."""
    soft = soft_light(light, turn_deg)
    both = np.concatenate([soft, soft[mirrored_cells()]], axis=1)
    found = head.soft @ both
    for lamp in light.lamps:
        for side, azimuth in enumerate(_azimuths(lamp, math.radians(turn_deg))):
            way = directions(np.array([azimuth]), np.array([lamp.elevation]))[0]
            mu = np.maximum(head.normals @ way, 0)
            share = head.open_to(lamp, azimuth) * head.entering(mu)
            found[:, 3 * side : 3 * side + 3] += share[:, None] * lamp.flux
    return np.asarray(found, np.float32)


def _azimuths(lamp: Lamp, turn: float) -> tuple[float, float]:
    """Where a lamp stands for the left half, and for the mirrored right one."""
    return lamp.azimuth - turn, turn - lamp.azimuth


def _glint(head: PortraitHead, lamp: Lamp, turn: float, samples: Float32) -> None:
    """Add what skin mirrors of a lamp.

    Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007: equation 20,
    with Beckmann's facets (25) and their shadowing (27).
    """
    skin = ~head.glassy
    normal, view = head.facing[skin], head.view[skin]
    for side, azimuth in enumerate(_azimuths(lamp, turn)):
        way = directions(np.array([azimuth]), np.array([lamp.elevation]))[0]
        opened = _between(head, head.open_to(lamp, azimuth)[:, None])[skin, 0]
        cosine = normal @ way
        lit = np.flatnonzero((cosine > 0) & (opened > 0))
        n, v = normal[lit], view[lit]
        half = v + way
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        facet = np.clip((n * half).sum(1), 1e-3, 1) ** 2
        roughness = np.float32(ROUGHNESS)
        density = np.exp((1 - 1 / facet) / roughness**2) / (np.pi * roughness**2 * facet**2)
        out, into = np.clip((n * v).sum(1), 1e-3, 1), cosine[lit]
        grazing = 1 - np.clip((v * half).sum(1), 0, 1)
        fresnel = _STRAIGHT + (1 - _STRAIGHT) * grazing**5
        value = fresnel * density * _shadowing(out) * _shadowing(into) / (4 * out) * opened[lit]
        at = np.flatnonzero(skin)[lit]
        samples[at, 3 * side : 3 * side + 3] += value[:, None] * lamp.flux


def _shadowing(cosine: Float32) -> Float32:
    """Share of Beckmann's facets that are not behind others; Walter's rational fit."""
    a = cosine / np.sqrt(np.maximum(1 - cosine**2, 1e-6)) / np.float32(ROUGHNESS)
    fit = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    return np.where(a < 1.6, fit, 1).astype(np.float32)


def scattered(head: PortraitHead, skin: PortraitSkin, found: Float32) -> Float32:
    """Light that comes out of each shown node toward the camera, (shown, 6) float32."""
    sources = [found]
    for order, starts, size in head.patch_shares:
        sources.append(np.add.reduceat(found[order], starts, axis=0) * size)
    left = np.concatenate(sources)
    right = np.concatenate([left[:, 3:], left[:, :3]], axis=1)
    both = np.concatenate([left, right])
    out = np.zeros((head.shown, 6), np.float32)
    for k in range(skin.source.shape[1]):
        taken = both[skin.source[:, k]].reshape(-1, _SIDES, 3)
        out.reshape(-1, _SIDES, 3)[...] += taken * skin.share[:, None, k]
    return out


def _mirror(head: PortraitHead, light: PortraitLight, turn_deg: float, samples: Float32) -> None:
    """Add what skin and eyes mirror."""
    up = np.arcsin(np.clip(head.way[:, 1], -1, 1))
    round_ = np.arctan2(-head.way[:, 0], head.way[:, 2])
    for chosen, source in ((~head.glassy, light.sheen), (head.glassy, light.panorama)):
        rows, columns = source.shape[:2]
        y = ((0.5 - up[chosen] / np.pi) * rows - 0.5).astype(np.float32)
        for side, sign in enumerate((1, -1)):
            azimuth = sign * round_[chosen] + math.radians(turn_deg)
            x = (((azimuth / (2 * np.pi) + 0.5) % 1.0) * columns - 0.5).astype(np.float32)
            seen = _looked_up(source, x, y)
            samples[chosen, 3 * side : 3 * side + 3] += seen * head.gain[chosen][:, None]


def _looked_up(source: Float32, x: Float32, y: Float32) -> Float32:
    """Read a panorama at places, (n, 3)."""
    count = -(-len(x) // _LINE) * _LINE
    maps = [np.resize(np.pad(m, (0, count - len(m))), (count // _LINE, _LINE)) for m in (x, y)]
    wide = np.concatenate([source[:, -1:], source, source[:, :1]], axis=1)
    found = cv2.remap(wide, maps[0] + 1, maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found.reshape(-1, 3)[: len(x)])


def _placed(head: PortraitHead, samples: Float32) -> Float32:
    rows, half = head.inside.shape
    out = np.zeros((rows, 2 * half, 3), np.float32)
    single = int(head.inside.sum())
    edge = samples[single:].reshape(-1, 4, 6).mean(axis=1)
    for side, part in enumerate((out[:, :half], out[:, ::-1][:, :half])):
        columns = slice(3 * side, 3 * side + 3)
        part[head.inside] = samples[:single, columns]
        part[head.edge] = edge[:, columns]
    return out
