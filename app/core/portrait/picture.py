"""The portrait at full size: soft light from many directions, sharp shadows, sheen, wet eyes.

Light that skin scatters is worked out at nodes and carried on by what the bake found; what the
surface mirrors comes from the panorama itself, for each sample.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.portrait.head import Hair, PortraitHead, PortraitSkin, SkinNodes, directions
from app.core.portrait.light import (
    GLINTS,
    ROUGHNESS,
    Lamp,
    PortraitLight,
    grid,
    mirrored_cells,
    soft_light,
)

_SIDES: Final = 2
_LINE: Final = 256
_NEAR: Final = 0.2  # radians around a lamp in which cells share its light
_STRAIGHT: Final = 0.028  # share that skin (index 1.4) mirrors of light from straight above


def portrait_picture(
    head: PortraitHead, skin: PortraitSkin, light: PortraitLight, turn_deg: float
) -> Float32:
    """Picture of a head in a place's light; see `portrait_pictures`."""
    return next(portrait_pictures(head, skin, light, [turn_deg]))


def portrait_pictures(
    head: PortraitHead, skin: PortraitSkin, light: PortraitLight, turns_deg: Sequence[float]
) -> Iterator[Float32]:
    """Pictures of a head at several turns, one after another.

    Args:
        turns_deg: Azimuths in the panorama that the sitter faces.

    Returns:
        (rows, columns, 3) float32 each. Linear Rec. 709 on black, in the panorama's unit.
    """
    both = np.concatenate([_both_halves(light, turn) for turn in turns_deg], axis=1)
    soft = head.nodes.soft @ both
    for number, turn in enumerate(turns_deg):
        columns = slice(6 * number, 6 * number + 6)
        found = np.ascontiguousarray(soft[:, columns])
        _add_lamps(head.nodes, light, turn, found)
        values = np.empty((head.nodes.shown, 12), np.float32)
        values[:, :6] = scattered(head.nodes, skin, found)
        values[:, 6:] = mirrored(head.nodes, light, turn)
        picture = _shaded(head, light, turn, _between(head, values))
        if head.hair is not None:
            _comb(head.hair, light, turn, both[:, columns], picture)
        yield picture


def _shaded(head: PortraitHead, light: PortraitLight, turn_deg: float, seen: Float32) -> Float32:
    """Put samples together from what comes out of skin, what it mirrors, and wet eyes."""
    samples, sheen = seen[:, :6].reshape(-1, _SIDES, 3), seen[:, 6:].reshape(-1, _SIDES, 3)
    samples *= head.albedo[:, None]
    sheen *= head.detail[:, None, None]
    samples += sheen
    way = head.glass_way
    for side, azimuth in enumerate(_around(way, turn_deg)):
        shine = _looked_up(light.panorama, azimuth, way[:, 1])
        samples[head.glass, side] += shine * head.glass_gain[:, None]
    return _placed(head, samples)


def _comb(
    hair: Hair, light: PortraitLight, turn_deg: float, both: Float32, picture: Float32
) -> None:
    """Lay hair and cloth over the picture.

    What a lamp adds is cut at zero by itself: a few functions do not hold all of it, and what is
    missing must not take the sky's colour away.
    """
    glow = np.maximum(hair.basis @ (hair.cells @ both), 0).reshape(-1, _SIDES, 3)
    for lamp in light.lamps:
        for side, at in enumerate(_azimuths(lamp, turn_deg)):
            near = _cells_around(lamp, at)
            share = np.maximum(hair.basis @ (hair.cells @ near), 0)
            glow[:, side] += share[:, None] * lamp.flux
    glow *= hair.colour[:, None]
    row, column = np.divmod(hair.pixel, picture.shape[1] // _SIDES)
    for side, shown in enumerate((column, picture.shape[1] - 1 - column)):
        picture[row, shown] *= (1 - hair.cover)[:, None]
        picture[row, shown] += glow[:, side]


def _cells_around(lamp: Lamp, azimuth: float) -> Float32:
    """Radiance of the cells next to a lamp that together send a flux of 1, (G,)."""
    rows, at, _, solid = grid()
    up = np.pi / 2 - (rows + 0.5) * np.pi / (rows[-1] + 1)
    cosine = np.sin(up) * math.sin(lamp.elevation)
    cosine += np.cos(up) * math.cos(lamp.elevation) * np.cos(at - azimuth)
    near = np.maximum(cosine - math.cos(max(lamp.radius, _NEAR)), 0)
    return np.asarray(near / (near @ solid), np.float32)


def _both_halves(light: PortraitLight, turn_deg: float) -> Float32:
    """Soft light of each cell, (G, 6): as it is, and mirrored."""
    soft = soft_light(light, turn_deg)
    return np.concatenate([soft, soft[mirrored_cells()]], axis=1)


def _add_lamps(nodes: SkinNodes, light: PortraitLight, turn_deg: float, found: Float32) -> None:
    """Add what enters the nodes, (N, 6), from small lamps: left half, then right one."""
    for lamp in light.lamps:
        for side, azimuth in enumerate(_azimuths(lamp, turn_deg)):
            mu = np.maximum(nodes.normals @ _toward(lamp, azimuth), 0)
            share = nodes.open_to(lamp, azimuth) * nodes.entering(mu)
            found[:, 3 * side : 3 * side + 3] += share[:, None] * lamp.flux


def scattered(nodes: SkinNodes, skin: PortraitSkin, found: Float32) -> Float32:
    """Light that comes out of each shown node toward the camera, (M, 6) float32."""
    sources = [found]
    for order, starts, size in nodes.patch_shares:
        sources.append(np.add.reduceat(found[order], starts, axis=0) * size)
    left = np.concatenate(sources)
    both = np.concatenate([left, np.roll(left, 3, axis=1)])
    out, part = (
        np.zeros((nodes.shown, 6), np.float32),
        np.empty((nodes.shown, 6), np.float32),
    )
    for source, share in zip(skin.source, skin.shares, strict=True):
        np.take(both, source, axis=0, out=part, mode="clip")
        part *= share
        out += part
    return out


def mirrored(nodes: SkinNodes, light: PortraitLight, turn_deg: float) -> Float32:
    """What the surface mirrors into the camera at each shown node, (M, 6) float32."""
    out = np.empty((nodes.shown, _SIDES, 3), np.float32)
    for side, azimuth in enumerate(_around(nodes.way, turn_deg)):
        out[:, side] = _looked_up(light.sheen, azimuth, nodes.way[:, 1]) * nodes.gain[:, None]
    for lamp in light.lamps[:GLINTS]:
        for side, place in enumerate(_azimuths(lamp, turn_deg)):
            _glint(nodes, lamp, place, out[:, side])
    return out.reshape(-1, 6)


def _azimuths(lamp: Lamp, turn_deg: float) -> tuple[float, float]:
    """Where a lamp stands for the left half, and for the mirrored right one."""
    turn = math.radians(turn_deg)
    return lamp.azimuth - turn, turn - lamp.azimuth


def _toward(lamp: Lamp, azimuth: float) -> Float32:
    way: Float32 = directions(np.array([azimuth]), np.array([lamp.elevation]))[0]
    return way


def _glint(nodes: SkinNodes, lamp: Lamp, azimuth: float, out: Float32) -> None:
    """Add what skin mirrors of a lamp.

    Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007: equation 20,
    with Beckmann's facets (25) and their shadowing (27).
    """
    way, count = _toward(lamp, azimuth), nodes.shown
    into = nodes.normals[:count] @ way
    opened = nodes.open_to(lamp, azimuth)[:count]
    lit = np.flatnonzero((into > 0) & (opened > 0) & ~nodes.eye[:count])
    normal, view, into = nodes.normals[lit], nodes.view[lit], into[lit]
    half = view + way
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    facet = np.clip((normal * half).sum(axis=1), 1e-3, 1) ** 2
    squared = np.float32(ROUGHNESS**2)
    density = np.exp((1 - 1 / facet) / squared) / (np.pi * squared * facet**2)
    straight = np.clip((normal * view).sum(axis=1), 1e-3, 1)
    grazing = 1 - np.clip((view * half).sum(axis=1), 0, 1)
    fresnel = _STRAIGHT + (1 - _STRAIGHT) * grazing**5
    value = fresnel * density * _shadowing(straight) * _shadowing(into) / (4 * straight)
    out[lit] += (value * opened[lit])[:, None] * lamp.flux


def _shadowing(cosine: Float32) -> Float32:
    """Share of Beckmann's facets that are not behind others; Walter's rational fit."""
    a = cosine / np.sqrt(np.maximum(1 - cosine**2, 1e-6)) / np.float32(ROUGHNESS)
    fit = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    return np.asarray(np.where(a < 1.6, fit, 1), np.float32)


def _around(way: Float32, turn_deg: float) -> tuple[Float32, Float32]:
    """Azimuths in the panorama of directions, for the left half and for the mirrored right one."""
    azimuth, turn = np.arctan2(-way[:, 0], way[:, 2]), np.float32(math.radians(turn_deg))
    return azimuth + turn, turn - azimuth


def _looked_up(source: Float32, azimuth: Float32, up: Float32) -> Float32:
    """Read a panorama of `PortraitLight` at directions, (n, 3)."""
    rows, columns = source.shape[0], source.shape[1] - 2
    x = (azimuth / np.float32(2 * np.pi) + np.float32(0.5)) % 1 * columns + np.float32(0.5)
    y = (0.5 - np.arcsin(np.clip(up, -1, 1)) / np.pi) * rows - 0.5
    count = -(-len(x) // _LINE) * _LINE
    maps = [np.resize(m.astype(np.float32), count).reshape(-1, _LINE) for m in (x, y)]
    found = cv2.remap(source, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found.reshape(-1, 3)[: len(x)])


def _between(head: PortraitHead, nodes: Float32) -> Float32:
    """Interpolate values of nodes at the samples."""
    out = nodes[head.three[:, 0]]
    out *= head.weights[:, :1]
    for k in (1, 2):
        part = nodes[head.three[:, k]]
        part *= head.weights[:, k : k + 1]
        out += part
    return out


def _placed(head: PortraitHead, samples: Float32) -> Float32:
    """Put samples of both halves, (S, 2, 3), into the picture."""
    rows, half = head.inside.shape
    out = np.zeros((rows, 2 * half, 3), np.float32)
    single = int(head.inside.sum())
    edge = samples[single:].reshape(-1, 4, _SIDES, 3).mean(axis=1)
    for side, part in enumerate((out[:, :half], out[:, ::-1][:, :half])):
        part[head.inside] = samples[:single, side]
        part[head.edge] = edge[:, side]
    return out
