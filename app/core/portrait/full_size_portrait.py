"""The portrait at full size: soft light from many directions, sharp shadows, sheen and wet eyes.

Light scattered by the skin is computed at nodes and distributed using data from the bake. The
surface's reflections come from the panorama, blurred by the reflection lobe of the surface.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.portrait.light import (
    GLINTS,
    ROUGHNESS,
    SHARP,
    Lamp,
    PortraitLight,
    grid,
    mirrored_cells,
    soft_light,
)
from app.core.portrait.portrait_head import (
    Hair,
    PortraitHead,
    PortraitSkin,
    SeenNodes,
    SkinNodes,
    Wide,
    cell_ways,
    directions,
)

_SIDES: Final = 2
_LINE: Final = 256
_BLOCK: Final = 8192
_NEAR: Final = 0.2  # radians around a lamp in which cells share its light
_STEEPEST: Final = np.float32(math.sqrt(0.5))
_INDEX: Final = np.float32(1.4)  # of skin
_NARROWING: Final = 0.75  # power of the view's cosine; a lobe narrows by 1 across, by 0.5 in area


def portrait_picture(
    head: PortraitHead, skin: PortraitSkin, light: PortraitLight, turn_deg: float
) -> Float32:
    """Render a head in the light of a place at one turn (see `portrait_pictures`)."""
    return next(portrait_pictures(head, skin, light, [turn_deg]))


def portrait_pictures(
    head: PortraitHead, skin: PortraitSkin, light: PortraitLight, turns_deg: Sequence[float]
) -> Iterator[Float32]:
    """Render a head at several turns, one at a time.

    Args:
        turns_deg: Azimuths in the panorama that the sitter's nose points to, in degrees.

    Returns:
        One picture for each turn, (rows, columns, 3) float32. Linear Rec. 709 on black, in the same
        unit as the panorama.
    """
    skin = skin.only(head)
    both = np.concatenate([_both_halves(head, light, turn) for turn in turns_deg], axis=1)
    soft = head.nodes.soft @ both
    for number, turn in enumerate(turns_deg):
        columns = slice(6 * number, 6 * number + 6)
        soft_columns = np.ascontiguousarray(soft[:, columns])
        yield _draw(head, skin, light, turn, soft_columns, both[:, columns])


def _draw(
    head: PortraitHead,
    skin: PortraitSkin,
    light: PortraitLight,
    turn_deg: float,
    soft: Float32,
    both: Float32,
) -> Float32:
    """Render one turn from the soft light entering the nodes, (N, 6), and that of the cells."""
    sheen, lights = _mirrored(head, light, turn_deg), [both]
    places, ways = _places(head, light, turn_deg)
    if places:
        openness = np.stack([head.nodes.open_to(*place) for place in places])
        fluxes, glints = _fluxes(light), slice(_SIDES * GLINTS)
        soft += _let_in(head.nodes, ways, openness) @ fluxes
        lights.append(_cells_around(places, ways) @ fluxes)
        mirrored, count = openness[glints], 3 * len(head.halves)
        if head.yaw_deg:
            # A node of the other half sees a lamp as its mirror image sees the mirrored lamp.
            glints = slice(0, _SIDES * GLINTS, _SIDES)
            mirrored = np.concatenate([mirrored[::2], mirrored[1::2]], axis=1)
        sheen += _glints(head.visible, ways[glints], mirrored) @ fluxes[glints, :count]
    skin_light = _toward(head, scattered(head.nodes, skin, soft))
    samples = _shaded(head.wide, skin_light, sheen)
    for side, shine in enumerate(eye_shine(head, light, turn_deg)):
        samples[head.glass, 3 * side : 3 * side + 3] += shine
    picture = _to_picture(head, samples)
    if head.hair is not None:
        _comb(head, head.hair, lights, picture)
    return picture


def eye_shine(head: PortraitHead, light: PortraitLight, turn_deg: float) -> list[Float32]:
    """Return the reflections in the eyes, (G, 3), for each half of the head."""
    way, gain = head.glass_way, head.glass_gain[:, None]
    around = _around(head, way, turn_deg)
    return [_looked_up(light.panorama, azimuth, way[:, 1]) * gain for azimuth in around]


def _shaded(wide: Wide, skin_light: Float32, sheen: Float32) -> Float32:
    """Combine the light leaving the skin and its reflections, given at nodes, as samples, (S, n).

    The samples are computed block by block, so that the working data stay in the CPU cache.
    """
    samples = np.empty(wide.albedo.shape, np.float32)
    parts = np.empty((2, _BLOCK, wide.albedo.shape[1]), np.float32)
    for start in range(0, len(samples), _BLOCK):
        block = slice(start, start + _BLOCK)
        out = samples[block]
        shine, part = parts[:, : len(out)]
        _between(wide, block, skin_light, out, part)
        _between(wide, block, sheen, shine, part)
        out *= wide.albedo[block]
        shine *= wide.detail[block]
        out += shine
    return samples


def _between(wide: Wide, block: slice, nodes: Float32, out: Float32, part: Float32) -> None:
    """Interpolate the values of nodes, (M, n), at a block of samples."""
    np.take(nodes, wide.corners[0, block], axis=0, out=out, mode="clip")
    out *= wide.weights[0, block]
    for corner, weight in zip(wide.corners[1:, block], wide.weights[1:, block], strict=True):
        np.take(nodes, corner, axis=0, out=part, mode="clip")
        part *= weight
        out += part


def _to_picture(head: PortraitHead, samples: Float32) -> Float32:
    """Write the samples of all halves, (S, n), to the picture."""
    wide, (rows, columns) = head.wide, head.shape
    out = np.zeros((rows * columns, 3), np.float32)
    single = wide.single.shape[1]
    four = samples[single:].reshape(-1, 4, samples.shape[1])
    edge = (four[:, 0] + four[:, 1] + four[:, 2] + four[:, 3]) * np.float32(0.25)
    for side in range(len(head.halves)):
        half = slice(3 * side, 3 * side + 3)
        out[wide.single[side]] = samples[:single, half]
        out[wide.four[side]] = edge[:, half]
    return out.reshape(rows, columns, 3)


def _comb(head: PortraitHead, hair: Hair, lights: list[Float32], picture: Float32) -> None:
    """Blend hair and cloth into the picture, as lit by `lights`, (G, 6) each."""
    sides = len(head.halves)
    # The lamps' part is clipped at zero separately: the few functions do not contain all of it, and
    # the missing part must not remove the sky's colour. Matrix products, channel by channel, are
    # twelve times as fast as a sum over three indices.
    cells = np.ascontiguousarray(hair.cells.transpose(2, 0, 1))
    parts = (cells @ one.reshape(-1, _SIDES, 3)[:, :sides].transpose(2, 0, 1) for one in lights)
    counts = (part.transpose(1, 2, 0).reshape(-1, 3 * sides) for part in parts)
    glow = np.add.reduce([np.maximum(hair.basis @ count, 0) for count in counts])
    places, keep, colour = head.combed
    glow *= colour
    flat = picture.reshape(-1, 3)
    for side, place in enumerate(places):
        under = np.take(flat, place, axis=0, mode="clip")
        under *= keep
        under += glow[:, 3 * side : 3 * side + 3]
        flat[place] = under


def _cells_around(places: list[tuple[Lamp, float]], ways: Float32) -> Float32:
    """Return the radiance of the cells around each lamp for a total flux of 1 per lamp, (G, n)."""
    least = np.array([math.cos(max(lamp.radius, _NEAR)) for lamp, _ in places], np.float32)
    near = np.maximum(cell_ways() @ ways.T - least, 0)
    return np.asarray(near / (grid()[3] @ near), np.float32)


def _both_halves(head: PortraitHead, light: PortraitLight, turn_deg: float) -> Float32:
    """Return the soft light in each cell, (G, 6), for the first half and its mirror image."""
    soft = soft_light(light, turn_deg)
    return np.concatenate([soft, soft[mirrored_cells()]][:: head.halves[0]], axis=1)


def _places(
    head: PortraitHead, light: PortraitLight, turn_deg: float
) -> tuple[list[tuple[Lamp, float]], Float32]:
    """Return the sharp lamps, with azimuths as in `_both_halves`, and their directions, (n, 3)."""
    turn, lamps, first = math.radians(turn_deg), light.lamps[:SHARP], head.halves[0]
    places = [(lamp, side * (lamp.azimuth - turn)) for lamp in lamps for side in (first, -first)]
    angles = np.array([(azimuth, lamp.elevation) for lamp, azimuth in places]).reshape(-1, 2)
    return places, directions(*angles.T)


def _fluxes(light: PortraitLight) -> Float32:
    """Return the light that each lamp in `_places` contributes to the two halves, (n, 6)."""
    flux = np.array([lamp.flux for lamp in light.lamps[:SHARP]], np.float32)
    both = np.eye(_SIDES, dtype=np.float32)[..., None] * flux.reshape(-1, 1, 1, 3)
    return np.asarray(both.reshape(-1, 6))


def _let_in(nodes: SkinNodes, ways: Float32, openness: Float32) -> Float32:
    """Return the light entering the nodes, (N, n), from lamps with a flux of 1.

    Args:
        openness: (n, N). Fraction of each lamp that is visible from each node.
    """
    mu = ways @ nodes.normals.T
    return np.asarray((nodes.entering(np.maximum(mu, 0, out=mu)) * openness).T)


def scattered(nodes: SkinNodes, skin: PortraitSkin, values: Float32) -> Float32:
    """Return the light leaving each visible node towards the camera, (M, 6) float32."""
    sources = [values]
    for order, starts, size in nodes.patch_shares:
        per_node = np.take(values, order, axis=0, mode="clip")
        sources.append(np.add.reduceat(per_node, starts, axis=0) * size)
    left = np.concatenate(sources)
    both = np.concatenate([left, np.concatenate([left[:, 3:], left[:, :3]], axis=1)])
    out = np.zeros(skin.shares.shape[1:], np.float32)
    part = np.empty_like(out)
    for source, share in zip(skin.source, skin.shares, strict=True):
        np.take(both, source, axis=0, out=part, mode="clip")
        part *= share
        out += part
    return out


def _toward(head: PortraitHead, light: Float32) -> Float32:
    """Return the skin's light towards the camera at each visible node, (M, n), from the lit nodes.

    Args:
        light: (L, 6) float32. The light leaving the lit nodes.
    """
    if not head.yaw_deg:
        return light
    both = np.concatenate([light[:, :3], light[:, 3:]])
    return np.take(both, head.lit_nodes[1], axis=0) * head.visible.passes


def _mirrored(head: PortraitHead, light: PortraitLight, turn_deg: float) -> Float32:
    """Return the reflections at each visible node, excluding lamps, (M, n) float32."""
    visible = head.visible
    out = np.empty((len(visible.index), len(head.halves), 3), np.float32)
    # Lobes of width ROUGHNESS cos^p, between the two by which the light is blurred.
    above = np.clip(2 * np.maximum(visible.straight, 0) ** _NARROWING - 1, 0, 1)[:, None]
    for side, azimuth in enumerate(_around(head, visible.way, turn_deg)):
        both = _looked_up(light.sheen, azimuth, visible.way[:, 1])
        out[:, side] = (both[:, :3] + above * (both[:, 3:] - both[:, :3])) * visible.gain[:, None]
    return out.reshape(len(out), -1)


def _glints(nodes: SeenNodes, ways: Float32, openness: Float32) -> Float32:
    """Return the skin's reflections, (M, n), of lamps with a flux of 1 and visible parts (n, N).

    See Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007: equation
    20, with Beckmann's facets (25) and their shadowing (27).
    """
    into, toward_lens = ways @ nodes.normals.T, ways @ nodes.view.T
    # Half-way between lamp and camera; the length is that of the sum of two unit vectors.
    length = np.sqrt(np.maximum(2 + 2 * toward_lens, 1e-6))
    facet = (nodes.straight + into) / length
    # Facets steeper than 45 degrees are negligible.
    mask = (into > 0) & (facet > _STEEPEST) & ~nodes.eye
    straight = np.maximum(np.broadcast_to(nodes.straight, mask.shape)[mask], 1e-3)
    facet = np.minimum(facet[mask], 1) ** 2
    squared = np.float32(ROUGHNESS**2)
    density = np.exp((1 - 1 / facet) / squared) / (np.pi * squared * facet**2)
    mirrored = fresnel((1 + toward_lens[mask]) / length[mask])
    out = np.zeros(mask.shape, np.float32)
    out[mask] = mirrored * density * shadowing(straight) * shadowing(into[mask]) / (4 * straight)
    return np.asarray((out * openness[:, nodes.index]).T)


def fresnel(cosine: Float32) -> Float32:
    """Return the fraction of light that skin reflects at an angle to the facet.

    See Walter et al., equation 22.

    Args:
        cosine: float32, any shape. Cosine of the angle to the facet.
    """
    inside = np.sqrt(_INDEX**2 - 1 + cosine**2)
    less, more = inside - cosine, inside + cosine
    along = (cosine * more - 1) / (cosine * less + 1)
    return np.asarray((less / more) ** 2 / 2 * (1 + along**2), np.float32)


def shadowing(cosine: Float32, roughness: float = ROUGHNESS) -> Float32:
    """Return the fraction of Beckmann facets that others do not hide, using Walter's rational fit.

    Args:
        cosine: float32, any shape. Cosine of the angle to the surface normal.
    """
    a = cosine / np.sqrt(np.maximum(1 - cosine**2, 1e-6)) / np.float32(roughness)
    fit = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    return np.asarray(np.where(a < 1.6, fit, 1), np.float32)


def _around(head: PortraitHead, way: Float32, turn_deg: float) -> list[Float32]:
    """Return the panorama azimuths of directions, for each of the head's `halves`."""
    azimuth, turn = np.arctan2(-way[:, 0], way[:, 2]), np.float32(math.radians(turn_deg))
    return [turn + side * azimuth for side in head.halves]


def _looked_up(source: Float32, azimuth: Float32, up: Float32) -> Float32:
    """Sample a panorama of `PortraitLight` in the given directions, (n, 3) or (n, 6)."""
    rows, columns = source.shape[0], source.shape[1] - 2
    x = (azimuth / np.float32(2 * np.pi) + np.float32(0.5)) % 1 * columns + np.float32(0.5)
    y = (0.5 - np.arcsin(np.clip(up, -1, 1)) / np.pi) * rows - 0.5
    count = -(-len(x) // _LINE) * _LINE
    maps = [np.resize(m.astype(np.float32), count).reshape(-1, _LINE) for m in (x, y)]
    result = cv2.remap(source, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(result.reshape(-1, source.shape[2])[: len(x)])
